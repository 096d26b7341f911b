//! Pixels that are asked for, in a grid, so that a triangle finds those that it covers.

use vice_core::camera::Pixel;

/// Pixels by the cell of the grid that they are in; a cell is the square around an integer pixel.
pub(super) struct Queries {
    first: [i64; 2],
    columns: usize,
    rows: usize,
    /// How far a pixel is from the centre of its cell at most, in each direction: nothing for a depth image.
    spread: [f64; 2],
    /// Where a cell's entries begin; one more at the end.
    starts: Vec<u32>,
    /// Pixels with their places in the list they came from, cell after cell.
    entries: Vec<(Pixel, u32)>,
}

fn cell(at: f64) -> i64 {
    floor(at + 0.5)
}

/// Largest integer that is not larger. The method of `f64` is a function call on a plain x86-64.
pub(super) fn floor(x: f64) -> i64 {
    let towards_zero = x as i64;
    towards_zero - i64::from(x < towards_zero as f64)
}

impl Queries {
    /// Sorts the `wanted` ones of `pixels`, which lie in an image, into cells.
    pub(super) fn new(pixels: &[Pixel], wanted: &[usize]) -> Self {
        // A little more than nothing, so that rounding hides no pixel on an edge.
        let (mut low, mut high, mut spread) = ([i64::MAX; 2], [i64::MIN; 2], [1e-6_f64; 2]);
        for i in wanted {
            for (axis, at) in [pixels[*i].u, pixels[*i].v].into_iter().enumerate() {
                let cell = cell(at);
                (low[axis], high[axis]) = (low[axis].min(cell), high[axis].max(cell));
                spread[axis] = spread[axis].max((at - cell as f64).abs());
            }
        }
        let size = |axis: usize| if wanted.is_empty() { 0 } else { (high[axis] - low[axis] + 1) as usize };
        let (columns, rows) = (size(0), size(1));
        let mut queries = Self {
            first: low,
            columns,
            rows,
            spread,
            starts: vec![0; columns * rows + 1],
            entries: vec![(Pixel::default(), 0); wanted.len()],
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
            queries.entries[next[at] as usize] = (pixels[*i], *i as u32);
            next[at] += 1;
        }
        queries
    }

    /// Places of the pixels in the list they came from.
    pub(super) fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.entries.iter().map(|(_, place)| *place as usize)
    }

    fn index_of(&self, px: Pixel) -> usize {
        (cell(px.v) - self.first[1]) as usize * self.columns + (cell(px.u) - self.first[0]) as usize
    }

    /// Calls `hit` with each pixel that lies in a triangle or on its border.
    pub(super) fn covered_by(&self, corners: [Pixel; 3], mut hit: impl FnMut(usize, Pixel)) {
        let [a, b, c] = corners;
        let (left, right) = (a.u.min(b.u).min(c.u), a.u.max(b.u).max(c.u));
        let (top, bottom) = (a.v.min(b.v).min(c.v), a.v.max(b.v).max(c.v));
        let mut sides = None;
        let (first_row, last_row) = self.range(top, bottom, 1, self.rows);
        for row in first_row..=last_row {
            // Within a few columns looking closer would cost more than it saves.
            let (from, to) = if right - left < 4.0 {
                (left, right)
            } else {
                let centre = (row + self.first[1]) as f64;
                extent(&corners, centre - self.spread[1], centre + self.spread[1])
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
            for (px, place) in &self.entries[first as usize..last as usize] {
                // Most triangles of a dense cloud lie between pixels and do not come this far.
                if px.u < left || px.u > right || px.v < top || px.v > bottom {
                    continue;
                }
                if sides.get_or_insert_with(|| Sides::of(corners)).cover(*px) {
                    hit(*place as usize, *px);
                }
            }
        }
    }

    /// Rows (or columns) of the grid with pixels between two places; empty where the first is behind the last.
    fn range(&self, low: f64, high: f64, axis: usize, count: usize) -> (i64, i64) {
        let spread = self.spread[axis];
        let (low, high) = (-floor(spread - low) - self.first[axis], floor(high + spread) - self.first[axis]);
        (low.max(0), high.min(count as i64 - 1))
    }
}

/// The sides of a triangle as functions that are positive or zero in it and on its border.
struct Sides([(Pixel, [f64; 2]); 3]);

impl Sides {
    /// The same numbers, but for their sign, for the triangles on both sides of an edge: no pixel falls between them.
    fn of([a, b, c]: [Pixel; 3]) -> Self {
        let turn = (b.u - a.u) * (c.v - a.v) - (b.v - a.v) * (c.u - a.u);
        let side = |p: Pixel, q: Pixel| {
            let forward = (p.u, p.v) <= (q.u, q.v);
            let (from, to) = if forward { (p, q) } else { (q, p) };
            let sign = if forward == (turn >= 0.0) { 1.0 } else { -1.0 };
            (from, [(to.u - from.u) * sign, (to.v - from.v) * sign])
        };
        Self([side(a, b), side(b, c), side(c, a)])
    }

    fn cover(&self, at: Pixel) -> bool {
        self.0.iter().all(|(from, [du, dv])| du * (at.v - from.v) - dv * (at.u - from.u) >= 0.0)
    }
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
