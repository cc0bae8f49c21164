//! How long forces that change linearly in time stay clear of their limits.
//!
//! It is the last part of every certificate: of a chain at rest ([`crate::leap::rest`]) and of jumps by any body.
//! Oscillations around the linear part, and reserves for rounding, are subtracted from the margin first.

use asperity_model::law::magnitude;
use asperity_model::plan::load::{Load, Ramp};

use crate::leap::norms::ROUNDING;
use crate::step::strength::StopForce;

/// Steps until the first of some forces may meet its limit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clearance {
    least_steps: f64,
}

impl Clearance {
    /// Without any force yet.
    pub(crate) const ENDLESS: Clearance = Clearance { least_steps: f64::INFINITY };

    /// Adds a force that changes by `rate` in a step, and must stay between `-room` and `room`, which falls
    /// by `fall` in a step. Returns false if it is outside now, or NaN.
    #[inline]
    pub(crate) fn stays_between(&mut self, force: f64, rate: f64, room: f64, fall: f64) -> bool {
        for (way, closing) in [(room - force, rate + fall), (room + force, fall - rate)] {
            self.close_in(way, closing);
        }
        // Written so that NaN certifies nothing.
        force.abs() < room
    }

    /// Adds a force along `D` axes whose magnitude must stay below such a room.
    ///
    /// The magnitude of a force that is linear in time is convex, so what remains of the room is concave: it
    /// stays above 0 up to any step in which it is, if it is now.
    #[inline]
    pub(crate) fn stays_within<const D: usize>(
        &mut self,
        force: [f64; D],
        rate: [f64; D],
        room: f64,
        fall: f64,
    ) -> bool {
        if D == 1 {
            return self.stays_between(force[0], rate[0], room, fall);
        }
        let size = magnitude(force);
        // `|force + t rate| = room - t fall` for the first time at `t = c / (b + root(b^2 + a c))`.
        let speed = magnitude(rate);
        let b = force.iter().zip(rate).map(|(force, rate)| force * rate).sum::<f64>() + room * fall;
        let (a, c) = ((speed - fall) * (speed + fall), (room - size) * (room + size));
        let closing = b + (b * b + a * c).max(0.0).sqrt();
        if closing > 0.0 && c < self.least_steps * closing {
            let mut steps = (c / closing).floor();
            // Rounding may have placed it too far.
            let is_within = |steps: f64| {
                let mut ahead = force;
                for axis in 0..D {
                    ahead[axis] += steps * rate[axis];
                }
                magnitude(ahead) < room - steps * fall
            };
            while steps > 0.0 && !is_within(steps) {
                steps = (steps * (1.0 - 1e-9)).floor() - 1.0;
            }
            self.least_steps = self.least_steps.min(steps.max(0.0));
        }
        // Written so that NaN certifies nothing.
        size < room
    }

    /// Adds the sum of the driving forces, which must not reach the load that stops the drive: its present
    /// value, under a load, with the amplitude of its oscillation and a reserve.
    pub(crate) fn stays_below_stop(
        &mut self,
        stop: StopForce,
        (load, ramp): (Load, Ramp),
        (force, rate): (f64, f64),
        [swing, reserve]: [f64; 2],
    ) -> bool {
        let room = stop.under_n(load) * (1.0 - ROUNDING) - swing - reserve - force;
        self.close_in(room, rate - stop.change_n(ramp));
        room > 0.0
    }

    #[inline]
    fn close_in(&mut self, way: f64, closing: f64) {
        self.least_steps = if closing > 0.0 { self.least_steps.min(way / closing) } else { self.least_steps };
    }

    /// Whole steps for which all of them stay clear. Casting saturates: with a rate of 0 the number is
    /// unlimited.
    pub(crate) fn steps(self) -> u64 {
        self.least_steps as u64
    }
}
