//! Rules of a fault line in a medium.

use asperity_record::{counted, short};

use crate::law::rate_and_state::{Evolution, MOST_STATE};
use crate::plan::medium::FaultLine;
use crate::scenario::Scenario;
use crate::scenario::choices::{DriveKind, MediumChoice, Start};
use crate::scenario::source::Refusals;

/// Fewest nodes, below which there is no transform.
const FEWEST_NODES: u32 = 4;

pub(super) fn a_fault_line_is_known(scenario: &Scenario, refusals: &mut Refusals<'_>) {
    let (keys, slider, recording) = (&scenario.medium, &scenario.slider, &scenario.recording);
    let medium = format!("slider.medium = {:?}", slider.medium.word());
    let (kind, start) = (scenario.drive.kind, scenario.time.start);
    let starts = "in a medium \"uniform\" or \"steady\", elsewhere \"at-rest\" or \"loaded\"";
    for (key, word, is_of_medium, accepted) in [
        ("drive.kind", kind.word(), kind == DriveKind::Plate, "in a medium \"plate\", elsewhere another"),
        ("time.start", start.word(), matches!(start, Start::Uniform | Start::Steady), starts),
    ] {
        if is_of_medium != slider.is_in_medium() {
            refusals.refuse(key, format!("{word:?} with {medium}"), accepted);
        }
    }
    if !slider.is_in_medium() {
        return;
    }
    let is_periodic = slider.medium == MediumChoice::Periodic;
    if slider.blocks < FEWEST_NODES || (is_periodic && !slider.blocks.is_power_of_two()) {
        let accepted = format!("a whole number from {FEWEST_NODES}, in a periodic one a power of two");
        refusals.refuse("slider.blocks", format!("{} with {medium}", slider.blocks), accepted);
    }
    if is_periodic != (keys.width_m > 0.0) {
        let accepted = "of a periodic one a number above 0, as nothing else loads the mean slip; of others 0";
        refusals.refuse("medium.width_m", format!("{} with {medium}", keys.width_m), accepted);
    }
    if !keys.profile_m.is_sorted_by(|a, b| a < b) {
        refusals.refuse("medium.profile_m", "depths that do not ascend", "ascending numbers from 0");
    }
    for (key, list) in keys.lists().into_iter().filter(|(_, list)| !keys.has_values(list)) {
        let counts = [(list.len(), "value"), (keys.profile_m.len(), "depth")];
        let [values, depths] = counts.map(|(count, of)| counted(count as u64, of));
        let accepted = "one for all nodes, or one for each depth of medium.profile_m";
        refusals.refuse(key, format!("{values} at {depths} of medium.profile_m"), accepted);
    }
    if scenario.friction.evolution == Evolution::Prz {
        refusals.refuse("friction.evolution", "\"prz\" in a medium", "\"ageing\" or \"slip\"");
    }
    let (stations_m, bottom_m) = (&recording.stations_m, slider.length_m);
    let is_below = stations_m.iter().any(|depth_m| *depth_m > bottom_m);
    if !stations_m.is_empty() && (recording.series_every == 0 || !recording.series_blocks.is_empty()) {
        let problem = "depths instead of recording.series_blocks, recorded by recording.series_every";
        let accepted = "none, or recording.series_every from 1 and no recording.series_blocks";
        refusals.refuse("recording.stations_m", problem, accepted);
    } else if !stations_m.is_empty() && (is_below || !scenario.series_nodes().is_sorted_by(|a, b| a < b)) {
        let accepted =
            format!("ascending depths to {bottom_m}, of nodes {} m apart", short(slider.spacing_m()));
        let problem = format!("{stations_m:?} are not those of as many nodes");
        refusals.refuse("recording.stations_m", problem, accepted);
    }
    let fault = FaultLine::of(scenario).filter(|_| refusals.errors.is_empty());
    let Some(FaultLine { medium, states, .. }) = fault else { return };
    let f0 = scenario.friction.reference_coefficient;
    let over_a = |n: usize| (f0 + medium.evolution_effect[n] * states[n]) / medium.direct_effect[n];
    if let Some(n) = (0..medium.nodes()).find(|&n| over_a(n).is_nan() || over_a(n).abs() > MOST_STATE) {
        let problem = format!("node {} gets psi / a = {} at the start", n + 1, short(over_a(n)));
        let accepted = format!("|psi / a| up to {MOST_STATE}; with time.start = \"uniform\", b above 0");
        refusals.refuse("medium.direct_effect", problem, accepted);
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
                "slider.blocks: 2 with slider.medium = \"half-space\" (accepted: a whole number from 4",
            ),
            (
                vec!["slider.medium=periodic", "medium.width_m=1e4", "slider.blocks=12"],
                "slider.blocks: 12 with slider.medium = \"periodic\" (accepted: a whole number from 4, in a periodic one a power",
            ),
            (
                vec!["slider.medium=periodic"],
                "medium.width_m: 0 with slider.medium = \"periodic\" (accepted: of a periodic one a number above 0",
            ),
            (
                vec!["medium.width_m=1"],
                "medium.width_m: 1 with slider.medium = \"half-space\" (accepted: of a periodic one",
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
            (vec!["medium.evolution_effect=[0]"], "medium.direct_effect: node 1 gets psi / a = "),
            (vec!["medium.direct_effect=[5e-4]"], "medium.direct_effect: node 1 gets psi / a = "),
            (vec!["medium.profile_csv=no such file", "medium.profile_m=[]"], ""),
            (vec!["friction.evolution=prz"], "friction.evolution: \"prz\" in a medium"),
            (vec!["drive.velocity_m_per_s=0"], "drive.velocity_m_per_s: 0: contacts begin in the state"),
            (
                vec!["drive.velocity_m_per_s=0.01"],
                "friction.event_speed_m_per_s: 0, which stands for 0.001, is not above drive.velocity",
            ),
            (
                vec!["time.start=loaded"],
                "time.start: \"loaded\" with slider.medium = \"half-space\" (accepted: in a medium \"uniform\" or",
            ),
            (
                bonds("time.start=steady"),
                "time.start: \"steady\" with slider.medium = \"none\" (accepted: in a medium",
            ),
            (bonds("drive.kind=plate"), "drive.kind: \"plate\" with slider.medium = \"none\""),
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
                "recording.stations_m: [0.0, 8001.0] are not those of as many nodes (accepted: ascending depths to 8000, of",
            ),
            (
                vec!["recording.series_every=1", "recording.stations_m=[900, 1100]"],
                "recording.stations_m: [900.0, 1100.0] are not those of as many nodes",
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
