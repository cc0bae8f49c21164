//! RODAS4: a linearly implicit method of six stages and order 4 with an embedded one of order 3, L-stable and stiffly
//! accurate (Hairer and Wanner, *Solving Ordinary Differential Equations II*, section IV.7).
//!
//! A step of length `h` solves, with the derivatives `J` at its beginning, for `s = 1, ..., 6`
//!
//! ```text
//! (1 / (h gamma) - J) k_s = f(x + sum_j A_sj k_j) + sum_j C_sj k_j / h,
//! ```
//!
//! ends at the argument of the sixth stage plus `k_6`, and has `k_6` as its estimated error. There is no iteration,
//! so a step has the same cost in all phases, and steps may be as long as the solution is smooth, however fast
//! friction responds: that response decays within the step. Time is one more unknown, with the rate 1.

use asperity_model::{AdaptiveState, Plan};

use super::Adaptive;
use super::equations::Equations;
use super::linear::StageSystem;
use super::motion::{Method, Motion, StepEnd, Unknowns, factor};

const STAGES: usize = 6;

const GAMMA: f64 = 0.25;

/// `A_sj` of the stages 2 to 5; the sixth has those of the fifth, which leaves out the last, of `k_5`.
const A: [[f64; STAGES - 1]; 4] = [
    [1.544, 0.0, 0.0, 0.0, 0.0],
    [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0],
    [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0],
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895, 1.0],
];

/// `C_sj`.
const C: [[f64; STAGES - 1]; STAGES] = [
    [0.0, 0.0, 0.0, 0.0, 0.0],
    [-5.6688, 0.0, 0.0, 0.0, 0.0],
    [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0],
    [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0],
    [7.496_443_313_967_647, -10.246_804_314_643_52, -33.999_903_528_199_05, 11.708_908_932_061_6, 0.0],
    [
        8.083_246_795_921_522,
        -7.981_132_988_064_893,
        -31.521_594_328_743_71,
        16.319_305_431_231_36,
        -6.058_818_238_834_054,
    ],
];

/// Of the continuous extension, of order 3: `x(s) = (1 - s) x(0) + s (x(1) + (1 - s) (sum_j D_2j k_j + s sum_j D_3j k_j))`
/// after the share `s` of a step.
const D: [[f64; STAGES - 1]; 2] = [
    [
        10.126_235_083_445_86,
        -7.487_995_877_610_167,
        -34.800_918_615_557_47,
        -7.992_771_707_568_823,
        1.025_137_723_295_662,
    ],
    [
        -0.676_280_339_280_125_3,
        6.087_714_651_680_015,
        16.430_843_208_924_78,
        24.767_225_114_183_86,
        -6.594_389_125_716_872,
    ],
];

/// Errors that no shorter step makes smaller, over `|w|`.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// The stages of a step.
#[derive(Debug, Clone)]
pub(super) struct Rodas4 {
    linear: StageSystem,
    changes: [Unknowns; STAGES],
    /// The end of the last step.
    end: Unknowns,
    tolerance: f64,
    /// The scales of each block's unknowns.
    scales: Vec<[f64; 3]>,
}

impl Method<Equations> for Rodas4 {
    fn new(equations: &Equations, plan: &Plan, tolerance: f64) -> Rodas4 {
        let end = Unknowns(vec![0.0; AdaptiveState::unknowns(plan)]);
        Rodas4 {
            linear: StageSystem::of(plan.blocks),
            changes: std::array::from_fn(|_| end.clone()),
            end,
            tolerance,
            scales: (0..plan.blocks).map(|n| equations.scales(n)).collect(),
        }
    }

    fn end(&mut self) -> &mut Unknowns {
        &mut self.end
    }

    fn longest_step_s(_: &Equations, begin: &StepEnd<Equations>) -> f64 {
        begin.outside.longest_step_s()
    }

    fn next_step_s(planned_s: f64, step_s: f64, error: f64) -> f64 {
        let next_s = step_s * factor(libm::sqrt(libm::sqrt(error)));
        // A step that was cut short at a knot says little about the next one.
        if error <= 1.0 && step_s < planned_s { next_s.max(planned_s) } else { next_s }
    }

    /// It depends on the stages alone: rates at the ends, where friction responds fast, would multiply its rounding
    /// errors.
    fn within(&self, begin: &Unknowns, share: f64, place: usize) -> f64 {
        let of = |row: &[f64; STAGES - 1]| -> f64 {
            row.iter().zip(&self.changes).map(|(d, change)| d * change.0[place]).sum()
        };
        let (rest, [second, third]) = (1.0 - share, D.each_ref().map(of));
        rest * begin.0[place] + share * (self.end.0[place] + rest * (second + share * third))
    }

    fn step(&mut self, equations: &mut Equations, begin: &StepEnd<Equations>, step_s: f64) -> f64 {
        self.linear.factorise(equations, begin, 1.0 / (step_s * GAMMA));
        // The stages of time, in steps.
        let mut times = [0.0; STAGES];
        for stage in 0..STAGES {
            let (before, rest) = self.changes.split_at_mut(stage);
            let change = &mut rest[0];
            let combined = |row: [f64; 5]| row.iter().zip(&times).map(|(a, time)| a * time).sum::<f64>();
            if stage == 0 {
                change.0.copy_from_slice(&begin.rates.0);
            } else {
                let a_row = A[(stage - 1).min(3)];
                self.end.0.copy_from_slice(&begin.at.0);
                self.end.add(a_row, before);
                let outside = begin.outside.after(combined(a_row) * step_s);
                equations.evaluate(&mut self.end, outside);
                equations.rates(&self.end, outside, change);
            }
            change.add(C[stage].map(|c| c / step_s), before);
            times[stage] = GAMMA * (1.0 + combined(C[stage]));
            self.linear.solve(equations, begin, times[stage] * step_s, change);
        }
        let last = &self.changes[STAGES - 1];
        self.end.add([1.0], &self.changes[STAGES - 1..]);
        let mut error = 0.0_f64;
        let ((last_w, last_y, last_psi, _), (begin_w, ..)) = (last.parts(), begin.at.parts());
        for (n, [behind, friction, state]) in self.scales.iter().enumerate() {
            let of_friction = if equations.mass_kg > 0.0 { last_y[n] / friction } else { 0.0 };
            // No finer than the rounding of `w`, which friction balances.
            let accepted = self.tolerance + ROUNDING * begin_w[n].abs() / behind;
            for part in [last_w[n] / behind, of_friction, last_psi[n] / state] {
                let part = part / accepted;
                // A NaN stays.
                error = if error.is_nan() || part.abs() <= error { error } else { part.abs() };
            }
        }
        error
    }

    fn speed_within(solver: &Adaptive<Equations>, n: usize) -> impl Fn(f64) -> f64 {
        move |share| {
            let unknown = |place| solver.method.within(&solver.begin.at, share, place);
            let outside = solver.piece.at(solver.time_s.value() + share * solver.step_s);
            solver.motion.speed_m_per_s(n, outside, unknown)
        }
    }
}
