//! A recording that is read: noise first, then steps, then the loads at their times.

use asperity_record::{
    LoadDrop, MOST_STEPS, RECORD_SCHEMA_VERSION, Row, RunHeader, Scales, Sensors, StepRecord, TimeGrid,
};

use crate::arrival;
use crate::description::{Channel, Description, Positive, Role, Stream};
use crate::error::{InputFault, Place, RecordingError};
use crate::force::{Forces, Request, Rows, Side};
use crate::input::{Folder, Input};
use crate::noise::ByNoise;
use crate::pick::{Finder, Search};
use crate::resample::Resampled;
use crate::samples::{Block, Column, Samples};
use crate::steps::{SensorStep, Timeline};
use crate::survey::{BLOCK, Part, Surveyed, survey};
use crate::window::Scatter;

/// Steps of the log per sample of the fastest stream.
const STEPS_PER_SAMPLE: f64 = 64.0;

/// Samples of a window where none is given, and the fewest.
const WINDOW: u64 = 32;
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
    /// The noise of each part and channel: rows of [`Noise`](asperity_record::Noise) and
    /// [`LoadNoise`](asperity_record::LoadNoise).
    pub noise: Vec<Row>,
    /// What lessens the result.
    pub warnings: Vec<InputFault>,
    /// Load drops, in order.
    pub drops: Vec<LoadDrop>,
    /// Step records, in order.
    pub records: Vec<StepRecord>,
}

impl Recording {
    /// Finds the files and parts of a recording.
    ///
    /// # Errors
    /// If a file cannot be read, or what it says is not accepted.
    pub fn open(mut description: Description) -> Result<Recording, RecordingError> {
        let folder = Folder::of(&description.file);
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

    /// First and last time of a stream, s.
    fn span(&self, stream: usize) -> [f64; 2] {
        let parts = &self.streams[stream].parts;
        let first_s = parts.iter().map(Part::first_s).fold(f64::INFINITY, f64::min);
        [first_s, parts.iter().map(Part::last_s).fold(first_s, f64::max)]
    }

    fn spans(&self) -> impl Iterator<Item = [f64; 2]> {
        (0..self.streams.len()).map(|stream| self.span(stream))
    }

    /// Length and hash of every file.
    ///
    /// # Errors
    /// If one cannot be read.
    pub fn inputs(&self) -> Result<Vec<Input>, RecordingError> {
        let of_streams = self.streams.iter().flat_map(|stream| &stream.files);
        let starts = self.description.streams.iter().filter_map(|stream| stream.starts.as_ref());
        let mut named: Vec<&String> = of_streams.chain(starts.map(|starts| &starts.file)).collect();
        named.sort();
        named.dedup();
        named.into_iter().map(|named| self.folder.input(named)).collect()
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
    pub fn header(&self, inputs: &[Input]) -> RunHeader {
        let Description { text, name, slider, detection, .. } = &self.description;
        let x_m = self.description.positions_m();
        let ends_m = [0.0].into_iter().chain(x_m.iter().copied()).chain([slider.length_m.0]);
        let places_m: Vec<f64> = ends_m.collect();
        let largest_gap_m = places_m.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
        let mut hasher = blake3::Hasher::new();
        hasher.update(text.as_bytes());
        for input in inputs {
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
            radiates: false,
            has_state: false,
            time_step_s: time_grid.step_s(),
            longest_stable_step_s: None,
            steps: self.last_step(),
            // Arrivals are linked over the largest gap.
            scales: Scales {
                block_length_m: largest_gap_m,
                block_time_s: largest_gap_m / slider.wave_speed_m_per_s(),
                link_time_ratio: detection.link_time_ratio(),
                modulus_n_per_m: slider.youngs_modulus_pa.0 * slider.width_m.0,
                interfacial_stiffness_n_per_m: 0.0,
            },
            sensors: Some(Sensors {
                length_m: slider.length_m.0,
                x_m,
                are_of_slip: self.description.contact_role() == Some(Role::Slip),
                threshold: detection.threshold(),
                least_step: detection.least_step.map_or(0.0, |step| step.0),
            }),
        }
    }

    fn last_step(&self) -> u64 {
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

    /// Passes the samples of some channels to `visit`, block by block, with the part and whether it is its last block.
    pub(crate) fn pass(
        &self,
        stream: usize,
        channels: &[&Channel],
        visit: &mut dyn FnMut(usize, &Block, bool) -> Result<(), RecordingError>,
    ) -> Result<(), RecordingError> {
        let (of, surveyed) = (&self.description.streams[stream], &self.streams[stream]);
        let mut block = vec![Vec::new(); channels.len()];
        let mut open: Option<(usize, Box<dyn Samples>)> = None;
        for (part, Part { file, samples, .. }) in surveyed.parts.iter().enumerate() {
            if open.as_ref().is_none_or(|(opened, _)| opened != file) {
                open = Some((*file, self.samples(of, surveyed, *file, channels)?));
            }
            let (_, source) = open.as_mut().expect("it was opened");
            let mut left = *samples;
            while left > 0 {
                let count = source.next(BLOCK.min(left as usize), &mut block)? as u64;
                if count == 0 {
                    let problem = format!("{left} samples fewer than before");
                    let accepted = "a file that does not change while it is read";
                    return Err(self.fault(stream, part, channels[0], None, problem, accepted).into());
                }
                left -= count;
                visit(part, &block, left == 0)?;
            }
        }
        Ok(())
    }

    fn samples(
        &self,
        stream: &Stream,
        surveyed: &Surveyed,
        file: usize,
        channels: &[&Channel],
    ) -> Result<Box<dyn Samples>, RecordingError> {
        let columns = channels.iter().map(|channel| channel.column.clone());
        match &stream.time {
            Some(time) if stream.resample.is_some() => {
                let columns: Vec<Column> = [time.column.clone()].into_iter().chain(columns).collect();
                let samples = self.folder.open(stream, &surveyed.files[file], &columns)?;
                let unit_s = time.unit_of(samples.as_ref()).map_or(1.0, |unit| unit.scale);
                Ok(Box::new(Resampled::new(samples, channels.len(), surveyed.interval_s / unit_s)))
            }
            _ => self.folder.open(stream, &surveyed.files[file], &columns.collect::<Vec<_>>()),
        }
    }

    /// Finds steps, load drops and loads.
    ///
    /// # Errors
    /// If a file cannot be read, or holds something other than finite numbers.
    pub fn detect(&self) -> Result<Detected, RecordingError> {
        let time_grid = self.time_grid();
        let mut found =
            Detected { noise: Vec::new(), warnings: Vec::new(), drops: Vec::new(), records: Vec::new() };
        let mut steps = Vec::new();
        if let (Some(stream), Some(role)) = (self.description.contacts, self.description.contact_role()) {
            steps = self.steps(stream, role, &mut found)?;
        }
        let sample_s = self.description.sample_s.unwrap_or(self.last_s() / SAMPLED);
        let are_slips = self.description.contact_role() == Some(Role::Slip);
        let timeline = Timeline::of(steps, are_slips, time_grid, self.last_step(), sample_s);
        let forces = match self.description.forces {
            Some(stream) => Some((stream, self.forces(stream, &mut found)?)),
            None => None,
        };
        let loads = match &forces {
            Some((stream, forces)) => {
                let wanted: Vec<(f64, Side)> = timeline.wanted().collect();
                let requests = wanted.iter().map(|(time_s, side)| forces.near(*time_s, *side)).collect();
                let mut loads = vec![None; wanted.len()];
                self.gather(*stream, requests, &mut |n, request, rows| {
                    let (time_s, side) = wanted[n];
                    loads[n] = Some(forces.loads(time_s, side, request, rows));
                })?;
                loads.into_iter().flatten().collect()
            }
            None => Vec::new(),
        };
        found.records =
            timeline.records(&loads, self.description.slider.normal_force_n.map_or(1.0, |load| load.0));
        found.noise.sort_by_key(|noise| noise.step);
        Ok(found)
    }

    /// The steps of all sensors of the array that makes the contacts.
    fn steps(
        &self,
        stream: usize,
        role: Role,
        found: &mut Detected,
    ) -> Result<Vec<SensorStep>, RecordingError> {
        let (surveyed, detection) = (&self.streams[stream], &self.description.detection);
        let channels: Vec<&Channel> = self.description.streams[stream].sensors.iter().collect();
        let width = detection.window_s.map_or(WINDOW, |window_s| width(window_s, surveyed));
        let noise = self.noise(stream, &channels, width, true)?;
        let search = |part: usize, n: usize| {
            let (channel, scatter) = (channels[n], noise.parts[part][n].scatter);
            let least = least(
                detection.threshold(),
                &scatter,
                detection.least_step.map_or(0.0, |step| step.0) / channel.factor.0.abs(),
            );
            let sign = role.sign() * channel.factor.0.signum();
            Search { width, scatter, least, sign, is_force: false }
        };
        let fresh = |part: usize| -> Vec<Finder> {
            (0..channels.len()).map(|n| Finder::new(search(part, n))).collect()
        };
        let mut finders = fresh(0);
        let mut steps = Vec::new();
        self.pass(stream, &channels, &mut |part, block, is_last| {
            let of = &surveyed.parts[part];
            for (n, (finder, row)) in finders.iter_mut().zip(block).enumerate() {
                let (search, scale) = (search(part, n), channels[n].scale);
                finder.extend(row, is_last, &mut |window, ramp| {
                    if noise.parts[part][n].touches_clips(window, &ramp) {
                        return;
                    }
                    let noise = search.scatter.sigma * (width as f64 / 2.0).sqrt();
                    steps.push(SensorStep {
                        sensor: n as u32 + 1,
                        arrival_s: of.time_s(arrival::arrival(window, &ramp, width, role)),
                        stop_s: of.time_s(ramp.end),
                        error_s: arrival::error(&ramp, noise, role) * surveyed.interval_s,
                        size: ramp.size * scale,
                        size_error: search.scatter.sigma * scale.abs(),
                    });
                });
            }
            if is_last && part + 1 < surveyed.parts.len() {
                finders = fresh(part + 1);
            }
            Ok(())
        })?;
        found.noise.extend(noise.rows);
        found.warnings.extend(noise.warnings);
        steps.sort_by(|a, b| a.arrival_s.total_cmp(&b.arrival_s).then(a.sensor.cmp(&b.sensor)));
        Ok(steps)
    }

    /// The forces, with their load drops among what is found.
    fn forces(&self, stream: usize, found: &mut Detected) -> Result<Forces<'_>, RecordingError> {
        let (surveyed, detection) = (&self.streams[stream], &self.description.detection);
        let shortest = surveyed.parts.iter().map(|part| part.samples).min().unwrap_or_default();
        let widths: Vec<u64> = match detection.force_window_s {
            Some(window_s) => vec![width(window_s, surveyed)],
            None => {
                let fits = |width: &u64| *width == LEAST_WINDOW || shortest >= SHORTEST_PART * width;
                FORCE_WINDOWS.into_iter().filter(fits).collect()
            }
        };
        let mut tried = Vec::new();
        for width in widths {
            let (forces, noise) = self.forces_by(stream, width)?;
            let drops = self.drops(stream, &forces)?;
            tried.push((forces, noise, drops));
        }
        let most = tried.iter().map(|(.., drops)| drops.len()).max().unwrap_or_default() as f64;
        let chosen = tried.iter().rposition(|(.., drops)| drops.len() as f64 >= SHARE_OF_DROPS * most);
        let (forces, noise, drops) = tried.swap_remove(chosen.expect("that with the most is one"));
        found.noise.extend(noise.rows);
        found.warnings.extend(noise.warnings);
        found.drops = drops;
        Ok(forces)
    }

    /// Channels of `F_T`, and of `F_N` and the load point if they are recorded, with their places among those.
    fn force_channels(&self, stream: usize) -> (Vec<&Channel>, [Option<usize>; 3]) {
        let mut channels = Vec::new();
        let places = [Role::TangentialForce, Role::NormalForce, Role::LoadPoint].map(|role| {
            let channel = self.description.streams[stream].with(role)?;
            channels.push(channel);
            Some(channels.len() - 1)
        });
        (channels, places)
    }

    /// The ramps of `F_T` by windows of so many samples.
    fn forces_by(&self, stream: usize, width: u64) -> Result<(Forces<'_>, ByNoise), RecordingError> {
        let (surveyed, detection) = (&self.streams[stream], &self.description.detection);
        let (channels, rows) = self.force_channels(stream);
        let noise = self.noise(stream, &channels[..1], width, false)?;
        let scale = channels[0].scale;
        let searches: Vec<Search> = noise
            .parts
            .iter()
            .map(|channels| {
                let scatter = channels[0].scatter;
                let least = least(
                    detection.threshold(),
                    &scatter,
                    detection.least_drop_n.map_or(0.0, |drop| drop.0) / scale.abs(),
                );
                Search { width, scatter, least, sign: -scale.signum(), is_force: true }
            })
            .collect();
        let mut ramps = vec![Vec::new(); surveyed.parts.len()];
        let mut finder = Finder::new(searches[0]);
        let mut at = 0;
        self.pass(stream, &channels, &mut |part, block, is_last| {
            let unloaded = |row: usize| {
                let n = block[row].iter().position(|stored| channels[row].si(*stored) <= 0.0)?;
                let problem = "a normal force that is not above 0".to_owned();
                let fault =
                    self.fault(stream, part, channels[row], Some(at + n as u64), problem, "a load above 0 N");
                Some(fault.with(Some(block[row][n].to_string())))
            };
            if let Some(fault) = rows[1].and_then(unloaded) {
                return Err(fault.into());
            }
            finder.extend(&block[0], is_last, &mut |window, ramp| {
                if !noise.parts[part][0].touches_clips(window, &ramp) {
                    ramps[part].push(ramp);
                }
            });
            at += block[0].len() as u64;
            if is_last {
                at = 0;
                finder = Finder::new(searches[(part + 1).min(searches.len() - 1)]);
            }
            Ok(())
        })?;
        let normal_force_n = self.description.slider.normal_force_n.map(|load| load.0);
        Ok((Forces { parts: &surveyed.parts, ramps, searches, channels, rows, normal_force_n }, noise))
    }

    fn drops(&self, stream: usize, forces: &Forces<'_>) -> Result<Vec<LoadDrop>, RecordingError> {
        let all = forces.ramps.iter().enumerate();
        let ramps: Vec<(usize, usize)> =
            all.flat_map(|(part, of)| (0..of.len()).map(move |n| (part, n))).collect();
        let mut found: Vec<Option<LoadDrop>> = vec![None; ramps.len()];
        self.gather(stream, forces.requests(), &mut |n, _, rows| {
            let (part, ramp) = ramps[n];
            found[n] = forces.drop(part, ramp, rows);
        })?;
        let mut drops: Vec<LoadDrop> = found.into_iter().flatten().collect();
        for n in 0..drops.len() {
            drops[n].drop = n as u64;
            if let Some(before) = n.checked_sub(1).filter(|before| drops[*before].part == drops[n].part) {
                drops[n].recurrence_s = Some(drops[n].onset_s - drops[before].onset_s);
            }
        }
        Ok(drops)
    }

    /// Reads the forces once, and passes the samples of each request to `visit`, with its number.
    fn gather(
        &self,
        stream: usize,
        requests: Vec<Request>,
        visit: &mut dyn FnMut(usize, &Request, &Rows<'_>),
    ) -> Result<(), RecordingError> {
        let (channels, _) = self.force_channels(stream);
        let mut order: Vec<usize> = (0..requests.len()).collect();
        order.sort_by_key(|n| (requests[*n].part, requests[*n].samples.end));
        // The first sample that a request or one behind it needs.
        let mut needed = vec![u64::MAX; order.len() + 1];
        for (at, n) in order.iter().enumerate().rev() {
            let is_of_next = order.get(at + 1).is_some_and(|next| requests[*next].part == requests[*n].part);
            needed[at] = requests[*n].samples.start.min(if is_of_next { needed[at + 1] } else { u64::MAX });
        }
        let (mut kept, mut first, mut at) = (vec![Vec::new(); channels.len()], 0_u64, 0);
        self.pass(stream, &channels, &mut |part, block, is_last| {
            kept.iter_mut().zip(block).for_each(|(kept, row)| kept.extend_from_slice(row));
            let end = first + kept[0].len() as u64;
            while let Some(n) =
                order.get(at).filter(|n| requests[**n].part == part && requests[**n].samples.end <= end)
            {
                visit(*n, &requests[*n], &Rows { first, rows: &kept });
                at += 1;
            }
            let is_of_part = order.get(at).is_some_and(|n| requests[*n].part == part);
            let from = if is_of_part { needed[at].clamp(first, end) } else { end };
            kept.iter_mut().for_each(|row| drop(row.drain(..(from - first) as usize)));
            first = if is_last { 0 } else { from };
            if is_last {
                kept.iter_mut().for_each(Vec::clear);
            }
            Ok(())
        })
    }
}
