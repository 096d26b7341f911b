//! Error vectors over the image. A pattern in them points at intrinsics or extrinsics.

use vice_core::result::PixelPart;
use vice_core::statistics::{quantile, sorted};

use super::axis::Axis;
use super::panel::{Panel, how_many};
use super::picture::Picture;
use super::{MAX_DOTS, NONE_PX, Plot, WIDTH};

/// What of the errors is common to all: `error = shift + zoom q + turn J q`, `q` the label from the mean of all labels.
/// The three parts and the rest are orthogonal, so that their shares of the squared error add up to one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Pattern {
    shift_px: [f64; 2],
    /// Pixels of error for a pixel of distance from the mean of the labels.
    zoom: f64,
    turn_rad: f64,
    shift_share: f64,
    zoom_share: f64,
    turn_share: f64,
}

/// The vectors from each label to where the stream carried the point.
/// `under` names a picture of the page to draw them on.
pub(crate) fn vectors(
    part: &PixelPart,
    image_size_px: Option<[u32; 2]>,
    class: &str,
    under: Option<&str>,
) -> Option<Plot> {
    let finite = |s: &&vice_core::result::Sample| {
        [s.label_px.u, s.label_px.v, s.tracked_px.u, s.tracked_px.v].iter().all(|v| v.abs() < 1e9)
    };
    let samples: Vec<_> = part.samples.iter().filter(finite).collect();
    let vectors: Vec<([f64; 2], [f64; 2])> = samples
        .iter()
        .map(|s| {
            let (l, t) = (s.label_px, s.tracked_px);
            ([l.u, l.v], [t.u - l.u, t.v - l.v])
        })
        .collect();
    let lengths = sorted(vectors.iter().map(|(_, e)| e[0].hypot(e[1])).collect());
    let long = quantile(&lengths, 0.9)?;
    let [columns, rows] = match image_size_px {
        Some([c, r]) if c > 0 && r > 0 => [f64::from(c), f64::from(r)],
        _ => [0, 1].map(|i| vectors.iter().map(|v| v.0[i]).fold(1.0, f64::max)),
    };
    let factor = magnification(long.max(NONE_PX), columns);
    let width = WIDTH - 24.0;
    let height = (width * rows / columns).clamp(80.0, 520.0);
    let panel = Panel {
        left: 12.0,
        top: 24.0,
        width,
        height,
        x: Axis::exactly([-0.5, columns - 0.5], 4),
        y: Axis::exactly([-0.5, rows - 0.5], 4),
    };
    let mut picture = Picture::new(WIDTH, height + 36.0);
    picture.text("title", (12.0, 14.0), super::picture::Anchor::Start, &format!("error vectors × {factor}"));
    if let Some(name) = under {
        picture.under(name, (panel.left, panel.top), (width, height));
    }
    picture.frame("", (panel.left, panel.top), (width, height));
    // Down in the image is down in the picture.
    let place = |[u, v]: [f64; 2]| (panel.place_x(u), panel.top + panel.height * panel.y.place(v));
    let step = vectors.len().div_ceil(MAX_DOTS).max(1);
    let shown = || vectors.iter().step_by(step);
    let end = |(at, e): &([f64; 2], [f64; 2])| [at[0] + factor * e[0], at[1] + factor * e[1]];
    picture.strokes(&format!("thin {class}"), shown().map(|v| (place(v.0), place(end(v)))));
    let many = how_many(vectors.len());
    picture.dots(&format!("{many} label"), shown().map(|v| place(v.0)));
    picture.dots(&format!("{many} {class}"), shown().map(|v| place(end(v))));
    let says = match lengths.last() {
        Some(longest) if *longest < NONE_PX => {
            format!("No vector is longer than {NONE_PX} px: the points are carried to where the labels are.")
        }
        _ => says(&vectors),
    };
    Some(Plot { title: "Error vectors over the image", svg: picture.into_svg(&says), says })
}

/// A round factor that makes a long vector about a tenth of the image.
fn magnification(long_px: f64, columns: f64) -> f64 {
    let wanted = 0.1 * columns / long_px;
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0];
    steps.into_iter().rev().find(|s| *s <= wanted).unwrap_or(0.1)
}

fn pattern(vectors: &[([f64; 2], [f64; 2])]) -> Option<Pattern> {
    if vectors.len() < 4 {
        return None;
    }
    let n = vectors.len() as f64;
    let mean = |f: fn(&([f64; 2], [f64; 2])) -> f64| vectors.iter().map(f).sum::<f64>() / n;
    let centre = [mean(|v| v.0[0]), mean(|v| v.0[1])];
    let shift = [mean(|v| v.1[0]), mean(|v| v.1[1])];
    let (mut along, mut across, mut spread, mut total) = (0.0, 0.0, 0.0, 0.0);
    for (at, e) in vectors {
        let q = [at[0] - centre[0], at[1] - centre[1]];
        along += q[0] * e[0] + q[1] * e[1];
        across += q[0] * e[1] - q[1] * e[0];
        spread += q[0] * q[0] + q[1] * q[1];
        total += e[0] * e[0] + e[1] * e[1];
    }
    let share = |part: f64| part / total;
    let found = Pattern {
        shift_px: shift,
        zoom: along / spread,
        turn_rad: across / spread,
        shift_share: share(n * (shift[0] * shift[0] + shift[1] * shift[1])),
        zoom_share: share(along * along / spread),
        turn_share: share(across * across / spread),
    };
    [found.zoom, found.shift_share, found.zoom_share, found.turn_share]
        .iter()
        .all(|v| v.is_finite())
        .then_some(found)
}

fn says(vectors: &[([f64; 2], [f64; 2])]) -> String {
    let Some(p) = pattern(vectors) else {
        return "Blue dots are labels, lines lead to where the points were carried; too few of them show a pattern.".to_string();
    };
    let signed = |v: f64| format!("{v:+.2}").replace('-', "−");
    let percent = |v: f64| format!("{:.0} %", 100.0 * v);
    let numbers = format!(
        "{} of the squared error is a shift of ({}, {}) px common to all labels, {} a zoom by {} %, {} a turn by {}°",
        percent(p.shift_share),
        signed(p.shift_px[0]),
        signed(p.shift_px[1]),
        percent(p.zoom_share),
        signed(100.0 * p.zoom),
        percent(p.turn_share),
        signed(p.turn_rad.to_degrees()),
    );
    let rest = 1.0 - p.shift_share - p.zoom_share - p.turn_share;
    let verdict = if rest > 0.6 {
        "most of it has no such pattern."
    } else if p.shift_share >= p.zoom_share.max(p.turn_share) {
        "a common shift is what a wrong direction of the camera or a clock that is off looks like."
    } else if p.zoom_share >= p.turn_share {
        "a zoom is what a wrong focal length or depth looks like."
    } else {
        "a turn is what a wrong roll about the optical axis looks like."
    };
    format!("{numbers}: {verdict}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shift_zoom_and_turn_are_told_apart() {
        let places = [[0.0, 0.0], [700.0, 10.0], [30.0, 400.0], [600.0, 450.0], [333.0, 222.0]];
        let centre = [0, 1].map(|i| places.iter().map(|p| p[i]).sum::<f64>() / 5.0);
        let error = |p: [f64; 2]| {
            let q = [p[0] - centre[0], p[1] - centre[1]];
            [3.0 + 0.01 * q[0] - 0.02 * q[1], -1.0 + 0.01 * q[1] + 0.02 * q[0]]
        };
        let found = pattern(&places.map(|p| (p, error(p)))).unwrap();
        assert!((found.shift_px[0] - 3.0).abs() < 1e-9 && (found.shift_px[1] + 1.0).abs() < 1e-9);
        assert!((found.zoom - 0.01).abs() < 1e-12 && (found.turn_rad - 0.02).abs() < 1e-12);
        assert!((found.shift_share + found.zoom_share + found.turn_share - 1.0).abs() < 1e-12);
        assert!(says(&places.map(|p| (p, [2.0, 2.0]))).contains("clock"));
        assert_eq!(pattern(&[([1.0, 1.0], [0.0, 0.0]); 5]), None);
        assert_eq!((magnification(98.0, 752.0), magnification(0.5, 752.0)), (0.5, 100.0));
    }
}
