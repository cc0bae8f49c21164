//! The colours of ruptures by their kind, and a time axis about one of them.

use asperity_record::unit_of_time;
use plotters::prelude::RGBColor;

use super::sheet::{BLUE, GREY, RED};
pub(super) use asperity_numbers::rupture_selector::{
    Film, RuptureSelector, Sort, before_first_global_slip, end_s, no_ruptures, picked, sorted,
};

/// The colour of ruptures of a kind.
pub(super) fn color_of(sort: Sort) -> RGBColor {
    match sort {
        Sort::Other => GREY,
        Sort::Precursor => BLUE,
        Sort::GlobalSlip => RED,
    }
}

/// Times of a rupture, by default that of the most contacts, up to `to_s` after the onset.
pub(super) fn film(
    rupture: Option<u64>,
    which: Option<RuptureSelector>,
    count: u32,
    to_s: Option<f64>,
) -> Result<Film, String> {
    match to_s.filter(|to_s| !(to_s.is_finite() && *to_s > 0.0)) {
        Some(to_s) => Err(format!("to_s: {to_s} is not accepted (accepted: a number above 0)")),
        None => {
            let which = which.unwrap_or(RuptureSelector::Widest);
            Ok(Film { rupture, which, count, until_s: to_s, between_s: None })
        }
    }
}

/// A time axis in the unit that suits its length, and from the beginning of a short one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    origin_s: f64,
    unit_s: f64,
    pub(super) unit: &'static str,
    /// The time that it counts from, as it is called behind the quantity; empty for the start of the run.
    since: String,
}

/// Seconds are counted from the beginning where the way there is this many times as long.
const FAR: f64 = 1e4;

impl Clock {
    /// For times between these; counted from `origin_s` where the way there is much longer.
    pub(super) fn of(from_s: f64, to_s: f64, origin_s: f64) -> Clock {
        let span_s = to_s - from_s;
        let units =
            [(5e-4, 1e-6, "µs"), (0.5, 1e-3, "ms")].into_iter().find(|(until_s, ..)| span_s < *until_s);
        let (unit_s, unit) = units.map_or_else(|| unit_of_time(span_s), |(_, unit_s, unit)| (unit_s, unit));
        if from_s.abs() < 2.0 * span_s || unit_s >= 1.0 && from_s.abs() < FAR * span_s {
            return Clock { origin_s: 0.0, unit_s, unit, since: String::new() };
        }
        // As many digits as the span needs; what is printed is what is subtracted.
        let decimals = (2.0 - span_s.log10()).ceil().clamp(0.0, 12.0) as usize;
        let printed = format!("{origin_s:.decimals$}");
        let origin_s = printed.parse().unwrap_or(origin_s);
        Clock { origin_s, unit_s, unit, since: format!(" − {printed} s") }
    }

    /// What an axis of a quantity is called.
    pub(super) fn label(&self, quantity: &str) -> String {
        format!("{quantity}{} ({})", self.since, self.unit)
    }

    /// Where a time stands on the axis.
    pub(super) fn place(&self, time_s: f64) -> f64 {
        (time_s - self.origin_s) / self.unit_s
    }
}

#[cfg(test)]
mod tests {
    use super::Clock;

    #[test]
    fn a_short_time_long_after_the_start_is_counted_from_its_beginning() {
        assert_eq!(Clock::of(0.0, 5.0, 0.0).label("t"), "t (s)");
        assert_eq!(Clock::of(3.0, 4.0, 3.0).label("t"), "t (s)");
        assert_eq!(Clock::of(0.0, 0.02, 0.0).label("t"), "t (ms)");
        assert_eq!(Clock::of(0.0, 1e9, 0.0).label("t"), "t (years)");
        assert_eq!(Clock::of(6e9, 6e9 + 100.0, 6e9).label("t"), "t − 6000000000 s (s)");
        let clock = Clock::of(2.648, 2.652, 2.648_131_7);
        assert_eq!(clock.label("t"), "t − 2.64813 s (ms)");
        assert!((clock.place(2.649_13) - 1.0).abs() < 1e-9);
        assert_eq!(Clock::of(1.0, 1.000_001, 1.0).label("t"), "t − 1.000000000 s (µs)");
    }
}
