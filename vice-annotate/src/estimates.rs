//! What pose streams and depth add to labelling: projected dots, expected places, depth.

use std::collections::BTreeMap;

use serde::Serialize;
use vice_core::camera::Pixel;
use vice_core::error::DataResult;
use vice_core::label::LabelSet;

/// Whether a stream is the reference or an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StreamKind {
    /// What estimates are compared with.
    Reference,
    /// An estimate of the robot's own.
    OnBoard,
}

/// A pose stream and how far its dots are from the labels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProjectedStream {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: StreamKind,
    /// Mean RMSE_2D by number of points, pixels; `None` where nothing is scored yet.
    pub rmse_px: Option<BTreeMap<usize, f64>>,
}

/// Where a stream carries a point.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Dot {
    /// Position of the stream in the list.
    pub stream: usize,
    /// The point.
    pub point: String,
    /// Index of the frame.
    pub frame: usize,
    /// To the right, pixels.
    pub u: f64,
    /// Downwards, pixels.
    pub v: f64,
    /// Distance to the label, pixels.
    pub error_px: Option<f64>,
}

/// Labels that have no dot, by reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SkipCount {
    /// Why, as in result documents.
    pub reason: String,
    /// How many.
    pub count: usize,
}

/// The dots of all streams.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Projections {
    /// The streams.
    pub streams: Vec<ProjectedStream>,
    /// Their dots.
    pub dots: Vec<Dot>,
    /// What has none.
    pub skips: Vec<SkipCount>,
}

/// Pose streams and a depth source, as the program was started with. Called from threads that may wait.
pub trait Estimates: Send + Sync {
    /// Names of the streams that are projected; none where only depth is known.
    fn streams(&self) -> Vec<String>;

    /// Whether depth comes from the floor, so that points should lie on it.
    fn uses_floor(&self) -> bool;

    /// The dots of labels.
    ///
    /// # Errors
    /// [`vice_core::error::DataError`] if the labels cannot be evaluated. That nothing is scored yet is no error.
    fn project(&self, labels: &LabelSet) -> DataResult<Projections>;

    /// Depths of pixels of a frame along the optical axis, metres; `None` where there is none.
    ///
    /// # Errors
    /// [`vice_core::error::DataError`] if the data behind the depth source cannot be read.
    fn depths(&self, frame: usize, pixels: &[Pixel]) -> DataResult<Vec<Option<f64>>>;

    /// Whether what is seen at pixels of a frame is the floor, as far as a depth camera or a scan of the scene can tell;
    /// `None` where there is neither, or depth does not come from the floor. Asked once for many pixels.
    fn on_floor(&self, frame: usize, pixels: &[Pixel]) -> Option<Vec<bool>>;

    /// Where a stream expects the point in frame `to` that is seen at a pixel of frame `from`.
    fn expect(&self, from: usize, px: Pixel, to: usize) -> Option<Pixel>;
}
