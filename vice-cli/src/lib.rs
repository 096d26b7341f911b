//! `vice`: whether a robot's ego-pose can be trusted, seen with its own camera.
#![forbid(unsafe_code)]

mod arguments;
mod commands;
mod inputs;
mod outputs;
mod signals;
mod terminal;

use std::process::ExitCode;

use clap::{CommandFactory, Parser};

use arguments::{Cli, Command};
use terminal::Outcome;

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return terminal::wrong_usage(&error),
    };
    let verbosity = terminal::Verbosity::new(cli.quiet, cli.verbose);
    terminal::show_warnings(verbosity);
    let outcome = match &cli.command {
        Command::Annotate(args) => commands::annotate::run(args, verbosity),
        Command::Demo(args) => commands::demo::run(args, verbosity),
        Command::Evaluate(args) => commands::evaluate::run(args, verbosity),
        Command::Diagnose(args) => commands::diagnose::run(args, verbosity),
        Command::Trajectory(args) => commands::trajectory::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Formats(args) => commands::formats::run(args),
        Command::Plugin(command) => commands::plugin::run(command),
        Command::Depth(args) => commands::depth::run(args, verbosity),
        Command::Floor(command) => commands::floor::run(command, verbosity),
        Command::Sensitivity(args) => commands::sensitivity::run(args, verbosity),
        Command::Synth(args) => commands::synth::run(args, verbosity),
        Command::Labels(args) => commands::labels::run(args, verbosity),
        Command::Convert(args) => commands::convert::run(args),
        Command::Report(args) => commands::report::run(args, verbosity),
        Command::Overlay(args) => commands::overlay::run(args, verbosity),
        Command::Compare(args) => commands::compare::run(args),
        Command::Batch(args) => commands::batch::run(args, verbosity),
        Command::Table(args) => commands::table::run(args),
        Command::Bench(args) => commands::bench::run(args, verbosity),
        Command::Completions(args) => commands::completions::run(args, Cli::command()),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::TooManySkips) => ExitCode::from(3),
        Ok(Outcome::RequirementBroken) => ExitCode::from(4),
        Ok(Outcome::RunsFailed) => ExitCode::FAILURE,
        Ok(Outcome::Interrupted) => ExitCode::from(signals::INTERRUPTED),
        Err(error) if terminal::is_broken_pipe(&error) => ExitCode::SUCCESS,
        Err(error) => {
            terminal::print_error(&error);
            ExitCode::from(terminal::exit_code(&error))
        }
    }
}
