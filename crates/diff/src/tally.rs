//! One pair of runs, from their events to its part of the report, in memory that does
//! not grow with the tables: everything is counted, and a limited number of findings and matches kept.

use asperity_record::SlipEvent;

use crate::classify::{Outcome, Rules, shift_s};
use crate::column::{Column, Columns, Kind};
use crate::matching::{self, Group, MatchError};
use crate::policy::{Allowed, Policy, Tolerance};
use crate::report::{
    CellChange, Class, ColumnChange, Counts, Extent, Finding, Growth, Horizon, Match, RunDiff, RunSide,
    Statistics,
};
use crate::statistics::{self, Distribution};

/// What to do with two tables.
#[derive(Debug, Clone)]
pub struct Comparison<'a> {
    /// The columns that both tables have ([`matching::comparable`]).
    pub columns: Columns,
    /// How far from an event's onset its counterpart is looked for, s.
    pub window_s: f64,
    /// Which differences are none, and which are allowed.
    pub policy: &'a Policy,
    /// The old run. Its number of events is filled in.
    pub old: RunSide,
    /// The new run.
    pub new: RunSide,
    /// How many findings of each class to keep.
    pub keep_findings: usize,
    /// How many matches to keep.
    pub keep_matches: usize,
}

/// One match on its way to a file.
#[derive(Debug, Clone, Copy)]
pub struct Matched<'a> {
    /// What became of the events.
    pub class: Class,
    /// Whether the policy lets it pass.
    pub allowed: bool,
    /// The farther of the shifts of onset and end, s; of one against one.
    pub shift_s: Option<f64>,
    /// The events.
    pub group: &'a Group,
}

/// Compares two runs, event by event. `on_match` is handed every match, in order of time.
///
/// # Errors
/// If a table cannot be read or is not in order, or `on_match` fails.
pub fn compare<E>(
    comparison: Comparison<'_>,
    old: impl Iterator<Item = Result<SlipEvent, E>>,
    new: impl Iterator<Item = Result<SlipEvent, E>>,
    draft: &mut Draft,
    mut on_match: impl FnMut(Matched<'_>) -> Result<(), E>,
) -> Result<RunDiff, MatchError<E>> {
    let mut tally = Tally::new(comparison);
    let (columns, window_s) = (tally.columns, tally.run.window_s);
    matching::match_tables(old, new, columns, window_s, |group| {
        let outcome = tally.rules().classify(&group);
        let allowed = tally.rules().allows(&outcome);
        on_match(Matched { class: outcome.class, allowed, shift_s: outcome.shift_s, group: &group })?;
        draft.take(&outcome, &group);
        tally.take(group, outcome, allowed);
        Ok(())
    })?;
    Ok(tally.finish())
}

struct Tally<'a> {
    columns: Columns,
    policy: &'a Policy,
    keep_findings: usize,
    keep_matches: usize,
    kept: [usize; Class::ALL.len()],
    changes: [Option<ColumnChange>; Column::ALL.len()],
    growth: Vec<Growth>,
    horizon: Option<Horizon>,
    beyond: [Beyond; 2],
    run: RunDiff,
}

/// One side's events from the horizon on.
#[derive(Debug, Default)]
struct Beyond {
    events: u64,
    /// Onsets of the first and the last, s.
    onsets_s: Option<(f64, f64)>,
    lengths: Distribution,
    recurrences: Distribution,
}

impl Beyond {
    fn add(&mut self, event: &SlipEvent, columns: Columns) {
        self.events += 1;
        let length = match columns.has(Column::BlocksSlipped) {
            true => event.blocks_slipped,
            false => event.reach().count(),
        };
        self.lengths.add(f64::from(length));
        let onset_s = event.onset_s;
        // Groups come in order of their earliest onsets, so that a later event of a group may
        // come before an earlier one of the next; the time between is the same.
        self.onsets_s = Some(match self.onsets_s {
            None => (onset_s, onset_s),
            Some((first_s, last_s)) => {
                self.recurrences.add((onset_s - last_s).abs());
                (first_s, onset_s.max(last_s))
            }
        });
    }

    fn per_s(&self) -> Option<f64> {
        let (first_s, last_s) = self.onsets_s?;
        (last_s > first_s).then(|| (self.events - 1) as f64 / (last_s - first_s))
    }
}

impl<'a> Tally<'a> {
    fn new(comparison: Comparison<'a>) -> Tally<'a> {
        let Comparison { columns, window_s, policy, old, new, keep_findings, keep_matches } = comparison;
        let is_compared = |column: &Column| columns.has(*column) && column.kind() != Kind::Number;
        let is_left_out = |column: &Column| !columns.has(*column) && column.kind() != Kind::Number;
        let run = RunDiff {
            old,
            new,
            summary: Vec::new(),
            ruptures: None,
            no_ruptures: None,
            provenance: Vec::new(),
            window_s,
            columns: Column::ALL.into_iter().filter(is_compared).collect(),
            columns_left_out: Column::ALL.into_iter().filter(is_left_out).collect(),
            counts: Counts::default(),
            not_allowed: Counts::default(),
            column_changes: Vec::new(),
            largest_shift_s: 0.0,
            findings: Vec::new(),
            findings_left_out: 0,
            matches: Vec::new(),
            matches_left_out: 0,
            horizon: None,
            precursors: None,
        };
        Tally {
            columns,
            policy,
            keep_findings,
            keep_matches,
            kept: [0; Class::ALL.len()],
            changes: [const { None }; Column::ALL.len()],
            growth: Vec::new(),
            horizon: None,
            beyond: Default::default(),
            run,
        }
    }

    fn rules(&self) -> Rules<'a> {
        Rules {
            columns: self.columns,
            policy: self.policy,
            old_until_s: self.run.old.duration_s,
            new_until_s: self.run.new.duration_s,
        }
    }

    fn take(&mut self, group: Group, outcome: Outcome, allowed: bool) {
        let class = outcome.class;
        self.run.old.events += group.old.len() as u64;
        self.run.new.events += group.new.len() as u64;
        *self.run.counts.of_mut(class) += 1;
        if !allowed {
            *self.run.not_allowed.of_mut(class) += 1;
        }
        if let ([old], [new]) = (&group.old[..], &group.new[..]) {
            self.run.largest_shift_s = self.run.largest_shift_s.max(shift_s(old, new));
            for cell in &outcome.cells {
                self.column(cell, old.event, new.event);
            }
        }
        self.grow(&group, &outcome);
        if self.horizon.is_some() {
            group.old.iter().for_each(|event| self.beyond[0].add(event, self.columns));
            group.new.iter().for_each(|event| self.beyond[1].add(event, self.columns));
        }
        let wants_match = self.run.matches.len() < self.keep_matches;
        let wants_finding = !class.is_no_difference() && self.kept[class as usize] < self.keep_findings;
        self.run.matches_left_out += u64::from(!wants_match);
        self.run.findings_left_out += u64::from(!class.is_no_difference() && !wants_finding);
        if !wants_match && !wants_finding {
            return;
        }
        let [old, new] = [&group.old, &group.new].map(|events| events.iter().map(extent).collect::<Vec<_>>());
        if wants_finding {
            self.kept[class as usize] += 1;
            self.run.findings.push(Finding {
                class,
                allowed,
                rule: self.rule_in_words(&outcome, allowed),
                old: old.clone(),
                new: new.clone(),
                shift_s: outcome.shift_s,
                columns: outcome.cells.into_iter().filter(CellChange::is_beyond).collect(),
                conservation: outcome.conservation,
            });
        }
        if wants_match {
            self.run.matches.push(Match { class, allowed, old, new });
        }
    }

    fn rule_in_words(&self, outcome: &Outcome, allowed: bool) -> String {
        let mut rule = outcome.rule.to_owned();
        if let Some(kept) = outcome.conservation {
            rule += match (kept.duration_conserved, kept.blocks_conserved) {
                (true, true) => "; conserves duration and blocks",
                (true, false) => "; conserves the duration, not the blocks",
                (false, true) => "; conserves the blocks, not the duration",
                (false, false) => "; conserves neither duration nor blocks",
            };
        }
        let class_allowed = self.policy.allowed(outcome.class) != Allowed::UpTo(0);
        if class_allowed && !allowed {
            rule += &format!("; farther than the policy's max_shift_s = {:e}", self.policy.max_shift_s);
        }
        rule
    }

    fn column(&mut self, cell: &CellChange, old_event: u64, new_event: u64) {
        let column = cell.column;
        let change = self.changes[column as usize].get_or_insert(ColumnChange {
            column,
            differing: 0,
            beyond_tolerance: 0,
            largest: 0.0,
            old_event,
            new_event,
        });
        change.differing += 1;
        change.beyond_tolerance += u64::from(cell.is_beyond());
        if let Some(difference) = cell.difference.filter(|difference| *difference > change.largest) {
            *change = ColumnChange { largest: difference, old_event, new_event, ..*change };
        }
    }

    fn grow(&mut self, group: &Group, outcome: &Outcome) {
        let number = self.run.counts.total();
        let differs = !outcome.class.is_no_difference();
        let onset_s = group.onset_s();
        if self.growth.last().is_none_or(|decade| number >= 10 * decade.from) {
            let decade =
                Growth { from: number, to: number, from_s: onset_s, differing: 0, largest_shift_s: 0.0 };
            self.growth.push(decade);
        }
        if let Some(decade) = self.growth.last_mut() {
            decade.to = number;
            decade.differing += u64::from(differs);
            decade.largest_shift_s = decade.largest_shift_s.max(outcome.shift_s.unwrap_or(0.0));
        }
        if differs && self.horizon.is_none() {
            let number_of = |events: &[SlipEvent]| events.first().map(|event| event.event);
            let nothing = statistics::compare(&Distribution::default(), &Distribution::default());
            self.horizon = Some(Horizon {
                at_s: onset_s,
                class: outcome.class,
                old_event: number_of(&group.old),
                new_event: number_of(&group.new),
                matches_before: number - 1,
                growth: Vec::new(),
                beyond: Statistics {
                    old_events: 0,
                    new_events: 0,
                    old_per_s: None,
                    new_per_s: None,
                    length_blocks: nothing,
                    recurrence_s: nothing,
                },
            });
        }
    }

    fn finish(mut self) -> RunDiff {
        let [old, new] = &self.beyond;
        self.run.horizon = self.horizon.map(|horizon| Horizon {
            growth: self.growth,
            beyond: Statistics {
                old_events: old.events,
                new_events: new.events,
                old_per_s: old.per_s(),
                new_per_s: new.per_s(),
                length_blocks: statistics::compare(&old.lengths, &new.lengths),
                recurrence_s: statistics::compare(&old.recurrences, &new.recurrences),
            },
            ..horizon
        });
        self.run.column_changes = self.changes.into_iter().flatten().collect();
        self.run
    }
}

fn extent(event: &SlipEvent) -> Extent {
    let SlipEvent { event, onset_s, end_s, first_block, last_block, .. } = *event;
    Extent { event, onset_s, end_s, first_block, last_block }
}

/// The tightest policy under which what was observed passes.
///
/// Numbers get tolerances: for every column of time or load the largest difference of any
/// pair of events of the same blocks. What differs in kind gets a count: pairs of other blocks,
/// splits, merges, what is missing, extra or open.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    tolerances: [f64; Column::ALL.len()],
    counts: Counts,
    largest_shift_s: f64,
    ruptures: bool,
}

impl Draft {
    /// Lets ruptures differ where no slip event does.
    pub fn allow_ruptures(&mut self) {
        self.ruptures = true;
    }

    fn take(&mut self, outcome: &Outcome, group: &Group) {
        if outcome.class == Class::Identical {
            return;
        }
        let ([old], [new]) = (&group.old[..], &group.new[..]) else {
            *self.counts.of_mut(outcome.class) += 1;
            return;
        };
        let in_kind = |cell: &&CellChange| {
            !matches!(cell.column.kind(), Kind::Time | Kind::Load) || cell.difference.is_none()
        };
        let cut = old.end_s.is_none() || new.end_s.is_none() || old.open || new.open;
        let others = outcome.cells.iter().find(in_kind);
        let starts_otherwise = outcome.cells.iter().filter(in_kind).any(|cell| cell.column.is_of_onset());
        // A truncated event is identified by its onset, whose numbers need their tolerances as
        // well.
        let class = match others {
            None => None,
            Some(_) if cut && !starts_otherwise => Some(Class::Open),
            Some(_) => Some(Class::Changed),
        };
        if let Some(class) = class {
            *self.counts.of_mut(class) += 1;
            self.largest_shift_s = self.largest_shift_s.max(shift_s(old, new));
        }
        if class != Some(Class::Changed) {
            for cell in &outcome.cells {
                let known = class.is_none() || cell.column.is_of_onset();
                if let Some(difference) = cell.difference.filter(|_| known && !in_kind(&cell)) {
                    let tolerance = &mut self.tolerances[cell.column as usize];
                    *tolerance = tolerance.max(difference);
                }
            }
        }
    }

    /// The policy; with the window of that under which the events were matched.
    pub fn policy(&self, window_s: Option<f64>) -> Policy {
        let mut policy = Policy { window_s, allows_ruptures: self.ruptures, ..Policy::default() };
        if self.counts.changed + self.counts.open > 0 {
            policy.max_shift_s = self.largest_shift_s;
        }
        for column in Column::ALL {
            let absolute = self.tolerances[column as usize];
            policy = policy.with_tolerance(column, Tolerance { absolute, relative: 0.0 });
        }
        for class in Class::ALL.into_iter().filter(|&class| self.counts.of(class) > 0) {
            policy = policy.with_allowed(class, Allowed::UpTo(self.counts.of(class)));
        }
        policy
    }
}
