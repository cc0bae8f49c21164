//! Where a name stands, and what has it already.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::FileError;

/// A name in a folder, the same by whatever links the folder is reached.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Place {
    /// The folder, without links.
    pub(crate) folder: PathBuf,
    /// The name in it.
    pub(crate) name: OsString,
}

impl Place {
    /// The place of a path whose folder is there.
    pub(crate) fn of(path: &Path) -> io::Result<Place> {
        let name = path.file_name().ok_or_else(|| io::Error::from(io::ErrorKind::IsADirectory))?;
        Ok(Place { folder: folder_of(path).canonicalize()?, name: name.to_owned() })
    }

    pub(crate) fn path(&self) -> PathBuf {
        self.folder.join(&self.name)
    }
}

/// The folder that a path stands in.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Whether anything has a name: a file, a folder, or a link, even one that leads nowhere.
pub fn is_taken(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// What has a name.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum There {
    /// Nothing.
    Nothing,
    /// A file, or a link to one or to nothing. It may be replaced, if that is asked for.
    File,
    /// What is no file, as a terminal, a pipe or `/dev/null`: it is written to as it stands.
    Device,
}

impl There {
    /// Finds out what has a name.
    ///
    /// # Errors
    /// If it is a folder, or one of the system's own links.
    pub(crate) fn at(path: &Path) -> Result<There, FileError> {
        let entry = match fs::symlink_metadata(path) {
            Ok(entry) => entry,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(There::Nothing),
            Err(error) => return Err(FileError::io(path)(error)),
        };
        // What a link leads to: nothing, perhaps.
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

/// Whether a name is one of those that the system gives open files, such as `/dev/stdout`:
/// nothing may take its place.
fn is_of_the_system(path: &Path) -> bool {
    let folder = folder_of(path).canonicalize().unwrap_or_default();
    folder == Path::new("/dev") || folder.starts_with("/proc")
}

/// A name with something behind it.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name: OsString = path.file_name().map(OsStr::to_owned).unwrap_or_default();
    name.push(suffix);
    path.with_file_name(name)
}
