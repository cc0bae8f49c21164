//! The plan: the numbers of the physics, derived from a scenario once.

use serde::{Deserialize, Serialize};

use crate::elastic::{Chain, Elastic};
use crate::initial::InitialState;
use crate::load::LoadCourse;
use crate::scenario::{DriveKind, FrictionLaw, ScheduleFrom, Start};
use crate::{Scenario, initial, load};
use asperity_record::TimeGrid;

/// Everything a solver needs to know. SI units; per-block arrays have length
/// [`Plan::blocks`].
#[derive(Debug, Clone, PartialEq)]
pub struct Plan {
    /// Number of blocks `N`.
    pub blocks: usize,
    /// Length of the slider `L`.
    pub length_m: f64,
    /// Spacing `a = L / (N - 1)`.
    pub spacing_m: f64,
    /// Block mass `m = M / N`.
    pub block_mass_kg: f64,
    /// What holds the blocks together.
    pub elastic: Elastic,
    /// Stiffness between neighbours `k` (5.5), as [`Plan::elastic`] has it.
    pub stiffness_n_per_m: f64,
    /// Viscous damping between neighbours `eta` (5.7), as [`Plan::elastic`] has it.
    pub damping_kg_per_s: f64,
    /// The friction law's numbers.
    pub friction: Friction,
    /// Total normal load `F_N` at the start.
    pub total_normal_load_n: f64,
    /// Normal load per block `p_n` (5.18) at the start.
    pub normal_load_n: Vec<f64>,
    /// How it changes with time, for all blocks alike.
    pub load_course: LoadCourse,
    /// The driving springs.
    pub drive: Drive,
    /// The chain before the first step.
    pub initial: InitialState,
    /// The grid of time steps.
    pub grid: TimeGrid,
    /// Number of steps to take.
    pub steps: u64,
    /// What to record besides switches and event edges.
    pub recording: RecordingPlan,
}

/// The friction law and its numbers. What is proportional to the normal load is given at
/// the load of the start.
#[derive(Debug, Clone, PartialEq)]
pub struct Friction {
    /// How a block sticks and slides.
    pub law: Law,
    /// `mu_s` without offsets.
    pub static_coefficient: f64,
    /// `mu_d` without offsets.
    pub dynamic_coefficient: f64,
    /// Stiffness of a stuck block's friction spring, `k_t`; 0 by the laws that have none.
    pub interfacial_stiffness_n_per_m: f64,
    /// Static thresholds `mu_s p_n`, of contacts that have not aged.
    pub static_threshold_n: Vec<f64>,
    /// Sliding friction `mu_d p_n`.
    pub dynamic_friction_n: Vec<f64>,
    /// When a sliding block re-attaches.
    pub reattach: Reattach,
    /// How thresholds grow while a block sticks.
    pub ageing: Option<Ageing>,
}

/// How a block sticks and slides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    /// Amontons-Coulomb with interfacial springs (section 5.3).
    Springs,
    /// A stuck block does not move, and re-attaches, at rest, in the step in which its
    /// velocity would change sign; sliding friction is
    /// `-mu_d p sign(v) / (1 + |v| / v_c) - E v` (2.4), or, without these two, (2.7).
    Rigid {
        /// `1 / v_c`; 0 for friction that does not depend on velocity.
        weakening_s_per_m: f64,
        /// `E`.
        radiation_kg_per_s: f64,
    },
}

impl Law {
    /// Whether a step is an affine map as long as no block switches.
    pub fn is_affine(self) -> bool {
        match self {
            Law::Springs => true,
            Law::Rigid { weakening_s_per_m, radiation_kg_per_s } => {
                weakening_s_per_m == 0.0 && radiation_kg_per_s == 0.0
            }
        }
    }
}

/// Logarithmic ageing, `mu_s + b ln(1 + t_w / t_0)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Ageing {
    /// `b p_n`.
    pub growth_n: Vec<f64>,
    /// `t_0`.
    pub time_s: f64,
}

/// When a sliding block re-attaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Reattach {
    /// At a new velocity `<= 0`: the rule of the thesis' program.
    OneWay,
    /// Where the velocity changes sign or vanishes, `v_new v_old <= 0`.
    TwoWay,
}

/// Springs from blocks to a point that moves at constant velocity until it stops: (5.8),
/// (5.53).
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// The springs, by ascending block.
    pub springs: Vec<DriveSpring>,
    /// Velocity of the point, `V`.
    pub velocity_m_per_s: f64,
    /// The step from which on the point stands still, where that is given.
    pub hold_from_step: Option<u64>,
    /// The load `F_T / F_N` that stops it, where one does.
    pub until_load_ratio: Option<f64>,
}

/// A driving spring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriveSpring {
    /// The block, counted from 0.
    pub block: usize,
    /// `K_n`.
    pub stiffness_n_per_m: f64,
    /// 1 where the point moves forward, -1 where it moves backward.
    pub direction: f64,
}

impl DriveSpring {
    /// `K_n (V t - u_n)` (5.8) with the point at `point_m` from where it started.
    #[inline]
    pub fn force_n(&self, point_m: f64, displacement_m: f64) -> f64 {
        self.stiffness_n_per_m * (self.direction * point_m - displacement_m)
    }
}

impl Drive {
    fn of(scenario: &Scenario, blocks: usize, steps: impl Fn(f64) -> u64) -> Drive {
        let drive = &scenario.drive;
        let stiffness = drive.stiffness_n_per_m;
        let spring =
            |block, stiffness_n_per_m, direction| DriveSpring { block, stiffness_n_per_m, direction };
        let springs = match drive.kind {
            DriveKind::Side => vec![spring(0, stiffness, 1.0)],
            DriveKind::LeftRight => vec![spring(0, stiffness, -1.0), spring(blocks - 1, stiffness, 1.0)],
            DriveKind::Top => top_stiffness_n_per_m(scenario)
                .into_iter()
                .enumerate()
                .filter(|(_, stiffness)| *stiffness > 0.0)
                .map(|(block, stiffness)| spring(block, stiffness, 1.0))
                .collect(),
        };
        Drive {
            springs,
            velocity_m_per_s: drive.velocity_m_per_s,
            hold_from_step: (drive.hold_from_s > 0.0).then(|| steps(drive.hold_from_s)),
            until_load_ratio: (drive.until_load_ratio > 0.0).then_some(drive.until_load_ratio),
        }
    }

    /// `K_n` of every block.
    pub fn stiffness_n_per_m(&self, blocks: usize) -> Vec<f64> {
        let mut all = vec![0.0; blocks];
        for spring in &self.springs {
            all[spring.block] += spring.stiffness_n_per_m;
        }
        all
    }

    /// The largest of them.
    pub fn stiffest_n_per_m(&self) -> f64 {
        self.springs.iter().fold(0.0, |most: f64, spring| most.max(spring.stiffness_n_per_m))
    }

    /// The spring of a drive that pulls at block 1 alone.
    pub fn only_side(&self) -> Option<&DriveSpring> {
        match self.springs.as_slice() {
            [spring] if spring.block == 0 && spring.direction > 0.0 => Some(spring),
            _ => None,
        }
    }

    /// Whether it pulls blocks in opposite directions.
    pub fn pulls_both_ways(&self) -> bool {
        self.springs.iter().any(|spring| spring.direction < 0.0)
    }

    /// Whether it pulls any but the first and the last of so many blocks.
    pub fn pulls_inside(&self, blocks: usize) -> bool {
        self.springs.iter().any(|spring| spring.block != 0 && spring.block != blocks - 1)
    }

    /// Sum of the driving forces, with the point at `point_m` from where it started.
    pub fn total_force_n(&self, point_m: f64, displacement_m: &[f64]) -> f64 {
        self.springs.iter().map(|spring| spring.force_n(point_m, displacement_m[spring.block])).sum()
    }
}

/// `K_n` of a top drive: `K` in all, spread evenly, with a tilt like that of the normal load
/// (5.18), or falling exponentially from the end that a side drive would push.
fn top_stiffness_n_per_m(scenario: &Scenario) -> Vec<f64> {
    let drive = &scenario.drive;
    let blocks = scenario.slider.blocks as usize;
    if drive.decay_length_m == 0.0 {
        return load::tilted(drive.stiffness_n_per_m, drive.tilt, blocks);
    }
    let spacing_m = scenario.slider.length_m / (blocks - 1) as f64;
    let shares: Vec<f64> =
        (0..blocks).map(|n| libm::exp(-(n as f64 * spacing_m) / drive.decay_length_m)).collect();
    let all: f64 = shares.iter().sum();
    shares.iter().map(|share| drive.stiffness_n_per_m * (share / all)).collect()
}

/// `mu_s` and `mu_d` of every block, offsets and random spread included.
pub(crate) fn coefficients(scenario: &Scenario) -> (Vec<f64>, Vec<f64>) {
    let friction = &scenario.friction;
    let blocks = scenario.slider.blocks as usize;
    let of = |mean: f64, offsets: &[f64], spread: f64, stream: u64| {
        (0..blocks)
            .map(|n| {
                let offset = offsets.get(n).copied().unwrap_or(0.0);
                let random = if spread == 0.0 {
                    0.0
                } else {
                    spread * evenly(u64::from(friction.spread_seed), stream, n as u64)
                };
                mean + offset + random
            })
            .collect()
    };
    (
        of(friction.static_coefficient, &friction.static_offsets, friction.static_spread, 0),
        of(friction.dynamic_coefficient, &friction.dynamic_offsets, friction.dynamic_spread, 1),
    )
}

/// A number from -1 to 1 without pattern: SplitMix64's output function of seed, stream and
/// block.
fn evenly(seed: u64, stream: u64, block: u64) -> f64 {
    let mut z = (seed << 32 | stream << 31 | block).wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^= z >> 31;
    (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// When to record what nothing forces to be recorded. Cadences are in steps; 0
/// means never. None of it influences the run.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingPlan {
    /// Cadence of load samples.
    pub sample_every_steps: u64,
    /// Cadence of states of all blocks.
    pub fields_every_steps: u64,
    /// Whether to record all blocks at the onset and end of every slip event.
    pub event_fields: bool,
    /// Dense windows of chosen blocks.
    pub windows: Vec<WindowPlan>,
}

/// A dense window: steps `from, from + every, ...` up to `to`, some blocks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WindowPlan {
    /// First step.
    pub from_step: u64,
    /// Last step.
    pub to_step: u64,
    /// Cadence.
    pub every_steps: u64,
    /// Blocks, counted from 0.
    pub blocks: std::ops::Range<usize>,
}

impl Plan {
    /// Derives the numbers of the physics from a resolved scenario.
    pub fn new(scenario: &Scenario) -> Plan {
        let blocks = scenario.slider.blocks as usize;
        let springs = Springs::of(scenario);
        let normal_load_n = load::tilted(scenario.normal_load.total_n, scenario.normal_load.tilt, blocks);
        let friction = &scenario.friction;
        let (mu_s, mu_d) = coefficients(scenario);
        let scaled = |factors: &[f64]| factors.iter().zip(&normal_load_n).map(|(mu, p)| mu * p).collect();
        let grid = TimeGrid::new(scenario.time.step_s);
        let steps =
            |seconds| grid.whole_steps(seconds).expect("a resolved scenario has whole numbers of steps");
        let weakening = friction.law == FrictionLaw::VelocityWeakening;
        let law = match friction.law {
            FrictionLaw::InterfacialSprings => Law::Springs,
            FrictionLaw::Rigid | FrictionLaw::VelocityWeakening => Law::Rigid {
                weakening_s_per_m: if weakening { 1.0 / friction.weakening_velocity_m_per_s } else { 0.0 },
                radiation_kg_per_s: if weakening { friction.radiation_kg_per_s } else { 0.0 },
            },
        };
        let ageing = (friction.ageing_coefficient > 0.0).then(|| Ageing {
            growth_n: normal_load_n.iter().map(|p| friction.ageing_coefficient * p).collect(),
            time_s: friction.ageing_time_s,
        });
        let load = &scenario.normal_load;
        let drive = Drive::of(scenario, blocks, steps);
        let mut plan = Plan {
            blocks,
            length_m: scenario.slider.length_m,
            spacing_m: springs.spacing_m,
            block_mass_kg: springs.block_mass_kg,
            stiffness_n_per_m: springs.elastic.stiffness_n_per_m(),
            damping_kg_per_s: springs.elastic.damping_kg_per_s(),
            elastic: springs.elastic.clone(),
            friction: Friction {
                law,
                static_coefficient: friction.static_coefficient,
                dynamic_coefficient: friction.dynamic_coefficient,
                interfacial_stiffness_n_per_m: springs.interfacial_stiffness_n_per_m,
                static_threshold_n: scaled(&mu_s),
                dynamic_friction_n: scaled(&mu_d),
                reattach: friction.reattach,
                ageing,
            },
            total_normal_load_n: load.total_n,
            load_course: LoadCourse::new(
                load.schedule_s.iter().map(|time_s| steps(*time_s)).collect(),
                load.schedule_n.iter().map(|total_n| total_n / load.total_n).collect(),
                load.schedule_from == ScheduleFrom::Hold,
            ),
            initial: initial::state(scenario, &springs, &drive, &normal_load_n),
            drive,
            normal_load_n,
            grid,
            steps: steps(scenario.time.duration_s),
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
            },
        };
        if scenario.time.start == Start::Loaded {
            initial::start_loaded(&mut plan);
        }
        plan
    }

    /// How far the drive point has moved by a step, if it stopped in `hold_step` (of a point
    /// that has not, `u64::MAX`).
    #[inline]
    pub fn drive_point_m(&self, step: u64, hold_step: u64) -> f64 {
        self.drive.velocity_m_per_s * self.grid.time_s(step.min(hold_step))
    }

    /// The normal load of a step, over that of the start.
    #[inline]
    pub fn load_factor(&self, step: u64, hold_step: u64) -> f64 {
        self.load_course.factor(step, hold_step)
    }

    /// The last step up to which drive point and load go on as they do in the two steps
    /// behind `step`; `u64::MAX` if they go on for ever.
    pub fn steady_until_step(&self, step: u64, hold_step: u64) -> u64 {
        let stop = if hold_step > step + 1 { hold_step } else { u64::MAX };
        stop.min(self.load_course.next_knot(step + 1, hold_step))
    }

    /// Length over which a stuck chain screens a force on its end,
    /// `l_0 = a sqrt(k / k_t)`: (5.39), where the thesis misplaces the root.
    pub fn screening_length_m(&self) -> f64 {
        self.spacing_m * (self.stiffness_n_per_m / self.friction.interfacial_stiffness_n_per_m).sqrt()
    }
}

/// The chain's constants, needed before there is a plan.
pub(crate) struct Springs {
    pub(crate) spacing_m: f64,
    pub(crate) block_mass_kg: f64,
    pub(crate) elastic: Elastic,
    pub(crate) interfacial_stiffness_n_per_m: f64,
}

impl Springs {
    pub(crate) fn of(scenario: &Scenario) -> Springs {
        let slider = &scenario.slider;
        let gaps = f64::from(slider.blocks - 1);
        let block_mass_kg = slider.mass_kg / f64::from(slider.blocks);
        let stiffness_n_per_m =
            slider.youngs_modulus_pa * gaps * slider.width_m * slider.height_m / slider.length_m;
        Springs {
            spacing_m: slider.length_m / gaps,
            block_mass_kg,
            elastic: Elastic::Chain(Chain {
                nodes: slider.blocks as usize,
                stiffness_n_per_m,
                damping_kg_per_s: slider.relative_damping * (stiffness_n_per_m * block_mass_kg).sqrt(),
            }),
            interfacial_stiffness_n_per_m: match scenario.friction.law {
                FrictionLaw::InterfacialSprings => {
                    scenario.friction.interfacial_stiffness_ratio * stiffness_n_per_m
                }
                FrictionLaw::Rigid | FrictionLaw::VelocityWeakening => 0.0,
            },
        }
    }
}

/// The time step beyond which the scheme is unstable for a scenario's slider.
pub(crate) fn longest_stable_step_s(scenario: &Scenario) -> f64 {
    let springs = Springs::of(scenario);
    let stiffest_drive = match scenario.drive.kind {
        DriveKind::Top => top_stiffness_n_per_m(scenario).into_iter().fold(0.0, f64::max),
        DriveKind::Side | DriveKind::LeftRight => scenario.drive.stiffness_n_per_m,
    };
    let radiation = match scenario.friction.law {
        FrictionLaw::VelocityWeakening => scenario.friction.radiation_kg_per_s,
        _ => 0.0,
    };
    springs.elastic.longest_stable_step_s(
        springs.block_mass_kg,
        springs.interfacial_stiffness_n_per_m,
        stiffest_drive,
        radiation,
    )
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
    fn seeds_and_coefficients_have_spreads_of_their_own() {
        let spread = |seed: u32| {
            let set = format!("friction.spread_seed={seed}");
            let source =
                ScenarioSource::new("test", "friction.static_spread=0.1\nfriction.dynamic_spread=0.1");
            super::coefficients(&Scenario::resolve(&source.with_override(&set)).unwrap())
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
