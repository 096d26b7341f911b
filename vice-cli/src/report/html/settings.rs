//! What was asked for, so that it can be asked for again.

use maud::{Markup, html};
use vice_core::result::{ResultDocument, Role, Settings};

use super::escape::shell_word;
use crate::terminal::printable;

/// The settings as a table, and as a command.
pub(crate) fn settings(document: &ResultDocument) -> Markup {
    let s = &document.settings;
    let number = |v: Option<f64>, none: &str| v.map_or_else(|| none.to_string(), |v| v.to_string());
    let mut rows: Vec<(String, String)> = vec![
        ("VICE".to_string(), document.vice_version.clone()),
        ("data set".to_string(), s.dataset.clone().unwrap_or_else(|| document.dataset.name.clone())),
        ("format, camera".to_string(), format!("{}, {}", document.dataset.format, document.dataset.camera)),
        ("labels".to_string(), s.labels.clone()),
        ("points".to_string(), s.points.join(", ")),
        ("frames a second".to_string(), number(s.fps, "every labelled frame")),
        ("start, duration (s)".to_string(), format!("{}, {}", s.start_s, number(s.duration_s, "to the end"))),
        ("widest interpolated gap (s)".to_string(), s.max_gap_s.to_string()),
        ("time offset (s)".to_string(), s.time_offset_s.to_string()),
        ("alignment".to_string(), s.align.clone()),
        ("anchor of depth".to_string(), s.anchor.clone()),
        ("poses of estimates".to_string(), s.estimate_frame.clone()),
        ("Z-map tests occlusion".to_string(), if s.zmap_occlusion { "yes" } else { "no" }.to_string()),
    ];
    if let Some(file) = &s.calibration {
        rows.push(("calibration".to_string(), file.clone()));
    }
    if let Some(plane) = s.floor_plane {
        rows.push(("floor plane".to_string(), plane.map(|v| v.to_string()).join(", ")));
    }
    rows.extend(s.other.iter().map(|(k, v)| (k.clone(), v.clone())));
    html! {
        div.wide {
            table {
                tbody {
                    @for (name, value) in rows {
                        tr { td.t { (printable(&name)) } td.wrap { (printable(&value)) } }
                    }
                }
            }
        }
        @if let Some(command) = command(document) {
            p { "The same again:" }
            pre { (printable(&command)) }
        }
    }
}

/// The command line that evaluates the same again; `None` where the document does not hold what it needs.
fn command(document: &ResultDocument) -> Option<String> {
    let s: &Settings = &document.settings;
    let other = |key: &str| s.other.get(key).map(String::as_str);
    let mut words: Vec<String> = vec!["vice".to_string(), "evaluate".to_string(), s.dataset.clone()?];
    let mut option = |name: &str, value: &str| words.extend([format!("--{name}"), value.to_string()]);
    // A flight that was never a file has a format that no file has.
    if document.dataset.format != "synthetic" {
        option("format", &document.dataset.format);
    }
    option("camera", &document.dataset.camera);
    for (key, value) in &s.other {
        if let Some(key) = key.strip_prefix("set ") {
            option("set", &format!("{key}={value}"));
        }
    }
    option("labels", &s.labels);
    for name in [
        "points",
        "estimate",
        "reference",
        "times",
        "initial-pose",
        "subsets",
        "observations",
        "cloud-voxel",
        "zcam-range",
        "tag-size",
        "tag-family",
    ] {
        match other(name) {
            Some(value) => option(name, value),
            None if name == "estimate" => return None,
            None => {}
        }
    }
    let mut depths: Vec<&str> = document.pixel.iter().map(|p| p.depth.as_str()).collect();
    depths.dedup();
    let mut seen = std::collections::BTreeSet::new();
    depths.retain(|d| seen.insert(*d));
    option("depth", &depths.join(","));
    if let Some(fps) = s.fps {
        option("fps", &fps.to_string());
    }
    if s.start_s != 0.0 {
        option("start", &s.start_s.to_string());
    }
    if let Some(duration) = s.duration_s {
        option("duration", &duration.to_string());
    }
    option("max-gap", &s.max_gap_s.to_string());
    if s.time_offset_s != 0.0 {
        option("time-offset", &s.time_offset_s.to_string());
    }
    option("align", &s.align);
    let role = |name: &str| document.pixel.iter().find(|p| p.stream == name).map(|p| p.role);
    let has_reference = document.pixel.iter().any(|p| p.role == Role::Reference);
    if has_reference && role(&s.anchor) == Some(Role::Estimate) {
        option("anchor", "estimate");
    }
    if let Some(file) = &s.calibration {
        option("calibration", file);
    }
    if let Some(plane) = s.floor_plane {
        option("floor-plane", &plane.map(|v| v.to_string()).join(","));
    }
    if !s.zmap_occlusion {
        option("zmap-occlusion", "off");
    }
    if s.estimate_frame != "body" {
        option("estimate-frame", &s.estimate_frame);
    }
    Some(words.iter().map(|w| shell_word(w)).collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, part, sample};

    #[test]
    fn the_command_holds_what_was_asked_for_and_no_more_words() {
        let mut d = document(vec![part("e", &[sample("a", 1, 2.0)])]);
        assert_eq!(command(&d), None, "without the path of the data set");
        d.settings.dataset = Some("my run".to_string());
        d.settings.labels = "$(rm).csv".to_string();
        d.settings.align = "se3".to_string();
        d.settings.estimate_frame = "body".to_string();
        d.settings.zmap_occlusion = true;
        d.settings.other.insert("estimate".to_string(), "e.txt".to_string());
        d.settings.other.insert("set topic".to_string(), "/a b".to_string());
        assert_eq!(
            command(&d).unwrap(),
            "vice evaluate 'my run' --format euroc --camera cam0 --set 'topic=/a b' --labels '$(rm).csv' --estimate e.txt \
             --depth floor --max-gap 0 --align se3"
        );
    }
}
