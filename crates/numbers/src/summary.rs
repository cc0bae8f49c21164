//! The summary: its keys, what they mean, in which unit, and behind `=` what each is computed of.

use asperity_record::Rupture;
use schemars::generate::SchemaSettings;
use serde_json::{Value, json};

use crate::convergence::Convergence;
use crate::estimate::line;
use crate::key::{Key, summary};
use crate::rupture_numbers as measures;
use crate::statistics::{mean, median};
use crate::summarizer::{Summarizer, finite, mean_of, median_of};

/// Declares the summary with the energies of the table.
macro_rules! with_energies {
    ($(
        $(#[doc = $shown:tt])+
        $name:ident: $_type:ty = $_about:literal [$class:ident $($_more:tt)*];
    )+) => {
summary! {
    /// The key numbers of a run.
    ///
    /// Numbers describe ruptures, except those with `event` in their names, which describe slip
    /// events. A rupture is wide if it spans four blocks or more. A precursor is a rupture that
    /// includes block 1, does not reach every block, and reaches farther than every rupture that
    /// includes block 1 and began before it. A rupture that reached every block, a global rupture, is
    /// never a precursor. A number that needs ruptures is null if the log does not determine them.
    pub struct Summary = |run: &Summarizer| {
        "The run" Robust {
            /// Name of its log, without the ending.
            run: String = run.name.clone(),
            /// Name of its scenario.
            scenario: String = run.header.scenario.clone(),
            /// `as-coded` or `as-stated`.
            parameter_set: String = run.header.parameter_set.clone(),
            /// How it ended: `complete`, `load-not-reached` (the load at which the drive was to stop),
            /// `interrupted`, `salvaged`, `stopped-energy`, `stopped-not-finite` or `stopped-stalled` (it could not
            /// continue); or `unknown`, if the log does not record it.
            status: String = run.status(),
            /// Number of blocks.
            blocks: u32 = run.header.blocks,
            /// Time step, s.
            time_step_s: f64 = run.header.time_step_s,
            /// Simulated time, s.
            simulated_s: f64 = run.simulated_s(),
            /// Longest time that two detachments of neighbours in one rupture may lie apart, s.
            link_time_s: Option<f64> = run.has_ruptures.then(|| run.header.scales.link_s()),
        }
        "First slip" AtDecayLength {
            /// Time at which a block first slides, s; null if none did.
            first_slip_s: Option<f64> = run.events.first.as_ref().map(|first| first.onset_s),
            /// `F_T / F_N` at that time; null, as are all such ratios, where the drive pulls both ways,
            /// so that `F_T` is a difference.
            first_slip_ft_fn: Option<f64> [unit = "1"] = run.ratio(run.events.first.as_ref().map(|first| first.ft_fn_onset)),
        }
        "First precursor" OneDraw {
            /// Onset of the first wide precursor, of four contacts or more, s; null if there is none. First slip and creep
            /// detach fewer.
            first_precursor_onset_s: Option<f64> = run.first_precursor().map(|first| first.onset_s),
            /// `F_T / F_N` at its onset.
            first_precursor_ft_fn: Option<f64> [unit = "1"] =
                run.ratio(run.first_precursor().map(|first| first.ft_fn_onset)),
            /// How many contacts slid in it.
            first_precursor_contacts: Option<u32> = run.first_precursor().map(Rupture::slipped),
        }
        "First slip of the whole slider" Robust {
            /// Onset of the first rupture that reached every block, s; null if there is none.
            first_global_rupture_onset_s: Option<f64> as OfTheMesh = run.global.first().map(|first| first.onset_s),
            /// Time at which the last block began to slide in it, s.
            first_global_rupture_last_block_s: Option<f64> as OfTheMesh = run.global.first().map(|first| first.arrival_s),
            /// Time at which its last block stopped, s; null if one still slid at the end of the run.
            first_global_rupture_end_s: Option<f64> as OfTheMesh = run.global.first().and_then(|first| first.end_s),
            /// `F_T / F_N` at its onset.
            first_global_rupture_ft_fn: Option<f64> [unit = "1"] =
                run.ratio(run.global.first().map(|first| first.ft_fn_onset)),
            /// The block that slid first in it.
            first_global_rupture_nucleation_block: Option<u32> as OneDraw =
                run.global.first().map(|first| first.nucleation_block),
            /// Speed of its front, m/s, on the side where it ran farther.
            first_global_rupture_front_speed_m_per_s: Option<f64> as OneDraw =
                run.global.first().and_then(|first| run.speed_m_per_s(first)),
            /// Onset of the first slip event in which every block slid, s. If creep joins this event
            /// to earlier slip, the onset is long before the slider slipped.
            first_global_event_onset_s: Option<f64> as OfTheMesh = run.events.first_global.as_ref().map(|first| first.onset_s),
            /// `F_T / F_N` at the onset of that event.
            first_global_event_ft_fn: Option<f64> [unit = "1"] =
                run.ratio(run.events.first_global.as_ref().map(|first| first.ft_fn_onset)),
            /// Number of ruptures that reached every block.
            global_rupture_count: Option<u64> as OfTheMesh = run.known(run.global.len() as u64),
        }
        "Precursors" OneDraw {
            /// Number of precursors, not counting the slip of the whole slider.
            precursor_count: Option<u64> = run.known(run.precursors().count() as u64).filter(|_| !run.is_in_medium),
            /// Length of the longest precursor over the length of the slider, `L_p / L`.
            longest_precursor_ratio: Option<f64> as OfTheMesh = run.lengths().last().copied(),
            /// Mean growth from one precursor to the next, in `L_p / L`; null if there are fewer than
            /// two.
            precursor_growth_ratio: Option<f64> =
                mean(run.lengths().windows(2).map(|pair| pair[1] - pair[0])),
            /// The length law that applies to the scenario: linear (5.57), tilted (5.22), initial-shear (5.52) or
            /// balance; null for slabs, sheets and bodies, for drives that
            /// pull both ways, where nothing drives, and where a prestress is no smaller than sliding friction,
            /// since nothing stops a front there.
            length_law: Option<String> as Robust = run.length_law.as_ref().map(|(law, _)| law.word().to_owned()),
            /// Slope of the least-squares line through the residuals of the precursors, `F_T / F_N` at
            /// the onset minus the law, against `L_p / L`; null if there are fewer than three.
            length_law_slope_residual: Option<f64> [unit = "1"] =
                line(&run.residuals()).map(|[slope, _]| slope.value),
            /// Intercept of that line.
            length_law_intercept_residual: Option<f64> [unit = "1"] =
                line(&run.residuals()).map(|[_, intercept]| intercept.value),
            /// Root mean square of these residuals.
            length_law_rms_residual: Option<f64> [unit = "1"] =
                mean(run.residuals().iter().map(|(_, residual)| residual * residual)).map(f64::sqrt),
        }
        "Recurrence of global ruptures" OneDraw {
            /// While the slider settles: of the times from one onset to the next, the first quarter (rounded up)
            /// counts; their median, s; null if there are fewer than two onsets.
            recurrence_transient_s: Option<f64> = run.transient_s(),
            /// After it has settled: median of the second half of these times, s; null if there are fewer
            /// than five onsets.
            recurrence_steady_s: Option<f64> = run.steady_s(),
        }
        "Loads" OfTheMesh {
            /// Largest `F_T / F_N` in any step record.
            largest_ft_fn: Option<f64> [unit = "1"] = run.ratio(run.largest_ft_fn),
            /// Mean fall of `F_T / F_N` from onset to end of a precursor.
            precursor_drop_ft_fn: Option<f64> [unit = "1"] =
                run.ratio(mean_of(run.precursors(), measures::drop_ft_fn)),
            /// Mean fall of `F_T / F_N` from onset to end of a global rupture.
            global_rupture_drop_ft_fn: Option<f64> [unit = "1"] =
                run.ratio(mean_of(&run.global, measures::drop_ft_fn)),
        }
        "Durations" OneDraw {
            /// Median time from onset to end of a precursor, s.
            precursor_duration_s: Option<f64> = median_of(run.precursors(), measures::duration_s),
            /// Median time from the onset of a precursor until the last of its blocks slides, s.
            precursor_crossing_s: Option<f64> =
                median_of(run.precursors(), |rupture| Some(measures::crossing_s(rupture))),
            /// Median time from onset to end of a global rupture, s.
            global_rupture_duration_s: Option<f64> = median_of(&run.global, measures::duration_s),
            /// Median time from the onset of a global rupture until the last block slides, s.
            global_rupture_crossing_s: Option<f64> as OfTheMesh =
                median_of(&run.global, |rupture| Some(measures::crossing_s(rupture))),
        }
        "Fronts" OfTheMesh {
            /// Median speed of the fronts of precursors and global ruptures, each on the side where it
            /// ran farther, m/s; ruptures of fewer than four blocks have no front speed.
            front_speed_m_per_s: Option<f64> = run.front_speed_m_per_s(),
            /// Median front speed of the precursors alone, m/s.
            precursor_front_speed_m_per_s: Option<f64> =
                median_of(run.precursors(), |rupture| run.speed_m_per_s(rupture)),
            /// Median front speed of the global ruptures alone, m/s.
            global_rupture_front_speed_m_per_s: Option<f64> =
                median_of(&run.global, |rupture| run.speed_m_per_s(rupture)),
            /// Speed of waves in the slider, m/s.
            wave_speed_m_per_s: Option<f64> as Robust = Some(run.wave_speed_m_per_s()),
            /// Median front speed of precursors and global ruptures over the wave speed.
            front_speed_over_wave_speed_ratio: Option<f64> =
                run.front_speed_m_per_s().and_then(|front| finite(front / run.wave_speed_m_per_s())),
            /// Relative error of these speeds, of either sign, due to the time step: an estimate, 0.4
            /// times the time step over the time in which a wave crosses a block; null by rate-and-state
            /// friction, whose solver chooses its steps.
            // With a state the solver chooses its steps.
            front_speed_error_ratio: Option<f64> =
                (run.front_speed_m_per_s().is_some() && !run.header.flags.state && run.header.sensors.is_none())
                    .then(|| run.header.scales.front_error(run.header.time_step_s)),
        }
        "Slip and force" OneDraw {
            /// Mean over the precursors of the mean size of the slip of their blocks, m.
            precursor_slip_m: Option<f64> as OfTheMesh = mean_of(run.precursors(), |rupture| rupture.mean_slip_m),
            /// Mean over the global ruptures of the mean size of the slip of their blocks, m.
            global_rupture_slip_m: Option<f64> as OfTheMesh = mean_of(&run.global, |rupture| rupture.mean_slip_m),
            /// Largest size of the slip of a block in one rupture, m.
            largest_slip_m: Option<f64> = run.largest_slip_m,
            /// Largest speed of a block in a slip event, m/s; null without any, and by laws without a state.
            peak_velocity_m_per_s: Option<f64> = run.peak_velocity_m_per_s,
            /// Mean over the precursors of their stress drop, the shear stress before less that after, mean over the
            /// contacts, Pa; null if none has one, as where ruptures overlap and where states were not recorded.
            precursor_stress_drop_pa: Option<f64> =
                run.over_area(mean_of(run.precursors(), |rupture| rupture.mean_shear_force_drop_n)),
            /// The same, of each precursor weighted by slip, Pa.
            precursor_weighted_stress_drop_pa: Option<f64> =
                run.over_area(mean_of(run.precursors(), |rupture| rupture.slip_weighted_shear_force_drop_n)),
            /// Mean over the global ruptures of their stress drop, Pa; null likewise.
            global_rupture_stress_drop_pa: Option<f64> =
                run.over_area(mean_of(&run.global, |rupture| rupture.mean_shear_force_drop_n)),
            /// The same, of each global rupture weighted by slip, Pa.
            global_rupture_weighted_stress_drop_pa: Option<f64> =
                run.over_area(mean_of(&run.global, |rupture| rupture.slip_weighted_shear_force_drop_n)),
            /// Mean over the precursors of their drop of strength, the mean fall of the tangential force on a block,
            /// without friction, from detachment to re-attachment, N.
            precursor_strength_drop_n: Option<f64> as OfTheMesh =
                mean_of(run.precursors(), |rupture| rupture.mean_strength_drop_n),
            /// Mean over the global ruptures of this drop of strength, N.
            global_rupture_strength_drop_n: Option<f64> as OfTheMesh =
                mean_of(&run.global, |rupture| rupture.mean_strength_drop_n),
            /// Mean moment of the global ruptures, N m.
            global_rupture_moment_n_m: Option<f64> as OfTheMesh = run.global_moment_n_m(),
        }
        "Magnitudes" OneDraw {
            /// Largest moment magnitude of a rupture, `(2/3) (log10 M_0 - 9.1)`.
            largest_magnitude: Option<f64> [unit = "1"] =
                run.magnitudes.all.iter().copied().max_by(f64::total_cmp),
            /// The completeness: the magnitude above which the law of Gutenberg and Richter is fitted and tested. With fewer
            /// than 51 magnitudes it is null, and so are the four numbers below.
            completeness_magnitude: Option<f64> [unit = "1"] =
                run.sizes.as_ref().map(|sizes| sizes.completeness),
            /// Number of magnitudes above the completeness.
            complete_rupture_count: Option<u64> = run.sizes.as_ref().map(|sizes| sizes.count as u64),
            /// `b` of these magnitudes by maximum likelihood; null if the law is rejected, if they span less than 1, or if all
            /// magnitudes may be normal.
            gutenberg_richter_b: Option<f64> [unit = "1"] =
                run.sizes.as_ref().and_then(|sizes| Some(sizes.b.ok()?.value)),
            /// Standard error of `b`, which contains the search for the completeness.
            gutenberg_richter_b_error: Option<f64> [unit = "1"] =
                run.sizes.as_ref().and_then(|sizes| Some(sizes.b.ok()?.error)),
            /// `b`, or why there is none, with the completeness, the number and the test.
            // Without commas, as cells of tables are.
            gutenberg_richter_test: Option<String> =
                run.sizes.as_ref().map(|sizes| sizes.words().replace(',', ";")),
            /// Radiated energy over the elastic energy released and the work of drive and prestress, summed over ruptures during
            /// which no other one slid.
            radiated_over_released_energy_ratio: Option<f64> = run.magnitudes.radiated_ratio(),
            /// Energy that these ruptures radiated, J; null where the ratio is. It is the kinetic energy that they added, and
            /// what dampers and the radiation of contacts took up.
            ruptures_radiated_j: Option<f64> =
                run.magnitudes.radiated_ratio().map(|_| run.magnitudes.radiated_j),
        }
        "Energy, from the start to the last record" OfTheMesh {
            $($(#[doc = $shown])+ $name: Option<f64> as $class = run.energy.and_then(|energy| energy.$name.into()),)+
            /// Mean heat of a precursor's contacts while it lasted, J; over precursors during which no
            /// other rupture slid.
            precursor_heat_j: Option<f64> = mean_of(run.precursors(), |rupture| rupture.friction_heat_j),
            /// Mean heat of a global rupture's contacts while it lasted, J; over global ruptures during
            /// which no other rupture slid.
            global_rupture_heat_j: Option<f64> as OneDraw = mean_of(&run.global, |rupture| rupture.friction_heat_j),
        }
        "Creep" OfTheMesh {
            /// Whether the slider creeps from its first block: the creep front reached both block 4 and a
            /// tenth of the slider.
            creeps: Option<bool> = run.has_ruptures.then(|| run.creeps()),
            /// The creep front: the farthest block that had slid, together with all blocks before it,
            /// when the first wide rupture with block 1 began, or, without one, at the end of the run;
            /// null if block 1 had not slid.
            creep_front_block: Option<u32> = run.creep_front_block().filter(|_| run.has_ruptures),
            /// Share of the time before the first global rupture, or of the whole run without one,
            /// in which some block slid.
            sliding_time_ratio: Option<f64> =
                run.sliding_time_ratio(),
            /// Share of the displacement of the blocks, from the first record to the last, that is no slip of a
            /// rupture; null by laws without a state, where not every block has the same drive spring, where a block
            /// still slid at the end, and in logs that are incomplete or salvaged.
            creep_ratio: Option<f64> as OneDraw = run.creep_ratio(),
        }
        "Slip events" OneDraw {
            /// Whether slip events mislead: the longest lasts more than twenty times as long as both
            /// the longest crossing of a wide rupture and the passage of a wave along the slider; or more
            /// than a quarter of the events of four blocks or more contain several wide ruptures.
            events_mislead: Option<bool> = run.has_ruptures.then(|| run.events_mislead()),
            /// Number of slip events.
            event_count: u64 = run.events.steps.spans.len() as u64,
            /// Number of slip events in which every block slid.
            global_event_count: u64 = run.events.global,
            /// Duration of the longest slip event, s; an event that did not end counts up to the end
            /// of the run.
            longest_event_s: Option<f64> = run.longest_event_s(),
            /// Number of slip events of four blocks or more.
            wide_event_count: u64 as OfTheMesh = run.events.wide_count(),
            /// Number of slip events of four blocks or more in which more than one wide rupture
            /// began.
            joined_event_count: Option<u64> as OfTheMesh = run.known(run.events.joined_count()),
        }
        "Contacts without load" OneDraw {
            /// Steps in which a contact of a slab or a body had lifted off, summed over the contacts; null
            /// in logs that are incomplete.
            // A log that counts them omits a count of zero.
            contact_steps_in_air: Option<u64> =
                run.solver("contact_steps_in_air").or(run.end.as_ref().map(|_| 0)),
            /// Number of contacts that detached without load, at a threshold of 0, because they bore
            /// nothing or have no static friction.
            unloaded_contact_count: u64 as OfTheMesh = run.unloaded.counts()[0],
            /// Number of detachments without load of these contacts.
            unloaded_detachment_count: u64 = run.unloaded.counts()[1],
            /// Number of slip events in which no contact with load detached.
            unloaded_event_count: u64 = run.unloaded.counts()[2],
        }
        "Counts" OfTheMesh {
            /// Number of ruptures, of any size.
            rupture_count: Option<u64> = run.known(run.ruptures),
            /// Number of wide ruptures.
            wide_rupture_count: Option<u64> = run.known(run.wide),
            /// Number of ruptures during which another one slid.
            overlapping_rupture_count: Option<u64> = run.known(run.overlapping),
            /// Number of ruptures that a further detachment could still have joined when the run ended.
            open_rupture_count: Option<u64> as OneDraw = run.known(run.open),
            /// Number of block switches.
            switch_count: u64 = run.switches,
            /// Number of detachments.
            detachment_count: u64 = run.detachments,
            /// The last step.
            last_step: u64 = run.last_step,
            /// Number of step records.
            step_record_count: u64 = run.records,
            /// Number of steps that the solver computed one by one; null, as are the numbers below, if
            /// the log does not record it.
            plain_steps: Option<u64> = run.solver("plain_steps"),
            /// Number of steps that the solver covered in windows.
            window_steps: Option<u64> = run.solver("window_steps"),
            /// Number of windows.
            windows: Option<u64> = run.solver("windows"),
            /// Number of steps that the solver covered in jumps.
            jump_steps: Option<u64> = run.solver("jump_steps"),
            /// Number of jumps.
            jumps: Option<u64> = run.solver("jumps"),
        }
    }
    /// Numbers that only recordings have; none of a run.
    of_recording: Option<OfRecording> = run.header.sensors.as_ref().map(|_| OfRecording::of(run)),
}
    };
}

asperity_record::energies!(shown with_energies);

summary! {
    /// The numbers that a recording has beside those of a run, of which it has only those that it measures.
    pub struct OfRecording = |run: &Summarizer| {
        "Load drops" Robust {
            /// Number of load drops, sudden falls of the tangential force; null where that was not recorded.
            load_drop_count: Option<u64> = (!run.lacks_ft).then_some(run.drops.len() as u64),
            /// Median size of a load drop, N; null if there is none.
            median_load_drop_n: Option<f64> = median(run.drops.iter().map(|drop| drop.drop_n)),
            /// Median time from one load drop to the next, s; null if there are fewer than two.
            median_load_drop_recurrence_s: Option<f64> = median(run.drops.iter().filter_map(|drop| drop.recurrence_s)),
        }
    }
}

/// What no recording has, though it is counted; behind the first what those without an array lack.
const LACKED: [&str; 5] = ["Contacts without load", "Fronts", "Creep", "Slip events", "Counts"];

/// The classes of its numbers in its JSON.
const CONVERGENCE: &str = "convergence";

impl Summary {
    /// The JSON schema of a summary: every key with its meaning. Recordings leave some out, and have others.
    pub fn schema() -> Value {
        let generator = || SchemaSettings::draft2020_12().for_serialize().into_generator();
        let mut schema = generator().into_root_schema_for::<Summary>().to_value();
        let others = generator().into_root_schema_for::<OfRecording>().to_value();
        for (name, about) in others["properties"].as_object().expect("they are properties") {
            schema["properties"][name] = about.clone();
        }
        let of_all = Summary::KEYS.iter().filter(|key| key.group == Summary::KEYS[0].group);
        schema["required"] = of_all.map(|key| &*key.column.name).collect();
        let words: Vec<&str> = Convergence::ALL.iter().map(|(_, word, ..)| *word).collect();
        let about = "Numbers that are not robust, with their class (docs/findings.md).";
        schema["properties"][CONVERGENCE] =
            json!({"type": "object", "description": about, "additionalProperties": {"enum": words}});
        schema
    }

    /// It as JSON for other programs, with the class of each number of a run that is not robust.
    pub fn to_json(&self) -> Value {
        let named = |(key, value): (&Key, Value)| (key.column.name.to_string(), value);
        let mut all: Value = self.shown().into_iter().map(named).collect();
        if self.of_recording.is_none() {
            let classes = Summary::KEYS.iter().filter(|key| key.convergence != Convergence::Robust);
            all[CONVERGENCE] =
                classes.map(|key| (key.column.name.to_string(), key.convergence.word())).collect();
        }
        all
    }

    /// The keys to show, with their values: of a run all, of a recording those that it determines.
    pub fn shown(&self) -> Vec<(&'static Key, Value)> {
        let all = Summary::KEYS.iter().zip(self.values());
        let Some(of_recording) = &self.of_recording else { return all.collect() };
        let lacked = if self.rupture_count.is_none() { &LACKED[..] } else { &LACKED[..1] };
        let is_shown = |(Key { group, .. }, value): &(&Key, Value)| {
            *group == Summary::KEYS[0].group || !value.is_null() && !lacked.contains(group)
        };
        all.filter(is_shown).chain(OfRecording::KEYS.iter().zip(of_recording.values())).collect()
    }

    /// The number of the key at a place, or 1 for a flag that is set.
    pub(crate) fn number(&self, place: usize) -> Option<f64> {
        let value = &self.values()[place];
        value.as_f64().or_else(|| value.as_bool().map(|flag| f64::from(u8::from(flag))))
    }

    /// The row of a table: the values as JSON spells them, texts without their quotation marks, and
    /// nothing for null; behind them those that only recordings have.
    pub fn row(&self) -> Vec<String> {
        let text = |value: Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text,
            other => other.to_string(),
        };
        let others = self.of_recording.iter().flat_map(OfRecording::values);
        self.values().into_iter().chain(others).map(text).collect()
    }
}
