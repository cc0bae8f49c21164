//! Segments: each thread appends the results of its runs to a file of its own, so that a hundred thousand
//! runs need only a handful of files.
//!
//! A segment begins with a line of its version and its plan. Each result is a *frame*:
//!
//! | bytes | what |
//! |---|---|
//! | 1 | kind: 1 done, 2 failed |
//! | 8 | the run's number, from 1 |
//! | 4 | length of the content |
//! | 4 | CRC-32 of all the others |
//! | length | a line of JSON with number and id of the run; then, done: zstd, see [`stored`](crate::stored); failed: text |
//!
//! with the least significant byte first. Everything
//! after an incomplete frame is ignored.

use std::fs::{self, DirEntry, File};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use asperity_files::{FileError, LockedFile, create_folder, fill};
use asperity_record::bounds::LONGEST_OWNER_BYTES;
use serde::{Deserialize, Serialize};

use crate::plan::Row;

/// The folder of the segments, within that of the plan.
pub const FOLDER: &str = "segments";

/// Time between syncs: the work that a power failure may lose.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

const HEAD: usize = 17;

/// The version of the format.
const VERSION: u32 = 2;

/// The beginning of a segment, before its version.
const BEGINNING: &str = "asperity sweep segment ";

/// The kind of a result.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The run succeeded.
    Done,
    /// The run failed, and would always fail.
    Failed,
}

impl Kind {
    fn of(byte: u8) -> Option<Kind> {
        [Kind::Done, Kind::Failed].into_iter().find(|kind| kind.byte() == byte)
    }

    fn byte(self) -> u8 {
        match self {
            Kind::Done => 1,
            Kind::Failed => 2,
        }
    }
}

fn first_line(plan: &str) -> String {
    format!("{BEGINNING}{VERSION} {plan}\n")
}

/// The owner of a result, according to its content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Owner {
    /// The run's number in its plan.
    pub run: u64,
    /// Its id.
    pub run_id: String,
}

impl Owner {
    fn of(row: &Row) -> Owner {
        Owner { run: row.run, run_id: row.id.clone().unwrap_or_default() }
    }

    fn line(&self) -> String {
        let mut line = serde_json::to_string(self).expect("a number and a text are JSON");
        line.push('\n');
        line
    }
}

/// The name of this machine in the names of segments.
pub fn this_node() -> String {
    let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    host.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect()
}

/// The node whose process wrote a segment, by the name of the file: `NODE-PROCESS-NUMBER.seg`.
pub fn node_of(path: &Path) -> String {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    name.rsplitn(3, '-').last().unwrap_or_default().to_owned()
}

/// The numbers of this process' segments.
static NUMBERS: AtomicU64 = AtomicU64::new(1);

/// A segment in progress.
#[derive(Debug)]
pub struct Writer {
    locked: LockedFile,
    synced: Instant,
}

impl Writer {
    /// Creates a segment of the plan with that hash.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn create(folder: &Path, plan: &str) -> Result<Writer, FileError> {
        let folder = folder.join(FOLDER);
        create_folder(&folder)?;
        // Process ids repeat on other machines.
        let (node, process) = (this_node(), std::process::id());
        loop {
            // Also where the file system has no locks, no two threads begin the same file.
            let number = NUMBERS.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{node}-{process}-{number}.seg"));
            if path.exists() {
                continue;
            }
            match LockedFile::create(&path) {
                Ok(locked) if locked.file().metadata().is_ok_and(|file| file.len() == 0) => {
                    let written = locked.file().write_all(first_line(plan).as_bytes());
                    written.map_err(|error| FileError::Io { path, error })?;
                    return Ok(Writer { locked, synced: Instant::now() });
                }
                // Another process has just begun it, on another machine of this name.
                Ok(_) | Err(FileError::Busy(_)) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Appends a result.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn add(&mut self, kind: Kind, row: &Row, content: &[u8]) -> io::Result<()> {
        let owner = Owner::of(row).line();
        let length = owner.len() + content.len();
        let mut frame = Vec::with_capacity(HEAD + length);
        frame.push(kind.byte());
        frame.extend(row.run.to_le_bytes());
        frame.extend(u32::try_from(length).map_err(io::Error::other)?.to_le_bytes());
        let mut hasher = crc32fast::Hasher::new();
        [&frame, owner.as_bytes(), content].iter().for_each(|part| hasher.update(part));
        frame.extend(hasher.finalize().to_le_bytes());
        frame.extend(owner.as_bytes());
        frame.extend(content);
        self.locked.file().write_all(&frame)?;
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    /// Syncs all results to disk.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&mut self) -> io::Result<()> {
        self.synced = Instant::now();
        self.locked.sync().map_err(io::Error::other)
    }
}

/// A result in a segment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// The kind of the result.
    pub kind: Kind,
    /// The run's number, from 1.
    pub run: u64,
    /// The owner line, or its error.
    pub owner: Result<Owner, String>,
    /// The offset of the content after that line.
    pub at: u64,
    /// The length of the content.
    pub length: u64,
}

/// Reads a segment: its whole frames, without storing their contents.
#[derive(Debug)]
pub struct Reader {
    file: BufReader<File>,
    at: u64,
}

impl Reader {
    /// Opens a segment; `None` if it is of another plan or not a segment.
    ///
    /// # Errors
    /// If it cannot be read, or is of another version of the format.
    pub fn open(path: &Path, plan: &str) -> io::Result<Option<Reader>> {
        let mut file = BufReader::with_capacity(1 << 16, asperity_files::open(path)?);
        let expected = first_line(plan);
        let mut found = vec![0; expected.len()];
        if !whole(file.read_exact(&mut found))? {
            return Ok(None);
        }
        let text = str::from_utf8(&found).ok().and_then(|text| text.strip_prefix(BEGINNING));
        match text.and_then(|text| text.split_once(' ')?.0.parse::<u32>().ok()) {
            Some(other) if other != VERSION => Err(io::Error::other(format!(
                "written with version {other} of the format; this program reads version {VERSION}"
            ))),
            _ => Ok((expected.as_bytes() == found).then_some(Reader { file, at: found.len() as u64 })),
        }
    }

    /// Returns the next result; `None` at the end or an incomplete frame.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next_frame(&mut self) -> io::Result<Option<Frame>> {
        let mut head = [0; HEAD];
        if !whole(self.file.read_exact(&mut head))? {
            return Ok(None);
        }
        let number = |from: usize| u32::from_le_bytes(std::array::from_fn(|n| head[from + n]));
        let (length, crc) = (u64::from(number(9)), number(13));
        let run = u64::from_le_bytes(std::array::from_fn(|n| head[1 + n]));
        let Some(kind) = Kind::of(head[0]) else { return Ok(None) };
        let mut hasher = crc32fast::Hasher::new();
        hasher.update(&head[..13]);
        let mut content = self.file.by_ref().take(length);
        let mut first = Vec::new();
        content.by_ref().take(LONGEST_OWNER_BYTES as u64).read_until(b'\n', &mut first)?;
        hasher.update(&first);
        let mut read = first.len() as u64;
        loop {
            fill(&mut content)?;
            let piece = content.fill_buf()?;
            if piece.is_empty() {
                break;
            }
            hasher.update(piece);
            let taken = piece.len();
            content.consume(taken);
            read += taken as u64;
        }
        if read != length || hasher.finalize() != crc {
            return Ok(None);
        }
        let begins = self.at + HEAD as u64;
        self.at = begins + length;
        let owner = first.strip_suffix(b"\n").and_then(|line| serde_json::from_slice(line).ok());
        let owner = owner.ok_or_else(|| "its content does not say whose it is".to_owned());
        let of_owner = first.len() as u64;
        Ok(Some(Frame { kind, run, owner, at: begins + of_owner, length: length - of_owner }))
    }

    /// Number of bytes after the last whole frame.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn torn(&self) -> io::Result<u64> {
        Ok(self.file.get_ref().metadata()?.len().saturating_sub(self.at))
    }
}

/// Opens the content of a result at the position in its [`Frame`].
///
/// # Errors
/// If the segment cannot be read.
pub(crate) fn content(path: &Path, at: u64, length: u64) -> io::Result<impl BufRead + use<>> {
    let mut file = asperity_files::open(path)?;
    file.seek(SeekFrom::Start(at))?;
    Ok(BufReader::new(file).take(length))
}

fn whole(read: io::Result<()>) -> io::Result<bool> {
    match read {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// The segments in the folder of a plan, sorted by name.
///
/// # Errors
/// If the folder cannot be read.
pub fn all(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths = Vec::new();
    for entry in entries(&folder.join(FOLDER))? {
        let path = entry.path();
        if path.extension().is_some_and(|extension| extension == "seg") {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}

/// The entries of a folder; none if it does not exist.
pub(crate) fn entries(folder: &Path) -> io::Result<Vec<DirEntry>> {
    match asperity_files::entries(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        entries => entries,
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{Kind, Owner, Reader, Writer, all};
    use crate::plan::Row;

    #[test]
    fn whatever_is_cut_off_or_changed_costs_what_follows_it_and_nothing_before() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = Writer::create(folder.path(), "plan").unwrap();
        let rows = [1, 2, 3, 4].map(|run| {
            let id = Some("id".to_owned());
            Row { run, values: Vec::new(), id, refused: None, warnings: Vec::new(), preview: None }
        });
        for row in &rows {
            writer.add(Kind::Done, row, format!("result {}", row.run).as_bytes()).unwrap();
        }
        drop(writer);
        let path = all(folder.path()).unwrap().remove(0);
        let whole = fs::read(&path).unwrap();
        let read = || {
            let bytes = fs::read(&path).unwrap();
            let mut reader = Reader::open(&path, "plan").unwrap()?;
            let mut runs = Vec::new();
            while let Some(frame) = reader.next_frame().unwrap() {
                let content = &bytes[frame.at as usize..][..frame.length as usize];
                assert_eq!(content, format!("result {}", frame.run).as_bytes());
                assert_eq!(frame.owner, Ok(Owner { run: frame.run, run_id: "id".to_owned() }));
                runs.push(frame.run);
            }
            let torn = reader.torn().unwrap();
            Some((runs, torn))
        };
        assert_eq!(read(), Some((vec![1, 2, 3, 4], 0)));
        let frame = (whole.len() - b"asperity sweep segment 2 plan\n".len()) / 4;
        let first = whole.len() - 4 * frame;
        for cut in 0..whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            let expected = cut
                .checked_sub(first)
                .map(|behind| ((1..=(behind / frame) as u64).collect::<Vec<_>>(), (behind % frame) as u64));
            assert_eq!(read(), expected, "{cut}");
        }
        for at in first..whole.len() {
            let mut changed = whole.clone();
            changed[at] ^= 0x40;
            fs::write(&path, &changed).unwrap();
            let (runs, torn) = read().unwrap();
            let before = (at - first) / frame;
            assert_eq!((runs.len(), torn as usize), (before, (4 - before) * frame), "{at}");
        }
        assert!(Reader::open(&path, "other plan").unwrap().is_none());
    }
}
