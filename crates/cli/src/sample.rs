//! `asperity recording sample`.

use std::path::PathBuf;

use asperity_files::{Existing, FileSet, Inputs};
use asperity_record::{Event, Observer, Rupture, counted};
use asperity_recording::{Description, Role, Sampler};
use asperity_run::{OpenLog, record_again};
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{A_FOLDER, fits, refused};
use crate::reading::{self, Reading};
use crate::{interrupt, terminal, verdict_exit};

#[derive(Debug, Args)]
pub(crate) struct SampleArguments {
    /// The log of a run.
    #[arg(value_name = "RUN.mcap")]
    log: PathBuf,
    /// The description of a recording with the same instruments.
    #[arg(long, value_name = "RECORDING.toml")]
    like: PathBuf,
    /// The folder to write.
    #[arg(short, long, value_name = "FOLDER")]
    out: PathBuf,
    /// Of the noise; from 0.
    #[arg(long, default_value = "1")]
    seed: u32,
    /// Standard deviation of the noise of a role, in SI units; of real contact over that of a stuck contact.
    #[arg(long, value_name = "ROLE=SIZE", value_delimiter = ',', value_parser = noise)]
    noise: Vec<(Role, f64)>,
    /// Replace existing files.
    #[arg(long)]
    force: bool,
}

fn noise(text: &str) -> Result<(Role, f64), String> {
    let read = text.split_once('=').and_then(|(role, size)| Some((Role::named(role)?, size.parse().ok()?)));
    read.filter(|(_, size): &(Role, f64)| (0.0..f64::INFINITY).contains(size))
        .ok_or_else(|| "accepted: a role and a number from 0, as slip=3e-9".to_owned())
}

#[derive(Default)]
struct Ruptures(Vec<Rupture>);

impl Observer for Ruptures {
    fn event(&mut self, event: &Event) {
        self.0.extend(event.get().cloned());
    }
}

pub(crate) fn command(arguments: &SampleArguments) -> Result<(), Failure> {
    let SampleArguments { log, like, out, seed, noise, force } = arguments;
    fits("--out", out, "", A_FOLDER)?;
    let bad = |error: asperity_recording::RecordingError| Failure::BadInput(error.to_string());
    let mut like = Description::read(like).map_err(bad)?;
    interrupt::install()?;
    let mut scenario = None;
    let begin = |opened: &OpenLog| {
        scenario = Some(opened.needed_scenario()?.clone());
        Ok(Ruptures::default())
    };
    let accept = |checked: &_| verdict_exit::must_be_sound(log, checked);
    let Reading { observer: Ruptures(ruptures), .. } = reading::once(log, &[], begin, accept)?;
    let scenario = scenario.expect("it was opened");
    let files = FileSet::new(if *force { Existing::Replace } else { Existing::Refuse }, Inputs::of([log]));
    let not_written = |error| refused("--out", &error, true);
    files.folder(out).map_err(not_written)?;
    let mut sampler = Sampler::new(&mut like, (&scenario, &ruptures), (noise.clone(), *seed), (&files, out))
        .map_err(bad)?;
    record_again(log, sampler.recording_plan(), &mut sampler, &interrupt::has_come)
        .map_err(Failure::failed)?;
    let count = sampler.finish(&like).map_err(not_written)?;
    files.publish().map_err(not_written)?;
    Ok(terminal::say(format_args!("{}: {}", out.display(), counted(count as u64, "file") + " of samples"))?)
}
