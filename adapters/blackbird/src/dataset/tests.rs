use std::fs;

use vice_core::dataset::{DatasetFactory, OpenOptions, PixelFormat, Probe};
use vice_files::image_file;

use super::*;
use crate::Blackbird;

const START_NS: i64 = 1_526_182_346_000_000_000;
const PERIOD_NS: i64 = 100_000_000;

/// A flight of one second to the north at 2 m/s, 1.5 m high, with three frames in two environments.
struct Fixture {
    root: tempfile::TempDir,
    flight: PathBuf,
}

fn fixture() -> Fixture {
    let root = tempfile::tempdir().unwrap();
    let flight = root.path().join("oval/yawForward/maxSpeed2p0");
    for camera in [
        "Garden/Camera_Left_Gray",
        "Room/Camera_Left_Gray",
        "Room/Camera_Right_Gray",
        "Room/Camera_Left_Depth",
    ] {
        fs::create_dir_all(flight.join(camera)).unwrap();
        let stamps: Vec<String> = (1..4).map(|i| (START_NS + i * PERIOD_NS).to_string()).collect();
        fs::write(flight.join(camera).join(STAMPS), stamps.join("\n")).unwrap();
    }
    let poses: Vec<String> = (0..200)
        .map(|i| format!("{},{},0.5,-1.5,1,0,0,0", START_NS / 1000 + i * 5000, 0.01 * i as f64))
        .collect();
    fs::write(flight.join(POSES), poses.join("\n")).unwrap();
    fs::write(flight.join("flightNormalizationOffset.csv"), "0,0,-1.5").unwrap();
    let offsets = "unitySettings:\n  oval:\n    - name: Room\n      offset: [0, 0, -0.5, 0]\n    - name: Garden\n      offset: [0, 0, -1, 0]\n";
    fs::write(root.path().join("trajectoryOffsets.yaml"), offsets).unwrap();
    Fixture { root, flight }
}

impl Fixture {
    fn open_with(&self, settings: &[(&str, &str)]) -> DataResult<Box<dyn Dataset>> {
        let settings = settings.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        Blackbird.open(&self.flight, &OpenOptions { settings })
    }

    fn open(&self) -> Box<dyn Dataset> {
        self.open_with(&[("environment", "Room")]).unwrap()
    }

    fn write(&self, name: &str, text: &str) {
        let path = self.flight.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
}

fn text<T>(result: DataResult<T>) -> String {
    result.err().map(|e| e.to_string()).unwrap_or_default()
}

#[test]
fn flights_are_recognised_and_collections_listed() {
    let f = fixture();
    assert_eq!(Blackbird.probe(&f.flight), Probe::Yes);
    assert_eq!(Blackbird.probe(f.root.path()), Probe::Collection(vec![f.flight.clone()]));
    assert_eq!(Blackbird.probe(&f.flight.join("Room")), Probe::No);
    assert_eq!(Blackbird.probe(Path::new("/no/such/folder")), Probe::No);
    let error = text(Blackbird.open(f.root.path(), &OpenOptions::default()));
    assert!(error.contains("is no flight") && error.contains("name one flight, such as"), "{error}");
}

#[test]
fn the_environment_is_a_setting_with_a_default() {
    let f = fixture();
    let first = f.open_with(&[]).unwrap();
    assert_eq!(first.cameras(), ["left_gray"]);
    assert_eq!(first.facts()[0].text, "Garden (chosen)");
    let room = f.open();
    assert_eq!(room.cameras(), ["left_gray", "right_gray"]);
    assert_eq!(room.name(), "oval_yawForward_maxSpeed2p0");
    assert_eq!(room.facts()[1].text, "Room (chosen)");
    assert_eq!(room.facts()[2].text, "left_gray: stamps only, no pixels");
    assert!(text(f.open_with(&[("environment", "Attic")])).contains("(it has: Garden, Room)"));
    assert!(text(room.camera("left")).contains("no camera `left` (it has: left_gray, right_gray)"));
    assert!(text(room.trajectory("slam")).contains("it has: ground-truth"));
    // 0.5 m above the floor at its lowest in one, 1 m in the other.
    for (dataset, d_m) in [(room, 0.5 - 1.5), (first, 1.0 - 1.5)] {
        let Floor::World(plane) = dataset.floor(Stamp::default()).unwrap() else { panic!("in the world") };
        assert!((plane.d_m() - d_m).abs() < 1e-12 && plane.normal().z == 1.0);
    }
}

#[test]
fn states_come_from_the_ground_truth_or_the_user() {
    let f = fixture();
    let at = Stamp::from_nanos(START_NS + 102_500_000);
    let state = f.open().inertial_state(at).unwrap().unwrap();
    assert!((state.velocity_m_s - Vector3::new(2.0, 0.0, 0.0)).norm() < 1e-9);
    assert!((state.world_from_body.translation() - Vector3::new(0.205, -0.5, 1.5)).norm() < 1e-12);
    let given = f.open_with(&[("initial-velocity", "1,2,3")]).unwrap().inertial_state(at).unwrap().unwrap();
    assert_eq!(given.velocity_m_s, Vector3::new(1.0, -2.0, -3.0));
    assert!(text(f.open_with(&[("initial-velocity", "1,2")])).contains("three numbers"));
    assert_eq!(f.open().inertial_state(Stamp::from_nanos(START_NS - 1)).unwrap(), None);
    assert!(f.open().imu().unwrap().is_empty(), "no file, no samples");
}

#[test]
fn without_films_all_but_pixels_is_there() {
    let f = fixture();
    let dataset = f.open();
    assert_eq!(dataset.frames("left_gray").unwrap().len(), 3);
    assert!(text(dataset.image("left_gray", 0)).contains("no pixels: neither lossless.mov nor images/"));
    assert!(!dataset.has_depth("left_gray"));
    assert_eq!(dataset.depth_image("left_gray", 0).unwrap(), None);
    fs::remove_file(f.flight.join("Room/Camera_Left_Gray").join(STAMPS)).unwrap();
    let error = text(f.open().frames("left_gray"));
    assert!(error.contains("Camera_Left_Gray/nSecTimestamps.txt: no such file"), "{error}");
}

#[test]
fn unpacked_images_are_read_directly() {
    let f = fixture();
    let folder = f.flight.join("Room/Camera_Left_Gray/images");
    fs::create_dir_all(&folder).unwrap();
    // A film beside them is not looked at.
    f.write("Room/Camera_Left_Gray/lossless.mov", "no film");
    for i in 0..3_u8 {
        let image = Image::new(1024, 768, PixelFormat::Gray8, vec![i; 1024 * 768]).unwrap();
        fs::write(folder.join(format!("{i:010}.png")), image_file::encode_png(&image).unwrap()).unwrap();
    }
    let dataset = f.open();
    assert_eq!(dataset.image("left_gray", 2).unwrap().data()[0], 2);
    assert!(text(dataset.image("left_gray", 3)).contains("no frame 3, the camera has 3"));
    let stored = fs::read(folder.join(format!("{:010}.png", 1))).unwrap();
    assert_eq!(dataset.image_file("left_gray", 1).unwrap(), Some(stored));
    let small = Image::new(2, 1, PixelFormat::Gray8, vec![0; 2]).unwrap();
    fs::write(folder.join("0000000000.png"), image_file::encode_png(&small).unwrap()).unwrap();
    assert!(text(dataset.image("left_gray", 0)).contains("is 2x1 pixels, the camera's are 1024x768"));
    fs::remove_file(folder.join("0000000000.png")).unwrap();
    let error = text(f.open().frames("left_gray"));
    assert!(
        error.contains("more stamps than frames: 3 stamps, but") && error.contains("2 frames"),
        "{error}"
    );
}

#[test]
fn mixed_up_units_are_detected_and_the_right_file_is_blamed() {
    let f = fixture();
    let stamps = |unit_ns: i64| {
        let stamps: Vec<String> =
            (1..4).map(|i| ((START_NS + i * PERIOD_NS) / unit_ns).to_string()).collect();
        f.write("Room/Camera_Left_Gray/nSecTimestamps.txt", &stamps.join("\n"));
    };
    stamps(1000);
    for error in [text(f.open().frames("left_gray")), text(f.open().trajectory(GROUND_TRUTH))] {
        assert!(error.contains("nSecTimestamps.txt: the stamps run from"), "{error}");
        assert!(error.contains("microseconds read as nanoseconds"), "{error}");
    }
    stamps(1);
    f.write(POSES, &format!("{START_NS},0,0,0,1,0,0,0\n"));
    let error = text(f.open().trajectory(GROUND_TRUTH));
    assert!(
        error.contains("groundTruthPoses.csv:1: ") && error.contains("microseconds are expected"),
        "{error}"
    );
    f.write(POSES, &format!("{},0,0,0,1,0,0,0\n", START_NS / 1_000_000));
    for error in [text(f.open().frames("left_gray")), text(f.open().trajectory(GROUND_TRUTH))] {
        assert!(error.contains("groundTruthPoses.csv: the stamps run from"), "{error}");
    }
}

#[test]
fn depth_goes_with_the_camera_of_its_side() {
    let f = fixture();
    let folder = f.flight.join("Room/Camera_Left_Depth");
    fs::create_dir_all(folder.join("images")).unwrap();
    let plane = DepthImage::new(Stamp::default(), 1024, 768, vec![3.125; 1024 * 768]).unwrap();
    let png = image_file::encode_depth_png(&plane, crate::depth::METRES_PER_COUNT).unwrap();
    fs::write(folder.join("images/0.png"), png).unwrap();
    // Half a frame period is 50 ms: the second frame is just within reach, the third is not.
    fs::write(folder.join(STAMPS), (START_NS + 2 * PERIOD_NS + PERIOD_NS / 2 - 1).to_string()).unwrap();
    let dataset = f.open();
    assert!(dataset.has_depth("left_gray") && !dataset.has_depth("right_gray") && !dataset.has_depth("x"));
    assert_eq!(dataset.depth_image("left_gray", 1).unwrap().unwrap().get(5, 5), Some(3.125));
    assert_eq!(dataset.depth_image("left_gray", 0).unwrap(), None);
    assert_eq!(dataset.depth_image("left_gray", 2).unwrap(), None);
    assert_eq!(dataset.depth_image("right_gray", 1).unwrap(), None);
    assert!(text(dataset.depth_image("left_gray", 3)).contains("no frame 3"));
}
