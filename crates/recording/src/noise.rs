//! The first pass: the noise of channels, and what is wrong with them.

use asperity_record::{LoadNoise, Noise, Row};

use crate::description::Channel;
use crate::error::{InputFault, Place, RecordingError};
use crate::ramp::Ramp;
use crate::recording::{Recording, SHORTEST_PART};
use crate::survey::Part;
use crate::window::{Scatter, Values, Window};

/// Equal samples in a row at the extreme of a channel that are clipped.
const CLIPPED: u64 = 3;

/// What the first pass over a stream finds.
#[derive(Debug)]
pub(crate) struct ByNoise {
    /// By part and channel.
    pub(crate) parts: Vec<Vec<OfPart>>,
    pub(crate) rows: Vec<Row>,
    pub(crate) warnings: Vec<InputFault>,
}

/// A channel in a part, in numbers as stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OfPart {
    pub(crate) scatter: Scatter,
    /// Least and largest value where the channel is clipped.
    clips: [Option<f64>; 2],
}

impl OfPart {
    /// Whether clipped samples touch a ramp.
    pub(crate) fn touches_clips(&self, window: &Window, ramp: &Ramp) -> bool {
        let (begin, end) =
            ((ramp.begin.floor() as u64).saturating_sub(CLIPPED - 1), ramp.end.ceil() as u64 + CLIPPED);
        let is_clipped =
            |run: &[f64]| self.clips.iter().flatten().any(|at| run.iter().all(|value| value == at));
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
    /// Adds the next sample, the one with this number, which may be the new extreme.
    fn add(&mut self, value: f64, is_beyond: bool, sample: u64) {
        if is_beyond {
            *self = Run { value, length: 1, clipped: 0, first: 0 };
        } else if value == self.value {
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
        let run = |value| Run { value, length: 0, clipped: 0, first: 0 };
        let [least, most] = [f64::INFINITY, f64::NEG_INFINITY].map(run);
        Extremes { least, most, quantum: f64::INFINITY, last: f64::NAN, samples: 0 }
    }
}

impl Extremes {
    fn extend(&mut self, samples: &[f64]) {
        for &value in samples {
            let is_least = value < self.least.value;
            let is_most = value > self.most.value;
            self.least.add(value, is_least, self.samples);
            self.most.add(value, is_most, self.samples);
            let step = (value - self.last).abs();
            if step > 0.0 && step < self.quantum {
                self.quantum = step;
            }
            self.last = value;
            self.samples += 1;
        }
    }

    /// Whether the steps between numbers are above the noise, if there is noise.
    fn are_coarse(&self, noise: f64) -> bool {
        noise > 0.0 && self.quantum > noise
    }

    /// The extremes at which samples are clipped; none where steps between numbers may leave equal samples.
    fn clips(&self, noise: f64) -> [Option<Run>; 2] {
        let is_tested = !self.are_coarse(noise) && self.least.value < self.most.value;
        [self.least, self.most].map(|run| Some(run).filter(|run| is_tested && run.clipped > 0))
    }
}

impl Recording {
    /// The noise of channels in each part, with windows of so many samples; `sensors` says whether they are an array.
    pub(crate) fn noise(
        &self,
        stream: usize,
        channels: &[&Channel],
        width: u64,
        sensors: bool,
    ) -> Result<ByNoise, RecordingError> {
        let surveyed = &self.streams[stream];
        if let Some(part) = surveyed.parts.iter().position(|part| part.samples < SHORTEST_PART * width) {
            let problem = format!("part {} has {} samples", part + 1, surveyed.parts[part].samples);
            let fault =
                self.fault(stream, part, channels[0], None, problem, "parts of four windows at least");
            return Err(fault.into());
        }
        let fresh = |part: usize| -> Vec<(Window, Values, Extremes)> {
            let values = || Values::of(surveyed.parts[part].samples, width);
            channels.iter().map(|_| (Window::new(width), values(), Extremes::default())).collect()
        };
        let mut found = ByNoise { parts: Vec::new(), rows: Vec::new(), warnings: Vec::new() };
        // What may be wrong with a channel of a part, with those that have it: told once for all.
        let mut flaws = [
            ("no noise", "a sensor that works; else name it in dead", Vec::new()),
            ("steps between numbers above the noise", "numbers with more digits", Vec::new()),
            ("events are too dense for the window", "a shorter window", Vec::new()),
        ];
        let mut states = fresh(0);
        self.pass(stream, channels, &mut |part, block, is_last| {
            for ((window, values, extremes), row) in states.iter_mut().zip(block) {
                extremes.extend(row);
                window.extend(row, u64::MAX);
                while let Some((index, step)) = window.next_step() {
                    values.add(index, step);
                }
            }
            if !is_last {
                return Ok(());
            }
            let next = if part + 1 < surveyed.parts.len() { fresh(part + 1) } else { Vec::new() };
            let mut of_part = Vec::new();
            for (n, (_, values, extremes)) in std::mem::replace(&mut states, next).into_iter().enumerate() {
                let scatter = values.scatter();
                let noise = scatter.sigma * (width as f64 / 2.0).sqrt();
                let clips = extremes.clips(noise);
                for run in clips.iter().flatten() {
                    let problem = format!("clipped at {}, {} samples", run.value, run.clipped);
                    let accepted = "a range that the signal does not leave";
                    let fault = self.fault(stream, part, channels[n], Some(run.first), problem, accepted);
                    found.warnings.push(*fault.with(Some(run.value.to_string())));
                }
                let has = [scatter.sigma == 0.0, extremes.are_coarse(noise), scatter.is_dense];
                for ((.., with), _) in flaws.iter_mut().zip(has).filter(|(_, has)| *has) {
                    with.push((part, n));
                }
                let scale = channels[n].scale;
                let (median, sigma) = (scatter.median * scale, scatter.sigma * scale.abs());
                let step = self.time_grid().nearest_step(surveyed.parts[part].first_s());
                let (time_s, stream, window) = (self.time_grid().time_s(step), stream as u32 + 1, width);
                let (part, clipped) = (part as u64 + 1, clips.iter().flatten().map(|run| run.clipped).sum());
                found.rows.push(match sensors {
                    true => {
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
                            missing: 0,
                        })
                    }
                    false => {
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
                            missing: 0,
                        })
                    }
                });
                of_part.push(OfPart { scatter, clips: clips.map(|clip| clip.map(|run| run.value)) });
            }
            found.parts.push(of_part);
            Ok(())
        })?;
        for (problem, accepted, with) in flaws {
            let Some((part, n)) = with.first().copied() else { continue };
            let all = channels.len() * surveyed.parts.len();
            let problem =
                format!("{problem}, in part {} and in {} of {all} channels of parts", part + 1, with.len());
            found.warnings.push(*self.fault(stream, part, channels[n], None, problem, accepted));
        }
        Ok(found)
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
        let Part { file, from, .. } = surveyed.parts[part];
        let named = &surveyed.files[file];
        let opened = self.folder.open(of, named, std::slice::from_ref(&channel.column)).ok();
        let place = opened.zip(sample).map_or(Place::File, |(source, sample)| source.place(from + sample));
        InputFault::new(&self.folder.shown(named), place, problem, accepted).of(&channel.column)
    }
}
