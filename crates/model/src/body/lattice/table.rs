//! Tables of bodies: bonds, and the axes along which nodes move.
//!
//! A node has a position `(x, y, z)` in whole spacings: `x` along the sliding direction, `y` across it,
//! `z` upwards. A bond to the node at an offset `o` is a spring of stiffness `r k`, which pulls along
//! the bond, and a dashpot `eta`, which resists every component of the relative velocity. One end of a
//! bond pulls the other along axis `a`, per displacement along axis `b`, with
//!
//! ```text
//! k r o_a o_b / (o . o)
//! ```
//!
//! Everything else follows from that, except for the largest eigenvalues, which each table has with a
//! derivation from plane waves in an infinite lattice. Their phases from node to node are `q_x`, `q_y`,
//! `q_z`, with `c_a = cos q_a`, `s_a = sin q_a` and a unit vector `e`. A lattice with edges lacks some
//! bonds, and no bond has negative energy or dissipation; so its eigenvalues are no larger.

/// A place or an offset of nodes: along the sliding direction, across it, upwards.
pub type Offset = [isize; 3];

/// Bonds that differ only in direction.
#[derive(Debug, PartialEq)]
pub struct BondKind {
    /// Offsets from a node to its neighbours, one of each opposite pair: a single one, or two that are
    /// mirror images of each other. Each component is -1, 0 or 1.
    pub offsets: &'static [Offset],
    /// Stiffness of the springs over `k`.
    pub stiffness_ratio: f64,
}

impl BondKind {
    /// The square of the length of a bond, in spacings.
    #[inline(always)]
    fn square(&self) -> f64 {
        self.offsets[0].iter().map(|step| step * step).sum::<isize>() as f64
    }

    /// Component, along an axis, of the unit vector along a bond that spans `step` spacings in it.
    pub(super) fn part(&self, step: isize) -> f64 {
        // The root of 1/2 rounds once, 1 over the root of 2 twice.
        (1.0 / self.square()).sqrt() * step as f64
    }

    /// Magnitude of the pull of one end on the other along an axis, over `k`, for a displacement of one
    /// spacing along another axis.
    #[inline(always)]
    pub fn share(&self) -> f64 {
        self.stiffness_ratio / self.square()
    }
}

/// Kinds of bonds, and the axes along which nodes move.
#[derive(Debug, PartialEq)]
pub struct Table {
    /// The name of a body with this table.
    pub name: &'static str,
    /// The axes along which nodes move, ascending: 0 is `x`, 1 `y`, 2 `z`.
    pub axes: &'static [usize],
    /// The bonds of a node.
    pub bonds: &'static [BondKind],
    /// Bound on the eigenvalues of the springs' stiffness, over `k`.
    pub largest_eigenvalue: f64,
    /// Bound on the eigenvalues of the dashpots' damping, over `eta`.
    pub largest_damping_eigenvalue: f64,
    /// The loops over its bonds.
    pub(super) loops: Loops,
}

/// Which loops compute the pull between nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Loops {
    /// Those of a line, for one axis.
    Line,
    /// Those of `plane.rs`, for two axes.
    Plane,
    /// Those of `cube.rs`, for three.
    Cube,
}

/// A chain: one row of nodes that move along it. `2 k (1 - c_x) <= 4 k`, and dashpots, over `eta`, the same.
pub const CHAIN: Table = Table {
    name: "chain",
    axes: &[0],
    bonds: &[BondKind { offsets: &[[1, 0, 0]], stiffness_ratio: 1.0 }],
    largest_eigenvalue: 4.0,
    largest_damping_eigenvalue: 4.0,
    loops: Loops::Line,
};

/// A slab: a plane that rests on its bottom row. Springs along its axes with `k`, along diagonals with
/// `k / 2` are an isotropic sheet in plane stress with Young's modulus `E = 4 k / (3 B)` for a thickness
/// `B`, and Poisson's ratio 1/3.
///
/// The energy of its springs is `k / 2` times
///
/// ```text
/// 2 e_x^2 (1 - c_x) + 2 e_z^2 (1 - c_z) + 1 - c_x c_z + 2 e_x e_z s_x s_z
///     <= e_x^2 (4 - (1 + c_x)^2) + e_z^2 (4 - (1 + c_z)^2) + 1 - c_x c_z <= 4 + 2
/// ```
///
/// since `2 a b s t <= a^2 s^2 + b^2 t^2`; at `q_x = pi`, `q_z = 0` it is 6. The damping is
/// `eta (8 - 2 c_x - 2 c_z - 4 c_x c_z)`, which is linear in each cosine, so largest where they are -1 and
/// 1: 12.
pub const SLAB: Table = Table {
    name: "slab",
    axes: &[0, 2],
    bonds: &[
        BondKind { offsets: &[[1, 0, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[0, 0, 1]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[1, 0, 1], [-1, 0, 1]], stiffness_ratio: 0.5 },
    ],
    largest_eigenvalue: 6.0,
    largest_damping_eigenvalue: 12.0,
    loops: Loops::Plane,
};

/// A sheet: the plane of a slab laid flat, so that all of its nodes rub.
pub const SHEET: Table = Table {
    name: "sheet",
    axes: &[0, 1],
    bonds: &[
        BondKind { offsets: &[[1, 0, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[0, 1, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[1, 1, 0], [-1, 1, 0]], stiffness_ratio: 0.5 },
    ],
    largest_eigenvalue: SLAB.largest_eigenvalue,
    largest_damping_eigenvalue: SLAB.largest_damping_eigenvalue,
    loops: Loops::Plane,
};

/// A block: a cubic lattice with springs along its axes and along the diagonals of its faces, all with
/// `k`, 18 at a node. With stiffnesses `k_1`, `k_2` of the two and a spacing `a` the elastic constants
/// are `C_11 = (k_1 + 2 k_2) / a` and `C_12 = C_44 = k_2 / a`: isotropic where `k_1 = k_2`, with
/// Poisson's ratio 1/4 and `E = 5 k / (2 a)`.
///
/// The energy of its springs is bounded, with `a b s t <= (a^2 + b^2) (s^2 + t^2) / 4` in each plane of two
/// axes `i`, `j`,
///
/// ```text
/// k (sum_i 2 e_i^2 (1 - c_i) + sum_ij (2 (e_i^2 + e_j^2) (1 - c_i c_j) + 4 e_i e_j s_i s_j))
///     <= k sum_i e_i^2 (2 (1 - c_i) + sum_j (4 - (c_i + c_j)^2)) <= k (4 + 2 x 4)
/// ```
///
/// and at `q_x = pi`, the others 0, it is 12. The damping is
/// `eta (2 sum_i (1 - c_i) + 4 sum_ij (1 - c_i c_j))`, linear in each cosine: largest at `q_x = q_y = pi`,
/// `q_z = 0`, where it is `8 + 16`.
pub const BLOCK: Table = Table {
    name: "body",
    axes: &[0, 1, 2],
    bonds: &[
        BondKind { offsets: &[[1, 0, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[0, 1, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[0, 0, 1]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[1, 1, 0], [-1, 1, 0]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[1, 0, 1], [-1, 0, 1]], stiffness_ratio: 1.0 },
        BondKind { offsets: &[[0, 1, 1], [0, -1, 1]], stiffness_ratio: 1.0 },
    ],
    largest_eigenvalue: 12.0,
    largest_damping_eigenvalue: 24.0,
    loops: Loops::Cube,
};

/// Contribution of all bonds of an inner node to a row of the stiffness, over `k`, or of the damping, over
/// `eta`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowOf {
    /// On the diagonal.
    pub diagonal: f64,
    /// The sum of magnitudes. Removing a bond does not increase it: its terms vanish from the diagonal and
    /// from the neighbour's columns, and the terms that the opposite bond then leaves between the node's
    /// own axes are no larger.
    pub magnitudes: f64,
    /// The sum of squares.
    pub squares: f64,
}

impl Table {
    /// Index of an axis among the freedoms of a node, in the order of arrays; `None` if nodes do not move
    /// along it.
    pub fn freedom(&self, axis: usize) -> Option<usize> {
        self.axes.iter().position(|known| *known == axis)
    }

    /// The vertical axis as a freedom, for bodies on a foundation.
    pub fn upward(&self) -> Option<usize> {
        self.freedom(2)
    }

    /// All bonds of an inner node, as offset and kind: first those that start at it, then their opposites.
    pub fn around(&self) -> impl Iterator<Item = (Offset, &'static BondKind)> + use<> {
        self.bonds.iter().flat_map(|kind| {
            let both = |offset: &Offset| [*offset, offset.map(|step| -step)];
            kind.offsets.iter().flat_map(both).map(move |offset| (offset, kind))
        })
    }

    /// A row of the stiffness along an axis, over `k`, of a node with all bonds, or with all but those
    /// downwards, as at the bottom.
    pub fn stiffness_row(&self, axis: usize, at_bottom: bool) -> RowOf {
        let mut row = RowOf { diagonal: 0.0, magnitudes: 0.0, squares: 0.0 };
        for (offset, kind) in self.around().filter(|(offset, _)| !(at_bottom && offset[2] < 0)) {
            let along = |other: usize| kind.share() * (offset[axis] * offset[other]).abs() as f64;
            row.diagonal += along(axis);
            for other in self.axes {
                row.magnitudes += along(*other);
                row.squares += along(*other) * along(*other);
            }
        }
        row.with_diagonal()
    }

    /// A row of the damping, over `eta`, of a node with all bonds.
    pub fn damping_row(&self) -> RowOf {
        let bonds = self.around().count() as f64;
        RowOf { diagonal: bonds, magnitudes: bonds, squares: bonds }.with_diagonal()
    }

    /// The squares of the speeds of long waves along `x`, over `k a^2 / m`: of those that swing along
    /// `x`, longitudinal ones, and of those that swing across, shear waves; `None` if nodes move along `x` only.
    pub fn long_waves(&self) -> (f64, Option<f64>) {
        let along = |axis: usize| {
            let part = |offset: &Offset| (offset[0] * offset[0] * offset[axis] * offset[axis]) as f64;
            self.bonds.iter().flat_map(|kind| kind.offsets.iter().map(|o| kind.share() * part(o))).sum()
        };
        (along(0), self.axes.get(1).map(|axis| along(*axis)))
    }
}

impl RowOf {
    /// With the diagonal among the magnitudes and squares.
    fn with_diagonal(self) -> RowOf {
        let RowOf { diagonal, magnitudes, squares } = self;
        RowOf { diagonal, magnitudes: magnitudes + diagonal, squares: squares + diagonal * diagonal }
    }
}
