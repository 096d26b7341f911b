//! The paper's videos: labels and carried points on the images, as a film or as PNG frames.

use std::path::Path;

use vice_core::dataset::{Dataset, Image};
use vice_core::statistics::middle;
use vice_core::time::Stamp;
use vice_files::atomic::{Overwrite, prepare_folder, write};
use vice_files::image_file::encode_png;
use vice_video::Ffmpeg;

use crate::error::{RunError, RunResult};
use crate::progress::Progress;
use crate::report::film_frame;
use crate::report::marks::Marks;
use crate::report::numbers::time_zero;
use crate::result::ResultDocument;

/// Drawn frames that wait to be written: enough that neither side waits for a slow frame of the other.
const FRAMES_AHEAD: usize = 4;

/// What is written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output<'a> {
    /// A film, at this rate or as the frames were recorded.
    Film(&'a Path, Option<f64>),
    /// A folder of PNG frames; whether it may hold files already.
    Folder(&'a Path, bool),
}

/// Draws the labelled frames; their number.
///
/// # Errors
/// [`RunError`] if nothing was scored, an image cannot be read, or the output cannot be written.
pub fn draw(
    document: &ResultDocument,
    dataset: &dyn Dataset,
    output: Output<'_>,
    progress: &Progress<'_>,
) -> RunResult<usize> {
    let marks = Marks::of(document, None)
        .ok_or_else(|| RunError::missing("no label could be scored, so that there is nothing to draw"))?;
    let frames = Frames { document, dataset, marks: &marks };
    match output {
        Output::Film(path, rate_hz) => frames.film(path, rate_hz, progress),
        Output::Folder(path, force) => frames.folder(path, force, progress),
    }
}

/// Whether films can be written here.
///
/// # Errors
/// [`RunError`] if FFmpeg is not there.
pub fn check_writer() -> RunResult<()> {
    Ffmpeg::default().check().map_err(|e| {
        RunError::missing("a film needs FFmpeg; without it name a folder, which takes PNG frames").because(e)
    })
}

struct Frames<'a> {
    document: &'a ResultDocument,
    dataset: &'a dyn Dataset,
    marks: &'a Marks,
}

impl Frames<'_> {
    fn film(&self, out: &Path, rate_hz: Option<f64>, progress: &Progress<'_>) -> RunResult<usize> {
        let rate_hz = rate_hz.unwrap_or_else(|| usual_rate_hz(self.marks.frames.keys().copied()));
        let mut writer = None;
        let count = self.each(progress, &mut |_, _, image| {
            let size_px = [image.width(), image.height()];
            let film = match &mut writer {
                Some(film) => film,
                None => writer.insert(Ffmpeg::default().film_writer(out, size_px, rate_hz)?),
            };
            Ok(film.push(image)?)
        })?;
        if let Some(film) = writer {
            film.finish()?;
        }
        Ok(count)
    }

    fn folder(&self, out: &Path, force: bool, progress: &Progress<'_>) -> RunResult<usize> {
        prepare_folder(out, force)?;
        self.each(progress, &mut |index, stamp, image| {
            let png = encode_png(image)?;
            let path = out.join(format!("{index:06}_{stamp}.png"));
            Ok(write(path, Overwrite::from_force(force), |w| w.write_all(&png))?)
        })
    }

    /// One frame after another: decoded and drawn on by one thread while another gives the last ones away.
    fn each(
        &self,
        progress: &Progress<'_>,
        give: &mut dyn FnMut(usize, Stamp, &Image) -> RunResult<()>,
    ) -> RunResult<usize> {
        let camera = &self.document.dataset.camera;
        let stamps = self.dataset.frames(camera)?;
        let zero = time_zero(self.document);
        let draw = |stamp: Stamp| -> RunResult<(Stamp, Image)> {
            let index = stamps
                .binary_search(&stamp)
                .map_err(|_| RunError::missing(format!("camera {camera} has no frame at {stamp} ns")))?;
            let image = self.dataset.image(camera, index)?;
            Ok((stamp, film_frame::draw(&image, self.marks, stamp, zero)?))
        };
        let (ready, drawn) = std::sync::mpsc::sync_channel(FRAMES_AHEAD);
        std::thread::scope(|scope| {
            scope.spawn(move || {
                for stamp in self.marks.frames.keys() {
                    let frame = draw(*stamp);
                    let failed = frame.is_err();
                    // Nobody listens any more where a frame could not be written.
                    if ready.send(frame).is_err() || failed {
                        return;
                    }
                }
            });
            let mut count = 0;
            for frame in drawn {
                let (stamp, image) = frame?;
                give(count, stamp, &image)?;
                count += 1;
                progress("drawing frames", count, self.marks.frames.len());
            }
            Ok(count)
        })
    }
}

/// The rate at which most frames follow each other, from 1 to 60.
fn usual_rate_hz(stamps: impl Iterator<Item = Stamp>) -> f64 {
    let stamps: Vec<Stamp> = stamps.collect();
    let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1].since(w[0]).as_secs_f64()).collect();
    middle(&mut steps, f64::total_cmp).map_or(10.0, |step| (1.0 / step).clamp(1.0, 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_film_runs_as_most_frames_follow_each_other() {
        let rate = |millis: &[i64]| usual_rate_hz(millis.iter().map(|m| Stamp::from_nanos(m * 1_000_000)));
        assert!((rate(&[0, 50, 100, 150, 900]) - 20.0).abs() < 1e-9);
        assert_eq!((rate(&[0]), rate(&[0, 60_000])), (10.0, 1.0));
    }
}
