//! `vice bench`: how fast this machine projects, and how far that is from its limit.

use std::path::PathBuf;

use anyhow::Context;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use vice_run::bench::{BenchOptions, KernelName, ModelName, measure, render};

use crate::inputs::to_json;
use crate::outputs::Outputs;
use crate::terminal::{self, Outcome, Verbosity, with_progress};

/// Arguments of `vice bench`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice bench project --points 1000000\n  vice bench track --model equidistant --threads 2 --json bench.json\n\n\
    Each number is the best of many rounds, the limit measured in the same rounds: a busy machine makes both worse, \
    their ratio less so. What a limit is stands in docs/performance.md."
)]
pub(crate) struct Args {
    /// What to measure [default: project, unproject and track].
    #[arg(value_name = "KERNEL", value_parser = kernel())]
    kernels: Vec<KernelName>,
    /// Number of points.
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    points: u64,
    /// Camera model [default: all that apply].
    #[arg(long, value_name = "MODEL", value_parser = model())]
    model: Option<ModelName>,
    /// Number of threads [default: one, and all there are].
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// The results as JSON; - prints them in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// Kernels by name, with what they do.
fn kernel() -> impl TypedValueParser<Value = KernelName> {
    let words = KernelName::ALL.map(|k| PossibleValue::new(k.name()).help(k.words()));
    PossibleValuesParser::new(words).try_map(|text| text.parse::<KernelName>())
}

/// Camera models by name.
fn model() -> impl TypedValueParser<Value = ModelName> {
    PossibleValuesParser::new(ModelName::ALL.map(ModelName::name)).try_map(|text| text.parse::<ModelName>())
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json], &[])?;
    let options = BenchOptions {
        kernels: args.kernels.clone(),
        points: usize::try_from(args.points).context("too many points for this machine")?,
        model: args.model,
        threads: args.threads.map(usize::from),
    };
    let document = with_progress(verbosity, |progress| measure(&options, progress))?;
    let json = args.json.as_ref().map(|path| anyhow::Ok((path, to_json(&document)?))).transpose()?;
    if !outputs.write(&json.into_iter().collect::<Vec<_>>())? {
        terminal::print(&render(&document))?;
    }
    Ok(Outcome::Done)
}
