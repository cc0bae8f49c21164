//! Ends a command that runs out of memory or threads with exit code 1 and a message, instead of an
//! abort or a panic in a library.

use std::panic;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::SIGABRT;
use signal_hook::{flag, low_level};

use crate::exit::{Code, Failure, report};

/// The panic messages of libraries without memory or threads: short texts of polars, zstd contexts, rayon's threads,
/// and the standard library's.
const REQUIRED_DATA: [&str; 4] = [
    "Cannot allocate memory",
    "zstd returned null pointer when creating new context",
    "could not spawn threads",
    "failed to spawn thread",
];

/// Installs the handlers for the rest of the process.
pub(crate) fn fail() {
    let always = Arc::new(AtomicBool::new(true));
    // The standard library prints how much memory was requested, and aborts. If the handler cannot
    // be registered, the signal ends the process anyway.
    flag::register_conditional_shutdown(SIGABRT, i32::from(Code::Failed as u8), always).ok();
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        match info.payload_as_str().filter(|text| REQUIRED_DATA.iter().any(|want| text.contains(want))) {
            None => usual(info),
            Some(text) => {
                report(&Failure::Failed(format!("the system gives no more memory or threads: {text}")));
                // Work in other threads has not been renamed to its final name.
                low_level::exit(i32::from(Code::Failed as u8));
            }
        }
    }));
}
