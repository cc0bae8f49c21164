//! Where the system gives no more memory or threads, a command fails, with exit code 1 and a word on
//! what it lacked. Neither an abort nor a panic is left to the libraries that come upon it first.

use std::panic;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use signal_hook::consts::SIGABRT;
use signal_hook::{flag, low_level};

use crate::exit::{Code, Failure, report};

/// What panics for want of memory or threads say: a context of zstd, threads of rayon and of the
/// standard library.
const WANTS: [&str; 3] = [
    "zstd returned null pointer when creating new context",
    "could not spawn threads",
    "failed to spawn thread",
];

/// Sees to that for the rest of the process.
pub(crate) fn fail() {
    let always = Arc::new(AtomicBool::new(true));
    // The standard library says how much memory it asked for, and aborts. Where the system refuses,
    // the signal ends the process as it would have.
    flag::register_conditional_shutdown(SIGABRT, i32::from(Code::Failed as u8), always).ok();
    let usual = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        match info.payload_as_str().filter(|text| WANTS.iter().any(|want| text.contains(want))) {
            None => usual(info),
            Some(text) => {
                report(&Failure::Failed(format!("the system gives no more memory or threads: {text}")));
                // Whatever other threads are at, nothing of it has a final name.
                low_level::exit(i32::from(Code::Failed as u8));
            }
        }
    }));
}
