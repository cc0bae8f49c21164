//! Bodies: springs and dashpots between *nodes*.
//!
//! Nodes move, *contacts* rub. Contacts are numbered along the sliding direction, row by row. In a chain and
//! in a sheet every node is a contact; in a slab and in a body only the nodes at the bottom are. All but the
//! chain are a lattice of several rows, and the chain one of a single row. A *freedom* is one direction in which one
//! node moves: a chain has one per node, a slab and a sheet two, a body three. Code that works with any of them uses
//! [`Lattice`].
//!
//! This module has everything that follows from the bonds between nodes: the pull on a node, the
//! diagonal of the stiffness, the bounds for stability and for the certificates of windows, and the
//! solution of the stuck slider. Friction springs and drive are added by callers.
//!
//! Rounding is part of the results, so each order of summation has a function of its own, whose
//! documentation gives the expression. Multiplication by 2 or 4 is exact.

use asperity_record::Contacts;

use crate::body::lattice::{self, Lattice, Number};

/// A chain with free ends: neighbours are joined by a spring `k` (5.5) and a dashpot `eta`
/// (5.7).
///
/// Functions that solvers call in every step are always inlined, so that they are compiled for the
/// instruction set of their caller. Arrays have one number per node.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Chain {
    /// Number of nodes; a single one has no bond.
    pub nodes: usize,
    /// `k`.
    pub stiffness_n_per_m: f64,
    /// `eta`.
    pub damping_kg_per_s: f64,
}

/// Number of gaps between the nodes of a line, over which its length is divided. A single node is
/// one spacing long.
pub fn gaps(nodes: usize) -> usize {
    nodes.max(2) - 1
}

impl Lattice {
    /// Whether some nodes are not contacts.
    pub fn has_inside(&self) -> bool {
        self.nodes() > self.contacts()
    }

    /// Whether it lies on a foundation. Then normal loads and the initial shear follow from the
    /// deformation of the body; otherwise normal loads are given.
    pub fn has_foundation(&self) -> bool {
        self.table.upward().is_some()
    }

    /// Whether the theory of the thesis applies (lengths of precursors, decay lengths, speeds of
    /// fronts): only to a chain of several nodes, which move along the sliding direction only.
    pub fn has_theory(&self) -> bool {
        self.axes() == 1 && self.nodes() > 1
    }

    /// The speed of long longitudinal waves along the sliding direction relative to that of shear waves;
    /// `None` where there are no shear waves.
    pub fn longitudinal_over_shear(&self) -> Option<f64> {
        let (longitudinal, shear) = self.table.long_waves();
        shear.map(|shear| (longitudinal / shear).sqrt())
    }

    /// The stiffness `s` of the slowest long waves along the sliding direction, `c = a sqrt(s / m)`: of a
    /// chain `k`, of others that of shear waves.
    pub fn slowest_wave_n_per_m(&self) -> f64 {
        let (longitudinal, shear) = self.table.long_waves();
        shear.unwrap_or(longitudinal) * self.stiffness_n_per_m
    }

    /// The chain, if it is one.
    #[inline]
    pub fn as_chain(&self) -> Option<Chain> {
        let &Lattice { columns: nodes, stiffness_n_per_m, damping_kg_per_s, .. } = self;
        (self.axes() == 1).then_some(Chain { nodes, stiffness_n_per_m, damping_kg_per_s })
    }

    /// The arrangement of its contacts: one row in a chain and in a slab, several over an area.
    pub fn layout(&self) -> Contacts {
        Contacts::in_rows(self.contacts() as u32, self.lanes as u32).expect("rows of equal length")
    }

    /// The pull of springs and dashpots on a freedom, counted from 0: [`Lattice::spring_force_n`] plus
    /// [`Lattice::damping_force_n`].
    pub fn pull_n<T: Number>(&self, displacement_m: &[T], velocity_m_per_s: &[T], n: usize) -> T {
        self.spring_force_n(displacement_m, n) + self.damping_force_n(velocity_m_per_s, n)
    }

    /// The pull of springs on each contact along the surface, axis by axis, so along the sliding direction
    /// first.
    pub fn tangential_force_n(&self, displacement_m: &[f64]) -> Vec<f64> {
        let mut force_n = vec![0.0; self.freedoms()];
        self.pull_of_springs(&mut force_n, displacement_m);
        let axes = force_n.chunks_exact(self.nodes()).take(self.tangential_axes());
        axes.flat_map(|of_nodes| &of_nodes[..self.contacts()]).copied().collect()
    }

    /// The time step beyond which the scheme is unstable, for nodes of this mass, the stiffness
    /// of a friction spring and of the stiffest driving spring, and a damping of sliding contacts.
    ///
    /// One mode with `x'' = -w^2 x - g x'` advances by Euler-Cromer as
    /// `v' = v - dt (w^2 x + g v)`, `x' = x + dt v'`. Its characteristic polynomial
    /// `z^2 - (2 - g dt - w^2 dt^2) z + (1 - g dt)` has both roots inside the unit
    /// circle if and only if `w^2 dt^2 + 2 g dt < 4`. The stiffest mode is bounded by
    /// `w^2 = (4 k + k_t + K) / m` and `g = (4 eta + E) / m`.
    ///
    /// In a lattice, damping couples the modes. But for any positive stiffness `M` and damping `C` the
    /// invariant `I(u, v) = v (m - dt C / 2) v + u M u - dt v M u` never grows, and it bounds the state
    /// if `m - dt C / 2 - dt^2 M / 4` is positive. That is the same condition, with `w^2` from
    /// [`Lattice::stiffest_n_per_m`] and `g` from the bound on the dashpots. Contacts that lift off the
    /// foundation only reduce the stiffness. A single block on no spring moves stably at any step; that of a
    /// spring `k` is returned.
    pub fn longest_stable_step_s(
        &self,
        node_mass_kg: f64,
        interfacial_n_per_m: f64,
        drive_n_per_m: f64,
        contact_damping_kg_per_s: f64,
    ) -> f64 {
        let stiffest_n_per_m = self.stiffest_n_per_m(interfacial_n_per_m, drive_n_per_m);
        let is_free = stiffest_n_per_m == 0.0;
        let stiffest = if is_free { self.stiffness_n_per_m } else { stiffest_n_per_m } / node_mass_kg;
        let damping = (self.damping_spectral_bound_kg_per_s() + contact_damping_kg_per_s) / node_mass_kg;
        // The positive root, in a form without cancellation or overflow.
        4.0 / (damping + libm::hypot(damping, 2.0 * stiffest.sqrt()))
    }
}

impl Chain {
    /// A lattice of a single row, whose nodes move along it only.
    pub const fn as_lattice(&self) -> Lattice {
        Lattice {
            stiffness_n_per_m: self.stiffness_n_per_m,
            damping_kg_per_s: self.damping_kg_per_s,
            ..Lattice::of(&lattice::CHAIN, [self.nodes, 1, 1])
        }
    }

    /// Bound on the eigenvalues of the negative second difference. A mode of eigenvalue `l`, between 0
    /// and this, has stiffness `k l` and damping `eta l`.
    pub const LARGEST_EIGENVALUE: f64 = lattice::CHAIN.largest_eigenvalue;

    /// Number of neighbours of node `n`, counted from 0.
    #[inline]
    pub fn neighbours(&self, n: usize) -> f64 {
        f64::from(u8::from(n > 0) + u8::from(n + 1 < self.nodes))
    }

    /// The pull on all nodes,
    /// `k ((u_{n+1} - 2 u_n) + u_{n-1}) + eta ((v_{n+1} - 2 v_n) + v_{n-1})`, at the ends
    /// `k (u_1 - u_0) + eta (v_1 - v_0)` and its mirror image: (5.6), (5.7). None on a single node.
    #[inline(always)]
    pub fn pull(&self, tau: &mut [f64], u: &[f64], v: &[f64]) {
        if let [tau] = tau {
            *tau = 0.0;
            return;
        }
        let &Chain { stiffness_n_per_m: k, damping_kg_per_s: eta, .. } = self;
        let last = tau.len() - 1;
        let inner = last.saturating_sub(1);
        let [u_left, u_here, u_right] = [0, 1, 2].map(|from| &u[from..][..inner]);
        let [v_left, v_here, v_right] = [0, 1, 2].map(|from| &v[from..][..inner]);
        let tau_here = &mut tau[1..][..inner];
        for n in 0..inner {
            tau_here[n] = k * (u_right[n] - 2.0 * u_here[n] + u_left[n])
                + eta * (v_right[n] - 2.0 * v_here[n] + v_left[n]);
        }
        tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
        tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
    }

    /// [`Chain::pull`] in another order, `k ((u_{n+1} - u_n) - (u_n - u_{n-1})) + eta (...)`, whose rounding does not grow
    /// with the displacement.
    #[inline(always)]
    pub fn pull_by_differences(&self, tau: &mut [f64], u: &[f64], v: &[f64]) {
        let &Chain { stiffness_n_per_m: k, damping_kg_per_s: eta, .. } = self;
        let last = tau.len() - 1;
        let difference = |x: &[f64], n: usize| {
            let right = if n < last { x[n + 1] - x[n] } else { 0.0 };
            right - if n > 0 { x[n] - x[n - 1] } else { 0.0 }
        };
        for (n, tau) in tau.iter_mut().enumerate() {
            *tau = k * difference(u, n) + eta * difference(v, n);
        }
    }

    /// `k u + eta v` of a node, the argument of [`Chain::pull_of_strains`].
    #[inline(always)]
    pub fn strain(&self, u: f64, v: f64) -> f64 {
        self.stiffness_n_per_m * u + self.damping_kg_per_s * v
    }

    /// The strains of all nodes, from the second place on. Those of the first and the last node are
    /// repeated beyond the ends, which makes the ends free.
    #[inline(always)]
    pub fn strains(&self, strain: &mut [f64], u: &[f64], v: &[f64]) {
        let nodes = u.len();
        let (v, strain) = (&v[..nodes], &mut strain[..nodes + 2]);
        for n in 0..nodes {
            strain[n + 1] = self.strain(u[n], v[n]);
        }
        strain[0] = strain[1];
        strain[nodes + 1] = strain[nodes];
    }

    /// The pull on a node from its strain and those beside it, `(right + left) - 2 here`.
    #[inline(always)]
    pub fn pull_of_strains(left: f64, here: f64, right: f64) -> f64 {
        (right + left) - 2.0 * here
    }

    /// The energy of a spring, `k du^2 / 2`, from the difference of displacement between its ends.
    #[inline(always)]
    pub fn bond_energy(&self, du: f64) -> f64 {
        0.5 * self.stiffness_n_per_m * du * du
    }

    /// The power of a dashpot, `eta dv dv'`, with its force from one difference of velocity between its
    /// ends and its motion from another.
    #[inline(always)]
    pub fn bond_loss(&self, dv: f64, moving: f64) -> f64 {
        self.damping_kg_per_s * dv * moving
    }

    /// The stiffness of a chain whose contacts are all stuck by friction springs, with the drive's
    /// stiffness at every node, factored for [`Stiffness::solve`].
    pub fn stuck(&self, springs_n_per_m: &[f64], drive_n_per_m: &[f64]) -> Stiffness {
        let k = self.stiffness_n_per_m;
        let mut inverse: Vec<f64> = Vec::with_capacity(self.nodes);
        for (n, (spring, drive)) in springs_n_per_m.iter().zip(drive_n_per_m).enumerate() {
            let diagonal = spring + self.neighbours(n) * k + drive;
            let before = inverse.last().map_or(0.0, |inverse| k * inverse * k);
            inverse.push(1.0 / (diagonal - before));
        }
        Stiffness { factor: inverse.iter().map(|inverse| k * inverse).collect(), inverse, closure: None }
    }

    /// The displacements, with `u_1 = 0`, at which springs pull with these forces. The last force is
    /// ignored, since it follows from the others.
    pub fn displacements_m(&self, spring_force_n: &[f64]) -> Vec<f64> {
        let k = self.stiffness_n_per_m;
        let mut u = vec![0.0; self.nodes];
        if let [_, second, ..] = &mut u[..] {
            *second = spring_force_n[0] / k;
        }
        for n in 2..self.nodes {
            u[n] = 2.0 * u[n - 1] - u[n - 2] + spring_force_n[n - 1] / k;
        }
        u
    }
}

/// `(y_{n-1} - y_n) + (y_{n+1} - y_n)` with free ends, n from 0.
pub fn second_difference<T: Number>(y: &[T], n: usize) -> T {
    let left = if n > 0 { y[n - 1] - y[n] } else { T::default() };
    let right = if n + 1 < y.len() { y[n + 1] - y[n] } else { T::default() };
    left + right
}

/// All of them, times a factor.
#[inline(always)]
pub(crate) fn second_differences(to: &mut [f64], y: &[f64], factor: f64) {
    for (to, y) in to[1..].iter_mut().zip(y.windows(3)) {
        *to = ((y[0] - y[1]) + (y[2] - y[1])) * factor;
    }
    for n in [0, y.len() - 1] {
        to[n] = second_difference(y, n) * factor;
    }
}

/// The stiffness `M` of the stuck slider, of springs between nodes, friction springs and drive,
/// factored. It is tridiagonal, but for a bond between the ends, and positive definite, so elimination without
/// pivoting is stable.
#[derive(Debug, Clone)]
pub struct Stiffness {
    /// `k` over each pivot.
    factor: Vec<f64>,
    /// 1 over each pivot.
    inverse: Vec<f64>,
    /// Of a chain whose ends are joined, what joins them.
    closure: Option<Closure>,
}

/// A spring `k` between the first and the last node: `M = T + k w w'`, with `T` tridiagonal and `w` 1 at the last and
/// -1 at the first node, so that `M^-1 = T^-1 - z z' k / (1 + k w' z)`, `z = T^-1 w` (Sherman and Morrison 1950). Both
/// parts are positive, so nothing cancels in the denominator.
#[derive(Debug, Clone)]
struct Closure {
    z: Vec<f64>,
    /// `k / (1 + k w' z)`.
    factor: f64,
}

impl Stiffness {
    /// The stiffness with another spring, between the first and the last of two or more nodes.
    pub(crate) fn closed_by(self, stiffness_n_per_m: f64, nodes: usize) -> Stiffness {
        let mut z = vec![0.0; nodes];
        (z[0], z[nodes - 1]) = (-1.0, 1.0);
        self.solve(&mut z);
        let factor = stiffness_n_per_m / (1.0 + stiffness_n_per_m * (z[nodes - 1] - z[0]));
        Stiffness { closure: Some(Closure { z, factor }), ..self }
    }

    /// Replaces `pull` by the solution `x` of `M x = pull`.
    pub fn solve(&self, pull: &mut [f64]) {
        let last = pull.len() - 1;
        for n in 1..=last {
            pull[n] += self.factor[n - 1] * pull[n - 1];
        }
        pull[last] *= self.inverse[last];
        for n in (0..last).rev() {
            pull[n] = self.inverse[n] * pull[n] + self.factor[n] * pull[n + 1];
        }
        if let Some(Closure { z, factor }) = &self.closure {
            let by = factor * (pull[last] - pull[0]);
            for (x, z) in pull.iter_mut().zip(z) {
                *x -= by * z;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Chain;
    use crate::Lattice;

    const CHAIN: Chain = Chain { nodes: 7, stiffness_n_per_m: 3.0, damping_kg_per_s: 0.5 };
    const ELASTIC: Lattice = CHAIN.as_lattice();

    /// Pseudo-random numbers.
    fn numbers(seed: u64) -> Vec<f64> {
        let mut seed = seed;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        (0..CHAIN.nodes).map(|_| next()).collect()
    }

    #[test]
    fn all_ways_to_pull_agree_but_for_rounding() {
        let (u, v) = (numbers(1), numbers(2));
        let elastic = ELASTIC;
        let (mut all, mut strain) = ([0.0; 7], [0.0; 9]);
        CHAIN.pull(&mut all, &u, &v);
        CHAIN.strains(&mut strain, &u, &v);
        for n in 0..CHAIN.nodes {
            let one = elastic.pull_n(&u, &v, n);
            let by_strains = Chain::pull_of_strains(strain[n], strain[n + 1], strain[n + 2]);
            assert!((one - all[n]).abs() < 1e-14 && (one - by_strains).abs() < 1e-14, "node {n}");
            // The forces between nodes sum to zero.
            assert!(all.iter().sum::<f64>().abs() < 1e-14);
        }
    }

    /// By applying the stiffness to unit vectors.
    #[test]
    fn diagonal_and_bounds_are_those_of_the_stiffness() {
        let elastic = ELASTIC;
        let row = |n: usize| -> Vec<f64> {
            (0..CHAIN.nodes)
                .map(|column| {
                    let mut unit = [0.0; 7];
                    unit[column] = 1.0;
                    -elastic.spring_force_n(&unit, n)
                })
                .collect()
        };
        for n in 0..CHAIN.nodes {
            let row = row(n);
            assert_eq!(row[n], elastic.diagonal_n_per_m(n));
            assert!(row[n] <= elastic.largest_diagonal_n_per_m());
            assert!(row.iter().map(|entry| entry.abs()).sum::<f64>() <= elastic.row_bound_n_per_m());
            // With as much damping as half a step has stiffness, both parts are equally long.
            let length = row.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
            let step_s = 2.0 * CHAIN.damping_kg_per_s / CHAIN.stiffness_n_per_m;
            let both = 2.0 * length * CHAIN.damping_kg_per_s / CHAIN.stiffness_n_per_m;
            assert!(both <= elastic.row_length_kg_per_s(step_s) * (1.0 + 1e-15), "node {n}");
        }
        // The steepest mode of this chain, `(-1)^n sin(...)`, comes close to the bound.
        let steepest: Vec<f64> = (0..CHAIN.nodes)
            .map(|n| libm::cos(std::f64::consts::PI * 6.0 * (n as f64 + 0.5) / 7.0))
            .collect();
        let square: f64 = steepest.iter().map(|x| x * x).sum();
        let energy: f64 = (0..CHAIN.nodes).map(|n| -steepest[n] * elastic.spring_force_n(&steepest, n)).sum();
        let bound = elastic.spectral_bound_n_per_m() * square;
        assert!(energy < bound && energy > 0.9 * bound, "{energy} of {bound}");
    }

    #[test]
    fn the_stuck_slider_is_solved() {
        let elastic = ELASTIC;
        let (kt, mut drive) = (2.0, [0.0; 7]);
        drive[0] = 5.0;
        let pull = numbers(3);
        let mut x = pull.clone();
        CHAIN.stuck(&vec![kt; drive.len()], &drive).solve(&mut x);
        for n in 0..CHAIN.nodes {
            let back = (kt + drive[n]) * x[n] - elastic.spring_force_n(&x, n);
            assert!((back - pull[n]).abs() < 1e-14, "node {n}");
        }
    }

    #[test]
    fn a_bond_between_the_ends_is_part_of_what_is_solved() {
        let (kt, drive, k) = (2.0, [0.0; 7], CHAIN.stiffness_n_per_m);
        let pull = numbers(7);
        let mut x = pull.clone();
        CHAIN.stuck(&[kt; 7], &drive).closed_by(k, CHAIN.nodes).solve(&mut x);
        for n in 0..CHAIN.nodes {
            let around = |by: usize| x[(n + by) % CHAIN.nodes];
            let back = (kt + 2.0 * k) * x[n] - k * (around(1) + around(CHAIN.nodes - 1));
            assert!((back - pull[n]).abs() < 1e-14, "node {n}");
        }
    }

    #[test]
    fn displacements_are_those_that_springs_pull_at() {
        let elastic = ELASTIC;
        let force = numbers(4);
        let u = CHAIN.displacements_m(&force);
        assert_eq!(u[0], 0.0);
        for (n, force) in force.iter().enumerate().take(CHAIN.nodes - 1) {
            assert!((elastic.spring_force_n(&u, n) - force).abs() < 1e-12, "node {n}");
        }
    }
}
