//! Checks every written value against its key and fills in defaults for the rest.

use std::collections::BTreeMap;

use asperity_record::bounds::{LEAST_MAGNITUDE, MOST_MAGNITUDE};
use asperity_record::unit_of;
use toml::Value;

use crate::scenario::keys::{AS_CODED, KEYS, Key, Kind};
use crate::scenario::keys::{WINDOW, Window};
use crate::scenario::source::{Entries, Entry, ScenarioError};
use crate::scenario::stand_ins::{ALL_KEYS, STAND_INS};
use crate::scenario::suggest;

/// Checks the written values against the key table and adds the defaults: values as those of a scenario.
pub(crate) fn fill_in(entries: &Entries, errors: &mut Vec<ScenarioError>) -> Vec<Value> {
    unknown_keys(&entries.values, &ALL_KEYS, "", errors);
    for key in STAND_INS.iter() {
        entries.values.get(key.path).and_then(|entry| checked(key, key.path, entry, errors));
    }
    let named = entries.values.get("parameter_set").and_then(|entry| entry.value.as_ref());
    let is_as_coded = named.and_then(Value::as_str) == Some(AS_CODED);
    let default = |key: &Key| key.default_in(is_as_coded).expect("only keys of windows lack one").clone();
    let mut values: Vec<Value> = KEYS.iter().map(default).collect();
    let place = |path: &str| KEYS.iter().position(|key| key.path == path);
    let written = entries.values.iter().filter_map(|(path, entry)| Some((place(path)?, entry)));
    // In the order of the keys, as errors are told.
    for (at, entry) in BTreeMap::from_iter(written) {
        if let Some(value) = checked(&KEYS[at], KEYS[at].path, entry, errors) {
            values[at] = value;
        }
    }
    let windows: Vec<Value> = entries
        .windows
        .iter()
        .flatten()
        .map(|window| {
            unknown_keys(window, &Window::keys().iter().collect::<Vec<_>>(), "recording.window.", errors);
            let mut table = toml::Table::new();
            for key in Window::keys() {
                let path = format!("{WINDOW}.{}", key.path);
                match window.get(key.path) {
                    Some(entry) => {
                        if let Some(value) = checked(key, &path, entry, errors) {
                            table.insert(key.path.to_owned(), value);
                        }
                    }
                    None => errors.push(ScenarioError {
                        place: window.values().next().map(|entry| entry.place.clone()),
                        key: Some(path),
                        problem: "missing in this window".to_owned(),
                        accepted: Some(key.kind.to_string()),
                    }),
                }
            }
            Value::Table(table)
        })
        .collect();
    values.push(Value::Array(windows));
    values
}

/// Most unknown keys that get a suggestion, since each search costs time.
const MOST_GUESSED: usize = 100;

fn unknown_keys(
    values: &BTreeMap<String, Entry>,
    known: &[&Key],
    prefix: &str,
    errors: &mut Vec<ScenarioError>,
) {
    let is_known = |path: &str| known.iter().any(|key| key.path == path);
    let unknown = values.iter().filter(|(path, _)| !is_known(path));
    for (index, (path, entry)) in unknown.enumerate() {
        let meant = if index < MOST_GUESSED { suggest::keys(path, known) } else { Vec::new() };
        let meant: Vec<String> = meant.into_iter().map(|key| format!("{prefix}{key}")).collect();
        let problem = format!("unknown key, set to {}{}", entry.written, suggest::did_you_mean(&meant));
        let accepted = "the keys of `asperity scenario show default`";
        errors.push(entry.error(format!("{prefix}{path}"), problem, accepted));
    }
}

/// Checks one written value against its key; pushes an error if it does not fit.
fn checked(key: &Key, path: &str, entry: &Entry, errors: &mut Vec<ScenarioError>) -> Option<Value> {
    let value = entry.value.as_ref();
    let good = value.and_then(|value| key.kind.converted(value));
    let refused = match &good {
        Some(Value::Float(number)) => unusable(key.kind, *number),
        Some(Value::Array(numbers)) => {
            numbers.iter().filter_map(Value::as_float).find_map(|number| unusable(key.kind, number))
        }
        Some(_) => None,
        None => {
            let is_number = matches!(key.kind, Kind::Number(..) | Kind::Numbers(..));
            let is_meant_as_one = value.and_then(Value::as_str).is_some_and(begins_as_number);
            let unit = if is_number && is_meant_as_one { how_numbers_are_written(path) } else { "".into() };
            let meant =
                value.and_then(Value::as_str).map(|word| key.kind.suggestion(word)).unwrap_or_default();
            Some((format!("{} is not accepted{meant}", entry.written), format!("{}{unit}", key.kind)))
        }
    };
    let Some((problem, accepted)) = refused else { return good };
    errors.push(entry.error(path, problem, accepted));
    None
}

/// Why a number cannot be one of a key, and what is accepted.
pub(crate) fn unusable(kind: Kind, value: f64) -> Option<(String, String)> {
    if kind.is_usable(value) {
        let refused = !kind.accepts_number(value);
        return refused.then(|| (format!("{value} is not accepted"), kind.to_string()));
    }
    let size = if value.abs() < 1.0 { "small" } else { "large" };
    let unless_zero = if kind.accepts_number(0.0) { " unless it is 0" } else { "" };
    Some((
        format!("{value:e} is too {size} to calculate with"),
        format!("{kind}, of a magnitude from {LEAST_MAGNITUDE:e} to {MOST_MAGNITUDE:e}{unless_zero}"),
    ))
}

/// Whether a text is meant as a number, as `100mm` and `1,5` are.
fn begins_as_number(text: &str) -> bool {
    text.trim_start_matches(['-', '+', '.', ' ']).starts_with(|c: char| c.is_ascii_digit())
}

/// How the number of a key is written, for someone who wrote its unit or a decimal comma.
fn how_numbers_are_written(path: &str) -> String {
    match unit_of(path) {
        Some(unit) if unit != "1" => format!(", in {unit}, without its unit and with a decimal point"),
        _ => ", with a decimal point".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::fill_in;
    use crate::scenario::Scenario;
    use crate::scenario::keys::KEYS;
    use crate::scenario::source::ScenarioSource;

    #[test]
    fn a_scenario_has_its_values_in_the_order_of_the_keys() {
        let text = "drive.course_s = [1, 2]\ninitial.at_s = 3\n[[recording.window]]\nfrom_s = 0\nto_s = 1\nevery_s = 0.5\n\
                    first_block = 1\nlast_block = 2\n";
        let filled = || fill_in(&ScenarioSource::new("test.toml", text).entries().unwrap(), &mut Vec::new());
        assert_eq!(filled().len(), KEYS.len() + 1);
        assert_eq!(Scenario::of(filled()).values(), filled());
    }
}
