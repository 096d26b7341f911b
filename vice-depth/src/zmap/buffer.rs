//! The z-buffer: which disc is nearest at each cell of a window.

use super::queries::floor;
use super::select::Window;

const EMPTY: u64 = u64::MAX;

/// Nearest disc of each cell of a window: depth in the upper half as the bits of a float, which sort as the float
/// does, and the leaf in the lower. The least of these does not depend on the order of drawing.
pub(super) struct Buffer {
    cell_px: f64,
    columns: usize,
    first: [i64; 2],
    nearest: Vec<u64>,
}

impl Buffer {
    pub(super) fn new(window: &Window, cell_px: f64) -> Self {
        let cell = |px: f64| floor((px + 0.5) / cell_px);
        let (low, high) = (window.low, window.high);
        let first = [cell(low.u), cell(low.v)];
        let size = [cell(high.u) - first[0] + 1, cell(high.v) - first[1] + 1];
        let [columns, rows] = size.map(|n| n.max(1) as usize);
        Self { cell_px, columns, first, nearest: vec![EMPTY; columns * rows] }
    }

    /// Depth (metres) and leaf of the nearest disc at a place in pixels.
    pub(super) fn at(&self, u: f64, v: f64) -> Option<(f64, u32)> {
        let nearest = self.index(floor(self.cells(u)), floor(self.cells(v))).map(|i| self.nearest[i])?;
        (nearest != EMPTY).then(|| (f64::from(f32::from_bits((nearest >> 32) as u32)), nearest as u32))
    }

    /// Draws a disc: its centre and radius in pixels, its depth in metres. The cell of its centre is always its own.
    pub(super) fn draw(&mut self, [u, v]: [f64; 2], radius_px: f64, z_m: f64, leaf: u32) {
        let key = u64::from((z_m as f32).to_bits()) << 32 | u64::from(leaf);
        let (u, v, radius) = (self.cells(u), self.cells(v), radius_px / self.cell_px);
        if let Some(own) = self.index(floor(u), floor(v)) {
            self.nearest[own] = key.min(self.nearest[own]);
        }
        // A disc covers the cells whose centres, which are at halves, it covers.
        if radius < 0.5 {
            return;
        }
        for row in floor(v - radius + 0.5)..=floor(v + radius - 0.5) {
            let off = row as f64 + 0.5 - v;
            let half = (radius * radius - off * off).max(0.0).sqrt();
            self.draw_row(row, floor(u - half + 0.5), floor(u + half - 0.5), key);
        }
    }

    fn draw_row(&mut self, row: i64, first: i64, last: i64, key: u64) {
        let (first, last) = (first.max(self.first[0]), last.min(self.first[0] + self.columns as i64 - 1));
        if let (Some(first), Some(last)) = (self.index(first, row), self.index(last, row)) {
            for cell in self.nearest.get_mut(first..=last).unwrap_or_default() {
                *cell = key.min(*cell);
            }
        }
    }

    /// A coordinate in cells; they are the same for every window.
    fn cells(&self, px: f64) -> f64 {
        (px + 0.5) / self.cell_px
    }

    fn index(&self, column: i64, row: i64) -> Option<usize> {
        let column = usize::try_from(column - self.first[0]).ok()?;
        let row = usize::try_from(row - self.first[1]).ok()?;
        let rows = self.nearest.len() / self.columns;
        (column < self.columns && row < rows).then_some(row * self.columns + column)
    }

    /// The nearest of both, drawn for the same window.
    pub(super) fn merged(mut self, other: Self) -> Self {
        for (a, b) in self.nearest.iter_mut().zip(&other.nearest) {
            *a = (*a).min(*b);
        }
        self
    }
}
