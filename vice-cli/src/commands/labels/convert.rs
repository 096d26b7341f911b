//! `vice labels convert`.

use std::path::PathBuf;
use std::sync::Arc;

use vice_run::core::label::LabelSet;
use vice_run::core::time::Stamp;
use vice_run::files::atomic::Overwrite;
use vice_run::files::labels::{self, LabelFormat, TracksOptions};
use vice_run::place::Place;
use vice_run::request::{DatasetSpec, Protocol};

use crate::inputs::{Counted, PluginArgs, WindowArgs, counted_spec};
use crate::terminal::{self, Outcome, usage};

/// Arguments of `vice labels convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice labels convert floor.csv floor.json\n  \
    vice labels convert labels.pickle labels.csv --dataset V1_01_easy\n  \
    vice labels convert labels.json cvat.xml --dataset V1_01_easy\n  \
    vice labels convert labels.csv labels.parquet\n  \
    vice labels convert cotracker.npz labels.json --dataset V1_01_easy --fps 10 --tool CoTracker3\n  \
    vice labels convert tapir.npz labels.json --dataset V1_01_easy --from-corner --size 256x256 --tool TAPIR\n\n\
    Parquet and JSON keep everything, CSV and CVAT all but what a tracker says of its work. The pickle and CVAT count frames; \
    the data set says which stamps they have. Tracks are arrays (frames, points, 2) in an .npy, or in an .npz as `tracks` with \
    `visibility`; --start, --duration and --fps say which frames were tracked.")]
pub(crate) struct Args {
    /// Labels to read: CSV, JSON (vice.labels/1), Parquet, CVAT for video 1.1, the authors' pickle, or tracks as .npy or .npz.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write: .csv, .json, .parquet, or .xml for CVAT.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Data set whose frames a pickle or CVAT counts.
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Camera whose labels they are: of a file with several it takes those, and a file that names none gets it. Where frames
    /// are counted, camera of the data set [default: the first].
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    #[command(flatten)]
    plugins: PluginArgs,
    #[command(flatten)]
    tracks: TrackArgs,
    /// Replace a file that exists.
    #[arg(long)]
    force: bool,
}

impl Args {
    /// The data set whose frames are counted.
    fn counted_spec(&self) -> Option<DatasetSpec> {
        self.dataset.as_ref().map(|path| counted_spec(path, self.camera.as_deref(), &self.plugins))
    }
}

/// What tracks are of.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Tracks (.npy, .npz)")]
struct TrackArgs {
    #[command(flatten)]
    window: WindowArgs,
    /// Name of the tracker, which the labels keep.
    #[arg(long, value_name = "NAME")]
    tool: Option<String>,
    /// Columns and rows of the pictures that were tracked [default: those of the camera].
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = size)]
    size: Option<[u32; 2]>,
    /// (0, 0) of the tracks is the corner of the top left pixel, as TAPIR has it, not its centre.
    #[arg(long)]
    from_corner: bool,
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let side = |text: &str| text.parse().ok().filter(|n| *n > 0);
    let sides = text.split_once('x').and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| "expected columns and rows, such as 256x256".to_string())
}

impl TrackArgs {
    /// Options that only tracks have, as they were given.
    fn given(&self) -> Option<&'static str> {
        let given = [
            ("--tool", self.tool.is_some()),
            ("--size", self.size.is_some()),
            ("--from-corner", self.from_corner),
            ("--start, --duration and --fps", self.window.spec() != Protocol::default()),
        ];
        given.into_iter().find(|(_, is)| *is).map(|(name, _)| name)
    }
}

/// Labels of tracks.
fn of_tracks(args: &Args, bytes: &[u8]) -> anyhow::Result<(LabelSet, Arc<[Stamp]>)> {
    let Some(spec) = args.counted_spec() else {
        return Err(usage("--dataset: tracks count frames; name the data set that was tracked"));
    };
    let opened = spec.open()?;
    let chosen = args.tracks.window.spec().frames(&opened)?;
    let stamps: Vec<Stamp> = chosen.iter().map(|f| opened.frames[*f]).collect();
    let tracks = &args.tracks;
    let options =
        TracksOptions { tool: tracks.tool.as_deref(), size_px: tracks.size, from_corner: tracks.from_corner };
    let image_px = [opened.camera.width(), opened.camera.height()];
    let read = labels::read_tracks(bytes, &stamps, image_px, &options);
    let (mut set, outside) = read.map_err(|e| e.at(&args.input))?;
    if outside > 0 {
        tracing::warn!(
            "{outside} places lie outside of the {}x{} image and were left out",
            image_px[0],
            image_px[1]
        );
    }
    set.dataset = Some(opened.dataset.name().to_string());
    set.camera = Some(opened.camera_name.clone());
    Ok((set, opened.frames))
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    // Before the work, so that a wrong name costs nothing.
    LabelFormat::for_writing(&args.output)?;
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    let place = Place::of_file(&args.input)?;
    // What cannot be read is told below.
    if labels::is_tracks_file(place.path())
        && let Ok(bytes) = std::fs::read(place.path())
    {
        let (set, stamps) = of_tracks(args, &bytes)?;
        return write(args, &set, Some(&stamps), overwrite);
    }
    if let Some(option) = args.tracks.given() {
        return Err(usage(format!(
            "{option}: is of tracks in .npy or .npz, and {} is none",
            args.input.display()
        )));
    }
    let frames = args.counted_spec().as_ref().map(Counted::of).transpose()?;
    let stamps = frames.as_ref().map(|f| f.stamps.as_ref());
    let file = place.told(labels::read_file(place.path(), stamps))?;
    terminal::warn(file.suspicions.iter());
    let at = |e: vice_run::core::error::DataError| e.at(&args.input);
    let mut set = match &args.camera {
        Some(camera) => {
            // No data set says which cameras there are: those of the file are taken at their word.
            let known: Vec<String> = file.cameras().into_iter().map(str::to_string).collect();
            file.of_camera(camera, &known).map_err(at)?.labels
        }
        None => file.of_one_camera().map_err(at)?,
    };
    if let Some(camera) = &args.camera {
        set.camera.get_or_insert_with(|| camera.clone());
    }
    if let Some(frames) = &frames {
        set.dataset.get_or_insert_with(|| frames.dataset.clone());
        set.camera.get_or_insert_with(|| frames.camera.clone());
    }
    write(args, &set, stamps, overwrite)
}

fn write(
    args: &Args,
    set: &LabelSet,
    stamps: Option<&[Stamp]>,
    overwrite: Overwrite,
) -> anyhow::Result<Outcome> {
    labels::write_with_frames(&args.output, set, stamps, overwrite)?;
    terminal::print(&format!("{} points, {} observations\n", set.points().len(), set.observation_count()))?;
    Ok(Outcome::Done)
}
