//! Partial ruptures from either end of the slider: those before the first global slip, for sliders whose
//! precursors need not begin at block 1.

use asperity_record::Rupture;

use crate::run_data::RunEvents;
use crate::rupture_numbers::front_speeds_m_per_s;

/// Fewest blocks of a rupture that counts, as a share of the slider's.
const FEWEST: f64 = 0.1;

/// The ruptures that count, by their onsets; `None` where the log has no ruptures.
fn counted(run: &RunEvents) -> Option<impl Iterator<Item = &Rupture>> {
    run.ruptures.as_ref()?;
    let fewest = FEWEST * f64::from(run.header.blocks);
    let ruptures = run.ruptures_by_onset().into_iter();
    Some(ruptures.filter(move |rupture| f64::from(rupture.slipped()) >= fewest))
}

/// Those before the first that reached every block.
fn before_global(run: &RunEvents) -> Option<impl Iterator<Item = &Rupture>> {
    Some(counted(run)?.take_while(|rupture| !rupture.reached_every_block))
}

/// How many there are.
pub(crate) fn count(run: &RunEvents) -> Option<f64> {
    Some(before_global(run)?.count() as f64)
}

/// The share of the blocks that the largest of them has; 0 without any.
pub(crate) fn largest_share(run: &RunEvents) -> Option<f64> {
    let largest = before_global(run)?.map(Rupture::slipped).max().unwrap_or(0);
    Some(f64::from(largest) / f64::from(run.header.blocks))
}

/// Distance from the driven end at which the first rupture that counts began, global or not, mm.
pub(crate) fn nucleation_mm(run: &RunEvents) -> Option<f64> {
    let first = counted(run)?.next()?;
    Some(f64::from(run.header.contacts().column(first.nucleation_block) - 1) * run.plan.spacing_m * 1e3)
}

/// Speed of the front of the first rupture that reached every block, towards higher-numbered blocks,
/// over the wave speed.
pub(crate) fn global_front_over_c(run: &RunEvents) -> Option<f64> {
    let global = run.ruptures_by_onset().into_iter().find(|rupture| rupture.reached_every_block)?;
    let wave_m_per_s = run.plan.scales.wave_speed_m_per_s();
    let [up, _] = front_speeds_m_per_s(global, run.header.contacts(), Some(wave_m_per_s));
    Some(up? / wave_m_per_s)
}

#[cfg(test)]
mod tests {
    use super::{count, global_front_over_c, largest_share, nucleation_mm};
    use crate::made_up;

    #[test]
    fn what_comes_before_the_first_global_slip_is_counted_from_either_end() {
        let mut run = made_up::run("", &[]);
        run.header.blocks = 20;
        assert_eq!(count(&run), None, "the log has no ruptures");
        let all: Vec<made_up::Passed> = (1..=20).map(|n| (n, 900 + 1000 * u64::from(n), None)).collect();
        made_up::with_ruptures(
            &mut run,
            &[
                &[(7, 50, Some(60))],
                &[(18, 100, Some(120)), (19, 110, Some(120)), (20, 112, Some(120))],
                &[(18, 300, Some(340)), (17, 310, Some(340)), (16, 320, Some(340)), (19, 310, Some(340))],
                &all,
                &[(1, 40_000, Some(40_010)), (2, 40_005, Some(40_010))],
            ],
        );
        assert_eq!((count(&run), largest_share(&run)), (Some(2.0), Some(0.2)));
        let away_mm = 17.0 * run.plan.spacing_m * 1e3;
        assert!((nucleation_mm(&run).unwrap() - away_mm).abs() < 1e-12);
        let per_block_s = run.plan.scales.block_time_s;
        let speed = global_front_over_c(&run).unwrap();
        assert!((speed * 1e-4 / per_block_s - 1.0).abs() < 1e-9, "{speed}");
    }
}
