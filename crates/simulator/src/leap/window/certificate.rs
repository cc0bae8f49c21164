//! How far a window may extend: as far as no block can switch.
//!
//! Each block has a guard `g`, the number that decides its switch: the force `tau_n` while it is stuck, or that of its
//! friction spring where that detaches it,
//! its velocity while it slides. The guard after `i` steps is the same sum over the guards of the terms,
//! and its second difference is that of `A^i D_2`, at most `Q = sum_j max_i |c_j(i)| |g(w_j)|`. Between
//! two steps `h` apart a guard is therefore within `Q h^2 / 8` of the chord and, from the window's first
//! step, within `Q i^2 / 2` of its tangent. A window extends only as far as one of these bounds keeps
//! every stuck block below its threshold and every sliding block in its direction: first over the window
//! as a whole and, for the few blocks that fail, over its halves, their halves, and so on.

use std::cell::Cell;

use asperity_model::{Plan, SliderState};

use crate::kernels::{self, Course, Reserve, margin};
use crate::leap::chebyshev::MOST_STEPS;
use crate::leap::norms::{Norms, ROUNDING};
use crate::leap::window::expansion::{Expansion, Sizes};
use crate::step::strength::StopForce;

/// One guard over a window: its value and rate at the start, its kind, its terms and their unit, and its reserve.
struct Guard<'a> {
    expansion: &'a Expansion,
    now: f64,
    rate: f64,
    sigma: f64,
    threshold: f64,
    terms: Vec<f64>,
    unit: f64,
    reserve: &'a Reserve,
    /// Number of places at which it was evaluated.
    places: Cell<u64>,
}

/// A guard at the start of a window, or at the end of a length.
struct Place {
    index: Option<usize>,
    steps: u64,
    guard: f64,
    /// Bound on its second differences up to there.
    bend: f64,
}

/// The work arrays for certificates.
#[derive(Debug, Clone)]
pub(super) struct Certificate {
    norms: Norms,
    /// Contribution of the terms to the guards at the end of the window, and the bounds on their second
    /// differences.
    end: Vec<f64>,
    bend: Vec<f64>,
    /// Distance of each block from switching over the whole window.
    margin: Vec<f64>,
    /// Number of guards evaluated singly, per place, since this was last reset.
    pub(super) places: u64,
}

impl Certificate {
    pub(super) fn new(plan: &Plan) -> Certificate {
        let one_each = || vec![0.0; plan.blocks];
        Certificate {
            norms: Norms::of(plan),
            end: one_each(),
            bend: one_each(),
            margin: one_each(),
            places: 0,
        }
    }

    /// The longest of the lengths up to `index` over which the bounds exclude a switch.
    pub(super) fn longest(
        &mut self,
        plan: &Plan,
        state: &SliderState,
        expansion: &Expansion,
        mut index: usize,
        sizes: &Sizes,
        ends: [[f64; 2]; 2],
    ) -> Option<usize> {
        let dt = plan.grid.step_s();
        let &Sizes { now: [u_scale, v_scale], rate: [du, dv], first_term: first, .. } = sizes;
        let &Expansion { blocks, terms, .. } = expansion;
        loop {
            let length = &expansion.basis.lengths[index];
            let steps = length.steps as f64;
            if sizes.are_negligible(length.left_out_of(terms, ends)) {
                let norms = ends.map(|[u, v]| self.norms.at_most(blocks, u, v / dt));
                let out = |factors: [f64; 2]| factors[0] * norms[0] + factors[1] * norms[1];
                let (bend, sum) = (out(length.left_out(terms)), out(length.left_out_of_sum(terms)));
                // Sizes of the cancelling parts of a state, which determine its rounding. Terms grow or
                // fall monotonically along the basis, so the ends suffice.
                let largest =
                    |part: usize| length.largest * first[part].max(ends[0][part]).max(ends[1][part]);
                let rounding = self.norms.force_rounding(
                    u_scale + steps * du + largest(0),
                    v_scale + steps * dv + largest(1) / dt,
                );
                let Norms { force, velocity, drive, .. } = self.norms;
                if let Some(stop) = StopForce::of(plan, state.hold_step) {
                    let reserve = Reserve {
                        stuck_bend: drive * bend,
                        stuck: drive * sum + rounding * plan.blocks as f64,
                        sliding_bend: 0.0,
                        sliding: 0.0,
                    };
                    index = Guard::of_drive(plan, state, expansion, stop, &reserve).certified(index)?;
                }
                let length = &expansion.basis.lengths[index];
                let steps = length.steps as f64;
                let reserve = Reserve {
                    stuck_bend: force * bend,
                    stuck: force * sum + rounding,
                    sliding_bend: velocity * bend,
                    sliding: velocity * sum + ROUNDING * v_scale + rounding * dt / plan.block_mass_kg * steps,
                };
                let certified = self.certified_by(plan, expansion, index, &reserve);
                // Near a switch, single steps soon reach it.
                if certified != Err(true) || expansion.foreseen_steps() < MOST_STEPS as f64 {
                    return certified.ok();
                }
                // In a long window the cancelling parts may far exceed their sum. The reserve for that
                // is a sixteenth for a window of a quarter of the steps.
                let lengths = &expansion.basis.lengths[..index];
                index =
                    lengths.partition_point(|length| length.steps as f64 <= steps / 4.0).checked_sub(1)?;
                continue;
            }
            // With the same number of terms, fewer steps leave out less.
            index = index.checked_sub(1)?;
        }
    }

    /// The longest certified length, with the reserve of the length `index`; the error is whether at the start of the
    /// window a block is closer to switching than the reserve.
    fn certified_by(
        &mut self,
        plan: &Plan,
        expansion: &Expansion,
        index: usize,
        reserve: &Reserve,
    ) -> Result<usize, bool> {
        let &Expansion { blocks, terms, .. } = expansion;
        let length = &expansion.basis.lengths[index];
        let (now, rate) = expansion.first_guard.both(blocks);
        kernels::follow(
            &mut self.end,
            &mut self.bend,
            expansion.guard.all(),
            expansion.guard.pitch,
            [&expansion.basis.double_sum(length.steps)[..terms], &length.whole[..terms]],
        );
        let (stuck_unit, sliding_unit) = expansion.units(plan);
        let course = Course {
            now,
            rate,
            sum: &self.end,
            bend: &self.bend,
            stuck_unit,
            sliding_unit,
            sigma: &expansion.sigma,
            threshold: &expansion.strength.threshold_n,
            decline: expansion.ramp.decline(length.steps as f64),
            steps: length.steps as f64,
            reserve,
        };
        if !kernels::margins(&mut self.margin, &course) {
            return Ok(index);
        }
        let mut best = index;
        for (n, margin) in self.margin.iter().enumerate() {
            let stays = *margin > 0.0;
            if stays {
                continue;
            }
            let guard = Guard::of_block(plan, expansion, n, reserve);
            let certified = guard.certified(best);
            self.places += guard.places.get();
            best = certified.ok_or_else(|| match guard.sigma == 0.0 {
                true => (1.0 - ROUNDING) * guard.threshold - guard.now.abs() <= reserve.stuck,
                false => guard.sigma * guard.now <= reserve.sliding,
            })?;
        }
        Ok(best)
    }
}

impl<'a> Guard<'a> {
    /// That of block `n`.
    fn of_block(plan: &Plan, expansion: &'a Expansion, n: usize, reserve: &'a Reserve) -> Guard<'a> {
        let (stuck_unit, sliding_unit) = expansion.units(plan);
        let terms = expansion.guard.all()[n..].iter().step_by(expansion.guard.pitch);
        Guard {
            expansion,
            now: expansion.first_guard.row(0)[n],
            rate: expansion.first_guard.row(1)[n],
            sigma: expansion.sigma[n],
            threshold: expansion.strength.threshold_n[n],
            terms: terms.take(expansion.terms).copied().collect(),
            unit: if expansion.sigma[n] == 0.0 { stuck_unit } else { sliding_unit },
            reserve,
            places: Cell::new(0),
        }
    }

    /// The sum of the driving forces, whose limit is the value at which the drive stops.
    fn of_drive(
        plan: &Plan,
        state: &SliderState,
        expansion: &'a Expansion,
        stop: StopForce,
        reserve: &'a Reserve,
    ) -> Guard<'a> {
        let springs = &plan.drive.springs;
        let pull = |row: &[f64]| -springs.iter().map(|s| s.stiffness_n_per_m * row[s.block]).sum::<f64>();
        let outside = plan.outside(state.step + 1, state.hold_step);
        Guard {
            expansion,
            now: plan.drive.total_force_n(outside.point_m, expansion.first_u.row(0)),
            rate: plan.drive.total_force_n(outside.advance_m(), expansion.first_u.row(1)),
            sigma: 0.0,
            threshold: stop.under_n(expansion.ramp.load),
            terms: (0..expansion.terms).map(|term| pull(expansion.u.row(term))).collect(),
            unit: 1.0,
            reserve,
            places: Cell::new(0),
        }
    }

    /// The longest of the lengths up to `longest` over which it stays within its limit, part by part.
    fn certified(&self, longest: usize) -> Option<usize> {
        let start = Place { index: None, steps: 0, guard: self.now, bend: f64::NAN };
        match self.stays_clear(&start, &self.at(longest)) {
            Ok(()) => Some(longest),
            Err(index) => index,
        }
    }

    /// Evaluates it at the end of a length.
    fn at(&self, index: usize) -> Place {
        self.places.set(self.places.get() + 1);
        let Expansion { basis, .. } = self.expansion;
        let length = &basis.lengths[index];
        let [sum, bend] = kernels::products(&self.terms, basis.double_sum(length.steps), &length.whole);
        let guard = self.now + length.steps as f64 * self.rate + self.unit * sum;
        Place { index: Some(index), steps: length.steps, guard, bend: self.unit * bend }
    }

    /// Whether it stays within its limit between two places, as a whole or in halves. If not, the
    /// error is the last length up to which it does.
    fn stays_clear(&self, from: &Place, to: &Place) -> Result<(), Option<usize>> {
        let &Guard { rate, sigma, threshold, unit, reserve, .. } = self;
        let Expansion { basis, ramp, .. } = self.expansion;
        let steps = (to.steps - from.steps) as f64;
        // The tangent is known only at the start of the window.
        let tangent = if from.steps == 0 { from.guard + steps * rate } else { f64::NAN };
        let thresholds = [from, to].map(|place| threshold * ramp.decline(place.steps as f64));
        let stays =
            |bend: f64| margin(from.guard, to.guard, tangent, steps, bend, sigma, thresholds, reserve) > 0.0;
        if stays(to.bend) {
            return Ok(());
        }
        let next = from.index.map_or(0, |index| index + 1);
        let between = &basis.lengths[next..to.index.unwrap_or(next)];
        if between.is_empty() {
            // Between neighbouring lengths the sharper bound applies.
            let length = &basis.lengths[next];
            let [_, bend] = kernels::products(&self.terms, basis.double_sum(length.steps), &length.last);
            return if stays(unit * bend) { Ok(()) } else { Err(from.index) };
        }
        let middle_steps = from.steps + (to.steps - from.steps) / 2;
        let below = between.partition_point(|length| length.steps <= middle_steps);
        let middle = self.at(next + below.saturating_sub(1));
        self.stays_clear(from, &middle)?;
        self.stays_clear(&middle, to)
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::Guard;
    use crate::kernels::{Reserve, margin};
    use crate::leap::cost::GRID_STEPS;
    use crate::leap::window::expansion::Expansion;

    #[test]
    fn a_guard_is_certified_as_far_as_length_by_length_and_stays_clear_so_far() {
        const TERMS: usize = 20;
        let reserve = Reserve { stuck_bend: 0.0, sliding_bend: 0.0, stuck: 0.0, sliding: 0.0 };
        // Pseudo-random numbers, the same on every machine.
        let mut seed = 1u64;
        let mut noise = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let (mut whole, mut part) = (0, 0);
        for set in ["parameter_set=as-coded", "parameter_set=as-stated"] {
            let source = ScenarioSource::new("test", "parameter_set = \"as-coded\"").with_override(set);
            let plan = Plan::new(&Scenario::resolve(&source).unwrap());
            let expansion = Expansion::new(&plan, &plan.elastic.as_chain().unwrap());
            let lengths = &expansion.basis.lengths;
            let longest = lengths.len() - 1;
            let steps = lengths[longest].steps as f64;
            for sigma in [0.0, 1.0, -1.0].repeat(200) {
                let terms: Vec<f64> = (0..TERMS).map(|j| noise() * libm::exp(-0.5 * j as f64)).collect();
                let now = if sigma == 0.0 { noise() } else { sigma * (0.01 + noise().abs()) };
                let guard = Guard {
                    expansion: &expansion,
                    now,
                    rate: 2.0 * noise() / steps,
                    sigma,
                    threshold: 0.55,
                    terms: terms.clone(),
                    unit: 8.0 * noise().abs() / (steps * steps),
                    reserve: &reserve,
                    places: Cell::new(0),
                };
                let at = |i: u64| {
                    let sum: f64 = terms.iter().zip(expansion.basis.double_sum(i)).map(|(x, s)| x * s).sum();
                    guard.now + i as f64 * guard.rate + guard.unit * sum
                };
                let certified = guard.certified(longest);

                let mut one_by_one = None;
                let (mut from, mut from_steps) = (guard.now, 0);
                for (index, length) in lengths.iter().enumerate() {
                    let steps = (length.steps - from_steps) as f64;
                    let bend: f64 = terms.iter().zip(&length.last).map(|(x, c)| x.abs() * c).sum();
                    let tangent = if from_steps == 0 { from + steps * guard.rate } else { f64::NAN };
                    let to = at(length.steps);
                    let bend = guard.unit * bend;
                    if margin(from, to, tangent, steps, bend, sigma, [0.55, 0.55], &reserve) <= 0.0 {
                        break;
                    }
                    one_by_one = Some(index);
                    (from, from_steps) = (to, length.steps);
                }
                assert!(certified >= one_by_one, "{certified:?} {one_by_one:?}");
                match certified {
                    Some(index) if index == longest => whole += 1,
                    _ => part += 1,
                }
                let certified_steps = certified.map_or(0, |index| lengths[index].steps);
                for i in (0..=certified_steps).step_by(GRID_STEPS as usize) {
                    let clear = if sigma == 0.0 { at(i).abs() < 0.55 } else { sigma * at(i) > 0.0 };
                    assert!(clear, "{i} of {certified_steps}: {} {sigma}", at(i));
                }
            }
        }
        assert!(whole > 100 && part > 100, "{whole} {part}");
    }
}
