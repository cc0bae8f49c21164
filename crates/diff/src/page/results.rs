//! Consequences of the events that differ: where runs part, which results change, and other differences
//! between the runs.

use asperity_report::html::markup::{Cell, Row, counted, paragraph, section, short, table, text};

use super::words::{name, short_or_zero};
use crate::reading::{number, test};
use crate::report::{KolmogorovSmirnov, Report, Sample};

/// Most rows of a table of downstream changes.
const DOWNSTREAM_MOST: usize = 200;

/// How runs part, and how their events compare from there on.
pub(super) fn beyond(report: &Report) -> String {
    let mut out = String::new();
    for run in &report.runs {
        let Some(horizon) = &run.events.horizon else { continue };
        let beyond = &horizon.beyond;
        let growth = horizon.growth.iter().map(|decade| {
            Row::from(vec![
                Cell::number(format!("{} to {}", decade.from, decade.to)),
                Cell::number(number(decade.from_s)),
                Cell::number(decade.differing),
                Cell::number(short_or_zero(decade.largest_shift_s)),
            ])
        });
        let sample = |quantity: &str, sample: &Sample| {
            let median = |value: Option<f64>| Cell::optional(value.map(short));
            Row::from(vec![
                Cell::text(quantity),
                median(sample.old_median),
                median(sample.new_median),
                Cell::optional(sample.test.map(|test| short(test.distance))),
                Cell::optional(sample.test.map(|test| short(test.p))),
                Cell::text(test(sample)),
            ])
        };
        let statistics = [
            Row::from(vec![
                Cell::text("number of events"),
                Cell::number(beyond.old_events),
                Cell::number(beyond.new_events),
                Cell::None,
                Cell::None,
                Cell::None,
            ]),
            sample("length, blocks (median)", &beyond.length_blocks),
            sample("onset to onset, s (median)", &beyond.recurrence_s),
        ];
        out.push_str(&format!(
            "<details{}><summary>{}: first difference at {} s, after {}</summary>\n{}{}</details>\n",
            if report.runs.len() == 1 { " open" } else { "" },
            text(name(run)),
            number(horizon.at_s),
            counted(horizon.matches_before, "match").replace("matchs", "matches"),
            table(
                "How the difference grows, by decades of matches",
                &["#matches", "#from, s", "#differing", "#largest shift, s"],
                growth
            ),
            table(
                &format!(
                    "From there on, as distributions. The {} test asks whether both sides can be of one \
                     distribution: p is the probability of a distance as large if they are",
                    KolmogorovSmirnov::NAME
                ),
                &["quantity", "#old", "#new", "#distance", "#p at most", "result"],
                statistics
            ),
        ));
    }
    section("Where runs part", &out)
}

/// Its effect on the results derived from the events.
pub(super) fn downstream(report: &Report) -> String {
    let mut out = String::new();
    for run in &report.runs {
        let Some(changes) = run.precursors.as_ref().filter(|changes| !changes.rows.is_empty()) else {
            continue;
        };
        let rows = changes.rows.iter().take(DOWNSTREAM_MOST).map(|row| {
            Row::from(vec![
                Cell::number(number(row.lp_l)),
                Cell::optional(row.old_ft_fn.map(number)),
                Cell::optional(row.new_ft_fn.map(number)),
                Cell::optional(row.old_event),
                Cell::optional(row.new_event),
            ])
        });
        let caption = format!(
            "Precursors of {}: {} of {} rows are the same{}",
            name(run),
            changes.same_rows,
            changes.old_rows.max(changes.new_rows),
            if changes.rows.len() > DOWNSTREAM_MOST {
                format!("; the first {DOWNSTREAM_MOST} that are not")
            } else {
                String::new()
            }
        );
        let headings = ["#L_p/L", "#old F_T/F_N", "#new F_T/F_N", "#old event", "#new event"];
        out.push_str(&table(&caption, &headings, rows));
    }
    if !report.claims.is_empty() {
        let rows = report.claims.iter().map(|claim| {
            let verdict = |verdict: &Option<String>| verdict.as_ref().map_or(Cell::None, Cell::text);
            Row::from(vec![
                Cell::text(&claim.about),
                Cell::text(&claim.run),
                Cell::text(&claim.measure),
                Cell::optional(claim.old_value.map(number)),
                Cell::optional(claim.new_value.map(number)),
                verdict(&claim.old_verdict),
                verdict(&claim.new_verdict),
            ])
        });
        let headings = ["about", "run", "measure", "#old value", "#new value", "old verdict", "new verdict"];
        out.push_str(&format!(
            "<div class=\"wide\">{}</div>\n",
            table("Claims that changed", &headings, rows)
        ));
    }
    section("What follows for the results", &out)
}

/// Differences between the runs beside their events and scenarios; a change shared by many runs is one row.
pub(super) fn provenance(report: &Report) -> String {
    type Change<'a> = (&'a str, Option<&'a str>, Option<&'a str>);
    let mut changes: Vec<(Change<'_>, Vec<String>)> = Vec::new();
    for run in &report.runs {
        for change in run.provenance.iter().filter(|change| !change.is_of_scenario()) {
            let key: Change<'_> = (&change.key, change.old.as_deref(), change.new.as_deref());
            match changes.iter_mut().find(|(other, _)| *other == key) {
                Some((_, names)) => names.push(name(run)),
                None => changes.push((key, vec![name(run)])),
            }
        }
    }
    let value = |value: Option<&str>| {
        value.map_or(Cell::None, |value| Cell::Html(format!("<span class=\"value\">{}</span>", text(value))))
    };
    let rows = changes.iter().map(|((key, old, new), names)| {
        let of = if names.len() == report.runs.len() { "all".to_owned() } else { names.join(", ") };
        Row::from(vec![Cell::text(key), value(*old), value(*new), Cell::Text(of)])
    });
    let mut out = if changes.is_empty() {
        paragraph("Nothing that the files say: the same code and solver, or tables, which do not say.")
    } else {
        table("", &["what", "old", "new", "runs"], rows)
    };
    let left_out: Vec<String> = report
        .runs
        .iter()
        .filter(|run| !run.events.left_out().is_empty())
        .map(|run| {
            let names: Vec<&str> = run.events.left_out().iter().map(|column| column.name()).collect();
            format!("{} ({})", name(run), names.join(", "))
        })
        .collect();
    if !left_out.is_empty() {
        out.push_str(&paragraph(&format!(
            "Columns that one side lacks were not compared: {}.",
            left_out.join("; ")
        )));
    }
    section("What else differs", &out)
}
