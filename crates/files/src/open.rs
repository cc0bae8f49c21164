//! Opens the inputs of commands: a path given by a user may lead to anything.
//!
//! Opening a named pipe waits for a writer, reading a terminal waits for input, and a device may
//! act when opened. The path is therefore examined before it is opened and again once it is open,
//! since another process may have replaced the file; the open in between does not block.

use std::fs::{self, DirEntry, File, FileType};
use std::io::{self, Read};
use std::path::Path;

use crate::error::FileError;

/// The target of a path that is no file, by its name in messages: a folder, a pipe, a socket, or a device, such as a
/// terminal, a disk or `/dev/null`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("it is {0}, not a file")]
pub struct NoFile(pub &'static str);

impl NoFile {
    /// The reason in an error of this module, if it is one of these.
    pub fn of(error: &io::Error) -> Option<NoFile> {
        error.get_ref()?.downcast_ref().copied()
    }

    fn unless_file(kind: FileType) -> io::Result<()> {
        if kind.is_file() {
            return Ok(());
        }
        #[cfg(unix)]
        use std::os::unix::fs::FileTypeExt;
        let what = match kind {
            kind if kind.is_dir() => {
                return Err(io::Error::new(io::ErrorKind::IsADirectory, NoFile("a folder")));
            }
            #[cfg(unix)]
            kind if kind.is_fifo() => "a pipe",
            #[cfg(unix)]
            kind if kind.is_socket() => "a socket",
            _ => "a device",
        };
        Err(io::Error::new(io::ErrorKind::InvalidInput, NoFile(what)))
    }
}

/// Opens a file for reading.
///
/// # Errors
/// If the path leads to something else, see [`NoFile`], or the system refuses.
pub fn open(path: &Path) -> io::Result<File> {
    NoFile::unless_file(fs::metadata(path)?.file_type())?;
    let file = open_at_once(path)?;
    NoFile::unless_file(file.metadata()?.file_type())?;
    Ok(file)
}

/// Reads all bytes of a file.
///
/// # Errors
/// As [`open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Reads all bytes of a file if there is one: None if nothing has the name, or something else than a file.
///
/// # Errors
/// If the system refuses.
pub fn read_if_there(path: &Path) -> Result<Option<Vec<u8>>, FileError> {
    let is_none = |error: &io::Error| {
        let nothing = [io::ErrorKind::NotFound, io::ErrorKind::NotADirectory];
        nothing.contains(&error.kind()) || NoFile::of(error).is_some()
    };
    match read(path) {
        Err(error) if is_none(&error) => Ok(None),
        Err(error) => Err(FileError::Read { path: path.to_owned(), error }),
        Ok(bytes) => Ok(Some(bytes)),
    }
}

/// The entries of a folder, read again if a signal interrupts it.
///
/// # Errors
/// If it is no folder, or the system refuses.
pub fn entries(folder: &Path) -> io::Result<Vec<DirEntry>> {
    loop {
        match fs::read_dir(folder).and_then(Iterator::collect) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            entries => return entries,
        }
    }
}

/// Opens a text that is read once, front to back: a file, or a stream that was already open when
/// this process started and is named by its number, as a shell does for `<(COMMAND)`.
///
/// # Errors
/// If the path leads to something else, see [`NoFile`], or the system refuses.
pub fn open_text(path: &Path) -> io::Result<Box<dyn Read>> {
    match stream(path) {
        // Reopening a named pipe would block.
        Some(0) => Ok(Box::new(io::stdin().lock())),
        Some(_) => Ok(Box::new(File::open(path)?)),
        None => Ok(Box::new(open(path)?)),
    }
}

/// The number of a stream that was open when this process started, if a path names one.
fn stream(path: &Path) -> Option<u32> {
    if path == Path::new("/dev/stdin") {
        return Some(0);
    }
    let is_ours = ["/dev/fd", "/proc/self/fd"].iter().any(|own| path.parent() == Some(Path::new(own)));
    path.file_name()?.to_str()?.parse().ok().filter(|_| is_ours)
}

fn open_at_once(path: &Path) -> io::Result<File> {
    let mut options = File::options();
    // These flags have no effect on files.
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK | libc::O_NOCTTY);
    options.read(true).open(path)
}

#[cfg(unix)]
#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Read;
    use std::os::unix::fs::symlink;
    use std::os::unix::net::UnixListener;
    use std::path::Path;
    use std::process::Command;

    use super::{NoFile, open, open_at_once, open_text, read};

    /// Each `open` returns without blocking.
    #[test]
    fn what_is_no_file_is_refused_at_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert!(Command::new("mkfifo").arg(path("pipe")).status().unwrap().success());
        let _listener = UnixListener::bind(path("socket")).unwrap();
        symlink(path("pipe"), path("link")).unwrap();
        for (name, expected) in [
            (path("pipe"), NoFile("a pipe")),
            (path("link"), NoFile("a pipe")),
            (path("socket"), NoFile("a socket")),
            (folder.path().to_owned(), NoFile("a folder")),
            ("/dev/null".into(), NoFile("a device")),
        ] {
            for error in [open(&name).unwrap_err(), open_text(&name).err().unwrap()] {
                assert_eq!(NoFile::of(&error), Some(expected), "{error}");
            }
        }
        // A pipe that replaces a file after the first examination.
        assert!(!open_at_once(&path("pipe")).unwrap().metadata().unwrap().is_file());
        assert_eq!(open(&path("none")).unwrap_err().kind(), std::io::ErrorKind::NotFound);
    }

    #[test]
    fn files_are_read_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("file"), "text").unwrap();
        symlink("file", path("link")).unwrap();
        for name in ["file", "link"] {
            assert_eq!(read(&path(name)).unwrap(), b"text");
            let mut text = String::new();
            open_text(&path(name)).unwrap().read_to_string(&mut text).unwrap();
            assert_eq!(text, "text");
        }
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn streams_are_texts_and_nothing_else() {
        use std::os::fd::AsRawFd;
        let (mut ends, mut write) = std::io::pipe().unwrap();
        std::io::Write::write_all(&mut write, b"blocks = 3").unwrap();
        drop(write);
        let name = format!("/dev/fd/{}", ends.as_raw_fd());
        assert_eq!(NoFile::of(&open(Path::new(&name)).unwrap_err()), Some(NoFile("a pipe")));
        let mut text = String::new();
        open_text(Path::new(&name)).unwrap().read_to_string(&mut text).unwrap();
        assert_eq!(text, "blocks = 3");
        assert_eq!(ends.read(&mut [0]).unwrap(), 0);
    }
}
