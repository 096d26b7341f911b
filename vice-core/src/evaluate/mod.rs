//! The pipeline, and the only list of its stages.
//!
//! 1. [`Selection`]: the frames and labels of the window; a label at no frame is counted, not lost.
//! 2. Poses: each stream at each of these frames, or the reason why it has none.
//! 3. Depth: each source once per key frame, for all its pixels, with the camera placed by the anchor; shared by all
//!    streams, so that they differ by their motion only.
//! 4. Tracking and scoring: equation 1 for each segment, distance to the labels, squared errors by point.
//! 5. RMSE_2D over subsets of the points; RMSE_3D, AOE and ROE of each estimate against the reference.
//!
//! No image is decoded on the way.

mod carry;
mod columns;
mod curves;
mod depth_doubts;
mod depths;
mod input;
mod kept;
mod path_doubts;
mod rig;
mod runs;
mod score;
mod select;
mod since;
mod sparse;
mod spread;
mod streams;
#[cfg(feature = "serde")]
pub(crate) mod trial;
mod triangulated;
mod windows;

pub use input::{DEFAULT_MAX_GAP, Evaluation, EvaluationBuilder};
pub use rig::{DatasetRig, FixedRig, Rig};
pub use select::{Observations, SelectedKeyframe, Selection, Window};
pub use streams::Stream;
pub use triangulated::TriangulatedDepth;

use depth_doubts::{OtherDepths, depth_doubts};
use depths::{DepthTable, SourceDepths};
use score::Scorer;
use streams::PosesAtFrames;
use triangulated::Split;
use windows::Windows;

use crate::error::{DataError, DataResult};
use crate::frames::BodyFromCamera;
use crate::metrics::pixel::{pooled_rmse_px, subset_rmse_px};
use crate::result::{DatasetPart, Evaluated, PixelPart, PointName, Role, Sample, Skip};
use crate::skip::SkipReason;
use crate::suspicion::Suspicions;
use crate::time::Stamp;

/// Why nothing could be evaluated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// The camera has no frames.
    #[error("the camera has no frames")]
    NoFrames,
    /// There are no labels.
    #[error("there are no labels")]
    NoLabels,
    /// A label lies outside the image.
    #[error("{}label of point {point} at {stamp} ns lies at ({u_px}, {v_px}) px, outside the {width}x{height} image",
        line.map_or_else(String::new, |l| format!("line {l}: ")))]
    LabelOutside {
        /// The point.
        point: String,
        /// The frame.
        stamp: Stamp,
        /// To the right.
        u_px: f64,
        /// Downwards.
        v_px: f64,
        /// Columns of the image.
        width: u32,
        /// Rows of the image.
        height: u32,
        /// Line of the labels file, where known.
        line: Option<u64>,
    },
    /// No label is at a frame.
    #[error("none of the labels is at a frame: labels {} to {} ns, frames {} to {} ns{}",
        labels.0, labels.1, frames.0, frames.1, suspicion.as_ref().map_or_else(String::new, |s| format!(" ({s})")))]
    NoLabelAtFrame {
        /// First and last label.
        labels: (Stamp, Stamp),
        /// First and last frame.
        frames: (Stamp, Stamp),
        /// A unit that may be mixed up.
        suspicion: Option<String>,
    },
    /// No labelled frame lies in the window.
    #[error("no label lies in the part of the run that was asked for")]
    EmptyWindow,
    /// No point has a key frame.
    #[error("no label is marked as a key frame, so that there is nothing to carry along")]
    NoKeyframe,
    /// No key frame is manual.
    #[error("no key frame is manual, so that no manual label can be scored by itself")]
    NoManualKeyframe,
    /// Every key frame is flagged as uncertain.
    #[error("every key frame is flagged as uncertain, so that no label can be scored")]
    NoCertainKeyframe,
    /// More points are asked for than there are.
    #[error("subsets of {asked} points were asked for, but there are {points} points")]
    SubsetTooLarge {
        /// What was asked for.
        asked: usize,
        /// How many points there are.
        points: usize,
    },
    /// There is no pose stream, or the anchor is none of them.
    #[error("no pose stream is there to evaluate")]
    NoStream,
    /// A stream has no pose within the evaluated frames.
    #[error("stream {stream} and the evaluated frames do not overlap in time: poses {} to {} ns, frames {} to {} ns{}",
        poses.0, poses.1, frames.0, frames.1, suspicion.as_ref().map_or_else(String::new, |s| format!(" ({s})")))]
    NoOverlap {
        /// The stream.
        stream: String,
        /// First and last pose.
        poses: (Stamp, Stamp),
        /// First and last evaluated frame.
        frames: (Stamp, Stamp),
        /// A unit that may be mixed up.
        suspicion: Option<String>,
    },
    /// Triangulated depth and another one were asked for together.
    #[error("triangulated depth is fitted to each stream's own motion and cannot stand beside other depths")]
    MixedDepths,
    /// The scored samples could not be handed on.
    #[error("the samples cannot be written")]
    Samples(#[source] std::io::Error),
    /// The data set could not be read.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// Takes the scored samples of one point, of the pose stream and depth source that are named.
pub type SampleSink<'a> = dyn FnMut(&str, &str, &[Sample]) -> std::io::Result<()> + 'a;

/// Runs the pipeline. `progress` is called with (done, total) as key frames and streams are finished.
///
/// # Errors
/// [`EvaluateError`] if nothing could be evaluated; what only some labels lack is counted in the document.
pub fn evaluate(
    evaluation: &Evaluation<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Evaluated, EvaluateError> {
    run(evaluation, progress, None)
}

/// [`evaluate`], but the samples go to `sink` as they come, in the order in which the document would list them, and
/// are not kept: memory is that of a few points.
///
/// # Errors
/// As [`evaluate`], and where the sink fails.
pub fn evaluate_streaming(
    evaluation: &Evaluation<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
    sink: &mut SampleSink<'_>,
) -> Result<Evaluated, EvaluateError> {
    run(evaluation, progress, Some(sink))
}

fn run(
    evaluation: &Evaluation<'_>,
    progress: &(dyn Fn(usize, usize) + Sync),
    mut sink: Option<&mut SampleSink<'_>>,
) -> Result<Evaluated, EvaluateError> {
    let split = match (evaluation.depths, evaluation.checks) {
        ([only], []) if only.needs_track() => Some(Split::of(evaluation.selection)),
        (depths, checks) if depths.iter().chain(checks).any(|d| d.needs_track()) => {
            return Err(EvaluateError::MixedDepths);
        }
        _ => None,
    };
    let evaluation = &match &split {
        Some(split) => Evaluation { selection: &split.scored, ..*evaluation },
        None => *evaluation,
    };
    let selection = evaluation.selection;
    let sizes = subset_sizes(evaluation.subsets, selection.point_count())?;
    let frames_range = selection.stamp_range(evaluation.frames).ok_or(EvaluateError::EmptyWindow)?;
    for stream in evaluation.streams {
        stream.check_overlap(frames_range)?;
    }
    if evaluation.anchor >= evaluation.streams.len() {
        return Err(EvaluateError::NoStream);
    }
    let cameras = extrinsics(evaluation)?;
    let poses: Vec<_> = evaluation
        .streams
        .iter()
        .map(|s| s.poses_at(evaluation.frames, &selection.frames, evaluation.max_gap))
        .collect();

    let stamps: Vec<Stamp> = selection.frames.iter().map(|frame| evaluation.frames[*frame]).collect();
    // How far the camera moved is the reference's word, where there is one: an estimate may have another scale.
    let reference = evaluation.streams.iter().position(|s| s.role == Role::Reference);
    let path_m = reference.map(|stream| spread::path_m(&poses[stream], &cameras));

    let mut suspicions = Suspicions::new();
    let placing: Vec<&PosesAtFrames> = match evaluation.own_anchors {
        true => poses.iter().collect(),
        false => vec![&poses[evaluation.anchor]],
    };
    let sources = evaluation.depths.len() + evaluation.checks.len();
    let total = sources + evaluation.depths.len() * evaluation.streams.len();
    let mut done = 0;
    let mut step = || {
        done += 1;
        progress(done, total);
    };
    let mut known = Vec::with_capacity(sources);
    for source in evaluation.depths {
        known.push(match &split {
            Some(split) => {
                let by = |poses| split.depths(evaluation, &cameras, poses);
                SourceDepths::triangulated(*source, poses.iter().map(by).collect())
            }
            None => SourceDepths::ask(evaluation, *source, &cameras, &placing)?,
        });
        step();
    }
    for source in evaluation.checks {
        match SourceDepths::ask(evaluation, *source, &cameras, &placing) {
            Ok(depths) => known.push(depths),
            Err(error) => suspicions.add(depths::check_failed(*source, &error)),
        }
        step();
    }
    let mut pixel = Vec::new();
    let mut room = Vec::new();
    for (place, source) in evaluation.depths.iter().enumerate() {
        // Depths are shared, so that one look by the best motion there is, the reference's, is enough.
        let mut by_reference = None;
        for (index, (stream, poses)) in evaluation.streams.iter().zip(&poses).enumerate() {
            let to_sink: Option<score::TakePoint<'_>> = match &mut sink {
                Some(sink) => Some(&mut |samples| sink(&stream.name, source.name(), samples)),
                None => None,
            };
            let moved_m = path_m.as_ref().map_or_else(|| spread::path_m(poses, &cameras), Clone::clone);
            let windows = Windows { stamps: &stamps, moved_m: &moved_m };
            let scorer = Scorer {
                keep_samples: evaluation.keep_samples || to_sink.is_some(),
                windows: Some(&windows),
                ..Scorer::new(evaluation, &cameras, poses, known[place].of(index))
            };
            let mut scored = score::score(&scorer, to_sink, &mut room).map_err(EvaluateError::Samples)?;
            let rmse_px = subset_rmse_px(&scored.errors, &sizes);
            let spread = spread::spread(&scorer, &scored, &windows);
            let samples = scored.errors.iter().map(|e| e.count).sum();
            let about = format!("{}, {} depth", stream.name, source.name());
            suspicions.extend(spread::suspicions(&about, &spread, samples));
            let doubts = match &by_reference {
                // A depth that was fitted to the labels fits them.
                _ if split.is_some() => vec![],
                Some(doubts) => Vec::clone(doubts),
                None => {
                    let (doubts, common) = depth_doubts(&scorer, &scored, &others(&known, place, index));
                    let own = reference.is_none().then_some(stream.name.as_str());
                    let keyframes = scored.keyframes.len();
                    suspicions.extend(depth_doubts::suspicions(
                        source.name(),
                        own,
                        &doubts,
                        keyframes,
                        common,
                    ));
                    doubts
                }
            };
            if Some(index) == reference {
                by_reference = Some(doubts.clone());
            }
            pixel.push(PixelPart {
                stream: stream.name.clone(),
                role: stream.role,
                depth: source.name().to_string(),
                rmse_px,
                pooled_rmse_px: pooled_rmse_px(&scored.errors),
                held_rmse_px: spread.held_rmse_px,
                interval_95: spread.interval_95,
                held: spread.held,
                by_age: spread.by_age,
                by_distance: spread.by_distance,
                scored: samples,
                skipped: scored.skipped,
                keyframes: scored.keyframes,
                depth_doubts: doubts,
                triangulation: split.as_ref().map(|split| split.part(known[place].of(index))),
                samples: scored.samples,
            });
            room = std::mem::take(&mut scored.columns);
            step();
        }
    }
    let (trajectory, paths) = curves::trajectories(evaluation, &poses, &mut suspicions);
    Ok(Evaluated {
        dataset: DatasetPart {
            name: evaluation.rig.name().to_string(),
            format: evaluation.rig.format().to_string(),
            camera: evaluation.rig.camera_name().to_string(),
            image_size_px: Some([evaluation.camera.width(), evaluation.camera.height()]),
            first_frame_ns: evaluation.frames.first().copied(),
        },
        pixel,
        trajectory,
        paths,
        suspicions: all_suspicions(evaluation, suspicions),
    })
}

/// What looked wrong in the data, the depth sources and the pose streams, each said once. Asked when all was read.
fn all_suspicions(evaluation: &Evaluation<'_>, found: Suspicions) -> Suspicions {
    let mut list: Suspicions = evaluation.rig.suspicions().into_iter().collect();
    list.extend(evaluation.depths.iter().flat_map(|source| source.suspicions()));
    list.extend(evaluation.streams.iter().filter_map(|stream| {
        sparse::suspicion(stream, evaluation.selection, evaluation.frames, evaluation.max_gap)
    }));
    list.extend(found);
    list
}

/// The sources that a source's depths are compared with: all others that measure.
fn others<'a>(known: &'a [SourceDepths<'a>], place: usize, stream: usize) -> Vec<OtherDepths<'a>> {
    let others = known.iter().enumerate().filter(|(i, k)| *i != place && !k.source.is_assumed());
    others.map(|(_, k)| OtherDepths { source: k.source, depths: k.of(stream) }).collect()
}

fn subset_sizes(asked: Option<&[usize]>, points: usize) -> Result<Vec<usize>, EvaluateError> {
    match asked {
        None => Ok((1..=points.min(3)).collect()),
        Some(sizes) => match sizes.iter().find(|s| **s > points || **s == 0) {
            Some(asked) => Err(EvaluateError::SubsetTooLarge { asked: *asked, points }),
            None => Ok(sizes.to_vec()),
        },
    }
}

/// Extrinsics at the selected frames. A frame without is skipped and counted; only where all lack them it is an error.
fn extrinsics(evaluation: &Evaluation<'_>) -> DataResult<Vec<Option<BodyFromCamera>>> {
    let mut first_error = None;
    let mut found = Vec::with_capacity(evaluation.selection.frames.len());
    for frame in &evaluation.selection.frames {
        match evaluation.rig.body_from_camera(evaluation.frames[*frame]) {
            Ok(body_from_camera) => found.push(Some(body_from_camera)),
            Err(error) => {
                first_error.get_or_insert(error);
                found.push(None);
            }
        }
    }
    match first_error {
        Some(error) if found.iter().all(Option::is_none) => Err(error),
        Some(error) => {
            let lacking = found.iter().filter(|f| f.is_none()).count();
            tracing::warn!("{lacking} of {} frames have no camera pose in the body: {error}", found.len());
            Ok(found)
        }
        None => Ok(found),
    }
}

fn skip(point: &PointName, stamp: Stamp, reason: SkipReason) -> Skip {
    Skip { point: point.clone(), timestamp_ns: stamp, reason }
}

#[cfg(test)]
mod tests;
