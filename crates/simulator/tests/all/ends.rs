//! Ends of a chain that are not free: closed forms of modes and reflections, symmetries, energies, and agreement of both
//! solvers switch by switch.

use std::f64::consts::PI;

use asperity_model::body::ends::{EndBond, absorbed_reflection};
use asperity_model::{Plan, SliderState};
use asperity_record::Energy;
use asperity_simulator::{Plain, Solver, SolverKind};
use asperity_testkit::{Random, plan};

use crate::fast_and_plain::{
    Entry, compare_random, entries, fields, from_state, last_energy, records, run, some_chain,
};

/// The words of the four kinds of ends, and of two that differ.
const ENDS: [[&str; 2]; 6] = [
    ["free", "free"],
    ["clamped", "clamped"],
    ["free", "clamped"],
    ["clamped", "absorbing"],
    ["absorbing", "absorbing"],
    ["periodic", "periodic"],
];

fn with_ends([left, right]: [&str; 2]) -> [String; 2] {
    [format!("slider.left_end={left}"), format!("slider.right_end={right}")]
}

/// A chain that nothing drives, without dampers, whose blocks never slip and hardly feel their friction springs.
fn linear(ends: [&str; 2], blocks: u32, step: f64, steps: u32) -> Plan {
    let n = f64::from(blocks);
    let step_s = format!("{:.9e}", step * (0.012 / n / (2.5e6 * (n - 1.0))).sqrt());
    let duration_s = step_s.parse::<f64>().unwrap() * f64::from(steps);
    let sets = [
        format!("slider.blocks={blocks}"),
        "parameter_set=as-stated".to_owned(),
        "slider.relative_damping=0".to_owned(),
        "friction.interfacial_stiffness_ratio=1e-12".to_owned(),
        "friction.static_coefficient=1e6".to_owned(),
        "drive.velocity_m_per_s=0".to_owned(),
        format!("time.step_s={step_s}"),
        format!("time.duration_s={duration_s}"),
        format!("recording.sample_s={duration_s}"),
        format!("recording.fields_s={duration_s}"),
    ];
    let mut plan = plan("default", &[&sets[..], &with_ends(ends)].concat());
    plan.drive.springs.clear();
    plan
}

/// The last state and the last energies of a run from a state.
fn at_end(plan: &Plan, state: &SliderState, kind: SolverKind) -> (Vec<f64>, Energy) {
    let mut solver = kind.start(plan.clone());
    solver.restore(&state.clone().into());
    let records = records(solver);
    let last = fields(&records).last().expect("the end is recorded").displacement_m.clone();
    (last, last_energy(&records))
}

/// The modes of chains with all ends that reflect swing with their frequencies: `q a` is `pi j / N` between free ends,
/// `pi j / (N + 1)` between walls, `pi (2 j - 1) / (2 N + 1)` between a free end and a wall, `2 pi j / N` around.
/// By Euler-Cromer from rest, `u^s = cos((s + 1/2) phi) / cos(phi / 2)` with `2 sin(phi / 2) = w dt`.
#[test]
fn modes_of_reflecting_ends_swing_as_their_dispersion_says() {
    type Function = fn(f64, f64) -> f64;
    type Case = ([&'static str; 2], Function, Function);
    let cases: [Case; 4] = [
        (["free", "free"], |j, n| PI * j / n, |q, n| (q * (n + 0.5)).cos()),
        (["clamped", "clamped"], |j, n| PI * j / (n + 1.0), |q, n| (q * (n + 1.0)).sin()),
        (["free", "clamped"], |j, n| PI * (2.0 * j - 1.0) / (2.0 * n + 1.0), |q, n| (q * (n + 0.5)).cos()),
        (["periodic", "periodic"], |j, n| 2.0 * PI * j / n, |q, n| (q * n + 0.3).cos()),
    ];
    for (ends, number, shape) in cases {
        for (blocks, mode) in [(2, 1), (3, 1), (24, 1), (24, 5), (24, 11)] {
            let steps = 30_000;
            let plan = linear(ends, blocks, 0.01, steps);
            let q = number(f64::from(mode), f64::from(blocks));
            let mut state = plan.initial.clone();
            for (n, u) in state.displacement_m.iter_mut().enumerate() {
                *u = 1e-6 * shape(q, n as f64);
            }
            let k = plan.elastic.stiffness_n_per_m;
            let w2 = (4.0 * k * (q / 2.0).sin().powi(2) + plan.friction.interfacial_stiffness_n_per_m)
                / plan.block_mass_kg;
            let phi = 2.0 * (0.5 * w2.sqrt() * plan.grid.step_s()).asin();
            let swung = ((f64::from(steps) + 0.5) * phi).cos() / (phi / 2.0).cos();
            for kind in [SolverKind::Plain, SolverKind::Fast] {
                let (found, energy) = at_end(&plan, &state, kind);
                for (n, u) in found.iter().enumerate() {
                    let expected = swung * state.displacement_m[n];
                    assert!(
                        (u - expected).abs() < 1e-9 * 1e-6,
                        "{ends:?} {blocks} {mode} {kind:?}: {u} {expected}"
                    );
                }
                assert!(energy.kinetic_j + energy.elastic_j > 0.0);
            }
        }
    }
}

/// A packet of waves on its way to the last block: of phase per block `q`, and so wide that `q` hardly varies.
fn packet(plan: &Plan, q: f64) -> SliderState {
    let mut state = plan.initial.clone();
    let rate = (plan.elastic.stiffness_n_per_m / plan.block_mass_kg).sqrt();
    let (w, group) = (2.0 * rate * (q / 2.0).sin(), rate * (q / 2.0).cos());
    let (centre, width) = (plan.blocks as f64 - 400.0, 70.0);
    for n in 0..plan.blocks {
        let x = n as f64 - centre;
        let height = 1e-6 * (-x * x / (2.0 * width * width)).exp();
        let (sin, cos) = (q * x).sin_cos();
        state.displacement_m[n] = height * cos;
        state.velocity_m_per_s[n] = height * (w * sin + group * x / (width * width) * cos);
    }
    state
}

/// Free ends and walls reflect all; absorbing ends reflect `tan(q a / 4)` of the amplitude, for short steps.
#[test]
fn absorbing_ends_reflect_the_share_of_the_closed_form() {
    let (blocks, step) = (800, 0.02);
    for q in [0.2, 0.5, 1.0, 1.5] {
        // The packet comes to the end and half-way back.
        let steps = (800.0 / (q / 2.0_f64).cos() / step) as u32;
        for end in ["absorbing", "clamped", "free"] {
            let plan = linear(["free", end], blocks, step, steps);
            let state = packet(&plan, q);
            let (_, energy) = at_end(&plan, &state, SolverKind::Fast);
            let kinetic_j: f64 =
                state.velocity_m_per_s.iter().map(|v| 0.5 * plan.block_mass_kg * v * v).sum();
            let k = plan.elastic.stiffness_n_per_m;
            let elastic_j: f64 =
                state.displacement_m.windows(2).map(|u| 0.5 * k * (u[1] - u[0]).powi(2)).sum();
            let left = (energy.kinetic_j + energy.elastic_j) / (kinetic_j + elastic_j);
            if end != "absorbing" {
                assert!((left - 1.0).abs() < 0.02, "{q} {end}: {left}");
                assert_eq!(energy.radiated_j, None);
                continue;
            }
            let half_step = (step * (q / 2.0_f64).sin()).asin();
            let expected = absorbed_reflection(q, half_step);
            assert!((left.sqrt() - expected).abs() < 5e-4, "{q}: {} {expected}", left.sqrt());
        }
    }
}

/// A chain without friction and drive whose ends are joined keeps its momentum to rounding.
#[test]
fn a_periodic_chain_keeps_its_momentum() {
    let sets = ["slider.relative_damping=0.3", "time.step_s=1e-8", "time.duration_s=2e-3"];
    let mut plan = plan("default", &[&sets.map(str::to_owned)[..], &with_ends(["periodic"; 2])].concat());
    plan.drive.springs.clear();
    plan.friction.dynamic_friction_n.fill(0.0);
    for kind in [SolverKind::Plain, SolverKind::Fast] {
        let mut state = plan.initial.clone();
        let mut noise = Random::new(3);
        for n in 0..plan.blocks {
            state.velocity_m_per_s[n] = noise.uniform(1.0, 2.0);
            state.slip[n] = 1.0;
        }
        state.detached = plan.blocks as u32;
        let (_, counters) = from_state(&plan, &state);
        assert!(counters.window_steps > plan.steps / 2, "{counters:?}");
        let momentum = |state: &SliderState| state.velocity_m_per_s.iter().sum::<f64>();
        let before = momentum(&state);
        let mut solver = kind.start(plan.clone());
        solver.restore(&state.into());
        while solver.next_record().expect("it goes on").is_some() {}
        let after = solver.snapshot().slider;
        assert_eq!(after.step, plan.steps);
        assert!(after.detached == plan.blocks as u32, "all slide on");
        assert!((momentum(&after) / before - 1.0).abs() < 1e-12, "{kind:?}: {} {before}", momentum(&after));
        let spread = after.velocity_m_per_s.iter().fold(0.0, |most: f64, v| most.max((v - 1.5).abs()));
        assert!(spread < 0.3, "dampers even out the velocities: {spread}");
    }
}

/// A chain whose ends are joined has no first block: with friction and prestress shifted by a block, the run is shifted.
#[test]
fn a_shifted_setup_of_a_periodic_chain_gives_the_shifted_run() {
    const BLOCKS: usize = 12;
    let mut noise = Random::new(8);
    let lists: Vec<Vec<f64>> =
        (0..3).map(|_| (0..BLOCKS).map(|_| noise.uniform(-0.08, 0.08)).collect()).collect();
    let run_of = |shift: usize, kind: SolverKind| {
        let list = |of: usize| -> Vec<f64> {
            (0..BLOCKS).map(|n| lists[of][(n + BLOCKS - shift) % BLOCKS]).collect()
        };
        let sets = [
            format!("slider.blocks={BLOCKS}"),
            "slider.relative_damping=0.3".to_owned(),
            format!("friction.static_offsets={:?}", list(0)),
            format!("friction.dynamic_offsets={:?}", list(1)),
            format!("prestress.profile={:?}", list(2)),
            "drive.kind=top".to_owned(),
            "drive.velocity_m_per_s=0.02".to_owned(),
            "time.step_s=1e-7".to_owned(),
            "time.duration_s=0.3".to_owned(),
            "recording.sample_s=0".to_owned(),
            "recording.fields_s=0".to_owned(),
        ];
        let plan = plan("default", &[&sets[..], &with_ends(["periodic"; 2])].concat());
        let (records, _, error) = run(&plan, kind);
        assert_eq!(error, None);
        entries(&records)
    };
    for kind in [SolverKind::Plain, SolverKind::Fast] {
        let straight = run_of(0, kind);
        let switches: usize = straight.iter().map(|entry| entry.2.len()).sum();
        assert!(switches > 100, "{switches}");
        let moved = |(step, sliding, switches): &Entry| {
            let mut switches: Vec<(u32, bool)> =
                switches.iter().map(|(block, detaches)| (block % BLOCKS as u32 + 1, *detaches)).collect();
            switches.sort_unstable();
            (*step, *sliding, switches)
        };
        let shifted: Vec<_> = straight.iter().map(moved).collect();
        assert_eq!(run_of(1, kind), shifted, "{kind:?}");
    }
}

/// The mirror image of a chain with different ends runs as its mirror image.
#[test]
fn left_and_right_ends_are_mirror_images() {
    const BLOCKS: usize = 9;
    let mut noise = Random::new(21);
    let offsets: Vec<f64> = (0..BLOCKS).map(|_| noise.uniform(-0.08, 0.08)).collect();
    for [left, right] in [["clamped", "free"], ["absorbing", "free"], ["clamped", "absorbing"]] {
        let run_of = |ends: [&str; 2], offsets: &[f64]| {
            let sets = [
                format!("slider.blocks={BLOCKS}"),
                format!("friction.static_offsets={offsets:?}"),
                "drive.kind=top".to_owned(),
                "drive.velocity_m_per_s=0.05".to_owned(),
                "time.step_s=1e-7".to_owned(),
                "time.duration_s=0.12".to_owned(),
            ];
            entries(&run(&plan("default", &[&sets[..], &with_ends(ends)].concat()), SolverKind::Plain).0)
        };
        let mirrored: Vec<f64> = offsets.iter().rev().copied().collect();
        let straight = run_of([left, right], &offsets);
        let of_mirror = run_of([right, left], &mirrored);
        let back: Vec<_> = of_mirror
            .into_iter()
            .map(|(step, sliding, mut switches)| {
                switches.iter_mut().for_each(|(block, _)| *block = BLOCKS as u32 + 1 - *block);
                switches.reverse();
                (step, sliding, switches)
            })
            .collect();
        let switches: usize = straight.iter().map(|entry| entry.2.len()).sum();
        assert!(switches > 5, "{left} {right} {switches}");
        assert_eq!(straight, back, "{left} {right}");
    }
}

/// The momentum of a stuck chain changes by what the drive, the contacts and the walls pull; bonds between blocks and
/// joined ends cancel. All ends are relaxed at the start, initial shear or not.
#[test]
fn walls_bear_what_contacts_do_not() {
    let sets = [
        "slider.blocks=20",
        "parameter_set=as-stated",
        "drive.velocity_m_per_s=0.05",
        "drive.hold_from_s=4e-4",
        "time.step_s=1e-8",
        "time.duration_s=1e-3",
        "initial_shear.beta=0.3",
    ];
    for ends in [["free"; 2], ["clamped"; 2], ["periodic"; 2]] {
        let plan = plan("default", &[&sets.map(str::to_owned)[..], &with_ends(ends)].concat());
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let mut plain = Plain::new(plan.clone());
        let mut walls_n = 0.0;
        while plain.step() < plan.steps {
            let before = plain.state().clone();
            let pull_n = |bond: &EndBond| bond.pull_n(&before.displacement_m, &before.velocity_m_per_s);
            let total_n = plain.take_step().total_n;
            let held = before.displacement_m.iter().zip(&before.stick_position_m);
            let held_n: f64 = held.map(|(u, anchor)| kt * (u - anchor)).sum();
            let walls = plan.end_bonds.iter().filter(|bond| bond.other.is_none());
            walls_n = walls.map(pull_n).sum();
            let changes = plain.state().velocity_m_per_s.iter().zip(&before.velocity_m_per_s);
            let gained_n =
                changes.map(|(new, old)| new - old).sum::<f64>() * plan.block_mass_kg / plan.grid.step_s();
            assert!((total_n + walls_n - held_n - gained_n).abs() < 1e-6, "{ends:?} {}", before.step);
            assert!(before.step > 0 || plan.end_bonds.iter().all(|bond| pull_n(bond) == 0.0));
        }
        assert_eq!(plain.state().detached, 0);
        assert_eq!(walls_n < -0.1, ends[0] == "clamped", "{walls_n}");
    }
}

/// A chain of any law that sticks, with any ends.
fn random_chain(seed: u64) -> (&'static str, Vec<String>) {
    let mut noise = Random::new(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) + 11);
    let dampers = |noise: &mut Random| [noise.pick(&[0.0, 0.1, 0.7]), noise.pick(&[0.0, 0.0, 0.5])];
    let (mut set, chain) = some_chain(&mut noise, dampers, 1.0);
    set.extend(with_ends(noise.pick(&ENDS[1..])));
    let mut is_loaded = false;
    match noise.pick(&[0, 1, 1, 2, 2, 3]) {
        0 => set.push("friction.law=rigid".to_owned()),
        3 => set.push("friction.law=velocity-weakening".to_owned()),
        rule => {
            set.extend(chain.springs(rule as usize - 1));
            set.push(format!("friction.detach_by={}", noise.pick(&["force", "spring"])));
            set.push(format!("friction.radiation_kg_per_s={:?}", chain.radiation_kg_per_s));
            if noise.pick(&[false, false, true]) {
                set.push(format!("friction.ageing_coefficient={}", 0.02 * chain.mu_s));
                set.push(format!("friction.ageing_time_s={}", 100.0 * chain.step_s));
            } else if noise.pick(&[false, true]) {
                is_loaded = true;
                set.push("time.start=loaded".to_owned());
            }
            // With a tilted load it is more than a block holds, so that nothing would be left to load.
            if !is_loaded {
                set.push(format!("initial_shear.beta={}", noise.pick(&[0.0, 0.1 * chain.mu_s])));
            }
        }
    }
    if noise.pick(&[false, true]) && !is_loaded {
        set.extend(chain.schedule());
    }
    ("default", set)
}

fn compare_chains(seeds: std::ops::Range<u64>) {
    let few = (seeds.end - seeds.start) as usize / 10;
    let (mut absorbing, mut radiating) = (0, 0);
    let found = compare_random(seeds, random_chain, [40, 2_000, 5_000], |set, found| {
        if set.iter().any(|set| set.ends_with("absorbing")) {
            let radiated_j = last_energy(&found.fast).radiated_j.expect("its ends radiate");
            // Ends on rigid contacts may rest all the time.
            let may_rest = set.iter().any(|set| set == "friction.law=rigid");
            assert!(radiated_j > 0.0 || may_rest && radiated_j == 0.0, "{set:?}: {radiated_j}");
            absorbing += 1;
            radiating += u32::from(radiated_j > 0.0);
        }
    });
    assert!(absorbing > 0 && 10 * radiating >= 9 * absorbing, "{radiating} of {absorbing} radiate");
    assert!(found.stopped.len() <= few && found.ties.len() <= few, "{found:?}");
    assert!(found.parted.len() + found.amplified.len() <= few, "{found:?}");
}

#[test]
fn random_chains_with_any_ends_switch_alike() {
    compare_chains(0..14);
}

/// The seeds that are left; `cargo xtask ci` runs them.
mod in_ci {
    use super::*;

    #[test]
    #[ignore = "half a minute of single steps: cargo xtask ci"]
    fn more_random_chains_with_any_ends_switch_alike() {
        compare_chains(14..240);
    }
}

/// What the fast solver cannot do at all in a run it says.
#[test]
fn fallbacks_name_the_ends_that_cause_them() {
    let fallbacks = |ends: [&str; 2], set: &str| {
        let plan = plan("ten-blocks", &[&with_ends(ends)[..], &[set.to_owned()]].concat());
        SolverKind::Fast.start(plan).fallbacks().join("; ")
    };
    let by_spring = "friction.detach_by=spring";
    assert_eq!(fallbacks(["clamped", "clamped"], "time.duration_s=0.06"), "");
    assert_eq!(fallbacks(["free", "free"], by_spring), "");
    assert!(fallbacks(["periodic", "periodic"], by_spring).contains("whose ends are joined"));
    let absorbing = |damping: &str| fallbacks(["free", "absorbing"], damping);
    assert!(absorbing("slider.relative_damping=0.2").contains("single steps while any block slides"));
    assert_eq!(absorbing("slider.relative_damping=0"), "");
}
