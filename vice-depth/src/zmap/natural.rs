//! Natural neighbours (Sibson): a pixel takes a share of each point whose Voronoi cell it would cut into, as large as the
//! cut. Smooth between the points where triangles have creases; no further out than the points themselves.

use spade::handles::FixedVertexHandle;
use spade::{DelaunayTriangulation, NaturalNeighbor, Point2, Triangulation};
use vice_core::camera::Pixel;

use super::select::Seen;
use super::triangle::{Corner, Limits, Triangle, by_pixel, off_surface};

/// Weights of natural neighbours over one triangulation.
pub(super) struct Natural<'t> {
    neighbours: NaturalNeighbor<'t, DelaunayTriangulation<Corner>>,
    triangles: &'t DelaunayTriangulation<Corner>,
    points: &'t [Seen],
    weights: Vec<(FixedVertexHandle, f64)>,
}

impl<'t> Natural<'t> {
    pub(super) fn new(triangles: &'t DelaunayTriangulation<Corner>, points: &'t [Seen]) -> Self {
        Self { neighbours: triangles.natural_neighbor(), triangles, points, weights: Vec::new() }
    }

    /// Depth of a pixel in a triangle that is fit to interpolate in, metres. `None` where the pixel lies on a point or the
    /// hull, or where a neighbour lies on another surface than the triangle: the plane of the triangle is better there.
    pub(super) fn z_m(&mut self, px: Pixel, triangle: &Triangle, limits: &Limits<'_>) -> Option<f64> {
        self.neighbours.get_weights(Point2::new(px.u, px.v), &mut self.weights);
        if self.weights.len() < 3 {
            return None;
        }
        let mut shares: Vec<(Seen, f64)> = self
            .weights
            .iter()
            .map(|(vertex, share)| {
                (self.points[self.triangles.vertex(*vertex).data().point as usize], *share)
            })
            .collect();
        let far = |s: &Seen| (s.u - px.u).powi(2) + (s.v - px.v).powi(2) > limits.width_px.powi(2);
        let elsewhere = |s: &Seen| limits.refuses_edges && off_surface(s, triangle, limits);
        if shares.iter().any(|(seen, _)| far(seen) || elsewhere(seen)) {
            return None;
        }
        // In an order of their own, so that rounding does not depend on who asks.
        shares.sort_unstable_by(|a, b| by_pixel(&a.0, &b.0));
        let (mut sum, mut low, mut high) = (0.0, f64::INFINITY, f64::NEG_INFINITY);
        for (seen, share) in &shares {
            sum += share * seen.z_m;
            (low, high) = (low.min(seen.z_m), high.max(seen.z_m));
        }
        sum.is_finite().then(|| sum.clamp(low, high))
    }

    /// Whether the circles through a pixel and each two neighbours that follow each other all are `free`: no point outside
    /// of what was triangulated can become a neighbour then. The circle is given by its centre and radius, pixels.
    pub(super) fn is_closed(&mut self, px: Pixel, free: impl Fn([f64; 2], f64) -> bool) -> bool {
        self.neighbours.get_weights(Point2::new(px.u, px.v), &mut self.weights);
        let at = |i: usize| {
            let position = self.triangles.vertex(self.weights[i % self.weights.len()].0).data().at;
            [position.x - px.u, position.y - px.v]
        };
        (0..self.weights.len()).all(|i| {
            let ([ax, ay], [bx, by]) = (at(i), at(i + 1));
            let twice_area = 2.0 * (ax * by - ay * bx);
            let (a, b) = (ax * ax + ay * ay, bx * bx + by * by);
            let centre = [(by * a - ay * b) / twice_area, (ax * b - bx * a) / twice_area];
            let radius = centre[0].hypot(centre[1]);
            radius.is_finite() && free([px.u + centre[0], px.v + centre[1]], radius)
        })
    }
}
