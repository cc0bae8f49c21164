//! Running totals of energies, as part of the state: a resumed run continues them.

use serde::{Deserialize, Serialize};

/// Totals up to the last step, J, except for parts that follow from the last states. While a span of
/// steps is open (`crates/simulator/src/energy.rs`), friction heat and scheme work are the totals at its start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ledger {
    /// Work of the drive point.
    pub drive_work_j: Sum,
    /// Of a slab or a body, work of the normal load on its top; of a chain, of a prestress with a course; 0 elsewhere.
    #[serde(default, skip_serializing_if = "Sum::is_zero")]
    pub load_work_j: Sum,
    /// Work against sliding friction.
    pub friction_heat_j: Sum,
    /// Work of radiation damping; 0 where nothing radiates, and where it follows from the balance.
    #[serde(default, skip_serializing_if = "Sum::is_zero")]
    pub radiated_j: Sum,
    /// The part of friction heat above sliding friction, of contacts that weaken by slip; 0 of others.
    #[serde(default, skip_serializing_if = "Sum::is_zero")]
    pub fracture_energy_j: Sum,
    /// Energy of friction springs at re-attachment, less their energy at detachment.
    pub anchor_change_j: Sum,
    /// Work of the dashpots; 0 where it follows from the balance.
    pub viscous_loss_j: Sum,
    /// Energy added by the time step; for a lattice without the last part, which follows from its state
    /// (`crates/simulator/src/step/body/lattice.rs`).
    pub scheme_work_j: Sum,
    /// The open span.
    pub span: Option<Span>,
}

/// A series of steps in which nothing switches and drive and load change linearly: where it began, and
/// the values at its start of the two functions of the state whose differences are heat and work.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Span {
    /// The last step before it.
    pub from_step: u64,
    /// Of the friction heat.
    pub heat_j: f64,
    /// Of the work of the scheme.
    pub scheme_j: f64,
}

impl Ledger {
    /// Whether all numbers are finite.
    pub fn is_finite(&self) -> bool {
        let sums = [
            self.drive_work_j,
            self.load_work_j,
            self.friction_heat_j,
            self.radiated_j,
            self.fracture_energy_j,
            self.anchor_change_j,
            self.viscous_loss_j,
            self.scheme_work_j,
        ];
        sums.iter().all(|sum| sum.total.is_finite() && sum.rest.is_finite())
            && self.span.is_none_or(|span| span.heat_j.is_finite() && span.scheme_j.is_finite())
    }
}

/// A sum that keeps its rounding errors (Neumaier 1974). Otherwise equal small parts, added hundreds of
/// millions of times to a large total, would all be rounded in the same direction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sum {
    /// The rounded sum.
    pub total: f64,
    /// The accumulated rounding error.
    pub rest: f64,
}

impl Sum {
    /// Adds a part.
    #[inline]
    pub fn add(&mut self, part: f64) {
        let total = self.total + part;
        self.rest += if self.total.abs() >= part.abs() {
            (self.total - total) + part
        } else {
            (part - total) + self.total
        };
        self.total = total;
    }

    /// Whether nothing has been added yet.
    fn is_zero(&self) -> bool {
        self.total == 0.0 && self.rest == 0.0
    }

    /// The sum.
    pub fn value(self) -> f64 {
        self.total + self.rest
    }
}

#[cfg(test)]
mod tests {
    use super::Sum;

    #[test]
    fn small_parts_are_not_lost_in_a_large_total() {
        let (mut sum, mut naive) = (Sum { total: 1.0, rest: 0.0 }, 1.0);
        for _ in 0..1_000_000 {
            sum.add(1e-17);
            naive += 1e-17;
        }
        sum.add(1e3);
        sum.add(-1e3);
        assert_eq!(naive, 1.0);
        assert!((sum.value() - (1.0 + 1e-11)).abs() < 1e-15, "{}", sum.value());
    }
}
