//! Ruptures of logs by older versions without any.

use std::path::Path;

use asperity_record::{Event, Rupture};
use asperity_run::detectors::Settings;
use asperity_run::{Observer, Replay};

use crate::exit::Failure;

/// Finds the ruptures in the step records of a log with the registered detectors.
///
/// # Errors
/// If the log does not hold all of its run.
pub(crate) fn found_in_steps(run: &Path) -> Result<Vec<Rupture>, Failure> {
    let settings = Settings { detectors: vec!["rupture"], ..Settings::default() };
    let replay = Replay::open(run, &settings).map_err(Failure::failed)?;
    let mut found = Found(Vec::new());
    replay.run(&|| false, &mut found).map_err(Failure::failed)?;
    Ok(found.0)
}

struct Found(Vec<Rupture>);

impl Observer for Found {
    fn event(&mut self, event: &Event) {
        self.0.extend(event.get::<Rupture>().cloned());
    }
}
