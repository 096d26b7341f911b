//! The rendered Blackbird flight against NumPy: key points, integration, films and what can go wrong with them.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, clippy::print_stderr)] // A helper fails its test.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use vice_blackbird::Blackbird;
use vice_core::camera::Pixel;
use vice_core::dataset::{Dataset, DatasetFactory, Floor, GROUND_TRUTH, OpenOptions, PixelFormat, Probe};
use vice_core::frames::{WorldFromBody, WorldFromCamera, rotation_angle_rad};
use vice_core::imu::{GRAVITY_Z_UP_M_S2, InertialState, integrate_euler};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_video::Ffmpeg;
use vice_video::film::{DecodeStats, Film};

const FLIGHT: &str = "data/blackbird/picasso/yawForward/maxSpeed1p0";
const CAMERA: &str = "left_gray";
const MAX_GAP: Span = Span::from_millis(100);

fn oracle_and_flight() -> Option<(Value, PathBuf)> {
    Some((vice_tests::shared_json("oracle/blackbird.json")?, vice_tests::shared(FLIGHT)?))
}

fn open_with(path: &Path, settings: &[(&str, &str)]) -> Box<dyn Dataset> {
    let settings = settings.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    Blackbird.open(path, &OpenOptions { settings }).unwrap()
}

fn open(path: &Path) -> Box<dyn Dataset> {
    open_with(path, &[])
}

fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    let numbers: Vec<f64> = value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    numbers.try_into().unwrap()
}

fn stamp(value: &Value) -> Stamp {
    Stamp::from_nanos(value.as_i64().unwrap())
}

/// The oracle is in NED: x north, y east, z down. The core's world is turned by a half about north.
fn up(ned: [f64; 3]) -> Vector3<f64> {
    Vector3::new(ned[0], -ned[1], -ned[2])
}

fn rotation_up(xyzw: [f64; 4]) -> UnitQuaternion<f64> {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    half_turn * UnitQuaternion::from_quaternion(Quaternion::new(xyzw[3], xyzw[0], xyzw[1], xyzw[2]))
}

/// FFmpeg is needed: without it the reason is printed, or with `VICE_REQUIRE_DATA=1` it fails.
fn ffmpeg_is_there() -> bool {
    match Ffmpeg::default().check() {
        Ok(()) => true,
        Err(e) if std::env::var("VICE_REQUIRE_DATA").is_ok_and(|v| v == "1") => panic!("{e}"),
        Err(e) => {
            eprintln!("skipped: {e}");
            false
        }
    }
}

fn oracle_state(oracle: &Value) -> InertialState {
    let start = &oracle["imu_euler"]["start"];
    InertialState {
        stamp: stamp(&start["timestamp_ns"]),
        world_from_body: WorldFromBody::from_parts(
            up(numbers(&start["position_m"])),
            rotation_up(numbers(&start["quat_xyzw"])),
        ),
        velocity_m_s: up(numbers(&start["velocity_mps"])),
        gyro_bias_rad_s: Vector3::zeros(),
        accel_bias_m_s2: Vector3::zeros(),
    }
}

fn integrate(dataset: &dyn Dataset, state: &InertialState) -> Trajectory {
    integrate_euler(&dataset.imu().unwrap(), state, Stamp::MAX, GRAVITY_Z_UP_M_S2).unwrap()
}

/// Bilinear depth of a key frame, all four neighbours valid.
fn depth_z_m(dataset: &dyn Dataset, frame: usize, px: Pixel) -> f64 {
    let image = dataset.depth_image(CAMERA, frame).unwrap().unwrap();
    let (u0, v0) = (px.u.floor(), px.v.floor());
    let (fu, fv) = (px.u - u0, px.v - v0);
    let at = |du: f64, dv: f64| f64::from(image.get((u0 + du) as u32, (v0 + dv) as u32).unwrap());
    (at(0.0, 0.0) * (1.0 - fu) + at(1.0, 0.0) * fu) * (1.0 - fv)
        + (at(0.0, 1.0) * (1.0 - fu) + at(1.0, 1.0) * fu) * fv
}

/// Depth of the floor along the optical axis.
fn floor_z_m(
    dataset: &dyn Dataset,
    at: Stamp,
    world_from_camera: &WorldFromCamera,
    ray: &Vector3<f64>,
) -> f64 {
    let Floor::World(plane) = dataset.floor(at).unwrap() else { panic!("the floor is in the world") };
    let direction = world_from_camera.rotate(ray);
    let height = plane.normal().dot(&world_from_camera.translation()) + plane.d_m();
    -height / plane.normal().dot(&direction)
}

/// Equation 1 over the samples of an oracle entry: the largest distance to its pixels, and RMSE_2D.
fn track(dataset: &dyn Dataset, stream: &Trajectory, entry: &Value, floor: bool) -> (f64, f64) {
    let camera = dataset.camera(CAMERA).unwrap();
    let frames = dataset.frames(CAMERA).unwrap();
    let truth = dataset.trajectory(GROUND_TRUTH).unwrap();
    let world_from_camera = |poses: &Trajectory, at: Stamp| {
        poses.pose_at(at, MAX_GAP).unwrap() * dataset.body_from_camera(CAMERA, at).unwrap()
    };
    let (mut points, mut off_px, mut squares) = (BTreeMap::new(), 0.0_f64, Vec::new());
    for sample in entry["samples"].as_array().unwrap() {
        let (at, point) = (stamp(&sample["timestamp_ns"]), sample["point"].as_i64().unwrap());
        let label = Pixel::from(numbers(&sample["label_px"]));
        if sample["keyframe"].as_bool().unwrap() {
            let ray = camera.unproject(label).unwrap();
            let frame = frames.iter().position(|f| *f == at).unwrap();
            let z_m = if floor {
                floor_z_m(dataset, at, &world_from_camera(&truth, at), &ray)
            } else {
                depth_z_m(dataset, frame, label)
            };
            let expected_m = sample["depth_z_m"].as_f64().unwrap();
            assert!((z_m - expected_m).abs() < 1e-6, "depth {z_m} m, not {expected_m} m");
            let p = Point3::from(ray * z_m);
            points.insert(point, world_from_camera(stream, at).transform_point(&p));
        } else {
            let p = world_from_camera(stream, at).inverse().transform_point(&points[&point]);
            let px = camera.project(&p).unwrap();
            off_px = off_px.max(px.distance_px(Pixel::from(numbers(&sample["tracked_px"]))));
            squares.push(px.distance_px(label).powi(2));
        }
    }
    assert_eq!(squares.len() as u64, entry["samples_counted"].as_u64().unwrap());
    (off_px, (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
}

#[test]
fn blackbird_key_points_agree_with_the_oracle() {
    let Some((oracle, flight)) = oracle_and_flight() else { return };
    let dataset = open(&flight);
    let truth = dataset.trajectory(GROUND_TRUTH).unwrap();
    let start = oracle_state(&oracle);
    let given = integrate(dataset.as_ref(), &start);
    let own_start = dataset.inertial_state(start.stamp).unwrap().unwrap();
    let own = integrate(dataset.as_ref(), &own_start);
    let vice = &oracle["vice"];
    for (stream, name, within_px) in
        [(&truth, "ground_truth", 1e-3), (&given, "imu_euler", 1e-3), (&own, "imu_euler", 0.02)]
    {
        for (depth, floor) in [("zcam", false), ("floor", true)] {
            let entry = &vice[&format!("{name}/{depth}")];
            let (off_px, rmse_px) = track(dataset.as_ref(), stream, entry, floor);
            let expected_px = entry["rmse_2d_px"].as_f64().unwrap();
            println!(
                "{name}/{depth}: at most {off_px:.2e} px off, RMSE_2D {rmse_px:.4} px ({expected_px:.4})"
            );
            assert!(off_px < within_px, "{name}/{depth}: {off_px} px off");
            assert!(
                (rmse_px - expected_px).abs() < within_px,
                "{name}/{depth}: {rmse_px}, not {expected_px}"
            );
        }
    }
    let rmse = |name: &str| vice[name]["rmse_2d_px"].as_f64().unwrap();
    assert_eq!(format!("{:.3}", rmse("ground_truth/zcam")), "0.010");
    assert_eq!(format!("{:.2}", rmse("imu_euler/zcam")), "19.23");
}

#[test]
fn blackbird_integration_agrees_with_the_oracle() {
    let Some((oracle, flight)) = oracle_and_flight() else { return };
    let dataset = open(&flight);
    let start = oracle_state(&oracle);
    let integrated = integrate(dataset.as_ref(), &start);
    let states = oracle["imu_euler"]["states"].as_array().unwrap();
    assert_eq!(integrated.len(), states.len());
    let (mut off_m, mut off_rad) = (0.0_f64, 0.0_f64);
    for ((at, pose), state) in integrated.iter().zip(states) {
        assert_eq!(at, stamp(&state["timestamp_ns"]));
        off_m = off_m.max((pose.translation() - up(numbers(&state["position_m"]))).norm());
        let turn = pose.rotation().inverse() * rotation_up(numbers(&state["quat_xyzw"]));
        off_rad = off_rad.max(rotation_angle_rad(&turn));
    }
    println!("integration: at most {off_m:.1e} m and {off_rad:.1e} rad off");
    assert!(off_m < 5e-5 && off_rad < 1e-6, "{off_m} m, {off_rad} rad");

    // The state that the adapter finds itself, and the one that it is told, in NED.
    let own = dataset.inertial_state(start.stamp).unwrap().unwrap();
    let pose_off = (own.world_from_body.translation() - start.world_from_body.translation()).norm();
    let velocity_off = (own.velocity_m_s - start.velocity_m_s).norm();
    println!("start: {pose_off:.1e} m and {velocity_off:.1e} m/s off");
    assert!(pose_off < 1e-9 && velocity_off < 2e-3, "{pose_off} m, {velocity_off} m/s");
    let [x, y, z] = numbers::<3>(&oracle["imu_euler"]["start"]["velocity_mps"]);
    let told = open_with(&flight, &[("initial-velocity", &format!("{x},{y},{z}"))]);
    assert_eq!(told.inertial_state(start.stamp).unwrap().unwrap().velocity_m_s, start.velocity_m_s);
}

#[test]
fn blackbird_frames_cameras_and_collections_are_those_of_the_folder() {
    let Some((oracle, flight)) = oracle_and_flight() else { return };
    let dataset = open(&flight);
    assert_eq!(dataset.cameras(), [CAMERA, "down_gray"]);
    assert_eq!(dataset.name(), "picasso_yawForward_maxSpeed1p0");
    let truth = dataset.trajectory(GROUND_TRUTH).unwrap();
    // These poses are the analytic ones. Linear interpolation of the 180 Hz rows is off by up to a dt²/8, which is 1e-5 m
    // at 2.6 m/s², and by as much in radians at 2.6 rad/s².
    let interpolation = 1e-5;
    for frame in oracle["frames"].as_array().unwrap() {
        let (index, at) = (frame["index"].as_u64().unwrap() as usize, stamp(&frame["stamp_ns"]));
        assert_eq!(dataset.frames(CAMERA).unwrap()[index], at);
        for (camera, key) in [(CAMERA, "T_NED_camera_left"), ("down_gray", "T_NED_camera_down")] {
            let pose = truth.pose_at(at, MAX_GAP).unwrap() * dataset.body_from_camera(camera, at).unwrap();
            let rows: Vec<[f64; 4]> = frame[key].as_array().unwrap().iter().map(numbers::<4>).collect();
            assert!((pose.translation() - up([rows[0][3], rows[1][3], rows[2][3]])).norm() < interpolation);
            let columns = [Vector3::x(), Vector3::y(), Vector3::z()].into_iter().enumerate();
            for (axis, unit) in columns {
                let direction = up([rows[0][axis], rows[1][axis], rows[2][axis]]);
                assert!((pose.rotate(&unit) - direction).norm() < interpolation);
            }
        }
    }
    assert!(dataset.has_depth(CAMERA) && !dataset.has_depth("down_gray"));
    let root = vice_tests::shared("data/blackbird").unwrap();
    assert_eq!(Blackbird.probe(&root), Probe::Collection(vec![flight.clone()]));
    assert_eq!(Blackbird.probe(&flight), Probe::Yes);
}

#[test]
fn blackbird_films_decode_as_ffmpeg_does_each_frame_once() {
    let Some((_, flight)) = oracle_and_flight() else { return };
    if !ffmpeg_is_there() {
        return;
    }
    for folder in ["Camera_Left_Gray", "Camera_Down_Gray"] {
        let path = flight.join("Test_Room").join(folder).join("lossless.mov");
        // FFmpeg on its own, with none of our options: a film is decoded to gray as anyone would.
        let raw = Command::new("ffmpeg")
            .args(["-v", "error", "-nostdin", "-i"])
            .arg(&path)
            .args(["-pix_fmt", "gray", "-f", "rawvideo", "-"])
            .output()
            .unwrap();
        let expected: Vec<&[u8]> = raw.stdout.chunks(1024 * 768).collect();
        assert_eq!(expected.len(), 20);
        let film = Film::open(&path, PixelFormat::Gray8, Ffmpeg::default()).unwrap();
        assert_eq!((film.frame_count(), film.size()), (20, (1024, 768)));
        for (index, frame) in expected.iter().enumerate() {
            assert!(film.frame(index).unwrap().data() == *frame, "{folder}: frame {index} differs");
        }
        assert_eq!(film.stats(), DecodeStats { starts: 1, frames: 20 });
        for index in [3, 17, 0, 11, 10, 19] {
            assert!(film.frame(index).unwrap().data() == expected[index], "{folder}: frame {index} differs");
        }
    }
    // Through the data set: the same pixels, and the full range of gray.
    let image = open(&flight).image(CAMERA, 7).unwrap();
    assert_eq!((image.width(), image.height(), image.format()), (1024, 768, PixelFormat::Gray8));
}

/// A copy of the flight that a test may damage.
fn copy_of(flight: &Path) -> tempfile::TempDir {
    fn copy(from: &Path, to: &Path) {
        std::fs::create_dir_all(to).unwrap();
        for entry in std::fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            let target = to.join(entry.file_name());
            if entry.path().is_dir() {
                copy(&entry.path(), &target);
            } else {
                // Read and write, so that the copy may be written to.
                std::fs::write(target, std::fs::read(entry.path()).unwrap()).unwrap();
            }
        }
    }
    let folder = tempfile::tempdir().unwrap();
    copy(flight, folder.path());
    folder
}

#[test]
fn blackbird_damage_is_told_in_one_line() {
    let Some((_, flight)) = oracle_and_flight() else { return };
    let copy = copy_of(&flight);
    let camera = copy.path().join("Test_Room/Camera_Left_Gray");
    let (film, stamps) = (camera.join("lossless.mov"), camera.join("nSecTimestamps.txt"));
    let (whole, text) = (std::fs::read(&film).unwrap(), std::fs::read_to_string(&stamps).unwrap());
    let frames = || open(copy.path()).frames(CAMERA).map(|f| f.len()).map_err(|e| e.to_string());
    assert_eq!(frames(), Ok(20));
    let lines: Vec<&str> = text.lines().collect();
    std::fs::write(&stamps, lines[..19].join("\n")).unwrap();
    assert!(frames().unwrap_err().contains("fewer stamps than frames: 19 stamps"));
    std::fs::write(&stamps, format!("{}\n1526182348402317409\n", text.trim_end())).unwrap();
    assert!(frames().unwrap_err().contains("more stamps than frames: 21 stamps"));
    std::fs::write(&stamps, &text).unwrap();
    std::fs::write(&film, &whole[..whole.len() / 2]).unwrap();
    let cut = frames().unwrap_err();
    assert!(cut.contains("lossless.mov: byte") && cut.contains("the film is cut off"), "{cut}");
    std::fs::write(&film, &whole).unwrap();
    std::fs::remove_file(&stamps).unwrap();
    assert!(frames().unwrap_err().contains("nSecTimestamps.txt: no such file"));
    std::fs::write(&stamps, &text).unwrap();

    let tar = copy.path().join("Test_Room/Camera_Left_Depth/lossless.tar");
    let whole = std::fs::read(&tar).unwrap();
    std::fs::write(&tar, &whole[..whole.len() / 2]).unwrap();
    let error = open(copy.path()).depth_image(CAMERA, 0).unwrap_err().to_string();
    assert!(error.contains("lossless.tar: byte") && error.contains("is cut off"), "{error}");
}

#[test]
fn blackbird_needs_ffmpeg_for_pixels_only() {
    let Some((oracle, flight)) = oracle_and_flight() else { return };
    let dataset = open_with(&flight, &[("ffmpeg", "/no/such/ffmpeg")]);
    let error = dataset.image(CAMERA, 0).unwrap_err().to_string();
    assert!(error.contains("is not installed") && error.contains("apt install ffmpeg"), "{error}");
    let truth = dataset.trajectory(GROUND_TRUTH).unwrap();
    let (off_px, _) = track(dataset.as_ref(), &truth, &oracle["vice"]["ground_truth/zcam"], false);
    assert!(off_px < 1e-3, "{off_px}");
}
