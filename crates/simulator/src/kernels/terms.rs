//! The terms of a window: the first two differences of a state, and the polynomials of the unforced map
//! applied to the second.

use std::hint::select_unpredictable;
use std::ops::Range;

use asperity_model::body::elastic::Chain;
use asperity_model::body::ends::EndBond;

use crate::kernels::simd::{kernel, sign};

kernel! {
    /// Sets the direction of each sliding block and the friction spring of each stuck one, from
    /// its `k_t` and whether sliding is one-way. Returns whether every sliding block has a direction
    /// that it may keep.
    fn classify(sigma: &mut [f64], spring: &mut [f64], v: &[f64], slip: &[f64], kt: &[f64], one_way: bool) -> bool {
        let blocks = sigma.len();
        let (spring, v) = (&mut spring[..blocks], &v[..blocks]);
        let (slip, kt) = (&slip[..blocks], &kt[..blocks]);
        let mut undirected = 0u64;
        for n in 0..blocks {
            let slides = slip[n] != 0.0;
            let direction = sign(v[n]);
            sigma[n] = if slides { direction } else { 0.0 };
            spring[n] = if slides { 0.0 } else { kt[n] };
            let directed = if one_way { direction > 0.0 } else { direction != 0.0 };
            undirected |= u64::from(slides & !directed);
        }
        undirected == 0
    }
}

/// The inputs of a state's change in the next step, besides the force, or of the change of that.
pub(crate) struct Held<'a> {
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    /// Of no meaning for the change of a change.
    pub(crate) anchor: &'a [f64],
    pub(crate) drag: &'a [f64],
    pub(crate) spring: &'a [f64],
    pub(crate) sigma: &'a [f64],
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
}

kernel! {
    /// The change of a state in its next step. On entry `guard` has the force `tau`, on return the
    /// guard of the state.
    fn first_difference(d_u: &mut [f64], d_v: &mut [f64], guard: &mut [f64], held: &Held<'_>) {
        let blocks = d_u.len();
        let (d_v, guard) = (&mut d_v[..blocks], &mut guard[..blocks]);
        let &Held { u, v, anchor, drag, spring, sigma, dt, dt_over_m } = held;
        let (u, v, anchor) = (&u[..blocks], &v[..blocks], &anchor[..blocks]);
        let (drag, spring, sigma) = (&drag[..blocks], &spring[..blocks], &sigma[..blocks]);
        for n in 0..blocks {
            let friction = -spring[n] * (u[n] - anchor[n]) - drag[n] * sigma[n];
            d_v[n] = (guard[n] + friction) * dt_over_m;
            d_u[n] = (v[n] + d_v[n]) * dt;
            guard[n] = select_unpredictable(sigma[n] == 0.0, guard[n], v[n]);
        }
    }
}

kernel! {
    /// Subtracts the radiation damping of sliding blocks, those with a direction, from forces.
    fn radiate(force: &mut [f64], v: &[f64], sigma: &[f64], radiation: f64) {
        for ((force, v), sigma) in force.iter_mut().zip(v).zip(sigma) {
            *force -= select_unpredictable(*sigma == 0.0, 0.0, radiation * v);
        }
    }
}

kernel! {
    /// The change of the first difference in the next step, velocities in displacement per step. On
    /// entry `guard` has the change of the force, on return the guard of the first difference.
    fn second_difference(d_u: &mut [f64], d_v: &mut [f64], guard: &mut [f64], held: &Held<'_>) {
        let blocks = d_u.len();
        let (d_v, guard) = (&mut d_v[..blocks], &mut guard[..blocks]);
        let &Held { u, v, spring, sigma, dt, dt_over_m, .. } = held;
        let (u, v, spring, sigma) = (&u[..blocks], &v[..blocks], &spring[..blocks], &sigma[..blocks]);
        for n in 0..blocks {
            let change = (guard[n] - spring[n] * u[n]) * dt_over_m * dt;
            d_v[n] = change;
            d_u[n] = v[n] * dt + change;
            guard[n] = select_unpredictable(sigma[n] == 0.0, guard[n], v[n]);
        }
    }
}

/// Displacements, velocities and guards of the terms of a window, `pitch` numbers apart.
///
/// Velocities are in displacement per step, and forces in units in which stiffness and damping turn `u`
/// and `v` into `by` times the change of `v`.
pub(crate) struct Terms<'a> {
    pub(crate) u: &'a mut [f64],
    pub(crate) v: &'a mut [f64],
    pub(crate) guard: &'a mut [f64],
    pub(crate) pitch: usize,
}

/// The inputs of the terms after the first.
pub(crate) struct TermChain<'a> {
    /// Spring of each block; for sliding ones the drive's alone.
    pub(crate) spring: &'a [f64],
    /// 0 for stuck blocks, whose guard is the force; the guard of sliding blocks is the velocity.
    pub(crate) sigma: &'a [f64],
    /// Whether stuck blocks do not move at all.
    pub(crate) rigid: bool,
    /// Stiffness and damping in these units.
    pub(crate) springs: Chain,
    /// Radiation damping of sliding blocks in these units.
    pub(crate) radiation: f64,
    /// The drive's part of the springs, by block.
    pub(crate) driven: &'a [(usize, f64)],
    /// What joins the ends, in these units.
    pub(crate) at_ends: &'a [EndBond],
    /// The next term is `by` times the difference of this one, plus `stay` times this one, plus `back`
    /// (1 or -1) times the previous one. The first has half of that without the last part.
    pub(crate) by: f64,
    pub(crate) stay: f64,
    pub(crate) back: f64,
}

/// Computes each next term by the recurrence of the polynomials, and the guards of the terms. The strains of two terms
/// have a place on either side.
pub(crate) fn terms(rows: Terms<'_>, strains: [&mut [f64]; 2], chain: &TermChain<'_>, behind: Range<usize>) {
    let blocks = chain.sigma.len();
    let Terms { u, v, guard, pitch } = rows;
    let [mut now, mut next] = strains;
    let first = behind.start * pitch;
    let (of_u, of_v) = (&u[first..first + blocks], &v[first..first + blocks]);
    first_strains(now, of_u, of_v, &chain.springs);
    for bond in chain.at_ends {
        join_end(now, of_u, of_v, bond);
    }
    for j in behind {
        let (known_u, next_u) = u.split_at_mut((j + 1) * pitch);
        let (known_v, next_v) = v.split_at_mut((j + 1) * pitch);
        // The first term has no predecessor.
        let (at, before) = (j * pitch, j.saturating_sub(1) * pitch);
        let term = Term {
            u: &known_u[at..],
            v: &known_v[at..],
            before_u: &known_u[before..],
            before_v: &known_v[before..],
            strain: now,
            first: j == 0,
        };
        let guard = &mut guard[at..][..blocks];
        next_term(&mut next_u[..blocks], &mut next_v[..blocks], next, guard, &term, chain);
        // The own strains of free ends are repeated beyond them.
        (next[0], next[blocks + 1]) = (next[1], next[blocks]);
        for bond in chain.at_ends {
            join_end(next, next_u, next_v, bond);
        }
        // The drive's part of the guards of stuck blocks.
        for &(n, drive) in chain.driven {
            if chain.sigma[n] == 0.0 {
                guard[n] -= drive * term.u[n];
            }
        }
        std::mem::swap(&mut now, &mut next);
    }
}

/// Adds the pull of a bond at an end to the strain beyond it.
#[inline(always)]
fn join_end(strain: &mut [f64], u: &[f64], v: &[f64], bond: &EndBond) {
    let beyond = |block: usize| if block == 0 { 0 } else { block + 2 };
    let pull = bond.pull_of_changes(u, v);
    strain[beyond(bond.block)] += pull;
    if let Some(other) = bond.other {
        strain[beyond(other)] -= pull;
    }
}

/// The current term, and the one before it.
pub(crate) struct Term<'a> {
    u: &'a [f64],
    v: &'a [f64],
    before_u: &'a [f64],
    before_v: &'a [f64],
    /// `stiffness u + damping v` of each block, between its two neighbours. The values of the ends are
    /// repeated beyond them, which makes the ends free; the pull of what joins an end is added there.
    strain: &'a [f64],
    first: bool,
}

kernel! {
    /// The strains of a term.
    fn first_strains(strain: &mut [f64], u: &[f64], v: &[f64], springs: &Chain) {
        springs.strains(strain, u, v);
    }
}

kernel! {
    /// The next term, with its strains, and the guards of this one.
    fn next_term(
        next_u: &mut [f64],
        next_v: &mut [f64],
        next_strain: &mut [f64],
        guard: &mut [f64],
        term: &Term<'_>,
        chain: &TermChain<'_>,
    ) {
        match term.first || chain.rigid || chain.radiation > 0.0 {
            true => next_term_of::<false>(next_u, next_v, next_strain, guard, term, chain),
            false => next_term_of::<true>(next_u, next_v, next_strain, guard, term, chain),
        }
    }
}

/// The next term; `PLAIN` of springs alone behind the first, as most are, which takes half of the operations.
#[inline(always)]
fn next_term_of<const PLAIN: bool>(
    next_u: &mut [f64],
    next_v: &mut [f64],
    next_strain: &mut [f64],
    guard: &mut [f64],
    term: &Term<'_>,
    chain: &TermChain<'_>,
) {
    let blocks = next_u.len();
    let (next_v, guard) = (&mut next_v[..blocks], &mut guard[..blocks]);
    let [left, here, right] = [0, 1, 2].map(|from| &term.strain[from..][..blocks]);
    let next_here = &mut next_strain[1..][..blocks];
    let (u, v) = (&term.u[..blocks], &term.v[..blocks]);
    let (before_u, before_v) = (&term.before_u[..blocks], &term.before_v[..blocks]);
    let (spring, sigma) = (&chain.spring[..blocks], &chain.sigma[..blocks]);
    let &TermChain { springs, radiation, rigid, by, stay, .. } = chain;
    // The first term has no predecessor.
    let (share, back) = if !PLAIN && term.first { (0.5, 0.0) } else { (1.0, chain.back) };
    for n in 0..blocks {
        let stuck = sigma[n] == 0.0;
        let pull = Chain::pull_of_strains(left[n], here[n], right[n]);
        let mut change = pull - spring[n] * u[n];
        if !PLAIN {
            let force = change - select_unpredictable(stuck, 0.0, radiation * v[n]);
            change = select_unpredictable(rigid & stuck, 0.0, force);
        }
        let new_v = share * (change + (stay * v[n] + back * before_v[n]));
        let new_u = share * ((change + by * v[n]) + (stay * u[n] + back * before_u[n]));
        next_v[n] = new_v;
        next_u[n] = new_u;
        next_here[n] = springs.strain(new_u, new_v);
        guard[n] = select_unpredictable(stuck, pull, v[n]);
    }
}
