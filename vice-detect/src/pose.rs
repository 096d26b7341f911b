//! The pose of a square tag in the camera's frame, from its four corners.
//!
//! A first pose comes out of the homography (Zhang 2000); Gauss-Newton then makes the reprojection error smallest. Seen
//! from far, a plane and its mirror image about the line of sight look alike (Schweighofer and Pinz 2006): both are
//! tried, the better one is kept, and a tag for which they cannot be told apart says so.

use nalgebra::{
    Isometry3, Matrix3, Matrix6, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector2, Vector3,
    Vector6,
};
use vice_core::camera::{Camera, Pixel};

use crate::tag::homography;

/// Where a tag is.
#[derive(Clone, Copy, Debug)]
pub struct TagPose {
    /// Takes coordinates of the tag (origin at its centre, x to the right and y down on the printed side, z away from
    /// the viewer, metres) to the camera's frame.
    pub camera_from_tag: Isometry3<f64>,
    /// Root mean square distance of the corners from where the pose projects them, pixels.
    pub rms_px: f64,
    /// The mirrored pose fits less than twice as badly, so that the tilt may be the wrong way round.
    pub ambiguous: bool,
}

/// The pose of a tag whose border is `size_m` wide, from its corners as [`crate::Tag`] orders them.
/// `None` where the lens model does not reach a corner or no pose fits.
pub fn tag_pose(camera: &Camera, corners: &[Pixel; 4], size_m: f64) -> Option<TagPose> {
    let mut rays = [Vector2::zeros(); 4];
    for (ray, corner) in rays.iter_mut().zip(corners) {
        *ray = camera.unproject(*corner).ok()?.xy();
    }
    let first = from_homography(&rays, size_m)?;
    let focal = camera.fx_fy_cx_cy()[0];
    let one = refine(&rays, size_m, first)?;
    let two = refine(&rays, size_m, mirrored(&one.0));
    let (best, worse) = match two {
        Some(two) if two.1 < one.1 => (two, Some(one)),
        two => (one, two),
    };
    // Where both starts end in the same pose there is but one.
    let other = worse.filter(|w| w.0.rotation.angle_to(&best.0.rotation) > 0.02);
    Some(TagPose {
        camera_from_tag: best.0,
        rms_px: best.1 * focal,
        ambiguous: other.is_some_and(|w| w.1 < 2.0 * best.1.max(0.05 / focal)),
    })
}

fn tag_corners(size_m: f64) -> [Point3<f64>; 4] {
    let h = size_m / 2.0;
    [(-h, -h), (h, -h), (h, h), (-h, h)].map(|(x, y)| Point3::new(x, y, 0.0))
}

fn from_homography(rays: &[Vector2<f64>; 4], size_m: f64) -> Option<Isometry3<f64>> {
    // From metres about the centre to the unit square.
    let unit_from_tag = Matrix3::new(1.0 / size_m, 0.0, 0.5, 0.0, 1.0 / size_m, 0.5, 0.0, 0.0, 1.0);
    let h = homography(rays)? * unit_from_tag;
    let (a, b, t) = (h.column(0), h.column(1), h.column(2));
    let scale = 2.0 / (a.norm() + b.norm());
    let scale = if t.z < 0.0 { -scale } else { scale };
    let (a, b) = (a * scale, b * scale);
    let raw = Matrix3::from_columns(&[a, b, a.cross(&b)]);
    let svd = raw.svd(true, true);
    let rotation = svd.u? * svd.v_t?;
    if rotation.determinant() < 0.0 || !scale.is_finite() {
        return None;
    }
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    Some(Isometry3::from_parts(Translation3::from(t * scale), rotation))
}

/// The pose whose normal is mirrored about the line of sight.
fn mirrored(pose: &Isometry3<f64>) -> Isometry3<f64> {
    let normal = pose.rotation * Vector3::z();
    let sight = pose.translation.vector.normalize();
    let other = sight * (2.0 * normal.dot(&sight)) - normal;
    let axis = normal.cross(&other);
    let turn = match Unit::try_new(axis, 1e-9) {
        Some(axis) => UnitQuaternion::from_axis_angle(&axis, normal.angle(&other)),
        None => UnitQuaternion::identity(),
    };
    Isometry3::from_parts(pose.translation, turn * pose.rotation)
}

/// The nearest least reprojection error, and that error (RMS, normalised coordinates). Levenberg's damping.
fn refine(rays: &[Vector2<f64>; 4], size_m: f64, start: Isometry3<f64>) -> Option<(Isometry3<f64>, f64)> {
    let corners = tag_corners(size_m);
    let error_of = |pose: &Isometry3<f64>| {
        let mut sum = 0.0;
        for (corner, ray) in corners.iter().zip(rays) {
            let p = pose * corner;
            if p.z <= 0.0 {
                return None;
            }
            sum += (p.xy().coords / p.z - ray).norm_squared();
        }
        Some((sum / 4.0).sqrt())
    };
    let (mut pose, mut error) = (start, error_of(&start)?);
    let mut damping = 1e-3;
    for _ in 0..50 {
        let mut normal = Matrix6::zeros();
        let mut right = Vector6::zeros();
        for (corner, ray) in corners.iter().zip(rays) {
            let turned = pose.rotation * corner.coords;
            let p = turned + pose.translation.vector;
            let (x, y) = (p.x / p.z, p.y / p.z);
            for (row, rest) in
                [(Vector3::new(1.0, 0.0, -x) / p.z, ray.x - x), (Vector3::new(0.0, 1.0, -y) / p.z, ray.y - y)]
            {
                // A small turn w moves the point by w × turned: row · (w × turned) = w · (turned × row).
                let turn = turned.cross(&row);
                let j = Vector6::new(turn.x, turn.y, turn.z, row.x, row.y, row.z);
                normal += j * j.transpose();
                right += j * rest;
            }
        }
        let damped = normal + Matrix6::from_diagonal(&(normal.diagonal() * damping));
        let Some(step) = damped.cholesky().map(|c| c.solve(&right)) else { break };
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(step[0], step[1], step[2]));
        let next = Isometry3::from_parts(
            Translation3::from(pose.translation.vector + Vector3::new(step[3], step[4], step[5])),
            turn * pose.rotation,
        );
        match error_of(&next) {
            Some(e) if e < error => {
                let done = error - e < 1e-12;
                (pose, error) = (next, e);
                damping = (damping * 0.1_f64).max(1e-12);
                if done {
                    break;
                }
            }
            _ if damping > 1e6 => break,
            _ => damping *= 10.0,
        }
    }
    Some((pose, error))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::camera::Model;

    #[test]
    fn exact_corners_give_the_exact_pose() {
        let model = Model::from_name("radtan", &[-0.28, 0.07, 0.0002, 0.00002]).unwrap();
        let camera = Camera::new(752, 480, [458.0, 457.0, 367.0, 248.0], model).unwrap();
        for (tilt, spin) in [(0.0, 0.3), (0.5, -1.0), (1.0, 2.0), (1.3, 3.0), (-0.8, 0.1)] {
            let rotation = UnitQuaternion::from_euler_angles(tilt, 0.4 * tilt, 0.0)
                * UnitQuaternion::from_euler_angles(0.0, 0.0, spin);
            let pose = Isometry3::from_parts(Translation3::new(0.2, -0.1, 1.5), rotation);
            let corners = tag_corners(0.3).map(|c| camera.project(&(pose * c)).unwrap());
            let found = tag_pose(&camera, &corners, 0.3).unwrap();
            let off = pose.inverse() * found.camera_from_tag;
            assert!(off.translation.vector.norm() < 1e-6 && off.rotation.angle() < 1e-5, "{tilt}: {found:?}");
            assert!(found.rms_px < 1e-4, "{found:?}");
        }
    }
}
