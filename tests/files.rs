//! Concurrent writers: pairs of processes on one output, kills, links, hard links, files of other programs
//! under names that look like ours. One process wins or each is refused; nothing is mixed or lost, and no
//! leftovers block later runs.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use asperity_runlog::{RunReader, Topics, partial_path};
use asperity_testkit::{Random, folder, run_end};

use crate::support::binary::{as_coded, asperity, run, succeed, text};

/// The contents of a folder, recursively, by path.
fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        let name = path.file_name().expect("it has a name").to_string_lossy().into_owned();
        if path.is_dir() && !path.is_symlink() {
            let inside = content(&path).into_iter();
            found.extend(inside.map(|(below, bytes)| (format!("{name}/{below}"), bytes)));
            found.entry(format!("{name}/")).or_default();
        } else {
            found.insert(name, fs::read(&path).unwrap_or_default());
        }
    }
    found
}

/// Whether something is of a set that has no name yet.
fn is_staged(name: &str) -> bool {
    name.starts_with(".asperity-") || name.contains("/.asperity-")
}

fn start(arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_asperity"))
        .args(as_coded(arguments))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the binary starts")
}

fn end(child: Child) -> (Option<i32>, String) {
    let Output { status, stderr, .. } = child.wait_with_output().expect("it ends");
    (status.code(), String::from_utf8_lossy(&stderr).into_owned())
}

/// Runs two commands at once; the codes and words of both.
fn both(first: &[&str], second: &[&str]) -> [(Option<i32>, String); 2] {
    let (first, second) = (start(first), start(second));
    [end(first), end(second)]
}

/// Starts a command and kills it after some time; whether that came before its end.
fn kill(arguments: &[&str], after: Duration) -> bool {
    let mut child = start(arguments);
    std::thread::sleep(after);
    child.kill().expect("it can be killed, or has ended");
    !child.wait().expect("it ends").success()
}

fn refused(arguments: &[&str], code: i32, words: &[&str]) {
    let output = asperity(arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {said}");
    words.iter().for_each(|word| assert!(said.contains(word), "{arguments:?}: no {word:?} in {said}"));
}

/// A run whose log has several chunks, so that half of it has contents.
const MANY_CHUNKS: [&str; 5] =
    ["default", "--set", "recording.fields_s=0.0005", "--set", "time.duration_s=0.6"];

/// Two small logs of the same name, which differ.
fn twins(folder: &Path) -> [PathBuf; 2] {
    [("one", "0.06"), ("two", "0.1")].map(|(name, duration)| {
        fs::create_dir(folder.join(name)).expect("the folder can be written");
        let log = folder.join(name).join("run.mcap");
        let set = ["--set", "time.step_s=1e-7", "--set", &format!("time.duration_s={duration}")];
        run(&[&["default"], &set[..]].concat(), &log);
        log
    })
}

/// Lets two processes write into one folder, with and without permission to replace, and compares the
/// result with the output of each alone.
fn at_once(folder: &Path, command: &dyn Fn(usize, &str) -> Vec<String>, forced: bool) {
    let out = folder.join("both");
    let alone: Vec<_> = [0, 1]
        .into_iter()
        .map(|number| {
            let out = folder.join(format!("alone-{number}"));
            let arguments = command(number, text(&out));
            succeed(&strs(&arguments));
            content(&out)
        })
        .collect();
    assert_ne!(alone[0], alone[1]);
    for round in 0..if forced { 4 } else { 2 } {
        let replaces = round >= 2;
        if !replaces && out.exists() {
            fs::remove_dir_all(&out).expect("it can be removed");
        }
        let commands = [0, 1].map(|number| {
            let mut arguments = command(number, text(&out));
            arguments.extend(replaces.then(|| "--force".to_owned()));
            arguments
        });
        let outcomes = both(&strs(&commands[0]), &strs(&commands[1]));
        let there = content(&out);
        let winner = alone.iter().position(|alone| *alone == there);
        let winner = winner.unwrap_or_else(|| panic!("a mixture: {:?}\n{outcomes:?}", there.keys()));
        let [winners, others] = [&outcomes[winner], &outcomes[1 - winner]];
        assert_eq!(winners.0, Some(0), "{outcomes:?}");
        let of_other = if replaces { Some(0) } else { Some(2) };
        assert_eq!(others.0, of_other, "{outcomes:?}");
    }
}

fn strs(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

#[test]
fn two_exports_into_one_folder_never_mix() {
    let folder = folder();
    let logs = twins(folder.path());
    let command =
        |number: usize, out: &str| words(&["export", text(&logs[number]), "--to", "csv", "--out", out]);
    at_once(folder.path(), &command, true);
    // Formats have each a record of its own.
    let out = folder.path().join("formats");
    for format in ["csv", "ndjson"] {
        succeed(&["export", text(&logs[0]), "--to", format, "--out", text(&out)]);
    }
    let there = content(&out);
    assert!(there.contains_key("run.csv.export.json") && there.contains_key("run.ndjson.export.json"));
}

#[test]
fn two_replays_into_one_folder_never_mix() {
    let folder = folder();
    let logs = twins(folder.path());
    at_once(folder.path(), &|number, out| words(&["replay", text(&logs[number]), "--out", out]), false);
}

#[cfg(feature = "analysis")]
#[test]
fn two_reductions_into_one_folder_never_mix() {
    let folder = folder();
    let logs = twins(folder.path());
    at_once(folder.path(), &|number, out| words(&["reduce", text(&logs[number]), "--out", out]), false);
}

/// A killed export leaves the old files, the new ones, or no record of them; the next one removes its
/// leftovers.
#[test]
fn a_killed_export_is_seen_and_makes_way_for_the_next() {
    let folder = folder();
    let logs = twins(folder.path());
    let out = folder.path().join("out");
    let export =
        |log: &Path| ["export", text(log), "--to", "csv", "--force", "--out", text(&out)].map(str::to_owned);
    let alone = logs.each_ref().map(|log| {
        succeed(&strs(&export(log)));
        content(&out)
    });
    let mut random = Random::new(7);
    let (mut killed, mut left) = (0, 0);
    let mut rounds = 0;
    while killed < 20 || left < 5 {
        rounds += 1;
        let arguments = export(&logs[rounds % 2]);
        let mut child = start(&strs(&arguments));
        // At any time, or once there is something half done, however fast the machine is.
        let waits_for_files = rounds % 3 > 0;
        let began = Instant::now();
        let is_begun = || content(&out).keys().any(|name| is_staged(name));
        while waits_for_files && !is_begun() && child.try_wait().expect("it can be asked").is_none() {
            assert!(began.elapsed() < Duration::from_secs(60), "it hangs");
        }
        std::thread::sleep(Duration::from_secs_f64(random.log_uniform(1e-5, 0.05)));
        child.kill().expect("it can be killed, or has ended");
        killed += usize::from(!child.wait().expect("it ends").success());
        let (staged, named): (BTreeMap<_, _>, _) =
            content(&out).into_iter().partition(|(name, _)| is_staged(name));
        left += usize::from(!staged.is_empty());
        if named.contains_key("run.csv.export.json") {
            assert!(alone.contains(&named), "a mixture with a record: {:?}", named.keys());
        }
        assert!(named.keys().all(|name| alone[0].contains_key(name)), "{:?}", named.keys());
        assert!(rounds < 2000, "{killed} kills, {left} while files were written");
    }
    succeed(&strs(&export(&logs[0])));
    assert!(content(&out) == alone[0], "{:?}", content(&out).keys());
}

/// Each of two processes may come too late for the lock or for the name.
#[test]
fn two_runs_or_salvages_of_one_name_make_one_log() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let arguments = [&["run", "--out", text(&log)], &MANY_CHUNKS[..]].concat();
    succeed(&arguments);
    let (digest, bytes) = (run_end(&log).digest, fs::read(&log).expect("it can be read"));
    let one_wins = |arguments: &[&str]| {
        let [first, second] = both(arguments, arguments);
        let [won, lost] = if first.0 == Some(0) { [&first, &second] } else { [&second, &first] };
        assert_eq!(won.0, Some(0), "{won:?} {lost:?}");
        let is_busy = lost.0 == Some(1) && lost.1.contains("is being written by another process");
        // Before it began, or as it ended.
        let is_taken = matches!(lost.0, Some(1 | 2)) && lost.1.contains("exists already");
        let is_begun = lost.0 == Some(2) && lost.1.contains("contains an unfinished run");
        assert!(is_busy || is_taken || is_begun, "{lost:?}");
    };
    for _ in 0..3 {
        fs::remove_file(&log).expect("it can be removed");
        one_wins(&arguments);
        assert_eq!(run_end(&log).digest, digest);
        assert_eq!(content(folder.path()).keys().collect::<Vec<_>>(), ["run.mcap"]);
    }
    let damaged = folder.path().join("damaged.mcap");
    fs::write(&damaged, &bytes[..bytes.len() / 2]).expect("the folder can be written");
    let alone = folder.path().join("alone.mcap");
    succeed(&["salvage", text(&damaged), "--out", text(&alone)]);
    let out = folder.path().join("salvaged.mcap");
    for _ in 0..3 {
        one_wins(&["salvage", text(&damaged), "--out", text(&out)]);
        assert!(fs::read(&out).expect("it is there") == fs::read(&alone).expect("it is there"));
        fs::remove_file(&out).expect("it can be removed");
    }
    for wait in [0, 2, 5] {
        kill(&["salvage", text(&damaged), "--out", text(&out)], Duration::from_millis(4 * wait));
        if out.exists() {
            assert!(fs::read(&out).expect("it is there") == fs::read(&alone).expect("it is there"));
            fs::remove_file(&out).expect("it can be removed");
        }
    }
    succeed(&["salvage", text(&damaged), "--out", text(&out)]);
    assert!(!content(folder.path()).keys().any(|name| is_staged(name)));
}

/// The first run must not give its final name to the file of the second.
#[test]
fn a_run_whose_log_was_removed_leaves_that_of_the_next_alone() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let arguments =
        ["run", "default", "--solver", "plain", "--set", "time.duration_s=0.04", "--out", text(&log)];
    let partial = partial_path(&log);
    // The written part belongs to a run that has locked the file.
    let begun = || {
        while fs::metadata(&partial).map_or(0, |partial| partial.len()) == 0 {
            std::thread::sleep(Duration::from_millis(2));
        }
    };
    let first = start(&arguments);
    begun();
    fs::remove_file(&partial).expect("it can be removed");
    let second = start(&arguments);
    begun();
    let (code, said) = end(first);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("run.mcap.partial was removed or replaced while it was being written"), "{said}");
    let (code, said) = end(second);
    assert_eq!(code, Some(0), "{said}");
    assert!(run_end(&log).digest.len() == 64 && !partial.exists());
}

#[test]
fn salvage_loses_neither_its_input_nor_an_unfinished_run() {
    let folder = folder();
    let log = folder.path().join("r.mcap");
    run(&MANY_CHUNKS, &log);
    let bytes = fs::read(&log).expect("it can be read");
    let half = &bytes[..bytes.len() / 2];
    // The unfinished log of a name is salvaged to that name.
    fs::rename(&log, partial_path(&log)).expect("files can be renamed");
    fs::write(partial_path(&log), half).expect("the folder can be written");
    let said = succeed(&["salvage", text(&partial_path(&log)), "--out", text(&log)]);
    assert!(fs::read(partial_path(&log)).expect("it is there") == half);
    let mut reader = RunReader::open(&log, Topics::ALL).expect("it is a run log");
    let mut items = 0;
    while let Ok(Some(_)) = reader.next_item() {
        items += 1;
    }
    assert!(items > 100 && said.contains(" messages salvaged"), "{items}: {said}");
    // A file from which a run can resume is kept, whatever is salvaged beside it.
    let other = folder.path().join("z.mcap");
    fs::write(partial_path(&other), "the only hours").expect("the folder can be written");
    succeed(&["salvage", text(&partial_path(&log)), "--out", text(&other)]);
    assert_eq!(fs::read(partial_path(&other)).expect("it is there"), b"the only hours");
    // And no name of the input is overwritten.
    let damaged = folder.path().join("d.mcap");
    fs::write(&damaged, half).expect("the folder can be written");
    for out in [damaged.clone(), partial_path(&damaged)] {
        refused(&["salvage", text(&damaged), "--out", text(&out)], 2, &["(accepted: "]);
    }
    assert!(fs::read(&damaged).expect("it is there") == half && !partial_path(&damaged).exists());
}

#[cfg(all(unix, feature = "analysis"))]
#[test]
fn a_diff_writes_over_no_input_by_whatever_name() {
    let folder = folder();
    let [old, new] = twins(folder.path());
    let path = |name: &str| folder.path().join(name);
    fs::hard_link(&old, path("hard.html")).expect("files can have two names");
    std::os::unix::fs::symlink(&new, path("link.html")).expect("links can be made");
    fs::write(path("policy.toml"), "window_s = 1e-3\n").expect("the folder can be written");
    let before = content(folder.path());
    let outputs = [
        old.clone(),
        new.clone(),
        path("hard.html"),
        path("link.html"),
        path("policy.toml"),
        partial_path(&old),
    ];
    for option in ["--page", "--matches", "--draft-policy"] {
        for output in &outputs {
            let given = [
                "diff",
                text(&old),
                text(&new),
                "--policy",
                text(&path("policy.toml")),
                option,
                text(output),
            ]
            .map(str::to_owned);
            refused(&[&strs(&given)[..], &["--force"]].concat(), 2, &["(accepted: another file)"]);
        }
        // Files of a folder are inputs as well.
        let folders = [path("one"), path("two")];
        let given = ["diff", text(&folders[0]), text(&folders[1]), option, text(&old), "--force"];
        refused(&given, 2, &["which this command reads (accepted: another file)"]);
    }
    // Two outputs of one name are refused before anything is read.
    let (page, around) = (path("x"), path("one/../x"));
    let twice = ["diff", "no.mcap", "none.mcap", "--page", text(&page), "--matches", text(&around)];
    refused(&twice, 2, &["--matches", "are the same file, and both would be written"]);
    assert!(content(folder.path()) == before);
}

#[cfg(feature = "analysis")]
#[test]
fn two_diffs_write_whole_pages() {
    let folder = folder();
    let [old, new] = twins(folder.path());
    let page = folder.path().join("page.html");
    // Other programs may call their files so.
    let foreign =
        [partial_path(&page), folder.path().join(".asperity-notes"), folder.path().join("matches.partial")];
    foreign.iter().for_each(|path| fs::write(path, "mine").expect("the folder can be written"));
    let diff = |old: &Path, new: &Path, out: &Path| {
        ["diff", text(old), text(new), "--force", "--page", text(out)].map(str::to_owned)
    };
    let sides = [[&old, &new], [&new, &old]];
    let alone = sides.map(|[old, new]| {
        let arguments = diff(old, new, &page);
        assert_eq!(asperity(&strs(&arguments)).status.code(), Some(1));
        fs::read(&page).expect("it is there")
    });
    for round in 0..8 {
        let [first, second] = sides.map(|[old, new]| diff(old, new, &page));
        let (first, second) = (strs(&first), strs(&second));
        if round % 2 == 0 {
            let outcomes = both(&first, &second);
            assert!(outcomes.iter().all(|(code, _)| *code == Some(1)), "{outcomes:?}");
        } else {
            kill(&first, Duration::from_millis(3 * round));
        }
        assert!(alone.contains(&fs::read(&page).expect("it is there")), "a page of two");
    }
    // Without leave to replace it, only one can have made it.
    fs::remove_file(&page).expect("it can be removed");
    let plain = ["diff", text(&old), text(&new), "--page", text(&page)];
    let mut codes = both(&plain, &plain).map(|(code, _)| code);
    codes.sort_unstable();
    assert_eq!(codes, [Some(1), Some(2)]);
    assert!(fs::read(&page).expect("it is there") == alone[0]);
    for path in &foreign {
        assert_eq!(fs::read(path).expect("it is there"), b"mine");
    }
    assert!(!content(folder.path()).keys().any(|name| name.starts_with(".asperity-") && name.contains('/')));
}

#[cfg(unix)]
#[test]
fn links_in_the_place_of_outputs_are_not_followed() {
    use std::os::unix::fs::symlink;
    let folder = folder();
    let [log, _] = twins(folder.path());
    let path = |name: &str| folder.path().join(name);
    fs::write(path("mine"), "mine").expect("the folder can be written");
    fs::create_dir(path("out")).expect("the folder can be written");
    symlink(path("mine"), path("out/run.step.csv")).expect("links can be made");
    symlink(path("nowhere"), path("dangling.mcap")).expect("links can be made");
    symlink(path("mine"), path("other.mcap.partial")).expect("links can be made");
    symlink(path("out"), path("through")).expect("links can be made");

    let export = ["export", text(&log), "--to", "csv", "--topic", "/step", "--out"];
    for out in ["out", "through"] {
        refused(&[&export[..], &[text(&path(out))]].concat(), 2, &["run.step.csv exists already", "--force"]);
    }
    // Links among the folders are followed; that of the file itself is replaced.
    succeed(&[&export[..], &[text(&path("through")), "--force"]].concat());
    assert!(fs::symlink_metadata(path("out/run.step.csv")).expect("it is there").is_file());

    let run = |out: &str| {
        ["run", "default", "--set", "time.duration_s=0.01", "--out", text(&path(out))].map(str::to_owned)
    };
    let dangling = run("dangling.mcap");
    refused(&strs(&dangling), 2, &["dangling.mcap exists already"]);
    refused(&["salvage", text(&path("mine")), "--out", text(&path("dangling.mcap"))], 2, &["not a run log"]);
    let other = run("other.mcap");
    let other = strs(&other);
    refused(&other, 2, &["other.mcap.partial is a link"]);
    refused(&[&other[..], &["--resume"]].concat(), 2, &["other.mcap.partial is a link"]);
    assert_eq!(fs::read(path("mine")).expect("it is there"), b"mine");
    assert!(!path("nowhere").exists());
}

#[test]
fn what_is_no_log_is_not_written_over_as_an_unfinished_one() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let foreign = partial_path(&log);
    for notes in ["what I measured on Monday", "no"] {
        fs::write(&foreign, notes).expect("the folder can be written");
        let run = ["run", "default", "--set", "time.duration_s=0.01", "--out", text(&log)];
        for further in [&[][..], &["--resume"]] {
            let said = ["run.mcap.partial: not a run log", "it is not replaced"];
            refused(&[&run[..], further].concat(), 2, &said);
        }
        assert_eq!(fs::read_to_string(&foreign).expect("it is there"), notes);
        assert_eq!(content(folder.path()).len(), 1);
    }
}

/// Too few open files are reported as such, not as the work of another process, and nothing is
/// left.
#[cfg(unix)]
#[test]
fn too_few_open_files_are_called_so() {
    let folder = folder();
    let [log, _] = twins(folder.path());
    let out = folder.path().join("out");
    let command =
        format!("ulimit -n 8; exec \"$ASPERITY\" export {} --to csv --out {}", text(&log), text(&out));
    let output = Command::new("sh")
        .args(["-c", &command])
        .env("ASPERITY", env!("CARGO_BIN_EXE_asperity"))
        .output()
        .expect("there is a shell");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("Too many open files") && !said.contains("another process"), "{said}");
    assert!(!out.exists(), "a folder without tables");
}

#[cfg(feature = "analysis")]
const PIPELINE: &str = r#"
title = "Small"
[[run]]
name = "one"
scenario = "ten-blocks"
set = ["parameter_set=as-coded", "time.step_s=1e-7", "time.duration_s=0.3"]
"#;

#[cfg(feature = "analysis")]
#[test]
fn one_pipeline_at_a_time_writes_into_a_folder() {
    let folder = folder();
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    fs::write(&pipeline, PIPELINE).expect("the folder can be written");
    let slow = ["reproduce", text(&pipeline), "--out", text(&out), "--solver", "plain"];
    let first = start(&slow);
    while !out.join("runs/one.mcap.partial").exists() {
        std::thread::sleep(Duration::from_millis(2));
    }
    refused(&slow, 1, &["out is being written by another process"]);
    assert_eq!(end(first).0, Some(0));
    let whole = content(&out);
    assert!(!whole.keys().any(|name| name.contains(".asperity")), "{:?}", whole.keys());
    // Leftovers of a killed process block nobody.
    for wait in 0..5 {
        kill(&[&slow[..], &["--fresh"]].concat(), Duration::from_millis(30 * wait));
    }
    succeed(&[&slow[..], &["--fresh"]].concat());
    assert!(content(&out).keys().eq(whole.keys()), "{:?}", content(&out).keys());
}

#[cfg(feature = "analysis")]
#[test]
fn a_pipeline_replaces_no_run_of_another_scenario_unless_told() {
    let folder = folder();
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    fs::write(&pipeline, PIPELINE).expect("the folder can be written");
    let reproduce = ["reproduce", text(&pipeline), "--out", text(&out)];
    succeed(&reproduce);
    let before = content(&out);
    let other = [&reproduce[..], &["--set", "time.duration_s=0.2"]].concat();
    refused(&other, 2, &["one.mcap is of another scenario, ", "it is not replaced", "or --fresh"]);
    let plain = [&reproduce[..], &["--solver", "plain"]].concat();
    refused(&plain, 2, &["one.mcap is of another solver, fast", "--fresh"]);
    // Nor do unfinished files of one.
    let log = out.join("runs/one.mcap");
    fs::rename(&log, partial_path(&log)).expect("files can be renamed");
    refused(&other, 2, &["one.mcap.partial is of another scenario, "]);
    fs::rename(partial_path(&log), &log).expect("files can be renamed");
    assert!(content(&out) == before);
    succeed(&[&other[..], &["--fresh"]].concat());
    assert!(content(&out) != before);
}

/// A log of version 2 of the format is by other code than the present one.
#[cfg(feature = "analysis")]
#[test]
fn a_run_by_other_code_is_made_again_and_this_is_said() {
    let folder = folder();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/v2/complete.mcap");
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    let wanted = format!("title = \"Old\"\n[[run]]\nname = \"old\"\nscenario = {:?}\n", text(&fixture));
    fs::write(&pipeline, wanted).expect("the folder can be written");
    fs::create_dir_all(out.join("runs")).expect("the folder can be written");
    fs::copy(&fixture, out.join("runs/old.mcap")).expect("the folder can be written");
    let output = asperity(&["reproduce", text(&pipeline), "--out", text(&out)]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("old: made again: its log is by other code or detectors: ")
            && said.contains(", by code version "),
        "{said}"
    );
}

/// Figures may have any names, as long as none overwrites another, or the pipeline.
#[cfg(feature = "analysis")]
#[test]
fn names_of_a_pipeline_that_collide_are_refused_before_it_runs() {
    let folder = folder();
    let out = folder.path().join("out");
    let figure = |file: &str| format!("[[figure.load]]\nfile = \"{file}\"\nrun = \"one\"\nsliding = true\n");
    let precursors = "[[precursors]]\nrun = \"one\"\nlaw = \"eq-5.22\"\n";
    let pipeline = folder.path().join("pipeline.toml");
    for (further, name) in [
        (figure("load.png").repeat(2), "figure file \"load.png\""),
        (precursors.repeat(2), "table \"one.precursors-eq-5.22\""),
    ] {
        fs::write(&pipeline, PIPELINE.to_owned() + &further).expect("the folder can be written");
        let reproduce = ["reproduce", text(&pipeline), "--out", text(&out)];
        refused(&reproduce, 2, &[name, "twice"]);
        assert!(!out.exists());
    }
    fs::write(&pipeline, PIPELINE.to_owned() + &figure("load.svg")).expect("the folder can be written");
    refused(
        &["reproduce", text(&pipeline), "--out", text(&out)],
        2,
        &["figure file \"load.svg\"", "(accepted: NAME.png, beside which NAME.svg and NAME.pdf stand)"],
    );
    let inside = out.join("figures/pipeline.png");
    fs::create_dir_all(out.join("figures")).expect("the folder can be written");
    fs::write(&inside, PIPELINE.to_owned() + &figure("pipeline.png")).expect("the folder can be written");
    refused(
        &["reproduce", text(&inside), "--out", text(&out)],
        2,
        &["pipeline.png", "(accepted: another file)"],
    );
    assert!(!out.join("runs").exists(), "refused before anything runs");
}
