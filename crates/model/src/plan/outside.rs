//! What acts on a slider from outside: drive, load, prestress, and what joins the ends of a chain.

use std::borrow::Cow;

use crate::plan::Plan;
use crate::plan::course::{Course, Swing};
use crate::plan::load::{Load, Ramp};

/// The drive in one step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Driving {
    /// Sum of the forces on all nodes, N.
    pub total_n: f64,
    /// The pull of the springs in the direction in which the drive point moves, N.
    pub along_n: f64,
    /// The forces on the first and the last block where the drive pulls both ways.
    pub ends_n: Option<[f64; 2]>,
}

/// What acts from outside in one step: its forces, their rates from there on, and how long these last. Everything that
/// sums forces asks it: single steps, leaps, energies, starts and previews.
#[derive(Debug, Clone, Copy)]
pub struct Outside<'a> {
    plan: &'a Plan,
    /// The step.
    pub step: u64,
    /// The step in which the drive point stops; `u64::MAX` if it has not and none is known.
    pub hold_step: u64,
    /// Displacement of the drive point.
    pub point_m: f64,
}

impl Plan {
    /// What acts from outside in a step, if the drive point stopped in `hold_step` (`u64::MAX` if it has not).
    #[inline]
    pub fn outside(&self, step: u64, hold_step: u64) -> Outside<'_> {
        let moved = step.min(hold_step);
        let moved_m = match &self.drive.course {
            // Contacts that weaken amplify rounding, so its order is part of their rules.
            None if self.friction.weakens() => {
                self.drive.velocity_m_per_s * (moved as f64 * self.grid.step_s())
            }
            None => self.drive.velocity_m_per_s * self.grid.time_s(moved),
            Some(course) => course.integral(moved, u64::MAX) * self.grid.step_s(),
        };
        Outside { plan: self, step, hold_step, point_m: self.drive.offset_m + moved_m }
    }

    /// Adds to forces on the blocks of a chain by how much those from outside change while blocks move by `d_u` and
    /// change their velocities by `d_v`, and the drive point moves by `advance_m`. The load is not among them.
    pub fn add_change_n(&self, force_n: &mut [f64], [d_u, d_v]: [&[f64]; 2], advance_m: f64) {
        for spring in &self.drive.springs {
            force_n[spring.block] += spring.force_n(advance_m, d_u[spring.block]);
        }
        for bond in &self.end_bonds {
            bond.add(bond.pull_of_changes(d_u, d_v), force_n);
        }
    }
}

impl Outside<'_> {
    /// Velocity of the drive point, 0 from the step in which it stopped. Between the knots of its course it is linear
    /// in time, at the rate [`Outside::acceleration`].
    #[inline]
    pub fn velocity_m_per_s(&self) -> f64 {
        match &self.plan.drive.course {
            _ if self.step >= self.hold_step => 0.0,
            None => self.plan.drive.velocity_m_per_s,
            Some(course) => course.value(self.step, u64::MAX),
        }
    }

    /// The change of that velocity in each step that follows, m/s, up to [`Outside::until_step`].
    pub fn acceleration(&self) -> f64 {
        self.course().map_or(0.0, |course| course.rate(self.step, u64::MAX))
    }

    /// How far the drive point moves in each step that follows, m, while its velocity is constant.
    #[inline]
    pub fn advance_m(&self) -> f64 {
        self.velocity_m_per_s() * self.plan.grid.step_s()
    }

    /// How far the drive point has moved in this step, m.
    #[inline]
    pub fn moved_m(&self) -> f64 {
        let step_s = self.plan.grid.step_s();
        match &self.plan.drive.course {
            _ if self.step > self.hold_step => 0.0,
            None => self.plan.drive.velocity_m_per_s * step_s,
            Some(course) => {
                // Of the mean velocity: knots are between steps.
                let before = self.step - 1;
                (course.value(before, u64::MAX) + 0.5 * course.rate(before, u64::MAX)) * step_s
            }
        }
    }

    /// The last step up to which velocity, load and prestress but for its swing change at the rates of this one;
    /// `u64::MAX` if they never change.
    pub fn until_step(&self) -> u64 {
        let Outside { plan, step, hold_step, .. } = *self;
        let of_load = plan.load_course.next_knot(step, hold_step);
        let of_contacts = [&plan.contact_load_course, &plan.prestress_course].into_iter().flatten();
        let of_contacts = of_contacts.map(|course| course.next_knot(step)).min().unwrap_or(u64::MAX);
        let swing = plan.swing.map_or(u64::MAX, |swing| plan.grid.nearest_step(swing.from_s));
        let later = |at: u64| if at > step { at } else { u64::MAX };
        of_load.min(of_contacts).min(self.drive_knot_step()).min(later(hold_step)).min(later(swing))
    }

    /// The next knot of the course of the drive; `u64::MAX` for none.
    pub fn drive_knot_step(&self) -> u64 {
        self.course().map_or(u64::MAX, |course| course.next_knot(self.step, u64::MAX))
    }

    /// The course of the drive's velocity, if it has one and the drive has not stopped.
    fn course(&self) -> Option<&Course> {
        self.plan.drive.course.as_ref().filter(|_| self.step < self.hold_step)
    }

    /// The last step up to which the drive point keeps its velocity, and the load its rate.
    pub fn steady_until_step(&self) -> u64 {
        if self.acceleration() == 0.0 { self.until_step() } else { self.step }
    }

    /// A later step, as if the drive point kept its velocity.
    pub fn continued(self, steps: u64) -> Self {
        let moves = self.step < self.hold_step;
        let (step, hold_step) = (self.step + steps, if moves { u64::MAX } else { self.hold_step });
        match &self.plan.drive.course {
            None => self.plan.outside(step, hold_step),
            Some(_) => {
                Outside { step, hold_step, point_m: self.point_m + steps as f64 * self.advance_m(), ..self }
            }
        }
    }

    /// The normal load over that of the start.
    #[inline]
    pub fn load(&self) -> Load {
        Load(self.plan.load_course.value(self.step, self.hold_step))
    }

    /// That load, and its rate up to [`Outside::until_step`].
    pub fn ramp(&self) -> Ramp {
        Ramp { load: self.load(), rate: self.plan.load_course.rate(self.step, self.hold_step) }
    }

    /// The total normal load over that of the start, courses of single contacts included.
    pub fn total_load(&self) -> Load {
        let Outside { plan, step, .. } = *self;
        let Some(course) = &plan.contact_load_course else { return self.load() };
        let borne =
            course.values(step).into_iter().zip(&plan.normal_load_n).map(|(factor, load_n)| factor * load_n);
        Load(self.load().0 * (borne.sum::<f64>() / plan.normal_load_n.iter().sum::<f64>()))
    }

    /// The normal load of each contact, N; of a body on a foundation, as if it rested under its load.
    pub fn loads_n(&self) -> Vec<f64> {
        let plan = self.plan;
        let course = plan.contact_load_course.as_ref();
        let mut loads_n = course.map_or_else(|| vec![1.0; plan.blocks], |course| course.values(self.step));
        let factor = self.load().0;
        for (load_n, at_start_n) in loads_n.iter_mut().zip(&plan.normal_load_n) {
            *load_n *= factor * at_start_n;
        }
        loads_n
    }

    /// The force that drives block 1 instead of a spring, N; `None` for a drive by springs.
    #[inline]
    pub fn drive_force_n(&self) -> Option<f64> {
        let course = self.plan.drive.force_n.as_ref();
        course.map(|force_n| force_n.value(self.step.min(self.hold_step), u64::MAX))
    }

    /// The swing of the prestress, if it has begun.
    pub fn swing(&self) -> Option<Swing> {
        self.plan.swing.filter(|swing| self.plan.grid.time_s(self.step) >= swing.from_s)
    }

    /// The constant forces on all blocks, N, with their courses and their swing; empty for none.
    pub fn prestress_n(&self) -> Cow<'_, [f64]> {
        let (plan, constant_n) = (self.plan, &self.plan.prestress_n);
        if plan.prestress_course.is_none() && plan.swing.is_none() {
            return Cow::Borrowed(constant_n);
        }
        let course = plan.prestress_course.as_ref();
        let mut forces_n = course.map_or_else(|| vec![0.0; plan.blocks], |course| course.values(self.step));
        forces_n.iter_mut().zip(constant_n).for_each(|(force, constant)| *force += constant);
        if let Some(swing) = self.swing() {
            let [ratio, _] = swing.at(plan.grid.time_s(self.step));
            forces_n.iter_mut().zip(&plan.normal_load_n).for_each(|(force, load)| *force += ratio * load);
        }
        Cow::Owned(forces_n)
    }

    /// Passes on the forces of the drive and of the bonds at the ends of a chain, node by node, with the nodes at `u`
    /// and their velocities `v`.
    #[inline]
    pub fn pull(&self, [u, v]: [&[f64]; 2], mut add: impl FnMut(usize, f64)) -> Driving {
        let plan = self.plan;
        let (mut total_n, mut ends_n, mut along_n, mut both_ways) = (0.0, [0.0; 2], 0.0, false);
        for spring in &plan.drive.springs {
            let force_n = spring.force_n(self.point_m, u[spring.block]);
            add(spring.block, force_n);
            total_n += force_n;
            along_n += spring.direction * force_n;
            both_ways |= spring.direction < 0.0;
            if spring.block == 0 {
                ends_n[0] = force_n;
            } else if spring.block == plan.blocks - 1 {
                ends_n[1] = force_n;
            }
        }
        if let Some(force_n) = self.drive_force_n() {
            add(0, force_n);
            total_n += force_n;
        }
        for bond in &plan.end_bonds {
            let pull_n = bond.pull_n(u, v);
            add(bond.block, pull_n);
            if let Some(other) = bond.other {
                add(other, -pull_n);
            }
        }
        Driving { total_n, along_n, ends_n: both_ways.then_some(ends_n) }
    }

    /// The energies of the driving springs, J, with the nodes at `u`.
    pub fn springs_j(&self, u: &[f64]) -> impl Iterator<Item = f64> {
        self.plan.drive.springs.iter().map(|spring| {
            let stretch_m = spring.direction * self.point_m - (u[spring.block] - spring.rest_m);
            0.5 * spring.stiffness_n_per_m * stretch_m * stretch_m
        })
    }

    /// Adds all forces to those on the first nodes, which may be the contacts of a lattice alone.
    pub fn add_n(&self, force_n: &mut [f64], at: [&[f64]; 2]) {
        self.pull(at, |node, pull_n| {
            if let Some(force_n) = force_n.get_mut(node) {
                *force_n += pull_n;
            }
        });
        force_n.iter_mut().zip(&*self.prestress_n()).for_each(|(force, prestress)| *force += prestress);
    }
}
