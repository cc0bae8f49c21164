//! Pseudo-random numbers that are the same on every machine.

/// The output function of SplitMix64 (Steele, Lea and Flood 2014): maps a number to a pseudo-random
/// one.
pub fn mixed(number: u64) -> u64 {
    let mut z = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::mixed;

    #[test]
    fn it_is_the_generator_that_others_have() {
        // The first numbers of the reference implementation, seeded with 1234567.
        let golden = 0x9e37_79b9_7f4a_7c15_u64;
        let inverse = (0..6).fold(golden, |x, _| x.wrapping_mul(2u64.wrapping_sub(golden.wrapping_mul(x))));
        let seed = 1_234_567_u64.wrapping_mul(inverse);
        let numbers: Vec<u64> = (1..=3).map(|n| mixed(seed.wrapping_add(n))).collect();
        assert_eq!(
            numbers,
            [6_457_827_717_110_365_317, 3_203_168_211_198_807_973, 9_817_491_932_198_370_423]
        );
    }
}
