//! Z-map depth: of the EuRoC cloud beside SciPy (`../shared/bench/peers.py --only zmap`), and of a large scan.
//!
//! `VICE_BENCH_POINTS` sets the size of the large scan, by default five million points.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::print_stderr)] // A benchmark that cannot run may stop.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Duration;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use nalgebra::{UnitQuaternion, Vector3};
use spade::{DelaunayTriangulation, Point2, Triangulation};
use vice_benches::{keyframe, shared};
use vice_core::camera::{Camera, Model, Pixel};
use vice_core::depth::DepthSource;
use vice_core::frames::{Rigid, WorldFromCamera};
use vice_depth::{Cloud, CloudOptions, ZMapDepth, ZMapOptions, depth_image};

/// What the peers do: the EuRoC cloud before a pinhole camera, 752x480.
fn euroc(c: &mut Criterion) {
    let Some(path) = shared("data/euroc_v1_01/mav0/pointcloud0/data.ply") else { return };
    let cloud = Arc::new(Cloud::read(path, &CloudOptions::default()).unwrap());
    let camera = Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], Model::Pinhole).unwrap();
    // OpenCV's rotation vector and translation take the world to the camera.
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(1.2, -1.2, 1.2));
    let camera_from_world: WorldFromCamera = Rigid::from_parts(Vector3::new(0.5, 0.2, 3.0), rotation);
    let keyframe = keyframe(&camera, camera_from_world.inverse().reinterpret());
    let mut group = c.benchmark_group("zmap/euroc");
    group.sample_size(10).measurement_time(Duration::from_secs(5));
    for occlusion in [false, true] {
        let name = if occlusion { "on" } else { "off" };
        let options = ZMapOptions { occlusion, ..ZMapOptions::default() };
        let zmap = ZMapDepth::new(Arc::clone(&cloud), Rigid::identity(), options);
        let points = zmap.visible(&keyframe);
        let answered = depth_image(&zmap, &keyframe).unwrap().answered();
        eprintln!("occlusion {name}: {} points, {answered} of {} pixels answered", points.len(), 752 * 480);
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_function(format!("triangulation alone, occlusion {name}"), |b| {
            let points: Vec<Point2<f64>> = points.iter().map(|(px, _)| Point2::new(px.u, px.v)).collect();
            b.iter_batched(
                || points.clone(),
                |points| DelaunayTriangulation::<Point2<f64>>::bulk_load(points).unwrap().num_vertices(),
                criterion::BatchSize::LargeInput,
            );
        });
        group.throughput(Throughput::Elements(752 * 480));
        group.bench_function(format!("full depth image, occlusion {name}"), |b| {
            b.iter(|| depth_image(black_box(&zmap), &keyframe).unwrap().answered());
        });
        group.throughput(Throughput::Elements(4));
        group.bench_function(format!("four pixels, occlusion {name}"), |b| {
            let pixels = [(200.0, 200.0), (300.0, 250.0), (400.0, 300.0), (500.0, 150.0)];
            let pixels = pixels.map(|(u, v)| Pixel::new(u, v));
            b.iter(|| zmap.depths(&keyframe, black_box(&pixels)).unwrap());
        });
    }
    group.finish();
}

fn large(c: &mut Criterion) {
    let n = std::env::var("VICE_BENCH_POINTS").ok().and_then(|v| v.parse().ok()).unwrap_or(5_000_000);
    let points = vice_benches::scan(n);
    let mut group = c.benchmark_group("zmap/large");
    group.sample_size(10).throughput(Throughput::Elements(n as u64));
    group.bench_function("index", |b| {
        b.iter(|| Cloud::from_points(points.iter().copied(), &CloudOptions::default()).unwrap().len());
    });
    let cloud = Arc::new(Cloud::from_points(points, &CloudOptions::default()).unwrap());
    let camera = Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], Model::Pinhole).unwrap();
    let keyframe = keyframe(&camera, vice_benches::in_the_room());
    let pixels: Vec<Pixel> =
        (0..8).map(|i| Pixel::new(60.0 + 90.0 * f64::from(i), 400.0 - 45.0 * f64::from(i))).collect();
    group.throughput(Throughput::Elements(pixels.len() as u64));
    for occlusion in [true, false] {
        let options = ZMapOptions { occlusion, ..ZMapOptions::default() };
        let zmap = ZMapDepth::new(Arc::clone(&cloud), Rigid::identity(), options);
        group.bench_function(format!("key frame of eight pixels, occlusion {occlusion}"), |b| {
            b.iter(|| zmap.depths(&keyframe, black_box(&pixels)).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, euroc, large);
criterion_main!(benches);
