//! Moment of ruptures against their duration, with slopes to compare with: seismology distinguishes earthquakes, `T^3`
//! where they grow in all directions, from slow ones, `T` (Ide and others, Nature 447, 76 (2007)).

use asperity_numbers::run_data::RunData;

use super::kind::{Figure, Parts, keys, of_runs_in, with_pens};
use super::rupture_selector::{Clock, no_ruptures};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Sheet};

keys! {
    MomentDuration: series;

    /// The smallest rupture that is shown, in blocks.
    #[serde(default = "one")]
    from_blocks: u32,
}

fn one() -> u32 {
    1
}

/// Exponents of the guides.
const SLOPES: [i32; 3] = [1, 2, 3];

impl Figure for MomentDuration {
    of_runs_in!(series, Vec<(f64, f64)>);

    /// Duration and moment of every rupture that has ended and slid forwards.
    fn part(&self, run: &RunData) -> Result<Vec<(f64, f64)>, String> {
        let ruptures = run.ruptures.as_ref().ok_or_else(|| no_ruptures(run))?;
        let counts = ruptures.iter().filter(|rupture| rupture.slipped() >= self.from_blocks);
        let point = |rupture: &asperity_record::Rupture| {
            Some((rupture.end_s? - rupture.onset_s, rupture.moment_n_m?))
        };
        Ok(counts
            .filter_map(point)
            .filter(|(duration_s, moment)| *duration_s > 0.0 && *moment > 0.0)
            .collect())
    }

    fn sheet(&self, parts: Parts<Vec<(f64, f64)>>) -> Result<Sheet, String> {
        let all = || parts.values().flatten().copied();
        let longest_s = all().map(|point| point.0).fold(0.0, f64::max);
        let clock = Clock::of(0.0, longest_s, 0.0);
        let mut layers = guides(&all().collect::<Vec<_>>(), &clock);
        for (pen, points) in with_pens(&self.series, &parts)? {
            let placed = points.iter().map(|(duration_s, moment)| (clock.place(*duration_s), *moment));
            let label = format!("{}: {}", pen.label, points.len());
            layers.push(pen.called(&label).marks(placed.collect()));
        }
        let x = Scale::free_powers(&clock.label("duration T"));
        Ok(Sheet::single(x, Scale::free_powers("moment M_0 (N m)"), layers))
    }
}

/// Straight lines of each slope through the middle of the points, as far as the points reach.
fn guides(points: &[(f64, f64)], clock: &Clock) -> Vec<Layer> {
    let ends = |of: fn(&(f64, f64)) -> f64| {
        let values = points.iter().map(of);
        values.fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], value| [low.min(value), high.max(value)])
    };
    let ([t_low, t_high], [m_low, m_high]) = (ends(|point| point.0), ends(|point| point.1));
    if points.len() < 2 || t_low >= t_high || m_low >= m_high {
        return Vec::new();
    }
    let median = |of: fn(&(f64, f64)) -> f64| asperity_numbers::median(points.iter().map(of).map(f64::ln));
    let (Some(t), Some(m)) = (median(|point| point.0), median(|point| point.1)) else { return Vec::new() };
    let line = |slope: i32| {
        let slope = f64::from(slope);
        // The duration at which the line has a moment.
        let at = |moment: f64| t + (moment.ln() - m) / slope;
        let (from, to) = (at(m_low).max(t_low.ln()), at(m_high).min(t_high.ln()));
        let point = |ln_t: f64| (clock.place(ln_t.exp()), (m + slope * (ln_t - t)).exp());
        Layer::line("M_0 ∝ T, T², T³", vec![point(from), point(to)], Dash::Dotted, GREY)
    };
    SLOPES.map(line).into()
}

#[cfg(test)]
mod tests {
    use super::{Clock, guides};

    #[test]
    fn guides_have_their_slopes_and_end_with_the_points() {
        let points = [(1e-3, 1.0), (1e-2, 10.0), (1e-1, 100.0)];
        for (layer, slope) in guides(&points, &Clock::of(0.0, 1.0, 0.0)).iter().zip([1.0, 2.0, 3.0]) {
            let ends = layer.points();
            let (a, b) = (ends[0], ends[1]);
            assert!(((b.1 / a.1).ln() / (b.0 / a.0).ln() - slope).abs() < 1e-9, "{ends:?}");
            let on_middle = a.1 * (1e-2 / a.0).powf(slope);
            assert!((on_middle - 10.0).abs() < 1e-9 && a.1 > 0.99 && b.1 < 100.1, "{ends:?}");
        }
        assert!(guides(&points[..1], &Clock::of(0.0, 1.0, 0.0)).is_empty());
    }
}
