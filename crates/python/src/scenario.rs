//! Scenarios.

use std::path::PathBuf;

use asperity_model::scenario::builtin;
use asperity_model::source;
use asperity_model::{Plan, Scenario as Resolved, ScenarioSource};
use asperity_numbers::{Key, OfRecording, Summary};
use asperity_record::counted;
use asperity_report::html::markup::text;
use asperity_report::sketch_alone;
use asperity_run::{Forecast, Opened};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};
use serde_json::Value;

use crate::errors::{of_faults, of_scenario, refused};
use crate::values::{assignments, to_python};

/// The built-in scenarios: name and one line about each.
#[pyfunction]
pub(crate) fn scenarios(py: Python<'_>) -> PyResult<Vec<(String, String)>> {
    let resolved = |name: &str| asperity_model::resolve(name, &[] as &[&str]).map_err(of_scenario);
    py.detach(|| builtin::all().map(|(name, _)| Ok((name.to_owned(), resolved(name)?.summary))).collect())
}

/// What slides, on what, how it is driven, and what is recorded: every key with a value in its range.
///
/// `name` is a built-in scenario or the path of a TOML file. Values may be given by dotted key,
/// `{"friction.static_coefficient": 0.5}`, or by section, `friction=dict(static_coefficient=0.5)`. Keys,
/// units, ranges and symbols: docs/scenarios.md. Raises `ScenarioError` with every fault.
#[pyclass(frozen, module = "asperity")]
pub(crate) struct Scenario {
    pub(crate) resolved: Resolved,
    source: ScenarioSource,
    /// The name or path, and the values given beside it; none for the scenario of a run.
    given: Option<(PathBuf, Vec<String>)>,
}

impl Scenario {
    fn of(
        py: Python<'_>,
        source: ScenarioSource,
        given: Option<(PathBuf, Vec<String>)>,
    ) -> PyResult<Scenario> {
        let resolved = py.detach(|| Resolved::resolve_with(&source, &Opened));
        let resolved = resolved.map_err(|errors| of_faults(&errors))?;
        Ok(Scenario { resolved, source, given })
    }

    /// Its name or path, and the values given beside it.
    pub(crate) fn given_as(&self) -> PyResult<&(PathBuf, Vec<String>)> {
        self.given.as_ref().ok_or_else(|| {
            refused(format!(
                "{} has no name or path (accepted: asperity.Scenario(NAME, ...), not that of a run)",
                self.__repr__()
            ))
        })
    }

    /// The scenario of a run.
    pub(crate) fn resolved(resolved: Resolved) -> Scenario {
        let source = ScenarioSource::logged(resolved.name.clone(), resolved.to_commented_toml());
        Scenario { resolved, source, given: None }
    }

    /// Every key, by section.
    fn values(&self, py: Python<'_>) -> Value {
        py.detach(|| toml::from_str(&self.resolved.to_commented_toml())).expect("this program has written it")
    }
}

#[pymethods]
impl Scenario {
    /// A scenario, or the name of one, with other values.
    #[new]
    #[pyo3(signature = (name = None, overrides = None, /, **groups))]
    pub(crate) fn new(
        py: Python<'_>,
        name: Option<&Bound<'_, PyAny>>,
        overrides: Option<&Bound<'_, PyMapping>>,
        groups: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Scenario> {
        if let Some(Ok(scenario)) = name.map(|name| name.cast::<Scenario>()) {
            return scenario.get().replace(py, overrides, groups);
        }
        let name = name.map_or_else(|| Ok("default".into()), |name| name.extract::<PathBuf>())?;
        let values = assignments(overrides, groups)?;
        let source = with(py.detach(|| source(&name)).map_err(of_scenario)?, &values);
        Scenario::of(py, source, Some((name, values)))
    }

    /// A scenario from its text, such as `toml` of another.
    #[staticmethod]
    fn from_toml(py: Python<'_>, text: &str) -> PyResult<Scenario> {
        Scenario::of(py, ScenarioSource::new("text", text), None)
    }

    fn __reduce__(slf: &Bound<'_, Self>) -> PyResult<(Py<PyAny>, (String,))> {
        Ok((slf.get_type().getattr("from_toml")?.unbind(), (slf.get().toml(slf.py()),)))
    }

    /// This scenario with other values.
    #[pyo3(signature = (overrides = None, /, **groups))]
    fn replace(
        &self,
        py: Python<'_>,
        overrides: Option<&Bound<'_, PyMapping>>,
        groups: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Scenario> {
        let values = assignments(overrides, groups)?;
        let source = with(self.source.clone(), &values);
        let given =
            self.given.clone().map(|(name, before)| (name, before.into_iter().chain(values).collect()));
        Scenario::of(py, source, given)
    }

    fn __contains__(&self, py: Python<'_>, key: &str) -> bool {
        key.split('.').try_fold(&self.values(py), |value, part| value.get(part)).is_some()
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.resolved.name
    }

    /// One line about it.
    #[getter]
    fn about(&self) -> &str {
        &self.resolved.summary
    }

    /// The hash of all values, as in the headers of logs.
    #[getter]
    fn hash(&self, py: Python<'_>) -> String {
        py.detach(|| self.resolved.hash())
    }

    /// All values as commented TOML, as `asperity scenario show` prints them.
    #[getter]
    fn toml(&self, py: Python<'_>) -> String {
        py.detach(|| self.resolved.to_editable_toml())
    }

    /// What may surprise, although it is accepted.
    #[getter]
    fn warnings(&self, py: Python<'_>) -> Vec<String> {
        py.detach(|| self.resolved.warnings()).into_iter().map(|warning| warning.text).collect()
    }

    /// Numbers that follow before it is run: wave speed, density, the times of first slip, ..., in SI units.
    #[getter]
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let (plan, forecast) =
            py.detach(|| (Plan::new(&self.resolved), serde_json::to_value(Forecast::of(&self.resolved))));
        let forecast = forecast.expect("a forecast is plain data");
        let of_plan = [
            ("block_mass_kg", plan.block_mass_kg),
            ("total_normal_load_n", plan.total_normal_load_n),
            (
                "drive_stiffness_n_per_m",
                plan.drive.springs.iter().map(|spring| spring.stiffness_n_per_m).sum(),
            ),
        ];
        let scales = plan.scales.parts().into_iter();
        let own = scales.chain(of_plan).map(|(name, value)| (name, Value::from(value)));
        let forecast = [&forecast["preview"], &forecast].into_iter().filter_map(Value::as_object).flatten();
        // The time of the plain solver is only measured for the command.
        let forecast = forecast.filter(|(name, _)| *name != "plain_solver_s");
        let forecast = forecast.filter(|(_, value)| value.is_number() || value.is_null());
        let forecast = forecast.map(|(name, value)| (name.as_str(), value.clone()));
        numbers_of(py, own.chain(forecast), "")
    }

    /// Every key, by section.
    fn as_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.values(py))
    }

    /// The value of a dotted key.
    fn __getitem__<'py>(&self, py: Python<'py>, key: &str) -> PyResult<Bound<'py, PyAny>> {
        let values = self.values(py);
        let found = key.split('.').try_fold(&values, |value, part| value.get(part));
        let unknown = || {
            let suggestion = asperity_model::key_suggestion(key);
            PyKeyError::new_err(format!("{key}: no key of a scenario{suggestion}"))
        };
        to_python(py, found.ok_or_else(unknown)?)
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Scenario>().is_ok_and(|other| other.get().resolved == self.resolved)
    }

    fn __hash__(&self) -> u64 {
        u64::from_str_radix(&self.resolved.hash()[..15], 16).unwrap_or_default()
    }

    fn __repr__(&self) -> String {
        let Resolved { name, slider, time, .. } = &self.resolved;
        let rows = if slider.rows > 1 { format!(" x {} rows", slider.rows) } else { String::new() };
        format!(
            "Scenario({name:?}: {}{rows}, {} s in steps of {:e} s)",
            counted(slider.blocks.into(), "block"),
            time.duration_s,
            time.step_s
        )
    }

    fn _repr_html_(&self, py: Python<'_>) -> String {
        let words = text(self.__repr__());
        let sketch = py.detach(|| sketch_alone(&self.resolved));
        format!(
            "<figure style=\"max-width: 46em; margin: 0\">{sketch}<figcaption>{words}</figcaption></figure>"
        )
    }
}

/// Adds values to a scenario.
fn with(source: ScenarioSource, values: &[String]) -> ScenarioSource {
    values.iter().fold(source, |source, value| source.with_override_from("given".to_owned(), value))
}

/// The numbers of a run, and what they are printed as.
pub(crate) fn summary_of<'py>(py: Python<'py>, summary: &Summary, text: &str) -> PyResult<Bound<'py, PyAny>> {
    let named = |(key, value): (&'static Key, Value)| (&*key.column.name, value);
    numbers_of(py, summary.shown().into_iter().map(named), text)
}

/// Numbers by name, as the package's dictionary of numbers with units.
fn numbers_of<'py, 'a>(
    py: Python<'py>,
    numbers: impl Iterator<Item = (&'a str, Value)>,
    text: &str,
) -> PyResult<Bound<'py, PyAny>> {
    let (values, units, about) = (PyDict::new(py), PyDict::new(py), PyDict::new(py));
    for (name, value) in numbers {
        values.set_item(name, to_python(py, &value)?)?;
        let key = Summary::KEYS.iter().chain(OfRecording::KEYS).find(|key| key.column.name == name);
        let unit = key.map_or_else(|| asperity_record::unit_of(name), |key| key.column.unit);
        units.set_item(name, unit)?;
        if let Some(key) = key {
            about.set_item(name, &*key.column.about)?;
        }
    }
    py.import("asperity.numbers")?.getattr("Numbers")?.call1((values, units, about, text))
}
