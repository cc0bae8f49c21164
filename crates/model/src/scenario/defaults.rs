//! Checks every written value against its key and fills in defaults for the rest.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use asperity_record::bounds::{LEAST_MAGNITUDE, MOST_MAGNITUDE};
use asperity_record::unit_of;
use toml::Value;

use crate::scenario::keys::{self, AS_STATED, KEYS, Key, Kind};
use crate::scenario::keys::{WINDOW, Window};
use crate::scenario::source::{Entries, Entry, ScenarioError};
use crate::scenario::stand_ins::{self, STAND_INS};
use crate::scenario::suggest;

/// The defaults of the sets as-stated and as-coded.
static DEFAULTS: LazyLock<[toml::Table; 2]> = LazyLock::new(|| {
    [false, true].map(|is_as_coded| {
        let mut table = toml::Table::new();
        for key in KEYS.iter() {
            let default = key.default_in(is_as_coded).expect("only keys of windows lack one");
            insert(&mut table, key.path, default.clone());
        }
        table
    })
});

/// Checks the written values against the key table and adds the defaults.
pub(crate) fn fill_in(entries: &Entries, errors: &mut Vec<ScenarioError>) -> toml::Table {
    unknown_keys(&entries.values, &stand_ins::with_all_keys(), "", errors);
    for key in STAND_INS.iter() {
        entries.values.get(key.path).and_then(|entry| checked(key, key.path, entry, errors));
    }
    let named = entries.values.get("parameter_set").and_then(|entry| entry.value.as_ref());
    let set = named.and_then(Value::as_str).unwrap_or(AS_STATED);
    let mut table = DEFAULTS[usize::from(set == keys::AS_CODED)].clone();
    insert(&mut table, "parameter_set", Value::String(set.to_owned()));
    for key in KEYS.iter() {
        let value = entries.values.get(key.path).and_then(|entry| checked(key, key.path, entry, errors));
        if let Some(value) = value {
            insert(&mut table, key.path, value);
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
    if !windows.is_empty() {
        insert(&mut table, WINDOW, Value::Array(windows));
    }
    table
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

/// Inserts a value under a dotted key.
pub(crate) fn insert(table: &mut toml::Table, path: &str, value: Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
        }
        Some((section, rest)) => {
            let inner =
                table.entry(section).or_insert_with(|| Value::Table(toml::Table::new())).as_table_mut();
            insert(inner.expect("no key is both a value and a section"), rest, value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::fill_in;
    use crate::scenario::Scenario;
    use crate::scenario::keys::KEYS;
    use crate::scenario::keys::Window;
    use crate::scenario::source::ScenarioSource;

    #[test]
    fn key_table_and_fields_agree() {
        // A table with a value for every key deserialises; missing and unknown keys would both
        // fail. Windows are filled in the same way.
        let entries = ScenarioSource::new(
            "test.toml",
            "[[recording.window]]\nfrom_s = 0\nto_s = 1\nevery_s = 0.5\nfirst_block = 1\nlast_block = 2\n",
        );
        let table = fill_in(&entries.entries().unwrap(), &mut Vec::new());
        for key in KEYS.iter() {
            let mut without = toml::Value::Table(table.clone());
            let (section, name) = key.path.rsplit_once('.').unwrap_or(("", key.path));
            let inner = if section.is_empty() { Some(&mut without) } else { without.get_mut(section) };
            inner.unwrap().as_table_mut().unwrap().remove(name).unwrap();
            assert!(without.try_into::<Scenario>().is_err(), "{} is no field", key.path);
        }
        let full: Scenario = toml::Value::Table(table).try_into().unwrap();
        let window = toml::Value::try_from(&full.recording.window[0]).unwrap();
        assert!(
            window.as_table().unwrap().keys().all(|key| Window::keys().iter().any(|known| known.path == key))
        );
    }
}
