//! Files that are damaged, that claim more than they hold, that change while they are read, or that are no files:
//! refused in words that name them, without a panic, in bounded memory.

use std::fs;
use std::path::Path;

use asperity_recording::{Description, Detected, Recording, RecordingError};

const ARRAYS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/recordings/arrays");

fn open(folder: &Path, keys: &str) -> Result<Recording, RecordingError> {
    let text = format!(
        "format = 1\nname = 'made up'\n[slider]\nlength_m = 0.1\nwidth_m = 0.005\nheight_m = 0.02\n\
         youngs_modulus_pa = 2.5e9\nwave_speed_m_per_s = 1450.6\n[[stream]]\n{keys}\nrate_hz = 1e6\narray = [{{ \
         role = 'slip', unit = 'm', factor = 1e-9, channels = '1..2', x_m = [0.02, 0.04] }}]"
    );
    Description::parse(&folder.join("recording.toml"), &text).and_then(Recording::open)
}

fn read(folder: &Path, keys: &str) -> Result<Detected, RecordingError> {
    open(folder, keys).and_then(|recording| recording.detect(&|_, _| false))
}

/// What is said of a file in a folder of its own.
fn refused(name: &str, keys: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join(name), bytes).unwrap();
    read(folder.path(), &format!("file = '{name}'\n{keys}")).map(drop).unwrap_err().to_string()
}

fn npy(header: &str) -> Vec<u8> {
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &[0; 4000]].concat()
}

#[test]
fn damaged_arrays_are_read_or_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, keys) in [
        ("any.h5", "dataset = 'packed'"),
        ("any.h5", "dataset = 'plain'"),
        ("latest.h5", "dataset = 'packed'"),
        ("v73.mat", "dataset = 'slip'"),
        ("v5.mat", "dataset = 'slip'"),
        ("v5-plain.mat", "dataset = 'slip'"),
        ("deflated.npz", "dataset = 'slip'"),
        ("stored.npz", "dataset = 'slip'\naxis = 'channels-first'"),
        ("segments.tdms", "dataset = \"it's\""),
        ("any.tdms", "dataset = 'slip'"),
    ] {
        let sound = fs::read(Path::new(ARRAYS).join(name)).unwrap();
        let keys = format!("file = '{name}'\n{keys}");
        let mut said = 0;
        for n in 0..240 {
            let at = (n * n * 7919 + n * 104_729) % sound.len();
            let mut bytes = sound.clone();
            match n % 4 {
                0 => bytes.truncate(at),
                1 => bytes[at] ^= 1 << (n % 8),
                2 => bytes[at] = 0xff,
                // Headers are at the start.
                _ => bytes[n * 7 % sound.len()] = (n * 31) as u8,
            }
            fs::write(folder.path().join(name), bytes).unwrap();
            if let Err(error) = read(folder.path(), &keys) {
                assert!(error.to_string().contains(name), "{error}");
                said += 1;
            }
        }
        assert!(said > 10, "{name}: {said}");
    }
}

#[test]
fn what_claims_more_than_it_holds_is_refused() {
    let huge = format!("{{'descr': '<i2', 'fortran_order': False, 'shape': ({}, 2), }}\n", 1_u64 << 60);
    let wide = "{'descr': '<i2', 'fortran_order': False, 'shape': (2, 1000), }\n".replace("1000", "1000000");
    for (name, keys, bytes, told) in [
        ("a.npy", "", npy(&huge), "which is not what its header says"),
        ("a.npy", "", npy(&wide), "which is not what its header says"),
        ("a.npy", "", b"\x93NUMPY\x02\x00\xff\xff\xff\xff....".to_vec(), "its header is too long"),
        ("a.npy", "", b"\x93NUM".to_vec(), "not an array of NumPy"),
        ("a.raw", "numbers = '<i2'\nchannels_in_file = 3", vec![0; 4001], "4001 bytes, which is not what"),
        (
            "a.raw",
            "numbers = '<f8'\nchannels_in_file = 2",
            vec![0xff; 16_000],
            "sample 0: 1 = NaN: not a finite",
        ),
        ("a.npz", "dataset = 'x'", b"PK\x05\x06".to_vec(), "a.npz: "),
        ("a.npz", "", fs::read(Path::new(ARRAYS).join("stored.npz")).unwrap(), "there are slip, other"),
        ("a.mat", "dataset = 'x'", vec![0; 4000], "not a file of MATLAB"),
        (
            "a.mat",
            "",
            fs::read(Path::new(ARRAYS).join("v5.mat")).unwrap(),
            "there are other, note, slip, one",
        ),
        ("a.mat", "dataset = 'note'", fs::read(Path::new(ARRAYS).join("v5.mat")).unwrap(), "real numbers"),
        ("a.h5", "dataset = 'x'", b"\x89HDF\r\n\x1a\n".to_vec(), "a.h5: "),
        ("a.h5", "", fs::read(Path::new(ARRAYS).join("latest.h5")).unwrap(), "there are "),
    ] {
        let error = refused(name, keys, &bytes);
        assert!(error.contains(name) && error.contains(told), "{error}\nlacks {told}");
    }
    let any = fs::read(Path::new(ARRAYS).join("any.tdms")).unwrap();
    let changed = |at: usize, with: &[u8]| [&any[..at], with, &any[at + with.len()..]].concat();
    for (bytes, keys, told) in [
        (any.clone(), "", "other/three: 210 values, no numbers or not 1000"),
        (any.clone(), "dataset = 'none'", "no channel \"none\"; there are slip/one, slip/two, other/three"),
        (any.clone(), "dataset = 'other'", "no such channel; there are 1"),
        (any[..20].to_vec(), "", "a.tdms: byte 20: it ends in a header (accepted: "),
        (any[..500].to_vec(), "", "byte 28: a segment that is longer than the file, 500 bytes"),
        (vec![0; 40], "", "byte 8: no segment of TDMS"),
        (changed(4, &[0xee]), "", "byte 8: values of DAQmx, which need its scales"),
        (changed(62, &[0, 0, 0x12, 0x69]), "", "byte 66: values of DAQmx, which need its scales"),
        (changed(32, &[0xff; 4]), "", "byte 36: a text that is too long"),
    ] {
        let error = refused("a.tdms", keys, &bytes);
        assert!(error.contains("a.tdms: ") && error.contains(told), "{error}\nlacks {told}");
    }
    let claims = fs::read(Path::new(ARRAYS).join("claims.h5")).unwrap();
    let error = refused("claims.h5", "dataset = 'slip'", &claims);
    assert!(error.contains("it claims [576460752303423488, 2] numbers in a file of "), "{error}");
    // A message is not as long as a file makes it.
    let error =
        refused("long.csv", "", format!("a,b\n{}1,{}\n", "1,2\n".repeat(200), "x".repeat(60_000)).as_bytes());
    assert!(error.contains("long.csv:202: b = xxx") && error.len() < 2000, "{} bytes", error.len());
    // The sides of an array of MATLAB, 2^31 - 1 each.
    let mut sides = fs::read(Path::new(ARRAYS).join("v5-plain.mat")).unwrap();
    let at = sides.windows(8).position(|bytes| bytes == [0xe8, 3, 0, 0, 2, 0, 0, 0]).unwrap();
    sides[at..at + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff, 0x7f]);
    let error = refused("sides.mat", "dataset = 'slip'", &sides);
    assert!(error.contains("4000 bytes, which is not what its header says"), "{error}");
}

#[test]
fn a_file_that_changes_while_it_is_read_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let table: String = (0..1000).map(|n| format!("{},{}\n", n % 7, n % 5)).collect();
    let raw: Vec<u8> = (0..4000_u32).map(|n| (n % 7) as u8).collect();
    for (name, keys, bytes) in [
        ("slip.csv", "", format!("a,b\n{table}").into_bytes()),
        ("slip.raw", "numbers = '<i2'\nchannels_in_file = 2", raw.clone()),
        ("first.raw", "numbers = '<i2'\nchannels_in_file = 2\naxis = 'channels-first'", raw),
        ("any.h5", "dataset = 'plain'", fs::read(Path::new(ARRAYS).join("any.h5")).unwrap()),
        ("v5.mat", "dataset = 'slip'", fs::read(Path::new(ARRAYS).join("v5.mat")).unwrap()),
    ] {
        let path = folder.path().join(name);
        let recording = || {
            fs::write(&path, &bytes).unwrap();
            open(folder.path(), &format!("file = '{name}'\n{keys}")).unwrap()
        };
        let shorter = recording();
        fs::write(&path, &bytes[..bytes.len() / 20]).unwrap();
        let said = shorter.detect(&|_, _| false).map(drop).unwrap_err().to_string();
        assert!(said.contains(name), "{said}");
        let gone = recording();
        fs::remove_file(&path).unwrap();
        let said = gone.detect(&|_, _| false).map(drop).unwrap_err().to_string();
        assert!(said.contains(name), "{said}");
    }
}

/// Other files than that of a stream, and what is no file.
#[test]
#[cfg(unix)]
fn nothing_else_is_opened() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let inside = folder.path().join("inside");
    fs::create_dir(&inside).unwrap();
    for name in ["any.h5", "latest.h5"] {
        fs::copy(Path::new(ARRAYS).join(name), inside.join(name)).unwrap();
    }
    fs::write(inside.join("raw.bin"), [0; 4000]).unwrap();
    // A link to another file, and numbers in another file.
    for dataset in ["outside", "external"] {
        let error =
            read(&inside, &format!("file = 'latest.h5'\ndataset = '{dataset}'")).unwrap_err().to_string();
        assert!(error.contains("latest.h5"), "{error}");
    }
    fs::write(folder.path().join("a.csv"), "a,b\n1,2\n").unwrap();
    symlink("..", inside.join("up")).unwrap();
    symlink("/dev/zero", inside.join("zero.raw")).unwrap();
    symlink("loop.csv", inside.join("loop.csv")).unwrap();
    assert!(std::process::Command::new("mkfifo").arg(inside.join("pipe.csv")).status().unwrap().success());
    fs::create_dir(inside.join("folder.npy")).unwrap();
    for (file, keys, told) in [
        ("up/a.csv", "", "it is outside the folder of the recording"),
        ("zero.raw", "numbers = '<i2'\nchannels_in_file = 2", "it is outside the folder of the recording"),
        ("loop.csv", "", "loop.csv: "),
        ("pipe.csv", "", "it is a pipe, not a file"),
        ("folder.npy", "", "it is a folder, not a file"),
        ("none.npy", "", "none.npy: "),
    ] {
        let error = read(&inside, &format!("file = '{file}'\n{keys}")).map(drop).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}
