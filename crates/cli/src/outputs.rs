//! Names of output files, and failures of writing them.

use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use asperity_files::{
    Existing, FileError, FileSet, Inputs, better_name, create_folder as create, is_new_folder,
};
use clap::Args;

use crate::exit::Failure;
use crate::terminal::{self, Data};

/// Where a command prints its table.
#[derive(Debug, Args)]
pub(crate) struct TableOut {
    /// Write it to this file instead of printing it.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Replace an existing file.
    #[arg(long, requires = "out")]
    force: bool,
}

impl TableOut {
    /// The files of the command, none of which is one of the inputs.
    pub(crate) fn files(
        &self,
        inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    ) -> Result<FileSet, Failure> {
        let existing = if self.force { Existing::Replace } else { Existing::Refuse };
        let files = FileSet::new(existing, Inputs::of(inputs));
        files.reserve(&self.out).map_err(|error| refused("--out", &error, true))?;
        Ok(files)
    }

    /// What the table is written to.
    pub(crate) fn begin(&self, files: &FileSet) -> Result<Data, Failure> {
        let Some(path) = &self.out else { return Ok(terminal::data()) };
        let file = files.create(path).map_err(|error| refused("--out", &error, true))?;
        Ok(Box::new(BufWriter::new(file)))
    }

    /// Gives the file its name, and prints it.
    pub(crate) fn publish(&self, files: FileSet) -> Result<(), Failure> {
        files.publish().map_err(|error| refused("--out", &error, true))?;
        Ok(self.out.iter().try_for_each(|path| terminal::say(path.display()))?)
    }
}

/// Refuses an output name whose ending denotes another format than that of `what`. Names of `what` end in
/// `ending`; it is a folder if `ending` is empty. Existing files are left to the checks for replacement.
pub(crate) fn fits(option: &str, path: &Path, ending: &str, what: &str) -> Result<(), Failure> {
    let Some(better) = better_name(path, ending).filter(|_| !path.exists()) else { return Ok(()) };
    let folder = if ending.is_empty() { "a folder, as " } else { "" };
    Err(Failure::BadInput(format!(
        "{option} {}: the output is {what} (accepted: {folder}{})",
        path.display(),
        better.display()
    )))
}

/// The result of [`fits`] for folders.
pub(crate) const A_FOLDER: &str = "a folder of files";

/// Why a file is not written: invalid input, if another name would do.
pub(crate) fn refused(option: &str, error: &FileError, can_force: bool) -> Failure {
    let option = if option.is_empty() { String::new() } else { format!("{option} ") };
    let accepted = match error {
        FileError::Exists(_) if can_force => "another file, or --force",
        FileError::Exists(_) => "a path that does not exist",
        _ => "another file",
    };
    if error.is_of_name() {
        Failure::BadInput(format!("{option}{error} (accepted: {accepted})"))
    } else {
        Failure::failed(error)
    }
}

/// Refuses a folder of `--out` that contains something.
pub(crate) fn must_be_new(folder: &Path) -> Result<(), Failure> {
    match is_new_folder(folder) {
        Ok(true) => Ok(()),
        Err(error) if error.kind() != io::ErrorKind::NotADirectory => {
            Err(Failure::Failed(format!("--out {}: {error}", folder.display())))
        }
        _ => Err(Failure::BadInput(format!(
            "--out {} exists already and is not an empty folder (accepted: a new or empty folder)",
            folder.display()
        ))),
    }
}

/// Creates the folder of an output.
pub(crate) fn create_folder(folder: &Path) -> Result<(), Failure> {
    create(folder).map(drop).map_err(|error| refused("--out", &error, false))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::fits;

    #[test]
    fn names_that_say_another_format_are_refused_and_others_are_not() {
        let of = |name: &str, ending: &str| fits("--out", Path::new(name), ending, "a run log");
        for name in ["x.mcap", "x.MCAP", "x", "tilt-0.5", "mine.v2", ".csv"] {
            assert!(of(name, "mcap").is_ok(), "{name}");
        }
        let refused = of("out/x.h5", "mcap").unwrap_err().to_string();
        assert_eq!(refused, "--out out/x.h5: the output is a run log (accepted: out/x.mcap)");
        for name in ["x.mcap.partial", "x.mcap.resumed"] {
            assert!(of(name, "mcap").unwrap_err().to_string().ends_with("(accepted: x.mcap)"), "{name}");
        }
        let refused = of("out/x.csv", "").unwrap_err().to_string();
        assert!(refused.ends_with("(accepted: a folder, as out/x)"), "{refused}");
    }
}
