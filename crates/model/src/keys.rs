//! Every key of a scenario, declared once.
//!
//! The table is the single definition of valid keys: resolving checks against it, `asperity scenario show`
//! comments with it, and a test compares it with the fields of [`Scenario`](crate::Scenario).

use asperity_record::MOST_BLOCKS;

use crate::laws::{self, FrictionLaw};

pub use crate::drawn_keys::DRAWN_KEYS;
pub use crate::key::{AS_CODED, AS_STATED, Bound, Default, Key, Kind, PARAMETER_SETS, Value};
pub(crate) use crate::key::{LEAST_MAGNITUDE, MOST_MAGNITUDE, NOT_NEGATIVE, POSITIVE};

use Bound::{Excluding, Including, Open};
use Default::{BySet, Is};
use Kind::{Count, Flag, Number, Numbers, Text, Word};

/// Default `k_f / k` of a slab and a body.
pub(crate) const FOUNDATION_RATIO: f64 = 0.5;

/// Most nodes upwards, and most across the sliding direction.
const MOST_ROWS: u64 = 10_000;
/// Most junctions of a contact.
const MOST_JUNCTIONS: u64 = 10_000;

/// Largest kick of a start, `ln(V / V_l)`: from nanometres to kilometres per second.
const MOST_KICK: f64 = 30.0;

/// No contact bears more than a few times its normal load; far beyond that forces overflow.
pub(crate) const MOST_SHEAR_RATIO: f64 = 1e6;

/// All keys, in the order in which they are shown.
pub const KEYS: &[Key] = &[
    Key {
        path: "name",
        symbol: "",
        doc: "Name of the scenario; does not affect the run.",
        kind: Text,
        default: Is(Value::Text("unnamed")),
    },
    Key {
        path: "summary",
        symbol: "",
        doc: "One line on what it is for; does not affect the run.",
        kind: Text,
        default: Is(Value::Text("")),
    },
    Key {
        path: "parameter_set",
        symbol: "",
        doc: "Parameter set, which gives the defaults of mass and damping: as-stated follows the text of \
              the thesis, a slider of 0.012 kg; as-coded follows the computations of its program, a slider \
              of 12 kg, because the units of the program were inconsistent by a factor of 1000 \
              (docs/model.md).",
        kind: Word(PARAMETER_SETS),
        default: Is(Value::Text(AS_STATED)),
    },
    Key {
        path: "slider.blocks",
        symbol: "N",
        doc: "Number of blocks in the chain, 1 for a block on its driving spring; of a slab, a sheet and a body, \
              number of nodes along the sliding direction, and so of contacts in a row, from 2.",
        kind: Count(1, MOST_BLOCKS),
        default: Is(Value::Count(100)),
    },
    Key {
        path: "slider.across",
        symbol: "N_y",
        doc: "Rows of contacts across the sliding direction: 1 for a chain or a slab, more for a sheet, or with \
              slider.rows above 1 for a body (docs/area.md).",
        kind: Count(1, MOST_ROWS),
        default: Is(Value::Count(1)),
    },
    Key {
        path: "slider.rows",
        symbol: "N_z",
        doc: "Rows of nodes, one above the other: 1 for a chain or a sheet, more for a slab (docs/slab.md) or a body; \
              the nodes at the bottom rub.",
        kind: Count(1, MOST_ROWS),
        default: Is(Value::Count(1)),
    },
    Key {
        path: "slider.length_m",
        symbol: "L_x",
        doc: "Length of the slider in the direction of sliding; the spacing is a = L / (N - 1), L of a single block.",
        kind: POSITIVE,
        default: Is(Value::Number(0.1)),
    },
    Key {
        path: "slider.width_m",
        symbol: "L_y",
        doc: "Width of the slider; over an area, L_y / (N_y - 1) must be the spacing a.",
        kind: POSITIVE,
        default: Is(Value::Number(0.005)),
    },
    Key {
        path: "slider.height_m",
        symbol: "L_z",
        doc: "Height of the slider; of a slab and of a body, L_z / (N_z - 1) must be the spacing a; of a sheet, its \
              thickness.",
        kind: POSITIVE,
        default: Is(Value::Number(0.02)),
    },
    Key {
        path: "slider.mass_kg",
        symbol: "M",
        doc: "Mass of the whole slider; the blocks of a chain share it evenly, m = M / N, and so do the nodes of \
              other sliders.",
        kind: POSITIVE,
        default: BySet { as_coded: Value::Number(12.0), as_stated: Value::Number(0.012) },
    },
    Key {
        path: "slider.youngs_modulus_pa",
        symbol: "E",
        doc: "Young's modulus; the springs between blocks have k = E (N - 1) L_y L_z / L_x (5.5), those of a slab \
              k = 3 E L_y / 4, of a sheet k = 3 E L_z / 4, both k / 2 along diagonals, those of a body k = 0.4 E a. A \
              single block has no such spring; of its k = E L_y L_z / L_x there follow k_t and the wave speed.",
        kind: POSITIVE,
        default: Is(Value::Number(2.5e9)),
    },
    Key {
        path: "slider.relative_damping",
        symbol: "eta / sqrt(k m)",
        doc: "Viscous damping between neighbours (5.7) over its critical value sqrt(k m) (5.31).",
        kind: NOT_NEGATIVE,
        default: BySet { as_coded: Value::Number(3.162_277_660_168_379_5), as_stated: Value::Number(0.1) },
    },
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
        path: "friction.weakening_velocity_m_per_s",
        symbol: "v_c",
        doc: "Of velocity-weakening: sliding friction is mu_d p / (1 + |v| / v_c) (2.4).",
        kind: POSITIVE,
        default: Is(Value::Number(0.1)),
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
              to where it falls below V_th / 2. Must exceed the largest speed of the drive; 0 for 10 times that. Never \
              changes the run, but onsets and durations of events depend on it.",
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
        doc: "Half the width of a uniform random spread that is added to mu_s, block by block; what was drawn \
              stands in the table drawn.",
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
    Key {
        path: "drive.kind",
        symbol: "",
        doc: "Where the drive pulls: side, block 1 (5.8), over an area all rows across with K / N_y each; top, every \
              block, or every node at the top of a slab or a body, with K over their number each (5.53); left-right, \
              block 1 backwards and block N forwards, with K each. Its springs are measured from the grid of the \
              undeformed slider, so with initial shear F_T is not quite 0 at the start; in a slab and a body they are \
              relaxed where it rests under its load.",
        kind: Word(&["side", "top", "left-right"]),
        default: Is(Value::Text("side")),
    },
    Key {
        path: "drive.stiffness_n_per_m",
        symbol: "K",
        doc: "Stiffness of the driving spring on block 1 (5.8), of all springs of a top drive together, or of each of \
              a left-right drive.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(8e5)),
    },
    Key {
        path: "drive.velocity_m_per_s",
        symbol: "V",
        doc: "Velocity of the drive point; with a course, that of the start.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(1e-4)),
    },
    Key {
        path: "drive.course_s",
        symbol: "",
        doc: "Of rate-and-state: times of a piecewise-linear course of the velocity of the drive point, not descending, \
              each a whole number of steps; two equal times are a step of the velocity. Empty for a constant velocity.",
        kind: Numbers(Including(0.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "drive.course_m_per_s",
        symbol: "",
        doc: "Velocities at these times, below 0 backwards, the first being velocity_m_per_s; before the first and \
              after the last the velocity is constant.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "drive.tilt",
        symbol: "",
        doc: "Of a top drive: K_n = K / N (1 - tilt (2n - N - 1) / (N - 1)); positive pulls harder where \
              a side drive would.",
        kind: Number(Including(-1.0), Including(1.0)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "drive.decay_length_m",
        symbol: "",
        doc: "Of a top drive: K_n falls along the slider as exp(-x_n / length), all together K, as if \
              shear came in from the side; 0 for even.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "drive.across",
        symbol: "",
        doc: "Of a side drive over an area: the row across, from 1, whose first node alone it pulls with all of K; 0 \
              for all rows alike.",
        kind: Count(0, MOST_ROWS),
        default: Is(Value::Count(0)),
    },
    Key {
        path: "drive.height_m",
        symbol: "h",
        doc: "Of a side drive of a slab or a body: the height above the bottom at which it pulls the first nodes of \
              the nearest row or layer; 0 is block 1.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "drive.hold_from_s",
        symbol: "",
        doc: "Time from which the drive point stands still, a whole number of steps; 0 for never.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "drive.until_load_ratio",
        symbol: "F_T / F_N",
        doc: "Load at which the drive point stops and stands still from then on; 0 for never.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "normal_load.total_n",
        symbol: "F_N",
        doc: "Total normal load on the slider.",
        kind: POSITIVE,
        default: Is(Value::Number(400.0)),
    },
    Key {
        path: "normal_load.tilt",
        symbol: "theta",
        doc: "Tilt of the load along the slider, p_n = F_N / N (1 - theta (2n - N - 1) / (N - 1)) (5.18), on a slab and \
              a body that of the nodes at the top: positive puts more load on the driven end. At -1 and 1 an end \
              block bears nothing, switches in nearly every step, and the run takes long.",
        kind: Number(Including(-1.0), Including(1.0)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "normal_load.foundation_stiffness_ratio",
        symbol: "k_f / k",
        doc: "Of a slab or a body: stiffness of the foundation that bears each contact, p_n = -k_f u_z, over that \
              between nodes; a contact that has lifted off bears nothing.",
        kind: POSITIVE,
        default: Is(Value::Number(FOUNDATION_RATIO)),
    },
    Key {
        path: "normal_load.schedule_s",
        symbol: "",
        doc: "Times of a piecewise-linear course of the total load, ascending, each a whole number of \
              steps; empty for a constant load (6.1-6.3).",
        kind: Numbers(Including(0.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "normal_load.schedule_n",
        symbol: "",
        doc: "Total loads at these times, the first being total_n; before the first and after the last the load is constant.",
        kind: Numbers(Excluding(0.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "normal_load.schedule_from",
        symbol: "",
        doc: "What schedule_s counts from: start, of the run; hold, the step in which the drive stops.",
        kind: Word(&["start", "hold"]),
        default: Is(Value::Text("start")),
    },
    Key {
        path: "initial_shear.beta",
        symbol: "beta",
        doc: "Amplitude of the initial shear profile tau_0 = beta p (2x / L - 1) (5.50), \
              balanced by the friction springs; that of the last block also takes what a profile does not add up to \
              0 by, as with a tilt. Beyond mu_s p a block detaches in step 1.",
        kind: Number(Open, Open),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "initial_shear.poisson_ratio",
        symbol: "nu",
        doc: "Shear that lateral expansion under the normal load leaves in a slider that friction holds: \
              beta grows by 4 nu L_z / L_x.",
        kind: Number(Including(0.0), Including(0.5)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "initial_shear.profile_csv",
        symbol: "",
        doc: "A file of columns x_over_l and tau_over_p, named from the current folder. The initial shear tau_0 / p is \
              interpolated between its rows and added. It is read once; the run's log holds what it said.",
        kind: Text,
        default: Is(Value::Text("")),
    },
    Key {
        path: "initial_shear.profile",
        symbol: "tau_0 / p",
        doc: "Initial shear over normal load, block by block, in addition; empty for none. The last block takes \
              what is missing for a sum of 0.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "prestress.ratio",
        symbol: "tau_p / p",
        doc: "A constant force from outside on each block, along the drive, over its normal load at the start; not \
              part of F_T, and balanced by the friction springs at the start.",
        kind: Number(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "prestress.first_block_ratio",
        symbol: "",
        doc: "A further force of that kind on block 1 alone, as starts a front, over its normal load.",
        kind: Number(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "prestress.rise_ratio",
        symbol: "",
        doc: "By how much the prestress over the normal load rises, evenly, from the first block to the last; below 0 \
              it falls.",
        kind: Number(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "prestress.from_blocks",
        symbol: "",
        doc: "Blocks at which the prestress steps, as at a barrier, counted from 1, ascending; empty for none.",
        kind: Numbers(Including(1.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "prestress.from_blocks_ratio",
        symbol: "",
        doc: "A further constant force on each of these blocks and those up to the next one, over the normal load.",
        kind: Numbers(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "prestress.profile_csv",
        symbol: "",
        doc: "A file of columns x_over_l and tau_over_p, named from the current folder. The prestress tau_p / p is \
              interpolated between its rows and added. It is read once; the run's log holds what it said.",
        kind: Text,
        default: Is(Value::Text("")),
    },
    Key {
        path: "prestress.profile",
        symbol: "",
        doc: "Prestress over normal load, block by block, in addition; empty for none.",
        kind: Numbers(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "initial_velocity.amplitude_m_per_s",
        symbol: "",
        doc: "Amplitude of one free-chain mode of velocity given to the blocks at the start.",
        kind: Number(Open, Open),
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "initial_velocity.mode",
        symbol: "j",
        doc: "Which mode: v_n = amplitude cos(pi j (n - 1/2) / N), with 0 <= j <= N - 1; \
              N - 1 is the shortest wave. A single block that moves at the start needs 0.",
        kind: Count(0, 99_999),
        default: Is(Value::Count(1)),
    },
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
        doc: "Simulated time, a whole number of steps.",
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
    Key {
        path: "recording.energies",
        symbol: "",
        doc: "Without effect: every step record has the energies of the whole slider. In older versions, \
              the value none left them out.",
        kind: Word(&["every-record", "none"]),
        default: Is(Value::Text("every-record")),
    },
];
