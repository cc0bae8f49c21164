//! How the times between ruptures are distributed, and what is fitted to it.

use asperity_numbers::distributions::{TimeFit, TimeLaw, half_band, survival};
use asperity_numbers::estimate::Estimate;
use asperity_numbers::goodness::Test;
use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;

use super::kind::{Figure, keys, of_runs_in};
use super::rupture_selector::{before_first_global_slip, sorted};
use super::scale::Scale;
use super::sheet::{Dash, Layer, Pen, Sheet};
use super::sizes::{Fitted, band, fit_layers, steps};

keys! {
    Recurrence: series;

    /// The smallest rupture that counts, in blocks; by default only global slips count. Times run from
    /// onset to onset of successive ruptures, from the first global slip on.
    from_blocks: Option<u32>,
    /// The law that is fitted, by maximum likelihood.
    #[serde(default)]
    fit: TimeLaw,
}

impl Figure for Recurrence {
    of_runs_in!(series);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        distribution(run, pen, self.from_blocks, self.fit)
    }
}

/// Times between ruptures from the first global slip on, s; between all where there is none.
fn times(run: &RunData, from_blocks: Option<u32>) -> Result<(Vec<f64>, bool), String> {
    let counts = |rupture: &Rupture| match from_blocks {
        Some(from_blocks) => rupture.reach().count() >= from_blocks,
        None => rupture.reached_every_block,
    };
    let ruptures = sorted(run)?;
    let first_global = before_first_global_slip(&ruptures);
    let counted = ruptures[first_global.unwrap_or(0)..].iter().filter(|(rupture, _)| counts(rupture));
    let onsets: Vec<f64> = counted.map(|(rupture, _)| rupture.onset_s).collect();
    Ok((onsets.windows(2).map(|pair| pair[1] - pair[0]).collect(), first_global.is_some()))
}

pub(super) fn distribution(
    run: &RunData,
    pen: Pen<'_>,
    from_blocks: Option<u32>,
    law: TimeLaw,
) -> Result<Sheet, String> {
    const POINTS: u32 = 200;
    let (times_s, has_global_slip) = times(run, from_blocks)?;
    let (count, (_, dash, color)) = (times_s.len(), pen.look);
    // Times that are nearly the same are shown without what is far below them.
    let (from_s, to_s) = Scale::free("").fitted(times_s.iter().copied()).ends();
    let (mut layers, mut course) = (Vec::new(), Vec::new());
    if count > 0 {
        let mut shares = survival(&times_s);
        // Before the shortest time all are longer, and none beyond the longest.
        shares.insert(0, (from_s, 1.0));
        shares.push((to_s, 0.0));
        course = steps(&shares);
        layers.push(band(&course, half_band(count), 0.0, pen));
    }
    layers.push(Layer::line(format!("{}: {count}", pen.label), course, Dash::Solid, color));
    if law != TimeLaw::None {
        let fitted = TimeFit::of(&times_s, law).map(|fit| {
            let times = (0..=POINTS).map(|n| from_s + (to_s - from_s) * f64::from(n) / f64::from(POINTS));
            let course = times.map(|time_s| (time_s, fit.survival(time_s))).collect();
            let test = Test::of_times(&fit, &times_s, law);
            let (law, parameters) = words(fit);
            Fitted { law, parameters, test, course }
        });
        let dash = if dash == Dash::Solid { Dash::Dashed } else { dash };
        layers.extend(fit_layers(fitted, has_global_slip || count == 0, dash, color));
    }
    let y = Scale::between("share of longer times", 0.0, 1.04);
    Ok(Sheet::single(Scale::tight("T between onsets (s)"), y, layers))
}

/// The law that was fitted, and its parameters.
fn words(fit: TimeFit) -> (&'static str, Vec<String>) {
    let time = |estimate: Estimate| format!("({estimate}) s");
    match fit {
        TimeFit::Weibull { shape, scale_s } => {
            ("Weibull", vec![format!("κ = {shape}"), format!("T_0 = {}", time(scale_s))])
        }
        TimeFit::LogNormal { median_s, spread } => {
            ("log-normal", vec![format!("σ = {spread}"), format!("median {}", time(median_s))])
        }
        TimeFit::Exponential { mean_s } => ("exponential", vec![format!("mean {}", time(mean_s))]),
    }
}

#[cfg(test)]
mod tests {
    use super::{Pen, TimeLaw, distribution, times};
    use asperity_testkit::made_up::{self, Passed};

    #[test]
    fn times_are_between_onsets_of_those_that_count() {
        let mut run = made_up::run("", &[(100, 101, &[1])]);
        let all =
            |onset: u64| -> [Passed; 3] { [(1, onset, None), (2, onset + 1, None), (3, onset + 2, None)] };
        let [early, one]: [&[Passed]; 2] = [&[(1, 50, Some(60))], &[(1, 250, Some(260))]];
        made_up::with_ruptures(
            &mut run,
            &[early, &all(100), &all(200), one, &all(320), &all(400), &all(501), &all(600)],
        );
        let steps = |from_blocks| -> Vec<i64> {
            let times_s = times(&run, from_blocks).unwrap().0;
            times_s.iter().map(|time_s| (time_s / 1e-7).round() as i64).collect()
        };
        assert_eq!(steps(None), [100, 120, 80, 101, 99]);
        // Not the one before the first global slip.
        assert_eq!(steps(Some(1)), [100, 50, 70, 80, 101, 99]);
        let words = |law, from_blocks| -> Vec<String> {
            let paper = distribution(&run, Pen::nth(0, "A"), from_blocks, law).unwrap();
            paper.layers().map(|layer| layer.label.clone()).filter(|label| !label.is_empty()).collect()
        };
        // Times this even do not come at random: half of exp(-t/T) is shorter than 0.69 T, and the
        // shortest of these is 0.8 T.
        let rejected = words(TimeLaw::Exponential, None);
        assert_eq!([&rejected[0], &rejected[1]], ["95 %", "A: 5"]);
        assert!(rejected[2].starts_with("exponential rejected: KS 0.551 > 0."), "{rejected:?}");
        assert_eq!(words(TimeLaw::None, None), ["95 %", "A: 5"]);
        let accepted = words(TimeLaw::Weibull, None);
        assert!(
            accepted[2].starts_with("Weibull, κ = ") && accepted[3].starts_with("T_0 = ("),
            "{accepted:?}"
        );
        assert!(accepted[4].contains(" ≤ "), "{accepted:?}");
        assert_eq!(words(TimeLaw::Weibull, Some(9)), ["A: 0", "too few for a fit"]);
        run.ruptures = None;
        made_up::with_ruptures(&mut run, &[early, one, one]);
        let paper = distribution(&run, Pen::nth(0, "A"), Some(1), TimeLaw::Weibull).unwrap();
        assert!(paper.labels().contains(&"no fit before a global slip".to_owned()));
    }
}
