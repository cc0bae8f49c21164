//! Locks, which exclude other processes and end with the process.

use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;

use crate::open::open;

/// An open file or folder that is unlocked when it is dropped. Closing it would not do: a process that was
/// forked meanwhile has it open as well, and with it the lock.
#[derive(Debug)]
pub(crate) struct Held(pub(crate) File);

impl Drop for Held {
    fn drop(&mut self) {
        // It is closed in any case.
        self.0.unlock().ok();
    }
}

/// Whether a request for a lock was refused because another process, or another part of this one, has it. A file system
/// without locks, as some of networks are, excludes nobody.
pub(crate) fn is_locked(asked: Result<(), TryLockError>) -> bool {
    matches!(asked, Err(TryLockError::WouldBlock))
}

/// Whether another process, or another part of this one, has a file locked, as one who writes a [`LockedFile`] does.
///
/// [`LockedFile`]: crate::LockedFile
pub fn is_being_written(path: &Path) -> bool {
    open(path).is_ok_and(|file| is_locked(Held(file).0.try_lock_shared()))
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
        match folder.0.lock() {
            Ok(()) => return Ok(Some(folder)),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => return Ok(None),
        }
    }
}
