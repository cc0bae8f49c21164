//! The pull on the nodes of a plane: the bonds of slabs and sheets, written out so that loops over them
//! are fast.
//!
//! Results of slabs rest on the order of its sums, to the bit. Tests compare it
//! with the table of bonds.

/// A plane of nodes, row by row. Arrays have one axis of all nodes first, then the other.
#[derive(Debug, Clone, Copy)]
pub(super) struct Plane {
    /// Nodes in a row.
    pub(super) columns: usize,
    /// RowsAround, at least 2.
    pub(super) rows: usize,
    pub(super) stiffness_n_per_m: f64,
    pub(super) damping_kg_per_s: f64,
}

/// Displacements `u_x` and `u_z` and velocities `v_x` and `v_z`; the pulls of springs and of dashpots in the same order.
const QUANTITIES: usize = 4;

/// A quantity on the three rows around a node: below it, its own, above it. At the bottom and at the top its own
/// row fills the place of the one that is missing.
type RowsAround<'a> = [&'a [f64]; 3];

/// A quantity at a node and at the eight around it: from the row below upwards, each from left to right.
type Around = [[f64; 3]; 3];

/// Nodes of a row that are computed at once. The last group of a row ends with the row and overlaps the one
/// before, repeating some of its work: a shorter group would be slower.
const GROUP: usize = 8;

/// A quantity around a node. A missing neighbour has no bond: it gets the node's own value, so it does not pull.
#[inline(always)]
fn around<const BELOW: bool, const ABOVE: bool>(at: impl Fn(usize, usize) -> f64) -> Around {
    let own = at(1, 1);
    let below = |ahead: usize| if BELOW { at(0, ahead) } else { own };
    let above = |ahead: usize| if ABOVE { at(2, ahead) } else { own };
    [[below(0), below(1), below(2)], [at(1, 0), own, at(1, 2)], [above(0), above(1), above(2)]]
}

impl Plane {
    /// The nodes of a row, counted from 0.
    fn row(&self, row: usize) -> std::ops::Range<usize> {
        row * self.columns..(row + 1) * self.columns
    }

    /// The pull of springs, and of dashpots, between nodes on all freedoms.
    ///
    /// Always inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    pub(super) fn pull(&self, springs_n: &mut [f64], dashpots_n: &mut [f64], u: &[f64], v: &[f64]) {
        let nodes = self.columns * self.rows;
        let (springs, dashpots) = (springs_n.split_at_mut(nodes), dashpots_n.split_at_mut(nodes));
        let (u, v) = (u.split_at(nodes), v.split_at(nodes));
        for row in 0..self.rows {
            let here = self.row(row);
            let below = if row > 0 { self.row(row - 1) } else { here.clone() };
            let above = if row + 1 < self.rows { self.row(row + 1) } else { here.clone() };
            let rows =
                [u.0, u.1, v.0, v.1].map(|of| [&of[below.clone()], &of[here.clone()], &of[above.clone()]]);
            let forces_n = [
                &mut springs.0[here.clone()],
                &mut springs.1[here.clone()],
                &mut dashpots.0[here.clone()],
                &mut dashpots.1[here],
            ];
            match (row > 0, row + 1 < self.rows) {
                (true, true) => self.pull_on_row::<true, true>(forces_n, rows),
                (true, false) => self.pull_on_row::<true, false>(forces_n, rows),
                (false, _) => self.pull_on_row::<false, true>(forces_n, rows),
            }
        }
    }

    /// The pulls on one row, from the quantities on the rows around it.
    #[inline(always)]
    fn pull_on_row<const BELOW: bool, const ABOVE: bool>(
        &self,
        mut forces_n: [&mut [f64]; QUANTITIES],
        rows: [RowsAround<'_>; QUANTITIES],
    ) {
        let last = self.columns - 1;
        for n in [0, last] {
            let of = rows.map(|rows| {
                around::<BELOW, ABOVE>(|up, ahead| match n + ahead {
                    beyond if beyond == 0 || beyond > last + 1 => rows[1][n],
                    next => rows[up][next - 1],
                })
            });
            for (force_n, pull_n) in forces_n.iter_mut().zip(self.pull_n(&of)) {
                force_n[n] = pull_n;
            }
        }
        let inner = last - 1;
        let rows = rows.map(|rows| rows.map(|row| &row[..inner + 2]));
        if inner < GROUP {
            (0..inner).for_each(|at| self.pull_on_group::<BELOW, ABOVE, 1>(&mut forces_n, &rows, at));
        } else {
            for from in (0..inner).step_by(GROUP) {
                let at = from.min(inner - GROUP);
                self.pull_on_group::<BELOW, ABOVE, GROUP>(&mut forces_n, &rows, at);
            }
        }
    }

    /// The pulls on consecutive nodes inside a row, of which the first has `at` nodes inside it to its left.
    #[inline(always)]
    fn pull_on_group<const BELOW: bool, const ABOVE: bool, const N: usize>(
        &self,
        forces_n: &mut [&mut [f64]; QUANTITIES],
        rows: &[RowsAround<'_>; QUANTITIES],
        at: usize,
    ) {
        let mut lines = [[[&[][..]; 3]; 3]; QUANTITIES];
        for (lines, rows) in lines.iter_mut().zip(rows) {
            for (line, row) in lines.iter_mut().zip(rows) {
                for (ahead, line) in line.iter_mut().enumerate() {
                    *line = &row[at + ahead..][..N];
                }
            }
        }
        // First into numbers of their own, which overlap with nothing, as vectorising requires.
        let mut pulls_n = [[0.0; N]; QUANTITIES];
        for n in 0..N {
            let of = |quantity: usize| around::<BELOW, ABOVE>(|up, ahead| lines[quantity][up][ahead][n]);
            let pull_n = self.pull_n(&[of(0), of(1), of(2), of(3)]);
            for quantity in 0..QUANTITIES {
                pulls_n[quantity][n] = pull_n[quantity];
            }
        }
        for (force_n, pulls_n) in forces_n.iter_mut().zip(&pulls_n) {
            force_n[at + 1..][..N].copy_from_slice(pulls_n);
        }
    }

    /// The pull of springs on a node along `x` and `z`, and of dashpots. The order of summation makes the forces of a
    /// mirrored lattice mirror images, to the bit.
    #[inline(always)]
    fn pull_n(&self, [x, z, v_x, v_z]: &[Around; QUANTITIES]) -> [f64; QUANTITIES] {
        let k = self.stiffness_n_per_m;
        let straight_x = (x[1][0] + x[1][2]) - 2.0 * x[1][1];
        let straight_z = (z[0][1] + z[2][1]) - 2.0 * z[1][1];
        let rising = ((x[2][2] + z[2][2]) + (x[0][0] + z[0][0])) - 2.0 * (x[1][1] + z[1][1]);
        let falling = ((x[2][0] - z[2][0]) + (x[0][2] - z[0][2])) - 2.0 * (x[1][1] - z[1][1]);
        let quarter = 0.25 * k;
        [
            k * straight_x + quarter * (rising + falling),
            k * straight_z + quarter * (rising - falling),
            self.dashpot_force_n(v_x),
            self.dashpot_force_n(v_z),
        ]
    }

    /// The pull of dashpots on a node along one axis.
    #[inline(always)]
    fn dashpot_force_n(&self, v: &Around) -> f64 {
        let straight = (v[1][0] + v[1][2]) + (v[2][1] + v[0][1]);
        let diagonal = (v[2][2] + v[0][0]) + (v[2][0] + v[0][2]);
        self.damping_kg_per_s * ((straight + diagonal) - 8.0 * v[1][1])
    }
}
