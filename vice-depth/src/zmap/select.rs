//! The first step: the points of the cloud that are in view.

use nalgebra::Point3;
use rayon::prelude::*;
use vice_core::camera::Camera;
use vice_core::frames::{self, Rigid};

use super::interpolate::Seen;
use crate::cloud::Cloud;

/// Points nearer than this do not count as seen, metres.
pub(crate) const NEAREST_M: f64 = 0.1;

/// The points in front of the camera that project into the image.
pub(crate) fn in_view(
    cloud: &Cloud,
    camera_from_cloud: &Rigid<frames::Camera, frames::Cloud>,
    camera: &Camera,
) -> Vec<Seen> {
    let (rotation, translation) = camera_from_cloud.to_matrix_and_translation();
    let points: Vec<Point3<f64>> = cloud.points().collect();
    points
        .par_iter()
        .filter_map(|p| {
            let in_camera = Point3::from(rotation * p.coords + translation);
            if in_camera.z <= NEAREST_M {
                return None;
            }
            let pixel = camera.project(&in_camera).ok().filter(|px| camera.contains(*px))?;
            Some(Seen { u: pixel.u, v: pixel.v, z_m: in_camera.z })
        })
        .collect()
}
