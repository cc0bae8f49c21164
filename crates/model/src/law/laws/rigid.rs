//! Rigid Amontons-Coulomb (2.7), Maegawa's: a stuck contact does not move, a sliding one feels
//! `-mu_d p sign(v) - E v` and re-attaches, at rest, in the step in which its velocity would change sign.

use crate::law::{Affine, ContactLaw, Sliding, Turn, WithLaw, amontons_coulomb_n, kept_at_rest, resisting_n};
use crate::scenario::Scenario;

/// Friction without springs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid {
    /// `E`.
    radiation_kg_per_s: f64,
    /// Whether friction resists in the first step of a slip.
    at_rest: bool,
}

impl ContactLaw for Rigid {
    const HOLDS: bool = true;
    const KEYS: &'static [&'static str] = &["friction.drag_at_rest", "friction.radiation_kg_per_s"];

    fn of(scenario: &Scenario) -> Rigid {
        Rigid { radiation_kg_per_s: scenario.friction.radiation_kg_per_s, at_rest: scenario.friction.drag_at_rest }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let ([v], drag) = (sliding.velocity_m_per_s, resisting_n(sliding, self.at_rest));
        [drag + self.radiation_kg_per_s * v]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        Silent.re_attaches(turn) | kept_at_rest(turn, self.at_rest)
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        Silent.turned_by(turn)
    }

    fn affine(&self) -> Option<Affine> {
        Silent.affine().filter(|_| !self.at_rest)
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }

    fn with<W: WithLaw>(self, what: W) -> W::Output {
        if self.radiation_kg_per_s > 0.0 || self.at_rest { what.with(self) } else { what.with(Silent) }
    }
}

/// The law without radiation, `E = 0`, and drag at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Silent;

impl ContactLaw for Silent {
    const HOLDS: bool = true;
    const KEYS: &'static [&'static str] = &[];

    fn of(_: &Scenario) -> Silent {
        Silent
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        [amontons_coulomb_n(sliding)]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        turn.new_velocity_m_per_s[0] * turn.direction[0] < 0.0
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        0.0 - turn.new_velocity_m_per_s[0] * turn.direction[0]
    }

    fn affine(&self) -> Option<Affine> {
        Some(Affine { forward_only: false })
    }
}
