//! `vice labels track`: labels that nobody placed, against what is true in rendered and in recorded pictures.

use std::path::{Path, PathBuf};

use serde_json::Value;
use vice_tests::{Run, shared, vice};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn good(run: &Run) -> &str {
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    &run.stdout
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A rendered flight of two seconds.
fn flight(folder: &Path) -> PathBuf {
    let flight = folder.join("flight");
    good(&vice(&["synth", text(&flight), "--duration", "2", "--rate", "10", "--quiet"]));
    flight
}

/// Pixel errors of labels against the true motion and measured depth, ascending.
fn errors(data: &Path, labels: &Path, depth: &str, folder: &Path) -> Vec<f64> {
    let out = folder.join("result.json");
    let args = [
        "evaluate",
        text(data),
        "--labels",
        text(labels),
        "--estimate",
        "ground-truth",
        "--reference",
        "none",
        "--depth",
        depth,
        "--json",
        text(&out),
    ];
    good(&vice(&args));
    let document = json(&out);
    let samples = document["pixel"][0]["samples"].as_array().unwrap();
    let mut errors: Vec<f64> = samples.iter().map(|s| s["error_px"].as_f64().unwrap()).collect();
    errors.sort_by(f64::total_cmp);
    errors
}

fn share_within(errors: &[f64], px: f64) -> f64 {
    errors.iter().filter(|e| **e <= px).count() as f64 / errors.len().max(1) as f64
}

/// Percent of the possible labels that are there, as the command says.
fn coverage(said: &str) -> f64 {
    let percent = said.split(" labels (").nth(1).unwrap().split(' ').next().unwrap();
    percent.parse().unwrap()
}

#[test]
fn a_rendered_flight_is_labelled_where_its_points_are() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let out = folder.path().join("auto.json");
    let run = vice(&["labels", "track", text(&flight), "--points", "20", "--out", text(&out)]);
    let said = good(&run).to_string();
    let errors = errors(&flight, &out, "zcam", folder.path());
    assert!(
        errors.len() > 150 && share_within(&errors, 1.0) >= 0.95,
        "{} {said}",
        share_within(&errors, 1.0)
    );
    assert!(coverage(&said) >= 60.0, "{said}");
    let document = json(&out);
    assert_eq!(document["points"].as_array().unwrap().len(), 20, "{said}");
    for observation in
        document["points"].as_array().unwrap().iter().flat_map(|p| p["observations"].as_array().unwrap())
    {
        assert_eq!(observation["source"], "auto");
        assert!((0.0..=1.0).contains(&observation["confidence"].as_f64().unwrap()));
        assert!(observation["tracker_version"].is_u64());
    }
    // The same bytes again; what is there is refused, or replaced where that is asked for.
    let first = std::fs::read(&out).unwrap();
    let again = vice(&["labels", "track", text(&flight), "--points", "20", "--out", text(&out)]);
    assert_eq!((again.code, std::fs::read(&out).unwrap() == first), (2, true), "{}", again.stderr);
    assert!(again.stderr.contains("--force"), "{}", again.stderr);
    good(&vice(&["labels", "track", text(&flight), "--points", "20", "--out", text(&out), "--force"]));
    assert!(std::fs::read(&out).unwrap() == first, "not the same bytes twice");
}

#[test]
fn points_for_floor_depth_lie_on_the_floor() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let out = folder.path().join("floor.csv");
    let said =
        vice(&["labels", "track", text(&flight), "--points", "8", "--depth", "floor", "--out", text(&out)]);
    assert!(good(&said).contains("floor depth"), "{}", said.stdout);
    let errors = errors(&flight, &out, "floor", folder.path());
    assert!(errors.len() > 40 && share_within(&errors, 1.5) >= 0.95, "{errors:?}");
}

#[test]
fn what_a_person_placed_stays_and_is_gone_on_from() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    // Of the exact labels, each fifth: a person's.
    let exact = std::fs::read_to_string(flight.join("labels/scene.csv")).unwrap();
    let mut lines = exact.lines();
    let head = lines.next().unwrap();
    let mut rows: Vec<&str> = lines.collect();
    rows.sort_by_key(|row| row.split(',').next().map(str::to_string));
    let point = rows[0].split(',').next().unwrap();
    let own: Vec<&str> = rows.iter().copied().filter(|r| r.split(',').next() == Some(point)).collect();
    let kept: Vec<&str> = own
        .iter()
        .enumerate()
        .filter(|(i, r)| i % 5 == 0 || r.split(',').nth(4) == Some("1"))
        .map(|(_, r)| *r)
        .collect();
    let mine = folder.path().join("mine.csv");
    std::fs::write(&mine, format!("{head}\n{}\n", kept.join("\n"))).unwrap();
    let out = folder.path().join("more.csv");
    good(&vice(&["labels", "track", text(&flight), "--from", text(&mine), "--out", text(&out)]));
    let written = std::fs::read_to_string(&out).unwrap();
    let places = |text: &str| -> Vec<(String, f64, f64)> {
        text.lines()
            .skip(1)
            .map(|l| {
                let cells: Vec<&str> = l.split(',').collect();
                (format!("{} {}", cells[0], cells[1]), cells[2].parse().unwrap(), cells[3].parse().unwrap())
            })
            .collect()
    };
    let (all, before) = (places(&written), places(&std::fs::read_to_string(&mine).unwrap()));
    for place in &before {
        assert!(all.contains(place), "{place:?} was changed");
    }
    assert!(all.len() > before.len() + 5, "{written}");
    // Those between are the exact ones, as the tracker finds them.
    let exact = places(&format!("{head}\n{}", own.join("\n")));
    let mut found: Vec<f64> = all
        .iter()
        .filter(|p| !before.contains(p))
        .filter_map(|p| exact.iter().find(|e| e.0 == p.0).map(|e| (e.1 - p.1).hypot(e.2 - p.2)))
        .collect();
    found.sort_by(f64::total_cmp);
    assert!(!found.is_empty() && share_within(&found, 1.5) >= 0.9, "{found:?}");
}

#[test]
fn what_cannot_be_labelled_is_refused_and_nothing_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let out = folder.path().join("no.json");
    let refused = |more: &[&str], code: i32, words: &str| {
        let mut args = vec!["labels", "track", text(&flight), "--out", text(&out)];
        args.extend(more);
        let run = vice(&args);
        assert_eq!(run.code, code, "{more:?}: {}", run.stderr);
        assert!(run.stderr.contains(words), "{more:?}: {}", run.stderr);
        assert_eq!(run.stderr.lines().filter(|l| l.starts_with("error")).count(), 1, "{}", run.stderr);
        assert!(!out.exists(), "{more:?}");
    };
    refused(&["--points", "0"], 2, "points");
    refused(&["--start", "500"], 2, "--start");
    refused(&["--from", "nowhere.csv"], 1, "nowhere.csv");
    refused(&["--depth", "tag"], 2, "--tag-size");
    refused(&["--depth", "zcam,zmap"], 2, "--depth");
    refused(&["--reference", "nowhere.txt"], 1, "nowhere.txt");
    // Labels of smaller images.
    let small = folder.path().join("small.xml");
    std::fs::write(
        &small,
        "<annotations><version>1.1</version><meta><task><size>20</size><original_size><width>320</width>\
         <height>240</height></original_size></task></meta>\
         <track id=\"0\" label=\"a\"><points frame=\"0\" outside=\"0\" occluded=\"0\" keyframe=\"1\" points=\"100.0,100.0\"/>\
         </track></annotations>",
    )
    .unwrap();
    refused(&["--from", text(&small)], 1, "320x240");
    // More points were placed than are asked for.
    let three = flight.join("labels/scene.csv");
    refused(&["--from", text(&three), "--points", "1"], 2, "--points");
    let out_text = text(&out).replace("no.json", "no.txt");
    let run = vice(&["labels", "track", text(&flight), "--out", &out_text]);
    assert!(run.code != 0 && run.stderr.contains(".json"), "{}", run.stderr);
    // Pictures that are gone.
    for image in std::fs::read_dir(flight.join("mav0/cam0/data")).unwrap() {
        std::fs::write(image.unwrap().path(), b"no picture").unwrap();
    }
    refused(&[], 1, "no frame can be decoded");
}

/// 95 % of what is kept within 1.5 px of where the poses have it, over whole segments, and 60 % of the point-time kept.
///
/// The poses of this recording are those of a grid of tags, found from the tags: they hold on the grid's plane, z = 0, and
/// turn by degrees about it from frame to frame, so that nothing else in view can be judged by them. So the labels start on
/// that plane, which is the floor of this world.
#[test]
fn a_hand_held_camera_is_labelled_within_a_pixel_and_a_half() {
    let Some(data) = shared("data/visp_tags_rgbd") else { return };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("auto.json");
    let run =
        vice(&["labels", "track", text(&data), "--depth", "floor", "--points", "20", "--out", text(&out)]);
    let said = good(&run).to_string();
    let errors = errors(&data, &out, "floor", folder.path());
    assert!(
        share_within(&errors, 1.5) >= 0.95,
        "{:.4} of {} {said}",
        share_within(&errors, 1.5),
        errors.len()
    );
    assert!(coverage(&said) >= 60.0, "{said}");
}

/// A run with labels that nobody made is one command; the second time they come from the cache.
#[test]
fn automatic_labels_are_made_where_an_evaluation_asks_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let cache = folder.path().join("cache");
    let evaluate = |command: &str, labels: &str, more: &[&str]| -> Run {
        let drift = flight.join("estimates/drift.txt");
        let words =
            [command, text(&flight), "--labels", labels, "--estimate", text(&drift), "--depth", "zcam"];
        std::process::Command::new(vice_tests::vice_program())
            .args(words)
            .args(more)
            .env("VICE_CACHE", &cache)
            .current_dir(folder.path())
            .output()
            .unwrap()
            .into()
    };
    let first = folder.path().join("first.json");
    let said = evaluate("evaluate", "auto:12", &[]);
    assert!(good(&said).contains("labels: automatic, 12 points"), "{}", said.stdout);
    // What was followed is told with the numbers, in words and in the document.
    for words in ["12 points, zcam", "points followed", "of the points move as one scene"] {
        assert!(said.stdout.contains(words), "`{words}` is not in: {}", said.stdout);
    }
    good(&evaluate("evaluate", "auto:12", &["--json", text(&first)]));
    let kept: Vec<_> = std::fs::read_dir(cache.join("labels")).unwrap().map(|f| f.unwrap().path()).collect();
    assert_eq!(kept.len(), 1, "{kept:?}");
    assert!(kept[0].file_name().unwrap().to_str().unwrap().contains("cam0"), "{kept:?}");
    let second = folder.path().join("second.json");
    good(&evaluate("evaluate", "auto:12", &["--json", text(&second)]));
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(), "not the same from the cache");
    assert_eq!(json(&first)["request"]["labels"]["file"], "auto:12");
    let tracking = &json(&first)["used"]["tracking"];
    let count = |name: &str| tracking[name].as_u64().unwrap_or_else(|| panic!("no {name}: {tracking}"));
    assert_eq!((count("points"), count("frames_undecoded")), (12, 0));
    assert!(count("followed") >= 60 && count("labels") <= count("labels_possible"), "{tracking}");
    assert!(tracking["one_motion"]["median_percent"].as_f64().unwrap() > 75.0, "{tracking}");
    let ended = tracking["ended"].as_object().unwrap();
    let mut named: Vec<&str> = ended.keys().map(String::as_str).collect();
    named.sort_unstable();
    assert_eq!(named, ["doubtful", "left_image", "lost", "moved_apart", "no_way_back"]);
    let by_hand = folder.path().join("by_hand.json");
    good(&evaluate("evaluate", text(&flight.join("labels/scene.csv")), &["--json", text(&by_hand)]));
    assert!(json(&by_hand)["used"]["tracking"].is_null(), "labels of a file were not tracked by VICE now");
    // What is broken is made anew, and the same.
    std::fs::write(&kept[0], b"{").unwrap();
    good(&evaluate("evaluate", "auto:12", &["--json", text(&second)]));
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap());
    let verdict = evaluate("diagnose", "auto:12", &[]);
    assert!(good(&verdict).starts_with("labels: automatic, 12 points"), "{}", verdict.stdout);
    let wrong = evaluate("evaluate", "auto:0", &[]);
    assert_eq!(wrong.code, 2, "{}", wrong.stderr);
    assert!(wrong.stderr.contains("--labels") && wrong.stderr.contains("auto:4"), "{}", wrong.stderr);
    // With another depth other labels are made.
    good(&evaluate("evaluate", "auto:12", &["--depth", "floor"]));
    assert_eq!(std::fs::read_dir(cache.join("labels")).unwrap().count(), 2);
}

#[test]
fn two_labellers_are_compared_and_their_noise_goes_into_the_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let exact = flight.join("labels/scene.csv");
    // Another person: off to and fro by a pixel.
    let text_of = std::fs::read_to_string(&exact).unwrap();
    let moved = text_of.lines().enumerate().map(|(i, line)| {
        let mut cells: Vec<String> = line.split(',').map(str::to_string).collect();
        if i > 0 {
            let off = if i % 2 == 0 { 1.0 } else { -1.0 };
            cells[2] = (cells[2].parse::<f64>().unwrap() + off).to_string();
        }
        cells.join(",")
    });
    let other = folder.path().join("other.csv");
    std::fs::write(&other, moved.collect::<Vec<_>>().join("\n") + "\n").unwrap();
    let (noise, plot) = (folder.path().join("noise.json"), folder.path().join("noise.svg"));
    let outputs = ["--json", text(&noise), "--plot", text(&plot)];
    let run = vice(&[&["labels", "compare", text(&exact), text(&other)][..], &outputs].concat());
    assert!(good(&run).contains("floor under RMSE_2D"), "{}", run.stdout);
    let compared = json(&noise);
    assert!((compared["all"]["median_px"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{compared}");
    let floor = compared["floor_px"].as_f64().unwrap();
    assert!(floor > 0.5 && floor < 1.5, "{floor}");
    assert!(std::fs::read_to_string(&plot).unwrap().starts_with("<svg"));
    let out = folder.path().join("result.json");
    let drift = flight.join("estimates/drift.txt");
    let asked = |more: &[&str]| -> Value {
        let words = [
            "evaluate",
            text(&flight),
            "--labels",
            text(&exact),
            "--estimate",
            text(&drift),
            "--json",
            text(&out),
        ];
        good(&vice(&[&words[..], more].concat()));
        json(&out)
    };
    let (without, with) = (asked(&[]), asked(&["--label-noise", text(&noise)]));
    assert_eq!(with["used"]["label_noise_px"], compared["floor_px"]);
    let part = |document: &Value| {
        document["pixel"].as_array().unwrap().iter().find(|p| p["stream"] == "drift").unwrap().clone()
    };
    let (before, after) = (part(&without), part(&with));
    assert_eq!(before["pooled_rmse_px"], after["pooled_rmse_px"]);
    if let Some(low) = before["interval_95"][0].as_f64() {
        let expected = (low * low - floor * floor).max(0.0).sqrt();
        assert!((after["interval_95"][0].as_f64().unwrap() - expected).abs() < 1e-9, "{after}");
        assert_eq!(before["interval_95"][1], after["interval_95"][1]);
    }
    let wrong = vice(&[
        "evaluate",
        text(&flight),
        "--labels",
        text(&exact),
        "--estimate",
        text(&drift),
        "--label-noise",
        text(&exact),
    ]);
    assert!(wrong.code == 2 && wrong.stderr.contains("vice labels compare"), "{}", wrong.stderr);
}

#[test]
fn tracks_of_other_tools_become_labels() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let frames = 20;
    let mut header = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({frames}, 1, 2), }}");
    header.push_str(&" ".repeat((64 - (11 + header.len()) % 64) % 64));
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    (0..frames)
        .for_each(|i| bytes.extend([100.0 + i as f32, 50.0].iter().flat_map(|v: &f32| v.to_le_bytes())));
    let (tracks, out) = (folder.path().join("tracks.npy"), folder.path().join("out.json"));
    std::fs::write(&tracks, &bytes).unwrap();
    let convert =
        |more: &[&str]| vice(&[&["labels", "convert", text(&tracks), text(&out)][..], more].concat());
    good(&convert(&["--dataset", text(&flight), "--tool", "CoTracker3"]));
    let document = json(&out);
    assert_eq!(document["tool"], "CoTracker3");
    let observations = document["points"][0]["observations"].as_array().unwrap();
    assert_eq!(observations.len(), frames as usize);
    assert_eq!(
        (&observations[3]["px"][0], &observations[3]["source"]),
        (&Value::from(103.0), &Value::from("auto"))
    );
    let fewer = convert(&["--dataset", text(&flight), "--force", "--duration", "1"]);
    assert!(
        fewer.code == 1 && fewer.stderr.contains("20 frames") && fewer.stderr.contains("--fps"),
        "{}",
        fewer.stderr
    );
    let nothing = convert(&["--force"]);
    assert!(nothing.code == 2 && nothing.stderr.contains("--dataset"), "{}", nothing.stderr);
    let labels = flight.join("labels/scene.csv");
    let wrong = vice(&["labels", "convert", text(&labels), text(&out), "--force", "--tool", "x"]);
    assert!(wrong.code == 2 && wrong.stderr.contains("--tool"), "{}", wrong.stderr);
    // Where labels are asked for, the way there is told.
    let direct = vice(&["evaluate", text(&flight), "--labels", text(&tracks), "--estimate", "ground-truth"]);
    assert!(direct.code == 1 && direct.stderr.contains("vice labels convert"), "{}", direct.stderr);
}

/// Automatic labels and exact ones of the same points and segments say the same of each estimate: a small sample of
/// `tests/verdict/auto_labels.py`, which judges five flights of 30 s by ten estimates each.
#[test]
fn automatic_labels_give_the_verdict_of_exact_ones() {
    let folder = tempfile::tempdir().unwrap();
    let flight = flight(folder.path());
    let followed = folder.path().join("followed.json");
    good(&vice(&["labels", "track", text(&flight), "--points", "20", "--out", text(&followed)]));
    // Where the true poses carry each key frame's point.
    let true_places = folder.path().join("true.json");
    let truth = ["--estimate", "ground-truth", "--reference", "none", "--depth", "zcam", "--json"];
    good(&vice(
        &[&["evaluate", text(&flight), "--labels", text(&followed)][..], &truth, &[text(&true_places)]]
            .concat(),
    ));
    let samples = json(&true_places)["pixel"][0]["samples"].clone();
    let place = |point: &Value, stamp: &Value| {
        let list = samples.as_array().unwrap();
        list.iter()
            .find(|s| s["point"] == *point && s["timestamp_ns"] == *stamp)
            .map(|s| s["tracked_px"].clone())
    };
    let (mut auto, mut exact) = (json(&followed), json(&followed));
    for (document, moved) in [(&mut auto, false), (&mut exact, true)] {
        for point in document["points"].as_array_mut().unwrap() {
            let name = point["name"].clone();
            let observations = point["observations"].as_array_mut().unwrap();
            observations.retain_mut(|o| match place(&name, &o["timestamp_ns"]) {
                Some(px) => {
                    if moved {
                        o["px"] = px;
                    }
                    true
                }
                None => o["keyframe"] == true,
            });
        }
    }
    let rmse = |name: &str, document: &Value| -> Vec<(String, f64)> {
        let (labels, out) = (folder.path().join(name), folder.path().join(format!("{name}.result")));
        std::fs::write(&labels, document.to_string()).unwrap();
        let estimates: Vec<String> = ["drift", "clock-offset", "wrong-extrinsic", "white-noise"]
            .map(|e| text(&flight.join(format!("estimates/{e}.txt"))).to_string())
            .to_vec();
        let words =
            ["evaluate", text(&flight), "--labels", text(&labels), "--estimate", &estimates.join(",")];
        good(&vice(&[&words[..], &["--depth", "zcam", "--json", text(&out)]].concat()));
        let parts = json(&out)["pixel"].as_array().unwrap().clone();
        let judged = parts.iter().filter(|p| p["role"] == "estimate");
        let mut rmse: Vec<(String, f64)> = judged
            .map(|p| (p["stream"].as_str().unwrap().to_string(), p["pooled_rmse_px"].as_f64().unwrap()))
            .collect();
        rmse.sort_by(|a, b| a.1.total_cmp(&b.1));
        rmse
    };
    let (auto, exact) = (rmse("auto.json", &auto), rmse("exact.json", &exact));
    assert_eq!(auto.len(), 4);
    for ((name, by_auto), (exact_name, by_exact)) in auto.iter().zip(&exact) {
        assert_eq!(name, exact_name, "in another order: {auto:?} {exact:?}");
        let far_px = (by_auto - by_exact).abs();
        assert!(far_px <= (0.05 * by_exact).max(0.3), "{name}: {by_auto} px, by exact labels {by_exact} px");
    }
}
