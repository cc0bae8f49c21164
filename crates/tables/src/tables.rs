//! The tables that a run is reduced to.

use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::curves::{
    PrecursorPoint, Residuals, precursor_points, residuals as residuals_of, rupture_points,
};
use asperity_numbers::precursors::{self, Precursor, PrecursorRules};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{Load, NotKept, RunData};
use asperity_numbers::slow_slip::{SlowSlip, slow_slips};
use asperity_record::{Cell, CellValue, Column, EventKind, Part, Parts, Rupture, SlipEvent};

use crate::layout::{count, flag, number, ratio, step, word};
use crate::table::{ColumnOf, Table};

/// The tables of ruptures, by themselves or behind the name of their run.
pub const RUPTURES: &str = "ruptures";
/// Of those among them that are precursors.
pub const PRECURSOR_RUPTURES: &str = "precursor-ruptures";
/// Slow slip behind each rupture.
pub const SLOW_SLIP: &str = "slow-slip";
/// The table of slip events.
pub const EVENTS: &str = "events";
/// The table of the precursors among them.
pub const PRECURSORS: &str = "precursors";
/// The table of how well precursors follow length laws.
pub const RESIDUALS: &str = "residuals";
/// The table of the first slip of the whole slider in several runs.
pub const FIRST_GLOBAL_SLIPS: &str = "first-global-slips";

/// The name of a run, the first column of tables of several.
pub const RUN: Column = word("run", "The run.");
/// Its parameter set.
pub const PARAMETER_SET: Column = word("parameter_set", "The parameter set of the run.");

const AP_A: Column = ratio("ap_a", "A_p, the share of all contacts that slid.").only(Part::Area);
const LP_L: Column = ratio("lp_l", "L_p/L (5.17).");
const FT_FN: Column = number("ft_fn", "F_T/F_N at the onset.");
const LAW: Column =
    word("law", "The law it is compared with: linear (5.57), tilted (5.22) ...; none but for chains.");
const FT_FN_LAW: Column = number("ft_fn_law", "F_T/F_N by that law.");
const RESIDUAL: Column = ratio("residual", "`ft_fn` minus `ft_fn_law`.");
const RUPTURE: Column = step("rupture", "Number of the rupture.");
const ONSET: Column = number("onset_s", "When it starts.");
const END: Column = number("end_s", "When it ends; nothing if the run ended before.");
const LAST_BLOCK: Column = count("last_block", "Farthest block, over an area column, reached.");
const CREEPS: Column = flag("creeps", "Whether the slider creeps; the same in every row of a run.");
const MISLEAD: Column =
    flag("events_mislead", "Whether slip events mislead; the same in every row of a run.");
const MIN_BLOCKS: Column = count("min_blocks", "Shortest precursors that count, a rule of the table.");
const MERGE_GAP: Column = number("merge_gap_s", "Slip events this close are merged, a rule of the table.");

/// A table of a run: its columns without those of parts that the run lacks.
fn of_run<T>(run: &RunData, name: &'static str, rows: &[T], columns: &[ColumnOf<'_, T>]) -> Table {
    let is_there = |column: &Column| column.only.is_none_or(|part| run.header.parts().has(part));
    let there = columns.iter().filter(|(column, _)| is_there(column));
    Table::of(name, rows, &there.cloned().collect::<Vec<_>>())
}

/// The columns of the rupture table of a run with these parts.
pub fn rupture_columns(parts: Parts) -> Vec<Column> {
    let event = step("event", "Number of the slip event in which the rupture began.");
    [EventKind::of::<Rupture>().with(parts).columns(), vec![event, CREEPS, MISLEAD]].concat()
}

/// The precursors among the ruptures, and the first slip of the whole slider: `L_p / L`, over an area beside
/// `A_p`, against `F_T / F_N` beside one length law after the other.
pub fn precursor_ruptures(run: &RunData, laws: &[(LengthLaw, PrecursorRules)]) -> Table {
    let of_law = |(law, rules): &(LengthLaw, PrecursorRules)| {
        let (law, min_blocks) = (*law, rules.min_blocks);
        rupture_points(run, law, rules)
            .into_iter()
            .map(move |(rupture, point)| (run, rupture, point, law, min_blocks))
    };
    of_run(
        run,
        PRECURSOR_RUPTURES,
        &laws.iter().flat_map(of_law).collect::<Vec<_>>(),
        &of_precursor_ruptures(),
    )
}

/// A precursor, or the first slip of the whole slider, beside a law, with the shortest that counts.
type RuptureRow<'a> = (&'a RunData, &'a Rupture, PrecursorPoint, LengthLaw, u32);

fn of_precursor_ruptures<'a>() -> [ColumnOf<'a, RuptureRow<'a>>; 16] {
    [
        (RUPTURE, &|row| row.1.rupture.cell()),
        (ONSET, &|row| row.1.onset_s.cell()),
        (number("arrival_s", "When its front arrives farthest."), &|row| row.1.arrival_s.cell()),
        (END, &|row| row.1.end_s.cell()),
        (LAST_BLOCK, &|row| row.1.last_block.cell()),
        (flag("reached_every_block", "Whether every block slid."), &|row| row.1.reached_every_block.cell()),
        (LP_L, &|row| row.2.lp_l.cell()),
        (AP_A, &|row| area_ratio(row.0, row.1.slipped())),
        (FT_FN, &|row| row.2.ft_fn.cell()),
        (LAW, &|row| word_of(row.0, row.3)),
        (FT_FN_LAW, &|row| beside_law(row.0, row.2.predicted)),
        (RESIDUAL, &|row| beside_law(row.0, row.2.ft_fn - row.2.predicted)),
        (step("event", "Number of the slip event in which it began."), &|row| {
            row.0.slip_steps.event_at(row.1.onset_step).map(|(event, _)| event).cell()
        }),
        (CREEPS, &|row| row.0.summary.creeps.cell()),
        (MISLEAD, &|row| row.0.summary.events_mislead.cell()),
        (MIN_BLOCKS, &|row| row.4.cell()),
    ]
}

/// The slow slip behind each rupture, a row for each of [`slow_slips`].
///
/// # Errors
/// If the motion of the run was not kept.
pub fn slow_slip(run: &RunData) -> Result<Table, NotKept> {
    Ok(of_run(run, SLOW_SLIP, &slow_slips(run)?, &of_slow_slips()))
}

fn of_slow_slips<'a>() -> [ColumnOf<'a, SlowSlip<'a>>; 8] {
    [
        (RUPTURE, &|slip| slip.rupture.rupture.cell()),
        (ONSET, &|slip| slip.rupture.onset_s.cell()),
        (count("first_block", "First block, over an area column, reached."), &|slip| {
            slip.rupture.first_block.cell()
        }),
        (LAST_BLOCK, &|slip| slip.rupture.last_block.cell()),
        (count("contacts", "Contacts with records 0.5 ms after its arrival."), &|slip| slip.contacts.cell()),
        (number("slow_slip_m", "Median displacement up to the next rupture there."), &|slip| {
            slip.median_m.cell()
        }),
        (number("largest_slow_slip_m", "The largest of these."), &|slip| slip.largest_m.cell()),
        (number("slow_slip_until_link_time_m", "Median displacement up to the link time."), &|slip| {
            slip.until_link_time_m.cell()
        }),
    ]
}

/// The precursor table: `L_p / L`, over an area beside `A_p`, against `F_T / F_N`, the value of the length law, the residual, and the
/// rules for merging and dropping events.
///
/// # Errors
/// If the rules need data that were not kept of the run.
pub fn precursors(run: &RunData, law: LengthLaw, rules: &PrecursorRules) -> Result<Table, NotKept> {
    let found = precursors::find(run, rules)?;
    let points = precursor_points(run, law, &found);
    let rows = found.into_iter().zip(points).map(|(found, point)| (run, found, point, law, rules));
    Ok(of_run(run, PRECURSORS, &rows.collect::<Vec<_>>(), &of_precursors()))
}

/// A precursor among slip events beside a law, with the rules of the table.
type EventRow<'a> = (&'a RunData, Precursor<'a>, PrecursorPoint, LengthLaw, &'a PrecursorRules);

fn of_precursors<'a>() -> [ColumnOf<'a, EventRow<'a>>; 14] {
    [
        (step("event", "Number of the slip event; the first one where several were merged."), &|row| {
            row.1.start.event.cell()
        }),
        (count("merged", "Number of slip events it is made of."), &|row| row.1.merged.cell()),
        (ONSET, &|row| row.1.start.onset_s.cell()),
        (END, &|row| row.1.end.end_s.cell()),
        (LAST_BLOCK, &|row| row.1.last_block.cell()),
        (count("blocks_slipped", "Number of distinct blocks that slid."), &|row| row.1.blocks_slipped.cell()),
        (LP_L, &|row| row.2.lp_l.cell()),
        (AP_A, &|row| area_ratio(row.0, row.1.blocks_slipped)),
        (FT_FN, &|row| row.2.ft_fn.cell()),
        (LAW, &|row| word_of(row.0, row.3)),
        (FT_FN_LAW, &|row| beside_law(row.0, row.2.predicted)),
        (RESIDUAL, &|row| beside_law(row.0, row.2.ft_fn - row.2.predicted)),
        (MIN_BLOCKS, &|row| row.4.min_blocks.cell()),
        (MERGE_GAP, &|row| row.4.merge_gap_s.cell()),
    ]
}

fn area_ratio(run: &RunData, contacts: u32) -> Cell {
    Cell::Number(f64::from(contacts) / f64::from(run.header.blocks))
}

/// A number beside a law, of runs for which there are length laws.
fn beside_law(run: &RunData, value: f64) -> Cell {
    LengthLaw::are_known(&run.scenario).then_some(value).cell()
}

/// The name of a law beside precursors that it is compared with.
fn word_of(run: &RunData, law: LengthLaw) -> Cell {
    LengthLaw::are_known(&run.scenario).then(|| law.word()).map_or(Cell::Empty, Cell::word)
}

/// How well the precursors of a run follow a length law: a row, to be joined with those of other runs.
///
/// # Errors
/// If the rules need data that were not kept of the run.
pub fn residuals(run: &RunData, law: LengthLaw, rules: &PrecursorRules) -> Result<Table, NotKept> {
    let all = residuals_of(run, law, rules)?;
    let found = all.filter(|_| LengthLaw::are_known(&run.scenario));
    Ok(Table::of(RESIDUALS, &[(run, law, all.map_or(0, |all| all.count), found, rules)], &of_residuals()))
}

/// Their number, and how well they follow the law if there is one.
type ResidualsRow<'a> = (&'a RunData, LengthLaw, usize, Option<Residuals>, &'a PrecursorRules);

fn of_residuals<'a>() -> [ColumnOf<'a, ResidualsRow<'a>>; 8] {
    [
        (RUN, &|row| Cell::word(&row.0.name)),
        (LAW, &|row| word_of(row.0, row.1)),
        (count("precursors", "Number of precursors."), &|row| (row.2 as u32).cell()),
        (ratio("rms", "Root mean square of their residuals."), &|row| row.3.map(|found| found.rms).cell()),
        (ratio("max", "The largest magnitude of these."), &|row| row.3.map(|found| found.max).cell()),
        (ratio("rms_over_mu_d", "`rms` over μ_d."), &|row| {
            row.3.map(|found| found.rms / row.0.scenario.mean_coefficients()[1]).cell()
        }),
        (MIN_BLOCKS, &|row| row.4.min_blocks.cell()),
        (MERGE_GAP, &|row| row.4.merge_gap_s.cell()),
    ]
}

/// Data that [`first_global_slip`] reads from a run.
pub const REQUIRED_FOR_FIRST_GLOBAL_SLIP: RequiredData = RequiredData::LOADS;

/// The first slip of the whole slider in a run, with the parameters that distinguish the run: a row, to be joined with
/// those of other runs.
///
/// # Errors
/// If the loads were not kept.
pub fn first_global_slip(run: &RunData) -> Result<Table, NotKept> {
    let slip = run.first_global_slip();
    let loads = run.loads()?;
    let load = slip.and_then(|slip| loads.iter().find(|load| load.step == slip.onset_step));
    Ok(Table::of(FIRST_GLOBAL_SLIPS, &[(run, slip, load)], &of_first_global_slips()))
}

type GlobalSlipRow<'a> = (&'a RunData, Option<&'a SlipEvent>, Option<&'a Load>);

fn of_first_global_slips<'a>() -> [ColumnOf<'a, GlobalSlipRow<'a>>; 10] {
    [
        (RUN, &|(run, ..)| Cell::word(&run.name)),
        (PARAMETER_SET, &|(run, ..)| Cell::word(&run.header.parameter_set)),
        (number("step_s", "The time step."), &|(run, ..)| run.header.time_step_s.cell()),
        (number("duration_s", "How long the run is."), &|(run, ..)| {
            run.plan.grid.time_s(run.header.steps).cell()
        }),
        (number("normal_load_start_n", "F_N at the start."), &|(run, ..)| {
            run.plan.total_normal_load_n.cell()
        }),
        (ratio("beta", "β of the initial shear."), &|(run, ..)| run.scenario.initial_shear.beta.cell()),
        (ONSET, &|(_, slip, _)| slip.map(|slip| slip.onset_s).cell()),
        (number("ft_fn_onset", "F_T/F_N then."), &|(_, slip, _)| slip.map(|slip| slip.ft_fn_onset).cell()),
        (number("normal_load_onset_n", "F_N then."), &|(.., load)| {
            load.map(|load| load.normal_load_n).cell()
        }),
        (count("global_slips", "Number of slips of the whole slider."), &|(run, ..)| {
            (run.slips.iter().filter(|slip| slip.is_global(run.header.blocks)).count() as u32).cell()
        }),
    ]
}

/// All tables that runs are reduced to, without rows, with the columns that any run may have.
pub fn all() -> [Table; 6] {
    [
        Table::new(RUPTURES, rupture_columns(Parts::ALL)),
        Table::of(PRECURSOR_RUPTURES, &[], &of_precursor_ruptures()),
        Table::of(SLOW_SLIP, &[], &of_slow_slips()),
        Table::of(PRECURSORS, &[], &of_precursors()),
        Table::of(RESIDUALS, &[], &of_residuals()),
        Table::of(FIRST_GLOBAL_SLIPS, &[], &of_first_global_slips()),
    ]
}
