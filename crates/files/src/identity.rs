//! The identity of a file, independent of its names.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// The system's identity of a file, by device and inode: equal for two names of one file, and different for a file that
/// replaced another.
#[cfg(unix)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity(u64, u64);

#[cfg(unix)]
impl Identity {
    /// The identity of an open file.
    pub(crate) fn of_file(file: &File) -> io::Result<Identity> {
        Identity::of(file.metadata())
    }

    /// The identity of the target of a path, through links. Does not open it, since opening a pipe would
    /// block.
    pub(crate) fn of_path(path: &Path) -> io::Result<Identity> {
        Identity::of(fs::metadata(path))
    }

    /// The identity of the directory entry itself, even if it is a link.
    pub(crate) fn of_entry(path: &Path) -> io::Result<Identity> {
        Identity::of(fs::symlink_metadata(path))
    }

    fn of(metadata: io::Result<fs::Metadata>) -> io::Result<Identity> {
        use std::os::unix::fs::MetadataExt;
        metadata.map(|metadata| Identity(metadata.dev(), metadata.ino()))
    }
}

/// Other systems only identify open files.
#[cfg(not(unix))]
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity(std::sync::Arc<same_file::Handle>);

#[cfg(not(unix))]
impl Identity {
    pub(crate) fn of_file(file: &File) -> io::Result<Identity> {
        Ok(Identity(same_file::Handle::from_file(file.try_clone()?)?.into()))
    }

    pub(crate) fn of_path(path: &Path) -> io::Result<Identity> {
        Ok(Identity(same_file::Handle::from_path(path)?.into()))
    }

    pub(crate) fn of_entry(path: &Path) -> io::Result<Identity> {
        if fs::symlink_metadata(path)?.is_symlink() {
            return Err(io::Error::other("it is a link"));
        }
        Identity::of_path(path)
    }
}
