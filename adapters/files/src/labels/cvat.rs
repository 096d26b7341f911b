//! Labels as CVAT's XML (version 1.1), tracks of single points.
//!
//! CVAT counts frames and has the corner of the top left pixel at (0, 0), so that its centre is at (0.5, 0.5) there. Its
//! `keyframe` is a frame that a person placed, its others are interpolated; the start of a segment, which is a key
//! frame here, is the attribute `keyframe`, who made an observation the attribute `source`, doubt `uncertain`. In a
//! file without these attributes a segment starts where a track does, and where it comes back from outside.

use std::io::{self, Write};

use roxmltree::{Document, Node};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult};
use vice_core::label::{LabelRow, LabelSet, Observation, ObservationSource, PointLabels};
use vice_core::time::Stamp;

use super::labels_from;

/// Shift from here to CVAT, pixels.
const HALF: f64 = 0.5;

/// Reads tracks of points. A track's name is its `label`, with its `id` where several have the same.
///
/// # Errors
/// [`DataError`] with the line if it is no such XML, a frame is not among `frame_stamps`, a shape is no single point, and
/// as [`LabelSet::from_rows`].
pub fn read_cvat(bytes: &[u8], frame_stamps: &[Stamp]) -> DataResult<LabelSet> {
    let text = std::str::from_utf8(bytes).map_err(|e| DataError::new("is no text in UTF-8").because(e))?;
    let document = Document::parse(text)
        .map_err(|e| DataError::new("is no XML that can be read").line(u64::from(e.pos().row)).because(e))?;
    let root = document.root_element();
    if root.tag_name().name() != "annotations" {
        return Err(DataError::new("is no XML of CVAT: <annotations> is expected"));
    }
    let tracks: Vec<Node<'_, '_>> = root.children().filter(|n| n.has_tag_name("track")).collect();
    let label = |track: &Node<'_, '_>| track.attribute("label").unwrap_or_default().to_string();
    let mut rows = Vec::new();
    for track in &tracks {
        let name = label(track);
        let alone = tracks.iter().filter(|t| label(t) == name).count() == 1;
        let point = match track.attribute("id") {
            Some(id) if !alone => format!("{name}-{id}"),
            _ => name,
        };
        let mut outside = true;
        for shape in track.children().filter(Node::is_element) {
            let reader = Shape { node: shape, text };
            if reader.flag("outside")? {
                outside = true;
                continue;
            }
            let observation = reader.observation(outside, frame_stamps)?;
            outside = false;
            rows.push(LabelRow { point: point.clone(), observation });
        }
    }
    labels_from(rows)
}

struct Shape<'a, 'i> {
    node: Node<'a, 'i>,
    text: &'i str,
}

impl Shape<'_, '_> {
    fn observation(&self, starts: bool, frame_stamps: &[Stamp]) -> DataResult<Observation> {
        if !self.node.has_tag_name("points") {
            let found = self.node.tag_name().name();
            return Err(self.error(format!("a track of <{found}>: only tracks of points are read")));
        }
        let frame = self.node.attribute("frame").unwrap_or_default();
        let stamp = frame.parse::<usize>().ok().and_then(|f| frame_stamps.get(f));
        let stamp = stamp.ok_or_else(|| {
            self.error(format!("frame `{frame}` is not among the camera's {} frames", frame_stamps.len()))
                .hint("is this the data set that was labelled?")
        })?;
        let points = self.node.attribute("points").unwrap_or_default();
        let numbers: Option<Vec<f64>> = points.split(',').map(|n| n.trim().parse().ok()).collect();
        let Some([u, v]) = numbers.as_deref() else {
            return Err(self.error(format!("points=\"{points}\": one point `x,y` is expected")));
        };
        let source = match self.attribute("source") {
            Some(name) => ObservationSource::from_name(name)
                .ok_or_else(|| self.error(format!("source `{name}` is not known")))?,
            None if self.flag_or("keyframe", true)? => ObservationSource::Manual,
            None => ObservationSource::Interpolated,
        };
        Ok(Observation {
            source,
            keyframe: self.attribute("keyframe").map_or(starts, |a| a == "true"),
            occluded: self.flag("occluded")?,
            uncertain: self.attribute("uncertain") == Some("true"),
            line: self.line(),
            ..Observation::manual(*stamp, Pixel::new(u - HALF, v - HALF))
        })
    }

    /// The text of an `<attribute name="...">`.
    fn attribute(&self, name: &str) -> Option<&str> {
        let of_name = |n: &Node<'_, '_>| n.has_tag_name("attribute") && n.attribute("name") == Some(name);
        self.node.children().find(of_name).and_then(|n| n.text()).map(str::trim)
    }

    fn flag(&self, name: &str) -> DataResult<bool> {
        self.flag_or(name, false)
    }

    fn flag_or(&self, name: &str, missing: bool) -> DataResult<bool> {
        match self.node.attribute(name) {
            None => Ok(missing),
            Some("0") => Ok(false),
            Some("1") => Ok(true),
            Some(other) => Err(self.error(format!("{name}=\"{other}\" is neither 0 nor 1"))),
        }
    }

    fn error(&self, problem: String) -> DataError {
        DataError::new(problem).line(self.line())
    }

    fn line(&self) -> u64 {
        let before = self.text.get(..self.node.range().start).unwrap_or_default();
        before.bytes().filter(|b| *b == b'\n').count() as u64 + 1
    }
}

/// Writes a track for each point. Observations at stamps that are no frame are left out, since CVAT counts frames; the
/// confidence and the tracker's version have no place there.
///
/// # Errors
/// [`io::Error`] of the writer.
pub fn write_cvat(
    writer: &mut dyn Write,
    labels: &LabelSet,
    frame_stamps: &[Stamp],
    (width, height): (u32, u32),
) -> io::Result<()> {
    writeln!(writer, "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<annotations>\n  <version>1.1</version>")?;
    writeln!(
        writer,
        "  <meta>\n    <task>\n      <size>{}</size>\n      <mode>interpolation</mode>\n      \
         <original_size><width>{width}</width><height>{height}</height></original_size>\n      <labels>",
        frame_stamps.len()
    )?;
    for point in labels.points() {
        writeln!(writer, "        <label><name>{}</name><type>points</type></label>", escaped(&point.name))?;
    }
    writeln!(writer, "      </labels>\n    </task>\n  </meta>")?;
    for (id, point) in labels.points().iter().enumerate() {
        let name = escaped(&point.name);
        writeln!(writer, "  <track id=\"{id}\" label=\"{name}\" source=\"manual\">")?;
        write_track(writer, point, frame_stamps)?;
        writeln!(writer, "  </track>")?;
    }
    writeln!(writer, "</annotations>")
}

fn write_track(writer: &mut dyn Write, point: &PointLabels, frame_stamps: &[Stamp]) -> io::Result<()> {
    let at = |o: &Observation| frame_stamps.binary_search(&o.stamp).ok();
    let mut rest = point.observations.iter().filter_map(|o| Some((at(o)?, o))).peekable();
    while let Some((frame, o)) = rest.next() {
        write_shape(writer, frame, o, false)?;
        // CVAT would carry a point on until the next shape.
        if rest.peek().is_none_or(|(next, _)| *next > frame + 1) && frame + 1 < frame_stamps.len() {
            write_shape(writer, frame + 1, o, true)?;
        }
    }
    Ok(())
}

fn write_shape(writer: &mut dyn Write, frame: usize, o: &Observation, outside: bool) -> io::Result<()> {
    let flag = |set: bool| if set { 1 } else { 0 };
    writeln!(
        writer,
        "    <points frame=\"{frame}\" outside=\"{}\" occluded=\"{}\" keyframe=\"1\" points=\"{},{}\" z_order=\"0\">\
         <attribute name=\"keyframe\">{}</attribute><attribute name=\"source\">{}</attribute>\
         <attribute name=\"uncertain\">{}</attribute></points>",
        flag(outside),
        flag(o.occluded),
        o.px.u + HALF,
        o.px.v + HALF,
        o.keyframe && !outside,
        o.source.name(),
        o.uncertain
    )
}

fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            '\n' | '\t' | '\r' => out.push_str(&format!("&#{};", u32::from(c))),
            // XML has no way to write these.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}
