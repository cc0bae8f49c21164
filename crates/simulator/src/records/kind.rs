//! The solvers by name.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_model::law::laws::FrictionLaw;

use crate::adaptive::adaptive;
use crate::leap::fast::{ChainLeaps, Fast, LatticeLeaps};
use crate::records::solver::Solver;
use crate::step::plain::Plain;

/// The fast solver of a plan; the leaps of each body are registered here.
pub(crate) fn fast(plan: Arc<Plan>) -> Box<dyn Solver> {
    let lattice = plan.elastic;
    match lattice.as_chain() {
        Some(chain) => Box::new(Fast::<ChainLeaps>::new(plan, &chain)),
        None if lattice.tangential_axes() > 1 => Box::new(Fast::<LatticeLeaps<2>>::new(plan, &lattice)),
        None => Box::new(Fast::<LatticeLeaps<1>>::new(plan, &lattice)),
    }
}

/// The solvers by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SolverKind {
    /// The fast solver, whose cost depends on the number of switches, not of steps.
    #[default]
    Fast,
    /// [`Plain`], which takes every step.
    Plain,
    /// The solver whose steps follow the motion, for rate-and-state friction.
    Adaptive,
}

impl SolverKind {
    const ALL: [SolverKind; 3] = [SolverKind::Fast, SolverKind::Plain, SolverKind::Adaptive];

    /// The solver's name in run headers and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            SolverKind::Fast => "fast",
            SolverKind::Plain => "plain",
            SolverKind::Adaptive => "adaptive",
        }
    }

    /// The solver of that name.
    pub fn named(name: &str) -> Option<SolverKind> {
        SolverKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// The solvers of a law, its default first.
    pub fn of(law: FrictionLaw) -> &'static [SolverKind] {
        if law.sticks() { &[SolverKind::Fast, SolverKind::Plain] } else { &[SolverKind::Adaptive] }
    }

    /// A solver of this kind at the start of a plan.
    ///
    /// # Panics
    /// If it is none of those [`SolverKind::of`] the plan's law.
    pub fn start(self, plan: impl Into<Arc<Plan>>) -> Box<dyn Solver> {
        let plan: Arc<Plan> = plan.into();
        let law = plan.friction.law.word();
        assert!(SolverKind::of(law).contains(&self), "the solver {} does not solve {law:?}", self.name());
        match self {
            SolverKind::Fast => fast(plan),
            SolverKind::Plain => Box::new(Plain::new(plan)),
            SolverKind::Adaptive => adaptive(plan),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::Plan;
    use asperity_model::resolve;

    use super::SolverKind;
    use crate::kernels::by_all;
    use crate::modes::operator_cache;

    #[test]
    fn all_instruction_sets_give_the_same_records_to_the_bit() {
        let slab = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.26"];
        let block = [
            "slider.blocks=1",
            "parameter_set=as-stated",
            "time.step_s=2e-6",
            "time.duration_s=0.8",
            "drive.velocity_m_per_s=2e-3",
        ];
        let body = [
            "slider.blocks=5",
            "slider.across=3",
            "slider.rows=3",
            "slider.width_m=0.07",
            "slider.height_m=0.07",
            "slider.mass_kg=7.56",
            "drive.height_m=0.035",
            "drive.velocity_m_per_s=2e-3",
            "time.step_s=5e-6",
            "time.duration_s=0.5",
        ];
        let sheet = ["drive.velocity_m_per_s=1e-3", "time.duration_s=0.05"];
        let at_corner = "drive.across=1";
        for (scenario, set) in [
            ("default", &["parameter_set=as-coded", "time.duration_s=0.25"][..]),
            ("default", &["parameter_set=as-stated", "time.duration_s=0.25"]),
            ("default", &["parameter_set=as-coded", "slider.blocks=300", "time.duration_s=0.06"]),
            ("default", &block),
            ("slab", &slab),
            ("body-coarse", &body),
            ("body-coarse", &[&body[..], &[at_corner]].concat()),
            ("sheet-coarse", &sheet),
            ("sheet-coarse", &[&sheet[..], &[at_corner]].concat()),
            ("seas-bp1-qd-coarse", &["time.duration_s=6.13e9", "recording.series_every=100"]),
        ] {
            let scenario = resolve(scenario, set).unwrap_or_else(|error| panic!("{error}"));
            let plan = Arc::new(Plan::new(&scenario));
            let (_, counters) = by_all(|| {
                operator_cache::HERE.forget_all();
                let mut solver = SolverKind::of(plan.friction.law.word())[0].start(Arc::clone(&plan));
                // Debug output distinguishes finite doubles to the bit.
                let mut records = Vec::new();
                while let Some(record) = solver.next_record().unwrap() {
                    records.push(format!("{record:?}"));
                }
                (records, solver.counters())
            });
            assert!(
                counters.jumps + counters.adaptive_steps > 1 && counters.switches > 5,
                "{set:?} {counters:?}"
            );
        }
    }
}
