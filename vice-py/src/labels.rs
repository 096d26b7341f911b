//! Labels.

use std::path::PathBuf;
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyType;
use vice_run::core::camera::Pixel;
use vice_run::core::label::{LabelRow, LabelSet, Observation, ObservationSource};
use vice_run::core::time::Stamp;
use vice_run::files::atomic::Overwrite;
use vice_run::files::labels;

use crate::arrays::{Rows, column, stamps};
use crate::errors::{Answer, OfPython, usage};
use crate::recording::Recording;
use crate::table::{Table, flags, integers, numbers, words};
use crate::work::short;

/// Where a human, helped by a tracker, says that scene points are. A key frame starts a segment: what follows until the
/// next key frame of the point is scored against it.
///
/// Parameters
/// ----------
/// point : sequence of str, N
///     Name of the point of each label.
/// ns : array of int64 or datetime64, shape (N,)
///     Stamp of the frame, nanoseconds.
/// uv : array of shape (N, 2), pixels
///     Pixel centres are integers; (0, 0) is the centre of the top left pixel.
/// keyframe : array of bool, shape (N,)
///     Whether a segment starts here.
/// source : sequence of str, optional
///     ``manual`` (default), ``auto``, ``detected`` or ``interpolated``.
/// occluded, uncertain : array of bool, optional
///     The point is hidden, or the annotator is not sure.
#[pyclass(frozen, module = "vicepose")]
#[derive(Clone)]
pub(crate) struct Labels {
    pub(crate) core: Arc<LabelSet>,
}

impl Labels {
    fn of(core: LabelSet) -> Self {
        Self { core: Arc::new(core) }
    }
}

#[pymethods]
impl Labels {
    #[new]
    #[pyo3(signature = (point, ns, uv, keyframe, source = None, occluded = None, uncertain = None))]
    #[allow(clippy::too_many_arguments, reason = "columns of a table, by name")]
    fn new(
        point: Vec<String>,
        ns: &Bound<'_, PyAny>,
        uv: &Bound<'_, PyAny>,
        keyframe: &Bound<'_, PyAny>,
        source: Option<Vec<String>>,
        occluded: Option<&Bound<'_, PyAny>>,
        uncertain: Option<&Bound<'_, PyAny>>,
    ) -> Answer<Self> {
        let ns = stamps(ns, "ns")?;
        let ns = ns.as_slice().python()?;
        let uv = Rows::of::<2>(uv, "uv")?;
        let uv = uv.rows::<2>()?;
        let of_flags = |object: Option<&Bound<'_, PyAny>>, name| -> Answer<Vec<bool>> {
            let Some(object) = object else { return Ok(vec![false; ns.len()]) };
            Ok(column::<bool>(object, "bool", name)?.as_slice().python()?.to_vec())
        };
        let keyframe = of_flags(Some(keyframe), "keyframe")?;
        let (occluded, uncertain) = (of_flags(occluded, "occluded")?, of_flags(uncertain, "uncertain")?);
        let lengths = [point.len(), uv.len(), keyframe.len(), occluded.len(), uncertain.len()];
        if lengths.iter().any(|n| *n != ns.len()) || source.as_ref().is_some_and(|s| s.len() != ns.len()) {
            return Err(usage(
                "labels",
                format!("the columns differ in length from ns, which has {}", ns.len()),
            ));
        }
        let mut rows = Vec::with_capacity(ns.len());
        for (i, point) in point.into_iter().enumerate() {
            let name = source.as_ref().map_or("manual", |s| s[i].as_str());
            let source = ObservationSource::from_name(name).ok_or_else(|| {
                usage("source", format!("`{name}` is none of manual, auto, detected, interpolated"))
            })?;
            let place = Observation::manual(Stamp::from_nanos(ns[i]), Pixel::new(uv[i][0], uv[i][1]));
            let observation = Observation {
                source,
                keyframe: keyframe[i],
                occluded: occluded[i],
                uncertain: uncertain[i],
                ..place
            };
            rows.push(LabelRow { point, observation });
        }
        Ok(Self::of(LabelSet::from_rows(rows).map_err(|e| usage("labels", e.to_string()))?))
    }

    /// Labels from a file: CSV, JSON, Parquet, CVAT's XML, the authors' pickle. The last two count frames, and so need the run.
    #[classmethod]
    #[pyo3(signature = (path, run = None))]
    fn read(_: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf, run: Option<&Recording>) -> Answer<Self> {
        let core = short(py, || {
            let frames = run.map(Recording::opened_default).transpose()?.map(|opened| opened.frames);
            Ok(labels::read(&path, frames.as_deref())?)
        })?;
        Ok(Self::of(core))
    }

    /// Writes them as CSV, JSON or Parquet, by the ending of the name.
    #[pyo3(signature = (path, overwrite = false))]
    fn write(&self, path: PathBuf, overwrite: bool) -> Answer<()> {
        let overwrite = if overwrite { Overwrite::Replace } else { Overwrite::Refuse };
        Ok(labels::write(&path, &self.core, overwrite)?)
    }

    /// From a data frame with ``point``, ``timestamp_ns``, ``u_px``, ``v_px``, ``keyframe`` and perhaps ``source``,
    /// ``occluded``, ``uncertain``: the columns of :meth:`table`.
    #[classmethod]
    fn from_df(class: &Bound<'_, PyType>, df: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let parts = class.py().import("vicepose._frames")?.call_method1("label_columns", (df,))?;
        Ok(class.call((), Some(parts.cast()?))?.unbind())
    }

    /// A pandas.DataFrame, a row a label.
    fn to_df<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Bound::new(py, self.table()?)?.call_method0("to_pandas")
    }

    /// The labels as a Table.
    fn table(&self) -> Answer<Table> {
        let rows: Vec<(&str, Observation)> = self
            .core
            .points()
            .iter()
            .flat_map(|p| p.observations.iter().map(|o| (p.name.as_str(), o)))
            .collect();
        Table::new(vec![
            ("point", words(rows.iter().map(|r| r.0))),
            ("timestamp_ns", integers(rows.iter().map(|r| r.1.stamp.as_nanos()))),
            ("u_px", numbers(rows.iter().map(|r| r.1.px.u))),
            ("v_px", numbers(rows.iter().map(|r| r.1.px.v))),
            ("keyframe", flags(rows.iter().map(|r| r.1.keyframe))),
            ("source", words(rows.iter().map(|r| r.1.source.name()))),
            ("occluded", flags(rows.iter().map(|r| r.1.occluded))),
            ("uncertain", flags(rows.iter().map(|r| r.1.uncertain))),
        ])
    }

    /// Names of the points.
    #[getter]
    fn points(&self) -> Vec<String> {
        self.core.points().iter().map(|p| p.name.clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.core.observation_count()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        // Not whether they stood in the same lines of a file.
        let rows = |labels: &LabelSet| -> Vec<(String, Observation)> {
            let all = labels.points().iter();
            all.flat_map(|p| p.observations.iter().map(|o| (p.name.clone(), Observation { line: 0, ..o })))
                .collect()
        };
        other.cast::<Self>().is_ok_and(|other| rows(&other.get().core) == rows(&self.core))
    }

    fn __repr__(&self) -> String {
        format!(
            "<vicepose.Labels of {} points, {} labels>",
            self.core.points().len(),
            self.core.observation_count()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyAny>,))> {
        let table = slf.get().table()?.to_dict(slf.py())?;
        Ok((slf.get_type().getattr("from_df")?, (table.into_any(),)))
    }
}
