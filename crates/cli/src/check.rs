//! `asperity check`.

use asperity_run::{Checked, check, check_again};

use crate::args::CheckArguments;
use crate::exit::{self, Code, Failure};
use crate::note;
use crate::terminal;
use crate::verdict_exit;

pub(crate) fn command(arguments: &CheckArguments) -> Result<(), Failure> {
    let mut codes = Vec::new();
    for run in &arguments.runs {
        let checked: Checked = if arguments.again { check_again(run) } else { check(run) };
        let what = verdict_exit::words(run, &checked);
        terminal::say(format_args!("{}: {}", run.display(), exit::shortened(&what)))?;
        note::show(run)?;
        codes.push(Code::from(checked.verdict));
    }
    Code::worst(codes).said()
}
