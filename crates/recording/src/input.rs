//! Opens the files that a description names, in its folder and nowhere else.

use std::fmt;
use std::path::{Component, Path, PathBuf};

use crate::csv::Csv;
use crate::description::{Axis, Kind, Stream, Time};
use crate::error::{InputFault, Place, RecordingError};
use crate::npy::Npy;
use crate::samples::{Column, Samples};

/// Most segments of a stream.
const MOST_SEGMENTS: usize = 100_000;

/// A file of a recording, as it was when it was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// Its length.
    pub bytes: u64,
    /// BLAKE3 hash of its content, hexadecimal.
    pub blake3: String,
}

impl fmt::Display for Input {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} bytes, BLAKE3 {}", self.bytes, self.blake3)
    }
}

/// The folder of a description.
#[derive(Debug, Clone)]
pub struct Folder(PathBuf);

impl Folder {
    /// The folder of a file.
    pub fn of(file: &Path) -> Folder {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        Folder(folder.unwrap_or(Path::new(".")).to_owned())
    }

    /// The place of a path that is named in the description, and the path as it is shown.
    fn inside(&self, named: &str) -> Result<(PathBuf, PathBuf), RecordingError> {
        let shown = self.0.join(named);
        let outside = || {
            let problem = "it is outside the folder of the recording";
            InputFault::new(&shown, Place::File, problem, "a file inside, by its path from there")
        };
        if Path::new(named).components().any(|part| !matches!(part, Component::Normal(_))) {
            return Err(outside().into());
        }
        let real = |path: &Path| path.canonicalize().map_err(RecordingError::io(path));
        let (path, folder) = (real(&shown)?, real(&self.0)?);
        if !path.starts_with(folder) {
            return Err(outside().into());
        }
        Ok((path, shown))
    }

    /// The files of a stream: of segments in the order of the numbers in place of the `*`.
    pub(crate) fn files(&self, stream: &Stream) -> Result<Vec<String>, RecordingError> {
        let Some((before, after)) = stream.file.split_once('*') else { return Ok(vec![stream.file.clone()]) };
        let (folder, first) = before.rsplit_once('/').map_or(("", before), |(folder, first)| (folder, first));
        let shown = self.0.join(folder);
        let place = if folder.is_empty() { self.0.clone() } else { self.inside(folder)?.0 };
        let entries = asperity_files::entries(&place).map_err(RecordingError::io(&shown))?;
        let names = entries.iter().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let numbered = |name: String| {
            let number = name.strip_prefix(first)?.strip_suffix(after)?.parse::<u64>().ok()?;
            Some((number, if folder.is_empty() { name } else { format!("{folder}/{name}") }))
        };
        let mut segments: Vec<(u64, String)> = names.filter_map(numbered).collect();
        segments.sort_unstable();
        if segments.is_empty() || segments.len() > MOST_SEGMENTS {
            let problem = format!("{} files have such names with a number for *", segments.len());
            let file = self.0.join(&stream.file);
            return Err(InputFault::new(&file, Place::File, problem, "1 to 100000 segments").into());
        }
        Ok(segments.into_iter().map(|(_, name)| name).collect())
    }

    /// Opens columns of a file of a stream.
    pub(crate) fn open(
        &self,
        stream: &Stream,
        named: &str,
        columns: &[Column],
    ) -> Result<Box<dyn Samples>, RecordingError> {
        let (path, shown) = self.inside(named)?;
        Ok(match stream.kind().expect("it was checked") {
            Kind::Csv => Box::new(Csv::open(&path, &shown, stream.units_row, columns)?),
            Kind::Npy => Box::new(Npy::open(&path, &shown, stream.axis == Axis::ChannelsFirst, columns)?),
        })
    }

    /// The times at which segments start, s.
    pub(crate) fn starts_s(&self, starts: &Time) -> Result<Vec<f64>, RecordingError> {
        let (path, shown) = self.inside(&starts.file)?;
        let mut table = Csv::open(&path, &shown, false, std::slice::from_ref(&starts.column))?;
        let mut block = vec![Vec::new()];
        table.next(MOST_SEGMENTS + 1, &mut block)?;
        let unit_s = starts.unit.as_ref().map_or(1.0, |unit| unit.scale);
        Ok(block[0].iter().map(|start| start * unit_s).collect())
    }

    /// The path of a file as messages show it.
    pub(crate) fn shown(&self, named: &str) -> PathBuf {
        self.0.join(named)
    }

    /// Length and hash of a file.
    pub(crate) fn input(&self, named: &str) -> Result<Input, RecordingError> {
        let (path, shown) = self.inside(named)?;
        let mut file = asperity_files::open(&path).map_err(RecordingError::io(&shown))?;
        let mut hasher = blake3::Hasher::new();
        let bytes = std::io::copy(&mut file, &mut hasher).map_err(RecordingError::io(&shown))?;
        Ok(Input { bytes, blake3: hasher.finalize().to_hex().to_string() })
    }
}
