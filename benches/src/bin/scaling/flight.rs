//! A flight without images in EuRoC's layout, an estimate of it, and labels on the floor; and trajectories.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use vice_benches::radtan;
use vice_core::frames::WorldFromCamera;
use vice_core::random::Congruential;

use crate::Result;

const START_NS: u64 = 1_600_000_000_000_000_000;
const FRAME_NS: u64 = 50_000_000;
/// Each point is placed anew after so many frames.
const SEGMENT: usize = 200;

fn create(path: &Path) -> std::io::Result<BufWriter<File>> {
    Ok(BufWriter::with_capacity(1 << 20, File::create(path)?))
}

fn stamp(frame: usize) -> u64 {
    START_NS + FRAME_NS * frame as u64
}

/// Where the camera is: over one place, looking down and swaying so little that it never loses it.
fn world_from_camera(frame: usize) -> WorldFromCamera {
    let t = frame as f64 * FRAME_NS as f64 * 1e-9;
    let down = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down));
    let sway = Vector3::new(0.05 * (0.7 * t).sin(), 0.05 * (0.9 * t).cos(), 0.3 * (0.2 * t).sin());
    let place =
        Vector3::new(1.5 + 0.2 * (0.11 * t).sin(), 1.5 + 0.2 * (0.07 * t).cos(), 1.6 + 0.1 * (0.4 * t).sin());
    WorldFromCamera::from_parts(place, UnitQuaternion::from_scaled_axis(sway) * down)
}

/// Writes the folder `flight` with so many frames and a pose at each, and beside it `estimate.txt` and `labels.csv` with
/// so many points in every frame.
pub(crate) fn write(folder: &Path, frames: usize, points: usize) -> Result<()> {
    let camera = radtan()?;
    let flight = folder.join("flight/mav0");
    let (images, truth) = (flight.join("cam0"), flight.join("state_groundtruth_estimate0"));
    std::fs::create_dir_all(images.join("data"))?;
    std::fs::create_dir_all(&truth)?;
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let distortion = &camera.model().coefficients()[..4];
    std::fs::write(
        images.join("sensor.yaml"),
        format!(
            "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, \
             0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [{fx}, \
             {fy}, {cx}, {cy}]\ndistortion_model: radial-tangential\ndistortion_coefficients: {distortion:?}\n"
        ),
    )?;
    let mut listing = create(&images.join("data.csv"))?;
    let mut poses = create(&truth.join("data.csv"))?;
    let mut estimate = create(&folder.join("estimate.txt"))?;
    let mut labels = create(&folder.join("labels.csv"))?;
    writeln!(listing, "#timestamp [ns],filename")?;
    writeln!(poses, "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z")?;
    writeln!(labels, "point,timestamp_ns,u_px,v_px,keyframe")?;
    let mut numbers = Congruential::new(3);
    let places: Vec<Point3<f64>> =
        (0..points).map(|_| Point3::new(numbers.uniform(1.1, 1.9), numbers.uniform(1.2, 1.8), 0.0)).collect();
    for frame in 0..frames {
        let (pose, stamp) = (world_from_camera(frame), stamp(frame));
        let ([x, y, z], q): ([f64; 3], _) = (pose.translation().into(), pose.rotation());
        writeln!(listing, "{stamp},{stamp}.png")?;
        writeln!(poses, "{stamp},{x:.9},{y:.9},{z:.9},{:.12},{:.12},{:.12},{:.12}", q.w, q.i, q.j, q.k)?;
        let [x, y, z] = [x, y, z].map(|v| v + numbers.uniform(-0.01, 0.01));
        let (seconds, nanos) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
        write!(estimate, "{seconds}.{nanos:09} {x:.9} {y:.9} {z:.9} ")?;
        writeln!(estimate, "{:.12} {:.12} {:.12} {:.12}", q.i, q.j, q.k, q.w)?;
        let camera_from_world = pose.inverse();
        for (point, place) in places.iter().enumerate() {
            let px = camera.project(&camera_from_world.transform_point(place))?;
            let [u, v] = [px.u, px.v].map(|v| v + numbers.uniform(-0.3, 0.3));
            writeln!(labels, "{point},{stamp},{u:.3},{v:.3},{}", u8::from(frame % SEGMENT == 0))?;
        }
    }
    for mut file in [listing, poses, estimate, labels] {
        file.flush()?;
    }
    Ok(())
}

/// Writes two trajectories in TUM's format that look about a little and turn round in their last thirty poses.
pub(crate) fn write_turning(folder: &Path, poses: usize) -> Result<()> {
    for (name, noise) in [("reference.tum", 0.0), ("estimate.tum", 0.02)] {
        let mut file = create(&folder.join(name))?;
        let mut numbers = Congruential::new(7);
        for i in 0..poses {
            let t = i as f64 * 0.05;
            let turned = if i + 30 >= poses { 170_f64.to_radians() } else { 0.0 };
            let yaw = 0.15 * (0.2 * t).sin() + turned + numbers.uniform(-noise, noise);
            let (x, y) = (t.cos() + numbers.uniform(-noise, noise), (2.0 * t).sin());
            let (stamp, half) = (stamp(i), 0.5 * yaw);
            let (seconds, nanos) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
            writeln!(file, "{seconds}.{nanos:09} {x:.9} {y:.9} 0 0 0 {:.12} {:.12}", half.sin(), half.cos())?;
        }
        file.flush()?;
    }
    Ok(())
}
