//! A run on one page.

use asperity_numbers::distributions::{SizeLaw, TimeLaw};
use asperity_numbers::front_speeds_m_per_s;
use asperity_numbers::fronts::crossing_s;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::counted;

use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Sort, sorted};
use super::scale::number;
use super::sheet::{Layout, Sheet};
use super::{load_ruptures, recurrence, sizes, space_time};

keys! {
    Overview: run;

}

impl Figure for Overview {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData { arrivals: true, windows: true, ..RequiredData::LOADS }
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let header = &run.header;
        let contacts = header.contacts();
        let count = match contacts.rows() {
            1 => header.blocks.to_string(),
            rows => format!("{} × {rows}", contacts.columns()),
        };
        let step = number(header.time_step_s);
        let title = format!("{}, {}, N = {count}, Δt = {step} s", header.scenario, header.parameter_set);
        let of_sizes = sizes::part(run, 1)?;
        let of_times = recurrence::part(run, None)?;
        let sizes = sizes::distribution(&[("ruptures", &of_sizes)], 1, SizeLaw::PowerLaw)?;
        let recurrence = recurrence::distribution(&[("global slips", &of_times)], TimeLaw::Weibull);
        let load = load_ruptures::curve(run, None, None)?;
        let map = space_time::map(run, None, [None, None], [None, None])?;
        let layout =
            Layout::Page { wide: vec![load, map], beside: vec![sizes, recurrence], numbers: numbers(run)? };
        Ok(Sheet { layout, ..Sheet::of(Vec::new()).titled(title) })
    }
}

/// The numbers of a run that one asks for first.
fn numbers(run: &RunData) -> Result<Vec<(String, String)>, String> {
    let ruptures = sorted(run)?;
    let count = |sort: Sort| ruptures.iter().filter(|(_, of)| *of == sort).count().to_string();
    let first_global =
        ruptures.iter().find(|(_, sort)| *sort == Sort::GlobalSlip).map(|(rupture, _)| rupture);
    let longest =
        ruptures.iter().rev().find(|(_, sort)| *sort == Sort::Precursor).map(|(rupture, _)| rupture);
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "none".to_owned());
    // Short runs slip within microseconds.
    let time = |time_s: f64| if time_s < 0.1 { number(time_s) } else { format!("{time_s:.4}") };
    let at = |time_s: f64, ft_fn: f64| format!("t = {} s, F_T/F_N = {ft_fn:.4}", time(time_s));
    let friction = &run.plan.friction;
    let largest = run.loads()?.iter().map(|load| load.load_ratio()).fold(f64::NEG_INFINITY, f64::max);
    let c_m_per_s = run.plan.spacing_m / crossing_s(run);
    let speeds = |rupture| front_speeds_m_per_s(rupture, run.header.contacts(), Some(c_m_per_s));
    let speed = first_global.and_then(|rupture| speeds(rupture)[0]);
    let place = if run.of_one_row().is_some() { "block" } else { "column" };
    let rows = [
        match friction.law.rate_and_state() {
            Some(law) => ("f_0", law.reference_coefficient.to_string()),
            None => {
                ("μ_s, μ_d", format!("{}, {}", friction.static_coefficient, friction.dynamic_coefficient))
            }
        },
        ("F_N at the start", format!("{:.1} N", run.plan.total_normal_load_n)),
        ("wave speed c", format!("{c_m_per_s:.1} m/s")),
        ("duration", format!("{} s", run.plan.grid.time_s(run.header.steps))),
        ("slip events", run.slips.len().to_string()),
        ("ruptures", ruptures.len().to_string()),
        ("precursors", count(Sort::Precursor)),
        ("global slips", count(Sort::GlobalSlip)),
        ("first rupture", or_none(ruptures.first().map(|(first, _)| at(first.onset_s, first.ft_fn_onset)))),
        ("first global slip", or_none(first_global.map(|first| at(first.onset_s, first.ft_fn_onset)))),
        (
            "its front, upwards",
            or_none(speed.map(|speed| format!("{speed:.1} m/s = {:.3} c", speed / c_m_per_s))),
        ),
        ("longest precursor", or_none(longest.map(|longest| counted(longest.last_block.into(), place)))),
        ("largest F_T/F_N", format!("{largest:.4}")),
    ];
    Ok(rows.into_iter().map(|(of, number)| (of.to_owned(), number.replace('-', "\u{2212}"))).collect())
}

#[cfg(test)]
mod tests {
    use super::numbers;
    use asperity_testkit::made_up::{self, EVENTS};

    #[test]
    fn the_first_numbers_are_those_of_the_run() {
        let mut run = made_up::run("", &EVENTS);
        run.header.steps = 1000;
        let of = |run: &_, what: &str| {
            let numbers = numbers(run).unwrap();
            numbers.into_iter().find(|(of, _)| of == what).map(|(_, number)| number).unwrap()
        };
        made_up::with_ruptures(&mut run, &[&[(1, 100, Some(101))], &[(1, 200, None), (2, 210, None)]]);
        assert_eq!(of(&run, "precursors"), "2");
        assert_eq!(of(&run, "first global slip"), "none");
        assert_eq!(of(&run, "longest precursor"), "2 blocks");
        made_up::with_ruptures(&mut run, &[&[(1, 100, None), (2, 110, None), (3, 120, None)]]);
        assert_eq!((of(&run, "precursors"), of(&run, "global slips")), ("0".to_owned(), "1".to_owned()));
        assert_eq!(of(&run, "first global slip"), "t = 10^{\u{2212}5} s, F_T/F_N = 0.0000");
        assert_eq!(of(&run, "slip events"), "7");
    }
}
