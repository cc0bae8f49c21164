//! One step of all contacts, compiled for each contact law: forces, friction, new velocities and
//! positions of a chain, and which contacts of any body switch.

use std::hint::select_unpredictable;

use asperity_model::body::elastic::Chain;
use asperity_model::law::{ContactLaw, Sliding, Strength, Turn, magnitude, memory_of};

use crate::kernels::simd::kernel;

/// Strength and memory of all contacts in a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Strengths<'a> {
    /// `mu_s p` without ageing.
    pub(crate) threshold: &'a [f64],
    /// `mu_d p`.
    pub(crate) sliding_friction: &'a [f64],
    /// The factor of the load on both, where it is not in them.
    pub(crate) load: f64,
    /// `D_c`; empty by laws without.
    pub(crate) weakening_slip: &'a [f64],
    /// Empty by a law without.
    pub(crate) memory: &'a [f64],
}

impl<'a> Strengths<'a> {
    /// Those of the first contacts, which lets compilers leave out checks of bounds.
    #[inline(always)]
    pub(crate) fn of_first(self, count: usize) -> Self {
        let (threshold, sliding_friction) = (&self.threshold[..count], &self.sliding_friction[..count]);
        Strengths { threshold, sliding_friction, ..self }
    }

    /// That of a contact.
    #[inline(always)]
    pub(crate) fn at<const D: usize, L: ContactLaw<D>>(&self, n: usize) -> Strength<'a> {
        self.of::<D, L>(n, self.threshold[n], self.sliding_friction[n])
    }

    /// The same, given its static threshold and sliding friction.
    #[inline(always)]
    pub(crate) fn of<const D: usize, L: ContactLaw<D>>(
        &self,
        n: usize,
        static_n: f64,
        friction_n: f64,
    ) -> Strength<'a> {
        Strength {
            static_n,
            friction_n,
            load: self.load,
            weakening_slip_m: if L::MEMORY > 0 {
                self.weakening_slip.get(n).copied().unwrap_or(0.0)
            } else {
                0.0
            },
            memory: memory_of::<D, L>(self.memory, n),
        }
    }
}

/// The inputs of a chain's step. Nodes move, contacts rub; every node carries one contact.
pub(crate) struct Blocks<'a> {
    /// Bonds between the nodes.
    pub(crate) chain: &'a Chain,
    /// One number per node.
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) outer_force: &'a [f64],
    /// Whether a node other than the ends is pulled from outside.
    pub(crate) is_pulled_inside: bool,
    /// One number per contact.
    pub(crate) u_stick: &'a [f64],
    pub(crate) slip: &'a [f64],
    pub(crate) strengths: Strengths<'a>,
    /// `k_t`.
    pub(crate) kt: &'a [f64],
    /// `dt` and `dt / m`.
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
}

kernel! {
    /// One step of a chain: `tau` from [`crate::kernels::pull`] and the outer forces, friction, new velocities
    /// and positions (4.13, 4.14). Returns whether any contact may switch.
    fn step[L: ContactLaw](
        u_new: &mut [f64],
        v_new: &mut [f64],
        tau: &mut [f64],
        old: &Blocks<'_>,
        law: &L,
    ) -> bool {
        let &Blocks { chain, is_pulled_inside, dt, dt_over_m, .. } = old;
        let blocks = u_new.len();
        let (v_new, tau) = (&mut v_new[..blocks], &mut tau[..blocks]);
        let Blocks { u, v, u_stick, slip, outer_force, kt, .. } = *old;
        let (u, v, u_stick, slip) = (&u[..blocks], &v[..blocks], &u_stick[..blocks], &slip[..blocks]);
        let strengths = old.strengths.of_first(blocks);
        let (outer_force, kt) = (&outer_force[..blocks], &kt[..blocks]);
        match L::AMPLIFIES {
            true => chain.pull_by_differences(tau, u, v),
            false => chain.pull(tau, u, v),
        }
        if is_pulled_inside {
            for (tau, force) in tau.iter_mut().zip(outer_force) {
                *tau += force;
            }
        } else {
            tau[0] += outer_force[0];
            tau[blocks - 1] += outer_force[blocks - 1];
        }
        // Excess of each contact over its switch, whose sign bit is set if it does not switch; the bits of
        // all contacts are combined by AND.
        let mut beyond = u64::MAX;
        for n in 0..blocks {
            let slides = slip[n] != 0.0;
            let strength = strengths.at::<1, L>(n);
            let [drag] = law.drag_n(&Sliding {
                displacement_m: [u[n]],
                velocity_m_per_s: [v[n]],
                tangential_force_n: [tau[n]],
                step_over_mass_s_per_kg: dt_over_m,
                strength,
            });
            let held = kt[n] * (u[n] - u_stick[n]);
            let force = if L::HOLDS {
                // The net force on a stuck contact is zero.
                select_unpredictable(slides, tau[n] - drag, 0.0)
            } else {
                tau[n] - select_unpredictable(slides, drag, held)
            };

            let new_v = v[n] + force * dt_over_m;
            v_new[n] = new_v;
            u_new[n] = u[n] + new_v * dt;

            let detaching = if L::DETACHES_BY_SPRING { held } else { tau[n] };
            let detached_by = detaching.abs() - law.strength_n(&strength);
            let turned_by = law.turned_by(&Turn { direction: [v[n]], new_velocity_m_per_s: [new_v] });
            beyond &= select_unpredictable(slides, turned_by, detached_by).to_bits();
        }
        is_positive(beyond)
    }
}

/// Whether the sign bit is clear. Applied to the AND of the bits of several numbers: whether any of them
/// was 0 or above.
#[inline(always)]
pub(super) fn is_positive(bits: u64) -> bool {
    bits >> 63 == 0
}

/// A completed step, except for its switches. Vectors have one array per tangential freedom.
pub(crate) struct After<'a, const D: usize> {
    pub(crate) slip: &'a [f64],
    /// [`Turn::direction`], for contacts that slid in the step.
    pub(crate) direction: [&'a [f64]; D],
    pub(crate) v_new: [&'a [f64]; D],
    /// Forces by which stuck contacts detach.
    pub(crate) tau: [&'a [f64]; D],
    pub(crate) strengths: Strengths<'a>,
}

kernel! {
    /// Sets the bit of every contact that switches in a step, or may switch where contacts age. Each
    /// number has the bits of 64 contacts.
    fn switching[const D: usize, L: ContactLaw<D>](marks: &mut [u64], after: &After<'_, D>, law: &L) {
        let &After { slip, direction, v_new, tau, strengths } = after;
        for (group, mark) in marks.iter_mut().enumerate() {
            let from = group * 64;
            let to = slip.len().min(from + 64);
            let slip = &slip[from..to];
            let [direction, v_new, tau] =
                [direction, v_new, tau].map(|along| along.map(|along| &along[from..to]));
            let mut bits = 0u64;
            for n in 0..slip.len() {
                let slides = slip[n] != 0.0;
                let at = |along: [&[f64]; D]| along.map(|along| along[n]);
                let rests = law.re_attaches(&Turn { direction: at(direction), new_velocity_m_per_s: at(v_new) });
                let strength_n = law.strength_n(&strengths.at::<D, L>(from + n));
                let detaches = magnitude(at(tau)) >= strength_n;
                bits |= u64::from((slides & rests) | (!slides & detaches)) << n;
            }
            *mark = bits;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::body::elastic::Chain;
    use asperity_model::law::laws::FrictionLaw;
    use asperity_model::{Scenario, ScenarioSource};

    use super::{After, Blocks, Strengths};
    use crate::kernels::by_all;
    use crate::step::law::{ChainLoops, loops};

    /// Pseudo-random numbers, the same on every machine.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    fn strengths<'a>(threshold: &'a [f64], sliding_friction: &'a [f64]) -> Strengths<'a> {
        Strengths { threshold, sliding_friction, load: 1.0, weakening_slip: &[], memory: &[] }
    }

    const BY_SPRING: &str = "friction.detach_by = \"spring\"\n";

    /// The loops of all registered laws, the last of them by its springs, with every rule of re-attachment.
    fn all_laws() -> Vec<Arc<dyn ChainLoops>> {
        let rules = ["", "friction.reattach = \"two-way\"\n"];
        let texts = rules.iter().flat_map(|rule| {
            FrictionLaw::ALL.iter().map(move |law| format!("{rule}friction.law = {:?}\n", law.word()))
        });
        let texts = texts.chain([BY_SPRING.to_owned()]);
        let scenarios = texts.map(|text| Scenario::resolve(&ScenarioSource::new("test", &text)).unwrap());
        scenarios.map(|scenario| loops(scenario.contact_law())).collect()
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        for (blocks, law) in [1, 2, 3, 7, 8, 9, 64, 101]
            .into_iter()
            .flat_map(|blocks| all_laws().into_iter().map(move |law| (blocks, law)))
        {
            let chain = Chain { nodes: blocks, stiffness_n_per_m: 3.7, damping_kg_per_s: 0.9 };
            by_all(|| {
                let mut u = noise(1, blocks);
                let mut v = noise(2, blocks);
                let (mut tau, mut u_new, mut v_new) =
                    (vec![0.0; blocks], vec![0.0; blocks], vec![0.0; blocks]);
                let (u_stick, sliding_friction) = (noise(3, blocks), noise(4, blocks));
                let slip: Vec<f64> = noise(5, blocks).iter().map(|x| f64::from(u8::from(*x > 0.0))).collect();
                let threshold = vec![1e9; blocks];
                let mut any = Vec::new();
                for step in 0..50 {
                    let old = Blocks {
                        chain: &chain,
                        u: &u,
                        v: &v,
                        outer_force: &noise(6 + step, blocks),
                        is_pulled_inside: step % 2 == 0,
                        u_stick: &u_stick,
                        slip: &slip,
                        strengths: strengths(&threshold, &sliding_friction),
                        dt: 0.01,
                        dt_over_m: 0.013,
                        kt: &vec![2.1; blocks],
                    };
                    any.push(law.step((&mut u_new, &mut v_new), &mut tau, &old));
                    std::mem::swap(&mut u, &mut u_new);
                    std::mem::swap(&mut v, &mut v_new);
                }
                let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                (bits(&u), bits(&v), bits(&tau), any)
            });
        }
    }

    #[test]
    fn no_switch_happens_without_the_hint_of_the_step() {
        const BLOCKS: usize = 11;
        const AT: usize = 5;
        let tiny = f64::MIN_POSITIVE * f64::EPSILON;
        let numbers = [0.0, tiny, 1e-200, 0.5, 1.0 - f64::EPSILON / 2.0, 1.0, 1.0 + f64::EPSILON];
        let signed = || numbers.into_iter().flat_map(|x| [x, -x]);
        let chain = Chain { nodes: BLOCKS, stiffness_n_per_m: 0.0, damping_kg_per_s: 0.0 };
        let (mut switches, mut quiet) = (0, 0);
        let laws = all_laws();
        for (index, law) in laws.iter().enumerate() {
            let by_spring = index + 1 == laws.len();
            for (slip, v, force) in [0.0, 1.0]
                .into_iter()
                .flat_map(|s| signed().flat_map(move |v| signed().map(move |f| (s, v, f))))
            {
                // One block among others that stick without load; only the force changes its velocity.
                let alone = |x: f64| std::array::from_fn::<f64, BLOCKS, _>(|n| if n == AT { x } else { 0.0 });
                let (slip, v) = (alone(slip), alone(v));
                let old = Blocks {
                    chain: &chain,
                    u: &alone(0.0),
                    v: &v,
                    outer_force: &alone(force),
                    is_pulled_inside: true,
                    u_stick: &alone(if by_spring { -force } else { 0.0 }),
                    slip: &slip,
                    strengths: strengths(&[1.0; BLOCKS], &[0.0; BLOCKS]),
                    dt: 1.0,
                    dt_over_m: 1.0,
                    kt: &[f64::from(u8::from(by_spring)); BLOCKS],
                };
                let springs_n = alone(force);
                let (hint, marks) = by_all(|| {
                    let (mut u_new, mut v_new, mut tau) = ([0.0; BLOCKS], [0.0; BLOCKS], [0.0; BLOCKS]);
                    let hint = law.step((&mut u_new, &mut v_new), &mut tau, &old);
                    let after = After {
                        slip: &slip,
                        direction: [&v],
                        v_new: [&v_new],
                        tau: [if by_spring { &springs_n } else { &tau }],
                        strengths: old.strengths,
                    };
                    let mut marks = [0];
                    law.switching(&mut marks, &after);
                    (hint, marks)
                });
                assert!(hint || marks == [0], "{slip:?} {v:?} {force} {law:?}");
                switches += usize::from(marks != [0]);
                quiet += usize::from(!hint);
            }
        }
        assert!(switches > 100 && quiet > 100, "{switches} {quiet}");
    }
}
