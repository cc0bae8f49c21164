//! The resolved scenario: every key present, of its type and in its range, and
//! the keys consistent with each other.
//!
//! Its serialised form is what a run log carries and what the scenario hash is
//! taken over, so the order and names of the fields are part of the format.

use serde::{Deserialize, Serialize};

use crate::keys::{self, KEYS, Key, Kind, Value, WINDOW_KEYS};
use crate::plan::{Reattach, longest_stable_step_s};
use crate::source::{Entries, Entry, ScenarioError, ScenarioErrors, ScenarioSource, Written};
use asperity_record::TimeGrid;

/// A resolved scenario. See [`KEYS`] for what each field means.
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
    pub initial_velocity: InitialVelocity,
    pub time: Time,
    pub recording: Recording,
}

/// The two readings of the source thesis.
///
/// Its program kept positions in mm, stiffness in N/mm and mass in kg, and so
/// lost a factor 1000 in `v += F dt / m`. In SI terms it computed a slider of
/// 12 kg with `eta = sqrt(10) sqrt(k m)`, not one of 0.012 kg with
/// `eta = sqrt(0.01) sqrt(k m)`. The slip lives only in these values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterSet {
    /// What the thesis' program computed; its figures come from this.
    AsCoded,
    /// What the thesis' text says; the physical one.
    AsStated,
}

impl ParameterSet {
    /// The word that scenarios use.
    pub fn word(self) -> &'static str {
        match self {
            ParameterSet::AsCoded => keys::PARAMETER_SETS[0],
            ParameterSet::AsStated => keys::PARAMETER_SETS[1],
        }
    }
}

/// `[slider]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Slider {
    pub blocks: u32,
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    pub mass_kg: f64,
    pub youngs_modulus_pa: f64,
    pub relative_damping: f64,
}

/// `[friction]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Friction {
    #[serde(skip_serializing_if = "is_default")]
    pub law: FrictionLaw,
    pub static_coefficient: f64,
    pub dynamic_coefficient: f64,
    pub interfacial_stiffness_ratio: f64,
    pub reattach: Reattach,
    #[serde(skip_serializing_if = "is_first_weakening_velocity")]
    pub weakening_velocity_m_per_s: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub radiation_kg_per_s: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub ageing_coefficient: f64,
    #[serde(skip_serializing_if = "is_one")]
    pub ageing_time_s: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub static_offsets: Vec<f64>,
    #[serde(skip_serializing_if = "is_default")]
    pub dynamic_offsets: Vec<f64>,
    #[serde(skip_serializing_if = "is_default")]
    pub static_spread: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub dynamic_spread: f64,
    #[serde(skip_serializing_if = "is_first_seed")]
    pub spread_seed: u32,
}

/// How a block sticks and slides.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FrictionLaw {
    /// Amontons-Coulomb with interfacial springs (section 5.3).
    #[default]
    InterfacialSprings,
    /// Rigid Amontons-Coulomb (2.7), Maegawa's.
    Rigid,
    /// Burridge and Knopoff's (2.4).
    VelocityWeakening,
}

/// Where the drive pulls.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DriveKind {
    /// Block 1 (5.8).
    #[default]
    Side,
    /// Every block (5.53).
    Top,
    /// Block 1 backwards, block N forwards.
    LeftRight,
}

/// What the times of a load schedule count from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ScheduleFrom {
    /// The start of the run.
    #[default]
    Start,
    /// The step in which the drive stops.
    Hold,
}

/// Where a run begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Start {
    /// At time 0, at rest.
    #[default]
    AtRest,
    /// Just before the first block would detach.
    Loaded,
}

// Keys that came later are left out of the serialised form where they have their
// defaults: so the hashes of older scenarios stay.

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references")]
fn is_one(value: &f64) -> bool {
    *value == 1.0
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references")]
fn is_first_seed(value: &u32) -> bool {
    *value == 1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands references")]
fn is_first_weakening_velocity(value: &f64) -> bool {
    *value == 0.1
}

/// `[drive]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Drive {
    #[serde(skip_serializing_if = "is_default")]
    pub kind: DriveKind,
    pub stiffness_n_per_m: f64,
    pub velocity_m_per_s: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub tilt: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub decay_length_m: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub hold_from_s: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub until_load_ratio: f64,
}

/// `[normal_load]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct NormalLoad {
    pub total_n: f64,
    pub tilt: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub schedule_s: Vec<f64>,
    #[serde(skip_serializing_if = "is_default")]
    pub schedule_n: Vec<f64>,
    #[serde(skip_serializing_if = "is_default")]
    pub schedule_from: ScheduleFrom,
}

/// `[initial_shear]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct InitialShear {
    pub beta: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub poisson_ratio: f64,
    #[serde(skip_serializing_if = "is_default")]
    pub profile_csv: String,
    #[serde(skip_serializing_if = "is_default")]
    pub profile: Vec<f64>,
}

/// `[initial_velocity]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct InitialVelocity {
    pub amplitude_m_per_s: f64,
    pub mode: u32,
}

/// `[time]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Time {
    #[serde(skip_serializing_if = "is_default")]
    pub start: Start,
    pub step_s: f64,
    pub duration_s: f64,
}

/// `[recording]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Recording {
    pub sample_s: f64,
    pub fields_s: f64,
    pub event_fields: bool,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub window: Vec<Window>,
}

/// `[[recording.window]]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(missing_docs, reason = "the key table documents every field, with symbol, unit and range")]
pub struct Window {
    pub from_s: f64,
    pub to_s: f64,
    pub every_s: f64,
    pub first_block: u32,
    pub last_block: u32,
}

impl Scenario {
    /// Resolves a scenario as written: fills in defaults, checks every value
    /// against its key and the keys against each other.
    ///
    /// # Errors
    /// Everything that is wrong, each with the place it was written at.
    pub fn resolve(source: &ScenarioSource) -> Result<Scenario, ScenarioErrors> {
        let entries = source.entries()?;
        let mut errors = Vec::new();
        let table = fill_in(&entries, &mut errors);
        if !errors.is_empty() {
            return Err(ScenarioErrors(errors));
        }
        let mut scenario: Scenario = toml::Value::Table(table)
            .try_into()
            .expect("a table with every key checked against the key table has the fields of a scenario");
        scenario.check_together(&entries, &mut errors);
        if errors.is_empty() {
            scenario.read_profile(&entries, &mut errors);
        }
        if errors.is_empty() {
            scenario.check_start(&entries, &mut errors);
        }
        if errors.is_empty() { Ok(scenario) } else { Err(ScenarioErrors(errors)) }
    }

    /// The scenario as complete TOML, every key with its symbol, range and meaning.
    pub fn to_commented_toml(&self) -> String {
        self.write_toml(false)
    }

    /// The same to be edited: values that follow from the parameter set are
    /// commented out, so that they change with it. Written out, they would stay
    /// those of one set under the name of the other.
    pub fn to_editable_toml(&self) -> String {
        self.write_toml(true)
    }

    fn write_toml(&self, leave_to_parameter_set: bool) -> String {
        let value = toml::Value::try_from(self).expect("a scenario is plain tables, numbers and texts");
        let mut out = String::new();
        let mut table = "";
        for key in KEYS {
            let (section, name) = key.path.rsplit_once('.').unwrap_or(("", key.path));
            if section != table {
                out.push_str(&format!("\n[{section}]\n"));
                table = section;
            }
            let default = key.default_in(self.parameter_set == ParameterSet::AsCoded).map(toml_value);
            // What is not serialised has its default.
            let found = key.path.split('.').try_fold(&value, |value, part| value.get(part));
            let found = found.or(default.as_ref()).expect("the key table names fields of a scenario");
            let follows_set =
                matches!(key.default, keys::Default::BySet { .. }) && default.as_ref() == Some(found);
            comment_and_value(&mut out, key, name, found, leave_to_parameter_set && follows_set);
        }
        for window in &self.recording.window {
            out.push_str("\n[[recording.window]]\n");
            let value = toml::Value::try_from(window).expect("a window is plain numbers");
            for key in WINDOW_KEYS {
                let found = value.get(key.path).expect("the key table names fields of a window");
                comment_and_value(&mut out, key, key.path, found, false);
            }
        }
        out
    }

    /// BLAKE3 over everything that influences a run or its log, hexadecimal;
    /// name and summary do not.
    pub fn hash(&self) -> String {
        let mut anonymous = Scenario { name: String::new(), summary: String::new(), ..self.clone() };
        // What was read from it stands beside it.
        anonymous.initial_shear.profile_csv.clear();
        let canonical =
            serde_json::to_vec(&anonymous).expect("a scenario is plain tables, numbers and texts");
        blake3::hash(&canonical).to_hex().to_string()
    }

    fn check_together(&self, entries: &Entries, errors: &mut Vec<ScenarioError>) {
        let mut refuse = |key: &str, problem: String, accepted: String| {
            errors.push(ScenarioError {
                place: entries.place(key),
                key: Some(key.to_owned()),
                problem,
                accepted: Some(accepted),
            });
        };
        let Friction { static_coefficient, dynamic_coefficient, .. } = self.friction;
        if dynamic_coefficient > static_coefficient {
            refuse(
                "friction.dynamic_coefficient",
                format!("{dynamic_coefficient} is above friction.static_coefficient = {static_coefficient}"),
                format!("a number from 0 to {static_coefficient}"),
            );
        }
        if self.initial_velocity.mode >= self.slider.blocks {
            refuse(
                "initial_velocity.mode",
                format!(
                    "a chain of {} blocks has no mode {}",
                    self.slider.blocks, self.initial_velocity.mode
                ),
                format!("a whole number from 0 to {}", self.slider.blocks - 1),
            );
        }
        self.check_laws(&mut refuse);
        let longest_s = longest_stable_step_s(self);
        // Written so that a chain whose fastest vibration is no number is refused as well; and a
        // little below the bound, which rounds.
        let is_stable = longest_s.is_finite() && self.time.step_s < longest_s * (1.0 - 1e-12);
        if !is_stable {
            refuse(
                "time.step_s",
                format!("{:e} is beyond the stability of the scheme for this chain", self.time.step_s),
                if longest_s > 0.0 && longest_s.is_finite() {
                    format!("a number above 0 and below {longest_s:.3e}")
                } else {
                    "none: stiffness, damping or mass are so large or small that no number tells how fast a \
                     block swings"
                        .to_owned()
                },
            );
        }
        let grid = TimeGrid::new(self.time.step_s);
        let mut whole = |key: &str, place: Option<&Entry>, value_s: f64, zero_allowed: bool| {
            let steps = grid.whole_steps(value_s);
            if steps.is_none() || (steps == Some(0) && !zero_allowed) {
                let nearest = grid.nearest_step(value_s).max(1);
                errors.push(ScenarioError {
                    place: place.map(|entry| entry.place.clone()),
                    key: Some(key.to_owned()),
                    problem: format!("{value_s} is no whole number of steps of {:e} s", self.time.step_s),
                    accepted: Some(format!(
                        "a multiple of time.step_s; the nearest is {}",
                        grid.time_s(nearest)
                    )),
                });
            }
            steps
        };
        let written = |key: &str| entries.values.get(key);
        whole("drive.hold_from_s", written("drive.hold_from_s"), self.drive.hold_from_s, true);
        for time_s in &self.normal_load.schedule_s {
            whole("normal_load.schedule_s", written("normal_load.schedule_s"), *time_s, true);
        }
        let steps = whole("time.duration_s", written("time.duration_s"), self.time.duration_s, false);
        whole("recording.sample_s", written("recording.sample_s"), self.recording.sample_s, true);
        whole("recording.fields_s", written("recording.fields_s"), self.recording.fields_s, true);
        for (index, window) in self.recording.window.iter().enumerate() {
            let place = |key: &str| entries.windows[index].get(key);
            whole("recording.window.from_s", place("from_s"), window.from_s, true);
            whole("recording.window.to_s", place("to_s"), window.to_s, true);
            whole("recording.window.every_s", place("every_s"), window.every_s, false);
        }
        for (index, window) in self.recording.window.iter().enumerate() {
            let mut refuse = |key: &str, problem: String, accepted: String| {
                errors.push(ScenarioError {
                    place: entries.windows[index].get(key).map(|entry| entry.place.clone()),
                    key: Some(format!("{}.{key}", keys::WINDOW)),
                    problem,
                    accepted: Some(accepted),
                });
            };
            if window.to_s < window.from_s || (steps.is_some() && window.to_s > self.time.duration_s) {
                refuse(
                    "to_s",
                    format!("{} is not inside the run", window.to_s),
                    format!("a number from {} to {}", window.from_s, self.time.duration_s),
                );
            }
            if window.last_block < window.first_block || window.last_block > self.slider.blocks {
                refuse(
                    "last_block",
                    format!("{} is not inside the chain", window.last_block),
                    format!("a whole number from {} to {}", window.first_block, self.slider.blocks),
                );
            }
        }
    }
}

impl Scenario {
    /// A loaded start needs a load that the run comes to.
    fn check_start(&self, entries: &Entries, errors: &mut Vec<ScenarioError>) {
        if self.time.start == Start::AtRest {
            return;
        }
        let plan = crate::Plan::new(self);
        let problem = if plan.initial.step == 0 {
            "a block is beyond its threshold before the drive moves"
        } else if plan.initial.step + 1 >= plan.steps {
            "no block comes to its threshold within the run"
        } else {
            return;
        };
        errors.push(ScenarioError {
            place: entries.place("time.start"),
            key: Some("time.start".to_owned()),
            problem: format!("\"loaded\", but {problem}"),
            accepted: Some("\"at-rest\", or a drive that brings the first slip".to_owned()),
        });
    }

    /// Reads the initial shear from its file, if it is named and has not been read before.
    fn read_profile(&mut self, entries: &Entries, errors: &mut Vec<ScenarioError>) {
        let shear = &mut self.initial_shear;
        if shear.profile_csv.is_empty() || !shear.profile.is_empty() {
            return;
        }
        match crate::profile::read(std::path::Path::new(&shear.profile_csv), self.slider.blocks as usize) {
            Ok(profile) => shear.profile = profile,
            Err(problem) => errors.push(ScenarioError {
                place: entries.place("initial_shear.profile_csv"),
                key: Some("initial_shear.profile_csv".to_owned()),
                problem,
                accepted: Some(crate::profile::ACCEPTED.to_owned()),
            }),
        }
    }

    /// What laws, drives and loads ask of each other; `refuse` takes key, problem and what
    /// is accepted.
    fn check_laws(&self, refuse: &mut impl FnMut(&str, String, String)) {
        let Scenario { friction, drive, normal_load, initial_shear, .. } = self;
        let blocks = self.slider.blocks as usize;
        let springs = friction.law == FrictionLaw::InterfacialSprings;
        if drive.kind == DriveKind::LeftRight && springs && friction.reattach == Reattach::OneWay {
            refuse(
                "drive.kind",
                "left-right pulls block 1 backwards, where the one-way rule would stop it in every step"
                    .to_owned(),
                "left-right with friction.reattach = \"two-way\"".to_owned(),
            );
        }
        let top = drive.kind == DriveKind::Top;
        for (key, value) in [("drive.tilt", drive.tilt), ("drive.decay_length_m", drive.decay_length_m)] {
            if value != 0.0 && !top {
                refuse(
                    key,
                    format!("{value} has no meaning for this drive"),
                    "0, or drive.kind = \"top\"".to_owned(),
                );
            }
        }
        if drive.tilt != 0.0 && drive.decay_length_m != 0.0 {
            refuse(
                "drive.tilt",
                "the springs of a top drive either tilt or decay".to_owned(),
                "one of them 0".to_owned(),
            );
        }
        if drive.until_load_ratio > 0.0 {
            if drive.kind == DriveKind::LeftRight {
                refuse(
                    "drive.until_load_ratio",
                    "the forces of a left-right drive add up to nothing".to_owned(),
                    "0, or another drive.kind".to_owned(),
                );
            }
            if drive.hold_from_s > 0.0 {
                refuse(
                    "drive.until_load_ratio",
                    "the drive stops either at a load or at drive.hold_from_s".to_owned(),
                    "one of them 0".to_owned(),
                );
            }
        }
        let (times, loads) = (&normal_load.schedule_s, &normal_load.schedule_n);
        if times.len() != loads.len() || times.len() == 1 {
            refuse(
                "normal_load.schedule_n",
                format!("{} loads at {} times", loads.len(), times.len()),
                "as many as normal_load.schedule_s, none or at least 2".to_owned(),
            );
        }
        let grid = TimeGrid::new(self.time.step_s);
        let step = |at: usize| grid.nearest_step(times[at]);
        if let Some(at) = (1..times.len()).find(|&at| step(at) <= step(at - 1)) {
            refuse(
                "normal_load.schedule_s",
                format!("goes from {} to {}", times[at - 1], times[at]),
                "times that ascend, by at least time.step_s".to_owned(),
            );
        }
        if let Some(first) = loads.first().filter(|first| **first != normal_load.total_n) {
            refuse(
                "normal_load.schedule_n",
                format!("begins with {first}, but the load before it is {}", normal_load.total_n),
                "a first load of normal_load.total_n".to_owned(),
            );
        }
        let stops = drive.hold_from_s > 0.0 || drive.until_load_ratio > 0.0;
        if normal_load.schedule_from == ScheduleFrom::Hold && !stops {
            refuse(
                "normal_load.schedule_from",
                "the drive never stops".to_owned(),
                "\"start\", or drive.hold_from_s or drive.until_load_ratio above 0".to_owned(),
            );
        }
        if friction.ageing_coefficient > 0.0 && !springs {
            refuse(
                "friction.ageing_coefficient",
                format!("{} needs contacts that stick by springs", friction.ageing_coefficient),
                "0, or friction.law = \"interfacial-springs\"".to_owned(),
            );
        }
        for (key, values) in [
            ("friction.static_offsets", &friction.static_offsets),
            ("friction.dynamic_offsets", &friction.dynamic_offsets),
            ("initial_shear.profile", &initial_shear.profile),
        ] {
            if !values.is_empty() && values.len() != blocks {
                refuse(
                    key,
                    format!("{} numbers for {blocks} blocks", values.len()),
                    format!("{blocks} numbers, or none"),
                );
            }
        }
        let Friction { static_offsets, dynamic_offsets, static_spread, dynamic_spread, .. } = friction;
        let even =
            static_offsets.is_empty() && dynamic_offsets.is_empty() && static_spread + dynamic_spread == 0.0;
        let fit = [static_offsets, dynamic_offsets]
            .iter()
            .all(|values| values.is_empty() || values.len() == blocks);
        if fit && !even {
            let (mu_s, mu_d) = crate::plan::coefficients(self);
            if let Some(n) = (0..blocks).find(|&n| mu_d[n] < 0.0 || mu_d[n] > mu_s[n]) {
                let key = [
                    ("friction.static_offsets", static_offsets.is_empty()),
                    ("friction.dynamic_offsets", dynamic_offsets.is_empty()),
                    ("friction.static_spread", *static_spread == 0.0),
                    ("friction.dynamic_spread", true),
                ];
                let key = key
                    .into_iter()
                    .find(|(_, unused)| !unused)
                    .map_or("friction.dynamic_spread", |key| key.0);
                refuse(
                    key,
                    format!("block {} gets mu_s = {} and mu_d = {}", n + 1, mu_s[n], mu_d[n]),
                    "0 <= mu_d <= mu_s for every block".to_owned(),
                );
            }
        }
        let moves = self.initial_velocity.amplitude_m_per_s != 0.0;
        if moves && !springs {
            refuse(
                "initial_velocity.amplitude_m_per_s",
                "blocks that stick without springs do not move".to_owned(),
                "0, or friction.law = \"interfacial-springs\"".to_owned(),
            );
        }
        if self.time.start == Start::Loaded
            && (moves || drive.until_load_ratio > 0.0 || friction.ageing_coefficient > 0.0)
        {
            refuse(
                "time.start",
                "\"loaded\" leaves out the ramp, on which initial velocities die away, contacts age and the drive may stop at a load".to_owned(),
                "\"at-rest\", or none of these".to_owned(),
            );
        } else if self.time.start == Start::Loaded
            && (!springs || drive.kind == DriveKind::LeftRight || !times.is_empty())
        {
            refuse(
                "time.start",
                "\"loaded\" knows the stuck chain with interfacial springs under a constant load, driven one way".to_owned(),
                "\"at-rest\"".to_owned(),
            );
        }
    }
}

/// Checks what is written against the key table and adds the defaults.
fn fill_in(entries: &Entries, errors: &mut Vec<ScenarioError>) -> toml::Table {
    unknown_keys(&entries.values, KEYS, "", errors);
    let as_coded = match entries.values.get("parameter_set").map(|entry| &entry.value) {
        Some(Written::Text(word)) => word == keys::PARAMETER_SETS[0],
        _ => true,
    };
    let mut table = toml::Table::new();
    for key in KEYS {
        let value = match entries.values.get(key.path) {
            Some(entry) => checked(key, key.path, entry, errors),
            None => key.default_in(as_coded).map(toml_value),
        };
        if let Some(value) = value {
            insert(&mut table, key.path, value);
        }
    }
    let windows: Vec<toml::Value> = entries
        .windows
        .iter()
        .map(|window| {
            unknown_keys(window, WINDOW_KEYS, "recording.window.", errors);
            let mut table = toml::Table::new();
            for key in WINDOW_KEYS {
                let path = format!("{}.{}", keys::WINDOW, key.path);
                match window.get(key.path) {
                    Some(entry) => {
                        if let Some(value) = checked(key, &path, entry, errors) {
                            table.insert(key.path.to_owned(), value);
                        }
                    }
                    None => errors.push(ScenarioError {
                        place: window.values().next().map(|entry| entry.place.clone()),
                        key: Some(path),
                        problem: "missing in this window".to_owned(),
                        accepted: Some(key.kind.to_string()),
                    }),
                }
            }
            toml::Value::Table(table)
        })
        .collect();
    if !windows.is_empty() {
        insert(&mut table, keys::WINDOW, toml::Value::Array(windows));
    }
    table
}

fn unknown_keys(
    values: &std::collections::BTreeMap<String, Entry>,
    known: &[Key],
    prefix: &str,
    errors: &mut Vec<ScenarioError>,
) {
    for (path, entry) in values {
        if known.iter().any(|key| key.path == path) {
            continue;
        }
        // Of a key longer than any, what follows tells no more about which was meant.
        let start: String = path.chars().take(LONGEST_KEY).collect();
        let suggestion = known
            .iter()
            .map(|key| key.path)
            .min_by_key(|candidate| edit_distance(candidate, &start))
            .expect("there are keys");
        errors.push(ScenarioError {
            place: Some(entry.place.clone()),
            key: Some(format!("{prefix}{path}")),
            problem: format!("unknown key, set to {}", entry.value),
            accepted: Some(format!(
                "the keys of `asperity scenario show default`; the nearest is {prefix}{suggestion}"
            )),
        });
    }
}

/// Holds one written value against its key.
fn checked(key: &Key, path: &str, entry: &Entry, errors: &mut Vec<ScenarioError>) -> Option<toml::Value> {
    let good = match (&entry.value, key.kind) {
        (Written::Number(value), Kind::Number(..)) if key.kind.accepts_number(*value) => {
            Some(toml::Value::Float(*value))
        }
        (Written::Whole(value), Kind::Number(..)) if key.kind.accepts_number(*value as f64) => {
            Some(toml::Value::Float(*value as f64))
        }
        (Written::Whole(value), Kind::Count(low, high))
            if u64::try_from(*value).is_ok_and(|count| (low..=high).contains(&count)) =>
        {
            Some(toml::Value::Integer(*value))
        }
        (Written::Text(word), Kind::Word(words)) if words.contains(&word.as_str()) => {
            Some(toml::Value::String(word.clone()))
        }
        (Written::Flag(flag), Kind::Flag) => Some(toml::Value::Boolean(*flag)),
        (Written::Numbers(values), Kind::Numbers(..))
            if values.iter().all(|value| key.kind.accepts_number(*value)) =>
        {
            Some(toml::Value::Array(values.iter().copied().map(toml::Value::Float).collect()))
        }
        (Written::Text(text), Kind::Text) if !text.contains(['\n', '\r']) => {
            Some(toml::Value::String(text.clone()))
        }
        _ => None,
    };
    if good.is_none() {
        errors.push(ScenarioError {
            place: Some(entry.place.clone()),
            key: Some(path.to_owned()),
            problem: format!("{} is not accepted", entry.value),
            accepted: Some(key.kind.to_string()),
        });
    }
    good
}

fn toml_value(value: Value) -> toml::Value {
    match value {
        Value::Number(value) => toml::Value::Float(value),
        Value::Count(value) => toml::Value::Integer(value as i64),
        Value::Text(text) => toml::Value::String(text.to_owned()),
        Value::Flag(flag) => toml::Value::Boolean(flag),
        Value::NoNumbers => toml::Value::Array(Vec::new()),
    }
}

fn insert(table: &mut toml::Table, path: &str, value: toml::Value) {
    match path.split_once('.') {
        None => {
            table.insert(path.to_owned(), value);
        }
        Some((section, rest)) => {
            let inner =
                table.entry(section).or_insert_with(|| toml::Value::Table(toml::Table::new())).as_table_mut();
            insert(inner.expect("no key is both a value and a section"), rest, value);
        }
    }
}

fn comment_and_value(out: &mut String, key: &Key, name: &str, value: &toml::Value, commented_out: bool) {
    let symbol = if key.symbol.is_empty() { String::new() } else { format!("{}: ", key.symbol) };
    for line in wrap(&format!("{symbol}{} Accepted: {}.", key.doc, key.kind), 98) {
        out.push_str(&format!("# {line}\n"));
    }
    if commented_out {
        out.push_str(&format!("# {name} = {value}  # from parameter_set; uncomment to fix it\n"));
    } else {
        out.push_str(&format!("{name} = {value}\n"));
    }
}

fn wrap(text: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let last = lines.last_mut().expect("there is always a line");
        if !last.is_empty() && last.len() + 1 + word.len() > width {
            lines.push(word.to_owned());
        } else {
            if !last.is_empty() {
                last.push(' ');
            }
            last.push_str(word);
        }
    }
    lines
}

/// Characters of a key that are looked at to guess which was meant.
const LONGEST_KEY: usize = 100;

/// Levenshtein distance, to suggest the key that was probably meant.
fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let substitution = diagonal + usize::from(from != *to);
            diagonal = row[j + 1];
            row[j + 1] = substitution.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(text: &str) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolve(&ScenarioSource::new("test.toml", text))
    }

    #[test]
    fn key_table_and_fields_agree() {
        // A table of every key has every field, and nothing else: what is missing and what is
        // unknown would be refused alike. Windows are filled in the same way.
        let entries = ScenarioSource::new(
            "test.toml",
            "[[recording.window]]\nfrom_s = 0\nto_s = 1\nevery_s = 0.5\nfirst_block = 1\nlast_block = 2\n",
        );
        let table = fill_in(&entries.entries().unwrap(), &mut Vec::new());
        for key in KEYS {
            let mut without = toml::Value::Table(table.clone());
            let (section, name) = key.path.rsplit_once('.').unwrap_or(("", key.path));
            let inner = if section.is_empty() { Some(&mut without) } else { without.get_mut(section) };
            inner.unwrap().as_table_mut().unwrap().remove(name).unwrap();
            assert!(without.try_into::<Scenario>().is_err(), "{} is no field", key.path);
        }
        let full: Scenario = toml::Value::Table(table).try_into().unwrap();
        let window = toml::Value::try_from(&full.recording.window[0]).unwrap();
        assert!(
            window.as_table().unwrap().keys().all(|key| WINDOW_KEYS.iter().any(|known| known.path == key))
        );
    }

    /// Logs, proofs and pairs of runs are told by these.
    #[test]
    fn hashes_of_scenarios_stay() {
        let of = |name| resolve(crate::builtin::find(name).unwrap()).unwrap().hash();
        assert_eq!(of("default"), "a02b6d9960a98472f04dc0082c1424b9518e38931217e464397399565ce363ce");
        assert_eq!(of("load-on-far-end"), "3c84fe18c5bd2e399941c8fb013ab6ca441dcdc2a7423a2b812bd1246e860d8c");
    }

    /// One for each check of keys against each other.
    #[test]
    fn contradictions_are_refused_with_the_reason() {
        for (text, expected) in [
            ("drive.kind = \"left-right\"", "drive.kind: left-right pulls block 1 backwards"),
            ("drive.tilt = 0.5", "drive.tilt: 0.5 has no meaning for this drive"),
            ("drive.kind = \"top\"\ndrive.tilt = 0.5\ndrive.decay_length_m = 0.1", "drive.tilt: the springs"),
            (
                "drive.until_load_ratio = 0.3\ndrive.hold_from_s = 1",
                "drive.until_load_ratio: the drive stops either",
            ),
            (
                "drive.until_load_ratio = 0.3\ndrive.kind = \"left-right\"\nfriction.reattach = \"two-way\"",
                "drive.until_load_ratio: the forces of a left-right drive add up to nothing",
            ),
            ("normal_load.schedule_s = [1, 2]", "normal_load.schedule_n: 0 loads at 2 times"),
            (
                "normal_load.schedule_s = [2, 1]\nnormal_load.schedule_n = [400, 100]",
                "normal_load.schedule_s: goes from 2 to 1",
            ),
            (
                "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [300, 100]",
                "normal_load.schedule_n: begins with 300, but the load before it is 400",
            ),
            (
                "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [400, -1]",
                "normal_load.schedule_n: [400.0, -1.0] is not accepted",
            ),
            (
                "normal_load.schedule_s = [1e-9, 2]\nnormal_load.schedule_n = [400, 100]",
                "normal_load.schedule_s: 0.000000001 is no whole number of steps",
            ),
            ("normal_load.schedule_from = \"hold\"", "normal_load.schedule_from: the drive never stops"),
            (
                "friction.law = \"rigid\"\nfriction.ageing_coefficient = 0.01",
                "friction.ageing_coefficient: 0.01 needs contacts that stick by springs",
            ),
            ("friction.static_offsets = [0.1]", "friction.static_offsets: 1 numbers for 100 blocks"),
            ("friction.static_spread = 0.5", "friction.static_spread: block"),
            (
                "time.start = \"loaded\"\nfriction.ageing_coefficient = 0.01",
                "time.start: \"loaded\" leaves out the ramp",
            ),
            (
                "time.start = \"loaded\"\ndrive.velocity_m_per_s = 0",
                "time.start: \"loaded\", but no block comes to its threshold within the run",
            ),
            (
                "time.start = \"loaded\"\ninitial_shear.beta = -0.8",
                "time.start: \"loaded\", but a block is beyond its threshold before the drive moves",
            ),
            (
                "friction.law = \"rigid\"\ninitial_velocity.amplitude_m_per_s = 0.1",
                "initial_velocity.amplitude_m_per_s: blocks that stick without springs do not move",
            ),
            (
                "normal_load.schedule_s = [1, 1.000000000000001]\nnormal_load.schedule_n = [400, 100]",
                "normal_load.schedule_s: goes from 1 to 1.000000000000001",
            ),
            (
                "normal_load.schedule_s = [1, 2]\nnormal_load.schedule_n = [400, 0]",
                "normal_load.schedule_n: [400.0, 0.0] is not accepted",
            ),
            ("friction.dynamic_spread = 0.3", "friction.dynamic_spread: block"),
            (
                "time.start = \"loaded\"\nfriction.law = \"rigid\"",
                "time.start: \"loaded\" knows the stuck chain",
            ),
            ("initial_shear.profile_csv = \"no such file\"", "initial_shear.profile_csv: no such file: "),
        ] {
            let errors = resolve(text).unwrap_err().to_string();
            assert!(errors.contains(expected), "{text}: {errors}");
        }
    }

    #[test]
    fn shown_scenarios_resolve_to_themselves() {
        for (name, text) in crate::builtin::all() {
            let scenario = resolve(text).unwrap_or_else(|errors| panic!("{name}: {errors}"));
            assert_eq!(scenario.name, name);
            assert!(!scenario.summary.is_empty(), "{name} has no summary");
            assert_eq!(resolve(&scenario.to_commented_toml()).unwrap(), scenario);
            assert_eq!(resolve(&scenario.to_editable_toml()).unwrap(), scenario);
        }
    }

    #[test]
    fn parameter_sets_differ_in_mass_and_damping_alone() {
        let coded = resolve("").unwrap();
        let stated = resolve("parameter_set = \"as-stated\"").unwrap();
        assert_eq!((coded.slider.mass_kg, stated.slider.mass_kg), (12.0, 0.012));
        assert_eq!(coded.slider.relative_damping, 10f64.sqrt());
        assert_eq!(stated.slider.relative_damping, 0.01f64.sqrt());
        let levelled = Scenario {
            parameter_set: ParameterSet::AsCoded,
            slider: Slider { mass_kg: 12.0, relative_damping: 10f64.sqrt(), ..stated.slider.clone() },
            ..stated
        };
        assert_eq!(levelled, coded);
    }

    /// Written out, mass and damping of the set as-coded once ran under the name
    /// of the set as-stated.
    #[test]
    fn an_edited_scenario_follows_its_parameter_set() {
        let shown = resolve("").unwrap().to_editable_toml();
        let source = ScenarioSource::new("mine.toml", shown).with_override("parameter_set=as-stated");
        let stated = resolve("parameter_set = \"as-stated\"").unwrap();
        assert_eq!(Scenario::resolve(&source).unwrap(), stated);
        // What was set on purpose stays.
        let heavy = resolve("slider.mass_kg = 3").unwrap().to_editable_toml();
        let source = ScenarioSource::new("mine.toml", heavy).with_override("parameter_set=as-stated");
        assert_eq!(Scenario::resolve(&source).unwrap().slider.mass_kg, 3.0);
    }

    #[test]
    fn name_and_summary_do_not_enter_the_hash() {
        let base = resolve("").unwrap();
        assert_eq!(resolve("name = \"a\"\nsummary = \"b\"").unwrap().hash(), base.hash());
        assert_ne!(resolve("normal_load.tilt = 1e-9").unwrap().hash(), base.hash());
        assert_ne!(resolve("recording.sample_s = 0.5").unwrap().hash(), base.hash());
    }

    #[test]
    fn errors_name_place_key_value_and_range() {
        for (text, expected) in [
            (
                "[slider]\nblocks = 1",
                "test.toml:2:10: slider.blocks: 1 is not accepted (accepted: a whole number from 2 to 100000)",
            ),
            (
                "[slider]\n  blokcs = 7",
                "test.toml:2:12: slider.blokcs: unknown key, set to 7 (accepted: the keys of \
                 `asperity scenario show default`; the nearest is slider.blocks)",
            ),
            (
                "slider.length_m = \"long\"",
                "test.toml:1:19: slider.length_m: \"long\" is not accepted (accepted: a number above 0)",
            ),
            (
                "normal_load.tilt = -1.5",
                "test.toml:1:20: normal_load.tilt: -1.5 is not accepted (accepted: a number from -1 to 1)",
            ),
            (
                "drive.velocity_m_per_s = nan",
                "test.toml:1:26: drive.velocity_m_per_s: NaN is not accepted (accepted: a number from 0)",
            ),
            (
                "initial_shear.beta = inf",
                "test.toml:1:22: initial_shear.beta: inf is not accepted (accepted: any finite number)",
            ),
            (
                "friction.dynamic_coefficient = 0.8",
                "test.toml:1:32: friction.dynamic_coefficient: 0.8 is above friction.static_coefficient = 0.7 \
                 (accepted: a number from 0 to 0.7)",
            ),
            (
                "time.step_s = 1e-4",
                "test.toml:1:15: time.step_s: 1e-4 is beyond the stability of the scheme for this chain \
                 (accepted: a number above 0 and below 3.379e-6)",
            ),
            (
                "time.step_s = 1e-8\nslider.mass_kg = 1e-320",
                "test.toml:1:15: time.step_s: 1e-8 is beyond the stability of the scheme for this chain \
                 (accepted: none: stiffness, damping or mass are so large or small that no number tells how \
                 fast a block swings)",
            ),
            (
                "time.step_s = 1e-8\nslider.mass_kg = 1e-297",
                "test.toml:1:15: time.step_s: 1e-8 is beyond the stability of the scheme for this chain \
                 (accepted: a number above 0 and below 3.085e-155)",
            ),
            (
                "time.step_s = 1.7e-13\nslider.relative_damping = 7.5e7\ntime.duration_s = 1.7e-12\n\
                 recording.sample_s = 0\nrecording.fields_s = 0",
                "test.toml:1:15: time.step_s: 1.7e-13 is beyond the stability of the scheme for this chain \
                 (accepted: a number above 0 and below 1.468e-13)",
            ),
            (
                "time.duration_s = 2.4e-8",
                "test.toml:1:19: time.duration_s: 0.000000024 is no whole number of steps of 1e-8 s \
                 (accepted: a multiple of time.step_s; the nearest is 0.00000002)",
            ),
            (
                "friction.reattach = \"sometimes\"",
                "test.toml:1:21: friction.reattach: \"sometimes\" is not accepted \
                 (accepted: \"one-way\" or \"two-way\")",
            ),
            ("[slider", "test.toml:1:8: not TOML: unclosed table, expected `]`"),
            (
                "[[recording.window]]\nfrom_s = 0\nto_s = 9\nevery_s = 1e-3\nfirst_block = 1\nlast_block = 101",
                "test.toml:3:8: recording.window.to_s: 9 is not inside the run (accepted: a number from 0 to 5)\n\
                 test.toml:6:14: recording.window.last_block: 101 is not inside the chain \
                 (accepted: a whole number from 1 to 100)",
            ),
        ] {
            assert_eq!(resolve(text).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn overrides_win_and_are_named_in_errors() {
        let source =
            |set: &str| ScenarioSource::new("test.toml", "normal_load.tilt = 0.5").with_override(set);
        assert_eq!(Scenario::resolve(&source("normal_load.tilt=0.25")).unwrap().normal_load.tilt, 0.25);
        assert_eq!(
            Scenario::resolve(&source("friction.reattach=two-way")).unwrap().friction.reattach,
            Reattach::TwoWay
        );
        assert_eq!(
            Scenario::resolve(&source("normal_load.tilt=2")).unwrap_err().to_string(),
            "--set normal_load.tilt=2: normal_load.tilt: 2 is not accepted (accepted: a number from -1 to 1)"
        );
        assert_eq!(
            Scenario::resolve(&source("nonsense")).unwrap_err().to_string(),
            "--set nonsense: not TOML: key with no value, expected `=` \
             (accepted: KEY=VALUE, as in --set time.duration_s=0.1)"
        );
    }
}
