//! A line in a medium, by the explicit method of Dormand and Prince (J. Comput. Appl. Math. 6, 19, 1980): order 5 with an
//! embedded one of order 4, whose last stage is the first one of the next step.
//!
//! A linearly implicit method would factor a full matrix. The line is not stiff enough for that: its fastest decay is
//! `max |S| dV/dT + max |V| / D_c`, and steps are bounded by what is stable under it.

use asperity_model::{AdaptiveState, Plan};

use super::Adaptive;
use super::line::Line;
use super::motion::{DriveAndLoad, Method, Motion, StepEnd, Unknowns, factor};
use crate::kernels;

const STAGES: usize = 7;

/// `A_sj` of the stages 2 to 7; the last one is at the end of the step.
const A: [[f64; STAGES - 1]; STAGES - 1] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// The estimated error, over the length of the step.
const ERROR: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Numerators and denominators of the continuous extension of order 4 (Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I*,
/// section II.6).
const DENSE: [[f64; STAGES]; 2] = [
    [-12715105075.0, 0.0, 87487479700.0, -10690763975.0, 701980252875.0, -1453857185.0, 69997945.0],
    [11282082432.0, 1.0, 32700410799.0, 1880347072.0, 199316789632.0, 822651844.0, 29380423.0],
];

/// The step times the fastest decay: stable up to 3.31.
const STABLE: f64 = 3.3;

/// The largest length to try, s.
const LONGEST_S: f64 = 1e30;

/// The stages of a step.
#[derive(Debug, Clone)]
pub(super) struct DormandPrince {
    /// The rates at each.
    rates: [Unknowns; STAGES],
    step_s: f64,
    end: Unknowns,
    error: Unknowns,
    /// One over the accepted errors of `w` and `phi`.
    per_error: Vec<f64>,
}

/// A value after a share of a step, of those at its ends, the changes by the rates there, and the sum with [`DENSE`].
fn extension(share: f64, [begin, end]: [f64; 2], [first, last, sum]: [f64; 3]) -> f64 {
    let (rest, change) = (1.0 - share, end - begin);
    let bend = first - change;
    begin + share * (change + rest * (bend + share * ((change - last - bend) + rest * sum)))
}

impl DormandPrince {
    /// For [`extension`], of a quantity of which the rates at the stages are given.
    fn changes(&self, rate: impl Fn(&[f64]) -> f64) -> [f64; 3] {
        let rates = self.rates.each_ref().map(|rates| rate(&rates.0));
        let sum: f64 = (0..STAGES).map(|stage| DENSE[0][stage] / DENSE[1][stage] * rates[stage]).sum();
        [rates[0], rates[STAGES - 1], sum].map(|rate| self.step_s * rate)
    }
}

impl Method<Line> for DormandPrince {
    fn new(_: &Line, plan: &Plan, tolerance: f64) -> DormandPrince {
        let medium = plan.medium.as_ref().expect("the plan has a medium");
        let zeros = || Unknowns(vec![0.0; AdaptiveState::unknowns(plan)]);
        let of_state = |(a, b): (&f64, &f64)| if b > a { a / b } else { 1.0 };
        let of_states = medium.direct_effect.iter().zip(&medium.evolution_effect).map(of_state);
        let scales = medium.critical_slip_m.iter().copied().chain(of_states);
        DormandPrince {
            rates: std::array::from_fn(|_| zeros()),
            step_s: 0.0,
            end: zeros(),
            error: zeros(),
            per_error: scales.map(|scale| 1.0 / (tolerance * scale)).collect(),
        }
    }

    fn step(&mut self, line: &mut Line, begin: &StepEnd<Line>, step_s: f64) -> f64 {
        self.step_s = step_s;
        self.rates[0].0.copy_from_slice(&begin.rates.0);
        for (stage, weights) in (1..).zip(A) {
            self.end.0.copy_from_slice(&begin.at.0);
            self.end.add(weights.map(|weight| step_s * weight), &self.rates[..stage]);
            line.evaluate(&mut self.end, begin.outside);
            line.rates(&self.end, begin.outside, &mut self.rates[stage]);
        }
        self.error.0.fill(0.0);
        self.error.add(ERROR.map(|weight| step_s * weight), &self.rates);
        let errors =
            self.error.0.iter().zip(&self.per_error).map(|(error, per_error)| (error * per_error).abs());
        // A NaN stays.
        errors.fold(0.0, |most, error| if most.is_nan() || error <= most { most } else { error })
    }

    fn end(&mut self) -> &mut Unknowns {
        &mut self.end
    }

    /// The last stage has evaluated it.
    fn close(&mut self, line: &mut Line, end: &mut StepEnd<Line>, outside: DriveAndLoad) {
        end.at.0.copy_from_slice(&self.end.0);
        end.rates.0.copy_from_slice(&self.rates[STAGES - 1].0);
        end.contacts.clone_from(line.contacts());
        end.outside = outside;
    }

    fn longest_step_s(line: &Line, begin: &StepEnd<Line>) -> f64 {
        STABLE / line.decay_per_s(&begin.contacts)
    }

    /// What the error asks for, although stability may have asked for less.
    fn next_step_s(planned_s: f64, step_s: f64, error: f64) -> f64 {
        let factor = factor(libm::pow(error, 0.2));
        if error <= 1.0 { (factor * planned_s).min(LONGEST_S) } else { factor * step_s }
    }

    fn within(&self, begin: &Unknowns, share: f64, place: usize) -> f64 {
        extension(share, [begin.0[place], self.end.0[place]], self.changes(|rates| rates[place]))
    }

    /// Stress is linear in slip, so its extension has the convolution of the rates, which one node takes as a sum.
    fn speed_within(solver: &Adaptive<Line>, n: usize) -> impl Fn(f64) -> f64 {
        let Adaptive { motion: line, method, begin, end, .. } = solver;
        let stiffness = line.stiffness_pa_per_m(n);
        let (nodes, stresses) = (stiffness.len(), [begin, end].map(|end| end.contacts.stress[n]));
        let changes = method.changes(|rates| kernels::product(&stiffness, &rates[..nodes]));
        move |share| {
            let phi = method.within(&begin.at, share, nodes + n);
            line.speed_m_per_s(n, extension(share, stresses, changes), phi)
        }
    }
}
