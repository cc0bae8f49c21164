//! The identity of a file, independent of its names.

use std::fs::{self, File};
use std::io;
use std::path::Path;

/// The system's identity of a file: equal for two names of one file, and different for a file that
/// replaced another.
#[cfg(unix)]
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Identity {
    device: u64,
    inode: u64,
}

#[cfg(unix)]
impl Identity {
    /// The identity of an open file.
    pub(crate) fn of_file(file: &File) -> io::Result<Identity> {
        file.metadata().map(Identity::of)
    }

    /// The identity of the target of a path, through links. Does not open it, since opening a pipe would
    /// block.
    pub(crate) fn of_path(path: &Path) -> io::Result<Identity> {
        fs::metadata(path).map(Identity::of)
    }

    /// The identity of the directory entry itself, even if it is a link.
    pub(crate) fn of_entry(path: &Path) -> io::Result<Identity> {
        fs::symlink_metadata(path).map(Identity::of)
    }

    #[expect(clippy::needless_pass_by_value, reason = "as what opens and asks gives it")]
    fn of(metadata: fs::Metadata) -> Identity {
        use std::os::unix::fs::MetadataExt;
        Identity { device: metadata.dev(), inode: metadata.ino() }
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
