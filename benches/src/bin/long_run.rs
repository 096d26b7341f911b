//! Writes a long flight without images and evaluates it with the program `vice`: time and peak memory of each command.
//!
//! usage: `long_run PROGRAM FOLDER [MINUTES] [POINTS]` (30 minutes, 400 points; 20 frames and 200 poses a second)
//!
//! The camera looks down at the floor and wanders over it; each point is carried until it leaves the image and is then
//! placed anew, as an annotator does. The flight is written once: a folder that is there is used again. Beside it lie
//! two trajectories of a million poses.
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector3};
use vice_benches::radtan;
use vice_core::camera::{Camera, Pixel};
use vice_core::frames::WorldFromCamera;
use vice_core::random::Congruential;

const START_NS: u64 = 1_600_000_000_000_000_000;
const FRAME_NS: u64 = 50_000_000;
const POSE_NS: u64 = 5_000_000;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [program, folder, rest @ ..] = &arguments[..] else {
        return Err("usage: long_run PROGRAM FOLDER [MINUTES] [POINTS]".into());
    };
    let number = |i: usize, default| rest.get(i).map_or(Ok(default), |n: &String| n.parse::<u64>());
    let (minutes, points) = (number(0, 30)?, number(1, 400)?);
    let folder = Path::new(folder);
    if !folder.exists() {
        std::fs::create_dir_all(folder)?;
        write_flight(&folder.join("flight"), minutes * 60 * 1_000_000_000, points)?;
        vice_benches::write_tum(&folder.join("reference.tum"), 1_000_000, 0.0)?;
        vice_benches::write_tum(&folder.join("estimate.tum"), 1_000_000, 0.02)?;
    }
    let evaluate =
        ["evaluate", "flight", "--labels", "flight/labels.csv", "--estimate", "flight/estimate.txt"];
    let commands: [&[&str]; 6] = [
        &[],
        &["--json", "none.json", "--samples", "none"],
        &["--json", "jsonl.json", "--samples", "jsonl"],
        &["--json", "all.json"],
        &["--fps", "10", "--duration", "30"],
        &["--subsets", "1,2,3,4"],
    ];
    for options in commands {
        run(program, folder, &[&evaluate[..], options].concat())?;
    }
    run(program, folder, &["trajectory", "reference.tum", "estimate.tum", "--align", "se3"])
}

/// Time and peak memory of a command.
fn run(program: &str, folder: &Path, arguments: &[&str]) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let program = std::fs::canonicalize(program)?;
    let mut child =
        Command::new(program).current_dir(folder).args(arguments).stdout(Stdio::null()).spawn()?;
    let mut peak_kib = 0;
    let status = loop {
        let text = std::fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or_default();
        let kib: u64 = line.trim().trim_end_matches(" kB").parse().unwrap_or(0);
        peak_kib = peak_kib.max(kib);
        if let Some(status) = child.try_wait()? {
            break status;
        }
        std::thread::sleep(Duration::from_millis(2));
    };
    let seconds = start.elapsed().as_secs_f64();
    println!("{seconds:7.2} s {:6} MiB  vice {}  ({status})", peak_kib / 1024, arguments.join(" "));
    Ok(())
}

/// Where the camera is, looking down and swaying a little.
fn world_from_camera(ns: u64) -> WorldFromCamera {
    let t = ns as f64 * 1e-9;
    let down = Matrix3::new(1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0);
    let down = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(down));
    let sway = Vector3::new(0.1 * (0.7 * t).sin(), 0.1 * (0.9 * t).cos(), 0.3 * (0.2 * t).sin());
    let place = Vector3::new(3.0 * (0.11 * t).sin(), 3.0 * (0.07 * t).cos(), 1.6 + 0.3 * (0.4 * t).sin());
    WorldFromCamera::from_parts(place, UnitQuaternion::from_scaled_axis(sway) * down)
}

fn create(path: &Path) -> std::io::Result<BufWriter<File>> {
    Ok(BufWriter::with_capacity(1 << 20, File::create(path)?))
}

fn write_flight(folder: &Path, duration_ns: u64, points: u64) -> Result<(), Box<dyn Error>> {
    let camera = radtan()?;
    let (images, truth) = (folder.join("mav0/cam0"), folder.join("mav0/state_groundtruth_estimate0"));
    std::fs::create_dir_all(images.join("data"))?;
    std::fs::create_dir_all(&truth)?;
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let distortion = &camera.model().coefficients()[..4];
    std::fs::write(
        images.join("sensor.yaml"),
        format!(
            "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, \
             1.0, 0.0, 0.0, 0.0, 0.0, 1.0]\nrate_hz: 20\nresolution: [752, 480]\ncamera_model: pinhole\nintrinsics: [{fx}, {fy}, \
             {cx}, {cy}]\ndistortion_model: radial-tangential\ndistortion_coefficients: {distortion:?}\n"
        ),
    )?;
    let mut listing = create(&images.join("data.csv"))?;
    let mut poses = create(&truth.join("data.csv"))?;
    let mut estimate = create(&folder.join("estimate.txt"))?;
    let mut numbers = Congruential::new(3);
    writeln!(listing, "#timestamp [ns],filename")?;
    writeln!(poses, "#timestamp,p_x,p_y,p_z,q_w,q_x,q_y,q_z")?;
    for ns in (0..=duration_ns).step_by(POSE_NS as usize) {
        let pose = world_from_camera(ns);
        let ([x, y, z], q): ([f64; 3], _) = (pose.translation().into(), pose.rotation());
        let stamp = START_NS + ns;
        writeln!(poses, "{stamp},{x:.9},{y:.9},{z:.9},{:.12},{:.12},{:.12},{:.12}", q.w, q.i, q.j, q.k)?;
        let mut noise = || numbers.uniform(-0.02, 0.02);
        let (x, y, z) = (x + noise(), y + noise(), z + noise());
        let (seconds, nanos) = (stamp / 1_000_000_000, stamp % 1_000_000_000);
        writeln!(
            estimate,
            "{seconds}.{nanos:09} {x:.9} {y:.9} {z:.9} {:.12} {:.12} {:.12} {:.12}",
            q.i, q.j, q.k, q.w
        )?;
        if ns % FRAME_NS == 0 {
            writeln!(listing, "{stamp},{stamp}.png")?;
        }
    }
    for mut file in [listing, poses, estimate] {
        file.flush()?;
    }
    write_labels(&folder.join("labels.csv"), &camera, duration_ns, points)
}

fn write_labels(path: &Path, camera: &Camera, duration_ns: u64, points: u64) -> Result<(), Box<dyn Error>> {
    let mut numbers = Congruential::new(5);
    let mut places: Vec<Option<Point3<f64>>> = vec![None; points as usize];
    let mut labels = create(path)?;
    writeln!(labels, "point,timestamp_ns,u_px,v_px,keyframe")?;
    for ns in (0..=duration_ns).step_by(FRAME_NS as usize) {
        let pose = world_from_camera(ns);
        let camera_from_world = pose.inverse();
        for (name, place) in places.iter_mut().enumerate() {
            let seen = place.and_then(|p| camera.project(&camera_from_world.transform_point(&p)).ok());
            // As written, with three decimals, it must still lie in the image.
            let seen = seen.filter(|px| (0.0..751.0).contains(&px.u) && (0.0..479.0).contains(&px.v));
            let px = match seen {
                Some(px) => px,
                None => {
                    let px = Pixel::new(numbers.uniform(100.0, 650.0), numbers.uniform(80.0, 400.0));
                    let ray = pose.rotate(&camera.unproject(px)?);
                    let eye = pose.translation();
                    *place = Some(Point3::from(eye - ray * (eye.z / ray.z)));
                    px
                }
            };
            let keyframe = u8::from(seen.is_none());
            writeln!(labels, "{name},{},{:.3},{:.3},{keyframe}", START_NS + ns, px.u, px.v)?;
        }
    }
    Ok(labels.flush()?)
}
