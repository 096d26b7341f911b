//! A recording with what is needed to ask depth sources about its frames, where nothing is evaluated.

use vice_core::dataset::GROUND_TRUTH;
use vice_core::depth::Keyframe;
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::trajectory::ReadOptions;

use crate::error::{RunError, RunResult};
use crate::in_memory::is_in_memory;
use crate::open::Opened;
use crate::request::{DatasetSpec, ReferenceSpec};

/// The recording and the poses that place its camera.
pub struct Scene {
    /// The recording.
    pub opened: Opened,
    /// What places the camera in the world, where something does.
    pub anchor: Option<Trajectory>,
    /// Widest gap between two poses that is interpolated.
    pub max_gap: Span,
}

impl Scene {
    /// Opens a recording, its camera placed by a reference: the ground truth where there is one and nothing else is said.
    ///
    /// # Errors
    /// [`RunError`] if the recording or the reference cannot be read.
    pub fn open(dataset: &DatasetSpec, reference: &ReferenceSpec, max_gap: Span) -> RunResult<Self> {
        Self::of(dataset.open()?, reference, max_gap)
    }

    /// The same, of a recording that is open.
    ///
    /// # Errors
    /// [`RunError`] if the reference cannot be read.
    pub fn of(opened: Opened, reference: &ReferenceSpec, max_gap: Span) -> RunResult<Self> {
        let streams = opened.dataset.streams();
        let is_stream = |name: &str| streams.iter().any(|s| s == name);
        let anchor = match reference {
            ReferenceSpec::None => None,
            ReferenceSpec::Named(spec) if is_stream(&spec.to_string()) => {
                Some(opened.dataset.trajectory(&spec.to_string())?)
            }
            ReferenceSpec::Named(spec) if is_in_memory(&spec.to_string()) => {
                opened.in_memory.trajectory(&spec.to_string())?.cloned()
            }
            ReferenceSpec::Named(spec) => Some(spec.read_file(&ReadOptions::default())?.trajectory),
            ReferenceSpec::Default if is_stream(GROUND_TRUTH) => {
                Some(opened.dataset.trajectory(GROUND_TRUTH)?)
            }
            ReferenceSpec::Default => None,
        };
        Ok(Self { opened, anchor, max_gap })
    }

    /// A frame as a depth source sees it.
    ///
    /// # Errors
    /// [`RunError`] if the camera's place in the body or the floor is unknown there.
    pub fn keyframe(&self, frame: usize) -> RunResult<Keyframe<'_>> {
        let stamp = self.opened.frames[frame];
        let pose = self.anchor.as_ref().and_then(|t| t.pose_at(stamp, self.max_gap).ok());
        let camera = (self.opened.camera_name.as_str(), &self.opened.camera);
        Ok(Keyframe::at(self.opened.dataset.as_ref(), camera, (frame, stamp), pose)?)
    }

    /// The frame that a text names: an index, or the exact stamp in nanoseconds.
    ///
    /// # Errors
    /// [`RunError`] with the nearest frame, if there is none.
    pub fn frame_at(&self, text: &str) -> RunResult<usize> {
        let frames = &self.opened.frames;
        let number: i64 = text
            .parse()
            .map_err(|_| RunError::usage("at", format!("`{text}` is neither an index nor a stamp")))?;
        if let Some(index) = usize::try_from(number).ok().filter(|i| *i < frames.len()) {
            return Ok(index);
        }
        let stamp = Stamp::from_nanos(number);
        frames.binary_search(&stamp).map_err(|after| {
            let nearest = [after.checked_sub(1), Some(after)]
                .into_iter()
                .flatten()
                .filter_map(|i| frames.get(i))
                .min_by_key(|s| s.since(stamp).abs());
            let nearest = nearest.map_or_else(String::new, |s| format!("; the nearest frame is at {s} ns"));
            RunError::missing(format!(
                "camera {} has {} frames and none at {stamp} ns{nearest}",
                self.opened.camera_name,
                frames.len()
            ))
            .of("at")
        })
    }
}
