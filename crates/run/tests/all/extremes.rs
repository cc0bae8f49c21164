//! Whatever a scenario accepts can be run, and its log is sound: every number at both ends of its
//! range, alone, in pairs and by sixes. A width of 5e-324 m used to be accepted, and the log of its
//! run was damaged; with a load of 5e-324 N no log could be written.

use asperity_model::law::laws::FrictionLaw;
use asperity_model::resolve;
use asperity_model::scenario::keys::{KEYS, Kind};
use asperity_model::{Plan, Scenario};
use asperity_run::{Begin, LogTo, RunError, Task, Verdict, check, run};
use asperity_testkit::{Random, folder};

/// Scenarios in which every key is used.
const FAMILIES: [(&str, &[&str]); 10] = [
    ("default", &["slider.blocks=5", "parameter_set=as-coded"]),
    (
        "default",
        &["slider.blocks=5", "parameter_set=as-stated", "drive.kind=left-right", "friction.reattach=two-way"],
    ),
    ("default", &["slider.blocks=5", "parameter_set=as-coded", "drive.kind=top"]),
    ("default", &["slider.blocks=5", "parameter_set=as-coded", "friction.law=rigid", "prestress.ratio=0.1"]),
    ("default", &["slider.blocks=5", "parameter_set=as-coded", "friction.law=velocity-weakening"]),
    ("rigid-contacts", &["slider.blocks=5", "friction.weakening_slip_m=1e-6"]),
    ("slab", &["slider.blocks=9", "slider.rows=3", "slider.height_m=0.035"]),
    ("chain-junctions", &["slider.blocks=5"]),
    ("rate-and-state", &["slider.blocks=5", "friction.evolution_offsets=[]"]),
    (
        "slab-junctions",
        &["slider.blocks=9", "slider.rows=3", "slider.height_m=0.035", "friction.junction_count=7"],
    ),
];

/// Keys with numeric values, without those of time, which follow from the step here.
fn keys() -> Vec<(&'static str, Kind)> {
    let is_number = |kind: &Kind| matches!(kind, Kind::Number(..));
    let keys = KEYS.iter().filter(|key| is_number(&key.kind) && !key.path.starts_with("time."));
    keys.filter(|key| !key.path.starts_with("recording.")).map(|key| (key.path, key.kind)).collect()
}

/// The scenario with a stable step and a run of some hundred steps, if it is accepted.
fn accepted(name: &str, sets: &[String]) -> Option<Scenario> {
    let with_step = |step_s: f64| {
        let times = [
            ("time.step_s", 1.0),
            ("time.duration_s", 300.0),
            ("recording.sample_s", 50.0),
            ("recording.fields_s", 100.0),
        ];
        let times = times.map(|(key, steps)| format!("{key}={:e}", steps * step_s));
        resolve(name, &[sets, &times].concat()).ok()
    };
    // The shortest step that there may be is stable, if any is.
    with_step(1e-8).or_else(|| with_step(0.1 * with_step(1e-30)?.longest_stable_step_s()))
}

fn all_normal<'a>(what: &str, numbers: impl IntoIterator<Item = &'a f64>, sets: &[String]) {
    for number in numbers {
        assert!(*number == 0.0 || number.is_normal(), "{sets:?}: {what}: {number:e}");
    }
}

/// Whether it ran: it may be refused, or stopped because its time step was too long.
fn runs_if_accepted(name: &str, sets: &[String]) -> bool {
    let Some(scenario) = accepted(name, sets) else { return false };
    let plan = Plan::new(&scenario);
    let scales = scenario.scales();
    let constants = [
        plan.block_mass_kg,
        plan.spacing_m,
        plan.elastic.stiffness_n_per_m,
        plan.friction.interfacial_stiffness_n_per_m,
        // The adaptive solver has none.
        if plan.friction.law.word().sticks() { plan.longest_stable_step_s } else { 1.0 },
        scales.block_time_s,
        scales.block_length_m,
    ];
    all_normal("a constant", &constants, sets);
    all_normal("a load", &plan.normal_load_n, sets);
    all_normal("a threshold", &plan.friction.static_threshold_n, sets);
    all_normal("a force", plan.drive.springs.iter().map(|spring| &spring.stiffness_n_per_m), sets);
    for warning in scenario.warnings() {
        let text = warning.text;
        assert!(!text.contains("inf") && !text.contains("NaN"), "{sets:?}: {text}");
    }
    let folder = folder();
    let path = folder.path().join("run.mcap");
    let outcome = run(Task::new(&scenario).log_to(LogTo::new(&path)), Begin::Anew, &|| false, &mut ());
    let expected = match outcome {
        Ok(_) => Verdict::Whole,
        Err(RunError::Simulation { .. }) => Verdict::Stopped,
        Err(error) => panic!("{name} {sets:?} {:e} s: {error}", scenario.time.step_s),
    };
    let checked = check(&path);
    assert_eq!(checked.verdict, expected, "{name} {sets:?} {:e} s: {checked}", scenario.time.step_s);
    true
}

fn with(sets: &[&str], more: impl IntoIterator<Item = (&'static str, f64)>) -> Vec<String> {
    let more = more.into_iter().map(|(key, value)| format!("{key}={value:e}"));
    sets.iter().map(|set| (*set).to_owned()).chain(more).collect()
}

#[test]
fn numbers_that_nobody_can_calculate_with_are_refused_by_name() {
    for (key, kind) in keys() {
        for value in [f64::from_bits(1), f64::MIN_POSITIVE, 1e-300, 1e-31, 1e31, 1e300, f64::MAX] {
            for value in [value, -value] {
                if !kind.accepts_number(value) {
                    continue;
                }
                let errors = resolve("default", &[format!("{key}={value:e}")]).expect_err(key).to_string();
                let said = format!("{key}: {value:e} is too ");
                assert!(errors.contains(&said) && errors.contains("1e-30 to 1e30"), "{errors}");
            }
        }
    }
}

/// Tries the keys whose number leaves such a rest, by three.
fn every_number(of_three: impl Fn(usize) -> bool) {
    let mut ran = 0;
    for (family, (name, sets)) in FAMILIES.into_iter().enumerate() {
        // Other keys from family to family.
        for (_, (key, kind)) in keys().into_iter().enumerate().filter(|(n, _)| of_three((n + family) % 3)) {
            for value in [1e-30, 1e30] {
                if kind.accepts_number(value) {
                    ran += usize::from(runs_if_accepted(name, &with(sets, [(key, value)])));
                }
            }
        }
    }
    assert!(ran > 33, "only {ran} were accepted");
}

#[test]
fn every_number_may_be_as_small_or_as_large_as_is_accepted() {
    every_number(|rest| rest == 0);
}

#[test]
fn so_may_several_at_once() {
    several_at_once(0..80);
}

/// What is left; `cargo xtask ci` runs it.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of many short runs: cargo xtask ci"]
    fn every_other_number_may_be_as_small_or_as_large_as_is_accepted() {
        every_number(|rest| rest != 0);
    }

    #[test]
    #[ignore = "seconds of many short runs: cargo xtask ci"]
    fn so_may_several_at_once_drawn_more_often() {
        several_at_once(80..240);
    }
}

fn several_at_once(numbers: std::ops::Range<usize>) {
    let (mut random, keys) = (Random::new(28 + numbers.start as u64), keys());
    let (mut ran, count) = (0, numbers.len());
    for number in numbers {
        let (name, sets) = FAMILIES[number % FAMILIES.len()];
        // Keys of other laws are refused by any value.
        let law = resolve(name, sets).unwrap_or_else(|errors| panic!("{errors}")).friction.law;
        let of_another = |path| !law.uses(path) && FrictionLaw::ALL.iter().any(|law| law.uses(path));
        let keys: Vec<_> = keys.iter().filter(|(path, _)| !of_another(path)).collect();
        let count = if number % 4 == 0 { 6 } else { 2 };
        let values: Vec<(&str, f64)> =
            (0..count).map(|_| (random.pick(&keys).0, random.pick(&[1e-30, 1e-15, 1e15, 1e30]))).collect();
        ran += usize::from(runs_if_accepted(name, &with(sets, values)));
    }
    assert!(ran > count / 6, "only {ran} of {count} were accepted");
}
