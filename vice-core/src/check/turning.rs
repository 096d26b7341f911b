//! How a source turns: orientations over time, from which the turn between any two moments follows.
//!
//! Poses have orientations; a gyroscope's samples are integrated to some. Neither the world of the one nor the bias of the
//! other matters to what is asked here: turns over a fraction of a second.

use nalgebra::{UnitQuaternion, Vector3};

use crate::frames::rotation_vector_rad;
use crate::imu::ImuSample;
use crate::statistics::middle;
use crate::time::{Span, Stamp};
use crate::trajectory::Trajectory;

/// A spacing this many times the usual one is a gap.
const GAP_TIMES: f64 = 2.5;
/// No spacing below this is a gap, seconds.
const GAP_S: f64 = 0.11;

/// Orientations of a source over time.
#[derive(Clone, Debug)]
pub struct Turning {
    origin: Stamp,
    /// Seconds since the origin, strictly increasing.
    times: Vec<f64>,
    rotations: Vec<UnitQuaternion<f64>>,
    /// How many gaps lie before each.
    gaps: Vec<u32>,
    spacing_s: f64,
    /// Whether orientations on both sides of a gap are known against each other: poses are, a chain of turns is not.
    bridged: bool,
}

/// An orientation between two that are known, and how many gaps lie before it.
pub(super) type Known = Option<(UnitQuaternion<f64>, u32)>;

impl Turning {
    /// The orientations of poses; `None` for fewer than two.
    pub fn of_poses(trajectory: &Trajectory) -> Option<Self> {
        Self::new(trajectory.iter().map(|(stamp, pose)| (stamp, pose.rotation())).collect())
    }

    /// A gyroscope's samples, integrated: between two samples their mean turns. `None` for fewer than two.
    pub fn of_gyro(samples: &[ImuSample]) -> Option<Self> {
        let mut rotation = UnitQuaternion::identity();
        let mut rows = Vec::with_capacity(samples.len());
        let mut before: Option<&ImuSample> = None;
        for sample in samples {
            if let Some(before) = before {
                let dt = sample.stamp.since(before.stamp).as_secs_f64();
                let step = (before.gyro_rad_s + sample.gyro_rad_s) * (0.5 * dt);
                rotation *= UnitQuaternion::from_scaled_axis(step);
            }
            before = Some(sample);
            rows.push((sample.stamp, rotation));
        }
        Self::new(rows)
    }

    /// A chain of turns: for each moment the turn since the one before it, `before_from_now`, in its own body; `None` where
    /// that is not known. `None` for fewer than two moments, or for moments that do not increase.
    pub fn of_steps(steps: &[(Stamp, Option<UnitQuaternion<f64>>)]) -> Option<Self> {
        if steps.windows(2).any(|w| w[1].0 <= w[0].0) {
            return None;
        }
        let (mut rotation, mut broken) = (UnitQuaternion::identity(), 0);
        let (mut rows, mut gaps) = (Vec::with_capacity(steps.len()), Vec::with_capacity(steps.len()));
        for (i, (stamp, step)) in steps.iter().enumerate() {
            match step {
                Some(step) if i > 0 => rotation *= step,
                _ => broken += u32::from(i > 0),
            }
            rows.push((*stamp, rotation));
            gaps.push(broken);
        }
        Some(Self { gaps, bridged: false, ..Self::new(rows)? })
    }

    /// The same of a frame that is fixed to the body, or moves in it: `body_from_frame` at each moment. Moments for which it
    /// is not known are left out; `None` for fewer than two.
    pub fn of_frame(&self, body_from_frame: impl Fn(Stamp) -> Option<UnitQuaternion<f64>>) -> Option<Self> {
        let stamp = |t: f64| self.origin.saturating_add(Span::from_secs_f64(t).unwrap_or(Span::ZERO));
        let rows = self.times.iter().zip(&self.rotations).filter_map(|(t, rotation)| {
            let at = stamp(*t);
            Some((at, rotation * body_from_frame(at)?))
        });
        Self::new(rows.collect())
    }

    fn new(rows: Vec<(Stamp, UnitQuaternion<f64>)>) -> Option<Self> {
        if rows.len() < 2 {
            return None;
        }
        let origin = rows[0].0;
        let times: Vec<f64> = rows.iter().map(|(s, _)| s.since(origin).as_secs_f64()).collect();
        let mut spacings: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
        let spacing_s = middle(&mut spacings, f64::total_cmp)?;
        let limit = (GAP_TIMES * spacing_s).max(GAP_S);
        let mut gaps = vec![0; rows.len()];
        for i in 1..rows.len() {
            gaps[i] = gaps[i - 1] + u32::from(times[i] - times[i - 1] > limit);
        }
        let rotations = rows.into_iter().map(|(_, r)| r).collect();
        Some(Self { origin, times, rotations, gaps, spacing_s, bridged: true })
    }

    /// Median time between two orientations, seconds.
    pub const fn spacing_s(&self) -> f64 {
        self.spacing_s
    }

    /// First and last stamp.
    pub fn range(&self) -> (Stamp, Stamp) {
        let span = Span::from_secs_f64(self.times[self.times.len() - 1]);
        (self.origin, span.map_or(self.origin, |s| self.origin.saturating_add(s)))
    }

    /// By how much it turns between each two neighbours of moments that increase, radians; `None` where that is not known.
    pub fn steps_rad(&self, stamps: &[Stamp]) -> Vec<Option<f64>> {
        let known = self.at(stamps.iter().map(|s| s.since(self.origin).as_secs_f64()));
        known.windows(2).map(|pair| Some(Self::rate(&pair[0], &pair[1], 1.0)?.norm())).collect()
    }

    /// Whether a turn between two of its moments is known across gaps.
    pub(super) const fn bridges_gaps(&self) -> bool {
        self.bridged
    }

    /// Seconds by which this origin is later than another's.
    pub(super) fn later_than(&self, other: &Self) -> f64 {
        self.origin.since(other.origin).as_secs_f64()
    }

    pub(super) fn times(&self) -> &[f64] {
        &self.times
    }

    pub(super) fn rotations(&self) -> &[UnitQuaternion<f64>] {
        &self.rotations
    }

    /// The orientations at moments that increase, seconds since the origin; `None` outside and in gaps.
    pub(super) fn at(&self, moments: impl Iterator<Item = f64>) -> Vec<Known> {
        let last = self.times.len() - 1;
        let mut after = 1;
        moments
            .map(|t| {
                if t.is_nan() || t < self.times[0] || t > self.times[last] {
                    return None;
                }
                if self.times[after - 1] > t {
                    // Only where moments do not increase after all.
                    after = self.times.partition_point(|x| *x < t).max(1);
                }
                while after < last && self.times[after] < t {
                    after += 1;
                }
                let (a, b) = (after - 1, after);
                let share = (t - self.times[a]) / (self.times[b] - self.times[a]);
                let inside = share > 1e-6 && share < 1.0 - 1e-6;
                if inside && self.gaps[b] > self.gaps[a] {
                    return None;
                }
                let gaps = if share < 0.5 { self.gaps[a] } else { self.gaps[b] };
                let step = rotation_vector_rad(&(self.rotations[a].inverse() * self.rotations[b])) * share;
                Some((self.rotations[a] * UnitQuaternion::from_scaled_axis(step), gaps))
            })
            .collect()
    }

    /// The mean turn rate between two of its moments, rad/s in its own body; `None` across a gap.
    pub(super) fn rate(from: &Known, to: &Known, dt: f64) -> Option<Vector3<f64>> {
        let ((a, gaps_a), (b, gaps_b)) = (from.as_ref()?, to.as_ref()?);
        (gaps_a == gaps_b).then(|| rotation_vector_rad(&(a.inverse() * b)) / dt)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gyro_turns_as_the_poses_do_and_gaps_are_not_bridged() {
        let sample = |i: i64| ImuSample {
            stamp: Stamp::from_nanos(i * 10_000_000),
            gyro_rad_s: Vector3::new(0.0, 0.0, 0.5),
            accel_m_s2: Vector3::zeros(),
        };
        let rows: Vec<ImuSample> = (0..100).chain(200..300).map(sample).collect();
        let gyro = Turning::of_gyro(&rows).unwrap();
        assert!((gyro.spacing_s() - 0.01).abs() < 1e-9);
        let known = gyro.at([0.105, 0.305, 1.5, 2.5, 9.0].into_iter());
        let rate = Turning::rate(&known[0], &known[1], 0.2).unwrap();
        assert!((rate - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-9, "{rate}");
        assert!(known[2].is_none() && known[4].is_none());
        assert!(Turning::rate(&known[1], &known[3], 2.195).is_none(), "across the gap");
    }

    #[test]
    fn a_chain_of_turns_is_not_known_across_what_it_lacks() {
        let step = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.05);
        let steps: Vec<_> = (0..20)
            .map(|i| (Stamp::from_nanos(i * 100_000_000), (i != 0 && i != 10).then_some(step)))
            .collect();
        let chain = Turning::of_steps(&steps).unwrap();
        let known = chain.at([0.1, 0.8, 0.95, 1.0, 1.8].into_iter());
        let rate = Turning::rate(&known[0], &known[1], 0.7).unwrap();
        assert!((rate - Vector3::new(0.0, 0.0, 0.5)).norm() < 1e-9, "{rate}");
        assert!(known[2].is_none(), "nothing is known within the step that is not there");
        assert!(Turning::rate(&known[1], &known[4], 1.0).is_none());
        assert!(Turning::rate(&known[3], &known[4], 0.8).is_some());
        assert!(Turning::of_steps(&[steps[1], steps[0]]).is_none(), "moments increase");
        // A frame that is turned against the body turns about another axis of its own.
        let over = UnitQuaternion::from_euler_angles(std::f64::consts::FRAC_PI_2, 0.0, 0.0);
        let frame = chain.of_frame(|_| Some(over)).unwrap();
        let known = frame.at([0.1, 0.8].into_iter());
        let rate = Turning::rate(&known[0], &known[1], 0.7).unwrap();
        assert!((rate - Vector3::new(0.0, 0.5, 0.0)).norm() < 1e-9, "{rate}");
    }
}
