//! Formats summaries for a terminal.

use std::fmt::Write as _;

use asperity_record::{Energy, Part, printable, short};
use serde_json::Value;

use crate::convergence::Convergence;
use crate::key::Key;
use crate::summary::Summary;

/// Replaces a missing value.
const NOTHING: &str = "-";

/// Formats one summary: a line per key, under headings; with other words for its parameter set, if given. Numbers of a
/// recording have no marks.
pub fn of_one(summary: &Summary, parameter_set: Option<&str>) -> String {
    let mut shown = summary.shown();
    // Few runs have energies of parts; of radiated energy a remark says why there is none.
    let of_parts =
        Energy::COLUMNS.iter().filter(|energy| energy.only.is_some_and(|part| part != Part::Radiation));
    let rare: Vec<&str> = of_parts.map(|energy| &*energy.name).collect();
    shown.retain(|(key, value)| !value.is_null() || !rare.contains(&&*key.column.name));
    let lines: Vec<(String, String)> = shown
        .iter()
        .map(|(key, value)| match parameter_set.filter(|_| key.column.name == "parameter_set") {
            Some(words) => (key.label(), words.to_owned()),
            None => (key.label(), with_unit(value, key.column.unit) + &remark(summary, key)),
        })
        .collect();
    let label_width = lines.iter().map(|(label, _)| label.chars().count()).max().unwrap_or(0);
    let is_marked = summary.of_recording.is_none();
    let mut text = String::new();
    let mut group = "";
    for ((key, _), (label, value)) in shown.iter().zip(&lines) {
        if key.group != group {
            let space = if group.is_empty() { "" } else { "\n" };
            writeln!(text, "{space}{}", key.group).expect("a text can be written to");
            group = key.group;
        }
        let mark = if is_marked { key.convergence.mark() } else { "" };
        writeln!(text, "{mark:1} {label:label_width$}  {value}").expect("a text can be written to");
    }
    if is_marked { text + "\n" + &what_marks_mean() } else { text }
}

/// A line for each mark of numbers that are not robust.
pub fn what_marks_mean() -> String {
    let marked = Convergence::ALL.iter().filter(|(.., mark, _)| !mark.is_empty());
    marked.map(|(.., mark, why)| format!("{mark} {why}\n")).collect()
}

/// What a key is called, and its value with its unit.
pub fn of_key(summary: &Summary, name: &str) -> (String, String) {
    let shown = summary.shown();
    let (key, value) =
        shown.iter().find(|(key, _)| key.column.name == name).expect("the name is that of a key");
    (key.label(), with_unit(value, key.column.unit))
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
    ("slip", "events", "event_count"),
    ("they", "mislead", "events_mislead"),
];

/// What recordings have in place of the last ones.
const OF_RECORDINGS: [(&str, &str, &str); 2] =
    [("load", "drops", "load_drop_count"), ("median", "drop, N", "median_load_drop_n")];

/// Formats several summaries: a row each, with the most important numbers.
pub fn of_several<'a>(summaries: impl IntoIterator<Item = &'a Summary>) -> String {
    let summaries: Vec<&Summary> = summaries.into_iter().collect();
    let are_recordings = summaries.iter().all(|summary| summary.of_recording.is_some());
    let (first, last) = COLUMNS.split_at(COLUMNS.len() - OF_RECORDINGS.len());
    let columns = [first, if are_recordings { &OF_RECORDINGS } else { last }].concat();
    let mut rows: Vec<Vec<String>> = vec![
        columns.iter().map(|(above, ..)| (*above).to_owned()).collect(),
        columns.iter().map(|(_, below, _)| (*below).to_owned()).collect(),
    ];
    for shown in summaries.into_iter().map(Summary::shown) {
        let value = |name| shown.iter().find(|(key, _)| key.column.name == name).map(|(_, value)| value);
        rows.push(columns.iter().map(|(.., name)| spelled(value(*name).unwrap_or(&Value::Null))).collect());
    }
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..columns.len()).map(width).collect();
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
