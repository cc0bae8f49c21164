//! Why a file is not written.

use std::io;
use std::path::{Path, PathBuf};

/// A file that is not written, or does not get its name.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// Something has the name, and is not to be replaced.
    #[error("{} exists already", .0.display())]
    Exists(PathBuf),
    /// It would be written over what the same command reads.
    #[error("{} would be written over {}, which this command reads", path.display(), input.display())]
    Input {
        /// The file that was to be written.
        path: PathBuf,
        /// The input that it is, or that it stands in the way of.
        input: PathBuf,
    },
    /// Two files of one command would have the same name.
    #[error("{} and {} are the same file, and both would be written", first.display(), second.display())]
    Twice {
        /// The first of them.
        first: PathBuf,
        /// The second.
        second: PathBuf,
    },
    /// What has the name is nothing that a file may take the place of.
    #[error("{} is {what}", path.display())]
    NoFile {
        /// The name.
        path: PathBuf,
        /// What stands there.
        what: &'static str,
    },
    /// Another process writes it.
    #[error("{} is being written by another process", .0.display())]
    Busy(PathBuf),
    /// Somebody removed it, or put another file in its place, while it was written.
    #[error("{} was removed or replaced while it was being written", .0.display())]
    Lost(PathBuf),
    /// A folder could not be made.
    #[error("failed to create {}: {error}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The system refused.
    #[error("failed to write {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
}

impl FileError {
    /// Makes one of what the system says of a path.
    pub(crate) fn io(path: &Path) -> impl Fn(io::Error) -> FileError {
        let path = path.to_owned();
        move |error| FileError::Io { path: path.clone(), error }
    }

    /// Whether another name would be accepted in the place of this one: nothing went wrong, and
    /// nothing was written.
    pub fn is_of_name(&self) -> bool {
        matches!(
            self,
            FileError::Exists(_)
                | FileError::Input { .. }
                | FileError::Twice { .. }
                | FileError::NoFile { .. }
        )
    }
}
