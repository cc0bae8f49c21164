//! Measured points on a figure: hollow marks with bars as long as their errors.

use plotters::prelude::RGBColor;

use super::scale::Scale;
use super::sheet::{Dash, Layer, Marker, Point, Sheet};
use crate::spec::Measured;

/// A colour that no series has.
const PURPLE: RGBColor = RGBColor(130, 40, 140);

impl Sheet {
    /// It with measured points, if there are any, in all panels of the quantity of the first, with axes that reach them.
    pub(super) fn with_measured(mut self, measured: Option<&Measured>) -> Sheet {
        let Some((measured, first)) = measured.zip(self.panels.first()) else { return self };
        let (x, y) = (first.x.clone(), first.y.clone());
        // Bars of errors, and marks with a row in the legend.
        let marks = measured.points.iter().map(|[x, y]| (x[0], y[0])).collect();
        let layers = [
            Layer::bars(&measured.points, [&x, &y], PURPLE),
            Layer::marks(&measured.label, marks, Marker::Diamond, PURPLE),
        ];
        let points = || layers.iter().flat_map(Layer::points);
        for panel in &mut self.panels {
            panel.x = panel.x.clone().holding(points().map(|point| point.0));
            if panel.y.label() == y.label() {
                panel.y = panel.y.clone().holding(points().map(|point| point.1));
                panel.layers.extend(layers.iter().cloned());
            }
        }
        self
    }
}

impl Layer {
    /// Bars of the errors of points, whose numbers across and upwards have their error beside them. A bar that would
    /// reach to 0 or below on a logarithmic axis begins at its mark.
    pub(super) fn bars(points: &[[[f64; 2]; 2]], scales: [&Scale; 2], colour: RGBColor) -> Layer {
        let low = |[value, error]: [f64; 2], scale: &Scale| {
            Some(value - error).filter(|low| scale.way(*low).is_finite()).unwrap_or(value)
        };
        let mut bars: Vec<Point> = Vec::new();
        for [x, y] in points {
            let gap = (f64::NAN, f64::NAN);
            if x[1] > 0.0 {
                bars.extend([(low(*x, scales[0]), y[0]), (x[0] + x[1], y[0]), gap]);
            }
            if y[1] > 0.0 {
                bars.extend([(x[0], low(*y, scales[1])), (x[0], y[0] + y[1]), gap]);
            }
        }
        Layer::line("", bars, Dash::Solid, colour)
    }
}

#[cfg(test)]
mod tests {
    use super::{Scale, Sheet};
    use crate::spec::Measured;

    #[test]
    fn a_bar_is_as_long_as_its_errors_and_axes_reach_it() {
        let measured = Measured {
            label: "lab".to_owned(),
            points: vec![[[2.0, 0.5], [1.0, 3.0]], [[4.0, 0.0], [5.0, 0.0]]],
        };
        let ends = |x: Scale, y: Scale| {
            let panel = Sheet::single(x, y, Vec::new()).with_measured(Some(&measured)).panels.remove(0);
            let [bars, marks] = &panel.layers[..] else { panic!("{panel:?}") };
            assert_eq!((marks.label.as_str(), marks.points()), ("lab", vec![(2.0, 1.0), (4.0, 5.0)]));
            let bars: Vec<_> = bars.points().into_iter().filter(|(x, _)| x.is_finite()).collect();
            (bars, panel.x.ends())
        };
        let between = |from, to| Scale::between("", from, to);
        let bars = vec![(1.5, 1.0), (2.5, 1.0), (2.0, -2.0), (2.0, 4.0)];
        assert_eq!(ends(between(0.0, 8.0), between(0.0, 1.0)), (bars.clone(), (0.0, 8.0)));
        let (same, (from, to)) = ends(between(3.0, 3.5), between(0.0, 1.0));
        assert!(same == bars && from < 1.5 && to > 4.0, "{from} {to}");
        let powers = Scale::powers_between("", 1.0, 10.0);
        assert_eq!(ends(powers.clone(), powers).0[2..], [(2.0, 1.0), (2.0, 4.0)]);
    }
}
