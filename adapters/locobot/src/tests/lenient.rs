//! Values that say nothing, stamps of other clocks, and topics in other encodings: left out, counted and said.

use super::*;

/// Odometry with a pose of these numbers at the place of the run's second.
fn with_pose(topic: &'static str, translation: [f64; 3], rotation_xyzw: [f64; 4]) -> Vec<Msg> {
    let mut messages = run();
    let t = START + 50_000_000;
    let write = move |o: crate::testing::Out| {
        let o = if topic == "/tf" { o.u32(1) } else { o };
        o.header(t, "odom").str("base_footprint").f64s(&translation).f64s(&rotation_xyzw).f64s(&[0.0; 78])
    };
    let kind = if topic == "/tf" { "tf2_msgs/TFMessage" } else { "nav_msgs/Odometry" };
    let is = |m: &Msg| m.topic == topic && m.nanos == t + 10_000_000;
    let place = messages.iter().position(is).unwrap();
    messages[place] = Msg::new(topic, kind, t, write);
    messages
}

#[test]
fn poses_that_are_none_are_gaps_and_small_errors_are_mended() {
    let turned = [0.0, 0.0, 0.0, 1.0];
    let cases: [([f64; 3], [f64; 4], usize, &str); 6] = [
        ([f64::NAN; 3], turned, 8, "1 poses with NaN or infinity are left out"),
        ([0.01, 0.0, f64::INFINITY], turned, 8, "1 poses with NaN or infinity are left out"),
        ([0.01, 0.0, 0.0], [f64::NAN; 4], 8, "1 poses with NaN or infinity are left out"),
        ([0.01, 0.0, 0.0], [0.0; 4], 8, "1 poses whose quaternion has a length more than 1 % off"),
        ([0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0011], 9, "1 poses have a quaternion up to 1 % off length 1"),
        ([0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 0.9905], 9, "1 poses have a quaternion up to 1 % off length 1"),
    ];
    for (translation, rotation, left, expected) in cases {
        let data = open(&with_pose("/odom", translation, rotation));
        assert_eq!(data.trajectory("/odom").unwrap().len(), left);
        assert!(
            doubts(data.as_ref()).contains(&format!("topic /odom: {expected}")),
            "{}",
            doubts(data.as_ref())
        );
        let data = open(&with_pose("/tf", translation, rotation));
        let samples = format!("odom -> base_footprint  {left} samples");
        assert!(facts(data.as_ref()).contains(&samples), "{}", facts(data.as_ref()));
        assert!(doubts(data.as_ref()).contains(&format!("tf: {expected}")), "{}", doubts(data.as_ref()));
    }
    let exact = open(&with_pose("/odom", [0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0009]));
    assert_eq!(doubts(exact.as_ref()), "", "as accurate as the method asks for");
}

#[test]
fn one_bad_transform_takes_no_other_of_its_message_along() {
    let mut messages = run();
    messages.push(Msg::new("/tf_static", "tf2_msgs/TFMessage", START, |o| {
        let bad = o.u32(2).header(START, "base_link").str("bad").f64s(&[f64::NAN; 7]);
        bad.header(START, "base_link").str("good").f64s(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    }));
    let facts = facts(open(&messages).as_ref());
    assert!(facts.contains("base_link -> good  fixed") && !facts.contains("-> bad"), "{facts}");
}

#[test]
fn of_poses_of_one_stamp_the_first_is_kept() {
    let mut messages = run();
    for x in [7.0, 8.0] {
        messages.push(odometry("/odom", START + 50_000_000, "odom", "base_footprint", At(x, 0.0, 0.0, 0.0)));
    }
    let data = open(&messages);
    let odom = data.trajectory("/odom").unwrap();
    assert_eq!((odom.len(), odom.poses()[1].translation().x), (9, 0.01));
    assert!(doubts(data.as_ref()).contains("topic /odom: 2 poses repeat a stamp: the first of each is kept"));
}

#[test]
fn zero_stamps_of_poses_and_sensors_are_left_out_and_said() {
    let mut messages = run();
    let t = START + 10 * TENTH;
    for mut message in [
        odometry("/odom", 0, "odom", "base_footprint", At(9.0, 0.0, 0.0, 0.0)),
        pose("/mocap", 0, "map", At(9.0, 0.0, 0.0, 0.0)),
        imu("/imu", 0, "base_link", [0.0; 3], [0.0, 0.0, 9.8]),
        tf("/tf", 0, "odom", "base_footprint", At(9.0, 0.0, 0.0, 0.0)),
    ] {
        message.nanos = t;
        messages.push(message);
    }
    messages.push(pose("/mocap", t, "map", At(9.0, 0.0, 0.0, 0.0)));
    messages.push(imu("/imu", t, "base_link", [0.0; 3], [0.0, 0.0, 9.8]));
    let data = open(&messages);
    assert_eq!((data.imu().unwrap().len(), data.trajectory("/mocap").unwrap().len()), (1, 1));
    let text = doubts(data.as_ref());
    for expected in [
        "topic /odom: 1 poses with a zero stamp",
        "topic /mocap: 1 poses with a zero stamp",
        "topic /imu: 1 samples with a zero stamp",
        "1 transforms odom -> base_footprint have a zero stamp",
    ] {
        assert!(text.contains(expected), "{expected} not in {text}");
    }
}

#[test]
fn stamps_of_another_machines_clock_are_noticed() {
    for hours in [-3_i64, 2] {
        let shift = hours * 3_600_000_000_000;
        let moved = |m: Msg| match m.topic.as_str() {
            "/odom" => {
                let t = m.nanos - 10_000_000;
                Msg {
                    nanos: m.nanos,
                    ..odometry("/odom", t + shift, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0))
                }
            }
            _ => m,
        };
        let text = doubts(open(&run().into_iter().map(moved).collect::<Vec<_>>()).as_ref());
        assert!(text.contains("clocks-differ: topic /camera/color/image_raw"), "{text}");
        assert!(text.contains(&format!("/odom {:.3} s", 0.01 - 3600.0 * hours as f64)), "{text}");
        assert!(!text.contains("/tf "), "{text}");
    }
    // Transforms that are dated ahead now and then, as localisation does.
    let mut messages = run();
    for i in 0..4 {
        let t = START + i * TENTH;
        let ahead = tf("/tf", t + 20 * TENTH, "map", "elsewhere", At(0.0, 0.0, 0.0, 0.0));
        messages.push(Msg { nanos: t + 10_000_000, ..ahead });
    }
    assert_eq!(doubts(open(&messages).as_ref()), "");
    // The whole recording was played and recorded again a year later.
    let again = run().into_iter().map(|m| Msg { nanos: m.nanos + 31_536_000_000_000_000, ..m });
    assert_eq!(doubts(open(&again.collect::<Vec<_>>()).as_ref()), "");
}

#[test]
fn a_topic_in_another_encoding_moves_no_other_out_of_its_role() {
    let plain = Opened::new("run.mcap", &mcap(&run())).open(&[]).unwrap();
    let other = |encoding: &str, kind: &str| {
        let message = Msg::new(&format!("{encoding}:/{encoding}"), kind, START, |o| o.data(b"{}"));
        Msg { bytes: [b"{}".to_vec(), b"{}".to_vec()], ..message }
    };
    for encoding in ["json", "protobuf", "flatbuffer", ""] {
        for place in [0, 1, 3, 30] {
            for kind in ["foxglove/Log", "sensor_msgs/Image", "tf2_msgs/TFMessage", "nav_msgs/Odometry"] {
                let mut messages = run();
                messages.insert(place, other(encoding, kind));
                let data = Opened::new("run.mcap", &mcap(&messages)).open(&[]).unwrap();
                assert_eq!(data.cameras(), plain.cameras());
                assert_eq!(data.streams(), plain.streams(), "{encoding} at {place}");
                for stream in plain.streams() {
                    assert_eq!(data.trajectory(&stream).unwrap(), plain.trajectory(&stream).unwrap());
                }
                assert_eq!(data.image("color", 2).unwrap(), plain.image("color", 2).unwrap());
                assert!(facts(data.as_ref()).contains(": not read"), "{}", facts(data.as_ref()));
                let said = doubts(data.as_ref()).contains("topic-not-read");
                assert_eq!(said, !kind.starts_with("foxglove"), "{}", doubts(data.as_ref()));
            }
        }
    }
    let foreign = [other("protobuf", "foxglove.RawImage"), other("json", "foxglove.Log")];
    let error = Opened::new("run.mcap", &mcap(&foreign)).open(&[]).err().unwrap().to_string();
    assert!(error.contains("that can be read: messages in json, protobuf are not (its topics: /"), "{error}");
    // The same topic in two encodings.
    let mut messages = run();
    let odom =
        |m: &Msg| Msg { topic: format!("json:{}", m.topic), bytes: [vec![], b"{}".to_vec()], ..m.clone() };
    messages.splice(0..0, run().iter().filter(|m| m.topic == "/odom").map(odom));
    let data = Opened::new("run.mcap", &mcap(&messages)).open(&[]).unwrap();
    assert_eq!(data.trajectory("/odom").unwrap(), plain.trajectory("/odom").unwrap());
}
