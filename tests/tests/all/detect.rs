//! Targets in real images, against OpenCV (tests/oracles/targets.py), and `vice labels detect` as a program.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::ControlFlow;

use serde_json::Value;
use vice_core::camera::Pixel;
use vice_core::dataset::{DatasetFactory, OpenOptions};
use vice_core::label::{LabelSet, ObservationSource};
use vice_core::statistics::{quantile, sorted};
use vice_core::time::Stamp;
use vice_detect::{BoardSize, DetectOptions, Detection, TagFamily, TagOptions, detect_labels};
use vice_euroc::Euroc;
use vice_tests::{Run, shared, vice};

fn oracle() -> Value {
    serde_json::from_str(include_str!("../../oracles/targets.json")).unwrap()
}

fn detect(options: &DetectOptions) -> Option<Detection> {
    let path = shared("data/euroc_v1_01")?;
    let dataset = Euroc.open(&path, &OpenOptions::default()).unwrap();
    let camera = dataset.camera("cam0").unwrap();
    let frames: Vec<usize> = (0..dataset.frames("cam0").unwrap().len()).collect();
    Some(
        detect_labels(dataset.as_ref(), "cam0", &camera, &frames, options, &|_, _| ControlFlow::Continue(()))
            .unwrap(),
    )
}

fn tags(family: TagFamily) -> DetectOptions {
    DetectOptions { tags: Some(TagOptions { family, border: None }), ..DetectOptions::default() }
}

/// Pixels by frame and point.
fn by_frame(labels: &LabelSet) -> BTreeMap<Stamp, BTreeMap<&str, Pixel>> {
    let mut frames: BTreeMap<Stamp, BTreeMap<&str, Pixel>> = BTreeMap::new();
    for point in labels.points() {
        for o in &point.observations {
            assert_eq!(o.source, ObservationSource::Detected);
            frames.entry(o.stamp).or_default().insert(&point.name, o.px);
        }
    }
    frames
}

#[test]
fn cells_of_tags_are_those_of_opencv() {
    let oracle = oracle();
    for (family, markers) in oracle["markers"].as_object().unwrap() {
        let family: TagFamily = family.parse().unwrap();
        for (id, cells) in markers.as_object().unwrap() {
            // OpenCV holds them turned by half.
            let theirs: Vec<bool> = cells.as_str().unwrap().bytes().rev().map(|b| b == b'1').collect();
            assert_eq!(family.cells(id.parse().unwrap(), 0), Some(theirs), "{family:?} {id}");
        }
    }
}

#[test]
fn the_board_of_euroc_is_found_where_opencv_finds_it() {
    let options = DetectOptions { board: Some(BoardSize::new(6, 7).unwrap()), ..DetectOptions::default() };
    let Some(found) = detect(&options) else { return };
    let frames = by_frame(&found.labels);
    let oracle = oracle();
    let boards = oracle["boards"].as_object().unwrap();
    assert_eq!(boards.len(), 31);
    let mut off = Vec::new();
    let mut missed = 0;
    for (stamp, corners) in boards {
        let Some(ours) = frames.get(&Stamp::parse_nanos(stamp).unwrap()) else {
            missed += 1;
            continue;
        };
        assert_eq!(ours.len(), 42);
        let theirs: Vec<f64> = serde_json::from_value(corners.clone()).unwrap();
        // OpenCV's first corner is the last but for the turn by half: the board's names never flip.
        for (i, c) in theirs.chunks_exact(2).enumerate() {
            let at = 41 - i;
            let px = ours[format!("board.r{}c{}", at / 6, at % 6).as_str()];
            off.push(px.distance_px(Pixel::new(c[0], c[1])));
        }
    }
    assert!(missed <= 1, "{missed} of 31 frames missed");
    let off = sorted(off);
    let part = |p: f64| quantile(&off, p).unwrap();
    // This function of OpenCV's draws the outermost corners outwards (docs/detect.md): they are among the last twentieth.
    assert!(part(0.5) < 0.1 && part(0.95) < 0.3, "median {} px, 95 % {} px", part(0.5), part(0.95));

    // The corners of labels/board.csv are such outermost ones, so that they are held to where OpenCV's cornerSubPix, which
    // does not draw them outwards, refines them to.
    let refined: Vec<(String, f64, f64)> = serde_json::from_value(oracle["refined"].clone()).unwrap();
    assert_eq!(refined.len(), 28);
    let nearest = |(stamp, u, v): &(String, f64, f64)| {
        let corners = frames[&Stamp::parse_nanos(stamp).unwrap()].values();
        corners.map(|px| px.distance_px(Pixel::new(*u, *v))).fold(f64::MAX, f64::min)
    };
    let off = sorted(refined.iter().map(nearest).collect());
    assert!(off[14] < 0.1 && off[27] < 0.3, "median {} px, most {} px", off[14], off[27]);

    // The corners that people labelled are the same ones in every frame.
    let labels =
        vice_files::labels::read(shared("data/euroc_v1_01/labels/board.csv").unwrap(), None).unwrap();
    for point in labels.points() {
        let names: BTreeSet<&str> = point
            .observations
            .iter()
            .filter_map(|o| {
                let near = |a: &(&&str, &Pixel)| a.1.distance_px(o.px);
                frames[&o.stamp].iter().min_by(|a, b| near(a).total_cmp(&near(b))).map(|(name, _)| *name)
            })
            .collect();
        assert_eq!(names.len(), 1, "{}: {names:?}", point.name);
    }
}

#[test]
fn the_tags_of_euroc_are_found_and_no_others() {
    let Some(found) = detect(&tags(TagFamily::T36h11)) else { return };
    let frames = by_frame(&found.labels);
    let best = &frames[&Stamp::from_nanos(1_403_715_305_512_143_104)];
    assert!(best.len() >= 4 * 17, "{} corners", best.len());
    // The grid has the tags 0 to 35, six a row, and leans on things in two parts of the flight.
    let in_view = |s: &Stamp| {
        let seconds = s.as_nanos() / 1_000_000_000 - 1_403_715_000;
        (303..=305).contains(&seconds) || (395..=401).contains(&seconds)
    };
    assert!(frames.keys().all(in_view), "{:?}", frames.keys().filter(|s| !in_view(s)).collect::<Vec<_>>());
    for (stamp, corners) in &frames {
        for (name, px) in corners {
            let (tag, corner) = name.strip_prefix("tag").unwrap().split_once(".c").unwrap();
            let tag: usize = tag.parse().unwrap();
            assert!(tag < 36, "{stamp}: {name}");
            // The tag to the right has its corner beyond, in the direction that the tag's own upper edge has.
            let next = corners.get(format!("tag{}.c{corner}", tag + 1).as_str()).filter(|_| tag % 6 < 5);
            let edge =
                (corners.get(format!("tag{tag}.c0").as_str()), corners.get(format!("tag{tag}.c1").as_str()));
            if let (Some(next), (Some(c0), Some(c1))) = (next, edge) {
                let (du, dv) = (c1.u - c0.u, c1.v - c0.v);
                let steps = ((next.u - px.u) * du + (next.v - px.v) * dv) / (du * du + dv * dv);
                let off = ((next.u - px.u) * dv - (next.v - px.v) * du).abs() / du.hypot(dv);
                assert!((1.1..1.6).contains(&steps) && off < 3.0, "{stamp}: {name}: {steps} {off}");
            }
        }
    }
    for family in [TagFamily::T25h9, TagFamily::T16h5] {
        let Some(none) = detect(&tags(family)) else { return };
        assert_eq!(none.report.tags, 0, "{family:?}");
    }
}

#[test]
fn threads_do_not_change_labels_and_the_best_spread_are_kept() {
    let mut options = tags(TagFamily::T36h11);
    let Some(all) = detect(&options) else { return };
    let one = std::thread::spawn(move || {
        let pool = rayon_pool();
        pool.install(|| detect(&options)).unwrap()
    });
    assert_eq!(all.labels, one.join().unwrap().labels);
    options.select = Some(5);
    let few = detect(&options).unwrap();
    assert_eq!(few.labels.points().len(), 5);
}

fn rayon_pool() -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap()
}

fn text(path: std::path::PathBuf) -> String {
    path.to_str().unwrap().to_string()
}

fn refused(run: &Run, code: i32, words: &[&str]) {
    assert_eq!(run.code, code, "{}{}", run.stdout, run.stderr);
    let errors = run.stderr.lines().filter(|l| l.starts_with("error")).count();
    assert!(errors == 1 && !run.stderr.contains("panicked"), "{}", run.stderr);
    for word in words {
        assert!(run.stderr.contains(word), "`{word}` is not in: {}", run.stderr);
    }
}

#[test]
fn a_detected_board_evaluates_an_estimate() {
    let Some(data) = shared("data/euroc_v1_01").map(text) else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path().join("board.json"));
    let run = vice(&["labels", "detect", &data, "--chessboard", "6x7", "--out", &out]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let document = text(folder.path().join("result.json"));
    let options = ["--estimate", "imu-euler", "--depth", "zmap", "--json", &document];
    let mut args = vec!["evaluate", &data, "--labels", &out];
    args.extend(options);
    let run = vice(&args);
    // Within minutes the integrated IMU is so far off that most of the board is behind its camera: said, not refused.
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stderr.contains("imu-euler (zmap depth) carries"), "{}", run.stderr);
    let result: Value = serde_json::from_str(&fs::read_to_string(&document).unwrap()).unwrap();
    let truth = &result["pixel"][0];
    assert!(truth["scored"].as_u64().unwrap() > 100, "{truth}");
    // The board does not move: carried along by the ground truth, its corners stay where they are found.
    assert!(truth["pooled_rmse_px"].as_f64().unwrap() < 20.0, "{}", truth["pooled_rmse_px"]);

    // What is there stays: a file is refused, or added to without a change to what a human placed.
    refused(&vice(&["labels", "detect", &data, "--chessboard", "6x7", "--out", &out]), 2, &["--add"]);
    let mine = text(folder.path().join("mine.csv"));
    fs::write(&mine, "point,timestamp_ns,u_px,v_px,keyframe\nboard.r0c0,1403715280562142976,1,2,1\n")
        .unwrap();
    let run = vice(&[
        "labels",
        "detect",
        &data,
        "--chessboard",
        "6x7",
        "--duration",
        "12",
        "--out",
        &mine,
        "--add",
    ]);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    let labels = vice_files::labels::read(&mine, None).unwrap();
    assert_eq!(labels.points().len(), 42);
    let kept =
        labels.points()[0].observations.iter().find(|o| o.source == ObservationSource::Manual).unwrap();
    assert_eq!((kept.px, labels.points()[0].observations.len() > 1), (Pixel::new(1.0, 2.0), true));
}

#[test]
fn what_cannot_be_found_is_said_and_nothing_is_written() {
    let Some(data) = shared("data/euroc_v1_01").map(text) else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = text(folder.path().join("out.json"));
    let run = |more: &[&str]| {
        let mut args = vec!["labels", "detect", &data, "--out", &out, "--duration", "10"];
        args.extend(more);
        vice(&args)
    };
    refused(&run(&["--apriltag", "36h11"]), 1, &["no tag 36h11 in view in 6 frames"]);
    refused(&run(&["--apriltag", "99h1"]), 2, &["99h1", "36h11, 25h9, 16h5"]);
    refused(&run(&["--chessboard", "5x6"]), 1, &["5x6", "--chessboard 6x7?"]);
    refused(&run(&["--chessboard", "2x9"]), 2, &["2x9"]);
    refused(&run(&["--chessboard", "big"]), 2, &["big", "6x7"]);
    refused(&run(&[]), 2, &["--apriltag"]);
    refused(&run(&["--chessboard", "6x7", "--border-bits", "3"]), 2, &["3"]);
    refused(&run(&["--chessboard", "6x7", "--start", "1000"]), 2, &["--start"]);
    assert!(!std::path::Path::new(&out).exists());

    // An image that cannot be decoded is skipped and counted.
    let copy = folder.path().join("copy");
    let from = shared("data/euroc_v1_01/mav0/cam0").unwrap();
    fs::create_dir_all(copy.join("mav0/cam0/data")).unwrap();
    for name in ["sensor.yaml", "data.csv"] {
        fs::copy(from.join(name), copy.join("mav0/cam0").join(name)).unwrap();
    }
    for image in fs::read_dir(from.join("data")).unwrap() {
        let image = image.unwrap();
        fs::copy(image.path(), copy.join("mav0/cam0/data").join(image.file_name())).unwrap();
    }
    fs::write(copy.join("mav0/cam0/data/1403715280612143104.jpg"), "no image").unwrap();
    let args = [
        "labels",
        "detect",
        copy.to_str().unwrap(),
        "--chessboard",
        "6x7",
        "--duration",
        "10",
        "--out",
        &out,
    ];
    let run = vice(&args);
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    assert!(run.stderr.contains("1 frames could not be decoded"), "{}", run.stderr);
    assert!(run.stdout.starts_with("5 frames, 5 with the chessboard"), "{}", run.stdout);
}

/// OpenCV's own example photographs: the surroundings hang on to the board in most of them.
#[test]
fn boards_are_found_in_all_photographs_of_opencv() {
    let Some(data) = shared("data/chess_opencv") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("board.json");
    let detect = |size: &str| {
        let words = [
            "labels",
            "detect",
            data.to_str().unwrap(),
            "--chessboard",
            size,
            "--out",
            out.to_str().unwrap(),
        ];
        vice(&words)
    };
    // A part of the board is no board, and nothing is written.
    for part in ["6x5", "8x6", "9x5", "10x7"] {
        let run = detect(part);
        assert!(run.code == 1 && !out.exists(), "{part}: {}{}", run.stdout, run.stderr);
    }
    let run = detect("9x6");
    assert_eq!(run.code, 0, "{}", run.stderr);
    assert!(run.stdout.contains("13 with the chessboard"), "{}", run.stdout);
}
