//! A number under refinement: its values in runs on other meshes and with a shorter step, and what it is worth by them.

use crate::convergence::Convergence;
use crate::median;
use crate::number::Number;
use crate::summary::Summary;

/// How many runs there are of each mesh, whose moduli differ too little to see.
pub const PERTURBED: usize = 3;

/// A number under refinement.
#[derive(Debug, Clone)]
pub struct Refined {
    /// The number.
    pub number: Number,
    /// The median of its runs as given, on the finer mesh, with the shorter step, and on the coarser mesh; `None` if
    /// one of them lacks it.
    pub medians: [Option<f64>; 4],
    /// Its changes, each over the larger value: on the finer mesh, with the shorter step, and the largest between runs
    /// with perturbed moduli.
    pub changes: Option<[f64; 3]>,
}

impl Refined {
    /// The numbers that are judged: those of a summary, but for what says what was run.
    pub fn numbers() -> impl Iterator<Item = Number> {
        let is_found = |number: &Number| number.is_of_summary() && number.key.group != Summary::KEYS[0].group;
        Number::all().filter(is_found)
    }

    /// All of them, by their values in each run, in the order of the runs.
    pub fn all(runs: &[Vec<Option<f64>>]) -> Vec<Refined> {
        let of = |(n, number): (usize, Number)| {
            let values = |runs: &[Vec<Option<f64>>]| runs.iter().map(|run| run[n]).collect();
            let variants: Vec<Option<Vec<f64>>> = runs.chunks(PERTURBED).map(values).collect();
            let variant = |n: usize| variants.get(n)?.as_ref();
            let medians @ [given, finer, shorter, _] =
                [0, 1, 2, 3].map(|n| median(variant(n)?.iter().copied()));
            let spread = |n: usize| {
                let values = variant(n)?;
                Some(values.iter().flat_map(|a| values.iter().map(|b| change(*a, *b))).fold(0.0, f64::max))
            };
            let changes = || {
                let perturbed = spread(0)?.max(spread(1)?).max(spread(2)?);
                Some([change(given?, finer?), change(given?, shorter?), perturbed])
            };
            Refined { number, medians, changes: changes() }
        };
        Refined::numbers().enumerate().map(of).collect()
    }

    /// Its change on the coarser mesh, likewise, by which it is not judged.
    pub fn coarser_change(&self) -> Option<f64> {
        Some(change(self.medians[0]?, self.medians[3]?))
    }

    /// What it is worth, as found; `None` if not all runs have it.
    pub fn found(&self) -> Option<Convergence> {
        self.changes.map(|[mesh, step, perturbed]| Convergence::of_changes(mesh, step, perturbed))
    }
}

/// The difference of two values over the larger of them.
fn change(a: f64, b: f64) -> f64 {
    if a == b { 0.0 } else { (a - b).abs() / a.abs().max(b.abs()) }
}

#[cfg(test)]
mod tests {
    use super::{Convergence, Refined};

    #[test]
    fn a_number_that_a_run_lacks_is_not_judged() {
        let place = Refined::numbers().position(|number| number.name() == "precursor_count").unwrap();
        let of = |values: &[Option<f64>]| {
            let run = |value: &Option<f64>| Refined::numbers().map(|_| *value).collect();
            Refined::all(&values.iter().map(run).collect::<Vec<_>>()).swap_remove(place)
        };
        let all = [40.0, 44.0, 42.0, 50.0, 54.0, 52.0, 40.0, 42.0, 41.0, 20.0, 20.0, 20.0].map(Some);
        let refined = of(&all);
        assert_eq!((refined.number.name(), refined.coarser_change()), ("precursor_count", Some(22.0 / 42.0)));
        assert_eq!(refined.medians, [Some(42.0), Some(52.0), Some(41.0), Some(20.0)]);
        let [mesh, step, perturbed] = refined.changes.unwrap();
        assert_eq!([mesh, step, perturbed], [10.0 / 52.0, 1.0 / 42.0, 4.0 / 44.0]);
        assert_eq!(refined.found(), Some(Convergence::OfTheMesh));
        let mut without = all.to_vec();
        without[4] = None;
        assert_eq!(of(&without).found(), None);
        // Without a coarser mesh it is judged all the same.
        assert_eq!(of(&all[..9]).found(), Some(Convergence::OfTheMesh));
    }
}
