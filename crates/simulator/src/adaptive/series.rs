//! Series: the solver's own steps, at the exact times at which they end.
//!
//! A row is recorded once the next step is known, behind all records of grid steps up to its time, so that a run that
//! continues from a checkpoint, which lies within a step, neither lacks a row nor has one twice.

use std::sync::Arc;

use asperity_record::{Record, Row, Series, SeriesBlock};

use crate::adaptive::Adaptive;
use crate::adaptive::motion::{DriveAndLoad, Motion};

impl<M: Motion> Adaptive<M> {
    /// Records the accepted step of a length that ends where this one begins, or else where it ends, if it is one of
    /// those that the plan asks for. Grid steps up to `until_step` may have records before it.
    pub(super) fn record_series(&mut self, is_begin: bool, step_s: f64, until_step: u64) {
        let every = self.plan.recording.series_every;
        if every == 0 {
            return;
        }
        let plan = Arc::clone(&self.plan);
        let (at, time_s) = if is_begin { (&self.begin, self.time_s) } else { (&self.end, self.end_s()) };
        let (time_s, number) = (time_s.value(), self.accepted_steps + u64::from(!is_begin));
        let before = plan.initial.adaptive.as_ref().map_or(0, |initial| initial.accepted_steps);
        let grid = plan.grid;
        let is_last = !is_begin || self.stopped.is_some() || self.end_s().value() > grid.time_s(plan.steps);
        let is_due = number == before + 1 || number.is_multiple_of(every) || is_last;
        if number <= before || !is_due {
            return;
        }
        let passed = grid.first_step_from(time_s.next_up()).saturating_sub(1);
        let step = passed.clamp(self.slider.step, until_step);
        // No course has a knot between a grid step and the time.
        let (piece, later_s) = (DriveAndLoad::from_step(&plan, step), time_s - grid.time_s(step));
        let moved_m = later_s * (piece.drive_m_per_s + 0.5 * later_s * piece.drive_m_per_s2);
        let point_m = plan.outside(step, self.slider.hold_step).point_m + moved_m;
        let velocity = |n: usize| M::velocity(&at.contacts, n);
        let speeds = (0..plan.blocks).map(|n| (n, velocity(n).abs()));
        let (fastest, v_max_m_per_s) =
            speeds.fold((0, 0.0), |most, at| if at.1 > most.1 { at } else { most });
        let weight = |n: usize| plan.medium.as_ref().map_or(1.0, |medium| medium.weight(n));
        let sum_m_per_s: f64 = (0..plan.blocks).map(|n| weight(n) * velocity(n)).sum();
        self.recorder.ready.push_back(Record::Row(Row::new(Series {
            step,
            time_s,
            solver_step: number,
            step_s,
            v_max_m_per_s,
            v_max_block: fastest as u32 + 1,
            moment_rate_n_m_per_s: plan.elastic.stiffness_n_per_m * plan.spacing_m * sum_m_per_s,
        })));
        for n in plan.recording.series_blocks.iter().copied() {
            let [friction_n, friction_ratio, state, theta_s] = self.motion.friction_of(at, n);
            self.recorder.ready.push_back(Record::Row(Row::new(SeriesBlock {
                step,
                time_s,
                block: n as u32 + 1,
                slip_m: at.at.0[n] + point_m,
                velocity_m_per_s: velocity(n),
                friction_n,
                friction_ratio,
                state,
                theta_s,
            })));
        }
    }
}
