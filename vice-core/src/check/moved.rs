//! Whether a camera lies in the body as it did in an earlier recording of the same rig.
//!
//! Each recording says by itself how the camera is turned in the body: its images against gyroscope or poses
//! ([`hand_eye`](super::hand_eye)). The extrinsics in the files have no part in the difference, so that a mount that was
//! knocked is seen although both recordings carry the same calibration.

use nalgebra::{UnitQuaternion, Vector3};

use super::Check;
use super::hand_eye::HandEye;
use crate::finding::{Finding, State, short};

/// What this check is.
pub const CHECK: Check = Check {
    name: "moved",
    title: "a camera that moved since an earlier recording (with --before)",
    looks_at: "the rotation of the camera in the body by the images of both recordings, each against its own gyroscope or poses",
    threshold: "wrong where both rotations differ by more than 2 degrees beyond their common 95 % interval, look above 0.5 degrees; unknown where one of them is not known",
    source: "hand-eye rotations of both; intervals by parts of each recording",
};

/// Angles beyond the interval, radians.
const LOOK_RAD: f64 = 0.5 * std::f64::consts::PI / 180.0;
const WRONG_RAD: f64 = 2.0 * std::f64::consts::PI / 180.0;

/// How a camera lies in the body, by the images of one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// Gyroscope or pose stream that its turns were compared with.
    pub source: String,
    /// Rotation `body_from_camera` by the images.
    pub body_from_camera: UnitQuaternion<f64>,
    /// Half of its 95 % interval about the axis that is known least, radians.
    pub half_95_rad: f64,
    /// The only axis about which the camera turned, in the camera's frame: the angle about it is not known.
    pub only_axis: Option<Vector3<f64>>,
}

impl Seen {
    /// What a hand-eye calibration against `source` says, with the rotation `body_from_camera` that was given to it.
    pub fn of(source: &str, given: &UnitQuaternion<f64>, found: &HandEye) -> Self {
        Self {
            source: source.to_string(),
            body_from_camera: given * found.given_from_true,
            half_95_rad: found.half_95_rad,
            only_axis: found.only_axis.map(|axis| found.given_from_true.inverse() * axis),
        }
    }
}

/// The finding about one camera of two recordings; `None` where a recording does not tell how it lies.
pub fn moved(camera: &str, before: Option<&Seen>, now: Option<&Seen>) -> Finding {
    let unknown = |says: String| Finding::new(CHECK.name, camera, State::Unknown, says);
    let (before, now) = match (before, now) {
        (Some(before), Some(now)) => (before, now),
        (None, _) => {
            return unknown(
                "the earlier recording does not tell how the camera lies in the body".to_string(),
            );
        }
        (_, None) => {
            return unknown("this recording does not tell how the camera lies in the body".to_string());
        }
    };
    if before.only_axis.is_some() || now.only_axis.is_some() {
        return unknown(
            "the robot turned about one axis only: how the camera lies in the body is not known in full"
                .to_string(),
        );
    }
    let angle = before.body_from_camera.angle_to(&now.body_from_camera);
    let half = before.half_95_rad.hypot(now.half_95_rad);
    let state = match angle - half {
        beyond if beyond > WRONG_RAD => State::Wrong,
        beyond if beyond > LOOK_RAD => State::Look,
        _ => State::Ok,
    };
    let degrees = |rad: f64| short((1e2 * rad.to_degrees()).round() / 1e2);
    let says = match state {
        State::Ok => format!(
            "{camera} lies in the body as it did in the earlier recording, within {} degrees",
            degrees(angle + half)
        ),
        _ => format!(
            "{camera} is turned by {} ± {} degrees against the body since the earlier recording",
            degrees(angle),
            degrees(half)
        ),
    };
    let finding = Finding::new(CHECK.name, camera, state, says)
        .number("turned", angle.to_degrees(), "degrees")
        .number("half-of-95%-interval", half.to_degrees(), "degrees");
    match state {
        State::Ok => finding,
        _ => finding.mend(
            "calibrate the extrinsics anew for the recordings since then, and give them with `calibration`",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(degrees: f64, half: f64) -> Seen {
        Seen {
            source: "imu".to_string(),
            body_from_camera: UnitQuaternion::from_euler_angles(-1.9, degrees.to_radians(), 0.3),
            half_95_rad: half.to_radians(),
            only_axis: None,
        }
    }

    #[test]
    fn a_turn_beyond_both_intervals_is_told() {
        let state = |a: Seen, b: Seen| moved("cam0", Some(&a), Some(&b)).state;
        assert_eq!(state(seen(0.0, 0.3), seen(0.4, 0.4)), State::Ok);
        assert_eq!(state(seen(0.0, 0.3), seen(1.2, 0.4)), State::Look);
        assert_eq!(state(seen(0.0, 0.3), seen(4.0, 0.4)), State::Wrong);
        // What is known within three degrees does not tell two apart.
        assert_eq!(state(seen(0.0, 0.3), seen(3.0, 3.0)), State::Ok);
    }

    #[test]
    fn what_is_not_known_is_no_praise() {
        let planar = Seen { only_axis: Some(Vector3::y()), ..seen(0.0, 0.1) };
        assert_eq!(moved("cam0", Some(&planar), Some(&seen(0.0, 0.1))).state, State::Unknown);
        assert_eq!(moved("cam0", None, Some(&seen(0.0, 0.1))).state, State::Unknown);
        assert_eq!(moved("cam0", Some(&seen(0.0, 0.1)), None).state, State::Unknown);
    }
}
