//! Two tables, of slip events or of ruptures, from their rows to their part of the report. Memory
//! does not grow with the tables: all is counted, and a limited number of findings and matches kept.

use asperity_record::{Parts, Reach, Role};

use crate::classify::{Outcome, shift_s};
use crate::column::{COUNT, Column, Columns};
use crate::matching::{self, Group};
use crate::policy::{Allowed, Policy, Tolerance};
use crate::progress::Cycles;
use crate::report::{
    CellChange, Class, ColumnChange, Counts, Extent, Finding, Growth, Horizon, Match, PairedBy, Statistics,
    TableDiff,
};
use crate::statistics::{self, Distribution};
use crate::table::{Row, Table};

/// How two tables are compared.
#[derive(Debug, Clone, Copy)]
pub struct Comparison<'a> {
    /// The columns that both tables have ([`matching::comparable`]).
    pub columns: Columns,
    /// Window around an event's onset in which its counterpart is searched for, s.
    pub window_s: f64,
    /// How events are paired if not by times; the window then has that unit.
    pub cycles: Option<&'a Cycles>,
    /// Which differences are ignored, and which are allowed.
    pub policy: &'a Policy,
    /// When the old run and the new one ended, s, if that is known.
    pub until_s: [Option<f64>; 2],
    /// How many findings of each class to keep.
    pub keep_findings: usize,
    /// How many matches to keep.
    pub keep_matches: usize,
}

/// One match on its way to a file.
#[derive(Debug)]
pub struct Matched<'a> {
    /// The classes of the events.
    pub class: Class,
    /// Whether the policy allows it.
    pub allowed: bool,
    /// The farther of the shifts of onset and end, s; of one against one.
    pub shift_s: Option<f64>,
    /// The events.
    pub group: &'a Group<'a>,
}

/// Compares two tables, row by row. `on_match` receives every match, in order of time or cycles; `draft`
/// widens to a policy that allows all of them.
///
/// # Errors
/// If `on_match` fails.
pub fn compare<E>(
    comparison: Comparison<'_>,
    tables: [&Table; 2],
    draft: &mut Draft,
    mut on_match: impl FnMut(Matched<'_>) -> Result<(), E>,
) -> Result<TableDiff, E> {
    let mut tally = Tally::new(comparison);
    let Comparison { columns, window_s, cycles, .. } = comparison;
    matching::match_tables(tables, columns, window_s, cycles, |group| {
        let outcome = comparison.classify(&group);
        let allowed = comparison.allows(&outcome);
        on_match(Matched { class: outcome.class, allowed, shift_s: outcome.shift_s, group: &group })?;
        draft.take(&outcome, &group);
        tally.take(&group, outcome, allowed);
        Ok(())
    })?;
    Ok(tally.finish())
}

struct Tally<'a> {
    comparison: Comparison<'a>,
    /// How many findings of each class are kept.
    kept: [usize; Class::ALL.len()],
    changes: [Option<ColumnChange>; COUNT],
    growth: Vec<Growth>,
    beyond: [Beyond; 2],
    found: TableDiff,
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
    fn add(&mut self, event: Row<'_>, columns: Columns) {
        self.events += 1;
        let length = match columns.has(Column::BLOCKS_SLIPPED) {
            true => event.blocks_slipped(),
            false => event.reach().count(),
        };
        self.lengths.add(f64::from(length));
        let onset_s = event.onset_s();
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
        let of_events = |has: bool| {
            let columns = Column::all().filter(|column| column.role() != Role::Number);
            // Left out are columns that every table may have.
            let columns = columns.filter(|column| has || column.is_in(Parts::default()));
            columns.filter(|&column| comparison.columns.has(column) == has).collect()
        };
        Tally {
            comparison,
            kept: Default::default(),
            changes: Default::default(),
            growth: Vec::new(),
            beyond: Default::default(),
            found: TableDiff {
                paired_by: if comparison.cycles.is_some() { PairedBy::Cycles } else { PairedBy::Time },
                window_s: comparison.window_s,
                window_cycles: comparison.cycles.map(|cycles| cycles.window),
                columns: of_events(true),
                columns_left_out: Some(of_events(false)),
                not_allowed: Some(Counts::default()),
                ..TableDiff::default()
            },
        }
    }

    fn take(&mut self, group: &Group<'_>, outcome: Outcome, allowed: bool) {
        let (class, found) = (outcome.class, &mut self.found);
        found.old_rows += group.old.len() as u64;
        found.new_rows += group.new.len() as u64;
        found.counts[class] += 1;
        if let Some(not_allowed) = found.not_allowed.as_mut().filter(|_| !allowed) {
            not_allowed[class] += 1;
        }
        if let (&[old], &[new]) = (&group.old[..], &group.new[..]) {
            found.largest_shift_s = found.largest_shift_s.max(shift_s(old, new));
            for cell in &outcome.cells {
                self.column(cell, old.number(), new.number());
            }
        }
        self.grow(group, &outcome);
        let Comparison { columns, keep_findings, keep_matches, .. } = self.comparison;
        if self.found.horizon.is_some() {
            for (side, events) in self.beyond.iter_mut().zip([&group.old, &group.new]) {
                events.iter().for_each(|event| side.add(*event, columns));
            }
        }
        let wants_match = self.found.matches.len() < keep_matches;
        let wants_finding = !class.is_no_difference() && self.kept[class as usize] < keep_findings;
        self.found.matches_left_out += u64::from(!wants_match);
        self.found.findings_left_out += u64::from(!class.is_no_difference() && !wants_finding);
        if !wants_match && !wants_finding {
            return;
        }
        let [old, new] =
            [&group.old, &group.new].map(|events| events.iter().copied().map(extent).collect::<Vec<_>>());
        if wants_finding {
            self.kept[class as usize] += 1;
            let rule = self.rule_in_words(&outcome, allowed);
            self.found.findings.push(Finding {
                class,
                allowed,
                rule,
                old: old.clone(),
                new: new.clone(),
                shift_s: outcome.shift_s,
                columns: outcome.cells.into_iter().filter(CellChange::is_beyond).collect(),
                conservation: outcome.conservation,
            });
        }
        if wants_match {
            self.found.matches.push(Match { class, allowed, old, new });
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
        let policy = self.comparison.policy;
        let class_allowed = policy.allowed(outcome.class) != Allowed::UpTo(0);
        if class_allowed && !allowed {
            rule += &format!("; farther than the policy's max_shift_s = {:e}", policy.max_shift_s);
        }
        rule
    }

    fn column(&mut self, cell: &CellChange, old_event: u64, new_event: u64) {
        let column = cell.column;
        let change = self.changes[column.place()].get_or_insert(ColumnChange {
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

    fn grow(&mut self, group: &Group<'_>, outcome: &Outcome) {
        let number = self.found.counts.total();
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
        if differs && self.found.horizon.is_none() {
            let number_of = |events: &[Row<'_>]| events.first().map(|event| event.number());
            self.found.horizon = Some(Horizon {
                at_s: onset_s,
                class: outcome.class,
                old_event: number_of(&group.old),
                new_event: number_of(&group.new),
                matches_before: number - 1,
                // Known once all have been seen.
                growth: Vec::new(),
                beyond: Statistics::default(),
            });
        }
    }

    fn finish(mut self) -> TableDiff {
        if let Some(horizon) = &mut self.found.horizon {
            let [old, new] = &self.beyond;
            horizon.growth = self.growth;
            horizon.beyond = Statistics {
                old_events: old.events,
                new_events: new.events,
                old_per_s: old.per_s(),
                new_per_s: new.per_s(),
                length_blocks: statistics::compare(&old.lengths, &new.lengths),
                recurrence_s: statistics::compare(&old.recurrences, &new.recurrences),
            };
        }
        self.found.column_changes = self.changes.into_iter().flatten().collect();
        self.found
    }
}

fn extent(event: Row<'_>) -> Extent {
    let (Reach { first, last }, across) = (event.reach(), event.across());
    Extent {
        event: event.number(),
        onset_s: event.onset_s(),
        end_s: event.end_s(),
        first_block: first,
        last_block: last,
        first_across: across.map(|rows| rows.first),
        last_across: across.map(|rows| rows.last),
    }
}

/// The tightest policy that allows all observed differences.
///
/// Numbers get tolerances: for every column of time, load or speed the largest difference of any pair of events
/// with equal blocks. Differences in kind get counts: pairs with different blocks, splits, merges, missing,
/// extra and open events.
#[derive(Debug, Clone, Default)]
pub struct Draft {
    tolerances: [f64; COUNT],
    counts: Counts,
    largest_shift_s: f64,
    /// Whether ruptures may differ where no slip event does.
    pub(crate) ruptures: bool,
}

impl Draft {
    fn take(&mut self, outcome: &Outcome, group: &Group<'_>) {
        if outcome.class == Class::Identical {
            return;
        }
        let (&[old], &[new]) = (&group.old[..], &group.new[..]) else {
            self.counts[outcome.class] += 1;
            return;
        };
        let in_kind = |cell: &&CellChange| !cell.column.role().is_measured() || cell.difference.is_none();
        let cut = old.is_cut() || new.is_cut();
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
            self.counts[class] += 1;
            self.largest_shift_s = self.largest_shift_s.max(shift_s(old, new));
        }
        if class != Some(Class::Changed) {
            for cell in &outcome.cells {
                let known = class.is_none() || cell.column.is_of_onset();
                if let Some(difference) = cell.difference.filter(|_| known && !in_kind(&cell)) {
                    let tolerance = &mut self.tolerances[cell.column.place()];
                    *tolerance = tolerance.max(difference);
                }
            }
        }
    }

    /// The policy, with the window of the policy used for matching.
    pub fn policy(&self, window_s: Option<f64>) -> Policy {
        let mut policy = Policy { window_s, allows_ruptures: self.ruptures, ..Policy::default() };
        if self.counts[Class::Changed] + self.counts[Class::Open] > 0 {
            policy.max_shift_s = self.largest_shift_s;
        }
        for column in Column::all() {
            let absolute = self.tolerances[column.place()];
            policy = policy.with_tolerance(column, Tolerance { absolute, relative: 0.0 });
        }
        for class in Class::ALL.into_iter().filter(|&class| self.counts[class] > 0) {
            policy = policy.with_allowed(class, Allowed::UpTo(self.counts[class]));
        }
        policy
    }
}
