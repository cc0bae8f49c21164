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
    /// Rows, at least 2.
    pub(super) rows: usize,
    pub(super) stiffness_n_per_m: f64,
    pub(super) damping_kg_per_s: f64,
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

/// A row: the values to the left, at, and to the right of the nodes inside.
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

/// Nodes of a row that are computed at once. The last group of a row ends with the row and overlaps the one
/// before, repeating some of its work: a shorter group would be slower.
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

impl Plane {
    /// The nodes of a row, counted from 0.
    fn row(&self, row: usize) -> std::ops::Range<usize> {
        row * self.columns..(row + 1) * self.columns
    }

    /// The nodes of a row with those of the rows below and above it.
    #[inline(always)]
    fn rows_around(&self, row: usize) -> [std::ops::Range<usize>; 3] {
        let here = self.row(row);
        let below = if row > 0 { self.row(row - 1) } else { here.clone() };
        let above = if row + 1 < self.rows { self.row(row + 1) } else { here.clone() };
        [below, here, above]
    }

    /// The pull of springs between nodes on all freedoms.
    ///
    /// Always inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    pub(super) fn pull_of_springs(&self, force_n: &mut [f64], u: &[f64]) {
        let nodes = self.columns * self.rows;
        let (x_n, z_n) = force_n.split_at_mut(nodes);
        let u = u.split_at(nodes);
        for row in 0..self.rows {
            let [below, here, above] = self.rows_around(row);
            let stretch = [u.0, u.1].map(|of| [&of[below.clone()], &of[here.clone()], &of[above.clone()]]);
            let (x_n, z_n) = (&mut x_n[here.clone()], &mut z_n[here.clone()]);
            match (row > 0, row + 1 < self.rows) {
                (true, true) => self.springs_on_row::<true, true>(x_n, z_n, stretch),
                (true, false) => self.springs_on_row::<true, false>(x_n, z_n, stretch),
                (false, _) => self.springs_on_row::<false, true>(x_n, z_n, stretch),
            }
        }
    }

    /// The pull of dashpots between nodes on all freedoms; likewise inlined.
    #[inline(always)]
    pub(super) fn pull_of_dashpots(&self, force_n: &mut [f64], v: &[f64]) {
        let nodes = self.columns * self.rows;
        for (force_n, v) in force_n.chunks_exact_mut(nodes).zip(v.chunks_exact(nodes)) {
            for row in 0..self.rows {
                let [below, here, above] = self.rows_around(row);
                let force_n = &mut force_n[here.clone()];
                let v = [&v[below], &v[here], &v[above]];
                match (row > 0, row + 1 < self.rows) {
                    (true, true) => self.dashpots_on_row::<true, true>(force_n, v),
                    (true, false) => self.dashpots_on_row::<true, false>(force_n, v),
                    (false, _) => self.dashpots_on_row::<false, true>(force_n, v),
                }
            }
        }
    }

    /// The springs of one row, from the rows of `u_x` and `u_z` around it. A missing neighbour has no bond:
    /// it gets the node's own displacement, so it does not pull.
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

    /// Inside the row. A separate function, because only the arguments of a function let the compiler
    /// assume that output and input do not overlap, as vectorising requires.
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

    /// Inside the row; likewise a separate function.
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

    /// The pull of springs on a node along `x` and `z`. The order of summation makes the forces of a
    /// mirrored lattice mirror images, to the bit.
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

    /// The pull of dashpots on a node along `x` or `z`, likewise.
    #[inline(always)]
    fn dashpot_force_n(&self, v: &Around) -> f64 {
        let straight = (v.left + v.right) + (v.up + v.down);
        let diagonal = (v.rising[0] + v.rising[1]) + (v.falling[0] + v.falling[1]);
        self.damping_kg_per_s * ((straight + diagonal) - 8.0 * v.here)
    }
}
