//! Whether the ruptures of a run are of two kinds: localised ones, whose moments follow a power law, and longer ones in
//! excess of it (Carlson and Langer, Phys. Rev. A 40, 6470 (1989)). The length of the crossover is given.
//!
//! Their events are all that slips until everything rests. Here the small ruptures that run beside a large one are
//! ruptures of their own, of which there are many of middle size; localised ones count if they slid alone.
//!
//! So the excess sets longer ones, also those that overlap others, beside a law of those that slid alone. The law has no
//! end, although the length cuts it off, so that `b` is a little too large.

use asperity_record::Rupture;

use crate::estimate::Estimate;
use crate::gutenberg_richter::FEWEST_MAGNITUDES;
use crate::run_data::RunEvents;
use crate::statistics::median;

/// The power law begins at this moment, over the median moment of ruptures of a single block.
const FROM: f64 = 10.0;

/// The moments of ruptures that slid forwards, by whether they are longer than a number of blocks; of the others, those
/// during which no other slid, or all.
fn moments(run: &RunEvents, longer_than: f64, kind: Kind) -> Option<Vec<f64>> {
    let of_kind = |rupture: &&Rupture| match f64::from(rupture.slipped()) > longer_than {
        true => kind == Kind::Longer,
        false => kind == Kind::Others || kind == Kind::Alone && !rupture.overlapping,
    };
    let ruptures = run.ruptures.as_ref()?.iter().filter(of_kind);
    Some(ruptures.filter_map(|rupture| rupture.moment_n_m).filter(|moment| *moment > 0.0).collect())
}

/// Which ruptures.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Longer,
    Others,
    /// Of the others, those during which no other slid.
    Alone,
}

/// The moment from which on localised ruptures follow the law, the exponent of `M^-b` for the rate per unit of `ln M`,
/// and how many there are.
fn law(run: &RunEvents, longer_than: f64) -> Option<(f64, Estimate, f64)> {
    let of_one_block = run.ruptures.as_ref()?.iter().filter(|rupture| rupture.slipped() == 1);
    let from = FROM * median(of_one_block.filter_map(|rupture| rupture.moment_n_m))?;
    let localised = moments(run, longer_than, Kind::Alone)?;
    let above: Vec<f64> =
        localised.iter().map(|moment| libm::log(moment / from)).filter(|excess| *excess > 0.0).collect();
    if above.len() < FEWEST_MAGNITUDES {
        return None;
    }
    let count = above.len() as f64;
    // By maximum likelihood, as of an exponential law of the logarithm.
    let b = count / above.iter().sum::<f64>();
    Some((from, Estimate { value: b, error: b / count.sqrt() }, count))
}

/// The exponent of ruptures of up to as many blocks.
pub(crate) fn exponent(run: &RunEvents, longer_than: f64) -> Option<Estimate> {
    law(run, longer_than).map(|(_, b, _)| b)
}

/// How many ruptures are longer, over the number that the power law has above the smallest moment of the larger half.
pub(crate) fn excess_ratio(run: &RunEvents, longer_than: f64) -> Option<f64> {
    let (from, b, count) = law(run, longer_than)?;
    let longer = moments(run, longer_than, Kind::Longer)?;
    let middle = median(longer.iter().copied())?;
    let larger = longer.iter().filter(|moment| **moment >= middle).count() as f64;
    Some(larger / (count * libm::pow(middle / from, -b.value)))
}

/// Their share of the moment of all ruptures.
pub(crate) fn share_ratio(run: &RunEvents, longer_than: f64) -> Option<f64> {
    let sum = |kind: Kind| Some(moments(run, longer_than, kind)?.iter().sum::<f64>());
    let (longer, others) = (sum(Kind::Longer)?, sum(Kind::Others)?);
    (longer + others > 0.0).then(|| longer / (longer + others))
}

#[cfg(test)]
mod tests {
    use super::{excess_ratio, exponent, share_ratio};
    use crate::made_up;

    /// Ruptures of one block with the moment 1; of two by a power law with `b = 0.8` from 10 on; and four of three
    /// blocks, the larger two of the moment 1e4.
    #[test]
    fn exponent_excess_and_share_are_those_of_made_up_ruptures() {
        let mut run = made_up::run("", &[(100, 101, &[1])]);
        let passed = |blocks: u32, onset: u64| -> Vec<made_up::Passed> {
            (1..=blocks).map(|block| (block, onset, Some(onset + 10))).collect()
        };
        let blocks: Vec<u32> = (0..5).map(|_| 1).chain((0..400).map(|_| 2)).chain([3; 4]).collect();
        let ruptures: Vec<_> = blocks.iter().zip(1..).map(|(blocks, n)| passed(*blocks, 100 * n)).collect();
        made_up::with_ruptures(&mut run, &ruptures.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let moment = |n: usize| match n {
            0..5 => 1.0,
            5..405 => 10.0 * ((n as f64 - 4.5) / 400.0).powf(-1.0 / 0.8),
            405..407 => 5e3,
            _ => 1e4,
        };
        for (n, rupture) in run.run.ruptures.iter_mut().flatten().enumerate() {
            rupture.moment_n_m = Some(moment(n));
        }
        let b = exponent(&run, 2.0).expect("there are enough");
        // Quantiles have a mean a little below that of the law.
        assert!((b.value - 0.8).abs() < 3e-3 && (b.error - b.value / 20.0).abs() < 1e-9, "{b:?}");
        let (longer, others): (f64, f64) = (3e4, (0..405).map(moment).sum());
        assert!((share_ratio(&run, 2.0).unwrap() - longer / (longer + others)).abs() < 1e-12);
        let expected = 400.0 * 750f64.powf(-b.value);
        assert!((excess_ratio(&run, 2.0).unwrap() - 2.0 / expected).abs() < 1e-9);
        assert_eq!(exponent(&run, 1.0), None, "no rupture of one block is above ten times their median");
    }
}
