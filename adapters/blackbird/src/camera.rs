//! Frames of one camera: a film, pictures that were unpacked from it, or stamps alone.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;
use vice_files::image_file;
use vice_video::{Ffmpeg, StampedFilm, check_count, read_stamps};

use crate::layout::{CameraFolder, Kind, STAMPS, pictures};

/// What pictures may be called.
const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

/// A colour or gray camera.
#[derive(Debug)]
pub(crate) struct CameraFrames {
    pub(crate) folder: CameraFolder,
    size: (u32, u32),
    source: Source,
}

#[derive(Debug)]
enum Source {
    Film(Box<StampedFilm>),
    Pictures {
        files: Vec<PathBuf>,
        stamps: OnceLock<Arc<[Stamp]>>,
    },
    /// Neither was downloaded: the stamps are enough for all that needs no pixels.
    StampsOnly(OnceLock<Arc<[Stamp]>>),
}

impl CameraFrames {
    pub(crate) fn new(folder: CameraFolder, size: (u32, u32), ffmpeg: Ffmpeg) -> Self {
        let files = pictures(&folder.path.join("images"), &PICTURES);
        let film = folder.path.join("lossless.mov");
        let source = if !files.is_empty() {
            Source::Pictures { files, stamps: OnceLock::new() }
        } else if film.exists() {
            let format = if folder.kind == Kind::Gray { PixelFormat::Gray8 } else { PixelFormat::Rgb8 };
            Source::Film(Box::new(StampedFilm::new(film, folder.path.join(STAMPS), size, format, ffmpeg)))
        } else {
            Source::StampsOnly(OnceLock::new())
        };
        Self { folder, size, source }
    }

    /// Where the pixels come from, for `vice info`.
    pub(crate) fn describe(&self) -> String {
        match &self.source {
            Source::Film(_) => "lossless.mov".to_string(),
            Source::Pictures { files, .. } => format!("{} unpacked images", files.len()),
            Source::StampsOnly(_) => "stamps only, no pixels".to_string(),
        }
    }

    /// Stamps of the frames.
    pub(crate) fn frames(&self) -> DataResult<Arc<[Stamp]>> {
        let path = self.folder.path.join(STAMPS);
        match &self.source {
            Source::Film(film) => film.frames(),
            Source::StampsOnly(stamps) => {
                if let Some(stamps) = stamps.get() {
                    return Ok(Arc::clone(stamps));
                }
                let read = read_stamps(&path)?;
                Ok(Arc::clone(stamps.get_or_init(|| read)))
            }
            Source::Pictures { files, stamps } => {
                if let Some(stamps) = stamps.get() {
                    return Ok(Arc::clone(stamps));
                }
                let read = read_stamps(&path)?;
                check_count(&path, read.len(), &self.folder.path.join("images"), files.len())?;
                Ok(Arc::clone(stamps.get_or_init(|| read)))
            }
        }
    }

    /// The file of a frame, where it was unpacked.
    pub(crate) fn image_file(&self, index: usize) -> DataResult<Option<Vec<u8>>> {
        match &self.source {
            Source::Pictures { files, .. } if index < files.len() => {
                image_file::read_bytes(&files[index]).map(Some)
            }
            _ => Ok(None),
        }
    }

    /// Decodes a frame.
    pub(crate) fn image(&self, index: usize) -> DataResult<Image> {
        let frames = self.frames()?;
        if index >= frames.len() {
            return Err(DataError::new(format!(
                "there is no frame {index}, the camera has {}",
                frames.len()
            ))
            .at(&self.folder.path));
        }
        match &self.source {
            Source::Film(film) => film.image(index),
            Source::StampsOnly(_) => {
                Err(DataError::new("there are no pixels: neither lossless.mov nor images/")
                    .at(&self.folder.path)
                    .hint("download the film of this camera"))
            }
            Source::Pictures { files, .. } => {
                let image = image_file::read(&files[index])?;
                if (image.width(), image.height()) == self.size {
                    return Ok(image);
                }
                let ((width, height), (expected_width, expected_height)) =
                    ((image.width(), image.height()), self.size);
                Err(DataError::new(format!(
                    "is {width}x{height} pixels, the camera's are {expected_width}x{expected_height}"
                ))
                .at(&files[index]))
            }
        }
    }
}
