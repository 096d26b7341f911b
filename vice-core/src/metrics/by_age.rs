//! RMSE_2D of the samples at an age since their key frame, or after so many metres of motion.
//!
//! RMSE_2D of all ages depends on how long labels live, since an estimate's error grows with them; at one age it does not.
//! Age `a` is all held samples between 0.8 and 1.2 `a`. It is refused with fewer than five segments that reach 1.2 `a`: a
//! window that is half filled gives too small a number.

use super::held::{Aside, Carried, CarriedSegment};
use super::interval::{Estimated, FEWEST_SEGMENTS, SegmentSum};

/// Ages that are told, seconds.
pub const AGES_S: [f64; 4] = [1.0, 2.0, 5.0, 10.0];
/// Motions that are told, metres.
pub const MOTIONS_M: [f64; 3] = [0.5, 1.0, 2.0];
/// The window around an age, as shares of it.
const WINDOW: (f64, f64) = (0.8, 1.2);
/// Stamps of frames are a little off their rate.
const SLACK: f64 = 1e-6;

/// The errors of some samples in each unit. An angle or an offset is `None` where a label has no ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Errors {
    /// Pixels.
    pub px: Estimated,
    /// Radians.
    pub angle_rad: Option<Estimated>,
    /// Metres, at the depth of the carried point.
    pub offset_m: Option<Estimated>,
}

/// The errors of the held samples that `takes` lets pass, given the segment and the sample; `None` where there are none.
pub fn errors(
    segments: &[CarriedSegment],
    aside: &[Aside],
    takes: impl Fn(&CarriedSegment, &Carried) -> bool,
) -> Option<Errors> {
    let sums = |square: fn(&Carried) -> f64| -> Vec<SegmentSum> {
        let one = |(segment, aside): (&CarriedSegment, &Aside)| {
            let mut sum = SegmentSum { point: segment.point, squares: 0.0, count: 0 };
            for sample in aside.held(segment).filter(|s| takes(segment, s)) {
                sum.squares += square(sample);
                sum.count += 1;
            }
            sum
        };
        segments.iter().zip(aside).map(one).collect()
    };
    Some(Errors {
        px: Estimated::of(&sums(Carried::square_px2))?,
        angle_rad: Estimated::of(&sums(|s| f64::from(s.angle_rad).powi(2))),
        offset_m: Estimated::of(&sums(|s| f64::from(s.offset_m).powi(2))),
    })
}

/// The errors at `at` seconds or metres, where `since_keyframe` says for two frames how far apart they are; or how many
/// segments reach far enough, where these are too few.
///
/// # Errors
/// The number of segments that reach 1.2 `at`, below [`FEWEST_SEGMENTS`].
pub fn errors_at(
    segments: &[CarriedSegment],
    aside: &[Aside],
    at: f64,
    since_keyframe: impl Fn(u32, u32) -> f64,
) -> Result<Errors, usize> {
    let (low, high) = (at * (WINDOW.0 - SLACK), at * (WINDOW.1 + SLACK));
    let since = |segment: &CarriedSegment, sample: &Carried| since_keyframe(segment.keyframe, sample.frame);
    let reaches = |(segment, aside): &(&CarriedSegment, &Aside)| {
        let last = aside.held(segment).last();
        last.is_some_and(|s| since(segment, s) >= at * (WINDOW.1 - SLACK))
    };
    let reaching = segments.iter().zip(aside).filter(reaches).count();
    if reaching < FEWEST_SEGMENTS {
        return Err(reaching);
    }
    errors(segments, aside, |segment, sample| (low..=high).contains(&since(segment, sample))).ok_or(reaching)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors that grow by a pixel a second, at ten samples a second.
    fn segments(count: usize, frames: u32) -> Vec<CarriedSegment> {
        let sample = |frame: u32| Carried {
            frame,
            residual_px: [0.1 * f64::from(frame), 0.0],
            angle_rad: 1e-3 * frame as f32,
            offset_m: if frame == 30 { f32::NAN } else { 0.5 },
        };
        let segment =
            |point| CarriedSegment { point, keyframe: 0, samples: (1..=frames).map(sample).collect() };
        (0..count).map(segment).collect()
    }

    #[test]
    fn an_age_is_its_window_and_needs_five_segments_that_reach_beyond() {
        let age = |key: u32, frame: u32| 0.1 * f64::from(frame - key);
        let list = segments(5, 24);
        let none = vec![Aside::default(); 5];
        let at_one = errors_at(&list, &none, 1.0, age).unwrap();
        let expected = ((8..=12).map(|i| 0.01 * f64::from(i * i)).sum::<f64>() / 5.0).sqrt();
        assert!((at_one.px.rmse - expected).abs() < 1e-12, "{}", at_one.px.rmse);
        assert_eq!(at_one.px.samples, 25);
        assert!(
            at_one.px.interval_95().is_some()
                && (at_one.angle_rad.unwrap().rmse - 0.01 * expected / 1.0).abs() < 1e-6
        );
        assert_eq!(at_one.offset_m.unwrap().rmse, 0.5);
        assert!(errors_at(&list, &none, 2.0, age).is_ok(), "2.4 s is reached");
        assert_eq!(errors_at(&segments(5, 23), &none, 2.0, age), Err(0));
        assert_eq!(errors_at(&segments(4, 24), &none[..4], 2.0, age), Err(4));
        // A segment that is set aside reaches nothing.
        let mut aside = none.clone();
        aside[2].keyframe_px = Some(9.0);
        assert_eq!(errors_at(&list, &aside, 2.0, age), Err(4));
        // A label without a ray leaves the offset unknown, not smaller.
        let all = errors(&segments(5, 30), &none, |_, _| true).unwrap();
        assert!(all.offset_m.is_none() && all.angle_rad.is_some());
    }
}
