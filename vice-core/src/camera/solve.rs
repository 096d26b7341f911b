//! The inverse of a distortion.

use super::{Distortion, UNPROJECT_TOLERANCE, UnprojectError};
use crate::lanes::Number;

/// Steps smaller than this are rounding.
const STEP_DONE: f64 = 1e-14;
const MAX_STEPS: usize = 30;
/// A hair of slack: a point on the rim itself must come back.
const RIM: f64 = 1.0 + 1e-9;

/// Normalised coordinates whose distortion is `(xd, yd)`.
///
/// Newton from the distorted point converges in four or five steps for nearly every lens; where it leaves the valid
/// radius, a second start comes from the radial part alone, which is monotonic there and so can be bracketed.
pub(super) fn undistort<D: Distortion>(
    lens: &D,
    max_radius: f64,
    xd: f64,
    yd: f64,
) -> Result<(f64, f64), UnprojectError> {
    if let Ok(found) = newton(lens, max_radius, (xd, yd), (xd, yd)) {
        return Ok(found);
    }
    let rd = xd.hypot(yd);
    let r = radial_inverse(lens, max_radius, rd).ok_or(UnprojectError::OutsideModel)?;
    let scale = if rd > 0.0 { r / rd } else { 1.0 };
    newton(lens, max_radius, (xd, yd), (xd * scale, yd * scale))
}

fn newton<D: Distortion>(
    lens: &D,
    max_radius: f64,
    (xd, yd): (f64, f64),
    (mut x, mut y): (f64, f64),
) -> Result<(f64, f64), UnprojectError> {
    let mut step = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let previous = step;
        (x, y, step) = newton_step(lens, (xd, yd), (x, y));
        if !step.is_finite() {
            return Err(UnprojectError::NotConverged);
        }
        if settled(step, previous, x, y) {
            let inside = (x * x + y * y).sqrt() <= max_radius * RIM;
            return if inside { Ok((x, y)) } else { Err(UnprojectError::OutsideModel) };
        }
    }
    Err(UnprojectError::NotConverged)
}

/// The next place of Newton's method, and how far it is from the last one.
#[inline(always)]
pub(super) fn newton_step<D: Distortion, N: Number>(lens: &D, (xd, yd): (N, N), (x, y): (N, N)) -> (N, N, N) {
    let ((fx, fy), [a, b, c, d]) = lens.distort_with_jacobian(x, y);
    let (ex, ey) = (xd - fx, yd - fy);
    let per_det = x.of(1.0) / (a * d - b * c);
    let (dx, dy) = ((d * ex - b * ey) * per_det, (a * ey - c * ex) * per_det);
    (x + dx, y + dy, (dx * dx + dy * dy).sqrt())
}

/// Done at the last bits, or when below the tolerance the steps no longer shrink.
#[inline(always)]
pub(super) fn settled<N: Number>(step: N, previous: N, x: N, y: N) -> N::Mask {
    let last_bits = step.at_most((x.abs() + y.abs() + 1.0) * STEP_DONE);
    let stalled = step.both(step.at_most(step.of(UNPROJECT_TOLERANCE * 0.1)), previous.at_most(step));
    step.either(last_bits, stalled)
}

/// The undistorted radius of a distorted one, by bisection; `None` beyond the rim.
fn radial_inverse<D: Distortion>(lens: &D, max_radius: f64, rd: f64) -> Option<f64> {
    let (mut lo, mut hi) = (0.0, max_radius);
    if hi.is_infinite() {
        hi = rd.max(1.0);
        while lens.radial(hi) < rd {
            hi *= 2.0;
            if hi > 1e9 {
                return None;
            }
        }
    } else if lens.radial(hi) * 1.02 < rd {
        // Two per cent over the rim may still be reached by the tangential part.
        return None;
    }
    for _ in 0..60 {
        let mid = 0.5 * (lo + hi);
        if lens.radial(mid) < rd { lo = mid } else { hi = mid }
    }
    Some(lo)
}
