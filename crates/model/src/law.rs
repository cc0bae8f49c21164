//! Contact laws: how a contact sticks, slides, and changes between the two.
//!
//! This is the interface; a law is a file of the folder `laws` and a line of the list in
//! [`crate::law::laws`]. It defines what happens at one contact; solvers loop over all contacts, compiled for
//! each law ([`WithLaw`]), so a law touches no solver.
//!
//! A contact has `D` tangential freedoms: one along a chain or a slab, two over an area. Forces and
//! velocities are vectors of that many numbers.
//!
//! A stuck contact either does not move ([`ContactLaw::HOLDS`]) or is pulled by a friction spring
//! `-k_t (u - u_stick)`. It detaches where the magnitude of the tangential force, or that of its friction
//! spring ([`ContactLaw::DETACHES_BY_SPRING`]), reaches its strength,
//! `mu_s p`, which may grow while it sticks, or what its law makes of that ([`ContactLaw::strength_n`]). A sliding
//! contact feels [`ContactLaw::drag_n`], until [`ContactLaw::re_attaches`]. A law may remember numbers of
//! each contact ([`ContactLaw::MEMORY`]) and change them at steps known in advance. The work of drag is
//! heat, but for what it radiates ([`ContactLaw::radiation_kg_per_s`]); energy is stored in friction springs
//! alone.

pub mod laws;
pub mod weakening;

use std::hint::select_unpredictable;

pub use asperity_record::magnitude;
pub use laws::{junctions, rate_and_state};

use crate::scenario::Scenario;

/// The strength of a contact in a step, and what it remembers.
#[derive(Debug, Clone, Copy)]
pub struct Strength<'a> {
    /// `mu_s p`, with its ageing.
    pub static_n: f64,
    /// `mu_d p`.
    pub friction_n: f64,
    /// The factor of the load on both; 1 unless the law is one of slip weakening, and both are those of the start.
    pub load: f64,
    /// The slip `D_c` over which friction falls from the one to the other; 0 for at once.
    pub weakening_slip_m: f64,
    /// Its memory ([`ContactLaw::MEMORY`]).
    pub memory: &'a [f64],
}

/// A sliding contact before a step.
#[derive(Debug, Clone, Copy)]
pub struct Sliding<'a, const D: usize = 1> {
    /// Its displacement.
    pub displacement_m: [f64; D],
    /// Its velocity.
    pub velocity_m_per_s: [f64; D],
    /// All that pulls at it but friction.
    pub tangential_force_n: [f64; D],
    /// By how much a force of 1 N changes its velocity in the step, `dt / m`.
    pub step_over_mass_s_per_kg: f64,
    /// Its strength and memory.
    pub strength: Strength<'a>,
}

/// A sliding contact in a step that changes its velocity.
#[derive(Debug, Clone, Copy)]
pub struct Turn<const D: usize = 1> {
    /// The direction in which it slips: its velocity before the step. Over an area, in the first step of a
    /// slip, instead of it the tangential force at which it detached, since it may still move another way.
    pub direction: [f64; D],
    /// Its velocity after the step.
    pub new_velocity_m_per_s: [f64; D],
}

/// A contact after a step, its switch included.
#[derive(Debug, Clone, Copy)]
pub struct Stepped<const D: usize = 1> {
    /// The step, from 1.
    pub step: u64,
    /// `dt`.
    pub step_s: f64,
    /// Whether it detached or re-attached in the step.
    pub switched: bool,
    /// Whether it enters the next step sliding.
    pub slides: bool,
    /// Its displacement.
    pub displacement_m: [f64; D],
    /// Its velocity.
    pub velocity_m_per_s: [f64; D],
    /// `mu_d p` in the step.
    pub friction_n: f64,
}

/// How solvers may leap over many steps in which no contact switches: sliding friction is
/// `-mu_d p sign(v) - E v` and nothing else, with `E` of [`ContactLaw::radiation_kg_per_s`], so that a step
/// is an affine map of the state.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Affine {
    /// A sliding contact re-attaches at a velocity of 0 or below, whichever way it slid before;
    /// otherwise where its velocity changes sign.
    pub forward_only: bool,
}

/// The law of one contact with `D` tangential freedoms.
///
/// Functions are called for every contact in every step: mark them `#[inline(always)]`, so that they
/// are compiled for the instruction set of the loop that calls them, and choose between numbers by
/// `std::hint::select_unpredictable` instead of branches.
pub trait ContactLaw<const D: usize = 1>: Copy + std::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// Whether a stuck contact does not move at all. It then has no friction spring, and re-attaches at
    /// rest where it was before the step.
    const HOLDS: bool = false;

    /// Whether contacts stick at all, up to a static threshold. Otherwise `mu_s`, `mu_d` and what is added to them
    /// have no meaning.
    const STICKS: bool = true;

    /// Whether slips amplify rounding, so that the pull on blocks of a chain is computed by
    /// [`Chain::pull_by_differences`](crate::body::elastic::Chain::pull_by_differences).
    const AMPLIFIES: bool = false;

    /// Whether a stuck contact detaches by the force of its friction spring, `k_t |u - u_stick|` of the step, instead of
    /// the tangential force.
    const DETACHES_BY_SPRING: bool = false;

    /// The keys that have a meaning for this law and not for every law, of one that scenarios select.
    const KEYS: &'static [&'static str] = &[];

    /// The law with the numbers of a scenario.
    fn of(scenario: &Scenario) -> Self;

    /// The friction on a sliding contact, N: positive against a positive velocity.
    fn drag_n(&self, sliding: &Sliding<'_, D>) -> [f64; D];

    /// Whether a sliding contact re-attaches in a step.
    fn re_attaches(&self, turn: &Turn<D>) -> bool;

    /// A number whose sign bit is clear wherever [`ContactLaw::re_attaches`]: loops combine sign bits
    /// faster than booleans.
    fn turned_by(&self, turn: &Turn<D>) -> f64 {
        if self.re_attaches(turn) { 1.0 } else { -1.0 }
    }

    /// How many numbers a contact remembers from step to step, besides its anchor and whether it slides. They
    /// begin as 0, and checkpoints save them.
    ///
    /// By a law with memory solvers leap only while all contacts stick, whatever [`ContactLaw::affine`]
    /// returns. There the memory must not change but in the steps of [`ContactLaw::next_change_step`].
    const MEMORY: usize = 0;

    /// The force at which a stuck contact detaches, N: at least [`Strength::static_n`], before which leaps end,
    /// unless the contact is [weak](ContactLaw::weak_until_step).
    #[inline(always)]
    fn strength_n(&self, strength: &Strength<'_>) -> f64 {
        strength.static_n
    }

    /// The part of drag whose work is fracture energy: what it exceeds `mu_d p` by.
    fn fracture_n(&self, _sliding: &Sliding<'_, D>) -> [f64; D] {
        [0.0; D]
    }

    /// Updates the memory of a contact after a step. In the one in which it detaches its strength must not change:
    /// records of that step contain it.
    fn remember(&self, _after: &Stepped<D>, _memory: &mut [f64]) {}

    /// Sets the memory of a contact that a run finds sliding, at a displacement.
    fn begin_slip(&self, _displacement_m: f64, _memory: &mut [f64]) {}

    /// The step up to which a stuck contact may detach below `mu_s p`, so that nothing leaps; 0 for none.
    fn weak_until_step(&self, _memory: &[f64]) -> u64 {
        0
    }

    /// The timer of a contact: the next step in which its memory changes although it sticks, after the last
    /// step taken; `u64::MAX` without one. No leap crosses it.
    fn next_change_step(&self, _memory: &[f64]) -> u64 {
        u64::MAX
    }

    /// Damping of a sliding contact, for the bound of the time step.
    fn damping_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s()
    }

    /// `E` of the part `E v` of drag that radiates: its work is not heat.
    fn radiation_kg_per_s(&self) -> f64 {
        0.0
    }

    /// Runs the code compiled for this law. A law with a choice that loops must not repeat at every contact
    /// passes on one type per alternative.
    fn with<W: WithLaw>(self, what: W) -> W::Output
    where
        Self: ContactLaw<1>,
    {
        what.with(self)
    }

    /// [`ContactLaw::DETACHES_BY_SPRING`], of the code that [`ContactLaw::with`] chooses.
    fn detaches_by_spring(&self) -> bool {
        Self::DETACHES_BY_SPRING
    }

    /// The form that lets solvers leap while contacts slide; `None` if it has none, so that they take
    /// single steps.
    fn affine(&self) -> Option<Affine> {
        None
    }
}

/// The memory of contact `n` in that of all contacts.
#[inline(always)]
pub fn memory_of<const D: usize, L: ContactLaw<D>>(memory: &[f64], n: usize) -> &[f64] {
    &memory[n * L::MEMORY..][..L::MEMORY]
}

/// `mu_d p sign(v)`: Amontons-Coulomb friction.
#[inline(always)]
pub fn amontons_coulomb_n(sliding: &Sliding<'_>) -> f64 {
    let [v] = sliding.velocity_m_per_s;
    select_unpredictable(v == 0.0, 0.0, sliding.strength.friction_n.copysign(v))
}

/// [`amontons_coulomb_n`]; `at_rest` says whether it resists the pull on a block at rest, which it cannot reverse.
#[inline(always)]
pub fn resisting_n(sliding: &Sliding<'_>, at_rest: bool) -> f64 {
    let ([v], [pull]) = (sliding.velocity_m_per_s, sliding.tangential_force_n);
    let resisting = sliding.strength.friction_n.min(pull.abs()).copysign(pull);
    select_unpredictable(at_rest & (v == 0.0), resisting, amontons_coulomb_n(sliding))
}

/// Whether a block that drag keeps at rest from the start does not slide.
#[inline(always)]
pub fn kept_at_rest(turn: &Turn, at_rest: bool) -> bool {
    at_rest & (turn.new_velocity_m_per_s[0] == 0.0)
}

/// Code to compile for each law.
pub trait WithLaw {
    /// The result.
    type Output;
    /// The work, with the law.
    fn with<L: ContactLaw>(self, law: L) -> Self::Output;
}
