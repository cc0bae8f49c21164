//! Slip weakening: friction falls from static to sliding friction while a contact slips (docs/slip-weakening.md).
//!
//! With the slip `D`, `mu(D) = mu_d + s(D / D_c) (mu_s - mu_d)`: `s` falls from 1 to 0 at `D_c`, linearly or in up to
//! four pieces. `D` is the length of the way since the end of the step of detachment, and of the slips before that the
//! contact remembers: it turns nowhere within a slip.

use crate::law::{ContactLaw, Sliding, Stepped, Strength, Turn, resisting_n};
use crate::scenario::Scenario;

/// Most corners of `s` between `(0, 1)` and `(1, 0)`.
pub(crate) const MOST_CORNERS: usize = 3;

/// How friction falls with slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weakening {
    /// The corners `(x, s)`, from `(0, 1)` to `(1, 0)`, which fills the rest.
    corners: [[f64; 2]; MOST_CORNERS + 2],
    /// How many there are.
    count: usize,
    /// Steps for which a contact must rest to be as strong as before; 0 or 1 where it is so at once.
    memory_steps: u64,
}

impl Weakening {
    /// That of a scenario; `None` if friction falls at once, at every contact.
    pub(crate) fn of(scenario: &Scenario) -> Option<Weakening> {
        let friction = &scenario.friction;
        if !scenario.weakens_by_slip() {
            return None;
        }
        let mut corners = [[1.0, 0.0]; MOST_CORNERS + 2];
        corners[0] = [0.0, 1.0];
        let given = friction.weakening_fractions.iter().zip(&friction.weakening_shares);
        for (corner, (x, s)) in corners[1..].iter_mut().zip(given) {
            *corner = [*x, *s];
        }
        Some(Weakening {
            corners,
            count: 2 + friction.weakening_fractions.len().min(MOST_CORNERS),
            memory_steps: (friction.slip_memory_s / scenario.time.step_s).round() as u64,
        })
    }

    /// The steepest fall of `s`, per `D_c`.
    pub fn steepest(&self) -> f64 {
        let falls =
            self.corners[..self.count].windows(2).map(|of| (of[0][1] - of[1][1]) / (of[1][0] - of[0][0]));
        falls.fold(0.0, f64::max)
    }

    /// The area below `s`: fracture energy over `(mu_s - mu_d) p D_c`.
    pub fn area(&self) -> f64 {
        let parts = self.corners[..self.count]
            .windows(2)
            .map(|of| 0.5 * (of[0][1] + of[1][1]) * (of[1][0] - of[0][0]));
        parts.sum()
    }

    /// Whether `s` rises above 1, so that a contact that stops is weaker than one that slips.
    pub fn strengthens(&self) -> bool {
        self.corners.iter().any(|[_, s]| *s > 1.0)
    }

    /// `s` at a slip over `D_c`.
    #[inline(always)]
    pub fn share(&self, x: f64) -> f64 {
        let next = self.corners[1..self.count - 1].iter().filter(|[corner, _]| *corner <= x).count();
        let [[x0, s0], [x1, s1]] = [self.corners[next], self.corners[next + 1]];
        if x < 1.0 { s0 + (s1 - s0) * ((x - x0) / (x1 - x0)) } else { 0.0 }
    }

    /// Friction after a slip.
    #[inline(always)]
    fn friction_n(&self, of: &Strength<'_>, slip_m: f64) -> f64 {
        let (high, low) = (of.static_n, of.friction_n);
        let x = slip_m / of.weakening_slip_m;
        of.load
            * match slip_m < of.weakening_slip_m {
                true if self.count == 2 => high - (high - low) * x,
                true => low + (high - low) * self.share(x),
                false => low,
            }
    }
}

/// A law whose friction weakens by slip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weakens<L> {
    /// The law without, which decides where a contact re-attaches.
    pub(crate) law: L,
    /// Whether contacts with `D_c = 0` resist in the first step of a slip; all others do.
    pub(crate) at_rest: bool,
    pub(crate) weakening: Weakening,
}

/// The memory of a contact: where it was at the end of the step of its last detachment, the slip before it, and the
/// step in which it is as strong as before.
const FROM: usize = 0;
const BEFORE: usize = 1;
const RESTED: usize = 2;

impl<L> Weakens<L> {
    /// The slip of a contact at a displacement.
    #[inline(always)]
    fn slip_m(memory: &[f64], displacement_m: f64) -> f64 {
        memory[BEFORE] + (displacement_m - memory[FROM]).abs()
    }

    /// A sliding contact by its friction after its slip, and whether that resists at rest.
    #[inline(always)]
    fn weakened<'a>(&self, sliding: &Sliding<'a>) -> (Sliding<'a>, bool) {
        let of = &sliding.strength;
        let friction_n = self.weakening.friction_n(of, Self::slip_m(of.memory, sliding.displacement_m[0]));
        let at_rest = self.at_rest | (of.weakening_slip_m > 0.0);
        (Sliding { strength: Strength { friction_n, ..*of }, ..*sliding }, at_rest)
    }
}

impl<L: ContactLaw> ContactLaw for Weakens<L> {
    const HOLDS: bool = L::HOLDS;
    const AMPLIFIES: bool = true;
    const MEMORY: usize = 3;

    fn of(scenario: &Scenario) -> Self {
        let weakening = Weakening::of(scenario).expect("only a law that weakens is compiled for it");
        Weakens { law: L::of(scenario), at_rest: scenario.friction.drag_at_rest, weakening }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let (weakened, at_rest) = self.weakened(sliding);
        [resisting_n(&weakened, at_rest) + self.law.radiation_kg_per_s() * sliding.velocity_m_per_s[0]]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        self.law.re_attaches(turn)
    }

    #[inline(always)]
    fn strength_n(&self, strength: &Strength<'_>) -> f64 {
        match strength.memory[BEFORE] {
            0.0 => strength.load * strength.static_n,
            slip_m => self.weakening.friction_n(strength, slip_m),
        }
    }

    fn fracture_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let (weakened, at_rest) = self.weakened(sliding);
        let ([v], [pull]) = (sliding.velocity_m_per_s, sliding.tangential_force_n);
        let resisting_n = resisting_n(&weakened, at_rest);
        let way = if v == 0.0 { pull } else { v };
        let is_idle = v == 0.0 && !at_rest;
        let residual_n = if is_idle { 0.0 } else { sliding.strength.load * sliding.strength.friction_n };
        [resisting_n - residual_n.copysign(way)]
    }

    fn remember(&self, after: &Stepped, memory: &mut [f64]) {
        let [u] = after.displacement_m;
        if after.switched && after.slides {
            self.begin_slip(u, memory);
        } else if after.switched {
            let rested_step = after.step + self.weakening.memory_steps;
            memory[BEFORE] = if self.weakening.memory_steps > 1 { Self::slip_m(memory, u) } else { 0.0 };
            memory[RESTED] = rested_step as f64;
        } else if !after.slides && (after.step + 1) as f64 >= memory[RESTED] {
            memory[BEFORE] = 0.0;
        }
    }

    fn begin_slip(&self, displacement_m: f64, memory: &mut [f64]) {
        memory[FROM] = displacement_m;
    }

    fn weak_until_step(&self, memory: &[f64]) -> u64 {
        if memory[BEFORE] > 0.0 { (memory[RESTED] as u64).saturating_sub(1) } else { 0 }
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.law.radiation_kg_per_s()
    }
}
