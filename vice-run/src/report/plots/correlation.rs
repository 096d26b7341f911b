//! Whether the pixel error tells what motion capture tells: frame by frame against the position and angle error.

use vice_core::result::{PixelPart, TrajectoryPart};

use super::axis::Axis;
use super::panel::Panel;
use super::picture::Picture;
use super::{LEFT, NONE_PX, Plot, RIGHT, WIDTH};
use crate::report::numbers::{correlation, mean_by_frame};

/// Fewer frames than this say nothing about a correlation.
const FEWEST: usize = 8;

/// Mean pixel error of the evaluated frames against their position and angle error.
pub(crate) fn against_truth(part: &PixelPart, trajectory: &TrajectoryPart, class: &str) -> Option<Plot> {
    let means = mean_by_frame(part);
    let evaluated = trajectory.frames.iter().filter(|f| f.evaluated);
    let (position, angle): (Vec<_>, Vec<_>) = evaluated
        .filter_map(|f| {
            let error_px = *means.get(&f.timestamp_ns)?;
            Some(((f.position_m, error_px), (f.angle_rad, error_px)))
        })
        .unzip();
    if position.is_empty() {
        return None;
    }
    let mut picture = Picture::new(WIDTH, 250.0);
    let between = 30.0;
    let width = (WIDTH - LEFT - RIGHT - between) / 2.0;
    let y = Axis::from_zero(position.iter().map(|p| p.1).chain([NONE_PX]), 4);
    for (index, (title, values)) in
        [("position error (m)", &position), ("angle error (rad)", &angle)].into_iter().enumerate()
    {
        let panel = Panel {
            left: LEFT + index as f64 * (width + between),
            top: 24.0,
            width,
            height: 180.0,
            x: Axis::from_zero(values.iter().map(|v| v.0).chain([0.001]), 2),
            y: y.clone(),
        };
        panel.draw_axes(&mut picture, Some(title), (index == 0).then_some("mean pixel error (px)"));
        panel.dots(&mut picture, class, values);
    }
    let says = says(&position, &angle);
    Some(Plot { title: "Pixel error and ground truth", svg: picture.into_svg(&says), says })
}

fn says(position: &[(f64, f64)], angle: &[(f64, f64)]) -> String {
    let n = position.len();
    if n < FEWEST {
        return format!(
            "Too few frames ({n}) to say whether the pixel error follows the error against the reference."
        );
    }
    if position.iter().all(|p| p.1 < NONE_PX) {
        return format!(
            "There is no pixel error above {NONE_PX} px in {n} frames that could follow anything."
        );
    }
    let follows = |pairs: &[(f64, f64)], what: &str| match correlation(pairs) {
        Some(r) => {
            let how = match r {
                r if r >= 0.7 => "follows",
                r if r >= 0.4 => "partly follows",
                r if r <= -0.4 => "runs against",
                _ => "does not follow",
            };
            format!("{how} the {what} (r = {})", format!("{r:.2}").replace('-', "−"))
        }
        None => format!("cannot be set against the {what}, which does not vary"),
    };
    format!(
        "Over {n} frames the pixel error {} and {}. It counts from the last key frame, the other two from the alignment.",
        follows(position, "position error"),
        follows(angle, "angle error")
    )
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_sentence_names_the_correlation() {
        let up: Vec<(f64, f64)> = (0..9).map(|i| (f64::from(i), 2.0 * f64::from(i))).collect();
        let flat: Vec<(f64, f64)> = (0..9).map(|i| (1.0, f64::from(i))).collect();
        let text = super::says(&up, &flat);
        assert!(text.contains("follows the position error (r = 1.00)"), "{text}");
        assert!(text.contains("cannot be set against the angle error"), "{text}");
        assert!(super::says(&up[..3], &up[..3]).contains("Too few frames (3)"));
    }
}
