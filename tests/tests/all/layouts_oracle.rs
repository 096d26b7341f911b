//! Folders in the layouts of public data sets against figures that NumPy, pycolmap and pykitti worked out by the data
//! sets' own formulas (tests/oracles/layouts.py).

use serde_json::Value;
use vice_core::camera::Pixel;
use vice_core::dataset::{CloudSource, Dataset, DatasetFactory, OpenOptions, Probe};
use vice_core::nalgebra::{Point3, Vector3};
use vice_core::time::Span;
use vice_host::conformance::{Event, Subject, Thoroughness, Verdict, check};
use vice_images::Images;
use vice_tests::layouts::{recordings, write};

fn opened(recording: &Value, below: &std::path::Path) -> Box<dyn Dataset> {
    let folder = write(recording, below);
    assert_eq!(Images.probe(&folder), Probe::Yes, "{}", folder.display());
    Images.open(&folder, &OpenOptions::default()).unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
}

fn pixel(value: &Value) -> Pixel {
    Pixel::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_iterator(value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()))
}

/// Where a point that one frame sees at a depth lies in a later frame: the convention of a pose, an extrinsic or a lens that
/// is read wrongly moves it by many pixels.
#[test]
fn points_are_seen_where_the_data_sets_say() {
    for recording in recordings() {
        let name = recording["folder"].as_str().unwrap();
        let below = tempfile::tempdir().unwrap();
        let dataset = opened(&recording, below.path());
        let facts = dataset.facts();
        assert_eq!(facts[0].text, recording["layout"].as_str().unwrap(), "{name}");
        let stream = recording["stream"].as_str().unwrap();
        assert!(dataset.streams().iter().any(|s| s == stream), "{name}: {:?}", dataset.streams());
        let trajectory = dataset.trajectory(stream).unwrap_or_else(|e| panic!("{name}: {e}"));
        let stamps: Vec<i64> =
            recording["stamps_ns"].as_array().unwrap().iter().map(|s| s.as_i64().unwrap()).collect();
        for camera in dataset.cameras() {
            let frames = dataset.frames(&camera).unwrap();
            let off = frames.iter().zip(&stamps).map(|(s, expected)| (s.as_nanos() - expected).abs()).max();
            assert!(frames.len() == stamps.len() && off < Some(1000), "{name} {camera}: {off:?}");
        }
        let seen = recording["seen"].as_array().unwrap();
        assert!(seen.len() >= 20, "{name}");
        for row in seen {
            let camera_name = row["camera"].as_str().unwrap();
            let camera = dataset.camera(camera_name).unwrap_or_else(|e| panic!("{name}: {e}"));
            let frames = dataset.frames(camera_name).unwrap();
            let at = |index: usize| {
                let body = trajectory.pose_at(frames[index], Span::from_millis(50)).unwrap();
                body * dataset.body_from_camera(camera_name, frames[index]).unwrap()
            };
            let ray = camera.unproject(pixel(&row["from_px"])).unwrap();
            let point = Point3::from(ray / ray.z * row["z_m"].as_f64().unwrap());
            let frame = row["frame"].as_u64().unwrap() as usize;
            let there = at(frame).inverse().transform_point(&at(0).transform_point(&point));
            let found = camera.project(&there).unwrap();
            let off = found.distance_px(pixel(&row["to_px"]));
            // Poses are written with 12 digits.
            assert!(off < 1e-6, "{name} {camera_name} frame {frame}: {off} px");
        }
        if recording["up_in_first_camera"].is_array() {
            let camera = &dataset.cameras()[0];
            let stamp = dataset.frames(camera).unwrap()[0];
            let world_from_camera = trajectory.pose_at(stamp, Span::from_millis(50)).unwrap()
                * dataset.body_from_camera(camera, stamp).unwrap();
            let up = world_from_camera.rotate(&vector(&recording["up_in_first_camera"]));
            assert!((up - Vector3::z()).norm() < 1e-9, "{name}: up is {up:?}");
        }
    }
}

#[test]
fn depth_imu_and_clouds_have_the_units_of_the_data_sets() {
    for recording in recordings() {
        let name = recording["folder"].as_str().unwrap();
        let below = tempfile::tempdir().unwrap();
        let dataset = opened(&recording, below.path());
        let camera = dataset.cameras()[0].clone();
        let depth = recording["depth_m"].as_f64();
        assert_eq!(dataset.has_depth(&camera), depth.is_some(), "{name}");
        if let Some(metres) = depth {
            let image = dataset.depth_image(&camera, 2).unwrap().unwrap();
            assert!((f64::from(image.get(5, 5).unwrap()) - metres).abs() < 1e-6, "{name}");
            assert_eq!(image.get(0, 0), None, "{name}: no depth");
            let other = recording["invalid_depth_count"].is_u64();
            assert_eq!(image.get(1, 0).is_none(), other, "{name}: the count that is no depth");
        }
        let imu = dataset.imu().unwrap();
        match recording["imu"].as_object() {
            None => assert!(imu.is_empty(), "{name}"),
            Some(expected) => {
                assert_eq!(imu.len() as u64, expected["count"].as_u64().unwrap(), "{name}");
                assert!((imu[0].gyro_rad_s - vector(&expected["gyro_rad_s"])).norm() < 1e-12, "{name}");
                assert!((imu[0].accel_m_s2 - vector(&expected["accel_m_s2"])).norm() < 1e-12, "{name}");
            }
        }
        if let Some(expected) = recording["cloud_m"].as_array() {
            let cloud = dataset.cloud().unwrap().unwrap();
            let CloudSource::Points(points) = &cloud.source else { panic!("{name}: points are expected") };
            let mut found: Vec<Point3<f64>> =
                points.iter().map(|p| cloud.world_from_cloud.transform_point(&p.cast())).collect();
            found.sort_by(|a, b| a.x.total_cmp(&b.x));
            let mut expected: Vec<Vector3<f64>> = expected.iter().map(vector).collect();
            expected.sort_by(|a, b| a.x.total_cmp(&b.x));
            assert_eq!(found.len(), expected.len(), "{name}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found.coords - expected).norm() < 0.1, "{name}: {found} {expected}");
            }
        }
    }
}

#[test]
fn every_layout_conforms() {
    for recording in recordings().iter().take(9) {
        let below = tempfile::tempdir().unwrap();
        let path = write(recording, below.path());
        let options = OpenOptions::default();
        let subject = Subject { factory: &Images, plugin: None, path: &path, options: &options };
        let thorough = Thoroughness { cycles: 5, images: 3, threads: 3, ..Thoroughness::default() };
        let mut said = Vec::new();
        let good = check(&subject, &thorough, &mut |event| {
            if let Event::Finding(verdict @ (Verdict::Fault | Verdict::Suspicious), text) = event {
                said.push((verdict, text));
            }
        });
        assert!(good && said.is_empty(), "{}: {said:#?}", path.display());
    }
}

/// Five real frames in TUM's layout, read as they lie, against NumPy's projection of OpenCV's labels.
#[test]
fn real_frames_in_the_layout_of_tum_give_the_oracles_number() {
    let (Some(run), Some(oracle)) =
        (vice_tests::shared("data/tum_rgbd5"), vice_tests::shared_json("oracle/tum_rgbd5_vice.json"))
    else {
        return;
    };
    let (run, labels) = (run.to_str().unwrap().to_string(), run.join("labels.csv"));
    let labels = labels.to_str().unwrap();
    let said = vice_tests::vice(&[
        "evaluate",
        &run,
        "--labels",
        labels,
        "--depth",
        "zcam",
        "--subsets",
        "1,2,3,4",
        "--json",
        "-",
    ]);
    assert_eq!(said.code, 0, "{}", said.stderr);
    let document: Value = serde_json::from_str(&said.stdout).unwrap();
    for points in ["1", "2", "3", "4"] {
        let found = document["pixel"][0]["rmse_px"][points]["mean"].as_f64();
        let found = found.or(document["pixel"][0]["rmse_px"][points]["mean_px"].as_f64()).unwrap();
        let expected = oracle["rmse_2d"][points]["mean_px"].as_f64().unwrap();
        assert!((found - expected).abs() < 1e-4, "{points}: {found}, the oracle has {expected}");
    }
}
