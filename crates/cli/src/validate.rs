//! `asperity scenario validate`.

use std::io;
use std::time::Duration;

use asperity_model::{ADVISED_SHARE, Scenario};
use asperity_record::counted;
use asperity_run::{Forecast, LogEstimate};
use clap::{Args, ValueEnum};

use crate::exit::Failure;
use crate::progress::Board;
use crate::scenario::ScenarioChoice;
use crate::summary::print_json;
use crate::{preview, terminal};

#[derive(Debug, Args)]
pub(crate) struct ValidateArguments {
    #[command(flatten)]
    pub(crate) choice: ScenarioChoice,
    /// How to print it.
    #[arg(long, value_enum, default_value = "text")]
    pub(crate) format: ForecastFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(crate) enum ForecastFormat {
    /// For people.
    Text,
    /// An object, with the estimate of the plain solver's time unless --quiet is given.
    Json,
}

/// Time spent on timing the plain solver.
const TRIAL: Duration = Duration::from_millis(250);

/// Prints the forecast of a scenario. Without timing if the board is quiet, so that the output is
/// the same on every machine.
pub(crate) fn command(scenario: &Scenario, format: ForecastFormat, board: &Board) -> Result<(), Failure> {
    let forecast = Forecast::of(scenario);
    // The plain solver does not run what never sticks.
    let is_timed = !board.is_quiet() && scenario.friction.law.sticks();
    let forecast = if is_timed { forecast.with_plain_solver(scenario, TRIAL) } else { forecast };
    match format {
        ForecastFormat::Json => print_json(&forecast)?,
        ForecastFormat::Text => {
            say(scenario, &forecast)?;
            if let Some(time_s) = forecast.plain_solver_s {
                let default = match scenario.junction_count() {
                    0 => "takes far less wherever few blocks switch",
                    _ => "takes as long, since contacts of junctions have no leaps",
                };
                board.line(&format!(
                    "{}: --solver plain, which computes every step, would take about {} here, as its first {} s \
                     show; the default solver {default}",
                    forecast.scenario,
                    duration(time_s),
                    TRIAL.as_secs_f64()
                ));
            }
        }
    }
    Ok(())
}

fn say(scenario: &Scenario, forecast: &Forecast) -> io::Result<()> {
    let Forecast {
        scenario: name, time_step_s, longest_stable_step_s, step_ratio, steps, log, warnings, ..
    } = forecast;
    let valid = match warnings.len() {
        0 => "valid".to_owned(),
        1 => "valid, with a warning".to_owned(),
        more => format!("valid, with {more} warnings"),
    };
    terminal::say(format_args!("{name}: {valid}"))?;
    for (what, words) in preview::lines(scenario, &forecast.preview) {
        terminal::say(format_args!("  {what:12} {words}"))?;
    }
    match step_ratio {
        Some(step_ratio) => terminal::say(format_args!(
            "  time step    {time_step_s:e} s, {step_ratio:.2e} of the longest stable one, {longest_stable_step_s:.3e} s \
             (warning above {ADVISED_SHARE})"
        ))?,
        None => terminal::say(format_args!(
            "  time step    {time_step_s:e} s, to which times are rounded; the solver chooses its steps by \
             time.tolerance = {:e}",
            scenario.time.tolerance
        ))?,
    }
    terminal::say(format_args!("  steps        {steps}"))?;
    let LogEstimate { samples, states, window_records, scheduled_bytes } = log;
    let windows = match *window_records {
        0 => String::new(),
        count => format!(", {} of windows", counted(count, "record")),
    };
    terminal::say(format_args!(
        "  log          about {} for scheduled records, {}, {}{windows}; more for each slip event",
        bytes(*scheduled_bytes),
        counted(*samples, "sample"),
        counted(*states, "state")
    ))?;
    warnings.iter().try_for_each(|warning| terminal::say(format_args!("  warning: {warning}")))
}

/// One decimal, in a suitable unit: no log is shorter than a kilobyte.
fn bytes(count: u64) -> String {
    let (unit, name) = match count {
        0..1_000_000 => (1e3, "kB"),
        1_000_000..1_000_000_000 => (1e6, "MB"),
        _ => (1e9, "GB"),
    };
    format!("{:.1} {name}", count as f64 / unit)
}

/// Two digits, in a suitable unit.
pub(crate) fn duration(time_s: f64) -> String {
    let (unit_s, name) = match time_s {
        ..1e-3 => (1e-6, "us"),
        ..1.0 => (1e-3, "ms"),
        ..120.0 => (1.0, "s"),
        ..7200.0 => (60.0, "minutes"),
        ..172_800.0 => (3600.0, "hours"),
        _ => (86_400.0, "days"),
    };
    let value = time_s / unit_s;
    if value < 10.0 { format!("{value:.1} {name}") } else { format!("{value:.0} {name}") }
}

#[cfg(test)]
mod tests {
    use super::{bytes, duration};

    #[test]
    fn sizes_have_the_unit_that_fits() {
        for (count, expected) in [(25_010, "25.0 kB"), (25_000_001, "25.0 MB"), (3_000_000_000, "3.0 GB")] {
            assert_eq!(bytes(count), expected);
        }
    }

    #[test]
    fn times_have_the_unit_that_fits() {
        for (time_s, expected) in [
            (2.5e-5, "25 us"),
            (0.04, "40 ms"),
            (7.23, "7.2 s"),
            (118.0, "118 s"),
            (600.0, "10 minutes"),
            (1e6, "12 days"),
        ] {
            assert_eq!(duration(time_s), expected);
        }
    }
}
