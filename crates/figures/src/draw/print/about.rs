//! The metadata of a figure: in its files, and in a line at its foot.

use std::collections::{BTreeMap, BTreeSet};

use asperity_model::scenario::keys::AS_CODED;
use asperity_record::RunHeader;

use crate::draw::Caption;
use crate::draw::scale::number;

/// Where the runs that a figure shows come from: the values of each fact about them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Origins(BTreeMap<&'static str, BTreeSet<String>>);

/// The facts about runs.
const SCENARIO: &str = "scenario";
const PARAMETER_SET: &str = "parameter-set";
const TIME_STEP: &str = "time-step";
const VARIES: &str = "varies";
const CODE_VERSION: &str = "code-version";

impl Origins {
    /// Of a run: its scenario, parameter set, time step in s, and the version of the code that made it.
    pub fn of(scenario: &str, parameter_set: &str, time_step_s: f64, code_version: &str) -> Origins {
        let time_step = format!("{time_step_s:e} s");
        let values = [scenario, parameter_set, &time_step, code_version];
        let facts = [SCENARIO, PARAMETER_SET, TIME_STEP, CODE_VERSION].into_iter().zip(values);
        Origins(facts.map(|(fact, value)| (fact, BTreeSet::from([value.to_owned()]))).collect())
    }

    /// Of a run with this header.
    pub(crate) fn of_run(header: &RunHeader) -> Origins {
        Origins::of(&header.scenario, &header.parameter_set, header.time_step_s, &header.code_version)
    }

    /// Adds the scenario keys in which the runs differ.
    #[must_use]
    pub fn varying<S: Into<String>>(mut self, keys: impl IntoIterator<Item = S>) -> Origins {
        for key in keys.into_iter().map(Into::into) {
            match key.as_str() {
                "time.step_s" => self.0.remove(TIME_STEP),
                "parameter_set" => self.0.remove(PARAMETER_SET),
                _ => None,
            };
            self.0.entry(VARIES).or_default().insert(key);
        }
        self
    }

    /// Those of both.
    pub(crate) fn add(&mut self, other: &Origins) {
        for (fact, values) in &other.0 {
            self.0.entry(fact).or_default().extend(values.iter().cloned());
        }
    }

    /// The values of a fact, in ascending order.
    fn values(&self, fact: &str) -> Vec<&str> {
        let mut values: Vec<&str> = self.0.get(fact).into_iter().flatten().map(String::as_str).collect();
        if fact == TIME_STEP {
            values.sort_by(|a, b| seconds(a).total_cmp(&seconds(b)));
        }
        values
    }
}

/// A time step as it was written.
fn seconds(time_step: &str) -> f64 {
    time_step.trim_end_matches(" s").parse().unwrap_or(f64::NAN)
}

/// Names of more scenarios than these are counted, at the foot.
const MOST_NAMED: usize = 3;

/// How much of a code version stands at the foot.
const SHORT: usize = 12;

/// The metadata of a figure.
#[derive(Debug, Clone, Default)]
pub(crate) struct About {
    pub(crate) words: Caption,
    pub(crate) origins: Origins,
    /// Whether it names the code, and bears a line at its foot.
    pub(crate) provenance: bool,
}

impl About {
    /// What stands in the files beside title and caption, each with its name.
    pub(super) fn facts(&self) -> Vec<(&'static str, String)> {
        let code = self.provenance.then_some(CODE_VERSION);
        let facts = [SCENARIO, PARAMETER_SET, TIME_STEP, VARIES].into_iter().chain(code);
        let facts = facts.map(|fact| (fact, self.origins.values(fact).join(", ")));
        let known = facts.filter(|(_, values)| !values.is_empty());
        std::iter::once(("software", "Asperity".to_owned())).chain(known).collect()
    }

    /// The line at the foot, if it is to have one.
    pub(crate) fn foot(&self) -> Option<String> {
        let values = |fact| self.origins.values(fact);
        let scenarios = match values(SCENARIO) {
            few if few.len() <= MOST_NAMED => few.join(", "),
            many => format!("{} scenarios", many.len()),
        };
        let steps: Vec<String> = values(TIME_STEP).into_iter().map(|step| number(seconds(step))).collect();
        let steps = match &steps[..] {
            [first, .., last] => format!("{first} to {last}"),
            few => few.concat(),
        };
        let codes = values(CODE_VERSION).into_iter().map(|version| version.get(..SHORT).unwrap_or(version));
        let codes: BTreeSet<&str> = codes.collect();
        let sets = Some(values(PARAMETER_SET)).filter(|sets| sets.contains(&AS_CODED)).unwrap_or_default();
        let said = [
            ("", scenarios, ""),
            ("", sets.join(", "), ""),
            ("Δt = ", steps, " s"),
            ("", values(VARIES).join(", "), " varied"),
            ("code ", codes.into_iter().collect::<Vec<_>>().join(", "), ""),
        ];
        let said = said.into_iter().filter(|(_, what, _)| !what.is_empty());
        let parts: Vec<String> =
            said.map(|(before, what, behind)| format!("{before}{what}{behind}")).collect();
        // Underscores in names are letters.
        let line = parts.join(" · ").replace('_', "\\_");
        (self.provenance && !line.is_empty()).then_some(line)
    }
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
        let origins = Origins::of("default", "as-stated", 1e-8, "a").varying(["time.step_s"]);
        let about = About { origins, provenance: true, ..About::default() };
        assert_eq!(about.foot().unwrap(), "default · time.step\\_s varied · code a");
    }
}
