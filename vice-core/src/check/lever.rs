//! Which point of the body a pose stream is of: its lever arm against the accelerometer, or against a reference.
//!
//! A point `l` off another one of the same body moves by `(R - 1) l` beside it while the body turns by `R`. Where the body
//! turns about two axes at least, `l` follows by least squares: from relative motions of two streams, or from second
//! differences of positions against the specific force. Where the body hardly turns nothing is said.

use nalgebra::{Matrix3, Matrix3xX, Vector3};

use super::Check;
use super::least::{Row, solve};
use crate::finding::{Finding, State, short};
use crate::frames::{Body, BodyFromCamera, Rigid};

/// What this check is.
pub const CHECK: Check = Check {
    name: "lever-arm",
    title: "point of the body that poses are of",
    looks_at: "how far the point of a pose stream lies off the IMU, by the accelerometer, or off the reference's point",
    threshold: "look where it is more than 5 cm beyond the 95 % interval off the IMU, or more than 2 cm off the reference's; the camera's place is named where it is that",
    source: "rigid-body motion; interval by parts of the recording",
};

/// Lever arms beyond their interval by more than these are worth a look, metres.
const OFF_IMU_M: f64 = 0.05;
const OFF_REFERENCE_M: f64 = 0.02;
/// An interval wider than this to either side tells nothing, metres.
const WIDEST_M: f64 = 0.10;
/// A lever arm this near to the camera's is that, metres.
const CAMERA_M: f64 = 0.03;
/// Biases of accelerometers are about this, and residuals, m/s².
const BIAS_M_S2: f64 = 0.3;
const LEFT_M_S2: f64 = 0.1;

/// Poses before, at and after a moment, `w` seconds apart, and the mean specific force about it in the body of that moment,
/// weighted by a triangle.
pub(super) struct Swing {
    pub(super) poses: [crate::frames::WorldFromBody; 3],
    pub(super) force: Vector3<f64>,
}

/// The lever arm of a stream against the accelerometer; nothing where it is not known.
pub(super) fn off_imu(
    name: &str,
    swings: &[Swing],
    step_s: f64,
    camera: Option<BodyFromCamera>,
) -> Option<Finding> {
    let rows: Vec<Row> = swings
        .iter()
        .map(|swing| {
            let [a, b, c] = swing.poses;
            let back = b.rotation().inverse();
            let per_s2 = 1.0 / (step_s * step_s);
            let curve = back * ((c.translation() - b.translation() * 2.0 + a.translation()) * per_s2);
            let turned = |pose: &crate::frames::WorldFromBody| {
                (back * pose.rotation()).to_rotation_matrix().into_inner()
            };
            let bend = (turned(&a) + turned(&c) - Matrix3::identity() * 2.0) * per_s2;
            let mut lever = Matrix3xX::zeros(9);
            lever.fixed_view_mut::<3, 3>(0, 0).copy_from(&back.to_rotation_matrix().into_inner());
            lever.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
            lever.fixed_view_mut::<3, 3>(0, 6).copy_from(&bend);
            Row { lever, value: curve - swing.force }
        })
        .collect();
    let bias = 10.0 * (LEFT_M_S2 / BIAS_M_S2).powi(2);
    let solved = solve(&rows, &[0.0, 0.0, 0.0, bias, bias, bias, 0.0, 0.0, 0.0])?;
    let lever = Vector3::new(solved.x[6], solved.x[7], solved.x[8]);
    let half = Vector3::new(solved.half_95[6], solved.half_95[7], solved.half_95[8]);
    let found = said(name, "imu", "the IMU", (lever, half), OFF_IMU_M, camera);
    Some(found.number("acceleration-left", solved.left, "m/s²"))
}

/// The lever arm of an estimate against a reference, from relative motions `(reference, estimate)` in the order of time;
/// nothing where it is not known, or none.
pub(super) fn off_reference(
    name: &str,
    reference: &str,
    motions: impl Iterator<Item = (Rigid<Body, Body>, Rigid<Body, Body>)>,
    camera: Option<BodyFromCamera>,
) -> Option<Finding> {
    let rows: Vec<Row> = motions
        .map(|(r, e)| {
            let turn = r.rotation().to_rotation_matrix().into_inner();
            let lever = Matrix3xX::from_columns(&[
                (turn - Matrix3::identity()).column(0).into_owned(),
                (turn - Matrix3::identity()).column(1).into_owned(),
                (turn - Matrix3::identity()).column(2).into_owned(),
            ]);
            Row { lever, value: e.translation() - r.translation() }
        })
        .collect();
    let solved = solve(&rows, &[0.0; 3])?;
    let part = |v: &nalgebra::DVector<f64>| Vector3::new(v[0], v[1], v[2]);
    let (lever, half) = (part(&solved.x), part(&solved.half_95));
    let found =
        said(name, reference, &format!("that of {reference}"), (lever, half), OFF_REFERENCE_M, camera);
    (found.state == State::Look).then(|| found.number("way-left", solved.left, "m"))
}

fn said(
    name: &str,
    other: &str,
    other_words: &str,
    (lever, half): (Vector3<f64>, Vector3<f64>),
    off_m: f64,
    camera: Option<BodyFromCamera>,
) -> Finding {
    let about = format!("{other} / {name}");
    let beyond = lever.zip_map(&half, |l, h| (l.abs() - h).max(0.0)).norm();
    let widest = half.max();
    let place = |v: &Vector3<f64>| format!("[{:.3}, {:.3}, {:.3}] m", v.x, v.y, v.z);
    let numbers = |finding: Finding| {
        finding.number("lever-arm", lever.norm(), "m").number("half-of-95%-interval", widest, "m")
    };
    if beyond > off_m {
        let near = camera.filter(|c| (c.translation() - lever).norm() < CAMERA_M.max(widest));
        let whose = match near {
            Some(_) => ": where the camera is",
            None => "",
        };
        let says = format!(
            "the poses of {name} are of a point {:.3} m off {other_words}, at {} in the body{whose}",
            lever.norm(),
            place(&lever)
        );
        let mend = "`estimate-frame` FILE says where the frame of the poses lies in the body";
        return numbers(Finding::new(CHECK.name, about, State::Look, says)).mend(mend);
    }
    if widest > WIDEST_M {
        let says = format!(
            "too uncertain: the body turns too little to tell where the point of {name} lies, within {} m",
            short((1e3 * widest).ceil() / 1e3)
        );
        return numbers(Finding::new(CHECK.name, about, State::Unknown, says));
    }
    let says = format!(
        "the poses of {name} are of the point of {other_words}, within {} m",
        short((1e3 * (lever.norm() + widest)).ceil() / 1e3)
    );
    numbers(Finding::new(CHECK.name, about, State::Ok, says))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::WorldFromBody;
    use crate::random::SplitMix;
    use nalgebra::UnitQuaternion;

    fn pose(t: f64, level: bool) -> WorldFromBody {
        let tilt = if level { 0.0 } else { 1.0 };
        let turn = UnitQuaternion::from_euler_angles(
            tilt * 0.3 * (1.9 * t).sin(),
            tilt * 0.25 * (1.3 * t).cos(),
            0.5 * t + 0.3 * (0.8 * t).sin(),
        );
        let at = Vector3::new(2.0 * (0.5 * t).cos(), 1.5 * (0.7 * t).sin(), 1.0 + 0.3 * (0.9 * t).sin());
        Rigid::from_parts(at, turn)
    }

    /// The same of a point that lies elsewhere in the body, with noise.
    fn of_point(t: f64, level: bool, lever: Vector3<f64>, random: &mut SplitMix) -> WorldFromBody {
        let pose = pose(t, level);
        let noise = Vector3::from_fn(|_, _| 1e-3 * random.normal());
        Rigid::from_parts(pose.translation() + pose.rotation() * lever + noise, pose.rotation())
    }

    fn against_reference(level: bool, lever: Vector3<f64>) -> Option<Finding> {
        let mut random = SplitMix::new(3);
        let own: Vec<WorldFromBody> =
            (0..120).map(|i| of_point(0.5 * f64::from(i), level, lever, &mut random)).collect();
        let motions = (1..120).map(|i| {
            let t = |i: usize| 0.5 * i as f64;
            (pose(t(i - 1), level).inverse() * pose(t(i), level), own[i - 1].inverse() * own[i])
        });
        let camera = Rigid::from_parts(Vector3::new(0.1, -0.03, 0.02), UnitQuaternion::identity());
        off_reference("est", "truth", motions, Some(camera))
    }

    #[test]
    fn a_point_beside_the_references_is_told_with_its_place() {
        assert_eq!(against_reference(false, Vector3::zeros()), None);
        let found = against_reference(false, Vector3::new(0.2, 0.0, -0.1)).unwrap();
        assert!(found.says.contains("at [0.20") && found.says.contains("-0.10"), "{found:?}");
        assert!(!found.says.contains("camera"), "{found:?}");
        let camera = against_reference(false, Vector3::new(0.1, -0.03, 0.02)).unwrap();
        assert!(camera.says.ends_with("where the camera is"), "{camera:?}");
        // A cart: how high it lies is not known, and not said.
        assert_eq!(against_reference(true, Vector3::new(0.0, 0.0, 0.5)), None);
    }

    #[test]
    fn the_accelerometer_tells_the_lever_arm() {
        let (w, h) = (0.4, 1e-3);
        let said = |lever: Vector3<f64>| {
            let mut random = SplitMix::new(4);
            let swings: Vec<Swing> = (1..150)
                .map(|i| {
                    let t = w * f64::from(i);
                    let poses = [t - w, t, t + w].map(|t| of_point(t, false, lever, &mut random));
                    // The triangle over both stretches of the true acceleration less gravity.
                    let (mut sum, mut total) = (Vector3::zeros(), 0.0);
                    for k in -39..40 {
                        let s = t + 0.01 * f64::from(k);
                        let at = |s: f64| pose(s, false).translation();
                        let second = (at(s + h) - at(s) * 2.0 + at(s - h)) / (h * h);
                        let weight = 1.0 - f64::from(k).abs() / 40.0;
                        sum += weight * (second + Vector3::new(0.0, 0.0, 9.81));
                        total += weight;
                    }
                    let force =
                        pose(t, false).rotation().inverse() * (sum / total) + Vector3::new(0.05, 0.1, -0.1);
                    Swing { poses, force }
                })
                .collect();
            off_imu("est", &swings, w, None).unwrap()
        };
        let fine = said(Vector3::zeros());
        assert_eq!(fine.state, State::Ok, "{fine:?}");
        let off = said(Vector3::new(0.0, 0.3, 0.1));
        assert!(off.state == State::Look && off.says.contains("off the IMU"), "{off:?}");
        let told = off.numbers.iter().find(|n| n.name == "lever-arm").unwrap().value;
        assert!((told - 0.316).abs() < 0.03, "{off:?}");
    }
}
