//! More points than pixels: one of each small square is enough.
//!
//! A square is the same whatever window it is looked at through, and its point is the one nearest to its centre, so
//! that the choice depends on nothing else.

use super::queries::floor;
use super::select::{Seen, Window};
use super::triangle::by_pixel;

/// At most one point for each square of a window.
pub(super) struct Thinned {
    edge_px: f64,
    first: [i64; 2],
    columns: usize,
    /// For each square the place of its point in `kept`, counted from 1; 0 for none.
    places: Vec<u32>,
    kept: Vec<Seen>,
}

impl Thinned {
    pub(super) fn new(window: &Window, edge_px: f64) -> Self {
        let square = |px: f64| floor((px + 0.5) / edge_px);
        let (low, high) = (window.low, window.high);
        let first = [square(low.u), square(low.v)];
        let size = [square(high.u) - first[0] + 1, square(high.v) - first[1] + 1].map(|n| n.max(0) as usize);
        Self { edge_px, first, columns: size[0], places: vec![0; size[0] * size[1]], kept: Vec::new() }
    }

    /// Where a point lies in squares.
    fn at(&self, seen: &Seen) -> [f64; 2] {
        [(seen.u + 0.5) / self.edge_px, (seen.v + 0.5) / self.edge_px]
    }

    /// Takes a point of the window if it is nearer to the centre of its square than the one it has.
    pub(super) fn offer(&mut self, seen: Seen) {
        let at = self.at(&seen);
        let [column, row] = [0, 1].map(|i| (floor(at[i]) - self.first[i]) as usize);
        let place = &mut self.places[row * self.columns + column];
        if *place == 0 {
            self.kept.push(seen);
            *place = self.kept.len() as u32;
            return;
        }
        let place = *place as usize - 1;
        let off = |at: [f64; 2]| at.map(|v| v - floor(v) as f64 - 0.5).map(|d| d * d).iter().sum::<f64>();
        let other = &self.kept[place];
        let order = off(at).total_cmp(&off(self.at(other))).then_with(|| by_pixel(&seen, other));
        if order.is_lt() {
            self.kept[place] = seen;
        }
    }

    pub(super) fn merged(mut self, other: Self) -> Self {
        other.kept.into_iter().for_each(|seen| self.offer(seen));
        self
    }

    pub(super) fn into_points(self) -> Vec<Seen> {
        self.kept
    }
}
