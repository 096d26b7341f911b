//! Images and their calibration, several cameras, and units of depth.

use super::*;
use crate::testing::{Info, camera_info_of, compressed_image};
use vice_core::dataset::{Image, PixelFormat};
use vice_files::image_file::{encode_jpeg, encode_png};

const COLOR: &str = "/camera/color/image_raw";
const INFO: &str = "/camera/color/camera_info";

/// The run with other calibrations.
fn calibrated(info: &Info<'_>) -> Vec<Msg> {
    let mut messages = without(INFO);
    messages.extend((0..3).map(|i| camera_info_of(INFO, START + i * TENTH, "optical", info)));
    messages
}

#[test]
fn a_calibration_for_images_of_another_size_is_said_with_both() {
    let picture = Image::new(4, 2, PixelFormat::Gray8, vec![9; 8]).unwrap();
    let packed = |format: &str, data: &[u8]| {
        let mut messages = calibrated(&Info { size: [8, 4], ..Info::default() });
        messages.retain(|m| m.topic != COLOR);
        let topic = format!("{COLOR}/compressed");
        messages.extend((0..5).map(|i| compressed_image(&topic, START + i * TENTH, "optical", format, data)));
        messages
    };
    for messages in [
        calibrated(&Info { size: [8, 4], ..Info::default() }),
        packed("mono8; png compressed", &encode_png(&picture).unwrap()),
        packed("jpeg", &encode_jpeg(&picture, 90).unwrap()),
    ] {
        let data = open(&messages);
        let text = doubts(data.as_ref());
        assert!(
            text.contains("image-size: topic /camera/color/camera_info") && text.contains("8x4 pixels"),
            "{text}"
        );
        assert!(text.contains("have 4x2") && text.contains("multiplied by 0.5"), "{text}");
        let camera = data.camera("color").unwrap();
        assert_eq!((camera.width(), camera.height()), (4, 2), "labels beyond the images are refused");
    }
    // Not scaled, but cut.
    let text = doubts(open(&calibrated(&Info { size: [4, 4], ..Info::default() })).as_ref());
    assert!(text.contains("4x4 pixels") && text.contains("cuts its images"), "{text}");
    // Binning is honoured, and said where it does not fit.
    let binned = open(&calibrated(&Info { size: [8, 4], binning: 2, ..Info::default() }));
    assert_eq!(
        (doubts(binned.as_ref()), binned.camera("color").unwrap().fx_fy_cx_cy()[0]),
        (String::new(), 50.0)
    );
    let text = doubts(open(&calibrated(&Info { binning: 2, ..Info::default() })).as_ref());
    assert!(text.contains("of 2x1 pixels") && text.contains("4x2 with binning 2x2"), "{text}");
}

#[test]
fn calibrations_that_come_late_or_change() {
    let mut messages = calibrated(&Info { focal: 0.0, ..Info::default() });
    for (i, focal) in [(3, 100.0), (4, 100.0)] {
        messages.push(camera_info_of(INFO, START + i * TENTH, "optical", &Info { focal, ..Info::default() }));
    }
    let data = open(&messages);
    assert_eq!(data.camera("color").unwrap().fx_fy_cx_cy()[0], 100.0, "zeros are no calibration");
    assert_eq!(doubts(data.as_ref()), "");
    messages.push(camera_info_of(
        INFO,
        START + 5 * TENTH,
        "optical",
        &Info { focal: 120.0, ..Info::default() },
    ));
    let text = doubts(open(&messages).as_ref());
    assert!(text.contains("changes 1 times: the first is taken: fx 100 fy 100"), "{text}");
    assert!(text.contains("later fx 120 fy 120"), "{text}");
    let other = open(&{
        let mut messages = without(INFO);
        messages.push(camera_info_of(INFO, START, "infra", &Info::default()));
        messages
    });
    assert!(doubts(other.as_ref()).contains("the calibration is of infra, the images are of optical"));
}

#[test]
fn padded_distortion_is_read_and_said() {
    let cases: [(&str, &[f64]); 3] = [
        ("plumb_bob", &[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("rational_polynomial", &[0.1, 0.0, 0.0, 0.0, 0.0, 0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]),
        ("equidistant", &[0.1, 0.0, 0.0, 0.0, 0.0]),
    ];
    for (model, distortion) in cases {
        let data = open(&calibrated(&Info { model, distortion, ..Info::default() }));
        assert_eq!(data.camera("color").unwrap().model().coefficients()[0], 0.1, "{model}");
        let text = doubts(data.as_ref());
        assert!(
            text.contains("distortion-padded: topic /camera/color/camera_info") && text.contains(model),
            "{text}"
        );
        let wrong = [distortion, &[0.5]].concat();
        let data = open(&calibrated(&Info { model, distortion: &wrong, ..Info::default() }));
        let text = data.camera("color").unwrap_err().to_string();
        assert!(text.contains(&format!("`{model}`")) && text.contains("0.5, not 0"), "{text}");
    }
    let short = open(&calibrated(&Info { distortion: &[0.1; 3], ..Info::default() }));
    assert!(short.camera("color").unwrap_err().to_string().contains("`plumb_bob` takes 4 or 5"));
}

/// Two cameras, told apart by their topics only.
fn two_cameras(topics: [&str; 2]) -> Vec<Msg> {
    let mut messages: Vec<Msg> = run().into_iter().filter(|m| !m.topic.starts_with("/camera")).collect();
    for (i, topic) in topics.iter().enumerate() {
        let info = topic.replace("image_raw", "camera_info");
        let focal = 100.0 + i as f64;
        messages.push(camera_info_of(&info, START, "optical", &Info { focal, ..Info::default() }));
        messages.extend((0..5).map(|k| image(topic, START + k * TENTH, "optical", "mono8", i as u8)));
    }
    messages
}

#[test]
fn of_two_cameras_none_is_taken_and_each_is_there_by_its_name() {
    for (topics, names) in [
        (["/cam0/image_raw", "/cam1/image_raw"], ["cam0", "cam1"]),
        (["/stereo/left/image_raw", "/stereo/right/image_raw"], ["left", "right"]),
        (
            ["/a/camera/color/image_raw", "/b/camera/color/image_raw"],
            ["/a/camera/color/image_raw", "/b/camera/color/image_raw"],
        ),
    ] {
        let recording = Opened::bag(&two_cameras(topics));
        let data = recording.open(&[]).unwrap();
        assert!(data.cameras().is_empty());
        let text = doubts(data.as_ref());
        let error = data.camera("nope").unwrap_err().to_string();
        for said in [&text, &error] {
            for expected in ["several topics could be the color_topic", topics[0], topics[1]] {
                assert!(said.contains(expected), "{expected} not in {said}");
            }
            assert!(
                said.contains(&format!("--camera {}", names[1])) && said.contains("--set color_topic="),
                "{said}"
            );
        }
        for (i, name) in names.iter().enumerate() {
            for name in [*name, topics[i]] {
                assert_eq!(
                    data.camera(name).unwrap().fx_fy_cx_cy()[0],
                    100.0 + i as f64,
                    "its own calibration"
                );
                assert_eq!(data.image(name, 3).unwrap().data(), &[i as u8; 8]);
                assert_eq!(data.frames(name).unwrap().len(), 5);
                assert!(data.body_from_camera(name, at(TENTH)).is_ok() && !data.has_depth(name));
            }
            let set = recording.open(&[("color_topic", topics[i])]).unwrap();
            assert_eq!(set.cameras().len(), 1);
            assert!(!doubts(set.as_ref()).contains("no-camera"));
        }
        assert!(data.trajectory("odom").is_ok());
        assert!(!doubts(data.as_ref()).contains("no-camera"), "one was asked for by its name");
    }
}

#[test]
fn several_cameras_on_one_topic_and_images_that_change_their_size() {
    let mut messages = run();
    messages.extend((0..4).map(|i| image(COLOR, START + i * TENTH + 30_000_000, "other", "mono8", 9)));
    let text = doubts(open(&messages).as_ref());
    assert!(
        text.contains("topic /camera/color/image_raw: 4 of 9 images name another frame than optical"),
        "{text}"
    );
    let mut messages = run();
    messages.push(Msg::new(COLOR, "sensor_msgs/Image", START + 5 * TENTH, |o| {
        o.header(START + 5 * TENTH, "optical").u32(1).u32(4).str("mono8").u8(0).u32(4).data(&[0; 4])
    }));
    let text = doubts(open(&messages).as_ref());
    assert!(text.contains("several sizes: 1 of 4x1, 5 of 4x2"), "{text}");
}

#[test]
fn depth_in_another_unit_is_doubted_and_can_be_said() {
    let depth = "/camera/aligned_depth_to_color/image_raw";
    let with = |encoding: &'static str, bytes: &[u8], step: u32| {
        let mut messages = without(depth);
        messages.extend((0..5).map(|i| {
            let t = START + i * TENTH;
            Msg::new(depth, "sensor_msgs/Image", t, |o| {
                o.header(t, "optical").u32(2).u32(4).str(encoding).u8(0).u32(step).data(&bytes.repeat(8))
            })
        }));
        Opened::bag(&messages)
    };
    let z = |recording: &Opened, settings: &[(&str, &str)]| {
        let data = recording.open(settings).unwrap();
        data.facts();
        (data.depth_image("color", 1).unwrap().unwrap().get(0, 0).unwrap(), doubts(data.as_ref()))
    };
    for (recording, wrong, unit, right) in [
        (with("32FC1", &1061.0_f32.to_le_bytes(), 16), 1061.0, "mm", 1.061),
        (with("32FC1", &150.0_f32.to_le_bytes(), 16), 150.0, "cm", 1.5),
        (with("16UC1", &2_u16.to_le_bytes(), 8), 0.002, "m", 2.0),
    ] {
        let (z_m, text) = z(&recording, &[]);
        assert_eq!(z_m, wrong);
        assert!(
            text.contains(&format!("depth-unit: topic {depth}: the depth images cannot be in metres")),
            "{text}"
        );
        assert!(text.contains("--set depth_unit="), "{text}");
        assert_eq!(z(&recording, &[("depth_unit", unit)]), (right, String::new()));
        let error = recording.open(&[("depth_unit", "feet")]).err().unwrap().to_string();
        assert!(error.contains("depth_unit = feet (it is m, cm, mm"), "{error}");
    }
    let error = Opened::bag(&without(depth)).open(&[("depth_unit", "mm")]).err().unwrap().to_string();
    assert!(error.contains("depth_unit is set, but there are no depth images in use"), "{error}");
    assert_eq!(z(&with("32FC1", &1.5_f32.to_le_bytes(), 16), &[]), (1.5, String::new()));
}
