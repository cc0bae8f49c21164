//! `cargo xtask diff-events`: runs pipelines with two revisions of this project, and compares the events.
//!
//! Old means the other revision, new this checkout, including changes that are not committed. The diff
//! itself is always the present one.

use std::path::{Path, PathBuf};

use clap::Args;

use crate::pairs;
use crate::reproduce::{ALL, CHAPTER5, CHAPTER6, SETS, event_tables, pipeline};
use crate::revision::Revision;
use crate::say::say;
use crate::workspace::{Failure, absolute, asperity, emptied, io, program, root, run, write};

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask diff-events HEAD~1
  cargo xtask diff-events v0.1.0 --pipeline chapter6 --pipeline slab
  cargo xtask diff-events HEAD~5 --new HEAD~4
  cargo xtask diff-events main --policy rounding.toml

Both sides run the pipeline file of this checkout. A revision that refuses it
runs its own version of the file. Where this checkout cannot read the logs of a
revision, the event tables that both sides write are compared, paired by name.
The outputs stay in out/diff-events/PIPELINE/REVISION, with a page of both
timelines beside them. The commands of revisions stay in target/diff-events, so
that a second call is quick. This checkout and git's files are left unchanged.

Exit codes:
  0  nothing differs except what the policy allows
  1  something differs
  2  the two sides cannot be compared")]
pub(crate) struct DiffEventsArguments {
    /// The older revision: a commit, a tag, a branch, HEAD~3.
    #[arg(value_name = "REV")]
    old: String,
    /// The newer revision [default: this checkout as it stands].
    #[arg(long, value_name = "REV")]
    new: Option<String>,
    /// The pipelines whose runs are compared.
    #[arg(long, value_name = "NAME", default_values = [CHAPTER5, CHAPTER6], value_parser = ALL)]
    pipeline: Vec<String>,
    /// Which reading of the thesis to run [default: that of the pipeline].
    #[arg(long, value_name = "SET", value_parser = SETS)]
    parameter_set: Option<String>,
    /// What may differ, as for `asperity diff` [default: nothing].
    #[arg(long, value_name = "POLICY.toml")]
    policy: Option<PathBuf>,
}

pub(crate) fn command(arguments: &DiffEventsArguments) -> Result<(), Failure> {
    let differ = compare(arguments).map_err(Failure::of_comparison)?;
    if differ { Err(Failure::Exit { program: "asperity diff".to_owned(), code: 1 }) } else { Ok(()) }
}

/// Runs all pipelines with both, and returns whether something differs.
fn compare(arguments: &DiffEventsArguments) -> Result<bool, Failure> {
    let old = Revision::of(&arguments.old)?;
    let new = arguments.new.as_deref().map_or_else(Revision::checkout, Revision::of)?;
    say!("==> old: {}\n==> new: {}", old.title, new.title);
    let policy = arguments.policy.as_deref().map(absolute).transpose()?;
    let sides = [(&old, old.asperity()?), (&new, new.asperity()?)];
    let present = asperity()?.get_program().to_owned();
    let mut differ = false;
    for name in &arguments.pipeline {
        let set = arguments.parameter_set.as_ref().map(|set| format!("-{set}")).unwrap_or_default();
        let folder = root().join("out").join("diff-events").join(format!("{name}{set}"));
        let outs = [&old, &new].map(|side| folder.join(&side.name));
        for ((side, asperity), out) in sides.iter().zip(&outs) {
            reproduce(side, asperity, name, arguments.parameter_set.as_deref(), out)?;
            event_tables(asperity, out, &out.join(pairs::TABLES))?;
        }
        let page = folder.join(format!("{}..{}.html", old.name, new.name));
        let mut more = vec!["--force".as_ref(), "--page".as_ref(), page.as_os_str()];
        more.extend(policy.iter().flat_map(|policy| ["--policy".as_ref(), policy.as_os_str()]));
        let code = pairs::compare(Path::new(&present), [&outs[0], &outs[1]], &more)
            .map_err(io("compare the outputs in", &folder))?;
        match code {
            Some(0) => {}
            Some(1) => differ = true,
            _ => return Err(Failure::Check(format!("the two sides of {name} cannot be compared"))),
        }
        say!("==> {name}: old {}, new {}, page {}", outs[0].display(), outs[1].display(), page.display());
    }
    Ok(differ)
}

/// Runs the pipeline of this checkout, or the side's own if it refuses that one, into a folder without other runs.
fn reproduce(
    side: &Revision,
    asperity: &Path,
    name: &str,
    set: Option<&str>,
    out: &Path,
) -> Result<(), Failure> {
    let run_of = |pipeline: &Path| {
        emptied(out)?;
        let mut command = program(asperity);
        command.arg("reproduce").arg(pipeline).arg("--out").arg(out).stdout(std::process::Stdio::null());
        run(command.args(set.iter().flat_map(|set| ["--set".to_owned(), format!("parameter_set={set}")])))
    };
    let path = pipeline(name);
    say!("==> {}: {path} of this checkout", side.title);
    let refused = match run_of(Path::new(&path)) {
        Err(failure @ Failure::Exit { code: 2, .. }) => failure,
        done => return done,
    };
    let own = side.file(&path).ok_or(refused)?;
    say!("==> {}: its own {path}, for it refuses that one", side.title);
    let file = out.with_extension("toml");
    write(&file, &own)?;
    run_of(&file)
}
