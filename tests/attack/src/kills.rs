//! Kills commands at any moment. A run that is repeatedly killed and resumed ends with the messages of an
//! undisturbed one; any other command leaves nothing incomplete under a final name, and a repeated call
//! works afterwards.

use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use crate::calls::{Call, Outcome};
use crate::case::{Case, try_all};
use crate::file;
use crate::ground::{Error, Genuine, Ground, RUN, SMALL};
use crate::verdict::Verdict;
use crate::writers::{self, Writer, Written, compared, found};

const SIGNALS: [&str; 4] = ["KILL", "KILL", "TERM", "INT"];

/// A run is stopped at most so often before it is left to end.
const MOST_STOPS: usize = 12;

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let half = ground.size.kills / 2;
    let undisturbed = [
        ("default", ground.genuine("default", &[])?, &[][..]),
        ("small", ground.genuine("small", &SMALL)?, &SMALL),
    ];
    try_all(ground, "kills", "runs", half, |case| {
        let (_, log, run) = &undisturbed[case.number % undisturbed.len()];
        stopped_and_resumed(case, log, run)
    })?;
    let writers = Writer::all(ground)?;
    try_all(ground, "kills", "other commands", ground.size.kills.max(3 * writers.len()), |case| {
        let writer = &writers[case.number % writers.len()];
        stopped(case, writer)
    })
}

/// Runs it, and stops it after a time by chance, if it is still there.
fn stopped_call(case: &mut Case<'_>, call: Call<'_>, within: Duration) -> Result<Outcome, Error> {
    // Half of them early, where files are opened and locked.
    let share = if case.random.below(2) == 0 {
        case.random.uniform(0.0, 1.0)
    } else {
        case.random.log_uniform(1e-3, 1.0)
    };
    let after = within.mul_f64(share);
    let signal = case.random.pick(&SIGNALS);
    let mut running = call.start()?;
    let started = Instant::now();
    while started.elapsed() < after && !running.has_ended()? {
        thread::sleep(Duration::from_millis(1));
    }
    running.signal(signal)?;
    let outcome = running.wait()?;
    match outcome.signal {
        // By the signal that was sent, and not of itself.
        Some(9) | Some(15) | Some(2) => case.note(&outcome),
        _ => case.must_end_well(&outcome),
    }
    Ok(outcome)
}

fn stopped_and_resumed(case: &mut Case<'_>, undisturbed: &Genuine, run: &[&str]) -> Result<(), Error> {
    let arguments = [&RUN[..], &["--resume", "--checkpoint-s", "0.01"], run].concat();
    let folder = case.folder.clone();
    for _ in 0..MOST_STOPS {
        let call = Call::new(&case.ground.program, &folder, &arguments)?;
        let outcome = stopped_call(case, call, Duration::from_millis(400))?;
        if case.path("run.mcap").exists() {
            break;
        }
        case.hold(outcome.code != Some(0), "a run exits with 0 without its log", || outcome.said());
        if case.path("run.mcap.partial").exists() && case.random.below(3) == 0 {
            let judged = case.check("run.mcap.partial")?;
            // Nothing can be checked for one that was killed before its header was written.
            let fine = [Verdict::Incomplete, Verdict::NoRunLog].map(Some).contains(&judged.verdict);
            case.hold(
                fine,
                "check of the log of a killed run says neither \"incomplete\" nor \"not a run log\"",
                || judged.said(),
            );
        }
    }
    let last = case.call(&arguments)?;
    case.hold(last.code == Some(0), "a run that was stopped cannot be resumed", || last.said());
    let Ok(bytes) = fs::read(case.path("run.mcap")) else { return Ok(()) };
    let messages = match file::messages(&bytes) {
        Ok(messages) => messages,
        Err(problem) => {
            case.broke("a resumed run's log cannot be read", problem);
            return Ok(());
        }
    };
    let messages: Vec<_> = messages.iter().map(|(_, message)| message).collect();
    if let Some(difference) = file::difference(&undisturbed.without(&[]), &messages) {
        case.broke("a resumed run has other messages than an undisturbed one", difference);
    }
    case.must_be("a resumed run", "run.mcap", Verdict::Whole)?;
    let left = found(&folder)?.temporary;
    case.hold(left.is_empty(), "a resumed run leaves temporary files", || format!("{left:?}"));
    Ok(())
}

fn stopped(case: &mut Case<'_>, writer: &Writer) -> Result<(), Error> {
    let before = writer.set_up(case)?;
    let folder = case.folder.clone();
    let call = writers::call(case.ground, &folder, writer, 0)?;
    stopped_call(case, call, writer.takes.mul_f64(1.3))?;
    aftermath(case, writer, &before, "stopped")
}

/// What holds after a call of a writer that broke off: files under final names are whole, and of one set if
/// there is its record; a call as a user would make it then writes all of them.
pub(crate) fn aftermath(
    case: &mut Case<'_>,
    writer: &Writer,
    before: &Written,
    what: &str,
) -> Result<(), Error> {
    let folder = case.folder.clone();
    let name = writer.name;
    let now = found(&folder)?;
    let stray = now
        .written
        .iter()
        .find(|(path, digest)| [&writer.alone[0], before].iter().all(|set| set.get(*path) != Some(digest)));
    if let Some((path, _)) = stray {
        let told = format!("{path}\n{}", compared(writer, &now.written));
        case.broke(format!("{name}, {what}: under a final name stands what it does not write"), told);
        return Ok(());
    }
    let complete = now.written == writer.alone[0] || (writer.over_former && now.written == *before);
    if let Some(record) = writers::record(&now.written) {
        case.hold(complete, &format!("{name}, {what}: {record} stands beside files of another set"), || {
            compared(writer, &now.written)
        });
    }
    // The call is repeated, over a complete set only with force.
    let again = writers::call(case.ground, &folder, writer, 0)?.run()?;
    case.must_end_well(&again);
    // Existing files are only replaced on request, which not all of these commands accept.
    let can_force = name.starts_with("export") || name == "diff";
    let there = if can_force { complete } else { !now.written.is_empty() };
    let refused = again.code == Some(2) && there && !writer.over_former && !writer.continues;
    // A run that was begun is resumed.
    let to_resume = name == "run" && now.temporary.iter().any(|path| path == "run.mcap.partial");
    let mut arguments = writer.arguments(0).to_vec();
    arguments.push(if name == "run" { "--resume" } else { "--force" });
    let has_force = can_force || to_resume;
    let ended = if again.code != Some(0) && !refused && has_force {
        let forced = Call::new(&case.ground.program, &folder, &arguments)?.run()?;
        case.must_end_well(&forced);
        forced.code
    } else {
        again.code
    };
    case.hold(ended == Some(0) || refused, &format!("{name}, {what}: the next call does not work"), || {
        format!("{}\n{}", again.said(), compared(writer, &now.written))
    });
    if refused && !complete {
        return Ok(());
    }
    let after = found(&folder)?;
    case.hold(
        after.written == writer.alone[0],
        &format!("{name}, {what}: the next call leaves another set"),
        || format!("{}\n{}", again.said(), compared(writer, &after.written)),
    );
    // Killed after its files had their names, it leaves an empty folder; a call that is refused because
    // they are there leaves that to the next one that writes.
    let is_empty =
        |name: &str| std::fs::read_dir(folder.join(name)).is_ok_and(|mut files| files.next().is_none());
    let left = after.temporary.iter().filter(|name| !(refused && is_empty(name)));
    let left: Vec<&String> = left.collect();
    case.hold(left.is_empty(), &format!("{name}, {what}: temporary files are left by the next call"), || {
        format!("{left:?}")
    });
    Ok(())
}
