//! `cargo run --release -p vice-tests --bin diagnose_seeds -- [SEEDS] [FLAW]`: how often the diagnosis is right, over
//! flights with one known flaw each, by default 100 of each: once with a reference that places the camera for depth, and
//! once without any, with a depth camera.
#![forbid(unsafe_code)]
#![allow(clippy::print_stdout, clippy::print_stderr)] // It is all that it is for.

use std::process::ExitCode;

use vice_core::diagnose::{Flaw, VerdictKind};
use vice_tests::flawed::Flawed;

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
    println!("flaw                   depth       right  also  doubt  wrong  none   worst errors");
    for (flaw, with_reference) in flaws.iter().flat_map(|f| [(*f, true), (*f, false)]) {
        let mut counts = [0_u32; 5];
        let mut worst: Vec<f64> = vec![];
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
            let right: Vec<Flaw> = flaw.into_iter().collect();
            let outcome = match verdict.kind {
                VerdictKind::NoFlaw => 4,
                VerdictKind::CannotTell => 2,
                VerdictKind::Named if verdict.flaws == right => 0,
                VerdictKind::Named if verdict.flaws.starts_with(&right) && flaw.is_some() => 1,
                VerdictKind::Named => 3,
            };
            counts[outcome] += 1;
            if outcome != usize::from(flaw.is_none()) * 4 {
                eprintln!("  seed {seed}: {} ({:.3})", verdict.sentence, verdict.sureness);
            }
            if let Some(flaw) = flaw {
                let errors = flawed.errors(flaw, &diagnosed);
                worst.resize(errors.len(), 0.0);
                worst.iter_mut().zip(errors).for_each(|(w, e)| *w = w.max(e));
            }
        }
        let worst: Vec<String> = worst.iter().map(|e| format!("{e:.5}")).collect();
        let name = flaw.map_or("none", Flaw::name);
        let depth = if with_reference { "reference" } else { "camera" };
        let [right, also, doubt, wrong, none] = counts;
        println!(
            "{name:22} {depth:10} {right:6} {also:5} {doubt:6} {wrong:6} {none:5}   {}",
            worst.join(" ")
        );
    }
    ExitCode::SUCCESS
}
