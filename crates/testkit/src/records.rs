//! Made-up records and events: fields that do not matter to a test are 0 or follow from the others; it sets
//! the rest with `..`.

use std::ops::RangeInclusive;

use asperity_record::{
    Direction, RECORD_SCHEMA_VERSION, RunHeader, Rupture, Scales, SlipEvent, StepRecord, Switch,
};

/// Normal load of the steps made up here.
const NORMAL_LOAD_N: f64 = 100.0;

/// The header of a run of two blocks as coded, in nine steps of half a second.
pub fn run_header() -> RunHeader {
    RunHeader {
        record_schema_version: RECORD_SCHEMA_VERSION,
        scenario: "made up".to_owned(),
        parameter_set: "as-coded".to_owned(),
        solver: "fast".to_owned(),
        blocks: 2,
        rows: 1,
        time_step_s: 0.5,
        steps: 9,
        scales: Scales {
            block_length_m: 0.01,
            block_time_s: 1e-4,
            link_time_ratio: 100.0,
            modulus_n_per_m: 5e6,
            interfacial_stiffness_n_per_m: 2e6,
        },
        ..RunHeader::default()
    }
}

/// A step in which no block slides or switches, by its `F_T / F_N`.
pub fn quiet_step(step: u64, time_s: f64, load_ratio: f64) -> StepRecord {
    StepRecord {
        step,
        time_s,
        driving_force_n: load_ratio * NORMAL_LOAD_N,
        normal_load_n: NORMAL_LOAD_N,
        ..StepRecord::default()
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
        measured: None,
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
        ft_fn_end: Some(0.0),
        onset_step,
        end_step: Some(end_step),
        blocks_slipped: last_block + 1 - first_block,
        nucleation_block: first_block,
        ..SlipEvent::default()
    }
}

/// A rupture from one step to another, or to the end of the run, over a range of blocks, beginning at the first of
/// them and in all of them at once; steps last a second, `F_T / F_N` is 0, and what else a run tells is missing.
pub fn rupture(onset_step: u64, end_step: Option<u64>, blocks: RangeInclusive<u32>) -> Rupture {
    let (first_block, last_block) = blocks.into_inner();
    Rupture {
        onset_s: onset_step as f64,
        end_s: end_step.map(|step| step as f64),
        first_block,
        last_block,
        nucleation_block: first_block,
        onset_step,
        arrival_s: onset_step as f64,
        end_step,
        detachments: 1 + u64::from(last_block - first_block),
        ..Rupture::default()
    }
}
