//! Energies of a state of a lattice, without sums over steps.

use asperity_model::{Lattice, Plan, SliderState};

/// Kinetic and elastic energy of a state of a lattice.
pub(crate) fn stored_j(plan: &Plan, lattice: &Lattice, state: &SliderState) -> (f64, f64) {
    let (nodes, u, v) = (lattice.nodes(), &state.displacement_m, &state.velocity_m_per_s);
    let square: f64 = v.iter().map(|v| v * v).sum();
    let mut elastic_j = match lattice.axes() {
        1 => bonds_j::<1>(lattice, u),
        2 => bonds_j::<2>(lattice, u),
        _ => bonds_j::<3>(lattice, u),
    };
    let (kt, kf) = (plan.friction.interfacial_stiffness_n_per_m, lattice.foundation_n_per_m);
    let (contacts, upward) = (plan.blocks, lattice.table.upward());
    for n in 0..contacts {
        if let Some(junctions) = &state.junctions {
            elastic_j += junctions.energy_j(plan, n, u[n]);
        } else if state.slip[n] == 0.0 {
            for axis in 0..state.stick_position_m.len() / contacts {
                let stretch_m = u[axis * nodes + n] - state.stick_position_m[axis * contacts + n];
                elastic_j += 0.5 * kt * stretch_m * stretch_m;
            }
        }
        if let Some(upward) = upward {
            let sunk_m = u[upward * nodes + n].min(0.0);
            elastic_j += 0.5 * kf * sunk_m * sunk_m;
        }
    }
    let with_drive_j =
        plan.outside(state.step, state.hold_step).springs_j(u).fold(elastic_j, |sum, of| sum + of);
    (0.5 * plan.block_mass_kg * square, with_drive_j)
}

/// Energy of the bonds of a lattice whose nodes move along `A` axes.
fn bonds_j<const A: usize>(lattice: &Lattice, u: &[f64]) -> f64 {
    let nodes = lattice.nodes();
    // Energies of a line of nodes by node and kind, in the order of the sum; 0 for missing bonds.
    let (mut bond_j, mut elastic_j) = (Vec::new(), 0.0);
    lattice.over_lines(|first, kinds| {
        bond_j.clear();
        bond_j.resize(lattice.columns * kinds.len(), 0.0);
        for (kind, bonds) in kinds.iter().enumerate() {
            let ends = |axis: usize, ahead: isize| {
                let node = (axis * nodes + first + bonds.columns.start).wrapping_add_signed(ahead);
                &u[node..][..bonds.columns.len()]
            };
            let from: [&[f64]; A] = std::array::from_fn(|axis| ends(axis, 0));
            let to: [&[f64]; A] = std::array::from_fn(|axis| ends(axis, bonds.ahead));
            let of_kind = bond_j[bonds.columns.start * kinds.len() + kind..].iter_mut().step_by(kinds.len());
            for (column, bond_j) in (0..bonds.columns.len()).zip(of_kind) {
                let part_m = |axis: usize| bonds.along[axis] * (to[axis][column] - from[axis][column]);
                let stretch_m: f64 = (0..A).map(part_m).sum();
                *bond_j = 0.5 * bonds.stiffness_n_per_m * stretch_m * stretch_m;
            }
        }
        elastic_j = bond_j.iter().fold(elastic_j, |sum, bond_j| sum + bond_j);
    });
    elastic_j
}
