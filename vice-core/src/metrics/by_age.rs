//! RMSE_2D of the samples at an age since their key frame, or after so many metres of motion.
//!
//! RMSE_2D of all ages depends on how long labels live, since an estimate's error grows with them; at one age it does not.
//! Age `a` is all held samples between 0.8 and 1.2 `a`. It is refused with fewer than five segments that reach 1.2 `a`: a
//! window that is half filled gives too small a number.

use std::ops::Range;

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

/// Held samples of a segment in time.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// Squared errors, px².
    pub squares_px2: &'a [f64],
    /// Angles between the rays of carried point and label, radians; NaN where the label has no ray.
    pub angle_rad: &'a [f32],
    /// Distances at the depth of the carried point, metres; NaN where the label has no ray.
    pub offset_m: &'a [f32],
}

/// Sums of squared errors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Sums {
    px2: f64,
    rad2: f64,
    m2: f64,
    count: u64,
}

/// Sums of the squared errors of a segment: of all its held samples, and of those at each age and motion that is told.
#[derive(Clone, Debug, PartialEq)]
pub struct SegmentErrors {
    all: Sums,
    /// By the number of the window, those that have samples.
    windows: Vec<(u8, Sums)>,
    /// Age and motion of the last sample.
    last: [f64; 2],
}

impl Default for SegmentErrors {
    /// Without samples.
    fn default() -> Self {
        Self { all: Sums::default(), windows: Vec::new(), last: [f64::NEG_INFINITY; 2] }
    }
}

/// An age or a motion that is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Window {
    /// One of [`AGES_S`].
    Age(usize),
    /// One of [`MOTIONS_M`].
    Motion(usize),
}

impl Window {
    /// All of them.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..AGES_S.len()).map(Self::Age).chain((0..MOTIONS_M.len()).map(Self::Motion))
    }

    fn number(self) -> u8 {
        match self {
            Self::Age(i) => i as u8,
            Self::Motion(i) => (AGES_S.len() + i) as u8,
        }
    }

    /// Seconds or metres.
    pub fn at(self) -> f64 {
        match self {
            Self::Age(i) => AGES_S[i],
            Self::Motion(i) => MOTIONS_M[i],
        }
    }

    const fn kind(self) -> usize {
        match self {
            Self::Age(_) => 0,
            Self::Motion(_) => 1,
        }
    }
}

impl Samples<'_> {
    fn sums(&self, range: Range<usize>) -> Sums {
        let Self { squares_px2, angle_rad, offset_m } = self;
        let mut sums = Sums { count: range.len() as u64, ..Sums::default() };
        let samples = squares_px2[range.clone()].iter().zip(&angle_rad[range.clone()]).zip(&offset_m[range]);
        for ((square, angle), offset) in samples {
            sums.px2 += square;
            sums.rad2 += f64::from(*angle).powi(2);
            sums.m2 += f64::from(*offset).powi(2);
        }
        sums
    }
}

impl SegmentErrors {
    /// Of held samples; age (seconds) and motion (metres) since the key frame are by sample, and never fall.
    pub fn of(samples: &Samples<'_>, age_s: impl Fn(usize) -> f64, motion_m: impl Fn(usize) -> f64) -> Self {
        let count = samples.squares_px2.len();
        let Some(last) = count.checked_sub(1) else { return Self::default() };
        let mut windows = Vec::new();
        for window in Window::all() {
            let range = match window {
                Window::Age(_) => around(window.at(), count, &age_s),
                Window::Motion(_) => around(window.at(), count, &motion_m),
            };
            if !range.is_empty() {
                windows.push((window.number(), samples.sums(range)));
            }
        }
        Self { all: samples.sums(0..count), windows, last: [age_s(last), motion_m(last)] }
    }

    /// Sum of the squared errors of all held samples, px².
    pub const fn squares_px2(&self) -> f64 {
        self.all.px2
    }
}

/// The samples in the window around `at`.
#[inline]
fn around(at: f64, count: usize, since: impl Fn(usize) -> f64) -> Range<usize> {
    let (low, high) = (at * (WINDOW.0 - SLACK), at * (WINDOW.1 + SLACK));
    if since(count - 1) < low {
        return 0..0;
    }
    let first = |reached: &dyn Fn(f64) -> bool| {
        let (mut from, mut to) = (0, count);
        while from < to {
            let middle = usize::midpoint(from, to);
            if reached(since(middle)) { to = middle } else { from = middle + 1 }
        }
        from
    };
    let from = first(&|v| v >= low);
    from..first(&|v| v > high).max(from)
}

/// The errors of some sums, by the point that they are of; `None` where there is no sample.
fn errors_of(sums: impl Iterator<Item = (usize, Sums)> + Clone) -> Option<Errors> {
    let estimated = |squares: fn(&Sums) -> f64| {
        let one =
            |(point, sums): (usize, Sums)| SegmentSum { point, squares: squares(&sums), count: sums.count };
        Estimated::of(&sums.clone().map(one).collect::<Vec<_>>())
    };
    Some(Errors {
        px: estimated(|s| s.px2)?,
        angle_rad: estimated(|s| s.rad2),
        offset_m: estimated(|s| s.m2),
    })
}

/// The errors of all held samples of segments, by the point that each is of; `None` where there are none.
pub fn errors(segments: &[(usize, &SegmentErrors)]) -> Option<Errors> {
    errors_of(segments.iter().map(|(point, segment)| (*point, segment.all)))
}

/// The errors in a window; or how many segments reach far enough, where these are too few.
///
/// # Errors
/// The number of segments that reach 1.2 times the age or motion, below [`FEWEST_SEGMENTS`].
pub fn errors_at(segments: &[(usize, &SegmentErrors)], window: Window) -> Result<Errors, usize> {
    let far = window.at() * (WINDOW.1 - SLACK);
    let reaching = segments.iter().filter(|(_, s)| s.last[window.kind()] >= far).count();
    if reaching < FEWEST_SEGMENTS {
        return Err(reaching);
    }
    let number = window.number();
    let in_window = segments.iter().filter_map(|(point, segment)| {
        let (_, sums) = segment.windows.iter().find(|(n, _)| *n == number)?;
        Some((*point, *sums))
    });
    errors_of(in_window).ok_or(reaching)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors that grow by a pixel a second, at ten samples a second.
    fn segments(count: usize, frames: u32) -> Vec<SegmentErrors> {
        let squares: Vec<f64> = (1..=frames).map(|frame| (0.1 * f64::from(frame)).powi(2)).collect();
        let angles: Vec<f32> = (1..=frames).map(|frame| 1e-3 * frame as f32).collect();
        let offsets: Vec<f32> = (1..=frames).map(|frame| if frame == 30 { f32::NAN } else { 0.5 }).collect();
        let samples = Samples { squares_px2: &squares, angle_rad: &angles, offset_m: &offsets };
        let segment = SegmentErrors::of(&samples, |i| 0.1 * (i as f64 + 1.0), |_| 0.0);
        vec![segment; count]
    }

    fn numbered(list: &[SegmentErrors]) -> Vec<(usize, &SegmentErrors)> {
        list.iter().enumerate().collect()
    }

    #[test]
    fn an_age_is_its_window_and_needs_five_segments_that_reach_beyond() {
        let at = |list: &[SegmentErrors], age: usize| errors_at(&numbered(list), Window::Age(age));
        let list = segments(5, 24);
        let at_one = at(&list, 0).unwrap();
        let expected = ((8..=12).map(|i| 0.01 * f64::from(i * i)).sum::<f64>() / 5.0).sqrt();
        assert!((at_one.px.rmse - expected).abs() < 1e-12, "{}", at_one.px.rmse);
        assert_eq!(at_one.px.samples, 25);
        assert!(
            at_one.px.interval_95().is_some()
                && (at_one.angle_rad.unwrap().rmse - 0.01 * expected / 1.0).abs() < 1e-6
        );
        assert_eq!(at_one.offset_m.unwrap().rmse, 0.5);
        assert!(at(&list, 1).is_ok(), "2.4 s is reached");
        assert_eq!(at(&segments(5, 23), 1), Err(0));
        assert_eq!(at(&segments(4, 24), 1), Err(4));
        // A segment that is set aside reaches nothing.
        let mut aside = list.clone();
        aside[2] = SegmentErrors::default();
        assert_eq!(at(&aside, 1), Err(4));
        // A label without a ray leaves the offset unknown, not smaller.
        let list = segments(5, 30);
        let all = errors(&numbered(&list)).unwrap();
        assert!(all.offset_m.is_none() && all.angle_rad.is_some());
        assert_eq!((all.px.samples, all.px.points), (150, 5));
        assert!(errors(&numbered(&[SegmentErrors::default()])).is_none());
        assert_eq!(errors_at(&numbered(&list), Window::Motion(0)), Err(0));
    }

    #[test]
    fn the_window_is_found_wherever_it_lies() {
        for count in 1..40 {
            for from in 0..40 {
                let since = |i: usize| 0.05 * (from + i) as f64;
                let found = around(1.0, count, since);
                let inside: Vec<usize> = (0..count)
                    .filter(|i| (WINDOW.0 - SLACK..=WINDOW.1 + SLACK).contains(&since(*i)))
                    .collect();
                assert_eq!(found.collect::<Vec<_>>(), inside);
            }
        }
    }
}
