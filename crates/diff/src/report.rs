//! The result of a diff as data: the only input of the terminal summary, the page and `--format json`. The
//! JSON is these structs, field by field; a change to a field's name or meaning raises [`VERSION`].

use std::array;
use std::iter::Sum;
use std::ops::{Index, IndexMut};

use asperity_record::{BoundingBox, Cell, Reach};
use serde::{Serialize, Serializer};

use crate::column::Column;
use crate::side_by_side::SideBySide;

/// The field `format` of a report.
pub const FORMAT: &str = "asperity-diff";
/// The field `version` of a report.
pub const VERSION: u32 = 1;

/// Declares the classes once: variant, name, and meaning.
macro_rules! classes {
    ($($class:ident $name:literal $meaning:literal,)+) => {
        /// The class of an event, or of several that belong together.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub enum Class {
            $(#[doc = $meaning] $class,)+
        }

        impl Class {
            /// All classes.
            pub const ALL: [Class; [$($name),+].len()] = [$(Class::$class),+];

            /// Its name in policies and reports.
            pub fn name(self) -> &'static str {
                match self {
                    $(Class::$class => $name,)+
                }
            }

            /// Its meaning, in words.
            pub fn meaning(self) -> &'static str {
                match self {
                    $(Class::$class => $meaning,)+
                }
            }
        }
    };
}

classes! {
    Identical "identical" "one event on each side, equal in every column compared",
    WithinTolerance "within-tolerance" "one on each side, every column within its tolerance",
    Shifted "shifted" "one on each side, of the same blocks at another time",
    Changed "changed" "one on each side that differ in anything else",
    Split "split" "one old event that is several new ones",
    Merged "merged" "several old events that are one new one",
    Missing "missing" "an old event without a new one",
    Extra "extra" "a new event without an old one",
    Open "open" "cut short by the end of one of the runs, or after it",
}

impl Class {
    /// The class of this name.
    pub fn named(name: &str) -> Option<Class> {
        Class::ALL.into_iter().find(|class| class.name() == name)
    }

    /// Whether it is allowed without an entry in the policy.
    pub fn is_no_difference(self) -> bool {
        matches!(self, Class::Identical | Class::WithinTolerance)
    }
}

impl Serialize for Class {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// A whole diff.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// [`FORMAT`].
    pub format: &'static str,
    /// [`VERSION`].
    pub version: u32,
    /// The old side, as given.
    pub old: String,
    /// The new side, as given.
    pub new: String,
    /// The policy's file; null for the default, exact.
    pub policy: Option<String>,
    /// The outcome.
    pub verdict: Verdict,
    /// Number of matches in each class, over all runs.
    pub counts: Counts,
    /// The pairs of runs, in the order of their names.
    pub runs: Vec<RunDiff>,
    /// Runs that only one side has. Any makes the verdict `differs`.
    pub unpaired: Vec<Unpaired>,
    /// Classes with more matches than the policy allows.
    pub exceeded: Vec<Exceeded>,
    /// Claims whose verdict or value changed; only between outputs of `asperity reproduce`.
    pub claims: Vec<ClaimChange>,
}

/// The outcome of a diff.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// All differences are allowed by the policy.
    WithinPolicy,
    /// Something does.
    Differs,
}

/// Matches by class. A split or merge is one match, whatever the number of its events. In JSON an
/// object with a number for each class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts([u64; Class::ALL.len()]);

impl Counts {
    /// All matches.
    pub fn total(&self) -> u64 {
        self.0.iter().sum()
    }

    /// Matches that are neither identical nor within tolerance.
    pub fn differing(&self) -> u64 {
        self.total() - self[Class::Identical] - self[Class::WithinTolerance]
    }

    /// The classes that occur, with their numbers of matches.
    pub fn there(&self) -> impl Iterator<Item = (Class, u64)> {
        Class::ALL.into_iter().zip(self.0).filter(|(_, count)| *count > 0)
    }
}

impl Index<Class> for Counts {
    type Output = u64;

    fn index(&self, class: Class) -> &u64 {
        &self.0[class as usize]
    }
}

impl IndexMut<Class> for Counts {
    fn index_mut(&mut self, class: Class) -> &mut u64 {
        &mut self.0[class as usize]
    }
}

impl<'a> Sum<&'a Counts> for Counts {
    fn sum<I: Iterator<Item = &'a Counts>>(all: I) -> Counts {
        all.fold(Counts::default(), |sum, more| Counts(array::from_fn(|class| sum.0[class] + more.0[class])))
    }
}

impl Serialize for Counts {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let fields = Class::ALL.map(|class| class.name().replace('-', "_"));
        serializer.collect_map(fields.into_iter().zip(self.0))
    }
}

/// Two runs, event by event.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RunDiff {
    /// The keys of the resolved scenarios that were set differently, first those that shape the motion.
    pub set_differently: Vec<SettingChange>,
    /// The old run.
    pub old: RunSide,
    /// The new run.
    pub new: RunSide,
    /// The summaries of both runs, number by number; empty if a side is a table, which has no summary.
    pub summary: Vec<NumberChange>,
    /// The fate of the ruptures; null if a side has none to compare.
    pub ruptures: Option<RuptureDiff>,
    /// What is compared of two parameter sets before single events; none where only the code differs. Not in the JSON.
    #[serde(skip)]
    pub side_by_side: Option<SideBySide>,
    /// Why ruptures were not compared; null where they were, and between tables.
    pub no_ruptures: Option<String>,
    /// Differences between the runs beside their events: scenario keys, code version, solver, ...
    pub provenance: Vec<ProvenanceChange>,
    /// The fate of the slip events. In JSON its fields are inlined here.
    #[serde(flatten)]
    pub events: TableDiff,
    /// Changes in the precursor table; null if it cannot be computed for both sides.
    pub precursors: Option<PrecursorChanges>,
}

impl RunDiff {
    /// The name of the pair.
    pub fn name(&self) -> String {
        pair_name(&self.old.name, &self.new.name)
    }

    /// Whether ruptures differ although every slip event is identical.
    pub fn ruptures_alone_differ(&self) -> bool {
        self.ruptures.as_ref().is_some_and(|ruptures| ruptures.table.counts.differing() > 0)
            && self.events.counts[Class::Identical] == self.events.counts.total()
    }
}

/// How the events of two runs are paired.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PairedBy {
    /// By time and blocks.
    #[default]
    Time,
    /// By the cycle between global slips, the place in it, and blocks, since times do not match.
    Cycles,
}

/// The ruptures of two runs, rupture by rupture.
#[derive(Debug, Clone, Serialize)]
pub struct RuptureDiff {
    /// Number of pairs, splits and merges in time; fewer than `counts` if ruptures are paired by cycles.
    pub matches_in_time: u64,
    /// How the new one of a pair differs from the old one, over all pairs; null without pairs.
    pub pairs: Option<PairDifferences>,
    /// The load at which a precursor, or the first global slip, first reached a share of the slider.
    pub reached: Vec<LengthReached>,
    /// How many ruptures the old run has.
    pub old: u64,
    /// How many the new run has.
    pub new: u64,
    /// Their fate; event numbers in it are those of ruptures. In JSON its fields are inlined here.
    #[serde(flatten)]
    pub table: TableDiff,
}

/// Differences, new less old, over pairs of one old and one new rupture.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PairDifferences {
    /// Number of pairs.
    pub pairs: u64,
    /// How many of them are of the same blocks.
    pub same_blocks: u64,
    /// Median difference of their lengths, blocks.
    pub median_length_blocks: f64,
    /// Median difference of `F_T / F_N` at onset.
    pub median_ft_fn_onset: f64,
}

/// When a precursor first reached a share of the slider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LengthReached {
    /// The share, `L_p / L`.
    pub lp_l: f64,
    /// `F_T / F_N` at the onset of the first rupture from block 1 that reached it in the old run; null if
    /// none did.
    pub old_ft_fn: Option<f64>,
    /// The value in the new run.
    pub new_ft_fn: Option<f64>,
}

/// The fate of the rows of two tables, slip events or ruptures.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct TableDiff {
    /// Number of old rows.
    #[serde(skip)]
    pub old_rows: u64,
    /// Number of new rows.
    #[serde(skip)]
    pub new_rows: u64,
    /// How they were paired.
    pub paired_by: PairedBy,
    /// Window in time around an event's onset in which its counterpart is searched for, s.
    pub window_s: f64,
    /// Window around its place in the cycle instead, as a share of the cycle. Absent if paired by time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window_cycles: Option<f64>,
    /// The columns that were compared.
    pub columns: Vec<Column>,
    /// Columns of the event table that one side or both lack; they were not compared. Absent of
    /// ruptures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub columns_left_out: Option<Vec<Column>>,
    /// How many matches of each class.
    pub counts: Counts,
    /// Numbers of differences that the policy does not allow, by class. Absent for ruptures, which are
    /// judged as a whole ([`RunDiff::ruptures_alone_differ`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub not_allowed: Option<Counts>,
    /// Per column: how often it differs in a pair of events, and how far.
    pub column_changes: Vec<ColumnChange>,
    /// The largest shift of a pair of events: the farther of onset and end, s. 0 without pairs.
    pub largest_shift_s: f64,
    /// Everything that is neither identical nor within tolerance, in order of time.
    pub findings: Vec<Finding>,
    /// How many findings were counted and left out of `findings`, for want of room.
    pub findings_left_out: u64,
    /// Every match, including identical ones, in order of time, for timelines.
    pub matches: Vec<Match>,
    /// How many matches were counted and left out of `matches`, for want of room.
    pub matches_left_out: u64,
    /// Where the tables part; null where no row differs.
    pub horizon: Option<Horizon>,
}

impl TableDiff {
    /// Number of differences that the policy does not allow.
    pub fn refused(&self) -> u64 {
        self.not_allowed.as_ref().map_or(0, Counts::total)
    }

    /// The columns that could not be compared.
    pub fn left_out(&self) -> &[Column] {
        self.columns_left_out.as_deref().unwrap_or_default()
    }
}

/// The name of a pair of runs: the common name, or both.
pub fn pair_name(old: &str, new: &str) -> String {
    if old == new { old.to_owned() } else { format!("{old} / {new}") }
}

/// A number of the summary of two runs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NumberChange {
    /// Its key in the summary.
    pub key: String,
    /// Value of the old run; null where there is nothing to measure.
    pub old: serde_json::Value,
    /// Value of the new run.
    pub new: serde_json::Value,
    /// The new number less the old one; null unless both are numbers.
    pub difference: Option<f64>,
    /// The difference over the magnitude of the old one; null without a difference, or if the old one is 0.
    pub relative_change: Option<f64>,
}

impl NumberChange {
    /// A number on both sides.
    pub fn between(key: &str, old: &serde_json::Value, new: &serde_json::Value) -> NumberChange {
        let numbers = old.as_f64().zip(new.as_f64());
        let finite = |value: &f64| value.is_finite();
        let difference = numbers.map(|(old, new)| new - old).filter(finite);
        let relative_change = numbers.zip(difference).map(|((old, _), by)| by / old.abs()).filter(finite);
        NumberChange { key: key.to_owned(), old: old.clone(), new: new.clone(), difference, relative_change }
    }
}

/// One of two runs.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct RunSide {
    /// Its name: the file's, without `.mcap`, `.events.csv` and the like.
    pub name: String,
    /// Its file.
    pub path: String,
    /// How many slip events it has.
    pub events: u64,
    /// End of the run, s; null if the file lacks it, as tables do.
    pub duration_s: Option<f64>,
    /// Number of blocks; null if the file lacks it.
    pub blocks: Option<u32>,
    /// In how many rows they lie; over an area only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rows: Option<u32>,
    /// Hash of the resolved scenario; null if the file lacks it.
    pub scenario_hash: Option<String>,
}

/// A key of the scenario that was set differently.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SettingChange {
    /// The key and both values; null if a scenario lacks it.
    #[serde(flatten)]
    pub change: NumberChange,
    /// The unit in which its name ends; null without one.
    pub unit: Option<&'static str>,
    /// Whether it affects the motion, unlike names, the duration, detection and recording.
    pub shapes_motion: bool,
}

/// A difference between two runs beside their events.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ProvenanceChange {
    /// `scenario: KEY` for a key of the resolved scenario, else the field of the run header:
    /// `code_version`, `solver`, `parameter_set`, `record_schema_version`.
    pub key: String,
    /// Value of the old run; null if it has none.
    pub old: Option<String>,
    /// Value of the new run; null if it has none.
    pub new: Option<String>,
}

impl ProvenanceChange {
    /// Whether it is a key of the scenario, which is among the settings too.
    pub fn is_of_scenario(&self) -> bool {
        self.key.starts_with("scenario: ")
    }
}

/// How a column differs over all pairs of one old and one new event.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnChange {
    /// The column.
    pub column: Column,
    /// Number of pairs in which it differs.
    pub differing: u64,
    /// Number of pairs in which it differs by more than its tolerance.
    pub beyond_tolerance: u64,
    /// The largest difference that can be measured, in the column's unit.
    pub largest: f64,
    /// Number of the old event with the largest one.
    pub old_event: u64,
    /// Number of the new event there.
    pub new_event: u64,
}

/// Time and blocks of an event, for timelines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Extent {
    /// Its number in its table, from 0.
    pub event: u64,
    /// Its onset, s.
    pub onset_s: f64,
    /// Its end, s; null if the run ended before.
    pub end_s: Option<f64>,
    /// Lowest-numbered block; over an area the first column.
    pub first_block: u32,
    /// Highest-numbered block; over an area the last column.
    pub last_block: u32,
    /// First row; over an area only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_across: Option<u32>,
    /// Last row.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_across: Option<u32>,
}

impl Extent {
    /// First and last block, and row.
    pub fn bounding_box(&self) -> BoundingBox {
        let columns = Reach { first: self.first_block, last: self.last_block };
        BoundingBox::new(columns, self.first_across, self.last_across)
    }

    /// What the box of events of one kind includes, in words, with a word between the ends of a range:
    /// `blocks 3-7`, over an area `columns 3-7, rows 1-4`.
    pub(crate) fn words(of: BoundingBox, is_over_area: bool, to: &str) -> String {
        let range = |thing: &str, Reach { first, last }: Reach| match first == last {
            true => format!("{thing} {first}"),
            false => format!("{thing}s {first}{to}{last}"),
        };
        match is_over_area {
            false => range("block", of.columns),
            true => format!("{}, {}", range("column", of.columns), range("row", of.rows)),
        }
    }
}

/// Events of both sides that belong together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Match {
    /// Their class.
    pub class: Class,
    /// Whether the policy allows it.
    pub allowed: bool,
    /// The old events; none for `extra`, several for `merged`.
    pub old: Vec<Extent>,
    /// The new events; none for `missing`, several for `split`.
    pub new: Vec<Extent>,
}

/// A match that is neither identical nor within tolerance.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// The class of the events.
    pub class: Class,
    /// Whether the policy allows it.
    pub allowed: bool,
    /// The rule that put it there, in words.
    pub rule: String,
    /// The old events.
    pub old: Vec<Extent>,
    /// The new events.
    pub new: Vec<Extent>,
    /// The farther of the shifts of onset and end, s; null unless one event matches one.
    pub shift_s: Option<f64>,
    /// The columns that differ by more than their tolerance; empty unless one event matches
    /// one.
    pub columns: Vec<CellChange>,
    /// Duration and blocks preserved by a split or merge; null for other classes.
    pub conservation: Option<Conservation>,
}

impl Finding {
    /// How many blocks the largest of its events spans.
    pub fn most_blocks(&self) -> u64 {
        self.old.iter().chain(&self.new).map(|event| event.bounding_box().count()).max().unwrap_or(0)
    }
}

/// A cell that differs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CellChange {
    /// The column.
    pub column: Column,
    /// The old value.
    pub old: Cell,
    /// The new value.
    pub new: Cell,
    /// The difference; null between a number and an empty cell.
    pub difference: Option<f64>,
    /// The difference that the policy allows.
    pub tolerance: f64,
}

/// The quantities preserved by a split or merge: the union of the durations, and of the blocks from
/// `first_block` to `last_block`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Conservation {
    /// Time covered by the old events, s.
    pub old_duration_s: f64,
    /// Time covered by the new events, s.
    pub new_duration_s: f64,
    /// Whether these agree within the tolerances of `onset_s` and `end_s`.
    pub duration_conserved: bool,
    /// Blocks covered by the old events.
    pub old_blocks: u64,
    /// Blocks covered by the new events.
    pub new_blocks: u64,
    /// Whether these are the same blocks.
    pub blocks_conserved: bool,
}

/// Where and how two runs part.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Horizon {
    /// Onset of the first event that differs beyond tolerance, on whichever side it is earlier, s.
    pub at_s: f64,
    /// Its class.
    pub class: Class,
    /// Its number on the old side; null where it is extra.
    pub old_event: Option<u64>,
    /// Its number on the new side; null where it is missing.
    pub new_event: Option<u64>,
    /// Number of matches before it.
    pub matches_before: u64,
    /// Growth of the differences, by decades of the matches after the first one.
    pub growth: Vec<Growth>,
    /// Statistics of the events from there on.
    pub beyond: Statistics,
}

/// A decade of matches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Growth {
    /// Number of its first match, from 1.
    pub from: u64,
    /// Number of its last.
    pub to: u64,
    /// Onset of its first match, s.
    pub from_s: f64,
    /// How many of them differ beyond tolerance.
    pub differing: u64,
    /// The largest shift of a pair among them, s.
    pub largest_shift_s: f64,
}

/// Events from the horizon on, as distributions.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Statistics {
    /// Number of old events.
    pub old_events: u64,
    /// Number of new events.
    pub new_events: u64,
    /// Events per second on the old side; null where the time is unknown or none.
    pub old_per_s: Option<f64>,
    /// The value per second on the new side.
    pub new_per_s: Option<f64>,
    /// Lengths of the events, in blocks.
    pub length_blocks: Sample,
    /// Times from onset to onset, s.
    pub recurrence_s: Sample,
}

/// A quantity on both sides.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Sample {
    /// Its median on the old side, to a part in 256; null without events.
    pub old_median: Option<f64>,
    /// The median on the new side.
    pub new_median: Option<f64>,
    /// How many values there are of the old side and of the new one. Not in the JSON.
    #[serde(skip)]
    pub counts: [u64; 2],
    /// Two-sample Kolmogorov-Smirnov test; null with too few values.
    pub test: Option<KolmogorovSmirnov>,
}

/// Outcome of a two-sample Kolmogorov-Smirnov test.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct KolmogorovSmirnov {
    /// [`KolmogorovSmirnov::NAME`].
    pub name: &'static str,
    /// The largest distance of the distributions, 0 to 1.
    pub distance: f64,
    /// Probability of such a distance or a larger one if the sides are of one distribution. An upper bound
    /// as far as ties and bins go; correlated events make it too small.
    pub p: f64,
}

impl KolmogorovSmirnov {
    /// The test whether two samples can have the same distribution, of any form.
    pub const NAME: &'static str = "two-sample Kolmogorov-Smirnov";
    /// The sides are reported as different if p is below this.
    pub const SIGNIFICANT: f64 = 0.01;
}

/// Changes in the precursor table, Lp/L against F_T/F_N.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PrecursorChanges {
    /// Rows on the old side.
    pub old_rows: u64,
    /// Rows on the new side.
    pub new_rows: u64,
    /// Rows that are the same on both sides.
    pub same_rows: u64,
    /// The rest, by length.
    pub rows: Vec<PrecursorChange>,
}

/// A row of the precursor table that changed. Rows are matched by their length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PrecursorChange {
    /// Precursor length over slider length.
    pub lp_l: f64,
    /// Its F_T/F_N on the old side; null where there is no precursor of this length.
    pub old_ft_fn: Option<f64>,
    /// `F_T / F_N` on the new side.
    pub new_ft_fn: Option<f64>,
    /// Number of the old event.
    pub old_event: Option<u64>,
    /// Number of the new event.
    pub new_event: Option<u64>,
}

/// A run that only one side has.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unpaired {
    /// `old` or `new`.
    pub side: &'static str,
    /// The run.
    pub run: RunSide,
    /// Why it has no counterpart.
    pub why: String,
}

/// A class with more matches than the policy allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Exceeded {
    /// The class.
    pub class: Class,
    /// How many are allowed.
    pub allowed: u64,
    /// How many there are.
    pub found: u64,
}

/// A claim whose verdict or value changed.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClaimChange {
    /// Where the thesis states it.
    pub about: String,
    /// The run it is measured in.
    pub run: String,
    /// The measured quantity.
    pub measure: String,
    /// The old value; null if there was none.
    pub old_value: Option<f64>,
    /// The value now.
    pub new_value: Option<f64>,
    /// The old verdict; null if the claim was not made.
    pub old_verdict: Option<String>,
    /// The verdict now.
    pub new_verdict: Option<String>,
}
