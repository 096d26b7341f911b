//! How wide the interval of a fitted value is, and whether it holds zero.

use super::fit::Fit;
use super::flaw::Flaw;

/// Half the width of a 95 % interval in posterior deviations: the sizes of the noise are estimated, and the model is no
/// truth. Of 1100 values of flights that each had pose errors of their own 95 % lay within 1.9 to 2.1; of real data more.
const HALF_WIDTH: f64 = 2.4;
/// An integration errs by more than white noise: of 110 tilts 91 % lay within 2.4 deviations, 95 % within 3.4.
const HALF_WIDTH_TILT: f64 = 4.0;
/// At constant speed a clock and a position are nearly one: of 215 values 95 % lay within 1.7 to 2.5.
const HALF_WIDTH_CLOCK: f64 = 2.6;
/// Without a reference both lean on how high the estimate places the camera: of 200 values 95 % lay within 2.5 to 2.7.
const HALF_WIDTH_PLACE: f64 = 2.5;
/// A flaw is there for sure beyond this times its interval.
const SURELY: f64 = 1.15;

/// In posterior deviations.
fn half_width(flaw: Flaw) -> f64 {
    match flaw {
        Flaw::InitialTilt => HALF_WIDTH_TILT,
        Flaw::ClockOffset | Flaw::ClockRate | Flaw::ClockStep => HALF_WIDTH_CLOCK,
        Flaw::ExtrinsicTranslation | Flaw::Scale => HALF_WIDTH_PLACE,
        _ => HALF_WIDTH,
    }
}

/// Half the width of the interval of one parameter; zero if it is not solved for.
pub(super) fn half(fit: &Fit, flaw: Flaw, parameter: usize) -> f64 {
    let variance = fit.place_of(parameter).map_or(0.0, |i| fit.solution.covariance[(i, i)].max(0.0));
    half_width(flaw) * variance.sqrt()
}

/// The length of a flaw that is a vector, and half the width of its interval.
pub(super) fn length(fit: &Fit, flaw: Flaw) -> Option<(f64, f64)> {
    // The yaw rate of a drift is of another unit than its velocity.
    let numbers = match flaw {
        Flaw::ExtrinsicRotation | Flaw::ExtrinsicTranslation | Flaw::Drift => 3,
        Flaw::InitialTilt => 2,
        _ => return None,
    };
    let first = flaw.parameters().start;
    let places: Vec<usize> = (first..first + numbers).map(|p| fit.place_of(p)).collect::<Option<_>>()?;
    let values = fit.values();
    let x: Vec<f64> = (0..numbers).map(|i| values[first + i]).collect();
    let length = x.iter().map(|v| v * v).sum::<f64>().sqrt();
    let mut variance = 0.0;
    for (a, i) in places.iter().enumerate() {
        for (b, j) in places.iter().enumerate() {
            variance += x[a] * x[b] * fit.solution.covariance[(*i, *j)];
        }
    }
    Some((length, half_width(flaw) * variance.max(0.0).sqrt() / length.max(1e-12)))
}

/// Whether a flaw of a fit is more than nothing: the interval of its length, or of one of its numbers, does not hold zero.
pub(super) fn shows(fit: &Fit, flaw: Flaw) -> bool {
    let values = fit.values();
    let beyond = |parameter: usize| values[parameter].abs() > SURELY * half(fit, flaw, parameter);
    match length(fit, flaw) {
        // Of a drift the yaw rate is a number beside the velocity.
        Some((length, half)) => {
            length > SURELY * half || (flaw == Flaw::Drift && beyond(flaw.parameters().end - 1))
        }
        None => flaw.solved().any(beyond),
    }
}
