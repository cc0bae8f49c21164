//! What is compared of two parameter sets before single events: the distributions of their ruptures, and figures that
//! show both runs.
//!
//! The ruptures are those of the figures of sizes and of times: from the first global slip on, since before it the load
//! rises and ruptures grow, so that they are no draws from one law; or all, where a run has no global slip.

use asperity_figures::draw::of_one_run::Kind;
use asperity_report::{Figure, picture};

use crate::reading;
use crate::report::{RuptureDiff, Sample, SettingChange};
use crate::run_log::RunLog;
use crate::statistics::{self, Distribution};
use crate::table::{Row, Table};

/// Two runs whose scenarios differ in a key that shapes the motion. Sizes and times are those of ruptures from the
/// first global slip on, or of all where a run has none.
#[derive(Debug, Clone, PartialEq)]
pub struct SideBySide {
    /// Whether fewer than half of the ruptures have a counterpart of the same blocks, as in two chaotic series.
    pub is_chaotic: bool,
    /// Sizes of ruptures that are no global slips, in blocks.
    pub sizes_blocks: Sample,
    /// Times from onset to onset, s.
    pub times_s: Sample,
    /// Figures of both runs, if they are drawn: their load, and the lengths of ruptures against it.
    pub courses: Vec<Figure>,
    /// Figures of sizes and of times.
    pub distributions: Vec<Figure>,
}

/// Kinds of figures, with their keys.
type Kinds = [(&'static str, &'static [&'static str]); 2];

const COURSES: Kinds = [("load", &["sliding=false"]), ("lengths", &[])];
const DISTRIBUTIONS: Kinds = [("sizes", &["fit=none"]), ("recurrence", &["fit=none", "from_blocks=1"])];

/// Compares two runs if a key that shapes the motion was set differently.
pub(crate) fn of(
    logs: [&RunLog; 2],
    tables: [&Table; 2],
    set_differently: &[SettingChange],
    ruptures: &RuptureDiff,
) -> Option<SideBySide> {
    // Those that shape the motion come first.
    let first = set_differently.first().filter(|setting| setting.shapes_motion)?;
    let [old, new] = [0, 1].map(|side| distributions(tables[side], logs[side]));
    let drawn = |kinds: Kinds| figures(kinds, logs, first, set_differently.len() > 1);
    let same_blocks = ruptures.pairs.as_ref().map_or(0, |pairs| pairs.same_blocks);
    Some(SideBySide {
        is_chaotic: 4 * same_blocks < ruptures.old + ruptures.new,
        sizes_blocks: statistics::compare(&old[0], &new[0]),
        times_s: statistics::compare(&old[1], &new[1]),
        courses: drawn(COURSES),
        distributions: drawn(DISTRIBUTIONS),
    })
}

/// The sizes of ruptures, and the times from onset to onset, s.
fn distributions(ruptures: &Table, of: &RunLog) -> [Distribution; 2] {
    let is_global = |row: &Row<'_>| row.blocks_slipped() == of.provenance.header.blocks;
    let first_global = ruptures.rows().position(|row| is_global(&row)).unwrap_or(0);
    let [mut sizes, mut times_s] = [Distribution::default(), Distribution::default()];
    let mut last_s = None;
    for row in ruptures.rows().skip(first_global) {
        if !is_global(&row) {
            sizes.add(row.blocks_slipped().into());
        }
        if let Some(last_s) = last_s.replace(row.onset_s()) {
            times_s.add(row.onset_s() - last_s);
        }
    }
    [sizes, times_s]
}

/// The figures of both runs, each called by its value of the first key that was set differently; those that both have
/// the data for.
fn figures(kinds: Kinds, logs: [&RunLog; 2], first: &SettingChange, has_more: bool) -> Vec<Figure> {
    let [Some(old), Some(new)] = logs.map(|log| log.drawn.as_ref()) else { return Vec::new() };
    let key = first.change.key.rsplit('.').next().unwrap_or_default();
    let more = if has_more { ", …" } else { "" };
    let labels = [("old", &first.change.old), ("new", &first.change.new)]
        .map(|(side, value)| format!("{side}: {key} = {}{more}", reading::setting(value)));
    let drawn = |(kind, keys): &(&str, &[&str])| {
        let keys: Vec<String> = keys.iter().map(|&key| key.to_owned()).collect();
        let kind = Kind::find(kind)?;
        let figure = kind.of_two([(old, &labels[0]), (new, &labels[1])], &keys).ok()?;
        let bytes = |ending: &str| figure.bytes(&[old, new], false, ending);
        let (svg, words) = bytes("svg").ok()?;
        let file = format!("{}.png", kind.name);
        let read = |file: &str| match file.ends_with(".svg") {
            true => Ok(Some(svg.clone())),
            false => bytes("png").map(|(png, _)| Some(png)),
        };
        let picture = picture(&file, &read).ok()?;
        Some(Figure { file, title: words.title, runs: labels.to_vec(), picture, ..Figure::default() })
    };
    kinds.iter().filter_map(drawn).collect()
}
