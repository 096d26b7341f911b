//! Many points at once as the rows of an array, which is how other languages hold them.

use pulp::{Simd, WithSimd};

use super::kernels::{Project, Unproject};
use crate::camera::{Camera, with_lens};
use crate::lanes::{ARCH, Kernel, run};
use crate::parallel::{Piece, total};

/// Points that are turned into columns at a time: they and their results stay in the nearest cache.
const BLOCK: usize = 128;
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
        with_lens!(self, bound => in_pieces(Project { bound }, xyz_m, uv_px))
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
        with_lens!(self, bound => in_pieces(Unproject { bound }, uv_px, rays))
    }
}

/// Shares large pieces among threads.
fn in_pieces<K: Kernel<IN, 2>, const IN: usize, const OUT: usize>(
    kernel: K,
    input: &[[f64; IN]],
    output: &mut [[f64; OUT]],
) -> usize {
    let blocks = |input, output| ARCH.dispatch(Blocks { kernel, input, output });
    if input.len() <= PIECE || crate::parallel::current_num_threads() == 1 {
        return blocks(input, output);
    }
    let pieces = input.chunks(PIECE).zip(output.chunks_mut(PIECE));
    total(pieces.map(|(input, output)| -> Piece<'_> { Box::new(move || blocks(input, output)) }).collect())
}

/// Turns blocks of rows into columns, and the results back: for the widest instruction set, since moving numbers about
/// costs as much as the arithmetic.
struct Blocks<'a, K, const IN: usize, const OUT: usize> {
    kernel: K,
    input: &'a [[f64; IN]],
    output: &'a mut [[f64; OUT]],
}

impl<K: Kernel<IN, 2>, const IN: usize, const OUT: usize> WithSimd for Blocks<'_, K, IN, OUT> {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        let (input, input_rest) = self.input.as_chunks::<BLOCK>();
        let (output, output_rest) = self.output.as_chunks_mut::<BLOCK>();
        let mut columns = Columns { input: [[0.0; BLOCK]; IN], output: [[0.0; BLOCK]; 2] };
        let (mut count, mut i) = (0, 0);
        while i < input.len() {
            count += block(self.kernel, &mut columns, &input[i], &mut output[i], BLOCK);
            i += 1;
        }
        if input_rest.is_empty() {
            return count;
        }
        let n = input_rest.len();
        let (mut from, mut to) = ([[0.0; IN]; BLOCK], [[0.0; OUT]; BLOCK]);
        from[..n].copy_from_slice(input_rest);
        count += block(self.kernel, &mut columns, &from, &mut to, n);
        output_rest.copy_from_slice(&to[..n]);
        count
    }
}

/// A block as columns, and its results.
struct Columns<const IN: usize> {
    input: [[f64; BLOCK]; IN],
    output: [[f64; BLOCK]; 2],
}

/// The first `n` points of a block. Its length is known to the compiler, which then moves many numbers at once.
// Loops count: an iterator's closure might be compiled for the smallest instruction set.
#[allow(clippy::needless_range_loop)]
#[inline(always)]
fn block<K: Kernel<IN, 2>, const IN: usize, const OUT: usize>(
    kernel: K,
    columns: &mut Columns<IN>,
    from: &[[f64; IN]; BLOCK],
    to: &mut [[f64; OUT]; BLOCK],
    n: usize,
) -> usize {
    let Columns { input, output: [first, second] } = columns;
    for i in 0..BLOCK {
        for k in 0..IN {
            input[k][i] = from[i][k];
        }
    }
    let mut of_block: [&[f64]; IN] = [&[]; IN];
    for k in 0..IN {
        of_block[k] = &input[k][..n];
    }
    let count = run("rows", kernel, of_block, [&mut first[..n], &mut second[..n]], None);
    for i in 0..BLOCK {
        to[i][0] = first[i];
        to[i][1] = second[i];
        if OUT == 3 {
            // The ray's third number, where there is a ray.
            to[i][2] = if first[i].is_nan() { f64::NAN } else { 1.0 };
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
