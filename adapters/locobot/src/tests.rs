//! Recordings as data sets: another robot's layout, and what can be wrong with one.

mod cameras;
mod crash;
mod lenient;
mod robots;
mod sweeps;

use std::path::PathBuf;

use nalgebra::Vector3;
use vice_core::dataset::{Dataset, DatasetFactory, Floor, OpenOptions, Probe};
use vice_core::error::DataResult;
use vice_core::time::{Span, Stamp};

use crate::Locobot;
use crate::testing::{
    At, Msg, START, bag, camera_info, db3, image, imu, joint_state, mcap, odometry, odometry_with, pose, run,
    tf,
};

const TENTH: i64 = 100_000_000;

struct Opened {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

impl Opened {
    fn new(name: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        Self { _folder: folder, path }
    }

    fn bag(messages: &[Msg]) -> Self {
        Self::new("run.bag", &bag(messages, "lz4", 10, true))
    }

    fn open(&self, settings: &[(&str, &str)]) -> DataResult<Box<dyn Dataset>> {
        let settings = settings.iter().map(|(k, v)| ((*k).to_string(), (*v).to_string())).collect();
        Locobot.open(&self.path, &OpenOptions { settings })
    }
}

fn open(messages: &[Msg]) -> Box<dyn Dataset> {
    Opened::bag(messages).open(&[]).unwrap()
}

fn error(messages: &[Msg]) -> String {
    Opened::bag(messages).open(&[]).err().unwrap().to_string()
}

fn at(nanos: i64) -> Stamp {
    Stamp::from_nanos(START + nanos)
}

fn facts(data: &dyn Dataset) -> String {
    data.facts().iter().map(|f| format!("{}: {}\n", f.section, f.text)).collect()
}

/// What the data set doubts, one line each.
fn doubts(data: &dyn Dataset) -> String {
    data.suspicions().iter().map(|s| format!("{}: {}\n", s.code, s.line())).collect()
}

fn without(topic: &str) -> Vec<Msg> {
    run().into_iter().filter(|m| m.topic != topic).collect()
}

#[test]
fn a_run_is_a_data_set() {
    let data = open(&run());
    assert_eq!((data.name(), data.format()), ("run", "locobot"));
    assert_eq!(
        (data.cameras(), data.streams()),
        (vec!["color".to_string()], ["odom", "slam", "/odom"].map(String::from).to_vec())
    );
    let frames = data.frames("color").unwrap();
    assert_eq!(
        frames.iter().map(|s| s.as_nanos() - START).collect::<Vec<_>>(),
        [0, 1, 2, 3, 4].map(|i| i * TENTH)
    );
    assert_eq!(data.image("color", 3).unwrap().data(), &[6; 8]);
    let z = data.depth_image("color", 1).unwrap().unwrap();
    assert_eq!(
        (z.stamp, z.get(0, 0)),
        (at(TENTH + 1_000_000), Some(0.771)),
        "0x0303 mm, a millisecond later"
    );
    assert!(data.has_depth("color") && !data.has_depth("x"));
    assert!(matches!(data.floor(frames[0]).unwrap(), Floor::Body(p) if p.d_m() == 0.0));
    let slam = data.trajectory("slam").unwrap();
    assert_eq!(slam.pose_at(at(TENTH), Span::ZERO).unwrap().translation().x, 1.02);
    let camera = data.body_from_camera("color", at(TENTH)).unwrap();
    assert!((camera.translation() - Vector3::new(0.05, 0.0, 0.6)).norm() < 1e-3);
    let facts = facts(data.as_ref());
    for expected in [
        "topics: /odom  nav_msgs/Odometry  9 messages, 20.0 Hz",
        "tf: map -> odom  3 samples, 5.0 Hz",
        "tf: head -> optical  fixed",
        "chosen: base_frame base_footprint",
        "chosen: color_topic /camera/color/image_raw (mono8, frame optical)",
    ] {
        assert!(facts.contains(expected), "{expected} not in\n{facts}");
    }
    for (camera, index, expected) in
        [("color", 5, "no frame 5"), ("left", 0, "no camera `left` (there is: color)")]
    {
        assert!(data.image(camera, index).unwrap_err().to_string().contains(expected));
    }
    assert!(data.trajectory("vio").unwrap_err().to_string().contains("there are: odom, slam, /odom"));
}

#[test]
fn every_container_gives_the_same() {
    let first = open(&run());
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.db3");
    db3(&path, &run(), false);
    let others = [
        Opened::new("run.mcap", &mcap(&run())).open(&[]).unwrap(),
        Opened::new("run.bag", &bag(&run(), "bz2", 3, true)).open(&[]).unwrap(),
        Locobot.open(&path, &OpenOptions::default()).unwrap(),
    ];
    for other in others {
        assert_eq!(other.frames("color").unwrap(), first.frames("color").unwrap());
        for stream in first.streams() {
            assert_eq!(other.trajectory(&stream).unwrap(), first.trajectory(&stream).unwrap());
        }
        assert_eq!(other.image("color", 2).unwrap(), first.image("color", 2).unwrap());
    }
}

/// A quadrotor: other names of topics and frames, no tf_static, poses of its own estimator, a fixed camera.
fn quadrotor() -> Vec<Msg> {
    let mut messages = Vec::new();
    for i in 0..5 {
        let t = START + i * TENTH;
        messages.push(image("/stereo/left/image_mono", t, "cam_left", "mono8", i as u8));
        messages.push(camera_info("/stereo/left/camera_info", t, "cam_left"));
        messages.push(pose("/vio/pose", t, "earth", At(i as f64, 0.0, 1.0, 0.0)));
        messages.push(imu("/fcu/imu", t, "imu_link", [0.1, 0.0, 0.0], [9.81, 0.0, 0.0]));
        messages.push(Msg::new("/vicon/quad", "geometry_msgs/TransformStamped", t, |o| {
            o.header(t, "vicon").str("quad").f64s(&[0.0, i as f64, 1.0, 0.0, 0.0, 0.0, 1.0])
        }));
    }
    messages
}

#[test]
fn another_robots_layout_works_through_types_and_settings() {
    let mut messages = quadrotor();
    messages.push(tf("/tf_static", START, "fcu", "cam_left", At(0.1, 0.0, 0.0, 0.0)));
    messages.push(tf("/tf_static", START, "fcu", "imu_link", At(0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2)));
    let recording = Opened::new("flight.mcap", &mcap(&messages));
    let data = recording.open(&[("base_frame", "fcu"), ("ground_truth", "/vicon/quad")]).unwrap();
    assert_eq!(data.cameras(), ["left"]);
    assert_eq!(data.streams(), ["ground-truth", "/vicon/quad", "/vio/pose"]);
    assert_eq!(data.camera("left").unwrap().fx_fy_cx_cy(), [100.0, 100.0, 1.5, 0.5]);
    assert_eq!(data.body_from_camera("left", at(7)).unwrap().translation().x, 0.1);
    let pose = data.trajectory("/vio/pose").unwrap().pose_at(at(TENTH / 2), Span::from_millis(100)).unwrap();
    assert_eq!(pose.translation(), Vector3::new(0.5, 0.0, 1.0));
    let truth = data.trajectory("ground-truth").unwrap();
    assert_eq!(truth.poses()[2].translation(), Vector3::new(0.0, 2.0, 1.0));
    let samples = data.imu().unwrap();
    assert!((samples[0].accel_m_s2 - Vector3::new(0.0, 9.81, 0.0)).norm() < 1e-12, "turned into the body");
    assert!((samples[0].gyro_rad_s - Vector3::new(0.0, 0.1, 0.0)).norm() < 1e-12);
    let state = data.inertial_state(at(2 * TENTH)).unwrap().unwrap();
    assert!((state.velocity_m_s - Vector3::new(0.0, 10.0, 0.0)).norm() < 1e-6);
    assert!(matches!(data.floor(at(0)).unwrap(), Floor::World(_)), "it does not stand on the floor");
    assert!(!data.has_depth("left") && data.depth_image("left", 0).unwrap().is_none());
    // Without any tf the place of the camera is a setting; here in a file beside the recording.
    let recording = Opened::bag(&quadrotor());
    let file = recording.path.with_file_name("vice.toml");
    std::fs::write(&file, "base_frame = \"fcu\"\nbody_from_camera = \"0.2 0 0 0 0 0 1\"\n").unwrap();
    let data = recording.open(&[]).unwrap();
    assert_eq!(data.body_from_camera("left", at(0)).unwrap().translation().x, 0.2);
}

#[test]
fn poses_of_another_frame_are_moved_to_the_base() {
    let mut messages = run();
    messages.push(odometry("/imu_odom", START, "odom", "base_link", At(5.0, 0.0, 0.1, 0.0)));
    let pose = open(&messages).trajectory("/imu_odom").unwrap().poses()[0];
    assert!((pose.translation() - Vector3::new(5.0, 0.0, 0.0)).norm() < 1e-12);
}

#[test]
fn the_floor_is_seen_from_another_base() {
    let data = Opened::bag(&run()).open(&[("base_frame", "base_link")]).unwrap();
    let Floor::Body(plane) = data.floor(at(0)).unwrap() else { panic!("a ground robot") };
    assert!((plane.d_m() - 0.1).abs() < 1e-12, "the floor is at z = -0.1 of base_link");
}

#[test]
fn joints_that_tf_lacks_come_from_the_robot_description() {
    let urdf = r#"<robot name="r">
      <joint name="pan" type="revolute"><parent link="base_link"/><child link="head"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint>
      <joint name="eye" type="fixed"><parent link="head"/><child link="optical"/><origin xyz="1 0 0"/></joint>
    </robot>"#;
    let mut messages: Vec<Msg> =
        vec![tf("/tf_static", START, "base_footprint", "base_link", At(0.0, 0.0, 0.0, 0.0))];
    for i in 0..5 {
        let t = START + i * TENTH;
        messages.push(tf("/tf", t, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0)));
        messages.push(image("/camera/color/image_raw", t, "optical", "mono8", 0));
        messages.push(joint_state("/joint_states", t, "pan", 0.2 * i as f64));
    }
    let place =
        |data: Box<dyn Dataset>| data.body_from_camera("color", at(3 * TENTH / 2)).unwrap().translation();
    let expected = Vector3::new(0.3_f64.cos(), 0.3_f64.sin(), 1.0);
    let recording = Opened::bag(&messages);
    assert!(recording.open(&[]).unwrap().body_from_camera("color", at(0)).is_err());
    std::fs::write(recording.path.with_file_name("r.urdf"), urdf).unwrap();
    assert!((place(recording.open(&[("urdf", "r.urdf")]).unwrap()) - expected).norm() < 1e-12);
    messages.push(Msg::new("/robot_description", "std_msgs/String", START, |o| o.str(urdf)));
    assert!((place(open(&messages)) - expected).norm() < 1e-12);
}

#[test]
fn no_camera_info() {
    let data = open(&without("/camera/color/camera_info"));
    let error = data.camera("color").unwrap_err().to_string();
    assert!(error.contains("topic /camera/color/image_raw has no camera_info"), "{error}");
    assert!(data.image("color", 0).is_ok() && data.trajectory("odom").is_ok());
}

#[test]
fn no_tf_between_base_and_camera() {
    let messages: Vec<Msg> = run().into_iter().filter(|m| m.topic != "/tf_static").collect();
    let data = open(&messages);
    let error = data.body_from_camera("color", at(0)).unwrap_err().to_string();
    assert!(
        error.contains("tf does not connect base_footprint and optical") && error.contains("run.bag"),
        "{error}"
    );
    assert!(facts(data.as_ref()).contains("trees that are not connected"));
    let data = open(&run().into_iter().filter(|m| !m.topic.starts_with("/tf")).collect::<Vec<_>>());
    assert_eq!(data.streams(), ["/odom"]);
    assert!(data.trajectory("slam").unwrap_err().to_string().contains("set map_frame"));
    assert!(data.body_from_camera("color", at(0)).unwrap_err().to_string().contains("no frame"));
}

#[test]
fn tf_only_after_the_first_image() {
    let late: Vec<Msg> =
        run().into_iter().filter(|m| m.topic != "/tf" || m.nanos > START + 60_000_000).collect();
    let data = open(&late);
    let error = data.body_from_camera("color", at(0)).unwrap_err().to_string();
    let expected =
        format!("tf has no base_link -> head at {START} ns: its first sample is at {}", START + TENTH);
    assert!(error.contains(&expected), "{error}");
    assert!(data.body_from_camera("color", at(TENTH)).is_ok());
    assert_eq!(data.trajectory("odom").unwrap().start(), at(TENTH), "nothing is extrapolated");
}

#[test]
fn a_clock_that_jumps_back() {
    let mut messages = run();
    messages.push(image("/camera/color/image_raw", START - 50 * TENTH, "optical", "mono8", 0));
    let text = error(&messages);
    assert!(text.contains("topic /camera/color/image_raw: the clock jumps back from"), "{text}");
    assert!(text.contains("run.bag: byte "), "{text}");
    let mut messages = run();
    messages.push(tf("/tf", START - 50 * TENTH, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0)));
    messages.push(odometry("/odom", START - 50 * TENTH, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0)));
    let data = open(&messages);
    for (stream, expected) in
        [("odom", "tf odom -> base_footprint jumps back"), ("/odom", "topic /odom: the clock")]
    {
        let text = data.trajectory(stream).unwrap_err().to_string();
        assert!(text.contains(expected), "{text}");
    }
}

#[test]
fn zero_stamps_of_simulated_time() {
    let zero = |i: i64| {
        let mut message = image("/camera/color/image_raw", 0, "optical", "mono8", i as u8);
        message.nanos = START + i * TENTH;
        message
    };
    let messages: Vec<Msg> = without("/camera/color/image_raw").into_iter().chain((0..3).map(zero)).collect();
    let text = error(&messages);
    assert!(text.contains("topic /camera/color/image_raw: all 3 stamps are zero"), "{text}");
    let data = Opened::bag(&messages).open(&[("stamps", "record")]).unwrap();
    assert_eq!(data.frames("color").unwrap()[1], at(TENTH));
    let some: Vec<Msg> = run().into_iter().chain([zero(1)]).collect();
    let data = open(&some);
    assert_eq!(data.frames("color").unwrap().len(), 5);
    assert!(
        facts(data.as_ref()).contains("damage: topic /camera/color/image_raw: 1 images with a zero stamp")
    );
}

#[test]
fn an_unknown_encoding() {
    let mut messages = without("/camera/color/image_raw");
    messages.push(image("/camera/color/image_raw", START, "optical", "bayer_rggb8", 0));
    let text = open(&messages).image("color", 0).unwrap_err().to_string();
    assert!(text.contains("topic /camera/color/image_raw, frame 0: the encoding `bayer_rggb8`"), "{text}");
    assert!(text.contains("run.bag: byte "), "{text}");
}

#[test]
fn a_bag_of_another_robot_and_settings_that_do_not_fit() {
    let chatter = [Msg::new("/chatter", "std_msgs/String", START, |o| o.str("hello"))];
    let text = error(&chatter);
    assert!(
        text.contains("no topic has images, transforms or poses (its topics: /chatter (std_msgs/String))"),
        "{text}"
    );
    let recording = Opened::bag(&run());
    let text = |settings: &[(&str, &str)]| recording.open(settings).err().unwrap().to_string();
    assert!(text(&[("color_topic", "/nope")]).contains("there is no such topic"));
    assert!(text(&[("base_frame", "nope")]).contains("tf has no such frame (its frames: base_footprint,"));
    assert!(text(&[("ground_truth", "nope.txt")]).contains("no such topic with poses, and no such file"));
    assert!(text(&[("nope", "1")]).contains("no setting `nope`"));
}

#[test]
fn messages_that_cannot_be_decoded_are_counted_with_their_topic() {
    let mut messages = run();
    let broken = messages.iter().position(|m| m.topic == "/odom").unwrap();
    messages[broken].bytes[0].truncate(40);
    let data = open(&messages);
    assert_eq!(data.trajectory("/odom").unwrap().len(), 8);
    let facts = facts(data.as_ref());
    assert!(facts.contains("topic /odom: 1 messages are left out, the first since"), "{facts}");
    assert!(facts.contains("run.bag: byte "), "{facts}");
}

#[test]
fn a_recording_that_was_cut_off_is_still_a_data_set() {
    let bytes = bag(&run(), "lz4", 10, true);
    let data = Opened::new("cut.bag", &bytes[..bytes.len() * 2 / 3]).open(&[]).unwrap();
    let n = data.frames("color").unwrap().len();
    assert!((1..5).contains(&n), "{n}");
    assert!(facts(data.as_ref()).contains("damage: "));
}

#[test]
fn an_empty_file_and_other_things_are_not_ours() {
    let empty = Opened::new("empty.bag", b"");
    assert_eq!(Locobot.probe(&empty.path), Probe::Yes, "so that the user is told why it cannot be read");
    assert!(empty.open(&[]).err().unwrap().to_string().contains("empty.bag: the file is empty"));
    let text = Opened::new("a.txt", b"hello");
    assert_eq!(Locobot.probe(&text.path), Probe::No);
    assert!(text.open(&[]).err().unwrap().to_string().contains("is no ROS 1 bag"));
    assert_eq!(Locobot.probe(text.path.parent().unwrap()), Probe::No);
    let gone = Locobot.open(&text.path.with_file_name("gone"), &OpenOptions::default());
    assert!(gone.err().unwrap().to_string().contains("no such file or folder"));
}

#[test]
fn a_folder_of_several_recordings_is_a_collection() {
    let one = Opened::bag(&run());
    let folder = one.path.parent().unwrap();
    assert_eq!(Locobot.probe(folder), Probe::Yes);
    std::fs::write(folder.join("other.mcap"), mcap(&run())).unwrap();
    assert_eq!(Locobot.probe(folder), Probe::Collection(vec![folder.join("other.mcap"), one.path.clone()]));
    assert!(
        Locobot
            .open(folder, &OpenOptions::default())
            .err()
            .unwrap()
            .to_string()
            .contains("holds 2 recordings")
    );
}

#[test]
fn covariances_of_messages_are_handed_over_where_they_change() {
    let mut messages = run();
    let frames = ("odom", "base_footprint");
    for k in 0..6 {
        let mut rows = [0.0; 36];
        // The same value twice; a cross term tells rows from columns of a matrix that is not symmetric.
        (rows[0], rows[1], rows[35]) = (0.01 * f64::from(k / 2), 0.002, 0.5);
        let (nanos, at) = (START + i64::from(k) * TENTH, At(f64::from(k), 0.0, 0.0, 0.0));
        messages.push(odometry_with("/filter", nanos, frames, at, &rows));
    }
    let data = open(&messages);
    let said = data.pose_covariances("/filter").unwrap();
    let stamps: Vec<Stamp> = said.iter().map(|c| c.stamp).collect();
    assert_eq!(stamps, [at(0), at(2 * TENTH), at(4 * TENTH)]);
    let m = said[2].matrix;
    assert_eq!((m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(5, 5)]), (0.02, 0.002, 0.0, 0.5));
    assert_eq!(data.pose_covariances("odom").unwrap(), [], "tf says nothing of the kind");
}
