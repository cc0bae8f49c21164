//! Keys that only some friction laws use. Other laws fix what such a key would choose; a scenario
//! that sets it to anything else is refused, because the value would have no effect. A law may also have a default
//! of its own for a key of all laws.

use toml::Value;

use crate::defaults::insert;
use crate::keys::KEYS;
use crate::laws::FrictionLaw;
use crate::source::{Entries, LayerKind, ScenarioError};

/// A key that only some laws use.
struct LawKey {
    path: &'static str,
    /// The behaviour of laws without the key, if it differs from the key's default.
    elsewhere: Option<&'static str>,
}

/// The keys that only some laws use.
fn law_keys() -> impl Iterator<Item = LawKey> {
    let mut paths: Vec<&str> = Vec::new();
    for path in FrictionLaw::ALL.iter().flat_map(|law| law.keys()) {
        if !paths.contains(&path) {
            paths.push(path);
        }
    }
    // Without the key a block stops where its velocity changes sign.
    let elsewhere = |path| (path == "friction.reattach").then_some("two-way");
    paths.into_iter().map(move |path| LawKey { path, elsewhere: elsewhere(path) })
}

impl LawKey {
    /// The value of the key under laws that do not use it.
    fn idle(&self) -> Value {
        let key = KEYS.iter().find(|key| key.path == self.path).expect("it is in the key table");
        let default = || key.default_in(true).expect("keys of friction have defaults").to_toml();
        self.elsewhere.map_or_else(default, |word| Value::String(word.to_owned()))
    }

    fn is_of(&self, law: FrictionLaw) -> bool {
        law.uses(self.path)
    }

    /// The laws that use it, in the order of the key table: `friction.law = "..."`.
    fn laws(&self) -> String {
        let laws = FrictionLaw::ALL.iter().filter(|law| self.is_of(**law));
        let words: Vec<String> = laws.map(|law| format!("{:?}", law.word())).collect();
        format!("friction.law = {}", words.join(" or "))
    }
}

/// The start of a run without a key, by laws that have a default of their own.
const START: &str = "time.start";

/// Whether the law brings a default of its own for the key, and which.
fn own_default(path: &str, law: FrictionLaw) -> Option<Value> {
    (path == START && !law.sticks()).then(|| Value::String("loaded".to_owned()))
}

/// Sets keys that the law alone determines to the behaviour of the law, in a table with all keys. Other
/// values are refused in scenarios and ignored in logs.
pub(crate) fn settle(entries: &Entries, table: &mut toml::Table, errors: &mut Vec<ScenarioError>) {
    let law = text(table, "friction.law").expect("the law is a word").clone();
    let takes = FrictionLaw::ALL.iter().find(|known| law.as_str() == Some(known.word()));
    for key in law_keys().filter(|key| !takes.is_some_and(|law| key.is_of(*law))) {
        let (idle, written) = (key.idle(), entries.values.get(key.path));
        let found = text(table, key.path).expect("every key is there");
        if let Some(entry) = written.filter(|entry| *found != idle && entry.layer != LayerKind::Log) {
            let does = match key.elsewhere {
                Some(_) if takes.is_some_and(|law| law.holds()) => {
                    ", which stops a block where its velocity changes sign"
                }
                Some(_) if takes.is_some_and(|law| !law.sticks()) => ", by which nothing sticks",
                Some(_) => ", whose contacts stop whichever way they slid",
                None => "",
            };
            errors.push(ScenarioError {
                place: Some(entry.place.clone()),
                key: Some(key.path.to_owned()),
                problem: format!("{} has no meaning for friction.law = {law}{does}", entry.value),
                accepted: Some(format!("{idle}, or {}", key.laws())),
            });
        }
        insert(table, key.path, idle);
    }
    let of_law = takes.and_then(|law| own_default(START, *law));
    if let Some(start) = of_law.filter(|_| !entries.values.contains_key(START)) {
        insert(table, START, start);
    }
}

fn text<'a>(table: &'a toml::Table, path: &str) -> Option<&'a Value> {
    let (section, name) = path.split_once('.')?;
    table.get(section)?.get(name)
}

/// Whether a key has its value from this law: fixed to another than the key's default, or the law's own default.
pub(crate) fn is_decided_by_law(path: &str, law: FrictionLaw, value: &Value) -> bool {
    let is_fixed = law_keys().any(|key| key.path == path && key.elsewhere.is_some() && !key.is_of(law));
    is_fixed || own_default(path, law).as_ref() == Some(value)
}

#[cfg(test)]
mod tests {
    use super::law_keys;
    use crate::choices::Reattach;
    use crate::laws::FrictionLaw;
    use crate::{Scenario, ScenarioSource};

    /// A value for each key that differs from that of an unused key.
    fn other(path: &str) -> &'static str {
        match path {
            "friction.interfacial_stiffness_ratio" => "0.5",
            "friction.reattach" => "\"one-way\"",
            "friction.detach_by" => "\"spring\"",
            "friction.weakening_velocity_m_per_s" => "0.2",
            "friction.drag_at_rest" => "true",
            "friction.radiation_kg_per_s" => "3.5",
            "friction.ageing_coefficient" => "0.01",
            "friction.ageing_time_s" => "2.5",
            "friction.junction_count" => "50",
            "friction.junction_constant_n_per_m2" => "2.5",
            "friction.healing_time_s" => "0.001",
            "friction.healing_deviation_s" => "0.001",
            "friction.junction_width" => "0.1",
            "friction.junction_start" => "\"drawn\"",
            "friction.junction_seed" => "2",
            "friction.sliding_share" => "0.25",
            "friction.static_coefficient" => "0.8",
            "friction.dynamic_coefficient" => "0.3",
            "friction.static_offsets" | "friction.dynamic_offsets" | "friction.evolution_offsets" => "[0.01]",
            "friction.stuck_blocks" => "[1.0]",
            "friction.static_spread" | "friction.dynamic_spread" => "0.02",
            "disorder.stiffness_spread" => "0.5",
            "disorder.stiffness_offsets" => "[0.01]",
            "friction.direct_effect" => "0.02",
            "friction.evolution_effect" => "0.02",
            "friction.critical_slip_m" => "0.00001",
            "friction.reference_velocity_m_per_s" => "0.00001",
            "friction.reference_coefficient" => "0.5",
            "friction.evolution" => "\"slip\"",
            "friction.inertia" => "false",
            "friction.initial_kick" => "0.1",
            "friction.event_speed_m_per_s" => "0.01",
            "time.tolerance" => "0.000001",
            _ => panic!("{path} needs a value here"),
        }
    }

    #[test]
    fn keys_of_another_law_are_refused_and_passed_over_in_logs() {
        for (key, value) in law_keys().map(|key| {
            let value = other(key.path);
            (key, value)
        }) {
            for &law in FrictionLaw::ALL {
                // A list has as many numbers as there are blocks, and without inertia blocks need radiation.
                let also = match key.path {
                    path if path.ends_with("_offsets") => "slider.blocks = 1\n",
                    "friction.inertia" if key.is_of(law) => {
                        "friction.radiation_kg_per_s = 1\nslider.relative_damping = 0\n"
                    }
                    _ => "",
                };
                let text = format!("friction.law = {:?}\n{} = {value}\n{also}", law.word(), key.path);
                let written = Scenario::resolve(&ScenarioSource::new("mine.toml", &text));
                if key.is_of(law) {
                    written.unwrap_or_else(|errors| panic!("{text}: {errors}"));
                    continue;
                }
                let errors = written.unwrap_err().to_string();
                let column = key.path.len() + 4;
                let expected = format!(
                    "mine.toml:2:{column}: {}: {value} has no meaning for friction.law = {:?}",
                    key.path,
                    law.word()
                );
                let accepted = format!(", or {})", key.laws());
                assert!(errors.starts_with(&expected) && errors.ends_with(&accepted), "{errors}");

                let logged = Scenario::resolve(&ScenarioSource::logged("run.mcap", &text)).unwrap();
                let plain = format!("friction.law = {:?}\n{also}", law.word());
                assert_eq!(logged, Scenario::resolve(&ScenarioSource::new("plain", plain)).unwrap());
                let set =
                    ScenarioSource::logged("run.mcap", "").with_override(&format!("{}={value}", key.path));
                let set = set.with_override(&format!("friction.law={}", law.word()));
                assert!(Scenario::resolve(&set).is_err(), "{}", key.path);
            }
        }
    }

    #[test]
    fn the_scenario_says_when_blocks_re_attach_whatever_the_law() {
        let resolve = |text: &str| Scenario::resolve(&ScenarioSource::logged("run.mcap", text)).unwrap();
        assert_eq!(resolve("").friction.reattach, Reattach::OneWay);
        for law in &FrictionLaw::ALL[1..] {
            let plain = resolve(&format!("friction.law = {:?}", law.word()));
            assert_eq!(plain.friction.reattach, Reattach::TwoWay);
            for shown in [plain.to_commented_toml(), plain.to_editable_toml()] {
                assert!(shown.contains("# reattach = \"two-way\"  # from friction.law"), "{shown}");
                // A change of the law also changes the values that the law determined.
                let source =
                    ScenarioSource::new("mine.toml", shown).with_override("friction.law=interfacial-springs");
                assert_eq!(Scenario::resolve(&source).unwrap().friction.reattach, Reattach::OneWay);
            }
            let mut other = plain.clone();
            other.friction.reattach = Reattach::OneWay;
            assert_eq!(other.hash(), plain.hash());
        }
    }
}
