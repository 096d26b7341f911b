//! Labels as "CVAT for video 1.1": a track of single points for each point.
//!
//! CVAT counts frames from 0 and puts (0, 0) at the corner of the top left pixel, half a pixel from its centre. A track's
//! label is the point's name. What CVAT has no word for stands in attributes: `source` as in the other formats,
//! `keyframe` (a segment starts; CVAT's own key frames are those that were not interpolated) and `uncertain`.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Document, Node, ParsingOptions};
use vice_core::camera::Pixel;
use vice_core::error::{DataError, DataResult, ErrorKind};
use vice_core::label::{LabelRow, LabelSet, Observation, ObservationSource};
use vice_core::suspicion::Suspicion;
use vice_core::time::Stamp;

use super::cvat_task::{self, FrameMap};
use super::{LabelFile, labels_from};
use crate::leniency::without_marks;

/// From the corner of a pixel to its centre.
pub(super) const CENTRE_PX: f64 = 0.5;
/// Elements, attributes and texts beyond which a file is refused: hours of labels have fewer.
const MAX_NODES: u32 = 8_000_000;

/// Reads the tracks of points of "CVAT for video 1.1". `frame_stamps` are the stamps of the camera's frames.
///
/// Where a file does not come from here: a shape that CVAT interpolated is `interpolated`; a track's first visible point,
/// and the first one after it was outside, is a key frame; of tracks with one label each is named `label-id`. The points
/// of a skeleton are named by their own labels. Tracks of other shapes are passed over, which a suspicion says.
///
/// # Errors
/// [`DataError`] with the line if it is no such XML, a value cannot be read or a frame is none of the camera's, if the
/// task has another number of frames than the camera, and as [`LabelSet::from_rows`].
pub fn read_cvat(bytes: &[u8], frame_stamps: &[Stamp]) -> DataResult<LabelSet> {
    read_cvat_file(bytes, frame_stamps).map(|file| file.labels)
}

/// The same, with what was passed over and the size of the images that were labelled.
///
/// # Errors
/// As [`read_cvat`].
pub fn read_cvat_file(bytes: &[u8], frame_stamps: &[Stamp]) -> DataResult<LabelFile> {
    let text = std::str::from_utf8(bytes)
        .map_err(|e| DataError::new("the XML is not UTF-8 text").byte(e.valid_up_to() as u64))?;
    let text = without_marks(text);
    let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let document = Document::parse_with_options(&text, options).map_err(|e| {
        let line = u64::from(e.pos().row);
        DataError::new("the labels are not XML").line(line).because(e)
    })?;
    let root = document.root_element();
    let mut lines = Lines { text: &text, passed: 0, line: 1 };
    if !root.has_tag_name("annotations") {
        let problem = format!("the XML is <{}>, not CVAT's <annotations>", root.tag_name().name());
        return Err(DataError::new(problem).line(lines.of(&root)));
    }
    let tracks: Vec<Node<'_, '_>> = root.children().filter(|n| n.has_tag_name("track")).collect();
    if tracks.is_empty() && root.children().any(|n| n.has_tag_name("image")) {
        return Err(DataError::new("these are CVAT's annotations of images, which have no tracks")
            .hint("export the task as `CVAT for video 1.1`"));
    }
    let with_points: Vec<Node<'_, '_>> =
        tracks.iter().filter(|t| shapes(t).next().is_some()).copied().collect();
    let mut file = LabelFile::default();
    let frames = frame_map(&root, &with_points, frame_stamps.len(), &mut file)?;
    let mut uses: BTreeMap<&str, usize> = BTreeMap::new();
    for track in &with_points {
        let names: BTreeSet<&str> = shapes(track).map(|(_, shape)| point_label(track, &shape)).collect();
        names.into_iter().for_each(|name| *uses.entry(name).or_default() += 1);
    }
    let reader = Reader { uses, frames, frame_stamps };
    let mut rows = Vec::new();
    for track in tracks {
        let line = lines.of(&track);
        if shapes(&track).next().is_none() {
            let label = track.attribute("label").unwrap_or_default();
            file.suspicions.add(
                Suspicion::new("tracks-passed-over", "", "tracks without points are passed over")
                    .evidence(format!("the first is `{label}` on line {line}")),
            );
            continue;
        }
        reader.track(&track, &mut lines, &mut rows)?;
    }
    file.labels = labels_from(rows)?;
    Ok(file)
}

/// The points of a track, on their own or in skeletons, each with the element that has its frame.
fn shapes<'a, 'i>(track: &Node<'a, 'i>) -> impl Iterator<Item = (Node<'a, 'i>, Node<'a, 'i>)> {
    track.children().flat_map(|child| {
        let in_skeleton = child.has_tag_name("skeleton");
        let alone = child.has_tag_name("points").then_some((child, child));
        let points = in_skeleton.then(|| child.children().filter(|n| n.has_tag_name("points")));
        alone.into_iter().chain(points.into_iter().flatten().map(move |points| (child, points)))
    })
}

/// A point of a skeleton has a label of its own.
fn point_label<'a>(track: &Node<'a, '_>, shape: &Node<'a, '_>) -> &'a str {
    shape.attribute("label").or_else(|| track.attribute("label")).unwrap_or_default()
}

/// Which frames the numbers are, by what the file says of its task.
fn frame_map(
    root: &Node<'_, '_>,
    tracks: &[Node<'_, '_>],
    camera_frames: usize,
    file: &mut LabelFile,
) -> DataResult<FrameMap> {
    let tasks = cvat_task::tasks(root)?;
    let of_tracks: BTreeSet<&str> = tracks.iter().filter_map(|t| t.attribute("task_id")).collect();
    let Some(task) = cvat_task::used(&tasks, &of_tracks)? else { return Ok(FrameMap::Same) };
    file.image_size_px = task.image_size_px;
    let number = |(holder, shape): (Node<'_, '_>, Node<'_, '_>)| {
        shape.attribute("frame").or_else(|| holder.attribute("frame"))?.parse::<usize>().ok()
    };
    let visible = |(_, shape): &(Node<'_, '_>, Node<'_, '_>)| shape.attribute("outside") != Some("1");
    let numbers = tracks.iter().flat_map(|t| shapes(t)).filter(visible).filter_map(number).collect();
    let (map, doubt) = cvat_task::map(task, &numbers, camera_frames)?;
    file.suspicions.extend(doubt);
    Ok(map)
}

struct Reader<'r> {
    /// How many tracks have a point of a label.
    uses: BTreeMap<&'r str, usize>,
    frames: FrameMap,
    frame_stamps: &'r [Stamp],
}

impl Reader<'_> {
    fn track(&self, track: &Node<'_, '_>, lines: &mut Lines<'_>, rows: &mut Vec<LabelRow>) -> DataResult<()> {
        let made_by_tool = matches!(track.attribute("source"), Some("auto" | "semi-auto"));
        // Points that were visible before; of the others the next one starts a segment.
        let mut visible: BTreeSet<&str> = BTreeSet::new();
        for (holder, node) in shapes(track) {
            let line = lines.of(&node);
            let label = point_label(track, &node);
            let point = match self.uses.get(label) {
                Some(n) if *n > 1 => format!("{label}-{}", track.attribute("id").unwrap_or_default()),
                _ => label.to_string(),
            };
            let row = Shape { node, holder, point: &point };
            if row.flag("outside").map_err(|e| e.line(line))? {
                visible.remove(label);
                continue;
            }
            let drawn =
                node.attribute("keyframe").is_none() || row.flag("keyframe").map_err(|e| e.line(line))?;
            let default_source = match (drawn, made_by_tool) {
                (false, _) => ObservationSource::Interpolated,
                (true, true) => ObservationSource::Auto,
                (true, false) => ObservationSource::Manual,
            };
            let starts = visible.insert(label);
            let observation =
                row.observation(self, default_source, starts, line).map_err(|e| e.line(line))?;
            rows.push(LabelRow { point, observation });
        }
        Ok(())
    }
}

/// One `<points>` of a track.
struct Shape<'a, 'input> {
    node: Node<'a, 'input>,
    /// The element that has its frame: itself, or its skeleton.
    holder: Node<'a, 'input>,
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
        reader: &Reader<'_>,
        default_source: ObservationSource,
        starts: bool,
        line: u64,
    ) -> DataResult<Observation> {
        let frame =
            self.node.attribute("frame").or_else(|| self.holder.attribute("frame")).unwrap_or_default();
        let number = frame.parse::<usize>().map_err(|_| self.wrong("the frame", frame, "a number"))?;
        let index = reader.frames.index(number).ok_or_else(|| {
            DataError::of_kind(
                ErrorKind::Contradictory,
                format!(
                    "point {}: frame {number} is none of the task's by its start_frame and step",
                    self.point
                ),
            )
        })?;
        let stamp = *reader.frame_stamps.get(index).ok_or_else(|| {
            let (point, known) = (self.point, reader.frame_stamps.len());
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

#[cfg(test)]
#[path = "cvat_tests.rs"]
mod tests;
