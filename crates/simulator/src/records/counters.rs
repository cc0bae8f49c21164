//! Counts of how a solver took the steps of a run.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Add;

use serde::{Deserialize, Serialize};

/// Counts of a solver's work.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Counters {
    /// Steps taken singly.
    pub plain_steps: u64,
    /// Jumps over stick phases.
    pub jumps: u64,
    /// Steps covered by jumps.
    pub jump_steps: u64,
    /// Times that all blocks were stuck and no jump long enough to pay was certified.
    pub refused_jumps: u64,
    /// Windows taken.
    pub windows: u64,
    /// Steps covered by windows.
    pub window_steps: u64,
    /// Times that no window was certified, or none was expected to pay.
    pub refused_windows: u64,
    /// Differences and terms computed for windows, refused ones included; each costs less than a plain
    /// step.
    pub applications: u64,
    /// Block switches.
    pub switches: u64,
    /// Steps in which a contact of a slab or a body had lifted off, summed over the contacts.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub contact_steps_in_air: u64,
    /// Steps of varying length that the adaptive solver took.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub adaptive_steps: u64,
    /// Steps of varying length whose error was too large.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rejected_steps: u64,
    /// Steps of the grid that the accepted ones cover.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub covered_steps: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// Bound on those counts of work that no number of steps bounds, so that their sums do not overflow.
const MOST_COUNTED: u64 = 1 << 48;

impl Counters {
    /// Whether these can be the counts of a run of `steps` steps. Counts from a file must pass before
    /// anything is added to them.
    pub fn fit(&self, steps: u64) -> bool {
        let of_steps = [self.plain_steps, self.jump_steps, self.window_steps, self.covered_steps];
        let others = [
            self.jumps,
            self.refused_jumps,
            self.windows,
            self.refused_windows,
            self.applications,
            self.switches,
            self.adaptive_steps,
            self.rejected_steps,
        ];
        of_steps.into_iter().try_fold(0, u64::checked_add) == Some(steps)
            && others.into_iter().all(|count| count <= MOST_COUNTED)
    }

    /// Steps taken in all, singly or in leaps.
    pub fn steps(&self) -> u64 {
        self.plain_steps + self.jump_steps + self.window_steps + self.covered_steps
    }

    /// All counts by name; of the adaptive solver, those that it has.
    pub fn by_name(&self) -> BTreeMap<String, u64> {
        let counts = serde_json::to_value(self).and_then(serde_json::from_value::<BTreeMap<String, u64>>);
        let mut counts = counts.expect("counts are numbers with names");
        if self.covered_steps > 0 {
            let its_own = ["adaptive_steps", "rejected_steps", "switches"];
            counts = its_own.map(|name| (name.to_owned(), counts.get(name).copied().unwrap_or(0))).into();
        }
        counts.insert("steps".to_owned(), self.steps());
        counts
    }
}

impl Add for Counters {
    type Output = Counters;

    fn add(self, other: Counters) -> Counters {
        Counters {
            plain_steps: self.plain_steps + other.plain_steps,
            jumps: self.jumps + other.jumps,
            jump_steps: self.jump_steps + other.jump_steps,
            refused_jumps: self.refused_jumps + other.refused_jumps,
            windows: self.windows + other.windows,
            window_steps: self.window_steps + other.window_steps,
            refused_windows: self.refused_windows + other.refused_windows,
            applications: self.applications + other.applications,
            switches: self.switches + other.switches,
            contact_steps_in_air: self.contact_steps_in_air + other.contact_steps_in_air,
            adaptive_steps: self.adaptive_steps + other.adaptive_steps,
            rejected_steps: self.rejected_steps + other.rejected_steps,
            covered_steps: self.covered_steps + other.covered_steps,
        }
    }
}

impl fmt::Display for Counters {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = |f: &mut fmt::Formatter<'_>, what: &str, count: u64, of: &str| {
            let text = format!("  {what:<20}{count:>12}  {of}");
            writeln!(f, "{}", text.trim_end())
        };
        let each = |steps: u64, times: u64| match steps.checked_div(times) {
            Some(mean) => format!("{times} of {mean} on average"),
            None => String::new(),
        };
        if self.covered_steps > 0 {
            line(f, "steps", self.adaptive_steps, "of varying length")?;
            line(f, "block switches", self.switches, "")?;
            return line(f, "rejected steps", self.rejected_steps, "their error was too large");
        }
        line(f, "steps", self.steps(), "")?;
        line(f, "in jumps", self.jump_steps, &each(self.jump_steps, self.jumps))?;
        line(f, "in windows", self.window_steps, &each(self.window_steps, self.windows))?;
        line(f, "one by one", self.plain_steps, "")?;
        line(f, "block switches", self.switches, "")?;
        if self.contact_steps_in_air > 0 {
            line(f, "contacts in the air", self.contact_steps_in_air, "steps, summed over the contacts")?;
        }
        line(f, "applications", self.applications, "of a step's map, to open windows")?;
        line(f, "refused jumps", self.refused_jumps, "all blocks stuck, but too briefly")?;
        line(f, "refused windows", self.refused_windows, "single steps instead")
    }
}

#[cfg(test)]
mod tests {
    use super::Counters;

    #[test]
    fn counts_of_a_file_are_of_its_steps_and_can_be_added_to() {
        let counters = Counters { plain_steps: 3, jump_steps: 4, jumps: 1, ..Counters::default() };
        assert!(counters.fit(7) && !counters.fit(8));
        assert!(!Counters { window_steps: u64::MAX, ..counters }.fit(6), "the sum wraps around");
        for many in
            [Counters { switches: u64::MAX, ..counters }, Counters { applications: u64::MAX, ..counters }]
        {
            assert!(!many.fit(7), "{many}");
        }
    }
}
