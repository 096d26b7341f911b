//! The synthetic flight against the method: exact poses give zero, flaws show, and the written folder is the flight.

use std::sync::OnceLock;

use nalgebra::Vector3;
use vice_core::camera::Camera;
use vice_core::dataset::{CloudSource, Dataset, DatasetFactory, OpenOptions, Probe};
use vice_core::depth::DepthSource;
use vice_core::evaluate::{DatasetRig, Evaluation, Selection, Stream, Window, evaluate};
use vice_core::label::LabelSet;
use vice_core::result::{PixelPart, Role};
use vice_core::time::Span;
use vice_depth::{CloudOptions, FloorDepth, ZMapDepth, ZMapOptions, load_cloud};
use vice_euroc::Euroc;
use vice_synthetic::{CAMERA, METRES_PER_COUNT, Synthetic, SyntheticOptions, write_euroc};

fn flight() -> &'static Synthetic {
    static FLIGHT: OnceLock<Synthetic> = OnceLock::new();
    FLIGHT.get_or_init(|| Synthetic::new(SyntheticOptions::default()).unwrap())
}

/// The estimates of a flight scored with one depth source, floor depth where `zmap` is not asked for.
fn score(synthetic: &Synthetic, camera: &Camera, labels: &LabelSet, zmap: bool) -> Vec<PixelPart> {
    let frames = synthetic.frames(CAMERA).unwrap();
    let selection = Selection::new(labels, &frames, camera, &Window::default()).unwrap();
    let reference = [("ground-truth", synthetic.truth().clone())];
    let streams: Vec<Stream> = reference
        .into_iter()
        .chain(synthetic.estimates().iter().cloned())
        .enumerate()
        .map(|(i, (name, trajectory))| {
            Stream::new(name, if i == 0 { Role::Reference } else { Role::Estimate }, trajectory)
        })
        .collect();
    let source: Box<dyn DepthSource> = if zmap {
        let scan = synthetic.cloud().unwrap().unwrap();
        let cloud = load_cloud(&scan, &CloudOptions::default()).unwrap();
        Box::new(ZMapDepth::new(cloud, scan.world_from_cloud, ZMapOptions::default()))
    } else {
        Box::new(FloorDepth::new())
    };
    let (rig, depths) = (DatasetRig::new(synthetic, CAMERA), [source.as_ref()]);
    let evaluation =
        Evaluation::builder(&rig, camera, &frames, &selection).streams(&streams).depths(&depths).build();
    evaluate(&evaluation, &|_, _| ()).unwrap().pixel
}

fn pooled_px(parts: &[PixelPart], stream: &str) -> f64 {
    let part = parts.iter().find(|p| p.stream == stream).unwrap();
    let skipped = part.skipped.len();
    assert!(skipped == 0, "{stream}: {skipped} skipped, first {:?}", part.skipped[0]);
    part.pooled_rmse_px.unwrap()
}

#[test]
fn exact_poses_score_nothing_and_every_flaw_shows() {
    let synthetic = flight();
    let camera = synthetic.camera(CAMERA).unwrap();
    let parts = score(synthetic, &camera, &synthetic.floor_labels().unwrap(), false);
    for (stream, low, high) in [
        ("ground-truth", 0.0, 1e-6),
        ("exact", 0.0, 1e-6),
        ("drift", 2.0, 30.0),
        ("clock-offset", 2.0, 30.0),
        ("wrong-extrinsic", 2.0, 60.0),
        ("white-noise", 0.3, 5.0),
    ] {
        let rmse = pooled_px(&parts, stream);
        assert!((low..high).contains(&rmse), "{stream}: {rmse} px");
    }
    let [fx, fy, cx, cy] = camera.fx_fy_cx_cy();
    let wrong = Camera::new(640, 480, [1.03 * fx, 1.03 * fy, cx, cy], *camera.model()).unwrap();
    let parts = score(synthetic, &wrong, &synthetic.floor_labels().unwrap(), false);
    assert!(pooled_px(&parts, "exact") > 1.0);
}

#[test]
fn exact_poses_with_a_scan_stay_below_half_a_pixel() {
    let synthetic = flight();
    let camera = synthetic.camera(CAMERA).unwrap();
    for labels in [synthetic.floor_labels().unwrap(), synthetic.scene_labels().unwrap()] {
        let rmse = pooled_px(&score(synthetic, &camera, &labels, true), "exact");
        assert!(rmse < 0.5, "{rmse} px");
    }
}

#[test]
fn the_written_folder_is_the_flight() {
    let options = SyntheticOptions {
        width: 320,
        height: 240,
        duration_s: 2.0,
        cloud_spacing_m: 0.1,
        ..SyntheticOptions::default()
    };
    let synthetic = Synthetic::new(options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("flight");
    write_euroc(&synthetic, &out, false, &|_, _| ()).unwrap();
    assert_eq!(Euroc.probe(&out), Probe::Yes);
    let read = Euroc.open(&out, &OpenOptions::default()).unwrap();

    assert_eq!(read.cameras(), [CAMERA]);
    assert_eq!(read.camera(CAMERA).unwrap(), synthetic.camera(CAMERA).unwrap());
    assert_eq!(read.frames(CAMERA).unwrap(), synthetic.frames(CAMERA).unwrap());
    let start = synthetic.options().start;
    let (a, b) =
        (read.body_from_camera(CAMERA, start).unwrap(), synthetic.body_from_camera(CAMERA, start).unwrap());
    let off = (a.isometry().to_homogeneous() - b.isometry().to_homogeneous()).abs().max();
    assert!(off < 1e-12, "{off}");

    let truth = read.trajectory("ground-truth").unwrap();
    assert_eq!(truth.stamps(), synthetic.truth().stamps());
    for (a, b) in truth.poses().iter().zip(synthetic.truth().poses()) {
        assert_eq!(a.translation(), b.translation());
        assert!(a.rotation().angle_to(&b.rotation()) < 1e-12);
    }
    let (imu, exact_imu) = (read.imu().unwrap(), synthetic.imu().unwrap());
    assert_eq!(imu.len(), exact_imu.len());
    for (a, b) in imu.iter().zip(exact_imu.iter()) {
        let close = |a: Vector3<f64>, b: Vector3<f64>| (a - b).norm() < 1e-9;
        assert!(a.stamp == b.stamp && close(a.gyro_rad_s, b.gyro_rad_s) && close(a.accel_m_s2, b.accel_m_s2));
    }
    let at = start + Span::from_millis(500);
    let (a, b) = (read.inertial_state(at).unwrap().unwrap(), synthetic.inertial_state(at).unwrap().unwrap());
    assert!((a.velocity_m_s - b.velocity_m_s).norm() < 1e-9);
    assert_eq!((a.gyro_bias_rad_s, a.accel_bias_m_s2), (b.gyro_bias_rad_s, b.accel_bias_m_s2));

    assert_eq!(read.image(CAMERA, 11).unwrap(), synthetic.image(CAMERA, 11).unwrap());
    assert!(read.has_depth(CAMERA));
    let (a, b) =
        (read.depth_image(CAMERA, 11).unwrap().unwrap(), synthetic.depth_image(CAMERA, 11).unwrap().unwrap());
    for (a, b) in a.z_m().iter().zip(b.z_m()) {
        assert!((f64::from(*a) - f64::from(*b)).abs() < 0.51 * METRES_PER_COUNT + 1e-6, "{a} {b}");
    }
    let scan = read.cloud().unwrap().unwrap();
    assert!(matches!(scan.source, CloudSource::File(_)));
    let cloud = load_cloud(&scan, &CloudOptions::default()).unwrap();
    assert_eq!(cloud.len(), synthetic.points().len());

    for (name, exact) in
        [("floor", synthetic.floor_labels().unwrap()), ("scene", synthetic.scene_labels().unwrap())]
    {
        let labels = vice_files::labels::read(out.join(format!("labels/{name}.csv")), None).unwrap();
        for (a, b) in labels.points().iter().zip(exact.points()) {
            assert_eq!((&a.name, a.observations.len()), (&b.name, b.observations.len()));
            for (a, b) in a.observations.iter().zip(&b.observations) {
                assert_eq!((a.stamp, a.px, a.keyframe), (b.stamp, b.px, b.keyframe));
            }
        }
    }
}
