//! A body on a foundation before its first step: pressed down and at rest.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use crate::body::lattice::Lattice;
use crate::law::magnitude;
use crate::plan::{DriveSpring, Plan};

/// Relative residual, over the load, at rounding level.
const RESIDUAL: f64 = 1e-15;

/// Relative load of a contact, over the mean, at or below which it carries none or pulls.
const BEARS_NOTHING: f64 = 1e-9;

/// Relative residual force, over the load, at which conjugate gradients have not converged.
const UNBALANCED: f64 = 1e-9;

/// Most iterations of conjugate gradients per freedom; a few hundred in all are usual.
const MOST_STEPS: usize = 10;

/// Most solutions that are kept, and most freedoms of all of them, 16 bytes each; the last is kept in any case, as that
/// of a large body takes minutes.
const SOLUTIONS_KEPT: usize = 32;
const FREEDOMS_KEPT: usize = 1_000_000;

/// The forces of a load on every node of the top row, on all freedoms; none without a foundation.
pub(crate) fn pressed_n(lattice: &Lattice, top_load_n: &[f64]) -> Vec<f64> {
    let mut force_n = vec![0.0; lattice.freedoms()];
    if let Some(normal) = lattice.first_normal() {
        for (node, load_n) in lattice.top_row().zip(top_load_n) {
            force_n[normal + node] = -load_n;
        }
    }
    force_n
}

/// The displacements at which a lattice balances forces on its freedoms while every contact is stuck to the
/// grid by a friction spring and supported by the foundation, with a drive at rest.
///
/// The foundation is assumed to support every contact. Pressed down, the lattice would expand along the
/// surface by Poisson's ratio; friction springs resist that, which leaves a shear.
///
/// Recent solutions are kept: a run is planned, previewed and checked for warnings before it starts, and
/// most runs of a study vary what does not move the body at rest.
pub(crate) fn stuck_m(
    lattice: &Lattice,
    interfacial_n_per_m: f64,
    drive: &[DriveSpring],
    force_n: Vec<f64>,
) -> Vec<f64> {
    static RECENT: Mutex<VecDeque<(Balance, Vec<f64>)>> = Mutex::new(VecDeque::new());
    let recent = || RECENT.lock().unwrap_or_else(PoisonError::into_inner);
    let balance = Balance {
        lattice: *lattice,
        interfacial_bits: interfacial_n_per_m.to_bits(),
        drive: drive.iter().map(|spring| (spring.block, spring.stiffness_n_per_m.to_bits())).collect(),
        force_bits: force_n.iter().map(|force_n| force_n.to_bits()).collect(),
    };
    if let Some((_, solution)) = recent().iter().find(|(known, _)| *known == balance) {
        return solution.clone();
    }
    let solution = balanced_m(lattice, interfacial_n_per_m, drive, force_n);
    let mut recent = recent();
    recent.truncate(SOLUTIONS_KEPT - 1);
    recent.push_front((balance, solution.clone()));
    let mut kept = 0;
    recent.retain(|(_, solution)| {
        let is_last = kept == 0;
        kept += solution.len();
        is_last || kept <= FREEDOMS_KEPT
    });
    solution
}

/// All that a solution of [`stuck_m`] depends on, to the bit.
#[derive(PartialEq)]
struct Balance {
    lattice: Lattice,
    interfacial_bits: u64,
    drive: Vec<(usize, u64)>,
    force_bits: Vec<u64>,
}

/// Solves by conjugate gradients (Hestenes and Stiefel 1952).
fn balanced_m(
    lattice: &Lattice,
    interfacial_n_per_m: f64,
    drive: &[DriveSpring],
    force_n: Vec<f64>,
) -> Vec<f64> {
    let (nodes, freedoms, upward) = (lattice.nodes(), lattice.freedoms(), lattice.table.upward());
    let mut residual = force_n;
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).fold(0.0, |sum, (a, b)| sum + a * b);
    let (mut at, mut direction, mut bent) = (vec![0.0; freedoms], residual.clone(), vec![0.0; freedoms]);
    let mut square = product(&residual, &residual);
    let enough = RESIDUAL * RESIDUAL * square;
    for _ in 0..MOST_STEPS * freedoms {
        if square <= enough {
            break;
        }
        lattice.pull_of_springs(&mut bent, &direction);
        for bent in &mut bent {
            *bent = -*bent;
        }
        for freedom in 0..lattice.table.axes.len() {
            let held_n_per_m =
                if Some(freedom) == upward { lattice.foundation_n_per_m } else { interfacial_n_per_m };
            for n in lattice.row(0) {
                bent[freedom * nodes + n] += held_n_per_m * direction[freedom * nodes + n];
            }
        }
        for spring in drive {
            bent[spring.block] += spring.stiffness_n_per_m * direction[spring.block];
        }
        let far = square / product(&direction, &bent);
        for n in 0..freedoms {
            at[n] += far * direction[n];
            residual[n] -= far * bent[n];
        }
        let before = std::mem::replace(&mut square, product(&residual, &residual));
        for (direction, residual) in direction.iter_mut().zip(&residual) {
            *direction = residual + square / before * *direction;
        }
    }
    at
}

/// The normal load of each contact in a state; empty without a foundation.
pub fn normal_load_n(lattice: &Lattice, displacement_m: &[f64]) -> Vec<f64> {
    let Some(normal) = lattice.first_normal() else { return Vec::new() };
    lattice.row(0).map(|n| lattice.normal_load_n(displacement_m[normal + n])).collect()
}

/// The reason why a body pressed onto a foundation has no valid state of rest: the iteration did not
/// converge, or a contact has no load.
pub(crate) fn problem_at_rest(plan: &Plan) -> Option<String> {
    if !plan.elastic.has_foundation() {
        return None;
    }
    let u = &plan.initial.displacement_m;
    let mean_n = plan.total_normal_load_n / plan.blocks as f64;
    if let Some(n) = plan.normal_load_n.iter().position(|load_n| *load_n <= BEARS_NOTHING * mean_n) {
        return Some(format!("contact {} bears nothing of the load", n + 1));
    }
    let tangential_n = tangential_force_n(plan);
    let kt = plan.friction.interfacial_stiffness_n_per_m;
    let lattice = plan.elastic;
    let is_held = |(n, pull_n): (usize, &f64)| {
        (pull_n - kt * u[lattice.tangential_freedom(n)]).abs() <= UNBALANCED * mean_n
    };
    let held = tangential_n.iter().enumerate().all(is_held);
    let borne_n: f64 = plan.normal_load_n.iter().sum();
    let is_borne = (borne_n - plan.total_normal_load_n).abs() <= UNBALANCED * plan.total_normal_load_n;
    (!(held && is_borne)).then(|| format!("the forces of the pressed {} do not balance", lattice.table.name))
}

/// The pull of springs on each contact at the start, without friction and drive
/// ([`Lattice::tangential_force_n`]).
pub fn tangential_force_n(plan: &Plan) -> Vec<f64> {
    plan.elastic.tangential_force_n(&plan.initial.displacement_m)
}

/// The shear of each contact at the start, axis by axis: the pull of springs, drive and prestress.
pub(crate) fn shear_at_start_n(plan: &Plan) -> Vec<f64> {
    let (u, still) = (&plan.initial.displacement_m, vec![0.0; plan.elastic.freedoms()]);
    let mut shear_n = tangential_force_n(plan);
    plan.outside(0, u64::MAX).add_n(&mut shear_n[..plan.blocks], [u, &still]);
    shear_n
}

/// The magnitude of the shear of each contact at the start.
pub(crate) fn shear_sizes_at_start_n(plan: &Plan) -> Vec<f64> {
    let shear_n = shear_at_start_n(plan);
    match shear_n.split_at(plan.blocks) {
        (along_n, []) => along_n.iter().map(|along_n| magnitude([*along_n])).collect(),
        (along_n, across_n) => along_n.iter().zip(across_n).map(|(x, y)| magnitude([*x, *y])).collect(),
    }
}

#[cfg(test)]
mod tests {
    use crate::resolve;
    use crate::{Lattice, Plan};

    fn plan(sets: &[&str]) -> Plan {
        Plan::new(&resolve("slab", sets).unwrap_or_else(|error| panic!("{error}")))
    }

    /// Results of another program for the default slab and for a coarser one.
    #[test]
    fn the_default_slab_rests_where_another_program_has_it() {
        let coarse = ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7"];
        for (sets, ratio, first_m) in
            [(&[][..], -0.216413838, -7.504114667817e-07), (&coarse[..], -0.206473199, -1.233005712744e-06)]
        {
            let plan = plan(sets);
            let tau = super::tangential_force_n(&plan);
            assert!(
                (tau[0] / plan.normal_load_n[0] - ratio).abs() < 1e-9,
                "{}",
                tau[0] / plan.normal_load_n[0]
            );
            let found_m = plan.initial.displacement_m[0];
            assert!((found_m / first_m - 1.0).abs() < 1e-9, "{found_m}");
            let ratios = tau.iter().zip(&plan.normal_load_n).map(|(tau, p)| tau.abs() / p);
            let largest = ratios.fold(0.0, f64::max);
            assert!((largest - ratio.abs()).abs() < 5e-4, "{largest}");
        }
    }

    #[test]
    fn a_slab_at_rest_is_symmetric_and_held() {
        let plan = plan(&[]);
        let lattice = plan.elastic;
        let (nodes, columns) = (lattice.nodes(), lattice.columns);
        let u = &plan.initial.displacement_m;
        let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        for n in 0..nodes {
            let mirrored = n / columns * columns + columns - 1 - n % columns;
            assert!((u[n] + u[mirrored]).abs() < 1e-13 * largest, "x of node {n}");
            assert!((u[nodes + n] - u[nodes + mirrored]).abs() < 1e-13 * largest, "z of node {n}");
        }
        let mut force_n = vec![0.0; lattice.freedoms()];
        lattice.pull_of_springs(&mut force_n, u);
        for n in 0..columns {
            force_n[n] -= plan.friction.interfacial_stiffness_n_per_m * u[n];
            force_n[nodes + n] += plan.normal_load_n[n];
        }
        for (node, load_n) in lattice.top_row().zip(&plan.top_load_n) {
            force_n[nodes + node] -= load_n;
        }
        assert!(force_n.iter().all(|force_n| force_n.abs() < 1e-11), "all forces balance");
        assert!(plan.drive.springs[0].force_n(0.0, u[plan.drive.springs[0].block]) == 0.0);
    }

    #[test]
    fn a_kept_solution_is_that_of_its_own_forces_stiffness_and_drive() {
        let plan = plan(&["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7"]);
        let (lattice, kt) = (plan.elastic, plan.friction.interfacial_stiffness_n_per_m);
        let force_n = |factor: f64| {
            let load_n: Vec<f64> = plan.top_load_n.iter().map(|load_n| factor * load_n).collect();
            super::pressed_n(&lattice, &load_n)
        };
        let other = Lattice { foundation_n_per_m: 2.0 * lattice.foundation_n_per_m, ..lattice };
        let drive = &plan.drive.springs[..];
        let cases = [
            (lattice, kt, &[][..], force_n(1.0)),
            (lattice, kt, &[][..], force_n(2.0)),
            (lattice, 2.0 * kt, &[][..], force_n(1.0)),
            (lattice, kt, drive, force_n(1.0)),
            (other, kt, &[][..], force_n(1.0)),
        ];
        let mut solutions = Vec::new();
        for _ in 0..2 {
            for (lattice, kt, drive, force_n) in &cases {
                let found = super::stuck_m(lattice, *kt, drive, force_n.clone());
                assert_eq!(found, super::balanced_m(lattice, *kt, drive, force_n.clone()));
                solutions.push(found);
            }
        }
        for (n, solution) in solutions[..cases.len()].iter().enumerate() {
            assert!(solutions[..n].iter().all(|other| other != solution), "case {n}");
        }
    }

    /// As the page has them.
    #[test]
    fn the_default_slab_has_the_numbers_of_the_page() {
        let plan = plan(&[]);
        let (k, m) = (plan.elastic.stiffness_n_per_m, plan.block_mass_kg);
        let speed = |share: f64| plan.spacing_m * (share * k / m).sqrt();
        assert!((speed(1.5) - 1720.0).abs() < 0.5 && (speed(0.5) - 993.0).abs() < 0.5);
        assert!((plan.scales.wave_speed_m_per_s() / speed(0.5) - 1.0).abs() < 1e-12);
        let rho = 0.0756 / (0.14 * 0.075 * 0.006);
        assert!((rho - 1200.0_f64).abs() < 1e-9);
        assert_eq!(plan.drive.springs[0].block, 2 * 57, "5 mm are two rows");
        // The largest frequency, and dt as a share of the longest stable step.
        assert!((2e-7 * 1.6e6 - 0.32_f64).abs() < 1e-12 && plan.step_share() < 0.4, "{}", plan.step_share());
        assert!((plan.normal_load_n.iter().sum::<f64>() - 1920.0).abs() < 1e-9);
    }

    /// Results of two other programs, by conjugate gradients and by elimination, equal to all these digits.
    #[test]
    fn bodies_rest_where_other_programs_have_them() {
        for (name, largest, tau_over_p, first_m, bears, middles) in [
            (
                "body-coarse",
                0.266642197200,
                [-0.218990596502, -0.152122253373],
                [-9.961786088299e-07, -6.919974517521e-07],
                1.159450723577,
                [-0.195317399541, -0.127863602648],
            ),
            (
                "body",
                0.288518983163,
                [-0.223308237409, -0.182692733164],
                [-6.463277507221e-07, -5.287730746946e-07],
                1.304992384992,
                [-0.205767453832, -0.167006812779],
            ),
        ] {
            let plan = Plan::new(&resolve(name, &[""; 0]).unwrap());
            let (lattice, p) = (plan.elastic, &plan.normal_load_n);
            let (tau, u) = (super::tangential_force_n(&plan), &plan.initial.displacement_m);
            let (along, across) = tau.split_at(plan.blocks);
            let is = |found: f64, expected: f64| {
                assert!((found / expected - 1.0).abs() < 1e-9, "{name}: {found}, not {expected}");
            };
            let sizes = super::shear_sizes_at_start_n(&plan);
            is(sizes.iter().zip(p).map(|(size, p)| size / p).fold(0.0, f64::max), largest);
            is(along[0] / p[0], tau_over_p[0]);
            is(across[0] / p[0], tau_over_p[1]);
            is(u[0], first_m[0]);
            is(u[lattice.nodes()], first_m[1]);
            is(p[0] / (6400.0 / plan.blocks as f64), bears);
            let edge = lattice.lanes / 2 * lattice.columns;
            is(along[edge] / p[edge], middles[0]);
            let side = lattice.columns / 2;
            is(across[side] / p[side], middles[1]);
            is(p.iter().sum(), 6400.0);
            assert_eq!(plan.initial.stick_position_m, vec![0.0; 2 * plan.blocks]);
        }
    }

    /// The rest state is its own mirror image in both directions along the surface, and a sheet is relaxed.
    #[test]
    fn a_body_at_rest_is_symmetric_and_a_sheet_at_rest_is_not_strained() {
        let plan = Plan::new(&resolve("body-coarse", &[""; 0]).unwrap());
        let lattice = plan.elastic;
        let (nodes, u) = (lattice.nodes(), &plan.initial.displacement_m);
        let largest = u.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        for n in 0..nodes {
            let [column, lane, row] = lattice.place(n);
            let at = |column: usize, lane: usize| (row * lattice.lanes + lane) * lattice.columns + column;
            let turned = at(lattice.columns - 1 - column, lane);
            let mirrored = at(column, lattice.lanes - 1 - lane);
            for (axis, in_x, in_y) in [(0, -1.0, 1.0), (1, 1.0, -1.0), (2, 1.0, 1.0)] {
                let of = |node: usize| u[axis * nodes + node];
                assert!((of(n) - in_x * of(turned)).abs() < 1e-13 * largest, "axis {axis} of node {n}");
                assert!((of(n) - in_y * of(mirrored)).abs() < 1e-13 * largest, "axis {axis} of node {n}");
            }
        }
        let sheet = Plan::new(&resolve("sheet-coarse", &["normal_load.tilt=0.5"]).unwrap());
        assert_eq!(sheet.initial.displacement_m, vec![0.0; 2 * 156]);
        assert_eq!(sheet.initial.stick_position_m, vec![0.0; 2 * 156]);
        let p = &sheet.normal_load_n;
        assert!((p.iter().sum::<f64>() - 400.0).abs() < 1e-10);
        assert!((p[0] / p[25] - 3.0).abs() < 1e-12 && p[..26] == p[26..52], "tilted along, even across");
    }

    /// Stability limits and speeds of long waves, from another program.
    #[test]
    fn sheets_and_bodies_have_the_steps_and_waves_of_another_program() {
        for (name, step_s, c_l, c_s) in [
            ("sheet", 9.115e-7, 1621.6, 936.3),
            ("sheet-coarse", 1.728e-6, 1710.3, 987.4),
            ("body", 5.019e-7, 1884.1, 1087.8),
            ("body-coarse", 9.296e-7, 2035.4, 1175.1),
        ] {
            let plan = Plan::new(&resolve(name, &[""; 0]).unwrap());
            let found_s = plan.longest_stable_step_s;
            assert!((found_s / step_s - 1.0).abs() < 1e-4, "{name}: {found_s}");
            let slow = plan.scales.wave_speed_m_per_s();
            let fast = slow * plan.elastic.longitudinal_over_shear().unwrap();
            assert!((slow - c_s).abs() < 0.06 && (fast - c_l).abs() < 0.06, "{name}: {slow} {fast}");
        }
    }

    #[test]
    fn a_side_drive_over_an_area_pulls_all_rows_or_one() {
        let springs = |sets: &[&str]| {
            let plan = Plan::new(&resolve("body-coarse", sets).unwrap_or_else(|error| panic!("{error}")));
            let springs = plan.drive.springs.iter();
            springs.map(|spring| (spring.block, spring.stiffness_n_per_m)).collect::<Vec<_>>()
        };
        let k = 13333333.333333334;
        // 5 mm are the second layer.
        let layer = 29 * 5;
        let all: Vec<_> = (0..5).map(|row| (layer + 29 * row, k / 5.0)).collect();
        assert_eq!(springs(&[]), all);
        assert_eq!(springs(&["drive.across=4"]), [(layer + 29 * 3, k)]);
        let top = springs(&["drive.kind=top", "drive.height_m=0"]);
        let even: Vec<_> = (15 * layer..16 * layer).map(|node| (node, k / 145.0)).collect();
        assert_eq!(top, even);
        let falling = springs(&["drive.kind=top", "drive.height_m=0", "drive.decay_length_m=0.05"]);
        let sum = falling.iter().map(|(_, stiffness)| stiffness).sum::<f64>();
        assert!((sum / k - 1.0).abs() < 1e-12 && falling[0].1 == falling[29].1, "{sum}");
    }

    #[test]
    fn a_top_drive_pulls_at_the_top_row() {
        let plan = plan(&["drive.kind=top", "drive.height_m=0"]);
        let springs = &plan.drive.springs;
        assert_eq!((springs.len(), springs[0].block, springs[56].block), (57, 30 * 57, 31 * 57 - 1));
        let u = &plan.initial.displacement_m;
        assert_eq!(plan.drive.total_force_n(0.0, u), 0.0, "relaxed in the rest state");
    }
}
