//! Sweeps over the blocks, which steps, windows and jumps are made of, compiled for
//! the instruction sets that a machine may have.
//!
//! They are functions of slices: from their arguments the compiler knows that
//! the arrays do not overlap, which it must know to vectorise them. Every block
//! is computed on its own, with the same operations in the same order, and
//! multiplication and addition are never fused, so all versions give the same
//! bits. Where stuck and sliding blocks differ, both are computed and one is selected:
//! an `if` would be compiled to a branch, or to stores under a mask, which some
//! processors are slow at.

use std::hint::select_unpredictable;
use std::ops::Range;

/// The sweeps, in the version that this machine runs fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sweeps {
    /// What every machine has.
    Baseline,
    /// 256-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Writes the dispatcher of a sweep, and its compilation for each instruction set.
macro_rules! dispatch {
    ($(#[$doc:meta])* $name:ident($($argument:ident: $type:ty),*) $(-> $result:ty)?) => {
        $(#[$doc])*
        pub(crate) fn $name(self, $($argument: $type),*) $(-> $result)? {
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx2")]
                fn avx2($($argument: $type),*) $(-> $result)? {
                    $name($($argument),*)
                }
                #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
                fn avx512($($argument: $type),*) $(-> $result)? {
                    $name($($argument),*)
                }
                #[expect(unsafe_code, reason = "only constructed by `available`, which asked the processor")]
                match self {
                    Sweeps::Baseline => {}
                    Sweeps::Avx2 => return unsafe { avx2($($argument),*) },
                    Sweeps::Avx512 => return unsafe { avx512($($argument),*) },
                }
            }
            $name($($argument),*)
        }
    };
}

impl Sweeps {
    /// All versions that this machine can run, the fastest last.
    pub(crate) fn available() -> Vec<Sweeps> {
        let mut versions = vec![Sweeps::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                versions.push(Sweeps::Avx2);
            }
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512vl")
                && std::arch::is_x86_feature_detected!("avx512dq")
            {
                versions.push(Sweeps::Avx512);
            }
        }
        versions
    }

    /// The fastest version that this machine can run.
    pub(crate) fn detect() -> Sweeps {
        *Sweeps::available().last().expect("every machine can run the baseline")
    }

    dispatch! {
        /// `tau_n = k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1})`
        /// with free ends (5.6, 5.7).
        pull_of_neighbours(tau: &mut [f64], u: &[f64], v: &[f64], k: f64, eta: f64)
    }

    dispatch! {
        /// One step: `tau` as [`Sweeps::pull_of_neighbours`] has it and the driving forces on
        /// the first and the last block, friction, new velocities and positions (4.13, 4.14);
        /// whether any block may switch.
        step(u_new: &mut [f64], v_new: &mut [f64], tau: &mut [f64], old: &Blocks<'_>, constants: &Constants) -> bool
    }

    dispatch! {
        /// The same with driving forces on all blocks.
        step_driven_everywhere(
            u_new: &mut [f64],
            v_new: &mut [f64],
            tau: &mut [f64],
            old: &Blocks<'_>,
            constants: &Constants
        ) -> bool
    }

    dispatch! {
        /// The same by the laws without friction springs: stuck blocks do not move.
        rigid_step(u_new: &mut [f64], v_new: &mut [f64], tau: &mut [f64], old: &Blocks<'_>, constants: &Constants) -> bool
    }

    dispatch! {
        /// Sets the bit of every block that switches in a step, or may where contacts age: 64
        /// blocks to a number.
        switching(marks: &mut [u64], after: &After<'_>)
    }

    /// In a basis of polynomials of the map without forcing, the term behind each of these, and
    /// the guards of these.
    pub(crate) fn terms(
        self,
        rows: Terms<'_>,
        strains: [&mut [f64]; 2],
        chain: &TermChain<'_>,
        behind: Range<usize>,
    ) {
        // A term stays a function of its own: only of a function's arguments is it known
        // that they do not overlap.
        macro_rules! version {
            ($(#[$feature:meta])?) => {{
                $(#[$feature])?
                #[inline(never)]
                fn next(
                    u: &mut [f64],
                    v: &mut [f64],
                    strain: &mut [f64],
                    guard: &mut [f64],
                    term: &Term<'_>,
                    chain: &TermChain<'_>,
                ) {
                    match (term.first, chain.back > 0.0, chain.rigid) {
                        (true, _, false) => next_term::<FIRST, false>(u, v, strain, guard, term, chain),
                        (true, _, true) => next_term::<FIRST, true>(u, v, strain, guard, term, chain),
                        (_, true, false) => next_term::<PLUS, false>(u, v, strain, guard, term, chain),
                        (_, true, true) => next_term::<PLUS, true>(u, v, strain, guard, term, chain),
                        (_, false, false) => next_term::<MINUS, false>(u, v, strain, guard, term, chain),
                        (_, false, true) => next_term::<MINUS, true>(u, v, strain, guard, term, chain),
                    }
                }
                $(#[$feature])?
                fn all(rows: Terms<'_>, strains: [&mut [f64]; 2], chain: &TermChain<'_>, behind: Range<usize>) {
                    terms(rows, strains, chain, behind, |u, v, strain, guard, term| {
                        next(u, v, strain, guard, term, chain);
                    });
                }
                all
            }};
        }
        #[cfg(target_arch = "x86_64")]
        #[expect(unsafe_code, reason = "only constructed by `available`, which asked the processor")]
        match self {
            Sweeps::Baseline => {}
            Sweeps::Avx2 => {
                return unsafe { version!(#[target_feature(enable = "avx2")])(rows, strains, chain, behind) };
            }
            Sweeps::Avx512 => {
                return unsafe {
                    version!(#[target_feature(enable = "avx512f,avx512vl,avx512dq")])(
                        rows, strains, chain, behind,
                    )
                };
            }
        }
        version!()(rows, strains, chain, behind);
    }

    dispatch! {
        /// Multiplies by a number.
        scale(values: &mut [f64], by: f64)
    }

    dispatch! {
        /// Direction of each sliding block, friction spring of each stuck one, with
        /// `k_t` and whether sliding is one-way; whether every sliding block has a
        /// direction that it may keep.
        sort(sigma: &mut [f64], spring: &mut [f64], v: &[f64], slip: &[f64], law: &[f64; 2]) -> bool
    }

    dispatch! {
        /// The change of a state in its next step, from the force `tau` in `guard`, which
        /// becomes the guard of the state.
        first_difference(d_u: &mut [f64], d_v: &mut [f64], guard: &mut [f64], held: &Held<'_>)
    }

    dispatch! {
        /// The change of that in the next step, velocities in displacement per step, from
        /// the change of the force in `guard`, which becomes the guard of the first change.
        second_difference(d_u: &mut [f64], d_v: &mut [f64], guard: &mut [f64], second: &Second<'_>)
    }

    dispatch! {
        /// Turns sums of terms, in units, into values: adds `now` and `steps` times `rate`.
        add_course(values: &mut [f64], now: &[f64], rate: &[f64], steps: f64, unit: f64)
    }

    dispatch! {
        /// How far each block stays from switching over a window; whether any does
        /// not, by the bounds.
        margins(kept: &mut [f64], course: &Course<'_>) -> bool
    }

    dispatch! {
        /// `sum_n x_n u_n`, `sum_n x_n v_n` and `sum_n x_n^2` of eight waves over all blocks but
        /// the first, and `x` of the first two.
        wave_sums(sums: &mut WaveSums, wave: &Lanes, u: &[f64], v: &[f64])
    }

    dispatch! {
        /// Adds eight waves to displacements, velocities and, in magnitude, forces;
        /// `x` of the first two blocks.
        add_waves(u: &mut [f64], v: &mut [f64], force: &mut [f64], waves: &Waves8) -> [Lanes; 2]
    }

    dispatch! {
        /// Matrix times vector, the matrix column by column, columns added in
        /// ascending order.
        multiply(product: &mut [f64], matrix: &[f64], vector: &[f64])
    }

    dispatch! {
        /// The largest magnitude.
        largest(values: &[f64]) -> f64
    }

    dispatch! {
        /// `sum_j value_j term_j` and `sum_j bound_j |term_j|`, the highest first; the terms
        /// `pitch` numbers apart.
        follow(values: &mut [f64], bounds: &mut [f64], terms: &[f64], pitch: usize, coefficients: [&[f64]; 2])
    }

    dispatch! {
        /// `sum_j a_j x_j` and `sum_j b_j |x_j|`, in four lanes.
        products(x: &[f64], a: &[f64], b: &[f64]) -> [f64; 2]
    }

    dispatch! {
        /// `sum_j coefficient_j term_j`, the highest first; the terms `pitch` numbers apart.
        combine(sum: &mut [f64], terms: &[f64], pitch: usize, coefficients: &[f64])
    }

    dispatch! {
        /// Steps until the first guard would reach its limit at its present rate.
        first_crossing(guarded: &Guarded<'_>) -> f64
    }

    dispatch! {
        /// The same from the forces and velocities of two steps; thresholds fall by the share
        /// `decline` in each.
        crossing_ahead(steps: &Steps<'_>, slip: &[f64], threshold: &[f64], decline: f64) -> f64
    }

    dispatch! {
        /// The chain's part of `I(u, v)`, with mass, stiffness, damping and time step.
        invariant(spring: &[f64], u: &[f64], v: &[f64], constants: &[f64; 4]) -> f64
    }
}

/// What a step depends on, one value per block.
pub(crate) struct Blocks<'a> {
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) u_stick: &'a [f64],
    pub(crate) slip: &'a [f64],
    pub(crate) threshold: &'a [f64],
    pub(crate) sliding_friction: &'a [f64],
    pub(crate) driving_force: &'a [f64],
}

#[derive(Debug, Clone)]
pub(crate) struct Constants {
    pub(crate) k: f64,
    pub(crate) eta: f64,
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
    pub(crate) kt: f64,
    pub(crate) two_way: bool,
    /// `1 / v_c` and `E`, of the laws without friction springs.
    pub(crate) weakening: f64,
    pub(crate) radiation: f64,
}

/// `k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1})`, free ends.
#[inline(always)]
fn pull_of_neighbours(tau: &mut [f64], u: &[f64], v: &[f64], k: f64, eta: f64) {
    let last = tau.len() - 1;
    let inner = last.saturating_sub(1);
    let [u_left, u_here, u_right] = [0, 1, 2].map(|from| &u[from..][..inner]);
    let [v_left, v_here, v_right] = [0, 1, 2].map(|from| &v[from..][..inner]);
    let tau_here = &mut tau[1..][..inner];
    for n in 0..inner {
        tau_here[n] =
            k * (u_right[n] - 2.0 * u_here[n] + u_left[n]) + eta * (v_right[n] - 2.0 * v_here[n] + v_left[n]);
    }
    tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
    tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
}

/// Forces, friction, new velocities and positions; whether any block switches.
#[inline(always)]
fn step(
    u_new: &mut [f64],
    v_new: &mut [f64],
    tau: &mut [f64],
    old: &Blocks<'_>,
    constants: &Constants,
) -> bool {
    take_step::<false>(u_new, v_new, tau, old, constants)
}

#[inline(always)]
fn step_driven_everywhere(
    u_new: &mut [f64],
    v_new: &mut [f64],
    tau: &mut [f64],
    old: &Blocks<'_>,
    constants: &Constants,
) -> bool {
    take_step::<true>(u_new, v_new, tau, old, constants)
}

#[inline(always)]
fn take_step<const EVERYWHERE: bool>(
    u_new: &mut [f64],
    v_new: &mut [f64],
    tau: &mut [f64],
    old: &Blocks<'_>,
    constants: &Constants,
) -> bool {
    let tau = &mut tau[..u_new.len()];
    pull_of_neighbours(tau, old.u, old.v, constants.k, constants.eta);
    let (last, driving_force) = (tau.len() - 1, old.driving_force);
    if EVERYWHERE {
        for (tau, force) in tau.iter_mut().zip(driving_force) {
            *tau += force;
        }
    } else {
        tau[0] += driving_force[0];
        tau[last] += driving_force[last];
    }
    if constants.two_way {
        move_blocks::<true>(u_new, v_new, tau, old, constants)
    } else {
        move_blocks::<false>(u_new, v_new, tau, old, constants)
    }
}

/// Friction, new velocities and positions from the forces; whether any block may switch.
#[inline(always)]
fn move_blocks<const TWO_WAY: bool>(
    u_new: &mut [f64],
    v_new: &mut [f64],
    tau: &[f64],
    old: &Blocks<'_>,
    constants: &Constants,
) -> bool {
    let &Constants { dt, dt_over_m, kt, .. } = constants;
    let blocks = u_new.len();
    let (v_new, tau) = (&mut v_new[..blocks], &tau[..blocks]);
    let Blocks { u, v, u_stick, slip, threshold, sliding_friction, .. } = *old;
    let (u, v, u_stick, slip) = (&u[..blocks], &v[..blocks], &u_stick[..blocks], &slip[..blocks]);
    let (threshold, sliding_friction) = (&threshold[..blocks], &sliding_friction[..blocks]);
    // By how much each block is beyond where it switches: negative for all if none does,
    // which their sign bits tell.
    let mut beyond = u64::MAX;
    for n in 0..blocks {
        let slides = slip[n] != 0.0;
        let spring = kt * (u[n] - u_stick[n]);
        let drag = select_unpredictable(v[n] == 0.0, 0.0, sliding_friction[n].copysign(v[n]));
        let friction = select_unpredictable(slides, drag, spring);

        let new_v = v[n] + (tau[n] - friction) * dt_over_m;
        v_new[n] = new_v;
        u_new[n] = u[n] + new_v * dt;

        let detached_by = tau[n].abs() - threshold[n];
        let turned_by = if TWO_WAY { 0.0 - new_v * v[n] } else { 0.0 - new_v };
        beyond &= select_unpredictable(slides, turned_by, detached_by).to_bits();
    }
    is_positive(beyond)
}

#[inline(always)]
fn rigid_step(
    u_new: &mut [f64],
    v_new: &mut [f64],
    tau: &mut [f64],
    old: &Blocks<'_>,
    constants: &Constants,
) -> bool {
    let &Constants { k, eta, dt, dt_over_m, weakening, radiation, .. } = constants;
    let blocks = u_new.len();
    pull_of_neighbours(tau, old.u, old.v, k, eta);
    let (v_new, tau) = (&mut v_new[..blocks], &mut tau[..blocks]);
    let Blocks { u, v, slip, threshold, sliding_friction, driving_force, .. } = *old;
    let (u, v, slip) = (&u[..blocks], &v[..blocks], &slip[..blocks]);
    let (threshold, sliding_friction) = (&threshold[..blocks], &sliding_friction[..blocks]);
    let driving_force = &driving_force[..blocks];
    let mut beyond = u64::MAX;
    for n in 0..blocks {
        tau[n] += driving_force[n];
        let slides = slip[n] != 0.0;
        let drag = select_unpredictable(v[n] == 0.0, 0.0, sliding_friction[n].copysign(v[n]));
        let friction = drag / (1.0 + v[n].abs() * weakening) + radiation * v[n];
        // What is stuck is held by just as much as pulls.
        let force = select_unpredictable(slides, tau[n] - friction, 0.0);

        let new_v = v[n] + force * dt_over_m;
        v_new[n] = new_v;
        u_new[n] = u[n] + new_v * dt;

        let detached_by = tau[n].abs() - threshold[n];
        let turned_by = 0.0 - new_v * v[n];
        beyond &= select_unpredictable(slides, turned_by, detached_by).to_bits();
    }
    is_positive(beyond)
}

/// Whether the sign bit is clear: of bits of which all are set that every number had, whether
/// any of them was 0 or above.
#[inline(always)]
fn is_positive(bits: u64) -> bool {
    bits >> 63 == 0
}

/// A step that has been taken, but for its switches.
pub(crate) struct After<'a> {
    pub(crate) slip: &'a [f64],
    /// Before the step and after it.
    pub(crate) v: &'a [f64],
    pub(crate) v_new: &'a [f64],
    pub(crate) tau: &'a [f64],
    pub(crate) threshold: &'a [f64],
    pub(crate) two_way: bool,
    pub(crate) rigid: bool,
}

#[inline(always)]
fn switching(marks: &mut [u64], after: &After<'_>) {
    let &After { slip, v, v_new, tau, threshold, two_way, rigid } = after;
    for (group, mark) in marks.iter_mut().enumerate() {
        let from = group * 64;
        let to = slip.len().min(from + 64);
        let (slip, v, v_new) = (&slip[from..to], &v[from..to], &v_new[from..to]);
        let (tau, threshold) = (&tau[from..to], &threshold[from..to]);
        let mut bits = 0u64;
        for n in 0..slip.len() {
            let slides = slip[n] != 0.0;
            let rests = if rigid { stops(v[n], v_new[n]) } else { comes_to_rest(v[n], v_new[n], two_way) };
            let detaches = tau[n].abs() >= threshold[n];
            bits |= u64::from((slides & rests) | (!slides & detaches)) << n;
        }
        *mark = bits;
    }
}

/// Displacements, velocities and guards of the terms of a window, `pitch` numbers apart.
///
/// Velocities are in displacement per step, and forces in units in which stiffness
/// and damping turn `u` and `v` into `by` times the change of `v`.
pub(crate) struct Terms<'a> {
    pub(crate) u: &'a mut [f64],
    pub(crate) v: &'a mut [f64],
    pub(crate) guard: &'a mut [f64],
    pub(crate) pitch: usize,
}

/// What terms depend on besides the first of them.
pub(crate) struct TermChain<'a> {
    /// Spring of each block: 0 for sliding ones, but for the drive.
    pub(crate) spring: &'a [f64],
    /// 0 for stuck blocks, whose guard is the force; that of others is the velocity.
    pub(crate) sigma: &'a [f64],
    /// Whether stuck blocks do not move at all.
    pub(crate) rigid: bool,
    pub(crate) stiffness: f64,
    pub(crate) damping: f64,
    /// The drive's part of the springs, by block.
    pub(crate) driven: &'a [(usize, f64)],
    /// The next term is `by` times the difference of this one, `stay` times this one
    /// and `back`, 1 or -1, times the one before; the first is half of that but for the last.
    pub(crate) by: f64,
    pub(crate) stay: f64,
    pub(crate) back: f64,
}

/// `strain` is scratch: the strains of two terms, with a place on either side.
#[inline(always)]
fn terms(
    rows: Terms<'_>,
    strains: [&mut [f64]; 2],
    chain: &TermChain<'_>,
    behind: Range<usize>,
    next_term: impl Fn(&mut [f64], &mut [f64], &mut [f64], &mut [f64], &Term<'_>),
) {
    let blocks = chain.sigma.len();
    let Terms { u, v, guard, pitch } = rows;
    let [mut now, mut next] = strains;
    let first = behind.start * pitch;
    strain(now, &u[first..first + blocks], &v[first..first + blocks], chain.stiffness, chain.damping);
    for j in behind {
        let (known_u, next_u) = u.split_at_mut((j + 1) * pitch);
        let (known_v, next_v) = v.split_at_mut((j + 1) * pitch);
        // The first has none before it.
        let before = j.saturating_sub(1) * pitch;
        let term = Term {
            u: &known_u[j * pitch..],
            v: &known_v[j * pitch..],
            before_u: &known_u[before..],
            before_v: &known_v[before..],
            strain: now,
            first: j == 0,
        };
        let (next_u, next_v) = (&mut next_u[..blocks], &mut next_v[..blocks]);
        next_term(next_u, next_v, next, &mut guard[j * pitch..][..blocks], &term);
        std::mem::swap(&mut now, &mut next);
    }
}

/// The term before the next, and the one before that.
struct Term<'a> {
    u: &'a [f64],
    v: &'a [f64],
    before_u: &'a [f64],
    before_v: &'a [f64],
    /// `stiffness u + damping v` of each block, between its two neighbours; the ends' own
    /// values stand again beyond them, which makes them free.
    strain: &'a [f64],
    first: bool,
}

/// What becomes of the term before in the next: there is none, it is added, it is subtracted.
const FIRST: i8 = 0;
const PLUS: i8 = 1;
const MINUS: i8 = -1;

#[inline(always)]
fn next_term<const BACK: i8, const RIGID: bool>(
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
    let &TermChain { stiffness, damping, by, stay, .. } = chain;
    for n in 0..blocks {
        let pull = (right[n] + left[n]) - 2.0 * here[n];
        let mut change = pull - spring[n] * u[n];
        if RIGID {
            change = select_unpredictable(sigma[n] == 0.0, 0.0, change);
        }
        let go_on = |change: f64, stays: f64, before: f64| match BACK {
            FIRST => 0.5 * (change + stays),
            PLUS => change + (stays + before),
            _ => change + (stays - before),
        };
        let new_v = go_on(change, stay * v[n], before_v[n]);
        let new_u = go_on(change + by * v[n], stay * u[n], before_u[n]);
        next_v[n] = new_v;
        next_u[n] = new_u;
        next_here[n] = stiffness * new_u + damping * new_v;
        guard[n] = select_unpredictable(sigma[n] == 0.0, pull, v[n]);
    }
    for &(n, drive) in chain.driven {
        if sigma[n] == 0.0 {
            guard[n] -= drive * u[n];
        }
    }
    next_strain[0] = next_strain[1];
    next_strain[blocks + 1] = next_strain[blocks];
}

/// `stiffness u + damping v`, with the ends' own values beyond them.
#[inline(always)]
fn strain(result: &mut [f64], u: &[f64], v: &[f64], stiffness: f64, damping: f64) {
    let blocks = u.len();
    let (v, result) = (&v[..blocks], &mut result[..blocks + 2]);
    for n in 0..blocks {
        result[n + 1] = stiffness * u[n] + damping * v[n];
    }
    result[0] = result[1];
    result[blocks + 1] = result[blocks];
}

/// Multiplies by a number.
#[inline(always)]
fn scale(values: &mut [f64], by: f64) {
    for value in values {
        *value *= by;
    }
}

#[inline(always)]
fn sort(sigma: &mut [f64], spring: &mut [f64], v: &[f64], slip: &[f64], law: &[f64; 2]) -> bool {
    let blocks = sigma.len();
    let (spring, v, slip) = (&mut spring[..blocks], &v[..blocks], &slip[..blocks]);
    let &[kt, one_way] = law;
    let mut undirected = 0u64;
    for n in 0..blocks {
        let slides = slip[n] != 0.0;
        let direction = sign(v[n]);
        sigma[n] = if slides { direction } else { 0.0 };
        spring[n] = if slides { 0.0 } else { kt };
        let directed = if one_way != 0.0 { direction > 0.0 } else { direction != 0.0 };
        undirected |= u64::from(slides & !directed);
    }
    undirected == 0
}

/// What a state's change in the next step depends on besides the force.
pub(crate) struct Held<'a> {
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) anchor: &'a [f64],
    pub(crate) drag: &'a [f64],
    pub(crate) spring: &'a [f64],
    pub(crate) sigma: &'a [f64],
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
}

#[inline(always)]
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

/// What a second difference depends on besides the change of the force.
pub(crate) struct Second<'a> {
    pub(crate) u: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) spring: &'a [f64],
    pub(crate) sigma: &'a [f64],
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
}

#[inline(always)]
fn second_difference(d_u: &mut [f64], d_v: &mut [f64], guard: &mut [f64], second: &Second<'_>) {
    let blocks = d_u.len();
    let (d_v, guard) = (&mut d_v[..blocks], &mut guard[..blocks]);
    let &Second { u, v, spring, sigma, dt, dt_over_m } = second;
    let (u, v, spring, sigma) = (&u[..blocks], &v[..blocks], &spring[..blocks], &sigma[..blocks]);
    for n in 0..blocks {
        let change = (guard[n] - spring[n] * u[n]) * dt_over_m * dt;
        d_v[n] = change;
        d_u[n] = v[n] * dt + change;
        guard[n] = select_unpredictable(sigma[n] == 0.0, guard[n], v[n]);
    }
}

#[inline(always)]
fn add_course(values: &mut [f64], now: &[f64], rate: &[f64], steps: f64, unit: f64) {
    let (now, rate) = (&now[..values.len()], &rate[..values.len()]);
    for n in 0..values.len() {
        values[n] = now[n] + (steps * rate[n] + unit * values[n]);
    }
}

/// What bounds keep in reserve for what is left out and for rounding, for one
/// length of window: of forces of stuck blocks and velocities of sliding ones.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reserve {
    /// Added to second differences.
    pub(crate) stuck_bend: f64,
    pub(crate) sliding_bend: f64,
    /// Kept from the limit.
    pub(crate) stuck: f64,
    pub(crate) sliding: f64,
    /// Share of a threshold that counts.
    pub(crate) share: f64,
}

/// Guards over a window.
pub(crate) struct Course<'a> {
    pub(crate) now: &'a [f64],
    pub(crate) rate: &'a [f64],
    /// What its end adds to now and the rate.
    pub(crate) sum: &'a [f64],
    /// Bound on second differences.
    pub(crate) bend: &'a [f64],
    /// Units of these two, for stuck and for sliding blocks.
    pub(crate) stuck_unit: f64,
    pub(crate) sliding_unit: f64,
    pub(crate) sigma: &'a [f64],
    /// Thresholds at the start, and what they are at the end over that.
    pub(crate) threshold: &'a [f64],
    pub(crate) decline: f64,
    pub(crate) steps: f64,
    pub(crate) reserve: &'a Reserve,
}

/// How far a guard stays from its limit on the way from `from` to `to`, by the better
/// of two bounds: the chord, and the tangent, which ends at `tangent`. The threshold goes
/// straight from the first to the second.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "numbers of one block, in registers")]
pub(crate) fn margin(
    from: f64,
    to: f64,
    tangent: f64,
    steps: f64,
    bend: f64,
    sigma: f64,
    [threshold, last_threshold]: [f64; 2],
    reserve: &Reserve,
) -> f64 {
    let stuck = sigma == 0.0;
    let more_bend = select_unpredictable(stuck, reserve.stuck_bend, reserve.sliding_bend);
    let limit = select_unpredictable(stuck, -reserve.stuck, -reserve.sliding);
    let (first, last) = (reserve.share * threshold, reserve.share * last_threshold);
    // Distance from the limit, but for the reserve: of what is stuck, how much force is
    // missing; of what slides, how much velocity there is.
    macro_rules! clear {
        ($limit:expr, $guard:expr) => {
            select_unpredictable(stuck, $limit - $guard.abs(), sigma * $guard)
        };
    }
    let sag = (bend + more_bend) * steps * steps / 8.0;
    let (start, end) = (clear!(first, from), clear!(last, to));
    let straight = clear!(last, tangent) - 4.0 * sag;
    let chord = if start < end { start } else { end } - sag;
    let tangent = if start < straight { start } else { straight };
    limit + if tangent > chord { tangent } else { chord }
}

#[inline(always)]
fn margins(kept: &mut [f64], course: &Course<'_>) -> bool {
    let blocks = kept.len();
    let &Course { now, rate, sum, bend, stuck_unit, sliding_unit, sigma, threshold, decline, steps, reserve } =
        course;
    let (now, rate, sum, bend) = (&now[..blocks], &rate[..blocks], &sum[..blocks], &bend[..blocks]);
    let (sigma, threshold) = (&sigma[..blocks], &threshold[..blocks]);
    let mut any = 0u64;
    for n in 0..blocks {
        let tangent = now[n] + steps * rate[n];
        let unit = select_unpredictable(sigma[n] == 0.0, stuck_unit, sliding_unit);
        let (end, bend) = (tangent + unit * sum[n], unit * bend[n]);
        let thresholds = [threshold[n], threshold[n] * decline];
        let margin = margin(now[n], end, tangent, steps, bend, sigma[n], thresholds, reserve);
        kept[n] = margin;
        // Written so that what is not a number is a doubt.
        let stays = margin > 0.0;
        any |= u64::from(!stays);
    }
    any != 0
}

/// Guards of blocks, and where they switch.
pub(crate) struct Guarded<'a> {
    pub(crate) now: &'a [f64],
    pub(crate) rate: &'a [f64],
    pub(crate) sigma: &'a [f64],
    /// Thresholds of stuck blocks, and the share of them by which they fall in a step.
    pub(crate) limit: &'a [f64],
    pub(crate) decline: f64,
}

#[inline(always)]
fn first_crossing(guarded: &Guarded<'_>) -> f64 {
    let blocks = guarded.now.len();
    let &Guarded { now, rate, sigma, limit, decline } = guarded;
    let (rate, sigma, limit) = (&rate[..blocks], &sigma[..blocks], &limit[..blocks]);
    let mut first = NEVER;
    for n in 0..blocks {
        first = first.min(crossing(now[n], rate[n], sigma[n], limit[n], decline));
    }
    f64::from_bits(first as u64)
}

/// Forces and velocities of a step, and of the one before it.
pub(crate) struct Steps<'a> {
    pub(crate) tau: &'a [f64],
    pub(crate) tau_before: &'a [f64],
    pub(crate) v: &'a [f64],
    pub(crate) v_before: &'a [f64],
}

#[inline(always)]
fn crossing_ahead(steps: &Steps<'_>, slip: &[f64], threshold: &[f64], decline: f64) -> f64 {
    let blocks = slip.len();
    let &Steps { tau, tau_before, v, v_before } = steps;
    let (tau, tau_before) = (&tau[..blocks], &tau_before[..blocks]);
    let (v, v_before, threshold) = (&v[..blocks], &v_before[..blocks], &threshold[..blocks]);
    let mut first = NEVER;
    for n in 0..blocks {
        let stuck = slip[n] == 0.0;
        let now = select_unpredictable(stuck, tau[n], v[n]);
        let rate = now - select_unpredictable(stuck, tau_before[n], v_before[n]);
        first = first.min(crossing(now, rate, slip[n] * sign(v[n]), threshold[n], decline));
    }
    f64::from_bits(first as u64)
}

/// The bits of infinity.
const NEVER: i64 = f64::INFINITY.to_bits() as i64;

/// Steps until one guard would reach its limit, as bits: in the order of the numbers, but
/// for negative ones among themselves, and the least of integers is found in vectors.
#[inline(always)]
fn crossing(now: f64, rate: f64, sigma: f64, limit: f64, decline: f64) -> i64 {
    let stuck = sigma == 0.0;
    // Where thresholds come down one may be met on either side.
    let by_rate = select_unpredictable(rate > 0.0, now, -now);
    let towards = select_unpredictable(decline == 0.0, by_rate, now.abs());
    let room = select_unpredictable(stuck, limit - towards, sigma * now);
    let closing = select_unpredictable(stuck, rate.abs() + limit * decline, -sigma * rate);
    select_unpredictable(closing > 0.0, room / closing, f64::INFINITY).to_bits() as i64
}

/// `sum_j coefficient_j term_j` of `LANES` blocks from `at` on.
#[inline(always)]
fn combined<const LANES: usize>(
    terms: &[f64],
    pitch: usize,
    at: usize,
    coefficients: &[f64],
) -> [f64; LANES] {
    let mut sum = [0.0; LANES];
    for (j, coefficient) in coefficients.iter().enumerate().rev() {
        let term = &terms[j * pitch + at..][..LANES];
        for lane in 0..LANES {
            sum[lane] += coefficient * term[lane];
        }
    }
    sum
}

#[inline(always)]
fn combine(sum: &mut [f64], terms: &[f64], pitch: usize, coefficients: &[f64]) {
    let blocks = sum.len();
    let mut at = 0;
    while at + 32 <= blocks {
        sum[at..at + 32].copy_from_slice(&combined::<32>(terms, pitch, at, coefficients));
        at += 32;
    }
    while at < blocks {
        if blocks < 8 {
            sum[at] = combined::<1>(terms, pitch, at, coefficients)[0];
            at += 1;
        } else {
            // The last eight may overlap those before.
            let from = at.min(blocks - 8);
            sum[from..from + 8].copy_from_slice(&combined::<8>(terms, pitch, from, coefficients));
            at += 8;
        }
    }
}

/// The values and bounds of [`Sweeps::follow`] for `LANES` blocks from `at` on.
#[inline(always)]
fn followed<const LANES: usize>(
    values: &mut [f64],
    bounds: &mut [f64],
    terms: &[f64],
    pitch: usize,
    at: usize,
    [value, bound]: [&[f64]; 2],
) {
    let (mut sum, mut magnitude) = ([0.0; LANES], [0.0; LANES]);
    for j in (0..value.len().min(bound.len())).rev() {
        let term = &terms[j * pitch + at..][..LANES];
        for lane in 0..LANES {
            sum[lane] += value[j] * term[lane];
            magnitude[lane] += bound[j] * term[lane].abs();
        }
    }
    values[at..at + LANES].copy_from_slice(&sum);
    bounds[at..at + LANES].copy_from_slice(&magnitude);
}

#[inline(always)]
fn follow(values: &mut [f64], bounds: &mut [f64], terms: &[f64], pitch: usize, coefficients: [&[f64]; 2]) {
    let blocks = values.len();
    let mut at = 0;
    while at + 16 <= blocks {
        followed::<16>(values, bounds, terms, pitch, at, coefficients);
        at += 16;
    }
    while at < blocks {
        if blocks < 8 {
            followed::<1>(values, bounds, terms, pitch, at, coefficients);
            at += 1;
        } else {
            followed::<8>(values, bounds, terms, pitch, at.min(blocks - 8), coefficients);
            at += 8;
        }
    }
}

#[inline(always)]
fn products(x: &[f64], a: &[f64], b: &[f64]) -> [f64; 2] {
    let (mut sum, mut magnitude) = ([0.0; 4], [0.0; 4]);
    let count = a.len().min(b.len()).min(x.len());
    let whole = count / 4 * 4;
    for at in (0..whole).step_by(4) {
        let (x, a, b) = (&x[at..at + 4], &a[at..at + 4], &b[at..at + 4]);
        for lane in 0..4 {
            sum[lane] += a[lane] * x[lane];
            magnitude[lane] += b[lane] * x[lane].abs();
        }
    }
    for j in whole..count {
        sum[j - whole] += a[j] * x[j];
        magnitude[j - whole] += b[j] * x[j].abs();
    }
    let total = |lanes: [f64; 4]| (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
    [total(sum), total(magnitude)]
}

#[inline(always)]
fn invariant(spring: &[f64], u: &[f64], v: &[f64], constants: &[f64; 4]) -> f64 {
    let &[mass, k, eta, dt] = constants;
    let blocks = u.len();
    let (v, spring) = (&v[..blocks], &spring[..blocks]);
    macro_rules! own {
        ($u:expr, $v:expr, $spring:expr) => {
            mass * $v * $v + $spring * $u * ($u - dt * $v)
        };
    }
    macro_rules! pair {
        ($du:expr, $dv:expr) => {{
            let (du, dv) = ($du, $dv);
            k * du * (du - dt * dv) - 0.5 * dt * eta * dv * dv
        }};
    }
    // Lanes of their own: the order of the sum is the same on every machine.
    let mut lanes = [0.0; 8];
    let mut at = 0;
    while at + 8 < blocks {
        let (u, next_u) = (&u[at..at + 8], &u[at + 1..at + 9]);
        let (v, next_v) = (&v[at..at + 8], &v[at + 1..at + 9]);
        let spring = &spring[at..at + 8];
        for lane in 0..8 {
            let (u, v) = (u[lane], v[lane]);
            lanes[lane] += own!(u, v, spring[lane]) + pair!(next_u[lane] - u, next_v[lane] - v);
        }
        at += 8;
    }
    for n in at..blocks {
        lanes[n % 8] += own!(u[n], v[n], spring[n]);
        if n + 1 < blocks {
            lanes[n % 8] += pair!(u[n + 1] - u[n], v[n + 1] - v[n]);
        }
    }
    lanes.into_iter().sum()
}

/// A complex number of each of eight waves.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Lanes {
    pub(crate) re: [f64; 8],
    pub(crate) im: [f64; 8],
}

/// Sums over eight waves; see [`Sweeps::wave_sums`].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct WaveSums {
    pub(crate) u: Lanes,
    pub(crate) v: Lanes,
    pub(crate) square: Lanes,
    pub(crate) first: Lanes,
    pub(crate) second: Lanes,
}

/// Eight waves, and what each brings.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Waves8 {
    /// `2 cos q`.
    pub(crate) turn: Lanes,
    /// What `x` is multiplied with for displacements and velocities.
    pub(crate) u: Lanes,
    pub(crate) v: Lanes,
    /// And `|x|` for forces.
    pub(crate) force: [f64; 8],
}

/// From one block to the one before it: `x_{n-1} = 2 cos q x_n - x_{n+1}`.
macro_rules! to_the_left {
    ($turn:expr, $x:ident, $behind:ident) => {
        for lane in 0..8 {
            let re = $turn.re[lane] * $x.re[lane] - $turn.im[lane] * $x.im[lane] - $behind.re[lane];
            let im = $turn.re[lane] * $x.im[lane] + $turn.im[lane] * $x.re[lane] - $behind.im[lane];
            ($behind.re[lane], $behind.im[lane]) = ($x.re[lane], $x.im[lane]);
            ($x.re[lane], $x.im[lane]) = (re, im);
        }
    };
}

const ONES: Lanes = Lanes { re: [1.0; 8], im: [0.0; 8] };

#[inline(always)]
fn wave_sums(sums: &mut WaveSums, wave: &Lanes, u: &[f64], v: &[f64]) {
    let blocks = u.len();
    let v = &v[..blocks];
    let turn = *wave;
    // The last block, and its image behind the free end.
    let (mut x, mut behind) = (ONES, ONES);
    let mut all = WaveSums::default();
    for n in (1..blocks).rev() {
        let (u, v) = (u[n], v[n]);
        for lane in 0..8 {
            let (re, im) = (x.re[lane], x.im[lane]);
            all.u.re[lane] += re * u;
            all.u.im[lane] += im * u;
            all.v.re[lane] += re * v;
            all.v.im[lane] += im * v;
            all.square.re[lane] += re * re - im * im;
            all.square.im[lane] += 2.0 * re * im;
        }
        to_the_left!(turn, x, behind);
    }
    (all.first, all.second) = (x, behind);
    *sums = all;
}

#[inline(always)]
fn add_waves(u: &mut [f64], v: &mut [f64], force: &mut [f64], waves: &Waves8) -> [Lanes; 2] {
    let blocks = u.len();
    let (v, force) = (&mut v[..blocks], &mut force[..blocks]);
    let Waves8 { turn, u: by_u, v: by_v, force: by_force } = *waves;
    let (mut x, mut behind) = (ONES, ONES);
    for n in (0..blocks).rev() {
        let (mut of_u, mut of_v, mut of_force) = ([0.0; 8], [0.0; 8], [0.0; 8]);
        for lane in 0..8 {
            let (re, im) = (x.re[lane], x.im[lane]);
            of_u[lane] = by_u.re[lane] * re - by_u.im[lane] * im;
            of_v[lane] = by_v.re[lane] * re - by_v.im[lane] * im;
            // No less than the magnitude.
            of_force[lane] = by_force[lane] * (re.abs() + im.abs());
        }
        u[n] += total(&of_u);
        v[n] += total(&of_v);
        force[n] += total(&of_force);
        if n > 0 {
            to_the_left!(turn, x, behind);
        }
    }
    [x, behind]
}

/// The sum of eight lanes, in one order.
#[inline(always)]
fn total(lanes: &[f64; 8]) -> f64 {
    let four: [f64; 4] = [lanes[0] + lanes[4], lanes[1] + lanes[5], lanes[2] + lanes[6], lanes[3] + lanes[7]];
    (four[0] + four[2]) + (four[1] + four[3])
}

#[inline(always)]
fn multiply(product: &mut [f64], matrix: &[f64], vector: &[f64]) {
    let size = product.len();
    product.fill(0.0);
    let mut columns = matrix.chunks_exact(4 * size);
    let mut entries = vector.chunks_exact(4);
    for (four, x) in columns.by_ref().zip(entries.by_ref()) {
        let (a, rest) = four.split_at(size);
        let (b, rest) = rest.split_at(size);
        let (c, d) = rest.split_at(size);
        let d = &d[..size];
        for n in 0..size {
            product[n] = (((product[n] + x[0] * a[n]) + x[1] * b[n]) + x[2] * c[n]) + x[3] * d[n];
        }
    }
    for (column, x) in columns.remainder().chunks_exact(size).zip(entries.remainder()) {
        for n in 0..size {
            product[n] += x * column[n];
        }
    }
}

#[inline(always)]
fn largest(values: &[f64]) -> f64 {
    // Lanes of their own, so that the compiler may keep them in one register;
    // the largest is the same in whatever order it is found.
    let mut lanes = [0.0f64; 8];
    let chunks = values.chunks_exact(8);
    let rest = chunks
        .remainder()
        .iter()
        .fold(0.0, |max: f64, value| if value.abs() > max { value.abs() } else { max });
    for chunk in chunks {
        for lane in 0..8 {
            let value = chunk[lane].abs();
            lanes[lane] = if value > lanes[lane] { value } else { lanes[lane] };
        }
    }
    lanes.into_iter().fold(rest, f64::max)
}

/// The sign of a velocity; 0 for 0, where `v / |v|` would be no number.
#[inline]
fn sign(velocity: f64) -> f64 {
    select_unpredictable(velocity.abs() > 0.0, 1f64.copysign(velocity), 0.0)
}

/// Whether a sliding block re-attaches by the laws without friction springs: where its
/// velocity would change sign.
#[inline]
pub(crate) fn stops(velocity: f64, new_velocity: f64) -> bool {
    new_velocity * velocity < 0.0
}

/// Whether a sliding block re-attaches, by the one-way or the two-way rule.
#[inline]
pub(crate) fn comes_to_rest(velocity: f64, new_velocity: f64, two_way: bool) -> bool {
    if two_way { new_velocity * velocity <= 0.0 } else { new_velocity <= 0.0 }
}

#[cfg(test)]
mod tests {
    use super::{After, Blocks, Constants, Sweeps};

    /// Numbers without pattern, the same on every machine.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            })
            .collect()
    }

    #[test]
    fn all_instruction_sets_give_the_same_bits() {
        for blocks in [2, 3, 7, 8, 9, 64, 101] {
            for two_way in [false, true] {
                let run = |sweeps: Sweeps| {
                    let mut u = noise(1, blocks);
                    let mut v = noise(2, blocks);
                    let (mut tau, mut u_new, mut v_new) =
                        (vec![0.0; blocks], vec![0.0; blocks], vec![0.0; blocks]);
                    let (u_stick, sliding_friction) = (noise(3, blocks), noise(4, blocks));
                    let slip: Vec<f64> =
                        noise(5, blocks).iter().map(|x| f64::from(u8::from(*x > 0.0))).collect();
                    let threshold = vec![1e9; blocks];
                    let mut any = Vec::new();
                    for step in 0..50 {
                        let old = Blocks {
                            u: &u,
                            v: &v,
                            u_stick: &u_stick,
                            slip: &slip,
                            threshold: &threshold,
                            sliding_friction: &sliding_friction,
                            driving_force: &noise(6 + step, blocks),
                        };
                        let constants = Constants {
                            k: 3.7,
                            eta: 0.9,
                            dt: 0.01,
                            dt_over_m: 0.013,
                            kt: 2.1,
                            two_way,
                            weakening: 0.7,
                            radiation: 0.3,
                        };
                        let take = match step % 3 {
                            0 => Sweeps::step,
                            1 => Sweeps::step_driven_everywhere,
                            _ => Sweeps::rigid_step,
                        };
                        any.push(take(sweeps, &mut u_new, &mut v_new, &mut tau, &old, &constants));
                        std::mem::swap(&mut u, &mut u_new);
                        std::mem::swap(&mut v, &mut v_new);
                    }
                    let bits = |values: &[f64]| values.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                    (bits(&u), bits(&v), bits(&tau), any)
                };
                let baseline = run(Sweeps::Baseline);
                for sweeps in Sweeps::available() {
                    assert_eq!(run(sweeps), baseline, "{sweeps:?}, {blocks} blocks");
                }
            }
        }
    }

    #[test]
    fn no_switch_happens_without_the_hint_of_the_step() {
        const BLOCKS: usize = 11;
        const AT: usize = 5;
        let tiny = f64::MIN_POSITIVE * f64::EPSILON;
        let numbers = [0.0, tiny, 1e-200, 0.5, 1.0 - f64::EPSILON / 2.0, 1.0, 1.0 + f64::EPSILON];
        let signed = || numbers.into_iter().flat_map(|x| [x, -x]);
        let (mut switches, mut quiet) = (0, 0);
        for (take, rigid, two_way) in [
            (Sweeps::step_driven_everywhere as StepSweep, false, false),
            (Sweeps::step_driven_everywhere, false, true),
            (Sweeps::rigid_step, true, true),
        ] {
            for (slip, v, force) in [0.0, 1.0]
                .into_iter()
                .flat_map(|s| signed().flat_map(move |v| signed().map(move |f| (s, v, f))))
            {
                // One block among others that stick unloaded; the force alone changes its velocity.
                let alone = |x: f64| std::array::from_fn::<f64, BLOCKS, _>(|n| if n == AT { x } else { 0.0 });
                let (slip, v) = (alone(slip), alone(v));
                let old = Blocks {
                    u: &alone(0.0),
                    v: &v,
                    u_stick: &alone(0.0),
                    slip: &slip,
                    threshold: &[1.0; BLOCKS],
                    sliding_friction: &[0.0; BLOCKS],
                    driving_force: &alone(force),
                };
                let constants = Constants {
                    k: 0.0,
                    eta: 0.0,
                    dt: 1.0,
                    dt_over_m: 1.0,
                    kt: 0.0,
                    two_way,
                    weakening: 0.0,
                    radiation: 0.0,
                };
                for sweeps in Sweeps::available() {
                    let (mut u_new, mut v_new, mut tau) = ([0.0; BLOCKS], [0.0; BLOCKS], [0.0; BLOCKS]);
                    let hint = take(sweeps, &mut u_new, &mut v_new, &mut tau, &old, &constants);
                    let after = After {
                        slip: &slip,
                        v: &v,
                        v_new: &v_new,
                        tau: &tau,
                        threshold: old.threshold,
                        two_way,
                        rigid,
                    };
                    let mut marks = [0];
                    sweeps.switching(&mut marks, &after);
                    assert!(hint || marks == [0], "{slip:?} {v:?} {force} {two_way} {rigid} {sweeps:?}");
                    switches += usize::from(marks != [0]);
                    quiet += usize::from(!hint);
                }
            }
        }
        assert!(switches > 100 && quiet > 100, "{switches} {quiet}");
    }

    type StepSweep = fn(Sweeps, &mut [f64], &mut [f64], &mut [f64], &Blocks<'_>, &Constants) -> bool;
}
