//! `tau_n`, `mu_s p_n`, but not of blocks that never slide, and `mu_d p_n` along the slider at chosen instants, with the
//! normal load of the instant; of rate-and-state friction `f_0 p_n`. Over an area they are means of the columns of
//! contacts.

use asperity_numbers::curves::pull_ratio;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, RunData, load_at};
use asperity_record::FieldRecord;

use super::kind::{Figure, Level, keys, levels, of_one_run};
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
        if run.plan.blocks == 1 {
            return Err(format!("run {} has one block, and forces along a slider need several", run.name));
        }
        let mut states = Vec::new();
        for at_s in &self.at_s {
            let fields = run.states()?.near(*at_s);
            let fields =
                fields.ok_or_else(|| format!("run {} has no fields to show at {at_s} s", run.name))?;
            let load = load_at(run.loads()?, fields.step);
            states.push((fields, load.ok_or_else(|| format!("run {} has no step records", run.name))?));
        }
        // Where blocks slip backwards as well, thresholds lie on both sides; the legend says so once.
        let any_mirrored = states.iter().any(|(fields, load)| is_mirrored(run, fields, load));
        let panels: Vec<Panel> =
            states.iter().map(|(fields, load)| panel(run, fields, load, any_mirrored)).collect();
        Ok(Sheet::of(panels))
    }
}

/// The levels of friction of the run's law as forces on every block in a state, the one of sliding last: with the load
/// of the instant, or what the contacts of a slab bear.
fn thresholds_n(run: &RunData, fields: &FieldRecord, load: &Load) -> Vec<(Level, Vec<f64>)> {
    let forces_n = coefficients_n(run, fields, load);
    // A single level is that of both.
    levels(run).into_iter().zip(forces_n).collect()
}

/// `mu_s p_n`, which is NaN on blocks that never slide, and `mu_d p_n`; of rate-and-state friction `f_0 p_n` twice.
fn coefficients_n(run: &RunData, fields: &FieldRecord, load: &Load) -> [Vec<f64>; 2] {
    let friction = &run.plan.friction;
    let borne_n = &fields.normal_load_n;
    let mut forces_n: [Vec<f64>; 2] = if borne_n.is_empty() {
        let course = load.normal_load_n / run.plan.total_normal_load_n;
        let of = |at_start_n: &[f64]| at_start_n.iter().map(|force_n| course * force_n).collect();
        [of(&friction.static_threshold_n), of(&friction.dynamic_friction_n)]
    } else {
        let of = |mu: &[f64]| mu.iter().zip(borne_n).map(|(mu, p_n)| mu * p_n).collect();
        [of(&friction.static_coefficients), of(&friction.dynamic_coefficients)]
    };
    for block in &run.scenario.friction.stuck_blocks {
        forces_n[0][*block as usize - 1] = f64::NAN;
    }
    forces_n
}

/// Whether some block is pulled backwards with more than half of sliding friction.
fn is_mirrored(run: &RunData, fields: &FieldRecord, load: &Load) -> bool {
    let [_, sliding_n] = coefficients_n(run, fields, load);
    let backwards = fields.tangential_force_n.iter().fold(0.0f64, |low, tau| low.min(*tau));
    -backwards > 0.5 * sliding_n[0]
}

/// A state; `any_mirrored` is whether in some panel beside it thresholds lie on both sides.
fn panel(run: &RunData, fields: &FieldRecord, record: &Load, any_mirrored: bool) -> Panel {
    let along = |values: &[f64]| -> Vec<(f64, f64)> {
        let position_mm = |n: usize| n as f64 * run.plan.spacing_m * 1e3;
        let points = along(run, values).into_iter().enumerate().map(|(n, value)| (position_mm(n), value));
        points.filter(|(_, value)| value.is_finite()).collect()
    };
    let thresholds = thresholds_n(run, fields, record);
    let thresholds: Vec<(Level, Vec<(f64, f64)>)> =
        thresholds.into_iter().map(|(level, force_n)| (level, along(&force_n))).collect();
    let tau = along(&fields.tangential_force_n);
    let mirrored = is_mirrored(run, fields, record);
    let below = |points: &[(f64, f64)]| points.iter().map(|(x, force)| (*x, -force)).collect();
    let mut series = Vec::new();
    for ((_, dash, color, name), points) in thresholds {
        if mirrored {
            series.push(Layer::line("", below(&points), dash, color));
        }
        let sign = if any_mirrored { "±" } else { "" };
        series.push(Layer::line(format!("{sign}{name} p_n"), points, dash, color));
    }
    series.push(Layer::line("τ_n", tau, Dash::Solid, INK));
    let x = Scale::between("x (mm)", 0.0, run.plan.length_m * 1e3);
    let of_one_row = run.of_one_row().is_some();
    let y = Scale::free(if of_one_row { "force per block (N)" } else { "mean force per contact (N)" });
    Panel::new(x, y, series).titled(format!(
        "t = {:.3} s, F_N = {:.1} N, F_T/F_N = {:.3}{}",
        fields.time_s,
        record.normal_load_n,
        pull_ratio(record),
        if record.end_forces_n.is_some() { ", both ends added" } else { "" }
    ))
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
