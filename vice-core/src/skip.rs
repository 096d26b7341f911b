//! Why a label was not scored.

use std::fmt;
use std::str::FromStr;

use crate::camera::ProjectError;
use crate::depth::DepthMiss;
use crate::trajectory::NoPose;

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
    /// All reasons.
    const ALL: [Self; 30] = [
        Self::NoFrame,
        Self::KeyframeNoFrame,
        Self::BeforeFirstKeyframe,
        Self::Occluded,
        Self::NotManual,
        Self::KeyframeNotManual,
        Self::Uncertain,
        Self::KeyframeUncertain,
        Self::KeyframeGap,
        Self::FrameGap,
        Self::BeforeStream,
        Self::AfterStream,
        Self::NoExtrinsics,
        Self::BehindCamera,
        Self::OutsideModel,
        Self::NoDepth(DepthMiss::NoAnchor),
        Self::NoDepth(DepthMiss::AboveHorizon),
        Self::NoDepth(DepthMiss::OutsideModel),
        Self::NoDepth(DepthMiss::OutsideImage),
        Self::NoDepth(DepthMiss::EmptyView),
        Self::NoDepth(DepthMiss::OutsideHull),
        Self::NoDepth(DepthMiss::TriangleTooWide),
        Self::NoDepth(DepthMiss::OcclusionEdge),
        Self::NoDepth(DepthMiss::NoDepth),
        Self::NoDepth(DepthMiss::OutOfRange),
        Self::NoDepth(DepthMiss::NoSurface),
        Self::NoDepth(DepthMiss::NoTarget),
        Self::NoDepth(DepthMiss::NoMatch),
        Self::NoDepth(DepthMiss::LittleParallax),
        Self::NoDepth(DepthMiss::RaysApart),
    ];

    /// Whether somebody left the label out on purpose: no gap in the data.
    pub const fn is_wanted(self) -> bool {
        matches!(self, Self::Occluded | Self::NotManual | Self::Uncertain)
    }

    /// Whether the stream carried the point out of the camera's reach: a finding about the stream.
    pub const fn is_carried_away(self) -> bool {
        matches!(self, Self::BehindCamera | Self::OutsideModel)
    }

    /// The name in documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::NoFrame => "no-frame",
            Self::KeyframeNoFrame => "keyframe-no-frame",
            Self::BeforeFirstKeyframe => "before-first-keyframe",
            Self::Occluded => "occluded",
            Self::NotManual => "not-manual",
            Self::KeyframeNotManual => "keyframe-not-manual",
            Self::Uncertain => "uncertain",
            Self::KeyframeUncertain => "keyframe-uncertain",
            Self::KeyframeGap => "keyframe-gap",
            Self::FrameGap => "frame-gap",
            Self::BeforeStream => "before-stream",
            Self::AfterStream => "after-stream",
            Self::NoExtrinsics => "no-extrinsics",
            Self::BehindCamera => "behind-camera",
            Self::OutsideModel => "outside-model",
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
                DepthMiss::NoMatch => "keyframe-no-match",
                DepthMiss::LittleParallax => "keyframe-little-parallax",
                DepthMiss::RaysApart => "keyframe-rays-apart",
            },
        }
    }

    pub(crate) const fn of_frame(no_pose: NoPose) -> Self {
        match no_pose {
            NoPose::BeforeStart => Self::BeforeStream,
            NoPose::AfterEnd => Self::AfterStream,
            NoPose::Gap { .. } => Self::FrameGap,
        }
    }

    pub(crate) const fn of_projection(error: ProjectError) -> Self {
        match error {
            ProjectError::BehindCamera => Self::BehindCamera,
            ProjectError::OutsideModel => Self::OutsideModel,
        }
    }
}

impl fmt::Display for SkipReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A word that is no reason.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{0}` is no reason for leaving out a label")]
pub struct UnknownReason(String);

impl FromStr for SkipReason {
    type Err = UnknownReason;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        Self::ALL.into_iter().find(|r| r.name() == word).ok_or_else(|| UnknownReason(word.to_string()))
    }
}

#[cfg(feature = "serde")]
impl serde::Serialize for SkipReason {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

#[cfg(feature = "serde")]
impl<'de> serde::Deserialize<'de> for SkipReason {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <String as serde::Deserialize>::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_reason_is_read_back_from_its_own_word() {
        let mut words: Vec<&str> = SkipReason::ALL.iter().map(|r| r.name()).collect();
        for reason in SkipReason::ALL {
            assert_eq!(reason.name().parse(), Ok(reason));
        }
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), SkipReason::ALL.len(), "two reasons share a word");
        assert!("tired".parse::<SkipReason>().is_err());
    }
}
