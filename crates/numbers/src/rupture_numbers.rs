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

/// What left the sliding contacts as waves up to the end of a rupture, J: the kinetic energy that it added, and what the
/// dampers between blocks and the radiation damping of contacts took up (docs/ruptures.md, "Radiated energy"). Below 0
/// where it stopped more motion than it started; none where the energies of the rupture alone are not known.
pub fn radiated_energy_j(rupture: &Rupture) -> Option<f64> {
    Some(rupture.kinetic_change_j? + rupture.viscous_loss_j? + rupture.radiated_j.unwrap_or(0.0))
}

/// What a rupture had to spend, J: the elastic energy that it released, and the work of drive and prestress meanwhile.
pub(crate) fn released_energy_j(rupture: &Rupture) -> Option<f64> {
    Some(rupture.drive_work_j? + rupture.prestress_work_j? - rupture.elastic_change_j?)
}

/// What the finite time step added to these energies, and what they do not add up to, J.
pub(crate) fn energy_error_j(rupture: &Rupture) -> Option<f64> {
    let scheme_j = rupture.scheme_work_j?;
    let spent_j = released_energy_j(rupture)? + rupture.anchor_change_j? + scheme_j;
    Some(scheme_j.abs() + (spent_j - rupture.friction_heat_j? - radiated_energy_j(rupture)?).abs())
}

/// Radiated energy over itself and the fracture energy, the energy that friction springs lost at detachments less what
/// they gained at re-attachments. None unless both are above 0, so by laws without friction springs.
pub fn radiation_efficiency(rupture: &Rupture) -> Option<f64> {
    let radiated_j = radiated_energy_j(rupture)?;
    let fracture_j = -rupture.anchor_change_j?;
    (radiated_j > 0.0 && fracture_j > 0.0).then(|| radiated_j / (radiated_j + fracture_j))
}

/// The speeds of a rupture's front towards higher and towards lower columns, m/s. None of a front that outruns the grid: so
/// fast that it would pass all columns it reached sooner than waves of this speed pass from one to the next.
pub fn front_speeds_m_per_s(
    rupture: &Rupture,
    contacts: Contacts,
    wave_m_per_s: Option<f64>,
) -> [Option<f64>; 2] {
    let [up, down] = reached(rupture, contacts);
    let sides = [(up, rupture.front_speed_up_m_per_s), (down, rupture.front_speed_down_m_per_s)];
    sides.map(|(spacings, speed)| {
        speed.filter(|speed| wave_m_per_s.is_none_or(|wave| *speed <= f64::from(spacings) * wave))
    })
}

/// The speed of its front on the side where it ran farther, or on the other if only that has one, m/s.
pub fn front_speed_m_per_s(rupture: &Rupture, contacts: Contacts, wave_m_per_s: Option<f64>) -> Option<f64> {
    let [up, down] = front_speeds_m_per_s(rupture, contacts, wave_m_per_s);
    let [farther_up, farther_down] = reached(rupture, contacts);
    if farther_up >= farther_down { up.or(down) } else { down.or(up) }
}

/// How many columns it reached towards higher and towards lower ones from where it began.
fn reached(rupture: &Rupture, contacts: Contacts) -> [u32; 2] {
    let nucleation = contacts.column(rupture.nucleation_block);
    [rupture.last_block.saturating_sub(nucleation), nucleation.saturating_sub(rupture.first_block)]
}
