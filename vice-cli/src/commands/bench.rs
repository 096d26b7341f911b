//! `vice bench`: how fast this machine projects, and how far that is from its limit.

mod limits;
mod scan;
mod work;

use std::path::PathBuf;

use anyhow::Context;
use serde::Serialize;
use vice_core::lanes::instruction_set;

use self::limits::Machine;
use self::work::Work;
use crate::inputs::{Outputs, to_json};
use crate::report::table;
use crate::terminal::{self, Outcome, Verbosity};

/// Arguments of `vice bench`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples:\n  vice bench project --points 1000000\n  vice bench track --model equidistant --threads 2 --json bench.json\n\n\
    Each number is the best of many rounds, the limit measured in the same rounds: a busy machine makes both worse,\n\
    their ratio less so. What a limit is stands in docs/performance.md."
)]
pub(crate) struct Args {
    /// What to measure [default: project, unproject and track].
    #[arg(value_enum, value_name = "KERNEL")]
    kernels: Vec<KernelName>,
    /// Number of points.
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = clap::value_parser!(u64).range(1..=1_000_000_000))]
    points: u64,
    /// Camera model [default: all that apply].
    #[arg(long, value_enum)]
    model: Option<ModelName>,
    /// Number of threads [default: one, and all there are].
    #[arg(long, value_name = "T", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// The results as JSON; - prints them in place of the table.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum KernelName {
    /// Points of the camera frame to pixels.
    Project,
    /// Pixels to rays, solved to 1e-10.
    Unproject,
    /// Equation 1: pixels with depth to pixels of another frame.
    Track,
    /// A scan to a whole depth image.
    Zmap,
    /// A binary PLY file to points.
    Ply,
}

/// Camera models.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub(crate) enum ModelName {
    Pinhole,
    Radtan,
    Rational,
    Equidistant,
}

/// The document.
#[derive(Debug, Serialize)]
struct Document {
    results: Vec<Measurement>,
    machine: Vec<Machine>,
}

/// One measurement.
#[derive(Debug, Serialize)]
struct Measurement {
    kernel: KernelName,
    /// Null where no camera takes part.
    model: Option<ModelName>,
    points: u64,
    threads: usize,
    points_per_second: f64,
    fraction_of_limit: f64,
    /// What limits.
    limit: &'static str,
}

pub(crate) fn run(args: &Args, verbosity: Verbosity) -> anyhow::Result<Outcome> {
    let outputs = Outputs::new(&[&args.json], &[])?;
    let kernels = match args.kernels.is_empty() {
        true => vec![KernelName::Project, KernelName::Unproject, KernelName::Track],
        false => args.kernels.clone(),
    };
    let threads = match args.threads {
        Some(threads) => vec![usize::from(threads)],
        None => {
            let all = std::thread::available_parallelism().map_or(1, usize::from);
            if all > 1 { vec![1, all] } else { vec![1] }
        }
    };
    let points = usize::try_from(args.points).context("too many points for this machine")?;
    let pools: Vec<rayon::ThreadPool> = threads
        .iter()
        .map(|n| rayon::ThreadPoolBuilder::new().num_threads(*n).build())
        .collect::<Result<_, _>>()
        .context("cannot start the threads")?;
    let mut document = Document { results: Vec::new(), machine: Vec::new() };
    for pool in &pools {
        document.machine.push(pool.install(Machine::measure));
    }
    let bar = verbosity.progress("measuring");
    for kernel in kernels {
        for model in models(kernel, args.model) {
            let mut work = Work::new(kernel, model, points)?;
            for (pool, machine) in pools.iter().zip(&document.machine) {
                let measured = pool.install(|| work.measure(machine))?;
                document.results.push(Measurement {
                    kernel,
                    model,
                    points: args.points,
                    threads: machine.threads,
                    points_per_second: points as f64 / measured.seconds,
                    fraction_of_limit: measured.limit_seconds / measured.seconds,
                    limit: measured.limit,
                });
                bar.inc(1);
            }
        }
    }
    bar.finish_and_clear();
    let json = args.json.as_ref().map(|path| anyhow::Ok((path, to_json(&document)?))).transpose()?;
    if !outputs.write(&json.into_iter().collect::<Vec<_>>())? {
        terminal::print(&render(&document))?;
    }
    Ok(Outcome::Done)
}

/// The models that a kernel is measured with. Reading a file knows no camera.
fn models(kernel: KernelName, asked: Option<ModelName>) -> Vec<Option<ModelName>> {
    use ModelName::{Equidistant, Pinhole, Radtan, Rational};
    match (kernel, asked) {
        (KernelName::Ply, _) => vec![None],
        (_, Some(model)) => vec![Some(model)],
        (KernelName::Zmap, None) => vec![Some(Radtan)],
        (_, None) => [Pinhole, Radtan, Rational, Equidistant].map(Some).into(),
    }
}

fn render(document: &Document) -> String {
    let mut text = format!("instructions: {}\n", instruction_set());
    for m in &document.machine {
        text.push_str(&format!(
            "limits with {} thread{}: memcpy {:.1} GB/s (read and written), {:.1}e9 multiply-adds/s, {:.2}e9 divisions/s\n",
            m.threads,
            if m.threads == 1 { "" } else { "s" },
            m.memcpy_bytes_per_second / 1e9,
            m.multiply_adds_per_second / 1e9,
            m.divisions_per_second / 1e9,
        ));
    }
    text.push('\n');
    let head =
        ["kernel", "model", "points", "threads", "million points/s", "ns a point", "of the limit", "limit"];
    let mut grid = vec![head.map(String::from).to_vec()];
    for r in &document.results {
        let name = |value: &dyn std::fmt::Debug| format!("{value:?}").to_lowercase();
        grid.push(vec![
            name(&r.kernel),
            r.model.map_or_else(|| "-".to_string(), |m| name(&m)),
            r.points.to_string(),
            r.threads.to_string(),
            format!("{:.1}", r.points_per_second / 1e6),
            format!("{:.3}", 1e9 / r.points_per_second),
            format!("{:.2}", r.fraction_of_limit),
            r.limit.to_string(),
        ]);
    }
    text.push_str(&table::align(&grid));
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kernel_is_measured_against_a_limit() {
        for kernel in
            [KernelName::Project, KernelName::Unproject, KernelName::Track, KernelName::Zmap, KernelName::Ply]
        {
            for model in models(kernel, None) {
                let machine = Machine {
                    threads: 1,
                    memcpy_bytes_per_second: 1e10,
                    multiply_adds_per_second: 1e10,
                    divisions_per_second: 1e9,
                };
                let measured = Work::new(kernel, model, 500).unwrap().measure(&machine).unwrap();
                assert!(measured.seconds > 0.0 && measured.limit_seconds > 0.0, "{kernel:?} {model:?}");
            }
        }
    }
}
