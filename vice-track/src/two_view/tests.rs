use super::*;
use nalgebra::{Rotation3, Vector3};

const FOCAL_PX: f64 = 450.0;

/// How far away each of many points is, by its place in the image.
type Scene = fn(f64, f64, &mut SplitMix) -> f64;

fn room(_: f64, _: f64, random: &mut SplitMix) -> f64 {
    random.uniform(1.0, 8.0)
}

fn wall(x: f64, y: f64, _: &mut SplitMix) -> f64 {
    3.0 / (1.0 + 0.3 * x - 0.2 * y)
}

fn sight(point: &Vector3<f64>) -> Sight {
    let ray = point.normalize();
    Sight { ray, px_per_rad: FOCAL_PX / ray.z }
}

/// Points of a scene in two frames with 0.2 px of noise; the first `wrong` of them `by_px` off in any direction.
fn pairs(
    scene: Scene,
    motion: (Vector3<f64>, Vector3<f64>),
    count: usize,
    wrong: usize,
    by_px: f64,
    seed: u64,
) -> Vec<Pair> {
    let mut random = SplitMix::new(seed);
    let turn = Rotation3::new(motion.0);
    (0..count)
        .map(|i| {
            let (x, y) = (random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5));
            let there = turn * (Vector3::new(x, y, 1.0) * scene(x, y, &mut random)) + motion.1;
            let angle = random.uniform(0.0, std::f64::consts::TAU);
            let off = if i < wrong { by_px } else { 0.0 };
            let noise = |random: &mut SplitMix| 0.2 * random.normal();
            let (du, dv) = (off * angle.cos() + noise(&mut random), off * angle.sin() + noise(&mut random));
            let seen = there / there.z + Vector3::new(du, dv, 0.0) / FOCAL_PX;
            Pair { from: sight(&Vector3::new(x, y, 1.0)), to: sight(&seen) }
        })
        .collect()
}

/// Share of the right ones that are taken for wrong, and of the wrong ones that are found.
fn judged(found: &Agreement, wrong: usize) -> [f64; 2] {
    let share =
        |offs: &[f64]| offs.iter().filter(|o| **o > found.limit_px).count() as f64 / offs.len().max(1) as f64;
    [share(&found.off_px[wrong..]), share(&found.off_px[..wrong])]
}

#[test]
fn points_that_do_not_follow_are_found_whatever_moves() {
    let motions = [
        (Vector3::new(0.02, -0.05, 0.03), Vector3::new(0.2, 0.05, -0.1)),
        (Vector3::new(0.0, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.3)),
        (Vector3::new(-0.1, 0.08, 0.3), Vector3::new(-0.3, 0.2, 0.1)),
    ];
    for (k, motion) in motions.into_iter().enumerate() {
        for (name, scene) in [("room", room as Scene), ("wall", wall as Scene)] {
            for seed in 0..5 {
                let of = pairs(scene, motion, 60, 18, 15.0, seed + 10 * k as u64);
                let found = agreement(&of, 7).unwrap();
                let [blamed, caught] = judged(&found, 18);
                // A point that is off along its epipolar line cannot be told: 15 px within 1 px of it are one in twelve.
                assert!(blamed <= 0.05 && caught >= 0.7, "{name} {k} {seed}: {blamed} {caught} {found:?}");
                assert_eq!(found.moved, if name == "wall" { Moved::Plane } else { Moved::General });
                assert_eq!(agreement(&of, 7), Some(found));
            }
        }
    }
}

#[test]
fn a_camera_that_only_turns_has_no_epipolar_lines_and_needs_none() {
    let motion = (Vector3::new(0.05, -0.08, 0.02), Vector3::zeros());
    for seed in 0..5 {
        let found = agreement(&pairs(room, motion, 40, 3, 4.0, seed), 7).unwrap();
        assert_eq!(found.moved, Moved::Turn);
        // All directions are seen.
        assert_eq!(judged(&found, 3), [0.0, 1.0], "{found:?}");
        // A third of them wrong.
        let found = agreement(&pairs(room, motion, 40, 13, 9.0, seed), 7).unwrap();
        let [blamed, caught] = judged(&found, 13);
        assert!(blamed <= 0.05 && caught > 0.6, "{found:?}");
    }
    // And one that stands still.
    let found = agreement(&pairs(wall, (Vector3::zeros(), Vector3::zeros()), 40, 2, 4.0, 3), 7).unwrap();
    assert_eq!((found.moved, judged(&found, 2)), (Moved::Turn, [0.0, 1.0]));
}

#[test]
fn few_points_outvote_nobody() {
    let motion = (Vector3::new(0.02, -0.05, 0.03), Vector3::new(0.2, 0.05, -0.1));
    assert_eq!(agreement(&pairs(room, motion, MIN_POINTS - 1, 0, 0.0, 1), 7), None);
    let found = agreement(&pairs(room, motion, MIN_POINTS, 0, 0.0, 1), 7).unwrap();
    assert!(found.share() > 0.9, "{found:?}");
}

#[test]
fn a_radian_has_the_pixels_of_the_place() {
    let camera =
        Camera::new(752, 480, [FOCAL_PX, FOCAL_PX, 376.0, 240.0], vice_core::camera::Model::Pinhole).unwrap();
    let middle = Sight::new(&camera, Pixel::new(376.0, 240.0)).unwrap();
    assert!((middle.px_per_rad - FOCAL_PX).abs() < 1e-3, "{middle:?}");
    // A ray 40 degrees off the axis: fx / cos² along, fx / cos across, and their mean between them.
    let aside = Sight::new(&camera, Pixel::new(376.0 + FOCAL_PX * 40_f64.to_radians().tan(), 240.0)).unwrap();
    let cos = 40_f64.to_radians().cos();
    assert!((aside.px_per_rad - FOCAL_PX / cos.powf(1.5)).abs() < 0.5, "{aside:?}");
}
