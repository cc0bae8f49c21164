//! The inputs of a command, which it must not overwrite.

use std::path::{Path, PathBuf};

use crate::error::FileError;
use crate::identity::Identity;
use crate::place::{Place, with_suffix};

/// The path of an unfinished run log.
pub fn partial_path(path: &Path) -> PathBuf {
    with_suffix(path, ".partial")
}

/// The files that a command reads. They are never overwritten, whatever name or link leads to them,
/// nor is an unfinished log at the [`partial_path`] of one.
#[derive(Debug, Clone, Default)]
pub struct Inputs {
    all: Vec<Input>,
}

#[derive(Debug, Clone)]
struct Input {
    path: PathBuf,
    /// None if there is no such file; reading it will report that.
    identity: Option<Identity>,
    place: Option<Place>,
}

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
                self.all.push(Input { path, identity, place });
            }
        }
    }

    /// Checks that an output is not one of the inputs.
    ///
    /// # Errors
    /// If it is.
    pub fn check(&self, path: &Path) -> Result<(), FileError> {
        let (identity, place) = (Identity::of_path(path).ok(), Place::of(path).ok());
        let is_it = |input: &&Input| {
            (identity.is_some() && identity == input.identity) || (place.is_some() && place == input.place)
        };
        match self.all.iter().find(is_it) {
            None => Ok(()),
            Some(input) => Err(FileError::Input { path: path.to_owned(), input: input.path.clone() }),
        }
    }
}
