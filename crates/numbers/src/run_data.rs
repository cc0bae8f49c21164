//! The inputs of tables, figures and numbers, collected from the records of a run, live or from its log.
//!
//! A run has far more records than its outputs need. [`Collector`] reads each once and keeps the data named
//! by [`RequiredData`], in a form without unused fields.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::Arc;

use asperity_model::{NodeState, Plan, Scenario};
use asperity_record::{
    Arrival, Direction, Event, FieldRecord, LoadDrop, Noise, Observer, Record, RunEnd, RunHeader, Rupture,
    Series, SeriesBlock, SlipEvent, StepRecord, TraceRecord, WindowRecord, unit_of_time,
};

use crate::growth::EventGrowth;
use crate::precursors::PrecursorRules;
use crate::required_data::{Film, RequiredData};
use crate::slip_steps::SlipSteps;
use crate::states::States;
use crate::summarizer::Summarizer;
use crate::summary::Summary;

/// The loads of a step record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The step.
    pub step: u64,
    /// Simulated time at its end, s.
    pub time_s: f64,
    /// Sum of the driving forces `F_T`, N.
    pub driving_force_n: f64,
    /// Total normal load `F_N`, N.
    pub normal_load_n: f64,
    /// The driving forces on the first and the last block, N, where the drive pulls both ways.
    pub end_forces_n: Option<[f64; 2]>,
    /// How many blocks slid.
    pub sliding: u32,
}

impl From<&StepRecord> for Load {
    fn from(record: &StepRecord) -> Load {
        Load {
            step: record.step,
            time_s: record.time_s,
            driving_force_n: record.driving_force_n,
            normal_load_n: record.normal_load_n,
            end_forces_n: record.end_forces_n,
            sliding: record.sliding,
        }
    }
}

impl Load {
    /// `F_T / F_N`.
    pub fn load_ratio(&self) -> f64 {
        self.driving_force_n / self.normal_load_n
    }
}

/// When a block switched, and where it was.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switched {
    /// The step at whose end it switched.
    pub step: u64,
    /// Whether it detached or re-attached.
    pub direction: Direction,
    /// Its displacement, m.
    pub displacement_m: f64,
}

/// The data kept of every run.
#[derive(Debug, Clone)]
pub struct RunEvents {
    /// The run's name in its pipeline.
    pub name: String,
    /// The header of the run.
    pub header: RunHeader,
    /// Its scenario.
    pub scenario: Scenario,
    /// The numbers derived from it.
    pub plan: Plan,
    /// Its summary.
    pub summary: Summary,
    /// Slip events, in order; see [`Collector::bounded`].
    pub slips: Vec<SlipEvent>,
    /// The steps of all slip events.
    pub slip_steps: Arc<SlipSteps>,
    /// Ruptures, in the order in which they became certain, as in the log; none of a log by other
    /// detectors. See [`Collector::bounded`].
    pub ruptures: Option<Vec<Rupture>>,
    /// The first and the last switch of every block.
    pub switches: Vec<Option<[Switched; 2]>>,
}

/// The window that states belong to which no log has.
pub const COMPUTED: u32 = u32::MAX;

/// The data kept of a run: [`RunEvents`], and the parts of its records named by [`RequiredData`].
#[derive(Debug, Clone)]
pub struct RunData {
    /// The data kept of every run.
    pub run: RunEvents,
    /// The required data, which are kept.
    pub kept: RequiredData,
    /// See [`RunData::loads()`].
    pub loads: Vec<Load>,
    /// See [`RunData::states()`].
    pub states: States,
    /// See [`RunData::windows()`].
    pub windows: Vec<WindowRecord>,
    /// See [`RunData::rupture_fields()`].
    pub rupture_fields: Vec<WindowRecord>,
    /// See [`RunData::detachments()`].
    pub detachments: Vec<(u64, u32)>,
    /// See [`RunData::arrivals()`].
    pub arrivals: Vec<Arrival>,
    /// See [`RunData::nodes_at()`] and [`RunData::film()`].
    pub nodes: Vec<NodeState>,
    /// The velocities of all contacts in the states that were computed again, by step, if asked for; nothing else of
    /// these states.
    pub velocities: Vec<WindowRecord>,
    /// The load drops of a recording, if asked for.
    pub drops: Vec<LoadDrop>,
    /// The noise of its sensors, likewise.
    pub noise: Vec<Noise>,
    /// What sensors read about the ruptures of which samples are wanted.
    pub traces: Vec<TraceRecord>,
    /// See [`RunData::series()`].
    pub series: Vec<Series>,
    /// See [`RunData::series()`].
    pub series_blocks: Vec<SeriesBlock>,
}

impl Deref for RunData {
    type Target = RunEvents;

    fn deref(&self) -> &RunEvents {
        &self.run
    }
}

impl DerefMut for RunData {
    fn deref_mut(&mut self) -> &mut RunEvents {
        &mut self.run
    }
}

/// Inputs for the speeds of fronts: loads, states, and the passage of ruptures at their blocks.
pub type OfFronts<'a> = (&'a [Load], &'a States, &'a [Arrival]);

/// Inputs for the motion of blocks that fronts passed: the passage, states, and dense windows.
pub type OfMotion<'a> = (&'a [Arrival], &'a States, &'a [WindowRecord]);

/// The rows of series of the slider and of chosen blocks.
pub type OfSeries<'a> = (&'a [Series], &'a [SeriesBlock]);

/// Data that are read but were not in the [`RequiredData`] of the collector.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{what} of run {run} are not kept")]
pub struct NotKept {
    run: String,
    what: &'static str,
}

impl From<NotKept> for String {
    fn from(error: NotKept) -> String {
        error.to_string()
    }
}

impl RunData {
    fn if_kept<'a, T: ?Sized>(&self, kept: bool, what: &'static str, data: &'a T) -> Result<&'a T, NotKept> {
        if kept { Ok(data) } else { Err(NotKept { run: self.name.clone(), what }) }
    }

    /// The loads at every step record.
    ///
    /// # Errors
    /// If they were not kept.
    pub fn loads(&self) -> Result<&[Load], NotKept> {
        self.if_kept(self.kept.loads, "loads", self.loads.as_slice())
    }

    /// The states of all blocks that were kept.
    ///
    /// # Errors
    /// If there are none.
    pub fn states(&self) -> Result<&States, NotKept> {
        self.if_kept(self.kept.topics().fields, "states", &self.states)
    }

    /// Dense windows, in order.
    ///
    /// # Errors
    /// If they were not kept.
    pub fn windows(&self) -> Result<&[WindowRecord], NotKept> {
        self.if_kept(self.kept.windows, "windows", self.windows.as_slice())
    }

    /// The states of all blocks while many slide, in order.
    ///
    /// # Errors
    /// If they were not kept.
    pub fn rupture_fields(&self) -> Result<&[WindowRecord], NotKept> {
        self.if_kept(self.kept.windows, "states of ruptures", self.rupture_fields.as_slice())
    }

    /// Step and block of every detachment, in order.
    ///
    /// # Errors
    /// If they were not kept.
    pub fn detachments(&self) -> Result<&[(u64, u32)], NotKept> {
        self.if_kept(self.kept.detachments, "detachments", self.detachments.as_slice())
    }

    /// How ruptures passed their blocks, one rupture after the other as in the log.
    ///
    /// # Errors
    /// If it was not kept.
    pub fn arrivals(&self) -> Result<&[Arrival], NotKept> {
        self.if_kept(self.kept.arrivals, "arrivals", self.arrivals.as_slice())
    }

    /// The rows of series as solved, of the slider and of the chosen blocks.
    ///
    /// # Errors
    /// If they were not kept.
    pub fn series(&self) -> Result<OfSeries<'_>, NotKept> {
        let rows = self.if_kept(self.kept.series, "series", self.series.as_slice())?;
        Ok((rows, &self.series_blocks))
    }

    /// Inputs for the speeds of fronts, see [`RequiredData::fronts`].
    ///
    /// # Errors
    /// If any of it was not kept.
    pub fn of_fronts(&self) -> Result<OfFronts<'_>, NotKept> {
        Ok((self.loads()?, self.states()?, self.arrivals()?))
    }

    /// The state of all nodes nearest to one of the times that were asked for, s; `None` of a chain.
    ///
    /// # Errors
    /// If that time was not asked for.
    pub fn nodes_at(&self, at_s: f64) -> Result<Option<&NodeState>, NotKept> {
        self.if_kept(self.kept.nodes_at_s.contains(&at_s), "nodes", &self.nodes)?;
        Ok(self.nearest_nodes(at_s))
    }

    /// The states of all nodes while a rupture runs, at the times of a film that was asked for; fewer of a
    /// chain, which has none.
    ///
    /// # Errors
    /// In words, if the film was not asked for, or the run has no such rupture.
    pub fn film(&self, film: &Film) -> Result<Vec<&NodeState>, String> {
        self.if_kept(self.kept.films.contains(film), "nodes", &self.nodes)?;
        Ok(film.times_s(self)?.into_iter().filter_map(|at_s| self.nearest_nodes(at_s)).collect())
    }

    fn nearest_nodes(&self, at_s: f64) -> Option<&NodeState> {
        let distance = |nodes: &&NodeState| (nodes.time_s - at_s).abs();
        self.nodes.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))
    }
}

/// The loads at the last step record up to a step, or at the first one where the step is before it.
pub fn load_at(loads: &[Load], step: u64) -> Option<&Load> {
    let after = loads.partition_point(|load| load.step <= step);
    loads.get(after.saturating_sub(1))
}

impl RunEvents {
    /// The value of a numerical scenario key.
    ///
    /// # Errors
    /// In words, if the scenario has no such key.
    pub fn parameter(&self, key: &str) -> Result<f64, String> {
        let stated = self.scenario.stated().find(|(of, _)| of.path == key);
        let number = stated
            .and_then(|(_, value)| value.as_float().or_else(|| value.as_integer().map(|count| count as f64)));
        number.ok_or_else(|| {
            format!("parameter {key:?} is not accepted (accepted: a scenario key that holds a number)")
        })
    }

    /// The ruptures in the order of their onsets; none where the log has none.
    pub fn ruptures_by_onset(&self) -> Vec<&Rupture> {
        let mut ruptures: Vec<&Rupture> = self.ruptures.iter().flatten().collect();
        ruptures.sort_by_key(|rupture| (rupture.onset_step, rupture.rupture));
        ruptures
    }

    /// Normal load of each contact in a state: for a slab from the state, for a chain its share of the load
    /// at that time. `None` without step records.
    pub fn normal_load_n(&self, loads: &[Load], state: &FieldRecord) -> Option<Vec<f64>> {
        let load = load_at(loads, state.step)?;
        if !state.normal_load_n.is_empty() {
            return Some(state.normal_load_n.clone());
        }
        let course = load.normal_load_n / self.plan.total_normal_load_n;
        Some(self.plan.normal_load_n.iter().map(|p_n| course * p_n).collect())
    }

    /// The unit of its times for people: its length in s, and its name.
    pub fn unit_of_time(&self) -> (f64, &'static str) {
        unit_of_time(self.plan.grid.time_s(self.header.steps))
    }

    /// Whether it is the recording of a laboratory: its scenario is a [stand-in](Scenario::of_recording).
    pub fn is_measured(&self) -> bool {
        self.header.sensors.is_some()
    }

    /// Number of contacts along the sliding direction: of blocks, where they lie in a single row.
    pub fn columns(&self) -> u32 {
        self.header.contacts().columns()
    }

    /// The run, if its contacts lie in a single row, so that their numbers are places along the slider.
    pub fn of_one_row(&self) -> Option<&RunEvents> {
        (self.header.rows == 1).then_some(self)
    }

    /// `mu_d`; by rate-and-state friction there is none.
    pub(crate) fn mu_d(&self) -> Option<f64> {
        let friction = &self.plan.friction;
        friction.law.word().sticks().then_some(friction.dynamic_coefficient)
    }

    /// The run, unless ends of its chain are clamped, absorbing or joined, of which there is no theory.
    pub(crate) fn has_free_ends(&self) -> Option<&RunEvents> {
        self.plan.end_bonds.is_empty().then_some(self)
    }

    /// The run, if it is of a chain whose stuck blocks have springs, so that force decays along it.
    pub(crate) fn of_stuck_springs(&self) -> Option<&RunEvents> {
        self.plan.has_decay().then_some(self)
    }

    /// The run, if theory of the stuck or the moving chain is of it; slabs have none.
    pub(crate) fn of_chain(&self) -> Option<&RunEvents> {
        self.plan.has_theory().then_some(self)
    }

    /// The first slip event in which every block slid.
    pub fn first_global_slip(&self) -> Option<&SlipEvent> {
        self.slips.iter().find(|slip| slip.is_global(self.header.blocks))
    }
}

/// Reads the records of a run, keeps the required data, and computes its summary.
pub struct Collector {
    run: RunData,
    summarizer: Summarizer,
    /// Of a bounded one, for each rule by which slip events grow, the fewest blocks that count, and the growth so far.
    bounded: Vec<(u32, EventGrowth)>,
    /// How many loads are held at most before they are [`thinned`].
    most_loads: usize,
    /// The ruptures whose samples are kept, once these are known.
    traced: Vec<u64>,
}

/// Most loads of which a bounded collector keeps all.
const MOST_LOADS: usize = 1 << 20;

/// Into how many parts of a run it divides more than these: ten for each pixel of a figure.
const PARTS: u64 = 1 << 14;

/// Of the loads in each part of a run those that a figure shows: its ends, and the extremes of `F_T / F_N` and of the
/// number of sliding blocks.
fn thinned(loads: &[Load], steps: u64) -> Vec<Load> {
    let part = |load: &Load| load.step / (steps / PARTS + 1);
    let by_ratio = |a: &&Load, b: &&Load| a.load_ratio().total_cmp(&b.load_ratio());
    let shown = |part: &[Load]| {
        let all = part.iter();
        let ends = [part.first(), part.last(), all.clone().min_by(by_ratio), all.clone().max_by(by_ratio)];
        let sliding = [all.clone().min_by_key(|load| load.sliding), all.max_by_key(|load| load.sliding)];
        let by_step = ends.into_iter().chain(sliding).flatten().map(|load| (load.step, *load));
        by_step.collect::<BTreeMap<u64, Load>>().into_values()
    };
    loads.chunk_by(|a, b| part(a) == part(b)).flat_map(shown).collect()
}

impl Collector {
    /// For a run that is about to go by.
    pub fn new(name: &str, header: RunHeader, scenario: Scenario, required: RequiredData) -> Collector {
        let plan = Plan::new(&scenario);
        let states = States::new(header.blocks, &required);
        let known = header.sensors.is_none().then_some(&scenario);
        let summarizer = Summarizer::new(name, &header, known);
        let run = RunEvents {
            name: name.to_owned(),
            switches: vec![None; header.blocks as usize],
            header,
            scenario,
            plan,
            summary: Summary::default(),
            slips: Vec::new(),
            slip_steps: Arc::default(),
            ruptures: Some(Vec::new()),
        };
        let run = RunData {
            run,
            states,
            kept: required,
            loads: Vec::new(),
            windows: Vec::new(),
            rupture_fields: Vec::new(),
            detachments: Vec::new(),
            arrivals: Vec::new(),
            nodes: Vec::new(),
            velocities: Vec::new(),
            drops: Vec::new(),
            noise: Vec::new(),
            traces: Vec::new(),
            series: Vec::new(),
            series_blocks: Vec::new(),
        };
        Collector { run, summarizer, bounded: Vec::new(), most_loads: usize::MAX, traced: Vec::new() }
    }

    /// Keeps data that do not grow with the number of events, for the precursors by these rules and for figures of the
    /// whole run: slip events that may be precursors or end them, or all if their detachments are required; ruptures
    /// likewise, or all if their arrivals are; and no more loads than can be seen.
    #[must_use]
    pub fn bounded(self, rules: &PrecursorRules) -> Collector {
        let growth = EventGrowth::new(self.run.header.blocks);
        let bounded = [1, rules.min_blocks].map(|fewest| (fewest, growth)).into();
        Collector { bounded, most_loads: MOST_LOADS, ..self }
    }

    /// For a log that is about to be read, with this header and scenario.
    ///
    /// # Errors
    /// In words, if the scenario is not that of the header.
    pub fn of_log(
        name: &str,
        header: &RunHeader,
        scenario: &Scenario,
        required: RequiredData,
    ) -> Result<Collector, String> {
        // From here on, blocks and steps are those of the header.
        if header.sensors.is_none() && scenario.hash() != header.scenario_hash {
            return Err(format!(
                "scenario.toml has the hash {}, metadata `run` says {}",
                scenario.hash(),
                header.scenario_hash
            ));
        }
        Ok(Collector::new(name, header.clone(), scenario.clone(), required))
    }

    /// Whether its drive pulls both ways.
    pub fn both_ways(&self) -> bool {
        self.run.plan.drive.pulls_both_ways()
    }

    fn step(&mut self, record: &StepRecord) {
        let RunData { run, kept, loads, states, detachments, .. } = &mut self.run;
        states.step(record);
        if kept.loads {
            loads.push(Load::from(record));
            if loads.len() == self.most_loads {
                *loads = thinned(loads, run.header.steps);
                self.most_loads = MOST_LOADS / 4;
            }
        }
        for switch in &record.switches {
            let switched = Switched {
                step: record.step,
                direction: switch.direction,
                displacement_m: switch.displacement_m,
            };
            let [_, last] = run.switches[switch.block as usize - 1].get_or_insert([switched, switched]);
            *last = switched;
            if kept.detachments && switch.direction == Direction::Detach {
                detachments.push((record.step, switch.block));
            }
        }
    }

    /// The times at which all nodes of a lattice are wanted, s: no record has them, so the caller, once the run
    /// has passed, computes them and passes them to [`Collector::nodes`]. For a chain those of velocities alone.
    pub fn nodes_at_s(&self) -> Vec<f64> {
        let RunData { run, kept, .. } = &self.run;
        if run.is_measured() {
            return Vec::new();
        }
        // Of a rupture that the run lacks the figure says so.
        let of = |films: &[Film]| films.iter().filter_map(|film| film.times_s(run).ok()).flatten().collect();
        let mut all: Vec<f64> = of(&kept.velocities);
        if run.plan.elastic.as_chain().is_none() {
            all.extend(kept.nodes_at_s.iter().copied().chain(of(&kept.films)));
        }
        all
    }

    /// Whether samples of sensors about ruptures are wanted. Which ruptures is known once the run has passed, so the
    /// caller then passes the samples of its log again.
    pub fn wants_traces(&mut self) -> bool {
        let RunData { run, kept, .. } = &self.run;
        let ruptures = kept.traces.iter().filter_map(|film| film.rupture(run).ok());
        self.traced = ruptures.map(|rupture| rupture.rupture).collect();
        !self.traced.is_empty()
    }

    /// Takes the nodes at one of these times, of a later step than the last.
    pub fn nodes(&mut self, nodes: NodeState) {
        let RunData { run, kept, .. } = &self.run;
        if !kept.velocities.is_empty() {
            let contacts = run.plan.elastic.layout();
            let of_axis = |axis: usize| {
                let first = axis * nodes.lattice.nodes();
                nodes.velocity_m_per_s[first..first + contacts.count() as usize].to_vec()
            };
            let velocity_across_m_per_s = if contacts.is_area() { of_axis(1) } else { Vec::new() };
            let (step, time_s, velocity_m_per_s) = (nodes.step, nodes.time_s, of_axis(0));
            let at =
                WindowRecord { window: COMPUTED, step, time_s, first_block: 1, ..WindowRecord::default() };
            self.run.velocities.push(WindowRecord { velocity_m_per_s, velocity_across_m_per_s, ..at });
        }
        if !(self.run.kept.nodes_at_s.is_empty() && self.run.kept.films.is_empty()) {
            self.run.nodes.push(nodes);
        }
    }

    /// Returns the data kept, given the source of its ruptures, and its end if known.
    pub fn finish(self, has_ruptures: bool, end: Option<&RunEnd>) -> RunData {
        let Collector { mut run, summarizer, bounded, .. } = self;
        run.states.end();
        if !bounded.is_empty() && !run.kept.arrivals {
            run.ruptures = Some(summarizer.growth.iter().map(|(_, rupture)| rupture.clone()).collect());
        }
        if !has_ruptures {
            run.ruptures = None;
        }
        run.slip_steps = summarizer.events.steps.clone();
        run.summary = summarizer.finish(has_ruptures, end);
        run
    }
}

impl Observer for Collector {
    fn record(&mut self, record: &Record) {
        self.summarizer.record(record);
        match record {
            Record::Step(record) => self.step(record),
            Record::Fields(record) => self.run.states.state(record),
            Record::Window(record) if self.run.kept.windows => {
                let run = &mut self.run;
                let is_chosen = (record.window as usize) < run.plan.recording.windows.len();
                let of = if is_chosen { &mut run.windows } else { &mut run.rupture_fields };
                of.push(record.clone());
            }
            Record::Traces(record) if self.traced.contains(&record.rupture) => {
                self.run.traces.push(record.clone());
            }
            Record::Row(row) if self.run.kept.measured || self.run.kept.series => {
                let (run, values) = (&mut self.run, &row.values);
                run.noise.extend(values.get().cloned());
                run.series.extend(values.get().cloned());
                run.series_blocks.extend(values.get().cloned());
            }
            _ => {}
        }
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event);
        if let Some(slip) = event.get::<SlipEvent>() {
            self.run.states.slip(slip);
            let mut is_kept = self.run.kept.detachments || self.bounded.is_empty();
            for (fewest, growth) in &mut self.bounded {
                is_kept |=
                    slip.blocks_slipped >= *fewest && growth.extends(slip.reach(), slip.blocks_slipped);
            }
            self.run.slips.extend(is_kept.then(|| slip.clone()));
        } else if let Some(rupture) = event.get::<Rupture>() {
            let is_kept = self.run.kept.arrivals || self.bounded.is_empty();
            self.run.ruptures.get_or_insert_default().extend(is_kept.then(|| rupture.clone()));
        } else if let Some(arrival) = event.get::<Arrival>().filter(|_| self.run.kept.arrivals) {
            self.run.arrivals.push(arrival.clone());
        } else if let Some(drop) = event.get::<LoadDrop>().filter(|_| self.run.kept.measured) {
            self.run.drops.push(drop.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Direction, Event, Observer, Record, SlipEvent, WindowRecord};
    use asperity_testkit::{quiet_step, slip_event};

    use super::{Collector, Load, PARTS, thinned};
    use crate::made_up;
    use crate::precursors::{self, PrecursorRules};
    use crate::required_data::RequiredData;

    #[test]
    fn of_switches_there_stay_the_first_and_the_last_of_each_block() {
        let run = made_up::run("", &[(100, 101, &[1]), (200, 201, &[1, 3]), (300, 301, &[1])]);
        let [first, last] = run.switches[0].unwrap();
        assert_eq!((first.step, last.step, last.direction), (99, 299, Direction::Detach));
        assert_eq!(run.switches[1], None);
        assert_eq!(run.detachments().unwrap(), [(99, 1), (199, 1), (199, 3), (299, 1)]);
    }

    /// Neither the events between precursors stay, nor their ruptures; a slip event that is a precursor by one rule alone does.
    #[test]
    fn of_a_bounded_run_the_same_precursors_are_found_among_few_events() {
        let blocks = |n: u64| -> &[u32] {
            match n {
                300 => &[1],
                500 => &[1, 5],
                700 => &[1, 2, 3, 4],
                900 => &[1, 2, 3, 4, 5, 6],
                _ => &[2],
            }
        };
        let mut run = made_up::run("", &[]);
        run.header.blocks = 6;
        let of_event = |n: u64| -> Vec<made_up::Passed> {
            blocks(n).iter().map(|block| (*block, 100 * n + 10, Some(100 * n + 15))).collect()
        };
        let passed: Vec<_> = (0..1000).map(of_event).collect();
        made_up::with_ruptures(&mut run, &passed.iter().map(Vec::as_slice).collect::<Vec<_>>());
        let rules = PrecursorRules { min_blocks: 3, ..PrecursorRules::default() };
        let all = Collector::new("a", run.header.clone(), run.scenario.clone(), RequiredData::LOADS);
        let few = Collector::new("a", run.header.clone(), run.scenario.clone(), RequiredData::LOADS)
            .bounded(&rules);
        let [all, few] = [all, few].map(|mut collector| {
            for event in 0..1000 {
                let (onset, blocks) = (100 * event + 10, blocks(event));
                let slip = slip_event(onset, onset + 5, blocks[0]..=blocks[blocks.len() - 1]);
                let blocks_slipped = blocks.len() as u32;
                collector.event(&Event::new(SlipEvent { event, blocks_slipped, ..slip }));
            }
            run.ruptures.iter().flatten().for_each(|rupture| collector.event(&Event::new(rupture.clone())));
            collector.finish(true, None)
        });
        assert_eq!((all.slips.len(), few.slips.len()), (1000, 4));
        assert_eq!(few.ruptures.as_ref().unwrap().len(), 3);
        let found = [&few, &all].map(|run| precursors::find(run, &rules).unwrap());
        assert_eq!(found[0], found[1]);
        assert_eq!(found[0].iter().map(|found| found.start.event).collect::<Vec<u64>>(), [700, 900]);
        assert_eq!(precursors::one_by_one(&few), precursors::one_by_one(&all));
        assert_eq!(precursors::among_ruptures(&few, &rules), precursors::among_ruptures(&all, &rules));
        assert_eq!(few.first_global_slip(), all.first_global_slip());
        assert_eq!(few.slip_steps.event_at(61_012), Some((610, 61_010)));
    }

    #[test]
    fn of_many_loads_those_stay_that_can_be_seen() {
        let load = |step: u64| Load {
            step,
            sliding: u32::from(step == 70_000),
            driving_force_n: ((step * 7919) % 1000) as f64 + if step == 60_001 { 1e4 } else { 0.0 },
            ..Load::from(&quiet_step(step, step as f64, 0.0))
        };
        let steps = 20 * PARTS;
        let all: Vec<Load> = (0..steps).map(load).collect();
        let thin = thinned(&all, steps);
        assert!(thin.len() < all.len() / 3 && thin.windows(2).all(|pair| pair[0].step < pair[1].step));
        assert!([0, 60_001, 70_000, steps - 1].iter().all(|step| thin.contains(&load(*step))));
        assert_eq!(thinned(&thin, steps), thin);
    }

    /// States of ruptures have the number behind the windows that the scenario asks for.
    #[test]
    fn states_of_ruptures_are_no_windows() {
        let toml = "recording.window = [{from_s=0,to_s=1e-3,every_s=1e-5,first_block=2,last_block=3}]\n\
                    recording.rupture_fields_from_blocks = 2\nrecording.rupture_fields_s = 1e-6";
        let run = made_up::run(toml, &[]);
        let mut collector =
            Collector::new("a", run.header.clone(), run.scenario.clone(), RequiredData::WINDOWS);
        for (window, first_block) in [(0, 2), (1, 1), (1, 1)] {
            collector.record(&Record::Window(WindowRecord {
                window,
                step: 10,
                time_s: 1e-6,
                sliding: 2,
                first_block,
                displacement_m: Vec::new(),
                velocity_m_per_s: Vec::new(),
                tangential_force_n: Vec::new(),
                ..WindowRecord::default()
            }));
        }
        let run = collector.finish(false, None);
        assert_eq!((run.windows.len(), run.rupture_fields.len()), (1, 2));
        assert_eq!((run.windows[0].first_block, run.rupture_fields[0].first_block), (2, 1));
    }
}
