//! `asperity --notices`: the software of others that the command contains, and its licences.

use std::io::Write;

use crate::exit::Failure;
use crate::terminal;

/// Written by `cargo xtask notices`.
const NOTICES: &str = include_str!("notices.txt");

pub(crate) fn print() -> Result<(), Failure> {
    let mut out = terminal::data();
    out.write_all(NOTICES.as_bytes())?;
    Ok(out.flush()?)
}
