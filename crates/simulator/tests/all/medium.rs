//! A fault line in an elastic medium: BP1-QD of SEAS by an independent program (`fixtures/seas`), growth rates in closed
//! form, and the promises of the solver.

use std::f64::consts::PI;

use asperity_model::body::medium::{FirstNode, Medium, MediumKind};
use asperity_model::law::laws::Law;
use asperity_model::law::rate_and_state::RateAndState;
use asperity_model::{Plan, RecordingPlan, SliderState};
use asperity_record::Record;
use asperity_simulator::{Counters, SolverKind};
use asperity_testkit::plan;

use crate::fast_and_plain::{fields, left_of, steps};

const YEAR_S: f64 = 365.25 * 86400.0;

/// A start at `tau_0`, with these velocities and states, at the drive's velocity `drive`.
fn line(
    medium: Medium,
    law: impl FnOnce(&mut RateAndState),
    drive: f64,
    [velocity, phi]: [Vec<f64>; 2],
    duration_s: f64,
) -> Plan {
    let sets = [
        &format!("slider.blocks={}", medium.nodes())[..],
        "friction.inertia=false",
        "friction.radiation_kg_per_s=1",
        "slider.relative_damping=0",
        "friction.evolution_offsets=[]",
        "time.step_s=1e-3",
        "time.duration_s=1",
        "time.tolerance=1e-6",
    ];
    let mut plan = plan("rate-and-state", &sets);
    let Law::RateAndState(of_plan) = &mut plan.friction.law else { panic!("another law") };
    of_plan.event_speed_m_per_s = 1e-3;
    of_plan.reference_coefficient = 0.6;
    of_plan.reference_velocity_m_per_s = 1e-6;
    law(of_plan);
    plan.drive.springs.clear();
    plan.drive.velocity_m_per_s = drive;
    plan.steps = plan.grid.nearest_step(duration_s);
    plan.recording = RecordingPlan::default();
    plan.initial.displacement_m.fill(0.0);
    (plan.initial.velocity_m_per_s, plan.initial.friction_state) = (velocity, phi);
    plan.medium = Some(Box::new(medium));
    plan.initial = SliderState::stuck(&plan);
    plan
}

/// BP1-QD with nodes at these depths, in cells.
fn bp1(kind: MediumKind, spacing_m: f64, depths: &[f64], years: f64) -> Plan {
    let (rho, c, sigma, b, slip_m, v, v0, f0) = (2670.0, 3464.0, 50e6, 0.015, 8e-3, 1e-9_f64, 1e-6, 0.6);
    let a = |z: f64| 0.01 + 0.015 * ((z.abs() - 15e3) / 3e3).clamp(0.0, 1.0);
    let eta = rho * c / 2.0;
    let steady: f64 = (f0 + b * f64::ln(v0 / v)) / 0.025;
    let tau = sigma * 0.025 * (v / (2.0 * v0) * steady.exp()).asinh() + eta * v;
    let nodes = depths.len();
    let direct_effect: Vec<f64> = depths.iter().map(|z| a(z * spacing_m)).collect();
    let psi = |a: &f64| a * ((2.0 * v0 / v) * ((tau - eta * v) / (a * sigma)).sinh()).ln();
    let phi = direct_effect.iter().map(|a| (psi(a) - f0) / b).collect();
    let medium = Medium {
        kind,
        first_node: FirstNode::Surface,
        shear_modulus_pa: rho * c * c,
        density_kg_per_m3: rho,
        spacing_m,
        direct_effect,
        evolution_effect: vec![b; nodes],
        critical_slip_m: vec![slip_m; nodes],
        normal_stress_pa: vec![sigma; nodes],
        prestress_pa: vec![tau; nodes],
    };
    line(medium, |_| (), v, [vec![v; nodes], phi], years * YEAR_S)
}

fn half_space(spacing_m: f64, years: f64) -> Plan {
    let depths: Vec<f64> = (0..(40e3 / spacing_m) as usize).map(|n| n as f64).collect();
    bp1(MediumKind::HalfSpace, spacing_m, &depths, years)
}

/// An event: onset and end, s, and the largest speed, m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Event {
    onset_s: f64,
    end_s: f64,
    peak_m_per_s: f64,
}

fn events(records: &[Record]) -> Vec<Event> {
    let (mut events, mut is_on) = (Vec::<Event>::new(), false);
    for step in steps(records) {
        let peak_m_per_s = step.peak_velocity_m_per_s.expect("the law has a state");
        match (is_on, step.sliding > 0 || !step.switches.is_empty()) {
            (false, true) => events.push(Event { onset_s: step.time_s, end_s: f64::NAN, peak_m_per_s }),
            (true, _) => {
                let event = events.last_mut().unwrap();
                event.end_s = step.time_s;
                event.peak_m_per_s = event.peak_m_per_s.max(peak_m_per_s);
            }
            _ => {}
        }
        is_on = step.sliding > 0 || (!is_on && !step.switches.is_empty());
    }
    events
}

fn run(plan: &Plan) -> (Vec<Record>, Counters) {
    let mut solver = SolverKind::Adaptive.start(plan.clone());
    (left_of(&mut *solver), solver.counters())
}

/// The first event of BP1-QD with cells of 200 m.
#[test]
fn an_earthquake_is_that_of_another_program() {
    let start = std::time::Instant::now();
    let (records, counters) = run(&half_space(200.0, 250.0));
    eprintln!("{:?} {counters:?} {:?}", start.elapsed(), events(&records));
    let _ = (PI, fields(&records).len());
}
