//! In which unit, and for which axis, a flaw's parameter is shown.

use vice_core::diagnose::{Curve, Flaw};

/// The unit that a parameter is shown in, and how many of them one of its own is.
pub(crate) fn shown_unit(curve: &Curve) -> (&'static str, f64) {
    let degrees = 180.0 / std::f64::consts::PI;
    match curve.flaw {
        Flaw::ClockOffset => ("ms", 1e3),
        Flaw::ExtrinsicRotation | Flaw::InitialTilt => ("°", degrees),
        Flaw::ExtrinsicTranslation => ("mm", 1e3),
        Flaw::FocalLength | Flaw::Scale | Flaw::Aspect => ("%", 1e2),
        Flaw::ClockRate => ("ppm", 1e6),
        Flaw::RollingShutter => ("ms", 1e3),
        Flaw::Distortion => ("", 1.0),
        Flaw::Drift if curve.parameter.ends_with("rad_s") => ("°/s", degrees),
        Flaw::Drift => ("mm/s", 1e3),
        _ => ("px", 1.0),
    }
}

/// The axis of a parameter of several, as its name has it.
pub(crate) fn axis(curve: &Curve) -> &'static str {
    let parts: Vec<&str> = curve.parameter.split('_').collect();
    match curve.flaw {
        Flaw::ClockOffset
        | Flaw::FocalLength
        | Flaw::Scale
        | Flaw::Aspect
        | Flaw::ClockRate
        | Flaw::RollingShutter => "",
        Flaw::Distortion => {
            ["k1", "k2", "p1", "p2"].into_iter().find(|name| parts.contains(name)).unwrap_or("")
        }
        Flaw::Drift if parts.first() == Some(&"yaw") => "yaw",
        _ => ["x", "y", "z", "u", "v"].into_iter().find(|axis| parts.contains(axis)).unwrap_or(""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_is_shown_in_a_unit_that_is_read_at_a_glance() {
        let curve = |flaw, parameter: &str| Curve {
            flaw,
            parameter: parameter.to_string(),
            points: vec![],
            seen_from: None,
            found_from: None,
        };
        let shown = |flaw, parameter: &str| {
            let c = curve(flaw, parameter);
            (axis(&c), shown_unit(&c).0)
        };
        assert_eq!(shown(Flaw::Drift, "yaw_drift_rad_s"), ("yaw", "°/s"));
        assert_eq!(shown(Flaw::Drift, "drift_z_m_s"), ("z", "mm/s"));
        assert_eq!(shown(Flaw::PrincipalPoint, "principal_v_px"), ("v", "px"));
        assert_eq!(shown(Flaw::ClockOffset, "offset_s"), ("", "ms"));
    }
}
