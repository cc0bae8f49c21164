//! Slabs: single steps beside a plain loop in C, and whole runs of the fast solver beside single steps.

use std::process::Command;

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_simulator::SolverKind;

use crate::{ROUNDS, compiled, first_steps, median, printed, seconds};

/// Steps of the loop in C, and of single steps beside it.
const STEPS: u64 = 20_000;

/// Columns, rows, height, time step, and duration. The default slab is the second; the others have its
/// length, and the largest is simulated up to its second event.
const SLABS: [[&str; 5]; 3] = [
    ["29", "16", "0.075", "4e-7", "0.6"],
    ["57", "31", "0.075", "2e-7", "0.6"],
    ["113", "61", "0.075", "1e-7", "0.22"],
];

fn sets([blocks, rows, height_m, step_s, duration_s]: [&str; 5]) -> Vec<String> {
    vec![
        format!("slider.blocks={blocks}"),
        format!("slider.rows={rows}"),
        format!("slider.height_m={height_m}"),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={duration_s}"),
    ]
}

fn plan(sets: &[String]) -> Plan {
    Plan::new(&resolve("slab", sets).unwrap_or_else(|error| panic!("{error}")))
}

/// Nanoseconds of a single step, and the position of the driven node after all steps.
fn plain_ns(plan: &Plan) -> (f64, f64) {
    let (ns, plain) = first_steps(plan, STEPS);
    (ns, plain.state().displacement_m[plan.drive.springs[0].block])
}

pub(crate) fn slabs() {
    against_c();
    println!("## Slabs: whole runs, from the scenario on, beside single steps\n");
    println!(
        "| contacts x rows | steps | switches | in jumps | time, s | speed-up over single steps |\n|---|---|---|---|---|---|"
    );
    for slab in SLABS {
        let sets = sets(slab);
        let of_plan = plan(&sets);
        let mut counters = None;
        let mut before_ns = plain_ns(&of_plan).0;
        let rounds: Vec<(f64, f64)> = (0..ROUNDS)
            .map(|_| {
                let elapsed_s = seconds(|| {
                    let mut fast = SolverKind::Fast.start(plan(&sets));
                    while fast.next_record().expect("the run stays finite").is_some() {}
                    counters = Some(fast.counters());
                });
                let after_ns = plain_ns(&of_plan).0;
                let single_s = 0.5e-9 * (before_ns + after_ns) * of_plan.steps as f64;
                before_ns = after_ns;
                (elapsed_s, single_s / elapsed_s)
            })
            .collect();
        let counters = counters.expect("it has run");
        println!(
            "| {} x {} | {} | {} | {:.2} % | {:.2} | {:.0} |",
            slab[0],
            slab[1],
            of_plan.steps,
            counters.switches,
            100.0 * counters.jump_steps as f64 / of_plan.steps as f64,
            median(rounds.iter().map(|(elapsed_s, _)| *elapsed_s).collect()),
            median(rounds.iter().map(|(_, ratio)| *ratio).collect()),
        );
    }
    println!();
}

/// Compares with a C program that steps node by node, on an equal slab from an equal state.
fn against_c() {
    println!("## Single steps of the default slab, beside a plain loop in C at -O3\n");
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let program = compiled("slab");
    let plan = plan(&sets(SLABS[1]));
    let lattice = &plan.elastic;
    let drive = plan.drive.springs[0];
    let numbers = [
        lattice.stiffness_n_per_m,
        lattice.damping_kg_per_s,
        lattice.foundation_n_per_m,
        plan.friction.interfacial_stiffness_n_per_m,
        plan.friction.static_coefficient,
        plan.friction.dynamic_coefficient,
        plan.top_load_n[0],
        drive.stiffness_n_per_m,
        plan.drive.velocity_m_per_s,
        plan.grid.step_s(),
        plan.block_mass_kg,
    ];
    let start = folder.path().join("start");
    let bytes: Vec<u8> = plan.initial.displacement_m.iter().flat_map(|u| u.to_le_bytes()).collect();
    std::fs::write(&start, bytes).expect("the state is written");
    let c_ns = || {
        let found = printed(
            Command::new(&program)
                .arg(&start)
                .args([lattice.columns, lattice.rows, drive.block, STEPS as usize].map(|n| n.to_string()))
                .args(numbers.map(|number| number.to_string())),
        );
        (found[0], found[1])
    };
    let nodes = lattice.nodes() as f64;
    let rounds: Vec<[f64; 2]> = (0..ROUNDS)
        .map(|_| {
            let ((c, of_c), (own, of_own)) = (c_ns(), plain_ns(&plan));
            assert!((of_c - of_own).abs() <= 1e-12 * of_own.abs(), "C has {of_c}, single steps {of_own}");
            [c / nodes, own / nodes]
        })
        .collect();
    let of = |at: usize| median(rounds.iter().map(|round| round[at]).collect());
    println!("| in C, ns for a node and step | `--solver plain` | plain/C |\n|---|---|---|");
    let ratio = median(rounds.iter().map(|[c, own]| own / c).collect());
    println!("| {:.2} | {:.2} | {ratio:.2} |\n", of(0), of(1));
}
