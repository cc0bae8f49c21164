//! Every key of a scenario, declared once.
//!
//! The table is the single definition of the keys of a scenario: resolving checks against it, `asperity scenario show`
//! comments with it, and its sections are the fields of [`Scenario`](crate::Scenario), in the same order. To it
//! `stand_ins.rs` adds two keys that are written in place of others.

use std::sync::LazyLock;

mod disorder;
mod forces;
mod friction;
mod medium;
mod run;
pub(crate) mod section;
mod slider;

use crate::scenario::stand_ins::STAND_INS;

pub use crate::scenario::key::{AS_CODED, AS_STATED, Key, Kind, Need};
pub use disorder::Disorder;
pub use forces::{Drive, Initial, InitialShear, InitialVelocity, NormalLoad, Prestress};
pub use friction::Friction;
pub use medium::Medium;
pub use run::{Detection, Recording, Time, Window};
pub use slider::Slider;

/// A list of numbers, empty or of a length defined elsewhere.
pub type List = Vec<f64>;

/// Prefix of the keys inside each `[[recording.window]]`.
pub(crate) const WINDOW: &str = "recording.window";

/// All keys, in the order in which they are shown.
pub static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    [
        &slider::names(),
        Slider::keys(),
        Medium::keys(),
        Friction::keys(),
        Drive::keys(),
        NormalLoad::keys(),
        InitialShear::keys(),
        Prestress::keys(),
        InitialVelocity::keys(),
        Initial::keys(),
        Disorder::keys(),
        Time::keys(),
        Detection::keys(),
        Recording::keys(),
    ]
    .concat()
});

/// The place of a key in [`KEYS`].
pub(crate) fn place(path: &str) -> usize {
    KEYS.iter().position(|key| key.path == path).expect("it is a key")
}

/// The key of this path, also where it only stands for another.
pub fn named(path: &str) -> Option<&'static Key> {
    KEYS.iter().chain(STAND_INS.iter()).find(|key| key.path == path)
}

/// All keys that a scenario may be written with, by section; those of no section are called `scenario`.
pub fn sections() -> Vec<(&'static str, Vec<&'static Key>)> {
    let mut all: Vec<(&str, Vec<&Key>)> = Vec::new();
    for key in KEYS.iter().chain(STAND_INS.iter()) {
        let section = key.path.rsplit_once('.').map_or("scenario", |(section, _)| section);
        match all.iter_mut().find(|(name, _)| *name == section) {
            Some((_, keys)) => keys.push(key),
            None => all.push((section, vec![key])),
        }
    }
    all.push(("[[recording.window]]", Window::keys().iter().collect()));
    all
}
