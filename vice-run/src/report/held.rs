//! RMSE_2D of the labels that hold, its interval, and the error by age: rows that the table, the page and the CSV share.

use vice_core::result::{Figure, HeldPart, PixelPart, TrajectoryPart, TriangulationPart, WindowPart};

use super::rows::{decimals, pixels};
use crate::result::{OWN_ANCHOR, ResultDocument};
use crate::text::printable;

/// `4.41 [3.52, 5.53]`, or the value alone where it has no interval.
pub(crate) fn value_and_interval(value: f64, interval_95: Option<[f64; 2]>) -> String {
    let shown = |px| pixels(px, decimals(value));
    match interval_95 {
        Some([low, high]) => format!("{} [{}, {}]", shown(value), shown(low), shown(high)),
        None => shown(value),
    }
}

/// The same of a figure; a dash where there is none.
pub(crate) fn figure(figure: Option<&Figure>) -> String {
    figure.map_or_else(|| "-".to_string(), |f| value_and_interval(f.rmse, f.interval_95))
}

/// RMSE_2D of the labels that hold with its interval; a dash where there is none.
pub(crate) fn held(part: &PixelPart) -> String {
    part.held_rmse_px.map_or_else(|| "-".to_string(), |v| value_and_interval(v, part.interval_95))
}

/// What was set aside: `3 labels and 1 segment, 27 samples`.
pub(crate) fn set_aside(held: &HeldPart) -> String {
    let plural = |n: usize, one: &str| format!("{n} {one}{}", if n == 1 { "" } else { "s" });
    match (held.labels_set_aside(), held.segments_set_aside()) {
        (0, 0) => "0".to_string(),
        (n, 0) => plural(n, "label"),
        (0, n) => format!("{} ({} samples)", plural(n, "segment"), held.samples_set_aside()),
        (labels, segments) => format!(
            "{} and {} ({} samples)",
            plural(labels, "label"),
            plural(segments, "segment"),
            held.samples_set_aside()
        ),
    }
}

/// `1 s` or `0.5 m`.
pub(crate) fn window_name(window: &WindowPart) -> String {
    match (window.age_s, window.moved_m) {
        (Some(s), _) => format!("{s} s"),
        (_, Some(m)) => format!("{m} m"),
        _ => String::new(),
    }
}

/// All windows of a part, ages first.
pub(crate) fn windows(part: &PixelPart) -> impl Iterator<Item = &WindowPart> {
    part.by_age.iter().chain(&part.by_distance)
}

/// Names of the windows that any part has a number for.
pub(crate) fn filled(document: &ResultDocument) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let first = document.pixel.iter().find(|p| !p.by_age.is_empty());
    for name in first.into_iter().flat_map(windows).map(window_name) {
        let has = |p: &PixelPart| windows(p).any(|w| window_name(w) == name && w.px.is_some());
        if document.pixel.iter().any(has) {
            names.push(name);
        }
    }
    names
}

/// What is to be said of a part's interval, its set-aside labels and doubtful depths: a sentence each.
pub(crate) fn remarks(part: &PixelPart) -> Vec<String> {
    let about = format!("{} ({} depth)", printable(&part.stream), printable(&part.depth));
    let mut remarks = Vec::new();
    if let Some(note) = part.held.as_ref().and_then(|h| h.note.as_ref()) {
        remarks.push(format!("{about}: {}", printable(note)));
    }
    if !part.depth_doubts.is_empty() {
        let n = part.depth_doubts.len();
        remarks.push(format!("{about}: the depth is doubtful at {n} of {} key frames", part.keyframes.len()));
    }
    if let Some(told) = &part.triangulation {
        remarks.push(format!("{about}: {}", printable(&triangulation(told))));
    }
    remarks
}

/// How the depths came about, where labels gave them, and what they cannot show.
fn triangulation(told: &TriangulationPart) -> String {
    let sure =
        told.median_sigma_share.zip(told.median_parallax_deg).map_or_else(String::new, |(share, deg)| {
            format!(" (median: {:.1} % sure, {deg:.1} degrees of parallax)", 100.0 * share)
        });
    let without = match told.keyframes_without_depth {
        0 => String::new(),
        n => format!(", {n} have none"),
    };
    format!(
        "{} labels give the depth of {} key frames{sure}{without}: {}. {}",
        told.labels_for_depth, told.keyframes, told.rule, told.cannot_show
    )
}

/// How many poses the trajectory errors of an estimate rest on.
pub(crate) fn poses(part: &TrajectoryPart) -> String {
    let plural = if part.matched == 1 { "pose" } else { "poses" };
    format!(
        "{}: RMSE_3D, AOE and ROE over {} {plural}, aligned by {}",
        printable(&part.estimate),
        part.matched,
        printable(&part.align)
    )
}

/// What places the camera, where that is not one stream for all.
pub(crate) fn anchor(document: &ResultDocument) -> Option<&'static str> {
    (document.used.anchor == OWN_ANCHOR).then_some(
        "depth: each stream places the camera by itself, since there is no reference (see --anchor)",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part};
    use vice_core::result::{AsideReason, PointName, SetAside};
    use vice_core::time::Stamp;

    fn aside(reason: AsideReason, samples: u64) -> SetAside {
        SetAside {
            point: PointName("a".into()),
            timestamp_ns: Stamp::from_nanos(1),
            reason,
            off_px: 9.0,
            samples,
        }
    }

    #[test]
    fn numbers_are_told_with_their_interval_and_what_was_set_aside() {
        assert_eq!(value_and_interval(4.4149, Some([3.5, 5.6])), "4.41 [3.50, 5.60]");
        assert_eq!(value_and_interval(44.149, None), "44.1");
        assert_eq!(figure(None), "-");
        let mut held = HeldPart::default();
        assert_eq!(set_aside(&held), "0");
        held.set_aside = vec![aside(AsideReason::LabelJumps, 1)];
        assert_eq!(set_aside(&held), "1 label");
        held.set_aside.push(aside(AsideReason::KeyframeOff, 20));
        assert_eq!(set_aside(&held), "1 label and 1 segment (21 samples)");
        held.set_aside.remove(0);
        assert_eq!(set_aside(&held), "1 segment (20 samples)");
    }

    #[test]
    fn only_windows_with_a_number_have_a_column() {
        let window = |age_s, px| WindowPart {
            age_s: Some(age_s),
            moved_m: None,
            px,
            mrad: None,
            mm: None,
            segments: 0,
            samples: 0,
            refused: None,
        };
        let mut one = part("e", &[]);
        one.by_age = vec![window(1.0, Some(Figure { rmse: 2.0, interval_95: None })), window(2.0, None)];
        assert_eq!(filled(&document(vec![one])), ["1 s"]);
        assert!(filled(&document(vec![part("e", &[])])).is_empty());
    }
}
