//! Trajectory metrics at 10^6 poses: reading, association, alignment, APE and RPE.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)] // A benchmark that cannot run may stop.

use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use vice_core::metrics::align::{Alignment, align};
use vice_core::metrics::associate::{Matching, PosePairs};
use vice_core::metrics::rpe::{Delta, DeltaUnit, PairMode, PairsFrom, RpeErrors, RpeOptions};
use vice_core::metrics::trajectory::{ApeErrors, Summary};
use vice_core::time::Span;
use vice_files::trajectory::{ReadOptions, read};

fn trajectory(c: &mut Criterion) {
    let n = std::env::var("VICE_BENCH_POINTS").ok().and_then(|v| v.parse().ok()).unwrap_or(1_000_000);
    let folder = tempfile::tempdir().unwrap();
    let paths = ["reference.tum", "estimate.tum"].map(|name| folder.path().join(name));
    vice_benches::write_tum(&paths[0], n, 0.0).unwrap();
    vice_benches::write_tum(&paths[1], n, 0.02).unwrap();
    let mut group = c.benchmark_group(format!("trajectory/{n} poses"));
    group.sample_size(10).measurement_time(Duration::from_secs(3)).throughput(Throughput::Elements(n as u64));
    let load = |i: usize| read(&paths[i], &ReadOptions::default()).unwrap().trajectory;
    group.bench_function("read", |b| b.iter(|| load(0).len()));
    let (reference, estimate) = (load(0), load(1));
    let matching = Matching::Nearest { t_max_diff: Span::from_millis(1) };
    let associated = || PosePairs::match_up(&reference, &estimate, matching, Span::ZERO).unwrap();
    group.bench_function("associate", |b| b.iter(|| associated().len()));
    let pairs = associated();
    for how in [Alignment::Se3, Alignment::Sim3, Alignment::Yaw] {
        group.bench_function(format!("align {}", how.name()), |b| {
            b.iter(|| align(&pairs, how, None).unwrap().apply_to(&pairs).len());
        });
    }
    group.bench_function("summary", |b| b.iter(|| Summary::of(&pairs).unwrap()));
    group.bench_function("ape", |b| b.iter(|| ApeErrors::of(&pairs).statistics().unwrap()));
    for (unit, mode) in [
        (DeltaUnit::Frames, PairMode::Consecutive),
        (DeltaUnit::Meters, PairMode::All),
        (DeltaUnit::Seconds, PairMode::All),
    ] {
        let options =
            RpeOptions { delta: Delta::new(1.0, unit).unwrap(), mode, pairs_from: PairsFrom::Reference };
        group.bench_function(format!("rpe {}", unit.name()), |b| {
            b.iter(|| RpeErrors::of(&pairs, &options).unwrap().statistics().unwrap());
        });
    }
}

criterion_group!(benches, trajectory);
criterion_main!(benches);
