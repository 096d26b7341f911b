//! Why a label was not scored.

use crate::camera::ProjectError;
use crate::depth::DepthMiss;
use crate::trajectory::NoPose;

/// The reason of labels that a human marked as hidden: not scored, and not counted against the run.
pub const OCCLUDED: &str = "occluded";

/// The reason of labels that a machine made where only manual ones were asked for: not counted against the run either.
pub const NOT_MANUAL: &str = "not-manual";

/// The reason of labels whose maker is not sure of them: not counted against the run either.
pub const UNCERTAIN: &str = "uncertain";

/// The reason of a label whose point was carried behind the camera.
pub const BEHIND_CAMERA: &str = "behind-camera";

/// The reason of a label whose point was carried further to the side than the distortion model reaches.
pub const OUTSIDE_MODEL: &str = "outside-model";

/// Why a label was not scored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[non_exhaustive]
pub enum SkipReason {
    /// Its stamp is no frame of the camera.
    NoFrame,
    /// The stamp of its key frame is no frame of the camera.
    KeyframeNoFrame,
    /// No key frame precedes it.
    BeforeFirstKeyframe,
    /// A human marked it as hidden.
    Occluded,
    /// A machine made it, and only manual labels were asked for.
    NotManual,
    /// A machine made its key frame, and only manual labels were asked for.
    KeyframeNotManual,
    /// Whoever made it is not sure, and only certain labels were asked for.
    Uncertain,
    /// Whoever made its key frame is not sure, and only certain labels were asked for.
    KeyframeUncertain,
    /// The stream has no pose at its key frame.
    KeyframeGap,
    /// Its frame lies in too wide a gap of the stream.
    FrameGap,
    /// Its frame lies before the stream's first pose.
    BeforeStream,
    /// Its frame lies after the stream's last pose.
    AfterStream,
    /// The camera's place in the body is not known at its frame or key frame.
    NoExtrinsics,
    /// The key frame's pixel has no depth.
    NoDepth(DepthMiss),
    /// The carried point is not in front of the camera.
    BehindCamera,
    /// The carried point is so far to the side that the distortion model does not reach it.
    OutsideModel,
}

impl SkipReason {
    /// The name in documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoFrame => "no-frame",
            Self::KeyframeNoFrame => "keyframe-no-frame",
            Self::BeforeFirstKeyframe => "before-first-keyframe",
            Self::Occluded => OCCLUDED,
            Self::NotManual => NOT_MANUAL,
            Self::KeyframeNotManual => "keyframe-not-manual",
            Self::Uncertain => UNCERTAIN,
            Self::KeyframeUncertain => "keyframe-uncertain",
            Self::KeyframeGap => "keyframe-gap",
            Self::FrameGap => "frame-gap",
            Self::BeforeStream => "before-stream",
            Self::AfterStream => "after-stream",
            Self::NoExtrinsics => "no-extrinsics",
            Self::BehindCamera => BEHIND_CAMERA,
            Self::OutsideModel => OUTSIDE_MODEL,
            Self::NoDepth(miss) => match miss {
                DepthMiss::NoAnchor => "keyframe-no-anchor",
                DepthMiss::AboveHorizon => "keyframe-above-horizon",
                DepthMiss::OutsideModel => "keyframe-outside-model",
                DepthMiss::OutsideImage => "keyframe-outside-image",
                DepthMiss::EmptyView => "keyframe-empty-view",
                DepthMiss::OutsideHull => "keyframe-outside-hull",
                DepthMiss::TriangleTooWide => "keyframe-triangle-too-wide",
                DepthMiss::OcclusionEdge => "keyframe-occlusion-edge",
                DepthMiss::NoDepth => "keyframe-no-depth",
                DepthMiss::OutOfRange => "keyframe-depth-out-of-range",
                DepthMiss::NoSurface => "keyframe-no-surface",
                DepthMiss::NoTarget => "keyframe-no-target",
            },
        }
    }

    pub(super) const fn of_frame(no_pose: NoPose) -> Self {
        match no_pose {
            NoPose::BeforeStart => Self::BeforeStream,
            NoPose::AfterEnd => Self::AfterStream,
            NoPose::Gap { .. } => Self::FrameGap,
        }
    }

    pub(super) const fn of_projection(error: ProjectError) -> Self {
        match error {
            ProjectError::BehindCamera => Self::BehindCamera,
            ProjectError::OutsideModel => Self::OutsideModel,
        }
    }
}
