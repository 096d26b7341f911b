//! An SVG being written. Colours, strokes and letters are classes of `plot.css`, so that a plot follows light, dark and
//! print; many dots are one path, so that a thousand of them take a few kilobytes.

use std::fmt::Write;

use crate::report::html::escape::push_escaped;
use crate::report::keys::Key;

/// The classes, for pages and for files of their own.
pub(crate) const CSS: &str = include_str!("plot.css");

/// A place in the picture, in its own units from the top left.
pub(crate) type Place = (f64, f64);

/// What the edges of a panel are worth.
pub(crate) struct Edges<'a> {
    /// Left and right, seconds.
    pub(crate) x: [f64; 2],
    /// Bottom and top.
    pub(crate) y: [f64; 2],
    /// The unit of y.
    pub(crate) unit: &'a str,
}

/// Where a text stands against its place.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// The picture.
pub(crate) struct Picture {
    width: f64,
    height: f64,
    body: String,
}

impl Picture {
    pub(crate) const fn new(width: f64, height: f64) -> Self {
        Self { width, height, body: String::new() }
    }

    pub(crate) fn text(&mut self, class: &str, (x, y): Place, anchor: Anchor, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        self.push(format_args!(
            "<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">"
        ));
        push_escaped(&mut self.body, text);
        self.body.push_str("</text>");
    }

    /// A line through places.
    pub(crate) fn line(&mut self, class: &str, places: impl IntoIterator<Item = Place>) {
        let mut places = places.into_iter();
        let Some((x, y)) = places.next() else { return };
        self.push(format_args!("<path class=\"line {class}\" d=\"M{x:.1} {y:.2}"));
        for (x, y) in places {
            self.push(format_args!("L{x:.1} {y:.2}"));
        }
        self.body.push_str("\"/>");
    }

    /// Short lines, as one path.
    pub(crate) fn strokes(&mut self, class: &str, strokes: impl IntoIterator<Item = (Place, Place)>) {
        self.push(format_args!("<path class=\"line {class}\" d=\""));
        for ((x, y), (to_x, to_y)) in strokes {
            self.push(format_args!("M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}"));
        }
        self.body.push_str("\"/>");
    }

    /// Round dots, as one path: strokes without length have round ends.
    pub(crate) fn dots(&mut self, class: &str, places: impl IntoIterator<Item = Place>) {
        self.push(format_args!("<path class=\"dots {class}\" d=\""));
        for (x, y) in places {
            self.push(format_args!("M{x:.1} {y:.1}h0"));
        }
        self.body.push_str("\"/>");
    }

    /// A filled rectangle.
    pub(crate) fn bar(&mut self, class: &str, (x, y): Place, (width, height): (f64, f64)) {
        let (width, height) = (width.max(0.0), height.max(0.0));
        self.push(format_args!(
            "<rect class=\"bar {class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
        ));
    }

    /// What belongs to a pose stream from here to [`Self::end`]: a page can hide it, and tells its name.
    pub(crate) fn begin_stream(&mut self, key: &Key) {
        self.push(format_args!("<g data-s=\"{}\" data-name=\"", key.id));
        push_escaped(&mut self.body, &key.name);
        self.body.push_str("\">");
    }

    /// Closes the group that was begun last.
    pub(crate) fn end(&mut self) {
        self.body.push_str("</g>");
    }

    /// A panel from here to [`Self::end_view`] of which a page can show a part: where it lies, and what its edges are worth.
    pub(crate) fn begin_view(&mut self, (x, y): Place, (width, height): (f64, f64), edges: &Edges<'_>) {
        let [x0, x1] = edges.x;
        let [y0, y1] = edges.y;
        self.push(format_args!(
            "<svg class=\"view\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" viewBox=\"{x:.1} {y:.1} {width:.1} {height:.1}\" preserveAspectRatio=\"none\" data-x0=\"{x0}\" data-x1=\"{x1}\" data-y0=\"{y0}\" data-y1=\"{y1}\" data-unit=\"{}\">",
            edges.unit
        ));
    }

    /// Closes a panel.
    pub(crate) fn end_view(&mut self) {
        self.body.push_str("</svg>");
    }

    /// A group of marks of an axis, which a page draws anew when it shows a part.
    pub(crate) fn begin_marks(&mut self) {
        self.body.push_str("<g class=\"xmarks\">");
    }

    /// A picture that the page holds under this name, stretched over a rectangle.
    pub(crate) fn under(&mut self, name: &str, (x, y): Place, (width, height): (f64, f64)) {
        self.push(format_args!(
            "<use class=\"under\" href=\"#{name}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
        ));
    }

    /// An outlined rectangle.
    pub(crate) fn frame(&mut self, class: &str, (x, y): Place, (width, height): (f64, f64)) {
        self.push(format_args!(
            "<rect class=\"frame {class}\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\"/>"
        ));
    }

    /// The element for a page, with what those hear who do not see it.
    pub(crate) fn into_svg(self, describes: &str) -> String {
        self.close("", "", describes)
    }

    /// A file of its own.
    pub(crate) fn into_file(self, describes: &str) -> String {
        let style = format!("<style>{CSS}</style>");
        let mut text = self.close(" xmlns=\"http://www.w3.org/2000/svg\"", &style, describes);
        text.push('\n');
        text
    }

    fn close(self, namespace: &str, style: &str, describes: &str) -> String {
        let mut svg = format!(
            "<svg{namespace} class=\"plot\" viewBox=\"0 0 {:.0} {:.0}\" role=\"img\" aria-label=\"",
            self.width, self.height
        );
        push_escaped(&mut svg, describes);
        svg.push_str("\">");
        svg.push_str(style);
        svg.push_str(&self.body);
        svg.push_str("</svg>");
        svg
    }

    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        // Writing to a string does not fail.
        let _ = self.body.write_fmt(text);
    }
}
