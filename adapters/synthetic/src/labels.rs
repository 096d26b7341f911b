//! Exact labels: fixed points of the scene, projected into every frame in which they are in plain view.
//!
//! A point keeps its name when it is lost: in the frame in which it has left the image or is hidden another place takes
//! over with a new key frame, as an annotator does. Places are chosen on the grid of pixels that stays longest in view,
//! away from depth edges and from the other points.

use nalgebra::Point3;
use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::WorldFromCamera;
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::time::Stamp;

use crate::scene::{Scene, SurfaceKind};

/// A point is given up this near to the border of the image, pixels.
const MARGIN_PX: f64 = 10.0;
/// A new point is this far from the border.
const NEW_MARGIN_PX: f64 = 40.0;
/// No other face within this many pixels of a new point: depth sources that interpolate see one plane.
const EDGE_PX: f64 = 9.0;
/// New points lie between these depths: a nearer one leaves at once, a farther one says little about translation.
const DEPTHS_M: [f64; 2] = [0.6, 6.0];
/// Seeing a point for longer than this makes it no better.
const LONG_ENOUGH_S: f64 = 4.0;

/// A run of frames as labelling sees it.
pub(crate) struct Filmed<'a> {
    pub(crate) scene: &'a Scene,
    pub(crate) camera: &'a Camera,
    pub(crate) stamps: &'a [Stamp],
    pub(crate) poses: &'a [WorldFromCamera],
    pub(crate) rate_hz: f64,
}

/// A place in the world that can be a point, and the frame after the last one in which it stays in view.
#[derive(Clone, Copy)]
struct Candidate {
    point: Point3<f64>,
    px: Pixel,
    lost_at: usize,
}

impl Filmed<'_> {
    /// The pixel of a point in a frame, where it is in plain view and inside the margin.
    fn pixel(&self, frame: usize, point: &Point3<f64>, margin_px: f64) -> Option<Pixel> {
        let pose = &self.poses[frame];
        let in_camera = pose.inverse().transform_point(point);
        let px = self.camera.project(&in_camera).ok()?;
        if !self.inside(px, margin_px) {
            return None;
        }
        let eye = Point3::from(pose.translation());
        let hit = self.scene.cast(&eye, &(point - eye))?;
        // Nothing nearer: the ray ends at the point itself.
        ((hit.distance - 1.0).abs() < 1e-9).then_some(px)
    }

    fn inside(&self, px: Pixel, margin_px: f64) -> bool {
        let (right, bottom) = (f64::from(self.camera.width()) - 1.0, f64::from(self.camera.height()) - 1.0);
        px.u >= margin_px && px.v >= margin_px && px.u <= right - margin_px && px.v <= bottom - margin_px
    }

    /// What a pixel of a frame shows, if that is a good place for a point of that kind.
    fn candidate(&self, frame: usize, px: Pixel, kind: SurfaceKind) -> Option<Candidate> {
        let pose = &self.poses[frame];
        let eye = Point3::from(pose.translation());
        let cast = |px: Pixel| {
            let ray = self.camera.unproject(px).ok()?;
            self.scene.cast(&eye, &pose.rotate(&ray))
        };
        let hit = cast(px)?;
        if self.scene.kind(hit.surface) != kind || !(DEPTHS_M[0]..=DEPTHS_M[1]).contains(&hit.distance) {
            return None;
        }
        let plain = [
            (1.0, 0.0),
            (-1.0, 0.0),
            (0.0, 1.0),
            (0.0, -1.0),
            (0.7, 0.7),
            (0.7, -0.7),
            (-0.7, 0.7),
            (-0.7, -0.7),
        ]
        .iter()
        .all(|(du, dv)| {
            let beside = Pixel::new(px.u + EDGE_PX * du, px.v + EDGE_PX * dv);
            cast(beside).is_some_and(|h| h.surface == hit.surface)
        });
        if !plain {
            return None;
        }
        let long_enough = frame + (LONG_ENOUGH_S * self.rate_hz).ceil() as usize;
        let end = self.poses.len().min(long_enough.max(frame + 2));
        let lost_at =
            (frame + 1..end).find(|f| self.pixel(*f, &hit.point, MARGIN_PX).is_none()).unwrap_or(end);
        Some(Candidate { point: hit.point, px: self.pixel(frame, &hit.point, MARGIN_PX)?, lost_at })
    }

    /// The best new point of a kind, spread away from those that are in view already.
    fn choose(&self, frame: usize, kind: SurfaceKind, taken: &[Pixel]) -> Option<Candidate> {
        let (width, height) = (f64::from(self.camera.width()), f64::from(self.camera.height()));
        let margin = NEW_MARGIN_PX.min(width / 8.0).min(height / 8.0);
        let pitch = (width / 26.0).max(8.0);
        let across = ((width - 1.0 - 2.0 * margin) / pitch) as u32;
        let down = ((height - 1.0 - 2.0 * margin) / pitch) as u32;
        let grid: Vec<Pixel> = (0..=down)
            .flat_map(|j| (0..=across).map(move |i| (i, j)))
            .map(|(i, j)| Pixel::new(margin + f64::from(i) * pitch, margin + f64::from(j) * pitch))
            .collect();
        let found: Vec<Candidate> =
            grid.par_iter().filter_map(|px| self.candidate(frame, *px, kind)).collect();
        let far = 0.35 * width;
        let score = |c: &Candidate| {
            let seconds = (c.lost_at - frame) as f64 / self.rate_hz;
            let apart = taken.iter().map(|t| t.distance_px(c.px)).fold(far, f64::min) / far;
            seconds / LONG_ENOUGH_S + 0.8 * apart
        };
        // The first of equals, so that the order of the grid decides.
        found.into_iter().rev().max_by(|a, b| score(a).total_cmp(&score(b)))
    }

    /// Labels in every frame for points of the wanted kinds, named 0, 1, 2 and so on.
    ///
    /// Where no place of its own kind is in view, a point waits for one.
    ///
    /// # Errors
    /// [`DataError`] if a point finds no place in the whole run.
    pub(crate) fn labels(&self, kinds: &[SurfaceKind]) -> DataResult<LabelSet> {
        let mut now: Vec<Option<Candidate>> = vec![None; kinds.len()];
        let mut rows = Vec::new();
        for (frame, stamp) in self.stamps.iter().enumerate() {
            let mut pixels: Vec<Option<Pixel>> =
                now.iter().map(|c| c.and_then(|c| self.pixel(frame, &c.point, MARGIN_PX))).collect();
            for (name, kind) in kinds.iter().enumerate() {
                let keyframe = pixels[name].is_none();
                if keyframe {
                    let taken: Vec<Pixel> = pixels.iter().flatten().copied().collect();
                    now[name] = self.choose(frame, *kind, &taken);
                    pixels[name] = now[name].map(|c| c.px);
                }
                if let Some(px) = pixels[name] {
                    let mut observation = Observation::manual(*stamp, px);
                    observation.keyframe = keyframe;
                    rows.push(LabelRow { point: name.to_string(), observation });
                }
            }
        }
        let set = LabelSet::from_rows(rows).map_err(|e| DataError::new("the exact labels").because(e))?;
        if set.points().len() < kinds.len() {
            return Err(DataError::new("a point of the labels is never in plain view")
                .hint("try another seed, a larger image or a longer flight"));
        }
        Ok(set)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::{CAMERA, Synthetic};
    use crate::options::SyntheticOptions;
    use vice_core::dataset::Dataset;
    use vice_core::time::Span;

    fn default_flight() -> Synthetic {
        Synthetic::new(SyntheticOptions::default()).unwrap()
    }

    /// Equation 1 from the public interface alone: pixel and depth at the key frame, poses, pixel later.
    #[test]
    fn labels_are_what_the_true_poses_make_of_the_key_frame() {
        let synthetic = default_flight();
        let camera = synthetic.camera(CAMERA).unwrap();
        let frames = synthetic.frames(CAMERA).unwrap();
        let world_from_camera = |stamp: Stamp| {
            let body = synthetic.trajectory("ground-truth").unwrap().pose_at(stamp, Span::ZERO).unwrap();
            body * synthetic.body_from_camera(CAMERA, stamp).unwrap()
        };
        let mut compared = 0;
        for labels in [synthetic.floor_labels().unwrap(), synthetic.scene_labels().unwrap()] {
            for point in labels.points() {
                assert_eq!(point.before_first_keyframe(), 0);
                for segment in point.segments() {
                    let key = world_from_camera(segment.keyframe.stamp);
                    let ray = camera.unproject(segment.keyframe.px).unwrap();
                    let eye = Point3::from(key.translation());
                    let z_m = synthetic.scene().cast(&eye, &key.rotate(&ray)).unwrap().distance;
                    let point_world = key.transform_point(&Point3::from(ray * z_m));
                    for later in point.observations.some(segment.rest) {
                        let pose = world_from_camera(later.stamp);
                        let px = camera.project(&pose.inverse().transform_point(&point_world)).unwrap();
                        assert!(px.distance_px(later.px) < 1e-9, "{px:?} {later:?}");
                        assert!(frames.binary_search(&later.stamp).is_ok());
                        compared += 1;
                    }
                }
            }
        }
        assert!(compared > 1500, "{compared}");
    }

    #[test]
    fn points_stay_a_while_in_every_frame_and_apart() {
        for seed in 0..6 {
            let synthetic = Synthetic::new(SyntheticOptions { seed, ..Default::default() }).unwrap();
            let frames = synthetic.frames(CAMERA).unwrap();
            for (labels, points) in
                [(synthetic.floor_labels().unwrap(), 4), (synthetic.scene_labels().unwrap(), 6)]
            {
                assert_eq!(labels.points().len(), points);
                for point in labels.points() {
                    let seen = point.observations.len();
                    assert!(seen * 10 >= frames.len() * 9, "seed {seed} point {}: {seen}", point.name);
                    let segments = point.segments().count();
                    // On the average a second or more between two respawns.
                    assert!(segments <= 10, "seed {seed} point {}: {segments} segments", point.name);
                }
                for frame in frames.iter().step_by(40) {
                    let now: Vec<Pixel> = labels
                        .points()
                        .iter()
                        .flat_map(|p| p.observations.iter().filter(|o| o.stamp == *frame).map(|o| o.px))
                        .collect();
                    for (i, a) in now.iter().enumerate() {
                        assert!(now[i + 1..].iter().all(|b| a.distance_px(*b) > 8.0), "seed {seed} {now:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_key_frame_is_on_its_surface_and_away_from_edges() {
        let synthetic = default_flight();
        let camera = synthetic.camera(CAMERA).unwrap();
        let frames = synthetic.frames(CAMERA).unwrap();
        let labels = synthetic.scene_labels().unwrap();
        let kinds = [SurfaceKind::Floor, SurfaceKind::Box, SurfaceKind::Wall];
        for point in labels.points() {
            let kind = kinds[point.name.parse::<usize>().unwrap() % 3];
            for segment in point.segments() {
                let frame = frames.binary_search(&segment.keyframe.stamp).unwrap();
                let pose = synthetic.world_from_camera(frame);
                let eye = Point3::from(pose.translation());
                for (du, dv) in [(0.0, 0.0), (5.0, 3.0), (-5.0, 3.0), (4.0, -5.0), (-4.0, -5.0)] {
                    let px = Pixel::new(segment.keyframe.px.u + du, segment.keyframe.px.v + dv);
                    let hit = synthetic.scene().cast(&eye, &pose.rotate(&camera.unproject(px).unwrap()));
                    assert_eq!(synthetic.scene().kind(hit.unwrap().surface), kind);
                }
            }
        }
    }
}
