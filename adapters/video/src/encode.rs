//! Images to a film, through a pipe into FFmpeg.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Stdio};
use std::thread::JoinHandle;

use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};

use crate::ffmpeg::{Ffmpeg, INSTALL};

/// Bytes of FFmpeg's complaints that are kept.
const KEPT_BYTES: u64 = 16_384;

/// A film that is being written. It takes its name when it is finished; dropped before, it leaves nothing.
#[derive(Debug)]
pub struct FilmWriter {
    child: Child,
    stdin: Option<ChildStdin>,
    complaints: Option<JoinHandle<String>>,
    unfinished: tempfile::TempPath,
    target: PathBuf,
    size_px: [u32; 2],
}

impl Ffmpeg {
    /// Starts a film of colour images of one size (columns, rows), `rate_hz` of them a second. The ending of the name
    /// (`mp4`, `mov`, `mkv`) chooses the container.
    ///
    /// # Errors
    /// [`DataError`] if FFmpeg is missing or too old, or the folder of the film cannot be written.
    pub fn film_writer(&self, target: &Path, size_px: [u32; 2], rate_hz: f64) -> DataResult<FilmWriter> {
        self.check()?;
        let failed = |e: std::io::Error| DataError::new("cannot be written").at(target).because(e);
        let folder = target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let ending = target.extension().and_then(|e| e.to_str()).unwrap_or("mp4").to_ascii_lowercase();
        let mut beside = tempfile::Builder::new();
        let suffix = format!(".part.{ending}");
        beside.prefix(".vice-").suffix(&suffix);
        // As private as any new file, not as a temporary one.
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            beside.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let unfinished = beside.tempfile_in(folder).map_err(failed)?.into_temp_path();
        let absolute = std::path::absolute(&unfinished).map_err(failed)?;
        let mut output = std::ffi::OsString::from("file:");
        output.push(&absolute);
        let mut command = self.command();
        command
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args(["-f", "rawvideo", "-pix_fmt", "rgb24"])
            .args(["-s", &format!("{}x{}", size_px[0], size_px[1]), "-r", &format!("{rate_hz:.6}")])
            .args(["-i", "pipe:0", "-an"])
            // Players want even sizes and 4:2:0.
            .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p"])
            .args(self.encoder()?)
            .args(if ending == "mkv" { &[][..] } else { &["-movflags", "+faststart"][..] })
            .arg(output)
            .stdin(Stdio::piped())
            .stdout(Stdio::null());
        let mut child = command
            .spawn()
            .map_err(|e| DataError::new("FFmpeg cannot be started").hint(INSTALL).because(e))?;
        let (Some(stdin), Some(stderr)) = (child.stdin.take(), child.stderr.take()) else {
            return Err(DataError::new("FFmpeg was started without pipes"));
        };
        // Read all the time: a full pipe would stop FFmpeg.
        let complaints = std::thread::spawn(move || {
            let mut stderr = stderr;
            let mut text = Vec::new();
            let _ = stderr.by_ref().take(KEPT_BYTES).read_to_end(&mut text);
            let _ = std::io::copy(&mut stderr, &mut std::io::sink());
            String::from_utf8_lossy(&text).into_owned()
        });
        Ok(FilmWriter {
            child,
            stdin: Some(stdin),
            complaints: Some(complaints),
            unfinished,
            target: target.to_path_buf(),
            size_px,
        })
    }

    /// H.264 where this FFmpeg has it, else MPEG-4, which every one has.
    fn encoder(&self) -> DataResult<&'static [&'static str]> {
        let listed = self.command().args(["-hide_banner", "-encoders"]).output();
        let listed = listed.map_err(|e| DataError::new("FFmpeg cannot be started").because(e))?;
        let has_h264 = String::from_utf8_lossy(&listed.stdout).split_whitespace().any(|w| w == "libx264");
        Ok(if has_h264 { &["-c:v", "libx264", "-crf", "20"] } else { &["-c:v", "mpeg4", "-q:v", "3"] })
    }
}

impl FilmWriter {
    /// Adds an image.
    ///
    /// # Errors
    /// [`DataError`] if it is of another size or kind than the film, or FFmpeg gave up.
    pub fn push(&mut self, image: &Image) -> DataResult<()> {
        let size_px = [image.width(), image.height()];
        if size_px != self.size_px || image.format() != PixelFormat::Rgb8 {
            let [columns, rows] = self.size_px;
            return Err(DataError::new(format!(
                "an image of {}x{} does not fit a film of {columns}x{rows}",
                size_px[0], size_px[1]
            )));
        }
        let written = self.stdin.as_mut().map(|pipe| pipe.write_all(image.data()));
        match written {
            Some(Ok(())) => Ok(()),
            _ => Err(self.failed()),
        }
    }

    /// Waits for FFmpeg and gives the film its name.
    ///
    /// # Errors
    /// [`DataError`] with FFmpeg's words if it failed, or if the film cannot take its name.
    pub fn finish(mut self) -> DataResult<()> {
        drop(self.stdin.take());
        let status = self.child.wait().map_err(|e| DataError::new("FFmpeg was lost").because(e))?;
        if !status.success() {
            return Err(self.failed());
        }
        let target = self.target.clone();
        std::fs::rename(&self.unfinished, &target)
            .map_err(|e| DataError::new("cannot be written").at(&target).because(e))
    }

    /// Why FFmpeg ended.
    fn failed(&mut self) -> DataError {
        drop(self.stdin.take());
        let _ = self.child.wait();
        let said = self.complaints.take().and_then(|c| c.join().ok()).unwrap_or_default();
        let lines: Vec<&str> = said.lines().rev().take(3).collect();
        let said = lines.into_iter().rev().collect::<Vec<_>>().join("; ");
        DataError::new(format!("FFmpeg could not write the film: {said}")).at(&self.target)
    }
}

impl Drop for FilmWriter {
    fn drop(&mut self) {
        drop(self.stdin.take());
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Film;

    fn image(shade: u8) -> Image {
        Image::new(31, 21, PixelFormat::Rgb8, vec![shade; 31 * 21 * 3]).unwrap()
    }

    #[test]
    fn images_become_a_film_that_can_be_read_again() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.mp4");
        let mut film = Ffmpeg::default().film_writer(&target, [31, 21], 10.0).unwrap();
        for shade in [10, 100, 200] {
            film.push(&image(shade)).unwrap();
        }
        assert!(!target.exists(), "not before it is finished");
        film.finish().unwrap();
        assert!(Film::open(&target, PixelFormat::Gray8, Ffmpeg::default()).is_ok());
        let names: Vec<_> =
            std::fs::read_dir(folder.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
        assert_eq!(names, ["a.mp4"]);
    }

    #[test]
    fn a_film_that_is_given_up_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("a.mp4");
        let mut film = Ffmpeg::default().film_writer(&target, [31, 21], 10.0).unwrap();
        film.push(&image(1)).unwrap();
        let other = Image::new(5, 5, PixelFormat::Rgb8, vec![0; 75]).unwrap();
        assert!(film.push(&other).unwrap_err().to_string().contains("5x5"));
        drop(film);
        assert!(std::fs::read_dir(folder.path()).unwrap().next().is_none());
        let missing = Ffmpeg::new("/no/such/ffmpeg").film_writer(&target, [2, 2], 1.0).unwrap_err();
        assert!(missing.to_string().contains("is not installed"));
    }
}
