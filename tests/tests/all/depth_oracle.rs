//! Depth at key frames against an independent implementation on a real flight.
//!
//! The data set is read by hand here, so that this test speaks of depth alone.

use std::fs::read_to_string;
use std::path::Path;
use std::sync::Arc;

use vice_core::camera::{Camera, Model, Pixel};
use vice_core::dataset::{Dataset, Floor, Plane};
use vice_core::depth::{DepthSource, Keyframe};
use vice_core::frames::{BodyFromCamera, Rigid};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::{PoseRow, Trajectory};
use vice_depth::{
    Cloud, CloudOptions, FloorDepth, FloorFitOptions, ZCamDepth, ZCamOptions, ZMapDepth, ZMapOptions,
    depth_image, fit_floor_to_cloud, load_cloud,
};
use vice_synthetic::{CAMERA, Synthetic, SyntheticOptions};

/// The numbers of `cam0/sensor.yaml`.
fn camera() -> (Camera, BodyFromCamera) {
    let model = Model::from_name("radtan", &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]).unwrap();
    let camera = Camera::new(752, 480, [458.654, 457.296, 367.215, 248.375], model).unwrap();
    let body_from_camera = BodyFromCamera::try_from_row_major(&[
        0.0148655429818,
        -0.999880929698,
        0.00414029679422,
        -0.0216401454975,
        0.999557249008,
        0.0149672133247,
        0.025715529948,
        -0.064676986768,
        -0.0257744366974,
        0.00375618835797,
        0.999660727178,
        0.00981073058949,
        0.0,
        0.0,
        0.0,
        1.0,
    ])
    .unwrap();
    (camera, body_from_camera)
}

fn ground_truth(mav0: &Path) -> Trajectory {
    let text = read_to_string(mav0.join("state_groundtruth_estimate0/data.csv")).unwrap();
    let rows = text.lines().filter(|l| !l.starts_with('#')).map(|line| {
        let mut columns = line.split(',');
        let stamp = Stamp::parse_nanos(columns.next().unwrap()).unwrap();
        let v: Vec<f64> = columns.map(|c| c.trim().parse().unwrap()).collect();
        PoseRow { stamp, position_m: [v[0], v[1], v[2]], rotation_wxyz: [v[3], v[4], v[5], v[6]] }
    });
    Trajectory::from_rows(rows).unwrap()
}

/// Largest difference to the oracle's depths of one case, and how many there are.
fn compare(source: &dyn DepthSource, mav0: &Path, oracle: &serde_json::Value) -> (f64, usize) {
    let (camera, body_from_camera) = camera();
    let trajectory = ground_truth(mav0);
    let (mut worst, mut count) = (0.0_f64, 0);
    for sample in oracle["samples"].as_array().unwrap() {
        let Some(expected) = sample["depth_z_m"].as_f64() else { continue };
        let stamp = Stamp::from_nanos(sample["timestamp_ns"].as_i64().unwrap());
        let world_from_body = trajectory.pose_at(stamp, Span::from_millis(100)).unwrap();
        let keyframe = Keyframe {
            stamp,
            frame: 0,
            camera: &camera,
            body_from_camera,
            world_from_camera: Some(world_from_body * body_from_camera),
            floor: Floor::World(Plane::z_zero()),
        };
        let px = Pixel::new(sample["label_px"][0].as_f64().unwrap(), sample["label_px"][1].as_f64().unwrap());
        let got = source.depths(&keyframe, &[px]).unwrap()[0].unwrap();
        worst = worst.max((got.z_m - expected).abs());
        count += 1;
    }
    (worst, count)
}

#[test]
fn floor_and_zmap_agree_with_opencv_and_scipy() {
    let Some(oracle) = vice_tests::shared_json("oracle/euroc_v1_01_vice.json") else { return };
    let Some(mav0) = vice_tests::shared("data/euroc_v1_01/mav0") else { return };
    let cloud = Cloud::read(mav0.join("pointcloud0/data.ply"), &CloudOptions::default()).unwrap();
    assert_eq!(cloud.len(), 454_816);
    let options = ZMapOptions { occlusion: false, ..ZMapOptions::default() };
    let zmap = ZMapDepth::new(cloud.into(), Rigid::identity(), options);

    let (worst, count) = compare(&FloorDepth::new(), &mav0, &oracle["labels_floor"]["ground_truth/floor"]);
    assert!(count == 8 && worst < 1e-9, "floor: {count} key points, worst {worst:e} m");
    for labels in ["labels_floor", "labels_board"] {
        let (worst, count) = compare(&zmap, &mav0, &oracle[labels]["ground_truth/zmap"]);
        assert!(count >= 4 && worst < 1e-5, "{labels}: {count} key points, worst {worst:e} m");
    }
}

/// A key frame of the rendered flight.
fn rendered<'a>(flight: &Synthetic, camera: &'a Camera, frame: usize) -> Keyframe<'a> {
    let stamp = flight.frames(CAMERA).unwrap()[frame];
    Keyframe {
        stamp,
        frame,
        camera,
        body_from_camera: flight.body_from_camera(CAMERA, stamp).unwrap(),
        world_from_camera: Some(flight.world_from_camera(frame)),
        floor: flight.floor(stamp).unwrap(),
    }
}

/// Parts of the pixels of some frames that a source answers, and of these within 2 cm of the exact depth.
fn shares(flight: &Synthetic, source: &dyn DepthSource, frames: &[usize]) -> (f64, f64) {
    let camera = flight.camera(CAMERA).unwrap();
    let (mut asked, mut answered, mut good) = (0, 0, 0);
    for frame in frames {
        let keyframe = rendered(flight, &camera, *frame);
        let exact = flight.depth_image(CAMERA, *frame).unwrap().unwrap();
        let map = depth_image(source, &keyframe).unwrap();
        for (got, exact) in map.pixels().iter().zip(exact.z_m()) {
            asked += 1;
            let Ok(got) = got else { continue };
            answered += 1;
            good += usize::from((got.z_m - f64::from(*exact)).abs() < 0.02);
        }
    }
    (f64::from(answered) / f64::from(asked), good as f64 / f64::from(answered))
}

#[test]
fn depth_on_the_rendered_flight_is_exact_where_it_is_given() {
    let flight = Arc::new(Synthetic::new(SyntheticOptions::default()).unwrap());
    let frames = [0, 40, 90, 140, 199];
    let cloud = flight.cloud().unwrap().unwrap();
    let scan = load_cloud(&cloud, &CloudOptions::default()).unwrap();
    let zmap = |occlusion| {
        let options = ZMapOptions { occlusion, ..ZMapOptions::default() };
        ZMapDepth::new(Arc::clone(&scan), cloud.world_from_cloud, options)
    };
    let (answered, good) = shares(&flight, &zmap(true), &frames);
    eprintln!("occlusion on: {answered:.4} answered, {good:.4} of these within 2 cm");
    assert!(answered >= 0.9 && good >= 0.99);
    let (answered, good) = shares(&flight, &zmap(false), &frames);
    eprintln!("occlusion off: {answered:.4} answered, {good:.4} of these within 2 cm");
    assert!(answered >= 0.9 && good < 0.95);

    let zcam = ZCamDepth::new(flight.clone(), CAMERA, ZCamOptions::default()).unwrap();
    let (answered, good) = shares(&flight, &zcam, &frames);
    assert!(answered == 1.0 && good == 1.0, "z-camera: {answered} answered, {good} of these within 2 cm");

    // The floor is where the exact depth and the floor's own agree; a box or wall in front of it is nearer.
    let camera = flight.camera(CAMERA).unwrap();
    let keyframe = rendered(&flight, &camera, 0);
    let floor = depth_image(&FloorDepth::new(), &keyframe).unwrap();
    let exact = flight.depth_image(CAMERA, 0).unwrap().unwrap();
    let off = floor.pixels().iter().zip(exact.z_m()).filter_map(|(f, e)| Some(f.ok()?.z_m - f64::from(*e)));
    let off: Vec<f64> = off.collect();
    let on_floor = off.iter().filter(|d| d.abs() < 1e-5).count();
    assert!(off.iter().all(|d| *d > -1e-5) && on_floor * 4 > off.len(), "{on_floor} of {}", off.len());

    let up = nalgebra::Vector3::z_axis();
    let fit = fit_floor_to_cloud(&scan, &cloud.world_from_cloud, up, &FloorFitOptions::default()).unwrap();
    assert!(fit.plane.normal().z > 1.0 - 1e-6 && fit.plane.d_m().abs() < 1e-3, "{fit:?}");
}
