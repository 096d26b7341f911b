//! KITTI odometry: `image_0` to `image_3`, `calib.txt`, `times.txt`; the poses in `../../poses/NN.txt` or beside
//! (cvlibs.net/datasets/kitti/eval_odometry.php).
//!
//! Poses are 3x4 `world_from_camera` of `image_0`, the body here, in the frame of its first picture: x right, y down,
//! z forward. That world is turned so that z points up and x forward. The road is 1.65 m below the cameras. `P0` to `P3`
//! are projections of rectified pictures: intrinsics and the baseline to `image_0`.

use std::path::{Path, PathBuf};

use vice_core::dataset::GROUND_TRUTH;
use vice_core::error::DataResult;
use vice_core::frames::{Body, BodyFromCamera, Rigid};
use vice_files::trajectory::ReadOptions;

use super::Layout;
use super::kitti::{Lines, road};
use crate::files::{has_picture, name, pictures};
use crate::list::List;
use crate::parts::{CameraPart, Description, Place, Read, StreamPart, name_of};
use crate::poses::{Shared, of_file, turned, up_from_down};
use crate::settings::Settings;
use crate::stamps;

pub(crate) const LAYOUT: Layout = Layout { name: "KITTI odometry", is, describe };

/// Cameras, and their lines in the calibration.
const CAMERAS: [(&str, &str); 4] =
    [("image_0", "P0"), ("image_1", "P1"), ("image_2", "P2"), ("image_3", "P3")];

fn is(folder: &Path) -> bool {
    folder.join("calib.txt").is_file() && CAMERAS.iter().any(|(camera, _)| has_picture(&folder.join(camera)))
}

/// The poses of a sequence: in the benchmark's `poses`, or in the folder itself.
fn poses_of(folder: &Path) -> Option<PathBuf> {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
    let own = format!("{}.txt", name(&real));
    let above = real.parent().and_then(Path::parent).map(|p| p.join("poses").join(&own));
    let inside = ["poses.txt", "gt.txt"].map(|p| folder.join(p));
    above
        .into_iter()
        .chain([folder.join(&own), folder.join("poses").join(&own)])
        .chain(inside)
        .find(|p| p.is_file())
}

fn describe(folder: &Path, settings: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    found.name = name_of(folder);
    let calibration = folder.join("calib.txt");
    let lines = Shared::new(move || Lines::read(&calibration));
    let times = folder.join("times.txt");
    let fps = if times.is_file() { None } else { Some(settings.fps().unwrap_or(10.0)) };
    for (camera, key) in CAMERAS.into_iter().filter(|(camera, _)| has_picture(&folder.join(camera))) {
        let (own, place, inside, list) = (lines.clone(), lines.clone(), folder.join(camera), times.clone());
        found.cameras.push(CameraPart {
            name: camera.to_string(),
            frames: Box::new(move || match fps {
                None => stamps::by_list(&List::read(&list)?, &[], &pictures(&inside)?),
                Some(fps) => {
                    let mut frames = stamps::by_index(&inside, pictures(&inside)?, fps, Default::default())?;
                    frames.suspicions.push(stamps::made(&inside, fps));
                    Ok(frames)
                }
            }),
            intrinsics: Box::new(move || Ok(own.get()?.projection(key)?.0)),
            // The body is the first camera.
            place: Place::Fixed(
                Box::new(move || Ok(place.get()?.projection(key)?.1.reinterpret())) as Read<BodyFromCamera>
            ),
            depth: None,
        });
    }
    if let Some(path) = poses_of(folder) {
        let times = times.is_file().then_some(times);
        let read = Box::new(move || {
            let options = ReadOptions { times: times.clone(), ..ReadOptions::default() };
            Ok(turned(of_file(&path, &options)?, &up_from_down()))
        });
        found.streams.push(StreamPart { name: GROUND_TRUTH.to_string(), read });
    }
    found.floor = road(&Rigid::<Body, _>::identity())?;
    found.fact("the body is image_0, whose poses the ground truth gives");
    found.fact("the world is turned: z up = -y, x = z, y = -x of the first picture's camera frame");
    found.fact("the road is 1.65 m below the camera, by the authors' drawing of the car");
    Ok(found)
}
