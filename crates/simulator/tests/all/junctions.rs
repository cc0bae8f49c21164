//! Runs with junctions: against the law applied to every junction in every step, energies, restored states.

use asperity_record::{Record, StepRecord};
use asperity_simulator::{Plain, SolverKind};
use asperity_testkit::{DirectChain, Random, plan};

use crate::fast_and_plain::{assert_balanced, last_energy, left_of, run, steps};

/// A short chain with junctions, driven so fast that a short run has many events.
fn random_sets(random: &mut Random) -> Vec<String> {
    let mut sets = ["time.step_s=2e-7", "time.duration_s=0.01", "drive.velocity_m_per_s=8e-3"]
        .map(str::to_owned)
        .to_vec();
    let mut set = |key: &str, value: String| sets.push(format!("{key}={value}"));
    set("slider.blocks", (2 + random.below(24)).to_string());
    set("friction.junction_count", (1 + random.below(60)).to_string());
    set("friction.junction_width", random.uniform(0.0, 0.4).to_string());
    set("friction.junction_start", if random.below(2) == 0 { "even" } else { "drawn" }.to_owned());
    set("friction.junction_seed", random.below(1000).to_string());
    set("friction.healing_time_s", random.uniform(1e-4, 2e-3).to_string());
    set("friction.sliding_share", random.uniform(0.05, 1.0).to_string());
    set("normal_load.tilt", random.uniform(-0.5, 0.5).to_string());
    set("prestress.ratio", random.uniform(0.0, 0.1).to_string());
    if random.below(3) == 0 {
        set("normal_load.schedule_s", "[0.002,0.006,0.009]".to_owned());
        set("normal_load.schedule_n", "[400,30,300]".to_owned());
    }
    sets
}

#[test]
fn random_chains_do_what_all_of_their_junctions_do() {
    let (mut random, mut switches) = (Random::new(11), 0);
    for _ in 0..20 {
        let sets = random_sets(&mut random);
        let plan = plan("chain-junctions", &sets);
        let mut expected = Vec::new();
        let mut direct = DirectChain::of(plan.clone());
        for _ in 0..plan.steps {
            direct.step(|step, block| expected.push((step, block)));
        }
        let mut plain = Plain::new(plan);
        let records = left_of(&mut plain);
        let switches_of = |step: &StepRecord| step.switches.iter().map(|s| (step.step, s.block)).collect();
        let found: Vec<(u64, u32)> = steps(&records).into_iter().flat_map::<Vec<_>, _>(switches_of).collect();
        assert_eq!(found, expected, "{sets:?}");
        for (found, expected) in plain.state().displacement_m.iter().zip(&direct.u) {
            assert!((found - expected).abs() < 1e-13, "{found} {expected} {sets:?}");
        }
        let breaks: u64 = direct.contacts.iter().map(|contact| contact.breaks()).sum();
        assert_eq!(plain.state().junctions.as_ref().unwrap().totals().breaks, breaks, "{sets:?}");
        switches += found.len();
    }
    assert!(switches > 1000, "{switches}");
}

const COARSE_SLAB: [&str; 7] = [
    "slider.blocks=15",
    "slider.rows=8",
    "slider.height_m=0.07",
    "drive.height_m=0.01",
    "drive.velocity_m_per_s=2e-3",
    "time.step_s=4e-7",
    "time.duration_s=0.08",
];

#[test]
fn energies_balance_and_no_anchor_returns_energy() {
    let unloaded = [
        "time.step_s=1e-7",
        "time.duration_s=0.1",
        "prestress.ratio=0.05",
        "normal_load.schedule_s=[0.03,0.06,0.09]",
        "normal_load.schedule_n=[400,1e-3,300]",
    ];
    let longer = [&COARSE_SLAB[..], &["time.duration_s=0.15"]].concat();
    for (scenario, sets) in [("slab-junctions", &longer[..]), ("chain-junctions", &unloaded)] {
        let (records, ..) = run(&plan(scenario, sets), SolverKind::Plain);
        assert_balanced(&records, 1e-10, scenario);
        let energies = steps(&records).into_iter().map(|step| step.energy);
        assert!(energies.clone().is_sorted_by_key(|energy| energy.friction_heat_j), "{scenario}");
        assert!(energies.clone().all(|energy| energy.anchor_change_j == 0.0), "{scenario}");
        let checked = energies.count();
        assert!(checked > 250 && last_energy(&records).friction_heat_j > 0.0, "{scenario}: {checked}");
    }
}

#[test]
fn both_solvers_yield_the_same_records_to_the_bit() {
    let chain = ["time.step_s=1e-7", "time.duration_s=0.08", "friction.junction_start=drawn"];
    for (scenario, sets) in [("slab-junctions", &COARSE_SLAB[..]), ("chain-junctions", &chain)] {
        let plan = plan(scenario, sets);
        let [mut plain, mut fast] =
            [SolverKind::Plain, SolverKind::Fast].map(|kind| kind.start(plan.clone()));
        assert_eq!(fast.fallbacks().len(), 1);
        let [of_plain, of_fast] = [&mut plain, &mut fast].map(|solver| left_of(&mut **solver));
        let [plain, fast] = [plain, fast].map(|solver| solver.snapshot().slider);
        assert_eq!(fast.displacement_m, plain.displacement_m, "{scenario}");
        assert!(fast.junctions == plain.junctions, "{scenario}");
        // Viscous loss follows from the balance in one of them.
        let other = |record: &Record| match record {
            Record::Step(record) => format!("{:?}", (record.step, record.driving_force_n, &record.switches)),
            other => format!("{other:?}"),
        };
        assert!(of_plain.len() > 40 && of_plain.len() == of_fast.len(), "{scenario}: {}", of_plain.len());
        for (plain, fast) in of_plain.iter().zip(&of_fast) {
            assert_eq!(other(plain), other(fast), "{scenario}");
        }
    }
}
