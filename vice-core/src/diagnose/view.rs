//! The scene as it is with some flaws taken out: where points are, and how their pixels answer.

use std::sync::Arc;

use nalgebra::{Point3, Vector3};

use super::DiagnoseError;
use super::carry::{CameraNumbers, residuals_px};
use super::flaw::Flaw;
use super::motion::Motion;
use super::motion::Reader;
use super::scene::{Label, Residual, Scene, Segment, row_share};
use super::theta::Theta;
use crate::camera::{Camera, Pixel};
use crate::depth::Keyframe;
use crate::frames::{BodyFromCamera, WorldFromBody, WorldFromCamera};

/// The scene as it is with some flaws taken out.
pub(super) struct View<'s, 'a> {
    pub(super) scene: &'s Scene<'a>,
    pub(super) camera: Camera,
    pub(super) reader: Reader<'s>,
    pub(super) readout_s: f64,
    pub(super) at_frames: Arc<Vec<WorldFromBody>>,
    pub(super) cameras: Vec<Option<BodyFromCamera>>,
    /// The cameras in the world, where all rows are exposed at once.
    placed: Vec<Option<WorldFromCamera>>,
    /// Key points in the world; none without depth.
    pub(super) points: Vec<Option<Point3<f64>>>,
}

impl<'a> Scene<'a> {
    /// Residuals with the flaws taken out; NaN where a label cannot be carried.
    pub(super) fn residuals(
        &self,
        theta: &Theta,
        motion: &Motion<'_>,
    ) -> Result<Vec<Residual>, DiagnoseError> {
        Ok(self.view(theta, motion)?.residuals())
    }

    pub(super) fn view<'s>(
        &'s self,
        theta: &Theta,
        motion: &'s Motion<'_>,
    ) -> Result<View<'s, 'a>, DiagnoseError> {
        let refused = |why: String| DiagnoseError::CannotEvaluate(why);
        let camera = theta.correct_camera(self.camera).map_err(|e| refused(e.to_string()))?;
        let reader = motion.reader(theta).map_err(|e| refused(e.to_string()))?;
        let depths = self.depths(theta, &reader, motion)?;
        let readout_s = theta.of(Flaw::RollingShutter)[0];
        let at_frames = self.poses(theta, &reader, motion);
        let cameras: Vec<Option<BodyFromCamera>> =
            self.frames.iter().map(|f| f.body_from_camera.map(|c| theta.correct_extrinsics(&c))).collect();
        let place = |(body, camera): (&WorldFromBody, &Option<BodyFromCamera>)| camera.map(|c| *body * c);
        let placed = match readout_s == 0.0 {
            true => at_frames.iter().zip(&cameras).map(place).collect(),
            false => vec![],
        };
        let mut view =
            View { scene: self, camera, reader, readout_s, at_frames, cameras, placed, points: vec![] };
        view.points = self
            .segments
            .iter()
            .zip(depths.iter())
            .map(|(segment, depth)| {
                let ray = view.camera.unproject(segment.px).ok()?;
                let camera = view.world_from_camera(segment.frame, segment.px)?;
                Some(camera.transform_point(&Point3::from(ray * (*depth)?)))
            })
            .collect();
        Ok(view)
    }
}

impl View<'_, '_> {
    /// The camera when the row of a pixel is exposed.
    pub(super) fn world_from_camera(&self, frame: usize, px: Pixel) -> Option<WorldFromCamera> {
        if self.readout_s == 0.0 {
            return self.placed[frame];
        }
        let body_from_camera = self.cameras[frame]?;
        let t_s = self.scene.frames[frame].t_s + self.readout_s * row_share(&self.camera, px);
        Some(self.reader.at(t_s) * body_from_camera)
    }

    pub(super) fn extrinsics(&self, frame: usize) -> Option<BodyFromCamera> {
        self.cameras[frame]
    }

    /// Where each label's point is carried minus the label, pixels; NaN where it cannot be carried.
    pub(super) fn residuals(&self) -> Vec<Residual> {
        let at_frames: Vec<Option<CameraNumbers>> =
            self.placed.iter().map(|camera| camera.as_ref().map(CameraNumbers::of)).collect();
        let camera = |label: &Label| match at_frames.get(label.frame) {
            Some(numbers) => *numbers,
            None => self.world_from_camera(label.frame, label.px).as_ref().map(CameraNumbers::of),
        };
        let asked = |label: &Label| Some((camera(label)?, self.points[label.segment]?, label.px));
        residuals_px(&self.camera, self.scene.labels.iter().map(asked))
    }

    /// How a label's pixel moves with its point in the world (pixels a metre), and the lever from the body to the point.
    pub(super) fn answer(&self, label: &Label) -> Option<([Vector3<f64>; 2], Vector3<f64>)> {
        let point = self.points[label.segment]?;
        let camera = self.world_from_camera(label.frame, label.px)?;
        let local = camera.rotation().inverse() * (point.coords - camera.translation());
        let step = 1e-4 * local.norm().max(1e-3);
        let mut by_local = [Vector3::zeros(); 2];
        for axis in 0..3 {
            let mut at = [local, local];
            at[0][axis] -= step;
            at[1][axis] += step;
            let below = self.camera.project(&Point3::from(at[0])).ok()?;
            let above = self.camera.project(&Point3::from(at[1])).ok()?;
            by_local[0][axis] = (above.u - below.u) / (2.0 * step);
            by_local[1][axis] = (above.v - below.v) / (2.0 * step);
        }
        let rotation = camera.rotation();
        let lever = point.coords - self.at_frames[label.frame].translation();
        Some((by_local.map(|g| rotation * g), lever))
    }

    /// Where a key pixel lands in the world with the body moved and turned, the depth asked again where it depends on
    /// that.
    pub(super) fn lifted(
        &self,
        segment: &Segment,
        px: Pixel,
        moved: Vector3<f64>,
        turned: Vector3<f64>,
        depth_follows: bool,
    ) -> Option<Point3<f64>> {
        let body = self.at_frames[segment.frame];
        let turn = nalgebra::UnitQuaternion::from_scaled_axis(turned);
        let body: WorldFromBody =
            crate::frames::Rigid::from_parts(body.translation() + moved, turn * body.rotation());
        let body_from_camera = self.cameras[segment.frame]?;
        let camera = body * body_from_camera;
        let at = &self.scene.frames[segment.frame];
        let placed = if self.scene.own_anchor { Some(camera) } else { self.anchor_camera(segment.frame) };
        let depth = if depth_follows {
            let keyframe = Keyframe {
                stamp: at.stamp,
                frame: at.index,
                camera: &self.camera,
                body_from_camera,
                world_from_camera: placed,
                floor: at.floor?,
            };
            let depths = self.scene.source.depths(&keyframe, &[px]).ok()?;
            depths.first()?.as_ref().ok()?.z_m
        } else {
            let point = self.points[self.scene.labels[segment.labels.start].segment]?;
            let as_is = self.at_frames[segment.frame] * body_from_camera;
            (as_is.rotation().inverse() * (point.coords - as_is.translation())).z
        };
        let ray = self.camera.unproject(px).ok()?;
        Some(camera.transform_point(&Point3::from(ray * depth)))
    }

    fn anchor_camera(&self, frame: usize) -> Option<WorldFromCamera> {
        let anchor = self.scene.anchor.as_ref()?;
        let reader = anchor.reader(&Theta::zero()).ok()?;
        Some(reader.at(self.scene.frames[frame].t_s) * self.cameras[frame]?)
    }

    /// Whether the depth of a key frame answers to the pose of its body.
    pub(super) fn depth_follows(&self) -> bool {
        !self.scene.fixed_depth
    }
}
