//! `vice`: whether a robot's ego-pose can be trusted, seen with its own camera.
//!
//! The program as a function, so that others who carry it (the Python module) start the same one: [`main_from`].
#![forbid(unsafe_code)]

mod arguments;
mod commands;
mod doorway;
mod inputs;
mod itself;
mod outputs;
mod signals;
mod terminal;

use std::ffi::OsString;

use clap::{CommandFactory, Parser};

use arguments::{Cli, Command};
pub use itself::Itself;
use terminal::Outcome;
use vice_run::core::budget::Budget;
use vice_run::core::instructions::Instructions;
use vice_run::host::isolated;

/// Names of the program's commands, in the order of its help.
pub fn commands() -> Vec<String> {
    Cli::command().get_subcommands().map(|c| c.get_name().to_string()).collect()
}

/// The command line with all commands and options, for what is made from it: manual pages and completions.
pub fn command_line() -> clap::Command {
    Cli::command()
}

/// The command that serves a plugin in a process of its own, as talkative as this one.
fn serving(mut words: Vec<OsString>, cli: &Cli) -> Vec<OsString> {
    words.extend((0..cli.verbose).map(|_| OsString::from("-v")));
    words.extend(["plugin", "serve"].map(OsString::from));
    words
}

/// Runs the program with the arguments of a command line, the first of which is its own name. Returns the exit code.
///
/// `itself` says how the program is started once more, for the commands that need a process of their own. What a command
/// prints goes to the standard output and error of this process.
pub fn main_from(args: impl IntoIterator<Item = OsString>, itself: Itself) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let bare = itself.words();
    let itself = itself.with(args.iter().skip(1).cloned());
    let cli = match Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => return terminal::wrong_usage(&error),
    };
    let verbosity = terminal::Verbosity::new(cli.quiet, cli.verbose);
    terminal::show_warnings(verbosity);
    let settings =
        Instructions::from_environment().map(drop).and_then(|()| Budget::from_environment().map(drop));
    if let Err(wrong) = settings {
        let error = terminal::usage(wrong);
        terminal::print_error(&error);
        return terminal::exit_code(&error);
    }
    isolated::program_is(serving(bare, &cli));
    // The annotator ends by itself, with all labels saved.
    if !matches!(cli.command, Command::Annotate(_)) {
        signals::listen();
    }
    let outcome = match &cli.command {
        Command::Annotate(args) => commands::annotate::run(args, verbosity),
        Command::Calibration(command) => commands::calibration::run(command),
        Command::Check(args) => commands::check::run(args, verbosity),
        Command::Clock(args) => commands::clock::run(args),
        Command::Demo(args) => commands::demo::run(args, verbosity),
        Command::Evaluate(args) => commands::evaluate::run(args, verbosity),
        Command::Diagnose(args) => commands::diagnose::run(args, verbosity),
        Command::Trajectory(args) => commands::trajectory::run(args, verbosity),
        Command::Init(args) => commands::init::run(args, verbosity),
        Command::Info(args) => commands::info::run(args, verbosity),
        Command::Formats(args) => commands::formats::run(args, verbosity),
        Command::Plugin(command) => commands::plugin::run(command, &itself),
        Command::Depth(args) => commands::depth::run(args, verbosity),
        Command::Floor(command) => commands::floor::run(command, verbosity),
        Command::Sensitivity(args) => commands::sensitivity::run(args, verbosity),
        Command::Synth(args) => commands::synth::run(args, verbosity),
        Command::Labels(args) => commands::labels::run(args, verbosity),
        Command::Convert(args) => commands::convert::run(args, verbosity),
        Command::Report(args) => commands::report::run(args, verbosity),
        Command::Overlay(args) => commands::overlay::run(args, verbosity),
        Command::Compare(args) => commands::compare::run(args),
        Command::Batch(args) => commands::batch::run(args, verbosity),
        Command::Table(args) => commands::table::run(args),
        Command::Bench(args) => commands::bench::run(args, verbosity),
        Command::Completions(args) => commands::completions::run(args, Cli::command()),
    };
    match outcome {
        Ok(Outcome::Done) => 0,
        Ok(Outcome::TooManySkips | Outcome::SomethingWrong) => 3,
        Ok(Outcome::RequirementBroken) => 4,
        Ok(Outcome::RunsFailed) => 1,
        Ok(Outcome::Interrupted) => signals::INTERRUPTED,
        Err(error) if terminal::is_broken_pipe(&error) => 0,
        Err(error) => {
            terminal::print_error(&error);
            terminal::exit_code(&error)
        }
    }
}
