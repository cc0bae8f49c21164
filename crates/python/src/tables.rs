//! Tables of a run as Arrow record batches.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::cast::AsArray;
use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::types::{Float64Type, Int64Type, UInt32Type, UInt64Type};
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, LargeStringArray, RecordBatch, RecordBatchIterator,
    RecordBatchOptions, UInt32Array, UInt64Array, make_array, new_empty_array,
};
use arrow_buffer::Buffer;
use arrow_schema::{DataType, Field, Schema};
use asperity_record::Column;
use asperity_report::html::markup::text;
use asperity_tables::batch::{Batch, Values};
use asperity_tables::run_tables::RunTable;
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyCapsule, PyDict, PyTuple};
use toml::Value;

use crate::errors::failed;
use crate::memory::{Memory, pickled, restored};

/// Rows that a notebook shows.
const SHOWN_ROWS: usize = 10;

/// Columns of numbers, truth values and words, each with unit and meaning.
///
/// Any library that reads Arrow takes it, again and again, without a copy:
/// `polars.DataFrame(table)`, `pyarrow.table(table)`, `duckdb.from_arrow(table)`.
#[pyclass(frozen, module = "asperity")]
#[derive(Clone)]
pub(crate) struct Table {
    name: String,
    batch: RecordBatch,
}

impl Table {
    /// A table of columns: name, unit, meaning, values.
    pub(crate) fn new(
        name: &str,
        columns: Vec<(String, Option<impl AsRef<str>>, String, ArrayRef)>,
    ) -> Table {
        let rows = columns.first().map_or(0, |(.., values)| values.len());
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns
            .into_iter()
            .map(|(name, unit, about, values)| {
                let unit = unit.map(|unit| ("unit".to_owned(), unit.as_ref().to_owned()));
                let about = Some(("about".to_owned(), about)).filter(|(_, about)| !about.is_empty());
                let metadata: HashMap<String, String> = unit.into_iter().chain(about).collect();
                let field = Field::new(name, values.data_type().clone(), true).with_metadata(metadata);
                (field, values)
            })
            .unzip();
        let options = RecordBatchOptions::new().with_row_count(Some(rows));
        let batch = RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), arrays, &options);
        Table { name: name.to_owned(), batch: batch.expect("columns are as long as the table") }
    }

    /// Of these columns and rows.
    pub(crate) fn of(name: &str, columns: &[Column], batch: &Batch) -> Table {
        let columns = columns.iter().zip(batch.columns());
        let column = |(column, values): (&Column, &Values)| {
            (column.name.to_string(), column.unit, column.about.trim().to_owned(), array(values))
        };
        Table::new(name, columns.map(column).collect())
    }

    /// Of a topic of a run.
    pub(crate) fn of_run(table: &RunTable) -> Table {
        let name = table.layout.topic.trim_start_matches('/');
        Table::of(name, &table.layout.columns, &table.batch)
    }

    /// Whether this is its name.
    pub(crate) fn is_called(&self, name: &str) -> bool {
        self.name == name
    }

    /// Its name and its number of rows.
    pub(crate) fn summary(&self) -> String {
        format!("{}: {}", self.name, asperity_record::counted(self.batch.num_rows() as u64, "row"))
    }

    /// The values of a column that has only numbers, by its place.
    pub(crate) fn steps(&self, column: &str) -> Option<&UInt64Array> {
        self.batch.column_by_name(column)?.as_any().downcast_ref()
    }

    fn field(&self, column: &str) -> PyResult<(&Field, &ArrayRef)> {
        let schema = self.batch.schema_ref();
        let (index, field) = schema.column_with_name(column).ok_or_else(|| {
            let names: Vec<&str> = schema.fields().iter().map(|field| field.name().as_str()).collect();
            let suggestion = asperity_model::suggestion(column, names.iter().copied());
            PyKeyError::new_err(format!(
                "{column}: no column of {}{suggestion} (accepted: {})",
                self.name,
                names.join(", ")
            ))
        })?;
        Ok((field, self.batch.column(index)))
    }

    fn described<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for field in self.batch.schema_ref().fields() {
            if let Some(text) = field.metadata().get(key) {
                dict.set_item(field.name(), text)?;
            }
        }
        Ok(dict)
    }

    fn html(&self) -> String {
        let head = |field: &Arc<Field>| {
            let metadata = field.metadata();
            let unit = metadata.get("unit").map(|unit| format!("<br><small>{}</small>", text(unit)));
            let about = metadata.get("about").map_or_else(String::new, text);
            format!("<th title=\"{about}\">{}{}</th>", text(field.name()), unit.unwrap_or_default())
        };
        let heads: String = self.batch.schema_ref().fields().iter().map(head).collect();
        let cell = |values: &ArrayRef, row: usize| {
            format!("<td>{}</td>", value(values, row).map(shown).map_or_else(String::new, text))
        };
        let row = |row: usize| -> String {
            let cells: String = self.batch.columns().iter().map(|values| cell(values, row)).collect();
            format!("<tr>{cells}</tr>")
        };
        let rows: String = (0..self.batch.num_rows().min(SHOWN_ROWS)).map(row).collect();
        let foot = self.__repr__();
        format!("<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table><p>{}</p>", text(foot))
    }
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Counts(values) => Arc::new(UInt32Array::from(values.clone())),
        Values::Steps(values) => Arc::new(UInt64Array::from(values.clone())),
        Values::Numbers(values) => Arc::new(Float64Array::from(values.clone())),
        Values::Flags(values) => Arc::new(BooleanArray::from(values.clone())),
        Values::Words(values) => Arc::new(LargeStringArray::from(values.clone())),
    }
}

/// A column for pickle: name, unit, meaning, kind of values, number of them, which are not missing, and their memory.
type Pickled<'py> =
    (String, Option<String>, String, String, usize, Option<Bound<'py, PyBytes>>, Vec<Bound<'py, PyBytes>>);

/// The value in a row; none where it is missing.
fn value(values: &ArrayRef, row: usize) -> Option<Value> {
    (!values.is_null(row)).then(|| match values.data_type() {
        DataType::UInt32 => Value::Integer(values.as_primitive::<UInt32Type>().value(row).into()),
        DataType::UInt64 => Value::Integer(values.as_primitive::<UInt64Type>().value(row) as i64),
        DataType::Int64 => Value::Integer(values.as_primitive::<Int64Type>().value(row)),
        DataType::Boolean => Value::Boolean(values.as_boolean().value(row)),
        DataType::LargeUtf8 => Value::String(values.as_string::<i64>().value(row).to_owned()),
        _ => Value::Float(values.as_primitive::<Float64Type>().value(row)),
    })
}

/// A value as a notebook shows it.
fn shown(value: Value) -> String {
    match value {
        Value::Float(value) => asperity_record::short(value),
        Value::String(value) => value,
        value => value.to_string(),
    }
}

/// A value as NumPy has it in a column with gaps.
fn number(value: &Value) -> f64 {
    let of_flag = || value.as_bool().map_or(f64::NAN, f64::from);
    value.as_float().or_else(|| value.as_integer().map(|value| value as f64)).unwrap_or_else(of_flag)
}

/// The array of a column: over its own memory where every value is a number.
fn numpy<'py>(py: Python<'py>, values: &ArrayRef) -> PyResult<Bound<'py, PyAny>> {
    let rows = values.len();
    let (dtype, bytes) = match values.data_type() {
        DataType::LargeUtf8 => {
            let words: Vec<Option<&str>> = values.as_string::<i64>().iter().collect();
            return py.import("numpy")?.call_method1("array", (words, "object"));
        }
        // NumPy has no missing whole numbers: NaN stands for what is missing.
        _ if values.null_count() > 0 => {
            let number = |row| value(values, row).map_or(f64::NAN, |value| number(&value));
            ("float64", Buffer::from_vec((0..rows).map(number).collect::<Vec<f64>>()))
        }
        // NumPy has a byte for each.
        DataType::Boolean => {
            let flags = values.as_boolean().values().iter().map(u8::from);
            ("bool", Buffer::from_vec(flags.collect::<Vec<u8>>()))
        }
        DataType::UInt32 => ("uint32", values.as_primitive::<UInt32Type>().values().inner().clone()),
        DataType::UInt64 => ("uint64", values.as_primitive::<UInt64Type>().values().inner().clone()),
        DataType::Int64 => ("int64", values.as_primitive::<Int64Type>().values().inner().clone()),
        _ => ("float64", values.as_primitive::<Float64Type>().values().inner().clone()),
    };
    Memory::array(py, bytes, dtype, &[rows])
}

#[pymethods]
impl Table {
    /// Its name: that of its topic, or of its detector.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// The names of its columns.
    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

    /// The units of its columns, without those that have none; "1" for ratios.
    #[getter]
    fn units<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.described(py, "unit")
    }

    /// What each column means.
    #[getter]
    fn about<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.described(py, "about")
    }

    fn __len__(&self) -> usize {
        self.batch.num_rows()
    }

    fn __contains__(&self, column: &str) -> bool {
        self.batch.column_by_name(column).is_some()
    }

    fn __iter__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.columns().into_pyobject(py)?.call_method0("__iter__")
    }

    /// Columns have several kinds of values, so a table is no array.
    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__(&self, dtype: Option<Bound<'_, PyAny>>, copy: Option<bool>) -> PyResult<()> {
        drop((dtype, copy));
        Err(PyTypeError::new_err(format!("{}: a table is no array (accepted: table[\"COLUMN\"])", self.name)))
    }

    /// A column, without a copy; where values are missing a copy as float64 with NaN for them.
    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        numpy(py, self.field(column)?.1)
    }

    /// All columns as arrays, by name; see `table["COLUMN"]`.
    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = PyDict::new(py);
        for (field, values) in self.batch.schema_ref().fields().iter().zip(self.batch.columns()) {
            arrays.set_item(field.name(), numpy(py, values)?)?;
        }
        Ok(arrays)
    }

    /// As `polars.DataFrame`, without a copy of numbers. polars must be installed.
    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

    /// As `pandas.DataFrame`, with NaN in gaps. pandas must be installed.
    fn to_pandas<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let keywords = PyDict::new(py);
        keywords.set_item("copy", false)?;
        py.import("pandas")?.call_method("DataFrame", (slf.get().to_numpy(py)?,), Some(&keywords))
    }

    #[pyo3(signature = (requested_schema = None))]
    fn __arrow_c_stream__<'py>(
        &self,
        py: Python<'py>,
        requested_schema: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyCapsule>> {
        // The protocol leaves it to the caller to convert what has another schema than the requested one.
        drop(requested_schema);
        let batches = RecordBatchIterator::new([Ok(self.batch.clone())], self.batch.schema());
        let stream = FFI_ArrowArrayStream::new(Box::new(batches));
        PyCapsule::new_with_value(py, stream, c"arrow_array_stream")
    }

    #[staticmethod]
    fn _restored(name: &str, columns: Vec<Pickled<'_>>) -> PyResult<Table> {
        let array = |(field, unit, about, kind, rows, gaps, memory): Pickled<'_>| {
            let empty = new_empty_array(&kind.parse().map_err(failed)?);
            let data =
                empty.to_data().into_builder().len(rows).buffers(memory.iter().map(restored).collect());
            let data = data.null_bit_buffer(gaps.as_ref().map(restored)).build().map_err(failed)?;
            Ok((field, unit, about, make_array(data)))
        };
        let columns = columns.into_iter().map(array).collect::<PyResult<Vec<_>>>()?;
        Ok(Table::new(name, columns))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let (py, batch) = (slf.py(), &slf.get().batch);
        let column = |(field, values): (&Arc<Field>, &ArrayRef)| {
            let (data, text) = (values.to_data(), |key| field.metadata().get(key).cloned());
            let gaps = data.nulls().map(|gaps| pickled(py, gaps.buffer()));
            let memory = data.buffers().iter().map(|memory| pickled(py, memory)).collect();
            let (kind, rows) = (data.data_type().to_string(), data.len());
            (field.name().clone(), text("unit"), text("about").unwrap_or_default(), kind, rows, gaps, memory)
        };
        let columns: Vec<Pickled<'_>> =
            batch.schema_ref().fields().iter().zip(batch.columns()).map(column).collect();
        (slf.get_type().getattr("_restored")?, (&slf.get().name, columns)).into_pyobject(py)
    }

    fn __repr__(&self) -> String {
        let rows = asperity_record::counted(self.batch.num_rows() as u64, "row");
        format!("Table {}: {rows}, {}", self.name, self.columns().join(", "))
    }

    fn _repr_html_(&self) -> String {
        self.html()
    }
}
