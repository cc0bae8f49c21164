//! Amontons-Coulomb with interfacial springs (section 5.3): a spring pulls a stuck contact to its anchor, a
//! sliding one feels `-mu_d p sign(v) - E v` (5.14), or more as it weakens by slip; over an area
//! `-mu_d p w / |w|` (docs/bodies.md).

use std::hint::select_unpredictable;

use crate::scenario::choices::DetachBy;
use crate::law::weakening::{Weakening, Weakens};
use crate::law::{Affine, ContactLaw, Sliding, Strength, Turn, WithLaw, amontons_coulomb_n, magnitude};
use crate::scenario::Scenario;

/// The law of the thesis; `BY_SPRING` in loops over contacts that their friction springs detach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InterfacialSprings<const BY_SPRING: bool = false> {
    /// Whether a contact re-attaches where its velocity changes sign or vanishes, and not at every
    /// velocity of 0 or below.
    two_way: bool,
    /// Whether a stuck contact detaches by the force of its spring.
    by_spring: bool,
    /// `E`.
    radiation_kg_per_s: f64,
    /// How friction falls with slip, if it does not fall at once.
    pub(super) weakening: Option<Weakening>,
}

impl<const BY_SPRING: bool> ContactLaw for InterfacialSprings<BY_SPRING> {
    const DETACHES_BY_SPRING: bool = BY_SPRING;
    const KEYS: &'static [&'static str] = &[
        "friction.interfacial_stiffness_ratio",
        "disorder.stiffness_spread",
        "disorder.stiffness_offsets",
        "friction.reattach",
        "friction.detach_by",
        "friction.ageing_coefficient",
        "friction.ageing_time_s",
        "friction.radiation_kg_per_s",
        "friction.weakening_slip_m",
        "friction.weakening_slip_offsets_m",
        "friction.weakening_fractions",
        "friction.weakening_shares",
    ];

    fn of(scenario: &Scenario) -> Self {
        InterfacialSprings {
            two_way: scenario.friction.is_two_way(),
            by_spring: scenario.friction.detach_by == DetachBy::Spring,
            radiation_kg_per_s: scenario.friction.radiation_kg_per_s,
            weakening: Weakening::of(scenario),
        }
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        let [v] = sliding.velocity_m_per_s;
        [amontons_coulomb_n(sliding) + self.radiation_kg_per_s * v]
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn) -> bool {
        let ([v], [new_v]) = (turn.direction, turn.new_velocity_m_per_s);
        if self.two_way { new_v * v <= 0.0 } else { new_v <= 0.0 }
    }

    #[inline(always)]
    fn turned_by(&self, turn: &Turn) -> f64 {
        let ([v], [new_v]) = (turn.direction, turn.new_velocity_m_per_s);
        if self.two_way { 0.0 - new_v * v } else { 0.0 - new_v }
    }

    fn affine(&self) -> Option<Affine> {
        self.weakening.is_none().then_some(Affine { forward_only: !self.two_way })
    }

    fn radiation_kg_per_s(&self) -> f64 {
        self.radiation_kg_per_s
    }

    fn detaches_by_spring(&self) -> bool {
        self.by_spring
    }

    fn with<W: WithLaw>(self, what: W) -> W::Output {
        let InterfacialSprings { two_way, by_spring, radiation_kg_per_s, weakening } = self;
        if let Some(weakening) = weakening {
            return what.with(Weakens { law: InterfacialSprings::<false> { two_way, by_spring, radiation_kg_per_s, weakening: None }, at_rest: false, weakening });
        }
        match (radiation_kg_per_s > 0.0, two_way) {
            _ if by_spring => {
                what.with(InterfacialSprings::<true> { two_way, by_spring, radiation_kg_per_s, weakening })
            }
            (true, _) => what.with(self),
            (false, true) => what.with(ByRule::<true>),
            (false, false) => what.with(ByRule::<false>),
        }
    }
}

/// The law without radiation, `E = 0`, and with a fixed rule of re-attachment, which loops need not check at
/// every contact.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ByRule<const TWO_WAY: bool>;

impl<const TWO_WAY: bool> ByRule<TWO_WAY> {
    const LAW: InterfacialSprings =
        InterfacialSprings { two_way: TWO_WAY, by_spring: false, radiation_kg_per_s: 0.0, weakening: None };
}

impl<const TWO_WAY: bool> ContactLaw for ByRule<TWO_WAY> {
    fn of(_: &Scenario) -> ByRule<TWO_WAY> {
        ByRule
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_>) -> [f64; 1] {
        [amontons_coulomb_n(sliding)]
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

/// The law of a contact that slips along a vector.
///
/// Friction opposes `w`, the velocity to which the contact would come in the step without friction, or its old
/// velocity where these two are a right angle or more apart. Against the old velocity alone, an explicit step
/// multiplies the angle between velocity and force by `1 - dt mu_d p / (m |v|)`: at low speeds that overshoots,
/// and the contact flutters from side to side. The contact re-attaches where its velocity has turned by a right
/// angle or more from the direction of its slip.
///
/// With a single tangential freedom, `w / |w|` is the sign of the old velocity, to the bit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpringsOverArea;

impl ContactLaw<2> for SpringsOverArea {
    fn of(_: &Scenario) -> SpringsOverArea {
        SpringsOverArea
    }

    #[inline(always)]
    fn drag_n(&self, sliding: &Sliding<'_, 2>) -> [f64; 2] {
        let &Sliding { velocity_m_per_s: v, tangential_force_n: tau, strength: Strength { friction_n, .. }, .. } = sliding;
        let by = sliding.step_over_mass_s_per_kg;
        let coming = [v[0] + tau[0] * by, v[1] + tau[1] * by];
        let goes_on = product(coming, v) > 0.0;
        let w = [0, 1].map(|axis| select_unpredictable(goes_on, coming[axis], v[axis]));
        let speed = magnitude(w);
        w.map(|w| select_unpredictable(speed == 0.0, 0.0, friction_n * (w / speed)))
    }

    #[inline(always)]
    fn re_attaches(&self, turn: &Turn<2>) -> bool {
        product(turn.direction, turn.new_velocity_m_per_s) <= 0.0
    }
}

/// The scalar product of two vectors.
#[inline(always)]
fn product(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

#[cfg(test)]
mod tests {
    use super::{InterfacialSprings, SpringsOverArea};
    use crate::law::{ContactLaw, Sliding, Strength, Turn, magnitude};
    use crate::plan::splitmix::mixed;

    const STEP_OVER_MASS_S_PER_KG: f64 = 0.013;

    /// A number from -1 to 1.
    fn number(seed: u64, n: u64) -> f64 {
        2.0 * (mixed(seed << 32 | n) as f64 / u64::MAX as f64) - 1.0
    }

    fn sliding<const D: usize>(v: [f64; D], tau: [f64; D], friction_n: f64) -> Sliding<'static, D> {
        Sliding {
            displacement_m: [0.0; D],
            velocity_m_per_s: v,
            tangential_force_n: tau,
            step_over_mass_s_per_kg: STEP_OVER_MASS_S_PER_KG,
            strength: Strength { static_n: friction_n, friction_n, load: 1.0, weakening_slip_m: 0.0, memory: &[] },
        }
    }

    fn turn<const D: usize>(direction: [f64; D], new_velocity_m_per_s: [f64; D]) -> Turn<D> {
        Turn { direction, new_velocity_m_per_s }
    }

    /// To the bit: friction whichever way it slides, and re-attachment of what slides forwards.
    #[test]
    fn along_one_axis_the_law_over_an_area_is_the_one_way_rule() {
        let one_way: InterfacialSprings = InterfacialSprings { two_way: false, by_spring: false, radiation_kg_per_s: 0.0, weakening: None };
        for n in 0..10_000 {
            let [v, tau, new_v] = [1, 2, 3].map(|seed| number(seed, n));
            // Also speeds far below those that a step changes, and rest.
            let v = v * [1.0, 1e-12, 0.0][n as usize % 3];
            let friction_n = number(4, n).abs();
            let [along] = one_way.drag_n(&sliding([v], [tau], friction_n));
            for (axis, v, tau) in [(0, [v, 0.0], [tau, 0.0]), (1, [0.0, v], [0.0, tau])] {
                let found = SpringsOverArea.drag_n(&sliding(v, tau, friction_n));
                assert_eq!((found[axis], found[1 - axis]), (along, 0.0), "{v:?} {tau:?}");
            }
            let sticks = one_way.re_attaches(&turn([v], [new_v]));
            let forwards = [v.abs(), 0.0];
            assert!(v == 0.0 || SpringsOverArea.re_attaches(&turn(forwards, [new_v, 0.0])) == sticks);
        }
    }

    #[test]
    fn friction_opposes_the_velocity_to_come() {
        for n in 0..10_000 {
            let of = |seed: u64| [number(seed, n), number(seed + 1, n)];
            let (v, tau, friction_n) = (of(1), of(3), number(5, n).abs());
            let v = v.map(|v| 0.02 * v);
            let drag_n = SpringsOverArea.drag_n(&sliding(v, tau, friction_n));
            assert!((magnitude(drag_n) - friction_n).abs() < 1e-15, "as large as sliding friction");
            let coming = [0, 1].map(|axis| v[axis] + STEP_OVER_MASS_S_PER_KG * tau[axis]);
            let goes_on = coming[0] * v[0] + coming[1] * v[1] > 0.0;
            let [x, y] = if goes_on { coming } else { v };
            let across = drag_n[0] * y - drag_n[1] * x;
            assert!(across.abs() < 1e-16 && drag_n[0] * x + drag_n[1] * y >= 0.0, "{drag_n:?} {x} {y}");
            // The mirror image is resisted by the mirror image.
            let mirrored = SpringsOverArea.drag_n(&sliding([v[0], -v[1]], [tau[0], -tau[1]], friction_n));
            assert_eq!(mirrored, [drag_n[0], -drag_n[1]]);
        }
        assert_eq!(SpringsOverArea.drag_n(&sliding([0.0, 0.0], [0.3, -0.4], 1.0)), [0.0, 0.0], "at rest");
    }

    /// Below the speed `dt mu_d p / (2 m)`, friction along the old velocity turns a contact across the force from
    /// side to side, ever farther.
    #[test]
    fn a_slow_contact_aligns_with_its_force_instead_of_fluttering() {
        let (tau, friction_n, by) = ([1.0, 0.0], 0.99, STEP_OVER_MASS_S_PER_KG);
        let slow = 0.2 * by * friction_n;
        let mut v = [slow, 0.1 * slow];
        let (mut along_old, mut steepest) = (v, 0.0_f64);
        for _ in 0..10 {
            let drag_n = SpringsOverArea.drag_n(&sliding(v, tau, friction_n));
            v = [0, 1].map(|axis| v[axis] + by * (tau[axis] - drag_n[axis]));
            let speed = magnitude(along_old);
            along_old = [0, 1].map(|axis| along_old[axis] + by * (tau[axis] - friction_n * along_old[axis] / speed));
            steepest = steepest.max((along_old[1] / along_old[0]).abs());
        }
        assert!(v[1].abs() < 1e-6 * v[0], "{v:?}");
        assert!(steepest > 0.5, "{steepest}");
    }

    #[test]
    fn a_contact_re_attaches_where_it_turns_by_a_right_angle() {
        let re_attaches = |direction, v| SpringsOverArea.re_attaches(&turn(direction, v));
        assert!(!re_attaches([1.0, 0.0], [1e-9, 5.0]));
        assert!(re_attaches([1.0, 0.0], [0.0, 5.0]));
        assert!(re_attaches([1.0, 0.0], [-1e-9, 5.0]));
        assert!(!re_attaches([-1.0, -1.0], [-3.0, 1.0]), "backwards it slips as forwards");
        assert!(re_attaches([0.0, 0.0], [1.0, 1.0]), "without a direction it rests");
    }
}
