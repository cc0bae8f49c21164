//! Recognises the kind of a path given to a command: a run log, a scenario, a sweep, a folder of these. The
//! first bytes, the keys of a TOML file or the names in a folder decide, whether or not the contents are
//! valid.

use std::io::Read;
use std::path::Path;
use std::{fs, io};

use asperity_files::open;
use asperity_model::scenario::keys::KEYS;
use asperity_record::bounds::LONGEST_TOML_BYTES;

use crate::{plan, runs};

/// The kind of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Given {
    /// A run log, whole or not, or another MCAP file.
    Log,
    /// A Parquet table.
    Parquet,
    /// A TOML file with keys of a scenario.
    Scenario,
    /// A TOML file with runs over axes.
    Sweep,
    /// A TOML file with named runs, and none over axes.
    Pipeline,
    /// A TOML file of anything else, or one that cannot be read.
    Toml,
    /// A folder that `reproduce`, or a study of runs with names, wrote.
    Reproduced,
    /// A folder with a plan.
    Study,
    /// A folder of run logs.
    Logs,
    /// Another folder.
    Folder,
    /// A file of another format, in words.
    Foreign(&'static str),
    /// Another text: a CSV table or any other.
    Text,
    /// Any other file, or nothing.
    Other,
}

/// The file that lists the contents of a folder of `reproduce`, and their runs.
pub const RECORD: &str = "reproduce.json";

/// The first bytes of MCAP and Parquet files.
const MCAP: &[u8] = b"\x89MCAP0\r\n";
const PARQUET: &[u8] = b"PAR1";

/// The first bytes of files that are no longer than those of MCAP, and what they are.
const FOREIGN: [(&[u8], &str); 5] = [
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"%PDF-", "a PDF document"),
    (b"\x1f\x8b", "a gzip file, which must be unpacked first"),
    (b"PK\x03\x04", "a ZIP file, or one of a spreadsheet"),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file"),
];

impl Given {
    /// Looks at a path.
    ///
    /// # Errors
    /// If it is a file that cannot be read.
    pub fn read(path: &Path) -> io::Result<Given> {
        if path.is_dir() {
            return Ok(Given::of_folder(path));
        }
        // A stream can be read only once, and the command will read it.
        if !path.is_file() {
            return Ok(Given::Other);
        }
        let mut file = open(path)?;
        let mut bytes = Vec::new();
        file.by_ref().take(MCAP.len() as u64).read_to_end(&mut bytes)?;
        if bytes == MCAP {
            return Ok(Given::Log);
        }
        if bytes.starts_with(PARQUET) {
            return Ok(Given::Parquet);
        }
        if let Some((_, what)) = FOREIGN.iter().find(|(start, _)| bytes.starts_with(start)) {
            return Ok(Given::Foreign(what));
        }
        file.take(LONGEST_TOML_BYTES as u64).read_to_end(&mut bytes)?;
        let text = String::from_utf8(bytes).ok().filter(|text| !text.is_empty() && !text.contains('\0'));
        let other = match text {
            _ if path.extension().is_some_and(|ending| ending == "toml") => Given::Toml,
            Some(_) => Given::Text,
            None => Given::Other,
        };
        Ok(text.and_then(|text| Given::of_toml(&text)).unwrap_or(other))
    }

    /// Looks at a path; a file that cannot be read is [`Given::Other`], for whoever opens it to report.
    pub fn of(path: &Path) -> Given {
        Given::read(path).unwrap_or(Given::Other)
    }

    fn of_folder(folder: &Path) -> Given {
        if folder.join(RECORD).is_file() {
            Given::Reproduced
        } else if folder.join(plan::FILE).exists() {
            Given::Study
        } else if has_logs(folder) || has_logs(&folder.join(runs::FOLDER)) {
            Given::Logs
        } else {
            Given::Folder
        }
    }

    fn of_toml(text: &str) -> Option<Given> {
        let table: toml::Table =
            asperity_record::bounds::check_toml(text).ok().and_then(|()| text.parse().ok())?;
        let has = |key: &str| table.contains_key(key);
        let is_of_scenario = || KEYS.iter().any(|key| key.path.split('.').next().is_some_and(has));
        if has("axis") {
            Some(Given::Sweep)
        } else if has("run") {
            Some(Given::Pipeline)
        } else if is_of_scenario() {
            Some(Given::Scenario)
        } else {
            None
        }
    }
}

/// Whether a folder contains a run log.
fn has_logs(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| entry.path()).any(|path| path.extension().is_some_and(|ending| ending == "mcap"))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{Given, MCAP, RECORD};

    #[test]
    fn bytes_keys_and_names_show_what_is_given() {
        let scratch = asperity_testkit::folder();
        let at = |name: &str| scratch.path().join(name);
        let file = |name: &str, bytes: &[u8]| {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), bytes).unwrap();
        };
        let log = [MCAP, b"and so on"].concat();
        let files: [(&str, &[u8], Given); 14] = [
            ("a.mcap", &log, Given::Log),
            ("a.toml.partial", &log, Given::Log),
            ("a.parquet", b"PAR1...", Given::Parquet),
            ("slider.toml", b"name = 'a'\n[slider]\nblocks = 7", Given::Scenario),
            ("no-ending", b"[friction]\nlaw = 'rigid'", Given::Scenario),
            ("sweep.toml", b"title = 'a'\nscenario = 'default'\n[[axis]]\nkey = 'x'", Given::Sweep),
            ("both.toml", b"[[run]]\nname = 'a'\n[[axis]]\nkey = 'x'", Given::Sweep),
            ("pipeline.toml", b"[[run]]\nname = 'a'", Given::Pipeline),
            ("policy.toml", b"window_s = 1e-3", Given::Toml),
            ("broken.toml", b"[[axis", Given::Toml),
            ("a.csv", b"time_s\n1\n", Given::Text),
            ("a.png", b"\x89PNG\r\n\x1a\n\0\0", Given::Foreign("a PNG picture")),
            ("zeros.mcap", b"\0\0\0\0\0\0\0\0\0", Given::Other),
            ("empty.mcap", b"", Given::Other),
        ];
        for (name, bytes, given) in files {
            file(name, bytes);
            assert_eq!(Given::of(&at(name)), given, "{name}");
        }
        file("study/plan.ndjson", b"");
        file("made/plan.ndjson", b"");
        file(&format!("made/{RECORD}"), b"");
        file("logs/a.mcap", b"");
        file("runs-only/runs/a.mcap", b"");
        fs::create_dir(at("empty")).unwrap();
        let folders = [
            ("study", Given::Study),
            ("made", Given::Reproduced),
            ("logs", Given::Logs),
            ("runs-only", Given::Logs),
            ("empty", Given::Folder),
            ("not-there", Given::Other),
        ];
        for (name, given) in folders {
            assert_eq!(Given::of(&at(name)), given, "{name}");
        }
    }
}
