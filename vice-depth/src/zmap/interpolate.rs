//! The third step: triangulate the points that are left, in pixels, and interpolate `z`, linearly or by natural neighbours.
//!
//! What is interpolated is `z` itself, not `1/z`, over the Delaunay triangulation of the distorted pixels. Four
//! points on a circle have two such triangulations, and a regular grid of points is full of them: to make the
//! triangulation a property of the points, and not of their order or of what else is triangulated with them, each
//! pixel is moved by up to a billionth, by a hash of itself.

use rayon::prelude::*;
use spade::handles::{FixedFaceHandle, InnerTag};
use spade::{DelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation};
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample};
use vice_core::error::{DataError, DataResult};

use super::natural::Natural;
use super::queries::Queries;
use super::select::{Facing, Seen, View, Window};

/// Largest shift of a pixel.
const JITTER_PX: f64 = 1e-9;

/// How far two corners of a triangle may be off each other's patches, over the distance between points.
const STEP_SPACINGS: f64 = 3.0;

/// The same over the standard deviation across the surface.
const STEP_NOISE: f64 = 4.0;

/// Corners of a triangle whose depths differ by more than this part of the nearer one may straddle an edge.
const EDGE: f64 = 0.05;

/// The part of a step that refuses a triangle from which on it flags one, where steps are refused.
const FLAG_SHARE: f64 = 0.5;

/// Faces that a thread fills in one go.
const FACES_AT_ONCE: usize = 1 << 10;

type Answer = Result<DepthSample, DepthMiss>;

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

/// Triangles over the points in view.
pub(super) struct Surface<'a> {
    points: Vec<Seen>,
    triangles: DelaunayTriangulation<Corner>,
    limits: Limits<'a>,
}

/// Three points and the plane through them.
pub(super) struct Triangle {
    pub(super) corners: [Seen; 3],
    slope: [f64; 2],
}

/// What a part of the points says about a pixel.
pub(super) enum Local {
    /// No other points can change this.
    Certain(Answer),
    /// It takes more points to know.
    Uncertain,
}

impl<'a> Surface<'a> {
    /// Triangulates. Of points at one pixel the nearest is kept, so that their order does not matter.
    pub(super) fn new(mut points: Vec<Seen>, limits: Limits<'a>) -> DataResult<Self> {
        points.par_iter_mut().for_each(jitter);
        let mut triangles = triangulated(&mut points)?;
        // Points at one pixel are rare enough to look for them only where there are some.
        if triangles.num_vertices() < points.len() {
            points.par_sort_unstable_by(by_pixel);
            points.dedup_by(|b, a| a.u == b.u && a.v == b.v);
            triangles = triangulated(&mut points)?;
        }
        Ok(Self { points, triangles, limits })
    }

    /// Depth of a pixel, where these are all the points of a window that is part of a larger one.
    ///
    /// The circle through a triangle's corners is free of other points. Where none can lie in the part of it outside
    /// the window either, the triangle belongs to the triangulation of all points.
    pub(super) fn local(&self, pixel: Pixel, window: &Window, whole: &Window) -> Local {
        let face = match self.triangles.locate(Point2::new(pixel.u, pixel.v)) {
            PositionInTriangulation::OnFace(face) => Some(self.triangles.face(face)),
            PositionInTriangulation::OnEdge(edge) => {
                let edge = self.triangles.directed_edge(edge);
                edge.face().as_inner().or_else(|| edge.rev().face().as_inner())
            }
            PositionInTriangulation::OnVertex(vertex) => {
                let vertex = self.triangles.vertex(vertex);
                vertex.out_edges().find_map(|edge| edge.face().as_inner())
            }
            _ => None,
        };
        let Some(face) = face else { return Local::Uncertain };
        let inside = |at: f64, radius: f64, low: f64, high: f64, first: f64, last: f64| {
            (at - radius > low || low <= first) && (at + radius < high || high >= last)
        };
        let free = |[u, v]: [f64; 2], radius: f64| {
            let radius = radius * (1.0 + 1e-9) + 1e-6;
            radius.is_finite()
                && inside(u, radius, window.low.u, window.high.u, whole.low.u, whole.high.u)
                && inside(v, radius, window.low.v, window.high.v, whole.low.v, whole.high.v)
        };
        let (centre, radius_2) = face.circumcircle();
        if !free([centre.x, centre.y], radius_2.sqrt()) {
            return Local::Uncertain;
        }
        let triangle = self.triangle(face.vertices().map(|v| v.data().point));
        let fit = triangle.fit(&self.limits);
        let mut natural = self.limits.natural.then(|| Natural::new(&self.triangles, &self.points));
        if fit.is_ok() && natural.as_mut().is_some_and(|n| !n.is_closed(pixel, free)) {
            return Local::Uncertain;
        }
        Local::Certain(fit.map(|on_edge| self.sample(natural.as_mut(), &triangle, pixel, on_edge)))
    }

    /// Depth of a pixel in a triangle that is fit to interpolate in.
    fn sample(
        &self,
        natural: Option<&mut Natural<'_>>,
        triangle: &Triangle,
        px: Pixel,
        on_edge: bool,
    ) -> DepthSample {
        match natural.and_then(|n| n.z_m(px, triangle, &self.limits)) {
            Some(z_m) => DepthSample { z_m, on_edge },
            None => triangle.at(px, on_edge),
        }
    }

    /// Depths of many pixels: each triangle fills those that it covers.
    pub(super) fn fill(&self, queries: &Queries, out: &mut [Answer]) {
        let nothing = if self.points.is_empty() { DepthMiss::EmptyView } else { DepthMiss::OutsideHull };
        queries.places().for_each(|i| out[i] = Err(nothing));
        let faces: Vec<_> = self.triangles.fixed_inner_faces().collect();
        let hits: Vec<Vec<_>> =
            faces.par_chunks(FACES_AT_ONCE).map(|faces| self.hits(queries, faces)).collect();
        // In the order of the faces. On an edge between two triangles the one that has an answer is taken.
        for (i, answer) in hits.into_iter().flatten() {
            if out[i].is_err() {
                out[i] = answer;
            }
        }
    }

    /// Pixels that some faces cover, with their depths.
    fn hits(&self, queries: &Queries, faces: &[FixedFaceHandle<InnerTag>]) -> Vec<(usize, Answer)> {
        let mut hits = Vec::new();
        let mut natural = self.limits.natural.then(|| Natural::new(&self.triangles, &self.points));
        // Corners are all over memory: fetched in a loop of their own, they do not wait for each other.
        let corners = |face: &FixedFaceHandle<InnerTag>| {
            self.triangles
                .face(*face)
                .vertices()
                .map(|c| (Pixel::new(c.data().at.x, c.data().at.y), c.data().point))
        };
        let corners: Vec<[(Pixel, u32); 3]> = faces.iter().map(corners).collect();
        for corners in corners {
            let mut known = None;
            queries.covered_by(corners.map(|c| c.0), |i, px| {
                let (triangle, fit) = known.get_or_insert_with(|| {
                    let triangle = self.triangle(corners.map(|c| c.1));
                    let fit = triangle.fit(&self.limits);
                    (triangle, fit)
                });
                hits.push((i, fit.map(|on_edge| self.sample(natural.as_mut(), triangle, px, on_edge))));
            });
        }
        hits
    }

    fn triangle(&self, points: [u32; 3]) -> Triangle {
        Triangle::new(points.map(|p| self.points[p as usize]))
    }
}

fn triangulated(points: &mut [Seen]) -> DataResult<DelaunayTriangulation<Corner>> {
    // The triangulation takes points from the middle outwards. Sorted like that beforehand, which two threads do
    // faster than its one, neighbours also lie near to each other in memory.
    let n = points.len().max(1) as f64;
    let (u, v) = points.iter().fold((0.0, 0.0), |(u, v), s| (u + s.u, v + s.v));
    let (u, v) = (u / n, v / n);
    let off = |s: &Seen| (s.u - u).powi(2) + (s.v - v).powi(2);
    points.par_sort_unstable_by(|a, b| off(b).total_cmp(&off(a)).then_with(|| by_pixel(a, b)));
    let corner = |(point, s): (u32, &Seen)| Corner { at: Point2::new(s.u, s.v), point };
    DelaunayTriangulation::bulk_load((0..).zip(&*points).map(corner).collect())
        .map_err(|e| DataError::new("the projected cloud cannot be triangulated").because(e))
}

impl Triangle {
    /// From three points, in an order of their own, so that rounding does not depend on who asks.
    fn new(mut corners: [Seen; 3]) -> Self {
        corners.sort_unstable_by(by_pixel);
        let [a, b, c] = corners;
        let (bu, bv, bz) = (b.u - a.u, b.v - a.v, b.z_m - a.z_m);
        let (cu, cv, cz) = (c.u - a.u, c.v - a.v, c.z_m - a.z_m);
        let area = bu * cv - bv * cu;
        Self { corners, slope: [(bz * cv - cz * bv) / area, (bu * cz - cu * bz) / area] }
    }

    /// Depth on the plane through the corners.
    fn at(&self, px: Pixel, on_edge: bool) -> DepthSample {
        let [a, b, c] = self.corners;
        let z_m = a.z_m + self.slope[0] * (px.u - a.u) + self.slope[1] * (px.v - a.v);
        // A needle of a triangle has next to no area to divide by.
        let (low, high) = (a.z_m.min(b.z_m).min(c.z_m), a.z_m.max(b.z_m).max(c.z_m));
        DepthSample { z_m: if z_m.is_finite() { z_m.clamp(low, high) } else { low }, on_edge }
    }

    /// Whether its corners straddle a depth edge; or why it is unfit to interpolate in.
    fn fit(&self, limits: &Limits<'_>) -> Result<bool, DepthMiss> {
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

/// Moves a pixel by a hash of itself.
fn jitter(seen: &mut Seen) {
    let mixed = |mut x: u64| {
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    };
    let hash = mixed(seen.u.to_bits().wrapping_add(mixed(seen.v.to_bits())));
    let shift = |bits: u32| (f64::from(bits) / f64::from(u32::MAX) - 0.5) * 2.0 * JITTER_PX;
    seen.u += shift(hash as u32);
    seen.v += shift((hash >> 32) as u32);
}
