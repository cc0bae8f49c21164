//! Refuses, for a single block, keys that vary along a row of blocks: they divide by the `N - 1` gaps
//! between blocks, or need a second block to balance the first.

use crate::choices::DriveKind;
use crate::lattice_keys::Refusal;
use crate::scenario::Scenario;

/// Checks the rules for a single block. Keys at their defaults are accepted.
pub(crate) fn refused(scenario: &Scenario) -> Vec<Refusal> {
    if scenario.slider.blocks > 1 || scenario.slider.is_lattice() {
        return Vec::new();
    }
    let (drive, shear, prestress) = (&scenario.drive, &scenario.initial_shear, &scenario.prestress);
    let balanced = "is initial shear, which adds up to 0 over all blocks: one block has none";
    let along = "varies from the first block to the last, and one block is both";
    let numbers = [
        (
            "normal_load.tilt",
            scenario.normal_load.tilt,
            "shifts load from one block to another, and there is one",
        ),
        ("drive.tilt", drive.tilt, along),
        ("drive.decay_length_m", drive.decay_length_m, along),
        ("initial_shear.beta", shear.beta, balanced),
        ("initial_shear.poisson_ratio", shear.poisson_ratio, balanced),
        ("prestress.rise_ratio", prestress.rise_ratio, along),
    ];
    let several = |accepted: &str| format!("{accepted}, or slider.blocks from 2");
    let of_number =
        |(key, value, problem): &(_, f64, &str)| (*key, format!("{value} {problem}"), several("0"));
    let mut refused: Vec<Refusal> =
        numbers.iter().filter(|(_, value, _)| *value != 0.0).map(of_number).collect();
    for (key, is_there, problem) in [
        ("initial_shear.profile", !shear.profile.is_empty(), balanced),
        ("initial_shear.profile_csv", !shear.profile_csv.is_empty(), balanced),
        ("prestress.profile_csv", !prestress.profile_csv.is_empty(), along),
        ("prestress.course_csv", !prestress.course_csv.is_empty(), along),
        ("normal_load.course_csv", !scenario.normal_load.course_csv.is_empty(), along),
    ] {
        if is_there {
            refused.push((key, format!("a profile {problem}"), several("none")));
        }
    }
    if drive.kind == DriveKind::LeftRight {
        let problem =
            "left-right pulls the first block backwards and the last forwards, and one block is both";
        refused.push(("drive.kind", problem.to_owned(), several("\"side\" or \"top\"")));
    }
    // Nothing reads the mode of a block at rest, whose default is 1.
    let velocity = &scenario.initial_velocity;
    if velocity.mode > 1 || (velocity.mode == 1 && velocity.amplitude_m_per_s != 0.0) {
        let problem = format!("one block moves as a whole, and has no mode {}", velocity.mode);
        refused.push(("initial_velocity.mode", problem, several("0")));
    }
    refused
}

#[cfg(test)]
mod tests {
    use crate::{Plan, Scenario, ScenarioSource};

    fn resolve(text: &str) -> Result<Scenario, String> {
        let text = format!("slider.blocks = 1\n{text}");
        Scenario::resolve(&ScenarioSource::new("test.toml", text)).map_err(|errors| errors.to_string())
    }

    #[test]
    fn what_needs_a_second_block_is_refused_with_the_reason() {
        for (text, key) in [
            ("normal_load.tilt = -0.5", "normal_load.tilt: -0.5 shifts"),
            ("drive.kind = \"top\"\ndrive.tilt = 0.5", "drive.tilt: 0.5 varies"),
            ("drive.kind = \"top\"\ndrive.decay_length_m = 0.1", "drive.decay_length_m: 0.1 varies"),
            ("initial_shear.beta = 0.1", "initial_shear.beta: 0.1 is initial shear"),
            ("initial_shear.poisson_ratio = 0.3", "initial_shear.poisson_ratio: 0.3 is initial shear"),
            ("initial_shear.profile = [0.1]", "initial_shear.profile: a profile is initial shear"),
            (
                "initial_shear.profile_csv = \"no file\"",
                "initial_shear.profile_csv: a profile is initial shear",
            ),
            ("prestress.rise_ratio = 0.1", "prestress.rise_ratio: 0.1 varies"),
            ("prestress.profile_csv = \"no file\"", "prestress.profile_csv: a profile varies"),
            (
                "drive.kind = \"left-right\"\nfriction.reattach = \"two-way\"",
                "drive.kind: left-right pulls the first block backwards and the last forwards, and one",
            ),
            ("initial_velocity.amplitude_m_per_s = 0.1", "initial_velocity.mode: one block moves as a whole"),
            (
                "initial_velocity.mode = 2",
                "initial_velocity.mode: one block moves as a whole, and has no mode 2",
            ),
        ] {
            let errors = resolve(text).unwrap_err();
            assert!(errors.contains(key) && errors.lines().count() == 1, "{text}: {errors}");
            assert!(errors.ends_with(", or slider.blocks from 2)"), "{text}: {errors}");
        }
    }

    #[test]
    fn what_acts_on_one_block_is_accepted() {
        let plan = |text: &str| Plan::new(&resolve(text).unwrap_or_else(|errors| panic!("{errors}")));
        let block = plan("");
        assert_eq!((block.blocks, block.spacing_m, &block.normal_load_n[..]), (1, 0.1, &[400.0][..]));
        // k = E L_y L_z / L, and k_t the same; only the latter and the drive hold the block.
        assert_eq!(block.elastic.stiffness_n_per_m, 2.5e6);
        let held_n_per_m = block.friction.interfacial_stiffness_n_per_m + 8e5;
        let longest_s = 2.0 * (0.012 / held_n_per_m).sqrt();
        assert!((block.longest_stable_step_s - longest_s).abs() < 1e-12 * longest_s);
        assert!((block.scales.wave_speed_m_per_s() - (2.5e9 * 0.1 * 1e-4 / 0.012_f64).sqrt()).abs() < 1e-9);
        for text in [
            "drive.kind = \"top\"",
            "prestress.ratio = 0.1\nprestress.first_block_ratio = 0.1\nprestress.profile = [0.1]",
            "initial_velocity.amplitude_m_per_s = 0.1\ninitial_velocity.mode = 0",
            "friction.static_spread = 0.1\nfriction.dynamic_offsets = [0.01]",
            "time.start = \"loaded\"",
        ] {
            let plan = plan(text);
            let drive = &plan.drive.springs;
            assert!(drive.len() == 1 && drive[0].block == 0 && drive[0].stiffness_n_per_m == 8e5, "{text}");
            let initial = &plan.initial;
            let numbers = [&initial.displacement_m, &initial.velocity_m_per_s, &initial.stick_position_m];
            assert!(numbers.into_iter().flatten().all(|number| number.is_finite()), "{text}: {initial:?}");
        }
    }
}
