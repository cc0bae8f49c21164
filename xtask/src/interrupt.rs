//! SIGINT and SIGTERM during work that needs a cleanup: they end the running child, while this program
//! continues and cleans up.

use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

use crate::workspace::{Failure, not_started, succeeded};

/// Exit codes are 128 and the signal's number, as shells have it.
const SIGNALS: [(i32, u8); 2] = [(SIGINT, 130), (SIGTERM, 143)];

/// How often a program that runs is looked at.
const PATIENCE: Duration = Duration::from_millis(20);

/// Time for children that Ctrl-C in a terminal also reaches to end by themselves.
const GRACE: Duration = Duration::from_secs(5);

static SIGNAL: OnceLock<Arc<AtomicUsize>> = OnceLock::new();

/// Takes the signals over from the system.
pub(crate) fn install() -> Result<(), Failure> {
    let signal = SIGNAL.get_or_init(Arc::default);
    for (number, code) in SIGNALS {
        flag::register_usize(number, Arc::clone(signal), usize::from(code))
            .map_err(|error| Failure::Io { what: "listen to signals".to_owned(), error })?;
    }
    Ok(())
}

/// Fails if a signal has come.
pub(crate) fn check() -> Result<(), Failure> {
    let signal = SIGNAL.get().map_or(0, |signal| signal.load(Ordering::Relaxed));
    match SIGNALS.into_iter().find(|(_, code)| usize::from(*code) == signal) {
        Some((_, code)) => Err(Failure::Interrupted(code)),
        None => Ok(()),
    }
}

/// Runs a command to its end, or to a signal; its output goes where the command directs it.
pub(crate) fn run(command: &mut Command) -> Result<(), Failure> {
    check()?;
    let mut child = command.spawn().map_err(|error| not_started(command, error))?;
    let mut asked: Option<Instant> = None;
    let status = loop {
        let ended = child.try_wait().map_err(|error| not_started(command, error))?;
        if let Some(status) = ended {
            break status;
        }
        if check().is_err() && asked.get_or_insert_with(Instant::now).elapsed() > GRACE {
            child.kill().map_err(|error| not_started(command, error))?;
        }
        thread::sleep(PATIENCE);
    };
    check()?;
    succeeded(command, status)
}
