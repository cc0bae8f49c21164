//! The keys of friction.

use crate::key::Bound::{Excluding, Including, Open};
use crate::key::Default::Is;
use crate::key::Kind::{Count, Flag, Number, Numbers, Word};
use crate::key::{Key, NOT_NEGATIVE, POSITIVE, Value};
use crate::laws::{self, FrictionLaw};

/// Most junctions of a contact.
const MOST_JUNCTIONS: u64 = 10_000;
/// Largest kick of a start, `ln(V / V_l)`: from nanometres to kilometres per second.
const MOST_KICK: f64 = 30.0;

/// In the order in which they are shown.
pub(super) const FRICTION: &[Key] = &[
    Key {
        path: "friction.law",
        symbol: "",
        doc: laws::MEANING,
        kind: Word(FrictionLaw::WORDS),
        default: Is(Value::Text("interfacial-springs")),
    },
    Key {
        path: "friction.static_coefficient",
        symbol: "mu_s",
        doc: "A stuck block detaches at |tau_n| >= mu_s p_n; a junction breaks at mu_s of its load.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.7)),
    },
    Key {
        path: "friction.dynamic_coefficient",
        symbol: "mu_d",
        doc: "A sliding block feels -mu_d p_n sign(v_n), a slipping junction mu_d of its load; not above static_coefficient.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.45)),
    },
    Key {
        path: "friction.interfacial_stiffness_ratio",
        symbol: "k_t / k",
        doc: "Stiffness of the friction spring of a stuck block (5.12) over that between blocks.",
        kind: POSITIVE,
        default: Is(Value::Number(1.0)),
    },
    Key {
        path: "friction.reattach",
        symbol: "",
        doc: "When a sliding block re-attaches: one-way, at a new velocity <= 0 (the thesis' program); \
              two-way, where the velocity changes sign or vanishes, and so after one step if it has never \
              moved; turn, over an area and only there, where the velocity has turned by a right angle or more from \
              the direction of the slip. The laws rigid and velocity-weakening are two-way: there a block stops \
              where its velocity changes sign, and goes on from exactly 0.",
        kind: Word(&["one-way", "two-way", "turn"]),
        default: Is(Value::Text("one-way")),
    },
    Key {
        path: "friction.detach_by",
        symbol: "",
        doc: "Of interfacial-springs: which force detaches a stuck block where it reaches mu_s p_n: force, the sum |tau_n| \
              of all forces but friction (5.13); spring, that of its friction spring, |k_t (u_n - u_stick,n)|. At rest \
              they are equal; before a front tau_n is larger. Of chains and single blocks.",
        kind: Word(&["force", "spring"]),
        default: Is(Value::Text("force")),
    },
    Key {
        path: "friction.weakening_velocity_m_per_s",
        symbol: "v_c",
        doc: "Of velocity-weakening: sliding friction is mu_d p / (1 + |v| / v_c) (2.4).",
        kind: POSITIVE,
        default: Is(Value::Number(0.1)),
    },
    Key {
        path: "friction.drag_at_rest",
        symbol: "",
        doc: "Of rigid and velocity-weakening: whether mu_d p resists a block from the first step of its slip, in which it begins \
              at rest. Otherwise nothing resists in that step, which adds mu_d p dt / m to its velocity: small \
              beside a slip of mu_s - mu_d, unless the two are nearly equal.",
        kind: Flag,
        default: Is(Value::Flag(false)),
    },
    Key {
        path: "friction.radiation_kg_per_s",
        symbol: "E",
        doc: "Damping -E v of a sliding block, as by waves that it radiates (2.4); of chains, not by junctions.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "friction.junction_count",
        symbol: "N_s",
        doc: "Of junctions: how many each contact has.",
        kind: Count(1, MOST_JUNCTIONS),
        default: Is(Value::Count(100)),
    },
    Key {
        path: "friction.junction_constant_n_per_m2",
        symbol: "kappa",
        doc: "Of junctions: one that bears the load f at rest is a spring of stiffness sqrt(kappa f).",
        kind: POSITIVE,
        default: Is(Value::Number(39.2e9)),
    },
    Key {
        path: "friction.healing_time_s",
        symbol: "t_R",
        doc: "Of junctions: mean time for which a broken one slips before it is pinned again. Ruptures link \
              detachments up to twice this time apart, or longer by detection.link_time_ratio.",
        kind: POSITIVE,
        default: Is(Value::Number(0.002)),
    },
    Key {
        path: "friction.healing_deviation_s",
        symbol: "",
        doc: "Of junctions: standard deviation of that time, which is normally distributed and above 0.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0006)),
    },
    Key {
        path: "friction.junction_width",
        symbol: "w",
        doc: "Of junctions: width of the uniform distribution of their forces at the start, over the load that each \
              bears.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.05)),
    },
    Key {
        path: "friction.junction_start",
        symbol: "",
        doc: "Of junctions: whether these forces are evenly spread or drawn.",
        kind: Word(&["even", "drawn"]),
        default: Is(Value::Text("even")),
    },
    Key {
        path: "friction.junction_seed",
        symbol: "",
        doc: "Of junctions: seed of the slip times and of a drawn start (docs/junctions.md), the same on every machine.",
        kind: Count(0, 4_294_967_295),
        default: Is(Value::Count(1)),
    },
    Key {
        path: "friction.sliding_share",
        symbol: "",
        doc: "Of junctions: a contact slides while at least this share of its junctions slips.",
        kind: Number(Excluding(0.0), Including(1.0)),
        default: Is(Value::Number(0.5)),
    },
    Key {
        path: "friction.direct_effect",
        symbol: "a",
        doc: "Of rate-and-state: the rise of friction over the normal load with the logarithm of the velocity, while \
              the state is the same.",
        kind: POSITIVE,
        default: Is(Value::Number(0.01)),
    },
    Key {
        path: "friction.evolution_effect",
        symbol: "b",
        doc: "Of rate-and-state: the rise of friction over the normal load with the logarithm of the state theta. \
              Steady friction falls with velocity where b > a.",
        kind: POSITIVE,
        default: Is(Value::Number(0.015)),
    },
    Key {
        path: "friction.evolution_offsets",
        symbol: "",
        doc: "Of rate-and-state: what is added to b, block by block; empty for nothing. Every sum is above 0.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "friction.critical_slip_m",
        symbol: "D_c",
        doc: "Of rate-and-state: the slip over which the state changes.",
        kind: POSITIVE,
        default: Is(Value::Number(1e-6)),
    },
    Key {
        path: "friction.reference_velocity_m_per_s",
        symbol: "V_0",
        doc: "Of rate-and-state: the velocity at which steady friction over the normal load is f_0.",
        kind: POSITIVE,
        default: Is(Value::Number(1e-6)),
    },
    Key {
        path: "friction.reference_coefficient",
        symbol: "f_0",
        doc: "Of rate-and-state: friction over the normal load in steady sliding at V_0.",
        kind: POSITIVE,
        default: Is(Value::Number(0.6)),
    },
    Key {
        path: "friction.evolution",
        symbol: "",
        doc: "Of rate-and-state, how the state theta changes: ageing, by 1 - |v| theta / D_c, at rest as well; slip, by \
              -(|v| theta / D_c) ln(|v| theta / D_c), by slip alone.",
        kind: Word(&["ageing", "slip"]),
        default: Is(Value::Text("ageing")),
    },
    Key {
        path: "friction.inertia",
        symbol: "",
        doc: "Of rate-and-state: whether blocks have inertia. Without it (quasi-dynamic) the forces on each block, \
              -E v among them, balance at every time; radiation_kg_per_s must be above 0 and \
              slider.relative_damping 0, and slider.mass_kg sets only the link time of ruptures and the \
              wave speed that front speeds are compared with.",
        kind: Flag,
        default: Is(Value::Flag(true)),
    },
    Key {
        path: "friction.initial_kick",
        symbol: "x",
        doc: "Of rate-and-state with time.start = \"loaded\": blocks begin at the velocity V e^x in the state of steady \
              sliding at V, the velocity of the drive, with springs that balance the friction of this start.",
        kind: Number(Including(-MOST_KICK), Including(MOST_KICK)),
        default: Is(Value::Number(0.01)),
    },
    Key {
        path: "friction.event_speed_m_per_s",
        symbol: "V_th",
        doc: "Of rate-and-state, which never sticks: a block counts as detached from where its speed rises above V_th \
              to where it falls below V_th / 2. Must exceed the speed of the drive at the start; 0 for 10 times the largest \
              speed of the drive, or less in a course with short fast parts (docs/rate-and-state.md). Never changes the \
              run, but onsets and durations of events depend on it.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "friction.ageing_coefficient",
        symbol: "b",
        doc: "Ageing of interfacial-springs: mu_s grows as mu_s + b ln(1 + t_w / t_0) with the time t_w \
              for which a block has stuck.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "friction.ageing_time_s",
        symbol: "t_0",
        doc: "Time scale of ageing.",
        kind: POSITIVE,
        default: Is(Value::Number(1.0)),
    },
    Key {
        path: "friction.static_offsets",
        symbol: "",
        doc: "What is added to mu_s, block by block; empty for nothing.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "friction.dynamic_offsets",
        symbol: "",
        doc: "What is added to mu_d, block by block; empty for nothing.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "friction.stuck_blocks",
        symbol: "",
        doc: "Blocks that never detach, unless nothing presses them, counted from 1, ascending: their mu_s is 1e6.",
        kind: Numbers(Including(1.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "friction.static_spread",
        symbol: "",
        doc: "Random spread that is added to mu_s, block by block: by disorder.distribution half the width, the standard \
              deviation, or half the distance of two values; what was drawn stands in the table drawn.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "friction.dynamic_spread",
        symbol: "",
        doc: "The same for mu_d.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "friction.spread_seed",
        symbol: "",
        doc: "Seed of the spread: SplitMix64 of seed and block (docs/internals/rules.md), the same on every \
              machine.",
        kind: Count(0, 4_294_967_295),
        default: Is(Value::Count(1)),
    },
];
