//! Fronts with radiation beside their theory, and beside the speeds that an independent program found
//! (`fixtures/reference/fronts`).

use asperity_model::Plan;
use asperity_model::resolve;
use asperity_model::theory::front::Front;
use asperity_simulator::SolverKind;
use asperity_testkit::reference;

use crate::fast_and_plain::{detachments, records};

/// One run: its front, the blocks of the chain, and the time step over `a / c`.
#[derive(Debug, Clone, Copy)]
struct Case {
    front: Front,
    blocks: u32,
    step: f64,
}

impl Case {
    /// A step of at most `most` that moves the front by at most a ten-thousandth of a block.
    fn of(front: Front, blocks: u32, most: f64) -> Case {
        let speed = front.speed_over_c().expect("a front of the table");
        Case { front, blocks, step: f64::min(1e-4 / speed, most) }
    }

    fn plan(&self) -> Plan {
        let Front { prestress: tau, relative_damping, relative_radiation, .. } = self.front;
        let n = f64::from(self.blocks);
        let (k, m) = (2.5e6 * (n - 1.0), 0.012 / n);
        let step_s = self.step * (m / k).sqrt();
        let crossing_s = n / self.front.speed_over_c().expect("a front of the table") * (m / k).sqrt();
        let sets = [
            format!("slider.blocks={}", self.blocks),
            format!("slider.relative_damping={relative_damping}"),
            format!("friction.radiation_kg_per_s={}", relative_radiation * (k * m).sqrt()),
            format!("prestress.ratio={}", 0.45 + 0.25 * tau),
            format!("prestress.first_block_ratio={}", 0.25 * (1.0 - tau) + 1e-9),
            format!("time.step_s={step_s}"),
            format!("time.duration_s={}", (0.99 * crossing_s / step_s).round() * step_s),
        ];
        Plan::new(&resolve("front", &sets).unwrap_or_else(|errors| panic!("{errors}")))
    }

    fn speed(&self, kind: SolverKind) -> Option<f64> {
        front_speed(&self.plan(), kind)
    }
}

/// The speed over `c` of a front between the middle and eleven twelfths of the chain, by a solver.
pub(crate) fn front_speed(plan: &Plan, kind: SolverKind) -> Option<f64> {
    let (first, last) = (plan.blocks as u32 / 2, plan.blocks as u32 * 11 / 12);
    let records = records(kind.start(plan.clone()));
    let passes = |block| Some(detachments(&records).find(|(_, switch)| switch.block == block)?.0.step);
    let took_s = plan.grid.step_s() * (passes(last)? - passes(first)?) as f64;
    Some(f64::from(last - first) * plan.scales.block_time_s / took_s)
}

fn front(alpha: f64, beta: f64, tau: f64) -> Front {
    Front { prestress: tau, relative_damping: beta, relative_radiation: alpha, ..Front::default() }
}

/// The theory is that of the plan, and both solvers find its speed within what the step locks.
fn fronts_run_as_the_theory_says(fronts: [(f64, f64, f64, u32); 3]) {
    for (alpha, beta, tau, blocks) in fronts {
        let case = Case::of(front(alpha, beta, tau), blocks, 1e-3);
        let of_plan = Front::of(&case.plan(), blocks as usize / 2).expect("the theory applies");
        let theory = of_plan.speed_over_c().expect("a front runs");
        assert!((theory / case.front.speed_over_c().unwrap() - 1.0).abs() < 1e-6, "{of_plan:?}");
        let [plain, fast] = [SolverKind::Plain, SolverKind::Fast].map(|kind| case.speed(kind));
        assert_eq!(plain, fast, "{case:?}");
        let off = fast.expect("the front comes so far") / theory - 1.0;
        assert!(off.abs() < 2e-4, "{case:?}: {off}");
    }
}

#[test]
fn fronts_with_radiation_run_as_the_theory_says() {
    fronts_run_as_the_theory_says([(0.05, 0.0, 0.9, 120), (5.0, 0.0, 0.6, 60), (1.0, 1.0, 0.6, 60)]);
}

/// Without dampers the theory is `v / c = 1 / sqrt(1 - tau^2)` (Amundsen et al., Phys. Rev. E 92, 032406 (2015)), and
/// transients are long.
#[test]
fn fronts_without_radiation_run_as_the_theory_says() {
    for tau in [0.3, 0.6, 0.9] {
        let speed = Case::of(front(0.0, 0.0, tau), 600, 1e-3).speed(SolverKind::Fast).unwrap();
        assert!((speed * (1.0 - tau * tau).sqrt() - 1.0).abs() < 5e-4, "tau = {tau}: {speed}");
    }
}

/// Slower ones; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "seconds of single steps: cargo xtask ci"]
    fn more_fronts_with_radiation_run_as_the_theory_says() {
        fronts_run_as_the_theory_says([(1.0, 0.0, 0.6, 120), (0.2, 0.0, 0.3, 120), (5.0, 0.2, 0.5, 60)]);
    }
}

/// All rows of the table whose front runs steadily.
#[test]
#[ignore = "half a minute of single steps: cargo xtask nightly"]
fn all_steady_fronts_of_the_table_run_as_the_theory_says() {
    let mut steady = 0;
    for row in reference("fronts/front-speed-alpha.csv") {
        let cells: Vec<Option<f64>> = row.iter().map(|cell| cell.parse().ok()).collect();
        let [Some(alpha), Some(tau), Some(_), Some(_), ..] = cells[..] else { continue };
        // Transients are longest where little is lost.
        let blocks = match (alpha < 0.15 && tau < 0.35, tau < 0.15) {
            _ if tau < 0.075 => 600,
            (true, _) => 600,
            (false, true) => 240,
            (false, false) => 120,
        };
        let most = if alpha > 0.5 && tau < 0.075 { 3e-3 } else { 1e-3 };
        let case = Case::of(front(alpha, 0.0, tau), blocks, most);
        let speed = case.speed(SolverKind::Fast).expect("the front comes so far");
        let off = speed / case.front.speed_over_c().expect("a front of the table") - 1.0;
        assert!(off.abs() < 2e-4, "{alpha} {tau}: {off}");
        steady += 1;
    }
    assert_eq!(steady, 94);
}
