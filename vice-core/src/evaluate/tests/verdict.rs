//! What stands beside the paper's columns: labels that hold, doubtful depths, each stream by its own place.

use super::*;
use crate::result::{AsideReason, DepthDoubtReason, PixelPart};

fn rows(change: impl Fn(&str, usize, &mut Observation)) -> LabelSet {
    let mut rows = Vec::new();
    for point in labels(&flyer()).points() {
        for (i, mut observation) in point.observations.iter().enumerate() {
            change(&point.name, i, &mut observation);
            rows.push(LabelRow { point: point.name.clone(), observation });
        }
    }
    LabelSet::from_rows(rows).unwrap()
}

/// Labels as a human places them: off by a little, the same on every run.
fn wobbly(change: impl Fn(&str, usize, &mut Observation)) -> LabelSet {
    rows(|point, i, o| {
        let at = i as f64 * 1.9 + point.len() as f64 + point.bytes().map(f64::from).sum::<f64>();
        o.px = Pixel::new(o.px.u + 0.3 * at.sin(), o.px.v + 0.3 * (1.7 * at).cos());
        change(point, i, o);
    })
}

#[test]
fn a_label_that_its_maker_doubts_is_left_out_and_counted() {
    // Three labels, and the second key frame of point 3.
    let doubted = |point: &str, i: usize| (point == "1" && (4..7).contains(&i)) || (point == "3" && i == 20);
    let labels = rows(|point, i, o| o.uncertain = doubted(point, i));
    let streams = [stream(Role::Estimate, exact())];
    let part = &run(&labels, &streams, Window::default()).unwrap().pixel[0];
    let reasons: Vec<(&str, usize)> = part.skips_by_reason().into_iter().collect();
    assert_eq!(reasons, [("keyframe-uncertain", 19), ("uncertain", 3)]);
    assert_eq!((part.scored, part.keyframes.len()), (4 * 38 - 22, 7));
    assert!((part.skipped_percent() - 100.0 * 19.0 / 149.0).abs() < 1e-9);
    for observations in [Observations::All, Observations::Manual] {
        let window = Window { observations, ..Window::default() };
        assert_eq!(run(&labels, &streams, window).unwrap().pixel[0].scored, 4 * 38, "{observations:?}");
    }
    let none = rows(|_, _, o| o.uncertain = true);
    let error = run(&none, &streams, Window::default()).unwrap_err();
    assert!(matches!(error, EvaluateError::NoCertainKeyframe));
    assert_eq!(
        ["certain", "all", "manual"].map(|n| n.parse::<Observations>().unwrap().name()),
        ["certain", "all", "manual"]
    );
    assert!("sure".parse::<Observations>().is_err());
}

#[test]
fn without_a_reference_the_order_of_the_streams_does_not_matter() {
    let labels = labels(&flyer());
    let up = Rigid::from_parts(Vector3::new(0.0, 0.0, 0.4), UnitQuaternion::identity());
    let stream = |name: &str, trajectory| Stream::new(name, Role::Estimate, trajectory);
    let streams = [stream("good", exact()), stream("high", in_other_world(&up, &exact()))];
    let errors = |streams: &[Stream], own: bool| {
        let found = run_with(&labels, streams, Window::default(), |e| {
            evaluate(&Evaluation { own_anchors: own, ..e }, &|_, _| {})
        })
        .unwrap();
        let mut list: Vec<(String, u64)> =
            found.pixel.iter().map(|p| (p.stream.clone(), p.pooled_rmse_px.unwrap().to_bits())).collect();
        list.sort();
        list
    };
    let turned: Vec<Stream> = streams.iter().rev().cloned().collect();
    assert_eq!(errors(&streams, true), errors(&turned, true));
    assert!(f64::from_bits(errors(&turned, true)[0].1) < 1e-6, "the good one is good wherever it stands");
    assert_ne!(errors(&streams, false), errors(&turned, false), "one anchor for all depends on which it is");
}

#[test]
fn a_blunder_on_a_key_frame_is_set_aside_beside_the_papers_number() {
    let off = |o: &mut Observation| o.px = Pixel::new(o.px.u + 30.0, o.px.v);
    let labels = wobbly(|point, i, o| {
        if (point == "2" && i == 20) || (point == "0" && i == 9) {
            off(o);
        }
    });
    let part = run(&labels, &[stream(Role::Estimate, exact())], Window::default()).unwrap().pixel.remove(0);
    let held = part.held.clone().unwrap();
    let aside: Vec<(&str, AsideReason, u64)> =
        held.set_aside.iter().map(|s| (&*s.point.0, s.reason, s.samples)).collect();
    assert_eq!(aside, [("0", AsideReason::LabelJumps, 1), ("2", AsideReason::KeyframeOff, 19)]);
    assert_eq!(held.set_aside[1].timestamp_ns, stamp(20));
    assert_eq!((held.samples + held.samples_set_aside(), held.segments), (part.scored, 7));
    assert_eq!((held.labels_set_aside(), held.segments_set_aside()), (1, 1));
    let (value, [low, high]) = (part.held_rmse_px.unwrap(), part.interval_95.unwrap());
    assert!(part.pooled_rmse_px.unwrap() > 10.0 && value < 0.7, "{part:?}");
    assert!(low < value && value < high);
    // The angle and the offset are the same error: about 0.5 px at 458 px and 2 m.
    let (mrad, mm) = (held.mrad.unwrap(), held.mm.unwrap());
    assert!((mrad.rmse * 0.458 / value - 1.0).abs() < 0.3, "{mrad:?}");
    assert!((mm.rmse / mrad.rmse / 2.0 - 1.0).abs() < 0.3, "{mm:?}");
    // No segment lives for a second.
    assert_eq!(part.by_age.iter().map(|w| w.age_s.unwrap()).collect::<Vec<_>>(), [1.0, 2.0, 5.0, 10.0]);
    assert_eq!(part.by_age[0].refused.as_deref(), Some("0 segments reach 1.2 s, 5 are needed"));
    assert!(part.by_age.iter().chain(&part.by_distance).all(|w| w.px.is_none()));
    // Where nothing is off, the two numbers are one.
    let clean: PixelPart = run(&wobbly(|_, _, _| {}), &[stream(Role::Estimate, exact())], Window::default())
        .unwrap()
        .pixel
        .remove(0);
    assert!((clean.held_rmse_px.unwrap() / clean.pooled_rmse_px.unwrap() - 1.0).abs() < 1e-12);
    assert!(clean.held.unwrap().set_aside.is_empty());
}

#[test]
fn errors_that_rest_on_one_segment_are_said() {
    // All points see it, so that it is the estimate's error: a jump at one frame, for one segment only.
    let labels = wobbly(|point, i, o| {
        if point == "1" && i > 32 {
            o.px = Pixel::new(o.px.u + 40.0, o.px.v);
        }
    });
    let found = run(&labels, &[stream(Role::Estimate, exact())], Window::default()).unwrap();
    let codes: Vec<&str> = found.suspicions.iter().map(|s| s.code.as_str()).collect();
    assert!(codes.contains(&"one-segment-carries-the-error"), "{codes:?}");
    let quiet = run(&wobbly(|_, _, _| {}), &[stream(Role::Estimate, exact())], Window::default()).unwrap();
    assert!(quiet.suspicions.is_empty(), "{:?}", quiet.suspicions);
}

#[test]
fn the_motion_since_the_key_frame_is_compared_without_an_alignment() {
    let labels = labels(&flyer());
    let turn =
        Rigid::from_parts(Vector3::new(3.0, -2.0, 0.5), UnitQuaternion::from_euler_angles(0.0, 0.0, 1.0));
    let mut moved = stream(Role::Estimate, in_other_world(&turn, &exact()));
    moved.align = Some(Alignment::None);
    let found = run(&labels, &[stream(Role::Reference, exact()), moved], Window::default()).unwrap();
    let part = &found.trajectory[0];
    assert_eq!(part.align, "none", "a stream's own alignment goes before the evaluation's");
    assert!(part.rmse_3d_m.unwrap() > 1.0);
    assert_eq!(part.since_keyframe.len(), 38);
    assert!(part.since_keyframe.iter().all(|e| e.position_m < 1e-9 && e.angle_rad < 1e-7));
    let first = part.since_keyframe[0];
    assert_eq!((first.keyframe_ns, first.timestamp_ns), (stamp(0), stamp(1)));
}

/// A scan that knows the floor, and a wall where point 1 starts.
struct Scan;

impl DepthSource for Scan {
    fn name(&self) -> &str {
        "zmap"
    }
    fn needs_world(&self, floor: &Floor) -> bool {
        FloorOfTest.needs_world(floor)
    }
    fn depths(
        &self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
    ) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let wall = |px: &Pixel| px.u > 420.0;
        let floor = FloorOfTest.depths(keyframe, pixels)?;
        let nearer = |d: DepthSample| DepthSample { z_m: 0.5 * d.z_m, ..d };
        Ok(floor.into_iter().zip(pixels).map(|(d, px)| if wall(px) { d.map(nearer) } else { d }).collect())
    }
}

struct Broken;

impl DepthSource for Broken {
    fn name(&self) -> &str {
        "zcam"
    }
    fn needs_world(&self, _: &Floor) -> bool {
        false
    }
    fn depths(&self, _: &Keyframe<'_>, _: &[Pixel]) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        Err(DataError::new("the film is torn"))
    }
}

#[test]
fn another_source_that_disagrees_is_said_point_by_point_and_changes_no_number() {
    let labels = labels(&flyer());
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, exact())];
    let with = |checks: &[&dyn DepthSource]| {
        run_with(&labels, &streams, Window::default(), |e| evaluate(&Evaluation { checks, ..e }, &|_, _| {}))
            .unwrap()
    };
    let (alone, compared) = (with(&[]), with(&[&Scan, &Broken]));
    for (a, b) in alone.pixel.iter().zip(&compared.pixel) {
        assert_eq!((a.pooled_rmse_px, &a.rmse_px), (b.pooled_rmse_px, &b.rmse_px));
        assert!(a.depth_doubts.is_empty());
        let doubted: Vec<(&str, Stamp)> =
            b.depth_doubts.iter().map(|d| (&*d.point.0, d.timestamp_ns)).collect();
        assert_eq!(doubted, [("1", stamp(0)), ("1", stamp(20))]);
        for doubt in &b.depth_doubts {
            assert_eq!(
                (doubt.reason, doubt.other.as_deref()),
                (DepthDoubtReason::SourcesDisagree, Some("zmap"))
            );
            assert!((doubt.other_z_m / doubt.depth_z_m - 0.5).abs() < 1e-12);
        }
    }
    let codes: Vec<&str> = compared.suspicions.iter().map(|s| s.code.as_str()).collect();
    assert_eq!(codes, ["depth-not-compared", "sources-disagree"]);
    assert_eq!(compared.pixel.len(), 2, "nothing is scored with a source that is only compared with");
}

#[test]
fn a_wrong_depth_is_doubted_by_the_way_its_error_grows() {
    let labels = wobbly(|_, _, _| {});
    let streams = [stream(Role::Reference, exact()), stream(Role::Estimate, exact())];
    let found = run_with(&labels, &streams, Window::default(), |e| {
        evaluate(&Evaluation { depths: &[&Scan], ..e }, &|_, _| {})
    })
    .unwrap();
    for part in &found.pixel {
        let doubted: Vec<(&str, DepthDoubtReason)> =
            part.depth_doubts.iter().map(|d| (&*d.point.0, d.reason)).collect();
        assert_eq!(doubted, [("1", DepthDoubtReason::DepthDoubtful); 2], "{:?}", part.depth_doubts);
        assert!(part.depth_doubts.iter().all(|d| (d.other_z_m / d.depth_z_m / 2.0 - 1.0).abs() < 0.15));
    }
    let said = found.suspicions.iter().filter(|s| s.code == "depth-doubtful").count();
    assert_eq!(said, 1, "once for all streams that share the depth");
}
