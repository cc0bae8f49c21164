//! Opens the files that a description names, in its folder and nowhere else.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, OnceLock};

use asperity_files::{Hashing, PartlyHashed};
use zip::ZipArchive;

use crate::array::{Arrays, MOST_IN_MEMORY, Opened, Problem, Source, stored};
use crate::csv::Csv;
use crate::description::{Axis, Column, Kind, Stream, Time};
use crate::error::{InputFault, RecordingError, Result};
use crate::samples::{Block, Samples};
use crate::{hdf5, matlab, npy, tdms};

/// Most segments of a stream.
const MOST_SEGMENTS: usize = 100_000;

/// Length of a file of a recording, and the BLAKE3 hash of its content, hexadecimal.
pub(crate) type Input = (u64, String);

/// Arrays of NumPy in memory by the names of the files for which they stand: each gives the bytes of its file.
pub type Given = BTreeMap<String, Arc<dyn Fn() -> Box<dyn Source> + Send + Sync>>;

/// The folder of a description.
pub struct Folder {
    path: PathBuf,
    given: Given,
    /// What is known of the hashes of files, once those are computed.
    pub(crate) hashed: OnceLock<BTreeMap<String, Arc<PartlyHashed>>>,
}

impl fmt::Debug for Folder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.path.fmt(f)
    }
}

impl Folder {
    /// The folder of a file, in which some files are in memory.
    pub fn of(file: &Path, given: Given) -> Folder {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        Folder { path: folder.unwrap_or(Path::new(".")).to_owned(), given, hashed: OnceLock::new() }
    }

    /// The path of a file as messages show it.
    pub(crate) fn shown(&self, named: &str) -> PathBuf {
        self.path.join(named)
    }

    /// The place of a path that is named in the description.
    fn inside(&self, named: &str) -> Result<PathBuf> {
        let shown = self.shown(named);
        let outside = || {
            let problem = "it is outside the folder of the recording";
            InputFault::new(&shown, "", problem, "a file inside, by its path from there")
        };
        if Path::new(named).components().any(|part| !matches!(part, Component::Normal(_))) {
            return Err(outside().into());
        }
        let real = |path: &Path| path.canonicalize().map_err(RecordingError::io(path));
        let (path, folder) = (real(&shown)?, real(&self.path)?);
        if !path.starts_with(folder) {
            return Err(outside().into());
        }
        Ok(path)
    }

    /// A file that is named in the description.
    fn file(&self, named: &str) -> Result<File> {
        asperity_files::open(&self.inside(named)?).map_err(RecordingError::io(&self.shown(named)))
    }

    /// The files of a stream: of segments in the order of the numbers in place of the `*`.
    pub(crate) fn files(&self, stream: &Stream) -> Result<Vec<String>> {
        let Some((before, after)) = stream.file.split_once('*') else { return Ok(vec![stream.file.clone()]) };
        let folder = &before[..before.rfind('/').map_or(0, |slash| slash + 1)];
        let numbered =
            |name: String| Some((name.strip_prefix(before)?.strip_suffix(after)?.parse().ok()?, name));
        let mut segments: Vec<(u64, String)> = self.given.keys().cloned().filter_map(numbered).collect();
        if segments.is_empty() {
            let place = if folder.is_empty() { self.path.clone() } else { self.inside(folder)? };
            let entries = asperity_files::entries(&place).map_err(RecordingError::io(&self.shown(folder)))?;
            let names =
                entries.iter().map(|entry| format!("{folder}{}", entry.file_name().to_string_lossy()));
            segments.extend(names.filter_map(numbered));
        }
        segments.sort_unstable();
        if segments.is_empty() || segments.len() > MOST_SEGMENTS {
            let problem = format!("{} files have such names with a number for *", segments.len());
            let file = self.path.join(&stream.file);
            return Err(InputFault::new(&file, "", problem, "1 to 100000 segments").into());
        }
        Ok(segments.into_iter().map(|(_, name)| name).collect())
    }

    /// Opens columns of a file of a stream.
    pub(crate) fn open(&self, stream: &Stream, named: &str, columns: &[Column]) -> Result<Box<dyn Samples>> {
        let (shown, axis) = (&self.shown(named), stream.axis);
        if let Some(given) = self.given.get(named) {
            return Ok(Box::new(Arrays::open(shown, stream, columns, &mut |_| npy::array(given(), axis))?));
        }
        let file = self.file(named)?;
        Ok(match stream.kind().expect("it was checked") {
            Kind::Csv => Box::new(Csv::open(file, shown, stream, columns)?),
            kind => {
                let mut find = arrays(kind, file, stream, self.known(named)).map_err(|problem| {
                    InputFault::new(shown, "", problem.to_string(), "a file as its kind says")
                })?;
                Box::new(Arrays::open(shown, stream, columns, &mut find)?)
            }
        })
    }

    /// The times at which segments start, s.
    pub(crate) fn starts_s(&self, starts: &Time) -> Result<Vec<f64>> {
        let (file, columns) = (self.file(&starts.file)?, std::slice::from_ref(&starts.column));
        let mut table = Csv::open(file, &self.shown(&starts.file), &Stream::default(), columns)?;
        let mut block = Block::new(1);
        table.next(MOST_SEGMENTS + 1, &mut block)?;
        let unit_s = starts.unit.as_ref().map_or(1.0, |unit| unit.scale);
        Ok(block.row(0, 0).map(|start| start * unit_s).collect())
    }

    /// Length and hash of a file, unless it is stopped.
    pub(crate) fn input(&self, named: &str, is_stopped: &(dyn Fn() -> bool + Sync)) -> Result<Input> {
        let open = || match self.given.get(named) {
            _ if is_stopped() => Err(RecordingError::Interrupted),
            Some(given) => Ok(given()),
            None => Ok(Box::new(self.file(named)?) as Box<dyn Source>),
        };
        let known = self.known(named).unwrap_or_default();
        let (bytes, hash) = known.hash(open, RecordingError::io(&self.shown(named)))?;
        Ok((bytes, hash.to_hex().to_string()))
    }

    /// What is known of the hash of a file, where it is computed.
    fn known(&self, named: &str) -> Option<Arc<PartlyHashed>> {
        self.hashed.get()?.get(named).cloned()
    }
}

/// Opens an array by its name.
type Find = Box<dyn FnMut(&str) -> Opened>;

/// What opens the arrays in a file of a stream.
fn arrays(
    kind: Kind,
    mut file: File,
    stream: &Stream,
    known: Option<Arc<PartlyHashed>>,
) -> Result<Find, Problem> {
    let (axis, mut room) = (stream.axis, MOST_IN_MEMORY);
    let (numbers, at) = (stream.numbers, stream.skip_bytes.into());
    let channels = stream.channels_in_file.map_or(1, |channels| u64::from(channels.get()));
    Ok(match kind {
        Kind::Npz => {
            let mut archive = ZipArchive::new(file)?;
            Box::new(move |name| npy::member(&mut archive, name, axis, &mut room))
        }
        Kind::Mat if !matlab::is_hdf5(&mut file)? => {
            Box::new(move |name| matlab::array(&mut file, name, axis, &mut room))
        }
        Kind::Mat | Kind::Hdf5 => {
            let file = hdf5::open(file)?;
            Box::new(move |name| hdf5::array(&file, name, axis, kind == Kind::Mat))
        }
        Kind::Tdms => {
            let channels = tdms::open(&file)?;
            Box::new(move |name| tdms::array(&file, &channels, name))
        }
        Kind::Raw | Kind::Npy | Kind::Csv => Box::new(move |name| {
            if !name.is_empty() {
                return Err("channels of one array have numbers".into());
            }
            let source: Box<dyn Source> = match known.clone() {
                Some(known) => Box::new(Hashing::new(file.try_clone()?, known)),
                None => Box::new(file.try_clone()?),
            };
            let Some(numbers) = numbers else { return npy::array(source, axis) };
            let samples = file.metadata()?.len().saturating_sub(at) / (channels * numbers.bytes);
            let is_turned = axis == Axis::ChannelsFirst;
            stored(source, at, numbers, is_turned, vec![samples, channels], Axis::SamplesFirst)
        }),
    })
}
