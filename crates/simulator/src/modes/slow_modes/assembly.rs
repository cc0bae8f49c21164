//! Stiffness and damping of some motions of a lattice, as bands.
//!
//! With the nodes numbered along the shortest sides first, a node and its neighbours lie within two
//! cross-sections, which makes the matrices bands; they are stored by rows, up to the diagonal
//! ([`crate::kernels`], `band`).

use std::cmp::Reverse;

use asperity_model::Lattice;
use asperity_model::body::lattice::Bond;

use crate::modes::slow_modes::mirror::Motions;

/// Where the freedoms of some motions stand in a band.
#[derive(Debug)]
pub(crate) struct Assembly<'a> {
    lattice: &'a Lattice,
    /// For each freedom of the lattice, its place in the band and its part in the motion there.
    parts: Vec<Option<(usize, f64)>>,
    /// The place of each freedom of the motions.
    pub(crate) place: Vec<usize>,
    pub(crate) width: usize,
}

impl<'a> Assembly<'a> {
    pub(crate) fn of(lattice: &'a Lattice, motions: &Motions) -> Assembly<'a> {
        let parts = motions.parts(lattice.freedoms());
        let order = sides(lattice).map(|(axis, _)| axis);
        let key = |freedom: usize| {
            let place = lattice.place(freedom % lattice.nodes());
            (order.map(|axis| place[axis]), freedom / lattice.nodes())
        };
        // The first of two freedoms that mirror each other stands for both.
        let mut first = vec![usize::MAX; motions.size()];
        for (freedom, part) in parts.iter().enumerate() {
            if let Some((own, _)) = part {
                first[*own] = first[*own].min(freedom);
            }
        }
        let mut order: Vec<usize> = (0..motions.size()).collect();
        order.sort_by_key(|own| key(first[*own]));
        let mut place = vec![0; motions.size()];
        for (at, own) in order.into_iter().enumerate() {
            place[own] = at;
        }
        let placed = parts.into_iter().map(|part| part.map(|(own, part)| (place[own], part)));
        let mut assembly = Assembly { lattice, parts: placed.collect(), place, width: 1 };
        lattice.over_bonds(|bond| {
            let places = assembly.of_bond(&bond).map(|(place, ..)| place);
            let (first, last) = places.fold((usize::MAX, 0), |(a, b), place| (a.min(place), b.max(place)));
            if first <= last {
                assembly.width = assembly.width.max(last - first + 1);
            }
        });
        assembly
    }

    /// The freedoms at both ends of a bond, as places in the band: with their part in the motion there, their
    /// axis, and the sign of their end.
    fn of_bond(&self, bond: &Bond) -> impl Iterator<Item = (usize, f64, usize, f64)> + '_ {
        let (nodes, axes) = (self.lattice.nodes(), self.lattice.axes());
        let ends = [(bond.from, -1.0), (bond.to, 1.0)].into_iter();
        let freedoms =
            ends.flat_map(move |(node, sign)| (0..axes).map(move |axis| (axis, axis * nodes + node, sign)));
        freedoms.filter_map(|(axis, freedom, sign)| {
            self.parts[freedom].map(|(place, part)| (place, part, axis, sign))
        })
    }

    /// The matrix in which each bond joins each two of the freedoms at its ends by a function of the bond,
    /// of their axes and of the product of the signs of their ends.
    fn over_bonds(&self, of: impl Fn(&Bond, [usize; 2], f64) -> f64) -> Vec<f64> {
        let mut band = vec![0.0; self.place.len() * self.width];
        let mut joined = Vec::with_capacity(6);
        self.lattice.over_bonds(|bond| {
            joined.clear();
            joined.extend(self.of_bond(&bond));
            for (i, (at_i, part_i, axis_i, sign_i)) in joined.iter().enumerate() {
                for (j, (at_j, part_j, axis_j, sign_j)) in joined[..=i].iter().enumerate() {
                    // On the diagonal, one entry stands for both orders of freedoms that mirror each other.
                    let times = if i != j && at_i == at_j { 2.0 } else { 1.0 };
                    let value = of(&bond, [*axis_i, *axis_j], sign_i * sign_j);
                    band[self.at(*at_i, *at_j)] += times * (value * (part_i * part_j));
                }
            }
        });
        band
    }

    fn at(&self, a: usize, b: usize) -> usize {
        let (row, column) = (a.max(b), a.min(b));
        row * self.width + column + self.width - 1 - row
    }

    /// The stiffness, with springs that hold freedoms.
    pub(crate) fn stiffness(&self, held_n_per_m: impl Iterator<Item = (usize, f64)>) -> Vec<f64> {
        let mut band = self.over_bonds(|bond, [i, j], sign| {
            bond.stiffness_n_per_m * (sign * (bond.along[i] * bond.along[j]))
        });
        for (freedom, stiffness_n_per_m) in held_n_per_m {
            if let Some((place, part)) = self.parts[freedom] {
                band[self.at(place, place)] += stiffness_n_per_m * (part * part);
            }
        }
        band
    }

    /// The damping.
    pub(crate) fn damping(&self) -> Vec<f64> {
        let damping_kg_per_s = self.lattice.damping_kg_per_s;
        self.over_bonds(|_, [i, j], sign| if i == j { sign * damping_kg_per_s } else { 0.0 })
    }
}

/// The axes with their numbers of nodes, the longest first.
fn sides(lattice: &Lattice) -> [(usize, usize); 3] {
    let mut sides = [(0, lattice.columns), (2, lattice.rows), (1, lattice.lanes)];
    sides.sort_by_key(|(_, count)| Reverse(*count));
    sides
}

/// Numbers in a row of the band of all motions: a node and its neighbours lie within two cross-sections.
pub(crate) fn width(lattice: &Lattice) -> usize {
    let [_, (_, middle), (_, shortest)] = sides(lattice);
    lattice.axes() * (middle * shortest + shortest + 1)
}
