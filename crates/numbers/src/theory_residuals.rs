//! Single numbers that set a run beside a theory, for the list of numbers.

use asperity_model::theory::analytic::{self, LengthLaw, LoadCurve};
use asperity_record::WindowRecord;

use crate::curves::{PrecursorPoint, line_beside_law, precursor_points, ring_down};
use crate::estimate::{self, Estimate};
use crate::precursors;
use crate::run_data::{Load, RunEvents};
use crate::states::States;

/// A block counts as affected by the force on block 1 while it carries more than this part of
/// it. The thesis names no cut-off; this one gives all four of the numbers that it reads off
/// Figure 5.20, as those from 0.474 % to 0.517 % do.
pub const AFFECTED_THRESHOLD: f64 = 0.0049;

pub(crate) fn time_to_reach(loads: &[Load], load_ratio: f64) -> Option<f64> {
    loads.iter().find(|record| record.load_ratio() >= load_ratio).map(|record| record.time_s)
}

/// How many blocks carry more than a share of the force on block 1.
pub(crate) fn carrying(tau_n: &[f64], share: f64) -> f64 {
    tau_n.iter().filter(|force_n| **force_n > share * tau_n[0]).count() as f64
}

/// The force on the block after the last affected one, over that on block 1: at this cut-off it no
/// longer counts.
pub(crate) fn affected_cut_off(states: &States, blocks: f64) -> Option<f64> {
    let tau = &states.at_first_onset()?.tangential_force_n;
    Some(tau.get(blocks as usize)? / tau[0])
}

/// `k_t / k`; of junctions, whose springs are those of the mean load, from these.
fn stiffness_ratio(run: &RunEvents) -> f64 {
    let (plan, friction) = (&run.plan, &run.scenario.friction);
    match plan.friction.law.junctions() {
        Some(_) => plan.friction.interfacial_stiffness_n_per_m / plan.elastic.stiffness_n_per_m,
        None => friction.interfacial_stiffness_ratio,
    }
}

pub(crate) fn affected_blocks_theory(run: &RunEvents) -> f64 {
    f64::from(analytic::affected_blocks(stiffness_ratio(run), AFFECTED_THRESHOLD))
}

pub(crate) fn affected_blocks_error(run: &RunEvents, states: &States) -> Option<f64> {
    let tau = &states.at_first_onset()?.tangential_force_n;
    let ratio = stiffness_ratio(run);
    // Three decades, a hundred cut-offs in each.
    largest(
        (1..=300).map(|n| 10f64.powf(-f64::from(n) / 100.0)).map(|threshold| {
            carrying(tau, threshold) - f64::from(analytic::affected_blocks(ratio, threshold))
        }),
    )
}

/// Relative deviation of the shear on the first block ahead of an arrested front from the `alpha p` of
/// (5.48): the mean of all precursors before the first global slip.
pub(crate) fn ahead_of_front_error(run: &RunEvents, states: &States) -> Option<Estimate> {
    let friction = &run.plan.friction;
    let alpha = (friction.static_coefficient + run.mu_d()?) / 2.0;
    let ratios: Vec<f64> = precursors::alone(run)
        .iter()
        .filter_map(|precursor| {
            let ahead = precursor.last_block as usize;
            let fields = states.at_precursor_end(precursor.end.end_step?)?;
            Some(fields.tangential_force_n.get(ahead)? / run.plan.normal_load_n[ahead])
        })
        .collect();
    let mean = estimate::mean(&ratios)?.distance_from(alpha).over(alpha);
    (run.plan.load_course.is_constant() && run.plan.has_given_loads()).then_some(mean)
}

/// None where nothing sticks, or the ends are not free: no length law is of it.
pub(crate) fn points(run: &RunEvents, law: LengthLaw) -> Vec<PrecursorPoint> {
    let has_laws = run.has_free_ends().and(run.mu_d()).is_some();
    let precursors = if has_laws { precursors::alone(run) } else { Vec::new() };
    precursor_points(run, law, &precursors)
}

/// Root mean square of the deviations of precursors from a law, over `mu_d`.
pub(crate) fn rms_over_mu_d(run: &RunEvents, points: &[PrecursorPoint]) -> Option<Estimate> {
    let residuals: Vec<f64> = points.iter().map(|point| point.ft_fn - point.predicted).collect();
    Some(estimate::root_mean_square(&residuals)?.over(run.mu_d()?))
}

/// Deviation of the slope of the straight line through precursors from that of the law.
pub(crate) fn slope_error(points: &[PrecursorPoint]) -> Option<Estimate> {
    let [slope, _] = line_beside_law(points)?;
    Some(slope.distance_from(1.0))
}

/// Deviation of its intercept from that of the law, over `mu_d`.
pub(crate) fn intercept_error(run: &RunEvents, points: &[PrecursorPoint]) -> Option<Estimate> {
    let [_, intercept] = line_beside_law(points)?;
    Some(intercept.distance_from(0.0).over(run.mu_d()?))
}

/// Deviation of the load from its theory in the step records up to `mu_d`.
pub(crate) fn load_curve_error(run: &RunEvents, loads: &[Load]) -> Option<f64> {
    let curve = LoadCurve::of(&run.scenario)?.points();
    let end_s = time_to_reach(loads, run.mu_d()?)?.min(curve.last()?.0);
    let theory = |time_s: f64| {
        let after = curve.partition_point(|point| point.0 <= time_s).clamp(1, curve.len() - 1);
        let [(from_s, low), (to_s, high)] = [curve[after - 1], curve[after]];
        low + (high - low) * (time_s - from_s) / (to_s - from_s)
    };
    let deviations = loads
        .iter()
        .take_while(|record| record.time_s <= end_s)
        .map(|record| record.load_ratio() - theory(record.time_s));
    Some(largest(deviations)? / run.mu_d()?)
}

pub(crate) fn initial_shear_error(run: &RunEvents, states: &States) -> Option<f64> {
    let fields = states.first()?;
    let plan = &run.plan;
    let expected = asperity_model::plan::initial::shear_profile(
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

pub(crate) fn onset_profile_error(run: &RunEvents, states: &States) -> Option<f64> {
    let tau = &states.at_first_onset()?.tangential_force_n;
    largest(tau.iter().enumerate().map(|(n, force)| {
        let distance_m = n as f64 * run.plan.spacing_m;
        let screening_m = run.plan.screening_length_m();
        (force - analytic::stuck_tangential_force(tau[0], 0.0, distance_m, screening_m)) / tau[0]
    }))
}

pub(crate) fn decaying_drive_onset_error(run: &RunEvents) -> Option<f64> {
    let (plan, decay_m) = (&run.plan, run.scenario.drive.decay_length_m);
    let (mu_s, screening_m) = (plan.friction.static_coefficient, plan.screening_length_m());
    let predicted = analytic::decaying_drive_onset(mu_s, decay_m, screening_m, plan.length_m);
    (decay_m > 0.0).then_some((run.slips.first()?.ft_fn_onset / predicted - 1.0).abs())
}

pub(crate) fn ring_down_error(run: &RunEvents, windows: &[WindowRecord]) -> Option<f64> {
    let points = ring_down(run, windows);
    let squares: f64 = points.iter().map(|(_, simulated, theory)| (simulated - theory).powi(2)).sum();
    (!points.is_empty()).then(|| (squares / points.len() as f64).sqrt())
}

pub(crate) fn largest(deviations: impl Iterator<Item = f64>) -> Option<f64> {
    deviations.map(f64::abs).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use asperity_record::{FieldRecord, StepRecord};
    use asperity_testkit::quiet_step;

    use crate::made_up;
    use crate::number::number;
    use crate::run_data::{Load, RunData};

    /// Three blocks with these forces at every onset and end.
    fn with_fields(forces_n: [f64; 3]) -> RunData {
        with_fields_of("", forces_n)
    }

    fn with_fields_of(toml: &str, forces_n: [f64; 3]) -> RunData {
        let mut run = made_up::run(toml, &made_up::EVENTS);
        let steps = run.slips.iter().flat_map(|slip| [Some(slip.onset_step), slip.end_step]).flatten();
        let states: Vec<FieldRecord> = steps
            .map(|step| FieldRecord {
                step,
                time_s: run.plan.grid.time_s(step),
                displacement_m: vec![0.0; 3],
                velocity_m_per_s: vec![0.0; 3],
                tangential_force_n: forces_n.to_vec(),
                normal_load_n: Vec::new(),
                stick_position_m: vec![0.0; 3],
                detached: vec![0; 3],
                ..FieldRecord::default()
            })
            .collect();
        made_up::with_states(&mut run, &states);
        run
    }

    #[test]
    fn affected_blocks_count_by_the_cut_off_and_tell_where_it_lies() {
        // A chain with k_t = k has 1, 0.382, 0.146; the third of these is 0.003.
        let run = with_fields([100.0, 38.2, 0.3]);
        assert_eq!(number("affected_blocks", &run, None), Some(2.0));
        let cut_off = |name: &str, near| number(name, &run, Some(near)).unwrap();
        assert!((cut_off("affected_cut_off_lowest_ratio", 2.0) - 0.003).abs() < 1e-12);
        assert!((cut_off("affected_cut_off_highest_ratio", 2.0) - 0.382).abs() < 1e-12);
        assert_eq!(number("affected_cut_off_lowest_ratio", &run, Some(3.0)), None);
        // At a cut-off of 0.31 % the infinite chain has seven blocks, this one two.
        assert_eq!(number("affected_blocks_error", &run, None), Some(5.0));
    }

    #[test]
    fn shear_ahead_of_the_front_is_that_of_the_next_block_over_its_load() {
        // 133.3 N on each block; precursors end at blocks 1, 2 and 3, the last without a next one.
        let run = with_fields([0.0, 60.0, 80.0]);
        let expected = ((60.0 + 80.0) / 2.0 / (400.0 / 3.0) / 0.575_f64 - 1.0).abs();
        let ours = number("ahead_of_event_front_error_ratio", &run, None).unwrap();
        assert!((ours - expected).abs() < 1e-12, "{ours} {expected}");
        // Where each contact has a course, the loads of the start are not those at the end of a precursor.
        let toml = "normal_load.course_s = [0, 1e-5]\nnormal_load.course_factor = [1, 1, 1, 1, 2, 1]";
        let courses = with_fields_of(toml, [0.0, 60.0, 80.0]);
        assert_eq!(number("ahead_of_event_front_error_ratio", &courses, None), None);
    }

    #[test]
    fn the_load_curve_is_compared_up_to_the_dynamic_coefficient() {
        let mut run = made_up::run("time.duration_s = 5", &[]);
        let curve = asperity_model::theory::analytic::LoadCurve::of(&run.scenario).unwrap().points();
        let record = |driving_force_n: f64, step: u64, time_s: f64| {
            let step = quiet_step(step, time_s, 0.0);
            Load::from(&StepRecord { driving_force_n, normal_load_n: 400.0, ..step })
        };
        let along =
            curve.iter().map(|&(time_s, ratio)| record(400.0 * ratio, (time_s / 1e-7) as u64, time_s));
        run.loads = along.collect();
        assert!(number("load_curve_error_ratio", &run, None).unwrap() < 1e-12);
        assert!(number("time_to_dynamic_coefficient_error_ratio", &run, None).unwrap() < 1e-12);
        run.loads[100].driving_force_n -= 400.0 * 0.045;
        assert!((number("load_curve_error_ratio", &run, None).unwrap() - 0.1).abs() < 1e-9);
        // Records after the end of the theory's range do not count.
        run.loads.push(record(0.0, 40_000_000, 4.0));
        assert!((number("load_curve_error_ratio", &run, None).unwrap() - 0.1).abs() < 1e-9);
    }

    #[test]
    fn straight_lines_through_precursors_are_told_by_slope_and_intercept() {
        let mut run = made_up::run("", &made_up::EVENTS);
        // Lengths 1/3, 2/3, 1 and 1 of three blocks; 1.1 times (5.57), and 0.009 more.
        for (slip, length) in [(0, 1.0), (1, 2.0), (4, 3.0), (5, 3.0)] {
            run.slips[slip].ft_fn_onset = 1.1 * 0.45 * length / 3.0 + 0.009;
        }
        let of = |name: &str| number(name, &run, None).unwrap();
        assert!((of("event_slope_error_linear_ratio") - 0.1).abs() < 1e-12);
        assert!((of("event_intercept_error_linear_ratio") - 0.02).abs() < 1e-12);
        assert!((of("first_global_event_load_error_ratio") - 0.12).abs() < 1e-12);
    }
}
