//! States at the start that a scenario gives: the rules of `[initial]`, tables and logs, the text that one run leaves
//! to another, and how a plan begins in it.

use std::mem;

use asperity_record::TimeGrid;
use serde::{Deserialize, Serialize};

use crate::law::laws::FrictionLaw;
use crate::plan::Plan;
use crate::plan::adaptive_state::AdaptiveState;
use crate::plan::ledger::Ledger;
use crate::plan::state::SliderState;
use crate::scenario::Scenario;
use crate::scenario::profile::{Wrong, columns, is_by_block};
use crate::scenario::rules::{Refusal, lists_ascend};
use crate::scenario::source::Refusals;

/// The columns of a table.
const COLUMNS: [&str; 4] = ["displacement_m", "velocity_m_per_s", "stick_position_m", "slides"];

/// The lists of a state, in the order of the columns of a table.
const LISTS: [&str; 4] = [
    "initial.displacement_m",
    "initial.velocity_m_per_s",
    "initial.stick_position_m",
    "initial.sliding_blocks",
];

impl Scenario {
    /// The first of these keys that has another value than in [`Scenario::keys_of_states`] of another run: the key,
    /// the value there, and the one here.
    pub fn differs_in(&self, there: &[(impl AsRef<str>, String)]) -> Option<(&'static str, String, String)> {
        self.keys_of_states().into_iter().find_map(|(key, here)| {
            let (_, there) = there.iter().find(|(name, _)| name.as_ref() == key)?;
            (*there != here).then(|| (key, there.clone(), here))
        })
    }

    /// The keys that a run shares with the one in whose state it begins, and their values as written.
    pub fn keys_of_states(&self) -> [(&'static str, String); 15] {
        let (slider, friction) = (&self.slider, &self.friction);
        [
            ("slider.blocks", slider.blocks.to_string()),
            ("slider.across", slider.across.to_string()),
            ("slider.rows", slider.rows.to_string()),
            ("slider.length_m", slider.length_m.to_string()),
            ("slider.width_m", slider.width_m.to_string()),
            ("slider.height_m", slider.height_m.to_string()),
            ("slider.mass_kg", slider.mass_kg.to_string()),
            ("slider.youngs_modulus_pa", slider.youngs_modulus_pa.to_string()),
            ("slider.left_end", format!("{:?}", slider.left_end.word())),
            ("slider.right_end", format!("{:?}", slider.right_end.word())),
            ("slider.medium", format!("{:?}", slider.medium.word())),
            ("medium.first_node", format!("{:?}", self.medium.first_node.word())),
            ("friction.law", format!("{:?}", friction.law.word())),
            ("friction.junction_count", friction.junction_count.to_string()),
            ("time.step_s", format!("{:e}", self.time.step_s)),
        ]
    }
}

/// A state that a run leaves to others that begin in it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenState {
    /// Keys that such a run must share, and their values ([`Scenario::keys_of_states`]); empty for a state of no log.
    pub keys: Vec<(String, String)>,
    /// The motion that it was reached by ([`Scenario::motion_hash`]).
    pub motion: String,
    /// The drive that it was reached with; `None` for one whose point moved from 0.
    pub drive: Option<GivenDrive>,
    /// Whether the solver took an area for its own mirror image.
    pub mirrors: bool,
    /// The accounts on which the fast solver bases its choice of steps.
    pub pace: [u64; 3],
    /// The slider.
    pub slider: SliderState,
}

/// The drive of a run at the end of which another begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GivenDrive {
    /// Displacement of its point.
    pub point_m: f64,
    /// The part of it that is no way of the drive ([`Drive::offset_m`](crate::Drive)).
    pub offset_m: f64,
    /// The load `F_T / F_N` that stops it, if any.
    pub until_load_ratio: Option<f64>,
    /// Where each spring is relaxed.
    pub rest_m: Vec<f64>,
    /// Where the bond of each end is.
    pub ends_m: Vec<f64>,
}

/// How the solver of another run went on, for a plan that begins in its state; no physics. The default is that of
/// another motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct GivenStart {
    /// The accounts on which the fast solver bases its choice of steps.
    pub pace: Option<[u64; 3]>,
    /// Whether it takes an area for its own mirror image.
    pub mirrors: bool,
}

/// Hexadecimal digits of the checksum at the beginning of a text.
const CHECKSUM_LENGTH: usize = 16;

impl GivenState {
    /// As a text on one line, exact: a checksum and JSON.
    pub fn to_text(&self) -> String {
        let json = serde_json::to_string(self).expect("a state is a plain struct of finite numbers");
        format!("{} {json}", checksum(&json))
    }

    /// Reads [`GivenState::to_text`].
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn from_text(text: &str) -> Result<GivenState, String> {
        let (stated, json) = text.split_once(' ').ok_or("it does not begin with a checksum")?;
        if stated != checksum(json) {
            return Err("its checksum is another one: it was changed or cut".to_owned());
        }
        serde_json::from_str(json).map_err(|error| error.to_string())
    }

    /// The state that a scenario gives, as a text or in lists; `None` if its start follows from other keys. Anchors
    /// that are not listed are left out.
    ///
    /// # Errors
    /// What is wrong with the text.
    pub(crate) fn of(scenario: &Scenario) -> Result<Option<GivenState>, String> {
        let initial = &scenario.initial;
        if !initial.state.is_empty() {
            return GivenState::from_text(&initial.state).map(Some);
        }
        if initial.displacement_m.is_empty() {
            return Ok(None);
        }
        let zeros = vec![0.0; initial.displacement_m.len()];
        let mut slip = zeros.clone();
        for block in &initial.sliding_blocks {
            slip[*block as usize - 1] = 1.0;
        }
        let velocity_m_per_s = &initial.velocity_m_per_s;
        let slider = SliderState {
            step: TimeGrid::new(scenario.time.step_s).nearest_step(initial.at_s),
            displacement_m: initial.displacement_m.clone(),
            velocity_m_per_s: if velocity_m_per_s.is_empty() { zeros } else { velocity_m_per_s.clone() },
            stick_position_m: initial.stick_position_m.clone(),
            slip,
            ..SliderState::default()
        };
        let (keys, motion) = (Vec::new(), String::new());
        Ok(Some(GivenState { keys, motion, drive: None, mirrors: false, pace: [0; 3], slider }))
    }

    /// Begins a plan in it. The clock goes on, and so does the drive point: with another velocity from where it is. A
    /// drive that has stopped at a load stays where it stopped as long as that load is the one to stop at.
    pub(crate) fn begin(self, scenario: &Scenario, plan: &mut Plan) {
        let GivenState { motion, drive, mirrors, pace, mut slider, .. } = self;
        let (step, planned) = (slider.step, plan.initial.hold_step);
        let until = plan.drive.until_load_ratio;
        if until.is_none() || drive.as_ref().is_none_or(|from| from.until_load_ratio != until) {
            slider.hold_step = planned;
        }
        if let Some(from) = &drive {
            // A drive without changes gives that point to the bit.
            plan.drive.offset_m = from.offset_m;
            if plan.outside(step, slider.hold_step).point_m != from.point_m {
                plan.drive.offset_m = 0.0;
                plan.drive.offset_m = from.point_m - plan.outside(step, slider.hold_step).point_m;
            }
            if from.rest_m.len() == plan.drive.springs.len() {
                let springs = plan.drive.springs.iter_mut().zip(&from.rest_m);
                springs.for_each(|(spring, rest_m)| spring.rest_m = *rest_m);
            }
        }
        let ends_m = drive.map(|from| from.ends_m).filter(|ends_m| ends_m.len() == plan.end_bonds.len());
        for (end, bond) in plan.end_bonds.iter_mut().enumerate() {
            bond.rest_m = match &ends_m {
                Some(ends_m) => ends_m[end],
                None => bond.stretch(&slider.displacement_m),
            };
        }
        if slider.stick_position_m.is_empty() {
            // Friction springs that hold their blocks where they are.
            let u = &slider.displacement_m;
            let mut pull_n = plan.elastic.tangential_force_n(u);
            plan.outside(step, slider.hold_step).add_n(&mut pull_n, [u, &slider.velocity_m_per_s]);
            let anchor =
                |((u, pull_n), kt): ((&f64, &f64), &f64)| if *kt > 0.0 { u - pull_n / kt } else { *u };
            let springs = u.iter().zip(&pull_n).zip(&plan.friction.springs_n_per_m);
            slider.stick_position_m = springs.map(anchor).collect();
        }
        // Energies are counted from here; an open span stays open.
        slider.energy = Ledger { span: slider.energy.span, ..Ledger::default() };
        if let Some(adaptive) = &mut slider.adaptive {
            let energies_j = adaptive.unknowns.iter_mut().skip(AdaptiveState::energies_from(plan));
            energies_j.for_each(|energy_j| *energy_j = 0.0);
        }
        plan.initial = slider;
        if motion == scenario.motion_hash() {
            plan.given = Some(GivenStart { pace: Some(pace), mirrors });
            return;
        }
        // Forces, thresholds and the step in progress are wrong for another motion.
        plan.given = Some(GivenStart::default());
        let stuck = SliderState::stuck(plan);
        let from = mem::replace(&mut plan.initial, stuck);
        let slider = &mut plan.initial;
        slider.slip = match (&from.junctions, plan.friction.law.junctions()) {
            (Some(junctions), Some(law)) => {
                let slipping = junctions.contacts.slipping.iter();
                slipping.map(|count| f64::from(u8::from(law.slides(*count)))).collect()
            }
            _ => from.slip,
        };
        slider.detached = slider.slip.iter().filter(|slip| **slip != 0.0).count() as u32;
        slider.sliding = slider.detached;
        slider.just_detached = from.just_detached;
        slider.junctions = from.junctions;
        // Left out where contacts did not have them.
        if from.normal_load_n.len() == slider.normal_load_n.len() {
            slider.normal_load_n = from.normal_load_n;
        }
        if from.memory.len() == slider.memory.len() {
            slider.memory = from.memory;
        } else {
            // As if contacts that slide had just detached.
            plan.friction.law.begin(&slider.slip, &slider.displacement_m, &mut slider.memory);
        }
        if from.stuck_since_step.len() == slider.stuck_since_step.len() {
            slider.stuck_since_step = from.stuck_since_step;
        }
    }
}

fn checksum(json: &str) -> String {
    blake3::hash(json.as_bytes()).to_hex().as_str()[..CHECKSUM_LENGTH].to_owned()
}

/// Checks the keys of `[initial]` against each other and the slider.
pub(crate) fn states_are_of_one_kind(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (initial, slider) = (&scenario.initial, &scenario.slider);
    let of_log = !initial.from.is_empty() || !initial.state.is_empty();
    if !initial.is_given() {
        if initial.at_s != 0.0 {
            let problem = format!("{} is the time of a state, and none is given", initial.at_s);
            let accepted = "0, or a state in initial.from, initial.state_csv or initial.displacement_m";
            refusals.refuse("initial.at_s", problem, accepted);
        }
        return;
    }
    if of_log {
        let is_table = !initial.state_csv.is_empty();
        let others = [("initial.state_csv", is_table), ("initial.displacement_m", initial.has_lists())];
        for (key, _) in others.into_iter().filter(|(_, is_there)| *is_there) {
            let accepted = "none, or no initial.from and initial.state";
            refusals.refuse(key, "the state is that of a log already", accepted);
        }
        return;
    }
    let laws: Vec<&str> =
        FrictionLaw::ALL.iter().filter(|law| law.has_two_states()).map(|law| law.word()).collect();
    let lists = &format!("a chain with {}; initial.from for others", laws.join(" or "));
    let key = if initial.state_csv.is_empty() { "initial.displacement_m" } else { "initial.state_csv" };
    if slider.is_lattice() {
        let what = scenario.elastic().table.name;
        refusals.refuse(key, format!("a row for each block does not give the state of a {what}"), lists);
    }
    if !scenario.friction.law.has_two_states() {
        let law = scenario.friction.law.word();
        let problem = format!("contacts with friction.law = {law:?} have more state than these columns");
        refusals.refuse(key, problem, lists);
    }
    if initial.has_lists() && initial.displacement_m.is_empty() {
        let problem = "none, beside other lists of a state";
        refusals.refuse("initial.displacement_m", problem, "one for each block");
    }
    lists_ascend([("initial.sliding_blocks", &initial.sliding_blocks)], slider.blocks, refusals);
}

/// Reads the state from its log or its table, unless the scenario holds it.
pub(crate) fn read(scenario: &mut Scenario, reading: &mut Refusals<'_>) {
    let overrides = |key: &str| reading.entries.overrides(key, "initial.state");
    if overrides("initial.from") || (overrides("initial.at_s") && !scenario.initial.from.is_empty()) {
        scenario.initial.state.clear();
    }
    let has_newer_table = reading.entries.overrides("initial.state_csv", LISTS[0]);
    let initial = &mut scenario.initial;
    let [u, v, anchors, sliding] = LISTS;
    if has_newer_table {
        for list in LISTS.into_iter().filter(|list| reading.entries.overrides(list, LISTS[0])) {
            let problem = "a list beside a table, which has it as a column".to_owned();
            reading.refuse(list, problem, "none, or no initial.state_csv");
        }
    }
    if !initial.from.is_empty() && initial.state.is_empty() {
        let read = reading.files("initial.from", &initial.from).and_then(|files| {
            files
                .state(scenario)
                .map_err(|unfit| reading.entries.error(unfit.key, unfit.problem, unfit.accepted))
        });
        match read {
            Ok(state) => scenario.initial.state = state,
            Err(error) => reading.errors.push(error),
        }
    } else if !initial.state_csv.is_empty() && (has_newer_table || !initial.has_lists()) {
        let lists = [
            (u, &mut initial.displacement_m),
            (v, &mut initial.velocity_m_per_s),
            (anchors, &mut initial.stick_position_m),
            (sliding, &mut initial.sliding_blocks),
        ];
        let blocks = scenario.slider.blocks as usize;
        let accepted = format!("a CSV file with the header {} and a row for each block", COLUMNS.join(","));
        reading.lists(("initial.state_csv", &initial.state_csv), lists, |text| rows(text, blocks), accepted);
    }
}

/// Parses the columns of a table, of the last one the blocks that slide; the error is the line number and a description.
fn rows(text: &str, blocks: usize) -> Result<[Vec<f64>; 4], Wrong> {
    let (lines, mut columns) = columns(text, COLUMNS, true)?;
    if let Some(n) = columns[3].iter().position(|slides| ![0.0, 1.0].contains(slides)) {
        return Err((lines[n], format!("slides is {}, not 0 or 1", columns[3][n])));
    }
    is_by_block(&lines, blocks)?;
    let sliding = (1..).zip(&columns[3]).filter(|(_, slides)| **slides != 0.0);
    columns[3] = sliding.map(|(block, _)| f64::from(block)).collect();
    Ok(columns)
}

/// Checks that the state that a scenario gives can be one of its slider. For scenarios that obey all rules.
pub(crate) fn check(scenario: &Scenario) -> Option<Refusal> {
    let initial = &scenario.initial;
    let written = [
        ("initial.from", &initial.from),
        ("initial.state", &initial.state),
        ("initial.state_csv", &initial.state_csv),
    ];
    let key = written
        .into_iter()
        .find(|(_, text)| !text.is_empty())
        .map_or("initial.displacement_m", |(key, _)| key);
    let accepted = "a state of this slider, of a step before the end of the run";
    let refuse = |problem: String| Some((key, problem, accepted.to_owned()));
    let given = match GivenState::of(scenario) {
        Ok(None) => return None,
        Ok(Some(given)) => given,
        Err(problem) => return refuse(format!("no state can be read from initial.state: {problem}")),
    };
    if let Some((key, found, wanted)) = scenario.differs_in(&given.keys) {
        return Some((
            key,
            format!("{wanted}, and the state in initial.state is of a run with {found}"),
            format!("{found}, or in initial.from the log of a run with {wanted}"),
        ));
    }
    let mut plan = Plan::without_given_state(scenario);
    let is_of_log = !initial.state.is_empty();
    if is_of_log && initial.at_s != 0.0 && plan.grid.nearest_step(initial.at_s) != given.slider.step {
        let time_s = plan.grid.time_s(given.slider.step);
        return Some((
            "initial.at_s",
            format!("{}, and the state in initial.state is that at {time_s} s", initial.at_s),
            format!("{time_s}, or no initial.state, so that initial.from is read"),
        ));
    }
    if given.slider.step >= plan.steps {
        return Some((
            "time.duration_s",
            format!("the run begins at {} s on its clock", plan.grid.time_s(given.slider.step)),
            format!("a number above {}, the end on that clock", plan.grid.time_s(given.slider.step)),
        ));
    }
    let slider = &given.slider;
    let tangential = plan.elastic.tangential_axes() * plan.blocks;
    // Lists may leave out the anchors of a chain.
    let is_left_out = slider.stick_position_m.is_empty() && plan.elastic.as_chain().is_some();
    let anchors = if is_left_out { tangential } else { slider.stick_position_m.len() };
    let sizes = [
        ("displacements", slider.displacement_m.len(), plan.elastic.freedoms()),
        ("velocities", slider.velocity_m_per_s.len(), plan.elastic.freedoms()),
        ("anchors", anchors, tangential),
        ("states", slider.friction_state.len(), plan.friction.evolution_effects.len()),
    ];
    if let Some((what, found, needed)) = sizes.into_iter().find(|(_, found, needed)| found != needed) {
        return refuse(format!("it has {found} {what}, and the slider {needed}"));
    }
    given.begin(scenario, &mut plan);
    let slider = &plan.initial;
    if !slider.fits(&plan) {
        return refuse("it contradicts itself or the friction law".to_owned());
    }
    let moves = |n: &usize| slider.slip[*n] == 0.0 && slider.velocity_m_per_s[*n] != 0.0;
    let moving = (0..plan.blocks).find(|n| plan.friction.law.holds() && moves(n));
    moving
        .and_then(|n| refuse(format!("block {} moves, and blocks that stick without springs do not", n + 1)))
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    use super::{COLUMNS, GivenState, rows};

    fn resolve(sets: &[&str]) -> Result<Scenario, String> {
        let source = ScenarioSource::new("test.toml", "slider.blocks = 3\ntime.duration_s = 1");
        let source = sets.iter().fold(source, |source, set| source.with_override(set));
        Scenario::resolve_with(&source, &crate::Texts).map_err(|errors| errors.to_string())
    }

    #[test]
    fn a_table_has_a_row_for_each_block() {
        let header = COLUMNS.join(",");
        let columns = rows(&format!("{header}\n1e-6,0,2e-6,0\n\n 3e-6, -0.5, 0, 1 \n"), 2).unwrap();
        assert_eq!(columns, [vec![1e-6, 3e-6], vec![0.0, -0.5], vec![2e-6, 0.0], vec![2.0]]);
        for (text, expected) in [
            ("u,v\n", (1, "the header is \"u,v\"")),
            (&format!("{header}\n1,2,3\n"), (2, "\"1,2,3\" is not a row of 4 numbers")),
            (
                &format!("{header}\n1,2,nan,0\n"),
                (2, "stick_position_m of \"1,2,nan,0\" is not a finite number"),
            ),
            (&format!("{header}\n1,2,3,0.5\n"), (2, "slides is 0.5, not 0 or 1")),
            (&format!("{header}\n1,2,3,0\n"), (2, "1 row for 2 blocks")),
        ] {
            assert_eq!(rows(text, 2), Err((expected.0, expected.1.to_owned())));
        }
    }

    #[test]
    fn lists_give_the_state_and_the_clock() {
        let lists = ["initial.displacement_m=[1e-6,0,0]", "initial.at_s=0.25", "initial.sliding_blocks=[2]"];
        let plan = Plan::new(&resolve(&lists).unwrap());
        assert_eq!(plan.initial.step, 25_000_000);
        assert_eq!(plan.initial.displacement_m, [1e-6, 0.0, 0.0]);
        assert_eq!(plan.initial.velocity_m_per_s, [0.0; 3]);
        assert_eq!(plan.outside(plan.initial.step, u64::MAX).point_m, 2.5e-5);
        // Anchors that hold the blocks: block 1 is pulled by its neighbour and by the drive.
        let held_n = plan.friction.interfacial_stiffness_n_per_m * (1e-6 - plan.initial.stick_position_m[0]);
        let pull_n = -plan.elastic.stiffness_n_per_m * 1e-6 + 8e5 * (2.5e-5 - 1e-6);
        assert!((held_n - pull_n).abs() < 1e-9 * pull_n.abs(), "{held_n} against {pull_n}");
        let at_rest = resolve(&[]).unwrap();
        assert_eq!(resolve(&["time.start=at-rest"]).unwrap().hash(), at_rest.hash());
        assert_ne!(resolve(&lists).unwrap().hash(), at_rest.hash());
    }

    #[test]
    fn states_that_cannot_be_are_refused() {
        let none = "initial.displacement_m: ";
        for (sets, expected) in [
            (&["initial.displacement_m=[1,2]"][..], format!("{none}2 numbers for 3 blocks")),
            (&["initial.velocity_m_per_s=[0,0,1]"], format!("{none}none, beside other lists of a state")),
            (
                &["initial.displacement_m=[0,0,0]", "initial.sliding_blocks=[2,1]"],
                "initial.sliding_blocks: entry 2 is 1 (accepted: ascending whole numbers from 1 to 3)"
                    .to_owned(),
            ),
            (
                &["initial.displacement_m=[0,0,0]", "initial.at_s=1"],
                "time.duration_s: the run begins at 1 s on its clock (accepted: a number above 1".to_owned(),
            ),
            (
                &["friction.law=rigid", "initial.displacement_m=[0,0,0]", "initial.velocity_m_per_s=[0,1,0]"],
                format!("{none}block 2 moves, and blocks that stick without springs do not"),
            ),
            (
                &["friction.law=junctions", "initial.displacement_m=[0,0,0]"],
                format!(
                    "{none}contacts with friction.law = \"junctions\" have more state than these columns"
                ),
            ),
            (
                &["slider.rows=2", "slider.height_m=0.05", "initial.displacement_m=[0,0,0]"],
                format!("{none}a row for each block does not give the state of a slab"),
            ),
            (
                &["initial.from=a.mcap"],
                "initial.from: \"a.mcap\" is the log of a run, and logs are not".to_owned(),
            ),
            (
                &["initial.state=x"],
                "initial.state: no state can be read from initial.state: it does".to_owned(),
            ),
            (&["initial.at_s=0.5"], "initial.at_s: 0.5 is the time of a state, and none is given".to_owned()),
        ] {
            let error = resolve(sets).unwrap_err();
            assert!(error.contains(&expected), "{sets:?}: {error}");
        }
    }

    #[test]
    fn texts_of_states_are_exact_and_checked() {
        let plan = Plan::new(&resolve(&["initial.displacement_m=[0.1,1e-300,-0.0]"]).unwrap());
        let given = GivenState {
            keys: Vec::new(),
            motion: resolve(&[]).unwrap().motion_hash(),
            drive: None,
            mirrors: false,
            pace: [1, 2, 3],
            slider: plan.initial.clone(),
        };
        let text = given.to_text();
        let read = GivenState::from_text(&text).unwrap();
        assert_eq!((&read, read.slider.displacement_m[2].to_bits()), (&given, (-0.0_f64).to_bits()));
        let begun = Plan::new(&resolve(&[&format!("initial.state='{text}'")]).unwrap());
        assert_eq!((&begun.initial, begun.given.unwrap().pace), (&plan.initial, Some([1, 2, 3])));
        // Any change of a character is found.
        for at in 0..text.len() {
            let mut changed = text.clone().into_bytes();
            changed[at] ^= 1;
            let changed = String::from_utf8(changed).unwrap();
            assert!(GivenState::from_text(&changed).is_err(), "{changed}");
        }
        // With a right checksum, what it says must fit, whichever motion it is of.
        let json = text.split_once(' ').unwrap().1;
        let saved = "\"count\":1,\"anchor_m\":[0.0],\"slips_until_step\":[0],\"breaks\":[0],\
                     \"totals\":{\"breaks\":0,\"repins\":0},\"totals_before\":{\"breaks\":0,\"repins\":0}";
        let contradicts = "it contradicts itself or the friction law";
        for (of_all, old, new, expected) in [
            (true, "\"slip\":[0.0,", "\"slip\":[0.5,", contradicts),
            (true, "\"slip\":[0.0,", "\"slip\":[", contradicts),
            (true, "\"sliding\":0,", "\"sliding\":0,\"just_detached\":[0],", contradicts),
            (true, "\"sliding\":0,", &format!("\"sliding\":0,\"junctions\":{{{saved}}},"), contradicts),
            (false, "\"detached\":0", "\"detached\":1", contradicts),
            (false, "\"sliding\":0", "\"sliding\":4", contradicts),
            (false, "\"sliding\":0,", "\"sliding\":0,\"stuck_since_step\":[1,1,1],", contradicts),
            (false, "\"tangential_force_n\":[", "\"tangential_force_n\":[0.0,", contradicts),
            (true, "\"velocity_m_per_s\":[", "\"velocity_m_per_s\":[0.0,", "it has 4 velocities"),
            (true, "\"sliding\":0,", "\"sliding\":0,\"friction_state\":[1.0],", "it has 1 states"),
            (true, "\"displacement_m\":[0.1", "\"displacement_m\":[1e999", "number out of range"),
        ] {
            assert!(json.contains(old), "{old} is not in {json}");
            let forged = json.replacen(old, new, 1);
            let of_another = forged.replacen(&given.motion, "another", 1);
            for forged in [Some(forged), of_all.then_some(of_another)].into_iter().flatten() {
                let checksum = &blake3::hash(forged.as_bytes()).to_hex().as_str()[..16].to_owned();
                let error = resolve(&[&format!("initial.state='{checksum} {forged}'")]).unwrap_err();
                assert!(error.contains("initial.state: ") && error.contains(expected), "{new}: {error}");
            }
        }
    }
}
