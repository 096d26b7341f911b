//! The page, and the results it is made of.

use std::path::Path;

use serde_json::Value;
use vice_tests::{Run, shared, vice, vice_in};

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn good(run: Run) -> String {
    assert_eq!(run.code, 0, "{}{}", run.stdout, run.stderr);
    run.stdout
}

/// A result of the real flight, and the page made with it.
fn evaluated(folder: &Path) -> Option<(Value, String, String)> {
    let data = shared("data/euroc_v1_01")?;
    let (json, html) = (folder.join("out.json"), folder.join("report.html"));
    let labels = data.join("labels/floor.csv");
    let args = [
        "evaluate",
        text(&data),
        "--labels",
        text(&labels),
        "--estimate",
        "imu-euler",
        "--depth",
        "floor,zmap",
    ];
    let table = good(vice(&[&args[..], &["--json", text(&json), "--report", text(&html)]].concat()));
    let document = serde_json::from_str(&std::fs::read_to_string(&json).unwrap()).unwrap();
    Some((document, table, std::fs::read_to_string(&html).unwrap()))
}

#[test]
fn the_page_stands_alone_and_its_numbers_are_the_tables() {
    let folder = tempfile::tempdir().unwrap();
    let Some((document, table, page)) = evaluated(folder.path()) else { return };
    for forbidden in ["http://", "https://", "unsafe-inline", " style=", " onload=", "<link", "@import"] {
        assert!(!page.contains(forbidden), "{forbidden} is in the page");
    }
    assert!(page.contains("Content-Security-Policy") && page.contains("default-src 'none'"));
    assert!(
        page.contains("prefers-color-scheme:dark")
            && page.contains("@media print")
            && page.contains("width=device-width")
    );
    // Each cell `mean±std` of the table on the terminal is a cell of the page, as are the pooled numbers.
    let cells: Vec<&str> = table.split_whitespace().filter(|c| c.contains('±') && c.len() > 3).collect();
    assert!(cells.len() >= 12, "{table}");
    for cell in cells {
        assert!(page.contains(&format!(">{cell}</td>")), "{cell} is not in the page");
    }
    for part in document["pixel"].as_array().unwrap() {
        let pooled = format!(">{:.3}</td>", part["pooled_rmse_px"].as_f64().unwrap());
        assert!(page.contains(&pooled), "{pooled}");
    }
    let embedded = page.split("class=\"result\">").nth(1).unwrap().split("</script>").next().unwrap();
    let embedded: Value = serde_json::from_str(embedded).unwrap();
    assert_eq!(embedded["pixel"][1]["rmse_px"], document["pixel"][1]["rmse_px"]);
    assert_eq!(embedded["trajectory"][0]["rmse_3d_m"], document["trajectory"][0]["rmse_3d_m"]);
    // Each labelled frame as a small picture and once more to draw vectors on, and the worst at full resolution.
    let pictures = page.matches("data:image/jpeg;base64,").count();
    let moments = page.matches("class=\"moment\"").count();
    assert_eq!(pictures, document_frames(&document) + 1 + moments);
    assert!((3..=10).contains(&moments), "{moments}");
    // The first screen, by diagnosis and checks.
    assert!(
        page.contains("Can imu-euler be trusted?")
            && page.contains("What is wrong")
            && page.contains("initial tilt")
    );
    assert!(page.contains(" checks</h3>"));
    assert!(page.matches("<svg class=\"plot\"").count() >= 10);
    assert_eq!(page.matches("<figure>").count(), page.matches("<svg class=\"plot\"").count());
    assert!(page.contains("vice evaluate "));
}

fn document_frames(document: &Value) -> usize {
    let part = &document["pixel"][0];
    let stamps = ["samples", "keyframes"].into_iter().flat_map(|list| part[list].as_array().unwrap());
    stamps.map(|s| s["timestamp_ns"].as_i64().unwrap()).collect::<std::collections::BTreeSet<_>>().len()
}

#[test]
fn results_become_a_page_later_with_or_without_their_images() {
    let folder = tempfile::tempdir().unwrap();
    let Some((mut document, _, page)) = evaluated(folder.path()) else { return };
    let path = |name: &str| folder.path().join(name);
    good(vice(&["report", text(&path("out.json")), "--out", text(&path("later.html"))]));
    assert_eq!(
        std::fs::read_to_string(path("later.html")).unwrap(),
        page,
        "the same page from the document alone"
    );
    // The data set has moved: the page is made without images and says so.
    let data = document["request"]["dataset"]["path"].as_str().unwrap().to_string();
    document["request"]["dataset"]["path"] = "no/such/place".into();
    std::fs::write(path("moved.json"), document.to_string()).unwrap();
    let run = vice(&["report", text(&path("moved.json")), "--out", text(&path("moved.html"))]);
    assert!(run.stderr.contains("no/such/place") && run.stderr.contains("--dataset"), "{}", run.stderr);
    good(run);
    let moved = std::fs::read_to_string(path("moved.html")).unwrap();
    assert!(
        moved.contains("No images to draw on")
            && moved.contains("no/such/place")
            && !moved.contains("data:image")
    );
    good(vice(&[
        "report",
        text(&path("moved.json")),
        "--out",
        text(&path("found.html")),
        "--dataset",
        &data,
    ]));
    assert!(std::fs::read_to_string(path("found.html")).unwrap().contains("data:image"));
    // Two runs on one page.
    good(vice(&[
        "report",
        text(&path("out.json")),
        text(&path("moved.json")),
        "--out",
        text(&path("both.html")),
    ]));
    let both = std::fs::read_to_string(path("both.html")).unwrap();
    assert!(both.contains("2 runs") && both.contains("href=\"#run1\""));
}

/// A result of a small flight without a diagnosis of which nothing is claimed.
#[test]
fn a_page_says_when_it_was_made_only_if_asked_and_claims_nothing_without_a_diagnosis() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let page = |name: &str, more: &[&str]| {
        let (html, labels) = (folder.path().join(name), data.join("labels/floor.csv"));
        let args =
            ["evaluate", text(&data), "--labels", text(&labels), "--estimate", "imu-euler", "--no-diagnosis"];
        good(vice(&[&args[..], &["--report", text(&html)], more].concat()));
        std::fs::read_to_string(html).unwrap()
    };
    let plain = page("a.html", &[]);
    assert_eq!(plain, page("b.html", &[]), "the same input makes the same bytes");
    assert!(plain.contains("Not known") && plain.contains("--no-diagnosis") && !plain.contains("UTC on "));
    let stamped = page("c.html", &["--stamp"]);
    assert!(stamped.contains(" UTC on "));
    let run = vice(&["evaluate", text(&data), "--labels", "floor.csv", "--stamp"]);
    assert!(run.code == 2 && run.stderr.contains("--report"), "{}", run.stderr);
}

#[test]
fn what_is_no_result_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |content: &str, words: &str| {
        std::fs::write(folder.path().join("x.json"), content).unwrap();
        let run = vice_in(folder.path(), &["report", "x.json", "--out", "x.html"]);
        assert_eq!(run.code, 1, "{}", run.stderr);
        assert!(run.stderr.contains("x.json") && run.stderr.contains(words), "{}", run.stderr);
        assert_eq!(run.stderr.lines().count(), 1, "{}", run.stderr);
        assert!(!folder.path().join("x.html").exists());
    };
    refused("{\"schema\":\"vice.result/3\"}", "newer VICE");
    refused("{\"schema\":\"vice.labels/1\"}", "another kind");
    refused("", "not JSON");
    refused("{\"schema\":\"vice.result/1\",\"pixel\":[]}", "mistake");
    let run = vice_in(folder.path(), &["report", "none.json", "--out", "x.html"]);
    assert!(run.code == 1 && run.stderr.contains("no such file"), "{}", run.stderr);
    let run = vice_in(folder.path(), &["report", "x.json", "--out", "no/such/x.html"]);
    assert!(run.code == 1 && run.stderr.contains("no/such"), "{}", run.stderr);
    let run = vice_in(folder.path(), &["report", "x.json", "--out", "x.json"]);
    assert!(run.code == 2 && run.stderr.contains("file that is read"), "{}", run.stderr);
}

#[test]
fn names_from_data_stay_names() {
    let Some(data) = shared("data/euroc_v1_01") else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let labels = std::fs::read_to_string(data.join("labels/floor.csv")).unwrap();
    let point = "\"=cmd</script><img src=x>\u{2028}\u{1b}[31m\"";
    let named: Vec<String> = labels
        .lines()
        .map(|l| l.strip_prefix("0,").map_or_else(|| l.to_string(), |rest| format!("{point},{rest}")))
        .collect();
    std::fs::write(path("labels.csv"), named.join("\n")).unwrap();
    let run = vice(&[
        "evaluate",
        text(&data),
        "--labels",
        text(&path("labels.csv")),
        "--estimate",
        "imu-euler",
        "--report",
        text(&path("r.html")),
        "--csv",
        text(&path("r.csv")),
        "--latex",
        text(&path("r.tex")),
        "--json",
        text(&path("r.json")),
    ]);
    assert!(!good(run).contains('\u{1b}'));
    let page = std::fs::read_to_string(path("r.html")).unwrap();
    assert!(page.contains("=cmd&lt;/script&gt;&lt;img src=x&gt;"));
    assert!(!page.contains("<img src=x") && !page.contains('\u{1b}') && !page.contains('\u{2028}'));
    assert_eq!(page.matches("</script").count(), 2);
}
