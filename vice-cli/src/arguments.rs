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
    after_help = "Exit codes: 0 done, 1 failed, 2 wrong usage, 3 done but too many labels could not be \
                  scored, or something is wrong (check) or uncertain (clock). \
                  Start with `vice demo`."
)]
pub(crate) struct Cli {
    /// Print only errors and results.
    #[arg(short, long, global = true, display_order = 1000)]
    pub(crate) quiet: bool,
    /// Print more; -vv prints everything.
    #[arg(short, long, global = true, action = clap::ArgAction::Count, display_order = 1001)]
    pub(crate) verbose: u8,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a short flight, evaluate three estimates of it and explain the result.
    Demo(commands::demo::Args),
    /// Check a recording before you label it: clocks, conventions, gravity, calibration.
    Check(Box<commands::check::Args>),
    /// Find the offset between the clocks of two motion sources.
    Clock(commands::clock::Args),
    /// Compare calibrations.
    #[command(subcommand)]
    Calibration(commands::calibration::Command),
    /// Evaluate pose estimates against labelled key points.
    Evaluate(Box<commands::evaluate::Args>),
    /// Find the flaw that explains the pixel errors of an estimate.
    Diagnose(Box<commands::diagnose::Args>),
    /// Compare two trajectories: APE, RPE, RMSE_3D, AOE, ROE.
    Trajectory(commands::trajectory::Args),
    /// Label key points in the browser, by hand and with a tracker.
    Annotate(Box<commands::annotate::Args>),
    /// Write a vice.toml that describes a folder of images, or any data set; unknown values are marked.
    Init(commands::init::Args),
    /// Show what a data set holds.
    Info(commands::info::Args),
    /// List the data set formats, built in and from plugins.
    Formats(commands::formats::Args),
    /// Check a plugin, or start a new one.
    #[command(subcommand)]
    Plugin(commands::plugin::Command),
    /// Write depth images of a frame from each source; `compare` compares sources at labelled points.
    Depth(Box<commands::depth::Args>),
    /// Fit the floor plane.
    #[command(subcommand)]
    Floor(commands::floor::Command),
    /// Show how RMSE_2D changes with each flaw, and how small a flaw the labels can show.
    Sensitivity(Box<commands::sensitivity::Args>),
    /// Write a rendered flight with exact labels and flawed estimates, in the EuRoC layout.
    Synth(commands::synth::Args),
    /// Track, detect, compare and convert labels.
    #[command(subcommand)]
    Labels(commands::labels::Command),
    /// Write a pose stream of a data set as a trajectory file.
    Convert(commands::convert::Args),
    /// Show result documents as a page with plots and images.
    Report(commands::report::Args),
    /// Draw labels and estimates on the images: a film, or a folder of frames.
    Overlay(Box<commands::overlay::Args>),
    /// Compare results label by label.
    Compare(commands::compare::Args),
    /// Evaluate many flights listed in a manifest; `collect` makes one table of the results.
    Batch(Box<commands::batch::Args>),
    /// Show the results of a batch as the paper's table.
    Table(commands::table::Args),
    /// Measure how fast this machine projects points, compared with its memory bandwidth.
    Bench(commands::bench::Args),
    /// Print completions for a shell.
    Completions(commands::completions::Args),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::inputs::ASKED;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_holds_together() {
        Cli::command().debug_assert();
    }

    #[test]
    fn a_request_from_a_file_stands_alone() {
        let parse = |words: &[&str]| Cli::try_parse_from(words).map(|_| ()).map_err(|e| e.kind());
        let alone = ["vice", "evaluate", "--request", "r.json", "--json", "out.json"];
        assert_eq!(parse(&alone), Ok(()));
        for extra in
            [&["run"][..], &["--fps", "10"], &["--depth", "zmap"], &["--align", "yaw"], &["--max-gap", "1"]]
        {
            let words = [&alone[..], extra].concat();
            assert_eq!(parse(&words), Err(clap::error::ErrorKind::ArgumentConflict), "{extra:?}");
        }
        let missing = parse(&["vice", "evaluate"]);
        assert_eq!(missing, Err(clap::error::ErrorKind::MissingRequiredArgument));
        // What is not named the data set may say, by its streams or its vice.toml.
        assert_eq!(parse(&["vice", "evaluate", "run"]), Ok(()));
    }

    #[test]
    fn all_that_says_what_is_evaluated_is_known_to_a_request() {
        let command = Cli::command();
        let evaluate = command.find_subcommand("evaluate").unwrap();
        let asks = ["Data set", "Labels", "Pose streams", "Depth"];
        for argument in evaluate.get_arguments() {
            if argument.get_help_heading().is_some_and(|h| asks.contains(&h)) {
                assert!(ASKED.contains(&argument.get_id().as_str()), "{}", argument.get_id());
            }
        }
    }
}
