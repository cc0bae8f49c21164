//! The place of a name, and what occupies it.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::FileError;

/// A name in a folder, independent of the links that lead to the folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Place {
    /// The folder, without links.
    pub(crate) folder: PathBuf,
    /// The name in it.
    pub(crate) name: OsString,
}

impl Place {
    /// The place of a path whose folder exists.
    pub(crate) fn of(path: &Path) -> io::Result<Place> {
        let name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::IsADirectory))?;
        Ok(Place { folder: folder_of(path).canonicalize()?, name: name.to_owned() })
    }
}

/// The folder of a path.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Whether a name is taken: by a file, a folder, or a link, even a dangling one.
pub fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// What occupies a name.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum There {
    /// Nothing.
    Nothing,
    /// A file, or a link to a file or to nothing. It may be replaced on request.
    File,
    /// A terminal, a pipe, `/dev/null` and the like: written to in place.
    Device,
}

impl There {
    /// Determines what occupies a name.
    ///
    /// # Errors
    /// If it is a folder, or one of the system's own links.
    pub(crate) fn at(path: &Path) -> Result<There, FileError> {
        let entry = match fs::symlink_metadata(path) {
            Ok(entry) => entry,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(There::Nothing),
            Err(error) => return Err(FileError::io(path)(error)),
        };
        // The target of a link may be missing.
        let end = fs::metadata(path).unwrap_or(entry);
        if end.is_dir() {
            return Err(FileError::NoFile { path: path.to_owned(), what: "a folder" });
        }
        if !end.is_file() && !end.is_symlink() {
            return Ok(There::Device);
        }
        if is_of_the_system(path) {
            let what = "a name of the system's for a file that has another";
            return Err(FileError::NoFile { path: path.to_owned(), what });
        }
        Ok(There::File)
    }
}

/// Whether a name is one that the system assigns to open files, such as `/dev/stdout`, which
/// nothing may replace.
fn is_of_the_system(path: &Path) -> bool {
    let folder = folder_of(path).canonicalize().unwrap_or_default();
    folder == Path::new("/dev") || folder.starts_with("/proc")
}
