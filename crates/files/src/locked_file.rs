//! Files that other processes can find by name while one process at a time writes them.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use crate::error::FileError;
use crate::identity::Identity;
use crate::lock::{Held, is_locked};
use crate::place::is_taken;
use crate::rename::{Existing, rename, sync_folder_of};

/// A file with a name of its own, locked against other processes while this value lives. Its
/// contents are up to the owner; dropping it removes nothing.
#[derive(Debug)]
pub struct LockedFile {
    path: PathBuf,
    file: Held,
    identity: Identity,
    /// Whether its name is known to survive a power cut.
    is_name_synced: bool,
}

impl LockedFile {
    /// Opens and locks the file of that name, if it exists.
    ///
    /// # Errors
    /// If another process has locked it, it is a link or not a file, or the system refuses.
    pub fn open(path: &Path) -> Result<Option<LockedFile>, FileError> {
        let no_file = |what| FileError::NoFile { path: path.to_owned(), what };
        match fs::symlink_metadata(path) {
            Ok(there) if there.is_symlink() => return Err(no_file("a link")),
            Ok(there) if !there.is_file() => return Err(no_file("no file")),
            _ => {}
        }
        match File::options().read(true).write(true).open(path) {
            Ok(file) => LockedFile::lock(path, file).map(Some),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(FileError::io(path)(error)),
        }
    }

    /// Opens and locks the file of that name, and creates it if it does not exist. Keeps its
    /// contents.
    ///
    /// # Errors
    /// As [`LockedFile::open`].
    pub fn create(path: &Path) -> Result<LockedFile, FileError> {
        loop {
            match File::options().read(true).write(true).create_new(true).open(path) {
                Ok(file) => return LockedFile::lock(path, file),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(FileError::io(path)(error)),
            }
            // It may have been removed in the meantime.
            if let Some(locked) = LockedFile::open(path)? {
                return Ok(locked);
            }
        }
    }

    fn lock(path: &Path, file: File) -> Result<LockedFile, FileError> {
        let identity = Identity::of_file(&file).map_err(FileError::io(path))?;
        let locked = LockedFile { path: path.to_owned(), file: Held(file), identity, is_name_synced: false };
        if is_locked(locked.file.0.try_lock()) {
            return Err(FileError::Busy(locked.path));
        }
        // The previous owner of the lock may have renamed the file.
        match locked.check() {
            Err(FileError::Lost(path)) => Err(FileError::Busy(path)),
            checked => checked.map(|()| locked),
        }
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The open file.
    pub fn file(&self) -> &File {
        &self.file.0
    }

    /// Syncs the contents to disk, and the name with the first call, so that both survive a power cut.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn sync(&mut self) -> Result<(), FileError> {
        self.file.0.sync_data().map_err(FileError::io(&self.path))?;
        if !self.is_name_synced {
            sync_folder_of(&self.path)?;
            self.is_name_synced = true;
        }
        Ok(())
    }

    /// Checks that the name still belongs to this file.
    ///
    /// # Errors
    /// If the file was removed or replaced, or the system refuses.
    pub fn check(&self) -> Result<(), FileError> {
        match Identity::of_entry(&self.path) {
            Ok(there) if there == self.identity => Ok(()),
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(FileError::io(&self.path)(error)),
            _ => Err(FileError::Lost(self.path.clone())),
        }
    }

    /// Renames the file and keeps it locked.
    ///
    /// # Errors
    /// If its own name no longer belongs to it, the new one is taken, or the system refuses.
    pub fn rename(&mut self, to: &Path, existing: Existing) -> Result<(), FileError> {
        self.check()?;
        rename(&self.path, to, existing)?;
        self.path = to.to_owned();
        sync_folder_of(to)?;
        self.is_name_synced = true;
        Ok(())
    }

    /// Removes the file.
    ///
    /// # Errors
    /// If its name no longer belongs to it, or the system refuses.
    pub fn remove(&self) -> Result<(), FileError> {
        self.check()?;
        fs::remove_file(&self.path).map_err(FileError::io(&self.path))
    }
}

/// The name of the file that locks a folder.
const LOCK: &str = ".asperity.lock";

/// A folder that one process at a time writes into, while this value lives.
#[derive(Debug)]
pub struct FolderLock(LockedFile);

impl FolderLock {
    /// Locks an existing folder.
    ///
    /// # Errors
    /// If another process has locked it, or the system refuses.
    pub fn take(folder: &Path) -> Result<FolderLock, FileError> {
        let path = folder.join(LOCK);
        loop {
            match LockedFile::create(&path) {
                Ok(locked) => return Ok(FolderLock(locked)),
                // The other process removed its lock file after the attempt.
                Err(FileError::Busy(_)) if !is_taken(&path) => {}
                Err(FileError::Busy(_)) => return Err(FileError::Busy(folder.to_owned())),
                Err(error) => return Err(error),
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // A file with contents is not a lock file of ours; a leftover one does no harm.
        if self.0.file.0.metadata().is_ok_and(|file| file.len() == 0) {
            self.0.remove().ok();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{FolderLock, LockedFile};
    use crate::{Existing, FileError, is_being_written};

    #[test]
    fn one_at_a_time_holds_a_file() {
        let folder = tempfile::tempdir().unwrap();
        let [path, name] = ["run.partial", "run"].map(|name| folder.path().join(name));
        assert!(LockedFile::open(&path).unwrap().is_none());
        let mut locked = LockedFile::create(&path).unwrap();
        assert!(matches!(LockedFile::create(&path), Err(FileError::Busy(busy)) if busy == path));
        assert!(is_being_written(&path) && !is_being_written(&name));
        locked.rename(&name, Existing::Refuse).unwrap();
        assert!(matches!(LockedFile::open(&name), Err(FileError::Busy(_))));
        // As a forked process has it.
        let _open_still = locked.file().try_clone().unwrap();
        drop(locked);
        assert!(!is_being_written(&name) && LockedFile::open(&name).unwrap().is_some());
    }

    #[test]
    fn what_took_its_place_is_neither_renamed_nor_removed() {
        let folder = tempfile::tempdir().unwrap();
        let [path, name] = ["run.partial", "run"].map(|name| folder.path().join(name));
        let mut locked = LockedFile::create(&path).unwrap();
        fs::remove_file(&path).unwrap();
        assert!(matches!(locked.rename(&name, Existing::Replace), Err(FileError::Lost(_))));
        fs::write(&path, "another's").unwrap();
        assert!(matches!(locked.rename(&name, Existing::Replace), Err(FileError::Lost(_))));
        assert!(matches!(locked.remove(), Err(FileError::Lost(_))));
        assert_eq!(fs::read_to_string(&path).unwrap(), "another's");
        assert!(!name.exists());
    }

    #[test]
    fn a_name_that_is_taken_stays_with_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let [path, name] = ["run.partial", "run"].map(|name| folder.path().join(name));
        fs::write(&name, "old").unwrap();
        let mut locked = LockedFile::create(&path).unwrap();
        assert!(matches!(locked.rename(&name, Existing::Refuse), Err(FileError::Exists(_))));
        assert!(path.exists() && fs::read_to_string(&name).unwrap() == "old");
        locked.rename(&name, Existing::Replace).unwrap();
        assert!(!path.exists() && fs::read_to_string(&name).unwrap().is_empty());
    }

    #[test]
    #[cfg(unix)]
    fn a_link_is_not_held() {
        let folder = tempfile::tempdir().unwrap();
        let [file, link, dangling] = ["file", "link", "dangling"].map(|name| folder.path().join(name));
        fs::write(&file, "mine").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        std::os::unix::fs::symlink(folder.path().join("nowhere"), &dangling).unwrap();
        for link in [&link, &dangling] {
            assert!(matches!(LockedFile::create(link), Err(FileError::NoFile { what: "a link", .. })));
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
        assert!(!folder.path().join("nowhere").exists());
    }

    #[test]
    fn a_folder_is_locked_once_and_left_clean() {
        let folder = tempfile::tempdir().unwrap();
        let lock = FolderLock::take(folder.path()).unwrap();
        assert!(
            matches!(FolderLock::take(folder.path()), Err(FileError::Busy(busy)) if busy == folder.path())
        );
        drop(lock);
        drop(FolderLock::take(folder.path()).unwrap());
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
        // A user's file of that name is kept.
        let mine = folder.path().join(super::LOCK);
        fs::write(&mine, "mine").unwrap();
        drop(FolderLock::take(folder.path()).unwrap());
        assert_eq!(fs::read_to_string(&mine).unwrap(), "mine");
    }
}
