//! Cameras on arrays.

use numpy::{PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use vice_run::core::camera::{Camera as Core, Model};

use crate::arrays::{Rows, not_writable};
use crate::errors::{Answer, OfPython, usage};
use crate::work::guarded;

/// A calibrated camera.
///
/// Parameters
/// ----------
/// size : (int, int)
///     Columns and rows of the images.
/// K : array of shape (3, 3), or (fx, fy, cx, cy)
///     Intrinsics in pixels; pixel centres are integers. A skew is refused.
/// model : str
///     ``pinhole``, ``radtan`` (``plumb_bob``), ``rational`` (``rational_polynomial``), ``equidistant`` (``fisheye``),
///     ``ds`` (double sphere), ``eucm`` (extended unified), ``omni`` (Mei), ``fov`` (ATAN).
/// D : sequence of float
///     Coefficients of the lens in OpenCV's order: 4 or 5 of radtan, 8 of rational, 4 of equidistant;
///     xi, alpha of ds; alpha, beta of eucm; xi, k1, k2, p1, p2 of omni; w of fov.
///
/// Raises
/// ------
/// UsageError
///     For an unknown model, a wrong number of coefficients, or numbers that are no camera.
#[pyclass(frozen, eq, module = "vicepose")]
#[derive(Clone, PartialEq)]
pub(crate) struct Camera {
    pub(crate) core: Core,
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (size, K, model = "pinhole", D = None))]
    #[allow(non_snake_case, reason = "what OpenCV's users call them")]
    fn new(
        size: (u32, u32),
        K: &Bound<'_, PyAny>,
        model: &str,
        D: Option<&Bound<'_, PyAny>>,
    ) -> Answer<Self> {
        let intrinsics = intrinsics(K)?;
        let coefficients = D.map(flat).transpose()?.unwrap_or_default();
        let wrong = |e: vice_run::core::camera::CameraError| usage("camera", e.to_string());
        let model = Model::from_name(model, &coefficients).map_err(wrong)?;
        Ok(Self { core: Core::new(size.0, size.1, intrinsics, model).map_err(wrong)? })
    }

    /// Columns and rows of the images.
    #[getter]
    fn size(&self) -> (u32, u32) {
        (self.core.width(), self.core.height())
    }

    /// The intrinsics as an array of shape (3, 3), pixels.
    #[getter(K)]
    fn matrix<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyArray2<f64>>> {
        let [fx, fy, cx, cy] = self.core.fx_fy_cx_cy();
        crate::arrays::array_of_rows(py, [[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]].into_iter())
    }

    /// Name of the lens' model.
    #[getter]
    fn model(&self) -> &'static str {
        self.core.model().name()
    }

    /// Coefficients of the lens.
    #[getter(D)]
    fn coefficients(&self) -> Vec<f64> {
        self.core.model().coefficients()
    }

    /// Pixels of points in the camera's frame.
    ///
    /// Parameters
    /// ----------
    /// xyz : array of shape (N, 3), metres
    ///     x to the right, y down, z along the optical axis. Contiguous float64 is read in place, all else is copied.
    /// out : array of shape (N, 2), float64 and contiguous, optional
    ///     Where the pixels go. It may not share memory with ``xyz``.
    ///
    /// Returns
    /// -------
    /// array of shape (N, 2), pixels
    ///     NaN where a point is behind the camera or beyond the radius in which the lens' model is valid. A pixel may
    ///     lie outside of the image.
    #[pyo3(signature = (xyz, out = None))]
    fn project<'py>(
        &self,
        xyz: &Bound<'py, PyAny>,
        out: Option<Bound<'py, PyAny>>,
    ) -> Answer<Bound<'py, PyArray2<f64>>> {
        let from = Rows::of::<3>(xyz, "xyz")?;
        let from = from.rows::<3>()?;
        into_rows::<2>(xyz.py(), from.len(), out, |to| {
            self.core.project_rows(from, to);
        })
    }

    /// Rays of pixels.
    ///
    /// Parameters
    /// ----------
    /// uv : array of shape (N, 2), pixels
    /// out : array of shape (N, 3), float64 and contiguous, optional
    ///
    /// Returns
    /// -------
    /// array of shape (N, 3)
    ///     The point (x, y, 1) of the camera's frame on each ray: times a depth along the axis it is a point in metres.
    ///     NaN where no ray within the valid radius of the lens' model reaches the pixel.
    #[pyo3(signature = (uv, out = None))]
    fn unproject<'py>(
        &self,
        uv: &Bound<'py, PyAny>,
        out: Option<Bound<'py, PyAny>>,
    ) -> Answer<Bound<'py, PyArray2<f64>>> {
        let from = Rows::of::<2>(uv, "uv")?;
        let from = from.rows::<2>()?;
        into_rows::<3>(uv.py(), from.len(), out, |to| {
            self.core.unproject_rows(from, to);
        })
    }

    fn __repr__(&self) -> String {
        let ((width, height), k, d) = (self.size(), self.core.fx_fy_cx_cy(), self.coefficients());
        format!("Camera(({width}, {height}), {k:?}, '{}', {d:?})", self.model())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let class = py.get_type::<Self>().into_any();
        let arguments = (self.size(), self.core.fx_fy_cx_cy(), self.model(), self.coefficients());
        Ok((class, arguments.into_pyobject(py)?.into_any()))
    }
}

/// Fills rows of `N` numbers, given or new, while other threads of Python go on.
fn into_rows<'py, const N: usize>(
    py: Python<'py>,
    count: usize,
    out: Option<Bound<'py, PyAny>>,
    fill: impl FnOnce(&mut [[f64; N]]) + Send,
) -> Answer<Bound<'py, PyArray2<f64>>> {
    let out = match out {
        None => PyArray2::<f64>::zeros(py, [count, N], false),
        Some(out) => out
            .cast_into::<PyArray2<f64>>()
            .map_err(|_| usage("out", "an array of float64 with two axes is expected"))?,
    };
    if out.shape() != [count, N] {
        return Err(usage("out", format!("the shape ({count}, {N}) is expected, not {:?}", out.shape())));
    }
    if !out.is_c_contiguous() {
        return Err(usage("out", "a contiguous array is expected"));
    }
    {
        let mut borrowed = out.try_readwrite().map_err(not_writable("out"))?;
        let to = borrowed.as_slice_mut().map_err(|_| usage("out", "a contiguous array is expected"))?;
        let to = to.as_chunks_mut::<N>().0;
        py.detach(|| {
            guarded(|| {
                fill(to);
                Ok(())
            })
        })?;
    }
    Ok(out)
}

fn flat(object: &Bound<'_, PyAny>) -> Answer<Vec<f64>> {
    let numpy = object.py().import("numpy").python()?;
    numpy.call_method1("ravel", (object,)).and_then(|a| a.call_method0("tolist")?.extract()).python()
}

/// `[fx, fy, cx, cy]` of a matrix, or of these four.
fn intrinsics(object: &Bound<'_, PyAny>) -> Answer<[f64; 4]> {
    match flat(object)?.as_slice() {
        [fx, fy, cx, cy] => Ok([*fx, *fy, *cx, *cy]),
        [fx, skew, cx, zero_1, fy, cy, zero_2, zero_3, one] => {
            if [skew, zero_1, zero_2, zero_3].iter().all(|v| **v == 0.0) && *one == 1.0 {
                Ok([*fx, *fy, *cx, *cy])
            } else {
                Err(usage(
                    "K",
                    "[[fx, 0, cx], [0, fy, cy], [0, 0, 1]] is expected: there is no camera with a skew",
                ))
            }
        }
        other => Err(usage(
            "K",
            format!("a matrix of shape (3, 3) or (fx, fy, cx, cy) is expected, not {} numbers", other.len()),
        )),
    }
}
