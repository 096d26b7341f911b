//! A film and the list of its frames' stamps, matched by order.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::time::Stamp;
use vice_files::columns::TimeUnit;
use vice_files::heading::TimeColumn;
use vice_files::rows;

use crate::ffmpeg::Ffmpeg;
use crate::film::{DecodeStats, Film};

/// Reads a list of stamps: one integer of nanoseconds a line, strictly increasing.
///
/// # Errors
/// [`DataError`] with path and line if the file is missing or empty, or a line is no stamp or not later than the one before.
pub fn read_stamps(path: impl AsRef<Path>) -> DataResult<Arc<[Stamp]>> {
    let path = path.as_ref();
    let mut stamps: Vec<Stamp> = Vec::new();
    let mut rows =
        rows::open(path).map_err(|e| e.hint("the stamps of the camera's frames are read from it"))?;
    let mut read = || {
        let beginning = rows.begin()?;
        let mut time = match &beginning.heading {
            Some(heading) => heading
                .time()?
                .filter(|_| heading.names().len() == 1)
                .map(|t| t.small_in(TimeUnit::Nanos))
                .ok_or_else(|| {
                    let first = heading.names().first().map_or("", |n| n.text.as_str());
                    DataError::new(format!("column 1: `{first}` is no time stamp")).line(heading.line())
                })?,
            None => TimeColumn::new(0, Some(TimeUnit::Nanos)),
        };
        while let Some(row) = rows.next_row()? {
            if row.len() > 1 {
                return Err(row.error(format!("expected one stamp a line, found {} columns", row.len())));
            }
            let stamp = time.stamp(&row)?;
            if let Some(previous) = stamps.last().filter(|p| **p >= stamp) {
                return Err(
                    row.error(format!("stamp {stamp} ns is not later than the one before, {previous} ns"))
                );
            }
            stamps.push(stamp);
        }
        Ok(())
    };
    read().map_err(|e: DataError| e.at(path))?;
    if stamps.is_empty() {
        return Err(DataError::new("holds no stamps").at(path));
    }
    Ok(stamps.into())
}

/// Frames are matched to stamps by their order, which only makes sense where there are as many of both.
///
/// # Errors
/// [`DataError`] at the list of stamps, with both counts.
pub fn check_count(stamps_path: &Path, stamps: usize, frames_path: &Path, frames: usize) -> DataResult<()> {
    if stamps == frames {
        return Ok(());
    }
    let more = if stamps > frames { "more" } else { "fewer" };
    Err(DataError::new(format!(
        "{more} stamps than frames: {stamps} stamps, but {} has {frames} frames",
        frames_path.display()
    ))
    .at(stamps_path)
    .hint("they are matched by order, so their numbers must be the same"))
}

/// A film with the stamps of its frames and the size that the calibration is for.
///
/// Nothing is opened before it is asked for; both files are read once.
#[derive(Debug)]
pub struct StampedFilm {
    film: PathBuf,
    stamps: PathBuf,
    size: (u32, u32),
    format: PixelFormat,
    ffmpeg: Ffmpeg,
    opened: OnceLock<(Arc<[Stamp]>, Film)>,
}

impl StampedFilm {
    /// A film by its path, the path of its stamps, and columns and rows of the calibration.
    pub fn new(
        film: PathBuf,
        stamps: PathBuf,
        size: (u32, u32),
        format: PixelFormat,
        ffmpeg: Ffmpeg,
    ) -> Self {
        Self { film, stamps, size, format, ffmpeg, opened: OnceLock::new() }
    }

    /// Stamps of the frames. FFmpeg is not needed for them: the film's own index is counted.
    ///
    /// # Errors
    /// [`DataError`] if a file is missing or cannot be used, or their counts or the size of the film do not fit.
    pub fn frames(&self) -> DataResult<Arc<[Stamp]>> {
        Ok(Arc::clone(&self.opened()?.0))
    }

    /// Decodes a frame; see [`Film::frame`].
    ///
    /// # Errors
    /// [`DataError`] as [`StampedFilm::frames`] and [`Film::frame`].
    pub fn image(&self, index: usize) -> DataResult<Image> {
        self.opened()?.1.frame(index)
    }

    /// What decoding has cost so far.
    pub fn stats(&self) -> DecodeStats {
        self.opened.get().map(|(_, film)| film.stats()).unwrap_or_default()
    }

    fn opened(&self) -> DataResult<&(Arc<[Stamp]>, Film)> {
        if let Some(opened) = self.opened.get() {
            return Ok(opened);
        }
        let stamps = read_stamps(&self.stamps)?;
        let film = Film::open(&self.film, self.format, self.ffmpeg.clone())?;
        check_count(&self.stamps, stamps.len(), &self.film, film.frame_count())?;
        if film.size() != self.size {
            let ((width, height), (calibrated_width, calibrated_height)) = (film.size(), self.size);
            return Err(DataError::new(format!(
                "the film is {width}x{height} pixels, its calibration is for {calibrated_width}x{calibrated_height}"
            ))
            .at(&self.film));
        }
        Ok(self.opened.get_or_init(|| (stamps, film)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_are_integers_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("stamps.txt");
        let read = |text: &str| {
            std::fs::write(&path, text).unwrap();
            read_stamps(&path).map_err(|e| e.to_string())
        };
        let stamps = read("# ns\n1526182346402317409\r\n1526182346502317409\n").unwrap();
        assert_eq!(stamps[0], Stamp::from_nanos(1_526_182_346_402_317_409));
        for named in [
            "timestamp [ns]\n1526182346402317409\n",
            "t\n1526182346402317409\n",
            "\u{feff}stamp_us\r\n1526182346402317.409\n",
        ] {
            assert_eq!(read(named).unwrap()[..], stamps[..1], "{named}");
        }
        for (text, says) in [
            ("", "no stamps"),
            ("name\n1\n", "stamps.txt:1: column 1: `name` is no time stamp"),
            ("1\n2\n2\n", "stamps.txt:3: stamp 2 ns is not later"),
            ("1\nx\n", "stamps.txt:2: column 1: `x` is no time stamp"),
            ("1,a.png\n", "stamps.txt:1: expected one stamp a line, found 2 columns"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
        let error = read_stamps(folder.path().join("none")).unwrap_err().to_string();
        assert!(error.contains("none: no such file (the stamps of the camera's frames"), "{error}");
    }

    #[test]
    fn counts_must_match() {
        let check = |stamps, frames| {
            check_count(Path::new("s.txt"), stamps, Path::new("f.mov"), frames).map_err(|e| e.to_string())
        };
        assert!(check(3, 3).is_ok());
        assert!(
            check(4, 3).unwrap_err().contains("s.txt: more stamps than frames: 4 stamps, but f.mov has 3")
        );
        assert!(check(2, 3).unwrap_err().contains("fewer stamps than frames"));
    }
}
