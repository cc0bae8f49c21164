//! The pass over a stream, once the scatter of its channels is known from a few samples: what is wrong with them, what
//! they read in short, and the steps of sensors.

use std::array::from_fn;
use std::collections::BTreeSet;
use std::ops::Range;

use asperity_files::at_once;
use asperity_record::{LoadNoise, Measured, Noise, Row};
use multiversion::multiversion;

use crate::arrival;
use crate::description::{Channel, Kind, Role};
use crate::error::{InputFault, RecordingError, Result};
use crate::pass::{PIECE, Piece, Progress, Ranges};
use crate::pick::{self, Finders, Search};
use crate::ramp::Ramp;
use crate::recording::{Recording, SHORTEST_PART, Told};
use crate::samples::{LANES, Lanes, Rows};
use crate::signals::Signals;
use crate::steps::SensorStep;
use crate::survey::Part;
use crate::window::{BLOCKS, SUMMED, Scatter, Window, counted, larger, lesser};

/// Equal samples in a row at the extreme of a channel that are clipped.
const CLIPPED: u64 = 3;

/// Pieces of samples whose findings are in memory together.
const SHARES: usize = 64;

/// A channel in a part, by windows of one width, in numbers as stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OfPart {
    pub(crate) width: u64,
    pub(crate) scatter: Scatter,
    extremes: Extremes,
    /// Whether steps between numbers are above the noise.
    is_coarse: bool,
}

/// The noise of a stream: of each part and channel, for each width of its windows.
pub(crate) type NoiseOf = Vec<Vec<Vec<OfPart>>>;

/// What is found in pieces of a stream.
pub(crate) struct Heard {
    /// The extremes of channels in pieces, with their part.
    extremes: Vec<(usize, Vec<Extremes>)>,
    pub(crate) signals: Signals,
    /// Steps of sensors, and how many were of the other sign.
    pub(crate) steps: Vec<SensorStep>,
    pub(crate) others: u64,
}

impl OfPart {
    /// The extremes at which it is clipped.
    fn clips(&self) -> impl Iterator<Item = &Run> {
        let is_tested = !self.is_coarse && self.extremes[0].value < self.extremes[1].value;
        self.extremes.iter().filter(move |run| is_tested && run.clipped > 0)
    }

    /// What is looked for, given the least size of a step: without noise and that there is none.
    pub(crate) fn search(&self, threshold: f64, given: f64, sign: f64, is_force: bool) -> Search {
        let least = match threshold * self.scatter.sigma {
            0.0 if given == 0.0 => f64::INFINITY,
            by_noise => by_noise.max(given),
        };
        Search { noise: *self, least, sign, is_force }
    }

    /// Whether it is clipped at the least or the largest of these [plateaus](plateaus).
    pub(crate) fn is_clipped_at(&self, plateaus: [f64; 2]) -> bool {
        self.clips().any(|clip| plateaus.contains(&clip.value))
    }
}

/// The least and the largest value that [`CLIPPED`] samples about a ramp have one after the other; infinite without any.
pub(crate) fn plateaus(rows: &Rows<'_>, channel: usize, ramp: &Ramp) -> [f64; 2] {
    let (begin, end) =
        ((ramp.begin.floor() as u64).saturating_sub(CLIPPED - 1), ramp.end.ceil() as u64 + CLIPPED);
    let samples = rows.of(channel, begin..end).collect::<Vec<f64>>();
    let flat = samples.windows(CLIPPED as usize).filter(|run| run.iter().all(|value| *value == run[0]));
    flat.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], run| [a.min(run[0]), b.max(run[0])])
}

/// Samples at an extreme.
#[derive(Debug, Clone, Copy)]
struct Run {
    value: f64,
    /// How many are in rows of [`CLIPPED`] or more, and the first of them.
    clipped: u64,
    first: u64,
}

impl Run {
    fn of(value: f64) -> Run {
        Run { value, clipped: 0, first: 0 }
    }

    /// Adds samples from a place on, of which those before `from` were added.
    fn extend(&mut self, samples: impl Iterator<Item = f64>, place: u64, from: u64) {
        let mut length = 0;
        for (sample, value) in (place..).zip(samples) {
            length = if value == self.value { length + 1 } else { 0 };
            if length >= CLIPPED && sample >= from {
                self.first = if self.clipped == 0 { sample + 1 - CLIPPED } else { self.first };
                self.clipped += if length == CLIPPED { CLIPPED } else { 1 };
            }
        }
    }

    /// With that of the samples behind, both at the least or at the largest.
    fn with(self, next: Run, is_largest: bool) -> Run {
        if next.value == self.value {
            let first = if self.clipped == 0 { next.first } else { self.first };
            return Run { clipped: self.clipped + next.clipped, first, ..self };
        }
        if (next.value > self.value) == is_largest { next } else { self }
    }
}

/// The least and the largest samples of a channel.
type Extremes = [Run; 2];

/// Of a channel with that noise before its samples. Where steps between numbers may leave equal samples, none is looked
/// for.
fn extremes(noise: &[OfPart]) -> Extremes {
    let sign = if noise.iter().all(|of| of.is_coarse) { -1.0 } else { 1.0 };
    [f64::INFINITY, f64::NEG_INFINITY].map(|none| Run::of(sign * none))
}

/// Adds the samples from one on of channels that lie side by side. Returns the least, the sum and the largest of them.
fn extend(extremes: &mut [Extremes], rows: &Rows<'_>, group: usize, first: u64) -> [Lanes; 3] {
    let lanes = |from: u64| rows.block.lanes(group, (from - rows.first) as usize);
    let [least, sum, most] = reduce(lanes(first));
    for (n, extremes) in extremes.iter_mut().enumerate() {
        for (run, (extreme, is_largest)) in extremes.iter_mut().zip([(least[n], false), (most[n], true)]) {
            let mut next = Run::of(extreme);
            if run.with(next, is_largest).value == extreme {
                let place = first.saturating_sub(CLIPPED - 1).max(rows.first);
                next.extend(lanes(place).map(|lanes| lanes[n]), place, first);
                *run = run.with(next, is_largest);
            }
        }
    }
    [least, sum, most]
}

/// Least, sum and largest of samples.
#[multiversion(targets("x86_64+avx512f+avx512vl+avx512dq", "x86_64+avx2"))]
fn reduce<'a>(mut samples: impl Iterator<Item = &'a Lanes>) -> [Lanes; 3] {
    let (mut least, mut sum, mut most) = ([f64::INFINITY; LANES], [0.0; LANES], [f64::NEG_INFINITY; LANES]);
    // By pairs, so that half as many wait for the one before.
    while let Some(a) = samples.next() {
        let [b, added] = samples.next().map_or([a, &[0.0; LANES]], |b| [b, b]);
        least = from_fn(|n| lesser(least[n], lesser(a[n], b[n])));
        most = from_fn(|n| larger(most[n], larger(a[n], b[n])));
        sum = from_fn(|n| sum[n] + (a[n] + added[n]));
    }
    [least, sum, most]
}

impl Heard {
    fn new() -> Heard {
        Heard { extremes: Vec::new(), signals: Signals::new(), steps: Vec::new(), others: 0 }
    }
}

impl Recording {
    /// The noise of the channels of a stream. Only samples that tell it are read.
    fn scatters(&self, stream: usize, widths: &[Vec<u64>], progress: &Progress<'_>) -> Result<NoiseOf> {
        let all: BTreeSet<u64> = widths.iter().flatten().copied().collect();
        let mut parts = vec![vec![Vec::new(); widths.len()]; self.streams[stream].parts.len()];
        let Some(longest) = all.last() else { return Ok(parts) };
        let mut ranges = Ranges::new(self, stream, self.description.streams[stream].channels().collect());
        for (part, Part { samples, .. }) in self.streams[stream].parts.iter().enumerate() {
            let samples = *samples;
            let of_group = |_: &[_]| all.iter().map(|width| (Window::new(*width, 0), Vec::new())).collect();
            let mut groups: Vec<Vec<(Window, Vec<Lanes>)>> = widths.chunks(LANES).map(of_group).collect();
            let mut quanta = vec![f64::INFINITY; widths.len()];
            for block in 0..BLOCKS {
                let due: Vec<Range<u64>> = all.iter().map(|width| counted(samples, *width, block)).collect();
                let from = due.iter().map(|of| of.start / SUMMED * SUMMED).min().unwrap_or_default();
                let to = due.iter().map(|of| of.end + longest).max().unwrap_or_default();
                let rows = ranges.rows(part, &(from.saturating_sub(*longest)..to))?;
                for (n, quantum) in quanta.iter_mut().enumerate() {
                    let [before, behind] = [from, from + 1].map(|from| rows.of(n, from..to));
                    let steps = before.zip(behind).map(|(before, behind)| (behind - before).abs());
                    *quantum = steps.filter(|step| *step > 0.0).fold(*quantum, f64::min);
                }
                for (group, windows) in groups.iter_mut().enumerate() {
                    let due = windows.iter_mut().zip(&due);
                    due.for_each(|((window, values), of)| window.take(&rows, group, of, values));
                }
                progress.add(samples * (block + 1) / BLOCKS - samples * block / BLOCKS)?;
            }
            for (n, widths) in widths.iter().enumerate() {
                let its = groups[n / LANES].iter().filter(|(window, _)| widths.contains(&window.width));
                parts[part][n].extend(its.map(|(window, values)| {
                    let values: Vec<f64> = values.iter().map(|lanes| lanes[n % LANES]).collect();
                    let (width, scatter) = (window.width, Scatter::of(&values));
                    let noise = scatter.noise(width);
                    let is_coarse = noise > 0.0 && quanta[n] > noise;
                    let extremes = [f64::INFINITY, f64::NEG_INFINITY].map(Run::of);
                    OfPart { width, scatter, extremes, is_coarse }
                }));
            }
        }
        Ok(parts)
    }

    /// Goes through a stream: the noise of its channels by the widths of their windows, as many as each has, what all of
    /// them read, and the steps of the sensors, if they have a role.
    pub(crate) fn listen(
        &self,
        stream: usize,
        widths: &[Vec<u64>],
        role: Option<Role>,
        progress: &Progress<'_>,
    ) -> Result<(NoiseOf, Heard)> {
        let surveyed = &self.streams[stream];
        let channels: Vec<&Channel> = self.description.streams[stream].channels().collect();
        let longest = widths.iter().flatten().max().copied().unwrap_or_default();
        if let Some(part) = surveyed.parts.iter().position(|part| part.samples < SHORTEST_PART * longest) {
            let Part { number, samples, .. } = surveyed.parts[part];
            let problem = format!("part {number} has {samples} samples");
            let accepted = "parts of four windows at least";
            return Err(self.fault(stream, part, channels[0], None, problem, accepted).into());
        }
        let mut noise = self.scatters(stream, widths, progress)?;
        let of = &self.description.streams[stream];
        // Where samples lie at known places of a file, all processors go through them.
        let is_placed = of.rate_hz.is_some() && matches!(of.kind(), Some(Kind::Raw | Kind::Npy));
        let (most, together) = if is_placed { (PIECE, 1) } else { (u64::MAX, usize::MAX) };
        let (pieces, mut found) = (self.pieces(stream, most), Heard::new());
        let jobs: Vec<&[Piece]> = pieces.chunks(together).collect();
        for jobs in jobs.chunks(SHARES) {
            for next in at_once(jobs, None, |pieces| self.hear(stream, role, &noise, pieces, progress))? {
                found.signals.append(next.signals).map_err(RecordingError::spool)?;
                found.steps.extend(next.steps);
                found.others += next.others;
                for (part, extremes) in next.extremes {
                    for (noise, next) in noise[part].iter_mut().zip(extremes) {
                        noise.iter_mut().for_each(|of| {
                            let [least, most] = of.extremes;
                            of.extremes = [least.with(next[0], false), most.with(next[1], true)];
                        });
                    }
                }
            }
        }
        found.steps.retain(|of| !noise[of.part][of.sensor as usize - 1][0].is_clipped_at(of.plateaus));
        // An arrival may lie before its part by rounding.
        found.steps.sort_by(|a, b| {
            let by_time = a.arrival_s.total_cmp(&b.arrival_s);
            a.part.cmp(&b.part).then(by_time).then(a.sensor.cmp(&b.sensor))
        });
        Ok((noise, found))
    }

    /// Goes through pieces of a stream, whose noise is known.
    fn hear(
        &self,
        stream: usize,
        role: Option<Role>,
        noise: &NoiseOf,
        pieces: &[Piece],
        progress: &Progress<'_>,
    ) -> Result<Heard> {
        let (surveyed, detection) = (&self.streams[stream], &self.description.detection);
        let channels: Vec<&Channel> = self.description.streams[stream].channels().collect();
        let sensors = role.map_or(0, |_| self.description.streams[stream].sensors.len());
        let behind = if sensors > 0 { pick::BEHIND * noise[0][0][0].width } else { CLIPPED };
        let (mut found, mut finders) = (Heard::new(), Vec::new());
        self.pass(stream, &channels, behind, pieces, progress, &mut |piece, first, rows, is_last| {
            let (part, noise) = (piece.part, &noise[piece.part]);
            if first == piece.samples.start {
                let search = |(noise, channel): (&Vec<OfPart>, &&Channel)| {
                    let (factor, sign) = (channel.factor.0, channel.role.sign());
                    let given = detection.least_step.0 / factor.abs();
                    noise[0].search(detection.threshold.0, given, sign * factor.signum(), false)
                };
                let sought: Vec<Search> = noise.iter().zip(&channels).take(sensors).map(search).collect();
                finders = sought.chunks(LANES).map(|sought| Finders::new(sought, piece)).collect();
                found.extremes.push((part, noise.iter().map(|noise| extremes(noise)).collect()));
            }
            if first < piece.samples.end {
                let mut read = Vec::with_capacity(channels.len());
                let (_, extremes) = found.extremes.last_mut().expect("it was begun");
                let groups = extremes.chunks_mut(LANES).zip(channels.chunks(LANES));
                for (group, (extremes, channels)) in groups.enumerate() {
                    let [least, sum, most] = extend(extremes, rows, group, first);
                    for (n, channel) in channels.iter().enumerate() {
                        let mean = sum[n] / (rows.end() - first) as f64;
                        let [a, mean, b] = [least[n], mean, most[n]].map(|stored| channel.si(stored));
                        read.push([a.min(b), mean, a.max(b)]);
                    }
                }
                found.signals.push(&read).map_err(RecordingError::spool)?;
            }
            let Some(role) = role else { return Ok(false) };
            let mut wants_more = false;
            for (group, finders) in finders.iter_mut().enumerate() {
                wants_more |= finders.extend(rows, group, is_last, &mut |n, ramp| {
                    let (OfPart { width, scatter, .. }, scale) = (noise[n][0], channels[n].scale);
                    let places = [arrival::arrival(rows, n, &ramp, width, role), ramp.end];
                    let [arrival_s, stop_s] = places.map(|place| surveyed.parts[part].time_s(place));
                    let error_s = arrival::error(&ramp, scatter.noise(width), role) * surveyed.interval_s;
                    let (step, step_error) = (ramp.size * scale, scatter.sigma * scale.abs());
                    let measured = Measured { error_s, step, step_error };
                    let (sensor, plateaus) = (n as u32 + 1, plateaus(rows, n, &ramp));
                    found.steps.push(SensorStep { part, sensor, arrival_s, stop_s, measured, plateaus });
                });
                found.others += finders.take_others();
            }
            Ok(wants_more)
        })?;
        Ok(found)
    }

    /// Adds the noise of channels in parts to what is found, and warnings.
    pub(crate) fn report(&self, stream: usize, noise: &[(usize, usize, OfPart)], told: &mut Told) {
        let (surveyed, grid) = (&self.streams[stream], self.time_grid());
        let all: Vec<&Channel> = self.description.streams[stream].channels().collect();
        let sensors = self.description.streams[stream].sensors.len();
        for (part, n, of) in noise {
            for run in of.clips() {
                let problem = format!("clipped at {}, {} samples", run.value, run.clipped);
                let accepted = "a range that the signal does not leave";
                let at = Some((run.first, run.value));
                told.1.push(self.fault(stream, *part, all[*n], at, problem, accepted));
            }
            let (of_part, scale, sensor) = (&surveyed.parts[*part], all[*n].scale, *n as u32 + 1);
            let (part, missing, window) = (of_part.number, of_part.missing, of.width);
            let step = grid.nearest_step(of_part.first_s());
            let (time_s, stream) = (grid.time_s(step), stream as u32 + 1);
            let (median, sigma) = (of.scatter.median * scale, of.scatter.sigma * scale.abs());
            let (clipped, median_n, sigma_n) = (of.clips().map(|run| run.clipped).sum(), median, sigma);
            let of_force =
                LoadNoise { step, time_s, stream, part, window, median_n, sigma_n, clipped, missing };
            let row = Noise { step, time_s, stream, part, sensor, window, median, sigma, clipped, missing };
            told.0.push(if *n < sensors { Row::new(row) } else { Row::new(of_force) });
        }
        // What may be wrong with a channel of a part, told once for all that have it.
        type Has = fn(&OfPart) -> bool;
        let flaws: [(_, _, Has); 3] = [
            ("no noise", "a sensor that works; else name it in dead", |of| of.scatter.sigma == 0.0),
            ("steps between numbers above the noise", "numbers with more digits", |of| of.is_coarse),
            ("events are too dense for the window", "a shorter window", |of| of.scatter.is_dense),
        ];
        for (problem, accepted, has) in flaws {
            let with: Vec<_> = noise.iter().filter(|(.., of)| has(of)).collect();
            let Some((part, n, _)) = with.first() else { continue };
            let (first, count, of) = (surveyed.parts[*part].number, with.len(), noise.len());
            let problem = format!("{problem}, in part {first} and in {count} of {of} channels of parts");
            told.1.push(self.fault(stream, *part, all[*n], None, problem, accepted));
        }
    }

    /// What is wrong with a channel in a part, or with a sample of it that has this value.
    pub(crate) fn fault(
        &self,
        stream: usize,
        part: usize,
        channel: &Channel,
        at: Option<(u64, f64)>,
        problem: String,
        accepted: &'static str,
    ) -> InputFault {
        let (of, surveyed) = (&self.description.streams[stream], &self.streams[stream]);
        let Part { file, from, .. } = surveyed.parts[part];
        let named = &surveyed.files[file];
        let opened = self.folder.open(of, named, std::slice::from_ref(&channel.column)).ok();
        let place = opened.zip(at).map(|(source, (n, _))| source.place(from + n));
        let value = at.map(|(_, value)| value.to_string());
        InputFault::new(&self.folder.shown(named), place.unwrap_or_default(), problem, accepted)
            .of(&channel.column, value.as_deref())
    }
}
