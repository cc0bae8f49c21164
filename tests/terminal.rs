//! Output on a terminal: foreign text never looks like a line of ours, failures to print notes have no
//! effect, and names that are not UTF-8 are valid.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, take_apart};
use crate::support::binary::{asperity, text};
use crate::support::small;

/// A second line, if printed unescaped; and one that would replace the first.
const HOSTILE: [&str; 3] =
    ["as-coded\nfake.mcap: whole", "as-coded\r\u{1b}[2Kfake.mcap: whole", "\u{202e}elohw"];

fn said(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_owned()).expect("the binary writes UTF-8");
    (text(&output.stdout), text(&output.stderr))
}

/// Checks that a text contains no control characters except line breaks.
fn is_plain(words: &str) -> bool {
    !words.chars().any(|c| (c.is_control() && c != '\n') || ('\u{202a}'..='\u{202e}').contains(&c))
}

#[test]
fn what_a_log_says_stays_within_its_line() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("small.mcap");
    small::run(&log);
    let parts = take_apart(&fs::read(&log).expect("it was just written"));
    for value in HOSTILE {
        let mut parts = parts.clone();
        let run = parts.iter_mut().find(|part| part.name() == Some("run")).expect("there is a header");
        let mut map = run.map().expect("it is metadata");
        map.insert("parameter_set".to_owned(), value.to_owned());
        *run = Part::metadata("run", &map);
        let forged = folder.path().join("forged.mcap");
        fs::write(&forged, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
        let (out, err) = said(&asperity(&["check", text(&forged)]));
        assert!(out.lines().count() == 1 && out.contains("parameter_set"), "{out:?}");
        assert!(out.starts_with(text(&forged)) && is_plain(&out), "{out:?}");
        assert_eq!(err, "");
        // The page of a diff quotes both headers; for a log by other code, whatever their contents.
        map.insert("code_version".to_owned(), "other".to_owned());
        *parts.iter_mut().find(|part| part.name() == Some("run")).expect("there is a header") =
            Part::metadata("run", &map);
        fs::write(&forged, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
        let page = folder.path().join("page.html");
        let (out, err) =
            said(&asperity(&["diff", text(&log), text(&forged), "--force", "--page", text(&page)]));
        assert!(is_plain(&out) && is_plain(&err), "{out:?} {err:?}");
        let page = fs::read_to_string(&page).expect("there is a page");
        assert!(!page.contains('\u{202e}') && !page.contains('\u{1b}'), "the page is not plain");
    }
}

#[test]
#[cfg(unix)]
fn names_of_files_and_arguments_stay_within_their_line() {
    let folder = asperity_testkit::folder();
    for hostile in HOSTILE {
        let file = folder.path().join(hostile);
        fs::write(&file, "no log").expect("the folder can be written");
        let (out, _) = said(&asperity(&["check", text(&file)]));
        assert!(out.lines().count() == 1 && is_plain(&out), "{out:?}");
        for arguments in [
            &["events", text(&file)][..],
            &["summary", text(&file)],
            &["replay", text(&file)],
            &["report", text(&file), "--out", "never.html"],
            &["diff", text(&file), text(&file)],
            &["salvage", text(&file), "--out", "never.mcap"],
            &["run", hostile, "--out", "never.mcap"],
            &["run", "default", "--set", hostile, "--out", "never.mcap"],
            &["check", &format!("--{hostile}")],
            &[hostile],
        ] {
            let output = asperity(arguments);
            let (out, err) = said(&output);
            assert!(!output.status.success() && out.is_empty() && is_plain(&err), "{arguments:?}: {err:?}");
            // Foreign text may break an error into lines; each is marked as an error.
            let forged = err.lines().find(|line| line.starts_with("fake.mcap"));
            assert_eq!(forged, None, "{arguments:?}: {err:?}");
        }
    }
}

/// Runs the command in a shell, which redirects its output as given.
#[cfg(unix)]
fn shell(folder: &Path, script: &str) -> Output {
    Command::new("bash")
        .args(["-c", script])
        .env("ASPERITY", env!("CARGO_BIN_EXE_asperity"))
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("bash starts")
}

/// Full, closed, or a pipe that nobody reads any more: the outcome is that of the command.
#[test]
#[cfg(target_os = "linux")]
fn stderr_that_cannot_be_written_changes_nothing_but_the_words() {
    let folder = asperity_testkit::folder();
    small::run(&folder.path().join("small.mcap"));
    fs::write(
        folder.path().join("two.toml"),
        "title = \"t\"\n[[run]]\nname = \"a\"\nscenario = \"ten-blocks\"\n\
        set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=0.2\"]\n",
    )
    .expect("the folder can be written");
    let mut commands = vec![
        "run no-such-scenario --out x.mcap",
        "run default --no-such-flag",
        "check no-such.mcap",
        "replay small.mcap no-such.mcap",
        "events no-such.mcap",
        "export small.mcap no-such.mcap --to csv --out NEW",
        "run ten-blocks --set time.step_s=1e-7 --set time.duration_s=0.2 --stats --out NEW.mcap",
    ];
    commands.push("reproduce two.toml --out NEW");
    for (number, command) in commands.iter().enumerate() {
        let mut outcomes = Vec::new();
        let ways = ["2>err", "2>/dev/full", "2>&-", "2> >(true)"];
        for (way, redirection) in ways.iter().enumerate() {
            let command = command.replace("NEW", &format!("new-{number}-{way}"));
            let output = shell(folder.path(), &format!("$ASPERITY {command} {redirection}"));
            let out = said(&output).0.replace(&format!("new-{number}-{way}"), "NEW");
            outcomes.push((output.status.code(), out));
        }
        for (way, outcome) in ways.iter().zip(&outcomes) {
            assert_eq!(outcome, &outcomes[0], "asperity {command} {way}");
        }
    }
    let made =
        |way: usize| fs::read(folder.path().join(format!("new-6-{way}.mcap"))).expect("the run was made");
    assert!(made(1).len() > 1000);
    // A reader of both that leaves is no failure either.
    let output =
        shell(folder.path(), "$ASPERITY run no-such --out x.mcap 2>&1 | head -c 1; echo ${PIPESTATUS[0]}");
    assert_eq!(said(&output).0, "e2\n");
}

#[test]
#[cfg(target_os = "linux")]
fn standard_output_that_is_full_is_a_failure_and_a_reader_that_leaves_is_none() {
    let folder = asperity_testkit::folder();
    small::run(&folder.path().join("small.mcap"));
    for command in [
        "--help",
        "--version",
        "run --help",
        "scenario list",
        "scenario show default",
        "-q scenario validate default",
        "-q scenario validate default --format json",
        "check small.mcap",
        "events small.mcap",
        "events small.mcap --format json",
        "summary small.mcap",
        "summary small.mcap --format json",
        "summary small.mcap --format csv",
        "catalogue small.mcap",
        "catalogue small.mcap --format quakeml",
        "catalogue small.mcap --format statistics",
        "replay small.mcap",
        "replay small.mcap --format csv",
        "diff small.mcap small.mcap",
        "diff small.mcap small.mcap --format json",
        "completions bash",
        "man --out man --force",
    ] {
        let full = shell(folder.path(), &format!("$ASPERITY {command} >/dev/full"));
        assert_eq!(full.status.code(), Some(1), "asperity {command}: {:?}", said(&full));
        assert!(said(&full).1.contains("standard output"), "asperity {command}: {:?}", said(&full));
        let left = shell(folder.path(), &format!("$ASPERITY {command} > >(true); exit $?"));
        assert_eq!(said(&left).1, "", "asperity {command}");
        assert_eq!(left.status.code(), Some(0), "asperity {command}");
    }
}

/// On Linux a name is any bytes.
#[test]
#[cfg(target_os = "linux")]
fn a_name_that_is_no_utf_8_is_a_name_for_every_command() {
    use std::os::unix::ffi::OsStrExt;

    let folder = asperity_testkit::folder();
    let named = |ending: &str| {
        let name = [&b"caf\xe9"[..], ending.as_bytes()].concat();
        folder.path().join(OsStr::from_bytes(&name)).into_os_string()
    };
    let (log, other, scenario) = (named(".mcap"), named("-2.mcap"), named(".toml"));
    let small =
        "parameter_set = \"as-coded\"\n[slider]\nblocks = 10\n[time]\nstep_s = 1e-7\nduration_s = 1.2\n";
    fs::write(&scenario, small).expect("the folder can be written");
    let run = |arguments: &[&OsStr]| {
        let output =
            Command::new(env!("CARGO_BIN_EXE_asperity")).args(arguments).output().expect("the binary starts");
        let (out, err) = said(&output);
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {out}{err}");
        out
    };
    fn words<'a>(arguments: &[&'a str]) -> Vec<&'a OsStr> {
        arguments.iter().map(|&word| OsStr::new(word)).collect()
    }
    let of = |before: &[&'static str], files: &[&OsString], after: &[&'static str]| -> String {
        let mut arguments = words(before);
        arguments.extend(files.iter().map(|file| file.as_os_str()));
        arguments.extend(words(after));
        run(&arguments)
    };
    let with_out =
        |command: &'static str, input: &OsString, more: &[&'static str], out: &OsString| -> String {
            let mut arguments = vec![OsStr::new(command), input.as_os_str()];
            arguments.extend(words(more));
            arguments.extend([OsStr::new("--out"), out.as_os_str()]);
            run(&arguments)
        };
    assert!(of(&["scenario", "show"], &[&scenario], &[]).contains("blocks = 10"));
    with_out("run", &scenario, &["--quiet"], &log);
    // The scenario of a log.
    with_out("run", &log, &["--quiet"], &other);
    assert!(of(&["check"], &[&log], &[]).contains("caf\u{fffd}.mcap: whole"));
    assert!(of(&["events"], &[&log], &[]).lines().count() > 3);
    assert!(of(&["summary"], &[&log], &[]).contains("caf\u{fffd}\n"));
    assert!(of(&["diff"], &[&log, &other], &[]).contains("nothing differs"));
    let bytes = fs::read(&log).expect("it was just written");
    fs::write(named("-cut.mcap"), &bytes[..bytes.len() - 40]).expect("the folder can be written");
    with_out("salvage", &named("-cut.mcap"), &[], &named("-salvaged.mcap"));
    let tables = named("-replayed");
    with_out("replay", &log, &["--quiet"], &tables);
    let record = fs::read_to_string(Path::new(&tables).join("replay.json")).expect("there is a record");
    assert!(record.contains("caf\u{fffd}.mcap"), "{record}");
    with_out("export", &log, &["--quiet", "--to", "csv"], &named("-exported"));
    with_out("report", &log, &[], &named(".html"));
    let page = fs::read_to_string(named(".html")).expect("there is a page");
    assert!(page.contains("<h1>Run caf\u{fffd}</h1>") && page.contains("href=\"caf%E9.mcap\""), "{page}");
    with_out("reduce", &log, &[], &named("-reduced"));
}

/// An error about a lack of resources names the resource, and its limit.
#[test]
#[cfg(target_os = "linux")]
fn limits_of_the_process_are_named() {
    let folder = asperity_testkit::folder();
    small::run(&folder.path().join("small.mcap"));
    let run = |script: &str| {
        let output = shell(folder.path(), script);
        (output.status.code(), said(&output).1)
    };
    let (code, err) = run("ulimit -f 40; exec $ASPERITY run ten-blocks --out large.mcap");
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("large.mcap.partial: ") && err.contains("file size limit, ulimit -f"), "{err}");
    let (code, err) = run("ulimit -f 1; exec $ASPERITY replay small.mcap --out replayed");
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("file size limit, ulimit -f") && err.lines().count() == 1, "{err}");
    // Standard streams and the log; a fourth file that the parent of the tests left open is closed.
    let (code, err) = run("exec 3>&-; ulimit -n 4; exec $ASPERITY run ten-blocks --out many.mcap");
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("open files, ulimit -n") && !err.contains("another process"), "{err}");
    // Threads cannot be had, or not the memory for their stacks.
    let (code, err) = run("ulimit -v 30000; exec $ASPERITY run ten-blocks --out memory.mcap");
    assert!(code != Some(0) && !err.contains("panicked"), "{code:?} {err}");
}

/// Predictions are printed for people on a terminal, and not in output that a script reads.
#[test]
#[cfg(unix)]
fn a_run_on_a_terminal_begins_with_what_is_known_of_it() {
    let folder = asperity_testkit::folder();
    let run = |out: &str, before: &[&str]| {
        let out = folder.path().join(out);
        let short =
            ["run", "ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.01", "--out"];
        let all = [before, &[env!("CARGO_BIN_EXE_asperity")], &short, &[text(&out)]].concat();
        let output = Command::new(all[0])
            .args(&all[1..])
            .env("TERM", "xterm")
            .stdin(Stdio::null())
            .output()
            .expect("it starts");
        let (out, err) = said(&output);
        assert!(output.status.success(), "{out} {err}");
        out + &err
    };
    let spawn = ["python3", "-c", "import pty, sys; sys.exit(pty.spawn(sys.argv[1:]) >> 8)"];
    let watched = run("watched.mcap", &spawn);
    for line in ["density ", "load: F_T/F_N reaches mu_d = 0.45 at ", "first slip: at "] {
        assert!(watched.contains(&format!("ten-blocks: {line}")), "{watched}");
    }
    let read = run("read.mcap", &[]);
    let begins = |text: &str| text.contains("ten-blocks: density 1200 kg/m^3, waves at c = ");
    assert!(
        begins(&read) && !read.contains("first slip: at ") && read.contains("ten-blocks: warning: "),
        "{read}"
    );
}
