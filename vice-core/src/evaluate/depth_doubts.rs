//! Which key frames' depths are doubtful: where another source says another depth, and where none answers, where the
//! point's error grows as that of a wrong depth does.

use super::score::Scorer;
use super::{DepthTable, pixel_key};
use crate::depth::DepthSource;
use crate::depth_doubt::{Doubts, LiftedTrack, doubts};
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
    others: &[OtherDepths<'_>],
) -> (Vec<DepthDoubt>, Option<(f64, usize, usize)>) {
    let mut found = Vec::new();
    let (mut tracks, mut alone) = (Vec::new(), Vec::new());
    let segments =
        scorer.evaluation.selection.points.iter().flat_map(|p| p.segments.iter().map(move |s| (p, s)));
    for (place, (point, segment)) in segments.enumerate() {
        let label = segment.keyframe.observation;
        let key = (segment.keyframe.frame, pixel_key(label.px));
        let Some(Ok(depth)) = scorer.depths.get(&key) else { continue };
        let doubt = |reason, other_z_m| DepthDoubt {
            point: PointName(point.name.clone()),
            timestamp_ns: label.stamp,
            reason,
            depth_z_m: depth.z_m,
            other_z_m,
            other: None,
            error_px: None,
            error_then_px: None,
        };
        let answers: Vec<(&str, f64)> =
            others.iter().filter_map(|o| Some((o.source.name(), o.depths.get(&key)?.ok()?.z_m))).collect();
        let apart = |z_m: f64| (z_m - depth.z_m).abs() > SAME_DEPTH.0 * depth.z_m.max(z_m) + SAME_DEPTH.1;
        if let Some((other, z_m)) = answers.iter().find(|(_, z_m)| apart(*z_m)) {
            let other = Some((*other).to_string());
            found.push((place, DepthDoubt { other, ..doubt(DepthDoubtReason::SourcesDisagree, *z_m) }));
        }
        let Ok(point_camera_m) = lift(scorer.evaluation.camera, label.px, depth.z_m) else { continue };
        let Ok(at_keyframe) = scorer.world_from_camera(segment.keyframe.frame) else { continue };
        let every = segment.samples.len().div_ceil(MOST_VIEWS).max(1);
        let views = segment.samples.iter().step_by(every).filter_map(|s| {
            let now = scorer.world_from_camera(s.frame).ok()?;
            Some((now.inverse() * at_keyframe, s.observation.px))
        });
        tracks.push(LiftedTrack { point_camera_m, views: views.collect() });
        alone.push((place, answers.is_empty(), doubt(DepthDoubtReason::DepthDoubtful, depth.z_m)));
    }
    let Doubts { points, common } = doubts(scorer.evaluation.camera, &tracks);
    for (i, better) in points {
        let (place, true, doubt) = &alone[i] else { continue };
        let doubt = DepthDoubt {
            other_z_m: better.factor * doubt.depth_z_m,
            error_px: Some(better.error_px),
            error_then_px: Some(better.error_then_px),
            ..doubt.clone()
        };
        found.push((*place, doubt));
    }
    found.sort_by_key(|(place, _)| *place);
    let any_alone = alone.iter().any(|(_, alone, _)| *alone);
    (found.into_iter().map(|(_, doubt)| doubt).collect(), common.filter(|_| any_alone))
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
                .advice("points off the floor need `depth` zmap, zcam, mesh or tag, or must not be labelled"),
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
