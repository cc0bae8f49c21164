//! Memory is refused, one allocation after the other, from where a command opens the first of its inputs: logs,
//! plans and segments of studies, TOML and CSV. The command then ends with 1 and a message, or copes and
//! gives the same; it does not abort, and leaves nothing incomplete under a final name.

use std::fs;
use std::path::Path;

use crate::calls::{Call, Outcome};
use crate::case::{Case, try_all};
use crate::commands::{ON_LOGS, arguments, words};
use crate::ground::{Error, Ground, emptied};
use crate::tally::say;
use crate::writers::{Written, found, prepare};

/// Commands on other inputs than logs, by the kind of input.
const ON_OTHERS: [(&str, &str); 7] = [
    ("logs", "salvage in/damaged-a.mcap --out salvaged.mcap"),
    ("plans and segments", "sweep status in/study"),
    ("plans and segments", "sweep collect in/study --quiet"),
    ("TOML", "scenario show in/scenario.toml"),
    ("TOML", "sweep plan in/s.toml --quiet --out out"),
    ("CSV", "diff in/events.csv in/events.csv"),
    ("CSV", "scenario show in/csv.toml"),
];

/// Each kind of input with commands that read it: of those on the records of a log, the first form of each.
fn readers() -> Vec<(&'static str, Vec<String>)> {
    let of_records = ON_LOGS.iter().filter(|command| !command.scenario_alone);
    let mut on_logs: Vec<&str> = of_records.map(|command| command.words).collect();
    on_logs.dedup_by_key(|command| command.split(' ').next());
    // Of a sound log there is nothing to salvage.
    on_logs.retain(|command| !command.starts_with("salvage"));
    let on_logs = on_logs.into_iter().map(|command| ("logs", command));
    on_logs
        .chain(ON_OTHERS)
        .map(|(kind, command)| (kind, words(command, &["in/a/run.mcap"], "new")))
        .collect()
}

/// A refusal.
struct Point {
    reader: usize,
    /// Number of the allocation.
    at: u64,
    /// Whether all later ones are refused as well.
    lasts: bool,
}

/// What a call gives if nothing is refused.
struct Alone {
    outcome: Outcome,
    written: Written,
    allocations: u64,
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let library = ground.library();
    if !library.exists() {
        let reason = format!("there is no {}", library.display());
        ground.tally.lock().expect("no case panics with it").skip("memory", reason);
        return Ok(());
    }
    crate::writers::Writer::all(ground)?;
    let inputs = ground.logs.join("memory");
    make_inputs(ground, &inputs)?;
    let (mut alone, mut points) = (Vec::new(), Vec::new());
    let mut random = crate::random::Random::new(ground.seed);
    let readers = readers();
    for (kind, command) in &readers {
        let arguments = arguments(command);
        let call = undisturbed(ground, &inputs, &arguments)?;
        let allocations = call.allocations;
        if allocations == 0 {
            return Err(format!("{}: no allocation was counted", arguments.join(" ")).into());
        }
        say(&format!("  memory: {kind}: {}: {allocations} allocations", arguments.join(" ")));
        alone.push(call);
    }
    // All readers in turn, since the time may end before all is tried.
    for place in 0..ground.size.refusals {
        for (reader, allocations) in alone.iter().map(|call| call.allocations).enumerate() {
            // The first ones all, then more rarely.
            let at = match place as u64 + 1 {
                first if 3 * first < ground.size.refusals as u64 => first,
                _ => random.log_uniform(1.0, allocations as f64 + 1.0) as u64,
            };
            points.push(Point { reader, at: at.min(allocations), lasts: place % 2 == 1 });
        }
    }
    try_all(ground, "memory", "refusals", points.len(), |case| {
        let point = &points[case.number];
        refused(case, &inputs, point, &readers[point.reader], &alone[point.reader])
    })
}

fn make_inputs(ground: &Ground, folder: &Path) -> Result<(), Error> {
    prepare(ground, folder)?;
    let events = ground.succeed(folder, &["events", "in/a/run.mcap"])?;
    fs::write(folder.join("in/events.csv"), events.out)?;
    let show = ground.succeed(folder, &["scenario", "show", "default"])?;
    fs::write(folder.join("in/scenario.toml"), show.out)?;
    fs::write(folder.join("in/csv.toml"), "slider.blocks = 2\ndisorder.contacts_csv = 'contacts.csv'\n")?;
    Ok(fs::write(folder.join("in/contacts.csv"), "static_offset,load_offset\n0.1,0\n0,1\n")?)
}

/// Calls a command with the library, which refuses what the variables say.
fn call(
    ground: &Ground,
    folder: &Path,
    arguments: &[&str],
    set: &[(&str, String)],
) -> Result<Outcome, Error> {
    let mut call = Call::by_shell(&ground.program, folder, "true", arguments, "")?;
    call.command.env("LD_PRELOAD", ground.library());
    call.command.envs(set.iter().map(|(name, value)| (name, value)));
    Ok(call.run()?)
}

fn undisturbed(ground: &Ground, inputs: &Path, arguments: &[&str]) -> Result<Alone, Error> {
    let folder = ground.work.join("memory-alone");
    emptied(&folder)?;
    crate::writers::copy(&inputs.join("in"), &folder.join("in"))?;
    let count = folder.join("in/count");
    let outcome = call(ground, &folder, arguments, &[("REFUSE_COUNT", count.display().to_string())])?;
    let allocations = fs::read_to_string(count)?.parse()?;
    Ok(Alone { outcome, written: found(&folder)?.written, allocations })
}

fn refused(
    case: &mut Case<'_>,
    inputs: &Path,
    point: &Point,
    (kind, command): &(&str, Vec<String>),
    alone: &Alone,
) -> Result<(), Error> {
    let arguments = &arguments(command);
    let folder = case.folder.clone();
    crate::writers::copy(&inputs.join("in"), &folder.join("in"))?;
    let mut set = vec![("REFUSE_AT", point.at.to_string())];
    if point.lasts {
        set.push(("REFUSE_ON", "1".to_owned()));
    }
    let outcome = call(case.ground, &folder, arguments, &set)?;
    case.must_end_well(&outcome);
    let name = format!("{} ({kind})", arguments[..2.min(arguments.len())].join(" "));
    let told = || {
        format!("allocation {} refused: {}: {}: {}", point.at, outcome.call, outcome.ending(), outcome.said())
    };
    let is_same = outcome.code == alone.outcome.code && outcome.out == alone.outcome.out;
    case.hold(outcome.code == Some(1) || is_same, &format!("{name}: ends with another code than 1"), told);
    if !is_same {
        // `check` says it in its verdict.
        let is_said = outcome.err.len() > 10 || outcome.out.contains("unreadable: ");
        case.hold(is_said, &format!("{name}: fails without a message"), told);
    }
    let now = found(&folder)?.written;
    let stray = now.iter().find(|(path, digest)| alone.written.get(*path) != Some(digest));
    case.hold(stray.is_none(), &format!("{name}: leaves half a file under a final name"), told);
    Ok(())
}
