//! `vice depth`: depth images of a frame from each source, as numbers and as pictures.

use std::fs;
use std::path::PathBuf;

use anyhow::Context;
use vice_run::depth_images::depth_images;
use vice_run::files::atomic::{self, Overwrite};
use vice_run::scene::Scene;

use crate::commands::depth_compare;
use crate::inputs::{AnchorArgs, DatasetArgs, DepthArgs, SourceArgs};
use crate::terminal::{self, Outcome, Verbosity, usage, with_progress};

/// Arguments of `vice depth`.
#[derive(Debug, clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
#[command(after_help = "Examples:\n  \
    vice depth V1_01_easy --at 1403715280562142976 --depth floor,zmap --out depth_out\n  \
    vice depth compare V1_01_easy --labels floor.csv --depth floor,zmap")]
pub(crate) struct Args {
    // Before the subcommand, which is taken out of the matches when it is read.
    #[command(flatten)]
    images: WithoutCommand,
    #[command(subcommand)]
    command: Option<Command>,
}

/// The arguments of the images themselves, which a subcommand takes the place of. An `Option` would do, but clap finds
/// one empty that has flattened arguments of its own.
#[derive(Debug)]
struct WithoutCommand(Option<ImageArgs>);

impl clap::FromArgMatches for WithoutCommand {
    fn from_arg_matches(matches: &clap::ArgMatches) -> Result<Self, clap::Error> {
        match matches.subcommand_name() {
            Some(_) => Ok(Self(None)),
            None => ImageArgs::from_arg_matches(matches).map(|images| Self(Some(images))),
        }
    }

    fn update_from_arg_matches(&mut self, matches: &clap::ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl clap::Args for WithoutCommand {
    fn augment_args(command: clap::Command) -> clap::Command {
        ImageArgs::augment_args(command)
    }

    fn augment_args_for_update(command: clap::Command) -> clap::Command {
        ImageArgs::augment_args_for_update(command)
    }
}

/// What else can be done with depth.
#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Compare the depths of two or more sources at labelled key points, and what a difference costs in pixels.
    Compare(Box<depth_compare::Args>),
}

#[derive(Debug, clap::Args)]
struct ImageArgs {
    #[command(flatten)]
    dataset: DatasetArgs,
    /// Frame: its index, or its stamp in nanoseconds.
    #[arg(long, value_name = "STAMP|INDEX")]
    at: String,
    #[command(flatten)]
    source: SourceArgs,
    /// Folder for the images; files of the same names are replaced.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    depth: DepthArgs,
    #[command(flatten)]
    anchor: AnchorArgs,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    match (&args.command, &args.images.0) {
        (Some(Command::Compare(compare)), _) => depth_compare::run(compare),
        (None, Some(images)) => write_images(images, verbosity),
        (None, None) => Err(usage("name a data set, or `vice depth compare`")),
    }
}

fn write_images(args: &ImageArgs, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    if args.out.is_file() {
        return Err(usage(format!("--out: {} is a file, not a folder", args.out.display())));
    }
    let depth = args.source.spec(&args.depth)?;
    let reference = args.anchor.reference();
    let scene = Scene::open(&args.depth.dataset(&args.dataset), &reference, args.anchor.max_gap)?;
    let made = with_progress(verbosity, |progress| depth_images(&scene, &depth, &args.at, progress))?;
    terminal::warn(made.suspicions.iter());
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    for (name, bytes) in &made.files {
        atomic::write(args.out.join(name), Overwrite::Replace, |out| out.write_all(bytes))?;
    }
    let names: Vec<&str> = made.files.iter().map(|(name, _)| name.as_str()).collect();
    terminal::print(&format!("{}wrote {} to {}\n", made.text, names.join(", "), args.out.display()))?;
    Ok(Outcome::Done)
}
