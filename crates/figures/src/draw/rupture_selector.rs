//! What kinds of ruptures there are, which one a figure shows, and a time axis about it.

use asperity_numbers::precursors::{PrecursorRules, among_ruptures};
use asperity_numbers::run_data::RunData;
use asperity_record::Rupture;
use plotters::prelude::RGBColor;
use schemars::JsonSchema;
use serde::Deserialize;

use super::plot::{BLUE, GREY, RED};

/// Which rupture, where no number is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(super) enum RuptureSelector {
    /// The first that reaches every block.
    FirstGlobalSlip,
    /// The precursor that reaches farthest.
    LongestPrecursor,
    /// That of the most blocks, the first of several.
    Widest,
}

/// What kind of rupture it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Sort {
    Other,
    Precursor,
    GlobalSlip,
}

impl Sort {
    pub(super) const ALL: [Sort; 3] = [Sort::Precursor, Sort::GlobalSlip, Sort::Other];

    pub(super) fn color(self) -> RGBColor {
        match self {
            Sort::Other => GREY,
            Sort::Precursor => BLUE,
            Sort::GlobalSlip => RED,
        }
    }

    pub(super) fn label(self) -> &'static str {
        match self {
            Sort::Other => "other rupture",
            Sort::Precursor => "precursor",
            Sort::GlobalSlip => "global slip",
        }
    }
}

/// Why figures of ruptures cannot be drawn of a run without any list of them.
pub(super) fn no_ruptures(run: &RunData) -> String {
    format!("the log of run {} has no ruptures: it is of an older version", run.name)
}

/// The ruptures of a run by onset, each with its kind.
pub(super) fn sorted(run: &RunData) -> Result<Vec<(&Rupture, Sort)>, String> {
    if run.ruptures.is_none() {
        return Err(no_ruptures(run));
    }
    let farther = among_ruptures(run, &PrecursorRules::default());
    let sort = |rupture: &Rupture| match (rupture.reached_every_block, is_among(&farther, rupture)) {
        (true, _) => Sort::GlobalSlip,
        (false, true) => Sort::Precursor,
        (false, false) => Sort::Other,
    };
    Ok(run.ruptures_by_onset().into_iter().map(|rupture| (rupture, sort(rupture))).collect())
}

/// How many of them, by onset, come before the first global slip: until then the load rises and
/// ruptures grow, so that neither sizes nor times are draws from one law. None without a global slip.
pub(super) fn before_first_global_slip(sorted: &[(&Rupture, Sort)]) -> Option<usize> {
    sorted.iter().position(|(_, sort)| *sort == Sort::GlobalSlip)
}

fn is_among(ruptures: &[&Rupture], rupture: &Rupture) -> bool {
    // By onset, as these are.
    let place = |other: &&Rupture| (other.onset_step, other.rupture);
    ruptures.binary_search_by_key(&place(&rupture), place).is_ok()
}

/// The rupture that a figure is about: that with the number, or of the kind.
pub(super) fn picked(
    run: &RunData,
    number: Option<u64>,
    which: Option<RuptureSelector>,
) -> Result<Option<&Rupture>, String> {
    let all = sorted(run)?;
    if let Some(number) = number {
        let found = all.iter().find(|(rupture, _)| rupture.rupture == number);
        return found.map(|(rupture, _)| Some(*rupture)).ok_or_else(|| {
            let accepted = match all.len() {
                0 => "it has none".to_owned(),
                count => format!("accepted: 0 to {}", count - 1),
            };
            format!("run {} has no rupture {number} ({accepted})", run.name)
        });
    }
    let of = |sort: Sort| all.iter().filter(move |(_, of)| *of == sort).map(|(rupture, _)| *rupture);
    match which {
        None => Ok(None),
        Some(RuptureSelector::FirstGlobalSlip) => match of(Sort::GlobalSlip).next() {
            Some(rupture) => Ok(Some(rupture)),
            None => Err(format!("run {} has no global slip", run.name)),
        },
        Some(RuptureSelector::Widest) => {
            // Of several `max_by_key` would take the last.
            let widest =
                all.iter().rev().map(|(rupture, _)| *rupture).max_by_key(|rupture| rupture.reach().count());
            widest.map(Some).ok_or_else(|| format!("run {} has no ruptures", run.name))
        }
        // Each reaches farther than all before.
        Some(RuptureSelector::LongestPrecursor) => match of(Sort::Precursor).next_back() {
            Some(rupture) => Ok(Some(rupture)),
            None => Err(format!("run {} has no precursor", run.name)),
        },
    }
}

/// The first step after a rupture, or the end of the run.
pub(super) fn end_s(run: &RunData, rupture: &Rupture) -> f64 {
    rupture.end_s.unwrap_or_else(|| run.plan.grid.time_s(run.header.steps))
}

/// A time axis in the unit that suits its length, and from the beginning of a short one.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Clock {
    origin_s: f64,
    unit_s: f64,
    pub(super) label: String,
}

impl Clock {
    /// For times between these; counted from `origin_s` where the way there is much longer.
    pub(super) fn of(from_s: f64, to_s: f64, origin_s: f64) -> Clock {
        let span_s = to_s - from_s;
        let (unit_s, unit) = match span_s {
            span if span < 5e-4 => (1e-6, "µs"),
            span if span < 0.5 => (1e-3, "ms"),
            _ => (1.0, "s"),
        };
        if from_s.abs() < 2.0 * span_s || unit_s == 1.0 {
            return Clock { origin_s: 0.0, unit_s, label: format!("t ({unit})") };
        }
        // As many digits as the span needs; what is printed is what is subtracted.
        let decimals = (2.0 - span_s.log10()).ceil().clamp(0.0, 12.0) as usize;
        let printed = format!("{origin_s:.decimals$}");
        let origin_s = printed.parse().unwrap_or(origin_s);
        Clock { origin_s, unit_s, label: format!("t − {printed} s ({unit})") }
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
        assert_eq!(Clock::of(0.0, 5.0, 0.0).label, "t (s)");
        assert_eq!(Clock::of(3.0, 4.0, 3.0).label, "t (s)");
        assert_eq!(Clock::of(0.0, 0.02, 0.0).label, "t (ms)");
        let clock = Clock::of(2.648, 2.652, 2.648_131_7);
        assert_eq!(clock.label, "t − 2.64813 s (ms)");
        assert!((clock.place(2.649_13) - 1.0).abs() < 1e-9);
        assert_eq!(Clock::of(1.0, 1.000_001, 1.0).label, "t − 1.000000000 s (µs)");
    }
}
