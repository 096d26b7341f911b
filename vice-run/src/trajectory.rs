//! Two trajectories against each other, as evo does: from a request to the document.

mod several;

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use vice_core::conventions::{Convention, Given, cure, suspect};
use vice_core::metrics::align::{Alignment, ReferenceFromEstimate, align};
use vice_core::metrics::associate::{Matching, PosePairs, crop};
use vice_core::metrics::plane::Plane;
use vice_core::metrics::quaternion_order;
use vice_core::metrics::rpe::{Delta, DeltaUnit, PairMode, PairsFrom, Rpe, RpeErrors, RpeOptions};
use vice_core::metrics::trajectory::{Ape, ApeErrors, Statistics, Summary};
use vice_core::suspicion::{Suspicion, Suspicions};
use vice_core::time::{Span, Stamp};
use vice_core::trajectory::Trajectory;
use vice_files::trajectory::{ReadOptions, TrajectoryFormat};

use crate::error::{Context, RunError, RunResult};
use crate::in_memory::{InMemory, own_name};
use crate::recorded::Recorded;
use crate::report::evo_zip::{self, About};
use crate::report::plots::trajectory as plot;
use crate::report::table;
use crate::request::{EstimateSpec, seconds, seconds_option};

pub use several::{TrajectoriesDocument, plot_several, render_several};

/// Largest time difference of two poses that belong together, where nothing else is said.
pub const DEFAULT_T_MAX_DIFF: Span = Span::from_millis(10);

/// Which trajectories are compared, and how.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrajectoryRequest {
    /// The reference: a file, relative motions, a data set, or `DATASET:STREAM`.
    pub reference: EstimateSpec,
    /// The estimate, named alike.
    pub estimate: EstimateSpec,
    /// What the estimate is, where that is not what it is read as.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub estimate_as: Vec<Convention>,
    /// Alignment of the estimate.
    #[serde(default = "no_alignment")]
    pub align: Alignment,
    /// Align on this many poses from the first on; `None`: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub n_to_align: Option<usize>,
    /// Largest time difference of two poses that belong together; `None`: 10 ms.
    #[serde(
        default,
        rename = "t_max_diff_s",
        with = "seconds_option",
        skip_serializing_if = "Option::is_none"
    )]
    pub t_max_diff: Option<Span>,
    /// Seconds added to the stamps of the estimate.
    #[serde(default, rename = "t_offset_s", with = "seconds")]
    pub t_offset: Span,
    /// Interpolate the reference at the stamps of the estimate instead of taking the nearest pose.
    #[serde(default)]
    pub interpolate: bool,
    /// Widest gap of the reference that is interpolated; `None`: 0.1 s.
    #[serde(default, rename = "max_gap_s", with = "seconds_option", skip_serializing_if = "Option::is_none")]
    pub max_gap: Option<Span>,
    /// Only from this stamp on, nanoseconds.
    #[serde(default, rename = "t_start_ns", skip_serializing_if = "Option::is_none")]
    pub t_start: Option<Stamp>,
    /// Only up to this stamp, nanoseconds.
    #[serde(default, rename = "t_end_ns", skip_serializing_if = "Option::is_none")]
    pub t_end: Option<Stamp>,
    /// Flatten both trajectories to a plane before comparing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub project_to_plane: Option<Plane>,
    /// Stretch between the poses of a pair, for RPE.
    #[serde(default = "one")]
    pub delta: f64,
    /// What the stretch is measured in.
    #[serde(default)]
    pub delta_unit: DeltaUnit,
    /// Start a pair at every pose, not only where the one before ended.
    #[serde(default)]
    pub all_pairs: bool,
    /// Measure the stretch along the reference instead of the estimate.
    #[serde(default)]
    pub pairs_from_reference: bool,
    /// Times of KITTI files; `None`: times.txt beside each.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<PathBuf>,
}

const fn no_alignment() -> Alignment {
    Alignment::None
}

const fn one() -> f64 {
    1.0
}

/// The document `vice.trajectory/1`.
#[derive(Clone, Debug, Serialize)]
pub struct TrajectoryDocument {
    /// The schema's name and version.
    pub schema: &'static str,
    /// What the estimate was compared with.
    pub reference: String,
    /// What was compared.
    pub estimate: String,
    /// Number of poses that were paired.
    pub matched: usize,
    /// The alignment.
    pub align: &'static str,
    /// Its scale.
    pub scale: f64,
    /// RMS of the position error, metres.
    pub rmse_3d_m: f64,
    /// RMS of the rotation error, radians.
    pub aoe_rad: f64,
    /// Mean rotation error between consecutive poses, radians.
    pub roe_rad: Option<f64>,
    /// Absolute pose errors.
    pub ape: Ape,
    /// Relative pose errors.
    pub rpe: Option<RpePart>,
    /// Why there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rpe_problem: Option<String>,
    /// What looks wrong in the files.
    #[serde(skip_serializing_if = "Suspicions::is_empty")]
    pub suspicions: Suspicions,
}

/// Relative pose errors, and the pairs that they are of.
#[derive(Clone, Debug, Serialize)]
pub struct RpePart {
    /// Stretch between the poses of a pair.
    pub delta: f64,
    /// What it is measured in.
    pub delta_unit: &'static str,
    /// Whether pairs start at every pose.
    pub all_pairs: bool,
    /// The errors.
    #[serde(flatten)]
    pub errors: Rpe,
}

/// Two trajectories, compared.
pub struct Compared {
    /// The document.
    pub document: TrajectoryDocument,
    /// Number of poses of the estimate.
    pub estimate_poses: usize,
    pairs: PosePairs,
    transform: ReferenceFromEstimate,
}

/// Compares two trajectories.
///
/// # Errors
/// [`RunError`] if a file cannot be read, no poses belong together, or they cannot be aligned.
pub fn compare_trajectories(request: &TrajectoryRequest) -> RunResult<Compared> {
    compare_in_memory(request, &InMemory::default())
}

/// The same, where a trajectory may be one that was handed over.
///
/// # Errors
/// As [`compare_trajectories`].
pub fn compare_in_memory(request: &TrajectoryRequest, memory: &InMemory) -> RunResult<Compared> {
    let delta =
        Delta::new(request.delta, request.delta_unit).map_err(|e| RunError::usage("delta", e.to_string()))?;
    let matching = request.matching()?;
    let Both { reference, estimate, mut suspicions } = request.read_both(memory)?;
    let name = |spec: &EstimateSpec| own_name(&spec.to_string()).to_string();
    let names = (name(&request.reference), name(&request.estimate));
    // As evo: what the reference no longer has is not matched either.
    let estimate_poses = estimate.len();
    let reference = match (request.t_start, request.t_end) {
        (None, None) => Ok(reference),
        (start, end) => crop(&reference, start, end).context(|| names.0.clone()),
    };
    let pairs = reference.and_then(|reference| {
        PosePairs::match_up_owned(reference, estimate, matching, request.t_offset)
            .context(|| format!("{} against {}", names.1, names.0))
    });
    // What was read may be why nothing fits.
    let mut pairs = pairs.inspect_err(|_| vice_files::leniency::log(&suspicions))?;
    suspicions.extend(suspected(&pairs, &names.1));
    let transform = align(&pairs, request.align, request.n_to_align)
        .context(|| format!("alignment {} of {}", request.align.name(), names.1))?;
    transform.apply_in_place(&mut pairs);
    if let Some(plane) = request.project_to_plane {
        pairs = plane.project_pairs(&pairs);
    }
    let summary = Summary::of(&pairs)?;
    let mode = if request.all_pairs { PairMode::All } else { PairMode::Consecutive };
    let pairs_from = if request.pairs_from_reference { PairsFrom::Reference } else { PairsFrom::Estimate };
    let options = RpeOptions { delta, mode, pairs_from };
    let (rpe, rpe_problem) = match RpeErrors::of(&pairs, &options).and_then(|e| e.statistics()) {
        Ok(errors) => (Some(errors), None),
        Err(error) => (None, Some(error.to_string())),
    };
    let rpe = rpe.map(|errors| RpePart {
        delta: request.delta,
        delta_unit: request.delta_unit.name(),
        all_pairs: request.all_pairs,
        errors,
    });
    let document = TrajectoryDocument {
        schema: "vice.trajectory/1",
        reference: names.0,
        estimate: names.1,
        matched: pairs.len(),
        align: request.align.name(),
        scale: transform.scale,
        rmse_3d_m: summary.rmse_3d_m,
        aoe_rad: summary.aoe_rad,
        roe_rad: summary.roe_rad,
        ape: ApeErrors::of(&pairs).statistics()?,
        rpe,
        rpe_problem,
        suspicions,
    };
    Ok(Compared { document, estimate_poses, pairs, transform })
}

/// A trajectory as it was read.
struct One {
    trajectory: Trajectory,
    suspicions: Suspicions,
    /// Rows without a clock, unless a file of times stands beside them.
    kitti: bool,
}

/// Both trajectories, and what looked wrong when they were read.
struct Both {
    reference: Trajectory,
    estimate: Trajectory,
    suspicions: Suspicions,
}

/// Another convention that fits the reference far better than the one that the estimate was read in.
fn suspected(pairs: &PosePairs, estimate: &str) -> Option<Suspicion> {
    quaternion_order::suspicion(pairs, estimate).or_else(|| {
        suspect(pairs, Given::default()).map(|found| Suspicion::new("convention", estimate, found.line()))
    })
}

impl TrajectoryRequest {
    /// All that is read.
    pub fn inputs(&self) -> Vec<PathBuf> {
        let specs = [&self.reference, &self.estimate];
        let file = |s: &&EstimateSpec| {
            let recorded = Recorded::of(s).ok().flatten().map(|r| r.data_set);
            recorded.or_else(|| s.path().map(PathBuf::from))
        };
        specs.iter().filter_map(file).chain(self.times.clone()).collect()
    }

    fn matching(&self) -> RunResult<Matching> {
        if !self.interpolate {
            return match self.max_gap {
                Some(_) => Err(RunError::usage("max-gap", "is the widest gap that is interpolated")
                    .advise("give `interpolate`, or leave it out")),
                None => Ok(Matching::Nearest { t_max_diff: self.t_max_diff.unwrap_or(DEFAULT_T_MAX_DIFF) }),
            };
        }
        if self.t_max_diff.is_some() {
            return Err(RunError::usage("t-max-diff", "is for the nearest pose, and poses are interpolated")
                .advise("see `max-gap`, or leave out `interpolate`"));
        }
        Ok(Matching::Interpolate { max_gap: self.max_gap.unwrap_or(crate::request::DEFAULT_MAX_GAP) })
    }

    /// Two KITTI files without times are compared row by row; one alone has no clock to compare by.
    fn read_both(&self, memory: &InMemory) -> RunResult<Both> {
        let read = |spec: &EstimateSpec, index_as_seconds| self.read(spec, index_as_seconds, memory);
        let (reference, estimate) =
            rayon::join(|| read(&self.reference, true), || read(&self.estimate, true));
        let (mut reference, mut estimate) = (reference?, estimate?);
        if self.times.is_some() && !reference.kitti && !estimate.kitti {
            return Err(RunError::usage(
                "times",
                "neither file is a KITTI file, so that these times are of nothing",
            ));
        }
        match (reference.kitti, estimate.kitti) {
            (true, false) => reference = read(&self.reference, false)?,
            (false, true) => estimate = read(&self.estimate, false)?,
            _ => {}
        }
        let mut suspicions = reference.suspicions;
        suspicions.extend(estimate.suspicions);
        let estimate = match self.estimate_as.as_slice() {
            [] => estimate.trajectory,
            meant => cure(meant, &estimate.trajectory, Given::default())
                .map_err(|e| RunError::from(e).of("estimate-as"))?,
        };
        Ok(Both { reference: reference.trajectory, estimate, suspicions })
    }

    fn read(&self, spec: &EstimateSpec, index_as_seconds: bool, memory: &InMemory) -> RunResult<One> {
        if let Some(recorded) = Recorded::of(spec)? {
            let (trajectory, suspicions) = recorded.read()?;
            return Ok(One { trajectory, suspicions, kitti: false });
        }
        if let Some(trajectory) = memory.trajectory(&spec.to_string())? {
            return Ok(One { trajectory: trajectory.clone(), suspicions: Suspicions::new(), kitti: false });
        }
        let read = spec.read_file(&ReadOptions { times: self.times.clone(), index_as_seconds })?;
        let kitti = read.format == TrajectoryFormat::Kitti;
        Ok(One { trajectory: read.trajectory, suspicions: read.suspicions, kitti })
    }
}

impl Compared {
    /// Both paths from above and their differences over time, as SVG.
    pub fn plot(&self) -> String {
        plot::file(&[(&self.pairs, &self.document.estimate)], &self.document.reference)
    }

    /// The APE of translations as an archive that evo's `evo_res` reads.
    ///
    /// # Errors
    /// [`RunError`] if the archive cannot be made.
    pub fn evo_zip(&self) -> RunResult<Vec<u8>> {
        let about = About {
            reference: &self.document.reference,
            estimate: &self.document.estimate,
            align: self.document.align,
            transform: &self.transform,
        };
        evo_zip::encode(&self.pairs, &about)
    }

    /// The numbers as a table. Angles in radians, or in degrees.
    pub fn table(&self, degrees: bool) -> String {
        render(&self.document, self.estimate_poses, degrees)
    }
}

fn render(d: &TrajectoryDocument, estimate_poses: usize, degrees: bool) -> String {
    let unit = if degrees { "deg" } else { "rad" };
    let angle = |v: f64| if degrees { v.to_degrees() } else { v };
    let roe = d.roe_rad.map_or_else(|| "-".to_string(), |v| format!("{:.4}", angle(v)));
    let mut text = format!(
        "matched {} of {estimate_poses} poses, align {}{}\nRMSE_3D {:.4} m, AOE {:.4} {unit}, ROE {roe} {unit}\n\n",
        d.matched,
        d.align,
        if d.scale == 1.0 { String::new() } else { format!(", scale {:.6}", d.scale) },
        d.rmse_3d_m,
        angle(d.aoe_rad),
    );
    let mut grid = vec![["error", "rmse", "mean", "median", "std", "min", "max"].map(String::from).to_vec()];
    let mut add = |name: String, s: &Statistics, as_angle: bool| {
        let numbers = [s.rmse, s.mean, s.median, s.std, s.min, s.max];
        let numbers = numbers.map(|v| if as_angle { angle(v) } else { v });
        grid.push(std::iter::once(name).chain(numbers.map(|v| format!("{v:.6}"))).collect());
    };
    add("APE translation m".to_string(), &d.ape.translation_m, false);
    add(format!("APE rotation {unit}"), &d.ape.rotation_rad, true);
    if let Some(rpe) = &d.rpe {
        let pairs = format!("{} {}, {} pairs", rpe.delta, rpe.delta_unit, rpe.errors.pairs);
        add(format!("RPE translation m ({pairs})"), &rpe.errors.translation_m, false);
        add(format!("RPE rotation {unit}"), &rpe.errors.rotation_rad, true);
    }
    text.push_str(&table::align(&grid));
    if let Some(problem) = &d.rpe_problem {
        text.push_str(&format!("no RPE: {problem}\n"));
    }
    text
}
