//! What kinds of ruptures there are, and which of them a figure shows.

use asperity_record::Rupture;

use crate::precursors::{PrecursorRules, among_ruptures};
pub use crate::required_data::{Film, RuptureSelector};
use crate::run_data::RunEvents;

/// What kind of rupture it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    /// Neither of the two below.
    Other,
    /// It begins at block 1 and reaches farther than all before.
    Precursor,
    /// It reaches every block.
    GlobalSlip,
}

impl Sort {
    /// Its name.
    pub fn label(self) -> &'static str {
        match self {
            Sort::Other => "other rupture",
            Sort::Precursor => "precursor",
            Sort::GlobalSlip => "global slip",
        }
    }
}

/// Why figures of ruptures cannot be drawn of a run without any list of them.
pub fn no_ruptures(run: &RunEvents) -> String {
    format!("the log of run {} has no ruptures: other detectors wrote it", run.name)
}

/// The ruptures of a run by onset, each with its kind.
///
/// # Errors
/// In words, if its log has no list of ruptures.
pub fn sorted(run: &RunEvents) -> Result<Vec<(&Rupture, Sort)>, String> {
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
pub fn before_first_global_slip(sorted: &[(&Rupture, Sort)]) -> Option<usize> {
    sorted.iter().position(|(_, sort)| *sort == Sort::GlobalSlip)
}

fn is_among(ruptures: &[&Rupture], rupture: &Rupture) -> bool {
    // By onset, as these are.
    let place = |other: &&Rupture| (other.onset_step, other.rupture);
    ruptures.binary_search_by_key(&place(&rupture), place).is_ok()
}

/// The rupture that a figure is about: that with the number, or of the kind.
///
/// # Errors
/// In words, if the run has no such rupture.
pub fn picked(
    run: &RunEvents,
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
    let all = all.iter().map(|(rupture, _)| *rupture);
    let (found, what) = match which {
        None => return Ok(None),
        Some(RuptureSelector::FirstGlobalSlip) => (of(Sort::GlobalSlip).next(), "global slip"),
        // Of several `max_by_key` would take the last.
        Some(RuptureSelector::Widest) => (all.rev().max_by_key(|rupture| rupture.slipped()), "ruptures"),
        // Each reaches farther than all before.
        Some(RuptureSelector::LongestPrecursor) => (of(Sort::Precursor).next_back(), "precursor"),
    };
    found.map(Some).ok_or_else(|| format!("run {} has no {what}", run.name))
}

/// The first step after a rupture, or the end of the run.
pub fn end_s(run: &RunEvents, rupture: &Rupture) -> f64 {
    rupture.end_s.unwrap_or_else(|| run.plan.grid.time_s(run.header.steps))
}

/// The longest part of a run, as a share of it, of which states are computed again.
const LONGEST_PART: f64 = 0.02;

impl Film {
    /// The rupture.
    ///
    /// # Errors
    /// In words, if the run has no such rupture.
    pub fn rupture<'a>(&self, run: &'a RunEvents) -> Result<&'a Rupture, String> {
        let found = picked(run, self.rupture, Some(self.which))?;
        found.ok_or_else(|| format!("run {} has no ruptures", run.name))
    }

    /// The times, s: the middles of equal spans, because nothing moves at the very onset and at the end. None of more
    /// than 2 % of a run: a part that is named by its ends may be nearly all of it.
    ///
    /// # Errors
    /// In words, if the run has no such rupture.
    pub fn times_s(&self, run: &RunEvents) -> Result<Vec<f64>, String> {
        // None after the last step.
        let last_s = run.plan.grid.time_s(run.header.steps);
        let (from_s, until_s) = match self.between_s {
            Some([from_s, to_s]) if to_s - from_s > LONGEST_PART * last_s => return Ok(Vec::new()),
            Some([from_s, to_s]) => (from_s, to_s - from_s),
            None => {
                let rupture = self.rupture(run)?;
                let natural_s = || end_s(run, rupture) - rupture.onset_s;
                (rupture.onset_s, self.until_s.unwrap_or_else(natural_s))
            }
        };
        let share = |n: u32| (f64::from(n) + 0.5) / f64::from(self.count);
        Ok((0..self.count).map(|n| (from_s + share(n) * until_s).min(last_s)).collect())
    }
}
