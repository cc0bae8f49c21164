//! Full disks and folders that cannot be written: a clear message, nothing incomplete under a final name,
//! no loss of existing files, and a run that continues once there is room.

use std::env;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::{Command, Output};

use crate::support::binary;
use crate::support::binary::{asperity, text};
use asperity_testkit::run_end;

/// Runs a script in a folder that is a disk of its own, of a megabyte, which only the script
/// sees; `None` where the system does not allow such a thing.
#[cfg(target_os = "linux")]
fn on_a_small_disk(folder: &Path, script: &str) -> Option<Output> {
    let mount = "mount -t tmpfs -o size=1m tmpfs \"$DISK\" && cd \"$DISK\" || exit 99";
    let disk = folder.join("disk");
    fs::create_dir_all(&disk).expect("the folder can be written");
    let output = Command::new("unshare")
        .args(["--mount"])
        .args(if is_root() { &[][..] } else { &["--map-root-user"] })
        .args(["sh", "-c", &format!("{mount}\n{script}")])
        .env("ASPERITY", env!("CARGO_BIN_EXE_asperity"))
        .env("DISK", &disk)
        .env("KEEP", folder)
        .output();
    let reason = match output {
        Ok(output) if output.status.code() != Some(99) && !refused(&output) => return Some(output),
        Ok(output) => String::from_utf8_lossy(&output.stderr).trim().to_owned(),
        Err(error) => format!("unshare: {error}"),
    };
    let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
    assert!(!no_skips, "the full disk must not be skipped: {reason}");
    // Not eprintln, which the test harness captures: a skip must be seen.
    writeln!(std::io::stderr(), "SKIPPED disk: no disk of its own: {reason}").expect("stderr can be written");
    None
}

/// Whether unshare itself was refused, and the script never ran.
#[cfg(target_os = "linux")]
fn refused(output: &Output) -> bool {
    String::from_utf8_lossy(&output.stderr).starts_with("unshare: ")
}

#[cfg(target_os = "linux")]
fn is_root() -> bool {
    let output = Command::new("id").arg("-u").output();
    output.is_ok_and(|output| output.stdout.starts_with(b"0\n"))
}

fn digest(log: &Path) -> String {
    run_end(log).digest
}

#[cfg(target_os = "linux")]
#[test]
fn a_run_that_fills_the_disk_says_so_and_goes_on_when_there_is_room() {
    let folder = asperity_testkit::folder();
    let whole = folder.path().join("whole.mcap");
    binary::run(&["default", "--set", "time.duration_s=2"], &whole);
    let script = r#"
        echo precious > kept
        run="$ASPERITY run default --set parameter_set=as-coded --set time.duration_s=2 --out run.mcap --checkpoint-s 0.01"
        $run; echo "full: $?"
        test ! -e run.mcap && test -e run.mcap.partial && echo "not published"
        $ASPERITY check run.mcap.partial; echo "check: $?"
        $run --resume; echo "still full: $?"
        $ASPERITY check run.mcap.partial; echo "check again: $?"
        mount -o remount,size=64m "$DISK"
        $run --resume; echo "room: $?"
        cp run.mcap "$KEEP/resumed.mcap"
        cat kept; ls
    "#;
    let Some(output) = on_a_small_disk(folder.path(), script) else { return };
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let lines: Vec<&str> = said.lines().filter(|line| !line.contains("incomplete")).collect();
    assert_eq!(
        lines,
        [
            "full: 1",
            "not published",
            "check: 3",
            "still full: 1",
            "check again: 3",
            "room: 0",
            "precious",
            "kept",
            "run.mcap"
        ],
        "{said}\n{errors}"
    );
    assert_eq!(errors.matches("No space left on device").count(), 2, "{errors}");
    assert!(errors.contains("run.mcap.partial: ") && errors.contains("resumes from"), "{errors}");
    assert_eq!(digest(&folder.path().join("resumed.mcap")), digest(&whole));
}

/// Of a short run the table of ruptures is within the limit as CSV, and above it as Parquet.
#[cfg(unix)]
#[test]
fn a_table_that_is_refused_as_parquet_alone_is_named() {
    let folder = asperity_testkit::folder();
    let [log, out] = ["short.mcap", "reduced"].map(|name| folder.path().join(name));
    binary::run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1e-6"], &log);
    let command = format!("ulimit -f 6; exec \"$ASPERITY\" reduce {} --out {}", text(&log), text(&out));
    let mut shell = Command::new("sh");
    let output = shell.args(["-c", &command]).env("ASPERITY", env!("CARGO_BIN_EXE_asperity")).output();
    let output = output.expect("there is a shell");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.code() == Some(1) && said.contains("ruptures.parquet: File too large"), "{said}");
    assert!(!out.exists(), "a folder without all tables");
}

/// The library of Parquet has a sentence of its own for each failure; users need the system's.
#[cfg(target_os = "linux")]
#[test]
fn a_parquet_table_that_cannot_be_written_is_named_with_the_reason() {
    let folder = asperity_testkit::folder();
    let [log, matches] = [folder.path().join("small.mcap"), "/dev/full".into()];
    crate::support::small::run(&log);
    let output = asperity(&["diff", text(&log), text(&log), "--matches", text(&matches)]);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(said, "error: failed to write /dev/full: No space left on device (os error 28)\n");
}

#[test]
fn folders_that_cannot_be_written_are_named() {
    let folder = asperity_testkit::folder();
    let file = folder.path().join("file");
    fs::write(&file, "mine").expect("the folder can be written");
    let nowhere = folder.path().join("nowhere").join("run.mcap");
    let below = file.join("run.mcap");
    let run = |out: &Path| {
        let output = asperity(&["run", "default", "--set", "time.duration_s=0.01", "--out", text(out)]);
        (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (code, said) = run(&below);
    assert!(code == Some(2) && said.contains(text(&below)) && said.lines().count() == 1, "{code:?}: {said}");
    // One that is missing is created.
    assert!(run(&nowhere).0 == Some(0) && nowhere.is_file());
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
    // Nobody writes to the system's own folders, not even root.
    if cfg!(target_os = "linux") {
        let output =
            asperity(&["run", "default", "--set", "time.duration_s=0.01", "--out", "/proc/run.mcap"]);
        assert_eq!(output.status.code(), Some(1));
    }
}
