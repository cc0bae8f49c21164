//! Rules of rate-and-state friction: what its start and its solver need.

use asperity_record::short;

use crate::law::rate_and_state::MOST_STATE;
use crate::plan::derive::evolution_effects;
use crate::plan::initial::states_at_start;
use crate::scenario::Scenario;
use crate::scenario::choices::Start;
use crate::scenario::source::Refusals;

/// The law, in refusals.
const THE_LAW: &str = "friction.law = \"rate-and-state\"";

pub(super) fn steady_sliding_is_a_start(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (drive, slider) = (&scenario.drive, &scenario.slider);
    let Some(law) = scenario.contact_law().rate_and_state() else { return };
    if slider.is_lattice() {
        let key = if slider.is_over_area() { "slider.across" } else { "slider.rows" };
        let what = scenario.elastic().table.name;
        let problem = format!("{THE_LAW} is available for chains and single blocks, not for a {what}");
        refusals.refuse(key, problem, "1, or another friction.law");
    }
    let (friction, is_loaded) = (&scenario.friction, scenario.time.start != Start::AtRest);
    let begins = |n: usize| match is_loaded {
        true => friction.velocity_at_start_m_per_s(n) > 0.0,
        false => friction.theta_at_start_s(n) > 0.0,
    };
    let is_free = (0..slider.contacts() as usize).all(begins) || scenario.initial.is_given();
    let slow = scenario.speed_at_start_m_per_s();
    if drive.velocity_m_per_s == 0.0 && !is_free {
        refusals.refuse(
            "drive.velocity_m_per_s",
            "0: contacts begin in the state of steady sliding at this velocity",
            "a number above 0, or friction.initial_velocity_m_per_s; drive.hold_from_s stops the drive",
        );
    } else if law.event_speed_m_per_s <= slow {
        let (event, given) = (law.event_speed_m_per_s, friction.event_speed_m_per_s != 0.0);
        let whose =
            if slow == drive.velocity_m_per_s { "drive.velocity_m_per_s" } else { "the largest V(0)" };
        let of = if given { event.to_string() } else { format!("0, which stands for {},", short(event)) };
        let problem = format!("{of} is not above {whose} = {slow}, at which blocks creep without an event");
        let or = if given { ", or 0 for at least 10 times it" } else { "" };
        refusals.refuse("friction.event_speed_m_per_s", problem, format!("a number above {slow}{or}"));
    }
    free_starts_are_of_one_kind(scenario, is_loaded, refusals);
    // The rest is of keys that are others there.
    if slider.is_in_medium() {
        return;
    }
    let swing = &scenario.prestress;
    if swing.swing_ratio != 0.0 && swing.swing_period_s < scenario.time.step_s {
        let problem =
            format!("{} is shorter than time.step_s, to which records are rounded", swing.swing_period_s);
        refusals.refuse(
            "prestress.swing_period_s",
            problem,
            format!("a number from {:e}", scenario.time.step_s),
        );
    }
    if drive.stiffness_n_per_m == 0.0 && scenario.time.start == Start::Loaded {
        let problem = "0: nothing balances friction in steady sliding";
        let accepted = "a number above 0, or time.start = \"at-rest\"";
        refusals.refuse("drive.stiffness_n_per_m", problem, accepted);
    }
    if !law.inertia && law.radiation_kg_per_s == 0.0 {
        let problem = "0: without inertia only radiation bounds the velocity of a slip";
        let accepted = "a number above 0, or friction.inertia = true";
        refusals.refuse("friction.radiation_kg_per_s", problem, accepted);
    }
    if !law.inertia && slider.relative_damping != 0.0 {
        let problem = format!(
            "{}: without inertia the velocity of a block follows from the forces on it alone, not from its neighbours'",
            slider.relative_damping
        );
        refusals.refuse("slider.relative_damping", problem, "0, or friction.inertia = true");
    }
    // Times, and with them the way of the drive, are known to a rounding of the whole run.
    let driven_m = drive.fastest_m_per_s() * scenario.time.duration_s;
    let least_slip_m = f64::EPSILON * driven_m;
    if law.critical_slip_m < least_slip_m {
        refusals.refuse(
            "friction.critical_slip_m",
            format!(
                "{:e} is less than the rounding of the way of the drive in {} s, {driven_m:.3e} m",
                law.critical_slip_m, scenario.time.duration_s
            ),
            format!("a number from {least_slip_m:.3e}, or a shorter time.duration_s"),
        );
    }
    let offsets = friction.evolution_offsets.len();
    // Lists of the wrong length have a rule of their own.
    if offsets != 0 && offsets != slider.contacts() as usize {
        return;
    }
    let effects = evolution_effects(scenario);
    if let Some((n, b)) = effects.iter().enumerate().find(|(_, b)| **b <= 0.0) {
        let problem = format!("block {} gets b = {b}", n + 1);
        refusals.refuse("friction.evolution_offsets", problem, "b > 0 for every block");
    }
    let states = states_at_start(scenario, &law);
    let most = (0..).zip(states).max_by(|(_, a), (_, b)| a.abs().total_cmp(&b.abs()));
    let Some((n, most)): Option<(usize, f64)> = most else { return };
    let bound = MOST_STATE * law.direct_effect;
    let theta_s = friction.theta_at_start_s(n);
    if most.abs() > bound && theta_s > 0.0 {
        let theta_s_at = |state: f64| law.theta_s(effects[n], state);
        refusals.refuse(
            key_of_start(scenario, THETAS, &friction.initial_thetas_s),
            format!("block {} gets psi = {most:.3} from theta(0) = {theta_s:e} s: e^(-psi / a) has no digits left", n + 1),
            format!(
                "|psi| up to {}, with theta from {:.3e} to {:.3e}",
                short(bound),
                theta_s_at(-bound),
                theta_s_at(bound)
            ),
        );
    } else if most.abs() > bound {
        refusals.refuse(
            "friction.direct_effect",
            format!("{:e}: with psi = {most:.3} at the start e^(-psi / a) underflows", law.direct_effect),
            format!("a number above {:.3e}", 1.0005 * most.abs() / MOST_STATE),
        );
    }
}

/// The keys of a free start that are for all blocks alike, and their lists.
const VELOCITIES: [&str; 2] = ["friction.initial_velocity_m_per_s", "friction.initial_velocities_m_per_s"];
const THETAS: [&str; 2] = ["friction.initial_theta_s", "friction.initial_thetas_s"];

/// The one of a key and its list by which a free start is given.
fn key_of_start(scenario: &Scenario, [alike, listed]: [&'static str; 2], list: &[f64]) -> &'static str {
    match (list.is_empty(), scenario.friction.initial_csv.is_empty()) {
        (true, _) => alike,
        (false, true) => listed,
        (false, false) => "friction.initial_csv",
    }
}

fn free_starts_are_of_one_kind(scenario: &Scenario, is_loaded: bool, refusals: &mut Refusals<'_>) {
    let friction = &scenario.friction;
    for (keys, alike, listed) in [
        (VELOCITIES, friction.initial_velocity_m_per_s, &friction.initial_velocities_m_per_s),
        (THETAS, friction.initial_theta_s, &friction.initial_thetas_s),
    ] {
        let key = key_of_start(scenario, keys, listed);
        if alike == 0.0 && listed.is_empty() {
            continue;
        }
        if scenario.initial.is_given() {
            let problem = "the state is that of a log already";
            refusals.refuse(key, problem, "none, or no initial.from and initial.state");
        } else if keys == VELOCITIES && !is_loaded {
            let problem = "a velocity beside time.start = \"at-rest\", with which blocks begin at rest";
            refusals.refuse(key, problem, "none, or time.start = \"loaded\"");
        }
        if alike != 0.0 && !listed.is_empty() {
            refusals.refuse(
                keys[0],
                format!("{alike} beside {key}, which has one for each block"),
                "one of them",
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, ScenarioSource};

    fn errors(text: &str) -> String {
        Scenario::resolve(&ScenarioSource::new("test.toml", text)).unwrap_err().to_string()
    }

    #[test]
    fn what_its_start_and_its_solver_lack_is_refused_with_place_key_value_and_reason() {
        for (line, expected) in [
            (
                "slider.rows = 3\nslider.blocks = 11",
                "1:15: slider.rows: friction.law = \"rate-and-state\" is available for chains and single blocks, not for a slab \
                 (accepted: 1, or another friction.law)",
            ),
            (
                "drive.kind = \"left-right\"",
                "1:14: drive.kind: \"left-right\": by friction.law = \"rate-and-state\" blocks begin in steady sliding, in one direction \
                 (accepted: \"side\" or \"top\")",
            ),
            (
                "drive.velocity_m_per_s = 0",
                "1:26: drive.velocity_m_per_s: 0: contacts begin in the state of steady sliding at this velocity \
                 (accepted: a number above 0, or friction.initial_velocity_m_per_s; drive.hold_from_s stops the drive)",
            ),
            (
                "friction.initial_velocity_m_per_s = 0.001",
                "friction.event_speed_m_per_s: 0, which stands for 0.001, is not above the largest V(0) = 0.001, at \
                 which blocks creep without an event (accepted: a number above 0.001)",
            ),
            (
                "friction.initial_velocity_m_per_s = -1",
                "1:37: friction.initial_velocity_m_per_s: -1 is not accepted (accepted: a number from 0)",
            ),
            (
                "slider.blocks = 2\nfriction.initial_velocities_m_per_s = [1e-4, 0]",
                "2:39: friction.initial_velocities_m_per_s: [1e-4, 0] is not accepted (accepted: a list, each a number \
                 above 0)",
            ),
            (
                "friction.initial_thetas_s = [1, 2]",
                "1:29: friction.initial_thetas_s: 2 numbers for 100 blocks (accepted: 100 numbers, or none)",
            ),
            (
                "slider.blocks = 2\nfriction.initial_theta_s = 1\nfriction.initial_thetas_s = [1, 2]",
                "2:28: friction.initial_theta_s: 1 beside friction.initial_thetas_s, which has one for each block \
                 (accepted: one of them)",
            ),
            (
                "friction.initial_velocity_m_per_s = 1e-5\ntime.start = \"at-rest\"",
                "1:37: friction.initial_velocity_m_per_s: a velocity beside time.start = \"at-rest\", with which blocks \
                 begin at rest (accepted: none, or time.start = \"loaded\")",
            ),
            (
                "slider.blocks = 2\nfriction.direct_effect = 1e-3\nfriction.initial_thetas_s = [1, 1e10]",
                "3:29: friction.initial_thetas_s: block 2 gets psi = 0.945 from theta(0) = 1e10 s: e^(-psi / a) has no digits left \
                 (accepted: |psi| up to 0.7, with theta from 2.297e-38 to 7.858e2)",
            ),
            (
                "slider.blocks = 1\nfriction.direct_effect = 5e-4\nfriction.initial_theta_s = 1e-30",
                "3:28: friction.initial_theta_s: block 1 gets psi = -0.436 from theta(0) = 1e-30 s: e^(-psi / a) has no digits",
            ),
            (
                "friction.initial_csv = \"no such file\"",
                "1:24: friction.initial_csv: \"no such file\" is named, and its values are missing",
            ),
            (
                "prestress.swing_ratio = 0.1",
                "prestress.swing_period_s: 0 is shorter than time.step_s, to which records are rounded (accepted: a \
                 number from 1e-8)",
            ),
            (
                "prestress.swing_ratio = 0.1\nprestress.swing_period_s = 1\nprestress.swing_from_s = 1e-9",
                "3:26: prestress.swing_from_s: 0.000000001 is not a whole number of steps of 1e-8 s",
            ),
            (
                "prestress.swing_ratio = 1e7\nprestress.swing_period_s = 1",
                "1:25: prestress.swing_ratio: 1e7 is not accepted (accepted: a number from -1000000 to 1000000)",
            ),
            (
                "prestress.course_s = [1, 1, 1]\nprestress.course_ratio = [0, 0.1, 0]",
                "1:22: prestress.course_s: goes from 1 to 1 (accepted: times that ascend; two may be equal, for a jump)",
            ),
            (
                "friction.event_speed_m_per_s = 0.00005",
                "1:32: friction.event_speed_m_per_s: 0.00005 is not above drive.velocity_m_per_s = 0.0001, at which \
                 blocks creep without an event (accepted: a number above 0.0001, or 0 for at least 10 times it)",
            ),
            (
                "drive.stiffness_n_per_m = 0",
                "1:27: drive.stiffness_n_per_m: 0: nothing balances friction in steady sliding (accepted: a number above \
                 0, or time.start = \"at-rest\")",
            ),
            (
                "friction.inertia = false\nslider.relative_damping = 0",
                "test.toml: friction.radiation_kg_per_s: 0: without inertia only radiation bounds the velocity of a slip \
                 (accepted: a number above 0, or friction.inertia = true)",
            ),
            (
                "slider.relative_damping = 0.2\nfriction.inertia = false\nfriction.radiation_kg_per_s = 1",
                "1:27: slider.relative_damping: 0.2: without inertia the velocity of a block follows from the forces on \
                 it alone, not from its neighbours' (accepted: 0, or friction.inertia = true)",
            ),
            (
                "slider.blocks = 2\nfriction.evolution_offsets = [0, -0.015]",
                "2:30: friction.evolution_offsets: block 2 gets b = 0 (accepted: b > 0 for every block)",
            ),
            (
                "friction.direct_effect = 1e-9",
                "1:26: friction.direct_effect: 1e-9: with psi = 0.531 at the start e^(-psi / a) underflows \
                 (accepted: a number above 7.588e-4)",
            ),
            (
                "friction.critical_slip_m = 1e-20",
                "1:28: friction.critical_slip_m: 1e-20 is less than the rounding of the way of the drive in 5 s, \
                 5.000e-4 m (accepted: a number from 1.110e-19, or a shorter time.duration_s)",
            ),
            (
                "friction.evolution_offsets = [0.1]",
                "1:30: friction.evolution_offsets: 1 number for 100 blocks",
            ),
            (
                "time.tolerance = 0.1",
                "1:18: time.tolerance: 0.1 is not accepted (accepted: a number from 0.000000000001 to 0.01)",
            ),
            (
                "drive.course_s = [1, 2]",
                "drive.course_m_per_s: 0 values at 2 times (accepted: as many as drive.course_s",
            ),
            (
                "drive.course_s = [1, 1, 1]\ndrive.course_m_per_s = [1e-4, 0, 1]",
                "1:18: drive.course_s: goes from 1 to 1 (accepted: times that ascend; two may be equal, for a jump)",
            ),
            (
                "drive.course_s = [1, 2]\ndrive.course_m_per_s = [1e-3, 0]",
                "2:24: drive.course_m_per_s: begins with 0.001, but before it drive.velocity_m_per_s is 0.0001",
            ),
            (
                "drive.course_s = [1, 2.000000001]\ndrive.course_m_per_s = [1e-4, 0]",
                "1:18: drive.course_s: 2.000000001 is not a whole number of steps of 1e-8 s",
            ),
        ] {
            let found = errors(&format!("{line}\nfriction.law = \"rate-and-state\""));
            let expected = expected.strip_prefix("test.toml: ").unwrap_or(expected);
            assert!(found.contains(expected) && found.lines().count() == 1, "{line}: {found}");
        }
    }

    #[test]
    fn a_run_begins_in_steady_sliding_unless_it_is_to_begin_at_rest() {
        let resolve = |start: &str| {
            let text = format!("friction.law = \"rate-and-state\"\n{start}");
            Scenario::resolve(&ScenarioSource::new("test.toml", text))
                .unwrap_or_else(|errors| panic!("{errors}"))
        };
        let (default, loaded) = (resolve(""), resolve("time.start = \"loaded\""));
        let rest = resolve("time.start = \"at-rest\"");
        assert_eq!((default.hash(), &default), (loaded.hash(), &loaded));
        assert_ne!(default.hash(), rest.hash());
        for scenario in [default, rest] {
            for shown in [scenario.to_commented_toml(), scenario.to_editable_toml()] {
                let again = Scenario::resolve(&ScenarioSource::logged("run.mcap", &shown)).unwrap();
                assert_eq!(again, scenario);
            }
        }
    }
}
