//! The keys of time, detection and recording.

use asperity_record::MOST_BLOCKS;

use crate::key::Bound::Including;
use crate::key::Default::Is;
use crate::key::Kind::{Count, Flag, Number, Word};
use crate::key::{Key, NOT_NEGATIVE, POSITIVE, Value};

/// In the order in which they are shown.
pub(super) const RUN: &[Key] = &[
    Key {
        path: "time.start",
        symbol: "",
        doc: "Where the run begins: at-rest, at time 0; loaded, just before the first block would detach, \
              as the stuck chain follows the drive in steady motion, step by step and with the lag of its damping: \
              without the ramp, and without the vibration that it leaves. By rate-and-state: loaded, its default, at \
              time 0 in steady sliding (friction.initial_kick); at-rest, with relaxed springs and the same state.",
        kind: Word(&["at-rest", "loaded"]),
        default: Is(Value::Text("at-rest")),
    },
    Key {
        path: "time.step_s",
        symbol: "dt",
        doc: "Time step of the Euler-Cromer scheme (4.13, 4.14). `asperity scenario validate` says which is the longest \
              stable one; beyond 0.4 of that, switches feed energy into the slider. By rate-and-state, whose solver \
              chooses its steps, the grid to which times are rounded.",
        kind: POSITIVE,
        default: Is(Value::Number(1e-8)),
    },
    Key {
        path: "time.duration_s",
        symbol: "T",
        doc: "Simulated time, a whole number of steps; of a run that begins in a given state, its end on the clock that \
              goes on.",
        kind: POSITIVE,
        default: Is(Value::Number(5.0)),
    },
    Key {
        path: "time.tolerance",
        symbol: "",
        doc: "Of rate-and-state: the relative error that the adaptive solver accepts in a step, in each unknown over \
              its scale.",
        kind: Number(Including(1e-12), Including(1e-2)),
        default: Is(Value::Number(1e-7)),
    },
    Key {
        path: "detection.link_time_ratio",
        symbol: "lambda",
        doc: "Detachments of the same or neighbouring blocks are one rupture if no more than lambda sqrt(m/k) lies \
              between them, by junctions also if no more than twice their healing time: a front may be this much \
              slower than elastic waves. Never changes the run, only what is told of it.",
        kind: POSITIVE,
        default: Is(Value::Number(100.0)),
    },
    Key {
        path: "recording.sample_s",
        symbol: "",
        doc: "Cadence of the load samples, a whole number of steps; 0 for none. \
              Never changes the run: switches and events are recorded in any case.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(1e-3)),
    },
    Key {
        path: "recording.fields_s",
        symbol: "",
        doc: "Cadence of the states of all blocks, a whole number of steps; 0 for none.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(2e-2)),
    },
    Key {
        path: "recording.event_fields",
        symbol: "",
        doc: "Whether to record the states of all blocks at the onset and end of every slip event.",
        kind: Flag,
        default: Is(Value::Flag(true)),
    },
    Key {
        path: "recording.rupture_fields_from_blocks",
        symbol: "",
        doc: "Whether to record the states of all blocks while at least so many blocks slide at once, at the cadence \
              recording.rupture_fields_s; 0 for not at all. So large ruptures are recorded whose time is not known \
              before.",
        kind: Count(0, MOST_BLOCKS),
        default: Is(Value::Count(0)),
    },
    Key {
        path: "recording.rupture_fields_s",
        symbol: "",
        doc: "Cadence of these states, a whole number of steps; 0 if there are none.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
];
