//! Where a front stops behind a barrier, how long it takes, and how far the blocks have slipped then.
//!
//! A barrier is the last block of `prestress.from_blocks`: the prestress is even on both sides of it.

use asperity_model::front::{Front, relative_prestress};

use crate::fronts::{crossing_s, passages, theory, unit_m};
use crate::run_data::RunEvents;
use crate::states::States;

/// A front behind a barrier.
pub(crate) struct Arrest {
    /// How many blocks behind the barrier slid.
    pub(crate) blocks: f64,
    /// How many blocks are before it.
    pub(crate) before: f64,
    /// Whether block 1 never slides.
    is_stuck: bool,
    /// The front before it.
    front: Front,
    /// Size of `tau` behind it.
    behind: f64,
}

impl Arrest {
    /// That of a run; `None` without barrier, or if the last block slid as well.
    pub(crate) fn of(run: &RunEvents) -> Option<Arrest> {
        let at = *run.scenario.prestress.from_blocks.last()? as usize - 1;
        let last =
            run.switches.iter().rposition(Option::is_some).filter(|last| last + 1 < run.plan.blocks)?;
        Some(Arrest {
            blocks: (last + 1).saturating_sub(at) as f64,
            before: at as f64,
            is_stuck: run.scenario.friction.stuck_blocks.first() == Some(&1.0),
            front: Front::of(&run.plan, at.checked_sub(1)?)?,
            behind: relative_prestress(&run.plan, at)?.abs(),
        })
    }

    /// The length over that of a crack whose beginning is stuck, `n tau / |tau_b|`.
    pub(crate) fn over_crack(&self) -> f64 {
        self.blocks * self.behind / (self.before * self.front.prestress)
    }

    /// This ratio in theory.
    pub(crate) fn over_crack_theory(&self) -> f64 {
        if self.is_stuck { 1.0 } else { 2.0 }
    }

    /// The length of a pulse times `sqrt(gamma)`.
    pub(crate) fn of_pulse(&self) -> f64 {
        self.blocks * self.front.top_stiffness.sqrt()
    }

    /// This, over its bound `(1 + sqrt(1 - tau^2)) / |tau_b|`.
    pub(crate) fn over_pulse_bound(&self) -> f64 {
        let tau = self.front.prestress;
        self.of_pulse() * self.behind / (1.0 + (1.0 - tau * tau).sqrt())
    }
}

/// The time from the first to the last arrival of the front from block 1, over `sqrt(m / k)`.
pub(crate) fn front_duration(run: &RunEvents) -> Option<f64> {
    let passages = passages(run);
    Some((passages.last()?.arrival_s - passages.first()?.arrival_s) / crossing_s(run))
}

/// This time of a slow front, in theory.
pub(crate) fn slow_front_duration(run: &RunEvents) -> Option<f64> {
    theory(run)?.slow_duration(passages(run).len())
}

/// The sum of all displacements in the last state, over `(mu_s - mu_d) p / k`.
pub(crate) fn slip_sum(run: &RunEvents, states: &States) -> Option<f64> {
    Some(states.last_displacement_sum_m()? / unit_m(run))
}

/// The sum at which the blocks that the front from block 1 has passed are in balance, if the next one is stuck.
pub(crate) fn static_slip_sum(run: &RunEvents) -> Option<f64> {
    Some(theory(run)?.static_slip_sum(passages(run).len()))
}

#[cfg(test)]
mod tests {
    use asperity_record::FieldRecord;

    use crate::fronts::{crossing_s, passages, unit_m};
    use crate::made_up::{pulse, with_states};
    use crate::number::number;
    use crate::required_data::RequiredData;

    /// Nine of twelve blocks slide, from block 1 on; four of them behind the barrier.
    #[test]
    fn lengths_are_counted_from_the_barrier() {
        let text =
            "prestress.ratio = 0.6\nprestress.from_blocks = [2, 6]\nprestress.from_blocks_ratio = [0, -0.2]";
        let run = pulse(9, text);
        let near = |name: &str, expected: f64| {
            let found = number(name, &run, None).unwrap_or_else(|| panic!("no {name}"));
            assert!((found - expected).abs() < 1e-12, "{name}: {found}, not {expected}");
        };
        // tau = 0.6 before and -0.2 behind, gamma = 0.5.
        near("behind_barrier_blocks", 4.0);
        near("before_barrier_blocks", 5.0);
        near("behind_barrier_crack_theory_ratio", 2.0);
        near("behind_barrier_crack_ratio", 4.0 * 0.2 / (5.0 * 0.6));
        near("behind_barrier_pulse_ratio", 4.0 * 0.5f64.sqrt());
        near("behind_barrier_pulse_bound_ratio", 4.0 * 0.5f64.sqrt() * 0.2 / 1.8);
        assert_eq!(number("behind_barrier_blocks", &pulse(12, text), None), None, "it did not stop");
        assert_eq!(number("behind_barrier_blocks", &pulse(9, "prestress.ratio = 0.6"), None), None);
    }

    /// The last of two states counts.
    #[test]
    fn duration_and_sum_of_slip_are_those_of_the_front_and_of_the_end() {
        let mut run = pulse(9, "prestress.ratio = 0.6");
        run.kept |= RequiredData::STATES;
        let state = |step: u64, displacement_m: f64| FieldRecord {
            step,
            displacement_m: vec![displacement_m; 12],
            ..FieldRecord::default()
        };
        with_states(&mut run, &[state(0, 0.0), state(5, 2e-6)]);
        let passages = passages(&run);
        let took = (passages[8].arrival_s - passages[0].arrival_s) / crossing_s(&run);
        assert_eq!(number("first_front_duration_ratio", &run, None), Some(took));
        let sum = number("slip_sum_ratio", &run, None).unwrap();
        assert!((sum * unit_m(&run) / 24e-6 - 1.0).abs() < 1e-12, "{sum}");
        // 1 + 2 + ... + 9 and 1 + 4 + ... + 81.
        let theory = number("slip_sum_theory_ratio", &run, None).unwrap();
        assert!((theory - (0.4 * 45.0 + 0.6 * 285.0)).abs() < 1e-9, "{theory}");
        assert_eq!(number("slow_front_duration_theory_ratio", &run, None), None, "nothing radiates");
    }
}
