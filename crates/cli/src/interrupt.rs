//! SIGINT and SIGTERM in commands that write logs: the first signal lets runs close their logs, the
//! second ends the process at once. Other commands end at the first.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use signal_hook::consts::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;

use crate::exit::{Code, Failure};

static SIGNAL: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Installs the signal handlers.
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
        // In this order: the first signal sets the flag that the second finds set.
        flag::register_conditional_shutdown(number, i32::from(code as u8), Arc::clone(&before))?;
        flag::register(number, Arc::clone(&before))?;
        flag::register_usize(number, Arc::clone(signal), usize::from(code as u8))?;
    }
    Ok(())
}

/// Makes writes beyond the limit of `ulimit -f` fail like those on a full disk, instead of ending
/// the process without a message.
pub(crate) fn outlive_the_file_size_limit() {
    // If the handler cannot be registered, the limit ends the process as before.
    flag::register(SIGXFSZ, Arc::default()).ok();
}

/// The exit code for a signal, if one has arrived.
pub(crate) fn code() -> Option<Code> {
    let signal = SIGNAL.get().map_or(0, |signal| signal.load(Ordering::Relaxed));
    [Code::Interrupted, Code::Terminated].into_iter().find(|code| *code as usize == signal)
}

/// Whether a signal has arrived.
pub(crate) fn has_come() -> bool {
    SIGNAL.get().is_some_and(|signal| signal.load(Ordering::Relaxed) != 0)
}
