//! The tables that a run is reduced to.

use asperity_model::analytic::LengthLaw;
use asperity_numbers::claim::Cells;
use asperity_numbers::curves::{PrecursorPoint, Residuals, precursor_points, residuals, rupture_points};
use asperity_numbers::precursors::{self, PrecursorRules};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_numbers::slow_slip::slow_slips;
use asperity_record::{Cell, CellValue, ColumnKind, EventKind, Parts, Rupture, SlipEvent};
use polars::prelude::{Column, DataFrame, NamedFrom, Series};

use crate::batch::Batch;
use crate::error::TableFileError;
use crate::parquet_tables;

/// The tables of ruptures, by themselves or behind the name of their run.
pub const RUPTURES: &str = "ruptures";
/// Of those among them that are precursors.
pub const PRECURSOR_RUPTURES: &str = "precursor-ruptures";
/// Slow slip behind each rupture.
pub const SLOW_SLIP: &str = "slow-slip";

/// A table of these columns, in order.
///
/// # Errors
/// If polars refuses.
pub fn of_columns(columns: Vec<(impl AsRef<str>, Cells)>) -> Result<DataFrame, TableFileError> {
    let columns = columns.into_iter().map(|(name, cells)| match cells {
        Cells::Texts(texts) => Column::from(Series::new(name.as_ref().into(), texts)),
        Cells::Numbers(numbers) => Series::new(name.as_ref().into(), numbers).into(),
    });
    Ok(DataFrame::new_infer_height(columns.collect())?)
}

/// The raw event table, one row per slip event: the columns of [`SlipEvent`] that the run has, of which a
/// test pins the first seven.
///
/// # Errors
/// If polars refuses.
pub fn events(run: &RunData) -> Result<DataFrame, TableFileError> {
    let kind = EventKind::of::<SlipEvent>().with(run.header.parts());
    let mut rows = Batch::new(&kind.columns);
    run.slips.iter().for_each(|slip| rows.push(&kind.cells_of(slip)));
    Ok(parquet_tables::frame(&kind.columns, &rows)?)
}

/// The rupture table, one row per rupture, in the order in which they became certain:
/// the columns of [`Rupture`] that the run has, the slip event in which each began, and whether the slip
/// events of this run are reliable, by its summary. Without rows where the log has no ruptures.
///
/// # Errors
/// If polars refuses.
pub fn ruptures(run: &RunData) -> Result<DataFrame, TableFileError> {
    let kind = EventKind::of::<Rupture>().with(run.header.parts());
    let columns = rupture_columns(run.header.parts());
    let of_run = [run.summary.creeps, run.summary.raw_events_mislead].map(CellValue::cell);
    let mut rows = Batch::new(&columns);
    for rupture in run.ruptures.iter().flatten() {
        let event = run.event_of(rupture).map_or(Cell::Empty, |slip| Cell::Step(slip.event));
        rows.push(&[&kind.cells_of(rupture)[..], &[event], &of_run].concat());
    }
    Ok(parquet_tables::frame(&columns, &rows)?)
}

/// The columns of [`ruptures`], of a run with these parts.
pub fn rupture_columns(parts: Parts) -> Vec<asperity_record::Column> {
    let mut columns = EventKind::of::<Rupture>().with(parts).columns;
    let more = [
        ("event", ColumnKind::Step, "Number of the slip event in which the rupture began."),
        ("creeps", ColumnKind::Flag, "Whether the slider creeps; the same in every row of a run."),
        (
            "raw_events_mislead",
            ColumnKind::Flag,
            "Whether raw slip events mislead; the same in every row of a run.",
        ),
    ];
    columns.extend(more.map(|(name, kind, about)| asperity_record::Column::new(name, kind, about)));
    columns
}

/// The precursors among the ruptures, and the first slip of the whole slider: `L_p / L`, over an area beside
/// `A_p`, against `F_T / F_N` beside one length law after the other.
///
/// # Errors
/// If polars refuses.
pub fn precursor_ruptures(
    run: &RunData,
    laws: &[(LengthLaw, PrecursorRules)],
) -> Result<DataFrame, TableFileError> {
    let summary = &run.summary;
    let mut rows: Vec<(&Rupture, PrecursorPoint, LengthLaw, u32)> = Vec::new();
    for (law, rules) in laws {
        let of_law = rupture_points(run, *law, rules).into_iter();
        rows.extend(of_law.map(|(rupture, point)| (rupture, point, *law, rules.min_blocks)));
    }
    let ruptures = || rows.iter().map(|(rupture, ..)| *rupture);
    let points = || rows.iter().map(|(_, point, ..)| point);
    let ap_a = area_ratios(run, ruptures().map(Rupture::slipped));
    frame(with_areas(
        ap_a,
        vec![
            steps("rupture", ruptures().map(|rupture| rupture.rupture)),
            numbers("onset_s", ruptures().map(|rupture| rupture.onset_s)),
            numbers("arrival_s", ruptures().map(|rupture| rupture.arrival_s)),
            gaps("end_s", ruptures().map(|rupture| rupture.end_s)),
            counts("last_block", ruptures().map(|rupture| rupture.last_block)),
            column(
                "reached_every_block",
                ruptures().map(|rupture| rupture.reached_every_block).collect::<Vec<bool>>(),
            ),
            numbers("lp_l", points().map(|point| point.lp_l)),
            numbers("ft_fn", points().map(|point| point.ft_fn)),
            column("law", rows.iter().map(|(_, _, law, _)| word(run, *law)).collect::<Vec<_>>()),
            gaps("ft_fn_law", points().map(|point| has_law(run).then_some(point.predicted))),
            gaps("residual", points().map(|point| has_law(run).then_some(point.ft_fn - point.predicted))),
            column(
                "event",
                ruptures().map(|rupture| Some(run.event_of(rupture)?.event)).collect::<Vec<Option<u64>>>(),
            ),
            column("creeps", vec![summary.creeps; rows.len()]),
            column("raw_events_mislead", vec![summary.raw_events_mislead; rows.len()]),
            counts("min_blocks", rows.iter().map(|(.., min_blocks)| *min_blocks)),
        ],
    ))
}

/// The slow slip behind each rupture, a row for each of [`slow_slips`].
///
/// # Errors
/// If polars refuses, or the motion of the run was not kept.
pub fn slow_slip(run: &RunData) -> Result<DataFrame, TableFileError> {
    let slips = slow_slips(run)?;
    let ruptures = || slips.iter().map(|slip| slip.rupture);
    frame(vec![
        steps("rupture", ruptures().map(|rupture| rupture.rupture)),
        numbers("onset_s", ruptures().map(|rupture| rupture.onset_s)),
        counts("first_block", ruptures().map(|rupture| rupture.first_block)),
        counts("last_block", ruptures().map(|rupture| rupture.last_block)),
        counts("contacts", slips.iter().map(|slip| slip.contacts)),
        gaps("slow_slip_m", slips.iter().map(|slip| slip.median_m)),
        gaps("largest_slow_slip_m", slips.iter().map(|slip| slip.largest_m)),
        gaps("slow_slip_until_link_time_m", slips.iter().map(|slip| slip.until_link_time_m)),
    ])
}

/// The column of `A_p`, the share of all contacts that slid, of a run with contacts over an area.
fn area_ratios(run: &RunData, slipped: impl Iterator<Item = u32>) -> Option<Column> {
    let ratio = |contacts: u32| f64::from(contacts) / f64::from(run.header.blocks);
    run.header.parts().area.then(|| numbers("ap_a", slipped.map(ratio)))
}

/// Columns with that of `A_p`, if there is one, behind that of `L_p / L`.
fn with_areas(ap_a: Option<Column>, mut columns: Vec<Column>) -> Vec<Column> {
    let lengths = columns.iter().position(|column| column.name() == "lp_l");
    let place = lengths.map_or(columns.len(), |lengths| lengths + 1);
    columns.splice(place..place, ap_a);
    columns
}

/// The precursor table: `L_p / L`, over an area beside `A_p`, against `F_T / F_N`, the value of the length law, the residual, and the
/// rules for merging and dropping events.
///
/// # Errors
/// If polars refuses, or the rules need data that were not kept of the run.
pub fn precursors(
    run: &RunData,
    law: LengthLaw,
    rules: &PrecursorRules,
) -> Result<DataFrame, TableFileError> {
    let found = precursors::find(run, rules)?;
    let points = precursor_points(run, law, &found);
    let ap_a = area_ratios(run, found.iter().map(|precursor| precursor.blocks_slipped));
    frame(with_areas(
        ap_a,
        vec![
            steps("event", found.iter().map(|precursor| precursor.start.event)),
            counts("merged", found.iter().map(|precursor| precursor.merged)),
            numbers("onset_s", found.iter().map(|precursor| precursor.start.onset_s)),
            gaps("end_s", found.iter().map(|precursor| precursor.end.end_s)),
            counts("last_block", found.iter().map(|precursor| precursor.last_block)),
            counts("blocks_slipped", found.iter().map(|precursor| precursor.blocks_slipped)),
            numbers("lp_l", points.iter().map(|point| point.lp_l)),
            numbers("ft_fn", points.iter().map(|point| point.ft_fn)),
            column("law", vec![word(run, law); points.len()]),
            gaps("ft_fn_law", points.iter().map(|point| has_law(run).then_some(point.predicted))),
            gaps(
                "residual",
                points.iter().map(|point| has_law(run).then_some(point.ft_fn - point.predicted)),
            ),
            counts("min_blocks", found.iter().map(|_| rules.min_blocks)),
            numbers("merge_gap_s", found.iter().map(|_| rules.merge_gap_s)),
        ],
    ))
}

/// Whether there are length laws for a run.
fn has_law(run: &RunData) -> bool {
    LengthLaw::are_known(&run.scenario)
}

/// The name of a law beside precursors that it is compared with.
fn word(run: &RunData, law: LengthLaw) -> Option<String> {
    has_law(run).then(|| law.table_word())
}

/// How well the precursors of a run follow a length law: a row of [`residual_table`].
#[derive(Debug, Clone)]
pub struct ResidualRow {
    run: String,
    law: LengthLaw,
    found: Option<Residuals>,
    has_law: bool,
    dynamic_coefficient: f64,
    rules: PrecursorRules,
}

impl ResidualRow {
    /// That of a run.
    ///
    /// # Errors
    /// If the rules need data that were not kept of the run.
    pub fn of(run: &RunData, law: LengthLaw, rules: &PrecursorRules) -> Result<ResidualRow, TableFileError> {
        Ok(ResidualRow {
            run: run.name.clone(),
            law,
            found: residuals(run, law, rules)?,
            has_law: has_law(run),
            dynamic_coefficient: run.scenario.mean_coefficients()[1],
            rules: *rules,
        })
    }
}

/// The residuals of several runs as a table.
///
/// # Errors
/// If polars refuses.
pub fn residual_table(rows: &[ResidualRow]) -> Result<DataFrame, TableFileError> {
    let residual = |row: &ResidualRow| row.found.filter(|_| row.has_law);
    frame(vec![
        column("run", rows.iter().map(|row| row.run.clone()).collect::<Vec<_>>()),
        column("law", rows.iter().map(|row| row.has_law.then(|| row.law.table_word())).collect::<Vec<_>>()),
        counts("precursors", rows.iter().map(|row| row.found.map_or(0, |found| found.count as u32))),
        gaps("rms", rows.iter().map(|row| residual(row).map(|found| found.rms))),
        gaps("max", rows.iter().map(|row| residual(row).map(|found| found.max))),
        gaps("rms_over_mu_d", rows.iter().map(|row| Some(residual(row)?.rms / row.dynamic_coefficient))),
        counts("min_blocks", rows.iter().map(|row| row.rules.min_blocks)),
        numbers("merge_gap_s", rows.iter().map(|row| row.rules.merge_gap_s)),
    ])
}

/// A row of [`first_global_slips`]: the first global slip of a run, with the parameters that distinguish
/// the run.
#[derive(Debug, Clone)]
pub struct FirstGlobalSlip {
    run: String,
    parameter_set: String,
    step_s: f64,
    duration_s: f64,
    normal_load_start_n: f64,
    beta: f64,
    onset_s: Option<f64>,
    ft_fn_onset: Option<f64>,
    normal_load_onset_n: Option<f64>,
    global_slips: u32,
}

impl FirstGlobalSlip {
    /// Data that it reads from a run.
    pub const REQUIRED_DATA: RequiredData = RequiredData::LOADS;

    /// That of a run.
    ///
    /// # Errors
    /// If the loads were not kept.
    pub fn of(run: &RunData) -> Result<FirstGlobalSlip, TableFileError> {
        let slip = run.first_global_slip();
        let loads = run.loads()?;
        let load = slip.and_then(|slip| loads.iter().find(|load| load.step == slip.onset_step));
        let global = run.slips.iter().filter(|slip| slip.is_global(run.header.blocks));
        Ok(FirstGlobalSlip {
            run: run.name.clone(),
            parameter_set: run.header.parameter_set.clone(),
            step_s: run.header.time_step_s,
            duration_s: run.plan.grid.time_s(run.header.steps),
            normal_load_start_n: run.plan.total_normal_load_n,
            beta: run.scenario.initial_shear.beta,
            onset_s: slip.map(|slip| slip.onset_s),
            ft_fn_onset: slip.map(|slip| slip.ft_fn_onset),
            normal_load_onset_n: load.map(|load| load.normal_load_n),
            global_slips: global.count() as u32,
        })
    }
}

/// The first global slips of several runs.
///
/// # Errors
/// If polars refuses.
pub fn first_global_slips(rows: &[&FirstGlobalSlip]) -> Result<DataFrame, TableFileError> {
    frame(vec![
        column("run", rows.iter().map(|row| row.run.clone()).collect::<Vec<_>>()),
        column("parameter_set", rows.iter().map(|row| row.parameter_set.clone()).collect::<Vec<_>>()),
        numbers("step_s", rows.iter().map(|row| row.step_s)),
        numbers("duration_s", rows.iter().map(|row| row.duration_s)),
        numbers("normal_load_start_n", rows.iter().map(|row| row.normal_load_start_n)),
        numbers("beta", rows.iter().map(|row| row.beta)),
        gaps("onset_s", rows.iter().map(|row| row.onset_s)),
        gaps("ft_fn_onset", rows.iter().map(|row| row.ft_fn_onset)),
        gaps("normal_load_onset_n", rows.iter().map(|row| row.normal_load_onset_n)),
        counts("global_slips", rows.iter().map(|row| row.global_slips)),
    ])
}

fn frame(columns: Vec<Column>) -> Result<DataFrame, TableFileError> {
    Ok(DataFrame::new_infer_height(columns)?)
}

fn column<T>(name: &str, values: Vec<T>) -> Column
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    Series::new(name.into(), values).into()
}

fn numbers(name: &str, values: impl Iterator<Item = f64>) -> Column {
    Series::new(name.into(), values.collect::<Vec<f64>>()).into()
}

fn gaps(name: &str, values: impl Iterator<Item = Option<f64>>) -> Column {
    Series::new(name.into(), values.collect::<Vec<Option<f64>>>()).into()
}

fn counts(name: &str, values: impl Iterator<Item = u32>) -> Column {
    Series::new(name.into(), values.collect::<Vec<u32>>()).into()
}

fn steps(name: &str, values: impl Iterator<Item = u64>) -> Column {
    Series::new(name.into(), values.collect::<Vec<u64>>()).into()
}
