//! Measures of a single rupture.

use asperity_record::{Contacts, Rupture};

/// Fewest blocks, or contacts, of a wide rupture: in a row these suffice to measure the speed of a front.
/// Creep joins fewer, since its detachments are far apart in time.
pub const WIDE_BLOCKS: u32 = 4;

pub(crate) fn is_wide(rupture: &Rupture) -> bool {
    rupture.slipped() >= WIDE_BLOCKS
}

pub(crate) fn duration_s(rupture: &Rupture) -> Option<f64> {
    rupture.end_s.map(|end_s| end_s - rupture.onset_s)
}

/// The time from onset until the last of its blocks slides.
pub(crate) fn crossing_s(rupture: &Rupture) -> f64 {
    rupture.arrival_s - rupture.onset_s
}

pub(crate) fn drop_ft_fn(rupture: &Rupture) -> Option<f64> {
    rupture.ft_fn_end.map(|end| rupture.ft_fn_onset - end)
}

/// The speed of a rupture's front along the slider, on the side where it ran farther, or on the other if only
/// that has one, m/s.
pub fn front_speed_m_per_s(rupture: &Rupture, contacts: Contacts) -> Option<f64> {
    let nucleation = contacts.column(rupture.nucleation_block);
    let up = rupture.last_block.saturating_sub(nucleation);
    let down = nucleation.saturating_sub(rupture.first_block);
    let (farther, other) = if up >= down {
        (rupture.front_speed_up_m_per_s, rupture.front_speed_down_m_per_s)
    } else {
        (rupture.front_speed_down_m_per_s, rupture.front_speed_up_m_per_s)
    };
    farther.or(other)
}
