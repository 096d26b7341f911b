//! Panels over one time, one under the other: all of a page have the same seconds at the same place.

use std::collections::BTreeSet;

use vice_core::time::Stamp;

use super::axis::Axis;
use super::panel::Panel;
use super::picture::{Edges, Picture};
use super::{LEFT, RIGHT, WIDTH};
use crate::report::numbers::time_zero;
use crate::result::ResultDocument;

const PANEL_HEIGHT: f64 = 120.0;
const BETWEEN: f64 = 46.0;
/// More key frames than this are marked by dots alone.
const MAX_LINES: usize = 80;

/// The time of a document.
pub(crate) struct Timeline {
    zero: Stamp,
    x: Axis,
    /// Where points start anew, seconds.
    keyframes_s: Vec<f64>,
}

impl Timeline {
    /// From the first label to the last, and whatever else there is a value at.
    pub(crate) fn of(document: &ResultDocument) -> Self {
        let zero = time_zero(document);
        let seconds = |stamp: Stamp| stamp.since(zero).as_secs_f64();
        let samples = document.pixel.iter().flat_map(|p| p.samples.iter().map(|s| s.timestamp_ns));
        let keyframes: BTreeSet<Stamp> =
            document.pixel.iter().flat_map(|p| p.keyframes.iter().map(|k| k.timestamp_ns)).collect();
        let frames = document.trajectory.iter().flat_map(|t| t.frames.iter().map(|f| f.timestamp_ns));
        let poses = document.paths.iter().flat_map(|p| p.poses.iter().map(|p| p.timestamp_ns));
        let all = samples.chain(keyframes.iter().copied()).chain(frames).chain(poses);
        let x = Axis::exactly(all.map(seconds), 6);
        Self { zero, x, keyframes_s: keyframes.into_iter().map(seconds).collect() }
    }

    /// Values at stamps, as seconds and values.
    pub(crate) fn curve(&self, values: impl IntoIterator<Item = (Stamp, f64)>) -> Vec<(f64, f64)> {
        values.into_iter().map(|(stamp, value)| (self.seconds(stamp), value)).collect()
    }

    pub(crate) fn seconds(&self, stamp: Stamp) -> f64 {
        stamp.since(self.zero).as_secs_f64()
    }

    pub(crate) fn keyframes_s(&self) -> &[f64] {
        &self.keyframes_s
    }

    /// A picture with room for so many panels.
    pub(crate) fn picture(panels: usize) -> Picture {
        Picture::new(WIDTH, panels as f64 * (PANEL_HEIGHT + BETWEEN) + 22.0)
    }

    /// Draws the panel at `index` of `panels`, and in it what `draw` draws.
    pub(crate) fn panel(
        &self,
        picture: &mut Picture,
        (index, panels): (usize, usize),
        (title, unit): (&str, &str),
        y: Axis,
        draw: impl FnOnce(&mut Picture, &Panel),
    ) {
        let panel = Panel {
            left: LEFT,
            top: 30.0 + index as f64 * (PANEL_HEIGHT + BETWEEN),
            width: WIDTH - LEFT - RIGHT,
            height: PANEL_HEIGHT,
            x: self.x.clone(),
            y,
        };
        let last = index + 1 == panels;
        let title = if unit.is_empty() { title.to_string() } else { format!("{title} ({unit})") };
        panel.draw_axes(picture, last.then_some("seconds"), Some(&title));
        let edges = Edges { x: panel.x.ends(), y: panel.y.ends(), unit };
        picture.begin_view((panel.left, panel.top), (panel.width, panel.height), &edges);
        self.mark(picture, &panel);
        draw(picture, &panel);
        picture.end_view();
    }

    /// Dotted lines where points start anew.
    fn mark(&self, picture: &mut Picture, panel: &Panel) {
        if self.keyframes_s.len() <= MAX_LINES {
            let lines = self.keyframes_s.iter().map(|t| {
                let x = panel.place_x(*t);
                ((x, panel.top), (x, panel.top + panel.height))
            });
            picture.strokes("mark", lines);
        }
    }

    /// Black dots where points start anew, at the foot of a panel.
    pub(crate) fn dots(&self, picture: &mut Picture, panel: &Panel) {
        let foot = panel.top + panel.height;
        picture.dots("big ink", self.keyframes_s.iter().map(|t| (panel.place_x(*t), foot)));
    }
}
