//! The pull on the nodes of any lattice, by its table of bonds.
//!
//! Of a quantity `y` at a node, the bonds along an offset `o` and against it have the second difference
//! `D y = (y(+o) + y(-o)) - 2 y`; a missing neighbour is replaced by the node itself. Springs pull along
//! axis `a` with `k r / (o . o)` times `o_a sum_b o_b D u_b`, dashpots with `eta D v_a`. Contributions
//! of two mirror-image offsets are summed first, and that sum is commutative; so a mirrored lattice
//! gives mirrored forces, to the bit.
//!
//! Kinds of bonds are added one after the other to the forces on a line of nodes, which stay in the
//! nearest cache. The number of offsets of a kind and of their axes is a compile-time constant in the
//! innermost loops.

use super::table::{BondKind, Offset, Table};

/// A lattice with its table.
#[derive(Debug, Clone, Copy)]
pub(super) struct ByTable {
    pub(super) table: &'static Table,
    /// Nodes along each axis.
    pub(super) counts: [usize; 3],
    pub(super) stiffness_n_per_m: f64,
    pub(super) damping_kg_per_s: f64,
}

/// Nodes of a line that are computed together.
const GROUP: usize = 4;

/// Consecutive nodes of a line: the line, the first column, how many.
#[derive(Clone, Copy)]
struct Stretch {
    line: usize,
    column: usize,
    count: usize,
}

/// Index of the first of some nodes, and of those ahead of and behind them along an offset.
type Firsts = [usize; 3];

/// A quantity at these nodes.
#[derive(Clone, Copy, Default)]
struct Around<'a> {
    here: &'a [f64],
    ahead: &'a [f64],
    behind: &'a [f64],
}

impl<'a> Around<'a> {
    #[inline(always)]
    fn of(freedom: &'a [f64], [here, ahead, behind]: Firsts, count: usize) -> Around<'a> {
        Around {
            here: &freedom[here..][..count],
            ahead: &freedom[ahead..][..count],
            behind: &freedom[behind..][..count],
        }
    }

    /// The second difference at some nodes from one on.
    #[inline(always)]
    fn second_difference<const N: usize>(&self, at: usize) -> [f64; N] {
        let (here, ahead, behind) = (&self.here[at..][..N], &self.ahead[at..][..N], &self.behind[at..][..N]);
        let mut second = [0.0; N];
        for n in 0..N {
            second[n] = (ahead[n] + behind[n]) - 2.0 * here[n];
        }
        second
    }
}

impl ByTable {
    /// The pulls of springs and of dashpots between nodes on all freedoms.
    #[inline(always)]
    pub(super) fn pull(&self, springs_n: &mut [f64], dashpots_n: &mut [f64], u: &[f64], v: &[f64]) {
        let [columns, lanes, rows] = self.counts;
        springs_n.fill(0.0);
        dashpots_n.fill(0.0);
        for line in 0..lanes * rows {
            for kind in self.table.bonds {
                // The ends of a line have neighbours on one side only.
                for (column, count) in [(0, 1), (1, columns - 2), (columns - 1, 1)] {
                    let nodes = Stretch { line, column, count };
                    match kind.offsets {
                        [one] => self.add_kind(springs_n, dashpots_n, u, v, nodes, kind, [one]),
                        [one, other] => self.add_kind(springs_n, dashpots_n, u, v, nodes, kind, [one, other]),
                        _ => unreachable!("one offset or two that are each other's mirror images"),
                    }
                }
            }
        }
        for force_n in dashpots_n {
            *force_n *= self.damping_kg_per_s;
        }
    }

    /// Adds the pull of one kind of bonds on some nodes.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "forces, state, where and what")]
    fn add_kind<const K: usize>(
        &self,
        springs_n: &mut [f64],
        dashpots_n: &mut [f64],
        u: &[f64],
        v: &[f64],
        nodes: Stretch,
        kind: &BondKind,
        offsets: [&Offset; K],
    ) {
        let all = self.counts[0] * self.counts[1] * self.counts[2];
        let mut firsts = [[0; 3]; K];
        for k in 0..K {
            firsts[k] = self.firsts(nodes, offsets[k]);
        }
        let (mut freedoms, mut count) = ([0; 3], 0);
        for (freedom, axis) in self.table.axes.iter().enumerate() {
            let mut around = [Around::default(); K];
            for k in 0..K {
                around[k] = Around::of(&v[freedom * all..][..all], firsts[k], nodes.count);
            }
            add_dashpots(&mut dashpots_n[freedom * all + firsts[0][0]..][..nodes.count], &around);
            if offsets[0][*axis] != 0 {
                freedoms[count] = freedom;
                count += 1;
            }
        }
        let share_n_per_m = kind.share() * self.stiffness_n_per_m;
        let [a, b, c] = freedoms;
        match count {
            1 => self.add_springs(springs_n, u, nodes, share_n_per_m, offsets, firsts, [a]),
            2 => self.add_springs(springs_n, u, nodes, share_n_per_m, offsets, firsts, [a, b]),
            3 => self.add_springs(springs_n, u, nodes, share_n_per_m, offsets, firsts, [a, b, c]),
            // Axes along which no node moves.
            _ => {}
        }
    }

    /// Adds the pull of springs along `A` axes on some nodes.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "forces, state, where and what")]
    fn add_springs<const K: usize, const A: usize>(
        &self,
        springs_n: &mut [f64],
        u: &[f64],
        nodes: Stretch,
        share_n_per_m: f64,
        offsets: [&Offset; K],
        firsts: [Firsts; K],
        freedoms: [usize; A],
    ) {
        let all = self.counts[0] * self.counts[1] * self.counts[2];
        let (mut around, mut steps, mut first) = ([[Around::default(); A]; K], [[0.0; A]; K], [0; A]);
        for a in 0..A {
            first[a] = freedoms[a] * all + firsts[0][0];
            for k in 0..K {
                around[k][a] = Around::of(&u[freedoms[a] * all..][..all], firsts[k], nodes.count);
                steps[k][a] = offsets[k][self.table.axes[freedoms[a]]] as f64;
            }
        }
        let whole = nodes.count / GROUP * GROUP;
        for at in (0..whole).step_by(GROUP) {
            add_springs_at::<GROUP, K, A>(springs_n, first, &around, &steps, share_n_per_m, at);
        }
        for at in whole..nodes.count {
            add_springs_at::<1, K, A>(springs_n, first, &around, &steps, share_n_per_m, at);
        }
    }

    /// Some nodes, and their neighbours along an offset. Either all of them have a neighbour or none;
    /// then they are their own neighbours.
    #[inline(always)]
    fn firsts(&self, nodes: Stretch, offset: &Offset) -> Firsts {
        let [columns, lanes, rows] = self.counts;
        let (row, lane) = (nodes.line / lanes, nodes.line % lanes);
        let here = nodes.line * columns + nodes.column;
        let mut firsts = [here; 3];
        for (first, way) in firsts[1..].iter_mut().zip([1, -1]) {
            // Negative columns wrap to large ones, and are thus beyond the other end as well.
            let column = nodes.column.wrapping_add_signed(way * offset[0]);
            let lane = lane.wrapping_add_signed(way * offset[1]);
            let row = row.wrapping_add_signed(way * offset[2]);
            if column < columns && column + nodes.count <= columns && lane < lanes && row < rows {
                *first = (row * lanes + lane) * columns + column;
            }
        }
        firsts
    }
}

/// Adds the pull of springs to the forces on `N` nodes.
#[inline(always)]
fn add_springs_at<const N: usize, const K: usize, const A: usize>(
    springs_n: &mut [f64],
    first: [usize; A],
    around: &[[Around<'_>; A]; K],
    steps: &[[f64; A]; K],
    share_n_per_m: f64,
    at: usize,
) {
    let mut pulled = [[0.0; N]; A];
    for k in 0..K {
        let mut stretch = [0.0; N];
        for a in 0..A {
            let change = around[k][a].second_difference::<N>(at);
            for n in 0..N {
                stretch[n] += steps[k][a] * change[n];
            }
        }
        for a in 0..A {
            for n in 0..N {
                pulled[a][n] += steps[k][a] * stretch[n];
            }
        }
    }
    for a in 0..A {
        let springs_n = &mut springs_n[first[a] + at..][..N];
        for n in 0..N {
            springs_n[n] += share_n_per_m * pulled[a][n];
        }
    }
}

/// Adds the pull of dashpots, from second differences.
#[inline(always)]
fn add_dashpots<const K: usize>(sums: &mut [f64], around: &[Around<'_>; K]) {
    let whole = sums.len() / GROUP * GROUP;
    for at in (0..whole).step_by(GROUP) {
        add_dashpots_at::<GROUP, K>(sums, around, at);
    }
    for at in whole..sums.len() {
        add_dashpots_at::<1, K>(sums, around, at);
    }
}

#[inline(always)]
fn add_dashpots_at<const N: usize, const K: usize>(sums: &mut [f64], around: &[Around<'_>; K], at: usize) {
    let mut all = [0.0; N];
    for around in around {
        let change = around.second_difference::<N>(at);
        for n in 0..N {
            all[n] += change[n];
        }
    }
    let sums = &mut sums[at..][..N];
    for n in 0..N {
        sums[n] += all[n];
    }
}
