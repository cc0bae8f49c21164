//! Values from and to Python.

use asperity_run::SolverKind;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyBytes, PyDict, PyFloat, PyInt, PyMapping, PyString};
use serde_json::Value;

use crate::errors::refused;

/// A JSON value as Python has it.
pub(crate) fn to_python<'py>(py: Python<'py>, value: &Value) -> PyResult<Bound<'py, PyAny>> {
    py.import("json")?.call_method1("loads", (value.to_string(),))
}

/// Deepest list of a value.
pub(crate) const DEEPEST: usize = 8;

/// A truth value, a number or a text as TOML has it; None for anything else.
pub(crate) fn scalar(value: &Bound<'_, PyAny>) -> PyResult<Option<toml::Value>> {
    Ok(Some(match value {
        value if value.is_instance_of::<PyBool>() => value.is_truthy()?.into(),
        value if value.is_instance_of::<PyInt>() => value.extract::<i64>()?.into(),
        value if value.is_instance_of::<PyFloat>() => value.extract::<f64>()?.into(),
        value if value.is_instance_of::<PyString>() => value.extract::<String>()?.into(),
        _ => return Ok(None),
    }))
}

/// A Python value as the JSON value that it means, of lists as deep as this; NumPy's numbers and arrays are values as
/// well. `of` is what the value is of, for messages.
pub(crate) fn to_json(value: &Bound<'_, PyAny>, of: &str, depth: usize) -> PyResult<Value> {
    let refused = |accepted: &str| refused(format!("{of} = {value} (accepted: {accepted})"));
    match scalar(value).map_err(|_| refused("a whole number of 64 bits"))? {
        Some(toml::Value::Float(number)) if !number.is_finite() => return Err(refused("a finite number")),
        Some(value) => return Ok(serde_json::to_value(value).expect("it is a plain value")),
        None => {}
    }
    let accepted = "a number, a text, a truth value, or a list of them";
    let unlike = || PyTypeError::new_err(format!("{of} = {value} (accepted: {accepted})"));
    let depth = depth.checked_sub(1).ok_or_else(unlike)?;
    // A number or an array of NumPy, which knows what it is in Python.
    if let Ok(list) = value.call_method0("tolist") {
        return to_json(&list, of, depth);
    }
    let is_list = value.cast::<PyMapping>().is_err() && !value.is_instance_of::<PyBytes>();
    let values = value.try_iter().ok().filter(|_| is_list).ok_or_else(unlike)?;
    values.map(|value| to_json(&value?, of, depth)).collect::<PyResult<Vec<_>>>().map(Value::Array)
}

/// A solver by its name.
pub(crate) fn solver(name: Option<&str>) -> PyResult<Option<SolverKind>> {
    let named = |name| {
        let accepted = "None, \"fast\", \"plain\", \"adaptive\"";
        SolverKind::named(name).ok_or_else(|| refused(format!("solver = {name:?} (accepted: {accepted})")))
    };
    name.map(named).transpose()
}

/// A key and its value as `--set` takes them.
pub(crate) fn assigned(key: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    let value = toml::Value::try_from(to_json(value, key, DEEPEST)?);
    Ok(format!("{key}={}", value.expect("it has texts, numbers, truth values and lists of them")))
}

/// Keys and values of a scenario, dotted: `{"friction.law": ...}` and `friction={"law": ...}` alike.
pub(crate) fn assignments(
    overrides: Option<&Bound<'_, PyMapping>>,
    groups: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<String>> {
    let mut found = Vec::new();
    let groups = groups.map(|groups| groups.as_mapping());
    for given in [overrides, groups].into_iter().flatten() {
        for (key, value) in items(given)? {
            match value.cast::<PyMapping>() {
                Ok(group) if !key.contains('.') => {
                    for (inner, value) in items(group)? {
                        found.push(assigned(&format!("{key}.{inner}"), &value)?);
                    }
                }
                _ => found.push(assigned(&key, &value)?),
            }
        }
    }
    Ok(found)
}

/// The items of a mapping whose keys are texts.
pub(crate) fn items<'py>(mapping: &Bound<'py, PyMapping>) -> PyResult<Vec<(String, Bound<'py, PyAny>)>> {
    mapping.items()?.try_iter()?.map(|pair| pair?.extract()).collect()
}
