//! Reasons why a file is not written.

use std::io;
use std::path::{Path, PathBuf};

/// Why a file is not written, or not renamed to its final name.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The name is in use, and existing files must not be replaced.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
    /// It would overwrite an input of the same command.
    #[error("{} would be written over {}, which this command reads", path.display(), input.display())]
    Input {
        /// The output.
        path: PathBuf,
        /// The input that would be overwritten, or whose unfinished log would be.
        input: PathBuf,
    },
    /// Two outputs of one command have the same name.
    #[error("{} and {} are the same file, and both would be written", first.display(), second.display())]
    Twice {
        /// The first of them.
        first: PathBuf,
        /// The second.
        second: PathBuf,
    },
    /// The name belongs to something that no file may replace.
    #[error("{} is {what}", path.display())]
    NoFile {
        /// The name.
        path: PathBuf,
        /// Its kind.
        what: &'static str,
    },
    /// Another process is writing it.
    #[error("{} is being written by another process", .0.display())]
    Busy(PathBuf),
    /// It was removed or replaced by another process while it was written.
    #[error("{} was removed or replaced while it was being written", .0.display())]
    Lost(PathBuf),
    /// A file that belongs to an output could not be read.
    #[error("failed to read {}: {error}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
    /// The system call failed, on a file or a folder.
    #[error("failed to write {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The reason.
        error: io::Error,
    },
}

impl FileError {
    /// Wraps an I/O error with its path.
    pub fn io(path: &Path) -> impl Fn(io::Error) -> FileError {
        let path = path.to_owned();
        move |error| match error.kind() {
            io::ErrorKind::NotADirectory => {
                FileError::NoFile { path: path.clone(), what: "in a folder that is a file" }
            }
            _ => FileError::Io { path: path.clone(), error },
        }
    }

    /// Whether only the name was refused: nothing was written, and another name would work.
    pub fn is_of_name(&self) -> bool {
        use FileError::{Exists, Input, NoFile, Twice};
        matches!(self, Exists(_) | Input { .. } | Twice { .. } | NoFile { .. })
    }
}
