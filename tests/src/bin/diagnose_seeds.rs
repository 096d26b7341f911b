//! `cargo run --release -p vice-tests --bin diagnose_seeds -- [SEEDS] [FLAW]`: how often the diagnosis is right, over
//! flights with one known flaw each, by default 100 of each: once with a reference that places the camera for depth, and
//! once without any, with a depth camera.
#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr)] // It is all that it is for.

use std::process::ExitCode;

use vice_core::diagnose::{Diagnosed, Flaw, VerdictKind};
use vice_tests::flawed::Flawed;

/// What the size of a flaw is to be found within: see the numbers to reach. Flaws without one count as found.
fn limits(flaw: Flaw) -> Vec<f64> {
    match flaw {
        Flaw::ClockOffset => vec![0.002],
        Flaw::ExtrinsicRotation => vec![0.1_f64.to_radians()],
        Flaw::FocalLength => vec![0.002],
        Flaw::Drift => vec![0.1 * 0.05, 0.1 * 0.4_f64.to_radians()],
        _ => vec![],
    }
}

/// One standard deviation of the error's parts by the intervals of the diagnosis itself.
fn deviations(flaw: Flaw, diagnosed: &Diagnosed) -> Vec<f64> {
    let found = diagnosed.document.flaws.iter().find(|part| part.flaw == flaw);
    let parameters = found.map(|part| part.parameters.iter()).into_iter().flatten();
    parameters.map(|p| (p.high - p.low) / (2.0 * 2.5)).collect()
}

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let seeds = arguments.next().map_or(Ok(100), |text| text.parse::<u64>());
    let only = arguments.next().map(|text| text.parse::<Flaw>()).transpose();
    let (Ok(seeds), Ok(only)) = (seeds, only) else {
        eprintln!("usage: diagnose_seeds [SEEDS] [FLAW]");
        return ExitCode::from(2);
    };
    let flaws: Vec<Option<Flaw>> = match only {
        Some(flaw) => vec![Some(flaw)],
        None => Flaw::ALL.into_iter().map(Some).chain([None]).collect(),
    };
    println!("flaw                   depth       right  also  doubt  wrong  none  within   worst errors");
    for (flaw, with_reference) in flaws.iter().flat_map(|f| [(*f, true), (*f, false)]) {
        let mut counts = [0_u32; 5];
        let (mut worst, mut within): (Vec<f64>, u32) = (vec![], 0);
        for seed in 0..seeds {
            let flawed = Flawed::new(flaw, seed);
            let diagnosed = match flawed.diagnose(with_reference) {
                Ok(diagnosed) => diagnosed,
                Err(error) => {
                    eprintln!("seed {seed}: {error}");
                    return ExitCode::FAILURE;
                }
            };
            let verdict = &diagnosed.document.verdict;
            let right: Vec<String> = flaw.iter().map(|f| f.name().to_string()).collect();
            let outcome = match verdict.kind {
                VerdictKind::NoFlaw => 4,
                VerdictKind::Named if verdict.flaws == right => 0,
                VerdictKind::Named if verdict.flaws.starts_with(&right) && flaw.is_some() => 1,
                VerdictKind::Named => 3,
                _ => 2,
            };
            counts[outcome] += 1;
            if outcome != usize::from(flaw.is_none()) * 4 {
                eprintln!("  seed {seed}: {} ({:.3})", verdict.sentence, verdict.sureness);
            }
            if let Some(flaw) = flaw {
                let errors = flawed.errors(flaw, &diagnosed);
                let off = errors.iter().zip(limits(flaw)).any(|(error, limit)| *error >= limit);
                within += u32::from(!off);
                if off {
                    let widths = deviations(flaw, &diagnosed);
                    eprintln!(
                        "  seed {seed}: off by {errors:.5?}, one deviation of its intervals is {widths:.5?}"
                    );
                }
                worst.resize(errors.len(), 0.0);
                worst.iter_mut().zip(errors).for_each(|(w, e)| *w = w.max(e));
            }
        }
        let worst: Vec<String> = worst.iter().map(|e| format!("{e:.5}")).collect();
        let name = flaw.map_or("none", Flaw::name);
        let depth = if with_reference { "reference" } else { "camera" };
        let [right, also, doubt, wrong, none] = counts;
        println!(
            "{name:22} {depth:10} {right:6} {also:5} {doubt:6} {wrong:6} {none:5} {within:7}   {}",
            worst.join(" ")
        );
    }
    ExitCode::SUCCESS
}
