use super::*;
use std::sync::Arc;

use vice_core::camera::Pixel;
use vice_core::dataset::{Image, PixelFormat};

const SIZE: [u32; 2] = [200, 160];

/// Gray levels of a surface without end and without straight lines.
fn surface(u: f64, v: f64) -> f64 {
    128.0
        + 35.0 * (0.31 * u + 0.11 * v).sin()
        + 30.0 * (0.17 * u - 0.29 * v + 1.0).sin()
        + 25.0 * (0.47 * v + 0.6 * (0.13 * u).cos()).sin()
        + 20.0 * (0.07 * u + 0.23 * (0.2 * v).sin() * u.cos()).cos()
}

/// The surface as a camera sees it that shows its place `there(px)` at each pixel.
fn seen(there: impl Fn(Pixel) -> Pixel, gain: f64, offset: f64) -> Arc<Pyramid> {
    let pixels = (0..SIZE[1]).flat_map(|v| (0..SIZE[0]).map(move |u| Pixel::new(f64::from(u), f64::from(v))));
    let gray = pixels
        .map(|px| {
            let place = there(px);
            (gain * surface(place.u, place.v) + offset).round().clamp(0.0, 255.0) as u8
        })
        .collect();
    let image = Image::new(SIZE[0], SIZE[1], PixelFormat::Gray8, gray).unwrap();
    Arc::new(Pyramid::new(&image, 3).unwrap())
}

/// The surface moved to the right and down.
fn moved(by: [f64; 2]) -> Arc<Pyramid> {
    seen(|px| Pixel::new(px.u - by[0], px.v - by[1]), 1.0, 0.0)
}

#[test]
fn luma_and_halving_are_those_of_opencv_to_the_bit() {
    let oracle = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/oracles/klt.json");
    let oracle: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(oracle).unwrap()).unwrap();
    let bytes = |value: &serde_json::Value| -> Vec<u8> { serde_json::from_value(value.clone()).unwrap() };
    let (width, height) = (53_u32, 47_u32);
    let rgb: Vec<u8> = (0..height)
        .flat_map(|y| (0..width).flat_map(move |x| (0..3).map(move |c| [x, y, c])))
        .map(|[x, y, c]| ((x * x * 7 + y * 13 * (x % 5) + c * 91 + x * y / 3) % 256) as u8)
        .collect();
    let image = Image::new(width, height, PixelFormat::Rgb8, rgb).unwrap();
    let pyramid = Pyramid::new(&image, 3).unwrap();
    // A quarter of it is too small for a window.
    assert_eq!(pyramid.levels().len(), 2);
    assert_eq!(pyramid.base().pixels, bytes(&oracle["pattern"]["gray"]));
    assert_eq!(pyramid.levels()[1].pixels, bytes(&oracle["half"]["pixels"]));
}

#[test]
fn a_shift_is_found_between_pixels_and_at_the_border() {
    let [one, two] = [moved([0.0, 0.0]), moved([3.37, -2.61])];
    let points = [(100.0, 80.0), (60.25, 40.75), (8.0, 90.0), (150.0, 151.0)].map(|(u, v)| Pixel::new(u, v));
    for (point, found) in points.iter().zip(track_translation(&one, &two, &points)) {
        let off_px = found.unwrap().distance_px(Pixel::new(point.u + 3.37, point.v - 2.61));
        assert!(off_px < 0.05, "{point:?}: {off_px} px");
    }
    let outside = [(-40.0, 5.0), (1e9, 5.0), (f64::NAN, 5.0), (100.0, -1e300)].map(|(u, v)| Pixel::new(u, v));
    assert_eq!(track_translation(&one, &two, &outside), [None; 4]);
    let flat = Image::new(64, 64, PixelFormat::Gray8, vec![90; 64 * 64]).unwrap();
    let flat = Pyramid::new(&flat, 3).unwrap();
    assert_eq!(track_translation(&flat, &flat, &[Pixel::new(30.0, 30.0)]), [None]);
    assert!(Pyramid::new(&Image::new(0, 5, PixelFormat::Gray8, vec![]).unwrap(), 3).is_err());
}

/// Turned by a degree and magnified by 3 % a frame about a place that moves: after 25 frames twice as large.
#[test]
fn a_point_is_carried_through_turn_scale_and_light() {
    let frame = |i: f64| {
        let (angle, scale) = ((1.0 * i).to_radians(), 1.03_f64.powf(i));
        let (sin, cos) = angle.sin_cos();
        let there = move |px: Pixel| {
            let (u, v) = ((px.u - 90.0 - 0.8 * i) / scale, (px.v - 70.0 + 0.5 * i) / scale);
            Pixel::new(cos * u + sin * v + 90.0, -sin * u + cos * v + 70.0)
        };
        seen(there, 1.0 - 0.02 * i, 1.5 * i)
    };
    let start = Pixel::new(90.0, 70.0);
    let mut track = PointTrack::start(&frame(0.0), start, TrackOptions::default()).unwrap();
    for i in 1..=25 {
        let i = f64::from(i);
        let step = track.step(&frame(i), None);
        let off_px = step.px.distance_px(Pixel::new(90.0 + 0.8 * i, 70.0 - 0.5 * i));
        assert!(step.outcome.is_found() && off_px < 0.15, "frame {i}: {off_px} px {step:?}");
        assert!(step.confidence > DOUBT_CONFIDENCE, "frame {i}: {step:?}");
    }
    assert!(track.refreshes() >= 1);
}

#[test]
fn a_seed_moves_the_start_only() {
    let [one, two] = [moved([0.0, 0.0]), moved([7.3, 4.1])];
    let start = Pixel::new(80.0, 70.0);
    let track = PointTrack::start(&one, start, TrackOptions::default()).unwrap();
    let alone = track.clone().step(&two, None).px;
    assert!(alone.distance_px(Pixel::new(87.3, 74.1)) < 0.05);
    for (du, dv) in [(3.0, -2.0), (-4.0, 4.0), (0.4, 0.4)] {
        let seeded = track.clone().step(&two, Some(Pixel::new(alone.u + du, alone.v + dv))).px;
        assert!(seeded.distance_px(alone) < 0.01, "{seeded:?} {alone:?}");
    }
}

#[test]
fn tracking_ends_at_the_border_and_where_the_point_is_gone() {
    let options = TrackOptions::default();
    let mut track = PointTrack::start(&moved([0.0, 0.0]), Pixel::new(150.0, 80.0), options).unwrap();
    let mut outcomes = Vec::new();
    for i in 1..=20 {
        outcomes.push(track.step(&moved([3.0 * f64::from(i), 0.0]), None).outcome);
    }
    let found = outcomes.iter().take_while(|o| o.is_found()).count();
    // 187 is the last column with room for the template.
    assert!((11..=13).contains(&found), "{outcomes:?}");
    assert!(outcomes[found..].iter().all(|o| *o == Outcome::LeftImage), "{outcomes:?}");

    let mut track = PointTrack::start(&moved([0.0, 0.0]), Pixel::new(100.0, 80.0), options).unwrap();
    let elsewhere = track.step(&moved([1000.0, 777.0]), None);
    assert!(elsewhere.confidence < DOUBT_CONFIDENCE, "{elsewhere:?}");

    let frame = moved([0.0, 0.0]);
    let at_border = PointTrack::start(&frame, Pixel::new(5.0, 80.0), options).map(|_| ());
    assert_eq!(at_border, Err(TrackError::AtBorder));
    let nan = PointTrack::start(&frame, Pixel::new(f64::NAN, 80.0), options).map(|_| ());
    assert_eq!(nan, Err(TrackError::AtBorder));
    let flat = Image::new(64, 64, PixelFormat::Gray8, vec![90; 64 * 64]).unwrap();
    let flat = Arc::new(Pyramid::new(&flat, 3).unwrap());
    let even = PointTrack::start(&flat, Pixel::new(30.0, 30.0), options).map(|_| ());
    assert_eq!(even, Err(TrackError::NoTexture));
}
