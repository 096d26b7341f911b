//! What an evaluation is given.

use super::{Rig, Selection, Stream};
use crate::camera::Camera;
use crate::depth::DepthSource;
use crate::metrics::align::Alignment;
use crate::time::{Span, Stamp};

/// The widest gap between two poses that is interpolated, where nobody asks for another.
pub const DEFAULT_MAX_GAP: Span = Span::from_millis(100);

/// What is evaluated, and how. Made by [`Evaluation::builder`].
///
/// ```
/// use vice_core::camera::{Camera, Model, Pixel};
/// use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
/// use vice_core::evaluate::{Evaluation, FixedRig, Selection, Stream, Window, evaluate};
/// use vice_core::frames::Rigid;
/// use vice_core::label::{LabelRow, LabelSet, Observation};
/// use vice_core::nalgebra::{UnitQuaternion, Vector3};
/// use vice_core::result::Role;
/// use vice_core::time::Stamp;
/// use vice_core::trajectory::Trajectory;
///
/// /// A wall that fills the image, 4 m away at the key frame.
/// struct Wall;
/// impl DepthSource for Wall {
///     fn name(&self) -> &str { "wall" }
///     fn needs_world(&self, _: &vice_core::dataset::Floor) -> bool { false }
///     fn depths(&self, _: &Keyframe<'_>, pixels: &[Pixel])
///         -> vice_core::error::DataResult<Vec<Result<DepthSample, DepthMiss>>> {
///         Ok(pixels.iter().map(|_| Ok(DepthSample::new(4.0))).collect())
///     }
/// }
///
/// // The camera slides to the right along the wall, 0.1 m a frame. Body and camera are one.
/// let camera = Camera::new(640, 480, [400.0, 400.0, 320.0, 240.0], Model::Pinhole)?;
/// let frames: Vec<Stamp> = (0..10).map(|i| Stamp::from_nanos(i * 50_000_000)).collect();
/// let at = |i: usize, step_m: f64| Rigid::from_parts(Vector3::new(i as f64 * step_m, 0.0, 0.0), UnitQuaternion::identity());
/// let estimate = Trajectory::from_poses(frames.iter().enumerate().map(|(i, t)| (*t, at(i, 0.11))))?;
///
/// // What a person saw: the point moves 10 px to the left a frame.
/// let rows = frames.iter().enumerate().map(|(i, stamp)| LabelRow {
///     point: "a".to_string(),
///     observation: Observation { keyframe: i == 0, ..Observation::manual(*stamp, Pixel::new(400.0 - 10.0 * i as f64, 250.0)) },
/// });
/// let labels = LabelSet::from_rows(rows.collect::<Vec<_>>())?;
///
/// let selection = Selection::new(&labels, &frames, &camera, &Window::default())?;
/// let rig = FixedRig::new(Rigid::identity());
/// let streams = [Stream::new("odometry", Role::Estimate, estimate)];
/// let evaluation = Evaluation::builder(&rig, &camera, &frames, &selection)
///     .streams(&streams)
///     .depths(&[&Wall])
///     .build();
/// let found = evaluate(&evaluation, &|_, _| {})?;
/// // 1 px too far a frame: the RMS of 1, 2, ..., 9.
/// let rmse_px = found.pixel[0].pooled_rmse_px.unwrap();
/// assert!((rmse_px - (285.0_f64 / 9.0).sqrt()).abs() < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
#[non_exhaustive]
pub struct Evaluation<'a> {
    /// Names, the camera's place in the body, and the floor.
    pub rig: &'a dyn Rig,
    /// The camera's intrinsics.
    pub camera: &'a Camera,
    /// The camera's frames, strictly increasing.
    pub frames: &'a [Stamp],
    /// What takes part.
    pub selection: &'a Selection<'a>,
    /// The pose streams, the reference first where there is one.
    pub streams: &'a [Stream],
    /// Index of the stream that places the camera for depth.
    pub anchor: usize,
    /// Each stream places the camera for its own depth: without a reference none of them is better known than the
    /// others, and the order in which they are listed must not matter.
    pub own_anchors: bool,
    /// The depth sources.
    pub depths: &'a [&'a dyn DepthSource],
    /// Further sources, which nothing is scored with: their depths at the key frames are compared.
    pub checks: &'a [&'a dyn DepthSource],
    /// Widest gap between two poses that is interpolated.
    pub max_gap: Span,
    /// Subset sizes; `None` for those up to 3 that exist.
    pub subsets: Option<&'a [usize]>,
    /// Alignment of the trajectory errors.
    pub align: Alignment,
    /// Whether the document lists the scored samples.
    pub keep_samples: bool,
}

impl<'a> Evaluation<'a> {
    /// Starts with what every evaluation needs. `selection` is made of the same camera and frames.
    pub const fn builder(
        rig: &'a dyn Rig,
        camera: &'a Camera,
        frames: &'a [Stamp],
        selection: &'a Selection<'a>,
    ) -> EvaluationBuilder<'a> {
        EvaluationBuilder(Self {
            rig,
            camera,
            frames,
            selection,
            streams: &[],
            anchor: 0,
            own_anchors: false,
            depths: &[],
            checks: &[],
            max_gap: DEFAULT_MAX_GAP,
            subsets: None,
            align: Alignment::Se3,
            keep_samples: false,
        })
    }

    /// Index of the stream that places the camera for the depth of a stream.
    pub const fn anchor_of(&self, stream: usize) -> usize {
        if self.own_anchors { stream } else { self.anchor }
    }
}

/// An [`Evaluation`] in the making. What does not fit together is said by [`evaluate`](super::evaluate()).
#[derive(Clone, Copy)]
#[must_use]
pub struct EvaluationBuilder<'a>(Evaluation<'a>);

impl<'a> EvaluationBuilder<'a> {
    /// The pose streams, the reference first where there is one. At least one is needed.
    pub const fn streams(mut self, streams: &'a [Stream]) -> Self {
        self.0.streams = streams;
        self
    }

    /// The depth sources. Without any, only trajectories are compared.
    pub const fn depths(mut self, depths: &'a [&'a dyn DepthSource]) -> Self {
        self.0.depths = depths;
        self
    }

    /// Sources whose depths at the key frames are compared, and nothing more. By default none.
    pub const fn checks(mut self, checks: &'a [&'a dyn DepthSource]) -> Self {
        self.0.checks = checks;
        self
    }

    /// Index of the stream that places the camera for depth. By default the first.
    pub const fn anchor(mut self, stream: usize) -> Self {
        self.0.anchor = stream;
        self
    }

    /// Whether each stream places the camera for its own depth. By default the anchor does, for all.
    pub const fn own_anchors(mut self, own: bool) -> Self {
        self.0.own_anchors = own;
        self
    }

    /// Widest gap between two poses that is interpolated. By default [`DEFAULT_MAX_GAP`].
    pub const fn max_gap(mut self, max_gap: Span) -> Self {
        self.0.max_gap = max_gap;
        self
    }

    /// Numbers of points of which RMSE_2D is given. By default 1, 2 and 3, as far as there are points.
    pub const fn subsets(mut self, sizes: Option<&'a [usize]>) -> Self {
        self.0.subsets = sizes;
        self
    }

    /// Alignment of the trajectory errors. By default rotation and translation.
    pub const fn align(mut self, alignment: Alignment) -> Self {
        self.0.align = alignment;
        self
    }

    /// Whether the scored samples and the paths are kept. By default not.
    pub const fn keep_samples(mut self, keep: bool) -> Self {
        self.0.keep_samples = keep;
        self
    }

    /// What [`evaluate`](super::evaluate()) takes.
    pub const fn build(self) -> Evaluation<'a> {
        self.0
    }
}
