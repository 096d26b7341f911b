//! Tables that other libraries take over through Arrow's PyCapsule interface, without a copy.

use std::sync::Arc;

use arrow_array::ffi::FFI_ArrowSchema;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::Int32Type;
use arrow_array::{
    Array, ArrayRef, BooleanArray, DictionaryArray, Float64Array, Int64Array, RecordBatch,
    RecordBatchIterator, StringArray,
};
use arrow_schema::{ArrowError, Field, Schema};
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict, PyList};
use vice_run::error::RunError;

use crate::arrays::array_of;
use crate::errors::{Answer, Failure, missing};

/// A column by its name.
pub(crate) type Column = (&'static str, ArrayRef);

/// Columns of equal length. pandas, polars, DuckDB and pyarrow take it without a copy (``pyarrow.table(t)``,
/// ``polars.DataFrame(t)``, ``duckdb.sql("select * from t")``); ``to_pandas`` needs no pyarrow.
#[pyclass(frozen, module = "vicepose")]
pub(crate) struct Table {
    batch: RecordBatch,
}

fn arrow(error: ArrowError) -> Failure {
    Failure::Run(RunError::missing("the table cannot be made").because(error))
}

/// Text of few different values.
pub(crate) fn words<'a>(values: impl Iterator<Item = &'a str>) -> ArrayRef {
    Arc::new(values.collect::<DictionaryArray<Int32Type>>())
}

pub(crate) fn numbers(values: impl Iterator<Item = f64>) -> ArrayRef {
    Arc::new(Float64Array::from_iter_values(values))
}

pub(crate) fn numbers_or_null(values: impl Iterator<Item = Option<f64>>) -> ArrayRef {
    Arc::new(values.collect::<Float64Array>())
}

pub(crate) fn integers(values: impl Iterator<Item = i64>) -> ArrayRef {
    Arc::new(Int64Array::from_iter_values(values))
}

pub(crate) fn flags(values: impl Iterator<Item = bool>) -> ArrayRef {
    Arc::new(values.map(Some).collect::<BooleanArray>())
}

impl Table {
    pub(crate) fn new(columns: Vec<Column>) -> Answer<Self> {
        let fields: Vec<Field> =
            columns.iter().map(|(name, array)| Field::new(*name, array.data_type().clone(), true)).collect();
        let arrays = columns.into_iter().map(|(_, array)| array).collect();
        Ok(Self { batch: RecordBatch::try_new(Arc::new(Schema::new(fields)), arrays).map_err(arrow)? })
    }

    fn index(&self, name: &str) -> Answer<usize> {
        self.batch.schema().index_of(name).map_err(|_| {
            let names = self.columns().join(", ");
            missing(format!("there is no column {name}; there are {names}"))
        })
    }
}

#[pymethods]
impl Table {
    /// Names of the columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema().fields().iter().map(|f| f.name().clone()).collect()
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    /// A column: an array of NumPy, or a list of text.
    fn __getitem__<'py>(&self, py: Python<'py>, name: &str) -> Answer<Bound<'py, PyAny>> {
        values(py, self.batch.column(self.index(name)?))
    }

    /// Columns by name: arrays of NumPy (NaN for null), lists of text.
    pub(crate) fn to_dict<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyDict>> {
        let columns = PyDict::new(py);
        for (name, array) in self.columns().iter().zip(self.batch.columns()) {
            columns.set_item(name, values(py, array)?).map_err(Failure::Python)?;
        }
        Ok(columns)
    }

    /// A pandas.DataFrame; needs pandas.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        py.import("pandas")?.call_method1("DataFrame", (slf.get().to_dict(py)?,))
    }

    /// A polars.DataFrame without a copy; needs polars.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// Arrow's PyCapsule interface.
    fn __arrow_c_schema__<'py>(&self, py: Python<'py>) -> Answer<Bound<'py, PyCapsule>> {
        let schema = FFI_ArrowSchema::try_from(self.batch.schema().as_ref()).map_err(arrow)?;
        PyCapsule::new_with_value(py, schema, c"arrow_schema").map_err(Failure::Python)
    }

    /// Arrow's PyCapsule interface. No other schema than its own is offered.
    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> Answer<Bound<'py, PyCapsule>> {
        // The interface lets a producer that cannot cast give what it has.
        drop(requested_schema);
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream").map_err(Failure::Python)
    }

    fn __repr__(&self) -> String {
        format!("<vicepose.Table of {} rows: {}>", self.batch.num_rows(), self.columns().join(", "))
    }
}

fn values<'py>(py: Python<'py>, array: &ArrayRef) -> Answer<Bound<'py, PyAny>> {
    let any = array.as_any();
    if let Some(numbers) = any.downcast_ref::<Float64Array>() {
        let all: Vec<f64> = numbers.iter().map(|v| v.unwrap_or(f64::NAN)).collect();
        return Ok(array_of(py, all.into_iter()).into_any());
    }
    if let Some(integers) = any.downcast_ref::<Int64Array>() {
        return Ok(array_of(py, integers.values().iter().copied()).into_any());
    }
    if let Some(flags) = any.downcast_ref::<BooleanArray>() {
        let all: Vec<bool> = flags.iter().map(Option::unwrap_or_default).collect();
        return Ok(array_of(py, all.into_iter()).into_any());
    }
    if let Some(words) = any.downcast_ref::<DictionaryArray<Int32Type>>()
        && let Some(texts) = words.values().as_any().downcast_ref::<StringArray>()
    {
        // Each word is made once and shared by its rows.
        let made: Vec<_> = texts
            .iter()
            .map(|t| t.unwrap_or_default().into_pyobject(py))
            .collect::<Result<_, _>>()
            .unwrap_or_default();
        let list = words.keys().iter().map(|k| made.get(k.unwrap_or_default() as usize));
        return Ok(PyList::new(py, list).map_err(Failure::Python)?.into_any());
    }
    Err(missing(format!("a column of {} has no array", array.data_type())))
}
