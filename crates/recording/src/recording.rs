//! A recording that is read: noise first, then steps, then the loads at their times.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use asperity_record::{
    LoadDrop, MOST_STEPS, RECORD_SCHEMA_VERSION, Recorded, Row, RunHeader, Scales, Sensors, StepRecord,
    TimeGrid,
};

use crate::description::{Channel, Description, Positive, Role, Stream};
use crate::error::{InputFault, Result};
use crate::estimates::{MOST_MEANS, Means};
use crate::force::{BEHIND, Forces, Loads};
use crate::input::{Folder, Given, Input};
use crate::noise::{Heard, OfPart};
use crate::pass::{Progress, Ranges, Watch};
use crate::pick::{Finders, Search};
use crate::signals::Signals;
use crate::steps::Timeline;
use crate::survey::{Surveyed, survey};

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

/// A recording whose streams and parts are known.
#[derive(Debug)]
pub struct Recording {
    /// Its description.
    pub description: Description,
    pub(crate) folder: Folder,
    pub(crate) streams: Vec<Surveyed>,
}

/// Rows and warnings of channels.
pub(crate) type Told = (Vec<Row>, Vec<InputFault>);

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
    pub(crate) inputs: BTreeMap<String, Input>,
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
    pub fn open(description: Description) -> Result<Recording> {
        Recording::of_given(description, Given::new())
    }

    /// Finds the files and parts of a recording, some of whose files are in memory.
    ///
    /// # Errors
    /// As [`Recording::open`].
    pub fn of_given(mut description: Description, given: Given) -> Result<Recording> {
        let folder = Folder::of(&description.file, given);
        let surveyed = description.streams.iter_mut().map(|stream| survey(&folder, stream));
        let streams = surveyed.collect::<Result<Vec<Surveyed>>>()?;
        let recording = Recording { description, folder, streams };
        let (step_s, last_s) = (recording.step_s(), recording.last_s());
        let Description { file, streams, sample_s, contacts, forces, .. } = &recording.description;
        let first_s = (0..streams.len()).map(|n| recording.span(n)[0]).fold(f64::INFINITY, f64::min);
        let overlap = streams.iter().enumerate().find_map(|(n, stream)| {
            let mut pairs = recording.streams[n].parts.windows(2);
            let pair = pairs.find(|pair| pair[1].first_s() <= pair[0].last_s())?;
            let [one, other] = [pair[0].number, pair[1].number];
            Some(format!("{}: parts {one} and {other} at the same time", stream.name()))
        });
        let apart = contacts.zip(*forces).and_then(|(contacts, forces)| {
            let [[a, b], [c, d]] = [contacts, forces].map(|stream| recording.span(stream));
            (b < c || d < a).then(|| format!("streams at {a} to {b} s and at {c} to {d} s"))
        });
        let is_far = !step_s.is_normal() || last_s / step_s > MOST_STEPS as f64;
        let many = sample_s.filter(|sample_s| last_s / sample_s > MOST_SAMPLED);
        let unfit = [
            ((first_s < 0.0).then(|| format!("it begins at {first_s} s")), "from 0 s on; see offset_s"),
            (is_far.then(|| format!("{last_s} s in steps of {step_s} s")), "2^53 steps"),
            (overlap, "parts of a stream one after the other"),
            (many.map(|s| format!("sample_s = {s}")), "an interval of which the recording has a million"),
            (apart, "streams that overlap"),
        ];
        if let Some((problem, accepted)) = unfit.into_iter().find_map(|(problem, of)| Some((problem?, of))) {
            return Err(InputFault::new(file, "", problem, accepted).into());
        }
        Ok(recording)
    }

    /// First and last time of a stream, s.
    fn span(&self, stream: usize) -> [f64; 2] {
        let parts = &self.streams[stream].parts;
        [parts[0].first_s(), parts[parts.len() - 1].last_s()]
    }

    /// Lines about the streams, for people.
    pub fn in_words(&self) -> Vec<String> {
        let line = |(stream, surveyed): (&Stream, &Surveyed)| {
            format!(
                "{}: {} of {} samples at {} Hz, {} and {}",
                stream.name(),
                asperity_record::counted(surveyed.parts.len() as u64, "part"),
                surveyed.samples(),
                asperity_record::short(1.0 / surveyed.interval_s),
                asperity_record::counted(stream.sensors.len() as u64, "sensor"),
                asperity_record::counted(stream.channel.len() as u64, "channel"),
            )
        };
        self.description.streams.iter().zip(&self.streams).map(line).collect()
    }

    /// What the log has beside its records; of what was found it takes the load drops.
    pub fn recorded(&self, found: &mut Detected) -> Recorded {
        let Description { text, name, slider, detection, .. } = &self.description;
        let inputs = &found.inputs;
        let x_m = self.description.positions_m();
        let mut hasher = blake3::Hasher::new();
        hasher.update(text.as_bytes());
        for (_, hash) in inputs.values() {
            hasher.update(hash.as_bytes());
        }
        let header = RunHeader {
            record_schema_version: RECORD_SCHEMA_VERSION,
            scenario: name.clone(),
            scenario_hash: hasher.finalize().to_hex().to_string(),
            parameter_set: "measured".to_owned(),
            solver: "none".to_owned(),
            blocks: x_m.len().max(1) as u32,
            rows: 1,
            time_step_s: self.time_grid().step_s(),
            steps: self.last_step(),
            scales: self.scales(),
            sensors: Some(Sensors {
                length_m: slider.length_m.0,
                x_m,
                are_of_slip: self.description.contact_role() == Some(Role::Slip),
                threshold: detection.threshold.0,
                least_step: detection.least_step.0,
            }),
            ..RunHeader::default()
        };
        let words =
            |(path, (bytes, hash)): (&String, &_)| (path.clone(), format!("{bytes} bytes, BLAKE3 {hash}"));
        let inputs = inputs.iter().map(words).collect();
        Recorded { header, toml: text.clone(), inputs, drops: std::mem::take(&mut found.drops) }
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
            link_time_ratio: detection.link_time_ratio.0,
            modulus_n_per_m: slider.youngs_modulus_pa.0 * slider.width_m.0,
            interfacial_stiffness_n_per_m: 0.0,
        }
    }

    pub(crate) fn last_step(&self) -> u64 {
        self.time_grid().nearest_step(self.last_s())
    }

    fn last_s(&self) -> f64 {
        (0..self.streams.len()).map(|n| self.span(n)[1]).fold(0.0, f64::max)
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

    /// As [`Recording::detect`], and computes length and hash of every file.
    ///
    /// # Errors
    /// As that.
    pub fn read(&self, watch: &Watch<'_>) -> Result<Detected> {
        let starts = self.description.streams.iter().filter_map(|stream| Some(&stream.starts.as_ref()?.file));
        let files = self.streams.iter().flat_map(|stream| &stream.files).chain(starts);
        let hashed = files.map(|named| (named.clone(), Arc::default())).collect();
        let hashed = self.folder.hashed.get_or_init(|| hashed);
        let found = self.detect(watch)?;
        let input = |named: &String| Ok((named.clone(), self.folder.input(named, &|| watch(1, 1))?));
        let inputs = hashed.keys().map(input).collect::<Result<_>>()?;
        Ok(Detected { inputs, ..found })
    }

    /// Finds steps, load drops and loads. `watch` is told how many samples were read, of how many in all passes, and says
    /// whether to stop.
    ///
    /// # Errors
    /// If a file cannot be read, or holds something other than finite numbers, or it is stopped.
    pub fn detect(&self, watch: &Watch<'_>) -> Result<Detected> {
        let Description { contacts, forces, detection, .. } = &self.description;
        let is = |stream: &Option<usize>, n| u64::from(*stream == Some(n));
        let passes = |n| 1 + is(contacts, n).max(is(forces, n)) + is(forces, n);
        let of = self.streams.iter().enumerate().map(|(n, of)| passes(n) * of.samples()).sum();
        let progress = Progress { watch, done: AtomicU64::new(0), of };
        let window = match (detection.window_s, contacts) {
            (Some(window_s), Some(stream)) => width(window_s, &self.streams[*stream]),
            _ => WINDOW,
        };
        let role = self.description.contact_role();
        let (mut told, mut signals) = (Told::default(), Vec::new());
        let (mut steps, mut of_forces, mut means) = (Vec::new(), None, Vec::new());
        for (stream, of) in self.description.streams.iter().enumerate() {
            let role = role.filter(|_| *contacts == Some(stream));
            let widths = of.channels().enumerate().map(|(n, channel)| match channel.role {
                _ if n < of.sensors.len() => Vec::from_iter(role.map(|_| window)),
                Role::TangentialForce => self.force_widths(stream),
                _ => Vec::new(),
            });
            let (noise_of, heard) = self.listen(stream, &widths.collect::<Vec<_>>(), role, &progress)?;
            if let Some(role) = role {
                let all = (0..noise_of.len()).flat_map(|part| (0..of.sensors.len()).map(move |n| (part, n)));
                let noise = all.map(|(part, n)| (part, n, noise_of[part][n][0]));
                self.report(stream, &noise.collect::<Vec<_>>(), &mut told);
                self.warn(stream, role, window, &heard, &mut told.1);
                steps = heard.steps;
            }
            signals.push(heard.signals);
            if let Some(n) = of.channel.iter().position(|channel| channel.role == Role::TangentialForce) {
                let n = of.sensors.len() + n;
                let noise: Vec<&[OfPart]> = noise_of.iter().map(|of| &of[n][..]).collect();
                let (forces, means_of) = self.forces(stream, &noise, &progress)?;
                let noise = forces.searches.iter().enumerate().map(|(part, of)| (part, n, of.noise));
                self.report(stream, &noise.collect::<Vec<_>>(), &mut told);
                (of_forces, means) = (Some((stream, forces)), means_of);
            }
        }
        let (mut rows, warnings) = told;
        rows.sort_by_key(|noise| noise.step);
        let (are_slips, grid, last) = (role == Some(Role::Slip), self.time_grid(), self.last_step());
        let sample_s = self.description.sample_s.unwrap_or(self.last_s() / SAMPLED);
        let (timeline, inputs) = (Timeline::of(steps, are_slips, grid, last, sample_s), BTreeMap::new());
        let (mut drops, mut loads, normal_load_n) = (Vec::new(), Vec::new(), self.normal_load_n());
        if let Some((stream, mut forces)) = of_forces {
            drops = std::mem::take(&mut forces.drops);
            loads = self.loads(stream, &forces, &timeline)?;
        }
        let mut found =
            Detected { rows, warnings, inputs, drops, timeline, loads, signals, window, normal_load_n };
        let told = self.estimates(&found, &means)?;
        found.rows.extend(told);
        Ok(found)
    }

    /// Warns of what makes steps of an array doubtful, and how many had the other sign.
    fn warn(&self, stream: usize, role: Role, window: u64, heard: &Heard, warnings: &mut Vec<InputFault>) {
        /// Steps of both neighbours without which one may be dead.
        const MANY: u64 = 20;
        let (sensors, scales) = (&self.description.streams[stream].sensors, self.scales());
        let interval_s = self.streams[stream].interval_s;
        let (window_s, link_s, wave_s) = (window as f64 * interval_s, scales.link_s(), scales.block_time_s);
        let mut counts = vec![0; sensors.len()];
        heard.steps.iter().for_each(|step| counts[step.sensor as usize - 1] += 1);
        let mut warn = |n: usize, problem: String, accepted: &'static str| {
            warnings.push(self.fault(stream, 0, &sensors[n], None, problem, accepted));
        };
        for (n, of) in counts.windows(3).enumerate() {
            if of[1] == 0 && of[0].min(of[2]) >= MANY {
                let problem = format!("no step, where the sensors beside it have {} and {}", of[0], of[2]);
                warn(n + 1, problem, "a sensor that works; else name it in dead");
            }
        }
        let (all, others) = (heard.steps.len() as u64, heard.others);
        if matches!(role, Role::ShearForce | Role::ShearStrain) && all > 0 && others >= all {
            let problem = format!("{others} steps of the other sign, beside {all} that fall");
            warn(0, problem, "extents by slip or area, not by shear");
        }
        if window_s > link_s {
            let problem = format!("a window of {window_s:.3e} s, where {link_s:.3e} s part ruptures");
            warn(0, problem, "a shorter window, or a larger link_time_ratio");
        }
        if interval_s > wave_s {
            let problem = format!(
                "an interval of {interval_s:.3e} s; a wave takes {wave_s:.3e} s over the largest gap"
            );
            warn(0, problem, "faster sampling, for speeds of fronts");
        }
    }

    /// Channels of `F_T`, and of `F_N`, the load point and the slip of the pushed end if they are recorded, with their
    /// places among those.
    fn force_channels(&self, stream: usize) -> (Vec<&Channel>, [Option<usize>; 4]) {
        let mut channels = Vec::new();
        let roles = [Role::TangentialForce, Role::NormalForce, Role::LoadPoint, Role::Slip];
        let places = roles.map(|role| {
            let is_it = |of: &&Channel| of.role == role && (role != Role::Slip || of.x_m == Some(0.0));
            channels.push(self.description.streams[stream].channel.iter().find(is_it)?);
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

    /// The forces by the best of the windows, with their load drops, and their means, given the noise of `F_T` by part.
    fn forces(
        &self,
        stream: usize,
        noise: &[&[OfPart]],
        progress: &Progress<'_>,
    ) -> Result<(Forces<'_>, Vec<Means>)> {
        let (parts, detection) = (&self.streams[stream].parts, &self.description.detection);
        let (channels, places) = self.force_channels(stream);
        let (scale, normal_force_n) = (channels[0].scale, self.description.slider.normal_force_n);
        let normal_force_n = normal_force_n.map(|load| load.0);
        let (given, pieces) = (detection.least_drop_n.0 / scale.abs(), self.pieces(stream, u64::MAX));
        let by_width = |which: usize| {
            let search =
                |of: &&[OfPart]| of[which].search(detection.threshold.0, given, -scale.signum(), true);
            let searches: Vec<Search> = noise.iter().map(search).collect();
            Forces {
                parts,
                ramps: vec![Vec::new(); parts.len()],
                finder: Finders::new(&searches[..1], &pieces[0]),
                searches,
                channels: channels.clone(),
                places,
                normal_force_n,
                drops: Vec::new(),
                judged: 0,
            }
        };
        let mut tried: Vec<Forces<'_>> = (0..noise[0].len()).map(by_width).collect();
        let longest = tried.iter().map(|forces| forces.searches[0].noise.width).max().unwrap_or_default();
        let each = self.streams[stream].samples().div_ceil(MOST_MEANS).max(1);
        let (mut means, mut count) = (Vec::<Means>::new(), 0_u64);
        let before = BEHIND * longest;
        self.pass(stream, &channels, before, &pieces, progress, &mut |piece, first, rows, is_last| {
            let part = piece.part;
            for sample in first..rows.end() {
                let stored = rows.block.sample((sample - rows.first) as usize);
                let of = places.map(|place| Some(channels[place?].si(stored[place?])));
                if of[1].is_some_and(|normal_n| normal_n <= 0.0) {
                    let problem = "a normal force that is not above 0".to_owned();
                    let (at, accepted) = (Some((sample, stored[1])), "a load above 0 N");
                    return Err(self.fault(stream, part, channels[1], at, problem, accepted).into());
                }
                let [force, normal, point, end] =
                    [of[0], of[1].or(normal_force_n), of[2], of[3]].map(|of| of.unwrap_or(f64::NAN));
                let values = [parts[part].time_s(sample as f64), force, force / normal, point, point - end];
                means.extend(count.is_multiple_of(each).then_some([0.0; 5]));
                let mean = means.iter_mut().next_back().into_iter().flatten();
                mean.zip(values).for_each(|(mean, of)| *mean += of / each as f64);
                count += 1;
            }
            tried.iter_mut().for_each(|forces| forces.extend(piece, first, rows, is_last));
            Ok(false)
        })?;
        let most = tried.iter().map(|forces| forces.drops.len()).max().unwrap_or_default() as f64;
        let chosen = tried.iter().rposition(|forces| forces.drops.len() as f64 >= SHARE_OF_DROPS * most);
        means.truncate((count / each) as usize);
        Ok((tried.swap_remove(chosen.expect("that with the most is one")), means))
    }

    /// The loads of all records.
    fn loads(&self, stream: usize, forces: &Forces<'_>, timeline: &Timeline) -> Result<Vec<Loads>> {
        let free: Vec<Vec<Range<u64>>> = (0..forces.parts.len()).map(|part| forces.free(part)).collect();
        let near = |(_, time_s, side)| (forces.near(time_s, side, &free), time_s, side);
        let mut wanted: Vec<_> = timeline.all().map(near).enumerate().collect();
        wanted.sort_by_key(|(n, ((part, samples), ..))| (*part, samples.start, *n));
        let mut ranges = Ranges::new(self, stream, forces.channels.clone());
        let mut loads = vec![Loads::default(); wanted.len()];
        for (n, (near, time_s, side)) in wanted {
            loads[n] = forces.loads(time_s, side, &near, &ranges.rows(near.0, &near.1)?);
        }
        Ok(loads)
    }
}
