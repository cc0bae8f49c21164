//! The inputs of a command, which it must not overwrite.

use std::path::{Path, PathBuf};

use crate::error::FileError;
use crate::identity::Identity;
use crate::place::Place;

/// The path of an unfinished run log.
pub fn partial_path(path: &Path) -> PathBuf {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(".partial");
    path.with_file_name(name)
}

/// The files that a command reads. They are never overwritten, whatever name or link leads to them,
/// nor is an unfinished log at the [`partial_path`] of one.
#[derive(Debug, Clone, Default)]
pub struct Inputs(Vec<Input>);

/// A path, and the file there: none if there is no such file, which reading it will report.
type Input = (PathBuf, Option<Identity>, Option<Place>);

impl Inputs {
    /// Records the identities of the files that a command reads.
    pub fn of<P: AsRef<Path>>(paths: impl IntoIterator<Item = P>) -> Inputs {
        let mut inputs = Inputs::default();
        inputs.add(paths);
        inputs
    }

    /// Adds further inputs.
    pub fn add<P: AsRef<Path>>(&mut self, paths: impl IntoIterator<Item = P>) {
        for path in paths {
            let path = path.as_ref();
            for path in [path.to_owned(), partial_path(path)] {
                let (identity, place) = (Identity::of_path(&path).ok(), Place::of(&path).ok());
                self.0.push((path, identity, place));
            }
        }
    }

    /// Checks that an output is not one of the inputs.
    ///
    /// # Errors
    /// If it is.
    pub fn check(&self, path: &Path) -> Result<(), FileError> {
        let (identity, place) = (Identity::of_path(path).ok(), Place::of(path).ok());
        let is_it = |(_, of, at): &&Input| {
            (identity.is_some() && identity == *of) || (place.is_some() && place == *at)
        };
        match self.0.iter().find(is_it) {
            None => Ok(()),
            Some((input, ..)) => Err(FileError::Input { path: path.to_owned(), input: input.clone() }),
        }
    }
}
