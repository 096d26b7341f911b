//! Two calibrations of one camera, as the pixels in which they differ.
//!
//! Two calibrations that look through the same lens may differ by a rotation that extrinsics take up. So each pixel's ray
//! by the one is turned by the rotation that brings both closest, and projected by the other: what remains is what no
//! extrinsics mend. The rotation is fitted to the pixels (robustly), as `mrcal-show-projection-diff` does at infinity.
//!
//! What the difference does to RMSE_2D: a key point is lifted and projected with the same camera, so that a constant
//! difference cancels; what counts is how the difference varies between two places of one track. It is told as the RMS
//! difference of the differences at pixels some way apart.

use nalgebra::{Matrix3, Point3, UnitQuaternion, Vector3};

use crate::camera::{Camera, Pixel};
use crate::frames::rotation_vector_rad;
use crate::random::SplitMix;
use crate::statistics::{median, quantile, sorted};

/// Places across and down.
const ACROSS: u32 = 60;
const DOWN: u32 = 40;
/// Steps of the fit.
const STEPS: usize = 30;
/// A track moves a point this share of the image's width, middle of what labels show.
const MOVES: f64 = 0.25;
/// Pairs of places that are drawn.
const PAIRS: usize = 4000;

/// One place of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The pixel by the first calibration.
    pub pixel: Pixel,
    /// Where the second one has it, less where the first has it, pixels; `None` where either has no ray.
    pub off_px: Option<[f64; 2]>,
}

/// How two calibrations differ.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraDifference {
    /// Places on a grid, row by row.
    pub places: Vec<Place>,
    /// Places in a row.
    pub across: usize,
    /// Takes rays of the first to rays of the second: what extrinsics would take up.
    pub second_from_first: UnitQuaternion<f64>,
    /// RMS over the places that both see, pixels.
    pub rms_px: f64,
    /// Median and 95 % quantile, pixels.
    pub median_px: f64,
    /// See `median_px`.
    pub p95_px: f64,
    /// The largest, pixels.
    pub most_px: f64,
    /// Share of the places that one of both does not see.
    pub unseen: f64,
    /// RMS with no rotation between them, pixels.
    pub rms_unrotated_px: f64,
    /// What it adds to RMSE_2D (in squares) for tracks that move by a quarter of the image, pixels.
    pub rmse_2d_px: f64,
}

/// How the second calibration differs from the first; `None` where no place is seen by both, or the sizes of their images
/// differ.
pub fn camera_difference(first: &Camera, second: &Camera) -> Option<CameraDifference> {
    if (first.width(), first.height()) != (second.width(), second.height()) {
        return None;
    }
    let (w, h) = (f64::from(first.width()) - 1.0, f64::from(first.height()) - 1.0);
    let grid = |i: u32, n: u32| f64::from(i) / f64::from(n - 1);
    let pixels: Vec<Pixel> = (0..DOWN)
        .flat_map(|j| (0..ACROSS).map(move |i| Pixel::new(w * grid(i, ACROSS), h * grid(j, DOWN))))
        .collect();
    let rays: Vec<Option<Vector3<f64>>> = pixels.iter().map(|p| first.unproject(*p).ok()).collect();
    let off = |turn: &UnitQuaternion<f64>, i: usize| -> Option<[f64; 2]> {
        let ray = turn * rays[i].as_ref()?;
        let there = second.project(&Point3::from(ray)).ok()?;
        Some([there.u - pixels[i].u, there.v - pixels[i].v])
    };
    let turn = best_turn(second, &pixels, &rays, &off)?;
    let places: Vec<Place> =
        (0..pixels.len()).map(|i| Place { pixel: pixels[i], off_px: off(&turn, i) }).collect();
    let sizes = sorted(places.iter().filter_map(|p| p.off_px.map(|[u, v]| u.hypot(v))).collect());
    let rms = |sizes: &[f64]| (sizes.iter().map(|s| s * s).sum::<f64>() / sizes.len().max(1) as f64).sqrt();
    let plain: Vec<f64> = (0..pixels.len())
        .filter_map(|i| off(&UnitQuaternion::identity(), i).map(|[u, v]| u.hypot(v)))
        .collect();
    Some(CameraDifference {
        rms_px: rms(&sizes),
        median_px: quantile(&sizes, 0.5)?,
        p95_px: quantile(&sizes, 0.95)?,
        most_px: *sizes.last()?,
        unseen: 1.0 - sizes.len() as f64 / places.len() as f64,
        rms_unrotated_px: rms(&plain),
        rmse_2d_px: along_tracks(&places, w)?,
        places,
        across: ACROSS as usize,
        second_from_first: turn,
    })
}

/// The difference of a place after a rotation.
type Off<'a> = dyn Fn(&UnitQuaternion<f64>, usize) -> Option<[f64; 2]> + 'a;

/// The rotation that leaves the least of the differences, by Gauss-Newton in pixels; far ones count less.
fn best_turn(
    second: &Camera,
    pixels: &[Pixel],
    rays: &[Option<Vector3<f64>>],
    off: &Off<'_>,
) -> Option<UnitQuaternion<f64>> {
    let mut turn = UnitQuaternion::identity();
    const H: f64 = 1e-6;
    for _ in 0..STEPS {
        let here: Vec<(usize, [f64; 2])> =
            (0..pixels.len()).filter_map(|i| Some((i, off(&turn, i)?))).collect();
        if here.len() < 10 {
            return None;
        }
        let mut sizes: Vec<f64> = here.iter().map(|(_, [u, v])| u.hypot(*v)).collect();
        let scale = median(&mut sizes)?.max(1e-6);
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (i, [u, v]) in &here {
            let Some(ray) = &rays[*i] else { continue };
            let size = u.hypot(*v);
            let weight = if size < 3.0 * scale { 1.0 } else { 3.0 * scale / size };
            let mut slopes = [Vector3::zeros(); 2];
            let mut seen = true;
            for axis in 0..3 {
                let mut step = Vector3::zeros();
                step[axis] = H;
                let moved = UnitQuaternion::from_scaled_axis(step) * (turn * ray);
                match second.project(&Point3::from(moved)) {
                    Ok(there) => {
                        slopes[0][axis] = (there.u - pixels[*i].u - u) / H;
                        slopes[1][axis] = (there.v - pixels[*i].v - v) / H;
                    }
                    Err(_) => seen = false,
                }
            }
            if !seen {
                continue;
            }
            for (slope, value) in slopes.iter().zip([u, v]) {
                normal += weight * slope * slope.transpose();
                right += weight * *value * slope;
            }
        }
        let step = normal.try_inverse()? * -right;
        turn = UnitQuaternion::from_scaled_axis(step) * turn;
        if step.norm() < 1e-10 {
            break;
        }
    }
    rotation_vector_rad(&turn).iter().all(|v| v.is_finite()).then_some(turn)
}

/// RMS change of the difference between two places of a track.
fn along_tracks(places: &[Place], width: f64) -> Option<f64> {
    let seen: Vec<(Pixel, [f64; 2])> = places.iter().filter_map(|p| Some((p.pixel, p.off_px?))).collect();
    let mut random = SplitMix::new(1);
    let (mut sum, mut count) = (0.0, 0_u32);
    let mut draws = 0;
    while (count as usize) < PAIRS && draws < 200 * PAIRS {
        draws += 1;
        let (a, b) =
            (seen[random.below(seen.len() as u64) as usize], seen[random.below(seen.len() as u64) as usize]);
        let apart = a.0.distance_px(b.0);
        if (apart - MOVES * width).abs() > 0.1 * MOVES * width {
            continue;
        }
        sum += (a.1[0] - b.1[0]).powi(2) + (a.1[1] - b.1[1]).powi(2);
        count += 1;
    }
    (count > 0).then(|| (sum / f64::from(count)).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Model;

    fn camera(k: [f64; 4], d: &[f64]) -> Camera {
        Camera::new(752, 480, k, Model::from_name("radtan", d).unwrap()).unwrap()
    }

    const K: [f64; 4] = [458.654, 457.296, 367.215, 248.375];
    const D: [f64; 4] = [-0.283_408_11, 0.073_959_07, 0.000_193_59, 1.761_871_14e-5];

    #[test]
    fn the_same_camera_does_not_differ() {
        let found = camera_difference(&camera(K, &D), &camera(K, &D)).unwrap();
        assert!(found.most_px < 1e-6 && found.rmse_2d_px < 1e-6, "{}", found.most_px);
    }

    #[test]
    fn a_moved_principal_point_is_mostly_a_rotation() {
        let found = camera_difference(&camera(K, &D), &camera([K[0], K[1], K[2] + 5.0, K[3]], &D)).unwrap();
        assert!((found.rms_unrotated_px - 5.0).abs() < 1e-6, "{}", found.rms_unrotated_px);
        assert!(found.rms_px < 1.5 && found.rms_px > 0.1, "{}", found.rms_px);
        let turn = rotation_vector_rad(&found.second_from_first);
        assert!((turn.norm() - 5.0 / K[0]).abs() < 2e-3, "{turn}");
    }

    #[test]
    fn a_focal_length_stays() {
        let found =
            camera_difference(&camera(K, &D), &camera([1.02 * K[0], 1.02 * K[1], K[2], K[3]], &D)).unwrap();
        // Two percent of the distance to the principal point.
        assert!(found.most_px > 8.0 && found.most_px < 10.0, "{}", found.most_px);
        assert!((found.rms_px - found.rms_unrotated_px).abs() < 0.2);
        // Between places a quarter of 751 px apart.
        assert!((found.rmse_2d_px - 0.02 * 0.25 * 751.0).abs() < 0.1, "{}", found.rmse_2d_px);
    }
}
