//! The one list of the numbers of a run, by the names that claims, studies and figures give.

use std::borrow::Cow;

use asperity_model::suggestion;
use asperity_record::ColumnKind;
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Deserializer, de};

use crate::estimate::Estimate;
use crate::key::Key;
use crate::list;
use crate::of::Of;
use crate::required_data::RequiredData;
use crate::run_data::RunData;
use crate::summary::Summary;

/// A number of a run: a key of the summary that is no word, or one that is taken when it is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Number {
    /// Its name, unit and meaning.
    pub key: &'static Key,
    of: Of,
}

impl Number {
    /// All of them: those of the summary first.
    pub fn all() -> impl Iterator<Item = Number> {
        let of_summary = Summary::KEYS.iter().enumerate();
        let of_summary = of_summary.map(|(place, key)| Number { key, of: Of::Summary(place) });
        let others = list::NUMBERS.iter().map(|(key, of)| Number { key, of: *of });
        of_summary.filter(|number| number.key.column.kind != ColumnKind::Word).chain(others)
    }

    /// That of a name.
    ///
    /// # Errors
    /// In words, with the name that may be meant.
    pub fn find(name: &str) -> Result<Number, String> {
        let found = Number::all().find(|number| number.name() == name);
        found.ok_or_else(|| {
            let meant = suggestion(name, Number::all().map(Number::name));
            format!("there is no number {name:?} (accepted: those of `asperity numbers`){meant}")
        })
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        let Key { column, .. } = self.key;
        &column.name
    }

    /// Whether every summary has it, so that sweeps do.
    pub fn is_of_summary(self) -> bool {
        matches!(self.of, Of::Summary(_))
    }

    /// The number of a summary that has it.
    pub fn of_summary(self, summary: &Summary) -> Option<f64> {
        if let Of::Summary(place) = self.of { summary.number(place) } else { None }
    }

    /// Whether it counts events.
    pub fn is_count(self) -> bool {
        self.name().ends_with("_count")
    }

    /// The data of a run that it requires.
    pub fn required_data(self) -> RequiredData {
        self.of.required_data()
    }

    /// The number of a run; `None` if the run does not have it, or its data were not kept. `near` is a
    /// number of blocks, for numbers of the nearest precursor, the load `F_T / F_N` for numbers at a given
    /// load, or a time, s, for numbers up to it.
    pub fn of(self, run: &RunData, near: Option<f64>) -> Option<f64> {
        self.estimate(run, near).map(|estimate| estimate.value)
    }

    /// The number with its standard error: that of statistics of precursors; others have none.
    pub fn estimate(self, run: &RunData, near: Option<f64>) -> Option<Estimate> {
        self.of.estimate(run, near).ok().flatten()
    }
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Number, D::Error> {
        Number::find(&String::deserialize(deserializer)?).map_err(de::Error::custom)
    }
}

impl JsonSchema for Number {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let one =
            |number: Number| json_schema!({"const": number.name(), "description": number.key.column.about});
        json_schema!({"type": "string", "oneOf": Number::all().map(one).collect::<Vec<Schema>>()})
    }
}

#[cfg(test)]
pub(crate) fn number(name: &str, run: &RunData, near: Option<f64>) -> Option<f64> {
    Number::find(name).unwrap().of(run, near)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use asperity_record::{ColumnKind, StepRecord};
    use asperity_testkit::quiet_step;

    use super::{Number, number};
    use crate::made_up;
    use crate::made_up::EVENTS;
    use crate::required_data::RequiredData;
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
        // Between slips the drive pulls evenly up to the hold, and rests after it.
        let between = (0..450).map(|n| {
            let step = n * 100_000 + 50_000;
            StepRecord {
                driving_force_n: 80.0 * run.plan.grid.time_s(step.min(10_000_000)),
                normal_load_n: run.plan.outside(step, 10_000_000).load().scaled_n(400.0),
                ..quiet_step(step, run.plan.grid.time_s(step), 0.0)
            }
        });
        run.loads = between.map(|record| Load::from(&record)).collect();
        run
    }

    #[test]
    fn flanks_are_straight_while_driven_and_hyperbolas_once_held() {
        let run = unloaded();
        assert!(number("sag_before_hold_ratio", &run, None).unwrap().abs() < 1e-9);
        // From 2 s, 300 N, to 4 s, 100 N, F_X / F_N goes as 1 / F_N. With r = 3 its mean is
        // ln r / (r - 1) of its end; half its rise less that, over its rise.
        let expected = ((1.0 / 3.0 + 1.0) / 2.0 - 3f64.ln() / 2.0) / (1.0 - 1.0 / 3.0);
        let sag = number("sag_after_hold_ratio", &run, None).unwrap();
        assert!((sag - expected).abs() < 2e-3, "{sag} {expected}");
        assert!(number("hyperbola_error_after_hold_ratio", &run, None).unwrap() < 1e-12);
        assert!(number("parabola_error_after_hold_ratio", &run, None).unwrap() > 0.02);
    }

    #[test]
    fn flanks_with_a_pause_in_the_unloading_do_not_count() {
        let mut run = unloaded();
        let toml = "drive.hold_from_s = 1.0\n\
                    normal_load.schedule_s = [1.0, 2.5, 3.0, 4.0]\n\
                    normal_load.schedule_n = [400.0, 300.0, 300.0, 100.0]";
        run.plan = made_up::run(toml, &[]).run.plan;
        // The flank from 2 s to 4 s has knots; the longest left is that from 1.2 s to 2 s.
        let sag = number("sag_after_hold_ratio", &run, None).unwrap();
        let expected = {
            let r: f64 = 380.0 / 300.0;
            ((1.0 / r + 1.0) / 2.0 - r.ln() / (r - 1.0)) / (1.0 - 1.0 / r)
        };
        assert!((sag - expected).abs() < 2e-3, "{sag} {expected}");
    }

    #[test]
    fn global_slips_are_timed_and_their_middle_compared_with_the_coefficient() {
        let mut run = unloaded();
        assert_eq!(number("first_global_event_onset_s", &run, None), Some(2.0));
        (run.slips[3].ft_fn_min, run.slips[3].ft_fn_max) = (0.4, 0.5);
        (run.slips[4].ft_fn_min, run.slips[4].ft_fn_max) = (0.2, 0.7);
        assert!(number("global_event_middle_error_ratio", &run, None).unwrap() < 1e-12);
        assert!((number("largest_global_event_drop_ft_fn", &run, None).unwrap() - 0.5).abs() < 1e-12);
        assert!((number("largest_global_event_drop_middle_ft_fn", &run, None).unwrap() - 0.45).abs() < 1e-12);
        // An unfinished event has no extrema yet.
        run.slips[4].open = true;
        assert!((number("largest_global_event_drop_ft_fn", &run, None).unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn residuals_are_split_at_the_hold() {
        let mut run = unloaded();
        // (5.57) asks for mu_d L_p / L: 0.15, 0.3 and 0.45.
        for (slip, load) in [(0, 0.15), (1, 0.3), (3, 0.54)] {
            run.slips[slip].ft_fn_onset = load;
        }
        assert!(number("event_residual_before_hold_ratio", &run, None).unwrap() < 1e-12);
        assert!((number("event_residual_after_hold_ratio", &run, None).unwrap() - 0.2).abs() < 1e-12);
        run.slips[1].ft_fn_onset = 0.36;
        let before = number("event_residual_before_hold_ratio", &run, None).unwrap();
        assert!((before - 0.06 / 0.45 / 2f64.sqrt()).abs() < 1e-12, "{before}");
        assert_eq!(number("event_residual_after_hold_ratio", &made_up::run("", &[(1, 2, &[1])]), None), None);
    }

    #[test]
    fn events_are_timed_in_crossings() {
        let toml = "[[recording.window]]\nfrom_s = 0.1\nto_s = 0.9\nevery_s = 1e-3\n\
                    first_block = 1\nlast_block = 1";
        let run = made_up::run(toml, &[(500_000, 900_000, &[1]), (2_000_000, 2_500_000, &[1, 2])]);
        let crossing_s = 2.0 * run.plan.scales.block_time_s;
        let ours = number("event_over_crossing_ratio", &run, Some(2.0)).unwrap();
        assert!((ours * crossing_s - 0.05).abs() < 1e-12);
        // The one before the window is nearer in length, but outside.
        assert_eq!(number("event_over_crossing_ratio", &run, Some(1.0)), Some(ours));
    }

    #[test]
    fn precursors_are_counted_and_measured_before_the_first_global_slip() {
        let run = made_up::run("", &EVENTS);
        let of = |name: &str| number(name, &run, None);
        // Blocks 1, 1-2 and 1-3 with one of them at rest; then all three, twice.
        assert_eq!(of("precursor_event_count"), Some(3.0));
        assert_eq!(of("longest_precursor_event_ratio"), Some(1.0));
        assert_eq!(of("global_event_count"), Some(2.0));
        assert_eq!(of("first_global_event_onset_s"), Some(run.plan.grid.time_s(500)));
        assert_eq!(of("first_event_block_ratio"), Some(1.0 / 3.0));
        assert_eq!(of("first_slip_ft_fn"), Some(0.1));
        let slope = 0.1 / run.plan.grid.time_s(100);
        assert_eq!(of("slope_to_first_event_per_s"), Some(slope));
    }

    #[test]
    fn a_run_without_events_has_no_precursors_and_no_first_slip() {
        let run = made_up::run("", &[]);
        assert_eq!(number("precursor_event_count", &run, None), Some(0.0));
        assert_eq!(number("longest_precursor_event_ratio", &run, None), Some(0.0));
        assert_eq!(number("first_slip_ft_fn", &run, None), None);
        assert_eq!(number("first_global_event_onset_s", &run, None), None);
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
        let at = |load| number("event_length_at_load_ratio", &run, Some(load));
        assert_eq!([at(0.05), at(0.15), at(0.35)], [Some(0.0), Some(1.0 / 3.0), Some(2.0 / 3.0)]);
        // The run never came to such a load.
        assert_eq!(at(0.7), None);
    }

    #[test]
    fn names_are_of_one_number_each() {
        let mut names = BTreeSet::new();
        for number in Number::all() {
            assert_eq!(Number::find(number.name()).unwrap().name(), number.name());
            assert!(names.insert(number.name()), "{} is the name of two numbers", number.name());
            let unit = number.key.column.unit;
            assert!(unit.is_some() || number.key.column.kind != ColumnKind::Number, "{}", number.name());
        }
        assert!(names.len() > 200, "{}", names.len());
        assert_eq!(
            Number::find("coeficient_ratio").unwrap_err(),
            "there is no number \"coeficient_ratio\" (accepted: those of `asperity numbers`); did you mean \
             coefficient_ratio?"
        );
    }

    /// A number of the summary is one of the run as well, and a flag of it 1 for yes.
    #[test]
    fn numbers_of_the_summary_are_those_of_the_run() {
        let mut run = made_up::run("", &EVENTS);
        assert_eq!(number("event_count", &run, None), Some(7.0));
        run.summary.creeps = Some(true);
        assert_eq!(number("creeps", &run, None), Some(1.0));
        assert!(Number::find("status").is_err(), "a word is no number");
    }

    /// Without its data a number is absent, and nothing panics.
    #[test]
    fn what_was_not_kept_gives_no_number() {
        let run = RunData { kept: RequiredData::NOTHING, ..unloaded() };
        for wanting in Number::all().filter(|number| number.required_data() != RequiredData::NOTHING) {
            assert_eq!(wanting.of(&run, Some(2.0)), None, "{}", wanting.name());
        }
        assert_eq!(run.loads().unwrap_err().to_string(), "loads of run test are not kept");
    }
}
