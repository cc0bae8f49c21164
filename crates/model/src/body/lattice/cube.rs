//! The pull on the nodes of a cubic lattice: the bonds of bodies, written out so that loops over them are
//! fast. Tests compare it with the table of bonds.
//!
//! Bonds go to the node's neighbours along its own line, and to those on, before and behind eight other
//! lines: two across, two up and down, four along the diagonals between these. With `y` and `z` for these
//! steps, springs pull along `x`, over `k / 2`, with
//!
//! ```text
//! ahead(x+1) + behind(x-1) - 12 u_x
//! ahead, behind = 2 u_x + sum of u_x over y, z  +-  ((u_y(+y) - u_y(-y)) + (u_z(+z) - u_z(-z)))
//! ```
//!
//! and likewise along `y`, where the diagonals between `y` and `z` stay in the same column:
//!
//! ```text
//! ahead(x+1) + behind(x-1) + 2 (u_y(+y) + u_y(-y)) + sum of u_y over diagonals
//!     + ((u_z(+y+z) - u_z(-y+z)) - (u_z(+y-z) - u_z(-y-z))) - 12 u_y
//! ahead, behind = (u_y(+y) + u_y(-y))  +-  (u_x(+y) - u_x(-y))
//! ```
//!
//! Dashpots, over `eta`, pull with `T(x+1) + T(x-1) + S + D - 18 v`, where `S` is the sum over `y` and `z`,
//! `D` that over the diagonals between them, and `T = v + S`. So each sum is computed once for a line and
//! then used at the columns before and behind.
//!
//! Missing lines are lines of zeros, and the node's own part counts the bonds that are there. Sums over
//! mirror images are differences or commutative sums of two, so a mirrored lattice gives mirrored forces,
//! to the bit.

use std::ops::Range;

/// A cubic lattice. Arrays have one axis of all nodes after the other; nodes are counted line by line.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cube {
    /// Nodes along each axis.
    pub(super) counts: [usize; 3],
    pub(super) stiffness_n_per_m: f64,
    pub(super) damping_kg_per_s: f64,
}

/// Most columns of a line that are computed together: their sums stay in the nearest cache.
const PIECE: usize = 64;

/// Columns whose sums are computed at once. The last group of a piece ends with it and overlaps the one
/// before, repeating some of its work: a shorter group would be slower.
const GROUP: usize = 8;

/// Numbers along a piece, with a place for the column before it and one for that behind. Those of the piece begin where a
/// line of the cache does: groups across two lines take an eighth longer.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Sums([f64; FIRST + PIECE + 1]);

/// The place of a piece's first column.
const FIRST: usize = 8;

const NO_SUMS: Sums = Sums([0.0; FIRST + PIECE + 1]);

static ZEROS: [f64; PIECE + 2] = [0.0; PIECE + 2];

/// Of one axis, for a piece: what pulls at the column before, what pulls at the column behind, and what pulls
/// in the same column.
struct Parts {
    ahead: Sums,
    behind: Sums,
    own: Sums,
}

const NO_PARTS: Parts = Parts { ahead: NO_SUMS, behind: NO_SUMS, own: NO_SUMS };

/// A quantity on the nine lines around a piece: by the step up, then by the step across, each -1, 0, 1. Loops
/// write them: the compiler does not inline `map` of arrays into code for another instruction set.
type Lines<'a> = [[&'a [f64]; 3]; 3];

const NO_LINES: Lines<'static> = [[&[]; 3]; 3];

/// A piece of a line: columns from the first up to the last, which it does not include.
#[derive(Clone, Copy)]
struct Piece {
    lane: usize,
    row: usize,
    /// The first node of the line.
    line: usize,
    first: usize,
    last: usize,
    columns: usize,
}

impl Piece {
    /// Its nodes.
    #[inline(always)]
    fn nodes(self) -> Range<usize> {
        self.line + self.first..self.line + self.last
    }

    /// Its columns with those beside it.
    #[inline(always)]
    fn around(self) -> Range<usize> {
        self.first.saturating_sub(1)..(self.last + 1).min(self.columns)
    }

    /// Where the first of these is in arrays of sums.
    #[inline(always)]
    fn place(self) -> usize {
        FIRST - usize::from(self.first > 0)
    }

    /// The ends of the line in it: the places of the end and of what is beyond it in arrays of sums, and the
    /// direction of the bonds that are there; `None` where the line goes on.
    #[inline(always)]
    fn ends(self) -> [Option<(usize, usize, f64)>; 2] {
        let count = self.last - self.first;
        let first = if self.first == 0 { Some((FIRST, FIRST - 1, 1.0)) } else { None };
        let last =
            if self.last == self.columns { Some((FIRST + count - 1, FIRST + count, -1.0)) } else { None };
        [first, last]
    }
}

/// How many bonds the nodes of a line have besides those along it.
struct Bonds {
    /// To lines across, to those up and down, and to those along the diagonals between.
    across: f64,
    up: f64,
    diagonal: f64,
    /// How many more of the first two there are in the positive direction than in the negative one.
    surplus: [f64; 2],
    /// The sum of the products of the steps of the diagonals.
    twist: f64,
}

impl Bonds {
    #[inline(always)]
    fn of(lane: usize, row: usize, [_, lanes, rows]: [usize; 3]) -> Bonds {
        let is_there = |is_there: bool| f64::from(u8::from(is_there));
        let (before, behind) = (is_there(lane > 0), is_there(lane + 1 < lanes));
        let (below, above) = (is_there(row > 0), is_there(row + 1 < rows));
        let (across, up, surplus) = (behind + before, above + below, [behind - before, above - below]);
        Bonds { across, up, diagonal: across * up, surplus, twist: surplus[0] * surplus[1] }
    }
}

impl Cube {
    /// The pull of springs between nodes on all freedoms.
    ///
    /// Always inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    pub(super) fn pull_of_springs(&self, force_n: &mut [&mut [f64]; 3], u: &[f64]) {
        let nodes = self.nodes();
        let mut springs = [NO_PARTS; 3];
        for number in self.pieces() {
            let (piece, starts, bonds) = self.piece(number);
            let mut around = [NO_LINES; 3];
            for axis in 0..3 {
                around[axis] = lines(&u[axis * nodes..][..nodes], &starts, piece.around().len());
            }
            sum_springs(&mut springs, &around, piece, &bonds);
            for axis in 0..3 {
                let Parts { ahead, behind, own: of_column } = &springs[axis];
                let force_n = &mut force_n[axis][piece.nodes()];
                add_parts(force_n, of_column, ahead, behind, 0.5 * self.stiffness_n_per_m);
            }
        }
    }

    /// The pull of dashpots between nodes on all freedoms; likewise inlined.
    #[inline(always)]
    pub(super) fn pull_of_dashpots(&self, force_n: &mut [&mut [f64]; 3], v: &[f64]) {
        let nodes = self.nodes();
        let mut dashpots = NO_PARTS;
        // One axis after the other: the lines around one line of all axes would not fit into the nearest cache.
        for axis in 0..3 {
            let (v, force_n) = (&v[axis * nodes..][..nodes], &mut *force_n[axis]);
            for number in self.pieces() {
                let (piece, starts, bonds) = self.piece(number);
                let Parts { ahead: beside, own: of_column, .. } = &mut dashpots;
                sum_dashpots(beside, of_column, &lines(v, &starts, piece.around().len()), piece, &bonds);
                add_parts(&mut force_n[piece.nodes()], of_column, beside, beside, self.damping_kg_per_s);
            }
        }
    }

    #[inline(always)]
    fn nodes(&self) -> usize {
        let [columns, lanes, rows] = self.counts;
        columns * lanes * rows
    }

    /// The numbers of all pieces.
    #[inline(always)]
    fn pieces(&self) -> Range<usize> {
        let [columns, lanes, rows] = self.counts;
        0..lanes * rows * columns.div_ceil(PIECE)
    }

    /// A piece by its number, with where the lines around it begin, and its bonds.
    #[inline(always)]
    fn piece(&self, number: usize) -> (Piece, [[usize; 3]; 3], Bonds) {
        let [columns, lanes, _] = self.counts;
        let of_line = columns.div_ceil(PIECE);
        let (line, first) = (number / of_line, number % of_line * PIECE);
        let (lane, row) = (line % lanes, line / lanes);
        let last = (first + PIECE).min(columns);
        let piece = Piece { lane, row, line: line * columns, first, last, columns };
        (piece, self.around(piece), Bonds::of(lane, row, self.counts))
    }

    /// Where the lines around a piece begin; beyond all nodes where there is none.
    #[inline(always)]
    fn around(&self, piece: Piece) -> [[usize; 3]; 3] {
        let [columns, lanes, rows] = self.counts;
        let mut starts = [[columns * lanes * rows; 3]; 3];
        for (up, starts) in starts.iter_mut().enumerate() {
            for (across, start) in starts.iter_mut().enumerate() {
                // A line before the first has a number that wraps to a large one, and so is beyond the last as
                // well.
                let (lane, row) = ((piece.lane + across).wrapping_sub(1), (piece.row + up).wrapping_sub(1));
                if lane < lanes && row < rows {
                    *start = (row * lanes + lane) * columns + piece.around().start;
                }
            }
        }
        starts
    }
}

/// A quantity on the lines that begin there; zeros where there is none.
#[inline(always)]
fn lines<'a>(of: &'a [f64], starts: &[[usize; 3]; 3], count: usize) -> Lines<'a> {
    let mut lines = NO_LINES;
    for up in 0..3 {
        for across in 0..3 {
            let start = starts[up][across];
            lines[up][across] = if start < of.len() { &of[start..][..count] } else { &ZEROS[..count] };
        }
    }
    lines
}

/// A group of the columns of lines.
#[inline(always)]
fn group<'a, const N: usize>(lines: &Lines<'a>, at: usize) -> Lines<'a> {
    let mut groups = NO_LINES;
    for up in 0..3 {
        for across in 0..3 {
            groups[up][across] = &lines[up][across][at..][..N];
        }
    }
    groups
}

/// The parts of the pull of springs along a piece, over `k / 2`.
#[inline(always)]
fn sum_springs(parts: &mut [Parts; 3], lines: &[Lines<'_>; 3], piece: Piece, bonds: &Bonds) {
    let (count, place) = (lines[0][1][1].len(), piece.place());
    if count < GROUP {
        (0..count).for_each(|at| sum_springs_at::<1>(parts, place, lines, at, bonds));
    } else {
        for from in (0..count).step_by(GROUP) {
            sum_springs_at::<GROUP>(parts, place, lines, from.min(count - GROUP), bonds);
        }
    }
    if bonds.twist != 0.0 {
        let (y, z) = (lines[1][1][1], lines[2][1][1]);
        let [_, of_y, of_z] = parts;
        for n in 0..count {
            of_y.own.0[place + n] -= bonds.twist * z[n];
            of_z.own.0[place + n] -= bonds.twist * y[n];
        }
    }
    for end in piece.ends() {
        let Some((end, beyond, ahead)) = end else { continue };
        let here = |axis: usize| lines[axis][1][1][end - place];
        let (x, y, z) = (here(0), here(1), here(2));
        let (across, up) = (ahead * bonds.surplus[0], ahead * bonds.surplus[1]);
        for parts in parts.iter_mut() {
            (parts.ahead.0[beyond], parts.behind.0[beyond]) = (0.0, 0.0);
        }
        let [of_x, of_y, of_z] = parts;
        of_x.own.0[end] += (2.0 + (bonds.across + bonds.up)) * x - (across * y + up * z);
        of_y.own.0[end] += bonds.across * y - across * x;
        of_z.own.0[end] += bonds.up * z - up * x;
    }
}

#[inline(always)]
fn sum_springs_at<const N: usize>(
    parts: &mut [Parts; 3],
    place: usize,
    lines: &[Lines<'_>; 3],
    at: usize,
    bonds: &Bonds,
) {
    let own_x = 4.0 + 2.0 * (bonds.across + bonds.up);
    let own_y = 4.0 * bonds.across + bonds.diagonal;
    let own_z = 4.0 * bonds.up + bonds.diagonal;
    let [of_x, of_y, of_z] = lines;
    let (x, y, z) = (group::<N>(of_x, at), group::<N>(of_y, at), group::<N>(of_z, at));
    // Each axis first into numbers of its own, which overlap with nothing, as vectorising requires.
    let mut sums = [[[0.0; N]; 3]; 3];
    for n in 0..N {
        let across_x = x[1][2][n] + x[1][0][n];
        let up_x = x[2][1][n] + x[0][1][n];
        let even = 2.0 * x[1][1][n] + (across_x + up_x);
        let odd = (y[1][2][n] - y[1][0][n]) + (z[2][1][n] - z[0][1][n]);
        (sums[0][0][n], sums[0][1][n]) = (even + odd, even - odd);
        sums[0][2][n] = -own_x * x[1][1][n];

        let even = y[1][2][n] + y[1][0][n];
        let odd = x[1][2][n] - x[1][0][n];
        (sums[1][0][n], sums[1][1][n]) = (even + odd, even - odd);
        let diagonal = (y[2][2][n] + y[2][0][n]) + (y[0][2][n] + y[0][0][n]);
        let twisted = (z[2][2][n] - z[2][0][n]) - (z[0][2][n] - z[0][0][n]);
        sums[1][2][n] = (2.0 * even + (diagonal + twisted)) - own_y * y[1][1][n];

        let even = z[2][1][n] + z[0][1][n];
        let odd = x[2][1][n] - x[0][1][n];
        (sums[2][0][n], sums[2][1][n]) = (even + odd, even - odd);
        let diagonal = (z[2][2][n] + z[2][0][n]) + (z[0][2][n] + z[0][0][n]);
        let twisted = (y[2][2][n] - y[2][0][n]) - (y[0][2][n] - y[0][0][n]);
        sums[2][2][n] = (2.0 * even + (diagonal + twisted)) - own_z * z[1][1][n];
    }
    for axis in 0..3 {
        let Parts { ahead, behind, own } = &mut parts[axis];
        for (to, sums) in [ahead, behind, own].into_iter().zip(sums[axis]) {
            *to.0[place + at..].first_chunk_mut().expect("pieces lie within their parts") = sums;
        }
    }
}

/// The parts of the pull of dashpots along a piece, over `eta`: what pulls at the columns beside it, and in
/// the same column.
#[inline(always)]
fn sum_dashpots(beside: &mut Sums, own: &mut Sums, lines: &Lines<'_>, piece: Piece, bonds: &Bonds) {
    let (count, place) = (lines[1][1].len(), piece.place());
    if count < GROUP {
        (0..count).for_each(|at| sum_dashpots_at::<1>(beside, own, place, lines, at, bonds));
    } else {
        for from in (0..count).step_by(GROUP) {
            sum_dashpots_at::<GROUP>(beside, own, place, lines, from.min(count - GROUP), bonds);
        }
    }
    for end in piece.ends() {
        let Some((end, beyond, _)) = end else { continue };
        beside.0[beyond] = 0.0;
        own.0[end] += (1.0 + (bonds.across + bonds.up)) * lines[1][1][end - place];
    }
}

#[inline(always)]
fn sum_dashpots_at<const N: usize>(
    beside: &mut Sums,
    own: &mut Sums,
    place: usize,
    lines: &Lines<'_>,
    at: usize,
    bonds: &Bonds,
) {
    let count = 2.0 + 3.0 * (bonds.across + bonds.up) + bonds.diagonal;
    let v = group::<N>(lines, at);
    let (beside, own) = (&mut beside.0[place + at..][..N], &mut own.0[place + at..][..N]);
    for n in 0..N {
        let sides = (v[1][2][n] + v[1][0][n]) + (v[2][1][n] + v[0][1][n]);
        let diagonal = (v[2][2][n] + v[2][0][n]) + (v[0][2][n] + v[0][0][n]);
        beside[n] = v[1][1][n] + sides;
        own[n] = (sides + diagonal) - count * v[1][1][n];
    }
}

/// The pull on a piece from its parts: from the column behind what is ahead of it, and the other way round.
#[inline(always)]
fn add_parts(force_n: &mut [f64], own: &Sums, ahead: &Sums, behind: &Sums, factor: f64) {
    let count = force_n.len();
    if count < GROUP {
        (0..count).for_each(|at| add_parts_at::<1>(force_n, own, ahead, behind, factor, at));
    } else {
        for from in (0..count).step_by(GROUP) {
            add_parts_at::<GROUP>(force_n, own, ahead, behind, factor, from.min(count - GROUP));
        }
    }
}

#[inline(always)]
fn add_parts_at<const N: usize>(
    force_n: &mut [f64],
    own: &Sums,
    ahead: &Sums,
    behind: &Sums,
    factor: f64,
    at: usize,
) {
    let (force_n, own) = (&mut force_n[at..][..N], &own.0[FIRST + at..][..N]);
    let (ahead, behind) = (&ahead.0[FIRST + at + 1..][..N], &behind.0[FIRST + at - 1..][..N]);
    for n in 0..N {
        force_n[n] = factor * (own[n] + (ahead[n] + behind[n]));
    }
}
