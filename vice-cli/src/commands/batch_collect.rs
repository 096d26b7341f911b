//! `vice batch collect`: the results of a batch as tables for other programs.

use std::path::PathBuf;

use vice_run::batch::Store;
use vice_run::batch::collect::collect;

use crate::inputs::write_text;
use crate::terminal::{Outcome, Verbosity};

/// Arguments of `vice batch collect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  vice batch collect out   (writes out/results.csv and out/timings.csv)")]
pub(crate) struct Args {
    /// Folder of a batch.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// What is written.
    #[arg(long, value_enum, value_name = "FORMAT,...", value_delimiter = ',', default_value = "csv")]
    format: Vec<Format>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    Csv,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let collected = collect(&Store::new(&args.folder))?;
    if args.format.contains(&Format::Csv) {
        // Both texts are made before the first is written.
        let (results, timings) = (collected.results_csv()?, collected.timings_csv()?);
        write_text(&args.folder.join("results.csv"), &results)?;
        write_text(&args.folder.join("timings.csv"), &timings)?;
    }
    verbosity.note(&format!(
        "{} rows; {} runs failed, {} were not tried yet",
        collected.rows.len(),
        collected.failed,
        collected.missing
    ));
    Ok(Outcome::Done)
}
