//! Messages on stderr, which may be full or closed: then only the message is lost.

use std::fmt::Arguments;
use std::io::Write;

/// Prints to stderr, as `eprint!` does, which panics where it cannot.
pub(crate) fn print(words: Arguments<'_>) {
    std::io::stderr().lock().write_fmt(words).ok();
}

/// Prints a line to stderr, as `eprintln!` does, which panics where it cannot.
macro_rules! say {
    ($($words:tt)*) => {
        $crate::say::print(format_args!("{}\n", format_args!($($words)*)))
    };
}

pub(crate) use say;
