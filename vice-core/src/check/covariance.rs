//! Whether the covariances that an estimator says of its poses are those of its errors.
//!
//! The normalised estimation error squared (NEES) of positions against the reference: error^T P^-1 error, which over many
//! runs is that of three squared normal numbers where P is right. The estimate is put on the reference at the first pose in
//! common, so that P is the sum of what is said of both poses, of what the first rotation leaves open at that distance, and
//! of a centimetre for the reference itself. It is hence too large rather than too small: who is called too sure is.
//!
//! Source: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and Navigation", 2001, 5.4.

use nalgebra::{Matrix3, Matrix6, Vector3};

use super::Check;
use crate::finding::{Finding, State, short};
use crate::frames::WorldFromBody;
use crate::statistics::median;
use crate::time::Span;
use crate::trajectory::{PoseCovariance, Trajectory};

/// What this check is.
pub const CHECK: Check = Check {
    name: "covariance",
    title: "what an estimator says of its own errors",
    looks_at: "covariances of positions in messages against the actual differences to the reference (NEES)",
    threshold: "look where errors are more than 3 times, or less than a tenth of what the covariances say; unknown where these say nothing (zero, one value for ever, 10^5 m² and more)",
    source: "Bar-Shalom, Li, Kirubarajan 2001, 5.4; the first pose in common is taken from the reference",
};

/// Errors by what is said of them, beyond which a person should look.
const TOO_SURE: f64 = 3.0;
const TOO_SHY: f64 = 0.1;
/// The reference itself, metres.
const REFERENCE_M: f64 = 0.01;
/// Variances from here on are a way to say "not known", m².
const NOT_KNOWN_M2: f64 = 1e5;
/// Fewer poses say nothing.
const FEWEST: usize = 20;
/// The median and the 95th percentile of the sum of three squared normal numbers.
const CHI2_3: [f64; 2] = [2.365_97, 7.814_73];

/// The finding about the covariances of an estimate. `offset`: what is added to the estimate's stamps first.
pub fn covariance(
    reference: (&str, &Trajectory),
    estimate: (&str, &Trajectory),
    said: &[PoseCovariance],
    offset: Span,
    max_gap: Span,
) -> Finding {
    let about = format!("{} / {}", reference.0, estimate.0);
    let unknown = |says: String| Finding::new(CHECK.name, &about, State::Unknown, says);
    if let Some(nothing) = says_nothing(said) {
        return unknown(format!("covariances of {} {nothing}", estimate.0));
    }
    let rows: Vec<Row> = said
        .iter()
        .filter_map(|said| {
            let at = said.stamp.saturating_add(offset);
            let truth = reference.1.pose_at(at, max_gap).ok()?;
            let pose = estimate.1.pose_at(said.stamp, Span::from_millis(1)).ok()?;
            Some(Row { truth, pose, said: said.matrix })
        })
        .collect();
    let Some((first, rest)) = rows.split_first() else {
        return unknown(format!("no pose of {} with a covariance has one of {}", estimate.0, reference.0));
    };
    let mut nees: Vec<f64> = rest.iter().filter_map(|row| row.nees(first)).collect();
    if nees.len() < FEWEST {
        let says = format!("{} poses with covariances can be compared, {FEWEST} are needed", nees.len());
        return unknown(says);
    }
    let count = nees.len() as f64;
    let outside = nees.iter().filter(|n| **n > CHI2_3[1]).count() as f64 / count;
    let times = (median(&mut nees).unwrap_or(f64::NAN) / CHI2_3[0]).sqrt();
    let state = if (TOO_SHY..=TOO_SURE).contains(&times) { State::Ok } else { State::Look };
    let rounded = short((1e2 * times).round() / 1e2);
    let says = format!(
        "position errors of {} are {rounded} times what its covariances say; {:.0} % of the poses lie outside their 95 % region",
        estimate.0,
        100.0 * outside
    );
    let finding = Finding::new(CHECK.name, about, state, says)
        .number("error-by-said", times, "")
        .number("outside-95%-region", 100.0 * outside, "%")
        .number("poses", count, "");
    match state {
        State::Look if times > 1.0 => finding.mend(
            "the filter is too sure of itself: raise its process noise, and see whether clock and extrinsics are right; \
             do not weigh these poses by their covariances",
        ),
        State::Look => finding.mend("the filter is far too careful: its covariances are no weights"),
        _ => finding,
    }
}

/// Why covariances say nothing at all.
fn says_nothing(said: &[PoseCovariance]) -> Option<&'static str> {
    let first = of_position(&said.first()?.matrix);
    let variances = || said.iter().flat_map(|c| (0..3).map(|axis| c.matrix[(axis, axis)]));
    if variances().all(|v| v == 0.0) {
        return Some("are all zero: they say nothing");
    }
    if said.len() > 1 && said.iter().all(|c| of_position(&c.matrix) == first) {
        return Some("have one value for ever: they say nothing");
    }
    variances().any(|v| !(0.0..NOT_KNOWN_M2).contains(&v)).then_some(
        "hold variances that are negative, or 10^5 m² and more, which is a way to say that nothing is known",
    )
}

fn of_position(matrix: &Matrix6<f64>) -> Matrix3<f64> {
    matrix.fixed_view::<3, 3>(0, 0).into_owned()
}

struct Row {
    truth: WorldFromBody,
    pose: WorldFromBody,
    said: Matrix6<f64>,
}

impl Row {
    /// In the world of the estimate, which its covariances are of.
    fn nees(&self, first: &Self) -> Option<f64> {
        let own_from_truth = first.pose * first.truth.inverse();
        let error = self.pose.translation() - (own_from_truth * self.truth).translation();
        let way: Vector3<f64> = self.pose.translation() - first.pose.translation();
        let cross = way.cross_matrix();
        let turned: Matrix3<f64> = cross * first.said.fixed_view::<3, 3>(3, 3) * cross.transpose();
        let sum = of_position(&self.said)
            + of_position(&first.said)
            + turned
            + Matrix3::identity() * REFERENCE_M.powi(2);
        let symmetric = 0.5 * (sum + sum.transpose());
        Some(error.dot(&symmetric.cholesky()?.solve(&error)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use crate::random::SplitMix;
    use crate::time::Stamp;
    use nalgebra::UnitQuaternion;

    /// A random walk in x, y and z beside a circle, whose covariance is said `scale` times too large.
    fn said(scale: f64, world: UnitQuaternion<f64>) -> Finding {
        let (mut random, mut off) = (SplitMix::new(7), Vector3::zeros());
        let step_sd = Vector3::new(0.02, 0.02, 0.01);
        let (mut truth, mut own, mut covariances) = (Vec::new(), Vec::new(), Vec::new());
        let mut variance = Vector3::zeros();
        for i in 0..400 {
            let (stamp, t) =
                (Stamp::from_nanos(1_000_000_000 + i64::from(i) * 100_000_000), f64::from(i) * 0.1);
            let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3 * t);
            let at = Vector3::new(5.0 * (0.3 * t).cos(), 5.0 * (0.3 * t).sin(), 1.0);
            if i > 0 {
                off += step_sd.map(|sd| sd * random.normal());
                variance += step_sd.map(|sd| sd * sd);
            }
            let pose: WorldFromBody = Rigid::from_parts(at, turn);
            truth.push((stamp, pose));
            own.push((stamp, Rigid::from_parts(world * at + off, world * turn)));
            let mut matrix = Matrix6::zeros();
            for k in 0..3 {
                matrix[(k, k)] = scale * scale * variance[k];
            }
            covariances.push(PoseCovariance { stamp, matrix });
        }
        let (truth, own) = (Trajectory::from_poses(truth).unwrap(), Trajectory::from_poses(own).unwrap());
        covariance(("truth", &truth), ("odom", &own), &covariances, Span::ZERO, Span::from_millis(200))
    }

    fn times(finding: &Finding) -> f64 {
        finding.numbers.iter().find(|n| n.name == "error-by-said").unwrap().value
    }

    #[test]
    fn covariances_that_are_right_are_ok_in_any_world() {
        for world in [UnitQuaternion::identity(), UnitQuaternion::from_euler_angles(0.1, 0.2, 2.0)] {
            let found = said(1.0, world);
            assert!(found.state == State::Ok && (0.4..2.5).contains(&times(&found)), "{found:?}");
        }
    }

    #[test]
    fn too_sure_and_too_shy_are_told() {
        let sure = said(0.1, UnitQuaternion::identity());
        assert!(sure.state == State::Look && times(&sure) > 3.0, "{sure:?}");
        let shy = said(60.0, UnitQuaternion::identity());
        assert!(shy.state == State::Look && times(&shy) < 0.1, "{shy:?}");
    }

    #[test]
    fn what_says_nothing_is_unknown() {
        let stamps = (0..30).map(|i| Stamp::from_nanos(1_000_000_000 + i * 100_000_000));
        let all = |value: f64| {
            let matrix = Matrix6::identity() * value;
            stamps.clone().map(|stamp| PoseCovariance { stamp, matrix }).collect::<Vec<_>>()
        };
        for (value, word) in [(0.0, "all zero"), (0.1, "for ever"), (-1.0, "for ever")] {
            assert!(says_nothing(&all(value)).unwrap().contains(word), "{value}");
        }
        let mut last = all(0.1);
        last[29].matrix *= 1e9;
        assert!(says_nothing(&last).unwrap().contains("nothing is known"));
    }
}
