//! Curves of a run as one long table: a row for each point.

use std::borrow::Cow;

use asperity_numbers::curve::{Curve, NamedCurves, Role};
use asperity_record::{Cell, Column, ColumnKind};

use crate::batch::Batch;
use crate::layout::Layout;

/// The table of curves of this name, with the rows of all.
pub fn table(named: &NamedCurves, curves: &[Curve]) -> (Layout, Batch) {
    // The units of numbers are those of the figure's axes, which differ from curve to curve.
    let number =
        |name, about| Column { unit: None, ..Column::with_unit(name, ColumnKind::Number, "1", about) };
    let columns = vec![
        Column::new("curve", ColumnKind::Count, "Number of the curve, from 1 in the order of the figure."),
        Column::new("label", ColumnKind::Word, "What it is called in the legend, if it is not as its run."),
        Column::new(
            "role",
            ColumnKind::Word,
            "measured, theory, static friction, sliding friction or guide.",
        ),
        Column::new("quantity", ColumnKind::Word, "The quantity upwards, with its unit."),
        number("x", "The quantity across, in the unit of the figure."),
        number("y", "The quantity upwards."),
    ];
    let mut rows = Batch::new(&columns);
    let shown = curves.iter().filter(|curve| curve.role != Role::Remark);
    for (number, curve) in (1..).zip(shown) {
        let label = Cell::Word(Cow::Owned(curve.label.clone()));
        let label = if curve.label.is_empty() { Cell::Empty } else { label };
        let (role, quantity) = (Cell::Word(curve.role.word().into()), named.y[curve.axis]);
        for (x, y) in &curve.points {
            let [x, y] = [*x, *y].map(|value| if value.is_nan() { Cell::Empty } else { Cell::Number(value) });
            rows.push(&[Cell::Count(number), label.clone(), role.clone(), Cell::Word(quantity.into()), x, y]);
        }
    }
    (Layout { topic: format!("/curve/{}", named.name).into(), columns }, rows)
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
        let (layout, rows) = super::table(named, &curves);
        assert_eq!(layout.file_part(), "curve.forces");
        assert_eq!(rows.rows(), 4 * run.loads.len());
        let first: Vec<Cell> = rows.columns().iter().map(|values| values.cell(0)).collect();
        let word = |text: &'static str| Cell::Word(text.into());
        let at = run.loads[0].time_s;
        assert_eq!(first[..4], [Cell::Count(1), word("F_N"), word("measured"), word("force (N)")]);
        assert_eq!(first[4..], [Cell::Number(at), Cell::Number(400.0)]);
        let roles = rows.columns()[2].cell(run.loads.len());
        assert_eq!(roles, word("static friction"));
    }
}
