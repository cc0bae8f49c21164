//! Jumps: most of a stick phase at once, by any body.
//!
//! While every contact sticks, all forces are linear and the map of a step stays the same. The solution
//! has two parts. The forced part follows drive and load and advances by the same displacement in every
//! step,
//!
//! ```text
//! u_q(s + i) = a + i b,  v_q = b / dt,  M b = g,  M a = G(s + 1) - C v_q,
//! ```
//!
//! with `M` and `C` the stiffness and damping of the stuck slider, its friction springs and drive
//! included, `G` the outer forces and `g` their change in a step. The rest, `r = y - y_q`, obeys the map
//! without outer forces: it is a sum of modes, each multiplied by the same number in every step.
//!
//! **Certificate.** Forces of the forced part are linear in time ([`crate::leap::clearance`]). The modes do not
//! grow; so those of the rest are at most the sum of their sizes now. A jump ends before both together,
//! with a reserve for rounding ([`crate::leap::norms`]) and one for the residue that the modes do not span, reach
//! a threshold.
//!
//! How long a jump may be: [`certificate`]. The bodies differ in how they find the forced part and the modes:
//! [`chain`], [`lattice`].

mod certificate;
pub(crate) mod chain;
pub(crate) mod lattice;

use asperity_model::{Plan, SliderState};

use crate::leap::clearance::Clearance;
use crate::step::strength::{Ramp, StopForce};

/// The forced part of a jump.
#[derive(Debug, Clone)]
pub(crate) struct Forced {
    /// `a` and `b` of each freedom.
    position_m: Vec<f64>,
    advance_m: Vec<f64>,
    /// Number of nodes: freedoms lie axis by axis, one for each node.
    nodes: usize,
    /// The step of the state where the jump begins.
    from_step: u64,
    /// Whether the drive moves after the first step, how far in each, and the step in which it stops.
    moves: bool,
    point_m: f64,
    hold_step: u64,
    /// The load of the next step, and its rate.
    ramp: Ramp,
}

impl Forced {
    fn of_nodes(nodes: usize, axes: usize) -> Forced {
        Forced {
            position_m: vec![0.0; axes * nodes],
            advance_m: vec![0.0; axes * nodes],
            nodes,
            from_step: 0,
            moves: true,
            point_m: 0.0,
            hold_step: u64::MAX,
            ramp: Ramp::FLAT,
        }
    }

    /// Begins at a state. The body finds `a` and `b`.
    fn begin(&mut self, plan: &Plan, state: &SliderState) {
        self.from_step = state.step;
        let outside = plan.outside(state.step + 1, state.hold_step);
        self.moves = state.hold_step > state.step + 1;
        self.point_m = outside.advance_m();
        self.hold_step = state.hold_step;
        self.ramp = outside.ramp();
    }

    /// The force of a contact's friction spring `into` steps after the first, and its change in a step, along
    /// its tangential freedoms.
    #[inline]
    fn friction_n<const D: usize>(
        &self,
        plan: &Plan,
        state: &SliderState,
        contact: usize,
        into: f64,
    ) -> ([f64; D], [f64; D]) {
        let kt = plan.friction.springs_n_per_m[contact];
        let (mut force, mut rate) = ([0.0; D], [0.0; D]);
        for axis in 0..D {
            let (freedom, place) = (axis * self.nodes + contact, axis * plan.blocks + contact);
            rate[axis] = kt * self.advance_m[freedom];
            let stretch_m = self.position_m[freedom] - state.stick_position_m[place];
            force[axis] = kt * stretch_m + into * rate[axis];
        }
        (force, rate)
    }

    /// The sum of the driving forces `into` steps after the first, and its change in a step.
    fn drive_n(&self, plan: &Plan, into: f64) -> (f64, f64) {
        let point_m = plan.outside(self.from_step + 1, self.hold_step).point_m;
        let rate = self.drive_rate_n(plan);
        (plan.drive.total_force_n(point_m, &self.position_m) + into * rate, rate)
    }

    /// The change in a step of the sum of the driving forces.
    fn drive_rate_n(&self, plan: &Plan) -> f64 {
        let advance_m = self.point_m;
        let springs = plan.drive.springs.iter();
        let rates = springs.map(|spring| {
            spring.stiffness_n_per_m * (spring.direction * advance_m - self.advance_m[spring.block])
        });
        rates.sum()
    }

    /// Adds the driving force to a clearance counted from `into` steps after the first, if a load stops the
    /// drive; false if that load is reached there. `swing` is the largest contribution of the modes, with a
    /// reserve.
    fn stays_below_stop(&self, plan: &Plan, into: f64, swing: [f64; 2], clearance: &mut Clearance) -> bool {
        let Some(stop) = StopForce::of(plan, self.hold_step) else { return true };
        let load = (self.ramp.ahead(into), self.ramp);
        clearance.stays_below_stop(stop, load, self.drive_n(plan, into), swing)
    }

    /// Writes the displacements `into` steps after the first, with those of the modes, and the step.
    fn write(&self, into: u64, modes_m: &[f64], state: &mut SliderState) {
        for (n, u) in state.displacement_m.iter_mut().enumerate() {
            *u = self.position_m[n] + (into as f64 * self.advance_m[n] + modes_m[n]);
        }
        state.step = self.from_step + into;
        state.sliding = 0;
    }
}
