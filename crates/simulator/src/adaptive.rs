//! The solver for rate-and-state friction, whose steps follow the motion: seconds between ruptures, nanoseconds
//! within.
//!
//! `motion` says what equations and methods are to the loop in this file. Of a chain, `equations` has the equations of
//! motion, `linear` the systems of their derivatives, `rodas4` the steps; of a line in a medium, `line` the equations,
//! `convolution` its stress, `dormand_prince` the steps. Nothing sticks; a block *slides* from where its speed rises above the event speed `V_th` until it falls below half of it.
//! These crossings are its detachments and re-attachments, found on the method's polynomial through a step, whose
//! error is of the order of `h^4` or less, as the estimate that bounds the step.
//!
//! The grid of `time.step_s` is that of the records: a crossing is recorded in the first grid step after it, and what
//! is due in a grid step is read off the cubics. So recording never changes a trajectory. `series` records the solver's
//! own steps.

mod convolution;
mod dormand_prince;
mod equations;
mod line;
mod linear;
mod motion;
mod rodas4;
mod series;

use std::sync::Arc;

use asperity_model::law::rate_and_state::MOST_STATE;
use asperity_model::plan::outside::Driving;
use asperity_model::{AdaptiveState, Crossing, Plan, SliderState, Sum};

use crate::adaptive::equations::Equations;
use crate::adaptive::line::Line;
use crate::adaptive::motion::{DriveAndLoad, Method, Motion, StepEnd, Unknowns};
use crate::records::counters::Counters;
use crate::records::pace::{Pace, Snapshot};
use crate::records::recorder::{Recorder, at_block};
use crate::records::solver::{Next, SimulationError, Solver};
use crate::records::stop::{Stop, steps_between_looks};

/// Shortest step, s. A reversal takes steps of 1e-20 s; shorter ones cannot come from finite numbers.
const SHORTEST_STEP_S: f64 = 1e-200;

/// What a step of varying length costs, rejected ones included, in steps of the grid by the other solvers.
const GRID_STEPS_OF_A_STEP: u64 = 64;

/// Most steps, rejected ones included, from one grid step to the next: a reversal takes thousands, a run far more in
/// seconds, but seconds are many grid steps.
const MOST_STEPS: u32 = 1_000_000;

/// A re-attachment happens at the event speed times this.
const HYSTERESIS: f64 = 0.5;

/// A solver at the start of a plan of rate-and-state friction.
pub(crate) fn adaptive(plan: Arc<Plan>) -> Box<dyn Solver> {
    match &plan.medium {
        Some(_) => Box::new(Adaptive::<Line>::new(plan)),
        None => Box::new(Adaptive::<Equations>::new(plan)),
    }
}

/// Solves rate-and-state friction by steps of varying length.
#[derive(Debug, Clone)]
struct Adaptive<M: Motion> {
    plan: Arc<Plan>,
    motion: M,
    method: M::Method,
    event_speed_m_per_s: f64,
    /// The slider at the last grid step that was recorded.
    slider: SliderState,
    recorder: Recorder,
    /// Where the step in which the slider is begins, and its length.
    time_s: Sum,
    step_s: f64,
    /// How many accepted steps end up to its beginning.
    accepted_steps: u64,
    next_step_s: f64,
    begin: StepEnd<M>,
    end: StepEnd<M>,
    /// The beginning of the piece of the courses of drive and load in which the step is.
    piece: DriveAndLoad,
    /// Whether each block is above the event speed at the end of the step.
    is_above: Vec<bool>,
    /// Crossings after the last grid step, ascending.
    crossings: Vec<Crossing>,
    /// For states within a step.
    within: Unknowns,
    /// The grid step that time has passed last, and the steps since.
    passed: (u64, u32),
    /// Why it cannot continue.
    stopped: Option<SimulationError>,
    counters: Counters,
}

impl<M: Motion> Adaptive<M> {
    fn new(plan: Arc<Plan>) -> Adaptive<M> {
        let law = plan.friction.law.rate_and_state().expect("the plan has rate-and-state friction");
        let motion = M::of(&plan, law);
        let zeros = Unknowns(vec![0.0; AdaptiveState::unknowns(&plan)]);
        let slider = SliderState { adaptive: None, ..plan.initial.clone() };
        let mut solver = Adaptive {
            recorder: Recorder::new(&plan, &slider, 0.0),
            time_s: Sum::default(),
            step_s: 0.0,
            accepted_steps: 0,
            next_step_s: 0.0,
            begin: StepEnd::new(zeros.clone(), &motion),
            end: StepEnd::new(zeros.clone(), &motion),
            piece: DriveAndLoad::default(),
            is_above: vec![false; plan.blocks],
            crossings: Vec::new(),
            within: zeros,
            passed: (0, 0),
            stopped: None,
            counters: Counters::default(),
            event_speed_m_per_s: law.event_speed_m_per_s,
            method: M::Method::new(&motion, &plan, law.tolerance),
            motion,
            slider,
            plan,
        };
        let plan = Arc::clone(&solver.plan);
        solver.continue_from(plan.initial.adaptive.as_ref().expect("the state of an adaptive solver"));
        if plan.given.is_some() {
            solver.begin_in();
        }
        solver
    }

    /// Counts the energies of a run that begins in a given state from there, within a step.
    fn begin_in(&mut self) {
        self.look_at(self.slider.step);
        let from = AdaptiveState::energies_from(&self.plan);
        let before_j = self.within.0[from..].to_vec();
        for unknowns in [&mut self.begin.at, &mut self.end.at, self.method.end(), &mut self.within] {
            let energies_j = unknowns.0[from..].iter_mut().zip(&before_j);
            energies_j.for_each(|(energy_j, before_j)| *energy_j -= before_j);
        }
        let energy = self.motion.energy(&self.within, &self.slider);
        if self.plan.medium.is_some() {
            // What the slip that another run left causes takes a convolution.
            let forces_n = self.slider.tangential_force_n.iter_mut().enumerate();
            forces_n.for_each(|(n, force_n)| *force_n = self.motion.tangential_force_n(n));
            self.recorder = Recorder::new(&self.plan, &self.slider, 0.0);
        }
        self.recorder.begin_sliding(&self.plan, &self.slider, energy);
    }

    /// Brings unknowns and equations to a grid step within the step; returns the share of the step up to it.
    fn look_at(&mut self, step: u64) -> f64 {
        let share = self.share_of(step);
        let Adaptive { method, begin, within, .. } = &mut *self;
        for (place, unknown) in within.0.iter_mut().enumerate() {
            *unknown = method.within(&begin.at, share, place);
        }
        let outside = self.piece.at(self.plan.grid.time_s(step));
        self.motion.evaluate(&mut self.within, outside);
        share
    }

    /// Continues from a state that was saved at the grid step of the slider.
    fn continue_from(&mut self, saved: &AdaptiveState) {
        let plan = Arc::clone(&self.plan);
        self.time_s = saved.time_s;
        self.next_step_s = saved.next_step_s;
        self.accepted_steps = saved.accepted_steps;
        self.passed = (plan.grid.first_step_from(saved.time_s.value()).saturating_sub(1), 0);
        self.stopped = None;
        self.crossings.clone_from(&saved.crossings);
        self.begin.at.0.clone_from(&saved.unknowns);
        // The piece of the courses in which the step begins, which may be before the run; a step ends at a knot.
        self.begin_piece(0);
        while self.piece.until_step < plan.steps
            && self.seconds_to(plan.grid.time_s(self.piece.until_step)) <= 0.0
        {
            self.begin_piece(self.piece.until_step);
        }
        self.begin.prepare(&mut self.motion, self.piece.at(self.time_s.value()));
        for (n, is_above) in self.is_above.iter_mut().enumerate() {
            let switches = self.crossings.iter().filter(|crossing| crossing.block as usize == n).count();
            *is_above = (self.slider.slip[n] != 0.0) != (switches % 2 == 1);
        }
        self.step_s = saved.step_s;
        if self.step_s == 0.0 {
            self.end.clone_from(&self.begin);
            self.find_crossings(false);
        } else {
            self.method.step(&mut self.motion, &self.begin, self.step_s);
            self.close_step();
        }
    }

    /// Begins the piece of the courses at a grid step.
    fn begin_piece(&mut self, step: u64) {
        self.piece = DriveAndLoad::from_step(&self.plan, step);
        self.motion.begin_piece(&self.plan, step);
    }

    /// Ends the step that was computed last, and takes the derivatives for the next one.
    fn close_step(&mut self) {
        let outside = self.piece.at(self.end_s().value());
        self.method.close(&mut self.motion, &mut self.end, outside);
    }

    /// When the step ends.
    fn end_s(&self) -> Sum {
        let mut end_s = self.time_s;
        end_s.add(self.step_s);
        end_s
    }

    /// Takes the next step, as long as its error allows, and finds the crossings in it.
    fn advance(&mut self) -> Result<(), SimulationError> {
        let plan = Arc::clone(&self.plan);
        self.count_peak(1.0);
        let mut end_s = self.end_s();
        if self.piece.until_step != u64::MAX {
            let knot_s = plan.grid.time_s(self.piece.until_step);
            if self.seconds_to(knot_s) <= self.step_s {
                end_s = Sum { total: knot_s, rest: 0.0 };
                self.begin_piece(self.piece.until_step);
            }
        }
        self.time_s = end_s;
        self.accepted_steps += u64::from(self.step_s > 0.0);
        if end_s.value() > plan.grid.time_s(self.passed.0 + 1) {
            self.passed = (plan.grid.first_step_from(end_s.value()) - 1, 0);
        }
        std::mem::swap(&mut self.begin, &mut self.end);
        if self.piece.from_s == end_s.value() {
            // Drive and load may have turned, and a prestress that jumps takes velocities with it.
            self.begin.prepare(&mut self.motion, self.piece.at(end_s.value()));
            self.find_crossings(true);
        }
        let left_s = match self.piece.until_step {
            u64::MAX => f64::INFINITY,
            knot => self.seconds_to(plan.grid.time_s(knot)),
        };
        loop {
            let step_s =
                self.next_step_s.min(left_s).min(M::Method::longest_step_s(&self.motion, &self.begin));
            if step_s < SHORTEST_STEP_S {
                return Err(self.overflow());
            }
            if self.passed.1 == MOST_STEPS {
                return Err(SimulationError::Stalled(format!(
                    "the adaptive solver took a million steps after step {} without passing the next multiple of \
                     time.step_s = {:e} s (accepted: a shorter time.step_s, or a larger time.tolerance)",
                    self.passed.0,
                    plan.grid.step_s()
                )));
            }
            self.passed.1 += 1;
            let error = self.method.step(&mut self.motion, &self.begin, step_s);
            self.next_step_s = M::Method::next_step_s(self.next_step_s, step_s, error);
            if error <= 1.0 {
                self.step_s = step_s;
                break;
            }
            if error.is_nan() {
                self.state_overflow().map_or(Ok(()), Err)?;
            }
            self.counters.rejected_steps += 1;
        }
        self.counters.adaptive_steps += 1;
        self.close_step();
        self.find_crossings(false);
        Ok(())
    }

    /// The share of the step after which a grid step ends; 0 before the step, and 1 behind it.
    fn share_of(&self, step: u64) -> f64 {
        let share = self.seconds_to(self.plan.grid.time_s(step)) / self.step_s;
        // Before the first step it is 0 / 0.
        if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) }
    }

    /// Counts the speeds from the last recorded grid step up to a share of the step, in which the law was evaluated: of
    /// the blocks that are fastest there and at the beginning.
    fn count_peak(&mut self, to: f64) {
        let from = self.share_of(self.slider.step);
        let at_end = if to == 1.0 { &self.end.contacts } else { self.motion.contacts() };
        let [first, last] = [&self.begin.contacts, at_end].map(|contacts| {
            let speeds = (0..self.plan.blocks).map(|n| (n, M::velocity(contacts, n).abs()));
            speeds.fold((0, 0.0), |most, at| if at.1 > most.1 { at } else { most })
        });
        let mut peak = self.slider.peak_velocity_m_per_s.unwrap_or(0.0).max(last.1);
        let slides = first.1.max(last.1) > HYSTERESIS * self.event_speed_m_per_s;
        if slides && from < to {
            peak = peak.max(self.peak_within(first.0, from, to));
            if last.0 != first.0 {
                peak = peak.max(self.peak_within(last.0, from, to));
            }
        }
        self.slider.peak_velocity_m_per_s = Some(peak);
    }

    /// The largest speed of block `n` between two shares of the step: at one of them, or at the vertex of parabolas
    /// through ever closer points.
    fn peak_within(&self, n: usize, mut low: f64, mut high: f64) -> f64 {
        let at = M::Method::speed_within(self, n);
        let [mut begin, mut end] = [low, high].map(&at);
        let mut peak = begin.max(end);
        for _ in 0..3 {
            let middle = at(0.5 * (low + high));
            let bend = begin - 2.0 * middle + end;
            let vertex = 0.5 * (low + high) - 0.25 * (high - low) * (end - begin) / bend;
            if bend >= 0.0 || !(low..high).contains(&vertex) {
                break;
            }
            peak = peak.max(at(vertex));
            let reach = 0.1 * (high - low);
            (low, high) = ((vertex - reach).max(low), (vertex + reach).min(high));
            [begin, end] = [low, high].map(&at);
        }
        peak
    }

    /// From the beginning of the step to a time.
    fn seconds_to(&self, time_s: f64) -> f64 {
        (time_s - self.time_s.total) - self.time_s.rest
    }

    /// The run cannot continue: a node whose state, at the beginning of the step, is too large for velocities.
    fn state_overflow(&self) -> Option<SimulationError> {
        let a = &self.plan.medium.as_ref()?.direct_effect;
        let over_a = |n: &usize| self.motion.friction_of(&self.begin, *n)[2] / a[*n];
        let n = (0..a.len()).find(|n| over_a(n).abs() > MOST_STATE)?;
        Some(SimulationError::NotFinite(format!(
            "in step {} node {} gets psi / a = {:.1}, beyond which velocities are no longer finite (accepted: |psi / a| \
             up to {MOST_STATE})",
            self.plan.grid.first_step_from(self.time_s.value()),
            n + 1,
            over_a(&n)
        )))
    }

    /// The run cannot continue: the block with the fastest change.
    fn overflow(&self) -> SimulationError {
        let rate = |n: &usize| self.begin.rates.0[self.plan.blocks + n].abs();
        let block = (0..self.plan.blocks).max_by(|a, b| rate(a).total_cmp(&rate(b))).unwrap_or(0);
        let step = self.plan.grid.first_step_from(self.time_s.value());
        at_block("the rate of friction", step, &self.slider, block)
    }

    /// Finds the crossings within the step that was taken last, or by a jump at its beginning; at the start, the blocks
    /// above the event speed.
    fn find_crossings(&mut self, at_begin: bool) {
        let event_speed = self.event_speed_m_per_s;
        for n in 0..self.plan.blocks {
            let is_above = self.is_above[n];
            let bound = if is_above { HYSTERESIS * event_speed } else { event_speed };
            let there = if at_begin { &self.begin } else { &self.end };
            if (M::velocity(&there.contacts, n).abs() > bound) == is_above {
                continue;
            }
            self.is_above[n] = !is_above;
            let mut time_s = self.time_s;
            if !at_begin {
                time_s.add(self.step_s * self.crossing(n, bound, is_above));
            }
            let block = n as u32;
            // After the grid steps that the beginning of the step has passed, and once by a block in a grid step.
            let passed_s = self.time_s.value().next_up();
            let last = self.crossings.iter().rev().find(|crossing| crossing.block == block);
            let after = last.map_or(0, |crossing| crossing.step.saturating_add(1));
            let [passed, crossed] =
                [passed_s, time_s.value()].map(|at_s| self.plan.grid.first_step_from(at_s));
            let step = crossed.max(passed).max(after);
            let crossing = Crossing { step, block };
            let place = self.crossings.partition_point(|other| *other < crossing);
            self.crossings.insert(place, crossing);
        }
    }

    /// The share of the step after which the speed of block `n` crosses a bound.
    fn crossing(&self, n: usize, bound: f64, is_above: bool) -> f64 {
        let (mut before, mut after, speed) = (0.0, 1.0, M::Method::speed_within(self, n));
        // 50 halvings reach the spacing of doubles.
        for _ in 0..50 {
            let middle = 0.5 * (before + after);
            if (speed(middle) > bound) == is_above {
                before = middle;
            } else {
                after = middle;
            }
        }
        after
    }

    /// Moves the slider to a grid step within the step, and records it.
    fn record(&mut self, step: u64) -> Result<(), SimulationError> {
        let plan = Arc::clone(&self.plan);
        let share = self.look_at(step);
        self.count_peak(share);
        let was_sliding = self.slider.sliding > 0;
        let slider = &mut self.slider;
        self.counters.covered_steps += step - slider.step;
        slider.step = step;
        slider.sliding = slider.detached;
        let point_m = plan.outside(step, slider.hold_step).point_m;
        let at = &self.within.0;
        let states = &at[AdaptiveState::energies_from(&plan) - plan.blocks..];
        for n in 0..plan.blocks {
            slider.displacement_m[n] = at[n] + point_m;
            slider.velocity_m_per_s[n] = M::velocity(self.motion.contacts(), n);
            slider.tangential_force_n[n] = self.motion.tangential_force_n(n);
            slider.friction_state[n] = states[n];
        }
        if !plan.has_given_loads() {
            slider.normal_load_n = plan.outside(step, slider.hold_step).loads_n();
        }
        let due = self.crossings.partition_point(|crossing| crossing.step <= step);
        let mut switched = Vec::new();
        for crossing in self.crossings.drain(..due) {
            let n = crossing.block as usize;
            slider.detached = if slider.slip[n] == 0.0 { slider.detached + 1 } else { slider.detached - 1 };
            slider.slip[n] = 1.0 - slider.slip[n];
            slider.stick_position_m[n] = slider.displacement_m[n];
            switched.push(n);
        }
        self.counters.switches += switched.len() as u64;
        let edge = was_sliding != (slider.sliding > 0);
        let energy = self.motion.energy(&self.within, slider);
        let springs = plan.drive.springs.iter();
        let total_n = springs.map(|spring| -spring.stiffness_n_per_m * at[spring.block]).sum();
        let driving = Driving { total_n, ..Driving::default() };
        if self.recorder.record(&plan, &self.slider, driving, energy, &switched, edge)? {
            let speeds = self.slider.velocity_m_per_s.iter().map(|v| v.abs());
            self.slider.peak_velocity_m_per_s = Some(speeds.fold(0.0, f64::max));
        }
        if step == plan.steps && self.end_s().value() == plan.grid.time_s(step) {
            self.record_series(false, self.step_s, step);
        }
        Ok(())
    }
}

impl<M: Motion> Solver for Adaptive<M> {
    fn next_record_unless(&mut self, stop: &Stop<'_>) -> Result<Next, SimulationError> {
        let steps = steps_between_looks(&self.plan) / GRID_STEPS_OF_A_STEP + 1;
        let mut left = steps;
        loop {
            if !self.recorder.is_empty() {
                return self.recorder.next();
            }
            if let Some(error) = &self.stopped {
                return Err(error.clone());
            }
            if self.slider.step >= self.plan.steps {
                return Ok(Next::End);
            }
            let is_edge = (self.slider.sliding > 0) != (self.slider.detached > 0);
            let edge_step = if is_edge { self.slider.step + 1 } else { u64::MAX };
            let crossing_step = self.crossings.first().map_or(u64::MAX, |crossing| crossing.step);
            let due_step = self.recorder.due_step().min(edge_step).min(crossing_step);
            if self.seconds_to(self.plan.grid.time_s(due_step)) <= self.step_s {
                self.record(due_step)?;
                continue;
            }
            if left == 0 {
                if stop.look() {
                    return Ok(Next::Stopped);
                }
                left = steps;
            }
            left -= 1;
            let step_s = self.step_s;
            self.stopped = self.advance().err();
            self.record_series(true, step_s, due_step - 1);
        }
    }

    fn step(&self) -> u64 {
        self.slider.step
    }

    /// Not while its step begins behind the last grid step that was recorded, which it cannot reach any more.
    fn is_between_records(&self) -> bool {
        let is_behind = self.seconds_to(self.plan.grid.time_s(self.slider.step)) < 0.0;
        self.recorder.is_empty() && !is_behind
    }

    fn snapshot(&self) -> Snapshot {
        let adaptive = AdaptiveState {
            time_s: self.time_s,
            accepted_steps: self.accepted_steps,
            step_s: self.step_s,
            next_step_s: self.next_step_s,
            unknowns: self.begin.at.0.clone(),
            crossings: self.crossings.clone(),
        };
        let slider = SliderState { adaptive: Some(Box::new(adaptive)), ..self.slider.clone() };
        Snapshot { slider, pace: Pace::default() }
    }

    fn counters(&self) -> Counters {
        self.counters
    }

    fn restore(&mut self, snapshot: &Snapshot) {
        let adaptive = snapshot.slider.adaptive.as_ref().expect("the state of an adaptive solver");
        self.slider = SliderState { adaptive: None, ..snapshot.slider.clone() };
        self.recorder.continue_after(&self.plan, &self.slider);
        self.continue_from(adaptive);
    }
}
