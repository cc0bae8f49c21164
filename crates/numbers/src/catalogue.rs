//! Ruptures as seismology describes earthquakes: magnitudes and stress drops.

use std::collections::BTreeMap;

use asperity_model::body::medium::Medium;
use asperity_model::{Plan, Scenario};
use asperity_record::{Arrival, Contacts, Event, Observer, RunHeader, Rupture, Sensors};

use crate::rupture_numbers;

/// The moment magnitude, `(2/3) (log10 M_0 - 9.1)` with the moment in N m: the standard of IASPEI (2013), after Hanks
/// and Kanamori, J. Geophys. Res. 84, 2348 (1979). Of slip backwards the moment counts by its size; none without any.
pub fn moment_magnitude(moment_n_m: f64) -> Option<f64> {
    (moment_n_m != 0.0 && moment_n_m.is_finite()).then(|| (2.0 / 3.0) * (libm::log10(moment_n_m.abs()) - 9.1))
}

/// A rupture that has ended, in a catalogue.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The rupture.
    pub rupture: Rupture,
    /// Its moment, N m; in a medium per metre of strike.
    pub moment_n_m: f64,
    /// Distance of the contact that slid first from the first column, m; 0 in a medium.
    pub x_m: f64,
    /// In a medium, the depth of the node that was the first to be as fast as the event speed, m.
    pub depth_m: Option<f64>,
    /// Length of the columns that slid, m.
    pub length_m: f64,
    /// Shear stress before less that after the rupture, Pa: mean over its contacts of the fall of the shear force, over
    /// the area of a contact.
    pub stress_drop_pa: Option<f64>,
    /// Stress drop weighted by the size of the slip of each contact, Pa, as in the energy budget (Noda and others, Geophys. J.
    /// Int. 193, 1691 (2013)); none without any slip.
    pub slip_weighted_stress_drop_pa: Option<f64>,
    /// Strength before less resistance after, Pa: mean fall of the tangential force from detachment to re-attachment, over
    /// the area of a contact.
    pub strength_drop_pa: Option<f64>,
    /// Drop of strength weighted by the size of slip, Pa; none without any slip, and where the log does not tell the slip of each
    /// contact.
    pub slip_weighted_strength_drop_pa: Option<f64>,
    /// Skewness of the size of slip along the slider, its third central moment over its standard deviation to the third: above 0
    /// where the longer tail is towards higher columns; none where all slip is in one column.
    pub slip_skewness: Option<f64>,
}

impl Entry {
    /// Its [`moment_magnitude`]; a moment per metre has none.
    pub fn magnitude(&self) -> Option<f64> {
        moment_magnitude(self.moment_n_m).filter(|_| self.depth_m.is_none())
    }

    /// Time from its onset to its end, s.
    pub fn duration_s(&self) -> Option<f64> {
        rupture_numbers::duration_s(&self.rupture)
    }
}

/// The size of the slip of a contact in a rupture times the share of a cell that belongs to it, its column, and the drop of
/// its strength over this share.
struct ContactSlip {
    column: u32,
    slip_m: f64,
    strength_drop_n: f64,
}

/// The area that a contact stands for, m2: its length times the width of the slider, or of the contact over an area; in
/// a medium times a metre of strike.
pub(crate) fn contact_area_m2(block_length_m: f64, scenario: &Scenario) -> f64 {
    let slider = &scenario.slider;
    block_length_m
        * match slider.is_over_area() {
            true => block_length_m,
            false if slider.is_in_medium() => 1.0,
            false => slider.width_m,
        }
}

/// Observes a run, and lists its ruptures as a catalogue does.
pub struct Catalogue {
    contacts: Contacts,
    block_length_m: f64,
    contact_area_m2: f64,
    /// The sensors of a recording.
    sensors: Option<Sensors>,
    /// What gives nodes a depth.
    medium: Option<Box<Medium>>,
    ruptures: Vec<Rupture>,
    /// Contacts that slid, by rupture; none of a rupture with a contact that has not stopped.
    slips: BTreeMap<u64, Option<Vec<ContactSlip>>>,
}

impl Catalogue {
    /// For a run of this scenario; of a recording there is none.
    pub fn new(header: &RunHeader, scenario: Option<&Scenario>) -> Catalogue {
        let block_length_m = header.scales.block_length_m;
        Catalogue {
            contacts: header.contacts(),
            block_length_m,
            // Without a scenario no force on a contact is known.
            contact_area_m2: scenario.map_or(f64::NAN, |scenario| contact_area_m2(block_length_m, scenario)),
            sensors: header.sensors.clone(),
            medium: scenario.filter(|of| of.slider.is_in_medium()).and_then(|of| Plan::new(of).medium),
            ruptures: Vec::new(),
            slips: BTreeMap::new(),
        }
    }

    /// The ruptures that have ended, by onset and number, and how many others there are, which still slid at
    /// the end.
    pub fn finish(mut self) -> (Vec<Entry>, usize) {
        self.ruptures.sort_by_key(|rupture| (rupture.onset_step, rupture.rupture));
        let all = self.ruptures.len();
        let ended = std::mem::take(&mut self.ruptures);
        let entries: Vec<Entry> = ended.into_iter().filter_map(|rupture| self.entry(rupture)).collect();
        let others = all - entries.len();
        (entries, others)
    }

    fn entry(&self, rupture: Rupture) -> Option<Entry> {
        let moment_n_m = rupture.moment_n_m?;
        let column = self.contacts.column(rupture.nucleation_block);
        let slips = self.slips.get(&rupture.rupture).and_then(Option::as_deref);
        // A log that ends within them does not tell all.
        let slips = slips.filter(|slips| slips.len() == rupture.slipped() as usize).unwrap_or(&[]);
        let over_area = |drop_n: Option<f64>| drop_n.map(|drop_n| drop_n / self.contact_area_m2);
        let of_sensors = self.sensors.as_ref().and_then(|sensors| {
            let shares_m = (rupture.first_block..=rupture.last_block).map(|sensor| sensors.share_m(sensor));
            Some((sensors.x_m(rupture.nucleation_block)?, shares_m.sum::<Option<f64>>()?))
        });
        let (x_m, length_m) = of_sensors.unwrap_or_else(|| {
            let columns =
                [column - 1, rupture.reach().count()].map(|columns| f64::from(columns) * self.block_length_m);
            columns.into()
        });
        let depth_m =
            self.medium.as_ref().map(|medium| medium.depth_m(rupture.nucleation_block as usize - 1));
        Some(Entry {
            moment_n_m,
            x_m: depth_m.map_or(x_m, |_| 0.0),
            depth_m,
            length_m,
            stress_drop_pa: over_area(rupture.mean_shear_force_drop_n),
            slip_weighted_stress_drop_pa: over_area(rupture.slip_weighted_shear_force_drop_n),
            strength_drop_pa: over_area(rupture.mean_strength_drop_n),
            slip_weighted_strength_drop_pa: over_area(weighted_drop_n(slips)),
            slip_skewness: skewness(slips),
            rupture,
        })
    }
}

impl Observer for Catalogue {
    fn event(&mut self, event: &Event) {
        if let Some(rupture) = event.get::<Rupture>() {
            self.ruptures.push(rupture.clone());
        } else if let Some(arrival) = event.get::<Arrival>() {
            let of_contact = arrival.slip_size_m().zip(arrival.strength_drop_n());
            let column = self.contacts.column(arrival.block);
            let share = self.medium.as_ref().map_or(1.0, |of| of.weight(arrival.block as usize - 1));
            let of_cell = of_contact.map(|(slip_m, drop_n)| (share * slip_m, drop_n / share));
            let of_contact =
                of_cell.map(|(slip_m, strength_drop_n)| ContactSlip { column, slip_m, strength_drop_n });
            match (self.slips.entry(arrival.rupture).or_insert_with(|| Some(Vec::new())), of_contact) {
                (Some(slips), Some(of_contact)) => slips.push(of_contact),
                (slips, _) => *slips = None,
            }
        }
    }
}

/// The mean of the drops of strength, weighted by the size of slip.
fn weighted_drop_n(slips: &[ContactSlip]) -> Option<f64> {
    let sum_m: f64 = slips.iter().map(|contact| contact.slip_m).sum();
    let weighted: f64 = slips.iter().map(|contact| contact.slip_m * contact.strength_drop_n).sum();
    (sum_m > 0.0).then(|| weighted / sum_m)
}

/// The skewness of the size of slip over columns.
fn skewness(slips: &[ContactSlip]) -> Option<f64> {
    let sum_m: f64 = slips.iter().map(|contact| contact.slip_m).sum();
    let mean = |of: &dyn Fn(f64) -> f64| {
        let weighted = slips.iter().map(|contact| contact.slip_m * of(f64::from(contact.column)));
        weighted.sum::<f64>() / sum_m
    };
    let centre = mean(&|column| column);
    let variance = mean(&|column| (column - centre).powi(2));
    (variance > 0.0).then(|| mean(&|column| (column - centre).powi(3)) / variance.powf(1.5))
}

#[cfg(test)]
mod tests {
    use super::{ContactSlip, moment_magnitude, skewness, weighted_drop_n};

    fn near(found: Option<f64>, expected: f64) {
        let found = found.expect("there is one");
        assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
    }

    #[test]
    fn magnitudes_are_those_of_the_standard() {
        // 10^9.1 N m is magnitude 0; a thousand times that is 2.
        near(moment_magnitude(10f64.powf(9.1)), 0.0);
        near(moment_magnitude(-(10f64.powf(12.1))), 2.0);
        assert_eq!([moment_magnitude(0.0), moment_magnitude(f64::NAN)], [None, None]);
    }

    #[test]
    fn drops_and_skewness_are_weighted_by_slip() {
        let slips = |all: &[(u32, f64, f64)]| -> Vec<ContactSlip> {
            all.iter()
                .map(|&(column, slip_m, strength_drop_n)| ContactSlip { column, slip_m, strength_drop_n })
                .collect()
        };
        // Three of four parts of the slip at column 1, one at column 5: mean 2, variance 3, third moment 6.
        let of = slips(&[(1, 3e-6, 2.0), (5, 1e-6, 6.0)]);
        near(weighted_drop_n(&of), 3.0);
        near(skewness(&of), 6.0 / 3f64.powf(1.5));
        assert_eq!(skewness(&slips(&[(1, 1e-6, 2.0)])), None, "one column");
        assert_eq!([weighted_drop_n(&[]), skewness(&[])], [None, None]);
    }
}
