//! How the camera turned between two frames, from points alone, and how sure that is.

use nalgebra::{Matrix3, Matrix5, Rotation3, Vector3};
use vice_core::random::SplitMix;

use super::general::{self, Motion};
use super::{DRAWS, Moved, Pair, SEARCH_PX, draw, judge, median_of, random_direction, turn};

/// With fewer points a turn is not worth measuring.
const FEWEST: usize = 20;
/// A turn on the spot is believed up to this many times the noise that a moving camera leaves: that of a point counts in
/// two directions there, and in half of one here.
const AS_GOOD: f64 = 1.7;
/// ... and up to this, pixels.
const TURN_PX: f64 = 0.6;
/// Parallax above so many standard deviations tells before and behind.
const SIGMAS: f64 = 3.0;
/// This share of such points must lie on one side.
const BEFORE: f64 = 0.85;
/// A motion that puts points before and behind counts as this much worse.
const BEHIND: f64 = 2.0;
/// Points that do not follow, at most this share.
const ASTRAY: f64 = 0.4;
/// What lens and tracker leave even with many points, radians.
const LEAST_SD_RAD: f64 = 2e-4;

/// How a camera turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turned {
    /// Takes directions of the first frame's camera to those of the second's.
    pub second_from_first: Rotation3<f64>,
    /// Standard deviation about the axis that is known least, radians: by how much points are off, and how far turning
    /// can be told from moving. Not in it: that a flat scene may have two turns.
    pub sd_rad: f64,
    /// [`Moved::Turn`] or [`Moved::General`].
    pub moved: Moved,
    /// Where it moved, of length one: a point of the first frame is seen at `turn * point + along * some length` in the
    /// second. `None` where it only turned.
    pub along: Option<Vector3<f64>>,
    /// Points that follow.
    pub follow: usize,
}

/// The turn that most points follow; `None` for fewer than 20, where many do not follow, or lie before the camera and
/// behind it. The same for equal points and seed.
pub fn turned(pairs: &[Pair], seed: u64) -> Option<Turned> {
    if pairs.len() < FEWEST {
        return None;
    }
    let start = turn::fit(pairs);
    let on_the_spot = judge(Moved::Turn, pairs.iter().map(|p| turn::off_px(&start, p)).collect());
    // Of a length in two directions the median is this many standard deviations.
    let turn_px = median_of(&on_the_spot.off_px) / 1.1774;
    let motion = motion(pairs, start, &mut SplitMix::new(seed))?;
    let general = judge(Moved::General, pairs.iter().map(|p| general::off_px(&motion, p)).collect());
    let general_px = 1.4826 * median_of(&general.off_px);
    let stands = turn_px < TURN_PX.min(AS_GOOD * general_px)
        && on_the_spot.left_over() as f64 <= ASTRAY * pairs.len() as f64;
    let (found, turn) = if stands { (on_the_spot, start) } else { (general, motion.turn) };
    let follow: Vec<Pair> = (0..pairs.len()).filter(|i| found.follows(*i)).map(|i| pairs[i]).collect();
    if follow.len() < FEWEST || found.left_over() as f64 > ASTRAY * pairs.len() as f64 {
        return None;
    }
    let (sd_rad, along) = match found.moved {
        Moved::Turn => (turn_sd_rad(&follow, &turn, turn_px)?, None),
        _ => {
            let before = before(&follow, &motion, general_px);
            if before.abs() < BEFORE {
                return None;
            }
            (general_sd_rad(&follow, &motion, general_px)?, Some(motion.along * before.signum()))
        }
    };
    Some(Turned {
        second_from_first: turn,
        sd_rad: sd_rad.hypot(LEAST_SD_RAD),
        moved: found.moved,
        along,
        follow: follow.len(),
    })
}

/// The motion that most points follow and that puts them before the camera.
fn motion(pairs: &[Pair], turn: Rotation3<f64>, random: &mut SplitMix) -> Option<Motion> {
    let mut best: Option<(f64, Motion)> = None;
    for _ in 0..DRAWS {
        let five: [Pair; 5] = draw(pairs, random);
        let start = Motion { turn, along: random_direction(random) };
        let Some(motion) = general::through(&five, start) else { continue };
        let cost = general::cost(pairs, &motion, SEARCH_PX);
        if best.as_ref().is_some_and(|(least, _)| cost >= *least) {
            continue;
        }
        let worse = if before(pairs, &motion, 0.3).abs() < BEFORE { BEHIND } else { 1.0 };
        if best.as_ref().is_none_or(|(least, _)| worse * cost < *least) {
            best = Some((worse * cost, motion));
        }
    }
    best.map(|(_, motion)| general::refined(pairs, motion, SEARCH_PX))
}

/// Share of the points with a parallax above the noise that lie on the more frequent side of the camera: negative where
/// that is behind, so that the motion is to be turned round. 1 where there is no parallax.
fn before(pairs: &[Pair], motion: &Motion, noise_px: f64) -> f64 {
    let (mut one, mut other) = (0.0, 0.0);
    for pair in pairs {
        let turned = motion.turn * pair.from.ray;
        let along = motion.along - turned * turned.dot(&motion.along);
        let parallax = pair.to.ray - turned;
        if parallax.norm() * pair.px_per_rad() < SIGMAS * noise_px {
            continue;
        }
        if parallax.dot(&along) > 0.0 { one += 1.0 } else { other += 1.0 }
    }
    match one + other {
        all if all > 0.0 && one >= other => one / all,
        all if all > 0.0 => -other / all,
        _ => 1.0,
    }
}

fn turn_sd_rad(pairs: &[Pair], turn: &Rotation3<f64>, noise_px: f64) -> Option<f64> {
    let normal: Matrix3<f64> = pairs
        .iter()
        .map(|p| {
            let ray: Vector3<f64> = turn * p.from.ray;
            (Matrix3::identity() - ray * ray.transpose()) * (p.px_per_rad() / noise_px.max(1e-3)).powi(2)
        })
        .sum();
    largest_sd(&normal.try_inverse()?)
}

fn general_sd_rad(pairs: &[Pair], motion: &Motion, noise_px: f64) -> Option<f64> {
    let normal: Matrix5<f64> = pairs
        .iter()
        .map(|p| {
            let row = general::row(motion, p) * (p.px_per_rad() / noise_px.max(1e-3));
            row * row.transpose()
        })
        .sum();
    // Where the direction of motion says nothing it does not matter either.
    let ridge = normal.trace() * 1e-9;
    let covariance = (normal + Matrix5::identity() * ridge).try_inverse()?;
    largest_sd(&covariance.fixed_view::<3, 3>(0, 0).into_owned())
}

fn largest_sd(covariance: &Matrix3<f64>) -> Option<f64> {
    let sd = covariance.symmetric_eigenvalues().max().max(0.0).sqrt();
    sd.is_finite().then_some(sd)
}

#[cfg(test)]
mod tests {
    use super::super::Sight;
    use super::*;

    /// Points of a room in two frames with noise in the second one, and some wrong ones.
    fn pairs(turn: Vector3<f64>, moved: Vector3<f64>, count: usize, seed: u64) -> Vec<Pair> {
        let mut random = SplitMix::new(seed);
        let turn = Rotation3::new(turn);
        let sight = |p: &Vector3<f64>| Sight { ray: p.normalize(), px_per_rad: 450.0 / p.normalize().z };
        (0..count)
            .map(|i| {
                let (x, y) = (random.uniform(-0.7, 0.7), random.uniform(-0.5, 0.5));
                let there = turn * (Vector3::new(x, y, 1.0) * random.uniform(1.0, 6.0)) + moved;
                let size = if i % 9 == 4 { 8.0 } else { 0.15 };
                let noise = Vector3::new(random.normal(), random.normal(), 0.0) * (size / 450.0);
                Pair { from: sight(&Vector3::new(x, y, 1.0)), to: sight(&(there / there.z + noise)) }
            })
            .collect()
    }

    #[test]
    fn turns_are_found_within_what_is_said_of_them() {
        let turn = Vector3::new(0.02, -0.05, 0.03);
        for (moved, kind) in [
            (Vector3::zeros(), Moved::Turn),
            (Vector3::new(0.1, 0.02, -0.05), Moved::General),
            (Vector3::new(0.0, 0.0, 0.2), Moved::General),
        ] {
            let mut inside = 0;
            for seed in 0..20 {
                let found = turned(&pairs(turn, moved, 150, seed), 7).unwrap();
                let off = (found.second_from_first * Rotation3::new(turn).inverse()).angle();
                // Three axes, each within its own standard deviation at most.
                inside += i32::from(off < 3.0 * found.sd_rad);
                assert!(found.sd_rad < 5e-3 && off < 8e-3, "{moved}: {off} {found:?}");
                assert_eq!(found.moved, kind, "{moved}: {found:?}");
                if let Some(along) = found.along {
                    assert!(along.angle(&moved) < 0.2, "{moved}: {along}");
                }
            }
            assert!(inside >= 17, "{moved}: {inside} of 20");
        }
    }

    #[test]
    fn what_does_not_move_as_one_is_not_measured() {
        let turn = Vector3::new(0.02, -0.05, 0.03);
        assert_eq!(turned(&pairs(turn, Vector3::zeros(), 19, 1), 7), None);
        let mut random = SplitMix::new(9);
        let mut chaos = pairs(turn, Vector3::zeros(), 100, 2);
        for pair in &mut chaos {
            let off = Vector3::new(random.normal(), random.normal(), 0.0) * 0.05;
            pair.to.ray = (pair.to.ray + off).normalize();
        }
        assert_eq!(turned(&chaos, 7), None);
    }
}
