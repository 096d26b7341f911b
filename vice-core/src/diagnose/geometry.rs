//! How pixels move with what is uncertain: the pose at the frame, the place of the key point. Taken once for a stream.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::scene::Scene;
use super::view::View;
use crate::camera::Pixel;

/// A label's derivatives, pixels.
#[derive(Clone, Debug, Default)]
pub(super) struct LabelAnswer {
    pub(super) segment: usize,
    /// By the place of its point, a metre along the world's axes, for u and v.
    pub(super) by_place: [Vector3<f64>; 2],
    /// By the turn of the pose about the world's axes, a radian.
    pub(super) by_turn: [Vector3<f64>; 2],
}

/// A key point's derivatives, metres in the world.
#[derive(Clone, Debug)]
pub(super) struct SegmentAnswer {
    /// By position and rotation of the pose at its key frame.
    pub(super) by_pose: SMatrix<f64, 3, 6>,
    /// By the key label, a pixel.
    pub(super) by_pixel: SMatrix<f64, 3, 2>,
    /// Covariance of its place by the depth's own noise.
    pub(super) depth_variance: Matrix3<f64>,
    /// The frame of its last label.
    pub(super) last_frame: usize,
}

/// What happens at a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameEvents {
    /// Since the frame before, seconds.
    pub(super) dt_s: f64,
    /// How far the body moved since then.
    pub(super) step: Vector3<f64>,
    pub(super) labels: Vec<usize>,
    /// Segments that begin, end, or go on here.
    pub(super) begins: Vec<usize>,
    pub(super) ends: Vec<usize>,
    pub(super) followed: Vec<usize>,
}

/// All of it.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub(super) labels: Vec<LabelAnswer>,
    pub(super) segments: Vec<SegmentAnswer>,
    pub(super) frames: Vec<FrameEvents>,
    pub(super) most_followed: usize,
    pub(super) own_anchor: bool,
    pub(super) inertial: bool,
}

impl Geometry {
    pub(super) fn new(scene: &Scene<'_>, view: &View<'_, '_>, inertial: bool) -> Self {
        let labels = scene
            .labels
            .iter()
            .map(|label| {
                let Some((by_place, lever)) = view.answer(label) else {
                    return LabelAnswer { segment: label.segment, ..LabelAnswer::default() };
                };
                // The point seen from a body that turns by θ moves by -θ x lever.
                let by_turn = by_place.map(|g| -lever.cross(&g));
                LabelAnswer { segment: label.segment, by_place, by_turn }
            })
            .collect();
        let mut frames: Vec<FrameEvents> = vec![FrameEvents::default(); scene.frames.len()];
        for (f, frame) in frames.iter_mut().enumerate().skip(1) {
            frame.dt_s = scene.frames[f].t_s - scene.frames[f - 1].t_s;
            frame.step = view.at_frames[f].translation() - view.at_frames[f - 1].translation();
        }
        for (i, label) in scene.labels.iter().enumerate() {
            frames[label.frame].labels.push(i);
        }
        let mut segments = Vec::new();
        let mut followed = vec![0_i32; frames.len() + 1];
        for (i, segment) in scene.segments.iter().enumerate() {
            let last_frame = scene.labels[segment.labels.end - 1].frame;
            frames[segment.frame].begins.push(i);
            frames[last_frame].ends.push(i);
            for frame in &mut frames[segment.frame + 1..=last_frame] {
                frame.followed.push(i);
            }
            followed[segment.frame] += 1;
            followed[last_frame] -= 1;
            segments.push(segment_answer(scene, view, i, last_frame));
        }
        let mut now = 0;
        let most = followed.iter().map(|change| {
            now += change;
            now
        });
        // One ends where the next begins: both are counted.
        let most_followed = most.max().unwrap_or(0) as usize + 1;
        Self { labels, segments, frames, most_followed, own_anchor: scene.own_anchor, inertial }
    }
}

fn segment_answer(scene: &Scene<'_>, view: &View<'_, '_>, index: usize, last_frame: usize) -> SegmentAnswer {
    const PIXEL: f64 = 0.5;
    const METRE: f64 = 0.01;
    const RADIAN: f64 = 0.002;
    let segment = &scene.segments[index];
    let zero = Vector3::zeros();
    let follows = view.depth_follows();
    let mut by_pixel = SMatrix::<f64, 3, 2>::zeros();
    for axis in 0..2 {
        let at = |sign: f64| {
            let mut px = [segment.px.u, segment.px.v];
            px[axis] += sign * PIXEL;
            view.lifted(segment, Pixel::new(px[0], px[1]), zero, zero, follows)
        };
        if let (Some(above), Some(below)) = (at(1.0), at(-1.0)) {
            by_pixel.set_column(axis, &((above - below) / (2.0 * PIXEL)));
        }
    }
    let mut by_pose = SMatrix::<f64, 3, 6>::zeros();
    for axis in 0..6 {
        let step = if axis < 3 { METRE } else { RADIAN };
        let at = |sign: f64| {
            let mut change = [zero, zero];
            change[axis / 3][axis % 3] = sign * step;
            view.lifted(segment, segment.px, change[0], change[1], follows && scene.own_anchor)
        };
        if let (Some(above), Some(below)) = (at(1.0), at(-1.0)) {
            by_pose.set_column(axis, &((above - below) / (2.0 * step)));
        }
    }
    let mut depth_variance = Matrix3::zeros();
    if let (Some(point), Some(extrinsics)) = (view.points[index], view.extrinsics(segment.frame)) {
        let camera = view.at_frames[segment.frame] * extrinsics;
        let along = (point.coords - camera.translation()) * scene.roughness;
        depth_variance = along * along.transpose();
    }
    SegmentAnswer { by_pose, by_pixel, depth_variance, last_frame }
}
