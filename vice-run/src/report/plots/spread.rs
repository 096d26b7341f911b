//! How the errors are spread: over the points, and over their sizes.

use vice_core::result::PixelPart;
use vice_core::statistics::{quantile, sorted};

use super::axis::Axis;
use super::panel::Panel;
use super::picture::{Anchor, Picture};
use super::{LEFT, NONE_PX, Plot, RIGHT, WIDTH};
use crate::report::numbers::{errors_by_point, px, rms};
use crate::text::printable;

/// More points than this are left out of the picture, the best first.
const MAX_BARS: usize = 24;
/// Columns of the histogram.
const BINS: usize = 30;

/// RMSE_2D of each point, the worst on top.
pub(crate) fn per_point(part: &PixelPart, class: &str) -> Option<Plot> {
    let mut points: Vec<(String, f64, usize)> = errors_by_point(part)
        .into_iter()
        .filter_map(|(name, errors)| Some((shortened(&printable(&name.0)), rms(&errors)?, errors.len())))
        .collect();
    points.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (worst, best) = (points.first()?.clone(), points.last()?.clone());
    let shown = &points[..points.len().min(MAX_BARS)];
    let row = if shown.len() > 8 { 19.0 } else { 27.0 };
    let longest = shown.iter().map(|p| p.0.chars().count()).max().unwrap_or(0);
    let left = (16.0 + 7.0 * longest as f64).clamp(LEFT, 170.0);
    let mut picture = Picture::new(WIDTH, 24.0 + row * shown.len() as f64 + 40.0);
    let panel = Panel {
        left,
        top: 24.0,
        width: WIDTH - left - RIGHT - 44.0,
        height: row * shown.len() as f64,
        x: Axis::from_zero(shown.iter().map(|p| p.1).chain([NONE_PX]), 4),
        y: Axis::exactly([0.0, 1.0], 1),
    };
    for (value, label) in panel.x.ticks() {
        let x = panel.place_x(value);
        picture.line("grid", [(x, panel.top), (x, panel.top + panel.height)]);
        picture.text("", (x, panel.top + panel.height + 15.0), Anchor::Middle, &label);
    }
    picture.text("title", (12.0, 14.0), Anchor::Start, "RMSE_2D of each point (px)");
    for (place, (name, rmse, _)) in shown.iter().enumerate() {
        let top = panel.top + row * place as f64 + 3.0;
        let end = panel.place_x(*rmse);
        picture.bar(class, (left, top), (end - left, row - 6.0));
        let middle = top + (row - 6.0) / 2.0 + 4.0;
        picture.text("name", (left - 6.0, middle), Anchor::End, name);
        picture.text("", (end + 5.0, middle), Anchor::Start, px(*rmse).trim_end_matches(" px"));
    }
    let says = match points.len() {
        1 => format!("One point, {} over {} labels.", px(worst.1), worst.2),
        n => {
            let left_out =
                if n > MAX_BARS { format!(" The {MAX_BARS} worst of {n} are shown.") } else { String::new() };
            let alike =
                if worst.1 <= (1.5 * best.1).max(NONE_PX) { "The points agree" } else { "The points differ" };
            format!(
                "{alike}: from {} (point {}) to {} (point {}).{left_out}",
                px(best.1),
                best.0,
                px(worst.1),
                worst.0
            )
        }
    };
    Some(Plot { title: "Error per point", svg: picture.into_svg(&says), says })
}

/// How many labels have which error.
pub(crate) fn histogram(part: &PixelPart, class: &str) -> Option<Plot> {
    let errors = sorted(part.samples.iter().map(|s| s.error_px).filter(|e| e.is_finite()).collect());
    let (median, most) = (quantile(&errors, 0.5)?, quantile(&errors, 0.95)?);
    let largest = *errors.last()?;
    // A few outliers must not push all others into one column: they are counted in the last.
    let cut = if largest > 3.0 * most && most > 0.0 { 1.5 * most } else { largest };
    let x = Axis::from_zero([cut.max(NONE_PX)], 6);
    let mut counts = [0_u32; BINS];
    for error in &errors {
        counts[((x.place(*error) * BINS as f64) as usize).min(BINS - 1)] += 1;
    }
    let panel = Panel {
        left: LEFT,
        top: 24.0,
        width: WIDTH - LEFT - RIGHT,
        height: 160.0,
        x,
        y: Axis::from_zero(counts.iter().map(|c| f64::from(*c)), 4),
    };
    let mut picture = Picture::new(WIDTH, 226.0);
    let cut_off = cut < largest;
    let x_title = if cut_off { "error (px); larger ones in the last column" } else { "error (px)" };
    panel.draw_axes(&mut picture, Some(x_title), Some("labels"));
    let width = panel.width / BINS as f64;
    for (place, count) in counts.iter().enumerate().filter(|(_, c)| **c > 0) {
        let top = panel.place_y(f64::from(*count));
        let left = panel.left + place as f64 * width;
        picture.bar(class, (left + 0.5, top), (width - 1.0, panel.top + panel.height - top));
    }
    for (value, name, row) in [(median, "half", 1.0), (most, "95 %", 2.0)] {
        let x = panel.place_x(value);
        picture.line("ink thin dashed", [(x, panel.top), (x, panel.top + panel.height)]);
        let (anchor, to) = if x > WIDTH - 60.0 { (Anchor::End, x - 4.0) } else { (Anchor::Start, x + 4.0) };
        picture.text("name", (to, panel.top + 13.0 * row - 2.0), anchor, name);
    }
    let says = format!(
        "Half of the errors are below {}, 95 % below {}, the largest is {}.",
        px(median),
        px(most),
        px(largest)
    );
    Some(Plot { title: "Sizes of the errors", svg: picture.into_svg(&says), says })
}

/// A name that fits beside a bar.
fn shortened(name: &str) -> String {
    if name.chars().count() <= 20 {
        return name.to_string();
    }
    name.chars().take(19).chain(['…']).collect()
}
