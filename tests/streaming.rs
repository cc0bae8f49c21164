//! Reductions process runs one after the other, and keep only requested data of each: their memory grows
//! neither with the number of runs nor with their length.

use std::fs;
use std::path::Path;
use std::process::Command;

use asperity_testkit::folder;

use crate::support::binary::{self, succeed, text};

/// Growth that is none: less than the states of one more run take.
const SLACK_MB: f64 = 10.0;

/// A run of that duration with four thousand states of a hundred blocks per half second, 13 MB if all are
/// kept.
fn scenario(duration_s: &str) -> Vec<String> {
    let keys = [
        "parameter_set=as-coded",
        "time.step_s=1e-7",
        "recording.fields_s=1.25e-4",
        "recording.sample_s=1.25e-4",
    ];
    keys.into_iter().map(str::to_owned).chain([format!("time.duration_s={duration_s}")]).collect()
}

/// Makes a run and logs it.
fn log(path: &Path, duration_s: &str) {
    let set = scenario(duration_s);
    let set = set.iter().flat_map(|key| ["--set", key.as_str()]);
    binary::run(&["default"].into_iter().chain(set).collect::<Vec<_>>(), path);
}

/// The largest memory of a command, MB, by the system's own account.
///
/// Of all programs that a shell can call only an interpreter gives it, so Python does.
pub(crate) fn peak_mb(arguments: &[&str]) -> f64 {
    const ASK: &str = "import resource, subprocess, sys\n\
                       code = subprocess.call(sys.argv[1:], stdout=subprocess.DEVNULL)\n\
                       print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)\n\
                       sys.exit(code)";
    let mut asked = Command::new("python3");
    asked.args(["-c", ASK, env!("CARGO_BIN_EXE_asperity")]).args(arguments);
    let output = asked.output().expect("Python starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "asperity {}: {}\n{said}", arguments.join(" "), output.status);
    String::from_utf8_lossy(&output.stdout).trim().parse().expect("Python prints a number")
}

/// Reduces that many existing copies of a run, with a figure and a claim for each; returns the memory used,
/// MB.
fn reduce(folder: &Path, log: &Path, duration_s: &str, runs: usize) -> f64 {
    let out = folder.join(format!("{runs}-{duration_s}"));
    fs::create_dir_all(out.join("runs")).expect("the folder can be made");
    let mut pipeline = "title = \"memory\"\n".to_owned();
    for run in 0..runs {
        fs::copy(log, out.join("runs").join(format!("run-{run}.mcap"))).expect("the log can be copied");
        pipeline += &format!(
            "[[run]]\nname = \"run-{run}\"\nscenario = \"default\"\nset = {:?}\n\
             [[figure.load]]\nfile = \"load-{run}.png\"\nrun = \"run-{run}\"\nsliding = true\n\
             [[claim]]\nabout = \"a\"\nquote = \"q\"\nrun = \"run-{run}\"\nmeasure = \"largest_ft_fn\"\n\
             at_least = 0.01\n",
            scenario(duration_s)
        );
    }
    let file = folder.join(format!("{runs}-{duration_s}.toml"));
    fs::write(&file, pipeline).expect("the pipeline can be written");
    let peak = peak_mb(&["reproduce", text(&file), "--out", text(&out), "--jobs", "1"]);
    let claims = fs::read_to_string(out.join("tables/claims.csv")).expect("claims are judged");
    assert_eq!(claims.matches(",agrees,").count(), runs, "{claims}");
    peak
}

#[test]
fn twice_the_runs_or_a_run_of_twice_the_length_take_no_more_memory() {
    let folder = folder();
    let [short, long] = ["short", "long"].map(|name| folder.path().join(format!("{name}.mcap")));
    log(&short, "0.5");
    log(&long, "1");
    let reduce = |log, duration_s, runs| reduce(folder.path(), log, duration_s, runs);
    let [one, two, four] = [1, 2, 4].map(|runs| reduce(&short, "0.5", runs));
    let twice_as_long = reduce(&long, "1", 1);
    assert!(four - two < SLACK_MB, "two runs take {two} MB, four {four} MB");
    assert!(
        twice_as_long - one < SLACK_MB,
        "a run takes {one} MB, one of twice the length {twice_as_long} MB"
    );
}

/// All tables of a run in a pipeline are those that it is reduced to by itself.
#[test]
fn a_run_by_itself_has_the_tables_that_it_has_in_a_pipeline() {
    let folder = folder();
    let pipeline = folder.path().join("one.toml");
    let run = "[[run]]\nname = \"one\"\nscenario = \"ten-blocks\"\n\
               set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=1.2\"]\n";
    fs::write(&pipeline, format!("title = \"one\"\n{run}")).expect("the pipeline can be written");
    let (out, alone) = (folder.path().join("out"), folder.path().join("alone"));
    succeed(&["reproduce", text(&pipeline), "--out", text(&out)]);
    succeed(&["reduce", text(&out.join("runs/one.mcap")), "--out", text(&alone)]);
    for table in ["load.csv", "load.parquet", "events.csv", "events.parquet", "ruptures.csv", "summary.json"]
    {
        let [ours, theirs] = [out.join("tables").join(format!("one.{table}")), alone.join(table)]
            .map(|path| fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display())));
        assert!(!ours.is_empty() && ours == theirs, "{table}");
    }
}
