//! Numbers of the state before the first step, which of a slab or a body is that of rest under its load.
//!
//! A pressed slab or body would expand by Poisson's ratio; the restraint at its foot leaves a shear. The
//! expansion and the shear determine each other by the theorem of Betti, with a slider stretched evenly along
//! x as the second state,
//!
//! ```text
//! E B H <dL> = nu (F_N H + sum of y_n tau_y,n) - sum of x_n tau_x,n
//! ```
//!
//! for a thickness `B`, a height `H`, the mean `<dL>` of the elongation over the faces at its ends, and `x_n`
//! from any origin, since the `tau_n` at rest add up to 0. Of a slab there is no `tau_y`; a body that is
//! stretched gets narrower as well as lower. The stiffness of contacts and foundation does not enter.

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

/// Poisson's ratio, from the shear and from how much longer a slab or a body has become; `None` of others.
pub(crate) fn poisson_ratio(run: &RunEvents, states: &States) -> Option<f64> {
    if !run.plan.elastic.has_inside() {
        return None;
    }
    let lattice = run.plan.elastic;
    let (tau_n, _) = forces_n(run, states)?;
    let counts = [lattice.columns, lattice.lanes, lattice.rows];
    // Of the two faces at the ends, the nodes at an edge represent half as much, those at a corner a quarter.
    let share = |count: usize, place: usize| match (count, place) {
        (1, _) => 1.0,
        (_, 0) => 0.5 / (count - 1) as f64,
        (_, _) if place + 1 == count => 0.5 / (count - 1) as f64,
        _ => 1.0 / (count - 1) as f64,
    };
    let (mut longer_m, mut moment_n_m, mut moment_across_n_m) = (0.0, 0.0, 0.0);
    for (node, u) in run.plan.initial.displacement_m[..lattice.nodes()].iter().enumerate() {
        let [column, lane, row] = lattice.place(node);
        let of_face = share(counts[1], lane) * share(counts[2], row);
        longer_m += match column {
            0 => -of_face * u,
            _ if column + 1 == lattice.columns => of_face * u,
            _ => 0.0,
        };
        if let Some(tau) = tau_n.get(node) {
            moment_n_m += column as f64 * run.plan.spacing_m * tau;
        }
        if let Some(tau) = states.first()?.tangential_force_across_n.get(node) {
            moment_across_n_m += lane as f64 * run.plan.spacing_m * tau;
        }
    }
    let slider = &run.scenario.slider;
    let pulled_n_m = slider.youngs_modulus_pa * slider.width_m * slider.height_m * longer_m;
    let pressed_n_m = run.plan.total_normal_load_n * slider.height_m;
    Some((pulled_n_m + moment_n_m) / (pressed_n_m + moment_across_n_m))
}

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::plan::slab;
    use asperity_model::resolve;
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

    /// Poisson's ratio is that of the bonds, whatever restrains the foot, apart from effects of the edges,
    /// where bonds count in full.
    #[test]
    fn growth_and_shear_add_up_to_poissons_ratio() {
        for ratio in ["1e-3", "1", "10"] {
            // Half the spacing, half the effect.
            let scenarios =
                [("slab", 1.0 / 3.0, -0.04), ("body-coarse", 0.25, -0.09), ("body", 0.25, -0.045)];
            for (scenario, theory, least) in scenarios {
                let set = format!("friction.interfacial_stiffness_ratio={ratio}");
                let mut run = made_up::slab(&[]);
                run.scenario = resolve(scenario, &[set.as_str()]).unwrap();
                run.plan = Plan::new(&run.scenario);
                let mut along_n = slab::tangential_force_n(&run.plan);
                let state = FieldRecord {
                    tangential_force_across_n: along_n.split_off(run.plan.blocks),
                    tangential_force_n: along_n,
                    normal_load_n: run.plan.normal_load_n.clone(),
                    ..run.states.first().unwrap().clone()
                };
                made_up::with_states(&mut run, &[state]);
                let error = poisson_ratio(&run, &run.states).unwrap() / theory - 1.0;
                assert!((least..0.0).contains(&error), "{scenario}, {ratio}: {error}");
            }
        }
    }
}
