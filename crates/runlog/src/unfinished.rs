//! Logs that are being written: they stand under a temporary name, locked, until they are whole.

use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use crate::problem::WriteError;
use crate::whole::{partial_path, sync_folder, with_suffix};

/// What to do with a log that stands where one is to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Keep it, and write nothing.
    Refuse,
    /// Replace it by the new one, once that is whole.
    Replace,
}

/// Where a run that goes on is written until it holds what the log of the unfinished one
/// holds.
pub(crate) fn resumed_path(path: &Path) -> PathBuf {
    with_suffix(path, ".resumed")
}

/// An unfinished log that no other process writes, for as long as this lives.
#[derive(Debug)]
pub struct Unfinished {
    path: PathBuf,
    file: File,
}

impl Unfinished {
    /// Takes hold of what stands for `path` until that is whole, if there is any of it.
    ///
    /// # Errors
    /// If another process writes it, or the system refuses.
    pub fn of(path: &Path) -> Result<Option<Unfinished>, WriteError> {
        let partial = partial_path(path);
        match File::options().read(true).write(true).open(&partial) {
            Ok(file) => Ok(Some(Unfinished { file: locked(file, &partial)?, path: path.to_owned() })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(WriteError::Io { path: partial, error }),
        }
    }

    /// The name that it is to have.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Where it is.
    pub fn partial_path(&self) -> PathBuf {
        partial_path(&self.path)
    }

    /// Gives it its final name, which only a whole one may have.
    ///
    /// # Errors
    /// If a log stands there that is not to be replaced, or the system refuses.
    pub fn publish(self, existing: Existing) -> Result<(), WriteError> {
        let Unfinished { path, file } = self;
        if existing == Existing::Refuse && path.exists() {
            return Err(WriteError::Exists(path));
        }
        let partial = partial_path(&path);
        let outcome =
            file.sync_all().and_then(|()| fs::rename(&partial, &path)).and_then(|()| sync_folder(&path));
        outcome.map_err(|error| WriteError::Io { path: partial, error })
    }
}

/// Locks a file that stands at `path`, until it is closed.
pub(crate) fn locked(file: File, path: &Path) -> Result<File, WriteError> {
    let io_error = |error| WriteError::Io { path: path.to_owned(), error };
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => return Err(WriteError::Busy(path.to_owned())),
        // Some network file systems have no locks; there nobody keeps two processes apart.
        Err(TryLockError::Error(error)) if error.kind() != io::ErrorKind::Unsupported => {
            return Err(io_error(error));
        }
        _ => {}
    }
    // Whoever held the lock until now may have given the file another name.
    let ours = same_file::Handle::from_file(file.try_clone().map_err(io_error)?).map_err(io_error)?;
    match same_file::Handle::from_path(path) {
        Ok(here) if here == ours => Ok(file),
        // There is no saying whose it is, as when too many files are open.
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(io_error(error)),
        _ => Err(WriteError::Busy(path.to_owned())),
    }
}
