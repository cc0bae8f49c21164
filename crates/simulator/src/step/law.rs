//! Loops of the solvers over all contacts, compiled for each contact law.
//!
//! A plan's law is chosen where a solver is made; from there on one call through [`ContactLoops`] or
//! [`ChainLoops`] goes over all contacts.

use std::fmt::Debug;
use std::sync::Arc;

use asperity_model::law::laws::Law;
use asperity_model::law::{ContactLaw, Sliding, Stepped, WithLaw};
use asperity_model::{Plan, SliderState};

use crate::kernels::{self, After, Blocks, ContactInputs, Moved, StepWork, Strengths};

/// The loops over the contacts of any body, with `D` tangential freedoms each.
pub(crate) trait ContactLoops<const D: usize>: Debug + Send + Sync {
    /// Friction of all contacts of a lattice; returns whether any may switch.
    fn apply_friction(&self, contacts: &mut ContactInputs<'_, D>) -> bool;
    /// Sets the bit of every contact that switches in a step, or may switch if contacts age.
    fn switching(&self, marks: &mut [u64], after: &After<'_, D>);
    /// Power of the part of friction whose work is fracture energy, in a step of these contacts to new velocities.
    fn fracture_w(&self, contacts: &Rubbing<'_, D>, v_new: [&[f64]; D]) -> f64;
    /// Updates the memory of all contacts after a step, for a law with memory, given their `mu_d p` in the
    /// step and the contacts that switched, ascending.
    fn remember(&self, plan: &Plan, state: &mut SliderState, sliding_friction: &[f64], switched: &[usize]);
}

/// Contacts in a step, before it.
pub(crate) struct Rubbing<'a, const D: usize> {
    pub(crate) u: [&'a [f64]; D],
    pub(crate) v: [&'a [f64]; D],
    pub(crate) tau: [&'a [f64]; D],
    pub(crate) slip: &'a [f64],
    pub(crate) strengths: Strengths<'a>,
    pub(crate) dt_over_m: f64,
}

/// The loops over the nodes of a chain, where every node carries a contact.
pub(crate) trait ChainLoops: ContactLoops<1> {
    /// Takes one step; returns whether any contact may switch.
    fn step(&self, new: (&mut [f64], &mut [f64]), tau: &mut [f64], old: &Blocks<'_>) -> bool;
    /// Energy changes of a step.
    fn step_work(&self, moved: &Moved<'_>) -> StepWork;
}

impl<const D: usize, L: ContactLaw<D>> ContactLoops<D> for L {
    fn apply_friction(&self, contacts: &mut ContactInputs<'_, D>) -> bool {
        kernels::apply_friction(contacts, self)
    }

    fn switching(&self, marks: &mut [u64], after: &After<'_, D>) {
        kernels::switching(marks, after, self);
    }

    fn fracture_w(&self, contacts: &Rubbing<'_, D>, v_new: [&[f64]; D]) -> f64 {
        let at = |along: [&[f64]; D], n: usize| along.map(|along| along[n]);
        let power = |n: usize| {
            let force_n = self.fracture_n(&Sliding {
                displacement_m: at(contacts.u, n),
                velocity_m_per_s: at(contacts.v, n),
                tangential_force_n: at(contacts.tau, n),
                step_over_mass_s_per_kg: contacts.dt_over_m,
                strength: contacts.strengths.at::<D, L>(n),
            });
            force_n.into_iter().zip(at(v_new, n)).map(|(force, v)| force * v).sum::<f64>()
        };
        (0..contacts.slip.len()).filter(|n| contacts.slip[*n] != 0.0).map(power).sum()
    }

    fn remember(&self, plan: &Plan, state: &mut SliderState, sliding_friction: &[f64], switched: &[usize]) {
        let nodes = plan.elastic.nodes();
        let mut switched = switched.iter().peekable();
        for (n, memory) in state.memory.chunks_exact_mut(L::MEMORY).enumerate() {
            let after = Stepped {
                step: state.step,
                step_s: plan.grid.step_s(),
                switched: switched.next_if_eq(&&n).is_some(),
                slides: state.slip[n] != 0.0,
                displacement_m: std::array::from_fn(|axis| state.displacement_m[axis * nodes + n]),
                velocity_m_per_s: std::array::from_fn(|axis| state.velocity_m_per_s[axis * nodes + n]),
                friction_n: sliding_friction[n],
            };
            ContactLaw::remember(self, &after, memory);
        }
    }
}

impl<L: ContactLaw> ChainLoops for L {
    fn step(&self, (u_new, v_new): (&mut [f64], &mut [f64]), tau: &mut [f64], old: &Blocks<'_>) -> bool {
        kernels::step(u_new, v_new, tau, old, self)
    }

    fn step_work(&self, moved: &Moved<'_>) -> StepWork {
        kernels::step_work(moved, self)
    }
}

/// The loops for the law of a plan whose contacts cover an area.
///
/// # Panics
/// If the law has no form for these; scenarios refuse that.
pub(crate) fn loops_over_area(law: Law) -> Arc<dyn ContactLoops<2>> {
    Arc::new(law.over_area().expect("a scenario has a law that is known over an area"))
}

/// The loops for the law of a plan.
pub(crate) fn loops(law: Law) -> Arc<dyn ChainLoops> {
    struct Compiled;
    impl WithLaw for Compiled {
        type Output = Arc<dyn ChainLoops>;
        fn with<L: ContactLaw>(self, law: L) -> Arc<dyn ChainLoops> {
            Arc::new(law)
        }
    }
    law.with(Compiled)
}
