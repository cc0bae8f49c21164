//! Measured points on a figure: hollow marks with bars as long as their errors.

use plotters::prelude::RGBColor;

use super::sheet::{Dash, Layer, Marker, Point};
use crate::spec::Measured;

/// A colour that no series has.
const PURPLE: RGBColor = RGBColor(130, 40, 140);

impl Measured {
    /// Bars of errors, and marks with a row in the legend. A bar that would reach to 0 or below on a logarithmic axis
    /// begins at its mark.
    pub(super) fn layers(&self, log: [bool; 2]) -> [Layer; 2] {
        let low = |[value, error]: [f64; 2], log: bool| match value - error {
            low if log && low <= 0.0 => value,
            low => low,
        };
        let mut bars: Vec<Point> = Vec::new();
        for [x, y] in &self.points {
            let gap = (f64::NAN, f64::NAN);
            if x[1] > 0.0 {
                bars.extend([(low(*x, log[0]), y[0]), (x[0] + x[1], y[0]), gap]);
            }
            if y[1] > 0.0 {
                bars.extend([(x[0], low(*y, log[1])), (x[0], y[0] + y[1]), gap]);
            }
        }
        let marks = self.points.iter().map(|[x, y]| (x[0], y[0])).collect();
        [
            Layer::line("", bars, Dash::Solid, PURPLE),
            Layer::marks(&self.label, marks, Marker::Diamond, PURPLE),
        ]
    }
}

#[cfg(test)]
mod tests {
    use crate::spec::Measured;

    #[test]
    fn a_bar_is_as_long_as_its_errors_and_stays_on_a_logarithmic_axis() {
        let measured = Measured {
            label: "lab".to_owned(),
            points: vec![[[2.0, 0.5], [1.0, 3.0]], [[4.0, 0.0], [5.0, 0.0]]],
        };
        let ends = |log| {
            let [bars, marks] = measured.layers(log);
            assert_eq!((marks.label.as_str(), marks.points()), ("lab", vec![(2.0, 1.0), (4.0, 5.0)]));
            bars.points().into_iter().filter(|(x, _)| x.is_finite()).collect::<Vec<_>>()
        };
        assert_eq!(ends([false; 2]), [(1.5, 1.0), (2.5, 1.0), (2.0, -2.0), (2.0, 4.0)]);
        assert_eq!(ends([true; 2]), [(1.5, 1.0), (2.5, 1.0), (2.0, 1.0), (2.0, 4.0)]);
    }
}
