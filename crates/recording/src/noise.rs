//! The first pass: the noise of channels, and what is wrong with them.

use asperity_record::{LoadNoise, Noise, Row, SignalRecord};

use crate::description::Channel;
use crate::error::{InputFault, Place, RecordingError};
use crate::ramp::Ramp;
use crate::recording::{Detected, Progress, Recording, SHORTEST_PART};
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
    fn of(values: Values, extremes: &Extremes, width: u64) -> OfPart {
        let scatter = values.scatter();
        let noise = scatter.noise(width);
        let is_coarse = noise > 0.0 && extremes.quantum > noise;
        // Where steps between numbers may leave equal samples, none is tested.
        let is_tested = !is_coarse && extremes.least.value < extremes.most.value;
        let clips = [extremes.least, extremes.most];
        let clips = clips.map(|run| Some(run).filter(|run| is_tested && run.clipped > 0));
        OfPart { width, scatter, clips, is_coarse }
    }

    /// Whether clipped samples touch a ramp.
    pub(crate) fn touches_clips(&self, window: &Window, ramp: &Ramp) -> bool {
        let (begin, end) =
            ((ramp.begin.floor() as u64).saturating_sub(CLIPPED - 1), ramp.end.ceil() as u64 + CLIPPED);
        let is_clipped =
            |run: &[f64]| self.clips.iter().flatten().any(|at| run.iter().all(|value| *value == at.value));
        window.samples(begin..end).windows(CLIPPED as usize).any(is_clipped)
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

/// Extremes of a channel, and the least difference between samples that follow each other.
#[derive(Debug)]
struct Extremes {
    least: Run,
    most: Run,
    quantum: f64,
    last: f64,
    samples: u64,
}

impl Default for Extremes {
    fn default() -> Extremes {
        let [least, most] = [f64::INFINITY, f64::NEG_INFINITY].map(Run::of);
        Extremes { least, most, quantum: f64::INFINITY, last: f64::NAN, samples: 0 }
    }
}

impl Extremes {
    /// Adds samples. Returns the least, mean and largest of them.
    fn extend(&mut self, samples: &[f64]) -> [f64; 3] {
        // In lanes that a processor handles at once, always in the same order.
        let (chunks, rest) = samples.as_chunks::<LANES>();
        let (mut least, mut most, mut sums) =
            ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES], [-0.0; LANES]);
        for chunk in chunks {
            for n in 0..LANES {
                least[n] = lesser(least[n], chunk[n]);
                most[n] = larger(most[n], chunk[n]);
                sums[n] += chunk[n];
            }
        }
        let all = |lanes: [f64; LANES]| lanes.into_iter().chain(rest.iter().copied());
        let least = all(least).fold(f64::INFINITY, lesser);
        let most = all(most).fold(f64::NEG_INFINITY, larger);
        let sum: f64 = all(sums).sum();
        let apart = |before: f64, value: f64| {
            let step = (value - before).abs();
            if step > 0.0 { step } else { f64::INFINITY }
        };
        let (behind, rest) = samples[1..].as_chunks::<LANES>();
        let mut quanta = [f64::INFINITY; LANES];
        for (before, value) in chunks.iter().zip(behind) {
            for n in 0..LANES {
                quanta[n] = lesser(quanta[n], apart(before[n], value[n]));
            }
        }
        let rest = samples[samples.len() - 1 - rest.len()..].windows(2).map(|pair| apart(pair[0], pair[1]));
        let first = lesser(self.quantum, apart(self.last, samples[0]));
        self.quantum = quanta.into_iter().chain(rest).fold(first, lesser);
        let are_beyond = [least < self.least.value, most > self.most.value];
        for ((run, extreme), is_beyond) in
            [(&mut self.least, least), (&mut self.most, most)].into_iter().zip(are_beyond)
        {
            if is_beyond {
                *run = Run::of(extreme);
            }
            if extreme == run.value {
                samples.iter().zip(self.samples..).for_each(|(value, sample)| run.add(*value, sample));
            } else {
                run.length = 0;
            }
        }
        self.last = samples[samples.len() - 1];
        self.samples += samples.len() as u64;
        [least, sum / samples.len() as f64, most]
    }
}

/// Numbers that are reduced at once.
const LANES: usize = 8;

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
        let (mut signals, mut listeners) = (Signals::new(), Vec::new());
        let mut parts = vec![Vec::new(); surveyed.parts.len()];
        self.pass(stream, &channels, progress, &mut |part, first, block, is_last| {
            let of = &surveyed.parts[part];
            if first == 0 {
                let windows = |width: &u64| (Window::new(*width), Values::of(of.samples, *width));
                let fresh = |widths: &Vec<u64>| (Extremes::default(), widths.iter().map(windows).collect());
                listeners = widths.iter().map(fresh).collect::<Vec<(Extremes, Vec<(Window, Values)>)>>();
            }
            let mut read = self.signals(stream, part, first, block[0].len());
            for (((extremes, windows), row), channel) in listeners.iter_mut().zip(block).zip(&channels) {
                for (samples, record) in row.chunks(SignalRecord::MOST_SAMPLES as usize).zip(&mut read) {
                    let [a, mean, b] = extremes.extend(samples).map(|stored| channel.si(stored));
                    record.least.push(a.min(b));
                    record.mean.push(mean);
                    record.largest.push(a.max(b));
                }
                for (window, values) in windows {
                    window.extend(row, u64::MAX);
                    values.take(window);
                }
            }
            if is_last {
                let all = listeners.drain(..).map(|(extremes, windows)| {
                    let of = |(window, values): (Window, Values)| OfPart::of(values, &extremes, window.width);
                    windows.into_iter().map(of).collect()
                });
                parts[part] = all.collect();
            }
            read.iter().try_for_each(|record| signals.push(record)).map_err(RecordingError::spool)
        })?;
        Ok((parts, signals))
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
