//! A quadrangle's corners between pixels: a line through the steepest places along each side, and where they cross.
//!
//! A lens bends the sides, so that the lines are fitted to rays, in normalised coordinates: there they are straight.

use nalgebra::{Matrix2, Point3, Vector2};
use vice_core::camera::{Camera, Pixel};
use vice_core::statistics::middle;

use crate::gray::Gray;
use crate::quads::Quad;

/// The part at both ends of a side that is left out: corners round off.
const LEFT_OUT: f64 = 0.1;
/// Steps weaker than this are no edge, gray levels.
const WEAKEST: f64 = 6.0;

/// Between the places of a profile across a side, pixels.
const STEP_PX: f64 = 0.25;
/// A rise is taken over one pixel: so many places to both sides.
const HALF_STEP: usize = 2;

/// The corners of a dark quadrangle that is `cells` cells wide. `None` if a side has no edge or the corners run away.
pub(crate) fn refine(gray: &Gray, quad: &Quad, cells: usize, camera: Option<&Camera>) -> Option<Quad> {
    let mut now = *quad;
    for round in 0..3 {
        let mut lines = Vec::with_capacity(4);
        for side in 0..4 {
            let (a, b) = (now[side], now[(side + 1) % 4]);
            let across = across(&now, side);
            let cell = across / cells as f64;
            let reach = if round == 0 { (0.9 * cell).clamp(1.5, 4.0) } else { (0.8 * cell).clamp(1.0, 2.5) };
            lines.push(line(&edge_points(gray, a, b, reach, camera))?);
        }
        let mut next = now;
        for corner in 0..4 {
            next[corner] = pixel(crossing(&lines[(corner + 3) % 4], &lines[corner])?, camera)?;
        }
        let limit = 3.0 + 0.1 * (now[0] - now[2]).norm();
        if next.iter().zip(quad).any(|(n, start)| (n - start).norm() > limit) {
            return None;
        }
        now = next;
    }
    Some(now)
}

/// Mean distance of a side from the corners opposite.
fn across(quad: &Quad, side: usize) -> f64 {
    let (a, b) = (quad[side], quad[(side + 1) % 4]);
    let along = (b - a).normalize();
    let away = |p: Vector2<f64>| ((p - a).x * along.y - (p - a).y * along.x).abs();
    0.5 * (away(quad[(side + 2) % 4]) + away(quad[(side + 3) % 4]))
}

/// Steepest places along a side with their weights, as rays' normalised coordinates where the camera is known.
fn edge_points(
    gray: &Gray,
    a: Vector2<f64>,
    b: Vector2<f64>,
    reach: f64,
    camera: Option<&Camera>,
) -> Vec<(Vector2<f64>, f64)> {
    let length = (b - a).norm();
    let along = (b - a) / length;
    // Clockwise with y downwards: outside is to the left.
    let out = Vector2::new(along.y, -along.x);
    let count = (length.ceil() as usize).clamp(8, 64);
    let steps = (reach / STEP_PX).round() as usize;
    let mut profile = vec![0.0; 2 * (steps + HALF_STEP) + 1];
    let mut points = Vec::with_capacity(count);
    for k in 0..count {
        let part = LEFT_OUT + (1.0 - 2.0 * LEFT_OUT) * (k as f64 + 0.5) / count as f64;
        let on = a + (b - a) * part;
        let (mut weight, mut moment) = (0.0, 0.0);
        // Each place once: the outer end of one step is the inner end of the fourth after it.
        for (k, value) in profile.iter_mut().enumerate() {
            let p = on + out * (STEP_PX * (k as f64 - (steps + HALF_STEP) as f64));
            *value = gray.sample(p.x, p.y).map_or(f64::NAN, f64::from);
        }
        for (k, ends) in profile.windows(2 * HALF_STEP + 1).enumerate() {
            // Not a number where an end lies outside the picture, which is no rise.
            let rise = ends[2 * HALF_STEP] - ends[0];
            if rise > WEAKEST {
                weight += rise * rise;
                moment += rise * rise * (STEP_PX * (k as f64 - steps as f64));
            }
        }
        if weight > 0.0 {
            let place = on + out * (moment / weight);
            let known = match camera {
                None => Some(place),
                Some(camera) => camera.unproject(Pixel::new(place.x, place.y)).ok().map(|ray| ray.xy()),
            };
            points.extend(known.map(|p| (p, weight)));
        }
    }
    points
}

/// The line through weighted points, as a point and a direction; points far off it are left out the second time.
fn line(points: &[(Vector2<f64>, f64)]) -> Option<(Vector2<f64>, Vector2<f64>)> {
    let mut kept = points.to_vec();
    let mut fitted = None;
    for _ in 0..2 {
        if kept.len() < 4 {
            return None;
        }
        let total: f64 = kept.iter().map(|p| p.1).sum();
        let centre = kept.iter().map(|p| p.0 * p.1).sum::<Vector2<f64>>() / total;
        let spread: Matrix2<f64> =
            kept.iter().map(|p| (p.0 - centre) * (p.0 - centre).transpose() * p.1).sum();
        let eigen = spread.symmetric_eigen();
        let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        let off = |p: Vector2<f64>| ((p - centre).x * along.y - (p - centre).y * along.x).abs();
        let mut offs: Vec<f64> = kept.iter().map(|p| off(p.0)).collect();
        let limit = 4.0 * middle(&mut offs, f64::total_cmp)?;
        kept.retain(|p| off(p.0) <= limit);
        fitted = Some((centre, along));
    }
    fitted
}

fn crossing(one: &(Vector2<f64>, Vector2<f64>), two: &(Vector2<f64>, Vector2<f64>)) -> Option<Vector2<f64>> {
    let turn = one.1.x * two.1.y - one.1.y * two.1.x;
    if turn.abs() < 1e-3 {
        return None;
    }
    let between = two.0 - one.0;
    Some(one.0 + one.1 * ((between.x * two.1.y - between.y * two.1.x) / turn))
}

fn pixel(at: Vector2<f64>, camera: Option<&Camera>) -> Option<Vector2<f64>> {
    match camera {
        None => Some(at),
        Some(camera) => camera.project(&Point3::new(at.x, at.y, 1.0)).ok().map(|px| Vector2::new(px.u, px.v)),
    }
}
