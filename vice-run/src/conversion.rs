//! A pose stream as a trajectory: as it is, read in another convention, or without what a diagnosis found in it.

use std::path::PathBuf;

use vice_core::conventions::{Convention, Given, cure};
use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::diagnose::mend;
use vice_core::error::{DataError, ErrorKind};
use vice_core::evaluate::Stream;
use vice_core::result::Role;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::leniency;
use vice_files::trajectory::ReadOptions;

use crate::diagnosis::DiagnosisResult;
use crate::error::{RunError, RunResult};
use crate::formats;
use crate::imu_start::ImuStart;
use crate::recorded::only_stream;
use crate::request::{DEFAULT_MAX_GAP, DatasetSpec, EstimateSpec, IMU_EULER};

/// Which poses are written, and how they are read.
#[derive(Clone, Debug)]
pub struct Conversion {
    /// The recording.
    pub dataset: DatasetSpec,
    /// A stream of it, or a file of poses; `None`: the ground truth, or the only stream there is.
    pub stream: Option<EstimateSpec>,
    /// What the poses are, where that is not what they are read as.
    pub estimate_as: Vec<Convention>,
    /// A diagnosis whose convention, clock, scale and drift are taken out.
    pub mend: Option<PathBuf>,
}

impl Conversion {
    /// The poses.
    ///
    /// # Errors
    /// [`RunError`] if there is no such stream, or it cannot be mended so.
    pub fn trajectory(&self) -> RunResult<Trajectory> {
        let spec = &self.dataset;
        let dataset = spec.open_raw(&formats::registry(&spec.plugins)?)?;
        // A stream can be written where there is no camera at all.
        let camera = match spec.camera_name(dataset.as_ref()) {
            Ok(camera) => Some(camera),
            Err(error) if spec.camera.is_some() => return Err(error),
            Err(_) => None,
        };
        let stream = match &self.stream {
            Some(stream) => stream.clone(),
            None => EstimateSpec::from(only_stream(dataset.as_ref(), &spec.path)?),
        };
        let name = stream.to_string();
        let is_stream = dataset.streams().contains(&name);
        let file = stream.is_file();
        let mut trajectory = if !is_stream && stream == EstimateSpec::ImuEuler {
            integrated(dataset.as_ref(), camera.as_deref())?
        } else if !is_stream && file {
            let read = stream.read_file(&ReadOptions::default())?;
            leniency::log(&read.suspicions);
            read.trajectory
        } else {
            dataset.trajectory(&name)?
        };
        leniency::log(&dataset.suspicions().into_iter().collect());
        let frames = camera.as_ref().map(|camera| dataset.frames(camera)).transpose()?;
        let extrinsics = |stamp: Stamp| dataset.body_from_camera(camera.as_ref()?, stamp).ok();
        let first_frame = frames.and_then(|frames| frames.first().copied());
        let given = Given { body_from_camera: Some(&extrinsics), first_frame };
        if !self.estimate_as.is_empty() {
            trajectory = cure(&self.estimate_as, &trajectory, given)
                .map_err(|e| RunError::from(e).of("estimate-as"))?;
        }
        if let Some(path) = &self.mend {
            let text = crate::result::read_bytes(path)?;
            let result: DiagnosisResult = serde_json::from_slice(&text).map_err(|e| {
                DataError::of_kind(ErrorKind::Unsupported, "is no diagnosis")
                    .at(path)
                    .hint("write one with `vice diagnose --json FILE`")
                    .because(e)
            })?;
            trajectory =
                mend(&result.diagnosis, &trajectory, given).map_err(|e| RunError::from(e).of("mend"))?;
        }
        Ok(trajectory)
    }
}

/// Frames at which an integration may start, at most: the first may have no velocity.
const FIRST_FRAMES: usize = 10;

/// The IMU integrated from the ground truth's state at the first frame that it covers to the last.
fn integrated(dataset: &dyn Dataset, camera: Option<&str>) -> RunResult<Trajectory> {
    let camera = camera.ok_or_else(|| {
        RunError::usage("stream", format!("{IMU_EULER} starts at a frame, and there is no camera"))
    })?;
    if !dataset.streams().iter().any(|s| s == GROUND_TRUTH) {
        return Err(RunError::usage(
            "stream",
            format!("{IMU_EULER} starts from a state of the ground truth, and there is none"),
        ));
    }
    let reference = Stream::new(GROUND_TRUTH, Role::Reference, dataset.trajectory(GROUND_TRUTH)?);
    let frames = dataset.frames(camera)?;
    let (start, end) = (reference.trajectory.start(), reference.trajectory.end());
    let covered = || frames.iter().copied().filter(|s| (start..=end).contains(s));
    // Velocity is fitted to poses on both sides, so that the very first frame may have none.
    let last = covered().next_back();
    let start = |first: Stamp| {
        let start =
            ImuStart { dataset, reference: &reference, time_offset: Span::ZERO, max_gap: DEFAULT_MAX_GAP };
        start.run(first, last?).ok()
    };
    let (run, gap) = covered().take(FIRST_FRAMES).find_map(start).ok_or_else(|| {
        RunError::missing(format!(
            "{IMU_EULER}: no frame has a state of the ground truth and inertial samples"
        ))
    })?;
    leniency::log(&gap.into_iter().collect());
    run.integrate(Span::ZERO, nalgebra::Vector3::zeros())
        .map_err(|e| RunError::usage("stream", IMU_EULER.to_string()).because(e))
}
