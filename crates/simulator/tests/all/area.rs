//! Sheets and bodies, compared with an independent implementation bond by bond, with their mirror images and
//! with physical laws.

use asperity_model::Plan;
use asperity_record::Direction;
use asperity_simulator::Plain;

use crate::fast_and_plain::switched;
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
    asperity_testkit::plan(name, &[base, sets].concat())
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

/// The contacts of docs/bodies.md.
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
    let mut counts = [0; 3];
    for (base, sets) in CASES {
        let plan = plan(base, sets);
        let contacts = Contacts {
            tau_n: Vec::new(),
            stick: vec![[0.0; 2]; plan.blocks],
            slides: vec![false; plan.blocks],
            direction: vec![[0.0; 2]; plan.blocks],
        };
        let what = format!("{base:?} {sets:?}");
        let found = does_what_the_page_says(&plan, contacts, 1e-8, &what);
        (0..3).for_each(|of| counts[of] += found[of]);
    }
    assert!(counts[0] > 5 && counts[1] > 20 && counts[2] > 1000, "{counts:?}");
}

/// The mirror image of a contact.
fn mirrored(plan: &Plan, contact: u32) -> u32 {
    let contacts = plan.elastic.layout();
    let (column, row) = (contacts.column(contact), contacts.row(contact));
    (contacts.rows() - row) * contacts.columns() + column
}

/// Pulled at a row, the switches of one run are those of the other pulled at its mirror image, in the same
/// steps and to the bit; where both are one, it stays symmetric.
#[test]
fn a_mirrored_drive_gives_the_mirrored_run() {
    for (base, sets) in [
        (SHEET, [&["drive.across=1"][..], &["drive.across=4"]]),
        (SHEET, [&["drive.across=2"], &["drive.across=3"]]),
        (BODY, [&["drive.across=1"], &["drive.across=4"]]),
        (SHEET, [&[]; 2]),
        (SHEET, [&["normal_load.tilt=0.5"]; 2]),
        (BODY, [&[]; 2]),
    ] {
        let plans = sets.map(|sets| plan(base, sets));
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
