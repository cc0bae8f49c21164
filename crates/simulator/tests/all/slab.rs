//! Slabs, compared with an independent implementation bond by bond, and with physical laws.

use asperity_model::Plan;
use asperity_record::Direction;
use asperity_simulator::{Plain, Solver, SolverKind};
use asperity_testkit::SMALL_SLAB;

use crate::fast_and_plain::{records, steps};
use crate::page::{self, Page, Switches, does_what_the_page_says};

fn plan(sets: &[&str]) -> Plan {
    asperity_testkit::plan("slab", &[&SMALL_SLAB[..], sets].concat())
}

/// The contacts of docs/bodies.md.
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
    let mut counts = [0; 3];
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
        // Pulled at its top edge, its trailing contact lifts off.
        &["drive.height_m=0.07", "drive.velocity_m_per_s=8e-3"],
    ] {
        let plan = plan(sets);
        let contacts = Contacts {
            tau_n: Vec::new(),
            stick: plan.initial.stick_position_m.clone(),
            slides: vec![false; plan.blocks],
            since: vec![0; plan.blocks],
        };
        let found = does_what_the_page_says(&plan, contacts, 1e-9, &format!("{sets:?}"));
        (0..3).for_each(|of| counts[of] += found[of]);
    }
    assert!(counts[0] > 5 && counts[2] > 100, "{counts:?}");
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

/// A sliding contact is resisted by `mu_d p` in either direction, and by nothing at rest.
#[test]
fn a_sliding_contact_at_rest_feels_no_friction() {
    const AT: usize = 3;
    let plan = plan(&[]);
    for (v, resisted_by) in [(0.0, 0.0), (1e-3, 0.17), (-1e-3, -0.17)] {
        let mut plain = Plain::new(plan.clone());
        for _ in 0..100 {
            plain.take_step();
        }
        let mut before = plain.snapshot();
        before.slider.slip[AT] = 1.0;
        before.slider.detached = 1;
        before.slider.velocity_m_per_s[AT] = v;
        plain.restore(&before);
        plain.take_step();
        let after = plain.state();
        let force_n = (after.velocity_m_per_s[AT] - v) * plan.block_mass_kg / plan.grid.step_s();
        let expected_n = after.tangential_force_n[AT] - resisted_by * after.normal_load_n[AT];
        assert!((force_n - expected_n).abs() < 1e-9 * expected_n.abs(), "{v}: {force_n} {expected_n}");
    }
}
