//! The keys of drive, normal load, prestress and start.

use std::ops::Bound::{Excluded, Included, Unbounded};

use asperity_record::bounds::{LONGEST_NAME_BYTES, LONGEST_STATE_BYTES};

use super::section::section;
use crate::law::laws::FrictionLaw;
use crate::scenario::choices::DriveKind::{self, Force, LeftRight, Side, Top};
use crate::scenario::choices::ScheduleFrom;
use crate::scenario::key::Kind::{self, Count, Number, Numbers, Text, Word};
use crate::scenario::key::Need::{Blocks, Chain, Drives, Laws, Rows, RowsAcross};
use crate::scenario::key::{MOST_ROWS, NOT_NEGATIVE, Need, POSITIVE};
use crate::scenario::keys::List;

/// No contact bears more than a few times its normal load; far beyond that forces overflow.
const MOST_SHEAR_RATIO: f64 = 1e6;
const SHEAR_RATIO: Kind = Number(Included(-MOST_SHEAR_RATIO), Included(MOST_SHEAR_RATIO));
const SHEAR_RATIOS: Kind = Numbers(Included(-MOST_SHEAR_RATIO), Included(MOST_SHEAR_RATIO));

/// Why what varies along a chain needs more than one block.
const ALONG: &str = "it varies from the first block to the last, and one block is both";

const CONSTANT: &[(Need, &str)] = &[(Chain, "its drive has a constant velocity, until it stops")];
const VELOCITY: &[(Need, &str)] =
    &[CONSTANT[0], (Drives(&[Side, Top, LeftRight]), "a drive by force has no velocity")];
const TOP: &[(Need, &str)] =
    &[(Drives(&[Top]), "this drive has no springs along the slider"), (Blocks, ALONG)];
const STOP: &[(Need, &str)] = &[
    (Drives(&[Side, Top, Force]), "the forces of a left-right drive add up to nothing"),
    (Laws(FrictionLaw::sticks), "the steps of the adaptive solver end at drive.hold_from_s, not at a load"),
];
const LOADS: &[(Need, &str)] = &[
    (Chain, "courses of single contacts are those of a chain"),
    (Laws(|law| !matches!(law, FrictionLaw::Junctions)), "junctions have more than one state per contact"),
];
const SHEAR: &[(Need, &str)] = &[
    (
        Chain,
        "the shear of a slab and a body at rest follows from their load and their elasticity (Poisson's ratio 1/3 and 1/4), \
         and the load of a sheet does not stretch it",
    ),
    (Blocks, "shear at the start adds up to 0 over all blocks, and one block has none"),
    (Laws(FrictionLaw::sticks), STEADY),
];
const STEADY: &str = "shear and velocities at the start follow from time.start";
const OUTSIDE: &[(Need, &str)] = &[(Chain, "the only force from outside on this body is its normal load")];
const MOVES: &[(Need, &str)] = &[
    (Chain, "it is that of a mode of a chain, and this body begins at rest"),
    (Laws(FrictionLaw::sticks), STEADY),
    (Laws(|law| law.sticks() && !law.holds()), "blocks that stick without springs do not move"),
];

section! {
    /// `[drive]`
    Drive "drive." {
        /// Where the drive pulls: side, block 1 (5.8), over an area all rows across with K / N_y each; top, every
        /// block, or every node at the top of a slab or a body, with K over their number each (5.53); left-right, block
        /// 1 backwards and block N forwards, with K each; force, block 1 of a chain by the force course_n, without a
        /// spring, as by a weight; plate, what is below a fault line in a medium, and its only drive. Its springs are measured from the grid of the undeformed slider, so with initial
        /// shear F_T is not quite 0 at the start; in a slab and a body they are relaxed where it rests under its load.
        kind: DriveKind = "side"; Word(DriveKind::WORDS);
        /// Stiffness of the driving spring on block 1 (5.8), of all springs of a top drive together, or of each of a
        /// left-right drive.
        stiffness_n_per_m: f64 = 8e5; NOT_NEGATIVE, "K";
        /// Velocity of the drive point; with a course, that of the start.
        velocity_m_per_s: f64 = 1e-4; NOT_NEGATIVE, "V";
        /// Times of a piecewise-linear course of the velocity of the drive point of a chain, not descending, each a
        /// whole number of steps; two equal times are a step of the velocity. Empty for a constant velocity.
        course_s: List = List::new(); Numbers(Included(0.0), Unbounded); needs CONSTANT;
        /// Velocities at these times, below 0 backwards, the first being velocity_m_per_s; before the first and after
        /// the last the velocity is constant.
        course_m_per_s: List = List::new(); Numbers(Unbounded, Unbounded); needs VELOCITY;
        /// Of a drive by force: forces at the times course_s, not descending, linear between them; before the first and
        /// after the last the force is constant.
        course_n: List = List::new(); Numbers(Unbounded, Unbounded);
        needs &[(Drives(&[Force]), "a drive by springs has no course of its force")];
        /// Of a top drive: K_n = K / N (1 - tilt (2n - N - 1) / (N - 1)); positive pulls harder where a side drive
        /// would.
        tilt: f64 = 0.0; Number(Included(-1.0), Included(1.0)); needs TOP;
        /// Of a top drive: K_n falls along the slider as exp(-x_n / length), all together K, as if shear came in from
        /// the side; 0 for even.
        decay_length_m: f64 = 0.0; NOT_NEGATIVE; needs TOP;
        /// Of a side drive over an area: the row across, from 1, whose first node alone it pulls with all of K; 0 for
        /// all rows alike.
        across: u32 = 0; Count(0, MOST_ROWS);
        needs &[(RowsAcross, "there is one row of contacts"), (Drives(&[Side]), "this drive pulls all rows alike")];
        /// Of a side drive of a slab or a body: the height above the bottom at which it pulls the first nodes of the
        /// nearest row or layer; 0 is block 1.
        height_m: f64 = 0.0; NOT_NEGATIVE, "h";
        needs &[(Rows, "there is no height to pull at"), (Drives(&[Side]), "this drive pulls where its name says")];
        /// Time from which the drive point stands still, a whole number of steps; 0 for never.
        hold_from_s: f64 = 0.0; NOT_NEGATIVE;
        /// Load at which the drive point stops and stands still from then on; 0 for never.
        until_load_ratio: f64 = 0.0; NOT_NEGATIVE, "F_T / F_N"; needs STOP;
    }
}

section! {
    /// `[normal_load]`
    NormalLoad "normal_load." {
        /// Total normal load on the slider.
        total_n: f64 = 400.0; POSITIVE, "F_N";
        /// Tilt of the load along the slider, p_n = F_N / N (1 - theta (2n - N - 1) / (N - 1)) (5.18), on a slab and a
        /// body that of the nodes at the top: positive puts more load on the driven end. At -1 and 1 an end block bears
        /// nothing, switches in nearly every step, and the run takes long.
        tilt: f64 = 0.0; Number(Included(-1.0), Included(1.0)), "theta";
        needs &[(Blocks, "it shifts load from one block to another, and there is one")];
        /// Of a slab or a body: stiffness of the foundation that bears each contact, p_n = -k_f u_z, over that between
        /// nodes; a contact that has lifted off bears nothing.
        foundation_stiffness_ratio: f64 = 0.5; POSITIVE, "k_f / k";
        needs &[(Rows, "there is no foundation")];
        /// Times of a piecewise-linear course of the total load, ascending, each a whole number of steps; empty for a
        /// constant load (6.1-6.3).
        schedule_s: List = List::new(); Numbers(Included(0.0), Unbounded);
        /// Total loads at these times, the first being total_n; before the first and after the last the load is
        /// constant.
        schedule_n: List = List::new(); Numbers(Excluded(0.0), Unbounded);
        /// What schedule_s counts from: start, of the run; hold, the step in which the drive stops.
        schedule_from: ScheduleFrom = "start"; Word(ScheduleFrom::WORDS);
        /// A file of columns time_s, x_over_l and factor, named from the current folder, with a profile along the chain
        /// at each of its times. The normal load of each block is multiplied with the factor, interpolated linearly in
        /// place and time; a part that is unloaded, or fluid that spreads. It is read once; the run's log holds what it
        /// said.
        course_csv: String = ""; Text(LONGEST_NAME_BYTES); needs &[LOADS[0], LOADS[1], (Blocks, ALONG)];
        /// Times of such a course, ascending, each a whole number of steps; empty for none.
        course_s: List = List::new(); Numbers(Included(0.0), Unbounded); needs LOADS;
        /// Factors on the normal load at these times: one for all blocks, or one for each block, time by time.
        course_factor: List = List::new(); Numbers(Excluded(0.0), Unbounded); needs LOADS;
    }
}

section! {
    /// `[initial_shear]`
    InitialShear "initial_shear." {
        /// Amplitude of the initial shear profile tau_0 = beta p (2x / L - 1) (5.50), balanced by the friction springs;
        /// that of the last block also takes what a profile does not add up to 0 by, as with a tilt. Beyond mu_s p a
        /// block detaches in step 1.
        beta: f64 = 0.0; Number(Unbounded, Unbounded), "beta"; needs SHEAR;
        /// Shear that lateral expansion under the normal load leaves in a slider that friction holds: beta grows by 4
        /// nu L_z / L_x.
        poisson_ratio: f64 = 0.0; Number(Included(0.0), Included(0.5)), "nu"; needs SHEAR;
        /// A file of columns x_over_l and tau_over_p, named from the current folder. The initial shear tau_0 / p is
        /// interpolated between its rows and added. It is read once; the run's log holds what it said.
        profile_csv: String = ""; Text(LONGEST_NAME_BYTES); needs SHEAR;
        /// Initial shear over normal load, block by block, in addition; empty for none. The last block takes what is
        /// missing for a sum of 0.
        profile: List = List::new(); SHEAR_RATIOS, "tau_0 / p"; needs SHEAR;
    }
}

section! {
    /// `[prestress]`
    Prestress "prestress." {
        /// A constant force from outside on each block, along the drive, over its normal load at the start; not part of
        /// F_T, and balanced by the friction springs at the start.
        ratio: f64 = 0.0; SHEAR_RATIO, "tau_p / p"; needs OUTSIDE;
        /// A further force of that kind on block 1 alone, as starts a front, over its normal load.
        first_block_ratio: f64 = 0.0; SHEAR_RATIO; needs OUTSIDE;
        /// By how much the prestress over the normal load rises, evenly, from the first block to the last; below 0 it
        /// falls.
        rise_ratio: f64 = 0.0; SHEAR_RATIO; needs &[OUTSIDE[0], (Blocks, ALONG)];
        /// Blocks at which the prestress steps, as at a barrier, counted from 1, ascending; empty for none.
        from_blocks: List = List::new(); Numbers(Included(1.0), Unbounded); needs OUTSIDE;
        /// A further constant force on each of these blocks and those up to the next one, over the normal load.
        from_blocks_ratio: List = List::new(); SHEAR_RATIOS;
        /// A file of columns x_over_l and tau_over_p, named from the current folder. The prestress tau_p / p is
        /// interpolated between its rows and added. It is read once; the run's log holds what it said.
        profile_csv: String = ""; Text(LONGEST_NAME_BYTES); needs &[OUTSIDE[0], (Blocks, ALONG)];
        /// Prestress over normal load, block by block, in addition; empty for none.
        profile: List = List::new(); SHEAR_RATIOS; needs OUTSIDE;
        /// A file of columns time_s, x_over_l and ratio, named from the current folder, with a profile along the chain
        /// at each of its times: a force from outside on each block over its normal load at the start, in addition,
        /// interpolated linearly in place and time; of a single block one row at each time. It is read once; the run's
        /// log holds what it said.
        course_csv: String = ""; Text(LONGEST_NAME_BYTES); needs LOADS;
        /// Times of such a course, not descending, each a whole number of steps; two equal times are a jump. Empty for
        /// none.
        course_s: List = List::new(); Numbers(Included(0.0), Unbounded); needs LOADS;
        /// Ratios at these times: one for all blocks, or one for each block, time by time.
        course_ratio: List = List::new(); SHEAR_RATIOS; needs LOADS;
        /// Of rate-and-state: amplitude of a force r p sin(2 pi (t - t_0) / P) from outside on each block, in addition,
        /// from swing_from_s on, over its normal load at the start. The steps of the solver are at most P / 20.
        swing_ratio: f64 = 0.0; SHEAR_RATIO, "r";
        /// Its period, at least time.step_s; 0 without a swing.
        swing_period_s: f64 = 0.0; NOT_NEGATIVE, "P";
        /// When it begins, a whole number of steps.
        swing_from_s: f64 = 0.0; NOT_NEGATIVE, "t_0";
    }
}

section! {
    /// `[initial_velocity]`
    InitialVelocity "initial_velocity." {
        /// Amplitude of one free-chain mode of velocity given to the blocks at the start.
        amplitude_m_per_s: f64 = 0.0; Number(Unbounded, Unbounded); needs MOVES;
        /// Which mode: v_n = amplitude cos(pi j (n - 1/2) / N), with 0 <= j <= N - 1; N - 1 is the shortest wave. A
        /// single block that moves at the start needs 0.
        mode: u32 = 1; Count(0, 99_999), "j";
    }
}

section! {
    /// `[initial]`
    Initial "initial." {
        /// The log of a run, named from the current folder, in whose state this one begins: that of its end, or of
        /// initial.at_s. Slider, friction law and time step must be the same; load, drive, other numbers of friction,
        /// duration and recording may be others. The clock goes on, and time.start, initial_shear and initial_velocity
        /// have no effect. The log is read once; initial.state holds what it said.
        from: String = ""; Text(LONGEST_NAME_BYTES);
        /// The time of that state, a whole number of steps; of initial.from, 0 for its end, or the end of what is sound of
        /// an unfinished log. Of a state in a table or in lists, the time on the clock at which the run begins, with the
        /// drive point at V t.
        at_s: f64 = 0.0; NOT_NEGATIVE;
        /// The state itself, as this program writes it: a checksum, and exact numbers; empty for none.
        state: String = ""; Text(LONGEST_STATE_BYTES);
        /// A file with a row for each block of a chain and the columns displacement_m, velocity_m_per_s,
        /// stick_position_m (of its friction spring) and slides (0 or 1), named from the current folder. It is read
        /// once; the lists below hold what it said.
        state_csv: String = ""; Text(LONGEST_NAME_BYTES);
        /// Displacement of each block of a chain at the start; empty for none.
        displacement_m: List = List::new(); Numbers(Unbounded, Unbounded), "u";
        /// Velocity of each block, beside initial.displacement_m; empty for rest.
        velocity_m_per_s: List = List::new(); Numbers(Unbounded, Unbounded), "v";
        /// Anchor of the friction spring of each block, beside initial.displacement_m; empty for springs that hold the
        /// blocks where they are.
        stick_position_m: List = List::new(); Numbers(Unbounded, Unbounded), "u_stick";
        /// Blocks that slide at the start, counted from 1, ascending, beside initial.displacement_m; empty for none.
        sliding_blocks: List = List::new(); Numbers(Included(1.0), Unbounded);
    }
}
