//! `L_p / L` against `F_T / F_N`: precursors as marks, the length law as a line
//! (Figures 5.9, 5.12, 5.21 to 5.24, 6.13, 6.15, 6.17, 6.19, 6.21).
//!
//! The laws are of chains, so that slabs have marks alone; and for a slider that is being driven. Where the drive is held, precursors
//! after that bear another mark, and the line is dashed beyond the load reached by then. Over an area each precursor
//! has a disc as well: the share of all contacts that slid, `A_p / A`, beside its length in columns.

use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters};
use asperity_numbers::precursors::{self, Precursor};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{NotKept, RunData};

use super::kind::{Figure, Parts, keys, of_runs_in, with_pens};
use super::scale::Scale;
use super::sheet::{BLUE, Dash, INK, Layer, Marker, Point, Shape, Sheet};
use crate::spec::{Measured, MeasuredFile};

keys! {
    Lengths: series;

    /// The law drawn as a line; slabs, sheets and bodies have none.
    law: Option<LengthLaw>,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns named `F_T/F_N` and `L_p/L`,
    /// each optionally with a column NAME_error. Its path is relative to this file.
    pub(super) measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    measured_label: Option<String>,
}

/// What is shown of a run.
pub(crate) struct Part {
    law: Vec<Point>,
    points: Vec<Point>,
    /// `A_p / A` over an area; else empty.
    areas: Vec<Point>,
    /// Both in their place, where the drive is held.
    beside_hold: Option<[Layer; 4]>,
}

/// A law from no length to that of the slider, in so many steps: the load at each.
pub(super) fn course(law: LengthLaw, parameters: &LengthLawParameters, steps: u32) -> Vec<Point> {
    let lengths = (0..=steps).map(|n| f64::from(n) / f64::from(steps));
    lengths.map(|length| (law.load_ratio(parameters, length), length)).collect()
}

impl Lengths {
    /// Its measured points.
    fn measured(&self) -> Result<Option<Measured>, String> {
        let names = [["ft_fn_onset", "F_T/F_N"], ["length_ratio", "L_p/L"]];
        MeasuredFile::points(&self.measured, &self.measured_label, names.map(|names| (names, false)))
    }
}

impl Figure for Lengths {
    of_runs_in!(series, Part);

    fn required_data(&self) -> RequiredData {
        RequiredData::LOADS
    }

    fn check(&self) -> Result<(), String> {
        self.measured().map(drop)
    }

    fn part(&self, run: &RunData) -> Result<Part, String> {
        let parameters = LengthLawParameters::of(&run.scenario);
        let law = self.law.filter(|_| LengthLaw::are_known(&run.scenario));
        let law = law.map_or_else(Vec::new, |law| course(law, &parameters, 400));
        let found = precursors::one_by_one(run);
        let points: Vec<Point> =
            found.iter().map(|found| (found.start.ft_fn_onset, found.length_ratio(run.columns()))).collect();
        let area = |found: &Precursor<'_>| (found.start.ft_fn_onset, found.area_ratio(run.header.blocks));
        let areas = if run.of_one_row().is_none() { found.iter().map(area).collect() } else { Vec::new() };
        let hold_step = run.plan.drive.hold_from_step;
        let beside_hold =
            hold_step.map(|hold_step| beside_hold(run, hold_step, &points, &law)).transpose()?;
        Ok(Part { law, points, areas, beside_hold })
    }

    fn sheet(&self, parts: Parts<Self::Part>) -> Result<Sheet, String> {
        let mut drawn = Vec::new();
        let mut longest: f64 = 0.0;
        let (mut any_line, mut is_over_area) = (false, false);
        for (pen, Part { law, points, areas, beside_hold }) in with_pens(&self.series, &parts)? {
            is_over_area |= !areas.is_empty();
            any_line |= !law.is_empty();
            longest = law.iter().chain(points).fold(longest, |longest, (load, _)| longest.max(*load));
            drawn.extend((!areas.is_empty()).then(|| pen.unlabelled().discs(areas.clone())));
            match beside_hold {
                None => {
                    drawn.push(pen.marks(points.clone()));
                    drawn.extend((!law.is_empty()).then(|| pen.line(law.clone())));
                }
                Some(of_both) => drawn.extend(of_both.iter().filter(|of| !of.points().is_empty()).cloned()),
            }
        }
        if let (Some(law), false) = (self.law, any_line) {
            return Err(format!(
                "law = {} has no line: {} is that of a chain, and no run is of one (accepted: no law, or a run of a \
                 chain)",
                law.file_word(),
                law.label()
            ));
        }
        let of_law = self.law.map(|law| format!("marks: simulated, lines: {}", law.label()));
        let of_areas = is_over_area.then(|| "discs: A_p/A".to_owned());
        let note: Vec<String> = of_law.into_iter().chain(of_areas).collect();
        // Curves first, so that marks lie on top of them.
        drawn.sort_by_key(|layer| matches!(layer.shape, Shape::Marks(..)));
        let x = Scale::between("F_T/F_N", 0.0, longest * 1.06);
        let y = Scale::between(if is_over_area { "L_p/L, A_p/A" } else { "L_p/L" }, 0.0, 1.08);
        let sheet = Sheet::single(x, y, drawn).noted(&note.join(", "));
        Ok(sheet.with_measured(self.measured()?.as_ref()))
    }
}

/// The precursors before the drive is held and after it, and the law up to the load reached
/// by then and beyond it.
fn beside_hold(
    run: &RunData,
    hold_step: u64,
    points: &[Point],
    law: &[Point],
) -> Result<[Layer; 4], NotKept> {
    let loads = run.loads()?;
    let found = precursors::one_by_one(run);
    let (before, after): (Vec<_>, Vec<_>) =
        found.iter().zip(points).partition(|(precursor, _)| precursor.start.onset_step < hold_step);
    let marks = |found: Vec<(_, &Point)>| found.into_iter().map(|(_, point)| *point).collect();
    let at_hold = loads.partition_point(|load| load.step <= hold_step);
    let reached = at_hold.checked_sub(1).map_or(0.0, |index| loads[index].load_ratio());
    let end = law.partition_point(|(load, _)| *load <= reached);
    let (valid, beyond) = (law[..end].to_vec(), law[end.saturating_sub(1)..].to_vec());
    let hold_s = run.plan.grid.time_s(hold_step);
    let (while_driven, once_held) = (format!("driven, t < {hold_s} s"), format!("held, t ≥ {hold_s} s"));
    Ok([
        Layer::marks(while_driven.clone(), marks(before), Marker::Circle, INK),
        Layer::marks(once_held.clone(), marks(after), Marker::Triangle, BLUE),
        Layer::line(while_driven, valid, Dash::Solid, INK),
        Layer::line(once_held, beyond, Dash::Dashed, BLUE),
    ])
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::{Figure, Lengths, Shape};
    use asperity_testkit::made_up::{self, EVENTS};

    /// The labels of the lines.
    fn lines(toml: &str) -> Result<Vec<String>, String> {
        let figure: Lengths = toml::from_str(toml).unwrap();
        let runs = [
            ("slab", made_up::slab(&EVENTS)),
            ("chain", made_up::run("", &EVENTS)),
            ("creeping", made_up::run("friction.law = 'rate-and-state'", &EVENTS)),
        ];
        let parts: BTreeMap<String, _> =
            runs.iter().map(|(name, run)| ((*name).to_owned(), figure.part(run).unwrap())).collect();
        let panel = figure.sheet(parts)?.panels.remove(0);
        let note = panel.layers.last().unwrap();
        assert_eq!(matches!(note.shape, Shape::Remark), toml.contains("law"), "{note:?}");
        let lines = panel.layers.into_iter().filter(|series| matches!(series.shape, Shape::Line(..)));
        Ok(lines.map(|series| series.label).collect())
    }

    /// Over an area lengths are in columns, and a disc shows the share of the contacts.
    #[test]
    fn a_sheet_has_discs_of_areas_beside_its_lengths() {
        let mut run = made_up::sheet(&[(100, 101, &[1]), (200, 210, &[1, 2, 5, 6])]);
        // As detectors find them: from columns to columns.
        run.slips[0].last_block = 1;
        run.slips[1].last_block = 2;
        let figure: Lengths =
            toml::from_str("file = 'f.png'\nseries = [{ run = 'a', label = 'A' }]").unwrap();
        let parts = BTreeMap::from([("a".to_owned(), figure.part(&run).unwrap())]);
        let panel = figure.sheet(parts).unwrap().panels.remove(0);
        let of = |is: fn(&Shape) -> bool| -> Vec<f64> {
            let series = panel.layers.iter().find(|series| is(&series.shape)).unwrap();
            series.points().iter().map(|(_, share)| *share).collect()
        };
        assert_eq!(of(|look| matches!(look, Shape::Marks(..))), [0.25, 0.5]);
        assert_eq!(of(|look| matches!(look, Shape::Discs(..))), [1.0 / 12.0, 4.0 / 12.0]);
        assert_eq!(panel.y.label(), "L_p/L, A_p/A");
        assert_eq!(panel.layers.last().unwrap().label, "discs: A_p/A");
    }

    /// The laws are those of chains by whose friction blocks stick.
    #[test]
    fn a_slab_has_marks_and_no_line() {
        let slab = "file = 'f.png'\nseries = [{ run = 'slab', label = 'a slab' }";
        let both = format!("{slab}, {{ run = 'chain', label = 'a chain' }}]");
        assert_eq!(lines(&both).unwrap(), Vec::<String>::new());
        assert_eq!(lines(&format!("law = 'eq-5.57'\n{both}")).unwrap(), ["a chain"]);
        let creeping = both.replace("'slab'", "'creeping'");
        assert_eq!(lines(&format!("law = 'eq-5.57'\n{creeping}")).unwrap(), ["a chain"]);
        assert_eq!(lines(&format!("{slab}]")).unwrap(), Vec::<String>::new());
        let refused = lines(&format!("law = 'eq-5.57'\n{slab}]")).unwrap_err();
        assert!(refused.contains("law = eq-5.57") && refused.contains("(accepted: no law, or"), "{refused}");
    }
}
