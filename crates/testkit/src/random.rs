//! Numbers without pattern.

/// Numbers that look random and are the same in every test run and on every machine (Knuth's
/// MMIX generator, a linear congruence modulo 2^64).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Different seeds give different numbers.
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0
    }

    /// A whole number from 0 to below a bound, at most 2^31: from the upper half of the state, which has
    /// the longer period.
    ///
    /// # Panics
    /// If the bound is 0.
    pub fn below(&mut self, bound: u64) -> u64 {
        (self.next() >> 33) % bound
    }

    /// Between two numbers, evenly, with all 53 bits.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.next() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// Between two positive numbers, with as many in each decade.
    pub fn log_uniform(&mut self, low: f64, high: f64) -> f64 {
        self.uniform(low.ln(), high.ln()).exp()
    }

    /// One of some values.
    ///
    /// # Panics
    /// If there is none.
    pub fn pick<T: Copy>(&mut self, from: &[T]) -> T {
        from[(self.uniform(0.0, from.len() as f64) as usize).min(from.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::Random;

    #[test]
    fn numbers_stay_in_their_range_and_repeat() {
        let (mut random, mut again) = (Random::new(5), Random::new(5));
        let (mut sum, mut seen) = (0.0, [0; 7]);
        for _ in 0..7_000 {
            let x = random.uniform(-1.0, 3.0);
            assert!((-1.0..3.0).contains(&x) && x.to_bits() == again.uniform(-1.0, 3.0).to_bits());
            sum += x;
            seen[random.below(7) as usize] += 1;
            assert!((1e-3..1e3).contains(&random.log_uniform(1e-3, 1e3)));
            assert!([2, 3].contains(&random.pick(&[2, 3])));
            again.below(1);
            again.below(1);
            again.below(1);
        }
        assert!((sum / 7_000.0 - 1.0).abs() < 0.05, "{sum}");
        assert!(seen.iter().all(|count| (800..1200).contains(count)), "{seen:?}");
        assert_ne!(Random::new(6).below(1 << 30), Random::new(5).below(1 << 30));
    }
}
