//! The state of contacts of many junctions ([`crate::law::junctions`], docs/contacts.md).

use asperity_record::JunctionTotals;
use serde::{Deserialize, Serialize};

use crate::law::junctions::Junctions;
use crate::plan::Plan;

/// The state of the junctions of all contacts.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(into = "SavedJunctions", try_from = "SavedJunctions")]
pub struct JunctionState {
    /// Of the outermost slipping junctions, anchors are those of the last visit.
    pub kept: SavedJunctions,
    /// What follows from them, and where the outermost anchors are now.
    pub contacts: Summaries,
}

/// What a step needs of each contact, one value per contact: how many of its junctions slip; their outermost anchors,
/// how many share each, and the next ones inwards; the sum of all others; the outermost pinned ones; and the step in which
/// the next one is pinned.
#[derive(Debug, Clone, Default)]
#[expect(missing_docs, reason = "the struct's text documents its fields")]
pub struct Summaries {
    pub slipping: Vec<u32>,
    pub low_m: Vec<f64>,
    pub high_m: Vec<f64>,
    pub low_count: Vec<f64>,
    pub high_count: Vec<f64>,
    pub other_anchors_m: Vec<f64>,
    pub above_low_m: Vec<f64>,
    pub below_high_m: Vec<f64>,
    pub pinned_low_m: Vec<f64>,
    pub pinned_high_m: Vec<f64>,
    pub due_step: Vec<f64>,
}

/// The state in checkpoints.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SavedJunctions {
    /// Junctions of a contact.
    pub count: usize,
    /// Contact by contact, the anchor of each junction.
    pub anchor_m: Vec<f64>,
    /// Its last step of slip, 0 for a pinned one.
    pub slips_until_step: Vec<u64>,
    /// How often it has broken.
    pub breaks: Vec<u64>,
    /// Of all junctions, up to the last step.
    pub totals: JunctionTotals,
    /// Up to the one before.
    pub totals_before: JunctionTotals,
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
    /// At the start of a plan: all junctions pinned; `None` by laws without them.
    pub fn initial(plan: &Plan) -> Option<Box<JunctionState>> {
        let law = plan.friction.law.junctions()?;
        let mut anchor_m = Vec::with_capacity(plan.blocks * law.count);
        for n in 0..plan.blocks {
            let k = plan.friction.contact_stiffness_n_per_m[n] / law.count as f64;
            let width_n = law.width * plan.normal_load_n[n] / law.count as f64;
            let mean_m = plan.initial.stick_position_m[n];
            anchor_m.extend(law.offsets(n).iter().map(|q| mean_m + width_n * q / k));
        }
        let zeros = vec![0; anchor_m.len()];
        let kept = SavedJunctions {
            count: law.count,
            anchor_m,
            slips_until_step: zeros.clone(),
            breaks: zeros,
            ..SavedJunctions::default()
        };
        Some(Box::new(JunctionState::of(kept)))
    }

    /// From what a checkpoint has, whose contacts are complete.
    pub fn of(kept: SavedJunctions) -> JunctionState {
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
    pub fn fits(&self, plan: &Plan, step: u64, slip: &[f64]) -> bool {
        let SavedJunctions { count, anchor_m, slips_until_step, breaks, totals, totals_before } = &self.kept;
        let broken = breaks.iter().try_fold(0_u64, |sum, breaks| sum.checked_add(*breaks));
        let slipping = slips_until_step.iter().filter(|until| **until != 0).count() as u64;
        let slipping_before = totals_before.breaks.checked_sub(totals_before.repins);
        let slides = |law: Junctions| {
            slip.iter().enumerate().all(|(n, slip)| law.slides(self.slipping(n)) == (*slip != 0.0))
        };
        anchor_m.len() == plan.blocks * count
            && anchor_m.iter().all(|anchor_m| anchor_m.is_finite())
            && breaks.iter().all(|breaks| *breaks <= step)
            && broken == Some(totals.breaks)
            && totals.repins.checked_add(slipping) == broken
            && totals_before.breaks <= totals.breaks
            && totals_before.repins <= totals.repins
            && slipping_before.is_some_and(|slipping| slipping <= anchor_m.len() as u64)
            && plan.friction.law.junctions().is_some_and(|law| law.count == *count && slides(law))
    }

    /// Breaks and re-pins up to the last step.
    pub fn totals(&self) -> JunctionTotals {
        self.kept.totals
    }

    /// Breaks and re-pins of all steps before the last.
    pub fn totals_before(&self) -> JunctionTotals {
        self.kept.totals_before
    }

    /// How many junctions of a contact slip.
    pub fn slipping(&self, n: usize) -> u32 {
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
    pub fn junctions(&self, n: usize) -> impl Iterator<Item = (f64, bool)> + '_ {
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
    pub fn energy_j(&self, plan: &Plan, n: usize, u: f64) -> f64 {
        let k = plan.friction.contact_stiffness_n_per_m[n] / self.kept.count as f64;
        self.junctions(n).map(|(anchor, _)| 0.5 * k * (u - anchor) * (u - anchor)).sum()
    }

    /// The mean force of the pinned junctions of a contact at `u`, and the width of the uniform distribution with
    /// the deviation of these forces, both over the load that each junction bears; 0 where none is pinned or loaded.
    pub fn pinned_ratios(&self, plan: &Plan, n: usize, u: f64, normal_load_n: f64) -> [f64; 2] {
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
    pub fn refresh(&mut self, n: usize) {
        let now: Vec<f64> = self.junctions(n).map(|(anchor, _)| anchor).collect();
        self.kept.anchor_m[n * self.kept.count..(n + 1) * self.kept.count].copy_from_slice(&now);
    }

    /// Derives what the kernel needs of a contact from its junctions.
    pub fn summarize(&mut self, n: usize) {
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
