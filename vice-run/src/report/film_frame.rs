//! A frame of the paper's videos: label blue, reference red, on-board green.

use vice_core::dataset::Image;
use vice_core::error::DataResult;
use vice_core::time::Stamp;

use super::font;
use super::marks::{FrameMarks, Marks};
use super::overlay::{Canvas, Colour, ESTIMATE_GREEN, ESTIMATE_YELLOW, LABEL_BLUE};

/// The reference.
const REFERENCE_RED: Colour = [213, 94, 0];
/// Estimates in their order, all told apart by people who are colour-blind (Okabe and Ito).
const ESTIMATES: [Colour; 5] =
    [ESTIMATE_GREEN, ESTIMATE_YELLOW, [204, 121, 167], [86, 180, 233], [255, 255, 255]];

/// The image with marks, and with a legend that says how far each stream is off.
pub(crate) fn draw(image: &Image, marks: &Marks, stamp: Stamp, zero: Stamp) -> DataResult<Image> {
    let mut canvas = Canvas::new(image);
    // Marks that can be seen in a film of any size.
    let size = (f64::from(image.width()) / 190.0).clamp(2.0, 14.0);
    if let Some(frame) = marks.frames.get(&stamp) {
        draw_marks(&mut canvas, marks, frame, size);
    }
    let scale = i64::from(image.width() / 500).clamp(1, 6);
    let mut lines = vec![(format!("{:.2} s", stamp.since(zero).as_secs_f64()), None)];
    lines.push(("label".to_string(), Some(LABEL_BLUE)));
    for (index, carrier) in marks.carriers.iter().enumerate() {
        let error =
            marks.mean_error_px(stamp, index).map_or_else(|| "-".to_string(), |e| format!("{e:.1} px"));
        let name: String = carrier.name.chars().take(24).collect();
        lines.push((format!("{name} {error}"), Some(colour(carrier.estimate))));
    }
    legend(&mut canvas, &lines, scale);
    canvas.into_image()
}

fn draw_marks(canvas: &mut Canvas, marks: &Marks, frame: &FrameMarks, size: f64) {
    for mark in frame.values() {
        let Some(label) = mark.label_px else { continue };
        for (index, px, _) in &mark.carried {
            canvas.line(label, *px, colour(marks.carriers.get(*index).and_then(|c| c.estimate)));
        }
        canvas.ring(label, 2.0 * size, LABEL_BLUE);
        if mark.keyframe {
            canvas.dot(label, size, LABEL_BLUE);
        }
        // The reference last: where all is well its dot is the one to see.
        for (index, px, _) in mark.carried.iter().rev() {
            canvas.dot(*px, size, colour(marks.carriers.get(*index).and_then(|c| c.estimate)));
        }
    }
}

/// Lines of text on a dark ground in the top left corner.
fn legend(canvas: &mut Canvas, lines: &[(String, Option<Colour>)], scale: i64) {
    let line_height = (font::HEIGHT + 4) * scale;
    let widest = lines.iter().map(|(text, _)| font::width(text)).max().unwrap_or(0);
    let key = 10 * scale;
    canvas.fill(
        (0, 0),
        (key + (widest + 4) * scale, line_height * lines.len() as i64 + 3 * scale),
        [16, 18, 22],
    );
    for (row, (text, colour)) in (0_i64..).zip(lines) {
        let top = 3 * scale + row * line_height;
        if let Some(colour) = colour {
            canvas.fill((3 * scale, top), (5 * scale, font::HEIGHT * scale), *colour);
        }
        font::write(canvas, (key + 2 * scale, top), scale, text, [240; 3]);
    }
}

fn colour(estimate: Option<usize>) -> Colour {
    estimate.map_or(REFERENCE_RED, |index| ESTIMATES[index % ESTIMATES.len()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::testing::{document, keyframe, part, sample};
    use vice_core::dataset::PixelFormat;

    #[test]
    fn labels_are_blue_and_estimates_green() {
        let mut marked = sample("a", 1, 60.0);
        (marked.label_px.u, marked.label_px.v) = (200.0, 150.0);
        (marked.tracked_px.u, marked.tracked_px.v) = (260.0, 150.0);
        let mut estimate = part("imu-euler", &[marked]);
        estimate.keyframes.push(keyframe("a", 0));
        let marks = Marks::of(&document(vec![estimate]), None).unwrap();
        let image = Image::new(400, 300, PixelFormat::Gray8, vec![90; 400 * 300]).unwrap();
        let drawn = draw(&image, &marks, Stamp::from_nanos(1), Stamp::from_nanos(0)).unwrap();
        let at = |u: usize, v: usize| drawn.data()[3 * (v * 400 + u)..][..3].to_vec();
        assert_eq!(at(260, 150), ESTIMATE_GREEN);
        assert_eq!(at(200, 150 + 5), LABEL_BLUE);
        assert_eq!(at(350, 250), [90; 3]);
    }
}
