//! The list of findings: the events, their differences, the rule.

use asperity_report::html::markup::{Cell, Row, paragraph, section, short, table, text};

use super::words::{class_cell, name, short_or_zero};
use crate::reading::{cell, number};
use crate::report::{CellChange, Extent, Finding, Report};

/// Most findings that the page lists; the timeline shows all of them.
pub(super) const LISTED_MOST: usize = 2000;
/// Fewest findings of a run that are listed, however many other runs have.
const LISTED_OF_RUN: usize = 50;

/// The findings that fit, each with the index of its run: the first ones of every run, beginning with those
/// that the policy does not allow.
pub(super) fn listed(report: &Report) -> Vec<(usize, &Finding)> {
    let room = (LISTED_MOST / report.runs.len().max(1)).max(LISTED_OF_RUN);
    let mut left =
        LISTED_MOST.saturating_sub(report.runs.iter().map(|run| run.events.findings.len().min(room)).sum());
    let mut listed = Vec::new();
    for (place, run) in report.runs.iter().enumerate() {
        let more = run.events.findings.len().saturating_sub(room).min(left);
        left -= more;
        let mut chosen: Vec<(usize, &Finding)> = run.events.findings.iter().enumerate().collect();
        chosen.sort_by_key(|(_, finding)| finding.allowed);
        chosen.truncate(room + more);
        chosen.sort_by_key(|&(number, _)| number);
        listed.extend(chosen.into_iter().map(|(_, finding)| (place, finding)));
    }
    listed
}

/// Events by number, with their times and blocks.
pub(super) fn events(events: &[Extent]) -> Cell {
    if events.is_empty() {
        return Cell::None;
    }
    let lines: Vec<String> = events
        .iter()
        .map(|event| {
            let end = event.end_s.map_or("the run's end".to_owned(), |end| format!("{} s", number(end)));
            let blocks = Extent::words(event.bounding_box(), event.first_across.is_some(), " to ");
            format!(
                "<b>{}</b> <span class=\"value\">{} s to {}</span>, {blocks}",
                event.event,
                number(event.onset_s),
                text(end)
            )
        })
        .collect();
    Cell::Html(lines.join("<br>"))
}

fn cell_change(change: &CellChange) -> String {
    let measured = change.difference.map_or(String::new(), |difference| {
        format!(
            " <span class=\"soft\">(by {}, allowed {})</span>",
            short(difference),
            short_or_zero(change.tolerance)
        )
    });
    format!(
        "{} <span class=\"value\">{} → {}</span>{measured}",
        text(change.column),
        text(cell(change.old)),
        text(cell(change.new))
    )
}

/// The differences, column by column; for a split or merge, the preserved quantities.
fn differences(finding: &Finding) -> Cell {
    let mut lines: Vec<String> = finding.columns.iter().map(cell_change).collect();
    if let Some(kept) = &finding.conservation {
        let word = |conserved: bool| if conserved { "conserved" } else { "not conserved" };
        lines.push(format!(
            "duration {}: <span class=\"value\">{} s → {} s</span>",
            word(kept.duration_conserved),
            short(kept.old_duration_s),
            short(kept.new_duration_s)
        ));
        lines.push(format!(
            "blocks {}: <span class=\"value\">{} → {}</span>",
            word(kept.blocks_conserved),
            kept.old_blocks,
            kept.new_blocks
        ));
    }
    if lines.is_empty() { Cell::None } else { Cell::Html(lines.join("<br>")) }
}

pub(super) fn findings(report: &Report, listed: &[(usize, &Finding)]) -> String {
    let total: u64 =
        report.runs.iter().map(|run| run.events.findings.len() as u64 + run.events.findings_left_out).sum();
    if total == 0 {
        return String::new();
    }
    let rows = listed.iter().enumerate().map(|(place, &(run, finding))| Row {
        attributes: format!(" data-finding=\"{place}\" tabindex=\"0\""),
        cells: vec![
            class_cell(finding.class),
            Cell::text(name(&report.runs[run])),
            events(&finding.old),
            events(&finding.new),
            differences(finding),
            Cell::Text(if finding.allowed {
                format!("{}; allowed by the policy", finding.rule)
            } else {
                finding.rule.clone()
            }),
        ],
    });
    let headings = ["class", "run", "old event", "new event", "what differs", "rule"];
    let left_out = total - listed.len() as u64;
    let more = if left_out > 0 {
        paragraph(&format!("{left_out} more are not listed here; --format json and --matches have them."))
    } else {
        String::new()
    };
    section(
        "Findings",
        &format!(
            "<p class=\"needs-script\">Those of the run and classes that are shown above; a click leads to the place in \
             the timelines.</p>\n{more}<div class=\"list\">{}</div>\n",
            table("", &headings, rows)
        ),
    )
}
