//! Measures of a single rupture.

use asperity_record::Rupture;

/// Fewest blocks of a wide rupture, over which the speed of its front can be measured. Creep joins
/// fewer blocks, since its detachments are far apart in time.
pub const WIDE_BLOCKS: u32 = 4;

pub(crate) fn is_wide(rupture: &Rupture) -> bool {
    rupture.reach().count() >= WIDE_BLOCKS
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

/// The speed of a rupture's front on the side where it ran farther, or on the other if only that
/// has one, m/s.
pub fn front_speed_m_per_s(rupture: &Rupture) -> Option<f64> {
    let up = rupture.last_block.saturating_sub(rupture.nucleation_block);
    let down = rupture.nucleation_block.saturating_sub(rupture.first_block);
    let (farther, other) = if up >= down {
        (rupture.front_speed_up_m_per_s, rupture.front_speed_down_m_per_s)
    } else {
        (rupture.front_speed_down_m_per_s, rupture.front_speed_up_m_per_s)
    };
    farther.or(other)
}
