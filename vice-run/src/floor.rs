//! The floor plane of a recording, fitted to its cloud or to a depth image.

use nalgebra::Vector3;
use vice_depth::{FloorFit, FloorFitOptions, fit_floor_to_cloud, fit_floor_to_depth_image};

use crate::error::{RunError, RunResult};
use crate::request::DepthName;
use crate::request::DepthSpec;
use crate::scene::Scene;

/// A plane with less of the points than this is worth a warning.
const SMALL_SHARE: f64 = 0.05;

/// Fits a plane to the cloud, or to the depth image of a frame.
///
/// # Errors
/// [`RunError`] if there is nothing to fit to, or no plane is found.
pub fn fit_floor(
    scene: &Scene,
    depth: &DepthSpec,
    at: Option<&str>,
    options: &FloorFitOptions,
) -> RunResult<FloorFit> {
    let (opened, up) = (&scene.opened, Vector3::z_axis());
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
