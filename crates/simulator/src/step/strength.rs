//! The strength of contacts: the force at which a stuck one detaches, and the friction of a sliding one.
//!
//! In a chain, where every node carries one contact, both are proportional to the normal load of the
//! step, and so is the driving force that stops a drive; a static threshold may also grow while its
//! contact sticks. In a slab, the normal load of a contact follows from its state.

use asperity_model::law;
use asperity_model::plan::Ageing;
use asperity_model::plan::load::{Load, Ramp};
use asperity_model::{Plan, SliderState};

use crate::kernels::Strengths;

/// The sum of the driving forces at which the drive point stops, proportional to the load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StopForce {
    ratio: f64,
    normal_load_n: f64,
}

impl StopForce {
    /// `None` where no force stops the drive, or it has stopped.
    #[inline]
    pub(crate) fn of(plan: &Plan, hold_step: u64) -> Option<StopForce> {
        let ratio = plan.drive.until_load_ratio.filter(|_| hold_step == u64::MAX)?;
        Some(StopForce { ratio, normal_load_n: plan.total_normal_load_n })
    }

    /// Its value under a load.
    #[inline]
    pub(crate) fn under_n(self, load: Load) -> f64 {
        self.ratio * load.scaled_n(self.normal_load_n)
    }

    /// Its change per step.
    pub(crate) fn change_n(self, ramp: Ramp) -> f64 {
        self.ratio * ramp.change_n(self.normal_load_n)
    }
}

/// Thresholds and sliding friction of all contacts in one step.
#[derive(Debug, Clone)]
pub(crate) struct Strength {
    /// Lower bounds on the thresholds.
    pub(crate) threshold_n: Vec<f64>,
    pub(crate) sliding_friction_n: Vec<f64>,
    /// The load to which both apply.
    pub(crate) load: Load,
    load_changes: bool,
    age: bool,
}

impl Strength {
    /// At the load of the start.
    pub(crate) fn new(plan: &Plan) -> Strength {
        Strength {
            threshold_n: plan.friction.static_threshold_n.clone(),
            sliding_friction_n: plan.friction.dynamic_friction_n.clone(),
            load: Load::OF_START,
            load_changes: !plan.load_course.is_constant(),
            age: plan.friction.ageing.is_some(),
        }
    }

    /// Whether load or age change them.
    #[inline]
    pub(crate) fn changes(&self) -> bool {
        self.load_changes || self.age
    }

    /// Those of all contacts in a step. Where contacts weaken by slip, the load of the start and its factor: friction is
    /// computed at the start, and multiplied once.
    #[inline]
    pub(crate) fn of_contacts<'a>(&'a self, plan: &'a Plan, memory: &'a [f64]) -> Strengths<'a> {
        let friction = &plan.friction;
        let weakening_slip = friction.weakening_slip_m.as_slice();
        if friction.weakens() && plan.has_given_loads() {
            let (threshold, sliding_friction) = (&friction.static_threshold_n, &friction.dynamic_friction_n);
            return Strengths {
                threshold,
                sliding_friction,
                load: self.load.factor(),
                weakening_slip,
                memory,
            };
        }
        let (threshold, sliding_friction) = (&self.threshold_n, &self.sliding_friction_n);
        Strengths { threshold, sliding_friction, load: 1.0, weakening_slip, memory }
    }

    /// Updates them to the normal loads of all contacts.
    pub(crate) fn update(&mut self, plan: &Plan, normal_load_n: &[f64]) {
        for (n, p) in normal_load_n.iter().enumerate() {
            self.threshold_n[n] = plan.friction.static_coefficients[n] * p;
            self.sliding_friction_n[n] = plan.friction.dynamic_coefficients[n] * p;
        }
    }

    /// Updates them to the load of a step.
    pub(crate) fn follow(&mut self, plan: &Plan, state: &SliderState, load: Load) {
        if load == self.load && !self.age {
            return;
        }
        self.load = load;
        let scale = |to: &mut [f64], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = load.scaled_n(*from);
            }
        };
        scale(&mut self.threshold_n, least_threshold_n(plan, state));
        scale(&mut self.sliding_friction_n, &plan.friction.dynamic_friction_n);
    }
}

/// Lower bounds on the thresholds of stuck contacts, at the load of the start.
pub(crate) fn least_threshold_n<'a>(plan: &'a Plan, state: &'a SliderState) -> &'a [f64] {
    if state.aged_threshold_n.is_empty() {
        &plan.friction.static_threshold_n
    } else {
        &state.aged_threshold_n
    }
}

/// `mu_s + b ln(1 + t_w / t_0)` of contact `n` of a slab in the step that led to a state.
pub(crate) fn static_coefficient(plan: &Plan, state: &SliderState, n: usize) -> f64 {
    let since_step = state.stuck_since_step.get(n).copied();
    aged(plan, plan.friction.static_coefficients[n], |ageing| ageing.coefficient, since_step, state.step)
}

/// A strength that grows from its value for a contact that has just begun to stick.
fn aged(plan: &Plan, young: f64, growth: impl Fn(&Ageing) -> f64, since_step: Option<u64>, step: u64) -> f64 {
    let Some((ageing, since_step)) = plan.friction.ageing.as_ref().zip(since_step) else { return young };
    let waited_s = (step - since_step) as f64 * plan.grid.step_s();
    young + growth(ageing) * libm::log1p(waited_s / ageing.time_s)
}

/// The static threshold of contact `n` (counted from 0) in the step that led to a state; for a contact
/// that has detached since, the one that it had reached.
pub fn threshold_n(plan: &Plan, state: &SliderState, n: usize) -> f64 {
    let friction = &plan.friction;
    let (mut static_n, mut friction_n, mut load) = match state.normal_load_n.get(n) {
        Some(normal_load_n) => {
            let friction_n = friction.dynamic_coefficients[n] * normal_load_n;
            (static_coefficient(plan, state, n) * normal_load_n, friction_n, 1.0)
        }
        None => {
            let aged_n = aged_threshold_n(plan, n, &state.stuck_since_step, state.step);
            (
                aged_n,
                friction.dynamic_friction_n[n],
                plan.outside(state.step, state.hold_step).load().factor(),
            )
        }
    };
    let weakening_slip_m = friction.weakening_slip_m.get(n).copied().unwrap_or(0.0);
    if !friction.weakens() {
        (static_n, friction_n, load) = (load * static_n, load * friction_n, 1.0);
    }
    let count = friction.law.memory();
    let memory = &state.memory[n * count..][..count];
    friction.law.strength_n(&law::Strength { static_n, friction_n, load, weakening_slip_m, memory })
}

/// Raises the lower bounds on thresholds to their values at the next step: while contacts stick,
/// thresholds only grow.
pub(crate) fn age(plan: &Plan, state: &mut SliderState) {
    for n in 0..state.aged_threshold_n.len() {
        state.aged_threshold_n[n] = aged_threshold_n(plan, n, &state.stuck_since_step, state.step + 1);
    }
}

/// The static threshold of contact `n` in the step that led to a state. In a chain that ages it becomes
/// the contact's lower bound. `None` if contacts do not age.
pub(crate) fn aged_up_to_now_n(plan: &Plan, state: &mut SliderState, n: usize) -> Option<f64> {
    state.stuck_since_step.get(n)?;
    if !state.aged_threshold_n.is_empty() {
        state.aged_threshold_n[n] = aged_threshold_n(plan, n, &state.stuck_since_step, state.step);
    }
    Some(threshold_n(plan, state, n))
}

/// Resets the age of contact `n`, which has just begun to stick.
pub(crate) fn reset_age(plan: &Plan, state: &mut SliderState, n: usize) {
    if let Some(since_step) = state.stuck_since_step.get_mut(n) {
        *since_step = state.step;
    }
    if let Some(threshold_n) = state.aged_threshold_n.get_mut(n) {
        *threshold_n = plan.friction.static_threshold_n[n];
    }
}

/// `(mu_s + b ln(1 + t_w / t_0)) p_n` at the load of the start.
pub(crate) fn aged_threshold_n(plan: &Plan, n: usize, stuck_since_step: &[u64], step: u64) -> f64 {
    let since_step = stuck_since_step.get(n).copied();
    aged(plan, plan.friction.static_threshold_n[n], |ageing| ageing.growth_n[n], since_step, step)
}
