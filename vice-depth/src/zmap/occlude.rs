//! The second step: drop points that a nearer surface hides.
//!
//! Each point is drawn into a z-buffer as a disc of its patch of surface, large enough that neighbouring discs leave
//! no gap: a sparse surface in front hides a dense one behind it. Then each point is held against the patch that is
//! nearest at its pixel, where the point's own ray meets that patch: a floor seen at a grazing angle does not hide
//! itself, though its depth changes much from one pixel to the next.
//!
//! What a point's fate depends on lies within [`Occlusion::reach_px`] of it, so that a part of the image can be
//! answered without the rest.

use rayon::prelude::*;
use vice_core::camera::Camera;

use super::select::{Facing, Seen, View, Window};

/// Radius of a disc over the distance between points. A pixel of an evenly sampled surface is missed by all discs
/// with a probability of `exp(-π 1.6²)`, 3e-4.
const DISC_RADIUS: f64 = 1.6;

/// Largest radius of a disc, cells.
const MAX_RADIUS_CELLS: f64 = 32.0;

/// Cells a focal length has: a cell is about two milliradians wide, or a pixel if that is more.
const CELLS_PER_FOCAL_LENGTH: f64 = 500.0;

/// How far behind a surface a point must be to be hidden, over its depth.
const RELATIVE_TOLERANCE: f64 = 0.005;

/// The same over the standard deviation across the surface.
const NOISE_TOLERANCE: f64 = 3.0;

/// How far a patch's plane is believed: its tilt against the rays is held at this many metres a metre.
const MAX_TILT: f64 = 6.0;

const EMPTY: u64 = u64::MAX;

/// The hidden-point test of a view.
pub(super) struct Occlusion<'a> {
    view: &'a View<'a>,
    cell_px: f64,
    focal_px: f64,
}

/// Nearest disc of each cell of a window: depth in the upper half as the bits of a float, which sort as the float
/// does, and the leaf in the lower.
struct Buffer {
    columns: usize,
    first: [i64; 2],
    nearest: Vec<u64>,
}

impl<'a> Occlusion<'a> {
    pub(super) fn new(view: &'a View<'a>) -> Self {
        let focal_px = focal_px(view.camera());
        Self { view, cell_px: (focal_px / CELLS_PER_FOCAL_LENGTH).max(1.0), focal_px }
    }

    /// How far from a point, in pixels, others can have a say in whether it is hidden.
    fn reach_px(&self) -> f64 {
        (MAX_RADIUS_CELLS + 1.0) * self.cell_px
    }

    /// Points of a window that nothing hides, in the order of the index.
    pub(super) fn visible(&self, window: &Window) -> Vec<Seen> {
        let around = window.grown(self.reach_px());
        let leaves = self.view.leaves(&around);
        let chunk = leaves.len().div_ceil(rayon::current_num_threads()).max(64);
        let buffer = leaves
            .par_chunks(chunk)
            .map(|leaves| {
                let mut buffer = self.buffer(&around);
                for leaf in leaves {
                    let radius_m = DISC_RADIUS * self.view.patch(leaf.index as u32).spacing_m;
                    self.view.seen(*leaf, around).for_each(|seen| self.draw(&mut buffer, &seen, radius_m));
                }
                buffer
            })
            .reduce_with(Buffer::merged)
            .unwrap_or_else(|| self.buffer(&around));
        let leaves = self.view.leaves(window);
        leaves
            .par_iter()
            .flat_map_iter(|leaf| self.view.seen(*leaf, *window).filter(|seen| !self.hidden(&buffer, seen)))
            .collect()
    }

    fn buffer(&self, window: &Window) -> Buffer {
        let (low, high) = (window.low, window.high);
        let first = [self.cell(low.u), self.cell(low.v)];
        let size = [self.cell(high.u) - first[0] + 1, self.cell(high.v) - first[1] + 1];
        let [columns, rows] = size.map(|n| n.max(1) as usize);
        Buffer { columns, first, nearest: vec![EMPTY; columns * rows] }
    }

    /// The cell of a coordinate; cells are the same for every window.
    fn cell(&self, px: f64) -> i64 {
        ((px + 0.5) / self.cell_px).floor() as i64
    }

    fn draw(&self, buffer: &mut Buffer, seen: &Seen, radius_m: f64) {
        let key = u64::from((seen.z_m as f32).to_bits()) << 32 | u64::from(seen.leaf);
        buffer.put(self.cell(seen.u), self.cell(seen.v), key);
        let cells = (radius_m * self.focal_px / (seen.z_m * self.cell_px)).min(MAX_RADIUS_CELLS);
        if cells < 0.5 {
            return;
        }
        // Centre of the disc in cells, whose own centres are at halves.
        let (u, v) = ((seen.u + 0.5) / self.cell_px, (seen.v + 0.5) / self.cell_px);
        let rows = (v - cells - 0.5).ceil() as i64..=(v + cells - 0.5).floor() as i64;
        for row in rows {
            let off = row as f64 + 0.5 - v;
            let half = (cells * cells - off * off).max(0.0).sqrt();
            let (first, last) = ((u - half - 0.5).ceil() as i64, (u + half - 0.5).floor() as i64);
            buffer.put_row(row, first, last, key);
        }
    }

    fn hidden(&self, buffer: &Buffer, seen: &Seen) -> bool {
        let nearest = buffer.get(self.cell(seen.u), self.cell(seen.v));
        let (z_m, leaf) = (f64::from(f32::from_bits((nearest >> 32) as u32)), nearest as u32);
        if nearest == EMPTY || leaf == seen.leaf || seen.z_m <= z_m {
            return false;
        }
        let patch = self.view.patch(leaf);
        let slack = (RELATIVE_TOLERANCE * seen.z_m).max(NOISE_TOLERANCE * patch.thickness_m);
        seen.z_m > surface_m(&patch, seen.ray, z_m) + slack
    }
}

/// Depth at which a ray meets a patch that was drawn at `z_m`.
fn surface_m(patch: &Facing, [x, y]: [f32; 2], z_m: f64) -> f64 {
    let ray = nalgebra::Vector3::new(f64::from(x), f64::from(y), 1.0);
    let on_plane = patch.normal.dot(&patch.centre) / patch.normal.dot(&ray);
    let reach_m = MAX_TILT * DISC_RADIUS * patch.spacing_m;
    if on_plane.is_finite() { on_plane.clamp(z_m - reach_m, z_m + reach_m) } else { z_m }
}

fn focal_px(camera: &Camera) -> f64 {
    let [fx, fy, ..] = camera.fx_fy_cx_cy();
    fx.max(fy)
}

impl Buffer {
    fn index(&self, column: i64, row: i64) -> Option<usize> {
        let (column, row) =
            (usize::try_from(column - self.first[0]).ok()?, usize::try_from(row - self.first[1]).ok()?);
        (column < self.columns && row < self.nearest.len() / self.columns)
            .then_some(row * self.columns + column)
    }

    fn get(&self, column: i64, row: i64) -> u64 {
        self.index(column, row).map_or(EMPTY, |i| self.nearest[i])
    }

    fn put(&mut self, column: i64, row: i64, key: u64) {
        if let Some(i) = self.index(column, row) {
            self.nearest[i] = self.nearest[i].min(key);
        }
    }

    fn put_row(&mut self, row: i64, first: i64, last: i64, key: u64) {
        let (first, last) = (first.max(self.first[0]), last.min(self.first[0] + self.columns as i64 - 1));
        if let (Some(first), Some(last)) = (self.index(first, row), self.index(last, row)) {
            for cell in self.nearest.get_mut(first..=last).unwrap_or_default() {
                *cell = key.min(*cell);
            }
        }
    }

    fn merged(mut self, other: Self) -> Self {
        for (a, b) in self.nearest.iter_mut().zip(&other.nearest) {
            *a = (*a).min(*b);
        }
        self
    }
}
