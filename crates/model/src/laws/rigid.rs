//! Rigid Amontons-Coulomb (2.7), Maegawa's: a stuck contact does not move, a sliding one feels
//! `-mu_d p sign(v)` and re-attaches, at rest, in the step in which its velocity would change sign.

use crate::law::{Affine, ContactLaw, LawKeys, Sliding, Turn, amontons_coulomb_n};

/// Friction without springs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rigid;

impl ContactLaw for Rigid {
    const HOLDS: bool = true;
    const KEYS: &'static [&'static str] = &[];

    fn of(_: &LawKeys) -> Rigid {
        Rigid
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
