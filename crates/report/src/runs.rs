//! Runs on a page: the pair of load curve and space-time map, the table of ruptures, and for each run its
//! parameters, its numbers and its widest ruptures in words.

use std::collections::BTreeMap;

use asperity_model::scenario::keys::Key;
use asperity_numbers::claim::Claim;
use asperity_numbers::text::what_marks_mean;
use asperity_numbers::{Summary, front_speed_m_per_s};
use asperity_record::{rounded as round, unit_of_time};
use serde::Serialize;

use crate::claims::{beside, link};
use crate::figures::{Figure, is_beside_one};
use crate::html::markup::{Cell, Row, counted, json, paragraph, table, text};
use crate::measured::are_forces;
use crate::over_area::{self, OverArea};
use crate::page_collector::CollectedRupture;
use crate::parameter_table::{self, Parameters};
use crate::study::{Link, Run};
use crate::symbols::{lettered, number, rounded, time};
use crate::verdict::{SPEED_DIGITS, verdict};

/// Most ruptures of a run described in words.
const LISTED: usize = 10;
/// Keys in which runs differ that have a column in the table of runs.
const KEYS_SHOWN: usize = 6;
/// Numbers of the summary with a column, and its heading.
const NUMBERS: [(&str, &str); 6] = [
    ("precursor_count", "#precursors"),
    ("global_rupture_count", "#global slips"),
    ("first_global_rupture_onset_s", "#first global slip (s)"),
    ("first_global_rupture_ft_fn", "#F_T/F_N there"),
    ("front_speed_over_wave_speed_ratio", "#v/c"),
    ("recurrence_steady_s", "#recurrence (s)"),
];

/// Data of a run for the script.
#[derive(Serialize)]
struct Known<'a> {
    name: &'a str,
    /// Blocks along the slider: over an area its columns of contacts.
    blocks: u32,
    /// How many rows of contacts there are, over an area.
    #[serde(skip_serializing_if = "Option::is_none")]
    rows: Option<u32>,
    /// Whether they are the sensors of a recording.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    sensors: bool,
    /// What times are told in, if not in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<&'static str>,
    /// The place of the first block, and from one to the next: x, mm, or on a fault line depth, km.
    #[serde(skip_serializing_if = "Option::is_none")]
    place: Option<[f64; 2]>,
    /// Whether places are depths.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    down: bool,
    /// Length of a step, in that unit.
    dt: f64,
    /// The last step that went by: a run may stop before it was planned to, and a log break off.
    last: u64,
    /// The missing part, if the run is incomplete.
    lacks: Option<&'a str>,
    /// Speed of waves, m/s.
    c: Option<f64>,
    /// Lines across the load curve.
    lines: Vec<(&'static str, f64)>,
    /// Fronts have passages of block 1 and of blocks that far apart.
    stride: u32,
    /// Over an area: how ruptures passed the contacts.
    #[serde(skip_serializing_if = "Option::is_none")]
    area: Option<OverArea>,
    /// Steps of the load curve, and `F_T / F_N` there.
    at: Vec<u64>,
    load: Vec<f64>,
    ruptures: Vec<RuptureRow>,
    events: &'a [(u64, Option<u64>, u32, u32)],
    /// How many there are of both, on the page or not.
    total: [u64; 2],
}

/// Number; onset and end in steps; first, last and first sliding block; kind (0 rupture, 1 precursor,
/// 2 global slip) and whether open; `F_T / F_N` at onset and end; speed of the front, m/s; mean slip, m; the front.
type RuptureRow =
    (u64, u64, Option<u64>, u32, u32, u32, u8, u8, f64, Option<f64>, Option<f64>, Option<f64>, Option<Front>);

/// Of each block that a front passed, the steps from the onset of the rupture to the block's first sliding step, and to
/// the first after its last.
type Front = (Vec<u64>, Vec<Option<u64>>);

/// The unit in which all of these runs are told their times, with its length, s.
fn unit_of(runs: &[Run]) -> (f64, &'static str) {
    let durations = runs.iter().map(|run| run.header.time_grid().time_s(run.header.steps));
    unit_of_time(durations.fold(f64::INFINITY, f64::min))
}

/// Whether all of them are fault lines, along which places are depths.
fn are_lines(runs: &[Run]) -> bool {
    runs.iter().all(|run| run.scenario.slider.is_in_medium())
}

/// What tells where things are in these runs: a length, if it is one and the same, or words for numbered places.
fn axis(runs: &[Run]) -> &'static str {
    let mut axes: Vec<&str> =
        runs.iter().map(|run| Places::of(run).map_or("sensors", |places| places.axis)).collect();
    axes.dedup();
    if let [axis] = axes[..] { axis } else { "blocks" }
}

/// The script element of one of the runs: attributes and content.
pub(crate) fn data(run: &Run, all: &[Run]) -> (String, String) {
    let (unit_s, unit) = unit_of(all);
    let digits = |value: f64| round(value, 6);
    let contacts = run.header.contacts();
    let row = |seen: &CollectedRupture| -> RuptureRow {
        let rupture = &seen.rupture;
        (
            rupture.rupture,
            rupture.onset_step,
            rupture.end_step,
            rupture.first_block,
            rupture.last_block,
            contacts.column(rupture.nucleation_block),
            kind(run, seen).0,
            u8::from(rupture.open),
            digits(rupture.ft_fn_onset),
            rupture.ft_fn_end.map(digits),
            front_speed_m_per_s(rupture, contacts, run.summary.wave_speed_m_per_s).map(digits),
            rupture.mean_slip_m.map(|slip| round(slip, 4)),
            seen.front.as_ref().map(|front| {
                let since = |step: u64| step.saturating_sub(rupture.onset_step);
                front.iter().map(|(arrival, stop)| (since(*arrival), stop.map(since))).unzip()
            }),
        )
    };
    let friction = &run.scenario.friction;
    let known = Known {
        name: &run.name,
        blocks: contacts.columns(),
        rows: contacts.is_area().then(|| contacts.rows()),
        sensors: run.header.parts().recording,
        unit: Some(unit).filter(|unit| *unit != "s"),
        place: Places::of(run).filter(|places| axis(all) == places.axis).map(|places| places.of),
        down: are_lines(all),
        dt: run.header.time_step_s / unit_s,
        last: last_step(run),
        lacks: run.lacks.as_deref(),
        c: run.summary.wave_speed_m_per_s,
        lines: if run.header.parts().recording {
            Vec::new()
        } else if run.scenario.has_state() {
            vec![("f_0", friction.reference_coefficient)]
        } else {
            vec![("μ_s", friction.static_coefficient), ("μ_d", friction.dynamic_coefficient)]
        },
        stride: run.collected.block_stride,
        area: over_area::data(run),
        at: run.collected.curve.iter().map(|point| point.0).collect(),
        load: run.collected.curve.iter().map(|point| digits(point.1)).collect(),
        ruptures: run.collected.ruptures.iter().map(row).collect(),
        events: &run.collected.events,
        total: [run.collected.rupture_count, run.collected.event_count],
    };
    (format!(" class=\"run\" data-run=\"{}\"", text(&run.name)), json(&known))
}

/// The last step that went by.
fn last_step(run: &Run) -> u64 {
    let simulated = (run.summary.simulated_s / run.header.time_step_s).round() as u64;
    let curve = run.collected.curve.last().map_or(0, |point| point.0);
    // In a log that breaks off, events may come after the last record.
    let ruptures =
        run.collected.ruptures.iter().map(|seen| seen.rupture.end_step.unwrap_or(seen.rupture.onset_step));
    let events = run.collected.events.iter().map(|event| event.1.unwrap_or(event.0));
    ruptures.chain(events).fold(simulated.max(curve), u64::max)
}

/// Where the blocks of a simulated slider are.
pub(crate) struct Places {
    /// The place of the first, and from one to the next: x, mm, or depth, km.
    of: [f64; 2],
    /// What they are called, with the unit.
    axis: &'static str,
}

impl Places {
    /// Of a run, unless it is a recording, whose sensors have numbers.
    pub(crate) fn of(run: &Run) -> Option<Places> {
        let spacing_m = run.header.scales.block_length_m;
        let first = run.scenario.medium.first_node.cells();
        match run.scenario.slider.is_in_medium() {
            _ if run.header.parts().recording => None,
            true => Some(Places { of: [first * spacing_m / 1e3, spacing_m / 1e3], axis: "depth (km)" }),
            false => Some(Places { of: [0.0, spacing_m * 1e3], axis: "x (mm)" }),
        }
    }

    /// The place of a block, counted from 1.
    pub(crate) fn at(&self, block: u32) -> String {
        rounded(self.of[0] + f64::from(block - 1) * self.of[1], 5)
    }

    /// From one block to another, without the unit.
    pub(crate) fn span(&self, first: u32, last: u32) -> String {
        if first == last { self.at(first) } else { format!("{} to {}", self.at(first), self.at(last)) }
    }
}

/// The kind of a rupture: its number and its word. On a fault line none of them begins at a driven end.
fn kind(run: &Run, seen: &CollectedRupture) -> (u8, &'static str) {
    if run.scenario.slider.is_in_medium() {
        (0, "rupture")
    } else if seen.rupture.reached_every_block {
        (2, "global slip")
    } else if seen.is_precursor {
        (1, "precursor")
    } else {
        (0, "rupture")
    }
}

/// The table of runs: their numbers, and where they differ.
pub(crate) fn table_of(runs: &[Run], asked: &[Parameters], differing: &[&'static Key]) -> String {
    if runs.len() < 2 {
        return String::new();
    }
    let shown = &differing[..differing.len().min(KEYS_SHOWN)];
    let mut headings: Vec<String> = vec!["run".to_owned()];
    headings.extend(shown.iter().map(|key| {
        let unit = parameter_table::unit(key);
        let name = parameter_table::name(key);
        if unit.is_empty() { format!("#{name}") } else { format!("#{name} ({})", lettered(unit)) }
    }));
    headings.extend(NUMBERS.iter().map(|(_, heading)| lettered(heading)));
    let rows = runs.iter().zip(asked).map(|(run, asked)| {
        let mut cells = vec![Cell::Html(link(&run.name))];
        cells.extend(shown.iter().map(|key| match asked.get(key.path) {
            Some(toml::Value::Float(value)) => Cell::rounded(*value, 6),
            Some(other) => parameter_table::cell(other),
            None => Cell::None,
        }));
        let numbers: BTreeMap<_, _> =
            Summary::KEYS.iter().map(|key| &*key.column.name).zip(run.summary.values()).collect();
        cells.extend(NUMBERS.map(|(key, _)| Cell::rounded(numbers[key].as_f64(), 5)));
        Row::from(cells)
    });
    let more = match differing.len() - shown.len() {
        0 => String::new(),
        more => {
            let more = counted(more as u64, "more key");
            paragraph(&format!("They differ in {more}, which stand with each run."))
        }
    };
    format!("{}{more}", table("runs-in-numbers", "", &headings, rows))
}

/// The pair of load curve and map, of whichever run is chosen.
pub(crate) fn pair(runs: &[Run]) -> String {
    // Or there is none.
    if are_forces(runs) {
        return String::new();
    }
    let place = match runs.iter().all(|run| run.header.parts().recording) {
        true => "sensor",
        false if are_lines(runs) => "node",
        false if over_area::is_needed(runs) => "column",
        false => "block",
    };
    let options: String =
        runs.iter().map(|run| format!("<option value=\"{0}\">{0}</option>", text(&run.name))).collect();
    let chooser = format!(
        "<p class=\"needs-script\"><label{}>run <select id=\"run\">{options}</select></label></p>\n\
         <div id=\"answers\" class=\"needs-script\"></div>\n",
        if runs.len() == 1 { " hidden" } else { "" }
    );
    format!(
        "<p class=\"without-script\">The load curve and the space-time map are drawn by a script, which this browser does \
         not run. What they show is in words below.</p>\n\
         {chooser}<p id=\"lacks\" class=\"lacks\" hidden></p>\n\
         <figure id=\"pair\" class=\"needs-script\">\n\
         <div id=\"load\" tabindex=\"0\" role=\"application\" aria-roledescription=\"load curve\" aria-label=\"Load curve: \
         F_T over F_N against time, with the onsets of precursors and global slips. Arrow keys go from rupture to \
         rupture.\" aria-describedby=\"keys\"></div>\n\
         <canvas id=\"map\" class=\"map\" tabindex=\"0\" role=\"application\" aria-roledescription=\"space-time map\" \
         aria-label=\"Space-time map: {place} against time; every rupture a rectangle from its onset to its end and from its \
         first to its last {place}, or, zoomed in, the times at which its front came to each {place} and at which each \
         stopped. Arrow keys go from rupture to rupture.\" aria-describedby=\"keys\"></canvas>\n</figure>\n\
         <p class=\"needs-script\"><span id=\"chosen\" role=\"status\" aria-live=\"polite\">No rupture is picked.</span> \
         <button id=\"to-front\" type=\"button\" hidden>zoom to its front</button></p>\n\
         {over_area}<div class=\"controls needs-script\">\
         <button type=\"button\" data-action=\"in\">zoom in</button><button type=\"button\" data-action=\"out\">zoom \
         out</button><button type=\"button\" data-action=\"left\" aria-label=\"earlier\">◀</button>\
         <button type=\"button\" data-action=\"right\" aria-label=\"later\">▶</button>\
         <button type=\"button\" data-action=\"whole\">whole run</button>\
         <button type=\"button\" data-action=\"save\">save map as PNG</button></div>\n\
         <div class=\"controls needs-script\"><fieldset><legend>show</legend>\
         <label><input type=\"checkbox\" data-kind=\"2\" checked> <canvas class=\"key\" data-look=\"global\" \
         aria-hidden=\"true\"></canvas>global slips</label>\
         <label><input type=\"checkbox\" data-kind=\"1\" checked> <canvas class=\"key\" data-look=\"precursor\" \
         aria-hidden=\"true\"></canvas>precursors</label>\
         <label><input type=\"checkbox\" data-kind=\"0\" checked> <canvas class=\"key\" data-look=\"rupture\" \
         aria-hidden=\"true\"></canvas>other ruptures</label>\
         <label>of <input id=\"least\" type=\"number\" min=\"1\" value=\"1\" size=\"5\"> {place}s or more</label>\
         <label><input id=\"in-view\" type=\"checkbox\"> in view only</label>\
         <label><input id=\"events\" type=\"checkbox\"> <canvas class=\"key\" data-look=\"event\" \
         aria-hidden=\"true\"></canvas>slip events</label></fieldset></div>\n\
         <p class=\"soft needs-script\">Above, {ratio} against time; below, the ruptures, each from its onset to its end \
         and from its first to its last {place}, none drawn thinner than 1.5 dots. Zoomed to a rupture, the map shows when \
         its front came to each {place}, and when each {place} stopped. A rupture picked in the curve, the map or the table \
         is shown in all three. <span id=\"keys\">Keys: ← and → pick the rupture before and after, Enter zooms to it, Escape \
         lets it go; Shift with ← and → moves, + and − zoom, 0 shows the whole run.</span> Drag to move the map, or across \
         the curve to zoom; the wheel zooms once the picture has been clicked. <span id=\"held\"></span></p>\n\
         <p id=\"listed\" class=\"soft needs-script\" role=\"status\"></p>\n\
         <div id=\"ruptures\" class=\"long needs-script\" data-places=\"{places}\"{unit}></div>\n\
         <div id=\"hover\" aria-hidden=\"true\"></div>\n",
        places = match axis(runs) {
            "blocks" => format!("{place}s"),
            axis => axis.to_owned(),
        },
        unit = if unit_of(runs).1 == "s" { "" } else { " data-unit=\"years\"" },
        over_area = over_area::place_of_script(runs),
        ratio = lettered("F_T/F_N")
    )
}

/// The section about each run.
pub(crate) fn details(
    runs: &[Run],
    asked: &[Parameters],
    differing: &[&'static Key],
    claims: &[Claim],
    figures: &[Figure],
    sketches: &[String],
) -> String {
    let mut out = String::new();
    for (place, run) in runs.iter().enumerate() {
        // A page of one run begins with its verdict.
        let mut body = if runs.len() == 1 { String::new() } else { verdict(run) };
        if let Some(lacks) = &run.lacks {
            body += &format!("<p class=\"lacks\">Not all of this run is there: {}</p>\n", text(lacks));
        }
        body += &format!("<p>{}</p>\n", lettered(&run.scenario.summary));
        for (key, value) in &run.note {
            body += &format!("<p>{}: {}</p>\n", text(key), text(value));
        }
        if !differing.is_empty() {
            let told = differing.iter().filter_map(|key| {
                let value = match asked.get(place)?.get(key.path)? {
                    toml::Value::Float(value) => number(*value),
                    toml::Value::Array(values) => counted(values.len() as u64, "value"),
                    other => text(other.as_str().map_or_else(|| other.to_string(), str::to_owned)),
                };
                let (name, unit) = (parameter_table::name(key), lettered(parameter_table::unit(key)));
                Some(format!("{name} = {value} {unit}").trim_end().to_owned())
            });
            body += &format!("<p>{}</p>\n", told.collect::<Vec<_>>().join("; "));
        }
        if place > 0 && sketches[place] != sketches[0] {
            body += &sketches[place];
        }
        let own: Vec<&Claim> =
            claims.iter().filter(|claim| claim.run == run.name && !is_beside_one(claim, figures)).collect();
        body += &beside(&own);
        body += &over_area::figure(run);
        body += &widest(run);
        body += &numbers(run);
        body += &links(&run.links);
        let part =
            if run.lacks.is_some() { " <span class=\"lacks\">not all of it is there</span>" } else { "" };
        // A page of one run has said it in its verdict.
        let (open, short) =
            if runs.len() == 1 { (" open", String::new()) } else { ("", in_short(&run.summary)) };
        let title = format!("{} <span class=\"soft\">{short}</span>{part}", text(&run.name));
        out += &format!(
            "<details class=\"of-run\" id=\"run-{}\"{open}><summary>{title}</summary>\n{body}</details>\n",
            text(&run.name)
        );
    }
    out
}

/// A run in a line, as HTML.
fn in_short(summary: &Summary) -> String {
    let counted = |count: Option<u64>, thing| count.map(|count| counted(count, thing));
    if let Some(of) = summary.of_recording.as_ref().filter(|_| summary.rupture_count.is_none()) {
        return counted(of.load_drop_count, "load drop").unwrap_or_default();
    }
    // By its digits and not by decimals: short runs slip within microseconds.
    let onset = summary
        .first_global_rupture_onset_s
        .map(|onset| format!("first global slip at {}", time(onset, summary.simulated_s)));
    let parts = [
        counted(Some(summary.blocks.into()), if summary.of_recording.is_some() { "sensor" } else { "block" })
            .map(|blocks| match unit_of_time(summary.simulated_s).1 {
                "s" => format!("{blocks}, {} s", number(summary.simulated_s)),
                _ => format!("{blocks}, {}", time(summary.simulated_s, summary.simulated_s)),
            }),
        counted(summary.rupture_count, "rupture"),
        counted(summary.precursor_count, "precursor"),
        onset.or_else(|| Some("no slip of the whole slider".to_owned())),
    ];
    parts.into_iter().flatten().collect::<Vec<_>>().join(", ")
}

/// The widest ruptures in words, for those without scripts and for print; of a recording with lengths and errors.
fn widest(run: &Run) -> String {
    let mut widest: Vec<&CollectedRupture> = run.collected.ruptures.iter().collect();
    widest.sort_by_key(|seen| std::cmp::Reverse(seen.rupture.slipped()));
    widest.truncate(LISTED);
    if widest.is_empty() {
        return String::new();
    }
    let c_m_per_s = run.summary.wave_speed_m_per_s;
    let (unit_s, unit) = unit_of_time(run.summary.simulated_s);
    let is_line = run.scenario.slider.is_in_medium();
    let over_c = |speed: Option<f64>| speed.zip(c_m_per_s).map(|(speed, c)| speed / c);
    let rows = widest.into_iter().map(|seen| {
        let rupture = &seen.rupture;
        let drop = rupture.ft_fn_end.map(|end| rupture.ft_fn_onset - end);
        let speed = front_speed_m_per_s(rupture, run.header.contacts(), c_m_per_s);
        let is_up = speed == rupture.front_speed_up_m_per_s;
        let error =
            if is_up { rupture.front_speed_up_error_m_per_s } else { rupture.front_speed_down_error_m_per_s };
        let [length, length_error] = run.header.length_ratio(rupture.last_block);
        Row::from(vec![
            Cell::number(rupture.rupture),
            Cell::text(kind(run, seen).1),
            if unit_s == 1.0 {
                Cell::number(rupture.onset_s)
            } else {
                Cell::rounded(Some(rupture.onset_s / unit_s), 8)
            },
            Cell::text(match Places::of(run) {
                Some(places) => places.span(rupture.first_block, rupture.last_block),
                None => format!("{} to {}", rupture.first_block, rupture.last_block),
            }),
            Cell::estimate(Some(rupture.ft_fn_onset), rupture.ft_fn_error, 4),
            match run.header.parts().recording {
                true => Cell::estimate(Some(length), Some(length_error), 3),
                false => Cell::rounded(drop.map(|drop| drop * 1e3), 3),
            },
            Cell::estimate(over_c(speed), over_c(error), SPEED_DIGITS),
            Cell::rounded(rupture.mean_slip_m.map(|slip| slip * if is_line { 1.0 } else { 1e6 }), 3),
        ])
    });
    let [ratio, length] = ["#F_T/F_N", "#L_p/L"].map(lettered);
    let fifth = if run.header.parts().recording { &*length } else { "#drop (10⁻³)" };
    let (onset, slip) =
        (format!("#onset ({unit})"), if is_line { "#mean slip (m)" } else { "#mean slip (µm)" });
    let headings = ["#rupture", "kind", &onset, axis(std::slice::from_ref(run)), &ratio, fifth, "#v/c", slip];
    let caption = match run.collected.rupture_count {
        count if count > LISTED as u64 => format!("The {LISTED} widest of {count} ruptures"),
        _ => "Its ruptures, the widest first".to_owned(),
    };
    table("", &caption, &headings, rows)
}

/// The numbers of a summary by their groups.
fn numbers(run: &Run) -> String {
    let marks = if run.header.parts().recording { String::new() } else { what_marks_mean() };
    let known = run.summary.shown().into_iter().filter(|(_, value)| !value.is_null());
    let rows = known.map(|(key, value)| {
        let value = serde_json::from_value(value).expect("numbers of a summary are cells");
        Row::from(vec![
            Cell::text(key.group),
            Cell::Html(lettered(&key.label())),
            Cell::of(&value, 6),
            Cell::text(key.column.unit.filter(|unit| *unit != "1").unwrap_or_default()),
            Cell::text(if run.header.parts().recording { "" } else { key.convergence.mark() }),
        ])
    });
    format!(
        "<details><summary>All numbers of this run</summary>\n{}{}</details>\n",
        table("", "", &["of", "number", "#value", "unit", "worth"], rows),
        marks.lines().map(paragraph).collect::<String>()
    )
}

/// Files that a reader may want next.
pub(crate) fn links(links: &[Link]) -> String {
    if links.is_empty() {
        return String::new();
    }
    let all: Vec<String> = links
        .iter()
        .map(|link| format!("<a href=\"{}\">{}</a>", text(&link.path), text(&link.words)))
        .collect();
    format!("<p>Files: {}</p>\n", all.join(", "))
}

#[cfg(test)]
mod tests {
    use asperity_numbers::Summarizer;
    use asperity_record::RunHeader;

    use super::in_short;

    #[test]
    fn the_onset_of_a_short_run_is_not_rounded_to_nothing() {
        let header = RunHeader {
            record_schema_version: asperity_record::RECORD_SCHEMA_VERSION,
            scenario_hash: String::new(),
            run_id: String::new(),
            code_version: "c0ffee".to_owned(),
            scenario: "short".to_owned(),
            parameter_set: "as-coded".to_owned(),
            solver: "fast".to_owned(),
            blocks: 10,
            rows: 1,
            junction_count: 0,
            flags: asperity_record::Parts::default(),
            time_step_s: 1e-8,
            longest_stable_step_s: None,
            steps: 10_000,
            sensors: None,
            scales: asperity_record::Scales {
                block_length_m: 0.01,
                block_time_s: 1e-4,
                link_time_ratio: 100.0,
                modulus_n_per_m: 5e6,
                interfacial_stiffness_n_per_m: 2e6,
            },
        };
        let mut summary = Summarizer::new("short", &header, None).finish(true, None);
        summary.first_global_rupture_onset_s = Some(2.3e-5);
        summary.simulated_s = 1e-4;
        let words = in_short(&summary);
        assert!(words.starts_with("10 blocks, 10<sup>−4</sup> s, "), "{words}");
        assert!(words.ends_with("first global slip at 2.3 × 10<sup>−5</sup> s"), "{words}");
        summary.first_global_rupture_onset_s = Some(1.605_457_5);
        assert!(in_short(&summary).ends_with(" at 1.6055 s"));
    }
}
