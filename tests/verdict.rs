//! One verdict behind all commands: every command follows the verdict of `asperity check`, in the same
//! words and with the exit codes of the table in `docs/run-logs.md`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, correct_end, take_apart};
use crate::laws::thin::messages;
use crate::support::binary::{self, succeed, text, with_sets};
use crate::support::commands::{arguments, form, words};
use crate::support::small;

/// Overrides of `rigid-contacts` by which a run is stopped, since its time step is too long.
const STOPPED: [&str; 2] = ["slider.blocks=24", "time.step_s=2.5e-6"];

/// A log of each verdict, with the verdict's word.
struct Logs {
    folder: tempfile::TempDir,
    logs: Vec<(&'static str, PathBuf)>,
}

impl Logs {
    fn make() -> Logs {
        static MADE: OnceLock<Vec<(&str, Vec<u8>)>> = OnceLock::new();
        let folder = asperity_testkit::folder();
        let mut logs: Vec<(&str, PathBuf)> = Vec::new();
        for (verdict, bytes) in MADE.get_or_init(bytes_by_verdict) {
            let path = folder.path().join(format!("{}.mcap", verdict.replace(' ', "-")));
            fs::write(&path, bytes).expect("the folder can be written");
            logs.push((verdict, path));
        }
        // A file of the system, whose first byte cannot be read.
        let unreadable = folder.path().join("unreadable.mcap");
        std::os::unix::fs::symlink("/proc/self/mem", &unreadable).expect("the folder can be written");
        logs.push(("unreadable", unreadable));
        Logs { folder, logs }
    }

    fn of(&self, verdict: &str) -> &str {
        text(&self.logs.iter().find(|(word, _)| *word == verdict).expect("there is one").1)
    }
}

fn bytes_by_verdict() -> Vec<(&'static str, Vec<u8>)> {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let read = |name: &str| fs::read(path(name)).expect("it was just written");
    small::run(&path("whole.mcap"));
    let whole = read("whole.mcap");
    let mut foreign = take_apart(&whole);
    let packed = put_together(&foreign, Packing { per_chunk: 50, ..Packing::USUAL });
    let half = packed.len() / 2;
    let mut flipped = packed.clone();
    flipped[half] ^= 4;
    for part in foreign.iter_mut().filter(|part| part.name() == Some("run")) {
        *part = by_other_code(part);
    }
    fs::write(path("damaged.mcap"), &flipped).expect("the folder can be written");
    succeed(&["salvage", text(&path("damaged.mcap")), "--out", text(&path("salvaged.mcap"))]);
    let stopped = path("stopped.mcap");
    assert_eq!(outcome(&with_sets(&["run", "rigid-contacts", "--out", text(&stopped)], &STOPPED)).0, 1);
    vec![
        ("whole", whole),
        ("by other code or detectors", put_together(&foreign, Packing::USUAL)),
        ("incomplete", packed[..half].to_vec()),
        ("stopped", read("stopped.mcap")),
        ("salvaged with gaps", read("salvaged.mcap")),
        ("not a run log", b"step,time_s\n1,0.5\n".to_vec()),
        ("damaged", flipped),
    ]
}

/// The header of the same run by another version of the program.
fn by_other_code(run: &Part) -> Part {
    let mut map = run.map().expect("it is metadata");
    map.insert("code_version".to_owned(), "0".repeat(64));
    let version: u32 = map["record_schema_version"].parse().expect("it is a number");
    let id = blake3::Hasher::new()
        .update(map["scenario_hash"].as_bytes())
        .update(&version.to_le_bytes())
        .update(map["code_version"].as_bytes())
        .finalize();
    map.insert("run_id".to_owned(), id.to_hex().to_string());
    Part::metadata("run", &map)
}

/// The table of the manual: the text of the cell by verdict and command.
fn table() -> BTreeMap<String, BTreeMap<String, String>> {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/run-logs.md");
    let page = fs::read_to_string(page).expect("the manual can be read");
    let cells = |line: &str| -> Vec<String> {
        line.trim_matches('|').split('|').map(|cell| cell.trim().replace('`', "")).collect()
    };
    let mut lines = page.lines().skip_while(|line| !line.starts_with("| verdict |"));
    let heading = cells(lines.next().expect("the page has the table"));
    lines
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let row = cells(line);
            let commands = heading[1..].iter().cloned().zip(row[1..].iter().cloned()).collect();
            (row[0].clone(), commands)
        })
        .collect()
}

/// The messages of a command about a log, and its exit code.
fn outcome(arguments: &[&str]) -> (i32, String) {
    let (code, out, err) = binary::outcome(arguments);
    (code, out + &err)
}

#[test]
fn every_command_goes_by_the_verdict_of_check() {
    let Logs { folder, logs } = Logs::make();
    let table = table();
    let mut verdicts: Vec<&str> = logs.iter().map(|(verdict, _)| *verdict).collect();
    verdicts.sort_unstable();
    assert_eq!(table.keys().map(String::as_str).collect::<Vec<_>>(), verdicts);
    let whole = logs[0].1.clone();
    let mut commands = 0;
    for (verdict, log) in &logs {
        for (command, cell) in &table[*verdict] {
            let out = folder.path().join(format!("{command} of {verdict}"));
            let [file, page] = ["mcap", "html"].map(|ending| out.with_extension(ending));
            let words = match command.as_str() {
                // Tested below.
                "reproduce" => continue,
                "diff" => words("diff NEW FILE", &[text(log)], text(&whole)),
                command => words(form(command), &[text(log)], text(&out)),
            };
            let arguments = arguments(&words);
            commands += 1;
            let (code, said) = outcome(&arguments);
            let what = format!("asperity {}: {code}\n{said}", arguments.join(" "));
            let promised = cell.split([',', ' ']).next().and_then(|code| code.parse().ok());
            assert_eq!(Some(code), promised, "the table says {cell:?}\n{what}");
            assert!(!said.contains("panicked"), "{what}");
            // Only `check` reports a complete log as such; a salvaged log states the errors in the rest.
            let told = match command.as_str() {
                "salvage" if file.exists() => said.contains(" salvaged to "),
                // It lists the code versions of the runs, whatever they were.
                "diff" if code == 0 => said.contains("code_version") == (*verdict != "whole"),
                "check" => said.contains(&format!(": {verdict}: ")),
                _ => said.contains(verdict) || *verdict == "whole",
            };
            assert!(told, "{what}");
            // A refusal leaves no files.
            let is_written = fs::read_dir(&out).is_ok_and(|mut entries| entries.next().is_some());
            assert!(!cell.contains("refused") || !is_written, "{what}");
            assert_eq!(file.exists(), command == "salvage" && cell.contains("what is left"), "{what}");
            if command == "report" {
                assert_eq!(page.exists(), !cell.contains("refused"), "{what}");
                let lacks = "<p class=\"lacks\">Not all of this run";
                let says = page.exists() && fs::read_to_string(&page).expect("it is text").contains(lacks);
                assert_eq!(says, [3, 5, 7].contains(&code), "{what}");
            }
            if command == "reduce" && is_written {
                let note = fs::read_to_string(out.join("what-is-missing.txt")).ok();
                assert_eq!(note.is_some(), code != 0, "{what}");
                assert!(note.is_none_or(|note| note.contains(verdict)), "{what}");
            }
        }
    }
    assert!(commands >= 64, "{commands} commands");
}

/// A log by other code may have other events, which a replay that finds its own does not confirm.
#[test]
fn a_replay_that_finds_other_events_than_the_log_fails() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("small.mcap");
    small::run(&log);
    let mut parts = take_apart(&fs::read(&log).expect("it was just written"));
    let at = messages(&parts, "/events/slip")[3];
    let mut event: serde_json::Value =
        serde_json::from_slice(parts[at].payload().expect("it is a message")).expect("messages are JSON");
    event["ft_fn_max"] = (event["ft_fn_max"].as_f64().expect("it is a number") + 1e-9).into();
    parts[at] = parts[at].with_payload(event.to_string().as_bytes());
    correct_end(&mut parts);
    let run = parts.iter_mut().find(|part| part.name() == Some("run")).expect("there is a header");
    *run = by_other_code(run);
    fs::write(&log, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
    let (code, said) = outcome(&["replay", text(&log)]);
    assert!(code == 1 && said.contains("the replay gives "), "{code}: {said}");
    assert!(!said.contains("the same as logged"), "{said}");
}

/// A log that is hardly readable has its verdict and exit codes like any other: `summary` and `report` used
/// to end with 1.
#[test]
fn damaged_beginnings_are_judged_alike() {
    judge_beginnings(3);
}

/// Every `each`-th command in turn.
fn judge_beginnings(each: usize) {
    let Logs { folder, logs } = Logs::make();
    let table = table();
    let whole = &logs[0].1;
    let bytes = fs::read(whole).expect("it was just written");
    let chunk = b"\x04\0\0\0zstd";
    let end = bytes.windows(chunk.len()).position(|found| found == chunk).expect("it has a chunk");
    let log = folder.path().join("begun.mcap");
    let mut random = asperity_testkit::Random::new(4);
    let mut verdicts: BTreeMap<String, u32> = BTreeMap::new();
    for number in 0..30 {
        let at = random.below(end as u64) as usize;
        let mut changed = bytes.clone();
        match number % 3 {
            0 => changed.truncate(at),
            1 => changed[at] ^= 1 << random.below(8),
            // Magic, MCAP's header and the run's.
            _ => changed[at % 400] ^= 1 << random.below(8),
        }
        fs::write(&log, &changed).expect("the folder can be written");
        let (_, said) = outcome(&["check", text(&log)]);
        let says = |verdict: &&String| {
            said.contains(&format!(": {verdict}: "))
                || (*verdict == "not a run log" && said.contains(&**verdict))
        };
        let verdict = table.keys().find(says).unwrap_or_else(|| panic!("no verdict: {said}")).clone();
        *verdicts.entry(verdict.clone()).or_default() += 1;
        let commands =
            ["check", "events", "summary", "export", "replay", "diff", "salvage", "report", "draw", "reduce"];
        for command in commands.iter().skip(number / 3 % each).step_by(each) {
            let out = folder.path().join(format!("{command}-{number}"));
            let words = match *command {
                "diff" => words("diff NEW FILE", &[text(&log)], text(whole)),
                command => words(form(command), &[text(&log)], text(&out)),
            };
            let arguments = arguments(&words);
            let (code, said) = outcome(&arguments);
            let of_verdict: i32 = table[&verdict]["check"].parse().expect("it is a code");
            let cell = table[&verdict][*command].split([',', ' ']).next().and_then(|code| code.parse().ok());
            // What is left of a log can also be salvaged if its first bytes alone are damaged.
            let is_left = verdict == "not a run log" && code == 0;
            let promised = cell == Some(code) || (*command == "salvage" && (code == of_verdict || is_left));
            assert!(promised, "case {number}, {verdict}: asperity {}: {code}\n{said}", arguments.join(" "));
        }
    }
    assert!(verdicts["damaged"] >= 5 && verdicts["incomplete"] >= 5, "{verdicts:?}");
}

/// Of several logs the worst counts.
#[test]
fn the_worst_of_several_logs_decides() {
    let logs = Logs::make();
    for (some, code) in [
        (&["whole", "by other code or detectors"][..], 6),
        (&["by other code or detectors", "incomplete"], 3),
        (&["incomplete", "unreadable", "whole"], 3),
        (&["unreadable", "by other code or detectors"], 1),
        (&["stopped", "whole", "incomplete"], 7),
        (&["salvaged with gaps", "stopped", "whole"], 5),
        (&["not a run log", "salvaged with gaps"], 2),
        (&["incomplete", "damaged", "not a run log", "whole"], 4),
    ] {
        let arguments: Vec<&str> =
            std::iter::once("check").chain(some.iter().map(|word| logs.of(word))).collect();
        let (found, said) = outcome(&arguments);
        assert_eq!(found, code, "{said}");
        assert_eq!(said.lines().count(), some.len(), "{said}");
    }
}

/// A stored run is reused if it is complete; otherwise a line gives the reason for repeating it.
#[test]
fn reproduce_uses_only_what_is_whole() {
    let Logs { folder, logs } = Logs::make();
    let pipeline = folder.path().join("small.toml");
    let write = |scenario: &str, set: &[&str]| {
        let run = format!("[[run]]\nname = \"small\"\nscenario = \"{scenario}\"\nset = {set:?}\n");
        fs::write(&pipeline, format!("title = \"Small\"\n{run}")).expect("the folder can be written");
    };
    write("ten-blocks", &small::SETS);
    let out = folder.path().join("out");
    let stored = out.join("runs").join("small.mcap");
    fs::create_dir_all(stored.parent().expect("it is in a folder")).expect("the folder can be written");
    let table = table();
    for (verdict, log) in logs.iter().filter(|(verdict, _)| !["stopped", "unreadable"].contains(verdict)) {
        fs::copy(log, &stored).expect("the folder can be written");
        let (code, said) = outcome(&["reproduce", text(&pipeline), "--out", text(&out)]);
        let cell = &table[*verdict]["reproduce"];
        let again = format!("small: made again: its log is {verdict}: ");
        match cell.as_str() {
            "used" => assert!(code == 0 && said.contains("1 run used again"), "{said}"),
            "made again" => {
                assert!(code == 0 && said.contains(&again), "{verdict}: {said}");
                assert!(succeed(&["check", text(&stored)]).contains(": whole: "));
            }
            "2, refused" => assert!(code == 2 && said.contains(verdict), "{said}"),
            other => panic!("the table says {other}"),
        }
    }
    // It would be stopped again.
    write("rigid-contacts", &STOPPED);
    fs::remove_file(&stored).expect("it can be removed");
    for again in [false, true] {
        let (code, said) = outcome(&["reproduce", text(&pipeline), "--out", text(&out)]);
        assert!(code == 1 && said.contains("error: run small: stopped: in step "), "{said}");
        assert_eq!(said.contains("small: made again: its log is stopped: "), again, "{said}");
    }
    assert_eq!(table["stopped"]["reproduce"], "1, made again");
}

/// A log that is consistent with itself and its scenario, and yet not of its run, is detected by
/// repeating the run.
#[test]
fn check_again_compares_every_record_with_the_run_made_again() {
    let logs = Logs::make();
    for (verdict, code) in [("whole", 0), ("incomplete", 3), ("stopped", 7), ("salvaged with gaps", 5)] {
        let (found, said) = outcome(&["check", "--again", logs.of(verdict)]);
        assert!(found == code && said.contains(verdict), "{said}");
    }
    // The load of a sample of a chain at rest, a little more than it was.
    let mut parts = take_apart(&fs::read(logs.of("whole")).expect("it was just written"));
    let at = messages(&parts, "/step")[5];
    let mut message: serde_json::Value =
        serde_json::from_slice(parts[at].payload().expect("it is a message")).expect("messages are JSON");
    let force_n = message["driving_force_n"].as_f64().expect("it is a number") + 1e-9;
    message["driving_force_n"] = force_n.into();
    message["ft_fn"] = (force_n / message["normal_load_n"].as_f64().expect("it is a number")).into();
    parts[at] = parts[at].with_payload(message.to_string().as_bytes());
    correct_end(&mut parts);
    let forged = logs.folder.path().join("forged.mcap");
    fs::write(&forged, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
    assert_eq!(outcome(&["check", text(&forged)]).0, 0);
    let (code, said) = outcome(&["check", "--again", text(&forged)]);
    assert!(code == 4 && said.contains("the run, made again, gives another record"), "{said}");
}

mod in_ci {
    #[test]
    #[ignore = "three hundred calls: cargo xtask ci"]
    fn damaged_beginnings_are_judged_alike_by_all_commands() {
        super::judge_beginnings(1);
    }
}
