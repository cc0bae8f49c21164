//! The output of `sweep emit`, run by all available shells: whatever the name of a folder, the runs are
//! made in exactly that folder and nothing else is executed, or the name is refused.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;

use crate::support::binary::{succeed, text};
use crate::sweep::Study;

const ONE_RUN: &str = "
title = 'One run'
scenario = 'default'
set = ['parameter_set=as-coded', 'slider.blocks=10', 'time.step_s=1e-7', 'time.duration_s=0.01']
[[axis]]
key = 'normal_load.tilt'
values = [0.5]
";

/// Names of folders that a shell, or the program before it, might misinterpret.
const NAMES: [&[u8]; 24] = [
    b"two words",
    b"it's",
    b"a 'quoted' name",
    b"\"double\"",
    b"$(touch executed)",
    b"`touch executed`",
    b"'; touch executed; '",
    b"& touch executed &",
    b"a\ntouch executed\nb",
    b"a'\ntouch executed\n'b",
    b"{directory}",
    b"{workspace_path}",
    b"{}",
    b"-dash",
    b"--help",
    b"100%",
    b"%s%%",
    b"back\\slash\\n",
    b"~",
    b"*?[a]",
    b"!!#",
    b"\xc3\x9cbung",
    b"latin \xdc",
    b"escape \x1b[2J\r",
];

fn emit(folder: &Path, name: &OsStr, engine: &str) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_asperity"))
        .args(["sweep", "emit", engine, "--"])
        .arg(name)
        .current_dir(folder)
        .output()
        .expect("the binary starts");
    let words = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.code(), words(output.stdout), words(output.stderr))
}

/// The command that `--wrap` of a script is given, as bash reads it.
fn wrapped(folder: &Path, script: &str) -> String {
    let collect = script.lines().find(|line| line.starts_with("collect=")).expect("it has one");
    let printed = Command::new("bash")
        .args(["-c", &format!("{collect}; printf %s \"$collect\"")])
        .current_dir(folder)
        .output()
        .expect("there is bash");
    String::from_utf8(printed.stdout).expect("it is text")
}

/// The available shells. Mostly sh is one of the other two, which needs no second round.
fn shells() -> Vec<&'static str> {
    let available = |shell: &&str| Command::new(shell).args(["-c", "true"]).output().is_ok();
    let program = |shell: &str| fs::canonicalize(Path::new("/bin").join(shell)).ok();
    let is_sh = |shell: &&str| *shell != "sh" && program(shell).is_some() && program(shell) == program("sh");
    ["sh", "dash", "bash"].into_iter().filter(|shell| available(shell) && !is_sh(shell)).collect()
}

/// A newline in a name ended its command and began another one; a name that is not UTF-8 became another
/// name, with exit code 0; `printf %q` wrote for bash what sh was to read.
#[test]
fn a_script_makes_the_runs_in_the_very_folder_and_executes_nothing_else() {
    let study = Study::of(ONE_RUN);
    let plan = study.plan("plan");
    let shells = shells();
    assert!(shells.contains(&"sh"));
    let place = study.path("place");
    for name in NAMES {
        let name = OsStr::from_bytes(name);
        let fresh = || {
            fs::remove_dir_all(&place).ok();
            fs::create_dir_all(place.join(name)).expect("the folder can be written");
            fs::copy(plan.join("plan.ndjson"), place.join(name).join("plan.ndjson"))
                .expect("it can be written");
        };
        let refusable = name.to_str().is_none_or(|name| name.contains(|c: char| c.is_control()));
        let runs = |shell: &str, command: &str| {
            fresh();
            let output =
                Command::new(shell).args(["-c", command]).current_dir(&place).env("LC_ALL", "C").output();
            let output = output.expect("the shell starts");
            let err = String::from_utf8_lossy(&output.stderr).into_owned();
            let made =
                fs::read_dir(place.join(name).join("segments")).is_ok_and(|mut files| files.next().is_some());
            assert!(output.status.success() && made, "{name:?} by {shell}: {command}: {err}");
            let there: Vec<OsString> = fs::read_dir(&place)
                .expect("the folder is there")
                .map(|entry| entry.expect("the folder can be read").file_name())
                .collect();
            assert_eq!(there, [name.to_owned()], "{name:?} by {shell}: {command}");
        };
        fresh();
        for engine in ["list", "slurm", "row"] {
            let (code, out, err) = emit(&place, name, engine);
            let brace = engine == "row" && name.to_string_lossy().contains(['{', '}']);
            let backslash = engine == "slurm" && name.to_string_lossy().contains('\\');
            if refusable || brace || backslash {
                assert_eq!((code, out.as_str()), (Some(2), ""), "{name:?} for {engine}: {err}");
                assert!(err.contains("the folder ") && err.contains("(accepted: "), "{err}");
                continue;
            }
            assert_eq!(code, Some(0), "{name:?} for {engine}: {err}");
            match engine {
                "list" => {
                    assert_eq!(out.lines().count(), 1, "{out}");
                    shells.iter().for_each(|shell| runs(shell, out.trim_end()));
                }
                "row" => {
                    let row: toml::Table = out.parse().expect("it is TOML");
                    let command = row["action"][0]["command"].as_str().expect("it has one");
                    // As row does it: one template of its own.
                    let make = command.replace("{directory}", "1");
                    let make = make.split(" && touch workspace").next().expect("it is split");
                    shells.iter().for_each(|shell| runs(shell, make));
                }
                _ => {
                    let script = study.path("sweep.slurm");
                    fs::write(&script, &out).expect("the folder can be written");
                    let task = format!("SLURM_ARRAY_TASK_ID=1 bash '{}'", text(&script));
                    runs("sh", &task);
                    // sh reads the wrapped command.
                    let collect = wrapped(&place, &out);
                    for shell in &shells {
                        fresh();
                        succeed(&["sweep", "run", text(&place.join(name))]);
                        let made = Command::new(shell).args(["-c", &collect]).current_dir(&place).output();
                        let made = made.expect("the shell starts");
                        assert!(
                            made.status.success(),
                            "{collect}: {}",
                            String::from_utf8_lossy(&made.stderr)
                        );
                        assert!(place.join(name).join("report.html").exists(), "{collect}");
                    }
                }
            }
        }
    }
}

#[test]
fn runs_are_made_in_a_folder_whose_name_begins_with_a_dash() {
    let study = Study::of(ONE_RUN);
    study.plan("-dash");
    let run = Command::new(env!("CARGO_BIN_EXE_asperity"))
        .args(["sweep", "run", "--", "-dash"])
        .current_dir(study.path(""))
        .output()
        .expect("the binary starts");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
}

/// Takes tasks up to a limit in all, as a cluster with MaxSubmitJobs does.
const SBATCH: &str = r#"#!/bin/bash
cd "$(dirname "$0")" || exit
n=1
for word; do
    if [[ $word == --array=* ]]; then
        n=0; word=${word#--array=}
        IFS=,; for range in ${word%%%*}; do n=$((n + ${range#*-} - ${range%-*} + 1)); done; unset IFS
    fi
done
sum=$(($(cat sum) + n))
if ((sum > $(cat limit))); then echo "sbatch: error: QOSMaxSubmitJobPerUserLimit" >&2; exit 1; fi
echo $sum > sum
echo "$*" >> calls
echo $((100 + $(wc -l < calls)))
"#;

/// What a cluster accepted is kept, named by its true parts, and not submitted again while it is under way; of what it
/// refused, the script ended without tables and without a word.
#[test]
fn a_script_keeps_what_is_accepted_and_says_what_is_left() {
    let study = Study::of(&ONE_RUN.replace("values = [0.5]", "from = 0\nto = 0.5\ncount = 25"));
    let plan = study.plan("plan");
    let bin = study.path("bin");
    fs::create_dir(&bin).expect("the folder can be written");
    let write = |name: &str, text: &str| {
        fs::write(bin.join(name), text).expect("the folder can be written");
        fs::set_permissions(bin.join(name), fs::Permissions::from_mode(0o755)).expect("it is ours");
    };
    let file = |name: &str| fs::read_to_string(bin.join(name)).unwrap_or_default();
    write("sbatch", SBATCH);
    let script = study.path("sweep.slurm");
    let path = format!("{}:{}", text(&bin), std::env::var("PATH").expect("it is set"));
    // What it exits with, the parts that it says are submitted, what else it says, and which jobs it submits.
    let submit = |more: &[&str], limit: &str, scontrol: &str, squeue: &str| {
        write("limit", limit);
        write("sum", "0");
        write("scontrol", &format!("#!/bin/sh\n{scontrol}\n"));
        write("squeue", &format!("#!/bin/sh\n{squeue}\n"));
        fs::write(&script, succeed(&[&["sweep", "emit", "slurm", text(&plan)], more].concat()))
            .expect("the folder can be written");
        let before = file("calls").lines().count();
        let output = Command::new("bash").arg(&script).env("PATH", &path).output().expect("there is bash");
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("text"));
        let parts = out.lines().filter_map(|line| Some(line.split_once(": parts ")?.1.to_owned())).collect();
        let calls: Vec<String> = file("calls").lines().skip(before).map(ToOwned::to_owned).collect();
        (output.status.code(), parts, err, calls)
    };
    let forget = || fs::remove_file(plan.join("slurm.jobs")).unwrap_or(());
    let (ten, unknown) = ("echo 'MaxArraySize            = 11'", "exit 1");
    let none = Vec::<String>::new();

    let (code, parts, err, calls) = submit(&[], "15", ten, unknown);
    assert_eq!((code, parts), (Some(1), vec!["1-10".to_owned()]), "{err}");
    assert!(err.contains("QOSMaxSubmit") && err.contains("parts 11-20,21-25 of 25 are left"), "{err}");
    assert!(
        err.contains("--tasks") && calls.len() == 2 && calls[1].contains("afterany:101 "),
        "{err}{calls:?}"
    );
    // Later, if nothing tells which jobs are over, and however many parts the runs have now.
    let (code, parts, err, calls) = submit(&[], "50", ten, unknown);
    assert_eq!((code, parts), (Some(0), vec!["11-20".to_owned(), "21-25".to_owned()]), "{err}");
    assert!(calls[2].contains("--dependency=afterany:101:103:104 "), "{calls:?}");
    let (code, parts, err, calls) = submit(&["--tasks", "5"], "50", ten, unknown);
    assert_eq!((code, parts, calls.len()), (Some(0), none.clone(), 1), "{err}");
    // Two tasks are not over, the others have left runs.
    let queue = "printf '101 3\\n101 3\\n103 5\\n999 7\\n'";
    let (code, parts, err, calls) = submit(&["--at-once", "4"], "50", ten, queue);
    let left = ["1-2,4-10", "11-14,16-20", "21-25"].map(ToOwned::to_owned).to_vec();
    assert_eq!((code, parts, err.as_str()), (Some(0), left, ""));
    assert!(calls[0].contains("--array=1-2,4-10%4 ") && calls[3].contains("afterany:101:103:"), "{calls:?}");

    for scontrol in ["exit 1", "exit 127", "echo 'MaxArraySize = (null)'", "true"] {
        forget();
        let (code, parts, err, _) = submit(&[], "50", scontrol, "true");
        assert_eq!((code, parts), (Some(0), vec!["1-25".to_owned()]), "{err}");
        assert!(err.contains("taken as 1001"), "{err}");
    }
    forget();
    let (code, parts, err, calls) = submit(&[], "5", ten, "true");
    assert_eq!((code, parts, calls), (Some(1), none.clone(), none), "{err}");
    forget();
    let (code, _, err, _) = submit(&[], "25", ten, "true");
    assert!(code == Some(1) && err.contains("the tables are left"), "{err}");
}
