//! Key frames whose depth is doubtful.

use super::PointName;
use crate::time::Stamp;

/// Why a depth is doubtful.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum DepthDoubtReason {
    /// Another source says another depth.
    SourcesDisagree,
    /// The point's error grows with the camera's motion as that of a wrong depth does.
    DepthDoubtful,
}

/// A key frame whose depth is doubtful: it is scored all the same.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct DepthDoubt {
    /// Name of the point.
    pub point: PointName,
    /// The key frame.
    pub timestamp_ns: Stamp,
    /// Why.
    pub reason: DepthDoubtReason,
    /// The depth that was used, metres along the optical axis.
    pub depth_z_m: f64,
    /// The depth that another source says, or that would explain the error, metres.
    pub other_z_m: f64,
    /// The other source, where it is one.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub other: Option<String>,
    /// Median error of the point's samples with the depth that was used, pixels, where the error tells it.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub error_px: Option<f64>,
    /// The same with the depth that explains it best.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub error_then_px: Option<f64>,
}

impl DepthDoubtReason {
    /// The name in tables and documents.
    pub const fn name(self) -> &'static str {
        match self {
            Self::SourcesDisagree => "sources-disagree",
            Self::DepthDoubtful => "depth-doubtful",
        }
    }
}
