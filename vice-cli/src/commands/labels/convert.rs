//! `vice labels convert`.

use std::path::PathBuf;

use vice_run::files::atomic::Overwrite;
use vice_run::files::labels::{self, LabelFormat};
use vice_run::place::Place;
use vice_run::request::DatasetSpec;

use crate::inputs::PluginArgs;
use crate::terminal::{self, Outcome};

/// Arguments of `vice labels convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  vice labels convert floor.csv floor.json\n  \
    vice labels convert labels.pickle labels.csv --dataset V1_01_easy\n  \
    vice labels convert labels.json cvat.xml --dataset V1_01_easy\n  \
    vice labels convert labels.csv labels.parquet\n\n\
    Parquet and JSON keep everything, CSV and CVAT all but what a tracker says of its work. The pickle and CVAT count frames; the data set says which stamps they have.")]
pub(crate) struct Args {
    /// Labels to read: CSV, JSON (vice.labels/1), Parquet, CVAT for video 1.1 or the authors' pickle.
    #[arg(value_name = "IN")]
    input: PathBuf,
    /// File to write: .csv, .json, .parquet, or .xml for CVAT.
    #[arg(value_name = "OUT")]
    output: PathBuf,
    /// Data set whose frames a pickle or CVAT counts.
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Camera of that data set [default: the first].
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    #[command(flatten)]
    plugins: PluginArgs,
    /// Replace a file that exists.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let frames = match &args.dataset {
        Some(path) => {
            let spec = DatasetSpec {
                path: path.clone(),
                camera: args.camera.clone(),
                plugins: args.plugins.spec(),
                ..DatasetSpec::default()
            };
            let dataset = spec.open_raw(&vice_run::formats::registry(&spec.plugins)?)?;
            let camera = spec.camera_name(dataset.as_ref())?;
            Some((dataset.name().to_string(), camera.clone(), dataset.frames(&camera)?))
        }
        None => None,
    };
    // Before the work, so that a wrong name costs nothing.
    LabelFormat::for_writing(&args.output)?;
    let place = Place::of_file(&args.input)?;
    let read = labels::read(place.path(), frames.as_ref().map(|(_, _, f)| f.as_ref()));
    let mut set = place.told(read)?;
    if let Some((dataset, camera, _)) = &frames {
        set.dataset.get_or_insert_with(|| dataset.clone());
        set.camera.get_or_insert_with(|| camera.clone());
    }
    let overwrite = if args.force { Overwrite::Replace } else { Overwrite::Refuse };
    let stamps = frames.as_ref().map(|(_, _, f)| f.as_ref());
    labels::write_with_frames(&args.output, &set, stamps, overwrite)?;
    terminal::print(&format!("{} points, {} observations\n", set.points().len(), set.observation_count()))?;
    Ok(Outcome::Done)
}
