//! Every scenario that comes with the program: it runs, its log is whole, and a replay finds
//! the same events; and the CSV files that a scenario names.

use std::fs;

use asperity_model::{Scenario, ScenarioSource, builtin};

use crate::support::binary::{asperity, run, succeed, text};

#[test]
fn every_scenario_begins_to_run_checks_and_replays() {
    run_all(8.0);
}

#[test]
#[ignore = "most of a minute: cargo xtask nightly"]
fn every_scenario_runs_checks_and_replays() {
    run_all(1.0);
}

/// An override for that fraction of a scenario's duration; none if its windows or schedules forbid it.
fn shortened(name: &str, parts: f64) -> Option<String> {
    let source = ScenarioSource::new(name, builtin::find(name)?);
    let duration_s = Scenario::resolve(&source).ok()?.time.duration_s;
    let set = format!("time.duration_s={:e}", duration_s / parts);
    Scenario::resolve(&source.with_override(&set)).is_ok().then_some(set)
}

/// All of them, each for its duration divided by `parts`.
fn run_all(parts: f64) {
    let list = succeed(&["scenario", "list"]);
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 17, "{list}");
    let folder = asperity_testkit::folder();
    let one = |name: &str| {
        let log = folder.path().join(format!("{name}.mcap"));
        // The slab needs a minute; running up to its first precursor is enough here.
        let set = match name {
            "slab" => Some("time.duration_s=0.2".to_owned()),
            _ if parts > 1.0 => shortened(name, parts),
            _ => None,
        };
        let sets: Vec<&str> = set.iter().flat_map(|set| ["--set", set.as_str()]).collect();
        run(&[&[name], &sets[..]].concat(), &log);
        let said = succeed(&["check", text(&log)]);
        assert!(said.contains(": whole: "), "{said}");
        assert!(succeed(&["replay", text(&log)]).contains("the same as logged"), "{name}");
        // All but those that are about damping alone slip.
        let slips = succeed(&["events", text(&log)]).lines().count() - 1;
        assert!(slips > 0 || name == "ring-down" || parts > 1.0, "{name}: no slip events");
    };
    let half = names.len() / 2;
    std::thread::scope(|scope| {
        for part in [&names[..half], &names[half..]] {
            scope.spawn(|| part.iter().for_each(|name| one(name)));
        }
    });
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
    ] {
        let set = format!("{key}={}", text(&file));
        let read = |written: &str| {
            fs::write(&file, written).expect("it can be written");
            let show = ["--set", &set, "--set", "drive.kind=top", "--set", "slider.blocks=3"];
            let output = asperity(&[&["scenario", "show", "default"], &show[..]].concat());
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
