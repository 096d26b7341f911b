//! Which key frames' depths are doubtful: where another source says another depth, and where none answers, where the
//! point's error grows as that of a wrong depth does.

use nalgebra::Point3;

use super::DepthTable;
use super::score::{Scored, Scorer};
use super::select::{SelectedPoint, SelectedSegment};
use crate::camera::Pixel;
use crate::depth::DepthSource;
use crate::depth_doubt::{Doubts, LiftedTrack, LiftedTracks, doubts};
use crate::frames::WorldFromCamera;
use crate::result::{DepthDoubt, DepthDoubtReason, PointName};
use crate::suspicion::Suspicion;
use crate::track::lift;

/// How far two sources' depths may be apart: a share of the depth, and metres.
const SAME_DEPTH: (f64, f64) = (0.05, 0.05);
/// A depth is judged by so many views of a segment at most, evenly spaced: more of them show the same again.
const MOST_VIEWS: usize = 250;
/// So many points are named in a sentence.
const NAMED: usize = 8;

/// The answers of another source at the same key frames.
pub(super) struct OtherDepths<'a> {
    pub(super) source: &'a dyn DepthSource,
    pub(super) depths: &'a DepthTable,
}

/// The doubtful key frames, by point and in time; and the factor that nearly all points ask for, where there is one.
pub(super) fn depth_doubts(
    scorer: &Scorer<'_>,
    scored: &Scored,
    others: &[OtherDepths<'_>],
) -> (Vec<DepthDoubt>, Option<(f64, usize, usize)>) {
    let mut found = Vec::new();
    let mut lifted = Lifted { scorer, tracks: Vec::new() };
    let points = &scorer.evaluation.selection.points;
    let mut with_samples = scored.segments.iter().peekable();
    let segments = points.iter().enumerate().flat_map(|(p, of)| (0..of.segments.len()).map(move |s| (p, s)));
    for (place, (point, segment)) in segments.enumerate() {
        let of = &points[point].segments[segment];
        let scored = with_samples.next_if(|s| (s.point, s.segment) == (point, segment));
        let Some(Ok(depth)) = scorer.depths.get(point, segment) else { continue };
        let answers =
            others.iter().filter_map(|o| Some((o.source.name(), o.depths.get(point, segment)?.ok()?.z_m)));
        let apart = |z_m: f64| (z_m - depth.z_m).abs() > SAME_DEPTH.0 * depth.z_m.max(z_m) + SAME_DEPTH.1;
        if let Some((other, z_m)) = answers.clone().find(|(_, z_m)| apart(*z_m)) {
            let doubt = doubt(&points[point], of, depth.z_m, DepthDoubtReason::SourcesDisagree, z_m);
            found.push((place, DepthDoubt { other: Some(other.to_string()), ..doubt }));
        }
        let label_px = points[point].px(of.keyframe);
        let Ok(point_camera_m) = lift(scorer.evaluation.camera, label_px, depth.z_m) else { continue };
        let Ok(at_keyframe) = scorer.placed[of.place] else { continue };
        let alone = answers.count() == 0;
        lifted.tracks.push(Track {
            place,
            point,
            segment,
            z_m: depth.z_m,
            alone,
            point_camera_m,
            at_keyframe,
            squares_px2: scored.map(|s| s.errors.squares_px2()),
        });
    }
    let Doubts { points: doubted, common } = doubts(scorer.evaluation.camera, &lifted);
    for (i, better) in doubted {
        let Track { place, point, segment, z_m, alone, .. } = lifted.tracks[i];
        if !alone {
            continue;
        }
        let of = &points[point].segments[segment];
        let doubt = DepthDoubt {
            error_px: Some(better.error_px),
            error_then_px: Some(better.error_then_px),
            ..doubt(&points[point], of, z_m, DepthDoubtReason::DepthDoubtful, better.factor * z_m)
        };
        found.push((place, doubt));
    }
    found.sort_by_key(|(place, _)| *place);
    let any_alone = lifted.tracks.iter().any(|track| track.alone);
    (found.into_iter().map(|(_, doubt)| doubt).collect(), common.filter(|_| any_alone))
}

fn doubt(
    point: &SelectedPoint<'_>,
    segment: &SelectedSegment,
    depth_z_m: f64,
    reason: DepthDoubtReason,
    other_z_m: f64,
) -> DepthDoubt {
    DepthDoubt {
        point: PointName(point.name.clone()),
        timestamp_ns: point.stamp(segment.keyframe),
        reason,
        depth_z_m,
        other_z_m,
        other: None,
        error_px: None,
        error_then_px: None,
    }
}

/// A key point that is lifted.
struct Track {
    /// Among all segments.
    place: usize,
    point: usize,
    segment: usize,
    z_m: f64,
    /// No other source says a depth.
    alone: bool,
    point_camera_m: Point3<f64>,
    at_keyframe: WorldFromCamera,
    /// Sum of the squared errors of all its samples.
    squares_px2: Option<f64>,
}

/// The key points with their views, which are gathered where they are asked for: those of all would fill the memory.
struct Lifted<'a> {
    scorer: &'a Scorer<'a>,
    tracks: Vec<Track>,
}

impl Lifted<'_> {
    /// Places and labels of the views of a key point.
    fn views(&self, track: &Track) -> impl Iterator<Item = (usize, Pixel)> + '_ {
        let point = &self.scorer.evaluation.selection.points[track.point];
        let segment = &point.segments[track.segment];
        let every = segment.count.div_ceil(MOST_VIEWS).max(1);
        let posed = |(_, place): &(usize, usize)| self.scorer.placed[*place].is_ok();
        let labels = point.samples(segment).step_by(every).filter(posed);
        labels.map(|(label, place)| (place, point.px(label)))
    }
}

impl LiftedTracks for Lifted<'_> {
    fn count(&self) -> usize {
        self.tracks.len()
    }

    fn has_views(&self, track: usize, views: usize) -> bool {
        self.views(&self.tracks[track]).take(views).count() == views
    }

    fn get(&self, track: usize) -> LiftedTrack {
        let track = &self.tracks[track];
        let views: Vec<(usize, Pixel)> = self.views(track).collect();
        LiftedTrack::along(track.point_camera_m, track.at_keyframe, &self.scorer.path, &views)
    }

    fn squares_px2(&self, track: usize) -> Option<f64> {
        self.tracks[track].squares_px2
    }
}

/// What is to be said of them. `source` is the depth source they are about.
pub(super) fn suspicions(
    source: &str,
    of_stream: Option<&str>,
    found: &[DepthDoubt],
    keyframes: usize,
    common: Option<(f64, usize, usize)>,
) -> Vec<Suspicion> {
    let about = of_stream.map_or_else(|| format!("{source} depth"), |s| format!("{source} depth, {s}"));
    let mut list = Vec::new();
    for reason in [DepthDoubtReason::SourcesDisagree, DepthDoubtReason::DepthDoubtful] {
        let of_reason: Vec<&DepthDoubt> = found.iter().filter(|d| d.reason == reason).collect();
        if of_reason.is_empty() {
            continue;
        }
        let message = match reason {
            DepthDoubtReason::SourcesDisagree => "another source says another depth at key frames",
            DepthDoubtReason::DepthDoubtful => {
                "the error at key points grows with the camera's motion as that of a wrong depth"
            }
        };
        let named = of_reason.iter().take(NAMED).map(|d| {
            let other = d.other.as_deref().unwrap_or("fitted");
            format!(
                "{} at {} ns {:.2} m, {other} {:.2} m",
                d.point.0, d.timestamp_ns, d.depth_z_m, d.other_z_m
            )
        });
        let named: Vec<String> = named.collect();
        let more = if of_reason.len() > NAMED { ", ..." } else { "" };
        list.push(
            Suspicion::new(reason.name(), &about, message)
                .evidence(format!("{} of {keyframes}: {}{more}", of_reason.len(), named.join(", ")))
                .advice("points off the floor need `depth` zmap, zcam, mesh, tag or stereo, or must not be labelled"),
        );
    }
    if let Some((factor, n, of)) = common {
        list.push(
            Suspicion::new("depth-scale", &about, "nearly all key points fit another depth by the same factor")
                .evidence(format!("{factor:.2}, {n} of {of}"))
                .advice("the motion has another scale, or the camera is not at the height over the floor that its poses say"),
        );
    }
    list
}
