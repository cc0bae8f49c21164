//! Values from and to Python.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString};
use serde_json::Value;

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

/// A Python value as the JSON value that it means; NumPy's numbers and arrays are values as well.
pub(crate) fn to_json(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_none() {
        return Ok(Value::Null);
    }
    if value.is_instance_of::<PyBool>() {
        return Ok(value.is_truthy()?.into());
    }
    if value.is_instance_of::<PyInt>() {
        return Ok(value.extract::<i64>()?.into());
    }
    if value.is_instance_of::<PyFloat>() {
        return finite(value.extract()?);
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(text.into());
    }
    // A number or an array of NumPy, which knows what it is in Python.
    if let Ok(list) = value.call_method0("tolist")
        && !list.is(value)
    {
        return to_json(&list);
    }
    let values = value.try_iter().map_err(|_| not_a_value(value))?;
    values.map(|value| to_json(&value?)).collect::<PyResult<Vec<_>>>().map(Value::Array)
}

fn finite(value: f64) -> PyResult<Value> {
    serde_json::Number::from_f64(value)
        .map(Value::Number)
        .ok_or_else(|| crate::errors::refused(format!("{value} is no value (accepted: a finite number)")))
}

fn not_a_value(value: &Bound<'_, PyAny>) -> PyErr {
    let class = value.get_type().name().map_or_else(|_| "?".to_owned(), |name| name.to_string());
    PyTypeError::new_err(format!(
        "{value} is a {class} (accepted: a number, a text, a truth value, or a list of numbers)"
    ))
}

/// Keys and values of a scenario, dotted: `{"friction.law": ...}` and `friction={"law": ...}` alike.
pub(crate) fn assignments(
    overrides: Option<&Bound<'_, PyDict>>,
    groups: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<(String, Value)>> {
    let mut found = Vec::new();
    for given in [overrides, groups].into_iter().flatten() {
        for (key, value) in given {
            let key: String = key.extract()?;
            match value.cast::<PyDict>() {
                Ok(group) => {
                    for (inner, value) in group {
                        found.push((format!("{key}.{}", inner.extract::<String>()?), to_json(&value)?));
                    }
                }
                Err(_) => found.push((key, to_json(&value)?)),
            }
        }
    }
    Ok(found)
}
