//! A run on one page.

use asperity_model::scenario::keys::AS_CODED;
use asperity_numbers::curve_list::levels;
use asperity_numbers::distributions::{SizeLaw, TimeLaw};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_numbers::text;

use super::kind::{Figure, keys, of_one_run};
use super::scale::number;
use super::sheet::{Layout, Pen, Sheet};
use super::space_time::Place;
use super::{load_ruptures, recurrence, sizes, space_time};

keys! {
    Overview: run;

}

impl Figure for Overview {
    of_one_run!(RequiredData { arrivals: true, windows: true, ..RequiredData::LOADS });

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let header = &run.header;
        let contacts = header.contacts();
        let count = match contacts.rows() {
            1 => header.blocks.to_string(),
            rows => format!("{} × {rows}", contacts.columns()),
        };
        let step = number(header.time_step_s);
        let set = if header.parameter_set == AS_CODED { "as-coded, " } else { "" };
        let title = format!("{}, {set}N = {count}, Δt = {step} s", header.scenario);
        let sizes = sizes::distribution(run, Pen::nth(0, "ruptures"), 1, SizeLaw::PowerLaw)?;
        let global_slips = Pen::nth(0, "global slips");
        let recurrence = recurrence::distribution(run, global_slips, None, TimeLaw::Weibull)?;
        let load = load_ruptures::curve(run, None, None)?;
        let place = if run.plan.medium.is_some() { Place::Mm } else { Place::Block };
        let map = space_time::map(run, None, [None, None], [None, None], place)?;
        let layout =
            Layout::Page { wide: vec![load, map], beside: vec![sizes, recurrence], numbers: numbers(run) };
        Ok(Sheet { layout, ..Sheet::of(Vec::new()).titled(title) })
    }
}

/// The numbers of the summary that one asks for first.
const FIRST: [&str; 13] = [
    "wave_speed_m_per_s",
    "simulated_s",
    "event_count",
    "rupture_count",
    "precursor_count",
    "global_rupture_count",
    "first_slip_s",
    "first_slip_ft_fn",
    "first_global_rupture_onset_s",
    "first_global_rupture_ft_fn",
    "global_rupture_front_speed_m_per_s",
    "longest_precursor_ratio",
    "largest_ft_fn",
];

/// Friction and load, and these numbers.
fn numbers(run: &RunData) -> Vec<(String, String)> {
    let coefficients = levels(run).into_iter().map(|(mu, _, label)| (label.to_owned(), mu.to_string()));
    let load = ("F_N at the start".to_owned(), format!("{:.1} N", run.plan.total_normal_load_n));
    let of_summary = FIRST.iter().map(|name| text::of_key(&run.summary, name));
    let rows = coefficients.chain([load]).chain(of_summary);
    rows.map(|(of, number)| (of, number.replace('-', "\u{2212}"))).collect()
}

#[cfg(test)]
mod tests {
    use super::numbers;
    use asperity_testkit::made_up::{self, EVENTS};

    #[test]
    fn the_first_numbers_are_those_of_the_run() {
        let mut run = made_up::run("", &EVENTS);
        run.summary.precursor_count = Some(2);
        run.summary.first_slip_s = Some(1e-5);
        let of = |what: &str| {
            let numbers = numbers(&run).into_iter();
            numbers.filter(|(of, _)| of == what).map(|(_, number)| number).next().unwrap()
        };
        assert_eq!([of("μ_s"), of("μ_d")], ["0.7", "0.45"]);
        assert_eq!([of("precursor count"), of("F_N at the start")], ["2", "400.0 N"]);
        assert_eq!([of("first slip"), of("first global rupture onset")], ["1e\u{2212}5 s", "\u{2212}"]);
    }
}
