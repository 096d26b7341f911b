//! `vice table`: the results of a batch as the paper's table.

use std::path::PathBuf;

use vice_run::batch::Store;
use vice_run::batch::collect::{Samples, collect};
use vice_run::batch::fleet_table::{Beside, Format, render};
use vice_run::batch::results_file;

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
    let folder = if args.results.is_dir() { Some(args.results.as_path()) } else { args.results.parent() };
    // A table that lies in the folder of its batch has the samples beside it.
    let store = folder.map(Store::new).filter(|s| args.results.is_dir() || s.is_there());
    let rows = match &store {
        Some(store) if args.results.is_dir() => collect(store)?.rows,
        _ => results_file::read(&args.results)?,
    };
    let links = folder.map_or_else(String::new, |f| format!("{}/", f.display()));
    let beside = Beside {
        samples: store.as_ref().map_or(Samples::None, Samples::Store),
        links: store.as_ref().filter(|s| s.has_reports()).map(|_| links.as_str()),
    };
    let format = match args.format {
        How::Text => Format::Text,
        How::Latex => Format::Latex,
        How::Csv => Format::Csv,
        How::Html => Format::Html,
    };
    terminal::print(&render(&rows, &beside, format)?)?;
    Ok(Outcome::Done)
}
