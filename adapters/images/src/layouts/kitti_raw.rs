//! KITTI raw: a drive with `image_00` to `image_03`, each with `data` and `timestamps.txt`, and optionally `oxts`; the
//! calibrations of the day in the folder above (cvlibs.net/datasets/kitti/raw_data.php).
//!
//! The body is the IMU where `calib_imu_to_velo.txt` and `calib_velo_to_cam.txt` place the cameras in it, else the camera
//! `image_00`. Poses are those of the IMU by GPS (see [`super::oxts`]), in a world whose z points up. Pictures are
//! rectified (`sync`): `P_rect_0n` and `R_rect_00` hold, and `K`, `D` do not.

use std::path::{Path, PathBuf};

use vice_core::dataset::{Floor, GROUND_TRUTH};
use vice_core::error::DataResult;
use vice_core::frames::{Body, BodyFromCamera, Cloud, Rigid};

use super::kitti::{FirstCamera, Lines, road};
use super::{Layout, oxts};
use crate::files::{has_picture, pictures};
use crate::list::List;
use crate::parts::{CameraPart, Description, Intrinsics, Place, StreamPart};
use crate::poses::Shared;
use crate::settings::Settings;
use crate::stamps;

pub(crate) const LAYOUT: Layout = Layout { name: "KITTI raw", is, describe };

const CAMERAS: [&str; 4] = ["00", "01", "02", "03"];

fn is(folder: &Path) -> bool {
    CAMERAS.iter().any(|n| has_picture(&folder.join(format!("image_{n}/data"))))
}

/// A calibration of the day: in the folder above, or in the drive's own.
fn of_day(folder: &Path, file: &str) -> Option<PathBuf> {
    let real = folder.canonicalize().unwrap_or_else(|_| folder.to_path_buf());
    let above = real.parent().map(|p| p.join(file));
    above.into_iter().chain([folder.join(file)]).find(|p| p.is_file())
}

/// The first rectified camera in the body: through the laser scanner, where the files are there.
fn body_from_first(folder: &Path, cameras: &Lines) -> DataResult<Option<Rigid<Body, FirstCamera>>> {
    let (Some(imu), Some(velo)) =
        (of_day(folder, "calib_imu_to_velo.txt"), of_day(folder, "calib_velo_to_cam.txt"))
    else {
        return Ok(None);
    };
    let velo_from_body: Rigid<Cloud, Body> = Lines::read(&imu)?.rigid("R", "T")?;
    let raw_from_velo: Rigid<FirstCamera, Cloud> = Lines::read(&velo)?.rigid("R", "T")?;
    let rectified_from_raw: Rigid<FirstCamera, FirstCamera> = cameras.rigid("R_rect_00", "")?;
    Ok(Some((rectified_from_raw * raw_from_velo * velo_from_body).inverse()))
}

/// A camera's part of the day's calibration.
fn camera(folder: &Path, lines: &Lines, number: &str) -> DataResult<(Intrinsics, BodyFromCamera)> {
    let (mut intrinsics, place) = lines.projection(&format!("P_rect_{number}"))?;
    let size = lines.numbers::<2>(&format!("S_rect_{number}"))?;
    intrinsics.size = Some(size.map(|side| side as u32));
    let first = body_from_first(folder, lines)?.unwrap_or_else(Rigid::identity);
    Ok((intrinsics, first * place.reinterpret::<FirstCamera, _>()))
}

fn describe(folder: &Path, _: &Settings) -> DataResult<Description> {
    let mut found = Description::new(LAYOUT.name, folder);
    let file = of_day(folder, "calib_cam_to_cam.txt")
        .unwrap_or_else(|| folder.parent().unwrap_or(folder).join("calib_cam_to_cam.txt"));
    for number in CAMERAS {
        let inside = folder.join(format!("image_{number}"));
        if !has_picture(&inside.join("data")) {
            continue;
        }
        let (file, root) = (file.clone(), folder.to_path_buf());
        let read = Shared::new(move || camera(&root, &Lines::read(&file)?, number));
        let place = read.clone();
        found.cameras.push(CameraPart {
            name: format!("image_{number}"),
            frames: Box::new(move || {
                let list = List::read(&inside.join("timestamps.txt"))?;
                stamps::by_list(&list, &[], &pictures(&inside.join("data"))?)
            }),
            intrinsics: Box::new(move || Ok(read.get()?.0.clone())),
            place: Place::Fixed(Box::new(move || Ok(place.get()?.1))),
            depth: None,
        });
    }
    let first = Lines::read(&file).and_then(|lines| body_from_first(folder, &lines)).ok().flatten();
    found.floor = first.as_ref().map_or(Ok(Floor::Unknown), road)?;
    let packets = folder.join("oxts");
    if packets.is_dir() && first.is_some() {
        let (of_poses, of_samples) = (packets.clone(), packets);
        let read = Box::new(move || oxts::poses(&of_poses));
        found.streams.push(StreamPart { name: GROUND_TRUTH.to_string(), read });
        found.imu = Some(Box::new(move || oxts::samples(&of_samples)));
        found.fact("the body is the IMU; its poses are GPS and IMU (oxts) in metres by Mercator, x east, y north, z up");
        found.fact("the road is 1.65 m below the cameras, by the authors' drawing of the car");
    } else if packets.is_dir() {
        found.doubt(
            "oxts-not-used",
            "poses of the IMU are not used, since nothing says where the cameras sit in it",
            "calib_imu_to_velo.txt and calib_velo_to_cam.txt of that day belong into the folder above",
        );
    }
    if first.is_none() {
        found.fact("the body is image_00");
        found.floor = road(&Rigid::identity())?;
    }
    Ok(found)
}
