//! Motions that a lattice keeps apart because it is its own mirror image.
//!
//! With several nodes across, the mirror `y -> -y` maps the lattice onto itself. A motion that equals its
//! mirror image, *even*, stays so, and one that is reversed by it, *odd*, stays reversed. In an orthonormal basis of
//! such motions, `(a + b) / sqrt 2` and `(a - b) / sqrt 2` for two freedoms that mirror each other, stiffness
//! and damping consist of two blocks. Each has half of the freedoms; a factor of its stiffness takes an eighth of
//! the work and a quarter of the memory, and both together a quarter and a half. A run whose drive and contacts
//! are mirror images of themselves needs the even motions alone.

use std::cmp::Ordering;

use asperity_model::{Lattice, Plan};

/// `1 / sqrt 2`.
const ROOT_OF_HALF: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Motions of a lattice: all, or those that are even or odd.
#[derive(Debug, Clone)]
pub(crate) struct Motions {
    /// The freedoms of their own basis: each is one of the lattice, or that with the one that mirrors it and the sign of
    /// its part.
    basis: Vec<(usize, Option<(usize, f64)>)>,
}

impl Motions {
    /// All motions of a lattice, in the basis of its freedoms.
    pub(crate) fn all(lattice: &Lattice) -> Motions {
        Motions { basis: (0..lattice.freedoms()).map(|freedom| (freedom, None)).collect() }
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
        let of = |freedom: usize| {
            // A displacement across is reversed by the mirror.
            let is_across = lattice.table.axes[freedom / lattice.nodes()] == 1;
            let (sign, image) = (if is_across { -sign } else { sign }, mirror_image(lattice, freedom));
            match freedom.cmp(&image) {
                Ordering::Less => Some((freedom, Some((image, sign)))),
                Ordering::Equal => (sign > 0.0).then_some((freedom, None)),
                Ordering::Greater => None,
            }
        };
        Motions { basis: (0..lattice.freedoms()).filter_map(of).collect() }
    }

    /// Number of freedoms in their own basis.
    pub(crate) fn size(&self) -> usize {
        self.basis.len()
    }

    /// Whether their basis is that of the lattice's freedoms.
    pub(crate) fn are_all(&self) -> bool {
        // The first lane is mirrored by the last.
        self.basis.first().is_none_or(|(_, mirrored)| mirrored.is_none())
    }

    /// For each freedom of the lattice that has a part in them, the freedom of the basis, and the part.
    pub(crate) fn parts(&self, freedoms: usize) -> Vec<Option<(usize, f64)>> {
        let mut parts = vec![None; freedoms];
        for (own, (freedom, mirrored)) in self.basis.iter().enumerate() {
            parts[*freedom] = Some((own, mirrored.map_or(1.0, |_| ROOT_OF_HALF)));
            if let Some((image, sign)) = mirrored {
                parts[*image] = Some((own, sign * ROOT_OF_HALF));
            }
        }
        parts
    }

    /// The component of a motion of all freedoms that is one of these.
    pub(crate) fn component(&self, all: &[f64]) -> Vec<f64> {
        let own = self.basis.iter().map(|(freedom, mirrored)| match mirrored {
            None => all[*freedom],
            Some((image, sign)) => (all[*freedom] + sign * all[*image]) * ROOT_OF_HALF,
        });
        own.collect()
    }

    /// Adds a motion in this basis to one of all freedoms.
    pub(crate) fn add(&self, all: &mut [f64], own: &[f64]) {
        for ((freedom, mirrored), own) in self.basis.iter().zip(own) {
            match mirrored {
                None => all[*freedom] += own,
                Some((image, sign)) => {
                    all[*freedom] += ROOT_OF_HALF * own;
                    all[*image] += sign * ROOT_OF_HALF * own;
                }
            }
        }
    }

    /// Whether a motion has no component among these, to the bit.
    pub(crate) fn has_no_component(&self, all: &[f64]) -> bool {
        self.basis.iter().all(|(freedom, mirrored)| match mirrored {
            None => all[*freedom] == 0.0,
            Some((image, sign)) => all[*freedom] + sign * all[*image] == 0.0,
        })
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
    if let Some(given) = &plan.given {
        return given.mirrors;
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
        && odd.has_no_component(&initial.displacement_m)
        && odd.has_no_component(&initial.velocity_m_per_s)
}
