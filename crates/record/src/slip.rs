//! The events of slip, from which tables are made. Defined here rather than beside the detectors that
//! emit them, because the analysis does not link detectors.

use crate::{BoundingBox, Reach, payload};

payload! {
    topic: "/events/onset",
    table: "onsets",
    /// The start of a slip event: which block went first, when, at what load.
    pub struct Onset {
        /// Number of the slip event in its run, counted from 0.
        pub event: u64 [role = Number],
        /// First step in which a block slides.
        pub onset_step: u64 [role = Step],
        /// Time of that step, s.
        pub onset_s: f64 [role = Time],
        /// Lowest-numbered block that slides in that step.
        pub nucleation_block: u32 [role = Place],
        /// How many blocks slide in that step.
        pub nucleation_blocks: u32 [role = Place],
        /// Tangential force on the nucleation block when it detached, N.
        pub tangential_force_n: f64 [area = "Tangential force along the sliding direction on the contact of nucleation when it detached, N."],
        /// Static friction threshold of the nucleation block when it detached, N.
        pub threshold_n: f64,
        /// `F_T / F_N` used in the onset step.
        pub ft_fn_onset: f64 [role = Load],
    }
    only Area {
        /// Tangential force across the sliding direction on the contact of nucleation when it detached, N.
        pub tangential_force_across_n: Option<f64>,
    }
}

payload! {
    topic: "/events/slip",
    table: "events" [derive = Default],
    /// A maximal run of consecutive steps in which at least one block slides.
    ///
    /// The first seven fields are the columns of the table of slip events, in its order.
    pub struct SlipEvent {
        /// Time of the first step in which a block slides, s.
        pub onset_s: f64 [role = Time],
        /// Time of the first step after it in which none does, s; null if the run
        /// ended before.
        pub end_s: Option<f64> [role = Time],
        /// Lowest-numbered block that slid.
        pub first_block: u32 [role = Place] [area = "First column in which a contact slid."],
        /// Highest-numbered block that slid.
        pub last_block: u32 [role = Place] [area = "Last column in which a contact slid."],
        /// Most blocks sliding in one step.
        pub max_sliding: u32 [role = Place],
        /// `F_T / F_N` used in the onset step.
        pub ft_fn_onset: f64 [role = Load],
        /// `F_T / F_N` used in the end step; null if the run ended before.
        pub ft_fn_end: Option<f64> [role = Load],
        /// Number of the event in its run, counted from 0.
        pub event: u64 [role = Number],
        /// First step in which a block slides.
        pub onset_step: u64 [role = Step],
        /// First step after it in which none does; null if the run ended before.
        pub end_step: Option<u64> [role = Step],
        /// Number of distinct blocks that slid.
        pub blocks_slipped: u32 [role = Place],
        /// Lowest-numbered block of the onset step.
        pub nucleation_block: u32 [role = Place],
        /// Smallest `F_T / F_N` over the event's switch records.
        pub ft_fn_min: f64 [role = Load],
        /// Largest `F_T / F_N` over the event's switch records.
        pub ft_fn_max: f64 [role = Load],
        /// Whether the run ended before the event did.
        pub open: bool [role = Edge],
    }
    only Junctions {
        /// Breaks of junctions in all steps before the onset step.
        pub breaks_onset: Option<u64> [role = Total],
        /// Breaks of junctions in all steps before the end step; none if the run ended before.
        pub breaks_end: Option<u64> [role = Total],
        /// Junctions pinned again in all steps before the onset step.
        pub repins_onset: Option<u64> [role = Total],
        /// Junctions pinned again in all steps before the end step; none if the run ended before.
        pub repins_end: Option<u64> [role = Total],
    }
    only State {
        /// Largest speed of any block in it, m/s.
        pub peak_velocity_m_per_s: Option<f64> [role = Speed],
    }
    only Area {
        /// First row in which a contact slid.
        pub first_across: Option<u32> [role = Place],
        /// Last row in which a contact slid.
        pub last_across: Option<u32> [role = Place],
    }
}

impl SlipEvent {
    /// The range of blocks of the event; over an area that of columns.
    pub fn reach(&self) -> Reach {
        Reach { first: self.first_block, last: self.last_block }
    }

    /// The box of columns and rows of the event.
    pub fn bounding_box(&self) -> BoundingBox {
        BoundingBox::new(self.reach(), self.first_across, self.last_across)
    }

    /// Whether every block of the chain slid.
    pub fn is_global(&self, blocks: u32) -> bool {
        self.blocks_slipped == blocks
    }
}

payload! {
    topic: "/events/global",
    table: "global-slips",
    /// A slip event in which every block of the chain slid.
    pub struct GlobalSlip {
        /// Number of the global slip in its run, counted from 0.
        pub global: u64,
        /// Number of the slip event it is.
        pub event: u64,
        /// Time of its onset, s.
        pub onset_s: f64 [role = Time],
        /// Time of its end, s; null if the run ended before.
        pub end_s: Option<f64> [role = Time],
        /// Time since the onset of the global slip before it, s; null for the first.
        pub recurrence_s: Option<f64>,
        /// Fall of the driving force from onset to end, N; null if the run ended before.
        pub load_drop_n: Option<f64>,
        /// Fall of `F_T / F_N` from onset to end; null if the run ended before.
        pub ft_fn_drop: Option<f64>,
    }
}

#[cfg(test)]
mod tests {
    use super::SlipEvent;
    use crate::{EventKind, Parts};

    /// Tables, schemas and messages of other runs are as if there were no such columns.
    #[test]
    fn only_runs_with_a_part_have_its_columns() {
        let json = r#"{"onset_s":1.0,"end_s":null,"first_block":1,"last_block":2,"max_sliding":1,"ft_fn_onset":0.5,"ft_fn_end":null,"event":0,"onset_step":4,"end_step":null,"blocks_slipped":2,"nucleation_block":1,"ft_fn_min":0.25,"ft_fn_max":0.5,"open":true}"#;
        let counts = r#","breaks_onset":7,"repins_onset":3"#;
        let rows = r#","first_across":2,"last_across":4"#;
        let of = |junctions, area, state| Parts { junctions, area, state, ..Parts::default() };
        for (parts, more, last) in [
            (of(false, false, false), String::new(), "true"),
            (of(true, false, false), counts.to_owned(), "true,7,,3,"),
            (of(false, true, false), rows.to_owned(), "true,2,4"),
            (of(true, true, false), format!("{counts}{rows}"), "true,7,,3,,2,4"),
            (of(false, false, true), r#","peak_velocity_m_per_s":0.5"#.to_owned(), "true,0.5"),
        ] {
            let kind = EventKind::of::<SlipEvent>().with(parts);
            let json = json.replace('}', &format!("{more}}}"));
            let event = kind.read(&json).unwrap();
            assert_eq!(event.json(), json);
            let cells: Vec<String> = kind.cells(&event).unwrap().iter().map(ToString::to_string).collect();
            let columns = 15
                + 4 * usize::from(parts.junctions)
                + 2 * usize::from(parts.area)
                + usize::from(parts.state);
            assert_eq!((cells.len(), kind.columns().len()), (columns, columns));
            assert_eq!(cells[14..].join(","), last);
            let properties = kind.schema()["properties"].as_object().unwrap();
            assert_eq!(properties.len(), columns);
            assert_eq!(properties.contains_key("breaks_end"), parts.junctions);
            assert_eq!(properties.contains_key("last_across"), parts.area);
            assert_eq!(properties.contains_key("peak_velocity_m_per_s"), parts.state);
            let about = properties["first_block"]["description"].as_str().unwrap();
            assert_eq!(about.contains("column"), parts.area, "{about}");
            let required = kind.schema()["required"].to_string();
            assert!(!required.contains("breaks") && !required.contains("across"));
        }
    }
}
