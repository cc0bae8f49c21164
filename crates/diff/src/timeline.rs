//! Data drawn by the page's script: the events of every run on both sides, and the position of each listed
//! finding among them.

use std::collections::HashMap;

use serde::Serialize;

use crate::document::title;
use crate::report::{Class, Extent, Finding, Match, Report, RunDiff, RunSide, TableDiff};

/// Most events on a page, of both sides and all runs: some ten megabytes, which browsers can still draw at
/// once.
pub(crate) const EVENTS_MOST: usize = 200_000;

/// Number, onset in s, end in s or null, first and last block, place of the class, place of
/// the match in its run.
type EventRow = (u64, f64, Option<f64>, u32, u32, usize, usize);

/// All that the script knows.
#[derive(Serialize)]
pub(crate) struct Timeline {
    old: String,
    new: String,
    classes: Vec<ClassWords>,
    runs: Vec<RunEvents>,
    findings: Vec<FindingPlace>,
}

#[derive(Serialize)]
struct ClassWords {
    word: &'static str,
    title: String,
}

#[derive(Serialize)]
struct RunEvents {
    name: String,
    /// The kind that is drawn: `events` or `ruptures`.
    what: &'static str,
    /// The place of the run among those that are compared.
    pair: usize,
    blocks: u32,
    from_s: f64,
    to_s: f64,
    horizon_s: Option<f64>,
    old: Vec<EventRow>,
    new: Vec<EventRow>,
    total: Total,
    counts: Vec<u64>,
}

#[derive(Clone, Copy, Serialize)]
struct Total {
    old: u64,
    new: u64,
}

#[derive(Serialize)]
struct FindingPlace {
    run: usize,
    class: usize,
    #[serde(rename = "match")]
    place: Option<usize>,
    from_s: f64,
    to_s: f64,
}

/// The timeline of a report, with the findings that the page lists, each with
/// the place of its run.
pub(crate) fn timeline(report: &Report, listed: &[(usize, &Finding)]) -> Timeline {
    let thinning = Thinning::of(report, EVENTS_MOST);
    // Ruptures come after all slip events, so the indices of runs still match those of findings.
    let pairs = report.runs.iter().enumerate();
    let events = pairs.clone().map(|(pair, run)| run_events(pair, run, "events", &run.events, thinning));
    let ruptures = pairs.filter_map(|(pair, run)| {
        let ruptures = run.ruptures.as_ref()?;
        Some(run_events(pair, run, "ruptures", &ruptures.table, thinning))
    });
    let runs = events.chain(ruptures).collect();
    let keyed = |(place, found): (usize, &Match)| (key(found.class, &found.old, &found.new), place);
    let places: Vec<HashMap<Key, usize>> =
        report.runs.iter().map(|run| run.events.matches.iter().enumerate().map(keyed).collect()).collect();
    let findings = listed
        .iter()
        .map(|&(run, finding)| {
            let (from_s, to_s) = span(finding.old.iter().chain(&finding.new));
            FindingPlace {
                run,
                class: place(finding.class),
                place: places[run].get(&key(finding.class, &finding.old, &finding.new)).copied(),
                from_s,
                to_s,
            }
        })
        .collect();
    Timeline {
        old: report.old.clone(),
        new: report.new.clone(),
        classes: Class::ALL
            .iter()
            .map(|&class| ClassWords { word: class.name(), title: title(class) })
            .collect(),
        runs,
        findings,
    }
}

fn place(class: Class) -> usize {
    Class::ALL.iter().position(|&other| other == class).expect("every class is among all")
}

fn run_events(
    pair: usize,
    run: &RunDiff,
    what: &'static str,
    drawn: &TableDiff,
    thinning: Thinning,
) -> RunEvents {
    let (mut old, mut new) = (Vec::new(), Vec::new());
    let (mut same, mut differing) = (0_usize, 0_usize);
    for (number, found) in drawn.matches.iter().enumerate() {
        let (before, every) = if found.class.is_no_difference() {
            (&mut same, thinning.same)
        } else {
            (&mut differing, thinning.differing)
        };
        let keeps = before.is_multiple_of(every);
        *before += 1;
        if keeps {
            let row = |event: &Extent| {
                let Extent { event, onset_s, end_s, first_block, last_block, .. } = *event;
                (event, onset_s, end_s, first_block, last_block, place(found.class), number)
            };
            old.extend(found.old.iter().map(row));
            new.extend(found.new.iter().map(row));
        }
    }
    let events = || drawn.matches.iter().flat_map(|found| found.old.iter().chain(&found.new));
    let (from_s, last_s) = span(events());
    let ends = [run.old.duration_s, run.new.duration_s];
    // Over an area events are drawn by their columns.
    let columns = |side: &RunSide| side.blocks.map(|blocks| blocks / side.rows.unwrap_or(1));
    let blocks = [&run.old, &run.new].map(columns);
    let highest = events().map(|event| event.last_block).max();
    RunEvents {
        name: run.name(),
        what,
        pair,
        blocks: blocks.into_iter().flatten().chain(highest).max().unwrap_or(1),
        // A run starts at 0; its table may start anywhere.
        from_s: from_s.min(0.0),
        to_s: ends.into_iter().flatten().fold(last_s, f64::max),
        horizon_s: drawn.horizon.as_ref().map(|horizon| horizon.at_s),
        old,
        new,
        total: Total { old: drawn.old_rows, new: drawn.new_rows },
        counts: Class::ALL.iter().map(|&class| drawn.counts[class]).collect(),
    }
}

/// From the first onset to the last end, s; 0 to 0 without events.
fn span<'a>(events: impl Iterator<Item = &'a Extent>) -> (f64, f64) {
    events
        .map(|event| (event.onset_s, event.end_s.unwrap_or(event.onset_s).max(event.onset_s)))
        .reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
        .unwrap_or((0.0, 0.0))
}

/// A match, by its class and its first event on either side: a finding is the
/// match of the same key.
type Key = (Class, Option<u64>, Option<u64>);

fn key(class: Class, old: &[Extent], new: &[Extent]) -> Key {
    let first = |events: &[Extent]| events.first().map(|event| event.event);
    (class, first(old), first(new))
}

/// Thins out matches if there are too many: of identical and of differing ones, keeps one in a given
/// number, evenly over each run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Thinning {
    same: usize,
    differing: usize,
}

impl Thinning {
    /// For a page of at most `most` events; differing matches have priority.
    pub(crate) fn of(report: &Report, most: usize) -> Thinning {
        let matches = || {
            let events = report.runs.iter().map(|run| &run.events);
            let ruptures = report.runs.iter().filter_map(|run| run.ruptures.as_ref());
            events.chain(ruptures.map(|ruptures| &ruptures.table)).flat_map(|table| &table.matches)
        };
        let events = |is_same: bool| -> usize {
            matches()
                .filter(|found| found.class.is_no_difference() == is_same)
                .map(|found| found.old.len() + found.new.len())
                .sum()
        };
        let (same, differing) = (events(true), events(false));
        let every = |events: usize, room: usize| events.div_ceil(room.max(1)).max(1);
        Thinning { same: every(same, most.saturating_sub(differing)), differing: every(differing, most) }
    }

    /// Describes the selection in words; empty if everything is drawn.
    pub(crate) fn words(self) -> Option<String> {
        let part = |every: usize| if every == 1 { "all".to_owned() } else { format!("one in {every}") };
        (self.same > 1 || self.differing > 1).then(|| {
            format!(
                "Too many events for a page: it draws {} of those that differ and {} of those that do not.",
                part(self.differing),
                part(self.same)
            )
        })
    }
}
