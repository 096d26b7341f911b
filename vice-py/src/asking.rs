//! From the arguments of a call to a request, and to what it finds.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyString;
use vice_run::Samples;
use vice_run::core::dataset::Dataset;
use vice_run::core::suspicion::{Suspicion, Suspicions};
use vice_run::diagnosis::{Looking, diagnose_all, sensitivity_of};
use vice_run::error::{RunError, RunResult};
use vice_run::in_memory::InMemory;
use vice_run::open::Opened;
use vice_run::report::{diagnosis_text, sensitivity_plot, sensitivity_text};
use vice_run::request::{DatasetSpec, EstimateSpec, ReferenceSpec, Request};
use vice_run::streams::plain_name;

use crate::document::Document;
use crate::errors::{Answer, OfPython, usage};
use crate::labels::Labels;
use crate::poses::Trajectory;
use crate::recording::Recording;
use crate::result::Outcome;
use crate::work::long;

/// A request with the data that it names without files.
struct Asked {
    request: Request,
    dataset: Arc<dyn Dataset>,
    memory: InMemory,
}

impl Asked {
    fn new(
        run: &Recording,
        labels: &Bound<'_, PyAny>,
        estimates: &[(Option<String>, Bound<'_, PyAny>)],
        reference: Option<&Bound<'_, PyAny>>,
        request: &str,
    ) -> Answer<Self> {
        let mut value: serde_json::Value = serde_json::from_str(request)?;
        // The run says where it is; the call may only override parts of it.
        value["dataset"]["path"] = "".into();
        let mut request: Request =
            serde_json::from_value(value).map_err(|e| usage("request", e.to_string()))?;
        let over = request.dataset;
        request.dataset = DatasetSpec {
            camera: over.camera.clone().or_else(|| run.spec.camera.clone()),
            path: run.spec.path.clone(),
            format: run.spec.format.clone(),
            set: run.spec.set.clone(),
            plugins: run.spec.plugins.clone(),
            ..over
        };
        let mut memory = InMemory::default();
        request.labels.file = match labels.cast::<Labels>() {
            Ok(labels) => memory.add_labels(labels.get().core.as_ref().clone()),
            Err(_) => labels.extract::<PathBuf>().python()?,
        };
        let mut names = Vec::new();
        for (name, given) in estimates {
            let spec = spec_of(&mut memory, name.as_deref(), given)?;
            names.push(name.clone().unwrap_or_else(|| plain_name(&spec)));
            request.streams.estimates.push(spec);
        }
        // Names that they have anyhow are not said, as on a command line.
        if names.iter().zip(&request.streams.estimates).any(|(name, spec)| *name != plain_name(spec)) {
            request.streams.names = names;
        }
        if let Some(reference) = reference {
            request.streams.reference = match reference.extract::<&str>().ok() {
                Some("none") => ReferenceSpec::None,
                _ => ReferenceSpec::Named(spec_of(&mut memory, Some("reference"), reference)?),
            };
        }
        request.check()?;
        Ok(Self { request, dataset: Arc::clone(&run.dataset), memory })
    }

    fn open(&self) -> RunResult<Opened> {
        let mut opened = self.request.dataset.apply_to(Arc::clone(&self.dataset))?;
        opened.in_memory = self.memory.clone();
        Ok(opened)
    }
}

/// A trajectory in memory, or the text that names a stream or file.
fn spec_of(memory: &mut InMemory, name: Option<&str>, given: &Bound<'_, PyAny>) -> Answer<EstimateSpec> {
    if let Ok(trajectory) = given.cast::<Trajectory>() {
        let name = name.unwrap_or("estimate");
        return Ok(EstimateSpec::from(memory.add_trajectory(name, trajectory.get().core.as_ref().clone())));
    }
    if let Ok(text) = given.cast::<PyString>() {
        return Ok(EstimateSpec::from(text.to_string()));
    }
    let path = given.extract::<PathBuf>();
    let path =
        path.map_err(|_| usage("estimates", "a Trajectory, or the name of a stream or file, is expected"))?;
    Ok(EstimateSpec::from(path.display().to_string()))
}

fn lines(suspicions: &Suspicions) -> Vec<String> {
    suspicions.iter().map(Suspicion::line).collect()
}

/// Evaluates estimates of a run at labels.
#[pyfunction]
#[pyo3(signature = (run, labels, estimates, reference, request, samples = true, progress = None))]
#[allow(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn evaluate(
    py: Python<'_>,
    run: &Recording,
    labels: &Bound<'_, PyAny>,
    estimates: Vec<(Option<String>, Bound<'_, PyAny>)>,
    reference: Option<&Bound<'_, PyAny>>,
    request: &str,
    samples: bool,
    progress: Option<Py<PyAny>>,
) -> Answer<Outcome> {
    let asked = Asked::new(run, labels, &estimates, reference, request)?;
    let (document, opened) = long(py, progress.as_ref(), move |progress| {
        let opened = asked.open()?;
        let samples = if samples { Samples::Keep } else { Samples::Drop };
        let mut document = asked.request.evaluate(&opened, samples, progress)?;
        if document.pixel.iter().all(|part| part.samples.is_empty()) {
            document.drop_samples();
        }
        Ok((document, opened))
    })?;
    Ok(Outcome::new(document, Some(opened)))
}

/// Evaluates what a request in a file, or that of a result document, asks for.
#[pyfunction]
#[pyo3(signature = (path, progress = None))]
pub(crate) fn evaluate_request(
    py: Python<'_>,
    path: PathBuf,
    progress: Option<Py<PyAny>>,
) -> Answer<Outcome> {
    let (document, opened) = long(py, progress.as_ref(), move |progress| {
        let request = Request::read(&path)?;
        let opened = request.open()?;
        Ok((request.evaluate(&opened, Samples::Keep, progress)?, opened))
    })?;
    Ok(Outcome::new(document, Some(opened)))
}

/// Finds the flaw that explains the pixel errors of one estimate with one depth source.
#[pyfunction]
#[pyo3(signature = (run, labels, estimate, reference, request, looking, progress = None))]
#[allow(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn diagnose(
    py: Python<'_>,
    run: &Recording,
    labels: &Bound<'_, PyAny>,
    estimate: (Option<String>, Bound<'_, PyAny>),
    reference: Option<&Bound<'_, PyAny>>,
    request: &str,
    looking: &str,
    progress: Option<Py<PyAny>>,
) -> Answer<Document> {
    let asked = Asked::new(run, labels, &[estimate], reference, request)?;
    let looking: Looking = serde_json::from_str(looking).map_err(|e| usage("flaws", e.to_string()))?;
    long(py, progress.as_ref(), move |progress| {
        let answers = diagnose_all(&asked.request, &asked.open()?, &looking, progress)?;
        let suspicions = lines(&answers.suspicions);
        let mut list = answers.list.into_iter();
        let (Some(answer), None) = (list.next(), list.next()) else {
            return Err(RunError::usage("depth", "a diagnosis is of one estimate with one depth source"));
        };
        let (result, calibration) = answer.outcome?;
        let calibration =
            calibration.map(|file| file.to_toml().into_bytes()).map_err(|e| e.problem().to_string());
        let text = diagnosis_text::render(&result.diagnosis);
        let json = serde_json::to_string(&result)? + "\n";
        Ok(Document::new(json, text).with_or_why("toml", calibration).suspecting(suspicions))
    })
}

/// How RMSE_2D of one estimate answers to each flaw.
#[pyfunction]
#[pyo3(signature = (run, labels, estimate, reference, request, looking, progress = None))]
#[allow(clippy::too_many_arguments, reason = "arguments by name in Python")]
pub(crate) fn sensitivity(
    py: Python<'_>,
    run: &Recording,
    labels: &Bound<'_, PyAny>,
    estimate: (Option<String>, Bound<'_, PyAny>),
    reference: Option<&Bound<'_, PyAny>>,
    request: &str,
    looking: &str,
    progress: Option<Py<PyAny>>,
) -> Answer<Document> {
    let asked = Asked::new(run, labels, &[estimate], reference, request)?;
    let looking: Looking = serde_json::from_str(looking).map_err(|e| usage("flaws", e.to_string()))?;
    long(py, progress.as_ref(), move |progress| {
        let (document, suspicions) = sensitivity_of(&asked.request, &asked.open()?, &looking, progress)?;
        let json = serde_json::to_string(&document)? + "\n";
        let csv = sensitivity_text::csv(&document)?;
        Ok(Document::new(json, sensitivity_text::render(&document))
            .with("csv", csv.into_bytes())
            .with("svg", sensitivity_plot::draw(&document).into_bytes())
            .suspecting(lines(&suspicions)))
    })
}
