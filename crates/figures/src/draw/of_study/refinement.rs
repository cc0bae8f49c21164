//! What the numbers of a refinement are worth: a row for each, by its class as found, then in the order of a summary.

use asperity_numbers::Convergence;
use asperity_numbers::convergence::MOST_CHANGE;
use asperity_numbers::refined::Refined;
use plotters::prelude::RGBColor;

use crate::Figure;
use crate::draw::scale::Scale;
use crate::draw::sheet::{BLUE, Dash, GREEN, GREY, INK, Layer, Layout, Marker, RED, Sheet};

/// The height of a row, in pixels.
const ROW: f64 = 40.0;

/// Ends of the axis, and the least change that it shows, in per cent. No change exceeds twice the larger value.
const ENDS: (f64, f64) = (0.008, 250.0);
const LEAST: f64 = 0.01;

/// What changes a number, and its mark.
const CHANGES: [(&str, Marker); 3] =
    [("coarser mesh", Marker::Triangle), ("shorter step", Marker::Diamond), ("finer mesh", Marker::Circle)];

/// Colours of the classes, in their order.
const COLOURS: [RGBColor; 4] = [GREEN, BLUE, GREY, RED];

/// The share of its colour that the bar of a row has.
const BAR: f64 = 0.3;

pub(super) fn sheet(figure: &Figure, runs: &[Vec<Option<f64>>]) -> Sheet {
    let all = Refined::all(runs);
    let sample = |(label, marker): (&str, Marker)| Layer::marks(label, Vec::new(), marker, INK);
    let mut layers = CHANGES.map(sample).to_vec();
    layers.push(Layer::surface("perturbed moduli", Vec::new(), BAR, INK));
    // From the bottom to the top.
    let mut names = Vec::new();
    for ((class, word, mark, _), colour) in Convergence::ALL.into_iter().zip(COLOURS).rev() {
        let before = names.len();
        for one in all.iter().rev().filter(|one| one.found() == Some(class)) {
            let ([mesh, step, perturbed], y) = (one.changes.unwrap_or_default(), names.len() as f64);
            let shown = |change: f64| (100.0 * change).max(LEAST);
            let (low, high, to) = (y - BAR, y + BAR, shown(perturbed));
            let bar = vec![(ENDS.0, low), (to, low), (to, high), (ENDS.0, high)];
            layers.push(Layer::surface("", bar, BAR, colour));
            let changes = [one.coarser_change(), Some(step), Some(mesh)].into_iter().zip(CHANGES);
            layers.extend(changes.filter_map(|(change, (_, marker))| {
                Some(Layer::marks("", vec![(shown(change?), y)], marker, colour))
            }));
            names.push(one.number.key.label());
        }
        let count = names.len() - before;
        if count > 0 {
            names.extend([format!("{mark} {}: {count}", word.to_uppercase()), String::new()]);
        }
    }
    let limit = 100.0 * MOST_CHANGE;
    let across = vec![(limit, -0.5), (limit, names.len() as f64 - 0.5)];
    layers.push(Layer::line(format!("{limit} %"), across, Dash::Dashed, INK));
    let (x, y) = (Scale::powers_between(&figure.x.label, ENDS.0, ENDS.1), Scale::of_words("", &names));
    layers.push(Layer::remark(format!("at the left: {LEAST} % or less")));
    Sheet { layout: Layout::Tall(ROW * (names.len() + 1) as f64), ..Sheet::single(x, y, layers) }
}

#[cfg(test)]
mod tests {
    use asperity_numbers::refined::Refined;

    use super::{ENDS, LEAST, sheet};
    use crate::Figure;
    use crate::draw::sheet::{Marker, Shape};

    #[test]
    fn a_number_stands_in_its_class_with_its_changes() {
        // As given, on the finer mesh, with the shorter step, and on the coarser mesh, each with two perturbations.
        let of = |name: &str| match name {
            "largest_ft_fn" => [1.0; 12],
            "precursor_count" => [40.0, 44.0, 42.0, 50.0, 54.0, 52.0, 40.0, 42.0, 41.0, 20.0, 20.0, 20.0],
            _ => [f64::NAN; 12],
        };
        let number = |name: &str, run: usize| Some(of(name)[run]).filter(|value| value.is_finite());
        let run = |run: usize| Refined::numbers().map(|of| number(of.name(), run)).collect();
        let sheet = sheet(&Figure::refinement(), &(0..12).map(run).collect::<Vec<_>>());
        let panel = &sheet.panels[0];
        let rows: Vec<String> = panel.y.ticks_at_most(9.0).into_iter().map(|tick| tick.label).collect();
        assert_eq!(rows, ["precursor count", "# OF THE MESH: 1", "", "largest F_T/F_N", " ROBUST: 1", ""]);
        let marks = |row: f64| -> Vec<(Marker, f64)> {
            let of_layer = |shape: &Shape| match shape {
                Shape::Marks(points, marker) => Some((*marker, points.iter().find(|at| at.1 == row)?.0)),
                _ => None,
            };
            panel.layers.iter().filter_map(|layer| of_layer(&layer.shape)).collect()
        };
        let [coarser, step, mesh] = [22.0 / 42.0, 1.0 / 42.0, 10.0 / 52.0].map(|change| 100.0 * change);
        let changes = [(Marker::Triangle, coarser), (Marker::Diamond, step), (Marker::Circle, mesh)];
        assert_eq!(marks(0.0), changes);
        assert!(marks(3.0).iter().all(|(_, change)| *change <= LEAST));
        let bar = panel.layers.iter().find(|layer| layer.points().first().is_some_and(|at| at.0 == ENDS.0));
        assert!((bar.unwrap().points()[1].0 - 100.0 * 4.0 / 44.0).abs() < 1e-9);
        // Of a study that is none, nothing is drawn.
        assert!(super::sheet(&Figure::refinement(), &[]).page(None).is_ok());
    }
}
