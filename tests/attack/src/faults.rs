//! Every operation on a file fails in turn: the k-th one that a command makes, for every k, with each error
//! that a system gives. Afterwards the words and the exit code say it, final names have what was there or the
//! whole of the new, a call as a user would make it writes all, and nothing else has changed.
//!
//! Operations are counted in the kernel (`kernel.rs`): one that could change a file and is not counted is a
//! failure by itself.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::calls::{Call, Outcome};
use crate::case::{Case, once, try_all};
use crate::commands::{ON_LOGS, arguments, words};
use crate::ground::{Error, Ground};
use crate::kills::aftermath;
use crate::operations::{Fate, Kind, Operation, is_possible, supervise};
use crate::tally::say;
use crate::writers::{Writer, Written, compared, found, has_its_inputs, is_temporary, prepare};

/// What happens to an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Fault {
    fate: Fate,
    /// Whether all operations of its kind fail from then on, as on a full disk.
    lasts: bool,
}

/// A fault of one operation of a command.
#[derive(Debug)]
struct Point {
    /// Of the command in its list.
    command: usize,
    /// Of the operation.
    number: usize,
    kind: Kind,
    fault: Fault,
    /// Of the name of the file.
    ending: OsString,
}

/// Commands that print what they read, beside those on logs that write no file.
const READERS: [&str; 3] =
    ["sweep status in/study", "scenario show default", "diff in/a/run.mcap in/a2/run.mcap"];

/// All of them, as words.
pub(crate) fn readers() -> Vec<Vec<String>> {
    let on_logs = ON_LOGS.iter().map(|command| command.words).filter(|words| !words.contains("NEW"));
    on_logs.chain(READERS).map(|command| words(command, &["in/a/run.mcap"], "")).collect()
}

/// Names that resemble the command's own, and belong to someone else.
const FOREIGN: [&str; 4] =
    ["mine.txt", ".asperity-mine/file", ".asperity-abcdefgh.txt", ".asperity-folders1/inside/file"];

/// A folder as the command makes them, of another process.
const LIVING: &str = ".asperity-aLiving1";

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    if !is_possible(ground, "faults") {
        return Ok(());
    }
    let of_studies = Writer::of_studies(ground)?;
    let writers: Vec<&Writer> = Writer::all(ground)?.iter().chain(&of_studies).collect();
    let mut points = Vec::new();
    for (command, writer) in writers.iter().enumerate() {
        let operations =
            counted(ground, writer.name, writer.arguments(0), |case| writer.set_up(case).map(drop))?;
        points.extend(points_of(command, &operations));
    }
    try_some(ground, "writing commands", &points, ground.size.faults, |case, point| {
        in_writer(case, writers[point.command], point)
    })?;
    let mut points = Vec::new();
    let readers = readers();
    let readers: Vec<Vec<&str>> = readers.iter().map(|words| arguments(words)).collect();
    for (command, arguments) in readers.iter().enumerate() {
        let set_up = |case: &mut Case<'_>| prepare(case.ground, &case.folder);
        points.extend(points_of(command, &counted(ground, arguments[0], arguments, set_up)?));
    }
    try_some(ground, "printing commands", &points, ground.size.faults / 4, |case, point| {
        in_reader(case, &readers[point.command], point)
    })
}

/// Tries some of the faults, of every kind on every kind of file. `attempt` returns whether the call came to the
/// operation: a log is written by several threads, and has some writes more or fewer from call to call.
fn try_some(
    ground: &Ground,
    part: &str,
    points: &[Point],
    some: usize,
    attempt: impl Fn(&mut Case<'_>, &Point) -> Result<bool, Error> + Sync,
) -> Result<(), Error> {
    let kinds: Vec<_> = points.iter().map(|point| (point.kind, point.fault, &point.ending)).collect();
    let chosen = ground.some_of_each(&kinds, some);
    let different = kinds.iter().collect::<BTreeSet<_>>().len();
    let all = points.len();
    say(&format!("  faults: {part}: {all} faults of {different} kinds; {} are tried", chosen.len()));
    let missed = AtomicUsize::new(0);
    try_all(ground, "faults", part, chosen.len(), |case| {
        if !attempt(case, &points[chosen[case.number]])? {
            missed.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    })?;
    let missed = missed.into_inner();
    say(&format!("  faults: {part}: {missed} calls ended before they came to the operation"));
    if missed > chosen.len() / 10 {
        return Err("more than a tenth of the calls did not come to the fault".into());
    }
    Ok(())
}

/// Lists the operations of an undisturbed call; prints how many there are of each kind. While it writes, no other
/// process could lock what it writes to.
fn counted(
    ground: &Ground,
    name: &str,
    arguments: &[&str],
    set_up: impl Fn(&mut Case<'_>) -> Result<(), Error>,
) -> Result<Vec<Operation>, Error> {
    let mut operations = Vec::new();
    let mut unlocked = BTreeSet::new();
    once(ground, "faults", &format!("operations of {name}"), |case| {
        set_up(case)?;
        let folder = case.folder.clone();
        let call = Call::new(&case.ground.program, &folder, arguments)?;
        let supervised = supervise(call, &folder, false, |_, operation| {
            operations.push(operation.clone());
            unlocked.extend(unlocked_place(&folder, operation));
            Fate::Proceeds
        })?;
        case.hold(unlocked.is_empty(), &format!("{name}: writes without a lock"), || format!("{unlocked:?}"));
        case.must_end_well(&supervised.outcome);
        case.hold(supervised.past.is_empty(), "operations go past the counter", || {
            format!("{name}: {}", supervised.past.join(", "))
        });
        Ok(())
    })?;
    let mut counts = BTreeMap::new();
    operations.iter().for_each(|operation| *counts.entry(operation.kind).or_insert(0) += 1);
    let counts: Vec<String> = counts.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    say(&format!("  faults: {name}: {} operations: {}", operations.len(), counts.join(", ")));
    Ok(operations)
}

/// The temporary file or folder that an operation writes to or syncs, if nobody has locked it.
fn unlocked_place(folder: &Path, operation: &Operation) -> Option<PathBuf> {
    if !matches!(operation.kind, Kind::Write | Kind::Sync) {
        return None;
    }
    let is_temporary = |path: &&Path| is_temporary(&path.file_name().unwrap_or_default().to_string_lossy());
    let place = operation.path.ancestors().filter(is_temporary).last()?;
    let is_free = fs::File::open(folder.join(place)).is_ok_and(|open| open.try_lock().is_ok());
    is_free.then(|| place.to_owned())
}

fn points_of(command: usize, operations: &[Operation]) -> Vec<Point> {
    let of = |(number, operation): (usize, &Operation)| {
        let ending = operation.path.extension().unwrap_or_default().to_owned();
        let kind = operation.kind;
        faults(kind).into_iter().map(move |fault| Point {
            command,
            number,
            kind,
            fault,
            ending: ending.clone(),
        })
    };
    operations.iter().enumerate().flat_map(of).collect()
}

/// What can happen to an operation of a kind.
fn faults(kind: Kind) -> Vec<Fault> {
    let errors: &[i32] = match kind {
        Kind::Create => &[libc::ENOSPC, libc::EIO, libc::EINTR, libc::EMFILE, libc::EACCES],
        Kind::Open => &[libc::EIO, libc::EINTR, libc::EMFILE, libc::EACCES],
        Kind::Read => &[libc::EIO, libc::EINTR],
        Kind::Write => &[libc::ENOSPC, libc::EIO, libc::EINTR],
        Kind::Print => &[libc::ENOSPC, libc::EIO, libc::EINTR],
        Kind::Sync => &[libc::EIO, libc::ENOSPC, libc::EINTR],
        Kind::Rename | Kind::Link => &[libc::ENOSPC, libc::EIO, libc::EACCES],
        Kind::Remove => &[libc::EIO, libc::EACCES],
        Kind::Folder => &[libc::ENOSPC, libc::EIO, libc::EACCES],
        Kind::Lock => &[libc::ENOLCK, libc::EIO, libc::EINTR],
        Kind::Length => &[libc::EIO, libc::EINTR],
    };
    let mut faults: Vec<Fault> =
        errors.iter().map(|error| Fault { fate: Fate::Fails(*error), lasts: false }).collect();
    match kind {
        Kind::Write | Kind::Print => {
            faults.push(Fault { fate: Fate::Halves, lasts: false });
            faults.push(Fault { fate: Fate::Fails(libc::ENOSPC), lasts: true });
        }
        Kind::Create => faults.push(Fault { fate: Fate::Fails(libc::EMFILE), lasts: true }),
        _ => {}
    }
    faults
}

impl Fault {
    fn words(self) -> String {
        let what = match self.fate {
            Fate::Proceeds => "succeeds".to_owned(),
            Fate::Halves => "writes half".to_owned(),
            Fate::Fails(error) => format!("fails with \"{}\"", words_of(error)),
        };
        if self.lasts { format!("{what} from then on") } else { what }
    }

    /// Whether a program simply makes the call again.
    fn is_passing(self) -> bool {
        self.fate == Fate::Halves || self.fate == Fate::Fails(libc::EINTR)
    }
}

impl Point {
    /// Whether a command that meets the fault has not done all that it promises: what is not synced may be lost.
    fn must_be_said(&self) -> bool {
        let is_real = matches!(self.fault.fate, Fate::Fails(libc::EIO | libc::ENOSPC));
        is_real && matches!(self.kind, Kind::Sync | Kind::Write | Kind::Print)
    }
}

/// The system's words for an error, without its number.
fn words_of(error: i32) -> String {
    let text = std::io::Error::from_raw_os_error(error).to_string();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}

/// Calls a command with a fault. Returns how it ended and the operation that the fault hit, if it came to that.
fn with_fault(
    case: &mut Case<'_>,
    arguments: &[&str],
    point: &Point,
) -> Result<(Outcome, Option<Operation>), Error> {
    let call = Call::new(&case.ground.program, &case.folder, arguments)?;
    let mut hit: Option<Operation> = None;
    let supervised = supervise(call, &case.folder, false, |number, operation| {
        // With several threads the order differs from call to call.
        let begins = hit.is_none() && number >= point.number;
        if operation.kind != point.kind || !(begins || (hit.is_some() && point.fault.lasts)) {
            return Fate::Proceeds;
        }
        hit.get_or_insert_with(|| operation.clone());
        point.fault.fate
    })?;
    case.must_end_well(&supervised.outcome);
    case.hold(supervised.past.is_empty(), "operations go past the counter", || supervised.past.join(", "));
    Ok((supervised.outcome, hit))
}

fn in_writer(case: &mut Case<'_>, writer: &Writer, point: &Point) -> Result<bool, Error> {
    let before = writer.set_up(case)?;
    let folder = case.folder.clone();
    for name in FOREIGN {
        let path = folder.join(name);
        fs::create_dir_all(path.parent().expect("it is in the folder"))?;
        fs::write(path, name)?;
    }
    // Another process works in it.
    let living = folder.join(LIVING);
    fs::create_dir(&living)?;
    fs::write(living.join("half"), "half")?;
    let lock = fs::File::open(&living)?;
    lock.try_lock().map_err(|_| "a new folder is locked")?;
    let (outcome, hit) = with_fault(case, writer.arguments(0), point)?;
    let fault = point.fault;
    let Some(hit) = hit else { return Ok(false) };
    let what = format!("{} {}", point.kind, fault.words());
    let name = writer.name;
    let written = found_without_foreign(&folder)?;
    let told = || {
        format!(
            "{hit} {}: {}: {}\n{}",
            fault.words(),
            outcome.ending(),
            outcome.said(),
            compared(writer, &written)
        )
    };
    match outcome.code {
        Some(0) => {
            let all = written == writer.alone[0];
            case.hold(all, &format!("{name}, {what}: exits with 0 and has not written all"), told);
            case.hold(!point.must_be_said(), &format!("{name}, {what}: exits with 0"), told);
        }
        Some(1 | 2) => {
            case.hold(!fault.is_passing(), &format!("{name}, {what}: gives up"), told);
            says(case, name, &what, point, &outcome, told);
        }
        _ => case.broke(format!("{name}, {what}: ends with another code than 0, 1 and 2"), told()),
    }
    let foreign_is_whole =
        |name: &&str| fs::read_to_string(folder.join(name)).is_ok_and(|text| text == **name);
    let touched = FOREIGN.iter().find(|name| !foreign_is_whole(name));
    case.hold(touched.is_none(), &format!("{name}, {what}: touches what is another's"), || {
        format!("{touched:?}\n{}", told())
    });
    case.hold(has_its_inputs(case)?, &format!("{name}, {what}: changes an input"), told);
    case.hold(
        living.join("half").exists(),
        &format!("{name}, {what}: removes the files of a living process"),
        told,
    );
    drop(lock);
    fs::remove_dir_all(living).ok();
    FOREIGN.iter().try_for_each(|name| remove_foreign(&folder, name))?;
    aftermath(case, writer, &before, &what)?;
    Ok(true)
}

fn remove_foreign(folder: &Path, name: &str) -> Result<(), Error> {
    let top = name.split('/').next().unwrap_or_default();
    let path = folder.join(top);
    // A command that removed it has been found out above.
    match path.is_dir() {
        true => Ok(fs::remove_dir_all(path)?),
        false if path.exists() => Ok(fs::remove_file(path)?),
        false => Ok(()),
    }
}

/// What is under final names beside the files of others.
fn found_without_foreign(folder: &Path) -> Result<Written, Error> {
    let mut written = found(folder)?.written;
    written.retain(|path, _| !FOREIGN.contains(&path.as_str()));
    Ok(written)
}

/// A failure names the reason.
fn says(
    case: &mut Case<'_>,
    name: &str,
    what: &str,
    point: &Point,
    outcome: &Outcome,
    told: impl FnOnce() -> String + Clone,
) {
    // The verdict of `check` is what it prints.
    let is_said = outcome.err.contains("error: ") || outcome.out.contains("unreadable: ");
    case.hold(is_said, &format!("{name}, {what}: fails without a message"), told.clone());
    if let Fate::Fails(error) = point.fault.fate {
        let reason = outcome.out.contains(&words_of(error)) || outcome.err.contains(&words_of(error));
        case.hold(reason, &format!("{name}, {what}: does not give the reason"), told);
    }
}

fn in_reader(case: &mut Case<'_>, arguments: &[&str], point: &Point) -> Result<bool, Error> {
    prepare(case.ground, &case.folder)?;
    let alone = case.call(arguments)?;
    let (outcome, hit) = with_fault(case, arguments, point)?;
    let Some(hit) = hit else { return Ok(false) };
    let fault = point.fault;
    let name = arguments.join(" ");
    let what = format!("{} {}", point.kind, fault.words());
    let told = || format!("{hit} {}: {}: {}", fault.words(), outcome.ending(), outcome.said());
    if outcome.code == alone.code {
        let is_same = outcome.out == alone.out;
        // A failure that is itself the answer of the undisturbed call has code 1 as well.
        let failed = outcome.err.contains("error: ");
        case.hold(
            is_same || failed,
            &format!("{name}, {what}: prints something else as if it were all"),
            told,
        );
    } else {
        case.hold(!fault.is_passing(), &format!("{name}, {what}: gives up"), told);
        case.hold(
            matches!(outcome.code, Some(1 | 2)),
            &format!("{name}, {what}: takes it for a damage"),
            told,
        );
        says(case, &name, &what, point, &outcome, told);
    }
    Ok(true)
}
