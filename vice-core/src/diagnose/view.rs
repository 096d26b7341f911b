//! The scene as it is with some flaws taken out: where points are, and how their pixels answer.

use nalgebra::{Point3, Vector2, Vector3};

use super::motion::Reader;
use super::scene::{Label, Residual, Scene, Segment};
use super::theta::Theta;
use crate::camera::{Camera, Pixel};
use crate::depth::Keyframe;
use crate::frames::{BodyFromCamera, WorldFromBody, WorldFromCamera};

/// When a row is exposed, as a share of the read-out time from the middle row.
pub(super) fn row_share(camera: &Camera, px: Pixel) -> f64 {
    px.v / f64::from(camera.height()) - 0.5
}

/// The scene as it is with some flaws taken out.
pub(super) struct View<'s, 'a> {
    pub(super) scene: &'s Scene<'a>,
    pub(super) camera: Camera,
    pub(super) reader: Reader<'s>,
    pub(super) readout_s: f64,
    pub(super) at_frames: Vec<WorldFromBody>,
    pub(super) cameras: Vec<Option<BodyFromCamera>>,
    /// Key points in the world; none without depth.
    pub(super) points: Vec<Option<Point3<f64>>>,
}

impl View<'_, '_> {
    /// The camera when the row of a pixel is exposed.
    pub(super) fn world_from_camera(&self, frame: usize, px: Pixel) -> Option<WorldFromCamera> {
        let body_from_camera = self.cameras[frame]?;
        let body = if self.readout_s == 0.0 {
            self.at_frames[frame]
        } else {
            self.reader.at(self.scene.frames[frame].t_s + self.readout_s * row_share(&self.camera, px))
        };
        Some(body * body_from_camera)
    }

    pub(super) fn extrinsics(&self, frame: usize) -> Option<BodyFromCamera> {
        self.cameras[frame]
    }

    pub(super) fn residual(&self, label: &Label) -> Option<Residual> {
        let point = self.points[label.segment]?;
        let camera = self.world_from_camera(label.frame, label.px)?;
        let local = camera.rotation().inverse() * (point.coords - camera.translation());
        let px = self.camera.project(&Point3::from(local)).ok()?;
        Some(Vector2::new(px.u - label.px.u, px.v - label.px.v))
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
