//! `vice synth`.

use std::path::PathBuf;

use vice_run::synthetic::{Synthetic, SyntheticOptions, write_euroc};

use crate::inputs::positive;
use crate::terminal::{self, Outcome, Verbosity, with_progress};

/// Arguments of `vice synth`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: vice synth my_flight --seed 7 --duration 10")]
pub(crate) struct Args {
    /// Folder to write; it must be empty or new.
    #[arg(value_name = "OUT")]
    out: PathBuf,
    /// Seed of scene, flight and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of the flight, seconds.
    #[arg(long, value_name = "S", default_value = "10", value_parser = positive)]
    duration: f64,
    /// Rate of the camera.
    #[arg(long, value_name = "HZ", default_value = "20", value_parser = positive)]
    rate: f64,
    /// Write into a folder that is not empty.
    #[arg(long)]
    force: bool,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let options = SyntheticOptions {
        seed: args.seed,
        duration_s: args.duration,
        rate_hz: args.rate,
        ..SyntheticOptions::default()
    };
    let flight = Synthetic::new(options)?;
    with_progress(verbosity, |progress| {
        write_euroc(&flight, &args.out, args.force, &|done, total| progress("rendering", done, total))
    })?;
    terminal::print(&format!("wrote {}\n", args.out.display()))?;
    Ok(Outcome::Done)
}
