//! How many ruptures have at least a magnitude, with the law of Gutenberg and Richter where its test does not reject it.

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
