//! Lack of resources: outputs that cannot be written, few open files, small files, little memory, a full
//! disk; and inputs made to exhaust them. A command then works, or ends by itself with a message, and
//! leaves nothing incomplete under a final name.

use std::fs;
use std::process::Command;

use crate::calls::{Call, Outcome};
use crate::case::{Case, try_all};
use crate::commands::arguments;
use crate::ground::{Error, Ground};
use crate::hostile;
use crate::writers::{INPUTS, Writer, Written, compared, found, prepare};

/// Redirections of a call.
const OUTPUTS: [(&str, &str); 5] = [
    ("standard error full", "2>/dev/full"),
    ("standard error closed", "2>&-"),
    ("standard output full", ">/dev/full"),
    ("standard output closed", ">&-"),
    ("both outputs full", ">/dev/full 2>&1"),
];

/// Bytes of a file, in the blocks of 512 that the shell counts in.
const FILE_BLOCKS: [u32; 3] = [0, 16, 200];

const OPEN_FILES: [u32; 5] = [4, 5, 6, 8, 12];

const MEMORY_MB: [u32; 12] = [100, 110, 120, 130, 140, 150, 160, 180, 200, 250, 300, 400];

/// What is lacking, with the line of shell before a call, and its redirections.
fn limits() -> Vec<(String, String, &'static str)> {
    let outputs = OUTPUTS.map(|(what, to)| (what.to_owned(), "true".to_owned(), to));
    let files = FILE_BLOCKS
        .map(|blocks| (format!("files of {} bytes", 512 * blocks), format!("ulimit -f {blocks}"), ""));
    let open = OPEN_FILES.map(|count| (format!("{count} open files"), format!("ulimit -n {count}"), ""));
    let memory = MEMORY_MB.map(|mb| (format!("memory of {mb} MB"), format!("ulimit -v {mb}000"), ""));
    outputs.into_iter().chain(files).chain(open).chain(memory).collect()
}

pub(crate) fn attack(ground: &Ground) -> Result<(), Error> {
    let writers = Writer::all(ground)?;
    let readers = crate::faults::readers();
    let (limits, commands) = (limits(), writers.len() + readers.len());
    let chosen = ground.some_of(limits.len() * commands, 120);
    try_all(ground, "limits", "resources", chosen.len(), |case| {
        let (limit, command) = (&limits[chosen[case.number] / commands], chosen[case.number] % commands);
        match writers.get(command) {
            Some(writer) => limited(case, limit, writer.arguments(0), Some(writer)),
            None => limited(case, limit, &arguments(&readers[command - writers.len()]), None),
        }
    })?;
    full_disk(ground, writers)?;
    hostile::attack(ground)
}

fn limited(
    case: &mut Case<'_>,
    (limit, before, redirections): &(String, String, &str),
    arguments: &[&str],
    writer: Option<&Writer>,
) -> Result<(), Error> {
    let folder = case.folder.clone();
    prepare(case.ground, &folder)?;
    let program = &case.ground.program;
    if before.starts_with("ulimit -v") {
        // If it cannot even be loaded, it cannot print a message.
        let loads = Call::by_shell(program, &folder, before, &["--version"], "")?.run()?;
        if loads.code != Some(0) {
            return Ok(());
        }
    }
    let mut former = Written::new();
    if let Some(writer) = writer.filter(|writer| writer.over_former) {
        case.call(writer.arguments(1))?;
        former = found(&folder)?.written;
    }
    let outcome = Call::by_shell(program, &folder, before, arguments, redirections)?.run()?;
    let told = || format!("{}: {}: {}", outcome.call, outcome.ending(), outcome.said());
    let command = writer.map_or(arguments[0], |writer| writer.name);
    let words = format!("{}{}", outcome.out, outcome.err);
    // Its output goes to files here, so without files it cannot print a message.
    let spoken = !redirections.contains('2') && limit != "files of 0 bytes";
    // The standard library ends a process that gets no memory, with a sentence of its own.
    let out_of_memory = words.contains("memory allocation of") || words.contains("out of memory");
    if outcome.signal == Some(6) && out_of_memory {
        case.note(&outcome);
    } else {
        case.must_end_well(&outcome);
    }
    let failed = outcome.code != Some(0);
    if failed && spoken {
        case.hold(words.trim().len() > 10, &format!("{command} fails without a word, with {limit}"), told);
    }
    if failed && limit.ends_with("open files") && spoken {
        case.hold(
            !words.contains("another process"),
            &format!("{command} blames another process, with {limit}"),
            told,
        );
    }
    let muted = |name: &str| limit.starts_with(name);
    if muted("standard error") || muted("standard output closed") {
        case.hold(!failed, &format!("{command} does not work, with {limit}"), told);
    }
    if muted("standard output full") && outcome.code != Some(1) {
        // A command without output cannot fail to print.
        let loud = Call::new(program, &folder, arguments)?.run()?.out;
        case.hold(
            loud.is_empty() || writer.is_some(),
            &format!("{command} does not exit with 1, with {limit}"),
            told,
        );
    }
    let Some(writer) = writer else { return Ok(()) };
    complete_or_not_there(case, writer, &former, limit, &outcome)
}

/// Files under final names are those that the command writes, and complete if it reports success.
fn complete_or_not_there(
    case: &mut Case<'_>,
    writer: &Writer,
    former: &Written,
    limit: &str,
    outcome: &Outcome,
) -> Result<(), Error> {
    let now = found(&case.folder)?;
    let alone = &writer.alone[0];
    let stray = now
        .written
        .iter()
        .find(|(path, digest)| [alone, former].iter().all(|set| set.get(*path) != Some(digest)));
    let told = || format!("{}: {}\n{}", outcome.ending(), outcome.err.trim(), compared(writer, &now.written));
    let name = writer.name;
    case.hold(stray.is_none(), &format!("{name} leaves half a file under a final name, with {limit}"), told);
    let whole = now.written == *alone;
    case.hold(
        outcome.code != Some(0) || whole,
        &format!("{name} exits with 0 and has not written all, with {limit}"),
        told,
    );
    if outcome.code != Some(0) && writer.over_former {
        case.hold(
            whole || now.written == *former,
            &format!("{name} fails and leaves files of two sets, with {limit}"),
            told,
        );
    }
    Ok(())
}

/// The commands on a disk of a megabyte and a half that is nearly full.
fn full_disk(ground: &Ground, writers: &[Writer]) -> Result<(), Error> {
    let sizes = [0, 4, 40, 300];
    let cases = writers.len() * sizes.len();
    let probe = Command::new("unshare")
        .args(["--mount", "--map-root-user", "sh", "-c", "mount -t tmpfs tmpfs /mnt"])
        .output();
    if !probe.is_ok_and(|output| output.status.success()) {
        let reason = "full disk: the system allows no disk of its own".to_owned();
        ground.tally.lock().expect("no case panics with it").skip("limits", reason);
        return Ok(());
    }
    try_all(ground, "limits", "full disk", cases, |case| {
        let writer = &writers[case.number % writers.len()];
        on_full_disk(case, writer, sizes[case.number / writers.len()])
    })
}

fn on_full_disk(case: &mut Case<'_>, writer: &Writer, free_kb: u32) -> Result<(), Error> {
    let folder = case.folder.clone();
    prepare(case.ground, &folder)?;
    // Inputs are reached by a link, so that only outputs are on the disk; its final contents are copied
    // back, since they are invisible elsewhere.
    let script = format!(
        "mkdir disk kept && mount -t tmpfs -o size={}k tmpfs disk && cd disk || exit 99
         ln -s ../{INPUTS} {INPUTS}; head -c 8192 /dev/zero > filler
         \"$0\" \"$@\"; code=$?
         rm -f filler {INPUTS}; cp -a . ../kept/; exit $code",
        free_kb + 8
    );
    let mut shell = Command::new("unshare");
    shell.args(["--mount", "--map-root-user", "sh", "-c", &script]).arg(&case.ground.program);
    let output = shell.args(writer.arguments(0)).current_dir(&folder).output()?;
    let code = output.status.code();
    let err = String::from_utf8_lossy(&output.stderr).into_owned();
    let outcome = Outcome {
        call: format!("asperity {} # with {free_kb} kB of disk", writer.arguments(0).join(" ")),
        code,
        signal: None,
        out: String::from_utf8_lossy(&output.stdout).into_owned(),
        err,
        hung: false,
        cpu_s: 0.0,
        peak_mb: 0.0,
    };
    case.must_end_well(&outcome);
    let name = writer.name;
    let told = || format!("{}: {}: {}", outcome.call, outcome.ending(), outcome.said());
    if code != Some(0) {
        case.hold(
            code == Some(1) && outcome.err.contains("space"),
            &format!("{name} does not say that the disk is full"),
            told,
        );
    }
    let now = found(&folder.join("kept"))?;
    let stray = now.written.iter().find(|(path, digest)| writer.alone[0].get(*path) != Some(digest));
    case.hold(
        stray.is_none(),
        &format!("{name} leaves half a file under a final name on a full disk"),
        || format!("{}\n{}", told(), compared(writer, &now.written)),
    );
    let whole = now.written == writer.alone[0];
    case.hold(
        code != Some(0) || whole,
        &format!("{name} exits with 0 on a full disk and has not written all"),
        told,
    );
    let left = now.temporary.iter().filter(|path| !path.ends_with(".mcap.partial")).count();
    case.hold(left == 0 || code == Some(0), &format!("{name} leaves temporary files on a full disk"), || {
        format!("{:?}\n{}", now.temporary, told())
    });
    fs::remove_dir_all(folder.join("kept"))?;
    Ok(())
}
