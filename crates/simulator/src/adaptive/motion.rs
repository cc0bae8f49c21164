//! What the loop of the adaptive solver asks of equations of motion and the method that integrates them, and what all
//! of them have: unknowns, the ends of a step, drive and load.

use std::fmt::Debug;

use asperity_model::law::rate_and_state::RateAndState;
use asperity_model::plan::course::Swing;
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use super::Adaptive;
use crate::kernels;

/// Fewest steps in a period of a swing.
const STEPS_OF_A_PERIOD: f64 = 20.0;

/// Equations of motion, with the numbers of the last evaluation.
pub(super) trait Motion: Clone + Debug + Send {
    /// What the law gives for all blocks.
    type Contacts: Clone + Debug + Send;
    /// What integrates them.
    type Method: Method<Self>;

    /// Those of a plan, whose law this is.
    fn of(plan: &Plan, law: RateAndState) -> Self;

    /// What the last evaluation gave.
    fn contacts(&self) -> &Self::Contacts;

    /// The velocity of block `n`.
    fn velocity(contacts: &Self::Contacts, n: usize) -> f64;

    /// Begins a piece of the courses at a grid step.
    fn begin_piece(&mut self, _plan: &Plan, _step: u64) {}

    /// Brings the law to these unknowns, and those of them that follow from the others.
    fn evaluate(&mut self, at: &mut Unknowns, outside: DriveAndLoad);

    /// The rates of the unknowns `at`, which were evaluated last.
    fn rates(&self, at: &Unknowns, outside: DriveAndLoad, rates: &mut Unknowns);

    /// The force on block `n` besides friction, at the last evaluation; in a medium that which friction bears.
    fn tangential_force_n(&self, n: usize) -> f64;

    /// Energies at unknowns that were evaluated last, those of a slider.
    fn energy(&self, at: &Unknowns, slider: &SliderState) -> Energy;

    /// Of block `n`: friction, N, friction over the load, `psi` and `theta`, s.
    fn friction_of(&self, at: &StepEnd<Self>, n: usize) -> [f64; 4];
}

/// A method that integrates equations of motion, with the stages of the last step.
pub(super) trait Method<M: Motion>: Clone + Debug + Send {
    /// For steps with this relative error.
    fn new(motion: &M, plan: &Plan, tolerance: f64) -> Self;

    /// Computes a step of `step_s`; returns its error, over the accepted one.
    fn step(&mut self, motion: &mut M, begin: &StepEnd<M>, step_s: f64) -> f64;

    /// Where the last step ends.
    fn end(&mut self) -> &mut Unknowns;

    /// Evaluates the end of the step that was computed last, for one that begins there.
    fn close(&mut self, motion: &mut M, end: &mut StepEnd<M>, outside: DriveAndLoad) {
        end.at.0.copy_from_slice(&self.end().0);
        end.prepare(motion, outside);
    }

    /// The longest step from there, s.
    fn longest_step_s(motion: &M, begin: &StepEnd<M>) -> f64;

    /// The length to try next, s, after a step of `step_s` for which `planned_s` was to be tried.
    fn next_step_s(planned_s: f64, step_s: f64, error: f64) -> f64;

    /// The value of an unknown, by its place, within the last step, after a share of it.
    fn within(&self, begin: &Unknowns, share: f64, place: usize) -> f64;

    /// `|V|` of block `n` after shares of the step that a solver is in.
    fn speed_within(solver: &Adaptive<M>, n: usize) -> impl Fn(f64) -> f64;
}

/// Factors on the length of a step after one of error 1, and bounds.
const SAFETY: f64 = 0.9;
const LEAST_FACTOR: f64 = 0.1;
const MOST_FACTOR: f64 = 4.0;

/// The factor on the length of a step after which its error is the accepted one, given the root of its error over that
/// by which it grows as the length.
pub(super) fn factor(root: f64) -> f64 {
    let factor = SAFETY / root;
    // NaN, after an overflow, is an error too large for any length.
    if factor.is_nan() { LEAST_FACTOR } else { factor.clamp(LEAST_FACTOR, MOST_FACTOR) }
}

/// Unknowns, or their rates: `w_n = u_n - X` of all blocks, m; what else they have; their states; and the energies up to
/// now, J.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Unknowns(pub(super) Vec<f64>);

impl Unknowns {
    /// `self += sum_j factor_j other_j`, from the lowest term up.
    pub(super) fn add<const N: usize>(&mut self, factors: [f64; N], others: &[Unknowns]) {
        kernels::add_multiples(&mut self.0, &factors, others);
    }
}

impl AsRef<[f64]> for Unknowns {
    fn as_ref(&self) -> &[f64] {
        &self.0
    }
}

/// One end of a step: the unknowns, what the law gives there, and their rates.
#[derive(Debug, Clone)]
pub(super) struct StepEnd<M: Motion> {
    pub(super) at: Unknowns,
    pub(super) contacts: M::Contacts,
    pub(super) rates: Unknowns,
    pub(super) outside: DriveAndLoad,
}

impl<M: Motion> StepEnd<M> {
    /// At these unknowns, not yet evaluated.
    pub(super) fn new(at: Unknowns, motion: &M) -> StepEnd<M> {
        let (rates, contacts) = (at.clone(), motion.contacts().clone());
        StepEnd { at, contacts, rates, outside: DriveAndLoad::default() }
    }

    /// Evaluates the equations at `at`, for a step that begins there.
    pub(super) fn prepare(&mut self, motion: &mut M, outside: DriveAndLoad) {
        self.outside = outside;
        motion.evaluate(&mut self.at, outside);
        motion.rates(&self.at, outside, &mut self.rates);
        self.contacts.clone_from(motion.contacts());
    }
}

/// Drive and load at one time, and their rates in the piece between two knots of their courses.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct DriveAndLoad {
    /// When the piece begins, s.
    pub(super) from_s: f64,
    /// The knot at its end, a grid step; `u64::MAX` for none.
    pub(super) until_step: u64,
    /// `X'`, m/s.
    pub(super) drive_m_per_s: f64,
    /// `X''`, m/s2.
    pub(super) drive_m_per_s2: f64,
    /// Load over that of the start.
    pub(super) load: f64,
    /// Its rate, 1/s.
    pub(super) load_per_s: f64,
    /// Time since the piece of the courses began, s.
    pub(super) since_s: f64,
    /// The swing of the prestress in this piece, if any; its value, over the load of the start, and its rate, 1/s.
    swing: Option<Swing>,
    pub(super) swung: [f64; 2],
}

impl DriveAndLoad {
    /// At the beginning of the piece that begins at a grid step.
    pub(super) fn from_step(plan: &Plan, step: u64) -> DriveAndLoad {
        let outside = plan.outside(step, plan.initial.hold_step);
        let per_s = 1.0 / plan.grid.step_s();
        let begin = DriveAndLoad {
            from_s: plan.grid.time_s(step),
            until_step: outside.until_step(),
            drive_m_per_s: outside.velocity_m_per_s(),
            drive_m_per_s2: outside.acceleration() * per_s,
            load: outside.load().scaled_n(1.0),
            load_per_s: outside.ramp().change_n(1.0) * per_s,
            since_s: 0.0,
            swing: outside.swing(),
            swung: [0.0; 2],
        };
        begin.after(0.0)
    }

    /// The longest step, s: a share of the period of the swing, of which estimates of errors miss whole ones.
    pub(super) fn longest_step_s(self) -> f64 {
        self.swing.map_or(f64::INFINITY, |swing| swing.period_s / STEPS_OF_A_PERIOD)
    }

    /// At a time in the same piece, from its beginning.
    pub(super) fn at(self, time_s: f64) -> DriveAndLoad {
        self.after(time_s - self.from_s)
    }

    /// `seconds` later in the same piece of the courses.
    pub(super) fn after(self, seconds: f64) -> DriveAndLoad {
        DriveAndLoad {
            drive_m_per_s: self.drive_m_per_s + self.drive_m_per_s2 * seconds,
            load: self.load + self.load_per_s * seconds,
            since_s: self.since_s + seconds,
            swung: self.swing.map_or([0.0; 2], |swing| swing.at(self.from_s + (self.since_s + seconds))),
            ..self
        }
    }
}
