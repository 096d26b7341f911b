//! Trajectories.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;
use pyo3::types::PyType;
use vice_run::core::time::{Span, Stamp};
use vice_run::core::trajectory::{PoseRow, Trajectory as Core};
use vice_run::files::atomic::Overwrite;
use vice_run::files::trajectory::{ReadOptions, write_euroc, write_kitti, write_tum};
use vice_run::request::EstimateSpec;

use crate::arrays::{Rows, array_of, array_of_rows, stamps};
use crate::errors::{Answer, OfPython, usage};
use crate::table::{Table, integers, numbers};
use crate::work::long;

/// Poses ``world_from_body`` over time.
///
/// Parameters
/// ----------
/// ns : array of int64 or datetime64, shape (N,)
///     Stamps in nanoseconds, strictly increasing.
/// xyz : array of shape (N, 3), metres
///     Positions of the body in the world.
/// quat_xyzw : array of shape (N, 4)
///     Rotations ``world_from_body`` as unit quaternions, w last.
///
/// Raises
/// ------
/// UsageError
///     With the row (from 0) that is not finite, no unit quaternion, or out of order.
#[pyclass(frozen, module = "vicepose")]
#[derive(Clone)]
pub(crate) struct Trajectory {
    pub(crate) core: Arc<Core>,
}

impl Trajectory {
    pub(crate) fn of(core: Core) -> Self {
        Self { core: Arc::new(core) }
    }
}

#[pymethods]
impl Trajectory {
    #[new]
    fn new(ns: &Bound<'_, PyAny>, xyz: &Bound<'_, PyAny>, quat_xyzw: &Bound<'_, PyAny>) -> Answer<Self> {
        let ns = stamps(ns, "ns")?;
        let ns = ns.as_slice().python()?;
        let (xyz, quat) = (Rows::of::<3>(xyz, "xyz")?, Rows::of::<4>(quat_xyzw, "quat_xyzw")?);
        let (xyz, quat) = (xyz.rows::<3>()?, quat.rows::<4>()?);
        if xyz.len() != ns.len() || quat.len() != ns.len() {
            let lengths = [ns.len(), xyz.len(), quat.len()];
            return Err(usage("ns", format!("ns, xyz and quat_xyzw differ in length: {lengths:?}")));
        }
        let rows = ns.iter().zip(xyz).zip(quat).map(|((ns, xyz), [x, y, z, w])| PoseRow {
            stamp: Stamp::from_nanos(*ns),
            position_m: *xyz,
            rotation_wxyz: [*w, *x, *y, *z],
        });
        Ok(Self::of(Core::from_rows(rows).map_err(|e| usage("trajectory", e.to_string()))?))
    }

    /// A trajectory from a file: TUM, EuRoC CSV, KITTI (with its times), a table with a heading; ``rel:FILE`` for
    /// relative motions.
    #[classmethod]
    #[pyo3(signature = (path, times = None))]
    fn read(_: &Bound<'_, PyType>, py: Python<'_>, path: PathBuf, times: Option<PathBuf>) -> Answer<Self> {
        long(py, None, move |_| {
            let spec = EstimateSpec::from(path.display().to_string());
            Ok(spec.read_file(&ReadOptions { times, ..ReadOptions::default() })?.trajectory)
        })
        .map(Self::of)
    }

    /// Writes it: ``tum``, ``euroc``, or ``kitti`` with its times in times.txt beside it.
    #[pyo3(signature = (path, format = "tum", overwrite = false))]
    fn write(&self, path: PathBuf, format: &str, overwrite: bool) -> Answer<()> {
        let overwrite = if overwrite { Overwrite::Replace } else { Overwrite::Refuse };
        match format {
            "tum" => write_tum(&path, &self.core, overwrite)?,
            "euroc" => write_euroc(&path, &self.core, None, overwrite)?,
            "kitti" => write_kitti(&path, path.with_file_name("times.txt"), &self.core, overwrite)?,
            _ => return Err(usage("format", format!("`{format}` is none of tum, euroc, kitti"))),
        }
        Ok(())
    }

    /// From a data frame (pandas, polars, or anything with columns by name): ``timestamp_ns`` (or ``timestamp`` as
    /// datetime64), ``x y z`` or ``tx ty tz`` in metres, ``qx qy qz qw``.
    #[classmethod]
    fn from_df(class: &Bound<'_, PyType>, df: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let parts = class.py().import("vicepose._frames")?.call_method1("trajectory_arrays", (df,))?;
        Ok(class.call1(parts.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>)>()?)?.unbind())
    }

    /// From a ``PoseTrajectory3D`` of evo. evo holds stamps as doubles of seconds, which are some hundred nanoseconds
    /// apart at today's epoch: they are rounded to nanoseconds.
    #[classmethod]
    fn from_evo(class: &Bound<'_, PyType>, traj: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let parts = class.py().import("vicepose._frames")?.call_method1("evo_arrays", (traj,))?;
        Ok(class.call1(parts.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>)>()?)?.unbind())
    }

    /// A pandas.DataFrame with ``timestamp_ns``, ``x y z`` in metres and ``qx qy qz qw``.
    fn to_df<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Bound::new(py, self.table()?)?.call_method0("to_pandas")
    }

    /// A ``PoseTrajectory3D`` of evo; needs evo.
    fn to_evo<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("vicepose._frames")?.call_method1("to_evo", (slf,))
    }

    /// The poses as a Table.
    fn table(&self) -> Answer<Table> {
        let (stamps, poses) = (self.core.stamps(), self.core.poses());
        let position = |k: usize| numbers(poses.iter().map(move |p| p.translation()[k]));
        let rotation = |k: usize| numbers(poses.iter().map(move |p| p.rotation().coords[k]));
        Table::new(vec![
            ("timestamp_ns", integers(stamps.iter().map(|s| s.as_nanos()))),
            ("x", position(0)),
            ("y", position(1)),
            ("z", position(2)),
            ("qx", rotation(0)),
            ("qy", rotation(1)),
            ("qz", rotation(2)),
            ("qw", rotation(3)),
        ])
    }

    /// Stamps in nanoseconds, int64 of shape (N,).
    #[getter]
    fn ns<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i64>> {
        array_of(py, self.core.stamps().iter().map(|s| s.as_nanos()))
    }

    /// Positions in metres, shape (N, 3).
    #[getter]
    fn xyz<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyArray2<f64>>> {
        array_of_rows(py, self.core.poses().iter().map(|p| p.translation().into()))
    }

    /// Unit quaternions, w last, shape (N, 4).
    #[getter]
    fn quat_xyzw<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyArray2<f64>>> {
        array_of_rows(py, self.core.poses().iter().map(|p| p.rotation().coords.into()))
    }

    /// Length of the path, metres.
    #[getter]
    fn length_m(&self) -> f64 {
        self.core.path_length_m()
    }

    /// Pose ``world_from_body`` at a stamp as an array of shape (4, 4), or None where there is none: nothing is
    /// extrapolated, and no gap wider than ``max_gap`` seconds is bridged. Linear in position, slerp in rotation.
    #[pyo3(signature = (ns, max_gap = 0.1))]
    fn at<'py>(&self, py: Python<'py>, ns: i64, max_gap: f64) -> Answer<Option<Bound<'py, PyArray2<f64>>>> {
        let gap = Span::from_secs_f64(max_gap)?;
        let Ok(pose) = self.core.pose_at(Stamp::from_nanos(ns), gap) else { return Ok(None) };
        array_of_rows(py, pose.to_row_major().as_chunks::<4>().0.to_vec().into_iter()).map(Some)
    }

    fn __len__(&self) -> usize {
        self.core.len()
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| other.get().core == self.core)
    }

    fn __repr__(&self) -> String {
        let (first, last) = (self.core.start(), self.core.end());
        let seconds = last.since(first).as_secs_f64();
        format!(
            "<vicepose.Trajectory of {} poses, {first} to {last} ns ({seconds:.2} s), path {:.2} m>",
            self.core.len(),
            self.length_m()
        )
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let (py, own) = (slf.py(), slf.get());
        let parts = (own.ns(py), own.xyz(py)?, own.quat_xyzw(py)?);
        Ok((slf.get_type().into_any(), parts.into_pyobject(py)?.into_any()))
    }
}
