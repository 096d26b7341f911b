//! How the camera lies in the body, by how both turn: hand-eye calibration of the rotation alone.
//!
//! A camera that is fixed to a body turns as the body does, about axes that its extrinsics turn. The turn rates of the
//! camera come from images alone, those of the body from a gyroscope or from poses, seen through the extrinsics that are
//! given: where these are right, both are the same vectors. The constant rotation that is left between them is fitted by
//! least squares with outliers counted less; its interval comes from how much parts of the recording disagree.
//!
//! Source: R. Tsai and R. Lenz, "A new technique for fully autonomous and efficient 3D robotics hand/eye calibration", 1989
//! (rotation part); the solution of Wahba's problem as in [`crate::metrics::align`].

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::Check;
use super::clock::pieces::Pieces;
use super::least::weight;
use super::turning::Turning;
use crate::finding::{Finding, State, short};
use crate::frames::rotation_vector_rad;
use crate::metrics::align::best_rotation;
use crate::metrics::student::quantile_975;
use crate::statistics::median;

/// What this check is.
pub const CHECK: Check = Check {
    name: "hand-eye",
    title: "rotation of the camera in the body (with --images)",
    looks_at: "whether the camera turns, by its images alone, as gyroscope and poses say through the extrinsics that are given",
    threshold: "wrong where the rotation is off by more than 3 degrees beyond its 95 % interval, look above 1 degree; unknown where turn rates correlate below 0.9 or the interval is wider than 3 degrees",
    source: "Tsai and Lenz 1989, rotation part; interval by parts of the recording",
};

/// Angles beyond the interval, radians.
const LOOK_RAD: f64 = 1.0 * std::f64::consts::PI / 180.0;
const WRONG_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// An interval wider than this to either side tells nothing, radians.
const WIDEST_RAD: f64 = 3.0 * std::f64::consts::PI / 180.0;
/// Fewer turns say nothing.
const FEWEST: usize = 16;
/// A correlation below this is not believed.
const CORRELATION: f64 = 0.9;
/// Slower turns tell nothing, rad/s RMS.
const QUIET_RAD_S: f64 = 0.02;
/// Turns about other axes than the main one must make up this share, or the angle about that one is not known.
const SECOND_AXIS: f64 = 0.02;
/// Rounds of counting outliers less.
const ROUNDS: usize = 15;
/// Parts of the recording that are held against each other.
const PARTS: (usize, usize) = (4, 24);
const TURNS_A_PART: usize = 5;

/// The rotation of a camera against the one that is given.
#[derive(Clone, Debug, PartialEq)]
pub struct HandEye {
    /// Takes directions of the true camera to those of the camera as the extrinsics have it: `body_from_camera` times this
    /// is what the images say.
    pub given_from_true: UnitQuaternion<f64>,
    /// Half of the 95 % interval about the axis that is known least, radians; but for the axis that is not known at all.
    pub half_95_rad: f64,
    /// By how much it is off beyond the interval, radians.
    pub beyond_rad: f64,
    /// The only axis about which the camera turns, in the frame of the given camera: the angle about it is not known, and
    /// none in the result.
    pub only_axis: Option<Vector3<f64>>,
    /// Correlation of the turn rates through the extrinsics as given, and with this rotation.
    pub correlation: [f64; 2],
    /// Turns compared.
    pub count: usize,
}

/// Why the rotation is not known.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HandEyeDoubt {
    /// There is little to compare.
    #[error("the images give {count} turns to compare, {FEWEST} are needed")]
    Few {
        /// Turns that both have.
        count: usize,
    },
    /// The body hardly turns.
    #[error("the camera turns too slowly: {rad_s:.4} rad/s, {QUIET_RAD_S} is needed")]
    Quiet {
        /// RMS turn rate, rad/s.
        rad_s: f64,
    },
    /// No rotation makes the turns alike.
    #[error(
        "too uncertain: by no rotation do the turns of the images correlate with more than {correlation:.3}, {CORRELATION} is needed"
    )]
    Unlike {
        /// The best correlation.
        correlation: f64,
    },
    /// The interval is too wide.
    #[error("too uncertain: the rotation is known within {:.1} degrees only", half_95_rad.to_degrees())]
    Wide {
        /// Half of the interval, radians.
        half_95_rad: f64,
    },
}

/// Compares the turns of a camera, by its images, with those that a source says through the extrinsics: `expected` is the
/// source as [`Turning::of_frame`] makes it the camera's. `lag_s` is added to the camera's stamps for the source's clock;
/// `biased`: whether the source is off by a constant rate, as gyroscopes are.
///
/// # Errors
/// [`HandEyeDoubt`] where it is not known, with the numbers.
pub fn hand_eye(
    expected: &Turning,
    camera: &Turning,
    lag_s: f64,
    biased: bool,
) -> Result<HandEye, HandEyeDoubt> {
    let pieces = Pieces::of(camera);
    let apart_s = camera.later_than(expected) + lag_s;
    let theirs = pieces.seen_by(expected, |t| t + apart_s);
    let rows: Vec<[Vector3<f64>; 2]> =
        pieces.rates.iter().zip(&theirs).filter_map(|(own, other)| Some([(*other)?, *own])).collect();
    if rows.len() < FEWEST {
        return Err(HandEyeDoubt::Few { count: rows.len() });
    }
    let fit = Fit::of(&rows, biased);
    let rad_s = fit.motion_rad_s();
    if rad_s < QUIET_RAD_S {
        return Err(HandEyeDoubt::Quiet { rad_s });
    }
    let correlation = [fit.correlation(&UnitQuaternion::identity()), fit.correlation(&fit.turn)];
    if correlation[1] < CORRELATION {
        return Err(HandEyeDoubt::Unlike { correlation: correlation[1] });
    }
    let (half_95_rad, beyond_rad) = fit.interval();
    if half_95_rad > WIDEST_RAD && beyond_rad < WRONG_RAD {
        return Err(HandEyeDoubt::Wide { half_95_rad });
    }
    Ok(HandEye {
        given_from_true: fit.turn,
        half_95_rad,
        beyond_rad,
        only_axis: fit.only_axis,
        correlation,
        count: rows.len(),
    })
}

/// Turn rates, weighted, and the rotation between them.
struct Fit {
    /// Expected and own rates without their means, and weights.
    rows: Vec<(Vector3<f64>, Vector3<f64>, f64)>,
    turn: UnitQuaternion<f64>,
    only_axis: Option<Vector3<f64>>,
}

impl Fit {
    fn of(rows: &[[Vector3<f64>; 2]], biased: bool) -> Self {
        let mut weights = vec![1.0; rows.len()];
        let mut fit = Self { rows: Vec::new(), turn: UnitQuaternion::identity(), only_axis: None };
        for _ in 0..ROUNDS {
            let total: f64 = weights.iter().sum();
            let mean = |k: usize| -> Vector3<f64> {
                match biased {
                    true => rows.iter().zip(&weights).map(|(r, w)| *w * r[k]).sum::<Vector3<f64>>() / total,
                    false => Vector3::zeros(),
                }
            };
            let means = [mean(0), mean(1)];
            fit.rows =
                rows.iter().zip(&weights).map(|(r, w)| (r[0] - means[0], r[1] - means[1], *w)).collect();
            fit.solve();
            let sizes: Vec<f64> = fit.rows.iter().map(|(a, b, _)| (a - fit.turn * b).norm()).collect();
            // Of a length in three directions the median is this many standard deviations.
            let sd = median(&mut sizes.clone()).unwrap_or(0.0) / 1.54 + 1e-12;
            weights = sizes.iter().map(|size| weight(size / sd)).collect();
        }
        fit
    }

    fn solve(&mut self) {
        let products = |left: usize, right: usize| -> Matrix3<f64> {
            let side = |row: &(Vector3<f64>, Vector3<f64>, f64), k: usize| if k == 0 { row.0 } else { row.1 };
            self.rows.iter().map(|row| row.2 * side(row, left) * side(row, right).transpose()).sum()
        };
        let best = best_rotation(&products(1, 0));
        if best.gap > 2.0 * SECOND_AXIS * best.trace {
            (self.turn, self.only_axis) = (best.rotation, None);
            return;
        }
        // One axis on either side: the shortest rotation that takes the one to the other.
        let main = |m: Matrix3<f64>| {
            let eigen = m.symmetric_eigen();
            eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned()
        };
        let (expected, own) = (main(products(0, 0)), main(products(1, 1)));
        let sign: f64 = self.rows.iter().map(|(a, b, w)| w * a.dot(&expected) * b.dot(&own)).sum();
        let own = if sign < 0.0 { -own } else { own };
        // Opposite axes: any rotation by half a turn across them.
        let across = || {
            let axis = expected.cross(&Vector3::ith(expected.iamin(), 1.0)).normalize();
            UnitQuaternion::from_scaled_axis(axis * std::f64::consts::PI)
        };
        self.turn = UnitQuaternion::rotation_between(&own, &expected).unwrap_or_else(across);
        self.only_axis = Some(expected);
    }

    fn motion_rad_s(&self) -> f64 {
        let total: f64 = self.rows.iter().map(|r| r.2).sum();
        let own: f64 = self.rows.iter().map(|r| r.2 * r.0.norm_squared()).sum();
        (own / total.max(1e-12)).sqrt()
    }

    fn correlation(&self, turn: &UnitQuaternion<f64>) -> f64 {
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b, w) in &self.rows {
            aa += w * a.norm_squared();
            bb += w * b.norm_squared();
            ab += w * a.dot(&(turn * b));
        }
        if aa * bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 }
    }

    /// Half of the 95 % interval where it is widest, and by how much no rotation at all lies beyond it, radians.
    fn interval(&self) -> (f64, f64) {
        let parts = (self.rows.len() / TURNS_A_PART).clamp(PARTS.0, PARTS.1);
        let mut normal = Matrix3::zeros();
        let mut pulls = vec![Vector3::zeros(); parts];
        for (i, (a, b, w)) in self.rows.iter().enumerate() {
            let turned = self.turn * b;
            normal += *w * (Matrix3::identity() * turned.norm_squared() - turned * turned.transpose());
            pulls[i * parts / self.rows.len()] += *w * turned.cross(a);
        }
        let Some(inverse) = normal.try_inverse() else { return (f64::INFINITY, 0.0) };
        let spread: Matrix3<f64> = pulls.iter().map(|p| p * p.transpose()).sum();
        let free = parts as f64 - 1.0;
        let covariance = inverse * spread * inverse * (parts as f64 / free);
        let t = quantile_975(free).unwrap_or(f64::INFINITY);
        let off = rotation_vector_rad(&self.turn);
        let known = match self.only_axis {
            Some(axis) => Matrix3::identity() - axis * axis.transpose(),
            None => Matrix3::identity(),
        };
        let eigen = (known * covariance * known).symmetric_eigen();
        let (mut widest, mut beyond) = (0.0_f64, 0.0);
        for k in 0..3 {
            let half = t * eigen.eigenvalues[k].max(0.0).sqrt();
            widest = widest.max(half);
            beyond += (off.dot(&eigen.eigenvectors.column(k)).abs() - half).max(0.0).powi(2);
        }
        (widest, beyond.sqrt())
    }
}

/// What a camera's rotation is compared with.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The camera.
    pub camera: &'a str,
    /// Gyroscope or pose stream.
    pub source: &'a str,
    /// Whether the source is known to be of the body: the IMU, or the data set's own ground truth.
    pub is_body: bool,
    /// The extrinsics that are given, as rotation `body_from_camera`.
    pub given: UnitQuaternion<f64>,
    /// Rotations `body_from_camera` of other cameras, with their names.
    pub others: &'a [(String, UnitQuaternion<f64>)],
}

/// The finding about the rotation of a camera in the body.
pub fn finding(subject: &Subject<'_>, found: &Result<HandEye, HandEyeDoubt>) -> Finding {
    let Subject { camera, source, given, .. } = *subject;
    let about = format!("{source} / {camera}");
    let found = match found {
        Ok(found) => found,
        Err(doubt) => return Finding::new(CHECK.name, about, State::Unknown, doubt.to_string()),
    };
    let angle = found.given_from_true.angle();
    let seen = given * found.given_from_true;
    let mut state = match found.beyond_rad {
        b if b > WRONG_RAD => State::Wrong,
        b if b > LOOK_RAD => State::Look,
        _ => State::Ok,
    };
    let cause = (state == State::Wrong).then(|| cause(subject, found, &seen)).flatten();
    // What an estimate calls the body need not be the body of the extrinsics.
    if state == State::Wrong && !subject.is_body && cause.is_none() {
        state = State::Look;
    }
    let other = subject.others.iter().find(|(_, other)| seen.angle_to(other) < WRONG_RAD);
    let other = match (state, &cause, other) {
        (State::Wrong, None, Some((name, _))) if found.only_axis.is_none() => {
            format!("; those of {name} would fit: see whether two cameras were exchanged")
        }
        _ => String::new(),
    };
    let degrees = short((1e2 * angle.to_degrees()).round() / 1e2);
    let part = match found.only_axis {
        Some(_) => " (the camera turns about one axis only: the angle about it is not known)",
        None => "",
    };
    let says = match (state, &cause) {
        (State::Ok, _) => {
            let within = (1e2 * (angle + found.half_95_rad).to_degrees()).ceil() / 1e2;
            format!(
                "{camera} turns as {source} does through its extrinsics, within {} degrees{part}",
                short(within)
            )
        }
        (_, Some((words, _))) => format!(
            "{camera} does not turn as {source} does through its extrinsics, {degrees} degrees off: {words}"
        ),
        _ => {
            format!(
                "by its images {camera} is turned by {degrees} degrees against its extrinsics, as {source} turns{part}{other}"
            )
        }
    };
    let finding = Finding::new(CHECK.name, about, state, says)
        .number("off", angle.to_degrees(), "degrees")
        .number("half-of-95%-interval", found.half_95_rad.to_degrees(), "degrees")
        .number("correlation-as-given", found.correlation[0], "")
        .number("correlation-then", found.correlation[1], "")
        .number("turns", found.count as f64, "");
    match (state, cause) {
        (State::Ok, _) => finding,
        (_, Some((_, mend))) => finding.mend(mend),
        _ if !subject.is_body => finding.mend(
            "see whether its poses are of another frame than the body of the extrinsics: `estimate-frame` FILE says where that lies",
        ),
        _ if found.only_axis.is_some() => {
            finding.mend("calibrate the extrinsics anew, or give right ones with `calibration`")
        }
        _ => {
            let m = seen.to_rotation_matrix();
            let rows: Vec<String> = (0..3)
                .map(|i| (0..3).map(|k| format!("{:.4}", m[(i, k)])).collect::<Vec<_>>().join(" "))
                .collect();
            finding.mend(format!(
                "calibrate the extrinsics anew; by the images the rotation of `body_from_camera` is [{}], which `calibration` takes",
                rows.join(", ")
            ))
        }
    }
}

/// The mistake that makes the extrinsics what they are, with what mends it.
fn cause(subject: &Subject<'_>, found: &HandEye, seen: &UnitQuaternion<f64>) -> Option<(String, String)> {
    let near = WRONG_RAD.max(found.half_95_rad);
    let is = |other: &UnitQuaternion<f64>| match found.only_axis {
        // Only where that axis is taken to is known.
        Some(axis) => {
            let own = found.given_from_true.inverse() * axis;
            (seen * own).angle(&(other * own)) < near && rotation_off(subject, other) > near
        }
        None => seen.angle_to(other) < near,
    };
    let calibration = |what: &str| format!("{what}, with `calibration`");
    if is(&subject.given.inverse()) {
        return Some((
            "they are the inverse of what they should be".to_string(),
            calibration("give body_from_camera, not camera_from_body"),
        ));
    }
    if is(&UnitQuaternion::identity()) {
        return Some(match subject.is_body {
            true => (
                format!("{} turns about the axes of the body itself", subject.camera),
                calibration("the rotation of body_from_camera is none: give it so"),
            ),
            false => (
                format!("the poses of {} are those of the camera", subject.source),
                format!("`estimate-as` camera for {}", subject.source),
            ),
        });
    }
    let optical = UnitQuaternion::from_basis_unchecked(&[-Vector3::y(), -Vector3::z(), Vector3::x()]);
    for (axes, words) in [
        (optical, "their camera looks along x, as links of robots do: z along the optical axis is asked for"),
        (optical.inverse(), "they were turned from a link's axes to those of an optical frame twice"),
    ] {
        if is(&(subject.given * axes)) {
            return Some((words.to_string(), calibration("give those of the optical frame (REP 103)")));
        }
    }
    None
}

/// Angle between a rotation and the one that is given, radians.
fn rotation_off(subject: &Subject<'_>, other: &UnitQuaternion<f64>) -> f64 {
    subject.given.angle_to(other)
}

#[cfg(test)]
#[path = "hand_eye_tests.rs"]
mod tests;
