//! Converts run header and run end to and from the flat text maps of MCAP metadata.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::str::FromStr;

use asperity_record::{
    Contacts, Energy, MOST_BLOCKS, Parts, RECORD_SCHEMA_VERSION, RunEnd, RunHeader, RunStatus, Scales,
    Sensors, SolverReport,
};

use serde_json::{Map, Number, Value};

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
const SLIDER_LENGTH: &str = "slider_length_m";
const SENSORS: &str = "sensors_at_m";
const OF_SLIP: &str = "sensors_are_of_slip";
const THRESHOLD: &str = "threshold";
const LEAST_STEP: &str = "least_step";
const CRC: &str = "crc32";
const LONGEST_STABLE_STEP: &str = "longest_stable_step_s";
const STOPPED: &str = "stopped";
const BETWEEN_FALLBACKS: &str = "; ";

pub(crate) fn header_to_map(header: &RunHeader) -> BTreeMap<String, String> {
    let Ok(Value::Object(fields)) = serde_json::to_value(header) else {
        unreachable!("a header is a struct")
    };
    let scales = header.scales.parts().map(|(key, value)| (key.to_owned(), value.into()));
    let grouped = ["scales", "sensors"];
    let fields = fields.into_iter().filter(|(key, _)| !grouped.contains(&key.as_str())).chain(scales);
    let mut map: BTreeMap<String, String> = fields.map(|(key, value)| (key, text_of(&value))).collect();
    if let Some(Sensors { length_m, x_m, are_of_slip, threshold, least_step }) = &header.sensors {
        let positions: Vec<String> = x_m.iter().map(f64::to_string).collect();
        map.insert(SLIDER_LENGTH.to_owned(), length_m.to_string());
        map.insert(SENSORS.to_owned(), positions.join(" "));
        map.insert(OF_SLIP.to_owned(), are_of_slip.to_string());
        map.insert(THRESHOLD.to_owned(), threshold.to_string());
        map.insert(LEAST_STEP.to_owned(), least_step.to_string());
    }
    let log_time = match header.time_grid().step_ns() {
        Some(step_ns) => format!("step * {step_ns} ns, exact"),
        None => "rounded to nanoseconds; the field step is exact".to_owned(),
    };
    map.insert("log_time".to_owned(), log_time);
    // For readers: it follows from two of the others.
    map.insert("link_s".to_owned(), header.scales.link_s().to_string());
    map.insert(CRC.to_owned(), crc_of(&map));
    map
}

/// A text as it is; numbers without exponents.
fn text_of(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Number(number) if number.is_f64() => number.as_f64().unwrap_or_default().to_string(),
        other => other.to_string(),
    }
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
        flags: Parts::flags(|key| map.parse_or(key, "true or false", false))?,
        time_step_s: map.positive("time_step_s")?,
        longest_stable_step_s: map
            .map
            .get(LONGEST_STABLE_STEP)
            .map(|_| map.positive(LONGEST_STABLE_STEP))
            .transpose()?,
        steps: map.parse("steps", "a whole number")?,
        scales: Scales {
            block_length_m: map.positive("block_length_m")?,
            block_time_s: map.positive("block_time_s")?,
            link_time_ratio: map.positive("link_time_ratio")?,
            modulus_n_per_m: map.positive("modulus_n_per_m")?,
            interfacial_stiffness_n_per_m: map.number(
                "interfacial_stiffness_n_per_m",
                "a number from 0",
                |value| value >= 0.0,
            )?,
        },
        sensors: sensors_from_map(&map)?,
    };
    // These two determine allocations and divisors, so they are bounded here, once.
    if !(1..=MOST_BLOCKS).contains(&u64::from(header.blocks)) {
        return Err(map.invalid("blocks", format!("a whole number from 1 to {MOST_BLOCKS}")));
    }
    if Contacts::in_rows(header.blocks, header.rows).is_none() {
        return Err(map.invalid(ROWS, "a whole number that divides that of blocks"));
    }
    // Derived words must agree with the rest.
    for (key, expected) in header_to_map(&header).into_iter().filter(|(key, _)| key != CRC) {
        if map.map.get(&key) != Some(&expected) {
            return Err(map.invalid(&key, format!("{expected:?}, which the other keys give")));
        }
    }
    Ok(header)
}

/// The sensors of a recording; none of a run.
fn sensors_from_map(map: &Reader<'_>) -> Result<Option<Sensors>, MetadataError> {
    if !map.map.contains_key(SLIDER_LENGTH) {
        return Ok(None);
    }
    let length_m = map.positive(SLIDER_LENGTH)?;
    let positions: Result<Vec<f64>, _> = map.text(SENSORS)?.split_whitespace().map(str::parse).collect();
    let blocks = map.parse::<usize>("blocks", "a whole number")?;
    let is_sound = |x_m: &Vec<f64>| {
        let is_on_slider = x_m.iter().all(|x_m| (0.0..=length_m).contains(x_m));
        (x_m.len() == blocks || x_m.is_empty()) && is_on_slider && x_m.is_sorted_by(|a, b| a < b)
    };
    let x_m = positions.ok().filter(is_sound);
    let accepted = "ascending positions on the slider, one for each block";
    let x_m = x_m.ok_or_else(|| map.invalid(SENSORS, accepted))?;
    let are_of_slip = map.parse(OF_SLIP, "true or false")?;
    let threshold = map.positive(THRESHOLD)?;
    let least_step = map.number(LEAST_STEP, "a number from 0", |value| value >= 0.0)?;
    Ok(Some(Sensors { length_m, x_m, are_of_slip, threshold, least_step }))
}

pub(crate) fn end_to_map(end: &RunEnd) -> BTreeMap<String, String> {
    let mut map: BTreeMap<String, String> = [
        ("status", serde_json::to_value(end.status).map_or_else(|_| String::new(), |word| text_of(&word))),
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
    let energies = map.map.keys().filter_map(|key| Some((key, key.strip_prefix(ENERGY)?)));
    let number = |(key, name): (&String, &str)| {
        let value = map.map[key].parse().ok().and_then(Number::from_f64);
        value.map(|value| (name.to_owned(), value.into())).ok_or_else(|| map.invalid(key, "a finite number"))
    };
    let energies = energies.map(number).collect::<Result<Map<String, Value>, MetadataError>>()?;
    if energies.is_empty() {
        return Ok(None);
    }
    serde_json::from_value(energies.into())
        .map(Some)
        .map_err(|error| map.invalid("energy:*", error.to_string()))
}

pub(crate) fn end_from_map(map: &BTreeMap<String, String>) -> Result<RunEnd, MetadataError> {
    let reader = Reader { record: RUN_END, map };
    let status: RunStatus = serde_json::from_value(reader.text("status")?.into())
        .map_err(|error| reader.invalid("status", format!("accepted: {error}")))?;
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

    fn number(
        &self,
        key: &'static str,
        accepted: &'static str,
        is_accepted: fn(f64) -> bool,
    ) -> Result<f64, MetadataError> {
        let value: f64 = self.parse(key, accepted)?;
        if value.is_finite() && is_accepted(value) { Ok(value) } else { Err(self.invalid(key, accepted)) }
    }

    fn positive(&self, key: &'static str) -> Result<f64, MetadataError> {
        self.number(key, "a number above 0", |value| value > 0.0)
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
    use super::{CRC, JUNCTION_COUNT, LONGEST_STABLE_STEP, ROWS, header_from_map, header_to_map};

    #[test]
    fn keys_that_may_be_absent_are_refused_if_they_are_wrong() {
        let map = header_to_map(&asperity_testkit::run_header());
        assert!(header_from_map(&map).is_ok());
        let wrong = [
            (ROWS, "two"),
            (JUNCTION_COUNT, "-1"),
            ("radiates", "yes"),
            ("weakens", "yes"),
            ("has_state", "1"),
            ("has_series", "2"),
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
