//! Whether many points moved from one frame to another as one rigid scene does, from the images alone.
//!
//! No pose is asked. Two views of a rigid scene have one turn and one direction of motion, so that each point stays on
//! its epipolar line: that is fitted robustly to all points together, and points that do not follow it are named. What a
//! camera sees that only turns has no such line; there the turn alone says where each point must be, and so does a plane.
//!
//! Five points fix the motion (H. Lui and T. Drummond, "An iterative 5-pt algorithm for fast and robust essential matrix
//! estimation", 2013: Gauss and Newton's method from a guess, where others solve polynomials). Draws repeat.
//!
//! What this cannot see: an error along the epipolar line, and things that move in the scene where most points are on
//! them.

mod follow;
mod general;
mod plane;
mod turn;
mod turned;

use nalgebra::{Rotation3, Vector3};
use vice_core::camera::{Camera, Pixel};
use vice_core::random::SplitMix;
use vice_core::statistics::median;

use general::Motion;

pub use follow::{between, followed};
pub use turned::{Turned, turned};

/// With fewer points in both frames nothing is said: five fix the motion, and the others have to outvote it.
pub const MIN_POINTS: usize = 12;
/// Draws of five points each: with 40 % of wrong points one of them is all right in 99.97 % of the cases.
const DRAWS: usize = 100;
/// Draws of four points each for a plane.
const PLANE_DRAWS: usize = 60;
/// What is further off than this while the motion is looked for counts as this much, pixels.
const SEARCH_PX: f64 = 1.5;
/// Points further off than so many standard deviations do not follow.
const SIGMAS: f64 = 3.5;
/// And never such that are nearer, nor are such that are further off ever taken, pixels.
const LIMITS_PX: [f64; 2] = [0.8, 2.0];
/// So few points can be explained by a direction of motion that is chosen for them.
const FREE_POINTS: usize = 3;
/// And of wrong ones up to this share.
const CHANCE: f64 = 0.6;

/// A place in the image as a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Direction in the camera frame, of length one.
    pub(crate) ray: Vector3<f64>,
    /// How many pixels a radian is there.
    pub(crate) px_per_rad: f64,
}

impl Sight {
    /// The direction of a pixel; none where the lens model does not reach.
    pub fn new(camera: &Camera, px: Pixel) -> Option<Self> {
        let ray = |px: Pixel| camera.unproject(px).ok().map(|r| r.normalize());
        let here = ray(px)?;
        let right = ray(Pixel::new(px.u + 0.5, px.v))?.cross(&ray(Pixel::new(px.u - 0.5, px.v))?).norm();
        let down = ray(Pixel::new(px.u, px.v + 0.5))?.cross(&ray(Pixel::new(px.u, px.v - 0.5))?).norm();
        let px_per_rad = 1.0 / (right * down).sqrt();
        px_per_rad.is_finite().then_some(Self { ray: here, px_per_rad })
    }
}

/// A point in two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// In the one.
    pub from: Sight,
    /// In the other.
    pub to: Sight,
}

impl Pair {
    /// Pixels of a radian, between both frames.
    fn px_per_rad(&self) -> f64 {
        (self.from.px_per_rad * self.to.px_per_rad).sqrt()
    }
}

/// What moved the points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// The camera turned on its place, or as good as that.
    Turn,
    /// It moved, and what it sees is flat.
    Plane,
    /// It moved.
    General,
}

/// How well points follow one motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Agreement {
    /// Which motion.
    pub moved: Moved,
    /// How far each point is off it, pixels: from its place for a turn or a plane, else from its epipolar line.
    pub off_px: Vec<f64>,
    /// Points further off do not follow.
    pub limit_px: f64,
}

impl Agreement {
    /// Share of the points that follow.
    pub fn share(&self) -> f64 {
        let follow = self.off_px.iter().filter(|off| **off <= self.limit_px).count();
        follow as f64 / self.off_px.len().max(1) as f64
    }

    fn follows(&self, point: usize) -> bool {
        self.off_px[point] <= self.limit_px
    }

    /// How many do not follow.
    fn left_over(&self) -> usize {
        self.off_px.iter().filter(|off| **off > self.limit_px).count()
    }

    /// Whether this stands against a more general motion: at least half of the points follow it, and of the others the
    /// general one explains few.
    fn stands(&self, general: &Self) -> bool {
        let left: Vec<usize> = (0..self.off_px.len()).filter(|i| !self.follows(*i)).collect();
        let explained = left.iter().filter(|i| general.follows(**i)).count();
        let few = explained <= FREE_POINTS || (explained as f64) < CHANCE * left.len() as f64;
        2 * left.len() <= self.off_px.len() && few
    }
}

/// How well points follow one motion between two frames; `None` for fewer than [`MIN_POINTS`]. The same for equal
/// points and seed.
///
/// A turn, and a plane, say where a point has to be; a motion among things of any depth only on which line. So the
/// simplest one counts that leaves nothing over, or of which a more general one explains no more of what it leaves over
/// than happens to lie near some lines.
pub fn agreement(pairs: &[Pair], seed: u64) -> Option<Agreement> {
    if pairs.len() < MIN_POINTS {
        return None;
    }
    let turn = turn::fit(pairs);
    let turned = judge(Moved::Turn, pairs.iter().map(|p| turn::off_px(&turn, p)).collect());
    if turned.left_over() <= FREE_POINTS {
        return Some(turned);
    }
    let mut random = SplitMix::new(seed);
    let plane = plane(pairs, &mut random);
    let plane = plane.map(|h| judge(Moved::Plane, pairs.iter().map(|p| plane::off_px(&h, p)).collect()));
    if let Some(plane) = plane.as_ref().filter(|p| p.left_over() <= FREE_POINTS && !turned.stands(p)) {
        return Some(plane.clone());
    }
    let motion = motion(pairs, turn, &mut random)?;
    let general = judge(Moved::General, pairs.iter().map(|p| general::off_px(&motion, p)).collect());
    if turned.stands(&general) && plane.as_ref().is_none_or(|p| turned.stands(p)) {
        return Some(turned);
    }
    match plane {
        Some(plane) if plane.stands(&general) => Some(plane),
        _ => Some(general),
    }
}

/// The plane that most points are on, if any.
fn plane(pairs: &[Pair], random: &mut SplitMix) -> Option<plane::Homography> {
    let mut best: Option<(f64, plane::Homography)> = None;
    for _ in 0..PLANE_DRAWS {
        let four: [Pair; 4] = draw(pairs, random);
        let Some(found) = plane::through(&four, &[1.0; 4]) else { continue };
        let cost = plane::cost(pairs, &found, SEARCH_PX);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, found));
        }
    }
    best.map(|(_, plane)| plane::refined(pairs, plane, SEARCH_PX))
}

/// The motion that most points follow, if any.
fn motion(pairs: &[Pair], turn: Rotation3<f64>, random: &mut SplitMix) -> Option<Motion> {
    let mut best: Option<(f64, Motion)> = None;
    for _ in 0..DRAWS {
        let five: [Pair; 5] = draw(pairs, random);
        let start = Motion { turn, along: random_direction(random) };
        let Some(motion) = general::through(&five, start) else { continue };
        let cost = general::cost(pairs, &motion, SEARCH_PX);
        if best.as_ref().is_none_or(|(least, _)| cost < *least) {
            best = Some((cost, motion));
        }
    }
    best.map(|(_, motion)| general::refined(pairs, motion, SEARCH_PX))
}

fn judge(moved: Moved, off_px: Vec<f64>) -> Agreement {
    let limit_px = limit(&off_px);
    Agreement { moved, off_px, limit_px }
}

/// What is too far off, by how far the better half is.
fn limit(off_px: &[f64]) -> f64 {
    (SIGMAS * 1.4826 * median_of(off_px)).clamp(LIMITS_PX[0], LIMITS_PX[1])
}

fn median_of(values: &[f64]) -> f64 {
    median(&mut values.to_vec()).unwrap_or(f64::INFINITY)
}

/// Different ones.
fn draw<const N: usize>(pairs: &[Pair], random: &mut SplitMix) -> [Pair; N] {
    let mut taken = [usize::MAX; N];
    for i in 0..N {
        loop {
            let next = random.below(pairs.len() as u64) as usize;
            if !taken[..i].contains(&next) {
                taken[i] = next;
                break;
            }
        }
    }
    taken.map(|i| pairs[i])
}

fn random_direction(random: &mut SplitMix) -> Vector3<f64> {
    loop {
        let v = Vector3::new(random.normal(), random.normal(), random.normal());
        if v.norm() > 1e-3 {
            return v.normalize();
        }
    }
}

#[cfg(test)]
mod tests;
