//! The inputs of tables, figures and numbers, collected from the records of a run, live or from its log.
//!
//! A run has far more records than its outputs need. [`Collector`] reads each once and keeps the data named
//! by [`RequiredData`], in a form without unused fields.

use std::ops::{Deref, DerefMut};

use asperity_model::{NodeState, Plan, Scenario};
use asperity_record::{
    Arrival, Direction, Event, FieldRecord, Observer, Record, RunEnd, RunHeader, Rupture, SlipEvent,
    StepRecord, WindowRecord,
};

use crate::required_data::{Film, RequiredData};
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
    /// Slip events, in order.
    pub slips: Vec<SlipEvent>,
    /// Ruptures, in the order in which they became certain, as in the log; none of a log by other
    /// detectors.
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
        let text = self.scenario.to_commented_toml();
        let scenario: toml::Table = toml::from_str(&text).map_err(|error| error.to_string())?;
        let mut value = Some(toml::Value::Table(scenario));
        for part in key.split('.') {
            value = value.and_then(|value| value.get(part).cloned());
        }
        let number =
            value.and_then(|value| value.as_float().or_else(|| value.as_integer().map(|count| count as f64)));
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

    /// The slip event in which a rupture began.
    pub fn event_of(&self, rupture: &Rupture) -> Option<&SlipEvent> {
        let after = self.slips.partition_point(|slip| slip.onset_step <= rupture.onset_step);
        let slip = self.slips.get(after.checked_sub(1)?)?;
        slip.end_step.is_none_or(|end| rupture.onset_step < end).then_some(slip)
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
}

impl Collector {
    /// For a run that is about to go by.
    pub fn new(name: &str, header: RunHeader, scenario: Scenario, required: RequiredData) -> Collector {
        let plan = Plan::new(&scenario);
        let states = States::new(header.blocks, &required);
        let summarizer = Summarizer::new(name, &header, Some(&scenario));
        let run = RunEvents {
            name: name.to_owned(),
            switches: vec![None; header.blocks as usize],
            header,
            scenario,
            plan,
            summary: Summary::default(),
            slips: Vec::new(),
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
        };
        Collector { run, summarizer }
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
        if scenario.hash() != header.scenario_hash {
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
        // Of a rupture that the run lacks the figure says so.
        let of = |films: &[Film]| films.iter().filter_map(|film| film.times_s(run).ok()).flatten().collect();
        let mut all: Vec<f64> = of(&kept.velocities);
        if run.plan.elastic.as_chain().is_none() {
            all.extend(kept.nodes_at_s.iter().copied().chain(of(&kept.films)));
        }
        all
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
        let Collector { mut run, summarizer } = self;
        run.states.end();
        if !has_ruptures {
            run.ruptures = None;
        }
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
            Record::Window(_) | Record::Row(_) => {}
        }
    }

    fn event(&mut self, event: &Event) {
        self.summarizer.event(event);
        if let Some(slip) = event.get::<SlipEvent>() {
            self.run.states.slip(slip);
            self.run.slips.push(slip.clone());
        } else if let Some(rupture) = event.get::<Rupture>() {
            self.run.ruptures.get_or_insert_default().push(rupture.clone());
        } else if let Some(arrival) = event.get::<Arrival>().filter(|_| self.run.kept.arrivals) {
            self.run.arrivals.push(arrival.clone());
        }
    }
}

#[cfg(test)]
mod tests {
    use asperity_record::{Direction, FieldRecord, Observer, Record, StepRecord, WindowRecord};
    use asperity_testkit::{quiet_step, slip_event, switch};

    use super::Collector;
    use crate::made_up;
    use crate::required_data::RequiredData;
    use crate::states::States;

    #[test]
    fn of_switches_there_stay_the_first_and_the_last_of_each_block() {
        let run = made_up::run("", &[(100, 101, &[1]), (200, 201, &[1, 3]), (300, 301, &[1])]);
        let [first, last] = run.switches[0].unwrap();
        assert_eq!((first.step, last.step, last.direction), (99, 299, Direction::Detach));
        assert_eq!(run.switches[1], None);
        assert_eq!(run.detachments().unwrap(), [(99, 1), (199, 1), (199, 3), (299, 1)]);
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

    fn state(step: u64, displacement_m: f64) -> FieldRecord {
        FieldRecord {
            step,
            time_s: step as f64,
            displacement_m: vec![displacement_m; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![0.0; 3],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        }
    }

    /// However many events there are, no more states stay than there are precursors, whether an
    /// event arrives before the state at its end or after it.
    #[test]
    fn states_at_the_first_onset_and_at_ends_of_precursors_stay() {
        for event_first in [false, true] {
            let mut states = States::new(
                3,
                &(RequiredData { states_near_s: vec![24.6], ..RequiredData::STATES } | RequiredData::NOTHING),
            );
            states.state(&state(0, -2.0));
            for event in 0..1000u64 {
                let (onset, end) = (10 * event + 2, 10 * event + 5);
                let step = |step: u64, sliding| StepRecord {
                    sliding,
                    switches: vec![switch(1, Direction::Detach)],
                    ..quiet_step(step, step as f64, 0.0)
                };
                // Event 1 has one more block, event 500 all three.
                let last = if event >= 500 { 3 } else { 1 + event.min(1) as u32 };
                let slip = slip_event(onset, end, 1..=last);
                states.step(&step(onset, 1));
                states.state(&state(onset, 0.0));
                states.state(&state(onset + 1, 0.5));
                states.step(&step(end, 0));
                if event_first {
                    states.slip(&slip);
                }
                states.state(&state(end, 0.0));
                if !event_first {
                    states.slip(&slip);
                }
            }
            states.end();
            assert_eq!(states.first().unwrap().displacement_m[0], -2.0);
            assert_eq!(states.at_first_onset().unwrap().step, 2);
            let kept: Vec<u64> =
                (0..10_010).filter(|step| states.at_precursor_end(*step).is_some()).collect();
            assert_eq!(kept, [5, 15, 5005]);
            assert_eq!(states.largest_displacement_m, Some(0.5));
            assert_eq!(states.near(24.6).unwrap().step, 25);
        }
    }
}
