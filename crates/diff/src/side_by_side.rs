//! What is compared of two parameter sets before single events: the distributions of their ruptures, and figures that
//! show both runs.
//!
//! The ruptures are those of the figures of sizes and of times: from the first global slip on, since before it the load
//! rises and ruptures grow, so that they are no draws from one law; or all, where a run has no global slip.

use asperity_figures::draw::Caption;
use asperity_figures::draw::of_one_run::{Kind, OneFigure};
use asperity_numbers::run_data::RunData;
use asperity_record::{Reach, RunHeader};
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
    /// Whether both are recordings.
    pub are_recordings: bool,
    /// What ruptures are compared by, with their values: sizes of those that are no global slips, in blocks or beside a
    /// recording as shares of the slider; times from onset to onset, s; and beside a recording speeds of fronts, m/s, and
    /// falls of `F_T / F_N`, in load drops of a recording and in ruptures of a run.
    pub quantities: Vec<(&'static str, Sample)>,
    /// Figures of both runs, if they are drawn: their load, and the lengths of ruptures against it.
    pub courses: Vec<Figure>,
    /// Figures of sizes and of times.
    pub distributions: Vec<Figure>,
}

/// Kinds of figures, with their keys.
type Keyed = (&'static str, &'static [&'static str]);

const COURSES: [Keyed; 2] = [("load", &["sliding=false"]), ("lengths", &[])];
const DISTRIBUTIONS: [Keyed; 2] = [("sizes", &["fit=none"]), ("recurrence", &["fit=none", "from_blocks=1"])];

/// Compares two runs if a key that shapes the motion was set differently, or one is a recording.
pub(crate) fn of(
    logs: [&RunLog; 2],
    tables: [&Table; 2],
    set_differently: &[SettingChange],
    ruptures: &RuptureDiff,
) -> Option<SideBySide> {
    let labels = labels(logs, set_differently)?;
    let measured = logs.map(|log| log.provenance.header.sensors.is_some());
    let is_measured = measured.contains(&true);
    let [old, new] = [0, 1].map(|side| distributions(tables[side], logs[side], is_measured));
    let unit =
        if is_measured { "sizes below the whole slider, L" } else { "sizes below the whole slider, blocks" };
    let mut quantities = vec![
        (unit, statistics::compare(&old[0], &new[0])),
        ("onset to onset, s", statistics::compare(&old[1], &new[1])),
    ];
    if is_measured {
        let [old, new] = logs.map(|log| log.fronts_m_per_s.iter().copied().collect());
        quantities
            .extend([("fronts, m/s", statistics::compare(&old, &new)), ("falls of F_T/F_N", drops(logs))]);
    }
    let same_blocks = ruptures.pairs.as_ref().map_or(0, |pairs| pairs.same_blocks);
    // The sizes of ruptures have no common unit.
    let distributions = if is_measured { &DISTRIBUTIONS[1..] } else { &DISTRIBUTIONS };
    Some(SideBySide {
        is_chaotic: 4 * same_blocks < ruptures.old + ruptures.new,
        are_recordings: measured == [true; 2],
        quantities,
        courses: figures(&COURSES, logs, &labels),
        distributions: figures(distributions, logs, &labels),
    })
}

/// The falls of `F_T / F_N`. Laboratories see none below their noise, so the least of a recording is the least that counts.
fn drops(logs: [&RunLog; 2]) -> Sample {
    let of_lab = logs.iter().filter(|log| log.provenance.header.sensors.is_some());
    let least = of_lab.flat_map(|log| &log.drops_ft_fn).copied().fold(f64::INFINITY, f64::min);
    let [old, new] = logs.map(|log| log.drops_ft_fn.iter().copied().filter(|drop| *drop >= least).collect());
    statistics::compare(&old, &new)
}

/// The sizes of ruptures, in blocks or as shares of the slider, and the times from onset to onset, s.
fn distributions(ruptures: &Table, of: &RunLog, in_shares: bool) -> [Distribution; 2] {
    let header = &of.provenance.header;
    let size = |row: &Row<'_>| match &header.sensors {
        Some(sensors) => {
            let Reach { first, last } = row.reach();
            (first..=last).filter_map(|sensor| sensors.share_m(sensor)).sum::<f64>() / sensors.length_m
        }
        None if in_shares => f64::from(row.blocks_slipped()) / f64::from(header.blocks),
        None => row.blocks_slipped().into(),
    };
    let is_global = |row: &Row<'_>| row.blocks_slipped() == header.blocks;
    let first_global = ruptures.rows().position(|row| is_global(&row)).unwrap_or(0);
    let [mut sizes, mut times_s] = [Distribution::default(), Distribution::default()];
    let mut last_s = None;
    for row in ruptures.rows().skip(first_global) {
        if !is_global(&row) {
            sizes.add(size(&row));
        }
        if let Some(last_s) = last_s.replace(row.onset_s()) {
            times_s.add(row.onset_s() - last_s);
        }
    }
    [sizes, times_s]
}

/// What runs are called: by their values of the first key that was set differently, or recordings, and what is beside
/// them, by their names.
fn labels(logs: [&RunLog; 2], set_differently: &[SettingChange]) -> Option<[String; 2]> {
    let headers = logs.map(|log| &log.provenance.header);
    let is_same = headers[0].scenario_hash == headers[1].scenario_hash;
    if !is_same && headers.iter().any(|header| header.sensors.is_some()) {
        let label = |side, of: &RunHeader| {
            let how = if of.sensors.is_some() { "measured" } else { "simulated" };
            format!("{side}: {}, {how}", of.scenario)
        };
        return Some([label("old", headers[0]), label("new", headers[1])]);
    }
    // Those that shape the motion come first.
    let first = set_differently.first().filter(|setting| setting.shapes_motion)?;
    let key = first.change.key.rsplit('.').next().unwrap_or_default();
    let more = if set_differently.len() > 1 { ", …" } else { "" };
    let sides = [("old", &first.change.old), ("new", &first.change.new)];
    Some(sides.map(|(side, value)| format!("{side}: {key} = {}{more}", reading::setting(value))))
}

/// The figures of both runs; those that both have the data for.
fn figures(kinds: &[Keyed], logs: [&RunLog; 2], labels: &[String; 2]) -> Vec<Figure> {
    let [Some(old), Some(new)] = logs.map(|log| log.drawn.as_ref()) else { return Vec::new() };
    let drawn = |(kind, keys): &(&str, &[&str])| {
        let keys: Vec<String> = keys.iter().map(|&key| key.to_owned()).collect();
        let figure = Kind::find(kind)?.of_two([(old, &labels[0]), (new, &labels[1])], &keys).ok()?;
        embedded(&figure, &[old, new], labels.to_vec())
    };
    kinds.iter().filter_map(drawn).collect()
}

/// A figure for a page that holds its picture; none if the runs lack what it shows.
pub fn embedded(figure: &OneFigure, of: &[&RunData], runs: Vec<String>) -> Option<Figure> {
    let bytes = |ending: &str| figure.bytes(of, false, ending);
    let (svg, Caption { title, caption }) = bytes("svg").ok()?;
    let file = format!("{}.png", figure.kind.name);
    let read = |file: &str| match file.ends_with(".svg") {
        true => Ok(Some(svg.clone())),
        false => bytes("png").map(|(png, _)| Some(png)),
    };
    let picture = picture(&file, &read).ok()?;
    Some(Figure { file, title, caption, runs, picture })
}
