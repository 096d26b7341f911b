//! The command line as clap sees it.

use clap::{Parser, Subcommand};

use crate::commands;

/// VICE, the Visual Inertial Correlation Estimator: can this robot's ego-pose be trusted? Its own camera tells.
///
/// Key points labelled in the images are lifted to 3D at key frames, carried along by an estimated ego-motion,
/// projected into later frames and compared in pixels with their labels.
#[derive(Debug, Parser)]
#[command(
    name = "vice",
    version,
    arg_required_else_help = true,
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but too many labels could not be scored.\n\
                  Start with `vice demo`."
)]
pub(crate) struct Cli {
    /// Say only errors and results.
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Say more; twice for everything.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a short flight, evaluate three estimates of it and explain the result.
    Demo(commands::demo::Args),
    /// Evaluate pose estimates against labelled key points.
    Evaluate(Box<commands::evaluate::Args>),
    /// Compare two trajectories: APE, RPE, RMSE_3D, AOE, ROE.
    Trajectory(commands::trajectory::Args),
    /// Label key points in the browser, by hand and with a tracker.
    Annotate(Box<commands::annotate::Args>),
    /// Show what a data set holds.
    Info(commands::info::Args),
    /// List the data set formats, built in and of plugins.
    Formats(commands::formats::Args),
    /// Check a plugin, or start a new one.
    #[command(subcommand)]
    Plugin(commands::plugin::Command),
    /// Depth images of a frame from each source; `compare` for labelled key points.
    Depth(Box<commands::depth::Args>),
    /// The floor plane.
    #[command(subcommand)]
    Floor(commands::floor::Command),
    /// Write a rendered flight with exact labels and flawed estimates, in the EuRoC layout.
    Synth(commands::synth::Args),
    /// Work with labels files.
    #[command(subcommand)]
    Labels(commands::labels::Command),
    /// Write a pose stream of a data set as a trajectory file.
    Convert(commands::convert::Args),
    /// Measure how fast points are projected here, beside the machine's limit.
    Bench(commands::bench::Args),
    /// Print completions for a shell.
    Completions(commands::completions::Args),
}
