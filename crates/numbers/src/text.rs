//! Formats summaries for a terminal.

use std::fmt::Write as _;

use asperity_record::{printable, short};
use serde_json::Value;

use crate::convergence::Convergence;
use crate::key::Key;
use crate::summary::Summary;

/// Replaces a missing value.
const NOTHING: &str = "-";

/// Formats one summary: a line per key, under headings; with other words for its parameter set, if given.
pub fn of_one(summary: &Summary, parameter_set: Option<&str>) -> String {
    let values = summary.values();
    let lines: Vec<(String, String)> = Summary::KEYS
        .iter()
        .zip(&values)
        .map(|(key, value)| match parameter_set.filter(|_| key.column.name == "parameter_set") {
            Some(words) => (key.label(), words.to_owned()),
            None => (key.label(), with_unit(value, key.column.unit) + &remark(summary, key)),
        })
        .collect();
    let label_width = lines.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    let mut group = "";
    for (key, (label, value)) in Summary::KEYS.iter().zip(&lines) {
        if key.group != group {
            let space = if group.is_empty() { "" } else { "\n" };
            writeln!(text, "{space}{}", key.group).expect("a text can be written to");
            group = key.group;
        }
        let mark = key.convergence.mark();
        writeln!(text, "{mark:1} {label:label_width$}  {value}").expect("a text can be written to");
    }
    text.push('\n');
    text.push_str(&what_marks_mean());
    text
}

/// A line for each mark of numbers that are not robust.
pub fn what_marks_mean() -> String {
    let marked = Convergence::ALL.iter().filter(|(.., mark, _)| !mark.is_empty());
    marked.map(|(.., mark, why)| format!("{mark} {why}\n")).collect()
}

/// What a key is called, and its value with its unit.
pub fn of_key(summary: &Summary, name: &str) -> (String, String) {
    let (at, key) = place(name);
    (key.label(), with_unit(&summary.values()[at], key.column.unit))
}

/// The place of a key.
fn place(name: &str) -> (usize, &'static Key) {
    let named = |(_, key): &(usize, &Key)| key.column.name == name;
    Summary::KEYS.iter().enumerate().find(named).expect("the name is that of a key")
}

/// The columns of [`of_several`]: two lines of heading, and the key.
const COLUMNS: [(&str, &str, &str); 10] = [
    ("", "run", "run"),
    ("", "precursors", "precursor_count"),
    ("global", "slips", "global_rupture_count"),
    ("first", "at, s", "first_global_rupture_onset_s"),
    ("its", "F_T/F_N", "first_global_rupture_ft_fn"),
    ("recurrence", "steady, s", "recurrence_steady_s"),
    ("front", "speed, m/s", "front_speed_m_per_s"),
    ("drop of", "F_T/F_N", "global_rupture_drop_ft_fn"),
    ("raw", "events", "event_count"),
    ("they", "mislead", "raw_events_mislead"),
];

/// Formats several summaries: a row each, with the most important numbers.
pub fn of_several<'a>(summaries: impl IntoIterator<Item = &'a Summary>) -> String {
    let mut rows: Vec<Vec<String>> = vec![
        COLUMNS.iter().map(|(above, ..)| (*above).to_owned()).collect(),
        COLUMNS.iter().map(|(_, below, _)| (*below).to_owned()).collect(),
    ];
    let places = COLUMNS.map(|(.., name)| place(name).0);
    for summary in summaries {
        let values = summary.values();
        rows.push(places.iter().map(|place| spelled(&values[*place])).collect());
    }
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..COLUMNS.len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let mut line = format!("{:1$}", row[0], widths[0]);
        for (cell, width) in row.iter().zip(&widths).skip(1) {
            write!(line, "  {cell:>width$}").expect("a text can be written to");
        }
        writeln!(text, "{}", line.trim_end()).expect("a text can be written to");
    }
    text
}

/// Information shown beside the number: which fronts a speed refers to, and the first one over the wave
/// speed.
fn remark(summary: &Summary, key: &Key) -> String {
    let of_waves =
        |speed: f64| Some(speed.abs() / summary.wave_speed_m_per_s?).filter(|ratio| ratio.is_finite());
    match key.column.name.as_ref() {
        "first_global_rupture_front_speed_m_per_s" => {
            let ratio = summary.first_global_rupture_front_speed_m_per_s.and_then(of_waves);
            ratio.map_or(String::new(), |ratio| format!(", {} of the wave speed", short(ratio)))
        }
        "radiated_j" if summary.radiated_j.is_none() && summary.drive_work_j.is_some() => {
            ", no radiation damping".to_owned()
        }
        "front_speed_m_per_s" if summary.front_speed_m_per_s.is_some() => ", median of all fronts".to_owned(),
        _ => String::new(),
    }
}

fn with_unit(value: &Value, unit: Option<&str>) -> String {
    match unit {
        Some(unit) if unit != "1" && !value.is_null() => format!("{} {unit}", spelled(value)),
        _ => spelled(value),
    }
}

/// Formats a value for people: six digits of a number, words for flags.
fn spelled(value: &Value) -> String {
    match value {
        Value::Null => NOTHING.to_owned(),
        Value::Bool(flag) => if *flag { "yes" } else { "no" }.to_owned(),
        // Names come from users.
        Value::String(text) => printable(text).into_owned(),
        Value::Number(number) if number.is_f64() => short(number.as_f64().unwrap_or_default()),
        other => other.to_string(),
    }
}
