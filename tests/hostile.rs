//! The `asperity` command on files that no program wrote, or that were written to do harm: an error
//! that names the file and the problem, within bounds of memory and time, and never a panic.
//!
//! `fixtures/hostile` contains such files: logs made by `support/forgeries.rs`, which states the error in
//! each and the required report, and texts. With `ASPERITY_UPDATE_FIXTURES=1` the test writes them. `found`
//! contains the inputs found by fuzzing, and `corpus` a selection from which it starts.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::laws;
use crate::support::binary::text;
use crate::support::commands::{ON_LOGS, OnLog, arguments, words};
use crate::support::forgeries::{Forge, Forgery, Verdict};
use crate::support::small;

/// Limit on the address space of a command: a debug build maps 0.2 GB at its start, and every thread
/// reserves some.
const MEMORY_KB: u32 = 600_000;

/// Limit on its time, on a machine with other work.
const TIME: Duration = Duration::from_secs(120);

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/hostile")
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files: Vec<PathBuf> =
        entries.map(|entry| entry.expect("the folder can be read").path()).collect();
    files.sort();
    files
}

pub(crate) struct Outcome {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

/// Runs the command within its bounds, in its own folder. Its output goes to files: a pipe that nobody
/// empties would block it.
pub(crate) fn bounded(folder: &Path, arguments: &[&str]) -> Outcome {
    let file = |name: &str| fs::File::create(folder.join(name)).expect("the folder can be written");
    let mut child = Command::new("sh")
        .args(["-c", &format!("ulimit -v {MEMORY_KB}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_asperity")])
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(file("stdout"))
        .stderr(file("stderr"))
        .spawn()
        .expect("sh starts");
    let started = Instant::now();
    let mut pause = Duration::from_micros(200);
    let status = loop {
        if let Some(status) = child.try_wait().expect("it is ours") {
            break status;
        }
        if started.elapsed() > TIME {
            child.kill().expect("it is ours");
            panic!("asperity {} was not done after {TIME:?}", arguments.join(" "));
        }
        std::thread::sleep(pause);
        pause = (pause * 5 / 4).min(Duration::from_millis(5));
    };
    let said = |name: &str| {
        let bytes = fs::read(folder.join(name)).expect("it was just written");
        String::from_utf8(bytes).expect("the binary writes UTF-8")
    };
    Outcome { code: status.code(), out: said("stdout"), err: said("stderr") }
}

/// Runs the command on a file, which it must refuse, naming the file and the error.
pub(crate) fn refused(folder: &Path, arguments: &[&str], file: &Path) -> String {
    let Outcome { code, out, err } = bounded(folder, arguments);
    let said = if arguments[0] == "check" { out } else { err.clone() };
    let place = text(file);
    let what = said.split_once(place).map(|(_, what)| what.trim_matches([':', ' ', '\n']));
    let short: String = said.chars().take(1000).collect();
    let command = arguments.join(" ");
    assert!(matches!(code, Some(1..=5)), "asperity {command}: code {code:?}\n{short}");
    assert!(what.is_some_and(|what| what.len() > 10), "asperity {command} says not where and what: {short}");
    assert!(!err.contains("panicked") && !err.contains("RUST_BACKTRACE"), "asperity {command}: {err}");
    assert!(said.len() < 20_000, "asperity {command} says {} bytes: {short}", said.len());
    said
}

/// Which of the commands that read a kind of file are called.
#[derive(Clone, Copy)]
enum Commands {
    All,
    /// One for each file, in turn.
    InTurn,
}

impl Commands {
    fn of<'a>(self, number: usize, commands: &'a [&'a str]) -> impl Iterator<Item = &'a str> {
        let is_one = matches!(self, Commands::InTurn);
        let mine = move |n: &usize| !is_one || *n == number % commands.len();
        (0..commands.len()).filter(mine).map(|n| commands[n])
    }
}

/// Commands that read the records of a log, each in one form; those with verdicts of their own are called apart.
fn on_records() -> Vec<&'static str> {
    let name = |words: &&'static str| words.split(' ').next();
    let reads = |command: &&OnLog| !command.scenario_alone;
    let mut all: Vec<&str> = ON_LOGS.iter().filter(reads).map(|command| command.words).collect();
    all.dedup_by_key(|words| name(words));
    all.retain(|words| !matches!(name(words), Some("check" | "salvage")));
    all
}

/// Commands that read texts, and files of TOML, with FILE for their name.
const ON_TOML: &[&str] = &[
    "scenario show FILE",
    "sweep plan FILE --out never",
    "replay run.mcap --detectors FILE",
    "diff run.mcap run.mcap --policy FILE",
    "reproduce FILE --out never",
];
const ON_TEXTS: &[(&str, &[&str])] = &[
    ("scenarios", &["scenario show FILE", "scenario validate FILE", "run FILE --out never.mcap"]),
    ("profiles", &["scenario show default --set initial_shear.profile_csv=FILE"]),
    ("states", &["scenario show default --set slider.blocks=3 --set initial.state_csv=FILE"]),
    ("measured", &["draw run.mcap --kind load --set measured=FILE --out never"]),
    ("settings", &["replay run.mcap --detectors FILE"]),
    ("sweeps", &["sweep plan FILE --out never", "sweep draw study --from FILE"]),
    ("pipelines", &["reproduce FILE --out never"]),
];

/// Runs a command on a file, which it must refuse, leaving nothing.
fn must_refuse(folder: &Path, command: &str, file: &Path) {
    let words = words(command, &[text(file)], "never");
    refused(folder, &arguments(&words), file);
    for out in ["never", "never.mcap", "study/figures"] {
        assert!(!folder.join(out).exists(), "{command} leaves {out}");
    }
}

/// Has commands that read logs read one, which they must refuse or, if it may be, read.
fn read_by(commands: Commands, number: usize, file: &Path, is_refused: bool, consistent: bool) {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    // The remaining part is a log, marked as incomplete.
    let out = folder.join("salvaged.mcap");
    let salvage = bounded(folder, &["salvage", text(file), "--out", "salvaged.mcap"]);
    assert!(matches!(salvage.code, Some(0..=5)), "salvage of {}: {}", text(file), salvage.err);
    assert!(!salvage.err.contains("panicked"), "salvage of {}: {}", text(file), salvage.err);
    if out.exists() {
        let said = refused(folder, &["check", text(&out)], &out);
        // Messages that contradict each other are kept, if checksums vouch for them.
        let salvaged = said.contains(": salvaged with gaps: ");
        assert!(
            salvaged || (consistent && said.contains(": damaged: ")),
            "salvaged of {}: {said}",
            text(file)
        );
    }
    for (number, command) in commands.of(number, &on_records()).enumerate() {
        let call = |new: String| words(command, &[text(file)], &new);
        let [first, second] = [call(format!("first-{number}")), call(format!("second-{number}"))];
        if is_refused || bounded(folder, &arguments(&first)).code != Some(0) {
            refused(folder, &arguments(&second), file);
        }
    }
}

/// Compares the reports of `check` with these options on forgeries with the required ones, all at once.
fn judged(options: &[&str], forgeries: &[Forgery]) {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let files: Vec<String> = forgeries.iter().map(|forgery| format!("{}.mcap", forgery.name)).collect();
    for (file, forgery) in files.iter().zip(forgeries) {
        fs::write(folder.join(file), &forgery.bytes).expect("the folder can be written");
    }
    let arguments: Vec<&str> =
        ["check"].iter().chain(options).copied().chain(files.iter().map(String::as_str)).collect();
    let Outcome { out, err, .. } = bounded(folder, &arguments);
    assert_eq!(out.lines().count(), files.len(), "{err}");
    let mut wrong = Vec::new();
    for ((said, file), forgery) in out.lines().zip(&files).zip(forgeries) {
        let said = said.strip_prefix(&format!("{file}: ")).unwrap_or_else(|| panic!("{file}: {said}"));
        let verdict = format!("{}: ", forgery.verdict.word());
        if !said.starts_with(&verdict) || !forgery.says.split('|').any(|says| said.contains(says)) {
            let told: String = said.chars().take(300).collect();
            wrong.push(format!(
                "{} ({}): not {verdict}{}, but {told}",
                forgery.name, forgery.what, forgery.says
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert_eq!(err, "");
}

/// The beginning of a golden log, taken apart.
fn golden() -> Vec<laws::parts::Part> {
    let log = fixtures().join("../logs/complete.mcap");
    let bytes = fs::read(&log).unwrap_or_else(|error| panic!("{}: {error}", log.display()));
    let sound = laws::parts::beginning(&laws::parts::take_apart(&bytes), 60);
    laws::thin::thinned(&sound.expect("all blocks come to rest in it"))
}

#[test]
fn check_tells_every_forgery_of_a_log_by_what_is_wrong() {
    judged(&[], &Forge::all(&own_log(&[])));
}

/// Logs with correct checksums, counts and digests that contradict their own scenario.
#[test]
fn check_holds_a_log_against_its_own_scenario() {
    judged(&[], &Forge::of_own(&own_log(&[])));
}

#[test]
fn check_again_tells_every_forgery_of_records() {
    judge_again(5, Commands::InTurn);
}

/// Consistent logs are accepted, and read without a panic, every `each`-th by these commands; only repeating
/// the run shows that they differ from it.
fn judge_again(each: usize, commands: Commands) {
    let forgeries = Forge::of_records(&own_log(&[]), &own_log(&["--set", "friction.static_coefficient=0.6"]));
    judged(&["--again"], &forgeries);
    let believed: Vec<Forgery> = forgeries
        .into_iter()
        .map(|forgery| Forgery { verdict: Verdict::Whole, says: "up to step", ..forgery })
        .collect();
    judged(&[], &believed);
    let scratch = asperity_testkit::folder();
    for (number, Forgery { name, bytes, .. }) in believed.iter().step_by(each).enumerate() {
        let file = scratch.path().join(format!("{name}.mcap"));
        fs::write(&file, bytes).expect("the folder can be written");
        read_by(commands, number, &file, false, true);
    }
}

/// The parts of a log of this code version.
fn own_log(more: &[&str]) -> Vec<laws::parts::Part> {
    let scratch = asperity_testkit::folder();
    let path = scratch.path().join("small.mcap");
    crate::support::binary::run(&[&small::SCENARIO[..], more].concat(), &path);
    laws::parts::take_apart(&fs::read(&path).expect("it was just written"))
}

/// The files in the repository are those that the code here generates.
#[test]
fn committed_forgeries_are_those_that_are_made() {
    hold_committed(10, Commands::InTurn);
}

/// Compares the files with generated ones; every `each`-th of them is read by these commands.
fn hold_committed(each: usize, commands: Commands) {
    let folder = fixtures().join("logs");
    let all = Forge::all(&golden());
    // Only where the program is that which made the log are its events compared with the steps.
    let (events, others): (Vec<Forgery>, Vec<Forgery>) = all
        .into_iter()
        .partition(|forgery| matches!(forgery.name, "event-other" | "event-lost" | "scenario-other"));
    assert_eq!(events.len(), 3);
    let others: Vec<Forgery> = others.into_iter().map(Forgery::of_another_program).collect();
    let mut list = String::from("file,verdict,says,what\n");
    for Forgery { name, what, verdict, says, .. } in &others {
        list += &format!("{name}.mcap,{},\"{}\",\"{what}\"\n", verdict.word(), says.replace('"', "\"\""));
    }
    if std::env::var_os("ASPERITY_UPDATE_FIXTURES").is_some() {
        fs::remove_dir_all(&folder).ok();
        fs::create_dir_all(&folder).expect("the repository can be written");
        for Forgery { name, bytes, .. } in &others {
            fs::write(folder.join(format!("{name}.mcap")), bytes).expect("the repository can be written");
        }
        fs::write(fixtures().join("logs.csv"), &list).expect("the repository can be written");
    }
    let names: BTreeSet<PathBuf> =
        others.iter().map(|forgery| folder.join(format!("{}.mcap", forgery.name))).collect();
    assert_eq!(names, files(&folder).into_iter().collect());
    for Forgery { name, bytes, .. } in &others {
        let committed = fs::read(folder.join(format!("{name}.mcap"))).expect("it was just listed");
        assert!(committed == *bytes, "{name}.mcap is not what the code makes");
    }
    let committed = fs::read_to_string(fixtures().join("logs.csv")).expect("the list can be read");
    assert_eq!(committed, list);
    judged(&[], &others);
    let scratch = asperity_testkit::folder();
    for (number, Forgery { name, verdict, consistent, .. }) in others.iter().step_by(each).enumerate() {
        let file = folder.join(format!("{name}.mcap"));
        read_by(commands, number, &file, *verdict != Verdict::OtherCode, *consistent);
        must_refuse(scratch.path(), "scenario show default --set initial.from=FILE", &file);
    }
}

/// Texts: each folder with the commands that read it.
#[test]
fn hostile_texts_are_refused_with_place_and_reason() {
    hold_texts(Commands::InTurn);
}

fn hold_texts(commands: Commands) {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let sweep = folder.join("sweep.toml");
    fs::write(&sweep, SWEEP).expect("the folder can be written");
    let planned = bounded(folder, &["sweep", "plan", text(&sweep), "--out", "study"]);
    assert_eq!(planned.code, Some(0), "{}", planned.err);
    fs::copy(fixtures().join("../logs/complete.mcap"), folder.join("run.mcap")).expect("it is there");
    for (of, on_texts) in ON_TEXTS {
        for (number, file) in files(&fixtures().join(of)).iter().enumerate() {
            commands.of(number, on_texts).for_each(|command| must_refuse(folder, command, file));
        }
    }
}

const SWEEP: &str = "
title = 'Tilts'
scenario = 'default'
[[axis]]
key = 'normal_load.tilt'
values = [0.1, 0.2]
";

/// Too large to keep: made here.
#[test]
fn large_texts_are_refused_within_bounds() {
    refuse_large(Commands::InTurn);
}

fn refuse_large(commands: Commands) {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    fs::copy(fixtures().join("../logs/complete.mcap"), folder.join("run.mcap")).expect("it is there");
    let large: [(&str, String); 10] = [
        ("line.toml", format!("name = \"{}", "x".repeat(10_000_000))),
        ("value.toml", format!("slider.blocks = {}\n", "9".repeat(10_000_000))),
        ("nested-lists.toml", format!("name = {}", "[".repeat(1_000_000))),
        ("nested-tables.toml", format!("name = {}", "{a=".repeat(1_000_000))),
        ("nested-keys.toml", format!("{}a = 1", "a.".repeat(1_000_000))),
        ("comments.toml", "# nothing at all\n".repeat(800_000)),
        ("values.toml", format!("a = [{}]", "1,".repeat(4_900_000))),
        ("lines.toml", "\n".repeat(8_000_000)),
        ("keys.toml", (0..600_000).map(|number| format!("k{number:x}=1\n")).collect()),
        ("many-errors.toml", "[[recording.window]]\nfrom_s = -1\n".repeat(1000)),
    ];
    for (number, (name, content)) in large.iter().enumerate() {
        let file = folder.join(name);
        fs::write(&file, content).expect("the folder can be written");
        commands.of(number, ON_TOML).for_each(|command| must_refuse(folder, command, &file));
    }
    let endless = Path::new("/dev/zero");
    if endless.exists() {
        let on_any = ["check FILE", ON_TOML[0], ON_TOML[1]];
        commands.of(0, &on_any).for_each(|command| must_refuse(folder, command, endless));
    }
}

/// A log of messages that unpack to more than there is memory for is read in bounds.
#[test]
fn what_unpacks_to_much_is_read_in_bounds() {
    use laws::packing::{Packing, put_together};
    use laws::parts::{Part, correct_end};
    use mcap::records::op;
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let mut parts = golden();
    let event = parts
        .iter()
        .find(|part| {
            part.opcode == op::MESSAGE && part.payload().is_some_and(|text| text.starts_with(b"{\"onset_s\""))
        })
        .cloned()
        .expect("it has a slip event");
    // Ten chunks that unpack to fifty million bytes of slip events each.
    let mut records = Vec::new();
    while records.len() < 50_000_000 {
        event.put(&mut records);
    }
    let packed = zstd::bulk::compress(&records, 1).expect("it compresses");
    let crc = crc32fast::hash(&records);
    let chunk = Part::chunk_of(records.len() as u64, crc, "zstd", packed.len() as u64, &packed);
    let at = parts.len() - 1;
    parts.splice(at..at, std::iter::repeat_n(chunk, 10));
    correct_end(&mut parts);
    let file = folder.join("bomb.mcap");
    let bytes = put_together(&parts, Packing::USUAL);
    assert!(bytes.len() < 5_000_000);
    fs::write(&file, bytes).expect("the folder can be written");
    refused(folder, &["check", text(&file)], &file);
    refused(folder, &["replay", text(&file)], &file);
    refused(folder, &["events", text(&file)], &file);
}

/// Runs the inputs found by fuzzing, and those with the largest coverage, through the functions of the
/// fuzzers.
#[test]
fn what_fuzzing_found_stays_mended() {
    type Law = fn(&[u8]);
    let targets: &[(&str, Law)] = &[
        ("log_bytes", laws::log_bytes),
        ("log_edits", laws::log_edits),
        ("metadata", laws::metadata),
        ("scenario", laws::scenario),
        ("profile", laws::profile),
        ("plan", laws::plan),
        ("recording", laws::recording),
        ("results", laws::results),
        ("pipeline", laws::pipeline),
        ("tables", laws::tables),
    ];
    let mut read = 0;
    for kept in ["found", "corpus"] {
        for (target, law) in targets {
            let folder = fixtures().join(kept).join(target);
            if !folder.is_dir() {
                continue;
            }
            for file in files(&folder) {
                law(&fs::read(&file).expect("it was just listed"));
                read += 1;
            }
        }
    }
    assert!(read > 300, "{read} inputs are kept");
}

#[test]
#[ignore = "half a minute, a thousand calls: cargo xtask nightly"]
fn committed_forgeries_are_refused_by_all_commands() {
    hold_committed(1, Commands::All);
}

mod in_ci {
    use super::Commands::All;

    #[test]
    #[ignore = "two hundred calls: cargo xtask ci"]
    fn forgeries_of_records_are_read_by_all_commands() {
        super::judge_again(1, All);
    }

    #[test]
    #[ignore = "two hundred calls: cargo xtask ci"]
    fn texts_are_refused_by_all_commands() {
        super::hold_texts(All);
        super::refuse_large(All);
    }
}
