use std::fs;

use vice_core::dataset::{GROUND_TRUTH, Image, PixelFormat};
use vice_core::frames::rotation_angle_rad;
use vice_core::time::Stamp;
use vice_files::image_file::{encode_depth_png, encode_png};

use super::*;

const IDENTITY: &str = "[1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]";
/// Rz(90°): the sensor's x is the body's y.
pub(super) const TURNED: &str = "[0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]";
pub(super) const T0: i64 = 1_403_715_273_000_000_000;

/// A small sequence on disk: three frames 50 ms apart.
pub(super) struct Sequence(pub(super) tempfile::TempDir);

impl Sequence {
    pub(super) fn new() -> Self {
        let sequence = Self(tempfile::tempdir().unwrap());
        sequence.write(
            "mav0/cam0/sensor.yaml",
            &format!(
                "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: {IDENTITY}\nresolution: [4, 2]\n\
                 camera_model: pinhole\nintrinsics: [3, 3, 1.5, 0.5]\ndistortion_model: radial-tangential\n\
                 distortion_coefficients: [-0.1, 0.01, 0, 0]\n"
            ),
        );
        let rows = (0..3).map(|i| format!("{0},{0}.png\r\n", T0 + i * 50_000_000)).collect::<String>();
        sequence.write("mav0/cam0/data.csv", &format!("#timestamp [ns],filename\r\n{rows}"));
        for i in 0..3_u8 {
            let image = Image::new(4, 2, PixelFormat::Gray8, vec![i; 8]).unwrap();
            let name = format!("mav0/cam0/data/{}.png", T0 + i64::from(i) * 50_000_000);
            sequence.write_bytes(&name, &encode_png(&image).unwrap());
        }
        sequence
    }

    pub(super) fn write(&self, name: &str, text: &str) {
        self.write_bytes(name, text.as_bytes());
    }

    pub(super) fn write_bytes(&self, name: &str, bytes: &[u8]) {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    pub(super) fn open(&self) -> DataResult<Box<dyn Dataset>> {
        Euroc.open(self.0.path(), &OpenOptions::default())
    }

    pub(super) fn dataset(&self) -> Box<dyn Dataset> {
        self.open().unwrap()
    }
}

pub(super) fn problem<T>(result: DataResult<T>) -> String {
    result.err().expect("an error").to_string()
}

#[test]
fn a_bare_sequence_opens() {
    let sequence = Sequence::new();
    let dataset = sequence.dataset();
    assert_eq!((dataset.cameras(), dataset.streams()), (vec!["cam0".to_string()], vec![]));
    assert_eq!(dataset.frames("cam0").unwrap().len(), 3);
    assert_eq!(dataset.image("cam0", 2).unwrap().data(), [2; 8]);
    assert_eq!(dataset.camera("cam0").unwrap().model().name(), "radtan");
    assert!(dataset.imu().unwrap().is_empty());
    assert!(dataset.cloud().unwrap().is_none());
    assert!(dataset.inertial_state(Stamp::from_nanos(T0)).unwrap().is_none());
    assert!(dataset.depth_image("cam0", 0).unwrap().is_none() && !dataset.has_depth("cam0"));
    assert!(problem(dataset.trajectory(GROUND_TRUTH)).contains("known: none"));
    assert!(problem(dataset.image("cam0", 3)).contains("frame 3 does not exist: there are 3"));
    assert!(problem(dataset.frames("cam1")).contains("known: cam0"));
}

#[test]
fn probing_looks_at_names_only() {
    let sequence = Sequence::new();
    let root = sequence.0.path();
    assert_eq!(Euroc.probe(root), Probe::Yes);
    assert_eq!(Euroc.probe(&root.join("mav0")), Probe::Yes);
    assert_eq!(Euroc.probe(&root.join("mav0/cam0")), Probe::No);
    assert_eq!(Euroc.probe(&root.join("mav0/cam0/data.csv")), Probe::No);
    assert_eq!(Euroc.probe(&root.join("missing")), Probe::No);
    let name = root.file_name().unwrap().to_str().unwrap();
    for path in [root.to_path_buf(), root.join("mav0"), root.join("mav0/../mav0")] {
        assert_eq!(Euroc.open(&path, &OpenOptions::default()).unwrap().name(), name);
    }
    let collection = tempfile::tempdir().unwrap();
    let (a, b) = (collection.path().join("a"), collection.path().join("b"));
    fs::create_dir_all(a.join("mav0")).unwrap();
    fs::create_dir_all(b.join("mav0")).unwrap();
    assert_eq!(Euroc.probe(collection.path()), Probe::Collection(vec![a.clone(), b]));
    assert!(problem(Euroc.open(&a, &OpenOptions::default())).contains("has no camera"));
    assert!(problem(Euroc.open(collection.path(), &OpenOptions::default())).contains("no EuRoC sequence"));
}

#[test]
fn a_bad_list_names_its_line() {
    let sequence = Sequence::new();
    let says = |rows: &str, expected: &str| {
        sequence.write("mav0/cam0/data.csv", rows);
        let error = problem(sequence.dataset().frames("cam0"));
        assert!(error.contains(expected), "{error}");
    };
    says("1,a.png\n1,b.png\n", "data.csv:2: stamp 1 ns appears twice");
    says("#h\n2,a.png\n1,b.png\n", "data.csv:3: stamp 1 ns is earlier");
    says("1,/etc/passwd\n", "data.csv:1: the file name `/etc/passwd` is absolute");
    says("1,a.png\n2,../../x.png\n", "data.csv:2: the file name `../../x.png` climbs out");
    says("1,C:\\x.png\n", "absolute");
    says("1,\n", "expected 2 columns, found 1");
    says("1, ,\n", "data.csv:1: the file name is empty");
    says("1\n", "expected 2 columns");
    says("x,a.png\n", "data.csv:1: column 1: `x` is no time stamp");
    says("", "data.csv: the list holds no frames");
    says("#timestamp\n", "the list holds no frames");
    fs::remove_file(sequence.0.path().join("mav0/cam0/data.csv")).unwrap();
    assert!(problem(sequence.dataset().frames("cam0")).contains("data.csv: no such file"));
}

#[cfg(unix)]
#[test]
fn an_image_that_leaves_through_a_link_is_refused_when_it_is_listed() {
    let sequence = Sequence::new();
    let root = sequence.0.path();
    sequence.write("secret.png", "");
    let data = root.join("mav0/cam0/data");
    std::os::unix::fs::symlink(root.join("secret.png"), data.join("link.png")).unwrap();
    std::os::unix::fs::symlink(root, data.join("up")).unwrap();
    std::os::unix::fs::symlink(format!("{T0}.png"), data.join("inside.png")).unwrap();
    for name in ["link.png", "up/secret.png"] {
        sequence.write("mav0/cam0/data.csv", &format!("1,inside.png\n2,{name}\n"));
        let error = problem(sequence.dataset().frames("cam0"));
        assert!(
            error.contains("data.csv:2: ") && error.contains("leaves its folder through a link"),
            "{error}"
        );
    }
    sequence.write("mav0/cam0/data.csv", "1,inside.png\n");
    assert_eq!(sequence.dataset().image("cam0", 0).unwrap().data(), [0; 8]);
}

#[test]
fn a_bad_calibration_is_named() {
    let sequence = Sequence::new();
    let says = |text: &str, expected: &str| {
        sequence.write("mav0/cam0/sensor.yaml", text);
        let error = problem(sequence.dataset().camera("cam0"));
        assert!(error.contains(expected) && error.contains("sensor.yaml"), "{error}");
    };
    let good = format!("T_BS: {{rows: 4, cols: 4, data: {IDENTITY}}}\nresolution: [4, 2]\n");
    says(&format!("{good}intrinsics: [-3, 3, 1, 1]\n"), "focal length fx = -3");
    says(&format!("{good}intrinsics: [3, 3, 1]\n"), "is not the YAML expected");
    says(&format!("{good}intrinsics: [3, 3, 1, 1]\ncamera_model: mirror\n"), "unknown camera_model `mirror`");
    says(
        &format!("{good}intrinsics: [3, 3, 1, 1]\ncamera_model: omni\n"),
        "xi, fx, fy, cx, cy: 5 numbers, not 4",
    );
    says(
        &format!("{good}intrinsics: [3, 3, 1, 1]\ndistortion_model: mirror\n"),
        "unknown camera model `mirror`",
    );
    says(
        &format!("{good}intrinsics: [3, 3, 1, 1]\ndistortion_model: radtan\ndistortion_coefficients: [1]\n"),
        "takes 4 or 5",
    );
    says("resolution: [4, 2]\nintrinsics: [3, 3, 1, 1]\n", "`T_BS` is missing");
    says("intrinsics: [3, 3, 1, 1]\n", "`resolution` is missing");
    says("resolution: [4, 2]\nintrinsics: [3, 3, 1, 1]\nT_BS: {data: [1, 2]}\n", "T_BS has 2 numbers");
    says("", "the file is empty");
    // Other models by their names.
    sequence.write(
        "mav0/cam0/sensor.yaml",
        &format!("{good}intrinsics: [3, 3, 1, 1]\ndistortion_model: equidistant\ndistortion_coefficients: [0, 0, 0, 0]\n"),
    );
    assert_eq!(sequence.dataset().camera("cam0").unwrap().model().name(), "equidistant");
}

#[test]
fn the_ground_truth_has_velocities_and_biases() {
    let sequence = Sequence::new();
    let (t1, t2) = (T0 + 100_000_000, T0 + 500_000_000);
    let rows = format!(
        "{T0},0,0,0,1,0,0,0,1,0,0,0.1,0,0,0.2,0,0\n{t1},1,0,0,1,0,0,0,3,0,0,0.3,0,0,0.4,0,0\n{t2},1,0,0,1,0,0,0,9,9,9,9,9,9,9,9,9\n"
    );
    sequence.write("mav0/state_groundtruth_estimate0/data.csv", &rows);
    let dataset = sequence.dataset();
    assert_eq!(dataset.streams(), [GROUND_TRUTH]);
    let at = |nanos| dataset.inertial_state(Stamp::from_nanos(nanos)).unwrap();
    let row = at(T0).unwrap();
    assert_eq!((row.velocity_m_s.x, row.gyro_bias_rad_s.x, row.accel_bias_m_s2.x), (1.0, 0.1, 0.2));
    let middle = at(T0 + 50_000_000).unwrap();
    assert!((middle.velocity_m_s.x - 2.0).abs() < 1e-12 && (middle.gyro_bias_rad_s.x - 0.2).abs() < 1e-12);
    assert!((middle.world_from_body.translation().x - 0.5).abs() < 1e-12);
    assert!(at(t2).unwrap().velocity_m_s.x == 9.0);
    assert!(at(t1 + 1).is_none(), "0.4 s wide");
    assert!(at(T0 - 1).is_none() && at(t2 + 1).is_none());

    sequence.write("mav0/state_groundtruth_estimate0/data.csv", "");
    assert!(problem(sequence.dataset().trajectory(GROUND_TRUTH)).contains("data.csv: the file is empty"));
    sequence
        .write("mav0/state_groundtruth_estimate0/data.csv", &rows.replace(&T0.to_string(), &t1.to_string()));
    let dataset = sequence.dataset();
    assert_eq!(dataset.trajectory(GROUND_TRUTH).unwrap().len(), 2);
    assert_eq!(dataset.suspicions()[0].code, "duplicate-stamps");
}

#[test]
fn vicon_poses_are_moved_to_the_body() {
    let sequence = Sequence::new();
    fs::create_dir_all(sequence.0.path().join("mav0/leica0")).unwrap();
    sequence.write("mav0/vicon0/data.csv", &format!("#t\n{T0},1,0,0,1,0,0,0\n"));
    sequence.write("mav0/vicon0/sensor.yaml", "T_BS: [[1,0,0,0.25],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n");
    let dataset = sequence.dataset();
    let truth = dataset.trajectory(GROUND_TRUTH).unwrap();
    assert_eq!(truth.poses()[0].translation().x, 0.75);
    assert!(dataset.inertial_state(truth.start()).unwrap().is_none(), "no velocities");
    let facts: Vec<String> = dataset.facts().into_iter().map(|f| f.text).collect();
    assert_eq!(facts, ["vicon0: 1 poses", "leica0: positions without rotation, not used"]);
}

#[test]
fn the_imu_is_turned_into_the_body() {
    let sequence = Sequence::new();
    let t1 = T0 + 5_000_000;
    sequence.write("mav0/imu0/data.csv", &format!("#t\n{T0},1,0,0,0,0,9.81\n{t1},1,0,0,2,0,9.81\n"));
    let imu = sequence.dataset().imu().unwrap();
    assert_eq!((imu.len(), imu[0].gyro_rad_s.x, imu[1].accel_m_s2.x), (2, 1.0, 2.0));
    sequence.write("mav0/imu0/sensor.yaml", &format!("T_BS:\n  data: {TURNED}\n"));
    let imu = sequence.dataset().imu().unwrap();
    assert!((imu[0].gyro_rad_s.y - 1.0).abs() < 1e-12 && (imu[1].accel_m_s2.y - 2.0).abs() < 1e-12);
    sequence.write("mav0/imu0/sensor.yaml", "T_BS: [[1,0,0,0.5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n");
    assert!(problem(sequence.dataset().imu()).contains("0.500 m off the body's origin"));
    fs::remove_file(sequence.0.path().join("mav0/imu0/sensor.yaml")).unwrap();
    let says = |rows: &str, expected: &str| {
        sequence.write("mav0/imu0/data.csv", rows);
        let error = problem(sequence.dataset().imu());
        assert!(error.contains(expected), "{error}");
    };
    says("1,0,0,0,0,0,nan\n", "data.csv:1: none of the 1 rows has a sample");
    says("2,0,0,0,0,0,1\n1,0,0,0,0,0,1\n", "data.csv:2: stamp 1 ns is earlier");
    says("1,0,0,0,0,0,1\n1,0,0,0,0,0,1\n", "data.csv:2: stamp 1 ns appears twice");
    says("1,0,0,0,0,0\n", "expected 7 columns, found 6");
    says("", "holds no samples");
}

#[test]
fn stamps_in_another_unit_are_noticed() {
    let sequence = Sequence::new();
    let micros = T0 / 1000;
    sequence.write("mav0/imu0/data.csv", &format!("{micros},0,0,0,0,0,1\n{},0,0,0,0,0,1\n", micros + 5000));
    let error = problem(sequence.dataset().imu());
    assert!(error.contains("imu0") && error.contains("look like microseconds"), "{error}");
    // The camera's list is the wrong one here, so it is the one named.
    let sequence = Sequence::new();
    sequence
        .write("mav0/cam0/data.csv", &format!("{0},a.png\n{1},b.png\n", T0 / 1_000_000, T0 / 1_000_000 + 50));
    sequence.write("mav0/state_groundtruth_estimate0/data.csv", &format!("{T0},0,0,0,1,0,0,0\n"));
    let error = problem(sequence.dataset().trajectory(GROUND_TRUTH));
    assert!(error.contains("cam0") && error.contains("look like milliseconds"), "{error}");
    // Simulated time may start at zero, in all sensors.
    let sequence = Sequence::new();
    sequence.write("mav0/cam0/data.csv", "0,a.png\n50000000,b.png\n");
    sequence.write("mav0/state_groundtruth_estimate0/data.csv", "0,0,0,0,1,0,0,0,0,0,0,0,0,0,0,0,0\n");
    assert_eq!(sequence.dataset().trajectory(GROUND_TRUTH).unwrap().len(), 1);
    // Eight columns could be mistaken for a TUM file, whose quaternion is turned round.
    sequence.write("mav0/state_groundtruth_estimate0/data.csv", "7,0,0,0,1,0,0,0\n");
    let truth = sequence.dataset().trajectory(GROUND_TRUTH).unwrap();
    assert_eq!((truth.start().as_nanos(), truth.poses()[0].rotation().w), (7, 1.0));
}

#[test]
fn a_cloud_may_stand_elsewhere() {
    let sequence = Sequence::new();
    sequence.write("mav0/pointcloud0/data.ply", "ply\n");
    let cloud = sequence.dataset().cloud().unwrap().unwrap();
    assert_eq!(cloud.world_from_cloud.translation().norm(), 0.0);
    sequence.write("mav0/pointcloud0/sensor.yaml", &format!("%YAML:1.0\nT_WR:\n  data: {TURNED}\n"));
    let cloud = sequence.dataset().cloud().unwrap().unwrap();
    let angle = rotation_angle_rad(&cloud.world_from_cloud.rotation());
    assert!((angle - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn depth_images_belong_to_the_nearest_frame() {
    let sequence = Sequence::new();
    let description = "%YAML:1.0\nsensor_type: depth\nregistered_to: cam0\nmetres_per_count: 0.0002\n";
    sequence.write("mav0/depth0/sensor.yaml", description);
    // The first frame's 20 ms late, none for the second (it would be 30 ms away), the third's exact.
    let (a, b) = (T0 + 20_000_000, T0 + 100_000_000);
    sequence.write("mav0/depth0/data.csv", &format!("#t,f\n{a},a.png\n{b},b.png\n"));
    for (name, z_m) in [("a", 1.0), ("b", 2.0)] {
        let image = vice_core::dataset::DepthImage::new(Stamp::default(), 4, 2, vec![z_m; 8]).unwrap();
        let png = encode_depth_png(&image, 0.0002).unwrap();
        sequence.write_bytes(&format!("mav0/depth0/data/{name}.png"), &png);
    }
    let dataset = sequence.dataset();
    assert!(dataset.has_depth("cam0"));
    let depth = dataset.depth_image("cam0", 0).unwrap().unwrap();
    assert_eq!((depth.stamp.as_nanos(), depth.get(3, 1)), (a, Some(1.0)));
    assert!(dataset.depth_image("cam0", 1).unwrap().is_none());
    assert_eq!(dataset.depth_image("cam0", 2).unwrap().unwrap().get(0, 0), Some(2.0));
    assert!(problem(dataset.depth_image("cam0", 3)).contains("frame 3 does not exist"));
    assert_eq!(dataset.facts()[0].text, "depth0: 2 images registered to cam0");

    sequence.write("mav0/depth0/data/a.png", "no image");
    assert!(problem(sequence.dataset().depth_image("cam0", 0)).contains("a.png: is no PNG"));
    let says = |text: &str, expected: &str| {
        sequence.write("mav0/depth0/sensor.yaml", text);
        let error = problem(sequence.open());
        assert!(error.contains(expected), "{error}");
    };
    says(&description.replace("cam0", "cam3"), "registered to `cam3`, which is missing");
    says(&description.replace("0.0002", "0"), "metres_per_count = 0 is not positive");
    says(&description.replace("type: depth", "type: camera"), "not `depth`");
    says("sensor_type: depth\n", "is not the YAML expected");
}

#[test]
fn threads_share_what_was_read() {
    let sequence = Sequence::new();
    let dataset = sequence.dataset();
    let lists: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(|| dataset.frames("cam0").unwrap())).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect()
    });
    let again = dataset.frames("cam0").unwrap();
    assert!(lists.iter().all(|l| std::sync::Arc::ptr_eq(l, &again)));
}
