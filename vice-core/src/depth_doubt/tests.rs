use super::*;
use crate::camera::Model;
use crate::frames::Rigid;
use crate::random::SplitMix;
use nalgebra::UnitQuaternion;

fn camera() -> Camera {
    let model = Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]).unwrap();
    Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model).unwrap()
}

/// A camera that goes aside and turns a little; the depth that is used is `used` times the true one, the motion
/// `scale` times as long as the true one.
fn track(random: &mut SplitMix, used: f64, scale: f64) -> LiftedTrack {
    let mut unit = || random.below(1 << 20) as f64 / f64::from(1 << 20);
    let truth = Point3::new(2.0 * unit() - 1.0, unit() - 0.5, 2.0 + 2.0 * unit());
    let speed = Vector3::new(0.15 + 0.1 * unit(), 0.1 * unit() - 0.05, 0.1 * unit());
    let mut noise = || (unit() + unit() + unit() - 1.5) * 1.4;
    let view = |i: usize| {
        let t = 0.1 * i as f64;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(0.01 * t, 0.03 * t, 0.0));
        let now: WorldFromCamera = Rigid::from_parts(-t * speed, turn).inverse();
        let told: WorldFromCamera = Rigid::from_parts(-t * scale * speed, turn).inverse();
        let seen = camera().project(&now.inverse().transform_point(&truth)).unwrap();
        (told, Pixel::new(seen.u + noise(), seen.v + noise()))
    };
    let views: Vec<_> = (1..=40).map(view).collect();
    LiftedTrack::new(truth * used, Rigid::identity(), &views)
}

#[test]
fn wrong_depths_are_found_and_right_ones_left_alone() {
    let mut random = SplitMix::new(7);
    for seed in 0..10 {
        let tracks: Vec<LiftedTrack> = (0..20)
            .map(|i| track(&mut random, if i % 2 == 0 { 1.0 } else { 1.3 + 0.1 * f64::from(i) }, 1.0))
            .collect();
        let found = doubts(&camera(), &tracks[..]);
        assert_eq!(found.points.iter().map(|p| p.0 % 2).collect::<Vec<_>>(), [1; 10], "seed {seed}");
        for (i, better) in &found.points {
            let expected = 1.0 / (1.3 + 0.1 * *i as f64);
            assert!((better.factor / expected - 1.0).abs() < 0.1, "{better:?} for {expected}");
            assert!(better.error_then_px < 2.0 && better.error_px > better.error_then_px);
        }
        assert_eq!(found.common, None);
    }
}

#[test]
fn a_scale_of_the_motion_is_not_blamed_on_the_points() {
    let mut random = SplitMix::new(3);
    let tracks: Vec<LiftedTrack> = (0..12).map(|_| track(&mut random, 1.0, 1.5)).collect();
    let found = doubts(&camera(), &tracks[..]);
    assert!(found.points.is_empty(), "{found:?}");
    let (factor, n, of) = found.common.unwrap();
    assert!((factor / 1.5 - 1.0).abs() < 0.05 && n >= 10 && of == 12, "{factor} {n} {of}");
}

/// Tracks whose squares are known.
struct WithSquares<'a>(&'a [LiftedTrack]);

impl LiftedTracks for WithSquares<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn has_views(&self, track: usize, views: usize) -> bool {
        self.0.has_views(track, views)
    }

    fn get(&self, track: usize) -> LiftedTrack {
        self.0[track].clone()
    }

    fn squares_px2(&self, track: usize) -> Option<f64> {
        let camera = camera();
        let cost = Fitter { camera: &camera, track: &self.0[track], noise_px: 1.0 }.at(1.0)?;
        Some(cost.residuals.iter().map(|r| r[0] * r[0] + r[1] * r[1]).sum())
    }
}

#[test]
fn known_squares_change_nothing() {
    let mut random = SplitMix::new(11);
    let camera = camera();
    // More points than the noise is taken from, so that some are judged by their squares.
    let used = |i: usize| [1.0, 1.0, 1.0, 1.5, 1.02][i % 5];
    let tracks: Vec<LiftedTrack> =
        (0..2 * MOST_FOR_NOISE + 7).map(|i| track(&mut random, used(i), 1.0)).collect();
    let with_squares = WithSquares(&tracks);
    let mut below = 0;
    for (i, track) in tracks.iter().enumerate() {
        for noise_px in [0.5, 1.0, 3.0] {
            let Some(cost) = (Fitter { camera: &camera, track, noise_px }).at(1.0) else { continue };
            let most = with_squares.squares_px2(i).unwrap() / (noise_px * noise_px);
            assert!(cost.cost <= most * (1.0 + 1e-12), "{} {most}", cost.cost);
            below += usize::from(most < SURE_SHARE * GAIN);
        }
    }
    assert!(below > 100, "{below}");
    let (found, expected) = (doubts(&camera, &with_squares), doubts(&camera, &tracks[..]));
    assert_eq!(found, expected);
    assert!(found.points.len() > 100);
}

#[test]
fn nothing_is_doubted_where_nothing_can_be_seen() {
    let mut random = SplitMix::new(5);
    let mut tracks: Vec<LiftedTrack> = (0..8).map(|i| track(&mut random, 1.0 + f64::from(i), 0.0)).collect();
    // The camera stands, and so do the labels.
    let standing = |track: &LiftedTrack, views: usize| {
        let seen = Pixel::new(track.label_px[0][0], track.label_px[1][0]);
        let ray = camera().unproject(seen).unwrap();
        let point = Point3::from(ray * track.point_camera_m.z);
        LiftedTrack::new(point, Rigid::identity(), &vec![(Rigid::identity(), seen); views])
    };
    tracks.iter_mut().for_each(|track| *track = standing(track, 40));
    assert_eq!(doubts(&camera(), &tracks[..]), Doubts::default());
    assert_eq!(doubts(&camera(), &[][..]), Doubts::default());
    tracks.iter_mut().for_each(|track| *track = standing(track, 2));
    assert_eq!(doubts(&camera(), &tracks[..]), Doubts::default());
}
