//! `asperity recording`: recordings against the rows of an independent program in `fixtures/recordings`, as tables of
//! their logs; and what other commands make of such a log.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::binary::{outcome, succeed, text};

fn fixture(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/recordings").join(path)
}

/// Reads a recording into a log of that name.
fn read(name: &str, folder: &Path) -> PathBuf {
    let log = folder.join(format!("{name}.mcap"));
    let description = fixture(&format!("{name}/recording.toml"));
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&log)]);
    log
}

type Row = BTreeMap<String, String>;

fn rows(path: &Path) -> Vec<Row> {
    let mut reader = csv::Reader::from_path(path).expect("it is a table");
    reader.deserialize().map(|row| row.expect("it is a row")).collect()
}

/// Copies the recording of slip, and changes its description.
fn copied(lab: &Path, change: impl FnOnce(String) -> String) -> PathBuf {
    fs::create_dir(lab).expect("it can be made");
    for entry in fs::read_dir(fixture("slip")).expect("a folder") {
        let path = entry.expect("a file").path();
        fs::copy(&path, lab.join(path.file_name().expect("a name"))).expect("it can be copied");
    }
    let description = lab.join("recording.toml");
    let text = fs::read_to_string(&description).expect("a description");
    fs::write(&description, change(text)).expect("it can be written");
    description
}

fn number(row: &Row, column: &str) -> Option<f64> {
    row[column].parse().ok()
}

#[test]
fn ruptures_and_arrivals_of_a_log_are_those_of_the_reference() {
    let folder = asperity_testkit::folder();
    for name in ["slip", "shear"] {
        let log = read(name, folder.path());
        let checked = succeed(&["check", text(&log)]);
        assert!(checked.contains(": whole: "), "{checked}");
        let tables = folder.path().join(format!("{name}-tables"));
        succeed(&["export", text(&log), "--to", "csv", "-o", text(&tables)]);
        let table = |of: &str| rows(&tables.join(format!("{name}.events.{of}.csv")));
        let expected = |of: &str| rows(&fixture(&format!("{name}/expected-{of}.csv")));

        let (mut found, mut due) = (table("rupture"), expected("ruptures"));
        // Found in the order in which they are certain.
        let by_onset =
            |a: &Row, b: &Row| number(a, "onset_s").partial_cmp(&number(b, "onset_s")).expect("numbers");
        found.sort_by(by_onset);
        due.sort_by(by_onset);
        assert_eq!(found.len(), due.len(), "{name}");
        for (found, due) in found.iter().zip(&due) {
            let blocks =
                ["first_block", "last_block", "nucleation_block", "reached_every_block", "detachments"];
            let sensors =
                ["first_sensor", "last_sensor", "nucleation_sensor", "reached_every_sensor", "detachments"];
            for (block, sensor) in blocks.into_iter().zip(sensors) {
                assert_eq!(found[block], due[sensor], "{block}: {due:?}");
            }
            for (column, share) in [
                ("onset_error_s", 0.01),
                ("length_m", 1e-6),
                ("length_error_m", 1e-6),
                // Times are those of the grid.
                ("front_speed_up_m_per_s", 0.02),
                ("front_speed_down_m_per_s", 0.02),
                ("front_speed_up_error_m_per_s", 0.04),
                ("front_speed_down_error_m_per_s", 0.04),
                ("ft_fn_onset", 1e-5),
                ("ft_fn_error", 0.01),
            ] {
                if due.contains_key(column) {
                    let (found, due) = (number(found, column), number(due, column));
                    let is_near = |(found, due): (f64, f64)| (found - due).abs() <= share * due.abs();
                    assert!(
                        found.is_some() == due.is_some() && found.zip(due).is_none_or(is_near),
                        "{column}"
                    );
                }
            }
            assert_eq!(found["drive_work_j"], "", "no sensor measures energies");
        }

        let (mut found, mut due) = (table("arrival"), expected("arrivals"));
        let by_arrival = |sensor: &'static str| {
            move |row: &Row| {
                (
                    row[sensor].parse::<u32>().expect("a number"),
                    (number(row, "arrival_s").expect("a time") * 1e6) as u64,
                )
            }
        };
        found.sort_by_key(by_arrival("block"));
        due.sort_by_key(by_arrival("sensor"));
        assert_eq!(found.len(), due.len(), "{name}");
        for (found, due) in found.iter().zip(&due) {
            for (column, share, least) in
                [("arrival_s", 0.0, 3e-7), ("stop_s", 0.0, 3e-6), ("step", 0.01, 0.0), ("x_m", 1e-9, 0.0)]
            {
                let [found, due] = [found, due].map(|row| number(row, column).expect("a number"));
                assert!((found - due).abs() <= share * due.abs() + least, "{column}: {found}, not {due}");
            }
        }
    }
}

#[test]
fn a_log_of_a_recording_is_read_as_that_of_a_run() {
    let folder = asperity_testkit::folder();
    let log = read("slip", folder.path());
    let again = folder.path().join("again.mcap");
    succeed(&["--quiet", "recording", "read", text(&fixture("slip/recording.toml")), "-o", text(&again)]);
    assert!(fs::read(&log).expect("a log") == fs::read(&again).expect("a log"), "equal bytes");
    assert!(succeed(&["summary", text(&log)]).contains("first slip                             0.476295 s"));
    assert_eq!(succeed(&["events", text(&log)]).lines().count(), 1 + 23);
    let catalogue = succeed(&["catalogue", text(&log)]);
    assert_eq!(catalogue.lines().count(), 1 + 26);
    // The first rupture began at the first sensor.
    assert!(catalogue.lines().nth(1).expect("a rupture").contains(",0.0181818,"), "{catalogue}");
    let (code, printed, _) = outcome(&["replay", text(&log)]);
    assert!(code == 0 && printed.contains("23 slip events, the same as logged"), "{printed}");
}

#[test]
fn a_description_is_shown_checked_and_refused() {
    let folder = asperity_testkit::folder();
    let shown = folder.path().join("recording.toml");
    fs::write(&shown, succeed(&["recording", "show"])).expect("it can be written");
    // All of its keys are known: only its files are missing.
    let (code, _, said) = outcome(&["recording", "validate", text(&shown)]);
    assert!(code == 2 && said.contains("forces.csv: "), "{said}");
    let valid = succeed(&["recording", "validate", text(&fixture("slip/recording.toml"))]);
    assert!(
        valid.contains("fast: 21 parts of 16802 samples at 1000000 Hz, 8 sensors and 0 channels"),
        "{valid}"
    );
    let log = folder.path().join("lab.mcap");
    let fault = fixture("faults/gap.toml");
    let (code, _, said) = outcome(&["recording", "read", text(&fault), "-o", text(&log)]);
    assert!(code == 2 && said.contains("gap.csv:253: time = 0.300: gap of 0.051 s"), "{said}");
    assert!(!log.exists());
}

/// A log names its inputs; they are opened in the given folder alone, and only if they are files.
#[test]
fn a_recording_is_read_again_from_files_in_the_given_folder_alone() {
    let folder = asperity_testkit::folder();
    let (lab, log) = (folder.path().join("lab"), folder.path().join("lab.mcap"));
    let description = copied(&lab, |text| text);
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&log)]);
    fs::remove_file(description).expect("the log has it");
    let again = ["--quiet", "check", text(&log), "--again"];
    let with_inputs = [&again[..], &["--inputs", text(&lab)]].concat();
    assert!(succeed(&with_inputs).contains(": whole: "));

    let segment = lab.join("event-004.npy");
    let mut bytes = fs::read(&segment).expect("a segment");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&segment, &bytes).expect("it can be written");
    let (code, printed, _) = outcome(&with_inputs);
    assert!(code == 4 && printed.contains("made again, is of other files"), "{code} {printed}");

    // Who opens a pipe waits for a writer.
    fs::remove_file(&segment).expect("it is there");
    assert!(Command::new("mkfifo").arg(&segment).status().expect("mkfifo starts").success());
    assert!(succeed(&["check", text(&log)]).contains(": whole: "));
    let (code, _, said) = outcome(&again);
    assert!(code == 2 && said.contains("(accepted: --inputs FOLDER)"), "{said}");
    let (code, _, said) = outcome(&with_inputs);
    assert!(code == 2 && said.contains("event-004.npy: it is a pipe, not a file"), "{said}");
}

/// Sums of what channels read have all samples; traces of a rupture begin and end about it, and show it.
#[test]
fn a_log_has_what_channels_read_and_samples_about_ruptures() {
    let folder = asperity_testkit::folder();
    let tables = folder.path().join("tables");
    succeed(&["--quiet", "export", text(&read("slip", folder.path())), "--to", "csv", "-o", text(&tables)]);
    let table = |of: &str| rows(&tables.join(format!("slip.{of}.csv")));
    let due = |row: &Row, column: &str| number(row, column).expect("a number");
    let signal = table("signal");
    let of_sensor = |row: &&Row| (due(row, "stream"), due(row, "channel")) == (2.0, 8.0);
    assert_eq!(signal.iter().filter(of_sensor).map(|row| due(row, "samples")).sum::<f64>(), 16802.0);
    assert!(
        signal
            .iter()
            .all(|row| due(row, "least") <= due(row, "mean") && due(row, "mean") <= due(row, "largest"))
    );

    let (traces, ruptures) = (table("traces"), table("events.rupture"));
    for (sensor, rupture) in ruptures.iter().map(|row| (due(row, "nucleation_block"), row)).take(2) {
        let of = |row: &&Row| row["rupture"] == rupture["rupture"] && due(row, "sensor") == sensor;
        let trace: Vec<&Row> = traces.iter().filter(of).collect();
        let (onset_s, end_s) = (due(rupture, "onset_s"), due(rupture, "end_s"));
        let [first_s, last_s] = [trace[0], trace[trace.len() - 1]].map(|row| due(row, "time_s"));
        assert!(
            (first_s - (onset_s - 128e-6)).abs() < 2e-6 && (last_s - (end_s + 128e-6)).abs() < 2e-6,
            "{rupture:?}"
        );
        assert_eq!(trace.len(), ((last_s - first_s) * 1e6).round() as usize + 1);
        let mean_m =
            |rows: &[&Row]| rows.iter().map(|row| due(row, "value")).sum::<f64>() / rows.len() as f64;
        let rise_m = mean_m(&trace[trace.len() - 100..]) - mean_m(&trace[..100]);
        assert!((rise_m / due(rupture, "mean_slip_m") - 1.0).abs() < 0.2, "{rise_m}: {rupture:?}");
    }
}

#[test]
fn a_log_has_no_samples_about_ruptures_where_none_are_wanted() {
    let folder = asperity_testkit::folder();
    let (lab, log, tables) =
        (folder.path().join("lab"), folder.path().join("slip.mcap"), folder.path().join("tables"));
    let description = copied(&lab, |text| text.replace("[detection]", "[detection]\ntraces = false"));
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&log)]);
    succeed(&["--quiet", "export", text(&log), "--to", "csv", "-o", text(&tables)]);
    let has = |of: &str| !rows(&tables.join(format!("slip.{of}.csv"))).is_empty();
    assert!(has("signal") && has("events.arrival") && !has("traces"));
    assert!(succeed(&["check", text(&log)]).contains(": whole: "));
}

/// The summary of a recording has what that measures, and its load drops, without marks of what simulations are worth.
#[test]
fn a_summary_of_a_recording_has_what_that_measures() {
    let folder = asperity_testkit::folder();
    let log = read("slip", folder.path());
    let due = rows(&fixture("slip/expected-load-drops.csv"));
    let drops_n: Vec<f64> = due.iter().filter_map(|row| number(row, "drop_n")).collect();
    let times_s: Vec<f64> = due.iter().filter_map(|row| number(row, "recurrence_s")).collect();
    let median = |mut of: Vec<f64>| {
        of.sort_by(f64::total_cmp);
        (of[(of.len() - 1) / 2] + of[of.len() / 2]) / 2.0
    };
    let (drop_n, time_s) = (median(drops_n), median(times_s));

    let description = copied(&folder.path().join("lab"), |text| {
        let (forces, _) = text.split_once("[[stream]]\nname = \"fast\"").expect("two streams");
        forces.replace("\"slip\"", "\"forces\"")
    });
    let forces = folder.path().join("forces.mcap");
    succeed(&["--quiet", "recording", "read", text(&description), "-o", text(&forces)]);
    for log in [&log, &forces] {
        let json = succeed(&["summary", text(log), "--format", "json"]);
        let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        let near = |key: &str, due: f64| (json[key].as_f64().expect(key) / due - 1.0).abs() < 2e-3;
        assert!(json["load_drop_count"] == 64 && near("median_load_drop_n", drop_n), "{json}");
        assert!(near("median_load_drop_recurrence_s", time_s), "{json}");
        for absent in ["convergence", "drive_work_j", "unloaded_contact_count", "plain_steps", "length_law"] {
            assert!(json.get(absent).is_none(), "{absent}: {json}");
        }
        assert_eq!(json.get("event_count").is_some(), json["run"] == "slip", "{json}");
        let (_, printed, said) = outcome(&["summary", text(log)]);
        assert!(printed.contains("\nLoad drops\n  load drop count ") && said.is_empty(), "{printed}{said}");
        assert!(!printed.contains(['~', '#', '=']) && !printed.contains("Energy"), "{printed}");
    }
    let both = succeed(&["summary", text(&log), text(&forces)]);
    assert!(both.lines().skip(2).all(|row| row.contains(" 64  0.381")), "{both}");
    let (_, diff, _) = outcome(&["diff", text(&log), text(&forces)]);
    assert!(diff.contains("the runs ") && !diff.contains("worth"), "{diff}");
}
