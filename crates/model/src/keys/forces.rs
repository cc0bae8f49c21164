//! The keys of drive, normal load, prestress and start.

use asperity_record::bounds::{LONGEST_NAME_BYTES, LONGEST_STATE_BYTES};

use crate::key::Bound::{Excluding, Including, Open};
use crate::key::Default::Is;
use crate::key::Kind::{Count, Number, Numbers, Text, Word};
use crate::key::{Key, MOST_ROWS, NOT_NEGATIVE, POSITIVE, Value};

/// Default `k_f / k` of a slab and a body.
pub(crate) const FOUNDATION_RATIO: f64 = 0.5;

/// No contact bears more than a few times its normal load; far beyond that forces overflow.
pub(crate) const MOST_SHEAR_RATIO: f64 = 1e6;

/// In the order in which they are shown.
pub(super) const FORCES: &[Key] = &[
    Key {
        path: "drive.kind",
        symbol: "",
        doc: "Where the drive pulls: side, block 1 (5.8), over an area all rows across with K / N_y each; top, every \
              block, or every node at the top of a slab or a body, with K over their number each (5.53); left-right, \
              block 1 backwards and block N forwards, with K each; force, block 1 of a chain by the force course_n, without a \
              spring, as by a weight. Its springs are measured from the grid of the \
              undeformed slider, so with initial shear F_T is not quite 0 at the start; in a slab and a body they are \
              relaxed where it rests under its load.",
        kind: Word(&["side", "top", "left-right", "force"]),
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
        doc: "Times of a piecewise-linear course of the velocity of the drive point of a chain, not descending, each a \
              whole number of steps; two equal times are a step of the velocity. Empty for a constant velocity.",
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
        path: "drive.course_n",
        symbol: "",
        doc: "Of a drive by force: forces at the times course_s, not descending, linear between them; before the first \
              and after the last the force is constant.",
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
        path: "normal_load.course_csv",
        symbol: "",
        doc: "A file of columns time_s, x_over_l and factor, named from the current folder, with a profile along the \
              chain at each of its times. The normal load of each block is multiplied with the factor, interpolated \
              linearly in place and time; a part that is unloaded, or fluid that spreads. It is read once; the run's \
              log holds what it said.",
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "normal_load.course_s",
        symbol: "",
        doc: "Times of such a course, ascending, each a whole number of steps; empty for none.",
        kind: Numbers(Including(0.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "normal_load.course_factor",
        symbol: "",
        doc: "Factors on the normal load at these times: one for all blocks, or one for each block, time by time.",
        kind: Numbers(Excluding(0.0), Open),
        default: Is(Value::NoNumbers),
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
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "initial_shear.profile",
        symbol: "tau_0 / p",
        doc: "Initial shear over normal load, block by block, in addition; empty for none. The last block takes \
              what is missing for a sum of 0.",
        kind: Numbers(Including(-MOST_SHEAR_RATIO), Including(MOST_SHEAR_RATIO)),
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
        kind: Text(LONGEST_NAME_BYTES),
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
        path: "prestress.course_csv",
        symbol: "",
        doc: "A file of columns time_s, x_over_l and ratio, named from the current folder, with a profile along the \
              chain at each of its times: a force from outside on each block over its normal load at the start, in \
              addition, interpolated linearly in place and time. It is read once; the run's log holds what it said.",
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "prestress.course_s",
        symbol: "",
        doc: "Times of such a course, ascending, each a whole number of steps; empty for none.",
        kind: Numbers(Including(0.0), Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "prestress.course_ratio",
        symbol: "",
        doc: "Ratios at these times: one for all blocks, or one for each block, time by time.",
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
        path: "initial.from",
        symbol: "",
        doc: "The log of a run, named from the current folder, in whose state this one begins: that of its end, or of \
              initial.at_s. Slider, friction law and time step must be the same; load, drive, other numbers of \
              friction, duration and recording may be others. The clock goes on, and time.start, initial_shear and \
              initial_velocity have no effect. The log is read once; initial.state holds what it said.",
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "initial.at_s",
        symbol: "",
        doc: "The time of that state, a whole number of steps; of initial.from, 0 for its end. Of a state in a table or \
              in lists, the time on the clock at which the run begins, with the drive point at V t.",
        kind: NOT_NEGATIVE,
        default: Is(Value::Number(0.0)),
    },
    Key {
        path: "initial.state",
        symbol: "",
        doc: "The state itself, as this program writes it: a checksum, and exact numbers; empty for none.",
        kind: Text(LONGEST_STATE_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "initial.state_csv",
        symbol: "",
        doc: "A file with a row for each block of a chain and the columns displacement_m, velocity_m_per_s, \
              stick_position_m (of its friction spring) and slides (0 or 1), named from the current folder. It is read \
              once; the lists below hold what it said.",
        kind: Text(LONGEST_NAME_BYTES),
        default: Is(Value::Text("")),
    },
    Key {
        path: "initial.displacement_m",
        symbol: "u",
        doc: "Displacement of each block of a chain at the start; empty for none.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "initial.velocity_m_per_s",
        symbol: "v",
        doc: "Velocity of each block, beside initial.displacement_m; empty for rest.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "initial.stick_position_m",
        symbol: "u_stick",
        doc: "Anchor of the friction spring of each block, beside initial.displacement_m; empty for springs that hold \
              the blocks where they are.",
        kind: Numbers(Open, Open),
        default: Is(Value::NoNumbers),
    },
    Key {
        path: "initial.sliding_blocks",
        symbol: "",
        doc: "Blocks that slide at the start, counted from 1, ascending, beside initial.displacement_m; empty for none.",
        kind: Numbers(Including(1.0), Open),
        default: Is(Value::NoNumbers),
    },
];
