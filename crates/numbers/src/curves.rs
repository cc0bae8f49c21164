//! Curves and points of a run: the basis of the numbers, and of figures and tables.

use asperity_model::theory::analytic::{self, LengthLaw, LengthLawParameters};
use asperity_record::{Rupture, SlipEvent, WindowRecord};

use crate::estimate::{Estimate, line, root_mean_square};
use crate::precursors::{self, Precursor, PrecursorRules};
use crate::run_data::{Load, NotKept, RunData, RunEvents, load_at};
use crate::states::States;
use crate::statistics::mean;

/// One precursor beside the theory.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrecursorPoint {
    /// `L_p / L` (5.17).
    pub lp_l: f64,
    /// `F_T / F_N` at its onset.
    pub ft_fn: f64,
    /// The prediction of the length law for it.
    pub predicted: f64,
}

impl PrecursorPoint {
    fn of(run: &RunEvents, law: LengthLaw, lp_l: f64, ft_fn: f64) -> PrecursorPoint {
        let predicted = law.load_ratio(&LengthLawParameters::of(&run.scenario), lp_l);
        PrecursorPoint { lp_l, ft_fn, predicted }
    }
}

/// Precursors of a run beside a length law.
pub fn precursor_points(
    run: &RunEvents,
    law: LengthLaw,
    precursors: &[Precursor<'_>],
) -> Vec<PrecursorPoint> {
    let columns = run.columns();
    let point = |found: &Precursor<'_>| {
        PrecursorPoint::of(run, law, found.length_ratio(columns), found.start.ft_fn_onset)
    };
    precursors.iter().map(point).collect()
}

/// The precursors among the ruptures of a run beside a length law.
pub fn rupture_points<'a>(
    run: &'a RunEvents,
    law: LengthLaw,
    rules: &PrecursorRules,
) -> Vec<(&'a Rupture, PrecursorPoint)> {
    let columns = run.columns();
    let point = |found: &Rupture| {
        PrecursorPoint::of(run, law, found.reach().length_ratio(columns), found.ft_fn_onset)
    };
    precursors::among_ruptures(run, rules).into_iter().map(|rupture| (rupture, point(rupture))).collect()
}

/// How well the precursors of a run follow a length law; in units of `F_T / F_N`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residuals {
    /// Number of precursors.
    pub count: usize,
    /// Root mean square.
    pub rms: f64,
    /// Largest magnitude.
    pub max: f64,
}

/// The residuals of a run against a length law; `None` without precursors.
///
/// # Errors
/// If the rules need data that were not kept of the run.
pub fn residuals(
    run: &RunData,
    law: LengthLaw,
    rules: &PrecursorRules,
) -> Result<Option<Residuals>, NotKept> {
    let mut precursors = precursors::find(run, rules)?;
    precursors.retain(|precursor| precursor.blocks_slipped < run.header.blocks);
    let points = precursor_points(run, law, &precursors);
    let residuals: Vec<f64> = points.iter().map(|point| point.ft_fn - point.predicted).collect();
    Ok(root_mean_square(&residuals).map(|rms| Residuals {
        count: points.len(),
        rms: rms.value,
        max: residuals.iter().fold(0.0, |max: f64, residual| max.max(residual.abs())),
    }))
}

/// The straight line through precursors by least squares, `F_T / F_N` against the prediction of a law:
/// slope and intercept. A correct law gives 1 and 0; unlike a mean residual, they distinguish an offset
/// from scatter. `None` for fewer than three precursors.
pub fn line_beside_law(points: &[PrecursorPoint]) -> Option<[Estimate; 2]> {
    line(&points.iter().map(|point| (point.predicted, point.ft_fn)).collect::<Vec<_>>())
}

/// The precursor whose length is nearest to `blocks`; the earliest of equals.
pub fn nearest_precursor(run: &RunEvents, blocks: f64) -> Option<Precursor<'_>> {
    let distance = |precursor: &Precursor<'_>| (f64::from(precursor.last_block) - blocks).abs();
    let precursors = precursors::alone(run);
    precursors.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// That precursor, and `tau_n / p_n` of every block at its end.
pub fn front_profile<'a>(
    run: &'a RunEvents,
    loads: &[Load],
    states: &States,
    blocks: f64,
) -> Option<(Precursor<'a>, Vec<f64>)> {
    let precursor = nearest_precursor(run, blocks)?;
    let fields = states.at_precursor_end(precursor.end.end_step?)?;
    // Of that step, whose load may differ from the initial one.
    loads.iter().find(|record| record.step == fields.step)?;
    let normal_load_n = run.normal_load_n(loads, fields)?;
    let profile = fields.tangential_force_n.iter().zip(normal_load_n).map(|(tau, p)| tau / p).collect();
    Some((precursor, profile))
}

/// Its mean over the blocks that the front passed: over an area all contacts up to its farthest column.
pub fn mean_behind_front(run: &RunEvents, loads: &[Load], states: &States, blocks: f64) -> Option<f64> {
    let (precursor, profile) = front_profile(run, loads, states, blocks)?;
    let contacts = run.header.contacts();
    let is_behind = |contact: &u32| contacts.column(*contact) <= precursor.last_block;
    let behind = (1..).zip(profile).filter(|(contact, _)| is_behind(contact));
    mean(behind.map(|(_, ratio)| ratio))
}

/// The slip event that begins within the first dense window and whose length is nearest to
/// `blocks`; the earliest of equals.
pub fn event_in_window(run: &RunEvents, blocks: f64) -> Option<&SlipEvent> {
    let window = run.plan.recording.windows.first()?;
    let distance = |slip: &&SlipEvent| (f64::from(slip.last_block) - blocks).abs();
    run.slips
        .iter()
        .filter(|slip| (window.from_step..=window.to_step).contains(&slip.onset_step))
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// Duration of a slip event over the time in which sound crosses its blocks, over an area along its columns.
pub fn over_crossing(run: &RunEvents, event: &SlipEvent) -> Option<f64> {
    let per_block_s = run.plan.scales.block_time_s;
    let crossed = run.of_one_row().map_or(event.reach().count(), |_| event.blocks_slipped);
    Some((event.end_s? - event.onset_s) / (f64::from(crossed) * per_block_s))
}

/// Fewest blocks of an event that counts for the median: shorter ones are mostly chatter.
const FEWEST_BLOCKS: u32 = 5;

/// The median of that of all slip events of `FEWEST_BLOCKS` or more.
pub fn median_over_crossing(run: &RunEvents) -> Option<f64> {
    let events = run.slips.iter().filter(|slip| slip.blocks_slipped >= FEWEST_BLOCKS);
    let mut all: Vec<f64> = events.filter_map(|slip| over_crossing(run, slip)).collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() / 2).copied()
}

/// The sum of the magnitudes of all driving forces over the normal load: `F_T / F_N`
/// where all pull one way.
pub fn pull_ratio(record: &Load) -> f64 {
    let pull_n = record.end_forces_n.map_or(record.driving_force_n, |ends| ends[0].abs() + ends[1].abs());
    pull_n / record.normal_load_n
}

/// Pull ratio and share of the blocks that slid, for every slip event in which more
/// blocks slid than in any before, wherever it began, up to the first global slip.
pub fn growing_slips(run: &RunEvents, loads: &[Load]) -> Vec<(f64, f64)> {
    let mut most = 0;
    let mut grown = Vec::new();
    for slip in &run.slips {
        if slip.blocks_slipped <= most {
            continue;
        }
        most = slip.blocks_slipped;
        if let Some(record) = load_at(loads, slip.onset_step) {
            grown.push((pull_ratio(record), f64::from(most) / f64::from(run.header.blocks)));
        }
        if most == run.header.blocks {
            break;
        }
    }
    grown
}

/// Velocity of block 1 over its initial value against time `t sqrt(k / m)`, as
/// simulated and after (5.28), in a run that rings down one mode.
pub fn ring_down(run: &RunEvents, windows: &[WindowRecord]) -> Vec<(f64, f64, f64)> {
    let initial = run.plan.initial.velocity_m_per_s[0];
    let shape = analytic::mode_shape(run.scenario.initial_velocity.mode, run.header.blocks);
    let rate = (run.plan.elastic.stiffness_n_per_m / run.plan.block_mass_kg).sqrt();
    windows
        .iter()
        .filter(|record| record.first_block == 1)
        .map(|record| {
            let phase = record.time_s * rate;
            let theory = analytic::mode_velocity(shape, run.scenario.slider.relative_damping, phase);
            (phase, record.velocity_m_per_s[0] / initial, theory)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use asperity_record::FieldRecord;

    use super::{PrecursorPoint, front_profile, growing_slips, line_beside_law, pull_ratio};
    use crate::made_up;
    use crate::made_up::EVENTS;
    use crate::run_data::{Load, load_at};

    #[test]
    fn fronts_are_over_the_load_of_their_step() {
        let mut run = made_up::run("", &[(20_000_000, 20_000_100, &[1, 2])]);
        let step = run.slips[0].end_step.unwrap();
        run.loads.push(Load { step, normal_load_n: 300.0, ..run.loads[0] });
        let state = FieldRecord {
            step,
            time_s: run.plan.grid.time_s(step),
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![45.0; 3],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        };
        made_up::with_states(&mut run, &[state]);
        let (_, profile) = front_profile(&run, &run.loads, &run.states, 2.0).unwrap();
        // 100 N on each of three blocks, not the 133 N of the start.
        assert!(profile.iter().all(|ratio| (ratio - 0.45).abs() < 1e-12), "{profile:?}");
    }

    #[test]
    fn lines_tell_offset_from_slope() {
        let point = |predicted: f64, ft_fn: f64| PrecursorPoint { lp_l: 0.0, ft_fn, predicted };
        let points = [point(0.1, 0.12), point(0.2, 0.23), point(0.4, 0.45)];
        let [slope, intercept] = line_beside_law(&points).unwrap().map(|estimate| estimate.value);
        assert!((slope - 1.1).abs() < 1e-12 && (intercept - 0.01).abs() < 1e-12, "{slope} {intercept}");
        assert_eq!(line_beside_law(&[]), None);
    }

    #[test]
    fn both_ends_count_with_the_current_load() {
        let mut run = made_up::run("", &EVENTS);
        run.loads[1].end_forces_n = Some([-30.0, 20.0]);
        run.loads[1].normal_load_n = 100.0;
        assert_eq!(pull_ratio(&run.loads[1]), 0.5);
        // Events 0, 1 and 5 are each larger than all before; records lie a step before onsets.
        let grown = growing_slips(&run, &run.loads);
        assert_eq!(grown, [(0.0025, 1.0 / 3.0), (0.5, 2.0 / 3.0), (0.0025, 1.0)]);
        assert_eq!(load_at(&run.loads, 250).unwrap().step, 199);
        assert_eq!(load_at(&run.loads, 0).unwrap().step, 99);
    }
}
