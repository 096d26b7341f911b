//! Arrays of NumPy as slices, without a copy where they are contiguous doubles.

use numpy::{
    Element, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::errors::{Answer, Failure, OfPython, usage};

/// An array of a type in the order of C: the given one where it is that already, else a copy.
fn contiguous<'py>(object: &Bound<'py, PyAny>, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
    let numpy = object.py().import("numpy")?;
    numpy.call_method1("ascontiguousarray", (object, dtype))
}

/// Rows of `N` doubles, shape (n, N).
pub(crate) struct Rows<'py>(PyReadonlyArray2<'py, f64>);

impl<'py> Rows<'py> {
    /// # Errors
    /// A usage error for another shape.
    pub(crate) fn of<const N: usize>(object: &Bound<'py, PyAny>, name: &'static str) -> Answer<Self> {
        let wrong =
            |shape: &[usize]| usage(name, format!("an array of shape (N, {N}) is expected, not {shape:?}"));
        let given = object.extract::<PyReadonlyArray2<'py, f64>>().ok().filter(|a| a.is_c_contiguous());
        let rows = match given {
            Some(rows) => rows,
            None => {
                let array = contiguous(object, "float64").python()?;
                let shape: Vec<usize> = array.getattr("shape").and_then(|s| s.extract()).python()?;
                if shape.len() != 2 {
                    return Err(wrong(&shape));
                }
                array.extract().python()?
            }
        };
        if rows.shape()[1] == N { Ok(Self(rows)) } else { Err(wrong(rows.shape())) }
    }

    /// The rows.
    pub(crate) fn rows<const N: usize>(&self) -> Answer<&[[f64; N]]> {
        let all = self.0.as_slice().python()?;
        Ok(all.as_chunks().0)
    }
}

/// A column of a type, shape (n,).
pub(crate) fn column<'py, T: Element>(
    object: &Bound<'py, PyAny>,
    dtype: &str,
    name: &'static str,
) -> Answer<PyReadonlyArray1<'py, T>> {
    let array = contiguous(object, dtype).python()?;
    let shape: Vec<usize> = array.getattr("shape").and_then(|s| s.extract()).python()?;
    array.extract().map_err(|_| usage(name, format!("an array of shape (N,) is expected, not {shape:?}")))
}

/// Stamps: integer nanoseconds, never floating-point numbers, which lose them.
pub(crate) fn stamps<'py>(
    object: &Bound<'py, PyAny>,
    name: &'static str,
) -> Answer<PyReadonlyArray1<'py, i64>> {
    let numpy = object.py().import("numpy").python()?;
    let array = numpy.call_method1("asarray", (object,)).python()?;
    let kind: String =
        array.getattr("dtype").and_then(|d| d.getattr("kind")).and_then(|k| k.extract()).python()?;
    match kind.as_str() {
        "i" | "u" => column(&array, "int64", name),
        "M" => column(&array.call_method1("astype", ("datetime64[ns]",)).python()?, "int64", name),
        _ => Err(usage(
            name,
            "stamps are integer nanoseconds (int64 or datetime64); doubles of seconds lose some hundred of them",
        )),
    }
}

/// Rows as a new array.
pub(crate) fn array_of_rows<'py, const N: usize>(
    py: Python<'py>,
    rows: impl ExactSizeIterator<Item = [f64; N]>,
) -> Answer<Bound<'py, PyArray2<f64>>> {
    let array = PyArray2::<f64>::zeros(py, [rows.len(), N], false);
    {
        let mut to = array.try_readwrite().python()?;
        let to = to.as_slice_mut().python()?;
        for (to, row) in to.as_chunks_mut::<N>().0.iter_mut().zip(rows) {
            *to = row;
        }
    }
    Ok(array)
}

/// Numbers as a new array.
pub(crate) fn array_of<'py, T: Element + Copy>(
    py: Python<'py>,
    numbers: impl ExactSizeIterator<Item = T>,
) -> Bound<'py, PyArray1<T>> {
    PyArray1::from_vec(py, numbers.collect())
}

/// A matrix of 4 by 4, row by row.
pub(crate) fn matrix(object: &Bound<'_, PyAny>, name: &'static str) -> Answer<[f64; 16]> {
    let rows = Rows::of::<4>(object, name)?;
    let rows = rows.rows::<4>()?;
    let wrong = || usage(name, "a matrix of shape (4, 4) is expected");
    if rows.len() != 4 {
        return Err(wrong());
    }
    rows.as_flattened().try_into().map_err(|_| wrong())
}

/// A slice that was borrowed for writing, or why it cannot be.
pub(crate) fn not_writable(name: &'static str) -> impl Fn(numpy::BorrowError) -> Failure {
    move |error| usage(name, format!("cannot be written to: {error}"))
}
