//! `asperity recording estimate` and `asperity recording sample`: from a recording to a scenario, and from a run to a
//! recording.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use asperity_files::{Existing, FileSet, Inputs};
use asperity_model::{Scenario, ScenarioSource};
use asperity_record::{Estimate, Event, Observer, Record, Rupture, counted};
use asperity_recording::{Description, RecordingError, Role, Sampler, scenario};
use asperity_run::{OpenLog, record_again};
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{A_FOLDER, fits, refused};
use crate::reading::{self, Reading};
use crate::{interrupt, terminal, verdict_exit};

#[derive(Debug, Args)]
pub(crate) struct EstimateArguments {
    /// The log of a recording.
    #[arg(value_name = "LAB.mcap")]
    log: PathBuf,
    /// The scenario to write.
    #[arg(short, long, value_name = "SCENARIO.toml")]
    out: PathBuf,
    /// Replace an existing scenario.
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SampleArguments {
    /// The log of a run.
    #[arg(value_name = "RUN")]
    log: PathBuf,
    /// The description (TOML) of a recording by the same instruments.
    #[arg(long, value_name = "FILE")]
    like: PathBuf,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    out: PathBuf,
    /// Seed of the noise.
    #[arg(long, default_value = "1")]
    seed: u32,
    /// Standard deviation of the noise of a role, in SI units; of contact-area over that of a stuck contact.
    #[arg(long, value_name = "ROLE=SIZE", value_delimiter = ',', value_parser = noise)]
    noise: Vec<(Role, f64)>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

fn noise(text: &str) -> Result<(Role, f64), String> {
    let read = text.split_once('=').and_then(|(role, size)| Some((Role::named(role)?, size.parse().ok()?)));
    let read = read.filter(|(_, size): &(Role, f64)| (0.0..f64::INFINITY).contains(size));
    read.ok_or_else(|| "accepted: a role and a number from 0, as slip=3e-9".to_owned())
}

/// What is needed of a log.
#[derive(Default)]
struct Told {
    ruptures: Vec<Rupture>,
    numbers: BTreeMap<String, [f64; 2]>,
    normal_loads_n: Vec<f64>,
    last_s: f64,
}

impl Observer for Told {
    fn record(&mut self, record: &Record) {
        self.last_s = record.time_s();
        match record {
            Record::Step(step) => self.normal_loads_n.push(step.normal_load_n),
            Record::Row(row) => {
                let told = row.values.get::<Estimate>();
                self.numbers.extend(told.map(|told| (told.number.clone(), [told.value, told.error])));
            }
            _ => {}
        }
    }

    fn event(&mut self, event: &Event) {
        self.ruptures.extend(event.get().cloned());
    }
}

/// Reads a log, and something of its beginning.
fn read<T>(log: &Path, begin: impl FnOnce(&OpenLog) -> Result<T, String>) -> Result<(T, Told), Failure> {
    let mut of = None;
    let begin = |opened: &OpenLog| {
        of = Some(begin(opened)?);
        Ok(Told::default())
    };
    let accept = |checked: &_| verdict_exit::must_be_sound(log, checked);
    let Reading { observer, .. } = reading::once(log, &[], begin, accept)?;
    Ok((of.expect("it was opened"), observer))
}

fn existing(force: bool) -> Existing {
    if force { Existing::Replace } else { Existing::Refuse }
}

pub(crate) fn estimate(EstimateArguments { log, out, force }: &EstimateArguments) -> Result<(), Failure> {
    fits("--out", out, "toml", "a scenario")?;
    let (description, told) = read(log, |opened| {
        let parse = |_: &_| Description::parse(Path::new("recording.toml"), opened.scenario_toml());
        opened.header().sensors.as_ref().map(parse).transpose().map_err(|error| error.to_string())
    })?;
    let of_run = || format!("{}: it is of a run (accepted: the log of a recording)", log.display());
    let description = description.ok_or_else(|| Failure::BadInput(of_run()))?;
    let count = counted(told.numbers.len() as u64, "number");
    let text = scenario(&description, told.numbers, told.normal_loads_n, told.last_s);
    Scenario::resolve(&ScenarioSource::new(out.display().to_string(), text.as_str()))
        .map_err(Failure::failed)?;
    FileSet::write_one(out, text, existing(*force), Inputs::of([log]))
        .map_err(|error| refused("--out", &error, true))?;
    Ok(terminal::say(format_args!("{}: {count} of a model", out.display()))?)
}

pub(crate) fn sample(arguments: &SampleArguments) -> Result<(), Failure> {
    let SampleArguments { log, like, out, seed, noise, force } = arguments;
    fits("--out", out, "", A_FOLDER)?;
    let bad = |error: RecordingError| Failure::BadInput(error.to_string());
    let like = Description::read(like).map_err(bad)?;
    interrupt::install()?;
    let (scenario, told) = read(log, |opened| opened.needed_scenario().cloned())?;
    let mut sampler = Sampler::new(&like, &scenario, &told.ruptures, noise, *seed).map_err(bad)?;
    record_again(log, sampler.recording_plan(), &mut sampler, &interrupt::has_come)
        .map_err(Failure::failed)?;
    let files = FileSet::new(existing(*force), Inputs::of([log]));
    let write = || {
        files.folder(out)?;
        sampler.write(&files, out)
    };
    let count = write().map_err(|error| refused("--out", &error, true))?;
    files.publish().map_err(|error| refused("--out", &error, true))?;
    Ok(terminal::say(format_args!("{}: {} of samples", out.display(), counted(count as u64, "file")))?)
}
