//! What both solvers promise for every kind of body, each promise once over a table of small ones: records depend
//! neither on what else is recorded nor on where a run is resumed, and samples inside leaps are those of single steps.

use asperity_model::{Crossing, Plan, SliderState};
use asperity_simulator::SolverKind;
use asperity_testkit::SMALL_SLAB;

use crate::fast_and_plain::{recording_changes_nothing, resumes_to_the_bit, samples_agree};

const FAST: SolverKind = SolverKind::Fast;

type Sets = &'static [&'static str];

/// A small body, in runs that are long enough for leaps.
pub(crate) struct Body {
    pub(crate) name: &'static str,
    scenario: &'static str,
    /// What is set in all of its runs, in two parts.
    sets: [Sets; 2],
    /// What varies from run to run.
    cases: &'static [Sets],
    /// Cadences of samples and states that are compared.
    samples: Sets,
    /// Steps in jumps of each of these runs; if none, it takes windows. And windows of the first.
    least: [u64; 2],
}

impl Body {
    /// The plan of one of its runs.
    pub(crate) fn plan(&self, sets: &[&str]) -> Plan {
        asperity_testkit::plan(self.scenario, &[self.sets[0], self.sets[1], sets].concat())
    }
}

/// A small slab whose run is long enough for modes.
pub(crate) const SLAB: Body = Body {
    name: "slab",
    scenario: "slab",
    sets: [&SMALL_SLAB, &["drive.velocity_m_per_s=8e-4", "time.duration_s=1.2", "recording.fields_s=0"]],
    cases: &[
        &[],
        &["drive.kind=top", "drive.height_m=0", "drive.velocity_m_per_s=2e-3"],
        &["drive.hold_from_s=0.5"],
        &["normal_load.schedule_s=[0.2,0.9]", "normal_load.schedule_n=[1920,1200]"],
        &["friction.ageing_coefficient=0.02"],
    ],
    samples: &["recording.sample_s=1e-3", "recording.fields_s=1e-2"],
    least: [40_000, 0],
};

/// A small body, likewise.
pub(crate) const BODY: Body = Body {
    name: "body",
    scenario: "body-coarse",
    sets: [
        &[
            "slider.blocks=5",
            "slider.across=3",
            "slider.rows=3",
            "slider.width_m=0.07",
            "slider.height_m=0.07",
            "slider.mass_kg=7.56",
            "drive.height_m=0.035",
        ],
        &["drive.velocity_m_per_s=2e-3", "time.step_s=5e-6", "time.duration_s=0.5", "recording.fields_s=0"],
    ],
    cases: &[
        &[],
        &["drive.across=1"],
        &["drive.kind=top", "drive.height_m=0"],
        &["drive.hold_from_s=0.3"],
        &["friction.static_spread=0.1", "normal_load.tilt=0.3", "time.duration_s=0.8"],
        &["normal_load.schedule_s=[0.1,0.4]", "normal_load.schedule_n=[6400,4000]"],
    ],
    samples: &["recording.sample_s=1e-3", "recording.fields_s=1e-2"],
    least: [10_000, 0],
};

/// A small sheet, likewise.
pub(crate) const SHEET: Body = Body {
    name: "sheet",
    scenario: "sheet-coarse",
    sets: [
        &["slider.blocks=9", "slider.across=4", "slider.width_m=0.0375"],
        &["drive.velocity_m_per_s=2e-3", "time.step_s=1e-6", "time.duration_s=0.1", "recording.fields_s=0"],
    ],
    cases: &[
        &[],
        &["drive.across=1"],
        &["drive.kind=top", "drive.velocity_m_per_s=1e-2"],
        &["drive.hold_from_s=0.06"],
        &["friction.static_spread=0.1", "normal_load.tilt=0.3"],
        &["normal_load.schedule_s=[0.02,0.08]", "normal_load.schedule_n=[400,300]"],
    ],
    samples: &["recording.sample_s=2e-4", "recording.fields_s=2e-3"],
    least: [20_000, 0],
};

/// A chain of ten blocks, driven fast, with ends and dampers of its own.
const fn chain(name: &'static str, sets: Sets, least: [u64; 2]) -> Body {
    Body {
        name,
        scenario: "ten-blocks",
        sets: [&["drive.velocity_m_per_s=0.02", "time.step_s=1e-7", "time.duration_s=0.06"], sets],
        cases: &[&[], &["drive.hold_from_s=0.03"], &["friction.reattach=two-way"]],
        samples: &["recording.sample_s=1e-5", "recording.fields_s=1e-3"],
        least,
    }
}

/// Each kind of body, of ends at which the fast solver leaps, with what else they need for it, and of dampers.
const BODIES: [Body; 10] = [
    SLAB,
    BODY,
    SHEET,
    chain("clamped", &["slider.left_end=clamped", "slider.right_end=clamped"], [20_000, 20]),
    chain("free, clamped", &["slider.right_end=clamped", "friction.detach_by=spring"], [20_000, 20]),
    chain("free", &["friction.detach_by=spring", "friction.ageing_coefficient=0.01"], [20_000, 20]),
    chain(
        "clamped, absorbing",
        &["slider.left_end=clamped", "slider.right_end=absorbing", "slider.relative_damping=0"],
        [20_000, 20],
    ),
    chain("free, absorbing", &["slider.right_end=absorbing", "slider.relative_damping=0.2"], [20_000, 0]),
    chain("periodic", &["slider.left_end=periodic", "slider.right_end=periodic"], [0, 20]),
    // On friction springs, half critically damped by radiation where it slides.
    chain("radiating", &["slider.relative_damping=0", "friction.radiation_kg_per_s=2600"], [20_000, 20]),
];

/// Samples inside windows and jumps, states and energies, equal those of single steps.
#[test]
fn samples_are_those_of_single_steps() {
    for body in BODIES {
        for case in body.cases {
            let what = format!("{} {case:?}", body.name);
            let counters = samples_agree(&body.plan(&[case, body.samples].concat()), &what);
            assert!(counters.jump_steps >= body.least[0], "{what}: {counters:?}");
            assert!(body.least[0] > 0 || counters.window_steps > 100_000, "{what}: {counters:?}");
        }
    }
}

/// A chain of 24 blocks that is driven fast, with many events in a short run.
const SHORT: Sets = &[
    "slider.blocks=24",
    "time.step_s=1e-7",
    "time.duration_s=0.2",
    "drive.velocity_m_per_s=2e-3",
    "recording.fields_s=0",
];

/// A long chain with many single steps.
const LONG: Sets = &[
    "slider.blocks=3000",
    "parameter_set=as-stated",
    "drive.velocity_m_per_s=0.008231330882585005",
    "time.step_s=3.78e-9",
    "time.duration_s=1.134e-4",
];

#[test]
fn what_is_recorded_changes_nothing() {
    for body in BODIES {
        let counters = recording_changes_nothing(FAST, &body.plan(&[]), body.name);
        let [jump_steps, windows] = body.least;
        assert!(counters.switches > 5 && counters.jump_steps >= jump_steps, "{}: {counters:?}", body.name);
        assert!(counters.windows >= windows, "{}: {counters:?}", body.name);
    }
    let window = "recording.window=[{from_s=0.05, to_s=0.15, every_s=3e-6, first_block=2, last_block=5}]";
    for (kind, sets) in [
        (FAST, &["time.duration_s=0.3"][..]),
        (FAST, &["slider.blocks=600", "time.duration_s=0.05"]),
        (FAST, LONG),
        (
            SolverKind::Plain,
            &[
                "time.step_s=1e-7",
                "time.duration_s=0.2",
                "slider.blocks=20",
                "drive.velocity_m_per_s=2e-3",
                window,
            ],
        ),
    ] {
        let plan = asperity_testkit::plan("default", sets);
        let counters = recording_changes_nothing(kind, &plan, &format!("{sets:?}"));
        assert!(counters.switches > 20, "{sets:?}: {counters:?}");
    }
}

/// Also a run that is saved inside a window or jump, where the state is that of its start.
#[test]
fn a_run_that_is_resumed_is_the_run() {
    let mut inside = 0;
    for body in BODIES {
        for case in &body.cases[..2] {
            let plan = body.plan(&[case, body.samples].concat());
            let what = format!("{} {case:?}", body.name);
            let [times, in_jumps, slips] = resumes_to_the_bit(&plan, FAST, 6, &what);
            assert!(times >= 5 && slips > 2, "{what}: {times} times, {slips} slips");
            inside += in_jumps;
        }
    }
    assert!(inside > 30, "{inside}");
}

/// Runs of every law and solver, and of every part of their states.
const RESUMED: [(SolverKind, &str, [Sets; 2]); 22] = [
    (FAST, "default", [&["time.duration_s=0.15"], &[]]),
    // Long chains: waves, windows of most lengths, and no windows for long steps.
    (FAST, "default", [&["slider.blocks=600", "time.duration_s=0.02", "recording.sample_s=1e-5"], &[]]),
    (
        FAST,
        "default",
        [
            &["slider.blocks=600", "parameter_set=as-stated", "time.step_s=1.6e-8"],
            &["time.duration_s=0.016", "recording.sample_s=1.6e-5", "recording.fields_s=1.6e-3"],
        ],
    ),
    (
        FAST,
        "default",
        [
            &["slider.blocks=600", "parameter_set=as-stated", "time.step_s=4e-8"],
            &["time.duration_s=0.02", "recording.sample_s=1e-5"],
        ],
    ),
    // States of ruptures, inside windows.
    (
        FAST,
        "default",
        [
            &["time.duration_s=0.15"],
            &["recording.rupture_fields_from_blocks=2", "recording.rupture_fields_s=1e-5"],
        ],
    ),
    // An unloaded block that chatters until the credit of saved steps is used up.
    (FAST, "default", [&["normal_load.tilt=1", "time.step_s=1e-7", "time.duration_s=0.004"], &[]]),
    // Windows that cost as much as they save.
    (
        FAST,
        "default",
        [
            &["parameter_set=as-stated", "friction.interfacial_stiffness_ratio=1e3"],
            &["initial_velocity.amplitude_m_per_s=1e-3", "time.duration_s=0.002"],
        ],
    ),
    // Samples so dense that single steps connect them.
    (FAST, "default", [&["time.duration_s=0.002", "recording.sample_s=1e-7"], &[]]),
    (
        FAST,
        "default",
        [
            SHORT,
            &[
                "drive.until_load_ratio=0.1",
                "normal_load.schedule_from=hold",
                "normal_load.schedule_s=[0.08,0.12,0.15,0.2]",
                "normal_load.schedule_n=[400,250,250,100]",
            ],
        ],
    ),
    (FAST, "default", [SHORT, &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3"]]),
    (
        FAST,
        "default",
        [
            SHORT,
            &[
                "friction.law=rigid",
                "drive.hold_from_s=0.08",
                "normal_load.schedule_s=[0.08,0.12,0.15,0.2]",
                "normal_load.schedule_n=[400,250,250,100]",
            ],
        ],
    ),
    (
        FAST,
        "default",
        [
            SHORT,
            &[
                "recording.sample_s=1.3e-4",
                "drive.hold_from_s=0.08",
                "normal_load.schedule_s=[0.08,0.12,0.15,0.2]",
                "normal_load.schedule_n=[400,250,250,100]",
            ],
        ],
    ),
    // Friction that falls over a slip, which blocks remember; contacts with springs on a slab.
    (
        FAST,
        "default",
        [SHORT, &["friction.law=rigid", "friction.weakening_slip_m=1e-7", "friction.slip_memory_s=2e-3"]],
    ),
    (
        FAST,
        "slab",
        [
            &["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.1"],
            &["drive.velocity_m_per_s=2e-3", "friction.weakening_slip_m=3e-6"],
        ],
    ),
    (
        FAST,
        "chain-junctions",
        [&["time.step_s=1e-7", "time.duration_s=0.08", "friction.junction_start=drawn"], &[]],
    ),
    (
        FAST,
        "slab-junctions",
        [
            &["slider.blocks=15", "slider.rows=8", "slider.height_m=0.07", "drive.height_m=0.01"],
            &["drive.velocity_m_per_s=2e-3", "time.step_s=4e-7", "time.duration_s=0.08"],
        ],
    ),
    (
        SolverKind::Plain,
        "ten-blocks",
        [
            &["time.step_s=1e-7", "time.duration_s=0.2", "recording.sample_s=1e-4"],
            &["drive.velocity_m_per_s=2e-3"],
        ],
    ),
    (SolverKind::Plain, "slab", [&SMALL_SLAB, &["friction.ageing_coefficient=0.02"]]),
    (
        SolverKind::Adaptive,
        "rate-and-state",
        [
            &["time.duration_s=1", "recording.sample_s=2e-3", "time.tolerance=1e-5"],
            &["normal_load.schedule_s=[0.1, 0.9]", "normal_load.schedule_n=[400, 300]"],
        ],
    ),
    (
        SolverKind::Adaptive,
        "rate-and-state",
        [
            &["time.duration_s=1", "recording.sample_s=2e-3", "time.tolerance=1e-5"],
            &[
                "friction.inertia=false",
                "friction.radiation_kg_per_s=20",
                "slider.relative_damping=0",
                "drive.course_s=[0.2, 0.3]",
                "drive.course_m_per_s=[1e-4, 2e-4]",
            ],
        ],
    ),
    (
        SolverKind::Adaptive,
        "rate-and-state",
        [
            &["time.duration_s=1", "recording.sample_s=2e-3", "time.tolerance=1e-5", "slider.blocks=3"],
            &[
                "friction.evolution_offsets=[]",
                "friction.initial_velocities_m_per_s=[1e-5,2e-4,1e-4]",
                "friction.initial_theta_s=0.1",
                "prestress.course_s=[0.2, 0.4, 0.4, 0.7]",
                "prestress.course_ratio=[0, 0, 0, 0.1, 0.1, 0.1, -0.1, 0.2, 0, 0, 0, 0]",
                "prestress.swing_ratio=0.01",
                "prestress.swing_period_s=0.07",
                "prestress.swing_from_s=0.3",
            ],
        ],
    ),
    (
        SolverKind::Adaptive,
        "seas-bp1-qd-coarse",
        [&["slider.blocks=50", "time.duration_s=6.42e9", "recording.series_every=20"], &[]],
    ),
];

#[test]
fn a_run_of_any_law_and_solver_that_is_resumed_is_the_run() {
    let mut slipped = 0;
    for (kind, scenario, sets) in RESUMED {
        let what = format!("{scenario} {sets:?}");
        let plan = asperity_testkit::plan(scenario, &sets.concat());
        let [times, _, slips] = resumes_to_the_bit(&plan, kind, 4, &what);
        assert!(times >= 3, "{what}: {times}");
        slipped += usize::from(slips > 0);
    }
    // In two of them blocks only vibrate.
    assert_eq!(slipped + 2, RESUMED.len());
}

/// What files may say that no run can have left.
type Spoil = fn(&mut SliderState, &Plan);

/// No state of a run fits its plan once it is spoilt; over an area contacts have just detached in it.
fn none_fits_once_spoilt(kind: SolverKind, plan: &Plan, spoils: &[Spoil]) {
    let mut solver = kind.start(plan.clone());
    let is_area = plan.elastic.tangential_axes() == 2;
    for _ in 0..20 {
        solver.next_record().unwrap();
    }
    while is_area && solver.snapshot().slider.just_detached.is_empty() {
        solver.next_record().unwrap();
    }
    let sound = solver.snapshot();
    assert!(sound.fits(plan), "{}", kind.name());
    for (number, spoil) in spoils.iter().enumerate() {
        let mut state = sound.clone();
        spoil(&mut state.slider, plan);
        assert!(!state.fits(plan), "{number} of {} by {}", plan.elastic.table.name, kind.name());
    }
}

#[test]
fn states_that_no_run_has_do_not_fit() {
    let chain = |set: &str| asperity_testkit::plan("default", &[SHORT, &[set]].concat());
    none_fits_once_spoilt(
        FAST,
        &chain("drive.hold_from_s=0.08"),
        &[
            |state, plan| state.step = plan.steps + 1,
            |state, _| state.hold_step = u64::MAX,
            |state, _| state.hold_step -= 1,
            |state, _| state.energy.friction_heat_j.total = f64::INFINITY,
        ],
    );
    none_fits_once_spoilt(
        FAST,
        &chain("time.start=loaded"),
        &[|state, plan| state.step = plan.initial.step - 1],
    );
    // A load that stops the drive cannot do so in a future step.
    let waits = chain("drive.until_load_ratio=0.1");
    none_fits_once_spoilt(FAST, &waits, &[|state, _| state.hold_step = state.step + 1]);
    none_fits_once_spoilt(
        SolverKind::Plain,
        &SLAB.plan(&[]),
        &[
            |state, _| state.displacement_m.truncate(9),
            // The foundation does not pull.
            |state, _| state.normal_load_n.fill(-1.0),
        ],
    );
    none_fits_once_spoilt(
        SolverKind::Plain,
        &SHEET.plan(&[]),
        &[
            |state, _| state.just_detached.insert(0, state.just_detached[0]),
            |state, plan| state.just_detached = vec![plan.blocks as u32],
            |state, _| {
                state.slip[state.just_detached[0] as usize] = 0.0;
                state.detached -= 1;
            },
            // Anchors have two coordinates.
            |state, plan| state.stick_position_m.truncate(plan.blocks),
        ],
    );
    let adaptive = asperity_testkit::plan("rate-and-state", &["time.duration_s=0.1"]);
    none_fits_once_spoilt(
        SolverKind::Adaptive,
        &adaptive,
        &[
            |state, _| {
                let time_s = &mut state.adaptive.as_mut().unwrap().time_s;
                (time_s.total, time_s.rest) = (1e308, -1e308);
            },
            |state, _| state.adaptive.as_mut().unwrap().time_s.total = 0.2,
            |state, _| state.adaptive.as_mut().unwrap().step_s = f64::NAN,
            |state, _| state.adaptive.as_mut().unwrap().next_step_s = 0.0,
            |state, _| state.adaptive.as_mut().unwrap().unknowns.truncate(15),
            |state, _| state.adaptive.as_mut().unwrap().unknowns[20] = f64::INFINITY,
            |state, _| {
                state.adaptive.as_mut().unwrap().crossings.push(Crossing { step: u64::MAX, block: 16 });
            },
            |state, _| state.adaptive.as_mut().unwrap().crossings.insert(0, Crossing { step: 0, block: 0 }),
            |state, _| state.adaptive = None,
        ],
    );
    let chain = asperity_testkit::plan("default", &["slider.blocks=16"]);
    let mut of_another = FAST.start(chain.clone()).snapshot();
    of_another.slider.adaptive = SolverKind::Adaptive.start(adaptive).snapshot().slider.adaptive;
    assert!(!of_another.fits(&chain));
}
