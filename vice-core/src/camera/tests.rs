use proptest::prelude::*;

use super::*;

fn lenses() -> Vec<(&'static str, Camera)> {
    let radtan = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05];
    let plumb = [0.12, -0.25, 0.0009, -0.0005, 0.09];
    let rational = [0.35, 0.12, 0.0004, -0.0007, 0.01, 0.62, 0.2, 0.02];
    let fisheye = [0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673];
    let camera =
        |name, k, c: &[f64]| (name, Camera::new(752, 480, k, Model::from_name(name, c).unwrap()).unwrap());
    vec![
        camera("pinhole", [665.1, 665.1, 511.5, 383.5], &[]),
        camera("radtan", [458.654, 457.296, 367.215, 248.375], &radtan),
        camera("plumb_bob", [619.9, 620.11, 320.65, 241.11], &plumb),
        camera("rational", [610.0, 611.5, 322.0, 243.0], &rational),
        camera("equidistant", [190.98, 190.97, 254.93, 256.9], &fisheye),
        camera("ds", [313.21, 313.21, 376.0, 240.0], &[-0.18, 0.59]),
        camera("ds", [150.0, 150.0, 376.0, 240.0], &[-0.6, 0.7]),
        camera("ds", [250.0, 250.0, 376.0, 240.0], &[0.3, 0.4]),
        camera("eucm", [460.0, 460.1, 366.0, 248.0], &[0.63, 1.04]),
        camera("omni", [870.0, 871.0, 370.0, 243.0], &[1.6, -0.2, 0.05, 0.0005, -0.0003]),
        camera("fov", [380.0, 381.0, 370.0, 243.0], &[0.93]),
    ]
}

fn jacobian_is_slope(lens: &impl Distortion, x: f64, y: f64) -> Result<(), TestCaseError> {
    let h = 1e-6;
    let (at, [a, b, c, d]) = lens.distort_with_jacobian(x, y);
    prop_assert_eq!(at, lens.distort(x, y));
    let slope = |p: (f64, f64), m: (f64, f64)| ((p.0 - m.0) / (2.0 * h), (p.1 - m.1) / (2.0 * h));
    let dx = slope(lens.distort(x + h, y), lens.distort(x - h, y));
    let dy = slope(lens.distort(x, y + h), lens.distort(x, y - h));
    for (got, want) in [(a, dx.0), (c, dx.1), (b, dy.0), (d, dy.1)] {
        prop_assert!((got - want).abs() < 1e-7, "{} {}", got, want);
    }
    Ok(())
}

proptest! {
    #[test]
    fn a_pixel_unprojects_to_its_point(x in -0.9..0.9_f64, y in -0.9..0.9_f64, z in 0.05..50.0_f64) {
        for (name, camera) in lenses() {
            let point = Point3::new(x * z, y * z, z);
            if x.hypot(y) > 0.98 * camera.max_radius() {
                continue;
            }
            let px = camera.project(&point).unwrap();
            let ray = camera.unproject(px).unwrap();
            prop_assert!((ray - Vector3::new(x, y, 1.0)).norm() < 1e-9, "{name}: {ray}");
        }
    }

    #[test]
    fn a_point_projects_to_its_pixel(u in 0.0..752.0_f64, v in 0.0..480.0_f64) {
        for (name, camera) in lenses() {
            if let Ok(ray) = camera.unproject(Pixel::new(u, v)) {
                let px = camera.project(&Point3::from(ray * 3.0)).unwrap();
                prop_assert!(px.distance_px(Pixel::new(u, v)) < 1e-7, "{name}: {px:?}");
            }
        }
    }

    #[test]
    fn the_jacobian_is_the_slope(x in -0.8..0.8_f64, y in -0.8..0.8_f64) {
        for (_, camera) in lenses() {
            match camera.model {
                Model::Pinhole => jacobian_is_slope(&Pinhole, x, y)?,
                Model::Radtan(m) => jacobian_is_slope(&m, x, y)?,
                Model::Rational(m) => jacobian_is_slope(&m, x, y)?,
                Model::Equidistant(m) => jacobian_is_slope(&m, x, y)?,
                Model::DoubleSphere(m) => jacobian_is_slope(&m, x, y)?,
                Model::ExtendedUnified(m) => jacobian_is_slope(&m, x, y)?,
                Model::Omnidirectional(m) => jacobian_is_slope(&m, x, y)?,
                Model::FieldOfView(m) => jacobian_is_slope(&m, x, y)?,
            }
        }
    }
}

#[test]
fn points_behind_or_beyond_the_fold_do_not_project() {
    // r (1 - 0.3 r²) grows up to r = 1/sqrt(0.9).
    let model = Model::from_name("radtan", &[-0.3, 0.0, 0.0, 0.0]).unwrap();
    let camera = Camera::new(640, 480, [400.0, 400.0, 320.0, 240.0], model).unwrap();
    let rim = (1.0_f64 / 0.9).sqrt();
    assert!((camera.max_radius() - rim).abs() < 1e-12);
    assert_eq!(camera.project(&Point3::new(1.0, 0.0, 0.0)), Err(ProjectError::BehindCamera));
    assert_eq!(camera.project(&Point3::new(1.0, 0.0, -1.0)), Err(ProjectError::BehindCamera));
    assert_eq!(camera.project(&Point3::new(f64::NAN, 0.0, 1.0)), Err(ProjectError::BehindCamera));
    assert_eq!(camera.project(&Point3::new(0.0, 0.0, f64::NAN)), Err(ProjectError::BehindCamera));
    assert_eq!(camera.project(&Point3::new(rim * 1.001, 0.0, 1.0)), Err(ProjectError::OutsideModel));
    assert!(camera.project(&Point3::new(rim * 0.999, 0.0, 1.0)).is_ok());
    // The largest distorted radius is 2/3 of the rim: no ray reaches beyond.
    let edge = rim * 2.0 / 3.0;
    assert!(camera.unproject(Pixel::new(320.0 + 400.0 * (edge + 1e-3), 240.0)).is_err());
    let ray = camera.unproject(Pixel::new(320.0 + 400.0 * (edge - 1e-3), 240.0)).unwrap();
    assert!(ray.x < rim);
    assert!(camera.unproject(Pixel::new(f64::NAN, 0.0)).is_err());
}

#[test]
fn a_rational_pole_bounds_the_radius() {
    let model = Model::from_name("rational", &[0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0]).unwrap();
    let camera = Camera::new(640, 480, [400.0, 400.0, 320.0, 240.0], model).unwrap();
    assert!(camera.max_radius() < 2.0_f64.sqrt() && camera.max_radius() > 1.41);
}

#[test]
fn bad_calibrations_are_named() {
    let k = [400.0, 400.0, 320.0, 240.0];
    assert!(matches!(Camera::new(0, 480, k, Model::Pinhole), Err(CameraError::EmptyImage { .. })));
    let negative = Camera::new(640, 480, [400.0, -1.0, 0.0, 0.0], Model::Pinhole);
    assert_eq!(negative.unwrap_err().to_string(), "focal length fy = -1 is not positive");
    assert!(matches!(Model::from_name("fishbowl", &[]), Err(CameraError::UnknownModel(_))));
    assert!(matches!(Model::from_name("radtan", &[1.0]), Err(CameraError::CoefficientCount { .. })));
    assert!(matches!(Model::from_name("radtan", &[f64::NAN; 4]), Err(CameraError::NotFinite(_))));
}

#[test]
fn vectors_that_drivers_fill_with_zeros_are_those_of_the_model() {
    let own = [-0.28, 0.07, 2e-4, 2e-5, 0.01];
    let radtan = Model::from_name("radtan", &own).unwrap();
    for padding in [1, 3, 7, 9] {
        let padded: Vec<f64> = own.iter().copied().chain(std::iter::repeat_n(0.0, padding)).collect();
        assert_eq!(Model::from_name("plumb_bob", &padded).unwrap(), radtan, "{padding}");
    }
    let eight = [0.1, 0.2, 1e-3, 2e-3, 0.3, 0.4, 0.5, 0.6];
    let rational = Model::from_name("rational", &eight).unwrap();
    for length in [12, 14] {
        let mut padded = eight.to_vec();
        padded.resize(length, 0.0);
        assert_eq!(Model::from_name("rational_polynomial", &padded).unwrap(), rational);
        padded[length - 1] = 0.05;
        let error = Model::from_name("rational_polynomial", &padded).unwrap_err().to_string();
        assert!(error.contains("rational_polynomial") && error.contains("not zero"), "{error}");
    }
    let four = [0.1, 0.2, 0.3, 0.4];
    let mut padded = four.to_vec();
    padded.push(0.0);
    assert_eq!(Model::from_name("equidistant", &padded), Model::from_name("fisheye", &four));
    let error = Model::from_name("plumb_bob", &[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.05]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "model plumb_bob takes 4 or 5 distortion coefficients, got 8, of which those beyond are not zero"
    );
}

#[test]
fn parameters_outside_their_range_are_named() {
    for (name, coefficients, expected) in [
        ("ds", &[-1.0, 0.5] as &[f64], "xi = -1 of model ds is not above -1"),
        ("ds", &[0.1, 1.2], "alpha = 1.2 of model ds is not from 0 to 1"),
        ("eucm", &[0.5, 0.0], "beta = 0 of model eucm is not above 0"),
        ("eucm", &[-0.1, 1.0], "alpha = -0.1 of model eucm is not from 0 to 1"),
        ("omni", &[-2.0, 0.0, 0.0, 0.0, 0.0], "xi = -2 of model omni is not above -1"),
        ("fov", &[0.0], "w = 0 of model fov is not an angle above 0 and below pi radians"),
        ("fov", &[3.2], "w = 3.2 of model fov"),
        (
            "omni",
            &[1.0, 0.1],
            "model omni takes 1 or 5 (xi, then k1, k2, p1, p2) distortion coefficients, got 2",
        ),
        ("ds", &[0.1], "model ds takes 2 (xi, alpha) distortion coefficients, got 1"),
    ] {
        let error = Model::from_name(name, coefficients).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    let lens = Model::ExtendedUnified(ExtendedUnified { alpha: 2.0, beta: 1.0 });
    assert!(Camera::new(640, 480, [400.0, 400.0, 320.0, 240.0], lens).is_err());
}

#[test]
fn what_a_wide_lens_sees_behind_its_plane_has_no_ray() {
    // 110 degrees off the axis are inside the image of each of these lenses.
    for (name, coefficients, radius_at_90) in [
        ("ds", &[-0.2, 0.6] as &[f64], 1.0 / (0.6 * (1.0_f64 + 0.04).sqrt() - 0.4 * 0.2)),
        ("eucm", &[0.6, 1.1], 1.0 / (0.6 * 1.1_f64.sqrt())),
        ("omni", &[1.2, 0.0, 0.0, 0.0, 0.0], 1.0 / 1.2),
        ("fov", &[1.0], std::f64::consts::FRAC_PI_2),
    ] {
        let lens = Model::from_name(name, coefficients).unwrap();
        let camera = Camera::new(1000, 1000, [200.0, 200.0, 500.0, 500.0], lens).unwrap();
        assert_eq!(camera.project(&Point3::new(1.0, 0.0, -0.1)), Err(ProjectError::BehindCamera));
        let at = |radius: f64| camera.unproject(Pixel::new(500.0 + 200.0 * radius, 500.0));
        assert!(at(radius_at_90 * 0.999).unwrap().x > 100.0, "{name}");
        assert_eq!(at(radius_at_90 * 1.001), Err(UnprojectError::OutsideModel), "{name}");
    }
}

#[test]
fn a_double_sphere_ends_where_its_image_no_longer_grows() {
    for (xi, alpha) in [(-0.6, 0.7), (-0.5, 0.2), (-0.3, 0.9), (-0.9, 0.0)] {
        let lens = DoubleSphere { xi, alpha };
        let rim = lens.max_radius();
        assert!(rim.is_finite(), "{xi} {alpha}");
        let grows = |r: f64| lens.radial(r * (1.0 + 1e-6)) > lens.radial(r) && lens.radial(r) > 0.0;
        assert!((1..1000).all(|i| grows(rim * f64::from(i) * 0.999e-3)), "{xi} {alpha}");
        assert!(!grows(rim * 1.01), "{xi} {alpha}: {rim}");
    }
}
