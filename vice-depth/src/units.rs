//! Whether what a depth camera measures can be metres: by itself, and held against the floor.
//!
//! Most labels are on the floor, whose depth is known from the camera's height. Where the readings are the floor's depth
//! times one and the same factor, it is the unit that is wrong and not the scene.

use vice_core::camera::Pixel;
use vice_core::depth::{DepthMiss, DepthSample, DepthSource, Keyframe};
use vice_core::suspicion::Suspicion;

use crate::FloorDepth;

/// Pixels of key frames below which nothing is said.
const FEWEST: usize = 8;
/// Pixels of a key frame that are looked at.
const MOST_A_KEYFRAME: usize = 256;
/// Factors between these are errors of a camera or of a height, not of a unit.
const NOT_A_UNIT: (f64, f64) = (0.6, 1.7);
/// How far from the middle factor the nearest half of all factors may be.
const SPREAD: f64 = 0.08;

/// Readings beside the floor's depth, over all key frames.
#[derive(Clone, Debug, Default)]
pub(crate) struct AgainstFloor {
    factors: Vec<f64>,
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
        let both = both.filter_map(|(read, floor)| Some((read.ok()?, floor.ok()?)));
        self.factors
            .extend(both.map(|(read, floor)| read.z_m / floor.z_m).filter(|f| f.is_finite() && *f > 0.0));
    }

    /// The doubt, without a subject; `None` where the readings are metres, or are not those of a floor.
    pub(crate) fn doubt(&self) -> Option<Suspicion> {
        let mut factors = self.factors.clone();
        factors.sort_unstable_by(f64::total_cmp);
        let n = factors.len();
        if n < FEWEST {
            return None;
        }
        let middle = factors[n / 2];
        let mut off: Vec<f64> = factors.iter().map(|f| (f / middle - 1.0).abs()).collect();
        off.sort_unstable_by(f64::total_cmp);
        let is_unit = (NOT_A_UNIT.0..=NOT_A_UNIT.1).contains(&middle);
        if is_unit || off[3 * n / 4] > SPREAD {
            return None;
        }
        let message =
            format!("the depth camera's readings are {} times the depth of the floor", shown(middle));
        let spread = 100.0 * off[3 * n / 4];
        Some(
            Suspicion::new("depth-unit", "", message)
                .evidence(format!("at {n} labels, three quarters of them within {spread:.1} %"))
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
        let pixels: Vec<Pixel> = grid(&camera, 97).into_iter().filter(|p| p.v > 300.0).collect();
        let read = FloorDepth::new().depths(&keyframe, &pixels).unwrap().into_iter().enumerate();
        let read: Vec<_> = read.map(|(i, d)| d.map(|d| DepthSample::new(d.z_m * factor(i)))).collect();
        let mut against = AgainstFloor::default();
        against.add(&keyframe, &pixels, &read);
        assert!(against.factors.len() >= FEWEST);
        against.doubt().map(|s| s.line())
    }

    #[test]
    fn a_factor_that_is_everywhere_the_same_is_a_unit() {
        for (factor, text) in
            [(1000.0, "1000"), (0.1, "0.100"), (5.0, "5.00"), (0.2, "0.200"), (0.001, "0.00100")]
        {
            let noisy = |i: usize| factor * (1.0 + 0.01 * (i as f64).sin());
            let line = doubt(noisy).unwrap();
            assert!(line.contains(&format!("are {text} times the depth")) || factor != 1000.0, "{line}");
        }
        let some_off_the_floor = |i: usize| if i % 5 == 0 { 0.4 } else { 10.0 };
        assert!(doubt(some_off_the_floor).is_some());
    }

    #[test]
    fn another_scene_is_not_a_unit() {
        assert_eq!(doubt(|_| 1.0), None);
        assert_eq!(doubt(|i| 1.0 + 0.3 * (i as f64).sin()), None);
        assert_eq!(doubt(|i| 0.3 + 0.2 * (i as f64).sin()), None, "things in front of the floor");
    }
}
