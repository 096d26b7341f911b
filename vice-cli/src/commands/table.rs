//! `vice table`: the results of a batch as the paper's table.

use std::path::PathBuf;

use vice_run::batch::FleetTable;
use vice_run::batch::fleet_table::Format;

use crate::terminal::{self, Outcome};

/// Arguments of `vice table`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice table out\n  \
    vice table out/results.csv --format latex > table.tex\n  \
    vice table out --format html > table.html\n\n\
    With the folder of a batch whose samples were kept, estimators are compared at the labels that all of them scored.")]
pub(crate) struct Args {
    /// Folder of a batch, or the results.csv or results.parquet of one.
    #[arg(value_name = "DIR|RESULTS")]
    results: PathBuf,
    /// How it is written.
    #[arg(long, value_enum, value_name = "FORMAT", default_value = "text")]
    format: How,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum How {
    Text,
    Latex,
    Csv,
    Html,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<Outcome> {
    let format = match args.format {
        How::Text => Format::Text,
        How::Latex => Format::Latex,
        How::Csv => Format::Csv,
        How::Html => Format::Html,
    };
    terminal::print(&FleetTable::open(&args.results)?.render(format)?)?;
    Ok(Outcome::Done)
}
