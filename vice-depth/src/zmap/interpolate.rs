//! The third step: triangulate the points that are left, in pixels, and interpolate `z` linearly.
//!
//! What is interpolated is `z` itself, not `1/z`, over the Delaunay triangulation of the distorted pixels.

use spade::{DelaunayTriangulation, HasPosition, Point2, PositionInTriangulation, Triangulation};
use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample};
use vice_core::error::{DataError, DataResult};

/// A point of the cloud as the camera sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// Pixels.
    pub(crate) u: f64,
    /// Pixels.
    pub(crate) v: f64,
    /// Metres along the optical axis.
    pub(crate) z_m: f64,
}

impl HasPosition for Seen {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        Point2::new(self.u, self.v)
    }
}

/// Triangles over the points in view.
pub(crate) struct Surface {
    triangles: DelaunayTriangulation<Seen>,
    limits: Limits,
}

/// What makes a triangle unfit to interpolate in.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// Longest edge, pixels.
    pub(crate) width_px: f64,
    /// Largest `z_far / z_near - 1` of its corners.
    pub(crate) depth_ratio: f64,
}

impl Surface {
    /// Triangulates. Of points at one pixel the nearest is kept, so that their order does not matter.
    pub(crate) fn new(mut seen: Vec<Seen>, limits: Limits) -> DataResult<Self> {
        seen.sort_unstable_by(|a, b| {
            a.u.total_cmp(&b.u).then(a.v.total_cmp(&b.v)).then(a.z_m.total_cmp(&b.z_m))
        });
        seen.dedup_by(|b, a| a.u == b.u && a.v == b.v);
        let triangles = DelaunayTriangulation::bulk_load(seen)
            .map_err(|e| DataError::new("the projected cloud cannot be triangulated").because(e))?;
        Ok(Self { triangles, limits })
    }

    /// Depth of a pixel.
    pub(crate) fn depth(&self, pixel: Pixel) -> Result<DepthSample, DepthMiss> {
        if self.triangles.num_vertices() == 0 {
            return Err(DepthMiss::EmptyView);
        }
        if !(pixel.u.is_finite() && pixel.v.is_finite()) {
            return Err(DepthMiss::OutsideImage);
        }
        let at = Point2::new(pixel.u, pixel.v);
        let corners = match self.triangles.locate(at) {
            PositionInTriangulation::OnVertex(vertex) => {
                return Ok(DepthSample::new(self.triangles.vertex(vertex).data().z_m));
            }
            PositionInTriangulation::OnFace(face) => self.triangles.face(face).vertices(),
            PositionInTriangulation::OnEdge(edge) => {
                let edge = self.triangles.directed_edge(edge);
                let face = edge.face().as_inner().or_else(|| edge.rev().face().as_inner());
                face.ok_or(DepthMiss::OutsideHull)?.vertices()
            }
            PositionInTriangulation::OutsideOfConvexHull(_) | PositionInTriangulation::NoTriangulation => {
                return Err(DepthMiss::OutsideHull);
            }
        };
        self.limits.interpolate(corners.map(|c| *c.data()), pixel)
    }
}

impl Limits {
    /// `z` of the plane through three points at a pixel, in `(u, v, z)`.
    fn interpolate(&self, [a, b, c]: [Seen; 3], at: Pixel) -> Result<DepthSample, DepthMiss> {
        let width = |p: Seen, q: Seen| (p.u - q.u).hypot(p.v - q.v);
        if width(a, b).max(width(b, c)).max(width(c, a)) > self.width_px {
            return Err(DepthMiss::TriangleTooWide);
        }
        let (near, far) = (a.z_m.min(b.z_m).min(c.z_m), a.z_m.max(b.z_m).max(c.z_m));
        if far > near * (1.0 + self.depth_ratio) {
            return Err(DepthMiss::OcclusionEdge);
        }
        let (bu, bv, cu, cv) = (b.u - a.u, b.v - a.v, c.u - a.u, c.v - a.v);
        let (pu, pv) = (at.u - a.u, at.v - a.v);
        let area = bu * cv - bv * cu;
        let (wb, wc) = ((pu * cv - pv * cu) / area, (bu * pv - bv * pu) / area);
        Ok(DepthSample::new(a.z_m + wb * (b.z_m - a.z_m) + wc * (c.z_m - a.z_m)))
    }
}
