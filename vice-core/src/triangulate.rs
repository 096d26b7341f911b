//! The depth of a key point from its own labels: where a pose stream has carried the camera far enough aside, the rays of
//! later labels say how far away the point is.
//!
//! Sought are the inverse depth `w = 1/z` along the ray `a` of the key frame's label, and by how much that label is off, since
//! it moves all views alike: the later camera sees the point in the direction `R a + w t`, where `R` and `t` are the stream's
//! motion since the key frame. The sum of the squared pixel distances to all labels, that of the key frame among them, is made
//! smallest by Gauss-Newton steps from the linear solution. The depth is along the ray of the label as it stands.
//!
//! The motion is that of the stream under test. What looks in all views like another depth, such as a motion of another
//! scale, is taken for depth and leaves no error.

use nalgebra::{Matrix2x3, Matrix3, Vector2, Vector3};

use crate::camera::{Camera, Pixel};
use crate::depth::DepthMiss;
use crate::frames::{self, Rigid, WorldFromCamera};

/// Rays that meet at a smaller angle than this say no depth, degrees.
pub const LEAST_PARALLAX_DEG: f64 = 1.0;
/// A depth less sure than this part of it, one standard deviation, is none.
pub const LEAST_SURE: f64 = 0.2;
/// Labels are not better than this, px.
const LEAST_NOISE_PX: f64 = 0.5;
/// Fewer views than this say no depth: their residuals would say nothing about how sure it is.
const FEWEST_VIEWS: usize = 2;
/// So many deviations behind the camera the rays do not meet in front of it.
const BEHIND: f64 = 3.0;
/// Steps at most, and halvings of one.
const STEPS: usize = 50;
const HALVINGS: usize = 30;
/// A step this small, as a part of the inverse depth, is the last.
const LAST_STEP: f64 = 1e-12;
/// Where the linear solution sees nothing, inverse depths from here to there are tried, 1/m.
const TRIED_INVERSE_M: (f64, f64) = (1e-3, 1e2);
const TRIED: usize = 101;

/// A depth along the optical axis of the key frame, and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangulatedDepth {
    /// Metres along the optical axis of the key frame.
    pub z_m: f64,
    /// Its standard deviation, metres, if labels were all that is off.
    pub sigma_m: f64,
    /// The widest angle between the ray of the key frame and that of a later label, radians.
    pub parallax_rad: f64,
    /// How many later labels it is from.
    pub views: usize,
    /// RMS of the distances that are left to these labels, px.
    pub left_px: f64,
}

/// A later view: how the point moves into its camera, and where the label is.
struct View {
    /// From the key frame's camera to the later one: the turn, and the key frame's camera there, metres.
    turn: Matrix3<f64>,
    origin_m: Vector3<f64>,
    label: Pixel,
}

/// What is sought: the inverse depth, and by how much the label of the key frame is off.
#[derive(Clone, Copy)]
struct Sought {
    inverse_m: f64,
    off_px: Vector2<f64>,
}

/// The sums that a step is made of: over the pixels of the views and the shift of the key frame's label.
#[derive(Clone, Copy)]
struct Sums {
    squares_px2: f64,
    /// Those of the views alone.
    left_px2: f64,
    normal: Matrix3<f64>,
    gradient: Vector3<f64>,
}

struct Problem<'a> {
    camera: &'a Camera,
    keyframe_px: Pixel,
    views: Vec<View>,
}

/// The depth of a key point by later labels of it. `views` are where the stream says the cameras were, and their labels.
///
/// # Errors
/// [`DepthMiss::OutsideModel`] where the key frame's pixel has no ray, [`DepthMiss::LittleParallax`] where the views are too
/// few or too near each other, [`DepthMiss::RaysApart`] where their rays do not meet in front of the camera.
pub fn triangulate(
    camera: &Camera,
    at_keyframe: &WorldFromCamera,
    keyframe_px: Pixel,
    views: impl IntoIterator<Item = (WorldFromCamera, Pixel)>,
) -> Result<TriangulatedDepth, DepthMiss> {
    let view = |(now, label): (WorldFromCamera, Pixel)| {
        let now_from_keyframe: Rigid<frames::Camera, frames::Camera> = now.inverse() * *at_keyframe;
        let (turn, origin_m) = now_from_keyframe.to_matrix_and_translation();
        View { turn, origin_m, label }
    };
    let problem = Problem { camera, keyframe_px, views: views.into_iter().map(view).collect() };
    let ray = camera.unproject(keyframe_px).map_err(|_| DepthMiss::OutsideModel)?;
    let count = problem.views.len();
    if count < FEWEST_VIEWS {
        return Err(DepthMiss::LittleParallax);
    }
    let (Sought { inverse_m, .. }, sums) = problem.solve(&ray)?;
    // Two coordinates a label, that of the key frame among them, for three unknowns.
    let noise2 = (sums.squares_px2 / (2 * count - 1) as f64).max(LEAST_NOISE_PX * LEAST_NOISE_PX);
    let variance = sums.normal.try_inverse().map(|inverse| noise2 * inverse[(0, 0)]);
    let Some(sigma_inverse_m) = variance.filter(|v| v.is_finite() && *v > 0.0).map(f64::sqrt) else {
        return Err(DepthMiss::LittleParallax);
    };
    if inverse_m < -BEHIND * sigma_inverse_m {
        return Err(DepthMiss::RaysApart);
    }
    let between = |view: &View| {
        let along = view.turn * ray;
        along.angle(&(along + inverse_m * view.origin_m))
    };
    let parallax_rad = problem.views.iter().map(between).fold(0.0, f64::max);
    let unsure = sigma_inverse_m / inverse_m;
    let is_sure = inverse_m > 0.0 && unsure <= LEAST_SURE;
    if !is_sure || parallax_rad < LEAST_PARALLAX_DEG.to_radians() {
        return Err(DepthMiss::LittleParallax);
    }
    let z_m = 1.0 / inverse_m;
    let left_px = (sums.left_px2 / count as f64).sqrt();
    Ok(TriangulatedDepth { z_m, sigma_m: z_m * unsure, parallax_rad, views: count, left_px })
}

impl Problem<'_> {
    /// What fits best, and the sums there.
    fn solve(&self, ray: &Vector3<f64>) -> Result<(Sought, Sums), DepthMiss> {
        let start = |inverse_m: f64| {
            let sought = Sought { inverse_m, off_px: Vector2::zeros() };
            Some((sought, self.sums(&sought)?))
        };
        let (mut sought, mut at) = match self.linear(ray).and_then(start) {
            Some(start) => start,
            // The point is behind a camera there: look where it is before all of them.
            None => {
                let (low, high) = TRIED_INVERSE_M;
                let tried = (0..TRIED).map(|i| low * (high / low).powf(i as f64 / (TRIED - 1) as f64));
                tried
                    .filter_map(start)
                    .min_by(|a, b| a.1.squares_px2.total_cmp(&b.1.squares_px2))
                    .ok_or(DepthMiss::RaysApart)?
            }
        };
        for _ in 0..STEPS {
            // Where the cameras did not move, the normal equations say so.
            let Some(mut step) =
                at.normal.lu().solve(&-at.gradient).filter(|s| s.iter().all(|v| v.is_finite()))
            else {
                break;
            };
            let mut better = None;
            for _ in 0..HALVINGS {
                let next = Sought {
                    inverse_m: sought.inverse_m + step.x,
                    off_px: sought.off_px + step.fixed_rows::<2>(1),
                };
                better = self
                    .sums(&next)
                    .filter(|sums| sums.squares_px2 <= at.squares_px2)
                    .map(|sums| (next, sums));
                if better.is_some() {
                    break;
                }
                step *= 0.5;
            }
            let Some(next) = better else { break };
            (sought, at) = next;
            if step.x.abs() <= LAST_STEP * sought.inverse_m.abs() {
                break;
            }
        }
        Ok((sought, at))
    }

    /// The inverse depth at which the directions are nearest to the labels' rays; `None` where the cameras did not move.
    fn linear(&self, ray: &Vector3<f64>) -> Option<f64> {
        let (mut with, mut of) = (0.0, 0.0);
        for view in &self.views {
            let Ok(label) = self.camera.unproject(view.label) else { continue };
            let label = label.normalize();
            let (along, origin) = (label.cross(&(view.turn * ray)), label.cross(&view.origin_m));
            with += along.dot(&origin);
            of += origin.norm_squared();
        }
        (of > 0.0).then(|| -with / of)
    }

    /// The sums at a place; `None` where a view does not see the point then.
    fn sums(&self, sought: &Sought) -> Option<Sums> {
        let Sought { inverse_m, off_px } = *sought;
        let px = Pixel::new(self.keyframe_px.u + off_px.x, self.keyframe_px.v + off_px.y);
        let ray = self.camera.unproject(px).ok()?;
        let (_, px_by_ray) = self.camera.project_with_jacobian(&ray.into()).ok()?;
        let ray_by_px = px_by_ray.fixed_columns::<2>(0).into_owned().try_inverse()?;
        let mut left_px2 = 0.0;
        let (mut normal, mut gradient) = (Matrix3::zeros(), Vector3::zeros());
        for View { turn, origin_m, label } in &self.views {
            let point = turn * ray + inverse_m * origin_m;
            let (px, by_point) = self.camera.project_with_jacobian(&point.into()).ok()?;
            let residual = Vector2::new(px.u - label.u, px.v - label.v);
            let by_label = by_point * turn.fixed_columns::<2>(0) * ray_by_px;
            let by_inverse = by_point * origin_m;
            let by = Matrix2x3::from_columns(&[
                by_inverse,
                by_label.column(0).into_owned(),
                by_label.column(1).into_owned(),
            ]);
            left_px2 += residual.norm_squared();
            normal += by.transpose() * by;
            gradient += by.transpose() * residual;
        }
        // The label of the key frame is as good as the others.
        normal += Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0));
        gradient += Vector3::new(0.0, off_px.x, off_px.y);
        Some(Sums { squares_px2: left_px2 + off_px.norm_squared(), left_px2, normal, gradient })
    }
}

#[cfg(test)]
mod tests;
