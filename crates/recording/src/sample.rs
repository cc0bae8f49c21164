//! A simulated run as the instruments of a description would have recorded it.
//!
//! A sensor stands on the contact nearest to it. Slip is its displacement, local shear the tangential force on it without
//! friction; real contact is 1, and 0.88 while it slides, of a contact with junctions in proportion to those that slip,
//! and comes back in some 10 ms. Of contacts in several rows those of the first are seen. Noise is white and Gaussian.
//! Streams in segments are triggered by ruptures.

use std::path::Path;

use asperity_files::{FileError, FileSet};
use asperity_model::{Draws, Plan, RecordingPlan, Scenario, WindowPlan, mixed};
use asperity_record::{Direction, Observer, Record, Rupture, WindowRecord};
use toml::{Table, Value};

use crate::description::{Channel, Description, Role};
use crate::error::{InputFault, RecordingError, Result};
use crate::input::{Folder, Given};
use crate::npy;
use crate::recording::WINDOW;
use crate::survey::survey;

/// Standard deviations of the noise of a sample by role, in SI units, of real contact over that of a stuck contact.
pub const NOISE: [(Role, f64); 6] = [
    (Role::TangentialForce, 0.03),
    (Role::NormalForce, 0.03),
    (Role::LoadPoint, 1e-8),
    (Role::Slip, 3e-9),
    (Role::ContactArea, 0.01),
    (Role::ShearForce, 0.03),
];

/// Share of its real contact that a contact loses when it detaches.
const LOST_AREA: f64 = 0.12;

/// The time in which most of it comes back at rest, s.
const RECOVERY_S: f64 = 0.01;

/// Windows of samples that a segment begins before a rupture, and ends behind it.
const MARGIN_WINDOWS: u64 = 16;

/// Samples a run while its steps are taken once more.
#[derive(Debug)]
pub struct Sampler<'a> {
    scenario: &'a Scenario,
    like: &'a Description,
    plan: Plan,
    windows: Vec<Window>,
    /// Of a role the first counts.
    noise: Vec<(Role, f64)>,
    seed: u32,
    /// The share of each contact that slips, and since when it rests, if it does.
    slipping: Vec<(f64, Option<f64>)>,
    /// `F_T` and `F_N` of the last step record.
    forces_n: [f64; 2],
    hold_step: u64,
}

/// A segment of a stream, or all of it.
#[derive(Debug)]
struct Window {
    stream: usize,
    steps: WindowPlan,
    samples: Vec<f64>,
}

/// The contact that a channel reads, counted from 0.
fn contact(plan: &Plan, channel: &Channel) -> usize {
    ((channel.x_m.unwrap_or_default() / plan.spacing_m).round() as usize).min(plan.blocks - 1)
}

impl<'a> Sampler<'a> {
    /// A sampler of a run with those ruptures, with noise from a seed; `noise` precedes [`NOISE`].
    ///
    /// # Errors
    /// If no run has what a channel measures where it is, a stream in segments has none, or the file of one with a column
    /// of times cannot be read.
    pub fn new(
        like: &'a Description,
        scenario: &'a Scenario,
        ruptures: &[Rupture],
        noise: &[(Role, f64)],
        seed: u32,
    ) -> Result<Sampler<'a>> {
        let plan = Plan::new(scenario);
        let refused = |problem: String, accepted| -> RecordingError {
            InputFault::new(&like.file, "", problem, accepted).into()
        };
        let is_lost = |channel: &&Channel| {
            matches!(channel.role, Role::Acoustic | Role::ShearStrain) || channel.x_m > Some(plan.length_m)
        };
        if let Some(lost) = like.streams.iter().flat_map(|stream| stream.channels()).find(is_lost) {
            let accepted = "forces, load point, slip, contact-area, shear-force, from 0 to the slider's end";
            return Err(refused(format!("channel {} has nothing to measure", lost.column), accepted));
        }
        let mut every_steps = Vec::new();
        for stream in &like.streams {
            let interval_s = match stream.rate_hz {
                Some(rate) => 1.0 / rate.0,
                None => survey(&Folder::of(&like.file, Given::new()), &mut stream.clone())?.interval_s,
            };
            every_steps.push(plan.grid.nearest_step(interval_s).max(1));
        }
        let segmented =
            || like.streams.iter().zip(&every_steps).filter(|(stream, _)| stream.starts.is_some());
        let window = segmented().map(|(_, every)| WINDOW * every).max().unwrap_or_default();
        let window = like.detection.window_s.map_or(window, |window_s| plan.grid.nearest_step(window_s.0));
        let sensors: Vec<usize> = segmented()
            .flat_map(|(stream, _)| stream.channels())
            .map(|channel| contact(&plan, channel))
            .collect();
        let mut spans: Vec<[u64; 2]> = Vec::new();
        let mut in_order: Vec<&Rupture> = ruptures.iter().collect();
        in_order.sort_by_key(|rupture| rupture.onset_step);
        for rupture in in_order {
            let blocks = rupture.first_block as usize..=rupture.last_block as usize;
            let end_step = rupture.end_step.unwrap_or(plan.steps) + MARGIN_WINDOWS * window;
            let from_step = rupture.onset_step.saturating_sub(MARGIN_WINDOWS * window);
            match spans.last_mut() {
                _ if !sensors.iter().any(|sensor| blocks.contains(&(sensor + 1))) => {}
                Some(last) if from_step <= last[1] => last[1] = last[1].max(end_step),
                _ => spans.push([from_step, end_step]),
            }
        }
        if spans.is_empty() && segmented().count() > 0 {
            let problem = "no rupture begins a segment".to_owned();
            return Err(refused(problem, "a run with a rupture at a sensor"));
        }
        let mut windows = Vec::new();
        for (n, (stream, every_steps)) in like.streams.iter().zip(every_steps).enumerate() {
            let spans = if stream.starts.is_some() { &spans[..] } else { &[[0, plan.steps]] };
            windows.extend(spans.iter().map(|[from, to]| {
                let (from_step, to_step) = ((*from).max(every_steps), (*to).min(plan.steps));
                let steps = WindowPlan { from_step, to_step, every_steps, blocks: 0..plan.blocks };
                Window { stream: n, steps, samples: Vec::new() }
            }));
        }
        Ok(Sampler {
            windows,
            noise: noise.iter().chain(&NOISE).copied().collect(),
            slipping: vec![(0.0, None); plan.blocks],
            forces_n: [0.0; 2],
            hold_step: plan.drive.hold_from_step.unwrap_or(u64::MAX),
            scenario,
            like,
            plan,
            seed,
        })
    }

    /// What the run has to record.
    pub fn recording_plan(&self) -> RecordingPlan {
        let windows = self.windows.iter().map(|window| window.steps.clone()).collect();
        RecordingPlan { windows, ..RecordingPlan::default() }
    }

    fn sample(&mut self, record: &WindowRecord) {
        let Window { stream, samples, steps } = &mut self.windows[record.window as usize];
        let point_m = self.plan.outside(record.step, self.hold_step).point_m;
        for (n, channel) in self.like.streams[*stream].channels().enumerate() {
            let at = contact(&self.plan, channel);
            let si = match channel.role {
                Role::TangentialForce => self.forces_n[0],
                Role::NormalForce => self.forces_n[1],
                Role::LoadPoint => point_m,
                Role::ContactArea => {
                    let (share, rests_from_s) = self.slipping[at];
                    let rest_s = rests_from_s.map_or(0.0, |from_s| record.time_s - from_s);
                    1.0 - LOST_AREA * share * (-rest_s / RECOVERY_S).exp()
                }
                Role::Slip => record.displacement_m[at],
                _ => record.tangential_force_n[at],
            };
            let size =
                self.noise.iter().find(|(role, _)| *role == channel.role).map_or(0.0, |(_, size)| *size);
            let seed = mixed(u64::from(self.seed) << 32 | (*stream as u64) << 24 | n as u64) >> 32;
            let noise = Draws { seed, stream: 0 }.gaussian(record.step / steps.every_steps);
            samples.push((si + size * noise) / channel.unit_or_si().1);
        }
    }

    /// Writes the samples as arrays of NumPy, and their description. Returns how many arrays there are.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, files: &FileSet, folder: &Path) -> Result<usize, FileError> {
        let (of, scales, grid) = (&self.scenario.slider, self.plan.scales, self.plan.grid);
        let mut text = format!(
            "format = 1\nname = {}\n\n[slider]\nlength_m = {:?}\nwidth_m = {:?}\nheight_m = {:?}\n\
             youngs_modulus_pa = {:?}\nwave_speed_m_per_s = {:?}\nnormal_force_n = {:?}\n",
            Value::from(self.like.name.as_str()),
            of.length_m,
            of.width_m,
            of.height_m,
            of.youngs_modulus_pa,
            scales.block_length_m / scales.block_time_s,
            self.scenario.normal_load.total_n
        );
        for (n, stream) in self.like.streams.iter().enumerate() {
            let windows = || self.windows.iter().filter(|window| window.stream == n);
            let (named, count) = (format!("stream-{}", n + 1), stream.channels().count());
            let first = &windows().next().expect("a stream has one").steps;
            let (start_s, every_s) = (grid.time_s(first.from_step), grid.time_s(first.every_steps));
            let (star, clock) = match &stream.starts {
                Some(_) => ("-*", format!("starts = {{ file = \"{named}.csv\", column = \"start_s\" }}")),
                None => ("", format!("start_s = {start_s:?}")),
            };
            text += &format!(
                "\n[[stream]]\nname = {}\nfile = \"{named}{star}.npy\"\nrate_hz = {:?}\n{clock}\n",
                Value::from(stream.name()),
                1.0 / every_s
            );
            if let Some(first) = stream.sensors.first() {
                let (heading, count, sensors) = (heading(first), stream.sensors.len(), stream.sensors.iter());
                let x_m: Vec<f64> = sensors.clone().filter_map(|sensor| sensor.x_m).collect();
                text += &format!("[[stream.array]]\n{heading}channels = \"1..{count}\"\nx_m = {x_m:?}\n");
                let loads_n: Vec<f64> = sensors.filter_map(|sensor| Some(sensor.normal_n?.0)).collect();
                if !loads_n.is_empty() {
                    text += &format!("normal_n = {loads_n:?}\n");
                }
            }
            for (place, channel) in (stream.sensors.len() + 1..).zip(&stream.channel) {
                let x_m = channel.x_m.map(|x_m| format!("x_m = {x_m:?}\n")).unwrap_or_default();
                text += &format!("[[stream.channel]]\n{}column = {place}\n{x_m}", heading(channel));
            }
            if stream.starts.is_some() {
                let starts = windows().map(|window| format!("{}\n", grid.time_s(window.steps.from_step)));
                let table: String = ["start_s\n".to_owned()].into_iter().chain(starts).collect();
                files.write(&folder.join(format!("{named}.csv")), table)?;
            }
            for (segment, window) in windows().enumerate() {
                let file = named.clone() + &star.replace('*', &(segment + 1).to_string()) + ".npy";
                files.write(&folder.join(file), array(&window.samples, count))?;
            }
        }
        let mut like: Table = toml::from_str(&self.like.text).expect("it was read");
        like.retain(|key, _| key == "detection");
        files.write_record(&folder.join("recording.toml"), format!("{text}\n{like}"))?;
        Ok(self.windows.len())
    }
}

fn heading(channel: &Channel) -> String {
    let role = Value::try_from(channel.role).expect("it is a word");
    format!("role = {role}\nunit = \"{}\"\n", channel.unit_or_si().0)
}

/// An array of NumPy of doubles, samples first.
fn array(samples: &[f64], channels: usize) -> Vec<u8> {
    let mut bytes = npy::head("<f8", false, &format!("({}, {channels})", samples.len() / channels));
    bytes.extend(samples.iter().flat_map(|sample| sample.to_le_bytes()));
    bytes
}

impl Observer for Sampler<'_> {
    fn record(&mut self, record: &Record) {
        match record {
            Record::Step(step) => {
                for switch in &step.switches {
                    let slipping = &mut self.slipping[switch.block as usize - 1];
                    let share = |count| f64::from(count) / f64::from(self.scenario.junction_count());
                    *slipping = match switch.direction {
                        Direction::Detach => (switch.junctions_slipping.map_or(1.0, share), None),
                        Direction::Attach => (slipping.0, Some(step.time_s)),
                    };
                }
                self.forces_n = [step.driving_force_n, step.normal_load_n];
                let stops = self.plan.drive.until_load_ratio.is_some_and(|ratio| step.load_ratio() >= ratio);
                self.hold_step = if stops { self.hold_step.min(step.step) } else { self.hold_step };
            }
            Record::Window(window) => self.sample(window),
            _ => {}
        }
    }
}
