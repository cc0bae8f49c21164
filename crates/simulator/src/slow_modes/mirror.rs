//! Motions that a lattice keeps apart because it is its own mirror image.
//!
//! With several nodes across, the mirror `y -> -y` maps the lattice onto itself. A motion that equals its
//! mirror image, *even*, stays so, and likewise one that is reversed by it, *odd*. In an orthonormal basis of
//! such motions, `(a + b) / sqrt 2` and `(a - b) / sqrt 2` for two freedoms that mirror each other, stiffness
//! and damping consist of two blocks. Each has half of the freedoms; a factor of its stiffness takes an eighth of
//! the work and a quarter of the memory, and both together a quarter and a half. A run whose drive and contacts
//! are mirror images of themselves needs the even motions alone.

use std::borrow::Cow;

use asperity_model::{Lattice, Plan};

/// `1 / sqrt 2`.
const ROOT_OF_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Motions of a lattice: all, or those that are even or odd.
#[derive(Debug, Clone)]
pub(crate) struct Motions {
    /// Number of freedoms in its own basis.
    size: usize,
    /// Consecutive freedoms of that basis.
    stretches: Vec<Stretch>,
}

/// Freedoms along a line of nodes, with the line that mirrors them.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    own: usize,
    from: usize,
    count: usize,
    /// The mirrored freedoms, and the sign of their part; `None` where a freedom is a motion by itself.
    mirrored: Option<(usize, f64)>,
}

impl Motions {
    /// All motions of a lattice, in the basis of its freedoms.
    pub(crate) fn all(lattice: &Lattice) -> Motions {
        let size = lattice.freedoms();
        Motions { size, stretches: vec![Stretch { own: 0, from: 0, count: size, mirrored: None }] }
    }

    /// The classes of motions that a lattice keeps apart: even and odd ones, or all if it has one row across.
    pub(crate) fn kept_apart(lattice: &Lattice) -> Vec<Motions> {
        if lattice.lanes == 1 {
            return vec![Motions::all(lattice)];
        }
        [1.0, -1.0].map(|sign| Motions::of_sign(lattice, sign)).into()
    }

    /// Those that the mirror multiplies by a sign.
    fn of_sign(lattice: &Lattice, sign: f64) -> Motions {
        let (columns, lanes) = (lattice.columns, lattice.lanes);
        let mut motions = Motions { size: 0, stretches: Vec::new() };
        for (freedom, axis) in lattice.table.axes.iter().enumerate() {
            // A displacement across is reversed by the mirror.
            let sign = if *axis == 1 { -sign } else { sign };
            for row in 0..lattice.rows {
                for lane in 0..lanes.div_ceil(2) {
                    let line = |lane: usize| freedom * lattice.nodes() + (row * lanes + lane) * columns;
                    let other = lanes - 1 - lane;
                    if lane == other && sign < 0.0 {
                        continue;
                    }
                    let mirrored = (lane != other).then(|| (line(other), sign));
                    let stretch = Stretch { own: motions.size, from: line(lane), count: columns, mirrored };
                    motions.stretches.push(stretch);
                    motions.size += columns;
                }
            }
        }
        motions
    }

    /// Number of freedoms in its own basis.
    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Whether its basis is that of the lattice's freedoms.
    pub(crate) fn are_all(&self) -> bool {
        matches!(&self.stretches[..], [Stretch { mirrored: None, .. }])
    }

    /// For each freedom of the lattice that has a part in it, the freedom of the basis, and the part.
    pub(crate) fn parts(&self, freedoms: usize) -> Vec<Option<(usize, f64)>> {
        let mut parts = vec![None; freedoms];
        for stretch in &self.stretches {
            let (one, other) = stretch.factors();
            for n in 0..stretch.count {
                parts[stretch.from + n] = Some((stretch.own + n, one));
                if let Some((mirrored, _)) = stretch.mirrored {
                    parts[mirrored + n] = Some((stretch.own + n, other));
                }
            }
        }
        parts
    }

    /// The component of a motion of all freedoms that is one of these.
    pub(crate) fn fold(&self, all: &[f64]) -> Vec<f64> {
        let mut own = Vec::with_capacity(self.size);
        for stretch in &self.stretches {
            let of = &all[stretch.from..][..stretch.count];
            match stretch.mirrored {
                None => own.extend_from_slice(of),
                Some((mirrored, sign)) => {
                    let pairs = of.iter().zip(&all[mirrored..][..stretch.count]);
                    own.extend(pairs.map(|(a, b)| (a + sign * b) * ROOT_OF_HALF));
                }
            }
        }
        own
    }

    /// [`Motions::fold`] without a copy of all freedoms.
    pub(crate) fn component<'a>(&self, all: &'a [f64]) -> Cow<'a, [f64]> {
        if self.are_all() { Cow::Borrowed(all) } else { Cow::Owned(self.fold(all)) }
    }

    /// Adds a motion in this basis to one of all freedoms.
    pub(crate) fn add(&self, all: &mut [f64], own: &[f64]) {
        for stretch in &self.stretches {
            let own = &own[stretch.own..][..stretch.count];
            let (one, other) = stretch.factors();
            for (all, own) in all[stretch.from..][..stretch.count].iter_mut().zip(own) {
                *all += one * own;
            }
            let Some((mirrored, _)) = stretch.mirrored else { continue };
            for (all, own) in all[mirrored..][..stretch.count].iter_mut().zip(own) {
                *all += other * own;
            }
        }
    }

    /// Whether a motion has no component among these, to the bit.
    pub(crate) fn lack(&self, all: &[f64]) -> bool {
        self.stretches.iter().all(|stretch| {
            let of = &all[stretch.from..][..stretch.count];
            match stretch.mirrored {
                None => of.iter().all(|x| *x == 0.0),
                Some((mirrored, sign)) => {
                    of.iter().zip(&all[mirrored..][..stretch.count]).all(|(a, b)| a + sign * b == 0.0)
                }
            }
        })
    }
}

impl Stretch {
    /// How large a motion of size 1 is along its two lines.
    fn factors(&self) -> (f64, f64) {
        self.mirrored.map_or((1.0, 0.0), |(_, sign)| (ROOT_OF_HALF, sign * ROOT_OF_HALF))
    }
}

/// The freedom that mirrors one.
pub(crate) fn mirror_image(lattice: &Lattice, freedom: usize) -> usize {
    let node = freedom % lattice.nodes();
    let [_, lane, _] = lattice.place(node);
    freedom + (lattice.lanes - 1 - lane) * lattice.columns - lane * lattice.columns
}

/// Whether the contacts of a plan and its start equal their mirror images, to the bit. A run that goes on from
/// another takes what the other one took; any other given state is taken to have no symmetry.
pub(crate) fn mirrors_itself(plan: &Plan, lattice: &Lattice) -> bool {
    if let Some(carried) = &plan.initial.carried {
        return carried.solver.as_ref().is_some_and(|solver| solver.mirrors);
    }
    let (columns, lanes) = (lattice.columns, lattice.lanes);
    let of_contacts = |values: &[f64]| {
        let line = |lane: usize| values.get(lane * columns..(lane + 1) * columns);
        (0..lanes).all(|lane| line(lane) == line(lanes - 1 - lane))
    };
    let friction = &plan.friction;
    let arrays = [
        &friction.static_coefficients,
        &friction.dynamic_coefficients,
        &plan.normal_load_n,
        &plan.top_load_n,
    ];
    let initial = &plan.initial;
    let odd = Motions::of_sign(lattice, -1.0);
    arrays.into_iter().all(|values| of_contacts(values))
        && odd.lack(&initial.displacement_m)
        && odd.lack(&initial.velocity_m_per_s)
}
