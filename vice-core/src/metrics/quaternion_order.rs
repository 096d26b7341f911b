//! Quaternions that were written in another order than they were read in.
//!
//! Seen over long stretches, a reordered quaternion turns quite another way, while its motion from pose to pose may be
//! too small to tell. Turns are compared over a quarter of the run, which no alignment and no world frame changes.

use nalgebra::{Quaternion, UnitQuaternion};

use crate::frames::{WorldFromBody, rotation_angle_rad};
use crate::metrics::associate::PosePairs;
use crate::suspicion::Suspicion;

/// Turns this far off need an explanation, radians.
const OFF_RAD: f64 = 0.2;
/// Another order must leave at most this share of the error.
const SHARE: f64 = 0.2;
/// Fewer poses say nothing.
const FEWEST: usize = 8;
/// Pairs that are looked at, at most.
const MOST: usize = 400;

/// Says so where the rotations of an estimate fit those of the reference far better in another order of the quaternion.
pub fn suspicion(pairs: &PosePairs, about: &str) -> Option<Suspicion> {
    let as_read = error_rad(pairs, |q| q)?;
    if as_read < OFF_RAD {
        return None;
    }
    let orders: [(&str, &str, Reorder); 2] = [
        // What was read as x y z w stands in the file as w x y z.
        ("w x y z", "wxyz", |q| from_wxyz(q.i, q.j, q.k, q.w)),
        ("x y z w", "xyzw", |q| from_wxyz(q.k, q.w, q.i, q.j)),
    ];
    let tried = orders.into_iter().filter_map(|(order, word, f)| Some((order, word, error_rad(pairs, f)?)));
    let (order, word, cured) = tried.min_by(|a, b| a.2.total_cmp(&b.2))?;
    (cured < OFF_RAD && cured < SHARE * as_read).then(|| {
        let message = format!("the rotations fit far better with quaternions in the order {order}");
        Suspicion::new("quaternion-order", about, message)
            .evidence(format!("turns are off by {cured:.4} rad instead of {as_read:.4} rad"))
            .advice(format!("--estimate-as {word}, or name the columns in a heading of the file"))
    })
}

type Reorder = fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>;

fn from_wxyz(w: f64, x: f64, y: f64, z: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// RMS angle between the turns of both streams over a quarter of the run.
fn error_rad(pairs: &PosePairs, read: impl Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>) -> Option<f64> {
    let (n, stretch) = (pairs.len(), pairs.len() / 4);
    if n < FEWEST {
        return None;
    }
    let every = (n - stretch).div_ceil(MOST);
    let turn = |poses: &[WorldFromBody], i: usize, f: &dyn Fn(UnitQuaternion<f64>) -> UnitQuaternion<f64>| {
        f(poses[i].rotation()).inverse() * f(poses[i + stretch].rotation())
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for i in (0..n - stretch).step_by(every) {
        let (of_reference, of_estimate) =
            (turn(pairs.reference(), i, &|q| q), turn(pairs.estimate(), i, &read));
        sum += rotation_angle_rad(&(of_reference.inverse() * of_estimate)).powi(2);
        count += 1.0;
    }
    Some(f64::sqrt(sum / count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Rigid;
    use crate::time::Stamp;
    use nalgebra::Vector3;

    fn said(turns_rad: f64, misread: Reorder) -> Option<String> {
        let rows = (0..60).map(|i| {
            let t = f64::from(i) / 60.0;
            let turn = UnitQuaternion::from_euler_angles(0.2, 0.3 * t, turns_rad * t);
            let wobble = UnitQuaternion::from_euler_angles(0.001 * f64::from(i % 3), 0.0, 0.0);
            let other_world = UnitQuaternion::from_euler_angles(0.5, -1.0, 2.0);
            let pose = |q| -> WorldFromBody { Rigid::from_parts(Vector3::new(t, 0.0, 0.0), q) };
            (Stamp::from_nanos(i64::from(i)), pose(turn), pose(misread(other_world * turn * wobble)))
        });
        suspicion(&PosePairs::new(rows).unwrap(), "est").map(|s| s.line())
    }

    #[test]
    fn another_order_is_noticed_in_any_world() {
        // A file in w x y z that was read as x y z w, and the other way round.
        let w_first = said(2.0, |q| from_wxyz(q.k, q.w, q.i, q.j)).unwrap();
        assert!(
            w_first.contains("in the order w x y z") && w_first.contains("--estimate-as wxyz"),
            "{w_first}"
        );
        let w_last = said(2.0, |q| from_wxyz(q.i, q.j, q.k, q.w)).unwrap();
        assert!(w_last.contains("in the order x y z w"), "{w_last}");
        assert!(said(1.0, |q| from_wxyz(q.k, q.w, q.i, q.j)).is_some(), "a slow turn");
    }

    #[test]
    fn what_fits_or_fits_no_better_is_not_suspected() {
        assert_eq!(said(2.0, |q| q), None);
        // Conjugated, or with a frozen rotation: wrong, but not by the order.
        assert_eq!(said(2.0, |q| q.inverse()), None);
        assert_eq!(said(2.0, |_| UnitQuaternion::identity()), None);
    }
}
