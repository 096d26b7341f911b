use std::collections::BTreeMap;

use nalgebra::Point3;
use proptest::prelude::*;

use super::*;
use crate::cloud::CloudOptions;
use crate::scene::{Random, Scene, camera, grid, look};

fn zmap(points: impl IntoIterator<Item = Point3<f32>>, options: ZMapOptions) -> ZMapDepth {
    let cloud = Cloud::from_points(points, &CloudOptions::default()).unwrap();
    ZMapDepth::new(Arc::new(cloud), Rigid::identity(), options)
}

fn with(occlusion: bool) -> ZMapOptions {
    ZMapOptions { occlusion, ..ZMapOptions::default() }
}

/// Views into the room: from high and low, along the floor, and close to an edge.
const VIEWS: [([f64; 3], [f64; 3]); 4] = [
    ([-2.0, -1.0, 1.6], [1.0, -0.3, 0.6]),
    ([-1.0, 0.0, 0.5], [1.0, 0.1, 0.4]),
    ([-2.5, 2.0, 2.5], [1.0, -0.5, 0.3]),
    ([0.3, 0.3, 1.0], [2.4, -1.8, 0.9]),
];

/// Part of all pixels that are answered, and part of those that are within 2 cm.
fn shares(zmap: &ZMapDepth, scene: &Scene) -> (f64, f64) {
    let camera = camera();
    let pixels = grid(&camera, 3);
    let (mut answered, mut good) = (0, 0);
    for (from, to) in VIEWS {
        let keyframe = look(&camera, from, to);
        for (px, depth) in pixels.iter().zip(zmap.depths(&keyframe, &pixels).unwrap()) {
            let Ok(depth) = depth else { continue };
            answered += 1;
            good += usize::from((depth.z_m - scene.depth(&keyframe, *px)).abs() < 0.02);
        }
    }
    (answered as f64 / (VIEWS.len() * pixels.len()) as f64, good as f64 / answered as f64)
}

#[test]
fn hidden_points_do_not_leak_through() {
    let scene = Scene::room();
    let scan = scene.scan(10_000.0);
    let (answered, good) = shares(&zmap(scan.iter().copied(), with(true)), &scene);
    assert!(answered > 0.9 && good > 0.99, "{answered} answered, {good} of them within 2 cm");
    let (answered, good) = shares(&zmap(scan, with(false)), &scene);
    assert!(
        answered > 0.99 && good < 0.8,
        "without the test: {answered} answered, {good} of them within 2 cm"
    );
}

#[test]
fn a_sparse_surface_hides_a_dense_one() {
    // A screen 1 m away with a point every 3 cm before a wall at 3 m with a point every 5 mm.
    let mut random = Random(1);
    let mut patch = |n: usize, half: f64, z: f64| -> Vec<Point3<f32>> {
        (0..n)
            .map(|_| {
                Point3::new((2.0 * random.next() - 1.0) * half, (2.0 * random.next() - 1.0) * half, z).cast()
            })
            .collect()
    };
    let mut points = patch(1100, 0.5, 1.0);
    points.extend(patch(640_000, 2.0, 3.0));
    let zmap = zmap(points, with(true));
    let camera = camera();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let pixels: Vec<Pixel> = grid(&camera, 4)
        .into_iter()
        .filter(|px| camera.unproject(*px).is_ok_and(|r| r.x.abs() < 0.42 && r.y.abs() < 0.42))
        .collect();
    let mut found = BTreeMap::new();
    for depth in zmap.depths(&keyframe, &pixels).unwrap() {
        let kind = depth.map(|d| if (d.z_m - 1.0).abs() < 1e-6 { "screen" } else { "through" });
        *found.entry(kind).or_insert(0) += 1;
    }
    let screen = found[&Ok("screen")];
    assert!(screen * 100 > pixels.len() * 97, "{found:?}");
    assert!(!found.contains_key(&Ok("through")), "{found:?}");
}

#[test]
fn stray_points_before_the_lens_hide_nothing() {
    // A wall at 2 m with a point every centimetre, and a dozen strays at 16 cm, 3 cm apart.
    let mut random = Random(9);
    let wall: Vec<Point3<f32>> = (0..160_000)
        .map(|_| Point3::new(random.next() * 4.0 - 2.0, random.next() * 4.0 - 2.0, 2.0).cast())
        .collect();
    let strays = (0..12).map(|i| Point3::new((i % 4) as f32 * 0.03, (i / 4) as f32 * 0.03, 0.16));
    let camera = camera();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let pixels = grid(&camera, 3);
    let answered = |points: Vec<Point3<f32>>| {
        let depths = zmap(points, with(true)).depths(&keyframe, &pixels).unwrap();
        depths.iter().flatten().filter(|d| (d.z_m - 2.0).abs() < 1e-6).count()
    };
    let without = answered(wall.clone());
    let among = answered(wall.into_iter().chain(strays).collect());
    assert!(without * 10 > pixels.len() * 8 && among * 1000 > without * 995, "{among} of {without}");
}

#[test]
fn natural_neighbours_reproduce_a_plane_and_stay_on_one_surface() {
    // A slanted plane in pixels; and a screen before a wall, whose edge the triangles refuse.
    let mut random = Random(6);
    let natural = |occlusion| ZMapOptions { interpolation: Interpolation::Natural, ..with(occlusion) };
    let camera =
        Camera::new(640, 480, [500.0, 500.0, 320.0, 240.0], vice_core::camera::Model::Pinhole).unwrap();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let z_of = |u: f64, v: f64| 2.0 + 1e-3 * (u - 320.0) - 5e-4 * (v - 240.0);
    let points: Vec<Point3<f32>> = (0..20_000)
        .map(|_| (random.next() * 640.0, random.next() * 480.0))
        .map(|(u, v)| Point3::new((u - 320.0) / 500.0, (v - 240.0) / 500.0, 1.0) * z_of(u, v))
        .map(|p| p.cast())
        .collect();
    let pixels = grid(&camera, 11);
    for (px, depth) in pixels.iter().zip(zmap(points, natural(false)).depths(&keyframe, &pixels).unwrap()) {
        if let Ok(depth) = depth {
            assert!((depth.z_m - z_of(px.u, px.v)).abs() < 2e-6, "{px:?}: {depth:?}");
        }
    }
    let scene = Scene::room();
    let scan = scene.scan(10_000.0);
    let (linear, by_triangle) = shares(&zmap(scan.iter().copied(), with(true)), &scene);
    let (answered, good) = shares(&zmap(scan, natural(true)), &scene);
    assert_eq!(answered, linear);
    assert!(
        good > by_triangle - 0.001,
        "{good} of the natural ones within 2 cm, {by_triangle} of the linear ones"
    );
}

#[test]
fn a_plane_is_reproduced_and_a_miss_says_why() {
    // A wall at z = 2 with a hole, in a square that leaves the image's corners out.
    let mut random = Random(5);
    let points: Vec<Point3<f32>> = (0..40_000)
        .map(|_| Point3::new(random.next() * 2.0 - 1.0, random.next() * 2.0 - 1.0, 2.0).cast())
        .filter(|p: &Point3<f32>| p.x.abs() > 0.3 || p.y.abs() > 0.3)
        .collect();
    let camera = camera();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    for occlusion in [true, false] {
        let zmap = zmap(points.iter().copied(), with(occlusion));
        let ask = |u, v| zmap.depths(&keyframe, &[Pixel::new(u, v)]).unwrap()[0].map(|d| d.z_m);
        assert_eq!(ask(367.0 + 150.0, 248.0), Ok(2.0));
        assert_eq!(ask(367.0, 248.0), Err(DepthMiss::TriangleTooWide));
        assert_eq!(ask(1.0, 1.0), Err(DepthMiss::OutsideHull));
        assert_eq!(ask(-0.6, 1.0), Err(DepthMiss::OutsideImage));
        assert_eq!(ask(f64::NAN, 1.0), Err(DepthMiss::OutsideImage));
        let behind = look(&camera, [0.0; 3], [0.0, 0.1, -1.0]);
        let pixels = grid(&camera, 40);
        let none = zmap.depths(&behind, &pixels).unwrap();
        assert!(none.iter().all(|d| *d == Err(DepthMiss::EmptyView)), "{none:?}");
        let lost = Keyframe { world_from_camera: None, ..keyframe };
        assert_eq!(zmap.depths(&lost, &pixels[..1]).unwrap(), [Err(DepthMiss::NoAnchor)]);
    }
}

#[test]
fn a_triangle_from_one_surface_to_another_is_flagged_and_a_slanted_one_is_not() {
    // A screen 1 m away before a wall at 3 m, each with a point every 2 cm: without the test triangles lead from one to
    // the other.
    let plane = |half: i32, z: f32| -> Vec<Point3<f32>> {
        let at = move |i: i32| 0.02 * i as f32;
        (-half..=half)
            .flat_map(|i| (-half..=half).map(move |j| Point3::new(at(i) + 0.003, at(j) - 0.002, z)))
            .collect()
    };
    let mut points = plane(10, 1.0);
    points.extend(plane(100, 3.0));
    let camera = camera();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let pixels = grid(&camera, 3);
    let depths = zmap(points, with(false)).depths(&keyframe, &pixels).unwrap();
    let (mut between, mut flagged) = (0, 0);
    for depth in depths.iter().flatten() {
        let is_between = depth.z_m > 1.05 && depth.z_m < 2.95;
        between += usize::from(is_between);
        flagged += usize::from(is_between && depth.on_edge);
    }
    assert!(between > 100 && flagged * 10 > between * 9, "{flagged} of {between} between the surfaces");
    // A floor at a slant, seen to 8 m, where each triangle spans more than a twentieth of depth.
    let floor: Vec<Point3<f32>> = (0..40)
        .flat_map(|i| (0..40).map(move |j| Point3::new(0.3 * i as f32 - 6.0, 1.0, 0.5 + 0.3 * j as f32)))
        .collect();
    let depths =
        zmap(floor, ZMapOptions { max_triangle: 1.0, ..with(false) }).depths(&keyframe, &pixels).unwrap();
    let seen: Vec<_> = depths.iter().flatten().filter(|d| d.z_m < 8.0).collect();
    assert!(seen.len() > 1000);
    assert!(seen.iter().all(|d| !d.on_edge), "{}", seen.iter().filter(|d| d.on_edge).count());
}

#[test]
fn points_on_one_line_or_at_one_place_span_nothing() {
    let camera = camera();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let line = (0..100).map(|i| Point3::new(i as f32 * 0.001, 0.0, 1.0));
    let place = std::iter::repeat_n(Point3::new(0.0, 0.0, 1.0), 100);
    for zmap in [zmap(line, with(true)), zmap(place, with(false))] {
        let depths = zmap.depths(&keyframe, &[Pixel::new(380.0, 260.0), Pixel::new(100.0, 100.0)]).unwrap();
        assert_eq!(depths, [Err(DepthMiss::OutsideHull); 2]);
    }
}

#[test]
fn a_regular_grid_is_triangulated_one_way() {
    // Every cell of a grid that is level with the image has its corners on a circle.
    let points: Vec<Point3<f32>> = (0..10_000)
        .map(|i| Point3::new((i % 100) as f32 - 50.0, (i / 100) as f32 - 50.0, 0.0) / 100.0)
        .map(|p| Point3::new(p.x, p.y, 1.0 + (p.x * 37.0).sin() * 0.01))
        .collect();
    let camera =
        Camera::new(640, 480, [500.0, 500.0, 320.0, 240.0], vice_core::camera::Model::Pinhole).unwrap();
    let mut keyframe = look(&camera, [0.0; 3], [0.0, 0.0, 1.0]);
    keyframe.world_from_camera = Some(Rigid::identity());
    let forward = zmap(points.iter().copied(), with(false));
    let backward = zmap(points.iter().rev().copied(), with(false));
    let pixels = grid(&camera, 7);
    let whole = forward.depths(&keyframe, &pixels).unwrap();
    assert_eq!(backward.depths(&keyframe, &pixels).unwrap(), whole);
    for (px, expected) in pixels.iter().zip(whole).step_by(23) {
        assert_eq!(forward.depths(&keyframe, &[*px]).unwrap(), [expected]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_neighbourhood_answers_as_the_whole_image_does(
        from in prop::array::uniform3(0.0..1.0_f64),
        to in prop::array::uniform3(0.0..1.0_f64),
        per_m2 in 100.0..3000.0_f64,
        occlusion in any::<bool>(),
        natural in any::<bool>(),
        seed in any::<u64>(),
    ) {
        let scene = Scene::room();
        let place = |t: [f64; 3]| [t[0] * 5.0 - 2.5, t[1] * 4.0 - 2.0, t[2] * 2.4 + 0.3];
        let (from, to) = (place(from), place(to));
        prop_assume!((0..3).map(|i| (from[i] - to[i]).powi(2)).sum::<f64>() > 0.25);
        prop_assume!((from[0] - to[0]).hypot(from[1] - to[1]) > 0.1);
        let camera = camera();
        let keyframe = look(&camera, from, to);
        let interpolation = if natural { Interpolation::Natural } else { Interpolation::Linear };
        let zmap = zmap(scene.scan(per_m2), ZMapOptions { interpolation, ..with(occlusion) });
        let mut random = Random(seed);
        let pixels: Vec<Pixel> =
            (0..4 * MOST_WINDOWS).map(|_| Pixel::new(random.next() * 751.0, random.next() * 479.0)).collect();
        let whole = zmap.depths(&keyframe, &pixels).unwrap();
        for some in pixels.chunks(MOST_WINDOWS).zip(whole.chunks(MOST_WINDOWS)) {
            let near = zmap.depths(&keyframe, some.0).unwrap();
            if !natural {
                prop_assert_eq!(near, some.1);
                continue;
            }
            // Shares of natural neighbours round by where their sum begins.
            for (near, far) in near.iter().zip(some.1) {
                let same = match (near, far) {
                    (Ok(a), Ok(b)) => a.on_edge == b.on_edge && (a.z_m - b.z_m).abs() < 1e-9 * b.z_m,
                    (a, b) => a == b,
                };
                prop_assert!(same, "{near:?} {far:?}");
            }
        }
    }
}
