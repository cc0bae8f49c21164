//! Burridge and Knopoff's law (2.4): rigid, with the sliding friction
//! `-mu_d p sign(v) / (1 + |v| / v_c) - E v`.

use crate::law::laws::rigid::goes_on;
use crate::law::{ContactLaw, Sliding, Turn, kept_at_rest, resisting_n};
use crate::scenario::Scenario;

/// Friction that falls with velocity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityWeakening {
    /// `1 / v_c`.
    weakening_s_per_m: f64,
    /// `E`.
    radiation_kg_per_s: f64,
    /// Whether friction resists in the first step of a slip.
    at_rest: bool,
}

impl ContactLaw for VelocityWeakening {
    const HOLDS: bool = true;
    const KEYS: &'static [&'static str] =
        &["friction.weakening_velocity_m_per_s", "friction.drag_at_rest", "friction.radiation_kg_per_s"];

    fn of(scenario: &Scenario) -> VelocityWeakening {
        VelocityWeakening {
            weakening_s_per_m: 1.0 / scenario.friction.weakening_velocity_m_per_s,
            radiation_kg_per_s: scenario.friction.radiation_kg_per_s,
            at_rest: scenario.friction.drag_at_rest,
        }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let ([v], drag) = (sliding.velocity_m_per_s, resisting_n(sliding, self.at_rest));
        [drag / (1.0 + v.abs() * self.weakening_s_per_m) + self.radiation_kg_per_s * v]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        (goes_on(turn) < 0.0) | kept_at_rest(turn, self.at_rest)
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        0.0 - goes_on(turn)
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }
}
