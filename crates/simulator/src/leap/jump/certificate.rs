//! How long no contact switches in a jump ([`super`]), with the modes that vibrate in it.
//!
//! A contact stays as it is while `mu_s p_n - |tau_n|` and `p_n` are positive. For the
//! forced part, `tau_n = k_t (u - u_stick)` and `p_n = -k_f u_z` are linear in time; without a foundation `p_n`
//! is given, and follows the course of the load. It need not be looked at by itself: where it vanishes, so does the
//! strength. Over an area, `tau_n` is a vector: the magnitude of the
//! forced part is convex, so what remains of the strength is concave, least at the ends of a stretch; and a mode
//! adds at most the magnitude of its sizes along both axes. The sizes of the modes
//! fall; so as soon as a stretch is certified, the next begins with smaller ones. Where that is not enough,
//! both ends of a short stretch are evaluated exactly, and between them no value deviates by more than
//! `h^2 / 8` times the sum of the modes' second differences. Contacts that the sizes alone keep below their
//! strength need no such evaluation. The residue and the reserves for rounding of
//! [`crate::leap::norms`] must fit in as well. An ageing contact is assumed to be no stronger than at the start
//! of the jump.

use std::array;
use std::sync::Arc;

use asperity_model::law::magnitude;
use asperity_model::{Plan, SliderState};

use crate::kernels;
use crate::leap::clearance::Clearance;
use crate::leap::jump::Forced;
use crate::leap::norms::ROUNDING;
use crate::modes::Coordinates;
use crate::modes::complex::{Complex, Functions};
use crate::modes::slow_modes::ClassModes;
use crate::step::strength::{StopForce, least_threshold_n, static_coefficient};

/// Stretches whose ends are evaluated exactly.
#[derive(Debug, Clone, Copy)]
struct Stretches {
    /// The length of each in steps.
    steps: u64,
    /// How many there are before the sizes of the modes are looked at again.
    at_once: u64,
}

/// In bodies, whose modes are slow.
const LONG: Stretches = Stretches { steps: 32, at_once: 1 };

/// In sheets, whose modes swing in a few dozen steps.
const SHORT: Stretches = Stretches { steps: 8, at_once: 32 };

/// How often the sizes of the modes are looked at in vain.
const MOST_LOOKS: u64 = 2048;

/// Share by which rounding may move the sums of modes.
const ROUNDING_OF_SUMS: f64 = 1e-9;

/// The free motion of one class: its modes, with the coordinates that they have at the start of a jump.
#[derive(Debug, Clone)]
pub(crate) struct Part<const D: usize> {
    pub(crate) modes: Arc<ClassModes<D>>,
    pub(crate) coordinates: Coordinates,
}

impl<const D: usize> Part<D> {
    /// The coordinates a number of steps later.
    pub(crate) fn grown(&self, steps: u64) -> Coordinates {
        self.modes.slow.powers.grown(&self.coordinates, steps)
    }
}

/// A jump from a state on, whose length is to be found.
pub(crate) struct Certificate<'a, const D: usize> {
    pub(crate) plan: &'a Plan,
    pub(crate) state: &'a SliderState,
    pub(crate) forced: &'a Forced,
    /// How much the modes may add from its start on.
    pub(crate) swing: Swing,
    /// Modes whose swing is followed from stretch to stretch; none of a chain, which is certified at once.
    pub(crate) parts: Vec<Part<D>>,
    /// The first freedom along the normal, and static coefficients: on a foundation.
    normal: Option<(usize, Vec<f64>)>,
    /// Thresholds at the load of the start, where loads are given.
    least_n: &'a [f64],
    /// What the magnitude of a force, a normal load and the sum of the driving forces may be off by.
    pub(crate) reserves: [f64; 3],
}

/// A contact that may switch, and the force and the load that each mode of each class adds there.
type NearSwitch<const D: usize> = (usize, Vec<Vec<([Complex; D], Complex)>>);

/// How much the modes may add from some step on.
#[derive(Debug, Clone)]
pub(crate) struct Swing {
    pub(crate) force_n: Vec<f64>,
    load_n: Vec<f64>,
    pub(crate) drive_n: f64,
}

impl Swing {
    pub(crate) fn none(plan: &Plan) -> Swing {
        Swing { force_n: vec![0.0; plan.blocks], load_n: vec![0.0; plan.blocks], drive_n: 0.0 }
    }
}

impl<'a, const D: usize> Certificate<'a, D> {
    /// Of the forced part alone.
    pub(crate) fn of(plan: &'a Plan, state: &'a SliderState, forced: &'a Forced) -> Certificate<'a, D> {
        let coefficients = || (0..plan.blocks).map(|n| static_coefficient(plan, state, n)).collect();
        let normal = plan.elastic.first_normal().map(|normal| (normal, coefficients()));
        let (swing, least_n) = (Swing::none(plan), least_threshold_n(plan, state));
        Certificate { plan, state, forced, swing, parts: Vec::new(), normal, least_n, reserves: [0.0; 3] }
    }

    /// Steps for which the swing that is given neither switches a contact nor stops the drive.
    pub(crate) fn at_once(&self) -> u64 {
        self.certified(0, &self.swing)
    }

    fn stretches(&self) -> Stretches {
        if self.normal.is_some() { LONG } else { SHORT }
    }

    /// The largest number of steps that is certified.
    pub(crate) fn longest(&self, most_steps: u64) -> u64 {
        if self.parts.is_empty() {
            return self.at_once().min(most_steps);
        }
        let (stretches, mut steps, mut looks) = (self.stretches(), 0, 0);
        while steps < most_steps {
            let coordinates: Vec<Coordinates> = self.parts.iter().map(|part| part.grown(steps)).collect();
            let mut swing = Swing::none(self.plan);
            self.add_swing(&mut swing, &coordinates, |_| 1.0);
            let certified = self.certified(steps, &swing).min(most_steps);
            if certified >= steps + stretches.steps || certified == most_steps {
                steps = certified;
                continue;
            }
            looks += 1;
            if looks > MOST_LOOKS {
                break;
            }
            let to = (steps + stretches.steps * stretches.at_once).min(most_steps);
            let reached = self.exact_until([steps, to], &swing, coordinates);
            steps = reached;
            if reached < to {
                break;
            }
        }
        steps
    }

    /// Adds how much the modes may add, as a share of their sizes that depends on their rates.
    fn add_swing(&self, swing: &mut Swing, coordinates: &[Coordinates], share: impl Fn(Complex) -> f64) {
        for (part, coordinates) in self.parts.iter().zip(coordinates) {
            let sizes = coordinates.sizes().into_iter().zip(&part.modes.slow.rates);
            let sizes: Vec<f64> = sizes.map(|(size, s)| size * share(*s)).collect();
            kernels::add_columns(&mut swing.force_n, &part.modes.most_force_n, &sizes);
            kernels::add_columns(&mut swing.load_n, &part.modes.most_load_n, &sizes);
            for (size, drive) in sizes.iter().zip(&part.modes.drive_n) {
                swing.drive_n += size * drive.size();
            }
        }
    }

    /// Steps from the start of the jump for which this swing neither switches a contact nor stops the
    /// drive, provided that the state at `from` is certified; otherwise `from`.
    fn certified(&self, from: u64, swing: &Swing) -> u64 {
        let [of_force, of_load, of_drive] = self.reserves;
        let mut clearance = Clearance::ENDLESS;
        for n in 0..self.plan.blocks {
            let (force, rate) = self.forced.friction_n::<D>(self.plan, self.state, n, from as f64);
            let (strength, change) = self.strength_n(n, from as f64, swing.load_n[n] + of_load);
            let room = strength - ROUNDING * strength - of_force - swing.force_n[n];
            // The strength may come down to meet the force.
            if !clearance.stays_within(force, rate, room, -change) {
                return from;
            }
        }
        let swing = [swing.drive_n, of_drive];
        if !self.forced.stays_below_stop(self.plan, from as f64, swing, &mut clearance) {
            return from;
        }
        from.saturating_add(clearance.steps())
    }

    /// Strength of a contact in the forced part `into` steps after the first, and its change in a step. On a
    /// foundation its normal load may be `less_n` smaller; otherwise the load is given.
    fn strength_n(&self, contact: usize, into: f64, less_n: f64) -> (f64, f64) {
        let Some((normal, coefficients)) = &self.normal else {
            let (at_start_n, ramp) = (self.least_n[contact], self.forced.ramp);
            return (ramp.ahead(into).scaled_n(at_start_n), ramp.change_n(at_start_n));
        };
        let (kf, z, mu) = (self.plan.elastic.foundation_n_per_m, normal + contact, coefficients[contact]);
        let rate = -kf * self.forced.advance_m[z];
        (mu * (-kf * self.forced.position_m[z] + into * rate - less_n), mu * rate)
    }

    /// The step up to which nothing switches, found by short stretches whose ends are evaluated exactly. At the
    /// beginning the modes have `coordinates`, and add at most the `swing` from there on.
    fn exact_until(&self, [from, to]: [u64; 2], swing: &Swing, mut coordinates: Vec<Coordinates>) -> u64 {
        let stretch = self.stretches().steps.min(to - from);
        let bent = self.bent(stretch, &coordinates);
        let near = self.near([from, to], swing, &bent);
        let growth = |part: &Part<D>, steps: u64| part.modes.slow.powers.growth(steps);
        let by_stretch: Vec<Coordinates> = self.parts.iter().map(|part| growth(part, stretch)).collect();
        if !self.is_clear(from, &near, &bent, &coordinates) {
            return from;
        }
        let mut reached = from;
        while reached < to {
            // The last may be shorter.
            let steps = stretch.min(to - reached);
            for ((coordinates, by_stretch), part) in coordinates.iter_mut().zip(&by_stretch).zip(&self.parts)
            {
                if steps == stretch {
                    coordinates.grow_by(by_stretch);
                } else {
                    coordinates.grow_by(&growth(part, steps));
                }
            }
            if !self.is_clear(reached + steps, &near, &bent, &coordinates) {
                break;
            }
            reached += steps;
        }
        reached
    }

    /// By how much the modes may deviate from a straight line within a stretch, with the reserves.
    fn bent(&self, stretch: u64, coordinates: &[Coordinates]) -> Swing {
        let ([of_force, of_load, of_drive], contacts) = (self.reserves, self.plan.blocks);
        let mut bent =
            Swing { force_n: vec![of_force; contacts], load_n: vec![of_load; contacts], drive_n: of_drive };
        let bend = stretch as f64 * stretch as f64 / 8.0;
        self.add_swing(&mut bent, coordinates, |s| bend * (s.re * s.re + s.im * s.im));
        bent
    }

    /// The contacts that the swing may bring to their strength between two steps, with what each mode does there.
    fn near(&self, steps: [u64; 2], swing: &Swing, bent: &Swing) -> Vec<NearSwitch<D>> {
        let contacts = self.plan.blocks;
        let is_far = |n: usize| {
            let most = [swing.force_n[n], swing.load_n[n]].map(|swing| swing * (1.0 + ROUNDING_OF_SUMS));
            steps.iter().all(|into| {
                let (force, _) = self.forced.friction_n::<D>(self.plan, self.state, n, *into as f64);
                let (strength, _) = self.strength_n(n, *into as f64, most[1] + bent.load_n[n]);
                let room = strength * (1.0 - ROUNDING) * (1.0 - ROUNDING_OF_SUMS) - bent.force_n[n];
                magnitude(force) * (1.0 + ROUNDING_OF_SUMS) + most[0] < room
            })
        };
        let near = (0..contacts).filter(|n| !is_far(*n));
        let modes_of = |n: usize| {
            let of_parts = self.parts.iter().map(move |part| {
                let modes = (0..part.modes.slow.rates.len()).map(move |mode| mode * contacts + n);
                modes.map(|at| (part.modes.force_n[at], part.modes.load_n[at])).collect()
            });
            of_parts.collect()
        };
        near.map(|contact| (contact, modes_of(contact))).collect()
    }

    /// Whether nothing switches at a step, where the modes have these coordinates, nor as far from there as they
    /// bend.
    fn is_clear(&self, into: u64, near: &[NearSwitch<D>], bent: &Swing, coordinates: &[Coordinates]) -> bool {
        let part_of = |of: Complex, c: &Coordinates, mode: usize| of.re * c.re[mode] - of.im * c.im[mode];
        let are_clear = near.iter().all(|(contact, modes)| {
            let (mut forces, mut loads) = ([0.0; D], 0.0);
            for (modes, c) in modes.iter().zip(coordinates) {
                for (mode, (force, load)) in modes.iter().enumerate() {
                    for axis in 0..D {
                        forces[axis] += part_of(force[axis], c, mode);
                    }
                    loads += part_of(*load, c, mode);
                }
            }
            let n = *contact;
            let (force, _) = self.forced.friction_n::<D>(self.plan, self.state, n, into as f64);
            let (strength, _) = self.strength_n(n, into as f64, bent.load_n[n] - loads);
            let room = strength * (1.0 - ROUNDING) - bent.force_n[n];
            magnitude(array::from_fn::<f64, D, _>(|axis| force[axis] + forces[axis])) < room
        });
        let Some(stop) = StopForce::of(self.plan, self.state.hold_step) else { return are_clear };
        let swings = self.parts.iter().zip(coordinates).map(|(part, c)| {
            let drive_n = part.modes.drive_n.iter().enumerate();
            drive_n.map(|(mode, drive)| part_of(*drive, c, mode)).sum::<f64>()
        });
        let swing: f64 = swings.sum();
        let (force, _) = self.forced.drive_n(self.plan, into as f64);
        let goal = stop.under_n(self.forced.ramp.ahead(into as f64)) * (1.0 - ROUNDING);
        are_clear && force + swing + bent.drive_n < goal
    }
}
