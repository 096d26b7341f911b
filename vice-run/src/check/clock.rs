//! Two motion sources' clocks: from a request to the document.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use vice_core::check::clock::{ClockOffset, clock_offset, finding};
use vice_core::check::turning::Turning;
use vice_core::check::{Finding, State};
use vice_core::dataset::Dataset;
use vice_core::suspicion::Suspicions;
use vice_files::imu_file;
use vice_files::trajectory::ReadOptions;

use super::gather::IMU;
use crate::error::{RunError, RunResult};
use crate::formats;
use crate::request::{DatasetSpec, EstimateSpec};

/// Which clocks are compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClockRequest {
    /// File of poses or of inertial samples; with a recording also `imu` or the name of a stream.
    pub reference: EstimateSpec,
    /// The same, whose stamps are to be moved.
    pub estimate: EstimateSpec,
    /// The recording that streams are named of.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dataset: Option<DatasetSpec>,
    /// Offsets that are looked at, seconds to either side of none; `None`: 2, and 20 where nothing is found there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub range_s: Option<f64>,
}

impl ClockRequest {
    /// The files that are read.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let files = [&self.reference, &self.estimate].into_iter().filter_map(|s| s.path()).map(PathBuf::from);
        files.chain(self.dataset.iter().map(|d| d.path.clone())).collect()
    }
}

/// The document `vice.clock/1`.
#[derive(Clone, Debug, Serialize)]
pub struct ClockDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// What was asked for.
    pub request: ClockRequest,
    /// Whether the offset is known.
    pub known: bool,
    /// Seconds to add to the estimate's stamps: what --time-offset takes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_offset_s: Option<f64>,
    /// Low and high end of its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_95_s: Option<[f64; 2]>,
    /// What the offset grows by a second, where that can be told from none, a millionth.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_ppm: Option<f64>,
    /// Low and high end of its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_interval_95_ppm: Option<[f64; 2]>,
    /// Correlation of the turn rates at the offset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// The finding, as `vice check` has it.
    pub finding: Finding,
    /// Offsets of parts of the recording.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
    /// What looks wrong in the files.
    #[serde(skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
}

/// The offset of a part.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Part {
    /// Its middle, by the reference's clock, nanoseconds.
    pub stamp_ns: i64,
    /// Its offset, seconds.
    pub offset_s: f64,
    /// Standard deviation, seconds.
    pub sd_s: f64,
}

/// Compares two clocks.
///
/// # Errors
/// [`RunError`] if a source cannot be read. An offset that cannot be known is no error: see [`ClockDocument::known`].
pub fn compare_clocks(request: &ClockRequest) -> RunResult<ClockDocument> {
    if let Some(range) = request.range_s.filter(|r| !(r.is_finite() && *r >= 0.1)) {
        return Err(RunError::usage("range", format!("{range} s is too little: give at least 0.1")));
    }
    let dataset = match &request.dataset {
        Some(spec) => Some(spec.open_raw(&formats::registry(&spec.plugins)?)?),
        None => None,
    };
    let mut suspicions = Suspicions::new();
    let mut read = |spec: &EstimateSpec| turning(spec, dataset.as_deref(), &mut suspicions);
    let (reference, estimate) = (read(&request.reference)?, read(&request.estimate)?);
    let answer = clock_offset(&reference, &estimate, request.range_s);
    let [a, b] = [&request.reference, &request.estimate].map(short_name);
    let finding = finding(&a, &b, &answer);
    let around = |value: f64, half: f64| [value - half, value + half];
    let found: Option<ClockOffset> = answer.ok();
    let found = found.as_ref();
    let rate = found.and_then(|f| f.rate);
    Ok(ClockDocument {
        schema: "vice.clock/1",
        request: request.clone(),
        known: found.is_some(),
        time_offset_s: found.map(|f| f.offset_s),
        interval_95_s: found.map(|f| around(f.offset_s, f.half_95_s)),
        rate_ppm: rate.map(|r| 1e6 * r.share),
        rate_interval_95_ppm: rate.map(|r| around(1e6 * r.share, 1e6 * r.half_95)),
        correlation: found.map(|f| f.correlation),
        finding,
        parts: found.map_or_else(Vec::new, |f| {
            let part = |(stamp, offset_s, sd_s): &(vice_core::time::Stamp, f64, f64)| Part {
                stamp_ns: stamp.as_nanos(),
                offset_s: *offset_s,
                sd_s: *sd_s,
            };
            f.parts.iter().map(part).collect()
        }),
        suspicions,
    })
}

/// A file without its folders.
fn short_name(spec: &EstimateSpec) -> String {
    let word = spec.to_string();
    let name = Path::new(&word).file_name().map(|n| n.to_string_lossy().into_owned());
    name.unwrap_or(word)
}

/// How a source turns.
fn turning(
    spec: &EstimateSpec,
    dataset: Option<&dyn Dataset>,
    suspicions: &mut Suspicions,
) -> RunResult<Turning> {
    let name = spec.to_string();
    let few = || RunError::missing(format!("{name}: fewer than two samples"));
    if let Some(dataset) = dataset {
        if name == IMU {
            return Turning::of_gyro(&dataset.imu()?).ok_or_else(few);
        }
        if dataset.streams().contains(&name) {
            return Turning::of_poses(&dataset.trajectory(&name)?).ok_or_else(few);
        }
        if !spec.is_file() {
            let streams = dataset.streams().join(", ");
            return Err(RunError::missing(format!(
                "{name} is neither a file nor a stream of the data set (streams: {streams}; {IMU} for its IMU)"
            )));
        }
    }
    match spec.read_file(&ReadOptions::default()) {
        Ok(file) => {
            suspicions.extend(file.suspicions);
            Turning::of_poses(&file.trajectory).ok_or_else(few)
        }
        Err(error) => {
            // A table of inertial samples is no table of poses.
            let samples =
                spec.path().and_then(|path| imu_file::read(path).ok()).filter(|f| !f.samples.is_empty());
            let Some(samples) = samples else { return Err(error.into()) };
            suspicions.extend(samples.suspicions);
            Turning::of_gyro(&samples.samples).ok_or_else(few)
        }
    }
}

impl ClockDocument {
    /// What was found, for a terminal.
    pub fn render(&self) -> String {
        let mut text = super::text::line(&self.finding);
        if let (State::Ok, Some(offset)) = (self.finding.state, self.time_offset_s) {
            text.push_str(&format!("{:20}{}\n", "", self.finding.evidence()));
            text.push_str(&format!("{:20}--time-offset {offset:.4}\n", ""));
        }
        let first = self.parts.first().map_or(0, |p| p.stamp_ns);
        for part in &self.parts {
            let at = (part.stamp_ns - first) as f64 * 1e-9;
            text.push_str(&format!(
                "{:20}{at:8.1} s  {:8.2} ± {:.2} ms\n",
                "",
                1e3 * part.offset_s,
                1.96e3 * part.sd_s
            ));
        }
        text
    }
}
