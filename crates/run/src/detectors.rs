//! The registered detectors, which process every run. To add one: its crate, and a line here. Their
//! order is the order of events in the log.
//!
//! A live run uses them all, with rules that drop no events; a settings file can choose among them
//! for a replay.

use std::path::Path;
use std::sync::Arc;

use asperity_detect::{Detector, Detectors, SlipRules};
use asperity_detect_rupture::{ArrivalDetector, Links, RuptureDetector};
use asperity_model::scenario::text::{self, Lines};
use asperity_model::scenario::typed;
use asperity_model::{Plan, Scenario};
use asperity_record::bounds::check_toml;
use asperity_record::{Contacts, EventKind, LoadDrop, Parts, RunEnd, RunHeader, Scales, Sensors, TimeGrid};
use serde::{Deserialize, Serialize};
use toml::Spanned;

/// The facts about its run that a detector may use.
#[derive(Debug, Clone)]
struct OfRun {
    /// How its blocks lie.
    blocks: Contacts,
    /// What links detachments to ruptures.
    links: Links,
    /// What its records have that those of other runs lack.
    parts: Parts,
    /// Its sensors, if it is a recording.
    sensors: Option<Arc<Sensors>>,
}

type Start = fn(OfRun) -> Box<dyn Detector>;

/// Detectors by name. New ones are added at the end.
const DETECTORS: &[(&str, Start)] = &[
    ("onset", |run| boxed(asperity_detect_onset::OnsetDetector { parts: run.parts })),
    ("extent", |run| boxed(asperity_detect_extent::ExtentDetector { parts: run.parts })),
    ("global", |_| boxed(asperity_detect_global::GlobalDetector::default())),
    ("rupture", |run| {
        let detector = RuptureDetector::new(run.blocks, run.links).radiating(run.parts.radiation);
        boxed(detector.with_sensors(run.sensors))
    }),
    ("arrival", |run| boxed(ArrivalDetector::new(run.blocks, run.links).with_sensors(run.sensors))),
];

fn boxed(detector: impl Detector + 'static) -> Box<dyn Detector> {
    Box::new(detector)
}

fn names() -> Vec<&'static str> {
    DETECTORS.iter().map(|(name, _)| *name).collect()
}

/// The kinds of events that the registered detectors emit in runs with these parts.
pub fn event_kinds(parts: Parts) -> Vec<EventKind> {
    // The kinds are independent of these values.
    let links = Links {
        t_link_s: 1.0,
        time_grid: TimeGrid::new(1.0),
        spacing_m: 1.0,
        modulus_n_per_m: 1.0,
        interfacial_stiffness_n_per_m: 1.0,
        first_share: 1.0,
    };
    let rows = if parts.area { 2 } else { 1 };
    let blocks = Contacts::in_rows(2 * rows, rows).expect("rows of two contacts");
    let of_none = || Arc::new(Sensors { length_m: 1.0, are_of_slip: true, ..Sensors::default() });
    let run = OfRun { blocks, links, parts, sensors: parts.recording.then(of_none) };
    let of_source = parts.recording.then(EventKind::of::<LoadDrop>);
    DETECTORS.iter().map(|(_, start)| start(run.clone()).emits()).chain(of_source).collect()
}

/// The registered detectors for a run of that plan.
pub fn of_plan(plan: &Plan) -> Detectors {
    let contacts = plan.elastic.layout();
    let radiation = plan.friction.law.radiation_kg_per_s() > 0.0;
    let parts = Parts { area: contacts.is_area(), radiation, ..Parts::default() };
    Settings::default().for_run(contacts, plan.grid, plan.scales, parts, None, Some(plan))
}

/// The kinds of events that the detectors of one run emit.
///
/// # Errors
/// A message, if another detector uses a topic, or readers would not recognise its messages as events.
pub(crate) fn kinds_of(detectors: &Detectors) -> Result<Vec<EventKind>, String> {
    let kinds: Vec<EventKind> = detectors.kinds().collect();
    for (number, EventKind { topic, .. }) in kinds.iter().enumerate() {
        if !topic.starts_with("/events/") {
            return Err(format!("a detector emits {topic} (accepted: a topic that begins with /events/)"));
        }
        if kinds[..number].iter().any(|other| other.topic == *topic) {
            return Err(format!("two detectors emit {topic} (accepted: a topic of its own for each)"));
        }
    }
    Ok(kinds)
}

/// Whether the log with this end was written with detectors of all these kinds.
pub(crate) fn has_events_of(end: &RunEnd, kinds: &[EventKind]) -> bool {
    kinds.iter().all(|kind| end.message_counts.contains_key(kind.topic))
}

/// The choice of detectors, and their rules.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Settings {
    /// Names of the detectors.
    pub detectors: Vec<&'static str>,
    /// [`SlipRules::merge_gap_s`].
    pub merge_gap_s: f64,
    /// [`SlipRules::min_blocks`].
    pub min_blocks: u32,
    /// [`Scales::link_time_ratio`]; None for the value of each run.
    pub link_time_ratio: Option<f64>,
}

impl Default for Settings {
    /// The settings of a live run.
    fn default() -> Settings {
        let SlipRules { merge_gap_s, min_blocks } = SlipRules::EVERY_SLIP;
        Settings { detectors: names(), merge_gap_s, min_blocks, link_time_ratio: None }
    }
}

/// The settings as TOML.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    detectors: Option<Spanned<Vec<Spanned<String>>>>,
    merge_gap_s: Option<Spanned<f64>>,
    min_blocks: Option<Spanned<i64>>,
    link_time_ratio: Option<Spanned<f64>>,
}

impl Settings {
    /// Reads a settings file; keys that it omits have the values of a live run.
    ///
    /// # Errors
    /// A message with file, line and column, if it cannot be read or contains a value that is not accepted.
    pub fn read(file: &Path) -> Result<Settings, String> {
        let name = file.display();
        let text =
            text::read(file).map_err(|problem| format!("{name}: {problem} (accepted: a TOML file)"))?;
        Settings::parse(&text).map_err(|(place, problem)| {
            let place = Lines::of(&text).place(&text, place);
            format!("{name}:{place}: {problem}")
        })
    }

    /// Parses settings.
    ///
    /// # Errors
    /// A byte offset and a description, if a value is not accepted.
    pub fn parse(text: &str) -> Result<Settings, typed::Refused> {
        check_toml(text).map_err(|too_long| (0, too_long.to_string()))?;
        let written: Written = typed::parse(text, "`asperity replay --help`")?;
        let mut settings = Settings::default();
        if let Some(names) = written.detectors {
            let accepted = self::names().join(", ");
            let mut chosen = Vec::new();
            for name in names.get_ref() {
                let refused = |problem: String| Err((name.span().start, problem));
                match DETECTORS.iter().find(|(known, _)| known == name.get_ref()) {
                    Some((known, _)) if !chosen.contains(known) => chosen.push(*known),
                    Some(_) => return refused(format!("detectors names {:?} twice", name.get_ref())),
                    None => {
                        return refused(format!("detectors = {:?} (accepted: {accepted})", name.get_ref()));
                    }
                }
            }
            if chosen.is_empty() {
                return Err((names.span().start, format!("detectors = [] (accepted: some of {accepted})")));
            }
            settings.detectors.retain(|name| chosen.contains(name));
        }
        let number = |key: &str, value: &Spanned<f64>, is_accepted: fn(f64) -> bool, accepted: &str| {
            let number = *value.get_ref();
            let problem = || (value.span().start, format!("{key} = {number} (accepted: {accepted})"));
            Some(number).filter(|number| number.is_finite() && is_accepted(*number)).ok_or_else(problem)
        };
        if let Some(gap) = &written.merge_gap_s {
            let from_zero = "a number of seconds from 0";
            settings.merge_gap_s = number("merge_gap_s", gap, |gap_s| gap_s >= 0.0, from_zero)?;
        }
        if let Some(ratio) = &written.link_time_ratio {
            let ratio = number("link_time_ratio", ratio, |ratio| ratio > 0.0, "a number above 0")?;
            settings.link_time_ratio = Some(ratio);
        }
        if let Some(blocks) = written.min_blocks {
            let (at, blocks, most) = (blocks.span().start, *blocks.get_ref(), u32::MAX);
            let accepted = u32::try_from(blocks).ok().filter(|&blocks| blocks >= 1);
            settings.min_blocks = accepted.ok_or_else(|| {
                (at, format!("min_blocks = {blocks} (accepted: a whole number from 1 to {most})"))
            })?;
        }
        Ok(settings)
    }

    /// Starts the detectors for a run with that header and, unless it is lost, that scenario.
    pub fn start(&self, header: &RunHeader, scenario: Option<&Scenario>) -> Detectors {
        let (contacts, time_grid) = (header.contacts(), header.time_grid());
        let sensors = header.sensors.as_ref();
        let is_its = |scenario: &&Scenario| scenario.slider.contacts() == header.blocks;
        let differ = |scenario: &&Scenario| scenario.has_spring_factors() || scenario.slider.is_in_medium();
        let plan = scenario.filter(is_its).filter(differ).map(Plan::new);
        self.for_run(contacts, time_grid, header.scales, header.parts(), sensors, plan.as_ref())
    }

    /// A plan is needed where contacts differ in size or stiffness.
    fn for_run(
        &self,
        blocks: Contacts,
        time_grid: TimeGrid,
        scales: Scales,
        parts: Parts,
        sensors: Option<&Sensors>,
        plan: Option<&Plan>,
    ) -> Detectors {
        let link_time_ratio = self.link_time_ratio.unwrap_or(scales.link_time_ratio);
        let links = Links {
            t_link_s: Scales { link_time_ratio, ..scales }.link_s(),
            time_grid,
            spacing_m: scales.block_length_m,
            modulus_n_per_m: scales.modulus_n_per_m,
            interfacial_stiffness_n_per_m: scales.interfacial_stiffness_n_per_m,
            first_share: plan.and_then(|plan| plan.medium.as_ref()).map_or(1.0, |medium| medium.weight(0)),
        };
        let rules = SlipRules { merge_gap_s: self.merge_gap_s, min_blocks: self.min_blocks };
        let run = OfRun { blocks, links, parts, sensors: sensors.cloned().map(Arc::new) };
        let chosen = DETECTORS.iter().filter(|(name, _)| self.detectors.contains(name));
        Detectors::new(blocks, rules, chosen.map(|(_, start)| start(run.clone())).collect())
            .with_ruptures(links.tracker(blocks))
            .with_spring_factors(plan.map_or_else(Vec::new, Plan::spring_factors))
    }
}

#[cfg(test)]
mod tests {
    use super::Settings;

    #[test]
    fn settings_say_what_differs_from_a_live_run() {
        assert_eq!(Settings::parse(""), Ok(Settings::default()));
        let settings = Settings::parse(
            "detectors = [\"global\", \"onset\"]\nmerge_gap_s = 1e-4\nmin_blocks = 2\nlink_time_ratio = 30",
        )
        .unwrap();
        // In the order of the log, independent of the file.
        assert_eq!(
            settings,
            Settings {
                detectors: vec!["onset", "global"],
                merge_gap_s: 1e-4,
                min_blocks: 2,
                link_time_ratio: Some(30.0)
            }
        );
    }

    #[test]
    fn bad_settings_are_refused_where_they_stand() {
        for (text, place, problem) in [
            ("merge_gap_s = -1.0", 14, "merge_gap_s = -1 (accepted: a number of seconds from 0)"),
            ("merge_gap_s = nan", 14, "merge_gap_s = NaN"),
            ("min_blocks = 0", 13, "min_blocks = 0 (accepted: a whole number from 1 to 4294967295)"),
            ("min_blocks = 99999999999", 13, "min_blocks = 99999999999"),
            (
                "detectors = [\"onset\", \"slip\"]",
                22,
                "\"slip\" (accepted: onset, extent, global, rupture, arrival)",
            ),
            ("detectors = [\"onset\", \"onset\"]", 22, "twice"),
            ("detectors = []", 12, "[]"),
            ("\nminblocks = 2", 1, "minblocks: unknown key; did you mean min_blocks? (accepted: detectors, "),
            ("min_blocks = \"two\"", 13, "\"two\" is not accepted (accepted: a whole number"),
            ("link_time_ratio = 0", 18, "link_time_ratio = 0 (accepted: a number above 0)"),
            ("link_time_ratio = inf", 18, "link_time_ratio = inf (accepted: a number above 0)"),
        ] {
            let (at, said) = Settings::parse(text).unwrap_err();
            assert!(at == place && said.contains(problem), "{text}: {at}: {said}");
        }
    }
}
