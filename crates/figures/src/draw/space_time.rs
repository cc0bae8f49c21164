//! Block against time: what slid where and when, how fronts came to each block, and how far slip had
//! come. Of a recording the sensors, each with the part of the slider that is nearest to it.
//!
//! A block that slides in a rupture is a patch from its arrival to its stop. Seen from far away
//! patches are thinner than a pixel: neighbours that would look alike are drawn as one, and none is
//! narrower than a pixel. Over an area the columns of contacts take the place of blocks. Of a rupture colours show how
//! fast contacts were, in states that are computed again.

use std::collections::{BTreeMap, BTreeSet};

use asperity_numbers::estimate::Estimate;
use asperity_numbers::front_speed_m_per_s;
use asperity_numbers::fronts::crossing_s;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{COMPUTED, NotKept, RunData};
use asperity_record::{Arrival, Rupture, Sensors, WindowRecord, magnitude};
use plotters::prelude::RGBColor;
use schemars::JsonSchema;
use serde::Deserialize;

use super::colours::{Colours, On, mixed};
use super::kind::{Figure, keys, of_one_run, place_name};
use super::lines::within;
use super::rupture_selector::{Clock, Film, RuptureSelector, Sort, color_of, end_s, film, picked, sorted};
use super::scale::Scale;
use super::sheet::{Dash, GREEN, INK, Layer, Marker, Pen, Shape, Sheet, Tile};

keys! {
    SpaceTime: run;

    /// Start of the time axis; by default that of the run, or shortly before the rupture.
    from_s: Option<f64>,
    /// End of the time axis; by default that of the run, or shortly after the rupture.
    to_s: Option<f64>,
    /// The lowest block shown; the first, or the first of the rupture, if absent.
    from_block: Option<u32>,
    /// The highest block shown; the last, or the last of the rupture, if absent.
    to_block: Option<u32>,
    /// The number of a rupture to zoom to, as in its table.
    rupture: Option<u64>,
    /// The rupture to zoom to, where `rupture` gives no number.
    which: Option<RuptureSelector>,
    /// How places along the slider are counted, by default in mm; a slider of one block has its number.
    #[serde(default)]
    place: Place,
    /// Whether to show recorded velocities alone. Otherwise those of a rupture, or of a part between `from_s` and `to_s`
    /// of at most 2 % of the run, are computed by repeating the run's steps; the smallest colour is where those of
    /// sticking contacts end.
    #[serde(default)]
    recorded_only: bool,
}

/// How places along the slider are counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Place {
    /// By the distance from the first block, mm, so that slopes of fronts are speeds; in a medium by the depth, km.
    #[default]
    Mm,
    /// By the number of the block, or of the column.
    Block,
}

impl SpaceTime {
    /// The states to compute.
    fn film(&self) -> Option<Film> {
        let between_s = self.from_s.zip(self.to_s).map(|(from_s, to_s)| [from_s, to_s]);
        let film = Film { between_s, ..film(self.rupture, self.which, INSTANTS as u32, None).ok()? };
        let is_part = self.rupture.is_some() || self.which.is_some() || between_s.is_some();
        (is_part && !self.recorded_only).then_some(film)
    }
}

impl Figure for SpaceTime {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        let velocities = self.film().into_iter().collect();
        RequiredData { arrivals: true, velocities, ..RequiredData::WINDOWS }
    }

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let zoom = picked(run, self.rupture, self.which)?;
        let title = zoom.map_or_else(String::new, |rupture| format!("rupture {}", rupture.rupture));
        let (times_s, blocks) = ([self.from_s, self.to_s], [self.from_block, self.to_block]);
        Ok(map(run, zoom, times_s, blocks, self.place)?.titled(title))
    }
}

/// Number of patches that are distinguishable across.
const ACROSS: f64 = 1400.0;

/// A front is drawn if it takes at least this many of them.
const FRONT_ACROSS: f64 = 14.0;

/// Most instants at which velocities are drawn, and number of colours.
const INSTANTS: usize = 300;
const SHADES: f64 = 32.0;

/// How strong the colours of patches are beneath velocities.
const PALE: f64 = 0.35;

/// The part of space and time that is shown.
struct View {
    from_s: f64,
    to_s: f64,
    from_block: u32,
    to_block: u32,
    clock: Clock,
    /// Whether slopes on the map are speeds; how many blocks there are, and where the first one is and from one to the
    /// next, mm; in a medium km downwards.
    in_mm: bool,
    blocks: f64,
    along_mm: [f64; 2],
    /// Where the sensors of a recording are, mm, between places that are as far beyond the ends of the slider as the
    /// outer sensors are within; empty for runs.
    sensors_mm: Vec<f64>,
}

impl View {
    fn of(
        run: &RunData,
        zoom: Option<&Rupture>,
        [from_s, to_s]: [Option<f64>; 2],
        [from_block, to_block]: [Option<u32>; 2],
        place: Place,
    ) -> Result<View, String> {
        let (blocks, run_s, name) = (run.columns(), end_of_run_s(run), &run.name);
        let natural = zoom.map_or(((0.0, run_s), (1, blocks)), |rupture| {
            let end_s = end_s(run, rupture);
            // One that begins in the last step has no length.
            let margin_s = (0.08 * (end_s - rupture.onset_s)).max(run.header.time_step_s);
            let blocks = (rupture.first_block.saturating_sub(1).max(1), (rupture.last_block + 1).min(blocks));
            ((rupture.onset_s - margin_s, end_s + margin_s), blocks)
        });
        let (from_s, to_s) = (from_s.unwrap_or(natural.0.0), to_s.unwrap_or(natural.0.1));
        let (from_block, to_block) = (from_block.unwrap_or(natural.1.0), to_block.unwrap_or(natural.1.1));
        if !(from_s.is_finite() && to_s.is_finite() && from_s < to_s) {
            return Err(format!("from_s = {from_s} is not before to_s = {to_s}"));
        }
        if from_s >= run_s || to_s <= 0.0 {
            let accepted = format!("(accepted: times from 0 to {run_s})");
            return Err(format!("nothing of run {name} is from {from_s} s to {to_s} s {accepted}"));
        }
        if !(1 <= from_block && from_block <= to_block && to_block <= blocks) {
            let given = format!("from_block = {from_block} to to_block = {to_block}");
            return Err(format!("{given} are no blocks of run {name} (accepted: 1 to {blocks})"));
        }
        let clock = Clock::of(from_s, to_s, zoom.map_or(from_s, |rupture| rupture.onset_s));
        let sensors_mm = run.header.sensors.as_ref().map_or_else(Vec::new, sensors_mm);
        let in_mm = place == Place::Mm && (blocks > 1 || !sensors_mm.is_empty());
        let blocks = f64::from(blocks);
        let along_mm = match &run.plan.medium {
            Some(medium) => [medium.depth_m(0) / 1e3, medium.spacing_m / 1e3],
            None => [0.0, run.plan.spacing_m * 1e3],
        };
        Ok(View { from_s, to_s, from_block, to_block, clock, in_mm, blocks, along_mm, sensors_mm })
    }

    /// Where a block, or an edge of its tile, stands on the axis: in mm no tile reaches beyond the slider.
    fn up(&self, block: f64) -> f64 {
        match (self.in_mm, &self.sensors_mm[..]) {
            (false, _) => block,
            (true, []) => self.along_mm[0] + (block.clamp(1.0, self.blocks) - 1.0) * self.along_mm[1],
            (true, sensors_mm) => {
                let (low_mm, high_mm) =
                    (sensors_mm[block.floor() as usize], sensors_mm[block.ceil() as usize]);
                low_mm + block.fract() * (high_mm - low_mm)
            }
        }
    }

    /// Blocks, each between two times and in a colour; neighbours that look alike are one.
    fn tiles(&self, blocks: impl Iterator<Item = (u32, (f64, f64, RGBColor))>) -> Vec<Tile> {
        let seen = |block: &u32| (self.from_block..=self.to_block).contains(block);
        let blocks: Vec<_> = blocks.filter(|(block, _)| seen(block)).collect();
        let tile = |alike: &[(u32, (f64, f64, RGBColor))]| {
            let (first, (from_s, to_s, colour)) = alike[0];
            let at = |time_s: f64| self.clock.place(time_s.clamp(self.from_s, self.to_s));
            let corner = |time_s, block| (at(time_s), self.up(block));
            let last = f64::from(alike[alike.len() - 1].0);
            ([corner(from_s, f64::from(first) - 0.5), corner(to_s, last + 0.5)], colour)
        };
        blocks.chunk_by(|a, b| b.0 == a.0 + 1 && a.1 == b.1).map(tile).collect()
    }

    /// A line through blocks at times, if some of it is in view; where it leaves the panel it is cut off.
    fn line(&self, label: &str, points: &[(f64, u32)], dash: Dash, colour: RGBColor) -> Option<Layer> {
        let place = |(time_s, block): &(f64, u32)| (self.clock.place(*time_s), self.up(f64::from(*block)));
        let points: Vec<(f64, f64)> = points.iter().map(place).collect();
        let [low, high] = [(self.from_s, self.from_block), (self.to_s, self.to_block)].map(|at| place(&at));
        let is_seen = points.windows(2).any(|ends| within(ends[0], ends[1], low, high).is_some());
        is_seen.then(|| Layer::line(label, points, dash, colour))
    }
}

/// See [`View`].
fn sensors_mm(sensors: &Sensors) -> Vec<f64> {
    let (Some(first_m), Some(last_m)) = (sensors.x_m.first(), sensors.x_m.last()) else { return Vec::new() };
    let all_m = [-first_m].into_iter().chain(sensors.x_m.iter().copied());
    all_m.chain([2.0 * sensors.length_m - last_m]).map(|x_m| x_m * 1e3).collect()
}

fn end_of_run_s(run: &RunData) -> f64 {
    run.plan.grid.time_s(run.header.steps)
}

/// The map; `zoom` is the rupture that it is about.
pub(super) fn map(
    run: &RunData,
    zoom: Option<&Rupture>,
    times_s: [Option<f64>; 2],
    blocks: [Option<u32>; 2],
    place: Place,
) -> Result<Sheet, String> {
    let view = View::of(run, zoom, times_s, blocks, place)?;
    let View { from_s, to_s, from_block, to_block, clock, .. } = &view;
    let sorts: BTreeMap<u64, (&Rupture, Sort)> =
        sorted(run)?.into_iter().map(|(rupture, sort)| (rupture.rupture, (rupture, sort))).collect();
    let (velocities, bar) = velocities(run, &view)?;
    // Beneath velocities patches are pale, and show where blocks slide too slowly for a colour.
    let strength = if bar.is_some() { PALE } else { 1.0 };
    let (mut patched, mut fronts, mut came) = (BTreeMap::<Sort, Vec<Tile>>::new(), Vec::new(), Vec::new());
    let colour_of = |sort: Sort| mixed(&[plotters::prelude::WHITE, color_of(sort)], strength);
    let grain_s = (to_s - from_s) / ACROSS;
    for arrivals in run.arrivals()?.chunk_by(|a, b| a.rupture == b.rupture) {
        let passed = by_column(run, arrivals);
        let front: Vec<(f64, u32)> = passed.iter().map(|(block, passed)| (passed.0, *block)).collect();
        came.extend_from_slice(&front);
        let Some((rupture, sort)) = sorts.get(&arrivals[0].rupture) else { continue };
        let seen = passed.iter().filter(|(_, (arrival_s, stop_s))| arrival_s <= to_s && stop_s >= from_s);
        let patch = |(block, (arrival_s, stop_s)): (&u32, &(f64, f64))| {
            let grain = |time_s: &f64| (time_s.clamp(*from_s, *to_s) - from_s) / grain_s;
            let first = grain(arrival_s).floor();
            let [first_s, last_s] =
                [first, grain(stop_s).ceil().max(first + 1.0)].map(|grain| from_s + grain * grain_s);
            (*block, (first_s, last_s, colour_of(*sort)))
        };
        patched.entry(*sort).or_default().extend(view.tiles(seen.map(patch)));
        if rupture.arrival_s - rupture.onset_s >= FRONT_ACROSS * grain_s {
            let is_zoomed = zoom.is_some_and(|zoom| zoom.rupture == rupture.rupture);
            let label =
                if is_zoomed && view.in_mm { front_label(run, rupture) } else { "arrivals".to_owned() };
            fronts.extend(view.line(&label, &front, Dash::Solid, INK));
            if is_zoomed && run.is_measured() {
                fronts.extend(picks(clock, arrivals, |of| view.up(of.block.into()), INK));
            }
        }
    }
    // About a rupture only what was before it, since from then on its own arrivals tell.
    let before = |rupture: &Rupture| rupture.farthest_block_before.map(|n| vec![(*from_s, n), (*to_s, n)]);
    let (creep, label) = match zoom {
        Some(rupture) => (before(rupture).unwrap_or_default(), "farthest before"),
        None => (creep_front(run, came), "farthest so far"),
    };
    let mut layers: Vec<Layer> = patched
        .into_iter()
        .filter(|(_, cells)| !cells.is_empty())
        .map(|(sort, cells)| Layer::new(sort.label(), Shape::Cells(cells), colour_of(sort)))
        .collect();
    layers.push(Layer::cells(velocities));
    layers.extend(fronts);
    layers.extend(view.line(label, &creep, Dash::Dashed, GREEN));
    let x = Scale::between(&clock.label("t"), clock.place(*from_s), clock.place(*to_s));
    let [low, high] = [f64::from(*from_block) - 0.5, f64::from(*to_block) + 0.5].map(|block| view.up(block));
    let is_by_depth = view.in_mm && run.plan.medium.is_some();
    let name = match view.in_mm {
        true if is_by_depth => "depth (km)",
        true => "x (mm)",
        false => place_name(run),
    };
    let y = Scale::between(name, low, high).downwards(is_by_depth).in_whole_numbers(!view.in_mm);
    Ok(Sheet { bar, ..Sheet::single(x, y, layers) })
}

/// What the line of arrivals is called: the front, with its speed if it has one.
fn front_label(run: &RunData, rupture: &Rupture) -> String {
    if run.is_measured() {
        // Of two fronts the line is one.
        let [up, down] = speeds_of_front(rupture);
        return up.xor(down).map_or("arrivals".to_owned(), |speed| format!("front, {speed} m/s"));
    }
    let wave_m_per_s = run.plan.spacing_m / crossing_s(run);
    let speed = front_speed_m_per_s(rupture, run.header.contacts(), Some(wave_m_per_s));
    speed.map_or("arrivals".to_owned(), |speed| format!("front, {speed:.0} m/s"))
}

/// The speeds of the fronts of a measured rupture towards higher and lower sensors, m/s.
pub(super) fn speeds_of_front(rupture: &Rupture) -> [Option<Estimate>; 2] {
    let measured = [
        (rupture.front_speed_up_m_per_s, rupture.front_speed_up_error_m_per_s),
        (rupture.front_speed_down_m_per_s, rupture.front_speed_down_error_m_per_s),
    ];
    measured.map(|(speed, error)| Some(Estimate { value: speed?, error: error? }))
}

/// Arrivals at sensors, whose places are given, with bars of their errors.
pub(super) fn picks(
    clock: &Clock,
    arrivals: &[Arrival],
    place: impl Fn(&Arrival) -> f64,
    colour: RGBColor,
) -> [Layer; 2] {
    let pick = |of: &Arrival| {
        let at = |error_s: f64| clock.place(of.arrival_s + error_s);
        [[at(0.0), at(of.arrival_error_s.unwrap_or(0.0)) - at(0.0)], [place(of), 0.0]]
    };
    let picks: Vec<_> = arrivals.iter().map(pick).collect();
    let (free, at) = (Scale::free(""), picks.iter().map(|[time, place]| (time[0], place[0])).collect());
    [Layer::bars(&picks, [&free, &free], colour), Layer::marks("arrivals", at, Marker::Circle, colour)]
}

/// When each block that a rupture passed began to slide and when it stopped, s; over an area each column, from the
/// first arrival to the last stop of its contacts.
fn by_column(run: &RunData, arrivals: &[Arrival]) -> BTreeMap<u32, (f64, f64)> {
    let mut passed: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
    for Arrival { block, arrival_s, stop_s, .. } in arrivals {
        let stop_s = stop_s.unwrap_or(end_of_run_s(run));
        let of_column = passed.entry(run.header.contacts().column(*block)).or_insert((*arrival_s, stop_s));
        *of_column = (of_column.0.min(*arrival_s), of_column.1.max(stop_s));
    }
    passed
}

/// The farthest block that has slid by a time, until it is the last one.
fn creep_front(run: &RunData, mut came: Vec<(f64, u32)>) -> Vec<(f64, u32)> {
    came.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut course: Vec<(f64, u32)> = Vec::new();
    for (time_s, block) in came {
        let farthest = course.last().map(|last| last.1);
        if farthest < Some(block) {
            course.extend(farthest.map(|farthest| (time_s, farthest)));
            course.push((time_s, block));
        }
    }
    let farthest = course.last().map(|last| last.1).filter(|farthest| *farthest < run.columns());
    course.extend(farthest.map(|farthest| (end_of_run_s(run), farthest)));
    course
}

/// The speed of each contact of a dense record.
fn speeds(record: &WindowRecord) -> impl Iterator<Item = (u32, f64)> {
    let across = record.velocity_across_m_per_s.iter().chain(std::iter::repeat(&0.0));
    let both = (record.first_block..).zip(&record.velocity_m_per_s).zip(across);
    both.map(|((contact, along), across)| (contact, magnitude([*along, *across])))
}

/// The velocity above which contacts slide, m/s: nineteen of twenty that stick in the computed states are slower, those
/// that the drive and waves move. None without such states.
fn noise_m_per_s(run: &RunData) -> Result<Option<f64>, NotKept> {
    let (arrivals, mut all) = (run.arrivals()?, Vec::new());
    for record in &run.velocities {
        let slides = |of: &&Arrival| {
            of.arrival_s <= record.time_s && of.stop_s.is_none_or(|stop_s| record.time_s < stop_s)
        };
        let sliding: BTreeSet<u32> = arrivals.iter().filter(slides).map(|arrival| arrival.block).collect();
        all.extend(speeds(record).filter(|(block, _)| !sliding.contains(block)).map(|(_, speed)| speed));
    }
    all.sort_by(f64::total_cmp);
    Ok(all.get(all.len() * 19 / 20).copied())
}

/// Velocities in view of dense records and of computed states, over an area the largest of each column, and their
/// colours; those of [`noise_m_per_s`], or without computed states below a thousandth of the largest, have none.
fn velocities(run: &RunData, view: &View) -> Result<(Vec<Tile>, Option<Colours>), NotKept> {
    let mut windows: BTreeMap<u32, Vec<&WindowRecord>> = BTreeMap::new();
    let in_view = |record: &&WindowRecord| (view.from_s..=view.to_s).contains(&record.time_s);
    for record in run.windows()?.iter().chain(run.rupture_fields()?).chain(&run.velocities).filter(in_view) {
        windows.entry(record.window).or_default().push(record);
    }
    let all = windows.values().flatten().flat_map(|record| speeds(record));
    let fastest = all.map(|(_, speed)| speed).fold(0.0, f64::max);
    if fastest <= 0.0 {
        return Ok((Vec::new(), None));
    }
    // A decade at least.
    let noise = noise_m_per_s(run)?.unwrap_or(1e-3 * fastest);
    let slowest = noise.clamp(1e-9 * fastest, 0.1 * fastest);
    let colours = Colours::of(Scale::powers_between("|v_n| (m/s)", slowest, fastest), On::Surfaces);
    let mut items = Vec::new();
    for (window, records) in &windows {
        let stride = records.len().div_ceil(INSTANTS);
        let apart = records.windows(2).map(|pair| pair[1].step.saturating_sub(pair[0].step));
        // Computed states are as even as steps allow.
        let apart = if *window == COMPUTED { apart.max() } else { apart.min() };
        let longest = apart.unwrap_or(1).max(1) * stride as u64;
        let shown: Vec<&&WindowRecord> = records.iter().step_by(stride).collect();
        for (n, record) in shown.iter().enumerate() {
            let next = shown.get(n + 1).map_or(u64::MAX, |next| next.step);
            let to_s = run.plan.grid.time_s(next.min(record.step + longest)).max(record.time_s);
            let mut columns: BTreeMap<u32, f64> = BTreeMap::new();
            for (block, speed) in speeds(record) {
                let of_column = columns.entry(run.header.contacts().column(block)).or_default();
                *of_column = of_column.max(speed);
            }
            items.extend(view.tiles(columns.into_iter().filter_map(|(column, speed)| {
                let shade = (colours.scale.share(speed)? * SHADES).floor().min(SHADES - 1.0);
                Some((column, (record.time_s, to_s, colours.at((shade + 0.5) / SHADES))))
            })));
        }
    }
    Ok((items, Some(colours)))
}

#[cfg(test)]
mod tests {
    use asperity_record::{Rupture, WindowRecord};

    use super::{COMPUTED, Figure, Pen, Place, Shape, Sheet, SpaceTime, crossing_s};
    use crate::draw::rupture_selector::{RuptureSelector, picked};
    use crate::draw::sheet::{BLUE, GREY, RED};
    use asperity_numbers::run_data::RunData;
    use asperity_testkit::made_up;

    /// A precursor of two blocks, a rupture that is none, and a slip of all three that does not end.
    fn run() -> RunData {
        let mut run = made_up::run("", &[(100, 101, &[1])]);
        made_up::with_ruptures(
            &mut run,
            &[
                &[(1, 1000, Some(1500)), (2, 1100, Some(1500))],
                &[(2, 2000, Some(2500))],
                &[(1, 3000, Some(4000)), (2, 3200, Some(4000)), (3, 3500, None)],
            ],
        );
        run.header.steps = 10_000;
        run
    }

    fn map(
        run: &RunData,
        zoom: Option<&Rupture>,
        times_s: [Option<f64>; 2],
        blocks: [Option<u32>; 2],
    ) -> Result<Sheet, String> {
        super::map(run, zoom, times_s, blocks, Place::Block)
    }

    fn cells(sheet: &Sheet) -> Vec<(f64, f64, f64, f64, plotters::prelude::RGBColor)> {
        let of = |shape: &Shape| if let Shape::Cells(cells) = shape { cells.clone() } else { Vec::new() };
        let cells = sheet.layers().flat_map(|layer| of(&layer.shape));
        cells.map(|([low, high], color)| (low.0, high.0, low.1, high.1, color)).collect()
    }

    #[test]
    fn blocks_are_patches_from_arrival_to_stop() {
        let run = run();
        // In milliseconds; steps of 1e-7 s.
        let paper = map(&run, None, [None, None], [None, None]).unwrap();
        let found = cells(&paper);
        let near = |a: f64, b: f64| (a - b).abs() < 1.01 / 1400.0;
        let expected = [
            (0.2, 0.25, 1.5, 2.5, GREY),
            (0.1, 0.15, 0.5, 1.5, BLUE),
            (0.11, 0.15, 1.5, 2.5, BLUE),
            (0.3, 0.4, 0.5, 1.5, RED),
            (0.32, 0.4, 1.5, 2.5, RED),
            (0.35, 1.0, 2.5, 3.5, RED),
        ];
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!(near(found.0, expected.0) && near(found.1, expected.1), "{found:?} {expected:?}");
            assert_eq!((found.2, found.3, found.4), (expected.2, expected.3, expected.4));
        }
        assert_eq!(
            paper.labels(),
            ["other rupture", "precursor", "global slip", "arrivals", "farthest so far"]
        );
        // How far slip had come, block by block.
        let creep = paper.panels[0].layers.last().unwrap().points();
        let creep: Vec<(i32, f64)> = creep.iter().map(|(t, n)| ((t * 1e3).round() as i32, *n)).collect();
        assert_eq!(creep, [(100, 1.0), (110, 1.0), (110, 2.0), (350, 2.0), (350, 3.0)]);
    }

    #[test]
    fn a_part_has_what_is_in_it() {
        let run = run();
        let part = map(&run, None, [Some(1.9e-4), Some(2.2e-4)], [Some(2), Some(3)]).unwrap();
        let [(from, to, low, high, color)] = cells(&part)[..] else { panic!("{:?}", cells(&part)) };
        assert!((low, high, color) == (1.5, 2.5, GREY) && to - from > 0.0);
        // The origin of the axis is printed: 0.000190 s; the patch ends with the view.
        assert!((from - 10.0).abs() < 0.1 && (to - 30.0).abs() < 0.1, "{from} {to}");
        for (times, blocks, problem) in [
            ([Some(1.0), None], [None, None], "from_s = 1 is not before to_s = 0.001"),
            (
                [Some(1.0), Some(2.0)],
                [None, None],
                "nothing of run test is from 1 s to 2 s (accepted: times from 0 to 0.001)",
            ),
            (
                [None, None],
                [Some(3), Some(4)],
                "from_block = 3 to to_block = 4 are no blocks of run test (accepted: 1 to 3)",
            ),
        ] {
            assert_eq!(map(&run, None, times, blocks).unwrap_err(), problem);
        }
    }

    #[test]
    fn a_rupture_is_found_by_its_number_or_kind() {
        let run = run();
        let number = |which| picked(&run, None, Some(which)).unwrap().unwrap().rupture;
        assert_eq!(
            [RuptureSelector::LongestPrecursor, RuptureSelector::FirstGlobalSlip, RuptureSelector::Widest]
                .map(number),
            [0, 2, 2]
        );
        // Of several of the most blocks, the first.
        let mut alike = run.clone();
        made_up::with_ruptures(
            &mut alike,
            &[
                &[(1, 1000, Some(1500))],
                &[(2, 2000, Some(2500)), (3, 2100, Some(2500))],
                &[(1, 3000, Some(3500)), (2, 3100, Some(3500))],
            ],
        );
        assert_eq!(picked(&alike, None, Some(RuptureSelector::Widest)).unwrap().unwrap().rupture, 1);
        let zoom = picked(&run, Some(0), None).unwrap();
        let paper = map(&run, zoom, [None, None], [None, None]).unwrap();
        assert_eq!(cells(&paper).len(), 2);
        assert!(
            paper.layers().any(|layer| matches!(&layer.shape, Shape::Line(points, _) if points.len() == 2))
        );
        assert_eq!(picked(&run, Some(3), None).unwrap_err(), "run test has no rupture 3 (accepted: 0 to 2)");
        let mut old = run.clone();
        old.ruptures = None;
        assert!(picked(&old, None, None).unwrap_err().contains("has no ruptures"));
    }

    #[test]
    fn dense_windows_colour_the_map() {
        let mut run = run();
        let record = |step: u64, velocity_m_per_s: Vec<f64>| WindowRecord {
            window: 0,
            step,
            time_s: run.plan.grid.time_s(step),
            sliding: 3,
            first_block: 1,
            displacement_m: vec![0.0; 3],
            velocity_m_per_s,
            tangential_force_n: vec![0.0; 3],
            ..WindowRecord::default()
        };
        run.windows = vec![record(3500, vec![0.1, 0.1, 1e-9]), record(3600, vec![0.01, 0.1, 0.0])];
        let plain = cells(
            &map(
                &{
                    let mut none = run.clone();
                    none.windows.clear();
                    none
                },
                None,
                [None, None],
                [None, None],
            )
            .unwrap(),
        )
        .len();
        let paper = map(&run, None, [None, None], [None, None]).unwrap();
        let found = &cells(&paper)[plain..];
        // Blocks 1 and 2 are alike in the first record, and not in the second; block 3 rests.
        let shown: Vec<(f64, f64)> = found.iter().map(|cell| (cell.2, cell.3)).collect();
        assert_eq!(shown, [(0.5, 2.5), (0.5, 1.5), (1.5, 2.5)]);
        assert!((found[0].0 - 0.35).abs() < 1e-9 && (found[0].1 - 0.36).abs() < 1e-9, "{found:?}");
        assert!(found[0].4 == found[2].4 && found[0].4 != found[1].4);
        assert_eq!(cells(&paper)[0].4, plotters::prelude::RGBColor(211, 211, 211), "grey, a third of it");
        assert!(paper.bar.is_some());
    }

    /// Of a rupture velocities are computed, from those of sticking contacts on, and its front is a slope in m/s.
    #[test]
    fn a_rupture_shows_velocities_that_no_window_recorded() {
        let figure = |toml: &str| -> SpaceTime {
            toml::from_str(&format!("file = 'f.png'\nrun = 'test'\n{toml}")).unwrap()
        };
        let whole = figure("").required_data();
        assert!(whole.velocities.is_empty());
        assert!(figure("rupture = 2\nrecorded_only = true").required_data().velocities.is_empty());
        let mut run = run();
        // A long part of the run is not computed, a short one is.
        let count = |toml: &str| figure(toml).film().unwrap().times_s(&run).unwrap().len();
        assert_eq!(count("from_s = 0.0\nto_s = 9e-4"), 0);
        assert_eq!(count("from_s = 3e-4\nto_s = 3.1e-4"), 300);
        // No faster than waves, as of a front that the grid resolves.
        let speed = 0.5 * run.plan.spacing_m / crossing_s(&run);
        run.ruptures.as_mut().unwrap()[0].front_speed_up_m_per_s = Some(speed);
        let zoomed = figure("rupture = 0");
        run.kept = zoomed.required_data();
        let record = |step: u64, velocity_m_per_s: Vec<f64>| WindowRecord {
            window: COMPUTED,
            step,
            time_s: run.plan.grid.time_s(step),
            first_block: 1,
            velocity_m_per_s,
            ..WindowRecord::default()
        };
        // Block 3 sticks.
        run.velocities = vec![record(1200, vec![0.1, 0.1, 1e-6]), record(1300, vec![0.01, 1e-4, 1e-6])];
        let sheet = zoomed.part(&run, Pen::nth(0, "")).unwrap();
        assert_eq!(sheet.bar.as_ref().unwrap().scale.ends(), (1e-6, 0.1));
        let spacing_mm = run.plan.spacing_m * 1e3;
        assert_eq!(sheet.panels[0].y.label(), "x (mm)");
        assert_eq!(sheet.panels[0].y.ends(), (0.0, 2.0 * spacing_mm));
        assert_eq!(sheet.labels(), ["precursor", &format!("front, {speed:.0} m/s")]);
        // Without the states it is drawn as before.
        run.velocities.clear();
        assert!(zoomed.part(&run, Pen::nth(0, "")).unwrap().bar.is_none());
    }
}
