//! Properties of every lattice, tested for slabs, sheets and blocks.

use std::f64::consts::PI;

use super::{BLOCK, Bond, CHAIN, Lattice, SHEET, SLAB, Table};
use crate::plan::splitmix::mixed;

const fn with_springs(lattice: Lattice) -> Lattice {
    Lattice { stiffness_n_per_m: 3.0, damping_kg_per_s: 0.7, ..lattice }
}

const LATTICES: [Lattice; 5] = [
    with_springs(Lattice::of(&SLAB, [7, 1, 5])),
    with_springs(Lattice::of(&SHEET, [7, 5, 1])),
    with_springs(Lattice::of(&BLOCK, [5, 4, 3])),
    with_springs(Lattice::of(&BLOCK, [12, 3, 4])),
    with_springs(Lattice::of(&BLOCK, [70, 3, 3])),
];

/// Numbers without pattern, one for each freedom.
fn numbers(lattice: &Lattice, seed: u64) -> Vec<f64> {
    let number = |n: usize| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5;
    (0..lattice.freedoms()).map(number).collect()
}

fn still(lattice: &Lattice) -> Vec<f64> {
    vec![0.0; lattice.freedoms()]
}

fn both(lattice: &Lattice, u: &[f64], v: &[f64]) -> [Vec<f64>; 2] {
    let (mut springs, mut dashpots) = (still(lattice), still(lattice));
    lattice.pull_of_springs(&mut springs, u);
    lattice.pull_of_dashpots(&mut dashpots, v);
    [springs, dashpots]
}

fn pull(lattice: &Lattice, u: &[f64], v: &[f64]) -> Vec<f64> {
    let [springs, dashpots] = both(lattice, u, v);
    springs.iter().zip(&dashpots).map(|(spring, dashpot)| spring + dashpot).collect()
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A number for each freedom, from the axis and the place of its node.
fn by_place(lattice: &Lattice, number: impl Fn(usize, [f64; 3]) -> f64) -> Vec<f64> {
    let place = |node: usize| lattice.place(node).map(|at| at as f64);
    let of_axis =
        |axis: &usize| (0..lattice.nodes()).map(|node| number(*axis, place(node))).collect::<Vec<_>>();
    lattice.table.axes.iter().flat_map(of_axis).collect()
}

/// Displacements linear in the place, with these derivatives.
fn linear(lattice: &Lattice, gradient: [[f64; 3]; 3]) -> Vec<f64> {
    by_place(lattice, |axis, place| product(&gradient[axis], &place))
}

fn is_inside(lattice: &Lattice, node: usize) -> bool {
    let counts = [lattice.columns, lattice.lanes, lattice.rows];
    let place = lattice.place(node);
    lattice.table.axes.iter().all(|axis| (1..counts[*axis] - 1).contains(&place[*axis]))
}

/// As the page has it: `k e (e . (u_j - u_i))` and `eta (v_j - v_i)` for every bond.
fn by_bonds(lattice: &Lattice, u: &[f64], v: &[f64]) -> [Vec<f64>; 2] {
    let (nodes, axes) = (lattice.nodes(), lattice.table.axes.len());
    let mut forces = [still(lattice), still(lattice)];
    lattice.over_bonds(|Bond { from, to, along, stiffness_n_per_m }| {
        let change = |of: &[f64], axis: usize| of[axis * nodes + to] - of[axis * nodes + from];
        let stretch: f64 = (0..axes).map(|axis| along[axis] * change(u, axis)).sum();
        for axis in 0..axes {
            let by = [stiffness_n_per_m * along[axis] * stretch, lattice.damping_kg_per_s * change(v, axis)];
            for (forces, force) in forces.iter_mut().zip(by) {
                forces[axis * nodes + from] += force;
                forces[axis * nodes + to] -= force;
            }
        }
    });
    forces
}

/// In lines shorter than a group, as long as some, and longer than a piece; by the loops of the lattice, and
/// freedom by freedom.
#[test]
fn the_pull_is_that_of_the_bonds() {
    for columns in [2, 3, 7, 8, 10, 11, 18, 27, 64, 65, 66, 129, 150] {
        let shapes = [
            Lattice::of(&CHAIN, [columns, 1, 1]),
            Lattice::of(&SLAB, [columns, 1, 2]),
            Lattice::of(&SLAB, [columns, 1, 5]),
            Lattice::of(&SHEET, [columns, 1, 1]),
            Lattice::of(&SHEET, [columns, 5, 1]),
            Lattice::of(&BLOCK, [columns, 1, 1]),
            Lattice::of(&BLOCK, [columns, 1, 3]),
            Lattice::of(&BLOCK, [columns, 2, 1]),
            Lattice::of(&BLOCK, [columns, 4, 3]),
        ];
        for lattice in shapes.map(with_springs) {
            let (u, v) = (numbers(&lattice, 1), numbers(&lattice, 2));
            let expected = by_bonds(&lattice, &u, &v);
            let freedoms = 0..lattice.freedoms();
            let one_by_one = [
                freedoms.clone().map(|n| lattice.spring_force_n(&u, n)).collect(),
                freedoms.clone().map(|n| lattice.damping_force_n(&v, n)).collect(),
            ];
            for found in [both(&lattice, &u, &v), one_by_one] {
                for n in freedoms.clone() {
                    for (found, expected) in found.iter().zip(&expected) {
                        let (found, expected) = (found[n], expected[n]);
                        assert!((found - expected).abs() < 5e-14, "{lattice:?}, {n}: {found} {expected}");
                    }
                }
            }
        }
    }
}

#[test]
fn every_bond_is_there_once() {
    for (lattice, expected) in [
        (Lattice::of(&CHAIN, [7, 1, 1]), 6),
        (Lattice::of(&SLAB, [7, 1, 5]), 6 * 5 + 7 * 4 + 2 * 6 * 4),
        (Lattice::of(&SHEET, [7, 5, 1]), 6 * 5 + 7 * 4 + 2 * 6 * 4),
        (
            Lattice::of(&BLOCK, [5, 4, 3]),
            (4 * 12 + 3 * 15 + 2 * 20) + 2 * (4 * 3 * 3 + 4 * 2 * 4 + 3 * 2 * 5),
        ),
    ] {
        let mut bonds = 0;
        lattice.over_bonds(|bond| {
            bonds += 1;
            assert!((product(&bond.along, &bond.along) - 1.0).abs() < 1e-15);
            assert!(bond.from < lattice.nodes() && bond.to < lattice.nodes());
        });
        assert_eq!(bonds, expected, "{}", lattice.table.name);
    }
    // Agreement to the bit, on which results of slabs rely.
    let mut along = Vec::new();
    Lattice::of(&SLAB, [2, 1, 2]).over_bonds(|bond| along.push(bond.along));
    let root = std::f64::consts::FRAC_1_SQRT_2;
    let [x, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    assert_eq!(along, [x, z, [root, root, 0.0], z, [-root, root, 0.0], x]);
}

/// The work of the forces of one displacement on another is that of the other on the one (Betti).
#[test]
fn the_work_of_two_displacements_on_each_other_is_the_same() {
    for lattice in &LATTICES {
        for seed in 0..20 {
            let (a, b) = (numbers(lattice, seed), numbers(lattice, 100 + seed));
            for which in [0, 1] {
                let forces = |of: &[f64]| both(lattice, of, of)[which].clone();
                let (ab, ba) = (product(&a, &forces(&b)), product(&b, &forces(&a)));
                assert!((ab - ba).abs() < 1e-13 * 40.0, "{ab} {ba}");
                assert!(product(&a, &forces(&a)) < 0.0, "springs and dashpots only resist");
            }
        }
    }
}

/// The work of the forces from rest equals the energy stored in the springs, bond by bond.
#[test]
fn the_energy_is_that_of_the_bonds() {
    for lattice in &LATTICES {
        let (u, nodes, mut stored_j) = (numbers(lattice, 3), lattice.nodes(), 0.0);
        lattice.over_bonds(|Bond { from, to, along, stiffness_n_per_m }| {
            let change = |axis: usize| u[axis * nodes + to] - u[axis * nodes + from];
            let stretch_m: f64 = (0..lattice.table.axes.len()).map(|axis| along[axis] * change(axis)).sum();
            stored_j += 0.5 * stiffness_n_per_m * stretch_m * stretch_m;
        });
        let work_j = -0.5 * product(&u, &both(lattice, &u, &u)[0]);
        assert!((work_j / stored_j - 1.0).abs() < 1e-14, "{work_j} {stored_j}");
    }
}

/// The patch test: under uniform strain no node inside is pulled.
#[test]
fn uniform_strain_pulls_at_no_node_inside() {
    for lattice in &LATTICES {
        for gradient in [
            [[1e-3, 0.0, 0.0], [0.0; 3], [0.0; 3]],
            [[0.0; 3], [0.0, 2e-3, 0.0], [0.0, 0.0, 2e-3]],
            [[0.0, 3e-3, 3e-3], [0.0; 3], [0.0; 3]],
            [[1e-3, -2e-3, 3e-3], [4e-3, -5e-3, 6e-3], [-7e-3, 8e-3, -9e-3]],
        ] {
            let force = pull(lattice, &linear(lattice, gradient), &still(lattice));
            for n in (0..lattice.freedoms()).filter(|n| is_inside(lattice, n % lattice.nodes())) {
                assert!(force[n].abs() < 1e-15 * 100.0, "{}, {n}: {}", lattice.table.name, force[n]);
            }
            assert!(force.iter().any(|force| force.abs() > 1e-4), "the edges are pulled");
        }
    }
}

#[test]
fn moved_and_turned_as_a_whole_it_does_not_pull() {
    for lattice in &LATTICES {
        for whole in [[0.25, 0.0, 0.0], [0.0, -0.5, 0.0], [0.0, 0.0, -0.5], [2.0, 1.0, 4.0]] {
            let whole = by_place(lattice, |axis, _| whole[axis]);
            assert!(pull(lattice, &whole, &whole).iter().all(|force| *force == 0.0));
        }
        // Springs do not resist a small rotation; dashpots, which act on the whole relative velocity, do.
        let turned = linear(lattice, [[0.0, 1.0, -2.0], [-1.0, 0.0, 0.5], [2.0, -0.5, 0.0]]);
        assert!(pull(lattice, &turned, &still(lattice)).iter().all(|force| force.abs() < 1e-13));
        assert!(pull(lattice, &still(lattice), &turned).iter().any(|force| force.abs() > 1e-3));
    }
}

/// Stretched along `x`, a lattice has no forces on its other sides if it narrows by Poisson's ratio.
#[test]
fn poissons_ratio_is_a_third_in_planes_and_a_quarter_in_blocks() {
    for lattice in &LATTICES {
        let ratio = if lattice.table.axes.len() == 2 { 1.0 / 3.0 } else { 0.25 };
        let strain = |axis: usize| 3e-3 * if axis == 0 { 1.0 } else { -ratio };
        let force =
            pull(lattice, &by_place(lattice, |axis, place| strain(axis) * place[axis]), &still(lattice));
        let last = [lattice.columns, lattice.lanes, lattice.rows].map(|count| count - 1);
        for (n, force) in force.iter().enumerate() {
            let (axis, place) = (lattice.table.axes[n / lattice.nodes()], lattice.place(n % lattice.nodes()));
            // Of nodes on edges half of the bonds would do.
            let others = || lattice.table.axes.iter().filter(|other| **other != axis);
            let is_on_face = others().all(|other| (1..last[*other]).contains(&place[*other]));
            if axis != 0 && is_on_face {
                assert!(force.abs() < 1e-14, "{}, {n}: {force}", lattice.table.name);
            }
        }
    }
    // Through a cut between two columns of a plane: half a spring for each of its edges is too much.
    let lattice = LATTICES[0];
    let force =
        pull(&lattice, &linear(&lattice, [[3e-3, 0.0, 0.0], [0.0; 3], [0.0, 0.0, -1e-3]]), &still(&lattice));
    let pulled: f64 = (0..lattice.rows).map(|row| -force[lattice.row(row).end - 1]).sum();
    let modulus_and_width = 4.0 * lattice.stiffness_n_per_m / 3.0 * (lattice.rows - 1) as f64;
    let surplus = lattice.stiffness_n_per_m * 3e-3;
    assert!((pulled - surplus - modulus_and_width * 3e-3).abs() < 1e-15, "{pulled}");
}

/// Along each axis, and along two.
#[test]
fn a_mirrored_lattice_gives_mirrored_forces_to_the_bit() {
    for lattice in &LATTICES {
        let counts = [lattice.columns, lattice.lanes, lattice.rows];
        let (u, v) = (numbers(lattice, 5), numbers(lattice, 6));
        for mirrored in [&[0][..], &[1], &[2], &[0, 1]] {
            let mirror = |of: &[f64]| -> Vec<f64> {
                let at = |node: usize| {
                    let mut place = lattice.place(node);
                    for axis in mirrored {
                        place[*axis] = counts[*axis] - 1 - place[*axis];
                    }
                    (place[2] * lattice.lanes + place[1]) * lattice.columns + place[0]
                };
                let number = |n: usize| {
                    let (freedom, node) = (n / lattice.nodes(), n % lattice.nodes());
                    let sign = if mirrored.contains(&lattice.table.axes[freedom]) { -1.0 } else { 1.0 };
                    sign * of[freedom * lattice.nodes() + at(node)]
                };
                (0..lattice.freedoms()).map(number).collect()
            };
            let (expected, found) = (both(lattice, &u, &v), both(lattice, &mirror(&u), &mirror(&v)));
            assert_eq!(found, expected.map(|forces| mirror(&forces)), "{}", lattice.table.name);
        }
    }
}

/// By applying stiffness and damping to unit vectors.
#[test]
fn diagonals_and_rows_are_those_of_the_lattice() {
    for (lattice, foundation_n_per_m) in LATTICES.iter().flat_map(|l| [(l, 0.0), (l, 2.0 * 9.0)]) {
        let lattice = Lattice { foundation_n_per_m, ..*lattice };
        let upward = lattice.table.upward();
        let elastic = lattice;
        let (mut largest, mut rows) = ([0.0_f64; 2], vec![[0.0; 4]; lattice.freedoms()]);
        for column in 0..lattice.freedoms() {
            let mut unit = still(&lattice);
            unit[column] = 1.0;
            let [springs, dashpots] = both(&lattice, &unit, &unit);
            let diagonal = -springs[column];
            assert!((diagonal - elastic.diagonal_n_per_m(column)).abs() < 1e-14);
            assert!((-dashpots[column] - elastic.damping_diagonal_kg_per_s(column)).abs() < 1e-14);
            let (freedom, node) = (column / lattice.nodes(), column % lattice.nodes());
            let is_borne = upward == Some(freedom) && node < lattice.contacts();
            let held = if is_borne { foundation_n_per_m } else { 0.0 };
            largest[0] = largest[0].max(diagonal + held);
            rows[column][0] += held;
            for (row, (spring, dashpot)) in rows.iter_mut().zip(springs.iter().zip(&dashpots)) {
                row[0] += spring.abs();
                row[1] += dashpot.abs();
                row[2] += spring * spring;
                row[3] += dashpot * dashpot;
            }
        }
        let name = lattice.table.name;
        assert!((largest[0] - elastic.largest_diagonal_n_per_m()).abs() < 1e-13, "{name}");
        let step_s = 0.3;
        let mut longest = [0.0_f64; 3];
        for [spring, dashpot, springs, dashpots] in rows {
            assert!(spring <= elastic.row_bound_n_per_m() * (1.0 + 1e-15), "{name}");
            let length = dashpots.sqrt() + step_s / 2.0 * springs.sqrt();
            assert!(length <= elastic.row_length_kg_per_s(step_s) * (1.0 + 1e-15), "{name}");
            for (longest, of) in longest.iter_mut().zip([spring, dashpot, length]) {
                *longest = longest.max(of);
            }
        }
        let bounds = [
            elastic.row_bound_n_per_m(),
            elastic.damping_row_bound_kg_per_s(),
            elastic.row_length_kg_per_s(step_s),
        ];
        for (longest, bound) in longest.iter().zip(bounds) {
            assert!((longest / bound - 1.0).abs() < 1e-14, "{name}: {longest} of {bound}");
        }
    }
}

/// Time steps of slabs and chains rest on these doubles.
#[test]
fn numbers_of_slabs_and_chains_are_what_they_were_to_the_bit() {
    for n in 1..200 {
        let random = |seed: u64| mixed(seed << 32 | n) as f64 / u64::MAX as f64;
        let (k, eta, kf, kt, drive) =
            (1e7 * random(1), random(2), 1e8 * random(3), 1e7 * random(4), 1e6 * random(5));
        let lattice = Lattice {
            stiffness_n_per_m: k,
            damping_kg_per_s: eta,
            foundation_n_per_m: kf,
            ..Lattice::of(&SLAB, [5, 1, 3])
        };
        let dt = 1e-6 * random(6);
        let slab = lattice;
        assert_eq!(slab.largest_diagonal_n_per_m(), (3.0 * k).max(1.5 * k + kf));
        assert_eq!(slab.row_bound_n_per_m(), (7.0 * k).max(3.5 * k + kf));
        assert_eq!(slab.damping_row_bound_kg_per_s(), 16.0 * eta);
        assert_eq!(slab.spectral_bound_n_per_m(), 6.0 * k);
        assert_eq!(slab.damping_spectral_bound_kg_per_s(), 12.0 * eta);
        assert_eq!(slab.row_length_kg_per_s(dt), 72f64.sqrt() * eta + 11.5f64.sqrt() * (dt * k / 2.0));
        assert_eq!(slab.stiffest_n_per_m(kt, drive), 6.0 * k + (kt + drive).max(kf));
        assert_eq!(slab.slowest_wave_n_per_m(), 0.5 * k);
        assert_eq!(slab.longitudinal_over_shear(), Some(3f64.sqrt()));
        for (contact, sides) in [(0, 1.0), (1, 2.0), (4, 1.0)] {
            assert_eq!(slab.diagonal_n_per_m(contact), sides * 1.25 * k);
        }
        let chain = crate::body::elastic::Chain { nodes: 5, stiffness_n_per_m: k, damping_kg_per_s: eta };
        let chain = chain.as_lattice();
        assert_eq!(chain.largest_diagonal_n_per_m(), 2.0 * k);
        assert_eq!(chain.row_bound_n_per_m(), 4.0 * k);
        assert_eq!(chain.damping_row_bound_kg_per_s(), 4.0 * eta);
        assert_eq!(chain.spectral_bound_n_per_m(), 4.0 * k);
        assert_eq!(chain.damping_spectral_bound_kg_per_s(), 4.0 * eta);
        assert_eq!(chain.row_length_kg_per_s(dt), 6f64.sqrt() * (eta + dt * k / 2.0));
        assert_eq!(chain.stiffest_n_per_m(kt, drive), 4.0 * k + kt + drive);
        assert_eq!(chain.slowest_wave_n_per_m(), k);
        assert_eq!(chain.longitudinal_over_shear(), None);
        for (node, sides) in [(0, 1.0), (1, 2.0), (4, 1.0)] {
            assert_eq!(chain.diagonal_n_per_m(node), sides * k);
            assert_eq!(chain.damping_diagonal_kg_per_s(node), sides * eta);
        }
    }
}

/// The action of springs and dashpots of an infinite lattice on a plane wave along `e` with these phases,
/// over `k` and `eta`, from the pull on the middle node of a patch.
fn on_wave(table: &'static Table, phase: [f64; 3], e: [f64; 3]) -> [[f64; 3]; 2] {
    let counts = [0, 1, 2].map(|axis| if table.freedom(axis).is_some() { 3 } else { 1 });
    let patch = Lattice { damping_kg_per_s: 1.0, ..Lattice::of(table, counts) };
    let (nodes, middle) = (patch.nodes(), patch.nodes() / 2);
    let from = patch.place(middle).map(|at| at as f64);
    let wave = by_place(&patch, |axis, place| {
        let away: f64 = (0..3).map(|axis| phase[axis] * (place[axis] - from[axis])).sum();
        e[axis] * away.cos()
    });
    both(&patch, &wave, &wave).map(|force| {
        let mut of_axes = [0.0; 3];
        for (freedom, axis) in table.axes.iter().enumerate() {
            of_axes[*axis] = -force[freedom * nodes + middle];
        }
        of_axes
    })
}

/// Directions of the axes of a table, of the diagonals of its faces, and of its body.
fn directions(table: &Table) -> Vec<[f64; 3]> {
    let all = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 0.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [1.0, 1.0, 1.0],
    ];
    let lies_within =
        |along: &[f64; 3]| (0..3).all(|axis| along[axis] == 0.0 || table.freedom(axis).is_some());
    all.into_iter()
        .filter(lies_within)
        .map(|along| along.map(|part| part / product(&along, &along).sqrt()))
        .collect()
}

/// In all directions: over `k a^2 / m`, squares of speeds of 3/2 and 1/2 in planes, of 3 and 1 in blocks.
#[test]
fn long_waves_are_those_of_an_isotropic_body() {
    for (table, longitudinal, shear) in [(&SLAB, 1.5, 0.5), (&SHEET, 1.5, 0.5), (&BLOCK, 3.0, 1.0)] {
        assert_eq!(table.long_waves(), (longitudinal, Some(shear)));
        for along in directions(table) {
            let short = 1e-3;
            let phase = along.map(|part| part * short);
            for e in directions(table) {
                // The component along the wave is longitudinal, the rest is shear.
                let part = product(&e, &along);
                let [found, _] = on_wave(table, phase, e);
                for axis in 0..3 {
                    let expected = longitudinal * part * along[axis] + shear * (e[axis] - part * along[axis]);
                    let found = found[axis] / (short * short);
                    assert!((found - expected).abs() < 1e-5, "{along:?} {e:?}: {found} {expected}");
                }
            }
        }
    }
}

/// Over all plane waves, by the power method; each bound is attained at a corner.
#[test]
fn no_plane_wave_is_beyond_the_bounds() {
    for (table, springs_at, dashpots_at) in [
        (&CHAIN, [PI, 0.0, 0.0], [PI, 0.0, 0.0]),
        (&SLAB, [PI, 0.0, 0.0], [PI, 0.0, 0.0]),
        (&SHEET, [PI, 0.0, 0.0], [PI, 0.0, 0.0]),
        (&BLOCK, [PI, 0.0, 0.0], [PI, PI, 0.0]),
    ] {
        let bounds = [table.largest_eigenvalue, table.largest_damping_eigenvalue];
        let largest = |phase: [f64; 3]| {
            [0, 1].map(|which| {
                let (mut e, mut found) = ([1.0, 0.61, -0.37], 0.0);
                for _ in 0..20 {
                    for (axis, part) in e.iter_mut().enumerate() {
                        *part = if table.freedom(axis).is_some() { *part } else { 0.0 };
                    }
                    let length = product(&e, &e).sqrt();
                    e = if length > 0.0 { e.map(|part| part / length) } else { e };
                    let onto = on_wave(table, phase, e)[which];
                    (found, e) = (product(&e, &onto), onto);
                }
                found
            })
        };
        let steps = |axis: usize| if table.freedom(axis).is_some() { 0..=6 } else { 0..=0 };
        for x in steps(0) {
            for y in steps(1) {
                for z in steps(2) {
                    let phase = [x, y, z].map(|step| PI / 6.0 * f64::from(step));
                    for (found, bound) in largest(phase).iter().zip(bounds) {
                        assert!(*found <= bound * (1.0 + 1e-14), "{}, {phase:?}: {found}", table.name);
                    }
                }
            }
        }
        assert!((largest(springs_at)[0] / bounds[0] - 1.0).abs() < 1e-12, "{}", table.name);
        assert!((largest(dashpots_at)[1] / bounds[1] - 1.0).abs() < 1e-12, "{}", table.name);
    }
}

/// Larger lattices approach the bounds from below.
#[test]
fn large_lattices_come_close_to_the_bounds() {
    let alternating = |place: f64| if place % 2.0 == 0.0 { 1.0 } else { -1.0 };
    let mut shares = Vec::new();
    for lattice in [
        Lattice::of(&SLAB, [40, 1, 40]),
        Lattice::of(&SHEET, [40, 40, 1]),
        Lattice::of(&BLOCK, [9, 7, 8]),
        Lattice::of(&BLOCK, [40, 20, 20]),
    ] {
        let lattice = Lattice { damping_kg_per_s: 1.0, ..lattice };
        // Along x, with neighbours along x against each other; of dashpots along two axes.
        let stiffest = by_place(&lattice, |axis, place| if axis == 0 { alternating(place[0]) } else { 0.0 });
        let is_block = lattice.table.axes.len() == 3;
        let most_damped =
            by_place(
                &lattice,
                |axis, [x, y, _]| {
                    if axis == 0 { alternating(x + if is_block { y } else { 0.0 }) } else { 0.0 }
                },
            );
        let over = |wave: &[f64], which: usize| {
            -product(wave, &both(&lattice, wave, wave)[which]) / product(wave, wave)
        };
        shares.push([
            over(&stiffest, 0) / lattice.spectral_bound_n_per_m(),
            over(&most_damped, 1) / lattice.damping_spectral_bound_kg_per_s(),
        ]);
    }
    assert!(shares.iter().flatten().all(|share| *share < 1.0), "{shares:?}");
    let [slab, sheet, small, large] = shares[..] else { panic!("four lattices") };
    assert!([slab, sheet].iter().flatten().all(|share| *share > 0.95), "{shares:?}");
    assert!((0..2).all(|which| small[which] < large[which] && large[which] > 0.93), "{shares:?}");
}

#[test]
fn nodes_are_counted_along_rows_then_across_then_upwards() {
    let slab = Lattice::of(&SLAB, [5, 1, 4]);
    assert_eq!((slab.contacts(), slab.place(2), slab.place(12)), (5, [2, 0, 0], [2, 0, 2]));
    for lattice in [Lattice::of(&SHEET, [5, 4, 1]), Lattice::of(&BLOCK, [5, 4, 3])] {
        assert_eq!((lattice.contacts(), lattice.place(7)), (20, [2, 1, 0]));
    }
}
