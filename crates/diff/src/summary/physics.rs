//! The first questions of a physicist about two runs: differences in settings, their summary numbers, and
//! their ruptures.

use serde_json::{Value, json};

use super::finding::{by_class, told};
use crate::reading::{SHOWN, change, difference, is_there, setting, signed, value};
use crate::report::{
    Class, Counts, Finding, LengthReached, NumberChange, PairDifferences, PairedBy, Report, RunDiff,
    RuptureDiff,
};

/// Warnings shown if they apply to a run: its slip events then carry little information.
const WARNINGS: [&str; 2] = ["creeps", "raw_events_mislead"];
/// How many ruptures that differ are shown, the largest first.
const FINDINGS: usize = 2;
/// How many keys that were set differently are shown.
const SETTINGS: usize = 4;

pub(super) fn lines(report: &Report, lines: &mut Vec<String>) {
    settings(report, lines);
    numbers(report, lines);
    ruptures(report, lines);
}

/// Differences in settings: for one pair of runs a row for each key, for many one line for all pairs with
/// the same two values.
fn settings(report: &Report, lines: &mut Vec<String>) {
    let key = |unit: Option<&str>, key: &str| unit.map_or(key.to_owned(), |unit| format!("{key} ({unit})"));
    let total = match &report.runs[..] {
        [run] => {
            let rows = run.set_differently.iter().take(SETTINGS).map(|set| {
                let NumberChange { old, new, .. } = &set.change;
                let values = [setting(old), setting(new), difference(&set.change), change(&set.change)];
                let [old, new, difference, change] = values;
                [key(set.unit, &set.change.key), old, new, difference, change]
            });
            let rows: Vec<_> = rows.collect();
            if !rows.is_empty() {
                lines.extend(aligned(
                    ["set differently", "old", "new", "difference", "relative"],
                    &rows,
                    true,
                ));
            }
            run.set_differently.len()
        }
        runs => {
            let mut seen: Vec<(String, usize)> = Vec::new();
            for set in runs.iter().flat_map(|run| &run.set_differently) {
                let NumberChange { old, new, .. } = &set.change;
                let set = format!("{} {} -> {}", key(set.unit, &set.change.key), setting(old), setting(new));
                match seen.iter_mut().find(|(known, _)| *known == set) {
                    Some((_, count)) => *count += 1,
                    None => seen.push((set, 1)),
                }
            }
            for (set, count) in seen.iter().take(SETTINGS) {
                lines.push(format!("set differently: {set} (in {count} pairs)"));
            }
            seen.len()
        }
    };
    if total > SETTINGS {
        lines.push(format!("  ... and {} more keys, see --format json", total - SETTINGS));
    }
}

fn numbers(report: &Report, lines: &mut Vec<String>) {
    let of_key = |key: &'static str| {
        let runs = report.runs.iter();
        runs.filter_map(move |run| {
            Some((
                run,
                run.summary.iter().find(|number| number.key == key).filter(|number| is_there(number))?,
            ))
        })
    };
    let is_true = |key: &&'static str| {
        of_key(key).any(|(_, number)| number.old == Value::Bool(true) || number.new == Value::Bool(true))
    };
    let shown = SHOWN.into_iter().filter(|key| of_key(key).next().is_some());
    let shown = shown.chain(WARNINGS.into_iter().filter(is_true));
    if let [run] = &report.runs[..] {
        let of_run =
            |key: &str| run.summary.iter().find(|number| number.key == key).expect("it is shown").clone();
        let numbers: Vec<NumberChange> = shown.map(of_run).chain(reached(run)).collect();
        numbers_of_run(&numbers, lines);
        let differs = |number: &&NumberChange| number.old != number.new && is_there(number);
        let is_shown = |number: &&NumberChange| numbers.iter().any(|shown| shown.key == number.key);
        let more = run.summary.iter().filter(differs).filter(|number| !is_shown(number)).count();
        if more > 0 {
            lines.push(format!("  ... and {more} more numbers of the summary differ, see --format json"));
        }
        return;
    }
    let rows: Vec<[String; 5]> = shown
        .filter_map(|key| {
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
            Some([
                key.to_owned(),
                format!("differs in {differing} of {}", all.len()),
                most,
                String::new(),
                String::new(),
            ])
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
    lines.extend(aligned(["the runs", "pairs", "", "", ""], &rows, false));
}

/// The numbers of a pair of runs; those that are identical in one line.
fn numbers_of_run(numbers: &[NumberChange], lines: &mut Vec<String>) {
    let (same, differing): (Vec<_>, Vec<_>) = numbers.iter().partition(|number| number.old == number.new);
    let rows: Vec<[String; 5]> = differing
        .into_iter()
        .map(|number| {
            let (old, new) = (value(&number.old), value(&number.new));
            [number.key.clone(), old, new, difference(number), change(number)]
        })
        .collect();
    if !rows.is_empty() {
        lines.extend(aligned(["the runs", "old", "new", "difference", "relative"], &rows, true));
    }
    let names: Vec<&str> = same.iter().map(|number| &*number.key).collect();
    match (names.len(), rows.is_empty()) {
        (0, _) => {}
        (all, true) => lines.push(format!("the runs: all {all} numbers shown here are identical")),
        (some, false) => lines.push(format!("  {some} identical: {}", names.join(", "))),
    }
}

/// The loads at which precursors reached shares of the slider, as numbers.
fn reached(run: &RunDiff) -> Vec<NumberChange> {
    let reached = run.ruptures.iter().flat_map(|ruptures| &ruptures.reached);
    let number = |of: &LengthReached| {
        let key = format!("ft_fn when L_p/L >= {}", of.lp_l);
        NumberChange::between(&key, &json!(of.old_ft_fn), &json!(of.new_ft_fn))
    };
    reached.map(number).collect()
}

/// Rows below a heading, in columns; those after the first flush right if they are numbers.
fn aligned(head: [&str; 5], rows: &[[String; 5]], right: bool) -> Vec<String> {
    let width = |place: usize| {
        let cells = rows.iter().map(|row| row[place].chars().count());
        cells.chain([head[place].chars().count()]).max().unwrap_or(0)
    };
    let widths = [width(0) + 2, width(1), width(2), width(3), width(4)];
    let line = |indent: &str, cells: [&str; 5]| {
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

fn ruptures(report: &Report, lines: &mut Vec<String>) {
    let compared: Vec<_> = report.runs.iter().filter_map(|run| Some((run, run.ruptures.as_ref()?))).collect();
    let counts: Counts = compared.iter().map(|(_, ruptures)| &ruptures.table.counts).sum();
    if !compared.is_empty() {
        let (old, new) = compared.iter().fold((0, 0), |(old, new), (_, of)| (old + of.old, new + of.new));
        lines.push(format!("{old} old and {new} new ruptures: {}", by_class(&counts, "none")));
    }
    for (run, ruptures) in
        compared.iter().filter(|(_, of)| of.table.paired_by == PairedBy::Cycles).take(FINDINGS)
    {
        let of_run = if report.runs.len() > 1 { format!("{} ", run.name()) } else { String::new() };
        lines.push(format!(
            "  {of_run}paired by cycle between global slips and place in it, since in time only {} match",
            ruptures.matches_in_time
        ));
        lines.extend(ruptures.pairs.as_ref().map(pairs));
    }
    let mut differing: Vec<(&RunDiff, &Finding)> = compared
        .iter()
        .flat_map(|&(run, ruptures)| {
            let findings = ruptures.table.findings.iter().filter(move |finding| is_listed(ruptures, finding));
            findings.map(move |finding| (run, finding))
        })
        .collect();
    // A missing rupture of the whole slider matters more than any of a block or two.
    let has_cycles = compared.iter().any(|(_, ruptures)| ruptures.table.paired_by == PairedBy::Cycles);
    differing.sort_by_key(|(_, finding)| {
        (
            // Between parameter sets, numbers that only one run had time to reach matter least.
            has_cycles && finding.class == Class::Open,
            std::cmp::Reverse(finding.most_blocks()),
            finding.class == Class::Shifted,
            finding.class == Class::Open,
        )
    });
    for (run, finding) in differing.iter().take(FINDINGS) {
        let of_run = if report.runs.len() > 1 { format!("{} ", run.name()) } else { String::new() };
        lines.push(format!("  {of_run}{}", told(finding)));
    }
    let more = differing.len().saturating_sub(FINDINGS);
    if more > 0 {
        lines.push(format!("  ... and {more} more, see --format json"));
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

/// Whether a finding is listed: paired by cycles, all pairs differ, so only events without a counterpart
/// are.
fn is_listed(ruptures: &RuptureDiff, finding: &Finding) -> bool {
    ruptures.table.paired_by == PairedBy::Time || finding.old.is_empty() || finding.new.is_empty()
}

/// How the ruptures of pairs differ.
fn pairs(pairs: &PairDifferences) -> String {
    format!(
        "  {} pairs, {} of the same blocks; median differences: length {} blocks, F_T/F_N at onset {}",
        pairs.pairs,
        pairs.same_blocks,
        signed(pairs.median_length_blocks),
        signed(pairs.median_ft_fn_onset)
    )
}

#[cfg(test)]
mod tests {
    use super::aligned;

    #[test]
    fn columns_are_aligned_whatever_is_in_them() {
        let row = |cells: [&str; 5]| cells.map(str::to_owned);
        let rows = [row(["a_s", "1.5", "10.25", "+8.75", "+1 %"]), row(["longer", "2", "-", "", ""])];
        let lines = aligned(["the runs", "old", "new", "by", "change"], &rows, true);
        assert_eq!(
            lines,
            [
                "the runs    old    new     by  change",
                "  a_s       1.5  10.25  +8.75    +1 %",
                "  longer      2      -"
            ]
        );
    }
}
