//! The inverse of a distortion: a fixed number of steps from a good start wherever that is enough, and a search where it
//! is not.
//!
//! Whether it is enough is decided by the last step alone, by the same formula for one pixel and for many: both have the
//! same bits.

use super::seed::Seed;
use super::{Distortion, UNPROJECT_TOLERANCE, UnprojectError};
use crate::lanes::Number;

/// Steps smaller than this are rounding.
const STEP_DONE: f64 = 1e-14;
const MAX_STEPS: usize = 30;
/// A hair of slack: a point on the rim itself must come back.
const RIM: f64 = 1.0 + 1e-9;

/// After a step so small (squared, normalised coordinates) what is left is below rounding: it shrinks with the square.
pub(super) const LAST_STEP_SQUARED: f64 = 2.5e-15;
/// Beyond this part of the valid radius a search decides: at the rim the Jacobian is singular.
pub(super) const NEAR_RIM: f64 = 0.999;
/// The same where a lens has no rim: a ray so nearly at right angles to the axis is one of a pixel that none reaches.
pub(super) const GRAZING: f64 = 1e4;

/// Normalised coordinates whose distortion is `(xd, yd)`.
pub(super) fn undistort<D: Distortion>(
    lens: &D,
    seed: &Seed,
    max_radius: f64,
    (xd, yd): (f64, f64),
) -> Result<(f64, f64), UnprojectError> {
    match lens.undistort_fast(seed, quick_radius(max_radius), (xd, yd)) {
        (x, y, true) => Ok((x, y)),
        _ => lens.undistort_slow(max_radius, (xd, yd)),
    }
}

/// The seed of a lens for an image that reaches so far off the axis in x and y (distorted normalised coordinates), with a
/// step more where those from it are too often not enough.
pub(super) fn seed_of<D: Distortion>(lens: &D, [reach_x, reach_y]: [f64; 2]) -> Seed {
    let seed = lens.seed(reach_x.hypot(reach_y));
    let quick_radius = quick_radius(lens.max_radius());
    let side = |i: u32| f64::from(i) / 8.0 - 1.0;
    let grid = (0..=16).flat_map(|i| (0..=16).map(move |j| (reach_x * side(i), reach_y * side(j))));
    let asked: Vec<(f64, f64)> = grid.filter(|(xd, yd)| xd * xd + yd * yd <= seed.max_rd2).collect();
    let missed = asked.iter().filter(|place| !lens.undistort_fast(&seed, quick_radius, **place).2).count();
    Seed { more_steps: 20 * missed > asked.len(), ..seed }
}

/// The radius up to which a fixed number of steps is trusted.
pub(super) fn quick_radius(max_radius: f64) -> f64 {
    (max_radius * NEAR_RIM).min(GRAZING)
}

/// The start of a polynomial: `rd seed(rd²)/rd`, to be multiplied with the distorted coordinates.
#[inline(always)]
pub(super) fn seeded<N: Number>(seed: &Seed, rd2: N) -> N {
    // Four at a time, which do not wait for each other as Horner's steps would.
    let c = &seed.coefficients;
    let t = rd2 * seed.scale - 1.0;
    let square = t * t;
    let fourth = square * square;
    let low = (t * c[1] + c[0]) + (t * c[3] + c[2]) * square;
    let middle = (t * c[5] + c[4]) + (t * c[7] + c[6]) * square;
    let high = (t * c[9] + c[8]) + (t * c[11] + c[10]) * square;
    low + fourth * (middle + fourth * high)
}

/// Newton's method in the plane for a fixed number of steps: from the radial part undone by the seed and the tangential
/// part taken off to first order.
#[inline(always)]
pub(super) fn in_the_plane<D: Distortion, N: Number>(
    lens: &D,
    seed: &Seed,
    quick_radius: f64,
    (xd, yd): (N, N),
) -> (N, N, N::Mask) {
    let rd2 = xd * xd + yd * yd;
    let scale = seeded(seed, rd2);
    let (x, y) = (xd * scale, yd * scale);
    let (side_x, side_y) = lens.tangential(x, y);
    let start = (x - scale * side_x, y - scale * side_y);
    let (x, y, _) = newton_step(lens, (xd, yd), start);
    let (mut x, mut y, mut step2) = newton_step(lens, (xd, yd), (x, y));
    if seed.more_steps {
        (x, y, step2) = newton_step(lens, (xd, yd), (x, y));
    }
    let settled = rd2.both(rd2.at_most(rd2.of(seed.max_rd2)), step2.at_most(rd2.of(LAST_STEP_SQUARED)));
    let inside = (x * x + y * y).at_most(rd2.of(quick_radius * quick_radius));
    (x, y, rd2.both(settled, inside))
}

/// A ray that a closed form gives, where it is not too near the rim.
#[inline(always)]
pub(super) fn closed<N: Number>((x, y, reached): (N, N, N::Mask), quick_radius: f64) -> (N, N, N::Mask) {
    let inside = (x * x + y * y).at_most(x.of(quick_radius * quick_radius));
    (x, y, x.both(reached, inside))
}

/// A ray that a closed form gives, up to the rim.
pub(super) fn closed_to_the_rim(
    (x, y, reached): (f64, f64, bool),
    max_radius: f64,
) -> Result<(f64, f64), UnprojectError> {
    let r2 = x * x + y * y;
    match reached && r2.is_finite() && r2.sqrt() <= max_radius * RIM {
        true => Ok((x, y)),
        false => Err(UnprojectError::OutsideModel),
    }
}

/// `(x, y)` times a scale that depends on the radius alone, and the Jacobian; of the scale twice the derivative by `r²`.
#[inline(always)]
pub(super) fn radial_with_jacobian<N: Number>(x: N, y: N, scale: N, twice_slope: N) -> ((N, N), [N; 4]) {
    let cross = x * y * twice_slope;
    ((x * scale, y * scale), [scale + x * x * twice_slope, cross, cross, scale + y * y * twice_slope])
}

/// The normalised radius of an angle off the axis by its cosine.
pub(super) fn radius_of_cosine(cosine: f64) -> f64 {
    ((1.0 - cosine) * (1.0 + cosine)).max(0.0).sqrt() / cosine
}

/// Newton from the distorted point converges in four or five steps for nearly every lens; where it leaves the valid
/// radius, a second start comes from the radial part alone, which is monotonic there and so can be bracketed.
pub(super) fn search<D: Distortion>(
    lens: &D,
    max_radius: f64,
    (xd, yd): (f64, f64),
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
        let step2;
        (x, y, step2) = newton_step(lens, (xd, yd), (x, y));
        step = step2.sqrt();
        if !step.is_finite() {
            return Err(UnprojectError::NotConverged);
        }
        // Done at the last bits, or when below the tolerance the steps no longer shrink.
        let last_bits = step <= (x.abs() + y.abs() + 1.0) * STEP_DONE;
        if last_bits || step <= UNPROJECT_TOLERANCE * 0.1 && previous <= step {
            let inside = (x * x + y * y).sqrt() <= max_radius * RIM;
            return if inside { Ok((x, y)) } else { Err(UnprojectError::OutsideModel) };
        }
    }
    Err(UnprojectError::NotConverged)
}

/// The next place of Newton's method, and the square of how far it is from the last one.
#[inline(always)]
fn newton_step<D: Distortion, N: Number>(lens: &D, (xd, yd): (N, N), (x, y): (N, N)) -> (N, N, N) {
    let ((fx, fy), [a, b, c, d]) = lens.distort_with_jacobian(x, y);
    let (ex, ey) = (xd - fx, yd - fy);
    let per_det = x.of(1.0) / (a * d - b * c);
    let (dx, dy) = ((d * ex - b * ey) * per_det, (a * ey - c * ex) * per_det);
    (x + dx, y + dy, dx * dx + dy * dy)
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
