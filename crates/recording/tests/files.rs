//! Files and descriptions: layouts of arrays, gaps and uneven times, paths, and keys that are refused.

use std::fs;
use std::path::Path;

use asperity_record::StepRecord;
use asperity_recording::{Description, Detected, Recording, RecordingError};

const SLIDER: &str = "format = 1\nname = 'made up'\n[slider]\nlength_m = 0.1\nwidth_m = 0.005\nheight_m = 0.02\n\
                      youngs_modulus_pa = 2.5e9\nwave_speed_m_per_s = 1450.6\n[[stream]]\n";

fn open(folder: &Path, stream: &str) -> Result<Recording, RecordingError> {
    Description::parse(&folder.join("recording.toml"), &format!("{SLIDER}{stream}")).and_then(Recording::open)
}

fn detect(folder: &Path, stream: &str) -> Detected {
    open(folder, stream).and_then(|recording| recording.detect(&mut |_, _| false)).unwrap()
}

/// Counts of two sensors, with a step in each.
fn count(sensor: i16, sample: i16) -> i16 {
    let noise = (i32::from(sample) * i32::from(sample) % 13) as i16 + sensor;
    noise + if sample < 400 + 20 * sensor { 0 } else { 300 }
}

fn npy(descr: &str, is_fortran: bool, shape: [i16; 2], bytes: Vec<u8>) -> Vec<u8> {
    let order = if is_fortran { "True" } else { "False" };
    let header = format!(
        "{{'descr': '{descr}', 'fortran_order': {order}, 'shape': ({}, {}), }}\n",
        shape[0], shape[1]
    );
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &bytes].concat()
}

#[test]
fn an_array_is_read_in_any_layout() {
    let folder = tempfile::tempdir().unwrap();
    let by_channel = || (1..=2).flat_map(|sensor| (0..1000).map(move |sample| count(sensor, sample)));
    let by_sample = || (0..1000).flat_map(|sample| (1..=2).map(move |sensor| count(sensor, sample)));
    let little = |number: i16| number.to_le_bytes().to_vec();
    let big = |number: i16| number.to_be_bytes().to_vec();
    let single = |number: i16| f32::from(number).to_le_bytes().to_vec();
    let double = |number: i16| f64::from(number).to_be_bytes().to_vec();
    let mut found = Vec::new();
    for (axis, array) in [
        ("channels-first", npy("<i2", false, [2, 1000], by_channel().flat_map(little).collect())),
        ("channels-first", npy(">f8", true, [2, 1000], by_sample().flat_map(double).collect())),
        ("samples-first", npy(">i2", false, [1000, 2], by_sample().flat_map(big).collect())),
        ("samples-first", npy("<f4", true, [1000, 2], by_channel().flat_map(single).collect())),
    ] {
        fs::write(folder.path().join("slip.npy"), array).unwrap();
        let stream = format!(
            "file = 'slip.npy'\naxis = '{axis}'\nrate_hz = 1e6\narray = [{{ role = 'slip', unit = 'm', \
             factor = 1e-9, channels = '1..2', x_m = [0.02, 0.04] }}]"
        );
        let read = detect(folder.path(), &stream);
        let (records, noise) = (read.steps().collect::<Vec<StepRecord>>(), read.noise);
        let switches: usize = records.iter().map(|record| record.switches.len()).sum();
        assert_eq!(switches, 4, "{axis}");
        found.push((records, noise));
    }
    assert!(found.iter().all(|other| *other == found[0]));
}

/// A force that rises by 50 N/s and falls by 2 N at each of these times.
fn forces(times_s: impl Iterator<Item = f64>, drops_s: &[f64]) -> String {
    let force_n = |time_s: f64| {
        let fallen = drops_s.iter().filter(|drop_s| time_s > **drop_s).count() as f64;
        50.0 * time_s - 2.0 * fallen + 0.01 * ((time_s * 7919.0).sin())
    };
    let rows: String = times_s.map(|time_s| format!("{time_s:.4},{:.4}\n", force_n(time_s))).collect();
    format!("t,F\n{rows}")
}

const FORCE: &str = "file = 'forces.csv'\ntime = { column = 't', unit = 's' }\n\
                     channel = [{ column = 'F', role = 'tangential-force', unit = 'N' }]\n";

#[test]
fn what_lies_between_gaps_is_a_part_and_uneven_times_are_made_even() {
    let folder = tempfile::tempdir().unwrap();
    let write = |text: String| fs::write(folder.path().join("forces.csv"), text).unwrap();
    let even = |n: u32| f64::from(n) * 1e-3;
    write(forces((0..2000).filter(|n| !(900..1000).contains(n)).map(even), &[0.45, 1.5]));
    let error = open(folder.path(), FORCE).unwrap_err().to_string();
    assert!(error.contains("forces.csv:902: t = 1.000: gap of 0.101 s"), "{error}");
    let drops = detect(folder.path(), &format!("{FORCE}gaps = 'allow'")).drops;
    let parts: Vec<(u64, Option<f64>)> = drops.iter().map(|drop| (drop.part, drop.recurrence_s)).collect();
    assert_eq!(parts, [(1, None), (2, None)]);

    // Every third sample late by a fifth of an interval.
    write(forces((0..2000).map(|n| even(n) + if n % 3 == 1 { 2e-4 } else { 0.0 }), &[0.45, 1.5]));
    let error = open(folder.path(), FORCE).unwrap_err().to_string();
    assert!(error.contains("resample = \"linear\""), "{error}");
    let drops = detect(folder.path(), &format!("{FORCE}resample = 'linear'")).drops;
    assert_eq!(drops.len(), 2);
    for (drop, due_s) in drops.iter().zip([0.45, 1.5]) {
        assert!((drop.onset_s - due_s).abs() < 2e-3 && (drop.drop_n - 2.0).abs() < 0.1, "{drop:?}");
    }
}

#[test]
fn no_file_outside_the_folder_is_opened() {
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    fs::write(folder.path().join("forces.csv"), forces((0..500).map(|n| f64::from(n) * 1e-3), &[])).unwrap();
    #[cfg(unix)]
    std::os::unix::fs::symlink("../forces.csv", inside.join("link.csv")).unwrap();
    let absolute = folder.path().join("forces.csv");
    for file in ["../forces.csv", "link.csv", absolute.to_str().unwrap()] {
        let error = open(&inside, &FORCE.replace("forces.csv", file)).unwrap_err().to_string();
        assert!(error.contains("it is outside the folder of the recording"), "{error}");
    }
}

#[test]
fn a_key_that_is_not_accepted_is_named_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let array = "file = 'a.npy'\nrate_hz = 1e6\n[[stream.array]]\nrole = 'slip'\nunit = 'm'\nchannels = '1..2'\n\
                 x_m = [0.02, 0.04]\n";
    for (key, value, told) in [
        (
            "rate_hz = 1e6",
            "rate_hz = -1",
            ":11:11: rate_hz = -1 is not accepted (accepted: a number above 0)",
        ),
        (
            "unit = 'm'",
            "unit = 'furlong'",
            ":14:8: unit = 'furlong' is not accepted (accepted: 1, or N, m, s",
        ),
        (
            "channels = '1..2'",
            "channels = '2..1'",
            ":15:12: channels = '2..1' is not accepted (accepted: a range",
        ),
        ("channels", "chanels", ":15:1: chanels: unknown key; did you mean channels?"),
        ("[0.02, 0.04]", "[0.02]", ":12:1: 1 positions, 2 loads (accepted: as many as channels, 2)"),
        (
            "[0.02, 0.04]",
            "[0.04, 0.02]",
            ":12:1: positions [0.04, 0.02] (accepted: ascending, from 0 to 0.1)",
        ),
        ("[0.02, 0.04]", "[0.02, 0.2]", ":12:1: positions [0.02, 0.2] (accepted: ascending, from 0 to 0.1)"),
        ("role = 'slip'", "role = 'acoustic'", ":1:1: nothing from which events follow"),
        ("a.npy", "a.xls", ":9:1: file = \"a.xls\" (accepted: csv, npy; or kind says which)"),
    ] {
        assert!(array.contains(key));
        let error = open(folder.path(), &array.replace(key, value)).unwrap_err().to_string();
        assert!(error.contains(&format!("recording.toml{told}")), "{error}");
    }
}
