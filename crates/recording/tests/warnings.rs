//! What makes a result doubtful is warned of, and only then; and segments that are no order of time are refused.

use std::fs;
use std::path::Path;

use asperity_recording::{Description, Detected, Recording, RecordingError};

/// Sensors at 0.02, 0.04, ... m of a slider of 0.1 m: where there are two, the largest gap is 0.06 m, 41 us of a wave.
fn detect(folder: &Path, keys: &str, sensors: usize, detection: &str) -> Result<Detected, RecordingError> {
    let x_m: Vec<f64> = (1..=sensors).map(|sensor| 0.02 * sensor as f64).collect();
    let text = format!(
        "format = 1\nname = 'made up'\n[slider]\nlength_m = 0.1\nwidth_m = 0.005\nheight_m = 0.02\n\
         youngs_modulus_pa = 2.5e9\nwave_speed_m_per_s = 1450.6\n[[stream]]\nnumbers = '<f4'\nchannels_in_file = {sensors}\n\
         {keys}, channels = '1..{sensors}', x_m = {x_m:?} }}]\n[detection]\n{detection}\n"
    );
    let recording = Recording::open(Description::parse(&folder.join("recording.toml"), &text)?)?;
    recording.detect(&|_, _| false)
}

/// Writes samples of sensors, each of which falls by these steps, 400 samples apart.
fn write(path: &Path, steps: &[&[f32]]) {
    let count = 400 * (1 + steps.iter().map(|of| of.len()).max().unwrap());
    let value = |sample: usize, of: &[f32], sensor: usize| {
        let fallen: f32 = of.iter().take(sample / 400).sum();
        ((sample * sample + 7 * sensor) % 13) as f32 - fallen
    };
    let samples =
        (0..count).flat_map(|n| steps.iter().enumerate().map(move |(sensor, of)| value(n, of, sensor)));
    fs::write(path, samples.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).unwrap();
}

const AREA: &str = "file = 'a.raw'\nrate_hz = 1e6\narray = [{ role = 'contact-area', unit = '1'";

/// The warnings of a recording, which are as many as it should have.
#[track_caller]
fn warnings(found: Result<Detected, RecordingError>, due: &[&str]) {
    let told: Vec<String> = found.unwrap().warnings.iter().map(ToString::to_string).collect();
    assert_eq!(told.len(), due.len(), "{told:?}");
    for (told, due) in told.iter().zip(due) {
        assert!(told.contains(due), "{told} lacks {due}");
    }
}

#[test]
fn a_sensor_without_a_step_between_two_with_twenty_may_be_dead() {
    let folder = tempfile::tempdir().unwrap();
    for (count, due) in
        [(20, &[": 2: no step, where the sensors beside it have 20 and 20 (accepted: "][..]), (19, &[])]
    {
        let steps = vec![300.0; count];
        write(&folder.path().join("a.raw"), &[&steps, &[], &steps]);
        warnings(detect(folder.path(), AREA, 3, ""), due);
    }
}

#[test]
fn a_window_above_the_link_time_is_too_long() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("a.raw"), &[&[300.0], &[300.0]]);
    let due = "a window of 3.200e-5 s, where 2.068e-5 s part ruptures (accepted: ";
    warnings(detect(folder.path(), AREA, 2, "link_time_ratio = 0.5"), &[due]);
    warnings(detect(folder.path(), AREA, 2, "link_time_ratio = 0.8"), &[]);
}

#[test]
fn samples_further_apart_than_a_wave_takes_give_no_speeds() {
    let folder = tempfile::tempdir().unwrap();
    write(&folder.path().join("a.raw"), &[&[300.0], &[300.0]]);
    let due = "an interval of 5.000e-5 s; a wave takes 4.136e-5 s over the largest gap (accepted: ";
    warnings(detect(folder.path(), &AREA.replace("1e6", "2e4"), 2, ""), &[due]);
    warnings(detect(folder.path(), &AREA.replace("1e6", "2.5e4"), 2, ""), &[]);
}

#[test]
fn shear_that_rises_as_often_as_it_falls_shows_no_extents() {
    let folder = tempfile::tempdir().unwrap();
    let keys = AREA.replace("contact-area', unit = '1'", "shear-force', unit = 'N'");
    let (rises, falls): (&[f32], &[f32]) = (&[300.0, -300.0, -300.0], &[300.0, -300.0, 300.0]);
    let find = |steps, keys: &str, due: &[&str]| {
        write(&folder.path().join("a.raw"), &[steps, steps]);
        warnings(detect(folder.path(), keys, 2, ""), due);
    };
    find(rises, &keys, &["4 steps of the other sign, beside 2 that fall (accepted: extents by slip or area"]);
    find(falls, &keys, &[]);
    // Of a contact area both are what a contact does.
    find(rises, AREA, &[]);
}

#[test]
fn segments_at_the_same_time_are_refused_and_others_need_no_order() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a-1.raw", "a-2.raw"] {
        write(&folder.path().join(name), &[&[300.0], &[300.0]]);
    }
    let starts = "starts = { file = 'starts.csv', column = 'start', unit = 's' }\narray";
    let keys = AREA.replace("a.raw", "a-*.raw").replace("array", starts);
    let find = |starts: &str| {
        fs::write(folder.path().join("starts.csv"), format!("start\n{starts}")).unwrap();
        detect(folder.path(), &keys, 2, "")
    };
    // A segment lasts 0.8 ms.
    let error = find("0.001\n0.0003\n").unwrap_err().to_string();
    let due = "a-*.raw: parts 2 and 1 at the same time (accepted: parts of a stream one after the other)";
    assert!(error.contains(due), "{error}");
    assert_eq!(find("0.001\n0.0001\n").unwrap().steps().flat_map(|record| record.switches).count(), 8);
}

#[test]
fn clipped_samples_are_counted_across_blocks() {
    let folder = tempfile::tempdir().unwrap();
    let flat = |from: usize, count: usize| move |n: usize| (from..from + count).contains(&n);
    // Blocks end before 1000, 2000 and 3000. Two in a row are none; those at another level are no extreme.
    let high = [flat(998, 5), flat(1999, 3), flat(2500, 2), flat(3000, 4)];
    let low = [flat(1500, 7), flat(2998, 2)];
    let value = |n: usize, has: bool| match n {
        _ if has && high.iter().any(|is| is(n)) => 40.0,
        _ if has && low.iter().any(|is| is(n)) => -30.0,
        700..710 => 5.0,
        _ => (n * n % 13) as f32,
    };
    let samples = (0..4000).flat_map(|n| [value(n, false), value(n, true)]);
    fs::write(folder.path().join("a.raw"), samples.flat_map(f32::to_le_bytes).collect::<Vec<u8>>()).unwrap();
    let due = [
        ": sample 1500: 2 = -30: clipped at -30, 7 samples (accepted: a range that the signal does not leave)",
        ": sample 998: 2 = 40: clipped at 40, 12 samples (accepted: a range that the signal does not leave)",
    ];
    warnings(detect(folder.path(), AREA, 2, ""), &due);
}
