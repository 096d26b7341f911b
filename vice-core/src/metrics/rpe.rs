//! The relative pose error (RPE): how far motions over a given stretch are off, whatever came before.
//!
//! Pairs of poses a `delta` apart are chosen as evo 1.38 chooses them; seconds, which evo does not have, are added.

use std::fmt;
use std::str::FromStr;

use crate::error::{DataError, DataResult};
use crate::frames::rotation_angle_rad;
use crate::metrics::associate::PosePairs;
use crate::metrics::trajectory::{Statistics, relative_error};
use crate::time::Span;

mod pairs;
mod turns;

/// The most pairs that are compared (about 0.5 GB): all pairs by angle can be as many as n²/2.
pub const MAX_PAIRS: usize = 1 << 24;

/// Relative tolerance of the stretch between two poses where all pairs by metres or degrees are asked for (evo's).
pub const ALL_PAIRS_TOLERANCE: f64 = 0.1;

/// What the stretch between two poses is measured in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
pub enum DeltaUnit {
    /// Number of paired poses.
    #[default]
    Frames,
    /// Length of the path.
    Meters,
    /// Time.
    Seconds,
    /// Rotation: added up along the path for consecutive pairs, from pose to pose for all pairs.
    Degrees,
}

impl DeltaUnit {
    /// All units.
    pub const ALL: [Self; 4] = [Self::Frames, Self::Meters, Self::Seconds, Self::Degrees];

    /// The name used in options and results.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Meters => "meters",
            Self::Seconds => "seconds",
            Self::Degrees => "degrees",
        }
    }
}

impl FromStr for DeltaUnit {
    type Err = DataError;
    fn from_str(name: &str) -> DataResult<Self> {
        Self::ALL.into_iter().find(|u| u.name() == name).ok_or_else(|| {
            DataError::new(format!("`{name}` is no unit of delta"))
                .hint("one of frames, meters, seconds, degrees")
        })
    }
}

/// A validated stretch between two poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delta {
    value: f64,
    unit: DeltaUnit,
}

impl Delta {
    /// A stretch of `value` units.
    ///
    /// # Errors
    /// [`DataError`] unless it is finite and above zero, whole for frames, at least a nanosecond and representable for
    /// seconds, at most 180 for degrees.
    pub fn new(value: f64, unit: DeltaUnit) -> DataResult<Self> {
        let delta = Self { value, unit };
        if !(value.is_finite() && value > 0.0) {
            return Err(DataError::new(format!("a delta of {delta} is not above zero")));
        }
        let problem = match unit {
            DeltaUnit::Frames if value.fract() != 0.0 => "is not a whole number",
            DeltaUnit::Degrees if value > 180.0 => "is more than 180, the largest angle between two poses",
            DeltaUnit::Seconds if delta.span() <= Span::ZERO => "is less than a nanosecond",
            _ => return Ok(delta),
        };
        Err(DataError::new(format!("a delta of {delta} {problem}")))
    }

    /// The number, in [`Delta::unit`].
    pub const fn value(&self) -> f64 {
        self.value
    }

    /// The unit.
    pub const fn unit(&self) -> DeltaUnit {
        self.unit
    }

    /// The value as time; the longest span where it does not fit.
    fn span(&self) -> Span {
        Span::from_secs_f64(self.value).unwrap_or(Span::MAX)
    }
}

impl fmt::Display for Delta {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.value, self.unit.name())
    }
}

/// Where pairs may begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PairMode {
    /// Where the pair before ended.
    #[default]
    Consecutive,
    /// At every pose.
    All,
}

/// Whose path and angles tell how far two poses are apart, for metres and degrees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PairsFrom {
    /// The estimate's, after alignment: evo's default, and what its published numbers mean.
    #[default]
    Estimate,
    /// The reference's, so that several estimates are compared over the same pairs.
    Reference,
}

/// Which pairs are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RpeOptions {
    /// How far the poses of a pair are apart.
    pub delta: Delta,
    /// Where pairs may begin.
    pub mode: PairMode,
    /// Who tells how far two poses are apart.
    pub pairs_from: PairsFrom,
}

/// The relative pose error of each pair of poses.
#[derive(Clone, Debug, PartialEq)]
pub struct RpeErrors {
    /// Indices of the two poses, ordered by the first, then the second.
    pub pairs: Vec<(usize, usize)>,
    /// Distance between where the two motions lead to, metres.
    pub translation_m: Vec<f64>,
    /// `|Log(δRᵀ δR̂)|`, radians in `[0, π]`.
    pub rotation_rad: Vec<f64>,
}

/// Statistics of the relative pose error.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rpe {
    /// How many pairs of poses there were.
    pub pairs: usize,
    /// Of the distances, metres.
    pub translation_m: Statistics,
    /// Of the angles, radians.
    pub rotation_rad: Statistics,
}

impl RpeErrors {
    /// The errors of the pairs that `options` choose.
    ///
    /// - Frames: every `delta`-th pose, or every pose with the one `delta` later.
    /// - Metres and degrees, consecutive: a pair ends where path or rotation, added up since its start, reach `delta`.
    /// - Metres, all: for each pose the later one whose path from it is nearest to `delta`, within 10 %.
    /// - Degrees, all: every two poses whose orientations are `delta` apart, within 10 %.
    /// - Seconds: for a pose at `t` the one nearest to `t + delta`, the earlier of two at the same distance. There is
    ///   no pair where that is the pose itself, nor where `t + delta` is past the last pose by more than half of the
    ///   last time step.
    ///
    /// Costs O(n log n). All pairs by degrees cost, in parallel, what is found beside it, and what lies in the same
    /// small ball of orientations as the bounds of the tolerance; more than [`MAX_PAIRS`] are refused.
    ///
    /// # Errors
    /// [`DataError`] if no two poses are that far apart, or more than [`MAX_PAIRS`] pairs are.
    pub fn of(pairs: &PosePairs, options: &RpeOptions) -> DataResult<Self> {
        let chosen = pairs::choose(pairs, options)?;
        if chosen.is_empty() {
            return Err(nothing_that_far(pairs, options));
        }
        let errors = chosen.iter().map(|&(i, j)| {
            let error = relative_error(pairs, i, j);
            (error.translation_m, rotation_angle_rad(&error.rotation))
        });
        let (translation_m, rotation_rad) = errors.unzip();
        Ok(Self { pairs: chosen, translation_m, rotation_rad })
    }

    /// The statistics of each kind of error.
    ///
    /// # Errors
    /// [`DataError`] if positions are so far apart that their squares do not fit a double.
    pub fn statistics(&self) -> DataResult<Rpe> {
        Ok(Rpe {
            pairs: self.pairs.len(),
            translation_m: Statistics::of(&self.translation_m)?,
            rotation_rad: Statistics::of(&self.rotation_rad)?,
        })
    }
}

fn nothing_that_far(pairs: &PosePairs, options: &RpeOptions) -> DataError {
    let poses = options.pairs_from.of(pairs);
    let stamps = pairs.stamps();
    let there_is = match options.delta.unit {
        DeltaUnit::Frames => format!("there are {} paired poses", poses.len()),
        DeltaUnit::Meters => {
            let path: f64 = poses.windows(2).map(|w| (w[1].translation() - w[0].translation()).norm()).sum();
            format!("the path of {} paired poses is {path:.3} m long", poses.len())
        }
        DeltaUnit::Seconds => {
            format!("{} paired poses span {}", poses.len(), stamps[stamps.len() - 1] - stamps[0])
        }
        DeltaUnit::Degrees => {
            let turn: f64 = poses
                .windows(2)
                .map(|w| rotation_angle_rad(&(w[0].rotation().inverse() * w[1].rotation())))
                .sum();
            format!("{} paired poses turn by {:.3} degrees in all", poses.len(), turn.to_degrees())
        }
    };
    DataError::new(format!("no two poses are {} apart: {there_is}", options.delta))
        .hint("choose another delta: it is too long, or shorter than the poses are apart")
}

#[cfg(test)]
mod tests;
