//! How much of a recording is fetched, and that its results are those of the file.

use crate::Desk;
use crate::files::{Shape, labels, recorded, reshaped, unpacked_bag};
use crate::server::Server;

/// Evaluates bytes as a file and from a server; gives the share of the bytes that was fetched.
fn share(name: &str, bytes: Vec<u8>, more: &[&str]) -> f64 {
    let (desk, server) = (Desk::new(), Server::start());
    let labels = labels().unwrap();
    std::fs::write(desk.path("labels.csv"), &labels).unwrap();
    std::fs::write(desk.path(name), &bytes).unwrap();
    let len = bytes.len() as u64;
    let (address, labels) = (server.put(&format!("data/{name}"), bytes), server.put("labels.csv", labels));
    let here = desk.evaluated(name, "labels.csv", more);
    let there = desk.evaluated(&address, &labels, more);
    let told = |document: &serde_json::Value| document.to_string().replace(&address, name);
    assert_eq!(told(&there), told(&here), "{name}");
    let (requests, fetched) = server.fetched(&format!("data/{name}"));
    let share = fetched as f64 / len as f64;
    eprintln!("{name}: {fetched} of {len} bytes ({:.2} %) by {requests} requests", 100.0 * share);
    // What is small was kept.
    server.forget();
    desk.evaluated(&address, &labels, more);
    assert_eq!(server.fetched("labels.csv").1, 1, "only asked for, not fetched again");
    share
}

const SLAM: [&str; 4] = ["--estimate", "slam", "--depth-check", "off"];

#[test]
fn images_of_an_mcap_file_are_not_fetched() {
    let Some(recording) = recorded() else { return };
    for (shape, name) in
        [(Shape::Mixed, "mixed.mcap"), (Shape::ByTopic, "topics.mcap"), (Shape::Loose, "loose.mcap")]
    {
        let bytes = reshaped(&recording, shape);
        assert!(bytes.len() > 40 << 20, "large images");
        let share = share(name, bytes, &SLAM);
        assert!(share < 0.05, "{name}: {share}");
    }
}

#[test]
fn depth_images_that_are_asked_for_are_fetched_and_no_others() {
    let Some(recording) = recorded() else { return };
    let share =
        share("depth.mcap", reshaped(&recording, Shape::Mixed), &["--estimate", "slam", "--depth", "zcam"]);
    assert!(share < 0.25, "{share}");
}

#[test]
fn what_is_compressed_is_fetched_once() {
    let Some(recording) = recorded() else { return };
    let fetched = share("zstd.mcap", recording, &SLAM);
    assert!(fetched < 1.05, "{fetched}");
    let path = vice_tests::shared("data/locobot/locobot_ros1.bag").unwrap();
    let bag = std::fs::read(path).unwrap();
    let plain = unpacked_bag(&bag);
    let fetched = share("bz2.bag", bag, &SLAM);
    assert!(fetched < 1.05, "{fetched}");
    let fetched = share("plain.bag", plain, &SLAM);
    assert!(fetched < 0.05, "{fetched}");
}

#[test]
fn a_recording_in_sqlite_is_staged() {
    let Some(folder) = vice_tests::shared("data/locobot/locobot_ros2_db3") else { return };
    let bytes = std::fs::read(folder.join("locobot_ros2_db3.db3")).unwrap();
    let fetched = share("run.db3", bytes, &SLAM);
    // Once for the first evaluation; the second finds it.
    assert!((0.99..1.01).contains(&fetched), "{fetched}");
}
