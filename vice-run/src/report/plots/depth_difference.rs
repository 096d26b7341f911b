//! What another depth source changes: in the pixel error of each stream, and in the depths at the key frames.

use std::collections::BTreeMap;

use vice_core::result::{PixelPart, PointName, Sample};
use vice_core::statistics::median;
use vice_core::time::Stamp;

use super::axis::Axis;
use super::timeline::Timeline;
use super::{NONE_PX, Plot};
use crate::report::keys::{Key, of};
use crate::report::numbers::{means, px};
use crate::result::ResultDocument;
use crate::text::printable;

/// A plot for each depth source beside the first.
pub(crate) fn depth_differences(document: &ResultDocument, keys: &[Key], timeline: &Timeline) -> Vec<Plot> {
    let mut depths: Vec<&str> = Vec::new();
    for part in &document.pixel {
        if !depths.contains(&part.depth.as_str()) {
            depths.push(&part.depth);
        }
    }
    let Some((first, others)) = depths.split_first() else { return vec![] };
    others.iter().filter_map(|other| difference(document, keys, timeline, first, other)).collect()
}

fn difference(
    document: &ResultDocument,
    keys: &[Key],
    timeline: &Timeline,
    first: &str,
    other: &str,
) -> Option<Plot> {
    let with = |depth: &str, part: &PixelPart| {
        document.pixel.iter().find(|p| p.depth == depth && p.stream == part.stream && p.role == part.role)
    };
    let pairs: Vec<(&Key, &PixelPart, &PixelPart)> = document
        .pixel
        .iter()
        .filter(|p| p.depth == first)
        .filter_map(|a| Some((of(keys, &a.stream, a.role)?, a, with(other, a)?)))
        .collect();
    let curves: Vec<(&Key, Vec<(f64, f64)>)> =
        pairs.iter().map(|(key, a, b)| (*key, by_frame(a, b, timeline))).collect();
    let depths = pairs.iter().map(|(_, a, b)| at_keyframes(a, b, timeline)).max_by_key(Vec::len)?;
    if curves.iter().all(|c| c.1.is_empty()) && depths.is_empty() {
        return None;
    }
    let mut picture = Timeline::picture(2);
    let around_zero =
        |values: Vec<f64>, least: f64| Axis::covering(values.into_iter().chain([-least, least]), 4);
    let y = around_zero(curves.iter().flat_map(|c| c.1.iter().map(|v| v.1)).collect(), NONE_PX);
    let title = "pixel error, change by the other depth";
    timeline.panel(&mut picture, (0, 2), (title, "px"), y, |picture, panel| {
        for (key, values) in &curves {
            panel.stream(picture, key, values);
        }
        timeline.dots(picture, panel);
    });
    let y = around_zero(depths.iter().map(|d| d.1).collect(), 0.1);
    timeline.panel(&mut picture, (1, 2), ("depth at the key frames, change", "%"), y, |picture, panel| {
        panel.dots(picture, "ink", &depths);
    });
    let says = says(&pairs, &depths, &printable(first), &printable(other));
    Some(Plot { title: "Depth sources against each other", svg: picture.into_svg(&says), says })
}

/// Mean over the points of the error with the other depth less that with the first, at labels that both scored.
fn by_frame(first: &PixelPart, other: &PixelPart, timeline: &Timeline) -> Vec<(f64, f64)> {
    let errors: BTreeMap<(&PointName, Stamp), f64> =
        first.samples.iter().map(|s| ((&s.point, s.timestamp_ns), s.error_px)).collect();
    let change = |s: &Sample| {
        let before = errors.get(&(&s.point, s.timestamp_ns))?;
        Some((s.timestamp_ns, s.error_px - before))
    };
    timeline.curve(means(other.samples.iter().filter_map(change)))
}

/// How much longer the other depth is at each key frame that both have, percent.
fn at_keyframes(first: &PixelPart, other: &PixelPart, timeline: &Timeline) -> Vec<(f64, f64)> {
    let depths: BTreeMap<(&PointName, Stamp), f64> =
        first.keyframes.iter().map(|k| ((&k.point, k.timestamp_ns), k.depth_z_m)).collect();
    let mut list: Vec<(f64, f64)> = other
        .keyframes
        .iter()
        .filter_map(|k| {
            let before = depths.get(&(&k.point, k.timestamp_ns))?;
            let percent = 100.0 * (k.depth_z_m / before - 1.0);
            percent.is_finite().then_some((timeline.seconds(k.timestamp_ns), percent))
        })
        .collect();
    list.sort_by(|a, b| a.0.total_cmp(&b.0));
    list
}

fn says(pairs: &[(&Key, &PixelPart, &PixelPart)], depths: &[(f64, f64)], first: &str, other: &str) -> String {
    let one = |(key, a, b): &(&Key, &PixelPart, &PixelPart)| {
        Some(format!("{} {} and {}", key.name, px(a.pooled_rmse_px?), px(b.pooled_rmse_px?)))
    };
    let list: Vec<String> = pairs.iter().filter_map(one).collect();
    let mut text = format!("RMSE_2D with {first} and with {other}: {}.", list.join("; "));
    let mut off: Vec<f64> = depths.iter().map(|d| d.1.abs()).collect();
    let common = off.len();
    if let Some(half) = median(&mut off) {
        text.push_str(&format!(
            " At {common} key frames that both have, half of the depths differ by less than {half:.1} %."
        ));
    } else {
        text.push_str(" No key frame has depth from both.");
    }
    text.push_str(" Above zero the other depth gives the larger error.");
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::keys::keys;
    use crate::report::testing::{document, keyframe, part, sample};

    #[test]
    fn differences_are_of_labels_that_both_scored() {
        let second = 1_000_000_000;
        let mut floor =
            part("e", &[sample("a", second, 2.0), sample("b", second, 4.0), sample("a", 2 * second, 1.0)]);
        floor.keyframes = vec![keyframe("a", 0), keyframe("b", 0)];
        let mut zmap =
            part("e", &[sample("a", second, 3.0), sample("b", second, 4.5), sample("b", 2 * second, 9.0)]);
        zmap.depth = "zmap".to_string();
        zmap.keyframes = vec![keyframe("a", 0)];
        zmap.keyframes[0].depth_z_m = 2.2;
        let document = document(vec![floor, zmap]);
        let timeline = Timeline::of(&document);
        assert_eq!(by_frame(&document.pixel[0], &document.pixel[1], &timeline), [(1.0, 0.75)]);
        let plots = depth_differences(&document, &keys(&document), &timeline);
        assert_eq!(plots.len(), 1);
        assert!(
            plots[0].says.contains("At 1 key frames") && plots[0].says.contains("10.0 %"),
            "{}",
            plots[0].says
        );
    }

    #[test]
    fn one_depth_source_has_nothing_to_differ_from() {
        let document = document(vec![part("e", &[sample("a", 1, 2.0)])]);
        assert!(depth_differences(&document, &keys(&document), &Timeline::of(&document)).is_empty());
    }
}
