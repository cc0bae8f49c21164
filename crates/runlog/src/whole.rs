//! Files that bear their name only once they are whole: where they stand until then, and how
//! they get it.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Where a file stands until it is whole.
pub fn partial_path(path: &Path) -> PathBuf {
    with_suffix(path, ".partial")
}

/// A path beside another one.
pub(crate) fn with_suffix(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_name().map(OsString::from).unwrap_or_default();
    name.push(suffix);
    path.with_file_name(name)
}

/// A file that is being written as `NAME.partial`, until [`WholeFile::publish`] gives it
/// its name. If that never happens it is removed: a part of a table is of no use to anybody, and
/// may fill the disk.
///
/// A process that is killed leaves the `.partial`, and whatever stood under the name before. A
/// link is followed, and what is no file, as `/dev/stdout` or a pipe, is written to as it stands.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    /// Where it stands and what it is to be called, while both differ.
    unpublished: Option<(PathBuf, PathBuf)>,
}

impl WholeFile {
    /// Creates the file.
    ///
    /// # Errors
    /// If that fails.
    pub fn create(path: &Path) -> io::Result<(WholeFile, File)> {
        let path = path.to_owned();
        let (name, is_file) = match fs::metadata(&path) {
            Ok(there) => (fs::canonicalize(&path)?, there.is_file()),
            Err(_) => (path.clone(), true),
        };
        if !is_file {
            let file = File::options().write(true).open(&path)?;
            return Ok((WholeFile { path, unpublished: None }, file));
        }
        let partial = partial_path(&name);
        let file = File::create(&partial)?;
        Ok((WholeFile { path, unpublished: Some((partial, name)) }, file))
    }

    /// Writes all of a file.
    ///
    /// # Errors
    /// If that fails.
    pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
        let (whole, mut file) = WholeFile::create(path)?;
        file.write_all(content.as_ref())?;
        drop(file);
        whole.publish()
    }

    /// The name that it is to have, as it was given.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the file its name, in place of what may have it.
    ///
    /// # Errors
    /// If that fails.
    pub fn publish(mut self) -> io::Result<()> {
        if let Some((partial, name)) = &self.unpublished {
            fs::rename(partial, name)?;
        }
        self.unpublished = None;
        Ok(())
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if let Some((partial, _)) = &self.unpublished {
            // If it cannot be removed either, the problem that led here is the one to tell.
            fs::remove_file(partial).ok();
        }
    }
}

/// Sees to it that a new name outlives a crash of the machine.
#[cfg(unix)]
pub(crate) fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

/// Elsewhere a folder cannot be opened as a file.
#[cfg(not(unix))]
pub(crate) fn sync_folder(_path: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;

    use super::WholeFile;

    #[test]
    fn what_is_not_published_leaves_what_was_there() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.b.csv");
        let names = || {
            let entries = fs::read_dir(folder.path()).unwrap();
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect::<Vec<_>>()
        };
        let (whole, mut file) = WholeFile::create(&path).unwrap();
        file.write_all(b"half").unwrap();
        assert_eq!(names(), ["a.b.csv.partial"]);
        drop(whole);
        assert!(names().is_empty());

        WholeFile::write(&path, "old\n").unwrap();
        let (whole, mut file) = WholeFile::create(&path).unwrap();
        file.write_all(b"new\n").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "old\n");
        whole.publish().unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "new\n");
        assert_eq!(names(), ["a.b.csv"]);
    }

    #[test]
    #[cfg(unix)]
    fn links_are_followed_and_devices_written_to() {
        let folder = tempfile::tempdir().unwrap();
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").unwrap();
        std::os::unix::fs::symlink(&file, &link).unwrap();
        WholeFile::write(&link, "new").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read_to_string(&file).unwrap(), "new");

        // A link to a device, so that no device is at stake.
        fs::remove_file(&link).unwrap();
        std::os::unix::fs::symlink("/dev/null", &link).unwrap();
        WholeFile::write(&link, "gone").unwrap();
        assert!(!fs::metadata(&link).unwrap().is_file());
        assert!(WholeFile::write(folder.path(), "a folder").is_err());
    }
}
