//! What contacts bear: how hard each may be pulled before it detaches, and how much it resists
//! while it slides.
//!
//! Nodes move, contacts rub; in a chain every node carries one contact, of the same number.
//! Whatever a contact bears is in proportion to the normal load of the step, and so is the
//! driving force that stops a drive; a static threshold may also grow while its contact sticks.

use asperity_model::Plan;

use crate::state::ChainState;

/// The normal load of a step over that of the start, and how it goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Load {
    factor: f64,
    /// By how much the factor changes in every step.
    rate: f64,
}

impl Load {
    const OF_START: Load = Load { factor: 1.0, rate: 0.0 };

    /// The load of a step, if the drive stopped in `hold_step`.
    pub(crate) fn in_step(plan: &Plan, step: u64, hold_step: u64) -> Load {
        Load { factor: plan.load_factor(step, hold_step), rate: plan.load_course.rate(step, hold_step) }
    }

    /// What a force is in this step that is `at_start_n` under the load of the start.
    #[inline]
    pub(crate) fn scaled_n(self, at_start_n: f64) -> f64 {
        self.factor * at_start_n
    }

    /// By how much that changes in every step.
    #[inline]
    pub(crate) fn change_n(self, at_start_n: f64) -> f64 {
        self.rate * at_start_n
    }

    /// Whether it changes.
    pub(crate) fn changes(self) -> bool {
        self.rate != 0.0
    }

    /// What it is `steps` steps later, over what it is now.
    pub(crate) fn decline(self, steps: f64) -> f64 {
        if self.rate == 0.0 { 1.0 } else { (self.factor + self.rate * steps) / self.factor }
    }

    /// The share of itself by which it falls in every step.
    pub(crate) fn fall(self) -> f64 {
        -self.rate / self.factor
    }
}

/// The sum of the driving forces at which the drive point stops.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct StopForce {
    pub(crate) force_n: f64,
    /// By how much it changes in every step.
    pub(crate) change_n: f64,
}

impl StopForce {
    /// Under the load of a step; `None` where no force stops the drive, or it has stopped.
    pub(crate) fn of(plan: &Plan, load: Load, hold_step: u64) -> Option<StopForce> {
        let ratio = plan.drive.until_load_ratio.filter(|_| hold_step == u64::MAX)?;
        Some(StopForce {
            force_n: ratio * load.scaled_n(plan.total_normal_load_n),
            change_n: ratio * load.change_n(plan.total_normal_load_n),
        })
    }
}

/// Thresholds and sliding friction of all contacts in one step.
#[derive(Debug, Clone)]
pub(crate) struct Contacts {
    /// What no threshold is below.
    pub(crate) threshold_n: Vec<f64>,
    pub(crate) sliding_friction_n: Vec<f64>,
    /// What both are for.
    pub(crate) load: Load,
    load_changes: bool,
    age: bool,
}

impl Contacts {
    /// At the load of the start.
    pub(crate) fn new(plan: &Plan) -> Contacts {
        Contacts {
            threshold_n: plan.friction.static_threshold_n.clone(),
            sliding_friction_n: plan.friction.dynamic_friction_n.clone(),
            load: Load::OF_START,
            load_changes: !plan.load_course.is_constant(),
            age: plan.friction.ageing.is_some(),
        }
    }

    /// Brings them to a step.
    #[inline]
    pub(crate) fn follow(&mut self, plan: &Plan, state: &ChainState, step: u64) {
        if self.load_changes || self.age {
            self.bring_to(plan, state, step);
        }
    }

    fn bring_to(&mut self, plan: &Plan, state: &ChainState, step: u64) {
        let load = Load::in_step(plan, step, state.hold_step);
        let same = load.factor == self.load.factor && !self.age;
        self.load = load;
        if same {
            return;
        }
        let scale = |to: &mut [f64], from: &[f64]| {
            for (to, from) in to.iter_mut().zip(from) {
                *to = load.scaled_n(*from);
            }
        };
        scale(&mut self.threshold_n, least_threshold_n(plan, state));
        scale(&mut self.sliding_friction_n, &plan.friction.dynamic_friction_n);
    }

    /// The share of themselves by which they fall from the step that they are for to another.
    pub(crate) fn decline_to(&self, plan: &Plan, step: u64, hold_step: u64) -> f64 {
        if !(self.load_changes || self.age) {
            return 0.0;
        }
        1.0 - plan.load_factor(step, hold_step) / self.load.factor
    }
}

/// What no threshold of a stuck contact is below, at the load of the start.
pub(crate) fn least_threshold_n<'a>(plan: &'a Plan, state: &'a ChainState) -> &'a [f64] {
    if plan.friction.ageing.is_some() { &state.aged_threshold_n } else { &plan.friction.static_threshold_n }
}

/// The static threshold of contact `n` (counted from 0) in the step that led to a state, of a
/// contact that has detached since that which it had reached.
pub(crate) fn threshold_n(plan: &Plan, state: &ChainState, n: usize) -> f64 {
    let aged_n = aged_threshold_n(plan, n, &state.stuck_since_step, state.step);
    Load::in_step(plan, state.step, state.hold_step).scaled_n(aged_n)
}

/// Brings the thresholds that are known up to the step that comes next: none can be below in
/// what follows.
pub(crate) fn age(plan: &Plan, state: &mut ChainState) {
    for n in 0..state.aged_threshold_n.len() {
        state.aged_threshold_n[n] = aged_threshold_n(plan, n, &state.stuck_since_step, state.step + 1);
    }
}

/// `(mu_s + b ln(1 + t_w / t_0)) p_n` at the load of the start.
pub(crate) fn aged_threshold_n(plan: &Plan, n: usize, stuck_since_step: &[u64], step: u64) -> f64 {
    let young = plan.friction.static_threshold_n[n];
    match &plan.friction.ageing {
        None => young,
        Some(ageing) => {
            let waited_s = (step - stuck_since_step[n]) as f64 * plan.grid.step_s();
            young + ageing.growth_n[n] * libm::log1p(waited_s / ageing.time_s)
        }
    }
}
