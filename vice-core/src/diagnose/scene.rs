//! The labels of an evaluation as plain arrays, and their residuals as a function of the flaws.
//!
//! Equation 1 by the core's own cameras and depth sources. The RMSE_2D that a diagnosis prints is that of the evaluation's
//! stages; here all segments take part, whichever convention the poses turn out to have, and poses may be smoothed.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

use crate::parallel::*;
use nalgebra::Vector2;

use super::DiagnoseError;
use super::flaw::{Flaw, PARAMETERS};
use super::motion::{Motion, Reader};
use super::theta::Theta;
use crate::camera::{Camera, Pixel};
use crate::dataset::Floor;
use crate::depth::{DepthSource, Keyframe};
use crate::evaluate::trial::Trial;
use crate::evaluate::{EvaluateError, Evaluation};
use crate::frames::{BodyFromCamera, WorldFromBody};
use crate::time::Stamp;

/// Where a label's key point is carried minus the label, pixels.
pub(super) type Residual = Vector2<f64>;

/// What a label costs that cannot be carried at all (behind the camera, no depth), pixels a coordinate.
pub(super) const LOST_PX: f64 = 400.0;
/// Depths of the segments' key points, metres along the optical axis.
type Depths = Arc<Vec<Option<f64>>>;
/// Poses at the frames.
type Poses = Arc<Vec<WorldFromBody>>;

/// Answers of a depth source that are kept.
const KEPT_DEPTHS: usize = 96;

/// Poses at the frames that are kept.
const KEPT_POSES: usize = 8;

/// A frame with a key frame or a label.
#[derive(Clone, Debug)]
pub(super) struct Frame {
    pub(super) stamp: Stamp,
    /// Since the camera's first frame.
    pub(super) t_s: f64,
    /// Among the camera's frames.
    pub(super) index: usize,
    pub(super) body_from_camera: Option<BodyFromCamera>,
    pub(super) floor: Option<Floor>,
}

/// A key point and the labels that follow it.
#[derive(Clone, Debug)]
pub(super) struct Segment {
    pub(super) point: usize,
    pub(super) frame: usize,
    pub(super) px: Pixel,
    pub(super) labels: std::ops::Range<usize>,
}

/// A label that is scored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Label {
    pub(super) segment: usize,
    pub(super) frame: usize,
    pub(super) px: Pixel,
}

/// Everything that does not change with the estimate.
pub(super) struct Scene<'a> {
    pub(super) camera: &'a Camera,
    pub(super) source: &'a dyn DepthSource,
    pub(super) own_anchor: bool,
    pub(super) first_frame: Stamp,
    pub(super) frames: Vec<Frame>,
    pub(super) segments: Vec<Segment>,
    pub(super) labels: Vec<Label>,
    /// The anchor's stream; none where the estimate is its own anchor.
    pub(super) anchor: Option<Motion<'a>>,
    /// Whether each frame has a pose of the anchor.
    anchored: Vec<bool>,
    /// Share of a depth that is noise.
    pub(super) roughness: f64,
    /// Whether the depth does not depend on where the camera is thought to be.
    pub(super) fixed_depth: bool,
    kept: Mutex<HashMap<Vec<u64>, Depths>>,
    /// Poses at the frames that were read last: most flaws are not the motion's.
    kept_poses: Mutex<Vec<(Vec<u64>, Poses)>>,
}

/// When a row is exposed, as a share of the read-out time from the middle row.
pub(super) fn row_share(camera: &Camera, px: Pixel) -> f64 {
    px.v / f64::from(camera.height()) - 0.5
}

impl<'a> Scene<'a> {
    pub(super) fn new(
        evaluation: &'a Evaluation<'a>,
        stream: usize,
        depth: usize,
    ) -> Result<Self, DiagnoseError> {
        let first_frame = evaluation.frames.first().copied().ok_or(EvaluateError::NoFrames)?;
        let trial = Trial::new(evaluation);
        let cameras = trial.cameras().map_err(EvaluateError::Data)?;
        let anchor_index = evaluation.anchor_of(stream);
        let own_anchor = anchor_index == stream;
        let mut frames = Vec::new();
        let mut at = BTreeMap::new();
        for (index, body_from_camera) in trial.frame_indices().iter().zip(cameras) {
            let stamp = evaluation.frames[*index];
            at.insert(*index, frames.len());
            let t_s = stamp.since(first_frame).as_secs_f64();
            frames.push(Frame { stamp, t_s, index: *index, body_from_camera, floor: None });
        }
        let (mut segments, mut labels) = (Vec::new(), Vec::new());
        let mut names: Vec<&str> = Vec::new();
        for keyframe in evaluation.selection.keyframes() {
            if names.last() != Some(&keyframe.point) {
                names.push(keyframe.point);
            }
            let Some(frame) = at.get(&keyframe.frame).copied() else { continue };
            let from = labels.len();
            for (observation, index) in keyframe.samples() {
                if let Some(now) = at.get(&index).copied() {
                    labels.push(Label { segment: segments.len(), frame: now, px: observation.px });
                }
            }
            if labels.len() > from {
                frames[frame].floor = evaluation.rig.floor(frames[frame].stamp).ok();
                let point = names.len() - 1;
                segments.push(Segment { point, frame, px: keyframe.keyframe.px, labels: from..labels.len() });
            }
        }
        let anchor = &evaluation.streams[anchor_index].trajectory;
        let anchored = frames.iter().map(|f| anchor.pose_at(f.stamp, evaluation.max_gap).is_ok()).collect();
        let source = evaluation.depths[depth];
        let mut scene = Self {
            camera: evaluation.camera,
            source,
            own_anchor,
            first_frame,
            frames,
            segments,
            labels,
            anchor: (!own_anchor).then(|| Motion {
                poses: super::motion::Poses::new(anchor, first_frame),
                inertial: None,
                first_frame,
                id: 0,
            }),
            anchored,
            roughness: source.roughness(),
            fixed_depth: false,
            kept: Mutex::default(),
            kept_poses: Mutex::default(),
        };
        scene.fixed_depth = scene.roughness > 0.0 || scene.depth_is_fixed(evaluation, stream)?;
        Ok(scene)
    }

    /// With some labels left out.
    pub(super) fn only(&mut self, keep: &[bool]) {
        let (mut segments, mut labels) = (Vec::new(), Vec::new());
        for segment in &self.segments {
            let from = labels.len();
            for i in segment.labels.clone().filter(|i| keep[*i]) {
                labels.push(Label { segment: segments.len(), ..self.labels[i] });
            }
            if labels.len() > from {
                segments.push(Segment { labels: from..labels.len(), ..segment.clone() });
            }
        }
        (self.segments, self.labels) = (segments, labels);
        self.kept = Mutex::default();
    }

    /// Without some of the points, evenly in their order, where more are followed at once.
    pub(super) fn thin(&mut self, most: usize) {
        let mut change = vec![0_i64; self.frames.len() + 1];
        for segment in &self.segments {
            change[segment.frame] += 1;
            change[self.labels[segment.labels.end - 1].frame] -= 1;
        }
        let mut now = 0;
        let at_once = change.iter().map(|c| {
            now += c;
            now
        });
        let every = (at_once.max().unwrap_or(0).max(0) as usize).div_ceil(most.max(1)).max(1);
        if every > 1 {
            let keep: Vec<bool> =
                self.labels.iter().map(|l| self.segments[l.segment].point.is_multiple_of(every)).collect();
            self.only(&keep);
        }
    }

    /// Whether a camera turned and moved by a little changes no depth.
    fn depth_is_fixed(&self, evaluation: &Evaluation<'_>, stream: usize) -> Result<bool, DiagnoseError> {
        let poses = super::motion::Poses::new(&evaluation.streams[stream].trajectory, self.first_frame);
        let motion = Motion { poses, inertial: None, first_frame: self.first_frame, id: u64::MAX };
        let depths = |theta: &Theta| -> Result<Vec<Option<f64>>, DiagnoseError> {
            let reader = motion.reader(theta).map_err(EvaluateError::Data)?;
            self.ask(theta, &reader, 4)
        };
        let as_is = depths(&Theta::zero())?;
        let moved = Theta::zero()
            .with(Flaw::ExtrinsicRotation, &[2e-3, 1e-3, 0.0])
            .with(Flaw::ExtrinsicTranslation, &[0.01, 0.01, 0.01])
            .with(Flaw::FocalLength, &[2e-3]);
        let moved = depths(&moved)?;
        // Where nothing has depth (poses of another convention look at the sky) nothing is known: it is asked again.
        let both: Vec<(f64, f64)> =
            as_is.iter().zip(&moved).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
        Ok(!both.is_empty() && both.iter().all(|(a, b)| (a - b).abs() <= 1e-9 * a.abs()))
    }

    /// Poses at the frames.
    pub(super) fn poses(&self, theta: &Theta, reader: &Reader<'_>, motion: &Motion<'_>) -> Poses {
        let key = |theta: &Theta| {
            let mut key = vec![motion.id];
            for flaw in Flaw::ALL.iter().filter(|f| f.of_the_motion()) {
                key.extend(theta.of(*flaw).iter().map(|v| (v + 0.0).to_bits()));
            }
            key
        };
        self.kept_or(key(theta), || {
            // A scale and a velocity move what is read: reading is what takes time.
            let unscaled = theta.with(Flaw::Scale, &[0.0]).with(Flaw::Drift, &[0.0; 4]);
            let turns = theta.of(Flaw::Drift)[3] != 0.0;
            if turns || unscaled == *theta {
                return self.frames.iter().map(|f| reader.at(f.t_s)).collect();
            }
            let read = self
                .kept_or(key(&unscaled), || self.frames.iter().map(|f| reader.unscaled_at(f.t_s)).collect());
            let frames = self.frames.iter().zip(&*read);
            frames.map(|(f, pose)| reader.put_back(*pose, f.t_s)).collect()
        })
    }

    /// Poses that are kept under a key, or those that are made, which are kept then.
    fn kept_or(&self, key: Vec<u64>, make: impl FnOnce() -> Vec<WorldFromBody>) -> Poses {
        let kept = || self.kept_poses.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, poses)) = kept().iter().find(|(k, _)| *k == key) {
            return Arc::clone(poses);
        }
        let poses: Poses = Arc::new(make());
        let mut kept = kept();
        if kept.len() >= KEPT_POSES {
            kept.remove(0);
        }
        kept.push((key, Arc::clone(&poses)));
        poses
    }

    /// Depths of the segments' key points.
    pub(super) fn depths(
        &self,
        theta: &Theta,
        reader: &Reader<'_>,
        motion: &Motion<'_>,
    ) -> Result<Depths, DiagnoseError> {
        let mut key = Vec::new();
        let camera_moves = |f: &Flaw| f.of_the_camera() || *f == Flaw::RollingShutter || self.own_anchor;
        if !self.fixed_depth {
            for flaw in Flaw::ALL.iter().filter(|f| camera_moves(f)) {
                key.extend(theta.of(*flaw).iter().map(|v| (v + 0.0).to_bits()));
            }
        }
        if self.own_anchor {
            key.push(motion.id);
        }
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(depths) = kept().get(&key) {
            return Ok(Arc::clone(depths));
        }
        let at = if self.fixed_depth { &Theta::zero() } else { theta };
        let depths = Arc::new(self.ask(at, reader, usize::MAX)?);
        let mut kept = kept();
        if kept.len() >= KEPT_DEPTHS {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&depths));
        Ok(depths)
    }

    /// Asks the source, for the first key frames at most.
    fn ask(&self, theta: &Theta, own: &Reader<'_>, most: usize) -> Result<Vec<Option<f64>>, DiagnoseError> {
        let camera =
            theta.correct_camera(self.camera).map_err(|e| DiagnoseError::CannotEvaluate(e.to_string()))?;
        let readout_s = theta.of(Flaw::RollingShutter)[0];
        let mut by_frame: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (i, segment) in self.segments.iter().enumerate() {
            by_frame.entry(segment.frame).or_default().push(i);
        }
        let anchor = match &self.anchor {
            Some(anchor) => Some(anchor.reader(&Theta::zero()).map_err(EvaluateError::Data)?),
            None => None,
        };
        let reader = anchor.as_ref().unwrap_or(own);
        let one =
            |(frame, segments): (&usize, &Vec<usize>)| -> Result<Vec<(usize, Option<f64>)>, DiagnoseError> {
                let at = &self.frames[*frame];
                let (Some(body_from_camera), Some(floor)) = (at.body_from_camera, at.floor) else {
                    return Ok(vec![]);
                };
                let body_from_camera = theta.correct_extrinsics(&body_from_camera);
                let asked = |t_s: f64, pixels: &[Pixel]| {
                    let pose = self.anchored[*frame].then(|| reader.at(t_s) * body_from_camera);
                    let keyframe = Keyframe {
                        stamp: at.stamp,
                        frame: at.index,
                        camera: &camera,
                        body_from_camera,
                        world_from_camera: pose,
                        floor,
                    };
                    self.source.depths(&keyframe, pixels).map_err(EvaluateError::Data)
                };
                let mut found = Vec::new();
                if readout_s == 0.0 {
                    let pixels: Vec<Pixel> = segments.iter().map(|s| self.segments[*s].px).collect();
                    let depths = asked(at.t_s, &pixels)?;
                    found.extend(
                        segments.iter().copied().zip(depths.iter().map(|d| d.as_ref().ok().map(|d| d.z_m))),
                    );
                } else {
                    for s in segments {
                        let px = self.segments[*s].px;
                        let depths = asked(at.t_s + readout_s * row_share(&camera, px), &[px])?;
                        let depth = depths.first().and_then(|d| d.as_ref().ok()).map(|d| d.z_m);
                        found.push((*s, depth));
                    }
                }
                Ok(found)
            };
        let answers: Vec<_> = if self.roughness > 0.0 {
            by_frame.par_iter().map(one).collect::<Result<_, _>>()?
        } else {
            by_frame.iter().take(most).map(one).collect::<Result<Vec<_>, _>>()?
        };
        let mut depths = vec![None; self.segments.len()];
        for (segment, depth) in answers.into_iter().flatten() {
            depths[segment] = depth.filter(|z| *z > 0.0 && z.is_finite());
        }
        Ok(depths)
    }

    /// Derivatives of the residuals by some parameters, by central differences: one column for each. Labels that cannot
    /// be carried do not answer.
    pub(super) fn columns(
        &self,
        theta: &Theta,
        motion: &Motion<'_>,
        parameters: &[usize],
    ) -> Result<Vec<Vec<Residual>>, DiagnoseError> {
        let column = |parameter: &usize| {
            let step = PARAMETERS[*parameter].step;
            let at = |sign: f64| {
                let mut moved = *theta;
                moved[*parameter] += sign * step;
                self.residuals(&moved, motion)
            };
            let (above, below) = (at(1.0)?, at(-1.0)?);
            let difference = |(a, b): (&Residual, &Residual)| {
                let slope = (a - b) / (2.0 * step);
                if slope.x.is_nan() { Residual::zeros() } else { slope }
            };
            Ok(above.iter().zip(&below).map(difference).collect())
        };
        match parameters.len() {
            0..=1 => parameters.iter().map(column).collect(),
            _ => parameters.par_iter().map(column).collect(),
        }
    }
}
