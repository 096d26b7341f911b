//! Plots as SVG, each with a sentence computed from the data that says what it shows.
//!
//! The writer is our own and small. A plotting crate sets colours and fonts as attributes of every element, so that a
//! page in dark mode or on paper cannot change them, rounds to whole pixels, and takes an element for each dot.

pub(crate) mod all_streams;
pub(crate) mod axis;
pub(crate) mod coordinates;
pub(crate) mod correlation;
pub(crate) mod depth_difference;
pub(crate) mod from_above;
pub(crate) mod over_time;
pub(crate) mod panel;
pub(crate) mod picture;
pub(crate) mod spread;
pub(crate) mod timeline;
pub(crate) mod trajectory;
pub(crate) mod vectors;

/// A plot for a page.
pub(crate) struct Plot {
    pub(crate) title: &'static str,
    pub(crate) svg: String,
    /// What it shows, in a sentence or two.
    pub(crate) says: String,
}

/// Width of a plot in its own units: narrow enough that its letters can be read on a phone.
pub(crate) const WIDTH: f64 = 480.0;
/// Space for the numbers of the y axis.
pub(crate) const LEFT: f64 = 64.0;
/// Space on the right.
pub(crate) const RIGHT: f64 = 20.0;
/// Dots in a plot.
pub(crate) const MAX_DOTS: usize = 2500;

/// Errors below this are none: no label is that good.
pub(crate) const NONE_PX: f64 = 0.01;

/// The colour class of an estimate by its place among them.
pub(crate) fn estimate_class(index: usize) -> &'static str {
    ["e0", "e1", "e2", "e3", "e4", "e5"][index % 6]
}
