//! What was set differently, the numbers of the runs, and their ruptures.

use asperity_numbers::{Convergence, Summary};
use asperity_record::counted;
use serde_json::{Value, json};

use super::{
    Block, Cell, FINDINGS_BELOW_PHYSICS, OTHERS, ROWS_MOST, Row, Table, by_class, headings, is_one, line_of,
    merged, num, of_run, optional, side_by_side, table, text,
};
use crate::column::Column;
use crate::reading::{self, SHOWN, is_there, short, signed};
use crate::report::{Class, Counts, Finding, NumberChange, PairedBy, Report, RunDiff};

/// Rows of each table on a terminal, so that all of them fit on a screen of 40 lines.
const SETTINGS: usize = 4;
/// Warnings shown if they apply to a run: its slip events then carry little information.
const WARNINGS: [&str; 2] = ["creeps", "events_mislead"];

/// The keys that were set differently.
pub(super) fn settings(report: &Report) -> Vec<Block> {
    let rows: Vec<Row> = merged(report.runs.iter().flat_map(|run| &run.set_differently))
        .into_iter()
        .map(|(set, pairs)| {
            let change = &set.change;
            let unit = set.unit.map_or_else(String::new, |unit| format!(" ({unit})"));
            let [old, new] = [&change.old, &change.new].map(|value| num(reading::setting(value)));
            let relative =
                if is_one(report) { reading::change(change) } else { counted(pairs as u64, "pair") };
            let key = Cell::Key(format!("{}{unit}", change.key));
            Row::of([key, old, new, num(reading::difference(change)), num(relative)])
        })
        .collect();
    let last = if is_one(report) { "#relative" } else { "#in" };
    let headings = headings(&["set differently", "#old", "#new", "#difference", last]);
    table(Table { headings, rows, on_screen: SETTINGS, more: Some("keys"), ..Table::default() })
}

/// Two values of a number; behind them what it is worth, if it is marked.
fn row_of(change: &NumberChange, is_marked: bool) -> Row {
    let [old, new] = [&change.old, &change.new].map(|value| num(reading::value(value)));
    let mut row = Row::of([
        if change.key.contains(' ') { text(&change.key) } else { Cell::Key(change.key.clone()) },
        old,
        new,
        num(reading::difference(change)),
        num(reading::change(change)),
    ]);
    let key = Summary::KEYS.iter().find(|of| of.column.name == change.key);
    let marked = key.map(|of| of.convergence).filter(|of| *of != Convergence::Robust);
    let worth = marked.map_or_else(String::new, |of| format!("{} {}", of.mark(), of.word()));
    row.cells.extend(is_marked.then(|| text(worth)));
    row
}

/// The numbers of the summaries, those that one asks for first in front.
pub(super) fn numbers(report: &Report) -> Vec<Block> {
    let is_marked = side_by_side(report).is_some_and(|both| !both.are_recordings);
    let heads = ["the runs", "#old", "#new", "#difference", "#relative"].into_iter();
    let heads = headings(&heads.chain(is_marked.then_some("worth")).collect::<Vec<_>>());
    let mut blocks = if is_one(report) { Vec::new() } else { numbers_of_many(report) };
    for run in report.runs.iter().filter(|run| !run.summary.is_empty()) {
        let there = run.summary.iter().filter(|number| is_there(number));
        let is_true = |change: &NumberChange| [&change.old, &change.new].contains(&&Value::Bool(true));
        let is_first = |change: &NumberChange| {
            SHOWN.contains(&&*change.key) || WARNINGS.contains(&&*change.key) && is_true(change)
        };
        let place =
            |change: &NumberChange| SHOWN.iter().position(|key| *key == change.key).unwrap_or(SHOWN.len());
        let (mut first, others): (Vec<NumberChange>, Vec<NumberChange>) = there.cloned().partition(is_first);
        first.sort_by_key(place);
        first.extend(run.ruptures.iter().flat_map(|ruptures| &ruptures.reached).map(|of| {
            let key = format!("ft_fn when L_p/L >= {}", of.lp_l);
            NumberChange::between(&key, &json!(of.old_ft_fn), &json!(of.new_ft_fn))
        }));
        let is_same = |change: &&NumberChange| change.old == change.new;
        let (same, differing): (Vec<&NumberChange>, Vec<&NumberChange>) = first.iter().partition(is_same);
        let (more_same, more): (Vec<&NumberChange>, Vec<&NumberChange>) = others.iter().partition(is_same);
        let of_run = if is_one(report) { String::new() } else { format!("{}: ", run.name()) };
        let folded = |what: String, changes: &mut dyn Iterator<Item = &&NumberChange>| Table {
            caption: format!("{of_run}{what}"),
            headings: heads.clone(),
            rows: changes.map(|change| row_of(change, is_marked)).collect(),
            ..Table::default()
        };
        if is_one(report) {
            let names: Vec<&str> = same.iter().map(|change| &*change.key).collect();
            let on_screen = differing.len();
            let rows = differing.iter().map(|change| row_of(change, is_marked)).collect();
            blocks.extend(table(Table { headings: heads.clone(), rows, on_screen, ..Table::default() }));
            match (names.len(), differing.is_empty()) {
                (0, _) => {}
                (all, true) => {
                    blocks.push(Block::OnScreen(format!(
                        "the runs: all {all} numbers shown here are identical"
                    )));
                }
                (some, false) => {
                    blocks.push(Block::OnScreen(format!("  {some} identical: {}", names.join(", "))));
                }
            }
            if !more.is_empty() {
                blocks.push(Block::OnScreen(format!(
                    "  ... and {} more numbers of the summary differ, see --format json",
                    more.len()
                )));
            }
        }
        let differs: Vec<&NumberChange> =
            if is_one(report) { more } else { differing.into_iter().chain(more).collect() };
        blocks.extend(table(folded(format!("{} more that differ", differs.len()), &mut differs.iter())));
        let same: Vec<&NumberChange> = same.into_iter().chain(more_same).collect();
        blocks.extend(table(folded(format!("{} identical", same.len()), &mut same.iter())));
    }
    blocks
}

/// In how many pairs of runs each number differs, and where most.
pub(super) fn numbers_of_many(report: &Report) -> Vec<Block> {
    let mut rows = Vec::new();
    for key in SHOWN.into_iter().chain(WARNINGS) {
        let of_key = report.runs.iter().filter_map(|run| {
            let number = run.summary.iter().find(|number| number.key == key && is_there(number))?;
            Some((run, number))
        });
        let all: Vec<(&RunDiff, &NumberChange)> = of_key.collect();
        let differing = all.iter().filter(|(_, number)| number.old != number.new).count();
        if differing == 0 {
            continue;
        }
        let relative = |(_, number): &&(&RunDiff, &NumberChange)| number.relative_change.unwrap_or(0.0).abs();
        let largest = all.iter().max_by(|a, b| relative(a).total_cmp(&relative(b)));
        let most =
            largest.filter(|largest| relative(largest) > 0.0).map_or_else(String::new, |(run, number)| {
                let (old, new) = (reading::value(&number.old), reading::value(&number.new));
                format!("most {} in {}: {old} -> {new}", reading::change(number), run.name())
            });
        let differs = format!("differs in {differing} of {}", all.len());
        rows.push(Row::of([Cell::Key(key.to_owned()), text(differs), text(most)]));
    }
    let pairs = report.runs.iter().filter(|run| !run.summary.is_empty()).count();
    if rows.is_empty() && pairs > 0 {
        return vec![Block::Words(format!(
            "precursors, first global slips, loads and recurrence are the same in all {pairs} pairs"
        ))];
    }
    let on_screen = rows.len();
    table(Table { headings: headings(&["the runs", "pairs", ""]), rows, on_screen, ..Table::default() })
}

/// How many ruptures there are, by class, if any are compared.
pub(super) fn fates(report: &Report) -> Option<String> {
    let compared = || report.runs.iter().filter_map(|run| run.ruptures.as_ref());
    let counts: Counts = compared().map(|of| &of.table.counts).sum();
    let (old, new) = compared().fold((0, 0), |(old, new), of| (old + of.old, new + of.new));
    compared().next().map(|_| format!("{old} old and {new} new ruptures: {}", by_class(&counts, "none")))
}

/// The fate of the ruptures.
pub(super) fn ruptures(report: &Report) -> Vec<Block> {
    let compared: Vec<_> = report
        .runs
        .iter()
        .enumerate()
        .filter_map(|(place, run)| Some((place, run, run.ruptures.as_ref()?)))
        .collect();
    let mut blocks: Vec<Block> = fates(report).into_iter().map(Block::Words).collect();
    let by_cycles = || compared.iter().filter(|(.., of)| of.table.paired_by == PairedBy::Cycles);
    for (_, run, ruptures) in by_cycles().take(OTHERS) {
        blocks.push(Block::Words(format!(
            "  {}paired by cycle between global slips and place in it, since in time only {} match",
            of_run(report, run),
            ruptures.matches_in_time
        )));
        blocks.extend(ruptures.pairs.as_ref().map(|pairs| {
            Block::Words(format!(
                "  {} pairs, {} of the same blocks; median differences: length {} blocks, F_T/F_N at onset {}",
                pairs.pairs,
                pairs.same_blocks,
                signed(pairs.median_length_blocks),
                signed(pairs.median_ft_fn_onset)
            ))
        }));
    }
    // Paired by cycles, all pairs differ, so only events without a counterpart are listed.
    let mut differing: Vec<(usize, &Finding)> = Vec::new();
    for (place, _, ruptures) in &compared {
        let is_listed = |finding: &&Finding| {
            ruptures.table.paired_by == PairedBy::Time || finding.old.is_empty() || finding.new.is_empty()
        };
        differing.extend(ruptures.table.findings.iter().filter(is_listed).map(|finding| (*place, finding)));
    }
    // A missing rupture of the whole slider matters more than any of a block or two.
    let has_cycles = by_cycles().next().is_some();
    differing.sort_by_key(|(_, finding)| {
        (
            // Between parameter sets, numbers that only one run had time to reach matter least.
            has_cycles && finding.class == Class::Open,
            std::cmp::Reverse(finding.most_blocks()),
            finding.class == Class::Shifted,
            finding.class == Class::Open,
        )
    });
    let left_out = differing.len().saturating_sub(ROWS_MOST) as u64;
    let rows: Vec<Row> = differing
        .iter()
        .take(ROWS_MOST)
        .map(|(place, finding)| {
            let load = finding.columns.iter().find(|change| change.column == Column::FT_FN_ONSET);
            let load =
                load.map(|change| format!("{} → {}", reading::cell(&change.old), reading::cell(&change.new)));
            Row {
                line: Some(format!("  {}", line_of(report, *place, finding))),
                ..Row::of([
                    Cell::Class(finding.class),
                    Cell::Run(*place, report.runs[*place].name()),
                    Cell::Events(finding.old.clone()),
                    Cell::Events(finding.new.clone()),
                    optional(finding.shift_s.map(short)),
                    optional(load),
                ])
            }
        })
        .collect();
    let caption = format!("Those that differ, the largest first: {}", differing.len());
    blocks.extend(table(Table {
        caption,
        headings: headings(&["class", "run", "old rupture", "new rupture", "#shift, s", "#F_T/F_N at onset"]),
        rows,
        on_screen: FINDINGS_BELOW_PHYSICS,
        left_out,
        ..Table::default()
    }));
    let mut reasons = report.runs.iter().filter_map(|run| run.no_ruptures.as_ref());
    if let Some(why) = reasons.next() {
        let more = match reasons.count() {
            0 => String::new(),
            more => format!(", and so in {more} more"),
        };
        blocks.push(Block::Words(format!("ruptures not compared: {why}{more}")));
    }
    blocks
}
