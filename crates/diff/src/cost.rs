//! The cost of matching events of two tables.
//!
//! A matching is a set of groups: pairs, one old event with several new ones (split), several old with one
//! new (merged), and events left over. Its cost is the sum over its groups; the best matching has the
//! lowest cost.
//!
//! | group | costs |
//! |---|---|
//! | event left over | [`ALONE`] |
//! | pair | ½ (1 - J_t) + ½ min(1, \|onset - onset'\| / window) + (1 - J_b) |
//! | split, merge | [`GROUP`] + (1 - share of the whole's duration that its parts cover) + for each part ½ (share of its duration outside of the whole) + ½ (share of its blocks outside) |
//!
//! J_t and J_b are the Jaccard indices, common over covered, of the two events' times and of their ranges
//! of blocks, over an area of their boxes of columns and rows. So two events are paired if that costs less than leaving both over, 1.5: two events that
//! start together may differ in everything else, two that share their blocks may follow each other in time,
//! but an event with a tenth of the other's time and blocks, away from its onset, is not its counterpart.
//! Events of a group must share blocks.
//!
//! Every term consists of sums, differences and products that commute, and split and merge treat whole and
//! part alike. So swapping the sides leaves the cost of a group unchanged to the bit. It is an integer, in
//! units of 2⁻³², so the order of summation does not matter.
//!
//! Where events are paired by cycles (`progress.rs`), onsets are places in the cycle, and events have no
//! duration: J_t is 0, or 1 at one place, and nothing is split or merged.
//!
//! Among matchings of equal cost, the one whose groups end earlier wins (by the sum of the ranks of their
//! events among all onsets of both sides), then the one with the lower checksum. Both rules are symmetric
//! too.

use std::ops::Add;

use asperity_record::BoundingBox;

use crate::table::Row;

/// The cost of an event without a counterpart.
pub(crate) const ALONE: i64 = UNIT / 4 * 3;

/// Base cost of a split or merge: a pair that explains as much is preferred.
const GROUP: i64 = UNIT / 4;

const UNIT: i64 = 1 << 32;

/// The cost of a matching, or of a part of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Cost {
    /// The primary cost, in units of 2⁻³².
    pub(crate) primary: i64,
    /// Breaks ties: sum of ranks.
    pub(crate) ranks: u64,
    /// Breaks the remaining ties: sum of checksums.
    pub(crate) checksum: u64,
}

impl Cost {
    pub(crate) const NONE: Cost = Cost { primary: 0, ranks: 0, checksum: 0 };

    #[inline]
    pub(crate) fn and(self, primary: i64) -> Cost {
        Cost { primary: self.primary + primary, ..self }
    }
}

impl Add for Cost {
    type Output = Cost;

    #[inline]
    fn add(self, other: Cost) -> Cost {
        Cost {
            primary: self.primary + other.primary,
            ranks: self.ranks + other.ranks,
            checksum: self.checksum + other.checksum,
        }
    }
}

/// The quantities of an event that the matching compares, and those that break ties. Times and the window
/// are in seconds, or places in cycles (`progress.rs`).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Span {
    pub(crate) onset_s: f64,
    /// Its end; infinite if the run ended before.
    end_s: f64,
    blocks: BoundingBox,
    /// How many blocks these are.
    block_count: u64,
    /// The latest onset that it is compared with, s.
    pub(crate) reach_s: f64,
    /// Number of different onsets before its own, on both sides.
    rank: u64,
    checksum: u64,
}

impl Span {
    /// From an event that starts at a place and reaches no farther than another; where places are no times, it
    /// has no duration.
    pub(crate) fn new(
        event: Row<'_>,
        place: f64,
        is_time: bool,
        rank: u64,
        window: f64,
        farthest: f64,
    ) -> Span {
        let (onset_s, blocks) = (place, event.bounding_box());
        let end_s = if is_time { event.end_s() } else { Some(onset_s) };
        let mut checksum = onset_s.to_bits();
        let end = end_s.map_or(0, f64::to_bits);
        // Includes its number, which distinguishes two equal rows.
        let columns = blocks.columns;
        for word in [end, columns.first.into(), columns.last.into(), event.number()] {
            checksum = mixed(checksum ^ word);
        }
        if !blocks.is_in_first_row() {
            checksum = mixed(checksum ^ u64::from(blocks.rows.first));
            checksum = mixed(checksum ^ u64::from(blocks.rows.last));
        }
        Span {
            onset_s,
            end_s: end_s.unwrap_or(f64::INFINITY),
            blocks,
            block_count: blocks.count(),
            reach_s: end_s.unwrap_or(onset_s).max(onset_s + window).min(farthest),
            rank,
            checksum,
        }
    }

    fn is_open(&self) -> bool {
        self.end_s == f64::INFINITY
    }

    /// Time that two events have in common, s. One without an end lasts as long as the other.
    #[inline]
    fn common_s(&self, other: &Span) -> f64 {
        let to_s = self.end_s.min(other.end_s);
        if to_s == f64::INFINITY { 0.0 } else { (to_s - self.onset_s.max(other.onset_s)).max(0.0) }
    }
}

/// Overlap of two events; a group needs a common block.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Overlap {
    /// Time, s.
    pub(crate) common_s: f64,
    /// Blocks, at least one.
    blocks: u64,
}

impl Overlap {
    #[inline]
    pub(crate) fn of(a: &Span, b: &Span) -> Option<Overlap> {
        let blocks = a.blocks.common(b.blocks);
        (blocks > 0).then(|| Overlap { common_s: a.common_s(b), blocks })
    }
}

/// The finaliser of splitmix64 (Steele, Lea and Flood 2014).
fn mixed(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}

fn tied(primary: i64, a: &Span, b: &Span) -> Cost {
    let checksum = mixed(a.checksum.wrapping_add(b.checksum)) >> 32;
    Cost { primary, ranks: a.rank.max(b.rank), checksum }
}

/// Rounds a non-negative cost to the nearest unit.
fn units(cost: f64) -> i64 {
    (cost * UNIT as f64 + 0.5) as i64
}

/// The cost of a pair, if it is one.
#[inline]
pub(crate) fn pair(a: &Span, b: &Span, overlap: Overlap, window_s: f64) -> Option<Cost> {
    let Overlap { common_s, blocks } = overlap;
    let apart_s = (a.onset_s - b.onset_s).abs();
    if common_s == 0.0 && apart_s > window_s {
        return None;
    }
    // Open events count as long as those that they are compared with.
    let time = if a.is_open() && b.is_open() {
        1.0
    } else {
        let last_s = a.end_s.min(b.end_s);
        let length_s =
            |span: &Span| ((if span.is_open() { last_s } else { span.end_s }) - span.onset_s).max(0.0);
        let covered_s = length_s(a) + length_s(b) - common_s;
        match covered_s > 0.0 {
            true if common_s > 0.0 => common_s / covered_s,
            false if apart_s == 0.0 => 1.0,
            _ => 0.0,
        }
    };
    let blocks = blocks as f64 / (a.block_count + b.block_count - blocks) as f64;
    let offset = if apart_s == 0.0 { 0.0 } else { (apart_s / window_s).min(1.0) };
    let primary = units(0.5 * (1.0 - time)) + units(0.5 * offset) + units(1.0 - blocks);
    (primary < 2 * ALONE).then(|| tied(primary, a, b))
}

/// The cost of taking an event for a part of a split or merged one, if it can be:
/// to be added to [`BEGUN`].
#[inline]
pub(crate) fn part(whole: &Span, part: &Span, overlap: Overlap) -> Option<Cost> {
    let Overlap { common_s, blocks } = overlap;
    // An event that is cut short never counts as split.
    if common_s <= 0.0 || whole.is_open() {
        return None;
    }
    let inside_time = if part.is_open() { 1.0 } else { common_s / (part.end_s - part.onset_s) };
    let inside_blocks = blocks as f64 / part.block_count as f64;
    let primary = units(0.5 * (1.0 - inside_time)) + units(0.5 * (1.0 - inside_blocks))
        - units(common_s / (whole.end_s - whole.onset_s));
    Some(tied(primary, whole, part))
}

/// The cost of a split or merge before its first part.
pub(crate) const BEGUN: i64 = GROUP + UNIT;
