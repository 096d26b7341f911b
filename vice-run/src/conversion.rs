//! A pose stream as a trajectory: as it is, read in another convention, or without what a diagnosis found in it.

use std::path::PathBuf;

use vice_core::conventions::{Convention, Given, cure};
use vice_core::diagnose::mend;
use vice_core::error::{DataError, ErrorKind};
use vice_core::time::Stamp;
use vice_core::trajectory::Trajectory;
use vice_files::leniency;
use vice_files::trajectory::ReadOptions;

use crate::diagnosis::DiagnosisResult;
use crate::error::{RunError, RunResult};
use crate::formats;
use crate::request::{DatasetSpec, EstimateSpec};

/// Which poses are written, and how they are read.
#[derive(Clone, Debug)]
pub struct Conversion {
    /// The recording.
    pub dataset: DatasetSpec,
    /// A stream of it, or a file of poses.
    pub stream: EstimateSpec,
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
        let name = self.stream.to_string();
        let is_stream = dataset.streams().contains(&name);
        let file = self.stream.is_file();
        let mut trajectory = if !is_stream && file {
            let read = self.stream.read_file(&ReadOptions::default())?;
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
