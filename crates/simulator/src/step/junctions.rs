//! Contacts of many junctions ([`asperity_model::law::junctions`], docs/junctions.md): their state, and a step.
//!
//! A step, everything from the old state unless stated otherwise:
//!
//! 1. the anchor of every slipping junction is dragged to within `d = mu_d p / (N_s k_n)` of `u`;
//! 2. friction is `-k_n (N_s u - A)`, `A` the sum of all anchors;
//! 3. a pinned junction with `k_n |u - x_j| >= mu_s p / N_s` breaks: `x_j = u - d sign(u - x_j)`, and it slips for
//!    a drawn number of steps from the next one on;
//! 4. the body moves;
//! 5. junctions whose last step of slip this is are pinned at the new position, unless the contact bore nothing.
//!
//! Each move of an anchor lowers the energy `k_n / 2 (u - x_j)^2`; that is the friction heat. A contact slides
//! from the step after one that leaves at least the given share of its junctions slipping.
//!
//! **Visits.** In most steps of a contact no junction breaks or is pinned. Only slipping junctions move then,
//! and of these only the ones with the outermost anchors: the drag moves an inner anchor only after an outer one has
//! reached it. So a kernel goes over all contacts with the two outermost anchors and the sum of the others
//! ([`crate::kernels`]), and [`loops::JunctionLoops`] visits the junctions of those contacts alone in which more
//! happens. Each visit adds that sum up again, so the state follows from anchors and timers alone.

use asperity_model::plan::initial_state::CarriedJunctions;
use asperity_model::{Junctions, Plan};
use asperity_record::JunctionTotals;
use serde::{Deserialize, Serialize};

pub(crate) mod loops;

/// The state of the junctions of all contacts.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(into = "SavedJunctions", try_from = "SavedJunctions")]
pub struct JunctionState {
    /// Of the outermost slipping junctions, anchors are those of the last visit.
    kept: SavedJunctions,
    contacts: Summaries,
}

/// What the kernel needs of each contact, see [`crate::kernels::Bearing`].
#[derive(Debug, Clone, Default)]
struct Summaries {
    slipping: Vec<u32>,
    low_m: Vec<f64>,
    high_m: Vec<f64>,
    low_count: Vec<f64>,
    high_count: Vec<f64>,
    other_anchors_m: Vec<f64>,
    above_low_m: Vec<f64>,
    below_high_m: Vec<f64>,
    pinned_low_m: Vec<f64>,
    pinned_high_m: Vec<f64>,
    due_step: Vec<f64>,
}

/// The state in checkpoints.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedJunctions {
    /// Junctions of a contact.
    count: usize,
    /// Contact by contact, for each junction: its anchor; its last step of slip, 0 for a pinned one; how often it has
    /// broken.
    anchor_m: Vec<f64>,
    slips_until_step: Vec<u64>,
    breaks: Vec<u64>,
    /// Of all junctions, up to the last step and up to the one before.
    totals: JunctionTotals,
    totals_before: JunctionTotals,
}

impl From<JunctionState> for SavedJunctions {
    fn from(mut state: JunctionState) -> SavedJunctions {
        for n in 0..state.contacts.slipping.len() {
            state.refresh(n);
        }
        state.kept
    }
}

impl TryFrom<SavedJunctions> for JunctionState {
    type Error = &'static str;

    fn try_from(stored: SavedJunctions) -> Result<JunctionState, &'static str> {
        let (count, all) = (stored.count, stored.anchor_m.len());
        if count == 0 || all % count != 0 || [stored.slips_until_step.len(), stored.breaks.len()] != [all; 2]
        {
            return Err("the junctions of its contacts are incomplete");
        }
        Ok(JunctionState::of(stored))
    }
}

impl PartialEq for JunctionState {
    fn eq(&self, other: &JunctionState) -> bool {
        SavedJunctions::from(self.clone()) == SavedJunctions::from(other.clone())
    }
}

impl JunctionState {
    /// At the start of a plan: all junctions pinned, unless it begins in a given state; `None` by laws without them.
    pub(crate) fn initial(plan: &Plan) -> Option<Box<JunctionState>> {
        let law = plan.friction.law.junctions()?;
        let count = law.count;
        let carried = plan.initial.carried.as_ref().and_then(|carried| carried.junctions.clone());
        if let Some(CarriedJunctions { anchor_m, slips_until_step, breaks, totals }) = carried {
            let [totals, totals_before] = totals.map(|[breaks, repins]| JunctionTotals { breaks, repins });
            let kept = SavedJunctions { count, anchor_m, slips_until_step, breaks, totals, totals_before };
            return Some(Box::new(JunctionState::of(kept)));
        }
        let mut anchor_m = Vec::with_capacity(plan.blocks * law.count);
        for n in 0..plan.blocks {
            let k = plan.friction.contact_stiffness_n_per_m[n] / law.count as f64;
            let width_n = law.width * plan.normal_load_n[n] / law.count as f64;
            let mean_m = plan.initial.stick_position_m[n];
            anchor_m.extend(law.offsets(n).iter().map(|q| mean_m + width_n * q / k));
        }
        let zeros = vec![0; anchor_m.len()];
        let kept = SavedJunctions {
            count,
            anchor_m,
            slips_until_step: zeros.clone(),
            breaks: zeros,
            ..SavedJunctions::default()
        };
        Some(Box::new(JunctionState::of(kept)))
    }

    fn of(kept: SavedJunctions) -> JunctionState {
        let contacts = kept.anchor_m.len() / kept.count;
        let zeros = || vec![0.0; contacts];
        let summaries = Summaries {
            slipping: vec![0; contacts],
            low_m: zeros(),
            high_m: zeros(),
            low_count: zeros(),
            high_count: zeros(),
            other_anchors_m: zeros(),
            above_low_m: zeros(),
            below_high_m: zeros(),
            pinned_low_m: zeros(),
            pinned_high_m: zeros(),
            due_step: zeros(),
        };
        let mut state = JunctionState { kept, contacts: summaries };
        for n in 0..contacts {
            state.summarize(n);
        }
        state
    }

    /// Whether it can be that of a plan after a step, given which contacts slide: a state from a file must pass.
    pub(crate) fn fits(&self, plan: &Plan, step: u64, slip: &[f64]) -> bool {
        let slides = |law: Junctions| {
            slip.iter().enumerate().all(|(n, slip)| law.slides(self.slipping(n)) == (*slip != 0.0))
        };
        let count = plan.blocks * self.kept.count;
        self.carried().fits(count, step)
            && self.kept.anchor_m.iter().all(|anchor_m| anchor_m.is_finite())
            && plan.friction.law.junctions().is_some_and(|law| law.count == self.kept.count && slides(law))
    }

    /// As the state of a run that begins here.
    pub(crate) fn carried(&self) -> CarriedJunctions {
        let SavedJunctions { anchor_m, slips_until_step, breaks, totals, totals_before, .. } =
            self.clone().into();
        let totals = [totals, totals_before].map(|JunctionTotals { breaks, repins }| [breaks, repins]);
        CarriedJunctions { anchor_m, slips_until_step, breaks, totals }
    }

    /// Breaks and re-pins up to the last step.
    pub fn totals(&self) -> JunctionTotals {
        self.kept.totals
    }

    /// Breaks and re-pins of all steps before the last.
    pub(crate) fn totals_before(&self) -> JunctionTotals {
        self.kept.totals_before
    }

    /// How many junctions of a contact slip.
    pub(crate) fn slipping(&self, n: usize) -> u32 {
        self.contacts.slipping[n]
    }

    /// The outermost anchors of the slipping junctions of a contact as of the last visit; infinite without any.
    fn outermost_m(&self, n: usize) -> [f64; 2] {
        let of = n * self.kept.count..(n + 1) * self.kept.count;
        let all = self.kept.anchor_m[of.clone()].iter().zip(&self.kept.slips_until_step[of]);
        let slipping = all.filter(|(_, until)| **until != 0).map(|(anchor, _)| *anchor);
        slipping.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    }

    /// The anchors of a contact, and whether each junction slips.
    fn junctions(&self, n: usize) -> impl Iterator<Item = (f64, bool)> + '_ {
        let of = n * self.kept.count..(n + 1) * self.kept.count;
        let [low, high] = self.outermost_m(n);
        let (low, high) = ((low, self.contacts.low_m[n]), (high, self.contacts.high_m[n]));
        self.kept.anchor_m[of.clone()].iter().zip(&self.kept.slips_until_step[of]).map(
            move |(anchor, until)| {
                let slips = *until != 0;
                let anchor = match [low, high].into_iter().find(|(visited, _)| slips && anchor == visited) {
                    Some((_, dragged)) => dragged,
                    None => *anchor,
                };
                (anchor, slips)
            },
        )
    }

    /// Energy of the junctions of a contact at `u`.
    pub(crate) fn energy_j(&self, plan: &Plan, n: usize, u: f64) -> f64 {
        let k = plan.friction.contact_stiffness_n_per_m[n] / self.kept.count as f64;
        self.junctions(n).map(|(anchor, _)| 0.5 * k * (u - anchor) * (u - anchor)).sum()
    }

    /// The mean force of the pinned junctions of a contact at `u`, and the width of the uniform distribution with
    /// the deviation of these forces, both over the load that each junction bears; 0 where none is pinned or loaded.
    pub(crate) fn pinned_ratios(&self, plan: &Plan, n: usize, u: f64, normal_load_n: f64) -> [f64; 2] {
        let per_m = plan.friction.contact_stiffness_n_per_m[n] / normal_load_n;
        let forces =
            || self.junctions(n).filter(|(_, slips)| !slips).map(move |(anchor, _)| per_m * (u - anchor));
        let count = (self.kept.count - self.slipping(n) as usize) as f64;
        if count == 0.0 || normal_load_n == 0.0 {
            return [0.0; 2];
        }
        let mean = forces().sum::<f64>() / count;
        let square = forces().map(|force| (force - mean) * (force - mean)).sum::<f64>() / count;
        [mean, (12.0 * square).sqrt()]
    }

    /// Brings the anchors of a contact's junctions up to the last step.
    fn refresh(&mut self, n: usize) {
        let now: Vec<f64> = self.junctions(n).map(|(anchor, _)| anchor).collect();
        self.kept.anchor_m[n * self.kept.count..(n + 1) * self.kept.count].copy_from_slice(&now);
    }

    /// Derives what the kernel needs of a contact from its junctions.
    fn summarize(&mut self, n: usize) {
        let of = n * self.kept.count..(n + 1) * self.kept.count;
        let all = || {
            self.kept.anchor_m[of.clone()]
                .iter()
                .copied()
                .zip(self.kept.slips_until_step[of.clone()].iter().copied())
        };
        let slipping = || all().filter(|(_, until)| *until != 0).map(|(anchor, _)| anchor);
        let pinned = || all().filter(|(_, until)| *until == 0).map(|(anchor, _)| anchor);
        let [low, high] = self.outermost_m(n);
        let inner = || slipping().filter(|anchor| *anchor != low && *anchor != high);
        let others = all().filter(|(anchor, until)| *until == 0 || (*anchor != low && *anchor != high));
        let contacts = &mut self.contacts;
        contacts.other_anchors_m[n] = others.map(|(anchor, _)| anchor).sum();
        contacts.slipping[n] = slipping().count() as u32;
        contacts.low_count[n] = slipping().filter(|anchor| *anchor == low).count() as f64;
        contacts.high_count[n] =
            if low == high { 0.0 } else { slipping().filter(|anchor| *anchor == high).count() as f64 };
        contacts.above_low_m[n] = inner().fold(f64::INFINITY, f64::min);
        contacts.below_high_m[n] = inner().fold(f64::NEG_INFINITY, f64::max);
        contacts.pinned_low_m[n] = pinned().fold(f64::NAN, f64::min);
        contacts.pinned_high_m[n] = pinned().fold(f64::NAN, f64::max);
        let due = all().map(|(_, until)| until).filter(|until| *until != 0).min();
        contacts.due_step[n] = due.map_or(f64::INFINITY, |step| step as f64);
        // Without slipping junctions any finite anchors do.
        let is_any = contacts.slipping[n] > 0;
        let (low, high) = if is_any { (low, high) } else { (0.0, 0.0) };
        (contacts.low_m[n], contacts.high_m[n]) = (low, high);
    }
}

#[cfg(test)]
mod tests;
