use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use crate::camera::{Camera, Distortion, Model, Pixel, solve};
use crate::frames::{self, Rigid, World};

/// All models, and lenses that fold back inside the image.
pub(crate) fn lenses() -> Vec<(&'static str, Camera)> {
    let lenses: [(&str, [f64; 4], &[f64]); 17] = [
        ("pinhole", [665.1, 665.1, 511.5, 383.5], &[]),
        (
            "radtan",
            [458.654, 457.296, 367.215, 248.375],
            &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05],
        ),
        ("plumb_bob", [619.9, 620.11, 320.65, 241.11], &[0.12, -0.25, 0.0009, -0.0005, 0.09]),
        ("radtan", [300.0, 300.0, 370.0, 250.0], &[-0.3, 0.0, 0.001, -0.002]),
        ("rational", [610.0, 611.5, 322.0, 243.0], &[0.35, 0.12, 0.0004, -0.0007, 0.01, 0.62, 0.2, 0.02]),
        ("rational", [400.0, 400.0, 320.0, 240.0], &[0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0]),
        (
            "equidistant",
            [190.98, 190.97, 254.93, 256.9],
            &[0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673],
        ),
        ("equidistant", [250.0, 250.0, 376.0, 240.0], &[-0.1, 0.0, 0.0, 0.0]),
        // Two of the calibrations in the paper of the double sphere, one that folds back and one that has a pole.
        ("ds", [313.21, 313.21, 376.0, 240.0], &[-0.18, 0.59]),
        ("ds", [158.0, 158.1, 370.0, 245.0], &[-0.27, 0.57]),
        ("ds", [150.0, 150.0, 376.0, 240.0], &[-0.6, 0.7]),
        ("ds", [150.0, 150.0, 376.0, 240.0], &[-0.5, 0.2]),
        ("eucm", [460.0, 460.1, 366.0, 248.0], &[0.63, 1.04]),
        ("eucm", [220.0, 220.1, 366.0, 248.0], &[0.4, 1.2]),
        ("omni", [870.0, 871.0, 370.0, 243.0], &[1.6, -0.2, 0.05, 0.0005, -0.0003]),
        ("omni", [600.0, 600.0, 370.0, 243.0], &[0.9, -0.5, 0.0, 0.0, 0.0]),
        ("fov", [380.0, 381.0, 370.0, 243.0], &[0.93]),
    ];
    let camera = |(name, k, c)| (name, Camera::new(752, 480, k, Model::from_name(name, c).unwrap()).unwrap());
    lenses.map(camera).into()
}

/// Numbers as they come, and those at which something changes.
fn any_number(limit: f64) -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => -limit..limit,
        1 => prop::sample::select(vec![0.0, -0.0, 1e-300, 1e300, f64::NAN, f64::INFINITY, -f64::INFINITY, 1e-13]),
    ]
}

fn any_motion() -> impl Strategy<Value = Rigid<frames::Camera, World>> {
    prop::array::uniform6(-1.0..1.0_f64).prop_map(|n| {
        let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(n[3], n[4], n[5]));
        Rigid::from_parts(Vector3::new(n[0], n[1], n[2]), rotation)
    })
}

proptest! {
    #[test]
    fn projections_are_those_of_single_points(
        xyz in prop::collection::vec([any_number(3.0), any_number(3.0), any_number(3.0)], 0..50), motion in any_motion(),
    ) {
        let axis = |k: usize| xyz.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let (x, y, z) = (axis(0), axis(1), axis(2));
        let n = x.len();
        for (name, camera) in lenses() {
            for moved in [false, true] {
                let (mut u, mut v, mut valid) = (vec![0.0; n], vec![0.0; n], vec![false; n]);
                let count = match moved {
                    false => camera.project_batch([&x, &y, &z], [&mut u, &mut v], &mut valid),
                    true => camera.project_from_batch(&motion, [&x, &y, &z], [&mut u, &mut v], &mut valid),
                };
                prop_assert_eq!(count, valid.iter().filter(|ok| **ok).count());
                for i in 0..n {
                    let point = Point3::from(xyz[i]);
                    let single = camera.project(&if moved { motion.transform_point(&point) } else { point });
                    prop_assert_eq!(valid[i], single.is_ok(), "{} {:?}", name, point);
                    match single {
                        // Where a lens overflows, its pixel is no number, which equals nothing.
                        Ok(px) if px.u.is_finite() && px.v.is_finite() => {
                            prop_assert!((u[i], v[i]) == (px.u, px.v), "{name} {point:?}: {} {}", u[i], v[i]);
                        }
                        Ok(_) => prop_assert!(!(u[i].is_finite() && v[i].is_finite())),
                        Err(_) => prop_assert!(u[i].is_nan() && v[i].is_nan()),
                    }
                }
            }
        }
    }

    #[test]
    fn rays_are_those_of_single_pixels(uv in prop::collection::vec([any_number(900.0), any_number(900.0)], 0..50)) {
        let (u, v): (Vec<f64>, Vec<f64>) = uv.iter().map(|p| (p[0], p[1])).unzip();
        let n = u.len();
        for (name, camera) in lenses() {
            let (mut x, mut y, mut valid) = (vec![0.0; n], vec![0.0; n], vec![true; n]);
            let count = camera.unproject_batch([&u, &v], [&mut x, &mut y], &mut valid);
            prop_assert_eq!(count, valid.iter().filter(|ok| **ok).count());
            for i in 0..n {
                let single = camera.unproject(Pixel::new(u[i], v[i]));
                prop_assert_eq!(valid[i], single.is_ok(), "{} {:?}", name, uv[i]);
                match single {
                    Ok(ray) => {
                        prop_assert!((x[i], y[i]) == (ray.x, ray.y), "{name} {:?}: {} {}", uv[i], x[i], y[i]);
                    }
                    Err(_) => prop_assert!(x[i].is_nan() && y[i].is_nan()),
                }
            }
        }
    }

    #[test]
    fn moved_points_are_those_of_single_points(
        xyz in prop::collection::vec([any_number(30.0), any_number(30.0), any_number(30.0)], 0..40), motion in any_motion(),
    ) {
        let axis = |k: usize| xyz.iter().map(|p| p[k]).collect::<Vec<f64>>();
        let (mut x, mut y, mut z) = (axis(0), axis(1), axis(2));
        motion.transform_batch([&mut x, &mut y, &mut z]);
        for (i, p) in xyz.iter().enumerate() {
            let single = motion.transform_point(&Point3::from(*p));
            for (got, want) in [x[i], y[i], z[i]].into_iter().zip(single.iter()) {
                prop_assert!(got == *want || got.is_nan() && want.is_nan(), "{got} {want}");
            }
        }
    }

    #[test]
    fn floats_are_rounded_once(uv in prop::collection::vec([0.0..752.0_f32, 0.0..480.0_f32], 1..40), z in 0.5..9.0_f32) {
        let (u, v): (Vec<f32>, Vec<f32>) = uv.iter().map(|p| (p[0], p[1])).unzip();
        let n = u.len();
        for (name, camera) in lenses() {
            let (mut x, mut y, mut valid) = (vec![0.0_f32; n], vec![0.0_f32; n], vec![false; n]);
            camera.unproject_batch([&u, &v], [&mut x, &mut y], &mut valid);
            for i in 0..n {
                let single = camera.unproject(Pixel::new(f64::from(u[i]), f64::from(v[i])));
                prop_assert_eq!(valid[i], single.is_ok());
                if let Ok(ray) = single {
                    let near = |got: f32, want: f64| (f64::from(got) - want).abs() <= 6e-8 * want.abs();
                    prop_assert!(near(x[i], ray.x) && near(y[i], ray.y), "{name}");
                }
            }
            let depth = vec![z; n];
            let (mut pu, mut pv) = (vec![0.0_f32; n], vec![0.0_f32; n]);
            camera.project_batch([&x, &y, &depth], [&mut pu, &mut pv], &mut valid);
            for i in 0..n {
                let point = Point3::new(f64::from(x[i]), f64::from(y[i]), f64::from(z));
                let single = camera.project(&point);
                prop_assert_eq!(valid[i], single.is_ok());
                if let Ok(px) = single {
                    let near = |got: f32, want: f64| (f64::from(got) - want).abs() <= 6e-8 * (want.abs() + 1e-3);
                    prop_assert!(near(pu[i], px.u) && near(pv[i], px.v), "{name}");
                }
            }
        }
    }
}

#[test]
fn pixels_all_over_and_beyond_the_image_are_decided_alike() {
    // A grid that crosses the rims of the folding lenses closely.
    let axis = |i: usize| -300.0 + 0.9173 * i as f64;
    for (name, camera) in lenses() {
        let (u, v): (Vec<f64>, Vec<f64>) =
            (0..1500).step_by(7).flat_map(|i| (0..1200).step_by(5).map(move |j| (axis(i), axis(j)))).unzip();
        let n = u.len();
        let (mut x, mut y, mut valid) = (vec![0.0; n], vec![0.0; n], vec![true; n]);
        camera.unproject_batch([&u, &v], [&mut x, &mut y], &mut valid);
        for i in 0..n {
            let single = camera.unproject(Pixel::new(u[i], v[i])).ok();
            assert_eq!(valid[i], single.is_some(), "{name} {} {}", u[i], v[i]);
            if let Some(ray) = single {
                assert_eq!((x[i], y[i]), (ray.x, ray.y), "{name} {} {}", u[i], v[i]);
            }
        }
    }
}

/// The share of an image's pixels that a fixed number of steps decides, and the largest residual there, in normalised
/// coordinates.
fn quick_share<D: Distortion>(camera: &Camera, lens: &D) -> (f64, f64) {
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let (mut quick, mut all, mut worst) = (0.0, 0.0, 0.0_f64);
    for column in 0..=188 {
        for row in 0..=120 {
            let (u, v) = (4.0 * f64::from(column) - 0.5, 4.0 * f64::from(row) - 0.5);
            let (xd, yd) = ((u - cx) / fx, (v - cy) / fy);
            let (x, y, found) =
                lens.undistort_fast(&camera.seed, solve::quick_radius(camera.max_radius()), (xd, yd));
            all += 1.0;
            if found {
                quick += 1.0;
                let (back_x, back_y) = lens.distort(x, y);
                worst = worst.max((back_x - xd).abs()).max((back_y - yd).abs());
            }
        }
    }
    (quick / all, worst)
}

#[test]
fn a_fixed_number_of_steps_is_enough_all_over_the_image() {
    for (name, camera) in lenses() {
        let (quick, worst) = match camera.model() {
            Model::Pinhole => continue,
            Model::Radtan(lens) => quick_share(&camera, lens),
            Model::Rational(lens) => quick_share(&camera, lens),
            Model::Equidistant(lens) => quick_share(&camera, lens),
            Model::DoubleSphere(lens) => quick_share(&camera, lens),
            Model::ExtendedUnified(lens) => quick_share(&camera, lens),
            Model::Omnidirectional(lens) => quick_share(&camera, lens),
            Model::FieldOfView(lens) => quick_share(&camera, lens),
        };
        let reach = camera.seed.max_rd2.sqrt();
        println!("{name}: {:.1} % of the pixels, residual {worst:.1e}, seed up to {reach:.2}", 100.0 * quick);
        assert!(worst < 4e-15, "{name}: {worst}");
        // Where a lens folds back inside the image, or an angle is beyond 90 degrees, there is nothing to be found in its
        // corners.
        let has_corners = [0.0, 751.0]
            .iter()
            .all(|u| [0.0, 479.0].iter().all(|v| camera.unproject(Pixel::new(*u, *v)).is_ok()));
        assert!(quick > 0.99 || !has_corners, "{name}: {quick}");
        assert!(quick > 0.25, "{name}: {quick}");
    }
}
