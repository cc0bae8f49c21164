//! Every command that reads refuses at once paths that are no files: a named pipe, a socket, a device, a
//! folder. Opening a pipe used to wait for a writer that might never come; and little memory used to cause
//! a panic of the threads that compute tables.

use std::fs;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;

use crate::hostile::{bounded, refused};
use crate::laws::packing::{Packing, put_together};
use crate::laws::parts::{Part, take_apart};
use crate::support::binary::text;
use crate::support::commands::{ON_LOGS, arguments, words};
use crate::support::small;
use crate::sweep::Study;

fn pipe(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().expect("mkfifo starts").success());
}

#[test]
fn no_command_waits_for_a_pipe() {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let file = |name: &str| folder.join(name);
    let whole = file("whole.mcap");
    small::run(&whole);
    let endings = ["mcap", "csv", "toml"];
    let [log, csv, toml] = endings.map(|ending| file(&format!("pipe.{ending}")));
    [&log, &csv, &toml].into_iter().for_each(|path| pipe(path));
    let profile = format!("initial_shear.profile_csv={}", csv.display());
    let [from, state] =
        [("from", &log), ("state_csv", &csv)].map(|(key, path)| format!("initial.{key}={}", path.display()));
    let mut commands = vec![
        (vec!["scenario", "validate", "default", "--set", &from], &log),
        (vec!["scenario", "validate", "default", "--set", &state], &csv),
        (vec!["replay", text(&whole), "--detectors", text(&toml)], &toml),
        (vec!["diff", text(&csv), text(&csv)], &csv),
        (vec!["diff", text(&whole), text(&whole), "--policy", text(&toml)], &toml),
        (vec!["scenario", "validate", text(&toml)], &toml),
        (vec!["scenario", "validate", "default", "--set", &profile], &csv),
        (vec!["run", text(&toml), "--out", "run.mcap"], &toml),
        (vec!["sweep", "plan", text(&toml), "--out", "planned"], &toml),
        (vec!["sweep", "go", text(&toml), "--out", "gone"], &toml),
        (vec!["reproduce", text(&toml), "--out", "made"], &toml),
    ];
    let on_logs: Vec<Vec<String>> =
        ON_LOGS.iter().map(|command| words(command.words, &[text(&log)], "new")).collect();
    commands.extend(on_logs.iter().map(|words| (arguments(words), &log)));
    for (arguments, file) in commands {
        let said = refused(folder, &arguments, file);
        assert!(said.contains("it is a pipe"), "{arguments:?}: {said}");
    }
    let _listener = UnixListener::bind(file("socket.mcap")).expect("the folder can be written");
    for (path, what) in [(file("socket.mcap"), "a socket"), ("/dev/null".into(), "a device")] {
        let said = refused(folder, &["check", text(&path)], &path);
        assert!(said.contains(&format!("not a run log: it is {what}")), "{said}");
    }
}

/// A log or a plan that names a file without its values is damaged, and no reader opens that file: not a pipe, which
/// would wait, and not a text, of which nothing is in any output.
#[test]
fn what_a_log_or_a_plan_names_is_not_opened() {
    let scratch = asperity_testkit::folder();
    let folder = scratch.path();
    let file = |name: &str| folder.join(name);
    let (log, forged) = (file("whole.mcap"), file("forged.mcap"));
    small::run(&log);
    let parts = take_apart(&fs::read(&log).expect("it was just written"));
    let at = parts.iter().position(|part| part.name() == Some("scenario.toml")).expect("it has one");
    let scenario = parts[at].attached().expect("it is an attachment");
    let scenario = String::from_utf8(scenario.to_vec()).expect("it is a text");
    pipe(&file("pipe"));
    fs::write(file("text"), "secret,secret\n1,2\n").expect("the folder can be written");
    let more = ["diff whole.mcap FILE", "run FILE --set initial.at_s=0.1 --out NEW.mcap"];
    for (n, (section, key)) in [
        ("prestress", "profile_csv"),
        ("prestress", "course_csv"),
        ("initial_shear", "profile_csv"),
        ("normal_load", "course_csv"),
        ("disorder", "contacts_csv"),
        ("initial", "state_csv"),
        ("initial", "from"),
    ]
    .into_iter()
    .enumerate()
    {
        for named in ["pipe", "text"] {
            let head = format!("[{section}]\n");
            let (before, behind) = scenario.split_once(&head).expect("it has all sections");
            let behind = behind.replacen(&format!("\n{key} = \"\""), &format!("\n{key} = \"{named}\""), 1);
            let mut parts = parts.clone();
            parts[at] = Part::attachment("scenario.toml", format!("{before}{head}{behind}").as_bytes());
            fs::write(&forged, put_together(&parts, Packing::USUAL)).expect("the folder can be written");
            let said = refused(folder, &["check", text(&forged)], &forged);
            assert!(said.contains(": damaged: ") && said.contains("its values are missing"), "{key}: {said}");
            // All of them for one key: it is one function that opens files for all keys.
            let commands = ON_LOGS.iter().map(|command| command.words).chain(more);
            for (number, command) in commands.enumerate().filter(|_| n == 0) {
                let words = words(command, &[text(&forged)], &format!("{named}-{number}"));
                let outcome = bounded(folder, &arguments(&words));
                let said = outcome.out + &outcome.err;
                assert!(matches!(outcome.code, Some(0..=5)), "{command}: {said}");
                assert!(!said.contains("secret"), "{command}: {said}");
            }
        }
    }
    let found = Command::new("grep").args(["-rl", "secret", "."]).current_dir(folder).output();
    let found = String::from_utf8(found.expect("grep starts").stdout).expect("plain names");
    assert_eq!(found, "./text\n");
    let study = Study::of(
        "title = 'Tilts'\nscenario = 'default'\n[[axis]]\nkey = 'normal_load.tilt'\nvalues = [0]\n",
    );
    let out = study.plan("out");
    let plan = fs::read_to_string(out.join("plan.ndjson")).expect("there is a plan");
    let named = format!("\"set\":[\"prestress.profile_csv={}\"]", text(&file("pipe")));
    let (body, _) = plan.trim_end().rsplit_once('\n').expect("it has lines");
    let body = body.replace("\"set\":[]", &named) + "\n";
    let sealed = format!("{body}{{\"rows\":1,\"blake3\":\"{}\"}}\n", blake3::hash(body.as_bytes()).to_hex());
    assert!(sealed.contains(&named));
    fs::write(out.join("plan.ndjson"), sealed).expect("the folder can be written");
    for command in ["status", "run", "collect"] {
        let outcome = bounded(folder, &["sweep", command, text(&out)]);
        assert!(matches!(outcome.code, Some(1..=4)), "{command}: {:?} {}", outcome.code, outcome.err);
    }
}

#[test]
fn a_study_does_not_wait_for_a_pipe() {
    let study = Study::of(
        "title = 'Tilts'\nscenario = 'default'\nset = ['parameter_set=as-coded', 'slider.blocks=5', 'time.duration_s=0.001']\n\
         [[axis]]\nkey = 'normal_load.tilt'\nvalues = [-0.4, 0.3]\n",
    );
    let out = study.plan("out");
    fs::create_dir_all(out.join("segments")).expect("the folder can be written");
    pipe(&out.join("segments/a.seg"));
    let planless = study.path("planless");
    fs::create_dir(&planless).expect("the folder can be written");
    pipe(&planless.join("plan.ndjson"));
    let scratch = asperity_testkit::folder();
    for folder in [&out, &planless] {
        for command in ["status", "run", "collect"] {
            let outcome = bounded(scratch.path(), &["sweep", command, text(folder)]);
            assert!(matches!(outcome.code, Some(1..=4)), "{command}: {:?} {}", outcome.code, outcome.err);
            assert!(outcome.err.contains("it is a pipe"), "{command}: {}", outcome.err);
        }
    }
}

/// Texts are read once, and may come from a stream that the shell opens.
#[test]
fn scenarios_may_come_from_a_stream_of_the_shell() {
    let script = "echo slider.blocks=7 | \"$0\" scenario show /dev/stdin | grep '^blocks'
                  \"$0\" scenario show <(echo slider.blocks=8) | grep '^blocks'";
    let output = Command::new("bash")
        .args(["-c", script, env!("CARGO_BIN_EXE_asperity")])
        .output()
        .expect("bash starts");
    assert_eq!(String::from_utf8_lossy(&output.stdout), "blocks = 7\nblocks = 8\n", "{output:?}");
}
