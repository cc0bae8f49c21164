//! Sheets and bodies: whole runs of the fast solver beside single steps, and what three dimensions cost.

use asperity_model::resolve;
use asperity_model::{Plan, RecordingPlan};
use asperity_record::Record;
use asperity_simulator::{Counters, SolverKind};

use crate::{ROUNDS, first_steps, median, resident_mb, seconds};

/// A scenario with changes, and its name in the table.
struct Case {
    name: &'static str,
    scenario: &'static str,
    sets: &'static [&'static str],
}

const CASES: [Case; 5] = [
    Case { name: "sheet 26 x 6", scenario: "sheet-coarse", sets: &[] },
    Case { name: "sheet 51 x 11", scenario: "sheet", sets: &[] },
    Case { name: "sheet 51 x 11, pulled at a corner", scenario: "sheet", sets: &["drive.across=1"] },
    Case { name: "body 29 x 5 x 16", scenario: "body-coarse", sets: &[] },
    Case { name: "body 57 x 9 x 31", scenario: "body", sets: &[] },
];

/// Bodies of the same size with finer and finer spacing, each over its first events.
const SPACINGS: [Case; 4] = [
    Case {
        name: "15 x 3 x 8",
        scenario: "body-coarse",
        sets: &[
            "slider.blocks=15",
            "slider.across=3",
            "slider.rows=8",
            "slider.height_m=0.07",
            "time.step_s=8e-7",
            "time.duration_s=0.24",
        ],
    },
    Case { name: "29 x 5 x 16", scenario: "body-coarse", sets: &["time.duration_s=0.24"] },
    Case { name: "57 x 9 x 31", scenario: "body", sets: &["time.duration_s=0.24"] },
    Case {
        name: "85 x 13 x 46",
        scenario: "body",
        sets: &[
            "slider.blocks=85",
            "slider.across=13",
            "slider.rows=46",
            "time.step_s=1.25e-7",
            "time.duration_s=0.24",
        ],
    },
];

/// Nodes times steps of single steps in one measurement.
const NODE_STEPS: u64 = 200_000_000;

impl Case {
    /// The plan, with records of switches and events alone.
    fn plan(&self) -> Plan {
        let scenario = resolve(self.scenario, self.sets).unwrap_or_else(|error| panic!("{error}"));
        Plan { recording: RecordingPlan::default(), ..Plan::new(&scenario) }
    }
}

/// A whole run of the fast solver.
struct Run {
    elapsed_s: f64,
    counters: Counters,
    /// Slip events, and steps in which a contact slides.
    events: u64,
    sliding_steps: u64,
    /// Memory of the process at the end of the run, less that at its beginning.
    memory_mb: f64,
}

fn fast(plan: &Plan) -> Run {
    let (mut events, mut sliding_steps, mut onset_step) = (0, 0, None);
    let (mut counters, mut memory_mb) = (Counters::default(), 0.0);
    let before_mb = resident_mb();
    let elapsed_s = seconds(|| {
        let mut solver = SolverKind::Fast.start(plan.clone());
        while let Some(record) = solver.next_record().expect("the run stays finite") {
            let Record::Step(step) = record else { continue };
            match (onset_step, step.sliding) {
                (None, 1..) => onset_step = Some(step.step),
                (Some(onset), 0) => {
                    (events, sliding_steps, onset_step) =
                        (events + 1, sliding_steps + step.step - onset, None);
                }
                _ => {}
            }
        }
        counters = solver.counters();
        memory_mb = resident_mb() - before_mb;
    });
    Run { elapsed_s, counters, events, sliding_steps, memory_mb }
}

/// Nanoseconds of a single step from the state at the start.
fn plain_ns(plan: &Plan) -> f64 {
    first_steps(plan, (NODE_STEPS / plan.elastic.nodes() as u64).min(plan.steps)).0
}

/// Runs beside single steps, which are measured before and after each: of every round, the run and the
/// nanoseconds of a single step.
fn rounds(plan: &Plan, count: usize) -> Vec<(Run, f64)> {
    let mut before_ns = plain_ns(plan);
    let rounds = (0..count).map(|_| {
        let run = fast(plan);
        let after_ns = plain_ns(plan);
        let single_ns = 0.5 * (before_ns + after_ns);
        before_ns = after_ns;
        (run, single_ns)
    });
    rounds.collect()
}

/// The median over the rounds of a number of each.
fn median_of(rounds: &[(Run, f64)], of: impl Fn(&Run, f64) -> f64) -> f64 {
    median(rounds.iter().map(|(run, single_ns)| of(run, *single_ns)).collect())
}

/// Nanoseconds of a single step for each node, beside slabs that are stepped in turn with them.
fn single_steps() {
    println!("## Single steps of sheets and bodies beside those of a slab\n");
    println!("| | a node and step, ns | over the slab |\n|---|---|---|");
    let slab = Case { name: "slab", scenario: "slab", sets: &[] }.plan();
    let ns_of_node = |plan: &Plan| plain_ns(plan) / plan.elastic.nodes() as f64;
    for case in CASES.iter().filter(|case| case.sets.is_empty()) {
        let plan = case.plan();
        let rounds: Vec<[f64; 2]> = (0..ROUNDS).map(|_| [ns_of_node(&plan), ns_of_node(&slab)]).collect();
        let own = median(rounds.iter().map(|[own, _]| *own).collect());
        let over = median(rounds.iter().map(|[own, slab]| own / slab).collect());
        println!("| {} | {own:.1} | {over:.2} |", case.name);
    }
    println!();
}

pub(crate) fn area() {
    single_steps();
    println!("## Sheets and bodies: whole runs beside single steps\n");
    println!(
        "| | steps | switches | jumps | in jumps | a single step, us | time, s | speed-up over single steps | memory, MB |\n|---|---|---|---|---|---|---|---|---|"
    );
    for case in &CASES {
        let plan = case.plan();
        let rounds = rounds(&plan, ROUNDS);
        let counters = rounds[0].0.counters;
        println!(
            "| {} | {} | {} | {} | {:.2} % | {:.2} | {:.2} | {:.0} | {:.0} |",
            case.name,
            plan.steps,
            counters.switches,
            counters.jumps,
            100.0 * counters.jump_steps as f64 / plan.steps as f64,
            median_of(&rounds, |_, single_ns| 1e-3 * single_ns),
            median_of(&rounds, |run, _| run.elapsed_s),
            median_of(&rounds, |run, single_ns| 1e-9 * single_ns * plan.steps as f64 / run.elapsed_s),
            median_of(&rounds, |run, _| run.memory_mb),
        );
    }
    println!("\n## What three dimensions cost: the body with other spacings, over 0.24 s\n");
    println!(
        "| nodes | a single step, us | steps | events | single steps behind an event | modes and jumps, in single steps | speed-up | memory, MB |\n|---|---|---|---|---|---|---|---|"
    );
    for case in &SPACINGS {
        let plan = case.plan();
        let rounds = rounds(&plan, 1);
        let (run, single_ns) = &rounds[0];
        let single = run.counters.plain_steps;
        println!(
            "| {} | {:.1} | {} | {} | {} | {:.0} | {:.0} | {:.0} |",
            case.name,
            1e-3 * single_ns,
            plan.steps,
            run.events,
            (single - run.sliding_steps) / run.counters.jumps.max(1),
            1e9 * run.elapsed_s / single_ns - single as f64,
            1e-9 * single_ns * plan.steps as f64 / run.elapsed_s,
            run.memory_mb,
        );
    }
    println!();
}
