//! Reading the texts that a command is given: scenarios, pipelines, settings.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// No text that somebody wrote is longer; `/dev/zero` is.
const LONGEST_BYTES: u64 = 64 << 20;

/// The text of a file, which is not made room for beyond what any has.
///
/// # Errors
/// If the system refuses, or the file is too long or no text.
pub(crate) fn read(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    let bytes = File::open(path)?.take(LONGEST_BYTES + 1).read_to_string(&mut text)?;
    if bytes as u64 > LONGEST_BYTES {
        let problem = format!("the file is longer than {LONGEST_BYTES} bytes");
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, problem));
    }
    Ok(text)
}
