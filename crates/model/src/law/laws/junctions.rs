//! Contacts of many junctions that break one by one and heal after a random time (Tromborg et al., Proc.
//! Natl. Acad. Sci. 111, 8764 (2014)); docs/contacts.md has the law and its sources.
//!
//! Each of `N_s` junctions is a spring of stiffness `k_n` to an anchor `x_j` and bears `f = p / N_s`. A pinned
//! one breaks where `k_n |u - x_j| >= mu_s f`. It then slips for a random time: its anchor is dragged so that
//! `k_n |u - x_j| <= mu_d f`. After that it is pinned without force where the contact is. Friction is
//! `-k_n (N_s u - A)`, `A` the sum of all anchors.
//!
//! This file has the numbers of the law: stiffnesses, the start, slip times. `asperity_simulator` takes its steps.

use crate::law::{ContactLaw, Sliding, Turn};
use crate::plan::splitmix::mixed;
use crate::scenario::Scenario;
use crate::scenario::choices::JunctionStart;

/// The law with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Junctions {
    /// `N_s`.
    pub count: usize,
    /// `kappa`, of `k_n = sqrt(kappa f)` at the load of rest.
    pub constant_n_per_m2: f64,
    /// Mean of the normal distribution of slip times, before times of 0 or below are drawn again.
    pub healing_time_s: f64,
    /// Its deviation; times of 0 or below are drawn again.
    pub healing_deviation_s: f64,
    /// `w`: the spread of the junctions' forces at the start, over `f`.
    pub width: f64,
    /// Whether the forces at the start are drawn, and not evenly spread.
    pub are_drawn: bool,
    /// Seed of all that is drawn.
    pub seed: u32,
    /// Share of slipping junctions from which a contact slides.
    pub sliding_share: f64,
}

impl Junctions {
    /// `N_s k_n`: the stiffness of a contact that bears `normal_load_n` at rest, N/m.
    pub fn stiffness_n_per_m(&self, normal_load_n: f64) -> f64 {
        (self.constant_n_per_m2 * normal_load_n * self.count as f64).sqrt()
    }

    /// `q_j` of the junctions of contact `n`, counted from 0: their forces at the start differ by `w f q_j` from
    /// their mean.
    pub fn offsets(&self, n: usize) -> Vec<f64> {
        let count = self.count as f64;
        if !self.are_drawn {
            return (0..self.count).map(|j| (j as f64 + 0.5) / count - 0.5).collect();
        }
        let drawn: Vec<f64> = (0..self.count).map(|j| unit(self.word(n, j, 0, 0))).collect();
        let mean = drawn.iter().sum::<f64>() / count;
        drawn.iter().map(|r| r - mean).collect()
    }

    /// The largest friction, over the normal load, of a contact that is pulled from its start before any broken
    /// junction is pinned again: the largest over `m` of what is borne when the first `m` junctions slip.
    pub fn peak_coefficient(&self, mu_s: f64, mu_d: f64) -> f64 {
        let count = self.count as f64;
        let borne = |broken: usize| {
            let (broken, pinned) = (broken as f64, (self.count - broken) as f64);
            (pinned * (mu_s - self.width * (pinned - 1.0) / (2.0 * count)) + broken * mu_d) / count
        };
        (0..self.count).map(borne).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The largest friction, over its normal load, that contact `n`, counted from 0, bears on its way from its start
    /// until it slides, pulled either way before any junction is pinned again; 0 if it slides from the start.
    /// `shear` is its friction at rest, `mu_s` and `mu_d` are its coefficients.
    pub fn yield_coefficient(&self, n: usize, shear: f64, [mu_s, mu_d]: [f64; 2]) -> f64 {
        let (mut offsets, count) = (self.offsets(n), self.count as f64);
        let broken = offsets.iter().filter(|q| (shear + self.width * **q).abs() >= mu_s).count();
        if self.slides(broken as u32) {
            return 0.0;
        }
        // The last junction before those that must break for the contact to slide.
        let least = (0..self.count).find(|broken| self.slides(*broken as u32 + 1)).unwrap_or(self.count - 1);
        let mut most = |way: f64| {
            offsets.sort_by(|a, b| (way * b).total_cmp(&(way * a)));
            let mut pinned: f64 = offsets.iter().sum();
            let mut most = f64::NEG_INFINITY;
            for (broken, q) in offsets.iter().enumerate().take(least + 1) {
                // The next to break has the largest of the pinned forces.
                let left = count - broken as f64;
                let borne = left * mu_s - self.width * (left * way * q - way * pinned) + broken as f64 * mu_d;
                most = most.max(borne / count);
                pinned -= q;
            }
            most
        };
        most(1.0).min(most(-1.0)).max(0.0)
    }

    /// Whether a contact slides with this many slipping junctions: from the given share on. The quotient of two
    /// whole numbers is the double nearest to the share, so decimals are met exactly.
    #[inline]
    pub fn slides(&self, slipping: u32) -> bool {
        f64::from(slipping) / self.count as f64 >= self.sliding_share
    }

    /// Friction, over the normal load, of steady sliding at a velocity, for any distribution of slip times:
    /// junctions take a mean `mu_s / 2` while they are pinned, over the way at which they break, and `mu_d` while
    /// they slip.
    pub fn steady_coefficient(
        &self,
        [mu_s, mu_d]: [f64; 2],
        normal_load_n: f64,
        velocity_m_per_s: f64,
    ) -> f64 {
        let pinned_s = mu_s * normal_load_n / self.stiffness_n_per_m(normal_load_n) / velocity_m_per_s;
        (0.5 * mu_s * pinned_s + mu_d * self.healing_time_s) / (pinned_s + self.healing_time_s)
    }

    /// How far a contact slips forwards, held by a spring, after all of its junctions have come to rest slipping
    /// forwards in balance with it: until all are pinned, m.
    pub fn slow_slip_m(&self, mu_d: f64, normal_load_n: f64, spring_n_per_m: f64) -> f64 {
        let count = self.count as f64;
        let junction_n_per_m = self.stiffness_n_per_m(normal_load_n) / count;
        let slip_n = mu_d * normal_load_n / count;
        (1..=self.count).map(|pinned| slip_n / (spring_n_per_m + pinned as f64 * junction_n_per_m)).sum()
    }

    /// The number of whole steps, 1 or more, for which junction `j` of contact `n`, both counted from 0, slips
    /// after its break `count`, counted from 1.
    pub fn slip_steps(&self, n: usize, j: usize, count: u64, step_s: f64) -> u64 {
        ((self.slip_time_s(n, j, count) / step_s).round() as u64).max(1)
    }

    /// The time of which these are the nearest steps (Box and Muller 1958).
    pub fn slip_time_s(&self, n: usize, j: usize, count: u64) -> f64 {
        let mut attempt = 0;
        loop {
            let r1 = ((self.word(n, j, count, attempt) >> 11) + 1) as f64 / TWO_TO_53;
            let r2 = unit(self.word(n, j, count, attempt + 1));
            let normal = (-2.0 * libm::log(r1)).sqrt() * libm::cos(std::f64::consts::TAU * r2);
            let time_s = self.healing_time_s + self.healing_deviation_s * normal;
            if time_s > 0.0 {
                return time_s;
            }
            attempt += 2;
        }
    }

    /// The pseudo-random number of attempt `q` at break `count` of junction `j` of contact `n`, counted from 0.
    fn word(&self, n: usize, j: usize, count: u64, attempt: u64) -> u64 {
        let contact = mixed((u64::from(self.seed) << 32).wrapping_add(n as u64 + 1));
        mixed(contact ^ ((j as u64) << 40).wrapping_add(count << 8).wrapping_add(attempt))
    }
}

const TWO_TO_53: f64 = (1_u64 << 53) as f64;

/// A pseudo-random number as one from 0 to 1, excluded.
fn unit(word: u64) -> f64 {
    (word >> 11) as f64 / TWO_TO_53
}

/// In the loops over contacts, a contact of this law is free: its junctions pull at it from outside, and decide
/// whether it slides.
impl ContactLaw for Junctions {
    const KEYS: &'static [&'static str] = &[
        "friction.junction_count",
        "friction.junction_constant_n_per_m2",
        "friction.healing_time_s",
        "friction.healing_deviation_s",
        "friction.junction_width",
        "friction.junction_start",
        "friction.junction_seed",
        "friction.sliding_share",
    ];

    fn of(scenario: &Scenario) -> Junctions {
        let friction = &scenario.friction;
        Junctions {
            count: friction.junction_count as usize,
            constant_n_per_m2: friction.junction_constant_n_per_m2,
            healing_time_s: friction.healing_time_s,
            healing_deviation_s: friction.healing_deviation_s,
            width: friction.junction_width,
            are_drawn: friction.junction_start == JunctionStart::Drawn,
            seed: friction.junction_seed,
            sliding_share: friction.sliding_share,
        }
    }

    #[inline(always)]
    fn drag_n(&self, _: &Sliding<'_>) -> [f64; 1] {
        [0.0]
    }

    #[inline(always)]
    fn re_attaches(&self, _: &Turn) -> bool {
        false
    }
}

#[cfg(test)]
mod tests {
    use crate::resolve;
    use crate::{Junctions, Plan};

    fn law(sets: &[&str]) -> Junctions {
        let scenario = resolve("slab-junctions", sets).unwrap_or_else(|error| panic!("{error}"));
        scenario.contact_law().junctions().expect("it is this law")
    }

    #[test]
    fn slip_times_are_those_that_the_page_states() {
        let law = law(&[]);
        assert_eq!(law.word(0, 0, 1, 0), 0x2053_2587_8fde_c8d8);
        assert_eq!(law.word(1, 2, 4, 1), 0xe3c4_4852_ece6_0011);
        let time_s = law.slip_time_s(0, 0, 1);
        assert_eq!(format!("{:.14}", 1e3 * time_s), "2.64220559174138");
        assert_eq!(law.slip_steps(0, 0, 1, 2e-7), 13_211);
        assert_eq!(law.slip_steps(0, 0, 1, 1.0), 1, "at least one step");
    }

    #[test]
    fn slip_times_have_the_mean_and_the_deviation_that_were_asked_for() {
        let law = law(&["friction.healing_deviation_s=3e-4"]);
        let times: Vec<f64> = (0..100)
            .flat_map(|j| (1..=100).map(move |c| (j, c)))
            .map(|(j, c)| law.slip_time_s(3, j, c))
            .collect();
        let mean = times.iter().sum::<f64>() / 1e4;
        let deviation = (times.iter().map(|t| (t - mean) * (t - mean)).sum::<f64>() / 1e4).sqrt();
        // Three standard errors.
        assert!((mean - 2e-3).abs() < 9e-6, "{mean}");
        assert!((deviation - 3e-4).abs() < 7e-6, "{deviation}");
        let wide = self::law(&["friction.healing_deviation_s=0.01"]);
        assert!((1..1000).all(|count| wide.slip_time_s(0, 0, count) > 0.0), "a time is above 0");
    }

    #[test]
    fn a_contact_yields_when_enough_junctions_have_broken() {
        let mu = [0.4, 0.17];
        for sets in [&["friction.junction_width=0.3"][..], &["friction.junction_width=0.1"]] {
            let law = law(&[sets, &["friction.sliding_share=1"]].concat());
            // By the closed form, whose largest comes before all junctions slip.
            let (found, form) = (law.yield_coefficient(3, 0.1, mu), law.peak_coefficient(mu[0], mu[1]));
            assert!((found - form).abs() < 1e-12, "{found} {form}");
        }
        // The first junction suffices, which bears half a width more than the mean.
        let first = law(&["friction.junction_width=0.5", "friction.sliding_share=0.001"]);
        assert!((first.yield_coefficient(0, 0.0, mu) - (0.4 - 0.25 * 0.99)).abs() < 1e-12);
        let wide = law(&["friction.junction_width=2"]);
        assert_eq!(wide.yield_coefficient(0, 0.0, mu), 0.0, "six of ten are beyond their strength at rest");
        let drawn = law(&["friction.junction_start=drawn", "friction.junction_width=0.3"]);
        let [a, b] = [0, 1].map(|n| drawn.yield_coefficient(n, 0.0, mu));
        assert!(a != b && (a - b).abs() < 0.05, "{a} {b}");
    }

    /// `0.55 * 100` is a little above 55.
    #[test]
    fn decimal_shares_are_met_exactly() {
        for percent in 1..=100 {
            let law = law(&[&format!("friction.sliding_share={}", f64::from(percent) / 100.0)]);
            assert!(law.slides(percent) && !law.slides(percent - 1), "{percent}");
        }
    }

    #[test]
    fn the_start_is_in_balance_whatever_is_drawn() {
        for sets in [&[][..], &["friction.junction_start=drawn"]] {
            let law = law(sets);
            let offsets = law.offsets(5);
            assert!(offsets.iter().sum::<f64>().abs() < 1e-13 && offsets.len() == 100);
            assert!(offsets.iter().all(|q| q.abs() < 0.6));
        }
        let plan = Plan::new(&resolve::<&str>("slab-junctions", &[]).unwrap());
        let tau_n = crate::plan::slab::tangential_force_n(&plan);
        for (n, tau_n) in tau_n.iter().enumerate().take(plan.blocks) {
            let held_n = plan.friction.contact_stiffness_n_per_m[n]
                * (plan.initial.displacement_m[n] - plan.initial.stick_position_m[n]);
            assert!((held_n - tau_n).abs() < 1e-9, "contact {}: {held_n} {tau_n}", n + 1);
        }
    }
}
