//! `recording.energies = "none"`: a run is the same without its energies, and everything that reads logs
//! works without them and says so.

use std::fs;
use std::path::{Path, PathBuf};

use asperity_record::{Record, RunEnd, StepRecord};
use asperity_runlog::{Existing, LogItem, RunReader, RunWriter, Topics};
use asperity_testkit::{read_log, run_end};

use crate::support::binary::{asperity, goes_on, run, succeed, text};

const NONE: [&str; 2] = ["--set", "recording.energies=none"];
const SAID: &str =
    "its records have no energies, so all that needs them is empty (recording.energies = \"none\"";

const CHAIN: [&str; 7] =
    ["default", "--set", "slider.blocks=30", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1"];
const TOP: [&str; 7] = [
    "top-driven",
    "--set",
    "time.step_s=1e-7",
    "--set",
    "time.duration_s=0.1",
    "--set",
    "drive.velocity_m_per_s=0.05",
];
const SLAB: [&str; 9] = [
    "slab",
    "--set",
    "slider.blocks=29",
    "--set",
    "slider.rows=16",
    "--set",
    "time.step_s=4e-7",
    "--set",
    "time.duration_s=0.21",
];
const STATED: [&str; 2] = ["--set", "parameter_set=as-stated"];

/// The items of a log of that scenario.
fn logged(path: &Path, scenario: &[&str], more: &[&str]) -> (Vec<LogItem>, RunEnd) {
    run(&[scenario, more].concat(), path);
    read_log(path).unwrap_or_else(|error| panic!("{error}"))
}

/// A log without energies, of the chain.
fn without(folder: &Path) -> PathBuf {
    let log = folder.join("without.mcap");
    run(&[&CHAIN[..], &NONE].concat(), &log);
    log
}

/// Exit code, and what was said.
fn outcome(arguments: &[&str]) -> (Option<i32>, String) {
    let output = asperity(arguments);
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8(said).expect("the binary writes UTF-8"))
}

/// The cells of a table of events that do not speak of energies.
fn without_energies(table: &str) -> Vec<Vec<String>> {
    let mut rows = csv::ReaderBuilder::new().comment(Some(b'#')).from_reader(table.as_bytes());
    let columns = rows.headers().expect("a table has a header").clone();
    let kept: Vec<usize> = (0..columns.len()).filter(|n| !columns[*n].ends_with("_j")).collect();
    let cells = |row: &csv::StringRecord| kept.iter().map(|n| row[*n].to_owned()).collect::<Vec<_>>();
    let rows = rows.records().map(|row| cells(&row.expect("it is CSV")));
    std::iter::once(cells(&columns)).chain(rows).collect()
}

/// Whole numbers and words alike, others within 1e-9 of each other.
fn same_tables(with: &str, without: &str, is_exact: bool) {
    let (with, without) = (without_energies(with), without_energies(without));
    assert_eq!(with.len(), without.len());
    for (with, without) in with.iter().zip(&without) {
        assert_eq!(with.len(), without.len());
        for (a, b) in with.iter().zip(without) {
            let is_near = || match (a.parse::<f64>(), b.parse::<f64>()) {
                (Ok(x), Ok(y)) if a.parse::<i64>().is_err() => (x - y).abs() <= 1e-9 * x.abs(),
                _ => false,
            };
            assert!(a == b || (!is_exact && is_near()), "{a} and {b}");
        }
    }
}

/// Every table of events, row by row, and every switch. Loads of the fast solver may differ in their last
/// digits, since what it spends on energies decides how it cuts up the steps.
#[test]
fn switches_events_and_tables_are_those_of_the_run_with_energies() {
    for (scenario, more, is_exact) in [
        (&CHAIN[..], &[][..], false),
        (&CHAIN, &STATED, false),
        (&TOP, &[], false),
        (&SLAB, &[], true),
        (&CHAIN, &["--solver", "plain"], true),
        (&[&CHAIN[..], &STATED].concat(), &["--solver", "plain"], true),
    ] {
        let folder = asperity_testkit::folder();
        let path = |name: &str| folder.path().join(name);
        let (with, _) = logged(&path("with.mcap"), scenario, more);
        let (without, end) = logged(&path("without.mcap"), scenario, &[more, &NONE].concat());
        assert_eq!(end.energy, None, "{scenario:?}");
        let steps = |items: &[LogItem]| -> Vec<StepRecord> {
            let of = |item: &LogItem| match item {
                LogItem::Record(Record::Step(step)) => Some(step.clone()),
                _ => None,
            };
            items.iter().filter_map(of).collect()
        };
        let (with, without) = (steps(&with), steps(&without));
        assert_eq!(with.len(), without.len(), "{scenario:?}");
        assert!(with.iter().any(|step| !step.switches.is_empty()), "{scenario:?}");
        for (with, without) in with.iter().zip(&without) {
            assert!(with.energy.is_some() && without.energy.is_none(), "{scenario:?}, step {}", with.step);
            let switches = |step: &StepRecord| -> Vec<_> {
                step.switches.iter().map(|switch| (switch.block, switch.direction)).collect()
            };
            assert_eq!((with.step, switches(with)), (without.step, switches(without)), "{scenario:?}");
        }
        let tables = |name: &str| {
            let (log, out) = (path(&format!("{name}.mcap")), path(name));
            succeed(&["export", text(&log), "--to", "csv", "--out", text(&out)]);
            ["events.slip", "events.onset", "events.global", "events.rupture", "events.arrival", "switch"]
                .map(|topic| fs::read_to_string(out.join(format!("{name}.{topic}.csv"))).expect("a table"))
        };
        for (with, without) in tables("with").iter().zip(&tables("without")) {
            same_tables(with, without, is_exact);
        }
    }
}

/// What is said of a run without energies, by all who read its log.
#[test]
fn a_log_without_energies_is_read_by_all_and_what_is_missing_is_said() {
    let folder = asperity_testkit::folder();
    let log = without(folder.path());
    let out = |name: &str| folder.path().join(name);
    for again in [&["check"][..], &["check", "--again"]] {
        let (code, said) = outcome(&[again, &[text(&log)]].concat());
        assert!(code == Some(0) && said.contains(": whole: "), "{said}");
    }
    assert!(succeed(&["replay", text(&log)]).contains("the same as logged"));
    // Neither in the records nor at the end.
    assert_eq!(run_end(&log).energy, None);
    let bytes = fs::read(&log).expect("it can be read");
    assert!(!bytes.windows(7).any(|window| window == b"energy:"));

    let (code, said) = outcome(&["export", text(&log), "--to", "csv", "--out", text(&out("tables"))]);
    assert!(code == Some(0) && said.contains(SAID), "{said}");
    let steps = fs::read_to_string(out("tables").join("without.step.csv")).expect("a table");
    assert!(steps.lines().any(|line| line.ends_with("ft_fn,sliding,switches")), "{steps:.300}");

    let (code, said) = outcome(&["summary", text(&log)]);
    assert!(code == Some(0) && said.contains(SAID), "{said}");
    assert!(said.contains("drive work                             -"), "{said}");
    let with = out("with.mcap");
    run(&CHAIN, &with);
    assert!(!outcome(&["summary", text(&with)]).1.contains(SAID));
    let (code, said) = outcome(&["diff", text(&with), text(&log)]);
    assert!(code == Some(0) && said.contains("nothing differs"), "{said}");

    // A salvaged log is one as well.
    let damaged = out("damaged.mcap");
    fs::write(&damaged, &bytes[..bytes.len() * 2 / 3]).expect("the folder can be written");
    let salvaged = out("salvaged.mcap");
    let (code, said) = outcome(&["salvage", text(&damaged), "--out", text(&salvaged)]);
    assert_eq!(code, Some(0), "{said}");
    assert_eq!(outcome(&["check", text(&salvaged)]).0, Some(5));
}

#[cfg(feature = "analysis")]
#[test]
fn a_log_without_energies_is_reduced_and_reported() {
    let folder = asperity_testkit::folder();
    let log = without(folder.path());
    let (tables, page) = (folder.path().join("tables"), folder.path().join("page.html"));
    let (code, said) = outcome(&["reduce", text(&log), "--out", text(&tables)]);
    assert!(code == Some(0) && said.contains(SAID), "{said}");
    succeed(&["report", text(&log), "--out", text(&page)]);
    let page = fs::read_to_string(page).expect("the page is there");
    assert!(page.contains("No energies: recording.energies = &quot;none&quot;."));
}

/// However much of its log a run that was killed leaves behind, it ends with the same messages.
#[test]
fn a_run_without_energies_is_gone_on_with() {
    for scenario in [&CHAIN[..], &SLAB] {
        goes_on(&[&["run"], scenario, &NONE].concat(), &[3, 7]);
    }
}

/// A log with the header and the scenario of one and the records of another.
fn forged(header_of: &Path, records_of: &Path, out: &Path) {
    let header = RunReader::open(header_of, Topics::ALL).expect("a log");
    let mut records = RunReader::open(records_of, Topics::ALL).expect("a log");
    let kinds = asperity_run::detectors::event_kinds();
    let scenario = header.scenario_toml();
    let mut writer =
        RunWriter::create(out, Existing::Refuse, header.header(), scenario, &kinds).expect("a new log");
    while let Some(item) = records.next_item().expect("the log is whole") {
        match item {
            LogItem::Record(record) => writer.record(&record).expect("it can be written"),
            LogItem::Event(event) => writer.event(&event).expect("it can be written"),
        }
    }
    let end = records.verify().expect("the log is whole");
    writer.finish(end.status, end.solver).expect("it can be written");
}

/// The scenario says whether there are energies; a log that does not agree with it is seen where its run
/// is made again.
#[test]
fn energies_that_the_scenario_does_not_ask_for_are_seen_and_so_are_missing_ones() {
    let folder = asperity_testkit::folder();
    let without = without(folder.path());
    let path = |name: &str| folder.path().join(name);
    run(&CHAIN, &path("with.mcap"));
    let other = "the run, made again, gives another record";
    for (header_of, records_of, name, expected) in [
        (&without, &path("with.mcap"), "more.mcap", other),
        (&path("with.mcap"), &without, "less.mcap", other),
        (&without, &without, "same.mcap", ": whole: "),
    ] {
        forged(header_of, records_of, &path(name));
        let (code, said) = outcome(&["check", "--again", text(&path(name))]);
        assert!(said.contains(expected), "{said}");
        assert_eq!(code, Some(if name == "same.mcap" { 0 } else { 4 }), "{said}");
    }
}

/// Only where runs are stopped by their energies is it a loss not to have any.
#[test]
fn a_long_step_without_energies_is_warned_of_and_not_stopped() {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("long.mcap");
    let long = ["rigid-contacts", "--set", "slider.blocks=24", "--set", "time.step_s=2.5e-6", "--out"];
    let (code, said) = outcome(&[&["run"], &long[..], &[text(&log)], &NONE].concat());
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("recording.energies = \"none\": with so long a step"), "{said}");
    assert_eq!(outcome(&["check", text(&log)]).0, Some(0));
}

/// Figures of a study ask for what its runs have.
#[test]
fn figures_of_energies_are_refused_where_no_run_has_any() {
    let folder = asperity_testkit::folder();
    let write = |set: &str, axis: &str, y: &str| {
        let sweep = format!(
            "title = 'Tilts'\nscenario = 'default'\n\
             set = ['slider.blocks=20', 'time.step_s=1e-7', 'time.duration_s=0.5'{set}]\n\
             [[axis]]\nkey = 'normal_load.tilt'\nvalues = [-0.5, 0.5]\n{axis}\
             [[figure.family]]\nfile = 'family.png'\nx = 'normal_load.tilt'\ny = '{y}'\n"
        );
        fs::write(folder.path().join("sweep.toml"), sweep).expect("the folder can be written");
    };
    let none = ", 'recording.energies=none'";
    let both = "[[axis]]\nkey = 'recording.energies'\nvalues = ['every-record', 'none']\n";
    let sweep = folder.path().join("sweep.toml");
    let plan =
        |name: &str| outcome(&["sweep", "plan", text(&sweep), "--out", text(&folder.path().join(name))]);
    let refusal = "figure.family \"family.png\": y = \"friction_heat_j\" is an energy, and by recording.energies = \
                   \"none\" no run has any (accepted: another number, or recording.energies = \"every-record\")";

    write(none, "", "friction_heat_j");
    let (code, said) = plan("refused");
    assert!(code == Some(2) && said.contains("sweep.toml: ") && said.contains(refusal), "{said}");
    write("", &format!("{both}# both\n"), "friction_heat_j");
    let with_colour = fs::read_to_string(&sweep).expect("it is there") + "colour = 'recording.energies'\n";
    fs::write(&sweep, with_colour).expect("the folder can be written");
    assert_eq!(plan("both").0, Some(0));
    write(none, "", "first_slip_ft_fn");
    assert_eq!(plan("study").0, Some(0));
    let study = folder.path().join("study");
    succeed(&["sweep", "run", text(&study), "--jobs", "1"]);
    let collect = ["sweep", "collect", text(&study), "--to", "csv", "--out"];
    succeed(&[&collect[..], &[text(&folder.path().join("tables"))]].concat());
    #[cfg(feature = "analysis")]
    {
        write(none, "", "friction_heat_j");
        let (code, said) = outcome(&["sweep", "draw", text(&study), "--from", text(&sweep)]);
        assert!(code == Some(2) && said.contains("sweep.toml: ") && said.contains(refusal), "{said}");
    }
}
