//! The error of the labels that hold, with its interval, by age and by motion, for one stream and depth source.

use std::collections::BTreeMap;
use std::ops::Range;

use super::score::{Scored, ScoredSegment, Scorer};
use super::windows::Windows;
use crate::frames::BodyFromCamera;
use crate::metrics::by_age::{Errors, SegmentErrors, Window, errors, errors_at};
use crate::metrics::held::{Aside, Segments, set_aside};
use crate::metrics::interval::{Estimated, FEWEST_SEGMENTS};
use crate::result::{AsideReason, Figure, HeldPart, PointName, SetAside, WindowPart};
use crate::statistics::Counted;
use crate::suspicion::Suspicion;

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

/// What was scored, as it is asked which labels hold.
struct Asked<'a> {
    scorer: &'a Scorer<'a>,
    scored: &'a Scored,
}

impl Asked<'_> {
    fn one(&self, segment: usize) -> &ScoredSegment {
        &self.scored.segments[segment]
    }
}

impl Segments for Asked<'_> {
    fn count(&self) -> usize {
        self.scored.segments.len()
    }

    fn point(&self, segment: usize) -> usize {
        self.one(segment).point
    }

    fn keyframe(&self, segment: usize) -> u32 {
        self.one(segment).keyframe
    }

    fn frames(&self, segment: usize) -> Vec<u32> {
        self.scorer.places(self.one(segment))
    }

    fn jumps_px(&self, segment: usize) -> &[f32] {
        let ScoredSegment { point, first, count, .. } = self.one(segment);
        &self.scored.columns[*point].jumps_px[*first..first + count]
    }

    fn start_px(&self, segment: usize) -> Option<f64> {
        Some(self.one(segment).start_px)
    }

    fn residuals(&self, segment: usize, samples: Range<usize>) -> Vec<[f64; 2]> {
        self.scorer.residuals(self.one(segment), samples)
    }
}

/// All of it from what was scored.
pub(super) fn spread(scorer: &Scorer<'_>, scored: &Scored, windows: &Windows<'_>) -> Spread {
    let segments = &scored.segments;
    let asked = Asked { scorer, scored };
    let aside = set_aside(&asked);
    let mended: BTreeMap<usize, SegmentErrors> =
        aside.iter().map(|(i, aside)| (*i, without(scorer, &segments[*i], aside, windows))).collect();
    let held: Vec<(usize, &SegmentErrors)> =
        segments.iter().enumerate().map(|(i, s)| (s.point, mended.get(&i).unwrap_or(&s.errors))).collect();
    let Some(all) = errors(&held) else {
        // Nothing holds, or nothing was scored.
        return Spread {
            held_rmse_px: None,
            interval_95: None,
            held: None,
            by_age: vec![],
            by_distance: vec![],
        };
    };
    let (mut by_age, mut by_distance) = (Vec::new(), Vec::new());
    for window in Window::all() {
        let at = window.at();
        let found = errors_at(&held, window);
        match window {
            Window::Age(_) => {
                let part = self::window(found, format!("{} s", 1.2 * at));
                by_age.push(WindowPart { age_s: Some(at), ..part });
            }
            Window::Motion(_) => {
                let part = self::window(found, format!("{} m of motion", 1.2 * at));
                by_distance.push(WindowPart { moved_m: Some(at), ..part });
            }
        }
    }
    let squares: Vec<&[f64]> = scored.columns.iter().map(|c| c.squares_px2.as_slice()).collect();
    let counted = Counted::new(&squares, |_| true);
    let held = HeldPart {
        segments: all.px.segments as u64,
        points: all.px.points as u64,
        samples: all.px.samples,
        median_px: counted.median().map(f64::sqrt),
        mrad: all.angle_rad.map(|e| figure(&e, MILLI)),
        mm: all.offset_m.map(|e| figure(&e, MILLI)),
        degrees_of_freedom: all.px.degrees_of_freedom,
        note: note(&all.px),
        heaviest_segment_share: heaviest_segment(segments),
        heaviest_percent_share: heaviest_percent(&squares, &counted),
        set_aside: list(&asked, &aside, windows),
    };
    Spread {
        held_rmse_px: Some(all.px.rmse),
        interval_95: all.px.interval_95(),
        held: Some(held),
        by_age,
        by_distance,
    }
}

/// The errors of a segment without what is set aside of it.
fn without(
    scorer: &Scorer<'_>,
    segment: &ScoredSegment,
    aside: &Aside,
    windows: &Windows<'_>,
) -> SegmentErrors {
    if aside.keyframe_px.is_some() {
        return SegmentErrors::default();
    }
    let labels: Vec<usize> = aside.labels.iter().map(|(place, _)| *place).collect();
    scorer.errors_without(segment, windows, &labels)
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
fn heaviest_segment(segments: &[ScoredSegment]) -> f64 {
    let sums = segments.iter().map(|s| s.errors.squares_px2());
    let (all, most) = sums.fold((0.0, 0.0_f64), |(all, most), sum| (all + sum, most.max(sum)));
    if all > 0.0 { most / all } else { 0.0 }
}

/// Share of the squared error of the largest 1 % of the samples.
fn heaviest_percent<W: Fn(&f64) -> bool + Sync>(squares: &[&[f64]], counted: &Counted<'_, f64, W>) -> f64 {
    let count = counted.total;
    let all: f64 = squares.iter().flat_map(|part| part.iter()).sum();
    let few = count.div_ceil(100);
    if few == 0 || all <= 0.0 {
        return 0.0;
    }
    let Some(least) = counted.at_ranks(&[count - few]).first().copied() else { return 0.0 };
    let (mut above, mut sum) = (0_u64, 0.0);
    for square in squares.iter().flat_map(|part| part.iter()).filter(|v| **v > least) {
        above += 1;
        sum += square;
    }
    // Of those at the limit as many as are left.
    (sum + (few - above.min(few)) as f64 * least) / all
}

fn list(asked: &Asked<'_>, aside: &BTreeMap<usize, Aside>, windows: &Windows<'_>) -> Vec<SetAside> {
    let stamp = |place: u32| windows.stamps[place as usize];
    let mut list = Vec::new();
    for (number, aside) in aside {
        let segment = asked.one(*number);
        let point = || PointName(asked.scorer.evaluation.selection.points[segment.point].name.clone());
        if let Some(off_px) = aside.keyframe_px {
            list.push(SetAside {
                point: point(),
                timestamp_ns: stamp(segment.keyframe),
                reason: AsideReason::KeyframeOff,
                off_px,
                samples: segment.count as u64,
            });
            continue;
        }
        let places = asked.frames(*number);
        list.extend(aside.labels.iter().map(|(place, off_px)| SetAside {
            point: point(),
            timestamp_ns: stamp(places[*place]),
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
