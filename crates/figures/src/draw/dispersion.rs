//! Waves in the lattice of a slab: frequency against wave number along a row and along a diagonal.

use std::f64::consts::PI;

use asperity_numbers::plane_waves::Waves;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{Dash, GREY, Layer, Panel, Pen, Sheet};

keys! {
    Dispersion: run;

}

/// Marks along each line, and its points.
const MARKS: u32 = 16;
const POINTS: u32 = 400;

/// A little above the highest frequency of a lattice, the root of 6.
const HIGHEST: f64 = 2.7;

/// The frequency of one of the waves.
type Frequency = fn(Waves) -> f64;

impl Figure for Dispersion {
    of_one_run!();

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let lattice = run.plan.elastic;
        if lattice.longitudinal_over_shear().is_none() || lattice.axes() > 2 {
            return Err(format!(
                "run {} is of a {}, which has no lattice of two dimensions (accepted: a run of a slab or a sheet)",
                run.name, lattice.table.name
            ));
        }
        // From the longest waves to those of which neighbours move against each other; along a diagonal
        // they are as many as along a row, over a way that is longer by the root of 2.
        let directions = [("along a row", [1.0, 0.0]), ("along a diagonal", [1.0, 1.0])];
        let panel = |(title, direction): (&str, [f64; 2])| {
            let course = |count: u32, of: &dyn Fn([f64; 2]) -> f64| -> Vec<(f64, f64)> {
                let shares = (0..=count).map(|n| f64::from(n) / f64::from(count));
                shares.map(|share| (share, of(direction.map(|along| along * PI * share)))).collect()
            };
            let mut layers = vec![Layer::remark("marks: pull of the bonds, lines: theory")];
            let waves: [(_, Frequency, _); 2] =
                [("longitudinal", |waves| waves.longitudinal, 1.5f64), ("shear", |waves| waves.shear, 0.5)];
            for (n, (label, pick, square)) in waves.into_iter().enumerate() {
                // In the limit of long waves, over the length of the wave vector.
                let slope = square.sqrt() * direction[0].hypot(direction[1]) * PI;
                let limit = vec![(0.0, 0.0), (1.0, slope)];
                layers.push(Layer::line("no dispersion", limit, Dash::Dotted, GREY));
                let pen = Pen::nth(n, label);
                layers.push(pen.line(course(POINTS, &|wave| pick(Waves::in_theory(wave)))));
                let marks = course(MARKS, &|wave| pick(Waves::in_lattice(&lattice, wave)));
                layers.push(pen.marks(marks[1..].to_vec()));
            }
            let (x, y) = (Scale::between("q_x a/π", 0.0, 1.0), Scale::between("ω √(m/k)", 0.0, HIGHEST));
            Panel::new(x, y, layers).titled(title)
        };
        Ok(Sheet::of(directions.into_iter().map(panel).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::{Dispersion, Pen};
    use crate::draw::kind::Figure;
    use asperity_testkit::made_up;

    #[test]
    fn a_chain_has_no_lattice() {
        let figure: Dispersion = toml::from_str("file = 'f.png'\nrun = 'test'").unwrap();
        let refused = figure.part(&made_up::run("", &[]), Pen::nth(0, "")).unwrap_err();
        assert_eq!(
            refused,
            "run test is of a chain, which has no lattice of two dimensions (accepted: a run of a slab or a sheet)"
        );
    }
}
