//! The built-in scenarios, TOML files beside the sources.

/// Name and text of every built-in scenario, in the order in which they are listed.
pub fn all() -> impl Iterator<Item = (&'static str, &'static str)> {
    SCENARIOS.iter().copied()
}

/// The text of the built-in scenario of that name.
pub fn find(name: &str) -> Option<&'static str> {
    all().find(|(known, _)| *known == name).map(|(_, text)| text)
}

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
    "slab",
    "sheet",
    "sheet-coarse",
    "body",
    "body-coarse",
    "slab-junctions",
    "chain-junctions",
    "junction-slider",
    "spring-slider",
    "rate-and-state",
];
