//! Files and descriptions: layouts of arrays, gaps and uneven times, paths, and keys that are refused.

use std::collections::HashMap;
use std::fs;
use std::io::Write;
use std::path::Path;

use asperity_record::{LoadNoise, Noise, Record, Row, StepRecord};
use asperity_recording::{Description, Detected, Recording, RecordingError};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

const SLIDER: &str = "format = 1\nname = 'made up'\n[slider]\nlength_m = 0.1\nwidth_m = 0.005\nheight_m = 0.02\n\
                      youngs_modulus_pa = 2.5e9\nwave_speed_m_per_s = 1450.6\n[[stream]]\n";

fn open(folder: &Path, stream: &str) -> Result<Recording, RecordingError> {
    Description::parse(&folder.join("recording.toml"), &format!("{SLIDER}{stream}")).and_then(Recording::open)
}

fn detect(folder: &Path, stream: &str) -> Detected {
    open(folder, stream).and_then(|recording| recording.detect(&|_, _| false)).unwrap()
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
        found.push(slips(folder.path(), &format!("file = 'slip.npy'\naxis = '{axis}'"), "'1..2'"));
    }
    let head = b"the head";
    fs::write(folder.path().join("slip.raw"), [head.to_vec(), by_sample().flat_map(big).collect()].concat())
        .unwrap();
    fs::write(folder.path().join("slip.dat"), by_channel().flat_map(single).collect::<Vec<u8>>()).unwrap();
    for file in fs::read_dir(ARRAYS).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), folder.path().join(file.file_name())).unwrap();
    }
    for (keys, channels) in [
        ("file = 'slip.raw'\nnumbers = '>i2'\nchannels_in_file = 2\nskip_bytes = 8", "'1..2'"),
        (
            "file = 'slip.dat'\nkind = 'raw'\nnumbers = '<f4'\nchannels_in_file = 2\naxis = 'channels-first'",
            "'1..2'",
        ),
        ("file = 'stored.npz'\ndataset = 'slip'\naxis = 'channels-first'", "'1..2'"),
        ("file = 'deflated.npz'\ndataset = 'slip'", "'1..2'"),
        ("file = 'v5.mat'\ndataset = 'slip'", "'1..2'"),
        ("file = 'v5.mat'", "['one', 'two']"),
        ("file = 'v5-plain.mat'\ndataset = 'slip'", "'1..2'"),
        ("file = 'v73.mat'\ndataset = 'slip'", "'1..2'"),
        ("file = 'v73.mat'", "['one', 'two']"),
        ("file = 'any.h5'\ndataset = 'plain'", "'1..2'"),
        ("file = 'any.h5'\ndataset = '/first'\naxis = 'channels-first'", "'1..2'"),
        ("file = 'any.h5'\ndataset = 'packed'", "'1..2'"),
        ("file = 'any.h5'\ndataset = 'packed-first'\naxis = 'channels-first'", "'1..2'"),
        (
            "file = 'any.h5'\ndataset = 'measurements/00000001/channels/*/blocks/00000001/raw'",
            "['00000001', '00000002']",
        ),
        ("file = 'latest.h5'\ndataset = 'packed'", "'1..2'"),
        ("file = 'segments.tdms'", "[\"it's/one\", \"it's/Dev1/two\"]"),
        ("file = 'any.tdms'\ndataset = 'slip'", "'1..2'"),
        ("file = 'any.tdms'\ndataset = 'slip/*'", "['one', 'two']"),
    ] {
        found.push(slips(folder.path(), keys, channels));
        assert!(found.last() == found.first(), "{keys}");
    }
    assert!(found.iter().all(|other| *other == found[0]));
}

/// What is found by two slip sensors at 1 MHz.
/// Long arrays are gone through in pieces of 512,000 samples, side by side; the same array in an archive as a whole.
#[test]
fn pieces_give_what_the_whole_gives() {
    let folder = tempfile::tempdir().unwrap();
    // At the joints of pieces: steps of both signs and clipped samples, a row of steps, each in the window of the one
    // before, and a step whose window begins just behind.
    let [first, second, third] = [1, 2, 3].map(|n| 512_000 * n);
    let levels: HashMap<i64, i16> =
        [(first - 30, 400), (first - 1, -400), (first + 31, 400), (first + 70, -400)]
            .into_iter()
            .chain((0..90).map(|n| (second - 300 + 40 * n, if n % 9 == 8 { -240 } else { 30 })))
            .chain([(third + 40, -300), (third + 9_000, 300)])
            .collect();
    let mut level = 0;
    let sample = |n: i64| {
        level += levels.get(&n).copied().unwrap_or_default();
        let is_clipped =
            (first - 2..first + 2).contains(&n) || (second + 50_000..second + 50_005).contains(&n);
        if is_clipped { i16::MAX } else { level + (n * n % 41) as i16 }
    };
    let samples: Vec<u8> = (0..third + 60_000).map(sample).flat_map(i16::to_le_bytes).collect();
    let header = format!("{{'descr': '<i2', 'fortran_order': False, 'shape': ({},), }}\n", samples.len() / 2);
    let array = [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &samples]
        .concat();
    fs::write(folder.path().join("a.npy"), &array).unwrap();
    let mut archive = ZipWriter::new(fs::File::create(folder.path().join("a.npz")).unwrap());
    archive
        .start_file("a.npy", SimpleFileOptions::default().compression_method(CompressionMethod::Stored))
        .unwrap();
    archive.write_all(&array).unwrap();
    archive.finish().unwrap();
    let read = |file: &str| {
        let array = "[[stream.array]]\nrole = 'shear-strain'\nunit = '1'\nchannels = '1..1'\nx_m = [0.05]\n";
        let recording = open(folder.path(), &format!("{file}\nrate_hz = 1e6\n{array}")).unwrap();
        let mut found = recording.detect(&|_, _| false).unwrap();
        let warnings =
            found.warnings.iter().map(|of| of.to_string().replace("a.npz", "a.npy")).collect::<Vec<_>>();
        (recording.records(&mut found, &|| false).collect::<Result<Vec<Record>, _>>().unwrap(), warnings)
    };
    let (records, warnings) = read("file = 'a.npy'");
    let (of_whole, of_whole_warnings) = read("file = 'a.npz'\ndataset = 'a'");
    assert_eq!(warnings, of_whole_warnings);
    assert!(warnings.iter().any(|of| of.contains("clipped at 32767, 9 samples")), "{warnings:?}");
    assert!(warnings.iter().any(|of| of.contains("steps of the other sign")), "{warnings:?}");
    assert!(
        records.iter().filter(|of| matches!(of, Record::Step(step) if !step.switches.is_empty())).count()
            > 20
    );
    assert!(records == of_whole, "{} records, of the whole {}", records.len(), of_whole.len());
}

fn slips(folder: &Path, keys: &str, channels: &str) -> (Vec<StepRecord>, Vec<Row>) {
    let found = detect(folder, &slip_sensors(keys, channels));
    let (records, noise) = (found.steps().collect::<Vec<_>>(), found.rows);
    assert_eq!(records.iter().map(|record| record.switches.len()).sum::<usize>(), 4, "{keys}");
    (records, noise)
}

fn slip_sensors(keys: &str, channels: &str) -> String {
    format!(
        "{keys}\nrate_hz = 1e6\narray = [{{ role = 'slip', unit = 'm', factor = 1e-9, channels = {channels}, \
         x_m = [0.02, 0.04] }}]"
    )
}

#[test]
fn many_channels_of_an_array_give_what_those_of_a_table_give() {
    const SENSORS: i16 = 21;
    let folder = tempfile::tempdir().unwrap();
    let counts = || (0..2500).flat_map(|sample| (1..=SENSORS).map(move |sensor| count(sensor, sample)));
    fs::write(folder.path().join("slip.raw"), counts().flat_map(i16::to_le_bytes).collect::<Vec<u8>>())
        .unwrap();
    let heading: Vec<String> = (1..=SENSORS).map(|sensor| format!("s{sensor}")).collect();
    let rows = counts().collect::<Vec<i16>>();
    let row = |row: &[i16]| row.iter().map(i16::to_string).collect::<Vec<String>>().join(",") + "\n";
    let rows: String = rows.chunks(SENSORS as usize).map(row).collect();
    fs::write(folder.path().join("slip.csv"), heading.join(",") + "\n" + &rows).unwrap();
    let [table, array] = ["file = 'slip.csv'", "file = 'slip.raw'\nnumbers = '<i2'\nchannels_in_file = 21"]
        .map(|keys| {
            let array = "role = 'slip', unit = 'nm', channels = '1..21', x0_m = 0.004, dx_m = 0.004";
            let recording = open(folder.path(), &format!("{keys}\nrate_hz = 1e6\narray = [{{ {array} }}]"));
            let recording = recording.unwrap();
            let mut found = recording.detect(&|_, _| false).unwrap();
            let records = recording.records(&mut found, &|| false);
            records.map(|record| format!("{:?}", record.unwrap())).collect::<Vec<String>>()
        });
    assert!(table.iter().filter(|record| record.starts_with("Signal")).count() == 3);
    assert!(table.iter().filter(|record| record.contains("Detach")).count() >= SENSORS as usize);
    assert_eq!(array, table);
}

/// Arrays in containers, written by h5py, SciPy and npTDMS, which reads any.tdms as well: written by hand, with interleaved
/// values, either order of bytes, lists that are kept, changed and appended to, and an open end.
const ARRAYS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/recordings/arrays");

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
fn tables_of_spreadsheets_and_of_other_programs_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let plain = forces((0..1000).map(|n| f64::from(n) * 1e-3), &[0.45]);
    let semicolons = plain.replace(',', ";");
    let commas = semicolons.replace('.', ",");
    let read = |text: &str, keys: &str| {
        fs::write(folder.path().join("forces.csv"), text).unwrap();
        open(folder.path(), &format!("{FORCE}{keys}")).and_then(|recording| recording.detect(&|_, _| false))
    };
    let drops = read(&plain, "").unwrap().drops;
    assert_eq!(drops.len(), 1);
    for (text, keys) in [
        (format!("\u{feff}{commas}").replace('\n', "\r\n"), ""),
        (semicolons.clone(), ""),
        (commas.replace(';', "\t"), ""),
        (plain.replace(',', " "), "delimiter = 'space'"),
        (format!("made by; a program\n\n{semicolons}\n\n"), "skip_rows = 2"),
        (format!("# {plain}"), ""),
        (format!("# made by a program\n# {plain}# the end\n"), ""),
        (format!("# made by a program\n{plain}"), ""),
        (plain.replace("t,F", "\"t\",\"F\""), ""),
    ] {
        let found = read(&text, keys).unwrap_or_else(|error| panic!("{}: {error}", &text[..30]));
        assert!(found.drops == drops, "{}", &text[..30]);
    }
    let utf16: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (text, keys, told) in [
        (
            commas.replacen("0,0010;", "0.0010;", 1),
            "",
            ":3: t = 0.0010: another decimal mark than before (accepted: ",
        ),
        (plain.replacen("0.0010,", "0.0010 s,", 1), "", ":3: t = 0.0010 s: not a number (accepted: "),
        (format!("preamble\n{plain}"), "skip_rows = 2", ":3: F: no such column; there are 0.0000, "),
        (format!("a\nb\n{}", plain.replacen("0.0020,", "inf,", 1)), "skip_rows = 2", ":6: t = inf: "),
        (
            format!("a\nb\n{}", plain.replacen("0.0020,", "-1,", 1)),
            "skip_rows = 2",
            ":6: t = -1.000: time runs back",
        ),
        (String::new(), "", ":1: F: no such column"),
        (format!("t,F\n{}", "1".repeat(100_000)), "", "line 2 is longer than 65536 bytes"),
        (plain.clone(), "delimiter = '|'", ":13:13: delimiter = '|' is not accepted (accepted: comma, "),
    ] {
        let error = read(&text, keys).map(drop).unwrap_err().to_string();
        assert!(error.contains(told), "{error}\nlacks {told}");
    }
    fs::write(folder.path().join("forces.csv"), [b"\xff\xfe".to_vec(), utf16].concat()).unwrap();
    let error = open(folder.path(), FORCE).unwrap_err().to_string();
    assert!(error.contains("UTF-16"), "{error}");
}

/// Samples without a number make a gap, of all channels of their stream, and are counted.
#[test]
fn missing_samples_are_a_gap() {
    let folder = tempfile::tempdir().unwrap();
    let text = forces((0..2000).map(|n| f64::from(n) * 1e-3), &[0.45, 1.5]);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let cut =
        |line: &str, with: &str| line.split_once(',').map(|(time, _)| format!("{time},{with}")).unwrap();
    for (n, line) in (901..951).zip(&mut lines[901..951]) {
        *line = cut(line, if n % 2 == 0 { "" } else { "NaN" });
    }
    lines[1] = cut(&lines[1], "");
    lines[2000] = ",".to_owned();
    fs::write(folder.path().join("forces.csv"), lines.join("\n")).unwrap();
    let error = open(folder.path(), FORCE)
        .and_then(|recording| recording.detect(&|_, _| false))
        .map(drop)
        .unwrap_err()
        .to_string();
    assert!(error.contains("forces.csv:2001: t: empty cell"), "{error}");
    let by_rate = FORCE.replace("time = { column = 't', unit = 's' }", "rate_hz = 1000");
    for stream in [FORCE, &by_rate] {
        let Detected { drops, rows, .. } = detect(folder.path(), &format!("{stream}missing = 'gap'"));
        let missing = rows.iter().filter_map(|row| Some(row.values.get::<LoadNoise>()?.missing));
        assert_eq!(missing.collect::<Vec<_>>(), [1, 51], "{stream}");
        assert_eq!(drops.iter().map(|drop| drop.part).collect::<Vec<_>>(), [1, 2], "{stream}");
        for (drop, due_s) in drops.iter().zip([0.45, 1.5]) {
            assert!((drop.onset_s - due_s).abs() < 2e-3, "{drop:?}");
        }
    }
    // A gap of time without empty cells is refused as before; with its place.
    lines.remove(1200);
    fs::write(folder.path().join("forces.csv"), lines.join("\n")).unwrap();
    let error = open(folder.path(), &format!("{FORCE}missing = 'gap'")).unwrap_err().to_string();
    assert!(error.contains("forces.csv:1201: t = 1.200: gap of 0.002 s"), "{error}");

    let array = |sample: i16, sensor: i16| {
        let is_there = !(sensor == 2 && (600..620).contains(&sample));
        if is_there { f32::from(count(sensor, sample)) } else { f32::NAN }
    };
    let bytes = (0..1000).flat_map(|n| [array(n, 1), array(n, 2)]).flat_map(f32::to_le_bytes).collect();
    fs::write(folder.path().join("slip.npy"), npy("<f4", false, [1000, 2], bytes)).unwrap();
    let stream = slip_sensors("file = 'slip.npy'\nmissing = 'gap'", "'1..2'");
    let noise = detect(folder.path(), &stream).rows;
    let of_sensors = noise.iter().filter_map(|row| row.values.get::<Noise>());
    let missing: Vec<_> = of_sensors.map(|noise| (noise.part, noise.sensor, noise.missing)).collect();
    assert_eq!(missing, [(1, 1, 0), (1, 2, 0), (2, 1, 20), (2, 2, 20)]);
    let error = detect_error(folder.path(), &stream.replace("missing = 'gap'\n", ""));
    assert!(error.contains("slip.npy: sample 600: 2 = NaN: not a finite number"), "{error}");

    let every_other = (0..200_002).map(|n| if n % 2 == 0 { 1.0 } else { f32::NAN });
    fs::write(folder.path().join("gaps.raw"), every_other.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())
        .unwrap();
    let keys = "file = 'gaps.raw'\nnumbers = '<f4'\nchannels_in_file = 1\nmissing = 'gap'";
    let error = detect_error(folder.path(), &slip_sensors(keys, "[1, 1]"));
    assert!(error.contains("gaps.raw: too many gaps (accepted: 100000 parts)"), "{error}");
}

fn detect_error(folder: &Path, stream: &str) -> String {
    open(folder, stream).and_then(|recording| recording.detect(&|_, _| false)).unwrap_err().to_string()
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
        (
            "rate_hz = 1e6",
            "rate_hz = 1e6\nskip_rows = 1",
            ":9:1: units_row, skip_rows and delimiter are of csv",
        ),
        (
            "rate_hz = 1e6",
            "rate_hz = 1e6\nskip_bytes = 1",
            ":9:1: units_row, skip_rows and delimiter are of csv",
        ),
        ("a.npy'", "a.csv'\naxis = 'channels-first'", ":9:1: units_row, skip_rows and delimiter are of csv"),
        (
            "a.npy'",
            "a.bin'\nnumbers = '<i2'",
            ":9:1: raw needs numbers and channels_in_file, and only it has them",
        ),
        ("a.npy'", "a.raw'\nnumbers = 'i2'\nchannels_in_file = 2", ":11:11: numbers = 'i2' is not accepted"),
        (
            "rate_hz = 1e6",
            "time = { column = 1 }\nresample = 'linear'\nmissing = 'gap'",
            ":9:1: resample would fill the gaps of missing",
        ),
        ("role = 'slip'", "role = 'acoustic'", ":1:1: nothing from which events follow"),
        ("a.npy", "a.xls", ":9:1: file = \"a.xls\" (accepted: csv, npy, npz, hdf5, mat, tdms, raw; or kind"),
    ] {
        assert!(array.contains(key));
        let error = open(folder.path(), &array.replace(key, value)).unwrap_err().to_string();
        assert!(error.contains(&format!("recording.toml{told}")), "{error}");
    }
}
