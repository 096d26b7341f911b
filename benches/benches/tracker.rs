//! The tracker: 200 corners of a real pair of frames from images to points;
//! a frame of one point with its template; suggested points. OpenCV's time: `tests/oracles/klt.py --time`.
#![allow(clippy::unwrap_used)] // A benchmark that cannot run fails.

use std::hint::black_box;
use std::sync::Arc;

use criterion::{Criterion, criterion_group, criterion_main};
use vice_benches::shared;
use vice_core::camera::Pixel;
use vice_core::dataset::Image;
use vice_track::{PointTrack, Pyramid, SuggestOptions, TrackOptions, corners, suggest, track_translation};

const FRAMES: [&str; 2] = ["1403715408062142976.jpg", "1403715408112143104.jpg"];

fn images() -> Option<[Image; 2]> {
    let folder = shared("data/euroc_v1_01/mav0/cam0/data")?;
    let [a, b] = FRAMES.map(|name| vice_files::image_file::read(folder.join(name)));
    Some([a.ok()?, b.ok()?])
}

fn tracker(c: &mut Criterion) {
    let Some([one, two]) = images() else { return };
    let pyramids = || [&one, &two].map(|image| Pyramid::new(image, 3).unwrap());
    let [first, second] = pyramids().map(Arc::new);
    let points: Vec<Pixel> = corners(&first, 10.0).iter().take(200).map(|c| c.px).collect();

    let mut group = c.benchmark_group("tracker");
    group.bench_function("two pyramids, 752x480", |b| b.iter(|| black_box(pyramids())));
    group.bench_function("200 corners, from images", |b| {
        b.iter(|| {
            let [a, b] = pyramids();
            black_box(track_translation(&a, &b, &points))
        });
    });
    group.bench_function("200 corners, from pyramids", |b| {
        b.iter(|| black_box(track_translation(&first, &second, &points)));
    });
    let track = PointTrack::start(&first, points[0], TrackOptions::default()).unwrap();
    group.bench_function("a step of one point", |b| {
        b.iter_batched(|| track.clone(), |mut t| t.step(&second, None), criterion::BatchSize::SmallInput);
    });
    group.bench_function("4 suggestions", |b| b.iter(|| suggest(&first, 4, &SuggestOptions::default())));
    group.finish();
}

criterion_group!(benches, tracker);
criterion_main!(benches);
