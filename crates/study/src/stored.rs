//! The stored result of a run, compressed by zstd: a line with its summary as JSON, and a line per
//! event, with its topic and a tab before it.
//!
//! It is read line by line, however much it decompresses to, and checked against the plan: it must
//! be of the run under its number, and possible for that run.

use std::cell::RefCell;
use std::io::{self, BufRead, BufReader};

use asperity_numbers::Summary;
use asperity_record::bounds::{LONGEST_LINE_BYTES, LONGEST_REASON_BYTES};
use asperity_record::{Cell, Column, ColumnKind, Event, EventKind, Rupture, SlipEvent};
use zstd::bulk::Compressor;
use zstd::stream::read::Decoder;

use crate::axis::Value;
use crate::file::Keep;
use crate::lines::{Lines, problem_of};
use crate::plan::{Common, Plan, Row};

/// The level of compression: higher ones need more time than a short run.
const LEVEL: i32 = 1;

/// The largest window for decompression, as a power of two. [`LEVEL`] uses less than a megabyte.
const WINDOW_LOG: u32 = 23;

/// A kind of events in a study, and how to check them.
#[derive(Debug)]
pub(crate) struct KeptEvents {
    pub(crate) kind: EventKind,
    /// The column of the event's number in the run, from 0.
    number: usize,
    /// Columns of blocks, numbered from 1.
    blocks: Vec<usize>,
    /// Columns of steps, bounded by the last one of the run.
    steps: Vec<usize>,
    /// The number of events according to the summary.
    count: fn(&Summary) -> Option<u64>,
}

/// The kinds of events stored for each run of a plan.
pub(crate) fn kept_events(plan: &Plan) -> Vec<KeptEvents> {
    let parts = plan.parts();
    let of = |kind: EventKind, number: &str, count| {
        let where_name = |fits: &dyn Fn(&Column) -> bool| {
            (0..kind.columns.len()).filter(|n| fits(&kind.columns[*n])).collect::<Vec<_>>()
        };
        let number = where_name(&|column| column.name == number)[0];
        // Columns and rows are no more than contacts.
        let blocks = where_name(&|column| {
            let is_place = |ending: &str| column.name.ends_with(ending);
            column.kind == ColumnKind::Count && ["_block", "_across", "contacts"].into_iter().any(is_place)
        });
        let steps = where_name(&|column| column.kind == ColumnKind::Step && column.name.ends_with("_step"));
        KeptEvents { kind, number, blocks, steps, count }
    };
    let all = [
        (
            Keep::Events,
            of(EventKind::of::<SlipEvent>().with(parts), "event", |summary| Some(summary.event_count)),
        ),
        (
            Keep::Ruptures,
            of(EventKind::of::<Rupture>().with(parts), "rupture", |summary| summary.rupture_count),
        ),
    ];
    all.into_iter().filter(|(kept, _)| plan.common.keep.contains(kept)).map(|(_, events)| events).collect()
}

/// The line of an event.
pub(crate) fn line_of(event: &Event) -> String {
    format!("{}\t{}\n", event.topic(), event.json())
}

/// Packs a summary and the lines of events.
pub(crate) fn pack(summary: &Summary, lines: &str) -> io::Result<Vec<u8>> {
    let mut text = serde_json::to_string(summary)?;
    if text.len() > LONGEST_LINE_BYTES {
        let problem = format!("a summary of {} bytes (accepted: up to {LONGEST_LINE_BYTES})", text.len());
        return Err(io::Error::other(problem));
    }
    text.push('\n');
    text.push_str(lines);
    thread_local! {
        /// Building its tables costs more time than compressing a short result.
        static PACKER: RefCell<Option<Compressor<'static>>> = const { RefCell::new(None) };
    }
    PACKER.with_borrow_mut(|packer| {
        let packer = match packer {
            Some(packer) => packer,
            none => {
                let packer = none.insert(Compressor::new(LEVEL)?);
                // Sees a changed bit that still decompresses to valid lines.
                packer.include_checksum(true)?;
                packer
            }
        };
        packer.compress(text.as_bytes())
    })
}

/// The stored part of a reason.
pub fn reason_kept(reason: &str) -> &str {
    &reason[..reason.floor_char_boundary(LONGEST_REASON_BYTES)]
}

/// Reads the reason of a failed run.
pub(crate) fn reason(content: impl BufRead) -> Result<String, String> {
    let mut bytes = Vec::new();
    let most = LONGEST_REASON_BYTES as u64 + 1;
    io::Read::read_to_end(&mut content.take(most), &mut bytes).map_err(|error| error.to_string())?;
    if bytes.len() > LONGEST_REASON_BYTES {
        return Err(format!("a reason of more than {LONGEST_REASON_BYTES} bytes (accepted: fewer)"));
    }
    String::from_utf8(bytes).map_err(|_| "a reason that is not UTF-8 (accepted: text)".to_owned())
}

/// Reads a result: first its summary, then its events one after the other.
pub(crate) struct Stored<'a, R: BufRead> {
    lines: Lines<BufReader<Decoder<'static, R>>>,
    kept: &'a [KeptEvents],
    /// Number of events of each kind read so far.
    counts: Vec<u64>,
    pub(crate) summary: Summary,
}

impl<'a, R: BufRead> Stored<'a, R> {
    /// Opens the result of a run of a plan.
    ///
    /// # Errors
    /// A message with line, key, value and the accepted values, if it is not of this run.
    pub(crate) fn open(
        content: R,
        common: &Common,
        row: &Row,
        kept: &'a [KeptEvents],
    ) -> Result<Stored<'a, R>, String> {
        let unpacked = |error: io::Error| error.to_string();
        let mut decoder = Decoder::with_buffer(content).map_err(unpacked)?.single_frame();
        decoder.window_log_max(WINDOW_LOG).map_err(unpacked)?;
        let mut lines = Lines::of(BufReader::new(decoder));
        let line = lines.next(LONGEST_LINE_BYTES).map_err(unpacked)?.unwrap_or_default();
        let summary: Summary = serde_json::from_str(line).map_err(|error| {
            format!("line 1: {} (accepted: the summary of a run by this program)", problem_of(&error))
        })?;
        if summary.run != row.run.to_string() {
            return Err(format!(
                "its summary is of run {} (accepted: {}, under which it stands)",
                summary.run, row.run
            ));
        }
        for (key, value) in common.keys.iter().zip(&row.values) {
            let said = match key.as_str() {
                "time.step_s" => Value::Number(summary.time_step_s),
                "parameter_set" => Value::Text(summary.parameter_set.clone()),
                _ => continue,
            };
            if !said.same(value) {
                return Err(format!("its summary has {key} = {said} (accepted: {value}, as it is planned)"));
            }
        }
        Ok(Stored { lines, kept, counts: vec![0; kept.len()], summary })
    }

    /// Returns the next event: the index of its kind, and its row; `None` at the end.
    ///
    /// # Errors
    /// A message, if an event is invalid, or their number contradicts the summary.
    pub(crate) fn next_event(&mut self) -> Result<Option<(usize, Vec<Cell>)>, String> {
        let Stored { lines, kept, counts, summary, .. } = self;
        let Some(line) = lines.next(LONGEST_LINE_BYTES).map_err(|error| error.to_string())? else {
            return self.end().map(|()| None);
        };
        let event = line.split_once('\t').and_then(|(topic, payload)| {
            Some((kept.iter().position(|events| events.kind.topic == topic)?, payload))
        });
        let Some((index, payload)) = event else {
            let topics: Vec<&str> = kept.iter().map(|events| events.kind.topic).collect();
            let number = lines.number();
            return Err(format!(
                "line {number}: no event that is kept (accepted: those of {})",
                topics.join(" and ")
            ));
        };
        let events = &kept[index];
        let cells = events.kind.read(payload).and_then(|event| events.kind.cells(&event));
        let number = lines.number();
        let cells = cells.map_err(|error| {
            format!("line {number}: {} (accepted: an event of {})", problem_of(&error), events.kind.topic)
        })?;
        let name = |column: usize| &events.kind.columns[column].name;
        if cells[events.number] != Cell::Step(counts[index]) {
            let (name, found) = (name(events.number), cells[events.number]);
            return Err(format!(
                "line {number}: {name} = {found} (accepted: {}, the next one)",
                counts[index]
            ));
        }
        counts[index] += 1;
        for &column in &events.blocks {
            if let Cell::Count(block) = cells[column]
                && !(1..=summary.blocks).contains(&block)
            {
                let (name, last) = (name(column), summary.blocks);
                return Err(format!("line {number}: {name} = {block} (accepted: 1 to {last})"));
            }
        }
        for &column in &events.steps {
            if let Cell::Step(step) = cells[column]
                && step > summary.last_step
            {
                let (name, last) = (name(column), summary.last_step);
                return Err(format!("line {number}: {name} = {step} (accepted: up to {last})"));
            }
        }
        Ok(Some((index, cells)))
    }

    /// Checks that nothing is missing and nothing follows.
    fn end(&mut self) -> Result<(), String> {
        for (events, count) in self.kept.iter().zip(&self.counts) {
            if let Some(said) = (events.count)(&self.summary)
                && said != *count
            {
                let topic = events.kind.topic;
                return Err(format!("{count} events of {topic} (accepted: {said}, as its summary says)"));
            }
        }
        // Neither the decoder nor its source may have further bytes.
        let source = self.lines.source().get_mut().get_mut();
        match asperity_files::fill(source).and_then(|()| source.fill_buf()) {
            Ok([]) => Ok(()),
            Ok(_) => Err("more follows (accepted: one zstd frame)".to_owned()),
            Err(error) => Err(error.to_string()),
        }
    }

    /// The first difference between two results of one run, if any.
    ///
    /// # Errors
    /// If one of them cannot be read.
    pub(crate) fn difference<S: BufRead>(
        mut self,
        mut other: Stored<'_, S>,
    ) -> Result<Option<String>, [Option<String>; 2]> {
        for (key, (a, b)) in
            Summary::KEYS.iter().zip(self.summary.values().iter().zip(other.summary.values()))
        {
            // Compared as written: 0 and -0 differ in a table.
            let (a, b) = (a.to_string(), b.to_string());
            if a != b {
                return Ok(Some(format!("{} is {a} and {b}", key.column.name)));
            }
        }
        loop {
            let (a, b) = match (self.next_event(), other.next_event()) {
                (Ok(a), Ok(b)) => (a, b),
                (a, b) => return Err([a.err(), b.err()]),
            };
            let ((i, a), (j, b)) = match (a, b) {
                (Some(a), Some(b)) => (a, b),
                (None, None) => return Ok(None),
                _ => return Ok(Some("one has more events".to_owned())),
            };
            let Some(events) = self.kept.get(i).filter(|_| i == j) else {
                return Ok(Some("their events are in another order".to_owned()));
            };
            let pairs = events.kind.columns.iter().zip(a.iter().zip(&b));
            for (column, (x, y)) in pairs {
                let (x, y) = (said(*x), said(*y));
                if x != y {
                    let (topic, name) = (events.kind.topic, &column.name);
                    let number = a[events.number];
                    return Ok(Some(format!("{name} of event {number} of {topic} is {x} and {y}")));
                }
            }
        }
    }
}

fn said(cell: Cell) -> String {
    if cell == Cell::Empty { "null".to_owned() } else { cell.to_string() }
}
