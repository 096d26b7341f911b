//! Pose streams as they are given, where nothing is scored: no anchor, no labels.

use vice_core::evaluate::Stream;
use vice_core::result::Role;
use vice_core::suspicion::Suspicions;

use super::{Loader, stream_name};
use crate::error::{RunError, RunResult};
use crate::open::Opened;
use crate::request::{EstimateSpec, IMU_EULER, StreamsSpec};

/// The reference where there is one, and the estimates.
pub(crate) struct GivenStreams {
    /// The reference first, where there is one.
    pub(crate) list: Vec<Stream>,
    /// What looks wrong with their files.
    pub(crate) suspicions: Suspicions,
}

impl StreamsSpec {
    /// Loads the streams without labels.
    ///
    /// # Errors
    /// [`RunError`] if a stream is not there or cannot be read, a setting fits none of them, or the IMU is to be integrated.
    pub(crate) fn load_given(&self, opened: &Opened) -> RunResult<GivenStreams> {
        if self.anchor.is_some() || self.initial_pose.is_some() {
            let field = if self.anchor.is_some() { "anchor" } else { "initial-pose" };
            return Err(RunError::usage(field, "places a camera for depth, which is not asked for here"));
        }
        let mut loader = Loader::new(self, opened, None);
        loader.reference = loader.load_reference()?;
        let mut list: Vec<Stream> = loader.reference.iter().cloned().collect();
        for (place, spec) in self.estimates.iter().enumerate() {
            if *spec == EstimateSpec::ImuEuler && !loader.is_stream(IMU_EULER) {
                return Err(RunError::usage(
                    "estimate",
                    format!("{IMU_EULER} starts at the first key frame, and there are no labels"),
                )
                .advise("the IMU itself is looked at without being named"));
            }
            let trajectory = loader.estimate(spec)?;
            let name = self.names.get(place).cloned().unwrap_or_else(|| stream_name(spec, &list));
            let time_offset = loader.time_offset;
            list.push(Stream { name, role: Role::Estimate, trajectory, time_offset, align: None });
        }
        if !self.estimates.is_empty() {
            loader.check_used()?;
        }
        Ok(GivenStreams { list, suspicions: loader.suspicions })
    }
}
