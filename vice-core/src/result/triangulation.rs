//! What triangulated depth rests on.

/// What the depth of a key frame rests on, where later labels of the point gave it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TriangulatedPart {
    /// Standard deviation of the depth, metres, if nothing but labels were off.
    pub depth_sigma_m: f64,
    /// Widest angle between the ray of the key frame and that of a later label, degrees.
    pub parallax_deg: f64,
    /// How many later labels gave it. None of them is scored.
    pub labels: u64,
    /// RMS of the distances that are left to them, px.
    pub left_px: f64,
}

/// How the depths of a stream came about, where labels gave them; and what such depths cannot show.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct TriangulationPart {
    /// Which labels give depth, and which are scored.
    pub rule: String,
    /// How many labels give depth and are not scored.
    pub labels_for_depth: u64,
    /// Key frames with a depth.
    pub keyframes: u64,
    /// Key frames without one: too little parallax, or rays that do not meet in front of the camera.
    pub keyframes_without_depth: u64,
    /// Median of the deviations of the depths, as a share of each.
    pub median_sigma_share: Option<f64>,
    /// Median of the widest angles, degrees.
    pub median_parallax_deg: Option<f64>,
    /// What the errors of this part cannot show.
    pub cannot_show: String,
}

/// Which labels give depth.
pub(crate) const RULE: &str = "of the labels after each key frame the 1st, 3rd, 5th ... give its depth, and the 2nd, 4th, 6th ... are scored";
/// What such depths cannot show.
pub(crate) const CANNOT_SHOW: &str = "the depth is fitted to the stream's own motion: a wrong scale of the motion, and every other error that looks like another depth, leave no trace here; the error is at least this large";
