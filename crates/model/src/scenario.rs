//! The resolved scenario: every key present, of its type and in its range, and
//! the keys consistent with each other.
//!
//! Run logs carry its serialised form, and the scenario hash is computed from it, so the order and
//! names of the fields are part of the log format. `resolve.rs` resolves it.

pub(crate) mod as_coded;
pub mod builtin;
pub(crate) mod choices;
pub(crate) mod defaults;
pub(crate) mod exact;
pub mod files;
pub(crate) mod implausible;
pub(crate) mod key;
pub mod keys;
pub(crate) mod meaning;
pub(crate) mod profile;
pub(crate) mod resolve;
pub mod rows;
pub(crate) mod rules;
pub(crate) mod show;
pub mod source;
pub(crate) mod suggest;
pub mod text;
pub mod typed;
pub(crate) mod warnings;

use serde::{Deserialize, Serialize};

use crate::body::elastic::gaps;
use crate::law::laws::Law;
use crate::law::rate_and_state::{EVENT_SPEED_RATIO, EVENT_SPEED_SHARE};
use crate::scenario::choices::{DriveKind, ParameterSet, Reattach};
use crate::scenario::keys::section::Section;
pub use crate::scenario::keys::{
    Detection, Disorder, Drive, Friction, Initial, InitialShear, InitialVelocity, NormalLoad, Prestress,
    Recording, Slider, Time, Window,
};

/// A resolved scenario. See [`KEYS`](crate::scenario::keys::KEYS) for what each field means.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Scenario {
    pub name: String,
    pub summary: String,
    pub parameter_set: ParameterSet,
    pub slider: Slider,
    pub friction: Friction,
    pub drive: Drive,
    pub normal_load: NormalLoad,
    pub initial_shear: InitialShear,
    #[serde(skip_serializing_if = "Section::is_default")]
    pub prestress: Prestress,
    #[serde(skip_serializing_if = "Section::is_default")]
    pub disorder: Disorder,
    pub initial_velocity: InitialVelocity,
    #[serde(skip_serializing_if = "Section::is_default")]
    pub initial: Initial,
    pub time: Time,
    #[serde(skip_serializing_if = "Section::is_default")]
    pub detection: Detection,
    pub recording: Recording,
}

impl Initial {
    /// Whether the run begins in a state that is given, so that no other key decides its start.
    pub fn is_given(&self) -> bool {
        !self.from.is_empty() || !self.state.is_empty() || !self.state_csv.is_empty() || self.has_lists()
    }

    pub(crate) fn has_lists(&self) -> bool {
        let lists =
            [&self.displacement_m, &self.velocity_m_per_s, &self.stick_position_m, &self.sliding_blocks];
        lists.iter().any(|list| !list.is_empty())
    }
}

impl Slider {
    /// Whether the slider is a lattice (a slab, a sheet or a body) rather than a chain.
    pub fn is_lattice(&self) -> bool {
        self.rows > 1 || self.is_over_area()
    }

    /// Whether its contacts cover an area: those of a sheet or a body do.
    pub fn is_over_area(&self) -> bool {
        self.across > 1
    }

    /// Number of contacts.
    pub fn contacts(&self) -> u32 {
        self.blocks.saturating_mul(self.across)
    }

    /// The keys, with their values, by which a lattice would be a chain.
    pub(crate) fn keys_of_a_chain(&self) -> &'static str {
        match (self.is_over_area(), self.rows > 1) {
            (false, _) => "slider.rows = 1",
            (true, false) => "slider.across = 1",
            (true, true) => "slider.across = 1 and slider.rows = 1",
        }
    }

    /// `k` of a chain (5.5).
    pub(crate) fn chain_stiffness_n_per_m(&self) -> f64 {
        let gaps = gaps(self.blocks as usize) as f64;
        self.youngs_modulus_pa * gaps * self.width_m * self.height_m / self.length_m
    }

    /// The spacing of nodes, `a`.
    pub(crate) fn spacing_m(&self) -> f64 {
        self.length_m / gaps(self.blocks as usize) as f64
    }
}

impl Friction {
    /// Whether a sliding contact re-attaches where its velocity changes sign, whichever way it slid.
    pub(crate) fn is_two_way(&self) -> bool {
        self.reattach == Reattach::TwoWay
    }
}

impl Drive {
    /// The largest velocity of its point.
    pub(crate) fn fastest_m_per_s(&self) -> f64 {
        self.course_m_per_s.iter().fold(self.velocity_m_per_s, |most, velocity| most.max(velocity.abs()))
    }
}

impl Scenario {
    /// Whether forces or loads of single contacts follow courses, or the drive is a force.
    pub fn has_contact_courses(&self) -> bool {
        self.drive.kind == DriveKind::Force
            || !self.prestress.course_s.is_empty()
            || !self.normal_load.course_s.is_empty()
    }

    /// The contact law with its numbers.
    pub fn contact_law(&self) -> Law {
        Law::of(self)
    }

    /// `V_th` without a key: a short part of a course that is far faster than the start hides no slips.
    pub(crate) fn default_event_speed_m_per_s(&self) -> f64 {
        let (slider, friction, drive) = (&self.slider, &self.friction, &self.drive);
        let blocks = f64::from(slider.contacts());
        let load_n = self.normal_load.total_n / blocks;
        let bonds_n_per_m = if slider.blocks > 1 { 2.0 * slider.chain_stiffness_n_per_m() } else { 0.0 };
        let stiffness_n_per_m = drive.stiffness_n_per_m / blocks + bonds_n_per_m;
        let mass_kg = if friction.inertia { slider.mass_kg / blocks } else { 0.0 };
        let impedance_kg_per_s = friction.radiation_kg_per_s + (mass_kg * stiffness_n_per_m).sqrt();
        let dynamic_m_per_s = friction.direct_effect * load_n / impedance_kg_per_s;
        let least_m_per_s = EVENT_SPEED_RATIO * drive.velocity_m_per_s;
        let most_m_per_s = EVENT_SPEED_RATIO * drive.fastest_m_per_s();
        most_m_per_s.min(least_m_per_s.max(EVENT_SPEED_SHARE * dynamic_m_per_s))
    }

    /// The files that it names, from which its values were read; empty texts for none.
    pub fn files(&self) -> [&str; 7] {
        let (shear, prestress, initial) = (&self.initial_shear, &self.prestress, &self.initial);
        [
            &shear.profile_csv,
            &prestress.profile_csv,
            &prestress.course_csv,
            &self.normal_load.course_csv,
            &self.disorder.contacts_csv,
            &initial.state_csv,
            &initial.from,
        ]
    }

    /// The BLAKE3 hash, hexadecimal, of everything that influences a run or its log; name and
    /// summary are excluded.
    pub fn hash(&self) -> String {
        let mut anonymous = Scenario { name: String::new(), summary: String::new(), ..self.clone() };
        // The values read from the file are hashed instead of its path.
        anonymous.initial_shear.profile_csv.clear();
        anonymous.prestress.profile_csv.clear();
        anonymous.prestress.course_csv.clear();
        anonymous.normal_load.course_csv.clear();
        anonymous.disorder.contacts_csv.clear();
        anonymous.initial.state_csv.clear();
        if !anonymous.initial.state.is_empty() {
            (anonymous.initial.from, anonymous.initial.at_s) = Default::default();
        }
        // These laws determine the rule, so it does not enter.
        if !anonymous.friction.law.uses("friction.reattach") {
            anonymous.friction.reattach = Reattach::OneWay;
        }
        let canonical =
            serde_json::to_vec(&anonymous).expect("a scenario is plain tables, numbers and texts");
        blake3::hash(&canonical).to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, ScenarioErrors, ScenarioSource};

    fn resolve(text: &str) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolve(&ScenarioSource::new("test.toml", text))
    }

    /// Logs, proofs and pairs of runs are identified by these hashes.
    #[test]
    fn hashes_of_scenarios_stay() {
        let of = |name| crate::resolve(name, &["parameter_set=as-coded"]).unwrap().hash();
        assert_eq!(of("default"), "a02b6d9960a98472f04dc0082c1424b9518e38931217e464397399565ce363ce");
        assert_eq!(of("load-on-far-end"), "3c84fe18c5bd2e399941c8fb013ab6ca441dcdc2a7423a2b812bd1246e860d8c");
    }

    #[test]
    fn name_and_summary_do_not_enter_the_hash() {
        let base = resolve("").unwrap();
        assert_eq!(resolve("name = \"a\"\nsummary = \"b\"").unwrap().hash(), base.hash());
        assert_ne!(resolve("normal_load.tilt = 1e-9").unwrap().hash(), base.hash());
        assert_ne!(resolve("recording.sample_s = 0.5").unwrap().hash(), base.hash());
    }
}
