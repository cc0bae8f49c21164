//! From a resolved scenario to a plan.

use crate::body::ends::{EndBond, absorbing_kg_per_s};
use crate::body::lattice::{self, Lattice};
use crate::law::junctions::Junctions;
use crate::law::laws::Law;
use crate::plan::course::{ContactCourse, Course, Swing, by_contact};
use crate::plan::disorder::{Quantity, coefficients};
use crate::plan::given_state::GivenState;
use crate::plan::initial;
use crate::plan::load;
use crate::plan::medium::FaultLine;
use crate::plan::slab;
use crate::plan::state::SliderState;
use crate::plan::{Ageing, Drive, DriveSpring, Friction, Plan, RecordingPlan, RuptureFields, WindowPlan};
use crate::scenario::Scenario;
use crate::scenario::choices::{DriveKind, End, ScheduleFrom, Start};
use asperity_record::{Parts, Scales, TimeGrid};

impl Plan {
    /// Derives the numbers of the physics from a resolved scenario.
    pub fn new(scenario: &Scenario) -> Plan {
        let mut plan = Plan::without_given_state(scenario);
        let given = GivenState::of(scenario).expect("a resolved scenario has a state that can be read");
        if let Some(given) = given {
            given.begin(scenario, &mut plan);
        }
        plan
    }

    /// The plan of a run that does not begin in the state that its scenario gives.
    pub fn without_given_state(scenario: &Scenario) -> Plan {
        let springs = Springs::of(scenario);
        let (blocks, kt) = (springs.elastic.contacts(), springs.interfacial_stiffness_n_per_m);
        let pressed_n = pressed_n(scenario);
        // The load on top of a body with a foundation reaches its contacts through its elasticity.
        let (normal_load_n, top_load_n, displacement_at_rest_m) = match springs.pressed(&pressed_n) {
            None => (pressed_n, Vec::new(), None),
            Some((normal_load_n, u)) => (normal_load_n, pressed_n, Some(u)),
        };
        let springs_n_per_m = springs.springs_n_per_m(scenario);
        let friction = &scenario.friction;
        let (mu_s, mu_d) = coefficients(scenario);
        let [mean_mu_s, mean_mu_d] = scenario.mean_coefficients();
        let scaled = |factors: &[f64]| factors.iter().zip(&normal_load_n).map(|(mu, p)| mu * p).collect();
        let grid = TimeGrid::new(scenario.time.step_s);
        let steps =
            |seconds| grid.whole_steps(seconds).expect("a resolved scenario has whole numbers of steps");
        let ageing = (friction.ageing_coefficient > 0.0).then(|| Ageing {
            coefficient: friction.ageing_coefficient,
            growth_n: normal_load_n.iter().map(|p| friction.ageing_coefficient * p).collect(),
            time_s: friction.ageing_time_s,
        });
        let load = &scenario.normal_load;
        let mut drive = drive(scenario, &springs.elastic, steps);
        let prestress_n = initial::prestress_n(scenario, &normal_load_n);
        let prestress_course = ContactCourse::new(
            scenario.prestress.course_s.iter().map(|time_s| steps(*time_s)).collect(),
            by_contact(&scenario.prestress.course_ratio, &scenario.prestress.course_s, blocks)
                .map(|ratios| ratios.iter().zip(&normal_load_n).map(|(ratio, p)| ratio * p).collect())
                .collect(),
        );
        // What the friction springs balance at the start, besides the springs of the drive.
        let mut start_n = prestress_n.clone();
        if prestress_course.is_some() || drive.force_n.is_some() {
            start_n.resize(blocks, 0.0);
            let course_n = prestress_course.as_ref().map_or(&[][..], |course| course.at_start());
            start_n.iter_mut().zip(course_n).for_each(|(force, course)| *force += course);
            start_n[0] += drive.force_n.as_ref().map_or(0.0, |force_n| force_n.value(0, u64::MAX));
        }
        let mut initial = match displacement_at_rest_m {
            Some(displacement_m) => {
                // Its driving springs are relaxed there.
                for spring in &mut drive.springs {
                    spring.rest_m = displacement_m[spring.block];
                }
                SliderState {
                    velocity_m_per_s: vec![0.0; displacement_m.len()],
                    stick_position_m: vec![0.0; springs.elastic.tangential_axes() * blocks],
                    displacement_m,
                    ..SliderState::default()
                }
            }
            None => initial::state(
                scenario,
                &springs.elastic,
                springs.spacing_m,
                &springs_n_per_m,
                &drive,
                &normal_load_n,
                &start_n,
            ),
        };
        initial.hold_step = drive.hold_from_step.unwrap_or(u64::MAX);
        let law = scenario.contact_law();
        let contact_stiffness_n_per_m = contact_stiffness_n_per_m(law, &normal_load_n);
        // Mean anchors of junctions, found for friction springs, where contacts of these stiffnesses hold the same forces.
        let anchors = initial.stick_position_m.iter_mut().zip(&initial.displacement_m);
        for ((anchor, u), stiffness) in anchors.zip(&contact_stiffness_n_per_m) {
            *anchor = u - kt / stiffness * (u - *anchor);
        }
        let end_bonds = springs.end_bonds(scenario, &initial.displacement_m);
        let mut plan = Plan {
            blocks,
            length_m: scenario.slider.length_m,
            spacing_m: springs.spacing_m,
            block_mass_kg: springs.block_mass_kg,
            elastic: springs.elastic,
            end_bonds,
            medium: None,
            friction: Friction {
                law,
                static_coefficient: mean_mu_s,
                dynamic_coefficient: mean_mu_d,
                interfacial_stiffness_n_per_m: kt,
                springs_n_per_m,
                contact_stiffness_n_per_m,
                static_threshold_n: scaled(&mu_s),
                dynamic_friction_n: scaled(&mu_d),
                static_coefficients: mu_s,
                dynamic_coefficients: mu_d,
                weakening_slip_m: if scenario.weakens_by_slip() {
                    scenario.weakening_slip_m()
                } else {
                    Vec::new()
                },
                ageing,
                evolution_effects: evolution_effects(scenario),
            },
            total_normal_load_n: load.total_n,
            load_course: Course::new(
                1.0,
                load.schedule_s.iter().map(|time_s| steps(*time_s)).collect(),
                load.schedule_n.iter().map(|total_n| total_n / load.total_n).collect(),
                load.schedule_from == ScheduleFrom::Hold,
            ),
            initial,
            given: None,
            top_load_n,
            prestress_course,
            swing: (scenario.prestress.swing_ratio != 0.0).then(|| Swing {
                ratio: scenario.prestress.swing_ratio,
                period_s: scenario.prestress.swing_period_s,
                from_s: grid.time_s(steps(scenario.prestress.swing_from_s)),
            }),
            contact_load_course: ContactCourse::new(
                load.course_s.iter().map(|time_s| steps(*time_s)).collect(),
                by_contact(&load.course_factor, &load.course_s, blocks).collect(),
            ),
            prestress_n,
            drive,
            normal_load_n,
            grid,
            longest_stable_step_s: scenario.longest_stable_step_s(),
            steps: steps(scenario.time.duration_s),
            scales: springs.scales(scenario),
            recording: RecordingPlan {
                sample_every_steps: steps(scenario.recording.sample_s),
                fields_every_steps: steps(scenario.recording.fields_s),
                event_fields: scenario.recording.event_fields,
                windows: scenario
                    .recording
                    .window
                    .iter()
                    .map(|window| WindowPlan {
                        from_step: steps(window.from_s),
                        to_step: steps(window.to_s),
                        every_steps: steps(window.every_s),
                        blocks: window.first_block as usize - 1..window.last_block as usize,
                    })
                    .collect(),
                rupture_fields: match scenario.recording.rupture_fields_from_blocks {
                    0 => None,
                    from_blocks => Some(RuptureFields {
                        from_blocks,
                        every_steps: steps(scenario.recording.rupture_fields_s),
                    }),
                },
                series_every: scenario.recording.series_every.into(),
                series_blocks: scenario.series_nodes(),
            },
        };
        let fault = FaultLine::of(scenario);
        match plan.friction.law.rate_and_state() {
            Some(_) if let Some(FaultLine { medium, velocity_m_per_s, states }) = fault => {
                plan.initial.velocity_m_per_s = vec![velocity_m_per_s; blocks];
                plan.initial.friction_state = states;
                plan.total_normal_load_n = plan.normal_load_n.iter().sum();
                plan.medium = Some(Box::new(medium));
            }
            Some(law) => initial::start_in_state(&mut plan, scenario, &law, &start_n),
            None if scenario.time.start == Start::Loaded => initial::start_loaded(&mut plan),
            None => {}
        }
        plan.initial = SliderState::stuck(&plan);
        if let Some(medium) = &plan.medium {
            let radiated = medium.radiation_pa_s_per_m();
            let shear_pa = |n: usize| medium.prestress_pa[n] - radiated * plan.initial.velocity_m_per_s[n];
            plan.initial.tangential_force_n = (0..blocks).map(|n| shear_pa(n) * medium.cell_m(n)).collect();
        }
        plan
    }
}

/// The points and springs of the drive, and when it stops.
fn drive(scenario: &Scenario, lattice: &Lattice, steps: impl Fn(f64) -> u64) -> Drive {
    let drive = &scenario.drive;
    let (stiffness, blocks) = (drive.stiffness_n_per_m, lattice.contacts());
    let spring = |block, stiffness_n_per_m, direction| DriveSpring {
        block,
        stiffness_n_per_m,
        rest_m: 0.0,
        direction,
    };
    let top_row = lattice.top_row().start;
    let springs = match drive.kind {
        DriveKind::Side => {
            let across = lattice.first_column(drive_row(scenario)).enumerate();
            let is_driven = |lane: usize| drive.across == 0 || lane + 1 == drive.across as usize;
            let driven = across.filter(|(lane, _)| is_driven(*lane));
            driven.map(|(_, node)| spring(node, side_stiffness_n_per_m(scenario), 1.0)).collect()
        }
        DriveKind::Force | DriveKind::Plate => Vec::new(),
        DriveKind::LeftRight => vec![spring(0, stiffness, -1.0), spring(blocks - 1, stiffness, 1.0)],
        DriveKind::Top => top_stiffness_n_per_m(scenario)
            .into_iter()
            .enumerate()
            .filter(|(_, stiffness)| *stiffness > 0.0)
            .map(|(block, stiffness)| spring(top_row + block, stiffness, 1.0))
            .collect(),
    };
    let knots = || drive.course_s.iter().map(|time_s| steps(*time_s)).collect();
    Drive {
        springs,
        velocity_m_per_s: drive.velocity_m_per_s,
        force_n: (drive.kind == DriveKind::Force).then(|| {
            let at_start_n = drive.course_n.first().copied().unwrap_or(0.0);
            Course::new(at_start_n, knots(), drive.course_n.clone(), false)
        }),
        course: (!drive.course_m_per_s.is_empty())
            .then(|| Course::new(drive.velocity_m_per_s, knots(), drive.course_m_per_s.clone(), false)),
        offset_m: 0.0,
        hold_from_step: (drive.hold_from_s > 0.0).then(|| steps(drive.hold_from_s)),
        until_load_ratio: (drive.until_load_ratio > 0.0).then_some(drive.until_load_ratio),
    }
}

/// The normal load of each contact, or of each node at the top of a body on a foundation. Disordered loads are scaled
/// so that they add up to the total.
fn pressed_n(scenario: &Scenario) -> Vec<f64> {
    if let Some(FaultLine { medium, .. }) = FaultLine::of(scenario) {
        return medium
            .normal_stress_pa
            .iter()
            .enumerate()
            .map(|(n, sigma)| sigma * medium.cell_m(n))
            .collect();
    }
    let (load, slider) = (&scenario.normal_load, &scenario.slider);
    let mut loads_n = load::tilted(load.total_n, load.tilt, slider.blocks as usize, slider.across as usize);
    if !Quantity::Load.is_even(scenario) {
        let factors = Quantity::Load.values(scenario);
        loads_n.iter_mut().zip(factors).for_each(|(load_n, factor)| *load_n *= factor);
        let scale = load.total_n / loads_n.iter().sum::<f64>();
        loads_n.iter_mut().for_each(|load_n| *load_n *= scale);
    }
    loads_n
}

/// The row that a side drive pulls at, counted from 0 at the bottom: the one nearest to its height.
pub(crate) fn drive_row(scenario: &Scenario) -> usize {
    // The cast saturates.
    (scenario.drive.height_m / scenario.slider.spacing_m()).round() as usize
}

/// `K_n` of a side drive: all of `K` at one node, or an equal part at each across.
fn side_stiffness_n_per_m(scenario: &Scenario) -> f64 {
    let driven = if scenario.drive.across == 0 { scenario.slider.across } else { 1 };
    scenario.drive.stiffness_n_per_m / f64::from(driven)
}

/// `K_n` of a top drive, row by row across: the total `K`, spread evenly, with a tilt along the slider like that
/// of the normal load (5.18), or decaying exponentially from the end at which a side drive would push.
fn top_stiffness_n_per_m(scenario: &Scenario) -> Vec<f64> {
    let drive = &scenario.drive;
    let (columns, across) = (scenario.slider.blocks as usize, scenario.slider.across as usize);
    if drive.decay_length_m == 0.0 {
        return load::tilted(drive.stiffness_n_per_m, drive.tilt, columns, across);
    }
    let spacing_m = scenario.slider.spacing_m();
    let shares: Vec<f64> =
        (0..columns).map(|n| libm::exp(-(n as f64 * spacing_m) / drive.decay_length_m)).collect();
    let all = shares.iter().sum::<f64>() * across as f64;
    let of_row = shares.iter().map(|share| drive.stiffness_n_per_m * (share / all));
    of_row.collect::<Vec<f64>>().repeat(across)
}

/// `b` of every block, offsets included; empty by laws other than rate-and-state.
pub(crate) fn evolution_effects(scenario: &Scenario) -> Vec<f64> {
    if let Some(FaultLine { medium, .. }) = FaultLine::of(scenario) {
        return medium.evolution_effect;
    }
    let Some(law) = scenario.contact_law().rate_and_state() else { return Vec::new() };
    let offset = |n: usize| scenario.friction.evolution_offsets.get(n).copied().unwrap_or(0.0);
    (0..scenario.slider.contacts() as usize).map(|n| law.evolution_effect + offset(n)).collect()
}

/// Link time of ruptures in a medium: in BP1-QD neighbours cross 1 mm/s up to 19 s apart where the tip stops.
const MEDIUM_LINK_TIME_S: f64 = 30.0;

/// The slider's constants, needed before there is a plan.
struct Springs {
    spacing_m: f64,
    block_mass_kg: f64,
    elastic: Lattice,
    /// Elastic modulus times the width of the slider; over an area, times the spacing.
    modulus_n_per_m: f64,
    interfacial_stiffness_n_per_m: f64,
}

impl Springs {
    fn of(scenario: &Scenario) -> Springs {
        let slider = &scenario.slider;
        let (modulus_pa, spacing_m) = (slider.youngs_modulus_pa, slider.spacing_m());
        let counts @ [_, across, rows] =
            [slider.blocks, slider.across, slider.rows].map(|count| count as usize);
        let nodes = counts.map(|count| count as f64).into_iter().product::<f64>();
        let medium = Some(&scenario.medium).filter(|_| slider.is_in_medium());
        // Nodes in a medium as if joined by cells of it, which gives them its shear waves.
        let block_mass_kg =
            medium.map_or(slider.mass_kg / nodes, |medium| medium.density_kg_per_m3 * spacing_m * spacing_m);
        // The shear modulus of planes, `rho c_S^2 = k / (2 L_y) = 3 E / 8`, and of bodies, `k / a`.
        let (table, stiffness_n_per_m, modulus_n_per_m) = match (across > 1, rows > 1) {
            _ if let Some(medium) = medium => {
                (&lattice::CHAIN, medium.shear_modulus_pa, medium.shear_modulus_pa)
            }
            (false, false) => {
                (&lattice::CHAIN, slider.chain_stiffness_n_per_m(), modulus_pa * slider.width_m)
            }
            (false, true) => {
                let k = 0.75 * slider.width_m * modulus_pa;
                (&lattice::SLAB, k, 0.5 * k)
            }
            (true, false) => {
                let k = 0.75 * slider.height_m * modulus_pa;
                (&lattice::SHEET, k, 0.375 * modulus_pa * spacing_m)
            }
            (true, true) => {
                let k = 0.4 * modulus_pa * spacing_m;
                (&lattice::BLOCK, k, k)
            }
        };
        let foundation_ratio = match table.upward() {
            Some(_) => scenario.normal_load.foundation_stiffness_ratio,
            None => 0.0,
        };
        let elastic = Lattice {
            stiffness_n_per_m,
            damping_kg_per_s: slider.relative_damping * (stiffness_n_per_m * block_mass_kg).sqrt(),
            foundation_n_per_m: foundation_ratio * stiffness_n_per_m,
            ..Lattice::of(table, counts)
        };
        Springs {
            spacing_m,
            block_mass_kg,
            elastic,
            modulus_n_per_m,
            interfacial_stiffness_n_per_m: match scenario.contact_law() {
                law if law.holds() || !law.word().sticks() => 0.0,
                Law::Junctions(law) => {
                    law.stiffness_n_per_m(scenario.normal_load.total_n / f64::from(slider.contacts()))
                }
                _ => scenario.friction.interfacial_stiffness_ratio * stiffness_n_per_m,
            },
        }
    }

    /// `k_t` of each contact.
    fn springs_n_per_m(&self, scenario: &Scenario) -> Vec<f64> {
        let kt = self.interfacial_stiffness_n_per_m;
        match Quantity::Stiffness.is_even(scenario) {
            true => vec![kt; self.elastic.contacts()],
            false => Quantity::Stiffness.values(scenario).iter().map(|factor| kt * factor).collect(),
        }
    }

    /// The normal load of each contact of a body on a foundation at rest, and the displacements of its freedoms.
    fn pressed(&self, top_load_n: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        self.elastic.has_foundation().then(|| {
            let lattice = &self.elastic;
            let force_n = slab::pressed_n(lattice, top_load_n);
            let u = slab::stuck_m(lattice, self.interfacial_stiffness_n_per_m, &[], force_n);
            (slab::normal_load_n(lattice, &u), u)
        })
    }

    /// The bonds at the ends, relaxed at these displacements.
    fn end_bonds(&self, scenario: &Scenario, displacement_m: &[f64]) -> Vec<EndBond> {
        self.elastic.as_chain().map_or_else(Vec::new, |chain| {
            EndBond::of(scenario.ends(), &chain, self.block_mass_kg, displacement_m)
        })
    }

    fn scales(&self, scenario: &Scenario) -> Scales {
        let block_time_s = (self.block_mass_kg / self.elastic.slowest_wave_n_per_m()).sqrt();
        let given_ratio = scenario.detection.link_time_ratio;
        // Switches of junctions neither stretch nor relax a friction spring, and a slow front may rest at a
        // contact until junctions behind it are pinned.
        let (link_time_ratio, kt) = match scenario.contact_law() {
            Law::Junctions(law) => (given_ratio.max(2.0 * law.healing_time_s / block_time_s), 0.0),
            _ if scenario.slider.is_in_medium() => (given_ratio.max(MEDIUM_LINK_TIME_S / block_time_s), 0.0),
            _ => (given_ratio, self.interfacial_stiffness_n_per_m),
        };
        Scales {
            block_length_m: self.spacing_m,
            block_time_s,
            link_time_ratio,
            modulus_n_per_m: self.modulus_n_per_m,
            interfacial_stiffness_n_per_m: kt,
        }
    }
}

impl Scenario {
    /// The blocks that series have, counted from 0: those of a list, or the nodes nearest to stations.
    pub(crate) fn series_nodes(&self) -> Vec<usize> {
        let (recording, spacing_m) = (&self.recording, self.slider.spacing_m());
        // The casts saturate.
        let nearest = |depth_m: &f64| (depth_m / spacing_m - self.medium.first_node.cells()).round() as usize;
        let stations =
            recording.stations_m.iter().map(nearest).map(|n| n.min(self.slider.blocks as usize - 1));
        recording.series_blocks.iter().map(|n| *n as usize - 1).chain(stations).collect()
    }

    /// How many junctions each contact has, `N_s`; 0 by laws without junctions.
    pub fn junction_count(&self) -> u32 {
        self.contact_law().junctions().map_or(0, |_| self.friction.junction_count)
    }

    /// `mu_s` and `mu_d` without offsets; of rate-and-state, which has neither, `f_0`.
    pub fn mean_coefficients(&self) -> [f64; 2] {
        match self.contact_law().rate_and_state() {
            Some(law) => [law.reference_coefficient; 2],
            None => [self.friction.static_coefficient, self.friction.dynamic_coefficient],
        }
    }

    /// Whether sliding contacts, nodes in a medium or the ends of a chain radiate.
    pub fn radiates(&self) -> bool {
        self.slider.is_in_medium()
            || self.contact_law().radiation_kg_per_s() > 0.0
            || self.ends().contains(&End::Absorbing)
    }

    /// Whether the theory of the thesis applies to its slider: [`Lattice::has_theory`], with free ends.
    pub fn has_theory(&self) -> bool {
        !self.slider.is_in_medium() && self.elastic().has_theory() && self.ends() == [End::Free; 2]
    }

    /// What the first and the last block of a chain are joined to.
    fn ends(&self) -> [End; 2] {
        [self.slider.left_end, self.slider.right_end]
    }

    /// `D_c` of each contact.
    pub fn weakening_slip_m(&self) -> Vec<f64> {
        let friction = &self.friction;
        let offset_m = |n: usize| friction.weakening_slip_offsets_m.get(n).copied().unwrap_or(0.0);
        (0..self.slider.contacts() as usize).map(|n| friction.weakening_slip_m + offset_m(n)).collect()
    }

    /// Whether friction falls with slip at any contact, instead of at once.
    pub fn weakens_by_slip(&self) -> bool {
        let law = self.friction.law;
        law.uses("friction.weakening_slip_m") && self.weakening_slip_m().iter().any(|slip_m| *slip_m > 0.0)
    }

    /// Whether contacts have a state, by rate-and-state friction.
    pub fn has_state(&self) -> bool {
        self.contact_law().rate_and_state().is_some()
    }

    /// What its run has that others lack.
    pub fn parts(&self) -> Parts {
        Parts {
            junctions: self.junction_count() > 0,
            area: self.elastic().layout().is_area(),
            recording: false,
            radiation: self.radiates(),
            weakening: self.weakens_by_slip(),
            state: self.has_state(),
            series: self.recording.series_every > 0,
        }
    }

    /// The scales of the scenario's slider, without deriving the rest of its plan.
    pub fn scales(&self) -> Scales {
        Springs::of(self).scales(self)
    }

    /// The elastic body of its slider, without the rest of its plan.
    pub fn elastic(&self) -> Lattice {
        Springs::of(self).elastic
    }

    /// The time step above which the scheme is unstable for this slider while no block switches; infinite by
    /// rate-and-state, whose solver chooses its steps.
    pub fn longest_stable_step_s(&self) -> f64 {
        let springs = Springs::of(self);
        let stiffest_drive = match self.drive.kind {
            DriveKind::Top => top_stiffness_n_per_m(self).into_iter().fold(0.0, f64::max),
            DriveKind::Side => side_stiffness_n_per_m(self),
            DriveKind::LeftRight => self.drive.stiffness_n_per_m,
            DriveKind::Force | DriveKind::Plate => 0.0,
        };
        let law = self.contact_law();
        if !law.word().sticks() {
            return f64::INFINITY;
        }
        let kt = springs.springs_n_per_m(self).into_iter().fold(0.0, f64::max);
        let stiffest_contact = law.junctions().map_or(kt, |_| {
            let pressed_n = pressed_n(self);
            let normal_load_n =
                springs.pressed(&pressed_n).map_or(pressed_n, |(normal_load_n, _)| normal_load_n);
            contact_stiffness_n_per_m(law, &normal_load_n).into_iter().fold(kt, f64::max)
        });
        // Where bonds are relaxed does not matter. Those between blocks include the bounds of clamped and joined ends.
        let at_ends = springs.end_bonds(self, &vec![0.0; springs.elastic.nodes()]);
        springs.elastic.longest_stable_step_s(
            springs.block_mass_kg,
            stiffest_contact,
            stiffest_drive,
            law.damping_kg_per_s() + absorbing_kg_per_s(&at_ends),
        )
    }
}

/// Share of the longest stable time step below which users are advised to stay. Above it, the
/// energy that switches feed into the chain changes the numbers of events (docs/model.md, Time
/// stepping): the as-stated default has 46 global slips at 0.1, 48 at 0.4, 72 at 0.6.
pub const ADVISED_SHARE: f64 = 0.4;

impl Plan {
    /// The time step as a share of [`Plan::longest_stable_step_s`].
    pub fn step_share(&self) -> f64 {
        self.grid.step_s() / self.longest_stable_step_s
    }
}

/// `N_s k_n` of each contact, from its normal load at rest; empty by laws without junctions.
fn contact_stiffness_n_per_m(law: Law, normal_load_n: &[f64]) -> Vec<f64> {
    let of_all = |law: Junctions| normal_load_n.iter().map(|load_n| law.stiffness_n_per_m(*load_n)).collect();
    law.junctions().map_or_else(Vec::new, of_all)
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    fn stiffness(set: &str) -> Vec<f64> {
        let source =
            ScenarioSource::new("test", "drive.kind = \"top\"\nslider.blocks = 5").with_override(set);
        let plan = Plan::new(&Scenario::resolve(&source).unwrap());
        plan.drive.stiffness_n_per_m(5)
    }

    #[test]
    fn top_drives_share_out_the_stiffness() {
        assert_eq!(stiffness("drive.tilt=0"), [1.6e5; 5]);
        let tilted = stiffness("drive.tilt=0.5");
        assert_eq!((tilted[0], tilted[2], tilted[4]), (2.4e5, 1.6e5, 0.8e5));
        let falling = stiffness("drive.decay_length_m=0.025");
        assert!((falling.iter().sum::<f64>() / 8e5 - 1.0).abs() < 1e-12);
        assert!((falling[1] / falling[0] - (-1.0f64).exp()).abs() < 1e-12, "{falling:?}");
    }

    #[test]
    fn a_drive_with_a_course_moves_by_its_integral() {
        let source = ScenarioSource::new(
            "test",
            "friction.law = \"rate-and-state\"\ndrive.course_s = [1, 2, 2, 3]\n\
             drive.course_m_per_s = [1e-4, 1e-4, 1e-3, 0]\ndrive.hold_from_s = 4\ntime.step_s = 1e-7",
        );
        let plan = Plan::new(&Scenario::resolve(&source).unwrap_or_else(|errors| panic!("{errors}")));
        let at = |time_s: f64| plan.grid.nearest_step(time_s);
        let is = |found: f64, expected: f64| {
            assert!((found - expected).abs() < 1e-15, "{found}, not {expected}");
        };
        for (time_s, velocity, point_m) in [
            (0.0, 1e-4, 0.0),
            (1.5, 1e-4, 1.5e-4),
            (2.0, 1e-3, 2e-4),
            (2.5, 5e-4, 2e-4 + 3.75e-4),
            (3.0, 0.0, 7e-4),
            (9.0, 0.0, 7e-4),
        ] {
            is(plan.outside(at(time_s), u64::MAX).velocity_m_per_s(), velocity);
            is(plan.outside(at(time_s), u64::MAX).point_m, point_m);
        }
        // It stops where it is held.
        is(plan.outside(at(2.5), at(2.5)).velocity_m_per_s(), 0.0);
        is(plan.outside(at(9.0), at(2.5)).point_m, 5.75e-4);
        let constant = Plan::new(&Scenario::resolve(&ScenarioSource::new("test", "")).unwrap());
        assert_eq!([7, 8].map(|step| constant.outside(step, 8).velocity_m_per_s()), [1e-4, 0.0]);
    }

    #[test]
    fn seeds_and_coefficients_have_spreads_of_their_own() {
        let spread = |seed: u32| {
            let set = format!("friction.spread_seed={seed}");
            let source =
                ScenarioSource::new("test", "friction.static_spread=0.1\nfriction.dynamic_spread=0.1");
            crate::plan::disorder::coefficients(&Scenario::resolve(&source.with_override(&set)).unwrap())
        };
        let (mu_s, mu_d) = spread(1);
        assert!(mu_s.iter().all(|mu| (0.6..=0.8).contains(mu)));
        let mean = mu_s.iter().sum::<f64>() / 100.0;
        assert!((mean - 0.7).abs() < 0.02, "{mean}");
        assert!(mu_s.iter().zip(&mu_d).any(|(s, d)| (s - d - 0.25).abs() > 0.05));
        for other in [2, 1 << 31, (1 << 31) + 1, u32::MAX] {
            assert_ne!(spread(other).0, mu_s, "seed {other}");
        }
    }
}
