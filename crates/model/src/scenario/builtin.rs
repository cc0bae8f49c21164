//! The built-in scenarios, TOML files beside the sources.

/// Name and text of every built-in scenario, in the order in which they are listed.
pub fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    SCENARIOS.iter().copied()
}

/// The text of the built-in scenario of that name.
pub fn find(name: &str) -> Option<&'static str> {
    all().find(|(known, _)| *known == name).map(|(_, text)| text)
}

/// A kind of experiment, and the model that shows what it shows.
#[derive(Debug)]
pub struct Experiment {
    /// What is slid, and how.
    pub what: &'static str,
    /// The model.
    pub model: &'static str,
    /// Scenarios to begin with, the best first.
    pub scenarios: &'static [&'static str],
    /// What this model cannot show, or what its numbers hang on.
    pub cannot: &'static str,
}

/// The kinds of experiments, the most usual first.
pub const EXPERIMENTS: &[Experiment] = &[
    Experiment {
        what: "a block of PMMA or glass, pushed from its side or its top",
        model: "slab",
        scenarios: &["pmma-block", "slab"],
        cannot: "what happens across its width; Poisson's ratio is 1/3",
    },
    Experiment {
        what: "a long thin slider, or the thesis",
        model: "chain",
        scenarios: &["default", "top-driven"],
        cannot: "waves in its bulk; counts and first slips hang on the number of blocks, and converge at a fixed \
                 friction.decay_length_m",
    },
    Experiment {
        what: "a block whose width matters, or is pushed askew",
        model: "body; sheet if it is flat",
        scenarios: &["body-coarse", "body", "sheet-coarse", "sheet"],
        cannot: "contacts that age; Poisson's ratio is 1/4",
    },
    Experiment {
        what: "bare rock as granite, velocity steps, slide-hold-slide",
        model: "rate and state",
        scenarios: &["spring-slider", "rate-and-state"],
        cannot: "waves in its bulk: it is a chain or a single block; contacts that stick",
    },
    Experiment {
        what: "slow slip, slow fronts, afterslip",
        model: "junctions",
        scenarios: &["slab-junctions", "chain-junctions", "junction-slider"],
        cannot: "where its times come from: the healing time of junctions is put in",
    },
    Experiment {
        what: "a fault in the crust, over many earthquakes",
        model: "fault line in a medium",
        scenarios: &["seas-bp1-qd-coarse", "seas-bp1-qd", "seas-bp2-qd"],
        cannot: "inertia: waves are radiated, and carry no stress; what differs along strike",
    },
    Experiment {
        what: "a fault with many earthquakes",
        model: "model fault",
        scenarios: &["carlson-langer"],
        cannot: "units: lengths and times are those of a model; single events, as the series is chaotic",
    },
];

macro_rules! scenarios {
    ($($name:literal),* $(,)?) => {
        const SCENARIOS: &[(&str, &str)] = &[
            $(($name, include_str!(concat!("../../scenarios/", $name, ".toml")))),*
        ];
    };
}

// To add one: a file in `scenarios/`, a line here.
scenarios![
    "default",
    "ten-blocks",
    "load-on-far-end",
    "load-on-driven-end",
    "beta-0225",
    "beta-045",
    "friction-140-090",
    "friction-035-0225",
    "friction-085-060",
    "friction-055-030",
    "first-precursor",
    "ring-down",
    "loaded-start",
    "rigid-contacts",
    "velocity-weakening",
    "carlson-langer",
    "scattered-friction",
    "ageing-contacts",
    "unload-400",
    "unload-600",
    "unload-800",
    "unload-400-beta-045",
    "unload-400-beta-0225",
    "unload-comparison",
    "damping-event",
    "top-driven",
    "left-right-driven",
    "unloading",
    "unloading-ageing",
    "unloading-poisson",
    "unloading-desired-load",
    "unloading-top-driven",
    "unloading-top-driven-poisson",
    "front",
    "slip-pulse",
    "slip-weakening",
    "slip-weakening-barrier",
    "slab",
    "pmma-block",
    "sheet",
    "sheet-coarse",
    "body",
    "body-coarse",
    "slab-junctions",
    "chain-junctions",
    "junction-slider",
    "spring-slider",
    "rate-and-state",
    "seas-bp1-qd",
    "seas-bp2-qd",
    "seas-bp1-qd-coarse",
];
