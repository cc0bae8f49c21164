//! The summary: its keys, what they mean and in which unit.

use asperity_record::RunEnd;
use schemars::generate::SchemaSettings;
use serde_json::Value;

use crate::key::summary;

summary! {
    /// The key numbers of a run.
    ///
    /// Numbers describe ruptures, except those with `event` in their names, which describe raw slip
    /// events. A rupture is wide if it spans four blocks or more. A precursor is a rupture that
    /// includes block 1, does not reach every block, and reaches farther than every rupture that
    /// includes block 1 and began before it. A rupture that reached every block, a global rupture, is
    /// never a precursor. A number that needs ruptures is null if the log does not determine them.
    pub struct Summary {
        "The run" {
            /// Name of its log, without the ending.
            run: String,
            /// Name of its scenario.
            scenario: String,
            /// `as-coded` or `as-stated`.
            parameter_set: String,
            /// How it ended: `complete`, `load-not-reached` (the load at which the drive was to stop),
            /// `interrupted`, `salvaged`, `stopped-energy`, `stopped-not-finite` or `stopped-stalled` (it could not
            /// continue); or `unknown`, if the log does not record it.
            status: String,
            /// Number of blocks.
            blocks: u32,
            /// Time step, s.
            time_step_s: f64,
            /// Simulated time, s.
            simulated_s: f64,
            /// Longest time that two detachments of neighbours in one rupture may lie apart, s.
            link_time_s: Option<f64>,
        }
        "First slip" {
            /// Time at which a block first slides, s; null if none did.
            first_slip_s: Option<f64>,
            /// `F_T / F_N` at that time; null, as are all such ratios, where the drive pulls both ways,
            /// so that `F_T` is a difference.
            first_slip_ft_fn: Option<f64> [unit = "1"],
        }
        "First slip of the whole slider" {
            /// Onset of the first rupture that reached every block, s; null if there is none.
            first_global_rupture_onset_s: Option<f64>,
            /// Time at which the last block began to slide in it, s.
            first_global_rupture_last_block_s: Option<f64>,
            /// Time at which its last block stopped, s; null if one still slid at the end of the run.
            first_global_rupture_end_s: Option<f64>,
            /// `F_T / F_N` at its onset.
            first_global_rupture_ft_fn: Option<f64> [unit = "1"],
            /// The block that slid first in it.
            first_global_rupture_nucleation_block: Option<u32>,
            /// Speed of its front, m/s, on the side where it ran farther.
            first_global_rupture_front_speed_m_per_s: Option<f64>,
            /// Onset of the first raw slip event in which every block slid, s. If creep joins this event
            /// to earlier slip, the onset is long before the slider slipped.
            first_global_event_onset_s: Option<f64>,
            /// `F_T / F_N` at the onset of that event.
            first_global_event_ft_fn: Option<f64> [unit = "1"],
            /// Number of ruptures that reached every block.
            global_rupture_count: Option<u64>,
        }
        "Precursors" {
            /// Number of precursors, not counting the slip of the whole slider.
            precursor_count: Option<u64>,
            /// Length of the longest precursor over the length of the slider, `L_p / L`.
            longest_precursor_ratio: Option<f64>,
            /// Mean growth from one precursor to the next, in `L_p / L`; null if there are fewer than
            /// two.
            precursor_growth_ratio: Option<f64>,
            /// The length law that applies to the scenario; null for slabs, sheets and bodies, for drives that
            /// pull both ways, where nothing drives, and where a prestress is no smaller than sliding friction,
            /// since nothing stops a front there.
            length_law: Option<String>,
            /// Slope of the least-squares line through the residuals of the precursors, `F_T / F_N` at
            /// the onset minus the law, against `L_p / L`; null if there are fewer than three.
            length_law_slope_residual: Option<f64> [unit = "1"],
            /// Intercept of that line.
            length_law_intercept_residual: Option<f64> [unit = "1"],
            /// Root mean square of these residuals.
            length_law_rms_residual: Option<f64> [unit = "1"],
        }
        "Recurrence of global ruptures" {
            /// While the slider settles: median of the first quarter (rounded up) of the times from one
            /// onset to the next, s; null if there are fewer than two onsets.
            recurrence_transient_s: Option<f64>,
            /// After it has settled: median of the second half of these times, s; null if there are fewer
            /// than five onsets.
            recurrence_steady_s: Option<f64>,
        }
        "Loads" {
            /// Largest `F_T / F_N` in any step record.
            largest_ft_fn: Option<f64> [unit = "1"],
            /// Mean fall of `F_T / F_N` from onset to end of a precursor.
            precursor_drop_ft_fn: Option<f64> [unit = "1"],
            /// Mean fall of `F_T / F_N` from onset to end of a global rupture.
            global_rupture_drop_ft_fn: Option<f64> [unit = "1"],
        }
        "Durations" {
            /// Median time from onset to end of a precursor, s.
            precursor_duration_s: Option<f64>,
            /// Median time from the onset of a precursor until the last of its blocks slides, s.
            precursor_crossing_s: Option<f64>,
            /// Median time from onset to end of a global rupture, s.
            global_rupture_duration_s: Option<f64>,
            /// Median time from the onset of a global rupture until the last block slides, s.
            global_rupture_crossing_s: Option<f64>,
        }
        "Fronts" {
            /// Median speed of the fronts of precursors and global ruptures, each on the side where it
            /// ran farther, m/s; ruptures of fewer than four blocks have no front speed.
            front_speed_m_per_s: Option<f64>,
            /// Median front speed of the precursors alone, m/s.
            precursor_front_speed_m_per_s: Option<f64>,
            /// Median front speed of the global ruptures alone, m/s.
            global_rupture_front_speed_m_per_s: Option<f64>,
            /// Speed of waves in the slider, m/s.
            wave_speed_m_per_s: Option<f64>,
            /// Median front speed of precursors and global ruptures over the wave speed.
            front_speed_over_wave_speed_ratio: Option<f64>,
            /// Relative error of these speeds, of either sign, due to the time step: an estimate, 0.4
            /// times the time step over the time in which a wave crosses a block; null by rate-and-state
            /// friction, whose solver chooses its steps.
            front_speed_error_ratio: Option<f64>,
        }
        "Slip and force" {
            /// Mean over the precursors of the mean size of the slip of their blocks, m.
            precursor_slip_m: Option<f64>,
            /// Mean over the global ruptures of the mean size of the slip of their blocks, m.
            global_rupture_slip_m: Option<f64>,
            /// Largest size of the slip of a block in one rupture, m.
            largest_slip_m: Option<f64>,
            /// Largest speed of a block in a raw slip event, m/s; null without any, and by laws without a state.
            peak_velocity_m_per_s: Option<f64>,
            /// Mean over the precursors of their stress drop, the shear stress before less that after, mean over the
            /// contacts, Pa; null if none has one, as where ruptures overlap and where states were not recorded.
            precursor_stress_drop_pa: Option<f64>,
            /// The same, of each precursor weighted by slip, Pa.
            precursor_weighted_stress_drop_pa: Option<f64>,
            /// Mean over the global ruptures of their stress drop, Pa; null likewise.
            global_rupture_stress_drop_pa: Option<f64>,
            /// The same, of each global rupture weighted by slip, Pa.
            global_rupture_weighted_stress_drop_pa: Option<f64>,
            /// Mean over the precursors of their drop of strength, the mean fall of the tangential force on a block,
            /// without friction, from detachment to re-attachment, N.
            precursor_strength_drop_n: Option<f64>,
            /// Mean over the global ruptures of this drop of strength, N.
            global_rupture_strength_drop_n: Option<f64>,
            /// Mean moment of the global ruptures, N m.
            global_rupture_moment_n_m: Option<f64>,
        }
        "Magnitudes" {
            /// Largest moment magnitude of a rupture, `(2/3) (log10 M_0 - 9.1)`.
            largest_magnitude: Option<f64> [unit = "1"],
            /// The completeness, the magnitude above which the law of Gutenberg and Richter fits best and is tested; null, as are
            /// the four below, of fewer than 51 magnitudes.
            completeness_magnitude: Option<f64> [unit = "1"],
            /// Number of magnitudes above the completeness.
            complete_rupture_count: Option<u64>,
            /// `b` of these magnitudes by maximum likelihood; null if the law is rejected, if they span less than 1, or if all
            /// magnitudes may be normal.
            gutenberg_richter_b: Option<f64> [unit = "1"],
            /// Standard error of `b`, which contains the search for the completeness.
            gutenberg_richter_b_error: Option<f64> [unit = "1"],
            /// `b`, or why there is none, with the completeness, the number and the test.
            gutenberg_richter_test: Option<String>,
            /// Radiated energy over the elastic energy released and the work of drive and prestress, summed over ruptures during
            /// which no other one slid.
            radiated_over_released_energy_ratio: Option<f64>,
        }
        "Energy, from the start to the last record" {
            /// Work of the drive points on the drive springs, J; null, as are all energies, in logs
            /// without step records.
            drive_work_j: Option<f64>,
            /// Work of the prestress, J.
            prestress_work_j: Option<f64>,
            /// Heat of sliding contacts, J.
            friction_heat_j: Option<f64>,
            /// Work of radiation damping on sliding contacts, J; null in runs without radiation.
            radiated_j: Option<f64>,
            /// Energy that friction springs stored when blocks re-attached, less the energy that they
            /// lost when blocks detached, J.
            anchor_change_j: Option<f64>,
            /// Work of the dampers between blocks, J.
            viscous_loss_j: Option<f64>,
            /// Kinetic energy at the end, J.
            kinetic_j: Option<f64>,
            /// Energy of all springs at the end, J.
            elastic_j: Option<f64>,
            /// Energy added by the finite time step, the scheme work, J.
            scheme_work_j: Option<f64>,
            /// Mean heat of a precursor's contacts while it lasted, J; over precursors during which no
            /// other rupture slid.
            precursor_heat_j: Option<f64>,
            /// Mean heat of a global rupture's contacts while it lasted, J; over global ruptures during
            /// which no other rupture slid.
            global_rupture_heat_j: Option<f64>,
        }
        "Creep" {
            /// Whether the slider creeps from its first block: the creep front reached both block 4 and a
            /// tenth of the slider.
            creeps: Option<bool>,
            /// The creep front: the farthest block that had slid, together with all blocks before it,
            /// when the first wide rupture with block 1 began, or, without one, at the end of the run;
            /// null if block 1 had not slid.
            creep_front_block: Option<u32>,
            /// Share of the time before the first global rupture, or of the whole run without one,
            /// in which some block slid.
            sliding_time_ratio: Option<f64>,
            /// Share of the displacement of the blocks, from the first record to the last, that is no slip of a
            /// rupture; null by laws without a state, where not every block has the same drive spring, where a block
            /// still slid at the end, and in logs that are incomplete or salvaged.
            creep_ratio: Option<f64>,
        }
        "Raw slip events" {
            /// Whether raw slip events mislead: the longest lasts more than twenty times as long as both
            /// the longest crossing of a wide rupture and the passage of a wave along the slider; or more
            /// than a quarter of the events of four blocks or more contain several wide ruptures.
            raw_events_mislead: Option<bool>,
            /// Number of raw slip events.
            event_count: u64,
            /// Number of raw slip events in which every block slid.
            global_event_count: u64,
            /// Duration of the longest raw slip event, s; an event that did not end counts up to the end
            /// of the run.
            longest_event_s: Option<f64>,
            /// Number of raw slip events of four blocks or more.
            wide_event_count: u64,
            /// Number of raw slip events of four blocks or more in which more than one wide rupture
            /// began.
            joined_event_count: Option<u64>,
        }
        "Contacts without load" {
            /// Steps in which a contact of a slab or a body had lifted off, summed over the contacts; null
            /// in logs that are incomplete.
            contact_steps_in_air: Option<u64>,
            /// Number of contacts that detached without load, at a threshold of 0, because they bore
            /// nothing or have no static friction.
            unloaded_contact_count: u64,
            /// Number of detachments without load of these contacts.
            unloaded_detachment_count: u64,
            /// Number of raw slip events in which no contact with load detached.
            unloaded_event_count: u64,
        }
        "Counts" {
            /// Number of ruptures, of any size.
            rupture_count: Option<u64>,
            /// Number of wide ruptures.
            wide_rupture_count: Option<u64>,
            /// Number of ruptures during which another one slid.
            overlapping_rupture_count: Option<u64>,
            /// Number of ruptures that a further detachment could still have joined when the run ended.
            open_rupture_count: Option<u64>,
            /// Number of block switches.
            switch_count: u64,
            /// Number of detachments.
            detachment_count: u64,
            /// The last step.
            last_step: u64,
            /// Number of step records.
            step_record_count: u64,
            /// Number of steps that the solver computed one by one; null, as are the numbers below, if
            /// the log does not record it.
            plain_steps: Option<u64>,
            /// Number of steps that the solver covered in windows.
            window_steps: Option<u64>,
            /// Number of windows.
            windows: Option<u64>,
            /// Number of steps that the solver covered in jumps.
            jump_steps: Option<u64>,
            /// Number of jumps.
            jumps: Option<u64>,
        }
    }
}

impl Summary {
    /// The JSON schema of a summary: every key with its meaning.
    pub fn schema() -> Value {
        // As it is written: no key is left out.
        let generator = SchemaSettings::draft2020_12().for_serialize().into_generator();
        generator.into_root_schema_for::<Summary>().to_value()
    }

    /// The row of a table: the values as JSON spells them, texts without their quotation marks, and
    /// nothing for null.
    pub fn row(&self) -> Vec<String> {
        let text = |value: Value| match value {
            Value::Null => String::new(),
            Value::String(text) => text,
            other => other.to_string(),
        };
        self.values().into_iter().map(text).collect()
    }
}

/// How a run ended, in the word of its log.
pub(crate) fn status(end: Option<&RunEnd>) -> String {
    let word = end.and_then(|end| serde_json::to_value(end.status).ok());
    word.as_ref().and_then(Value::as_str).unwrap_or("unknown").to_owned()
}
