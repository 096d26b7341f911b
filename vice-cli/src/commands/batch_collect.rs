//! `vice batch collect`: the results of a batch as tables for other programs.

use std::path::PathBuf;

use vice_run::batch::Store;
use vice_run::batch::collect::{Format, collect};

use crate::terminal::{Outcome, Verbosity};

/// Arguments of `vice batch collect`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice batch collect out   (writes out/results.csv and out/timings.csv)\n  \
    vice batch collect out --format parquet,html --samples parquet")]
pub(crate) struct Args {
    /// Folder of a batch.
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// What is written: results and timings as csv or parquet, table.tex, table.html.
    #[arg(long, value_enum, value_name = "FORMAT,...", value_delimiter = ',', default_value = "csv")]
    format: Vec<As>,
    /// Write samples/ too: the scored samples of each run.
    #[arg(long, value_enum, value_name = "FORMAT")]
    samples: Option<SamplesAs>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum As {
    Csv,
    Parquet,
    Latex,
    Html,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum SamplesAs {
    Parquet,
}

impl From<As> for Format {
    fn from(format: As) -> Self {
        match format {
            As::Csv => Self::Csv,
            As::Parquet => Self::Parquet,
            As::Latex => Self::Latex,
            As::Html => Self::Html,
        }
    }
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let store = Store::new(&args.folder);
    let collected = collect(&store)?;
    let formats: Vec<Format> = args.format.iter().map(|f| Format::from(*f)).collect();
    collected.write(&store, &formats)?;
    if args.samples.is_some() {
        let runs = collected.write_samples(&store)?;
        verbosity.note(&format!("samples of {runs} runs"));
    }
    verbosity.note(&format!(
        "{} rows; {} runs failed, {} were not tried yet",
        collected.rows.len(),
        collected.failed,
        collected.missing
    ));
    Ok(Outcome::Done)
}
