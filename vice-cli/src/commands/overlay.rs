//! `vice overlay`: the paper's videos.

use std::path::{Path, PathBuf};

use vice_core::dataset::{Dataset, Image};
use vice_core::error::DataError;
use vice_core::metrics::align::Alignment;
use vice_core::result::ResultDocument;
use vice_core::time::Stamp;
use vice_files::atomic::{Overwrite, prepare_folder, write};
use vice_files::image_file::encode_png;
use vice_video::Ffmpeg;

use crate::inputs::{EvaluationArgs, Outputs, Scoring, positive, split_list};
use crate::report::film_frame;
use crate::report::marks::Marks;
use crate::report::numbers::time_zero;
use crate::terminal::{self, Outcome, Verbosity, usage};

/// Endings that make a film.
const FILMS: [&str; 3] = ["mp4", "mov", "mkv"];

/// Arguments of `vice overlay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice overlay V1_01_easy --labels floor.csv --estimate imu-euler --out film.mp4\n  \
    vice overlay my_run --labels labels.json --estimate slam.txt --out frames/\n\n\
    Blue rings: labels (filled at key frames); red: the reference; green and other colours: the estimates. The\n\
    labelled frames are shown, with what --fps, --start and --duration leave of them. A film needs FFmpeg on the PATH.")]
pub(crate) struct Args {
    #[command(flatten)]
    evaluation: EvaluationArgs,
    /// Film to write (.mp4, .mov, .mkv), or a folder for PNG frames.
    #[arg(long, value_name = "FILM|DIR", help_heading = "Output")]
    out: PathBuf,
    /// Frames a second of the film [default: as they were recorded].
    #[arg(long, value_name = "HZ", value_parser = positive, help_heading = "Output")]
    film_fps: Option<f64>,
    /// Replace a film, or write into a folder that is not empty.
    #[arg(long, help_heading = "Output")]
    force: bool,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let film = is_film(&args.out)?;
    check_output(args, film)?;
    if split_list(&args.evaluation.depth).len() > 1 {
        return Err(usage("--depth: name one source, since a frame shows one place for each stream"));
    }
    let scoring = Scoring { subsets: vec![], align: Alignment::None, keep_samples: true };
    let (document, dataset) = args.evaluation.evaluate(&scoring, verbosity, None)?;
    let marks = Marks::of(&document, None)
        .ok_or_else(|| anyhow::anyhow!("no label could be scored, so that there is nothing to draw"))?;
    let frames = Frames { document: &document, dataset: dataset.as_ref(), marks: &marks };
    let count = match film {
        true => frames.film(&args.out, args.film_fps, verbosity)?,
        false => frames.folder(&args.out, args.force, verbosity)?,
    };
    terminal::print(&format!(
        "{count} frames in {}\n",
        terminal::printable(&args.out.display().to_string())
    ))?;
    Ok(Outcome::Done)
}

fn is_film(out: &Path) -> anyhow::Result<bool> {
    let ending = out.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase);
    match ending {
        _ if out.is_dir() => Ok(false),
        None => Ok(false),
        Some(ending) if FILMS.contains(&ending.as_str()) => Ok(true),
        Some(ending) => Err(usage(format!(
            "--out: .{ending} is no film that can be written; use .mp4, .mov or .mkv, or name a folder for PNG frames"
        ))),
    }
}

/// Looks before the work, so that a mistake costs nothing.
fn check_output(args: &Args, film: bool) -> anyhow::Result<()> {
    // In a folder that is there any name stands for all frames.
    let probe = if args.out.is_dir() { args.out.join("frame.png") } else { args.out.clone() };
    Outputs::new(&[&Some(probe)], &args.evaluation.files())?;
    if film {
        if args.out.exists() && !args.force {
            return Err(DataError::new("exists already").at(&args.out).hint("--force replaces it").into());
        }
        Ffmpeg::default().check().map_err(|e| {
            anyhow::Error::new(e)
                .context("a film needs FFmpeg; without it name a folder, which takes PNG frames")
        })?;
    }
    Ok(())
}

struct Frames<'a> {
    document: &'a ResultDocument,
    dataset: &'a dyn Dataset,
    marks: &'a Marks,
}

impl Frames<'_> {
    fn film(&self, out: &Path, rate_hz: Option<f64>, verbosity: Verbosity) -> anyhow::Result<usize> {
        let rate_hz = rate_hz.unwrap_or_else(|| usual_rate_hz(self.marks.frames.keys().copied()));
        let mut writer = None;
        let count = self.each(verbosity, &mut |_, _, image| {
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

    fn folder(&self, out: &Path, force: bool, verbosity: Verbosity) -> anyhow::Result<usize> {
        prepare_folder(out, force)?;
        self.each(verbosity, &mut |index, stamp, image| {
            let png = encode_png(image)?;
            let path = out.join(format!("{index:06}_{stamp}.png"));
            Ok(write(path, Overwrite::from_force(force), |w| w.write_all(&png))?)
        })
    }

    /// One frame after another in memory: decoded, drawn on, given away.
    fn each(
        &self,
        verbosity: Verbosity,
        give: &mut dyn FnMut(usize, Stamp, &Image) -> anyhow::Result<()>,
    ) -> anyhow::Result<usize> {
        let camera = &self.document.dataset.camera;
        let stamps = self.dataset.frames(camera)?;
        let zero = time_zero(self.document);
        let bar = verbosity.progress("drawing frames");
        bar.set_length(self.marks.frames.len() as u64);
        for (count, stamp) in self.marks.frames.keys().enumerate() {
            let index = stamps
                .binary_search(stamp)
                .map_err(|_| anyhow::anyhow!("camera {camera} has no frame at {stamp} ns"))?;
            let image = self.dataset.image(camera, index)?;
            give(count, *stamp, &film_frame::draw(&image, self.marks, *stamp, zero)?)?;
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(self.marks.frames.len())
    }
}

/// The rate at which most frames follow each other, from 1 to 60.
fn usual_rate_hz(stamps: impl Iterator<Item = Stamp>) -> f64 {
    let stamps: Vec<Stamp> = stamps.collect();
    let mut steps: Vec<f64> = stamps.windows(2).map(|w| w[1].since(w[0]).as_secs_f64()).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).map_or(10.0, |step| (1.0 / step).clamp(1.0, 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_tells_a_film_from_a_folder() {
        assert!(is_film(Path::new("a.MP4")).unwrap() && is_film(Path::new("b/a.mkv")).unwrap());
        assert!(!is_film(Path::new("frames")).unwrap() && !is_film(Path::new("frames/")).unwrap());
        assert!(is_film(Path::new("a.gif")).is_err());
        let rate = |millis: &[i64]| usual_rate_hz(millis.iter().map(|m| Stamp::from_nanos(m * 1_000_000)));
        assert!((rate(&[0, 50, 100, 150, 900]) - 20.0).abs() < 1e-9);
        assert_eq!((rate(&[0]), rate(&[0, 60_000])), (10.0, 1.0));
    }
}
