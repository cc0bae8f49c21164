//! `asperity check`.

use asperity_run::Verdict;

use crate::args::CheckArguments;
use crate::exit::{self, Code, Failure};
use crate::terminal;

pub(crate) fn command(arguments: &CheckArguments) -> Result<(), Failure> {
    let mut worst = Verdict::Whole;
    for run in &arguments.runs {
        let checked = asperity_run::check(run);
        let what = checked.to_string();
        let (verdict, what) = (checked.verdict, exit::shortened(&what));
        match verdict {
            // The sentence says it already.
            Verdict::NoRunLog => terminal::say(format_args!("{}: {what}", run.display()))?,
            _ => terminal::say(format_args!("{}: {}: {what}", run.display(), verdict.word()))?,
        }
        worst = worst.max(verdict);
    }
    match worst {
        Verdict::Whole => Ok(()),
        Verdict::Incomplete => Err(Failure::Said(Code::Failed)),
        Verdict::Damaged | Verdict::NoRunLog => Err(Failure::Said(Code::BadInput)),
    }
}
