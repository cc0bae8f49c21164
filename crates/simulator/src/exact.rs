//! The stepper without rounding, for the few decisions that depend on rounding.
//!
//! A block may come so close to its threshold that two solvers, which round differently, have it switch
//! in neighbouring steps. Neither is wrong if the exact step from a common state leaves it closer to the
//! threshold than rounding reaches. [`Exact`] computes that step in pairs of doubles, with 32 digits
//! (Dekker 1971, Knuth 1969): the steps of [`crate::Plain`] from the plan's doubles, between switches. Over an
//! area, where friction opposes a vector, quotients and roots have as many.

use asperity_model::Plan;

use crate::slow_modes::pressed;
use crate::state::SliderState;
use crate::strength::{Load, StopForce, aged_coefficient, aged_threshold_n};

/// A number as a sum of two doubles, the second below the rounding of the first.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Wide {
    high: f64,
    low: f64,
}

impl Wide {
    const ZERO: Wide = Wide { high: 0.0, low: 0.0 };

    /// The sum of two doubles, exactly.
    fn sum(a: f64, b: f64) -> Wide {
        let high = a + b;
        let of_b = high - a;
        Wide { high, low: (a - (high - of_b)) + (b - of_b) }
    }

    /// The product of two doubles, exactly.
    fn product(a: f64, b: f64) -> Wide {
        let split = |x: f64| {
            let scaled = 134_217_729.0 * x;
            let upper = scaled - (scaled - x);
            (upper, x - upper)
        };
        let ((a1, a2), (b1, b2)) = (split(a), split(b));
        let high = a * b;
        Wide { high, low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2 }
    }
}

impl Wide {
    /// The square root of a number that is not negative: one step of Newton's from that of the first double.
    fn root(self) -> Wide {
        let near = self.high.sqrt();
        if near == 0.0 {
            return Wide::ZERO;
        }
        let left = self - Wide::product(near, near);
        Wide::sum(near, left.high / (2.0 * near))
    }
}

impl From<f64> for Wide {
    fn from(high: f64) -> Wide {
        Wide { high, low: 0.0 }
    }
}

impl std::ops::Neg for Wide {
    type Output = Wide;
    fn neg(self) -> Wide {
        Wide { high: -self.high, low: -self.low }
    }
}

impl std::ops::Add for Wide {
    type Output = Wide;
    fn add(self, other: Wide) -> Wide {
        let high = Wide::sum(self.high, other.high);
        let low = Wide::sum(self.low, other.low);
        let first = Wide::sum(high.high, high.low + low.high);
        Wide::sum(first.high, first.low + low.low)
    }
}

impl std::ops::Sub for Wide {
    type Output = Wide;
    fn sub(self, other: Wide) -> Wide {
        self + -other
    }
}

impl std::ops::Mul<f64> for Wide {
    type Output = Wide;
    fn mul(self, factor: f64) -> Wide {
        let high = Wide::product(self.high, factor);
        Wide::sum(high.high, high.low + self.low * factor)
    }
}

impl std::ops::Mul for Wide {
    type Output = Wide;
    fn mul(self, factor: Wide) -> Wide {
        self * factor.high + self * factor.low
    }
}

impl std::ops::Div for Wide {
    type Output = Wide;
    fn div(self, divisor: Wide) -> Wide {
        let first = self.high / divisor.high;
        let left = self - divisor * first;
        let second = left.high / divisor.high;
        let rest = left - divisor * second;
        Wide::sum(first, second) + Wide::from(rest.high / divisor.high)
    }
}

/// The scalar product of two vectors.
fn product(a: &[Wide], b: &[Wide]) -> Wide {
    a.iter().zip(b).fold(Wide::ZERO, |sum, (a, b)| sum + *a * *b)
}

/// A slider between two switches, without rounding.
#[derive(Debug, Clone)]
pub struct Exact<'a> {
    plan: &'a Plan,
    start: &'a SliderState,
    step: u64,
    displacement_m: Vec<Wide>,
    velocity_m_per_s: Vec<Wide>,
    /// The step in which the drive stopped.
    hold_step: u64,
    /// Sign of each block's velocity before the last step; over an area, the direction of each contact's slip
    /// ([`asperity_model::law::Turn`]), axis by axis.
    direction: Vec<Wide>,
    /// Axis by axis.
    tangential_force_n: Vec<Wide>,
    /// Friction in the last step, likewise, where springs detach contacts.
    spring_force_n: Vec<Wide>,
    /// The normal load of each contact in the last step, and the forces on all freedoms.
    normal_load_n: Vec<Wide>,
    /// Factors on the loads of single contacts; empty without a course of these.
    contact_factors: Vec<f64>,
    force_n: Vec<Wide>,
}

impl<'a> Exact<'a> {
    /// The slider in a state whose doubles are treated as exact.
    pub fn at(plan: &'a Plan, state: &'a SliderState) -> Exact<'a> {
        let wide = |values: &[f64]| values.iter().map(|&value| Wide::from(value)).collect::<Vec<_>>();
        let of_axes = || vec![Wide::ZERO; plan.elastic.tangential_axes() * plan.blocks];
        Exact {
            plan,
            start: state,
            step: state.step,
            hold_step: state.hold_step,
            displacement_m: wide(&state.displacement_m),
            velocity_m_per_s: wide(&state.velocity_m_per_s),
            direction: of_axes(),
            tangential_force_n: of_axes(),
            spring_force_n: of_axes(),
            normal_load_n: vec![Wide::ZERO; plan.blocks],
            contact_factors: Vec::new(),
            force_n: vec![Wide::ZERO; plan.elastic.freedoms()],
        }
    }

    /// Takes steps up to and including `step`, in which no block switches.
    pub fn advance_to(&mut self, step: u64) {
        while self.step < step {
            self.step += 1;
            self.pull();
            let load = self.drive();
            self.rub(load);
            self.advance();
        }
    }

    /// The pull between nodes on all freedoms, bond by bond.
    fn pull(&mut self) {
        let lattice = self.plan.elastic.as_lattice();
        let (nodes, axes) = (lattice.nodes(), lattice.axes());
        let (u, v, force) = (&self.displacement_m, &self.velocity_m_per_s, &mut self.force_n);
        force.fill(Wide::ZERO);
        lattice.over_bonds(|bond| {
            let ends = |axis: usize| [bond.from, bond.to].map(|node| axis * nodes + node);
            let change = |of: &[Wide], axis: usize| {
                let [from, to] = ends(axis);
                of[to] - of[from]
            };
            // Along a diagonal, the stiffness is shared between the axes.
            let parts = bond.along.iter().filter(|part| **part != 0.0).count();
            let stiffness = bond.stiffness_n_per_m / parts as f64;
            let part = |axis: usize| if bond.along[axis] == 0.0 { 0.0 } else { bond.along[axis].signum() };
            let stretch = (0..axes).fold(Wide::ZERO, |sum, axis| sum + change(u, axis) * part(axis));
            for axis in 0..axes {
                let pull = stretch * (stiffness * part(axis)) + change(v, axis) * lattice.damping_kg_per_s;
                let [from, to] = ends(axis);
                force[from] = force[from] + pull;
                force[to] = force[to] - pull;
            }
        });
    }

    /// Applies drive, prestress and the load of the step; returns the load.
    fn drive(&mut self) -> Load {
        let (plan, u, force) = (self.plan, &self.displacement_m, &mut self.force_n);
        let point_m = match plan.drive.course {
            Some(_) => plan.drive_point_m(self.step, self.hold_step).into(),
            None => {
                let moved_s = plan.grid.time_s(self.step.min(self.hold_step));
                Wide::product(plan.drive.velocity_m_per_s, moved_s) + plan.drive.offset_m.into()
            }
        };
        let mut total_n = 0.0;
        for spring in &plan.drive.springs {
            let stretch = point_m * spring.direction - (u[spring.block] - spring.rest_m.into());
            let pull = stretch * spring.stiffness_n_per_m;
            force[spring.block] = force[spring.block] + pull;
            total_n += pull.high;
        }
        for bond in &plan.end_bonds {
            let stretch = |of: &[Wide]| of[bond.block] - bond.other.map_or(Wide::ZERO, |other| of[other]);
            let pull = (Wide::from(bond.rest_m) - stretch(u)) * bond.stiffness_n_per_m
                - stretch(&self.velocity_m_per_s) * bond.damping_kg_per_s;
            force[bond.block] = force[bond.block] + pull;
            if let Some(other) = bond.other {
                force[other] = force[other] - pull;
            }
        }
        for (force, prestress) in force.iter_mut().zip(plan.outside_n(self.step)) {
            *force = *force + prestress.into();
        }
        if let Some(force_n) = plan.drive_force_n(self.step, self.hold_step) {
            force[0] = force[0] + force_n.into();
            total_n += force_n;
        }
        let load = Load::in_step(plan, self.step, self.hold_step);
        let all = Load::of_all(plan, self.step, self.hold_step);
        if StopForce::of(plan, self.hold_step).is_some_and(|stop| total_n >= stop.under_n(all)) {
            self.hold_step = self.step;
        }
        for (freedom, load_n) in pressed(plan, &plan.elastic.as_lattice()) {
            force[freedom] = force[freedom] - load.scaled_n(load_n).into();
        }
        load
    }

    /// Computes the normal load of contacts and their friction.
    fn rub(&mut self, load: Load) {
        let plan = self.plan;
        let lattice = plan.elastic.as_lattice();
        self.contact_factors =
            plan.contact_load_course.as_ref().map_or_else(Vec::new, |course| course.values(self.step));
        for n in 0..plan.blocks {
            let freedoms: Vec<usize> =
                (0..plan.elastic.tangential_axes()).map(|axis| axis * lattice.nodes() + n).collect();
            let of = |all: &[Wide]| freedoms.iter().map(|freedom| all[*freedom]).collect::<Vec<Wide>>();
            let (u, v, tau) = (of(&self.displacement_m), of(&self.velocity_m_per_s), of(&self.force_n));
            let sliding_friction = match lattice.first_normal() {
                Some(normal) => {
                    let rise = self.displacement_m[normal + n];
                    let bears = if rise.high < 0.0 { rise * -lattice.foundation_n_per_m } else { Wide::ZERO };
                    self.normal_load_n[n] = bears;
                    self.force_n[normal + n] = self.force_n[normal + n] + bears;
                    bears * plan.friction.dynamic_coefficients[n]
                }
                None if !self.contact_factors.is_empty() => {
                    let borne_n = load.scaled_n(plan.normal_load_n[n]) * self.contact_factors[n];
                    self.normal_load_n[n] = borne_n.into();
                    self.normal_load_n[n] * plan.friction.dynamic_coefficients[n]
                }
                None => {
                    self.normal_load_n[n] = load.scaled_n(plan.normal_load_n[n]).into();
                    load.scaled_n(plan.friction.dynamic_friction_n[n]).into()
                }
            };
            let along = self.friction_along(n, &v, &tau);
            for (axis, freedom) in freedoms.iter().enumerate() {
                let place = axis * plan.blocks + n;
                self.tangential_force_n[place] = tau[axis];
                let friction = if self.start.slip[n] != 0.0 {
                    -(sliding_friction * along[axis]) - v[axis] * plan.friction.law.radiation_kg_per_s()
                } else if plan.friction.law.holds() {
                    -tau[axis]
                } else {
                    (u[axis] - self.start.stick_position_m[place].into()) * -plan.friction.springs_n_per_m[n]
                };
                self.force_n[*freedom] = self.force_n[*freedom] + friction;
                if plan.friction.law.detaches_by_spring() {
                    self.spring_force_n[place] = friction;
                }
            }
        }
    }

    /// The direction against which friction resists a sliding contact, and remembers that of its slip.
    fn friction_along(&mut self, n: usize, v: &[Wide], tau: &[Wide]) -> Vec<Wide> {
        let (plan, start) = (self.plan, self.start);
        if let [v] = v {
            let sign = if v.high == 0.0 { Wide::ZERO } else { v.high.signum().into() };
            self.direction[n] = sign;
            return vec![sign];
        }
        let just_detached = self.step == start.step + 1 && start.just_detached.contains(&(n as u32));
        for (axis, v) in v.iter().enumerate() {
            let place = axis * plan.blocks + n;
            self.direction[place] = if just_detached { start.tangential_force_n[place].into() } else { *v };
        }
        let by_force = plan.grid.step_s() / plan.block_mass_kg;
        let coming: Vec<Wide> = v.iter().zip(tau).map(|(v, tau)| *v + *tau * by_force).collect();
        let along = if product(&coming, v).high > 0.0 { &coming } else { v };
        let speed = product(along, along).root();
        let is_still = speed.high == 0.0;
        along.iter().map(|along| if is_still { Wide::ZERO } else { *along / speed }).collect()
    }

    /// Euler-Cromer, of all freedoms.
    fn advance(&mut self) {
        let dt = self.plan.grid.step_s();
        let by_force = dt / self.plan.block_mass_kg;
        let moving = self.velocity_m_per_s.iter_mut().zip(&mut self.displacement_m);
        for ((v, u), force) in moving.zip(&self.force_n) {
            *v = *v + *force * by_force;
            *u = *u + *v * dt;
        }
    }

    /// How far block `n` (counted from 0) is beyond its switch after the last step. For a stuck block
    /// this is the force above its threshold; for a sliding one the velocity below 0 or, by the two-way
    /// rule and over an area, against its former direction. It switches if this is not negative.
    pub fn beyond_switch(&self, n: usize) -> f64 {
        let (plan, start) = (self.plan, self.start);
        let axes = plan.elastic.tangential_axes();
        let of =
            |all: &[Wide], next: usize| (0..axes).map(|axis| all[axis * next + n]).collect::<Vec<Wide>>();
        if start.slip[n] == 0.0 {
            let by_spring = plan.friction.law.detaches_by_spring();
            let force_n = if by_spring { &self.spring_force_n } else { &self.tangential_force_n };
            let size = match of(force_n, plan.blocks)[..] {
                [tau] if tau.high < 0.0 => -tau,
                [tau] => tau,
                ref tau => product(tau, tau).root(),
            };
            if !plan.has_given_loads() {
                let since_step = start.stuck_since_step.get(n).copied();
                let coefficient = aged_coefficient(plan, n, since_step, self.step);
                return (size - self.normal_load_n[n] * coefficient).high;
            }
            let aged = aged_threshold_n(plan, n, &start.stuck_since_step, self.step);
            let load = Load::in_step(plan, self.step, self.hold_step);
            return (size - load.scaled_n(aged).into()).high;
        }
        let (v, direction) =
            (of(&self.velocity_m_per_s, plan.elastic.nodes()), of(&self.direction, plan.blocks));
        if let ([v], [direction]) = (&v[..], &direction[..]) {
            let forward_only = plan.friction.law.affine().is_some_and(|form| form.forward_only);
            return -v.high * if forward_only { 1.0 } else { direction.high };
        }
        let length = product(&direction, &direction).root();
        if length.high == 0.0 { 0.0 } else { -(product(&v, &direction) / length).high }
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::{Exact, Wide};
    use crate::{Plain, Solver};

    #[test]
    fn between_switches_it_does_what_the_plain_stepper_does() {
        // The first of them slides forward, and detaches while it moves backwards too.
        let ringing = ["initial_velocity.amplitude_m_per_s=1", "initial_velocity.mode=1", "time.step_s=1e-6"];
        let (mut compared, mut switches, mut backwards) = (0, 0, 0);
        for (set, rule) in [("as-coded", "one-way"), ("as-stated", "one-way"), ("as-coded", "two-way")] {
            let source = ScenarioSource::new("test", "slider.blocks = 2\ntime.duration_s = 0.1");
            let source = ringing
                .iter()
                .fold(source, |source, value| source.with_override(value))
                .with_override(&format!("parameter_set={set}"))
                .with_override(&format!("friction.reattach={rule}"));
            let plan = Plan::new(&Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}")));
            let mut plain = Plain::new(plan.clone());
            while plain.step() + 20 < plan.steps {
                let before = plain.state().clone();
                let mut exact = Exact::at(&plan, &before);
                for _ in 0..20 {
                    plain.take_step();
                    exact.advance_to(plain.step());
                    let state = plain.state();
                    compared += 1;
                    for n in 0..plan.blocks {
                        let velocity = before.velocity_m_per_s[n];
                        backwards += usize::from(before.slip[n] != 0.0 && velocity < 0.0);
                        let off = exact.velocity_m_per_s[n].high - state.velocity_m_per_s[n];
                        assert!(off.abs() < 1e-12, "{set}, {rule}, step {}, block {n}: {off}", plain.step());
                        let beyond = exact.beyond_switch(n);
                        let switched = plain.switched().contains(&n);
                        assert!((beyond >= 0.0) == switched || beyond.abs() < 1e-9, "{beyond}, {switched}");
                    }
                    if !plain.switched().is_empty() {
                        switches += plain.switched().len();
                        break;
                    }
                }
            }
        }
        assert!(compared > 100_000 && switches > 20 && backwards > 5, "{compared} {switches} {backwards}");
    }

    #[test]
    fn so_it_does_in_a_slab() {
        let sets = [
            "slider.blocks=5",
            "slider.rows=3",
            "slider.height_m=0.07",
            "slider.mass_kg=2",
            "drive.height_m=0.035",
            "drive.velocity_m_per_s=2e-2",
            "friction.ageing_coefficient=0.02",
            "time.step_s=1e-5",
            "time.duration_s=0.05",
            "recording.fields_s=0",
        ];
        for sets in [&sets[..], &[&sets[..], &["friction.reattach=two-way"]].concat()] {
            let plan =
                Plan::new(&asperity_model::resolve("slab", sets).unwrap_or_else(|error| panic!("{error}")));
            let mut plain = Plain::new(plan.clone());
            let (mut compared, mut switches) = (0, 0);
            while plain.step() + 20 < plan.steps {
                let before = plain.state().clone();
                let mut exact = Exact::at(&plan, &before);
                for _ in 0..20 {
                    plain.take_step();
                    exact.advance_to(plain.step());
                    let state = plain.state();
                    for (exact, v) in exact.velocity_m_per_s.iter().zip(&state.velocity_m_per_s) {
                        assert!((exact.high - v).abs() < 1e-12, "step {}", plain.step());
                    }
                    for n in 0..plan.blocks {
                        compared += 1;
                        let beyond = exact.beyond_switch(n);
                        let switched = plain.switched().contains(&n);
                        assert!((beyond >= 0.0) == switched || beyond.abs() < 1e-9, "{beyond}, {switched}");
                    }
                    if !plain.switched().is_empty() {
                        switches += plain.switched().len();
                        break;
                    }
                }
            }
            assert!(compared > 10_000 && switches > 20, "{compared} {switches}");
        }
    }

    #[test]
    fn so_it_does_over_an_area() {
        let body = [
            "slider.blocks=4",
            "slider.across=3",
            "slider.rows=3",
            "slider.width_m=0.09333333333333334",
            "slider.height_m=0.09333333333333334",
            "slider.mass_kg=3",
            "drive.height_m=0.046666666666666667",
            "drive.velocity_m_per_s=1e-2",
            "drive.stiffness_n_per_m=1e8",
            "time.step_s=4e-6",
            "time.duration_s=0.02",
        ];
        let sheet = [
            "slider.blocks=5",
            "slider.across=3",
            "slider.width_m=0.05",
            "drive.velocity_m_per_s=1e-1",
            "time.step_s=1e-6",
            "time.duration_s=0.01",
        ];
        for (scenario, sets) in [("body-coarse", &body[..]), ("sheet-coarse", &sheet[..])] {
            let (mut compared, mut attached, mut detached) = (0, 0, 0);
            for row in ["drive.across=0", "drive.across=1"] {
                let sets = [sets, &[row, "recording.fields_s=0"]].concat();
                let plan = Plan::new(
                    &asperity_model::resolve(scenario, &sets).unwrap_or_else(|error| panic!("{error}")),
                );
                let mut plain = Plain::new(plan.clone());
                while plain.step() + 20 < plan.steps {
                    let before = plain.state().clone();
                    // While all contacts stick, one in ten stretches and those with a switch are enough.
                    let mut ahead = plain.clone();
                    let switches = (0..20).any(|_| {
                        ahead.take_step();
                        !ahead.switched().is_empty()
                    });
                    if before.detached == 0 && !switches && !before.step.is_multiple_of(200) {
                        plain = ahead;
                        continue;
                    }
                    let mut exact = Exact::at(&plan, &before);
                    for _ in 0..20 {
                        plain.take_step();
                        exact.advance_to(plain.step());
                        let state = plain.state();
                        for (exact, v) in exact.velocity_m_per_s.iter().zip(&state.velocity_m_per_s) {
                            let off = (exact.high - v).abs();
                            assert!(off < 1e-12, "{scenario}, step {}: {off}", plain.step());
                        }
                        for n in 0..plan.blocks {
                            compared += 1;
                            let beyond = exact.beyond_switch(n);
                            let switched = plain.switched().contains(&n);
                            assert!(
                                (beyond >= 0.0) == switched || beyond.abs() < 1e-9,
                                "{beyond}, {switched}"
                            );
                            attached += usize::from(switched && before.slip[n] != 0.0);
                            detached += usize::from(switched && before.slip[n] == 0.0);
                        }
                        if !plain.switched().is_empty() {
                            break;
                        }
                    }
                }
            }
            assert!(compared > 10_000 && attached > 20 && detached > 20, "{compared} {attached} {detached}");
        }
    }

    #[test]
    fn pairs_keep_twice_the_digits() {
        let third = Wide::from(1.0 / 3.0);
        // The rounding error of 1/3 as a double, which doubles cannot represent relative to 1.
        let off = third * 3.0 - Wide::from(1.0);
        assert_eq!(off.high, -(2f64.powi(-54)));
        let tiny = Wide::from(1.0) + Wide::from(1e-30);
        assert_eq!((tiny - Wide::from(1.0)).high, 1e-30);
        assert_eq!(Wide::product(1.0 + 2f64.powi(-40), 1.0 - 2f64.powi(-40)).low, -(2f64.powi(-80)));
        let two = Wide::from(2.0);
        let root = two.root();
        assert!((root * root - two).high.abs() < 1e-30 && root.low != 0.0, "{root:?}");
        let seventh = Wide::from(1.0) / Wide::from(7.0);
        assert!((seventh * 7.0 - Wide::from(1.0)).high.abs() < 1e-31 && seventh.low != 0.0, "{seventh:?}");
    }
}
