use super::*;
use crate::report::assessment::Diagnosed;
use crate::report::testing::{HOSTILE, document, hostile_document, part, sample};
use vice_core::check::{Finding, State};

fn page(document: ResultDocument) -> String {
    render(&[Run::new(document, Shots::missing(HOSTILE), Assessment::not_run("nobody asked"))]).unwrap()
}

#[test]
fn no_text_from_data_becomes_markup() {
    let mut assessment = Assessment::not_run(HOSTILE);
    assessment.diagnoses.push(Diagnosed {
        stream: HOSTILE.to_string(),
        depth: HOSTILE.to_string(),
        outcome: Err(HOSTILE.to_string()),
    });
    let finding = Finding::new("clock", HOSTILE, State::Wrong, HOSTILE).mend(HOSTILE);
    assessment.findings = Some(vec![finding]);
    let mut run = Run::new(hostile_document(), Shots::missing(HOSTILE), assessment);
    run.stamp = Some(HOSTILE.to_string());
    let text = render(&[run]).unwrap();
    // Ours: the data, and what makes the page move.
    assert_eq!(text.matches("<script").count(), 2);
    assert_eq!(text.matches("</script").count(), 2);
    assert!(text.contains("&lt;script&gt;alert(1)"));
    let no_control = |c: char| c == '\n' || !c.is_control() && c != '\u{2028}';
    assert!(text.chars().all(no_control));
    let json = text.split("class=\"result\">").nth(1).unwrap().split("</script>").next().unwrap();
    let back: ResultDocument = serde_json::from_str(json).unwrap();
    assert_eq!(back.dataset.name, HOSTILE);
}

#[test]
fn what_is_missing_is_said() {
    let text = page(document(vec![part("e", &[])]));
    assert!(text.contains("No images to draw on") && text.contains("No label could be scored"));
    assert!(
        text.contains("Can e be trusted?")
            && text.contains("Not known")
            && !text.contains("as far as these labels")
    );
    let mut without_samples = part("e", &[sample("a", 1, 2.0)]);
    without_samples.samples.clear();
    assert!(page(document(vec![without_samples])).contains("--samples none"));
    assert!(page(document(vec![])).contains("Nothing was evaluated"));
}

#[test]
fn numbers_beyond_reason_are_drawn_without_harm() {
    let mut bad = sample("a", i64::MAX, f64::MAX);
    bad.tracked_px.u = -1e300;
    let mut part = part("e", &[sample("a", i64::MIN, 0.0), bad, sample("b", 0, 1e-300)]);
    // JSON holds no infinity, but the largest number.
    part.pooled_rmse_px = Some(f64::MAX);
    let text = page(document(vec![part]));
    let words = || text.split(|c: char| !c.is_alphanumeric());
    let wrong: Vec<&str> = words().filter(|w| ["NaN", "inf"].contains(w)).collect();
    assert!(wrong.is_empty(), "{wrong:?} in {text}");
}

#[test]
fn a_long_run_makes_a_small_page() {
    let points = ["a", "b", "c", "d"];
    let samples: Vec<_> = (0..2400)
        .map(|i| sample(points[i % 4], 50_000_000 * (i as i64 / 4), (i as f64 * 0.7).sin().abs() * 30.0))
        .collect();
    let streams = ["one", "two", "three"].map(|name| part(name, &samples));
    let text = page(document(streams.to_vec()));
    assert!(text.len() < 900_000, "{} bytes without images", text.len());
}
