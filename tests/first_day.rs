//! The first day with the program: every command on logs of short, small and quiet runs of every built-in
//! scenario and friction law. Each gives a result or a reason why there is none; none panics or is killed.
//!
//! Scenarios, laws and commands are queried and not listed here, so new ones are tested automatically.
//! `every_command_on_every_log` is the whole matrix, for `cargo xtask nightly`; the representative part is
//! among the tests. Every scenario also runs as it is, and the CSV files that scenarios name are those of
//! spreadsheets.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::thread;

use asperity_model::scenario::builtin;
use asperity_model::scenario::keys::{KEYS, Kind};
use asperity_model::{Plan, Scenario, ScenarioSource};
use asperity_runlog::{RunReader, Topics};

use crate::support::binary::{AS_CODED, asperity, names, succeed, text};
use crate::support::browser::{Tab, browser};
use crate::support::commands::{self, ON_LOGS, OnLog};

/// A scenario, and its overrides in every variant.
#[derive(Debug, Clone)]
struct Case {
    name: String,
    scenario: &'static str,
    set: Vec<String>,
}

/// Every built-in scenario, and the default one under every law.
fn cases() -> Vec<Case> {
    let mut cases: Vec<Case> = builtin::all()
        .map(|(scenario, _)| Case { name: scenario.to_owned(), scenario, set: Vec::new() })
        .collect();
    let law = KEYS.iter().find(|key| key.path == "friction.law").expect("there are laws");
    let Kind::Word(laws) = law.kind else { panic!("laws are words") };
    cases.extend(laws.iter().map(|law| Case {
        name: format!("law-{law}"),
        scenario: "default",
        set: vec![format!("friction.law={law}")],
    }));
    cases
}

/// The overrides of a variant of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Day {
    /// All of it, with slip events.
    Whole,
    Thousandth,
    OneStep,
    NoEvent,
    OneEvent,
    TwoBlocks,
}

const DAYS: [Day; 5] = [Day::Thousandth, Day::OneStep, Day::NoEvent, Day::OneEvent, Day::TwoBlocks];

/// Overrides that make a scenario short or small, each more than the one before.
const ROOM: [&[&str]; 4] = [
    &[],
    &["recording.window=[]"],
    &["recording.window=[]", "initial_velocity.mode=1"],
    &["slider.rows=2", "slider.height_m=0.14", "drive.height_m=0.14"],
];

/// Overrides that keep blocks from slipping: strong contacts, or nothing that moves them.
const STILL: [&[&str]; 3] = [
    &[],
    &["friction.static_coefficient=50"],
    &["prestress.ratio=0", "prestress.first_block_ratio=0", "initial_velocity.amplitude_m_per_s=0"],
];

impl Case {
    /// The scenario with this override in addition; none if that is refused.
    fn resolve(&self, set: &[String]) -> Option<Scenario> {
        let source = ScenarioSource::new(self.scenario, builtin::find(self.scenario)?);
        let source = match source.named_set() {
            None => source.with_override(AS_CODED),
            Some(_) => source,
        };
        let set = self.set.iter().chain(set);
        Scenario::resolve(&set.fold(source, |source, set| source.with_override(set))).ok()
    }

    /// Makes a run, with as little room as it needs; none if it is refused with all of it.
    fn run(&self, set: &[String], log: &Path) -> Option<()> {
        let allowed = ROOM.iter().map(|room| [set, &owned(room)].concat());
        let set = allowed.into_iter().find(|set| self.resolve(set).is_some())?;
        let set: Vec<&str> = self.set.iter().chain(&set).flat_map(|set| ["--set", set.as_str()]).collect();
        if log.exists() {
            fs::remove_file(log).expect("it is ours");
        }
        succeed(&[&["run", self.scenario, "--quiet", "--out", text(log)], &set[..]].concat());
        Some(())
    }

    /// Makes the run of a day; none if the scenario has no such day.
    fn make(&self, day: Day, log: &Path) -> Option<()> {
        let own = self.resolve(&[]).expect("what is built in is valid");
        let (duration_s, step_s) = (own.time.duration_s, Plan::new(&own).grid.step_s());
        let lasting = |duration_s: f64| format!("time.duration_s={duration_s:e}");
        let short = [1e3, 10.0].map(|part| lasting(duration_s / part));
        match day {
            Day::Whole => {
                // The slab needs a minute; running up to its first precursor is enough here.
                let until = match self.scenario {
                    "slab" => Some(lasting(0.2)),
                    // 1600 nodes until behind the first earthquake.
                    "seas-bp1-qd" | "seas-bp2-qd" => Some(lasting(6.2e9)),
                    _ => None,
                };
                self.run(until.as_slice(), log)?;
                // All but those that are about damping alone slip.
                (self.name == "ring-down" || !onsets(log).is_empty()).then_some(())
            }
            Day::Thousandth => short.iter().find_map(|short| self.run(std::slice::from_ref(short), log)),
            Day::OneStep => self.run(&[lasting(step_s)], log),
            Day::TwoBlocks => self.run(&[short[0].clone(), "slider.blocks=2".to_owned()], log),
            Day::NoEvent => STILL.iter().find_map(|still| {
                self.run(&[vec![short[0].clone()], owned(still)].concat(), log)?;
                onsets(log).is_empty().then_some(())
            }),
            Day::OneEvent => {
                // Pulled as fast as it takes, and cut after the first step of the first event.
                let fast = "drive.velocity_m_per_s=1".to_owned();
                let ways = [vec![short[0].clone()], vec![short[0].clone(), fast], vec![short[1].clone()]];
                ways.iter().find_map(|way| {
                    self.run(way, log)?;
                    let first = *onsets(log).first()?;
                    let until = lasting((first as f64 + 1.0) * step_s);
                    self.run(&[&way[1..], &[until]].concat(), log)?;
                    (onsets(log).len() == 1).then_some(())
                })
            }
        }
    }
}

fn owned(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

/// The first steps of the slip events of a log.
fn onsets(log: &Path) -> Vec<u64> {
    let table = succeed(&["events", text(log)]);
    let mut lines = table.lines();
    let column = lines.next().and_then(|head| head.split(',').position(|name| name == "onset_step"));
    let column = column.expect("events have onsets");
    lines.map(|line| line.split(',').nth(column).expect("a cell").parse().expect("a step")).collect()
}

/// Calls beside those on any log, and the accepted exit codes. `CUT` and `HALF` are half of the log under the name of an
/// unfinished one, `PIPE` a pipeline of that one run.
type Call = (&'static str, &'static [i32]);

const MORE_CALLS: [Call; 5] = [
    // A figure of data that the run lacks ends it with a message.
    ("reproduce PIPE --quiet --out NEW", &[0, 1]),
    ("note FILE comment=today", &[0]),
    ("salvage HALF.mcap.partial --out NEW.mcap", &[0, 3]),
    ("run FILE --quiet --resume --out CUT.mcap", &[0]),
    // It is whole.
    ("resume FILE", &[2]),
];

fn all_calls() -> impl Iterator<Item = Call> {
    ON_LOGS.iter().map(|OnLog { words, codes, .. }| (*words, *codes)).chain(MORE_CALLS)
}

/// Calls without a log.
const WITHOUT_LOG: [&str; 9] =
    ["recording", "refine", "sweep", "keys", "columns", "numbers", "figures", "completions", "man"];

/// Steps times blocks that the plain solver takes here.
const PLAIN: u64 = 5_000_000;

/// A log, with the files that calls need beside it.
struct Subject {
    name: String,
    log: PathBuf,
    /// Whether the plain solver would take too long.
    is_long: bool,
    /// Whether its contacts have a state.
    has_state: bool,
}

impl Subject {
    fn of(case: &Case, day: Day, folder: &Path) -> Option<Subject> {
        let name = format!("{}-{day:?}", case.name);
        let log = folder.join(format!("{name}.mcap"));
        case.make(day, &log)?;
        let bytes = fs::read(&log).expect("the log is there");
        for half in ["cut", "half"] {
            let path = folder.join(format!("{name}-{half}.mcap.partial"));
            fs::write(path, &bytes[..bytes.len() / 2]).expect("there is room");
        }
        // Of a rupture not every run has a figure.
        let figure = match day {
            Day::OneStep => "space-time = [{ file = \"a.png\", run = \"a\", which = \"widest\" }]",
            _ => "load-ruptures = [{ file = \"a.png\", run = \"a\" }]",
        };
        let pipeline = format!(
            "title = \"{name}\"\nrun = [{{ name = \"a\", scenario = \"{}\" }}]\n[figure]\n{figure}\n",
            text(&log)
        );
        fs::write(folder.join(format!("{name}.toml")), pipeline).expect("there is room");
        let reader = RunReader::open(&log, Topics::STEPS).expect("the log is whole");
        let (steps, blocks) = (reader.header().steps, u64::from(reader.header().blocks));
        let has_state = reader.header().flags.state;
        Some(Subject { name, log, is_long: steps * blocks > PLAIN, has_state })
    }

    /// Calls one command; returns what is wrong with its end.
    fn call(&self, n: usize, (words, codes): &Call) -> Result<(), String> {
        let folder = self.log.parent().expect("it is in a folder");
        let new = folder.join(format!("{}-{n}", self.name));
        let call = words
            .replace("CUT", text(&folder.join(format!("{}-cut", self.name))))
            .replace("HALF", text(&folder.join(format!("{}-half", self.name))))
            .replace("PIPE", text(&self.log.with_extension("toml")));
        let words = commands::words(&call, &[text(&self.log)], text(&new));
        let output = asperity(&commands::arguments(&words));
        let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        let wrong =
            |what: &str| Err(format!("asperity {}: {what}: {}\n{err}", words.join(" "), output.status));
        let Some(code) = output.status.code().filter(|code| codes.contains(code)) else {
            return wrong("it ends so");
        };
        if out.contains("NaN") {
            return wrong("it prints NaN");
        }
        if code != 0 && !err.contains("error: ") {
            return wrong("it does not say why");
        }
        // Its files appear complete or not at all; the runs of a pipeline are kept.
        if code != 0 && new.is_dir() && names(&new) != BTreeSet::from(["runs".to_owned()]) {
            return wrong(&format!("it leaves {:?}", names(&new)));
        }
        if new.is_dir() {
            fs::remove_dir_all(&new).expect("it is ours");
        }
        Ok(())
    }
}

/// Does something for each of many things, on all cores.
pub(crate) fn each<T: Sync, R: Send>(things: &[T], act: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (next, done) = (Mutex::new(things.iter()), Mutex::new(Vec::new()));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                loop {
                    let Some(thing) = next.lock().expect("nobody panics with it").next() else { break };
                    let result = act(thing);
                    done.lock().expect("nobody panics with it").push(result);
                }
            });
        }
    });
    done.into_inner().expect("nobody panicked with it")
}

/// Calls on a case in a variant: their number, and what is wrong with their ends; none if there is no log.
fn calls(case: &Case, day: Day, asked: impl Fn(usize, &Call) -> bool) -> Option<(usize, Vec<String>)> {
    let folder = asperity_testkit::folder();
    let subject = Subject::of(case, day, folder.path())?;
    let calls = all_calls().enumerate().filter(|(n, call)| asked(*n, call));
    let calls = calls.filter(|(_, call)| !(subject.is_long && is_plain(call)));
    // Only the adaptive solver solves laws with a state.
    let calls = calls.filter(|(_, (words, _))| !(subject.has_state && words.contains("plain")));
    let ends: Vec<Result<(), String>> = calls.map(|(n, call)| subject.call(n, &call)).collect();
    Some((ends.len(), ends.into_iter().filter_map(Result::err).collect()))
}

/// The calls that are asked for, by the numbers of the log and of the call, on each of these days. At most this share of
/// the cases may lack a day.
fn matrix(cases: &[Case], days: &[Day], may_lack: f64, asked: impl Fn(usize, usize, &Call) -> bool + Sync) {
    let logs: Vec<(&Case, Day)> =
        cases.iter().flat_map(|case| days.iter().map(move |day| (case, *day))).collect();
    let logs: Vec<(usize, (&Case, Day))> = logs.into_iter().enumerate().collect();
    let ended = each(&logs, |(log, (case, day))| {
        (*day, case.name.as_str(), calls(case, *day, |n, call| asked(*log, n, call)))
    });
    let mut without: BTreeMap<Day, BTreeSet<&str>> = BTreeMap::new();
    let (mut cells, mut logs, mut flaws) = (0, 0, Vec::new());
    for (day, name, calls) in ended {
        match calls {
            Some((count, found)) => {
                (cells, logs) = (cells + count, logs + 1);
                flaws.extend(found);
            }
            None => drop(without.entry(day).or_default().insert(name)),
        }
    }
    let mut said = format!("first day: {cells} cells, {logs} logs of {} scenarios and laws\n", cases.len());
    for (day, names) in &without {
        let names: Vec<&str> = names.iter().copied().collect();
        said += &format!("first day: no log of {day:?}: {}\n", names.join(", "));
    }
    // Not eprintln, which the test harness captures.
    std::io::stderr().write_all(said.as_bytes()).expect("stderr can be written");
    assert!(flaws.is_empty(), "{} flaws\n{}", flaws.len(), flaws.join("\n"));
    for (day, lacking) in without {
        let share = lacking.len() as f64 / cases.len() as f64;
        assert!(share <= may_lack, "{} of {} have no {day:?}", lacking.len(), cases.len());
    }
}

/// Whether a call tells if a log is whole, or if its events come again.
fn is_of_the_whole(_: usize, _: usize, (words, _): &Call) -> bool {
    matches!(*words, "check FILES" | "replay FILES")
}

/// Whether a call takes every step of the run.
fn is_plain((words, _): &Call) -> bool {
    words.contains("plain")
}

/// A chain and a slab, with springs and without, driven and not.
const REPRESENTATIVE: [&str; 4] = ["default", "front", "slab", "law-velocity-weakening"];

#[test]
fn commands_have_a_result_on_small_logs() {
    let cases: Vec<Case> =
        cases().into_iter().filter(|case| REPRESENTATIVE.contains(&case.name.as_str())).collect();
    assert_eq!(cases.len(), REPRESENTATIVE.len());
    // Others on each next day.
    matrix(&cases, &DAYS, 0.2, |log, call, _| log % 2 == call % 2);
}

#[test]
#[ignore = "the whole matrix takes most of a minute on both cores: cargo xtask nightly"]
fn every_command_on_every_log() {
    matrix(&cases(), &DAYS, 0.2, |_, _, _| true);
}

#[test]
fn every_scenario_begins_to_run_checks_and_replays() {
    matrix(&cases(), &[Day::Thousandth], 0.0, is_of_the_whole);
}

#[test]
#[ignore = "most of a minute on both cores: cargo xtask nightly"]
fn every_scenario_runs_checks_and_replays() {
    let mut cases = cases();
    cases.retain(|case| case.set.is_empty());
    assert!(cases.len() >= 17, "{cases:?}");
    matrix(&cases, &[Day::Whole], 0.0, is_of_the_whole);
}

#[test]
fn no_command_is_forgotten() {
    let help = succeed(&["--help"]);
    let below = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let named: BTreeSet<&str> = below
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.strip_prefix("  ").filter(|line| !line.starts_with(' '))?.split(' ').next())
        .filter(|name| *name != "help")
        .collect();
    let called = all_calls().filter_map(|(words, _)| words.split(' ').next()).chain(WITHOUT_LOG);
    assert_eq!(named, called.collect());
}

/// Pages of such runs show each of them without a failure of their scripts.
#[test]
fn pages_show_small_runs() {
    let Some(browser) = browser() else { return };
    let folder = asperity_testkit::folder();
    let of = |name: &str| cases().into_iter().find(|case| case.name == name).expect("it is built in");
    let days: Vec<(Case, Day)> =
        ["default", "front", "slab"].iter().flat_map(|name| DAYS.map(|day| (of(name), day))).collect();
    let logs: Vec<PathBuf> = days
        .iter()
        .filter_map(|(case, day)| {
            let log = folder.path().join(format!("{}-{day:?}.mcap", case.name));
            case.make(*day, &log).map(|()| log)
        })
        .collect();
    assert!(logs.len() > 12, "{logs:?}");
    let page = folder.path().join("page.html");
    let paths: Vec<&str> = logs.iter().map(|log| text(log)).collect();
    succeed(&[&["report"], &paths[..], &["--out", text(&page)]].concat());
    let mut tab = Tab::open(&browser, &page, [1200, 900], "light");
    for log in &logs {
        let name = log.file_stem().expect("logs have names").to_string_lossy().into_owned();
        tab.eval(&format!(
            "(() => {{ const run = document.getElementById('run'); run.value = {name:?}; \
             run.dispatchEvent(new Event('change')); }})()"
        ));
        tab.painted();
        assert_eq!(tab.says("document.documentElement.dataset.run"), name);
    }
    tab.assert_quiet();
    for log in paths.iter().step_by(3) {
        let page = format!("{log}.html");
        succeed(&["diff", log, log, "--page", &page]);
        tab.go(page.as_ref(), [1200, 900], "dark");
        tab.assert_quiet();
    }
}

/// All keys that name a CSV file read it as spreadsheets and people write it. Excel's mark, quoted headings and blanks
/// behind commas were refused, with `\u{feff}` in messages.
#[test]
fn csv_files_of_spreadsheets_are_read() {
    let folder = asperity_testkit::folder();
    let file = folder.path().join("table.csv");
    for (key, table) in [
        ("initial_shear.profile_csv", "x_over_l,tau_over_p|0,0.2|1,0.1"),
        ("prestress.profile_csv", "x_over_l,tau_over_p|0,0.2|1,0.1"),
        ("normal_load.course_csv", "time_s,x_over_l,factor|0.1,0,1|0.1,1,1"),
        ("prestress.course_csv", "time_s,x_over_l,ratio|0.1,0,1|0.1,1,1"),
        ("disorder.contacts_csv", "static_offset,load_offset|0,0|0.01,0|0,0"),
        (
            "initial.state_csv",
            "displacement_m,velocity_m_per_s,stick_position_m,slides|0,0,0,0|1e-6,0,1e-6,0|0,0,0,0",
        ),
        ("friction.initial_csv", "x_over_l,velocity_m_per_s,theta_s|0,1e-5,0.1|1,1e-4,1e-2"),
    ] {
        let set = format!("{key}={}", text(&file));
        let read = |written: &str| {
            fs::write(&file, written).expect("it can be written");
            let show = ["--set", &set, "--set", "drive.kind=top", "--set", "slider.blocks=3"];
            let scenario = if key.starts_with("friction") { "rate-and-state" } else { "default" };
            let more = ["--set", "friction.evolution_offsets=[]"];
            let more = if scenario == "default" { &[][..] } else { &more };
            let output = asperity(&[&["scenario", "show", scenario], &show[..], more].concat());
            let [out, err] =
                [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            (output.status.code(), out, err)
        };
        let lines = |end: &str| table.replace('|', end);
        let plain = read(&lines("\n"));
        assert_eq!(plain.0, Some(0), "{key}: {}", plain.2);
        assert_eq!(read(&format!("\u{feff}{}\r\n", lines("\r\n"))), plain);
        assert_eq!(read(&format!(" \"{}\"", lines("\" \n\n \"").replace(',', "\" ,\t\""))), plain);
        let (code, _, err) = read(&format!("\u{feff}{}", lines("\r\n").replace(',', ";").replace('.', ",")));
        assert!(code == Some(2) && !err.contains("feff") && !err.contains('\u{feff}'), "{key}: {err}");
    }
}
