//! A simulated run as the instruments of a description would have recorded it.
//!
//! A sensor stands on the contact nearest to it. Slip is its displacement, local shear the tangential force on it without
//! friction; real contact is 1, and 0.88 while it slides, of a contact with junctions in proportion to those that slip.
//! Noise is white and Gaussian. Streams in segments are triggered by ruptures.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use asperity_files::{FileError, FileSet};
use asperity_model::{Draws, Plan, RecordingPlan, Scenario, WindowPlan, mixed};
use asperity_record::{Direction, Observer, Record, Rupture, WindowRecord};
use toml::{Table, Value};

use crate::description::{Channel, Description, Role};
use crate::error::{InputFault, Place, RecordingError};
use crate::input::Folder;
use crate::recording::WINDOW;
use crate::survey::survey;

/// Share of its real contact that a contact loses when it detaches.
const LOST_AREA: f64 = 0.12;

/// Windows of samples that a segment begins before a rupture, and ends behind it.
const MARGIN_WINDOWS: f64 = 16.0;

/// Standard deviations of the noise of a sample by role, in SI units, of real contact over that of a stuck contact.
pub const NOISE: [(Role, f64); 6] = [
    (Role::TangentialForce, 0.03),
    (Role::NormalForce, 0.03),
    (Role::LoadPoint, 1e-8),
    (Role::Slip, 3e-9),
    (Role::ContactArea, 0.01),
    (Role::ShearForce, 0.03),
];

/// Writes the files of a run as instruments record it, while its steps are taken once more.
#[derive(Debug)]
pub struct Sampler<'a> {
    scenario: &'a Scenario,
    plan: Plan,
    streams: Vec<Stream>,
    windows: Vec<Window>,
    noise: Vec<(Role, f64)>,
    seed: u32,
    /// The share of each contact that slips.
    slipping: Vec<f64>,
    /// Both forces of the last step record.
    forces_n: [f64; 2],
    hold_step: u64,
    files: &'a FileSet,
    folder: PathBuf,
    problem: Option<FileError>,
}

#[derive(Debug)]
struct Stream {
    channels: Vec<Channel>,
    every_steps: u64,
    in_segments: bool,
    /// Samples so far.
    count: u64,
}

/// A segment of a stream, or all of it.
#[derive(Debug)]
struct Window {
    stream: usize,
    segment: usize,
    steps: WindowPlan,
    /// What was sampled, as the file has it.
    bytes: Vec<u8>,
}

/// The file of a stream.
fn file(stream: usize, segment: Option<&dyn Display>) -> String {
    let segment = segment.map(|segment| format!("-{segment}")).unwrap_or_default();
    format!("stream-{}{segment}.npy", stream + 1)
}

/// The heading of an array of doubles, format 1.0 of NumPy's NPY.
fn heading(samples: u64, channels: usize) -> Vec<u8> {
    let shape = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': ({samples}, {channels}), }}");
    // A multiple of 64 bytes with the ten before it.
    let length = (shape.len() + 11).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{shape:<width$}\n", width = length - 1).bytes());
    bytes
}

impl<'a> Sampler<'a> {
    /// A sampler of a run with those ruptures by the instruments of a description, with noise as in [`NOISE`], of which
    /// the first of a role counts, from a seed. The files go into a folder.
    ///
    /// # Errors
    /// If no run has what a channel measures where it is, a stream in segments has none, or the file of one with a column
    /// of times cannot be read.
    pub fn new(
        like: &mut Description,
        (scenario, ruptures): (&'a Scenario, &[Rupture]),
        (noise, seed): (Vec<(Role, f64)>, u32),
        (files, folder): (&'a FileSet, &Path),
    ) -> Result<Sampler<'a>, RecordingError> {
        let (plan, file) = (Plan::new(scenario), like.file.clone());
        let refused = |problem: String, accepted| -> RecordingError {
            InputFault::new(&file, Place::File, problem, accepted).into()
        };
        if plan.elastic.layout().is_area() {
            return Err(refused("contacts over an area".to_owned(), "a run with contacts in a single row"));
        }
        let mut streams = Vec::new();
        for stream in &mut like.streams {
            let interval_s = match stream.rate_hz {
                Some(rate) => 1.0 / rate.0,
                None => survey(&Folder::of(&file), stream)?.interval_s,
            };
            let mut channels: Vec<Channel> = stream.channels().cloned().collect();
            for channel in &mut channels {
                let si = channel.unit.is_none().then(|| channel.role.si_unit());
                let scale = channel.scale_by(si);
                channel.scale =
                    scale.map_err(|problem| refused(problem, "a unit of what the channel measures"))?;
                let x_m = channel.x_m.unwrap_or_default();
                if matches!(channel.role, Role::Acoustic | Role::ShearStrain) || x_m > plan.length_m {
                    let problem = format!("channel {} at {x_m} m", channel.column);
                    let accepted =
                        "forces, load point, slip, contact-area and shear-force on the simulated slider";
                    return Err(refused(problem, accepted));
                }
            }
            let every_steps = plan.grid.nearest_step(interval_s).max(1);
            streams.push(Stream { channels, every_steps, in_segments: stream.starts.is_some(), count: 0 });
        }
        let segmented = || streams.iter().filter(|stream| stream.in_segments);
        let slowest_steps = segmented().map(|stream| stream.every_steps).max().unwrap_or_default();
        let window_steps =
            like.detection.window_s.map_or(WINDOW * slowest_steps, |s| plan.grid.nearest_step(s.0));
        let margin = (MARGIN_WINDOWS * window_steps as f64) as u64;
        let passes_sensor = |rupture: &&Rupture| {
            let mut at = segmented()
                .flat_map(|stream| &stream.channels)
                .map(|channel| block(&plan, channel) as u32 + 1);
            at.any(|block| (rupture.first_block..=rupture.last_block).contains(&block))
        };
        let mut spans: Vec<[u64; 2]> = Vec::new();
        let mut seen: Vec<&Rupture> = ruptures.iter().filter(passes_sensor).collect();
        seen.sort_by_key(|rupture| rupture.onset_step);
        for rupture in seen {
            let [from, to] =
                [rupture.onset_step.saturating_sub(margin), rupture.end_step.unwrap_or(plan.steps) + margin];
            match spans.last_mut() {
                Some(last) if from <= last[1] => last[1] = last[1].max(to),
                _ => spans.push([from, to]),
            }
        }
        if spans.is_empty() && slowest_steps > 0 {
            return Err(refused(
                "segments, and no rupture that begins one".to_owned(),
                "a run with a rupture at a sensor",
            ));
        }
        let mut windows = Vec::new();
        for (n, stream) in streams.iter().enumerate() {
            let of_stream = if stream.in_segments { &spans[..] } else { &[[0, plan.steps]] };
            for (segment, [from, to]) in of_stream.iter().enumerate() {
                let every_steps = stream.every_steps;
                let (from_step, to_step) = ((*from).max(every_steps), (*to).min(plan.steps));
                let samples = (to_step.saturating_sub(from_step)) / every_steps + 1;
                let steps = WindowPlan { from_step, to_step, every_steps, blocks: 0..plan.blocks };
                windows.push(Window {
                    stream: n,
                    segment: segment + 1,
                    steps,
                    bytes: heading(samples, stream.channels.len()),
                });
            }
        }
        let (slipping, hold_step) = (vec![0.0; plan.blocks], plan.drive.hold_from_step.unwrap_or(u64::MAX));
        let noise = noise.into_iter().chain(NOISE).collect();
        Ok(Sampler {
            scenario,
            plan,
            streams,
            windows,
            noise,
            seed,
            slipping,
            forces_n: [0.0; 2],
            hold_step,
            files,
            folder: folder.to_owned(),
            problem: None,
        })
    }

    /// What the run has to record.
    pub fn recording_plan(&self) -> RecordingPlan {
        let windows = self.windows.iter().map(|window| window.steps.clone()).collect();
        RecordingPlan { windows, ..RecordingPlan::default() }
    }

    fn sample(&mut self, record: &WindowRecord) -> Result<(), FileError> {
        let window = &mut self.windows[record.window as usize];
        let stream = &mut self.streams[window.stream];
        let point_m = self.plan.outside(record.step, self.hold_step).point_m;
        for (n, channel) in stream.channels.iter().enumerate() {
            let at = block(&self.plan, channel);
            let si = match channel.role {
                Role::TangentialForce => self.forces_n[0],
                Role::NormalForce => self.forces_n[1],
                Role::LoadPoint => point_m,
                Role::ContactArea => 1.0 - LOST_AREA * self.slipping[at],
                Role::Slip => record.displacement_m[at],
                _ => record.tangential_force_n[at],
            };
            let seed = mixed(u64::from(self.seed) << 32 | (window.stream as u64) << 24 | n as u64) >> 32;
            let size =
                self.noise.iter().find(|(role, _)| *role == channel.role).map_or(0.0, |(_, size)| *size);
            let noise = size * Draws { seed, stream: 0 }.gaussian(stream.count);
            let stored = (si + noise) / channel.scale - channel.offset.0 / channel.factor.0;
            window.bytes.extend(stored.to_le_bytes());
        }
        stream.count += 1;
        if record.step + stream.every_steps > window.steps.to_step {
            let segment: Option<&dyn Display> = if stream.in_segments { Some(&window.segment) } else { None };
            self.files
                .write(&self.folder.join(file(window.stream, segment)), std::mem::take(&mut window.bytes))?;
        }
        Ok(())
    }

    /// Writes what describes the samples, once all are there, and returns the number of their files.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn finish(self, like: &Description) -> Result<usize, FileError> {
        if let Some(problem) = self.problem {
            return Err(problem);
        }
        let mut table: Table = toml::from_str(&like.text).expect("it was read");
        let (grid, scales, of) = (self.plan.grid, self.plan.scales, &self.scenario.slider);
        let mut slider = Table::new();
        let mut add = |key: &str, value: f64| slider.insert(key.to_owned(), value.into());
        add("length_m", of.length_m);
        add("width_m", of.width_m);
        add("height_m", of.height_m);
        add("youngs_modulus_pa", of.youngs_modulus_pa);
        add("wave_speed_m_per_s", scales.block_length_m / scales.block_time_s);
        if !like.streams.iter().any(|stream| stream.with(Role::NormalForce).is_some()) {
            add("normal_force_n", self.scenario.normal_load.total_n);
        }
        table.insert("slider".to_owned(), slider.into());
        let tables = table["stream"].as_array_mut().expect("it has streams").iter_mut();
        for (n, ((entry, described), stream)) in tables.zip(&like.streams).zip(&self.streams).enumerate() {
            let entry = entry.as_table_mut().expect("each is a table");
            entry.retain(|key, _| ["channel", "array"].contains(&key));
            let mut set = |key: &str, value: Value| entry.insert(key.to_owned(), value);
            set("name", described.name().into());
            set("file", file(n, stream.in_segments.then_some(&"*" as &dyn Display)).into());
            let every_s = grid.time_s(stream.every_steps);
            set("rate_hz", (1.0 / every_s).into());
            if stream.in_segments {
                let named = format!("stream-{}-starts.csv", n + 1);
                let own = self.windows.iter().filter(|window| window.stream == n);
                let starts: String =
                    own.map(|window| format!("{}\n", grid.time_s(window.steps.from_step))).collect();
                self.files.write(&self.folder.join(&named), format!("start_s\n{starts}"))?;
                let starts = [("file", named.as_str()), ("column", "start_s"), ("unit", "s")];
                let starts: Table =
                    starts.into_iter().map(|(key, text)| (key.to_owned(), text.into())).collect();
                set("starts", starts.into());
            } else {
                set("start_s", every_s.into());
            }
            let sensors = described.sensors.len();
            let all = ["channel", "array"].map(|key| entry.get(key).and_then(Value::as_array).cloned());
            let [mut channels, mut arrays] = all.map(Option::unwrap_or_default);
            for (k, (table, channel)) in channels.iter_mut().zip(&described.channel).enumerate() {
                let table = table.as_table_mut().expect("it is one");
                table.insert("column".to_owned(), ((sensors + k + 1) as i64).into());
                table.entry("unit").or_insert(channel.role.si_unit().into());
            }
            for table in &mut arrays {
                let table = table.as_table_mut().expect("it is one");
                table.retain(|key, _| ["role", "unit", "factor"].contains(&key));
                table.entry("unit").or_insert(described.sensors[0].role.si_unit().into());
                table.insert("channels".to_owned(), format!("1..{sensors}").into());
                let list = |of: fn(&Channel) -> Option<f64>| -> Vec<f64> {
                    described.sensors.iter().filter_map(of).collect()
                };
                table.insert("x_m".to_owned(), list(|sensor| sensor.x_m).into());
                let loads = list(|sensor| sensor.normal_n.map(|load| load.0));
                if !loads.is_empty() {
                    table.insert("normal_n".to_owned(), loads.into());
                }
            }
            entry.insert("channel".to_owned(), channels.into());
            entry.insert("array".to_owned(), arrays.into());
        }
        self.files.write_record(&self.folder.join("recording.toml"), table.to_string())?;
        Ok(self.windows.len())
    }
}

/// The contact that a channel reads, counted from 0.
fn block(plan: &Plan, channel: &Channel) -> usize {
    ((channel.x_m.unwrap_or_default() / plan.spacing_m).round() as usize).min(plan.blocks - 1)
}

impl Observer for Sampler<'_> {
    fn record(&mut self, record: &Record) {
        match record {
            Record::Step(step) => {
                for switch in &step.switches {
                    let whole = f64::from(switch.direction == Direction::Detach);
                    let share = |slipping| f64::from(slipping) / f64::from(self.scenario.junction_count());
                    self.slipping[switch.block as usize - 1] = switch.junctions_slipping.map_or(whole, share);
                }
                self.forces_n = [step.driving_force_n, step.normal_load_n];
                let is_reached = |ratio| step.load_ratio() >= ratio;
                if self.hold_step == u64::MAX && self.plan.drive.until_load_ratio.is_some_and(is_reached) {
                    self.hold_step = step.step;
                }
            }
            Record::Window(window) => self.problem = self.sample(window).err(),
            _ => {}
        }
    }

    fn is_done(&self) -> bool {
        self.problem.is_some()
    }
}
