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
    let sd_rad = match found.moved {
        Moved::Turn => turn_sd_rad(&follow, &turn, turn_px)?,
        _ if before(&follow, &motion, general_px) < BEFORE => return None,
        _ => general_sd_rad(&follow, &motion, general_px)?,
    };
    Some(Turned {
        second_from_first: turn,
        sd_rad: sd_rad.hypot(LEAST_SD_RAD),
        moved: found.moved,
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
        let worse = if before(pairs, &motion, 0.3) < BEFORE { BEHIND } else { 1.0 };
        if best.as_ref().is_none_or(|(least, _)| worse * cost < *least) {
            best = Some((worse * cost, motion));
        }
    }
    best.map(|(_, motion)| general::refined(pairs, motion, SEARCH_PX))
}

/// Share of the points with a parallax above the noise that lie on the more frequent side: the direction of motion has no
/// sign. 1 where there is no parallax.
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
    if one + other > 0.0 { f64::max(one, other) / (one + other) } else { 1.0 }
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
