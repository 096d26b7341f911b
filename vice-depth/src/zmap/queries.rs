//! Pixels that are asked for, in a grid, so that a triangle finds those that it covers.

use vice_core::camera::Pixel;

/// Pixels by the cell of the grid that they are in; a cell is the square around an integer pixel.
pub(super) struct Queries<'a> {
    pixels: &'a [Pixel],
    first: [i64; 2],
    columns: usize,
    rows: usize,
    /// Where a cell's entries begin; one more at the end.
    starts: Vec<u32>,
    /// Indices into `pixels`, cell after cell.
    entries: Vec<u32>,
}

fn cell(at: f64) -> i64 {
    floor(at + 0.5)
}

/// Largest integer that is not larger. The method of `f64` is a function call on a plain x86-64.
pub(super) fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(x < towards_zero as f64)
}

impl<'a> Queries<'a> {
    /// Sorts the `wanted` ones of `pixels`, which lie in an image, into cells.
    pub(super) fn new(pixels: &'a [Pixel], wanted: &[usize]) -> Self {
        let (mut low, mut high) = ([i64::MAX; 2], [i64::MIN; 2]);
        for i in wanted {
            for (axis, at) in [cell(pixels[*i].u), cell(pixels[*i].v)].into_iter().enumerate() {
                (low[axis], high[axis]) = (low[axis].min(at), high[axis].max(at));
            }
        }
        let size = |axis: usize| if wanted.is_empty() { 0 } else { (high[axis] - low[axis] + 1) as usize };
        let (columns, rows) = (size(0), size(1));
        let mut queries = Self {
            pixels,
            first: low,
            columns,
            rows,
            starts: vec![0; columns * rows + 1],
            entries: vec![0; wanted.len()],
        };
        for i in wanted {
            let at = queries.index_of(pixels[*i]);
            queries.starts[at + 1] += 1;
        }
        for i in 1..queries.starts.len() {
            queries.starts[i] += queries.starts[i - 1];
        }
        let mut next = queries.starts.clone();
        for i in wanted {
            let at = queries.index_of(pixels[*i]);
            queries.entries[next[at] as usize] = *i as u32;
            next[at] += 1;
        }
        queries
    }

    fn index_of(&self, px: Pixel) -> usize {
        (cell(px.v) - self.first[1]) as usize * self.columns + (cell(px.u) - self.first[0]) as usize
    }

    /// Calls `hit` with each pixel that lies in a triangle or on its border.
    pub(super) fn covered_by(&self, corners: [Pixel; 3], mut hit: impl FnMut(usize, Pixel)) {
        let [a, b, c] = corners;
        let (left, right) = (a.u.min(b.u).min(c.u), a.u.max(b.u).max(c.u));
        let (top, bottom) = (a.v.min(b.v).min(c.v), a.v.max(b.v).max(c.v));
        let inside = |px: Pixel| {
            // Most triangles of a dense cloud lie between pixels.
            if px.u < left || px.u > right || px.v < top || px.v > bottom {
                return false;
            }
            let sides = [side(a, b, px), side(b, c, px), side(c, a, px)];
            sides.iter().all(|s| *s >= 0.0) || sides.iter().all(|s| *s <= 0.0)
        };
        let (first_row, last_row) = self.range(top, bottom, 1, self.rows);
        for row in first_row..=last_row {
            // Within a few columns looking closer would cost more than it saves.
            let (from, to) = if right - left < 4.0 {
                (left, right)
            } else {
                let centre = (row + self.first[1]) as f64;
                extent(&corners, centre - 0.5, centre + 0.5)
            };
            if from > to {
                continue;
            }
            let (from, to) = self.range(from, to, 0, self.columns);
            if from > to {
                continue;
            }
            let row = row as usize * self.columns;
            let (first, last) = (self.starts[row + from as usize], self.starts[row + to as usize + 1]);
            for entry in &self.entries[first as usize..last as usize] {
                let px = self.pixels[*entry as usize];
                if inside(px) {
                    hit(*entry as usize, px);
                }
            }
        }
    }

    /// Rows (or columns) of the grid between two places; empty where the first is behind the last.
    fn range(&self, low: f64, high: f64, axis: usize, count: usize) -> (i64, i64) {
        let (low, high) = (cell(low) - self.first[axis], cell(high) - self.first[axis]);
        (low.max(0), high.min(count as i64 - 1))
    }
}

/// On which side of the line through two corners a pixel lies. The same number, but for its sign, for the triangles
/// on both sides of an edge: no pixel falls between them.
fn side(p: Pixel, q: Pixel, at: Pixel) -> f64 {
    let cross = |p: Pixel, q: Pixel| (q.u - p.u) * (at.v - p.v) - (q.v - p.v) * (at.u - p.u);
    if (p.u, p.v) <= (q.u, q.v) { cross(p, q) } else { -cross(q, p) }
}

/// From where to where a triangle reaches between two rows, to the right.
fn extent(corners: &[Pixel; 3], top: f64, bottom: f64) -> (f64, f64) {
    let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
    let mut reach = |u: f64| (left, right) = (left.min(u), right.max(u));
    for i in 0..3 {
        let (p, q) = (corners[i], corners[(i + 1) % 3]);
        if p.v >= top && p.v <= bottom {
            reach(p.u);
        }
        for level in [top, bottom] {
            if (p.v < level) != (q.v < level) {
                reach(p.u + (q.u - p.u) * ((level - p.v) / (q.v - p.v)));
            }
        }
    }
    (left, right)
}
