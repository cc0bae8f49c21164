//! The first questions of a physicist about two runs: differences in settings, their summary numbers, and
//! their ruptures.

use asperity_report::html::markup::{Cell, Row, counted, paragraph, section, short, table, text};
use serde_json::{Value, json};

use super::findings::events;
use super::words::{class_cell, name};
use crate::column::Column;
use crate::reading::{self, SHOWN, is_there, signed};
use crate::report::{Class, Finding, NumberChange, PairedBy, Report, RunDiff, RuptureDiff, SettingChange};

/// Most ruptures that the page lists of a run, the largest first.
const LISTED_MOST: usize = 50;

/// The keys that were set differently; those that many pairs of runs share are one row.
pub(super) fn settings(report: &Report) -> String {
    let mut settings: Vec<(&SettingChange, Vec<String>)> = Vec::new();
    for run in &report.runs {
        for setting in &run.set_differently {
            match settings.iter_mut().find(|(known, _)| *known == setting) {
                Some((_, names)) => names.push(name(run)),
                None => settings.push((setting, vec![name(run)])),
            }
        }
    }
    if settings.is_empty() {
        return String::new();
    }
    let one = report.runs.len() == 1;
    let has_units = settings.iter().any(|(setting, _)| setting.unit.is_some());
    let rows = settings.iter().map(|(setting, names)| {
        let change = &setting.change;
        let value = |value: &Value| match value {
            Value::Null => Cell::None,
            value => Cell::number(reading::setting(value)),
        };
        let mut cells = vec![
            key(&change.key),
            value(&change.old),
            value(&change.new),
            Cell::number(reading::difference(change)),
        ];
        if has_units {
            cells.push(Cell::text(setting.unit.unwrap_or_default()));
        }
        if !one {
            let all = names.len() == report.runs.len();
            cells.push(Cell::Text(if all { "all".to_owned() } else { names.join(", ") }));
        }
        Row::from(cells)
    });
    let mut headings = vec!["key", "#old", "#new", "#difference"];
    headings.extend(has_units.then_some("unit"));
    headings.extend((!one).then_some("runs"));
    section("Set differently", &format!("<div class=\"wide\">{}</div>\n", table("", &headings, rows)))
}

/// A key, which may break after its points and underscores on a narrow page.
fn key(key: &str) -> Cell {
    let key = text(key);
    let breaking = key.replace('.', ".<wbr>").replace('_', "_<wbr>");
    Cell::Html(format!("<code data-key=\"{key}\">{breaking}</code>"))
}

/// The numbers of the summaries of each pair of runs, those that one asks for first in front.
pub(super) fn numbers(report: &Report) -> String {
    let tables = report.runs.iter().filter(|run| !run.summary.is_empty()).map(|run| {
        let there: Vec<&NumberChange> = run.summary.iter().filter(|number| is_there(number)).collect();
        let (same, differing): (Vec<_>, Vec<_>) =
            there.into_iter().partition(|number| number.old == number.new);
        let (mut first, others): (Vec<_>, Vec<_>) =
            differing.into_iter().partition(|number| SHOWN.contains(&&*number.key));
        first.sort_by_key(|number| SHOWN.iter().position(|key| *key == number.key));
        let reached: Vec<NumberChange> = run
            .ruptures
            .iter()
            .flat_map(|ruptures| &ruptures.reached)
            .map(|of| {
                let key = format!("F_T/F_N when a precursor reached {} L", of.lp_l);
                NumberChange::between(&key, &json!(of.old_ft_fn), &json!(of.new_ft_fn))
            })
            .filter(|number| number.old != number.new)
            .collect();
        first.extend(&reached);
        let mut body = rows(&first);
        for (what, numbers) in [("more that differ", &others), ("identical", &same)] {
            if !numbers.is_empty() {
                let table = rows(numbers);
                body += &format!("<details><summary>{} {what}</summary>\n{table}</details>\n", numbers.len());
            }
        }
        of_run(report, run, &body)
    });
    section("The runs in numbers", &tables.collect::<String>())
}

/// A table of numbers.
fn rows(numbers: &[&NumberChange]) -> String {
    if numbers.is_empty() {
        return paragraph("Of the numbers that one asks for first, none differs.");
    }
    let rows = numbers.iter().map(|number| {
        let name = if number.key.contains(' ') { Cell::text(&number.key) } else { key(&number.key) };
        let difference = (number.old != number.new).then(|| reading::difference(number));
        Row::from(vec![
            name,
            value(&number.old),
            value(&number.new),
            Cell::optional(difference),
            Cell::number(reading::change(number)),
        ])
    });
    let headings = ["number", "#old", "#new", "#difference", "#relative"];
    format!("<div class=\"wide\">{}</div>\n", table("", &headings, rows))
}

/// A part about one of several runs, below its name.
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
        other => Cell::number(reading::setting(other)),
    }
}

/// The fate of the ruptures of each pair of runs.
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

/// The loads at which the ruptures of a pair start, where they differ.
fn load(finding: &Finding) -> Cell {
    let change = finding.columns.iter().find(|change| change.column == Column::FT_FN_ONSET);
    Cell::optional(
        change.map(|change| format!("{} → {}", reading::cell(change.old), reading::cell(change.new))),
    )
}

fn classes(ruptures: &RuptureDiff) -> String {
    let table_diff = &ruptures.table;
    let rows = table_diff
        .counts
        .there()
        .map(|(class, count)| Row::from(vec![class_cell(class), Cell::number(count)]));
    let mut largest: Vec<&Finding> = table_diff.findings.iter().collect();
    largest.sort_by_key(|finding| (finding.class == Class::Open, std::cmp::Reverse(finding.most_blocks())));
    let more = largest.len().saturating_sub(LISTED_MOST);
    largest.truncate(LISTED_MOST);
    let listed = largest.into_iter().map(|finding| {
        Row::from(vec![
            class_cell(finding.class),
            events(&finding.old),
            events(&finding.new),
            Cell::optional(finding.shift_s.map(short)),
            load(finding),
        ])
    });
    let caption = match more {
        0 => "Those that differ, the largest first".to_owned(),
        more => format!("The {LISTED_MOST} largest of those that differ; {more} more are in --format json"),
    };
    let rests_on = match table_diff.window_cycles {
        None => format!("paired by time and blocks, within {} s", short(table_diff.window_s)),
        Some(window) => format!(
            "paired by the cycle between global slips, their place in it, within {} of a cycle, and their blocks, \
             since in time only {} match",
            short(window),
            ruptures.matches_in_time
        ),
    };
    let sentence = format!(
        "{} and {}, {rests_on}.",
        counted(ruptures.old, "old rupture"),
        counted(ruptures.new, "new rupture")
    );
    let pairs = match &ruptures.pairs {
        Some(pairs) if table_diff.paired_by == PairedBy::Cycles => paragraph(&format!(
            "{}, {} of the same blocks. Median differences, new less old: length {} blocks, F_T/F_N at onset {}.",
            counted(pairs.pairs, "pair"),
            pairs.same_blocks,
            signed(pairs.median_length_blocks),
            signed(pairs.median_ft_fn_onset)
        )),
        _ => String::new(),
    };
    let headings = ["class", "old rupture", "new rupture", "#shift, s", "#F_T/F_N at onset"];
    let list = match table_diff.findings.is_empty() {
        true => String::new(),
        false => format!(
            "<details><summary>{}</summary>\n<div class=\"wide\">{}</div></details>\n",
            text(caption),
            table("", &headings, listed)
        ),
    };
    format!("{}{pairs}{}{list}", paragraph(&sentence), table("", &["class", "#matches"], rows))
}
