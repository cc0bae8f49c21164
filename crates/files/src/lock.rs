//! Locks, which keep processes apart and end with them.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

/// What came of asking for a lock.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Lock {
    /// It is ours for as long as the file is open.
    Taken,
    /// Another process, or another part of this one, has it.
    Busy,
    /// Some network file systems have no locks; there nobody keeps two processes apart.
    Unknown,
}

/// Asks for the lock of an open file or folder.
pub(crate) fn try_lock(file: &File) -> Lock {
    match file.try_lock() {
        Ok(()) => Lock::Taken,
        Err(TryLockError::WouldBlock) => Lock::Busy,
        Err(TryLockError::Error(_)) => Lock::Unknown,
    }
}

/// Opens a folder for the sake of its lock. None where folders cannot be opened, or not this one by
/// this user.
pub(crate) fn open_folder(folder: &Path) -> io::Result<Option<File>> {
    match File::open(folder) {
        Ok(folder) => Ok(Some(folder)),
        Err(error) if cfg!(not(unix)) || error.kind() == io::ErrorKind::PermissionDenied => Ok(None),
        Err(error) => Err(error),
    }
}

/// Waits for the lock of a folder, which is held while names in it are checked and given: for
/// milliseconds. None where there are no such locks.
pub(crate) fn wait_for_folder(folder: &Path) -> io::Result<Option<File>> {
    let Some(folder) = open_folder(folder)? else { return Ok(None) };
    loop {
        match folder.lock() {
            Ok(()) => return Ok(Some(folder)),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return Ok(None),
        }
    }
}
