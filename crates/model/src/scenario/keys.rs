//! Every key of a scenario, declared once.
//!
//! The table is the single definition of valid keys: resolving checks against it, `asperity scenario show`
//! comments with it, and a test compares it with the fields of [`Scenario`](crate::Scenario).

mod disorder;
mod forces;
mod friction;
mod run;
pub(crate) mod section;
mod slider;

pub use crate::scenario::key::{AS_CODED, AS_STATED, Bound, Default, Key, Kind, Need, PARAMETER_SETS, Value};
pub use disorder::Disorder;
pub use forces::{Drive, Initial, InitialShear, InitialVelocity, NormalLoad, Prestress};
pub use friction::Friction;
pub use run::{Detection, Recording, Time, Window};
pub use slider::Slider;

/// A list of numbers, empty or of a length defined elsewhere.
pub type List = Vec<f64>;

/// Prefix of the keys inside each `[[recording.window]]`.
pub(crate) const WINDOW: &str = "recording.window";

/// The parts of the table.
const PARTS: [&[Key]; 13] = [
    slider::NAMES,
    Slider::KEYS,
    Friction::KEYS,
    Drive::KEYS,
    NormalLoad::KEYS,
    InitialShear::KEYS,
    Prestress::KEYS,
    InitialVelocity::KEYS,
    Initial::KEYS,
    Disorder::KEYS,
    Time::KEYS,
    Detection::KEYS,
    Recording::KEYS,
];

const COUNT: usize = {
    let (mut count, mut part) = (0, 0);
    while part < PARTS.len() {
        count += PARTS[part].len();
        part += 1;
    }
    count
};

/// All keys, in the order in which they are shown.
pub const KEYS: &[Key] = &joined();

const fn joined() -> [Key; COUNT] {
    let mut all = [PARTS[0][0]; COUNT];
    let (mut next, mut part) = (0, 0);
    while part < PARTS.len() {
        let mut at = 0;
        while at < PARTS[part].len() {
            all[next] = PARTS[part][at];
            next += 1;
            at += 1;
        }
        part += 1;
    }
    all
}
