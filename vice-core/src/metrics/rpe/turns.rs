//! Orientations in a tree of balls, so that those a given angle away are found without looking at all of them.
//!
//! The angle between two orientations is a distance (it keeps the triangle inequality): a ball whose centre is far
//! enough from the band of angles that is asked for is passed over, or taken, as a whole.

use std::f64::consts::PI;

use nalgebra::{UnitQuaternion, Vector4};

use crate::frames::rotation_angle_rad;

/// As many orientations are not divided further.
const LEAF: usize = 16;

/// What cosines are off by rounding at most, with a good deal to spare.
const MARGIN: f64 = 1e-12;

/// What is added to the radius of a ball for rounding, radians.
const SLACK_RAD: f64 = 1e-9;

pub(super) fn angle_between(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> f64 {
    rotation_angle_rad(&(a.inverse() * b))
}

/// The angles that are asked for, radians.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    lower: f64,
    upper: f64,
    /// Cosines of half the angle, which are a mere dot product: outside of these it is not in the band.
    least: f64,
    most: f64,
}

impl Band {
    /// All angles from `lower` to `upper`, radians.
    pub(super) fn new(lower: f64, upper: f64) -> Self {
        let most = (lower / 2.0).cos() + MARGIN;
        let least = (upper.min(PI) / 2.0).cos() - MARGIN;
        Self { lower, upper, least, most }
    }

    /// Whether two orientations are so far apart. What is within rounding of the bounds is decided by the angle itself.
    pub(super) fn holds(&self, a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>) -> bool {
        (self.least..=self.most).contains(&half_cosine(&a.coords, &b.coords))
            && (self.lower..=self.upper).contains(&angle_between(a, b))
    }
}

/// Cosine of half the angle between two orientations.
fn half_cosine(a: &Vector4<f64>, b: &Vector4<f64>) -> f64 {
    a.dot(b).abs()
}

/// Orientations close to each other, and what the cosine to their centre says of all of them.
#[derive(Debug)]
struct Ball {
    centre: Vector4<f64>,
    /// None is in the band below or above.
    none_below: f64,
    none_above: f64,
    /// All are in the band between.
    all_from: f64,
    all_to: f64,
    /// Where its members stand in the tree's order.
    start: usize,
    end: usize,
    /// The largest index among its members.
    latest: usize,
    /// The ball that follows when this one is done with; its first half comes right after itself.
    next: usize,
}

/// Orientations, each ball before the two halves that it is divided into.
#[derive(Debug)]
pub(super) struct Turns<'a> {
    rotations: &'a [UnitQuaternion<f64>],
    band: Band,
    order: Vec<usize>,
    balls: Vec<Ball>,
}

impl<'a> Turns<'a> {
    /// Sorts orientations for questions about one band: O(n log n).
    pub(super) fn new(rotations: &'a [UnitQuaternion<f64>], band: Band) -> Self {
        let mut turns = Self { rotations, band, order: Vec::new(), balls: Vec::new() };
        let mut keyed: Vec<(f64, usize)> = (0..rotations.len()).map(|i| (0.0, i)).collect();
        turns.grow(&mut keyed, 0);
        turns.order = keyed.into_iter().map(|(_, i)| i).collect();
        turns
    }

    /// Divides at half the number, so that the depth is the logarithm of it whatever the orientations are.
    fn grow(&mut self, members: &mut [(f64, usize)], start: usize) {
        let Some(&(_, first)) = members.first() else { return };
        let rotations = self.rotations;
        let first = rotations[first].coords;
        let sum = members.iter().fold(Vector4::zeros(), |sum: Vector4<f64>, (_, i)| {
            let q = rotations[*i].coords;
            if q.dot(&first) < 0.0 { sum - q } else { sum + q }
        });
        let centre = sum.try_normalize(0.5).unwrap_or(first);
        let far_from = |q: &Vector4<f64>, members: &[(f64, usize)]| {
            let cosines = members.iter().map(|(_, i)| (half_cosine(&rotations[*i].coords, q), *i));
            cosines.min_by(|a, b| a.0.total_cmp(&b.0)).map_or(first, |(_, i)| rotations[i].coords)
        };
        let far = far_from(&centre, members);
        let [a, b] = [centre, far].map(|q| UnitQuaternion::new_unchecked(q.into()));
        let radius = angle_between(&a, &b) + SLACK_RAD;
        let latest = members.iter().map(|m| m.1).max().unwrap_or(0);
        let ball = self.balls.len();
        let end = start + members.len();
        self.balls.push(Ball::new(&self.band, centre, radius, (start, end), latest));
        if members.len() > LEAF {
            let other = far_from(&far, members);
            for (key, i) in members.iter_mut() {
                let q = rotations[*i].coords;
                *key = half_cosine(&q, &far) - half_cosine(&q, &other);
            }
            let half = members.len() / 2;
            members.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let (near, rest) = members.split_at_mut(half);
            self.grow(near, start);
            self.grow(rest, start + half);
        }
        self.balls[ball].next = self.balls.len();
    }

    /// The orientations after the `i`-th that are in the band as seen from it, in order.
    pub(super) fn after(&self, i: usize) -> Vec<usize> {
        let mut found = Vec::new();
        let from = &self.rotations[i];
        let mut at = 0;
        while let Some(ball) = self.balls.get(at) {
            let cosine = half_cosine(&from.coords, &ball.centre);
            let members = || self.order[ball.start..ball.end].iter().copied().filter(|j| *j > i);
            if ball.latest <= i || cosine < ball.none_below || cosine > ball.none_above {
                at = ball.next;
            } else if cosine > ball.all_from && cosine < ball.all_to {
                found.extend(members());
                at = ball.next;
            } else {
                // A ball that is not divided is followed by the next.
                if ball.next == at + 1 {
                    found.extend(members().filter(|j| self.band.holds(from, &self.rotations[*j])));
                }
                at += 1;
            }
        }
        found.sort_unstable();
        found
    }
}

impl Ball {
    fn new(
        band: &Band,
        centre: Vector4<f64>,
        radius: f64,
        (start, end): (usize, usize),
        latest: usize,
    ) -> Self {
        let half = |angle: f64| (angle / 2.0).cos();
        let Band { lower, upper, .. } = *band;
        // The larger the angle the smaller the cosine. No angle is beyond a half turn, and none below zero.
        let none_below = if upper + radius < PI { half(upper + radius) - MARGIN } else { f64::NEG_INFINITY };
        let none_above = if lower > radius { half(lower - radius) + MARGIN } else { f64::INFINITY };
        let all_to = if lower + radius < PI { half(lower + radius) - MARGIN } else { f64::NEG_INFINITY };
        let all_from = match upper {
            upper if upper >= PI => f64::NEG_INFINITY,
            upper if upper > radius => half(upper - radius) + MARGIN,
            _ => f64::INFINITY,
        };
        Self { centre, none_below, none_above, all_from, all_to, start, end, latest, next: 0 }
    }
}
