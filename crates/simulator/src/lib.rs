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
//! In reading order:
//!
//! - [`solver`](Solver), `kind`: what a solver is, and which there are; `stop`: a request to return.
//! - `state`, `strength`: the inputs of a step, and the strength of contacts under the load of a step.
//! - `pace`: a [`Snapshot`], the slider with the accounts of its solver; `given_start` leaves it to another run.
//! - `stepper`: one step, equation by equation, for any `body` (the chain, the lattice) and contact
//!   law (`law`); `kernels` below it has the loops over all blocks.
//! - `junctions`: the step of contacts that consist of many junctions.
//! - `energy` and `ledger`: the balance of the work of the drive.
//! - `instability_stop`: ends a run whose time step itself adds too much energy.
//! - `recorder`: what is recorded and when, for all solvers; `counters`: the statistics of a run.
//! - `plain`: takes every step.
//! - `fast`: the loop that alternates single steps with leaps. A chain leaps by `window` and
//!   `chebyshev` while some blocks slide, and by `rest` where nothing moves; all bodies leap by `jump` while
//!   all contacts stick: a chain with `modes` or, if it is long, `standing_waves` and
//!   `nonuniform_cosines`, a lattice with `slow_modes`. `clearance` and `norms` are the last and the first
//!   part of their certificates. `cost` decides whether leaps pay.
//! - `adaptive`: steps of varying length, for friction under which nothing sticks.
//! - `propagator`, `operator_cache`: the matrix of a step, and what is precomputed from it, shared by
//!   the runs of a process.
//!
//! Only [`asperity_model::elastic`] defines how nodes pull at each other. Nodes move, contacts
//! rub; a slab and a body have contacts at their bottom alone; in a chain and a sheet every node carries one
//! contact, and both are called *blocks* where the difference does not matter.

mod adaptive;
mod body;
mod chebyshev;
mod clearance;
mod complex;
mod cost;
mod counters;
mod energy;
mod fast;
mod given_start;
mod instability_stop;
mod jump;
mod junctions;
mod kernels;
mod kind;
mod lattice_energy;
mod law;
mod ledger;
mod modes;
mod nonuniform_cosines;
mod norms;
mod operator_cache;
mod pace;
mod plain;
mod propagator;
mod recorder;
mod rest;
mod single_step;
mod slow_modes;
mod solver;
mod standing_waves;
mod state;
mod stepper;
mod stop;
mod strength;
mod window;

pub use adaptive::{AdaptiveState, Crossing};
pub use counters::Counters;
pub use instability_stop::MOST_SCHEME_SHARE;
pub use junctions::JunctionState;
pub use kind::SolverKind;
pub use ledger::{Ledger, Span, Sum};
pub use norms::Norms;
pub use pace::{Pace, Snapshot};
pub use plain::Plain;
pub use recorder::{contact_loads_n, fields};
pub use single_step::Driving;
pub use solver::{Next, SimulationError, Solver};
pub use state::SliderState;
pub use stop::Stop;
pub use strength::threshold_n;
