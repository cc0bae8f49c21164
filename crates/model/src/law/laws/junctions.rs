//! Many junctions per contact ([`crate::law::junctions`]), as loops over contacts see them.

use crate::scenario::choices::JunctionStart;
pub(super) use crate::law::junctions::Junctions;
use crate::law::{ContactLaw, Sliding, Turn};
use crate::scenario::Scenario;

/// In the loops over contacts, a contact of this law is free: its junctions pull at it from outside, and decide
/// whether it slides.
impl ContactLaw for Junctions {
    const KEYS: &'static [&'static str] = &[
        "friction.junction_count",
        "friction.junction_constant_n_per_m2",
        "friction.healing_time_s",
        "friction.healing_deviation_s",
        "friction.junction_width",
        "friction.junction_start",
        "friction.junction_seed",
        "friction.sliding_share",
    ];

    fn of(scenario: &Scenario) -> Junctions {
        let friction = &scenario.friction;
        Junctions {
            count: friction.junction_count as usize,
            constant_n_per_m2: friction.junction_constant_n_per_m2,
            healing_time_s: friction.healing_time_s,
            healing_deviation_s: friction.healing_deviation_s,
            width: friction.junction_width,
            are_drawn: friction.junction_start == JunctionStart::Drawn,
            seed: friction.junction_seed,
            sliding_share: friction.sliding_share,
        }
    }

    #[inline(always)]
    fn drag_n(&self, _: &Sliding<'_>) -> [f64; 1] {
        [0.0]
    }

    #[inline(always)]
    fn re_attaches(&self, _: &Turn) -> bool {
        false
    }
}
