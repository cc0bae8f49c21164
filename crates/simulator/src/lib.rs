//! The slider and its solvers.
//!
//! A solver is a state machine: a call for the next [`Record`](asperity_record::Record) advances it as far
//! as necessary, or until the caller wants it back ([`Stop`]). It does no I/O, reads no clock and starts no
//! thread, so that the same plan gives the same records wherever it runs.
//!
//! [`Plain`] takes every step; it is the oracle. [`SolverKind::Fast`] computes the same discrete trajectory
//! for a cost that follows the switches: certified windows where no contact switches, certified
//! jumps where all are stuck, single steps in between. `cargo xtask verify` compares them.
//!
//! Ten blocks, up to where the first of them slips:
//!
//! ```
//! use asperity_model::{Plan, Scenario, ScenarioSource};
//! use asperity_record::{Direction, Record};
//! use asperity_simulator::SolverKind;
//!
//! let source = ScenarioSource::new("ten blocks", "slider.blocks = 10\ntime.duration_s = 1");
//! let mut solver = SolverKind::Fast.start(Plan::new(&Scenario::resolve(&source)?));
//! let first = loop {
//!     match solver.next_record()?.expect("a block slips within a second") {
//!         Record::Step(step) if !step.switches.is_empty() => break step,
//!         _ => {}
//!     }
//! };
//! // The end that is pushed slips first, long before the load would move the whole slider.
//! let switch = &first.switches[0];
//! assert_eq!((switch.block, switch.direction), (1, Direction::Detach));
//! assert!(switch.tangential_force_n >= switch.threshold_n);
//! assert!(first.load_ratio() < 0.2);
//! // Tens of millions of steps, of which next to none were taken one by one.
//! let counters = solver.counters();
//! assert!(counters.steps() > 10_000_000 && counters.plain_steps < 100);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The rooms, in reading order:
//!
//! - `step`: one step, equation by equation (`stepper`), for any body and contact law; the strength of
//!   contacts that is its input; contacts of many junctions; `plain`, which takes every step. `kernels` below it has the
//!   loops over all blocks. The state of a slider is [`asperity_model::SliderState`].
//! - `energy`: the balance of the work of the drive, and the stop of a run whose time step itself
//!   adds too much energy.
//! - `records`: what a solver is, which there are, what is recorded and when, for all of them; counters,
//!   a [`Snapshot`] of a solver, and a request to return ([`Stop`]).
//! - `leap`: `fast`, the loop that alternates single steps with leaps. A chain leaps by `window` and `chebyshev`
//!   while some blocks slide, and by `rest` where nothing moves; all bodies leap by `jump` while all contacts
//!   stick. `norms` and `clearance` are the first and the last part of their certificates, `cost` decides whether
//!   leaps pay.
//! - `modes`: the matrix of a step and what is precomputed from it for jumps, shared by the runs of a process:
//!   stored modes of a chain, or of a long one `standing_waves` and `nonuniform_cosines`; of a lattice `slow_modes`.
//! - `adaptive`: steps of varying length, for friction under which nothing sticks.
//!
//! Only [`asperity_model::body::elastic`] defines how nodes pull at each other. Nodes move, contacts
//! rub; a slab and a body have contacts at their bottom alone; in a chain and a sheet every node carries one
//! contact, and both are called *blocks* where the difference does not matter.

mod adaptive;
mod energy;
mod kernels;
mod leap;
mod modes;
mod records;
mod step;

pub use energy::instability_stop::MOST_SCHEME_SHARE;
pub use leap::norms::Norms;
pub use records::counters::Counters;
pub use records::kind::SolverKind;
pub use records::pace::{Pace, Snapshot};
pub use records::recorder::{contact_loads_n, fields};
pub use records::solver::{Next, SimulationError, Solver};
pub use records::stop::Stop;
pub use step::plain::Plain;
pub use step::strength::threshold_n;
