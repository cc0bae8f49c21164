//! Waves in the lattice of a slab: frequency against wave number along a row and along a diagonal.

use std::f64::consts::PI;

use asperity_numbers::plane_waves::Waves;
use asperity_numbers::run_data::RunData;

use super::kind::{Figure, keys, of_one_run};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, GREY, INK, Layer, Marker, Panel, Sheet};

keys! {
    Dispersion: run;

}

/// Marks, and points of each line.
const MARKS: u32 = 16;
const POINTS: u32 = 400;

impl Figure for Dispersion {
    of_one_run!();

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        if run.plan.elastic.longitudinal_over_shear().is_none() {
            return Err(format!(
                "run {} is of a chain, which has no lattice (accepted: a run of a slab or a sheet)",
                run.name
            ));
        }
        let lattice = run.plan.elastic;
        if lattice.axes() > 2 {
            return Err(format!(
                "run {} is of a body, whose waves run in three dimensions (accepted: a run of a slab or a sheet)",
                run.name
            ));
        }
        // From the longest waves to those of which neighbours move against each other; along a diagonal
        // they are as many as along a row, over a way that is longer by the root of 2.
        let directions = [("along a row", [1.0, 0.0]), ("along a diagonal", [1.0, 1.0])];
        let panel = |(title, direction): (&str, [f64; 2])| {
            let at = |share: f64| direction.map(|along| along * PI * share);
            let share = |n: u32, of: u32| f64::from(n) / f64::from(of);
            let wave = |pick: fn(Waves) -> f64| {
                let measured = (1..=MARKS).map(|n| share(n, MARKS));
                let theory = (0..=POINTS).map(|n| share(n, POINTS));
                (
                    measured.map(|s| (s, pick(Waves::in_lattice(&lattice, at(s))))).collect::<Vec<_>>(),
                    theory.map(|s| (s, pick(Waves::in_theory(at(s))))).collect::<Vec<_>>(),
                )
            };
            let (long_marks, long_line) = wave(|waves| waves.longitudinal);
            let (shear_marks, shear_line) = wave(|waves| waves.shear);
            // In the limit of long waves, over the length of the wave vector.
            let length = (direction[0] * direction[0] + direction[1] * direction[1]).sqrt();
            let sound = |square: f64| {
                let slope = square.sqrt() * length * PI;
                let end = (HIGHEST / slope).min(1.0);
                Layer::line("no dispersion", vec![(0.0, 0.0), (end, slope * end)], Dash::Dotted, GREY)
            };
            let layers = vec![
                Layer::remark("marks: pull of the bonds, lines: theory"),
                sound(1.5),
                sound(0.5),
                Layer::line("longitudinal", long_line, Dash::Solid, INK),
                Layer::line("shear", shear_line, Dash::Dashed, BLUE),
                Layer::marks("longitudinal", long_marks, Marker::Circle, INK),
                Layer::marks("shear", shear_marks, Marker::Triangle, BLUE),
            ];
            let (x, y) = (Scale::between("q_x a/π", 0.0, 1.0), Scale::between("ω √(m/k)", 0.0, HIGHEST));
            Panel::new(x, y, layers).titled(title)
        };
        Ok(Sheet::of(directions.into_iter().map(panel).collect()))
    }
}

/// A little above the highest frequency of a lattice, the root of 6.
const HIGHEST: f64 = 2.7;

#[cfg(test)]
mod tests {
    use super::Dispersion;
    use crate::draw::kind::Figure;
    use asperity_testkit::made_up;

    #[test]
    fn a_chain_has_no_lattice() {
        let figure: Dispersion = toml::from_str("file = 'f.png'\nrun = 'test'").unwrap();
        let refused = figure.part(&made_up::run("", &[])).unwrap_err();
        assert_eq!(
            refused,
            "run test is of a chain, which has no lattice (accepted: a run of a slab or a sheet)"
        );
    }
}
