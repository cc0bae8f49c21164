//! Running totals of energies, as part of the state: what a resumed run goes on with.

use serde::{Deserialize, Serialize};

/// Totals up to the last step, J, but for what the last states say by themselves. While a span of
/// steps is open (`energy.rs`), heat and the work of the scheme are those up to its start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ledger {
    /// Work of the drive point.
    pub drive_work_j: Sum,
    /// Of a slab, work of the normal load on its top row; 0 in a chain.
    #[serde(default, skip_serializing_if = "Sum::is_zero")]
    pub load_work_j: Sum,
    /// Work against sliding friction.
    pub friction_heat_j: Sum,
    /// What friction springs held as they took hold, less what they lost as they let go.
    pub anchor_change_j: Sum,
    /// Work of the dashpots; 0 where it is told by the balance.
    pub viscous_loss_j: Sum,
    /// What the time step added; in a slab, but for a last part that its state says (`lattice.rs`).
    pub scheme_work_j: Sum,
    /// The span that is open.
    pub span: Option<Span>,
}

/// Steps between which nothing switches, and drive and load go on steadily: where it began, and
/// what the two functions of a state were there whose differences are heat and work.
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
            self.anchor_change_j,
            self.viscous_loss_j,
            self.scheme_work_j,
        ];
        sums.iter().all(|sum| sum.total.is_finite() && sum.rest.is_finite())
            && self.span.is_none_or(|span| span.heat_j.is_finite() && span.scheme_j.is_finite())
    }
}

/// A sum that keeps what each addition rounds away (Neumaier 1974): equal small parts, added to a
/// large total, would all be rounded the same way, hundreds of millions of times.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sum {
    /// The sum as it rounds.
    pub total: f64,
    /// What was rounded away.
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

    /// Whether nothing has been added.
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
