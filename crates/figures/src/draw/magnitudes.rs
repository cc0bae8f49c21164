//! How many ruptures have at least a magnitude, with the law of Gutenberg and Richter unless its test rejects it.

use asperity_numbers::catalogue::moment_magnitude;
use asperity_numbers::distributions::survival;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_runs_in};
use super::rupture_selector::sorted;
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Pen, Point, Sheet};
use super::sizes::of_magnitudes;

keys! {
    Magnitudes: series;

}

impl Figure for Magnitudes {
    of_runs_in!(series);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        if run.plan.medium.is_some() {
            let name = &run.name;
            return Err(format!("the moments of run {name} are per metre of strike, without magnitudes"));
        }
        let ruptures = sorted(run)?.into_iter();
        let all: Vec<f64> = ruptures.filter_map(|(one, _)| moment_magnitude(one.moment_n_m?)).collect();
        let shares = survival(&all).into_iter();
        let counts = shares.map(|(magnitude, share)| (magnitude, share * all.len() as f64)).collect();
        let mut layers = of_magnitudes(run);
        layers.push(pen.called(&format!("{}: {}", pen.label, all.len())).marks(counts));
        layers
            .extend(law(run).map(|law| Layer::line("law of Gutenberg and Richter", law, Dash::Dashed, GREY)));
        Ok(Sheet::single(Scale::free("magnitude M"), Scale::free_powers("ruptures of at least M"), layers))
    }
}

/// From the completeness to where the law leaves one rupture; none where its test rejects it.
fn law(run: &RunData) -> Option<Vec<Point>> {
    let (b, from) = (run.summary.gutenberg_richter_b?, run.summary.completeness_magnitude?);
    let count = run.summary.complete_rupture_count? as f64;
    Some(vec![(from, count), (from + count.log10() / b, 1.0)])
}

#[cfg(test)]
mod tests {
    use asperity_testkit::made_up;

    use super::{Figure, Magnitudes, Pen};

    #[test]
    fn the_law_is_drawn_unless_its_test_rejects_it() {
        let mut run = made_up::run("", &[]);
        made_up::with_ruptures(
            &mut run,
            &[&[(1, 100, Some(200))], &[(1, 300, Some(400))], &[(2, 500, None)]],
        );
        // Magnitudes -5.4 and -6.4; the third rupture has no moment.
        for (rupture, moment) in
            run.ruptures.iter_mut().flatten().zip([Some(10.0), Some(10.0 / 31.622_776_6), None])
        {
            rupture.moment_n_m = moment;
        }
        run.summary.complete_rupture_count = Some(100);
        run.summary.completeness_magnitude = Some(-7.0);
        run.summary.gutenberg_richter_test = Some("no law of Gutenberg and Richter above -7.000".to_owned());
        let figure: Magnitudes = toml::from_str("file = 'f.png'\nseries = []").unwrap();
        let shown = |run: &_| {
            let sheet = figure.part(run, Pen::nth(0, "all")).unwrap();
            let points: Vec<_> = sheet.layers().flat_map(|layer| layer.points()).collect();
            (points.iter().map(|(m, n)| ((m * 10.0).round(), n.round())).collect::<Vec<_>>(), sheet.labels())
        };
        let (points, labels) = shown(&run);
        assert_eq!(points, [(-64.0, 2.0), (-54.0, 1.0)]);
        assert_eq!(labels, ["no law of Gutenberg and Richter", "above −7.000", "all: 2"]);
        // From a hundred ruptures to one.
        run.summary.gutenberg_richter_b = Some(0.5);
        assert_eq!(shown(&run).0[2..], [(-70.0, 100.0), (-30.0, 1.0)]);
    }
}
