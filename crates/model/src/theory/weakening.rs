//! Friction that falls linearly over a slip: stability, one block, creep, fronts, pulses and arrest.
//!
//! Units are those of [`front`](super::front). Friction falls from 1 to 0 over `d = D_c k / ((mu_s - mu_d) p)`, by
//! `k_w / k = 1 / d` per slip, which takes the fracture energy `G = d / 2` per block.
//!
//! # Stability
//!
//! Slip of `n` blocks beside a stuck one grows if `k_w` exceeds the stiffness of their softest mode, with `gamma` of a
//! drive: `4 sin^2(pi / (2 n + 2)) + gamma` between two stuck blocks, `4 sin^2(pi / (4 n + 2)) + gamma` from a free end.
//! Of many blocks these are `pi / sqrt(1 / d - gamma)` and half of it: the length of Uenishi and Rice, J. Geophys. Res.
//! 108, 2042 (2003), for a chain.
//!
//! # Fronts
//!
//! **With radiation**, and many blocks in the zone that weakens, `w` is the friction above `mu_d p`, and a steady front
//! obeys `(1 - v^2) u'' - alpha v u' + tau - w = 0` over the distance behind it, with `u = u' = 0` at the front and
//! `u = d`, `u' = tau / (alpha v)` where `w` becomes 0. With `0 < zeta < 1`
//!
//! ```text
//! v = 2 zeta / sqrt(4 zeta^2 + alpha^2 d),
//! tau / (1 - tau) = 2 zeta exp[zeta (pi - arccos zeta) / sqrt(1 - zeta^2)].
//! ```
//!
//! **Without**, the springs behind a pulse are relaxed: `tau U = gamma U^2 / 2 + d / 2`, on the lattice as well, which is
//! [`Front::pulse_slip`](super::front::Front::pulse_slip). No closed form of its speed is known.
//!
//! **At a barrier** of `d` behind `n` blocks with `d = 0`, `q = du/dt - du/dx` is the quantity that [a front without
//! `d`](super::front) meets along `x - t`, and `v = (q^2 - d) / (q^2 + d)`. Before the barrier `v = 1` and `q = tau x`. If
//! block 1 is stuck, waves return with the opposite sign, so that `q = tau (3 x - t) / 2` behind it, and
//! `dx = (q^2 - d) dq / (tau (q^2 - 2 d))` ends at `q^2 = d` unless `q^2 > 2 d`.

use std::f64::consts::{PI, SQRT_2};

use serde::Serialize;

use crate::plan::Plan;
use crate::plan::disorder::STUCK_COEFFICIENT;

/// What a stretch of blocks that slide has at its one end; at the other it has a stuck block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Beginning {
    /// A stuck block.
    Stuck,
    /// The end of the chain.
    Free,
}

impl Beginning {
    /// The `d` below which slip of `blocks` blocks runs away, on each of which a drive has the stiffness `gamma`.
    pub fn critical_slip(self, blocks: u32, gamma: f64) -> f64 {
        let twice = if self == Beginning::Free { 2.0 } else { 1.0 };
        let half = libm::sin(PI / (2.0 * twice * f64::from(blocks) + 2.0));
        1.0 / (4.0 * half * half + gamma)
    }

    /// The blocks from which on slip runs away, if they are many; `None` if the drive holds any number, `gamma d >= 1`.
    pub fn nucleation_blocks(self, d: f64, gamma: f64) -> Option<f64> {
        let half = if self == Beginning::Free { 0.5 } else { 1.0 };
        (gamma * d < 1.0).then(|| half * PI * (d / (1.0 - gamma * d)).sqrt())
    }

    /// How many blocks detach behind a barrier of `d` after `before` blocks with `d = 0` and even `tau`: the length of
    /// the crack and the zone `pi sqrt(d) / 2` ahead of it. `None` if the front passes; and from a free end if it does
    /// not stop at once, by which no closed form is known. For `tau` far below 1 and `d` far above.
    pub fn blocks_behind_barrier(self, tau: f64, before: u32, d: f64) -> Option<f64> {
        let once = tau * f64::from(before) / d.sqrt();
        let crack = match self {
            Beginning::Stuck => arrest_length(once),
            // Mirrored waves double what arrives at a front that waits.
            Beginning::Free => (2.0 * once <= 1.0).then_some(0.0),
        };
        Some((crack? / tau + 0.5 * PI) * d.sqrt())
    }
}

/// `L tau / sqrt(d)` of a crack with a stuck beginning, given `s = tau n / sqrt(d)`; `None` from `s = sqrt(2)` on.
pub fn arrest_length(s: f64) -> Option<f64> {
    let at = s.max(1.0);
    let ratio = (SQRT_2 + at) * (SQRT_2 - 1.0) / ((SQRT_2 - at) * (SQRT_2 + 1.0));
    (s < SQRT_2).then(|| 1.0 - at + libm::log(ratio) / 8_f64.sqrt())
}

/// `v / c` of a front without radiation that meets `q = du/dt - du/dx`; below 0 it stands.
pub fn speed_by_flux(q: f64, d: f64) -> f64 {
    (q * q - d) / (q * q + d)
}

/// `v / c` of a front without prestress and radiation that the force `F` pulls at its end; `None` for `d > F^2`.
pub fn pulled_speed(force: f64, d: f64) -> Option<f64> {
    (force > 0.0 && d <= force * force).then(|| (1.0 - d / (force * force)).sqrt())
}

/// The speed that a front with radiation approaches as `tau` becomes 1.
pub fn fastest(alpha: f64, d: f64) -> f64 {
    1.0 / (1.0 + 0.25 * alpha * alpha * d).sqrt()
}

/// The `tau` that drives a front with radiation at a speed `v / c`; 1 from [`fastest`] on.
pub fn radiating_prestress(speed: f64, alpha: f64, d: f64) -> f64 {
    let zeta = 0.5 * alpha * speed * (d / (1.0 - speed * speed).max(0.0)).sqrt();
    if zeta >= 1.0 {
        return 1.0;
    }
    let turned = zeta * (PI - libm::acos(zeta)) / (1.0 - zeta * zeta).sqrt();
    1.0 / (1.0 + libm::exp(-turned) / (2.0 * zeta))
}

/// `F_T / F_N` at which a crack that follows a side drive reaches a block, counted from 1, of an evenly loaded chain:
/// where friction weakens too slowly for jumps, so that all forces balance.
///
/// Block `j` behind the tip has slid by `u_j`, which the spring to it must pull with `mu_s p` for `j = 1`.
pub fn creep_load_ratio(block: u32, blocks: u32, [mu_s, mu_d]: [f64; 2], d: f64) -> f64 {
    let r = mu_s / (mu_s - mu_d);
    let (mut before, mut slip, mut sum) = (0.0, r, r);
    for _ in 1..block {
        let strength = f64::max(0.0, 1.0 - slip / d);
        (before, slip) = (slip, 2.0 * slip - before + r - 1.0 + strength);
        sum += strength;
    }
    (mu_d * (f64::from(block) - 1.0) + (mu_s - mu_d) * sum) / f64::from(blocks)
}

/// A single block, in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneBlock {
    /// `m`.
    pub mass_kg: f64,
    /// `K`.
    pub drive_n_per_m: f64,
    /// `V`, above 0.
    pub velocity_m_per_s: f64,
    /// `mu_s F_N`.
    pub static_n: f64,
    /// `mu_d F_N`.
    pub dynamic_n: f64,
    /// `D_c`.
    pub weakening_slip_m: f64,
}

/// The slip of a single block that has rested.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OneSlip {
    /// From detachment to rest.
    pub slip_m: f64,
    /// From detachment to rest.
    pub duration_s: f64,
    /// `F_T` at its end.
    pub end_n: f64,
    /// `G`.
    pub fracture_j: f64,
}

impl OneBlock {
    /// Its slip; `None` if `k_w <= K`, where it follows the drive.
    ///
    /// Up to `D_c` it has slid by `x = K V / (m kappa^3) (sinh kappa t - kappa t)` with `kappa^2 = (k_w - K) / m`; then it
    /// swings on `K` about the displacement at which `F_T = mu_d F_N`, until its velocity is 0.
    pub fn slip(&self) -> Option<OneSlip> {
        let OneBlock { mass_kg, drive_n_per_m: k, velocity_m_per_s: v, weakening_slip_m: d_m, .. } = *self;
        let fall_n = self.static_n - self.dynamic_n;
        if fall_n <= k * d_m {
            return None;
        }
        let kappa = ((fall_n / d_m - k) / mass_kg).sqrt();
        let unit_m = k * v / (mass_kg * kappa * kappa * kappa);
        // sinh z - z is above z^3 / 6, which bounds the bisection.
        let (mut low, mut high) = (0.0, libm::cbrt(6.0 * d_m / unit_m));
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            let is_short = (libm::sinh(middle) - middle) * unit_m < d_m;
            (low, high) = if is_short { (middle, high) } else { (low, middle) };
        }
        let weakening_s = low / kappa;
        let omega = (k / mass_kg).sqrt();
        // Relative to the center of the swing, which moves with the drive.
        let from_m = d_m - fall_n / k - v * weakening_s;
        let from_m_per_s = unit_m * kappa * (libm::cosh(low) - 1.0) - v;
        let size_m = libm::hypot(from_m, from_m_per_s / omega);
        let end = libm::acos(-v / (size_m * omega));
        let duration_s = weakening_s + (end - libm::atan2(from_m, from_m_per_s / omega)) / omega;
        let end_m = size_m * libm::sin(end);
        Some(OneSlip {
            slip_m: end_m + fall_n / k + v * duration_s,
            duration_s,
            end_n: self.dynamic_n - k * end_m,
            fracture_j: 0.5 * fall_n * d_m,
        })
    }
}

/// `k_w` of a block, counted from 0, at its steepest and under the largest load of the run; infinite where friction
/// falls at once, 0 of a block that never detaches.
pub fn weakening_n_per_m(plan: &Plan, block: usize) -> f64 {
    let (friction, of_load) = (&plan.friction, plan.load_course.largest());
    let of_contact = plan.contact_load_course.as_ref().map_or(1.0, |course| course.largest(block));
    let Some(fall) = friction.law.weakening() else { return f64::INFINITY };
    if friction.static_coefficients[block] >= STUCK_COEFFICIENT {
        return 0.0;
    }
    let fall_n = friction.static_threshold_n[block] - friction.dynamic_friction_n[block];
    of_load * of_contact * fall.steepest() * fall_n / friction.weakening_slip_m[block]
}

/// `sqrt(m / k_w)` of the block whose friction falls most steeply, s; `None` if friction falls at once.
pub(crate) fn fall_time_s(plan: &Plan) -> Option<f64> {
    steepest_n_per_m(plan).map(|fall| (plan.block_mass_kg / fall).sqrt())
}

/// The largest `k_w` of all blocks.
fn steepest_n_per_m(plan: &Plan) -> Option<f64> {
    (0..plan.blocks).map(|n| weakening_n_per_m(plan, n)).filter(|fall| fall.is_finite()).reduce(f64::max)
}

/// What a plan's friction that falls over a slip says before a run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Weakening {
    /// `k_w`, the largest of all blocks that can slide.
    pub weakening_n_per_m: f64,
    /// `d = k / k_w`; 0 of a single block, which has no `k`.
    pub weakening_slip_ratio: f64,
    /// Blocks over which slip nucleates between stuck ones; `None` if a drive may hold any number, and of one block.
    pub nucleation_blocks: Option<f64>,
}

impl Weakening {
    /// That of a plan; `None` if friction falls at once, and of slabs, sheets and bodies.
    pub fn of(plan: &Plan) -> Option<Weakening> {
        plan.elastic.as_chain()?;
        let held_n_per_m = plan.drive.stiffness_n_per_m(plan.blocks).into_iter().reduce(f64::min)?;
        Some(Weakening::new(steepest_n_per_m(plan)?, plan.elastic.stiffness_n_per_m, held_n_per_m))
    }

    /// That of `k_w`, `k` and the least stiffness with which a drive holds a block, N/m.
    pub fn new(weakening_n_per_m: f64, k_n_per_m: f64, held_n_per_m: f64) -> Weakening {
        let d = k_n_per_m / weakening_n_per_m;
        let nucleation_blocks = Beginning::Stuck.nucleation_blocks(d, held_n_per_m / k_n_per_m);
        Weakening { weakening_n_per_m, weakening_slip_ratio: d, nucleation_blocks }
    }
}

#[cfg(test)]
mod tests {
    use super::Beginning::{Free, Stuck};
    use super::*;
    use crate::theory::front::Front;

    /// The rows of a table of an independent program: its numbers, NaN for words.
    fn rows(name: &str) -> Vec<Vec<f64>> {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/reference/slip-weakening");
        let text = std::fs::read_to_string(format!("{folder}/{name}.csv")).expect("the table is there");
        let numbers = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(f64::NAN)).collect();
        text.lines().skip(1).map(numbers).collect()
    }

    fn radiating(prestress: f64, relative_radiation: f64, weakening_slip: f64) -> Front {
        Front { prestress, relative_radiation, weakening_slip, ..Front::default() }
    }

    fn pulse(prestress: f64, top_stiffness: f64, weakening_slip: f64) -> Front {
        Front { prestress, top_stiffness, weakening_slip, ..Front::default() }
    }

    #[track_caller]
    fn near(found: f64, expected: f64, tolerance: f64) {
        assert!((found - expected).abs() <= tolerance, "{found}, not {expected} within {tolerance}");
    }

    /// A mode of one sign is the softest; its stiffness is that of the matrix of the chain.
    #[test]
    fn slip_runs_away_below_the_stiffness_of_the_softest_mode() {
        near(Stuck.critical_slip(1, 0.0), 0.5, 1e-15);
        near(Free.critical_slip(1, 0.0), 1.0, 1e-15);
        near(Stuck.critical_slip(1, 0.5), 0.4, 1e-15);
        for n in 1..9_u32 {
            for (beginning, first) in [(Stuck, 0.0), (Free, 0.5 * f64::from(2 * n + 1))] {
                let waves = f64::from(if beginning == Free { 2 * n + 1 } else { n + 1 });
                let mode = |i: f64| (PI * (i + first) / waves).sin();
                let mode = |i: f64| if beginning == Free { (PI * (i - 0.5) / waves).cos() } else { mode(i) };
                let stiffness = 1.0 / beginning.critical_slip(n, 0.25);
                for i in (1..=n).map(f64::from) {
                    assert!(mode(i) > 0.0);
                    let pull = 2.25 * mode(i) - mode(i - 1.0) - mode(i + 1.0);
                    near(pull, stiffness * mode(i), 1e-13);
                }
            }
        }
        // Of many blocks pi sqrt(k / k_w), and half of it.
        let many = |beginning: Beginning, n| {
            beginning.nucleation_blocks(beginning.critical_slip(n, 1e-3), 1e-3).unwrap()
        };
        near(many(Stuck, 30), 31.0, 0.02);
        near(many(Free, 30), 30.5, 0.02);
        near(Stuck.nucleation_blocks(25.0, 0.0).unwrap(), 5.0 * PI, 1e-12);
        assert_eq!(Stuck.nucleation_blocks(25.0, 0.04), None, "the drive holds any number");
    }

    #[test]
    fn one_block_slips_as_simulated() {
        let block = OneBlock {
            mass_kg: 0.012,
            drive_n_per_m: 8e5,
            velocity_m_per_s: 1e-4,
            static_n: 280.0,
            dynamic_n: 180.0,
            weakening_slip_m: 1e-5,
        };
        let slip = block.slip().unwrap();
        near(slip.slip_m, 2.450_086e-4, 5e-11);
        near(slip.duration_s, 7.491_840e-4, 5e-11);
        near(slip.end_n / 400.0, 0.210_132_65, 5e-9);
        near(slip.fracture_j, 5e-4, 1e-18);
        // By an independent program: 74,918 steps of 10 ns.
        near(slip.duration_s / 1e-8, 74_918.0, 1.0);
        // As D_c vanishes, 2 (mu_s - mu_d) F_N / K; from k_w = K on the block follows the drive.
        near(OneBlock { weakening_slip_m: 1e-12, ..block }.slip().unwrap().slip_m, 2.5e-4, 2e-7);
        assert!(OneBlock { weakening_slip_m: 1.2499e-4, ..block }.slip().is_some());
        assert_eq!(OneBlock { weakening_slip_m: 1.25e-4, ..block }.slip(), None);
    }

    /// Simulated to all digits: 50 blocks, 0.4 us, viscosity 0.3, blocks 10 to 25.
    #[test]
    fn a_crack_that_follows_a_side_drive_needs_the_load_of_its_zone() {
        for (d, bracket) in [(5.0, 3.24), (20.0, 4.4417)] {
            for block in 10..=25 {
                let load = creep_load_ratio(block, 50, [0.7, 0.45], d) * 50.0;
                near((load - 0.45 * f64::from(block - 1)) / 0.25, bracket, 6e-5);
            }
        }
        near(creep_load_ratio(1, 50, [0.7, 0.45], 5.0), 0.7 / 50.0, 1e-15);
    }

    #[test]
    fn fronts_with_radiation_run_as_the_closed_form_says() {
        let listed =
            [(0.1, 0.102_257), (0.3, 0.322_804), (0.5, 0.573_086), (0.6, 0.714_890), (0.8, 1.059_067)];
        let table = rows("front-radiation-continuum");
        assert_eq!(table.len(), 11);
        let all =
            table.iter().map(|row| (row[0], row[2], 3e-9)).chain(listed.map(|(tau, zeta)| (tau, zeta, 5e-7)));
        for (tau, two_zeta, tolerance) in all {
            let v = radiating(tau, 0.5, 4.0).speed_over_c().unwrap();
            near(v / (1.0 - v * v).sqrt(), two_zeta, tolerance * (1.0 + two_zeta * two_zeta).powf(1.5));
        }
        let (mut compared, mut claimed) = (0, 0);
        for row in rows("front-radiation") {
            let [tau, alpha, d, _, simulated, _, continuum] = row[..] else { panic!("{row:?}") };
            let v = radiating(tau, alpha, d).speed_over_c().unwrap();
            near(v, continuum, 6e-7);
            compared += 1;
            if tau >= 0.6 && d * (1.0 - v * v) >= 20.0 {
                near(simulated / v, 1.0, 3e-3);
                claimed += 1;
            }
            let ratio = match (tau, alpha, d) {
                (0.6, 1.0, 25.0) => 0.9981,
                (0.6, 1.0, 100.0) => 0.9997,
                (0.6, 0.05, 400.0) => 1.0000,
                (0.6, 1.0, 5.0) => 0.989,
                (0.6, 1.0, 1.0) => 0.917,
                _ => continue,
            };
            near(simulated / v, ratio, if ratio > 0.99 { 6e-5 } else { 5e-4 });
        }
        assert!(compared == 26 && claimed == 10, "{compared} {claimed}");
        // The balance of energy is the limit of small tau; a curve ends at the fastest front.
        let v = radiating(1e-4, 1.0, 100.0).speed_over_c().unwrap();
        near(v / 1e-5, 1.0, 2e-4);
        assert_eq!(radiating(0.0, 1.0, 100.0).speed_over_c(), None);
        assert_eq!(radiating(1.0, 1.0, 100.0).speed_over_c(), None);
        let curve = radiating(0.5, 1.0, 25.0).curve(2.0);
        assert!(curve.is_sorted_by(|a, b| a.0 < b.0 && a.1 < b.1) && curve.len() > 100, "{curve:?}");
        near(curve.last().unwrap().1, 1.0 / 7.25_f64.sqrt(), 1e-12);
    }

    #[test]
    fn a_force_at_the_end_pulls_fronts_against_fracture_energy() {
        for (force, d, v, simulated) in
            [(12.0, 100.0, 0.5528, 0.552), (12.0, 50.0, 0.8079, 0.805), (20.0, 200.0, 0.5 * SQRT_2, 0.709)]
        {
            let found = pulled_speed(force, d).unwrap();
            near(found, v, 5e-5);
            near(simulated / found, 1.0, 0.02);
        }
        assert_eq!((pulled_speed(12.0, 145.0), pulled_speed(0.0, 0.0)), (None, None));
    }

    /// Without radiation and drive no closed form is known: speeds of the lattice fall with `d`, from that for `d = 0`.
    #[test]
    fn fronts_without_radiation_are_slower_than_with_friction_that_falls_at_once() {
        let table = rows("front-speed");
        assert_eq!(table.len(), 40);
        let listed = [
            (0.6, [1.25, 1.1824, 1.1241, 1.0622, 1.0234, 1.0137]),
            (0.8, [1.6667, 1.4713, 1.3093, 1.1478, 1.0547, 1.0327]),
            (0.9, [2.2942, 1.8523, 1.5249, 1.2360, 1.0862, 1.0515]),
        ];
        for (tau, speeds) in listed {
            near(radiating(tau, 0.0, 0.0).speed_over_c().unwrap(), speeds[0], 5e-5);
            assert!(speeds.is_sorted_by(|a, b| a > b && *b > 1.0));
            for (d, speed) in [0.001, 0.01, 0.1, 1.0, 3.0].into_iter().zip(&speeds[1..]) {
                let row = table.iter().find(|row| row[0] == tau && row[1] == d).unwrap();
                near(row[2], *speed, 1e-4);
                assert_eq!(radiating(tau, 0.0, d).speed_over_c(), None);
            }
        }
    }

    /// Pulses of an independent program cross 200 blocks 0.003 above the least prestress, and stop within 93 as far below.
    #[test]
    fn pulses_slip_less_by_the_fracture_energy_and_end_sooner() {
        let gamma = 0.65;
        for tau in [0.3, 0.6, 0.9] {
            for share in [0.1, 0.5, 0.9] {
                let d = share * tau * tau / gamma;
                let slip = pulse(tau, gamma, d).pulse_slip().unwrap();
                near(tau * slip, 0.5 * (gamma * slip * slip + d), 1e-14);
                assert!(slip > tau / gamma, "the larger root");
                // The one of these that dies.
                assert_eq!(tau + slip < 1.0, (tau, share) == (0.3, 0.9));
                assert_eq!(pulse(tau, gamma, d).arrest_prestress() > tau, tau + slip < 1.0);
            }
            assert_eq!(pulse(tau, gamma, 1.1 * tau * tau / gamma).pulse_slip(), None);
            assert_eq!(pulse(tau, gamma, 0.0).pulse_slip(), Some(2.0 * tau / gamma));
        }
        for (d, least) in
            [(0.0, 0.2453), (0.05, 0.2712), (0.1, 0.2991), (0.2, 0.3639), (0.3, 0.4416), (0.6, 0.6245)]
        {
            near(pulse(0.5, gamma, d).arrest_prestress(), least, 5e-5);
        }
        // Behind these barriers all pulses stop.
        let table = rows("pulse-arrest");
        assert_eq!(table.len(), 24);
        for row in &table {
            let [gamma, tau, share, d, _, _, length] = row[..] else { panic!("{row:?}") };
            near(gamma * d / (tau * tau), share, 1e-4);
            assert_eq!(pulse(tau, gamma, d).pulse_slip(), None);
            // Measured: below 0.01, the length times sqrt(gamma) does not depend on gamma.
            if gamma == 0.0065 && [1.3, 1.6, 2.0, 3.0].contains(&share) {
                let other = table.iter().find(|other| other[0] == 0.00065 && other[1..3] == row[1..3]);
                near(length / other.unwrap()[6], 1.0, 0.05);
            }
        }
    }

    #[test]
    fn what_holds_where_friction_falls_at_once_is_not_said_of_others() {
        let slow = radiating(1e-5, 10.0, 1.0);
        assert_eq!((slow.slow_duration(8), slow.static_slip_sum(3)), (None, None));
        assert!(slow.has_speed() && !pulse(0.5, 0.65, 0.1).has_speed());
        assert!(!Front { relative_damping: 0.1, ..slow }.has_speed());
        assert_eq!(Front { relative_damping: 0.1, ..slow }.speed_over_c(), None);
    }

    #[test]
    fn cracks_stop_behind_a_barrier_of_fracture_energy() {
        // By small steps along dx/dt = v with q = tau (3 x - t) / 2.
        let (tau, d, n) = (0.1, 8000.0_f64, 1000.0);
        let (mut x, mut t, mut q) = (n, n, tau * n);
        let s = q / d.sqrt();
        while q * q > d * (1.0 + 1e-9) && x < 2.0 * n {
            let v = speed_by_flux(q, d);
            let middle = speed_by_flux(tau * (3.0 * (x + 0.01 * v) - t - 0.01) / 2.0, d);
            (x, t) = (x + 0.02 * middle, t + 0.02);
            q = tau * (3.0 * x - t) / 2.0;
        }
        near((x - n) * tau / d.sqrt(), arrest_length(s).unwrap(), 1e-4);
        assert_eq!(
            (arrest_length(0.9), arrest_length(1.0), arrest_length(SQRT_2)),
            (Some(0.0), Some(0.0), None)
        );
        near(speed_by_flux(3.0, 3.0), 0.5, 1e-15);

        let table = rows("crack-arrest");
        assert_eq!(table.len(), 15);
        for row in &table {
            let [_, tau, n, s, d, behind, of] = row[..] else { panic!("{row:?}") };
            let twice = tau * n / d.sqrt();
            let is_free = (s / twice - 2.0).abs() < 1e-3;
            let found = if is_free { Free } else { Stuck }.blocks_behind_barrier(tau, n as u32, d);
            match (is_free, tau <= 0.1 && s <= 1.2, found) {
                (false, true, Some(found)) => near(behind / found, 1.0, 0.12),
                // The free end holds the front a zone ahead at most.
                (true, _, Some(found)) => assert!(s <= 1.0 && behind <= found && behind < of),
                (true, _, None) => assert!(s > 1.0),
                _ => assert!(s >= 1.1),
            }
        }
        // Theory and zone, as on the lattice 147, 199 and 403; passes at 1.35, so that the limit sqrt(2) is within 12 %.
        for (s, listed) in [(1.1, 154.0), (1.2, 182.0), (1.3, 272.0)] {
            near(Stuck.blocks_behind_barrier(0.1, 1000, (100.0 / s) * (100.0 / s)).unwrap(), listed, 0.5);
        }
        for (s, zone) in [(1.05, 299.0), (1.1, 286.0), (1.2, 262.0)] {
            near(0.5 * PI * 200.0 / s, zone, 0.5);
        }
        for limit in [1.28, 1.33] {
            near(limit / SQRT_2, 1.0, 0.12);
        }
    }

    #[test]
    fn a_plan_says_how_steep_its_friction_falls() {
        let of = Weakening::new(8e6, 2.0e8, 0.0);
        assert_eq!((of.weakening_n_per_m, of.weakening_slip_ratio), (8e6, 25.0));
        near(of.nucleation_blocks.unwrap(), 5.0 * PI, 1e-12);
        assert_eq!(Weakening::new(8e6, 2.0e8, 8e6).nucleation_blocks, None);
        assert_eq!(Weakening::new(8e6, 0.0, 8e5).nucleation_blocks, None, "one block");
    }
}
