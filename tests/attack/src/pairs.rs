//! Two and eight processes that write the same files at once, some of them killed. Afterwards each final
//! name has the output of one process, or the previous file; a set of files is of one process; and a
//! process that exits with 0 has written the files, or was replaced by another one that did.

use std::thread;
use std::time::{Duration, Instant};

use crate::calls::Outcome;
use crate::case::{Case, try_by};
use crate::ground::{Error, Ground};
use crate::writers::{self, Writer, Written, compared, found, has_its_inputs, prepare};

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let writers = Writer::all(ground)?;
    let cases = ground.size.pairs * writers.len();
    // One at a time: each has several processes of its own.
    try_by(ground, "pairs", "all commands", cases, 1, |case| at_once(case, writers))
}

/// One of the processes.
struct Process {
    variant: usize,
    starts_after: Duration,
    killed_after: Option<Duration>,
}

fn at_once(case: &mut Case<'_>, writers: &[Writer]) -> Result<(), Error> {
    let writer = &writers[case.number % writers.len()];
    let count = if (case.number / writers.len()).is_multiple_of(2) { 2 } else { 8 };
    let name = writer.name;
    let folder = case.folder.clone();
    prepare(case.ground, &folder)?;
    let mut before = Written::new();
    if writer.over_former {
        let former = writers::call(case.ground, &folder, writer, 0)?.run()?;
        case.must_end_well(&former);
        before = found(&folder)?.written;
    }
    let outcomes = race(case, writer, count)?;
    for (_, outcome) in &outcomes {
        match outcome.signal {
            Some(_) => case.note(outcome),
            None => case.must_end_well(outcome),
        }
    }
    let now = found(&folder)?;
    let told = || {
        let ends: Vec<String> = outcomes
            .iter()
            .map(|(process, outcome)| {
                let word = if process.variant == 0 { "first" } else { "second" };
                format!("{word}: {}: {}", outcome.ending(), outcome.err.trim())
            })
            .collect();
        format!("{}\n{}", ends.join("\n"), compared(writer, &now.written))
    };
    case.hold(has_its_inputs(case)?, &format!("{name}, {count} at once: an input is changed"), told);

    // File by file: the output of one process, or the previous file.
    let stray = now.written.iter().find(|(path, digest)| {
        let known = [&writer.alone[0], &writer.alone[1], &before];
        known.iter().all(|set| set.get(*path) != Some(digest))
    });
    if let Some((path, _)) = stray {
        let told = format!("{path}\n{}", told());
        case.broke(
            format!("{name}, {count} at once: under a final name stands what no process writes alone"),
            told,
        );
        return Ok(());
    }
    let any_killed = outcomes.iter().any(|(_, outcome)| outcome.signal.is_some());
    let done: Vec<usize> = outcomes
        .iter()
        .filter(|(_, outcome)| outcome.code == Some(0))
        .map(|(process, _)| process.variant)
        .collect();
    let is_of = |variant: usize| now.written == writer.alone[variant];
    // The files are a complete set of one process, or the previous ones.
    let of_one = done.iter().any(|variant| is_of(*variant));
    if !any_killed {
        case.hold(
            of_one || (done.is_empty() && now.written == before),
            &format!("{name}, {count} at once: what is there is not the set of one process that succeeded"),
            told,
        );
        let may_all_fail = writer.over_former;
        case.hold(!done.is_empty() || may_all_fail, &format!("{name}, {count} at once: all fail"), told);
        let left = now.temporary.iter().filter(|path| !path.ends_with(".lock")).count();
        case.hold(left == 0, &format!("{name}, {count} at once: temporary files are left"), || {
            format!("{:?}\n{}", now.temporary, told())
        });
    } else if let Some(record) = writers::record(&now.written) {
        // The record marks the set as complete.
        let complete = is_of(0) || is_of(1) || now.written == before;
        case.hold(
            complete,
            &format!("{name}, {count} at once, some killed: {record} stands beside files of another set"),
            told,
        );
    } else if !done.is_empty() && !writer.over_former {
        // Without force no process replaces the output of another.
        case.hold(
            of_one,
            &format!("{name}, {count} at once, some killed: who succeeded has no complete set there"),
            told,
        );
    }
    Ok(())
}

/// Starts them all and waits for them.
fn race(case: &mut Case<'_>, writer: &Writer, count: usize) -> Result<Vec<(Process, Outcome)>, Error> {
    let takes_ms = writer.takes.as_millis().clamp(20, 5000) as u64;
    let with_kills = case.random.below(2) == 0;
    let staggered = case.random.below(2) == 0;
    let random = &mut case.random;
    let mut by_chance = |most_ms: u64| Duration::from_millis(random.below(most_ms.max(1)));
    let plan: Vec<Process> = (0..count)
        .map(|number| Process {
            variant: number % 2,
            starts_after: if staggered { by_chance(takes_ms) } else { Duration::ZERO },
            killed_after: (with_kills && number % 3 != 2).then(|| by_chance(2 * takes_ms * count as u64 / 2)),
        })
        .collect();
    let ground = case.ground;
    let folder = &case.folder;
    let outcomes: Vec<Result<(Process, Outcome), Error>> = thread::scope(|scope| {
        let threads: Vec<_> = plan
            .into_iter()
            .map(|process| {
                scope.spawn(move || {
                    thread::sleep(process.starts_after);
                    let mut running = writers::call(ground, folder, writer, process.variant)?.start()?;
                    if let Some(after) = process.killed_after {
                        let started = Instant::now();
                        while started.elapsed() < after && !running.has_ended()? {
                            thread::sleep(Duration::from_millis(1));
                        }
                        running.signal("KILL")?;
                    }
                    let outcome = running.wait()?;
                    Ok((process, outcome))
                })
            })
            .collect();
        threads.into_iter().map(|thread| thread.join().expect("no thread panics")).collect()
    });
    outcomes.into_iter().collect()
}
