//! Poses as messages have them, and what is made of those that are not quite right: one rule for tf and topics, the
//! same as for files.
//!
//! A pose with a number that is not finite is no pose but a gap. A quaternion whose length is up to 1 % off was rounded
//! or filtered: it is normalised and counted. One further off says nothing, and is left out and counted.

use vice_core::frames::{Rigid, UNIT_TOLERANCE};
use vice_core::suspicion::Suspicion;

use crate::doubts::{LEFT_OUT, NORMALISED};
use crate::transform::{Tf, Transform};

/// How far from 1 the length of a quaternion may be and still be normalised.
const NORMALISED_TOLERANCE: f64 = 0.01;

/// A pose as it is in a message: metres, and a quaternion w x y z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RawPose {
    pub(crate) translation_m: [f64; 3],
    pub(crate) rotation_wxyz: [f64; 4],
}

/// What was left out or mended, of one edge or topic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    /// Poses with numbers that are not finite.
    pub(crate) not_finite: u64,
    /// Poses whose quaternion is none.
    pub(crate) not_unit: u64,
    /// Poses whose quaternion was normalised.
    pub(crate) normalised: u64,
}

impl Tally {
    /// The pose, where it is one; counted where it had to be mended or is none.
    pub(crate) fn take(&mut self, raw: &RawPose) -> Option<Transform> {
        let RawPose { translation_m, rotation_wxyz } = *raw;
        if !translation_m.iter().chain(&rotation_wxyz).all(|v| v.is_finite()) {
            self.not_finite += 1;
            return None;
        }
        let length = rotation_wxyz.iter().map(|v| v * v).sum::<f64>().sqrt();
        let off = (length - 1.0).abs();
        let pose = match off {
            off if off <= UNIT_TOLERANCE => Rigid::<Tf, Tf>::try_from_parts(translation_m, rotation_wxyz),
            off if off <= NORMALISED_TOLERANCE => {
                Rigid::<Tf, Tf>::try_from_parts(translation_m, rotation_wxyz.map(|v| v / length))
            }
            _ => {
                self.not_unit += 1;
                return None;
            }
        };
        match pose {
            Ok(pose) => {
                self.normalised += u64::from(off > UNIT_TOLERANCE);
                Some(pose)
            }
            Err(_) => {
                self.not_unit += 1;
                None
            }
        }
    }

    /// Adds what another one counted.
    pub(crate) fn add(&mut self, other: &Self) {
        self.not_finite += other.not_finite;
        self.not_unit += other.not_unit;
        self.normalised += other.normalised;
    }

    /// What there is to say about a topic or tf.
    pub(crate) fn doubts(&self, about: &str) -> Vec<Suspicion> {
        let mut doubts = Vec::new();
        let mut say = |n: u64, code: &str, text: &str, advice: &str| {
            if n > 0 {
                let message = format!("{n} poses {text}");
                doubts.push(Suspicion::new(code, about, message).times(n).advice(advice));
            }
        };
        say(self.not_finite, LEFT_OUT, "with NaN or infinity are left out", "they count as gaps");
        say(
            self.not_unit,
            LEFT_OUT,
            "whose quaternion has a length more than 1 % off 1 are left out",
            "all zeros mean that its source had no rotation yet",
        );
        say(self.normalised, NORMALISED, "have a quaternion up to 1 % off length 1: normalised", "");
        doubts
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raw(x: f64, w: f64) -> RawPose {
        RawPose { translation_m: [x, 0.0, 0.0], rotation_wxyz: [w, 0.0, 0.0, 0.0] }
    }

    #[test]
    fn gaps_are_left_out_and_small_errors_mended() {
        let mut tally = Tally::default();
        assert!(tally.take(&raw(1.0, 1.0)).is_some() && tally.take(&raw(1.0, 1.0009)).is_some());
        assert_eq!(tally, Tally::default(), "as accurate as the method asks for");
        for w in [1.0011, 0.9901, 1.0099] {
            let pose = tally.take(&raw(1.0, w)).unwrap();
            assert!((pose.rotation().norm() - 1.0).abs() < 1e-15);
        }
        for (x, w) in [(f64::NAN, 1.0), (f64::INFINITY, 1.0), (0.0, f64::NAN), (0.0, 0.0), (0.0, 1.02)] {
            assert!(tally.take(&raw(x, w)).is_none(), "{x} {w}");
        }
        assert_eq!(tally, Tally { not_finite: 3, not_unit: 2, normalised: 3 });
        let lines: Vec<String> = tally.doubts("topic /a").iter().map(Suspicion::line).collect();
        assert!(lines[0].starts_with("topic /a: 3 poses with NaN or infinity are left out"), "{lines:?}");
        assert_eq!(lines.len(), 3);
    }
}
