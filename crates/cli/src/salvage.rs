//! `asperity salvage`.

use std::path::{Path, PathBuf};

use asperity_record::counted;
use asperity_run::SalvageProblem;
use asperity_runlog::{SalvageError, Salvaged, WriteError};
use clap::Args;

use crate::exit::Failure;
use crate::outputs::{fits, refused};
use crate::terminal::say;
use crate::verdict_exit;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  asperity salvage damaged.mcap -o out/salvaged.mcap
  asperity check out/salvaged.mcap

Keeps every record, before and after the damage, that an independent checksum
or schema confirms: chunks and attachments by their checksums, the header by
the scenario, each message by its schema, each step by its complete switches.
Prints the losses: bytes, messages of each topic, steps. The new log is marked
as salvaged with gaps, so no command mistakes it for a whole one. To finish an
unfinished run, use asperity run --resume. If the scenario of a damaged log is
known, it is better to repeat the run.")]
pub(crate) struct SalvageArguments {
    /// The damaged log.
    #[arg(value_name = "DAMAGED.mcap")]
    pub(crate) run: PathBuf,
    /// The log to write; must not exist.
    #[arg(short, long, value_name = "RUN.mcap")]
    pub(crate) out: PathBuf,
}

pub(crate) fn command(arguments: &SalvageArguments) -> Result<(), Failure> {
    let (input, out) = (&arguments.run, &arguments.out);
    fits("--out", out, "mcap", "a run log")?;
    match asperity_run::salvage(input, out) {
        Ok(salvaged) => tell(input, out, &salvaged),
        Err(problem @ SalvageProblem::Whole(_)) => Ok(say(format_args!("{}: {problem}", input.display()))?),
        Err(SalvageProblem::Hopeless { checked, why }) => {
            let words = verdict_exit::words(input, &checked);
            Err(Failure::Log(checked.verdict, format!("{}: {words}; {why}", input.display())))
        }
        Err(SalvageProblem::Failed(SalvageError::Write(WriteError::File(error)))) => {
            Err(refused("--out", &error, false))
        }
        Err(problem @ SalvageProblem::Failed(_)) => {
            Err(Failure::failed(format!("{}: {problem}", input.display())))
        }
    }
}

fn tell(input: &Path, out: &Path, salvaged: &Salvaged) -> Result<(), Failure> {
    let sum = |counts: &std::collections::BTreeMap<String, u64>| counts.values().sum::<u64>();
    let kept = counted(sum(&salvaged.kept), "message");
    say(format_args!("{}: {kept} salvaged to {}", input.display(), out.display()))?;
    for damage in &salvaged.damage {
        say(format_args!("  bytes {} to {}: {}", damage.from_byte, damage.to_byte, damage.what))?;
    }
    for (topic, count) in &salvaged.lost {
        let kept = salvaged.kept.get(topic).copied().unwrap_or(0);
        say(format_args!("  {topic}: {kept} kept, {count} lost"))?;
    }
    for gap in &salvaged.gaps {
        let after = gap.after_step.map_or("the beginning".to_owned(), |step| format!("step {step}"));
        let before = gap.before_step.map_or("the end".to_owned(), |step| format!("step {step}"));
        say(format_args!("  nothing between {after} and {before}"))?;
    }
    if !salvaged.end_is_known {
        say(format_args!("  its end is lost, and with it the number of messages"))?;
    }
    for remark in &salvaged.remarks {
        say(format_args!("  {remark}"))?;
    }
    Ok(())
}
