//! Records for people and figures beside the steps: what all channels read, in a thousandth of the numbers, and the
//! samples about each rupture.

use std::io::{self, BufReader, Read, Seek, Write};
use std::iter;

use asperity_detect::Slipped;
use asperity_files::Spool;
use asperity_record::{BulkRecord, Record, SignalRecord, TraceRecord};

use crate::description::Description;
use crate::error::RecordingError;
use crate::pass::Ranges;
use crate::recording::{Detected, Recording};

/// Bytes of such records in memory, beyond which they go to a file without a name.
const IN_MEMORY: usize = 1 << 24;

/// Most numbers in a record of traces.
const MOST_VALUES: usize = 1 << 17;

/// What the channels of a stream read, record by record, as they were made; some channels each.
#[derive(Debug)]
pub(crate) struct Signals(Vec<Spool>);

impl Signals {
    pub(crate) fn new() -> Signals {
        Signals(vec![asperity_files::spool(IN_MEMORY)])
    }

    /// Adds what channels behind these read at the same times.
    pub(crate) fn join(&mut self, others: Signals) {
        self.0.extend(others.0);
    }

    pub(crate) fn push(&mut self, record: &SignalRecord) -> io::Result<()> {
        let message = record.to_message();
        self.0[0].write_all(&(message.len() as u32).to_le_bytes())?;
        self.0[0].write_all(&message)
    }

    /// All of them, in order.
    fn records(&mut self) -> impl Iterator<Item = io::Result<SignalRecord>> {
        let rewound: io::Result<()> = self.0.iter_mut().try_for_each(Seek::rewind);
        let mut spools: Vec<_> = self.0.iter_mut().map(BufReader::new).collect();
        let read = |spool: &mut BufReader<&mut Spool>| {
            let mut length = [0; 4];
            if spool.read(&mut length[..1])? == 0 {
                return Ok(None);
            }
            spool.read_exact(&mut length[1..])?;
            let mut message = vec![0; u32::from_le_bytes(length) as usize];
            spool.read_exact(&mut message)?;
            SignalRecord::of_message(&message).map(Some).map_err(io::Error::other)
        };
        let mut next = move || {
            let all: Option<Vec<SignalRecord>> = spools.iter_mut().map(read).collect::<io::Result<_>>()?;
            Ok(all.into_iter().flatten().reduce(|mut record, other| {
                record.least.extend(other.least);
                record.mean.extend(other.mean);
                record.largest.extend(other.largest);
                record
            }))
        };
        rewound.err().map(Err).into_iter().chain(iter::from_fn(move || next().transpose()))
    }
}

/// Records in order of their steps.
type Records<'a> = Box<dyn Iterator<Item = Result<Record, RecordingError>> + 'a>;

impl Recording {
    /// What will be said of samples from one on, still without numbers.
    pub(crate) fn signals(
        &self,
        stream: usize,
        part: usize,
        first: u64,
        samples: usize,
    ) -> Vec<SignalRecord> {
        let (of, grid) = (&self.streams[stream].parts[part], self.time_grid());
        let (stream, part, interval_s) =
            (stream as u32 + 1, part as u64 + 1, self.streams[stream].interval_s);
        let record = |at: usize| {
            let step = grid.nearest_step(of.time_s((first + at as u64) as f64));
            let samples = (samples - at).min(SignalRecord::MOST_SAMPLES as usize) as u32;
            SignalRecord {
                step,
                time_s: grid.time_s(step),
                stream,
                part,
                samples,
                interval_s,
                ..SignalRecord::default()
            }
        };
        (0..samples).step_by(SignalRecord::MOST_SAMPLES as usize).map(record).collect()
    }

    /// All records of the log, in order, until `stop` says to stop.
    pub fn records<'a>(
        &'a self,
        found: &'a mut Detected,
        stop: &'a dyn Fn() -> bool,
    ) -> impl Iterator<Item = Result<Record, RecordingError>> {
        let ruptures = self.ruptures(found);
        let (timeline, loads, normal_load_n) = (&found.timeline, &found.loads, self.normal_load_n());
        let mut sources: Vec<Records<'a>> = vec![
            Box::new(timeline.records(loads, normal_load_n).map(|record| Ok(Record::Step(record)))),
            Box::new(found.rows.iter().map(|row| Ok(Record::Row(row.clone())))),
        ];
        for signals in &mut found.signals {
            sources.push(Box::new(
                signals.records().map(|record| record.map(Record::Signal).map_err(RecordingError::spool)),
            ));
        }
        let Description { contacts, detection, .. } = &self.description;
        if let Some(stream) = contacts.filter(|_| detection.traces != Some(false)) {
            sources.push(Box::new(self.traces(stream, found.window, &ruptures)));
        }
        let mut sources: Vec<iter::Peekable<Records<'a>>> =
            sources.into_iter().map(Iterator::peekable).collect();
        iter::from_fn(move || {
            if stop() {
                return Some(Err(RecordingError::Interrupted));
            }
            // The earliest, the first of equals; a failure at once.
            let step = |next: &Result<Record, RecordingError>| next.as_ref().map_or(0, Record::step);
            let first = sources.iter_mut().enumerate();
            let (_, n) = first.filter_map(|(n, source)| Some((step(source.peek()?), n))).min()?;
            sources[n].next()
        })
    }

    /// Samples of all sensors about ruptures, from four windows before the first arrival to four behind the last stop.
    fn traces<'a>(
        &'a self,
        stream: usize,
        window: u64,
        ruptures: &[Slipped],
    ) -> impl Iterator<Item = Result<Record, RecordingError>> + use<'a> {
        let (surveyed, grid) = (&self.streams[stream], self.time_grid());
        let sensors = &self.description.streams[stream].sensors;
        let most = (MOST_VALUES / sensors.len()).clamp(1, SignalRecord::MOST_SAMPLES as usize);
        let (mut due, order) = (Vec::new(), self.order(stream));
        for Slipped { rupture, onset_step, end, .. } in ruptures {
            let onset_s = grid.time_s(*onset_step);
            let begins = |part: &usize| surveyed.parts[*part].first_s() <= onset_s;
            let place = order.partition_point(begins).saturating_sub(1);
            let of = &surveyed.parts[order[place]];
            let from = (of.sample_at(onset_s).floor() as u64).saturating_sub(4 * window);
            let to = end.map_or(of.samples, |(step, _)| of.sample_at(grid.time_s(step)).ceil() as u64);
            let to = to.saturating_add(4 * window + 1).min(of.samples);
            due.extend(
                (from..to).step_by(most).map(|from| (place, from, to.min(from + most as u64), *rupture)),
            );
        }
        due.sort_unstable();
        let mut ranges = Ranges::new(self, stream, sensors.iter().collect());
        due.into_iter().map(move |(place, from, to, rupture)| {
            let part = order[place];
            let rows = ranges.rows(part, &(from..to))?;
            let of_sensors = sensors.iter().enumerate();
            let values = of_sensors.flat_map(|(n, sensor)| rows.si(n, sensor, from..to)).collect();
            let step = grid.nearest_step(surveyed.parts[part].time_s(from as f64));
            Ok(Record::Traces(TraceRecord {
                step,
                time_s: grid.time_s(step),
                rupture,
                part: part as u64 + 1,
                sensors: sensors.len() as u32,
                interval_s: surveyed.interval_s,
                samples: (to - from) as u32,
                values,
            }))
        })
    }
}
