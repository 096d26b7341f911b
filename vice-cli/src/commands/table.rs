//! `vice table`: the results of a batch as the paper's table.

use std::path::PathBuf;

use vice_run::batch::Store;
use vice_run::batch::collect::collect;
use vice_run::batch::fleet_table::{Format, render};
use vice_run::batch::results;

use crate::terminal::{self, Outcome};

/// Arguments of `vice table`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    vice table out\n  \
    vice table out/results.csv --format latex > table.tex")]
pub(crate) struct Args {
    /// Folder of a batch, or the results.csv of one.
    #[arg(value_name = "DIR|results.csv")]
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
    let rows = if args.results.is_dir() {
        collect(&Store::new(&args.results))?.rows
    } else {
        results::read(&args.results)?
    };
    let format = match args.format {
        How::Text => Format::Text,
        How::Latex => Format::Latex,
        How::Csv => Format::Csv,
        How::Html => Format::Html,
    };
    terminal::print(&render(&rows, format)?)?;
    Ok(Outcome::Done)
}
