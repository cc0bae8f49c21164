//! The law of Gutenberg and Richter among magnitudes, and the magnitude from which on it holds, the completeness.
//!
//! The completeness is where the law fits best by the distance of Kolmogorov and Smirnov, or higher and as good, as
//! Clauset, Shalizi and Newman choose the beginning of a power law (SIAM Rev. 51, 661 (2009), section 3.3). A test above
//! a completeness that was chosen for its fit rejects too rarely, and the error of b above it is too small. So, as in their section 4.1, catalogues are drawn with the
//! law above the completeness and the magnitudes found below it, and the whole search is repeated in each of them: these
//! give the critical value, and how far b lies from that of the law. The draws are the same every time and on every machine.
//!
//! The tail of any law looks exponential for long enough if it holds few magnitudes. A normal law, which a log-normal law of
//! moments is, its tail does not show: the skewness of all magnitudes does.

use crate::distributions::{TimeFit, TimeLaw};
use crate::estimate::Estimate;
use crate::goodness::{LEVEL, Random, Test};

/// Fewest magnitudes that the law is fitted to.
pub const FEWEST_MAGNITUDES: usize = 50;

/// How far the largest magnitude lies above the completeness, at least.
pub const SPAN: f64 = 1.0;

/// The skewness of all magnitudes over its standard error in a normal sample, at least: 1 % of these have more.
pub const SKEWED: f64 = 2.33;

/// How much farther from the law than the nearest one a higher completeness may be. The statistic is 0.5 to 1 as a rule; with
/// the nearest itself b is often of magnitudes where detection fades already.
const AS_GOOD: f64 = 0.1;

/// How many catalogues are drawn, of how many magnitudes at most, and of how many times those above the completeness: what
/// lies farther below does not matter to the search. Critical values fall as `1 / sqrt(n)`.
const DRAWS: usize = 199;
const LARGEST: usize = 400;
const TIMES: usize = 4;

/// Why there is no b.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// The test rejects the law.
    Test,
    /// The largest magnitude lies this far above the completeness, which is less than [`SPAN`].
    Span(f64),
    /// Without their largest the magnitudes span less: most catalogues of such a law do not reach so far.
    LargestAlone,
    /// The skewness of all magnitudes, which is less than [`SKEWED`] of its standard errors, and its standard error.
    Skewness(f64, f64),
}

/// The law of Gutenberg and Richter among magnitudes: as many lie above `M` as `10^(-b M)` says.
#[derive(Debug, Clone, PartialEq)]
pub struct GutenbergRichter {
    /// The magnitudes above this one are counted.
    pub completeness: f64,
    /// How many there are.
    pub count: usize,
    /// The test of the law.
    pub test: Test,
    /// `b` by maximum likelihood, `log10(e) / (mean M - completeness)`: Aki, Bull. Earthq. Res. Inst. 43, 237 (1965). Its
    /// standard error is `b / sqrt(n)`, and above a completeness that was searched as much more as the drawn catalogues say.
    pub b: Result<Estimate, Refusal>,
}

impl GutenbergRichter {
    /// Fits the magnitudes above a completeness; `None` if there are fewer than [`FEWEST_MAGNITUDES`], or all are equal.
    pub fn above(magnitudes: &[f64], completeness: f64) -> Option<GutenbergRichter> {
        let over = magnitudes.iter().map(|magnitude| magnitude - completeness);
        let excess: Vec<f64> = over.filter(|excess| *excess > 0.0).collect();
        let fit = TimeFit::of(&excess, TimeLaw::Exponential).filter(|_| excess.len() >= FEWEST_MAGNITUDES)?;
        let TimeFit::Exponential { mean_s: mean } = fit else { return None };
        let value = std::f64::consts::LOG10_E / mean.value;
        let b = Estimate { value, error: value * mean.error / mean.value };
        let test = Test::of_times(&fit, &excess, TimeLaw::Exponential);
        let span = excess.iter().copied().fold(0.0, f64::max);
        let b = match test.rejects() {
            true => Err(Refusal::Test),
            false if span < SPAN => Err(Refusal::Span(span)),
            false => Ok(b),
        };
        Some(GutenbergRichter { completeness, count: excess.len(), test, b })
    }

    /// Fits the magnitudes above the completeness that fits best, and tests the search with the fit; without a magnitude
    /// far enough below the largest, above the smallest one. `None` of fewer than 51 magnitudes, or if all are equal.
    pub fn complete(magnitudes: &[f64]) -> Option<GutenbergRichter> {
        let mut ascending = magnitudes.to_vec();
        ascending.sort_unstable_by(f64::total_cmp);
        let Some(found) = Found::in_all(&ascending) else {
            return GutenbergRichter::above(magnitudes, *ascending.first()?);
        };
        let mut fit = GutenbergRichter::above(magnitudes, found.completeness)?;
        let skewness = skewness(&ascending);
        match &mut fit.b {
            // What it rejects without the search it rejects with it.
            Err(_) => {}
            Ok(_) if skewness.value < SKEWED * skewness.error => {
                fit.b = Err(Refusal::Skewness(skewness.value, skewness.error));
            }
            Ok(b) => match drawn(&ascending, &found) {
                Some((critical, wider)) => {
                    b.error *= wider;
                    fit.test.critical = critical;
                    if fit.test.rejects() {
                        fit.b = Err(Refusal::Test);
                    }
                }
                None => fit.b = Err(Refusal::LargestAlone),
            },
        }
        Some(fit)
    }

    /// What is found, or why nothing is, above which completeness, of how many magnitudes, and with which test.
    pub fn words(&self) -> String {
        let above = format!("above {:.3}, n = {} ({})", self.completeness, self.count, self.test.words());
        match self.b {
            Ok(b) => format!("b = {:.3} ± {:.3} {above}", b.value, b.error),
            Err(Refusal::Test) => format!("no law of Gutenberg and Richter {above}"),
            Err(Refusal::Span(span)) => {
                format!("no b {above}: they span {span:.3}, less than {SPAN} magnitude")
            }
            Err(Refusal::LargestAlone) => {
                format!("no b {above}: without their largest they span less than {SPAN} magnitude")
            }
            Err(Refusal::Skewness(value, error)) => {
                let least = SKEWED * error;
                format!("no b {above}: all magnitudes may be normal (skewness {value:.2} < {least:.2})")
            }
        }
    }
}

/// A completeness.
#[derive(Debug, Clone, Copy)]
struct Found {
    completeness: f64,
    /// How many magnitudes are above it, and their mean distance from it.
    count: usize,
    mean: f64,
    /// The distance from the law times the square root of the count.
    statistic: f64,
}

impl Found {
    /// The highest of those that fit best. Each that is tried has about seven eighths as many magnitudes above it as the one before.
    fn in_all(ascending: &[f64]) -> Option<Found> {
        let largest = ascending.last()?;
        let fewer = |above: &usize| Some(above * 7 / 8);
        let tried = std::iter::successors(Some(ascending.len() - 1), fewer);
        let tried = tried.take_while(|above| *above >= FEWEST_MAGNITUDES);
        let (mut best, mut bound): (Option<Found>, f64) = (None, f64::INFINITY);
        for completeness in tried.map(|above| ascending[ascending.len() - 1 - above]) {
            let above = &ascending[ascending.partition_point(|magnitude| *magnitude <= completeness)..];
            if above.len() < FEWEST_MAGNITUDES || largest - completeness < SPAN {
                break;
            }
            let count = above.len() as f64;
            let mean = above.iter().map(|magnitude| magnitude - completeness).sum::<f64>() / count;
            let mut statistic: f64 = 0.0;
            for (n, magnitude) in above.iter().enumerate() {
                let below = 1.0 - libm::exp((completeness - magnitude) / mean);
                let distance = (below - n as f64 / count).max((n + 1) as f64 / count - below);
                statistic = statistic.max(distance * count.sqrt());
                if statistic >= bound {
                    break;
                }
            }
            if statistic < bound {
                bound = bound.min(statistic + AS_GOOD);
                best = Some(Found { completeness, count: above.len(), mean, statistic });
            }
        }
        best
    }
}

/// The critical distance for the search in a catalogue, and by how much the error of b is larger than above a completeness
/// that is known. `None` if most catalogues with such a law do not span enough.
fn drawn(ascending: &[f64], found: &Found) -> Option<(f64, f64)> {
    let near = &ascending[ascending.len().saturating_sub(TIMES * found.count)..];
    let drawn = near.len().min(LARGEST);
    let mut random = Random(0);
    let (mut statistics, mut distances) = (Vec::new(), Vec::new());
    let mut catalogue = Vec::with_capacity(drawn);
    for _ in 0..DRAWS {
        catalogue.clear();
        catalogue.extend((0..drawn).map(|_| match (random.share() * near.len() as f64) as usize {
            below if below < near.len() - found.count => near[below],
            _ => found.completeness - found.mean * libm::log(1.0 - random.share()),
        }));
        catalogue.sort_by(f64::total_cmp);
        if let Some(again) = Found::in_all(&catalogue) {
            statistics.push(again.statistic);
            // In standard errors of its own.
            distances.push(((1.0 - again.mean / found.mean) * (again.count as f64).sqrt()).abs());
        }
    }
    let highest = |mut values: Vec<f64>| {
        values.sort_by(f64::total_cmp);
        values[((1.0 - LEVEL) * values.len() as f64) as usize]
    };
    (statistics.len() * 2 >= DRAWS)
        .then(|| (highest(statistics) / (found.count as f64).sqrt(), (highest(distances) / 1.96).max(1.0)))
}

/// The skewness of a sample, with the standard error of that of a normal one (Fisher, Proc. R. Soc. A 130, 16 (1930)).
fn skewness(values: &[f64]) -> Estimate {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let off = || values.iter().map(|value| value - mean);
    let squares = off().map(|off| off * off).sum::<f64>() / count;
    let cubes = off().map(|off| off * off * off).sum::<f64>() / count;
    let error = (6.0 * (count - 2.0) / ((count + 1.0) * (count + 3.0))).sqrt();
    Estimate { value: cubes / (squares * squares.sqrt()), error }
}

#[cfg(test)]
mod tests {
    use asperity_testkit::Random;

    use super::{GutenbergRichter, Refusal};

    /// Magnitudes at the quantiles of the law with this b, from a completeness on.
    fn of_law(b: f64, from: f64, count: usize) -> impl Iterator<Item = f64> {
        (0..count).map(move |n| from - libm::log10((n as f64 + 0.5) / count as f64) / b)
    }

    #[test]
    fn b_is_found_again_and_its_error_falls_with_the_number() {
        let magnitudes: Vec<f64> = of_law(0.8, -6.0, 400).collect();
        let fit = GutenbergRichter::above(&magnitudes, -6.0).expect("there are enough");
        let b = fit.b.expect("it is the law");
        // Quantiles have a mean a little below that of the law.
        assert!((b.value - 0.8).abs() < 2e-3, "{}", b.value);
        assert!((b.error - b.value / 20.0).abs() < 1e-12);
        assert_eq!(fit.count, 400);
        assert_eq!(GutenbergRichter::above(&magnitudes[..49], -7.0), None);
        let narrow: Vec<f64> = magnitudes.iter().map(|magnitude| magnitude / 100.0).collect();
        for fit in [GutenbergRichter::above(&narrow, -0.06), GutenbergRichter::complete(&narrow)] {
            let fit = fit.expect("there are enough");
            assert!(matches!(fit.b, Err(Refusal::Span(span)) if span < 0.04), "{}", fit.words());
        }
        assert_eq!(GutenbergRichter::complete(&[1.0; 100]), None);
    }

    #[test]
    fn the_completeness_lies_where_the_law_begins() {
        // As many small ones of equal frequency, over half a magnitude below.
        let small = (0..400).map(|n| -6.5 + 0.5 * n as f64 / 400.0);
        let law = found(&mut Random::new(2), 1.0, 800, 0.0);
        let magnitudes: Vec<f64> = small.chain(law.iter().map(|magnitude| magnitude - 6.0)).collect();
        let least = GutenbergRichter::above(&magnitudes, -6.5).expect("there are enough");
        assert_eq!(least.b, Err(Refusal::Test));
        let fit = GutenbergRichter::complete(&magnitudes).expect("there are enough");
        let b = fit.b.expect("the larger ones follow the law");
        assert!((-6.05..=-5.3).contains(&fit.completeness), "{}", fit.words());
        assert!((b.value - 1.0).abs() < 2.0 * b.error, "{}", fit.words());
        let even: Vec<f64> = (0..2000).map(|n| f64::from(n) * 1e-3).collect();
        assert_eq!(GutenbergRichter::complete(&even).expect("there are enough").b, Err(Refusal::Test));
    }

    fn normal(random: &mut Random, mean: f64, spread: f64) -> f64 {
        let radius = (-2.0 * libm::log(1.0 - random.uniform(0.0, 1.0))).sqrt();
        mean + spread * radius * libm::cos(random.uniform(0.0, std::f64::consts::TAU))
    }

    /// Magnitudes of the law, of which those near 1 are found with a probability that rises over a width.
    fn found(random: &mut Random, b: f64, of: usize, width: f64) -> Vec<f64> {
        let all: Vec<f64> = (0..of).map(|_| -libm::log10(1.0 - random.uniform(0.0, 1.0)) / b).collect();
        let share = |magnitude: f64| 0.5 * (1.0 + libm::erf((magnitude - 1.0) / (width * 2f64.sqrt())));
        all.into_iter()
            .filter(|magnitude| width == 0.0 || random.uniform(0.0, 1.0) < share(*magnitude))
            .collect()
    }

    /// Of a hundred catalogues without the law at most 5 have a b. Of a hundred with it 90 have one, 90 % of them within two
    /// errors, and none of the mean beyond half an error, where detection fades below it as well.
    #[test]
    fn catalogues_have_a_b_if_they_follow_the_law() {
        type Drawn = fn(&mut Random, usize) -> Vec<f64>;
        let without: [(&str, Drawn); 5] = [
            ("normal", |random, count| (0..count).map(|_| normal(random, 0.0, 0.5)).collect()),
            ("even", |random, count| (0..count).map(|_| random.uniform(0.0, 2.0)).collect()),
            ("characteristic, few small", |random, count| {
                let small = (0..40).map(|_| random.uniform(0.0, 1.5)).collect::<Vec<_>>();
                (40..count).map(|_| normal(random, 2.0, 0.01)).chain(small).collect()
            }),
            ("characteristic", |random, count| (0..count).map(|_| random.uniform(2.0, 2.02)).collect()),
            ("rising", |random, count| (0..count).map(|_| 2.0 * random.uniform(0.0, 1.0).sqrt()).collect()),
        ];
        let mut random = Random::new(1);
        for (name, draw) in without {
            for count in [150, 400] {
                let fits = (0..100).filter_map(|_| GutenbergRichter::complete(&draw(&mut random, count)));
                let fits = fits.filter(|fit| fit.b.is_ok()).count();
                assert!(fits <= 5, "{name}, {count}: {fits}");
            }
        }
        // With b, how many, and the width over which they are found.
        for (b, of, width) in [
            (1.0, 200, 0.0),
            (1.0, 60, 0.0),
            (0.7, 150, 0.0),
            (1.5, 150, 0.0),
            (1.5, 400, 0.0),
            (1.0, 1700, 0.25),
            (1.0, 2500, 0.25),
            (1.0, 6000, 0.25),
        ] {
            let fit = |_| GutenbergRichter::complete(&found(&mut random, b, of, width))?.b.ok();
            let off: Vec<f64> =
                (0..100).filter_map(fit).map(|found| (found.value - b) / found.error).collect();
            let within = off.iter().filter(|off| off.abs() <= 2.0).count();
            let mean = off.iter().sum::<f64>() / off.len() as f64;
            let words = format!("b = {b} of {of}, {width}: {} have one, {within} near, {mean:.2}", off.len());
            assert!(off.len() >= 90 && within * 10 >= off.len() * 9 && mean.abs() <= 0.5, "{words}");
        }
    }
}
