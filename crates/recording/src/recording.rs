//! A recording that is read: noise first, then steps, then the loads at their times.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use asperity_record::{
    LoadDrop, MOST_STEPS, Parts, RECORD_SCHEMA_VERSION, Row, RunHeader, Scales, Sensors, StepRecord, TimeGrid,
};

use crate::arrival;
use crate::description::{Channel, Description, Positive, Role, Stream};
use crate::error::{InputFault, Place, RecordingError};
use crate::force::{BEHIND, Forces, Loads, Request, Side};
use crate::input::{Folder, Given, Input};
use crate::noise::OfPart;
use crate::pass::{Progress, Ranges, at_once};
use crate::pick::{self, Finders, Search};
use crate::samples::{LANES, Rows};
use crate::signals::Signals;
use crate::steps::{SensorStep, Timeline};
use crate::survey::{Part, Surveyed, survey};
use crate::window::Scatter;

/// Steps of the log per sample of the fastest stream.
const STEPS_PER_SAMPLE: f64 = 64.0;

/// Samples of a window where none is given, and the fewest.
pub(crate) const WINDOW: u64 = 32;
const LEAST_WINDOW: u64 = 4;

/// More samples than any part has.
const MOST_WINDOW: u64 = 1 << 48;

/// Windows of which that of the forces is chosen, and the share of the most drops that it must find.
const FORCE_WINDOWS: [u64; 4] = [4, 8, 16, 32];
const SHARE_OF_DROPS: f64 = 0.9;

/// The shortest part, in windows.
pub(crate) const SHORTEST_PART: u64 = 4;

/// Step records of a recording where their interval is not given.
const SAMPLED: f64 = 1000.0;

/// Most of them.
const MOST_SAMPLED: f64 = 1e6;

/// Samples in a window.
fn width(window_s: Positive, surveyed: &Surveyed) -> u64 {
    ((window_s.0 / surveyed.interval_s).round() as u64).clamp(LEAST_WINDOW, MOST_WINDOW)
}

/// The least size of a step: without noise there is none, unless it is given.
fn least(threshold: f64, scatter: &Scatter, given: f64) -> f64 {
    match threshold * scatter.sigma {
        0.0 if given == 0.0 => f64::INFINITY,
        by_noise => by_noise.max(given),
    }
}

/// A recording whose streams and parts are known.
#[derive(Debug)]
pub struct Recording {
    /// Its description.
    pub description: Description,
    pub(crate) folder: Folder,
    pub(crate) streams: Vec<Surveyed>,
}

/// What was found in a recording.
#[derive(Debug)]
pub struct Detected {
    /// The noise of each part and channel, and what is told of a model: rows of [`Noise`](asperity_record::Noise),
    /// [`LoadNoise`](asperity_record::LoadNoise), [`Estimate`](asperity_record::Estimate) and
    /// [`FirstReach`](asperity_record::FirstReach).
    pub rows: Vec<Row>,
    /// What lessens the result.
    pub warnings: Vec<InputFault>,
    /// Length and hash of every file, by their paths; none if nothing but detection was asked for.
    pub inputs: BTreeMap<String, Input>,
    /// Load drops, in order.
    pub drops: Vec<LoadDrop>,
    pub(crate) timeline: Timeline,
    pub(crate) loads: Vec<Loads>,
    pub(crate) signals: Vec<Signals>,
    /// Samples per window of the sensors.
    pub(crate) window: u64,
    normal_load_n: f64,
}

impl Detected {
    /// The step records, in order.
    pub fn steps(&self) -> impl Iterator<Item = StepRecord> {
        self.timeline.records(&self.loads, self.normal_load_n)
    }
}

impl Recording {
    /// Finds the files and parts of a recording.
    ///
    /// # Errors
    /// If a file cannot be read, or what it says is not accepted.
    pub fn open(description: Description) -> Result<Recording, RecordingError> {
        Recording::of_given(description, Given::new())
    }

    /// Finds the files and parts of a recording, some of whose files are in memory.
    ///
    /// # Errors
    /// As [`Recording::open`].
    pub fn of_given(mut description: Description, given: Given) -> Result<Recording, RecordingError> {
        let folder = Folder::of(&description.file, given);
        let surveyed = description.streams.iter_mut().map(|stream| survey(&folder, stream));
        let streams = surveyed.collect::<Result<Vec<Surveyed>, RecordingError>>()?;
        let recording = Recording { description, folder, streams };
        let unfit = |problem: String, accepted| {
            Err(InputFault::new(&recording.description.file, Place::File, problem, accepted).into())
        };
        let (step_s, last_s) = (recording.step_s(), recording.last_s());
        let first_s = recording.spans().map(|[first_s, _]| first_s).fold(f64::INFINITY, f64::min);
        if first_s < 0.0 {
            return unfit(format!("it begins at {first_s} s"), "from 0 s on; see offset_s");
        }
        if !step_s.is_normal() || last_s / step_s > MOST_STEPS as f64 {
            return unfit(format!("{last_s} s in steps of {step_s} s"), "2^53 steps");
        }
        for (n, stream) in recording.description.streams.iter().enumerate() {
            let (parts, order) = (&recording.streams[n].parts, recording.order(n));
            let overlap = |pair: &&[usize]| parts[pair[1]].first_s() <= parts[pair[0]].last_s();
            if let Some([one, other]) = order.windows(2).find(overlap) {
                let problem =
                    format!("{}: parts {} and {} at the same time", stream.name(), one + 1, other + 1);
                return unfit(problem, "parts of a stream one after the other");
            }
        }
        if let Some(sample_s) =
            recording.description.sample_s.filter(|sample_s| last_s / sample_s > MOST_SAMPLED)
        {
            return unfit(
                format!("sample_s = {sample_s}"),
                "an interval of which the recording has a million",
            );
        }
        if let (Some(contacts), Some(forces)) = (recording.description.contacts, recording.description.forces)
        {
            let [[a, b], [c, d]] = [contacts, forces].map(|stream| recording.span(stream));
            if b < c || d < a {
                return unfit(format!("streams at {a} to {b} s and at {c} to {d} s"), "streams that overlap");
            }
        }
        Ok(recording)
    }

    /// The parts of a stream in order of time.
    pub(crate) fn order(&self, stream: usize) -> Vec<usize> {
        let parts = &self.streams[stream].parts;
        let mut order: Vec<usize> = (0..parts.len()).collect();
        order.sort_by(|a, b| parts[*a].first_s().total_cmp(&parts[*b].first_s()));
        order
    }

    /// First and last time of a stream, s.
    fn span(&self, stream: usize) -> [f64; 2] {
        let parts = &self.streams[stream].parts;
        let first_s = parts.iter().map(Part::first_s).fold(f64::INFINITY, f64::min);
        [first_s, parts.iter().map(Part::last_s).fold(first_s, f64::max)]
    }

    fn spans(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..self.streams.len()).map(|stream| self.span(stream))
    }

    /// Length and hash of every file, by their paths.
    fn inputs(&self, is_in_vain: &AtomicBool) -> Result<BTreeMap<String, Input>, RecordingError> {
        let of_streams = self.streams.iter().flat_map(|stream| &stream.files);
        let starts = self.description.streams.iter().filter_map(|stream| stream.starts.as_ref());
        let starts = starts.map(|starts| &starts.file);
        of_streams
            .chain(starts)
            .map(|named| Ok((named.clone(), self.folder.input(named, is_in_vain)?)))
            .collect()
    }

    /// Lines about the streams, for people.
    pub fn in_words(&self) -> Vec<String> {
        let line = |(stream, surveyed): (&Stream, &Surveyed)| {
            let samples: u64 = surveyed.parts.iter().map(|part| part.samples).sum();
            format!(
                "{}: {} of {samples} samples at {} Hz, {} and {}",
                stream.name(),
                asperity_record::counted(surveyed.parts.len() as u64, "part"),
                asperity_record::short(1.0 / surveyed.interval_s),
                asperity_record::counted(stream.sensors.len() as u64, "sensor"),
                asperity_record::counted(stream.channel.len() as u64, "channel"),
            )
        };
        self.description.streams.iter().zip(&self.streams).map(line).collect()
    }

    /// The header of the log, without code version and run id.
    pub fn header(&self, inputs: &BTreeMap<String, Input>) -> RunHeader {
        let Description { text, name, slider, detection, .. } = &self.description;
        let x_m = self.description.positions_m();
        let mut hasher = blake3::Hasher::new();
        hasher.update(text.as_bytes());
        for input in inputs.values() {
            hasher.update(input.blake3.as_bytes());
        }
        let time_grid = self.time_grid();
        RunHeader {
            record_schema_version: RECORD_SCHEMA_VERSION,
            scenario: name.clone(),
            scenario_hash: hasher.finalize().to_hex().to_string(),
            run_id: String::new(),
            code_version: String::new(),
            parameter_set: "measured".to_owned(),
            solver: "none".to_owned(),
            blocks: x_m.len().max(1) as u32,
            rows: 1,
            junction_count: 0,
            flags: Parts::default(),
            time_step_s: time_grid.step_s(),
            longest_stable_step_s: None,
            steps: self.last_step(),
            scales: self.scales(),
            sensors: Some(Sensors {
                length_m: slider.length_m.0,
                x_m,
                are_of_slip: self.description.contact_role() == Some(Role::Slip),
                threshold: detection.threshold(),
                least_step: detection.least_step.map_or(0.0, |step| step.0),
            }),
        }
    }

    /// Arrivals are linked over the largest gap.
    pub(crate) fn scales(&self) -> Scales {
        let Description { slider, detection, .. } = &self.description;
        let x_m = self.description.positions_m();
        let places_m = [&[0.0], &x_m[..], &[slider.length_m.0]].concat();
        let largest_gap_m = places_m.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        Scales {
            block_length_m: largest_gap_m,
            block_time_s: largest_gap_m / slider.wave_speed_m_per_s(),
            link_time_ratio: detection.link_time_ratio(),
            modulus_n_per_m: slider.youngs_modulus_pa.0 * slider.width_m.0,
            interfacial_stiffness_n_per_m: 0.0,
        }
    }

    pub(crate) fn last_step(&self) -> u64 {
        self.time_grid().nearest_step(self.last_s())
    }

    fn last_s(&self) -> f64 {
        self.spans().map(|[_, last_s]| last_s).fold(0.0, f64::max)
    }

    /// Length of a step of the log.
    fn step_s(&self) -> f64 {
        let fastest_s = self.streams.iter().map(|stream| stream.interval_s).fold(f64::INFINITY, f64::min);
        fastest_s / STEPS_PER_SAMPLE
    }

    pub(crate) fn time_grid(&self) -> TimeGrid {
        TimeGrid::new(self.step_s())
    }

    pub(crate) fn normal_load_n(&self) -> f64 {
        self.description.slider.normal_force_n.map_or(1.0, |load| load.0)
    }

    /// As [`Recording::detect`], and computes length and hash of every file meanwhile.
    ///
    /// # Errors
    /// As that.
    pub fn read(&self, watch: &mut dyn FnMut(u64, u64) -> bool) -> Result<Detected, RecordingError> {
        let (found, inputs) = at_once(|| self.detect(watch), |is_in_vain| self.inputs(is_in_vain))?;
        Ok(Detected { inputs, ..found })
    }

    /// Finds steps, load drops and loads. `watch` is told how many samples were read, of how many in all passes, and says
    /// whether to stop.
    ///
    /// # Errors
    /// If a file cannot be read, or holds something other than finite numbers, or it is stopped.
    pub fn detect(&self, watch: &mut dyn FnMut(u64, u64) -> bool) -> Result<Detected, RecordingError> {
        let Description { contacts, forces, detection, .. } = &self.description;
        let samples = |stream: usize| self.streams[stream].parts.iter().map(|part| part.samples).sum::<u64>();
        // The forces a third time for estimates.
        let again = contacts.iter().chain(forces).chain(forces);
        let of = (0..self.streams.len()).chain(again.copied()).map(samples).sum();
        let mut progress = Progress { watch, done: 0, of };
        let window = match (detection.window_s, contacts) {
            (Some(window_s), Some(stream)) => width(window_s, &self.streams[*stream]),
            _ => WINDOW,
        };
        let role = self.description.contact_role();
        let sample_s = self.description.sample_s.unwrap_or(self.last_s() / SAMPLED);
        let timeline = |steps| {
            Timeline::of(steps, role == Some(Role::Slip), self.time_grid(), self.last_step(), sample_s)
        };
        let mut found = Detected {
            rows: Vec::new(),
            warnings: Vec::new(),
            inputs: BTreeMap::new(),
            drops: Vec::new(),
            timeline: timeline(Vec::new()),
            loads: Vec::new(),
            signals: Vec::new(),
            window,
            normal_load_n: self.normal_load_n(),
        };
        let (mut steps, mut of_drops) = (Vec::new(), None);
        for (stream, of) in self.description.streams.iter().enumerate() {
            let is = |which: &Option<usize>| *which == Some(stream);
            let widths_of = |channel: &Channel, n: usize| match channel.role {
                _ if n < of.sensors.len() => {
                    if is(contacts) {
                        vec![window]
                    } else {
                        Vec::new()
                    }
                }
                Role::TangentialForce => self.force_widths(stream),
                _ => Vec::new(),
            };
            let widths: Vec<Vec<u64>> =
                of.channels().zip(0..).map(|(channel, n)| widths_of(channel, n)).collect();
            let (parts, signals) = self.listen(stream, &widths, &mut progress)?;
            found.signals.push(signals);
            if let Some(role) = role.filter(|_| is(contacts)) {
                self.report(stream, &parts, (0..of.sensors.len()).map(|n| (n, 0)), &mut found);
                steps = self.steps(stream, role, &parts, &mut progress, &mut found)?;
            }
            if is(forces) {
                let channel = widths.iter().rposition(|widths| !widths.is_empty()).expect("that of F_T");
                let (which, of_stream) = self.forces(stream, channel, &parts, &mut progress)?;
                self.report(stream, &parts, [(channel, which)].into_iter(), &mut found);
                of_drops = Some((stream, of_stream));
            }
        }
        found.rows.sort_by_key(|noise| noise.step);
        found.timeline = timeline(steps);
        if let Some((stream, mut forces)) = of_drops {
            found.drops = std::mem::take(&mut forces.drops);
            found.loads = self.loads(stream, &forces, &found.timeline)?;
        }
        let told = self.estimates(&found, &mut progress)?;
        found.rows.extend(told);
        Ok(found)
    }

    /// The steps of all sensors of the array that makes the contacts.
    fn steps(
        &self,
        stream: usize,
        role: Role,
        noise: &[Vec<Vec<OfPart>>],
        progress: &mut Progress<'_>,
        found: &mut Detected,
    ) -> Result<Vec<SensorStep>, RecordingError> {
        let (surveyed, detection) = (&self.streams[stream], &self.description.detection);
        let channels: Vec<&Channel> = self.description.streams[stream].sensors.iter().collect();
        let search = |part: usize, n: usize| {
            let (channel, OfPart { width, scatter, .. }) = (channels[n], noise[part][n][0]);
            let given = detection.least_step.map_or(0.0, |step| step.0) / channel.factor.0.abs();
            let least = least(detection.threshold(), &scatter, given);
            Search { width, scatter, least, sign: role.sign() * channel.factor.0.signum(), is_force: false }
        };
        let behind = pick::BEHIND * found.window;
        let found_in = |sensors: Range<usize>, progress: &mut Progress<'_>| {
            let mut finders: Vec<Finders> = Vec::new();
            // With the place of their part in time.
            let (mut steps, mut nth): (Vec<(usize, SensorStep)>, usize) = (Vec::new(), 0);
            // Steps of each sensor, and those of the other sign.
            let (mut counts, mut others) = (vec![0; sensors.len()], 0);
            let visit = &mut |part: usize, first: u64, rows: &Rows<'_>, is_last: bool| {
                let of = &surveyed.parts[part];
                if first == 0 {
                    let searches: Vec<Search> = sensors.clone().map(|n| search(part, n)).collect();
                    finders = searches.chunks(LANES).map(Finders::new).collect();
                }
                for (group, finders) in finders.iter_mut().enumerate() {
                    finders.extend(rows, group, is_last, &mut |n, ramp| {
                        let sensor = sensors.start + n;
                        let (of_part, scale) = (&noise[part][sensor][0], channels[sensor].scale);
                        if of_part.touches_clips(rows, n, &ramp) {
                            return;
                        }
                        let OfPart { width, scatter, .. } = of_part;
                        counts[n] += 1;
                        steps.push((
                            nth,
                            SensorStep {
                                sensor: sensor as u32 + 1,
                                arrival_s: of.time_s(arrival::arrival(rows, n, &ramp, *width, role)),
                                stop_s: of.time_s(ramp.end),
                                error_s: arrival::error(&ramp, scatter.noise(*width), role)
                                    * surveyed.interval_s,
                                size: ramp.size * scale,
                                size_error: scatter.sigma * scale.abs(),
                            },
                        ));
                    });
                }
                if is_last {
                    others += finders.iter().map(Finders::others).sum::<u64>();
                    nth += 1;
                }
                Ok(())
            };
            self.pass(stream, &channels[sensors.clone()], behind, progress, visit)?;
            Ok((steps, counts, others))
        };
        let halves = self.in_halves(stream, channels.len(), progress, found_in)?;
        let (mut steps, mut counts, mut others) = (Vec::new(), Vec::new(), 0);
        for (of_half, counts_of_half, others_of_half) in halves {
            steps.extend(of_half);
            counts.extend(counts_of_half);
            others += others_of_half;
        }
        // Parts do not overlap, but an arrival may lie before its part by rounding.
        steps.sort_by(|(part, a), (other, b)| {
            part.cmp(other).then(a.arrival_s.total_cmp(&b.arrival_s)).then(a.sensor.cmp(&b.sensor))
        });
        self.warn(stream, role, &counts, others, found);
        Ok(steps.into_iter().map(|(_, step)| step).collect())
    }

    /// Warns of what makes steps of an array doubtful, given how many each sensor has, and how many had the other sign.
    fn warn(&self, stream: usize, role: Role, counts: &[u64], others: u64, found: &mut Detected) {
        /// Steps of both neighbours without which one may be dead.
        const MANY: u64 = 20;
        let (sensors, scales) = (&self.description.streams[stream].sensors, self.scales());
        let interval_s = self.streams[stream].interval_s;
        let (window_s, link_s, wave_s) =
            (found.window as f64 * interval_s, scales.link_s(), scales.block_time_s);
        let mut warn = |is_so: bool, n: usize, problem: String, accepted: &'static str| {
            if is_so {
                found.warnings.push(*self.fault(stream, 0, &sensors[n], None, problem, accepted));
            }
        };
        for n in 1..counts.len().max(1) - 1 {
            let (before, after) = (counts[n - 1], counts[n + 1]);
            let problem = format!("no step, where the sensors beside it have {before} and {after}");
            let is_dead = counts[n] == 0 && before.min(after) >= MANY;
            warn(is_dead, n, problem, "a sensor that works; else name it in dead");
        }
        let all: u64 = counts.iter().sum();
        let is_shear = matches!(role, Role::ShearForce | Role::ShearStrain);
        let problem = format!("{others} steps of the other sign, beside {all} that fall");
        warn(is_shear && all > 0 && others >= all, 0, problem, "extents by slip or area, not by shear");
        let problem = format!("a window of {window_s:.3e} s, where {link_s:.3e} s part ruptures");
        warn(window_s > link_s, 0, problem, "a shorter window, or a larger link_time_ratio");
        let problem =
            format!("an interval of {interval_s:.3e} s; a wave takes {wave_s:.3e} s over the largest gap");
        warn(interval_s > wave_s, 0, problem, "faster sampling, for speeds of fronts");
    }

    /// Channels of `F_T`, and of `F_N` and the load point if they are recorded, with their places among those.
    pub(crate) fn force_channels(&self, stream: usize) -> (Vec<&Channel>, [Option<usize>; 3]) {
        let mut channels = Vec::new();
        let places = [Role::TangentialForce, Role::NormalForce, Role::LoadPoint].map(|role| {
            let channel = self.description.streams[stream].with(role)?;
            channels.push(channel);
            Some(channels.len() - 1)
        });
        (channels, places)
    }

    /// The windows of which that of the forces is chosen.
    fn force_widths(&self, stream: usize) -> Vec<u64> {
        let surveyed = &self.streams[stream];
        let shortest = surveyed.parts.iter().map(|part| part.samples).min().unwrap_or_default();
        let fits = |width: &u64| *width == LEAST_WINDOW || shortest >= SHORTEST_PART * width;
        match self.description.detection.force_window_s {
            Some(window_s) => vec![width(window_s, surveyed)],
            None => FORCE_WINDOWS.into_iter().filter(fits).collect(),
        }
    }

    /// The forces and their load drops, and which of the windows they are by; given the noise of `F_T`, a channel of the
    /// stream.
    fn forces(
        &self,
        stream: usize,
        channel: usize,
        noise: &[Vec<Vec<OfPart>>],
        progress: &mut Progress<'_>,
    ) -> Result<(usize, Forces<'_>), RecordingError> {
        let (parts, detection) = (&self.streams[stream].parts, &self.description.detection);
        let (channels, places) = self.force_channels(stream);
        let scale = channels[0].scale;
        let by_width = |which: usize| {
            let noise: Vec<OfPart> = noise.iter().map(|of| of[channel][which]).collect();
            let search = |OfPart { width, scatter, .. }: &OfPart| {
                let given = detection.least_drop_n.map_or(0.0, |drop| drop.0) / scale.abs();
                let least = least(detection.threshold(), scatter, given);
                Search { width: *width, scatter: *scatter, least, sign: -scale.signum(), is_force: true }
            };
            let searches: Vec<Search> = noise.iter().map(search).collect();
            Forces {
                parts,
                ramps: vec![Vec::new(); parts.len()],
                finder: Finders::new(&searches[..1]),
                searches,
                channels: channels.clone(),
                places,
                normal_force_n: self.description.slider.normal_force_n.map(|load| load.0),
                noise,
                drops: Vec::new(),
                judged: 0,
            }
        };
        let mut tried: Vec<Forces<'_>> = (0..noise[0][channel].len()).map(by_width).collect();
        let longest = tried.iter().map(|forces| forces.searches[0].width).max().unwrap_or_default();
        self.pass(stream, &channels, BEHIND * longest, progress, &mut |part, first, rows, is_last| {
            let unloaded = |row: usize| {
                let mut stored = rows.of(row, first..rows.end());
                let n = stored.position(|stored| channels[row].si(stored) <= 0.0)? as u64;
                let problem = "a normal force that is not above 0".to_owned();
                let sample = Some(first + n);
                let fault = self.fault(stream, part, channels[row], sample, problem, "a load above 0 N");
                let value = rows.of(row, first + n..rows.end()).next();
                Some(fault.with(value.map(|value| value.to_string())))
            };
            if let Some(fault) = places[1].and_then(unloaded) {
                return Err(fault.into());
            }
            tried.iter_mut().for_each(|forces| forces.extend(part, first, rows, is_last));
            Ok(())
        })?;
        let most = tried.iter().map(|forces| forces.drops.len()).max().unwrap_or_default() as f64;
        let chosen = tried.iter().rposition(|forces| forces.drops.len() as f64 >= SHARE_OF_DROPS * most);
        let chosen = chosen.expect("that with the most is one");
        Ok((chosen, tried.swap_remove(chosen)))
    }

    /// The loads of all records.
    fn loads(
        &self,
        stream: usize,
        forces: &Forces<'_>,
        timeline: &Timeline,
    ) -> Result<Vec<Loads>, RecordingError> {
        let request =
            |(n, (time_s, side)): (usize, (f64, Side))| (forces.near(time_s, side), n, time_s, side);
        let mut requests: Vec<(Request, usize, f64, Side)> =
            timeline.wanted().enumerate().map(request).collect();
        requests.sort_by_key(|(request, n, ..)| (request.part, request.samples.start, *n));
        let mut ranges = Ranges::new(self, stream, self.force_channels(stream).0);
        let mut loads = Vec::with_capacity(requests.len());
        for (request, n, time_s, side) in requests {
            let rows = ranges.rows(request.part, &request.samples)?;
            loads.push((n, forces.loads(time_s, side, &request, &rows)));
        }
        loads.sort_unstable_by_key(|(n, _)| *n);
        Ok(loads.into_iter().map(|(_, loads)| loads).collect())
    }
}
