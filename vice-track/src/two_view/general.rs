//! A turn and a direction of motion, and how far points are off their epipolar lines.

use nalgebra::{Matrix5, Rotation3, Vector3, Vector5};

use super::Pair;

/// Rounds through five points, and over all.
const FEW_ROUNDS: usize = 8;
const ALL_ROUNDS: usize = 15;
/// What keeps the normal equations solvable where the direction of motion says nothing, share of their trace.
const DAMPING: f64 = 1e-7;
/// The longest step, radians.
const LONGEST_STEP: f64 = 0.5;

/// How a camera moved: `to ~ turn · from + along / depth`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    pub(super) turn: Rotation3<f64>,
    /// Of length one.
    pub(super) along: Vector3<f64>,
}

/// How far off a point is (radians, signed, to first order the angle between where it is and the nearest places that
/// satisfy its epipolar line) and how that changes with the turn (from the left) and the direction of motion.
fn mismatch(motion: &Motion, pair: &Pair) -> (f64, Vector3<f64>, Vector3<f64>) {
    let (x, y) = (motion.turn * pair.from.ray, pair.to.ray);
    let t = motion.along;
    let off = y.dot(&t.cross(&x));
    // How it changes with either direction, across the direction itself.
    let to_gradient = t.cross(&x);
    let from_gradient = y.cross(&t);
    let across =
        |gradient: Vector3<f64>, ray: &Vector3<f64>| gradient.norm_squared() - gradient.dot(ray).powi(2);
    let length = (across(to_gradient, &y) + across(from_gradient, &x)).max(1e-12).sqrt();
    (off / length, x.cross(&y.cross(&t)) / length, x.cross(&y) / length)
}

/// Distance from the epipolar line, pixels.
pub(super) fn off_px(motion: &Motion, pair: &Pair) -> f64 {
    mismatch(motion, pair).0.abs() * pair.px_per_rad()
}

/// Sum of squared distances, each at most `most_px`.
pub(super) fn cost(pairs: &[Pair], motion: &Motion, most_px: f64) -> f64 {
    pairs.iter().map(|p| off_px(motion, p).min(most_px).powi(2)).sum()
}

/// The motion that five points fix, near a start; `None` where none was reached.
pub(super) fn through(five: &[Pair; 5], start: Motion) -> Option<Motion> {
    let mut motion = start;
    for _ in 0..FEW_ROUNDS {
        motion = step(five, &motion, |_| 1.0)?;
    }
    Some(motion)
}

/// The motion that most points follow, near a start: those further off than `half_px` count less and less.
pub(super) fn refined(pairs: &[Pair], start: Motion, half_px: f64) -> Motion {
    let mut best = (cost(pairs, &start, half_px), start);
    let mut motion = start;
    for _ in 0..ALL_ROUNDS {
        let weight = |off_px: f64| 1.0 / (1.0 + (off_px / half_px).powi(2)).powi(2);
        let Some(next) = step(pairs, &motion, weight) else { break };
        motion = next;
        let now = cost(pairs, &motion, half_px);
        if now < best.0 {
            best = (now, motion);
        }
    }
    best.1
}

/// How far off a point is changes by this with a turn from the left (three numbers) and with the direction of motion (two
/// directions across it).
pub(super) fn row(motion: &Motion, pair: &Pair) -> Vector5<f64> {
    let [one, two] = across(&motion.along);
    let (_, by_turn, by_along) = mismatch(motion, pair);
    five(&by_turn, &by_along, [&one, &two])
}

fn five(by_turn: &Vector3<f64>, by_along: &Vector3<f64>, [one, two]: [&Vector3<f64>; 2]) -> Vector5<f64> {
    Vector5::new(by_turn.x, by_turn.y, by_turn.z, by_along.dot(one), by_along.dot(two))
}

/// One step of Gauss and Newton's method.
fn step(pairs: &[Pair], motion: &Motion, weight: impl Fn(f64) -> f64) -> Option<Motion> {
    let [one, two] = across(&motion.along);
    let mut normal = Matrix5::<f64>::zeros();
    let mut right = Vector5::<f64>::zeros();
    for pair in pairs {
        let (off, by_turn, by_along) = mismatch(motion, pair);
        let row = five(&by_turn, &by_along, [&one, &two]);
        let w = weight(off.abs() * pair.px_per_rad());
        normal += row * row.transpose() * w;
        right += row * (off * w);
    }
    let damping = normal.trace() * DAMPING;
    for i in 0..5 {
        normal[(i, i)] += damping;
    }
    let mut delta = -normal.cholesky()?.solve(&right);
    let length = delta.norm();
    if !length.is_finite() {
        return None;
    }
    if length > LONGEST_STEP {
        delta *= LONGEST_STEP / length;
    }
    let turn = Rotation3::new(Vector3::new(delta[0], delta[1], delta[2])) * motion.turn;
    let along = (motion.along + one * delta[3] + two * delta[4]).normalize();
    Some(Motion { turn, along })
}

/// Two directions across another one.
fn across(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let axis = match direction.iamin() {
        0 => Vector3::x(),
        1 => Vector3::y(),
        _ => Vector3::z(),
    };
    let one = direction.cross(&axis).normalize();
    [one, direction.cross(&one)]
}
