//! Differences between two runs beside their events: the keys of their scenarios, and their headers.

use std::collections::BTreeSet;

use asperity_model::scenario::text::keys_of;
use asperity_record::{RunHeader, unit_of};
use serde_json::Value as Json;
use toml::Value;

use crate::report::{NumberChange, ProvenanceChange, SettingChange};

/// Prefixes of keys that do not affect the motion: names, detection, recording, and the duration of the
/// run.
const OUTSIDE_THE_MOTION: [&str; 6] =
    ["name", "summary", "parameter_set", "detection.", "recording.", "time.duration_s"];

/// Provenance of a run, from its log.
#[derive(Debug, Clone, PartialEq)]
pub struct Provenance {
    /// Its header.
    pub header: RunHeader,
    /// Its resolved scenario, as TOML.
    pub scenario_toml: String,
}

impl Provenance {
    /// How long the run is, s.
    pub fn duration_s(&self) -> f64 {
        self.header.time_grid().time_s(self.header.steps)
    }
}

/// Differences between two runs: the keys of the resolved scenarios that were set differently, first those that
/// shape the motion; and all changes, first the program and its settings, then the scenario's keys. Numbers
/// that follow from scenario and program, such as hashes, are left out.
///
/// # Errors
/// If a scenario is no TOML.
pub fn between(
    sides: [&Provenance; 2],
) -> Result<(Vec<SettingChange>, Vec<ProvenanceChange>), toml::de::Error> {
    let of_header = |header: &RunHeader| {
        [
            ("code_version", header.code_version.clone()),
            ("solver", header.solver.clone()),
            ("parameter_set", header.parameter_set.clone()),
            ("record_schema_version", header.record_schema_version.to_string()),
        ]
    };
    let [old, new] = sides.map(|side| of_header(&side.header));
    let mut changes: Vec<ProvenanceChange> = old
        .into_iter()
        .zip(new)
        .filter(|(old, new)| old != new)
        .map(|((key, old), (_, new))| ProvenanceChange {
            key: key.to_owned(),
            old: Some(old),
            new: Some(new),
        })
        .collect();
    // The description of a recording has other keys than a scenario.
    let [old, new] = sides.map(|side| side.header.sensors.is_some());
    if old != new {
        return Ok((Vec::new(), changes));
    }
    let [old, new] = [keys_of(&sides[0].scenario_toml)?, keys_of(&sides[1].scenario_toml)?];
    let names: BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let mut settings = Vec::new();
    for name in names.into_iter().filter(|name| old.get(*name) != new.get(*name)) {
        let sides = [old.get(name), new.get(name)];
        // JSON has no non-finite numbers and no dates: both become null, like missing values.
        let [old, new] =
            sides.map(|value| value.and_then(|value| serde_json::to_value(value).ok()).unwrap_or(Json::Null));
        settings.push(SettingChange {
            change: NumberChange::between(name, &old, &new),
            unit: unit_of(name).filter(|unit| *unit != "1"),
            shapes_motion: !OUTSIDE_THE_MOTION.iter().any(|outside| match outside.ends_with('.') {
                true => name.starts_with(outside),
                false => name == outside,
            }),
        });
        let [old, new] = sides.map(|value| value.map(Value::to_string));
        changes.push(ProvenanceChange { key: format!("scenario: {name}"), old, new });
    }
    settings.sort_by_key(|setting| !setting.shapes_motion);
    Ok((settings, changes))
}

#[cfg(test)]
mod tests {
    use asperity_record::RunHeader;
    use asperity_testkit::run_header;

    use super::{Provenance, between};

    fn provenance(solver: &str, scenario_toml: &str) -> Provenance {
        Provenance {
            header: RunHeader { solver: solver.to_owned(), ..run_header() },
            scenario_toml: scenario_toml.to_owned(),
        }
    }

    #[test]
    fn what_differs_is_named_with_both_values() {
        let old = provenance("fast", "a = 1\n[b]\nc = 2.5\nonly_old = true\n");
        let new = provenance("plain", "a = 1\nb = { c = 2.6, only_new = [1, 2] }\n");
        let found: Vec<(String, Option<String>, Option<String>)> = between([&old, &new])
            .unwrap()
            .1
            .into_iter()
            .map(|change| (change.key, change.old, change.new))
            .collect();
        let some = |text: &str| Some(text.to_owned());
        assert_eq!(
            found,
            [
                ("solver".to_owned(), some("fast"), some("plain")),
                ("scenario: b.c".to_owned(), some("2.5"), some("2.6")),
                ("scenario: b.only_new".to_owned(), None, some("[1, 2]")),
                ("scenario: b.only_old".to_owned(), some("true"), None),
            ]
        );
        assert_eq!(between([&old, &old]).unwrap(), (Vec::new(), Vec::new()));
    }

    #[test]
    fn settings_have_both_values_their_unit_and_what_shapes_the_motion_comes_first() {
        let old =
            provenance("fast", "name = \"a\"\n[drive]\nstiffness_n_per_m = 2.0\n[friction]\nlaw = \"x\"\n");
        let new = provenance("fast", "name = \"b\"\n[drive]\nstiffness_n_per_m = 3.0\n");
        let (found, _) = between([&old, &new]).unwrap();
        let keys: Vec<(&str, bool)> =
            found.iter().map(|setting| (&*setting.change.key, setting.shapes_motion)).collect();
        assert_eq!(keys, [("drive.stiffness_n_per_m", true), ("friction.law", true), ("name", false)]);
        assert_eq!((found[0].unit, found[0].change.relative_change), (Some("N/m"), Some(0.5)));
        assert_eq!((found[1].unit, found[1].change.new.is_null()), (None, true));
    }
}
