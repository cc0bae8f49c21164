//! The slider and its solvers.
//!
//! A solver is a state machine: asked for the next [`Record`](asperity_record::Record), it
//! advances as far as it must and answers. It does no I/O, reads no clock and starts no
//! thread, so that the same plan gives the same records wherever it runs.
//!
//! [`Plain`] takes every step; it is the oracle. [`Fast`] computes the same discrete trajectory
//! for a cost that follows the switches: certified windows where no contact switches, certified
//! jumps where all are stuck, single steps in between. [`equality`] compares them.
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
//! - [`solver`](Solver), `kind`: what a solver is, and which there are.
//! - `state`, `contacts`: what a step depends on, and what contacts bear under the load of a step.
//! - `stepper`: one step, equation by equation; `sweep` below it is that for all blocks at once.
//! - `energy` and `ledger`: what became of the work of the drive.
//! - `audit`: whether the time step does more of that work than an honest run can have.
//! - `recorder`: what is recorded and when, for all solvers alike; `counters`: what the steps of
//!   a run were made of.
//! - `lattice`: the same steps of a slab, and its energies; `slab`, its fast solver.
//! - `plain`: every step.
//! - `fast`: which steps are taken how. `window` and `basis` take many while some blocks slide,
//!   `jump` while all stick (by `modes` or, for long chains, by `waves`, with `complex` numbers),
//!   `rest` where what sticks does not move at all; `cost` keeps accounts of whether that pays.
//! - [`equality`] and `exact`: whether two solvers agree, and who is right where rounding decides.
//!
//! How nodes pull at each other stands in [`asperity_model::elastic`] alone. Nodes move, contacts
//! rub; a slab has contacts at its bottom alone; in a chain every node carries one contact, and both
//! are called *blocks* where the difference does not matter.

mod audit;
mod basis;
mod body;
mod clearance;
mod complex;

mod cosines;
mod cost;
mod counters;
mod energy;
pub mod equality;
mod exact;
mod fast;
mod jump;
mod kept;
mod kind;
mod law;

mod ledger;
mod modes;
mod pace;
mod plain;
mod recorder;
mod rest;
mod slab;
mod solver;
mod state;
mod step_map;
mod stepper;
mod strength;
mod sweep;
mod waves;
mod window;

pub use audit::MOST_SCHEME_SHARE;
pub use counters::Counters;
pub use exact::Exact;
pub use kind::SolverKind;
pub use ledger::{Ledger, Span, Sum};
pub use pace::{Pace, Snapshot};
pub use plain::Plain;
pub use solver::{SimulationError, Solver};
pub use state::SliderState;
pub use stepper::Driving;
