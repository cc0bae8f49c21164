//! What is inside a slab: stress or displacement as colour over the lattice, at chosen times.
//!
//! Of each square of four nodes the strain is that in its middle, of displacements that are
//! bilinear between the nodes, and the stress that of an isotropic sheet in plane stress with
//! Poisson's ratio 1/3.
//!
//! Of a body a slice is shown: the planes of squares on both sides of a row across, or of a layer, between which the
//! strain is that in the middle of cubes of eight nodes, and the stress that of an isotropic body with Poisson's
//! ratio 1/4.

use asperity_model::{Lattice, NodeState};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::area::{Map, maps, nodes_at};
use super::colours::Colours;
use super::kind::{Figure, keys, of_one_run};
use super::scale::{Scale, number};
use super::sheet::{Layer, Sheet};

keys! {
    SlabField: run;

    /// One panel per instant, s.
    at_s: Vec<f64>,
    /// The quantity that colours show.
    shows: Shown,
    /// Share of the values that the colour scale leaves out at either end, because they peak where the
    /// drive pulls; values beyond an end have its colour.
    #[serde(default = "a_hundredth")]
    left_out: f64,
    /// Of a body: the row across, from 1, of which the vertical slice is shown; the middle one if absent.
    across: Option<u32>,
    /// Of a body: the layer, from 1 at the bottom, that is shown instead.
    row: Option<u32>,
}

/// The nodes that are shown: the axis that they lie across, 1 or 2, and their place on it, from 0. All of a slab are a
/// slice across its only row.
type Slice = (usize, usize);

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

impl Figure for SlabField {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { nodes_at_s: self.at_s.clone(), ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let (out, plan) = (self.left_out, &run.plan);
        if !(0.0..0.5).contains(&out) {
            return Err(format!("left_out: {out} is not accepted (accepted: 0 to less than 0.5)"));
        }
        if !plan.elastic.has_inside() {
            let (run, body) = (&run.name, plan.elastic.name());
            let accepted = "(accepted: a run of a slab or a body)";
            return Err(format!("run {run} is of a {body}, which has no inside {accepted}"));
        }
        let lattice = plan.elastic.as_lattice();
        let slice = self.slice(run, &lattice)?;
        let map = |(title, nodes): (_, &_)| (title, self.values(run, nodes, slice), Vec::new());
        let panels: Vec<Map> = nodes_at(run, &self.at_s)?.into_iter().map(map).collect();
        let mut all: Vec<f64> = panels.iter().flat_map(|(_, values, _)| values).copied().collect();
        all.sort_by(f64::total_cmp);
        let rank = |share: f64| all[(share * (all.len() - 1) as f64).round() as usize];
        let label = match self.shows {
            Shown::ShearStress => "σ_{xz} (MPa)",
            Shown::Pressure => "−σ_{zz} (MPa)",
            Shown::Displacement => "u_x since rest (µm)",
        };
        let colours = Colours::between(label, &[rank(out), rank(1.0 - out)]);
        let spacing_mm = plan.spacing_m * 1e3;
        let at_mm = |place: usize| number(place as f64 * spacing_mm);
        let (axis, rows, plane) = match slice {
            _ if lattice.lanes == 1 => ("z (mm)", lattice.rows, None),
            (1, lane) => ("z (mm)", lattice.rows, Some(format!("at y = {} mm", at_mm(lane)))),
            (_, row) => ("y (mm)", lattice.lanes, Some(format!("at z = {} mm", at_mm(row)))),
        };
        let ends = (out > 0.0).then(|| format!("ends: {} % beyond", 100.0 * out));
        let remarks: Vec<Layer> = plane.into_iter().chain(ends).map(Layer::remark).collect();
        let scale = |label, nodes: usize| Scale::between(label, 0.0, (nodes - 1) as f64 * spacing_mm);
        let axes = [scale("x (mm)", lattice.columns), scale(axis, rows)];
        Ok(maps(panels, &remarks, axes, lattice.columns - 1, spacing_mm, colours))
    }
}

impl SlabField {
    /// The nodes to show: all of a slab, or a slice of a body.
    fn slice(&self, run: &RunData, lattice: &Lattice) -> Result<Slice, String> {
        let (key, axis, place, count) = match (self.across, self.row) {
            (Some(_), Some(_)) => return Err("across and row: a slice has one of them".to_owned()),
            (None, None) => return Ok((1, (lattice.lanes - 1) / 2)),
            (Some(across), None) => ("across", 1, across, lattice.lanes),
            (None, Some(row)) => ("row", 2, row, lattice.rows),
        };
        if lattice.lanes == 1 {
            Err(format!("{key}: run {} is of a slab, all of which is shown (accepted: none)", run.name))
        } else if !(1..=count as u32).contains(&place) {
            Err(format!("{key}: {place} is not in run {} (accepted: 1 to {count})", run.name))
        } else {
            Ok((axis, place as usize - 1))
        }
    }

    /// A number for each square of four nodes of a slice, row by row from the bottom or the first row across.
    fn values(&self, run: &RunData, nodes: &NodeState, (normal, place): Slice) -> Vec<f64> {
        let lattice = run.plan.elastic.as_lattice();
        let (u, rest, count) = (&nodes.displacement_m, &run.plan.initial.displacement_m, lattice.nodes());
        // From a node to the next one along x, across and upwards; across a slab there is none, and no strain.
        let is_slab = lattice.lanes == 1;
        let next = [1, if is_slab { 0 } else { lattice.columns }, lattice.contacts()];
        let (counts, up) = ([lattice.columns, lattice.lanes, lattice.rows], next[3 - normal]);
        // On both sides of the slice, or on the one that there is.
        let last = counts[normal].saturating_sub(2);
        let sides: Vec<usize> = (place.saturating_sub(1)..=place.min(last)).collect();
        // Lame's constants, which are alike: 3 E / 8 in plane stress, 2 E / 5 of a body.
        let modulus_mpa = if is_slab { 0.375 } else { 0.4 } * run.scenario.slider.youngs_modulus_pa * 1e-6;
        let strain = |first: usize, of: usize, along: usize| {
            let (a, b) = (next[(along + 1) % 3], next[(along + 2) % 3]);
            // Upwards is the last axis along which nodes move.
            let first = first + if is_slab { of / 2 } else { of } * count;
            let edges = [0, a, b, a + b].map(|to| u[first + to + next[along]] - u[first + to]);
            edges.iter().sum::<f64>() / (4.0 * run.plan.spacing_m)
        };
        let stress = |first: usize| match self.shows {
            Shown::ShearStress => modulus_mpa * (strain(first, 0, 2) + strain(first, 2, 0)),
            _ => {
                -modulus_mpa
                    * [1.0, 1.0, 3.0]
                        .iter()
                        .zip(0..)
                        .map(|(part, axis)| part * strain(first, axis, axis))
                        .sum::<f64>()
            }
        };
        let square = |(row, column): (usize, usize)| {
            let lowest = |side: usize| side * next[normal] + row * up + column;
            if self.shows == Shown::Displacement {
                let corners = [0, 1, up, up + 1].map(|to| lowest(place) + to);
                return corners.iter().map(|node| u[*node] - rest[*node]).sum::<f64>() / 4.0 * 1e6;
            }
            sides.iter().map(|side| stress(lowest(*side))).sum::<f64>() / sides.len() as f64
        };
        let rows = 0..counts[3 - normal] - 1;
        rows.flat_map(|row| (0..counts[0] - 1).map(move |column| (row, column))).map(square).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, SlabField};
    use asperity_numbers::required_data::RequiredData;
    use asperity_numbers::run_data::RunData;
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
        run.nodes = vec![made_up::nodes(&run, 0, [x, z].concat())];
        run
    }

    #[test]
    fn stresses_are_those_of_the_sheet() {
        let of = |shows: &str, run: &RunData| figure(shows).values(run, &run.nodes[0], (1, 0));
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

    /// Of a body under each strain, in every slice, on edges as inside.
    #[test]
    fn stresses_of_a_body_are_those_of_the_body() {
        let run = made_up::body(&[]);
        let modulus_mpa = run.scenario.slider.youngs_modulus_pa * 1e-6;
        // u_i = gradient_ij x_j.
        let state = |gradient: [[f64; 3]; 3]| {
            let lattice = run.plan.elastic.as_lattice();
            let place = |node: usize| lattice.place(node).map(|n| n as f64 * run.plan.spacing_m);
            let along = |row: [f64; 3]| {
                let of = move |node: usize| row.iter().zip(place(node)).map(|(g, x)| g * x).sum::<f64>();
                (0..27).map(of).collect::<Vec<f64>>()
            };
            made_up::nodes(&run, 0, gradient.map(along).concat())
        };
        let check = |shows: &str, gradient: [[f64; 3]; 3], expected_mpa: f64| {
            for slice in (0..3).flat_map(|n| [(1, n), (2, n)]) {
                let found = figure(shows).values(&run, &state(gradient), slice);
                let is_near = |found: &f64| (found - expected_mpa).abs() < 1e-9 * modulus_mpa;
                assert!(found.len() == 4 && found.iter().all(is_near), "{shows} {slice:?}: {found:?}");
            }
        };
        // Pressed by 4e-4 E and free to grow: Poisson's ratio is 1/4.
        let pressed = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, -4e-4]];
        check("pressure", pressed, 4e-4 * modulus_mpa);
        check("shear-stress", pressed, 0.0);
        let sheared = [[0.0, 0.0, 2e-4], [0.0; 3], [1e-4, 0.0, 0.0]];
        check("shear-stress", sheared, 0.4 * 3e-4 * modulus_mpa);
        // Shear in the other planes is none of it.
        check("shear-stress", [[0.0, 1e-4, 0.0], [1e-4, 0.0, 2e-4], [0.0, 2e-4, 0.0]], 0.0);
        // Without a key the middle row is shown.
        assert_eq!(figure("pressure").slice(&run, &run.plan.elastic.as_lattice()), Ok((1, 1)));
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
        assert!(
            refused("at_s = [0.0]", &chain)
                .contains("of a chain, which has no inside (accepted: a run of a slab or")
        );
        assert!(refused("at_s = [0.0]", &made_up::sheet(&[])).contains("of a sheet, which has no inside"));
        let slab = strained(0.0, 0.0, 0.0);
        let refused = |toml: &str, run: &RunData| refused(&format!("at_s = [0.0]\n{toml}"), run);
        assert_eq!(
            refused("row = 2", &slab),
            "row: run test is of a slab, all of which is shown (accepted: none)"
        );
        let body = made_up::body(&[]);
        assert_eq!(refused("across = 4", &body), "across: 4 is not in run test (accepted: 1 to 3)");
        assert_eq!(refused("row = 0", &body), "row: 0 is not in run test (accepted: 1 to 3)");
        assert_eq!(refused("row = 1\nacross = 1", &body), "across and row: a slice has one of them");
    }
}
