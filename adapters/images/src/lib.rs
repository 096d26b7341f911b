//! Folders of images for VICE: those of public data sets, and one's own.
//!
//! | layout | told by |
//! | --- | --- |
//! | one's own | `vice.toml` with a table `[images]`; `vice init` writes it |
//! | TUM RGB-D | `rgb.txt` |
//! | ICL-NUIM | `*.gt.freiburg` beside `rgb` |
//! | 7-Scenes | `frame-000000.color.png` and `frame-000000.pose.txt` |
//! | KITTI odometry | `calib.txt` beside `image_0` |
//! | KITTI raw | `image_02/data` |
//! | TUM-VI | `mav0` without `sensor.yaml`, beside `dso` |
//! | UZH-FPV | `left_images.txt` or `images.txt` beside `img` |
//! | nerfstudio | `transforms.json` |
//! | COLMAP | `cameras.txt` or `cameras.bin`, also in `sparse/0` |
//!
//! Each layout is one file: where its files are, which conventions its numbers have, and what it does not say. The
//! readers are shared. Stamps are integers, poses `world_from_body` in metres, the world's z points up: where nothing
//! tells which way is up the floor is unknown, and depth by the floor is refused. Nothing is decoded that is not asked for.
#![forbid(unsafe_code)]

mod calibration;
mod colmap;
mod dataset;
mod files;
mod guess;
mod layouts;
mod list;
mod parts;
mod poses;
mod settings;
mod stamps;

use std::path::{Path, PathBuf};

use vice_core::dataset::{Dataset, DatasetFactory, FormatInfo, OpenOptions, Probe, SettingInfo};
use vice_core::error::{DataError, DataResult, ErrorKind};

pub use guess::{Guess, GuessedCamera, When, guess};
use layouts::Layout;
use settings::Settings;

/// The format's name.
pub const NAME: &str = "images";

/// Opens folders of images.
#[derive(Clone, Copy, Debug, Default)]
pub struct Images;

impl DatasetFactory for Images {
    fn info(&self) -> FormatInfo {
        let setting = |(key, description): &(&str, &str)| SettingInfo {
            key: (*key).to_string(),
            description: (*description).to_string(),
        };
        FormatInfo {
            name: NAME.into(),
            description: "folders of images: described by a vice.toml (vice init writes it), or in the layout of TUM RGB-D, TUM-VI, \
                          KITTI, 7-Scenes, ICL-NUIM, UZH-FPV, COLMAP or nerfstudio"
                .into(),
            version: env!("CARGO_PKG_VERSION").into(),
            offers: ["images", "ground truth", "imu", "point cloud", "depth images"].map(Into::into).into(),
            settings: settings::KEYS.iter().map(setting).collect(),
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        if layout_of(path).is_some() {
            return Probe::Yes;
        }
        // A folder of recordings, such as a scene of 7-Scenes or all sequences of KITTI.
        let inside: Vec<PathBuf> =
            files::folders(path).into_iter().filter(|p| layout_of(p).is_some()).collect();
        if inside.is_empty() { Probe::No } else { Probe::Collection(inside) }
    }

    fn is_general(&self) -> bool {
        true
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        let layout = layout_of(path).ok_or_else(|| {
            DataError::of_kind(ErrorKind::Unsupported, "is no folder of images in a layout that is known")
                .at(path)
                .hint("`vice init` looks at it and writes a vice.toml that says what it holds")
        })?;
        let settings = Settings::read(options)?;
        let description = (layout.describe)(path, &settings)?;
        settings.check_used()?;
        Ok(Box::new(dataset::Folder::new(description)))
    }
}

fn layout_of(path: &Path) -> Option<&'static Layout> {
    if !path.is_dir() {
        return None;
    }
    layouts::ALL.iter().find(|layout| (layout.is)(path))
}
