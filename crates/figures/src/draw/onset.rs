//! `tau_n` along the slider when the first precursor starts, with (5.45) and the
//! exact decay of the discrete chain (Figures 5.19, 5.20).

use asperity_model::analytic;
use asperity_numbers::AFFECTED_THRESHOLD;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Labelled, Parts, keys, of_runs_in, place_name, with_parts};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Panel, RED, Sheet};
use asperity_numbers::curve_list::along;

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
    of_runs_in!(panel, Panel);

    fn required_data(&self) -> RequiredData {
        RequiredData::STATES
    }

    /// All but its title.
    fn part(&self, run: &RunData) -> Result<Panel, String> {
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
            let length_m = run.plan.screening_length_m();
            let continuous = |n: f64| {
                analytic::stuck_tangential_force(first, 0.0, (n - 1.0) * run.plan.spacing_m, length_m)
            };
            layers.push(line("eq. (5.45)", &continuous, Dash::Dashed, BLUE));
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
        Ok(Panel::new(Scale::between(place_name(run), 0.0, last + 1.0), y, layers))
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let panels = with_parts(&self.panel, &parts)?.into_iter();
        Ok(Sheet::of(panels.map(|(label, panel)| panel.clone().titled(label)).collect()))
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::FieldRecord;
    use asperity_testkit::made_up;

    use super::{Figure, Onset};

    /// The labels of what is drawn of a run with these keys.
    fn labels(toml: &str) -> Vec<String> {
        let mut run = made_up::run(toml, &[(100, 101, &[1])]);
        let state =
            FieldRecord { step: 100, tangential_force_n: vec![100.0, 38.0, 14.0], ..FieldRecord::default() };
        made_up::with_states(&mut run, &[state]);
        let figure: Onset =
            toml::from_str("file = 'f.png'\nblocks = 3\nlogarithmic = false\npanel = []").unwrap();
        figure.part(&run).unwrap().layers.into_iter().map(|layer| layer.label).collect()
    }

    #[test]
    fn theory_is_drawn_of_even_springs_alone() {
        assert_eq!(labels(""), ["eq. (5.45)", "discrete chain", "simulated"]);
        assert_eq!(labels("disorder.stiffness_offsets = [0, 0.5, 0]"), ["simulated"]);
        assert_eq!(labels("friction.law = \"rigid\""), ["simulated"]);
    }
}
