//! What is inside a slab: stress or displacement as colour over the lattice, at chosen times.
//!
//! Of each square of four nodes the strain is that in its middle, of displacements that are
//! bilinear between the nodes, and the stress that of an isotropic sheet in plane stress with
//! Poisson's ratio 1/3.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{NodeField, RunData, load_at};
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, keys, of_one_run};
use super::of_study::colours::{Colours, On};
use super::of_study::paper::{Item, Panel, Paper, Sample};
use super::plot::Sheet;
use super::scale::Scale;

keys! {
    SlabField: file;

    /// The run, of a slab.
    run: String,
    /// Title above the figure.
    #[serde(default)]
    title: String,
    /// One panel per instant, s.
    at_s: Vec<f64>,
    /// The quantity that colours show.
    shows: Shown,
    /// Share of the values that the colour scale leaves out at either end, because they peak where the
    /// drive pulls; values beyond an end have its colour.
    #[serde(default = "a_hundredth")]
    left_out: f64,
}

fn a_hundredth() -> f64 {
    0.01
}

/// What can be shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Shown {
    /// `sigma_xz`, MPa: positive where what is above pulls forwards.
    ShearStress,
    /// `-sigma_zz`, MPa: what presses downwards.
    Pressure,
    /// `u_x` since the state of rest, in micrometres.
    Displacement,
}

impl Shown {
    fn label(self) -> &'static str {
        match self {
            Shown::ShearStress => "σ_{xz} (MPa)",
            Shown::Pressure => "−σ_{zz} (MPa)",
            Shown::Displacement => "u_x since rest (µm)",
        }
    }
}

impl Figure for SlabField {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { nodes_at_s: self.at_s.clone(), ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        if !(0.0..0.5).contains(&self.left_out) {
            return Err(format!(
                "left_out: {} is not accepted (accepted: 0 to less than 0.5)",
                self.left_out
            ));
        }
        if !run.plan.elastic.has_inside() {
            return Err(format!(
                "run {} is of a chain, which has no inside (accepted: a run of a slab)",
                run.name
            ));
        }
        let lattice = run.plan.elastic.as_lattice();
        let spacing_mm = run.plan.spacing_m * 1e3;
        let mut maps = Vec::new();
        for at_s in &self.at_s {
            let nodes = run.nodes_at(*at_s)?.ok_or_else(|| {
                format!("run {} has no nodes at {at_s} s: only `reproduce` computes them", run.name)
            })?;
            let load = load_at(run.loads()?, nodes.step).map_or(0.0, |load| load.load_ratio());
            // No record is before the first step, and nothing pulls there.
            let load = if nodes.step == 0 { 0.0 } else { load };
            let title = format!("t = {:.4} s, F_T/F_N = {load:.3}", nodes.time_s);
            maps.push((title, self.values(run, nodes)));
        }
        let mut all: Vec<f64> = maps.iter().flat_map(|(_, values)| values).copied().collect();
        all.sort_by(f64::total_cmp);
        let (Some(last), out) = (all.len().checked_sub(1), self.left_out) else {
            return Err("at_s: no time is given (accepted: one or more)".to_owned());
        };
        let rank = |share: f64| all[(share * last as f64).round() as usize];
        let scale = Scale::of(self.shows.label(), false, 0.0, [rank(out), rank(1.0 - out)].into_iter());
        let colours = Colours::of(scale, On::Surfaces);
        let panels = maps.into_iter().map(|(title, values)| {
            let cells = values.iter().enumerate().map(|(n, value)| {
                let columns = lattice.columns - 1;
                let (left, below) = ((n % columns) as f64 * spacing_mm, (n / columns) as f64 * spacing_mm);
                let colour = colours.at(colours.scale.nearest_share(*value));
                Item::Cell((left, below), (left + spacing_mm, below + spacing_mm), colour)
            });
            Panel { title, items: cells.collect() }
        });
        let (columns, rows) = ((lattice.columns - 1) as f64, (lattice.rows - 1) as f64);
        let x = Scale::between("x (mm)", 0.0, columns * spacing_mm);
        let y = Scale::between("z (mm)", 0.0, rows * spacing_mm);
        let ends = (out > 0.0).then(|| (Sample::Nothing, format!("ends: {} % beyond", 100.0 * out)));
        let paper = Paper::new(x, y, panels.collect(), Vec::from_iter(ends));
        Ok(Paper { shape: Some(rows / columns), bar: Some(colours), ..paper }.sheet(&self.title))
    }
}

impl SlabField {
    /// A number for each square of four nodes, row by row from the bottom.
    fn values(&self, run: &RunData, nodes: &NodeField) -> Vec<f64> {
        let lattice = run.plan.elastic.as_lattice();
        let (columns, count) = (lattice.columns, lattice.nodes());
        let (u, rest) = (&nodes.displacement_m, &run.plan.initial.displacement_m);
        let modulus_pa = run.scenario.slider.youngs_modulus_pa;
        let a = run.plan.spacing_m;
        let mut values = Vec::new();
        for row in 0..lattice.rows - 1 {
            for column in 0..columns - 1 {
                let first = row * columns + column;
                // Below left and right, above left and right.
                let at = [first, first + 1, first + columns, first + columns + 1];
                let x = at.map(|node| u[node]);
                let z = at.map(|node| u[count + node]);
                let across = |of: [f64; 4]| 0.5 * ((of[1] - of[0]) + (of[3] - of[2])) / a;
                let upwards = |of: [f64; 4]| 0.5 * ((of[2] - of[0]) + (of[3] - of[1])) / a;
                values.push(match self.shows {
                    // G = 3 E / 8.
                    Shown::ShearStress => 0.375 * modulus_pa * (upwards(x) + across(z)) * 1e-6,
                    // E / (1 - 1/9) (e_zz + e_xx / 3).
                    Shown::Pressure => -1.125 * modulus_pa * (upwards(z) + across(x) / 3.0) * 1e-6,
                    Shown::Displacement => {
                        at.iter().map(|node| u[*node] - rest[*node]).sum::<f64>() / 4.0 * 1e6
                    }
                });
            }
        }
        values
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, SlabField};
    use asperity_numbers::required_data::RequiredData;
    use asperity_numbers::run_data::{NodeField, RunData};
    use asperity_testkit::made_up;

    fn figure(shows: &str) -> SlabField {
        toml::from_str(&format!("file = 'f.png'\nrun = 'test'\nat_s = [0.0]\nshows = '{shows}'")).unwrap()
    }

    /// A slab that is strained evenly.
    fn strained(xx: f64, zz: f64, shear: f64) -> RunData {
        let mut run = made_up::slab(&made_up::EVENTS);
        run.kept = RequiredData { nodes_at_s: vec![0.0], ..RequiredData::LOADS };
        let place = |n: usize| n as f64 * run.plan.spacing_m;
        let (x, z): (Vec<f64>, Vec<f64>) = (0..9)
            .map(|node| (place(node % 3), place(node / 3)))
            .map(|(x, z)| (xx * x + shear * z, zz * z))
            .unzip();
        run.nodes = vec![NodeField { step: 0, time_s: 0.0, displacement_m: [x, z].concat() }];
        run
    }

    #[test]
    fn stresses_are_those_of_the_sheet() {
        let of = |shows: &str, run: &RunData| figure(shows).values(run, &run.nodes[0]);
        let modulus_mpa = strained(0.0, 0.0, 0.0).scenario.slider.youngs_modulus_pa * 1e-6;
        // Pressed and free to grow: the pressure is E times the strain, and there is no shear.
        let run = strained(1e-4, -3e-4, 0.0);
        assert!(of("pressure", &run).iter().all(|found| (found / (3e-4 * modulus_mpa) - 1.0).abs() < 1e-9));
        assert!(of("shear-stress", &run).iter().all(|found| found.abs() < 1e-9));
        let run = strained(0.0, 0.0, 1e-4);
        let expected = 0.375e-4 * modulus_mpa;
        let found = of("shear-stress", &run);
        assert!(found.len() == 4 && found.iter().all(|found| (found / expected - 1.0).abs() < 1e-9));
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_reason() {
        let refused = |toml: &str, run: &RunData| {
            let figure: SlabField =
                toml::from_str(&format!("file = 'f.png'\nrun = 'test'\nshows = 'pressure'\n{toml}")).unwrap();
            figure.part(run).unwrap_err()
        };
        let mut run = strained(0.0, 0.0, 0.0);
        assert!(refused("at_s = []", &run).starts_with("at_s: no time is given"));
        assert!(refused("at_s = [0.0]\nleft_out = 0.5", &run).starts_with("left_out: 0.5 is not accepted"));
        run.nodes = Vec::new();
        assert!(refused("at_s = [0.0]", &run).contains("has no nodes at 0 s"));
        let chain = made_up::run("", &[]);
        assert!(refused("at_s = [0.0]", &chain).contains("which has no inside (accepted: a run of a slab)"));
    }
}
