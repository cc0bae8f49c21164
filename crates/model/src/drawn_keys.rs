//! The keys of random draws, which texts of scenarios list for other programs.

use crate::key::Bound::Open;
use crate::key::Default::Is;
use crate::key::Kind::Numbers;
use crate::key::{Key, Value};

/// Random draws, written into texts for other programs; they follow from the other keys.
pub const DRAWN_KEYS: &[Key] = &[
    Key {
        path: "drawn.static_offsets",
        symbol: "",
        doc: "Offsets that friction.static_spread adds to mu_s, block by block, drawn with \
              friction.spread_seed; for information, they cannot be set.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
        needs: &[],
    },
    Key {
        path: "drawn.dynamic_offsets",
        symbol: "",
        doc: "Offsets that friction.dynamic_spread adds to mu_d, likewise.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
        needs: &[],
    },
    Key {
        path: "drawn.stiffness_offsets",
        symbol: "",
        doc: "Offsets that disorder.stiffness_spread adds to k_t, over k_t, likewise.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
        needs: &[],
    },
    Key {
        path: "drawn.load_offsets",
        symbol: "",
        doc: "Offsets that disorder.load_spread adds to p, over p, likewise.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
        needs: &[],
    },
];
