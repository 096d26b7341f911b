//! Two sources in one edge, topic or sensor.

use super::*;

/// The run with everything of it in a namespace, and a second robot, 100 m away, in another.
fn two_robots(first: &str, second: &str) -> Vec<Msg> {
    let placed = |space: &str, camera: bool| {
        let messages = run().into_iter().filter(move |m| camera || m.topic.starts_with("/tf"));
        let space = space.to_string();
        messages.map(move |m| Msg { topic: format!("{space}{}", m.topic), ..m })
    };
    let mut messages: Vec<Msg> = placed(first, true).collect();
    for (i, mut message) in placed(second, false).enumerate() {
        if message.topic.ends_with("/tf") && i % 2 == 0 {
            let t = message.nanos - 10_000_000;
            message = tf(&message.topic, t, "odom", "base_footprint", At(100.0 + i as f64, 0.0, 0.0, 0.0));
        }
        messages.push(message);
    }
    messages.sort_by_key(|m| m.nanos);
    messages
}

#[test]
fn the_tf_of_the_cameras_own_namespace_is_used() {
    let alone = open(&run());
    for (first, second) in
        [("/robot1", "/robot2"), ("/fleet/a", "/fleet/b"), ("/a", ""), ("", "/b"), ("/b/c", "/b")]
    {
        let messages = two_robots(first, second);
        for recording in [Opened::bag(&messages), Opened::new("run.mcap", &mcap(&messages))] {
            let data = recording.open(&[]).unwrap();
            assert_eq!(
                data.trajectory("odom").unwrap(),
                alone.trajectory("odom").unwrap(),
                "{first} {second}"
            );
            let place = |data: &dyn Dataset| data.body_from_camera("color", at(TENTH)).unwrap();
            assert_eq!(place(data.as_ref()), place(alone.as_ref()));
            let text = doubts(data.as_ref());
            for expected in
                [&format!("{first}/tf,"), &format!("{second}/tf"), "base_footprint", "tf_namespace="]
            {
                assert!(text.contains(expected), "{expected} not in {text}");
            }
            assert_eq!(text.matches("tf-namespaces").count(), 1, "{text}");
        }
    }
}

#[test]
fn another_robot_is_taken_where_it_is_set() {
    let recording = Opened::bag(&two_robots("/robot1", "/robot2"));
    for spelling in ["/robot2", "robot2", "/robot2/", "/robot2/tf", "/robot2/tf_static"] {
        let data = recording.open(&[("tf_namespace", spelling)]).unwrap();
        assert!(data.trajectory("odom").unwrap().path_length_m() > 1.0, "{spelling}");
        assert!(!doubts(data.as_ref()).contains("tf-namespaces"));
    }
    let error = recording.open(&[("tf_namespace", "/robot3")]).err().unwrap().to_string();
    assert!(error.contains("there is no tf in it") && error.contains("/robot2/tf"), "{error}");
    let recording = Opened::bag(&two_robots("/a", ""));
    let data = recording.open(&[("tf_namespace", "/")]).unwrap();
    assert!(data.trajectory("odom").unwrap().path_length_m() > 1.0);
}

#[test]
fn where_nothing_says_which_robot_is_meant_none_is_used() {
    let to_outside = |m: Msg| Msg { topic: m.topic.replace("/robot1/camera", "/gopro/camera"), ..m };
    let messages: Vec<Msg> = two_robots("/robot1", "/robot2").into_iter().map(to_outside).collect();
    let data = open(&messages);
    assert!(!data.streams().contains(&"odom".to_string()));
    for error in [data.body_from_camera("color", at(0)).unwrap_err(), data.trajectory("odom").unwrap_err()] {
        let text = error.to_string();
        assert!(
            text.contains("/robot1/tf") && text.contains("/robot2/tf") && text.contains("tf_namespace"),
            "{text}"
        );
    }
    let set = Opened::bag(&messages).open(&[("tf_namespace", "robot1")]).unwrap();
    assert!(set.trajectory("odom").unwrap().path_length_m() < 0.2);
    // The frame of the images tells as well.
    let renamed = messages.into_iter().filter(|m| m.topic != "/robot2/tf_static").collect::<Vec<_>>();
    assert!(open(&renamed).trajectory("odom").unwrap().path_length_m() < 0.2);
}

/// The run with a prefix before all of its frames, as the robots of a fleet have them.
fn prefixed(prefix: &str, camera_frame: &str) -> Vec<Msg> {
    let name = |frame: &str| format!("{prefix}{frame}");
    let mut messages = vec![
        tf("/tf_static", START, &name("base_footprint"), &name("optical"), At(0.05, 0.0, 0.6, 0.0)),
        camera_info("/camera/color/camera_info", START, camera_frame),
    ];
    for i in 0..9_i64 {
        let t = START + i * 50_000_000;
        messages.push(tf(
            "/tf",
            t,
            &name("odom"),
            &name("base_footprint"),
            At(0.01 * i as f64, 0.0, 0.0, 0.0),
        ));
        messages.push(image("/camera/color/image_raw", t, camera_frame, "mono8", i as u8));
    }
    messages
}

#[test]
fn frames_of_several_robots_in_one_tf_are_told_apart_by_their_prefix() {
    let other: Vec<Msg> =
        prefixed("robot2/", "x").into_iter().filter(|m| m.topic.starts_with("/tf")).collect();
    let messages: Vec<Msg> = prefixed("robot1/", "robot1/optical").into_iter().chain(other.clone()).collect();
    let data = open(&messages);
    assert!(facts(data.as_ref()).contains("base_frame robot1/base_footprint"), "{}", facts(data.as_ref()));
    assert!(data.body_from_camera("color", at(0)).is_ok() && data.trajectory("odom").is_ok());
    // Images that do not say whose they are.
    let messages: Vec<Msg> = prefixed("robot1/", "optical").into_iter().chain(other).collect();
    let text = open(&messages).body_from_camera("color", at(0)).unwrap_err().to_string();
    assert!(
        text.contains("it could be robot1/base_footprint, robot2/base_footprint (set base_frame"),
        "{text}"
    );
}

#[test]
fn namespaces_that_do_not_contradict_are_one_tree() {
    let moved = run().into_iter().map(|m| match m.topic.as_str() {
        "/tf_static" => Msg { topic: "/robot_state/tf_static".to_string(), ..m },
        _ => m,
    });
    let data = open(&moved.collect::<Vec<_>>());
    assert!(data.body_from_camera("color", at(TENTH)).is_ok());
    assert_eq!(doubts(data.as_ref()), "");
    // A relay publishes the same again.
    let again = run().into_iter().filter(|m| m.topic.starts_with("/tf"));
    let again = again.map(|m| Msg { topic: format!("/relay{}", m.topic), ..m });
    let data = open(&run().into_iter().chain(again).collect::<Vec<_>>());
    assert_eq!(data.trajectory("odom").unwrap(), open(&run()).trajectory("odom").unwrap());
    assert_eq!(doubts(data.as_ref()), "");
}

/// The run with a second source of an edge, a topic and a sensor, in the topics of the first.
fn second_source(apart: f64, offset: i64) -> Vec<Msg> {
    let mut messages = run();
    for i in 0..9_i64 {
        let t = START + i * 50_000_000 + offset;
        messages.push(tf("/tf", t, "odom", "base_footprint", At(apart, 0.0, 0.0, 0.0)));
        messages.push(odometry("/odom", t, "odom", "base_footprint", At(apart, 0.0, 0.0, 0.0)));
        messages.push(imu("/imu", t, "base_link", [0.0; 3], [apart, 0.0, 9.8]));
        messages.push(imu("/imu", t + 1_000_000, "base_link", [0.0; 3], [0.0, 0.0, 9.8]));
    }
    messages.sort_by_key(|m| m.nanos);
    messages
}

#[test]
fn two_publishers_of_one_edge_and_of_one_topic_are_noticed() {
    for (apart, offset) in [(100.0, 7_000_000), (5.0, 20_000_000), (8.0, 0)] {
        let data = open(&second_source(apart, offset));
        data.trajectory("/odom").unwrap();
        data.imu().unwrap();
        let text = doubts(data.as_ref());
        for expected in [
            "tf odom -> base_footprint: the poses jump",
            "topic /odom: the poses jump",
            "topic /imu: the accel",
        ] {
            assert!(
                text.contains(&format!("two-sources: {expected}")),
                "{expected} {apart} {offset}: {text}"
            );
        }
    }
    let data = open(&run());
    data.trajectory("/odom").unwrap();
    assert_eq!(doubts(data.as_ref()), "", "one publisher");
}

#[test]
fn sources_with_clocks_of_their_own_are_not_called_a_jump() {
    let mut messages = run();
    for i in 0..9_i64 {
        let t = START + i * 50_000_000;
        let mut other = odometry("/odom", t - 50 * TENTH, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0));
        other.nanos = t + 11_000_000;
        messages.push(other);
        let mut other = tf("/tf", t - 50 * TENTH, "odom", "base_footprint", At(0.0, 0.0, 0.0, 0.0));
        other.nanos = t + 11_000_000;
        messages.push(other);
    }
    messages.sort_by_key(|m| m.nanos);
    let data = open(&messages);
    for stream in ["odom", "/odom"] {
        let text = data.trajectory(stream).unwrap_err().to_string();
        assert!(text.contains("8 times more") && text.contains("two sources with clocks"), "{text}");
    }
}

#[test]
fn contradicting_parents_and_frames_are_said_with_their_counts() {
    let mut messages = run();
    for i in 0..5_i64 {
        let t = START + i * TENTH;
        messages.push(tf("/tf", t, "world", "base_footprint", At(9.0, 0.0, 0.0, 0.0)));
        messages.push(odometry("/odom", t, "world", "gps", At(9.0, 0.0, 0.0, 0.0)));
    }
    let data = open(&messages);
    let text = doubts(data.as_ref());
    for expected in [
        "frame base_footprint has two parents in tf, odom and world: the first is kept: by odom 9 times, by world 5 times",
        "topic /odom: 5 poses of other frames are left out: those base_footprint in odom are kept: gps in world",
    ] {
        assert!(text.contains(expected), "{expected} not in {text}");
    }
    assert_eq!(data.trajectory("/odom").unwrap().len(), 9);
}

#[test]
fn the_same_of_many_edges_is_one_line() {
    let mut messages = run();
    for i in 0..16 {
        for x in [0.0, 0.1] {
            let child = format!("link{i}");
            messages.push(tf("/tf_static", START, "base_link", &child, At(x, 0.0, 0.0, 0.0)));
        }
    }
    let text = doubts(open(&messages).as_ref());
    assert!(
        text.contains("16 fixed transforms change: the last of each is taken: base_link -> link0"),
        "{text}"
    );
    assert_eq!(text.lines().count(), 1, "{text}");
    // Said again, the same or rounded otherwise, is no change.
    let again = [0.1, 0.1 + 1e-12]
        .map(|z| tf("/tf_static", START, "base_footprint", "base_link", At(0.0, 0.0, z, 0.0)));
    assert_eq!(doubts(open(&run().into_iter().chain(again).collect::<Vec<_>>()).as_ref()), "");
}

#[test]
fn a_long_chain_of_frames_takes_no_time() {
    let mut messages = run();
    for i in 0..20_000 {
        let (parent, child) = (format!("f{i}"), format!("f{}", i + 1));
        messages.push(tf("/tf_static", START, &parent, &child, At(0.0, 0.0, 0.0, 0.0)));
    }
    let start = std::time::Instant::now();
    let data = open(&messages);
    assert!(facts(data.as_ref()).contains("trees that are not connected"));
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
}

/// A path as a SLAM publishes it: the way so far, whose earlier poses move when a loop closes.
fn paths(frame_of_poses: &str, count: usize) -> Vec<Msg> {
    let mut messages = run();
    for length in 1..=count {
        let nanos = |i: usize| START + TENTH * (1 + i as i64);
        messages.push(Msg::new("/slam/path", "nav_msgs/Path", nanos(length), |out| {
            (0..length).fold(out.header(nanos(length), "map").u32(length as u32), |out, i| {
                let moved = if length == count { 0.5 } else { 0.0 };
                out.header(nanos(i), frame_of_poses).f64s(&[i as f64 + moved, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
            })
        }));
    }
    messages.sort_by_key(|m| m.nanos);
    messages
}

#[test]
fn the_last_of_the_paths_is_a_stream() {
    for frame in ["map", ""] {
        let messages = paths(frame, 5);
        for recording in [Opened::bag(&messages), Opened::new("run.mcap", &mcap(&messages))] {
            let data = recording.open(&[]).unwrap();
            assert!(data.streams().contains(&"/slam/path".to_string()), "{:?}", data.streams());
            let path = data.trajectory("/slam/path").unwrap();
            assert_eq!((path.len(), path.start()), (5, at(TENTH)));
            assert!((path.path_length_m() - 4.0).abs() < 1e-9);
            let first = path.pose_at(at(TENTH), Span::ZERO).unwrap();
            assert!((first.translation().x - 0.5).abs() < 1e-12, "the last message moved it");
        }
    }
    // A path that is cut short is told, and stops nothing.
    let mut messages = paths("map", 5);
    let last = messages.iter_mut().rev().find(|m| m.topic == "/slam/path").unwrap();
    *last = Msg::new("/slam/path", "nav_msgs/Path", last.nanos, |out| out.header(START, "map").u32(900));
    let data = Opened::bag(&messages).open(&[]).unwrap();
    assert!(doubts(data.as_ref()).contains("/slam/path"), "{}", doubts(data.as_ref()));
}
