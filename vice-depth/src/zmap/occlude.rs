//! The second step: drop points that a nearer surface hides.
//!
//! Each point is drawn into a z-buffer as a disc of its patch of surface, large enough that neighbouring discs leave
//! no gap: a sparse surface in front hides a dense one behind it. Then each point is held against the patch that is
//! nearest at its pixel, where the point's own ray meets that patch: a floor seen at a grazing angle does not hide
//! itself, though its depth changes much from one pixel to the next.
//!
//! Points just before the lens that lie further apart than the widest triangle that is trusted answer no pixel, and take
//! none from what is behind them: a few strays would black out a tenth of the image.
//!
//! What a point's fate depends on lies within the largest disc's radius of it, so that a part of the image can be
//! answered without the rest.

use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};

use super::buffer::Buffer;
use super::select::{Facing, Seen, View, Window};
use super::thin::Thinned;
use crate::cloud::Leaf;

/// Radius of a disc over the distance between points. A pixel of an evenly sampled surface is missed by all discs
/// with a probability of `exp(-π 1.6²)`, 3e-4.
const DISC_RADIUS: f64 = 1.6;

/// Largest radii of discs, cells. A leaf whose discs stay within one of the smaller ones is not looked at where it
/// is further than that from the window.
const RADII_CELLS: [f64; 3] = [1.5, 7.0, 32.0];

/// Cells a focal length has: a cell is about two milliradians wide, or a pixel if that is more.
const CELLS_PER_FOCAL_LENGTH: f64 = 500.0;

/// How far behind a surface a point must be to be hidden, over its depth.
const RELATIVE_TOLERANCE: f64 = 0.005;

/// The same over the standard deviation across the surface.
const NOISE_TOLERANCE: f64 = 3.0;

/// The same over the distance between the points of the surface: how it runs between them is not known better. On a
/// noisy scan this keeps the points behind the nearest ones, which are in front by chance.
const SPACING_TOLERANCE: f64 = 2.0;

/// How far a patch's plane is believed: its tilt against the rays is held at this many metres a metre.
const MAX_TILT: f64 = 6.0;

/// Points that are kept between the two passes (80 MB); more are projected a second time.
const MOST_KEPT: usize = 2_000_000;

/// Sparse points nearer than this are strays, metres: no robot looks at a wall from there.
const STRAYS_M: f64 = 0.5;

/// Width of a cell of the z-buffer, pixels.
pub(super) fn cell_px(camera: &Camera) -> f64 {
    (focal_px(camera) / CELLS_PER_FOCAL_LENGTH).max(1.0)
}

fn focal_px(camera: &Camera) -> f64 {
    let [fx, fy, ..] = camera.fx_fy_cx_cy();
    fx.max(fy)
}

/// The hidden-point test of a view.
pub(super) struct Occlusion<'a> {
    view: &'a View<'a>,
    cell_px: f64,
    focal_px: f64,
    /// Distance between points over their depth, beyond which points before the lens are no surface.
    sparsest: f64,
}

impl<'a> Occlusion<'a> {
    pub(super) fn new(view: &'a View<'a>, sparsest: f64) -> Self {
        Self { view, cell_px: cell_px(view.camera()), focal_px: focal_px(view.camera()), sparsest }
    }

    /// Points of a window that nothing hides, at most one in each quarter of a cell. The window has whole cells,
    /// save where it ends with the region of all points.
    pub(super) fn visible(&self, window: &Window) -> Vec<Seen> {
        let windows = RADII_CELLS.map(|cells| window.grown((cells + 1.0) * self.cell_px));
        let leaves = self.view.leaves_in(&windows, |leaf| self.reach(leaf));
        let [.., around] = windows;
        let keep = leaves.iter().map(|l| l.end - l.start).sum::<usize>() <= MOST_KEPT;
        let chunk = leaves.len().div_ceil(rayon::current_num_threads()).max(64);
        let drawn: Vec<(Buffer, Vec<Seen>)> =
            leaves.par_chunks(chunk).map(|leaves| self.drawn(leaves, &around, window, keep)).collect();
        let (buffers, kept): (Vec<_>, Vec<_>) = drawn.into_iter().unzip();
        let Some(buffer) = buffers.into_iter().reduce(Buffer::merged) else { return Vec::new() };
        let thinned = |points: &mut dyn Iterator<Item = Seen>| {
            let mut thinned = Thinned::new(window, self.cell_px / 2.0);
            points.filter(|seen| !self.hidden(&buffer, seen)).for_each(|seen| thinned.offer(seen));
            thinned
        };
        let parts: Vec<Thinned> = if keep {
            kept.par_iter().map(|seen| thinned(&mut seen.iter().copied())).collect()
        } else {
            let of_leaf = |leaf: &Leaf| {
                let nearest_m = self.nearest_m(leaf);
                self.view.seen(*leaf, *window).filter(move |seen| seen.z_m > nearest_m)
            };
            let seen = |leaves: &[Leaf]| thinned(&mut leaves.iter().flat_map(of_leaf));
            leaves.par_chunks(chunk).map(seen).collect()
        };
        parts.into_iter().reduce(Thinned::merged).map(Thinned::into_points).unwrap_or_default()
    }

    /// The discs of some leaves, and their points in a window if they are to be kept.
    fn drawn(&self, leaves: &[Leaf], around: &Window, window: &Window, keep: bool) -> (Buffer, Vec<Seen>) {
        let (mut buffer, mut kept) = (Buffer::new(around, self.cell_px), Vec::new());
        for leaf in leaves {
            let spacing_m = self.view.patch(leaf.index).spacing_m;
            let nearest_m = self.nearest_m(leaf);
            for seen in self.view.seen(*leaf, *around).filter(|seen| seen.z_m > nearest_m) {
                buffer.draw([seen.u, seen.v], self.radius_px(spacing_m, seen.z_m), seen.z_m, seen.leaf);
                if keep && window.contains(Pixel::new(seen.u, seen.v)) {
                    kept.push(seen);
                }
            }
        }
        (buffer, kept)
    }

    /// Depth that points of a leaf must be beyond to be dense enough for a surface, or too far off to be strays.
    fn nearest_m(&self, leaf: &Leaf) -> f64 {
        (self.view.patch(leaf.index).spacing_m / self.sparsest).min(STRAYS_M)
    }

    /// Radius of a disc of a patch at a depth.
    fn radius_px(&self, spacing_m: f64, z_m: f64) -> f64 {
        let [.., largest] = RADII_CELLS;
        (DISC_RADIUS * spacing_m * self.focal_px / z_m).min(largest * self.cell_px)
    }

    /// The first of the radii that no disc of a leaf is wider than.
    fn reach(&self, leaf: &Leaf) -> usize {
        let radius_px = self.radius_px(self.view.patch(leaf.index).spacing_m, self.view.nearest_m(leaf));
        RADII_CELLS
            .iter()
            .position(|cells| radius_px <= cells * self.cell_px)
            .unwrap_or(RADII_CELLS.len() - 1)
    }

    fn hidden(&self, buffer: &Buffer, seen: &Seen) -> bool {
        let Some((z_m, leaf)) = buffer.at(seen.u, seen.v) else { return false };
        let slack_m = RELATIVE_TOLERANCE * seen.z_m;
        if leaf == seen.leaf || seen.z_m <= z_m + slack_m {
            return false;
        }
        let patch = self.view.patch(leaf);
        seen.z_m
            > surface_m(&patch, seen.ray, z_m)
                + slack_m.max(NOISE_TOLERANCE * patch.thickness_m).max(SPACING_TOLERANCE * patch.spacing_m)
    }
}

/// Depth at which a ray meets a patch that was drawn at `z_m`.
fn surface_m(patch: &Facing, [x, y]: [f32; 2], z_m: f64) -> f64 {
    let ray = nalgebra::Vector3::new(f64::from(x), f64::from(y), 1.0);
    let on_plane = patch.normal.dot(&patch.centre) / patch.normal.dot(&ray);
    let reach_m = MAX_TILT * DISC_RADIUS * patch.spacing_m;
    if on_plane.is_finite() { on_plane.clamp(z_m - reach_m, z_m + reach_m) } else { z_m }
}
