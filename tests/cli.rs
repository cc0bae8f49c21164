//! Messages and exit codes of the command: 0 for success, 1 for failures, 2 for bad input, after which
//! nothing is written.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::support::binary::{ends, outcome, rows, succeed, text, with_sets};
use crate::support::{binary, small};
use asperity_testkit::folder;

/// Runs the binary, which must exit with `code` and print nothing on stdout; returns its stderr.
#[track_caller]
fn fail(arguments: &[&str], code: i32) -> String {
    let (found, stdout, stderr) = outcome(arguments);
    assert_eq!(found, code, "asperity {}\n{stderr}", arguments.join(" "));
    assert_eq!(stdout, "", "stdout is for results");
    assert!(stderr.starts_with("error: "), "{stderr}");
    stderr
}

/// The help of every command, by its words, as it reads in a terminal of that width.
fn help_of_all(columns: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut commands: Vec<Vec<String>> = vec![Vec::new()];
    while let Some(command) = commands.pop() {
        let output = Command::new(env!("CARGO_BIN_EXE_asperity"))
            .args(&command)
            .arg("--help")
            .env("COLUMNS", columns)
            .stdin(Stdio::null())
            .output()
            .expect("the binary starts");
        assert!(output.status.success(), "{command:?}");
        let help = String::from_utf8(output.stdout).expect("the binary writes UTF-8");
        let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
        let names = below.take_while(|line| !line.is_empty()).filter_map(|line| {
            // Lines that are indented further continue the description of a command.
            line.strip_prefix("  ").filter(|line| !line.starts_with(' '))?.split(' ').next()
        });
        commands.extend(names.filter(|name| *name != "help").map(|name| {
            let name = name.to_owned();
            command.iter().cloned().chain([name]).collect()
        }));
        found.push((command.join(" "), help));
    }
    found
}

#[test]
fn every_command_has_help() {
    let helps = help_of_all("80");
    assert!(helps.len() > 25, "{helps:?}");
    for (command, help) in &helps {
        assert!(help.contains(&format!("Usage: asperity {command}")), "{help}");
        let has_out = help.contains("--out <");
        assert!(!has_out || help.contains("-o, --out <"), "{command}: --out is -o everywhere");
        assert!(help.contains("-q, --quiet"), "{help}");
    }
    assert!(succeed(&["--version"]).starts_with("asperity "));
}

/// The notices need no command. `cargo xtask ci licences` compares them with the packages.
#[test]
fn notices_name_what_the_command_contains() {
    let notices = succeed(&["--notices"]);
    for line in ["polars 0.", "zstd-sys 2.", "DejaVu Sans 2.37: Bitstream-Vera, ", "uPlot 1.6.32: MIT, "] {
        assert!(notices.contains(&format!("\n{line}")), "{line}");
    }
    assert_eq!(succeed(&["--notices", "scenario", "list"]), notices);
}

/// The text below the options has manual line breaks. A line that is too long would be broken again, with a
/// few words alone on the next.
#[test]
fn help_fits_into_80_columns() {
    let below_options = |help: &str| help.find("\nExamples:\n").map(|start| help[start..].to_owned());
    for ((command, at_80), (_, at_100)) in help_of_all("80").into_iter().zip(help_of_all("100")) {
        let long = at_80.lines().find(|line| line.chars().count() > 80);
        assert_eq!(long, None, "asperity {command} --help");
        assert_eq!(below_options(&at_80), below_options(&at_100), "asperity {command} --help");
    }
}

/// The repository ignores `out`, so trying the examples in it changes nothing.
#[test]
fn examples_write_into_out_or_the_home_folder() {
    const WRITES: [&str; 6] = ["-o", "--out", ">", "--page", "--matches", "--draft-policy"];
    let mut checked = 0;
    for (command, help) in help_of_all("80") {
        for line in help.lines().filter(|line| line.starts_with("  asperity ")) {
            let words: Vec<&str> = line.split_whitespace().collect();
            for pair in words.windows(2).filter(|pair| WRITES.contains(&pair[0])) {
                let is_well_put = pair[1].starts_with("out/") || pair[1].starts_with("~/");
                assert!(is_well_put, "asperity {command} --help: {line}");
                checked += 1;
            }
        }
    }
    assert!(checked > 10, "only {checked} examples were found that write something");
}

#[test]
fn quiet_leaves_errors_results_and_what_was_asked_for() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let run = |flags: &[&str], log: &Path| {
        let short = ["run", "default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.01"];
        let (code, _, said) = outcome(&[&short[..], &["-o", text(log)], flags].concat());
        (code, said)
    };
    let (code, said) = run(&[], &folder.path().join("loud.mcap"));
    assert!(code == 0 && said.contains("default: 0.01 s simulated"), "{said}");
    assert_eq!(run(&["--quiet"], &log), (0, String::new()));
    let (code, said) = run(&["-q"], &log);
    assert!(code == 2 && said.starts_with("error: ") && said.contains("exists already"), "{said}");
    let (code, said) = run(&["-q", "--stats"], &folder.path().join("stats.mcap"));
    assert!(code == 0 && !said.is_empty() && !said.contains("simulated"), "{said}");
    assert!(succeed(&["-q", "check", text(&log)]).contains(": whole: "));
}

#[test]
fn completion_scripts_complete() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = succeed(&["completions", shell]);
        assert!(script.contains("salvage") && script.contains("quiet"), "{shell}: {script}");
    }
    let folder = folder();
    let script = folder.path().join("asperity.bash");
    fs::write(&script, succeed(&["completions", "bash"])).expect("the folder can be written");
    let completed = Command::new("bash")
        .args([
            "-c",
            "source \"$0\"; COMP_WORDS=(asperity sal); COMP_CWORD=1; _asperity asperity sal; echo $COMPREPLY",
        ])
        .arg(&script)
        .output()
        .expect("bash starts");
    assert_eq!(String::from_utf8_lossy(&completed.stdout), "salvage\n", "{completed:?}");
}

#[test]
fn every_command_has_a_manual_page() {
    let folder = folder();
    let pages = folder.path().join("man1");
    let said = succeed(&["man", "-o", text(&pages)]);
    let commands = help_of_all("80");
    assert_eq!(said.lines().count(), commands.len(), "{said}");
    for (command, _) in &commands {
        let name = format!("asperity {command}").trim_end().replace(' ', "-");
        let page = fs::read_to_string(pages.join(format!("{name}.1"))).expect("the page is there");
        assert!(page.contains(&format!(".TH {name} 1")), "{page}");
        assert!(page.contains(".SH SYNOPSIS") && page.contains("quiet"), "{page}");
        assert_eq!(page.matches(".SH \"EXIT CODES\"\n").count(), 1, "{page}");
    }
    let page = fs::read_to_string(pages.join("asperity-diff.1")).expect("the page is there");
    // Examples line by line, prose as running text.
    assert!(page.contains(".SH EXAMPLES\n.nf\n  asperity diff out/before.mcap"), "{page}");
    assert!(page.contains("\n.fi\n"), "{page}");

    fs::write(pages.join("asperity-run.1"), "mine").expect("the folder can be written");
    let stderr = fail(&["man", "-o", text(&pages)], 2);
    assert!(stderr.contains("exists already") && stderr.contains("--force"), "{stderr}");
    assert_eq!(fs::read_to_string(pages.join("asperity-run.1")).unwrap(), "mine");
    succeed(&["man", "-o", text(&pages), "--force"]);
    assert!(fs::read_to_string(pages.join("asperity-run.1")).unwrap().contains(".TH asperity-run 1"));
}

/// The first signal closes the log, which is marked as interrupted and never gets its final name.
#[cfg(unix)]
#[test]
fn signals_close_the_log_soundly() {
    for (signal, code) in [("-INT", 130), ("-TERM", 143)] {
        let folder = folder();
        let log = folder.path().join("run.mcap");
        let mut child = Command::new(env!("CARGO_BIN_EXE_asperity"))
            .args(["run", "default", "--solver", "plain", "--out", text(&log)])
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary starts");
        let partial = folder.path().join("run.mcap.partial");
        while !partial.exists() {
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        std::thread::sleep(std::time::Duration::from_millis(300));
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.expect("there is a kill").success());
        assert_eq!(child.wait().expect("it ends").code(), Some(code));
        let mut said = String::new();
        std::io::Read::read_to_string(&mut child.stderr.take().unwrap(), &mut said).unwrap();
        assert!(said.contains("default: interrupted; ") && !said.contains("error"), "{said}");
        assert!(!log.exists());
        let (code, said, _) = outcome(&["check", text(&partial)]);
        assert!(code == 3 && said.contains(": incomplete: "), "{said}");
        assert!(said.contains("the run was interrupted after step"), "{said}");
        assert!(fail(&["replay", text(&partial)], 3).contains("the run was interrupted after step"));
    }
}

#[test]
fn many_runs_are_replayed_at_once_to_tables_of_their_own() {
    let folder = folder();
    let logs: Vec<_> = ["0.06", "0.08", "0.1"]
        .map(|duration| {
            let log = folder.path().join(format!("run-{duration}.mcap"));
            let set = format!("time.duration_s={duration}");
            binary::run(&["default", "--set", "time.step_s=1e-7", "--set", &set], &log);
            log
        })
        .to_vec();
    let out = folder.path().join("replayed");
    let paths: Vec<&str> = logs.iter().map(|log| text(log)).collect();
    let said = succeed(&[&["replay"], &paths[..], &["--out", text(&out)]].concat());
    assert_eq!(said.lines().filter(|line| line.ends_with("the same as logged")).count(), 3, "{said}");
    for log in &logs {
        let name = log.file_stem().unwrap().to_string_lossy();
        let table = fs::read_to_string(out.join(format!("{name}.events.csv"))).unwrap();
        assert_eq!(table, succeed(&["events", text(log)]));
        assert!(table.lines().count() > 1, "{table}");
    }
    // Nothing is overwritten; one table is of one run.
    assert!(fail(&["replay", paths[0], "--out", text(&out)], 2).contains("not an empty folder"));
    let new = folder.path().join("new");
    assert!(
        fail(&["replay", paths[0], paths[0], "--out", text(&new)], 2).contains("second run with the name")
    );
    assert!(!new.exists());
    assert!(fail(&["replay", paths[0], paths[1], "--format", "csv"], 2).contains("--format prints"));
    // An unreadable file does not prevent the others.
    let damaged = folder.path().join("damaged.mcap");
    fs::write(&damaged, "no log").unwrap();
    let (code, said, _) = outcome(&["replay", text(&damaged), paths[1]]);
    assert!(code == 2 && said.contains("the same as logged"), "{said}");
}

/// Merging and leaving out, done again on the raw table: a table of intervals.
#[test]
fn a_replay_by_other_settings_gives_their_events_and_says_so() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    binary::run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.5"], &log);
    let settings = folder.path().join("settings.toml");
    fs::write(&settings, "detectors = [\"extent\", \"onset\"]\nmerge_gap_s = 1e-3\nmin_blocks = 3\n")
        .unwrap();
    let (raw, merged) = (folder.path().join("raw"), folder.path().join("merged"));
    let rows = |table: &Path| rows(&fs::read(table).expect("the table is there"));
    succeed(&["replay", text(&log), "--out", text(&raw)]);
    let said = succeed(&["replay", text(&log), "--out", text(&merged), "--detectors", text(&settings)]);
    assert!(said.contains("by the settings given"), "{said}");

    let number =
        |row: &std::collections::BTreeMap<String, String>, column: &str| row[column].parse::<f64>().unwrap();
    let mut expected: Vec<[f64; 6]> = Vec::new();
    let columns = ["onset_s", "end_s", "first_block", "last_block", "max_sliding", "ft_fn_onset"];
    for row in rows(&raw.join("run.events.csv")) {
        let [onset_s, end_s, first, last, most, load] = columns.map(|column| number(&row, column));
        match expected.last_mut() {
            Some(event) if onset_s - event[1] <= 1e-3 => {
                *event =
                    [event[0], end_s, event[2].min(first), event[3].max(last), event[4].max(most), event[5]];
            }
            _ => expected.push([onset_s, end_s, first, last, most, load]),
        }
    }
    let all = rows(&raw.join("run.events.csv")).len();
    assert!(expected.len() < all, "nothing to merge");
    let found = rows(&merged.join("run.events.csv"));
    // Blocks that slid are contiguous here, so first and last give their number.
    expected.retain(|event| event[3] - event[2] + 1.0 >= 3.0);
    assert!(!expected.is_empty() && found.len() == expected.len(), "{} of {all}", found.len());
    for (number_of, (row, event)) in found.iter().zip(&expected).enumerate() {
        assert_eq!(columns.map(|column| number(row, column)), *event);
        assert_eq!(number(row, "event"), number_of as f64);
    }
    let onsets = rows(&merged.join("run.onsets.csv"));
    assert_eq!(onsets.len(), found.len());
    assert!(onsets.iter().zip(&found).all(|(onset, event)| onset["onset_step"] == event["onset_step"]));
    assert!(!merged.join("run.global-slips.csv").exists() && raw.join("run.global-slips.csv").exists());

    let record: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(merged.join("replay.json")).unwrap()).unwrap();
    assert_eq!(
        record["settings"],
        serde_json::json!({
            "detectors": ["onset", "extent"],
            "merge_gap_s": 1e-3,
            "min_blocks": 3,
            "link_time_ratio": null
        })
    );
    assert_eq!(record["runs"][0]["same_as_logged"], serde_json::Value::Null);
    assert_eq!(record["runs"][0]["slip_events"], found.len());

    fs::write(&settings, "# mine\nmerge_gap_s = -1\n").unwrap();
    let said = fail(&["replay", text(&log), "--detectors", text(&settings)], 2);
    assert!(
        said.contains("settings.toml:2:15: merge_gap_s = -1 (accepted: a number of seconds from 0)"),
        "{said}"
    );
}

#[test]
fn a_load_that_is_never_reached_is_told() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    let sets = ["time.duration_s=0.01", "drive.until_load_ratio=0.5"];
    let run = with_sets(&["run", "default", "--out", text(&log)], &sets);
    ends(0, &run, &["default: F_T/F_N never reached 0.5 (drive.until_load_ratio)"]);
    assert_eq!(asperity_testkit::run_end(&log).status, asperity_record::RunStatus::LoadNotReached);
}

#[test]
fn a_missing_folder_is_created_for_what_is_written_into_it() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let (log, page) = (path("no/such/run.mcap"), path("nor/this/page.html"));
    for refused in [["salvage", "damaged.mcap"], ["report", "none.mcap"], ["run", "defualt"]] {
        fail(&[&refused[..], &["--out", text(&log.with_extension(""))]].concat(), 2);
    }
    let left = fs::read_dir(folder.path()).expect("the folder is there").count();
    assert_eq!(left, 0, "where nothing is written, no folder is left");
    small::run(&log);
    succeed(&["report", text(&log), "--out", text(&page)]);
    assert!(log.is_file() && page.is_file());
    let stderr = fail(&["run", "ten-blocks", "--out", text(&page.join("run.mcap"))], 2);
    assert!(
        stderr.contains("run.mcap.partial is in a folder that is a file (accepted: another file)"),
        "{stderr}"
    );
}

#[test]
fn reduce_does_not_write_into_a_folder_in_use() {
    let folder = folder();
    let log = folder.path().join("run.mcap");
    fs::write(&log, "").expect("the folder can be written");
    let stderr = fail(&["reduce", text(&log), "--out", text(folder.path())], 2);
    assert!(stderr.contains("not an empty folder"), "{stderr}");
}

/// It asked for a new folder each time.
#[test]
fn reduce_replaces_its_own_files_with_force_alone() {
    let folder = folder();
    let [log, out] = ["run.mcap", "reduced"].map(|name| folder.path().join(name));
    crate::support::small::run(&log);
    succeed(&["reduce", text(&log), "-o", text(&out), "--quiet"]);
    let table = fs::read(out.join("events.csv")).expect("it was just written");
    for (name, content) in [("events.csv", "old"), ("mine.txt", "mine"), ("what-is-missing.txt", "half")] {
        fs::write(out.join(name), content).expect("the folder is ours");
    }
    fail(&["reduce", text(&log), "-o", text(&out)], 2);
    succeed(&["reduce", text(&log), "-o", text(&out), "--quiet", "--force"]);
    assert!(fs::read(out.join("events.csv")).expect("it is there") == table);
    assert_eq!(fs::read(out.join("mine.txt")).expect("it stays"), b"mine");
    assert!(!out.join("what-is-missing.txt").exists(), "it is of another log");
}

/// Both printed, and refused -o.
#[test]
fn tables_on_standard_output_go_to_a_file_on_request() {
    let folder = folder();
    let [log, out] = ["run.mcap", "out"].map(|name| folder.path().join(name));
    crate::support::small::run(&log);
    for command in ["events", "events --format json", "catalogue", "catalogue --format statistics"] {
        let words: Vec<&str> = command.split(' ').chain([text(&log)]).collect();
        let printed = succeed(&words);
        let to_file = [&words[..], &["-o", text(&out)]].concat();
        assert_eq!(succeed(&to_file).trim_end(), text(&out));
        assert!(fs::read_to_string(&out).expect("it is there") == printed, "{command}");
        assert!(fail(&to_file, 2).contains("exists already (accepted: another file, or --force)"));
        succeed(&[&to_file[..], &["--force"]].concat());
        fs::remove_file(&out).expect("it is ours");
    }
    let onto_itself = fail(&["events", text(&log), "-o", text(&log), "--force"], 2);
    assert!(onto_itself.contains("which this command reads"), "{onto_itself}");
}

/// Each was told about eight bytes.
#[test]
fn files_of_other_formats_are_named_where_a_log_is_asked_for() {
    let folder = folder();
    for (name, bytes, what) in [
        ("a.png", &b"\x89PNG\r\n\x1a\n\0"[..], "a PNG picture"),
        ("a.csv", b"onset_s,end_s\n0,1\n", "a text, as a CSV table is, and no MCAP file"),
        ("a.csv.gz", b"\x1f\x8b\x08\0", "a gzip file, which must be unpacked first"),
    ] {
        let file = folder.path().join(name);
        fs::write(&file, bytes).expect("the folder can be written");
        let said = fail(&["summary", text(&file)], 2);
        assert!(said.contains(&format!("not a run log: this is {what} (accepted: a run log, as ")), "{said}");
    }
}

#[test]
fn scenarios_are_listed_and_shown_in_full() {
    let list = succeed(&["scenario", "list"]);
    let listed: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    let built_in: Vec<&str> = asperity_model::scenario::builtin::all().map(|(name, _)| name).collect();
    assert_eq!(listed, built_in);
    let models = succeed(&["scenario", "list", "--for", "glass"]);
    let lines: Vec<&str> = models.lines().collect();
    assert!(lines.len() == 3 && lines[1] == "  scenarios    pmma-block, slab", "{models}");
    assert!(succeed(&["scenario", "list", "--for"]).lines().count() > 12);

    let folder = folder();
    for name in built_in {
        let shown = succeed(&["scenario", "show", name]);
        let file = folder.path().join("shown.toml");
        fs::write(&file, &shown).expect("the folder can be written");
        assert_eq!(succeed(&["scenario", "show", text(&file)]), shown, "{name}");
    }
}
