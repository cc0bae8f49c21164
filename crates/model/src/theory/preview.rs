//! Predictions from a scenario before it is run: its material, and its load while nothing slides.
//!
//! While every contact sticks, body, friction springs and drive are linear. Under slow driving the
//! displacements are those of the start plus `b X`, where `X` is the way of the drive point,
//! `M b = sum_n e_n K_n d_n`, and `M` the stiffness of the stuck slider with its drive. The forces on the
//! whole slider balance, so
//!
//! `F_T = F_T(0) + K_eff X`, with `K_eff = k_t sum_n b_n`, and `k b_n` of each clamped end,
//!
//! and contact `n` bears the shear `tau_n = tau_n(0) + k_t b_n X`. For a side drive of a long chain that is
//! `K` in series with the end of the stuck chain, `1 / K_eff = 1 / K + 1 / (k (1 / q - 1))`, with `q` the
//! [decay per block](crate::theory::analytic::discrete_decay_per_block); for an even top drive `K` in series with
//! all friction springs, `1 / K_eff = 1 / K + 1 / (N k_t)`. Rigid contacts do not yield: there
//! `K_eff = sum_n K_n` and `tau_n = tau_n(0) + K_n d_n X`.
//!
//! Between the knots of the load's course, and up to the stop of the drive, `X` and the normal load are
//! linear in time, so every time below is the root of a linear equation. In a slab the shear and the normal
//! load of each contact are also linear in both. Over an area the shear is a vector, whose magnitude reaches
//! static friction at the root of a quadratic equation. Neglected are inertia, viscosity, and ageing, which
//! only delays slip.

use serde::Serialize;

use crate::body::chain::Stiffness;
use crate::plan::Plan;
use crate::plan::load::Ramp;
use crate::plan::slab;
use crate::scenario::choices::Start;
use crate::scenario::{Scenario, Time};
use crate::theory::medium::FaultEstimate;
use crate::theory::stability::Stability;
use crate::theory::weakening::Weakening;

/// Contacts slip together if their times differ relatively by at most this: some rounding errors of the
/// displacements.
const TOGETHER: f64 = 1e-9;

/// Predictions about a run from its scenario alone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Preview {
    /// Density of the slider, `rho = M / (L_x L_y L_z)`; `None` without inertia.
    pub density_kg_per_m3: Option<f64>,
    /// Speed `c` of long waves along the slider; where there are shear waves, that of these. `None` without inertia,
    /// where `c` is only the unit of front speeds.
    pub wave_speed_m_per_s: Option<f64>,
    /// Length over which a stuck chain screens a force on its end, `l_0`; `None` for others, and for laws
    /// without friction springs.
    pub decay_length_m: Option<f64>,
    /// The time step over the longest stable one; `None` where the solver chooses its steps.
    #[serde(skip)]
    pub step_ratio: Option<f64>,
    /// The time at which the first contact reaches its static friction; `None` if none ever does.
    pub first_slip_s: Option<f64>,
    /// That contact; `None` as well if several reach it together.
    pub first_slip_block: Option<u32>,
    /// The time at which `F_T / F_N` reaches `mu_d` if nothing slides before; `None` if it never does, and
    /// for a left-right drive, whose forces cancel in `F_T`.
    pub dynamic_load_s: Option<f64>,
    /// The time at which it reaches `mu_s`, on the same conditions.
    pub static_load_s: Option<f64>,
    /// The largest `F_T / F_N` within the duration of the run if nothing slides; sliding lowers it. `None`
    /// for a left-right drive.
    pub largest_load_ratio: Option<f64>,
    /// Whether load and first slip are predicted: not of a run that begins in a given state, and not where forces or
    /// loads of single contacts follow courses. Otherwise all of the above but material and time step is `None`.
    #[serde(skip)]
    pub is_predicted: bool,
    /// By rate-and-state, of which nothing sticks and all of the above but density and speed is `None`: the stability
    /// of steady sliding.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stability: Option<Stability>,
    /// In a medium, where all but density and speed is `None`: lengths of the fault line, and how long its run may take.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<FaultEstimate>,
    /// Where friction falls over a slip: how fast, and the length over which slip nucleates.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weakening: Option<Weakening>,
}

impl Scenario {
    /// Predictions about its run.
    pub fn preview(&self) -> Preview {
        Preview::of(self, &self.plan_at_rest())
    }

    /// The plan with a start at rest, from which a loaded start continues.
    pub(crate) fn plan_at_rest(&self) -> Plan {
        let time = Time { start: Start::AtRest, ..self.time.clone() };
        Plan::without_given_state(&Scenario { time, ..self.clone() })
    }

    /// Whether its blocks have inertia: by all laws but rate-and-state with `friction.inertia = false`.
    pub fn has_inertia(&self) -> bool {
        self.contact_law().rate_and_state().is_none_or(|law| law.inertia)
    }

    /// Density of the slider, `M / (L_x L_y L_z)`.
    pub(crate) fn density_kg_per_m3(&self) -> f64 {
        let slider = &self.slider;
        slider.mass_kg / slider.length_m / slider.width_m / slider.height_m
    }
}

impl Preview {
    /// The preview of a scenario whose plan, with a start at rest, is given.
    pub(crate) fn of(scenario: &Scenario, plan: &Plan) -> Preview {
        let has_inertia = scenario.has_inertia();
        let sliding = Preview {
            density_kg_per_m3: has_inertia.then(|| scenario.density_kg_per_m3()),
            wave_speed_m_per_s: has_inertia.then(|| plan.scales.wave_speed_m_per_s()),
            decay_length_m: plan.has_decay().then(|| plan.screening_length_m()),
            step_ratio: Some(plan.step_share()).filter(|_| plan.longest_stable_step_s.is_finite()),
            first_slip_s: None,
            first_slip_block: None,
            dynamic_load_s: None,
            static_load_s: None,
            largest_load_ratio: None,
            is_predicted: !scenario.initial.is_given() && !plan.has_contact_courses(),
            stability: Stability::of(plan),
            fault: FaultEstimate::of(plan),
            weakening: Weakening::of(plan),
        };
        if sliding.stability.is_some() || sliding.fault.is_some() || !sliding.is_predicted {
            return sliding;
        }
        let stuck = Stuck::of(plan);
        let stretches = stretches(plan, stuck.hold_step(plan));
        let time_s = |step: f64| step * plan.grid.step_s();
        let (first_slip_step, first_slip_block) = stuck.first_slip(&stretches);
        let pulls_one_way = !plan.drive.pulls_both_ways();
        let reaches = |ratio: f64| {
            let limit = Linear { per_factor: ratio * plan.total_normal_load_n, ..Linear::default() };
            let step = first_step(&stretches, |stretch| stretch.steps_to(stuck.driving_n, limit));
            step.filter(|_| pulls_one_way).map(time_s)
        };
        Preview {
            first_slip_s: first_slip_step.map(time_s),
            first_slip_block,
            dynamic_load_s: reaches(plan.friction.dynamic_coefficient),
            static_load_s: reaches(plan.friction.static_coefficient),
            largest_load_ratio: pulls_one_way.then(|| stuck.largest_load_ratio(plan, &stretches)),
            ..sliding
        }
    }
}

/// A force that is linear in the normal load over that of the start, `phi`, and in the way `X` of the
/// drive point.
#[derive(Debug, Clone, Copy, Default)]
struct Linear {
    fixed_n: f64,
    per_factor: f64,
    per_m: f64,
}

impl Linear {
    /// The force times a number.
    fn times(self, by: f64) -> Linear {
        Linear { fixed_n: self.fixed_n * by, per_factor: self.per_factor * by, per_m: self.per_m * by }
    }
}

/// Steps over which drive point and normal load change evenly.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    from_step: f64,
    /// Infinite for the last one.
    steps: f64,
    point_m: f64,
    point_m_per_step: f64,
    load: Ramp,
}

impl Stretch {
    /// A force after some of its steps.
    fn value_n(&self, force: Linear, steps: f64) -> f64 {
        let point_m = self.point_m + self.point_m_per_step * steps;
        force.fixed_n + self.load.ahead(steps).scaled_n(force.per_factor) + force.per_m * point_m
    }

    fn change_n_per_step(&self, force: Linear) -> f64 {
        self.load.change_n(force.per_factor) + force.per_m * self.point_m_per_step
    }

    /// After how many of its steps, or others, a force reaches a limit.
    fn steps_to(&self, force: Linear, limit: Linear) -> Option<f64> {
        let gap_n = self.value_n(limit, 0.0) - self.value_n(force, 0.0);
        let closing_n = self.change_n_per_step(force) - self.change_n_per_step(limit);
        if gap_n <= 0.0 { Some(0.0) } else { (closing_n > 0.0).then(|| gap_n / closing_n) }
    }

    /// After how many of its steps, or others, the magnitude of a force, given by its components, reaches a limit.
    fn steps_to_size(&self, force: [Linear; 2], limit: Linear) -> Option<f64> {
        let start = force.map(|force| self.value_n(force, 0.0));
        let change = force.map(|force| self.change_n_per_step(force));
        let (limit_n, limit_change_n) = (self.value_n(limit, 0.0), self.change_n_per_step(limit));
        let product = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
        // By how much the square of the magnitude is short: `gap - 2 half_rate s - curve s^2` after `s` steps.
        let gap = limit_n * limit_n - product(start, start);
        let half_rate = product(start, change) - limit_n * limit_change_n;
        let curve = product(change, change) - limit_change_n * limit_change_n;
        if gap <= 0.0 {
            return Some(0.0);
        }
        // The first positive root, in the form without cancellation. Without any, the magnitude stays below.
        let square = half_rate * half_rate + curve * gap;
        let steps = gap / (half_rate + square.max(0.0).sqrt());
        (square >= 0.0 && steps > 0.0).then_some(steps)
    }
}

/// Pieces of what is left of a ramp of the drive's velocity.
const CHORDS: u64 = 64;

/// The stretches of a plan whose drive stops in a step, `u64::MAX` for never.
fn stretches(plan: &Plan, hold_step: u64) -> Vec<Stretch> {
    let (mut all, mut step) = (Vec::new(), 0);
    loop {
        let outside = plan.outside(step, hold_step);
        let (mut end, mut point_m_per_step) = (outside.until_step(), outside.advance_m());
        if outside.acceleration() != 0.0 {
            // As on chords, which leave out a share of 1e-5 of the way.
            end = step + ((end - step) / CHORDS).max(1);
            point_m_per_step = (plan.outside(end, hold_step).point_m - outside.point_m) / (end - step) as f64;
        }
        let is_last = end == u64::MAX;
        all.push(Stretch {
            from_step: step as f64,
            steps: if is_last { f64::INFINITY } else { (end - step) as f64 },
            point_m: outside.point_m,
            point_m_per_step,
            load: outside.ramp(),
        });
        if is_last {
            return all;
        }
        step = end;
    }
}

/// The first step, if any, that is some steps after the beginning of a stretch and within it.
fn first_step(stretches: &[Stretch], steps_in: impl Fn(&Stretch) -> Option<f64>) -> Option<f64> {
    let step = stretches.iter().find_map(|stretch| {
        let steps = steps_in(stretch).filter(|steps| *steps <= stretch.steps)?;
        Some(stretch.from_step + steps)
    });
    step.filter(|step| step.is_finite())
}

/// The slider while all contacts stick.
struct Stuck {
    /// `F_T`.
    driving_n: Linear,
    /// The contacts.
    contacts: Vec<StuckContact>,
}

/// A stuck contact.
struct StuckContact {
    /// Its shear along the sliding direction.
    along: Linear,
    /// Its shear across, over an area.
    across: Option<Linear>,
    /// Its static friction.
    strength: Linear,
}

impl StuckContact {
    /// The first step in which it reaches its static friction; infinite if there is none.
    fn first_slip(&self, stretches: &[Stretch]) -> f64 {
        let step = match self.across {
            Some(across) => {
                first_step(stretches, |stretch| stretch.steps_to_size([self.along, across], self.strength))
            }
            None => {
                let slips = |along| first_step(stretches, |stretch| stretch.steps_to(along, self.strength));
                let either_way = [1.0, -1.0].map(|way| slips(self.along.times(way)));
                either_way.into_iter().flatten().reduce(f64::min)
            }
        };
        step.unwrap_or(f64::INFINITY)
    }
}

impl Stuck {
    fn of(plan: &Plan) -> Stuck {
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let mut pull_n_per_m = vec![0.0; plan.elastic.freedoms()];
        for spring in &plan.drive.springs {
            pull_n_per_m[spring.block] += spring.stiffness_n_per_m * spring.direction;
        }
        let at_start_n = slab::shear_at_start_n(plan);
        let threshold_n = &plan.friction.static_threshold_n;
        let mut contacts: Vec<StuckContact> = match plan.elastic.as_chain() {
            Some(chain) => {
                let mut shear_n_per_m = pull_n_per_m;
                if kt > 0.0 {
                    Stiffness::of(plan, &chain).solve(&mut shear_n_per_m);
                    let springs = &plan.friction.springs_n_per_m;
                    shear_n_per_m.iter_mut().zip(springs).for_each(|(moved, kt)| *moved *= kt);
                }
                (0..plan.blocks)
                    .map(|n| {
                        let along =
                            Linear { fixed_n: at_start_n[n], per_factor: 0.0, per_m: shear_n_per_m[n] };
                        let strength = Linear { per_factor: threshold_n[n], ..Linear::default() };
                        StuckContact { along, across: None, strength }
                    })
                    .collect()
            }
            None => {
                let lattice = &plan.elastic;
                let driven = slab::stuck_m(lattice, kt, &plan.drive.springs, pull_n_per_m);
                // If the load is constant, the loaded state is not needed.
                let loaded = if plan.load_course.is_constant() {
                    plan.initial.displacement_m.clone()
                } else {
                    let pressed_n = slab::pressed_n(lattice, &plan.top_load_n);
                    slab::stuck_m(lattice, kt, &plan.drive.springs, pressed_n)
                };
                let mu_s = &plan.friction.static_coefficients;
                let linear = |at_start_n: f64, loaded_n: f64, driven_n: f64| Linear {
                    fixed_n: at_start_n - loaded_n,
                    per_factor: loaded_n,
                    per_m: driven_n,
                };
                let shear = |of_contact: usize| {
                    let freedom = lattice.tangential_freedom(of_contact);
                    linear(at_start_n[of_contact], kt * loaded[freedom], kt * driven[freedom])
                };
                let strength = |n: usize| match lattice.table.upward() {
                    None => Linear { per_factor: threshold_n[n], ..Linear::default() },
                    Some(upward) => {
                        let rise = upward * lattice.nodes() + n;
                        let borne_n = |u: &[f64]| -lattice.foundation_n_per_m * mu_s[n] * u[rise];
                        linear(threshold_n[n], borne_n(&loaded), borne_n(&driven))
                    }
                };
                let is_over_area = lattice.tangential_axes() > 1;
                let contact = |n: usize| StuckContact {
                    along: shear(n),
                    across: is_over_area.then(|| shear(plan.blocks + n)),
                    strength: strength(n),
                };
                (0..plan.blocks).map(contact).collect()
            }
        };
        // Junctions yield before the last of them has reached its strength.
        if let Some(law) = plan.friction.law.junctions() {
            let friction = &plan.friction;
            for (n, StuckContact { strength, .. }) in contacts.iter_mut().enumerate() {
                let (mu_s, mu_d) = (friction.static_coefficients[n], friction.dynamic_coefficients[n]);
                let shear = at_start_n[n] / plan.normal_load_n[n];
                let yields = law.yield_coefficient(n, shear, [mu_s, mu_d]) / mu_s;
                if yields.is_finite() {
                    *strength = strength.times(yields);
                }
            }
        }
        // Sum of the forces on the contacts, less their initial values without a drive.
        let sum = |part: fn(&Linear) -> f64| contacts.iter().map(|contact| part(&contact.along)).sum::<f64>();
        let per_factor = sum(|shear| shear.per_factor);
        let to_walls = plan.end_bonds.iter().filter(|bond| bond.other.is_none() && kt > 0.0);
        let of_walls: f64 = to_walls
            .map(|bond| {
                let moved = contacts[bond.block].along.per_m / plan.friction.springs_n_per_m[bond.block];
                bond.stiffness_n_per_m * moved
            })
            .sum();
        let driving_n = Linear {
            fixed_n: plan.drive.total_force_n(0.0, &plan.initial.displacement_m) - per_factor,
            per_factor,
            per_m: sum(|shear| shear.per_m) + of_walls,
        };
        Stuck { driving_n, contacts }
    }

    /// The step in which the drive stops; `u64::MAX` if it never does.
    fn hold_step(&self, plan: &Plan) -> u64 {
        match plan.drive.until_load_ratio {
            None => plan.drive.hold_from_step.unwrap_or(u64::MAX),
            Some(ratio) => {
                let limit = Linear { per_factor: ratio * plan.total_normal_load_n, ..Linear::default() };
                let until_limit = |stretch: &Stretch| stretch.steps_to(self.driving_n, limit);
                let step = first_step(&stretches(plan, u64::MAX), until_limit);
                // The cast saturates.
                step.map_or(u64::MAX, |step| step.ceil().max(1.0) as u64)
            }
        }
    }

    /// The first step in which a contact reaches its static friction, and that contact if it is a single
    /// one.
    fn first_slip(&self, stretches: &[Stretch]) -> (Option<f64>, Option<u32>) {
        let mut first = (f64::INFINITY, None);
        for (block, contact) in (1..).zip(&self.contacts) {
            let step = contact.first_slip(stretches);
            if step < first.0 * (1.0 - TOGETHER) {
                first = (step, Some(block));
            } else if step <= first.0 * (1.0 + TOGETHER) {
                first = (first.0.min(step), None);
            }
        }
        (Some(first.0).filter(|step| step.is_finite()), first.1.filter(|_| first.0.is_finite()))
    }

    /// The largest `F_T / F_N` up to the end of a run. Over a stretch it is monotonic, so the ends suffice.
    fn largest_load_ratio(&self, plan: &Plan, stretches: &[Stretch]) -> f64 {
        let normal = Linear { per_factor: plan.total_normal_load_n, ..Linear::default() };
        let end = plan.steps as f64;
        stretches
            .iter()
            .filter(|stretch| stretch.from_step <= end)
            .flat_map(|stretch| [0.0, stretch.steps.min(end - stretch.from_step)].map(|at| (stretch, at)))
            .map(|(stretch, at)| stretch.value_n(self.driving_n, at) / stretch.value_n(normal, at))
            .fold(f64::NEG_INFINITY, f64::max)
    }
}

#[cfg(test)]
mod tests {
    use super::Preview;
    use crate::resolve;
    use crate::theory::analytic::discrete_decay_per_block;
    use crate::{Scenario, ScenarioSource};

    fn scenario(sets: &[&str]) -> Scenario {
        let source =
            sets.iter().fold(ScenarioSource::new("test", ""), |source, set| source.with_override(set));
        Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}"))
    }

    fn preview(sets: &[&str]) -> Preview {
        scenario(sets).preview()
    }

    #[track_caller]
    fn is(found: Option<f64>, expected: f64, tolerance: f64) {
        let found = found.expect("there is one");
        assert!((found / expected - 1.0).abs() < tolerance, "{found}, not {expected}");
    }

    /// `k = E (N - 1) A / L`, `k_t = k`, `V = 1e-4 m/s`, `F_N = 400 N`.
    const SPRING_N_PER_M: f64 = 2.475e8;

    #[test]
    fn the_material_is_that_of_plexiglass() {
        let stated = preview(&["parameter_set=as-stated"]);
        is(stated.density_kg_per_m3, 1200.0, 1e-12);
        is(stated.wave_speed_m_per_s, (2.5e9_f64 / 1200.0).sqrt() * (100.0_f64 / 99.0).sqrt(), 1e-2);
        is(stated.decay_length_m, 0.1 / 99.0, 1e-12);
        let slab = resolve::<&str>("slab", &[]).unwrap().preview();
        is(slab.density_kg_per_m3, 1200.0, 1e-9);
        is(slab.wave_speed_m_per_s, 993.0, 1e-3);
        assert_eq!(slab.decay_length_m, None);
        assert_eq!(preview(&["friction.law=rigid"]).decay_length_m, None);
    }

    #[test]
    fn a_side_drive_is_in_series_with_the_end_of_the_stuck_chain() {
        for ratio in [0.01, 1.0, 10.0] {
            let set = format!("friction.interfacial_stiffness_ratio={ratio}");
            let found = preview(&["slider.blocks=400", &set]);
            let k = SPRING_N_PER_M * 399.0 / 99.0;
            let q = discrete_decay_per_block(ratio);
            let end_n_per_m = k * (1.0 / q - 1.0);
            let in_series_n_per_m = 1.0 / (1.0 / 8e5 + 1.0 / end_n_per_m);
            let load_per_s = in_series_n_per_m * 1e-4 / 400.0;
            is(found.dynamic_load_s, 0.45 / load_per_s, 1e-9);
            is(found.static_load_s, 0.7 / load_per_s, 1e-9);
            is(found.largest_load_ratio, 5.0 * load_per_s, 1e-9);
            // Block 1 bears the share k_t / (k (1 / q - 1)) = 1 - q of the drive.
            is(found.first_slip_s, 0.7 / 400.0 / (1.0 - q) / load_per_s, 1e-9);
            assert_eq!(found.first_slip_block, Some(1));
        }
    }

    #[test]
    fn a_top_drive_is_in_series_with_all_friction_springs() {
        let found = preview(&["drive.kind=top"]);
        let load_per_s = 1e-4 / 400.0 / (1.0 / 8e5 + 0.01 / SPRING_N_PER_M);
        is(found.dynamic_load_s, 0.45 / load_per_s, 1e-9);
        // All contacts slip at once, when F_T/F_N is mu_s.
        is(found.first_slip_s, 0.7 / load_per_s, 1e-9);
        assert_eq!(found.first_slip_block, None);
        let tilted = preview(&["drive.kind=top", "drive.tilt=0.5"]);
        assert_eq!(tilted.first_slip_block, Some(1));
        assert!(tilted.first_slip_s < found.first_slip_s);
    }

    #[test]
    fn rigid_contacts_do_not_yield() {
        let found = preview(&["friction.law=rigid"]);
        is(found.dynamic_load_s, 0.45 * 400.0 / 80.0, 1e-12);
        is(found.first_slip_s, 0.7 * 4.0 / 80.0, 1e-12);
    }

    /// Steps and contacts of the first slips of sheets by an independent program (fixtures/reference/area).
    #[test]
    fn over_an_area_the_magnitude_of_the_shear_decides() {
        let sheet = |sets: &[&str]| resolve("sheet-coarse", sets).unwrap().preview();
        let side = sheet(&[]);
        is(side.first_slip_s, 578_993.0 * 4e-7, 1e-4);
        assert_eq!(side.first_slip_block, None, "the ends of the driven edge");
        let corner = sheet(&["drive.across=1"]);
        is(corner.first_slip_s, 107_633.0 * 4e-7, 1e-4);
        assert_eq!(corner.first_slip_block, Some(1));
        // As long as nothing slips, forces are those of the plan at any load.
        let half = ["normal_load.total_n=200", "drive.velocity_m_per_s=5e-5"];
        is(sheet(&half).first_slip_s, side.first_slip_s.unwrap(), 1e-9);
        // Unloaded while it is pulled, a sheet slips earlier.
        let falls = ["normal_load.schedule_s=[0,0.4]", "normal_load.schedule_n=[400,200]"];
        let earlier_s = sheet(&falls).first_slip_s.unwrap();
        // 400 N (1 - t / 0.8 s) = F(t), with F = 400 N at the first slip under a constant load.
        is(Some(earlier_s), 1.0 / (1.0 / side.first_slip_s.unwrap() + 1.0 / 0.8), 1e-9);
    }

    #[test]
    fn a_left_right_drive_has_a_first_slip_and_no_load() {
        let found = preview(&["drive.kind=left-right", "friction.reattach=two-way"]);
        assert_eq!((found.dynamic_load_s, found.static_load_s, found.largest_load_ratio), (None, None, None));
        let side = preview(&[]);
        is(found.first_slip_s, side.first_slip_s.expect("it slips"), 1e-9);
        assert_eq!(found.first_slip_block, None, "both ends at once");
    }

    #[test]
    fn a_drive_that_stops_and_a_load_that_falls_are_followed() {
        let rigid = |sets: &[&str]| preview(&[&["friction.law=rigid"], sets].concat());
        // 80 N/s for 1 s.
        let held = rigid(&["drive.hold_from_s=1"]);
        is(held.largest_load_ratio, 0.2, 1e-12);
        assert_eq!((held.dynamic_load_s, held.static_load_s), (None, None));
        let stopped = rigid(&["drive.until_load_ratio=0.2"]);
        is(stopped.largest_load_ratio, 0.2, 1e-6);
        // From 1 s on the load falls from 400 N by 100 N/s: mu_d at 80/0.45 N.
        let falls = ["normal_load.schedule_n=[400,100]"];
        let unloaded =
            rigid(&[&["drive.hold_from_s=1", "normal_load.schedule_s=[1,4]"], &falls[..]].concat());
        is(unloaded.dynamic_load_s, 1.0 + (400.0 - 80.0 / 0.45) / 100.0, 1e-12);
        is(unloaded.largest_load_ratio, 0.8, 1e-12);
        let from_hold = [
            "drive.until_load_ratio=0.2",
            "normal_load.schedule_from=hold",
            "normal_load.schedule_s=[0,3]",
            falls[0],
        ];
        is(rigid(&from_hold).dynamic_load_s, unloaded.dynamic_load_s.expect("it is reached"), 1e-6);
        // Without a moving drive nothing changes.
        let still = rigid(&["drive.velocity_m_per_s=0"]);
        assert_eq!((still.first_slip_s, still.static_load_s), (None, None));
        assert_eq!(still.largest_load_ratio, Some(0.0));
    }

    #[test]
    fn shear_at_the_start_counts() {
        let side = preview(&[]).first_slip_s.expect("it slips");
        // A prestress is balanced by friction springs, and brings each contact closer to its threshold.
        is(preview(&["prestress.ratio=0.35"]).first_slip_s, side / 2.0, 1e-9);
        assert_eq!(preview(&["initial_shear.beta=0.77"]).first_slip_s, Some(0.0));
        // Initial shear is negative at the driven end.
        is(preview(&["initial_shear.beta=0.35"]).first_slip_s, side * 1.5, 1e-9);
        let loaded = preview(&["time.start=loaded"]);
        assert_eq!(loaded.first_slip_s, Some(side), "as with a start at rest");
    }
}
