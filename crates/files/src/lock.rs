//! Locks, which exclude other processes and end with the process.

use std::fs::{File, TryLockError};
use std::io;
use std::ops::Deref;
use std::path::Path;

/// An open file or folder that is unlocked when it is dropped. Closing it would not do: a process that was
/// forked meanwhile has it open as well, and with it the lock.
#[derive(Debug)]
pub(crate) struct Held(pub(crate) File);

impl Deref for Held {
    type Target = File;

    fn deref(&self) -> &File {
        &self.0
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        // It is closed in any case.
        self.0.unlock().ok();
    }
}

/// The outcome of a request for a lock.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Lock {
    /// Acquired, until [`Held`] drops the file.
    Taken,
    /// Another process, or another part of this one, has the lock.
    Busy,
    /// The file system has no locks, as some network file systems: processes are not excluded.
    Unknown,
}

/// Tries to lock an open file or folder, without waiting.
pub(crate) fn try_lock(file: &File) -> Lock {
    match file.try_lock() {
        Ok(()) => Lock::Taken,
        Err(TryLockError::WouldBlock) => Lock::Busy,
        Err(TryLockError::Error(_)) => Lock::Unknown,
    }
}

/// Opens a folder to lock it. None where folders cannot be opened, or not by this user.
pub(crate) fn open_folder(folder: &Path) -> io::Result<Option<Held>> {
    match File::open(folder) {
        Ok(folder) => Ok(Some(Held(folder))),
        Err(error) if cfg!(not(unix)) || error.kind() == io::ErrorKind::PermissionDenied => Ok(None),
        Err(error) => Err(error),
    }
}

/// Waits for the lock of a folder, which is kept for milliseconds while names in it are checked and
/// assigned. None where there are no such locks.
pub(crate) fn wait_for_folder(folder: &Path) -> io::Result<Option<Held>> {
    let Some(folder) = open_folder(folder)? else { return Ok(None) };
    loop {
        match folder.lock() {
            Ok(()) => return Ok(Some(folder)),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return Ok(None),
        }
    }
}
