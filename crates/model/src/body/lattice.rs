//! A lattice of nodes, given by a table of its bonds: the body of a slab, of a sheet, of a block.
//!
//! The table ([`Table`]) lists the bonds of a node, and the axes along which nodes move: `x`, the
//! sliding direction, `y` across it, `z` upwards. Nodes are counted from 0, along `x` first, then
//! across, then upwards, so the first of them are those of the bottom row, the contacts. A *freedom* is
//! one axis along which one node moves. Arrays over all freedoms have the `x` of all nodes first, then
//! the next axis of all nodes, so a line of nodes is contiguous for each axis, as loops over it require.
//!
//! Bonds at the edges have the stiffness of those inside. If nodes move upwards, a foundation supports
//! each node of the bottom row, with the stiffness `k_f`; it pushes upwards and never pulls.

mod cube;
mod plane;
mod table;
#[cfg(test)]
mod tests;

use std::ops::{Add, Mul, Range, Sub};

use crate::body::elastic::{second_difference, second_differences};
use cube::Cube;
use plane::Plane;
use table::Loops;
pub use table::{BLOCK, BondKind, CHAIN, Offset, RowOf, SHEET, SLAB, Table};

/// The types of displacements and velocities: doubles, pairs of them, complex numbers. The default is
/// zero.
pub trait Number: Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}

impl<T> Number for T where T: Copy + Default + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T> {}

/// A lattice of nodes, its dashpots, and the foundation below it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Bonds between nodes, and the axes along which they move.
    pub table: &'static Table,
    /// Nodes along the sliding direction, at least 2; 1 if there is no other node.
    pub columns: usize,
    /// Nodes across it, at least 1.
    pub lanes: usize,
    /// Nodes upwards, at least 1.
    pub rows: usize,
    /// `k`.
    pub stiffness_n_per_m: f64,
    /// `eta` of every dashpot.
    pub damping_kg_per_s: f64,
    /// `k_f` of the foundation below each node of the bottom row.
    pub foundation_n_per_m: f64,
}

impl Lattice {
    /// A lattice with this table, with springs of 1 N/m, no damping and no foundation.
    pub const fn of(table: &'static Table, [columns, lanes, rows]: [usize; 3]) -> Lattice {
        Lattice {
            table,
            columns,
            lanes,
            rows,
            stiffness_n_per_m: 1.0,
            damping_kg_per_s: 0.0,
            foundation_n_per_m: 0.0,
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.contacts() * self.rows
    }

    /// Number of freedoms of a node; for a body on a foundation the last of them is along the normal.
    pub fn axes(&self) -> usize {
        self.table.axes.len()
    }

    /// Number of freedoms of a node along the surface.
    pub fn tangential_axes(&self) -> usize {
        self.axes() - usize::from(self.table.upward().is_some())
    }

    /// Number of freedoms.
    pub fn freedoms(&self) -> usize {
        self.axes() * self.nodes()
    }

    /// Number of contacts.
    pub fn contacts(&self) -> usize {
        self.columns * self.lanes
    }

    /// The first nodes of the lines along the sliding direction in a row, counted from 0 at the bottom.
    pub fn first_column(&self, row: usize) -> impl Iterator<Item = usize> + use<> {
        self.row(row).step_by(self.columns)
    }

    /// The first freedom along the normal; `None` where nodes do not move along it.
    pub fn first_normal(&self) -> Option<usize> {
        self.table.upward().map(|upward| upward * self.nodes())
    }

    /// The nodes of a row, counted from 0 at the bottom.
    pub fn row(&self, row: usize) -> Range<usize> {
        row * self.contacts()..(row + 1) * self.contacts()
    }

    /// Index among all freedoms of a tangential freedom of a contact, counted contact by contact, axis by axis.
    #[inline]
    pub fn tangential_freedom(&self, of_contact: usize) -> usize {
        let contacts = self.contacts();
        of_contact / contacts * self.nodes() + of_contact % contacts
    }

    /// The nodes of the top row.
    pub fn top_row(&self) -> Range<usize> {
        self.row(self.rows - 1)
    }

    /// Position of a node: column, lane and row, counted from 0.
    pub fn place(&self, node: usize) -> [usize; 3] {
        let line = node / self.columns;
        [node % self.columns, line % self.lanes, line / self.lanes]
    }

    /// The node at an offset from a position; `None` beyond an edge.
    fn at(&self, place: [usize; 3], offset: Offset) -> Option<usize> {
        let along = |axis: usize, count: usize| {
            place[axis].checked_add_signed(offset[axis]).filter(|place| *place < count)
        };
        let (column, lane, row) = (along(0, self.columns)?, along(1, self.lanes)?, along(2, self.rows)?);
        Some((row * self.lanes + lane) * self.columns + column)
    }

    /// The bonds of a node: the node at the other end, its offset, and the kind of bond.
    fn bonds_of(&self, node: usize) -> impl Iterator<Item = (usize, Offset, &'static BondKind)> + use<> {
        let (lattice, place) = (*self, self.place(node));
        let around = lattice.table.around();
        around.filter_map(move |(offset, kind)| Some((lattice.at(place, offset)?, offset, kind)))
    }

    /// The force of the foundation on a node of the bottom row, `p = -k_f u_z`, or 0 where the node has
    /// lifted off: the normal load of its contact.
    #[inline(always)]
    pub fn normal_load_n(&self, rise_m: f64) -> f64 {
        if rise_m < 0.0 { self.foundation_n_per_m * -rise_m } else { 0.0 }
    }

    /// The pull of springs between nodes on all freedoms, without the foundation.
    ///
    /// Always inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    pub fn pull_of_springs(&self, force_n: &mut [f64], u: &[f64]) {
        match (self.table.loops, self.plane()) {
            (Loops::Line, _) => second_differences(force_n, u, self.stiffness_n_per_m),
            (Loops::Plane, Some(plane)) => plane.pull_of_springs(force_n, u),
            (Loops::Cube, _) => self.cube().pull_of_springs(&mut self.split(force_n), u),
            _ => force_n.iter_mut().enumerate().for_each(|(n, force_n)| *force_n = self.spring_force_n(u, n)),
        }
    }

    /// The pull of dashpots between nodes on all freedoms; likewise inlined.
    #[inline(always)]
    pub fn pull_of_dashpots(&self, force_n: &mut [f64], v: &[f64]) {
        match (self.table.loops, self.plane()) {
            (Loops::Line, _) => second_differences(force_n, v, self.damping_kg_per_s),
            (Loops::Plane, Some(plane)) => plane.pull_of_dashpots(force_n, v),
            (Loops::Cube, _) => self.cube().pull_of_dashpots(&mut self.split(force_n), v),
            _ => {
                force_n.iter_mut().enumerate().for_each(|(n, force_n)| *force_n = self.damping_force_n(v, n))
            }
        }
    }

    /// Splits an array over the freedoms of a body into its axes.
    #[inline(always)]
    fn split<'a>(&self, values: &'a mut [f64]) -> [&'a mut [f64]; 3] {
        let (x, rest) = values.split_at_mut(self.nodes());
        let (y, z) = rest.split_at_mut(self.nodes());
        [x, y, z]
    }

    /// The plane for the loops of `plane.rs`; `None` for a single line.
    #[inline(always)]
    fn plane(&self) -> Option<Plane> {
        let &Lattice { columns, stiffness_n_per_m, damping_kg_per_s, .. } = self;
        // Planes have several nodes along only one of the axes across and upwards.
        let rows = if self.table.upward().is_some() { self.rows } else { self.lanes };
        let is_plane = columns >= 2 && rows >= 2 && rows == self.rows * self.lanes;
        is_plane.then_some(Plane { columns, rows, stiffness_n_per_m, damping_kg_per_s })
    }

    fn cube(&self) -> Cube {
        Cube {
            counts: [self.columns, self.lanes, self.rows],
            stiffness_n_per_m: self.stiffness_n_per_m,
            damping_kg_per_s: self.damping_kg_per_s,
        }
    }

    /// Visits the lines of nodes, each by its first node, with the bonds that start along it in the order of
    /// the table.
    pub fn over_lines(&self, mut line: impl FnMut(usize, &[BondsOfLine])) {
        let one_way = |kind: &'static BondKind| kind.offsets.iter().map(move |offset| (*offset, kind));
        let bonds = self.table.bonds.iter().flat_map(one_way).map(|(offset, kind)| {
            let mut along = [0.0; 3];
            for (along, axis) in along.iter_mut().zip(self.table.axes) {
                *along = kind.part(offset[*axis]);
            }
            let lines = offset[2] * self.lanes as isize + offset[1];
            let ahead = lines * self.columns as isize + offset[0];
            (offset, ahead, along, kind.stiffness_ratio * self.stiffness_n_per_m)
        });
        let bonds: Vec<_> = bonds.collect();
        // The places along an axis at which a bond starts.
        let starts = |step: isize, count: usize| {
            let first = step.min(0).unsigned_abs();
            first..count.saturating_sub(step.max(0).unsigned_abs()).max(first)
        };
        let mut of_line = Vec::with_capacity(bonds.len());
        for number in 0..self.lanes * self.rows {
            of_line.clear();
            for &([step, across, up], ahead, along, stiffness_n_per_m) in &bonds {
                let (columns, lanes, rows) =
                    (starts(step, self.columns), starts(across, self.lanes), starts(up, self.rows));
                let (lane, row) = (number % self.lanes, number / self.lanes);
                if !columns.is_empty() && lanes.contains(&lane) && rows.contains(&row) {
                    of_line.push(BondsOfLine { columns, ahead, along, stiffness_n_per_m });
                }
            }
            line(number * self.columns, &of_line);
        }
    }

    /// Visits all bonds once, in the order of the node from which they start, and of the table.
    pub fn over_bonds(&self, mut bond: impl FnMut(Bond)) {
        self.over_lines(|first, bonds| {
            for column in 0..self.columns {
                for of_line in bonds.iter().filter(|bonds| bonds.columns.contains(&column)) {
                    bond(of_line.bond(first + column));
                }
            }
        });
    }

    /// The pull of springs on one freedom, bond by bond.
    pub fn spring_force_n<T: Number>(&self, displacement_m: &[T], freedom: usize) -> T {
        if self.axes() == 1 {
            return second_difference(displacement_m, freedom) * self.stiffness_n_per_m;
        }
        let (nodes, axes) = (self.nodes(), self.table.axes);
        let (own, node) = (axes[freedom / nodes], freedom % nodes);
        let mut force_n = T::default();
        for (to, offset, kind) in self.bonds_of(node) {
            let mut stretch_m = T::default();
            for (other, axis) in axes.iter().enumerate() {
                let change_m = displacement_m[other * nodes + to] - displacement_m[other * nodes + node];
                stretch_m = stretch_m + change_m * (offset[own] * offset[*axis]) as f64;
            }
            force_n = force_n + stretch_m * (kind.share() * self.stiffness_n_per_m);
        }
        force_n
    }

    /// The pull of dashpots on one freedom, bond by bond.
    pub fn damping_force_n<T: Number>(&self, velocity_m_per_s: &[T], freedom: usize) -> T {
        if self.axes() == 1 {
            return second_difference(velocity_m_per_s, freedom) * self.damping_kg_per_s;
        }
        let (nodes, here) = (self.nodes(), velocity_m_per_s[freedom]);
        let first = freedom / nodes * nodes;
        let changes = self.bonds_of(freedom % nodes).map(|(to, ..)| velocity_m_per_s[first + to] - here);
        changes.fold(T::default(), |sum, change| sum + change) * self.damping_kg_per_s
    }

    /// The diagonal element of the springs' stiffness at a freedom.
    pub fn diagonal_n_per_m(&self, freedom: usize) -> f64 {
        let axis = self.table.axes[freedom / self.nodes()];
        let bonds = self.bonds_of(freedom % self.nodes());
        let shares = bonds.map(|(_, offset, kind)| kind.share() * (offset[axis] * offset[axis]) as f64);
        shares.sum::<f64>() * self.stiffness_n_per_m
    }

    /// The diagonal element of the damping at a freedom.
    pub fn damping_diagonal_kg_per_s(&self, freedom: usize) -> f64 {
        self.bonds_of(freedom % self.nodes()).count() as f64 * self.damping_kg_per_s
    }

    /// The largest diagonal element of the stiffness, inside or, with the foundation, at the bottom:
    /// `3 k` or `3 k / 2 + k_f` in a slab.
    pub fn largest_diagonal_n_per_m(&self) -> f64 {
        self.largest_in_row_n_per_m(|row| row.diagonal)
    }

    /// Bound on the sum of magnitudes in a row of the stiffness: `7 k` in a slab or, with the foundation
    /// under nodes that have no bonds below, `7 k / 2 + k_f`.
    pub fn row_bound_n_per_m(&self) -> f64 {
        self.largest_in_row_n_per_m(|row| row.magnitudes)
    }

    fn largest_in_row_n_per_m(&self, of: impl Fn(RowOf) -> f64) -> f64 {
        let k = self.stiffness_n_per_m;
        let rows = self.table.axes.iter().map(|axis| of(self.table.stiffness_row(*axis, false)));
        let inside_n_per_m = rows.fold(0.0, f64::max) * k;
        let borne = self.table.upward().map(|freedom| self.table.axes[freedom]);
        let at_bottom = borne.map(|axis| of(self.table.stiffness_row(axis, true)));
        at_bottom.map_or(inside_n_per_m, |share| inside_n_per_m.max(share * k + self.foundation_n_per_m))
    }

    /// Bound on the sum of magnitudes in a row of the damping: `16 eta` in a slab.
    pub fn damping_row_bound_kg_per_s(&self) -> f64 {
        self.table.damping_row().magnitudes * self.damping_kg_per_s
    }

    /// Bound on the Euclidean length of a row of the damping plus half a step times the stiffness
    /// between nodes. In a slab it is `sqrt(72) eta + sqrt(23 / 2) dt k / 2`: a row of the damping has 8
    /// and eight times -1, one of the stiffness 3, -1 twice along its axis and four times 1/4 along
    /// each.
    pub fn row_length_kg_per_s(&self, step_s: f64) -> f64 {
        let rows = self.table.axes.iter().map(|axis| self.table.stiffness_row(*axis, false).squares);
        let (springs, dashpots) = (rows.fold(0.0, f64::max), self.table.damping_row().squares);
        let half_step_kg_per_s = step_s * self.stiffness_n_per_m / 2.0;
        // In a chain both rows are proportional, and are added before the length is taken.
        if springs == dashpots {
            return dashpots.sqrt() * (self.damping_kg_per_s + half_step_kg_per_s);
        }
        dashpots.sqrt() * self.damping_kg_per_s + springs.sqrt() * half_step_kg_per_s
    }

    /// Bound on the eigenvalues of the stiffness of springs, friction springs `k_t`, drive `K` and
    /// foundation. Friction springs and drive pull along the surface and the foundation upwards, so the
    /// larger of the two counts.
    pub fn stiffest_n_per_m(&self, interfacial_n_per_m: f64, drive_n_per_m: f64) -> f64 {
        let between_n_per_m = self.spectral_bound_n_per_m();
        match self.table.upward() {
            None => between_n_per_m + interfacial_n_per_m + drive_n_per_m,
            Some(_) => between_n_per_m + (interfacial_n_per_m + drive_n_per_m).max(self.foundation_n_per_m),
        }
    }

    /// Bound on the eigenvalues of the springs' stiffness without the foundation: `6 k` in a slab.
    pub fn spectral_bound_n_per_m(&self) -> f64 {
        self.between_nodes(self.table.largest_eigenvalue * self.stiffness_n_per_m)
    }

    /// Bound on the eigenvalues of the dashpots' damping: `12 eta` in a slab.
    pub fn damping_spectral_bound_kg_per_s(&self) -> f64 {
        self.between_nodes(self.table.largest_damping_eigenvalue * self.damping_kg_per_s)
    }

    /// A bound of the bonds between nodes; 0 for a single node, which has none.
    fn between_nodes(&self, bound: f64) -> f64 {
        if self.nodes() > 1 { bound } else { 0.0 }
    }
}

/// A spring with its dashpot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bond {
    /// The node at one end.
    pub from: usize,
    /// The node at the other end.
    pub to: usize,
    /// Unit vector from one to the other, by the freedoms of a node; 0 for missing freedoms.
    pub along: [f64; 3],
    /// Stiffness of the spring.
    pub stiffness_n_per_m: f64,
}

/// The bonds of one kind that start along a line of nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct BondsOfLine {
    /// The columns at which they start.
    pub columns: Range<usize>,
    /// By how much the numbers of their ends differ.
    pub ahead: isize,
    /// [`Bond::along`].
    pub along: [f64; 3],
    /// [`Bond::stiffness_n_per_m`].
    pub stiffness_n_per_m: f64,
}

impl BondsOfLine {
    /// The bond from a node.
    #[inline]
    pub fn bond(&self, from: usize) -> Bond {
        let &BondsOfLine { ahead, along, stiffness_n_per_m, .. } = self;
        Bond { from, to: from.wrapping_add_signed(ahead), along, stiffness_n_per_m }
    }
}
