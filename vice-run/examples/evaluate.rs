//! From a recording, labels and an estimate to the table of the paper.
//!
//! ```text
//! cargo run --release -p vice-run --example evaluate [RECORDING LABELS ESTIMATE]
//! ```
//!
//! Without arguments a flight of three seconds is made in a temporary folder, with an estimate that drifts.
#![allow(clippy::print_stdout)]

use std::error::Error;

use vice_run::report::table;
use vice_run::request::{DepthName, EstimateSpec, Request};
use vice_run::{evaluate_request, silent};
use vice_synthetic::{Synthetic, SyntheticOptions, write_euroc};

fn main() -> Result<(), Box<dyn Error>> {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let folder = tempfile::tempdir()?;
    let mut request = match given.as_slice() {
        [recording, labels, estimate] => {
            Request::new(recording, labels, [EstimateSpec::from(estimate.clone())])
        }
        [] => {
            let flight = Synthetic::new(SyntheticOptions { duration_s: 3.0, ..SyntheticOptions::default() })?;
            write_euroc(&flight, folder.path(), true, &|_, _| {})?;
            let drifts = folder.path().join("estimates/drift.txt").display().to_string();
            let estimates = [drifts, "imu-euler".to_string()].map(EstimateSpec::from);
            Request::new(folder.path(), folder.path().join("labels/floor.csv"), estimates)
        }
        _ => return Err("expected RECORDING LABELS ESTIMATE, or nothing".into()),
    };
    request.depth.sources = vec![DepthName::Floor];

    // The document holds everything that was found, and what was asked: `serde_json::to_string(&document)` keeps it.
    let document = evaluate_request(&request, &silent)?;
    print!("{}", table::render(&document));
    Ok(())
}
