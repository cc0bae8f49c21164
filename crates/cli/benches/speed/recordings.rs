//! How fast recordings are read, against `cat` of the same file, which is in memory. By the clock, since files are hashed
//! while they are searched.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

use crate::{ROUNDS, asperity, median, watched};

/// Samples of each of 20 channels, 1 GB in all, by the name of their numbers.
const KINDS: [(&str, u32); 3] = [("<i2", 25_000_000), ("<f4", 12_500_000), ("<f8", 6_250_000)];
const CHANNELS: u32 = 20;

/// Samples from one step, of all channels, to the next.
const APART: u32 = 500_000;

const DESCRIPTION: &str = "\
format = 1
name = 'as fast as it goes'
slider = { length_m = 0.1, width_m = 0.005, height_m = 0.02, youngs_modulus_pa = 2.5e9, wave_speed_m_per_s = 1450.6 }
[[stream]]
file = 'a.raw'
channels_in_file = 20
rate_hz = 1e6
array = [{ role = 'slip', unit = 'm', factor = 1e-9, channels = '1..20', x0_m = 0.0025, dx_m = 0.005 }]
";

/// Writes a recording: noise of 40, and steps of 400.
fn write(folder: &Path, numbers: &str, samples: u32) -> std::io::Result<()> {
    fs::write(folder.join("recording.toml"), format!("{DESCRIPTION}numbers = '{numbers}'\n"))?;
    let mut file = BufWriter::new(File::create(folder.join("a.raw"))?);
    let mut state = 1u32;
    for sample in 0..samples {
        let level = (400 * (sample / APART)) as i16;
        for _ in 0..CHANNELS {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise: i16 = state.to_le_bytes().into_iter().map(|byte| i16::from(byte & 63)).sum();
            match numbers {
                "<i2" => file.write_all(&(level + noise).to_le_bytes())?,
                "<f4" => file.write_all(&f32::from(level + noise).to_le_bytes())?,
                _ => file.write_all(&f64::from(level + noise).to_le_bytes())?,
            }
        }
    }
    file.flush()
}

fn elapsed_s(work: impl FnOnce()) -> f64 {
    let begun = Instant::now();
    work();
    begun.elapsed().as_secs_f64()
}

pub(crate) fn recordings() {
    println!("## Recordings: time over that of `cat` of the same file\n");
    println!(
        "20 channels at 1 MHz, with noise and a step every half second. *Hash* reads the file and computes its BLAKE3, and\n\
         does nothing else, in one thread.\n"
    );
    println!(
        "| numbers | GB | `cat`, GB/s | hash | `asperity recording read` | ... in GB/s | memory, MB |\n\
         |---|---|---|---|---|---|---|"
    );
    for (numbers, samples) in KINDS {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        write(folder.path(), numbers, samples).expect("the files can be written");
        let paths = ["a.raw", "recording.toml", "a.mcap"].map(|name| folder.path().join(name));
        let [raw, toml, log] =
            paths.each_ref().map(|path| path.to_str().expect("temporary folders have plain names"));
        let read = ["recording", "read", toml, "--force", "--out", log];
        let cat = || {
            let done = Command::new("cat").arg(raw).stdout(Stdio::null()).status();
            assert!(done.is_ok_and(|status| status.success()), "cat cannot read {raw}");
        };
        let hash = || {
            let file = File::open(raw).expect("it was written");
            blake3::Hasher::new().update_reader(file).expect("it can be read");
        };
        let rounds: Vec<[f64; 3]> =
            (0..ROUNDS).map(|_| [elapsed_s(cat), elapsed_s(hash), elapsed_s(|| asperity(&read))]).collect();
        let of = |of: fn(&[f64; 3]) -> f64| median(rounds.iter().map(of).collect());
        let gb = fs::metadata(raw).expect("it was written").len() as f64 / 1e9;
        println!(
            "| `{numbers}` | {gb:.1} | {:.1} | {:.1} | {:.1} | {:.1} | {:.0} |",
            gb / of(|round| round[0]),
            of(|round| round[1] / round[0]),
            of(|round| round[2] / round[0]),
            gb / of(|round| round[2]),
            watched(&read).2,
        );
    }
    println!();
}
