//! A report on a terminal, on one screen whatever the tables, most important parts first: differences in
//! settings, the summary numbers of the runs, their ruptures, and then the fate of the slip events.

mod finding;
mod physics;

use crate::reading::{number, test};
use crate::report::{
    Class, ColumnChange, Counts, Finding, Horizon, KolmogorovSmirnov, PairedBy, Report, RunDiff, Sample,
    Verdict,
};
use finding::{by_class, short, told};

/// The classes by importance: events that appeared or vanished, changed, or moved.
const BY_WEIGHT: [Class; 7] =
    [Class::Missing, Class::Extra, Class::Split, Class::Merged, Class::Changed, Class::Open, Class::Shifted];

/// Lines of each part, so that all of them fit on a screen of 40.
const RUNS: usize = 5;
const FINDINGS: usize = 8;
/// Findings listed below numbers and ruptures.
const FINDINGS_BELOW_PHYSICS: usize = 2;
const FINDINGS_OF_A_CLASS: usize = 3;
const COLUMNS: usize = 2;
const OTHERS: usize = 2;
const MEANINGS_IN_A_LINE: usize = 4;
/// Findings of each class that a report needs for its summary.
pub const KEPT_OF_A_CLASS: usize = FINDINGS;

/// The summary, line by line.
pub fn lines(report: &Report) -> Vec<String> {
    let mut lines = vec![
        format!("old     {}", report.old),
        format!("new     {}", report.new),
        format!("policy  {}", report.policy.as_deref().unwrap_or("exact: every difference counts")),
    ];
    let differing: Vec<&RunDiff> =
        report.runs.iter().filter(|run| run.events.counts.differing() > 0).collect();
    physics::lines(report, &mut lines);
    runs(report, &differing, &mut lines);
    // Paired by cycles, no event is the one before.
    let in_time: Vec<&RunDiff> =
        differing.iter().copied().filter(|run| run.events.paired_by == PairedBy::Time).collect();
    findings(report, &in_time, &mut lines);
    columns(report, &in_time, &mut lines);
    if let Some(run) = worst(&differing) {
        horizon(run, differing.len(), &mut lines);
    }
    downstream(report, &mut lines);
    others(report, &mut lines);
    meanings(report, &mut lines);
    lines.push(verdict(report));
    lines
}

/// Sort key by the differences of a run: those that are not allowed come first.
fn weight(run: &RunDiff) -> (u64, u64) {
    (run.events.refused(), run.events.counts.differing())
}

/// The run to look at first: with most that differs.
fn worst<'a>(differing: &[&'a RunDiff]) -> Option<&'a RunDiff> {
    differing.iter().copied().max_by(|a, b| weight(a).cmp(&weight(b)).then(b.old.name.cmp(&a.old.name)))
}

fn runs(report: &Report, differing: &[&RunDiff], lines: &mut Vec<String>) {
    let events = |side: &dyn Fn(&RunDiff) -> u64| report.runs.iter().map(side).sum::<u64>();
    lines.push(format!(
        "{} {}, {} old and {} new events{}: {}",
        report.runs.len(),
        if report.runs.len() == 1 { "run" } else { "pairs of runs" },
        events(&|run| run.old.events),
        events(&|run| run.new.events),
        match report.runs.iter().filter(|run| run.events.paired_by == PairedBy::Cycles).count() {
            0 => String::new(),
            _ if report.runs.len() == 1 => ", paired as the ruptures are".to_owned(),
            pairs => format!(", in {pairs} of the pairs paired by cycles"),
        },
        by_class(&report.counts, "no events")
    ));
    if report.runs.len() == 1 {
        return;
    }
    let mut by_weight = differing.to_vec();
    by_weight.sort_by_key(|run| std::cmp::Reverse(weight(run)));
    for run in by_weight.iter().take(RUNS) {
        lines.push(format!("  {}: {}", run.name(), by_class(&run.events.counts, "no events")));
    }
    match (differing.len().saturating_sub(RUNS), report.runs.len() - differing.len()) {
        (0, 0) => {}
        // The last line covers them all.
        (0, same) if same == report.runs.len() => {}
        (0, same) => lines.push(format!("  in {same} more nothing differs")),
        (more, same) => {
            lines.push(format!("  {more} more differ, see --format json; in {same} nothing differs"))
        }
    }
}

fn findings(report: &Report, differing: &[&RunDiff], lines: &mut Vec<String>) {
    let total: u64 = differing.iter().map(|run| run.events.counts.differing()).sum();
    if total == 0 {
        return;
    }
    let is_below = report.runs.iter().any(|run| run.ruptures.is_some());
    let most = if is_below { FINDINGS_BELOW_PHYSICS } else { FINDINGS };
    let mut chosen: Vec<(&RunDiff, &Finding)> = Vec::new();
    // Findings that are not allowed come first, with a few of each class before more of any.
    for of_a_class in [FINDINGS_OF_A_CLASS.min(most.div_ceil(2)), most] {
        for allowed in [false, true] {
            for class in BY_WEIGHT {
                let of_class = differing.iter().flat_map(|run| {
                    let findings = run.events.findings.iter().map(move |finding| (*run, finding));
                    findings.filter(move |(_, finding)| finding.class == class && finding.allowed == allowed)
                });
                for (run, finding) in of_class.take(of_a_class) {
                    if chosen.len() < most && !chosen.iter().any(|(_, other)| std::ptr::eq(*other, finding)) {
                        chosen.push((run, finding));
                    }
                }
            }
        }
    }
    let weight = |finding: &Finding| BY_WEIGHT.iter().position(|&class| class == finding.class);
    chosen.sort_by_key(|(_, finding)| (finding.allowed, weight(finding)));
    let of = match total.saturating_sub(chosen.len() as u64) {
        0 => String::new(),
        _ => format!(", {} of {total} (see --format json)", chosen.len()),
    };
    lines.push(format!("what became of which events{of}:"));
    for (run, finding) in &chosen {
        let of_run = if report.runs.len() > 1 { format!("{} ", run.name()) } else { String::new() };
        lines.push(format!("  {of_run}{}", told(finding)));
    }
}

fn columns(report: &Report, in_time: &[&RunDiff], lines: &mut Vec<String>) {
    let mut largest: Vec<(&RunDiff, ColumnChange)> = Vec::new();
    for &run in in_time {
        for change in &run.events.column_changes {
            match largest.iter_mut().find(|(_, known)| known.column == change.column) {
                None => largest.push((run, change.clone())),
                Some((of, known)) => {
                    let (differing, beyond) = (
                        known.differing + change.differing,
                        known.beyond_tolerance + change.beyond_tolerance,
                    );
                    if change.largest > known.largest {
                        (*of, *known) = (run, change.clone());
                    }
                    (known.differing, known.beyond_tolerance) = (differing, beyond);
                }
            }
        }
    }
    largest.sort_by_key(|(_, change)| (std::cmp::Reverse(change.beyond_tolerance), change.column));
    if !largest.is_empty() {
        let of = match largest.len() {
            all if all > COLUMNS => format!(", {COLUMNS} of {all}"),
            _ => String::new(),
        };
        lines.push(format!("columns that differ between paired events{of}:"));
    }
    for (run, change) in largest.iter().take(COLUMNS) {
        let of_run = if report.runs.len() > 1 { format!("{}, ", run.name()) } else { String::new() };
        lines.push(format!(
            "  {}: in {}, beyond tolerance in {}; by at most {} ({of_run}old {}, new {})",
            change.column,
            change.differing,
            change.beyond_tolerance,
            short(change.largest),
            change.old_event,
            change.new_event
        ));
    }
    let left_out = report.runs.iter().map(|run| run.events.left_out()).find(|columns| !columns.is_empty());
    if let Some(columns) = left_out {
        let names: Vec<&str> = columns.iter().map(|column| column.name()).collect();
        lines.push(format!(
            "not compared, because a side lacks them or counts other steps: {}",
            names.join(", ")
        ));
    }
}

fn horizon(run: &RunDiff, differing_runs: usize, lines: &mut Vec<String>) {
    let Some(Horizon { at_s, class, matches_before, growth, beyond, .. }) = &run.events.horizon else {
        return;
    };
    let which = if differing_runs > 1 { format!(" of {}", run.name()) } else { String::new() };
    if run.events.paired_by == PairedBy::Time {
        let decades: Vec<String> = growth
            .iter()
            .map(|decade| {
                let share = 100.0 * decade.differing as f64 / (decade.to - decade.from + 1) as f64;
                format!("{share:.0} % of {}-{}", decade.from, decade.to)
            })
            .collect();
        lines.push(format!(
            "first difference{which}: {} at {} s, after {matches_before} events that agree; by number of the match \
             differ {}",
            class.name(),
            number(*at_s),
            decades.join(", ")
        ));
    }
    lines.push(format!(
        "from {} s on, where the order of events is chaotic, compare statistics: {} old and {} new events{which}; {} \
         test of one distribution:",
        number(*at_s),
        beyond.old_events,
        beyond.new_events,
        KolmogorovSmirnov::NAME
    ));
    lines.push(format!(
        "  {}; {}",
        distribution("lengths, blocks", &beyond.length_blocks),
        distribution("onset to onset, s", &beyond.recurrence_s)
    ));
}

fn distribution(what: &str, sample: &Sample) -> String {
    let median = |value: Option<f64>| value.map_or("-".to_owned(), short);
    let medians = format!("medians {} and {}", median(sample.old_median), median(sample.new_median));
    format!("{what}: {}, {medians}", test(sample))
}

fn downstream(report: &Report, lines: &mut Vec<String>) {
    let changed = report.runs.iter().filter_map(|run| Some((run, run.precursors.as_ref()?)));
    let changed: Vec<_> = changed.filter(|(_, precursors)| !precursors.rows.is_empty()).collect();
    if !changed.is_empty() {
        let rows: usize = changed.iter().map(|(_, precursors)| precursors.rows.len()).sum();
        let largest = changed
            .iter()
            .flat_map(|(_, precursors)| &precursors.rows)
            .filter_map(|row| Some((row.new_ft_fn? - row.old_ft_fn?).abs()))
            .fold(0.0, f64::max);
        let gone = changed.iter().flat_map(|(_, precursors)| &precursors.rows);
        let gone = gone.filter(|row| row.old_ft_fn.is_none() || row.new_ft_fn.is_none()).count();
        lines.push(format!(
            "precursor table: {rows} rows changed in {}, F_T/F_N by at most {}; {gone} lengths on one side only",
            if changed.len() == 1 { "1 run".to_owned() } else { format!("{} runs", changed.len()) },
            short(largest)
        ));
    }
    let verdicts = report.claims.iter().filter(|claim| claim.old_verdict != claim.new_verdict);
    if !report.claims.is_empty() {
        lines.push(format!(
            "claims: {} changed, {} of them their verdict",
            report.claims.len(),
            verdicts.clone().count()
        ));
    }
    for claim in verdicts.take(OTHERS) {
        let word = |verdict: &Option<String>| verdict.clone().unwrap_or("not made".to_owned());
        lines.push(format!(
            "  {} ({}, {}): {} -> {}",
            claim.about,
            claim.run,
            claim.measure,
            word(&claim.old_verdict),
            word(&claim.new_verdict)
        ));
    }
}

fn others(report: &Report, lines: &mut Vec<String>) {
    for unpaired in report.unpaired.iter().take(OTHERS) {
        lines.push(format!("only {}: {}: {}", unpaired.side, unpaired.run.name, unpaired.why));
    }
    if report.unpaired.len() > OTHERS {
        lines.push(format!("... and {} more runs on one side only", report.unpaired.len() - OTHERS));
    }
    let mut seen: Vec<(String, usize)> = Vec::new();
    // Keys of scenarios come first.
    let changes = report.runs.iter().flat_map(|run| &run.provenance);
    for change in changes.filter(|change| !change.is_of_scenario()) {
        let value = |value: &Option<String>| value.clone().unwrap_or("nothing".to_owned());
        let told = format!("{} {} -> {}", change.key, value(&change.old), value(&change.new));
        match seen.iter_mut().find(|(known, _)| *known == told) {
            Some((_, count)) => *count += 1,
            None => seen.push((told, 1)),
        }
    }
    for (told, count) in seen.iter().take(OTHERS) {
        let of = if report.runs.len() > 1 { format!(" (in {count} pairs)") } else { String::new() };
        lines.push(format!("differing origin: {told}{of}"));
    }
    if seen.len() > OTHERS {
        lines.push(format!("... and {} more settings, see --format json", seen.len() - OTHERS));
    }
}

/// Meanings of the classes of differing events and ruptures.
fn meanings(report: &Report, lines: &mut Vec<String>) {
    let of_ruptures = report.runs.iter().filter_map(|run| Some(&run.ruptures.as_ref()?.table.counts));
    let all: Counts = of_ruptures.chain([&report.counts]).sum();
    let there = BY_WEIGHT.into_iter().filter(|class| all[*class] > 0);
    let meanings: Vec<String> = there.map(|class| format!("{}: {}", class.name(), class.meaning())).collect();
    lines.extend(meanings.chunks(MEANINGS_IN_A_LINE).map(|meanings| meanings.join("; ")));
}

fn verdict(report: &Report) -> String {
    let exceeded: Vec<String> = report
        .exceeded
        .iter()
        .map(|over| format!("{} {} where the policy allows {}", over.found, over.class.name(), over.allowed))
        .collect();
    let differing =
        |run: &RunDiff| run.ruptures.as_ref().map_or(0, |ruptures| ruptures.table.counts.differing());
    let ruptures_differ = report.runs.iter().any(|run| differing(run) > 0);
    let allowed = report.runs.iter().any(RunDiff::ruptures_alone_differ);
    match report.verdict {
        Verdict::WithinPolicy if report.counts.differing() == 0 && !ruptures_differ => {
            "nothing differs".to_owned()
        }
        // Within the tolerances of slip events only, or found in step records.
        Verdict::WithinPolicy if report.counts.differing() == 0 && !allowed => {
            "no slip event differs, but ruptures do".to_owned()
        }
        Verdict::WithinPolicy => "differs, as the policy allows".to_owned(),
        Verdict::Differs if !exceeded.is_empty() => format!("differs: {}", exceeded.join(", ")),
        // No slip event, but something: ruptures, or a run that one side lacks.
        Verdict::Differs if report.counts.differing() == 0 && report.unpaired.is_empty() => {
            "differs: the ruptures do, and no slip event".to_owned()
        }
        Verdict::Differs => "differs".to_owned(),
    }
}
