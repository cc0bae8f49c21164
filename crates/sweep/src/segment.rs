//! Where workers put what came of their runs: each into a file of its own, one result after the
//! other, so that a hundred thousand runs are a handful of files.
//!
//! A segment begins with a line that names its plan. A result follows the other as a *frame*:
//!
//! | bytes | what |
//! |---|---|
//! | 1 | kind: 1 done, 2 failed, 3 its process died |
//! | 8 | the run's number, from 1 |
//! | 4 | length of the content |
//! | 4 | CRC-32 of all the others |
//! | length | done: zstd; else text |
//!
//! all numbers with the least byte first. What follows a frame that is not whole is as if it had not
//! been written.

use std::fs::{self, DirEntry, File};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use asperity_files::{FileError, Held, create_folder};

/// The folder of the segments, in that of the plan.
pub const FOLDER: &str = "segments";

/// Least time from one sync to the next: what a power cut may cost.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

const HEAD: usize = 17;

/// What came of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It is done.
    Done,
    /// It failed, by itself and always.
    Failed,
    /// The process that made it died.
    Died,
}

impl Kind {
    fn of(byte: u8) -> Option<Kind> {
        [Kind::Done, Kind::Failed, Kind::Died].into_iter().find(|kind| kind.byte() == byte)
    }

    fn byte(self) -> u8 {
        match self {
            Kind::Done => 1,
            Kind::Failed => 2,
            Kind::Died => 3,
        }
    }
}

fn first_line(plan: &str) -> String {
    format!("asperity sweep segment 1 {plan}\n")
}

/// A segment that is being written.
#[derive(Debug)]
pub struct Writer {
    held: Held,
    synced: Instant,
}

impl Writer {
    /// A new segment of a plan, which is named by its hash.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn create(folder: &Path, plan: &str) -> Result<Writer, FileError> {
        let folder = folder.join(FOLDER);
        create_folder(&folder)?;
        let process = std::process::id();
        // On other machines processes have the same numbers.
        let host = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
        let host: String = host.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
        for number in 1.. {
            let path = folder.join(format!("{host}-{process}-{number}.seg"));
            if path.exists() {
                continue;
            }
            match Held::create(&path) {
                Ok(held) if held.file().metadata().is_ok_and(|file| file.len() == 0) => {
                    let written = held.file().write_all(first_line(plan).as_bytes());
                    written.map_err(|error| FileError::Io { path, error })?;
                    return Ok(Writer { held, synced: Instant::now() });
                }
                // Another began it just now.
                Ok(_) | Err(FileError::Busy(_)) => {}
                Err(error) => return Err(error),
            }
        }
        unreachable!("numbers do not end")
    }

    /// Adds a result.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn add(&mut self, kind: Kind, run: u64, content: &[u8]) -> io::Result<()> {
        let mut frame = Vec::with_capacity(HEAD + content.len());
        frame.push(kind.byte());
        frame.extend(run.to_le_bytes());
        frame.extend(u32::try_from(content.len()).map_err(io::Error::other)?.to_le_bytes());
        let crc = crc(&frame, content);
        frame.extend(crc.to_le_bytes());
        frame.extend(content);
        self.held.file().write_all(&frame)?;
        if self.synced.elapsed() >= SYNC_INTERVAL {
            self.sync()?;
        }
        Ok(())
    }

    /// Makes sure that all results outlast a power cut.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&mut self) -> io::Result<()> {
        self.synced = Instant::now();
        self.held.file().sync_data()
    }
}

fn crc(head: &[u8], content: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(head);
    hasher.update(content);
    hasher.finalize()
}

/// A result in a segment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// What came of the run.
    pub kind: Kind,
    /// The run's number, from 1.
    pub run: u64,
    /// Where its content begins.
    pub at: u64,
    /// How many bytes it has.
    pub length: u32,
}

/// A segment that is read: its frames, as far as they are whole.
#[derive(Debug)]
pub struct Reader {
    file: BufReader<File>,
    at: u64,
    content: Vec<u8>,
}

impl Reader {
    /// Opens a segment; `None` if it is of another plan, or no segment.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn open(path: &Path, plan: &str) -> io::Result<Option<Reader>> {
        let mut file = BufReader::with_capacity(1 << 16, asperity_files::open(path)?);
        let expected = first_line(plan);
        let mut found = vec![0; expected.len()];
        match file.read_exact(&mut found) {
            Ok(()) if found == expected.as_bytes() => {
                let at = expected.len() as u64;
                Ok(Some(Reader { file, at, content: Vec::new() }))
            }
            Ok(()) => Ok(None),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        }
    }

    /// The next result and its content; `None` at the end, or where a frame is not whole.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn next_frame(&mut self) -> io::Result<Option<(Frame, &[u8])>> {
        let mut head = [0; HEAD];
        if !whole(self.file.read_exact(&mut head))? {
            return Ok(None);
        }
        let number = |from: usize| u32::from_le_bytes(std::array::from_fn(|n| head[from + n]));
        let (length, expected) = (number(9), number(13));
        let run = u64::from_le_bytes(std::array::from_fn(|n| head[1 + n]));
        let Some(kind) = Kind::of(head[0]) else { return Ok(None) };
        self.content.clear();
        let read = (&mut self.file).take(u64::from(length)).read_to_end(&mut self.content)?;
        if read != length as usize || crc(&head[..13], &self.content) != expected {
            return Ok(None);
        }
        let frame = Frame { kind, run, at: self.at + HEAD as u64, length };
        self.at = frame.at + u64::from(length);
        Ok(Some((frame, &self.content)))
    }

    /// The content of a frame found before.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn content(&mut self, at: u64, length: u32) -> io::Result<Vec<u8>> {
        self.file.seek(SeekFrom::Start(at))?;
        let mut content = vec![0; length as usize];
        self.file.read_exact(&mut content)?;
        Ok(content)
    }

    /// How many bytes at its end are of no whole frame.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub fn torn(&self) -> io::Result<u64> {
        Ok(self.file.get_ref().metadata()?.len().saturating_sub(self.at))
    }
}

fn whole(read: io::Result<()>) -> io::Result<bool> {
    match read {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

/// The segments in the folder of a plan, in the order of their names.
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

/// What is in a folder, which need not be there.
pub(crate) fn entries(folder: &Path) -> io::Result<Vec<DirEntry>> {
    match fs::read_dir(folder) {
        Ok(entries) => entries.collect(),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{Kind, Reader, Writer, all};

    #[test]
    fn whatever_is_cut_off_or_changed_costs_what_follows_it_and_nothing_before() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = Writer::create(folder.path(), "plan").unwrap();
        for run in 1..=4 {
            writer.add(Kind::Done, run, format!("result {run}").as_bytes()).unwrap();
        }
        drop(writer);
        let path = all(folder.path()).unwrap().remove(0);
        let whole = fs::read(&path).unwrap();
        let read = || {
            let mut reader = Reader::open(&path, "plan").unwrap()?;
            let mut runs = Vec::new();
            while let Some((frame, content)) = reader.next_frame().unwrap() {
                assert_eq!(content, format!("result {}", frame.run).as_bytes());
                runs.push(frame.run);
            }
            let torn = reader.torn().unwrap();
            Some((runs, torn))
        };
        assert_eq!(read(), Some((vec![1, 2, 3, 4], 0)));
        let (first, frame) = (whole.len() - 4 * 25, 25);
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
