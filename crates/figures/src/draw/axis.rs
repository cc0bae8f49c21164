//! Scales as coordinates of plotters, which place values and marks.

use std::ops::Range;

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};

use super::scale::{Scale, Tick};

/// A scale, and those of its values that have numbers.
pub(super) struct Axis<'a> {
    pub(super) scale: &'a Scale,
    pub(super) ticks: Vec<Tick>,
}

impl Ranged for Axis<'_> {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        // What is far beyond an end is beyond it nevertheless.
        let share = self.scale.way(*value).clamp(-1e4, 1e4);
        (f64::from(first) + share * f64::from(last - first)).round() as i32
    }

    /// The values with numbers; those between, where none are asked for.
    fn key_points<Hint: KeyPointHint>(&self, hint: Hint) -> Vec<f64> {
        match hint.bold_points() {
            _ if hint.weight().allow_light_points() => Vec::new(),
            0 => self.scale.between_ticks().into_iter().filter(|at| self.tick(*at).is_none()).collect(),
            _ => self.ticks.iter().map(|tick| tick.at).collect(),
        }
    }

    fn range(&self) -> Range<f64> {
        let (from, to) = self.scale.ends();
        from..to
    }
}

impl ValueFormatter<f64> for Axis<'_> {
    fn format_ext(&self, value: &f64) -> String {
        self.tick(*value).map_or_else(String::new, |tick| tick.label.clone())
    }
}

impl Axis<'_> {
    fn tick(&self, value: f64) -> Option<&Tick> {
        self.ticks.iter().find(|tick| tick.at == value)
    }
}
