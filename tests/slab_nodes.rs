//! The nodes of a slab at any time, which no log contains: `asperity export --nodes-at-s`.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use asperity_model::Plan;
use asperity_model::resolve;

use crate::slab::COARSE;
use crate::support::binary::{ends, outcome, rows, run, succeed, text, with_sets};
use crate::support::clients::file;

/// Runs a coarse slab with states all along.
fn slab(log: &Path, more: &[&str]) {
    let slab = with_sets(&["slab", "--set", "recording.fields_s=0.05"], &COARSE);
    run(&[&slab[..], more].concat(), log);
}

/// The values of some columns of a table, by the texts of others.
fn columns(table: &str, by: &[&str], of: &[&str]) -> BTreeMap<Vec<String>, Vec<String>> {
    let cells = |row: &BTreeMap<String, String>, names: &[&str]| {
        names.iter().map(|name| row[*name].clone()).collect()
    };
    rows(table.as_bytes()).iter().map(|row| (cells(row, by), cells(row, of))).collect()
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).expect("the table was written")
}

/// At the start, where states were recorded, at the onset and the end of a precursor, and anywhere else;
/// out of a log with checkpoints, and out of one without any.
fn compare(solver: &str) {
    let folder = asperity_testkit::folder();
    let log = folder.path().join("slab.mcap");
    slab(&log, &["--solver", solver, "--checkpoint-s", "0"]);
    let out = folder.path().join("out");
    let times = ["0", "0.1", "0.15", "0.2001508", "0.2002004", "0.2012344"];
    let asked: Vec<&str> = times.iter().flat_map(|at| ["--nodes-at-s", *at]).collect();
    let export = |log: &Path, out: &Path| {
        let common = ["export", text(log), "--to", "csv", "--topic", "/fields", "--out", text(out)];
        succeed(&[&common[..], &asked].concat())
    };
    export(&log, &out);
    let nodes = read(&out.join("slab.nodes.csv"));
    assert_eq!(nodes.lines().count(), 1 + times.len() * 29 * 16);
    let of = ["displacement_x_m", "velocity_x_m_per_s"];
    let of_nodes = columns(&nodes, &["row", "step", "column"], &of);
    let recorded = columns(
        &read(&out.join("slab.fields.csv")),
        &["step", "block"],
        &["displacement_m", "velocity_m_per_s"],
    );
    // The state of a contact has the same text as that of its node, except inside leaps of the fast solver,
    // where samples omit negligible terms.
    let mut compared = 0;
    for (at, cells) in of_nodes.iter().filter(|(at, _)| at[0] == "1") {
        let Some(expected) = recorded.get(&at[1..]) else { continue };
        let is_leapt = solver == "fast" && ["250000", "375000"].contains(&&*at[1]);
        if is_leapt {
            for ((found, expected), scale) in cells.iter().zip(expected).zip([1e-6, 1e-4]) {
                let off =
                    found.parse::<f64>().expect("a number") - expected.parse::<f64>().expect("a number");
                assert!(off.abs() < 1e-10 * scale, "step {}, block {}: {found}, {expected}", at[1], at[2]);
            }
        } else {
            assert_eq!(cells, expected, "step {}, block {}", at[1], at[2]);
        }
        compared += 1;
    }
    assert_eq!(compared, 5 * 29, "all but the last time are recorded");
    // Every node of the start is where the slab rests.
    let plan = Plan::new(&resolve("slab", &COARSE).expect("it is valid"));
    let places = columns(&nodes, &["step", "row", "column"], &["displacement_x_m", "displacement_z_m"]);
    for node in 0..29 * 16 {
        let (row, column) = (node / 29 + 1, node % 29 + 1);
        let cells = &places[&["0".to_owned(), row.to_string(), column.to_string()][..]];
        let u = &plan.initial.displacement_m;
        let found: Vec<f64> = cells.iter().map(|cell| cell.parse().expect("a number")).collect();
        assert_eq!(found, [u[node], u[29 * 16 + node]], "row {row}, column {column}");
    }
    // The result is the same for a log without a checkpoint to continue from.
    let other = folder.path().join("other/slab.mcap");
    fs::create_dir(folder.path().join("other")).expect("the folder can be written");
    slab(&other, &["--solver", solver, "--checkpoint-s", "1e6"]);
    let again = folder.path().join("again");
    export(&other, &again);
    assert!(read(&again.join("slab.nodes.csv")) == nodes, "a checkpoint changes nothing");
}

#[test]
fn nodes_are_those_of_a_run_by_single_steps() {
    compare("plain");
}

#[test]
fn nodes_are_those_of_a_run_by_leaps() {
    compare("fast");
}

#[test]
fn nodes_that_cannot_be_told_are_refused_with_the_reason() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let (short, chain, damaged) = (path("short.mcap"), path("chain.mcap"), path("damaged.mcap"));
    slab(&short, &["--set", "time.duration_s=0.001", "--set", "recording.fields_s=0"]);
    run(&["ten-blocks", "--set", "time.step_s=1e-7", "--set", "time.duration_s=0.02"], &chain);
    let mut bytes = fs::read(&short).expect("the log can be read");
    let chunk = bytes.windows(8).position(|found| found == b"\x04\0\0\0zstd").expect("it has a chunk");
    bytes[chunk + 24..chunk + 40].fill(0);
    fs::write(&damaged, &bytes).expect("the log can be written");
    let old = file("fixtures/logs/interrupted.mcap");
    let out = path("out");
    for (log, arguments, code, said) in [
        (&short, &["--nodes-at-s", "0.0011"][..], 2, "no state at 0.0011 s (accepted: 0 to 0.001 s)"),
        (&short, &["--nodes-at-s=-1"], 2, "no state at -1 s (accepted: 0 to 0.001 s)"),
        (&short, &["--nodes-at-s", "NaN"], 2, "no state at NaN s"),
        (&short, &["--topic", "/nodes"], 2, "--topic /nodes: no log has it, and no time is given"),
        (&chain, &["--nodes-at-s", "0"], 2, "a chain has no nodes but its blocks"),
        (&damaged, &["--nodes-at-s", "0.001"], 4, "the log is damaged"),
        (&old, &["--nodes-at-s", "0"], 2, "(accepted: a run by this program)"),
    ] {
        let common = ["export", text(log), "--to", "csv", "--out", text(&out)];
        ends(code, &[&common[..], arguments].concat(), &[said]);
        let left = fs::read_dir(&out).map_or(0, Iterator::count);
        assert_eq!(left, 0, "{arguments:?} leaves files");
    }
    // A collection that named such files was no XML, or named others.
    for name in ["a\u{1b}b.mcap", "a\nb.mcap"] {
        fs::copy(&short, path(name)).expect("it can be written");
        let vtk = ["--to", "vtk", "--nodes-at-s", "0.0005", "--out", text(&out)];
        ends(2, &[&["export", text(&path(name))], &vtk[..]].concat(), &["(accepted: a name in UTF-8"]);
        assert!(!out.exists(), "{name:?} leaves files");
    }
}

/// The part before a cut or a damage is as sound as that of a complete log; it used to be refused, since
/// the end of the log was read first.
#[test]
fn nodes_of_a_log_that_breaks_off_are_those_of_the_whole_one() {
    let folder = asperity_testkit::folder();
    let file = |name: &str| folder.path().join(name);
    let log = file("slab.mcap");
    slab(&log, &[]);
    let bytes = fs::read(&log).expect("it was just written");
    let ask = |log: &Path, at_s: &str, out: &str| {
        let out = file(out);
        let common = ["export", text(log), "--to", "csv", "--topic", "/nodes", "--out", text(&out)];
        let times = ["--nodes-at-s", "0", "--nodes-at-s", at_s];
        let (code, _, said) = outcome(&[&common[..], &times].concat());
        (code, said, out)
    };
    let (code, _, whole) = ask(&log, "0.1", "whole");
    assert_eq!(code, 0);
    let expected = read(&whole.join("slab.nodes.csv"));
    let (cut, damaged) = (file("cut.mcap"), file("damaged.mcap"));
    let end = bytes.windows(7).rposition(|found| found == b"run_end").expect("it has an end");
    fs::write(&cut, &bytes[..end]).expect("the folder can be written");
    let mut changed = bytes.clone();
    changed[end] ^= 4;
    fs::write(&damaged, &changed).expect("the folder can be written");
    let salvaged = file("salvaged.mcap");
    succeed(&["salvage", text(&cut), "--out", text(&salvaged)]);
    for (log, expected_code, word) in
        [(&cut, 3, "incomplete"), (&damaged, 4, "damaged"), (&salvaged, 5, "salvaged with gaps")]
    {
        let (code, said, out) = ask(log, "0.1", word);
        assert!(code == expected_code && said.contains(word), "{code}: {said}");
        let name = log.file_stem().expect("it has a name").to_string_lossy();
        assert!(read(&out.join(format!("{name}.nodes.csv"))) == expected, "{word}: other nodes");
    }
    // Beyond the end.
    let short = file("short.mcap");
    fs::write(&short, &bytes[..bytes.len() / 4]).expect("the folder can be written");
    let (code, said, _) = ask(&short, "0.205", "short");
    assert!(code == 3 && said.contains("--nodes-at-s: ") && said.contains("incomplete"), "{code}: {said}");
}
