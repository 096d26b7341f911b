//! RMSE_2D of the labels that hold, with its interval: what stands in the document beside the paper's columns.

use super::PointName;
use crate::time::Stamp;

/// A root mean square with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Figure {
    /// The value.
    pub rmse: f64,
    /// Its interval, low and high; null where there is none.
    pub interval_95: Option<[f64; 2]>,
}

/// What the value and interval of a part rest on.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct HeldPart {
    /// Segments with a sample that holds.
    pub segments: u64,
    /// Points with a sample that holds.
    pub points: u64,
    /// Samples that hold.
    pub samples: u64,
    /// Median error of all scored samples, pixels.
    pub median_px: Option<f64>,
    /// The same error as an angle between the rays of label and carried point, milliradians.
    pub mrad: Option<Figure>,
    /// The same error as a distance at the depth of the carried point, millimetres.
    pub mm: Option<Figure>,
    /// Degrees of freedom of the interval.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub degrees_of_freedom: Option<f64>,
    /// What is to be said of the interval: why there is none, or that it is wide.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub note: Option<String>,
    /// Share of the squared error of all scored samples that the heaviest segment carries.
    pub heaviest_segment_share: f64,
    /// Share of the squared error of all scored samples that the largest 1 % of them carry.
    pub heaviest_percent_share: f64,
    /// What was set aside, by point and in time.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub set_aside: Vec<SetAside>,
}

/// Why labels are set aside.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "kebab-case"))]
#[non_exhaustive]
pub enum AsideReason {
    /// The label jumps against its neighbours in time, and the other points do not.
    LabelJumps,
    /// The point is off from its key frame on, and the other points are not: all of its segment is set aside.
    KeyframeOff,
}

/// A label that does not hold.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SetAside {
    /// Name of the point.
    pub point: PointName,
    /// The frame of the label; the key frame where a segment is set aside.
    pub timestamp_ns: Stamp,
    /// Why.
    pub reason: AsideReason,
    /// By how much it is off, pixels.
    pub off_px: f64,
    /// How many samples go with it.
    pub samples: u64,
}

/// The error at an age since the key frame, or after some motion.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct WindowPart {
    /// Seconds since the key frame.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub age_s: Option<f64>,
    /// Metres that the camera moved since the key frame, along its path.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub moved_m: Option<f64>,
    /// Pixels; null where it is refused.
    pub px: Option<Figure>,
    /// Milliradians between the rays of label and carried point.
    pub mrad: Option<Figure>,
    /// Millimetres at the depth of the carried point.
    pub mm: Option<Figure>,
    /// Segments with a sample in it.
    pub segments: u64,
    /// Samples in it.
    pub samples: u64,
    /// Why there is no number.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub refused: Option<String>,
}

impl HeldPart {
    /// Single labels that were set aside.
    pub fn labels_set_aside(&self) -> usize {
        self.set_aside.iter().filter(|s| s.reason == AsideReason::LabelJumps).count()
    }

    /// Segments that were set aside as a whole.
    pub fn segments_set_aside(&self) -> usize {
        self.set_aside.iter().filter(|s| s.reason == AsideReason::KeyframeOff).count()
    }

    /// Samples that were set aside.
    pub fn samples_set_aside(&self) -> u64 {
        self.set_aside.iter().map(|s| s.samples).sum()
    }
}
