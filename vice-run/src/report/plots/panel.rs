//! A rectangle with two axes in a picture, and what is drawn in it.

use vice_core::statistics::middle;

use super::MAX_DOTS;
use super::axis::Axis;
use super::picture::{Anchor, Picture, Place};
use crate::report::keys::Key;

/// More places than this on a line add nothing that can be seen.
const MAX_PLACES: usize = 1600;

/// The panel: where it lies in the picture, and its axes.
pub(crate) struct Panel {
    pub(crate) left: f64,
    pub(crate) top: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
}

impl Panel {
    /// Draws grid and marks; the title of y stands over the panel, that of x below. An axis without a title has no numbers.
    pub(crate) fn draw_axes(&self, picture: &mut Picture, x_title: Option<&str>, y_title: Option<&str>) {
        let (right, bottom) = (self.left + self.width, self.top + self.height);
        for (value, label) in self.y.ticks() {
            let y = self.place_y(value);
            picture.line("grid", [(self.left, y), (right, y)]);
            if y_title.is_some() {
                picture.text("", (self.left - 6.0, y + 4.0), Anchor::End, &label);
            }
        }
        picture.begin_marks();
        for (value, label) in self.x.ticks() {
            let x = self.place_x(value);
            picture.line("grid", [(x, self.top), (x, bottom)]);
            if x_title.is_some() {
                picture.text("", (x, bottom + 15.0), Anchor::Middle, &label);
            }
        }
        picture.end();
        picture.line("axis", [(self.left, bottom), (right, bottom)]);
        if let Some(title) = y_title {
            picture.text("title", (self.left - 34.0, self.top - 12.0), Anchor::Start, title);
        }
        if let Some(title) = x_title {
            picture.text("", (right, bottom + 31.0), Anchor::End, title);
        }
    }

    pub(crate) fn place_x(&self, x: f64) -> f64 {
        self.left + self.width * self.x.place(x)
    }

    pub(crate) fn place_y(&self, y: f64) -> f64 {
        self.top + self.height * (1.0 - self.y.place(y))
    }

    pub(crate) fn place(&self, (x, y): (f64, f64)) -> Place {
        (self.place_x(x), self.place_y(y))
    }

    /// A line through values that ascend in x, broken where `gap` is exceeded.
    pub(crate) fn line(&self, picture: &mut Picture, class: &str, values: &[(f64, f64)], gap: f64) {
        for run in values.chunk_by(|a, b| b.0 - a.0 <= gap) {
            if let [single] = run {
                picture.dots(class, [self.place(*single)]);
            }
            picture.line(class, extremes(run, MAX_PLACES).into_iter().map(|v| self.place(v)));
        }
    }

    /// The line of a stream, which can be switched off, broken where values are missing.
    pub(crate) fn stream(&self, picture: &mut Picture, key: &Key, values: &[(f64, f64)]) {
        picture.begin_stream(key);
        self.line(picture, key.class, values, usual_gap(values));
        picture.end();
    }

    /// Dots, smaller and fainter where there are many; where there are too many, every n-th of them.
    pub(crate) fn dots(&self, picture: &mut Picture, class: &str, values: &[(f64, f64)]) {
        let step = values.len().div_ceil(MAX_DOTS).max(1);
        let class = format!("{} {class}", how_many(values.len()));
        picture.dots(&class, values.iter().step_by(step).map(|v| self.place(*v)));
    }
}

/// The class of dots by their number.
pub(crate) const fn how_many(dots: usize) -> &'static str {
    if dots > 300 { "many" } else { "few" }
}

/// At most so many of the values, the lowest and the highest of each stretch among them.
pub(crate) fn extremes(values: &[(f64, f64)], most: usize) -> Vec<(f64, f64)> {
    if values.len() <= most {
        return values.to_vec();
    }
    let stretch = values.len().div_ceil((most / 2).max(1));
    let mut kept = Vec::with_capacity(most);
    for run in values.chunks(stretch) {
        let by = |a: &(usize, &(f64, f64)), b: &(usize, &(f64, f64))| a.1.1.total_cmp(&b.1.1);
        let low = run.iter().enumerate().min_by(by).map(|v| v.0);
        let high = run.iter().enumerate().max_by(by).map(|v| v.0);
        let (Some(low), Some(high)) = (low, high) else { continue };
        kept.push(run[low.min(high)]);
        if low != high {
            kept.push(run[low.max(high)]);
        }
    }
    kept
}

/// Three times the usual distance of neighbours in x, above which a line is broken.
pub(crate) fn usual_gap(values: &[(f64, f64)]) -> f64 {
    let mut steps: Vec<f64> = values.windows(2).map(|w| w[1].0 - w[0].0).collect();
    middle(&mut steps, f64::total_cmp).map_or(f64::INFINITY, |step| 3.0 * step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_line_keeps_its_peaks() {
        let values: Vec<(f64, f64)> =
            (0..10_000).map(|i| (f64::from(i), if i == 4321 { 9.0 } else { 0.0 })).collect();
        let kept = extremes(&values, 100);
        assert!(kept.len() <= 100 && kept.contains(&(4321.0, 9.0)));
        assert!(kept.windows(2).all(|w| w[0].0 < w[1].0));
        assert_eq!(extremes(&values[..50], 100).len(), 50);
        assert_eq!(usual_gap(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (9.0, 0.0)]), 3.0);
    }
}
