//! Slabs, compared with an independent implementation bond by bond, and with physical laws.

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_record::Direction;
use asperity_simulator::{Plain, SliderState, Solver, SolverKind};
use asperity_testkit::SMALL_SLAB;

use crate::fast_and_plain::{assert_balanced, last_energy, records, steps};
use crate::page::{self, Page, Switches, does_what_the_page_says};

fn plan(sets: &[&str]) -> Plan {
    let sets: Vec<&str> = SMALL_SLAB.iter().chain(sets).copied().collect();
    Plan::new(&resolve("slab", &sets).unwrap_or_else(|error| panic!("{error}")))
}

/// The contacts of docs/slab.md.
struct Contacts {
    tau_n: Vec<f64>,
    stick: Vec<f64>,
    slides: Vec<bool>,
    since: Vec<u64>,
}

impl page::Contacts for Contacts {
    fn resist(&mut self, page: &Page, loads_n: &[f64], force_n: &mut [f64]) {
        let friction = &page.plan.friction;
        self.tau_n = force_n[..loads_n.len()].to_vec();
        for (n, load_n) in loads_n.iter().enumerate() {
            force_n[n] -= match self.slides[n] {
                false => friction.interfacial_stiffness_n_per_m * (page.u[n] - self.stick[n]),
                true if page.v[n] > 0.0 => friction.dynamic_coefficients[n] * load_n,
                true if page.v[n] < 0.0 => -friction.dynamic_coefficients[n] * load_n,
                true => 0.0,
            };
        }
    }

    fn switch(&mut self, page: &Page, loads_n: &[f64]) -> Switches {
        let friction = &page.plan.friction;
        let mut switches = Vec::new();
        for (n, load_n) in loads_n.iter().enumerate() {
            let waited_s = (page.step - self.since[n]) as f64 * page.plan.grid.step_s();
            let aged = friction
                .ageing
                .as_ref()
                .map_or(0.0, |ageing| ageing.coefficient * (1.0 + waited_s / ageing.time_s).ln());
            if self.slides[n] && page.v[n] <= 0.0 {
                self.slides[n] = false;
                self.stick[n] = page.u[n] - self.tau_n[n] / friction.interfacial_stiffness_n_per_m;
                self.since[n] = page.step;
                switches.push((n as u32 + 1, Direction::Attach));
            } else if !self.slides[n]
                && self.tau_n[n].abs() >= (friction.static_coefficients[n] + aged) * load_n
            {
                self.slides[n] = true;
                switches.push((n as u32 + 1, Direction::Detach));
            }
        }
        switches
    }
}

/// Over drives, loads and laws: equal switches in equal steps, and equal numbers.
#[test]
fn slabs_do_what_the_page_says() {
    for sets in [
        &[][..],
        &["drive.height_m=0"],
        &["drive.kind=top", "drive.height_m=0", "drive.tilt=0.4"],
        &[
            "normal_load.tilt=0.3",
            "normal_load.foundation_stiffness_ratio=2",
            "friction.interfacial_stiffness_ratio=0.5",
        ],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3"],
        &["friction.static_spread=0.05", "friction.dynamic_spread=0.02", "friction.spread_seed=7"],
        &[
            "drive.until_load_ratio=0.15",
            "normal_load.schedule_s=[0.01,0.1]",
            "normal_load.schedule_n=[1920,500]",
            "normal_load.schedule_from=hold",
        ],
        &["drive.hold_from_s=0.1", "normal_load.schedule_s=[0.1,0.19]", "normal_load.schedule_n=[1920,480]"],
    ] {
        let plan = plan(sets);
        let contacts = Contacts {
            tau_n: Vec::new(),
            stick: plan.initial.stick_position_m.clone(),
            slides: vec![false; plan.blocks],
            since: vec![0; plan.blocks],
        };
        does_what_the_page_says(&plan, contacts, 1e-9, &format!("{sets:?}"), |_, _| {});
    }
}

#[test]
fn energies_of_a_slab_close() {
    for sets in [
        &[][..],
        &["drive.kind=top", "drive.height_m=0"],
        &["normal_load.schedule_s=[0.05,0.15]", "normal_load.schedule_n=[1920,600]"],
        &["friction.ageing_coefficient=0.02", "friction.ageing_time_s=1e-3", "slider.relative_damping=0.05"],
    ] {
        let records = records(SolverKind::Plain.start(plan(sets)));
        assert_balanced(&records, 1e-11, &format!("{sets:?}"));
        let last = last_energy(&records);
        assert!(last.friction_heat_j > 1e-2 * last.drive_work_j, "{sets:?}: {last:?}");
        assert!(last.viscous_loss_j > 0.0 && last.anchor_change_j < 0.0, "{sets:?}: {last:?}");
        assert!(last.scheme_work_j.abs() < 0.02 * last.drive_work_j, "{sets:?}: {last:?}");
        if sets.iter().any(|set| set.contains("schedule")) {
            assert!(last.prestress_work_j.abs() > 1e-4 * last.elastic_j, "{last:?}");
        }
    }
}

/// The work of the scheme is of first order: half the step halves it.
#[test]
fn the_scheme_does_less_work_in_shorter_steps() {
    let of = |step: &str| {
        let energy = last_energy(&records(SolverKind::Plain.start(plan(&[step, "time.duration_s=0.05"]))));
        energy.scheme_work_j / energy.drive_work_j
    };
    let (long, short) = (of("time.step_s=1e-5"), of("time.step_s=2.5e-6"));
    assert!(short.abs() < 0.5 * long.abs() + 1e-6, "{long} {short}");
}

#[test]
fn a_slab_at_rest_stays_there_without_a_drive() {
    let plan = plan(&["drive.velocity_m_per_s=0"]);
    let mut plain = Plain::new(plan.clone());
    for _ in 0..2_000 {
        plain.take_step();
    }
    let (before, after) = (&plan.initial.displacement_m, &plain.state().displacement_m);
    let largest = before.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    assert!(before.iter().zip(after).all(|(a, b)| (a - b).abs() < 1e-12 * largest));
    assert!(plain.switched().is_empty() && plain.state().detached == 0);
}

#[test]
fn states_that_no_slab_has_do_not_fit() {
    let plan = plan(&[]);
    let state = Plain::new(plan.clone()).snapshot();
    assert!(state.fits(&plan));
    let state = state.slider;
    let short = SliderState { displacement_m: state.displacement_m[..9].to_vec(), ..state.clone() };
    assert!(!short.fits(&plan), "a state of the contacts alone is none");
    let lifted = SliderState { normal_load_n: vec![-1.0; 9], ..state };
    assert!(!lifted.fits(&plan), "the foundation does not pull");
}

/// Where computing modes would take longer than the run, the fallbacks report it, and the records are
/// equal.
#[test]
fn a_run_too_short_for_modes_is_stepped_openly() {
    let plan = plan(&["time.duration_s=0.05"]);
    let [fast, plain] = [SolverKind::Fast, SolverKind::Plain].map(|kind| kind.start(plan.clone()));
    assert!(plain.fallbacks().is_empty());
    assert!(fast.fallbacks()[0].starts_with("single steps instead of jumps: the modes"));
    assert_eq!(steps(&records(fast)), steps(&records(plain)));
}

/// A step from a state with one modified contact; returns the states before and after, and the switches.
fn step_from(change: impl Fn(&mut SliderState, usize)) -> (SliderState, SliderState, Vec<usize>) {
    let mut plain = Plain::new(plan(&[]));
    for _ in 0..100 {
        plain.take_step();
    }
    let mut before = plain.state().clone();
    change(&mut before, 45);
    before.detached = before.slip.iter().filter(|slip| **slip != 0.0).count() as u32;
    plain.restore(&before.clone().into());
    plain.take_step();
    (before, plain.state().clone(), plain.switched().to_vec())
}

const AT: usize = 3;

#[test]
fn a_sliding_contact_at_rest_feels_no_friction() {
    let plan = plan(&[]);
    let (before, after, _) = step_from(|state, _| {
        state.slip[AT] = 1.0;
        state.velocity_m_per_s[AT] = 0.0;
    });
    let force_n =
        (after.velocity_m_per_s[AT] - before.velocity_m_per_s[AT]) * plan.block_mass_kg / plan.grid.step_s();
    let tau_n = after.tangential_force_n[AT];
    assert!((force_n - tau_n).abs() < 1e-9 * tau_n.abs(), "{force_n} {tau_n}");
    // A moving contact is resisted by `mu_d p` in either direction.
    for v in [1e-3, -1e-3] {
        let (before, after, _) = step_from(|state, _| {
            state.slip[AT] = 1.0;
            state.velocity_m_per_s[AT] = v;
        });
        let change = after.velocity_m_per_s[AT] - before.velocity_m_per_s[AT];
        let force_n = change * plan.block_mass_kg / plan.grid.step_s();
        let expected_n = after.tangential_force_n[AT] - 0.17 * after.normal_load_n[AT] * v.signum();
        assert!((force_n - expected_n).abs() < 1e-9 * expected_n.abs(), "{force_n} {expected_n}");
    }
}

#[test]
fn a_contact_may_detach_backwards_and_sticks_again_by_the_one_way_rule() {
    let (_, after, switched) = step_from(|state, _| {
        // Pulled back by its neighbours, and moving back.
        state.displacement_m[AT] += 4e-5;
        state.stick_position_m[AT] += 4e-5;
        state.velocity_m_per_s[AT] = -1e-2;
    });
    assert!(switched.contains(&AT) && after.slip[AT] == 1.0);
    assert!(after.tangential_force_n[AT] <= -0.4 * after.normal_load_n[AT]);
    let mut plain = Plain::new(plan(&[]));
    plain.restore(&after.into());
    plain.take_step();
    let next = plain.state();
    assert!(next.velocity_m_per_s[AT] <= 0.0 && next.slip[AT] == 0.0 && plain.switched().contains(&AT));
    let kt = plan(&[]).friction.interfacial_stiffness_n_per_m;
    assert_eq!(next.stick_position_m[AT], next.displacement_m[AT] - next.tangential_force_n[AT] / kt);
}

#[test]
fn a_contact_that_has_lifted_off_bears_nothing_and_does_not_hold() {
    let plan = plan(&[]);
    let (before, after, switched) = step_from(|state, nodes| state.displacement_m[nodes + AT] = 1e-6);
    assert_eq!(after.normal_load_n[AT], 0.0);
    assert!(switched.contains(&AT) && after.slip[AT] == 1.0, "with a threshold of 0 it detaches");
    // The others keep their load, and only its neighbours pull the lifted contact down.
    assert!(after.normal_load_n[AT + 2] > 0.0);
    let (lattice, nodes) = (plan.elastic, 45);
    let (mut springs_n, mut dashpots_n) = (vec![0.0; 90], vec![0.0; 90]);
    lattice.pull(&mut springs_n, &mut dashpots_n, &before.displacement_m, &before.velocity_m_per_s);
    let pull_n = springs_n[nodes + AT] + dashpots_n[nodes + AT];
    let change = after.velocity_m_per_s[nodes + AT] - before.velocity_m_per_s[nodes + AT];
    let force_n = change * plan.block_mass_kg / plan.grid.step_s();
    assert!((force_n - pull_n).abs() < 1e-9 * pull_n.abs(), "{force_n} {pull_n}");
    // Sliding in the air, it has no friction.
    let (before, after, _) = step_from(|state, nodes| {
        state.displacement_m[nodes + AT] = 1e-6;
        state.slip[AT] = 1.0;
        state.velocity_m_per_s[AT] = 1e-2;
    });
    let change = after.velocity_m_per_s[AT] - before.velocity_m_per_s[AT];
    let force_n = change * plan.block_mass_kg / plan.grid.step_s();
    assert!((force_n - after.tangential_force_n[AT]).abs() < 1e-9 * force_n.abs());
}
