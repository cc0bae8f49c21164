//! Tests across crates, mostly with the built command, as one program: `cargo test --test root`, or a part
//! of them, `cargo test --test root cli::`.
//!
//! One program and not one per file, since each would be linked with all libraries, polars among them. A
//! file of this folder is a module here, or `tidy` fails. All run in one process, so none sets an
//! environment variable or the current folder of the process; only started commands get their own.

mod answers;
mod area_pictures;
mod bounds;
mod catalogue;
mod claims;
mod cli;
mod closed_loop;
mod code_version;
mod colours;
mod diff;
mod disk;
mod draw;
mod end_to_end;
mod explain;
mod export;
mod files;
mod first_day;
mod flips;
mod foreign;
mod foxglove;
mod gallery;
mod given;
mod golden;
mod half_space;
mod hostile;
/// What needs packages of Python and Node, which `cargo xtask ci` sets up, or a minute.
mod in_ci {
    mod clients;
    mod memory;
    mod recipes;
}
mod junctions;
mod kinds;
mod look;
mod mistakes;
mod new_detector;
#[cfg(unix)]
mod not_files;
mod one_block;
mod page;
mod parameter_sets;
mod prestress;
mod print;
mod recording_figures;
mod recordings;
mod reference;
mod refine;
mod report;
mod report_files;
mod resume;
mod rules;
mod runlog;
mod rupture_energies;
mod rupture_fields;
mod ruptures;
mod salvage;
mod scaling;
mod series;
mod slab;
mod slab_nodes;
mod slab_study;
#[cfg(target_os = "linux")]
mod slurm;
mod staging;
mod starts;
mod stopped;
mod streaming;
mod studies;
mod study_figures;
mod summary;
mod sweep;
mod sweep_emit;
mod sweep_go;
mod sweep_verify;
mod tables;
mod terminal;
mod textconv;
mod tidy;
mod validate;
mod verdict;
mod verify;
mod versions;
mod words;

/// Properties for any input, shared with the fuzzers.
#[path = "fuzz/src/lib.rs"]
#[expect(unreachable_pub, reason = "the fuzzers have it as a crate of its own")]
mod laws;

/// Shared by these tests.
mod support {
    pub(crate) mod binary;
    pub(crate) mod browser;
    pub(crate) mod clients;
    pub(crate) mod commands;
    pub(crate) mod forgeries;
    pub(crate) mod golden;
    pub(crate) mod kinds;
    pub(crate) mod many_events;
    pub(crate) mod markdown;
    pub(crate) mod pairs;
    pub(crate) mod parquet;
    pub(crate) mod pipelines;
    pub(crate) mod seed;
    pub(crate) mod small;
    pub(crate) mod svg;
    pub(crate) mod verify;
}
