//! The resolved scenario: every key present, of its type and in its range, and
//! the keys consistent with each other.
//!
//! Run logs carry it as TOML, and the hash of a scenario is taken of its keys, so their names are part of the log
//! format. `resolve.rs` resolves it.

pub(crate) mod as_coded;
pub mod builtin;
pub(crate) mod choices;
pub(crate) mod defaults;
pub mod files;
pub(crate) mod implausible;
pub(crate) mod key;
pub mod keys;
pub(crate) mod meaning;
mod of_recording;
pub(crate) mod profile;
pub(crate) mod resolve;
pub mod rows;
pub(crate) mod rules;
pub(crate) mod show;
pub mod source;
pub mod stand_ins;
pub(crate) mod suggest;
pub mod text;
pub mod typed;
pub(crate) mod warnings;

use toml::Value;

use crate::body::elastic::gaps;
use crate::law::laws::Law;
use crate::law::rate_and_state::{EVENT_SPEED_IN_MEDIUM_M_PER_S, EVENT_SPEED_RATIO, EVENT_SPEED_SHARE};
use crate::plan::disorder::Quantity;
use crate::scenario::choices::{DriveKind, MediumChoice, ParameterSet, Reattach};
pub use crate::scenario::keys::{
    Detection, Disorder, Drive, Friction, Initial, InitialShear, InitialVelocity, Medium, NormalLoad,
    Prestress, Recording, Slider, Time, Window,
};
use crate::scenario::keys::{KEYS, Key, WINDOW, section};

/// Declares the scenario by its sections, in the order of [`KEYS`].
macro_rules! scenario {
    ($($section:ident: $Section:ident,)+) => {
        /// A resolved scenario. See [`KEYS`] for what each field means.
        #[derive(Debug, Clone, PartialEq)]
        #[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
        pub struct Scenario {
            pub name: String,
            pub summary: String,
            pub parameter_set: ParameterSet,
            $(pub $section: $Section,)+
        }

        impl Scenario {
            /// The values of all keys, in the order of [`KEYS`], and last the list of windows.
            pub(crate) fn values(&self) -> Vec<Value> {
                let mut values = vec![self.name.as_str().into(), self.summary.as_str().into()];
                values.push(section::value(&self.parameter_set));
                $(values.extend(self.$section.values());)+
                values
            }

            /// The scenario with these values, each of which its key accepts.
            pub(crate) fn of(values: Vec<Value>) -> Scenario {
                let values = &mut values.into_iter();
                let (name, summary, parameter_set) = section::of(&KEYS[..3], values);
                $(let $section: $Section = section::of($Section::keys(), values);)+
                let mut scenario = Scenario { name, summary, parameter_set, $($section,)+ };
                let windows = values.next().expect("the list of windows is the last value");
                scenario.recording.window = windows.try_into().expect("its keys accept what windows hold");
                scenario
            }
        }
    };
}

scenario! {
    slider: Slider,
    medium: Medium,
    friction: Friction,
    drive: Drive,
    normal_load: NormalLoad,
    initial_shear: InitialShear,
    prestress: Prestress,
    initial_velocity: InitialVelocity,
    initial: Initial,
    disorder: Disorder,
    time: Time,
    detection: Detection,
    recording: Recording,
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

    /// Whether its blocks are nodes of a fault line in a medium.
    pub fn is_in_medium(&self) -> bool {
        self.medium != MediumChoice::None
    }

    /// The spacing of nodes, `a`; in a medium `dz`.
    pub fn spacing_m(&self) -> f64 {
        if self.is_in_medium() {
            return self.length_m / f64::from(self.blocks);
        }
        self.length_m / gaps(self.blocks as usize) as f64
    }
}

impl Medium {
    /// The profiles, by key.
    pub(crate) fn lists(&self) -> [(&'static str, &keys::List); 4] {
        [
            ("medium.direct_effect", &self.direct_effect),
            ("medium.evolution_effect", &self.evolution_effect),
            ("medium.critical_slip_m", &self.critical_slip_m),
            ("medium.normal_stress_pa", &self.normal_stress_pa),
        ]
    }

    /// Whether a profile has one value, or one for each depth.
    pub(crate) fn has_values(&self, list: &[f64]) -> bool {
        list.len() == 1 || (!list.is_empty() && list.len() == self.profile_m.len())
    }
}

impl Friction {
    /// Whether a sliding contact re-attaches where its velocity changes sign, whichever way it slid.
    pub(crate) fn is_two_way(&self) -> bool {
        self.reattach == Reattach::TwoWay
    }

    /// `V(0)` of a block by its key or list, counted from 0; 0 for none.
    pub(crate) fn velocity_at_start_m_per_s(&self, block: usize) -> f64 {
        self.initial_velocities_m_per_s.get(block).copied().unwrap_or(self.initial_velocity_m_per_s)
    }

    /// `theta(0)` of a block by its key or list, counted from 0; 0 for none.
    pub(crate) fn theta_at_start_s(&self, block: usize) -> f64 {
        self.initial_thetas_s.get(block).copied().unwrap_or(self.initial_theta_s)
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
            || self.prestress.swing_ratio != 0.0
            || !self.normal_load.course_s.is_empty()
    }

    /// The contact law with its numbers.
    pub fn contact_law(&self) -> Law {
        Law::of(self)
    }

    /// The speed at the start that is no slip: that of the drive, or the largest of a given `V(0)`.
    pub fn speed_at_start_m_per_s(&self) -> f64 {
        let given = self.friction.initial_velocities_m_per_s.iter();
        let alike = self.drive.velocity_m_per_s.max(self.friction.initial_velocity_m_per_s);
        given.fold(alike, |most, velocity| most.max(*velocity))
    }

    /// `V_th` without a key: a short part of a course that is far faster than the start hides no slips.
    pub(crate) fn default_event_speed_m_per_s(&self) -> f64 {
        if self.slider.is_in_medium() {
            return EVENT_SPEED_IN_MEDIUM_M_PER_S;
        }
        let (slider, friction, drive) = (&self.slider, &self.friction, &self.drive);
        let blocks = f64::from(slider.contacts());
        let load_n = self.normal_load.total_n / blocks;
        let bonds_n_per_m = if slider.blocks > 1 { 2.0 * slider.chain_stiffness_n_per_m() } else { 0.0 };
        let stiffness_n_per_m = drive.stiffness_n_per_m / blocks + bonds_n_per_m;
        let mass_kg = if friction.inertia { slider.mass_kg / blocks } else { 0.0 };
        let impedance_kg_per_s = friction.radiation_kg_per_s + (mass_kg * stiffness_n_per_m).sqrt();
        let dynamic_m_per_s = friction.direct_effect * load_n / impedance_kg_per_s;
        let least_m_per_s = EVENT_SPEED_RATIO * self.speed_at_start_m_per_s();
        // Where nothing bounds a slip, so that it has no such speed, that of the start decides alone.
        let dynamic_m_per_s = Some(dynamic_m_per_s).filter(|speed| speed.is_finite()).unwrap_or(0.0);
        let between_m_per_s = least_m_per_s.max(EVENT_SPEED_SHARE * dynamic_m_per_s);
        match EVENT_SPEED_RATIO * drive.fastest_m_per_s() {
            0.0 => between_m_per_s,
            most_m_per_s => most_m_per_s.min(between_m_per_s),
        }
    }

    /// The lists with a number for each block, without empty ones.
    pub fn lists_by_block(&self) -> impl Iterator<Item = (&'static str, &[f64])> {
        let offsets = Quantity::ALL.map(|of| (of.offsets_key(), of.offsets(self)));
        let others = [
            ("friction.evolution_offsets", self.friction.evolution_offsets.as_slice()),
            ("friction.weakening_slip_offsets_m", &self.friction.weakening_slip_offsets_m),
            ("friction.initial_velocities_m_per_s", &self.friction.initial_velocities_m_per_s),
            ("friction.initial_thetas_s", &self.friction.initial_thetas_s),
            ("initial_shear.profile", &self.initial_shear.profile),
            ("prestress.profile", &self.prestress.profile),
            ("initial.displacement_m", &self.initial.displacement_m),
            ("initial.velocity_m_per_s", &self.initial.velocity_m_per_s),
            ("initial.stick_position_m", &self.initial.stick_position_m),
        ];
        offsets.into_iter().chain(others).filter(|(_, list)| !list.is_empty())
    }

    /// The files that it names, from which its values were read; empty texts for none.
    pub fn files(&self) -> [&str; 9] {
        let (shear, prestress, initial) = (&self.initial_shear, &self.prestress, &self.initial);
        [
            &self.medium.profile_csv,
            &shear.profile_csv,
            &prestress.profile_csv,
            &prestress.course_csv,
            &self.normal_load.course_csv,
            &self.disorder.contacts_csv,
            &self.friction.initial_csv,
            &initial.state_csv,
            &initial.from,
        ]
    }

    /// The BLAKE3 hash, hexadecimal, of everything that influences a run or its log.
    ///
    /// It is taken of the keys that differ from their defaults, one line each as `path = value`, the value as JSON,
    /// lines in the order of their bytes. So a key that is added later, or moved, changes no hash. Excluded are name
    /// and summary; the paths of files, whose values enter; and, of a start in a given state, where that came from.
    pub fn hash(&self) -> String {
        let is_given = !self.initial.state.is_empty();
        self.hash_of(|path| match path {
            "initial.from" | "initial.at_s" => !is_given,
            _ => true,
        })
    }

    /// A hash of what moves the slider: as [`Scenario::hash`], without its start, its end, and what is recorded.
    pub fn motion_hash(&self) -> String {
        const OTHERS: [&str; 9] = [
            "friction.initial_velocit",
            "friction.initial_theta",
            "initial.",
            "initial_shear.",
            "initial_velocity.",
            "time.start",
            "time.duration_s",
            "detection.",
            "recording.",
        ];
        self.hash_of(|path| !OTHERS.iter().any(|other| path.starts_with(other)))
    }

    fn hash_of(&self, is_meant: impl Fn(&str) -> bool) -> String {
        let enters = |path: &str| match path {
            "name" | "summary" => false,
            // The other laws determine the rule.
            "friction.reattach" => self.friction.law.uses(path),
            _ => !path.ends_with("_csv") && is_meant(path),
        };
        let mut lines = self.differing("", &KEYS, &self.values());
        for (index, window) in self.recording.window.iter().enumerate() {
            lines.extend(self.differing(&format!("{WINDOW}.{index}."), Window::keys(), &window.values()));
        }
        lines.retain(|(path, _)| enters(path));
        lines.sort_unstable();
        let text: String = lines.into_iter().map(|(path, value)| format!("{path} = {value}\n")).collect();
        blake3::hash(text.as_bytes()).to_hex().to_string()
    }

    /// The keys that differ from their defaults, with their values as JSON.
    fn differing(&self, prefix: &str, keys: &[Key], values: &[Value]) -> Vec<(String, String)> {
        let is_as_coded = self.parameter_set == ParameterSet::AsCoded;
        let differs = |(key, value): &(&Key, &Value)| Some(*value) != key.default_in(is_as_coded);
        let line = |(key, value): (&Key, &Value)| {
            let value = serde_json::to_string(value).expect("plain numbers and texts");
            (format!("{prefix}{}", key.path), value)
        };
        keys.iter().zip(values).filter(differs).map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, ScenarioErrors, ScenarioSource};

    fn resolve(text: &str) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolve(&ScenarioSource::new("test.toml", text))
    }

    /// Another program can compute the hash from the keys that were changed.
    #[test]
    fn the_hash_is_taken_of_the_keys_that_differ_from_their_defaults() {
        let of = |text: &str| blake3::hash(text.as_bytes()).to_hex().to_string();
        assert_eq!(resolve("").unwrap().hash(), of(""));
        let written = "slider.blocks = 50\nfriction.dynamic_coefficient = 0.50\ndrive.velocity_m_per_s = 2e-4\nslider.rows = 1";
        let lines =
            "drive.velocity_m_per_s = 0.0002\nfriction.dynamic_coefficient = 0.5\nslider.blocks = 50\n";
        assert_eq!(resolve(written).unwrap().hash(), of(lines));
        let coded = resolve("parameter_set = \"as-coded\"\nslider.mass_kg = 12").unwrap();
        assert_eq!(coded.hash(), of("parameter_set = \"as-coded\"\n"));
        let window = "first_block = 1\nlast_block = 2\nfrom_s = 0\nto_s = 1\nevery_s = 0.5";
        let lines = "recording.window.0.every_s = 0.5\nrecording.window.0.first_block = 1\n\
                     recording.window.0.from_s = 0.0\nrecording.window.0.last_block = 2\nrecording.window.0.to_s = 1.0\n";
        assert_eq!(resolve(&format!("[[recording.window]]\n{window}")).unwrap().hash(), of(lines));
    }

    #[test]
    fn name_and_summary_do_not_enter_the_hash() {
        let base = resolve("").unwrap();
        assert_eq!(resolve("name = \"a\"\nsummary = \"b\"").unwrap().hash(), base.hash());
        assert_ne!(resolve("normal_load.tilt = 1e-9").unwrap().hash(), base.hash());
        assert_ne!(resolve("recording.sample_s = 0.5").unwrap().hash(), base.hash());
    }
}
