//! The keys of dense windows; a scenario may have any number of windows.

use asperity_record::MOST_BLOCKS;

use crate::keys::Default::Required;
use crate::keys::Kind::Count;
use crate::keys::{Key, NOT_NEGATIVE, POSITIVE};

/// Prefix of the keys inside each `[[recording.window]]`.
pub(crate) const WINDOW: &str = "recording.window";

/// The keys of a dense window, `[[recording.window]]`; there may be any number of windows.
pub(crate) const WINDOW_KEYS: &[Key] = &[
    Key {
        path: "from_s",
        symbol: "",
        doc: "Start of the window, a whole number of steps.",
        kind: NOT_NEGATIVE,
        default: Required,
    },
    Key {
        path: "to_s",
        symbol: "",
        doc: "End of the window, a whole number of steps, not before from_s.",
        kind: NOT_NEGATIVE,
        default: Required,
    },
    Key {
        path: "every_s",
        symbol: "",
        doc: "Cadence within the window, a whole number of steps.",
        kind: POSITIVE,
        default: Required,
    },
    Key {
        path: "first_block",
        symbol: "",
        doc: "First block to record.",
        kind: Count(1, MOST_BLOCKS),
        default: Required,
    },
    Key {
        path: "last_block",
        symbol: "",
        doc: "Last block to record, not before first_block nor beyond N.",
        kind: Count(1, MOST_BLOCKS),
        default: Required,
    },
];
