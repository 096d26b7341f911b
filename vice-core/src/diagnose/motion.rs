//! The poses of an estimate with its flaws taken out, read at any time.
//!
//! Times are seconds since the camera's first frame. A stream of 40 Hz and more is smoothed at the start: poses that are
//! interpolated linearly are quieter half-way between two stamps, which draws a clock offset towards there.

use std::borrow::Cow;

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::flaw::Flaw;
use super::theta::Theta;
use crate::error::{DataError, DataResult};
use crate::frames::{Rigid, WorldFromBody, rotation_vector_rad};
use crate::imu::{ImuSample, InertialState, integrate_euler};
use crate::statistics::middle;
use crate::time::{Span, Stamp};
use crate::trajectory::{Trajectory, interpolate};

/// Streams slower than this are not smoothed, seconds between poses.
const SLOW_S: f64 = 0.026;
/// Half the width of the smoothing: seconds, and at least so many poses.
const HALF_WIDTH_S: f64 = 0.045;
const HALF_WIDTH_POSES: f64 = 3.2;
/// A smoothed stream is kept at this spacing, seconds.
const SPACING_S: f64 = 0.005;

/// The integration that made an inertial estimate, to be run again from another start or with another clock.
#[derive(Clone, Debug)]
pub struct InertialRun {
    /// The samples, any clock offset already added.
    pub samples: Vec<ImuSample>,
    /// Where the integration starts.
    pub start: InertialState,
    /// Where it ends.
    pub end: Stamp,
    /// Gravity in the world, m/s².
    pub gravity_m_s2: Vector3<f64>,
}

impl InertialRun {
    /// The trajectory with the stamps of the samples moved and the start turned about the world's axes. Where the moved
    /// samples begin after the start, the first one is held from there.
    ///
    /// # Errors
    /// [`DataError`] if the moved samples end before the start.
    pub fn integrate(&self, samples_later: Span, start_turned_rad: Vector3<f64>) -> DataResult<Trajectory> {
        let mut moved: Cow<'_, [ImuSample]> = if samples_later == Span::ZERO {
            Cow::Borrowed(&self.samples)
        } else {
            self.samples.iter().map(|s| ImuSample { stamp: s.stamp + samples_later, ..*s }).collect()
        };
        if let Some(first) = moved.first().copied().filter(|s| s.stamp > self.start.stamp) {
            moved.to_mut().insert(0, ImuSample { stamp: self.start.stamp, ..first });
        }
        let pose = self.start.world_from_body;
        let turned = UnitQuaternion::from_scaled_axis(start_turned_rad) * pose.rotation();
        let start =
            InertialState { world_from_body: Rigid::from_parts(pose.translation(), turned), ..self.start };
        integrate_euler(&moved, &start, self.end, self.gravity_m_s2)
            .map_err(|e| DataError::new("the inertial estimate cannot be integrated again").because(e))
    }
}

/// Poses in order of time.
#[derive(Clone, Debug, Default)]
pub(super) struct Poses {
    times_s: Vec<f64>,
    poses: Vec<WorldFromBody>,
    /// Poses per second if they are evenly spaced: where to look first.
    rate_hz: f64,
}

impl Poses {
    pub(super) fn new(trajectory: &Trajectory, first_frame: Stamp) -> Self {
        let times_s: Vec<f64> =
            trajectory.stamps().iter().map(|s| s.since(first_frame).as_secs_f64()).collect();
        Self::of(times_s, trajectory.poses().to_vec())
    }

    fn of(times_s: Vec<f64>, poses: Vec<WorldFromBody>) -> Self {
        let span = times_s.last().copied().unwrap_or(0.0) - times_s.first().copied().unwrap_or(0.0);
        let rate_hz = if span > 0.0 { (times_s.len() - 1) as f64 / span } else { 0.0 };
        Self { times_s, poses, rate_hz }
    }

    /// The pose at a time; beyond the ends the last step goes on.
    pub(super) fn at(&self, t_s: f64) -> WorldFromBody {
        self.between(t_s, |index| self.poses[index])
    }

    /// The same of other poses at the same times.
    fn between(&self, t_s: f64, pose: impl Fn(usize) -> WorldFromBody) -> WorldFromBody {
        let n = self.times_s.len();
        if n == 1 {
            return pose(0);
        }
        let guess = ((t_s - self.times_s[0]) * self.rate_hz).clamp(0.0, (n - 2) as f64) as usize;
        let fits = |i: usize| self.times_s[i] <= t_s && t_s <= self.times_s[i + 1];
        let before = if fits(guess) {
            guess
        } else {
            self.times_s.partition_point(|t| *t <= t_s).saturating_sub(1).min(n - 2)
        };
        let (t0, t1) = (self.times_s[before], self.times_s[before + 1]);
        interpolate(&pose(before), &pose(before + 1), (t_s - t0) / (t1 - t0))
    }

    /// Local quadratics through the poses, at even spacing; as it is where poses are sparse.
    pub(super) fn smoothed(&self) -> Self {
        let n = self.times_s.len();
        let mut steps: Vec<f64> = self.times_s.windows(2).map(|w| w[1] - w[0]).collect();
        let Some(period) = middle(&mut steps, f64::total_cmp).filter(|p| *p < SLOW_S && n > 8) else {
            return self.clone();
        };
        let half = HALF_WIDTH_S.max(HALF_WIDTH_POSES * period);
        let (first, last) = (self.times_s[0], self.times_s[n - 1]);
        let count = ((last - first) / SPACING_S) as usize;
        // So long a stream is dense enough as it is.
        let spacing = if count > 2_000_000 { period } else { SPACING_S };
        let count = ((last - first) / spacing) as usize;
        let (mut times_s, mut poses) = (Vec::with_capacity(count + 1), Vec::with_capacity(count + 1));
        let mut low = 0;
        for i in 0..=count {
            let t = first + i as f64 * spacing;
            while self.times_s[low] < t - half {
                low += 1;
            }
            let mut high = low;
            while high < n && self.times_s[high] <= t + half {
                high += 1;
            }
            times_s.push(t);
            poses.push(self.quadratic(t, half, low, high).unwrap_or_else(|| self.at(t)));
        }
        Self::of(times_s, poses)
    }

    /// The value at `t` of weighted quadratics through poses `low..high`; `None` where they do not lie on both sides.
    fn quadratic(&self, t: f64, half: f64, low: usize, high: usize) -> Option<WorldFromBody> {
        let around = low..high;
        let before = around.clone().filter(|i| self.times_s[*i] <= t).count();
        if before < 2 || around.len() - before < 2 {
            return None;
        }
        let base = self.poses[low + before - 1];
        let mut normal = Matrix3::<f64>::zeros();
        let mut sums = [[0.0; 6]; 3];
        for i in around {
            let u = (self.times_s[i] - t) / half;
            let w = (1.0 - u * u).powi(2);
            let powers = [1.0, u, u * u];
            let p = self.poses[i].translation() - base.translation();
            let r = rotation_vector_rad(&(base.rotation().inverse() * self.poses[i].rotation()));
            for a in 0..3 {
                for b in 0..3 {
                    normal[(a, b)] += w * powers[a] * powers[b];
                }
                for c in 0..3 {
                    sums[a][c] += w * powers[a] * p[c];
                    sums[a][3 + c] += w * powers[a] * r[c];
                }
            }
        }
        let inverse = normal.try_inverse()?;
        let value = |c: usize| (0..3).map(|a| inverse[(0, a)] * sums[a][c]).sum::<f64>();
        let p = base.translation() + Vector3::new(value(0), value(1), value(2));
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(value(3), value(4), value(5)));
        Some(Rigid::from_parts(p, base.rotation() * turn))
    }

    /// Positions without a yaw rate and a velocity in a world that turns with it, and shorter by a scale: dead reckoning
    /// again, step by step.
    fn without_yaw(&self, longer: f64, velocity: Vector3<f64>, yaw_rate: f64) -> Vec<Vector3<f64>> {
        let start = self.times_s[0];
        let first = self.poses[0].translation();
        let (mut before_s, mut before, mut position) = (0.0, first, first);
        let positions = self.times_s.iter().zip(&self.poses).map(|(t, pose)| {
            let now_s = t - start;
            let step = (pose.translation() - before) / longer - velocity * (now_s - before_s);
            let (sin, cos) = (-0.5 * yaw_rate * (before_s + now_s)).sin_cos();
            position += Vector3::new(cos * step.x - sin * step.y, sin * step.x + cos * step.y, step.z);
            (before_s, before) = (now_s, pose.translation());
            position
        });
        positions.collect()
    }

    /// One of the poses with a position of [`Poses::without_yaw`].
    fn turned_back(&self, index: usize, position: Vector3<f64>, yaw_rate: f64) -> WorldFromBody {
        let (sin, cos) = (0.5 * (-yaw_rate * (self.times_s[index] - self.times_s[0]))).sin_cos();
        let turn = UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin));
        Rigid::from_parts(position, turn * self.poses[index].rotation())
    }

    pub(super) fn first_s(&self) -> f64 {
        self.times_s[0]
    }
}

/// An estimate, and how its poses follow from a [`Theta`].
#[derive(Clone)]
pub(super) struct Motion<'a> {
    pub(super) poses: Poses,
    pub(super) inertial: Option<&'a InertialRun>,
    pub(super) first_frame: Stamp,
    /// Which stream of poses this is, among those that are tried.
    pub(super) id: u64,
}

impl Motion<'_> {
    /// The stream with the flaws taken out, to be read at the true times.
    pub(super) fn reader(&self, theta: &Theta) -> DataResult<Reader<'_>> {
        let offset_s = theta.of(Flaw::ClockOffset)[0];
        let tilt = theta.of(Flaw::InitialTilt);
        let mut late_s = offset_s;
        let poses = match self.inertial {
            Some(run) if offset_s != 0.0 || tilt != [0.0, 0.0] => {
                late_s = 0.0;
                let too_late = Span::from_secs_f64(offset_s)
                    .map_err(|e| DataError::new("the clock offset is no span of time").because(e))?;
                let trajectory = run.integrate(-too_late, Vector3::new(-tilt[0], -tilt[1], 0.0))?;
                Cow::Owned(Poses::new(&trajectory, self.first_frame))
            }
            _ => Cow::Borrowed(&self.poses),
        };
        let mut longer = 1.0 + theta.of(Flaw::Scale)[0];
        let drift = theta.of(Flaw::Drift);
        let (mut velocity, yaw_rate) = (Vector3::new(drift[0], drift[1], drift[2]), drift[3]);
        let mut turned = None;
        if yaw_rate != 0.0 {
            turned = Some((poses.without_yaw(longer, velocity, yaw_rate), yaw_rate));
            (longer, velocity) = (1.0, Vector3::zeros());
        }
        let first = poses.poses[0].translation();
        let [step_s, step_at_s] = [theta.of(Flaw::ClockStep)[0], theta.of(Flaw::ClockStep)[1]];
        let fast = theta.of(Flaw::ClockRate)[0];
        Ok(Reader { poses, turned, late_s, fast, step_s, step_at_s, longer, velocity, first })
    }
}

/// Reads poses at true times.
pub(super) struct Reader<'a> {
    poses: Cow<'a, Poses>,
    /// Positions at the times of the poses and the rate at which their rotations are turned back, where the estimate turns
    /// away at a rate: poses are made where they are read.
    turned: Option<(Vec<Vector3<f64>>, f64)>,
    late_s: f64,
    fast: f64,
    step_s: f64,
    step_at_s: f64,
    longer: f64,
    velocity: Vector3<f64>,
    first: Vector3<f64>,
}

impl Reader<'_> {
    pub(super) fn at(&self, t_s: f64) -> WorldFromBody {
        self.put_back(self.unscaled_at(t_s), t_s)
    }

    /// The same with its scale and velocity left in.
    pub(super) fn unscaled_at(&self, t_s: f64) -> WorldFromBody {
        let read_s = self.read_s(t_s);
        match &self.turned {
            None => self.poses.at(read_s),
            Some((positions_m, yaw_rate)) => {
                self.poses.between(read_s, |i| self.poses.turned_back(i, positions_m[i], *yaw_rate))
            }
        }
    }

    /// When the stream is read for a true time.
    fn read_s(&self, t_s: f64) -> f64 {
        let step = if t_s >= self.step_at_s { self.step_s } else { 0.0 };
        t_s * (1.0 + self.fast) + self.late_s + step
    }

    /// The pose at a true time without scale and velocity, from that of [`Reader::unscaled_at`].
    pub(super) fn put_back(&self, pose: WorldFromBody, t_s: f64) -> WorldFromBody {
        if self.longer == 1.0 && self.velocity == Vector3::zeros() {
            return pose;
        }
        let since_s = self.read_s(t_s) - self.poses.first_s();
        let position = self.first + (pose.translation() - self.first) / self.longer - self.velocity * since_s;
        Rigid::from_parts(position, pose.rotation())
    }
}
