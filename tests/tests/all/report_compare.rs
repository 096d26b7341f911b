//! Results side by side, and what other tools read.

use std::path::Path;

use serde_json::Value;
use vice_tests::{Run, shared, shared_json, vice};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn good(run: Run) -> String {
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    run.stdout
}

fn evaluate(out: &Path, estimate: &str, more: &[&str]) -> Option<()> {
    let data = shared("data/euroc_v1_01")?;
    let labels = data.join("labels/floor.csv");
    let args =
        ["evaluate", text(&data), "--labels", text(&labels), "--estimate", estimate, "--json", text(out)];
    good(vice(&[&args[..], more].concat()));
    Some(())
}

#[test]
fn a_change_is_told_from_none_and_ci_can_fail_on_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // The truth as an estimate, on time and 50 ms late.
    if evaluate(&path("before.json"), "ground-truth", &[]).is_none() {
        return;
    }
    evaluate(&path("after.json"), "ground-truth", &["--time-offset", "0.05"]).unwrap();
    let (before, after) = (path("before.json"), path("after.json"));
    let said = good(vice(&[
        "compare",
        text(&before),
        text(&after),
        "--json",
        text(&path("c.json")),
        "--csv",
        text(&path("c.csv")),
        "--latex",
        text(&path("c.tex")),
    ]));
    assert!(said.contains("B is worse"), "{said}");
    let document: Value = serde_json::from_str(&std::fs::read_to_string(path("c.json")).unwrap()).unwrap();
    assert_eq!(
        (document["schema"].as_str().unwrap(), document["by"].as_str().unwrap()),
        ("vice.comparison/1", "runs")
    );
    let comparisons = document["comparisons"].as_array().unwrap();
    assert_eq!(comparisons.len(), 2, "the reference and the estimate");
    let estimate = &comparisons[1];
    let pooled = |file: &Path| -> f64 {
        let result: Value = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
        result["pixel"][1]["pooled_rmse_px"].as_f64().unwrap()
    };
    assert_eq!(estimate["labels"], 20);
    assert!((estimate["rmse_a_px"].as_f64().unwrap() - pooled(&before)).abs() < 1e-9);
    assert!((estimate["rmse_b_px"].as_f64().unwrap() - pooled(&after)).abs() < 1e-9);
    let low = estimate["rmse_difference_px"]["interval_95"][0].as_f64().unwrap();
    assert!(low > 0.0);
    assert_eq!(comparisons[0]["rmse_difference_px"]["value"], 0.0, "the reference is the same in both");
    assert_eq!(std::fs::read_to_string(path("c.csv")).unwrap().lines().count(), 3);
    assert!(std::fs::read_to_string(path("c.tex")).unwrap().contains("\\begin{tabular}"));

    let failed = vice(&["compare", text(&before), text(&after), "--fail-above", "0.5"]);
    assert_eq!(failed.code, 1);
    assert!(
        failed.stderr.contains("--fail-above 0.5") && failed.stdout.contains("B is worse"),
        "{}",
        failed.stderr
    );
    good(vice(&["compare", text(&after), text(&before), "--fail-above", "0.5"]));
    good(vice(&["compare", text(&before), text(&after), "--fail-above", "1000"]));
}

#[test]
fn streams_and_depths_of_one_result() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.json");
    if evaluate(&out, "imu-euler", &["--depth", "floor,zmap"]).is_none() {
        return;
    }
    let streams = good(vice(&["compare", text(&out)]));
    assert!(
        streams.contains("imu-euler with floor") && streams.contains("ground-truth (reference) with zmap"),
        "{streams}"
    );
    let depths = good(vice(&["compare", text(&out), "--by", "depths"]));
    assert!(depths.contains("imu-euler with zmap"), "{depths}");
    let runs = vice(&["compare", text(&out), "--by", "runs"]);
    assert!(runs.code == 2 && runs.stderr.contains("name two results"), "{}", runs.stderr);
    evaluate(&out, "imu-euler", &["--samples", "none"]).unwrap();
    let empty = vice(&["compare", text(&out)]);
    assert!(empty.code == 2 && empty.stderr.contains("--samples none"), "{}", empty.stderr);
    std::fs::write(&out, "{\"schema\":\"vice.result/9\"}").unwrap();
    let newer = vice(&["compare", text(&out)]);
    assert!(newer.code == 1 && newer.stderr.contains("newer VICE"), "{}", newer.stderr);
}

#[test]
fn evo_finds_its_numbers_in_the_archive() {
    let Some(oracle) = shared_json("oracle/trajectory_metrics.json") else { return };
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let (archive, plot) = (folder.path().join("svo.zip"), folder.path().join("svo.svg"));
    let (reference, estimate) =
        (data.join("mav0/state_groundtruth_estimate0/data.csv"), data.join("estimates/svo_ba.txt"));
    let args = ["trajectory", text(&reference), text(&estimate), "--align", "se3"];
    good(vice(&[&args[..], &["--evo-zip", text(&archive), "--plot", text(&plot)]].concat()));
    let bytes = std::fs::read(&archive).unwrap();
    let files = stored(&bytes);
    let file = |name: &str| files.iter().find(|f| f.0 == name).unwrap().1;
    let statistics: Value = serde_json::from_slice(file("stats.json")).unwrap();
    for (name, want) in oracle["cases"]["svo_ba"]["se3"]["ape_translation_part"].as_object().unwrap() {
        let (got, want) = (statistics[name].as_f64().unwrap(), want.as_f64().unwrap());
        assert!((got - want).abs() < 1e-9 + 1e-6 * want.abs(), "{name}: {got} {want}");
    }
    let info: Value = serde_json::from_slice(file("info.json")).unwrap();
    assert!(info["title"].as_str().unwrap().starts_with("APE w.r.t. translation part (m)"));
    let doubles = |name: &str| -> Vec<f64> {
        let array = file(name);
        assert_eq!(&array[..8], b"\x93NUMPY\x01\x00");
        let from = 10 + usize::from(u16::from_le_bytes([array[8], array[9]]));
        array[from..].chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect()
    };
    let errors = doubles("error_array.npy");
    assert_eq!(errors.len(), 142);
    let rmse = (errors.iter().map(|e| e * e).sum::<f64>() / 142.0).sqrt();
    assert!((rmse - statistics["rmse"].as_f64().unwrap()).abs() < 1e-12);
    assert_eq!(doubles("alignment_transformation_sim3.npy").len(), 16);
    assert_eq!(doubles("timestamps.npy").len(), 142);
    assert_eq!(std::str::from_utf8(file("estimate.tum")).unwrap().lines().count(), 142);
    let svg = std::fs::read_to_string(&plot).unwrap();
    assert!(
        svg.starts_with("<svg xmlns")
            && svg.contains("position error (m)")
            && svg.contains("prefers-color-scheme")
    );
}

/// Names and contents of a ZIP archive whose files are stored as they are, by its local headers (APPNOTE 4.3.7).
fn stored(bytes: &[u8]) -> Vec<(String, &[u8])> {
    let mut files = Vec::new();
    let mut at = 0;
    let u16_at = |at: usize| usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap()));
    while bytes[at..].starts_with(b"PK\x03\x04") {
        assert_eq!(u16_at(at + 8), 0, "stored");
        let size = u32::from_le_bytes(bytes[at + 18..at + 22].try_into().unwrap()) as usize;
        let (name, extra) = (u16_at(at + 26), u16_at(at + 28));
        let from = at + 30 + name + extra;
        files.push((
            String::from_utf8(bytes[at + 30..at + 30 + name].to_vec()).unwrap(),
            &bytes[from..from + size],
        ));
        at = from + size;
    }
    files
}
