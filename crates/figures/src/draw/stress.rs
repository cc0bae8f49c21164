//! `tau_n`, `mu_s p_n`, but not of blocks that never slide, and `mu_d p_n` along the slider at chosen instants, with the
//! normal load of the instant; of rate-and-state friction `f_0 p_n`. Over an area they are means of the columns of
//! contacts.

use asperity_numbers::curves::pull_ratio;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, RunData, load_at};
use asperity_record::FieldRecord;

use super::kind::{Figure, keys, levels, of_one_run};
use super::scale::Scale;
use super::sheet::{Dash, INK, Layer, Panel, Sheet};
use asperity_numbers::curve_list::along;

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

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let to_mm = length_mm(run)?;
        let state = |at_s: &f64| {
            let fields = run.states()?.near(*at_s);
            let fields =
                fields.ok_or_else(|| format!("run {} has no fields to show at {at_s} s", run.name))?;
            let (load, borne_n) = loads(run, fields)?;
            let thresholds_n = thresholds_n(run, &borne_n);
            // Where some block is pulled backwards with more than half of sliding friction, thresholds lie on both
            // sides.
            let backwards_n = -fields.tangential_force_n.iter().copied().fold(0.0, f64::min);
            Ok((fields, load, backwards_n > 0.5 * thresholds_n[1][0], thresholds_n))
        };
        let states = self.at_s.iter().map(state).collect::<Result<Vec<_>, String>>()?;
        // The legend says so once.
        let sign = if states.iter().any(|(_, _, is_mirrored, _)| *is_mirrored) { "±" } else { "" };
        let force =
            if run.of_one_row().is_some() { "force per block (N)" } else { "mean force per contact (N)" };
        let panels = states.into_iter().map(|(fields, load, is_mirrored, thresholds_n)| {
            let mut layers = Vec::new();
            // A single level is that of both.
            for ((_, dash, color, name), force_n) in levels(run).into_iter().zip(thresholds_n) {
                let points = by_mm(run, &force_n);
                if is_mirrored {
                    let below = points.iter().map(|(x, force_n)| (*x, -force_n)).collect();
                    layers.push(Layer::line("", below, dash, color));
                }
                layers.push(Layer::line(format!("{sign}{name} p_n"), points, dash, color));
            }
            layers.push(Layer::line("τ_n", by_mm(run, &fields.tangential_force_n), Dash::Solid, INK));
            let panel = Panel::new(Scale::between("x (mm)", 0.0, to_mm), Scale::free(force), layers);
            panel.titled(format!(
                "t = {:.3} s, F_N = {:.1} N, F_T/F_N = {:.3}{}",
                fields.time_s,
                load.normal_load_n,
                pull_ratio(load),
                if load.end_forces_n.is_some() { ", both ends added" } else { "" }
            ))
        });
        Ok(Sheet::of(panels.collect()))
    }
}

/// The length of a slider, mm.
pub(super) fn length_mm(run: &RunData) -> Result<f64, String> {
    if run.plan.blocks == 1 {
        return Err(format!("run {} has one block, and forces along a slider need several", run.name));
    }
    Ok(run.plan.length_m * 1e3)
}

/// `mu_s p_n` in a state, which is NaN on blocks that never slide, and `mu_d p_n`; of rate-and-state friction `f_0 p_n`
/// twice.
fn thresholds_n(run: &RunData, borne_n: &[f64]) -> [Vec<f64>; 2] {
    let friction = &run.plan.friction;
    let mut thresholds_n = [&friction.static_coefficients, &friction.dynamic_coefficients]
        .map(|mu| mu.iter().zip(borne_n).map(|(mu, p_n)| mu * p_n).collect::<Vec<f64>>());
    for block in &run.scenario.friction.stuck_blocks {
        thresholds_n[0][*block as usize - 1] = f64::NAN;
    }
    thresholds_n
}

/// The load in a state, and what each contact bears of it.
pub(super) fn loads<'a>(run: &'a RunData, fields: &FieldRecord) -> Result<(&'a Load, Vec<f64>), String> {
    let (loads, step) = (run.loads()?, fields.step);
    let both = load_at(loads, step).zip(run.normal_load_n(loads, fields));
    both.ok_or_else(|| format!("run {} has no step records", run.name))
}

/// A quantity along the slider by the place of each block, mm.
fn by_mm(run: &RunData, values: &[f64]) -> Vec<(f64, f64)> {
    let place_mm = |n: usize| n as f64 * run.plan.spacing_m * 1e3;
    let points = along(run, values).into_iter().enumerate().map(|(n, value)| (place_mm(n), value));
    points.filter(|(_, value)| value.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::{Figure, Stress};
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
        let panel = figure.part(&run).unwrap().panels.remove(0);
        let heights = |n: usize| panel.layers[n].points().iter().map(|point| point.1).collect::<Vec<f64>>();
        assert_eq!((heights(0), heights(1)), (vec![70.0, 140.0, 70.0], vec![45.0, 90.0, 45.0]));
        run.run.scenario.friction.stuck_blocks = vec![2.0];
        run.run.plan.friction.static_coefficients[1] = 1e6;
        let panel = figure.part(&run).unwrap().panels.remove(0);
        let heights = |n: usize| panel.layers[n].points().iter().map(|point| point.1).collect::<Vec<f64>>();
        assert_eq!((heights(0), heights(1)), (vec![70.0, 70.0], vec![45.0, 90.0, 45.0]));
    }
}
