//! Ruptures, and how each passed the blocks. Defined here rather than beside the detectors that emit
//! them, because the analysis does not link detectors.

use crate::{BoundingBox, Reach, magnitude, payload};

payload! {
    topic: "/events/rupture",
    table: "ruptures" [derive = Default],
    /// A connected set of detachments in space and time: two are linked if their blocks are the
    /// same or neighbours, and no more than `t_link` lies between them.
    ///
    /// Times are as in slip events: that at which a block arrives is the first step in which it
    /// slides, that at which it stops the first in which it does not.
    pub struct Rupture {
        /// Number of the rupture in its run, counted from 0, in the order in which they became
        /// certain.
        pub rupture: u64 [role = Number],
        /// Time of the first step in which a block slides, s.
        pub onset_s: f64 [role = Time],
        /// Time of the first step after the last one in which one of its blocks slid, s; null if
        /// one still slid at the end of the run.
        pub end_s: Option<f64> [role = Time],
        /// Lowest-numbered block.
        pub first_block: u32 [role = Place] [area = "First column of its contacts."],
        /// Highest-numbered block. All between the two have slid.
        pub last_block: u32 [role = Place] [area = "Last column of its contacts."],
        /// The block that slid first; of several, the lowest-numbered.
        pub nucleation_block: u32 [role = Place],
        /// Whether every block of the slider slid: a global slip.
        pub reached_every_block: bool,
        /// `F_T / F_N` in the step after which the first block slid.
        pub ft_fn_onset: f64 [role = Load],
        /// `F_T / F_N` in the step after which the front had come to all of its blocks.
        pub ft_fn_arrival: f64 [role = Load],
        /// `F_T / F_N` in the last step in which one of its blocks slid; null if one still slid at
        /// the end of the run.
        pub ft_fn_end: Option<f64> [role = Load],
        /// First step in which a block slides.
        pub onset_step: u64 [role = Step],
        /// Time of the first step by which all of its blocks have slid, s.
        pub arrival_s: f64 [role = Time],
        /// First step after the last one in which one of its blocks slid; null if a block still slid at the end of the run.
        pub end_step: Option<u64> [role = Step],
        /// How many detachments it has: as many as blocks, unless blocks slid more than once.
        pub detachments: u64,
        /// Speed of the front towards higher-numbered blocks, m/s; null where it passed fewer than
        /// four blocks, or had no one direction.
        pub front_speed_up_m_per_s: Option<f64> [role = Speed] [area = "Speed of the front along x towards higher columns, from the column of nucleation on, by pairs of contacts of the same row, m/s; null where no row has four contacts there, or the front had no one direction."],
        /// Speed of the front towards lower-numbered blocks, m/s; null as for the other.
        pub front_speed_down_m_per_s: Option<f64> [role = Speed] [area = "Speed of the front along x towards lower columns, m/s; null as for the other."],
        /// Mean size of the slip of its blocks, whichever way they slid, m; null if one still slid at the end of the run.
        pub mean_slip_m: Option<f64> [area = "Mean size of the slip of its contacts, a vector, m; null if one still slid at the end of the run."],
        /// Largest size of the slip of a block, m; null if one still slid at the end of the run.
        pub largest_slip_m: Option<f64> [area = "Largest size of the slip of a contact, m; null if one still slid at the end of the run."],
        /// Potency over the width of the slider: the sum of the sizes of slip times block length, m2; null if a
        /// block still slid at the end of the run.
        pub potency_m2: Option<f64> [area = "Null; see `potency_m3`."],
        /// Moment: slip times slipped area times elastic modulus, `E L_y a` times the sum of the sizes
        /// of slip, N m; of a slab with its shear modulus, `3 E / 8`; in a medium with its shear modulus, per metre of
        /// strike. Null as the potency.
        pub moment_n_m: Option<f64> [area = "Shear modulus times the potency, N m; null as the potency."],
        /// Strength before less resistance after: mean fall of the tangential force on a block, without friction,
        /// from its detachment to its re-attachment, in the direction of that force at the detachment, N; null if one
        /// still slid at the end of the run.
        pub mean_strength_drop_n: Option<f64> [area = "Strength before less resistance after: mean fall of the size of the tangential force on a contact, without friction, from its detachment to its re-attachment, N; null if one still slid at the end of the run."],
        /// Highest-numbered block that had slid before, in the whole run; null if none had. In a
        /// slider that creeps from its first block this is the creep front.
        pub farthest_block_before: Option<u32> [role = Place] [area = "Farthest column in which a contact had slid before, in the whole run; null if none had."],
        /// Whether another rupture slid at the same time.
        pub overlapping: bool,
        /// Whether the run ended before it was certain that no detachment belongs to it any more.
        pub open: bool [role = Edge],
        /// Work of the drive points in the steps from the first to the last one in which a block
        /// slid, J; this and the other energies, but for the anchor change, are null where another
        /// rupture slid at the same time, and where the run ended before it was certain.
        pub drive_work_j: Option<f64>,
        /// Work of the prestress, J.
        pub prestress_work_j: Option<f64>,
        /// What sliding contacts turned into heat, J.
        pub friction_heat_j: Option<f64>,
        /// What the friction springs of its blocks held when they took hold again, less what they
        /// lost when they let go, J, summed over all of its switches, so that all ruptures add up
        /// to the total of the run.
        pub anchor_change_j: Option<f64>,
        /// What the dampers between blocks took up, J.
        pub viscous_loss_j: Option<f64>,
        /// Change of the kinetic energy, J.
        pub kinetic_change_j: Option<f64>,
        /// Change of the energy of all springs, from just before its first switch to just after its
        /// last, J.
        pub elastic_change_j: Option<f64>,
        /// What the time step itself added, J.
        pub scheme_work_j: Option<f64>,
        /// Stress before less stress after, times the area of a contact: mean over its blocks of the shear force
        /// in the state at its onset less that in the state at its end, in the direction of the force at the
        /// detachment, N; null where another rupture slid at the same time, where the run ended before it was
        /// certain, and where one of the states was not recorded.
        pub mean_shear_force_drop_n: Option<f64>,
        /// The same, weighted by the size of slip, N; null without any slip too.
        pub slip_weighted_shear_force_drop_n: Option<f64>,
    }
    only Area {
        /// First row of its contacts.
        pub first_across: Option<u32> [role = Place],
        /// Last row of its contacts.
        pub last_across: Option<u32> [role = Place],
        /// How many contacts slid.
        pub contacts: Option<u32> [role = Place],
        /// Potency: the sum of the sizes of slip times the area of a contact, `a^2`, m3; null if a contact
        /// still slid at the end of the run.
        pub potency_m3: Option<f64>,
    }
    only Radiation {
        /// What sliding contacts radiated, J; null as the other energies.
        pub radiated_j: Option<f64>,
    }
    only Recording {
        /// Standard error of the onset, s.
        pub onset_error_s: Option<f64>,
        /// How far the rupture came, m from the driven end: midway between the last sensor that it reached and the
        /// next one, or the end.
        pub length_m: Option<f64>,
        /// Standard error of that, m.
        pub length_error_m: Option<f64>,
        /// Standard error of the speed towards higher-numbered sensors, m/s; null where that is.
        pub front_speed_up_error_m_per_s: Option<f64>,
        /// Standard error of the speed towards lower-numbered sensors, m/s; null where that is.
        pub front_speed_down_error_m_per_s: Option<f64>,
        /// Standard error of `F_T / F_N` at the onset; null where it is unknown.
        pub ft_fn_error: Option<f64>,
    }
}

impl Rupture {
    /// The range of blocks of the rupture, or of columns. In a single row all blocks of it have slid.
    pub fn reach(&self) -> Reach {
        Reach { first: self.first_block, last: self.last_block }
    }

    /// The box of columns and rows of the rupture.
    pub fn bounding_box(&self) -> BoundingBox {
        BoundingBox::new(self.reach(), self.first_across, self.last_across)
    }

    /// How many blocks or contacts have slid.
    pub fn slipped(&self) -> u32 {
        self.contacts.unwrap_or_else(|| self.reach().count())
    }
}

payload! {
    topic: "/events/arrival",
    table: "arrivals" [derive = Default],
    /// How a rupture passed a block: when its front came, when the block stopped, how far it slid.
    pub struct Arrival {
        /// Number of the rupture.
        pub rupture: u64,
        /// The block.
        pub block: u32 [role = Place],
        /// Time of the first step in which the block slides, s.
        pub arrival_s: f64 [role = Time],
        /// Time of the first step after the last one in which it slid, s; null if it still slid at
        /// the end of the run.
        pub stop_s: Option<f64> [role = Time],
        /// First step in which the block slides.
        pub arrival_step: u64 [role = Step],
        /// First step after the last one in which it slid; null if it still slid at the end of the
        /// run.
        pub stop_step: Option<u64> [role = Step],
        /// How many times it detached.
        pub detachments: u32,
        /// Slip, m, from the first detachment to the last re-attachment; null if it still slid at
        /// the end of the run.
        pub slip_m: Option<f64> [area = "Slip along the sliding direction, m, from the first detachment to the last re-attachment; null if it still slid at the end of the run."],
        /// Tangential force without friction when it first detached, N.
        pub force_detach_n: f64 [area = "Size of the tangential force without friction when it first detached, N."],
        /// The same when it last re-attached, N; null if it still slid at the end of the run.
        pub force_attach_n: Option<f64>,
        /// Speed of the front on its way to this block from the neighbour towards the nucleation,
        /// m/s; negative where it came from the other side. Null for the block of nucleation, and
        /// where both began to slide in the same step.
        pub front_speed_m_per_s: Option<f64> [role = Speed] [area = "Null; see `local_speed_m_per_s`."],
        /// Shear force, the tangential force without friction, in the state at the onset of the rupture, N; null where
        /// its drop in the rupture is.
        pub force_before_n: Option<f64> [area = "Shear force, the tangential force without friction, in the state at the onset of the rupture, in the direction of the force at the first detachment, N; null where its drop in the rupture is."],
        /// The same in the state at the end of the rupture, N.
        pub force_after_n: Option<f64>,
    }
    only Area {
        /// Column of the contact.
        pub column: Option<u32> [role = Place],
        /// Row of the contact.
        pub across: Option<u32> [role = Place],
        /// Slip across the sliding direction, m; null as the slip along it.
        pub slip_across_m: Option<f64>,
        /// Speed of the front here, m/s: 1 over the gradient of the least-squares plane through the arrivals
        /// of the rupture among the 3 x 3 contacts around; null where fewer than six have one, and where all
        /// came at once.
        pub local_speed_m_per_s: Option<f64> [role = Speed],
    }
    only Recording {
        /// Position of the sensor, m from the driven end.
        pub x_m: Option<f64>,
        /// Standard error of the arrival, s.
        pub arrival_error_s: Option<f64>,
        /// Size of the step that the sensor saw, in its unit; of several the sum.
        pub step: Option<f64> [unit = "of the sensor"],
        /// Standard error of the size of one step.
        pub step_error: Option<f64> [unit = "of the sensor"],
    }
}

/// The fall of a tangential force, N, in the direction of that at the detachment: mirror images have the same.
pub fn drop_n(before_n: f64, after_n: f64, detach_n: f64) -> f64 {
    (before_n - after_n) * detach_n.signum()
}

impl Arrival {
    /// How far the block slid, m, whichever way; over an area the size of the vector. `None` if it still slid at
    /// the end of the run.
    pub fn slip_size_m(&self) -> Option<f64> {
        let along_m = self.slip_m?;
        Some(self.slip_across_m.map_or(along_m.abs(), |across_m| magnitude([along_m, across_m])))
    }

    /// Its part of [`Rupture::mean_strength_drop_n`].
    pub fn strength_drop_n(&self) -> Option<f64> {
        Some(drop_n(self.force_detach_n, self.force_attach_n?, self.force_detach_n))
    }
}
