//! A film as a data set.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use vice_core::camera::Camera;
use vice_core::dataset::{
    Dataset, DatasetFactory, Floor, FormatInfo, GROUND_TRUTH, Image, OpenOptions, PixelFormat, Probe,
    SettingInfo,
};
use vice_core::error::{DataError, DataResult};
use vice_core::frames::BodyFromCamera;
use vice_core::imu::{ImuSample, InertialState};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::Stamp;
use vice_core::time_unit::unit_mixup;
use vice_core::trajectory::Trajectory;
use vice_files::trajectory::ReadOptions;
use vice_files::{imu_file, paths};

use crate::description::Description;
use crate::ffmpeg::Ffmpeg;
use crate::stamped::StampedFilm;
use crate::state::reference_state;

const FILE: &str = "vice-video.toml";

/// Opens the format `video`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Video;

impl DatasetFactory for Video {
    fn info(&self) -> FormatInfo {
        FormatInfo {
            name: "video".to_string(),
            description: "a film with stamps, calibration and estimates (vice-video.toml)".to_string(),
            version: env!("CARGO_PKG_VERSION").to_string(),
            offers: ["images", "trajectories", "imu"].map(String::from).to_vec(),
            settings: vec![SettingInfo {
                key: "ffmpeg".to_string(),
                description: "the FFmpeg program (default: ffmpeg on the PATH)".to_string(),
            }],
        }
    }

    fn probe(&self, path: &Path) -> Probe {
        let is_description = path.file_name().is_some_and(|name| name == FILE) && path.is_file();
        if is_description || path.join(FILE).is_file() { Probe::Yes } else { Probe::No }
    }

    fn open(&self, path: &Path, options: &OpenOptions) -> DataResult<Box<dyn Dataset>> {
        let file = if path.is_dir() { path.join(FILE) } else { path.to_path_buf() };
        let ffmpeg = options.settings.get("ffmpeg").map_or_else(Ffmpeg::default, Ffmpeg::new);
        Ok(Box::new(VideoDataset::open(file, ffmpeg)?))
    }
}

struct VideoDataset {
    name: String,
    file: PathBuf,
    description: Description,
    camera: Camera,
    body_from_camera: BodyFromCamera,
    floor: Floor,
    film: StampedFilm,
    /// What looked wrong in what was read so far.
    suspicions: Mutex<Suspicions>,
}

impl VideoDataset {
    fn open(file: PathBuf, ffmpeg: Ffmpeg) -> DataResult<Self> {
        let description = Description::read(&file)?;
        let at_file = |e: DataError| e.at(&file);
        let camera = description.camera.camera().map_err(at_file)?;
        let body_from_camera = description.camera.extrinsics().map_err(at_file)?;
        let floor = description.floor().map_err(at_file)?;
        let film = beside(&file, &description.film)?;
        let stamps = beside(&file, &description.stamps)?;
        for relative in description.trajectories.values().chain(&description.imu) {
            beside(&file, relative)?;
        }
        let format = if description.gray { PixelFormat::Gray8 } else { PixelFormat::Rgb8 };
        let film = StampedFilm::new(film, stamps, (camera.width(), camera.height()), format, ffmpeg);
        let folder = file.canonicalize().ok().and_then(|f| Some(f.parent()?.file_name()?.to_owned()));
        let folder = folder.map(|name| name.to_string_lossy().into_owned());
        let name = description.name.clone().or(folder).unwrap_or_else(|| "film".to_string());
        Ok(Self {
            name,
            file,
            description,
            camera,
            body_from_camera,
            floor,
            film,
            suspicions: Mutex::default(),
        })
    }

    fn suspect(&self, found: Suspicions) {
        let mut list = self.suspicions.lock().unwrap_or_else(PoisonError::into_inner);
        // A file that is read twice is not twice as wrong.
        let fresh: Vec<Suspicion> =
            found.into_iter().filter(|s| !list.iter().any(|known| known == s)).collect();
        list.extend(fresh);
    }

    fn check_camera(&self, camera: &str) -> DataResult<()> {
        let known = &self.description.camera.name;
        if camera == known {
            Ok(())
        } else {
            Err(DataError::new(format!("there is no camera `{camera}`"))
                .at(&self.file)
                .hint(format!("it has: {known}")))
        }
    }
}

/// The path of a file that a description names, below the description's folder.
fn beside(file: &Path, relative: &str) -> DataResult<PathBuf> {
    let folder = file.parent().filter(|f| !f.as_os_str().is_empty()).unwrap_or(Path::new("."));
    paths::safe_join(folder, relative).map_err(|e| {
        DataError::new(e.problem().to_string()).at(file).hint("paths stay below the file's folder")
    })
}

impl Dataset for VideoDataset {
    fn name(&self) -> &str {
        &self.name
    }

    fn format(&self) -> &str {
        "video"
    }

    fn cameras(&self) -> Vec<String> {
        vec![self.description.camera.name.clone()]
    }

    fn camera(&self, camera: &str) -> DataResult<Camera> {
        self.check_camera(camera)?;
        Ok(self.camera)
    }

    fn frames(&self, camera: &str) -> DataResult<Arc<[Stamp]>> {
        self.check_camera(camera)?;
        self.film.frames()
    }

    fn image(&self, camera: &str, index: usize) -> DataResult<Image> {
        self.check_camera(camera)?;
        self.film.image(index)
    }

    fn body_from_camera(&self, camera: &str, _stamp: Stamp) -> DataResult<BodyFromCamera> {
        self.check_camera(camera)?;
        Ok(self.body_from_camera)
    }

    fn streams(&self) -> Vec<String> {
        let mut names: Vec<String> = self.description.trajectories.keys().cloned().collect();
        // The reference goes first, the others stay sorted.
        names.sort_by_key(|name| name != GROUND_TRUTH);
        names
    }

    fn trajectory(&self, stream: &str) -> DataResult<Trajectory> {
        let Some(relative) = self.description.trajectories.get(stream) else {
            let known = self.streams().join(", ");
            let known = if known.is_empty() { "none".to_string() } else { known };
            return Err(DataError::new(format!("there is no pose stream `{stream}`"))
                .at(&self.file)
                .hint(format!("it has: {known}")));
        };
        let path = beside(&self.file, relative)?;
        let file = vice_files::trajectory::read(&path, &ReadOptions::default())?;
        self.suspect(file.suspicions);
        let trajectory = file.trajectory;
        let frames = self.film.frames()?;
        let frames = (frames[0], frames[frames.len() - 1]);
        if let Some(error) = unit_mixup(frames, (trajectory.start(), trajectory.end())) {
            return Err(error.at(&path));
        }
        Ok(trajectory)
    }

    fn imu(&self) -> DataResult<Arc<[ImuSample]>> {
        match &self.description.imu {
            Some(relative) => {
                let file = imu_file::read(beside(&self.file, relative)?)?;
                self.suspect(file.suspicions);
                Ok(file.samples.into())
            }
            None => Ok(Arc::new([])),
        }
    }

    fn inertial_state(&self, stamp: Stamp) -> DataResult<Option<InertialState>> {
        if !self.description.trajectories.contains_key(GROUND_TRUTH) {
            return Ok(None);
        }
        reference_state(&self.trajectory(GROUND_TRUTH)?, stamp, None)
    }

    fn suspicions(&self) -> Vec<Suspicion> {
        let list = self.suspicions.lock().unwrap_or_else(PoisonError::into_inner);
        list.clone().into_iter().collect()
    }

    fn floor(&self, _keyframe: Stamp) -> DataResult<Floor> {
        Ok(self.floor)
    }
}

#[cfg(test)]
mod tests;
