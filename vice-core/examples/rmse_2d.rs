//! RMSE_2D of one's own arrays: no data set, no file.
//!
//! ```text
//! cargo run --release -p vice-core --example rmse_2d
//! ```
//!
//! A camera looks down at a floor and slides along it. Three points were labelled in its images, their depth at the
//! first frame was measured, and an odometry says how the camera moved. Put your own numbers in place of these.
#![allow(clippy::print_stdout)]

use std::error::Error;

use vice_core::camera::{Camera, Model, Pixel};
use vice_core::dataset::Floor;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::error::DataResult;
use vice_core::evaluate::{Evaluation, FixedRig, Selection, Stream, Window, evaluate};
use vice_core::frames::Rigid;
use vice_core::label::{LabelRow, LabelSet, Observation};
use vice_core::result::Role;
use vice_core::time::Stamp;
use vice_core::trajectory::{PoseRow, Trajectory};

/// Frames, 50 ms apart.
const FRAMES: usize = 20;
/// The camera's speed along x, and what the odometry makes of it, m/s.
const SPEED_M_S: f64 = 0.5;
const ODOMETRY_M_S: f64 = 0.52;
/// Half a turn about x, as w, x, y, z: the optical axis points down.
const LOOKING_DOWN: [f64; 4] = [0.0, 1.0, 0.0, 0.0];
/// The focal length, pixels, and where the axis meets the image.
const FOCAL_PX: f64 = 400.0;
const CENTRE_PX: [f64; 2] = [320.0, 240.0];
/// The points at the first frame: pixel, and metres along the optical axis.
const POINTS: [(&str, [f64; 2], f64); 3] =
    [("carpet", [330.0, 200.0], 2.0), ("table", [420.0, 300.0], 1.25), ("crate", [380.0, 150.0], 1.6)];

/// Depths that were measured, by pixel of the first frame.
struct Measured;

impl DepthSource for Measured {
    fn name(&self) -> &str {
        "measured"
    }

    // These depths hold wherever the camera is in the world.
    fn needs_world(&self, _: &Floor) -> bool {
        false
    }

    fn depths(&self, _: &Keyframe<'_>, pixels: &[Pixel]) -> DataResult<Vec<Result<DepthSample, DepthMiss>>> {
        let depth = |pixel: &Pixel| {
            let point = POINTS.iter().find(|(_, at, _)| Pixel::from(*at).distance_px(*pixel) < 0.5);
            point.map(|(_, _, z_m)| DepthSample::new(*z_m)).ok_or(DepthMiss::NoDepth)
        };
        Ok(pixels.iter().map(depth).collect())
    }
}

/// What a person saw: the points move to the left, the nearer the faster.
fn labels(frames: &[Stamp]) -> Vec<LabelRow> {
    let mut rows = Vec::new();
    for (name, [u, v], z_m) in POINTS {
        for (i, stamp) in frames.iter().enumerate() {
            let moved_px = FOCAL_PX * SPEED_M_S * seconds(i) / z_m;
            let mut observation = Observation::manual(*stamp, Pixel::new(u - moved_px, v));
            // Its pixel here is lifted to 3D; all others are compared with where the odometry carries that.
            observation.keyframe = i == 0;
            rows.push(LabelRow { point: name.to_string(), observation });
        }
    }
    rows
}

/// Poses of the camera in the world at a speed along x.
fn poses(frames: &[Stamp], speed_m_s: f64) -> impl Iterator<Item = PoseRow> {
    frames.iter().enumerate().map(move |(i, stamp)| PoseRow {
        stamp: *stamp,
        position_m: [speed_m_s * seconds(i), 0.0, 2.0],
        rotation_wxyz: LOOKING_DOWN,
    })
}

fn seconds(frame: usize) -> f64 {
    0.05 * frame as f64
}

fn main() -> Result<(), Box<dyn Error>> {
    let [cx, cy] = CENTRE_PX;
    let camera = Camera::new(640, 480, [FOCAL_PX, FOCAL_PX, cx, cy], Model::Pinhole)?;
    let frames: Vec<Stamp> = (0..FRAMES as i64).map(|i| Stamp::from_nanos(50_000_000 * i)).collect();
    let labels = LabelSet::from_rows(labels(&frames))?;
    let streams = [
        Stream::new("truth", Role::Reference, Trajectory::from_rows(poses(&frames, SPEED_M_S))?),
        Stream::new("odometry", Role::Estimate, Trajectory::from_rows(poses(&frames, ODOMETRY_M_S))?),
    ];

    // The poses are those of the camera itself.
    let rig = FixedRig::new(Rigid::identity());
    let selection = Selection::new(&labels, &frames, &camera, &Window::default())?;
    let evaluation = Evaluation::builder(&rig, &camera, &frames, &selection)
        .streams(&streams)
        .depths(&[&Measured])
        .build();
    let found = evaluate(&evaluation, &|_, _| {})?;

    for part in &found.pixel {
        println!("{}: {} labels scored, {} skipped", part.stream, part.scored, part.skipped.len());
        for (points, rmse) in &part.rmse_px {
            if let Some(rmse) = rmse {
                println!("  RMSE_2D of {points} points: {:.3} ± {:.3} px", rmse.mean, rmse.std);
            }
        }
    }
    Ok(())
}
