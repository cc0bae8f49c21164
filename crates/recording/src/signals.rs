//! Records for people and figures beside the steps: what all channels read, in a thousandth of the numbers, and the
//! samples about each rupture.

use std::io::{self, BufReader, BufWriter, Read, Seek, Write};
use std::iter;

use asperity_detect::Slipped;
use asperity_files::Spool;
use asperity_record::{Record, SignalRecord, TraceRecord};

use crate::description::Description;
use crate::error::{RecordingError, Result};
use crate::pass::Ranges;
use crate::recording::{Detected, Recording};
use crate::survey::{BLOCK, Part};

/// Bytes of such numbers in memory, beyond which they go to a file without a name.
const IN_MEMORY: usize = 1 << 18;

/// Most numbers in a record of traces.
const MOST_VALUES: usize = 1 << 17;

/// The least, mean and largest of the channels of a stream in each block of samples, in the order of reading.
#[derive(Debug)]
pub(crate) struct Signals(BufWriter<Spool>);

impl Signals {
    pub(crate) fn new() -> Signals {
        Signals(BufWriter::new(asperity_files::spool(IN_MEMORY)))
    }

    /// Adds a block.
    pub(crate) fn push(&mut self, channels: &[[f64; 3]]) -> io::Result<()> {
        let bytes: Vec<[u8; 8]> = channels.as_flattened().iter().map(|number| number.to_le_bytes()).collect();
        self.0.write_all(bytes.as_flattened())
    }

    /// Adds the blocks of others.
    pub(crate) fn append(&mut self, mut others: Signals) -> io::Result<()> {
        others.0.rewind()?;
        io::copy(others.0.get_mut(), &mut self.0).map(drop)
    }
}

/// Records in order of their steps.
type Records<'a> = Box<dyn Iterator<Item = Result<Record>> + 'a>;

impl Recording {
    /// What all channels of a stream read, block by block.
    fn signals<'a>(
        &'a self,
        stream: usize,
        signals: &'a mut Signals,
    ) -> impl Iterator<Item = io::Result<SignalRecord>> + 'a {
        let (surveyed, grid) = (&self.streams[stream], self.time_grid());
        let blocks = surveyed
            .parts
            .iter()
            .flat_map(|part| (0..part.samples).step_by(BLOCK).map(move |first| (part, first)));
        let (rewound, mut spool) = (signals.0.rewind(), BufReader::new(signals.0.get_mut()));
        let mut bytes = vec![0; 24 * self.description.streams[stream].channels().count()];
        let record = move |(of, first): (&Part, u64)| {
            let step = grid.nearest_step(of.time_s(first as f64));
            let mut record = SignalRecord {
                step,
                time_s: grid.time_s(step),
                stream: stream as u32 + 1,
                part: of.number,
                samples: (of.samples - first).min(BLOCK as u64) as u32,
                interval_s: surveyed.interval_s,
                ..SignalRecord::default()
            };
            spool.read_exact(&mut bytes)?;
            let of = |n: usize| {
                bytes.as_chunks::<24>().0.iter().map(move |of| f64::from_le_bytes(of.as_chunks().0[n]))
            };
            (record.least, record.mean, record.largest) = (of(0).collect(), of(1).collect(), of(2).collect());
            Ok(record)
        };
        rewound.err().map(Err).into_iter().chain(blocks.map(record))
    }

    /// All records of the log, in order, until `stop` says to stop.
    pub fn records<'a>(
        &'a self,
        found: &'a mut Detected,
        stop: &'a dyn Fn() -> bool,
    ) -> impl Iterator<Item = Result<Record>> {
        let ruptures = self.ruptures(found);
        let (timeline, loads, normal_load_n) = (&found.timeline, &found.loads, self.normal_load_n());
        let mut sources: Vec<Records<'a>> = vec![
            Box::new(timeline.records(loads, normal_load_n).map(|record| Ok(Record::Step(record)))),
            Box::new(found.rows.iter().map(|row| Ok(Record::Row(row.clone())))),
        ];
        for (stream, signals) in found.signals.iter_mut().enumerate() {
            let records = self.signals(stream, signals);
            let record = |record: io::Result<_>| record.map(Record::Signal).map_err(RecordingError::spool);
            sources.push(Box::new(records.map(record)));
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
            let step = |next: &Result<Record>| next.as_ref().map_or(0, Record::step);
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
    ) -> impl Iterator<Item = Result<Record>> + use<'a> {
        let (surveyed, grid) = (&self.streams[stream], self.time_grid());
        let sensors = &self.description.streams[stream].sensors;
        let most = (MOST_VALUES / sensors.len()).clamp(1, SignalRecord::MOST_SAMPLES as usize);
        let mut due = Vec::new();
        for Slipped { rupture, onset_step, end, .. } in ruptures {
            let onset_s = grid.time_s(*onset_step);
            let begins = |part: &Part| part.first_s() <= onset_s;
            let part = surveyed.parts.partition_point(begins).saturating_sub(1);
            let of = &surveyed.parts[part];
            let from = (of.sample_at(onset_s).floor() as u64).saturating_sub(4 * window);
            let to = end.map_or(of.samples, |(step, _)| of.sample_at(grid.time_s(step)).ceil() as u64);
            let to = to.saturating_add(4 * window + 1).min(of.samples);
            due.extend(
                (from..to).step_by(most).map(|from| (part, from, to.min(from + most as u64), *rupture)),
            );
        }
        due.sort_unstable();
        let mut ranges = Ranges::new(self, stream, sensors.iter().collect());
        due.into_iter().map(move |(part, from, to, rupture)| {
            let rows = ranges.rows(part, &(from..to))?;
            let of_sensors = sensors.iter().enumerate();
            let values = of_sensors.flat_map(|(n, sensor)| rows.si(n, sensor, from..to)).collect();
            let step = grid.nearest_step(surveyed.parts[part].time_s(from as f64));
            Ok(Record::Traces(TraceRecord {
                step,
                time_s: grid.time_s(step),
                rupture,
                part: surveyed.parts[part].number,
                sensors: sensors.len() as u32,
                interval_s: surveyed.interval_s,
                samples: (to - from) as u32,
                values,
            }))
        })
    }
}
