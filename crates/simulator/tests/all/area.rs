//! Sheets and bodies, compared with an independent implementation bond by bond, with their mirror images and
//! with physical laws.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_record::Direction;
use asperity_simulator::{Plain, SliderState, Solver, SolverKind};

use crate::fast_and_plain::{assert_balanced, last_energy, records, switched};
use crate::page::{self, Page, Switches, does_what_the_page_says};

/// A scenario, and what is set in all cases of it.
type Base = (&'static str, &'static [&'static str]);

/// 9 x 4 nodes of a hundred times the mass, driven at forty times the velocity.
const SHEET: Base = (
    "sheet-coarse",
    &[
        "slider.blocks=9",
        "slider.across=4",
        "slider.width_m=0.0375",
        "slider.mass_kg=1.2",
        "drive.velocity_m_per_s=4e-3",
        "time.step_s=8e-6",
        "time.duration_s=0.08",
        "recording.sample_s=8e-4",
        "recording.fields_s=0",
    ],
);

/// 9 x 4 x 3 nodes, likewise.
const BODY: Base = (
    "body-coarse",
    &[
        "slider.blocks=9",
        "slider.across=4",
        "slider.rows=3",
        "slider.width_m=0.0525",
        "slider.height_m=0.035",
        "slider.mass_kg=25.2",
        "drive.velocity_m_per_s=4e-3",
        "time.step_s=8e-6",
        "time.duration_s=0.08",
        "recording.sample_s=8e-4",
        "recording.fields_s=0",
    ],
);

fn plan((name, base): (&str, &[&str]), sets: &[&str]) -> Plan {
    let sets: Vec<&str> = base.iter().chain(sets).copied().collect();
    Plan::new(&resolve(name, &sets).unwrap_or_else(|error| panic!("{error}")))
}

/// Drives, loads and friction of both.
const CASES: [(Base, &[&str]); 12] = [
    (SHEET, &[]),
    (SHEET, &["drive.across=1"]),
    (SHEET, &["drive.across=3", "normal_load.tilt=0.6", "slider.relative_damping=0.4"]),
    (SHEET, &["drive.kind=top", "drive.tilt=0.4", "friction.static_spread=0.1", "friction.spread_seed=7"]),
    (SHEET, &["normal_load.schedule_s=[0.01,0.06]", "normal_load.schedule_n=[400,150]"]),
    (
        SHEET,
        &[
            "drive.until_load_ratio=0.3",
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0.001,0.02]",
            "normal_load.schedule_n=[400,100]",
        ],
    ),
    (BODY, &[]),
    (BODY, &["drive.across=1", "normal_load.tilt=-0.3"]),
    (BODY, &["drive.across=4", "drive.height_m=0.035", "normal_load.foundation_stiffness_ratio=0.5"]),
    (BODY, &["drive.kind=top", "drive.height_m=0", "drive.decay_length_m=0.05"]),
    (BODY, &["normal_load.schedule_s=[0.01,0.06]", "normal_load.schedule_n=[6400,2500]"]),
    // Pulled at its top under a low load, the body lifts off.
    (BODY, &["drive.height_m=0.035", "normal_load.total_n=1500", "friction.static_coefficient=0.9"]),
];

/// The contacts of docs/area.md.
struct Contacts {
    tau_n: Vec<[f64; 2]>,
    stick: Vec<[f64; 2]>,
    slides: Vec<bool>,
    direction: Vec<[f64; 2]>,
}

fn product(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn size(a: [f64; 2]) -> f64 {
    product(a, a).sqrt()
}

impl page::Contacts for Contacts {
    fn resist(&mut self, page: &Page, loads_n: &[f64], force_n: &mut [f64]) {
        let (friction, nodes) = (&page.plan.friction, page.lattice.nodes());
        let (dt, m, kt) =
            (page.plan.grid.step_s(), page.plan.block_mass_kg, friction.interfacial_stiffness_n_per_m);
        self.tau_n = (0..loads_n.len()).map(|n| [force_n[n], force_n[nodes + n]]).collect();
        for (n, load_n) in loads_n.iter().enumerate() {
            let (pull, u, v) =
                (self.tau_n[n], [page.u[n], page.u[nodes + n]], [page.v[n], page.v[nodes + n]]);
            let resists = if self.slides[n] {
                let coming = [v[0] + dt * pull[0] / m, v[1] + dt * pull[1] / m];
                let w = if product(coming, v) > 0.0 { coming } else { v };
                let drag = friction.dynamic_coefficients[n] * load_n;
                if size(w) == 0.0 { [0.0; 2] } else { w.map(|along| drag * along / size(w)) }
            } else {
                [kt * (u[0] - self.stick[n][0]), kt * (u[1] - self.stick[n][1])]
            };
            force_n[n] -= resists[0];
            force_n[nodes + n] -= resists[1];
        }
    }

    fn switch(&mut self, page: &Page, loads_n: &[f64]) -> Switches {
        let (friction, nodes) = (&page.plan.friction, page.lattice.nodes());
        let kt = friction.interfacial_stiffness_n_per_m;
        let mut switches = Vec::new();
        for (n, load_n) in loads_n.iter().enumerate() {
            let (tau_n, u, v) =
                (self.tau_n[n], [page.u[n], page.u[nodes + n]], [page.v[n], page.v[nodes + n]]);
            if self.slides[n] {
                if product(v, self.direction[n]) <= 0.0 {
                    self.slides[n] = false;
                    self.stick[n] = [u[0] - tau_n[0] / kt, u[1] - tau_n[1] / kt];
                    switches.push((n as u32 + 1, Direction::Attach));
                }
            } else if size(tau_n) >= friction.static_coefficients[n] * load_n {
                self.slides[n] = true;
                self.direction[n] = tau_n;
                switches.push((n as u32 + 1, Direction::Detach));
                continue;
            }
            // From the second step of a slip on, the velocity before the step.
            self.direction[n] = v;
        }
        switches
    }
}

/// Equal switches in equal steps, and equal numbers.
#[test]
fn sheets_and_bodies_do_what_the_page_says() {
    let (mut backwards, mut across, mut lifted) = (0, 0, 0);
    for (base, sets) in CASES {
        let plan = plan(base, sets);
        let contacts = Contacts {
            tau_n: Vec::new(),
            stick: vec![[0.0; 2]; plan.blocks],
            slides: vec![false; plan.blocks],
            direction: vec![[0.0; 2]; plan.blocks],
        };
        does_what_the_page_says(&plan, contacts, 1e-8, &format!("{base:?} {sets:?}"), |plain, switches| {
            let tau_n = &plain.state().tangential_force_n;
            for (contact, _) in switches.iter().filter(|(_, way)| *way == Direction::Detach) {
                let n = *contact as usize - 1;
                backwards += usize::from(tau_n[n] < 0.0);
                across += usize::from(tau_n[plan.blocks + n].abs() > 0.1 * tau_n[n].abs());
            }
            let loads_n = &plain.state().normal_load_n;
            lifted += loads_n.iter().filter(|load_n| **load_n == 0.0).count();
        });
    }
    assert!(backwards > 5 && across > 20 && lifted > 1000, "{backwards} {across} {lifted}");
}

/// The mirror image of a contact.
fn mirrored(plan: &Plan, contact: u32) -> u32 {
    let contacts = plan.elastic.layout();
    let (column, row) = (contacts.column(contact), contacts.row(contact));
    (contacts.rows() - row) * contacts.columns() + column
}

/// Pulled at a row, the switches of one run are those of the other pulled at its mirror image, in the same
/// steps and to the bit.
#[test]
fn a_mirrored_drive_gives_the_mirrored_run() {
    for (base, sets) in [
        (SHEET, [["drive.across=1"], ["drive.across=4"]]),
        (SHEET, [["drive.across=2"], ["drive.across=3"]]),
        (BODY, [["drive.across=1"], ["drive.across=4"]]),
    ] {
        let plans = sets.map(|sets| plan(base, &sets));
        let mut runs = plans.each_ref().map(|plan| Plain::new(plan.clone()));
        let plan = &plans[0];
        let (nodes, lattice) = (plan.elastic.nodes(), plan.elastic);
        let mut switches = 0;
        for step in 1..=plan.steps {
            let [a, b] = &mut runs;
            assert_eq!(a.take_step(), b.take_step(), "{sets:?}, step {step}");
            let mut expected: Vec<_> =
                switched(a).into_iter().map(|(n, way)| (mirrored(plan, n), way)).collect();
            expected.sort_unstable_by_key(|(n, _)| *n);
            assert_eq!(switched(b), expected, "{sets:?}, step {step}");
            switches += expected.len();
        }
        let [u, of_mirrored] = runs.each_ref().map(|run| &run.state().displacement_m);
        for node in 0..nodes {
            let [column, lane, row] = lattice.place(node);
            let other = (row * lattice.lanes + lattice.lanes - 1 - lane) * lattice.columns + column;
            for axis in 0..lattice.axes() {
                let sign = if lattice.table.axes[axis] == 1 { -1.0 } else { 1.0 };
                assert_eq!(u[axis * nodes + node], sign * of_mirrored[axis * nodes + other], "{sets:?}");
            }
        }
        assert!(switches > 20, "{switches}");
    }
}

/// What is symmetric stays so, exactly where the start is, and otherwise to the symmetry of the rest state.
#[test]
fn a_symmetric_run_stays_symmetric() {
    for (base, sets, tolerance_m) in
        [(SHEET, &[][..], 0.0), (SHEET, &["normal_load.tilt=0.5"], 0.0), (BODY, &[], 1e-15)]
    {
        let plan = plan(base, sets);
        let mut plain = Plain::new(plan.clone());
        let (nodes, contacts) = (plan.elastic.nodes(), plan.elastic.layout());
        let mut switches = 0;
        for step in 1..=plan.steps {
            plain.take_step();
            let found = switched(&plain);
            for (contact, way) in &found {
                assert!(
                    found.contains(&(mirrored(&plan, *contact), *way)),
                    "{sets:?}, step {step}: {contact}"
                );
            }
            switches += found.len();
        }
        let u = &plain.state().displacement_m;
        for contact in 1..=contacts.count() {
            let (n, other) = (contact as usize - 1, mirrored(&plan, contact) as usize - 1);
            assert!((u[n] - u[other]).abs() <= tolerance_m, "{sets:?}, contact {contact}");
            assert!((u[nodes + n] + u[nodes + other]).abs() <= tolerance_m, "{sets:?}, contact {contact}");
        }
        assert!(switches > 20, "{sets:?}: {switches}");
    }
}

#[test]
fn energies_over_an_area_close() {
    for (base, sets) in CASES {
        let records = records(SolverKind::Plain.start(plan(base, sets)));
        assert_balanced(&records, 1e-11, &format!("{sets:?}"));
        let last = last_energy(&records);
        assert!(last.friction_heat_j > 1e-3 * last.drive_work_j, "{sets:?}: {last:?}");
        assert!(last.viscous_loss_j > 0.0 && last.anchor_change_j < 0.0, "{sets:?}: {last:?}");
    }
}

/// From any step, also from one in which contacts have just detached.
#[test]
fn a_restored_state_goes_on_to_the_bit() {
    for (base, sets) in [(SHEET, &["drive.across=1"][..]), (BODY, &["drive.across=1"])] {
        let plan = Arc::new(plan(base, sets));
        let mut whole = Plain::new(Arc::clone(&plan));
        let mut other = Plain::new(Arc::clone(&plan));
        let mut just_detached = 0;
        for step in 1..=plan.steps {
            whole.take_step();
            if whole.switched().is_empty() && step % 501 != 0 {
                continue;
            }
            let saved = whole.snapshot();
            assert!(saved.fits(&plan));
            other.restore(&saved);
            for _ in 0..3 {
                whole.take_step();
                other.take_step();
            }
            assert_eq!(other.snapshot(), whole.snapshot(), "{sets:?}, after step {step}");
            whole.restore(&saved);
            just_detached += saved.slider.just_detached.len();
            if let Some(contact) = saved.slider.just_detached.first() {
                let state = saved.slider.clone();
                for contacts in [vec![*contact, *contact], vec![plan.blocks as u32]] {
                    let wrong = SliderState { just_detached: contacts, ..state.clone() };
                    assert!(!wrong.fits(&plan), "twice, or none of the contacts");
                }
                let mut stuck = state;
                stuck.slip[*contact as usize] = 0.0;
                stuck.detached -= 1;
                assert!(!stuck.fits(&plan), "it is said to have detached");
            }
        }
        assert!(just_detached > 10, "{sets:?}: {just_detached}");
        let state = whole.state();
        let short =
            SliderState { stick_position_m: state.stick_position_m[..plan.blocks].to_vec(), ..state.clone() };
        assert!(!short.fits(&plan), "anchors have two coordinates");
    }
}
