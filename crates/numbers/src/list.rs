//! The numbers that are taken of a run when a claim, a study or a figure asks for them. With the keys of
//! the summary they are the list of all numbers, [`Number::all`](crate::Number::all).
//!
//! To add one: an entry, with its unit last in its name, and behind `=` the variant of
//! [`Of`](crate::of::Of) that holds what it is taken of. Its comment is its meaning on every page.

use asperity_model::theory::analytic::LengthLaw::{Balance, InitialShear, Linear, Screened, Tilted};
use asperity_model::theory::analytic::{self, LengthLawParameters, LoadCurve};
use asperity_model::theory::front;
use asperity_record::{SlipEvent, WindowRecord};

use crate::arrest::{self, Arrest};
use crate::at_rest;
use crate::creep;
use crate::curves::{
    event_in_window, mean_behind_front, median_over_crossing, nearest_precursor, over_crossing,
};
use crate::fronts;
use crate::hold_phase::{
    Side, hyperbola_error, longest_flank, mean_in_time, parabola_error, points_beside_hold, sag,
};
use crate::junctions;
use crate::moments;
use crate::of::numbers;
use crate::partial_ruptures;
use crate::plane_waves::speeds_along_rows_m_per_s;
use crate::precursors::{self, Precursor, PrecursorRules};
use crate::rate_and_state;
use crate::run_data::{Load, RunEvents};
use crate::series;
use crate::slow_slip;
use crate::statistics::median;
use crate::theory_residuals::{
    AFFECTED_THRESHOLD, affected_blocks_error, affected_blocks_theory, affected_cut_off,
    ahead_of_front_error, carrying, decaying_drive_onset_error, initial_shear_error, intercept_error,
    largest, load_curve_error, onset_profile_error, points, ring_down_error, rms_over_mu_d, slope_error,
    time_to_reach,
};

numbers! {
    "Load in time" Robust {
        /// First time at which `F_T / F_N` has reached `mu_d`, s.
        time_to_dynamic_coefficient_s: f64 = Loads |run, loads, _| time_to_reach(loads, run.mu_d()?);
        /// `mu_d` over that time, 1/s.
        slope_to_dynamic_coefficient_per_s: f64 =
            Loads |run, loads, _| Some(run.mu_d()? / time_to_reach(loads, run.mu_d()?)?);
        /// Time at which `F_T / F_N` reaches `mu_d` by the theory of the load in time, s.
        time_to_dynamic_coefficient_theory_s: f64 =
            Events |run, _| LoadCurve::of(&run.scenario)?.time_to_dynamic_s();
        /// `mu_d` over the time at which `F_T / F_N` reaches it by that theory, 1/s.
        slope_to_dynamic_coefficient_theory_per_s: f64 =
            Events |run, _| Some(run.mu_d()? / LoadCurve::of(&run.scenario)?.time_to_dynamic_s()?);
        /// Deviation of the time to `mu_d` from the theory, over the theory.
        time_to_dynamic_coefficient_error_ratio: f64 = Loads |run, loads, _| {
            let theory_s = LoadCurve::of(&run.scenario)?.time_to_dynamic_s()?;
            Some((time_to_reach(loads, run.mu_d()?)? / theory_s - 1.0).abs())
        };
        /// Largest deviation of `F_T / F_N` from the theory of the load in time up to `mu_d`, over `mu_d`.
        load_curve_error_ratio: f64 = Loads |run, loads, _| load_curve_error(run, loads);
        /// `mu_s / mu_d`; none by rate-and-state friction, as are all numbers over `mu_d`.
        coefficient_ratio: f64 = Events |run, _| Some(run.plan.friction.static_coefficient / run.mu_d()?);
        /// Share of the time in which the load rises.
        rising_time_ratio: f64 = Loads |_, loads, _| rising_share(loads);
    }
    "First slip event" AtDecayLength {
        /// Share of the blocks that slid in the first slip event.
        first_event_block_ratio: f64 = Events |run, _| {
            Some(f64::from(run.slips.first()?.blocks_slipped) / f64::from(run.header.blocks))
        };
        /// `F_T / F_N` over time up to the first slip event, 1/s.
        slope_to_first_event_per_s: f64 = Events |run, _| {
            let first = run.slips.first()?;
            Some(first.ft_fn_onset / first.onset_s)
        };
        /// Deviation of the load at the first slip event from the prediction for a decaying drive, over
        /// the prediction; none without friction springs.
        first_event_decaying_drive_error_ratio: f64 =
            Events |run, _| decaying_drive_onset_error(run.of_stuck_springs()?);
        /// Number of blocks, block 1 included, that carry more than 0.49 % of the force on block 1 when
        /// the first precursor starts; none over an area.
        affected_blocks: u32 = States |run, states, _| {
            let tau_n = &run.of_one_row().and(states.at_first_onset())?.tangential_force_n;
            Some(carrying(tau_n, AFFECTED_THRESHOLD))
        };
        /// Number of affected blocks in the theory of the discrete chain; none without friction springs, as are
        /// the two errors below.
        affected_blocks_theory: u32 = Events |run, _| Some(affected_blocks_theory(run.of_stuck_springs()?));
        /// Lowest cut-off, as a share of the force on block 1, at which the number of affected blocks is
        /// the claimed number, or `near`.
        affected_cut_off_lowest_ratio: f64 =
            States |run, states, near| run.of_chain().and(affected_cut_off(states, near?));
        /// Highest cut-off at which the number of affected blocks is that number.
        affected_cut_off_highest_ratio: f64 =
            States |run, states, near| run.of_chain().and(affected_cut_off(states, near? - 1.0));
        /// Largest difference between the number of affected blocks and the number in theory, over all
        /// cut-offs from 0.1 % to 100 % of the force on block 1.
        affected_blocks_error: u32 =
            States |run, states, _| affected_blocks_error(run.of_stuck_springs()?, states);
        /// Largest deviation of `tau_n` at the first onset from (5.45), over its value on block 1.
        onset_profile_error_ratio: f64 =
            States |run, states, _| onset_profile_error(run.of_stuck_springs()?, states);
    }
    "Precursors among slip events" OneDraw {
        /// Number of precursors before the first global slip event.
        precursor_event_count: u64 = Events |run, _| Some(precursors::alone(run).len() as f64);
        /// `L_p / L` of the longest of these precursors; 0 without any.
        longest_precursor_event_ratio: f64 = Events |run, _| {
            let precursors = precursors::alone(run);
            Some(precursors.iter().map(|found| found.length_ratio(run.columns())).fold(0.0, f64::max))
        };
        /// `L_p / L` of the longest precursor, or global slip event, that began at or below a given load
        /// `F_T / F_N`.
        event_length_at_load_ratio: f64 = Loads |run, loads, near| {
            largest_at_load(run, loads, near?, |precursor| precursor.length_ratio(run.columns()))
        };
        /// Number of blocks of the precursor whose length is nearest to the claimed one.
        nearest_precursor_event_blocks: u32 =
            Events |run, near| Some(f64::from(nearest_precursor(run, near?)?.last_block));
        /// Mean of `tau_n / p_n`, at the end of that precursor, over the blocks that its front passed.
        mean_behind_event_front_ratio: f64 =
            LoadsAndStates |run, loads, states, near| mean_behind_front(run, loads, states, near?);
        /// Deviation of that mean from `mu_d`, over `mu_d`.
        mean_behind_event_front_error_ratio: f64 = LoadsAndStates |run, loads, states, near| {
            Some((mean_behind_front(run, loads, states, near?)? / run.mu_d()? - 1.0).abs())
        };
        /// Deviation of a mean of `tau_n / p_n` from `alpha = (mu_s + mu_d) / 2`, over `alpha`: the mean
        /// over all precursors before the first global slip event, each at its end, of the first block
        /// ahead of its front.
        ahead_of_event_front_error_ratio: f64 =
            States |run, states, _| ahead_of_front_error(run.of_chain()?, states);
    }
    "Precursors among slip events, beside length laws" OneDraw {
        /// Root mean square of the residuals against the law `tilted` (5.22), over `mu_d`.
        event_residual_tilted_ratio: f64 = Events |run, _| rms_over_mu_d(run, &points(run, Tilted));
        /// Root mean square of the residuals against the law `initial-shear` (5.52), over `mu_d`.
        event_residual_initial_shear_ratio: f64 =
            Events |run, _| rms_over_mu_d(run, &points(run, InitialShear));
        /// Root mean square of the residuals against the law `linear` (5.57), over `mu_d`.
        event_residual_linear_ratio: f64 = Events |run, _| rms_over_mu_d(run, &points(run, Linear));
        /// Root mean square of the residuals against the quasi-static balance, over `mu_d`.
        event_residual_balance_ratio: f64 = Events |run, _| rms_over_mu_d(run, &points(run, Balance));
        /// Deviation from 1 of the slope of the straight line through the precursors, `F_T / F_N` against
        /// its value by the law `tilted` (5.22).
        event_slope_error_tilted_ratio: f64 = Events |run, _| slope_error(&points(run, Tilted));
        /// Deviation from 1 of the slope against the law `initial-shear` (5.52).
        event_slope_error_initial_shear_ratio: f64 = Events |run, _| slope_error(&points(run, InitialShear));
        /// Deviation from 1 of the slope against the law `linear` (5.57).
        event_slope_error_linear_ratio: f64 = Events |run, _| slope_error(&points(run, Linear));
        /// Deviation from 1 of the slope against the law `screened`.
        event_slope_error_screened_ratio: f64 = Events |run, _| slope_error(&points(run, Screened));
        /// Deviation from 1 of the slope against the quasi-static balance.
        event_slope_error_balance_ratio: f64 = Events |run, _| slope_error(&points(run, Balance));
        /// Deviation from 0 of the intercept of the straight line through the precursors, `F_T / F_N`
        /// against its value by the law `tilted` (5.22), over `mu_d`.
        event_intercept_error_tilted_ratio: f64 = Events |run, _| intercept_error(run, &points(run, Tilted));
        /// Deviation from 0 of the intercept against the law `initial-shear` (5.52), over `mu_d`.
        event_intercept_error_initial_shear_ratio: f64 =
            Events |run, _| intercept_error(run, &points(run, InitialShear));
        /// Deviation from 0 of the intercept against the law `linear` (5.57), over `mu_d`.
        event_intercept_error_linear_ratio: f64 = Events |run, _| intercept_error(run, &points(run, Linear));
        /// Deviation from 0 of the intercept against the law `screened`, over
        /// `mu_d`.
        event_intercept_error_screened_ratio: f64 =
            Events |run, _| intercept_error(run, &points(run, Screened));
        /// Deviation from 0 of the intercept against the quasi-static balance, over `mu_d`.
        event_intercept_error_balance_ratio: f64 =
            Events |run, _| intercept_error(run, &points(run, Balance));
        /// Deviation of the law `initial-shear` at `L_p = L` from `mu_d`, over `mu_d`.
        law_end_error_initial_shear_ratio: f64 = Events |run, _| {
            let parameters = LengthLawParameters::of(&run.has_free_ends()?.scenario);
            Some((InitialShear.load_ratio(&parameters, 1.0) / run.mu_d()? - 1.0).abs())
        };
    }
    "First global slip event, and those after it" OneDraw {
        /// Deviation of `F_T / F_N` at the onset of the first global slip event from `mu_d`, over `mu_d`.
        first_global_event_load_error_ratio: f64 =
            Events |run, _| Some((run.first_global_slip()?.ft_fn_onset / run.mu_d()? - 1.0).abs());
        /// Position of `F_T / F_N` at the onset of the first global slip event between the two
        /// coefficients: 0 at `mu_d`, 1 at `mu_s`.
        first_global_event_between_coefficients_ratio: f64 = Events |run, _| {
            let mu_d = run.mu_d()?;
            let above = run.first_global_slip()?.ft_fn_onset - mu_d;
            let between = run.plan.friction.static_coefficient - mu_d;
            (between > 0.0).then(|| above / between)
        };
        /// Mean of `F_T / F_N` over time from the first global slip event to the end, over `mu_d`.
        mean_after_global_event_ratio: f64 = Loads |run, loads, _| mean_after_global_slip(run, loads);
        /// Deviation of that mean from 1.
        mean_after_global_event_error_ratio: f64 =
            Loads |run, loads, _| Some((mean_after_global_slip(run, loads)? - 1.0).abs());
        /// Deviation of the middle between the extrema of `F_T / F_N` in a global slip event from `mu_d`,
        /// over `mu_d`; the largest of all global slip events.
        global_event_middle_error_ratio: f64 = Events |run, _| {
            let mu_d = run.mu_d()?;
            largest(global_slips(run).map(|slip| middle(slip) / mu_d - 1.0))
        };
        /// Extent of the largest drop of `F_T / F_N` in a global slip event.
        largest_global_event_drop_ft_fn: f64 [unit = "1"] =
            Events |run, _| largest_drop(run).map(|slip| slip.ft_fn_max - slip.ft_fn_min);
        /// The middle between the extrema of that drop.
        largest_global_event_drop_middle_ft_fn: f64 [unit = "1"] =
            Events |run, _| largest_drop(run).map(middle);
        /// Deviation of that middle from `mu_d`, over `mu_d`.
        largest_global_event_drop_middle_error_ratio: f64 =
            Events |run, _| Some((middle(largest_drop(run)?) / run.mu_d()? - 1.0).abs());
    }
    "Before and after the drive is held" OneDraw {
        /// Sag of `F_T / F_N` below the chord of the longest flank between two slip events before the
        /// drive is held: its mean over time, over the rise of the flank. 0 for a straight flank, 1/6 for
        /// a parabola that begins level.
        sag_before_hold_ratio: f64 = Loads |run, loads, _| sag(longest_flank(run, loads, Side::BeforeHold)?);
        /// Sag of the longest such flank after the drive is held.
        sag_after_hold_ratio: f64 = Loads |run, loads, _| sag(longest_flank(run, loads, Side::AfterHold)?);
        /// Largest deviation of that flank from the parabola through its ends and its middle, over its
        /// rise.
        parabola_error_after_hold_ratio: f64 =
            Loads |run, loads, _| parabola_error(longest_flank(run, loads, Side::AfterHold)?);
        /// Largest deviation of that flank from the hyperbola that a constant `F_T` gives as `F_N` falls,
        /// over its rise.
        hyperbola_error_after_hold_ratio: f64 =
            Loads |run, loads, _| hyperbola_error(longest_flank(run, loads, Side::AfterHold)?);
        /// Root mean square of the residuals against the length law that applies to the scenario, over
        /// `mu_d`, of the precursors among slip events before the drive is held.
        event_residual_before_hold_ratio: f64 =
            Events |run, _| rms_over_mu_d(run, &points_beside_hold(run, Side::BeforeHold)?);
        /// Root mean square of the residuals of the precursors after it, the first global slip event
        /// included.
        event_residual_after_hold_ratio: f64 =
            Events |run, _| rms_over_mu_d(run, &points_beside_hold(run, Side::AfterHold)?);
        /// Deviation from 1 of the slope of the straight line through the precursors among slip events
        /// before the drive is held, `F_T / F_N` against its value by that law.
        event_slope_error_before_hold_ratio: f64 =
            Events |run, _| slope_error(&points_beside_hold(run, Side::BeforeHold)?);
        /// Deviation of the intercept of that line from 0, over `mu_d`.
        event_intercept_error_before_hold_ratio: f64 =
            Events |run, _| intercept_error(run, &points_beside_hold(run, Side::BeforeHold)?);
    }
    "Motion" OneDraw {
        /// Duration of the slip event within the dense window whose length is nearest to the claimed one,
        /// over the time in which sound crosses it, `n sqrt(m / k)`.
        event_over_crossing_ratio: f64 = Events |run, near| over_crossing(run, event_in_window(run, near?)?);
        /// Median of this ratio over the slip events of five blocks or more.
        median_event_over_crossing_ratio: f64 = Events |run, _| median_over_crossing(run);
        /// Number of re-attachments in the run, of all blocks together.
        reattachment_count: u64 = Events |run, _| {
            Some((run.summary.switch_count - run.summary.detachment_count) as f64)
        };
        /// Share of positive velocities in the dense window, during the slip event whose length is
        /// nearest to the claimed one.
        event_forward_velocity_ratio: f64 = Windows |run, windows, near| {
            let velocities = velocities_in_event(run, windows, near?)?;
            let forward = velocities.iter().filter(|&&velocity| velocity > 0.0).count();
            Some(forward as f64 / velocities.len() as f64)
        };
        /// Lowest of these velocities over the highest.
        event_lowest_velocity_ratio: f64 = Windows |run, windows, near| {
            let velocities = velocities_in_event(run, windows, near?)?;
            let highest = velocities.iter().copied().reduce(f64::max)?;
            Some(velocities.into_iter().reduce(f64::min)? / highest)
        };
        /// Largest displacement of any block in the recorded states, mm.
        largest_displacement_mm: f64 [unit = "mm"] =
            States |_, states, _| states.largest_displacement_m.map(|u| u * 1e3);
        /// Number of over-damped modes of the free chain (5.30).
        overdamped_modes: u32 = Events |run, _| {
            let damping = run.of_chain()?.scenario.slider.relative_damping;
            Some(f64::from(analytic::overdamped_modes(damping, run.header.blocks)))
        };
        /// Root mean square deviation of a mode's velocity from (5.28), over its amplitude.
        ring_down_error_ratio: f64 = Windows |run, windows, _| ring_down_error(run.of_chain()?, windows);
        /// Speed of the longitudinal wave of `near` spacings along a lattice, by the pull of its
        /// bonds, m/s.
        longitudinal_wave_speed_m_per_s: f64 =
            Events |run, near| speeds_along_rows_m_per_s(&run.plan, near?).map(|[_, c]| c);
        /// Speed of the shear wave of that length along the lattice, m/s.
        shear_wave_speed_m_per_s: f64 =
            Events |run, near| speeds_along_rows_m_per_s(&run.plan, near?).map(|[c, _]| c);
    }
    "Before the first step" Robust {
        /// Largest deviation of the initial shear from (5.50), over `p`.
        initial_shear_error_ratio: f64 = States |run, states, _| initial_shear_error(run.of_chain()?, states);
        /// `tau_1 / p_1`.
        rest_shear_of_first_block_ratio: f64 =
            States |run, states, _| at_rest::shear_of_first_block(run, states);
        /// Largest sum of `tau_n` and its mirror image, over the largest `tau_n`.
        rest_shear_asymmetry_ratio: f64 = States |run, states, _| at_rest::asymmetry(run, states);
        /// The `beta` of (5.50) that has the same first moment as the shear.
        rest_shear_beta_ratio: f64 = States |run, states, _| at_rest::shear_beta(run, states);
        /// Poisson's ratio of a slab or a body, from its shear at rest and its expansion along x.
        rest_poisson_ratio: f64 = States |run, states, _| at_rest::poisson_ratio(run, states);
        /// `tau`: the prestress of the middle block minus sliding friction, over static minus sliding
        /// friction.
        relative_prestress_ratio: f64 =
            Events |run, _| front::relative_prestress(&run.of_chain()?.plan, run.plan.blocks / 2);
    }
    "The front from block 1, and pulses" AtDecayLength {
        /// Speed of the front that started at block 1 over the chain's wave speed `a sqrt(k / m)`: the
        /// least-squares line through its arrivals at blocks `N / 2` to `11 N / 12`; none if it did not
        /// reach them all.
        first_front_speed_over_wave_speed_ratio: f64 =
            Events |run, _| fronts::speed_over_c(run.of_one_row()?);
        /// Deviation of that speed from the theory of a steady front on rigid contacts, over the theory;
        /// none where there is no theory.
        first_front_speed_error_ratio: f64 =
            Events |run, _| Some(fronts::speed_error(run.of_chain()?)?.abs());
        /// The speed in that theory; and where friction falls over a slip, without prestress, dampers and radiation,
        /// that of a front that the force on block 1 pulls.
        first_front_speed_theory_ratio: f64 = Events |run, _| fronts::speed_theory(run.of_chain()?);
        /// Length of a slip pulse, in blocks: its speed times the mean time for which a block of the
        /// same span slides.
        pulse_length_blocks: f64 [unit = "1"] =
            Events |run, _| fronts::pulse_length_blocks(run.of_one_row()?);
        /// Mean slip behind a pulse, over that of the theory without damping, `2 tau / gamma` if friction falls at once.
        pulse_slip_ratio: f64 = Events |run, _| fronts::pulse_slip_ratio(run.of_one_row()?);
        /// Number of blocks that a front from block 1 has passed: all before the first one that never
        /// slid.
        first_front_reach_blocks: u32 =
            Events |run, _| Some(fronts::passages(run.of_one_row()?).len() as f64);
        /// `tau` of the last block that the front from block 1 reached; none if it reached all, or still
        /// runs.
        first_front_arrest_prestress_ratio: f64 = Events |run, _| fronts::arrest_prestress(run.of_chain()?);
        /// Number of blocks that slid behind a barrier, the block from which on friction falls over another slip, or else
        /// the last block of `prestress.from_blocks`; none if the last block of the chain slid as well, or a block
        /// still slides at the end.
        behind_barrier_blocks: u32 = Events |run, _| Some(Arrest::of(run.of_chain()?)?.blocks);
        /// Number of blocks before the barrier, `n`.
        before_barrier_blocks: u32 = Events |run, _| Some(Arrest::of(run.of_chain()?)?.before);
        /// `behind_barrier_blocks` over `n tau / |tau_b|`, with a `tau` above 0 of the blocks before the barrier and
        /// a `tau_b` below 0 behind it, without a drive.
        behind_barrier_crack_ratio: f64 = Events |run, _| Arrest::of(run.of_chain()?)?.over_crack();
        /// This ratio in theory, without damping: 2 of a crack that begins at a free end, and 1 if block 1 is
        /// stuck.
        behind_barrier_crack_theory_ratio: f64 =
            Events |run, _| Arrest::of(run.of_chain()?)?.over_crack_theory();
        /// `gamma`, the stiffness of a held top drive per block over that between blocks.
        held_stiffness_ratio: f64 = Events |run, _| Some(fronts::theory(run.of_chain()?)?.top_stiffness);
        /// `behind_barrier_blocks` times `sqrt(gamma)`: the length of a pulse behind the barrier, in the length on which
        /// the held drive acts; none without such a drive.
        behind_barrier_pulse_ratio: f64 = Events |run, _| Arrest::of(run.of_chain()?)?.of_pulse();
        /// This length over its upper bound in theory without damping, `(1 + sqrt(1 - tau^2)) / |tau_b|`.
        behind_barrier_pulse_bound_ratio: f64 =
            Events |run, _| Arrest::of(run.of_chain()?)?.over_pulse_bound();
        /// `d` behind a barrier of fracture energy, with `d = 0` and the same `tau` before it: over `tau^2 / gamma` of a
        /// pulse, over `(n tau)^2` of a crack before which `n` blocks slid.
        behind_barrier_fracture_ratio: f64 = Events |run, _| Arrest::of(run.of_chain()?)?.toughness();
        /// `behind_barrier_blocks` of a crack behind such a barrier, in theory, without damping, for `tau` far below 1.
        behind_barrier_blocks_theory: f64 [unit = "1"] =
            Events |run, _| Arrest::of(run.of_chain()?)?.of_tough_crack();
        /// `d` over that below which slip of the first blocks beside a stuck one runs away.
        weakening_slip_over_critical_ratio: f64 = Events |run, _| creep::over_critical(run.of_chain()?);
        /// `F_T / F_N` when the block in the middle first detaches.
        detachment_ft_fn: f64 [unit = "1"] = Loads |run, loads, _| {
            let [first, _] = run.switches.get((run.header.blocks as usize / 2).checked_sub(1)?)?.as_ref()?;
            rate_and_state::ft_fn_at(loads, run.plan.grid.time_s(first.step))
        };
        /// The same in theory, of a crack that follows a side drive, where friction weakens too slowly for jumps.
        detachment_theory_ratio: f64 = Events |run, _| creep::load_theory(run.of_chain()?);
        /// Time from the first to the last arrival of the front from block 1, over `sqrt(m / k)`; none
        /// if a block still slides at the end, unless it reached all or the next one is stuck.
        first_front_duration_ratio: f64 = Events |run, _| arrest::front_duration(run.of_one_row()?);
        /// This time of a slow front with radiation, in theory, for `tau n^2` far below 1; none with
        /// a drive or dampers.
        slow_front_duration_theory_ratio: f64 = Events |run, _| arrest::slow_front_duration(run.of_chain()?);
        /// Deviation of the time from that theory, over the theory.
        slow_front_duration_error_ratio: f64 = Events |run, _| {
            let run = run.of_chain()?;
            Some((arrest::front_duration(run)? / arrest::slow_front_duration(run)? - 1.0).abs())
        };
        /// `M`, the sum of the displacements of all blocks in the last recorded state, over
        /// `(mu_s - mu_d) p / k`: a moment over `k a`.
        slip_sum_ratio: f64 = States |run, states, _| arrest::slip_sum(run.of_chain()?, states);
        /// The sum at which the blocks that the front from block 1 has passed are in balance before a stuck
        /// block, in theory; none with a drive, or if blocks behind the first bear different prestress.
        slip_sum_theory_ratio: f64 = Events |run, _| arrest::static_slip_sum(run.of_chain()?);
        /// Deviation of the sum from that theory, over the theory.
        slip_sum_error_ratio: f64 = States |run, states, _| {
            let run = run.of_chain()?;
            Some((arrest::slip_sum(run, states)? / arrest::static_slip_sum(run)? - 1.0).abs())
        };
    }
    "Ruptures" OneDraw {
        /// Number of ruptures of a tenth of the blocks or more before the first that reached all,
        /// wherever they began.
        partial_rupture_count: u64 = Events |run, _| partial_ruptures::count(run);
        /// Share of the blocks in the largest of these ruptures; 0 without any.
        largest_partial_rupture_ratio: f64 = Events |run, _| partial_ruptures::largest_share(run);
        /// Distance from the driven end at which the first rupture of a tenth of the blocks or more
        /// began, mm.
        first_nucleation_mm: f64 [unit = "mm"] = Events |run, _| partial_ruptures::nucleation_mm(run);
        /// Speed of the front of the first rupture that reached every block, towards higher-numbered
        /// blocks, over the wave speed.
        first_global_rupture_front_speed_over_wave_speed_ratio: f64 =
            Events |run, _| partial_ruptures::global_front_over_c(run);
        /// Whether the fronts of precursors and of the first global rupture run faster under higher
        /// stress: Spearman's rank correlation of speed and `tau_n / p_n`, over an area of the local speed and
        /// the size of the tangential force over `p_n` at each contact, -1 to 1.
        front_stress_correlation: f64 [unit = "1"] =
            Fronts |run, passed| fronts::speed_stress_correlation(run, passed);
        /// Number of local front speeds: over any four spacings on one side of the nucleation block, in all
        /// ruptures of five blocks or more; over an area at each contact by the contacts around it.
        local_front_speed_count: u64 = Arrivals |run, arrivals| {
            Some(fronts::speeds(run, arrivals, fronts::FROM_BLOCKS, fronts::ACROSS)?.len() as f64)
        };
        /// Share of these speeds that are below 0.1 of the wave speed.
        slow_front_ratio: f64 = Arrivals |run, arrivals| {
            fronts::slow_ratio(&fronts::speeds(run, arrivals, fronts::FROM_BLOCKS, fronts::ACROSS)?)
        };
        /// Slow slip behind the first rupture of five blocks or more, or of any length in a slider of fewer
        /// blocks: the median over its blocks of the displacement from 0.5 ms after the arrival to the last record before the next rupture there, or
        /// of the run. Includes elastic displacement while the load grows.
        slow_slip_m: f64 = Motion |run, motion, _| slow_slip::median_m(run, motion, f64::INFINITY);
        /// This displacement, but no later than `near` s after the arrival.
        slow_slip_until_m: f64 = Motion |run, motion, near| slow_slip::median_m(run, motion, near?);
    }
    "Areas" OneDraw {
        /// `A_p`, the share of all contacts that slid, of the longest precursor among ruptures.
        longest_precursor_area_ratio: f64 = Events |run, _| {
            let precursors = precursors::among_ruptures(run, &PrecursorRules::default());
            let longest = precursors.iter().rfind(|rupture| !rupture.reached_every_block)?;
            Some(f64::from(longest.slipped()) / f64::from(run.header.blocks))
        };
        /// `A_p` of the largest of the precursors before the first global slip event; 0 without any.
        largest_precursor_event_area_ratio: f64 = Events |run, _| {
            let precursors = precursors::alone(run);
            Some(precursors.iter().map(|found| found.area_ratio(run.header.blocks)).fold(0.0, f64::max))
        };
        /// `A_p` of the largest precursor, or global slip event, that began at or below a given load
        /// `F_T / F_N`.
        event_area_at_load_ratio: f64 = Loads |run, loads, near| {
            largest_at_load(run, loads, near?, |precursor| precursor.area_ratio(run.header.blocks))
        };
        /// Contacts that slid over those in the box of columns and rows of the slip event: the median of all
        /// slip events of five contacts or more.
        median_event_box_ratio: f64 = Events |run, _| {
            let large = run.slips.iter().filter(|slip| slip.blocks_slipped >= fronts::FROM_BLOCKS);
            median(large.map(|slip| f64::from(slip.blocks_slipped) / slip.bounding_box().count() as f64))
        };
        /// Median of the local front speeds of the first rupture that reached every block, over the wave speed.
        first_global_local_front_speed_median_ratio: f64 =
            Arrivals |run, arrivals| fronts::global_quantile(run, arrivals, 0.5);
        /// Their lower quartile.
        first_global_local_front_speed_lower_quartile_ratio: f64 =
            Arrivals |run, arrivals| fronts::global_quantile(run, arrivals, 0.25);
        /// Their upper quartile.
        first_global_local_front_speed_upper_quartile_ratio: f64 =
            Arrivals |run, arrivals| fronts::global_quantile(run, arrivals, 0.75);
    }
    "Moments of ruptures" OneDraw {
        /// Exponent `b` of the rate of ruptures per unit of `ln M_0`, `M_0^-b`: over ruptures of up to a given number of
        /// blocks, `near`, with more than ten times the median moment of those of one block, during which no other slid;
        /// none of fewer than 50.
        moment_exponent: f64 [unit = "1"] = Events |run, near| moments::exponent(run, near?);
        /// Number of ruptures of more than `near` blocks with at least the median moment of those, over the number that this
        /// power law has there.
        moment_excess_ratio: f64 = Events |run, near| moments::excess_ratio(run, near?);
        /// Share of the moment of all ruptures that those of more than `near` blocks have.
        long_rupture_moment_ratio: f64 = Events |run, near| moments::share_ratio(run, near?);
    }
    "Junctions" OneDraw {
        /// Mean of `F_T / F_N` over time in the second half of the run.
        steady_ft_fn: f64 [unit = "1"] = Loads |_, loads, _| junctions::steady_ft_fn(loads);
        /// Friction over normal load in steady sliding at the velocity of the drive, in theory: of junctions
        /// at the mean load of a contact, by (a) of docs/contacts.md; of rate-and-state friction at the
        /// last velocity of the drive, if it moves at the end.
        steady_friction_theory_ratio: f64 =
            Events |run, _| junctions::steady_ratio(run).or_else(|| rate_and_state::steady_ratio(run));
        /// Largest friction over normal load, in theory; measured it is `largest_ft_fn`. Of junctions that of a
        /// contact that is pulled from its start in a time that is short against `t_R`, by (b); none for a
        /// drawn start. Of rate-and-state friction in a stiff machine that at the last velocity of the drive,
        /// before any slip there: with the state of steady sliding at the first velocity and of the longest hold.
        peak_friction_theory_ratio: f64 =
            Events |run, _| junctions::peak_ratio(run).or_else(|| rate_and_state::peak_ratio(run));
        /// Slow slip of block 1 of a chain whose other blocks stick, in theory, by (c), with its load and the
        /// stiffness that holds it: from rest, with all of its junctions slipping forwards, until all are
        /// pinned, if none of them breaks again.
        slow_slip_theory_m: f64 = Events |run, _| junctions::slow_slip_m(run);
    }
    "Rate and state" Robust {
        /// `F_T / F_N` at a given time.
        at_time_ft_fn: f64 [unit = "1"] = Loads |_, loads, near| rate_and_state::ft_fn_at(loads, near?);
        /// Longest time for which the drive rests and then moves again, by the course of its velocity; 0 if it never
        /// does. Of rate-and-state friction alone.
        hold_s: f64 = Events |run, _| rate_and_state::hold_s(run);
        /// Stiffness of the drive per block over the critical stiffness `k_c`, below which steady sliding is
        /// unstable.
        stiffness_over_critical_ratio: f64 = Events |run, _| rate_and_state::stiffness_over_critical(run);
        /// Growth of oscillations of `F_T / F_N` per radian, below 0 where they decay: the logarithm of the
        /// last rise or fall over the first one, over pi times the number of half periods between them.
        oscillation_growth_ratio: f64 = Loads |_, loads, _| rate_and_state::growth(loads);
        /// Growth per radian of small oscillations about steady sliding of one block, in theory; none where
        /// there are no oscillations.
        oscillation_growth_theory_ratio: f64 = Events |run, _| rate_and_state::growth_theory(run);
        /// Amplitude of the velocity of one block over that of the drive, in the last period of a swing of the
        /// prestress: from records of `F_T` that divide it evenly, else none.
        swing_velocity_ratio: f64 = Loads |run, loads, _| Some(rate_and_state::swing(run, loads)?[0]);
        /// Its phase: `cos(w t + phase)` where the prestress is `sin(w t)`.
        swing_phase_rad: f64 = Loads |run, loads, _| Some(rate_and_state::swing(run, loads)?[1]);
        /// That amplitude in theory, to first order.
        swing_velocity_theory_ratio: f64 = Events |run, _| rate_and_state::swing_theory(run);
    }
    "Series as solved" Robust {
        /// Number of events in which the largest speed of the blocks is at the event speed or above, by rows of `/series`
        /// between which its logarithm is linear.
        series_event_count: u64 = Series |run, of, _| Some(series::events(run, of.0).len() as f64);
        /// Onset of the event of a number, `near`, counted from 1 and by default that, s.
        series_event_onset_s: f64 = Series |run, of, near| Some(series::event(run, of, near.unwrap_or(1.0))?.onset_s);
        /// Time from its onset to its end, s.
        series_event_duration_s: f64 = Series |run, of, near| {
            let event = series::event(run, of, near.unwrap_or(1.0))?;
            Some(event.end_s? - event.onset_s)
        };
        /// Time from the onset of the event before it to its onset, s.
        series_event_recurrence_s: f64 = Series |run, of, near| {
            let onset_s = |number| Some(series::event(run, of, number)?.onset_s);
            Some(onset_s(near?)? - onset_s(near? - 1.0)?)
        };
        /// Largest speed of a block in it, m/s.
        series_event_peak_velocity_m_per_s: f64 =
            Series |run, of, near| Some(series::event(run, of, near.unwrap_or(1.0))?.peak_m_per_s);
        /// Depth of the node that is fastest at its onset, m; none without a medium.
        series_event_depth_m: f64 = Series |run, of, near| {
            let medium = run.plan.medium.as_ref()?;
            Some(medium.depth_m(series::event(run, of, near.unwrap_or(1.0))?.block as usize - 1))
        };
        /// Slip in it of the first block that the series have, m.
        series_event_slip_m: f64 = Series |run, of, near| series::first_slip_m(run, of, near.unwrap_or(1.0));
    }
}

fn mean_after_global_slip(run: &RunEvents, loads: &[Load]) -> Option<f64> {
    let from = run.first_global_slip()?.onset_step;
    let records = &loads[loads.partition_point(|record| record.step < from)..];
    Some(mean_in_time(records, Load::load_ratio)? / run.mu_d()?)
}

/// The global slips that have ended.
fn global_slips(run: &RunEvents) -> impl Iterator<Item = &SlipEvent> {
    run.slips.iter().filter(|slip| slip.is_global(run.header.blocks) && !slip.open)
}

fn largest_drop(run: &RunEvents) -> Option<&SlipEvent> {
    let extent = |slip: &SlipEvent| slip.ft_fn_max - slip.ft_fn_min;
    global_slips(run).max_by(|a, b| extent(a).total_cmp(&extent(b)))
}

/// The middle between the extrema of `F_T / F_N` in a slip.
fn middle(slip: &SlipEvent) -> f64 {
    (slip.ft_fn_max + slip.ft_fn_min) / 2.0
}

/// Velocities of all blocks of the dense window, while that event lasts.
fn velocities_in_event(run: &RunEvents, windows: &[WindowRecord], blocks: f64) -> Option<Vec<f64>> {
    let event = event_in_window(run, blocks)?;
    let steps = event.onset_step..event.end_step?;
    let records = windows.iter().filter(|record| record.window == 0 && steps.contains(&record.step));
    let velocities: Vec<f64> = records.flat_map(|record| &record.velocity_m_per_s).copied().collect();
    (!velocities.is_empty()).then_some(velocities)
}

fn rising_share(loads: &[Load]) -> Option<f64> {
    let (first, last) = (loads.first()?, loads.last()?);
    let rising_s: f64 = loads
        .windows(2)
        .filter(|pair| pair[1].driving_force_n > pair[0].driving_force_n)
        .map(|pair| pair[1].time_s - pair[0].time_s)
        .sum();
    (last.time_s > first.time_s).then(|| rising_s / (last.time_s - first.time_s))
}

/// The largest measure of the precursors, and of the global slip event after them, that began at or below a
/// load.
fn largest_at_load(
    run: &RunEvents,
    loads: &[Load],
    load_ratio: f64,
    measure: impl Fn(&Precursor<'_>) -> f64,
) -> Option<f64> {
    let precursors = precursors::one_by_one(run);
    let reached = precursors.iter().take_while(|precursor| precursor.start.ft_fn_onset <= load_ratio);
    // A run that ends below the load says nothing about it.
    time_to_reach(loads, load_ratio)?;
    Some(reached.map(measure).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use crate::made_up;
    use crate::number::number;

    /// Three columns of two rows: contacts 1 to 3 and 4 to 6. Slip events of one, three and all contacts, and
    /// ruptures likewise.
    #[test]
    fn over_an_area_numbers_are_of_columns_and_contacts() {
        let mut run = made_up::run("", &[(100, 101, &[1]), (200, 210, &[1, 2]), (400, 410, &[1, 2, 3])]);
        let ruptures: [&[made_up::Passed]; 3] = [
            &[(1, 100, Some(101))],
            &[(2, 200, Some(210)), (1, 201, Some(210)), (4, 203, Some(210))],
            &[
                (5, 400, Some(410)),
                (4, 401, Some(410)),
                (6, 402, Some(410)),
                (1, 403, Some(410)),
                (2, 404, Some(410)),
                (3, 405, Some(410)),
            ],
        ];
        made_up::with_ruptures(&mut run, &ruptures);
        (run.header.blocks, run.header.rows) = (6, 2);
        let boxes = [(1, 1, 1), (2, 2, 3), (3, 2, 6)];
        for (slip, (_, last_across, contacts)) in run.run.slips.iter_mut().zip(boxes) {
            (slip.first_across, slip.last_across) = (Some(1), Some(last_across));
            slip.blocks_slipped = contacts;
        }
        for (rupture, (last, last_across, contacts)) in run.run.ruptures.iter_mut().flatten().zip(boxes) {
            (rupture.first_block, rupture.last_block) = (1, last);
            (rupture.first_across, rupture.last_across) = (Some(1), Some(last_across));
            (rupture.contacts, rupture.reached_every_block) = (Some(contacts), contacts == 6);
        }
        let wave_m_per_s = run.plan.scales.wave_speed_m_per_s();
        for (arrival, share) in
            run.arrivals.iter_mut().filter(|one| one.rupture == 2).zip([0.05, 0.5, 1.0, 0.25])
        {
            arrival.local_speed_m_per_s = Some(share * wave_m_per_s);
        }
        let of = |name: &str| number(name, &run, None);
        let near = |name: &str, expected: f64| {
            let found = of(name).unwrap_or_else(|| panic!("no {name}"));
            assert!((found - expected).abs() < 1e-12, "{name}: {found}, not {expected}");
        };
        near("first_event_block_ratio", 1.0 / 6.0);
        near("longest_precursor_event_ratio", 2.0 / 3.0);
        near("largest_precursor_event_area_ratio", 0.5);
        near("longest_precursor_area_ratio", 0.5);
        assert_eq!(number("nearest_precursor_event_blocks", &run, Some(3.0)), Some(2.0));
        // Of the event of all six contacts alone: the others have fewer than five.
        near("median_event_box_ratio", 1.0);
        // The second rupture has a tenth of the contacts or more, and so has the first.
        near("partial_rupture_count", 2.0);
        near("largest_partial_rupture_ratio", 0.5);
        // From contact 1.
        assert_eq!(of("first_nucleation_mm"), Some(0.0));
        near("local_front_speed_count", 4.0);
        near("slow_front_ratio", 0.25);
        near("first_global_local_front_speed_median_ratio", 0.375);
        near("first_global_local_front_speed_lower_quartile_ratio", 0.2);
        near("first_global_local_front_speed_upper_quartile_ratio", 0.625);
        for name in [
            "affected_blocks",
            "first_front_speed_over_wave_speed_ratio",
            "first_front_reach_blocks",
            "pulse_length_blocks",
            "pulse_slip_ratio",
            "rest_poisson_ratio",
        ] {
            assert_eq!(of(name), None, "{name}");
        }
    }
}
