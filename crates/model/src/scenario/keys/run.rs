//! The keys of time, detection and recording.

use std::ops::Bound::{Included, Unbounded};

use asperity_record::MOST_BLOCKS;

use super::medium::MEDIUM;
use super::section::section;
use crate::scenario::choices::Start;
use crate::scenario::key::Kind::{Count, Flag, Number, Numbers, Word};
use crate::scenario::key::Need::{self, Laws};
use crate::scenario::key::{NOT_NEGATIVE, POSITIVE};
use crate::scenario::keys::List;

/// What series need.
const SOLVED: &[(Need, &str)] = &[(Laws(|law| !law.sticks()), "other solvers take the steps of the grid")];

section! {
    /// `[time]`
    Time "time." {
        /// Where the run begins: at-rest, at time 0; loaded, just before the first block would detach, as the stuck
        /// chain follows the drive in steady motion, step by step and with the lag of its damping: without the ramp,
        /// and without the vibration that it leaves. By rate-and-state: loaded, its default, at time 0 in steady
        /// sliding (friction.initial_kick); at-rest, with relaxed springs and the same state. In a medium: uniform, its
        /// default, at friction.initial_velocity_m_per_s or that of the drive, with the stress at all nodes at which the
        /// one with the largest a slides steadily so; steady, at a velocity as by loaded, with theta = r D_c / V.
        start: Start = "at-rest"; Word(Start::WORDS);
        /// Time step of the Euler-Cromer scheme (4.13, 4.14). `asperity scenario validate` says which is the longest
        /// stable one; beyond 0.4 of that, switches feed energy into the slider. By rate-and-state, whose solver
        /// chooses its steps, the grid to which times are rounded; in a medium 1e-3 by default.
        step_s: f64 = 1e-8; POSITIVE, "dt";
        /// Simulated time, a whole number of steps; of a run that begins in a given state, its end on the clock that
        /// goes on.
        duration_s: f64 = 5.0; POSITIVE, "T";
        /// Of rate-and-state: the relative error that the adaptive solver accepts in a step, in each unknown over its
        /// scale; in a medium 1e-6 by default.
        tolerance: f64 = 1e-7; Number(Included(1e-12), Included(1e-2));
    }
}

section! {
    /// `[detection]`
    Detection "detection." {
        /// Detachments of the same or neighbouring blocks are one rupture if no more than lambda sqrt(m/k) lies between
        /// them, by junctions also if no more than twice their healing time, in a medium also if no more than 30 s: a front may be this much slower than
        /// elastic waves. Never changes the run, only what is told of it.
        link_time_ratio: f64 = 100.0; POSITIVE, "lambda";
    }
}

section! {
    /// `[recording]`
    Recording "recording." {
        /// Cadence of the load samples, a whole number of steps; 0 for none. Never changes the run: switches and events
        /// are recorded in any case.
        sample_s: f64 = 1e-3; NOT_NEGATIVE;
        /// Cadence of the states of all blocks, a whole number of steps; 0 for none.
        fields_s: f64 = 2e-2; NOT_NEGATIVE;
        /// Whether to record the states of all blocks at the onset and end of every slip event.
        event_fields: bool = true; Flag;
        /// Whether to record the states of all blocks while at least so many blocks slide at once, at the cadence
        /// recording.rupture_fields_s; 0 for not at all. So large ruptures are recorded whose time is not known before.
        rupture_fields_from_blocks: u32 = 0; Count(0, MOST_BLOCKS);
        /// Cadence of these states, a whole number of steps; 0 if there are none.
        rupture_fields_s: f64 = 0.0; NOT_NEGATIVE;
        /// Of rate-and-state: every so many accepted steps of the solver, and the first and the last of the run, to be
        /// recorded as solved, at their exact times (`/series`); 0 for none.
        series_every: u32 = 0; Count(0, 1_000_000_000); needs SOLVED;
        /// Blocks whose slip, velocity, friction and state are recorded at these steps (`/series_block`), counted from 1,
        /// ascending; empty for none.
        series_blocks: List = List::new(); Numbers(Included(1.0), Unbounded); needs SOLVED;
        /// In a medium: depths, ascending, whose nearest nodes they are, instead of series_blocks; empty for none.
        stations_m: List = List::new(); Numbers(Included(0.0), Unbounded); needs MEDIUM;
    }
    /// Its dense windows.
    list window: Window;
}

section! {
    /// `[[recording.window]]`, a dense window; there may be any number of windows.
    Window "" {
        /// Start of the window, a whole number of steps.
        from_s: f64; NOT_NEGATIVE;
        /// End of the window, a whole number of steps, not before from_s.
        to_s: f64; NOT_NEGATIVE;
        /// Cadence within the window, a whole number of steps.
        every_s: f64; POSITIVE;
        /// First block to record.
        first_block: u32; Count(1, MOST_BLOCKS);
        /// Last block to record, not before first_block nor beyond N.
        last_block: u32; Count(1, MOST_BLOCKS);
    }
}
