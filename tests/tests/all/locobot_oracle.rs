//! The recordings of a LoCoBot in all their containers against an independent tool: poses, extrinsics, tracked pixels.

use nalgebra::{Isometry3, Matrix4, Point3, Quaternion, UnitQuaternion, Vector3};
use serde_json::Value;
use std::collections::BTreeMap;
use vice_core::camera::Pixel;
use vice_core::dataset::{Dataset, DatasetFactory, Floor, OpenOptions, Probe};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_locobot::Locobot;

const FULL: [&str; 5] = [
    "locobot_ros1.bag",
    "locobot_ros1_compressed.bag",
    "locobot_ros2_mcap",
    "locobot_ros2_mcap/locobot_ros2.mcap",
    "locobot_ros2_db3",
];
const THREE_FRAMES: &str = "locobot_raw3.bag";

fn open(name: &str) -> Option<Box<dyn Dataset>> {
    let path = vice_tests::shared(&format!("data/locobot/{name}"))?;
    assert_eq!(Locobot.probe(&path), Probe::Yes, "{name}");
    Some(Locobot.open(&path, &OpenOptions::default()).unwrap_or_else(|e| panic!("{name}: {e}")))
}

fn stamp(value: &Value) -> Stamp {
    Stamp::from_nanos(value.as_i64().unwrap())
}

fn matrix(value: &Value) -> Matrix4<f64> {
    Matrix4::from_fn(|row, col| value[row][col].as_f64().unwrap())
}

fn pixel(value: &Value) -> Pixel {
    Pixel::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

/// The method page's z-camera depth where all four neighbours are valid, as they are here at every key frame.
fn zcam_m(data: &dyn Dataset, frame: usize, px: Pixel) -> f64 {
    let depth = data.depth_image("color", frame).unwrap().unwrap();
    let (u0, v0) = (px.u.floor(), px.v.floor());
    let (a, b) = (px.u - u0, px.v - v0);
    let z = |du: f64, dv: f64| f64::from(depth.get((u0 + du) as u32, (v0 + dv) as u32).unwrap());
    (1.0 - b) * ((1.0 - a) * z(0.0, 0.0) + a * z(1.0, 0.0)) + b * ((1.0 - a) * z(0.0, 1.0) + a * z(1.0, 1.0))
}

/// Where the ray of a pixel meets the floor, as depth along the optical axis.
fn floor_m(data: &dyn Dataset, at: Stamp, px: Pixel) -> f64 {
    let Floor::Body(plane) = data.floor(at).unwrap() else { panic!("a ground robot knows its floor") };
    let body_from_camera = data.body_from_camera("color", at).unwrap();
    let ray = body_from_camera.rotate(&data.camera("color").unwrap().unproject(px).unwrap());
    -(plane.d_m() + plane.normal().dot(&body_from_camera.translation())) / plane.normal().dot(&ray)
}

/// Equation 1 for all samples of an oracle entry: tracked pixels and their squared errors against the labels.
fn track(data: &dyn Dataset, entry: &Value, poses: &Trajectory, zcam: bool) -> Vec<(Pixel, f64)> {
    let camera = data.camera("color").unwrap();
    let frames = data.frames("color").unwrap();
    let world_from_camera = |at: Stamp| {
        let pose = poses.pose_at(at, Span::from_millis(100)).unwrap();
        pose * data.body_from_camera("color", at).unwrap()
    };
    let mut anchored: BTreeMap<i64, Point3<f64>> = BTreeMap::new();
    let mut tracked = Vec::new();
    for sample in entry["samples"].as_array().unwrap() {
        let (point, at) = (sample["point"].as_i64().unwrap(), stamp(&sample["timestamp_ns"]));
        let label = pixel(&sample["label_px"]);
        let Ok(frame) = frames.binary_search(&at) else { continue };
        if sample["keyframe"].as_bool().unwrap() {
            let z_m = if zcam { zcam_m(data, frame, label) } else { floor_m(data, at, label) };
            let expected = sample["depth_z_m"].as_f64().unwrap();
            assert!((z_m - expected).abs() < 1e-6, "depth of {point} at {at}: {z_m}, not {expected}");
            let ray: Vector3<f64> = camera.unproject(label).unwrap();
            anchored.insert(point, world_from_camera(at).transform_point(&Point3::from(ray * z_m)));
        } else if let Some(world) = anchored.get(&point) {
            let px = camera.project(&world_from_camera(at).inverse().transform_point(world)).unwrap();
            let expected = pixel(&sample["tracked_px"]);
            let off = px.distance_px(expected);
            assert!(off < 1e-3, "{point} at {at}: {px:?}, not {expected:?}: {off} px off");
            tracked.push((px, px.distance_px(label).powi(2)));
        }
    }
    tracked
}

#[test]
fn every_container_gives_the_oracles_pixels_and_the_same_bits() {
    let Some(oracle) = vice_tests::shared_json("oracle/locobot.json") else { return };
    let mut first: BTreeMap<String, Vec<(Pixel, f64)>> = BTreeMap::new();
    for name in FULL {
        let Some(data) = open(name) else { return };
        for (entry, pooled_px) in
            [("odom/zcam", 11.466), ("slam/zcam", 2.913), ("odom/floor", 12.373), ("slam/floor", 2.919)]
        {
            let (stream, depth) = entry.split_once('/').unwrap();
            let poses = data.trajectory(stream).unwrap();
            let expected = &oracle["vice"][entry];
            let tracked = track(data.as_ref(), expected, &poses, depth == "zcam");
            assert_eq!(tracked.len() as u64, expected["samples_counted"].as_u64().unwrap(), "{name} {entry}");
            let rmse_px = (tracked.iter().map(|t| t.1).sum::<f64>() / tracked.len() as f64).sqrt();
            assert!(
                (rmse_px - expected["rmse_2d_px"].as_f64().unwrap()).abs() < 1e-4,
                "{name} {entry}: {rmse_px}"
            );
            assert!((rmse_px - pooled_px).abs() < 6e-4, "{name} {entry}: {rmse_px}");
            let before = first.entry(entry.to_string()).or_insert_with(|| tracked.clone());
            assert_eq!(&tracked, before, "{name} {entry} differs from {}", FULL[0]);
        }
    }
}

#[test]
fn poses_and_extrinsics_are_those_of_the_oracle() {
    let Some(oracle) = vice_tests::shared_json("oracle/locobot.json") else { return };
    for name in FULL {
        let Some(data) = open(name) else { return };
        assert_eq!(data.cameras(), ["color"]);
        assert_eq!(data.streams(), ["odom", "slam", "/odom"]);
        let camera = data.camera("color").unwrap();
        assert_eq!((camera.width(), camera.height()), (640, 480));
        assert_eq!(camera.fx_fy_cx_cy(), [619.9, 620.11, 320.65, 241.11]);
        let (odom, slam) = (data.trajectory("odom").unwrap(), data.trajectory("slam").unwrap());
        let frames = data.frames("color").unwrap();
        let expected = oracle["frames"].as_array().unwrap();
        assert_eq!(frames.len(), expected.len());
        for (at, frame) in frames.iter().zip(expected) {
            assert_eq!(*at, stamp(&frame["header_stamp_ns"]));
            let body_from_camera = data.body_from_camera("color", *at).unwrap();
            let off =
                body_from_camera.isometry().to_homogeneous() - matrix(&frame["T_base_footprint_camera"]);
            assert!(off.abs().max() < 1e-9, "{name}: extrinsics at {at} are {:e} off", off.abs().max());
            for (poses, key) in [(&odom, "odom"), (&slam, "slam")] {
                let pose = poses.pose_at(*at, Span::ZERO).unwrap();
                let list = |k: &str, i: usize| frame[key][k][i].as_f64().unwrap();
                let position = Vector3::from_fn(|i, _| list("position_m", i));
                let [x, y, z, w] = std::array::from_fn(|i| list("quat_xyzw", i));
                let rotation = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
                let off = pose.isometry().to_homogeneous()
                    - Isometry3::from_parts(position.into(), rotation).to_homogeneous();
                assert!(off.abs().max() < 1e-9, "{name}: {key} at {at} is {:e} off", off.abs().max());
            }
        }
    }
}

#[test]
fn images_are_the_same_in_all_containers() {
    let Some(bag) = open(FULL[0]) else { return };
    let mut others: Vec<Box<dyn Dataset>> = FULL[1..].iter().map(|name| open(name).unwrap()).collect();
    others.push(open(THREE_FRAMES).unwrap());
    for other in &others {
        let frames = bag.frames("color").unwrap();
        let theirs = other.frames("color").unwrap();
        assert!(theirs.len() == 30 || theirs.len() == 3);
        for (index, at) in theirs.iter().enumerate() {
            let mine = frames.binary_search(at).unwrap();
            let (a, b) = (bag.image("color", mine).unwrap(), other.image("color", index).unwrap());
            let lossy =
                other.facts().iter().any(|f| f.text.contains("color_topic") && f.text.contains("jpeg"));
            let off = a.data().iter().zip(b.data()).map(|(a, b)| a.abs_diff(*b) as u64).sum::<u64>();
            let mean = off as f64 / a.data().len() as f64;
            assert!(
                if lossy { mean < 4.0 } else { off == 0 },
                "{}: frame {index} is {mean} off",
                other.name()
            );
            let (a, b) =
                (bag.depth_image("color", mine).unwrap(), other.depth_image("color", index).unwrap());
            let bits = |d: vice_core::dataset::DepthImage| {
                (d.stamp, d.z_m().iter().map(|z| z.to_bits()).collect::<Vec<_>>())
            };
            assert!(a.is_some() && a.map(bits) == b.map(bits), "{}: depth {index} differs", other.name());
        }
    }
}

#[test]
fn three_frames_agree_where_there_are_any() {
    let (Some(three), Some(full)) = (open(THREE_FRAMES), open(FULL[0])) else { return };
    let all = full.frames("color").unwrap();
    assert_eq!(&three.frames("color").unwrap()[..], &[all[0], all[7], all[14]]);
    for at in three.frames("color").unwrap().iter() {
        assert_eq!(
            three.body_from_camera("color", *at).unwrap(),
            full.body_from_camera("color", *at).unwrap()
        );
        for stream in ["odom", "slam"] {
            let at_frame =
                |data: &dyn Dataset| data.trajectory(stream).unwrap().pose_at(*at, Span::ZERO).unwrap();
            assert_eq!(at_frame(three.as_ref()), at_frame(full.as_ref()), "{stream} at {at}");
        }
    }
}

#[test]
fn a_motion_capture_file_is_the_ground_truth() {
    let Some(path) = vice_tests::shared("data/locobot/locobot_ros1.bag") else { return };
    let Some(oracle) = vice_tests::shared_json("oracle/locobot.json") else { return };
    let settings = [("ground_truth".to_string(), "truth_base_footprint.txt".to_string())].into();
    let data = Locobot.open(&path, &OpenOptions { settings }).unwrap();
    assert_eq!(data.streams()[0], "ground-truth");
    let truth = data.trajectory("ground-truth").unwrap();
    for frame in oracle["frames"].as_array().unwrap() {
        let pose = truth.pose_at(stamp(&frame["header_stamp_ns"]), Span::ZERO).unwrap();
        let off = pose.isometry().to_homogeneous() - matrix(&frame["T_W_base_footprint"]);
        assert!(off.abs().max() < 1e-6, "{:e}", off.abs().max());
    }
}

#[test]
fn compressed_images_are_given_as_they_are_stored() {
    let Some(folder) = vice_tests::shared("data/locobot") else { return };
    for (name, stored) in [("locobot_ros1_compressed.bag", true), ("locobot_ros1.bag", false)] {
        let run = Locobot.open(&folder.join(name), &OpenOptions::default()).unwrap();
        let camera = run.cameras().remove(0);
        for index in [0, 3] {
            let file = run.image_file(&camera, index).unwrap();
            assert_eq!(file.is_some(), stored, "{name}");
            let Some(file) = file else { continue };
            let image = vice_files::image_file::decode(&file).unwrap();
            assert_eq!(image.data(), run.image(&camera, index).unwrap().data());
        }
        assert!(run.image_file(&camera, 1_000_000).is_err(), "{name}");
    }
}

#[test]
fn a_folder_of_recordings_is_a_collection() {
    let Some(folder) = vice_tests::shared("data/locobot") else { return };
    let Probe::Collection(paths) = Locobot.probe(&folder) else { panic!("five recordings") };
    let names: Vec<_> = paths.iter().map(|p| p.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(
        names,
        [
            "locobot_raw3.bag",
            "locobot_ros1.bag",
            "locobot_ros1_compressed.bag",
            "locobot_ros2_db3",
            "locobot_ros2_mcap"
        ]
    );
    let Some(euroc) = vice_tests::shared("data/euroc_v1_01") else { return };
    assert_eq!(Locobot.probe(&euroc), Probe::No);
}
