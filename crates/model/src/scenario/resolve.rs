//! From a name or a text to a resolved scenario.

use std::io;
use std::path::Path;

use asperity_record::{MOST_STEPS, TimeGrid};

use crate::plan::disorder::Quantity;
use crate::plan::given_state;
use crate::scenario::Scenario;
use crate::scenario::builtin;
use crate::scenario::defaults;
use crate::scenario::files::{Files, Texts};
use crate::scenario::meaning;
use crate::scenario::profile;
use crate::scenario::rules;
use crate::scenario::rules::in_few_digits;
use crate::scenario::source::{Entries, Refusals, ScenarioErrors, ScenarioSource};
use crate::scenario::stand_ins;
use crate::scenario::suggest;
use crate::scenario::text;

/// Resolves a built-in scenario, or a file, by its name, with overrides of the form
/// `key=value`, later ones over earlier ones.
///
/// ```
/// let scenario = asperity_model::resolve("default", &["normal_load.tilt=0.5"])?;
/// assert_eq!(scenario.normal_load.tilt, 0.5);
///
/// let error = asperity_model::resolve("defualt", &["normal_load.tilt=0.5"]).unwrap_err();
/// assert!(error.to_string().contains("did you mean default?"));
/// # Ok::<(), asperity_model::ResolveError>(())
/// ```
///
/// # Errors
/// If there is neither a built-in scenario nor a readable file of that name; or all errors in the scenario,
/// each with its place.
pub fn resolve<T: AsRef<str>>(name: impl AsRef<Path>, overrides: &[T]) -> Result<Scenario, ResolveError> {
    let source = source(name.as_ref())?;
    Ok(source.resolve(&name.as_ref().to_string_lossy(), overrides, &Texts)?)
}

/// A built-in scenario, or a file, by its name, as written.
///
/// # Errors
/// If there is neither a built-in scenario nor a readable file of that name.
pub fn source(name: &Path) -> Result<ScenarioSource, ResolveError> {
    // A path need not be UTF-8; messages are.
    let text = find(name)?;
    let name = name.to_string_lossy();
    let origin = if builtin::find(&name).is_some() { format!("built-in {name}") } else { name.to_string() };
    Ok(ScenarioSource::new(origin, text))
}

/// The text of a built-in scenario, or of a file, by its name.
///
/// # Errors
/// If there is neither a built-in scenario nor a readable file of that name.
pub fn find(name: &Path) -> Result<String, ResolveError> {
    match name.to_str().and_then(builtin::find) {
        Some(text) => Ok(text.to_owned()),
        None => text::read(name)
            .map_err(|source| ResolveError::Unknown { name: name.to_string_lossy().into_owned(), source }),
    }
}

impl ScenarioSource {
    /// Resolves it with overrides of the form `key=value`, later ones over earlier ones.
    ///
    /// # Errors
    /// All errors, each with its place, or with `name` if the place is in no text.
    pub fn resolve<T: AsRef<str>>(
        self,
        name: &str,
        overrides: &[T],
        files: &dyn Files,
    ) -> Result<Scenario, ScenarioErrors> {
        let source =
            overrides.iter().fold(self, |source, assignment| source.with_override(assignment.as_ref()));
        Scenario::resolve_with(&source, files).map_err(|mut errors| {
            // Defaults have no place in a text, but the values that they contradict are in this scenario.
            for error in errors.0.iter_mut().filter(|error| error.place.is_none()) {
                error.place = Some(name.to_owned());
            }
            errors
        })
    }
}

/// Reasons why a name gives no scenario.
#[derive(Debug, thiserror::Error)]
pub enum ResolveError {
    /// No built-in scenario or file has that name.
    #[error(
        "scenario {name}: neither a file that can be read ({source}) nor a built-in scenario{} \
         (accepted: a path, or a name that `asperity scenario list` prints)",
        suggest::suggestion(name, builtin::all().map(|(name, _)| name))
    )]
    Unknown {
        /// The requested name.
        name: String,
        /// The error of reading a file of that name.
        source: io::Error,
    },
    /// The scenario is invalid.
    #[error(transparent)]
    Scenario(#[from] ScenarioErrors),
}

impl Scenario {
    /// Resolves a scenario as written: fills in defaults and checks every value against its key and
    /// the keys against each other. Opens no file.
    ///
    /// # Errors
    /// Everything that is wrong, each with its place; also if it names a file whose values it lacks.
    pub fn resolve(source: &ScenarioSource) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolved(source, None)
    }

    /// [`Scenario::resolve`], with what opens the files that it names.
    ///
    /// # Errors
    /// Everything that is wrong, each with its place.
    pub fn resolve_with(source: &ScenarioSource, files: &dyn Files) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolved(source, Some(files))
    }

    fn resolved(source: &ScenarioSource, files: Option<&dyn Files>) -> Result<Scenario, ScenarioErrors> {
        let entries = source.entries()?;
        let mut refusals = Refusals { entries: &entries, files, errors: Vec::new() };
        let mut values = defaults::fill_in(&entries, &mut refusals.errors);
        refusals.none_so_far()?;
        stand_ins::replace(source, &mut values, &mut refusals);
        meaning::decide_by_medium(&mut values, &mut refusals);
        meaning::decide_by_law(&mut values, &mut refusals);
        let mut scenario = Scenario::of(values);
        scenario.round_default_times(&entries);
        scenario.read_files(&mut refusals);
        rules::check(&scenario, &mut refusals);
        refusals.none_so_far()?;
        given_state::read(&mut scenario, &mut refusals);
        refusals.none_so_far()?;
        rules::check_start(&scenario, &mut refusals);
        refusals.none_so_far()?;
        refusals.errors.extend(scenario.too_long_for_a_log(&entries));
        refusals.none_so_far()?;
        Ok(scenario)
    }

    /// Rounds times that nobody wrote to whole steps, at least one, so that only what is written is refused.
    fn round_default_times(&mut self, entries: &Entries) {
        let grid = TimeGrid::new(self.time.step_s);
        let duration = "time.duration_s";
        for (key, time_s) in [
            (duration, &mut self.time.duration_s),
            ("recording.sample_s", &mut self.recording.sample_s),
            ("recording.fields_s", &mut self.recording.fields_s),
        ] {
            let steps = grid.nearest_step(*time_s).max(1);
            let is_whole = grid.whole_steps(*time_s).is_some_and(|steps| steps > 0);
            // A run of too many steps remains one; a cadence that long is as good as none.
            if !is_whole
                && *time_s > 0.0
                && !entries.values.contains_key(key)
                && (key != duration || steps <= MOST_STEPS)
            {
                *time_s = in_few_digits(&grid, grid.time_s(steps.min(MOST_STEPS / 2)));
            }
        }
    }

    /// Reads the lists of the files that it names.
    fn read_files(&mut self, reading: &mut Refusals<'_>) {
        let (blocks, contacts) = (self.slider.blocks as usize, self.slider.contacts() as usize);
        let (shear, prestress, load) = (&mut self.initial_shear, &mut self.prestress, &mut self.normal_load);
        let (friction, disorder) = (&mut self.friction, &mut self.disorder);
        let grid = TimeGrid::new(self.time.step_s);
        let on_a_step = |time_s: f64| {
            let nearest = grid.nearest_step(time_s);
            let is_between = time_s > 0.0 && nearest <= MOST_STEPS && grid.whole_steps(time_s).is_none();
            if is_between { in_few_digits(&grid, grid.time_s(nearest)) } else { time_s }
        };
        let of_start = [
            ("friction.initial_velocities_m_per_s", &mut friction.initial_velocities_m_per_s),
            ("friction.initial_thetas_s", &mut friction.initial_thetas_s),
        ];
        let (file, accepted) = (&friction.initial_csv, profile::ACCEPTED_START.to_owned());
        let parse = |text: &str| profile::parse_start(text, blocks);
        reading.lists(("friction.initial_csv", file), of_start, parse, accepted);
        let [mu_s, mu_d, kt, p] = Quantity::ALL.map(Quantity::offsets_key);
        let of_blocks = [
            (mu_s, &mut friction.static_offsets),
            (mu_d, &mut friction.dynamic_offsets),
            (kt, &mut disorder.stiffness_offsets),
            (p, &mut disorder.load_offsets),
        ];
        let parse = |text: &str| profile::parse_blocks(text, contacts);
        let accepted = profile::accepted_blocks(contacts);
        reading.lists(("disorder.contacts_csv", &disorder.contacts_csv), of_blocks, parse, accepted);
        let medium = &mut self.medium;
        let of_depths = [
            ("medium.profile_m", &mut medium.profile_m),
            ("medium.direct_effect", &mut medium.direct_effect),
            ("medium.evolution_effect", &mut medium.evolution_effect),
            ("medium.critical_slip_m", &mut medium.critical_slip_m),
            ("medium.normal_stress_pa", &mut medium.normal_stress_pa),
        ];
        let (file, accepted) = (&medium.profile_csv, profile::ACCEPTED_DEPTHS.to_owned());
        reading.lists(("medium.profile_csv", file), of_depths, profile::parse_depths, accepted);
        let of_load = [
            ("normal_load.course_s", &mut load.course_s),
            ("normal_load.course_factor", &mut load.course_factor),
        ];
        let of_prestress = [
            ("prestress.course_s", &mut prestress.course_s),
            ("prestress.course_ratio", &mut prestress.course_ratio),
        ];
        for (key, file, value, lists) in [
            ("normal_load.course_csv", &load.course_csv, "factor", of_load),
            ("prestress.course_csv", &prestress.course_csv, "ratio", of_prestress),
        ] {
            // Times of a laboratory fall between steps.
            let rounded =
                |[times_s, values]: [Vec<f64>; 2]| [times_s.into_iter().map(on_a_step).collect(), values];
            let parse = |text: &str| profile::parse_course(text, value, blocks).map(rounded);
            reading.lists((key, file), lists, parse, profile::accepted_course(value));
        }
        for (key, file, list, profile) in [
            ("initial_shear.profile_csv", &shear.profile_csv, "initial_shear.profile", &mut shear.profile),
            ("prestress.profile_csv", &prestress.profile_csv, "prestress.profile", &mut prestress.profile),
        ] {
            let parse = |text: &str| profile::parse_profile(text, blocks);
            reading.lists((key, file), [(list, profile)], parse, profile::ACCEPTED.to_owned());
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::MOST_STEPS;

    use crate::scenario::choices::{ParameterSet, Reattach};
    use crate::scenario::source::{ScenarioErrors, ScenarioSource};
    use crate::scenario::{Scenario, Slider};

    fn resolve(text: &str) -> Result<Scenario, ScenarioErrors> {
        Scenario::resolve(&ScenarioSource::new("test.toml", text))
    }

    #[test]
    fn parameter_sets_differ_in_mass_and_damping_alone() {
        let coded = resolve("parameter_set = \"as-coded\"").unwrap();
        let stated = resolve("").unwrap();
        assert_eq!((coded.slider.mass_kg, stated.slider.mass_kg), (12.0, 0.012));
        assert_eq!(coded.slider.relative_damping, 10f64.sqrt());
        assert_eq!(stated.slider.relative_damping, 0.01f64.sqrt());
        let levelled = Scenario {
            parameter_set: ParameterSet::AsCoded,
            slider: Slider { mass_kg: 12.0, relative_damping: 10f64.sqrt(), ..stated.slider.clone() },
            ..stated
        };
        assert_eq!(levelled, coded);
    }

    /// Whatever the step, defaults fit it, and what is shown gives the same; cadences were refused that nobody wrote.
    #[test]
    fn only_times_that_are_written_are_refused() {
        for digit in [1, 3, 7] {
            for power in -30..=30 {
                let text = format!("time.step_s = {digit}e{power}");
                let refused = resolve(&text).err().map(|errors| errors.to_string()).unwrap_or_default();
                let step_s: f64 = format!("{digit}e{power}").parse().unwrap();
                let has_too_many = 5.0 / step_s > MOST_STEPS as f64;
                assert_eq!(refused.contains("time.duration_s: 5 is "), has_too_many, "{text}: {refused}");
                assert!(!refused.contains("recording."), "{text}: {refused}");
            }
        }
        let odd = resolve("parameter_set = 'as-coded'\ntime.step_s = 7e-7").unwrap();
        let times = [odd.time.duration_s, odd.recording.sample_s, odd.recording.fields_s];
        assert_eq!(times, [4.9999999, 0.0010003, 0.0199997]);
        assert_eq!(resolve(&odd.to_commented_toml()).unwrap(), odd);
        let coarse = "slider.mass_kg = 2500\nslider.youngs_modulus_pa = 250\nslider.width_m = 1\nslider.height_m = 1\n\
                        slider.length_m = 24\nslider.blocks = 25\ntime.step_s = 0.003\ntime.duration_s = 300";
        let recording = resolve(coarse).unwrap().recording;
        assert_eq!([recording.sample_s, recording.fields_s], [0.003, 0.021]);
    }

    /// A laboratory's times were refused, which lie between steps.
    #[test]
    fn knots_of_a_file_are_rounded_to_steps_and_written_ones_are_refused() {
        let file = std::env::temp_dir().join(format!("asperity-knots-{}.csv", std::process::id()));
        let read = |rows: &str, key: &str, value: &str| {
            std::fs::write(&file, format!("time_s,x_over_l,{value}\n{rows}")).unwrap();
            let source = ScenarioSource::new("test.toml", "slider.blocks = 2\ntime.step_s = 1e-6");
            let source = source.with_override(&format!("{key}={}", file.display()));
            Scenario::resolve_with(&source, &crate::Texts).map_err(|errors| errors.to_string())
        };
        let rows = "0.1,0,1\n0.1,1,1\n0.20000049,0,0.5\n0.20000049,1,0.5\n0.3000006,0,1\n0.3000006,1,1\n";
        let load = read(rows, "normal_load.course_csv", "factor").unwrap().normal_load;
        assert_eq!(load.course_s, [0.1, 0.2, 0.300001]);
        assert_eq!(
            read(rows, "prestress.course_csv", "ratio").unwrap().prestress.course_s,
            [0.1, 0.2, 0.300001]
        );
        for (rows, problem) in [
            (
                "0.1,0,1\n0.1,1,1\n0.1000002,0,1\n0.1000002,1,1\n",
                "goes from 0.1 to 0.1 (accepted: times that ascend",
            ),
            (
                "-1e-9,0,1\n-1e-9,1,1\n",
                "-0.000000001 is not accepted (accepted: a list, each a number from 0)",
            ),
        ] {
            let error = read(rows, "normal_load.course_csv", "factor").unwrap_err();
            assert!(error.contains(problem), "{error}");
        }
        std::fs::remove_file(&file).unwrap();
        let written =
            "slider.blocks = 2\nnormal_load.course_s = [0.1000000001]\nnormal_load.course_factor = [1]";
        let error = resolve(written).unwrap_err().to_string();
        assert!(error.contains("0.1000000001 is not a whole number of steps of "), "{error}");
    }

    #[test]
    fn errors_name_place_key_value_and_range() {
        for (text, expected) in [
            (
                "[slider]\nblocks = 0",
                "test.toml:2:10: slider.blocks: 0 is not accepted (accepted: a whole number from 1 to 100000)",
            ),
            (
                "[slider]\n  blokcs = 7",
                "test.toml:2:12: slider.blokcs: unknown key, set to 7; did you mean slider.blocks? \
                 (accepted: the keys of `asperity scenario show default`)",
            ),
            (
                "slider.length_m = \"long\"",
                "test.toml:1:19: slider.length_m: \"long\" is not accepted (accepted: a number above 0)",
            ),
            (
                "normal_load.tilt = -1.5",
                "test.toml:1:20: normal_load.tilt: -1.5 is not accepted (accepted: a number from -1 to 1)",
            ),
            (
                "drive.velocity_m_per_s = nan",
                "test.toml:1:26: drive.velocity_m_per_s: nan is not accepted (accepted: a number from 0)",
            ),
            (
                "initial_shear.beta = inf",
                "test.toml:1:22: initial_shear.beta: inf is not accepted (accepted: any finite number)",
            ),
            (
                "friction.dynamic_coefficient = 0.8",
                "test.toml:1:32: friction.dynamic_coefficient: 0.8 is above friction.static_coefficient = 0.7 \
                 (accepted: a number from 0 to 0.7)",
            ),
            (
                "time.step_s = 1e-4",
                "test.toml:1:15: time.step_s: 1e-4 is above the stability limit of the scheme for this chain \
                 (accepted: a number above 0 and below 5.694e-7)",
            ),
            (
                "slider.width_m = 5e-324",
                "test.toml:1:18: slider.width_m: 5e-324 is too small to calculate with (accepted: a number above 0, \
                 of a magnitude from 1e-30 to 1e30)",
            ),
            (
                "normal_load.schedule_s = [0, 1]\nnormal_load.schedule_n = [400, 1e31]",
                "test.toml:2:26: normal_load.schedule_n: 1e31 is too large to calculate with (accepted: a list, each \
                 a number above 0, of a magnitude from 1e-30 to 1e30)",
            ),
            (
                "time.step_s = 1e-8\nslider.mass_kg = 1e-29\nslider.relative_damping = 3.1622776601683795",
                "test.toml:1:15: time.step_s: 1e-8 is above the stability limit of the scheme for this chain \
                 (accepted: a number above 0 and below 3.085e-21)",
            ),
            (
                "parameter_set = 'as-coded'\ntime.step_s = 1.7e-13\nslider.relative_damping = 7.5e7\ntime.duration_s = 1.7e-12\n\
                 recording.sample_s = 0\nrecording.fields_s = 0",
                "test.toml:2:15: time.step_s: 1.7e-13 is above the stability limit of the scheme for this chain \
                 (accepted: a number above 0 and below 1.468e-13)",
            ),
            (
                "time.duration_s = 2.4e-8",
                "test.toml:1:19: time.duration_s: 0.000000024 is not a whole number of steps of 1e-8 s \
                 (accepted: a multiple of time.step_s; the nearest is 0.00000002)",
            ),
            (
                "recording.sample_s = 1e-30\ndrive.hold_from_s = 4e-15",
                "test.toml:2:21: drive.hold_from_s: 0.000000000000004 is not a whole number of steps of 1e-8 s \
                 (accepted: a multiple of time.step_s; the nearest is 0.00000001)\n\
                 test.toml:1:22: recording.sample_s: 0.000000000000000000000000000001 is not a whole number of steps of \
                 1e-8 s (accepted: a multiple of time.step_s; the nearest is 0.00000001)",
            ),
            (
                "time.step_s = 1e-10\ntime.duration_s = 1e6",
                "test.toml:2:19: time.duration_s: 1000000 is 1e16 steps of 1e-10 s \
                 (accepted: at most 2^53 steps, 900719.9254740992)",
            ),
            (
                "friction.reattach = \"sometimes\"",
                "test.toml:1:21: friction.reattach: \"sometimes\" is not accepted \
                 (accepted: \"one-way\" or \"two-way\" or \"turn\")",
            ),
            (
                "[friction]\nmu_s = 0.8",
                "test.toml:2:8: friction.mu_s: unknown key, set to 0.8; did you mean \
                 friction.static_coefficient? (accepted: the keys of `asperity scenario show default`)",
            ),
            (
                "[[recording.window]]\nform_s = 0\nto_s = 1\nevery_s = 1e-3\nfirst_block = 1\nlast_block = 2",
                "test.toml:2:10: recording.window.form_s: unknown key, set to 0; did you mean \
                 recording.window.from_s? (accepted: the keys of `asperity scenario show default`)\n\
                 test.toml:4:11: recording.window.from_s: missing in this window (accepted: a number from 0)",
            ),
            ("[slider", "test.toml:1:8: not TOML: unclosed table, expected `]`"),
            (
                "[drive]\nkind = sides # all\n[slider]\nblocks = 7",
                "test.toml:2:8: drive.kind: sides lacks its quotes; did you mean side? (accepted: \"side\" or \"top\" \
                 or \"left-right\" or \"force\" or \"plate\")",
            ),
            (
                "drive.kind = side\nfriction.law = rigid",
                "test.toml:1:14: not TOML: string values must be quoted, expected literal string",
            ),
            (
                "drive.kind = \"left_right\"",
                "test.toml:1:14: drive.kind: \"left_right\" is not accepted; did you mean left-right? \
                 (accepted: \"side\" or \"top\" or \"left-right\" or \"force\" or \"plate\")",
            ),
            (
                "slider.length_m = 0,14",
                "test.toml:1:20: not TOML: unexpected key or value, expected newline, `#` (accepted: a number with a \
                 decimal point, as 0.1)",
            ),
            (
                "[[recording.window]]\nfrom_s = 0\nto_s = 9\nevery_s = 1e-3\nfirst_block = 1\nlast_block = 101",
                "test.toml:3:8: recording.window.to_s: 9 is not inside the run (accepted: a number from 0 to 5)\n\
                 test.toml:6:14: recording.window.last_block: 101 is not inside the chain \
                 (accepted: a whole number from 1 to 100)",
            ),
        ] {
            assert_eq!(resolve(text).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn overrides_win_and_are_named_in_errors() {
        let source =
            |set: &str| ScenarioSource::new("test.toml", "normal_load.tilt = 0.5").with_override(set);
        assert_eq!(Scenario::resolve(&source("normal_load.tilt=0.25")).unwrap().normal_load.tilt, 0.25);
        assert_eq!(
            Scenario::resolve(&source("friction.reattach=two-way")).unwrap().friction.reattach,
            Reattach::TwoWay
        );
        assert_eq!(
            Scenario::resolve(&source("normal_load.tilt=2")).unwrap_err().to_string(),
            "--set normal_load.tilt=2: normal_load.tilt: 2 is not accepted (accepted: a number from -1 to 1)"
        );
        for (set, expected) in [
            (
                "tilt=0.4",
                "--set tilt=0.4: tilt: unknown key, set to 0.4; did you mean drive.tilt or normal_load.tilt? \
                 (accepted: the keys of `asperity scenario show default`)",
            ),
            // No keys of TOML.
            (
                "k_t/k=2",
                "--set k_t/k=2: k_t/k: unknown key, set to 2; did you mean \
                 friction.interfacial_stiffness_ratio? (accepted: the keys of `asperity scenario show default`)",
            ),
            (
                "friction law=rigid",
                "--set friction law=rigid: friction law: unknown key, set to \"rigid\"; did you mean \
                 friction.law? (accepted: the keys of `asperity scenario show default`)",
            ),
        ] {
            assert_eq!(Scenario::resolve(&source(set)).unwrap_err().to_string(), expected);
        }
        assert_eq!(
            Scenario::resolve(&source("nonsense")).unwrap_err().to_string(),
            "--set nonsense: not TOML: key with no value, expected `=` \
             (accepted: KEY=VALUE, as in --set time.duration_s=0.1)"
        );
    }

    #[test]
    fn misspelt_scenarios_are_told_the_nearest() {
        let error = super::resolve::<&str>("defualt", &[]).unwrap_err().to_string();
        assert!(error.starts_with("scenario defualt: neither a file that can be read ("), "{error}");
        assert!(
            error.contains(
                ") nor a built-in scenario; did you mean default? (accepted: a path, or a name that `asperity "
            ),
            "{error}"
        );
        let error = super::resolve::<&str>("mine.toml", &[]).unwrap_err().to_string();
        assert!(error.contains(") nor a built-in scenario (accepted: a path,"), "{error}");
    }

    /// An invalid default has no place in the texts.
    #[test]
    fn errors_without_a_place_name_the_scenario() {
        let error = super::resolve("default", &["slider.length_m=1e-27"]).unwrap_err().to_string();
        assert!(error.starts_with("default: time.step_s: 1e-8 is above the stability limit"), "{error}");
    }

    /// Suggestions are found fast.
    #[test]
    fn endless_and_countless_unknown_keys_are_refused_at_once() {
        let long = format!("{} = 1", "blocks".repeat(2_000_000));
        let many: String = (0..20_000).map(|n| format!("blokcs{n} = 1\n")).collect();
        let started = std::time::Instant::now();
        assert_eq!(resolve(&long).unwrap_err().0.len(), 1);
        assert_eq!(resolve(&many).unwrap_err().0.len(), 20_000);
        assert!(started.elapsed().as_secs() < 20, "{:?}", started.elapsed());
    }
}
