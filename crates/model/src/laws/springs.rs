//! Amontons-Coulomb with interfacial springs (section 5.3): a spring pulls a stuck contact to its anchor, a
//! sliding one feels `-mu_d p sign(v)` (5.14).

use crate::law::{Affine, ContactLaw, LawKeys, Sliding, Turn, WithLaw, amontons_coulomb_n};

/// The law of the thesis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfacialSprings {
    /// Whether a contact re-attaches where its velocity changes sign or vanishes, and not at every
    /// velocity of 0 or below.
    two_way: bool,
}

impl ContactLaw for InterfacialSprings {
    const KEYS: &'static [&'static str] = &[
        "friction.interfacial_stiffness_ratio",
        "friction.reattach",
        "friction.ageing_coefficient",
        "friction.ageing_time_s",
    ];

    fn of(keys: &LawKeys) -> InterfacialSprings {
        InterfacialSprings { two_way: keys.is_two_way }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        [amontons_coulomb_n(sliding)]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        let ([v], [new_v]) = (turn.velocity_m_per_s, turn.new_velocity_m_per_s);
        if self.two_way { new_v * v <= 0.0 } else { new_v <= 0.0 }
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        let ([v], [new_v]) = (turn.velocity_m_per_s, turn.new_velocity_m_per_s);
        if self.two_way { 0.0 - new_v * v } else { 0.0 - new_v }
    }

    fn affine(&self) -> Option<Affine> {
        Some(Affine { forward_only: !self.two_way })
    }

    fn with<W: WithLaw>(self, what: W) -> W::Output {
        if self.two_way { what.with(ByRule::<true>) } else { what.with(ByRule::<false>) }
    }
}

/// The law with a fixed rule of re-attachment, which loops need not check at every contact.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ByRule<const TWO_WAY: bool>;

impl<const TWO_WAY: bool> ByRule<TWO_WAY> {
    const LAW: InterfacialSprings = InterfacialSprings { two_way: TWO_WAY };
}

impl<const TWO_WAY: bool> ContactLaw for ByRule<TWO_WAY> {
    const KEYS: &'static [&'static str] = InterfacialSprings::KEYS;

    fn of(_: &LawKeys) -> ByRule<TWO_WAY> {
        ByRule
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        Self::LAW.drag_n(sliding)
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        Self::LAW.re_attaches(turn)
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        Self::LAW.turned_by(turn)
    }

    fn affine(&self) -> Option<Affine> {
        Self::LAW.affine()
    }
}
