//! Reading PLY files beside reading their bytes; plyfile is timed by `../shared/bench/peers.py --only ply`.
//!
//! `VICE_BENCH_POINTS` sets the size of the binary file, by default five million points.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::print_stderr)] // A benchmark that cannot run may stop.

use std::fmt::Write as _;
use std::path::Path;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use ply_rs::parser::Parser;
use ply_rs::ply::DefaultElement;
use vice_depth::{CloudOptions, read_scan_points};

const PROPERTIES: &str = "property float x\nproperty float y\nproperty float z\nend_header\n";

fn points(path: &Path) -> usize {
    read_scan_points(path, &CloudOptions::default()).unwrap().points.len()
}

fn ply(c: &mut Criterion) {
    let n = std::env::var("VICE_BENCH_POINTS").ok().and_then(|v| v.parse().ok()).unwrap_or(5_000_000);
    let folder = tempfile::tempdir().unwrap();
    let binary = folder.path().join("binary.ply");
    let ascii = folder.path().join("ascii.ply");
    let scan = vice_benches::scan(n);
    let mut bytes =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {n}\n{PROPERTIES}").into_bytes();
    bytes.extend(scan.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f32::to_le_bytes));
    std::fs::write(&binary, bytes).unwrap();
    let few = &scan[..scan.len().min(500_000)];
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n{PROPERTIES}", few.len());
    for p in few {
        writeln!(text, "{} {} {}", p.x, p.y, p.z).unwrap();
    }
    std::fs::write(&ascii, text).unwrap();

    let mut group = c.benchmark_group("ply");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    group.throughput(Throughput::Elements(n as u64));
    group.bench_function("binary, bytes into memory", |b| b.iter(|| std::fs::read(&binary).unwrap().len()));
    group.bench_function("binary, points", |b| b.iter(|| points(&binary)));
    group.throughput(Throughput::Elements(few.len() as u64));
    group.bench_function("ascii, points", |b| b.iter(|| points(&ascii)));
    group.bench_function("ascii, ply-rs alone", |b| {
        b.iter(|| {
            let mut file = std::fs::File::open(&ascii).unwrap();
            Parser::<DefaultElement>::new().read_ply(&mut file).unwrap().payload["vertex"].len()
        });
    });
    if let Some(path) = vice_benches::shared("data/euroc_v1_01/mav0/pointcloud0/data.ply") {
        group.throughput(Throughput::Elements(454_816));
        group.bench_function("EuRoC cloud, points", |b| b.iter(|| points(&path)));
    }
    group.finish();
}

criterion_group!(benches, ply);
criterion_main!(benches);
