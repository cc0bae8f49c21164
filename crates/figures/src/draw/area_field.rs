//! A quantity over the area of contact: stress, slip, velocity or normal load, with arrows of its direction and outlines
//! of what slides, at chosen times or in panels at even times of one rupture.

use asperity_model::NodeState;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use super::area::{Area, nodes_at, sizes};
use super::arrival_map;
use super::colours::Colours;
use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, Film, RuptureSelector, film};
use super::sheet::{Layer, Sheet};

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
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Quantity {
    /// `|tau_n| / p_n`; a contact that bears nothing is left out.
    Stress,
    /// How far the contact is from its place at the start, in micrometres.
    Slip,
    /// The size of the velocity, m/s.
    Velocity,
    /// `p_n` over the mean of all contacts.
    NormalLoad,
}

impl Quantity {
    /// The quantity of each contact as a vector; what has no direction is along x. NaN where there is none.
    fn of(self, run: &RunData, state: &NodeState) -> Vec<[f64; 2]> {
        let (nodes, contacts) = (state.lattice.nodes(), state.lattice.contacts());
        let both = |values: &[f64], of_axis: usize, n: usize| [values[n], values[of_axis + n]];
        let mean_n = state.normal_load_n.iter().sum::<f64>() / contacts as f64;
        let of = |n: usize| match self {
            Quantity::Stress if state.normal_load_n[n] > 0.0 => {
                both(&state.tangential_force_n, contacts, n).map(|tau_n| tau_n / state.normal_load_n[n])
            }
            Quantity::Slip => {
                let [now, rest] =
                    [&state.displacement_m, &run.plan.initial.displacement_m].map(|u| both(u, nodes, n));
                [(now[0] - rest[0]) * 1e6, (now[1] - rest[1]) * 1e6]
            }
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
    pub(super) fn sheet(
        self,
        run: &RunData,
        states: &[(String, &NodeState)],
        has_arrows: bool,
    ) -> Result<Sheet, String> {
        let area = Area::of(run)?;
        if has_arrows && self == Quantity::NormalLoad {
            let problem = "arrows: true is not accepted with shows = \"normal-load\", which has no direction";
            return Err(format!("{problem} (accepted: false)"));
        }
        let all: Vec<Vec<[f64; 2]>> = states.iter().map(|(_, state)| self.of(run, state)).collect();
        let values: Vec<Vec<f64>> = all.iter().map(|vectors| sizes(vectors)).collect();
        // What is no number is passed over.
        let largest = values.iter().flatten().copied().fold(0.0, f64::max);
        let smallest = match self {
            // Loads differ little from their mean.
            Quantity::NormalLoad => values.iter().flatten().copied().fold(largest, f64::min),
            _ => 0.0,
        };
        let panels = states.iter().zip(&all).zip(values).map(|(((title, state), vectors), values)| {
            let sliding = area.outlines(&|contact| state.slides[contact as usize - 1] != 0.0);
            let sliding = (!sliding.is_empty()).then(|| Layer::contours("sliding", sliding));
            let mut layers = Vec::from_iter(sliding);
            if has_arrows {
                layers.extend(area.arrows(vectors, largest, states.len(), ""));
            }
            (title.clone(), values, layers)
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

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
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
    #[serde(default = "six")]
    panels: u32,
    /// The end of the last span, s after the onset; by default that of the rupture.
    to_s: Option<f64>,
    /// The quantity that colours show.
    #[serde(default = "velocity")]
    shows: Quantity,
    /// Whether to show its direction by arrows; a normal load has none.
    #[serde(default)]
    arrows: bool,
}

fn six() -> u32 {
    6
}

fn velocity() -> Quantity {
    Quantity::Velocity
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

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let film = self.film()?;
        Area::of(run)?;
        let (rupture, states) = (film.rupture(run)?, run.film(&film)?);
        if states.is_empty() {
            return Err(format!(
                "run {} has no nodes: `draw`, `reproduce` and Python compute them",
                run.name
            ));
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

#[cfg(test)]
mod tests {
    use super::{AreaField, Quantity};
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
        assert!(figure(loads).part(&run).unwrap_err().starts_with("arrows: true is not accepted with shows"));
        assert!(figure("shows = 'slip'\nat_s = []").part(&run).unwrap_err().starts_with("at_s: no time"));
        figure("shows = 'slip'\nat_s = [0.0]").part(&run).unwrap();
        run.nodes.clear();
        let refused = figure("shows = 'slip'\nat_s = [0.0]").part(&run).unwrap_err();
        assert!(refused.contains("run test has no nodes at 0 s"), "{refused}");
        let refused = figure("shows = 'slip'\nat_s = [0.0]").part(&made_up::slab(&[])).unwrap_err();
        assert!(refused.contains("lie in a single row"), "{refused}");
    }
}

#[cfg(test)]
mod tests_of_film_strips {
    use super::{Figure, FilmStrip};
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
        assert!(strip.part(&run).unwrap_err().contains("has no nodes"));
        run.nodes = [150, 250, 350, 450].map(|step| made_up::nodes(&run, step, vec![0.0; 24])).to_vec();
        let sheet = strip.part(&run).unwrap();
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
        let refused = |toml: &str| figure(toml).part(&run).unwrap_err();
        assert_eq!(refused("panels = 0"), "panels: 0 is not accepted (accepted: 1 to 24)");
        assert_eq!(refused("panels = 25"), "panels: 25 is not accepted (accepted: 1 to 24)");
        assert!(refused("to_s = -1.0").starts_with("to_s: -1 is not accepted"));
        let chain = made_up::run("", &[]);
        assert!(figure("").part(&chain).unwrap_err().contains("lie in a single row"));
        assert_eq!(figure("").required_data().topics(), RequiredData::NOTHING.topics());
    }
}
