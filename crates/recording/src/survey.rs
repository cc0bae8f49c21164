//! The parts of a stream: its segments, or the stretches between gaps, and when their samples were taken.

use asperity_record::{SignalRecord, median};

use crate::description::{Column, Gaps, Stream, Time};
use crate::error::{InputFault, RecordingError, Result};
use crate::input::Folder;
use crate::resample::Resampled;
use crate::samples::{Block, Samples};
use crate::unit::{Quantity, Unit};

/// Samples that are read at once: of whole messages of `/signal`.
pub(crate) const BLOCK: usize = SignalRecord::MOST_SAMPLES as usize;

/// Of a column of times, every so many are kept; those between are interpolated.
const EACH: u64 = 1024;

/// Intervals whose median is the interval of a stream with a column of times.
const MOST_INTERVALS: usize = 1 << 17;

/// Most parts of a stream.
const MOST_PARTS: usize = 100_000;

/// Largest relative deviation of an interval, beside what the last printed digit allows.
const INTERVAL_TOLERANCE: f64 = 0.01;

/// A gap is longer than so many intervals.
const GAP: f64 = 1.5;

/// Samples without a gap.
#[derive(Debug, Clone, Default)]
pub(crate) struct Part {
    /// Counted from 1, as the files are.
    pub(crate) number: u64,
    /// The file that it is in.
    pub(crate) file: usize,
    /// The first sample of it in the file.
    pub(crate) from: u64,
    pub(crate) samples: u64,
    /// On the common clock: of the first sample, then every [`EACH`]th, and of the last; of a constant rate the first.
    times_s: Vec<f64>,
    interval_s: f64,
    /// How many samples are missing before it, and behind the last one.
    pub(crate) missing: u64,
}

impl Part {
    /// Of a column of times: a sample whose time is kept, how many there are up to the next one, and both times.
    fn kept(&self, n: usize) -> (f64, f64, [f64; 2]) {
        let from = (n as u64 * EACH) as f64;
        (from, ((self.samples - 1) as f64 - from).min(EACH as f64), [self.times_s[n], self.times_s[n + 1]])
    }

    /// The time of a place between samples, s.
    pub(crate) fn time_s(&self, sample: f64) -> f64 {
        let [first_s] = *self.times_s else {
            let n = (sample / EACH as f64).floor().clamp(0.0, (self.times_s.len() - 2) as f64);
            let (from, span, [from_s, to_s]) = self.kept(n as usize);
            return from_s + (sample - from) / span * (to_s - from_s);
        };
        first_s + sample * self.interval_s
    }

    /// The place between samples of a time.
    pub(crate) fn sample_at(&self, time_s: f64) -> f64 {
        let [first_s] = *self.times_s else {
            let behind = self.times_s.partition_point(|known_s| *known_s <= time_s);
            let (from, span, [from_s, to_s]) = self.kept(behind.clamp(1, self.times_s.len() - 1) - 1);
            return from + (time_s - from_s) / (to_s - from_s) * span;
        };
        (time_s - first_s) / self.interval_s
    }

    pub(crate) fn first_s(&self) -> f64 {
        self.times_s[0]
    }

    pub(crate) fn last_s(&self) -> f64 {
        self.time_s((self.samples - 1) as f64)
    }
}

/// A stream whose parts are known.
#[derive(Debug)]
pub(crate) struct Surveyed {
    pub(crate) files: Vec<String>,
    /// In order of time.
    pub(crate) parts: Vec<Part>,
    pub(crate) interval_s: f64,
}

impl Surveyed {
    /// In all parts.
    pub(crate) fn samples(&self) -> u64 {
        self.parts.iter().map(|part| part.samples).sum()
    }
}

/// Finds the parts of a stream, and checks its times and units.
pub(crate) fn survey(folder: &Folder, stream: &mut Stream) -> Result<Surveyed> {
    let files = folder.files(stream)?;
    let columns: Vec<Column> = stream.channels().map(|channel| channel.column.clone()).collect();
    let opened = folder.open(stream, &files[0], &columns)?;
    for (n, channel) in stream.sensors.iter_mut().chain(&mut stream.channel).enumerate() {
        let (stated, place) = opened.unit(n).unzip();
        channel.scale = channel.scale_by(stated.as_deref()).map_err(|problem| {
            let accepted = "a unit of what the channel measures";
            let fault =
                InputFault::new(&folder.shown(&files[0]), place.unwrap_or_default(), problem, accepted);
            fault.of(&channel.column, stated.as_deref())
        })?;
    }
    let stream = &*stream;
    let (mut parts, interval_s) = match (&stream.rate_hz, &stream.time) {
        (None, Some(time)) => times(folder, stream, &files[0], time)?,
        (rate, _) => {
            let interval_s = 1.0 / rate.as_ref().expect("a stream has one of both").0;
            let starts_s = match &stream.starts {
                Some(starts) => folder.starts_s(starts)?,
                None => vec![stream.start_s.0],
            };
            if starts_s.len() != files.len() {
                let problem = format!("{} starts of {} segments", starts_s.len(), files.len());
                let file = folder.shown(&stream.file);
                return Err(InputFault::new(&file, "", problem, "a start for every segment").into());
            }
            let part = |(file, start_s): (usize, f64)| {
                let samples = folder.open(stream, &files[file], &columns)?;
                let begun = |from, samples, missing| {
                    let times_s = vec![start_s + stream.offset_s.0 + from as f64 * interval_s];
                    Part { number: 0, file, from, samples, times_s, interval_s, missing }
                };
                let found = complete(samples, columns.len(), stream, begun)?;
                let fault =
                    |problem, accepted| InputFault::new(&folder.shown(&files[file]), "", problem, accepted);
                match found.len() {
                    0 => Err(fault("no samples", "four windows").into()),
                    1..=MOST_PARTS => Ok(found),
                    _ => Err(fault("too many gaps", "100000 parts").into()),
                }
            };
            let parts: Result<Vec<_>> = starts_s.into_iter().enumerate().map(part).collect();
            (parts?.concat(), interval_s)
        }
    };
    (1..).zip(&mut parts).for_each(|(number, part)| part.number = number);
    parts.sort_by(|a, b| a.first_s().total_cmp(&b.first_s()));
    Ok(Surveyed { files, parts, interval_s })
}

impl Time {
    /// Its unit, given the one that a file states; none if that is none of time.
    pub(crate) fn unit_or(&self, stated: Option<&str>) -> Option<Unit> {
        let unit = stated.map_or_else(|| self.unit.clone().or_else(|| Unit::of("s")), Unit::of);
        unit.filter(|unit| unit.quantity == Quantity::Time)
    }
}

/// Parts of samples at a constant rate, each from the first of them on, with so many samples, and missing before it. Where
/// none may be missing, arrays pass over them, and tables are not parsed.
fn complete(
    mut samples: Box<dyn Samples>,
    channels: usize,
    stream: &Stream,
    begun: impl Fn(u64, u64, u64) -> Part,
) -> Result<Vec<Part>> {
    let (mut parts, mut at, mut missing, mut block) = (Vec::<Part>::new(), 0, 0, Block::new(channels));
    if stream.missing.is_none() {
        let all = samples.skip(usize::MAX, &mut block)? as u64;
        parts.extend((all > 0).then(|| begun(0, all, 0)));
    }
    while parts.len() <= MOST_PARTS && samples.next(BLOCK, &mut block)? > 0 {
        for sample in (0..block.len()).map(|n| block.sample(n)) {
            match parts.last_mut() {
                _ if !is_complete(sample) => missing += 1,
                Some(part) if missing == 0 => part.samples += 1,
                _ => parts.push(begun(at, 1, std::mem::take(&mut missing))),
            }
            at += 1;
        }
        block.resize(0);
    }
    parts.iter_mut().next_back().into_iter().for_each(|last| last.missing += missing);
    Ok(parts)
}

fn is_complete(sample: &[f64]) -> bool {
    sample.iter().all(|number| number.is_finite())
}

/// The parts of a file with a column of times, and the interval of its samples, s.
fn times(folder: &Folder, stream: &Stream, named: &str, time: &Time) -> Result<(Vec<Part>, f64)> {
    // What is missing in one column is a gap of all.
    let others = stream.missing.iter().flat_map(|_| stream.channels()).map(|channel| channel.column.clone());
    let columns: Vec<Column> = [time.column.clone()].into_iter().chain(others).collect();
    let mut samples = folder.open(stream, named, &columns)?;
    let mut block = Block::new(columns.len());
    let fault = |place: String, value: Option<String>, problem: String, accepted| {
        let fault = InputFault::new(&folder.shown(named), place, problem, accepted);
        RecordingError::from(fault.of(&time.column, value.as_deref()))
    };
    let (stated, place) = samples.unit(0).unzip();
    let Some(Unit { name: in_words, scale: unit_s, .. }) = time.unit_or(stated.as_deref()) else {
        let problem = format!("unit {} where a time is due", stated.as_deref().unwrap_or_default());
        return Err(fault(place.unwrap_or_default(), stated, problem, "s, ms, us, ns"));
    };
    samples.next(MOST_INTERVALS + 1, &mut block)?;
    let known = (0..block.len()).map(|n| block.sample(n)).filter(|sample| is_complete(sample));
    let first: Vec<f64> = known.map(|sample| sample[0]).collect();
    let mut intervals: Vec<f64> = first.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let interval = median(&mut intervals);
    if interval.is_nan() || interval <= 0.0 {
        let problem = "times that do not ascend".to_owned();
        return Err(fault(String::new(), None, problem, "two samples, the later behind"));
    }
    // Times are printed with some digits, of which the last may be off by one.
    let places = |time: &f64| time.to_string().split_once('.').map_or(0, |(_, places)| places.len().min(12));
    let places = first.iter().map(places).max().unwrap_or_default();
    let shown = |time: f64| format!("{time:.places$}");
    let tolerance = INTERVAL_TOLERANCE * interval + 10f64.powi(-(places as i32));
    let mut parts: Vec<Part> = Vec::new();
    let time_s = |time: f64| time * unit_s + stream.offset_s.0;
    let interval_s = interval * unit_s;
    let (mut at, mut last, mut missing) = (0, f64::NAN, 0);
    let off = |step: f64| {
        let [step, due] = [step, interval].map(shown);
        format!("{step} {in_words} where {due} {in_words} is the interval")
    };
    loop {
        for sample in (0..block.len()).map(|n| block.sample(n)) {
            if !is_complete(sample) {
                (at, missing) = (at + 1, missing + 1);
                continue;
            }
            let (time, place) = (sample[0], || samples.place(at));
            let step = time - last;
            let refused =
                |problem: String, accepted| Err(fault(place(), Some(shown(time)), problem, accepted));
            let is_gap = missing > 0 || step > GAP * interval;
            if step <= 0.0 {
                let problem = if step < 0.0 { "time runs back" } else { "time repeats" };
                return refused(problem.to_owned(), "times that ascend");
            } else if stream.resample.is_some() {
                // Any interval.
            } else if missing == 0 && is_gap && stream.gaps == Gaps::Refuse {
                return refused(format!("gap of {}", off(step)), "equal intervals, or gaps = \"allow\"");
            } else if !is_gap && (step - interval).abs() > tolerance {
                return refused(off(step), "intervals equal to 1 %, or resample = \"linear\"");
            }
            if parts.is_empty() || is_gap && stream.resample.is_none() {
                if parts.len() == MOST_PARTS {
                    return refused("too many gaps".to_owned(), "100000 parts");
                }
                parts.push(Part { from: at, interval_s, missing, ..Part::default() });
            }
            let part = parts.last_mut().expect("it was begun");
            // The time of the last sample gives way to the next one, unless it is one of every so many.
            if part.samples % EACH != 1 {
                part.times_s.pop();
            }
            part.times_s.push(time_s(time));
            part.samples += 1;
            (at, last, missing) = (at + 1, time, 0);
        }
        block.resize(0);
        if samples.next(BLOCK, &mut block)? == 0 {
            break;
        }
    }
    let part = parts.last_mut().expect("two samples ascend");
    part.missing += missing;
    if stream.resample.is_some() {
        part.samples = Resampled::length(time_s(last) - part.first_s(), interval_s);
        part.times_s.truncate(1);
    }
    Ok((parts, interval_s))
}
