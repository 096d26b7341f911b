//! What `vice check` calls wrong of what is evaluated: said beside the numbers, never mended by itself.

use vice_core::check::clock::{self, clock_offset};
use vice_core::check::turning::Turning;
use vice_core::check::{Finding, State, inertial, motion, optics, path};
use vice_core::conventions::Given;
use vice_core::dataset::GROUND_TRUTH;
use vice_core::evaluate::Stream;
use vice_core::result::Role;
use vice_core::suspicion::Suspicion;
use vice_core::time::{Span, Stamp};

use crate::open::Opened;

/// Longer streams are left to `vice check`: an evaluation should not wait for it.
const MOST_POSES: usize = 200_000;
/// Clock offsets that are looked at, seconds to either side.
const RANGE_S: f64 = 1.0;

/// What is wrong with the camera and with streams, each against the reference, or against the IMU where there is no
/// reference. `integrated` is the stream that comes from the reference and the IMU themselves.
pub(super) fn wrong(opened: &Opened, streams: &[Stream], integrated: Option<usize>) -> Vec<Suspicion> {
    let mut said = camera(opened);
    let checked: Vec<&Stream> = streams
        .iter()
        .enumerate()
        .filter(|(at, stream)| Some(*at) != integrated && stream.trajectory.len() <= MOST_POSES)
        .map(|(_, stream)| stream)
        .collect();
    let (references, estimates): (Vec<_>, Vec<_>) =
        checked.into_iter().partition(|s| s.role == Role::Reference);
    let extrinsics = |stamp: Stamp| opened.dataset.body_from_camera(&opened.camera_name, stamp).ok();
    let given = Given { body_from_camera: Some(&extrinsics), first_frame: opened.frames.first().copied() };
    for stream in references.iter().chain(&estimates) {
        said.extend(suspicions(path::path(&stream.name, &stream.trajectory)));
    }
    if let Some(reference) = references.first() {
        let truth = (reference.name.as_str(), &reference.trajectory);
        let turning = Turning::of_poses(&reference.trajectory);
        for stream in &estimates {
            let answer = turning
                .as_ref()
                .and_then(|t| Some(clock_offset(t, &Turning::of_poses(&stream.trajectory)?, Some(RANGE_S))));
            if let Some(answer) = &answer {
                let late = suspicions(vec![clock::finding(truth.0, &stream.name, answer)]);
                said.extend(late.into_iter().map(|suspicion| beside(suspicion, stream.time_offset)));
            }
            let offset = answer.and_then(Result::ok).map_or(Span::ZERO, |found| found.span());
            said.extend(suspicions(motion::motion(truth, (&stream.name, &stream.trajectory), offset, given)));
        }
    } else if let Ok(imu) = opened.dataset.imu()
        && !imu.is_empty()
    {
        let gyro = Turning::of_gyro(&imu);
        for stream in &estimates {
            let answer = gyro
                .as_ref()
                .and_then(|g| clock_offset(g, &Turning::of_poses(&stream.trajectory)?, Some(RANGE_S)).ok());
            let poses = (stream.name.as_str(), &stream.trajectory);
            let is_truth = stream.name == GROUND_TRUTH;
            said.extend(suspicions(inertial::inertial(
                &imu,
                poses,
                answer.map_or(Span::ZERO, |found| found.span()),
                is_truth,
                given,
            )));
        }
    }
    said
}

/// What is wrong with the calibration of the camera that is evaluated.
fn camera(opened: &Opened) -> Vec<Suspicion> {
    let name = opened.camera_name.as_str();
    let mut found = opened.dataset.camera(name).map(|c| optics::intrinsics(name, &c)).unwrap_or_default();
    if let Some(stamp) = opened.frames.first()
        && let Ok(pose) = opened.dataset.body_from_camera(name, *stamp)
    {
        found.push(optics::extrinsics(name, &pose));
    }
    suspicions(found)
}

/// Those that are wrong: what is only to be looked at is left to `vice check`.
fn suspicions(found: Vec<Finding>) -> Vec<Suspicion> {
    found.iter().filter(|f| f.state == State::Wrong).filter_map(Finding::suspicion).collect()
}

/// What was added to the stamps already is part of what mends them.
fn beside(mut suspicion: Suspicion, added: Span) -> Suspicion {
    if added != Span::ZERO {
        suspicion
            .advice
            .push_str(&format!(" beside the {} s that are added already", added.to_seconds_text()));
    }
    suspicion
}
