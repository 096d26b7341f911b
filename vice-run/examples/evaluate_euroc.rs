//! Evaluates pose estimates of a recording and prints the paper's table.
//!
//! `cargo run --release -p vice-run --example evaluate_euroc -- V1_01_easy floor.csv imu-euler`
#![allow(clippy::print_stdout, clippy::print_stderr)] // A program for a terminal.

use std::process::ExitCode;

use vice_run::error::RunResult;
use vice_run::report::table;
use vice_run::request::{EstimateSpec, Request};

fn run(dataset: &str, labels: &str, estimates: &[String]) -> RunResult<String> {
    let estimates = estimates.iter().cloned().map(EstimateSpec::from);
    let request = Request::new(dataset, labels, estimates);
    let document = vice_run::evaluate_request(&request, &vice_run::silent)?;
    Ok(table::render(&document))
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [dataset, labels, estimates @ ..] = arguments.as_slice() else {
        eprintln!("usage: evaluate_euroc DATASET LABELS ESTIMATE...");
        return ExitCode::from(2);
    };
    match run(dataset, labels, estimates) {
        Ok(table) => {
            print!("{table}");
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("error: {}", vice_run::core::error::one_line(&error));
            ExitCode::FAILURE
        }
    }
}
