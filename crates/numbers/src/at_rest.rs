//! Numbers of the state before the first step, which of a slab is that of rest under its load.
//!
//! A pressed slab would expand along x by Poisson's ratio; the restraint at its foot leaves a shear. The
//! expansion and the shear determine each other by the theorem of Betti, with a slab stretched evenly along
//! x as the second state,
//!
//! ```text
//! E B H <dL> = nu F_N H - sum of x_n tau_n
//! ```
//!
//! for a thickness `B`, a height `H`, the mean `<dL>` over the height of the elongation of the slab, and
//! `x_n` from any origin, since the `tau_n` of a slab at rest add up to 0. The stiffness of contacts and
//! foundation does not enter.

use crate::run_data::RunEvents;
use crate::states::States;

/// `tau_n` and `p_n` of every contact in the state before the first step.
fn forces_n<'a>(run: &'a RunEvents, states: &'a States) -> Option<(&'a [f64], &'a [f64])> {
    let first = states.first()?;
    let own = !first.normal_load_n.is_empty();
    let borne_n = if own { &first.normal_load_n } else { &run.plan.normal_load_n };
    Some((&first.tangential_force_n, borne_n))
}

/// `tau_1 / p_1`.
pub(crate) fn shear_of_first_block(run: &RunEvents, states: &States) -> Option<f64> {
    let (tau_n, p_n) = forces_n(run, states)?;
    Some(tau_n[0] / p_n[0])
}

/// The largest sum of `tau_n` and its mirror image, over the largest `tau_n`; `None` without shear.
pub(crate) fn asymmetry(run: &RunEvents, states: &States) -> Option<f64> {
    let (tau_n, _) = forces_n(run, states)?;
    let largest = tau_n.iter().fold(0.0f64, |most, tau| most.max(tau.abs()));
    let pairs = tau_n.iter().zip(tau_n.iter().rev());
    let off = pairs.fold(0.0f64, |most, (tau, mirrored)| most.max((tau + mirrored).abs()));
    (largest > 0.0).then(|| off / largest)
}

/// The `beta` of a shear `beta p (2 x / L - 1)` (5.50), with the mean `p`, that has the same first
/// moment, over an area in all rows; `None` of a single block, whose place is both ends.
pub(crate) fn shear_beta(run: &RunEvents, states: &States) -> Option<f64> {
    let (tau_n, p_n) = forces_n(run, states)?;
    let mean_n = p_n.iter().sum::<f64>() / p_n.len() as f64;
    let (mut moment, mut of_one) = (0.0, 0.0);
    let contacts = run.header.contacts();
    for (tau, contact) in tau_n.iter().zip(1..) {
        let column = f64::from(contacts.column(contact) - 1);
        let place = 2.0 * column / f64::from(contacts.columns() - 1) - 1.0;
        moment += place * tau;
        of_one += place * place * mean_n;
    }
    (tau_n.len() > 1).then(|| moment / of_one)
}

/// Poisson's ratio, from the shear and from how much longer the slab has become; `None` of others: over an
/// area the shear across enters as well.
pub(crate) fn poisson_ratio(run: &RunEvents, states: &States) -> Option<f64> {
    if !run.plan.elastic.has_inside() || run.of_one_row().is_none() {
        return None;
    }
    let lattice = run.plan.elastic.as_lattice();
    let (tau_n, _) = forces_n(run, states)?;
    let (u, last) = (&run.plan.initial.displacement_m, lattice.rows - 1);
    let longer_m = |row: usize| u[lattice.row(row).end - 1] - u[lattice.row(row).start];
    // The rows at top and bottom represent half a spacing each.
    let ends_m = 0.5 * (longer_m(0) + longer_m(last));
    let mean_m = (ends_m + (1..last).map(longer_m).sum::<f64>()) / last as f64;
    let slider = &run.scenario.slider;
    let moment_n_m: f64 = tau_n.iter().enumerate().map(|(n, tau)| n as f64 * run.plan.spacing_m * tau).sum();
    let pulled_n_m = slider.youngs_modulus_pa * slider.width_m * slider.height_m * mean_m;
    Some((pulled_n_m + moment_n_m) / (run.plan.total_normal_load_n * slider.height_m))
}

#[cfg(test)]
mod tests {
    use asperity_model::{Plan, resolve, slab};
    use asperity_record::FieldRecord;

    use super::{asymmetry, poisson_ratio, shear_beta, shear_of_first_block};
    use crate::made_up;

    #[test]
    fn a_shear_is_over_what_contacts_bear() {
        let mut run = made_up::slab(&[]);
        assert_eq!(
            (shear_of_first_block(&run, &run.states), asymmetry(&run, &run.states)),
            (Some(-0.2), Some(0.0))
        );
        // A first moment of 40 N, over that of 400/3 N on each end.
        assert!(
            (shear_beta(&run, &run.states).unwrap() - 0.15).abs() < 1e-12,
            "{:?}",
            shear_beta(&run, &run.states)
        );
        let mut state = run.states.first().unwrap().clone();
        state.tangential_force_n = vec![-20.0, 0.0, 30.0];
        made_up::with_states(&mut run, &[state]);
        assert_eq!(asymmetry(&run, &run.states), Some(1.0 / 3.0));
        let mut state = run.states.first().unwrap().clone();
        (state.tangential_force_n, state.normal_load_n) = (vec![30.0], vec![100.0]);
        made_up::with_states(&mut run, &[state]);
        assert_eq!(shear_beta(&run, &run.states), None, "of one block");
        let chain = made_up::run("", &[]);
        assert_eq!(poisson_ratio(&chain, &chain.states), None, "of a chain");
    }

    /// Poisson's ratio is that of the sheet, whatever restrains its foot, apart from effects of the edges.
    #[test]
    fn growth_and_shear_add_up_to_poissons_ratio() {
        for ratio in ["1e-3", "1", "10"] {
            let set = format!("friction.interfacial_stiffness_ratio={ratio}");
            let mut run = made_up::slab(&[]);
            run.scenario = resolve("slab", &[set.as_str()]).unwrap();
            run.plan = Plan::new(&run.scenario);
            let state = FieldRecord {
                tangential_force_n: slab::tangential_force_n(&run.plan),
                normal_load_n: run.plan.normal_load_n.clone(),
                ..run.states.first().unwrap().clone()
            };
            made_up::with_states(&mut run, &[state]);
            let error = 3.0 * poisson_ratio(&run, &run.states).unwrap() - 1.0;
            assert!((-0.04..0.0).contains(&error), "{ratio}: {error}");
        }
    }
}
