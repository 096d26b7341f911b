//! Data in a bucket, of a server that speaks S3.
//!
//! `.ci/remote` starts one on this machine and says where it is; without it these tests are skipped and say so.

use std::path::Path;
use std::process::Command;

use crate::Desk;
use crate::files::{Shape, labels, recorded, reshaped};

/// Where the server is, and what it needs to hear. It has a bucket `flights`.
fn desk() -> Option<Desk> {
    let Ok(server) = std::env::var("VICE_TEST_S3") else {
        eprintln!("skipped: there is no S3 server (VICE_TEST_S3 names its address; .ci/remote starts one)");
        return None;
    };
    Some(
        Desk::new()
            .with("AWS_ENDPOINT_URL", &server)
            .with("AWS_ALLOW_HTTP", "true")
            .with("AWS_REGION", "us-east-1")
            .with("AWS_ACCESS_KEY_ID", "testing")
            .with("AWS_SECRET_ACCESS_KEY", "hushhush"),
    )
}

/// Puts a file or folder into the bucket.
fn put(from: &Path, key: &str) {
    let python = std::env::var("VICE_TEST_PYTHON").unwrap();
    let script = "import boto3, os, pathlib, sys\n\
        s3 = boto3.client('s3', endpoint_url=os.environ['VICE_TEST_S3'], region_name='us-east-1',\n\
            aws_access_key_id='testing', aws_secret_access_key='hushhush')\n\
        start = pathlib.Path(sys.argv[1])\n\
        for path in [start] if start.is_file() else sorted(p for p in start.rglob('*') if p.is_file()):\n\
        \x20   below = '' if start.is_file() else '/' + path.relative_to(start).as_posix()\n\
        \x20   s3.upload_file(str(path), 'flights', sys.argv[2] + below)\n";
    let status = Command::new(python).args(["-c", script]).arg(from).arg(key).status().unwrap();
    assert!(status.success());
}

#[test]
fn a_recording_in_a_bucket_is_read_by_ranges() {
    let (Some(desk), Some(recording), Some(labels)) = (desk(), recorded(), labels()) else { return };
    std::fs::write(desk.path("run.mcap"), reshaped(&recording, Shape::Mixed)).unwrap();
    std::fs::write(desk.path("labels.csv"), labels).unwrap();
    put(&desk.path("run.mcap"), "a/run.mcap");
    put(&desk.path("labels.csv"), "a/labels.csv");
    let more = ["--estimate", "slam", "--depth-check", "off"];
    let here = desk.evaluated("run.mcap", "labels.csv", &more);
    assert_eq!(desk.evaluated("s3://flights/a/run.mcap", "s3://flights/a/labels.csv", &more), here);
    let kept = walk(&desk.path("cache"));
    assert!(kept.iter().any(|(name, bytes)| name.ends_with("run.mcap") && *bytes == 0), "{kept:?}");
    // A folder with nothing else in it is that recording.
    let info = desk.vice(&["info", "s3://flights/a/"]);
    assert_eq!(info.code, 0, "{}", info.stderr);
    assert!(info.stdout.contains("frames: 30"), "{}", info.stdout);
}

#[test]
fn a_folder_is_staged_without_its_images_which_are_fetched_where_they_are_read() {
    let Some(desk) = desk() else { return };
    let run = desk.vice(&["synth", "flight", "--duration", "3", "--rate", "5"]);
    assert_eq!(run.code, 0, "{}", run.stderr);
    put(&desk.path("flight"), "b/flight");
    let more = ["--estimate", "imu-euler", "--depth", "floor,zmap"];
    let here = desk.evaluated("flight", "flight/labels/scene.csv", &more);
    let address = "s3://flights/b/flight";
    let there = desk.evaluated(address, &format!("{address}/labels/scene.csv"), &more);
    let told = |d: &serde_json::Value| d.to_string().replace(address, "flight");
    assert_eq!(told(&there), told(&here));
    let kept = walk(&desk.path("cache"));
    let images: Vec<_> = kept.iter().filter(|(name, _)| name.ends_with(".png")).collect();
    assert!(!images.is_empty() && images.iter().all(|(_, bytes)| *bytes == 0), "{images:?}");
    let film = desk.vice(&["labels", "detect", address, "--out", "found.csv", "--target", "tags"]);
    let local = desk.vice(&["labels", "detect", "flight", "--out", "here.csv", "--target", "tags"]);
    assert_eq!((film.code, film.stderr.replace(address, "flight")), (local.code, local.stderr));
}

#[test]
fn a_flight_brings_what_lies_above_it_and_its_films_only_for_pictures() {
    let (Some(desk), Some(data)) = (desk(), vice_tests::shared("data/blackbird")) else { return };
    put(&data, "c/blackbird");
    let (below, labels) = ("picasso/yawForward/maxSpeed1p0", "labels.csv");
    let (near, far) = (data.to_string_lossy().into_owned(), "s3://flights/c/blackbird");
    let more = ["--estimate", "imu-euler", "--depth", "floor,zcam"];
    let here = desk.evaluated(&format!("{near}/{below}"), &format!("{near}/{labels}"), &more);
    let there = desk.evaluated(&format!("{far}/{below}"), &format!("{far}/{labels}"), &more);
    assert_eq!(there.to_string().replace(far, &near), here.to_string());
    let sizes = |ending: &str| {
        let files = walk(&desk.path("cache")).into_iter().filter(|(name, _)| name.ends_with(ending));
        files.map(|(_, bytes)| bytes).collect::<Vec<_>>()
    };
    assert_eq!(sizes("/trajectoryOffsets.yaml").len(), 1, "it lies three folders above");
    assert_eq!(sizes(".mov"), [0, 0], "their indices were read where they are");
    if Command::new("ffmpeg").arg("-version").output().is_err() {
        eprintln!("skipped: without FFmpeg there are no pictures of a film");
        return;
    }
    let page = ["--report", "page.html", more[0], more[1]];
    desk.evaluated(&format!("{far}/{below}"), &format!("{far}/{labels}"), &page);
    let mut films = sizes(".mov");
    films.sort_unstable();
    assert!(films[0] == 0 && films[1] > 0, "the one whose pictures are shown: {films:?}");
}

#[test]
fn what_is_not_in_a_bucket_is_said() {
    let Some(desk) = desk() else { return };
    let run = desk.vice(&["info", "s3://flights/no/such"]);
    assert_eq!(run.code, 1);
    assert!(run.stderr.contains("s3://flights/no/such: no such object, and none below it"), "{}", run.stderr);
    let run = desk.vice(&["info", "s3://nobucket/x.mcap"]);
    assert_eq!((run.code, run.stderr.contains("hushhush")), (1, false), "{}", run.stderr);
}

/// All files below a folder with their sizes.
fn walk(folder: &Path) -> Vec<(String, u64)> {
    let mut files = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        match entry.metadata().unwrap() {
            meta if meta.is_dir() => files.extend(walk(&entry.path())),
            meta => files.push((entry.path().display().to_string(), meta.len())),
        }
    }
    files
}
