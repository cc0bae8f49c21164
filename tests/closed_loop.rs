//! Simulated runs, recorded as a laboratory would (`asperity recording sample`), read as recordings, and compared with
//! their own events. The limits are those that are claimed for recordings with this noise.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::binary::{ends, run, succeed, text};

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

/// Role, unit and number of sensors.
type Sensors<'a> = (&'a str, &'a str, usize);

/// A description of sensors along a slider, in segments, and of both forces and the load point.
fn instruments((role, unit, sensors): Sensors<'_>, [blocks, length_m]: [f64; 2]) -> String {
    let (gap_m, spacing_m) = (length_m / sensors as f64, length_m / (blocks - 1.0));
    // On blocks, since a sampled sensor is that of the nearest one.
    let place_m = |n: usize| ((n as f64 + 0.5) * gap_m / spacing_m).round() * spacing_m;
    let x_m: Vec<String> = (0..sensors).map(|n| format!("{:.6}", place_m(n))).collect();
    format!(
        r#"
        format = 1
        name = "instruments"
        [slider]
        length_m = {length_m}
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
    /// Share of lengths within the distance of sensors.
    covered: f64,
    /// Scatter and bias of front speeds, relative, of several, against those of the true arrivals at the same sensors.
    speed: Option<[f64; 2]>,
    speeds: usize,
}

/// The bias of errors and their scatter.
fn spread(errors: &[f64]) -> [f64; 2] {
    let bias = median(errors.iter().copied());
    [bias, 1.4826 * median(errors.iter().map(|error| (error - bias).abs()))]
}

/// The speed of a front by the arrivals at sensors from the first of them on, as a recording has it (Theil and Sen).
fn speed_m_per_s(arrivals: &[(f64, f64)]) -> Option<f64> {
    let first = arrivals.iter().min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    let ahead: Vec<_> = arrivals.iter().filter(|(_, x_m)| *x_m >= first).collect();
    let pairs =
        ahead.iter().flat_map(|a| ahead.iter().filter(|b| b.1 > a.1).map(move |b| (b.0 - a.0) / (b.1 - a.1)));
    (ahead.len() >= 4).then(|| 1.0 / median(pairs))
}

fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let at = |n: usize| values.get(n).copied().unwrap_or(f64::NAN);
    (at(values.len() / 2) + at(values.len().saturating_sub(1) / 2)) / 2.0
}

/// Runs a scenario, records it, reads that, and compares up to the end of the first global rupture.
fn score(scenario: &[&str], slider: [f64; 2], of: Sensors<'_>) -> Score {
    let (folder, (_, _, sensors), [blocks, length_m]) = (asperity_testkit::folder(), of, slider);
    let at = |name: &str| folder.path().join(name);
    let (made, like, sampled, read) = (at("made.mcap"), at("like.toml"), at("sampled"), at("read.mcap"));
    run(scenario, &made);
    fs::write(&like, instruments(of, slider)).unwrap();
    succeed(&["recording", "sample", text(&made), "--like", text(&like), "-o", text(&sampled)]);
    succeed(&["recording", "read", text(&sampled.join("recording.toml")), "-o", text(&read)]);
    for log in [&made, &read] {
        succeed(&["export", text(log), "--to", "csv", "-o", text(&log.with_extension("tables"))]);
    }
    let (truth, found) = (table(&made, "events.rupture"), table(&read, "events.rupture"));
    let is_global = |rupture: &&Row| rupture["reached_every_block"] == "true";
    let end_s = truth.iter().find(is_global).map_or(f64::INFINITY, |global| number(global, "onset_s") + 2e-3);
    let spacing_m = length_m / (blocks - 1.0);
    let block = |sensor: f64| (((sensor - 0.5) * length_m / sensors as f64) / spacing_m).round() + 1.0;
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
    let [bias_s, scatter_s] = spread(&errors);
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
            let due_m = ((number(of, "last_block") - 0.5) * spacing_m).min(length_m);
            (number(is, "length_m") - due_m).abs() / length_m
        })
        .collect();
    let speeds = both.iter().filter_map(|(of, is)| {
        let of_it = made_at.iter().filter(|arrival| arrival.2 == of["rupture"]);
        let of_it: Vec<_> = of_it.map(|(at_s, sensor, _)| (*at_s, places[*sensor] * spacing_m)).collect();
        let is: f64 = is["front_speed_up_m_per_s"].parse().ok()?;
        Some(is / speed_m_per_s(&of_it)? - 1.0)
    });
    let speeds: Vec<f64> = speeds.collect();
    Score {
        arrivals: due.len(),
        recall: pairs.len() as f64 / due.len() as f64,
        precision: true_ones as f64 / read_at.len() as f64,
        bias_s,
        scatter_s,
        ruptures: both.len(),
        covered: lengths.iter().filter(|error| **error <= 1.0 / sensors as f64).count() as f64
            / lengths.len() as f64,
        length_error: median(lengths),
        speeds: speeds.len(),
        speed: (speeds.len() > 2).then(|| spread(&speeds)),
    }
}

/// A scenario with its overrides, the contacts along its slider and its length in m, and the sensors.
type Loop<'a> = (&'a [&'a str], [f64; 2], Sensors<'a>);

const SLIP: Sensors<'_> = ("slip", "nm", 20);
const AREA: Sensors<'_> = ("contact-area", "1", 20);

/// Body, law, drive and load vary. The first two end before the slider slips as a whole, when the largest step of a
/// sensor lies up to 0.1 ms behind the first, and slip sensors show that front.
const LOOPS: [Loop<'_>; 10] = [
    (&["default", "--set", "time.duration_s=2.6"], [100.0, 0.1], SLIP),
    (&["default", "--set", "time.duration_s=2.6"], [100.0, 0.1], AREA),
    (&["default", "--set", "slider.blocks=50", "--set", "time.duration_s=2"], [50.0, 0.1], AREA),
    (&["default", "--set", "normal_load.tilt=0.8333", "--set", "time.duration_s=1.5"], [100.0, 0.1], AREA),
    (&["default", "--set", "normal_load.tilt=-0.4", "--set", "time.duration_s=2"], [100.0, 0.1], SLIP),
    (
        &["default", "--set", "drive.stiffness_n_per_m=400000", "--set", "time.duration_s=3"],
        [100.0, 0.1],
        SLIP,
    ),
    (&["default", "--set", "friction.static_spread=0.1", "--set", "time.duration_s=1.2"], [100.0, 0.1], AREA),
    (&["rigid-contacts", "--set", "time.duration_s=1.2"], [100.0, 0.1], AREA),
    (&["top-driven", "--set", "normal_load.tilt=0.8333", "--set", "time.duration_s=2.4"], [100.0, 0.1], AREA),
    (&["slab", "--set", "time.duration_s=0.6"], [57.0, 0.14], AREA),
];

/// How well detection must do.
#[derive(Clone, Copy)]
struct Claim {
    recall: f64,
    precision: f64,
    /// Of arrivals, within so much.
    bias_s: [f64; 2],
    scatter_s: f64,
    /// Over the length of the slider.
    length_error: f64,
    /// Less one rupture.
    covered: f64,
    speed_bias: f64,
    /// With an infinite number of speeds.
    speed_scatter: f64,
}

/// What an independent program reached on the default chain with slip to 3 nm by 20 sensors, in the digits that were
/// printed: recall and precision of ruptures there, so that sensors at the end of a rupture may lack it or have it too
/// much, where they move by 6 to 8 nm and the threshold is 4.5 nm. An arrival is late by 1 us.
const BY_SLIP: Claim = Claim {
    recall: 0.97,
    precision: 0.97,
    bias_s: [1e-6, 0.5e-6],
    scatter_s: 0.65e-6,
    length_error: 0.0125,
    covered: 0.988,
    speed_bias: 0.01,
    speed_scatter: 0.0226,
};

/// The same with contact area to 1 %.
const BY_AREA: Claim = Claim { bias_s: [0.0, 0.5e-6], scatter_s: 0.45e-6, speed_scatter: 0.018, ..BY_SLIP };

/// Of other bodies, laws and drives nothing is claimed but that most is found.
const OF_OTHERS: Claim = Claim {
    recall: 0.9,
    precision: 0.95,
    bias_s: [0.0, 3e-6],
    scatter_s: 1.5e-6,
    length_error: 0.025,
    covered: 0.95,
    speed_bias: 0.05,
    speed_scatter: 0.05,
};

/// What is found of a run is there, and most of what is there is found, with the errors that are claimed.
fn check((scenario, slider, of): Loop<'_>, claim: Claim) {
    let scenario = [scenario, &["--set", "parameter_set=as-stated"]].concat();
    let score = score(&scenario, slider, of);
    let what = format!("{scenario:?}, {of:?}: {score:?}");
    assert!(score.arrivals >= 20 && score.ruptures >= 2, "{what}");
    assert!(score.recall >= claim.recall && score.precision >= claim.precision, "{what}");
    let [bias_s, within_s] = claim.bias_s;
    assert!((score.bias_s - bias_s).abs() <= within_s && score.scatter_s <= claim.scatter_s, "{what}");
    // NaN where no rupture begins at the first sensor. One of 90 that does runs into another within the link time.
    assert!(score.length_error <= claim.length_error, "{what}");
    assert!(score.covered >= claim.covered - 1.0 / score.ruptures as f64, "{what}");
    // Twice the standard error of a scatter by the median deviation.
    let most = claim.speed_scatter * (1.0 + 2.0 * 1.17 / (score.speeds as f64).sqrt());
    let is_near = |[bias, scatter]: [f64; 2]| bias.abs() <= claim.speed_bias && scatter <= most;
    assert!(score.speed.is_none_or(is_near), "{what}");
}

#[test]
fn a_sampled_chain_is_found_by_slip() {
    check(LOOPS[0], BY_SLIP);
}

#[test]
fn a_sampled_chain_is_found_by_contact_area() {
    check(LOOPS[1], BY_AREA);
}

#[test]
#[ignore = "minutes: cargo xtask nightly"]
fn sampled_runs_of_many_kinds_are_found() {
    let failed: Vec<usize> = (2..LOOPS.len())
        .filter(|n| std::panic::catch_unwind(|| check(LOOPS[*n], OF_OTHERS)).is_err())
        .collect();
    assert!(failed.is_empty(), "loops {failed:?}");
}

/// Estimates of a sampled run are the parameters of the run, and their scenario can be run.
#[test]
fn a_sampled_run_gives_its_parameters_back() {
    let folder = asperity_testkit::folder();
    let at = |name: &str| folder.path().join(name);
    let (made, like, sampled, read) = (at("made.mcap"), at("like.toml"), at("sampled"), at("read.mcap"));
    run(&["default", "--set", "parameter_set=as-stated", "--set", "time.duration_s=1.6"], &made);
    let gauges = r#"
        [[stream]]
        name = "gauges"
        file = "gauges-*.npy"
        rate_hz = 5e5
        starts = { file = "starts.csv", column = "start_s", unit = "s" }
        array = [{ role = "shear-force", unit = "N", channels = "1..3", dead = [2], x_m = [0.012121, 0.02, 0.032323], normal_n = [4, 4, 4] }]
        [detection]
        array = "fast"
        "#;
    fs::write(&like, instruments(("slip", "m", 20), [100.0, 0.1]).replace("[detection]", gauges)).unwrap();
    let sample = ["recording", "sample", text(&made), "--like", text(&like), "-o", text(&sampled)];
    succeed(
        &[&sample[..], &["--noise", "tangential-force=0.01", "--noise", "shear-force=0.003", "--seed", "7"]]
            .concat(),
    );
    ends(2, &sample, &["--out", "exists", "--force"]);
    succeed(&["recording", "read", text(&sampled.join("recording.toml")), "-o", text(&read)]);
    let scenario = at("estimated.toml");
    succeed(&["recording", "estimate", text(&read), "-o", text(&scenario)]);
    let estimated = fs::read_to_string(&scenario).unwrap();
    let value = |key: &str| -> f64 {
        let line = estimated.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = "));
        let line = line.unwrap_or_else(|| panic!("{key} is not in {estimated}"));
        line.split("  #").next().unwrap().parse().unwrap()
    };
    for (key, due, share) in [
        ("drive.velocity_m_per_s", 1e-4, 1e-4),
        ("drive.stiffness_n_per_m", 8e5, 1e-3),
        ("normal_load.total_n", 400.0, 1e-4),
        ("friction.dynamic_coefficient", 0.45, 0.08),
        // A lower bound: an arrival may be late.
        ("friction.static_coefficient", 0.7, 0.15),
    ] {
        assert!((value(key) / due - 1.0).abs() < share, "{key}: {estimated}");
    }
    assert!(value("normal_load.tilt").abs() < 0.2, "{estimated}");
    succeed(&["scenario", "validate", text(&scenario)]);
    run(&[text(&scenario), "--set", "time.duration_s=0.1"], &at("again.mcap"));
}

/// The same seed gives the same bytes, another one others; what no run has is refused, and by a recording no run.
#[test]
fn sampling_is_reproducible_and_refuses_what_no_run_has() {
    let folder = asperity_testkit::folder();
    let at = |name: &str| folder.path().join(name);
    let (made, like) = (at("made.mcap"), at("like.toml"));
    run(&["default", "--set", "parameter_set=as-stated", "--set", "time.duration_s=0.4"], &made);
    fs::write(&like, instruments(("slip", "m", 5), [100.0, 0.1])).unwrap();
    let sample = |out: &str, seed: &str| {
        let out = at(out);
        succeed(&[
            "recording",
            "sample",
            text(&made),
            "--like",
            text(&like),
            "-o",
            text(&out),
            "--seed",
            seed,
        ]);
        ["stream-1.npy", "stream-2-1.npy"].map(|name| fs::read(out.join(name)).unwrap())
    };
    let (one, same, other) = (sample("one", "1"), sample("same", "1"), sample("other", "2"));
    assert!(one == same && one[0] != other[0] && one[1] != other[1]);
    let refused = |text_of: String, words: &[&str]| {
        fs::write(&like, text_of).unwrap();
        ends(2, &["recording", "sample", text(&made), "--like", text(&like), "-o", text(&at("none"))], words);
        assert!(!at("none").exists());
    };
    refused(
        instruments(("shear-strain", "1", 5), [100.0, 0.1]),
        &["like.toml", "channel 1 has nothing to measure", "shear-force"],
    );
    refused(instruments(("slip", "m", 5), [100.0, 0.1]).replace("0.089899]", "0.2]"), &["0.2"]);
    ends(
        2,
        &["recording", "sample", text(&made), "--like", "x", "-o", "y", "--noise", "slip=-1"],
        &["slip=3e-9"],
    );
    let out = at("estimated.toml");
    ends(
        2,
        &["recording", "estimate", text(&made), "-o", text(&out)],
        &["made.mcap: it is of a run (accepted: the log of a recording)"],
    );
    assert!(!out.exists());
}
