//! What theory says of the junctions of a run: the closed forms of docs/contacts.md with its numbers.

use asperity_model::Plan;

use crate::run_data::{Load, RunEvents};

/// Mean of `F_T / F_N` over time in the second half of what is recorded.
pub(crate) fn steady_ft_fn(loads: &[Load]) -> Option<f64> {
    let (first, last) = (loads.first()?, loads.last()?);
    let middle_s = 0.5 * (first.time_s + last.time_s);
    let from = loads.partition_point(|record| record.time_s < middle_s);
    crate::hold_phase::mean_in_time(&loads[from..], Load::load_ratio)
}

/// Friction over normal load of steady sliding at the velocity of the drive, at the mean load of a contact. None where the
/// velocity has a course.
pub(crate) fn steady_ratio(run: &RunEvents) -> Option<f64> {
    let (plan, friction) = (&run.plan, &run.plan.friction);
    let velocity_m_per_s = plan.drive.velocity_m_per_s;
    let load_n = plan.total_normal_load_n / plan.blocks as f64;
    let mu = [friction.static_coefficient, friction.dynamic_coefficient];
    let law = friction.law.junctions()?;
    (velocity_m_per_s > 0.0 && plan.drive.course.is_none())
        .then(|| law.steady_coefficient(mu, load_n, velocity_m_per_s))
}

/// The largest friction over normal load of a contact that is pulled from its even start.
pub(crate) fn peak_ratio(run: &RunEvents) -> Option<f64> {
    let friction = &run.plan.friction;
    let law = friction.law.junctions().filter(|law| !law.are_drawn)?;
    Some(law.peak_coefficient(friction.static_coefficient, friction.dynamic_coefficient))
}

/// Slow slip of block 1 of a chain whose other blocks stick, m.
pub(crate) fn slow_slip_m(run: &RunEvents) -> Option<f64> {
    let (plan, friction) = (&run.plan, &run.plan.friction);
    let law = friction.law.junctions()?;
    let (mu_d, load_n) = (friction.dynamic_coefficients[0], plan.normal_load_n[0]);
    Some(law.slow_slip_m(mu_d, load_n, stiffness_that_holds_block_1_n_per_m(plan)?))
}

/// The stiffness against which block 1 of a chain moves without its contact while all other blocks stick: of
/// its drive, and of its bond in series with what holds block 2.
fn stiffness_that_holds_block_1_n_per_m(plan: &Plan) -> Option<f64> {
    let bond = plan.elastic.as_chain()?.stiffness_n_per_m;
    let drive = plan.drive.stiffness_n_per_m(plan.blocks);
    let contacts = &plan.friction.contact_stiffness_n_per_m;
    let beyond = (1..plan.blocks).rev().fold(0.0, |beyond, n| {
        let held = contacts[n] + drive[n] + beyond;
        bond * held / (bond + held)
    });
    Some(drive[0] + beyond)
}

#[cfg(test)]
mod tests {
    use asperity_model::Plan;
    use asperity_model::body::chain::Stiffness;

    use super::stiffness_that_holds_block_1_n_per_m;
    use crate::made_up;
    use crate::number::number;
    use crate::run_data::Load;

    const LAW: &str = "friction.law = \"junctions\"\nfriction.static_coefficient = 0.4\n\
                       friction.dynamic_coefficient = 0.17\n";

    fn close(found: Option<f64>, expected: f64) {
        assert!(found.is_some_and(|found| (found / expected - 1.0).abs() < 1e-12), "{found:?} {expected}");
    }

    /// With contacts alike it is what the solution of the stuck chain leaves without contact 1.
    #[test]
    fn the_stiffness_is_that_of_the_stuck_chain_without_the_first_contact() {
        for sets in [&["slider.blocks=1"][..], &["slider.blocks=12"], &["drive.kind=top"]] {
            let plan = Plan::new(&asperity_model::resolve("chain-junctions", sets).unwrap());
            let chain = &plan.elastic.as_chain().unwrap();
            let mut response_m = vec![0.0; plan.blocks];
            response_m[0] = 1.0;
            Stiffness::of(&plan, chain).solve(&mut response_m);
            let expected = 1.0 / response_m[0] - plan.friction.contact_stiffness_n_per_m[0];
            close(stiffness_that_holds_block_1_n_per_m(&plan), expected);
        }
    }

    /// Three blocks with 10 junctions each; the numbers are worked out by hand.
    #[test]
    fn theory_takes_the_numbers_of_the_run() {
        let keys = "friction.junction_count = 10\nfriction.junction_width = 0.1\nnormal_load.tilt = -0.5\n\
                    friction.dynamic_offsets = [0.03, 0.0, 0.0]\ndrive.velocity_m_per_s = 1e-3";
        let run = made_up::run(&format!("{LAW}{keys}"), &[]);
        // 400 N on three blocks, tilted: 66.7 N, 133.3 N and 200 N.
        let contact = |load_n: f64| (39.2e9 * load_n * 10.0_f64).sqrt();
        let mean_n = 400.0 / 3.0;
        let pinned_s = 0.4 * mean_n / contact(mean_n) / 1e-3;
        close(
            number("steady_friction_theory_ratio", &run, None),
            (0.2 * pinned_s + 0.17 * 2e-3) / (pinned_s + 2e-3),
        );
        // At the first break the weakest junction bears 0.4, the mean of all 0.045 less.
        close(number("peak_friction_theory_ratio", &run, None), 0.4 - 0.045);
        let (k, drive) = (2.5e9 * 2.0 * 1e-3, 8e5);
        let series = |a: f64, b: f64| 1.0 / (1.0 / a + 1.0 / b);
        let held = drive + series(k, contact(mean_n) + series(k, contact(200.0)));
        let (f, kn) = (400.0 / 60.0, contact(400.0 / 6.0) / 10.0);
        let slip_m: f64 = (1..=10).map(|j| 0.2 * f / (held + f64::from(j) * kn)).sum();
        close(number("slow_slip_theory_m", &run, None), slip_m);
    }

    #[test]
    fn other_laws_and_bodies_have_no_such_theory() {
        for run in [made_up::run("", &[]), made_up::slab(&[])] {
            for name in ["steady_friction_theory_ratio", "peak_friction_theory_ratio", "slow_slip_theory_m"] {
                assert_eq!(number(name, &run, None), None, "{name}");
            }
        }
        let held = made_up::run(&format!("{LAW}drive.velocity_m_per_s = 0"), &[]);
        assert_eq!(number("steady_friction_theory_ratio", &held, None), None, "nothing slides");
        let toml = format!("{LAW}drive.course_s = [0, 1e-3]\ndrive.course_m_per_s = [1e-4, 2e-4]");
        let course = made_up::run(&toml, &[]);
        assert_eq!(number("steady_friction_theory_ratio", &course, None), None, "the velocity changes");
    }

    #[test]
    fn steady_friction_is_a_mean_over_time_in_the_second_half() {
        let mut run = made_up::run("", &[]);
        assert_eq!(number("steady_ft_fn", &run, None), None);
        let load = |(time_s, driving_force_n): (f64, f64)| Load {
            step: 0,
            time_s,
            driving_force_n,
            normal_load_n: 100.0,
            end_forces_n: None,
            sliding: 0,
        };
        // From 5 s on: 10 N to 20 N in 1 s, then 20 N for 4 s.
        run.loads = [(0.0, 90.0), (4.0, 90.0), (5.0, 10.0), (6.0, 20.0), (10.0, 20.0)].map(load).to_vec();
        close(number("steady_ft_fn", &run, None), 0.19);
    }
}
