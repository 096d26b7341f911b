//! Exact views give the exact depth, noise as much error as is said, and a motion of another scale another depth.

use nalgebra::{Point3, UnitQuaternion};
use proptest::prelude::*;

use super::*;
use crate::camera::Model;
use crate::random::SplitMix;

fn pose(n: [f64; 6]) -> WorldFromCamera {
    Rigid::from_parts(
        [n[0], n[1], n[2]].into(),
        UnitQuaternion::from_scaled_axis(Vector3::new(n[3], n[4], n[5])),
    )
}

/// A point seen while the camera slides to the right and turns a little.
fn views(
    camera: &Camera,
    z_m: f64,
    step_m: f64,
    count: usize,
) -> (WorldFromCamera, Pixel, Vec<(WorldFromCamera, Pixel)>) {
    let at_keyframe = pose([0.3, -0.2, 0.1, 0.1, -0.2, 0.05]);
    let px = Pixel::new(400.0, 260.0);
    let world = at_keyframe.transform_point(&Point3::from(camera.unproject(px).unwrap() * z_m));
    let views = (1..=count).filter_map(|i| {
        let s = i as f64;
        let moved =
            pose([step_m * s, 0.1 * step_m * s, -0.05 * step_m * s, 0.002 * s, -0.001 * s, 0.003 * s]);
        let now = at_keyframe * moved.reinterpret::<frames::Camera, frames::Camera>();
        let seen = camera.project(&now.inverse().transform_point(&world)).ok()?;
        Some((now, seen))
    });
    (at_keyframe, px, views.collect())
}

fn radtan() -> Camera {
    let model = Model::from_name("radtan", &[-0.28, 0.07, 0.0002, 0.00002]).unwrap();
    Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap()
}

proptest! {
    #[test]
    fn exact_views_give_the_exact_depth_with_each_lens(z in 0.4..20.0_f64, share in 0.004..0.03_f64, count in 8_usize..40) {
        for (name, camera) in crate::camera::lenses() {
            let (at_keyframe, px, views) = views(&camera, z, share * z, count);
            let angle = (share * count as f64).atan().to_degrees();
            if angle < 4.0 || views.len() < count {
                continue;
            }
            let found = triangulate(&camera, &at_keyframe, px, views.iter().copied()).unwrap();
            prop_assert!((found.z_m / z - 1.0).abs() < 1e-8, "{} {:?} {}", name, found, z);
            prop_assert!(found.left_px < 1e-6 && found.views == count);
        }
    }

    #[test]
    fn a_motion_of_another_scale_is_taken_for_depth(z in 0.5..8.0_f64, scale in 0.5..2.0_f64) {
        let camera = radtan();
        let (at_keyframe, px, views) = views(&camera, z, 0.02 * z, 20);
        let scaled = |pose: &WorldFromCamera| Rigid::from_parts(pose.translation() * scale, pose.rotation());
        let views = views.iter().map(|(now, px)| (scaled(now), *px));
        let found = triangulate(&camera, &scaled(&at_keyframe), px, views).unwrap();
        prop_assert!((found.z_m / (scale * z) - 1.0).abs() < 1e-8 && found.left_px < 1e-6);
    }
}

/// The error of many depths from noisy labels, in the deviations that they say, has the deviation one.
#[test]
fn depths_are_as_sure_as_is_said() {
    let camera = radtan();
    for (z, count) in [(2.0, 25), (6.0, 60)] {
        let (at_keyframe, px, exact) = views(&camera, z, 0.01 * z, count);
        let mut random = SplitMix::new(5);
        let mut noisy = |px: Pixel| Pixel::new(px.u + 0.8 * random.normal(), px.v + 0.8 * random.normal());
        let mut squares = Vec::new();
        for _ in 0..600 {
            let keyframe = noisy(px);
            let views: Vec<_> = exact.iter().map(|(now, px)| (*now, noisy(*px))).collect();
            let found = triangulate(&camera, &at_keyframe, keyframe, views).unwrap();
            squares.push(((found.z_m - z) / found.sigma_m).powi(2));
        }
        let deviation = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((0.9..1.12).contains(&deviation), "{deviation}");
    }
}

#[test]
fn what_says_no_depth_is_refused() {
    let camera = radtan();
    let ask = |at: &WorldFromCamera, px, views: Vec<_>| triangulate(&camera, at, px, views);
    // Hardly a step, none, turning only, a single view.
    let (at, px, near) = views(&camera, 5.0, 0.0005, 20);
    assert_eq!(ask(&at, px, near), Err(DepthMiss::LittleParallax));
    let (at, px, still) = views(&camera, 5.0, 0.0, 20);
    assert_eq!(ask(&at, px, still), Err(DepthMiss::LittleParallax));
    let (at, px, mut one) = views(&camera, 2.0, 0.05, 20);
    one.drain(..19);
    assert_eq!(ask(&at, px, one), Err(DepthMiss::LittleParallax));
    assert_eq!(ask(&at, px, vec![]), Err(DepthMiss::LittleParallax));
    // The labels move the other way: the rays meet behind the camera.
    let (at, px, there) = views(&camera, 2.0, 0.02, 20);
    let back = there.iter().map(|(now, seen)| {
        let mirrored = Rigid::from_parts(2.0 * at.translation() - now.translation(), now.rotation());
        (mirrored, *seen)
    });
    assert_eq!(ask(&at, px, back.collect()), Err(DepthMiss::RaysApart));
    // A pixel that the lens does not reach.
    let (at, _, there) = views(&camera, 2.0, 0.02, 20);
    let folding = Model::from_name("radtan", &[-0.3, 0.0, 0.0, 0.0]).unwrap();
    let folding = Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], folding).unwrap();
    let outside = triangulate(&folding, &at, Pixel::new(745.0, 470.0), there);
    assert_eq!(outside, Err(DepthMiss::OutsideModel));
}
