//! Rules of a fault line in a medium.

use asperity_record::{counted, short};

use crate::law::rate_and_state::Evolution;
use crate::plan::medium::FaultLine;
use crate::scenario::Scenario;
use crate::scenario::choices::{DriveKind, MediumChoice, Start};
use crate::scenario::rules::rate_and_state::MOST_STATE;
use crate::scenario::source::Refusals;

/// Fewest nodes, below which there is no transform.
const FEWEST_NODES: u32 = 4;

/// Refuses drives and starts of the other kind: each is for a medium, or for bonds.
pub(super) fn plates_are_below_a_medium(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let is_in_medium = scenario.slider.is_in_medium();
    let medium = scenario.slider.medium.word();
    let start = scenario.time.start;
    if scenario.drive.kind == DriveKind::Plate && !is_in_medium {
        let problem = "\"plate\" is what is below a fault line, and slider.medium is \"none\"";
        refusals.refuse("drive.kind", problem, "another drive, or a slider.medium");
    }
    if matches!(start, Start::Uniform | Start::Steady) != is_in_medium {
        let problem = format!("{:?} is no start with slider.medium = {medium:?}", start.word());
        let accepted = if is_in_medium { "\"uniform\" or \"steady\"" } else { "\"at-rest\" or \"loaded\"" };
        refusals.refuse("time.start", problem, accepted);
    }
}

pub(super) fn a_fault_line_is_known(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (keys, slider) = (&scenario.medium, &scenario.slider);
    if !slider.is_in_medium() {
        return;
    }
    let (before, medium) = (refusals.errors.len(), slider.medium.word());
    let is_periodic = slider.medium == MediumChoice::Periodic;
    if slider.blocks < FEWEST_NODES || (is_periodic && !slider.blocks.is_power_of_two()) {
        let problem = format!("{} in slider.medium = {medium:?}", counted(slider.blocks.into(), "node"));
        let of = if is_periodic { "a power of two" } else { "a whole number" };
        refusals.refuse("slider.blocks", problem, format!("{of} from {FEWEST_NODES}"));
    }
    if is_periodic != (keys.width_m > 0.0) {
        let problem = format!("{} with slider.medium = {medium:?}", keys.width_m);
        let accepted = match is_periodic {
            true => "a number above 0, as nothing else loads the mean slip",
            false => "0, or slider.medium = \"periodic\"",
        };
        refusals.refuse("medium.width_m", problem, accepted);
    }
    let knots = keys.profile_m.len();
    if !keys.profile_m.is_sorted_by(|a, b| a < b) {
        refusals.refuse("medium.profile_m", "depths that do not ascend", "ascending numbers from 0");
    }
    for (key, list) in [
        ("medium.direct_effect", &keys.direct_effect),
        ("medium.evolution_effect", &keys.evolution_effect),
        ("medium.critical_slip_m", &keys.critical_slip_m),
        ("medium.normal_stress_pa", &keys.normal_stress_pa),
    ] {
        if list.len() != 1 && (list.is_empty() || list.len() != knots) {
            let [values, depths] =
                [(list.len(), "value"), (knots, "depth")].map(|(n, of)| counted(n as u64, of));
            let problem = format!("{values} at {depths} of medium.profile_m");
            refusals.refuse(key, problem, "one for all nodes, or one for each depth of medium.profile_m");
        }
    }
    if scenario.friction.evolution == Evolution::Prz {
        let problem = "\"prz\" in a medium, for which the page of its equations has no form";
        refusals.refuse("friction.evolution", problem, "\"ageing\" or \"slip\"");
    }
    stations_are_nodes(scenario, refusals);
    if refusals.errors.len() == before {
        starts_have_states(scenario, refusals);
    }
}

fn stations_are_nodes(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (recording, bottom_m) = (&scenario.recording, scenario.slider.length_m);
    let stations_m = &recording.stations_m;
    if stations_m.is_empty() {
        return;
    }
    let key = "recording.stations_m";
    if recording.series_every == 0 || !recording.series_blocks.is_empty() {
        let problem = "depths instead of recording.series_blocks, recorded by recording.series_every";
        refusals.refuse(
            key,
            problem,
            "none, or recording.series_every from 1 and no recording.series_blocks",
        );
        return;
    }
    if let Some(depth_m) = stations_m.iter().find(|depth_m| **depth_m > bottom_m) {
        let problem = format!("{depth_m} is below the fault line");
        refusals.refuse(key, problem, format!("numbers from 0 to slider.length_m = {bottom_m}"));
    } else if let Some(at) = scenario.series_nodes().windows(2).position(|two| two[0] >= two[1]) {
        let [above_m, below_m] = [stations_m[at], stations_m[at + 1]];
        let problem = format!("{below_m} behind {above_m} is no later node");
        let spacing = short(scenario.slider.spacing_m());
        refusals.refuse(key, problem, format!("ascending depths, of nodes {spacing} m apart"));
    }
}

/// Refuses nodes that have no state at the start, or one with which `e^(-psi / a)` has no digits left.
fn starts_have_states(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let Some(law) = scenario.contact_law().rate_and_state() else { return };
    let velocity = scenario.drive.velocity_m_per_s;
    let is_uniform = scenario.time.start == Start::Uniform;
    if velocity == 0.0 && !(is_uniform && scenario.friction.initial_velocity_m_per_s > 0.0) {
        let problem = "0: nodes begin with the state of steady sliding at this velocity";
        let accepted =
            "a number above 0, or time.start = \"uniform\" with friction.initial_velocity_m_per_s above 0";
        return refusals.refuse("drive.velocity_m_per_s", problem, accepted);
    }
    let Some(FaultLine { medium, states, .. }) = FaultLine::of(scenario) else { return };
    let key = "medium.evolution_effect";
    let nodes = 0..medium.nodes();
    if let Some(n) = nodes.clone().find(|&n| is_uniform && medium.evolution_effect[n] == 0.0) {
        let problem = format!("node {} gets b = 0, and no state balances a uniform stress", n + 1);
        return refusals.refuse(key, problem, "b > 0 for every node, or time.start = \"steady\"");
    }
    let state_over_a = |n: usize| {
        (law.reference_coefficient + medium.evolution_effect[n] * states[n]) / medium.direct_effect[n]
    };
    if let Some(n) =
        nodes.into_iter().find(|&n| state_over_a(n).is_nan() || state_over_a(n).abs() > MOST_STATE)
    {
        let problem = format!(
            "node {} gets psi / a = {} at the start: e^(-psi / a) has no digits left",
            n + 1,
            short(state_over_a(n))
        );
        refusals.refuse("medium.direct_effect", problem, format!("|psi / a| up to {MOST_STATE}"));
    }
}

#[cfg(test)]
mod tests {
    use crate::{Scenario, ScenarioSource};

    const LINE: &str = "slider.medium = \"half-space\"\nslider.blocks = 8\nslider.length_m = 8000\n\
                        drive.velocity_m_per_s = 1e-9\nmedium.profile_m = [2000, 3000]\n\
                        medium.direct_effect = [0.01, 0.02]\nmedium.evolution_effect = [0.015]\n\
                        medium.critical_slip_m = [0.008]\nmedium.normal_stress_pa = [5e7]\n";

    fn resolve(sets: &[&str]) -> Result<Scenario, String> {
        let source = ScenarioSource::new("line.toml", LINE);
        source.resolve("line", sets, &crate::Texts).map_err(|errors| errors.to_string())
    }

    #[test]
    fn what_a_fault_line_lacks_is_refused_with_key_value_and_range() {
        let none = "slider.medium=none";
        let lists = ["profile_m", "direct_effect", "evolution_effect", "critical_slip_m", "normal_stress_pa"];
        let without: Vec<String> = lists.iter().map(|list| format!("medium.{list}=[]")).collect();
        let bonds = |set| [&[none, set], &*without.iter().map(String::as_str).collect::<Vec<_>>()].concat();
        for (sets, expected) in [
            (
                vec!["slider.blocks=2"],
                "slider.blocks: 2 nodes in slider.medium = \"half-space\" (accepted: a whole number from 4)",
            ),
            (
                vec!["slider.medium=periodic", "medium.width_m=1e4", "slider.blocks=12"],
                "slider.blocks: 12 nodes in slider.medium = \"periodic\" (accepted: a power of two from 4)",
            ),
            (
                vec!["slider.medium=periodic"],
                "medium.width_m: 0 with slider.medium = \"periodic\" (accepted: a number above 0",
            ),
            (
                vec!["medium.width_m=1"],
                "medium.width_m: 1 with slider.medium = \"half-space\" (accepted: 0, or ",
            ),
            (vec!["medium.profile_m=[3000,2000]"], "medium.profile_m: depths that do not ascend"),
            (
                vec!["medium.profile_m=[0,1,2]"],
                "medium.direct_effect: 2 values at 3 depths of medium.profile_m (accepted: one for",
            ),
            (vec!["medium.normal_stress_pa=[]"], "medium.normal_stress_pa: 0 values at 2 depths"),
            (
                vec!["medium.critical_slip_m=[0]"],
                "medium.critical_slip_m: [0] is not accepted (accepted: a list, each a number above 0)",
            ),
            (
                vec!["medium.evolution_effect=[-1]"],
                "medium.evolution_effect: [-1] is not accepted (accepted: a list, each a number from 0)",
            ),
            (
                vec!["medium.evolution_effect=[0]"],
                "medium.evolution_effect: node 1 gets b = 0, and no state balances",
            ),
            (vec!["medium.direct_effect=[5e-4]"], "medium.direct_effect: node 1 gets psi / a = "),
            (vec!["medium.profile_csv=no such file", "medium.profile_m=[]"], ""),
            (vec!["friction.evolution=prz"], "friction.evolution: \"prz\" in a medium"),
            (vec!["drive.velocity_m_per_s=0"], "drive.velocity_m_per_s: 0: nodes begin with the state"),
            (
                vec!["drive.velocity_m_per_s=0.01"],
                "friction.event_speed_m_per_s: 0, which stands for 0.001, is not above drive.velocity",
            ),
            (
                vec!["time.start=loaded"],
                "time.start: \"loaded\" is no start with slider.medium = \"half-space\" (accepted: \"uniform\" or",
            ),
            (
                bonds("time.start=steady"),
                "time.start: \"steady\" is no start with slider.medium = \"none\" (accepted: \"at-rest\" or",
            ),
            (bonds("drive.kind=plate"), "drive.kind: \"plate\" is what is below a fault line"),
            (
                vec![none],
                "medium.profile_m: [2000, 3000] has no meaning for slider.medium = \"none\": only nodes",
            ),
            (
                vec!["recording.stations_m=[0]"],
                "recording.stations_m: depths instead of recording.series_blocks",
            ),
            (
                vec!["recording.series_every=1", "recording.stations_m=[0, 8001]"],
                "recording.stations_m: 8001 is below the fault line (accepted: numbers from 0 to slider.length_m = 8000)",
            ),
            (
                vec!["recording.series_every=1", "recording.stations_m=[900, 1100]"],
                "recording.stations_m: 1100 behind 900 is no later node (accepted: ascending depths, of nodes 1000 m apart)",
            ),
            (
                vec!["friction.inertia=true"],
                "friction.inertia: true has no meaning for slider.medium = \"half-space\": its nodes",
            ),
            (
                vec!["friction.law=rigid"],
                "friction.law: \"rigid\" has no meaning for slider.medium = \"half-space\"",
            ),
            (
                vec!["friction.radiation_kg_per_s=1"],
                "friction.radiation_kg_per_s: 1 has no meaning for slider.medium",
            ),
            (vec!["slider.rows=2"], "slider.rows: 2 has no meaning for slider.medium"),
            (vec!["slider.across=2"], "slider.across: 2 has no meaning for slider.medium"),
            (
                vec!["slider.density_kg_per_m3=2"],
                "slider.density_kg_per_m3: 2 has no meaning for slider.medium",
            ),
            (
                vec!["slider.left_end=clamped"],
                "slider.left_end: \"clamped\" has no meaning for slider.medium",
            ),
            (
                vec!["slider.relative_damping=0.2"],
                "slider.relative_damping: 0.2 has no meaning for slider.medium",
            ),
            (vec!["drive.kind=top"], "drive.kind: \"top\" has no meaning for slider.medium"),
            (
                vec!["drive.stiffness_n_per_m=1"],
                "drive.stiffness_n_per_m: 1 has no meaning for slider.medium",
            ),
            (vec!["drive.course_s=[1]"], "drive.course_s: [1] has no meaning for slider.medium"),
            (vec!["normal_load.tilt=0.1"], "normal_load.tilt: 0.1 has no meaning for slider.medium"),
            (
                vec!["normal_load.schedule_s=[1]"],
                "normal_load.schedule_s: [1] has no meaning for slider.medium",
            ),
            (vec!["initial_shear.beta=1"], "initial_shear.beta: 1 has no meaning for slider.medium"),
            (vec!["prestress.ratio=0.1"], "prestress.ratio: 0.1 has no meaning for slider.medium"),
            (
                vec!["friction.critical_slip_m=1"],
                "friction.critical_slip_m: 1 has no meaning for slider.medium",
            ),
        ] {
            let error = resolve(&sets).err().unwrap_or_default();
            assert!(error.contains(expected), "{sets:?}: {error}");
            let is_one = error.lines().count() == 1 || sets[0] == none;
            assert!(is_one || expected.is_empty(), "{sets:?}: {error}");
        }
    }
}
