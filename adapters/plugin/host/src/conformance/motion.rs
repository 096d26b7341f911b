//! Pose streams and inertial samples.

use vice_core::dataset::{Dataset, GROUND_TRUTH};
use vice_core::error::one_line;
use vice_core::imu;
use vice_core::time::Span;

use super::{Check, Lists};

impl Check<'_> {
    pub(super) fn streams(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        for name in &lists.streams {
            self.step(format!("pose stream {name}"));
            match dataset.trajectory(name) {
                Ok(trajectory) => {
                    let relative = dataset.is_relative(name);
                    let chained = if relative { ", chained from relative motions" } else { "" };
                    self.good(format!(
                        "pose stream {name}: {} poses, one each {}{chained}",
                        trajectory.len(),
                        trajectory.median_period()
                    ));
                    if relative && name == GROUND_TRUTH {
                        self.suspicious(
                            "the ground truth is relative: it starts anywhere, so that no depth can be asked at its poses",
                        );
                    }
                    let apart =
                        lists.extent().is_some_and(|(a, b)| trajectory.end() < a || trajectory.start() > b);
                    if apart {
                        self.suspicious(format!(
                            "pose stream {name}, {} to {} ns, does not overlap the frames: same clock, same unit?",
                            trajectory.start(),
                            trajectory.end()
                        ));
                    }
                    if trajectory.len() > 1 && trajectory.median_period() > Span::from_millis(1000) {
                        self.suspicious(format!(
                            "pose stream {name} has a pose each {} only; wider gaps than 0.1 s are not interpolated",
                            trajectory.median_period()
                        ));
                    }
                    self.covariances(dataset, name);
                }
                Err(error) => self.fault(format!("pose stream {name}: {}", one_line(&error))),
            }
        }
        if lists.streams.is_empty() {
            self.missing("no pose streams: every estimate has to be given as a file");
        } else if lists.streams.iter().all(|s| s != GROUND_TRUTH) {
            self.missing(format!(
                "no stream `{GROUND_TRUTH}`: without --reference, trajectories are not compared"
            ));
        }
    }

    fn covariances(&mut self, dataset: &dyn Dataset, stream: &str) {
        match dataset.pose_covariances(stream) {
            Ok(said) if said.windows(2).all(|pair| pair[0].stamp <= pair[1].stamp) => {
                if !said.is_empty() {
                    self.good(format!("pose stream {stream}: {} covariances", said.len()));
                }
            }
            Ok(_) => self.fault(format!("covariances of {stream} are not in the order of time")),
            Err(error) => self.fault(format!("covariances of {stream}: {}", one_line(&error))),
        }
    }

    pub(super) fn inertial(&mut self, dataset: &dyn Dataset, lists: &Lists) {
        self.step("inertial samples");
        match dataset.imu() {
            Ok(samples) if samples.is_empty() => {
                self.missing("no inertial samples: `--estimate imu-euler` will not work");
            }
            Ok(samples) => {
                if let Err(error) = imu::validate(&samples) {
                    self.fault(format!("inertial samples: {error}"));
                }
                let n = samples.len() as f64;
                let force = samples.iter().map(|s| s.accel_m_s2.norm()).sum::<f64>() / n;
                let rate = samples.iter().map(|s| s.gyro_rad_s.norm()).sum::<f64>() / n;
                self.good(format!("{} inertial samples, mean specific force {force:.2} m/s²", samples.len()));
                if !(5.0..15.0).contains(&force) {
                    self.suspicious(format!(
                        "the mean specific force is {force:.2}: m/s² and with gravity would be near 9.8"
                    ));
                }
                if rate > 15.0 {
                    self.suspicious(format!("the mean angular rate is {rate:.1}: is it in rad/s?"));
                }
            }
            Err(error) => self.fault(format!("inertial samples: {}", one_line(&error))),
        }
        self.step("inertial state at the first and last frame");
        let Some((first, last)) = lists.extent() else { return };
        for stamp in [first, last] {
            match dataset.inertial_state(stamp) {
                Ok(Some(state)) => {
                    let off = state.stamp.since(stamp).abs();
                    if off > Span::from_millis(1000) {
                        self.suspicious(format!(
                            "the inertial state asked for at {stamp} ns is {off} away from it"
                        ));
                    }
                }
                Ok(None) => {}
                Err(error) => self.fault(format!("inertial state at {stamp} ns: {}", one_line(&error))),
            }
        }
    }
}
