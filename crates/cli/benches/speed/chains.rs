//! Long chains: the cost of a block switch in them, and the reach of the study of resolution.

use asperity_model::Plan;
use asperity_simulator::SolverKind;

use crate::{fast_s, median, plain_ns, plan, seconds};

/// How many times the fast solver makes each run; the median counts.
const ROUNDS: usize = 3;

/// Blocks, and seconds in which the first of them have slipped a few hundred times.
const CHAINS: [(usize, f64); 5] = [(100, 0.5), (300, 0.15), (1_000, 0.06), (3_000, 0.03), (10_000, 0.01)];

/// Time steps, as shares of the longest stable one; 0 means that of the thesis.
const SHARES: [f64; 4] = [0.5, 0.1, 0.01, 0.0];

const THESIS_STEP_S: f64 = 1e-8;

/// The study continues where `pipelines/resolution.toml` ends, with the decay length of its runs
/// `length-25` to `length-800`, up to the first global slip.
const RESOLUTION_BLOCKS: [usize; 3] = [800, 1_600, 3_200];
const RESOLUTION_SET: [&str; 2] = ["slider.mass_kg=12", "slider.relative_damping=3.1622776601683795"];
const RESOLUTION_S: f64 = 2.8;

/// The cost of a switch against the number of blocks.
pub(crate) fn switches() {
    println!("## What a switch costs, against the number of blocks\n");
    println!(
        "The slider of the thesis in N blocks while the first of them slip. `dt` is a share of the longest stable step. \
         The cost of a switch is without that of setting the solver up, the speed-up with it.\n"
    );
    println!(
        "| parameter set | dt | N | time step, s | switches | steps per switch | setting up, ms | \
         cost of a switch, us | the same in steps of the plain solver | speed-up over the plain solver |\n\
         |---|---|---|---|---|---|---|---|---|---|"
    );
    for set in ["as-coded", "as-stated"] {
        for share in SHARES {
            for (blocks, duration_s) in CHAINS {
                let set = [format!("parameter_set={set}"), format!("slider.blocks={blocks}")];
                let longest_s = longest_step_s(&set);
                let step_s = if share > 0.0 { share * longest_s } else { THESIS_STEP_S };
                if step_s > 0.6 * longest_s {
                    continue;
                }
                let plan = with_step(&set, step_s, duration_s);
                let runs: Vec<_> = (0..ROUNDS).map(|_| (fast_s(&plan), setting_up_s(&plan))).collect();
                let switches = runs[0].0.1.switches.max(1) as f64;
                let elapsed_s = median(runs.iter().map(|((elapsed_s, _), _)| *elapsed_s).collect());
                let set_up_s = median(runs.iter().map(|(_, set_up_s)| *set_up_s).collect());
                let rest_s = elapsed_s - set_up_s;
                let plain_s = plain_ns(&plan) * 1e-9;
                let steps = plan.steps as f64;
                let share = if share > 0.0 { format!("{share}") } else { "thesis".to_owned() };
                println!(
                    "| {} | {share} | {blocks} | {:.3e} | {switches} | {:.0} | {:.1} | {:.1} | {:.0} | {:.0} |",
                    &set[0]["parameter_set=".len()..],
                    plan.grid.step_s(),
                    steps / switches,
                    set_up_s * 1e3,
                    rest_s * 1e6 / switches,
                    rest_s / plain_s / switches,
                    plain_s * steps / elapsed_s,
                );
            }
        }
    }
    println!();
}

/// The study of resolution, with more blocks than anybody would wait for in every round of tables.
pub(crate) fn resolution() {
    println!("## More blocks for one decay length\n");
    println!(
        "`pipelines/resolution.toml` with more blocks, at half the longest stable step, {RESOLUTION_S} s simulated.\n"
    );
    println!(
        "| N | time step, s | steps | switches | duration, s | speed-up over the plain solver |\n|---|---|---|---|---|---|"
    );
    for blocks in RESOLUTION_BLOCKS {
        let ratio = (99.0 / (blocks as f64 - 1.0)).powi(2);
        let own =
            [format!("slider.blocks={blocks}"), format!("friction.interfacial_stiffness_ratio={ratio}")];
        let set = [&RESOLUTION_SET.map(str::to_owned)[..], &own].concat();
        let plan = with_step(&set, 0.5 * longest_step_s(&set), RESOLUTION_S);
        let (elapsed_s, counters) = fast_s(&plan);
        let plain_s = plain_ns(&plan) * 1e-9 * plan.steps as f64;
        println!(
            "| {blocks} | {:.3e} | {:.2e} | {} | {elapsed_s:.1} | {:.1} |",
            plan.grid.step_s(),
            plan.steps as f64,
            counters.switches,
            plain_s / elapsed_s,
        );
    }
    println!();
}

fn setting_up_s(plan: &Plan) -> f64 {
    seconds(|| drop(std::hint::black_box(SolverKind::Fast.start(plan.clone()))))
}

fn longest_step_s(set: &[String]) -> f64 {
    let plan = recording_nothing(set, &["time.step_s=1e-10".to_owned()]);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    plan.elastic.longest_stable_step_s(plan.block_mass_kg, kt, plan.drive.stiffest_n_per_m(), 0.0)
}

/// A plan with about this time step, simulated for about so long.
fn with_step(set: &[String], step_s: f64, duration_s: f64) -> Plan {
    // In units that make both whole numbers.
    let unit_s = 10f64.powf(step_s.log10().floor() - 3.0);
    let units = (step_s / unit_s).round() as u128;
    let steps = (duration_s / (units as f64 * unit_s)).round() as u128;
    let exponent = unit_s.log10().round();
    let own =
        [format!("time.step_s={units}e{exponent}"), format!("time.duration_s={}e{exponent}", units * steps)];
    recording_nothing(set, &own)
}

fn recording_nothing(set: &[String], own: &[String]) -> Plan {
    let nothing = ["recording.sample_s=0", "recording.fields_s=0", "recording.event_fields=false"];
    let all = [set, own, &nothing.map(str::to_owned)].concat();
    plan(&all.iter().map(String::as_str).collect::<Vec<_>>())
}
