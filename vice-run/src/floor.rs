//! The floor plane of a recording, fitted to its cloud or to a depth image.

use nalgebra::{Unit, Vector3};
use serde::Serialize;
use vice_core::error::ErrorKind;
use vice_depth::{FloorFit, FloorFitOptions, fit_floor_to_cloud, fit_floor_to_depth_image};
use vice_files::vice_toml::Up;

use crate::error::{RunError, RunResult};
use crate::request::DepthName;
use crate::request::DepthSpec;
use crate::scene::Scene;

/// A plane with less of the points than this is worth a warning.
const SMALL_SHARE: f64 = 0.05;
/// One with less is none.
const NO_SHARE: f64 = 0.01;

/// Fits a plane to the cloud, or to the depth image of a frame. `up` is the axis of the world that points up; `None`: z.
///
/// # Errors
/// [`RunError`] if there is nothing to fit to, or no plane is found.
pub fn fit_floor(
    scene: &Scene,
    depth: &DepthSpec,
    at: Option<&str>,
    up: Option<Up>,
    options: &FloorFitOptions,
) -> RunResult<FloorFit> {
    let opened = &scene.opened;
    // The axis of the world that becomes z where it points up.
    let up =
        up.map_or_else(Vector3::z_axis, |up| Unit::new_normalize(up.turn().inverse().rotate(&Vector3::z())));
    let dataset = opened.dataset.as_ref();
    let found = match at {
        None => {
            let (cloud, reference) = depth.cloud(DepthName::ZMap, opened).map_err(|e| {
                RunError::new(e.kind(), "no cloud to fit to")
                    .advise("name a frame with `at` to use its depth image")
                    .because(e)
            })?;
            fit_floor_to_cloud(&cloud, &reference.world_from_cloud, up, options)?
        }
        Some(at) => {
            let frame = scene.frame_at(at)?;
            let keyframe = scene.keyframe(frame)?;
            let image = dataset
                .depth_image(&opened.camera_name, frame)?
                .ok_or_else(|| RunError::missing(format!("frame {frame} has no depth image")))?;
            if !image.z_m().iter().any(|z| z.is_finite()) {
                return Err(RunError::missing(format!(
                    "the depth image of frame {frame} has no valid depth"
                )));
            }
            let world_from_camera = keyframe.world_from_camera.ok_or_else(|| {
                RunError::missing(format!("the camera's place at {} ns is unknown", keyframe.stamp))
                    .advise("name a `reference`")
            })?;
            fit_floor_to_depth_image(&image, &opened.camera, &world_from_camera, up, options)?
        }
    };
    let share = found.inliers as f64 / found.points as f64;
    if share < NO_SHARE {
        return Err(RunError::new(
            ErrorKind::Contradictory,
            format!("the best level plane holds {:.1} % of the points: that is no floor", 100.0 * share),
        )
        .advise("does z point up in this world? `up` names the axis that does; else raise `tolerance` or `max-tilt`"));
    }
    if share < SMALL_SHARE {
        tracing::warn!(
            "only {:.1} % of the points are of this plane: it may not be the floor",
            100.0 * share
        );
    }
    Ok(found)
}

/// The plane as a line of numbers, and what it was found from.
pub fn render(fit: &FloorFit) -> String {
    let (n, d) = (fit.plane.normal(), fit.plane.d_m());
    format!(
        "{:.6},{:.6},{:.6},{:.6}\n{} of {} points within the tolerance ({:.1} %), RMS {:.2} mm, tilt {:.3} degrees from level\n",
        n.x,
        n.y,
        n.z,
        d,
        fit.inliers,
        fit.points,
        100.0 * fit.inliers as f64 / fit.points as f64,
        fit.rms_m * 1000.0,
        fit.tilt_rad.to_degrees()
    )
}

/// The document `vice.floor/1`.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FloorDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// nx, ny, nz, d of n·p + d = 0 in the world, metres: as `floor_plane` of a request takes it.
    pub floor_plane: [f64; 4],
    /// Points within the tolerance.
    pub inliers: usize,
    /// All points that were looked at.
    pub points: usize,
    /// RMS distance of the inliers, metres.
    pub rms_m: f64,
    /// How far the plane is from level, radians.
    pub tilt_rad: f64,
}

impl From<&FloorFit> for FloorDocument {
    fn from(fit: &FloorFit) -> Self {
        let (n, d) = (fit.plane.normal(), fit.plane.d_m());
        Self {
            schema: "vice.floor/1",
            floor_plane: [n.x, n.y, n.z, d],
            inliers: fit.inliers,
            points: fit.points,
            rms_m: fit.rms_m,
            tilt_rad: fit.tilt_rad,
        }
    }
}
