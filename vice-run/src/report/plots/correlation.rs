//! Whether the pixel error tells what motion capture tells: label by label against the error of the motion since the key
//! frame, which starts anew where the label's point does. The error after an alignment does not.

use std::collections::{BTreeMap, BTreeSet};

use vice_core::result::{MotionError, PixelPart, PointName, TrajectoryPart};
use vice_core::time::Stamp;

use super::axis::Axis;
use super::panel::Panel;
use super::picture::Picture;
use super::{LEFT, NONE_PX, Plot, RIGHT, WIDTH};
use crate::report::numbers::correlation;

/// Fewer labels than this say nothing about a correlation.
const FEWEST: usize = 8;

/// Pixel error of the labels against the error of the estimate's motion since their key frame, in position and angle.
pub(crate) fn against_truth(part: &PixelPart, trajectory: &TrajectoryPart, class: &str) -> Option<Plot> {
    let motions: BTreeMap<(Stamp, Stamp), &MotionError> =
        trajectory.since_keyframe.iter().map(|m| ((m.keyframe_ns, m.timestamp_ns), m)).collect();
    let mut starts: BTreeMap<&PointName, BTreeSet<Stamp>> = BTreeMap::new();
    for keyframe in &part.keyframes {
        starts.entry(&keyframe.point).or_default().insert(keyframe.timestamp_ns);
    }
    let (position, angle): (Vec<_>, Vec<_>) = part
        .samples
        .iter()
        .filter_map(|s| {
            let start = starts.get(&s.point)?.range(..=s.timestamp_ns).next_back()?;
            let motion = motions.get(&(*start, s.timestamp_ns))?;
            Some(((motion.position_m, s.error_px), (motion.angle_rad, s.error_px)))
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
        [("position error since the key frame (m)", &position), ("angle error (rad)", &angle)]
            .into_iter()
            .enumerate()
    {
        let panel = Panel {
            left: LEFT + index as f64 * (width + between),
            top: 24.0,
            width,
            height: 180.0,
            x: Axis::from_zero(values.iter().map(|v| v.0).chain([0.001]), 2),
            y: y.clone(),
        };
        panel.draw_axes(&mut picture, Some(title), (index == 0).then_some("pixel error (px)"));
        panel.dots(&mut picture, class, values);
    }
    let says = says(&position, &angle);
    Some(Plot { title: "Pixel error and ground truth", svg: picture.into_svg(&says), says })
}

fn says(position: &[(f64, f64)], angle: &[(f64, f64)]) -> String {
    let n = position.len();
    if n < FEWEST {
        return format!(
            "Too few labels ({n}) to say whether the pixel error follows the error against the reference."
        );
    }
    if position.iter().all(|p| p.1 < NONE_PX) {
        return format!(
            "There is no pixel error above {NONE_PX} px in {n} labels that could follow anything."
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
        "Over {n} labels the pixel error {} and {}, all three since the label's key frame.",
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
        assert!(super::says(&up[..3], &up[..3]).contains("Too few labels (3)"));
    }
}
