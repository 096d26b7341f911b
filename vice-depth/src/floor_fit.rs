//! Finds the floor in a scan or a depth image.
//!
//! Planes through three random points that are level enough are tried (RANSAC, with a seed of its own: the answer is
//! always the same). The one with the most points wins among those that have next to nothing below them: a ceiling
//! and a table are level and large, but only the floor is low. The winner is then fitted by least squares to its
//! points, and its points found again, until they stay the same.

use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{DepthImage, Plane};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{self, Rigid, World};
use vice_core::random::SplitMix;

use crate::cloud::Cloud;
use crate::scatter::Scatter;

/// Points that planes are tried on; the final fit uses all.
const SAMPLE: usize = 20_000;

/// Level planes that are counted out.
const CANDIDATES: usize = 400;

/// Triples drawn to find them.
const MOST_DRAWS: usize = 400_000;

/// Rounds of least squares.
const MOST_ROUNDS: usize = 20;

/// How a floor is looked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorFitOptions {
    /// Points this near to the plane are of the floor, metres; 0.02 by default.
    pub tolerance_m: f64,
    /// How far from level the floor may be, radians; 15 degrees by default.
    pub max_tilt_rad: f64,
    /// Part of the points that may lie below the floor, such as reflections; 0.05 by default.
    pub max_below: f64,
}

impl Default for FloorFitOptions {
    fn default() -> Self {
        Self { tolerance_m: 0.02, max_tilt_rad: 15_f64.to_radians(), max_below: 0.05 }
    }
}

/// A floor that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorFit {
    /// The plane in the world, its normal upwards.
    pub plane: Plane<World>,
    /// Points within the tolerance.
    pub inliers: usize,
    /// Points looked at.
    pub points: usize,
    /// Root of the mean square distance of the inliers from the plane, metres.
    pub rms_m: f64,
    /// Angle between the plane's normal and up, radians.
    pub tilt_rad: f64,
}

/// Finds the floor in a scan. `up` points away from gravity in the world.
///
/// # Errors
/// [`DataError`] if no level plane has the rest of the points above it, or an option is out of its range.
pub fn fit_floor_to_cloud(
    cloud: &Cloud,
    world_from_cloud: &Rigid<World, frames::Cloud>,
    up: Unit<Vector3<f64>>,
    options: &FloorFitOptions,
) -> DataResult<FloorFit> {
    let points: Vec<Point3<f64>> = cloud.points().map(|p| world_from_cloud.transform_point(&p)).collect();
    fit(&points, up, options)
}

/// Finds the floor in a depth image that is registered to a camera. `up` points away from gravity in the world.
///
/// # Errors
/// [`DataError`] as for [`fit_floor_to_cloud`], or if the image has another size than the camera's.
pub fn fit_floor_to_depth_image(
    image: &DepthImage,
    camera: &Camera,
    world_from_camera: &Rigid<World, frames::Camera>,
    up: Unit<Vector3<f64>>,
    options: &FloorFitOptions,
) -> DataResult<FloorFit> {
    let (width, height) = (camera.width(), camera.height());
    if (image.width(), image.height()) != (width, height) {
        return Err(DataError::new(format!(
            "the depth image has {}x{} pixels, the camera {width}x{height}",
            image.width(),
            image.height()
        )));
    }
    let point = |i: u32| {
        let (u, v) = (i % width, i / width);
        let z_m = f64::from(image.get(u, v)?);
        let ray = camera.unproject(Pixel::new(u.into(), v.into())).ok()?;
        Some(world_from_camera.transform_point(&Point3::from(ray * z_m)))
    };
    let points: Vec<_> = (0..width * height).into_par_iter().filter_map(point).collect();
    fit(&points, up, options)
}

fn fit(points: &[Point3<f64>], up: Unit<Vector3<f64>>, options: &FloorFitOptions) -> DataResult<FloorFit> {
    let FloorFitOptions { tolerance_m, max_tilt_rad, max_below } = *options;
    if !(tolerance_m > 0.0 && tolerance_m.is_finite()) {
        return Err(DataError::new(format!("a tolerance of {tolerance_m} m is not positive")));
    }
    if !((0.0..=std::f64::consts::FRAC_PI_2).contains(&max_tilt_rad) && (0.0..=1.0).contains(&max_below)) {
        return Err(DataError::new("the floor's largest tilt or the part below it is out of range"));
    }
    let none = || {
        DataError::new(format!("no floor among {} points", points.len())).hint(format!(
            "none of the planes within {:.0}° of level has the rest above it: is up the right way?",
            max_tilt_rad.to_degrees()
        ))
    };
    let mut found = candidate(points, up, options).ok_or_else(none)?;
    let mut members = inliers(points, &found, tolerance_m);
    for _ in 0..MOST_ROUNDS {
        let Some(better) = least_squares(points, &members, up) else { break };
        let again = inliers(points, &better, tolerance_m);
        found = better;
        if again == members {
            break;
        }
        members = again;
    }
    let (normal, d_m) = found;
    let sum: f64 = members.iter().map(|i| (normal.dot(&points[*i].coords) + d_m).powi(2)).sum();
    let tilt_rad = normal.cross(&up).norm().atan2(normal.dot(&up));
    if members.len() < 3 || tilt_rad > max_tilt_rad {
        return Err(none());
    }
    Ok(FloorFit {
        plane: Plane::new(normal.into(), d_m)?,
        inliers: members.len(),
        points: points.len(),
        rms_m: (sum / members.len() as f64).sqrt(),
        tilt_rad,
    })
}

/// The level plane with the most points near and next to none below, as normal and offset.
fn candidate(
    points: &[Point3<f64>],
    up: Unit<Vector3<f64>>,
    options: &FloorFitOptions,
) -> Option<(Vector3<f64>, f64)> {
    let sample: Vec<Point3<f64>> =
        points.iter().step_by(points.len().div_ceil(SAMPLE).max(1)).copied().collect();
    if sample.len() < 3 {
        return None;
    }
    let mut random = SplitMix::new(0x9e37_79b9_7f4a_7c15);
    let mut pick = || sample[(random.bits() % sample.len() as u64) as usize];
    let level = options.max_tilt_rad.cos();
    let mut planes = Vec::new();
    for _ in 0..MOST_DRAWS {
        let (a, b, c) = (pick(), pick(), pick());
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(1e-12) else { continue };
        let normal = if normal.dot(&up) < 0.0 { -normal } else { normal };
        if normal.dot(&up) >= level {
            planes.push((normal, -normal.dot(&a.coords)));
            if planes.len() == CANDIDATES {
                break;
            }
        }
    }
    let most_below = (options.max_below * sample.len() as f64) as usize;
    let score = |(i, (normal, d)): (usize, &(Vector3<f64>, f64))| {
        let (mut near, mut below) = (0_usize, 0_usize);
        for p in &sample {
            let height = normal.dot(&p.coords) + d;
            near += usize::from(height.abs() <= options.tolerance_m);
            below += usize::from(height < -options.tolerance_m);
        }
        (below <= most_below).then_some((near, std::cmp::Reverse(i)))
    };
    let (_, std::cmp::Reverse(best)) = planes.par_iter().enumerate().filter_map(score).max()?;
    Some(planes[best])
}

fn inliers(points: &[Point3<f64>], (normal, d_m): &(Vector3<f64>, f64), tolerance_m: f64) -> Vec<usize> {
    let near = |i: &usize| (normal.dot(&points[*i].coords) + d_m).abs() <= tolerance_m;
    (0..points.len()).into_par_iter().filter(near).collect()
}

/// The plane with the least squares of distances from some points.
fn least_squares(
    points: &[Point3<f64>],
    members: &[usize],
    up: Unit<Vector3<f64>>,
) -> Option<(Vector3<f64>, f64)> {
    if members.len() < 3 {
        return None;
    }
    let Scatter { mean, squares, .. } = Scatter::of(members.iter().map(|i| points[*i].coords));
    let eigen = squares.symmetric_eigen();
    let normal: Vector3<f64> = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into();
    let normal = if normal.dot(&up) < 0.0 { -normal } else { normal };
    Some((normal, -normal.dot(&mean)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::CloudOptions;
    use crate::scene::{Random, Scene, camera, grid, look};
    use nalgebra::UnitQuaternion;

    /// The room's scan with noise, moved into another world.
    fn noisy(noise_m: f64, world: &Rigid<World, frames::Cloud>) -> Cloud {
        let mut random = Random(3);
        let mut shake =
            |v: f32| v + ((random.next() + random.next() + random.next() - 1.5) * noise_m * 2.0) as f32;
        let back = world.inverse();
        let points = Scene::room().scan(2000.0).into_iter().map(move |p| {
            let p = back.transform_point(&p.map(&mut shake).cast());
            p.cast()
        });
        Cloud::from_points(points, &CloudOptions::default()).unwrap()
    }

    #[test]
    fn the_floor_is_found_and_not_the_ceiling_or_a_box() {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.3, -0.2, 1.0));
        for world in [Rigid::identity(), Rigid::from_parts(Vector3::new(4.0, -1.0, 7.0), turn)] {
            let cloud = noisy(0.005, &world);
            let up = Vector3::z_axis();
            let fit = fit_floor_to_cloud(&cloud, &world, up, &FloorFitOptions::default()).unwrap();
            assert!(fit.plane.normal().z > 0.99999 && fit.plane.d_m().abs() < 1e-3, "{fit:?}");
            assert!((0.003..0.007).contains(&fit.rms_m), "{fit:?}");
            assert_eq!(fit.points, cloud.len());
            assert!(fit.inliers > 55_000 && fit.tilt_rad < 1e-2, "{fit:?}");
            let again = fit_floor_to_cloud(&cloud, &world, up, &FloorFitOptions::default()).unwrap();
            assert_eq!(again, fit);
            // Upside down the ceiling is the floor.
            let down = fit_floor_to_cloud(&cloud, &world, -up, &FloorFitOptions::default()).unwrap();
            assert!(down.plane.normal().z < -0.99999 && (down.plane.d_m() - 3.0).abs() < 1e-2, "{down:?}");
        }
    }

    #[test]
    fn a_depth_image_will_do_too() {
        let (camera, scene) = (camera(), Scene::room());
        let keyframe = look(&camera, [-2.0, -1.0, 1.6], [0.0, -0.3, 0.0]);
        let z_m = grid(&camera, 1).into_iter().map(|px| scene.depth(&keyframe, px) as f32).collect();
        let image = DepthImage::new(keyframe.stamp, 752, 480, z_m).unwrap();
        let world_from_camera = keyframe.world_from_camera.unwrap();
        let options = FloorFitOptions::default();
        let fit = fit_floor_to_depth_image(&image, &camera, &world_from_camera, Vector3::z_axis(), &options)
            .unwrap();
        assert!(fit.plane.normal().z > 0.999999 && fit.plane.d_m().abs() < 1e-3, "{fit:?}");
        let small = DepthImage::new(keyframe.stamp, 1, 1, vec![1.0]).unwrap();
        let other =
            fit_floor_to_depth_image(&small, &camera, &world_from_camera, Vector3::z_axis(), &options);
        assert!(other.unwrap_err().to_string().contains("has 1x1 pixels, the camera 752x480"));
    }

    #[test]
    fn where_there_is_no_floor_none_is_made_up() {
        let fit = |points: Vec<Point3<f32>>, options: FloorFitOptions| {
            let cloud = Cloud::from_points(points, &CloudOptions::default()).unwrap();
            fit_floor_to_cloud(&cloud, &Rigid::identity(), Vector3::z_axis(), &options)
                .map_err(|e| e.to_string())
        };
        let wall = (0..1000).map(|i| Point3::new(1.0, (i % 32) as f32, (i / 32) as f32)).collect();
        assert!(fit(wall, FloorFitOptions::default()).unwrap_err().starts_with("no floor among 1000 points"));
        let two = vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0)];
        assert!(fit(two.clone(), FloorFitOptions::default()).is_err());
        assert!(fit(two.clone(), FloorFitOptions { tolerance_m: 0.0, ..Default::default() }).is_err());
        assert!(fit(two, FloorFitOptions { max_below: 2.0, ..Default::default() }).is_err());
    }
}
