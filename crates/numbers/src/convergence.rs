//! What a number of a simulation is worth: whether it stays where the mesh is refined, where the time step is shortened,
//! and where the run is repeated with a modulus perturbed too little to see.

/// What happens to a number where mesh and time step are refined. Each number declares its own, for chains at a fixed
/// decay length and for lattices; `asperity refine` finds that of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Convergence {
    /// It stays within five per cent.
    Robust,
    /// It stays where a refined chain keeps its decay length, and not where it keeps `k_t / k`.
    AtDecayLength,
    /// It differs where nothing but a rounding does: one draw of a chaotic series.
    OneDraw,
    /// It changes with the mesh, beyond what draws differ by.
    OfTheMesh,
}

/// The most by which a robust number changes, over its value.
pub const MOST_CHANGE: f64 = 0.05;

/// A change with the mesh is one beyond chance if it is this many times that between draws.
const BEYOND_DRAWS: f64 = 2.0;

impl Convergence {
    /// All, each with its word, the mark of its numbers, and what follows for their use.
    pub const ALL: [(Convergence, &'static str, &'static str, &'static str); 4] = [
        (Convergence::Robust, "robust", "", "stays within 5 % on a finer mesh and with a shorter step"),
        (
            Convergence::AtDecayLength,
            "robust at fixed l_0",
            "=",
            "of a chain: converges at a fixed friction.decay_length_m alone",
        ),
        (
            Convergence::OneDraw,
            "one draw",
            "~",
            "one draw of a chaotic series: compare statistics of several runs",
        ),
        (
            Convergence::OfTheMesh,
            "of the mesh",
            "#",
            "changes with the mesh: belongs to this number of blocks",
        ),
    ];

    /// The word for it.
    pub fn word(self) -> &'static str {
        Convergence::ALL[self as usize].1
    }

    /// The mark of its numbers; empty for robust ones.
    pub fn mark(self) -> &'static str {
        Convergence::ALL[self as usize].2
    }

    /// What follows for the use of a number.
    pub fn why(self) -> &'static str {
        Convergence::ALL[self as usize].3
    }

    /// That of a number that changes by these ratios: on a finer mesh, with a shorter step, and between runs that differ
    /// by a perturbation.
    pub fn of_changes(mesh: f64, step: f64, perturbed: f64) -> Convergence {
        let draws = step.max(perturbed);
        match mesh.max(draws) {
            most if most <= MOST_CHANGE => Convergence::Robust,
            _ if mesh > MOST_CHANGE && mesh > BEYOND_DRAWS * draws => Convergence::OfTheMesh,
            _ => Convergence::OneDraw,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Convergence;

    #[test]
    fn a_change_is_of_the_mesh_only_beyond_what_draws_differ_by() {
        for (changes, expected) in [
            ([0.05, 0.05, 0.0], Convergence::Robust),
            ([0.06, 0.01, 0.0], Convergence::OfTheMesh),
            ([0.06, 0.01, 0.04], Convergence::OneDraw),
            ([0.0, 0.06, 0.0], Convergence::OneDraw),
            ([0.9, 0.3, 0.5], Convergence::OneDraw),
            ([0.9, 0.3, 0.2], Convergence::OfTheMesh),
        ] {
            let [mesh, step, perturbed] = changes;
            assert_eq!(Convergence::of_changes(mesh, step, perturbed), expected, "{changes:?}");
        }
    }

    #[test]
    fn each_has_its_own_place_word_and_mark() {
        for (at, (class, word, mark, why)) in Convergence::ALL.into_iter().enumerate() {
            assert_eq!(class as usize, at);
            assert_eq!((class.word(), class.mark(), class.why()), (word, mark, why));
        }
    }
}
