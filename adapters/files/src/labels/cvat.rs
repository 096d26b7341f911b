//! Labels as "CVAT for video 1.1": a track of single points for each point.
//!
//! CVAT counts frames from 0 and puts (0, 0) at the corner of the top left pixel, half a pixel from its centre. A track's
//! label is the point's name. What CVAT has no word for stands in attributes: `source` as in the other formats,
//! `keyframe` (a segment starts; CVAT's own key frames are those that were not interpolated) and `uncertain`.

use std::collections::BTreeMap;
use std::io::{self, Write};

use roxmltree::{Document, Node, ParsingOptions};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelRow, LabelSet, Observation, ObservationSource, PointLabels};
use vice_core::time::Stamp;

use super::labels_from;

/// From the corner of a pixel to its centre.
const CENTRE_PX: f64 = 0.5;
/// Elements, attributes and texts beyond which a file is refused: hours of labels have fewer.
const MAX_NODES: u32 = 8_000_000;

/// Reads the tracks of points of "CVAT for video 1.1". `frame_stamps` are the stamps of the camera's frames.
///
/// Where a file does not come from here: a shape that CVAT interpolated is `interpolated`; a track's first visible point,
/// and the first one after it was outside, is a key frame; of tracks with one label each is named `label-id`. Tracks of
/// other shapes are passed over with a warning.
///
/// # Errors
/// [`DataError`] with the line if it is no such XML, a value cannot be read or a frame is none of the camera's, and as
/// [`LabelSet::from_rows`].
pub fn read_cvat(bytes: &[u8], frame_stamps: &[Stamp]) -> DataResult<LabelSet> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes)
        .map_err(|e| DataError::new("the XML is not UTF-8 text").byte(e.valid_up_to() as u64))?;
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(text, options).map_err(|e| {
        let line = u64::from(e.pos().row);
        DataError::new("the labels are not XML").line(line).because(e)
    })?;
    let root = document.root_element();
    let mut lines = Lines { text, passed: 0, line: 1 };
    if !root.has_tag_name("annotations") {
        let problem = format!("the XML is <{}>, not CVAT's <annotations>", root.tag_name().name());
        return Err(DataError::new(problem).line(lines.of(&root)));
    }
    let tracks: Vec<Node<'_, '_>> = root.children().filter(|n| n.has_tag_name("track")).collect();
    if tracks.is_empty() && root.children().any(|n| n.has_tag_name("image")) {
        return Err(DataError::new("these are CVAT's annotations of images, which have no tracks")
            .hint("export the task as `CVAT for video 1.1`"));
    }
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    for track in tracks.iter().filter(|t| has_points(t)) {
        *uses.entry(track.attribute("label").unwrap_or_default()).or_default() += 1;
    }
    let mut rows = Vec::new();
    for track in tracks {
        let line = lines.of(&track);
        let label = track.attribute("label").unwrap_or_default();
        if !has_points(&track) {
            tracing::warn!("labels: line {line}: the track `{label}` has no points and is passed over");
            continue;
        }
        let point = if uses.get(label).is_some_and(|n| *n > 1) {
            format!("{label}-{}", track.attribute("id").unwrap_or_default())
        } else {
            label.to_string()
        };
        read_track(&track, &point, frame_stamps, &mut lines, &mut rows)?;
    }
    labels_from(rows)
}

fn has_points(track: &Node<'_, '_>) -> bool {
    track.children().any(|n| n.has_tag_name("points"))
}

fn read_track(
    track: &Node<'_, '_>,
    point: &str,
    frame_stamps: &[Stamp],
    lines: &mut Lines<'_>,
    rows: &mut Vec<LabelRow>,
) -> DataResult<()> {
    let made_by_tool = matches!(track.attribute("source"), Some("auto" | "semi-auto"));
    // Nothing visible before: the next one starts a segment.
    let mut starts = true;
    for shape in track.children().filter(|n| n.has_tag_name("points")) {
        let line = lines.of(&shape);
        let row = Shape { node: shape, point };
        if row.flag("outside").map_err(|e| e.line(line))? {
            starts = true;
            continue;
        }
        let default_source = match (row.flag("keyframe").map_err(|e| e.line(line))?, made_by_tool) {
            (false, _) if shape.attribute("keyframe").is_some() => ObservationSource::Interpolated,
            (_, true) => ObservationSource::Auto,
            _ => ObservationSource::Manual,
        };
        let observation =
            row.observation(frame_stamps, default_source, starts, line).map_err(|e| e.line(line))?;
        starts = false;
        rows.push(LabelRow { point: point.to_string(), observation });
    }
    Ok(())
}

/// One `<points>` of a track.
struct Shape<'a, 'input> {
    node: Node<'a, 'input>,
    point: &'a str,
}

impl Shape<'_, '_> {
    fn wrong(&self, what: &str, value: &str, expected: &str) -> DataError {
        DataError::new(format!("point {}: {what} is `{value}`, not {expected}", self.point))
    }

    /// An attribute of CVAT's own, false where it is missing.
    fn flag(&self, name: &str) -> DataResult<bool> {
        match self.node.attribute(name) {
            None | Some("0") => Ok(false),
            Some("1") => Ok(true),
            Some(other) => Err(self.wrong(name, other, "0 or 1")),
        }
    }

    /// The text of an `<attribute>`.
    fn attribute(&self, name: &str) -> Option<&str> {
        let is_it = |n: &Node<'_, '_>| n.has_tag_name("attribute") && n.attribute("name") == Some(name);
        self.node.children().find(is_it).map(|n| n.text().unwrap_or_default().trim())
    }

    fn boolean(&self, name: &str, default: bool) -> DataResult<bool> {
        match self.attribute(name) {
            None | Some("") => Ok(default),
            Some("true" | "True" | "1") => Ok(true),
            Some("false" | "False" | "0") => Ok(false),
            Some(other) => Err(self.wrong(&format!("the attribute {name}"), other, "true or false")),
        }
    }

    fn observation(
        &self,
        frame_stamps: &[Stamp],
        default_source: ObservationSource,
        starts: bool,
        line: u64,
    ) -> DataResult<Observation> {
        let frame = self.node.attribute("frame").unwrap_or_default();
        let index = frame.parse::<usize>().map_err(|_| self.wrong("the frame", frame, "a number"))?;
        let stamp = *frame_stamps.get(index).ok_or_else(|| {
            let (point, known) = (self.point, frame_stamps.len());
            DataError::new(format!("point {point}: frame {index} is not among the camera's {known} frames"))
                .hint("is this the data set that was labelled?")
        })?;
        let place = self.node.attribute("points").unwrap_or_default();
        let numbers = place.split_once(',').and_then(|(u, v)| {
            Some(Pixel::new(
                u.trim().parse::<f64>().ok()? - CENTRE_PX,
                v.trim().parse::<f64>().ok()? - CENTRE_PX,
            ))
        });
        let px = numbers.ok_or_else(|| self.wrong("`points`", place, "one place `x,y`"))?;
        let source = match self.attribute("source") {
            None | Some("") => default_source,
            Some(name) => ObservationSource::from_name(name).ok_or_else(|| {
                self.wrong("the attribute source", name, "manual, auto, detected or interpolated")
            })?,
        };
        Ok(Observation {
            source,
            keyframe: self.boolean("keyframe", starts)?,
            occluded: self.flag("occluded")?,
            uncertain: self.boolean("uncertain", false)?,
            line,
            ..Observation::manual(stamp, px)
        })
    }
}

/// Counts lines from element to element: from the start for each one would take for ever.
struct Lines<'a> {
    text: &'a str,
    passed: usize,
    line: u64,
}

impl Lines<'_> {
    /// Line of an element that comes after the ones asked for before, or is the last of them.
    fn of(&mut self, node: &Node<'_, '_>) -> u64 {
        let at = node.range().start;
        let between = self.text.as_bytes().get(self.passed..at).unwrap_or_default();
        self.line += between.iter().filter(|b| **b == b'\n').count() as u64;
        self.passed = self.passed.max(at);
        self.line
    }
}

/// Writes "CVAT for video 1.1". `frame_stamps` are the stamps of the camera's frames, which CVAT counts.
///
/// Where a point is not labelled for longer than is usual between its observations, it is said to be outside, so that
/// CVAT does not carry it on. The confidence and the tracker's version have no place there.
///
/// # Errors
/// [`io::Error`] of the writer, and for a stamp that is no frame or a name that XML cannot hold.
pub fn write_cvat(writer: &mut dyn Write, labels: &LabelSet, frame_stamps: &[Stamp]) -> io::Result<()> {
    writeln!(writer, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>")?;
    writeln!(writer, "  <meta>\n    <task>")?;
    if let Some(name) = &labels.dataset {
        writeln!(writer, "      <name>{}</name>", escaped(name)?)?;
    }
    writeln!(
        writer,
        "      <size>{}</size>\n      <mode>interpolation</mode>\n      <labels>",
        frame_stamps.len()
    )?;
    for point in labels.points() {
        writeln!(
            writer,
            "        <label>\n          <name>{}</name>\n          <type>points</type>",
            escaped(&point.name)?
        )?;
        writeln!(writer, "          <attributes>")?;
        for (name, kind, values) in [
            ("source", "select", "manual\nauto\ndetected\ninterpolated"),
            ("keyframe", "checkbox", "false"),
            ("uncertain", "checkbox", "false"),
        ] {
            writeln!(
                writer,
                "            <attribute><name>{name}</name><mutable>True</mutable><input_type>{kind}</input_type>\
                 <values>{values}</values></attribute>"
            )?;
        }
        writeln!(writer, "          </attributes>\n        </label>")?;
    }
    writeln!(writer, "      </labels>\n    </task>\n  </meta>")?;
    for (id, point) in labels.points().iter().enumerate() {
        write_track(writer, id, point, frame_stamps)?;
    }
    writeln!(writer, "</annotations>")
}

fn write_track(writer: &mut dyn Write, id: usize, point: &PointLabels, stamps: &[Stamp]) -> io::Result<()> {
    writeln!(writer, "  <track id=\"{id}\" label=\"{}\" source=\"manual\">", escaped(&point.name)?)?;
    let frames = point.observations.iter().map(|o| {
        stamps.binary_search(&o.stamp).map_err(|_| {
            let problem = format!("point {}: {} ns is none of the camera's frames", point.name, o.stamp);
            io::Error::new(io::ErrorKind::InvalidData, problem)
        })
    });
    let frames: Vec<usize> = frames.collect::<io::Result<_>>()?;
    // The step between labelled frames that is seen most often: labels at 10 Hz of frames at 20 Hz have gaps of two.
    let mut steps: BTreeMap<usize, usize> = BTreeMap::new();
    for pair in frames.windows(2) {
        *steps.entry(pair[1] - pair[0]).or_default() += 1;
    }
    let usual =
        steps.into_iter().max_by_key(|(step, count)| (*count, usize::MAX - step)).map_or(1, |(s, _)| s);
    for (i, (o, frame)) in point.observations.iter().zip(&frames).enumerate() {
        let place = format!("{:?},{:?}", o.px.u + CENTRE_PX, o.px.v + CENTRE_PX);
        let occluded = u8::from(o.occluded);
        writeln!(
            writer,
            "    <points frame=\"{frame}\" outside=\"0\" occluded=\"{occluded}\" keyframe=\"1\" points=\"{place}\" z_order=\"0\">"
        )?;
        for (name, value) in [
            ("source", o.source.name()),
            ("keyframe", if o.keyframe { "true" } else { "false" }),
            ("uncertain", if o.uncertain { "true" } else { "false" }),
        ] {
            writeln!(writer, "      <attribute name=\"{name}\">{value}</attribute>")?;
        }
        writeln!(writer, "    </points>")?;
        let next = frames.get(i + 1).copied().unwrap_or(stamps.len());
        let respawned = point.observations.get(i + 1).is_some_and(|n| n.keyframe);
        if next > frame + 1 && (next > frame + usual || respawned || i + 1 == frames.len()) {
            writeln!(
                writer,
                "    <points frame=\"{}\" outside=\"1\" occluded=\"0\" keyframe=\"1\" points=\"{place}\" z_order=\"0\"/>",
                frame + 1
            )?;
        }
    }
    writeln!(writer, "  </track>")
}

/// Text as XML holds it, in an element or an attribute.
fn escaped(text: &str) -> io::Result<String> {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\t' | '\n' | '\r' => out.push_str(&format!("&#{};", u32::from(c))),
            '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => {
                let problem = format!("the name {text:?} has a character that XML cannot hold");
                return Err(io::Error::new(io::ErrorKind::InvalidData, problem));
            }
            other => out.push(other),
        }
    }
    Ok(out)
}

#[cfg(test)]
#[path = "cvat_tests.rs"]
mod tests;
