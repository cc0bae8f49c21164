//! Keys without a meaning: what some friction laws do not use, and what needs another slider, drive or law.
//!
//! A scenario that sets such a key is refused, because the value would have no effect. A law fixes what its unused keys
//! would choose, and may have a default of its own for a key of all laws.

use std::sync::LazyLock;

use serde::Serialize;
use toml::Value;

use crate::law::laws::FrictionLaw;
use crate::scenario::Scenario;
use crate::scenario::choices::{MediumChoice, Start};
use crate::scenario::key::{AS_CODED, Key, Need};
use crate::scenario::keys::{KEYS, place};
use crate::scenario::source::{LayerKind, Refusals};
use crate::scenario::stand_ins::{self, STAND_INS};

/// When a sliding block re-attaches.
const REATTACH: &str = "friction.reattach";
/// The start of a run.
const START: &str = "time.start";

/// The places of the keys that each law lacks.
static LACKED: LazyLock<Vec<(FrictionLaw, Vec<usize>)>> = LazyLock::new(|| {
    let lacked = |law: &FrictionLaw| (0..KEYS.len()).filter(|&at| law.lacks(KEYS[at].path)).collect();
    FrictionLaw::ALL.iter().map(|law| (*law, lacked(law))).collect()
});

/// The keys that have one value in a medium, or how their paths begin.
const FIXED_IN_A_MEDIUM: &str = "friction.law friction.inertia friction.radiation_kg_per_s friction.direct_effect \
    friction.evolution_effect friction.evolution_offsets friction.critical_slip_m friction.initial_velocities_m_per_s \
    friction.initial_theta friction.initial_csv slider.across slider.rows slider.width_m slider.height_m slider.mass_kg \
    slider.youngs_modulus_pa slider.relative_damping slider.left_end slider.right_end drive.kind drive.stiffness_n_per_m \
    drive.course drive.tilt drive.decay_length_m drive.across drive.height_m drive.hold_from_s drive.until_load_ratio \
    normal_load. disorder. initial_shear. prestress. initial_velocity.";

/// Why they have.
const IN_A_MEDIUM: &str =
    "its nodes have neither bonds nor inertia, and [medium] has their friction, load and start";

fn is_fixed_in_a_medium(path: &str) -> bool {
    FIXED_IN_A_MEDIUM.split(' ').any(|begins| path.starts_with(begins))
}

/// Whether a key says nothing of a fault line in a medium.
pub(crate) fn is_idle_in_a_medium(path: &str) -> bool {
    is_fixed_in_a_medium(path) && !matches!(path, "friction.law" | "drive.kind")
}

/// What a key is in a medium where it is not written, and where nothing else may be.
fn default_in_a_medium(path: &str) -> Option<Value> {
    Some(match path {
        "friction.law" => "rate-and-state".into(),
        "friction.inertia" => false.into(),
        "drive.kind" => "plate".into(),
        START => "uniform".into(),
        "time.step_s" => 1e-3.into(),
        "time.tolerance" => 1e-6.into(),
        "slider.relative_damping" | "recording.sample_s" | "recording.fields_s" => 0.0.into(),
        _ => return None,
    })
}

/// Sets the values of keys that a medium alone determines, or that have a default of their own there.
pub(crate) fn decide_by_medium(values: &mut [Value], refusals: &mut Refusals<'_>) {
    let medium = values[place("slider.medium")].clone();
    if medium.as_str() == Some(MediumChoice::None.word()) {
        return;
    }
    let is_as_coded = values[place("parameter_set")].as_str() == Some(AS_CODED);
    for (at, key) in KEYS.iter().enumerate() {
        let (own, is_fixed) = (default_in_a_medium(key.path), is_fixed_in_a_medium(key.path));
        let written = stand_ins::written(key, refusals.entries);
        if !is_fixed && (own.is_none() || written.is_some()) {
            continue;
        }
        let value =
            own.or_else(|| key.default_in(is_as_coded).cloned()).expect("only keys of windows lack one");
        // What a log has there means nothing, and a mass that is not written follows from the sides.
        let is_other = |of: &&Key| {
            refusals.entries.values[of.path].layer != LayerKind::Log
                && (values[at] != value || of.path != key.path)
        };
        if let Some(other) = written.filter(is_other).filter(|_| is_fixed) {
            let of = format!("slider.medium = {medium}");
            refusals.refuse_without_meaning(other, &value, &of, IN_A_MEDIUM, "slider.medium = \"none\"");
        }
        values[at] = value;
    }
}

/// Sets keys that the law alone determines to the behaviour of the law, in the values of all keys. Other
/// values are refused in scenarios and ignored in logs.
pub(crate) fn decide_by_law(values: &mut [Value], refusals: &mut Refusals<'_>) {
    let entries = refusals.entries;
    let law: FrictionLaw =
        values[place("friction.law")].clone().try_into().expect("the word is that of a law");
    let (_, lacked) = LACKED.iter().find(|(of, _)| *of == law).expect("all laws are there");
    for &at in lacked {
        let key = &KEYS[at];
        // Where it cannot be chosen, a contact re-attaches whichever way it slid.
        let (fixed, why) = match key.path {
            REATTACH => (
                Value::String("two-way".to_owned()),
                "its contacts stop whichever way they slid, if they stick",
            ),
            _ => (key.default_in(true).expect("keys of laws have defaults").clone(), ""),
        };
        let path = key.path;
        if values[at] == fixed {
            continue;
        }
        let written = stand_ins::written(key, entries);
        if let Some(key) = written.filter(|key| entries.values[key.path].layer != LayerKind::Log) {
            let (of, laws) =
                among("friction.law", &law, FrictionLaw::ALL.iter().filter(|law| law.uses(path)));
            refusals.refuse_without_meaning(key, &fixed, &of, why, &laws);
        }
        values[at] = fixed;
    }
    let is_left = values[place(START)].as_str() == Some(Start::AtRest.word());
    if !law.sticks() && is_left && !entries.values.contains_key(START) {
        values[place(START)] = Value::from("loaded");
    }
}

/// Whether a key has its value from this law: fixed to another than the key's default, or the default of the law or of a
/// medium.
pub(crate) fn is_decided_by_law(path: &str, law: FrictionLaw, value: &Value) -> bool {
    let is_own = path == START && !law.sticks() && matches!(value.as_str(), Some("loaded" | "uniform"));
    is_own || (path == REATTACH && law.lacks(path))
}

/// The rule of what keys need.
pub(crate) fn keys_have_what_they_need(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let values = scenario.values();
    for (key, value) in KEYS.iter().zip(&values).filter(|(key, _)| !key.needs.is_empty()) {
        let default = key.default_in(true).expect("what is always needed has no needs");
        if value == default {
            continue;
        }
        refuse_without_needs(key, default, scenario, refusals);
    }
    for key in STAND_INS.iter().filter(|key| refusals.entries.has(key.path)) {
        refuse_without_needs(key, &Value::from(""), scenario, refusals);
    }
}

fn refuse_without_needs(key: &Key, default: &Value, scenario: &Scenario, refusals: &mut Refusals<'_>) {
    for (need, why) in key.needs {
        if let Some((of, instead)) = need.unmet(scenario) {
            refusals.refuse_without_meaning(key, default, &of, why, &instead);
        }
    }
}

impl Refusals<'_> {
    /// Refuses the value of a key that has no meaning for something, where it has one instead.
    fn refuse_without_meaning(&mut self, key: &Key, default: &Value, of: &str, why: &str, instead: &str) {
        let value = self.entries.values.get(key.path).map_or("its value", |entry| &entry.written);
        let default = match default {
            Value::Float(number) => number.to_string(),
            Value::Array(_) => "none".to_owned(),
            Value::String(text) if text.is_empty() => "none".to_owned(),
            default => default.to_string(),
        };
        let colon = if why.is_empty() { "" } else { ": " };
        let problem = format!("{value} has no meaning for {of}{colon}{why}");
        self.refuse(key.path, problem, format!("{default}, or {instead}"));
    }
}

impl Need {
    /// What of a scenario does not meet it, and what would.
    fn unmet(self, scenario: &Scenario) -> Option<(String, String)> {
        let (slider, kind, law) = (&scenario.slider, scenario.drive.kind, scenario.friction.law);
        let (is_met, instead) = match self {
            Need::Chain => (!slider.is_lattice(), slider.keys_of_a_chain()),
            Need::Blocks => (slider.blocks > 1, "slider.blocks from 2"),
            Need::OneRow => (slider.rows == 1, "slider.rows = 1"),
            Need::Rows => (slider.rows > 1, "slider.rows above 1"),
            Need::OneRowAcross => (slider.across == 1, "slider.across = 1"),
            Need::RowsAcross => (slider.across > 1, "slider.across above 1"),
            Need::InMedium => {
                let others = MediumChoice::WORDS.iter().filter(|word| **word != "none");
                return (!slider.is_in_medium()).then(|| among("slider.medium", &"none", others));
            }
            Need::Drives(kinds) => {
                return (!kinds.contains(&kind)).then(|| among("drive.kind", &kind, kinds));
            }
            Need::Laws(is_of) => {
                let laws = FrictionLaw::ALL.iter().filter(|law| is_of(**law));
                return (!is_of(law)).then(|| among("friction.law", &law, laws));
            }
        };
        let what = if slider.contacts() == 1 { "single block" } else { scenario.elastic().table.name };
        (!is_met).then(|| (format!("a {what}"), instead.to_owned()))
    }
}

/// A key with its word, and with the words that it may have instead.
fn among<'a, T: Serialize + 'a>(
    key: &str,
    word: &T,
    words: impl IntoIterator<Item = &'a T>,
) -> (String, String) {
    let quoted = |word: &T| Value::try_from(word).expect("it is a word").to_string();
    let words: Vec<String> = words.into_iter().map(quoted).collect();
    (format!("{key} = {}", quoted(word)), format!("{key} = {}", words.join(" or ")))
}

#[cfg(test)]
mod tests {
    use crate::law::laws::FrictionLaw;
    use crate::scenario::choices::Reattach;
    use crate::scenario::key::{Key, Kind};
    use crate::scenario::keys::KEYS;
    use crate::{Scenario, ScenarioSource};

    /// Sliders, drives and laws; with each, some keys have no meaning.
    const SETTINGS: &[&str] = &[
        "",
        "slider.blocks = 1\n",
        "slider.blocks = 11\nslider.rows = 3\n",
        "slider.blocks = 11\nslider.across = 3\nslider.width_m = 0.02\nfriction.reattach = \"turn\"\n",
        "slider.blocks = 11\nslider.across = 3\nslider.width_m = 0.02\nslider.rows = 3\nfriction.reattach = \"turn\"\n",
        "drive.kind = \"top\"\n",
        "drive.kind = \"left-right\"\nfriction.reattach = \"two-way\"\n",
        "drive.kind = \"force\"\ndrive.course_s = [1, 2]\ndrive.course_n = [1, 2]\n",
        "friction.law = \"rigid\"\n",
        "friction.law = \"velocity-weakening\"\n",
        "friction.law = \"junctions\"\n",
        "friction.law = \"rate-and-state\"\n",
        MEDIUM,
    ];

    const MEDIUM: &str = "slider.medium = \"half-space\"\ntime.start = \"steady\"\nmedium.direct_effect = [0.01]\n\
                          medium.evolution_effect = [0.015]\nmedium.critical_slip_m = [1e-3]\n\
                          medium.normal_stress_pa = [1e6]\n";

    /// A value that is no default, as written.
    fn other(key: &Key) -> String {
        let value = match key.kind {
            Kind::Number(..) if key.kind.accepts_number(0.3) => "0.3",
            Kind::Number(..) => "0.001",
            Kind::Numbers(..) if key.kind.accepts_number(1.5) => "[1.5]",
            Kind::Numbers(..) => "[0.5]",
            Kind::Count(..) => "2",
            Kind::Word(words) => return format!("{:?}", words.last().unwrap()),
            Kind::Flag if key.default_in(true) == Some(&true.into()) => "false",
            Kind::Flag => "true",
            Kind::Text(_) => "\"no file\"",
        };
        value.to_owned()
    }

    #[test]
    fn what_has_no_meaning_is_refused_with_place_key_value_reason_and_what_would_give_it_one() {
        let is_of_laws = |key: &Key| FrictionLaw::ALL.iter().any(|law| law.lacks(key.path));
        for key in KEYS.iter().filter(|key| is_of_laws(key) || !key.needs.is_empty()) {
            let mut reasons = Vec::new();
            for setting in SETTINGS.iter().filter(|setting| !setting.contains(key.path)) {
                let plain = Scenario::resolve(&ScenarioSource::new("", *setting)).unwrap();
                let law = plain.friction.law;
                let unmet = key.needs.iter().filter(|(need, _)| need.unmet(&plain).is_some());
                let is_fixed = *setting == MEDIUM && super::is_fixed_in_a_medium(key.path);
                let expected: Vec<&str> = match (is_fixed, law.lacks(key.path)) {
                    // What is written there is what it is.
                    (true, _) if key.path == "friction.inertia" => vec![],
                    (true, _) => vec![super::IN_A_MEDIUM],
                    (false, true) => vec![""],
                    (false, false) => unmet.map(|(_, why)| *why).collect(),
                };
                let text = format!("{} = {}\n{setting}", key.path, other(key));
                let written = Scenario::resolve(&ScenarioSource::new("mine.toml", &text));
                let found = written.err().map_or(String::new(), |errors| errors.to_string());
                let column = key.path.len() + 4;
                let start = format!("mine.toml:1:{column}: {}: {} has no meaning for ", key.path, other(key));
                let refused: Vec<&str> = found.lines().filter(|line| line.starts_with(&start)).collect();
                assert_eq!(refused.len(), expected.len(), "{text}: {found}");
                for (line, why) in refused.into_iter().zip(expected) {
                    assert!(line.contains(why) && line.contains(", or "), "{text}: {line}");
                    reasons.push(why);
                }
                if law.lacks(key.path) {
                    let logged = Scenario::resolve(&ScenarioSource::logged("run.mcap", &text)).unwrap();
                    assert_eq!(logged, plain, "{text}");
                }
            }
            assert!(!is_of_laws(key) || reasons.contains(&""), "{}", key.path);
            assert!(key.needs.iter().all(|(_, why)| reasons.contains(why)), "{}: {reasons:?}", key.path);
        }
    }

    #[test]
    fn the_scenario_says_when_blocks_re_attach_whatever_the_law() {
        let resolve = |text: &str| Scenario::resolve(&ScenarioSource::logged("run.mcap", text)).unwrap();
        assert_eq!(resolve("").friction.reattach, Reattach::OneWay);
        for law in FrictionLaw::ALL.iter().filter(|law| law.lacks("friction.reattach")) {
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
