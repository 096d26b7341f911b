//! How a source turns: orientations over time, from which the turn between any two moments follows.
//!
//! Poses have orientations; a gyroscope's samples are integrated to some. Neither the world of the one nor the bias of the
//! other matters to what is asked here: turns over a fraction of a second.

use nalgebra::{UnitQuaternion, Vector3};

use crate::frames::rotation_vector_rad;
use crate::imu::ImuSample;
use crate::statistics::middle;
use crate::time::Stamp;
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
        Some(Self { origin, times, rotations, gaps, spacing_s })
    }

    /// Median time between two orientations, seconds.
    pub const fn spacing_s(&self) -> f64 {
        self.spacing_s
    }

    /// First and last stamp.
    pub fn range(&self) -> (Stamp, Stamp) {
        let span = crate::time::Span::from_secs_f64(self.times[self.times.len() - 1]);
        (self.origin, span.map_or(self.origin, |s| self.origin.saturating_add(s)))
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
}
