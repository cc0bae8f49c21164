//! Disorder: what is added to the friction coefficients, friction springs and normal loads of single contacts, from
//! lists or drawn.
//!
//! A draw is a function of seed, quantity and contacts alone. A distribution turns a uniform number, or a standard
//! normal one, into an offset. With a correlation length the normal numbers `g` of the contacts are a stationary
//! sequence of correlation `exp(-(|dx| + |dy|) / length)`, autoregressive of first order along either axis, and the
//! uniform ones are `Phi(g)`: a Gaussian copula.

use crate::plan::splitmix::mixed;
use crate::scenario::Scenario;
use crate::scenario::choices::Distribution;
use crate::scenario::keys::Disorder;

/// Static coefficient of a block that never slides.
pub(crate) const STUCK_COEFFICIENT: f64 = 1e6;

/// A quantity that differs from contact to contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// `mu_s`.
    Static,
    /// `mu_d`.
    Dynamic,
    /// `k_t` over its mean.
    Stiffness,
    /// `p` over that without disorder.
    Load,
}

impl Quantity {
    /// All, in the order in which texts list what is drawn.
    pub(crate) const ALL: [Quantity; 4] =
        [Quantity::Static, Quantity::Dynamic, Quantity::Stiffness, Quantity::Load];

    /// The keys of the spread and of the list.
    fn keys(self) -> [&'static str; 2] {
        match self {
            Quantity::Static => ["friction.static_spread", "friction.static_offsets"],
            Quantity::Dynamic => ["friction.dynamic_spread", "friction.dynamic_offsets"],
            Quantity::Stiffness => ["disorder.stiffness_spread", "disorder.stiffness_offsets"],
            Quantity::Load => ["disorder.load_spread", "disorder.load_offsets"],
        }
    }

    /// The key of the spread.
    pub(crate) fn spread_key(self) -> &'static str {
        self.keys()[0]
    }

    /// The key of the list.
    pub(crate) fn offsets_key(self) -> &'static str {
        self.keys()[1]
    }

    /// The spread and the offsets that a scenario gives, and the value without them.
    fn given(self, scenario: &Scenario) -> (f64, &[f64], f64) {
        let (friction, disorder, [mu_s, mu_d]) =
            (&scenario.friction, &scenario.disorder, scenario.mean_coefficients());
        match self {
            Quantity::Static => (friction.static_spread, &friction.static_offsets, mu_s),
            Quantity::Dynamic => (friction.dynamic_spread, &friction.dynamic_offsets, mu_d),
            Quantity::Stiffness => (disorder.stiffness_spread, &disorder.stiffness_offsets, 1.0),
            Quantity::Load => (disorder.load_spread, &disorder.load_offsets, 1.0),
        }
    }

    /// The spread that a scenario gives.
    pub(crate) fn spread(self, scenario: &Scenario) -> f64 {
        self.given(scenario).0
    }

    /// The offsets that a scenario lists.
    pub(crate) fn offsets(self, scenario: &Scenario) -> &[f64] {
        self.given(scenario).1
    }

    /// Whether it is the same at all contacts.
    pub(crate) fn is_even(self, scenario: &Scenario) -> bool {
        self.spread(scenario) == 0.0 && self.offsets(scenario).is_empty()
    }

    /// The value at every contact.
    pub(crate) fn values(self, scenario: &Scenario) -> Vec<f64> {
        let ((_, listed, mean), drawn) = (self.given(scenario), self.drawn(scenario));
        let at = |values: &[f64], n: usize| values.get(n).copied().unwrap_or(0.0);
        (0..scenario.slider.contacts() as usize).map(|n| mean + at(listed, n) + at(&drawn, n)).collect()
    }

    /// What is drawn for every contact; empty without a spread.
    pub(crate) fn drawn(self, scenario: &Scenario) -> Vec<f64> {
        let (spread, _, mean) = self.given(scenario);
        if spread == 0.0 {
            return Vec::new();
        }
        let numbers = Draws { seed: u64::from(scenario.friction.spread_seed), stream: self as u64 };
        let disorder = &scenario.disorder;
        let offset = |drawn: Drawn| drawn.offset(disorder, mean, spread);
        let contacts = u64::from(scenario.slider.contacts());
        if disorder.correlation_length_m == 0.0 {
            let is_normal = matches!(disorder.distribution, Distribution::Normal | Distribution::Lognormal);
            let drawn = |n| {
                if is_normal { Drawn::Gaussian(numbers.gaussian(n)) } else { Drawn::Even(numbers.even(n)) }
            };
            return (0..contacts).map(|n| offset(drawn(n))).collect();
        }
        let follows = libm::exp(-scenario.slider.spacing_m() / disorder.correlation_length_m);
        let columns = scenario.slider.blocks as usize;
        let mut sequence: Vec<f64> = (0..contacts).map(|n| numbers.gaussian(n)).collect();
        // Along each row, then across.
        let rest = (1.0 - follows * follows).sqrt();
        for n in 0..sequence.len() {
            if n % columns > 0 {
                sequence[n] = follows * sequence[n - 1] + rest * sequence[n];
            }
        }
        for n in columns..sequence.len() {
            sequence[n] = follows * sequence[n - columns] + rest * sequence[n];
        }
        sequence.into_iter().map(|g| offset(Drawn::Gaussian(g))).collect()
    }
}

impl Scenario {
    /// Whether friction springs differ from contact to contact.
    pub fn has_spring_factors(&self) -> bool {
        !Quantity::Stiffness.is_even(self)
    }
}

/// `mu_s` and `mu_d` of every contact, including offsets and draws.
pub(crate) fn coefficients(scenario: &Scenario) -> (Vec<f64>, Vec<f64>) {
    let mut static_coefficients = Quantity::Static.values(scenario);
    for block in &scenario.friction.stuck_blocks {
        if let Some(coefficient) = static_coefficients.get_mut(*block as usize - 1) {
            *coefficient = STUCK_COEFFICIENT;
        }
    }
    (static_coefficients, Quantity::Dynamic.values(scenario))
}

/// A stream of pseudo-random numbers: of a quantity of contacts, or of the noise of an instrument.
#[derive(Debug, Clone, Copy)]
pub struct Draws {
    /// The seed, below 2^32.
    pub seed: u64,
    /// Its number, below 4.
    pub stream: u64,
}

impl Draws {
    /// A number from -1 to 1: SplitMix64's output function of seed, stream and contact. There are fewer than 2^29
    /// contacts.
    fn even(&self, contact: u64) -> f64 {
        let stream = (self.stream & 1) << 31 | (self.stream >> 1) << 29;
        let number = mixed((self.seed << 32 | stream | contact).wrapping_add(1));
        (number >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// A standard normal number (Box and Muller 1958), from the even numbers of the contact and of the place
    /// `2^30` behind it.
    pub fn gaussian(&self, contact: u64) -> f64 {
        let [size, angle] = [contact, contact | 1 << 30].map(|place| self.even(place));
        // Above 0, where the logarithm is finite.
        let size = 0.5 * (size + 1.0) + 0.25 * f64::EPSILON;
        (-2.0 * libm::log(size)).sqrt() * libm::cos(std::f64::consts::PI * angle)
    }
}

/// What a quantile is taken of.
enum Drawn {
    /// A number from -1 to 1, uniform.
    Even(f64),
    /// A standard normal one.
    Gaussian(f64),
}

impl Drawn {
    /// As a uniform number.
    fn even(&self) -> f64 {
        match self {
            Drawn::Even(even) => *even,
            Drawn::Gaussian(g) => libm::erf(g * std::f64::consts::FRAC_1_SQRT_2),
        }
    }

    /// The probability of more, above 0.
    fn above(&self) -> f64 {
        match self {
            Drawn::Even(even) => 0.5 * (1.0 - even),
            Drawn::Gaussian(g) => 0.5 * libm::erfc(g * std::f64::consts::FRAC_1_SQRT_2),
        }
    }

    /// As a normal number; a uniform one is never asked for it.
    fn gaussian(&self) -> f64 {
        match self {
            Drawn::Even(even) => *even,
            Drawn::Gaussian(g) => *g,
        }
    }

    /// As a quantile of a distribution, an offset from the mean. The spread is half the width of `uniform`, half the
    /// distance of the values of `two-valued`, of others the standard deviation.
    fn offset(&self, disorder: &Disorder, mean: f64, spread: f64) -> f64 {
        match disorder.distribution {
            Distribution::Uniform => spread * self.even(),
            Distribution::Normal => spread * self.gaussian(),
            Distribution::Lognormal => {
                let ratio = spread / mean;
                let variance = libm::log1p(ratio * ratio);
                mean * libm::expm1(variance.sqrt() * self.gaussian() - 0.5 * variance)
            }
            Distribution::Weibull => {
                let modulus = disorder.weibull_modulus;
                let [first, second] = [1.0, 2.0].map(|order| libm::tgamma(1.0 + order / modulus));
                let value = libm::pow(-libm::log(self.above()), 1.0 / modulus);
                spread * ((value - first) / (second - first * first).sqrt())
            }
            Distribution::TwoValued if self.above() < disorder.asperity_share => spread,
            Distribution::TwoValued => -spread,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Quantity;
    use crate::{Plan, Scenario, ScenarioSource};

    fn scenario(sets: &[&str]) -> Scenario {
        let source =
            sets.iter().fold(ScenarioSource::new("test", ""), |source, set| source.with_override(set));
        Scenario::resolve_with(&source, &crate::Texts).unwrap_or_else(|errors| panic!("{errors}"))
    }

    const MANY: [&str; 2] = ["slider.blocks=40000", "time.step_s=1e-11"];

    /// Mean, standard deviation and skewness of draws.
    fn moments(draws: &[f64]) -> [f64; 3] {
        let count = draws.len() as f64;
        let central =
            |order: i32, mean: f64| draws.iter().map(|value| (value - mean).powi(order)).sum::<f64>() / count;
        let mean = central(1, 0.0);
        let deviation = central(2, mean).sqrt();
        [mean, deviation, central(3, mean) / deviation.powi(3)]
    }

    #[test]
    fn draws_have_the_moments_of_their_distributions() {
        // Skewness of a Weibull distribution of modulus 2, and of a lognormal one of variation 0.1 / 0.7.
        let weibull = 2.0 * std::f64::consts::PI.sqrt() * (std::f64::consts::PI - 3.0)
            / (4.0 - std::f64::consts::PI).powf(1.5);
        let variation: f64 = 0.1 / 0.7;
        let lognormal = (variation * variation + 3.0) * variation;
        for length in ["0", "1e-5"] {
            for (word, [mean, deviation, skewness]) in [
                ("uniform", [0.0, 0.1 / 3f64.sqrt(), 0.0]),
                ("normal", [0.0, 0.1, 0.0]),
                ("lognormal", [0.0, 0.1, lognormal]),
                ("weibull", [0.0, 0.1, weibull]),
                // In a fifth of the contacts.
                ("two-valued", [-0.06, 0.08, 1.5]),
            ] {
                let words = [
                    format!("disorder.distribution={word}"),
                    format!("disorder.correlation_length_m={length}"),
                ];
                let sets = [
                    &MANY[..],
                    &[
                        "friction.static_spread=0.1",
                        "friction.static_coefficient=0.7",
                        "friction.dynamic_coefficient=0.01",
                        "disorder.asperity_share=0.2",
                        words[0].as_str(),
                        words[1].as_str(),
                    ],
                ]
                .concat();
                let found = moments(&Quantity::Static.drawn(&scenario(&sets)));
                // Four standard errors of 40,000 draws; correlated over some four blocks, of a fifth of them.
                let error = if length == "0" { 4.0 / 200.0 } else { 4.0 / 90.0 };
                for (found, (expected, unit)) in
                    found.iter().zip([(mean, deviation), (deviation, deviation), (skewness, 3.0)])
                {
                    assert!(
                        (found - expected).abs() < error * unit,
                        "{word} {length}: {found}, not {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn neighbours_are_correlated_along_both_axes() {
        let sets = [
            "slider.blocks=201",
            "slider.across=101",
            "slider.length_m=0.2",
            "slider.width_m=0.1",
            "friction.reattach=turn",
            "time.step_s=1e-9",
            "friction.static_spread=0.01",
            "disorder.distribution=normal",
            "disorder.correlation_length_m=5e-3",
        ];
        let drawn = Quantity::Static.drawn(&scenario(&sets));
        let [mean, deviation, _] = moments(&drawn);
        for (columns, rows) in [(1, 0), (0, 1), (3, 0), (0, 3), (2, 2), (10, 0)] {
            let pairs =
                (0..101 - rows).flat_map(|row| (0..201 - columns).map(move |column| row * 201 + column));
            let products: Vec<f64> =
                pairs.map(|n| (drawn[n] - mean) * (drawn[n + rows * 201 + columns] - mean)).collect();
            let found = products.iter().sum::<f64>() / products.len() as f64 / (deviation * deviation);
            let expected = (-((columns + rows) as f64) * 1e-3 / 5e-3).exp();
            // The field has some 800 patches of their own.
            assert!((found - expected).abs() < 0.07, "{columns} {rows}: {found}, not {expected}");
        }
    }

    #[test]
    fn quantities_have_draws_of_their_own_and_asperities_are_patches() {
        let sets = [
            "friction.static_spread=0.1",
            "friction.dynamic_spread=0.1",
            "disorder.stiffness_spread=0.1",
            "disorder.load_spread=0.1",
        ];
        let drawn = Quantity::ALL.map(|quantity| quantity.drawn(&scenario(&sets)));
        for (n, one) in drawn.iter().enumerate() {
            assert!(drawn[..n].iter().all(|other| other != one));
        }
        let patches = |length: &str| {
            let length = format!("disorder.correlation_length_m={length}");
            let sets = [&sets[..], &["disorder.distribution=two-valued", &length]].concat();
            let values = Quantity::Load.drawn(&scenario(&sets));
            assert!(values.iter().all(|value| value.abs() == 0.1));
            values.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        assert!(patches("0.01") < patches("0") / 2, "{} {}", patches("0.01"), patches("0"));
    }

    #[test]
    fn loads_add_up_to_the_total_and_springs_follow_their_factors() {
        let sets = [
            "slider.blocks=4",
            "normal_load.tilt=0.3",
            "disorder.load_offsets=[0,1,-0.5,0]",
            "disorder.stiffness_offsets=[0,0.5,-0.5,0]",
        ];
        let plan = Plan::new(&scenario(&sets));
        let even = Plan::new(&scenario(&["slider.blocks=4", "normal_load.tilt=0.3"]));
        assert!((plan.normal_load_n.iter().sum::<f64>() / 400.0 - 1.0).abs() < 1e-14);
        let ratio = |n: usize| {
            plan.normal_load_n[n] / even.normal_load_n[n] / (plan.normal_load_n[0] / even.normal_load_n[0])
        };
        for (n, factor) in [(1, 2.0), (2, 0.5), (3, 1.0)] {
            assert!((ratio(n) - factor).abs() < 1e-14);
        }
        let kt = even.friction.interfacial_stiffness_n_per_m;
        assert_eq!(plan.friction.springs_n_per_m, [kt, 1.5 * kt, 0.5 * kt, kt]);
        // The stiffest spring bounds the step.
        assert!(plan.longest_stable_step_s < even.longest_stable_step_s);
    }

    #[test]
    fn a_file_of_blocks_fills_the_lists() {
        let folder = std::env::temp_dir().join(format!("asperity-blocks-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let path = folder.join("blocks.csv");
        std::fs::write(&path, "static_offset,load_offset\n0.1,0\n0,1\n").unwrap();
        let set = format!("disorder.contacts_csv={}", path.display());
        let read = scenario(&["slider.blocks=2", &set]);
        std::fs::remove_dir_all(&folder).unwrap();
        let listed =
            scenario(&["slider.blocks=2", "friction.static_offsets=[0.1,0]", "disorder.load_offsets=[0,1]"]);
        assert_eq!(read.hash(), listed.hash());
        // A shown scenario needs no file.
        let shown = ScenarioSource::new("shown.toml", read.to_editable_toml());
        assert_eq!(Scenario::resolve(&shown).unwrap(), read);
    }
}
