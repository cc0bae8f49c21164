//! Made-up records and events: fields that do not matter to a test are 0 or follow from the others; it sets
//! the rest with `..`. And the balance of recorded energies.

use std::ops::RangeInclusive;

use asperity_record::{Direction, Energy, Record, SlipEvent, StepRecord, Switch};

/// Normal load of the steps made up here.
const NORMAL_LOAD_N: f64 = 100.0;

/// A step in which no block slides or switches, by its `F_T / F_N`.
pub fn quiet_step(step: u64, time_s: f64, load_ratio: f64) -> StepRecord {
    StepRecord {
        step,
        time_s,
        driving_force_n: load_ratio * NORMAL_LOAD_N,
        normal_load_n: NORMAL_LOAD_N,
        end_forces_n: None,
        energy: None,
        junctions: None,
        peak_velocity_m_per_s: None,
        sliding: 0,
        switches: Vec::new(),
    }
}

/// A block that switches, at rest in its initial position.
pub fn switch(block: u32, direction: Direction) -> Switch {
    Switch {
        block,
        direction,
        displacement_m: 0.0,
        velocity_m_per_s: 0.0,
        tangential_force_n: 0.0,
        stick_position_m: 0.0,
        threshold_n: 0.0,
        junctions_slipping: None,
        across: None,
    }
}

/// A slip event from one step to another over a range of blocks, beginning at the first of them; steps last
/// a second, `F_T / F_N` is 0.
pub fn slip_event(onset_step: u64, end_step: u64, blocks: RangeInclusive<u32>) -> SlipEvent {
    let (first_block, last_block) = blocks.into_inner();
    SlipEvent {
        onset_s: onset_step as f64,
        end_s: Some(end_step as f64),
        first_block,
        last_block,
        max_sliding: 1,
        ft_fn_onset: 0.0,
        ft_fn_end: Some(0.0),
        event: 0,
        onset_step,
        end_step: Some(end_step),
        blocks_slipped: last_block + 1 - first_block,
        nucleation_block: first_block,
        ft_fn_min: 0.0,
        ft_fn_max: 0.0,
        open: false,
        breaks_onset: None,
        breaks_end: None,
        repins_onset: None,
        repins_end: None,
        peak_velocity_m_per_s: None,
        first_across: None,
        last_across: None,
    }
}

/// How far the energies are out of balance in any record, and the largest of them.
pub fn balance_j(records: &[Record]) -> (f64, f64) {
    let of = |record: &Record| match record {
        Record::Step(step) => step.energy,
        _ => None,
    };
    let energies: Vec<Energy> = records.iter().filter_map(of).collect();
    let start_j = energies[0].balance_j();
    energies.iter().fold((0.0, 0.0), |(off, most), energy| {
        let largest = energy.parts().fold(most, |most: f64, (_, part_j)| most.max(part_j.abs()));
        (f64::max(off, (energy.balance_j() - start_j).abs()), largest)
    })
}
