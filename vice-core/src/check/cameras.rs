//! Two cameras that see the same at the same moment: their place against each other, by images alone.
//!
//! Points that both see have one rotation and one direction from camera to camera; both follow from the extrinsics as well.
//! Nothing has to move, and no clock or pose is asked.

use nalgebra::{UnitQuaternion, Vector3};

use super::Check;
use crate::finding::{Finding, State, short};
use crate::frames::{Camera, Rigid, rotation_vector_rad};
use crate::metrics::student::quantile_975;
use crate::statistics::median;

/// What this check is.
pub const CHECK: Check = Check {
    name: "cameras",
    title: "cameras against each other (with --images)",
    looks_at: "rotation and direction between two cameras with a common view, by frames of one stamp, against their extrinsics",
    threshold: "wrong where the rotation is off by more than 3 degrees beyond its 95 % interval, or the direction by more than 45 degrees; look above 1 and 15 degrees",
    source: "epipolar geometry; interval by how much frames disagree",
};

/// Rotations beyond their interval, radians.
const LOOK_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;
const WRONG_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Directions, radians; and by how much frames may disagree about them.
const LOOK_ALONG_RAD: f64 = 15.0 * std::f64::consts::PI / 180.0;
const WRONG_ALONG_RAD: f64 = 45.0 * std::f64::consts::PI / 180.0;
const SPREAD_ALONG_RAD: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Fewer frames say nothing.
const FEWEST: usize = 4;
/// An interval wider than this to either side tells nothing, radians.
const WIDEST_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// What one frame of each camera says: `second ~ turn * first + along / depth`.
#[derive(Clone, Copy, Debug)]
pub struct Sighted {
    /// Takes directions of the first camera to those of the second.
    pub turn: UnitQuaternion<f64>,
    /// Direction from the first camera's place as the second sees it, of length one; `None` where only the turn is known.
    pub along: Option<Vector3<f64>>,
}

/// Two cameras by their images against their extrinsics, `second_from_first`.
pub fn cameras(about: &str, seen: &[Sighted], given: &Rigid<Camera, Camera>) -> Finding {
    let unknown = |says: String| Finding::new(CHECK.name, about, State::Unknown, says);
    if seen.len() < FEWEST {
        return unknown(format!(
            "{} frames of one stamp show enough common points, {FEWEST} are needed",
            seen.len()
        ));
    }
    let off: Vec<Vector3<f64>> =
        seen.iter().map(|s| rotation_vector_rad(&(s.turn * given.rotation().inverse()))).collect();
    let middle =
        |f: &dyn Fn(&Vector3<f64>) -> f64| median(&mut off.iter().map(f).collect::<Vec<_>>()).unwrap_or(0.0);
    let turn = Vector3::from_fn(|i, _| middle(&|v| v[i]));
    // A median is less sure than a mean, by this factor; the median of deviations is 0.6745 standard deviations.
    let t = quantile_975(seen.len() as f64 - 1.0).unwrap_or(f64::INFINITY);
    let per = 1.2533 / 0.6745 * t / (seen.len() as f64).sqrt();
    let half = Vector3::from_fn(|i, _| per * middle(&|v| (v[i] - turn[i]).abs()));
    let beyond = turn.zip_map(&half, |v, h| (v.abs() - h).max(0.0)).norm();
    if half.max() > WIDEST_RAD && beyond < WRONG_RAD {
        return unknown(format!(
            "too uncertain: the rotation between both is known within {:.1} degrees only",
            half.max().to_degrees()
        ));
    }
    let along = direction(seen, given);
    let state = match (beyond, along.unwrap_or(0.0)) {
        (b, a) if b > WRONG_RAD || a > WRONG_ALONG_RAD => State::Wrong,
        (b, a) if b > LOOK_RAD || a > LOOK_ALONG_RAD => State::Look,
        _ => State::Ok,
    };
    let degrees = |rad: f64| short((1e2 * rad.to_degrees()).round() / 1e2);
    let says = match (state, along) {
        (State::Ok, _) => {
            format!("both lie as their extrinsics say, within {} degrees", degrees(turn.norm() + half.max()))
        }
        (_, Some(a)) if beyond <= LOOK_RAD || a > WRONG_ALONG_RAD => format!(
            "by the images the second camera lies in another direction from the first than the extrinsics say, {} degrees off",
            degrees(a)
        ),
        _ => format!(
            "by the images both are turned by {} degrees against their extrinsics",
            degrees(turn.norm())
        ),
    };
    let finding = Finding::new(CHECK.name, about, state, says)
        .number("off", turn.norm().to_degrees(), "degrees")
        .number("half-of-95%-interval", half.max().to_degrees(), "degrees")
        .number("direction-off", along.map_or(f64::NAN, f64::to_degrees), "degrees")
        .number("frames", seen.len() as f64, "");
    match state {
        State::Ok => finding,
        _ => finding.mend("see whether extrinsics were exchanged or inverted, or calibrate anew: `calibration` takes others"),
    }
}

/// By how much the direction between both is off; `None` where it is not known.
fn direction(seen: &[Sighted], given: &Rigid<Camera, Camera>) -> Option<f64> {
    let expected = given.translation().try_normalize(1e-3)?;
    let known: Vec<Vector3<f64>> = seen.iter().filter_map(|s| s.along).collect();
    if known.len() < FEWEST {
        return None;
    }
    let middle: Vector3<f64> =
        Vector3::from_fn(|i, _| median(&mut known.iter().map(|v| v[i]).collect::<Vec<_>>()).unwrap_or(0.0));
    let spread = median(&mut known.iter().map(|v| v.angle(&middle)).collect::<Vec<_>>())?;
    (spread < SPREAD_ALONG_RAD).then(|| middle.angle(&expected))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    fn said(turned: f64, swapped: bool, count: usize) -> Finding {
        let truth: Rigid<Camera, Camera> = Rigid::from_parts(
            Vector3::new(-0.11, 0.001, 0.002),
            UnitQuaternion::from_euler_angles(0.01, -0.02, 0.0),
        );
        let mut random = SplitMix::new(1);
        let seen: Vec<Sighted> = (0..count)
            .map(|i| {
                let size = if i % 7 == 3 { 0.1 } else { 2e-3 };
                let mut noise = || Vector3::from_fn(|_, _| size * random.normal());
                Sighted {
                    turn: UnitQuaternion::from_scaled_axis(noise()) * truth.rotation(),
                    along: Some((truth.translation().normalize() + noise() * 10.0).normalize()),
                }
            })
            .collect();
        let off = UnitQuaternion::from_euler_angles(0.0, f64::to_radians(turned), 0.0);
        let given = match swapped {
            true => truth.inverse(),
            false => Rigid::from_parts(truth.translation(), off * truth.rotation()),
        };
        cameras("cam0 / cam1", &seen, &given)
    }

    #[test]
    fn cameras_that_lie_as_said_are_fine_and_others_are_told() {
        assert_eq!(said(0.0, false, 12).state, State::Ok, "{:?}", said(0.0, false, 12));
        assert_eq!(said(2.0, false, 12).state, State::Look, "{:?}", said(2.0, false, 12));
        let wrong = said(6.0, false, 12);
        assert!(wrong.state == State::Wrong && wrong.says.contains("turned by 6"), "{wrong:?}");
        // Left taken for right: hardly a rotation, and the other direction.
        let swapped = said(0.0, true, 12);
        assert!(swapped.state == State::Wrong && swapped.says.contains("another direction"), "{swapped:?}");
        assert_eq!(said(6.0, false, 3).state, State::Unknown);
    }
}
