//! The parameters of scenarios, with symbols and units.

use asperity_model::Scenario;
use asperity_model::law::laws::FrictionLaw;
use asperity_model::scenario::keys::{self, KEYS, Key};
use asperity_record::unit_of;
use toml::Value;

use crate::html::markup::{self, Cell, Row, table, text};
use crate::study::Run;
use crate::symbols::{lettered, number, rounded, symbol};

/// The keys of a scenario with their values, in the order of the key table.
pub(crate) struct Parameters(Vec<(&'static Key, Value)>);

/// Keys of a name, which no parameter is.
const NAMES: [&str; 2] = ["name", "summary"];

impl Parameters {
    /// Those of a scenario, without keys that its friction law or a medium does not use.
    pub(crate) fn of(scenario: &Scenario) -> Parameters {
        Parameters(scenario.stated().filter(|(key, _)| !NAMES.contains(&key.path)).collect())
    }

    /// Those of a run; none of a recording.
    pub(crate) fn of_run(run: &Run) -> Parameters {
        if run.header.parts().recording { Parameters(Vec::new()) } else { Parameters::of(&run.scenario) }
    }

    /// Whether a key concerns something that another one disables.
    fn is_idle(&self, key: &Key) -> bool {
        const NEEDS: [(&str, &[&str]); 4] = [
            ("friction.ageing_time_s", &["friction.ageing_coefficient"]),
            ("friction.spread_seed", &["friction.static_spread", "friction.dynamic_spread"]),
            ("initial_velocity.mode", &["initial_velocity.amplitude_m_per_s"]),
            ("normal_load.schedule_from", &["normal_load.schedule_s"]),
        ];
        let word = self.get("friction.law").and_then(Value::as_str);
        if FrictionLaw::ALL.iter().any(|law| Some(law.word()) == word && law.lacks(key.path)) {
            return true;
        }
        let is_off = |other: &&str| self.get(other).is_none_or(does_nothing);
        NEEDS.iter().any(|(path, others)| *path == key.path && others.iter().all(is_off))
    }

    pub(crate) fn get(&self, path: &str) -> Option<&Value> {
        self.0.iter().find(|(key, _)| key.path == path).map(|(_, value)| value)
    }
}

/// The keys in which scenarios differ.
pub(crate) fn differing(all: &[Parameters]) -> Vec<&'static Key> {
    let differs = |key: &&Key| all.windows(2).any(|pair| pair[0].get(key.path) != pair[1].get(key.path));
    KEYS.iter().filter(|key| !NAMES.contains(&key.path)).filter(differs).collect()
}

/// The parameters common to all scenarios, as a table, without those that are zero or empty, or that
/// another key disables.
pub(crate) fn parameters(first: &Parameters, differing: &[&'static Key]) -> String {
    let same = first.0.iter().filter(|(key, value)| {
        !differing.iter().any(|other| other.path == key.path) && !does_nothing(value) && !first.is_idle(key)
    });
    let rows = same.map(|(key, value)| {
        Row::from(vec![
            Cell::Html(symbol(key.symbol)),
            cell(value),
            Cell::text(unit(key)),
            Cell::Html(markup::name(key.path)),
            Cell::Html(meaning(key)),
        ])
    });
    table("", "", &["symbol", "#value", "unit", "key", "meaning"], rows)
}

/// The model in a few numbers, shown beside its sketch.
const MAIN: [&str; 21] = [
    "slider.blocks",
    "slider.length_m",
    "slider.mass_kg",
    "slider.youngs_modulus_pa",
    "slider.relative_damping",
    "medium.shear_modulus_pa",
    "friction.static_coefficient",
    "friction.dynamic_coefficient",
    "friction.interfacial_stiffness_ratio",
    "friction.junction_count",
    "friction.junction_constant_n_per_m2",
    "friction.healing_time_s",
    "friction.junction_width",
    "drive.stiffness_n_per_m",
    "drive.velocity_m_per_s",
    "normal_load.total_n",
    "normal_load.tilt",
    "initial_shear.beta",
    "prestress.ratio",
    "time.step_s",
    "time.duration_s",
];

/// The parameters that describe the model, in short; those without effect are left out, and those that
/// differ between runs have these values, as HTML.
pub(crate) fn main(first: &Parameters, varied: &[(String, String)]) -> String {
    let row = |path: &&str| {
        let key = keys::named(path)?;
        let value = first.get(path)?;
        let values = varied.iter().find(|(of, _)| of == path);
        let (value, unit) = match (values, value) {
            (Some((_, values)), _) => (values.clone(), unit(key)),
            (None, value) if does_nothing(value) || first.is_idle(key) => return None,
            (None, Value::Float(value)) => (rounded(*value, 6), unit(key)),
            (None, other) => (text(other), unit(key)),
        };
        let title = text(key.doc);
        Some(format!(
            "<div title=\"{title}\"><dt>{}</dt><dd>{value} {}</dd></div>\n",
            symbol(key.symbol),
            text(unit)
        ))
    };
    format!("<dl class=\"main\">\n{}</dl>\n", MAIN.iter().filter_map(row).collect::<String>())
}

/// The range of a key in all scenarios that have it.
pub(crate) fn range_of(key: &Key, all: &[Parameters]) -> (String, String) {
    let number = |value: &Value| value.as_float().or_else(|| Some(value.as_integer()? as f64));
    (key.path.to_owned(), range(all.iter().filter_map(|one| number(one.get(key.path)?))))
}

/// From the smallest to the largest value.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> String {
    let [low, high] = values
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)]);
    let [low, high] = [low, high].map(|end| rounded(end, 4));
    if low == high { low } else { format!("{low} to {high}") }
}

/// A key by its symbol or, if it has none, its path.
pub(crate) fn name(key: &Key) -> String {
    if key.symbol.is_empty() { markup::name(key.path) } else { symbol(key.symbol) }
}

/// The meaning of a key.
pub(crate) fn meaning(key: &Key) -> String {
    format!("<span class=\"soft\">{}</span>", lettered(key.doc))
}

/// The unit of a key; none for counts and choices.
pub(crate) fn unit(key: &Key) -> &'static str {
    unit_of(key.path).filter(|unit| *unit != "1").unwrap_or_default()
}

/// A value as a cell.
pub(crate) fn cell(value: &Value) -> Cell {
    match value {
        Value::Float(value) => Cell::Value(*value, number(*value)),
        Value::Integer(value) => Cell::number(value),
        Value::Boolean(flag) => Cell::text(if *flag { "yes" } else { "no" }),
        Value::String(words) => Cell::text(words),
        Value::Array(values) => Cell::text(format!("{} values", values.len())),
        other => Cell::text(other),
    }
}

/// Zero, none, or empty.
fn does_nothing(value: &Value) -> bool {
    match value {
        Value::Float(value) => *value == 0.0,
        Value::Integer(value) => *value == 0,
        Value::Boolean(flag) => !flag,
        Value::String(words) => words.is_empty(),
        Value::Array(values) => values.is_empty(),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::resolve;

    use super::{Parameters, differing, parameters};

    #[test]
    fn what_differs_is_told_apart_from_what_is_the_same() {
        let of = |set: &[&str]| Parameters::of(&resolve("default", set).unwrap());
        let all = [of(&[]), of(&["friction.static_coefficient=0.9", "slider.blocks=50"])];
        let keys = differing(&all);
        assert_eq!(
            keys.iter().map(|key| key.path).collect::<Vec<_>>(),
            ["slider.blocks", "friction.static_coefficient"]
        );
        let table = parameters(&all[0], &keys);
        assert!(table.contains("<i>μ</i><sub>d</sub>") && !table.contains("<i>μ</i><sub>s</sub>"));
        assert!(table.contains("10<sup>−8</sup>"), "the time step: {table}");
        // Nobody asked for ageing, nor has the law a use for weakening.
        assert!(!table.contains("ageing_coefficient") && !table.contains("weakening_velocity"));
        assert!(differing(&all[..1]).is_empty());
    }

    #[test]
    fn a_fault_line_has_a_medium_and_no_mass() {
        let line = resolve::<&str>("seas-bp1-qd-coarse", &[]).unwrap();
        let table = parameters(&Parameters::of(&line), &[]).replace("<wbr>", "");
        assert!(table.contains("shear_modulus_pa"), "{table}");
        for idle in ["mass_kg", "youngs_modulus_pa", "total_n", "stiffness_n_per_m"] {
            assert!(!table.contains(idle), "{idle}");
        }
    }
}
