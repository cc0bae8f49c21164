//! Arguments of `asperity diff`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum DiffFormat {
    /// The main differences, on one screen.
    Text,
    /// All differences; the field `version` increases when the layout changes.
    Json,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum PairBy {
    /// By the hash of the resolved scenario, or by file name where one side has no hash.
    Hash,
    /// By file name, even if the scenarios differ.
    Name,
}

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity diff out/before.mcap out/after.mcap
  asperity diff out/before out/after    # two outputs of asperity reproduce
  asperity diff reference.csv out/mine.mcap --policy policy.toml
  asperity diff out/before.mcap out/after.mcap --draft-policy out/policy.toml
  asperity diff out/coarse/runs out/fine/runs --pair name
  asperity diff out/before.mcap out/after.mcap --page out/diff.html
  asperity diff out/before out/after --format json | python3 -m json.tool

For run logs, the settings that differ, the numbers of both summaries and the
pairs of ruptures come first, then the slip events. A counterpart is searched
for within 1 ms of an onset, or, between runs with different time steps, within
the mean time between events. Where the times of two parameter sets do not
match, ruptures and events are paired by their cycle between slips of the whole
slider, and by their place in the cycle.

Events are matched by when and where they slid, never by row: an extra or
missing event does not make later rows look different. Each event is identical,
within-tolerance, shifted (same blocks, another time), changed, split, merged,
missing, extra, or open (cut short by the end of a run). Tables need the
columns onset_s, end_s, first_block and last_block; a column that one side lacks
is not compared. Numbers of events are never compared, and steps only where
their times in seconds are equal.

A policy (TOML) defines which differences pass:
  window_s = 1e-3         # how far from an onset to search for its counterpart
  max_shift_s = 1e-6      # no pair may be shifted farther than this
  [columns.onset_s]
  absolute = 1e-9         # in the column's unit
  relative = 1e-12        # of the larger value; the larger tolerance applies
  [allow]
  shifted = true          # any number of them
  split = 2               # at most two in all
  ruptures = true         # may differ where no slip event does

Exit codes:
  0  nothing differs except what the policy allows
  1  something differs, or a run has no counterpart
  2  the two sides cannot be compared
  3, 4, 5, 7  a log is incomplete, damaged, salvaged with gaps, or its run was
              stopped (see asperity check)")]
pub(crate) struct DiffArguments {
    /// The old side: a run log, an event table (.csv, .parquet), a folder of either, or an
    /// output of asperity reproduce.
    #[arg(value_name = "OLD")]
    pub(crate) old: PathBuf,
    /// The new side.
    #[arg(value_name = "NEW")]
    pub(crate) new: PathBuf,
    /// Which differences count, and how many are allowed [default: all count, none allowed].
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) policy: Option<PathBuf>,
    /// Write the tightest policy under which this diff passes.
    #[arg(long, value_name = "POLICY.toml")]
    pub(crate) draft_policy: Option<PathBuf>,
    /// What to print.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: DiffFormat,
    /// How the runs of two folders are paired.
    #[arg(long, value_enum, default_value = "hash")]
    pub(crate) pair: PairBy,
    /// Write a page with settings, numbers and timelines of ruptures and events, with differences marked.
    #[arg(long, value_name = "FILE.html")]
    pub(crate) page: Option<PathBuf>,
    /// Write one row per match, including identical events.
    #[cfg(feature = "analysis")]
    #[arg(long, value_name = "FILE.parquet")]
    pub(crate) matches: Option<PathBuf>,
    /// Replace existing output files; OLD and NEW are never replaced.
    #[arg(long)]
    pub(crate) force: bool,
}
