//! SIGINT and SIGTERM in commands that write logs: the first asks runs to close them, the
//! second stops at once. Other commands stop at the first.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;

use crate::exit::{Code, Failure};

static SIGNAL: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Takes the signals over from the system.
///
/// # Errors
/// If the system refuses.
pub(crate) fn install() -> Result<(), Failure> {
    listen().map_err(|error| Failure::Failed(format!("failed to listen to signals: {error}")))
}

fn listen() -> io::Result<()> {
    let signal = SIGNAL.get_or_init(Arc::default);
    let before = Arc::new(AtomicBool::new(false));
    for (number, code) in [(SIGINT, Code::Interrupted), (SIGTERM, Code::Terminated)] {
        // In this order: the first signal only sets what the second finds set.
        flag::register_conditional_shutdown(number, i32::from(code as u8), Arc::clone(&before))?;
        flag::register(number, Arc::clone(&before))?;
        flag::register_usize(number, Arc::clone(signal), usize::from(code as u8))?;
    }
    Ok(())
}

/// Has a file that would grow beyond the limit of `ulimit -f` fail to be written, as on a full
/// disk, instead of ending the process without a word.
pub(crate) fn outlive_the_file_size_limit() {
    // Where the system refuses, the limit ends the process as it would have.
    flag::register(SIGXFSZ, Arc::default()).ok();
}

/// The code to exit with, if a signal has come.
pub(crate) fn code() -> Option<Code> {
    let signal = SIGNAL.get().map_or(0, |signal| signal.load(Ordering::Relaxed));
    [Code::Interrupted, Code::Terminated].into_iter().find(|code| *code as usize == signal)
}

/// Whether a signal has come.
pub(crate) fn has_come() -> bool {
    code().is_some()
}
