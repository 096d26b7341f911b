//! Frames of two cameras at one moment: what their images say of their place against each other.

use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use vice_core::check::Finding;
use vice_core::check::cameras::{Sighted, cameras};
use vice_core::dataset::Dataset;
use vice_core::frames::{Camera as CameraFrame, Rigid};
use vice_core::time::Span;
use vice_track::Pyramid;
use vice_track::two_view::{between, turned};

/// Moments that are looked at.
const MOMENTS: usize = 16;
/// Stamps this near are one moment.
const SAME: Span = Span::from_millis(2);
/// A turn that is known less well is not used, radians.
const VAGUE_RAD: f64 = 0.02;

/// The finding about two cameras; nothing where they have no stamps in common, or no extrinsics.
pub(super) fn look(dataset: &dyn Dataset, first: &str, second: &str) -> Option<Finding> {
    let (one, other) = (dataset.camera(first).ok()?, dataset.camera(second).ok()?);
    let (frames, others) = (dataset.frames(first).ok()?, dataset.frames(second).ok()?);
    let mut same = Vec::new();
    for (i, stamp) in frames.iter().enumerate() {
        let k = others.partition_point(|s| *s < *stamp - SAME);
        if others.get(k).is_some_and(|s| *s <= *stamp + SAME) {
            same.push((i, k));
        }
    }
    let count = MOMENTS.min(same.len());
    let moments: Vec<(usize, usize)> =
        (0..count).map(|m| same[(2 * m + 1) * same.len() / (2 * count)]).collect();
    let stamp = frames[moments.first()?.0];
    let place = |camera: &str| dataset.body_from_camera(camera, stamp).ok();
    let second_from_first: Rigid<CameraFrame, CameraFrame> = place(second)?.inverse() * place(first)?;
    let sighted = |(i, k): &(usize, usize)| {
        let picture =
            |camera: &str, index: usize| Pyramid::for_tracking(&dataset.image(camera, index).ok()?).ok();
        let pairs = between(&picture(first, *i)?, &picture(second, *k)?, &one, &other);
        let found = turned(&pairs, *i as u64).filter(|f| f.sd_rad < VAGUE_RAD)?;
        let turn = UnitQuaternion::from_rotation_matrix(&found.second_from_first);
        Some(Sighted { turn, along: found.along })
    };
    let seen: Vec<Sighted> = moments.par_iter().filter_map(sighted).collect();
    Some(cameras(&format!("{first} / {second}"), &seen, &second_from_first))
}
