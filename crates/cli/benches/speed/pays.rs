//! Cases where the fast solver might not pay: no run may take longer than with the plain solver.
//!
//! Random scenarios over all laws, drives, loads and starts, with time steps from a hundredth of the
//! longest stable one to most of it, so that blocks switch rarely in some and in every other step in
//! others. Both solvers run each of them in turn. Runs that are stopped by their energies within a few
//! steps, as some time steps cause, are too short to compare and are left out.

use asperity_model::Plan;
use asperity_simulator::{Counters, Solver, SolverKind};
use asperity_testkit::Random;

use crate::seconds;

/// How many scenarios.
const SCENARIOS: u64 = 200;

/// The seed of the scenarios.
const SEED: u64 = 16;

/// How many times both solvers run each; the median counts.
const PAIRS: usize = 3;

/// Number of repetitions if the fast solver seems not to pay, so that other processes do not decide the
/// result.
const MORE_PAIRS: usize = 15;

/// Relative difference of the drive's velocity from one pair to the next. A run whose blocks chatter is
/// chaotic: rounding decides how many switches it has, by a third and more, and each takes time. So both
/// solvers run a few that differ in nothing else, and their total times are compared.
const APART: f64 = 1e-13;

/// How many of the worst are printed.
const WORST: usize = 10;

/// Seconds that a plain run may take, about.
const PLAIN_S: [f64; 2] = [0.15, 0.6];

/// Known hard cases: scenarios with chattering, creeping or unloaded blocks.
const HARD: [(&str, &str, &[&str]); 10] = [
    ("undamped", "default", &["slider.relative_damping=0", "time.step_s=1e-7", "time.duration_s=0.5"]),
    ("undamped, as stated", "default", &[STATED, "slider.relative_damping=0", "time.step_s=2e-7", FIRST]),
    (
        "stiff friction springs",
        "default",
        &[STATED, "friction.interfacial_stiffness_ratio=1e3", "time.duration_s=0.05"],
    ),
    ("creep", "first-precursor", &["friction.interfacial_stiffness_ratio=10", "time.duration_s=0.05"]),
    ("coarse steps", "default", &[STATED, "time.step_s=1e-7", FIRST]),
    ("two-way rule", "default", &[STATED, "friction.reattach=two-way", "time.duration_s=0.05"]),
    ("unloaded end", "default", &["normal_load.tilt=1", "time.step_s=1e-7", "time.duration_s=0.3"]),
    ("unloaded start", "default", &["normal_load.tilt=-1", "time.step_s=1e-7", "time.duration_s=0.3"]),
    ("rigid, critical", "front", &["slider.relative_damping=1", "time.duration_s=0.00001"]),
    ("rigid, sliding", "slip-pulse", &["slider.relative_damping=3", "time.duration_s=0.00001"]),
];

const STATED: &str = "parameter_set=as-stated";
const FIRST: &str = "time.duration_s=0.3";

/// One scenario, and how long both solvers take.
struct Case {
    name: String,
    plain_s: f64,
    /// Time of the plain solver over that of the fast one; none of a run that its energies stop.
    ratio: Option<f64>,
    counters: Counters,
}

pub(crate) fn pays() {
    println!("## Where the fast solver does not pay: time of the plain solver over its own\n");
    // Resolves all of them first, so that a refusal is reported at once.
    let random: Vec<(String, Plan)> = (0..SCENARIOS)
        .map(|number| {
            let set = random_scenario(number);
            (format!("{number}: {}", set.join(" ")), asperity_testkit::plan("default", &set))
        })
        .collect();
    let mut hard: Vec<Case> = HARD
        .iter()
        .map(|(name, scenario, set)| {
            Case::of((*name).to_owned(), &asperity_testkit::plan(scenario, &[*set, &QUIET].concat()))
        })
        .collect();
    table(&mut hard);
    let mut random: Vec<Case> = random.into_iter().map(|(name, plan)| Case::of(name, &plan)).collect();
    let compared = || random.iter().filter(|case| case.ratio.is_some());
    let mut plain_s: Vec<f64> = compared().map(|case| case.plain_s).collect();
    plain_s.sort_by(f64::total_cmp);
    println!(
        "{SCENARIOS} random scenarios; the plain solver takes {:.2} to {:.2} s.\n",
        plain_s[0],
        plain_s[plain_s.len() - 1]
    );
    let mut ratios: Vec<f64> = compared().filter_map(|case| case.ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let [least, twentieth, tenth, half, most] =
        [0, 5, 10, 50, 100].map(|percent| ratios[(ratios.len() - 1) * percent / 100]);
    println!("| runs | least | 5 % | 10 % | half | most |\n|---|---|---|---|---|---|");
    println!("| {} | {least:.2} | {twentieth:.2} | {tenth:.2} | {half:.1} | {most:.0} |", ratios.len());
    println!("\nThe worst of them:\n");
    random.sort_by(|a, b| a.order().total_cmp(&b.order()));
    table(&mut random[..WORST]);
}

/// Records are not measured.
const QUIET: [&str; 3] = ["recording.sample_s=0", "recording.fields_s=0", "recording.event_fields=false"];

fn table(cases: &mut [Case]) {
    cases.sort_by(|a, b| a.order().total_cmp(&b.order()));
    println!(
        "| scenario | plain solver, s | ratio | switches per step | one by one | steps of a window | terms per step |\n\
         |---|---|---|---|---|---|---|"
    );
    for Case { name, plain_s, ratio, counters } in cases {
        let steps = counters.steps() as f64;
        let ratio = ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
        println!(
            "| {name} | {plain_s:.2} | {ratio} | {:.1e} | {:.3} | {} | {:.2} |",
            counters.switches as f64 / steps,
            counters.plain_steps as f64 / steps,
            counters.window_steps.checked_div(counters.windows).unwrap_or(0),
            counters.applications as f64 / steps,
        );
    }
    println!();
}

impl Case {
    fn of(name: String, plan: &Plan) -> Case {
        let mut plain_s = 0.0;
        let mut counters = Counters::default();
        let mut ratios = Vec::new();
        for pair in 0..MORE_PAIRS {
            if pair == PAIRS && crate::median(ratios.clone()) >= 1.0 {
                break;
            }
            let mut plan = plan.clone();
            plan.drive.velocity_m_per_s *= 1.0 + pair as f64 * APART;
            let mut took_s = [0.0; 2];
            let mut is_whole = true;
            for is_fast in if pair % 2 == 0 { [false, true] } else { [true, false] } {
                took_s[usize::from(is_fast)] = if is_fast {
                    seconds(|| (counters, is_whole) = whole(SolverKind::Fast.start(plan.clone())))
                } else {
                    seconds(|| {
                        whole(SolverKind::Plain.start(plan.clone()));
                    })
                };
            }
            plain_s = took_s[0];
            if !is_whole {
                return Case { name, plain_s, ratio: None, counters };
            }
            ratios.push(took_s[0] / took_s[1]);
        }
        Case { name, plain_s, ratio: Some(crate::median(ratios)), counters }
    }

    /// The worst first, cases without a comparison last.
    fn order(&self) -> f64 {
        self.ratio.unwrap_or(f64::INFINITY)
    }
}

/// Takes a run; and whether it came to its end.
fn whole(mut solver: Box<dyn Solver>) -> (Counters, bool) {
    loop {
        match solver.next_record() {
            Ok(Some(record)) => drop(std::hint::black_box(record)),
            end => return (solver.counters(), end.is_ok()),
        }
    }
}

/// Overrides of a random scenario, equal for equal numbers.
fn random_scenario(number: u64) -> Vec<String> {
    let mut noise = Random::new((SEED * 1000 + number).wrapping_mul(0x9e37_79b9_7f4a_7c15) + 1);
    let blocks = noise.log_uniform(2.0, 700.0) as u32;
    let n = f64::from(blocks);
    let mass_kg = noise.log_uniform(1e-3, 30.0);
    let damping = noise.pick(&[0.0, 0.0, 0.03, 0.3, 1.0, 1.0, 3.0]);
    let ratio = noise.pick(&[1.0, 1.0, 10.0, 1e-3, 1e3]);
    let drive_n_per_m = noise.log_uniform(1e4, 1e8);
    let mu_s = noise.uniform(0.1, 1.0);
    let mu_d = mu_s * noise.uniform(0.3, 0.95);
    let k = 2.5e9 * (n - 1.0) * 1e-4 / 0.1;
    let m = mass_kg / n;
    let omega2 = (4.0 * k + ratio * k + drive_n_per_m) / m;
    let gamma = 4.0 * damping * (k * m).sqrt() / m;
    let longest_s = ((gamma * gamma + 4.0 * omega2).sqrt() - gamma) / omega2;
    let step_s = longest_s * noise.log_uniform(0.01, 0.6);
    let step_s = format!("{step_s:.2e}").parse::<f64>().expect("it was just printed");
    let plain_s = noise.log_uniform(PLAIN_S[0], PLAIN_S[1]);
    let steps = (plain_s / (30e-9 + 0.9e-9 * n)).round();
    // Fast enough for the whole slider to be pulled past its threshold a few times.
    let reach_m = 400.0 * mu_s * (1.0 / drive_n_per_m + 1.0 / k) * noise.log_uniform(1.0, 20.0);
    let velocity_m_per_s = reach_m / (steps * step_s);
    let mut set = vec![
        format!("slider.blocks={blocks}"),
        format!("slider.mass_kg={mass_kg}"),
        format!("slider.relative_damping={damping:?}"),
        format!("friction.static_coefficient={mu_s}"),
        format!("friction.dynamic_coefficient={mu_d}"),
        format!("normal_load.tilt={:?}", noise.pick(&[0.0, 0.0, 0.7, -0.7, 1.0, -1.0])),
        format!("drive.stiffness_n_per_m={drive_n_per_m}"),
        format!("drive.velocity_m_per_s={velocity_m_per_s}"),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={}", step_s * steps),
        format!("recording.sample_s={}", step_s * 10_000.0),
        "recording.fields_s=0".to_owned(),
        "recording.event_fields=false".to_owned(),
    ];
    let mut add = |text: String| set.push(text);
    let law = noise.pick(&["interfacial-springs", "interfacial-springs", "rigid", "velocity-weakening"]);
    add(format!("friction.law={law}"));
    let drive = noise.pick(&["side", "side", "top", "left-right"]);
    add(format!("drive.kind={drive}"));
    if law == "interfacial-springs" {
        add(format!("friction.interfacial_stiffness_ratio={ratio}"));
        if drive == "left-right" || noise.below(2) == 0 {
            add("friction.reattach=two-way".to_owned());
        }
        if noise.below(4) == 0 {
            add("friction.ageing_coefficient=0.02".to_owned());
            add(format!("friction.ageing_time_s={}", step_s * 1000.0));
        }
        if noise.below(3) == 0 {
            add(format!("initial_shear.beta={}", 0.5 * mu_d));
        }
    }
    if law == "velocity-weakening" {
        let slip_m_per_s = 400.0 / n * mu_s / (k * m).sqrt();
        add(format!("friction.weakening_velocity_m_per_s={}", slip_m_per_s * noise.log_uniform(0.1, 10.0)));
        add(format!("friction.radiation_kg_per_s={}", noise.pick(&[0.0, 0.1]) * (k * m).sqrt()));
    }
    if drive == "top" {
        add(format!("drive.tilt={:?}", noise.pick(&[0.0, 0.5])));
    }
    if noise.below(3) == 0 {
        add(format!("prestress.ratio={}", mu_s * noise.pick(&[-0.5, 0.5, 0.9])));
    }
    if law == "interfacial-springs" && noise.below(3) == 0 {
        let amplitude = velocity_m_per_s * noise.log_uniform(0.1, 100.0);
        add(format!("initial_velocity.amplitude_m_per_s={amplitude}"));
        add(format!("initial_velocity.mode={}", noise.below(u64::from(blocks))));
    }
    if noise.below(4) == 0 {
        let knots = [0.3, 0.6].map(|share| step_s * (steps * share).round());
        add(format!("normal_load.schedule_s=[{},{}]", knots[0], knots[1]));
        add(format!("normal_load.schedule_n=[400,{}]", noise.pick(&[50.0, 300.0, 800.0])));
    }
    if noise.below(4) == 0 {
        add(format!("friction.static_spread={}", 0.3 * (mu_s - mu_d)));
        add(format!("friction.dynamic_spread={}", 0.3 * (mu_s - mu_d)));
    }
    set
}
