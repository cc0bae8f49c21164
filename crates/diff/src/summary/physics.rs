//! What a physicist asks of two runs first: the numbers that describe them, and their ruptures.

use serde_json::Value;

use super::finding::{by_class, told};
use crate::report::{Class, Counts, Finding, NumberChange, Report, RunDiff};

/// The numbers of a summary that are shown, in this order: precursors, the first slip of the whole
/// slider and its load, how often such slips come back and what they take of the load, and how
/// fast fronts run. The rest is in the JSON.
const SHOWN: [&str; 9] = [
    "precursor_count",
    "first_global_rupture_onset_s",
    "first_global_rupture_ft_fn",
    "largest_ft_fn",
    "global_rupture_count",
    "recurrence_transient_s",
    "recurrence_steady_s",
    "global_rupture_drop_ft_fn",
    "front_speed_m_per_s",
];
/// What is shown where it is true of a run: slip events say little there.
const WARNINGS: [&str; 2] = ["creeps", "raw_events_mislead"];
/// How many ruptures that differ are shown, the largest first.
const FINDINGS: usize = 4;

pub(super) fn lines(report: &Report, lines: &mut Vec<String>) {
    numbers(report, lines);
    ruptures(report, lines);
}

fn numbers(report: &Report, lines: &mut Vec<String>) {
    let of_key = |key: &'static str| {
        let runs = report.runs.iter();
        runs.filter_map(move |run| {
            Some((run, run.summary.iter().find(|number| number.key == key).filter(|number| is_told(number))?))
        })
    };
    let is_true = |key: &&'static str| {
        of_key(key).any(|(_, number)| number.old == Value::Bool(true) || number.new == Value::Bool(true))
    };
    let shown = SHOWN.into_iter().filter(|key| of_key(key).next().is_some());
    let shown = shown.chain(WARNINGS.into_iter().filter(is_true));
    let rows: Vec<[String; 4]> = shown
        .filter_map(|key| {
            if let [run] = &report.runs[..] {
                let number = run.summary.iter().find(|number| number.key == key).expect("it is shown");
                return Some([key.to_owned(), value(&number.old), value(&number.new), change(number)]);
            }
            let all: Vec<(&RunDiff, &NumberChange)> = of_key(key).collect();
            let differing = all.iter().filter(|(_, number)| number.old != number.new).count();
            if differing == 0 {
                return None;
            }
            let largest = all
                .iter()
                .filter_map(|(run, number)| Some((run, number, number.relative_change?)))
                .filter(|(.., relative)| *relative != 0.0)
                .max_by(|a, b| a.2.abs().total_cmp(&b.2.abs()));
            let most = largest.map_or_else(String::new, |(run, number, _)| {
                let (old, new) = (value(&number.old), value(&number.new));
                format!("most {} in {}: {old} -> {new}", change(number), run.name())
            });
            Some([key.to_owned(), format!("differs in {differing} of {}", all.len()), most, String::new()])
        })
        .collect();
    if rows.is_empty() {
        let pairs = report.runs.iter().filter(|run| !run.summary.is_empty()).count();
        if pairs > 0 {
            lines.push(format!(
                "precursors, first global slips, loads and recurrence are the same in all {pairs} pairs"
            ));
        }
        return;
    }
    let one = report.runs.len() == 1;
    let head = if one { ["the runs", "old", "new", "change"] } else { ["the runs", "pairs", "", ""] };
    lines.extend(aligned(head, &rows, one));
}

/// Whether either run has the number at all.
fn is_told(number: &NumberChange) -> bool {
    !(number.old.is_null() && number.new.is_null())
}

/// Rows below a heading, in columns; those after the first flush right if they are numbers.
fn aligned(head: [&str; 4], rows: &[[String; 4]], right: bool) -> Vec<String> {
    let width = |place: usize| {
        let cells = rows.iter().map(|row| row[place].chars().count());
        cells.chain([head[place].chars().count()]).max().unwrap_or(0)
    };
    let widths = [width(0) + 2, width(1), width(2), width(3)];
    let line = |indent: &str, cells: [&str; 4]| {
        let mut line = format!("{:1$}", format!("{indent}{}", cells[0]), widths[0]);
        for (cell, width) in cells.iter().zip(widths).skip(1) {
            line += "  ";
            line += &if right { format!("{cell:>width$}") } else { format!("{cell:width$}") };
        }
        line.trim_end().to_owned()
    };
    let rows = rows.iter().map(|row| line("  ", row.each_ref().map(String::as_str)));
    [line("", head)].into_iter().chain(rows).collect()
}

/// Six digits tell what a difference of a part in a million is one of.
fn value(value: &Value) -> String {
    match value {
        Value::Null => "-".to_owned(),
        Value::Number(number) if number.is_f64() => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            let magnitude = if number == 0.0 { 0 } else { number.abs().log10().floor() as i32 };
            match magnitude {
                -4..6 => format!("{number:.*}", usize::try_from(5 - magnitude).unwrap_or(0)),
                _ => format!("{number:.5e}"),
            }
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

fn change(number: &NumberChange) -> String {
    match number.relative_change {
        _ if number.old == number.new => "same".to_owned(),
        Some(relative) if relative.abs() >= 5e-5 => format!("{:+.2} %", 100.0 * relative),
        Some(relative) => format!("{relative:+.0e}"),
        None => String::new(),
    }
}

fn ruptures(report: &Report, lines: &mut Vec<String>) {
    let compared: Vec<_> = report.runs.iter().filter_map(|run| Some((run, run.ruptures.as_ref()?))).collect();
    let counts: Counts = compared.iter().map(|(_, ruptures)| &ruptures.table.counts).sum();
    if !compared.is_empty() {
        let (old, new) = compared.iter().fold((0, 0), |(old, new), (_, of)| (old + of.old, new + of.new));
        lines.push(format!("{old} old and {new} new ruptures: {}", by_class(&counts, "none")));
    }
    let mut differing: Vec<(&RunDiff, &Finding)> = compared
        .iter()
        .flat_map(|(run, ruptures)| ruptures.table.findings.iter().map(move |finding| (*run, finding)))
        .collect();
    // A missing rupture of the whole slider matters more than any of a block or two.
    differing.sort_by_key(|(_, finding)| {
        (
            std::cmp::Reverse(finding.most_blocks()),
            finding.class == Class::Shifted,
            finding.class == Class::Open,
        )
    });
    for (run, finding) in differing.iter().take(FINDINGS) {
        let of_run = if report.runs.len() > 1 { format!("{} ", run.name()) } else { String::new() };
        lines.push(format!("  {of_run}{}", told(finding)));
    }
    let more = counts.differing().saturating_sub(FINDINGS as u64);
    if more > 0 {
        lines.push(format!("  ... and {more} smaller ones, see --format json"));
    }
    let mut reasons = report.runs.iter().filter_map(|run| run.no_ruptures.as_ref());
    if let Some(why) = reasons.next() {
        let more = match reasons.count() {
            0 => String::new(),
            more => format!(", and so in {more} more"),
        };
        lines.push(format!("ruptures not compared: {why}{more}"));
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::{aligned, change, value};
    use crate::report::NumberChange;

    #[test]
    fn numbers_have_six_digits_and_changes_are_in_percent() {
        let told = |old, new| {
            let number = NumberChange::between("a_s", &old, &new);
            [value(&number.old), value(&number.new), change(&number)]
        };
        assert_eq!(told(json!(55), json!(58)), ["55", "58", "+5.45 %"]);
        assert_eq!(told(json!(2.6346976), json!(2.62232)), ["2.63470", "2.62232", "-0.47 %"]);
        assert_eq!(told(json!(-2.0), json!(-1.0)), ["-2.00000", "-1.00000", "+50.00 %"]);
        assert_eq!(told(json!(123456.7), json!(123456.8)), ["123457", "123457", "+8e-7"]);
        assert_eq!(told(json!(1.5e-9), json!(1.5e-9)), ["1.50000e-9", "1.50000e-9", "same"]);
        assert_eq!(told(json!(0.0), json!(0.25)), ["0.00000", "0.250000", ""]);
        assert_eq!(told(json!(null), json!(3)), ["-", "3", ""]);
        assert_eq!(told(json!(false), json!(true)), ["false", "true", ""]);
    }

    #[test]
    fn columns_are_aligned_whatever_is_in_them() {
        let row = |cells: [&str; 4]| cells.map(str::to_owned);
        let rows = [row(["a_s", "1.5", "10.25", "+1 %"]), row(["longer", "2", "-", ""])];
        let lines = aligned(["the runs", "old", "new", "change"], &rows, true);
        assert_eq!(
            lines,
            ["the runs    old    new  change", "  a_s       1.5  10.25    +1 %", "  longer      2      -"]
        );
    }
}
