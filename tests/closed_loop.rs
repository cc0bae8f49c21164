//! Simulated runs, recorded as a laboratory would (`asperity recording sample`), read as recordings, and compared with
//! their own events. The limits are those that detection reaches on recordings with this noise (docs/recordings.md).

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::binary::{outcome, run, succeed, text};

/// Longest time between an arrival and that which is found, s.
const NEAR_S: f64 = 6e-5;

/// Fewest blocks of a rupture that is to be found.
const FEWEST_BLOCKS: f64 = 4.0;

type Row = BTreeMap<String, String>;

fn table(log: &Path, of: &str) -> Vec<Row> {
    let name = log.file_stem().unwrap().to_str().unwrap();
    let path = log.with_extension("tables").join(format!("{name}.{of}.csv"));
    let mut reader = csv::Reader::from_path(path).expect("it is a table");
    reader.deserialize().map(|row| row.expect("it is a row")).collect()
}

fn number(row: &Row, column: &str) -> f64 {
    row[column].parse().unwrap_or_else(|_| panic!("{column} of {row:?}"))
}

/// A description of sensors along a slider of 0.1 m, in segments, and of both forces and the load point.
fn instruments(role: &str, unit: &str, sensors: usize) -> String {
    let gap_m = 0.1 / sensors as f64;
    let x_m: Vec<String> = (0..sensors).map(|n| format!("{:.6}", (n as f64 + 0.5) * gap_m)).collect();
    format!(
        r#"
        format = 1
        name = "instruments"
        [slider]
        length_m = 0.1
        width_m = 0.005
        height_m = 0.02
        youngs_modulus_pa = 2.5e9
        wave_speed_m_per_s = 1450.6
        [[stream]]
        name = "slow"
        file = "slow.npy"
        rate_hz = 1e4
        channel = [
            {{ column = 1, role = "tangential-force", unit = "N" }},
            {{ column = 2, role = "normal-force", unit = "kN" }},
            {{ column = 3, role = "load-point", unit = "um" }},
            {{ column = 4, role = "slip", unit = "m", x_m = 0.0 }},
        ]
        [[stream]]
        name = "fast"
        file = "fast-*.npy"
        rate_hz = 1e6
        starts = {{ file = "starts.csv", column = "start_s", unit = "s" }}
        array = [{{ role = "{role}", unit = "{unit}", factor = 1e-3, channels = "1..{sensors}", x_m = [{}] }}]
        [detection]
        window_s = 32e-6
        "#,
        x_m.join(", ")
    )
}

/// How well the events of a run are found.
#[derive(Debug)]
struct Score {
    arrivals: usize,
    recall: f64,
    precision: f64,
    bias_s: f64,
    scatter_s: f64,
    ruptures: usize,
    /// Median, over the length of the slider.
    length_error: f64,
    /// Share of lengths within the error, half a gap.
    covered: f64,
    /// Median deviation of front speeds, relative, of several.
    speed_error: Option<f64>,
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Runs a scenario, records it, reads that, and compares up to the end of the first global rupture.
fn score(scenario: &[&str], blocks: f64, role: &str, unit: &str, sensors: usize) -> Score {
    let folder = asperity_testkit::folder();
    let at = |name: &str| folder.path().join(name);
    let (made, like, sampled, read) = (at("made.mcap"), at("like.toml"), at("sampled"), at("read.mcap"));
    run(scenario, &made);
    fs::write(&like, instruments(role, unit, sensors)).unwrap();
    succeed(&["recording", "sample", text(&made), "--like", text(&like), "-o", text(&sampled)]);
    succeed(&["recording", "read", text(&sampled.join("recording.toml")), "-o", text(&read)]);
    for log in [&made, &read] {
        succeed(&["export", text(log), "--to", "csv", "-o", text(&log.with_extension("tables"))]);
    }
    let (truth, found) = (table(&made, "events.rupture"), table(&read, "events.rupture"));
    let is_global = |rupture: &&Row| rupture["reached_every_block"] == "true";
    let end_s = truth.iter().find(is_global).map_or(f64::INFINITY, |global| number(global, "onset_s") + 2e-3);
    let spacing_m = 0.1 / (blocks - 1.0);
    let block = |sensor: f64| (((sensor - 0.5) * 0.1 / sensors as f64) / spacing_m).round() + 1.0;
    let size = |rupture: &Row| number(rupture, "last_block") - number(rupture, "first_block") + 1.0;
    let sizes: BTreeMap<&str, f64> = truth.iter().map(|of| (of["rupture"].as_str(), size(of))).collect();
    let places: Vec<f64> = (1..=sensors).map(|sensor| block(sensor as f64)).collect();
    // Time, sensor, rupture.
    let arrivals = |log: &Path, sensor: &dyn Fn(f64) -> Option<usize>| -> Vec<(f64, usize, String)> {
        let of = |row: Row| {
            let time_s = number(&row, "arrival_s");
            Some((time_s, sensor(number(&row, "block"))?, row["rupture"].clone())).filter(|_| time_s < end_s)
        };
        table(log, "events.arrival").into_iter().filter_map(of).collect()
    };
    let made_at = arrivals(&made, &|block| places.iter().position(|place| *place == block));
    let read_at = arrivals(&read, &|sensor| Some(sensor as usize - 1));
    let nearest = |of: &(f64, usize, String), among: &[(f64, usize, String)]| {
        let near = among.iter().filter(|other| other.1 == of.1 && (other.0 - of.0).abs() <= NEAR_S).cloned();
        near.min_by(|a, b| (a.0 - of.0).abs().total_cmp(&(b.0 - of.0).abs()))
    };
    let due: Vec<_> = made_at.iter().filter(|of| sizes[of.2.as_str()] >= FEWEST_BLOCKS).collect();
    let pairs: Vec<_> = due.iter().filter_map(|of| Some((*of, nearest(of, &read_at)?))).collect();
    let true_ones = read_at.iter().filter(|of| nearest(of, &made_at).is_some()).count();
    let errors: Vec<f64> = pairs.iter().map(|(of, found)| found.0 - of.0).collect();
    let bias_s = median(errors.iter().copied());
    // A rupture is that of its first arrival.
    let by_name = |rows: &[Row], name: &str| rows.iter().find(|row| row["rupture"] == name).cloned();
    let mut seen = BTreeMap::new();
    for (of, found) in &pairs {
        seen.entry(of.2.clone()).or_insert_with(|| found.2.clone());
    }
    let both: Vec<(Row, Row)> =
        seen.iter().filter_map(|(of, is)| Some((by_name(&truth, of)?, by_name(&found, is)?))).collect();
    // Of ruptures from the driven end.
    let lengths: Vec<f64> = both
        .iter()
        .filter(|(of, is)| of["first_block"] == "1" && is["first_block"] == "1")
        .map(|(of, is)| {
            let length_m = ((number(of, "last_block") - 0.5) * spacing_m).min(0.1);
            (number(is, "length_m") - length_m).abs() / 0.1
        })
        .collect();
    let speeds = both.iter().filter_map(|(of, is)| {
        let column = "front_speed_up_m_per_s";
        let (of, is): (f64, f64) = (of[column].parse().ok()?, is[column].parse().ok()?);
        Some((is / of - 1.0).abs())
    });
    let speeds: Vec<f64> = speeds.collect();
    let half_gap = 0.5 / sensors as f64 + 0.5 * spacing_m / 0.1;
    Score {
        arrivals: due.len(),
        recall: pairs.len() as f64 / due.len() as f64,
        precision: true_ones as f64 / read_at.len() as f64,
        bias_s,
        scatter_s: 1.4826 * median(errors.iter().map(|error| (error - bias_s).abs())),
        ruptures: both.len(),
        covered: lengths.iter().filter(|error| **error <= half_gap).count() as f64 / lengths.len() as f64,
        length_error: median(lengths),
        speed_error: (speeds.len() > 2).then(|| median(speeds)),
    }
}

/// What is found of a run with the instruments of their description: most errors of the table of reached numbers.
fn check(scenario: &[&str], blocks: f64, role: &str, unit: &str, sensors: usize) {
    let score = score(scenario, blocks, role, unit, sensors);
    let what = format!("{scenario:?}, {role} at {sensors} places: {score:?}");
    println!("{what}");
    assert!(score.arrivals >= 20 && score.ruptures >= 4, "{what}");
    assert!(score.recall >= 0.95 && score.precision >= 0.9, "{what}");
    assert!(score.bias_s.abs() <= 3e-6 && score.scatter_s <= 1.5e-6, "{what}");
    assert!(score.length_error <= 0.3 / sensors as f64 && score.covered >= 0.9, "{what}");
    assert!(score.speed_error.is_none_or(|error| error <= 0.06), "{what}");
}

#[test]
fn a_sampled_chain_is_found_by_slip() {
    check(&["default", "--set", "time.duration_s=2.4"], 100.0, "slip", "nm", 20);
}

#[test]
fn a_sampled_chain_is_found_by_contact_area() {
    check(&["default", "--set", "time.duration_s=2.4"], 100.0, "contact-area", "1", 20);
}
