//! Every key of a scenario, declared once.
//!
//! The table is the single definition of valid keys: resolving checks against it, `asperity scenario show`
//! comments with it, and a test compares it with the fields of [`Scenario`](crate::Scenario).

mod disorder;
mod forces;
mod friction;
mod run;
mod slider;

pub use crate::drawn_keys::DRAWN_KEYS;
pub use crate::key::{AS_CODED, AS_STATED, Bound, Default, Key, Kind, PARAMETER_SETS, Value};
pub(crate) use crate::key::{NOT_NEGATIVE, POSITIVE};
pub(crate) use forces::FOUNDATION_RATIO;

/// The parts of the table.
const PARTS: [&[Key]; 5] = [slider::SLIDER, friction::FRICTION, forces::FORCES, disorder::DISORDER, run::RUN];

const COUNT: usize = PARTS[0].len() + PARTS[1].len() + PARTS[2].len() + PARTS[3].len() + PARTS[4].len();

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
