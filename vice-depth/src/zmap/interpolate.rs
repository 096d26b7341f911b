//! The third step: triangulate the points that are left, in pixels, and interpolate `z`, linearly or by natural neighbours.
//!
//! What is interpolated is `z` itself, not `1/z`, over the Delaunay triangulation of the distorted pixels. Four
//! points on a circle have two such triangulations, and a regular grid of points is full of them: to make the
//! triangulation a property of the points, and not of their order or of what else is triangulated with them, each
//! pixel is moved by up to a billionth, by a hash of itself.

use rayon::prelude::*;
use spade::handles::{FixedFaceHandle, InnerTag};
use spade::{DelaunayTriangulation, Point2, PositionInTriangulation, Triangulation};
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample};
use vice_core::error::{DataError, DataResult};

use super::natural::Natural;
use super::queries::Queries;
use super::select::{Seen, Window};
use super::triangle::{Corner, Limits, Triangle, by_pixel};

/// Largest shift of a pixel.
const JITTER_PX: f64 = 1e-9;

/// Faces that a thread fills in one go.
const FACES_AT_ONCE: usize = 1 << 10;

type Answer = Result<DepthSample, DepthMiss>;

/// Triangles over the points in view.
pub(super) struct Surface<'a> {
    points: Vec<Seen>,
    triangles: DelaunayTriangulation<Corner>,
    limits: Limits<'a>,
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
