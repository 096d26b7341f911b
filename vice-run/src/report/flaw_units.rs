//! In which unit, and for which axis, a flaw's parameter is shown.

use vice_core::diagnose::{Curve, Flaw, PARAMETERS};

/// The unit that a parameter is shown in, and how many of them one of its own is.
pub(crate) fn shown_unit(curve: &Curve) -> (&'static str, f64) {
    PARAMETERS.iter().find(|p| p.name == curve.parameter).map_or(("", 1.0), |p| (p.unit.sign, p.unit.each))
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
