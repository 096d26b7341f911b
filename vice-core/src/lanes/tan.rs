//! The tangent of one number or of lanes.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use super::Number;

/// What is missing from the double nearest to `π/2`.
const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;

/// `tan(t) = t A(t²)/B(t²)`, the ninth convergent of Lambert's continued fraction `t/(1 - t²/(3 - t²/(5 - ...)))`: within
/// 1e-18 of the tangent up to `π/4`.
const ABOVE: [f64; 5] = [34_459_425.0, -4_729_725.0, 135_135.0, -990.0, 1.0];
const BELOW: [f64; 5] = [34_459_425.0, -16_216_200.0, 945_945.0, -13_860.0, 45.0];

/// The tangent of an angle from 0 to below `π/2` radians, to about 3 units in the last place; of others anything.
#[inline(always)]
pub(super) fn tan<N: Number>(angle: N) -> N {
    let small = angle.at_most(angle.of(FRAC_PI_4));
    let rest = angle.of(FRAC_PI_2) - angle + FRAC_PI_2_REST;
    let t = N::select(small, angle, rest);
    let s = t * t;
    let above = t * ((((s * ABOVE[4] + ABOVE[3]) * s + ABOVE[2]) * s + ABOVE[1]) * s + ABOVE[0]);
    let below = (((s * BELOW[4] + BELOW[3]) * s + BELOW[2]) * s + BELOW[1]) * s + BELOW[0];
    // Beyond 45 degrees it is one over the tangent of what is left to 90.
    N::select(small, above, below) / N::select(small, below, above)
}
