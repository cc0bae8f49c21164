//! Converts run header and run end to and from the flat text maps of MCAP metadata.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::str::FromStr;

use asperity_record::{
    Contacts, Energy, MOST_BLOCKS, RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, Scales, SolverReport,
};

use crate::findings::{Gap, Salvaged};
use crate::format::{RUN, RUN_END, SALVAGE};
use crate::problem::{LogProblem, MetadataError};

const VERSION: &str = "record_schema_version";
/// Prefixes of the keys for each topic, and for each kind of the solver's work.
const MESSAGES: &str = "messages:";
const DIGEST: &str = "digest:";
const SOLVER: &str = "solver:";
const ENERGY: &str = "energy:";
const FALLBACKS: &str = "solver_fallbacks";
const ROWS: &str = "rows";
const JUNCTION_COUNT: &str = "junction_count";
const RADIATES: &str = "radiates";
const HAS_STATE: &str = "has_state";
const BLOCK_LENGTH: &str = "block_length_m";
const BLOCK_TIME: &str = "block_time_s";
const LINK_TIME_RATIO: &str = "link_time_ratio";
const MODULUS: &str = "modulus_n_per_m";
const INTERFACIAL_STIFFNESS: &str = "interfacial_stiffness_n_per_m";
const CRC: &str = "crc32";
const LONGEST_STABLE_STEP: &str = "longest_stable_step_s";
const STOPPED: &str = "stopped";
const BETWEEN_FALLBACKS: &str = "; ";

pub(crate) fn header_to_map(header: &RunHeader) -> BTreeMap<String, String> {
    let mut map: BTreeMap<String, String> = [
        (VERSION, header.record_schema_version.to_string()),
        ("scenario", header.scenario.clone()),
        ("scenario_hash", header.scenario_hash.clone()),
        ("run_id", header.run_id.clone()),
        ("code_version", header.code_version.clone()),
        ("parameter_set", header.parameter_set.clone()),
        ("solver", header.solver.clone()),
        ("blocks", header.blocks.to_string()),
        ("time_step_s", header.time_step_s.to_string()),
        ("steps", header.steps.to_string()),
        (
            "log_time",
            match header.time_grid().step_ns() {
                Some(step_ns) => format!("step * {step_ns} ns, exact"),
                None => "rounded to nanoseconds; the field step is exact".to_owned(),
            },
        ),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into();
    if header.rows != 1 {
        map.insert(ROWS.to_owned(), header.rows.to_string());
    }
    if header.junction_count > 0 {
        map.insert(JUNCTION_COUNT.to_owned(), header.junction_count.to_string());
    }
    if header.radiates {
        map.insert(RADIATES.to_owned(), true.to_string());
    }
    if header.has_state {
        map.insert(HAS_STATE.to_owned(), true.to_string());
    }
    if let Some(longest_s) = header.longest_stable_step_s {
        map.insert(LONGEST_STABLE_STEP.to_owned(), longest_s.to_string());
    }
    // For readers: it follows from two of the others.
    let link_s = ("link_s", header.scales.link_s());
    let scales = header.scales.parts().into_iter().chain([link_s]);
    map.extend(scales.map(|(key, value)| (key.to_owned(), value.to_string())));
    let crc = crc_of(&map);
    map.insert(CRC.to_owned(), crc);
    map
}

/// CRC-32 of all keys but its own and their values, in order, each behind its length. MCAP has none for metadata, and
/// that of all data stands at the end of a file, which an unfinished log lacks.
fn crc_of(map: &BTreeMap<String, String>) -> String {
    let mut crc = crc32fast::Hasher::new();
    for text in map.iter().filter(|(key, _)| *key != CRC).flat_map(|(key, value)| [key, value]) {
        crc.update(&(text.len() as u64).to_le_bytes());
        crc.update(text.as_bytes());
    }
    format!("{:08x}", crc.finalize())
}

/// Checks the version of a log before anything else in it, since another one may mean anything.
///
/// # Errors
/// If the version is missing or another one.
pub(crate) fn check_version(run: &BTreeMap<String, String>) -> Result<(), LogProblem> {
    let run = Reader { record: RUN, map: run };
    match run.parse(VERSION, "a whole number")? {
        RECORD_SCHEMA_VERSION => Ok(()),
        other => Err(LogProblem::Version(other)),
    }
}

pub(crate) fn header_from_map(map: &BTreeMap<String, String>) -> Result<RunHeader, MetadataError> {
    let expected = crc_of(map);
    let map = Reader { record: RUN, map };
    // Programs of earlier code write none.
    if map.map.get(CRC).is_some_and(|crc| *crc != expected) {
        return Err(map.invalid(CRC, format!("{expected}, that of the other keys")));
    }
    let header = RunHeader {
        record_schema_version: map.parse(VERSION, "a whole number")?,
        scenario: map.text("scenario")?,
        scenario_hash: map.text("scenario_hash")?,
        run_id: map.text("run_id")?,
        code_version: map.text("code_version")?,
        parameter_set: map.text("parameter_set")?,
        solver: map.text("solver")?,
        blocks: map.parse("blocks", "a whole number")?,
        rows: map.parse_or(ROWS, "a whole number", 1)?,
        junction_count: map.parse_or(JUNCTION_COUNT, "a whole number", 0)?,
        radiates: map.parse_or(RADIATES, "true or false", false)?,
        has_state: map.parse_or(HAS_STATE, "true or false", false)?,
        time_step_s: map.parse("time_step_s", "a number")?,
        longest_stable_step_s: match map.map.contains_key(LONGEST_STABLE_STEP) {
            true => Some(map.positive(LONGEST_STABLE_STEP)?),
            false => None,
        },
        steps: map.parse("steps", "a whole number")?,
        scales: Scales {
            block_length_m: map.positive(BLOCK_LENGTH)?,
            block_time_s: map.positive(BLOCK_TIME)?,
            link_time_ratio: map.positive(LINK_TIME_RATIO)?,
            modulus_n_per_m: map.positive(MODULUS)?,
            interfacial_stiffness_n_per_m: map.not_negative(INTERFACIAL_STIFFNESS)?,
        },
    };
    // These two determine allocations and divisors, so they are bounded here, once.
    if !(1..=MOST_BLOCKS).contains(&u64::from(header.blocks)) {
        return Err(map.invalid("blocks", format!("a whole number from 1 to {MOST_BLOCKS}")));
    }
    if Contacts::in_rows(header.blocks, header.rows).is_none() {
        return Err(map.invalid(ROWS, "a whole number that divides that of blocks"));
    }
    if !(header.time_step_s.is_finite() && header.time_step_s > 0.0) {
        return Err(map.invalid("time_step_s", "a number above 0"));
    }
    // Derived words must agree with the rest.
    for (key, expected) in header_to_map(&header).into_iter().filter(|(key, _)| key != CRC) {
        if map.map.get(&key) != Some(&expected) {
            return Err(map.invalid(&key, format!("{expected:?}, which the other keys give")));
        }
    }
    Ok(header)
}

const STATUSES: [RunStatus; 7] = [
    RunStatus::Complete,
    RunStatus::LoadNotReached,
    RunStatus::Interrupted,
    RunStatus::StoppedEnergy,
    RunStatus::StoppedNotFinite,
    RunStatus::StoppedStalled,
    RunStatus::Salvaged,
];

fn status_word(status: RunStatus) -> &'static str {
    match status {
        RunStatus::Complete => "complete",
        RunStatus::LoadNotReached => "load-not-reached",
        RunStatus::Interrupted => "interrupted",
        RunStatus::StoppedEnergy => "stopped-energy",
        RunStatus::StoppedNotFinite => "stopped-not-finite",
        RunStatus::StoppedStalled => "stopped-stalled",
        RunStatus::Salvaged => "salvaged",
    }
}

pub(crate) fn end_to_map(end: &RunEnd) -> BTreeMap<String, String> {
    let mut map: BTreeMap<String, String> = [
        ("status", status_word(end.status).to_owned()),
        ("last_step", end.last_step.to_string()),
        ("switches", end.switches.to_string()),
        ("digest", end.digest.clone()),
        (FALLBACKS, end.solver.fallbacks.join(BETWEEN_FALLBACKS)),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into();
    map.extend(end.stopped.iter().map(|why| (STOPPED.to_owned(), why.clone())));
    map.extend(
        end.message_counts.iter().map(|(topic, count)| (format!("{MESSAGES}{topic}"), count.to_string())),
    );
    map.extend(end.topic_digests.iter().map(|(topic, digest)| (format!("{DIGEST}{topic}"), digest.clone())));
    map.extend(end.solver.counts.iter().map(|(name, count)| (format!("{SOLVER}{name}"), count.to_string())));
    let energies = end.energy.iter().flat_map(Energy::parts);
    map.extend(energies.map(|(name, value)| (format!("{ENERGY}{name}"), value.to_string())));
    map
}

/// The energies; None if there are none.
fn energy_from_map(map: &Reader<'_>) -> Result<Option<Energy>, MetadataError> {
    if !map.map.keys().any(|key| key.starts_with(ENERGY)) {
        return Ok(None);
    }
    let part = |key: &'static str| {
        let value: f64 = map.parse(key, "a number")?;
        if value.is_finite() { Ok(value) } else { Err(map.invalid(key, "a finite number")) }
    };
    Ok(Some(Energy {
        drive_work_j: part("energy:drive_work_j")?,
        prestress_work_j: part("energy:prestress_work_j")?,
        friction_heat_j: part("energy:friction_heat_j")?,
        anchor_change_j: part("energy:anchor_change_j")?,
        viscous_loss_j: part("energy:viscous_loss_j")?,
        kinetic_j: part("energy:kinetic_j")?,
        elastic_j: part("energy:elastic_j")?,
        scheme_work_j: part("energy:scheme_work_j")?,
        radiated_j: map
            .map
            .contains_key("energy:radiated_j")
            .then(|| part("energy:radiated_j"))
            .transpose()?,
    }))
}

pub(crate) fn end_from_map(map: &BTreeMap<String, String>) -> Result<RunEnd, MetadataError> {
    let reader = Reader { record: RUN_END, map };
    let word = reader.text("status")?;
    let status = STATUSES.into_iter().find(|status| status_word(*status) == word);
    let status = status.ok_or_else(|| {
        let words: Vec<String> =
            STATUSES.into_iter().map(|status| format!("{:?}", status_word(status))).collect();
        reader.invalid("status", words.join(", "))
    })?;
    let stopped = map.get(STOPPED).cloned();
    if status.is_stopped() != stopped.is_some() {
        return Err(reader.invalid(STOPPED, "why the run was stopped, if its status says that it was"));
    }
    let counts_of = |prefix: &str| {
        map.iter()
            .filter_map(|(key, value)| Some((key, key.strip_prefix(prefix)?, value)))
            .map(|(key, name, value)| {
                let count = value.parse().map_err(|_| reader.invalid(key, "a whole number"))?;
                Ok((name.to_owned(), count))
            })
            .collect::<Result<BTreeMap<String, u64>, MetadataError>>()
    };
    let fallbacks = map.get(FALLBACKS).filter(|text| !text.is_empty());
    Ok(RunEnd {
        status,
        stopped,
        last_step: reader.parse("last_step", "a whole number")?,
        message_counts: counts_of(MESSAGES)?,
        solver: SolverReport {
            counts: counts_of(SOLVER)?,
            fallbacks: fallbacks
                .map_or(Vec::new(), |text| text.split(BETWEEN_FALLBACKS).map(str::to_owned).collect()),
        },
        switches: reader.parse("switches", "a whole number")?,
        energy: energy_from_map(&reader)?,
        digest: reader.text("digest")?,
        topic_digests: map
            .iter()
            .filter_map(|(key, digest)| Some((key.strip_prefix(DIGEST)?.to_owned(), digest.clone())))
            .collect(),
    })
}

pub(crate) fn salvaged_to_map(salvaged: &Salvaged) -> BTreeMap<String, String> {
    let Salvaged { kept, lost, gaps, damage, remarks, end_is_known } = salvaged;
    let step = |step: Option<u64>| step.map_or(String::new(), |step| step.to_string());
    let gaps = gaps.iter().map(|gap| format!("{}..{}", step(gap.after_step), step(gap.before_step)));
    let damage = damage
        .iter()
        .map(|damage| format!("bytes {} to {}: {}", damage.from_byte, damage.to_byte, damage.what));
    let mut map: BTreeMap<String, String> = [
        // The steps of the last message before and the first after each gap.
        ("gaps", gaps.collect::<Vec<_>>().join(" ")),
        ("damage", damage.collect::<Vec<_>>().join("; ")),
        ("remarks", remarks.join("; ")),
        ("end_is_known", end_is_known.to_string()),
    ]
    .map(|(key, value)| (key.to_owned(), value))
    .into();
    map.extend(kept.iter().map(|(topic, count)| (format!("kept:{topic}"), count.to_string())));
    map.extend(lost.iter().map(|(topic, count)| (format!("lost:{topic}"), count.to_string())));
    map
}

/// Whether a salvaged log states, as [`salvaged_to_map`] does, that messages are missing.
pub(crate) fn says_lost(map: &BTreeMap<String, String>) -> bool {
    map.get("end_is_known").is_none_or(|known| known != "true")
        || map.keys().any(|key| key.starts_with("lost:"))
}

/// Parses the gaps of a salvaged log, as [`salvaged_to_map`] writes them.
///
/// # Errors
/// If they are malformed or out of order.
pub(crate) fn gaps_from_map(map: &BTreeMap<String, String>) -> Result<Vec<Gap>, MetadataError> {
    let reader = Reader { record: SALVAGE, map };
    let invalid = || reader.invalid("gaps", "a list of steps, as \"10..20 30..\", in order");
    let step = |text: &str| match text {
        "" => Ok(None),
        text => text.parse().map(Some).map_err(|_| invalid()),
    };
    let text = reader.text("gaps")?;
    let mut gaps: Vec<Gap> = Vec::new();
    for gap in text.split(' ').filter(|gap| !gap.is_empty()) {
        let (after, before) = gap.split_once("..").ok_or_else(invalid)?;
        let gap = Gap { after_step: step(after)?, before_step: step(before)? };
        let follows = gaps.last().is_none_or(|last| {
            last.before_step.zip(gap.after_step).is_some_and(|(before, after)| before <= after)
        });
        let is_forward = gap.after_step.zip(gap.before_step).is_none_or(|(after, before)| after <= before);
        if !follows || !is_forward {
            return Err(invalid());
        }
        gaps.push(gap);
    }
    Ok(gaps)
}

/// Reads the keys of one metadata record.
pub(crate) struct Reader<'a> {
    pub(crate) record: &'static str,
    pub(crate) map: &'a BTreeMap<String, String>,
}

impl Reader<'_> {
    pub(crate) fn text(&self, key: &'static str) -> Result<String, MetadataError> {
        self.map.get(key).cloned().ok_or(MetadataError::Missing { record: self.record, key })
    }

    pub(crate) fn parse<T: FromStr>(
        &self,
        key: &'static str,
        accepted: &'static str,
    ) -> Result<T, MetadataError> {
        self.text(key)?.parse().map_err(|_| self.invalid(key, accepted))
    }

    /// A value that only some logs have; `otherwise` in others.
    fn parse_or<T: FromStr>(
        &self,
        key: &'static str,
        accepted: &'static str,
        otherwise: T,
    ) -> Result<T, MetadataError> {
        if self.map.contains_key(key) { self.parse(key, accepted) } else { Ok(otherwise) }
    }

    /// A number above 0.
    fn positive(&self, key: &'static str) -> Result<f64, MetadataError> {
        let value: f64 = self.parse(key, "a number above 0")?;
        if value.is_finite() && value > 0.0 { Ok(value) } else { Err(self.invalid(key, "a number above 0")) }
    }

    fn not_negative(&self, key: &'static str) -> Result<f64, MetadataError> {
        let value: f64 = self.parse(key, "a number from 0")?;
        if value.is_finite() && value >= 0.0 { Ok(value) } else { Err(self.invalid(key, "a number from 0")) }
    }

    pub(crate) fn invalid(&self, key: &str, accepted: impl Into<Cow<'static, str>>) -> MetadataError {
        MetadataError::Invalid {
            record: self.record,
            key: key.to_owned(),
            value: self.map.get(key).cloned().unwrap_or_default(),
            accepted: accepted.into(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{
        CRC, HAS_STATE, JUNCTION_COUNT, LONGEST_STABLE_STEP, RADIATES, ROWS, header_from_map, header_to_map,
    };

    #[test]
    fn keys_that_may_be_absent_are_refused_if_they_are_wrong() {
        let map = header_to_map(&asperity_testkit::run_header());
        assert!(header_from_map(&map).is_ok());
        let wrong = [
            (ROWS, "two"),
            (JUNCTION_COUNT, "-1"),
            (RADIATES, "yes"),
            (HAS_STATE, "1"),
            (LONGEST_STABLE_STEP, "0"),
        ];
        for (key, value) in wrong {
            let mut map = map.clone();
            map.remove(CRC);
            map.insert(key.to_owned(), value.to_owned());
            let refused = header_from_map(&map).expect_err(key).to_string();
            assert!(refused.contains(key), "{refused}");
        }
    }
}
