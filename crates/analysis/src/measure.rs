//! Single numbers read off a run, for claims to be held against.

use asperity_model::analytic::{self, LengthLaw};
use asperity_record::{FieldRecord, StepRecord};
use serde::Deserialize;

use crate::precursors::{self, Precursor, PrecursorRules};
use crate::run_data::RunData;
use crate::tables;

/// A block counts as affected by the force on block 1 while it carries more
/// than this part of it: where the eye loses a decaying curve.
const AFFECTED_THRESHOLD: f64 = 0.004;

/// What can be measured. To add one: a variant, and an arm in [`Measure::of`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// First time at which `F_T / F_N` has reached `mu_d`, s.
    TimeToDynamicCoefficient,
    /// `mu_d` over that time, 1/s.
    SlopeToDynamicCoefficient,
    /// `mu_s / mu_d`.
    CoefficientRatio,
    /// `F_T / F_N` at the onset of the first global slip.
    LoadAtFirstGlobalSlip,
    /// How many blocks carry more than 0.4 % of the force on block 1 when the
    /// first precursor starts.
    AffectedBlocks,
    /// The same for the discrete chain in theory.
    AffectedBlocksTheory,
    /// Number of blocks of the precursor nearest in length to what is claimed.
    PrecursorNearest,
    /// Mean of `tau_n / p_n` behind the front of that precursor, at its end.
    MeanBehindFront,
    /// Root mean square of the residuals against (5.22), over `mu_d`.
    #[serde(rename = "residual-rms-5.22")]
    ResidualTilted,
    /// The same against (5.52).
    #[serde(rename = "residual-rms-5.52")]
    ResidualInitialShear,
    /// The same against (5.57).
    #[serde(rename = "residual-rms-5.57")]
    ResidualLinear,
    /// Share of the time in which the load rises.
    RisingShare,
    /// Largest deviation of the initial shear from (5.50), over `p`.
    InitialShearError,
    /// Largest deviation of `tau_n` at the first onset from (5.45), over its value on block 1.
    OnsetProfileError,
    /// Root mean square deviation of a mode's velocity from (5.28), over its amplitude.
    RingDownError,
    /// Number of precursors before the first global slip.
    PrecursorCount,
    /// `L_p / L` of the longest of them; 0 without any.
    LongestPrecursor,
    /// `L_p / L` of the longest precursor that has come up to a load `F_T / F_N`.
    LengthAtLoad,
    /// `F_T / F_N` at the onset of the first slip event.
    LoadAtFirstSlip,
    /// Onset of the first slip of the whole slider, s.
    FirstGlobalSlipOnset,
    /// Number of slips of the whole slider.
    GlobalSlipCount,
    /// Share of the blocks that slid in the first slip event.
    FirstSlipShare,
    /// `F_T / F_N` over time up to the first slip event, 1/s.
    SlopeToFirstSlip,
    /// Root mean square of the residuals against the quasi-static balance, over `mu_d`.
    #[serde(rename = "residual-rms-balance")]
    ResidualBalance,
    /// Deviation of the load at the first slip event from what a decaying drive
    /// predicts, over the prediction.
    DecayingDriveOnsetError,
}

impl Measure {
    /// Measures a run; `None` where the run does not have what it takes. `near`
    /// is a number of blocks, for measures that look for the nearest precursor, or
    /// the load `F_T / F_N` for those that are taken at one.
    pub fn of(self, run: &RunData, near: Option<f64>) -> Option<f64> {
        let mu_d = run.plan.friction.dynamic_coefficient;
        match self {
            Measure::TimeToDynamicCoefficient => time_to_reach(run, mu_d),
            Measure::SlopeToDynamicCoefficient => Some(mu_d / time_to_reach(run, mu_d)?),
            Measure::CoefficientRatio => Some(run.plan.friction.static_coefficient / mu_d),
            Measure::LoadAtFirstGlobalSlip => Some(run.first_global_slip()?.ft_fn_onset),
            Measure::AffectedBlocks => affected_blocks(run),
            Measure::AffectedBlocksTheory => {
                let ratio = run.scenario.friction.interfacial_stiffness_ratio;
                Some(f64::from(analytic::affected_blocks(ratio, AFFECTED_THRESHOLD)))
            }
            Measure::PrecursorNearest => Some(f64::from(nearest_precursor(run, near?)?.last_block)),
            Measure::MeanBehindFront => {
                let (precursor, profile) = front_profile(run, near?)?;
                let length = precursor.last_block as usize;
                Some(profile[..length].iter().sum::<f64>() / length as f64)
            }
            Measure::ResidualTilted => residual(run, LengthLaw::Tilted),
            Measure::ResidualInitialShear => residual(run, LengthLaw::InitialShear),
            Measure::ResidualLinear => residual(run, LengthLaw::Linear),
            Measure::RisingShare => rising_share(run),
            Measure::InitialShearError => initial_shear_error(run),
            Measure::OnsetProfileError => onset_profile_error(run),
            Measure::RingDownError => ring_down_error(run),
            Measure::PrecursorCount => Some(before_global_slip(run).count() as f64),
            Measure::LongestPrecursor => {
                Some(before_global_slip(run).map(|(_, length)| length).fold(0.0, f64::max))
            }
            Measure::LengthAtLoad => length_at_load(run, near?),
            Measure::LoadAtFirstSlip => Some(run.slips.first()?.ft_fn_onset),
            Measure::FirstGlobalSlipOnset => Some(run.first_global_slip()?.onset_s),
            Measure::GlobalSlipCount => {
                Some(run.slips.iter().filter(|slip| slip.is_global(run.header.blocks)).count() as f64)
            }
            Measure::FirstSlipShare => {
                Some(f64::from(run.slips.first()?.blocks_slipped) / f64::from(run.header.blocks))
            }
            Measure::SlopeToFirstSlip => {
                let first = run.slips.first()?;
                Some(first.ft_fn_onset / first.onset_s)
            }
            Measure::ResidualBalance => residual(run, LengthLaw::Balance),
            Measure::DecayingDriveOnsetError => decaying_drive_onset_error(run),
        }
    }
}

fn time_to_reach(run: &RunData, load_ratio: f64) -> Option<f64> {
    run.steps.iter().find(|record| record.load_ratio() >= load_ratio).map(|record| record.time_s)
}

fn residual(run: &RunData, law: LengthLaw) -> Option<f64> {
    Some(tables::residuals(run, law, &PrecursorRules::default())?.rms / run.plan.friction.dynamic_coefficient)
}

/// The state at the onset of the first slip event.
pub fn first_onset_fields(run: &RunData) -> Option<&FieldRecord> {
    run.fields_at(run.slips.first()?.onset_step)
}

fn affected_blocks(run: &RunData) -> Option<f64> {
    let tau = &first_onset_fields(run)?.tangential_force_n;
    Some(tau.iter().filter(|&&force| force > AFFECTED_THRESHOLD * tau[0]).count() as f64)
}

/// The precursor whose length is nearest to `blocks`; the earliest of equals.
pub fn nearest_precursor(run: &RunData, blocks: f64) -> Option<Precursor<'_>> {
    let distance = |precursor: &Precursor<'_>| (f64::from(precursor.last_block) - blocks).abs();
    let precursors = precursors::find(run, &PrecursorRules::default());
    precursors.into_iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
}

/// That precursor, and `tau_n / p_n` of every block at its end.
pub fn front_profile(run: &RunData, blocks: f64) -> Option<(Precursor<'_>, Vec<f64>)> {
    let precursor = nearest_precursor(run, blocks)?;
    let fields = run.fields_at(precursor.end.end_step?)?;
    let profile =
        fields.tangential_force_n.iter().zip(&run.plan.normal_load_n).map(|(tau, p)| tau / p).collect();
    Some((precursor, profile))
}

fn rising_share(run: &RunData) -> Option<f64> {
    let (first, last) = (run.steps.first()?, run.steps.last()?);
    let rising_s: f64 = run
        .steps
        .windows(2)
        .filter(|pair| pair[1].driving_force_n > pair[0].driving_force_n)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .sum();
    (last.time_s > first.time_s).then(|| rising_s / (last.time_s - first.time_s))
}

fn initial_shear_error(run: &RunData) -> Option<f64> {
    let fields = run.fields_at(0)?;
    let plan = &run.plan;
    let expected = asperity_model::initial::shear_profile(
        run.scenario.initial_shear.beta,
        &plan.normal_load_n,
        plan.spacing_m,
    );
    largest(
        fields
            .tangential_force_n
            .iter()
            .zip(expected)
            .zip(&plan.normal_load_n)
            .map(|((tau, expected), p)| (tau - expected) / p),
    )
}

fn onset_profile_error(run: &RunData) -> Option<f64> {
    let tau = &first_onset_fields(run)?.tangential_force_n;
    largest(tau.iter().enumerate().map(|(n, force)| {
        let distance_m = n as f64 * run.plan.spacing_m;
        let screening_m = run.plan.screening_length_m();
        (force - analytic::stuck_tangential_force(tau[0], 0.0, distance_m, screening_m)) / tau[0]
    }))
}

/// `F_T / F_N` and `L_p / L` of every precursor before the first global slip.
fn before_global_slip(run: &RunData) -> impl Iterator<Item = (f64, f64)> {
    let blocks = run.header.blocks;
    precursors::find(run, &PrecursorRules::default())
        .into_iter()
        .filter(move |precursor| precursor.blocks_slipped < blocks)
        .map(move |precursor| (precursor.start.ft_fn_onset, precursor.length_ratio(blocks)))
}

fn length_at_load(run: &RunData, load_ratio: f64) -> Option<f64> {
    let precursors = precursors::find(run, &PrecursorRules::default());
    let reached = precursors.iter().take_while(|precursor| precursor.start.ft_fn_onset <= load_ratio);
    // A run that ends below the load says nothing about it.
    time_to_reach(run, load_ratio)?;
    Some(reached.map(|precursor| precursor.length_ratio(run.header.blocks)).fold(0.0, f64::max))
}

fn decaying_drive_onset_error(run: &RunData) -> Option<f64> {
    let (plan, decay_m) = (&run.plan, run.scenario.drive.decay_length_m);
    let (mu_s, screening_m) = (plan.friction.static_coefficient, plan.screening_length_m());
    let predicted = analytic::decaying_drive_onset(mu_s, decay_m, screening_m, plan.length_m);
    (decay_m > 0.0).then_some((run.slips.first()?.ft_fn_onset / predicted - 1.0).abs())
}

/// The sum of the magnitudes of all driving forces over the normal load: `F_T / F_N`
/// where all pull one way.
pub fn pull_ratio(record: &StepRecord) -> f64 {
    let pull_n = record.end_forces_n.map_or(record.driving_force_n, |ends| ends[0].abs() + ends[1].abs());
    pull_n / record.normal_load_n
}

/// Pull ratio and share of the blocks that slid, for every slip event in which more
/// blocks slid than in any before, wherever it began, up to the first global slip.
pub fn growing_slips(run: &RunData) -> Vec<(f64, f64)> {
    let mut most = 0;
    let mut grown = Vec::new();
    for slip in &run.slips {
        if slip.blocks_slipped <= most {
            continue;
        }
        most = slip.blocks_slipped;
        if let Some(record) = record_at(run, slip.onset_step) {
            grown.push((pull_ratio(record), f64::from(most) / f64::from(run.header.blocks)));
        }
        if most == run.header.blocks {
            break;
        }
    }
    grown
}

/// The last step record up to a step, or the first one where the step is before it.
pub fn record_at(run: &RunData, step: u64) -> Option<&StepRecord> {
    let behind = run.steps.partition_point(|record| record.step <= step);
    run.steps.get(behind.saturating_sub(1))
}

fn largest(deviations: impl Iterator<Item = f64>) -> Option<f64> {
    deviations.map(f64::abs).reduce(f64::max)
}

/// Velocity of block 1 over its initial value against time `t sqrt(k / m)`, as
/// simulated and after (5.28), in a run that rings down one mode.
pub fn ring_down(run: &RunData) -> Vec<(f64, f64, f64)> {
    let initial = run.plan.initial.velocity_m_per_s[0];
    let shape = analytic::mode_shape(run.scenario.initial_velocity.mode, run.header.blocks);
    let rate = (run.plan.stiffness_n_per_m / run.plan.block_mass_kg).sqrt();
    run.windows
        .iter()
        .filter(|record| record.first_block == 1)
        .map(|record| {
            let phase = record.time_s * rate;
            let theory = analytic::mode_velocity(shape, run.scenario.slider.relative_damping, phase);
            (phase, record.velocity_m_per_s[0] / initial, theory)
        })
        .collect()
}

fn ring_down_error(run: &RunData) -> Option<f64> {
    let points = ring_down(run);
    let squares: f64 = points.iter().map(|(_, simulated, theory)| (simulated - theory).powi(2)).sum();
    (!points.is_empty()).then(|| (squares / points.len() as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::{Measure, growing_slips, pull_ratio, record_at};
    use crate::precursors::tests::{EVENTS, run};

    #[test]
    fn precursors_are_counted_and_measured_before_the_first_global_slip() {
        let run = run(&EVENTS);
        let of = |measure: Measure| measure.of(&run, None);
        // Blocks 1, 1-2 and 1-3 with one of them at rest; then all three, twice.
        assert_eq!(of(Measure::PrecursorCount), Some(3.0));
        assert_eq!(of(Measure::LongestPrecursor), Some(1.0));
        assert_eq!(of(Measure::GlobalSlipCount), Some(2.0));
        assert_eq!(of(Measure::FirstGlobalSlipOnset), Some(run.plan.grid.time_s(500)));
        assert_eq!(of(Measure::FirstSlipShare), Some(1.0 / 3.0));
        assert_eq!(of(Measure::LoadAtFirstSlip), Some(0.1));
        let slope = 0.1 / run.plan.grid.time_s(100);
        assert_eq!(of(Measure::SlopeToFirstSlip), Some(slope));
    }

    #[test]
    fn a_run_without_events_has_no_precursors_and_no_first_slip() {
        let run = run(&[]);
        assert_eq!(Measure::PrecursorCount.of(&run, None), Some(0.0));
        assert_eq!(Measure::LongestPrecursor.of(&run, None), Some(0.0));
        assert_eq!(Measure::LoadAtFirstSlip.of(&run, None), None);
        assert_eq!(Measure::FirstGlobalSlipOnset.of(&run, None), None);
    }

    #[test]
    fn length_at_a_load_is_that_of_the_longest_precursor_up_to_it() {
        let mut run = run(&EVENTS);
        for (slip, load) in run.slips.iter_mut().zip([0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6]) {
            slip.ft_fn_onset = load;
        }
        for (record, load) in run.steps.iter_mut().zip([0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6]) {
            record.driving_force_n = load * record.normal_load_n;
        }
        let at = |load| Measure::LengthAtLoad.of(&run, Some(load));
        assert_eq!([at(0.05), at(0.15), at(0.35)], [Some(0.0), Some(1.0 / 3.0), Some(2.0 / 3.0)]);
        // The run never came to such a load.
        assert_eq!(at(0.7), None);
    }

    #[test]
    fn both_ends_count_with_the_current_load() {
        let mut run = run(&EVENTS);
        run.steps[1].end_forces_n = Some([-30.0, 20.0]);
        run.steps[1].normal_load_n = 100.0;
        assert_eq!(pull_ratio(&run.steps[1]), 0.5);
        // Events 0, 1 and 5 are each larger than all before; records lie a step before onsets.
        let grown = growing_slips(&run);
        assert_eq!(grown, [(0.0025, 1.0 / 3.0), (0.5, 2.0 / 3.0), (0.0025, 1.0)]);
        assert_eq!(record_at(&run, 250).unwrap().step, 199);
        assert_eq!(record_at(&run, 0).unwrap().step, 99);
    }
}
