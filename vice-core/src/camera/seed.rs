//! Where Newton's method starts: the radial part of a lens undone by a polynomial, fitted when the camera is made.

use super::poly;

/// Coefficients of the polynomial.
const TERMS: usize = 12;

/// Two steps of Newton's method leave nothing but rounding of an error up to this, in normalised coordinates.
const CLOSE_ENOUGH: f64 = 1e-4;

/// A lens turns so fast near its rim that no polynomial follows: the seed ends at this part of the rim.
const PART_OF_RIM: f64 = 0.97;

/// Places at which the fit is held against the lens.
const CHECKED: usize = 24;

/// `seed(rd²)`, which times the distorted radius `rd` gives nearly the radius (or the angle) that was distorted to it.
///
/// It is interpolated at Chebyshev nodes in `rd²`, over as much of the image as it is right for to
/// [`CLOSE_ENOUGH`]; beyond that nothing is promised, and the slower way is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seed {
    /// Of the powers of `rd² scale - 1`, which runs from -1 to 1.
    pub(super) coefficients: [f64; TERMS],
    pub(super) scale: f64,
    /// Up to where it is good; zero where it is not at all.
    pub(super) max_rd2: f64,
    /// Whether a step more is made everywhere: where the tangential part is so large, or the polynomial so far off, that
    /// the usual ones would often not do.
    pub(super) more_steps: bool,
}

impl Seed {
    /// Good nowhere.
    pub(super) const NONE: Self =
        Self { coefficients: [0.0; TERMS], scale: 0.0, max_rd2: 0.0, more_steps: false };

    /// For what grows from 0 to `rim` and is distorted by `radial`, over distorted radii up to `reach`.
    pub(super) fn fit(radial: impl Fn(f64) -> f64, rim: f64, reach: f64) -> Self {
        let reach = if rim.is_finite() { reach.min(radial(PART_OF_RIM * rim)) } else { reach };
        if !(reach.is_finite() && reach > 0.0) {
            return Self::NONE;
        }
        let shares = [1.0, 0.85, 0.7, 0.5, 0.3];
        shares.into_iter().find_map(|share| Self::over(&radial, rim, share * reach)).unwrap_or(Self::NONE)
    }

    /// The seed up to a radius, if it is close enough there.
    fn over(radial: &impl Fn(f64) -> f64, rim: f64, reach: f64) -> Option<Self> {
        let max_rd2 = reach * reach;
        // In t from -1 to 1, with rd² = reach² (t + 1)/2.
        let radius = |t: f64| reach * (0.5 * (t + 1.0)).max(0.0).sqrt();
        let quotient = |t: f64| match radius(t) {
            rd if rd > 0.0 => inverse(radial, rim, rd).map(|r| r / rd),
            _ => Some(1.0),
        };
        let angle = |k: usize| (k as f64 + 0.5) / TERMS as f64 * std::f64::consts::PI;
        let mut values = [0.0; TERMS];
        for (k, value) in values.iter_mut().enumerate() {
            *value = quotient(angle(k).cos())?;
        }
        // The sum of Chebyshev polynomials through the values, and that as powers of t.
        let (mut coefficients, mut before, mut now) = ([0.0; TERMS], [0.0; TERMS], [0.0; TERMS]);
        now[0] = 1.0;
        for n in 0..TERMS {
            let sum: f64 = values.iter().enumerate().map(|(k, v)| v * (n as f64 * angle(k)).cos()).sum();
            let factor = sum * if n == 0 { 1.0 } else { 2.0 } / TERMS as f64;
            for (c, power) in coefficients.iter_mut().zip(&now) {
                *c += factor * power;
            }
            let twice = if n == 0 { 1.0 } else { 2.0 };
            let mut next = [0.0; TERMS];
            for i in 0..TERMS {
                next[i] = twice * if i > 0 { now[i - 1] } else { 0.0 } - before[i];
            }
            (before, now) = (now, next);
        }
        for i in 0..=CHECKED {
            let t = 2.0 * i as f64 / CHECKED as f64 - 1.0;
            let error = (poly::evaluate(&coefficients, t) - quotient(t)?) * radius(t);
            if error.is_nan() || error.abs() > CLOSE_ENOUGH {
                return None;
            }
        }
        let found = Self { coefficients, scale: 2.0 / max_rd2, max_rd2, more_steps: false };
        (coefficients.iter().all(|c| c.is_finite()) && found.scale.is_finite()).then_some(found)
    }
}

/// What is distorted to `rd`, by the secants of a bracket that is halved where they are slow (regula falsi, Illinois);
/// `None` where nothing is.
fn inverse(radial: &impl Fn(f64) -> f64, rim: f64, rd: f64) -> Option<f64> {
    let (mut low, mut high) = (0.0, rim);
    if high.is_infinite() {
        high = rd.max(1.0);
        while radial(high) < rd {
            high *= 2.0;
            if high > 1e9 {
                return None;
            }
        }
    }
    let (mut at_low, mut at_high) = (-rd, radial(high) - rd);
    if at_high.is_nan() || at_high < 0.0 {
        return None;
    }
    let mut last_side = 0;
    for _ in 0..60 {
        if high - low <= 1e-13 * high {
            break;
        }
        let secant = high - at_high * (high - low) / (at_high - at_low);
        let next = if secant > low && secant < high { secant } else { 0.5 * (low + high) };
        let at_next = radial(next) - rd;
        let side = if at_next < 0.0 { -1 } else { 1 };
        if at_next == 0.0 {
            return Some(next);
        } else if side < 0 {
            (low, at_low) = (next, at_next);
            if last_side == side {
                at_high *= 0.5;
            }
        } else {
            (high, at_high) = (next, at_next);
            if last_side == side {
                at_low *= 0.5;
            }
        }
        last_side = side;
    }
    Some(0.5 * (low + high))
}
