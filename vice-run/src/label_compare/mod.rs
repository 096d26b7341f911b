//! Two sets of labels of the same points: how far they lie apart, what one has and the other has not, and how they drift.
//!
//! Two people, a person and the tracker, or two trackers. What is left between them is the floor under RMSE_2D: see
//! [`LabelComparison::floor_px`].

mod matching;
mod plot;
mod words;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::camera::Pixel;
use vice_core::label::{LabelSet, Observation, PointLabels};
use vice_core::statistics::{quantile, sorted};
use vice_core::time::Stamp;

use crate::error::{RunError, RunResult};

pub use crate::label_noise::SCHEMA;

/// Bins of the plot over time, seconds.
const BIN_S: f64 = 1.0;

/// How two sets of labels compare.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelComparison {
    /// [`SCHEMA`].
    pub schema: String,
    /// The one file.
    pub a: PathBuf,
    /// The other file.
    pub b: PathBuf,
    /// Points that are compared, in the order of the first file.
    pub points: Vec<PointAgreement>,
    /// All of them together.
    pub all: Agreement,
    /// The noise of one labeller, pixels: the root mean square of how labels of both moved apart since their key frame, by
    /// the square root of two, each being as good as the other. Null where no segment has two labels of both.
    pub floor_px: Option<f64>,
    /// Points of the first file that the other one has not.
    pub only_in_a: Vec<String>,
    /// Points of the second file that the first one has not.
    pub only_in_b: Vec<String>,
    /// Second by second since the first label.
    pub by_time: Vec<TimeBin>,
}

/// One point in both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PointAgreement {
    /// Its name in the first file.
    pub a: String,
    /// Its name in the second file: where names differ points are the same that lie together.
    pub b: String,
    /// How it compares.
    pub agreement: Agreement,
}

/// Distances of labels of the same frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Agreement {
    /// Labels that are compared: both have the point in the frame, and neither says that it is hidden.
    pub compared: u64,
    /// Labels that the first has, and the second has not.
    pub missing_in_b: u64,
    /// Labels that the second has, and the first has not.
    pub missing_in_a: u64,
    /// Median distance, pixels; null where nothing is compared.
    pub median_px: Option<f64>,
    /// 95th percentile, pixels.
    pub p95_px: Option<f64>,
    /// Root mean square, pixels.
    pub rms_px: Option<f64>,
    /// The largest, pixels.
    pub worst_px: Option<f64>,
    /// Median over segments of how far the labels moved apart from the first to the last one that both have, pixels.
    pub drift_median_px: Option<f64>,
    /// The 95th percentile of that.
    pub drift_p95_px: Option<f64>,
    /// Segments with two labels of both.
    pub segments: u64,
}

/// A second of the run.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeBin {
    /// Where it starts, seconds since the first label of both.
    pub from_s: f64,
    /// Labels that are compared.
    pub compared: u64,
    /// Median distance, pixels.
    pub median_px: f64,
    /// 95th percentile, pixels.
    pub p95_px: f64,
}

/// What is collected of a point, or of all.
#[derive(Default)]
struct Collected {
    distances: Vec<f64>,
    drifts: Vec<f64>,
    /// Squared distances since the key frame, which is not among them.
    since: Vec<f64>,
    missing: [u64; 2],
}

impl Collected {
    fn add(&mut self, other: &Self) {
        self.distances.extend(&other.distances);
        self.drifts.extend(&other.drifts);
        self.since.extend(&other.since);
        self.missing[0] += other.missing[0];
        self.missing[1] += other.missing[1];
    }

    fn agreement(&self) -> Agreement {
        let (distances, drifts) = (sorted(self.distances.clone()), sorted(self.drifts.clone()));
        Agreement {
            compared: distances.len() as u64,
            missing_in_a: self.missing[0],
            missing_in_b: self.missing[1],
            median_px: quantile(&distances, 0.5),
            p95_px: quantile(&distances, 0.95),
            rms_px: root_mean(distances.iter().map(|d| d * d)),
            worst_px: distances.last().copied(),
            drift_median_px: quantile(&drifts, 0.5),
            drift_p95_px: quantile(&drifts, 0.95),
            segments: drifts.len() as u64,
        }
    }
}

fn root_mean(squares: impl ExactSizeIterator<Item = f64>) -> Option<f64> {
    let count = squares.len();
    (count > 0).then(|| (squares.sum::<f64>() / count as f64).sqrt())
}

/// Compares two sets of labels of one camera.
///
/// # Errors
/// [`RunError`] if they are of different cameras, or no point of one is a point of the other.
pub fn compare(a: (&Path, &LabelSet), b: (&Path, &LabelSet)) -> RunResult<LabelComparison> {
    if let (Some(one), Some(other)) = (&a.1.camera, &b.1.camera)
        && one != other
    {
        return Err(RunError::usage(
            "b",
            format!("{} is of camera {one}, {} of {other}", a.0.display(), b.0.display()),
        ));
    }
    let pairs = matching::pairs(a.1, b.1);
    if pairs.is_empty() {
        return Err(RunError::usage(
            "b",
            format!(
                "no point of {} is a point of {}: neither by its name nor by where it is",
                b.0.display(),
                a.0.display()
            ),
        )
        .advise("label the same points in both, under the same names"));
    }
    let mut all = Collected::default();
    let mut points = Vec::new();
    let mut in_time: Vec<(Stamp, f64)> = Vec::new();
    for (one, other) in &pairs {
        let collected = collect(one, other, &mut in_time);
        all.add(&collected);
        points.push(PointAgreement {
            a: one.name.clone(),
            b: other.name.clone(),
            agreement: collected.agreement(),
        });
    }
    let is_left = |set: &LabelSet, pick: fn(&(&PointLabels, &PointLabels)) -> String| {
        let taken: Vec<String> = pairs.iter().map(pick).collect();
        set.points().iter().map(|p| p.name.clone()).filter(|n| !taken.contains(n)).collect()
    };
    Ok(LabelComparison {
        schema: SCHEMA.to_string(),
        a: a.0.to_path_buf(),
        b: b.0.to_path_buf(),
        points,
        all: all.agreement(),
        floor_px: root_mean(all.since.iter().copied()).map(|rms| rms / std::f64::consts::SQRT_2),
        only_in_a: is_left(a.1, |p| p.0.name.clone()),
        only_in_b: is_left(b.1, |p| p.1.name.clone()),
        by_time: bins(in_time),
    })
}

/// The offset of the other label from the first one's.
fn offset(a: &Observation, b: &Observation) -> [f64; 2] {
    [b.px.u - a.px.u, b.px.v - a.px.v]
}

fn collect(a: &PointLabels, b: &PointLabels, in_time: &mut Vec<(Stamp, f64)>) -> Collected {
    let mut collected = Collected::default();
    let others: BTreeMap<Stamp, Observation> = b.observations.iter().map(|o| (o.stamp, o)).collect();
    let own: BTreeMap<Stamp, Observation> = a.observations.iter().map(|o| (o.stamp, o)).collect();
    collected.missing[0] = b.observations.iter().filter(|o| !own.contains_key(&o.stamp)).count() as u64;
    // The offset at the start of the segment, and the last one in it.
    let mut segment: Option<([f64; 2], Option<f64>)> = None;
    let close = |segment: &mut Option<([f64; 2], Option<f64>)>, drifts: &mut Vec<f64>| {
        drifts.extend(segment.take().and_then(|(_, last)| last));
    };
    for one in &a.observations {
        let other = others.get(&one.stamp);
        collected.missing[1] += u64::from(other.is_none());
        if one.keyframe || other.is_some_and(|o| o.keyframe) {
            close(&mut segment, &mut collected.drifts);
        }
        let Some(other) = other.filter(|o| !o.occluded && !one.occluded) else { continue };
        let distance_px = one.px.distance_px(other.px);
        collected.distances.push(distance_px);
        in_time.push((one.stamp, distance_px));
        let now = offset(&one, other);
        match &mut segment {
            None => segment = Some((now, None)),
            Some((start, last)) => {
                let moved = Pixel::from(now).distance_px(Pixel::from(*start));
                collected.since.push(moved * moved);
                *last = Some(moved);
            }
        }
    }
    close(&mut segment, &mut collected.drifts);
    collected
}

fn bins(in_time: Vec<(Stamp, f64)>) -> Vec<TimeBin> {
    let Some(first) = in_time.iter().map(|(stamp, _)| *stamp).min() else { return vec![] };
    let mut by_bin: BTreeMap<u64, Vec<f64>> = BTreeMap::new();
    for (stamp, distance_px) in in_time {
        let bin = (stamp.since(first).as_secs_f64() / BIN_S) as u64;
        by_bin.entry(bin).or_default().push(distance_px);
    }
    by_bin
        .into_iter()
        .filter_map(|(bin, distances)| {
            let distances = sorted(distances);
            Some(TimeBin {
                from_s: bin as f64 * BIN_S,
                compared: distances.len() as u64,
                median_px: quantile(&distances, 0.5)?,
                p95_px: quantile(&distances, 0.95)?,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests;
