//! One rupture over the area of contact, in panels at even times.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;

use super::area::Area;
use super::area_field::Quantity;
use super::arrival_map;
use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, Film, RuptureSelector, film};
use super::sheet::Sheet;

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
