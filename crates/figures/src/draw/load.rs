//! `F_T / F_N` against time: of one run with the friction coefficients and, where there is one, the theory
//! of its rise, and beneath how many blocks slid at once in each event (Figures 5.13, 5.15 to 5.18, 6.5, 6.8
//! to 6.12); or the curves of several runs alone. Of a recording both forces, with its load drops.

use std::collections::BTreeSet;

use asperity_model::theory::analytic::LoadCurve;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{self, RunData};
use asperity_record::{LoadDrop, counted};

use super::kind::{Figure, Labelled, keys, levels, load_name, not_both, one_or_several};
use super::scale::Scale;
use super::sheet::{Dash, GREEN, INK, Layer, Panel, Pen, RED, Shape, Sheet};
use crate::spec::{Measured, MeasuredFile};

keys! {
    Load;

    /// The run, where it is one.
    run: Option<String>,
    /// In place of `run` several, each with its label in the legend: their load curves alone.
    #[serde(default)]
    series: Vec<Labelled>,
    /// Whether to show the number of sliding blocks beneath.
    sliding: bool,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns `time_s` and `ft_fn`, each
    /// optionally with a column NAME_error. Its path is relative to this file, for `draw` to the current folder.
    pub(super) measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    measured_label: Option<String>,
}

/// Events after the first slip of the whole slider that fall into more parts of the time than these are drawn as dots.
const MOST_LINES: usize = 40;
const PARTS: f64 = 600.0;

/// Radius of the dots of later slips, in pixels.
const DOT_RADIUS: f64 = 3.5;

/// Radius of the dots where load drops begin, in pixels.
const DROP_RADIUS: f64 = 6.0;

impl Figure for Load {
    fn runs(&self) -> Vec<(&str, Pen<'_>)> {
        one_or_several(&self.run, &self.series)
    }

    fn check(&self) -> Result<(), String> {
        not_both(&self.run, &self.series)
    }

    fn required_data(&self) -> RequiredData {
        RequiredData { measured: true, ..RequiredData::LOADS }
    }

    fn measured(&self) -> Result<Option<Measured>, String> {
        let names = [["time_s", "t (s)"], ["ft_fn", "F_T/F_N"]];
        MeasuredFile::points(&self.measured, &self.measured_label, names.map(|names| (names, false)))
    }

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let (unit_s, unit) = run.unit_of_time();
        let t_label = format!("t ({unit})");
        // Times are in this unit; those of recordings are short.
        let duration_s = run.plan.grid.time_s(run.header.steps) / unit_s;
        let load: Vec<(f64, f64)> =
            run.loads()?.iter().map(|record| (record.time_s / unit_s, record.load_ratio())).collect();
        if self.series.len() > 1 {
            // Steep teeth are lost in dashes.
            let curve = Layer::line(pen.label, load, Dash::Solid, pen.look.2);
            return Ok(Sheet::single(Scale::tight(&t_label), Scale::free(load_name(run)?), vec![curve]));
        }
        if run.is_measured() {
            return forces(run, duration_s);
        }
        let simulated = Layer::line("F_T/F_N", load, Dash::Solid, INK);
        // Upon the simulated curve, which it follows closely; unless it ends before it can be seen.
        let theory = LoadCurve::of(&run.scenario).map(|curve| curve.points());
        let is_seen = |points: &Vec<(f64, f64)>| points.last().is_some_and(|(t, _)| *t > 0.02 * duration_s);
        let theory = theory.filter(is_seen).map(|points| Layer::line("theory", points, Dash::Dashed, GREEN));
        let x = Scale::between(if self.sliding { "" } else { &t_label }, 0.0, duration_s);
        let y = Scale::free("F_T/F_N");
        let series: Vec<Layer> = levels(run, |mu| vec![(0.0, mu), (duration_s, mu)])
            .into_iter()
            .chain([simulated])
            .chain(theory)
            .collect();
        if !self.sliding {
            return Ok(Sheet::single(x, y, series));
        }
        let upper = Panel::new(x, y, series);
        // A line for each event. After the first slip of the whole slider there may be too many for
        // separate lines.
        let peaks = peaks(run.loads()?);
        let global = run.first_global_slip().and_then(|slip| slip.end_step).unwrap_or(u64::MAX);
        let later = peaks.iter().filter(|load| load.step > global);
        let later: BTreeSet<u64> =
            later.map(|load| (load.time_s / unit_s / duration_s * PARTS) as u64).collect();
        let (before, after): (Vec<_>, Vec<_>) =
            peaks.into_iter().partition(|load| load.step <= global || later.len() <= MOST_LINES);
        let point = |load: &run_data::Load| (load.time_s / unit_s, f64::from(load.sliding));
        let points = |peaks: Vec<_>| peaks.into_iter().map(point).collect();
        let x = Scale::between(&t_label, 0.0, duration_s);
        let y = Scale::between("blocks sliding", 0.0, 1.08 * f64::from(run.header.blocks));
        let series = vec![
            Layer::new("", Shape::Stems(points(before)), INK),
            Layer::discs("", points(after), DOT_RADIUS, INK),
        ];
        let lower = Panel::new(x, y.in_whole_numbers(true), series);
        Ok(Sheet::stacked(upper, lower))
    }
}

/// Both forces of a recording, or `F_T` where the other is not known, with its load drops.
fn forces(run: &RunData, duration_s: f64) -> Result<Sheet, String> {
    let is_alone = load_name(run)? != "F_T/F_N";
    let (loads, drops) = (run.loads()?, &run.drops);
    let x = |label| Scale::between(label, 0.0, duration_s);
    let panel = |t, name, force_n: fn(&run_data::Load) -> f64, above: Vec<Layer>| {
        let points = loads.iter().map(|load| (load.time_s, force_n(load))).collect();
        let curve = Layer::line(name, points, Dash::Solid, INK);
        Panel::new(x(t), Scale::free(&format!("{name} (N)")), [vec![curve], above].concat())
    };
    let fall = |drop: &LoadDrop| {
        [(drop.onset_s, drop.ft_before_n), (drop.onset_s, drop.ft_after_n), (f64::NAN, f64::NAN)]
    };
    let falls = Layer::line("", drops.iter().flat_map(fall).collect(), Dash::Solid, RED);
    let onsets = drops.iter().map(|drop| (drop.onset_s, drop.ft_before_n)).collect();
    let marks = Layer::discs(counted(drops.len() as u64, "load drop"), onsets, DROP_RADIUS, RED);
    let label = if is_alone { "t (s)" } else { "" };
    let upper = panel(label, "F_T", |load| load.driving_force_n, vec![falls, marks]);
    if is_alone {
        return Ok(Sheet::of(vec![upper]));
    }
    Ok(Sheet::stacked(upper, panel("t (s)", "F_N", |load| load.normal_load_n, Vec::new())))
}

/// The first record with most sliding blocks of every stretch of time in which some slide.
fn peaks(loads: &[run_data::Load]) -> Vec<&run_data::Load> {
    let stretches = loads.split(|load| load.sliding == 0);
    // Of several `max_by_key` takes the last.
    stretches.filter_map(|stretch| stretch.iter().rev().max_by_key(|load| load.sliding)).collect()
}

#[cfg(test)]
mod tests {
    use super::{Figure, RequiredData, peaks};
    use asperity_numbers::run_data::Load;
    use asperity_testkit::made_up::{self, EVENTS};

    #[test]
    fn several_runs_have_a_load_curve_each_and_nothing_else() {
        let of = |runs: &str| -> super::Load {
            toml::from_str(&format!("file = 'f.png'\nsliding = true\n{runs}")).unwrap()
        };
        let mut run = made_up::run("", &EVENTS);
        run.kept = RequiredData::LOADS;
        let labels = |runs: &str| {
            let figure = of(runs);
            let parts = figure.runs().into_iter().map(|(_, pen)| figure.part(&run, pen).unwrap()).collect();
            figure.sheet(parts).unwrap().labels()
        };
        let [low, high] = ["{ run = 'a', label = 'low' }", "{ run = 'b', label = 'high' }"];
        assert_eq!(labels(&format!("series = [{low}, {high}]")), ["low", "high"]);
        assert_eq!(labels(&format!("series = [{low}]")), labels("run = 'a'"));
        assert!(of(&format!("run = 'a'\nseries = [{high}]")).check().is_err());
    }

    #[test]
    fn an_event_is_one_line_as_high_as_most_blocks_slid() {
        let sliding = [0, 2, 5, 5, 1, 0, 0, 3, 0, 7];
        let load = |(step, sliding): (u64, u32)| Load {
            step,
            time_s: step as f64,
            driving_force_n: 0.0,
            normal_load_n: 1.0,
            end_forces_n: None,
            sliding,
        };
        let loads: Vec<Load> = (0..).zip(sliding).map(load).collect();
        let found: Vec<(u64, u32)> = peaks(&loads).iter().map(|load| (load.step, load.sliding)).collect();
        assert_eq!(found, [(2, 5), (7, 3), (9, 7)]);
    }
}
