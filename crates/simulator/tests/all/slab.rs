//! Slabs, compared with an independent implementation bond by bond, and with physical laws.

use asperity_model::lattice::Bond;
use asperity_model::{Lattice, Plan, resolve};
use asperity_record::Direction;
use asperity_simulator::{Plain, SliderState, Solver, SolverKind};
use asperity_testkit::SMALL_SLAB;

use crate::fast_and_plain::{assert_balanced, last_energy, records, steps, switched};

fn plan(sets: &[&str]) -> Plan {
    let sets: Vec<&str> = SMALL_SLAB.iter().chain(sets).copied().collect();
    Plan::new(&resolve("slab", &sets).unwrap_or_else(|error| panic!("{error}")))
}

fn lattice(plan: &Plan) -> Lattice {
    plan.elastic.as_lattice()
}

/// The equations of docs/slab.md literally: one bond and one contact after the other.
struct Page {
    plan: Plan,
    bonds: Vec<Bond>,
    u: Vec<f64>,
    v: Vec<f64>,
    stick: Vec<f64>,
    slides: Vec<bool>,
    since: Vec<u64>,
    step: u64,
    hold_step: u64,
}

impl Page {
    fn of(plan: &Plan) -> Page {
        let mut bonds = Vec::new();
        lattice(plan).over_bonds(|bond| bonds.push(bond));
        Page {
            bonds,
            u: plan.initial.displacement_m.clone(),
            v: plan.initial.velocity_m_per_s.clone(),
            stick: plan.initial.stick_position_m.clone(),
            slides: vec![false; plan.blocks],
            since: vec![0; plan.blocks],
            step: 0,
            hold_step: plan.drive.hold_from_step.unwrap_or(u64::MAX),
            plan: plan.clone(),
        }
    }

    /// Takes a step; returns the contacts that switched with their direction, and the sum of the drive's
    /// forces.
    fn step(&mut self) -> (Vec<(u32, Direction)>, f64) {
        let lattice = lattice(&self.plan);
        let (nodes, contacts) = (lattice.nodes(), lattice.columns);
        let (plan, friction) = (&self.plan, &self.plan.friction);
        self.step += 1;
        let load = plan.load_factor(self.step, self.hold_step);
        let mut force = vec![0.0; 2 * nodes];
        for bond in &self.bonds {
            let of = |values: &[f64], axis: usize| {
                values[axis * nodes + bond.to] - values[axis * nodes + bond.from]
            };
            let stretch = bond.along[0] * of(&self.u, 0) + bond.along[1] * of(&self.u, 1);
            for axis in 0..2 {
                let pull = bond.stiffness_n_per_m * bond.along[axis] * stretch
                    + lattice.damping_kg_per_s * of(&self.v, axis);
                force[axis * nodes + bond.from] += pull;
                force[axis * nodes + bond.to] -= pull;
            }
        }
        for (node, load_n) in lattice.top_row().zip(&plan.top_load_n) {
            force[nodes + node] -= load * load_n;
        }
        let point_m = plan.drive.velocity_m_per_s * plan.grid.time_s(self.step.min(self.hold_step));
        let mut driving = 0.0;
        for spring in &plan.drive.springs {
            let pull = spring.stiffness_n_per_m * (point_m - (self.u[spring.block] - spring.rest_m));
            force[spring.block] += pull;
            driving += pull;
        }
        let tau = force[..contacts].to_vec();
        let p: Vec<f64> =
            (0..contacts).map(|n| (-lattice.foundation_n_per_m * self.u[nodes + n]).max(0.0)).collect();
        for n in 0..contacts {
            force[nodes + n] += p[n];
            force[n] -= match self.slides[n] {
                false => friction.interfacial_stiffness_n_per_m * (self.u[n] - self.stick[n]),
                true if self.v[n] > 0.0 => friction.dynamic_coefficients[n] * p[n],
                true if self.v[n] < 0.0 => -friction.dynamic_coefficients[n] * p[n],
                true => 0.0,
            };
        }
        let dt = plan.grid.step_s();
        for (force, (u, v)) in force.iter().zip(self.u.iter_mut().zip(&mut self.v)) {
            *v += dt * force / plan.block_mass_kg;
            *u += dt * *v;
        }
        let mut switched = Vec::new();
        for n in 0..contacts {
            let waited_s = (self.step - self.since[n]) as f64 * dt;
            let aged = friction
                .ageing
                .as_ref()
                .map_or(0.0, |ageing| ageing.coefficient * (1.0 + waited_s / ageing.time_s).ln());
            if self.slides[n] && self.v[n] <= 0.0 {
                self.slides[n] = false;
                self.stick[n] = self.u[n] - tau[n] / friction.interfacial_stiffness_n_per_m;
                self.since[n] = self.step;
                switched.push((n as u32 + 1, Direction::Attach));
            } else if !self.slides[n] && tau[n].abs() >= (friction.static_coefficients[n] + aged) * p[n] {
                self.slides[n] = true;
                switched.push((n as u32 + 1, Direction::Detach));
            }
        }
        if plan.drive.until_load_ratio.is_some_and(|ratio| {
            self.hold_step == u64::MAX && driving >= ratio * load * plan.total_normal_load_n
        }) {
            self.hold_step = self.step;
        }
        (switched, driving)
    }
}

fn near(a: f64, b: f64, largest: f64) -> bool {
    (a - b).abs() <= 1e-9 * largest
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
        let (mut page, mut plain) = (Page::of(&plan), Plain::new(plan.clone()));
        let (mut switches, mut largest_n) = (0, 0.0_f64);
        for step in 1..=plan.steps {
            let driving = plain.take_step().total_n;
            let (expected_switches, expected) = page.step();
            largest_n = largest_n.max(expected.abs());
            assert!(
                near(driving, expected, largest_n.max(1.0)),
                "{sets:?}, step {step}: {driving} {expected}"
            );
            let found = switched(&plain);
            assert_eq!(found, expected_switches, "{sets:?}, step {step}");
            switches += found.len();
        }
        let state = plain.state();
        let most = |values: &[f64]| values.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
        for (found, expected) in [(&state.displacement_m, &page.u), (&state.velocity_m_per_s, &page.v)] {
            let largest = most(expected).max(1e-9);
            assert!(found.iter().zip(expected).all(|(a, b)| near(*a, *b, largest)), "{sets:?}");
        }
        assert_eq!(state.hold_step, page.hold_step, "{sets:?}");
        assert!(switches > 10, "{sets:?}: {switches} switches");
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
        let records = records(Plain::new(plan(sets)));
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
        let energy = last_energy(&records(Plain::new(plan(&[step, "time.duration_s=0.05"]))));
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
    assert_eq!((fast.name(), plain.name()), ("fast", "plain"));
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
    let (lattice, nodes) = (lattice(&plan), 45);
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
