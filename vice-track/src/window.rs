//! The neighbourhood of a place in an image: gray values and gradients at places between the pixels.
//!
//! A window is 21 columns and rows. Rows are stored 24 wide, three vectors of eight; the gradients of the three columns
//! too many are zero, so that they count for nothing.

use fearless_simd::{Simd, SimdBase, f32x8};

use crate::pyramid::{Level, WINDOW_PX, mirrored};

/// Columns of a stored row of a window.
pub(crate) const ROW: usize = 24;
const LANES: usize = 8;
/// Columns and rows of a [`Region`]: room for a window to move by seven columns and six rows.
const REGION_COLUMNS: usize = 32;
const REGION_ROWS: usize = 28;
/// Window columns and rows with the neighbours that interpolation takes, and room for a vector too many.
const NEEDED: [isize; 2] = [(ROW + 1) as isize, (WINDOW_PX + 1) as isize];

/// A place split into whole pixels and the rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) x: isize,
    pub(crate) y: isize,
    fx: f32,
    fy: f32,
}

impl Corner {
    /// The top left pixel of the window around a place.
    pub(crate) fn of_window(centre: [f32; 2]) -> Self {
        let half = (WINDOW_PX / 2) as f32;
        let (u, v) = (centre[0] - half, centre[1] - half);
        let (x, y) = (u.floor(), v.floor());
        Self { x: x as isize, y: y as isize, fx: u - x, fy: v - y }
    }

    /// Whether the window has a pixel in the image.
    pub(crate) fn touches(self, level: &Level) -> bool {
        let window = WINDOW_PX as isize;
        self.x >= -window
            && self.y >= -window
            && self.x < level.width as isize
            && self.y < level.height as isize
    }

    fn is_inside(self, level: &Level, margin: isize, columns: isize, rows: isize) -> bool {
        self.x >= margin
            && self.y >= margin
            && self.x + columns + margin <= level.width as isize
            && self.y + rows + margin <= level.height as isize
    }
}

/// Pixels of a part of an image as numbers, mirrored where the part reaches beyond the border.
pub(crate) struct Region {
    x: isize,
    y: isize,
    values: [f32; REGION_COLUMNS * REGION_ROWS],
}

impl Region {
    /// Nothing yet: it holds no window.
    pub(crate) const fn empty() -> Self {
        Self { x: isize::MIN / 2, y: 0, values: [0.0; REGION_COLUMNS * REGION_ROWS] }
    }

    /// Holds no window any more: the next one is of another image.
    pub(crate) const fn forget(&mut self) {
        self.x = isize::MIN / 2;
    }

    /// Loads the pixels around a window, unless they are here.
    #[inline(always)]
    pub(crate) fn cover(&mut self, level: &Level, corner: Corner) {
        let (dx, dy) = (corner.x - self.x, corner.y - self.y);
        let fits = dx >= 0
            && dy >= 0
            && dx + NEEDED[0] <= REGION_COLUMNS as isize
            && dy + NEEDED[1] <= REGION_ROWS as isize;
        if !fits {
            self.load(level, corner.x - 3, corner.y - 3);
        }
    }

    #[inline(always)]
    fn load(&mut self, level: &Level, x: isize, y: isize) {
        (self.x, self.y) = (x, y);
        let inside = x >= 0 && x as usize + REGION_COLUMNS <= level.width;
        for (i, row) in self.values.chunks_exact_mut(REGION_COLUMNS).enumerate() {
            let line = mirrored(y + i as isize, level.height) * level.width;
            if inside {
                let pixels = &level.pixels[line + x as usize..][..REGION_COLUMNS];
                for (value, pixel) in row.iter_mut().zip(pixels) {
                    *value = f32::from(*pixel);
                }
            } else {
                for (j, value) in row.iter_mut().enumerate() {
                    *value = f32::from(level.pixels[line + mirrored(x + j as isize, level.width)]);
                }
            }
        }
    }

    /// Row `row` of the window at `corner` and the neighbour to the right of its last column.
    #[inline(always)]
    fn row(&self, corner: Corner, row: usize) -> &[f32] {
        let start = ((corner.y - self.y) as usize + row) * REGION_COLUMNS + (corner.x - self.x) as usize;
        &self.values[start..][..ROW + 1]
    }
}

/// A row between two columns: `a + fx (b - a)`.
#[inline(always)]
fn between<S: Simd>(simd: S, row: &[f32], fx: f32x8<S>) -> [f32x8<S>; 3] {
    let row = &row[..ROW + 1];
    // Written out: a closure would not be compiled for the vectors of this machine.
    let [a0, a1, a2] = [
        f32x8::from_slice(simd, &row[0..8]),
        f32x8::from_slice(simd, &row[8..16]),
        f32x8::from_slice(simd, &row[16..24]),
    ];
    let [b0, b1, b2] = [
        f32x8::from_slice(simd, &row[1..9]),
        f32x8::from_slice(simd, &row[9..17]),
        f32x8::from_slice(simd, &row[17..25]),
    ];
    [a0 + (b0 - a0) * fx, a1 + (b1 - a1) * fx, a2 + (b2 - a2) * fx]
}

/// What a window looks like: gray values and their gradient (gray levels a pixel) at each place.
pub(crate) struct Patch {
    value: [f32; ROW * WINDOW_PX],
    right: [f32; ROW * WINDOW_PX],
    down: [f32; ROW * WINDOW_PX],
}

/// Rows and columns of the values that the gradients of a window are taken from: one more on each side.
const WIDE: usize = WINDOW_PX + 2;
const WIDE_ROW: usize = ROW + LANES;

impl Patch {
    /// Nothing yet.
    pub(crate) const fn empty() -> Self {
        Self { value: [0.0; ROW * WINDOW_PX], right: [0.0; ROW * WINDOW_PX], down: [0.0; ROW * WINDOW_PX] }
    }

    /// The window around a place: values linear between pixels, gradients by Scharr's kernel.
    ///
    /// Beyond the image's border the gradient is zero, as OpenCV has it.
    #[inline(always)]
    pub(crate) fn cut<S: Simd>(&mut self, simd: S, level: &Level, corner: Corner) {
        if corner.is_inside(level, 1, (WIDE_ROW + 1) as isize, (WIDE + 1) as isize) {
            self.cut_inside(simd, level, corner);
        } else {
            self.cut_at_border(level, corner);
        }
    }

    #[inline(always)]
    fn cut_inside<S: Simd>(&mut self, simd: S, level: &Level, corner: Corner) {
        let start = (corner.y - 1) as usize * level.width + (corner.x - 1) as usize;
        let line = |row: usize| &level.pixels[start + row * level.width..][..WIDE_ROW + 1];
        let mut wide = [0.0_f32; WIDE_ROW * WIDE];
        let mut rows = [[0.0_f32; WIDE_ROW]; 2];
        between_columns(line(0), corner.fx, &mut rows[0]);
        for (i, out) in wide.chunks_exact_mut(WIDE_ROW).enumerate() {
            let [upper, lower] = &mut rows;
            between_columns(line(i + 1), corner.fx, lower);
            for j in 0..WIDE_ROW {
                out[j] = upper[j] + corner.fy * (lower[j] - upper[j]);
            }
            rows.swap(0, 1);
        }
        let (near, far) = (f32x8::splat(simd, 3.0 / 32.0), f32x8::splat(simd, 10.0 / 32.0));
        let last = f32x8::from_slice(simd, &[1.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        for row in 0..WINDOW_PX {
            for part in 0..3 {
                let column = part * LANES;
                let [a, b, c] = [
                    load(simd, &wide, row, column),
                    load(simd, &wide, row, column + 1),
                    load(simd, &wide, row, column + 2),
                ];
                let [d, e, f] = [
                    load(simd, &wide, row + 1, column),
                    load(simd, &wide, row + 1, column + 1),
                    load(simd, &wide, row + 1, column + 2),
                ];
                let [g, h, i] = [
                    load(simd, &wide, row + 2, column),
                    load(simd, &wide, row + 2, column + 1),
                    load(simd, &wide, row + 2, column + 2),
                ];
                let mut right = (c - a + (i - g)) * near + (f - d) * far;
                let mut down = (g - a + (i - c)) * near + (h - b) * far;
                if part == 2 {
                    (right, down) = (right * last, down * last);
                }
                let at = row * ROW + column;
                e.store_slice(&mut self.value[at..at + LANES]);
                right.store_slice(&mut self.right[at..at + LANES]);
                down.store_slice(&mut self.down[at..at + LANES]);
            }
        }
    }

    /// Gradients first, zero outside, and what lies between pixels of them after that.
    #[inline(always)]
    fn cut_at_border(&mut self, level: &Level, corner: Corner) {
        const COLUMNS: usize = 32;
        let mut columns = [0; COLUMNS + 2];
        let mut column_counts = [0.0_f32; COLUMNS];
        for (i, column) in columns.iter_mut().enumerate() {
            *column = mirrored(corner.x - 1 + i as isize, level.width);
        }
        for (i, counts) in column_counts.iter_mut().enumerate() {
            let x = corner.x + i as isize;
            *counts = if x >= 0 && x < level.width as isize { 1.0 / 32.0 } else { 0.0 };
        }
        let mut pixels = [[0.0_f32; COLUMNS + 2]; WINDOW_PX + 3];
        for (i, row) in pixels.iter_mut().enumerate() {
            let line = mirrored(corner.y - 1 + i as isize, level.height) * level.width;
            for (value, column) in row.iter_mut().zip(&columns) {
                *value = f32::from(level.pixels[line + column]);
            }
        }
        let mut gradients = [[[0.0_f32; COLUMNS]; WINDOW_PX + 1]; 2];
        for y in 0..=WINDOW_PX {
            let row = corner.y + y as isize;
            if row < 0 || row >= level.height as isize {
                continue;
            }
            let (above, here, below) = (&pixels[y], &pixels[y + 1], &pixels[y + 2]);
            for x in 0..COLUMNS {
                let right = 3.0 * (above[x + 2] - above[x] + (below[x + 2] - below[x]))
                    + 10.0 * (here[x + 2] - here[x]);
                let down = 3.0 * (below[x] - above[x] + (below[x + 2] - above[x + 2]))
                    + 10.0 * (below[x + 1] - above[x + 1]);
                gradients[0][y][x] = right * column_counts[x];
                gradients[1][y][x] = down * column_counts[x];
            }
        }
        let (fx, fy) = (corner.fx, corner.fy);
        for row in 0..WINDOW_PX {
            let at = row * ROW;
            between_rows(&pixels[row + 1][1..], &pixels[row + 2][1..], [fx, fy], &mut self.value[at..]);
            let [right, down] = &gradients;
            between_rows(&right[row], &right[row + 1], [fx, fy], &mut self.right[at..]);
            between_rows(&down[row], &down[row + 1], [fx, fy], &mut self.down[at..]);
            for column in at + WINDOW_PX..at + ROW {
                (self.right[column], self.down[column]) = (0.0, 0.0);
            }
        }
    }

    /// Sums of the products of the gradients: right·right, right·down, down·down.
    #[inline(always)]
    pub(crate) fn structure<S: Simd>(&self, simd: S) -> [f32; 3] {
        let zero = f32x8::splat(simd, 0.0);
        let (mut xx, mut xy, mut yy) = (zero, zero, zero);
        for (right, down) in self.right.chunks_exact(LANES).zip(self.down.chunks_exact(LANES)) {
            let (right, down) = (f32x8::from_slice(simd, right), f32x8::from_slice(simd, down));
            xx += right * right;
            xy += right * down;
            yy += down * down;
        }
        [sum(xx), sum(xy), sum(yy)]
    }

    /// Sums of the gradients times how much brighter the region is than the patch, for the window at `corner`.
    #[inline(always)]
    pub(crate) fn mismatch<S: Simd>(&self, simd: S, region: &Region, corner: Corner) -> [f32; 2] {
        let (fx, fy) = (f32x8::splat(simd, corner.fx), f32x8::splat(simd, corner.fy));
        let zero = f32x8::splat(simd, 0.0);
        let (mut x, mut y) = ([zero; 3], [zero; 3]);
        let mut upper = between(simd, region.row(corner, 0), fx);
        for row in 0..WINDOW_PX {
            let lower = between(simd, region.row(corner, row + 1), fx);
            let at = row * ROW;
            let value = &self.value[at..at + ROW];
            let right = &self.right[at..at + ROW];
            let down = &self.down[at..at + ROW];
            for part in 0..3 {
                let lanes = part * LANES..(part + 1) * LANES;
                let now = upper[part] + (lower[part] - upper[part]) * fy;
                let more = now - f32x8::from_slice(simd, &value[lanes.clone()]);
                x[part] += more * f32x8::from_slice(simd, &right[lanes.clone()]);
                y[part] += more * f32x8::from_slice(simd, &down[lanes]);
            }
            upper = lower;
        }
        [sum(x[0] + x[1] + x[2]), sum(y[0] + y[1] + y[2])]
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, wide: &[f32], row: usize, column: usize) -> f32x8<S> {
    f32x8::from_slice(simd, &wide[row * WIDE_ROW + column..][..LANES])
}

/// In this order on every machine, so that every machine gives the same bits.
#[inline(always)]
fn sum<S: Simd>(lanes: f32x8<S>) -> f32 {
    let mut values = [0.0; LANES];
    lanes.store_slice(&mut values);
    let [a, b, c, d, e, f, g, h] = values;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

#[inline(always)]
fn between_columns(pixels: &[u8], fx: f32, out: &mut [f32; WIDE_ROW]) {
    let pixels = &pixels[..WIDE_ROW + 1];
    for j in 0..WIDE_ROW {
        let (a, b) = (f32::from(pixels[j]), f32::from(pixels[j + 1]));
        out[j] = a + fx * (b - a);
    }
}

#[inline(always)]
fn between_rows(upper: &[f32], lower: &[f32], [fx, fy]: [f32; 2], out: &mut [f32]) {
    let (upper, lower, out) = (&upper[..ROW + 1], &lower[..ROW + 1], &mut out[..ROW]);
    for i in 0..ROW {
        let above = upper[i] + fx * (upper[i + 1] - upper[i]);
        let below = lower[i] + fx * (lower[i + 1] - lower[i]);
        out[i] = above + fy * (below - above);
    }
}
