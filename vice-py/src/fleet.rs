//! Many flights by one manifest.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use pyo3::prelude::*;
use vice_run::batch::FleetTable as Table;
use vice_run::batch::collect::{Format as FileFormat, collect as collect_store};
use vice_run::batch::fleet_table::Format;
use vice_run::batch::scan::scan as scan_folder;
use vice_run::batch::{Keep, Manifest, Options, Shard, State, Store, plan as plan_batch, run as run_batch};
use vice_run::files::tables::HAS_PARQUET;

use crate::errors::{Answer, OfPython, usage};
use crate::work::{long, stoppable};

/// How it stands with the runs of a batch.
#[pyclass(frozen, get_all, module = "vicepose")]
pub(crate) struct Batch {
    /// Folder of the results.
    folder: PathBuf,
    /// Runs of this part.
    total: usize,
    /// Evaluated now.
    done: usize,
    /// Were there.
    skipped: usize,
    /// Went wrong.
    failed: usize,
    /// (run_id, why) of those that went wrong.
    errors: Vec<(String, String)>,
}

#[pymethods]
impl Batch {
    /// The results as the paper's table.
    fn table(&self, py: Python<'_>) -> Answer<FleetTable> {
        table(py, self.folder.clone())
    }

    fn __repr__(&self) -> String {
        let Self { total, done, skipped, failed, .. } = self;
        format!(
            "<vicepose.Batch in {}: {total} runs, {done} evaluated, {skipped} were there, {failed} failed>",
            self.folder.display()
        )
    }
}

fn shard_of(text: &str) -> Answer<Shard> {
    text.parse().map_err(|e: String| usage("shard", e))
}

const fn keep(samples: bool, reports: bool) -> Keep {
    Keep { samples: samples && HAS_PARQUET, reports }
}

/// Evaluates what is not there yet.
#[pyfunction]
#[pyo3(signature = (manifest, out, jobs = None, shard = "1/1", retry = 0, progress = None, samples = true, reports = false))]
#[allow(clippy::too_many_arguments, reason = "keywords of a Python function")]
pub(crate) fn batch(
    py: Python<'_>,
    manifest: PathBuf,
    out: PathBuf,
    jobs: Option<usize>,
    shard: &str,
    retry: usize,
    progress: Option<Py<PyAny>>,
    samples: bool,
    reports: bool,
) -> Answer<Batch> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let keep = keep(samples, reports);
    let options = Options { jobs: jobs.unwrap_or(cores).max(1), shard: shard_of(shard)?, retry, keep };
    let folder = out.clone();
    let (summary, errors) = stoppable(py, progress.as_ref(), move |told| {
        let manifest = Manifest::read(&manifest)?;
        let errors = std::sync::Mutex::new(Vec::new());
        let summary = run_batch(&manifest, &Store::new(&out), &options, told.stop(), &|event| {
            if let (State::Failed, Some(error), Ok(mut errors)) =
                (event.state, &event.record.error, errors.lock())
            {
                errors.push((event.record.run_id.clone(), error.clone()));
            }
            told.tell("runs", event.summary.ended(), event.summary.total);
        })?;
        told.stop().store(false, Ordering::SeqCst);
        let mut errors = errors.into_inner().unwrap_or_default();
        errors.sort();
        Ok((summary, errors))
    })?;
    let (total, done, skipped, failed) = (summary.total, summary.done, summary.skipped, summary.failed);
    Ok(Batch { folder, total, done, skipped, failed, errors })
}

/// What a batch would do: (run_id, key or None, whether its result is there, why it cannot be run).
#[pyfunction]
#[pyo3(signature = (manifest, out, shard = "1/1", samples = true, reports = false))]
#[allow(clippy::type_complexity, reason = "a row of a table")]
pub(crate) fn plan(
    py: Python<'_>,
    manifest: PathBuf,
    out: PathBuf,
    shard: &str,
    samples: bool,
    reports: bool,
) -> Answer<Vec<(String, Option<String>, bool, Option<String>)>> {
    let shard = shard_of(shard)?;
    long(py, None, move |_| {
        let manifest = Manifest::read(&manifest)?;
        let planned = plan_batch(&manifest, &Store::new(&out), shard, keep(samples, reports));
        let row = |p: &vice_run::batch::Planned<'_>| {
            let (key, why) = match &p.key {
                Ok(key) => (Some(key.to_string()), None),
                Err(why) => (None, Some(why.clone())),
            };
            (p.row.run_id.clone(), key, p.is_there, why)
        };
        Ok(planned.iter().map(row).collect())
    })
}

/// Writes tables into the folder of a batch. Gives (rows, failed, not tried yet).
#[pyfunction]
#[pyo3(signature = (folder, formats, samples = false))]
pub(crate) fn collect(
    py: Python<'_>,
    folder: PathBuf,
    formats: Vec<String>,
    samples: bool,
) -> Answer<(usize, usize, usize)> {
    let format = |name: &String| match name.as_str() {
        "csv" => Ok(FileFormat::Csv),
        "parquet" => Ok(FileFormat::Parquet),
        "latex" => Ok(FileFormat::Latex),
        "html" => Ok(FileFormat::Html),
        _ => Err(usage("format", format!("`{name}` is none of csv, parquet, latex, html"))),
    };
    let formats = formats.iter().map(format).collect::<Answer<Vec<_>>>()?;
    long(py, None, move |_| {
        let store = Store::new(folder);
        let found = collect_store(&store)?;
        found.write(&store, &formats)?;
        if samples {
            found.write_samples(&store)?;
        }
        Ok((found.rows.len(), found.failed, found.missing))
    })
}

/// A manifest of all data sets below a folder, as the text of a CSV.
#[pyfunction]
pub(crate) fn scan(py: Python<'_>, folder: PathBuf, base: PathBuf) -> Answer<String> {
    long(py, None, move |_| scan_folder(&folder, &base))
}

/// The results of a batch in the shape of the paper's table.
#[pyclass(frozen, module = "vicepose")]
pub(crate) struct FleetTable {
    table: Table,
}

impl FleetTable {
    fn shown(&self, format: Format) -> Answer<String> {
        Ok(self.table.render(format)?)
    }
}

/// The table of a batch's folder, or of its results.csv or results.parquet.
#[pyfunction]
pub(crate) fn table(py: Python<'_>, results: PathBuf) -> Answer<FleetTable> {
    let table = long(py, None, move |_| Table::open(&results))?;
    Ok(FleetTable { table })
}

#[pymethods]
impl FleetTable {
    /// As CSV: what ``vice table --format csv`` prints.
    fn to_csv(&self) -> Answer<String> {
        self.shown(Format::Csv)
    }

    /// As LaTeX: what ``vice table --format latex`` prints.
    fn to_latex(&self) -> Answer<String> {
        self.shown(Format::Latex)
    }

    /// As a page: what ``vice table --format html`` prints.
    fn to_html(&self) -> Answer<String> {
        self.shown(Format::Html)
    }

    /// The table as a pandas.DataFrame of text.
    fn to_df<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let text = py.import("io")?.call_method1("StringIO", (self.to_csv()?,))?;
        py.import("pandas")?.call_method1("read_csv", (text,))
    }

    fn __str__(&self) -> Answer<String> {
        self.shown(Format::Text)
    }

    fn __repr__(&self) -> Answer<String> {
        Ok(self.shown(Format::Text)?.trim_end().to_string())
    }

    fn _repr_html_(&self, py: Python<'_>) -> Answer<String> {
        let text = self.shown(Format::Text)?;
        let escaped = py.import("html").and_then(|h| h.call_method1("escape", (text,))?.extract::<String>());
        Ok(format!("<pre>{}</pre>", escaped.python()?))
    }
}
