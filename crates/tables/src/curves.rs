//! Curves of a run as one long table: a row for each point.

use asperity_numbers::curve::{Curve, NamedCurves, Role};
use asperity_record::{Cell, CellValue, Column, ColumnKind};

use crate::table::Table;

/// The table of curves of this name, with the rows of all.
pub fn table(named: &NamedCurves, curves: &[Curve]) -> Table {
    // The units of numbers are those of the figure's axes, which differ from curve to curve.
    let number =
        |name, about| Column { unit: None, ..Column::with_unit(name, ColumnKind::Number, "1", about) };
    let roles = "measured, theory, static friction, sliding friction or guide.";
    let columns = vec![
        Column::new("curve", ColumnKind::Count, "Number of the curve, from 1 in the order of the figure."),
        Column::new("label", ColumnKind::Word, "What it is called in the legend, if it is not as its run."),
        Column::new("role", ColumnKind::Word, roles),
        Column::new("quantity", ColumnKind::Word, "The quantity upwards, with its unit."),
        number("x", "The quantity across, in the unit of the figure."),
        number("y", "The quantity upwards."),
    ];
    let mut table = Table::new(format!("/curve/{}", named.name), columns);
    let shown = curves.iter().filter(|curve| curve.role != Role::Remark);
    for (number, curve) in (1..).zip(shown) {
        let label = if curve.label.is_empty() { Cell::Empty } else { Cell::word(&curve.label) };
        let (role, quantity) = (Cell::word(curve.role.word()), Cell::word(named.y[curve.axis]));
        for point in &curve.points {
            let [x, y] = [point.0, point.1].map(|value| Some(value).filter(|value| !value.is_nan()).cell());
            table.push([Cell::Count(number), label.clone(), role.clone(), quantity.clone(), x, y]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use asperity_numbers::curve::{CurveKeys, NamedCurves};
    use asperity_numbers::run_data::RunData;
    use asperity_record::Cell;
    use asperity_testkit::made_up::{self, EVENTS};

    #[test]
    fn each_point_of_each_curve_is_a_row() {
        let named = NamedCurves::find("forces").unwrap();
        let run = made_up::run("", &EVENTS);
        let run = RunData { kept: named.required_data(&CurveKeys::default()), ..run };
        let curves = named.of(&run, &CurveKeys::default()).unwrap();
        let table = super::table(named, &curves);
        assert_eq!(table.file_part(), "curve.forces");
        assert_eq!(table.rows(), 4 * run.loads.len());
        let first: Vec<Cell> = table.row(0).collect();
        let word = |text: &'static str| Cell::Word(text.into());
        let at = run.loads[0].time_s;
        assert_eq!(first[..4], [Cell::Count(1), word("F_N"), word("measured"), word("force (N)")]);
        assert_eq!(first[4..], [Cell::Number(at), Cell::Number(400.0)]);
        let roles = table.values()[2].cell(run.loads.len());
        assert_eq!(roles, word("static friction"));
    }
}
