//! Tables of a run as Arrow record batches.

use std::collections::HashMap;
use std::sync::Arc;

use arrow_array::ffi_stream::FFI_ArrowArrayStream;
use arrow_array::{
    Array, ArrayRef, BooleanArray, Float64Array, Int64Array, RecordBatch, RecordBatchIterator,
    RecordBatchOptions, StringArray, UInt32Array, UInt64Array,
};
use arrow_buffer::Buffer;
use arrow_schema::{DataType, Field, Schema};
use asperity_record::Column;
use asperity_tables::batch::{Batch, Values};
use asperity_tables::run_tables::RunTable;
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyCapsule, PyDict};

use crate::memory::Memory;

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
    pub(crate) fn new(name: &str, columns: Vec<(String, Option<&str>, String, ArrayRef)>) -> Table {
        let rows = columns.first().map_or(0, |(.., values)| values.len());
        let (fields, arrays): (Vec<Field>, Vec<ArrayRef>) = columns
            .into_iter()
            .map(|(name, unit, about, values)| {
                let unit = unit.map(|unit| ("unit".to_owned(), unit.to_owned()));
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
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;");
        let head = |field: &Arc<Field>| {
            let metadata = field.metadata();
            let unit = metadata.get("unit").map(|unit| format!("<br><small>{unit}</small>"));
            let about =
                metadata.get("about").map_or_else(String::new, |about| escaped(about).replace('"', "'"));
            format!("<th title=\"{about}\">{}{}</th>", escaped(field.name()), unit.unwrap_or_default())
        };
        let heads: String = self.batch.schema_ref().fields().iter().map(head).collect();
        let cell = |values: &ArrayRef, row: usize| format!("<td>{}</td>", escaped(&shown(values, row)));
        let row = |row: usize| -> String {
            let cells: String = self.batch.columns().iter().map(|values| cell(values, row)).collect();
            format!("<tr>{cells}</tr>")
        };
        let rows: String = (0..self.batch.num_rows().min(SHOWN_ROWS)).map(row).collect();
        let foot = self.__repr__();
        format!(
            "<table><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table><p>{}</p>",
            escaped(&foot)
        )
    }
}

fn array(values: &Values) -> ArrayRef {
    match values {
        Values::Counts(values) => Arc::new(UInt32Array::from(values.clone())),
        Values::Steps(values) => Arc::new(UInt64Array::from(values.clone())),
        Values::Numbers(values) => Arc::new(Float64Array::from(values.clone())),
        Values::Flags(values) => Arc::new(BooleanArray::from(values.clone())),
        Values::Words(values) => Arc::new(StringArray::from(values.clone())),
    }
}

/// A cell as a notebook shows it.
fn shown(values: &ArrayRef, row: usize) -> String {
    if values.is_null(row) {
        return String::new();
    }
    let any = values.as_any();
    if let Some(values) = any.downcast_ref::<Float64Array>() {
        return asperity_record::short(values.value(row));
    }
    if let Some(values) = any.downcast_ref::<UInt32Array>() {
        return values.value(row).to_string();
    }
    if let Some(values) = any.downcast_ref::<UInt64Array>() {
        return values.value(row).to_string();
    }
    if let Some(values) = any.downcast_ref::<Int64Array>() {
        return values.value(row).to_string();
    }
    if let Some(values) = any.downcast_ref::<BooleanArray>() {
        return values.value(row).to_string();
    }
    any.downcast_ref::<StringArray>().map_or_else(String::new, |values| values.value(row).to_owned())
}

/// The array of a column: over its own memory where every value is a number.
fn numpy<'py>(py: Python<'py>, values: &ArrayRef) -> PyResult<Bound<'py, PyAny>> {
    let rows = values.len();
    let dtype = match values.data_type() {
        DataType::UInt32 => "uint32",
        DataType::UInt64 => "uint64",
        DataType::Int64 => "int64",
        _ => "float64",
    };
    let any = values.as_any();
    if let Some(values) = any.downcast_ref::<BooleanArray>()
        && values.null_count() == 0
    {
        let bytes: Vec<u8> = values.values().iter().map(u8::from).collect();
        return Memory::array(py, Buffer::from_vec(bytes), "bool", &[rows]);
    }
    if let Some(values) = any.downcast_ref::<StringArray>() {
        let words: Vec<Option<&str>> = values.iter().collect();
        return py.import("numpy")?.call_method1("array", (words, "object"));
    }
    if values.null_count() == 0 {
        let data = values.to_data();
        let width = if dtype == "uint32" { 4 } else { 8 };
        let bytes = data.buffers()[0].slice_with_length(data.offset() * width, rows * width);
        return Memory::array(py, bytes, dtype, &[rows]);
    }
    // NumPy has no missing whole numbers: NaN stands for what is missing.
    let number = |row: usize| match () {
        () if values.is_null(row) => f64::NAN,
        () => shown_number(values, row),
    };
    Memory::array(py, Buffer::from_vec((0..rows).map(number).collect::<Vec<f64>>()), "float64", &[rows])
}

fn shown_number(values: &ArrayRef, row: usize) -> f64 {
    let any = values.as_any();
    let float = any.downcast_ref::<Float64Array>().map(|values| values.value(row));
    let count = || any.downcast_ref::<UInt32Array>().map(|values| f64::from(values.value(row)));
    let step = || any.downcast_ref::<UInt64Array>().map(|values| values.value(row) as f64);
    let whole = || any.downcast_ref::<Int64Array>().map(|values| values.value(row) as f64);
    let flag = || any.downcast_ref::<BooleanArray>().map(|values| f64::from(values.value(row)));
    float.or_else(count).or_else(step).or_else(whole).or_else(flag).unwrap_or(f64::NAN)
}

#[pymethods]
impl Table {
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    #[getter]
    fn columns(&self) -> Vec<String> {
        self.batch.schema_ref().fields().iter().map(|field| field.name().clone()).collect()
    }

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

    /// A column, without a copy; where values are missing a copy as float64 with NaN for them.
    fn __getitem__<'py>(&self, py: Python<'py>, column: &str) -> PyResult<Bound<'py, PyAny>> {
        numpy(py, self.field(column)?.1)
    }

    fn to_numpy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let arrays = PyDict::new(py);
        for (field, values) in self.batch.schema_ref().fields().iter().zip(self.batch.columns()) {
            arrays.set_item(field.name(), numpy(py, values)?)?;
        }
        Ok(arrays)
    }

    fn to_polars<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("polars")?.call_method1("DataFrame", (slf,))
    }

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

    fn __repr__(&self) -> String {
        let rows = asperity_record::counted(self.batch.num_rows() as u64, "row");
        format!("Table {}: {rows}, {}", self.name, self.columns().join(", "))
    }

    fn _repr_html_(&self) -> String {
        self.html()
    }
}
