//! The first pass: the noise of channels, and what is wrong with them.

use std::collections::BTreeSet;
use std::ops::Range;

use asperity_record::{LoadNoise, Noise, Row, SignalRecord};
use multiversion::multiversion;

use crate::description::Channel;
use crate::error::{InputFault, Place, RecordingError};
use crate::pass::Progress;
use crate::ramp::Ramp;
use crate::recording::{Detected, Recording, SHORTEST_PART};
use crate::samples::{LANES, Rows};
use crate::signals::Signals;
use crate::survey::Part;
use crate::window::{Scatter, Values, Window, larger, lesser};

/// Equal samples in a row at the extreme of a channel that are clipped.
const CLIPPED: u64 = 3;

/// A channel in a part, by windows of one width, in numbers as stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OfPart {
    pub(crate) width: u64,
    pub(crate) scatter: Scatter,
    /// The extremes at which it is clipped.
    clips: [Option<Run>; 2],
    /// Whether the steps between numbers are above the noise.
    is_coarse: bool,
}

/// The channels of all parts, each by the widths of its windows.
pub(crate) type Heard = Vec<Vec<Vec<OfPart>>>;

impl OfPart {
    fn of(values: &Values, extremes: &Extremes, lane: usize, width: u64) -> OfPart {
        let (scatter, runs) = (values.scatter(lane), extremes.runs[lane]);
        let noise = scatter.noise(width);
        let is_coarse = noise > 0.0 && extremes.quantum[lane] > noise;
        // Where steps between numbers may leave equal samples, none is tested.
        let is_tested = !is_coarse && runs[0].value < runs[1].value;
        let clips = runs.map(|run| Some(run).filter(|run| is_tested && run.clipped > 0));
        OfPart { width, scatter, clips, is_coarse }
    }

    /// Whether clipped samples touch a ramp.
    pub(crate) fn touches_clips(&self, rows: &Rows<'_>, channel: usize, ramp: &Ramp) -> bool {
        let (begin, end) =
            ((ramp.begin.floor() as u64).saturating_sub(CLIPPED - 1), ramp.end.ceil() as u64 + CLIPPED);
        let is_clipped =
            |run: &[f64]| self.clips.iter().flatten().any(|at| run.iter().all(|value| *value == at.value));
        rows.of(channel, begin..end).collect::<Vec<f64>>().windows(CLIPPED as usize).any(is_clipped)
    }
}

/// Samples at an extreme.
#[derive(Debug, Clone, Copy)]
struct Run {
    value: f64,
    /// How many samples in a row have it, up to the last one.
    length: u64,
    /// How many are in rows of [`CLIPPED`] or more, and the first of them.
    clipped: u64,
    first: u64,
}

impl Run {
    fn of(value: f64) -> Run {
        Run { value, length: 0, clipped: 0, first: 0 }
    }

    /// Adds the next sample, the one with this number.
    fn add(&mut self, value: f64, sample: u64) {
        if value == self.value {
            self.length += 1;
            if self.length == CLIPPED && self.clipped == 0 {
                self.first = sample + 1 - CLIPPED;
            }
            self.clipped += match self.length {
                CLIPPED => CLIPPED,
                length => u64::from(length > CLIPPED),
            };
        } else {
            self.length = 0;
        }
    }
}

/// Extremes of some channels, and the least difference between samples that follow each other.
#[derive(Debug)]
struct Extremes {
    /// Of each channel the least and the largest.
    runs: Vec<[Run; 2]>,
    quantum: [f64; LANES],
    last: [f64; LANES],
    samples: u64,
}

impl Extremes {
    fn new(channels: usize) -> Extremes {
        let runs = vec![[f64::INFINITY, f64::NEG_INFINITY].map(Run::of); channels];
        Extremes { runs, quantum: [f64::INFINITY; LANES], last: [f64::NAN; LANES], samples: 0 }
    }

    /// Adds samples. Returns the least, the sum and the largest of them.
    fn extend<'a>(
        &mut self,
        samples: impl ExactSizeIterator<Item = &'a [f64; LANES]> + Clone,
    ) -> [[f64; LANES]; 3] {
        let count = samples.len() as u64;
        let [least, sum, most] = reduce(samples.clone(), &mut self.last, &mut self.quantum);
        for (n, runs) in self.runs.iter_mut().enumerate() {
            let are_beyond = [least[n] < runs[0].value, most[n] > runs[1].value];
            for ((run, extreme), is_beyond) in runs.iter_mut().zip([least[n], most[n]]).zip(are_beyond) {
                if is_beyond {
                    *run = Run::of(extreme);
                }
                if extreme == run.value {
                    samples.clone().zip(self.samples..).for_each(|(lanes, sample)| run.add(lanes[n], sample));
                } else {
                    run.length = 0;
                }
            }
        }
        self.samples += count;
        [least, sum, most]
    }
}

/// Least, sum and largest of samples; lessens the quanta by the differences between them that are not 0.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2"))]
fn reduce<'a>(
    samples: impl Iterator<Item = &'a [f64; LANES]>,
    last: &mut [f64; LANES],
    quantum: &mut [f64; LANES],
) -> [[f64; LANES]; 3] {
    let (mut before, mut quanta) = (*last, *quantum);
    let (mut least, mut sum, mut most) = ([f64::INFINITY; LANES], [0.0; LANES], [f64::NEG_INFINITY; LANES]);
    for values in samples {
        for n in 0..LANES {
            least[n] = lesser(least[n], values[n]);
            most[n] = larger(most[n], values[n]);
            sum[n] += values[n];
            let step = (values[n] - before[n]).abs();
            quanta[n] = lesser(quanta[n], if step > 0.0 { step } else { f64::INFINITY });
        }
        before = *values;
    }
    (*last, *quantum) = (before, quanta);
    [least, sum, most]
}

/// Channels that lie side by side, with windows of each width that one of them has.
struct Listener {
    extremes: Extremes,
    windows: Vec<(Window, Values)>,
}

impl Recording {
    /// The first pass over a stream: the noise by part, channel and width of windows, as many as each channel has; and what
    /// all channels read.
    pub(crate) fn listen(
        &self,
        stream: usize,
        widths: &[Vec<u64>],
        progress: &mut Progress<'_>,
    ) -> Result<(Heard, Signals), RecordingError> {
        let surveyed = &self.streams[stream];
        let channels: Vec<&Channel> = self.description.streams[stream].channels().collect();
        let longest = widths.iter().flatten().max().copied().unwrap_or_default();
        if let Some(part) = surveyed.parts.iter().position(|part| part.samples < SHORTEST_PART * longest) {
            let problem = format!("part {} has {} samples", part + 1, surveyed.parts[part].samples);
            let fault =
                self.fault(stream, part, channels[0], None, problem, "parts of four windows at least");
            return Err(fault.into());
        }
        let heard = |of: Range<usize>, progress: &mut Progress<'_>| {
            let (channels, widths) = (&channels[of.clone()], &widths[of]);
            let (mut signals, mut listeners) = (Signals::new(), Vec::new());
            let mut parts: Heard = vec![Vec::new(); surveyed.parts.len()];
            self.pass(stream, channels, 2 * longest, progress, &mut |part, first, rows, is_last| {
                let of = &surveyed.parts[part];
                if first == 0 {
                    let windows = |width: &u64| (Window::new(*width), Values::of(of.samples, *width));
                    let fresh = |widths: &[Vec<u64>]| {
                        let all: BTreeSet<u64> = widths.iter().flatten().copied().collect();
                        Listener {
                            extremes: Extremes::new(widths.len()),
                            windows: all.iter().map(windows).collect(),
                        }
                    };
                    listeners = widths.chunks(LANES).map(fresh).collect::<Vec<Listener>>();
                }
                let mut read = self.signals(stream, part, first, (rows.end() - first) as usize);
                for (group, Listener { extremes, windows }) in listeners.iter_mut().enumerate() {
                    let each = SignalRecord::MOST_SAMPLES as usize;
                    for (record, from) in read.iter_mut().zip((first - rows.first..).step_by(each)) {
                        let samples = rows.block.lanes(group, from as usize).take(each);
                        let [least, sum, most] = extremes.extend(samples);
                        for (n, channel) in channels.iter().skip(group * LANES).take(LANES).enumerate() {
                            let mean = sum[n] / f64::from(record.samples);
                            let [a, mean, b] = [least[n], mean, most[n]].map(|stored| channel.si(stored));
                            record.least.push(a.min(b));
                            record.mean.push(mean);
                            record.largest.push(a.max(b));
                        }
                    }
                    for (window, values) in windows {
                        values.take(window, rows, group);
                    }
                }
                if is_last {
                    let of_channel = |(n, widths): (usize, &Vec<u64>)| {
                        let Listener { extremes, windows } = &listeners[n / LANES];
                        let of = |(window, values): &(Window, Values)| {
                            let is_its = widths.contains(&window.width);
                            is_its.then(|| OfPart::of(values, extremes, n % LANES, window.width))
                        };
                        windows.iter().filter_map(of).collect()
                    };
                    parts[part] = widths.iter().enumerate().map(of_channel).collect();
                }
                read.iter().try_for_each(|record| signals.push(record)).map_err(RecordingError::spool)
            })?;
            Ok((parts, signals))
        };
        let halves = self.in_halves(stream, channels.len(), progress, heard)?;
        let joined = halves.into_iter().reduce(|(mut parts, mut signals), (others, other_signals)| {
            parts.iter_mut().zip(others).for_each(|(part, other)| part.extend(other));
            signals.join(other_signals);
            (parts, signals)
        });
        Ok(joined.expect("there is one"))
    }

    /// Adds the noise of some channels of a stream to what is found, and warnings: by channel, its number and the place of
    /// its windows.
    pub(crate) fn report(
        &self,
        stream: usize,
        parts: &[Vec<Vec<OfPart>>],
        channels: impl Iterator<Item = (usize, usize)> + Clone,
        found: &mut Detected,
    ) {
        let (surveyed, grid) = (&self.streams[stream], self.time_grid());
        let all: Vec<&Channel> = self.description.streams[stream].channels().collect();
        let sensors = self.description.streams[stream].sensors.len();
        // What may be wrong with a channel of a part, with those that have it: told once for all.
        let mut flaws = [
            ("no noise", "a sensor that works; else name it in dead", Vec::new()),
            ("steps between numbers above the noise", "numbers with more digits", Vec::new()),
            ("events are too dense for the window", "a shorter window", Vec::new()),
        ];
        for (at, of) in parts.iter().enumerate() {
            for (n, which) in channels.clone() {
                let OfPart { width: window, scatter, clips, is_coarse } = of[n][which];
                for run in clips.iter().flatten() {
                    let problem = format!("clipped at {}, {} samples", run.value, run.clipped);
                    let accepted = "a range that the signal does not leave";
                    let fault = self.fault(stream, at, all[n], Some(run.first), problem, accepted);
                    found.warnings.push(*fault.with(Some(run.value.to_string())));
                }
                let has = [scatter.sigma == 0.0, is_coarse, scatter.is_dense];
                for ((.., with), _) in flaws.iter_mut().zip(has).filter(|(_, has)| *has) {
                    with.push((at, n));
                }
                let step = grid.nearest_step(surveyed.parts[at].first_s());
                let (time_s, stream, part, missing) =
                    (grid.time_s(step), stream as u32 + 1, at as u64 + 1, surveyed.parts[at].missing);
                let (median, sigma) = (scatter.median * all[n].scale, scatter.sigma * all[n].scale.abs());
                let clipped = clips.iter().flatten().map(|run| run.clipped).sum();
                found.rows.push(if n < sensors {
                    let sensor = n as u32 + 1;
                    Row::new(Noise {
                        step,
                        time_s,
                        stream,
                        part,
                        sensor,
                        window,
                        median,
                        sigma,
                        clipped,
                        missing,
                    })
                } else {
                    let (median_n, sigma_n) = (median, sigma);
                    Row::new(LoadNoise {
                        step,
                        time_s,
                        stream,
                        part,
                        window,
                        median_n,
                        sigma_n,
                        clipped,
                        missing,
                    })
                });
            }
        }
        for (problem, accepted, with) in flaws {
            let Some((part, n)) = with.first().copied() else { continue };
            let all_parts = channels.clone().count() * parts.len();
            let (part_number, count) = (part + 1, with.len());
            let problem =
                format!("{problem}, in part {part_number} and in {count} of {all_parts} channels of parts");
            found.warnings.push(*self.fault(stream, part, all[n], None, problem, accepted));
        }
    }

    /// What is wrong with a channel in a part, or with a sample of it.
    pub(crate) fn fault(
        &self,
        stream: usize,
        part: usize,
        channel: &Channel,
        sample: Option<u64>,
        problem: String,
        accepted: &'static str,
    ) -> Box<InputFault> {
        let (of, surveyed) = (&self.description.streams[stream], &self.streams[stream]);
        let Part { file, from, left_out, .. } = surveyed.parts[part];
        let named = &surveyed.files[file];
        let opened = self.folder.open(of, named, std::slice::from_ref(&channel.column)).ok();
        let place =
            opened.zip(sample).map_or(Place::File, |(source, sample)| source.place(from + left_out + sample));
        InputFault::new(&self.folder.shown(named), place, problem, accepted).of(&channel.column)
    }
}
