//! Rigid Amontons-Coulomb (2.7), Maegawa's: a stuck contact does not move, a sliding one feels
//! `-mu_d p sign(v) - E v`, or more as it weakens by slip, and re-attaches, at rest, in the step in which its velocity
//! would change sign.

use crate::law::weakening::{Weakening, Weakens};
use crate::law::{Affine, ContactLaw, Sliding, Turn, WithLaw, amontons_coulomb_n, kept_at_rest, resisting_n};
use crate::scenario::Scenario;

/// Friction without springs; `PLAIN` in loops without radiation, `E = 0`, and drag at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid<const PLAIN: bool = false> {
    /// `E`.
    radiation_kg_per_s: f64,
    /// Whether friction resists in the first step of a slip.
    at_rest: bool,
    /// How friction falls with slip, if it does not fall at once.
    pub(super) weakening: Option<Weakening>,
}

/// By how much a block still slides the way it did: below 0 where its velocity has changed sign.
#[inline(always)]
pub(super) fn goes_on(turn: &Turn) -> f64 {
    turn.new_velocity_m_per_s[0] * turn.direction[0]
}

impl<const PLAIN: bool> ContactLaw for Rigid<PLAIN> {
    const HOLDS: bool = true;
    const KEYS: &'static [&'static str] = &[
        "friction.drag_at_rest",
        "friction.radiation_kg_per_s",
        "friction.weakening_slip_m",
        "friction.weakening_slip_offsets_m",
        "friction.weakening_fractions",
        "friction.weakening_shares",
        "friction.slip_memory_s",
    ];

    fn of(scenario: &Scenario) -> Self {
        Rigid {
            radiation_kg_per_s: scenario.friction.radiation_kg_per_s,
            at_rest: scenario.friction.drag_at_rest,
            weakening: Weakening::of(scenario),
        }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let [v] = sliding.velocity_m_per_s;
        if PLAIN {
            return [amontons_coulomb_n(sliding)];
        }
        [resisting_n(sliding, self.at_rest) + self.radiation_kg_per_s * v]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        (goes_on(turn) < 0.0) | kept_at_rest(turn, self.at_rest & !PLAIN)
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        0.0 - goes_on(turn)
    }

    fn affine(&self) -> Option<Affine> {
        (!self.at_rest && self.weakening.is_none()).then_some(Affine { forward_only: false })
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }

    fn with<W: WithLaw>(self, what: W) -> W::Output {
        let Rigid { radiation_kg_per_s, at_rest, weakening } = self;
        if let Some(weakening) = weakening {
            return what.with(Weakens { law: Rigid::<false> { radiation_kg_per_s, at_rest: true, weakening: None }, at_rest, weakening });
        }
        if radiation_kg_per_s > 0.0 || at_rest {
            return what.with(self);
        }
        what.with(Rigid::<true> { radiation_kg_per_s, at_rest, weakening })
    }
}
