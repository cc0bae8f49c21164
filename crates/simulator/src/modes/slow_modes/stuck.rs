//! The stuck lattice: its stiffness and damping, and its equilibrium.
//!
//! While every contact sticks and bears load, all forces are linear: springs and dashpots between
//! nodes, the friction springs `k_t` and the foundation `k_f` of each contact, the drive. The stiffness `M` is a
//! band ([`super::assembly`]), and so is Cholesky's factor of it. Even and odd motions ([`super::mirror`]) have
//! factors of their own, each found when it is first needed.
//!
//! A driving spring `K` without a mirrored one, as of a drive at one row, couples even and odd motions. It is
//! left out of the factors, and added by its effect on the solution (Sherman and Morrison 1950): with
//! `z = M^-1 e` for its freedom, `(M + K e e')^-1 f = M^-1 f - z K (e' M^-1 f) / (1 + K e' z)`.

use std::sync::OnceLock;

use asperity_model::plan::{Drive, DriveSpring};
use asperity_model::{Lattice, Plan};

use crate::kernels;
use crate::modes::complex::Complex;
use crate::modes::slow_modes::assembly::{Assembly, width};
use crate::modes::slow_modes::factor::Factor;
use crate::modes::slow_modes::mirror::{Motions, mirror_image, mirrors_itself};
use crate::records::stop::Stop;

/// Stiffness and damping of a stuck lattice.
#[derive(Debug)]
pub(crate) struct StuckLattice {
    pub(crate) lattice: Lattice,
    /// Stiffness on each freedom from springs other than those between nodes, if any: those that are
    /// mirror images of each other; and other ones.
    held_n_per_m: Vec<(usize, f64)>,
    coupling: Vec<Coupling>,
    /// `k_t`.
    interfacial_n_per_m: f64,
    pub(crate) step_s: f64,
    pub(crate) mass_kg: f64,
    /// The motions that the factored stiffness keeps apart.
    factors: Vec<Factored>,
    /// Those that the whole stiffness keeps apart.
    classes: Vec<Motions>,
}

/// Motions with Cholesky's factor of their stiffness; `None` if it is not positive by its numbers.
#[derive(Debug)]
struct Factored {
    motions: Motions,
    factor: OnceLock<Option<Factor<f64>>>,
}

/// SystemSizes of the systems by which the modes of a stuck lattice over an area are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SystemSizes {
    /// Classes of motions that the run has.
    pub(crate) classes: usize,
    /// Freedoms of each.
    pub(crate) freedoms: usize,
    /// Factors in which each class is solved.
    pub(crate) factors: usize,
    /// Numbers in a row of a factor's band.
    pub(crate) width: usize,
}

impl SystemSizes {
    pub(crate) fn of(plan: &Plan, lattice: &Lattice) -> SystemSizes {
        let (all, width) = (lattice.freedoms(), width(lattice) / 2);
        let couples = |spring: &DriveSpring| !is_mirrored(spring, &plan.drive, lattice);
        if plan.drive.springs.iter().any(couples) {
            return SystemSizes { classes: 1, freedoms: all, factors: 2, width };
        }
        let classes = if mirrors_itself(plan, lattice) { 1 } else { 2 };
        SystemSizes { classes, freedoms: all.div_ceil(2), factors: 1, width }
    }
}

/// Whether the drive has the mirror image of a spring.
fn is_mirrored(spring: &DriveSpring, drive: &Drive, lattice: &Lattice) -> bool {
    let image = mirror_image(lattice, spring.block);
    drive.springs.iter().any(|of| of.block == image && of.stiffness_n_per_m == spring.stiffness_n_per_m)
}

/// A spring that couples the motions of different factors.
#[derive(Debug)]
struct Coupling {
    freedom: usize,
    /// `K`, and `z`.
    stiffness_n_per_m: f64,
    compliance_m_per_n: Vec<f64>,
}

impl StuckLattice {
    /// Numbers that the factor of a slab has.
    pub(crate) fn numbers(lattice: &Lattice) -> usize {
        lattice.freedoms() * width(lattice)
    }

    /// `None` if the stiffness is not positive by its numbers, or the stop comes.
    pub(crate) fn of(plan: &Plan, lattice: Lattice, stop: &Stop<'_>) -> Option<StuckLattice> {
        let nodes = lattice.nodes();
        let kt = plan.friction.interfacial_stiffness_n_per_m;
        let friction = (0..lattice.tangential_axes())
            .flat_map(|axis| lattice.row(0).map(move |n| (axis * nodes + n, kt)));
        let upward = lattice.table.upward().into_iter();
        let foundation = upward
            .flat_map(|axis| lattice.row(0).map(move |n| (axis * nodes + n, lattice.foundation_n_per_m)));
        let (mirrored, coupled): (Vec<&DriveSpring>, Vec<&DriveSpring>) =
            plan.drive.springs.iter().partition(|spring| is_mirrored(spring, &plan.drive, &lattice));
        let held = |spring: &&DriveSpring| (spring.block, spring.stiffness_n_per_m);
        let held_n_per_m: Vec<(usize, f64)> =
            friction.chain(foundation).chain(mirrored.iter().map(held)).collect();
        let kept_apart = Motions::kept_apart(&lattice);
        let classes = if coupled.is_empty() { kept_apart.clone() } else { vec![Motions::all(&lattice)] };
        let factored = |motions: Motions| Factored { motions, factor: OnceLock::new() };
        let mut stuck = StuckLattice {
            lattice,
            held_n_per_m,
            interfacial_n_per_m: kt,
            step_s: plan.grid.step_s(),
            mass_kg: plan.block_mass_kg,
            classes,
            factors: kept_apart.into_iter().map(factored).collect(),
            coupling: Vec::new(),
        };
        stuck.factor(0, stop)?;
        for (freedom, stiffness_n_per_m) in coupled.iter().map(held) {
            let mut compliance_m_per_n = vec![0.0; stuck.freedoms()];
            compliance_m_per_n[freedom] = 1.0;
            if !stuck.solve(&mut compliance_m_per_n, stop) {
                return None;
            }
            stuck.coupling.push(Coupling { freedom, stiffness_n_per_m, compliance_m_per_n });
        }
        Some(stuck)
    }

    pub(crate) fn freedoms(&self) -> usize {
        self.lattice.freedoms()
    }

    /// The classes of motions that do not mix: even and odd ones, or all.
    pub(crate) fn classes(&self) -> &[Motions] {
        &self.classes
    }

    /// Turns forces into the displacements `x` with `M x = force`; `false` if the stiffness is not positive
    /// by its numbers, or the stop comes.
    pub(crate) fn solve(&self, force: &mut [f64], stop: &Stop<'_>) -> bool {
        let given = force.to_vec();
        force.fill(0.0);
        for (number, Factored { motions, .. }) in self.factors.iter().enumerate() {
            if motions.has_no_component(&given) {
                continue;
            }
            let (Some(factor), mut own) = (self.factor(number, stop), motions.component(&given)) else {
                return false;
            };
            factor.solve(&mut own);
            motions.add(force, &own);
        }
        for &Coupling { freedom, stiffness_n_per_m, ref compliance_m_per_n } in &self.coupling {
            let held_n_per_m = stiffness_n_per_m / (1.0 + stiffness_n_per_m * compliance_m_per_n[freedom]);
            let force_n = held_n_per_m * force[freedom];
            for (x, compliance) in force.iter_mut().zip(compliance_m_per_n) {
                *x -= force_n * compliance;
            }
        }
        true
    }

    /// [`StuckLattice::solve`] in the basis of a class.
    pub(crate) fn solve_in(&self, class: usize, force: &mut [f64], stop: &Stop<'_>) -> bool {
        if self.classes.len() < self.factors.len() {
            return self.solve(force, stop);
        }
        let Some(factor) = self.factor(class, stop) else { return false };
        factor.solve(force);
        true
    }

    /// `M u` and `C v`.
    pub(crate) fn products(&self, u: &[f64], v: &[f64]) -> [Vec<f64>; 2] {
        let mut products = [vec![0.0; u.len()], vec![0.0; v.len()]];
        let [stiff, damped] = &mut products;
        kernels::lattice_springs(stiff, u, &self.lattice);
        kernels::lattice_dashpots(damped, v, &self.lattice);
        for force in stiff.iter_mut().chain(damped) {
            *force = -*force;
        }
        for (freedom, stiffness_n_per_m) in self.held() {
            stiff[freedom] += stiffness_n_per_m * u[freedom];
        }
        products
    }

    /// [`StuckLattice::products`] with the same vector, in the basis of a class.
    pub(crate) fn products_in(&self, class: usize, x: &[f64]) -> [Vec<f64>; 2] {
        let motions = &self.classes[class];
        if motions.are_all() {
            return self.products(x, x);
        }
        let mut all = vec![0.0; self.freedoms()];
        motions.add(&mut all, x);
        self.products(&all, &all).map(|all| motions.component(&all))
    }

    /// `sqrt(k_t / m)` in units of the step.
    pub(crate) fn swing_rate(&self) -> f64 {
        self.step_s * (self.interfacial_n_per_m / self.mass_kg).sqrt()
    }

    /// The factor of `K + a + b D` for two numbers `a` and `b` in the basis of a class; `None` once the stop has come. The bands of a large sheet take longer to fill than a second.
    pub(crate) fn complex_factor(
        &self,
        class: usize,
        [a, b]: [Complex; 2],
        stop: &Stop<'_>,
    ) -> Option<Factor<Complex>> {
        let assembly = Assembly::of(&self.lattice, &self.classes[class]);
        let stiffness = assembly.stiffness(self.held());
        let damping = (!stop.look()).then(|| assembly.damping())?;
        let (by_stiffness, by_damping) =
            (self.step_s * self.step_s / self.mass_kg, self.step_s / self.mass_kg);
        let parts = stiffness.iter().zip(&damping);
        let joined = parts.map(|(k, c)| Complex::from(by_stiffness * k) + b.scale(by_damping * c));
        let mut band: Vec<Complex> = (!stop.look()).then(|| joined.collect())?;
        for diagonal in band.iter_mut().skip(assembly.width - 1).step_by(assembly.width) {
            *diagonal += a;
        }
        Factor::of_complex(band, assembly.width, assembly.place, stop)
    }

    /// All springs that hold freedoms.
    fn held(&self) -> impl Iterator<Item = (usize, f64)> {
        let coupled = self.coupling.iter().map(|coupling| (coupling.freedom, coupling.stiffness_n_per_m));
        self.held_n_per_m.iter().copied().chain(coupled)
    }

    fn factor(&self, number: usize, stop: &Stop<'_>) -> Option<&Factor<f64>> {
        let Factored { motions, factor } = &self.factors[number];
        stop.get_or_find(factor, || {
            let assembly = Assembly::of(&self.lattice, motions);
            let band = assembly.stiffness(self.held_n_per_m.iter().copied());
            Factor::of(band, assembly.width, assembly.place, stop)
        })
    }
}

#[cfg(test)]
mod tests {
    use asperity_model::resolve;
    use asperity_model::{Plan, mixed};

    use super::StuckLattice;
    use crate::modes::slow_modes::top_loads;
    use crate::records::stop::Stop;

    fn stuck(scenario: &str, sets: &[&str]) -> (Plan, StuckLattice) {
        let plan = Plan::new(&resolve(scenario, sets).unwrap_or_else(|error| panic!("{error}")));
        let stuck = StuckLattice::of(&plan, plan.elastic, &Stop::never());
        (plan, stuck.expect("it is positive"))
    }

    fn numbers(seed: u64, count: usize) -> Vec<f64> {
        (0..count).map(|n| mixed(seed << 32 | n as u64) as f64 / u64::MAX as f64 - 0.5).collect()
    }

    const BODY: [&str; 5] = [
        "slider.blocks=4",
        "slider.rows=3",
        "slider.height_m=0.09333333333333334",
        "slider.mass_kg=7.56",
        "drive.height_m=0.046666666666666667",
    ];

    #[test]
    fn what_is_solved_is_the_stuck_lattice() {
        let wide = ["slider.across=4", "slider.width_m=0.14"];
        let narrow = ["slider.across=3", "slider.width_m=0.09333333333333334"];
        for (scenario, sets) in [
            (
                "slab",
                vec!["slider.blocks=9", "slider.rows=5", "slider.height_m=0.07", "drive.height_m=0.0175"],
            ),
            (
                "slab",
                vec![
                    "slider.blocks=4",
                    "slider.rows=9",
                    "slider.height_m=0.37333333333333335",
                    "time.step_s=1e-8",
                ],
            ),
            ("body-coarse", [&BODY[..], &wide].concat()),
            ("body-coarse", [&BODY[..], &narrow].concat()),
            ("body-coarse", [&BODY[..], &narrow, &["drive.across=1"]].concat()),
            ("body-coarse", [&BODY[..], &narrow, &["drive.across=2"]].concat()),
            ("sheet-coarse", vec![]),
            ("sheet-coarse", vec!["drive.across=6"]),
        ] {
            let (plan, stuck) = stuck(scenario, &sets);
            let freedoms = stuck.freedoms();
            let u = numbers(1, freedoms);
            let [mut force, _] = stuck.products(&u, &u);
            assert!(stuck.solve(&mut force, &Stop::never()));
            for (found, u) in force.iter().zip(&u) {
                assert!((found - u).abs() < 1e-11, "{scenario} {sets:?}: {found} {u}");
            }
            // The state of rest is at rest in it.
            let rest = &plan.initial.displacement_m;
            let [mut force, _] = stuck.products(rest, rest);
            for spring in &plan.drive.springs {
                force[spring.block] -= spring.stiffness_n_per_m * spring.rest_m;
            }
            for (freedom, load_n) in top_loads(&plan) {
                force[freedom] += load_n;
            }
            assert!(force.iter().all(|force| force.abs() < 1e-9), "{force:?}");
        }
    }

    /// By elimination in the matrix of all freedoms, which knows no bands, no halves and no coupling.
    #[test]
    fn halves_and_coupling_solve_as_elimination_does() {
        for row in ["drive.across=0", "drive.across=1", "drive.across=2"] {
            for (across, width) in [("slider.across=3", "0.09333333333333334"), ("slider.across=4", "0.14")] {
                let width = format!("slider.width_m={width}");
                let (_, stuck) = stuck("body-coarse", &[&BODY[..], &[across, &width, row]].concat());
                let freedoms = stuck.freedoms();
                let mut rows: Vec<Vec<f64>> = (0..freedoms)
                    .map(|n| {
                        let mut unit = vec![0.0; freedoms];
                        unit[n] = 1.0;
                        let [row, _] = stuck.products(&unit, &unit);
                        row
                    })
                    .collect();
                let mut right = numbers(2, freedoms);
                let mut found = right.clone();
                assert!(stuck.solve(&mut found, &Stop::never()));
                for i in 0..freedoms {
                    let (above, below) = rows.split_at_mut(i + 1);
                    for (j, row) in below.iter_mut().enumerate() {
                        let factor = row[i] / above[i][i];
                        for k in i..freedoms {
                            row[k] -= factor * above[i][k];
                        }
                        right[i + 1 + j] -= factor * right[i];
                    }
                }
                for i in (0..freedoms).rev() {
                    let known: f64 = (i + 1..freedoms).map(|j| rows[i][j] * right[j]).sum();
                    right[i] = (right[i] - known) / rows[i][i];
                }
                let largest = right.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                for (found, expected) in found.iter().zip(&right) {
                    assert!((found - expected).abs() < 1e-12 * largest, "{row}: {found} {expected}");
                }
                let is_coupled = stuck.classes().len() == 1;
                assert_eq!(
                    is_coupled,
                    row != "drive.across=0" && !(row == "drive.across=2" && across == "slider.across=3")
                );
            }
        }
    }

    /// Even motions have even forces, odd ones odd forces, to the bit, and each class has its own solution.
    #[test]
    fn classes_of_motions_do_not_mix() {
        let (_, stuck) =
            stuck("body-coarse", &[&BODY[..], &["slider.across=4", "slider.width_m=0.14"]].concat());
        let freedoms = stuck.freedoms();
        assert_eq!(stuck.classes().iter().map(|motions| motions.size()).sum::<usize>(), freedoms);
        for (class, motions) in stuck.classes().iter().enumerate() {
            let own = numbers(3, motions.size());
            let mut all = vec![0.0; freedoms];
            motions.add(&mut all, &own);
            let [stiff, damped] = stuck.products(&all, &all);
            let other = &stuck.classes()[1 - class];
            assert!(
                other.has_no_component(&all)
                    && other.has_no_component(&stiff)
                    && other.has_no_component(&damped)
            );
            assert!(!motions.has_no_component(&all));
            let [mut own_stiff, _] = stuck.products_in(class, &own);
            assert!(stuck.solve_in(class, &mut own_stiff, &Stop::never()));
            for (found, own) in own_stiff.iter().zip(&own) {
                assert!((found - own).abs() < 1e-12, "{found} {own}");
            }
        }
    }
}
