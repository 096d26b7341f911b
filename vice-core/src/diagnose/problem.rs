//! The residuals of RMSE_2D as a function of the flaws.
//!
//! They are made by the evaluation's own stages, so that with no flaw they are those of `vice evaluate` to the last
//! bit. Depth that depends on a parameter is asked again at each trial value; the answers are kept by these values. That
//! of a rough source is asked where a fit says ([`super::rough`]).

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector2;
use rayon::prelude::*;

use super::DiagnoseError;
use super::flaw::{Flaw, PARAMETER_COUNT, PARAMETERS};
use super::motion::{InertialRun, Motion};
use super::rough::{self, Response};
use super::theta::Theta;
use crate::camera::Camera;
use crate::depth::DepthSource;
use crate::evaluate::trial::{CamerasAtFrames, PosesAtFrames, Trial, TrialDepths};
use crate::evaluate::{EvaluateError, Evaluation};
use crate::time::Stamp;

/// Answers of a depth source that are kept: the columns of a Jacobian ask for the same few again and again.
const KEPT_DEPTHS: usize = 64;

/// A residual: tracked minus label, pixels.
pub(super) type Residual = Vector2<f64>;

/// A scored label that takes part in the fits.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ScoredLabel {
    /// Index of the point, by order of appearance.
    pub(super) point: usize,
    /// Name of the point.
    pub(super) name: Arc<str>,
    /// When.
    pub(super) stamp: Stamp,
    /// Its key frame.
    pub(super) keyframe: Stamp,
}

/// What the depth of the key frames depends on, as bits: a key.
type DepthKey = [u64; PARAMETER_COUNT];

/// One stream with one depth source.
pub(super) struct Problem<'a> {
    camera: &'a Camera,
    source: &'a dyn DepthSource,
    trial: Trial<'a>,
    motion: Motion<'a>,
    /// The estimate itself places the camera for depth.
    own_anchor: bool,
    /// [`DepthSource::roughness`].
    roughness: f64,
    anchor_poses: PosesAtFrames,
    stamps: Vec<Stamp>,
    cameras: CamerasAtFrames,
    depths: Mutex<BTreeMap<DepthKey, Arc<TrialDepths>>>,
    pub(super) labels: Vec<ScoredLabel>,
    index: HashMap<(Arc<str>, Stamp), usize>,
    /// Labels of each segment whose depth has an error of its own: all of a rough source, none of others.
    pub(super) rough_segments: Vec<Vec<usize>>,
    /// The scored residuals with no flaw: those of RMSE_2D.
    pub(super) base: Vec<Residual>,
    /// The fitted residuals with no flaw.
    pub(super) base_fitted: Vec<Residual>,
}

impl<'a> Problem<'a> {
    pub(super) fn new(
        evaluation: &'a Evaluation<'a>,
        stream: usize,
        depth: usize,
        inertial: Option<&'a InertialRun>,
    ) -> Result<Self, DiagnoseError> {
        let trial = Trial::new(evaluation);
        let stamps = trial.stamps();
        let (Some(first), Some(last)) = (stamps.first(), stamps.last()) else {
            return Err(EvaluateError::EmptyWindow.into());
        };
        evaluation.streams[stream].check_overlap((*first, *last))?;
        let cameras = trial.cameras().map_err(EvaluateError::Data)?;
        let max_gap = evaluation.max_gap;
        let motion = Motion { trajectory: &evaluation.streams[stream].trajectory, inertial, max_gap };
        let anchor = &evaluation.streams[evaluation.anchor].trajectory;
        let mut problem = Self {
            camera: evaluation.camera,
            source: evaluation.depths[depth],
            trial,
            motion,
            own_anchor: evaluation.anchor == stream,
            roughness: evaluation.depths[depth].roughness(),
            anchor_poses: stamps.iter().map(|s| anchor.pose_at(*s, max_gap)).collect(),
            stamps,
            cameras,
            depths: Mutex::new(BTreeMap::new()),
            labels: Vec::new(),
            index: HashMap::new(),
            rough_segments: Vec::new(),
            base: Vec::new(),
            base_fitted: Vec::new(),
        };
        let keyframes = keyframes_of(evaluation);
        let mut names: Vec<Arc<str>> = Vec::new();
        for (name, stamp, residual) in
            problem.tracked(&Theta::zero(), &*problem.depths_at(&Theta::zero())?)?
        {
            if names.last() != Some(&name) {
                names.push(Arc::clone(&name));
            }
            let keyframe = keyframes.get(&(Arc::clone(&name), stamp)).copied().unwrap_or(stamp);
            problem.index.insert((Arc::clone(&name), stamp), problem.labels.len());
            problem.labels.push(ScoredLabel { point: names.len() - 1, name, stamp, keyframe });
            problem.base.push(residual);
        }
        if problem.roughness > 0.0 {
            let mut segments: BTreeMap<(usize, Stamp), Vec<usize>> = BTreeMap::new();
            for (i, label) in problem.labels.iter().enumerate() {
                segments.entry((label.point, label.keyframe)).or_default().push(i);
            }
            problem.rough_segments = segments.into_values().collect();
        }
        problem.base_fitted = problem.residuals(&Theta::zero(), &Theta::zero())?;
        Ok(problem)
    }

    /// Number of points with a scored label.
    pub(super) fn point_count(&self) -> usize {
        self.labels.last().map_or(0, |l| l.point + 1)
    }

    /// The scored residuals, in the order of the labels, with the depth of the key frames as it is at `asked_at`.
    ///
    /// A label that a trial value cannot score (the stream ends there, the point falls behind the camera) keeps the
    /// residual that it has with no flaw: losing labels must not look like an improvement.
    pub(super) fn scored(&self, theta: &Theta, asked_at: &Theta) -> Result<Vec<Residual>, DiagnoseError> {
        self.scored_with(theta, &*self.depths_at(asked_at)?)
    }

    /// The residuals that are fitted: the scored ones, and where the depth is rough without the depth error of each
    /// segment, these errors behind them in their deviations. Depth that is not rough is asked at `theta`.
    pub(super) fn residuals(&self, theta: &Theta, asked_at: &Theta) -> Result<Vec<Residual>, DiagnoseError> {
        if self.roughness <= 0.0 {
            return self.scored(theta, theta);
        }
        let depths = self.depths_at(asked_at)?;
        let at = |share: f64| self.scored_with(theta, &depths.times(1.0 + share));
        let (nearer, mut residuals, farther) = (at(-rough::SHARE)?, at(0.0)?, at(rough::SHARE)?);
        let mut pulls = Vec::with_capacity(self.rough_segments.len());
        for segment in &self.rough_segments {
            let responses: Vec<Response> =
                segment.iter().map(|i| Response::new(nearer[*i], residuals[*i], farther[*i])).collect();
            let share = rough::depth_error(&responses, self.roughness);
            segment.iter().zip(&responses).for_each(|(i, response)| residuals[*i] = response.at(share));
            pulls.push(Residual::new(share / self.roughness, 0.0));
        }
        residuals.extend(pulls);
        Ok(residuals)
    }

    /// Whether the rough depth at two values differs by more than its roughness, in the middle of the key frames.
    pub(super) fn depth_moved(&self, theta: &Theta, asked_at: &Theta) -> Result<bool, DiagnoseError> {
        Ok(self.roughness > 0.0
            && self.depths_at(theta)?.typical_change(&*self.depths_at(asked_at)?) > self.roughness)
    }

    fn scored_with(&self, theta: &Theta, depths: &TrialDepths) -> Result<Vec<Residual>, DiagnoseError> {
        let mut residuals = self.base.clone();
        for (name, stamp, residual) in self.tracked(theta, depths)? {
            if let Some(at) = self.index.get(&(name, stamp)) {
                residuals[*at] = residual;
            }
        }
        Ok(residuals)
    }

    /// Derivatives of the residuals by some parameters, by central differences: one column for each. Differences wider
    /// than the usual step see past the bumps of a depth that is not smooth.
    pub(super) fn jacobian(
        &self,
        theta: &Theta,
        asked_at: &Theta,
        parameters: &[usize],
        wider: f64,
    ) -> Result<Vec<Vec<Residual>>, DiagnoseError> {
        parameters
            .par_iter()
            .map(|parameter| {
                let step = wider * PARAMETERS[*parameter].step;
                let at = |sign: f64| {
                    let mut moved = *theta;
                    moved[*parameter] += sign * step;
                    self.residuals(&moved, asked_at)
                };
                let (above, below) = (at(1.0)?, at(-1.0)?);
                Ok(above.iter().zip(&below).map(|(a, b)| (a - b) / (2.0 * step)).collect())
            })
            .collect()
    }

    fn tracked(
        &self,
        theta: &Theta,
        depths: &TrialDepths,
    ) -> Result<Vec<(Arc<str>, Stamp, Residual)>, DiagnoseError> {
        let (camera, cameras, poses) = self.view(theta)?;
        let samples = self.trial.samples(&camera, &cameras, &poses, depths);
        Ok(samples
            .into_iter()
            .map(|s| {
                let residual = Vector2::new(s.tracked_px.u - s.label_px.u, s.tracked_px.v - s.label_px.v);
                (s.point.0, s.timestamp_ns, residual)
            })
            .collect())
    }

    /// The camera, its extrinsics and the poses of the body with the flaws taken out.
    fn view(&self, theta: &Theta) -> Result<(Camera, CamerasAtFrames, PosesAtFrames), DiagnoseError> {
        let refused = |why: String| DiagnoseError::CannotEvaluate(why);
        let camera = theta.correct_camera(self.camera).map_err(|e| refused(e.to_string()))?;
        let cameras = self.cameras.iter().map(|c| c.map(|c| theta.correct_extrinsics(&c))).collect();
        let poses = self.motion.poses_at(theta, &self.stamps).map_err(|e| refused(e.to_string()))?;
        Ok((camera, cameras, poses))
    }

    /// Depths of the key frames with the flaws taken out.
    fn depths_at(&self, theta: &Theta) -> Result<Arc<TrialDepths>, DiagnoseError> {
        let key = self.depth_key(theta);
        let kept = || self.depths.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(depths) = kept().get(&key) {
            return Ok(Arc::clone(depths));
        }
        let (camera, cameras, poses) = self.view(theta)?;
        let anchor = if self.own_anchor { &poses } else { &self.anchor_poses };
        let depths = Arc::new(self.trial.depths(self.source, &camera, &cameras, anchor)?);
        let mut kept = kept();
        if kept.len() >= KEPT_DEPTHS {
            kept.clear();
        }
        kept.insert(key, Arc::clone(&depths));
        Ok(depths)
    }

    /// The parameters that the depth depends on: those of the estimate only where it is its own anchor.
    fn depth_key(&self, theta: &Theta) -> DepthKey {
        let mut key = [0; PARAMETER_COUNT];
        for flaw in Flaw::ALL {
            let of_the_camera = matches!(
                flaw,
                Flaw::ExtrinsicRotation
                    | Flaw::ExtrinsicTranslation
                    | Flaw::FocalLength
                    | Flaw::PrincipalPoint
            );
            if of_the_camera || self.own_anchor {
                flaw.parameters().for_each(|p| key[p] = (theta[p] + 0.0).to_bits());
            }
        }
        key
    }
}

/// The key frame of each sample that may be scored.
fn keyframes_of(evaluation: &Evaluation<'_>) -> BTreeMap<(Arc<str>, Stamp), Stamp> {
    let mut keyframes = BTreeMap::new();
    for segment in evaluation.selection.keyframes() {
        let name: Arc<str> = segment.point.into();
        for (observation, _) in segment.samples() {
            keyframes.insert((Arc::clone(&name), observation.stamp), segment.keyframe.stamp);
        }
    }
    keyframes
}

/// The root of the mean squared length, pixels.
pub(super) fn rmse_px(residuals: &[Residual]) -> f64 {
    (residuals.iter().map(Vector2::norm_squared).sum::<f64>() / residuals.len().max(1) as f64).sqrt()
}
