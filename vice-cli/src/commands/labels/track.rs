//! `vice labels track`: labels without a hand.

use std::path::PathBuf;

use vice_run::auto_labels::TrackingSpec;
use vice_run::files::atomic::Overwrite;

use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, WindowArgs, split_list};
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, printable, with_progress};

/// Arguments of `vice labels track`.
#[derive(Debug, clap::Args)]
#[command(
    mut_arg("fps", |a| a.help("Label the frame nearest to each tick of this rate; all are looked at [default: every frame]")),
    after_help = "Examples:\n  \
    vice labels track V1_01_easy --fps 10 --start 5 --duration 30 --out auto.json\n  \
    vice labels track my_run --points 4 --depth floor --out auto.json\n  \
    vice labels track my_run --from mine.json --out more.json   (goes on from a person's labels)\n\n\
    Points are chosen, followed there and back, and held against each other: they have to move as one rigid scene does. \
    No estimate is asked. A reference only tells where the floor or the scan is, so that labels start where depth is known. \
    What moves by itself cannot be told from a wrong pose by few points: 40 outvote it, 4 are fewer than that."
)]
pub(crate) struct Args {
    #[command(flatten)]
    dataset: DatasetArgs,
    #[command(flatten)]
    window: WindowArgs,
    /// Points at any time [default: 40, or those of --from].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), help_heading = "Labels")]
    points: Option<u32>,
    /// Labels to go on from: they stay as they are, and what is between and beyond them is followed.
    #[arg(long, value_name = "LABELS", help_heading = "Labels")]
    from: Option<PathBuf>,
    /// Depth source that has to know the depth where a label starts: floor, zmap, zcam, mesh, tag [default: zcam where there
    /// is a depth camera, zmap where there is a scan].
    #[arg(long, value_name = "SOURCE", help_heading = "Depth")]
    depth: Option<String>,
    #[command(flatten)]
    depth_options: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
    /// Labels file to write: .json, .csv, or .xml for CVAT.
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    out: PathBuf,
    /// Replace a file that exists.
    #[arg(long, help_heading = "Output")]
    force: bool,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let names: Vec<String> = args.depth.iter().cloned().collect();
    let spec = TrackingSpec {
        dataset: args.depth_options.dataset(&args.dataset),
        protocol: args.window.spec(),
        points: args.points.map(|n| n as usize),
        from: args.from.clone(),
        depth: args.depth_options.spec("--depth", &split_list(&names))?,
        reference: args.anchor.reference(),
        max_gap: args.anchor.max_gap,
    };
    let inputs: Vec<PathBuf> = std::iter::once(spec.dataset.path.clone()).chain(spec.from.clone()).collect();
    Outputs::new(&[&Some(args.out.clone())], &inputs)?;
    let overwrite = Overwrite::from_force(args.force);
    let tracked = with_progress(verbosity, |progress| spec.run_to_file(&args.out, overwrite, progress))?;
    terminal::warn(tracked.suspicions.iter());
    terminal::print(&format!(
        "{}{}\n",
        tracked.summary().text(),
        printable(&args.out.display().to_string())
    ))?;
    Ok(Outcome::Done)
}
