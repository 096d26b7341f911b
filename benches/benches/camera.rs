//! Projection, undistortion, moving points and equation 1: each model at 10^2 to 10^7 points, with one thread and all.
//!
//! `cargo bench -p vice-benches -- project` runs one kernel; `VICE_BENCH_POINTS` leaves out larger sizes.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used)] // A benchmark that cannot run may stop.

use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{
    BatchSize, BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main,
};
use nalgebra::Point3;
use rayon::ThreadPool;
use vice_benches::{keyframe, small_motion};
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::depth::DepthSource;
use vice_core::frames::{Rigid, WorldFromCamera};
use vice_core::lanes::Element;
use vice_core::random::Congruential;
use vice_core::track::track_batch;
use vice_depth::FloorDepth;

fn models() -> [(&'static str, Camera); 8] {
    let models: [(&str, &[f64]); 8] = [
        ("pinhole", &[]),
        ("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]),
        ("rational", &[0.35, 0.12, 0.0004, -0.0007, 0.01, 0.62, 0.2, 0.02]),
        ("equidistant", &[0.0034823894, 0.00071503484, -0.0020532361, 0.00020293673]),
        ("ds", &[-0.18, 0.59]),
        ("eucm", &[0.63, 1.04]),
        ("omni", &[0.9, -0.2, 0.05, 0.0005, -0.0003]),
        ("fov", &[0.93]),
    ];
    models.map(|(name, c)| {
        let model = Model::from_name(name, c).unwrap();
        (name, Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model).unwrap())
    })
}

fn sizes() -> Vec<usize> {
    let most = std::env::var("VICE_BENCH_POINTS").ok().and_then(|v| v.parse().ok()).unwrap_or(10_000_000);
    (2..=7).map(|e| 10_usize.pow(e)).filter(|n| *n <= most).collect()
}

/// One thread and, where there are more, all.
fn pools() -> Vec<(String, ThreadPool)> {
    let all = std::thread::available_parallelism().map_or(1, usize::from);
    let pool = |n| rayon::ThreadPoolBuilder::new().num_threads(n).build().unwrap();
    let mut pools = vec![("1 thread".to_string(), pool(1))];
    if all > 1 {
        pools.push((format!("{all} threads"), pool(all)));
    }
    pools
}

fn quick(group: &mut BenchmarkGroup<'_, WallTime>, n: usize) {
    group
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(800));
    group.throughput(Throughput::Elements(n as u64));
}

/// Numbers, and room for as many results.
struct Data<T> {
    input: [Vec<T>; 3],
    output: [Vec<T>; 2],
    valid: Vec<bool>,
}

impl<T: Element> Data<T> {
    fn new(n: usize, ranges: [[f64; 2]; 3]) -> Self {
        let mut numbers = Congruential::new(7);
        let input =
            ranges.map(|[low, high]| numbers.list(n, low, high).into_iter().map(T::from_f64).collect());
        Self { input, output: [(); 2].map(|()| vec![T::default(); n]), valid: vec![false; n] }
    }
}

const POINTS_M: [[f64; 2]; 3] = [[-0.7, 0.7], [-0.42, 0.42], [1.0, 8.0]];
const PIXELS: [[f64; 2]; 3] = [[20.0, 730.0], [20.0, 460.0], [1.0, 8.0]];

fn project_of<T: Element>(c: &mut Criterion, kind: &str) {
    for (threads, pool) in pools() {
        for (name, camera) in models() {
            let mut group = c.benchmark_group(format!("project/{name}, {kind}, {threads}"));
            for n in sizes() {
                quick(&mut group, n);
                let Data { input: [x, y, z], output: [mut u, mut v], mut valid } =
                    Data::<T>::new(n, POINTS_M);
                group.bench_function(BenchmarkId::from_parameter(n), |b| {
                    pool.install(|| {
                        b.iter(|| camera.project_batch([&x, &y, &z], [&mut u, &mut v], &mut valid))
                    });
                });
            }
        }
    }
}

fn unproject_of<T: Element>(c: &mut Criterion, kind: &str) {
    for (threads, pool) in pools() {
        for (name, camera) in models() {
            let mut group = c.benchmark_group(format!("unproject/{name}, {kind}, {threads}"));
            for n in sizes() {
                quick(&mut group, n);
                let Data { input: [u, v, _], output: [mut x, mut y], mut valid } = Data::<T>::new(n, PIXELS);
                group.bench_function(BenchmarkId::from_parameter(n), |b| {
                    pool.install(|| {
                        b.iter(|| camera.unproject_batch([&u, &v], [&mut x, &mut y], &mut valid))
                    });
                });
            }
        }
    }
}

fn track_of<T: Element>(c: &mut Criterion, kind: &str) {
    let (at_keyframe, now) = (WorldFromCamera::identity(), small_motion());
    for (threads, pool) in pools() {
        for (name, camera) in models() {
            let mut group = c.benchmark_group(format!("track/{name}, {kind}, {threads}"));
            for n in sizes() {
                quick(&mut group, n);
                let Data { input: [u, v, z], mut valid, .. } = Data::<T>::new(n, PIXELS);
                let size = if n > 100_000 { BatchSize::PerIteration } else { BatchSize::SmallInput };
                group.bench_function(BenchmarkId::from_parameter(n), |b| {
                    // The pixels of the key frame are replaced, so that each run gets them anew.
                    pool.install(|| {
                        b.iter_batched_ref(
                            || (u.clone(), v.clone()),
                            |(u, v)| track_batch(&camera, &at_keyframe, &now, [u, v], &z, &mut valid),
                            size,
                        )
                    });
                });
            }
        }
    }
}

fn project(c: &mut Criterion) {
    project_of::<f64>(c, "f64");
    project_of::<f32>(c, "f32");
}

fn unproject(c: &mut Criterion) {
    unproject_of::<f64>(c, "f64");
    unproject_of::<f32>(c, "f32");
}

fn track(c: &mut Criterion) {
    track_of::<f64>(c, "f64");
    track_of::<f32>(c, "f32");
}

fn transform(c: &mut Criterion) {
    for (threads, pool) in pools() {
        let mut group = c.benchmark_group(format!("transform/f64, {threads}"));
        for n in sizes() {
            quick(&mut group, n);
            let Data { input: [mut x, mut y, mut z], .. } = Data::<f64>::new(n, POINTS_M);
            let motion = small_motion();
            group.bench_function(BenchmarkId::from_parameter(n), |b| {
                pool.install(|| b.iter(|| motion.transform_batch([&mut x, &mut y, &mut z])));
            });
        }
    }
}

/// The single-point functions, which the batches are held to: what one of them costs.
fn single(c: &mut Criterion) {
    for (name, camera) in models() {
        let mut group = c.benchmark_group(format!("single/{name}"));
        quick(&mut group, 1);
        let point = Point3::new(0.3, -0.2, 2.0);
        group.bench_function("project", |b| b.iter(|| camera.project(std::hint::black_box(&point))));
        let px = Pixel::new(100.0, 400.0);
        group.bench_function("unproject", |b| b.iter(|| camera.unproject(std::hint::black_box(px))));
    }
}

/// Rays of pixels against the floor, as a key frame asks for them.
fn floor(c: &mut Criterion) {
    let [_, (name, camera), ..] = models();
    // 1.5 m up and looking down.
    let down =
        nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    let above: WorldFromCamera = Rigid::from_parts(nalgebra::Vector3::new(0.0, 0.0, 1.5), down);
    let keyframe = keyframe(&camera, above);
    let mut group = c.benchmark_group(format!("floor/{name}"));
    for n in sizes().into_iter().filter(|n| *n <= 1_000_000) {
        quick(&mut group, n);
        let mut numbers = Congruential::new(7);
        let pixels: Vec<Pixel> =
            (0..n).map(|_| Pixel::new(numbers.uniform(0.0, 751.0), numbers.uniform(0.0, 479.0))).collect();
        group.bench_function(BenchmarkId::from_parameter(n), |b| {
            b.iter(|| FloorDepth::new().depths(&keyframe, &pixels).unwrap());
        });
    }
}

criterion_group!(benches, project, unproject, track, transform, single, floor);
criterion_main!(benches);
