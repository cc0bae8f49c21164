//! What was asked: the parameters of scenarios, with symbols and units.

use asperity_model::Scenario;
use asperity_model::keys::{KEYS, Key};
use asperity_page::markup::{Cell, Row, table, text};
use asperity_record::unit_of;
use toml::{Table, Value};

use crate::symbols::{number, symbol};

/// The keys of a scenario with their values, in the order of the key table.
pub(crate) struct Asked(Vec<(&'static Key, Value)>);

/// Keys of a name, which no parameter is.
const NAMES: [&str; 2] = ["name", "summary"];

impl Asked {
    /// Of a scenario; what the friction law has no use for is not among them.
    pub(crate) fn of(scenario: &Scenario) -> Asked {
        let toml: Table = toml::from_str(&scenario.to_commented_toml())
            .expect("a scenario is written as the TOML that it is read from");
        let value = |key: &Key| {
            let mut parts = key.path.split('.');
            let first = toml.get(parts.next()?)?;
            parts.try_fold(first, |value, part| value.get(part)).cloned()
        };
        let keys = KEYS.iter().filter(|key| !NAMES.contains(&key.path));
        Asked(keys.filter_map(|key| Some((key, value(key)?))).collect())
    }

    pub(crate) fn get(&self, path: &str) -> Option<&Value> {
        self.0.iter().find(|(key, _)| key.path == path).map(|(_, value)| value)
    }
}

/// The keys in which scenarios differ.
pub(crate) fn differing(all: &[Asked]) -> Vec<&'static Key> {
    let differs = |key: &&Key| all.windows(2).any(|pair| pair[0].get(key.path) != pair[1].get(key.path));
    KEYS.iter().filter(|key| !NAMES.contains(&key.path)).filter(differs).collect()
}

/// The parameters that are the same in all scenarios, as a table. Those that nobody asked for and that
/// do nothing are left out.
pub(crate) fn parameters(first: &Asked, differing: &[&'static Key]) -> String {
    let same = first
        .0
        .iter()
        .filter(|(key, value)| !differing.iter().any(|other| other.path == key.path) && !does_nothing(value));
    let rows = same.map(|(key, value)| {
        Row::from(vec![
            Cell::Html(symbol(key.symbol)),
            cell(value),
            Cell::text(unit(key)),
            Cell::Html(format!("<code>{}</code>", text(key.path))),
            Cell::Html(format!("<span class=\"soft\">{}</span>", text(key.doc))),
        ])
    });
    table("", &["symbol", "#value", "unit", "key", "meaning"], rows)
}

/// The unit of a key; none for what is counted or chosen.
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

    use super::{Asked, differing, parameters};

    #[test]
    fn what_differs_is_told_apart_from_what_is_the_same() {
        let of = |set: &[&str]| Asked::of(&resolve("default", set).unwrap());
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
        assert!(!table.contains("ageing_coefficient") && !table.contains("weakening"));
        assert!(differing(&all[..1]).is_empty());
    }
}
