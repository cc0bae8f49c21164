//! The metadata of a figure: in its files, and in a line at its foot.

use std::collections::BTreeSet;

use asperity_record::RunHeader;

use crate::draw::scale::number;

/// Where the runs that a figure shows come from.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origins {
    scenarios: BTreeSet<String>,
    parameter_sets: BTreeSet<String>,
    /// As bits, in seconds.
    time_steps: BTreeSet<u64>,
    code_versions: BTreeSet<String>,
    /// What of that varies from run to run in ways that are not listed.
    varies: BTreeSet<String>,
}

impl Origins {
    /// Of a run: its scenario, parameter set, time step in s, and the version of the code that made it.
    pub fn of(scenario: &str, parameter_set: &str, time_step_s: f64, code_version: &str) -> Origins {
        Origins {
            scenarios: BTreeSet::from([scenario.to_owned()]),
            parameter_sets: BTreeSet::from([parameter_set.to_owned()]),
            time_steps: BTreeSet::from([time_step_s.to_bits()]),
            code_versions: BTreeSet::from([code_version.to_owned()]),
            varies: BTreeSet::new(),
        }
    }

    /// Of a run with this header.
    pub(crate) fn of_run(header: &RunHeader) -> Origins {
        Origins::of(&header.scenario, &header.parameter_set, header.time_step_s, &header.code_version)
    }

    /// Adds the scenario keys in which the runs differ.
    #[must_use]
    pub fn varying<S: Into<String>>(mut self, keys: impl IntoIterator<Item = S>) -> Origins {
        self.varies.extend(keys.into_iter().map(Into::into));
        if self.varies.contains("time.step_s") {
            self.time_steps.clear();
        }
        if self.varies.contains("parameter_set") {
            self.parameter_sets.clear();
        }
        self
    }

    /// Those of both.
    pub(crate) fn add(&mut self, other: &Origins) {
        self.scenarios.extend(other.scenarios.iter().cloned());
        self.parameter_sets.extend(other.parameter_sets.iter().cloned());
        self.time_steps.extend(&other.time_steps);
        self.code_versions.extend(other.code_versions.iter().cloned());
        self.varies.extend(other.varies.iter().cloned());
    }
}

/// Names of more scenarios than these are counted, at the foot.
const MOST_NAMED: usize = 3;

/// How much of a code version stands at the foot.
const SHORT: usize = 12;

/// The metadata of a figure.
#[derive(Debug, Clone, Default)]
pub(crate) struct About {
    pub(crate) title: String,
    /// What it shows, in words.
    pub(crate) caption: String,
    pub(crate) origins: Origins,
    /// Whether it names the code, and bears a line at its foot.
    pub(crate) provenance: bool,
}

impl About {
    /// What stands in the files beside title and caption, each with its name.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let Origins { scenarios, parameter_sets, time_steps, code_versions, varies } = &self.origins;
        let steps: Vec<String> =
            time_steps.iter().map(|bits| format!("{:e} s", f64::from_bits(*bits))).collect();
        let mut facts = vec![
            ("software", "Asperity".to_owned()),
            ("scenario", list(scenarios)),
            ("parameter-set", list(parameter_sets)),
            ("time-step", steps.join(", ")),
            ("varies", list(varies)),
        ];
        if self.provenance {
            facts.push(("code-version", list(code_versions)));
        }
        facts.retain(|(_, value)| !value.is_empty());
        facts
    }

    /// The line at the foot, if it is to have one.
    pub(crate) fn foot(&self) -> Option<String> {
        let Origins { scenarios, parameter_sets, time_steps, code_versions, varies } = &self.origins;
        let scenarios = match scenarios.len() {
            0..=MOST_NAMED => list(scenarios),
            many => format!("{many} scenarios"),
        };
        let steps: Vec<String> = time_steps.iter().map(|bits| number(f64::from_bits(*bits))).collect();
        let steps = match &steps[..] {
            [first, .., last] => format!("{first} to {last}"),
            few => few.concat(),
        };
        let codes = code_versions.iter().map(|version| version.chars().take(SHORT).collect()).collect();
        let said = [
            ("", scenarios, ""),
            ("", list(parameter_sets), ""),
            ("Δt = ", steps, " s"),
            ("", list(varies), " varied"),
            ("code ", list(&codes), ""),
        ];
        let said = said.into_iter().filter(|(_, what, _)| !what.is_empty());
        let parts: Vec<String> =
            said.map(|(before, what, behind)| format!("{before}{what}{behind}")).collect();
        // Underscores in names are letters.
        let line = parts.join(" · ").replace('_', "\\_");
        (self.provenance && !line.is_empty()).then_some(line)
    }
}

fn list(all: &BTreeSet<String>) -> String {
    all.iter().map(String::as_str).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::{About, Origins};

    #[test]
    fn a_figure_says_where_its_runs_come_from() {
        let mut origins = Origins::of("default", "as-coded", 1e-8, "0123456789abcdef");
        origins.add(&Origins::of("front", "as-coded", 2.5e-9, "0123456789abcdef"));
        let about = About { origins, provenance: true, ..About::default() };
        let foot = "default, front · as-coded · Δt = 2.5·10^{−9} to 10^{−8} s · code 0123456789ab";
        assert_eq!(about.foot().unwrap(), foot);
        let word = |about: &About, word: &str| {
            about.facts().into_iter().find(|(known, _)| *known == word).map(|(_, value)| value)
        };
        assert_eq!(word(&about, "code-version").unwrap(), "0123456789abcdef");
        assert_eq!(word(&about, "time-step").unwrap(), "2.5e-9 s, 1e-8 s");
        let without = About { provenance: false, ..about };
        assert_eq!((without.foot(), word(&without, "code-version")), (None, None));
        assert_eq!(word(&without, "scenario").unwrap(), "default, front");
    }

    #[test]
    fn what_varies_has_no_one_value() {
        let origins = Origins::of("default", "as-coded", 1e-8, "a").varying(["time.step_s"]);
        let about = About { origins, provenance: true, ..About::default() };
        assert_eq!(about.foot().unwrap(), "default · as-coded · time.step\\_s varied · code a");
    }
}
