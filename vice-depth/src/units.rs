//! Whether what a depth camera measures can be metres: by itself, and held against the floor.
//!
//! Most labels are on the floor, whose depth is known from the camera's height. Where the readings are the floor's depth
//! times one and the same factor, it is the unit that is wrong and not the scene.

use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::statistics::middle;
use vice_core::suspicion::Suspicion;

use crate::FloorDepth;

/// Pixels of key frames below which nothing is said: where the factor is that of a unit, and where it is any.
const FEWEST: (usize, usize) = (4, 10);
/// Pixels of a key frame that are looked at.
const MOST_A_KEYFRAME: usize = 256;
/// Factors between these are errors of a camera or of a height, not of a unit.
const NOT_A_UNIT: (f64, f64) = (0.6, 1.7);
/// What a unit, or a count of a depth image, is mistaken by: powers of ten, and 4 or 5 counts a millimetre.
const UNITS: [f64; 10] = [1000.0, 100.0, 10.0, 0.1, 0.01, 0.001, 5.0, 0.2, 4.0, 0.25];
/// How far from the middle factor three quarters of all factors may be.
const SPREAD: f64 = 0.08;
/// By what factor the floor's own depth has to change over the labels: that of a small target in front of it would be
/// any factor, and the same for all of its corners.
const DEPTHS: f64 = 1.25;

/// Readings beside the floor's depth, over all key frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct AgainstFloor {
    /// Depth of the floor, metres, and the reading in units of it.
    pairs: Vec<(f64, f64)>,
}

impl AgainstFloor {
    /// Adds the readings of a key frame.
    pub(crate) fn add(
        &mut self,
        keyframe: &Keyframe<'_>,
        pixels: &[Pixel],
        read: &[Result<DepthSample, DepthMiss>],
    ) {
        // Of a whole image some will do.
        let every = pixels.len().div_ceil(MOST_A_KEYFRAME).max(1);
        let some: Vec<Pixel> = pixels.iter().step_by(every).copied().collect();
        let Ok(floor) = FloorDepth::new().depths(keyframe, &some) else { return };
        let both = read.iter().step_by(every).zip(floor);
        let both = both.filter_map(|(read, floor)| Some((floor.ok()?.z_m, read.ok()?.z_m)));
        let pairs = both.map(|(floor_m, read_m)| (floor_m, read_m / floor_m));
        self.pairs.extend(pairs.filter(|(_, factor)| factor.is_finite() && *factor > 0.0));
    }

    /// The doubt, without a subject; `None` where the readings are metres, or are not those of a floor.
    pub(crate) fn doubt(&self) -> Option<Suspicion> {
        let mut pairs = self.pairs.clone();
        let n = pairs.len();
        if n < FEWEST.0 {
            return None;
        }
        let (_, middle) = middle(&mut pairs, |a, b| a.1.total_cmp(&b.1))?;
        let off = |factor: f64| (factor / middle - 1.0).abs();
        pairs.sort_unstable_by(|a, b| off(a.1).total_cmp(&off(b.1)).then(a.0.total_cmp(&b.0)));
        let near = &pairs[..=3 * n / 4 - 1];
        let spread = near.last().map_or(f64::INFINITY, |pair| off(pair.1));
        let depths = near.iter().map(|pair| pair.0);
        let range = depths.clone().fold(0.0, f64::max) / depths.fold(f64::INFINITY, f64::min);
        let is_unit = UNITS.iter().any(|unit| (middle / unit - 1.0).abs() < SPREAD);
        let enough = n >= if is_unit { FEWEST.0 } else { FEWEST.1 };
        if !enough || (NOT_A_UNIT.0..=NOT_A_UNIT.1).contains(&middle) || spread > SPREAD || range < DEPTHS {
            return None;
        }
        let message =
            format!("the depth camera's readings are {} times the depth of the floor", shown(middle));
        Some(
            Suspicion::new("depth-unit", "", message)
                .evidence(format!("{} of {n} labels within {:.1} %", near.len(), 100.0 * spread))
                .advice(
                    "is their unit another one (recordings take `--set depth_unit=mm`, cm, m or metres a count), or \
                     is it not the floor that is labelled?",
                ),
        )
    }
}

/// A factor with three digits that count.
fn shown(factor: f64) -> String {
    let digits = (2 - factor.log10().floor() as i32).clamp(0, 9) as usize;
    format!("{factor:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{camera, grid, look};

    /// The doubt about readings that are the floor's depth times a factor that depends on the pixel's place in the list.
    fn doubt(factor: impl Fn(usize) -> f64) -> Option<String> {
        let camera = camera();
        let keyframe = look(&camera, [0.0, 0.0, 0.6], [2.0, 0.0, 0.0]);
        let pixels: Vec<Pixel> = grid(&camera, 61).into_iter().filter(|p| p.v > 250.0).collect();
        let read = FloorDepth::new().depths(&keyframe, &pixels).unwrap().into_iter().enumerate();
        let read: Vec<_> = read.map(|(i, d)| d.map(|d| DepthSample::new(d.z_m * factor(i)))).collect();
        let mut against = AgainstFloor::default();
        against.add(&keyframe, &pixels, &read);
        assert!(against.pairs.len() >= FEWEST.0, "{}", against.pairs.len());
        against.doubt().map(|s| s.line())
    }

    #[test]
    fn a_factor_that_is_everywhere_the_same_is_a_unit() {
        for (factor, text) in
            [(1000.0, "1000"), (0.1, "0.100"), (5.0, "5.00"), (0.2, "0.200"), (0.001, "0.00100")]
        {
            let noisy = |i: usize| factor * (1.0 + 1e-4 * (i as f64).sin());
            let line = doubt(noisy).unwrap();
            assert!(line.contains(&format!("are {text} times the depth of the floor")), "{line}");
            assert!(doubt(|i| factor * (1.0 + 0.03 * (i as f64).sin())).is_some(), "a noisy camera");
        }
        let some_off_the_floor = |i: usize| if i.is_multiple_of(5) { 0.4 } else { 10.0 };
        assert!(doubt(some_off_the_floor).is_some());
    }

    #[test]
    fn another_scene_is_not_a_unit() {
        assert_eq!(doubt(|_| 1.0), None);
        assert_eq!(doubt(|i| 1.0 + 0.3 * (i as f64).sin()), None);
        assert_eq!(doubt(|i| 0.3 + 0.2 * (i as f64).sin()), None, "things in front of the floor");
        // The corners of a tag on a wall, a quarter as far away as the floor behind it.
        let mut against = AgainstFloor::default();
        against.pairs.extend((0..40).map(|i| (8.0 + 0.02 * f64::from(i), 0.25 + 0.0005 * f64::from(i))));
        assert_eq!(against.doubt().map(|s| s.line()), None);
    }
}
