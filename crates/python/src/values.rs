//! Values from and to Python.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyMapping, PyString};
use serde_json::Value;

use crate::errors::refused;

/// A JSON value as Python has it.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::Null => py.None().into_bound(py),
        Value::Bool(value) => PyBool::new(py, *value).to_owned().into_any(),
        Value::Number(value) => match (value.as_u64(), value.as_i64()) {
            (Some(value), _) => value.into_pyobject(py)?.into_any(),
            (None, Some(value)) => value.into_pyobject(py)?.into_any(),
            (None, None) => PyFloat::new(py, value.as_f64().unwrap_or(f64::NAN)).into_any(),
        },
        Value::String(value) => PyString::new(py, value).into_any(),
        Value::Array(values) => {
            let values: Vec<_> = values.iter().map(|value| to_python(py, value)).collect::<PyResult<_>>()?;
            PyList::new(py, values)?.into_any()
        }
        Value::Object(values) => {
            let dict = PyDict::new(py);
            for (key, value) in values {
                dict.set_item(key, to_python(py, value)?)?;
            }
            dict.into_any()
        }
    })
}

/// Deepest list of a value.
const DEEPEST: usize = 8;

/// A Python value as the JSON value that it means; NumPy's numbers and arrays are values as well. `of` is what
/// the value is of, for messages.
pub(crate) fn to_json(value: &Bound<'_, PyAny>, of: &str) -> PyResult<Value> {
    to_json_within(value, of, DEEPEST)
}

fn to_json_within(value: &Bound<'_, PyAny>, of: &str, depth: usize) -> PyResult<Value> {
    let refused = |accepted: &str| refused(format!("{of} = {value} (accepted: {accepted})"));
    if value.is_instance_of::<PyBool>() {
        return Ok(value.is_truthy()?.into());
    }
    if value.is_instance_of::<PyInt>() {
        return value.extract::<i64>().map(Value::from).map_err(|_| refused("a whole number of 64 bits"));
    }
    if value.is_instance_of::<PyFloat>() {
        let number = serde_json::Number::from_f64(value.extract()?);
        return number.map(Value::Number).ok_or_else(|| refused("a finite number"));
    }
    if value.is_instance_of::<PyString>() {
        return Ok(value.extract::<String>()?.into());
    }
    let accepted = "a number, a text, a truth value, or a list of them";
    // A number or an array of NumPy, which knows what it is in Python.
    if let Ok(list) = value.call_method0("tolist") {
        return to_json_within(&list, of, depth.checked_sub(1).ok_or_else(|| refused(accepted))?);
    }
    let is_list = value.cast::<PyMapping>().is_err() && !value.is_instance_of::<PyBytes>();
    let values = value
        .try_iter()
        .ok()
        .filter(|_| is_list)
        .ok_or_else(|| PyTypeError::new_err(format!("{of} = {value} (accepted: {accepted})")))?;
    let depth =
        depth.checked_sub(1).ok_or_else(|| PyTypeError::new_err(format!("{of} (accepted: {accepted})")))?;
    values.map(|value| to_json_within(&value?, of, depth)).collect::<PyResult<Vec<_>>>().map(Value::Array)
}

/// A key and its value as `--set` takes them.
pub(crate) fn assigned(key: &str, value: &Value) -> String {
    let value = toml::Value::try_from(value).expect("it has texts, numbers, truth values and lists of them");
    format!("{key}={value}")
}

/// Keys and values of a scenario, dotted: `{"friction.law": ...}` and `friction={"law": ...}` alike.
pub(crate) fn assignments(
    overrides: Option<&Bound<'_, PyMapping>>,
    groups: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<(String, Value)>> {
    let mut found = Vec::new();
    let groups = groups.map(|groups| groups.as_mapping());
    for given in [overrides, groups].into_iter().flatten() {
        for pair in given.items()?.try_iter()? {
            let (key, value): (String, Bound<'_, PyAny>) = pair?.extract()?;
            match value.cast::<PyMapping>() {
                Ok(group) if !key.contains('.') => {
                    for pair in group.items()?.try_iter()? {
                        let (inner, value): (String, Bound<'_, PyAny>) = pair?.extract()?;
                        let key = format!("{key}.{inner}");
                        let value = to_json(&value, &key)?;
                        found.push((key, value));
                    }
                }
                _ => {
                    let value = to_json(&value, &key)?;
                    found.push((key, value));
                }
            }
        }
    }
    Ok(found)
}
