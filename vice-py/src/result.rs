//! Results of evaluations.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyType;
use vice_run::core::result::{PixelPart, Role, Sample};
use vice_run::core::suspicion::Suspicion;
use vice_run::error::RunError;
use vice_run::files::atomic::{self, Overwrite};
use vice_run::open::Opened;
use vice_run::report::assessment::Assessment;
use vice_run::report::comparison::{self, By};
use vice_run::report::frames::Shots;
use vice_run::report::html::{IMAGE_BUDGET_BYTES, Run, render};
use vice_run::report::{csv, latex, table};
use vice_run::require::{Requirement, broken};
use vice_run::result::{ResultDocument, check_unmixed, read};

use crate::document::{Document, loads, write};
use crate::errors::{Answer, OfPython, missing, usage};
use crate::recording::Recording;
use crate::table::{Table, integers, numbers, numbers_or_null, words};
use crate::work::{long, short};

/// What an evaluation found, and all that is needed to repeat and to plot it: the document ``vice.result/2``.
#[pyclass(frozen, name = "Result", module = "vicepose")]
pub(crate) struct Outcome {
    document: Arc<ResultDocument>,
    /// What was evaluated, where this result is of this process.
    opened: Option<Opened>,
}

impl Outcome {
    pub(crate) fn new(document: ResultDocument, opened: Option<Opened>) -> Self {
        Self { document: Arc::new(document), opened }
    }

    /// The parts that names choose. A name that is both an estimate and the reference means the estimate.
    fn parts(
        &self,
        stream: Option<&str>,
        depth: Option<&str>,
        role: Option<&str>,
    ) -> Answer<Vec<&PixelPart>> {
        let role = match role {
            None => None,
            Some("estimate") => Some(Role::Estimate),
            Some("reference") => Some(Role::Reference),
            Some(other) => return Err(usage("role", format!("`{other}` is none of estimate, reference"))),
        };
        let of = |role: Option<Role>| -> Vec<&PixelPart> {
            let named = |given: Option<&str>, name: &str| given.is_none_or(|g| g == name);
            let parts = self.document.pixel.iter();
            parts
                .filter(|p| {
                    named(stream, &p.stream) && named(depth, &p.depth) && role.is_none_or(|r| p.role == r)
                })
                .collect()
        };
        let mut found = of(role);
        if stream.is_some() && role.is_none() && found.iter().any(|p| p.role == Role::Estimate) {
            found = of(Some(Role::Estimate));
        }
        if found.is_empty() {
            let there: Vec<String> =
                self.document.pixel.iter().map(|p| format!("{} with {}", p.stream, p.depth)).collect();
            let asked = format!("{} with {}", stream.unwrap_or("any stream"), depth.unwrap_or("any depth"));
            return Err(missing(format!("the result has no {asked}; it has {}", there.join(", "))));
        }
        Ok(found)
    }
}

const fn role_name(role: Role) -> &'static str {
    match role {
        Role::Reference => "reference",
        Role::Estimate => "estimate",
    }
}

#[pymethods]
impl Outcome {
    /// A result from a file, as ``to_json`` and ``vice evaluate --json`` write it.
    #[classmethod]
    #[pyo3(name = "read")]
    fn from_file(_: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf) -> Answer<Self> {
        long(py, None, move |_| Ok(read(&path)?)).map(|document| Self::new(document, None))
    }

    /// A result from the text of its document.
    #[classmethod]
    fn from_json(_: &Bound<'_, PyType>, text: &str) -> Answer<Self> {
        let document = serde_json::from_str(text).map_err(|e| {
            RunError::new(vice_run::core::error::ErrorKind::Corrupt, "is no result document").because(e)
        })?;
        Ok(Self::new(document, None))
    }

    /// Name of the data set.
    #[getter]
    fn name(&self) -> String {
        self.document.dataset.name.clone()
    }

    /// Names of the pose streams, the reference first.
    #[getter]
    fn streams(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for part in &self.document.pixel {
            if !names.contains(&part.stream) {
                names.push(part.stream.clone());
            }
        }
        names
    }

    /// Names of the depth sources.
    #[getter]
    fn depths(&self) -> Vec<String> {
        let mut names: Vec<String> = Vec::new();
        for part in &self.document.pixel {
            if !names.contains(&part.depth) {
                names.push(part.depth.clone());
            }
        }
        names
    }

    /// Largest share of labels of a stream that could not be scored, percent.
    #[getter]
    fn skipped_percent(&self) -> f64 {
        self.document.worst_skipped_percent()
    }

    /// What looked wrong in the data but did not stop the evaluation, a line each.
    #[getter]
    fn suspicions(&self) -> Vec<String> {
        self.document.suspicions.iter().map(Suspicion::line).collect()
    }

    /// A row for each pose stream with each depth source. ``rmse_px`` with ``low_95_px`` and ``high_95_px`` is of the
    /// labels that hold, ``pooled_px`` of all; ``scored`` and ``skipped`` count labels; ``rmse_3d_m``, ``aoe_rad``,
    /// ``roe_rad`` and ``poses`` are of an estimate against the reference. NaN where a number could not be had.
    fn table(&self) -> Answer<Table> {
        let parts = &self.document.pixel;
        let of_estimate = |p: &PixelPart, estimate: &str| p.role == Role::Estimate && estimate == p.stream;
        let trajectory =
            |p: &PixelPart| self.document.trajectory.iter().find(|t| of_estimate(p, &t.estimate));
        let number = |f: &dyn Fn(&PixelPart) -> Option<f64>| numbers_or_null(parts.iter().map(f));
        let integer = |n: usize| i64::try_from(n).unwrap_or(i64::MAX);
        Table::new(vec![
            ("stream", words(parts.iter().map(|p| p.stream.as_str()))),
            ("role", words(parts.iter().map(|p| role_name(p.role)))),
            ("depth", words(parts.iter().map(|p| p.depth.as_str()))),
            ("rmse_px", number(&|p| p.held_rmse_px)),
            ("low_95_px", number(&|p| p.interval_95.map(|i| i[0]))),
            ("high_95_px", number(&|p| p.interval_95.map(|i| i[1]))),
            ("pooled_px", number(&|p| p.pooled_rmse_px)),
            ("rmse_mrad", number(&|p| p.held.as_ref()?.mrad.map(|f| f.rmse))),
            ("rmse_mm", number(&|p| p.held.as_ref()?.mm.map(|f| f.rmse))),
            ("scored", integers(parts.iter().map(|p| i64::try_from(p.scored).unwrap_or(i64::MAX)))),
            ("skipped", integers(parts.iter().map(|p| integer(p.skipped.len())))),
            ("rmse_3d_m", number(&|p| trajectory(p)?.rmse_3d_m)),
            ("aoe_rad", number(&|p| trajectory(p)?.aoe_rad)),
            ("roe_rad", number(&|p| trajectory(p)?.roe_rad)),
            ("poses", integers(parts.iter().map(|p| trajectory(p).map_or(0, |t| integer(t.matched))))),
        ])
    }

    /// The scored labels of a pose stream with a depth source, or of all: ``point``, ``timestamp_ns``, the label and the
    /// carried point in pixels, and their distance ``error_px``. A name that is both an estimate and the reference means
    /// the estimate, unless ``role`` is ``reference``.
    #[pyo3(signature = (stream = None, depth = None, role = None))]
    fn samples(&self, stream: Option<&str>, depth: Option<&str>, role: Option<&str>) -> Answer<Table> {
        let rows: Vec<(&PixelPart, &Sample)> = self
            .parts(stream, depth, role)?
            .into_iter()
            .flat_map(|p| p.samples.iter().map(move |s| (p, s)))
            .collect();
        Table::new(vec![
            ("stream", words(rows.iter().map(|r| r.0.stream.as_str()))),
            ("role", words(rows.iter().map(|r| role_name(r.0.role)))),
            ("depth", words(rows.iter().map(|r| r.0.depth.as_str()))),
            ("point", words(rows.iter().map(|r| &*r.1.point.0))),
            ("timestamp_ns", integers(rows.iter().map(|r| r.1.timestamp_ns.as_nanos()))),
            ("label_u_px", numbers(rows.iter().map(|r| r.1.label_px.u))),
            ("label_v_px", numbers(rows.iter().map(|r| r.1.label_px.v))),
            ("tracked_u_px", numbers(rows.iter().map(|r| r.1.tracked_px.u))),
            ("tracked_v_px", numbers(rows.iter().map(|r| r.1.tracked_px.v))),
            ("error_px", numbers(rows.iter().map(|r| r.1.error_px))),
        ])
    }

    /// A sentence for each limit that is not kept, such as ``rmse_2d<2px``, ``age5s<3px``, ``moved1m<40mm``: those of
    /// ``vice evaluate --require``. Empty where all are kept.
    #[pyo3(signature = (*limits))]
    fn broken(&self, limits: Vec<String>) -> Answer<Vec<String>> {
        let parsed = limits.iter().map(|text| text.parse::<Requirement>().map_err(|e| usage("limits", e)));
        Ok(broken(&parsed.collect::<Answer<Vec<_>>>()?, &self.document.pixel))
    }

    /// The whole document as a dictionary.
    fn document<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyAny>> {
        loads(py, &serde_json::to_string(self.document.as_ref())?).python()
    }

    /// Writes the document, with the bytes of ``vice evaluate --json``; without a path its text is returned.
    #[pyo3(signature = (path = None))]
    fn to_json(&self, py: Python<'_>, path: Option<PathBuf>) -> Answer<Option<String>> {
        let document = Arc::clone(&self.document);
        long(py, None, move |_| {
            let Some(path) = path else { return Ok(Some(serde_json::to_string(document.as_ref())? + "\n")) };
            atomic::write(path, Overwrite::Replace, |out| {
                serde_json::to_writer(&mut *out, document.as_ref())?;
                out.write_all(b"\n")
            })?;
            Ok(None)
        })
    }

    /// The table as ``vice evaluate --csv`` writes it; without a path its text is returned.
    #[pyo3(signature = (path = None))]
    fn to_csv(&self, py: Python<'_>, path: Option<PathBuf>) -> Answer<Option<String>> {
        given_or_written(short(py, || csv::render(&self.document))?, path)
    }

    /// The table as ``vice evaluate --latex`` writes it; without a path its text is returned.
    #[pyo3(signature = (path = None))]
    fn to_latex(&self, py: Python<'_>, path: Option<PathBuf>) -> Answer<Option<String>> {
        given_or_written(short(py, || latex::render(&self.document))?, path)
    }

    /// Writes the page with the answers, the table, plots and images, with the bytes of ``vice evaluate --report``. The
    /// images are read from the run that was evaluated; of a result that was read from a file, from ``run`` or from where
    /// it says.
    #[pyo3(signature = (path, run = None, progress = None, diagnosis = true))]
    fn report(
        &self,
        py: Python<'_>,
        path: PathBuf,
        run: Option<&Recording>,
        progress: Option<Py<PyAny>>,
        diagnosis: bool,
    ) -> Answer<()> {
        let document = Arc::clone(&self.document);
        let given = run.map(|run| Arc::clone(&run.dataset));
        let before = self.opened.clone();
        let page = long(py, progress.as_ref(), move |progress| {
            let request = &document.request;
            let opened = match (given, before) {
                (Some(dataset), before) => request.dataset.apply_to(dataset).map(|mut opened| {
                    opened.in_memory = before.map(|b| b.in_memory).unwrap_or_default();
                    opened
                }),
                (None, Some(before)) => Ok(before),
                (None, None) => request.dataset.open(),
            };
            let (shots, assessment) = match opened {
                Ok(opened) => {
                    let shots =
                        Shots::of(&document, opened.dataset.as_ref(), IMAGE_BUDGET_BYTES, &|done, total| {
                            progress("reading images", done, total)
                        });
                    let assessment = match diagnosis {
                        true => request.assess(&opened, progress),
                        false => Assessment::not_run("no diagnosis was asked for (`--no-diagnosis`)"),
                    };
                    (shots, assessment)
                }
                Err(error) => {
                    let why = error.to_string();
                    let assessment = Assessment::not_run(format!("no diagnosis could be made: {why}"));
                    (Shots::missing(why), assessment)
                }
            };
            render(&[Run::new(document.as_ref().clone(), shots, assessment)])
        })?;
        write(&path, page.as_bytes())
    }

    /// Plots on the caller's axes: see :class:`vicepose.plot.Plots`.
    #[getter]
    fn plot<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("vicepose.plot")?.call_method1("Plots", (slf,))
    }

    fn __str__(&self, py: Python<'_>) -> Answer<String> {
        short(py, || Ok(table::render(&self.document)))
    }

    fn __repr__(&self, py: Python<'_>) -> Answer<String> {
        Ok(self.__str__(py)?.trim_end().to_string())
    }

    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("vicepose._html")?.call_method1("of_result", (slf,))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Option<String>,))> {
        let text = slf.get().to_json(slf.py(), None)?;
        Ok((slf.get_type().getattr("from_json")?, (text,)))
    }
}

fn given_or_written(text: String, path: Option<PathBuf>) -> Answer<Option<String>> {
    match path {
        None => Ok(Some(text)),
        Some(path) => write(&path, text.as_bytes()).map(|()| None),
    }
}

/// Holds results side by side, label by label.
#[pyfunction]
#[pyo3(signature = (results, by = None, seed = 1))]
pub(crate) fn compare(
    py: Python<'_>,
    results: Vec<(String, PyRef<'_, Outcome>)>,
    by: Option<&str>,
    seed: u64,
) -> Answer<Document> {
    let runs: Vec<_> = results.iter().map(|(name, r)| (name.clone(), r.document.as_ref().clone())).collect();
    check_unmixed(runs.iter().map(|(_, document)| document))?;
    let by = match by {
        Some(by) => by.parse::<By>().map_err(|e| usage("by", e))?,
        None => By::usual(&runs),
    };
    long(py, None, move |_| {
        let warnings = std::cell::RefCell::new(Vec::new());
        let document = comparison::Document::of(&runs, by, seed, &|text| warnings.borrow_mut().push(text));
        if document.comparisons.is_empty() {
            return Err(RunError::usage(
                "results",
                "there is nothing to compare: they share no scored label of a stream and depth source",
            ));
        }
        let json = serde_json::to_string(&document)? + "\n";
        Ok(Document::new(json, comparison::text(&document))
            .with("csv", comparison::csv(&document)?.into_bytes())
            .with("tex", comparison::latex(&document)?.into_bytes())
            .suspecting(warnings.into_inner()))
    })
}
