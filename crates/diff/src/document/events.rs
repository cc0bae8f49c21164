//! The fate of the slip events, and what follows from it.

use asperity_record::counted;

use super::{
    Block, Cell, FINDINGS_BELOW_PHYSICS, OTHERS, ROWS_MOST, Row, Table, by_class, events, headings, is_one,
    line_of, merged, num, of_run, optional, table, text, title,
};
use crate::reading::{self, number, short};
use crate::report::{
    CellChange, Class, ColumnChange, Counts, Finding, Growth, Horizon, KolmogorovSmirnov, PairedBy, Report,
    RunDiff, Sample,
};
use crate::side_by_side::SideBySide;

const RUNS: usize = 5;
const FINDINGS: usize = 8;
/// Findings of each class that a report needs for a terminal.
pub const KEPT_OF_A_CLASS: usize = FINDINGS;
/// Most findings that a page lists; the timeline shows all of them.
pub(crate) const LISTED_MOST: usize = 2000;
/// Fewest findings of a run that are listed, however many other runs have.
const LISTED_OF_RUN: usize = 50;
const COLUMNS: usize = 2;
/// The classes by importance: events that appeared or vanished, changed, or moved.
const BY_WEIGHT: [Class; 7] =
    [Class::Missing, Class::Extra, Class::Split, Class::Merged, Class::Changed, Class::Open, Class::Shifted];

/// Sort key by the differences of a run: those that are not allowed come first.
pub(super) fn weight(run: &RunDiff) -> (u64, u64) {
    (run.events.refused(), run.events.counts.differing())
}

/// The runs by weight, those with the most differences first, each with its place.
pub(super) fn by_weight(report: &Report) -> Vec<(usize, &RunDiff)> {
    let mut runs: Vec<(usize, &RunDiff)> = report.runs.iter().enumerate().collect();
    runs.sort_by_key(|(_, run)| std::cmp::Reverse(weight(run)));
    runs
}

/// The fate of the events of each pair of runs.
pub(super) fn runs(report: &Report) -> Vec<Block> {
    let mut blocks = vec![Block::OnScreen(events(report))];
    let there: Vec<Class> = report.counts.there().map(|(class, _)| class).collect();
    let mut heads = headings(&["run", "#old events", "#new events"]);
    heads.extend(there.iter().map(|class| format!("#{}", title(*class))));
    heads.extend(headings(&["#largest shift, s", "#first difference, s"]));
    let rows = by_weight(report).into_iter().map(|(place, run)| {
        let diff = &run.events;
        let mut cells = vec![Cell::Run(place, run.name()), num(run.old.events), num(run.new.events)];
        cells.extend(there.iter().map(|&class| optional(Some(diff.counts[class]).filter(|&n| n > 0))));
        cells.push(optional(Some(diff.largest_shift_s).filter(|&shift| shift > 0.0).map(short)));
        cells.push(optional(diff.horizon.as_ref().map(|horizon| number(horizon.at_s))));
        Row {
            line: Some(format!("  {}: {}", run.name(), by_class(&diff.counts, "no events"))),
            cells,
            finding: None,
        }
    });
    let differing = report.runs.iter().filter(|run| run.events.counts.differing() > 0).count();
    let on_screen = if is_one(report) { 0 } else { differing.min(RUNS) };
    blocks.extend(table(Table {
        headings: heads,
        rows: rows.collect(),
        is_of_runs: true,
        on_screen,
        ..Table::default()
    }));
    match (differing.saturating_sub(RUNS), report.runs.len() - differing) {
        (0, same) if same == report.runs.len() || same == 0 => {}
        (0, same) => blocks.push(Block::OnScreen(format!("  in {same} more nothing differs"))),
        (more, same) => blocks.push(Block::OnScreen(format!(
            "  {more} more differ, see --format json; in {same} nothing differs"
        ))),
    }
    blocks
}

/// The findings that fit on a page, each with the index of its run: the first ones of every run, beginning with
/// those that the policy does not allow.
pub(crate) fn listed(report: &Report) -> Vec<(usize, &Finding)> {
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

/// The findings that a terminal shows: those not allowed first, a few of each class before more of any. Paired
/// by cycles, no event is the one before.
pub(super) fn on_screen<'a>(report: &Report, listed: &[(usize, &'a Finding)]) -> Vec<(usize, &'a Finding)> {
    let has_physics = report.runs.iter().any(|run| run.ruptures.is_some());
    let most = if has_physics { FINDINGS_BELOW_PHYSICS } else { FINDINGS };
    let in_time = |place: usize| report.runs[place].events.paired_by == PairedBy::Time;
    let weight = |finding: &Finding| BY_WEIGHT.iter().position(|&class| class == finding.class);
    let mut of_class = [0; Class::ALL.len()];
    let mut ranked: Vec<(usize, (usize, &Finding))> = Vec::new();
    let mut sorted: Vec<(usize, &Finding)> =
        listed.iter().copied().filter(|(place, _)| in_time(*place)).collect();
    sorted.sort_by_key(|(_, finding)| (finding.allowed, weight(finding)));
    for (place, finding) in sorted {
        let number = &mut of_class[finding.class as usize];
        ranked.push((*number / most.div_ceil(3), (place, finding)));
        *number += 1;
    }
    ranked.sort_by_key(|(round, _)| *round);
    ranked.truncate(most);
    let mut chosen: Vec<(usize, &Finding)> = ranked.into_iter().map(|(_, chosen)| chosen).collect();
    chosen.sort_by_key(|(_, finding)| (finding.allowed, weight(finding)));
    chosen
}

pub(super) fn findings(report: &Report, listed: &[(usize, &Finding)]) -> Vec<Block> {
    let in_time = report.runs.iter().filter(|run| run.events.paired_by == PairedBy::Time);
    let total: u64 = in_time.map(|run| run.events.counts.differing()).sum();
    let shown = on_screen(report, listed);
    let mut blocks = Vec::new();
    if !shown.is_empty() {
        let of = match total.saturating_sub(shown.len() as u64) {
            0 => String::new(),
            _ => format!(", {} of {total} (see --format json)", shown.len()),
        };
        blocks.push(Block::OnScreen(format!("what became of which events{of}:")));
    }
    let lines = shown.into_iter().map(|(place, finding)| format!("  {}", line_of(report, place, finding)));
    blocks.extend(lines.map(Block::OnScreen));
    let rows = listed.iter().enumerate().map(|(number, &(place, finding))| Row {
        finding: Some(number),
        ..Row::of([
            Cell::Class(finding.class),
            Cell::Text(report.runs[place].name()),
            Cell::Events(finding.old.clone()),
            Cell::Events(finding.new.clone()),
            Cell::Lines(differences(finding)),
            text(format!("{}{}", finding.rule, if finding.allowed { "; allowed by the policy" } else { "" })),
        ])
    });
    let all = report.runs.iter().map(|run| run.events.findings.len() as u64 + run.events.findings_left_out);
    blocks.extend(table(Table {
        headings: headings(&["class", "run", "old event", "new event", "what differs", "rule"]),
        rows: rows.collect(),
        left_out: all.sum::<u64>() - listed.len() as u64,
        ..Table::default()
    }));
    blocks
}

/// The differences, column by column; for a split or merge, the preserved quantities.
pub(super) fn differences(finding: &Finding) -> Vec<String> {
    let cell = |change: &CellChange| {
        let measured = change.difference.map_or(String::new(), |difference| {
            format!(" (by {}, allowed {})", short(difference), short(change.tolerance))
        });
        let [old, new] = [&change.old, &change.new].map(reading::cell);
        format!("{} {old} → {new}{measured}", change.column)
    };
    let mut lines: Vec<String> = finding.columns.iter().map(cell).collect();
    if let Some(kept) = &finding.conservation {
        let word = |conserved: bool| if conserved { "conserved" } else { "not conserved" };
        let [old_s, new_s] = [kept.old_duration_s, kept.new_duration_s].map(short);
        lines.push(format!("duration {}: {old_s} s → {new_s} s", word(kept.duration_conserved)));
        let (old, new) = (kept.old_blocks, kept.new_blocks);
        lines.push(format!("blocks {}: {old} → {new}", word(kept.blocks_conserved)));
    }
    lines
}

/// The columns that differ between paired events, over all runs paired in time.
pub(super) fn columns(report: &Report) -> Vec<Block> {
    let mut largest: Vec<(&RunDiff, ColumnChange)> = Vec::new();
    for run in report.runs.iter().filter(|run| run.events.paired_by == PairedBy::Time) {
        for change in &run.events.column_changes {
            match largest.iter_mut().find(|(_, known)| known.column == change.column) {
                None => largest.push((run, change.clone())),
                Some((of, known)) => {
                    let differing = known.differing + change.differing;
                    let beyond_tolerance = known.beyond_tolerance + change.beyond_tolerance;
                    if change.largest > known.largest {
                        (*of, *known) = (run, change.clone());
                    }
                    (known.differing, known.beyond_tolerance) = (differing, beyond_tolerance);
                }
            }
        }
    }
    largest.sort_by_key(|(_, change)| (std::cmp::Reverse(change.beyond_tolerance), change.column));
    let rows = largest.iter().map(|(run, change)| {
        let [old, new] = [change.old_event, change.new_event];
        Row::of([
            text(change.column),
            num(change.differing),
            num(change.beyond_tolerance),
            num(short(change.largest)),
            text(format!("{}old {old}, new {new}", of_run(report, run))),
        ])
    });
    let heads = ["columns of pairs", "#differ", "#beyond tolerance", "#at most by", "between"];
    let mut blocks = table(Table {
        headings: headings(&heads),
        rows: rows.collect(),
        on_screen: COLUMNS,
        ..Table::default()
    });
    let left_out = merged(report.runs.iter().map(|run| run.events.left_out()).filter(|out| !out.is_empty()));
    blocks.extend(left_out.iter().take(1).map(|(columns, _)| {
        let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        let names = names.join(", ");
        Block::Words(format!("not compared, because a side lacks them or counts other steps: {names}"))
    }));
    blocks
}

/// How runs part, and how their events compare from there on. A terminal shows that of the run with most that
/// differs.
pub(super) fn beyond(report: &Report) -> Vec<Block> {
    let mut blocks = Vec::new();
    let part = by_weight(report).into_iter().filter_map(|(_, run)| Some((run, run.events.horizon.as_ref()?)));
    for (n, (run, horizon)) in part.enumerate() {
        let Horizon { at_s, class, matches_before, growth, beyond, .. } = horizon;
        let which = if is_one(report) { String::new() } else { format!(" of {}", run.name()) };
        let words: fn(String) -> Block = if n == 0 { Block::Words } else { Block::OnPage };
        let mut first = String::new();
        if run.events.paired_by == PairedBy::Time {
            let share = |decade: &Growth| {
                let share = 100.0 * decade.differing as f64 / (decade.to - decade.from + 1) as f64;
                format!("{share:.0} % of {}-{}", decade.from, decade.to)
            };
            first = format!(
                "first difference{which}: {} at {} s, after {matches_before} events that agree; by number of the \
                 match differ {}; ",
                class.name(),
                number(*at_s),
                growth.iter().map(share).collect::<Vec<_>>().join(", ")
            );
        }
        blocks.push(words(format!(
            "{first}from {} s on, where the order of events is chaotic, compare statistics: {} old and {} new \
             events{which}; {} test of one distribution:",
            number(*at_s),
            beyond.old_events,
            beyond.new_events,
            KolmogorovSmirnov::NAME
        )));
        blocks.push(Block::Table(Table {
            caption: if n == 0 { String::new() } else { format!("From {} s on{which}", number(*at_s)) },
            on_screen: if n == 0 { 2 } else { 0 },
            ..samples(vec![
                sample("lengths, blocks", &beyond.length_blocks, reading::test(&beyond.length_blocks)),
                sample("onset to onset, s", &beyond.recurrence_s, reading::test(&beyond.recurrence_s)),
            ])
        }));
    }
    blocks
}

/// The distributions of the ruptures of two parameter sets.
pub(super) fn distributions(of: &SideBySide) -> Vec<Block> {
    let tested = |quantity: &str, of: &Sample| {
        let [old, new] = of.counts;
        sample(quantity, of, format!("{}, n = {old} and {new}", reading::test(of)))
    };
    let rows: Vec<Row> = of.quantities.iter().map(|(quantity, sample)| tested(quantity, sample)).collect();
    let words = format!(
        "ruptures from the first global slip on, or all of a run without one; {} test of one distribution:",
        KolmogorovSmirnov::NAME
    );
    let table = Table { on_screen: rows.len(), ..samples(rows) };
    vec![Block::Figures(of.distributions.clone()), Block::Words(words), Block::Table(table)]
}

/// A table of tested distributions.
fn samples(rows: Vec<Row>) -> Table {
    let headings = headings(&["medians", "#old", "#new", "#distance", "result"]);
    Table { headings, rows, ..Table::default() }
}

fn sample(quantity: &str, sample: &Sample, test: String) -> Row {
    let [old, new] = [sample.old_median, sample.new_median].map(|median| median.map(short));
    let median = |side: &Option<String>| side.clone().unwrap_or("-".to_owned());
    let medians = format!("{} and {}", median(&old), median(&new));
    Row {
        line: Some(format!("  {quantity}: {test}, medians {medians}")),
        ..Row::of([
            text(quantity),
            optional(old),
            optional(new),
            optional(sample.test.map(|test| short(test.distance))),
            text(test),
        ])
    }
}

/// Its effect on the results derived from the events.
pub(super) fn downstream(report: &Report) -> Vec<Block> {
    let mut blocks = Vec::new();
    let changed = report.runs.iter().filter_map(|run| Some((run, run.precursors.as_ref()?)));
    let rows: Vec<_> =
        changed.flat_map(|(run, changes)| changes.rows.iter().map(move |row| (run, row))).collect();
    if !rows.is_empty() {
        let runs = merged(rows.iter().map(|(run, _)| run.name())).len();
        let differences = rows.iter().filter_map(|(_, row)| Some((row.new_ft_fn? - row.old_ft_fn?).abs()));
        let gone = rows.iter().filter(|(_, row)| row.old_ft_fn.is_none() || row.new_ft_fn.is_none()).count();
        blocks.push(Block::Words(format!(
            "precursor table: {} rows changed in {runs} {}, F_T/F_N by at most {}; {gone} lengths on one side only",
            rows.len(),
            if runs == 1 { "run" } else { "runs" },
            short(differences.fold(0.0, f64::max))
        )));
    }
    let left_out = rows.len().saturating_sub(ROWS_MOST) as u64;
    let rows = rows.into_iter().take(ROWS_MOST).map(|(run, row)| {
        Row::of([
            Cell::Text(run.name()),
            num(number(row.lp_l)),
            optional(row.old_ft_fn.map(number)),
            optional(row.new_ft_fn.map(number)),
            optional(row.old_event),
            optional(row.new_event),
        ])
    });
    let heads = ["run", "#L_p/L", "#old F_T/F_N", "#new F_T/F_N", "#old event", "#new event"];
    let (headings_of, rows) = (headings(&heads), rows.collect());
    blocks.extend(table(Table { headings: headings_of, rows, left_out, ..Table::default() }));
    let mut claims: Vec<_> = report.claims.iter().collect();
    claims.sort_by_key(|claim| claim.old_verdict == claim.new_verdict);
    let verdicts = claims.iter().filter(|claim| claim.old_verdict != claim.new_verdict).count();
    if !claims.is_empty() {
        blocks.push(Block::Words(format!(
            "claims: {} changed, {verdicts} of them their verdict",
            claims.len()
        )));
    }
    let rows = claims.into_iter().map(|claim| {
        let word = |verdict: &Option<String>| verdict.clone().unwrap_or("not made".to_owned());
        let [old, new] = [&claim.old_verdict, &claim.new_verdict].map(word);
        Row {
            line: Some(format!("  {} ({}, {}): {old} -> {new}", claim.about, claim.run, claim.measure)),
            ..Row::of([
                text(&claim.about),
                text(&claim.run),
                text(&claim.measure),
                optional(claim.old_value.map(number)),
                optional(claim.new_value.map(number)),
                text(old),
                text(new),
            ])
        }
    });
    let heads = ["about", "run", "measure", "#old value", "#new value", "old verdict", "new verdict"];
    let on_screen = verdicts.min(OTHERS);
    blocks.extend(table(Table {
        headings: headings(&heads),
        rows: rows.collect(),
        on_screen,
        ..Table::default()
    }));
    blocks
}

/// Runs of one side, and differences beside events and scenarios.
pub(super) fn others(report: &Report) -> Vec<Block> {
    let alone = report.unpaired.iter().map(|unpaired| {
        let words = format!("only {}: {}: {}", unpaired.side, unpaired.run.name, unpaired.why);
        Row {
            line: Some(words),
            ..Row::of([
                text(format!("only {}", unpaired.side)),
                text(&unpaired.run.name),
                text(&unpaired.why),
            ])
        }
    });
    let (heads, rows) = (headings(&["", "run", "why"]), alone.collect());
    let more = Some("runs on one side only");
    let mut blocks = table(Table { headings: heads, rows, on_screen: OTHERS, more, ..Table::default() });
    let changes = report.runs.iter().flat_map(|run| &run.provenance);
    let rows =
        merged(changes.filter(|change| !change.is_of_scenario())).into_iter().map(|(change, pairs)| {
            let [old, new] =
                [&change.old, &change.new].map(|value| value.clone().unwrap_or("nothing".to_owned()));
            let of = if is_one(report) {
                String::new()
            } else {
                format!(" (in {})", counted(pairs as u64, "pair"))
            };
            Row {
                line: Some(format!("differing origin: {} {old} -> {new}{of}", change.key)),
                ..Row::of([text(&change.key), text(old), text(new), num(pairs)])
            }
        });
    let (heads, rows) = (headings(&["what", "old", "new", "#runs"]), rows.collect());
    let more = Some("settings");
    blocks.extend(table(Table { headings: heads, rows, on_screen: OTHERS, more, ..Table::default() }));
    blocks
}

/// Matches by class, and what each class means.
pub(super) fn classes(report: &Report) -> Vec<Block> {
    let of_ruptures = report.runs.iter().filter_map(|run| Some(&run.ruptures.as_ref()?.table.counts));
    let ruptures: Counts = of_ruptures.sum();
    let not_allowed: Counts = report.runs.iter().filter_map(|run| run.events.not_allowed.as_ref()).sum();
    let all: Counts = [&ruptures, &report.counts].into_iter().sum();
    let meaning = |class: Class| format!("{}: {}", class.name(), class.meaning());
    let there: Vec<String> = BY_WEIGHT.into_iter().filter(|class| all[*class] > 0).map(meaning).collect();
    let mut blocks = Vec::new();
    if !there.is_empty() {
        blocks.push(Block::OnScreen(there.join("; ")));
    }
    let rows = all.there().map(|(class, _)| {
        let events = report.counts[class];
        Row::of([
            Cell::Class(class),
            num(events),
            num(not_allowed[class]),
            num(ruptures[class]),
            text(class.meaning()),
        ])
    });
    let heads = headings(&["class", "#events", "#not allowed", "#ruptures", "what it means"]);
    blocks.extend(table(Table { headings: heads, rows: rows.collect(), ..Table::default() }));
    blocks
}
