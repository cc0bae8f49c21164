//! Polynomials and modes of recent propagators, reused by the next run with the same one.
//!
//! Computing them takes milliseconds, as long as the rest of a short run. The runs of a study mostly
//! differ in friction, load or start, on which neither depends. So a process caches the most recently
//! used ones, up to [`MOST_BYTES`]. A cached result is used only for an equal propagator, so
//! that a run does not depend on the runs before it.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use asperity_model::Plan;
use asperity_model::body::elastic::Chain;

use crate::leap::chebyshev::Chebyshev;
use crate::modes::Modes;
use crate::modes::propagator::Propagator;

/// Bound on the memory of the cache: some 20 chains of 100 blocks, or four of 256.
const MOST_BYTES: usize = 48 << 20;

/// Cached results, the most recently used first.
#[derive(Debug, Default)]
pub(crate) struct OperatorCache(Mutex<VecDeque<Arc<Found>>>);

/// The cache of this process.
pub(crate) static HERE: OperatorCache = OperatorCache(Mutex::new(VecDeque::new()));

/// Results for one propagator.
#[derive(Debug)]
struct Found {
    map: Propagator,
    basis: OnceLock<Arc<Chebyshev>>,
    /// `None` where the modes do not span the states.
    modes: OnceLock<Option<Arc<Modes>>>,
}

impl Found {
    fn bytes(&self) -> usize {
        let modes = self.modes.get().and_then(Option::as_ref);
        self.basis.get().map_or(0, |basis| basis.bytes()) + modes.map_or(0, |modes| modes.bytes())
    }
}

impl OperatorCache {
    /// Without any results, for a test that wants them anew.
    #[cfg(test)]
    pub(crate) fn forget_all(&self) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }

    /// The polynomials of windows.
    pub(crate) fn basis(&self, plan: &Plan, chain: &Chain) -> Arc<Chebyshev> {
        let found = self.of(Propagator::of(plan, chain));
        let basis = Arc::clone(found.basis.get_or_init(|| Arc::new(Chebyshev::of(&found.map))));
        self.forget_oldest();
        basis
    }

    /// The modes of the stuck chain, if they span its states well enough.
    pub(crate) fn modes(&self, plan: &Plan, chain: &Chain) -> Option<Arc<Modes>> {
        let found = self.of(Propagator::of(plan, chain));
        let modes = found.modes.get_or_init(|| Modes::of(&found.map)).clone();
        self.forget_oldest();
        modes
    }

    /// The entry of a propagator. Results are computed without holding the lock, so that other
    /// propagators need not wait; a second user of the same one waits for the first.
    fn of(&self, map: Propagator) -> Arc<Found> {
        let mut cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let known = cache.iter().position(|found| found.map == map);
        let found = match known.and_then(|index| cache.remove(index)) {
            Some(found) => found,
            None => Arc::new(Found { map, basis: OnceLock::new(), modes: OnceLock::new() }),
        };
        cache.push_front(Arc::clone(&found));
        found
    }

    fn forget_oldest(&self) {
        let mut cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut bytes: usize = cache.iter().map(|found| found.bytes()).sum();
        while bytes > MOST_BYTES {
            let Some(oldest) = cache.pop_back() else { return };
            bytes -= oldest.bytes();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use asperity_model::body::ends::EndBond;
    use asperity_model::{End, Plan, Scenario, ScenarioSource};

    use super::{MOST_BYTES, OperatorCache};
    use crate::leap::chebyshev::Chebyshev;
    use crate::leap::fast::{ChainLeaps, Fast};
    use crate::modes::Modes;
    use crate::modes::propagator::Propagator;
    use crate::records::solver::Solver;

    fn plan(set: &[&str]) -> Plan {
        let source = ScenarioSource::new(
            "test",
            "parameter_set = \"as-coded\"\ntime.duration_s = 0.1\nslider.blocks = 10",
        );
        let source = set.iter().fold(source, |source, value| source.with_override(value));
        Plan::new(&Scenario::resolve(&source).unwrap())
    }

    fn basis(cache: &OperatorCache, plan: &Plan) -> Arc<Chebyshev> {
        cache.basis(plan, &plan.elastic.as_chain().unwrap())
    }

    fn modes(cache: &OperatorCache, plan: &Plan) -> Option<Arc<Modes>> {
        cache.modes(plan, &plan.elastic.as_chain().unwrap())
    }

    #[test]
    fn what_no_map_depends_on_is_found_once_and_all_else_anew() {
        let cache = OperatorCache::default();
        let first = (basis(&cache, &plan(&[])), modes(&cache, &plan(&[])).unwrap());
        for set in [
            "normal_load.tilt=0.5",
            "friction.static_coefficient=0.9",
            "initial_shear.beta=0.3",
            "time.duration_s=0.2",
            "drive.velocity_m_per_s=1e-3",
        ] {
            let again = (basis(&cache, &plan(&[set])), modes(&cache, &plan(&[set])).unwrap());
            assert!(Arc::ptr_eq(&again.0, &first.0) && Arc::ptr_eq(&again.1, &first.1), "{set}");
        }
        for set in [
            "time.step_s=2e-8",
            "slider.mass_kg=12.000000000000002",
            "slider.blocks=11",
            "slider.relative_damping=3",
            "friction.interfacial_stiffness_ratio=0.9",
            "drive.stiffness_n_per_m=4.1e6",
            "drive.kind=top",
            "slider.left_end=clamped",
            "slider.right_end=absorbing",
            "friction.detach_by=spring",
        ] {
            let other = plan(&[set]);
            let found = (basis(&cache, &other), modes(&cache, &other).unwrap());
            assert!(!Arc::ptr_eq(&found.0, &first.0) && !Arc::ptr_eq(&found.1, &first.1), "{set}");
            // Cached results equal fresh ones to the bit, except for the sign of zero.
            let alone = Modes::of(&Propagator::of(&other, &other.elastic.as_chain().unwrap())).unwrap();
            assert_eq!(format!("{:?}", found.1), format!("{alone:?}"), "{set}");
        }
        let again = modes(&cache, &plan(&[])).unwrap();
        assert!(Arc::ptr_eq(&again, &first.1), "it was used, and there is room");
    }

    #[test]
    fn a_map_that_differs_in_one_bit_of_anything_is_another() {
        let plan = plan(&[]);
        let map = Propagator::of(&plan, &plan.elastic.as_chain().unwrap());
        let up = |number: &mut f64| *number = number.next_up();
        let changes: [&dyn Fn(&mut Propagator); 9] = [
            &|map| up(&mut map.step_s),
            &|map| up(&mut map.block_mass_kg),
            &|map| up(&mut map.radiation_kg_per_s),
            &|map| up(&mut map.springs_n_per_m[9]),
            &|map| up(&mut map.stiffest_spring_n_per_m),
            &|map| up(&mut map.drive_n_per_m[9]),
            &|map| up(&mut map.stiffest_drive_n_per_m),
            &|map| map.detaches_by_spring = true,
            &|map| map.end_bonds = EndBond::of([End::Free, End::Clamped], &map.chain, 1.0, &[0.0; 10]),
        ];
        for change in changes {
            let mut other = map.clone();
            change(&mut other);
            assert_ne!(other, map);
        }
    }

    #[test]
    fn memory_is_bounded_and_the_oldest_goes_first() {
        let cache = OperatorCache::default();
        let bytes = || cache.0.lock().unwrap().iter().map(|found| found.bytes()).sum::<usize>();
        let of = |blocks: usize| plan(&[&format!("slider.blocks={blocks}")]);
        let used = Arc::downgrade(&basis(&cache, &of(2)));
        let unused = Arc::downgrade(&basis(&cache, &of(3)));
        let mut largest = 0;
        for blocks in 4..70 {
            drop(basis(&cache, &of(2)));
            drop(basis(&cache, &of(blocks)));
            largest = largest.max(bytes());
            assert!(bytes() <= MOST_BYTES, "{blocks}: {}", bytes());
        }
        assert!(largest > MOST_BYTES / 2, "{largest}: nothing had to go");
        assert!(unused.upgrade().is_none() && used.upgrade().is_some());
    }

    #[test]
    fn a_run_after_others_is_the_run_alone() {
        let run = |plan: &Plan| {
            let mut solver =
                Fast::<ChainLeaps>::new(Arc::new(plan.clone()), &plan.elastic.as_chain().unwrap());
            let mut records = Vec::new();
            while let Some(record) = solver.next_record().unwrap() {
                records.push(format!("{record:?}"));
            }
            assert!(solver.counters().windows > 0 && solver.counters().jumps > 0);
            records
        };
        let plans =
            ["normal_load.tilt=0", "normal_load.tilt=0.4", "friction.interfacial_stiffness_ratio=0.7"]
                .map(|set| plan(&[set, "time.duration_s=1"]));
        let first: Vec<_> = plans.iter().map(run).collect();
        let again: Vec<_> = plans.iter().rev().map(run).collect();
        assert!(first.iter().eq(again.iter().rev()));
    }
}
