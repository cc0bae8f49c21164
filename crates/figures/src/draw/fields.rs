//! A quantity at chosen times, or at even times of one rupture, in panels of the same colours.
//!
//! Over the area of contact it is stress, slip, velocity or normal load, with arrows of its direction and outlines of what
//! slides. Inside a slab it is stress or displacement: of each square of four nodes the strain is that in its middle, of
//! displacements that are bilinear between the nodes, and the stress that of an isotropic sheet in plane stress with
//! Poisson's ratio 1/3.
//!
//! Of a body a slice is shown: the planes of squares on both sides of a row across, or of a layer, between which the
//! strain is that in the middle of cubes of eight nodes, and the stress that of an isotropic body with Poisson's
//! ratio 1/4.

use asperity_model::{Lattice, NodeState};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{RunData, load_at};
use schemars::JsonSchema;
use serde::Deserialize;

use super::area::{Area, Map, maps, sizes};
use super::arrival_map;
use super::colours::Colours;
use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, Film, RuptureSelector, film};
use super::scale::{Scale, number};
use super::sheet::{Layer, Pen, Sheet};

keys! {
    AreaField: run;

    /// One panel per instant, s.
    at_s: Vec<f64>,
    /// The quantity that colours show.
    shows: Quantity,
    /// Whether to show its direction by arrows; a normal load has none.
    #[serde(default)]
    arrows: bool,
}

/// A quantity of each contact.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Quantity {
    /// `|tau_n| / p_n`; a contact that bears nothing is left out.
    Stress,
    /// How far the contact is from its place at the start, in micrometres.
    Slip,
    /// The size of the velocity, m/s.
    #[default]
    Velocity,
    /// `p_n` over the mean of all contacts.
    NormalLoad,
}

impl Quantity {
    /// The quantity of each contact as a vector; what has no direction is along x. NaN where there is none.
    fn of(self, run: &RunData, state: &NodeState) -> Vec<[f64; 2]> {
        let (nodes, contacts) = (state.lattice.nodes(), state.lattice.contacts());
        let rest_m = &run.plan.initial.displacement_m;
        let both = |values: &[f64], of_axis: usize, n: usize| [values[n], values[of_axis + n]];
        let mean_n = state.normal_load_n.iter().sum::<f64>() / contacts as f64;
        let of = |n: usize| match self {
            Quantity::Stress if state.normal_load_n[n] > 0.0 => {
                both(&state.tangential_force_n, contacts, n).map(|tau_n| tau_n / state.normal_load_n[n])
            }
            Quantity::Slip => [n, nodes + n].map(|at| (state.displacement_m[at] - rest_m[at]) * 1e6),
            Quantity::Velocity => both(&state.velocity_m_per_s, nodes, n),
            Quantity::NormalLoad if mean_n > 0.0 => [state.normal_load_n[n] / mean_n, 0.0],
            Quantity::Stress | Quantity::NormalLoad => [f64::NAN; 2],
        };
        (0..contacts).map(of).collect()
    }

    /// Panels of states, each with its title, in the same colours, with the outlines of what slides.
    ///
    /// # Errors
    /// In words, if there is no state, or the quantity has no direction for arrows.
    fn sheet(self, run: &RunData, states: &[(String, &NodeState)], arrows: bool) -> Result<Sheet, String> {
        let area = Area::of(run)?;
        if arrows && self == Quantity::NormalLoad {
            let problem = "arrows: true is not accepted with shows = \"normal-load\", which has no direction";
            return Err(format!("{problem} (accepted: false)"));
        }
        let all: Vec<Vec<[f64; 2]>> = states.iter().map(|(_, state)| self.of(run, state)).collect();
        let values: Vec<Vec<f64>> = all.iter().map(|vectors| sizes(vectors)).collect();
        // What is no number is passed over.
        let largest = values.iter().flatten().copied().fold(0.0, f64::max);
        // Loads differ little from their mean.
        let least = if self == Quantity::NormalLoad { largest } else { 0.0 };
        let smallest = values.iter().flatten().copied().fold(least, f64::min);
        let longest = if arrows { largest } else { 0.0 };
        let panels = states.iter().zip(&all).zip(values).map(|(((title, state), vectors), values)| {
            let sliding = area.outlines(&|contact| state.slides[contact as usize - 1] != 0.0);
            let sliding = (!sliding.is_empty()).then(|| Layer::contours("sliding", sliding));
            let arrows = area.arrows(vectors, longest, states.len(), "");
            (title.clone(), values, sliding.into_iter().chain(arrows).collect())
        });
        let label = match self {
            Quantity::Stress => "|τ_n|/p_n",
            Quantity::Slip => "slip since the start (µm)",
            Quantity::Velocity => "|v_n| (m/s)",
            Quantity::NormalLoad => "p_n/(F_N/N)",
        };
        Ok(area.sheet(panels.collect(), Colours::between(label, &[smallest, largest])))
    }
}

impl Figure for AreaField {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { nodes_at_s: self.at_s.clone(), ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        Area::of(run)?;
        self.shows.sheet(run, &nodes_at(run, &self.at_s)?, self.arrows)
    }
}

keys! {
    FilmStrip: run;

    /// The number of the rupture, as in its table.
    rupture: Option<u64>,
    /// The rupture, where `rupture` gives no number; if absent that of the most contacts.
    which: Option<RuptureSelector>,
    /// Number of panels, 1 to 24: at the middles of as many equal spans between the onset and the end.
    #[serde(default = "super::kind::number::<6>")]
    panels: u32,
    /// The end of the last span, s after the onset; by default that of the rupture.
    to_s: Option<f64>,
    /// The quantity that colours show.
    #[serde(default)]
    shows: Quantity,
    /// Whether to show its direction by arrows; a normal load has none.
    #[serde(default)]
    arrows: bool,
}

impl FilmStrip {
    fn film(&self) -> Result<Film, String> {
        if !(1..=24).contains(&self.panels) {
            return Err(format!("panels: {} is not accepted (accepted: 1 to 24)", self.panels));
        }
        film(self.rupture, self.which, self.panels, self.to_s)
    }
}

impl Figure for FilmStrip {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { films: self.film().into_iter().collect(), ..RequiredData::NOTHING }
    }

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let film = self.film()?;
        Area::of(run)?;
        let (rupture, states) = (film.rupture(run)?, run.film(&film)?);
        if states.is_empty() {
            return Err(format!("run {} has no nodes: {COMPUTED}", run.name));
        }
        let last_s = states.iter().map(|state| state.time_s - rupture.onset_s).fold(0.0, f64::max);
        let clock = Clock::of(0.0, last_s, 0.0);
        // To three digits of the time between panels.
        let between = clock.place(2.0 * last_s) / (2.0 * f64::from(self.panels) - 1.0);
        let decimals = (2.0 - between.max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
        let titled = states.into_iter().map(|state| {
            let at = clock.place(state.time_s - rupture.onset_s);
            (format!("t − t_0 = {at:.decimals$} {}", clock.unit), state)
        });
        let sheet = self.shows.sheet(run, &titled.collect::<Vec<_>>(), self.arrows)?;
        Ok(sheet.titled(arrival_map::title(run, rupture)?))
    }
}

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

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let (out, plan) = (self.left_out, &run.plan);
        if !(0.0..0.5).contains(&out) {
            return Err(format!("left_out: {out} is not accepted (accepted: 0 to less than 0.5)"));
        }
        if !plan.elastic.has_inside() {
            let (of, accepted) = (plan.elastic.table.name, "(accepted: a run of a slab or a body)");
            return Err(format!("run {} is of a {of}, which has no inside {accepted}", run.name));
        }
        let lattice = plan.elastic;
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
        let (across, upwards, rows) = match slice.0 {
            1 => ("y", "z (mm)", lattice.rows),
            _ => ("z", "y (mm)", lattice.lanes),
        };
        let at_mm = number(slice.1 as f64 * spacing_mm);
        let plane = (lattice.lanes > 1).then(|| format!("at {across} = {at_mm} mm"));
        let ends = (out > 0.0).then(|| format!("ends: {} % beyond", 100.0 * out));
        let remarks: Vec<Layer> = plane.into_iter().chain(ends).map(Layer::remark).collect();
        let scale = |label, nodes: usize| Scale::between(label, 0.0, (nodes - 1) as f64 * spacing_mm);
        let axes = [scale("x (mm)", lattice.columns), scale(upwards, rows)];
        Ok(maps(panels, &remarks, axes, lattice.columns - 1, colours))
    }
}

impl SlabField {
    /// The nodes to show, a slice of a body, or all of a slab, which is a slice across its only row: the axis that they
    /// lie across, 1 or 2, and their place on it, from 0.
    fn slice(&self, run: &RunData, lattice: &Lattice) -> Result<(usize, usize), String> {
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
    fn values(&self, run: &RunData, nodes: &NodeState, (normal, place): (usize, usize)) -> Vec<f64> {
        let lattice = run.plan.elastic;
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
            // Of all three normal strains, and of that upwards twice more.
            _ => -modulus_mpa * [0, 1, 2, 2, 2].map(|axis| strain(first, axis, axis)).iter().sum::<f64>(),
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

/// Where nodes come from.
const COMPUTED: &str = "`draw`, `reproduce` and Python compute them";

/// The states of all nodes at chosen times, each with its time and its load.
fn nodes_at<'a>(run: &'a RunData, at_s: &[f64]) -> Result<Vec<(String, &'a NodeState)>, String> {
    if at_s.is_empty() {
        return Err("at_s: no time is given (accepted: one or more)".to_owned());
    }
    let of = |at_s: &f64| {
        let lacks = || format!("run {} has no nodes at {at_s} s: {COMPUTED}", run.name);
        let state = run.nodes_at(*at_s)?.ok_or_else(lacks)?;
        // No record is before the first step, and nothing pulls there.
        let load = load_at(run.loads()?, state.step).filter(|_| state.step > 0);
        let load = load.map_or("at rest".to_owned(), |load| format!("F_T/F_N = {:.4}", load.load_ratio()));
        let at = if state.step == 0 { "0".to_owned() } else { format!("{:.5}", state.time_s) };
        Ok((format!("t = {at} s, {load}"), state))
    };
    at_s.iter().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::{AreaField, Pen, Quantity};
    use crate::draw::kind::Figure;
    use asperity_model::NodeState;
    use asperity_numbers::required_data::RequiredData;
    use asperity_numbers::run_data::RunData;
    use asperity_testkit::made_up;

    /// A sheet of twelve contacts that bear 1 to 12 N, each pulled by (3, 4) N, displaced by (n, 0) µm and as
    /// fast as that.
    fn run() -> (RunData, NodeState) {
        let mut run = made_up::sheet(&[]);
        run.kept = RequiredData { nodes_at_s: vec![0.0], ..RequiredData::LOADS };
        let count = |n: usize| if n < 12 { n as f64 } else { 0.0 };
        let mut state = made_up::nodes(&run, 0, (0..24).map(|n| count(n) * 1e-6).collect());
        state.normal_load_n = (1..=12).map(f64::from).collect();
        state.tangential_force_n = [vec![3.0; 12], vec![4.0; 12]].concat();
        state.velocity_m_per_s = state.displacement_m.clone();
        run.nodes = vec![state.clone()];
        (run, state)
    }

    #[test]
    fn quantities_are_those_of_the_contacts() {
        let (run, mut state) = run();
        let of = |quantity: Quantity, state: &NodeState| super::sizes(&quantity.of(&run, state));
        assert_eq!(of(Quantity::Stress, &state)[4], 1.0);
        assert!((of(Quantity::Slip, &state)[7] - 7.0).abs() < 1e-9);
        assert!((of(Quantity::Velocity, &state)[7] - 7e-6).abs() < 1e-15);
        assert!((of(Quantity::NormalLoad, &state)[11] - 12.0 / 6.5).abs() < 1e-12);
        state.normal_load_n[0] = 0.0;
        assert!(of(Quantity::Stress, &state)[0].is_nan());
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_reason() {
        let figure = |toml: &str| -> AreaField {
            toml::from_str(&format!("file = 'f.png'\nrun = 'test'\n{toml}")).unwrap()
        };
        let (mut run, _) = run();
        let loads = "shows = 'normal-load'\narrows = true\nat_s = [0.0]";
        assert!(
            figure(loads)
                .part(&run, Pen::nth(0, ""))
                .unwrap_err()
                .starts_with("arrows: true is not accepted with shows")
        );
        assert!(
            figure("shows = 'slip'\nat_s = []")
                .part(&run, Pen::nth(0, ""))
                .unwrap_err()
                .starts_with("at_s: no time")
        );
        figure("shows = 'slip'\nat_s = [0.0]").part(&run, Pen::nth(0, "")).unwrap();
        run.nodes.clear();
        let refused = figure("shows = 'slip'\nat_s = [0.0]").part(&run, Pen::nth(0, "")).unwrap_err();
        assert!(refused.contains("run test has no nodes at 0 s"), "{refused}");
        let refused =
            figure("shows = 'slip'\nat_s = [0.0]").part(&made_up::slab(&[]), Pen::nth(0, "")).unwrap_err();
        assert!(refused.contains("lie in a single row"), "{refused}");
    }
}

#[cfg(test)]
mod tests_of_film_strips {
    use super::{Figure, FilmStrip, Pen};
    use asperity_numbers::required_data::RequiredData;
    use asperity_testkit::made_up;

    fn figure(toml: &str) -> FilmStrip {
        toml::from_str(&format!("file = 'f.png'\nrun = 'test'\n{toml}")).unwrap()
    }

    #[test]
    fn panels_are_at_even_times_of_the_rupture() {
        let mut run = made_up::sheet(&[]);
        run.header.steps = 10_000;
        made_up::with_ruptures(&mut run, &[&[(1, 100, Some(500)), (2, 200, Some(500))]]);
        let strip = figure("panels = 4");
        run.kept = strip.required_data();
        let [film] = &run.kept.films[..] else { panic!("one film") };
        // Steps of 0.1 µs: spans of 100 steps from step 100 on.
        let steps: Vec<f64> = film.times_s(&run).unwrap().iter().map(|t| (t * 1e7).round()).collect();
        assert_eq!(steps, [150.0, 250.0, 350.0, 450.0]);
        assert!(strip.part(&run, Pen::nth(0, "")).unwrap_err().contains("has no nodes"));
        run.nodes = [150, 250, 350, 450].map(|step| made_up::nodes(&run, step, vec![0.0; 24])).to_vec();
        let sheet = strip.part(&run, Pen::nth(0, "")).unwrap();
        assert_eq!(
            sheet.panels.iter().map(|panel| panel.title.as_str()).collect::<Vec<_>>(),
            ["t − t_0 = 5.0 µs", "t − t_0 = 15.0 µs", "t − t_0 = 25.0 µs", "t − t_0 = 35.0 µs"]
        );
        // No later than asked for.
        let until = figure("panels = 2\nto_s = 1e-5").film().unwrap().times_s(&run).unwrap();
        assert!((until[1] - 1.75e-5).abs() < 1e-12, "{until:?}");
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_reason() {
        let run = made_up::sheet(&[]);
        let refused = |toml: &str| figure(toml).part(&run, Pen::nth(0, "")).unwrap_err();
        assert_eq!(refused("panels = 0"), "panels: 0 is not accepted (accepted: 1 to 24)");
        assert_eq!(refused("panels = 25"), "panels: 25 is not accepted (accepted: 1 to 24)");
        assert!(refused("to_s = -1.0").starts_with("to_s: -1 is not accepted"));
        let chain = made_up::run("", &[]);
        assert!(figure("").part(&chain, Pen::nth(0, "")).unwrap_err().contains("lie in a single row"));
        assert_eq!(figure("").required_data().topics(), RequiredData::NOTHING.topics());
    }
}

#[cfg(test)]
mod tests_of_slabs {
    use super::{Figure, Pen, SlabField};
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
            let lattice = run.plan.elastic;
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
        assert_eq!(figure("pressure").slice(&run, &run.plan.elastic), Ok((1, 1)));
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_reason() {
        let refused = |toml: &str, run: &RunData| {
            let figure: SlabField =
                toml::from_str(&format!("file = 'f.png'\nrun = 'test'\nshows = 'pressure'\n{toml}")).unwrap();
            figure.part(run, Pen::nth(0, "")).unwrap_err()
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
