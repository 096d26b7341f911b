//! The pipeline on a made-up robot that flies over a floor: exact poses give no error, and nothing is lost.

use std::sync::Arc;

use nalgebra::{Point3, UnitQuaternion, Vector3};
use proptest::prelude::*;

use super::*;
use crate::camera::{Camera, Model, Pixel};
use crate::dataset::{Dataset, Floor, Image};
use crate::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use crate::frames::{Body, Rigid, World, WorldFromBody};
use crate::label::{LabelRow, LabelSet, Observation, ObservationSource};
use crate::metrics::align::Alignment;
use crate::result::Role;
use crate::time::Span;
use crate::trajectory::{Trajectory, in_other_world};

mod triangulated;
mod verdict;

struct Flyer {
    camera: Camera,
    frames: Arc<[Stamp]>,
}

fn stamp(index: usize) -> Stamp {
    Stamp::from_nanos(1_403_715_273_262_142_976 + 50_000_000 * index as i64)
}

/// Two metres over the floor, looking down at it, moving and turning.
fn world_from_body(index: usize) -> WorldFromBody {
    let s = index as f64 * 0.05;
    let down = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    let turn = UnitQuaternion::from_euler_angles(0.1 * s.sin(), 0.08 * (1.3 * s).cos(), 0.3 * s);
    Rigid::from_parts(Vector3::new(0.3 * s, 0.1 * s.sin(), 2.0 + 0.1 * s.cos()), turn * down)
}

fn body_from_camera() -> BodyFromCamera {
    Rigid::from_parts(Vector3::new(0.05, -0.02, 0.01), UnitQuaternion::from_euler_angles(0.02, -0.03, 0.5))
}

impl Dataset for Flyer {
    fn name(&self) -> &str {
        "flyer"
    }
    fn format(&self) -> &str {
        "test"
    }
    fn cameras(&self) -> Vec<String> {
        vec!["cam0".to_string()]
    }
    fn camera(&self, _: &str) -> DataResult<Camera> {
        Ok(self.camera)
    }
    fn frames(&self, _: &str) -> DataResult<Arc<[Stamp]>> {
        Ok(self.frames.clone())
    }
    fn image(&self, _: &str, _: usize) -> DataResult<Image> {
        panic!("evaluating decodes no image")
    }
    fn body_from_camera(&self, _: &str, _: Stamp) -> DataResult<BodyFromCamera> {
        Ok(body_from_camera())
    }
    fn streams(&self) -> Vec<String> {
        vec![]
    }
    fn trajectory(&self, _: &str) -> DataResult<Trajectory> {
        Err(DataError::new("none"))
    }
}

/// Ray against plane, written down once more for the test.
struct FloorOfTest;

impl DepthSource for FloorOfTest {
    fn name(&self) -> &str {
        "floor"
    }
    fn needs_world(&self, _: &Floor) -> bool {
        true
    }
    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let depth = |px: &Pixel| {
            let pose = keyframe.world_from_camera.ok_or(DepthMiss::NoAnchor)?;
            let ray = pose.rotate(&keyframe.camera.unproject(*px).map_err(|_| DepthMiss::OutsideModel)?);
            let z = -pose.translation().z / ray.z;
            if z > 0.0 { Ok(DepthSample::new(z)) } else { Err(DepthMiss::AboveHorizon) }
        };
        Ok(pixels.iter().map(depth).collect())
    }
}

const FRAMES: usize = 40;

fn flyer() -> Flyer {
    let model = Model::from_name("radtan", &[-0.28, 0.07, 0.0002, 0.00002]).unwrap();
    let camera = Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap();
    Flyer { camera, frames: (0..FRAMES).map(stamp).collect() }
}

/// Exact labels of points on the floor, with a respawn at frame 20.
fn labels(flyer: &Flyer) -> LabelSet {
    let mut rows = Vec::new();
    for (point, (du, dv)) in [(0.0, 0.0), (60.0, 30.0), (-80.0, 40.0), (20.0, -70.0)].into_iter().enumerate()
    {
        for start in [0, 20] {
            let at = world_from_body(start) * body_from_camera();
            let ray = at.rotate(&flyer.camera.unproject(Pixel::new(380.0 + du, 240.0 + dv)).unwrap());
            let world = Point3::from(at.translation() - ray * (at.translation().z / ray.z));
            for index in start..start + 20 {
                let camera = (world_from_body(index) * body_from_camera()).inverse().transform_point(&world);
                let px = flyer.camera.project(&camera).unwrap();
                let mut observation = Observation::manual(stamp(index), px);
                observation.keyframe = index == start;
                rows.push(LabelRow { point: point.to_string(), observation });
            }
        }
    }
    LabelSet::from_rows(rows).unwrap()
}

fn exact() -> Trajectory {
    Trajectory::from_poses((0..FRAMES).map(|i| (stamp(i), world_from_body(i)))).unwrap()
}

fn stream(role: Role, trajectory: Trajectory) -> Stream {
    Stream::new(format!("{role:?}").to_lowercase(), role, trajectory)
}

fn run(labels: &LabelSet, streams: &[Stream], window: Window) -> Result<Evaluated, EvaluateError> {
    run_with(labels, streams, window, |evaluation| evaluate(&evaluation, &|_, _| {}))
}

fn run_with<T>(
    labels: &LabelSet,
    streams: &[Stream],
    window: Window,
    work: impl FnOnce(Evaluation<'_>) -> Result<T, EvaluateError>,
) -> Result<T, EvaluateError> {
    let flyer = flyer();
    let selection = Selection::new(labels, &flyer.frames, &flyer.camera, &window)?;
    let rig = DatasetRig::new(&flyer, "cam0");
    let evaluation = Evaluation::builder(&rig, &flyer.camera, &flyer.frames, &selection)
        .streams(streams)
        .depths(&[&FloorOfTest])
        .keep_samples(true)
        .build();
    work(evaluation)
}

#[test]
fn exact_poses_give_no_error_and_every_sample_is_scored() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, exact())];
    let document = run(&labels, &streams, Window::default()).unwrap();
    for part in &document.pixel {
        assert_eq!((part.scored, part.skipped.len(), part.keyframes.len()), (4 * 38, 0, 8));
        assert!(part.pooled_rmse_px.unwrap() < 1e-7, "{:?}", part.pooled_rmse_px);
        assert_eq!(part.rmse_px.keys().copied().collect::<Vec<_>>(), [1, 2, 3]);
    }
    let t = &document.trajectory[0];
    assert_eq!(t.matched, FRAMES);
    assert!(t.rmse_3d_m.unwrap() < 1e-9 && t.aoe_rad.unwrap() < 1e-7 && t.roe_rad.unwrap() < 1e-7);
    assert_eq!(crate::result::worst_skipped_percent(&document.pixel), 0.0);
    #[cfg(feature = "serde")]
    {
        let text = serde_json::to_string(&document).unwrap();
        assert_eq!(serde_json::from_str::<Evaluated>(&text).unwrap(), document);
    }
}

#[test]
fn gaps_are_counted_with_their_reason_and_a_gap_at_a_key_frame_skips_its_segment() {
    let labels = labels(&flyer());
    let without = |missing: &dyn Fn(usize) -> bool| {
        let kept = (0..FRAMES).filter(|i| !missing(*i)).map(|i| (stamp(i), world_from_body(i)));
        stream(Role::Estimate, Trajectory::from_poses(kept).unwrap())
    };
    let reference = stream(Role::Reference, exact());
    let parts = |estimate| run(&labels, &[reference.clone(), estimate], Window::default()).unwrap().pixel;

    let middle = &parts(without(&|i| (8..12).contains(&i)))[1];
    assert_eq!(middle.skips_by_reason().into_iter().collect::<Vec<_>>(), [("frame-gap", 16)]);
    assert_eq!(middle.scored, 4 * 34);
    assert!((middle.skipped_percent() - 100.0 * 16.0 / 152.0).abs() < 1e-12);

    let at_keyframe = &parts(without(&|i| (18..23).contains(&i)))[1];
    assert_eq!(
        at_keyframe.skips_by_reason().into_iter().collect::<Vec<_>>(),
        [("frame-gap", 8), ("keyframe-gap", 76)]
    );
    assert_eq!(at_keyframe.keyframes.len(), 4);

    let ends = &parts(without(&|i| !(2..=30).contains(&i)))[1];
    let reasons: Vec<_> = ends.skips_by_reason().into_iter().collect();
    assert_eq!(reasons, [("after-stream", 36), ("keyframe-gap", 76)]);

    // Too sparse for anything: the number is null and all labels are accounted for.
    let sparse = &parts(without(&|i| i % 11 != 5))[1];
    assert_eq!((sparse.scored, sparse.pooled_rmse_px, sparse.skipped.len()), (0, None, 152));
    assert_eq!(sparse.skipped_percent(), 100.0);
    assert!(sparse.rmse_px.values().all(Option::is_none));
}

#[test]
fn poses_of_key_frames_only_are_said_to_be_sparse() {
    let labels = labels(&flyer());
    let said = |every: usize| {
        let kept = (0..FRAMES).step_by(every).map(|i| (stamp(i), world_from_body(i)));
        let estimate = stream(Role::Estimate, Trajectory::from_poses(kept).unwrap());
        let streams = [stream(Role::Reference, exact()), estimate];
        let said = run(&labels, &streams, Window::default()).unwrap().suspicions;
        said.into_iter().filter(|s| s.code == "sparse-poses").collect::<Vec<_>>()
    };
    let sparse = said(13);
    assert_eq!(
        (sparse.len(), sparse[0].code.as_str(), sparse[0].about.as_str()),
        (1, "sparse-poses", "estimate")
    );
    let line = sparse[0].line();
    assert!(line.contains("a pose every 0.65 s, --max-gap is 0.1 s; 36 of 40 frames lie in a gap"), "{line}");
    assert!(line.contains("the nearest pose 0.2 s away") && line.contains("--max-gap 0.7"), "{line}");
    assert!(said(1).is_empty() && said(2).is_empty());
}

#[test]
fn points_carried_behind_the_camera_are_a_finding_about_an_estimate() {
    let about_x = UnitQuaternion::from_euler_angles(std::f64::consts::PI, 0.0, 0.0);
    let half_turn: Rigid<Body, Body> = Rigid::from_parts(Vector3::zeros(), about_x);
    let turned = (0..FRAMES).map(|i| {
        let pose = world_from_body(i);
        (stamp(i), if i % 2 == 1 { pose * half_turn } else { pose })
    });
    let turned = Trajectory::from_poses(turned).unwrap();
    let part = |role| {
        run(&labels(&flyer()), &[stream(role, turned.clone())], Window::default()).unwrap().pixel.remove(0)
    };
    for (role, percent) in [(Role::Estimate, 0.0), (Role::Reference, 100.0 * 80.0 / 152.0)] {
        let part = part(role);
        assert_eq!(part.skips_by_reason().into_iter().collect::<Vec<_>>(), [("behind-camera", 80)]);
        assert!((part.carried_away_percent() - 100.0 * 80.0 / 152.0).abs() < 1e-9);
        assert!((part.skipped_percent() - percent).abs() < 1e-9, "{role:?}: {}", part.skipped_percent());
    }
}

#[test]
fn labels_that_cannot_be_scored_are_counted() {
    let flyer = flyer();
    let good = labels(&flyer);
    let mut rows: Vec<LabelRow> = good
        .points()
        .iter()
        .flat_map(|p| p.observations.iter().map(|o| LabelRow { point: p.name.clone(), observation: o }))
        .collect();
    rows[3].observation.stamp = rows[3].observation.stamp + Span::from_nanos(7);
    rows[5].observation.occluded = true;
    rows[40].observation.keyframe = false;
    let moved = LabelSet::from_rows(rows).unwrap();
    let part = &run(&moved, &[stream(Role::Estimate, exact())], Window::default()).unwrap().pixel[0];
    let reasons: Vec<_> = part.skips_by_reason().into_iter().collect();
    assert_eq!(reasons, [("before-first-keyframe", 20), ("no-frame", 1), ("occluded", 1)]);
    assert!((part.skipped_percent() - 100.0 * 21.0 / (21.0 + part.scored as f64)).abs() < 1e-12);
    assert_eq!(part.scored as usize + part.skipped.len() + 7, moved.observation_count());
}

#[test]
fn what_cannot_be_evaluated_says_why() {
    let flyer = flyer();
    let labels = labels(&flyer);
    let streams = [stream(Role::Estimate, exact())];
    let shifted = |span| {
        LabelSet::from_rows(labels.points().iter().flat_map(|p| {
            p.observations.iter().map(move |o| {
                let mut observation = o;
                observation.stamp = observation.stamp + span;
                LabelRow { point: p.name.clone(), observation }
            })
        }))
        .unwrap()
    };
    let off = run(&shifted(Span::from_nanos(1)), &streams, Window::default()).unwrap_err();
    assert!(matches!(off, EvaluateError::NoLabelAtFrame { .. }), "{off}");
    let late = Window { start: Span::from_millis(60_000), ..Window::default() };
    assert!(matches!(run(&labels, &streams, late), Err(EvaluateError::EmptyWindow)));
    let micros = exact().iter().map(|(s, p)| (Stamp::from_nanos(s.as_nanos() / 1000), p)).collect::<Vec<_>>();
    let micros = [stream(Role::Estimate, Trajectory::from_poses(micros).unwrap())];
    let error = run(&labels, &micros, Window::default()).unwrap_err().to_string();
    assert!(error.contains("microseconds") && error.contains("do not overlap"), "{error}");
    let outside = LabelSet::from_rows([LabelRow {
        point: "a".to_string(),
        observation: Observation::manual(stamp(0), Pixel::new(752.0, 10.0)).as_keyframe(),
    }])
    .unwrap();
    assert!(matches!(run(&outside, &streams, Window::default()), Err(EvaluateError::LabelOutside { .. })));
    let none = LabelSet::from_rows([]).unwrap();
    assert!(matches!(run(&none, &streams, Window::default()), Err(EvaluateError::NoLabels)));
    assert!(subset_sizes(Some(&[5]), 4).is_err() && subset_sizes(Some(&[0]), 4).is_err());
}

#[test]
fn a_window_keeps_its_key_frames() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Estimate, exact())];
    let window = Window {
        fps: Some(10.0),
        start: Span::from_millis(500),
        duration: Some(Span::from_millis(200)),
        ..Window::default()
    };
    let part = &run(&labels, &streams, window).unwrap().pixel[0];
    // Frames 10, 12 and 14, scored against the key frame 0 that lies before the window.
    assert_eq!((part.scored, part.keyframes.len()), (12, 4));
    assert!(part.keyframes.iter().all(|k| k.timestamp_ns == stamp(0)));
    assert!(part.pooled_rmse_px.unwrap() < 1e-7);
    // The key frame before the window says what the points are; it is no frame of the window.
    let both = [stream(Role::Reference, exact()), stream(Role::Estimate, exact())];
    assert_eq!(run(&labels, &both, window).unwrap().trajectory[0].matched, 3);
}

#[test]
fn the_document_is_the_same_for_any_number_of_threads() {
    let labels = labels(&flyer());
    let drifting = exact().map_poses(|s, p| {
        let drift = Vector3::new(0.02, 0.0, 0.01) * s.since(stamp(0)).as_secs_f64();
        Rigid::from_parts(p.translation() + drift, p.rotation())
    });
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, drifting)];
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        // As text, which tells a zero from a negative one.
        pool.install(|| format!("{:?}", run(&labels, &streams, Window::default()).unwrap()))
    };
    assert_eq!(with(1), with(4));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    #[test]
    fn the_world_of_an_estimate_does_not_matter(n in prop::array::uniform6(-2.0..2.0_f64)) {
        let labels = labels(&flyer());
        let moved: Rigid<World, World> = Rigid::from_parts(
            Vector3::new(n[0], n[1], n[2]) * 10.0,
            UnitQuaternion::from_scaled_axis(Vector3::new(n[3], n[4], n[5])),
        );
        let noisy = exact().map_poses(|s, p| {
            let wave = (s.since(stamp(0)).as_secs_f64() * 3.0).sin() * 0.02;
            Rigid::from_parts(p.translation() + Vector3::new(wave, -wave, wave), p.rotation())
        });
        let errors = |estimate: Trajectory| {
            let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, estimate)];
            let document = run(&labels, &streams, Window::default()).unwrap();
            (document.pixel[1].pooled_rmse_px.unwrap(), document.trajectory[0].rmse_3d_m.unwrap())
        };
        let (here, there) = (errors(noisy.clone()), errors(in_other_world(&moved, &noisy)));
        prop_assert!((here.0 - there.0).abs() < 1e-6 && (here.1 - there.1).abs() < 1e-9, "{:?} {:?}", here, there);
    }
}

#[test]
fn manual_labels_are_scored_without_a_word_of_a_machine() {
    let mut rows: Vec<LabelRow> = Vec::new();
    for point in labels(&flyer()).points() {
        for (i, mut observation) in point.observations.iter().enumerate() {
            // Every other label is the tracker's; of point 3 also the second key frame.
            if i % 2 == 1 || (point.name == "3" && i == 20) {
                observation.source = ObservationSource::Auto;
            }
            rows.push(LabelRow { point: point.name.clone(), observation });
        }
    }
    let labels = LabelSet::from_rows(rows.clone()).unwrap();
    let streams = [stream(Role::Estimate, exact())];
    let manual = Window { observations: Observations::Manual, ..Window::default() };
    let part = &run(&labels, &streams, manual).unwrap().pixel[0];
    // Nine manual ones follow each of seven manual key frames, and one that is not.
    assert_eq!((part.scored, part.keyframes.len()), (7 * 9, 7));
    let reasons: Vec<(&str, usize)> = part.skips_by_reason().into_iter().collect();
    assert_eq!(reasons, [("keyframe-not-manual", 9), ("not-manual", 8 * 10)]);
    assert!((part.skipped_percent() - 100.0 * 9.0 / 72.0).abs() < 1e-9, "{}", part.skipped_percent());
    assert_eq!(run(&labels, &streams, Window::default()).unwrap().pixel[0].scored, 4 * 38);
    for row in &mut rows {
        row.observation.source = ObservationSource::Auto;
    }
    let error = run(&LabelSet::from_rows(rows).unwrap(), &streams, manual).unwrap_err();
    assert!(matches!(error, EvaluateError::NoManualKeyframe));
}
