//! The loops over the nodes of a lattice: the pull between them, and their motion.

use asperity_model::Lattice;

use crate::kernels::simd::kernel;

kernel! {
    /// The pull of springs between nodes on all freedoms.
    fn lattice_springs(force: &mut [f64], u: &[f64], lattice: &Lattice) {
        lattice.pull_of_springs(force, u);
    }
}

kernel! {
    /// The pull of dashpots between nodes on all freedoms.
    fn lattice_dashpots(force: &mut [f64], v: &[f64], lattice: &Lattice) {
        lattice.pull_of_dashpots(force, v);
    }
}

/// Lanes of a sum: its order is the same on every machine.
const LANES: usize = 8;

kernel! {
    /// Moves all freedoms by one step: `v += dt f / m`, `u += dt v`. Forces are those of springs and of dashpots, and
    /// friction, foundation, drive and load. Returns their work in terms of the last velocities `v'` and the change of
    /// velocity `d = v' - v`: the sums of springs times `d`, of dashpots times `v'`, and of `d d`.
    fn lattice_move(u: &mut [f64], v: &mut [f64], forces: [&[f64]; 3], dt: f64, dt_over_m: f64) -> [f64; 3] {
        let mut sums = [[0.0; LANES]; 3];
        let ((u, u_rest), (v, v_rest)) = (u.as_chunks_mut::<LANES>(), v.as_chunks_mut::<LANES>());
        let [springs, dashpots, outer] = forces.map(|of| of.as_chunks::<LANES>());
        let groups = u.len();
        let v = &mut v[..groups];
        let (s, d, o) = (&springs.0[..groups], &dashpots.0[..groups], &outer.0[..groups]);
        macro_rules! move_lane {
            ($lane:expr, $u:expr, $v:expr, $springs:expr, $dashpots:expr, $outer:expr) => {
                let force = ($springs + $dashpots) + $outer;
                let new_v = $v + force * dt_over_m;
                let change = new_v - $v;
                $v = new_v;
                $u += new_v * dt;
                sums[0][$lane] += $springs * change;
                sums[1][$lane] += $dashpots * new_v;
                sums[2][$lane] += change * change;
            };
        }
        for n in 0..groups {
            for lane in 0..LANES {
                move_lane!(lane, u[n][lane], v[n][lane], s[n][lane], d[n][lane], o[n][lane]);
            }
        }
        for lane in 0..u_rest.len() {
            move_lane!(lane, u_rest[lane], v_rest[lane], springs.1[lane], dashpots.1[lane], outer.1[lane]);
        }
        sums.map(|lanes| lanes.into_iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::body::lattice::{BLOCK, SHEET, SLAB};
    use asperity_model::{Lattice, mixed};

    use super::{lattice_dashpots, lattice_move, lattice_springs};
    use crate::kernels::by_all;

    #[test]
    fn all_instruction_sets_move_a_lattice_the_same_to_the_bit() {
        for lattice in [
            Lattice::of(&SLAB, [2, 1, 2]),
            Lattice::of(&SLAB, [3, 1, 5]),
            Lattice::of(&SLAB, [9, 1, 2]),
            Lattice::of(&SLAB, [18, 1, 7]),
            Lattice::of(&SLAB, [57, 1, 4]),
            Lattice::of(&SHEET, [26, 6, 1]),
            Lattice::of(&BLOCK, [3, 2, 2]),
            Lattice::of(&BLOCK, [15, 4, 3]),
            Lattice::of(&BLOCK, [66, 3, 4]),
        ] {
            let lattice =
                Lattice { stiffness_n_per_m: 3.7, damping_kg_per_s: 0.9, foundation_n_per_m: 1.0, ..lattice };
            let freedoms = lattice.freedoms();
            let numbers = |seed: u64| -> Vec<f64> {
                (0..freedoms).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
            };
            by_all(|| {
                let (mut u, mut v) = (numbers(1), numbers(2));
                let (mut springs, mut dashpots) = (numbers(3), numbers(4));
                let mut bits = Vec::new();
                for step in 0..20 {
                    lattice_springs(&mut springs, &u, &lattice);
                    lattice_dashpots(&mut dashpots, &v, &lattice);
                    let outer = numbers(5 + step);
                    let work = lattice_move(&mut u, &mut v, [&springs, &dashpots, &outer], 0.01, 0.013);
                    bits.extend(work.map(f64::to_bits));
                }
                bits.extend(u.iter().chain(&v).map(|x| x.to_bits()));
                bits
            });
        }
    }
}
