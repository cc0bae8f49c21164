//! The two sweeps over the blocks that a step is made of, compiled for the
//! instruction sets that a machine may have.
//!
//! They are functions of slices: from their arguments the compiler knows that
//! the arrays do not overlap, which it must know to vectorise them. Every block
//! is computed on its own, with the same operations in the same order, and
//! multiplication and addition are never fused, so all versions give the same
//! bits.

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
        /// Friction, new velocities and positions (4.13, 4.14); whether any block switches.
        advance(u: &mut [f64], v_new: &mut [f64], old: &Blocks<'_>, constants: &Constants) -> bool
    }

    dispatch! {
        /// The difference behind `u, v` of a chain without forcing, from its `tau`:
        /// `v' = (tau - spring u) dt / m`, `u' = (v + v') dt`.
        differentiate(u_next: &mut [f64], v_next: &mut [f64], u: &[f64], v: &[f64], pull: &Pull<'_>)
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
        /// `sum_j coefficient_j |term_j|`, the highest first.
        combine_magnitudes(sum: &mut [f64], terms: &[f64], coefficients: &[f64])
    }

    dispatch! {
        /// `sum_j coefficient_j term_j`, the highest first; the terms one after the other.
        combine(sum: &mut [f64], terms: &[f64], coefficients: &[f64])
    }
}

/// What the new velocities and positions depend on, one value per block.
pub(crate) struct Blocks<'a> {
    pub(crate) v: &'a [f64],
    pub(crate) u_stick: &'a [f64],
    pub(crate) slip: &'a [f64],
    pub(crate) tau: &'a [f64],
    pub(crate) threshold: &'a [f64],
    pub(crate) sliding_friction: &'a [f64],
}

pub(crate) struct Constants {
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
    pub(crate) kt: f64,
    pub(crate) two_way: bool,
}

/// `k (u_{n+1} - 2 u_n + u_{n-1}) + eta (v_{n+1} - 2 v_n + v_{n-1})`, free ends.
#[inline(always)]
fn pull_of_neighbours(tau: &mut [f64], u: &[f64], v: &[f64], k: f64, eta: f64) {
    let last = tau.len() - 1;
    let (u, v) = (&u[..=last], &v[..=last]);
    for n in 1..last {
        tau[n] = k * (u[n + 1] - 2.0 * u[n] + u[n - 1]) + eta * (v[n + 1] - 2.0 * v[n] + v[n - 1]);
    }
    tau[0] = k * (u[1] - u[0]) + eta * (v[1] - v[0]);
    tau[last] = k * (u[last - 1] - u[last]) + eta * (v[last - 1] - v[last]);
}

/// New velocities and positions; whether any block switches.
#[inline(always)]
fn advance(u: &mut [f64], v_new: &mut [f64], old: &Blocks<'_>, constants: &Constants) -> bool {
    let &Constants { dt, dt_over_m, kt, two_way } = constants;
    let blocks = u.len();
    let v_new = &mut v_new[..blocks];
    let Blocks { v, u_stick, slip, tau, threshold, sliding_friction } = *old;
    let (v, u_stick, slip) = (&v[..blocks], &u_stick[..blocks], &slip[..blocks]);
    let (tau, threshold, sliding_friction) =
        (&tau[..blocks], &threshold[..blocks], &sliding_friction[..blocks]);

    let mut any_switch = false;
    for n in 0..blocks {
        let slides = slip[n] != 0.0;
        let spring = -kt * (u[n] - u_stick[n]);
        let drag = -sliding_friction[n] * sign(v[n]);
        let friction = if slides { drag } else { spring };

        v_new[n] = v[n] + (tau[n] + friction) * dt_over_m;
        u[n] += v_new[n] * dt;

        let detaches = tau[n].abs() >= threshold[n];
        any_switch |= if slides { comes_to_rest(v[n], v_new[n], two_way) } else { detaches };
    }
    any_switch
}

/// What a difference of a chain without forcing depends on.
pub(crate) struct Pull<'a> {
    pub(crate) tau: &'a [f64],
    /// Friction spring of each block, 0 for sliding ones.
    pub(crate) spring: &'a [f64],
    pub(crate) dt: f64,
    pub(crate) dt_over_m: f64,
}

#[inline(always)]
fn differentiate(u_next: &mut [f64], v_next: &mut [f64], u: &[f64], v: &[f64], pull: &Pull<'_>) {
    let blocks = u_next.len();
    let (v_next, u, v) = (&mut v_next[..blocks], &u[..blocks], &v[..blocks]);
    let (tau, spring) = (&pull.tau[..blocks], &pull.spring[..blocks]);
    for n in 0..blocks {
        v_next[n] = (tau[n] - spring[n] * u[n]) * pull.dt_over_m;
        u_next[n] = (v[n] + v_next[n]) * pull.dt;
    }
}

#[inline(always)]
fn combine(sum: &mut [f64], terms: &[f64], coefficients: &[f64]) {
    let blocks = sum.len();
    sum.fill(0.0);
    for (j, &coefficient) in coefficients.iter().enumerate().rev() {
        let term = &terms[j * blocks..(j + 1) * blocks];
        for n in 0..blocks {
            sum[n] += coefficient * term[n];
        }
    }
}

#[inline(always)]
fn combine_magnitudes(sum: &mut [f64], terms: &[f64], coefficients: &[f64]) {
    let blocks = sum.len();
    sum.fill(0.0);
    for (j, &coefficient) in coefficients.iter().enumerate().rev() {
        let term = &terms[j * blocks..(j + 1) * blocks];
        for n in 0..blocks {
            sum[n] += coefficient * term[n].abs();
        }
    }
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
    if velocity > 0.0 {
        1.0
    } else if velocity < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// Whether a sliding block re-attaches, by the one-way or the two-way rule.
#[inline]
pub(crate) fn comes_to_rest(velocity: f64, new_velocity: f64, two_way: bool) -> bool {
    if two_way { new_velocity * velocity <= 0.0 } else { new_velocity <= 0.0 }
}

#[cfg(test)]
mod tests {
    use super::{Blocks, Constants, Sweeps};

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
                    let (mut tau, mut v_new) = (vec![0.0; blocks], vec![0.0; blocks]);
                    let (u_stick, sliding_friction) = (noise(3, blocks), noise(4, blocks));
                    let slip: Vec<f64> =
                        noise(5, blocks).iter().map(|x| f64::from(u8::from(*x > 0.0))).collect();
                    let threshold = vec![1e9; blocks];
                    let mut any = Vec::new();
                    for _ in 0..50 {
                        sweeps.pull_of_neighbours(&mut tau, &u, &v, 3.7, 0.9);
                        let old = Blocks {
                            v: &v,
                            u_stick: &u_stick,
                            slip: &slip,
                            tau: &tau,
                            threshold: &threshold,
                            sliding_friction: &sliding_friction,
                        };
                        let constants = Constants { dt: 0.01, dt_over_m: 0.013, kt: 2.1, two_way };
                        any.push(sweeps.advance(&mut u, &mut v_new, &old, &constants));
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
}
