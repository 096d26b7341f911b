//! One triangle of the cloud's points: whether it is fit to interpolate in, and the plane through it.

use spade::{HasPosition, Point2};
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample};

use super::select::{Facing, Seen, View};

/// How far two corners of a triangle may be off each other's patches, over the distance between points.
const STEP_SPACINGS: f64 = 3.0;

/// The same over the standard deviation across the surface.
const STEP_NOISE: f64 = 4.0;

/// Corners of a triangle whose depths differ by more than this part of the nearer one may straddle an edge.
const EDGE: f64 = 0.05;

/// The part of a step that refuses a triangle from which on it flags one, where steps are refused.
const FLAG_SHARE: f64 = 0.5;

/// What makes a triangle unfit to interpolate in.
#[derive(Clone, Copy)]
pub(super) struct Limits<'a> {
    /// Longest edge, pixels.
    pub(super) width_px: f64,
    /// Where its patches come from.
    pub(super) view: &'a View<'a>,
    /// Whether a triangle across an occlusion edge is refused; else it is only flagged.
    pub(super) refuses_edges: bool,
    /// Whether depth is that of natural neighbours and not of the triangle.
    pub(super) natural: bool,
}

/// A corner of the triangulation, and which point it is.
pub(super) struct Corner {
    pub(super) at: Point2<f64>,
    pub(super) point: u32,
}

impl HasPosition for Corner {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// Three points and the plane through them.
pub(super) struct Triangle {
    pub(super) corners: [Seen; 3],
    slope: [f64; 2],
}

impl Triangle {
    /// From three points, in an order of their own, so that rounding does not depend on who asks.
    pub(super) fn new(mut corners: [Seen; 3]) -> Self {
        corners.sort_unstable_by(by_pixel);
        let [a, b, c] = corners;
        let (bu, bv, bz) = (b.u - a.u, b.v - a.v, b.z_m - a.z_m);
        let (cu, cv, cz) = (c.u - a.u, c.v - a.v, c.z_m - a.z_m);
        let area = bu * cv - bv * cu;
        Self { corners, slope: [(bz * cv - cz * bv) / area, (bu * cz - cu * bz) / area] }
    }

    /// Depth on the plane through the corners.
    pub(super) fn at(&self, px: Pixel, on_edge: bool) -> DepthSample {
        let [a, b, c] = self.corners;
        let z_m = a.z_m + self.slope[0] * (px.u - a.u) + self.slope[1] * (px.v - a.v);
        // A needle of a triangle has next to no area to divide by.
        let (low, high) = (a.z_m.min(b.z_m).min(c.z_m), a.z_m.max(b.z_m).max(c.z_m));
        DepthSample { z_m: if z_m.is_finite() { z_m.clamp(low, high) } else { low }, on_edge }
    }

    /// Whether its corners straddle a depth edge; or why it is unfit to interpolate in.
    pub(super) fn fit(&self, limits: &Limits<'_>) -> Result<bool, DepthMiss> {
        let pairs = [(0, 1), (1, 2), (2, 0)];
        let too_wide = |(i, j): (usize, usize)| {
            let (a, b) = (self.corners[i], self.corners[j]);
            (a.u - b.u).powi(2) + (a.v - b.v).powi(2) > limits.width_px.powi(2)
        };
        if pairs.into_iter().any(too_wide) {
            return Err(DepthMiss::TriangleTooWide);
        }
        let [a, b, c] = self.corners;
        let (low, high) = (a.z_m.min(b.z_m).min(c.z_m), a.z_m.max(b.z_m).max(c.z_m));
        let jumps = high > low * (1.0 + EDGE);
        if !(jumps || limits.refuses_edges) {
            return Ok(false);
        }
        let sides = self.corners.map(|c| (in_camera(&c), limits.view.patch(c.leaf)));
        let step = |share: f64| {
            let one = |(i, j): (usize, usize)| {
                apart(&sides[i], &sides[j], share) || apart(&sides[j], &sides[i], share)
            };
            pairs.into_iter().any(one)
        };
        if !limits.refuses_edges {
            return Ok(step(1.0));
        }
        if step(1.0) {
            return Err(DepthMiss::OcclusionEdge);
        }
        Ok(jumps && step(FLAG_SHARE))
    }
}

/// Whether a point lies on another surface than a triangle's corners.
pub(super) fn off_surface(seen: &Seen, triangle: &Triangle, limits: &Limits<'_>) -> bool {
    let side = |s: &Seen| (in_camera(s), limits.view.patch(s.leaf));
    let own = side(seen);
    triangle.corners.iter().map(side).any(|corner| apart(&own, &corner, 1.0) || apart(&corner, &own, 1.0))
}

/// Whether a point lies off the patch of another by more than this share of what sampling and noise explain.
fn apart(a: &(nalgebra::Vector3<f64>, Facing), b: &(nalgebra::Vector3<f64>, Facing), share: f64) -> bool {
    let off_m = a.1.normal.dot(&(b.0 - a.0)).abs();
    let spacing_m = a.1.spacing_m.max(b.1.spacing_m);
    off_m > share * (STEP_SPACINGS * spacing_m + STEP_NOISE * a.1.thickness_m)
}

fn in_camera(seen: &Seen) -> nalgebra::Vector3<f64> {
    nalgebra::Vector3::new(f64::from(seen.ray[0]), f64::from(seen.ray[1]), 1.0) * seen.z_m
}

pub(super) fn by_pixel(a: &Seen, b: &Seen) -> std::cmp::Ordering {
    a.u.total_cmp(&b.u).then(a.v.total_cmp(&b.v)).then(a.z_m.total_cmp(&b.z_m)).then(a.leaf.cmp(&b.leaf))
}
