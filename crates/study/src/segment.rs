//! Segments: each thread appends the results of its runs to a file of its own, so that a hundred thousand
//! runs need only a handful of files.
//!
//! A segment begins with a line of its version and its plan. Each result is a *frame*:
//!
//! | bytes | what |
//! |---|---|
//! | 4 | CRC-32 of all the others |
//! | 1 | whether the run is done: 1, or 0 if it failed |
//! | 8 | the run's number, from 1 |
//! | 4 | length of the content |
//! | length | a [`RunResult`] as JSON, compressed by zstd |
//!
//! with the least significant byte first. Everything after an incomplete or changed frame is ignored.

use std::cell::RefCell;
use std::ffi::OsStr;
use std::fs::{self, DirEntry};
use std::io::{self, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use asperity_files::{FileError, LockedFile, create_folder};
use asperity_numbers::RunResult;
use asperity_record::bounds::LONGEST_RESULT_BYTES;
use zstd::bulk::{Compressor, decompress};
use zstd::zstd_safe::get_frame_content_size;

/// The folder of the segments, within that of the plan.
pub const FOLDER: &str = "segments";

/// Time between syncs: the work that a power failure may lose.
const SYNC_INTERVAL: Duration = Duration::from_secs(1);

const HEAD: usize = 17;

/// The version of the format.
const VERSION: u32 = 3;

/// The beginning of a segment, before its version.
const BEGINNING: &str = "asperity sweep segment ";

/// The level of compression: higher ones need more time than a short run.
const LEVEL: i32 = 1;

fn first_line(plan: &str) -> String {
    format!("{BEGINNING}{VERSION} {plan}\n")
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

    /// Appends a result, as [`packed`].
    ///
    /// # Errors
    /// If the system refuses.
    pub fn add(&mut self, run: u64, is_done: bool, packed: &[u8]) -> io::Result<()> {
        let length = u32::try_from(packed.len()).map_err(io::Error::other)?;
        let rest = [&[u8::from(is_done)], &run.to_le_bytes()[..], &length.to_le_bytes(), packed].concat();
        let frame = [&crc32fast::hash(&rest).to_le_bytes(), &rest[..]].concat();
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

/// Packs a result.
///
/// # Errors
/// If it is too long, or has a number that JSON cannot hold.
pub fn packed(result: &RunResult) -> io::Result<Vec<u8>> {
    thread_local! {
        /// Building its tables costs more time than compressing a short result.
        static PACKER: RefCell<Option<Compressor<'static>>> = const { RefCell::new(None) };
    }
    let line = result.to_json()?;
    if line.len() > LONGEST_RESULT_BYTES {
        let problem = format!("a result of {} bytes (accepted: up to {LONGEST_RESULT_BYTES})", line.len());
        return Err(io::Error::other(problem));
    }
    PACKER.with_borrow_mut(|packer| match packer {
        Some(packer) => packer.compress(&line),
        none => {
            let packer = none.insert(Compressor::new(LEVEL)?);
            // Sees a bit that changed before the frame had its own.
            packer.include_checksum(true)?;
            packer.compress(&line)
        }
    })
}

/// Unpacks a result.
///
/// # Errors
/// If it is none.
pub fn unpacked(packed: &[u8]) -> io::Result<RunResult> {
    let refused = |problem: String| io::Error::new(io::ErrorKind::InvalidData, problem);
    // A few bytes may stand for gigabytes.
    let length = get_frame_content_size(packed).ok().flatten().unwrap_or(u64::MAX);
    if length > LONGEST_RESULT_BYTES as u64 {
        let accepted = format!("accepted: up to {LONGEST_RESULT_BYTES}");
        return Err(refused(format!("a result of {length} bytes or more ({accepted})")));
    }
    let line = decompress(packed, length as usize);
    let line = line.map_err(|error| refused(format!("{error} (accepted: a zstd frame)")))?;
    serde_json::from_slice(&line)
        .map_err(|error| refused(format!("{error} (accepted: a result by this program)")))
}

/// A result in a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// Whether the run is done; it failed otherwise.
    pub is_done: bool,
    /// The run's number, from 1.
    pub run: u64,
    /// The offset of the content.
    pub at: u64,
    /// The length of the content.
    pub length: u32,
}

/// Reads the frames of a segment, up to the first one that is incomplete or changed, or that is not taken. Returns the
/// number of bytes from there on; `None` if the file is of another plan or not a segment.
///
/// # Errors
/// If it cannot be read, or is of another version of the format.
pub fn scan(path: &Path, plan: &str, mut take: impl FnMut(Frame) -> bool) -> io::Result<Option<u64>> {
    let mut file = BufReader::with_capacity(1 << 16, asperity_files::open(path)?);
    let expected = first_line(plan);
    let mut found = Vec::new();
    file.by_ref().take(expected.len() as u64).read_to_end(&mut found)?;
    let text = str::from_utf8(&found).ok().and_then(|text| text.strip_prefix(BEGINNING));
    match text.and_then(|text| text.split_once(' ')?.0.parse::<u32>().ok()) {
        Some(other) if other != VERSION => {
            return Err(io::Error::other(format!(
                "written with version {other} of the format; this program reads version {VERSION}"
            )));
        }
        _ if expected.as_bytes() != found => return Ok(None),
        _ => {}
    }
    let mut end = found.len() as u64;
    let mut frame = Vec::new();
    loop {
        frame.clear();
        file.by_ref().take(HEAD as u64).read_to_end(&mut frame)?;
        let Ok(head) = <[u8; HEAD]>::try_from(&frame[..]) else { break };
        let number = |at: usize| u32::from_le_bytes(std::array::from_fn(|n| head[at + n]));
        let length = number(13);
        if length as usize > LONGEST_RESULT_BYTES {
            break;
        }
        file.by_ref().take(length.into()).read_to_end(&mut frame)?;
        let run = u64::from_le_bytes(std::array::from_fn(|n| head[5 + n]));
        let is_whole = frame.len() == HEAD + length as usize && crc32fast::hash(&frame[4..]) == number(0);
        if !is_whole || !take(Frame { is_done: head[4] == 1, run, at: end + HEAD as u64, length }) {
            break;
        }
        end += frame.len() as u64;
    }
    Ok(Some(file.get_ref().metadata()?.len().saturating_sub(end)))
}

/// The packed result at the position in its [`Frame`].
///
/// # Errors
/// If the segment cannot be read.
pub(crate) fn content(path: &Path, Frame { at, length, .. }: Frame) -> io::Result<Vec<u8>> {
    let mut file = asperity_files::open(path)?;
    file.seek(SeekFrom::Start(at))?;
    let mut content = vec![0; length as usize];
    file.read_exact(&mut content)?;
    Ok(content)
}

/// The segments in the folder of a plan, sorted by name.
///
/// # Errors
/// If the folder cannot be read.
pub fn all(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = entries(&folder.join(FOLDER))?.iter().map(DirEntry::path).collect();
    paths.retain(|path| path.extension() == Some(OsStr::new("seg")));
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

    use super::{Writer, all, content, first_line, scan};

    #[test]
    fn whatever_is_cut_off_or_changed_costs_what_follows_it_and_nothing_before() {
        let folder = tempfile::tempdir().unwrap();
        let mut writer = Writer::create(folder.path(), "plan").unwrap();
        (1..=4).for_each(|run| writer.add(run, true, format!("result {run}").as_bytes()).unwrap());
        drop(writer);
        let path = all(folder.path()).unwrap().remove(0);
        let whole = fs::read(&path).unwrap();
        let read = || {
            let mut runs = Vec::new();
            let torn = scan(&path, "plan", |frame| {
                let content = content(&path, frame).unwrap();
                assert_eq!(content, format!("result {}", frame.run).as_bytes());
                runs.push(frame.run);
                frame.is_done
            });
            Some((runs, torn.unwrap()?))
        };
        assert_eq!(read(), Some((vec![1, 2, 3, 4], 0)));
        let first = first_line("plan").len();
        let frame = (whole.len() - first) / 4;
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
        assert_eq!(scan(&path, "other plan", |_| true).unwrap(), None);
    }
}
