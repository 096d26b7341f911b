//! Flaws and verdicts in words.

use super::document::Estimated;
use super::flaw::{Flaw, PARAMETERS, Unit};

/// `clock offset: +50.3 ms [49.1, 51.6]`.
pub(super) fn line(flaw: Flaw, parameters: &[Estimated], size: Option<&Estimated>) -> String {
    let numbers = match (flaw, parameters, size) {
        (Flaw::ClockStep, [step, at], _) => {
            format!("{} from {} on", number(step, unit(step), true), number(at, unit(at), false))
        }
        (Flaw::PrincipalPoint, [u, v], _) => {
            format!("u {}, v {}", number(u, unit(u), true), number(v, unit(v), true))
        }
        (Flaw::Drift, [x, y, z, yaw], Some(size)) => format!(
            "{} ({}), yaw {}",
            number(size, unit(x), false),
            axes(&[x, y, z]),
            number(yaw, unit(yaw), true)
        ),
        (_, [x, ..], Some(size)) => {
            format!("{} ({})", number(size, unit(x), false), axes(&parameters.iter().collect::<Vec<_>>()))
        }
        (_, parameters, _) => {
            // A plain number goes by its name.
            let own = |p: &Estimated| match unit(p) {
                Unit { sign: "", each } => number(p, Unit { sign: name_of(p), each }, true),
                unit => number(p, unit, true),
            };
            parameters.iter().map(own).collect::<Vec<_>>().join(", ")
        }
    };
    format!("{}: {numbers}", flaw.words())
}

fn unit(of: &Estimated) -> Unit {
    PARAMETERS.iter().find(|p| p.name == of.name).map_or(Unit { sign: "", each: 1.0 }, |p| p.unit)
}

fn name_of(of: &Estimated) -> &'static str {
    PARAMETERS.iter().find(|p| p.name == of.name).map_or("", |p| p.name)
}

fn number(e: &Estimated, Unit { sign, each }: Unit, signed: bool) -> String {
    let (value, low, high) = (e.value * each, e.low * each, e.high * each);
    let decimals = decimals(high - low);
    let space = if sign.starts_with('°') { "" } else { " " };
    let value = if signed { format!("{value:+.decimals$}") } else { format!("{value:.decimals$}") };
    format!("{value}{space}{sign} [{low:.decimals$}, {high:.decimals$}]")
}

fn axes(parameters: &[&Estimated]) -> String {
    let Unit { sign, each } = parameters.first().map_or(Unit { sign: "", each: 1.0 }, |p| unit(p));
    let narrowest = parameters.iter().map(|p| (p.high - p.low) * each).fold(f64::INFINITY, f64::min);
    let decimals = decimals(narrowest);
    let axes: Vec<String> = ["x", "y", "z"]
        .iter()
        .zip(parameters)
        .map(|(name, p)| format!("{name} {:+.decimals$}", p.value * each))
        .collect();
    let space = if sign.starts_with('°') { "" } else { " " };
    format!("{}{space}{sign}", axes.join(", "))
}

/// An interval of exact data has no width worth the digits.
const MOST_DECIMALS: f64 = 3.0;

/// Two digits of the width of the interval are worth reading.
fn decimals(width: f64) -> usize {
    if !(width > 0.0 && width.is_finite()) {
        return 3;
    }
    (1.0 - width.log10().floor()).clamp(0.0, MOST_DECIMALS) as usize
}

/// What to do about a flaw, given the clock offset that was in use.
pub(super) fn correction(flaw: Flaw, values: &[f64], time_offset_s: f64) -> String {
    let all =
        |scale: f64| values.iter().map(|v| format!("{:+.6}", -v * scale)).collect::<Vec<_>>().join(", ");
    match flaw {
        Flaw::ClockOffset => format!("--time-offset {:.6}", time_offset_s - values[0]),
        Flaw::ExtrinsicRotation => {
            format!("turn body_from_camera on its right by the rotation vector [{}] rad", all(1.0))
        }
        Flaw::ExtrinsicTranslation => format!("add [{}] m to the translation of body_from_camera", all(1.0)),
        Flaw::FocalLength => format!("multiply fx and fy by {:.6}", 1.0 / (1.0 + values[0])),
        Flaw::PrincipalPoint => format!("add [{}] px to cx, cy", all(1.0)),
        Flaw::InitialTilt => {
            format!("turn the start of the integration about the world's x and y by [{}] rad", all(1.0))
        }
        Flaw::Scale => format!("multiply the translations of the estimate by {:.6}", 1.0 / (1.0 + values[0])),
        Flaw::Drift => format!(
            "the estimate drifts: calibrate its source; until then add [{}] (m/s, and rad/s of yaw) times the time",
            all(1.0)
        ),
        Flaw::Distortion => format!("add [{}] to k1, k2, p1, p2", all(1.0)),
        Flaw::Aspect => format!("multiply fx by {:.6}", 1.0 / (1.0 + values[0])),
        Flaw::ClockRate => {
            format!("divide the estimate's times since the camera's first frame by {:.9}", 1.0 + values[0])
        }
        Flaw::ClockStep => format!(
            "take {:.6} s off the estimate's stamps from {:.3} s after the camera's first frame on",
            values[0], values[1]
        ),
        Flaw::RollingShutter => format!(
            "the rows of an image are exposed over {:.6} s: use a global shutter, or stamps of the rows",
            values[0]
        ),
    }
}

/// `a`, `a and b`, `a, b and c`.
pub(super) fn listed(words: &[String], last: &str) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., end] => format!("{} {last} {end}", rest.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn estimated(name: &str, value: f64, low: f64, high: f64) -> Estimated {
        Estimated { name: name.to_string(), value, low, high }
    }

    #[test]
    fn lines_say_value_unit_and_interval() {
        let offset = [estimated("offset_s", 0.0503, 0.0491, 0.0516)];
        assert_eq!(line(Flaw::ClockOffset, &offset, None), "clock offset: +50.3 ms [49.1, 51.6]");
        let focal = [estimated("focal_share", -0.03, -0.0312, -0.0291)];
        assert_eq!(line(Flaw::FocalLength, &focal, None), "focal length: -3.00 % [-3.12, -2.91]");
        let turn = [("x", 0.0), ("y", 0.01), ("z", 0.0)]
            .map(|(axis, v): (_, f64)| estimated(&format!("rotation_{axis}_rad"), v, v - 0.001, v + 0.001));
        let size = estimated("rotation_rad", 0.01, 0.009, 0.011);
        assert_eq!(
            line(Flaw::ExtrinsicRotation, &turn, Some(&size)),
            "extrinsic rotation: 0.57° [0.52, 0.63] (x +0.00, y +0.57, z +0.00°)"
        );
        assert_eq!(
            listed(&["scale", "drift", "clock offset"].map(str::to_string), "and"),
            "scale, drift and clock offset"
        );
    }

    #[test]
    fn corrections_turn_the_sign() {
        assert_eq!(correction(Flaw::ClockOffset, &[0.0503], 0.05), "--time-offset -0.000300");
        assert_eq!(correction(Flaw::FocalLength, &[0.25], 0.0), "multiply fx and fy by 0.800000");
    }
}
