//! Quantities that follow from the parameters of scenarios before they are run.

use asperity_model::{Preview, Scenario};

use crate::html::markup::text;
use crate::parameter_table::range;
use crate::symbols::{lettered, symbol};

/// How a number is computed, and its meaning.
type Number = (&'static str, fn(&Preview) -> Option<f64>, &'static str, &'static str);

const NUMBERS: [Number; 8] = [
    ("rho", |preview| preview.density_kg_per_m3, "kg/m³", "density of the slider"),
    (
        "c",
        |preview| preview.wave_speed_m_per_s,
        "m/s",
        "speed of long waves; except in a chain, of shear waves",
    ),
    (
        "l_0",
        |preview| preview.decay_length_m,
        "m",
        "length over which stuck blocks screen a force on the end",
    ),
    ("dt / dt_max", |preview| preview.step_ratio, "", "time step over the longest stable one"),
    (
        "first slip at",
        |preview| preview.first_slip_s,
        "s",
        "time at which the first block reaches its static friction",
    ),
    (
        "F_T/F_N = mu_d at",
        |preview| preview.dynamic_load_s,
        "s",
        "time at which F_T/F_N reaches mu_d if nothing slides",
    ),
    (
        "F_T/F_N = mu_s at",
        |preview| preview.static_load_s,
        "s",
        "time at which F_T/F_N reaches mu_s if nothing slides",
    ),
    (
        "largest F_T/F_N",
        |preview| preview.largest_load_ratio,
        "",
        "F_T/F_N that the run reaches at most if nothing slides",
    ),
];

/// The numbers that follow from scenarios as a list, for the place beside the parameters; without those that no
/// scenario has, and as ranges where scenarios differ.
pub(crate) fn list<'a>(scenarios: impl Iterator<Item = &'a Scenario>) -> String {
    let previews: Vec<Preview> = scenarios.map(Scenario::preview).collect();
    let row = |(name, value, unit, meaning): &Number| {
        previews.iter().find_map(value)?;
        let value = range(previews.iter().filter_map(value));
        let is_symbol = !name.contains("F_T") && !name.contains(" at");
        let symbol = if is_symbol { symbol(name) } else { lettered(name) };
        Some(format!("<div title=\"{}\"><dt>{symbol}</dt><dd>{value} {unit}</dd></div>\n", text(meaning)))
    };
    format!("<dl class=\"main derived\">\n{}</dl>\n", NUMBERS.iter().filter_map(row).collect::<String>())
}

#[cfg(test)]
mod tests {
    use asperity_model::resolve;

    use super::list;

    #[test]
    fn what_follows_from_one_run_and_from_two() {
        let of = |set: &str| resolve("default", &["parameter_set=as-stated", set]).unwrap();
        let said = |scenarios: &[_]| -> Vec<String> {
            let list = list(scenarios.iter());
            let rows = list.lines().filter_map(|row| row.split_once("<dt>")?.1.strip_suffix("</dd></div>"));
            rows.map(|row| row.replace("</dt><dd>", " ")).collect()
        };
        let one = said(&[of("time.duration_s=4")]);
        assert_eq!(one.len(), 8);
        assert_eq!(one[0], "<i>ρ</i> 1200 kg/m³");
        assert_eq!(one[4], "first slip at 0.05674 s");
        assert_eq!(one[6], "F<sub>T</sub>/F<sub>N</sub> = μ<sub>s</sub> at 3.507 s");
        assert_eq!(one[7], "largest F<sub>T</sub>/F<sub>N</sub> 0.7984 ");
        let two = said(&[of("time.duration_s=4"), of("time.duration_s=5")]);
        assert_eq!(two[..7], one[..7]);
        assert_eq!(two[7], "largest F<sub>T</sub>/F<sub>N</sub> 0.7984 to 0.998 ");
    }
}
