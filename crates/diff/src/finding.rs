//! Findings in one line each.

use std::fmt::Write;

use asperity_record::{BoundingBox, Cell};

use crate::reading::{cell as cell_value, number};
use crate::report::{CellChange, Class, Extent, Finding};

/// A finding in one line.
pub(crate) fn told(finding: &Finding) -> String {
    let allowed = if finding.allowed { "allowed: " } else { "" };
    let numbers = |events: &[Extent]| match events {
        [] => String::new(),
        [one] => one.event.to_string(),
        [first, .., last] => format!("{} to {}", first.event, last.event),
    };
    let place = |events: &[Extent]| {
        let [first, ..] = events else { return String::new() };
        let of = BoundingBox::over(events.iter().map(Extent::bounding_box)).unwrap_or(first.bounding_box());
        let blocks = Extent::words(of, first.first_across.is_some(), "-");
        format!("{blocks} at {} s", number(first.onset_s))
    };
    let (old, new) = (numbers(&finding.old), numbers(&finding.new));
    let text = match finding.class {
        Class::Missing => format!("missing: old {old}, {}", place(&finding.old)),
        Class::Extra => format!("extra: new {new}, {}", place(&finding.new)),
        Class::Split | Class::Merged => {
            let whole = if finding.class == Class::Split { &finding.old } else { &finding.new };
            format!(
                "{}: old {old}, new {new}, {}{}",
                finding.class.name(),
                place(whole),
                conservation(finding)
            )
        }
        class => {
            let place = place(if finding.old.is_empty() { &finding.new } else { &finding.old });
            let who = match (finding.old.is_empty(), finding.new.is_empty()) {
                (false, false) => format!("old {old}, new {new}"),
                (false, true) => format!("old {old}"),
                (true, _) => format!("new {new}"),
            };
            let cells: Vec<String> = finding.columns.iter().map(cell).collect();
            let shown = if cells.len() > 3 {
                format!("{} and {} more columns", cells[..2].join(", "), cells.len() - 2)
            } else {
                cells.join(", ")
            };
            let why = if shown.is_empty() { finding.rule.clone() } else { shown };
            format!("{}: {who}, {place}: {why}", class.name())
        }
    };
    format!("{allowed}{text}")
}

fn conservation(finding: &Finding) -> String {
    let Some(kept) = finding.conservation else { return String::new() };
    let mut text = String::new();
    if !kept.duration_conserved {
        let lost_s = kept.new_duration_s - kept.old_duration_s;
        text = format!("; slides {lost_s:+.1e} s of {:.1e} s", kept.old_duration_s);
    }
    if !kept.blocks_conserved {
        write!(text, "; {} blocks become {}", kept.old_blocks, kept.new_blocks)
            .expect("writing to a string cannot fail");
    }
    if text.is_empty() { "; duration and blocks conserved".to_owned() } else { text }
}

/// A cell: both values if they are whole or one is missing, otherwise the old one and the difference, which
/// may be visible in the last digits only.
fn cell(change: &CellChange) -> String {
    let CellChange { column, old, new, difference, .. } = change;
    match (old, new, difference) {
        (Cell::Number(old), Cell::Number(new), Some(_)) => {
            format!("{column} {} {:+.2e}", number(*old), new - old)
        }
        _ => format!("{column} {} -> {}", cell_value(old), cell_value(new)),
    }
}
