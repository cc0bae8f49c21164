//! The loops over the contacts of a lattice, compiled for each contact law: the force on them, friction, and
//! the work of both.

use std::hint::select_unpredictable;

use asperity_model::law::{ContactLaw, Sliding};

use crate::kernels::simd::kernel;
use crate::kernels::step::{Strengths, is_positive};

kernel! {
    /// The force on each contact along one axis, of springs, dashpots and from outside.
    fn tangential_force(tau: &mut [f64], springs: &[f64], dashpots: &[f64], outer: &[f64]) {
        let contacts = tau.len();
        let (springs, dashpots, outer) = (&springs[..contacts], &dashpots[..contacts], &outer[..contacts]);
        for n in 0..contacts {
            tau[n] = (springs[n] + dashpots[n]) + outer[n];
        }
    }
}

/// Contacts in a step. Vectors have one array for each tangential freedom.
pub(crate) struct ContactInputs<'a, const D: usize> {
    pub(crate) u: [&'a [f64]; D],
    pub(crate) v: [&'a [f64]; D],
    pub(crate) anchor: [&'a [f64]; D],
    pub(crate) tau: [&'a [f64]; D],
    pub(crate) slip: &'a [f64],
    /// Whether any contact slides.
    pub(crate) any_slides: bool,
    pub(crate) strengths: Strengths<'a>,
    pub(crate) kt: f64,
    pub(crate) dt_over_m: f64,
    /// Forces from outside, from which friction is taken.
    pub(crate) outer: [&'a mut [f64]; D],
    /// Friction; of no meaning where no contact slides.
    pub(crate) friction: [&'a mut [f64]; D],
}

/// How much below the square of its strength the square of the force on a stuck contact is if the contact
/// certainly stays stuck: more than squares and the root round.
const SURELY_BELOW: f64 = 1.0 - 8.0 * f64::EPSILON;

kernel! {
    /// Friction of all contacts, taken from the forces from outside. Returns whether any contact may switch.
    fn apply_friction[const D: usize, L: ContactLaw<D>](contacts: &mut ContactInputs<'_, D>, law: &L) -> bool {
        match contacts.any_slides {
            true => apply_friction_to::<D, L, true>(contacts, law),
            false => apply_friction_to::<D, L, false>(contacts, law),
        }
    }
}

#[inline(always)]
fn apply_friction_to<const D: usize, L: ContactLaw<D>, const SLIDES: bool>(
    contacts: &mut ContactInputs<'_, D>,
    law: &L,
) -> bool {
    let ContactInputs { kt, dt_over_m, .. } = *contacts;
    let count = contacts.slip.len();
    let (slip, strengths) = (&contacts.slip[..count], contacts.strengths.of_first(count));
    let [u, v, anchor, tau] = [contacts.u, contacts.v, contacts.anchor, contacts.tau]
        .map(|along| along.map(|along| &along[..count]));
    let outer = contacts.outer.each_mut().map(|along| &mut along[..count]);
    let friction = contacts.friction.each_mut().map(|along| &mut along[..count]);
    // Excess of each contact over its switch, whose sign bit is set if it certainly stays as it is; the bits of
    // all contacts are combined by AND.
    let mut beyond = u64::MAX;
    for n in 0..count {
        let at = |along: [&[f64]; D]| along.map(|along| along[n]);
        let (tau, u, anchor) = (at(tau), at(u), at(anchor));
        let mut resists =
            if L::HOLDS { tau } else { std::array::from_fn(|axis| kt * (u[axis] - anchor[axis])) };
        let strength = strengths.at::<D, L>(n);
        if SLIDES {
            let drag = law.drag_n(&Sliding {
                displacement_m: u,
                velocity_m_per_s: at(v),
                tangential_force_n: tau,
                step_over_mass_s_per_kg: dt_over_m,
                strength,
            });
            for axis in 0..D {
                resists[axis] = select_unpredictable(slip[n] != 0.0, drag[axis], resists[axis]);
                friction[axis][n] = resists[axis];
            }
        }
        for axis in 0..D {
            outer[axis][n] -= resists[axis];
        }
        let strength = law.strength_n(&strength);
        let detached_by = match D {
            1 => tau[0].abs() - strength,
            _ => tau.into_iter().fold(0.0, |sum, tau| sum + tau * tau) - strength * strength * SURELY_BELOW,
        };
        beyond &= detached_by.to_bits();
    }
    SLIDES || is_positive(beyond)
}

/// Lanes of a sum: its order is the same on every machine.
const LANES: usize = 8;

kernel! {
    /// The sum of squares of the velocities of stuck contacts after a step, and the power of the friction of those that
    /// slid in it, if any did. Vectors have one array for each tangential freedom.
    fn friction_work[const D: usize](
        v: [&[f64]; D],
        friction: [&[f64]; D],
        slip: &[f64],
        any_slid: bool,
    ) -> [f64; 2] {
        match any_slid {
            true => friction_work_of::<D, true>(v, friction, slip),
            false => friction_work_of::<D, false>(v, friction, slip),
        }
    }
}

#[inline(always)]
fn friction_work_of<const D: usize, const SLID: bool>(
    v: [&[f64]; D],
    friction: [&[f64]; D],
    slip: &[f64],
) -> [f64; 2] {
    let contacts = slip.len();
    let (mut square, mut power) = ([0.0; LANES], [0.0; LANES]);
    for axis in 0..D {
        let (v, friction) = (&v[axis][..contacts], &friction[axis][..contacts]);
        let mut add = |lane: usize, n: usize| {
            if SLID {
                let slid = slip[n] != 0.0;
                square[lane] += select_unpredictable(slid, 0.0, v[n] * v[n]);
                power[lane] += select_unpredictable(slid, friction[n] * v[n], 0.0);
            } else {
                square[lane] += v[n] * v[n];
            }
        };
        let whole = contacts / LANES * LANES;
        for from in (0..whole).step_by(LANES) {
            for lane in 0..LANES {
                add(lane, from + lane);
            }
        }
        for n in whole..contacts {
            add(n - whole, n);
        }
    }
    [square, power].map(|lanes| lanes.into_iter().sum())
}

#[cfg(test)]
mod tests {
    use asperity_model::law::laws::{FrictionLaw, SpringsOverArea};
    use asperity_model::mixed;
    use asperity_model::resolve;

    use super::ContactInputs;
    use crate::kernels::{self, After, Strengths, by_all};
    use crate::step::law::{ContactLoops, loops};

    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        (0..count).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
    }

    /// Some contacts, and what the loops make of them.
    struct Contacts<const D: usize> {
        values: [[Vec<f64>; D]; 4],
        slip: Vec<f64>,
        threshold: Vec<f64>,
        sliding_friction: Vec<f64>,
    }

    fn all<const D: usize>(of: &[Vec<f64>; D]) -> [&[f64]; D] {
        of.each_ref().map(Vec::as_slice)
    }

    impl<const D: usize> Contacts<D> {
        fn of(count: usize, any_slides: bool) -> Contacts<D> {
            let values = std::array::from_fn(|which| {
                std::array::from_fn(|axis| numbers((10 * which + axis) as u64, count))
            });
            let slides = |x: &f64| f64::from(u8::from(any_slides && *x > 0.0));
            Contacts {
                values,
                slip: numbers(50, count).iter().map(slides).collect(),
                threshold: numbers(51, count).iter().map(|x| 0.2 + x.abs()).collect(),
                sliding_friction: numbers(52, count).iter().map(|x| x.abs()).collect(),
            }
        }

        fn strengths(&self) -> Strengths<'_> {
            let (threshold, sliding_friction) = (&self.threshold, &self.sliding_friction);
            Strengths { threshold, sliding_friction, load: 1.0, weakening_slip: &[], memory: &[] }
        }

        /// The hint, forces from outside, friction of sliding contacts, works and marks, as bits.
        fn rubbed(&self, law: &dyn ContactLoops<D>, any_slides: bool) -> (bool, Vec<u64>, Vec<u64>) {
            let count = self.slip.len();
            let [u, v, anchor, tau] = self.values.each_ref().map(all);
            let (mut outer, mut friction) =
                ([0; D].map(|_| numbers(60, count)), [0; D].map(|_| vec![0.0; count]));
            let hint = law.apply_friction(&mut ContactInputs {
                u,
                v,
                anchor,
                tau,
                slip: &self.slip,
                any_slides,
                strengths: self.strengths(),
                kt: 2.1,
                dt_over_m: 0.013,
                outer: outer.each_mut().map(Vec::as_mut_slice),
                friction: friction.each_mut().map(Vec::as_mut_slice),
            });
            let works = kernels::friction_work(v, all(&friction), &self.slip, any_slides);
            let after = After { slip: &self.slip, direction: v, v_new: u, tau, strengths: self.strengths() };
            let mut marks = vec![0; count.div_ceil(64)];
            law.switching(&mut marks, &after);
            let bits = outer.iter().chain(&friction).flatten().chain(&works).map(|x| x.to_bits());
            (hint, bits.collect(), marks)
        }
    }

    fn compare<const D: usize>(law: &dyn ContactLoops<D>) {
        for (count, any_slides) in [1, 3, 8, 57, 156, 561].into_iter().flat_map(|n| [(n, false), (n, true)]) {
            let contacts = Contacts::<D>::of(count, any_slides);
            let (hint, _, marks) = by_all(|| contacts.rubbed(law, any_slides));
            assert!(hint || marks.iter().all(|mark| *mark == 0), "{law:?}, {count}");
        }
    }

    #[test]
    fn all_instruction_sets_rub_contacts_the_same_to_the_bit() {
        for word in [FrictionLaw::InterfacialSprings, FrictionLaw::Rigid, FrictionLaw::VelocityWeakening] {
            let set = format!("friction.law={}", word.word());
            compare::<1>(&*loops(resolve("default", &[set]).unwrap().contact_law()));
        }
        compare::<2>(&SpringsOverArea);
    }

    /// Contacts around their thresholds: whatever detaches has been hinted at, and what is well below has not.
    #[test]
    fn no_contact_detaches_without_a_hint() {
        let law = SpringsOverArea;
        let (mut hints, mut detached) = (0, 0);
        for n in 0..2_000_u64 {
            let mut contacts = Contacts::<2>::of(1, false);
            let [x, y] = [0, 1].map(|axis| numbers(n, 2)[axis]);
            contacts.values[3] = [vec![x], vec![y]];
            let strength = (x * x + y * y).sqrt();
            let off = [0.0, 1.0, -1.0, 2.0, -2.0, 64.0][n as usize % 6];
            contacts.threshold = vec![strength * (1.0 + off * f64::EPSILON / 2.0)];
            let (hint, _, marks) = contacts.rubbed(&law, false);
            assert!(hint || marks == [0], "{x} {y}, {off}");
            assert!(!hint || off < 64.0, "{x} {y}");
            hints += usize::from(hint);
            detached += usize::from(marks != [0]);
        }
        assert!(detached > 500 && hints > detached, "{hints} {detached}");
    }
}
