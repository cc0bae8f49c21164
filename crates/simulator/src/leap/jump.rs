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
//! How long a jump may be: [`certificate`]. [`Jump`] is that of any body; what differs, the stiffness and the modes of
//! the stuck body, is [`Stuck`]: of a [`chain`], of a [`lattice`].

mod certificate;
pub(crate) mod chain;
pub(crate) mod lattice;

use std::fmt::Debug;

use asperity_model::plan::load::Ramp;
use asperity_model::plan::outside::Outside;
use asperity_model::{Plan, SliderState};

use crate::energy::Accounts;
use crate::kernels;
use crate::leap::clearance::Clearance;
use crate::leap::jump::certificate::Certificate;
use crate::leap::norms::Norms;
use crate::modes::slow_modes::top_loads;
use crate::records::stop::Stop;
use crate::step::strength::StopForce;

/// Steps after which a jump is tried again where the stiffness cannot be solved with, or the modes cannot be found.
const WITHOUT_MODES_STEPS: u64 = 1 << 40;

/// Largest truncation of displacements in samples, relative to the largest one: a rounding error or two.
const NEGLIGIBLE: f64 = 4e-16;

/// A stuck body whose contacts have `D` tangential freedoms: its stiffness, and the modes of its free motion. A motion
/// is its displacements, then its velocities.
pub(crate) trait Stuck<const D: usize>: Debug + Send {
    /// Turns forces into the displacements `x` with `M x = force`; `false` if the stiffness is not positive by its
    /// numbers, or the stop comes.
    fn solve(&self, force: &mut [f64], stop: &Stop<'_>) -> bool;

    /// Finds the coordinates of a motion, and what the certificate looks at: how much they may add, or the modes.
    /// Returns the norm of what they may miss over the jump, or the number of steps after which the next attempt is due.
    fn project(&mut self, attempt: &mut Attempt<'_, D>) -> Result<f64, u64>;

    /// Writes the motion after `into` steps, without modes of at most the size `least` that can be left out.
    fn compose(&mut self, into: u64, least: f64, motion: &mut [f64]);

    /// Notes the energies of the state where the jump begins.
    fn begin_energies(&mut self, _plan: &Plan, _forced: &Forced, _motion: &[f64], _state: &SliderState) {}

    /// Adds to the energies of a state what the work of drive and load, which is given, leaves to the body; the motion
    /// is that of the start of the jump and that of the state.
    fn add_energies(
        &self,
        _plan: &Plan,
        _forced: &Forced,
        _motion: [&[f64]; 2],
        _work_j: f64,
        _state: &mut SliderState,
    ) {
    }
}

/// An attempt to jump from a state that the forced part allows.
pub(crate) struct Attempt<'a, const D: usize> {
    pub(crate) certificate: Certificate<'a, D>,
    pub(crate) norms: Norms,
    /// The free motion.
    pub(crate) motion: &'a [f64],
    /// The largest displacement and the largest velocity.
    pub(crate) scales: [f64; 2],
    /// The most steps that the jump may take.
    pub(crate) most_steps: u64,
    /// What the attempt has cost.
    pub(crate) cost_steps: u64,
    pub(crate) stop: &'a Stop<'a>,
}

/// When jumps are worth it, and what they cost, in single steps.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Limits {
    /// Below this many steps a jump is not worth it.
    pub(crate) shortest_steps: u64,
    /// Steps after which it may be worth trying again where a jump was refused.
    pub(crate) refused_steps: u64,
    /// Cost of the forced part.
    pub(crate) forced_steps: u64,
    /// Cost of composing a state.
    pub(crate) composed_steps: u64,
    /// Whether solving with the stiffness takes no more than a few sweeps over the body.
    pub(crate) solves_in_sweeps: bool,
}

/// The jumps of a body, and the one that is open.
#[derive(Debug)]
pub(crate) struct Jump<const D: usize> {
    stuck: Box<dyn Stuck<D>>,
    limits: Limits,
    norms: Norms,
    forced: Forced,
    /// The free motion at the start, and the one that was last composed.
    start: Vec<f64>,
    composed: Vec<f64>,
    /// Cost of the last attempt, and of landing if a jump is open.
    pub(crate) cost_steps: u64,
}

impl<const D: usize> Jump<D> {
    pub(crate) fn of(plan: &Plan, stuck: Box<dyn Stuck<D>>, limits: Limits) -> Jump<D> {
        let motion = vec![0.0; 2 * plan.elastic.freedoms()];
        Jump {
            stuck,
            limits,
            norms: Norms::of(plan),
            forced: Forced::of(plan),
            start: motion.clone(),
            composed: motion,
            cost_steps: 0,
        }
    }

    /// Splits a state in which every contact sticks, and returns the largest number of steps over which none switches
    /// by the certificate; if those are not worth it, the number after which the next attempt is due. Without meaning
    /// once the stop has come.
    pub(crate) fn open(
        &mut self,
        plan: &Plan,
        state: &SliderState,
        most_steps: u64,
        stop: &Stop<'_>,
    ) -> Result<u64, u64> {
        let Jump { stuck, limits, norms, forced, start, .. } = self;
        let refused = Err(limits.refused_steps);
        let are_lifted = plan.elastic.first_normal().is_some_and(|normal| {
            state.displacement_m[normal..][..plan.blocks].iter().any(|rise_m| *rise_m >= 0.0)
        });
        self.cost_steps = limits.forced_steps;
        if most_steps < limits.shortest_steps || are_lifted {
            return refused;
        }
        if !forced.begin(plan, state, &**stuck, stop) {
            return Err(WITHOUT_MODES_STEPS);
        }
        let certificate = Certificate::of(plan, state, forced);
        // If the forced part alone rules out the jump, the modes need not be looked at.
        if certificate.at_once() < limits.shortest_steps {
            return refused;
        }
        forced.take_from(state, start);
        let scales = [&state.displacement_m, &state.velocity_m_per_s].map(|of| kernels::largest(of));
        let cost_steps = limits.forced_steps;
        let mut attempt =
            Attempt { certificate, norms: *norms, motion: start, scales, most_steps, cost_steps, stop };
        let missed = stuck.project(&mut attempt);
        let Attempt { mut certificate, most_steps, cost_steps, .. } = attempt;
        self.cost_steps = cost_steps;
        let missed = missed?;
        // Displacements grow on the way.
        let way_m = kernels::largest(&forced.advance_m) * most_steps as f64;
        let reach_m = scales[0].max(kernels::largest(&forced.position_m)) + way_m;
        let rounding_n = norms.force_rounding(reach_m, scales[1]);
        certificate.reserves = [
            norms.force * missed + rounding_n * (D as f64).sqrt(),
            norms.load * missed + rounding_n,
            norms.drive * missed + rounding_n * forced.nodes as f64,
        ];
        let steps = certificate.longest(most_steps);
        if steps < limits.shortest_steps {
            return refused;
        }
        self.cost_steps += limits.composed_steps;
        stuck.begin_energies(plan, forced, start, state);
        Ok(steps)
    }

    /// Brings a state from the start of the jump to `into` steps after it, with the energies of these steps.
    pub(crate) fn land(&mut self, plan: &Plan, into: u64, state: &mut SliderState) {
        self.advance(plan, into, f64::NEG_INFINITY, state);
    }

    /// As [`Jump::land`], for a sample: without modes that change nothing.
    pub(crate) fn sample(&mut self, plan: &Plan, into: u64, state: &mut SliderState) {
        let least_m = NEGLIGIBLE / self.forced.nodes as f64 * kernels::largest(&self.forced.position_m);
        self.advance(plan, into, least_m, state);
    }

    /// Cost of a sample.
    pub(crate) fn steps_of_sample(&self) -> u64 {
        self.limits.composed_steps
    }

    fn advance(&mut self, plan: &Plan, into: u64, least_m: f64, state: &mut SliderState) {
        self.stuck.compose(into, least_m, &mut self.composed);
        self.forced.write(into, &self.composed, state);
        self.account(plan, into, state);
    }

    /// Adds to the energies the contributions of the steps up to the present state.
    ///
    /// The displacements of the free motion sum up by its map, summed over the steps `r -> r'`:
    /// `M sum u = -C sum v - m / dt (v' - v)`, with `sum v = (u' - u) / dt + v - v'`. The work of a force needs
    /// `f sum u`. Where solving takes more than a few sweeps, that is the right side times `M^-1 f`.
    fn account(&self, plan: &Plan, into: u64, state: &mut SliderState) {
        let Jump { stuck, limits, forced, start, composed, .. } = self;
        let (count, dt) = (into as f64, plan.grid.step_s());
        let (u, v) = start.split_at(start.len() / 2);
        let (new_u, new_v) = composed.split_at(u.len());
        let inertia = plan.block_mass_kg / dt;
        let free_j = |Response { displacement_m, damping_n, .. }: &Response| -> f64 {
            let parts = (0..u.len()).map(|n| {
                let change = new_v[n] - v[n];
                damping_n[n] * ((new_u[n] - u[n]) - dt * change) - inertia * displacement_m[n] * change
            });
            parts.sum()
        };
        let before_j = state.energy.drive_work_j.value();
        let Forced { position_m, advance_m, responses: [of_drive, of_load], .. } = forced;
        let first_m = |n: usize| position_m[n] + u[n];
        let way_m = |n: usize| state.displacement_m[n] - first_m(n);
        let sum_m = |n: usize| count * (position_m[n] + 0.5 * (count - 1.0) * advance_m[n]);
        // `-sum L_j (U_j - U_{j - 1})` with `U = sum F_n u_z` and `L` the load over that of the start, by parts.
        let last = forced.ramp.ahead(count - 1.0);
        let parts = top_loads(plan).map(|(n, load_n)| {
            forced.ramp.change_n(load_n * (sum_m(n) - count * first_m(n))) - last.scaled_n(load_n * way_m(n))
        });
        let load_j = parts.sum::<f64>() - forced.ramp.change_n(free_j(of_load));
        state.energy.load_work_j.add(load_j);
        if limits.solves_in_sweeps {
            let velocities: Vec<f64> =
                (0..u.len()).map(|n| (new_u[n] - u[n]) / dt + (v[n] - new_v[n])).collect();
            let mut free_m: Vec<f64> = (0..u.len()).map(|n| -inertia * (new_v[n] - v[n])).collect();
            add_damping(plan, &velocities, &mut free_m);
            stuck.solve(&mut free_m, &Stop::never());
            let driven_m = |n: usize| free_m[n] + sum_m(n);
            Accounts::add_drive(plan, state, forced.from_step, into, driven_m, first_m);
        } else {
            // A drive that stops moves in the first step at most.
            let stops = forced.rates[0] == 0.0;
            let driven_m = |n: usize| if stops { first_m(n) } else { sum_m(n) };
            Accounts::add_drive(plan, state, forced.from_step, into, driven_m, first_m);
            state.energy.drive_work_j.add(-free_j(of_drive));
        }
        let drive_j = state.energy.drive_work_j.value() - before_j;
        stuck.add_energies(plan, forced, [start, composed], drive_j + load_j, state);
    }
}

/// Adds the forces of the dashpots, of a chain with those at its ends.
fn add_damping(plan: &Plan, velocity_m_per_s: &[f64], force_n: &mut [f64]) {
    let (v, mut dashpots_n) = (velocity_m_per_s, vec![0.0; force_n.len()]);
    kernels::lattice_dashpots(&mut dashpots_n, v, &plan.elastic);
    for (force_n, damping_n) in force_n.iter_mut().zip(dashpots_n) {
        *force_n += damping_n;
    }
    for bond in &plan.end_bonds {
        bond.add(-bond.damping_kg_per_s * bond.stretch(v), force_n);
    }
}

/// What a force does in equilibrium: `M^-1` times it, and the force of the dashpots where the freedoms move by that in
/// a step.
#[derive(Debug, Clone, Default)]
struct Response {
    force_n: Vec<f64>,
    displacement_m: Vec<f64>,
    damping_n: Vec<f64>,
}

/// The forced part of a jump.
#[derive(Debug, Clone)]
pub(crate) struct Forced {
    /// `a`, `b` and `g` of each freedom.
    position_m: Vec<f64>,
    advance_m: Vec<f64>,
    rate_n: Vec<f64>,
    /// To the change of the drive in a step, and to the load of the start.
    responses: [Response; 2],
    /// Number of nodes: freedoms lie axis by axis, one for each node.
    nodes: usize,
    step_s: f64,
    /// The step of the state where the jump begins.
    from_step: u64,
    /// How far the drive point moves in each step after the first, and the change of the load, relative to that of the
    /// start; not numbers before the first jump.
    rates: [f64; 2],
    /// The step in which the drive stops.
    hold_step: u64,
    /// The load of the next step, and its rate.
    ramp: Ramp,
}

impl Forced {
    fn of(plan: &Plan) -> Forced {
        let zeros = vec![0.0; plan.elastic.freedoms()];
        Forced {
            position_m: zeros.clone(),
            advance_m: zeros.clone(),
            rate_n: zeros,
            responses: Default::default(),
            nodes: plan.elastic.nodes(),
            step_s: plan.grid.step_s(),
            from_step: 0,
            rates: [f64::NAN; 2],
            hold_step: u64::MAX,
            ramp: Ramp::FLAT,
        }
    }

    /// Begins at a state; `false` if the stiffness cannot be solved with.
    fn begin<const D: usize>(
        &mut self,
        plan: &Plan,
        state: &SliderState,
        stuck: &dyn Stuck<D>,
        stop: &Stop<'_>,
    ) -> bool {
        self.from_step = state.step;
        self.hold_step = state.hold_step;
        let outside = self.outside(plan);
        self.ramp = outside.ramp();
        let rates = [outside.advance_m(), self.ramp.change_n(1.0)];
        if self.rates != rates && !self.respond(plan, rates, stuck, stop) {
            return false;
        }
        let [of_drive, of_load] = &self.responses;
        let sum = |n: usize, of: fn(&Response) -> &[f64]| of(of_drive)[n] + rates[1] * of(of_load)[n];
        let force_n = &mut self.position_m;
        for (n, force_n) in force_n.iter_mut().enumerate() {
            self.advance_m[n] = sum(n, |of| &of.displacement_m);
            self.rate_n[n] = sum(n, |of| &of.force_n);
            *force_n = sum(n, |of| &of.damping_n);
        }
        for (place, anchor_m) in state.stick_position_m.iter().enumerate() {
            let (axis, contact) = (place / plan.blocks, place % plan.blocks);
            force_n[axis * self.nodes + contact] += plan.friction.springs_n_per_m[contact] * anchor_m;
        }
        let still = vec![0.0; force_n.len()];
        outside.add_n(force_n, [&still, &still]);
        for (freedom, load_n) in top_loads(plan) {
            force_n[freedom] -= self.ramp.load.scaled_n(load_n);
        }
        stuck.solve(force_n, stop)
    }

    /// Finds the responses to the changes in a step; `false` as [`Forced::begin`].
    fn respond<const D: usize>(
        &mut self,
        plan: &Plan,
        rates: [f64; 2],
        stuck: &dyn Stuck<D>,
        stop: &Stop<'_>,
    ) -> bool {
        self.rates = [f64::NAN; 2];
        let mut forces_n = [(); 2].map(|()| vec![0.0; self.advance_m.len()]);
        for spring in &plan.drive.springs {
            forces_n[0][spring.block] += spring.stiffness_n_per_m * (spring.direction * rates[0]);
        }
        for (freedom, load_n) in top_loads(plan) {
            forces_n[1][freedom] = -load_n;
        }
        for (response, force_n) in self.responses.iter_mut().zip(forces_n) {
            let mut displacement_m = force_n.clone();
            if !stuck.solve(&mut displacement_m, stop) {
                return false;
            }
            let velocity_m_per_s: Vec<f64> = displacement_m.iter().map(|x| x / self.step_s).collect();
            let mut damping_n = vec![0.0; force_n.len()];
            add_damping(plan, &velocity_m_per_s, &mut damping_n);
            *response = Response { force_n, displacement_m, damping_n };
        }
        self.rates = rates;
        true
    }

    /// What acts from outside in the first step.
    fn outside<'a>(&self, plan: &'a Plan) -> Outside<'a> {
        plan.outside(self.from_step + 1, self.hold_step)
    }

    /// `v_q` of a freedom.
    #[inline]
    fn velocity_m_per_s(&self, freedom: usize) -> f64 {
        self.advance_m[freedom] / self.step_s
    }

    /// Writes what is left of a state without the forced part.
    fn take_from(&self, state: &SliderState, motion: &mut [f64]) {
        let (u, v) = motion.split_at_mut(self.position_m.len());
        for n in 0..u.len() {
            u[n] = state.displacement_m[n] - self.position_m[n];
            v[n] = state.velocity_m_per_s[n] - self.velocity_m_per_s(n);
        }
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
        let point_m = self.outside(plan).point_m;
        let rates = plan.drive.springs.iter().map(|spring| {
            spring.stiffness_n_per_m * (spring.direction * self.rates[0] - self.advance_m[spring.block])
        });
        let rate = rates.sum::<f64>();
        (plan.drive.total_force_n(point_m, &self.position_m) + into * rate, rate)
    }

    /// Adds the driving force to a clearance counted from `into` steps after the first, if a load stops the
    /// drive; false if that load is reached there. `swing` is the largest contribution of the modes, with a
    /// reserve.
    fn stays_below_stop(&self, plan: &Plan, into: f64, swing: [f64; 2], clearance: &mut Clearance) -> bool {
        let Some(stop) = StopForce::of(plan, self.hold_step) else { return true };
        let load = (self.ramp.ahead(into), self.ramp);
        clearance.stays_below_stop(stop, load, self.drive_n(plan, into), swing)
    }

    /// Writes the state `into` steps after the first, with a free motion.
    fn write(&self, into: u64, motion: &[f64], state: &mut SliderState) {
        let (modes_m, modes_m_per_s) = motion.split_at(self.position_m.len());
        for (n, u) in state.displacement_m.iter_mut().enumerate() {
            *u = self.position_m[n] + (into as f64 * self.advance_m[n] + modes_m[n]);
            state.velocity_m_per_s[n] = self.velocity_m_per_s(n) + modes_m_per_s[n];
        }
        state.step = self.from_step + into;
        state.sliding = 0;
    }
}
