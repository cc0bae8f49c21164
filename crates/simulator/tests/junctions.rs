//! Runs with junctions: against the law applied to every junction in every step, energies, restored states.

use asperity_model::{Plan, resolve};
use asperity_record::{Energy, Record};
use asperity_simulator::{Plain, Snapshot, Solver, SolverKind};
use asperity_testkit::{DirectChain, Random};

fn plan(scenario: &str, sets: &[String]) -> Plan {
    Plan::new(&resolve(scenario, sets).unwrap_or_else(|error| panic!("{error}")))
}

fn owned(sets: &[&str]) -> Vec<String> {
    sets.iter().map(ToString::to_string).collect()
}

/// A short chain with junctions, driven so fast that a short run has many events.
fn random_sets(random: &mut Random) -> Vec<String> {
    let mut sets = owned(&["time.step_s=2e-7", "time.duration_s=0.01", "drive.velocity_m_per_s=8e-3"]);
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
        let mut found = Vec::new();
        while let Some(record) = plain.next_record().unwrap() {
            if let Record::Step(record) = record {
                found.extend(record.switches.iter().map(|switch| (record.step, switch.block)));
            }
        }
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

/// What enters the balance of energies, less what is taken out and stored: constant over a run.
fn balance_j(energy: Energy) -> f64 {
    let put_in_j = energy.drive_work_j + energy.prestress_work_j + energy.scheme_work_j;
    put_in_j - energy.friction_heat_j - energy.viscous_loss_j - energy.kinetic_j - energy.elastic_j
}

#[test]
fn energies_balance_and_no_anchor_returns_energy() {
    let coarse = owned(&["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.25"]);
    let unloaded = owned(&[
        "time.step_s=1e-7",
        "time.duration_s=0.1",
        "prestress.ratio=0.05",
        "normal_load.schedule_s=[0.03,0.06,0.09]",
        "normal_load.schedule_n=[400,1e-3,300]",
    ]);
    for (scenario, sets) in [("slab-junctions", coarse), ("chain-junctions", unloaded)] {
        let mut plain = Plain::new(plan(scenario, &sets));
        let (mut first_j, mut last) = (None, None::<Energy>);
        let mut checked = 0;
        while let Some(record) = plain.next_record().unwrap() {
            let Record::Step(record) = record else { continue };
            let energy = record.energy.unwrap();
            let at_first_j = *first_j.get_or_insert(balance_j(energy));
            let largest_j = energy.parts().map(|(_, j)| j.abs()).fold(0.0, f64::max);
            let lacks_j = balance_j(energy) - at_first_j;
            assert!(lacks_j.abs() < 1e-9 * largest_j, "{scenario} in {}: {lacks_j}", record.step);
            assert!(last.is_none_or(|last| energy.friction_heat_j >= last.friction_heat_j), "{scenario}");
            assert_eq!(energy.anchor_change_j, 0.0);
            last = Some(energy);
            checked += 1;
        }
        assert!(checked > 250 && last.unwrap().friction_heat_j > 0.0, "{scenario}: {checked}");
    }
}

#[test]
fn both_solvers_and_restored_ones_yield_the_same_records_to_the_bit() {
    let coarse = owned(&["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.178"]);
    let chain = owned(&["time.step_s=1e-7", "time.duration_s=0.08", "friction.junction_start=drawn"]);
    for (scenario, sets) in [("slab-junctions", coarse), ("chain-junctions", chain)] {
        let plan = plan(scenario, &sets);
        let mut plain = SolverKind::Plain.start(plan.clone());
        let mut records = Vec::new();
        while let Some(record) = plain.next_record().unwrap() {
            records.push(record);
        }
        let end = plain.snapshot();
        let mut fast = SolverKind::Fast.start(plan.clone());
        assert_eq!(fast.fallbacks().len(), 1);
        // Viscous loss follows from the balance here.
        let mut steps = 0;
        let mut random = Random::new(3);
        let mut resumed = Vec::new();
        while let Some(record) = fast.next_record().unwrap() {
            resumed.push(record);
            if fast.is_between_records() && random.below(4) == 0 {
                let snapshot: Snapshot = fast.snapshot();
                assert!(snapshot.fits(&plan));
                fast = SolverKind::Fast.start(plan.clone());
                fast.restore(&snapshot);
                steps += 1;
            }
        }
        assert!(steps > 10 && records.len() == resumed.len(), "{scenario}: {steps}");
        assert_eq!(fast.snapshot().slider.displacement_m, end.slider.displacement_m, "{scenario}");
        assert!(fast.snapshot().slider.junctions == end.slider.junctions, "{scenario}");
        let other = |record: &Record| match record {
            Record::Step(record) => format!("{:?}", (record.step, record.driving_force_n, &record.switches)),
            other => format!("{other:?}"),
        };
        for (plain, resumed) in records.iter().zip(&resumed) {
            assert_eq!(other(plain), other(resumed), "{scenario}");
        }
    }
}
