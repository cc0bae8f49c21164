//! Single numbers read off a run, which claims and studies are made of.

use asperity_model::analytic::{self, LengthLaw, LengthLawParameters, LoadCurve};
use asperity_model::front;
use asperity_record::SlipEvent;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::at_rest;
use crate::beside_hold::{
    Side, hyperbola_error, longest_flank, mean_in_time, parabola_error, points_beside_hold, sag,
};
use crate::beside_theory::{
    AFFECTED_THRESHOLD, affected_blocks, affected_blocks_error, affected_cut_off, ahead_of_front_error,
    decaying_drive_onset_error, initial_shear_error, intercept_error, intercept_error_of, largest,
    load_curve_error, onset_profile_error, residual, ring_down_error, rms_over_mu_d, slope_error,
    slope_error_of, time_to_reach,
};
use crate::curves::{
    event_in_window, mean_behind_front, median_over_crossing, nearest_precursor, over_crossing,
};
use crate::estimate::Estimate;
use crate::fronts;
use crate::partial;
use crate::plane_waves::speeds_along_rows_m_per_s;
use crate::precursors::{self, PrecursorRules};
use crate::run_data::{Load, RunData};
use crate::wants::Wants;

/// What can be measured. To add one: a variant, an arm in [`Measure::of`], and one in
/// [`Measure::wants`] where it reads more than slip events, ruptures and switches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Measure {
    /// First time at which `F_T / F_N` has reached `mu_d`, s.
    TimeToDynamicCoefficient,
    /// `mu_d` over that time, 1/s.
    SlopeToDynamicCoefficient,
    /// When `F_T / F_N` comes to `mu_d` by [`LoadCurve`], s.
    TimeToDynamicCoefficientTheory,
    /// `mu_d` over that time, 1/s.
    SlopeToDynamicCoefficientTheory,
    /// Deviation of the first of these times from the theory, over the theory.
    TimeToDynamicCoefficientError,
    /// Largest deviation of `F_T / F_N` from [`LoadCurve`] up to `mu_d`, over `mu_d`.
    LoadCurveError,
    /// `mu_s / mu_d`.
    CoefficientRatio,
    /// `F_T / F_N` at the onset of the first global slip.
    LoadAtFirstGlobalSlip,
    /// How far that is from `mu_d`, over `mu_d`.
    LoadAtFirstGlobalSlipError,
    /// Where it lies between the two coefficients: 0 at `mu_d`, 1 at `mu_s`.
    LoadBetweenCoefficients,
    /// How many blocks carry more than 0.49 % of the force on block 1 when the
    /// first precursor starts.
    AffectedBlocks,
    /// The same for the discrete chain in theory.
    AffectedBlocksTheory,
    /// Lowest cut-off, as part of the force on block 1, at which so many blocks as claimed count
    /// as affected.
    AffectedCutOffLowest,
    /// The highest one.
    AffectedCutOffHighest,
    /// By how many blocks that count is off the theory's, the most for any cut-off from 0.1 % to
    /// 100 % of the force on block 1.
    AffectedBlocksError,
    /// Number of blocks of the precursor nearest in length to what is claimed.
    PrecursorNearest,
    /// Mean of `tau_n / p_n` over the blocks that the front of that precursor passed, at its end.
    MeanBehindFront,
    /// How far that is from `mu_d`, over `mu_d`.
    MeanBehindFrontError,
    /// Root mean square of the residuals against (5.22), over `mu_d`.
    #[serde(rename = "residual-rms-5.22")]
    ResidualTilted,
    /// The same against (5.52).
    #[serde(rename = "residual-rms-5.52")]
    ResidualInitialShear,
    /// The same against (5.57).
    #[serde(rename = "residual-rms-5.57")]
    ResidualLinear,
    /// How far the slope of the straight line through the precursors, `F_T / F_N` against what
    /// (5.22) says, is from 1.
    #[serde(rename = "slope-error-5.22")]
    SlopeErrorTilted,
    /// The same against (5.52).
    #[serde(rename = "slope-error-5.52")]
    SlopeErrorInitialShear,
    /// The same against (5.57).
    #[serde(rename = "slope-error-5.57")]
    SlopeErrorLinear,
    /// The same against (5.22) with the shear ahead of the front.
    #[serde(rename = "slope-error-screened")]
    SlopeErrorScreened,
    /// The same against the quasi-static balance.
    #[serde(rename = "slope-error-balance")]
    SlopeErrorBalance,
    /// How far the intercept of that line is from 0, over `mu_d`; against (5.22).
    #[serde(rename = "intercept-error-5.22")]
    InterceptErrorTilted,
    /// The same against (5.52).
    #[serde(rename = "intercept-error-5.52")]
    InterceptErrorInitialShear,
    /// The same against (5.57).
    #[serde(rename = "intercept-error-5.57")]
    InterceptErrorLinear,
    /// The same against (5.22) with the shear ahead of the front.
    #[serde(rename = "intercept-error-screened")]
    InterceptErrorScreened,
    /// The same against the quasi-static balance.
    #[serde(rename = "intercept-error-balance")]
    InterceptErrorBalance,
    /// How far (5.52) is from `mu_d` at `L_p = L`, over `mu_d`.
    #[serde(rename = "end-error-5.52")]
    EndErrorInitialShear,
    /// Mean of `tau_n / p_n`, over all precursors before the first global slip, of the first block
    /// ahead of the front at the precursor's end: how far it is from `alpha = (mu_s + mu_d) / 2`,
    /// over `alpha`.
    AheadOfFrontError,
    /// How many modes of the free chain are over-damped (5.30).
    OverdampedModes,
    /// Share of the time in which the load rises.
    RisingShare,
    /// Largest deviation of the initial shear from (5.50), over `p`.
    InitialShearError,
    /// Largest deviation of `tau_n` at the first onset from (5.45), over its value on block 1.
    OnsetProfileError,
    /// Root mean square deviation of a mode's velocity from (5.28), over its amplitude.
    RingDownError,
    /// Onset of the first global slip, s.
    FirstGlobalSlipTime,
    /// Largest displacement of any block in the states recorded, mm.
    LargestDisplacementMm,
    /// Largest `F_T / F_N`.
    LargestLoadRatio,
    /// Mean of `F_T / F_N` over time from the first global slip to the end, over `mu_d`.
    MeanAfterGlobalSlip,
    /// How far that is from 1.
    MeanAfterGlobalSlipError,
    /// How far the middle between the extrema of `F_T / F_N` in a global slip is from
    /// `mu_d`, over `mu_d`; the largest of all global slips.
    GlobalSlipMiddleError,
    /// Extent of the largest drop of `F_T / F_N` in a global slip.
    LargestDrop,
    /// The middle of that drop.
    LargestDropMiddle,
    /// How far it is from `mu_d`, over `mu_d`.
    LargestDropMiddleError,
    /// How far `F_T / F_N` sags below the chord of the longest flank between two slip
    /// events before the drive is held: the mean over time, over the rise. 0 for a
    /// straight flank, 1/6 for a parabola that begins level.
    SagBeforeHold,
    /// The same after the drive is held.
    SagAfterHold,
    /// Largest deviation of that flank from the parabola through its ends and its middle,
    /// over its rise.
    ParabolaErrorAfterHold,
    /// The same from the hyperbola that a constant `F_T` makes of a falling `F_N`.
    HyperbolaErrorAfterHold,
    /// Root mean square of the residuals against the length law that the scenario calls
    /// for, over `mu_d`, of the precursors before the drive is held.
    ResidualBeforeHold,
    /// The same of those after it, the first global slip included.
    ResidualAfterHold,
    /// How far the slope of the straight line through the precursors before the drive is held,
    /// `F_T / F_N` against what that law says, is from 1.
    SlopeErrorBeforeHold,
    /// How far its intercept is from 0, over `mu_d`.
    InterceptErrorBeforeHold,
    /// How long the slip event within the dense window that is nearest in length to what is
    /// claimed lasts, over the time in which sound crosses it, `n sqrt(m / k)`.
    EventOverCrossing,
    /// The same for the median of all slip events of five blocks or more.
    MedianEventOverCrossing,
    /// How often blocks re-attached in the run, all blocks together.
    Reattachments,
    /// Share of the velocities in the dense window, during that event, that are positive.
    ForwardShare,
    /// Lowest of these velocities over the highest.
    LowestVelocity,
    /// Number of precursors before the first global slip.
    PrecursorCount,
    /// `L_p / L` of the longest of them; 0 without any.
    LongestPrecursor,
    /// `L_p / L` of the longest precursor, or global slip, that has come up to a load `F_T / F_N`.
    LengthAtLoad,
    /// `F_T / F_N` at the onset of the first slip event.
    LoadAtFirstSlip,
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
    /// `tau`: the prestress of the middle block less sliding friction, over static less sliding
    /// friction.
    RelativePrestress,
    /// Speed of the front that started at block 1 over the chain's wave speed `a sqrt(k / m)`: the
    /// straight line through its arrivals at blocks `N / 2` to `11 N / 12`, by least squares.
    FrontSpeedOverC,
    /// How far it is from the theory of a steady front on rigid contacts, over that.
    FrontSpeedError,
    /// Length of a slip pulse, in blocks: its speed times the mean time for which a block of the
    /// same span slides.
    PulseLengthBlocks,
    /// Mean slip behind a pulse, over the `2 tau / gamma` of the theory without damping.
    PulseSlipRatio,
    /// How many blocks a front from block 1 has passed: all up to the first one that never slid.
    FrontReachBlocks,
    /// `tau` of the last block that the front from block 1 reached, where it did not reach all.
    ArrestPrestress,
    /// Number of ruptures of a tenth of the blocks or more before the first that reached all,
    /// wherever they began.
    PartialRuptures,
    /// Share of the blocks that the largest of them has; 0 without any.
    LargestPartialRupture,
    /// How far from the driven end the first rupture of a tenth of the blocks or more began, mm.
    FirstNucleationMm,
    /// Speed of the front of the first rupture that reached every block, towards higher-numbered
    /// blocks, over the wave speed.
    GlobalFrontOverC,
    /// How much faster fronts of precursors and of the first global slip run where they find more
    /// stress: Spearman's rank correlation of speed and `tau_n / p_n`, -1 to 1.
    FrontStressCorrelation,
    /// `tau_1 / p_1` before the first step.
    RestShearOfFirstBlock,
    /// Largest sum of `tau_n` and its mirror image before the first step, over the largest `tau_n`.
    RestShearAsymmetry,
    /// The `beta` of (5.50) that has the same first moment as the shear before the first step.
    RestShearBeta,
    /// Poisson's ratio of a slab: what its shear at rest and its growth along x make of it.
    RestPoissonRatio,
    /// Speed of the longitudinal wave along a slab that is `near` spacings long, m/s, by what the
    /// bonds of the lattice pull with.
    LongitudinalWaveSpeed,
    /// The same of the shear wave.
    ShearWaveSpeed,
}

impl Measure {
    /// Whether it counts events.
    pub fn is_count(self) -> bool {
        matches!(
            self,
            Measure::PrecursorCount
                | Measure::GlobalSlipCount
                | Measure::Reattachments
                | Measure::PartialRuptures
        )
    }

    /// Its name in words.
    pub fn name(self) -> String {
        let mut words = String::new();
        for letter in format!("{self:?}").chars() {
            if letter.is_uppercase() && !words.is_empty() {
                words.push(' ');
            }
            words.extend(letter.to_lowercase());
        }
        words
    }

    /// What it reads of a run.
    pub fn wants(self) -> Wants {
        match self {
            Measure::TimeToDynamicCoefficient
            | Measure::SlopeToDynamicCoefficient
            | Measure::TimeToDynamicCoefficientError
            | Measure::LoadCurveError
            | Measure::RisingShare
            | Measure::LargestLoadRatio
            | Measure::MeanAfterGlobalSlip
            | Measure::MeanAfterGlobalSlipError
            | Measure::SagBeforeHold
            | Measure::SagAfterHold
            | Measure::ParabolaErrorAfterHold
            | Measure::HyperbolaErrorAfterHold
            | Measure::LengthAtLoad => Wants::LOADS,
            Measure::AffectedBlocks
            | Measure::AffectedCutOffLowest
            | Measure::AffectedCutOffHighest
            | Measure::AffectedBlocksError
            | Measure::AheadOfFrontError
            | Measure::InitialShearError
            | Measure::OnsetProfileError
            | Measure::RestShearOfFirstBlock
            | Measure::RestShearAsymmetry
            | Measure::RestShearBeta
            | Measure::RestPoissonRatio
            | Measure::LargestDisplacementMm => Wants::STATES,
            Measure::MeanBehindFront | Measure::MeanBehindFrontError => Wants::LOADS | Wants::STATES,
            Measure::RingDownError | Measure::ForwardShare | Measure::LowestVelocity => Wants::WINDOWS,
            Measure::FrontStressCorrelation => Wants::fronts(),
            _ => Wants::NOTHING,
        }
    }

    /// Whether it holds a run against theory of the stuck or the moving chain, which a slab is not.
    fn is_beside_a_chain(self) -> bool {
        matches!(
            self,
            Measure::AffectedBlocksTheory
                | Measure::AffectedCutOffLowest
                | Measure::AffectedCutOffHighest
                | Measure::AffectedBlocksError
                | Measure::AheadOfFrontError
                | Measure::OverdampedModes
                | Measure::InitialShearError
                | Measure::OnsetProfileError
                | Measure::DecayingDriveOnsetError
                | Measure::RingDownError
                | Measure::RelativePrestress
                | Measure::FrontSpeedError
                | Measure::ArrestPrestress
        )
    }

    /// Measures a run; `None` where the run does not have what it takes. `near`
    /// is a number of blocks, for measures that look for the nearest precursor, or
    /// the load `F_T / F_N` for those that are taken at one.
    pub fn of(self, run: &RunData, near: Option<f64>) -> Option<f64> {
        self.estimate(run, near).map(|estimate| estimate.value)
    }

    /// The same with its standard error: that of statistics of precursors; others have none.
    pub fn estimate(self, run: &RunData, near: Option<f64>) -> Option<Estimate> {
        if self.is_beside_a_chain() && !run.plan.elastic.has_theory() {
            return None;
        }
        let mu_d = run.plan.friction.dynamic_coefficient;
        let number = match self {
            Measure::ResidualTilted => return residual(run, LengthLaw::Tilted),
            Measure::ResidualInitialShear => return residual(run, LengthLaw::InitialShear),
            Measure::ResidualLinear => return residual(run, LengthLaw::Linear),
            Measure::ResidualBalance => return residual(run, LengthLaw::Balance),
            Measure::SlopeErrorTilted => return slope_error(run, LengthLaw::Tilted),
            Measure::SlopeErrorInitialShear => return slope_error(run, LengthLaw::InitialShear),
            Measure::SlopeErrorLinear => return slope_error(run, LengthLaw::Linear),
            Measure::SlopeErrorScreened => return slope_error(run, LengthLaw::Screened),
            Measure::SlopeErrorBalance => return slope_error(run, LengthLaw::Balance),
            Measure::InterceptErrorTilted => return intercept_error(run, LengthLaw::Tilted),
            Measure::InterceptErrorInitialShear => return intercept_error(run, LengthLaw::InitialShear),
            Measure::InterceptErrorLinear => return intercept_error(run, LengthLaw::Linear),
            Measure::InterceptErrorScreened => return intercept_error(run, LengthLaw::Screened),
            Measure::InterceptErrorBalance => return intercept_error(run, LengthLaw::Balance),
            Measure::ResidualBeforeHold => {
                return rms_over_mu_d(run, &points_beside_hold(run, Side::BeforeHold)?);
            }
            Measure::ResidualAfterHold => {
                return rms_over_mu_d(run, &points_beside_hold(run, Side::AfterHold)?);
            }
            Measure::SlopeErrorBeforeHold => {
                return slope_error_of(&points_beside_hold(run, Side::BeforeHold)?);
            }
            Measure::InterceptErrorBeforeHold => {
                return intercept_error_of(run, &points_beside_hold(run, Side::BeforeHold)?);
            }
            Measure::AheadOfFrontError => return ahead_of_front_error(run),
            Measure::TimeToDynamicCoefficient => time_to_reach(run, mu_d),
            Measure::SlopeToDynamicCoefficient => Some(mu_d / time_to_reach(run, mu_d)?),
            Measure::TimeToDynamicCoefficientTheory => LoadCurve::of(&run.scenario)?.time_to_dynamic_s(),
            Measure::SlopeToDynamicCoefficientTheory => {
                Some(mu_d / LoadCurve::of(&run.scenario)?.time_to_dynamic_s()?)
            }
            Measure::TimeToDynamicCoefficientError => {
                let theory_s = LoadCurve::of(&run.scenario)?.time_to_dynamic_s()?;
                Some((time_to_reach(run, mu_d)? / theory_s - 1.0).abs())
            }
            Measure::LoadCurveError => load_curve_error(run),
            Measure::CoefficientRatio => Some(run.plan.friction.static_coefficient / mu_d),
            Measure::LoadAtFirstGlobalSlip => Some(run.first_global_slip()?.ft_fn_onset),
            Measure::LoadAtFirstGlobalSlipError => {
                Some((run.first_global_slip()?.ft_fn_onset / mu_d - 1.0).abs())
            }
            Measure::LoadBetweenCoefficients => {
                let above = run.first_global_slip()?.ft_fn_onset - mu_d;
                Some(above / (run.plan.friction.static_coefficient - mu_d))
            }
            Measure::AffectedBlocks => affected_blocks(run),
            Measure::AffectedBlocksTheory => {
                let ratio = run.scenario.friction.interfacial_stiffness_ratio;
                Some(f64::from(analytic::affected_blocks(ratio, AFFECTED_THRESHOLD)))
            }
            Measure::AffectedCutOffLowest => affected_cut_off(run, near?),
            Measure::AffectedCutOffHighest => affected_cut_off(run, near? - 1.0),
            Measure::AffectedBlocksError => affected_blocks_error(run),
            Measure::PrecursorNearest => Some(f64::from(nearest_precursor(run, near?)?.last_block)),
            Measure::MeanBehindFront => mean_behind_front(run, near?),
            Measure::MeanBehindFrontError => Some((mean_behind_front(run, near?)? / mu_d - 1.0).abs()),
            Measure::EndErrorInitialShear => {
                let parameters = LengthLawParameters::of(&run.scenario);
                Some((LengthLaw::InitialShear.load_ratio(&parameters, 1.0) / mu_d - 1.0).abs())
            }
            Measure::OverdampedModes => {
                let damping = run.scenario.slider.relative_damping;
                Some(f64::from(analytic::overdamped_modes(damping, run.header.blocks)))
            }
            Measure::RisingShare => rising_share(run),
            Measure::InitialShearError => initial_shear_error(run),
            Measure::OnsetProfileError => onset_profile_error(run),
            Measure::RingDownError => ring_down_error(run),
            Measure::FirstGlobalSlipTime => Some(run.first_global_slip()?.onset_s),
            Measure::LargestDisplacementMm => run.states().largest_displacement_m().map(|u| u * 1e3),
            Measure::LargestLoadRatio => run.loads().iter().map(Load::load_ratio).reduce(f64::max),
            Measure::MeanAfterGlobalSlip => mean_after_global_slip(run),
            Measure::MeanAfterGlobalSlipError => Some((mean_after_global_slip(run)? - 1.0).abs()),
            Measure::GlobalSlipMiddleError => {
                largest(global_slips(run).map(|slip| middle(slip) / mu_d - 1.0))
            }
            Measure::LargestDrop => largest_drop(run).map(|slip| slip.ft_fn_max - slip.ft_fn_min),
            Measure::LargestDropMiddle => largest_drop(run).map(middle),
            Measure::LargestDropMiddleError => {
                largest_drop(run).map(|slip| (middle(slip) / mu_d - 1.0).abs())
            }
            Measure::SagBeforeHold => sag(longest_flank(run, Side::BeforeHold)?),
            Measure::SagAfterHold => sag(longest_flank(run, Side::AfterHold)?),
            Measure::ParabolaErrorAfterHold => parabola_error(longest_flank(run, Side::AfterHold)?),
            Measure::HyperbolaErrorAfterHold => hyperbola_error(longest_flank(run, Side::AfterHold)?),
            Measure::EventOverCrossing => over_crossing(run, event_in_window(run, near?)?),
            Measure::MedianEventOverCrossing => median_over_crossing(run),
            Measure::Reattachments => Some(run.reattachments as f64),
            Measure::ForwardShare => {
                let velocities = velocities_in_event(run, near?)?;
                let forward = velocities.iter().filter(|&&velocity| velocity > 0.0).count();
                Some(forward as f64 / velocities.len() as f64)
            }
            Measure::LowestVelocity => {
                let velocities = velocities_in_event(run, near?)?;
                let highest = velocities.iter().copied().reduce(f64::max)?;
                Some(velocities.into_iter().reduce(f64::min)? / highest)
            }
            Measure::PrecursorCount => Some(precursors::alone(run, &PrecursorRules::default()).len() as f64),
            Measure::LongestPrecursor => {
                let precursors = precursors::alone(run, &PrecursorRules::default());
                let lengths = precursors.iter().map(|found| found.length_ratio(run.header.blocks));
                Some(lengths.fold(0.0, f64::max))
            }
            Measure::LengthAtLoad => length_at_load(run, near?),
            Measure::LoadAtFirstSlip => Some(run.slips.first()?.ft_fn_onset),
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
            Measure::DecayingDriveOnsetError => decaying_drive_onset_error(run),
            Measure::RelativePrestress => front::relative_prestress(&run.plan, run.plan.blocks / 2),
            Measure::FrontSpeedOverC => fronts::speed_over_c(run),
            Measure::FrontSpeedError => Some(fronts::speed_error(run)?.abs()),
            Measure::PulseLengthBlocks => fronts::pulse_length_blocks(run),
            Measure::PulseSlipRatio => fronts::pulse_slip_ratio(run),
            Measure::FrontReachBlocks => Some(fronts::passages(run).len() as f64),
            Measure::ArrestPrestress => fronts::arrest_prestress(run),
            Measure::PartialRuptures => partial::count(run),
            Measure::LargestPartialRupture => partial::largest_share(run),
            Measure::FirstNucleationMm => partial::nucleation_mm(run),
            Measure::GlobalFrontOverC => partial::global_front_over_c(run),
            Measure::FrontStressCorrelation => fronts::speed_stress_correlation(run),
            Measure::RestShearOfFirstBlock => at_rest::shear_of_first_block(run),
            Measure::RestShearAsymmetry => at_rest::asymmetry(run),
            Measure::RestShearBeta => at_rest::shear_beta(run),
            Measure::RestPoissonRatio => at_rest::poisson_ratio(run),
            Measure::LongitudinalWaveSpeed => speeds_along_rows_m_per_s(&run.plan, near?).map(|[_, c]| c),
            Measure::ShearWaveSpeed => speeds_along_rows_m_per_s(&run.plan, near?).map(|[c, _]| c),
        };
        number.map(Estimate::exact)
    }
}

fn mean_after_global_slip(run: &RunData) -> Option<f64> {
    let from = run.first_global_slip()?.onset_step;
    let records = &run.loads()[run.loads().partition_point(|record| record.step < from)..];
    Some(mean_in_time(records, Load::load_ratio)? / run.plan.friction.dynamic_coefficient)
}

/// The global slips that have ended.
fn global_slips(run: &RunData) -> impl Iterator<Item = &SlipEvent> {
    run.slips.iter().filter(|slip| slip.is_global(run.header.blocks) && !slip.open)
}

fn largest_drop(run: &RunData) -> Option<&SlipEvent> {
    let extent = |slip: &SlipEvent| slip.ft_fn_max - slip.ft_fn_min;
    global_slips(run).max_by(|a, b| extent(a).total_cmp(&extent(b)))
}

/// The middle between the extrema of `F_T / F_N` in a slip.
fn middle(slip: &SlipEvent) -> f64 {
    (slip.ft_fn_max + slip.ft_fn_min) / 2.0
}

/// Velocities of all blocks of the dense window, while that event lasts.
fn velocities_in_event(run: &RunData, blocks: f64) -> Option<Vec<f64>> {
    let event = event_in_window(run, blocks)?;
    let steps = event.onset_step..event.end_step?;
    let records = run.windows().iter().filter(|record| record.window == 0 && steps.contains(&record.step));
    let velocities: Vec<f64> = records.flat_map(|record| &record.velocity_m_per_s).copied().collect();
    (!velocities.is_empty()).then_some(velocities)
}

fn rising_share(run: &RunData) -> Option<f64> {
    let (first, last) = (run.loads().first()?, run.loads().last()?);
    let rising_s: f64 = run
        .loads()
        .windows(2)
        .filter(|pair| pair[1].driving_force_n > pair[0].driving_force_n)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .sum();
    (last.time_s > first.time_s).then(|| rising_s / (last.time_s - first.time_s))
}

fn length_at_load(run: &RunData, load_ratio: f64) -> Option<f64> {
    let precursors = precursors::find(run, &PrecursorRules::default());
    let reached = precursors.iter().take_while(|precursor| precursor.start.ft_fn_onset <= load_ratio);
    // A run that ends below the load says nothing about it.
    time_to_reach(run, load_ratio)?;
    Some(reached.map(|precursor| precursor.length_ratio(run.header.blocks)).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use asperity_record::StepRecord;
    use asperity_testkit::quiet_step;

    use super::Measure;
    use crate::made_up;
    use crate::made_up::EVENTS;
    use crate::run_data::{Load, RunData};

    /// Slips before and after a hold at 1 s, in steps of 1e-7 s; the load falls from 400 N at
    /// 1 s to 100 N at 4 s.
    fn unloaded() -> RunData {
        let toml = "drive.hold_from_s = 1.0\n\
                    normal_load.schedule_s = [1.0, 4.0]\n\
                    normal_load.schedule_n = [400.0, 100.0]";
        let mut run = made_up::run(
            toml,
            &[
                (2_000_000, 2_000_100, &[1]),
                (8_000_000, 8_000_100, &[1, 2]),
                (12_000_000, 12_000_100, &[2]),
                (20_000_000, 20_000_100, &[1, 2, 3]),
                (40_000_000, 40_000_100, &[1, 2, 3]),
            ],
        );
        // Between slips the drive pulls evenly up to the hold and stands still after it.
        let between = (0..450).map(|n| {
            let step = n * 100_000 + 50_000;
            StepRecord {
                driving_force_n: 80.0 * run.plan.grid.time_s(step.min(10_000_000)),
                normal_load_n: 400.0 * run.plan.load_factor(step, 10_000_000),
                ..quiet_step(step, run.plan.grid.time_s(step), 0.0)
            }
        });
        run.loads = between.map(|record| Load::from(&record)).collect();
        run
    }

    #[test]
    fn flanks_are_straight_while_driven_and_hyperbolas_once_held() {
        let run = unloaded();
        assert!(Measure::SagBeforeHold.of(&run, None).unwrap().abs() < 1e-9);
        // From 2 s, 300 N, to 4 s, 100 N, F_X / F_N goes as 1 / F_N. With r = 3 its mean is
        // ln r / (r - 1) of its end; half its rise less that, over its rise.
        let expected = ((1.0 / 3.0 + 1.0) / 2.0 - 3f64.ln() / 2.0) / (1.0 - 1.0 / 3.0);
        let sag = Measure::SagAfterHold.of(&run, None).unwrap();
        assert!((sag - expected).abs() < 2e-3, "{sag} {expected}");
        assert!(Measure::HyperbolaErrorAfterHold.of(&run, None).unwrap() < 1e-12);
        assert!(Measure::ParabolaErrorAfterHold.of(&run, None).unwrap() > 0.02);
    }

    #[test]
    fn flanks_with_a_pause_in_the_unloading_do_not_count() {
        let mut run = unloaded();
        let toml = "drive.hold_from_s = 1.0\n\
                    normal_load.schedule_s = [1.0, 2.5, 3.0, 4.0]\n\
                    normal_load.schedule_n = [400.0, 300.0, 300.0, 100.0]";
        run.plan = made_up::run(toml, &[]).plan;
        // The flank from 2 s to 4 s has knots; the longest left is that from 1.2 s to 2 s.
        let sag = Measure::SagAfterHold.of(&run, None).unwrap();
        let expected = {
            let r: f64 = 380.0 / 300.0;
            ((1.0 / r + 1.0) / 2.0 - r.ln() / (r - 1.0)) / (1.0 - 1.0 / r)
        };
        assert!((sag - expected).abs() < 2e-3, "{sag} {expected}");
    }

    #[test]
    fn global_slips_are_timed_and_their_middle_compared_with_the_coefficient() {
        let mut run = unloaded();
        assert_eq!(Measure::FirstGlobalSlipTime.of(&run, None), Some(2.0));
        (run.slips[3].ft_fn_min, run.slips[3].ft_fn_max) = (0.4, 0.5);
        (run.slips[4].ft_fn_min, run.slips[4].ft_fn_max) = (0.2, 0.7);
        assert!(Measure::GlobalSlipMiddleError.of(&run, None).unwrap() < 1e-12);
        assert!((Measure::LargestDrop.of(&run, None).unwrap() - 0.5).abs() < 1e-12);
        assert!((Measure::LargestDropMiddle.of(&run, None).unwrap() - 0.45).abs() < 1e-12);
        // One that is still going on has no extrema yet.
        run.slips[4].open = true;
        assert!((Measure::LargestDrop.of(&run, None).unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn residuals_are_split_at_the_hold() {
        let mut run = unloaded();
        // (5.57) asks for mu_d L_p / L: 0.15, 0.3 and 0.45.
        for (slip, load) in [(0, 0.15), (1, 0.3), (3, 0.54)] {
            run.slips[slip].ft_fn_onset = load;
        }
        assert!(Measure::ResidualBeforeHold.of(&run, None).unwrap() < 1e-12);
        assert!((Measure::ResidualAfterHold.of(&run, None).unwrap() - 0.2).abs() < 1e-12);
        run.slips[1].ft_fn_onset = 0.36;
        let before = Measure::ResidualBeforeHold.of(&run, None).unwrap();
        assert!((before - 0.06 / 0.45 / 2f64.sqrt()).abs() < 1e-12, "{before}");
        assert_eq!(Measure::ResidualAfterHold.of(&made_up::run("", &[(1, 2, &[1])]), None), None);
    }

    #[test]
    fn events_are_timed_in_crossings() {
        let toml = "[[recording.window]]\nfrom_s = 0.1\nto_s = 0.9\nevery_s = 1e-3\n\
                    first_block = 1\nlast_block = 1";
        let run = made_up::run(toml, &[(500_000, 900_000, &[1]), (2_000_000, 2_500_000, &[1, 2])]);
        let crossing_s = 2.0 * run.plan.scales.block_time_s;
        let ours = Measure::EventOverCrossing.of(&run, Some(2.0)).unwrap();
        assert!((ours * crossing_s - 0.05).abs() < 1e-12);
        // The one before the window is nearer in length, but outside.
        assert_eq!(Measure::EventOverCrossing.of(&run, Some(1.0)), Some(ours));
    }

    #[test]
    fn precursors_are_counted_and_measured_before_the_first_global_slip() {
        let run = made_up::run("", &EVENTS);
        let of = |measure: Measure| measure.of(&run, None);
        // Blocks 1, 1-2 and 1-3 with one of them at rest; then all three, twice.
        assert_eq!(of(Measure::PrecursorCount), Some(3.0));
        assert_eq!(of(Measure::LongestPrecursor), Some(1.0));
        assert_eq!(of(Measure::GlobalSlipCount), Some(2.0));
        assert_eq!(of(Measure::FirstGlobalSlipTime), Some(run.plan.grid.time_s(500)));
        assert_eq!(of(Measure::FirstSlipShare), Some(1.0 / 3.0));
        assert_eq!(of(Measure::LoadAtFirstSlip), Some(0.1));
        let slope = 0.1 / run.plan.grid.time_s(100);
        assert_eq!(of(Measure::SlopeToFirstSlip), Some(slope));
    }

    #[test]
    fn a_run_without_events_has_no_precursors_and_no_first_slip() {
        let run = made_up::run("", &[]);
        assert_eq!(Measure::PrecursorCount.of(&run, None), Some(0.0));
        assert_eq!(Measure::LongestPrecursor.of(&run, None), Some(0.0));
        assert_eq!(Measure::LoadAtFirstSlip.of(&run, None), None);
        assert_eq!(Measure::FirstGlobalSlipTime.of(&run, None), None);
    }

    #[test]
    fn length_at_a_load_is_that_of_the_longest_precursor_up_to_it() {
        let mut run = made_up::run("", &EVENTS);
        for (slip, load) in run.slips.iter_mut().zip([0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6]) {
            slip.ft_fn_onset = load;
        }
        for (record, load) in run.loads.iter_mut().zip([0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6]) {
            record.driving_force_n = load * record.normal_load_n;
        }
        let at = |load| Measure::LengthAtLoad.of(&run, Some(load));
        assert_eq!([at(0.05), at(0.15), at(0.35)], [Some(0.0), Some(1.0 / 3.0), Some(2.0 / 3.0)]);
        // The run never came to such a load.
        assert_eq!(at(0.7), None);
    }
    /// Whoever reads what was not kept of a run panics.
    #[test]
    fn every_measure_wants_what_it_reads_and_gives_the_same_of_it() {
        let refused = toml::from_str::<Named>("measure = \"?\"").unwrap_err().to_string();
        let names: Vec<&str> = refused.split('`').skip(1).step_by(2).filter(|name| *name != "?").collect();
        assert!(names.len() > 60 && names.contains(&"ring-down-error"), "{refused}");
        let whole = [unloaded(), made_up::pulse(12, "prestress.ratio = 0.6")];
        for name in names {
            let Named { measure } = toml::from_str(&format!("measure = \"{name}\"")).unwrap();
            for whole in &whole {
                let kept = RunData { kept: measure.wants(), ..whole.clone() };
                let [ours, theirs] = [&kept, whole].map(|run| measure.of(run, Some(2.0)));
                assert_eq!(ours.map(f64::to_bits), theirs.map(f64::to_bits), "{name}");
            }
        }
    }

    #[derive(serde::Deserialize, Debug)]
    struct Named {
        measure: Measure,
    }
}
