//! Moment of ruptures against their duration, with slopes to compare with: seismology distinguishes earthquakes, `T^3`
//! where they grow in all directions, from slow ones, `T` (Ide and others, Nature 447, 76 (2007)).

use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;

use super::kind::{Figure, keys, of_runs_in, overlaid};
use super::rupture_selector::no_ruptures;
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Pen, Point, Sheet};

keys! {
    MomentDuration: series;

    /// The smallest rupture that is shown, in blocks.
    #[serde(default = "super::kind::number::<1>")]
    from_blocks: u32,
}

/// Exponents of the guides.
const SLOPES: [i32; 3] = [1, 2, 3];

impl Figure for MomentDuration {
    of_runs_in!(series);

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let ruptures = run.ruptures.as_ref().ok_or_else(|| no_ruptures(run))?;
        let counts = ruptures.iter().filter(|rupture| rupture.slipped() >= self.from_blocks);
        // Of every rupture that has ended and slid forwards.
        let point = |rupture: &Rupture| Some((rupture.end_s? - rupture.onset_s, rupture.moment_n_m?));
        let is_shown = |(duration_s, moment): &Point| *duration_s > 0.0 && *moment > 0.0;
        let points: Vec<Point> = counts.filter_map(point).filter(is_shown).collect();
        let marks = pen.called(&format!("{}: {}", pen.label, points.len())).marks(points);
        let (x, y) = ("duration T (s)", "moment M_0 (N m)");
        Ok(Sheet::single(Scale::free_powers(x), Scale::free_powers(y), vec![marks]))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let mut panel = overlaid(parts).panels.remove(0).fitted();
        let points: Vec<Point> = panel.layers.iter().flat_map(Layer::points).collect();
        panel.layers.splice(..0, guides(&points, panel.x.ends()));
        Ok(Sheet::of(vec![panel]))
    }
}

/// Straight lines of each slope through the middle of the points, between two durations.
fn guides(points: &[Point], (from_s, to_s): (f64, f64)) -> Vec<Layer> {
    let median = |of: fn(&Point) -> f64| asperity_numbers::median(points.iter().map(of));
    let line = |(middle_s, middle): Point, slope| {
        let at = |duration_s: f64| (duration_s, middle * (duration_s / middle_s).powi(slope));
        Layer::line("M_0 ∝ T, T², T³", vec![at(from_s), at(to_s)], Dash::Dotted, GREY)
    };
    let middle = median(|point| point.0).zip(median(|point| point.1));
    middle.into_iter().flat_map(|middle| SLOPES.map(|slope| line(middle, slope))).collect()
}

#[cfg(test)]
mod tests {
    use super::guides;

    #[test]
    fn guides_have_their_slopes_and_reach_both_ends() {
        let points = [(1e-3, 1.0), (1e-2, 10.0), (1e-1, 100.0)];
        for (layer, slope) in guides(&points, (1e-3, 0.2)).iter().zip([1.0, 2.0, 3.0]) {
            let ends = layer.points();
            let (a, b) = (ends[0], ends[1]);
            assert!(((b.1 / a.1).ln() / (b.0 / a.0).ln() - slope).abs() < 1e-9, "{ends:?}");
            let on_middle = a.1 * (1e-2 / a.0).powf(slope);
            assert!((on_middle - 10.0).abs() < 1e-9 && (a.0, b.0) == (1e-3, 0.2), "{ends:?}");
        }
        assert!(guides(&[], (1.0, 2.0)).is_empty());
    }
}
