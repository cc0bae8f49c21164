//! Files of other programs and processes, links and hard links in the place of outputs: nothing is lost. The
//! attacks `pairs` and `kills` have two processes write the same files, and kill them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use asperity_runlog::{RunReader, Topics, partial_path};
use asperity_testkit::{folder, run_end};

use crate::support::binary::{as_coded, ends, run, succeed, text};

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
        ends(2, &["salvage", text(&damaged), "--out", text(&out)], &["(accepted: "]);
    }
    assert!(fs::read(&damaged).expect("it is there") == half && !partial_path(&damaged).exists());
}

#[cfg(unix)]
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
            let policy = path("policy.toml");
            let given =
                ["diff", text(&old), text(&new), "--policy", text(&policy), option, text(output), "--force"];
            ends(2, &given, &["(accepted: another file)"]);
        }
        // Files of a folder are inputs as well.
        let folders = [path("one"), path("two")];
        let given = ["diff", text(&folders[0]), text(&folders[1]), option, text(&old), "--force"];
        ends(2, &given, &["which this command reads (accepted: another file)"]);
    }
    // Two outputs of one name are refused before anything is read.
    let (page, around) = (path("x"), path("one/../x"));
    let twice = ["diff", "no.mcap", "none.mcap", "--page", text(&page), "--matches", text(&around)];
    ends(2, &twice, &["--matches", "are the same file, and both would be written"]);
    assert!(content(folder.path()) == before);
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
        ends(2, &[&export[..], &[text(&path(out))]].concat(), &["run.step.csv exists already", "--force"]);
    }
    // Links among the folders are followed; that of the file itself is replaced.
    succeed(&[&export[..], &[text(&path("through")), "--force"]].concat());
    assert!(fs::symlink_metadata(path("out/run.step.csv")).expect("it is there").is_file());

    let (dangling, other) = (path("dangling.mcap"), path("other.mcap"));
    let run = ["run", "default", "--set", "time.duration_s=0.01", "--out"];
    ends(2, &[&run[..], &[text(&dangling)]].concat(), &["dangling.mcap exists already"]);
    ends(2, &["salvage", text(&path("mine")), "--out", text(&dangling)], &["not a run log"]);
    for more in [&[][..], &["--resume"]] {
        ends(2, &[&run[..], &[text(&other)], more].concat(), &["other.mcap.partial is a link"]);
    }
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
            ends(2, &[&run[..], further].concat(), &said);
        }
        assert_eq!(fs::read_to_string(&foreign).expect("it is there"), notes);
        assert_eq!(content(folder.path()).len(), 1);
    }
}

const PIPELINE: &str = r#"
title = "Small"
[[run]]
name = "one"
scenario = "ten-blocks"
set = ["parameter_set=as-coded", "time.step_s=1e-7", "time.duration_s=0.3"]
"#;

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
    ends(1, &slow, &["out is being written by another process"]);
    assert_eq!(end(first).0, Some(0));
    let whole = content(&out);
    assert!(!whole.keys().any(|name| name.contains(".asperity")), "{:?}", whole.keys());
    succeed(&[&slow[..], &["--fresh"]].concat());
    assert!(content(&out).keys().eq(whole.keys()), "{:?}", content(&out).keys());
}

#[test]
fn a_pipeline_replaces_no_run_of_another_scenario_unless_told() {
    let folder = folder();
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    fs::write(&pipeline, PIPELINE).expect("the folder can be written");
    let reproduce = ["reproduce", text(&pipeline), "--out", text(&out)];
    succeed(&reproduce);
    let before = content(&out);
    let other = [&reproduce[..], &["--set", "time.duration_s=0.2"]].concat();
    ends(2, &other, &["one.mcap is of another scenario, ", "it is not replaced", "or --fresh"]);
    let plain = [&reproduce[..], &["--solver", "plain"]].concat();
    ends(2, &plain, &["one.mcap is of another solver, fast", "--fresh"]);
    // Nor do unfinished files of one.
    let log = out.join("runs/one.mcap");
    fs::rename(&log, partial_path(&log)).expect("files can be renamed");
    ends(2, &other, &["one.mcap.partial is of another scenario, "]);
    fs::rename(partial_path(&log), &log).expect("files can be renamed");
    assert!(content(&out) == before);
    succeed(&[&other[..], &["--fresh"]].concat());
    assert!(content(&out) != before);
}

#[test]
fn a_run_by_other_code_is_made_again_and_this_is_said() {
    let folder = folder();
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/complete.mcap");
    let (pipeline, out) = (folder.path().join("pipeline.toml"), folder.path().join("out"));
    let wanted = format!("title = \"Old\"\n[[run]]\nname = \"old\"\nscenario = {:?}\n", text(&fixture));
    fs::write(&pipeline, wanted).expect("the folder can be written");
    fs::create_dir_all(out.join("runs")).expect("the folder can be written");
    fs::copy(&fixture, out.join("runs/old.mcap")).expect("the folder can be written");
    let said = ["old: made again: its log is by other code or detectors: ", ", by code version "];
    ends(0, &["reproduce", text(&pipeline), "--out", text(&out)], &said);
}

/// Figures may have any names, as long as none overwrites another, or the pipeline.
#[test]
fn names_of_a_pipeline_that_collide_are_refused_before_it_runs() {
    let folder = folder();
    let out = folder.path().join("out");
    let figure = |file: &str| format!("[[figure.load]]\nfile = \"{file}\"\nrun = \"one\"\nsliding = true\n");
    let precursors = "[[precursors]]\nrun = \"one\"\nlaw = \"tilted\"\n";
    let pipeline = folder.path().join("pipeline.toml");
    for (further, name) in [
        (figure("load.png").repeat(2), "figure file \"load.png\""),
        (precursors.repeat(2), "table \"one.precursors-tilted\""),
    ] {
        fs::write(&pipeline, PIPELINE.to_owned() + &further).expect("the folder can be written");
        let reproduce = ["reproduce", text(&pipeline), "--out", text(&out)];
        ends(2, &reproduce, &[name, "twice"]);
        assert!(!out.exists());
    }
    fs::write(&pipeline, PIPELINE.to_owned() + &figure("load.svg")).expect("the folder can be written");
    ends(
        2,
        &["reproduce", text(&pipeline), "--out", text(&out)],
        &["figure file \"load.svg\"", "(accepted: NAME.png, beside which NAME.svg and NAME.pdf stand)"],
    );
    let inside = out.join("figures/pipeline.png");
    fs::create_dir_all(out.join("figures")).expect("the folder can be written");
    fs::write(&inside, PIPELINE.to_owned() + &figure("pipeline.png")).expect("the folder can be written");
    ends(
        2,
        &["reproduce", text(&inside), "--out", text(&out)],
        &["pipeline.png", "(accepted: another file)"],
    );
    assert!(!out.join("runs").exists(), "refused before anything runs");
}
