//! How the solver goes through zones: opens them, goes on behind them, and puts the chain together
//! again.

use std::sync::Arc;

use asperity_record::Record;

use super::{Fast, Leap, opened};
use crate::cost;
use crate::counters::Counters;
use crate::jump::Jump;
use crate::solver::{SimulationError, Solver};
use crate::state::ChainState;
use crate::stepper::Stepper;
use crate::zone::{self, Extent, QUIET_STEPS, QUIET_STEPS_GOING_ON, Zone, Zones};

impl Fast {
    /// Opens a zone, if some blocks slide, and one is worth it and certified.
    pub(super) fn open_zone(&mut self) -> bool {
        let (Some(zones), Some(jump)) = (&mut self.zones, &mut self.jump) else { return false };
        let state = self.stepper.state();
        let Some((active, extent)) = zones.next(&self.plan, state, jump.modes_steps()) else { return false };
        let first = zone::first_of_state(state, extent.end);
        let mut stuck = state.clone();
        zone::stick(&self.plan, &mut stuck, jump, extent.calm_from);
        let is_certified = jump.open_behind(&self.plan, &stuck, extent.cut, extent.steps) >= extent.steps;
        let cost_steps = jump.cost_steps();
        self.pay(cost_steps);
        if is_certified {
            *self.stepper.state_mut() = stuck;
            self.begin_zone(first, extent, active);
        } else {
            let state = self.stepper.state_mut();
            state.no_jump_before_step = state.step + zone::PATIENCE_STEPS;
        }
        is_certified
    }

    /// Opens a zone where a jump ends, if that can go on behind it.
    pub(super) fn open_zone_behind_jump(&mut self, steps: u64) -> bool {
        let (Some(zones), Some(jump)) = (&mut self.zones, &mut self.jump) else { return false };
        let state = self.stepper.state();
        let step = state.step + steps;
        if !jump.can_go_on(state) {
            return false;
        }
        let active = jump.nearest_block(&self.plan, state) + 1;
        let waves_steps = jump.modes_steps();
        let Some(extent) = zones.next_going_on(&self.plan, active, state, step, waves_steps) else {
            return false;
        };
        let most_steps = steps + extent.steps;
        if jump.certify(&self.plan, state, extent.cut, most_steps) < most_steps {
            return false;
        }
        let mut first = zone::first_of_state(state, extent.end);
        let landed = jump.land_first(steps);
        first.displacement_m.copy_from_slice(&landed.displacement_m[..extent.end]);
        first.velocity_m_per_s.copy_from_slice(&landed.velocity_m_per_s[..extent.end]);
        first.step = step;
        // One for the forces, and one to foresee from.
        first.single_steps = first.single_steps.max(2);
        self.begin_zone(first, extent, active);
        true
    }

    /// Has the first blocks stepped alone, of which that is the state; that of all is where their jump
    /// begins.
    fn begin_zone(&mut self, first: ChainState, extent: Extent, active: usize) {
        let (Some(zones), Some(jump)) = (&mut self.zones, &self.jump) else { return };
        let goes_on = extent.cut <= jump.first_blocks();
        let part = Arc::new(zones.plan_of(&self.plan, extent));
        let window = self.window.for_blocks_of(&part);
        let mut solver = Fast::without_jumps(part, window, self.sweeps);
        solver.restore(&first);
        solver.until_step = first.step + extent.steps;
        solver.quiet_steps = if goes_on { QUIET_STEPS_GOING_ON } else { QUIET_STEPS };
        zones.in_a_row += 1;
        zones.open = Some(Zone {
            first: Box::new(solver),
            from_step: first.step,
            extent,
            active,
            as_foreseen_until: first.step,
        });
    }

    /// The next record of the zone that is open; `None` where it ends, and the chain is whole again.
    pub(super) fn next_of_zone(&mut self) -> Result<Option<Record>, SimulationError> {
        let Some(zone) = self.zones.as_mut().and_then(|zones| zones.open.as_mut()) else { return Ok(None) };
        let Some(record) = zone.first.next_record()? else {
            if let Err(debt_steps) = self.go_on_behind_zone() {
                self.close_zone();
                let state = self.stepper.state_mut();
                state.single_steps = state.single_steps.max(cost::pause_steps(debt_steps));
            }
            return Ok(None);
        };
        match record {
            Record::Step(ref step) => {
                let last = step.switches.iter().map(|switch| switch.block as usize).max().unwrap_or(0);
                zone.active = zone.active.max(last);
                if last > 0 {
                    // It no longer waits for waves to become calm.
                    zone.first.quiet_steps = zone.first.quiet_steps.min(QUIET_STEPS);
                }
                if last > zone.extent.calm_from {
                    zone.first.until_step = step.step;
                }
                Ok(Some(record))
            }
            Record::Fields(fields) => {
                let state = self.stepper.state();
                let rest = go_on(&mut self.aside, &mut self.jump, state, fields.step);
                Ok(Some(Record::Fields(zone.whole(fields, rest, &state.stick_position_m))))
            }
            other => Ok(Some(other)),
        }
    }

    /// Where a zone ends and all of its blocks stick, has its jump go on with what they have become:
    /// over all of the chain, or beside them for some more steps. If it cannot, what was spent on that
    /// and not saved before.
    ///
    /// Not while a block slides: in the jump it would stick in between, and what is added for that would
    /// be as large as its slip, and round like it.
    fn go_on_behind_zone(&mut self) -> Result<(), u64> {
        let (Some(zones), Some(jump)) = (&mut self.zones, &mut self.jump) else { return Err(0) };
        let waves_steps = jump.modes_steps();
        let Some(zone) = &zones.open else { return Err(0) };
        let (cut, last_switch_step) = (zone.extent.cut, zone.first.last_switch_step);
        let first = zone.first.stepper.state();
        let (step, hold_step) = (first.step, first.hold_step);
        let slides = first.detached > 0 || first.sliding > 0;
        if slides || step + 1 >= self.until_step || cut > jump.first_blocks() || !jump.can_go_on(first) {
            return Err(0);
        }
        let state = self.stepper.state_mut();
        let Some(next) = zones.next_going_on(&self.plan, zone.active, state, step, waves_steps) else {
            return Err(0);
        };
        state.hold_step = hold_step;
        let changed_step = (last_switch_step > zone.as_foreseen_until).then_some(last_switch_step);
        let former = jump.go_on(&self.plan, first, cut, changed_step, state);
        let last_step = (self.until_step - 1).min(self.plan.steady_until_step(step, hold_step));
        let steps = jump.certify_all(&self.plan, state, last_step - step);
        if steps > 0 {
            state.saved_steps = first.saved_steps;
            self.count_zone();
            self.leap = Some(Leap::Jump { steps });
            self.is_inside = false;
            self.recorder.continue_after(&self.plan, self.stepper.state());
            return Ok(());
        }
        self.counters.refused_jumps += 1;
        let cost_steps = jump.cost_steps();
        let quiet_steps = step + jump.patience_steps() - last_switch_step;
        let Some(zone) = &mut zones.open else { return Err(0) };
        let debt_steps = cost::pay(&mut zone.first.stepper.state_mut().saved_steps, cost_steps);
        if debt_steps == 0 && zone.first.until_step - step > QUIET_STEPS_GOING_ON {
            // The steps for which the reach holds are not used up.
            (zone.as_foreseen_until, zone.first.quiet_steps) = (step, quiet_steps);
            return Ok(());
        }
        if debt_steps > 0 || jump.certify(&self.plan, state, next.cut, next.steps) < next.steps {
            jump.go_back(former, state);
            return Err(debt_steps);
        }
        // What has come from the end of the zone is not felt before the cut.
        let known = cut.min(next.end);
        let mut first = zone::first_of_state(zone.first.stepper.state(), known);
        let landed = jump.land_first(0);
        first.displacement_m.extend_from_slice(&landed.displacement_m[known..next.end]);
        first.velocity_m_per_s.extend_from_slice(&landed.velocity_m_per_s[known..next.end]);
        first.stick_position_m.extend_from_slice(&state.stick_position_m[known..next.end]);
        first.tangential_force_n.resize(next.end, 0.0);
        first.slip.resize(next.end, 0.0);
        // One for the forces, and one to foresee from.
        first.single_steps = first.single_steps.max(2);
        let active = zone.active;
        self.count_zone();
        self.begin_zone(first, next, active);
        if let Some(zone) = self.zones.as_mut().and_then(|zones| zones.open.as_mut()) {
            (zone.first.last_switch_step, zone.first.quiet_steps) = (last_switch_step, quiet_steps);
        }
        Ok(())
    }

    /// Whether the jump that is open has gone on behind a zone: one of a whole chain ends their row.
    pub(super) fn has_gone_on(&self) -> bool {
        self.leap.is_some() && self.zones.as_ref().is_some_and(|zones| zones.in_a_row > 0)
    }

    /// Takes the zone away, and counts what was done in it.
    fn count_zone(&mut self) -> Option<Zone<Fast>> {
        let zone = self.zones.as_mut()?.open.take()?;
        let zone_steps = zone.first.stepper.state().step - zone.from_step;
        self.counters = self.counters + Counters { zones: 1, zone_steps, ..zone.first.counters() };
        Some(zone)
    }

    /// Puts the chain together again, which was paid for as the zone was opened.
    fn close_zone(&mut self) {
        let Some(zone) = self.count_zone() else { return };
        let first = zone.first.stepper.state();
        let rest = go_on(&mut self.aside, &mut self.jump, self.stepper.state(), first.step);
        zone.join(first, rest, self.stepper.state_mut());
        let must_rest = self.zones.as_ref().is_some_and(Zones::must_rest);
        self.stepper.state_mut().whole_until_switch |= must_rest;
        self.recorder.continue_after(&self.plan, self.stepper.state());
    }

    /// The state of all blocks, put together where it is in parts.
    pub(super) fn whole_state(&self) -> ChainState {
        let mut state = self.stepper.state().clone();
        let Some(zones) = &self.zones else { return state };
        if let Some(zone) = &zones.open {
            let first = zone.first.stepper.state();
            let rest = go_on(&mut self.aside.clone(), &mut self.jump.clone(), &state, first.step).clone();
            zone.join(first, &rest, &mut state);
        } else if self.has_gone_on() {
            opened(&mut self.jump.clone()).land(0, &mut state);
        }
        state
    }
}

/// The chain that sticks, behind a step; in that in which its jump began without the forces.
fn go_on<'a>(
    aside: &'a mut Stepper,
    jump: &mut Option<Jump>,
    stuck: &ChainState,
    step: u64,
) -> &'a ChainState {
    aside.state_mut().clone_from(stuck);
    let into = step - stuck.step;
    opened(jump).land(into.saturating_sub(1), aside.state_mut());
    if into > 0 {
        aside.take_step();
    }
    aside.state()
}
