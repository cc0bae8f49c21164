//! The modes of a long stuck chain, in memory proportional to its length.
//!
//! All blocks but the first have the same springs, so a mode ([`crate::modes`]) is a standing wave that
//! meets the free end: `x_n = cos q (N - n - 1/2)` with `n` from 0, up to its amplitude. With
//! `s, kappa, sigma = (dt^2 / m)(k_t, k, K)` and `d = (dt / m) eta`,
//!
//! ```text
//! z^2 + (1 + z) s + (z d + (1 + z) kappa) (2 - 2 cos q) = 0
//! ```
//!
//! gives `z` as a function of `q`, and the driven end determines the values of `q`:
//!
//! ```text
//! (2 - c) sin qN sin(q / 2) = c cos qN cos(q / 2),    c = (1 + z) sigma / (z d + (1 + z) kappa).
//! ```
//!
//! `c` is small, so the waves are close to those of a free chain, `q = pi j / N`, from where Newton's
//! method finds each: one for a pair of complex `z`, two for two real ones. A drive of all blocks by
//! equal springs adds the same stiffness to all of them; then `s + sigma` replaces `s`, `c = 0`, and
//! `q = pi j / N` exactly.
//!
//! No wave is stored: [`crate::modes::nonuniform_cosines`] computes sums over blocks and over waves in a time
//! that grows as `N log N`. Sums over a single wave have closed forms, as
//! `2 sin q sum_p cos 2q (p + 1/2) = sin 2qP` over `P` blocks.
//!
//! Completeness of the modes is checked with a pseudo-random state, and again in every jump: its residue
//! is composed again from the modes, and the difference enters the bounds.

use std::sync::Arc;

use asperity_model::Plan;
use asperity_model::body::elastic::Chain;

use crate::modes::complex::{Complex, Functions};
use crate::modes::nonuniform_cosines::Cosines;
use crate::modes::{Coordinates, Powers};

/// Largest difference, per block, of a state that is projected and composed again: rounding accumulates
/// along a wave.
pub(crate) const DEFECT_PER_BLOCK: f64 = 1e-14;

/// Steps after which waves are first checked for calm, a power of two, and most of them.
const CALMING_STEPS: u64 = 64;
const MOST_CALMING_STEPS: u64 = 4096;

/// Most rounds to find a wave; some six are usual.
const MOST_ROUNDS: usize = 60;

/// The standing waves of a stuck chain; each complex `z` also represents its conjugate.
#[derive(Debug, Clone)]
pub(crate) struct StandingWaves {
    blocks: usize,
    dt: f64,
    cosines: Cosines,
    waves: Arc<[Wave]>,
    pub(crate) powers: Powers,
}

/// One wave.
#[derive(Debug, Clone, Copy)]
struct Wave {
    /// 2 for a pair of conjugate modes, 1 for a real one.
    times: f64,
    /// Factor from displacements to velocities in displacement per step: `z / (1 + z)`.
    velocity: Complex,
    /// Factors of the sums over displacements and velocities, and of the first block's values, in the
    /// coordinate.
    of_u: Complex,
    of_v: Complex,
    of_first_u: Complex,
    of_first_v: Complex,
    /// The largest force on the first block by a wave of amplitude 1.
    first_force_n: f64,
    /// The largest force on the other blocks by a wave of amplitude 1.
    force_n: f64,
    /// Factor on its amplitude over [`CALMING_STEPS`].
    shrinks: f64,
}

/// `(dt^2 / m)(k_t, k, K)` and `(dt / m) eta`; a drive of all blocks is part of `k_t`.
struct Constants {
    s: f64,
    kappa: f64,
    sigma: f64,
    d: f64,
}

impl Constants {
    /// `z` of a wave number: the root of its equation with this sign of the square root.
    fn root(&self, q: Complex, sign: f64) -> Complex {
        let (sin, _) = q.scale(0.5).sin_cos();
        let shape = (sin * sin).scale(4.0);
        let t = shape.scale(self.kappa) + Complex::from(self.s);
        let half = (t + shape.scale(self.d)).scale(0.5);
        let root = (half * half - t).root();
        // Of a pair, the root above the axis, whichever side rounding puts it on.
        let root = if root.im < -root.re { Complex::ZERO - root } else { root };
        if sign < 0.0 {
            Complex::ZERO - half - root
        } else if half.re > 0.0 && root.re > 0.0 {
            // Avoids the difference of nearly equal numbers.
            Complex::ZERO - t / (half + root)
        } else {
            root - half
        }
    }

    /// The wave number near that of the free chain's mode `j`, and its `z`. They depend on each other
    /// only through `c`, which hardly changes; Newton's method with a fixed `c` alternates with updates
    /// of `c` from the new `z`.
    fn wave(&self, j: usize, sign: f64, blocks: f64) -> Option<(Complex, Complex)> {
        let free = std::f64::consts::PI * j as f64 / blocks;
        if self.sigma == 0.0 {
            return Some((free.into(), self.root(free.into(), sign)));
        }
        let small = self.sigma / self.kappa;
        // The lowest wave, which the free chain does not have, from `q^2 N = c`.
        let guess = if j == 0 { (small / blocks).sqrt() } else { free + small / (free * blocks) };
        let mut q = Complex::from(guess);
        let mut z = self.root(q, sign);
        for _ in 0..MOST_ROUNDS {
            let grown = Complex::ONE + z;
            let c = grown.scale(self.sigma) / (z.scale(self.d) + grown.scale(self.kappa));
            let rest = Complex::from(2.0) - c;
            let ((sin, cos), (half_sin, half_cos)) = (q.scale(blocks).sin_cos(), q.scale(0.5).sin_cos());
            let misfit = rest * sin * half_sin - c * cos * half_cos;
            let slope = rest * (cos * half_sin).scale(blocks)
                + (rest * sin * half_cos).scale(0.5)
                + c * (sin * half_cos).scale(blocks)
                + (c * cos * half_sin).scale(0.5);
            let step = misfit / slope;
            q -= step;
            let old = z;
            z = self.root(q, sign);
            if step.size() <= 1e-14 * q.size() && (z - old).size() <= 1e-11 * z.size() {
                return Some((q, z));
            }
        }
        None
    }
}

impl StandingWaves {
    /// The waves of a plan's stuck chain with free ends; `None` if not all are found, or one grows.
    pub(crate) fn of(plan: &Plan, chain: &Chain) -> Option<StandingWaves> {
        if !plan.end_bonds.is_empty() {
            return None;
        }
        let blocks = plan.blocks;
        let (dt, m) = (plan.grid.step_s(), plan.block_mass_kg);
        let (side_n_per_m, top_n_per_m) = driving(plan).filter(|_| plan.friction.has_even_springs())?;
        let constants = Constants {
            s: dt * dt / m * (plan.friction.interfacial_stiffness_n_per_m + top_n_per_m),
            kappa: dt * dt / m * chain.stiffness_n_per_m,
            sigma: dt * dt / m * side_n_per_m,
            d: dt / m * chain.damping_kg_per_s,
        };
        let (mut pairs, mut singles) = (Vec::new(), Vec::new());
        for j in 0..blocks {
            let (q, z) = constants.wave(j, 1.0, blocks as f64)?;
            if z.im.abs() > 1e-9 * z.size() {
                pairs.push((q, z, 2.0));
            } else {
                let (other_q, other) = constants.wave(j, -1.0, blocks as f64)?;
                singles.extend([(q, z, 1.0), (other_q, other, 1.0)]);
            }
        }
        let found: Vec<(Complex, Complex, f64)> = pairs.into_iter().chain(singles).collect();
        let powers = Powers::of(&found.iter().map(|(_, z, _)| *z).collect::<Vec<_>>());
        if !powers.none_grows() {
            return None;
        }
        let cosines = Cosines::of(found.iter().map(|(q, ..)| *q), blocks)?;
        let (by_spring, kt) =
            (plan.friction.law.detaches_by_spring(), plan.friction.interfacial_stiffness_n_per_m);
        let wave = |&(q, z, times): &(Complex, Complex, f64)| {
            let x = |n: usize| q.scale(blocks as f64 - n as f64 - 0.5).sin_cos().1;
            let (x0, x1, square) = (x(0), x(1), square_of_others(q, blocks));
            let grown = Complex::ONE + z;
            let velocity = z / grown;
            let (half_sin, _) = q.scale(0.5).sin_cos();
            let shape = (half_sin * half_sin).scale(4.0);
            let project = (z + shape.scale(constants.d)) / grown;
            let project_first = (z * x0 + (x0 - x1).scale(constants.d)) / grown;
            let own = square * (project + (Complex::ONE - project) * velocity)
                + project_first * x0
                + (x0 - project_first) * velocity * x0;
            let pull = Complex::from(chain.stiffness_n_per_m) + velocity.scale(chain.damping_kg_per_s / dt);
            // Bound on the wave's cosines.
            let most = libm::cosh(q.im * blocks as f64);
            let held = x0.scale(side_n_per_m + top_n_per_m);
            Wave {
                times,
                velocity,
                of_u: project / own,
                of_v: (Complex::ONE - project) / own,
                of_first_u: (project_first - project * x0) / own,
                of_first_v: (project * x0 - project_first) / own,
                first_force_n: match by_spring {
                    true => times * kt * x0.size(),
                    false => times * (pull * (x1 - x0) - held).size(),
                },
                force_n: match by_spring {
                    true => times * kt * most,
                    false => times * (pull * shape + Complex::from(top_n_per_m)).size() * most,
                },
                shrinks: (0..CALMING_STEPS.ilog2()).fold(grown.size(), |size, _| size * size),
            }
        };
        let waves: Arc<[Wave]> = found.iter().map(wave).collect();
        let mut waves = StandingWaves { blocks, dt, cosines, waves, powers };
        waves.span_all_states(plan).then_some(waves)
    }

    /// Whether a pseudo-random state is recovered after projection and composition.
    fn span_all_states(&mut self, plan: &Plan) -> bool {
        let held = plan.elastic.spectral_bound_n_per_m() + plan.friction.interfacial_stiffness_n_per_m;
        let rate = (held / plan.block_mass_kg).sqrt();
        let mut seed = 1u64;
        let state: Vec<f64> = (0..2 * self.blocks)
            .map(|n| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                let number = (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5;
                if n < self.blocks { number } else { rate * number }
            })
            .collect();
        let mut again = vec![0.0; 2 * self.blocks];
        let coordinates = self.project(&state);
        self.compose(&coordinates, f64::NEG_INFINITY, &mut again);
        let defect = DEFECT_PER_BLOCK * self.blocks as f64;
        let units = (0..2 * self.blocks).map(|n| if n < self.blocks { 1.0 } else { rate });
        state.iter().zip(&again).zip(units).all(|((a, b), unit)| (a - b).abs() <= defect * unit)
    }

    /// Projects a state; displacements first, then velocities.
    pub(crate) fn project(&mut self, state: &[f64]) -> Coordinates {
        let (u, velocity) = state.split_at(self.blocks);
        let v: Vec<f64> = velocity.iter().map(|velocity| velocity * self.dt).collect();
        let sums = self.cosines.project(u, &v);
        let (first_u, first_v) = (u[0], v[0]);
        let waves = self.waves.iter().zip(sums);
        waves
            .map(|(wave, [u_re, u_im, v_re, v_im])| {
                let (u, v) = (Complex::new(u_re, u_im), Complex::new(v_re, v_im));
                u * wave.of_u
                    + v * wave.of_v
                    + wave.of_first_u.scale(first_u)
                    + wave.of_first_v.scale(first_v)
            })
            .collect()
    }

    /// The state with these coordinates, without waves of at most the size `least`.
    pub(crate) fn compose(&mut self, coordinates: &Coordinates, least: f64, state: &mut [f64]) {
        // Contributions of each wave to displacements and velocities.
        let sums = self.waves.iter().enumerate().map(|(m, wave)| {
            let z = coordinates.at(m);
            let times = if z.re.abs() + z.im.abs() > least { wave.times } else { 0.0 };
            let (u, v) = (z.scale(times), (z * wave.velocity).scale(times / self.dt));
            [u.re, u.im, v.re, v.im]
        });
        let (u, v) = state.split_at_mut(self.blocks);
        self.cosines.compose(&mut sums.collect::<Vec<_>>(), u, v);
    }

    /// How large the force on the first block and on each other one may become from these coordinates on.
    pub(crate) fn bound(&self, coordinates: &Coordinates) -> [f64; 2] {
        self.bound_of((0..self.waves.len()).map(|m| coordinates.at(m).size()))
    }

    fn bound_of(&self, sizes: impl Iterator<Item = f64>) -> [f64; 2] {
        self.waves.iter().zip(sizes).fold([0.0; 2], |[of_first, of_others], (wave, size)| {
            [of_first + size * wave.first_force_n, of_others + size * wave.force_n]
        })
    }

    /// Finds after how many steps, some thousand at most, the waves are calm: when `is_calm` accepts a
    /// bound on the forces on the first block and on the others. Returns these steps, and the number of
    /// calls.
    pub(crate) fn calm_after(
        &self,
        coordinates: &Coordinates,
        mut is_calm: impl FnMut([f64; 2]) -> bool,
    ) -> (u64, u64) {
        let mut sizes: Vec<f64> = (0..self.waves.len()).map(|m| coordinates.at(m).size()).collect();
        let mut shrinks: Vec<f64> = self.waves.iter().map(|wave| wave.shrinks).collect();
        let (mut steps, mut stride) = (0, CALMING_STEPS);
        for asked in 1.. {
            steps += stride;
            sizes.iter_mut().zip(&shrinks).for_each(|(size, shrinks)| *size *= shrinks);
            if steps >= MOST_CALMING_STEPS || is_calm(self.bound_of(sizes.iter().copied())) {
                return (steps, asked);
            }
            if asked % 8 == 0 {
                stride *= 2;
                shrinks.iter_mut().for_each(|shrinks| *shrinks *= *shrinks);
            }
        }
        unreachable!("the steps grow up to the most of them")
    }
}

/// The stiffness of the drive's spring at block 1, or of its equal springs at all blocks; the other
/// number is 0. `None` for other drives.
fn driving(plan: &Plan) -> Option<(f64, f64)> {
    if let Some(spring) = plan.drive.only_side() {
        return Some((spring.stiffness_n_per_m, 0.0));
    }
    let all = plan.drive.stiffness_n_per_m(plan.blocks);
    let top = all[0];
    all.iter().all(|stiffness| stiffness.to_bits() == top.to_bits()).then_some((0.0, top))
}

/// `sum x_n^2` of a wave over all blocks but the first.
fn square_of_others(q: Complex, blocks: usize) -> Complex {
    let others = blocks as f64 - 1.0;
    let (double, (sin, _)) = (q.scale(2.0 * others).sin_cos().0, q.sin_cos());
    // The wave that does not oscillate.
    let turning = if sin.size() == 0.0 { Complex::from(2.0 * others) } else { double / sin };
    (turning.scale(0.5) + Complex::from(others)).scale(0.5)
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, Scenario, ScenarioSource};

    use super::StandingWaves;
    use crate::modes::Modes;
    use crate::modes::propagator::Propagator;

    #[test]
    fn waves_span_all_states_of_a_state_and_do_what_stored_modes_do() {
        for set in [
            &["slider.blocks=99"][..],
            &["slider.blocks=100", "parameter_set=as-stated"],
            &["slider.blocks=17", "drive.stiffness_n_per_m=4e6"],
            &["slider.blocks=3", "friction.interfacial_stiffness_ratio=30"],
            &["slider.blocks=64", "parameter_set=as-stated", "drive.kind=top"],
        ] {
            let source = ScenarioSource::new("test", "parameter_set = \"as-coded\"");
            let source = set.iter().fold(source, |source, value| source.with_override(value));
            let plan = Plan::new(&Scenario::resolve(&source).unwrap());
            let blocks = plan.blocks;
            let mut waves = StandingWaves::of(&plan, &plan.elastic.as_chain().unwrap())
                .unwrap_or_else(|| panic!("{set:?}: the chain has waves"));
            let modes = Modes::of(&Propagator::of(&plan, &plan.elastic.as_chain().unwrap()));
            let modes = modes.expect("the chain has modes");
            // All waves contribute to the displacement of block 7 and the velocity of the last block.
            let mut state = vec![0.0; 2 * blocks];
            state[6 % blocks] = 1e-9;
            state[2 * blocks - 1] = 1e-4;
            let (mut by_waves, mut by_modes) = (waves.project(&state), modes.project(&state));
            let close = |a: &[f64], b: &[f64], what: &str| {
                for part in [0..blocks.min(a.len()), blocks.min(a.len())..a.len()] {
                    let largest = b[part.clone()].iter().fold(0.0, |most: f64, b| most.max(b.abs()));
                    for (a, b) in a[part.clone()].iter().zip(&b[part]) {
                        assert!((a - b).abs() <= 1e-10 * largest, "{set:?}, {what}: {a} {b} of {largest}");
                    }
                }
            };
            let (mut first, mut second) = (vec![0.0; 2 * blocks], vec![0.0; 2 * blocks]);
            let mut bound = vec![0.0; blocks];
            let all = f64::NEG_INFINITY;
            waves.compose(&by_waves, all, &mut first);
            close(&first, &state, "put together again");
            let [of_first, of_others] = waves.bound(&by_waves);
            modes.bound(&by_modes, &mut bound);
            for (n, bound) in bound.iter().enumerate() {
                let swing = if n == 0 { &of_first } else { &of_others };
                // The bound treats every wave as if it had a crest at every block.
                assert!(*swing >= 0.999 * bound && *swing <= 6.0 * bound, "{set:?}: {swing} {bound}");
            }
            by_waves.grow_by(&waves.powers.growth(12_345));
            by_modes.grow_by(&modes.powers.growth(12_345));
            waves.compose(&by_waves, all, &mut first);
            modes.compose(&by_modes, all, &mut second);
            close(&first, &second, "12345 steps on");
        }
    }

    #[test]
    fn a_drive_so_stiff_that_it_has_a_wave_of_its_own_is_refused() {
        let source = ScenarioSource::new("test", "parameter_set = \"as-coded\"")
            .with_override("slider.blocks=17")
            .with_override("drive.stiffness_n_per_m=4e9");
        let plan = Plan::new(&Scenario::resolve(&source).unwrap());
        assert!(StandingWaves::of(&plan, &plan.elastic.as_chain().unwrap()).is_none());
        assert!(
            Modes::of(&Propagator::of(&plan, &plan.elastic.as_chain().unwrap())).is_some(),
            "unlike stored modes"
        );
    }
}
