//! Files that bear their name only once they are whole.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A file that is being written as `NAME.partial`, until [`WholeFile::publish`] gives it
/// its name. If that never happens it is removed: a part of a table is of no use to anybody, and
/// may fill the disk.
///
/// A process that is killed leaves the `.partial`, and whatever stood under the name before.
#[derive(Debug)]
pub struct WholeFile {
    path: PathBuf,
    is_published: bool,
}

impl WholeFile {
    /// Creates the file.
    ///
    /// # Errors
    /// If that fails.
    pub fn create(path: &Path) -> io::Result<(WholeFile, File)> {
        let whole = WholeFile { path: path.to_owned(), is_published: false };
        let file = File::create(whole.partial_path())?;
        Ok((whole, file))
    }

    /// Writes all of a file.
    ///
    /// # Errors
    /// If that fails.
    pub fn write(path: &Path, content: impl AsRef<[u8]>) -> io::Result<()> {
        let (whole, mut file) = WholeFile::create(path)?;
        file.write_all(content.as_ref())?;
        whole.publish()
    }

    /// The name that it is to have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn partial_path(&self) -> PathBuf {
        let mut name = OsString::from(&self.path);
        name.push(".partial");
        name.into()
    }

    /// Gives the file its name, in place of what may have it.
    ///
    /// # Errors
    /// If that fails.
    pub fn publish(mut self) -> io::Result<()> {
        fs::rename(self.partial_path(), &self.path)?;
        self.is_published = true;
        Ok(())
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        if !self.is_published {
            // If it cannot be removed either, the problem that led here is the one to tell.
            fs::remove_file(self.partial_path()).ok();
        }
    }
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
}
