//! The equations of motion under rate-and-state friction, and the linear systems of their exact derivatives.
//!
//! Nothing ever sticks. With the position `w_n = u_n - X` of a block behind the drive point `X`, the force on
//! it besides friction is
//!
//! ```text
//! T_n = k (w_{n+1} - 2 w_n + w_{n-1}) + eta (V_{n+1} - 2 V_n + V_{n-1}) - K_n w_n + Q_n,
//! ```
//!
//! with the prestress `Q_n(t)`,
//! friction is `F = p a y` with `y = asinh((V / 2 V0) exp(psi / a))`, and radiation resists with `E V`. The unknowns
//! of a block are `w`, `y` and the state `psi`:
//!
//! ```text
//! w'   = V - X',             V = 2 V0 exp(-psi / a) sinh y,   V_y = 2 V0 exp(-psi / a) cosh y,
//! psi' = g(V, psi),          the law's evolution,
//! y'   = (T - p a y - E V) / (m V_y) + tanh(y) psi' / a,      from m V' = T - F - E V.
//! ```
//!
//! `w` instead of `u` keeps its digits over a long drive. `y` instead of `V` or `ln V` has no singular point: `V`
//! falls by fifteen decades between ruptures and may change its sign, while `y` is friction itself, which stays of
//! the order of `mu / a`, and friction follows from it without a difference of large numbers. The load `p` does not
//! enter `V`, so that a load that changes needs nothing more.
//!
//! Without inertia (`m = 0`) `y` is no unknown: it solves `T = p a y + E V`.
//!
//! # The linear system
//!
//! A stage of the integrator solves `(sigma - J) k = r` with the derivatives `J` of the right side, whose blocks of
//! three by three are tridiagonal. Neighbours act through their `w` and `V` alone. So with `z = V_y k_y - (V / a) k_psi`,
//! the change of a block's velocity, its rows give `k_w = (r_w + z) / sigma` and
//! `k_psi = (r_psi + g_V z) / (sigma - g_psi)`, where `g_psi <= 0` at constant velocity, so that no division
//! fails. What is left is one tridiagonal system in `z`, which is exact, not an approximation. Should a pivot of it vanish,
//! the step's error is not finite, and a shorter one is tried.

use asperity_model::body::elastic::Chain;
use asperity_model::law::rate_and_state::{RateAndState, asinh_of_exp};
use asperity_model::plan::adaptive_state::ENERGIES;
use asperity_model::plan::course::ContactCourse;
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;

use super::motion::{DriveAndLoad, Motion, StepEnd, Unknowns};
use super::rodas4::Rodas4;

impl Unknowns {
    /// `w`, `y`, `psi` and the energies.
    pub(super) fn parts(&self) -> (&[f64], &[f64], &[f64], &[f64; ENERGIES]) {
        let (of_blocks, energies_j) = self.0.split_last_chunk().expect("energies come last");
        let (behind_m, rest) = of_blocks.split_at(of_blocks.len() / 3);
        let (friction, state) = rest.split_at(behind_m.len());
        (behind_m, friction, state, energies_j)
    }

    /// `w`, `y`, `psi` and the energies, to be changed.
    pub(super) fn parts_mut(&mut self) -> (&mut [f64], &mut [f64], &mut [f64], &mut [f64; ENERGIES]) {
        let (of_blocks, energies_j) = self.0.split_last_chunk_mut().expect("energies come last");
        let (behind_m, rest) = of_blocks.split_at_mut(of_blocks.len() / 3);
        let (friction, state) = rest.split_at_mut(behind_m.len());
        (behind_m, friction, state, energies_j)
    }
}

/// What the law gives for one block.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Contact {
    /// `V`.
    pub(super) velocity: f64,
    /// `V_y`.
    pub(super) velocity_of_friction: f64,
    /// `tanh y`.
    pub(super) slope: f64,
    /// `psi'`.
    pub(super) state_rate: f64,
    /// `g_V` and `g_psi`, at constant state and at constant velocity.
    pub(super) rate_of_velocity: f64,
    pub(super) rate_of_state: f64,
}

/// `y`, and the two exponentials from which the law's velocity follows.
#[derive(Debug, Clone, Copy)]
struct Growth {
    friction: f64,
    size: f64,
    decay: f64,
}

impl Growth {
    /// `|V|`.
    fn speed_m_per_s(self) -> f64 {
        self.size * (1.0 - self.decay)
    }
}

/// The equations of a plan, with the numbers of the last evaluation.
#[derive(Debug, Clone)]
pub(super) struct Equations {
    pub(super) law: RateAndState,
    /// `b_n`.
    evolution_effects: Vec<f64>,
    /// `m`; 0 without inertia.
    pub(super) mass_kg: f64,
    pub(super) chain: Chain,
    /// `K_n`, and the stiffness of all springs on a block.
    pub(super) drive_n_per_m: Vec<f64>,
    pub(super) springs_n_per_m: Vec<f64>,
    /// The prestress at the beginning of the piece, N, and its rate, N/s, without its swing; none for none.
    prestress_n: Option<[Vec<f64>; 2]>,
    /// `p_n` and `a p_n` at the load of the start.
    load_n: Vec<f64>,
    direct_n: Vec<f64>,
    /// Where the loads of single contacts follow courses, their factors at the beginning of the piece, and their rates, 1/s.
    contact_loads: Option<[Vec<f64>; 2]>,
    pub(super) contacts: Vec<Contact>,
    /// `T_n` without dashpots.
    pulled_n: Vec<f64>,
}

impl Equations {
    /// `Q_n` at a time, N, and its rate, N/s.
    pub(super) fn prestress_n(&self, n: usize, outside: DriveAndLoad) -> [f64; 2] {
        let Some([force_n, n_per_s]) = &self.prestress_n else { return [0.0; 2] };
        let (load_n, [swing, swing_per_s]) = (self.load_n[n], outside.swung);
        [force_n[n] + n_per_s[n] * outside.since_s + swing * load_n, n_per_s[n] + swing_per_s * load_n]
    }

    /// `a p_n` at a time.
    pub(super) fn direct_n(&self, n: usize, outside: DriveAndLoad) -> f64 {
        let of_all_n = outside.load * self.direct_n[n];
        match &self.contact_loads {
            None => of_all_n,
            Some([factor, per_s]) => of_all_n * (factor[n] + per_s[n] * outside.since_s),
        }
    }

    /// Its change over a time, at the present rate.
    pub(super) fn direct_change_n(&self, n: usize, outside: DriveAndLoad, seconds: f64) -> f64 {
        let of_all_n = outside.load_per_s * seconds * self.direct_n[n];
        match &self.contact_loads {
            None => of_all_n,
            Some([factor, per_s]) => {
                of_all_n * (factor[n] + per_s[n] * outside.since_s)
                    + outside.load * self.direct_n[n] * per_s[n] * seconds
            }
        }
    }

    /// Sizes below which errors of the unknowns of block `n` do not matter: of `w` the distance over which friction
    /// changes by its direct effect.
    pub(super) fn scales(&self, n: usize) -> [f64; 3] {
        let held_by_n_per_m =
            self.chain.neighbours(n).min(1.0) * self.chain.stiffness_n_per_m + self.drive_n_per_m[n];
        // A block that bears next to nothing follows its neighbours, on whose scale its error counts.
        let mean_n = self.direct_n.iter().sum::<f64>() / self.direct_n.len() as f64;
        [self.direct_n[n].max(1e-3 * mean_n) / held_by_n_per_m, 1.0, self.law.direct_effect]
    }

    /// The sum over the neighbours of block `n`.
    pub(super) fn beside(&self, n: usize, of: impl Fn(usize) -> f64) -> f64 {
        let left = if n > 0 { of(n - 1) } else { 0.0 };
        let right = if n + 1 < self.chain.nodes { of(n + 1) } else { 0.0 };
        left + right
    }

    /// `V0 exp(|y| - psi / a)` and `exp(-2 |y|)`: neither overflows, unlike `sinh y`.
    fn growth(&self, friction: f64, state: f64) -> Growth {
        let y = friction.abs();
        let size = libm::exp(y - state / self.law.direct_effect);
        // Beyond 20 it changes no sum with 1.
        let decay = if y > 20.0 { 0.0 } else { libm::exp(-2.0 * y) };
        Growth { friction, size: self.law.reference_velocity_m_per_s * size, decay }
    }

    fn contact(&self, n: usize, growth: Growth, state: f64) -> Contact {
        let Growth { friction, size, decay } = growth;
        let y = friction.abs();
        // Near V_0 what `decay` leaves out counts here.
        let ln_speed = || y - state / self.law.direct_effect + libm::log1p(-libm::exp(-2.0 * y));
        let [state_rate, of_speed, rate_of_state] =
            self.law.evolution(self.evolution_effects[n], growth.speed_m_per_s(), ln_speed, state);
        Contact {
            velocity: growth.speed_m_per_s().copysign(friction),
            velocity_of_friction: size * (1.0 + decay),
            slope: ((1.0 - decay) / (1.0 + decay)).copysign(friction),
            state_rate,
            rate_of_velocity: of_speed * 1.0_f64.copysign(friction),
            rate_of_state,
        }
    }

    /// `T_n` without dashpots.
    fn pulled_n(&self, n: usize, outside: DriveAndLoad, behind_m: impl Fn(usize) -> f64) -> f64 {
        let (here, [prestress_n, _]) = (behind_m(n), self.prestress_n(n, outside));
        let strained_m = self.beside(n, |m| behind_m(m) - here);
        self.chain.stiffness_n_per_m * strained_m - self.drive_n_per_m[n] * here + prestress_n
    }

    /// `y` of block `n`, given the unknowns by their places, and `T_n` without dashpots and `a p_n`.
    fn friction(&self, n: usize, at: impl Fn(usize) -> f64, forces_n: impl FnOnce() -> [f64; 2]) -> Growth {
        let state = at(2 * self.chain.nodes + n);
        match self.mass_kg > 0.0 {
            true => self.growth(at(self.chain.nodes + n), state),
            false => self.friction_under(forces_n(), state),
        }
    }

    /// `|V|` of block `n` at a time, given the unknowns by their places.
    pub(super) fn speed_m_per_s(&self, n: usize, outside: DriveAndLoad, at: impl Fn(usize) -> f64) -> f64 {
        let forces_n = || [self.pulled_n(n, outside, &at), self.direct_n(n, outside)];
        self.friction(n, &at, forces_n).speed_m_per_s()
    }

    /// `y` with `T = p a y + E V`. Newton's method from above, where the left side is convex: it falls to the
    /// solution in ten iterations or fewer.
    fn friction_under(&self, [force_n, direct_n]: [f64; 2], state: f64) -> Growth {
        let RateAndState { direct_effect, reference_velocity_m_per_s: v0, radiation_kg_per_s, .. } = self.law;
        let pull_n = force_n.abs();
        if pull_n == 0.0 {
            return self.growth(0.0, state);
        }
        // Two bounds: all of the pull is friction, or radiation. The second takes a logarithm, and is the lower one only
        // where the first has radiation exceed the pull.
        let mut growth = self.growth(pull_n / direct_n, state);
        if radiation_kg_per_s * growth.speed_m_per_s() > 0.999 * pull_n {
            let free =
                asinh_of_exp(libm::log(pull_n / (2.0 * radiation_kg_per_s * v0)) + state / direct_effect);
            if free < growth.friction {
                growth = self.growth(free, state);
            }
        }
        loop {
            let Growth { friction: y, size, decay } = growth;
            let excess_n = direct_n * y + radiation_kg_per_s * growth.speed_m_per_s() - pull_n;
            let next = y - excess_n / (direct_n + radiation_kg_per_s * size * (1.0 + decay));
            if next >= y || next.is_nan() {
                return Growth { friction: y.copysign(force_n), ..growth };
            }
            growth = self.growth(next, state);
        }
    }

    /// `y'`; 0 without inertia, where `y` is no unknown.
    fn friction_rate(&self, n: usize, friction: f64, outside: DriveAndLoad) -> f64 {
        if self.mass_kg == 0.0 {
            return 0.0;
        }
        let Contact { velocity, velocity_of_friction, slope, state_rate, .. } = self.contacts[n];
        let RateAndState { direct_effect, radiation_kg_per_s, .. } = self.law;
        let friction_n = self.direct_n(n, outside) * friction;
        let net_n = self.tangential_force_n(n) - friction_n - radiation_kg_per_s * velocity;
        net_n / (self.mass_kg * velocity_of_friction) + slope * state_rate / direct_effect
    }
}

impl Motion for Equations {
    type Contacts = Vec<Contact>;
    type Method = Rodas4;

    fn of(plan: &Plan, law: RateAndState) -> Equations {
        let (blocks, chain) =
            (plan.blocks, plan.elastic.as_chain().expect("rate-and-state friction is that of a chain"));
        let drive_n_per_m = plan.drive.stiffness_n_per_m(blocks);
        let springs = drive_n_per_m.iter().enumerate();
        Equations {
            law,
            evolution_effects: plan.friction.evolution_effects.clone(),
            mass_kg: if law.inertia { plan.block_mass_kg } else { 0.0 },
            springs_n_per_m: springs
                .map(|(n, drive)| chain.neighbours(n) * chain.stiffness_n_per_m + drive)
                .collect(),
            chain,
            drive_n_per_m,
            prestress_n: None,
            load_n: plan.normal_load_n.clone(),
            direct_n: plan.normal_load_n.iter().map(|load_n| law.direct_effect * load_n).collect(),
            contact_loads: None,
            contacts: vec![Contact::default(); blocks],
            pulled_n: vec![0.0; blocks],
        }
    }

    fn contacts(&self) -> &Vec<Contact> {
        &self.contacts
    }

    fn velocity(contacts: &Vec<Contact>, n: usize) -> f64 {
        contacts[n].velocity
    }

    fn begin_piece(&mut self, plan: &Plan, step: u64) {
        let per_s = 1.0 / plan.grid.step_s();
        let at_step = |course: &ContactCourse| {
            let rates = course.rates(step).into_iter().map(|rate| rate * per_s);
            [course.values(step), rates.collect()]
        };
        self.contact_loads = plan.contact_load_course.as_ref().map(at_step);
        let zeros = || [vec![0.0; plan.blocks], vec![0.0; plan.blocks]];
        let is_pulled =
            plan.prestress_course.is_some() || plan.swing.is_some() || !plan.prestress_n.is_empty();
        self.prestress_n = is_pulled.then(|| {
            let mut prestress_n = plan.prestress_course.as_ref().map_or_else(zeros, at_step);
            prestress_n[0].iter_mut().zip(&plan.prestress_n).for_each(|(force, constant)| *force += constant);
            prestress_n
        });
    }

    /// Brings the law to these unknowns; without inertia it also determines `y`.
    fn evaluate(&mut self, at: &mut Unknowns, outside: DriveAndLoad) {
        for n in 0..self.chain.nodes {
            let unknown = |place: usize| at.0[place];
            self.pulled_n[n] = self.pulled_n(n, outside, unknown);
            let growth = self.friction(n, unknown, || [self.pulled_n[n], self.direct_n(n, outside)]);
            self.contacts[n] = self.contact(n, growth, at.0[2 * self.chain.nodes + n]);
            at.0[self.chain.nodes + n] = growth.friction;
        }
    }

    fn rates(&self, at: &Unknowns, outside: DriveAndLoad, rates: &mut Unknowns) {
        let radiation = self.law.radiation_kg_per_s;
        let (behind_m, friction, ..) = at.parts();
        let (behind_rate, friction_rate, state_rate, work_w) = rates.parts_mut();
        *work_w = [0.0; ENERGIES];
        for (n, contact) in self.contacts.iter().enumerate() {
            let v = contact.velocity;
            let friction_n = self.direct_n(n, outside) * friction[n];
            behind_rate[n] = v - outside.drive_m_per_s;
            state_rate[n] = contact.state_rate;
            friction_rate[n] = self.friction_rate(n, friction[n], outside);
            let stretch_m_per_s = self.contacts.get(n + 1).map_or(0.0, |next| next.velocity - v);
            work_w[0] -= outside.drive_m_per_s * self.drive_n_per_m[n] * behind_m[n];
            work_w[1] += friction_n * v;
            work_w[2] += radiation * v * v;
            work_w[3] += self.chain.damping_kg_per_s * stretch_m_per_s * stretch_m_per_s;
            work_w[4] += self.prestress_n(n, outside)[0] * v;
        }
    }

    /// `T_n` of the last evaluation, dashpots included.
    fn tangential_force_n(&self, n: usize) -> f64 {
        let here = self.contacts[n].velocity;
        self.pulled_n[n] + self.chain.damping_kg_per_s * self.beside(n, |m| self.contacts[m].velocity - here)
    }

    fn energy(&self, at: &Unknowns, slider: &SliderState) -> Energy {
        let u = &slider.displacement_m;
        let (behind_m, _, _, energies_j) = at.parts();
        let [drive_work_j, friction_heat_j, radiated_j, viscous_loss_j, prestress_work_j] = *energies_j;
        let square = |x: f64| 0.5 * x * x;
        let bonds = u.windows(2).map(|pair| self.chain.stiffness_n_per_m * square(pair[1] - pair[0]));
        let springs = self.drive_n_per_m.iter().zip(behind_m);
        let blocks = slider.velocity_m_per_s.iter();
        Energy {
            drive_work_j,
            prestress_work_j,
            friction_heat_j,
            viscous_loss_j,
            kinetic_j: blocks.map(|v| self.mass_kg * square(*v)).sum(),
            elastic_j: bonds.chain(springs.map(|(k, w)| k * square(*w))).sum(),
            radiated_j: (self.law.radiation_kg_per_s > 0.0).then_some(radiated_j),
            ..Energy::default()
        }
    }

    fn friction_of(&self, at: &StepEnd<Equations>, n: usize) -> [f64; 4] {
        let (_, friction, state, _) = at.at.parts();
        let above = (state[n] - self.law.reference_coefficient) / self.evolution_effects[n];
        let theta_s = self.law.steady_theta_s(self.law.reference_velocity_m_per_s) * libm::exp(above);
        [
            self.direct_n(n, at.outside) * friction[n],
            self.law.direct_effect * friction[n],
            state[n],
            theta_s.min(f64::MAX),
        ]
    }
}
