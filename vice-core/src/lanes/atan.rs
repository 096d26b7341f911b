//! The arc tangent of lanes.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use super::Number;

/// `tan(π/8)` and `tan(3π/8)`: beyond them the argument is turned by 45 or 90 degrees.
const TURN_45: f64 = 0.414_213_562_373_095_03;
const TURN_90: f64 = 2.414_213_562_373_095;

/// `(atan(t)/t - 1)/t²` as a polynomial in `t²` for `|t| <= tan(π/8)`: interpolated at Chebyshev nodes in 50 digits,
/// which leaves a relative error of 6e-18 of the arc tangent.
const COEFFICIENTS: [f64; 11] = [
    -0.3333333333333333,
    0.19999999999995516,
    -0.14285714284665682,
    0.11111111015187018,
    -0.0909090457530649,
    0.07692183125376892,
    -0.06664510525508936,
    0.05858140904866328,
    -0.050854078345894844,
    0.03923044778479309,
    -0.019175404711104935,
];

/// The arc tangent of numbers that are not negative, to about 2 units in the last place; of NaN NaN.
#[inline(always)]
pub(super) fn atan<N: Number>(r: N) -> N {
    let small = r.at_most(r.of(TURN_45));
    let middle = r.at_most(r.of(TURN_90));
    let one = r.of(1.0);
    let above = N::select(small, r, N::select(middle, r - 1.0, r.of(-1.0)));
    let below = N::select(small, one, N::select(middle, r + 1.0, r));
    let turned = N::select(small, r.of(0.0), N::select(middle, r.of(FRAC_PI_4), r.of(FRAC_PI_2)));
    let t = above / below;
    let s = t * t;
    let mut sum = r.of(COEFFICIENTS[10]);
    // Counted, not iterated: an iterator's closure would not be compiled for the instruction set.
    let mut i = 10;
    while i > 0 {
        i -= 1;
        sum = sum * s + COEFFICIENTS[i];
    }
    turned + (t + t * s * sum)
}
