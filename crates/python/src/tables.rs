//! Tables of a run as Arrow record batches.

use std::borrow::Cow;
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
use asperity_record::{Cell, Column};
use asperity_report::html::markup::text;
use asperity_tables::table::{self, Values};
use pyo3::exceptions::{PyKeyError, PyTypeError};
use pyo3::prelude::*;
use pyo3::pybacked::PyBackedBytes;
use pyo3::types::{PyCapsule, PyDict, PyTuple};

use crate::errors::failed;
use crate::memory::Memory;

/// Rows that a notebook shows.
const SHOWN_ROWS: usize = 10;

/// Columns of numbers, truth values and words, each with unit and meaning.
///
/// Any library that reads Arrow takes it, again and again, without a copy:
/// `polars.DataFrame(table)`, `pyarrow.table(table)`, `duckdb.from_arrow(table)`.
#[pyclass(frozen, from_py_object, module = "asperity")]
#[derive(Clone)]
pub(crate) struct Table {
    /// Its name: that of its topic, or of its detector.
    #[pyo3(get)]
    pub(crate) name: String,
    batch: RecordBatch,
}

impl Table {
    /// A table of columns: name, unit and meaning, values.
    pub(crate) fn new(name: &str, columns: Vec<(String, Described, ArrayRef)>) -> Table {
        let rows = columns.first().map_or(0, |(.., values)| values.len());
        let field = |(name, described, values): (String, Described, ArrayRef)| {
            (Field::new(name, values.data_type().clone(), true).with_metadata(described), values)
        };
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns.into_iter().map(field).unzip();
        let options = RecordBatchOptions::new().with_row_count(Some(rows));
        let batch = RecordBatch::try_new_with_options(Arc::new(Schema::new(fields)), arrays, &options);
        Table { name: name.to_owned(), batch: batch.expect("columns are as long as the table") }
    }

    /// Of a table of a run or a study.
    pub(crate) fn of(table: &table::Table) -> Table {
        let columns = table.columns.iter().zip(table.values());
        let column = |(column, values): (&Column, &Values)| {
            (column.name.to_string(), described(column.unit, column.about.trim()), array(values))
        };
        Table::new(table.name.trim_start_matches('/'), columns.map(column).collect())
    }

    /// Its name and its number of rows.
    pub(crate) fn summary(&self) -> String {
        format!("{}: {}", self.name, asperity_record::counted(self.batch.num_rows() as u64, "row"))
    }

    /// The values of a column that has only numbers, by its place.
    pub(crate) fn steps(&self, column: &str) -> Option<&UInt64Array> {
        self.batch.column_by_name(column)?.as_any().downcast_ref()
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
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Counts(values) => Arc::new(UInt32Array::from(values.clone())),
        Values::Steps(values) => Arc::new(UInt64Array::from(values.clone())),
        Values::Numbers(values) => Arc::new(Float64Array::from(values.clone())),
        Values::Flags(values) => Arc::new(BooleanArray::from(values.clone())),
        Values::Words(values) => Arc::new(values.iter().map(Option::as_deref).collect::<LargeStringArray>()),
    }
}

/// The unit and the meaning of a column, as far as it has them.
pub(crate) type Described = HashMap<String, String>;

/// That of a column with these, of which either may be missing.
pub(crate) fn described(unit: Option<&str>, about: &str) -> Described {
    let texts = [("unit", unit), ("about", Some(about).filter(|about| !about.is_empty()))];
    texts.into_iter().filter_map(|(key, text)| Some((key.to_owned(), text?.to_owned()))).collect()
}

/// A column for pickle: name, unit and meaning, kind of values, number of them, which are not missing, and their memory.
type Pickled<Bytes> = (String, Described, String, usize, Option<Bytes>, Vec<Bytes>);

/// The cell in a row.
fn cell(values: &ArrayRef, row: usize) -> Cell {
    match values.data_type() {
        _ if values.is_null(row) => Cell::Empty,
        DataType::UInt32 => Cell::Count(values.as_primitive::<UInt32Type>().value(row)),
        DataType::UInt64 => Cell::Step(values.as_primitive::<UInt64Type>().value(row)),
        DataType::Int64 => {
            let value = values.as_primitive::<Int64Type>().value(row);
            value.try_into().map_or(Cell::Number(value as f64), Cell::Step)
        }
        DataType::Boolean => Cell::Flag(values.as_boolean().value(row)),
        DataType::LargeUtf8 => Cell::word(values.as_string::<i64>().value(row)),
        _ => Cell::Number(values.as_primitive::<Float64Type>().value(row)),
    }
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
            let number = |row| cell(values, row).number().unwrap_or(f64::NAN);
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
        let values = self.batch.column_by_name(column).ok_or_else(|| {
            let (names, table) = (self.columns(), &self.name);
            let suggestion = asperity_model::suggestion(column, names.iter().map(String::as_str));
            let accepted = names.join(", ");
            PyKeyError::new_err(format!("{column}: no column of {table}{suggestion} (accepted: {accepted})"))
        })?;
        numpy(py, values)
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
    fn _restored(name: &str, columns: Vec<Pickled<PyBackedBytes>>) -> PyResult<Table> {
        let array = |(field, described, kind, rows, gaps, memory): Pickled<PyBackedBytes>| {
            let buffer = |bytes: PyBackedBytes| Buffer::from_slice_ref(&bytes);
            let empty = new_empty_array(&kind.parse().map_err(failed)?).to_data().into_builder();
            let data = empty.len(rows).buffers(memory.into_iter().map(buffer).collect());
            let data = data.null_bit_buffer(gaps.map(buffer)).build().map_err(failed)?;
            Ok((field, described, make_array(data)))
        };
        let columns = columns.into_iter().map(array).collect::<PyResult<Vec<_>>>()?;
        Ok(Table::new(name, columns))
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyTuple>> {
        let Table { name, batch } = slf.get();
        let column = |(field, values): (&Arc<Field>, &ArrayRef)| -> Pickled<Cow<'_, [u8]>> {
            let (data, bytes) = (values.to_data(), |memory: &Buffer| Cow::Owned(memory.to_vec()));
            let (gaps, memory) = (data.nulls().map(|gaps| bytes(gaps.buffer())), data.buffers());
            let (kind, memory) = (data.data_type().to_string(), memory.iter().map(bytes).collect());
            (field.name().clone(), field.metadata().clone().into(), kind, data.len(), gaps, memory)
        };
        let columns: Vec<_> = batch.schema_ref().fields().iter().zip(batch.columns()).map(column).collect();
        (slf.get_type().getattr("_restored")?, (name, columns)).into_pyobject(slf.py())
    }

    fn __repr__(&self) -> String {
        format!("Table {}, {}", self.summary(), self.columns().join(", "))
    }

    fn _repr_html_(&self) -> String {
        let head = |field: &Arc<Field>| {
            let metadata = field.metadata();
            let unit = metadata.get("unit").map(|unit| format!("<br><small>{}</small>", text(unit)));
            let about = metadata.get("about").map_or_else(String::new, text);
            format!("<th title=\"{about}\">{}{}</th>", text(field.name()), unit.unwrap_or_default())
        };
        let heads: String = self.batch.schema_ref().fields().iter().map(head).collect();
        let cell = |values: &ArrayRef, row: usize| {
            let shown = match cell(values, row) {
                Cell::Number(number) => asperity_record::short(number),
                cell => cell.to_string(),
            };
            format!("<td>{}</td>", text(shown))
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
