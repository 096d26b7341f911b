//! The tracker against OpenCV on real frames, and against the truth on rendered flights.

use std::sync::Arc;

use nalgebra::Point3;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::Dataset;
use vice_files::image_file;
use vice_synthetic::{CAMERA, Synthetic, SyntheticOptions};
use vice_tests::{root, shared};
use vice_track::{
    DOUBT_CONFIDENCE, PointTrack, Pyramid, SuggestOptions, TrackOptions, suggest, track_translation,
};

fn median(mut values: Vec<f64>) -> f64 {
    vice_core::statistics::median(&mut values).unwrap()
}

/// Made by `oracles/klt.py`: 200 corners a pair of neighbouring frames and where `calcOpticalFlowPyrLK` finds them.
#[test]
fn windows_are_found_where_opencv_finds_them() {
    let Some(images) = shared("data/euroc_v1_01/mav0/cam0/data") else { return };
    let oracle = std::fs::read_to_string(root().join("tests/oracles/klt.json")).unwrap();
    let oracle: serde_json::Value = serde_json::from_str(&oracle).unwrap();
    let pyramid = |stamp: &serde_json::Value| {
        let image = image_file::read(images.join(format!("{stamp}.jpg"))).unwrap();
        Pyramid::new(&image, 3).unwrap()
    };
    let (mut off_px, mut differently_lost) = (Vec::new(), 0);
    for pair in oracle["pairs"].as_array().unwrap() {
        let rows: Vec<Vec<f64>> = serde_json::from_value(pair["points"].clone()).unwrap();
        let points: Vec<Pixel> = rows.iter().map(|r| Pixel::new(r[0], r[1])).collect();
        let found = track_translation(&pyramid(&pair["from_ns"]), &pyramid(&pair["to_ns"]), &points);
        assert_eq!(found.len(), 200);
        for (row, found) in rows.iter().zip(found) {
            match (&row[2..], found) {
                ([u, v], Some(px)) => off_px.push(px.distance_px(Pixel::new(*u, *v))),
                ([], None) => {}
                _ => differently_lost += 1,
            }
        }
    }
    assert!(off_px.len() > 1580 && differently_lost <= 8, "{} {differently_lost}", off_px.len());
    let far = off_px.iter().filter(|d| **d > 0.1).count();
    assert!(far <= 16, "{far} of {} are further off than 0.1 px", off_px.len());
    let median_px = median(off_px);
    assert!(median_px < 0.01, "{median_px} px");
}

/// A scene point that is tracked, and what was made of it.
struct Tracked {
    track: PointTrack,
    truth: Point3<f64>,
}

/// Error (px) and confidence of every observation, and the number of points that were begun.
struct Outcome {
    observations: Vec<(f64, f64)>,
    begun: usize,
}

/// Four suggested points at each time, tracked through every frame of a flight and compared at 10 Hz; where one ends,
/// another is suggested. Nothing is corrected.
fn track_flight(flight: &Synthetic) -> Outcome {
    let camera: Camera = flight.camera(CAMERA).unwrap();
    let frames = flight.frames(CAMERA).unwrap().len();
    let every = (flight.options().rate_hz / 10.0).round() as usize;
    let place_of = |frame: usize, px: Pixel| {
        let pose = flight.world_from_camera(frame);
        let eye = Point3::from(pose.translation());
        let ray = pose.rotate(&camera.unproject(px).unwrap());
        eye + ray * flight.scene().cast(&eye, &ray).unwrap().distance
    };
    let mut tracks: Vec<Tracked> = Vec::new();
    let mut outcome = Outcome { observations: Vec::new(), begun: 0 };
    for frame in 0..frames {
        let pyramid = Arc::new(Pyramid::for_tracking(&flight.image(CAMERA, frame).unwrap()).unwrap());
        tracks.retain_mut(|tracked| {
            let step = tracked.track.step(&pyramid, None);
            if step.outcome.is_found() && frame % every == 0 {
                let camera_from_world = flight.world_from_camera(frame).inverse();
                let error_px = camera
                    .project(&camera_from_world.transform_point(&tracked.truth))
                    .map_or(f64::INFINITY, |px| px.distance_px(step.px));
                outcome.observations.push((error_px, step.confidence));
            }
            step.outcome.is_found()
        });
        if frame % every == 0 && tracks.len() < 4 {
            let taken: Vec<Pixel> = tracks.iter().map(|t| t.track.px()).collect();
            let options = SuggestOptions { taken: &taken, ..SuggestOptions::default() };
            for suggestion in suggest(&pyramid, 4 - tracks.len(), &options) {
                let track = PointTrack::start(&pyramid, suggestion.px, TrackOptions::default()).unwrap();
                tracks.push(Tracked { track, truth: place_of(frame, suggestion.px) });
                outcome.begun += 1;
            }
        }
    }
    outcome
}

impl Outcome {
    /// Shares of observations within a pixel; of those, the doubtful ones; of all, those beyond a pixel without doubt.
    fn shares(&self) -> [f64; 3] {
        let n = self.observations.len() as f64;
        let count = |good: bool, doubtful: Option<bool>| {
            let is_it = |(error_px, confidence): &&(f64, f64)| {
                (*error_px <= 1.0) == good && doubtful.is_none_or(|d| (*confidence < DOUBT_CONFIDENCE) == d)
            };
            self.observations.iter().filter(is_it).count() as f64
        };
        [count(true, None) / n, count(true, Some(true)) / count(true, None), count(false, Some(false)) / n]
    }
}

/// The flight of `vice demo`: 370 observations, all of them within a pixel, 2.7 % doubtful when this was written.
#[test]
fn suggested_points_are_tracked_through_the_demo_flight() {
    let outcome = track_flight(&Synthetic::new(SyntheticOptions::default()).unwrap());
    let [good, doubted, missed] = outcome.shares();
    let n = outcome.observations.len();
    assert!(n > 340 && outcome.begun < 40, "{n} observations of {} points", outcome.begun);
    assert!(good >= 0.95 && doubted <= 0.10, "{good} within a pixel, {doubted} of them doubtful");
    assert!(missed == 0.0, "{missed} beyond a pixel and not doubtful");
    let median_px = median(outcome.observations.iter().map(|(e, _)| *e).collect());
    assert!(median_px < 0.2, "{median_px} px");
}

/// Another room: points on edges of boxes, of which a share slides along without the image telling.
#[test]
fn suggested_points_are_tracked_through_another_flight() {
    let outcome = track_flight(&Synthetic::new(SyntheticOptions { seed: 3, ..Default::default() }).unwrap());
    let [good, doubted, missed] = outcome.shares();
    assert!(good >= 0.95 && doubted <= 0.10, "{good} within a pixel, {doubted} of them doubtful");
    assert!(missed <= 0.03, "{missed} beyond a pixel and not doubtful");
}
