//! Where a front stops behind a barrier, how long it takes, and how far the blocks have slipped then.
//!
//! A barrier is the block from which on friction falls over another slip, or else the last block of
//! `prestress.from_blocks`: the prestress is even on both sides of it.

use asperity_model::theory::front::{Front, relative_prestress};
use asperity_model::theory::weakening::Beginning;
use asperity_record::Direction;

use crate::fronts::{crossing_s, passages, unit_m};
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
    /// The same behind it.
    behind: Front,
}

impl Arrest {
    /// That of a run; `None` without barrier, if the last block slid as well, or if a block still slides at the
    /// end.
    pub(crate) fn of(run: &RunEvents) -> Option<Arrest> {
        let changes = run.plan.friction.weakening_slip_m.windows(2).rposition(|slip| slip[0] != slip[1]);
        let of_prestress = run.scenario.prestress.from_blocks.last();
        let at = changes.map(|before| before + 1).or(of_prestress.map(|block| *block as usize - 1))?;
        let last =
            run.switches.iter().rposition(Option::is_some).filter(|last| last + 1 < run.plan.blocks)?;
        if run.switches.iter().flatten().any(|[_, switched]| switched.direction == Direction::Detach) {
            return None;
        }
        Some(Arrest {
            blocks: (last + 1).saturating_sub(at) as f64,
            before: at as f64,
            is_stuck: run.scenario.friction.stuck_blocks.first() == Some(&1.0),
            front: Front::of(&run.plan, at.checked_sub(1)?)?,
            behind: Front::of(&run.plan, at)?,
        })
    }

    /// The length over that of a crack whose beginning is stuck, `n tau / |tau_b|`; `None` for pulses, and unless
    /// `tau` is above 0 and `tau_b` below.
    pub(crate) fn over_crack(&self) -> Option<f64> {
        let is_crack = self.front.top_stiffness == 0.0 && self.stops();
        is_crack.then(|| self.blocks * -self.behind.prestress / (self.before * self.front.prestress))
    }

    /// This ratio in theory, without damping.
    pub(crate) fn over_crack_theory(&self) -> Option<f64> {
        self.over_crack().filter(|_| self.is_undamped()).map(|_| if self.is_stuck { 1.0 } else { 2.0 })
    }

    /// The length of a pulse times `sqrt(gamma)`; `None` for cracks, and unless `tau` is above 0 and it, or
    /// fracture energy, ends the pulse.
    pub(crate) fn of_pulse(&self) -> Option<f64> {
        let is_pulse = self.front.top_stiffness > 0.0 && (self.stops() || self.tough().is_some());
        is_pulse.then(|| self.blocks * self.front.top_stiffness.sqrt())
    }

    /// This, over its bound without damping, `(1 + sqrt(1 - tau^2)) / |tau_b|`.
    pub(crate) fn over_pulse_bound(&self) -> Option<f64> {
        let tau = self.front.prestress;
        let length = self.of_pulse().filter(|_| self.is_undamped() && self.stops())?;
        Some(length * -self.behind.prestress / (1.0 + (1.0 - tau * tau).sqrt()))
    }

    /// `d` behind the barrier over the largest to which a pulse goes on, `tau^2 / gamma`; of a crack over `(n tau)^2`,
    /// which is `1 / s^2` of [`weakening`](asperity_model::theory::weakening).
    pub(crate) fn toughness(&self) -> Option<f64> {
        let ([d, n], tau, gamma) = (self.tough()?, self.front.prestress, self.front.top_stiffness);
        Some(if gamma > 0.0 { gamma * d / (tau * tau) } else { d / (n * tau).powi(2) })
    }

    /// The blocks of a crack behind a barrier of fracture energy, in theory.
    pub(crate) fn of_tough_crack(&self) -> Option<f64> {
        let [d, n] = self.tough().filter(|_| self.front.top_stiffness == 0.0)?;
        let beginning = if self.is_stuck { Beginning::Stuck } else { Beginning::Free };
        beginning.blocks_behind_barrier(self.front.prestress, n as u32, d)
    }

    /// `d` behind a barrier of fracture energy alone, and the blocks that slide before it: there friction falls at once,
    /// under the same `tau` above 0.
    fn tough(&self) -> Option<[f64; 2]> {
        let is_even =
            Front { weakening_slip: 0.0, ..self.behind } == self.front && self.front.prestress > 0.0;
        let n = if self.is_stuck { self.before - 1.0 } else { self.before };
        (is_even && self.behind.weakening_slip > 0.0).then_some([self.behind.weakening_slip, n])
    }

    /// Whether the prestress drives the front before the barrier, and stops it behind.
    fn stops(&self) -> bool {
        self.front.prestress > 0.0 && self.behind.prestress < 0.0
    }

    fn is_undamped(&self) -> bool {
        self.front.relative_damping == 0.0 && self.front.relative_radiation == 0.0
    }
}

/// The time from the first to the last arrival of the front from block 1, over `sqrt(m / k)`; `None` if the front may
/// go on: a block still slides at the end, and the next one is not stuck for ever.
pub(crate) fn front_duration(run: &RunEvents) -> Option<f64> {
    let passages = passages(run);
    let next = passages.len() + 1;
    let is_over = next > run.plan.blocks
        || run.scenario.friction.stuck_blocks.contains(&(next as f64))
        || passages.iter().all(|passage| passage.stop_s.is_some());
    if !is_over {
        return None;
    }
    Some((passages.last()?.arrival_s - passages.first()?.arrival_s) / crossing_s(run))
}

/// This time of a slow front, in theory.
pub(crate) fn slow_front_duration(run: &RunEvents) -> Option<f64> {
    let (front, blocks) = even_front(run)?;
    front.slow_duration(blocks)
}

/// The front from block 1, if all blocks that it passed but block 1 bear the same prestress, and how many they are.
fn even_front(run: &RunEvents) -> Option<(Front, usize)> {
    let blocks = passages(run).len();
    let front = Front::of(&run.plan, blocks.checked_sub(1)?)?;
    let differs = |tau: f64| (tau - front.prestress).abs() > 1e-9;
    let is_even = (1..blocks).all(|n| relative_prestress(&run.plan, n).is_some_and(|tau| !differs(tau)));
    is_even.then_some((front, blocks))
}

/// The sum of all displacements in the last state, over `(mu_s - mu_d) p / k`.
pub(crate) fn slip_sum(run: &RunEvents, states: &States) -> Option<f64> {
    Some(states.last_displacement_sum_m? / unit_m(run)?)
}

/// The sum at which the blocks that the front from block 1 has passed are in balance, if the next one is stuck.
pub(crate) fn static_slip_sum(run: &RunEvents) -> Option<f64> {
    let (front, blocks) = even_front(run)?;
    front.static_slip_sum(blocks)
}

#[cfg(test)]
mod tests {
    use asperity_record::FieldRecord;

    use crate::fronts::{crossing_s, passages, unit_m};
    use crate::made_up::{pulse, with_states};
    use crate::number::number;
    use crate::required_data::RequiredData;
    use crate::run_data::RunData;

    /// A barrier behind five blocks: `tau` is 0.6 before it and -0.2 behind.
    const BARRIER: &str = "slider.relative_damping = 0\nprestress.ratio = 0.6\n\
                           prestress.from_blocks = [2, 6]\nprestress.from_blocks_ratio = [0, -0.2]";

    /// Nine of twelve blocks slide, from block 1 on; four of them behind the barrier.
    #[test]
    fn lengths_are_counted_from_the_barrier() {
        let run = pulse(9, BARRIER);
        let near = |name: &str, expected: f64| {
            let found = number(name, &run, None).unwrap_or_else(|| panic!("no {name}"));
            assert!((found - expected).abs() < 1e-12, "{name}: {found}, not {expected}");
        };
        // gamma = 0.5.
        near("behind_barrier_blocks", 4.0);
        near("before_barrier_blocks", 5.0);
        near("behind_barrier_pulse_ratio", 4.0 * 0.5f64.sqrt());
        near("behind_barrier_pulse_bound_ratio", 4.0 * 0.5f64.sqrt() * 0.2 / 1.8);
        assert_eq!(number("behind_barrier_blocks", &pulse(12, BARRIER), None), None, "it did not stop");
        assert_eq!(number("behind_barrier_blocks", &pulse(9, "prestress.ratio = 0.6"), None), None);
    }

    /// These blocks with and without a drive.
    #[test]
    fn cracks_and_pulses_have_theories_of_their_own() {
        let pulse = pulse(9, BARRIER);
        let mut crack = pulse.clone();
        crack.run.plan.drive.springs.clear();
        let of = |run: &RunData| {
            ["crack_ratio", "crack_theory_ratio", "pulse_ratio", "pulse_bound_ratio"]
                .map(|name| number(&format!("behind_barrier_{name}"), run, None))
        };
        let [length, theory, of_pulse @ ..] = of(&crack);
        assert!((length.unwrap() - 4.0 * 0.2 / (5.0 * 0.6)).abs() < 1e-12, "{length:?}");
        assert_eq!((theory, of_pulse), (Some(2.0), [None, None]));
        assert!(matches!(of(&pulse), [None, None, Some(_), Some(_)]));
        // Theory is that of fronts without damping.
        let mut damped = self::pulse(9, &BARRIER.replace("damping = 0", "damping = 0.1"));
        assert!(matches!(of(&damped), [None, None, Some(_), None]));
        damped.run.plan.drive.springs.clear();
        assert!(matches!(of(&damped), [Some(_), None, None, None]));
        // 0.05 behind it.
        let weaker = self::pulse(9, &BARRIER.replace("-0.2", "-0.1375"));
        let mut driven = weaker.clone();
        driven.run.plan.drive.springs.clear();
        assert_eq!((of(&weaker), of(&driven)), ([None; 4], [None; 4]));
        assert_eq!(number("behind_barrier_blocks", &weaker, None), Some(4.0));
    }

    /// The same with `d = 3.3` behind five blocks, and even prestress: `gamma d / tau^2`, and `d / (n tau)^2` without a drive.
    #[test]
    fn barriers_of_fracture_energy_begin_where_the_slip_changes() {
        let offsets =
            "friction.weakening_slip_offsets_m = [0, 0, 0, 0, 0, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6, 1e-6]";
        let mut run = pulse(9, &format!("slider.relative_damping = 0\nprestress.ratio = 0.6\n{offsets}"));
        let near = |run: &RunData, name: &str, expected: f64| {
            let found = number(&format!("behind_barrier_{name}"), run, None).expect(name);
            assert!((found - expected).abs() < 1e-9, "{name}: {found}, not {expected}");
        };
        near(&run, "blocks", 4.0);
        near(&run, "pulse_ratio", 4.0 * 0.5f64.sqrt());
        near(&run, "fracture_ratio", 0.5 * 3.3 / 0.36);
        run.run.plan.drive.springs.clear();
        near(&run, "fracture_ratio", 3.3 / 9.0);
        assert_eq!(
            number("behind_barrier_blocks_theory", &run, None),
            None,
            "a free end, and it does not stop at once"
        );
        run.run.scenario.friction.stuck_blocks = vec![1.0];
        near(&run, "fracture_ratio", 3.3 / (4.0 * 0.6f64).powi(2));
        let s = 2.4 / 3.3f64.sqrt();
        let crack = asperity_model::theory::weakening::arrest_length(s).expect("it stops");
        near(&run, "blocks_theory", (crack / 0.6 + 0.5 * std::f64::consts::PI) * 3.3f64.sqrt());
    }

    /// A run that ends too soon has no length, and its front no duration unless a stuck block is next.
    #[test]
    fn a_front_that_still_runs_has_not_stopped() {
        let names = ["behind_barrier_blocks", "first_front_duration_ratio"];
        let of = |run: &RunData| names.map(|name| number(name, run, None).is_some());
        let mut run = pulse(9, BARRIER);
        assert_eq!(of(&run), [true, true]);
        let [first, last] = run.run.switches[8].as_mut().unwrap();
        *last = *first;
        assert_eq!(of(&run), [false, false]);
        run.run.scenario.friction.stuck_blocks = vec![10.0];
        assert_eq!(of(&run), [false, true]);
    }

    /// Of blocks that bear the same, without a drive, and of friction that weakens.
    #[test]
    fn the_balance_before_a_stuck_block_is_that_of_an_even_front() {
        let of = |run: &RunData| number("slip_sum_theory_ratio", run, None);
        let mut run = pulse(9, "prestress.ratio = 0.6");
        assert_eq!(of(&run), None, "springs of the drive bear some of it");
        run.run.plan.drive.springs.clear();
        // 1 + 2 + ... + 9 and 1 + 4 + ... + 81.
        let theory = of(&run).unwrap();
        assert!((theory - (0.4 * 45.0 + 0.6 * 285.0)).abs() < 1e-9, "{theory}");
        let mut run = pulse(9, BARRIER);
        run.run.plan.drive.springs.clear();
        assert_eq!(of(&run), None, "a barrier lies before block 9");
        let mut run = pulse(9, "prestress.ratio = 0.6\nfriction.static_coefficient = 0.45");
        run.kept |= RequiredData::STATES;
        let state = FieldRecord { displacement_m: vec![1e-6; 12], ..FieldRecord::default() };
        with_states(&mut run, &[state]);
        assert_eq!(number("slip_sum_ratio", &run, None), None, "mu_s = mu_d");
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
        assert!((sum * unit_m(&run).unwrap() / 24e-6 - 1.0).abs() < 1e-12, "{sum}");
        assert_eq!(number("slow_front_duration_theory_ratio", &run, None), None, "nothing radiates");
    }
}
