//! Many points at once as the rows of an array, which is how other languages hold them.

use super::kernels::{Project, Unproject};
use crate::camera::{Camera, with_lens};
use crate::lanes::{Kernel, run};

/// Points that are turned into columns at a time: they and their results stay in the nearest cache.
const BLOCK: usize = 512;
/// Points that a thread works on at a time.
const PIECE: usize = 16_384;

impl Camera {
    /// Projects the points `[x, y, z]` of the camera frame (metres) to the pixels `[u, v]`, in one pass over memory.
    ///
    /// The same numbers as [`Camera::project_batch`]. Where a point does not project its pixel is NaN. Returns how many
    /// do. On several threads from some ten thousand points on.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn project_rows(&self, xyz_m: &[[f64; 3]], uv_px: &mut [[f64; 2]]) -> usize {
        assert_eq!(xyz_m.len(), uv_px.len(), "project_rows: slices differ in length");
        with_lens!(self, bound => in_pieces(Project { bound }, xyz_m, uv_px, &|columns| columns))
    }

    /// The rays `[x, y, 1]` of the pixels `[u, v]`, in one pass over memory.
    ///
    /// The same numbers as [`Camera::unproject_batch`]. Where a pixel has no ray all three are NaN. Returns how many
    /// have one. On several threads from some ten thousand pixels on.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn unproject_rows(&self, uv_px: &[[f64; 2]], rays: &mut [[f64; 3]]) -> usize {
        assert_eq!(uv_px.len(), rays.len(), "unproject_rows: slices differ in length");
        let with_one = |[x, y]: [f64; 2]| [x, y, if x.is_nan() { f64::NAN } else { 1.0 }];
        with_lens!(self, bound => in_pieces(Unproject { bound }, uv_px, rays, &with_one))
    }
}

/// Shares large pieces among threads.
fn in_pieces<K: Kernel<IN, 2>, const IN: usize, const OUT: usize>(
    kernel: K,
    input: &[[f64; IN]],
    output: &mut [[f64; OUT]],
    row: &(impl Fn([f64; 2]) -> [f64; OUT] + Sync),
) -> usize {
    if input.len() <= PIECE || crate::parallel::current_num_threads() == 1 {
        return in_blocks(kernel, input, output, row);
    }
    let middle = (input.len() / 2).next_multiple_of(BLOCK);
    let (input_a, input_b) = input.split_at(middle);
    let (output_a, output_b) = output.split_at_mut(middle);
    let (a, b) = crate::parallel::join(
        || in_pieces(kernel, input_a, output_a, row),
        || in_pieces(kernel, input_b, output_b, row),
    );
    a + b
}

/// Turns blocks of rows into columns, and the results back.
fn in_blocks<K: Kernel<IN, 2>, const IN: usize, const OUT: usize>(
    kernel: K,
    input: &[[f64; IN]],
    output: &mut [[f64; OUT]],
    row: &impl Fn([f64; 2]) -> [f64; OUT],
) -> usize {
    let mut columns = [[0.0; BLOCK]; IN];
    let [mut first, mut second] = [[0.0; BLOCK]; 2];
    let mut count = 0;
    for (from, to) in input.chunks(BLOCK).zip(output.chunks_mut(BLOCK)) {
        let n = from.len();
        for (i, point) in from.iter().enumerate() {
            for k in 0..IN {
                columns[k][i] = point[k];
            }
        }
        let of_block = columns.each_ref().map(|column| &column[..n]);
        count += run("rows", kernel, of_block, [&mut first[..n], &mut second[..n]], None);
        for ((to, a), b) in to.iter_mut().zip(&first).zip(&second) {
            *to = row([*a, *b]);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::super::tests::lenses;

    /// Points in front of, behind and far beside the camera, and some that are none.
    fn points(n: usize) -> Vec<[f64; 3]> {
        let point = |i: usize| {
            let t = i as f64;
            let z = if i.is_multiple_of(11) { -1.0 } else { 0.5 + (t * 0.37).fract() * 6.0 };
            let x = if i.is_multiple_of(97) { f64::NAN } else { (t * 0.61).fract() * 8.0 - 4.0 };
            [x, (t * 0.83).fract() * 6.0 - 3.0, z]
        };
        (0..n).map(point).collect()
    }

    #[test]
    fn rows_are_projected_as_columns_are() {
        for n in [0, 1, 7, 511, 512, 513, 40_000] {
            let xyz = points(n);
            let axis = |k: usize| xyz.iter().map(|p| p[k]).collect::<Vec<f64>>();
            let (x, y, z) = (axis(0), axis(1), axis(2));
            for (name, camera) in lenses() {
                let (mut u, mut v, mut valid) = (vec![0.0; n], vec![0.0; n], vec![false; n]);
                let expected = camera.project_batch([&x, &y, &z], [&mut u, &mut v], &mut valid);
                let mut uv = vec![[7.0; 2]; n];
                assert_eq!(camera.project_rows(&xyz, &mut uv), expected, "{name}");
                for i in 0..n {
                    assert_eq!(uv[i].map(f64::to_bits), [u[i], v[i]].map(f64::to_bits), "{name} {i}");
                }
                let mut rays = vec![[7.0; 3]; n];
                let (mut rx, mut ry) = (vec![0.0; n], vec![0.0; n]);
                let found = camera.unproject_batch([&u, &v], [&mut rx, &mut ry], &mut valid);
                assert_eq!(camera.unproject_rows(&uv, &mut rays), found, "{name}");
                for i in 0..n {
                    let z = if valid[i] { 1.0 } else { f64::NAN };
                    assert_eq!(rays[i].map(f64::to_bits), [rx[i], ry[i], z].map(f64::to_bits), "{name} {i}");
                }
            }
        }
    }
}
