//! How a camera turns by its images alone: which frames are decoded, and what they say against gyroscope and poses.

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use vice_core::camera::Camera;
use vice_core::check::clock::{ClockDoubt, ClockOffset, clock_offset, images_finding};
use vice_core::check::hand_eye::{self, Subject, hand_eye};
use vice_core::check::moved::Seen;
use vice_core::check::turning::Turning;
use vice_core::check::{Finding, State};
use vice_core::dataset::Dataset;
use vice_core::time::{Span, Stamp};
use vice_track::Pyramid;
use vice_track::two_view::{followed, turned};

use crate::progress::Progress;

/// Parts of the recording in each of which one run of frames is looked at.
const RUNS: usize = 8;
/// Frames that are decoded, at most, for images of up to this many pixels; fewer for larger ones, at least so many.
const FRAMES: usize = 240;
const PIXELS: f64 = 640.0 * 480.0;
const FEWEST: usize = 80;
/// Frames this far apart are compared: nearer ones turn little, and are passed over.
const APART_S: f64 = 0.05;
/// Frames further apart than this are no neighbours.
const FURTHEST: Span = Span::from_millis(1000);
/// A turn between two frames beyond which points are lost, radians.
const FAST_RAD: f64 = 0.15;
/// A turn that is known less well is not used, radians.
const VAGUE_RAD: f64 = 0.01;

/// What the turns of a camera are compared with.
pub(super) struct Source<'a> {
    pub(super) name: &'a str,
    pub(super) turning: &'a Turning,
    /// The IMU, or the data set's own ground truth.
    pub(super) is_body: bool,
    /// Gyroscopes are off by a constant rate.
    pub(super) is_gyro: bool,
}

/// Findings about the clock and the rotation of a camera, by its images; and how it lies in the body by the first source that
/// tells, gyroscope and ground truth before others.
pub(super) fn look(
    dataset: &dyn Dataset,
    camera: &str,
    sources: &[Source<'_>],
    progress: &Progress<'_>,
) -> (Vec<Finding>, Option<Seen>) {
    let (Ok(frames), Ok(model)) = (dataset.frames(camera), dataset.camera(camera)) else {
        return (Vec::new(), None);
    };
    let unknown = |says: &str| (vec![Finding::new(hand_eye::CHECK.name, camera, State::Unknown, says)], None);
    let Some(first) = sources.first() else {
        return unknown("there are neither poses nor IMU to compare the turns of the images with");
    };
    let runs = runs(&frames, first.turning, budget(&model));
    let Some(turning) = turns(dataset, camera, &model, (&frames, &runs), progress) else {
        return unknown("no two frames lie near enough to each other to follow points");
    };
    let extrinsics = |stamp: Stamp| Some(dataset.body_from_camera(camera, stamp).ok()?.rotation());
    let others: Vec<(String, UnitQuaternion<f64>)> = dataset
        .cameras()
        .into_iter()
        .filter(|name| name != camera)
        .filter_map(|name| {
            let pose = dataset.body_from_camera(&name, *frames.first()?).ok()?;
            Some((name, pose.rotation()))
        })
        .collect();
    let given = frames.first().and_then(|stamp| extrinsics(*stamp));
    let (mut found, mut seen) = (Vec::new(), None::<(bool, Seen)>);
    for source in sources {
        let expected = source.turning.of_frame(extrinsics);
        let answer = clock_offset(expected.as_ref().unwrap_or(source.turning), &turning, None);
        found.push(images_finding(source.name, camera, &answer));
        if let (Some(expected), Some(given)) = (expected, given) {
            let subject =
                Subject { camera, source: source.name, is_body: source.is_body, given, others: &others };
            let answer = hand_eye(&expected, &turning, lag_s(&answer), source.is_gyro);
            found.push(hand_eye::finding(&subject, &answer));
            if let Ok(answer) = &answer
                && seen.as_ref().is_none_or(|(is_body, _)| source.is_body && !is_body)
            {
                seen = Some((source.is_body, Seen::of(source.name, &given, answer)));
            }
        }
    }
    (found, seen.map(|(_, seen)| seen))
}

/// What is added to the camera's stamps, where that is known.
fn lag_s(answer: &Result<ClockOffset, ClockDoubt>) -> f64 {
    answer.as_ref().map_or(0.0, |found| found.offset_s)
}

/// Frames that may be decoded.
fn budget(camera: &Camera) -> usize {
    let pixels = f64::from(camera.width()) * f64::from(camera.height());
    let count = FRAMES as f64 * (PIXELS / pixels.max(1.0)).min(1.0);
    (count as usize).max(FEWEST)
}

/// Runs of frames, as indices: in each part of the recording where the source turns most, and no faster than points can
/// be followed.
fn runs(frames: &[Stamp], source: &Turning, budget: usize) -> Vec<Vec<usize>> {
    let spacing = match frames {
        [first, .., last] => last.since(*first).as_secs_f64() / (frames.len() - 1) as f64,
        _ => return Vec::new(),
    };
    // Of what is recorded unevenly most frames are used anyway.
    let step = (APART_S / spacing.max(1e-4)).floor().max(1.0) as usize;
    let used: Vec<usize> = (0..frames.len()).step_by(step).collect();
    if used.len() <= budget {
        return vec![used];
    }
    let stamps: Vec<Stamp> = used.iter().map(|i| frames[*i]).collect();
    let speeds = source.steps_rad(&stamps);
    let length = (budget / RUNS).max(3);
    let part = used.len() / RUNS;
    (0..RUNS)
        .map(|k| {
            let from = k * part;
            let last = (from + part).min(used.len()) - length.min(part);
            let worth = |start: usize| {
                let inside = &speeds[start..(start + length - 1).min(speeds.len())];
                let usable = |s: &f64| if *s < FAST_RAD { s * s } else { -s * s };
                inside.iter().flatten().map(usable).sum::<f64>()
            };
            // The first of equals.
            let best = (from..=last).rev().max_by(|a, b| worth(*a).total_cmp(&worth(*b))).unwrap_or(from);
            used[best..(best + length).min(used.len())].to_vec()
        })
        .collect()
}

/// The turns between neighbouring frames of the runs; `None` where there are none.
fn turns(
    dataset: &dyn Dataset,
    camera: &str,
    model: &Camera,
    (frames, runs): (&[Stamp], &[Vec<usize>]),
    progress: &Progress<'_>,
) -> Option<Turning> {
    let mut steps = Vec::new();
    let total: usize = runs.iter().map(Vec::len).sum();
    for run in runs {
        // A few at a time, so that memory stays bounded; the last one begins the next few.
        let mut before: Option<(usize, Option<Pyramid>)> = None;
        for few in run.chunks(16) {
            let near = |i: usize, k: usize| frames[k].since(frames[i]) <= FURTHEST;
            let decoded: Vec<(usize, Option<Pyramid>)> = few
                .par_iter()
                .map(|i| {
                    (*i, dataset.image(camera, *i).ok().and_then(|image| Pyramid::for_tracking(&image).ok()))
                })
                .collect();
            let all: Vec<&(usize, Option<Pyramid>)> = before.iter().chain(&decoded).collect();
            let found: Vec<Option<UnitQuaternion<f64>>> = all
                .par_windows(2)
                .map(|pair| match pair {
                    [(i, Some(first)), (k, Some(second))] if near(*i, *k) => turn(first, second, model, *k),
                    _ => None,
                })
                .collect();
            if before.is_none() {
                steps.extend(all.first().map(|(i, _)| (frames[*i], None)));
            }
            steps.extend(all.iter().skip(1).zip(found).map(|((k, _), step)| (frames[*k], step)));
            before = decoded.into_iter().next_back();
            progress("turns of the camera by its images", steps.len(), total);
        }
    }
    steps.iter().any(|(_, step)| step.is_some()).then(|| Turning::of_steps(&steps)).flatten()
}

/// The turn `first_from_second` of the camera; `None` where it is vague.
fn turn(first: &Pyramid, second: &Pyramid, camera: &Camera, seed: usize) -> Option<UnitQuaternion<f64>> {
    let found = turned(&followed(first, second, camera), seed as u64)?;
    (found.sd_rad < VAGUE_RAD)
        .then(|| UnitQuaternion::from_rotation_matrix(&found.second_from_first).inverse())
}
