//! The versions of the format, and how older ones are read.
//!
//! | version | additions |
//! |---|---|
//! | 1 | |
//! | 2 | attachments `checkpoint`, from which an unfinished run resumes; the status `salvaged`, with a metadata record `salvage` |
//! | 3 | gaps of salvaged logs state how events are ordered in them; chunks end where a step and its switches end; metadata records `chunk`, which are no longer written or used |
//! | 4 | topics `/events/rupture` and `/events/arrival`; in the metadata `run`, `block_length_m`, `block_time_s`, `link_time_ratio` and `link_s`, which link detachments to ruptures; in `/step` and `run_end` the energies; in logs written later `longest_stable_step_s` in `run`, and the statuses `stopped-energy` and `stopped-not-finite`, with why in `stopped` |
//! | 5 | slabs: in `/fields` the normal load of each contact, in checkpoints the states of all nodes |
//! | 6 | in `/events/rupture` `moment_n_m`, an `anchor_change_j` of every rupture that counts all of its switches, and an `elastic_change_j` to match: before, those of its first step were left out; in the metadata `run`, `modulus_n_per_m` and `interfacial_stiffness_n_per_m`, from which these two are computed; in logs of laws with junctions, written later, `junction_count` in `run`, totals of breaks and re-pins in `/step` and `/events/slip`, and what contacts have of junctions in `/switch` and `/fields`; in logs of rate-and-state friction, written later, `has_state` in `run`, the state of each block in `/fields`, the largest speed in `/step` and `/events/slip`, and the status `stopped-stalled`; in logs written later, `mean_strength_drop_n` for `mean_force_drop_n` in `/events/rupture`, there also the drops of shear force, and in `/events/arrival` the forces before and after |
//!
//! In any version `run_end` may have a digest for each topic, `digest:TOPIC`; older logs have none,
//! and nothing is compared. Readers that do not know these keys ignore them, so they are not a new
//! version. Laws with junctions or a state are none either: a program without them refuses the scenario of such a
//! log, and the schemas of other logs are as they were.
//!
//! Versions 2 to 6 only add, so that a log of version 1 reads as one without checkpoints, logs of versions 1 to 3 as ones without ruptures, and ruptures of
//! versions 4 and 5 as ones without a moment. Their `anchor_change_j` and `elastic_change_j` are returned
//! as written; a replay finds the present ones. A version with other representations is converted to the
//! present one here, and only here. `fixtures/logs` has logs of every version, written by the program of
//! that time, and `tests/versions.rs` reads them.

use std::collections::BTreeMap;

use asperity_record::RECORD_SCHEMA_VERSION;

use crate::metadata;
use crate::problem::LogProblem;

/// The oldest supported version.
const OLDEST: u32 = 1;

/// Checks the version in metadata `run` before anything else in it, since newer versions are
/// unknown.
///
/// # Errors
/// If the version is missing or not supported.
pub(crate) fn check(run: &BTreeMap<String, String>) -> Result<(), LogProblem> {
    match metadata::version(run)? {
        OLDEST..=RECORD_SCHEMA_VERSION => Ok(()),
        other => Err(LogProblem::Version(other)),
    }
}
