//! How many ruptures there are of each moment: the rate in intervals of its logarithm, as Carlson and Langer show it.

use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_runs_in, overlaid};
use super::rupture_selector::no_ruptures;
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Pen, Sheet};

keys! {
    Moments: series;

    /// Time from which ruptures count, s.
    #[serde(default)]
    from_s: f64,
    /// Ruptures with more blocks than this are shown apart, as filled discs.
    longer_than_blocks: Option<u32>,
    /// Whether shorter ruptures count only if no other one slid meanwhile.
    #[serde(default)]
    alone: bool,
    /// The exponent `b` of a line to compare with, `M_0^-b`, from the first mark beyond ten times the most frequent moment
    /// on.
    b: Option<f64>,
}

/// Width of an interval in `ln M_0`.
const WIDTH: f64 = 0.5;

impl Figure for Moments {
    of_runs_in!(series);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let ruptures = run.ruptures.as_ref().ok_or_else(|| no_ruptures(run))?;
        // The logarithms of the moments of ruptures that slid forwards: of all, and of the longer ones.
        let [mut all, mut longer] = [Vec::new(), Vec::new()];
        for rupture in ruptures.iter().filter(|rupture| rupture.onset_s >= self.from_s) {
            let is_longer = self.longer_than_blocks.is_some_and(|blocks| rupture.slipped() > blocks);
            let counts = is_longer || !self.alone || !rupture.overlapping;
            let moment = rupture.moment_n_m.filter(|moment| counts && *moment > 0.0);
            if is_longer { &mut longer } else { &mut all }.extend(moment.map(f64::ln));
        }
        let filled = |blocks: u32| format!("{}, > {blocks} blocks: {}", pen.label, longer.len());
        let filled = self.longer_than_blocks.map_or_else(String::new, filled);
        let discs = pen.called(&filled).discs(rates(&longer));
        let marks = pen.called(&format!("{}: {}", pen.label, all.len())).marks(rates(&all));
        let (x, y) = ("moment M_0 (N m)", "ruptures per unit of ln M_0");
        Ok(Sheet::single(Scale::free_powers(x), Scale::free_powers(y), vec![discs, marks]))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let first = behind_peak(&parts[0].panels[0].layers[1].points());
        let mut sheet = overlaid(parts);
        let layers = &mut sheet.panels[0].layers;
        if let (Some(b), Some(from)) = (self.b, first) {
            let lowest = layers.iter().flat_map(Layer::points).map(|point| point.1).fold(from.1, f64::min);
            // It ends where it is as low as the lowest mark.
            let end = from.0 * (from.1 / lowest).powf(1.0 / b);
            layers.push(Layer::line(format!("slope −{b}"), vec![from, (end, lowest)], Dash::Dashed, GREY));
        }
        Ok(sheet)
    }
}

/// The first mark beyond ten times the most frequent moment, which is that of single blocks.
fn behind_peak(rates: &[(f64, f64)]) -> Option<(f64, f64)> {
    let (peak, _) = rates.iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    rates.iter().copied().find(|(moment, _)| *moment > 10.0 * peak)
}

/// Number per unit of the logarithm, at the middle of each interval that has any.
fn rates(logarithms: &[f64]) -> Vec<(f64, f64)> {
    let mut counts = std::collections::BTreeMap::new();
    for logarithm in logarithms {
        *counts.entry((logarithm / WIDTH).floor() as i64).or_insert(0) += 1;
    }
    let rate = |(n, count): (i64, i32)| (((n as f64 + 0.5) * WIDTH).exp(), f64::from(count) / WIDTH);
    counts.into_iter().map(rate).collect()
}

#[cfg(test)]
mod tests {
    use super::rates;

    #[test]
    fn rates_add_up_to_the_number() {
        let rates = rates(&[0.1, 0.2, 0.6, -0.1]);
        let middles: Vec<f64> = rates.iter().map(|(moment, _)| moment.ln()).collect();
        assert!(middles.iter().zip([-0.25, 0.25, 0.75]).all(|(a, b)| (a - b).abs() < 1e-12), "{middles:?}");
        assert_eq!(
            super::behind_peak(&[(1.0, 5.0), (2.0, 9.0), (19.0, 3.0), (30.0, 2.0)]),
            Some((30.0, 2.0))
        );
        assert_eq!(rates.iter().map(|(_, rate)| *rate).collect::<Vec<_>>(), [2.0, 4.0, 2.0]);
    }
}
