//! Forces along the slider, over an area as means of the columns of contacts.
//!
//! - `stress`: `tau_n`, `mu_s p_n`, but not of blocks that never slide, and `mu_d p_n` at chosen instants, with the normal
//!   load of the instant; of rate-and-state friction `f_0 p_n`.
//! - `stress-sequence`: `tau_n / p_n` before and after each precursor, each over the normal load of its instant. States
//!   are recorded at the onsets and ends of slip events, so the precursors are those among slip events: what a precursor
//!   leaves behind is then what the next one finds, but for the load that the drive has added meanwhile.
//! - `onset`: `tau_n` when the first precursor starts, with (5.45) and the exact decay of the discrete chain (Figures
//!   5.19, 5.20).

use asperity_model::theory::analytic;
use asperity_numbers::AFFECTED_THRESHOLD;
use asperity_numbers::curve_list::{self, along, by_mm};
use asperity_numbers::curves::pull_ratio;
use asperity_numbers::precursors::one_by_one;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, RunData, load_at};
use asperity_record::FieldRecord;

use super::colours::{Colours, On};
use super::kind::{Figure, Labelled, keys, level_look, levels, of_one_run, of_runs_in, place_name};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Panel, Pen, RED, Sheet};

keys! {
    Stress: run;

    /// One panel per instant; the recorded state nearest to it is shown.
    at_s: Vec<f64>,
}

impl Figure for Stress {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { states_near_s: self.at_s.clone(), ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        if run.plan.blocks == 1 {
            return Err(format!("run {} has one block, and forces along a slider need several", run.name));
        }
        let friction = &run.plan.friction;
        let state = |at_s: &f64| {
            let lacks = || format!("run {} has no fields to show at {at_s} s", run.name);
            let fields = run.states()?.near(*at_s).ok_or_else(lacks)?;
            let (load, borne_n) = loads(run, fields)?;
            // Blocks that never slide have no static one; of rate-and-state friction both are `f_0 p_n`.
            let mut thresholds_n = [&friction.static_coefficients, &friction.dynamic_coefficients]
                .map(|mu| mu.iter().zip(&borne_n).map(|(mu, p_n)| mu * p_n).collect::<Vec<f64>>());
            for block in &run.scenario.friction.stuck_blocks {
                thresholds_n[0][*block as usize - 1] = f64::NAN;
            }
            // Where some block is pulled backwards with more than half of sliding friction, thresholds lie on both
            // sides.
            let backwards_n = -fields.tangential_force_n.iter().copied().fold(0.0, f64::min);
            Ok((fields, load, backwards_n > 0.5 * thresholds_n[1][0], thresholds_n))
        };
        let states = self.at_s.iter().map(state).collect::<Result<Vec<_>, String>>()?;
        // The legend says so once.
        let sign = if states.iter().any(|(_, _, is_mirrored, _)| *is_mirrored) { "±" } else { "" };
        let y = if run.of_one_row().is_some() { "force per block (N)" } else { "mean force per contact (N)" };
        let panels = states.into_iter().map(|(fields, load, is_mirrored, thresholds_n)| {
            let mut layers = Vec::new();
            // A single level is that of both.
            for ((_, role, name), force_n) in curve_list::levels(run).into_iter().zip(thresholds_n) {
                let (dash, color) = level_look(role);
                let points = by_mm(run, &force_n);
                if is_mirrored {
                    let below = points.iter().map(|(x, force_n)| (*x, -force_n)).collect();
                    layers.push(Layer::line("", below, dash, color));
                }
                layers.push(Layer::line(format!("{sign}{name} p_n"), points, dash, color));
            }
            layers.push(Layer::line("τ_n", by_mm(run, &fields.tangential_force_n), Dash::Solid, INK));
            let panel = Panel::new(Scale::tight("x (mm)"), Scale::free(y), layers);
            let both = if load.end_forces_n.is_some() { ", both ends added" } else { "" };
            let (time_s, load_n, ratio) = (fields.time_s, load.normal_load_n, pull_ratio(load));
            panel.titled(format!("t = {time_s:.3} s, F_N = {load_n:.1} N, F_T/F_N = {ratio:.3}{both}"))
        });
        Ok(Sheet::of(panels.collect()))
    }
}

/// The load in a state, and what each contact bears of it.
fn loads<'a>(run: &'a RunData, fields: &FieldRecord) -> Result<(&'a Load, Vec<f64>), String> {
    let (loads, step) = (run.loads()?, fields.step);
    let both = load_at(loads, step).zip(run.normal_load_n(loads, fields));
    both.ok_or_else(|| format!("run {} has no step records", run.name))
}

keys! {
    StressSequence: run;

    /// Fewest blocks of a precursor that is shown.
    #[serde(default = "super::kind::number::<1>")]
    from_blocks: u32,
    /// Whether to show the first global slip, which ends the sequence, as well.
    #[serde(default)]
    global_slip: bool,
}

impl Figure for StressSequence {
    of_one_run!(RequiredData { states: true, precursor_onsets: true, ..RequiredData::LOADS });

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let states = run.states()?;
        let found = one_by_one(run).into_iter().filter_map(|precursor| {
            let is_global = precursor.blocks_slipped == run.header.blocks;
            let is_shown = precursor.blocks_slipped >= self.from_blocks && (self.global_slip || !is_global);
            let at_onset = states.at_precursor_onset(precursor.start.onset_step)?;
            let at_end = states.at_precursor_end(precursor.end.end_step?)?;
            is_shown.then_some((precursor.start.ft_fn_onset, [at_onset, at_end]))
        });
        let found: Vec<(f64, [&FieldRecord; 2])> = found.collect();
        if found.is_empty() {
            let precursor = format!("precursor of {} blocks or more", self.from_blocks);
            let with = "states at its onset and its end (recording.event_fields = true has them recorded)";
            return Err(format!("run {} has no {precursor} with {with}", run.name));
        }
        let scale = Scale::of("F_T/F_N at the onset", false, 0.0, found.iter().map(|(load, _)| *load));
        let colours = Colours::of(scale, On::Lines);
        let end = f64::from(run.columns()) + 0.5;
        let panel = |(n, title): (usize, &str)| {
            let line = |(load, states): &(f64, [&FieldRecord; 2])| {
                Ok(Layer::line("", profile(run, states[n])?, Dash::Solid, colours.nearest(*load)))
            };
            let mut layers = found.iter().map(line).collect::<Result<Vec<Layer>, String>>()?;
            layers.extend(levels(run, |mu| vec![(0.0, mu), (end, mu)]));
            let (x, y) = (Scale::between(place_name(run), 0.5, end), Scale::free("τ_n/p_n"));
            Ok(Panel::new(x, y, layers).titled(title))
        };
        let panels = [(0, "before each precursor"), (1, "after each precursor")].into_iter().map(panel);
        let panels = panels.collect::<Result<_, String>>()?;
        Ok(Sheet { bar: Some(colours), ..Sheet::of(panels) })
    }
}

/// `tau_n / p_n` of every block in a state, over an area that of the sums over each column; where a contact bears
/// nothing, nothing is shown.
fn profile(run: &RunData, state: &FieldRecord) -> Result<Vec<(f64, f64)>, String> {
    let [tau_n, p_n] = [&state.tangential_force_n, &loads(run, state)?.1].map(|of| along(run, of));
    let ratios = tau_n.iter().zip(&p_n).zip(1..).filter(|((_, p_n), _)| **p_n != 0.0);
    Ok(ratios.map(|((tau_n, p_n), n)| (f64::from(n), tau_n / p_n)).collect())
}

keys! {
    Onset;

    /// How many blocks to show from the driven end.
    blocks: u32,
    /// Whether to show the decay on a logarithmic axis.
    logarithmic: bool,
    /// The runs, one in each panel, each with its title.
    panel: Vec<Labelled>,
}

/// The least force that is visible on a linear axis, over that on block 1.
const SEEN: f64 = 0.005;

/// How many blocks are shown on it, over those that bear such a force.
const ZEROS: f64 = 1.6;

/// Where the logarithmic axis ends, over the force on block 1.
const FLOOR: f64 = 1e-4;

impl Figure for Onset {
    of_runs_in!(panel, RequiredData::STATES);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let fields = run.states()?.at_first_onset();
        let fields = fields.ok_or_else(|| format!("run {} has no fields at its first onset", run.name))?;
        let tau = &along(run, &fields.tangential_force_n);
        let (first, log) = (tau[0], self.logarithmic);
        // Farther on, a linear axis shows nothing but zeros.
        let is_seen = |force: &f64| force.abs() > SEEN * first.abs();
        let seen = tau.iter().rposition(is_seen).map_or(1, |n| n + 1) as f64;
        let last = f64::from(self.blocks.min(run.columns()));
        let last = if log { last } else { last.min((seen * ZEROS).ceil()) };
        let show = |force: f64| if log { force / first } else { force };
        let line = |label: &str, at: &dyn Fn(f64) -> f64, dash, colour| {
            let places = (0..=((last - 1.0) / 0.1).round() as usize).map(|i| 1.0 + i as f64 * 0.1);
            Layer::line(label, places.map(|n| (n, show(at(n)))).collect(), dash, colour)
        };
        let mut layers = Vec::new();
        // Slabs screen a force otherwise than chains do, and so do chains whose contacts have springs of their own.
        if run.plan.has_decay() {
            let (at_m, length_m) = (|n: f64| (n - 1.0) * run.plan.spacing_m, run.plan.screening_length_m());
            let continuous = |n: f64| analytic::stuck_tangential_force(first, 0.0, at_m(n), length_m);
            layers.push(line("continuum", &continuous, Dash::Dashed, BLUE));
            let decay = analytic::discrete_decay_per_block(run.scenario.friction.interfacial_stiffness_ratio);
            layers.push(line("discrete chain", &|n| first * decay.powf(n - 1.0), Dash::Solid, RED));
        }
        let simulated = (1..).zip(tau).take(last as usize).map(|(n, force)| (f64::from(n), show(*force)));
        layers.push(Layer::marks("simulated", simulated.collect(), Marker::Circle, INK));
        let y = if log {
            let level = vec![(0.0, AFFECTED_THRESHOLD), (last + 1.0, AFFECTED_THRESHOLD)];
            let label = format!("{} %", AFFECTED_THRESHOLD * 100.0);
            layers.push(Layer::line(label, level, Dash::Dotted, GREY));
            Scale::powers_between("τ_n/τ_1", FLOOR, 2.0)
        } else {
            Scale::between("τ_n (N)", -0.05 * first, 1.1 * first)
        };
        let x = Scale::between(place_name(run), 0.0, last + 1.0);
        Ok(Sheet::of(vec![Panel::new(x, y, layers).titled(pen.label)]))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        Ok(Sheet::of(parts.into_iter().flat_map(|part| part.panels).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, Pen, Stress};
    use asperity_numbers::required_data::RequiredData;
    use asperity_testkit::made_up;

    /// The contacts of a slab bear what their state says, whatever they bore at rest.
    #[test]
    fn thresholds_of_a_slab_are_those_of_its_state() {
        let figure: Stress = toml::from_str("file = 'f.png'\nrun = 'a'\nat_s = [0.0]").unwrap();
        let mut run = made_up::slab(&made_up::EVENTS);
        let state = run.states.first().unwrap().clone();
        run.kept = RequiredData { states_near_s: vec![0.0], ..RequiredData::LOADS };
        made_up::with_states(&mut run, &[state]);
        let panel = figure.part(&run, Pen::nth(0, "")).unwrap().panels.remove(0);
        let heights = |n: usize| panel.layers[n].points().iter().map(|point| point.1).collect::<Vec<f64>>();
        assert_eq!((heights(0), heights(1)), (vec![70.0, 140.0, 70.0], vec![45.0, 90.0, 45.0]));
        run.run.scenario.friction.stuck_blocks = vec![2.0];
        run.run.plan.friction.static_coefficients[1] = 1e6;
        let panel = figure.part(&run, Pen::nth(0, "")).unwrap().panels.remove(0);
        let heights = |n: usize| panel.layers[n].points().iter().map(|point| point.1).collect::<Vec<f64>>();
        // With a gap.
        assert!(heights(0)[1].is_nan() && heights(0)[2] == 70.0 && heights(1) == [45.0, 90.0, 45.0]);
    }
}

#[cfg(test)]
mod tests_of_sequences {
    use asperity_record::FieldRecord;

    use super::{Figure, Pen, StressSequence};
    use crate::draw::sheet::Shape;
    use asperity_numbers::required_data::RequiredData;
    use asperity_testkit::made_up::{self, EVENTS};

    fn figure(toml: &str) -> StressSequence {
        toml::from_str(&format!("file = 'f.png'\nrun = 'a'\n{toml}")).unwrap()
    }

    #[test]
    fn each_precursor_has_the_state_at_its_onset_and_at_its_end() {
        let mut run = made_up::run("", &EVENTS);
        run.kept = RequiredData { states: true, precursor_onsets: true, ..RequiredData::LOADS };
        let state = |step: u64| FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![step as f64; 3],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        };
        let steps = EVENTS.iter().flat_map(|(onset, end, _)| [*onset, *end]);
        let states: Vec<FieldRecord> = steps.map(state).collect();
        made_up::with_states(&mut run, &states);
        // 400 N on three blocks; the precursors are events 0, 1 and 4, and event 5 is of all blocks.
        let levels = |toml: &str, panel: usize| -> Vec<f64> {
            let sheet = figure(toml).part(&run, Pen::nth(0, "")).unwrap();
            let first = |shape: &Shape| match shape {
                Shape::Line(points, _) if points.len() == 3 => Some((points[0].1 * 400.0 / 3.0).round()),
                _ => None,
            };
            sheet.panels[panel].layers.iter().filter_map(|layer| first(&layer.shape)).collect()
        };
        assert_eq!((levels("", 0), levels("", 1)), (vec![100.0, 200.0, 412.0], vec![101.0, 210.0, 420.0]));
        assert_eq!(levels("from_blocks = 2\nglobal_slip = true", 0), [200.0, 412.0, 500.0]);
        let refused = figure("from_blocks = 3").part(&run, Pen::nth(0, "")).unwrap_err();
        assert!(refused.contains("no precursor of 3 blocks or more") && refused.contains("event_fields"));
    }
}

#[cfg(test)]
mod tests_of_onsets {
    use asperity_record::FieldRecord;
    use asperity_testkit::made_up;

    use super::{Figure, Onset, Pen};

    /// The labels of what is drawn of a run with these keys.
    fn labels(toml: &str) -> Vec<String> {
        let mut run = made_up::run(toml, &[(100, 101, &[1])]);
        let state =
            FieldRecord { step: 100, tangential_force_n: vec![100.0, 38.0, 14.0], ..FieldRecord::default() };
        made_up::with_states(&mut run, &[state]);
        let figure: Onset =
            toml::from_str("file = 'f.png'\nblocks = 3\nlogarithmic = false\npanel = []").unwrap();
        figure
            .part(&run, Pen::nth(0, ""))
            .unwrap()
            .panels
            .remove(0)
            .layers
            .into_iter()
            .map(|layer| layer.label)
            .collect()
    }

    #[test]
    fn theory_is_drawn_of_even_springs_alone() {
        assert_eq!(labels(""), ["continuum", "discrete chain", "simulated"]);
        assert_eq!(labels("disorder.stiffness_offsets = [0, 0.5, 0]"), ["simulated"]);
        assert_eq!(labels("friction.law = \"rigid\""), ["simulated"]);
    }
}
