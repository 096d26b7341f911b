//! ICL-NUIM in TUM's format: `rgb`, `depth`, `associations.txt` and `*.gt.freiburg`
//! (doc.ic.ac.uk/~ahanda/VaFRIC/iclnuim.html).
//!
//! Pictures and poses are counted at 30 Hz. The rendered camera has fx = 481.20 and fy = -480.00, cx = 319.50,
//! cy = 239.50: its y axis points up, and with it the frames are left-handed. Poses are mirrored in y on both sides here,
//! so that the camera's y points down (fy positive) and the world is right-handed, then turned so that z is up: the
//! files' world has y up. Depth is 16 bits, 5000 counts a metre.

use std::path::{Path, PathBuf};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::{Rigid, WorldFromBody};
use vice_core::time::Stamp;
use vice_files::trajectory::{self, ReadOptions};

use super::Layout;
use super::tum::DEPTH_COUNTS;
use crate::files::{entries, has_picture, name, number_in, pictures, stem};
use crate::parts::{CameraPart, DepthPart, Description, Frames, Intrinsics, Place, Poses, Read, StreamPart};
use crate::poses::{collected, turned, up_from_down};
use crate::settings::Settings;
use crate::stamps::{self, at_index};

pub(crate) const LAYOUT: Layout = Layout { name: "ICL-NUIM", is, describe };

fn truth(folder: &Path) -> Option<PathBuf> {
    let found = entries(folder).ok()?;
    found.into_iter().find(|p| name(p).ends_with(".gt.freiburg"))
}

fn is(folder: &Path) -> bool {
    truth(folder).is_some() && has_picture(&folder.join("rgb"))
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let fps = settings.fps_or_assumed();
    let depth = has_picture(&folder.join("depth"));
    found.cameras.push(CameraPart {
        name: "rgb".to_string(),
        frames: numbered(&folder.join("rgb"), fps),
        intrinsics: Box::new(|| {
            let from = "the authors' page (fy without its sign)";
            Ok(Intrinsics {
                size: Some([640, 480]),
                ..Intrinsics::pinhole([481.20, 480.00, 319.50, 239.50], from)
            })
        }),
        place: Place::body(),
        depth: depth.then(|| {
            let (metres_per_count, from) = settings.metres_per_count(DEPTH_COUNTS, "ICL-NUIM");
            let frames = numbered(&folder.join("depth"), fps);
            DepthPart { frames, metres_per_count, invalid: None, from }
        }),
    });
    if let Some(path) = truth(folder) {
        let read = Box::new(move || poses(&path, fps));
        found.streams.push(StreamPart { name: vice_core::dataset::GROUND_TRUTH.to_string(), read });
    }
    found.fact(format!("frames are numbers, taken at {fps} Hz"));
    found.fact(
        "fy is -480 in the data: the camera's y is mirrored, and the left-handed world with it; z is up",
    );
    found.floor = vice_core::dataset::Floor::Unknown;
    Ok(found)
}

/// Pictures whose names are their numbers; number 0 is at 0 s.
fn numbered(folder: &Path, fps: f64) -> Read<Frames> {
    let folder = folder.to_path_buf();
    Box::new(move || {
        let mut frames = Vec::new();
        for picture in pictures(&folder)? {
            let stem = stem(&picture);
            let number = number_in(&stem).and_then(|n| n.parse::<u64>().ok()).ok_or_else(|| {
                DataError::new("the name is no number of a frame")
                    .at(&picture)
                    .hint("names such as 0.png are expected")
            })?;
            frames.push((at_index(number, fps, Stamp::default())?, picture));
        }
        stamps::in_order(&folder, frames, vec![stamps::made(&folder, fps)])
    })
}

fn poses(path: &Path, fps: f64) -> DataResult<Poses> {
    let file = trajectory::read(path, &ReadOptions::default())?;
    let mut poses = Vec::with_capacity(file.trajectory.len());
    for (stamp, pose) in file.trajectory.iter() {
        // The first column counts frames.
        let number = u64::try_from(stamp.as_nanos() / 1_000_000_000)
            .map_err(|_| DataError::new("a frame's number is negative").at(path))?;
        poses.push((at_index(number, fps, Stamp::default())?, mirrored(&pose)));
    }
    let suspicions = file.suspicions.into_iter().filter(|s| s.code != "implausible-speed").collect();
    Ok(turned(collected(path, poses, suspicions)?, &up_from_down()))
}

/// A pose in left-handed frames as one in the frames mirrored in y: `M T M`.
fn mirrored(pose: &WorldFromBody) -> WorldFromBody {
    let (t, q) = (pose.translation(), pose.rotation());
    // A rotation vector is axial: the mirror in y turns its x and z around and leaves y.
    let rotation = UnitQuaternion::new_unchecked(Quaternion::new(q.w, -q.i, q.j, -q.k));
    Rigid::from_parts(Vector3::new(t.x, -t.y, t.z), rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    #[test]
    fn a_mirrored_pose_is_the_mirror_of_the_pose() {
        let m = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
        let rotation = UnitQuaternion::from_euler_angles(0.3, -0.8, 1.1);
        let pose = WorldFromBody::from_parts(Vector3::new(1.0, 2.0, 3.0), rotation);
        let (r, t) = mirrored(&pose).to_matrix_and_translation();
        let expected = m * rotation.to_rotation_matrix().into_inner() * m;
        assert!((r - expected).norm() < 1e-12 && (t - m * pose.translation()).norm() < 1e-12);
    }
}
