//! The keys of what differs from contact to contact.

use asperity_record::bounds::LONGEST_NAME_BYTES;

use crate::key::Bound::{Excluding, Including, Open};
use crate::key::Default::Is;
use crate::key::Kind::{Number, Numbers, Text, Word};
use crate::key::{Key, NOT_NEGATIVE, Value};

/// In the order in which they are shown.
pub(super) const DISORDER: &[Key] = &[
    Key {
        path: "disorder.distribution",
        symbol: "",
        doc: "How all that is drawn is distributed (friction.static_spread, dynamic_spread, stiffness_spread, \
              load_spread): uniform, from mean - spread to mean + spread; normal, lognormal and weibull, with \
              the spread as standard deviation; two-valued, mean + spread in asperities, mean - spread elsewhere, so \
              that the mean of all shifts by (2 asperity_share - 1) spread.",
        kind: Word(&["uniform", "normal", "lognormal", "weibull", "two-valued"]),
        default: Is(Value::Text("uniform")),
    },
    Key {
        path: "disorder.weibull_modulus",
        symbol: "",
        doc: "Of weibull: the modulus of the distribution, which is scaled and shifted to mean and spread.",
        kind: Number(Including(0.1), Including(1e3)),
        default: Is(Value::Number(2.0)),
    },
    Key {
        path: "disorder.asperity_share",
        symbol: "",
        doc: "Of two-valued: the probability that a contact is in an asperity.",
        kind: Number(Excluding(0.0), Excluding(1.0)),
        default: Is(Value::Number(0.5)),
    },
    Key {
        path: "disorder.correlation_length_m",
        symbol: "",
        doc: "Length over which what is drawn for two contacts is related: the normal numbers behind it have the \
              correlation exp(-(|dx| + |dy|) / length); 0 for draws of their own.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "disorder.stiffness_spread",
        symbol: "",
        doc: "Spread of the friction springs' stiffness k_t of the blocks of a chain, over its mean; 0 for none.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "disorder.load_spread",
        symbol: "",
        doc: "Spread of the normal load p of the contacts of a chain or a sheet, over p; 0 for none. The loads are \
              scaled so that they add up to normal_load.total_n.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "disorder.stiffness_offsets",
        symbol: "",
        doc: "What is added to k_t, over k_t, block by block; empty for nothing.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "disorder.load_offsets",
        symbol: "",
        doc: "What is added to p, over p, block by block, before the scaling to the total; empty for nothing.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "disorder.contacts_csv",
        symbol: "",
        doc: "A file, named from the current folder, with a row for each block and one or more of the columns \
              static_offset, dynamic_offset, stiffness_offset and load_offset, which fill the lists of these names. It \
              is read unless one of these lists is given, and once; the run's log holds what it said.",
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
];
