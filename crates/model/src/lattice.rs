//! A square lattice of nodes in a plane: the body of a slab, whose bottom row rubs.
//!
//! Nodes are numbered from 0, row by row from the bottom, along the sliding direction in each
//! row; so the first of them are the contacts. A node has two *freedoms*, its displacements along
//! `x` and along `z`. Arrays over all freedoms have the `x` of all nodes first, then the `z` of all
//! nodes: a row of either is contiguous, and that is what loops over it need.
//!
//! Neighbours are joined by springs that pull along themselves: one of stiffness `k` to the left,
//! right, up and down, one of `k / 2` along each diagonal. That is an isotropic sheet in plane stress
//! with Young's modulus `E = 4 k / (3 B)` for a thickness `B`, and Poisson's ratio 1/3. Beside every
//! spring a dashpot adds `eta` times the whole difference of velocity. Bonds at the edges count like
//! those inside. A foundation bears each node of the bottom row, only upwards, with the stiffness
//! `k_f`.
//!
//! With `q_x`, `q_z` the phases of a plane wave from node to node, `c_x = cos q_x`, `c_z = cos q_z`,
//! and a unit vector `(a, b)`, the springs of the endless lattice hold `k / 2` times
//!
//! ```text
//! 2 a^2 (1 - c_x) + 2 b^2 (1 - c_z) + 1 - c_x c_z + 2 a b sin q_x sin q_z
//!     <= a^2 (4 - (1 + c_x)^2) + b^2 (4 - (1 + c_z)^2) + 1 - c_x c_z <= 4 + 2
//! ```
//!
//! since `2 a b s t <= a^2 s^2 + b^2 t^2`; at `q_x = pi`, `q_z = 0` it is 6. The dashpots do
//! `eta (8 - 2 c_x - 2 c_z - 4 c_x c_z)`, which is linear in each cosine, so largest where they are
//! -1 and 1: 12. A lattice with edges is one of which bonds are missing, each of which holds no less
//! than nothing; so no eigenvalue of its stiffness is above `6 k`, and none of its damping above
//! `12 eta`.

/// A lattice of nodes, its dashpots, and the foundation below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Nodes in a row, at least 2: the contacts.
    pub columns: usize,
    /// Rows, at least 2.
    pub rows: usize,
    /// `k` of the springs to the left, right, up and down; those along diagonals have half of it.
    pub stiffness_n_per_m: f64,
    /// `eta` of every dashpot.
    pub damping_kg_per_s: f64,
    /// `k_f` of the foundation below each node of the bottom row.
    pub foundation_n_per_m: f64,
}

/// A quantity at a node and at the eight around it.
struct Around {
    here: f64,
    left: f64,
    right: f64,
    up: f64,
    down: f64,
    /// Up on the right and down on the left.
    rising: [f64; 2],
    /// Up on the left and down on the right.
    falling: [f64; 2],
}

/// The three rows around a node: below it, its own, above it. At the bottom and at the top its own
/// row fills the place of the one that is missing.
type Rows<'a> = [&'a [f64]; 3];

/// A row: what stands to the left, at, and to the right of the nodes inside.
struct Row<'a> {
    left: &'a [f64],
    here: &'a [f64],
    right: &'a [f64],
}

impl<'a> Row<'a> {
    #[inline(always)]
    fn of(row: &'a [f64], inner: usize) -> Row<'a> {
        Row { left: &row[..inner], here: &row[1..][..inner], right: &row[2..][..inner] }
    }

    /// A group of it.
    #[inline(always)]
    fn group(&self, at: usize) -> Row<'a> {
        let of = |row: &'a [f64]| &row[at..][..GROUP];
        Row { left: of(self.left), here: of(self.here), right: of(self.right) }
    }
}

/// Nodes of a row that are computed at once. The last group of a row begins so that it ends with the row,
/// and computes again what the one before it did: in fewer nodes than a group, that takes longer.
const GROUP: usize = 8;

impl Around {
    /// Around a node inside its row.
    #[inline(always)]
    fn inside<const BELOW: bool, const ABOVE: bool>(
        below: &Row<'_>,
        here: &Row<'_>,
        above: &Row<'_>,
        n: usize,
    ) -> Around {
        let own = here.here[n];
        let up = |row: &[f64]| if ABOVE { row[n] } else { own };
        let down = |row: &[f64]| if BELOW { row[n] } else { own };
        Around {
            here: own,
            left: here.left[n],
            right: here.right[n],
            up: up(above.here),
            down: down(below.here),
            rising: [up(above.right), down(below.left)],
            falling: [up(above.left), down(below.right)],
        }
    }

    /// Around the first or the last node of its row.
    #[inline(always)]
    fn at_edge<const BELOW: bool, const ABOVE: bool>([below, here, above]: Rows<'_>, n: usize) -> Around {
        let own = here[n];
        let (left, right) = (n.checked_sub(1), Some(n + 1).filter(|n| *n < here.len()));
        let of =
            |row: &[f64], n: Option<usize>, is_there: bool| n.filter(|_| is_there).map_or(own, |n| row[n]);
        Around {
            here: own,
            left: of(here, left, true),
            right: of(here, right, true),
            up: of(above, Some(n), ABOVE),
            down: of(below, Some(n), BELOW),
            rising: [of(above, right, ABOVE), of(below, left, BELOW)],
            falling: [of(above, left, ABOVE), of(below, right, BELOW)],
        }
    }
}

impl Lattice {
    /// No eigenvalue of the springs' stiffness is larger than this times `k`.
    pub const LARGEST_EIGENVALUE: f64 = 6.0;

    /// No eigenvalue of the dashpots' damping is larger than this times `eta`.
    pub const LARGEST_DAMPING_EIGENVALUE: f64 = 12.0;

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.columns * self.rows
    }

    /// Number of contacts: the nodes of the bottom row.
    pub fn contacts(&self) -> usize {
        self.columns
    }

    /// Number of freedoms of a node, the last of them along the normal.
    pub fn axes(&self) -> usize {
        2
    }

    /// Number of freedoms: two for each node.
    pub fn freedoms(&self) -> usize {
        2 * self.nodes()
    }

    /// The nodes of a row, counted from 0 at the bottom.
    pub fn row(&self, row: usize) -> std::ops::Range<usize> {
        row * self.columns..(row + 1) * self.columns
    }

    /// The nodes of the top row.
    pub fn top_row(&self) -> std::ops::Range<usize> {
        self.row(self.rows - 1)
    }

    /// What the foundation bears a node of the bottom row with, `p = -k_f u_z`, or 0 where the node
    /// has lifted off: the normal load of its contact.
    #[inline(always)]
    pub fn normal_load_n(&self, rise_m: f64) -> f64 {
        if rise_m < 0.0 { self.foundation_n_per_m * -rise_m } else { 0.0 }
    }

    /// What springs, and what dashpots, between nodes pull with on all freedoms, without the
    /// foundation.
    ///
    /// Always inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    pub fn pull(&self, springs_n: &mut [f64], dashpots_n: &mut [f64], u: &[f64], v: &[f64]) {
        let nodes = self.nodes();
        let (springs, dashpots) = (springs_n.split_at_mut(nodes), dashpots_n.split_at_mut(nodes));
        let (u, v) = (u.split_at(nodes), v.split_at(nodes));
        for row in 0..self.rows {
            let here = self.row(row);
            let below = if row > 0 { self.row(row - 1) } else { here.clone() };
            let above = if row + 1 < self.rows { self.row(row + 1) } else { here.clone() };
            let stretch = [u.0, u.1].map(|of| [&of[below.clone()], &of[here.clone()], &of[above.clone()]]);
            let (x_n, z_n) = (&mut springs.0[here.clone()], &mut springs.1[here.clone()]);
            match (row > 0, row + 1 < self.rows) {
                (true, true) => self.springs_on_row::<true, true>(x_n, z_n, stretch),
                (true, false) => self.springs_on_row::<true, false>(x_n, z_n, stretch),
                (false, _) => self.springs_on_row::<false, true>(x_n, z_n, stretch),
            }
            for (force_n, v) in [(&mut *dashpots.0, v.0), (&mut *dashpots.1, v.1)] {
                let force_n = &mut force_n[here.clone()];
                let v = [&v[below.clone()], &v[here.clone()], &v[above.clone()]];
                match (row > 0, row + 1 < self.rows) {
                    (true, true) => self.dashpots_on_row::<true, true>(force_n, v),
                    (true, false) => self.dashpots_on_row::<true, false>(force_n, v),
                    (false, _) => self.dashpots_on_row::<false, true>(force_n, v),
                }
            }
        }
    }

    /// The springs of one row, from the rows of `u_x` and `u_z` around it. A neighbour that is missing
    /// has no bond: it stands where the node itself does, and so pulls with nothing.
    #[inline(always)]
    fn springs_on_row<const BELOW: bool, const ABOVE: bool>(
        &self,
        x_n: &mut [f64],
        z_n: &mut [f64],
        u: [Rows<'_>; 2],
    ) {
        let last = x_n.len() - 1;
        for n in [0, last] {
            let [u_x, u_z] = u.map(|rows| Around::at_edge::<BELOW, ABOVE>(rows, n));
            (x_n[n], z_n[n]) = self.spring_force_n(&u_x, &u_z);
        }
        let inner = last - 1;
        let [x, z] = u;
        self.springs_inside::<BELOW, ABOVE>(&mut x_n[1..][..inner], &mut z_n[1..][..inner], x, z);
    }

    /// The same inside the row. A function of its own, from whose arguments the compiler knows that
    /// what it writes and what it reads do not overlap, which it must know to vectorise this.
    #[inline(always)]
    fn springs_inside<const BELOW: bool, const ABOVE: bool>(
        &self,
        x_n: &mut [f64],
        z_n: &mut [f64],
        x: Rows<'_>,
        z: Rows<'_>,
    ) {
        let inner = x_n.len();
        let z_n = &mut z_n[..inner];
        let (x0, x1, x2) = (Row::of(x[0], inner), Row::of(x[1], inner), Row::of(x[2], inner));
        let (z0, z1, z2) = (Row::of(z[0], inner), Row::of(z[1], inner), Row::of(z[2], inner));
        if inner < GROUP {
            for n in 0..inner {
                let u_x = Around::inside::<BELOW, ABOVE>(&x0, &x1, &x2, n);
                let u_z = Around::inside::<BELOW, ABOVE>(&z0, &z1, &z2, n);
                (x_n[n], z_n[n]) = self.spring_force_n(&u_x, &u_z);
            }
            return;
        }
        for from in (0..inner).step_by(GROUP) {
            let at = from.min(inner - GROUP);
            let (x0, x1, x2) = (x0.group(at), x1.group(at), x2.group(at));
            let (z0, z1, z2) = (z0.group(at), z1.group(at), z2.group(at));
            let (mut x, mut z) = ([0.0; GROUP], [0.0; GROUP]);
            for n in 0..GROUP {
                let u_x = Around::inside::<BELOW, ABOVE>(&x0, &x1, &x2, n);
                let u_z = Around::inside::<BELOW, ABOVE>(&z0, &z1, &z2, n);
                (x[n], z[n]) = self.spring_force_n(&u_x, &u_z);
            }
            x_n[at..][..GROUP].copy_from_slice(&x);
            z_n[at..][..GROUP].copy_from_slice(&z);
        }
    }

    /// The dashpots of one row along `x` or `z`, likewise.
    #[inline(always)]
    fn dashpots_on_row<const BELOW: bool, const ABOVE: bool>(&self, force_n: &mut [f64], v: Rows<'_>) {
        let last = force_n.len() - 1;
        for n in [0, last] {
            force_n[n] = self.dashpot_force_n(&Around::at_edge::<BELOW, ABOVE>(v, n));
        }
        self.dashpots_inside::<BELOW, ABOVE>(&mut force_n[1..last], v);
    }

    /// The same inside the row, a function of its own likewise.
    #[inline(always)]
    fn dashpots_inside<const BELOW: bool, const ABOVE: bool>(&self, force_n: &mut [f64], v: Rows<'_>) {
        let inner = force_n.len();
        let (v0, v1, v2) = (Row::of(v[0], inner), Row::of(v[1], inner), Row::of(v[2], inner));
        if inner < GROUP {
            for (n, force_n) in force_n.iter_mut().enumerate() {
                *force_n = self.dashpot_force_n(&Around::inside::<BELOW, ABOVE>(&v0, &v1, &v2, n));
            }
            return;
        }
        for from in (0..inner).step_by(GROUP) {
            let at = from.min(inner - GROUP);
            let (v0, v1, v2) = (v0.group(at), v1.group(at), v2.group(at));
            let mut group = [0.0; GROUP];
            for (n, force_n) in group.iter_mut().enumerate() {
                *force_n = self.dashpot_force_n(&Around::inside::<BELOW, ABOVE>(&v0, &v1, &v2, n));
            }
            force_n[at..][..GROUP].copy_from_slice(&group);
        }
    }

    /// What springs pull a node with along `x` and `z`. Sums are taken so that a mirrored lattice
    /// gives mirrored forces, to the bit.
    #[inline(always)]
    fn spring_force_n(&self, u_x: &Around, u_z: &Around) -> (f64, f64) {
        let k = self.stiffness_n_per_m;
        let straight_x = (u_x.left + u_x.right) - 2.0 * u_x.here;
        let straight_z = (u_z.down + u_z.up) - 2.0 * u_z.here;
        let rising =
            ((u_x.rising[0] + u_z.rising[0]) + (u_x.rising[1] + u_z.rising[1])) - 2.0 * (u_x.here + u_z.here);
        let falling = ((u_x.falling[0] - u_z.falling[0]) + (u_x.falling[1] - u_z.falling[1]))
            - 2.0 * (u_x.here - u_z.here);
        let quarter = 0.25 * k;
        (k * straight_x + quarter * (rising + falling), k * straight_z + quarter * (rising - falling))
    }

    /// What dashpots pull a node with along `x` or `z`, likewise.
    #[inline(always)]
    fn dashpot_force_n(&self, v: &Around) -> f64 {
        let straight = (v.left + v.right) + (v.up + v.down);
        let diagonal = (v.rising[0] + v.rising[1]) + (v.falling[0] + v.falling[1]);
        self.damping_kg_per_s * ((straight + diagonal) - 8.0 * v.here)
    }

    /// Goes over all bonds, each once, in the order of the node that it goes right or up from.
    pub fn over_bonds(&self, mut bond: impl FnMut(Bond)) {
        let k = self.stiffness_n_per_m;
        let diagonal = std::f64::consts::FRAC_1_SQRT_2;
        for row in 0..self.rows {
            for column in 0..self.columns {
                let from = row * self.columns + column;
                let (right, up) = (column + 1 < self.columns, row + 1 < self.rows);
                let mut add = |to: usize, along: [f64; 2], stiffness_n_per_m: f64| {
                    bond(Bond { from, to, along, stiffness_n_per_m });
                };
                if right {
                    add(from + 1, [1.0, 0.0], k);
                }
                if up {
                    add(from + self.columns, [0.0, 1.0], k);
                }
                if right && up {
                    add(from + self.columns + 1, [diagonal, diagonal], 0.5 * k);
                }
                if column > 0 && up {
                    add(from + self.columns - 1, [-diagonal, diagonal], 0.5 * k);
                }
            }
        }
    }

    /// The largest of the stiffness' diagonal: `3 k`, or at the bottom `3 k / 2 + k_f`.
    pub fn largest_diagonal_n_per_m(&self) -> f64 {
        (3.0 * self.stiffness_n_per_m).max(1.5 * self.stiffness_n_per_m + self.foundation_n_per_m)
    }

    /// No sum of magnitudes in a row of the stiffness is larger: `7 k`, or with the foundation, which
    /// bears nodes without bonds below them, `7 k / 2 + k_f`.
    pub fn row_bound_n_per_m(&self) -> f64 {
        (7.0 * self.stiffness_n_per_m).max(3.5 * self.stiffness_n_per_m + self.foundation_n_per_m)
    }

    /// The same of the damping: `16 eta`.
    pub fn damping_row_bound_kg_per_s(&self) -> f64 {
        16.0 * self.damping_kg_per_s
    }

    /// No eigenvalue of the springs' stiffness is larger, the foundation left out: `6 k`.
    pub fn spectral_bound_n_per_m(&self) -> f64 {
        Lattice::LARGEST_EIGENVALUE * self.stiffness_n_per_m
    }

    /// The same of the damping: `12 eta`.
    pub fn damping_spectral_bound_kg_per_s(&self) -> f64 {
        Lattice::LARGEST_DAMPING_EIGENVALUE * self.damping_kg_per_s
    }
}

/// A spring with its dashpot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// The nodes that it joins.
    pub from: usize,
    /// The other one.
    pub to: usize,
    /// Unit vector from the one to the other.
    pub along: [f64; 2],
    /// Stiffness of the spring.
    pub stiffness_n_per_m: f64,
}

#[cfg(test)]
mod tests {
    use super::{Bond, Lattice};
    use crate::mixed::mixed;

    const LATTICE: Lattice = Lattice {
        columns: 7,
        rows: 5,
        stiffness_n_per_m: 3.0,
        damping_kg_per_s: 0.7,
        foundation_n_per_m: 0.0,
    };

    /// Numbers without pattern, one for each freedom.
    fn numbers(seed: u64) -> Vec<f64> {
        let number = |n: usize| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5;
        (0..LATTICE.freedoms()).map(number).collect()
    }

    fn pull(u: &[f64], v: &[f64]) -> Vec<f64> {
        let (mut springs, mut dashpots) = (still(), still());
        LATTICE.pull(&mut springs, &mut dashpots, u, v);
        springs.iter().zip(&dashpots).map(|(spring, dashpot)| spring + dashpot).collect()
    }

    fn still() -> Vec<f64> {
        vec![0.0; LATTICE.freedoms()]
    }

    fn product(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    /// Displacements linear in the place, with these derivatives of `u_x` and `u_z` by `x` and `z`.
    fn linear(gradient: [[f64; 2]; 2]) -> Vec<f64> {
        let place = |n: usize| [(n % LATTICE.columns) as f64, (n / LATTICE.columns) as f64];
        let along =
            |of: [f64; 2]| (0..LATTICE.nodes()).map(move |n| of[0] * place(n)[0] + of[1] * place(n)[1]);
        along(gradient[0]).chain(along(gradient[1])).collect()
    }

    fn is_inside(n: usize) -> bool {
        let (column, row) = (n % LATTICE.columns, n / LATTICE.columns);
        (1..LATTICE.columns - 1).contains(&column) && (1..LATTICE.rows - 1).contains(&row)
    }

    /// As the page has it: `k e (e . (u_j - u_i))` and `eta (v_j - v_i)` for every bond; in rows shorter
    /// than a group, as long as some, and longer.
    #[test]
    fn the_pull_is_that_of_the_bonds() {
        for columns in [2, 7, 10, 11, 18, 27] {
            let lattice = Lattice { columns, ..LATTICE };
            let (nodes, freedoms) = (lattice.nodes(), lattice.freedoms());
            let numbers = |seed: u64| -> Vec<f64> {
                (0..freedoms).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
            };
            let (u, v, mut expected) = (numbers(1), numbers(2), vec![0.0; freedoms]);
            let mut bonds = 0;
            lattice.over_bonds(|Bond { from, to, along, stiffness_n_per_m }| {
                bonds += 1;
                let difference = |of: &[f64]| [of[to] - of[from], of[nodes + to] - of[nodes + from]];
                let (du, dv) = (difference(&u), difference(&v));
                let stretch = along[0] * du[0] + along[1] * du[1];
                for axis in 0..2 {
                    let force =
                        stiffness_n_per_m * along[axis] * stretch + lattice.damping_kg_per_s * dv[axis];
                    expected[axis * nodes + from] += force;
                    expected[axis * nodes + to] -= force;
                }
            });
            assert_eq!(bonds, (columns - 1) * 5 + columns * 4 + 2 * (columns - 1) * 4);
            let (mut springs, mut dashpots) = (vec![0.0; freedoms], vec![0.0; freedoms]);
            lattice.pull(&mut springs, &mut dashpots, &u, &v);
            for n in 0..freedoms {
                let found = springs[n] + dashpots[n];
                assert!((found - expected[n]).abs() < 1e-14 * 20.0, "{columns}, freedom {n}: {found}");
            }
        }
    }

    /// The work of the forces of one displacement on another is that of the other on the one (Betti).
    #[test]
    fn the_work_of_two_displacements_on_each_other_is_the_same() {
        for seed in 0..20 {
            let (a, b) = (numbers(seed), numbers(100 + seed));
            for forces in [|u: &[f64]| pull(u, &still()), |v: &[f64]| pull(&still(), v)] {
                let (ab, ba) = (product(&a, &forces(&b)), product(&b, &forces(&a)));
                assert!((ab - ba).abs() < 1e-13 * 20.0, "{ab} {ba}");
                assert!(product(&a, &forces(&a)) < 0.0, "springs and dashpots only resist");
            }
        }
    }

    /// The patch test: under uniform strain no node inside is pulled.
    #[test]
    fn uniform_strain_pulls_at_no_node_inside() {
        for gradient in [
            [[1e-3, 0.0], [0.0, 0.0]],
            [[0.0, 0.0], [0.0, 2e-3]],
            [[0.0, 3e-3], [0.0, 0.0]],
            [[1e-3, -2e-3], [4e-3, -5e-3]],
        ] {
            let force = pull(&linear(gradient), &still());
            let nodes = LATTICE.nodes();
            for n in (0..nodes).filter(|n| is_inside(*n)) {
                assert!(force[n].abs() < 1e-16 * 100.0 && force[nodes + n].abs() < 1e-16 * 100.0, "{n}");
            }
            assert!(force.iter().any(|force| force.abs() > 1e-4), "the edges are pulled");
        }
    }

    #[test]
    fn moved_and_turned_as_a_whole_it_does_not_pull() {
        let translation = |x: f64, z: f64| [vec![x; LATTICE.nodes()], vec![z; LATTICE.nodes()]].concat();
        for whole in [translation(0.25, 0.0), translation(0.0, -0.5), translation(2.0, 1.0)] {
            assert!(pull(&whole, &whole).iter().all(|force| *force == 0.0));
        }
        // Springs do not resist a small rotation; dashpots, which see the whole velocity, do.
        let turned = linear([[0.0, 1.0], [-1.0, 0.0]]);
        assert!(pull(&turned, &still()).iter().all(|force| force.abs() < 1e-14));
        assert!(pull(&still(), &turned).iter().any(|force| force.abs() > 1e-3));
    }

    /// Stretched along `x`, it is free of forces on its top and bottom where it narrows by a third.
    #[test]
    fn poissons_ratio_is_a_third() {
        let nodes = LATTICE.nodes();
        let force = pull(&linear([[3e-3, 0.0], [0.0, -1e-3]]), &still());
        for row in [0, LATTICE.rows - 1] {
            for n in LATTICE.row(row).skip(1).take(LATTICE.columns - 2) {
                assert!(force[nodes + n].abs() < 1e-16 * 100.0, "node {n}: {}", force[nodes + n]);
            }
        }
        // Through a cut between two columns: half a spring for each of its edges is too much.
        let right = |row: usize| row * LATTICE.columns + LATTICE.columns - 1;
        let pulled: f64 = (0..LATTICE.rows).map(|row| -force[right(row)]).sum();
        let gaps = (LATTICE.rows - 1) as f64;
        let modulus_and_width = 4.0 * LATTICE.stiffness_n_per_m / 3.0;
        let surplus = LATTICE.stiffness_n_per_m * 3e-3;
        assert!((pulled - surplus - modulus_and_width * 3e-3 * gaps).abs() < 1e-15, "{pulled}");
    }

    #[test]
    fn a_mirrored_lattice_gives_mirrored_forces_to_the_bit() {
        let nodes = LATTICE.nodes();
        let mirror = |of: &[f64]| -> Vec<f64> {
            let at =
                |n: usize| n / LATTICE.columns * LATTICE.columns + LATTICE.columns - 1 - n % LATTICE.columns;
            let x = (0..nodes).map(|n| -of[at(n)]);
            x.chain((0..nodes).map(|n| of[nodes + at(n)])).collect()
        };
        let (u, v) = (numbers(5), numbers(6));
        assert_eq!(pull(&mirror(&u), &mirror(&v)), mirror(&pull(&u, &v)));
    }

    /// By applying stiffness and damping to unit vectors, and to the waves at which they are largest.
    #[test]
    fn diagonal_and_bounds_are_those_of_the_lattice() {
        let elastic = crate::Elastic::Lattice(LATTICE);
        let (mut largest, mut row_sums) = (0.0_f64, vec![[0.0; 2]; LATTICE.freedoms()]);
        for column in 0..LATTICE.freedoms() {
            let mut unit = still();
            unit[column] = 1.0;
            let (springs, dashpots) = (pull(&unit, &still()), pull(&still(), &unit));
            largest = largest.max(-springs[column]);
            if column < LATTICE.columns {
                assert!((-springs[column] - elastic.diagonal_n_per_m(column)).abs() < 1e-15);
            }
            for (sums, (spring, dashpot)) in row_sums.iter_mut().zip(springs.iter().zip(&dashpots)) {
                sums[0] += spring.abs();
                sums[1] += dashpot.abs();
            }
        }
        assert!((largest - elastic.largest_diagonal_n_per_m()).abs() < 1e-14);
        for [spring, dashpot] in row_sums {
            assert!(spring <= elastic.row_bound_n_per_m() * (1.0 + 1e-15));
            assert!(dashpot <= elastic.damping_row_bound_kg_per_s() * (1.0 + 1e-15));
        }
        let large = Lattice { columns: 40, rows: 40, ..LATTICE };
        let elastic = crate::Elastic::Lattice(large);
        // Along `x` and `z`, one phase pi and the other 0.
        let wave: Vec<f64> = (0..large.nodes()).map(|n| if n % 40 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let wave = [wave, vec![0.0; large.nodes()]].concat();
        let (square, quiet) = (large.nodes() as f64, vec![0.0; large.freedoms()]);
        let (mut springs, mut dashpots) = (quiet.clone(), quiet);
        large.pull(&mut springs, &mut dashpots, &wave, &wave);
        let [springs, dashpots] = [springs, dashpots].map(|force| -product(&wave, &force) / square);
        let (most_n_per_m, most_kg_per_s) =
            (elastic.spectral_bound_n_per_m(), elastic.damping_spectral_bound_kg_per_s());
        assert!(springs < most_n_per_m && springs > 0.95 * most_n_per_m, "{springs}");
        assert!(dashpots < most_kg_per_s && dashpots > 0.95 * most_kg_per_s, "{dashpots}");
    }
}
