//! `asperity recording estimate`.

use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs};
use asperity_model::{Scenario, ScenarioSource};
use asperity_record::{Estimates, Event, LoadDrop, Observer, Record, Rupture};
use asperity_recording::{Description, first_reach, numbers, scenario};
use asperity_run::OpenLog;
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{fits, refused};
use crate::reading::{self, Reading};
use crate::{terminal, verdict_exit};

#[derive(Debug, Args)]
pub(crate) struct EstimateArguments {
    /// The log of a recording.
    #[arg(value_name = "LAB.mcap")]
    log: PathBuf,
    /// The scenario to write.
    #[arg(short, long, value_name = "SCENARIO.toml")]
    out: PathBuf,
    /// Write all numbers that are identifiable as a table as well.
    #[arg(long, value_name = "FILE.csv")]
    table: Option<PathBuf>,
    /// Write the loads at which precursors first reached each sensor as well.
    #[arg(long, value_name = "FILE.csv")]
    reach: Option<PathBuf>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

/// What a log tells of a model.
#[derive(Default)]
struct Told {
    ruptures: Vec<Rupture>,
    drops: Vec<LoadDrop>,
    estimates: Option<Estimates>,
    normal_loads_n: Vec<f64>,
}

impl Observer for Told {
    fn record(&mut self, record: &Record) {
        match record {
            Record::Step(step) => self.normal_loads_n.push(step.normal_load_n),
            Record::Row(row) => self.estimates = row.values.get().cloned().or(self.estimates.take()),
            _ => {}
        }
    }

    fn event(&mut self, event: &Event) {
        self.ruptures.extend(event.get().cloned());
        self.drops.extend(event.get().cloned());
    }
}

pub(crate) fn command(arguments: &EstimateArguments) -> Result<(), Failure> {
    let EstimateArguments { log, out, table, reach, force } = arguments;
    fits("--out", out, "toml", "a scenario")?;
    let tables = [("--table", table), ("--reach", reach)];
    for (option, path) in tables.iter().filter_map(|(option, path)| Some((option, path.as_ref()?))) {
        fits(option, path, "csv", "a table")?;
    }
    let files = FileSet::new(if *force { Existing::Replace } else { Existing::Refuse }, Inputs::of([log]));
    let not_written = |error| refused("", &error, true);
    files.reserve([out].into_iter().chain(table).chain(reach)).map_err(not_written)?;
    let mut of = None;
    let begin = |opened: &OpenLog| {
        let header = opened.header();
        let sensors =
            header.sensors.clone().ok_or("it is that of a run (accepted: the log of a recording)")?;
        let description = Description::parse(Path::new("recording.toml"), opened.scenario_toml());
        of = Some((sensors, description.map_err(|error| error.to_string())?));
        Ok(Told::default())
    };
    let accept = |checked: &_| verdict_exit::must_be_sound(log, checked);
    let Reading { observer: told, .. } = reading::once(log, &[], begin, accept)?;
    let without = || Failure::Failed(format!("{}: it holds no estimates", log.display()));
    let ((sensors, description), estimates) =
        (of.expect("it was opened"), told.estimates.ok_or_else(without)?);
    let points = first_reach(&sensors, &told.ruptures);
    let numbers = numbers(&estimates, &told.drops, &points);
    if let Some(path) = table {
        let rows = numbers.iter().map(|(name, [value, error])| format!("{name},{value},{error}\n"));
        files
            .write(path, format!("number,value,error\n{}", rows.collect::<String>()))
            .map_err(not_written)?;
    }
    if let Some(path) = reach {
        let row = |point: &asperity_recording::FirstReach| {
            format!("{},{},{},{}\n", point.sensor, point.x_over_l, point.ft_fn[0], point.ft_fn[1])
        };
        let rows: String = points.iter().map(row).collect();
        files.write(path, format!("sensor,x_over_l,ft_fn,ft_fn_error\n{rows}")).map_err(not_written)?;
    }
    let text = scenario(&description, &numbers, &told.normal_loads_n, estimates.time_s);
    Scenario::resolve(&ScenarioSource::new(out.display().to_string(), text.as_str()))
        .map_err(Failure::failed)?;
    files.write(out, &text).map_err(not_written)?;
    files.publish().map_err(not_written)?;
    Ok(terminal::say(format_args!("{}: {} numbers of a model", out.display(), numbers.len()))?)
}
