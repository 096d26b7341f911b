//! Trajectories against each other.

use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use vice_run::core::metrics::align::{Alignment, ReferenceFromEstimate, align};
use vice_run::core::metrics::associate::{Matching, PosePairs};
use vice_run::core::metrics::rpe::{Delta, DeltaUnit, PairMode, PairsFrom, RpeErrors, RpeOptions};
use vice_run::core::metrics::trajectory::{ApeErrors, Statistics, Summary};
use vice_run::core::time::Span;
use vice_run::error::RunResult;
use vice_run::in_memory::InMemory;
use vice_run::trajectory::{TrajectoryRequest, compare_in_memory};

use crate::arrays::array_of;
use crate::document::Document;
use crate::errors::{Answer, OfPython, usage};
use crate::poses::Trajectory;
use crate::work::long;

/// How poses are paired and aligned.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Pairing {
    align: String,
    n_to_align: Option<usize>,
    t_max_diff: f64,
    t_offset: f64,
}

impl Pairing {
    fn pairs(
        self,
        reference: &Trajectory,
        estimate: &Trajectory,
    ) -> Answer<impl FnOnce() -> RunResult<(PosePairs, ReferenceFromEstimate)> + Send + 'static> {
        let how: Alignment = self
            .align
            .parse()
            .map_err(|e: <Alignment as std::str::FromStr>::Err| usage("align", e.to_string()))?;
        let matching = Matching::Nearest { t_max_diff: Span::from_secs_f64(self.t_max_diff)? };
        let offset = Span::from_secs_f64(self.t_offset)?;
        let (reference, estimate) = (reference.core.clone(), estimate.core.clone());
        Ok(move || {
            let pairs = PosePairs::match_up(&reference, &estimate, matching, offset)?;
            let transform = align(&pairs, how, self.n_to_align)?;
            Ok((transform.apply_to(&pairs), transform))
        })
    }
}

fn statistics<'py>(
    py: Python<'py>,
    s: &Statistics,
    errors: Bound<'py, PyArray1<f64>>,
) -> PyResult<Bound<'py, PyDict>> {
    let values = PyDict::new(py);
    let numbers = [
        ("rmse", s.rmse),
        ("mean", s.mean),
        ("median", s.median),
        ("std", s.std),
        ("min", s.min),
        ("max", s.max),
        ("sse", s.sse),
    ];
    for (name, value) in numbers {
        values.set_item(name, value)?;
    }
    values.set_item("errors", errors)?;
    Ok(values)
}

/// Absolute pose errors.
#[pyfunction]
pub(crate) fn ape<'py>(
    py: Python<'py>,
    reference: &Trajectory,
    estimate: &Trajectory,
    pairing: Pairing,
) -> Answer<Bound<'py, PyDict>> {
    let pairs = pairing.pairs(reference, estimate)?;
    let (pairs, transform, errors, all, summary) = long(py, None, move |_| {
        let (pairs, transform) = pairs()?;
        let errors = ApeErrors::of(&pairs);
        let (all, summary) = (errors.statistics()?, Summary::of(&pairs)?);
        Ok((pairs, transform, errors, all, summary))
    })?;
    let values = PyDict::new(py);
    let array = |numbers: Vec<f64>| array_of(py, numbers.into_iter());
    let set = || -> PyResult<()> {
        values.set_item("matched", pairs.len())?;
        values.set_item("scale", transform.scale)?;
        values.set_item("timestamp_ns", array_of(py, pairs.stamps().iter().map(|s| s.as_nanos())))?;
        values.set_item("translation_m", statistics(py, &all.translation_m, array(errors.translation_m))?)?;
        values.set_item("rotation_rad", statistics(py, &all.rotation_rad, array(errors.rotation_rad))?)?;
        values.set_item("full", statistics(py, &all.full, array(errors.full))?)?;
        values.set_item("rmse_3d_m", summary.rmse_3d_m)?;
        values.set_item("aoe_rad", summary.aoe_rad)?;
        values.set_item("roe_rad", summary.roe_rad)
    };
    set().python()?;
    Ok(values)
}

/// Relative pose errors.
#[pyfunction]
#[allow(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn rpe<'py>(
    py: Python<'py>,
    reference: &Trajectory,
    estimate: &Trajectory,
    pairing: Pairing,
    delta: f64,
    delta_unit: &str,
    all_pairs: bool,
    pairs_from_reference: bool,
) -> Answer<Bound<'py, PyDict>> {
    let unit: DeltaUnit = delta_unit
        .parse()
        .map_err(|e: <DeltaUnit as std::str::FromStr>::Err| usage("delta_unit", e.to_string()))?;
    let options = RpeOptions {
        delta: Delta::new(delta, unit)?,
        mode: if all_pairs { PairMode::All } else { PairMode::Consecutive },
        pairs_from: if pairs_from_reference { PairsFrom::Reference } else { PairsFrom::Estimate },
    };
    let pairs = pairing.pairs(reference, estimate)?;
    let (pairs, errors, all) = long(py, None, move |_| {
        let (pairs, _) = pairs()?;
        let errors = RpeErrors::of(&pairs, &options)?;
        let all = errors.statistics()?;
        Ok((pairs, errors, all))
    })?;
    let ends = array_of(
        py,
        errors.pairs.iter().map(|(_, to)| pairs.stamps()[*to].as_nanos()).collect::<Vec<_>>().into_iter(),
    );
    let values = PyDict::new(py);
    let array = |numbers: Vec<f64>| array_of(py, numbers.into_iter());
    let set = || -> PyResult<()> {
        values.set_item("pairs", all.pairs)?;
        values.set_item("timestamp_ns", ends)?;
        values.set_item("translation_m", statistics(py, &all.translation_m, array(errors.translation_m))?)?;
        values.set_item("rotation_rad", statistics(py, &all.rotation_rad, array(errors.rotation_rad))?)
    };
    set().python()?;
    Ok(values)
}

/// What `vice trajectory` finds, of files or of trajectories.
#[pyfunction]
pub(crate) fn compare_trajectories(
    py: Python<'_>,
    reference: &Bound<'_, PyAny>,
    estimate: &Bound<'_, PyAny>,
    request: &str,
) -> Answer<Document> {
    let mut memory = InMemory::default();
    let mut value: serde_json::Value = serde_json::from_str(request)?;
    for (field, given) in [("reference", reference), ("estimate", estimate)] {
        let name = match given.cast::<Trajectory>() {
            Ok(trajectory) => memory.add_trajectory(field, trajectory.get().core.as_ref().clone()),
            Err(_) => {
                given.cast::<PyString>().map_or_else(|_| given.str(), |s| Ok(s.clone())).python()?.to_string()
            }
        };
        value[field] = name.into();
    }
    let request: TrajectoryRequest =
        serde_json::from_value(value).map_err(|e| usage("request", e.to_string()))?;
    let (document, table, plot, archive) = long(py, None, move |_| {
        let compared = compare_in_memory(&request, &memory)?;
        let json = serde_json::to_string(&compared.document)?;
        Ok((json, compared.table(false), compared.plot(), compared.evo_zip()?))
    })?;
    Ok(Document::new(document + "\n", table).with("svg", plot.into_bytes()).with("zip", archive))
}
