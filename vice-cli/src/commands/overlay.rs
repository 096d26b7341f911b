//! `vice overlay`: the paper's videos.

use std::path::{Path, PathBuf};

use vice_run::Samples;
use vice_run::core::error::DataError;
use vice_run::core::metrics::align::Alignment;
use vice_run::film::{self, Output};
use vice_run::request::{Request, Scoring};

use crate::inputs::{EvaluationArgs, positive};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, usage, with_progress};

/// Endings that make a film.
const FILMS: [&str; 3] = ["mp4", "mov", "mkv"];

/// Arguments of `vice overlay`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice overlay V1_01_easy --labels floor.csv --estimate imu-euler --out film.mp4\n  \
    vice overlay my_run --labels labels.json --estimate slam.txt --out frames/\n\n\
    Blue rings: labels (filled at key frames); red: the reference; green and other colours: the estimates. The \
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
    let request = args.evaluation.request(Scoring { align: Some(Alignment::None), ..Scoring::default() })?;
    check_output(args, film, &request)?;
    if request.depth.sources.len() > 1 {
        return Err(usage("--depth: name one source, since a frame shows one place for each stream"));
    }
    if !film && args.film_fps.is_some() {
        return Err(usage("--film-fps: a folder of frames has no rate; name a film"));
    }
    let opened = request.open()?;
    let request = args.evaluation.completed(request, &opened)?;
    let count = with_progress(verbosity, |progress| -> anyhow::Result<usize> {
        let document = request.evaluate(&opened, Samples::Keep, progress)?;
        terminal::warn(document.suspicions.iter());
        let output = match film {
            true => Output::Film(&args.out, args.film_fps),
            false => Output::Folder(&args.out, args.force),
        };
        Ok(film::draw(&document, opened.dataset.as_ref(), output, progress)?)
    })?;
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
fn check_output(args: &Args, film: bool, request: &Request) -> anyhow::Result<()> {
    // In a folder that is there any name stands for all frames.
    let probe = if args.out.is_dir() { args.out.join("frame.png") } else { args.out.clone() };
    Outputs::new(&[&Some(probe)], &request.inputs())?;
    if film {
        if args.out.exists() && !args.force {
            return Err(DataError::new("exists already").at(&args.out).hint("`force` replaces it").into());
        }
        film::check_writer()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_tells_a_film_from_a_folder() {
        assert!(is_film(Path::new("a.MP4")).unwrap() && is_film(Path::new("b/a.mkv")).unwrap());
        assert!(!is_film(Path::new("frames")).unwrap() && !is_film(Path::new("frames/")).unwrap());
        assert!(is_film(Path::new("a.gif")).is_err());
    }
}
