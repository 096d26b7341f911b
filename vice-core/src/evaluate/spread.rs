//! The error of the labels that hold, with its interval, by age and by motion, for one stream and depth source.

use super::Evaluation;
use super::score::Scored;
use crate::frames::BodyFromCamera;
use crate::metrics::by_age::{AGES_S, Errors, MOTIONS_M, errors, errors_at};
use crate::metrics::held::{Aside, CarriedSegment, set_aside};
use crate::metrics::interval::{Estimated, FEWEST_SEGMENTS};
use crate::result::{AsideReason, Figure, HeldPart, PointName, SetAside, WindowPart};
use crate::statistics::median;
use crate::suspicion::Suspicion;
use crate::time::Stamp;

use super::streams::PosesAtFrames;

/// A segment, or one percent of the samples, that carries more than this is said.
const HEAVY_SHARE: f64 = 0.5;
/// One percent of the samples is told from so many samples on: below it is a single one.
const FEWEST_SAMPLES: u64 = 100;
/// Milli of a unit.
const MILLI: f64 = 1e3;

/// What stands beside the paper's columns.
pub(super) struct Spread {
    pub(super) held_rmse_px: Option<f64>,
    pub(super) interval_95: Option<[f64; 2]>,
    pub(super) held: Option<HeldPart>,
    pub(super) by_age: Vec<WindowPart>,
    pub(super) by_distance: Vec<WindowPart>,
}

/// How far the camera has moved along its path at each selected frame, metres, by the poses of a stream. Where the stream
/// has a gap the way across is straight.
pub(super) fn path_m(poses: &PosesAtFrames, cameras: &[Option<BodyFromCamera>]) -> Vec<f64> {
    let mut moved_m = 0.0;
    let mut last: Option<nalgebra::Vector3<f64>> = None;
    let step = |(pose, camera): (&Result<_, _>, &Option<BodyFromCamera>)| {
        if let (Ok(world_from_body), Some(body_from_camera)) = (pose, camera) {
            let world_from_camera: crate::frames::WorldFromCamera = *world_from_body * *body_from_camera;
            let here = world_from_camera.translation();
            moved_m += last.map_or(0.0, |last| (here - last).norm());
            last = Some(here);
        }
        moved_m
    };
    poses.iter().zip(cameras).map(step).collect()
}

/// All of it from what was scored. `moved_m` is by selected frame.
pub(super) fn spread(evaluation: &Evaluation<'_>, scored: &Scored, moved_m: &[f64]) -> Spread {
    let segments = &scored.carried;
    let aside = set_aside(segments);
    let stamp = |at: u32| evaluation.frames[evaluation.selection.frames[at as usize]];
    let Some(all) = errors(segments, &aside, |_, _| true) else {
        // Nothing holds, or nothing was scored.
        return Spread {
            held_rmse_px: None,
            interval_95: None,
            held: None,
            by_age: vec![],
            by_distance: vec![],
        };
    };
    let age_s = |from: u32, to: u32| stamp(to).since(stamp(from)).as_secs_f64();
    let way_m = |from: u32, to: u32| moved_m[to as usize] - moved_m[from as usize];
    let by_age = AGES_S.map(|at| {
        let part = window(errors_at(segments, &aside, at, age_s), format!("{} s", 1.2 * at));
        WindowPart { age_s: Some(at), ..part }
    });
    let by_distance = MOTIONS_M.map(|at| {
        let part = window(errors_at(segments, &aside, at, way_m), format!("{} m of motion", 1.2 * at));
        WindowPart { moved_m: Some(at), ..part }
    });
    let mut squares: Vec<f64> = segments
        .iter()
        .flat_map(|s| s.samples.iter().map(crate::metrics::held::Carried::square_px2))
        .collect();
    let held = HeldPart {
        segments: all.px.segments as u64,
        points: all.px.points as u64,
        samples: all.px.samples,
        median_px: median(&mut squares).map(f64::sqrt),
        mrad: all.angle_rad.map(|e| figure(&e, MILLI)),
        mm: all.offset_m.map(|e| figure(&e, MILLI)),
        degrees_of_freedom: all.px.degrees_of_freedom,
        note: note(&all.px),
        heaviest_segment_share: heaviest_segment(segments),
        heaviest_percent_share: heaviest_percent(&mut squares),
        set_aside: list(evaluation, segments, &aside, stamp),
    };
    Spread {
        held_rmse_px: Some(all.px.rmse),
        interval_95: all.px.interval_95(),
        held: Some(held),
        by_age: by_age.into(),
        by_distance: by_distance.into(),
    }
}

fn figure(found: &Estimated, unit: f64) -> Figure {
    let interval_95 = found.interval_95().map(|ends| ends.map(|v| unit * v));
    Figure { rmse: unit * found.rmse, interval_95 }
}

fn window(found: Result<Errors, usize>, reach: String) -> WindowPart {
    let mut part = WindowPart {
        age_s: None,
        moved_m: None,
        px: None,
        mrad: None,
        mm: None,
        segments: 0,
        samples: 0,
        refused: None,
    };
    match found {
        Ok(errors) => {
            part.px = Some(figure(&errors.px, 1.0));
            part.mrad = errors.angle_rad.map(|e| figure(&e, MILLI));
            part.mm = errors.offset_m.map(|e| figure(&e, MILLI));
            part.segments = errors.px.segments as u64;
            part.samples = errors.px.samples;
        }
        Err(reaching) => {
            part.refused = Some(format!("{reaching} segments reach {reach}, {FEWEST_SEGMENTS} are needed"));
        }
    }
    part
}

/// Why there is no interval, or how many segments would make a useful one.
fn note(found: &Estimated) -> Option<String> {
    let Some(h) = found.half_width_log else {
        return Some(if found.segments < FEWEST_SEGMENTS {
            format!("{} segments hold: an interval needs {FEWEST_SEGMENTS}", found.segments)
        } else {
            "no error at all: nothing to be uncertain of".to_string()
        });
    };
    if h <= std::f64::consts::LN_2 {
        return None;
    }
    let wanted = found.segments_for(std::f64::consts::LN_2).unwrap_or(usize::MAX);
    Some(format!(
        "not known to a factor of two: that takes about {wanted} segments, here are {}",
        found.segments
    ))
}

/// Share of the squared error of the heaviest segment.
fn heaviest_segment(segments: &[CarriedSegment]) -> f64 {
    let sums = segments.iter().map(|s| s.samples.iter().map(|c| c.square_px2()).sum::<f64>());
    let (all, most) = sums.fold((0.0, 0.0_f64), |(all, most), sum| (all + sum, most.max(sum)));
    if all > 0.0 { most / all } else { 0.0 }
}

/// Share of the squared error of the largest 1 % of the samples.
fn heaviest_percent(squares: &mut [f64]) -> f64 {
    let few = squares.len().div_ceil(100);
    let all: f64 = squares.iter().sum();
    if few == 0 || all <= 0.0 {
        return 0.0;
    }
    let (_, _, _) = squares.select_nth_unstable_by(few - 1, |a, b| b.total_cmp(a));
    squares[..few].iter().sum::<f64>() / all
}

fn list(
    evaluation: &Evaluation<'_>,
    segments: &[CarriedSegment],
    aside: &[Aside],
    stamp: impl Fn(u32) -> Stamp,
) -> Vec<SetAside> {
    let mut list = Vec::new();
    for (segment, aside) in segments.iter().zip(aside) {
        let point = || PointName(evaluation.selection.points[segment.point].name.clone());
        if let Some(off_px) = aside.keyframe_px {
            list.push(SetAside {
                point: point(),
                timestamp_ns: stamp(segment.keyframe),
                reason: AsideReason::KeyframeOff,
                off_px,
                samples: segment.samples.len() as u64,
            });
            continue;
        }
        list.extend(aside.labels.iter().map(|(place, off_px)| SetAside {
            point: point(),
            timestamp_ns: stamp(segment.samples[*place].frame),
            reason: AsideReason::LabelJumps,
            off_px: *off_px,
            samples: 1,
        }));
    }
    list
}

/// What is to be said of a value that rests on little.
pub(super) fn suspicions(about: &str, spread: &Spread, scored: u64) -> Vec<Suspicion> {
    let Some(held) = &spread.held else { return vec![] };
    let median = held.median_px.map_or_else(String::new, |m| format!("; the median error is {m:.2} px"));
    let heavy = |code: &str, what: &str, share: f64| {
        Suspicion::new(
            code,
            about,
            format!("{what} over half of the squared error: RMSE_2D is about little else"),
        )
        .evidence(format!("{:.0} %{median}", 100.0 * share))
        .advice("look at these labels and at the estimate there before comparing RMSE_2D")
    };
    let mut list = Vec::new();
    if held.heaviest_segment_share > HEAVY_SHARE && held.segments >= FEWEST_SEGMENTS as u64 {
        list.push(heavy("one-segment-carries-the-error", "one segment carries", held.heaviest_segment_share));
    }
    if held.heaviest_percent_share > HEAVY_SHARE && scored >= FEWEST_SAMPLES {
        list.push(heavy(
            "few-samples-carry-the-error",
            "1 % of the samples carry",
            held.heaviest_percent_share,
        ));
    }
    list
}
