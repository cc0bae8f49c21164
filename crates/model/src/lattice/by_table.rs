//! The pull on the nodes of any lattice, by its table of bonds.
//!
//! A bond kind and the offset `o` of one of its directions have the second difference
//! `D y = (y(+o) + y(-o)) - 2 y` of a quantity `y` at a node; a neighbour that is missing has no bond:
//! it stands where the node itself does. Springs pull along axis `a` with `k r / (o . o)` times
//! `o_a sum_b o_b D u_b`, dashpots with `eta D v_a`. What comes from bonds that are each other's mirror
//! images is summed first, and of two numbers in either order; so a mirrored lattice gives mirrored
//! forces, to the bit.

use std::array;

use super::table::{Offset, Table};

/// A lattice as its table has it.
#[derive(Debug, Clone, Copy)]
pub(super) struct ByTable {
    pub(super) table: &'static Table,
    /// Nodes along each axis.
    pub(super) counts: [usize; 3],
    pub(super) stiffness_n_per_m: f64,
    pub(super) damping_kg_per_s: f64,
}

/// Nodes of a line that are computed at once. The last group of a line ends with it, and computes again
/// what the one before it did.
const GROUP: usize = 8;

/// Most freedoms of a node.
const AXES: usize = 3;

/// Where the lines of nodes begin that a kind of bonds leads to: ahead and behind.
type Lines = [Option<usize>; 2];

impl ByTable {
    /// What springs, and what dashpots, between nodes pull with on all freedoms.
    #[inline(always)]
    pub(super) fn pull(&self, springs_n: &mut [f64], dashpots_n: &mut [f64], u: &[f64], v: &[f64]) {
        let [columns, lanes, rows] = self.counts;
        for line in 0..lanes * rows {
            for edge in [0, columns - 1] {
                self.pull_group::<1>(springs_n, dashpots_n, u, v, line, edge);
            }
            let inside = 1..columns - 1;
            if inside.len() < GROUP {
                for column in inside {
                    self.pull_group::<1>(springs_n, dashpots_n, u, v, line, column);
                }
                continue;
            }
            for column in inside.step_by(GROUP) {
                let column = column.min(columns - 1 - GROUP);
                self.pull_group::<GROUP>(springs_n, dashpots_n, u, v, line, column);
            }
        }
    }

    /// Some nodes of a line, one behind the other: of the first and the last column one alone.
    #[inline(always)]
    fn pull_group<const N: usize>(
        &self,
        springs_n: &mut [f64],
        dashpots_n: &mut [f64],
        u: &[f64],
        v: &[f64],
        line: usize,
        column: usize,
    ) {
        let [columns, lanes, rows] = self.counts;
        let nodes = columns * lanes * rows;
        let axes = self.table.axes;
        let (mut springs, mut dashpots) = ([[0.0; N]; AXES], [[0.0; N]; AXES]);
        for kind in self.table.bonds {
            let (mut along, mut across) = ([[0.0; N]; AXES], [[0.0; N]; AXES]);
            for offset in kind.offsets {
                let lines = self.lines(line, offset);
                let change = |of: &[f64], freedom: usize| {
                    second_difference::<N>(
                        &of[freedom * nodes..][..nodes],
                        columns,
                        line,
                        lines,
                        offset[0],
                        column,
                    )
                };
                let mut stretch = [0.0; N];
                for (freedom, axis) in axes.iter().enumerate() {
                    let step = offset[*axis] as f64;
                    if step != 0.0 {
                        let change = change(u, freedom);
                        for n in 0..N {
                            stretch[n] += step * change[n];
                        }
                    }
                    let change = change(v, freedom);
                    for n in 0..N {
                        across[freedom][n] += change[n];
                    }
                }
                for (freedom, axis) in axes.iter().enumerate() {
                    let step = offset[*axis] as f64;
                    for n in 0..N {
                        along[freedom][n] += step * stretch[n];
                    }
                }
            }
            let share_n_per_m = kind.share() * self.stiffness_n_per_m;
            for freedom in 0..axes.len() {
                for n in 0..N {
                    springs[freedom][n] += share_n_per_m * along[freedom][n];
                    dashpots[freedom][n] += across[freedom][n];
                }
            }
        }
        for freedom in 0..axes.len() {
            let first = freedom * nodes + line * columns + column;
            springs_n[first..][..N].copy_from_slice(&springs[freedom]);
            dashpots_n[first..][..N]
                .copy_from_slice(&dashpots[freedom].map(|sum| self.damping_kg_per_s * sum));
        }
    }

    /// The lines that bonds lead to from one, ahead and behind; `None` beyond an edge.
    #[inline(always)]
    fn lines(&self, line: usize, offset: &Offset) -> Lines {
        let [_, lanes, rows] = self.counts;
        let (row, lane) = (line / lanes, line % lanes);
        [1, -1].map(|way| {
            let lane = lane.checked_add_signed(way * offset[1]).filter(|lane| *lane < lanes)?;
            let row = row.checked_add_signed(way * offset[2]).filter(|row| *row < rows)?;
            Some(row * lanes + lane)
        })
    }
}

/// `(y(+o) + y(-o)) - 2 y` of nodes of a line, from those of all nodes.
#[inline(always)]
fn second_difference<const N: usize>(
    y: &[f64],
    columns: usize,
    line: usize,
    [ahead, behind]: Lines,
    along: isize,
    column: usize,
) -> [f64; N] {
    let whole = |line: usize| &y[line * columns..][..columns];
    let here: [f64; N] = *whole(line)[column..].first_chunk().expect("columns of the line");
    let shifted = |line: Option<usize>, along: isize| -> [f64; N] {
        let from = || whole(line?).get(column.checked_add_signed(along)?..)?.first_chunk().copied();
        from().unwrap_or(here)
    };
    let (ahead, behind) = (shifted(ahead, along), shifted(behind, -along));
    array::from_fn(|n| (ahead[n] + behind[n]) - 2.0 * here[n])
}
