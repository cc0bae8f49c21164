//! `cargo xtask ci`: the checks that a change must pass, stage by stage.

use std::time::{Duration, Instant};

use clap::Args;

use crate::advisories::{self, AdvisoriesArguments};
use crate::attack::{self, AttackArguments};
use crate::notices;
use crate::python::{self, PythonArguments};
use crate::say::say;
use crate::test::{self, TestArguments};
use crate::workspace::{Failure, cargo, output, run};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask ci
  ASPERITY_NO_SKIPS=1 cargo xtask ci

The stages run in order, the quick ones first; the first failure ends the
command. The time of each stage is listed at the end. With ASPERITY_NO_SKIPS=1,
a skipped test is a failure. A stage without its data is listed as not checked.")]
pub(crate) struct CiArguments {}

type Stage = (&'static str, fn() -> Result<(), Failure>);

const STAGES: [Stage; 10] = [
    ("format", format),
    ("licences", notices::check),
    ("advisories", || advisories::command(&AdvisoriesArguments {})),
    ("lint", lint),
    ("without analysis", without_analysis),
    ("test", test),
    ("python", python),
    ("long tests", long_tests),
    ("doc", doc),
    ("attack", attack),
];

pub(crate) fn command(_arguments: &CiArguments) -> Result<(), Failure> {
    let begun = Instant::now();
    let mut times = Vec::new();
    let mut outcome = Ok(());
    for (name, stage) in STAGES {
        say!("==> {name}");
        let started = Instant::now();
        let found = stage();
        let (word, result) = judged(found, &took(started.elapsed()));
        say!("==> {name}: {word}");
        times.push(format!("{name} {word}"));
        outcome = result;
        if outcome.is_err() {
            break;
        }
    }
    say!("==> {}; in all {}", times.join(", "), took(begun.elapsed()));
    outcome
}

/// What is said of a stage, and whether it failed. One that lacks its data has neither passed nor failed.
fn judged(found: Result<(), Failure>, time: &str) -> (String, Result<(), Failure>) {
    match found {
        Ok(()) => (format!("passed in {time}"), Ok(())),
        Err(unchecked @ Failure::NotChecked(_)) => (unchecked.to_string(), Ok(())),
        Err(failure) => (format!("failed after {time}"), Err(failure)),
    }
}

fn took(time: Duration) -> String {
    let seconds = time.as_secs();
    match seconds / 60 {
        0 => format!("{:.1} s", time.as_secs_f64()),
        minutes => format!("{minutes} min {} s", seconds % 60),
    }
}

fn format() -> Result<(), Failure> {
    run(&mut cargo(&["fmt", "--all", "--check"]))
}

/// Warnings are denied here and not by RUSTFLAGS, which would rebuild every
/// dependency.
fn lint() -> Result<(), Failure> {
    run(&mut cargo(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--features",
        "xtask/attack",
        "--locked",
        "--",
        "-D",
        "warnings",
    ]))
}

/// Simulating, detecting and replaying build without the heavy dependencies of
/// tables and figures, and the Python module without that of tables.
fn without_analysis() -> Result<(), Failure> {
    const PACKAGE: [&str; 4] = ["--package", "asperity-cli", "--no-default-features", "--locked"];
    lacks(&PACKAGE, &["polars", "plotters"])?;
    lacks(&["--package", "asperity-python", "--locked"], &["polars"])?;
    run(cargo(&["check"]).args(PACKAGE))
}

/// Checks that a package does not depend on any of these.
fn lacks(package: &[&str], heavy: &[&str]) -> Result<(), Failure> {
    let tree = output(cargo(&["tree", "--edges", "normal", "--prefix", "none"]).args(package))?;
    match tree.lines().find(|line| heavy.iter().any(|name| line.starts_with(name))) {
        None => Ok(()),
        Some(found) => Err(Failure::Check(format!(
            "{} depends on {found} (accepted: nothing of {})",
            package.join(" "),
            heavy.join(", ")
        ))),
    }
}

fn test() -> Result<(), Failure> {
    test::command(&TestArguments::default())
}

fn python() -> Result<(), Failure> {
    python::command(&PythonArguments::default())
}

/// Long tests that rarely fail; `cargo xtask test` leaves them out and has a shorter test of nearly each property.
/// Program and test, the longest first, so that no core runs one alone at the end.
const LONG_TESTS: &[&str] = &[
    "root reference::the_plain_solver_gives_the_table_as_coded",
    "root reference::the_plain_solver_gives_the_table_as_stated",
    "root reference::the_plain_solver_gives_the_other_tables",
    "root junctions::the_default_slab_gives_the_rows_of_an_independent_program",
    "area_tables the_plain_solver_gives_the_tables",
    "area_tables the_fast_solver_gives_the_table_of_a_fine_body",
    "asperity_simulator junctions::tests::contacts_do_so_for_long",
    "root new_detector::the_guide_gives_a_detector_and_a_law_that_runs_and_logs_have",
    "root resume::killed_two_hundred_times_a_run_ends_as_if_never_killed",
    "root first_day::every_command_on_every_log",
    "root foreign::all_are_left_alone_by_all_commands",
    "root verify::chapter_5_begins_alike_as_coded",
    "root verify::chapter_5_begins_alike_as_stated",
    "root words::own_program_builds",
    "root rules::a_program_written_from_the_rules_gets_the_same_events_in_all_cases",
    "asperity_figures draw::first_day::every_figure_of_every_run_is_drawn_or_says_what_lacks",
    "laws a_ramp_of_200_million_steps_does_not_drift",
    "root salvage::every_broken_chunk_costs_its_messages_and_nothing_else",
    "root scenarios::every_scenario_runs_checks_and_replays",
    "root salvage::what_is_not_hit_anywhere_is_kept",
    "laws the_fast_solver_does_so_in_both_parameter_sets",
    "fast the_thesis_slider_gives_the_same_switches_for_longer",
    "fast more_random_long_chains_give_the_same_switches",
    "fast long_chains_that_are_pushed_jump_by_waves",
    "fast more_drives_with_a_course_give_the_same_switches",
    "fast more_random_scenarios_give_the_same_switches",
    "slab_fast more_random_slabs_give_the_same_switches",
    "radiation more_random_chains_that_radiate_switch_alike",
    "ends more_random_chains_with_any_ends_switch_alike",
    "front_speed all_steady_fronts_of_the_table_run_as_the_theory_says",
    "root flips::two_thousand_flipped_bits_are_seen",
    "root hostile::committed_forgeries_are_refused_by_all_commands",
    "root bounds::every_forged_checkpoint_is_refused_or_seen_by_making_the_run_again",
    "root bounds::none_of_five_hundred_mutants_of_a_parquet_table_makes_its_reader_panic",
    "root rupture_energies::by_single_steps_ruptures_add_up_to_the_run",
    "root staging::wherever_a_run_breaks_off_it_goes_on_and_gives_what_an_unbroken_one_gives",
    "root not_files::with_any_little_memory_commands_fail_without_a_panic",
    "root salvage::whichever_of_two_hundred_chunks_is_lost_the_rest_is_salvaged_with_gaps",
    "root ruptures::the_program_of_the_definition_sees_what_differs",
    "root end_to_end::a_killed_pipeline_goes_on_with_its_run",
    "area_fast more_random_sheets_and_bodies_give_the_same_switches",
];

fn long_tests() -> Result<(), Failure> {
    test::long(LONG_TESTS)
}

fn doc() -> Result<(), Failure> {
    run(cargo(&["doc", "--workspace", "--no-deps", "--locked"]).env("RUSTDOCFLAGS", "-D warnings"))
}

fn attack() -> Result<(), Failure> {
    attack::command(&AttackArguments::of_ci())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Such a stage was said to have passed.
    #[test]
    fn what_could_not_check_has_not_passed() {
        let of = |found| {
            let (word, result) = judged(found, "1.0 s");
            (word, result.is_ok())
        };
        assert_eq!(of(Ok(())), ("passed in 1.0 s".to_owned(), true));
        let not_checked = Failure::NotChecked("no database".to_owned());
        assert_eq!(of(Err(not_checked)), ("not checked: no database".to_owned(), true));
        assert_eq!(of(Err(Failure::Interrupted(130))), ("failed after 1.0 s".to_owned(), false));
    }
}
