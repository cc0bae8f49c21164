//! Tests across crates, mostly with the built command, as one program: `cargo test --test root`, or a part
//! of them, `cargo test --test root cli::`.
//!
//! One program and not one per file, since each would be linked with all libraries, polars among them. A
//! file of this folder is a module here, or `tidy` fails. All run in one process, so none sets an
//! environment variable or the current folder of the process; only started commands get their own.

#[cfg(feature = "analysis")]
mod answers;
#[cfg(feature = "analysis")]
mod area_pictures;
mod bounds;
mod catalogue;
mod claims;
mod cli;
mod code_version;
#[cfg(feature = "analysis")]
mod colours;
#[cfg(feature = "analysis")]
mod diff;
mod disk;
#[cfg(feature = "analysis")]
mod draw;
#[cfg(feature = "analysis")]
mod end_to_end;
mod export;
#[cfg(feature = "analysis")]
mod figures_page;
mod files;
#[cfg(feature = "analysis")]
mod first_day;
mod flips;
#[cfg(feature = "analysis")]
mod foreign;
mod foxglove;
#[cfg(feature = "analysis")]
mod given;
#[cfg(feature = "analysis")]
mod golden;
mod hostile;
/// What needs packages of Python and Node; `cargo xtask ci` sets them up.
#[cfg(feature = "analysis")]
mod in_ci {
    mod clients;
    mod recipes;
}
#[cfg(feature = "analysis")]
mod junctions;
#[cfg(feature = "analysis")]
mod kinds;
#[cfg(feature = "analysis")]
mod look;
mod mistakes;
mod new_detector;
#[cfg(unix)]
mod not_files;
#[cfg(feature = "analysis")]
mod one_block;
#[cfg(feature = "analysis")]
mod page;
mod parameter_sets;
mod prestress;
#[cfg(feature = "analysis")]
mod print;
mod reference;
#[cfg(feature = "analysis")]
mod report;
#[cfg(feature = "analysis")]
mod report_files;
mod resume;
#[cfg(feature = "analysis")]
mod rules;
mod runlog;
mod rupture_energies;
mod rupture_fields;
mod ruptures;
mod salvage;
mod scaling;
mod slab;
mod slab_nodes;
#[cfg(feature = "analysis")]
mod slab_study;
#[cfg(target_os = "linux")]
mod slurm;
mod staging;
mod starts;
mod stopped;
#[cfg(feature = "analysis")]
mod streaming;
mod studies;
mod study_figures;
mod summary;
mod sweep;
mod sweep_emit;
mod sweep_go;
mod sweep_verify;
#[cfg(feature = "analysis")]
mod tables;
mod terminal;
#[cfg(feature = "analysis")]
mod textconv;
mod tidy;
mod validate;
mod verdict;
#[cfg(feature = "analysis")]
mod verify;
mod versions;
#[cfg(feature = "analysis")]
mod words;

/// Properties for any input, shared with the fuzzers.
#[path = "fuzz/src/lib.rs"]
#[expect(unreachable_pub, reason = "the fuzzers have it as a crate of its own")]
mod laws;

/// Shared by these tests.
mod support {
    pub(crate) mod binary;
    #[cfg(feature = "analysis")]
    pub(crate) mod browser;
    pub(crate) mod clients;
    pub(crate) mod forgeries;
    #[cfg(feature = "analysis")]
    pub(crate) mod golden;
    #[cfg(feature = "analysis")]
    pub(crate) mod markdown;
    #[path = "../../xtask/src/seed.rs"]
    pub(crate) mod seed;
    pub(crate) mod small;
    #[cfg(feature = "analysis")]
    pub(crate) mod svg;
}
