//! A slab goes all the way that a chain goes: logged, checked, replayed, exported, reduced, drawn. What is
//! left of a log that breaks off is in `slab_nodes.rs`.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary;
use crate::support::binary::{outcome, rows, succeed, text, with_sets};
use asperity_numbers::Summary;
use asperity_record::Record;
use asperity_runlog::LogItem;
use asperity_testkit::{read_log, run_end};

/// A coarse slab, through its first precursor.
pub(crate) const COARSE: [&str; 4] =
    ["slider.blocks=29", "slider.rows=16", "time.step_s=4e-7", "time.duration_s=0.21"];

/// Runs it with further overrides.
fn run(folder: &Path, name: &str, sets: &[&str]) -> PathBuf {
    let log = folder.join(name);
    binary::run(&with_sets(&["slab"], &[&COARSE, sets].concat()), &log);
    log
}

#[test]
fn a_slab_is_logged_and_comes_back() {
    let folder = asperity_testkit::folder();
    let log = run(folder.path(), "slab.mcap", &[]);
    let said = succeed(&["check", text(&log)]);
    assert!(said.contains(": whole: "), "{said}");
    let events = succeed(&["events", text(&log)]);
    assert_eq!(events.lines().count(), 2, "{events}");
    assert_eq!(succeed(&["replay", "--format", "csv", text(&log)]), events);
    // The scenario in the log is the whole of it.
    let again = folder.path().join("again.mcap");
    binary::run(&[text(&log)], &again);
    assert_eq!(run_end(&again).digest, run_end(&log).digest);
    // Both solvers give the same events; the fast one jumps over most of the steps.
    let plain = folder.path().join("plain.mcap");
    binary::run(&[text(&log), "--solver", "plain"], &plain);
    let of_plain = succeed(&["events", text(&plain)]);
    assert_eq!(of_plain.lines().count(), events.lines().count());
    for (fast, plain) in events.lines().zip(of_plain.lines()) {
        for (fast, plain) in fast.split(',').zip(plain.split(',')) {
            let numbers = (fast.parse::<f64>(), plain.parse::<f64>());
            let is_close = matches!(numbers, (Ok(a), Ok(b)) if (a - b).abs() < 1e-14);
            assert!(fast == plain || is_close, "{fast} and {plain}");
        }
    }
    let (fast, plain) = (run_end(&log), run_end(&plain));
    assert!(fast.solver.fallbacks.is_empty() && plain.solver.fallbacks.is_empty());
    assert!(fast.solver.counts["jump_steps"] > 450_000, "{:?}", fast.solver);
    assert_eq!(plain.solver.counts["plain_steps"], 525_000);
    let summary = succeed(&["summary", text(&log)]);
    assert!(summary.contains("precursor count                        1"), "{summary}");
    assert!(
        summary.contains("length law                             -"),
        "the theory is of chains: {summary}"
    );
}

#[test]
fn states_of_a_slab_say_what_each_contact_bears() {
    let folder = asperity_testkit::folder();
    let log = run(folder.path(), "slab.mcap", &["time.duration_s=0.02"]);
    let out = folder.path().join("tables");
    succeed(&["export", text(&log), "--topic", "/fields", "--to", "csv", "--out", text(&out)]);
    let table = fs::read_to_string(out.join("slab.fields.csv")).expect("the table was written");
    let number = |row: &BTreeMap<String, String>, column: &str| row[column].parse().expect("a number");
    let of_start: Vec<(f64, f64)> = rows(table.as_bytes())
        .iter()
        .filter(|row| row["step"] == "0")
        .map(|row| (number(row, "tangential_force_n"), number(row, "normal_load_n")))
        .collect();
    assert_eq!(of_start.len(), 29);
    let ratio = of_start[0].0 / of_start[0].1;
    assert!((ratio - -0.206473199).abs() < 1e-9, "{ratio}");
    let borne_n: f64 = of_start.iter().map(|(_, load)| load).sum();
    assert!((borne_n - 1920.0).abs() < 1e-9, "{borne_n}");
    // A chain's table is as it was.
    let chain = folder.path().join("chain.mcap");
    binary::run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.02"], &chain);
    succeed(&["export", text(&chain), "--topic", "/fields", "--to", "csv", "--out", text(&out)]);
    let table = fs::read_to_string(out.join("chain.fields.csv")).expect("the table was written");
    assert!(table.lines().next().expect("a header").ends_with(",detached"), "{table}");
}

#[test]
fn a_slab_is_drawn_and_reported() {
    let folder = asperity_testkit::folder();
    let log = run(folder.path(), "slab.mcap", &[]);
    let out = folder.path().join("out");
    succeed(&["reduce", text(&log), "--out", text(&out)]);
    let figures = fs::read_dir(&out).expect("the folder was made").count();
    assert!(figures > 3, "{figures} files");
    // The length laws are for chains, so its precursors are compared with none.
    for (table, empty) in [
        ("precursors.csv", &["law", "ft_fn_law", "residual"][..]),
        ("precursor-ruptures.csv", &["law", "ft_fn_law", "residual"]),
        ("residuals.csv", &["law", "rms", "max", "rms_over_mu_d"]),
    ] {
        let text = fs::read_to_string(out.join(table)).expect("the table was written");
        let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let header = lines.next().expect("a header");
        let rows: Vec<_> = lines.collect();
        assert!(!rows.is_empty() && empty.iter().all(|column| header.contains(column)), "{text}");
        for row in rows {
            for (column, cell) in header.iter().zip(row) {
                assert_eq!(cell.is_empty(), empty.contains(column), "{table}: {column} {cell}");
            }
        }
    }
    let page = folder.path().join("slab.html");
    succeed(&["report", text(&log), "--out", text(&page)]);
    let page = fs::read_to_string(&page).expect("the page was written");
    assert!(page.contains("whose bottom row rubs, 29 × 16 nodes"), "its sketch is one of a slab");
}

/// A slab that tips: most of its motion happens without load, but counts as slip events.
#[test]
fn contacts_in_the_air_are_counted_apart_and_warned_of() {
    let folder = asperity_testkit::folder();
    let tips = [
        "slider.length_m=0.03",
        "slider.height_m=0.15",
        "slider.blocks=5",
        "slider.rows=21",
        "slider.mass_kg=7.56",
        "drive.height_m=0.105",
        "friction.static_coefficient=1.5",
        "friction.dynamic_coefficient=1",
        "drive.velocity_m_per_s=0.2",
        "time.step_s=4e-6",
        "time.duration_s=0.1",
        "recording.fields_s=4e-6",
    ];
    let mut found = Vec::new();
    for solver in ["plain", "fast"] {
        let log = folder.path().join(format!("{solver}.mcap"));
        let run = ["run", "slab", "--solver", solver, "--out", text(&log)];
        let (_, _, told) = outcome(&with_sets(&run, &tips));
        let summary = succeed(&["summary", "--format", "json", text(&log)]);
        let summary: Summary = serde_json::from_str(&summary).expect("it is a summary");
        let in_air = summary.contact_steps_in_air.expect("the solver counts them");
        let note = format!(
            "{} of its {} slip events involve only contacts without load, which rub on nothing; contacts \
             were in the air for {in_air} steps",
            summary.unloaded_event_count, summary.event_count
        );
        assert!(told.contains(&note), "{told}");
        // The states of all steps show which contacts bear no load.
        let (items, end) = read_log(&log).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(end.solver.counts["contact_steps_in_air"], in_air);
        let states = items.iter().filter_map(|item| match item {
            LogItem::Record(Record::Fields(state)) if state.step > 0 => {
                Some((state.step, &state.normal_load_n))
            }
            _ => None,
        });
        let states: BTreeMap<u64, &Vec<f64>> = states.collect();
        assert_eq!(states.len(), 25_000);
        let bear_nothing =
            states.values().flat_map(|loads| loads.iter()).filter(|load_n| **load_n == 0.0).count();
        assert_eq!(bear_nothing as u64, in_air);
        found.push([
            in_air,
            summary.event_count,
            summary.unloaded_event_count,
            summary.unloaded_contact_count,
        ]);
    }
    assert_eq!(found[0], found[1]);
    let [in_air, events, unloaded, contacts] = found[0];
    assert!(in_air > 50_000 && unloaded > 900 && unloaded < events && contacts < 5, "{found:?}");
    // One that does not tip has none, and no warning.
    let stands = run(folder.path(), "stands.mcap", &[]);
    let (_, summary, said) = outcome(&["summary", "--format", "json", text(&stands)]);
    let summary: Summary = serde_json::from_str(&summary).expect("it is a summary");
    assert_eq!((summary.contact_steps_in_air, summary.unloaded_event_count), (Some(0), 0));
    assert!(!said.contains("without load"));
}
