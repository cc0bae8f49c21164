//! A line in a medium, by the explicit method of Dormand and Prince (J. Comput. Appl. Math. 6, 19, 1980): order 5 with an
//! embedded one of order 4, whose last stage is the first one of the next step.
//!
//! A linearly implicit method would factor a full matrix. The line is not stiff enough for that: its fastest decay is
//! `max |S| dV/dT + max |V| / D_c`, and steps are bounded by what is stable under it.

use asperity_model::law::rate_and_state::RateAndState;
use asperity_model::plan::adaptive_state::POWERS;
use asperity_model::{AdaptiveState, Plan, SliderState};
use asperity_record::Energy;

use super::line::{Field, Line};
use super::motion::{DriveAndLoad, Motion, StepEnd, Unknowns};
use crate::kernels;

const STAGES: usize = 7;

/// `A_sj` of the stages 2 to 7; the last one is at the end of the step.
const A: [&[f64]; STAGES - 1] = [
    &[1.0 / 5.0],
    &[3.0 / 40.0, 9.0 / 40.0],
    &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
    &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
    &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
    &[35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// The estimated error, over the length of the step.
const ERROR: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

/// Of the continuous extension of order 4 (Hairer, Norsett and Wanner, *Solving Ordinary Differential Equations I*,
/// section II.6).
const DENSE: [f64; STAGES] = [
    -12_715_105_075.0 / 11_282_082_432.0,
    0.0,
    87_487_479_700.0 / 32_700_410_799.0,
    -10_690_763_975.0 / 1_880_347_072.0,
    701_980_252_875.0 / 199_316_789_632.0,
    -1_453_857_185.0 / 822_651_844.0,
    69_997_945.0 / 29_380_423.0,
];

/// The step times the fastest decay: stable up to 3.31.
const STABLE: f64 = 3.3;

/// Factors on the length of a step after one of error 1, bounds, and the largest length to try, s.
const SAFETY: f64 = 0.9;
const LEAST_FACTOR: f64 = 0.1;
const MOST_FACTOR: f64 = 4.0;
const LONGEST_S: f64 = 1e30;

/// A line, and the stages of a step.
#[derive(Debug, Clone)]
pub(super) struct DormandPrince {
    line: Line,
    /// The rates at all stages, one after the other.
    rates: Vec<f64>,
    step_s: f64,
    end: Unknowns,
    /// A sum over the stages.
    sum: Vec<f64>,
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
    fn changes(&self, rate: impl Fn(usize) -> f64) -> [f64; 3] {
        let sum: f64 = DENSE.iter().enumerate().map(|(stage, d)| d * rate(stage)).sum();
        [rate(0), rate(STAGES - 1), sum].map(|rate| self.step_s * rate)
    }

    /// The end of the step after the first stages of a method.
    fn combine(&mut self, begin: &[f64], weights: &[f64]) {
        kernels::combine(&mut self.sum, &self.rates, begin.len(), weights);
        for ((end, begin), sum) in self.end.0.iter_mut().zip(begin).zip(&self.sum) {
            *end = begin + self.step_s * sum;
        }
    }
}

impl Motion for DormandPrince {
    type Contacts = Field;

    fn of(plan: &Plan, law: RateAndState) -> DormandPrince {
        let medium = plan.medium.as_ref().expect("the plan has a medium");
        let unknowns = AdaptiveState::unknowns(plan);
        let of_state = |(a, b): (&f64, &f64)| if b > a { a / b } else { 1.0 };
        let of_states = medium.direct_effect.iter().zip(&medium.evolution_effect).map(of_state);
        let accepted = medium.critical_slip_m.iter().copied().chain(of_states);
        DormandPrince {
            line: Line::of(medium, law),
            rates: vec![0.0; STAGES * unknowns],
            step_s: 0.0,
            end: Unknowns(vec![0.0; unknowns]),
            sum: vec![0.0; unknowns],
            per_error: accepted.map(|scale| 1.0 / (law.tolerance * scale)).collect(),
        }
    }

    fn contacts(&self) -> &Field {
        &self.line.field
    }

    fn velocity(contacts: &Field, n: usize) -> f64 {
        contacts.velocity[n]
    }

    fn evaluate(&mut self, at: &mut Unknowns, _: DriveAndLoad) {
        let (w, phi) = at.0[..self.per_error.len()].split_at(self.per_error.len() / 2);
        self.line.evaluate(w, phi);
    }

    fn rates(&self, at: &Unknowns, outside: DriveAndLoad, rates: &mut Unknowns) {
        let phi = &at.0[self.per_error.len() / 2..self.per_error.len()];
        self.line.rates(phi, outside.drive_m_per_s, &mut rates.0);
    }

    fn step(&mut self, begin: &StepEnd<DormandPrince>, step_s: f64) -> f64 {
        let size = begin.at.0.len();
        self.step_s = step_s;
        self.rates[..size].copy_from_slice(&begin.rates.0);
        for (stage, weights) in (1..).zip(A) {
            self.combine(&begin.at.0, weights);
            let (w, rest) = self.end.0.split_at(self.per_error.len() / 2);
            let phi = &rest[..w.len()];
            self.line.evaluate(w, phi);
            self.line.rates(phi, begin.outside.drive_m_per_s, &mut self.rates[stage * size..][..size]);
        }
        kernels::combine(&mut self.sum, &self.rates, size, &ERROR);
        let errors = self.sum.iter().zip(&self.per_error).map(|(sum, per_error)| (sum * per_error).abs());
        // A NaN stays.
        let larger = |most: f64, error: f64| if most.is_nan() || error <= most { most } else { error };
        step_s * errors.fold(0.0, larger)
    }

    fn end(&mut self) -> &mut Unknowns {
        &mut self.end
    }

    fn close(&mut self, end: &mut StepEnd<DormandPrince>, outside: DriveAndLoad) {
        let size = self.end.0.len();
        end.at.0.copy_from_slice(&self.end.0);
        end.rates.0.copy_from_slice(&self.rates[(STAGES - 1) * size..]);
        end.contacts.clone_from(&self.line.field);
        end.outside = outside;
    }

    fn longest_step_s(&self, begin: &StepEnd<DormandPrince>) -> f64 {
        STABLE / self.line.decay_per_s(&begin.contacts)
    }

    /// What the error asks for, although stability may have asked for less.
    fn next_step_s(planned_s: f64, step_s: f64, error: f64) -> f64 {
        let factor = SAFETY * libm::pow(error, -0.2);
        let factor = if factor.is_nan() { LEAST_FACTOR } else { factor.clamp(LEAST_FACTOR, MOST_FACTOR) };
        if error <= 1.0 { (factor * planned_s).min(LONGEST_S) } else { factor * step_s }
    }

    fn within(&self, begin: &Unknowns, share: f64, place: usize) -> f64 {
        let rate = |stage: usize| self.rates[stage * self.sum.len() + place];
        extension(share, [begin.0[place], self.end.0[place]], self.changes(rate))
    }

    /// Stress is linear in slip, so its extension has the convolution of the rates, which one node takes as a sum.
    fn speed_within(
        &self,
        n: usize,
        [begin, end]: [&StepEnd<DormandPrince>; 2],
        _: impl Fn(f64) -> DriveAndLoad,
    ) -> impl Fn(f64) -> f64 {
        let (stiffness, size) = (self.line.stiffness_pa_per_m(n), self.sum.len());
        let stress_rate =
            |stage: usize| kernels::product(&stiffness, &self.rates[stage * size..][..stiffness.len()]);
        let (changes, place) = (self.changes(stress_rate), stiffness.len() + n);
        let stresses = [begin, end].map(|end| end.contacts.stress[n]);
        move |share| {
            let stress = extension(share, stresses, changes);
            self.line.speed_m_per_s(n, stress, self.within(&begin.at, share, place))
        }
    }

    fn tangential_force_n(&self, n: usize) -> f64 {
        self.line.friction_n(&self.line.field, n)
    }

    fn driving_n(&self, _: &Unknowns) -> f64 {
        (0..self.per_error.len() / 2).map(|n| self.tangential_force_n(n)).sum()
    }

    fn energy(&self, at: &Unknowns, _: &SliderState) -> Energy {
        let (of_nodes, work_j) = at.0.split_last_chunk::<POWERS>().expect("energies come last");
        self.line.energy(&of_nodes[..of_nodes.len() / 2], *work_j)
    }

    fn moment_rate_n_m_per_s(&self, field: &Field) -> f64 {
        self.line.moment_rate_n_m_per_s(field)
    }

    fn friction_of(&self, at: &StepEnd<DormandPrince>, n: usize) -> [f64; 4] {
        self.line.friction_of(&at.contacts, &at.at.0[self.per_error.len() / 2..], n)
    }
}
