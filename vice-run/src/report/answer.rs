//! Whether an estimate can be trusted, how far it is off, what is wrong and what to do: the first screen of a report.
//!
//! An answer is never surer than what it rests on. Where nothing can be said it says so, with the numbers that are missing.

use vice_core::diagnose::{DiagnosisDocument, VerdictKind};
use vice_core::result::{Figure, PixelPart, Role, WindowPart};

use super::assessment::Assessment;
use super::held::{remarks, value_and_interval, window_name};
use super::plots::NONE_PX;
use crate::result::ResultDocument;
use crate::text::{printable, with_options};

/// Share of labels whose points are carried out of view above which RMSE_2D says little, percent.
const MANY_AWAY_PERCENT: f64 = 10.0;

/// Whether an estimate can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Trust {
    /// Nothing is wrong with it that these labels could show.
    Yes,
    /// Something is wrong, and it is known what.
    NotAsItIs,
    /// Something is wrong, and it is not known what.
    No,
    /// Nobody can say.
    Unknown,
}

impl Trust {
    /// The class of its colour.
    pub(crate) const fn class(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::NotAsItIs | Self::No => "no",
            Self::Unknown => "unknown",
        }
    }

    /// The answer in words.
    pub(crate) const fn words(self) -> &'static str {
        match self {
            Self::Yes => "Yes, as far as these labels can show",
            Self::NotAsItIs => "Not as it is",
            Self::No => "No",
            Self::Unknown => "Not known",
        }
    }
}

/// The answer for one estimate.
pub(crate) struct Answer {
    pub(crate) trust: Trust,
    /// What each line is about, and the line.
    pub(crate) lines: Vec<(&'static str, String)>,
}

/// The answer for a part of an estimate.
pub(crate) fn answer(document: &ResultDocument, part: &PixelPart, assessment: &Assessment) -> Answer {
    let diagnosed = assessment.of(&part.stream, &part.depth);
    let mut lines = Vec::new();
    if let Some(how_far) = how_far(part) {
        lines.push(("How far off", how_far));
    }
    let mut trust = match diagnosed.map(|d| &d.outcome) {
        _ if part.scored == 0 => nothing_scored(part, &mut lines),
        Some(Ok(diagnosis)) => of_diagnosis(diagnosis, &mut lines),
        Some(Err(why)) => {
            lines.push(("Why not", format!("The diagnosis failed: {}.", trimmed(&printable(why)))));
            Trust::Unknown
        }
        None => {
            let why = assessment.not_run.first().map_or("no diagnosis was made", |why| trimmed(why));
            lines.push(("Why not", format!("RMSE_2D is a size and no judgement, and {}.", printable(why))));
            Trust::Unknown
        }
    };
    let away = part.carried_away_percent();
    if away > MANY_AWAY_PERCENT {
        lines.push((
            "Careful",
            format!(
                "{away:.0} % of the labels have no pixel error, since the estimate carries their points behind the camera or beyond its lens model. RMSE_2D is of the rest."
            ),
        ));
    }
    let estimates: Vec<&str> =
        document.pixel.iter().filter(|p| p.role == Role::Estimate).map(|p| p.stream.as_str()).collect();
    let wrong = assessment.wrong_with(&part.stream, &estimates);
    if let Some(finding) = wrong.first() {
        let mend = if finding.mend.is_empty() { String::new() } else { format!(" ({})", finding.mend) };
        let more = if wrong.len() > 1 { format!(" {} more below.", wrong.len() - 1) } else { String::new() };
        let says = sentence(&with_options(&format!("{}{mend}", finding.says)));
        lines.push(("By the checks", format!("{says}{more}")));
    }
    // A good number on shaky ground is no yes.
    if trust == Trust::Yes && (away > MANY_AWAY_PERCENT || !wrong.is_empty()) {
        trust = Trust::Unknown;
    }
    if let Some(beside) = beside_the_reference(document, part) {
        lines.push(("Beside the reference", beside));
    }
    // The card says whose remarks they are.
    let own = |remark: &str| remark.split_once(" depth): ").map_or(remark, |(_, rest)| rest).to_string();
    lines.extend(remarks(part).iter().map(|remark| ("Careful", sentence(&own(remark)))));
    Answer { trust, lines }
}

fn nothing_scored(part: &PixelPart, lines: &mut Vec<(&'static str, String)>) -> Trust {
    let reasons = part.skips_by_reason();
    let most = reasons.iter().max_by_key(|(_, count)| **count);
    let why =
        most.map(|(reason, count)| format!(", most often ({count}) because: {reason}")).unwrap_or_default();
    lines.push(("Why not", format!("No label could be scored, of {}{why}.", part.skipped.len())));
    lines.push((
        "What to do",
        "See \u{201c}What was left out\u{201d} below: each reason says which labels, of which points, from when on.".to_string(),
    ));
    Trust::Unknown
}

/// RMSE_2D with its interval, in pixels.
pub(crate) fn size(part: &PixelPart) -> String {
    match part.held_rmse_px.or(part.pooled_rmse_px) {
        Some(value) if value < NONE_PX => format!("below {NONE_PX} px"),
        Some(value) => format!("{} px", value_and_interval(value, part.interval_95)),
        None => "no pixel error".to_string(),
    }
}

/// RMSE_2D as angle and millimetres, what it rests on, and how it grows.
fn how_far(part: &PixelPart) -> Option<String> {
    part.held_rmse_px.or(part.pooled_rmse_px)?;
    let held = part.held.as_ref();
    let unit = |figure: Option<&Figure>, unit: &str| {
        figure.map(|f| format!("{} {unit}", value_and_interval(f.rmse, f.interval_95)))
    };
    let others: Vec<String> =
        [unit(held.and_then(|h| h.mrad.as_ref()), "mrad"), unit(held.and_then(|h| h.mm.as_ref()), "mm")]
            .into_iter()
            .flatten()
            .collect();
    let mut text = format!("RMSE_2D {}", size(part));
    if !others.is_empty() {
        text.push_str(&format!(", that is {}", others.join(" and ")));
    }
    text.push_str(&match held {
        Some(h) => format!("; {} labels of {} points in {} segments", h.samples, h.points, h.segments),
        None => format!("; {} labels", part.scored),
    });
    text.push_str(match part.interval_95 {
        Some(_) => ", 95 % intervals.",
        None => ". No interval: too few points or segments.",
    });
    let shown = |w: &WindowPart| {
        Some(format!("{} px after {}", value_and_interval(w.px?.rmse, None), window_name(w)))
    };
    let ages: Vec<String> = part.by_age.iter().filter_map(shown).collect();
    let mut grown: Vec<&String> = ages.first().into_iter().chain(ages.last()).collect();
    grown.dedup();
    let far = part.by_distance.iter().filter_map(shown).next_back();
    grown.extend(&far);
    if !grown.is_empty() && part.held_rmse_px.or(part.pooled_rmse_px) >= Some(NONE_PX) {
        let list: Vec<&str> = grown.into_iter().map(String::as_str).collect();
        text.push_str(&format!(" Since the key frame: {}.", list.join(", ")));
    }
    Some(text)
}

/// The reference at the same labels: the least that the method can show here.
fn beside_the_reference(document: &ResultDocument, part: &PixelPart) -> Option<String> {
    let is_reference = |p: &&PixelPart| p.role == Role::Reference && p.depth == part.depth;
    let reference = document.pixel.iter().find(is_reference)?;
    let value = reference.held_rmse_px.or(reference.pooled_rmse_px)?;
    let own = part.held_rmse_px.or(part.pooled_rmse_px)?;
    let name = printable(&reference.stream);
    let shown = size(reference);
    let against = if own.max(value) < NONE_PX {
        "neither is off"
    } else if own > 1.5 * value {
        "the estimate is the worse of the two"
    } else if value > 1.5 * own {
        "the reference is the worse of the two: labels, depth or calibration may suit it less"
    } else {
        "about the same: a difference would not show here"
    };
    Some(format!("{name} itself comes to {shown}; {against}."))
}

fn of_diagnosis(diagnosis: &DiagnosisDocument, lines: &mut Vec<(&'static str, String)>) -> Trust {
    let verdict = &diagnosis.verdict;
    lines.push(("What is wrong", sentence(&verdict.sentence)));
    let trust = match verdict.kind {
        VerdictKind::NoFlaw => Trust::Yes,
        VerdictKind::Named => Trust::NotAsItIs,
        VerdictKind::CannotTell | VerdictKind::Unexplained => Trust::No,
        _ => Trust::Unknown,
    };
    let mut to_do: Vec<String> = verdict.corrections.iter().map(|c| to_do_words(c)).collect();
    to_do.extend(verdict.labels_that_help.iter().map(|help| format!("Label more: {}", sentence(help))));
    match verdict.kind {
        VerdictKind::Named if to_do.is_empty() => {
            to_do.push("No option corrects this; the estimate has to be made again.".to_string());
        }
        VerdictKind::Unexplained => to_do.push(
            "Look at the worst moments below: what happens there? Then `vice check --images` on the recording.".to_string(),
        ),
        VerdictKind::TooFewLabels => to_do.push(format!(
            "Label more: {} labels of {} points over {:.1} s were there.",
            diagnosis.labels.scored, diagnosis.labels.points, diagnosis.labels.seconds
        )),
        _ => {}
    }
    if !to_do.is_empty() {
        lines.push(("What to do", to_do.join(" ")));
    }
    if matches!(verdict.kind, VerdictKind::Named | VerdictKind::CannotTell) {
        let percent = (100.0 * verdict.sureness).min(99.9);
        lines.push((
            "How sure",
            format!("{percent:.1} % of all explanations that were tried, weighed by how well they fit."),
        ));
    }
    if verdict.kind == VerdictKind::NoFlaw
        && let Some(blind) = blind_for(diagnosis)
    {
        lines.push(("What these labels cannot show", blind));
    }
    trust
}

/// A correction as a sentence; an option is something to use.
fn to_do_words(correction: &str) -> String {
    let words = with_options(correction);
    if words.starts_with("--") { format!("Use {}.", trimmed(&printable(&words))) } else { sentence(&words) }
}

/// Flaws of which these labels show nothing, or only some directions.
fn blind_for(diagnosis: &DiagnosisDocument) -> Option<String> {
    let named =
        |list: Vec<&str>, what: &str| (!list.is_empty()).then(|| format!("{what} {}", list.join(", ")));
    let of = |test: &dyn Fn(usize, usize) -> bool| -> Vec<&str> {
        diagnosis.flaws.iter().filter(|f| test(f.rank, f.of)).map(|f| f.flaw.words()).collect()
    };
    let none = named(of(&|rank, of| rank == 0 && of > 0), "nothing of");
    let some = named(of(&|rank, of| rank > 0 && rank < of), "only some directions of");
    let both: Vec<String> = [none, some].into_iter().flatten().collect();
    (!both.is_empty()).then(|| sentence(&both.join("; ")))
}

/// A phrase as a sentence: a capital, and a full stop.
pub(crate) fn sentence(text: &str) -> String {
    let text = printable(text);
    let text = trimmed(&text);
    let mut letters = text.chars();
    let first = letters.next().map(|c| c.to_uppercase().collect::<String>()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}

fn trimmed(text: &str) -> &str {
    text.trim().trim_end_matches('.')
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::assessment::Diagnosed;
    use crate::report::testing::{document, part, sample};
    use serde_json::json;
    use vice_core::check::{Finding, State};
    use vice_core::result::Skip;
    use vice_core::skip::SkipReason;
    use vice_core::time::Stamp;

    fn diagnosis(kind: &str, sentence: &str, corrections: &[&str], rank: usize) -> DiagnosisDocument {
        let flaw = json!({
            "flaw": "focal-length", "parameters": [], "rmse_px": 1.0, "explained_percent": 0.0, "likelier": 0.0,
            "sureness": 0.0, "rank": rank, "of": 1, "weakest_px": 0.0, "strongest_px": 0.0, "text": "focal length"
        });
        serde_json::from_value(json!({
            "schema": "vice.diagnosis/1", "vice_version": "0", "dataset": "run", "format": "euroc", "camera": "cam0",
            "stream": "e", "depth": "floor", "rmse_px": 3.0, "label_noise_px": 0.5, "wander_px_root_s": 0.0,
            "labels_rmse_px": 0.5, "overlaps": [], "flaws": [flaw],
            "labels": {"scored": 9, "points": 2, "blocks": 1, "blocks_of": "keyframes", "seconds": 4.0},
            "odometry": {"expected": {"position_m": 0.005, "yaw_rad": 0.001}, "position_m_root_s": 0.0, "yaw_rad_root_s": 0.0, "lean_rad": 0.0,
                         "jitter_m": 0.0, "jumps_s": []},
            "verdict": {"kind": kind, "flaws": [], "sureness": 0.99999, "fitted": [], "rmse_px": 1.0,
                        "sentence": sentence, "corrections": corrections, "labels_that_help": []}
        }))
        .unwrap()
    }

    fn answered(part: PixelPart, assessment: &Assessment) -> (Trust, String) {
        let document = document(vec![part]);
        let answer = answer(&document, &document.pixel[0], assessment);
        let lines: Vec<String> =
            answer.lines.iter().map(|(about, line)| format!("{about}: {line}")).collect();
        (answer.trust, lines.join("\n"))
    }

    fn diagnosed(kind: &str, corrections: &[&str], rank: usize) -> Assessment {
        let outcome = Ok(diagnosis(kind, "it is so", corrections, rank));
        let diagnoses = vec![Diagnosed { stream: "e".to_string(), depth: "floor".to_string(), outcome }];
        Assessment { diagnoses, findings: None, not_run: vec![] }
    }

    fn good() -> PixelPart {
        part("e", &[sample("a", 1, 0.5), sample("a", 2, 0.5)])
    }

    #[test]
    fn each_verdict_has_its_answer() {
        for (kind, trust) in [
            ("no-flaw", Trust::Yes),
            ("named", Trust::NotAsItIs),
            ("cannot-tell", Trust::No),
            ("unexplained", Trust::No),
            ("too-few-labels", Trust::Unknown),
        ] {
            let (found, text) = answered(good(), &diagnosed(kind, &["`time-offset` 0.05"], 1));
            assert_eq!(found, trust, "{kind}");
            assert!(text.contains("What is wrong: It is so."), "{text}");
        }
        let (_, text) = answered(good(), &diagnosed("named", &["`time-offset` 0.05"], 1));
        assert!(
            text.contains("What to do: Use --time-offset 0.05.") && text.contains("How sure: 99.9 %"),
            "{text}"
        );
        let (_, text) = answered(good(), &diagnosed("too-few-labels", &[], 1));
        assert!(text.contains("9 labels of 2 points over 4.0 s"), "{text}");
    }

    #[test]
    fn a_yes_names_what_the_labels_cannot_show() {
        let (_, text) = answered(good(), &diagnosed("no-flaw", &[], 0));
        assert!(text.contains("What these labels cannot show: Nothing of focal length."), "{text}");
        assert!(!answered(good(), &diagnosed("no-flaw", &[], 1)).1.contains("cannot show"));
    }

    #[test]
    fn a_small_error_on_shaky_ground_is_no_yes() {
        let mut lost = good();
        lost.skipped = vec![
            Skip {
                point: vice_core::result::PointName("a".into()),
                timestamp_ns: Stamp::from_nanos(3),
                reason: SkipReason::BehindCamera
            };
            5
        ];
        let (trust, text) = answered(lost, &diagnosed("no-flaw", &[], 1));
        assert_eq!(trust, Trust::Unknown, "{text}");
        assert!(text.contains("71 % of the labels"), "{text}");
        let mut assessment = diagnosed("no-flaw", &[], 1);
        assessment.findings = Some(vec![
            Finding::new("clock", "truth", State::Wrong, "another stream"),
            Finding::new("clock", "truth / e", State::Wrong, "50 ms late").mend("`time-offset` -0.05"),
        ]);
        let (trust, text) = answered(good(), &assessment);
        assert_eq!(trust, Trust::Unknown);
        assert!(text.contains("50 ms late (--time-offset -0.05)") && !text.contains("another"), "{text}");
    }

    #[test]
    fn two_estimates_that_differ_accuse_neither() {
        let mut assessment = diagnosed("no-flaw", &[], 1);
        assessment.findings = Some(vec![Finding::new("clock", "e / other", State::Wrong, "other is late")]);
        let both = document(vec![good(), part("other", &[sample("a", 1, 9.0)])]);
        assert_eq!(answer(&both, &both.pixel[0], &assessment).trust, Trust::Yes);
        // Against the recording's own sensor it counts.
        let alone = document(vec![good()]);
        assert_eq!(answer(&alone, &alone.pixel[0], &assessment).trust, Trust::Unknown);
    }

    #[test]
    fn without_a_diagnosis_nothing_is_claimed() {
        let (trust, text) = answered(good(), &Assessment::not_run("no diagnosis was asked for"));
        assert_eq!(trust, Trust::Unknown);
        assert!(text.contains("RMSE_2D 0.50 px") && text.contains("no diagnosis was asked for."), "{text}");
        let (trust, text) = answered(part("e", &[]), &diagnosed("no-flaw", &[], 1));
        assert_eq!(trust, Trust::Unknown, "{text}");
    }
}
