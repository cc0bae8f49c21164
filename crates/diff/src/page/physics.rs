//! What a physicist asks of two runs first: the numbers that describe them, and their ruptures.

use asperity_report::html::markup::{Cell, Row, counted, paragraph, section, short, table, text};
use serde_json::Value;

use super::findings::events;
use super::words::{class_cell, name};
use crate::report::{Finding, NumberChange, Report, RunDiff, RuptureDiff};

/// Most ruptures that the page lists of a run, the largest first.
const LISTED_MOST: usize = 50;

/// The numbers of the summaries of each pair of runs.
pub(super) fn numbers(report: &Report) -> String {
    let tables = report.runs.iter().filter(|run| !run.summary.is_empty()).map(|run| {
        let told = run.summary.iter().filter(|number| !(number.old.is_null() && number.new.is_null()));
        let rows = told.map(|number| {
            Row::from(vec![Cell::text(&number.key), value(&number.old), value(&number.new), change(number)])
        });
        of_run(report, run, &table("", &["number", "#old", "#new", "#change"], rows))
    });
    section("The runs in numbers", &tables.collect::<String>())
}

/// What belongs to one of several runs, below its name.
fn of_run(report: &Report, run: &RunDiff, body: &str) -> String {
    if report.runs.len() == 1 {
        return body.to_owned();
    }
    format!("<details><summary>{}</summary>\n{body}</details>\n", text(name(run)))
}

fn value(value: &Value) -> Cell {
    match value {
        Value::Null => Cell::None,
        Value::String(text) => Cell::text(text),
        other => Cell::number(other),
    }
}

fn change(number: &NumberChange) -> Cell {
    match number.relative_change {
        _ if number.old == number.new => Cell::number("same"),
        Some(relative) => Cell::number(format!("{} %", short(100.0 * relative))),
        None => Cell::None,
    }
}

/// What became of the ruptures of each pair of runs.
pub(super) fn ruptures(report: &Report) -> String {
    let mut out = String::new();
    for run in &report.runs {
        if let Some(why) = &run.no_ruptures {
            out += &paragraph(&format!("{}: ruptures are not compared: {why}", name(run)));
        }
        let Some(ruptures) = &run.ruptures else { continue };
        out += &of_run(report, run, &classes(ruptures));
    }
    section("Ruptures", &out)
}

fn classes(ruptures: &RuptureDiff) -> String {
    let table_diff = &ruptures.table;
    let rows = table_diff
        .counts
        .there()
        .map(|(class, count)| Row::from(vec![class_cell(class), Cell::number(count)]));
    let mut largest: Vec<&Finding> = table_diff.findings.iter().collect();
    largest.sort_by_key(|finding| std::cmp::Reverse(finding.most_blocks()));
    let more = largest.len().saturating_sub(LISTED_MOST);
    largest.truncate(LISTED_MOST);
    let listed = largest.into_iter().map(|finding| {
        Row::from(vec![
            class_cell(finding.class),
            events(&finding.old),
            events(&finding.new),
            Cell::optional(finding.shift_s.map(short)),
        ])
    });
    let caption = match more {
        0 => "Those that differ, the largest first".to_owned(),
        more => format!("The {LISTED_MOST} largest of those that differ; {more} more are in --format json"),
    };
    let sentence = format!(
        "{} and {}, of which a counterpart was looked for within {} s.",
        counted(ruptures.old, "old rupture"),
        counted(ruptures.new, "new rupture"),
        short(table_diff.window_s)
    );
    format!(
        "{}{}<div class=\"wide\">{}</div>\n",
        paragraph(&sentence),
        table("", &["class", "#matches"], rows),
        table(&caption, &["class", "old rupture", "new rupture", "#shift, s"], listed)
    )
}
