//! `L_p / L` against `F_T / F_N`: precursors as marks, the length law as a line
//! (Figures 5.9, 5.12, 5.21 to 5.24, 6.13, 6.15, 6.17, 6.19, 6.21).
//!
//! The laws are of chains, so that slabs have marks alone; and for a slider that is being driven. Where the drive is held, precursors
//! after that bear another mark, and the line is dashed beyond the load reached by then. Over an area each precursor
//! has a disc as well: the share of all contacts that slid, `A_p / A`, beside its length in columns.

use asperity_model::theory::analytic::{LengthLaw, LengthLawParameters};
use asperity_numbers::precursors::{self, Precursor, PrecursorRules};
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::{NotKept, RunData};
use asperity_record::Rupture;
use schemars::JsonSchema;
use serde::Deserialize;

use super::kind::{Figure, keys, load_name, of_runs_in, overlaid};
use super::rupture_selector::no_ruptures;
use super::scale::Scale;
use super::sheet::{BLUE, Dash, INK, Layer, Marker, Panel, Pen, Point, Shape, Sheet};
use crate::spec::{Measured, MeasuredFile};

keys! {
    Lengths: series;

    /// What counts: by default ruptures, as in all numbers of a run, or slip events, as in the thesis. Where a slider
    /// creeps, one slip event may reach across it that is made of many ruptures.
    #[serde(default)]
    of: Of,
    /// The law drawn as a line; slabs, sheets, bodies and recordings have none.
    law: Option<LengthLaw>,
    /// A CSV file of measured points, drawn as diamonds with bars of errors: columns `ft_fn_onset` and
    /// `length_ratio`, each optionally with a column NAME_error. Its path is relative to this file, for `draw` to the
    /// current folder.
    pub(super) measured: Option<MeasuredFile>,
    /// What the legend calls them; by default the name of their file.
    measured_label: Option<String>,
}

/// What is taken for a precursor.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Of {
    /// A rupture.
    #[default]
    Ruptures,
    /// A slip event.
    SlipEvents,
}

/// Step of the onset, load there with its error, farthest column, and how many contacts slid.
type Found = (u64, [f64; 2], u32, u32);

impl Of {
    /// Precursors and the global slip that ends the list.
    fn found(self, run: &RunData) -> Result<Vec<Found>, String> {
        let load = |ft_fn: f64, error: Option<f64>| [ft_fn, error.unwrap_or(0.0)];
        let of_rupture =
            |of: &Rupture| (of.onset_step, load(of.ft_fn_onset, of.ft_fn_error), of.last_block, of.slipped());
        let of_slip = |of: Precursor<'_>| {
            (of.start.onset_step, load(of.start.ft_fn_onset, None), of.last_block, of.blocks_slipped)
        };
        let ruptures = || precursors::among_ruptures(run, &PrecursorRules::default());
        match self {
            Of::SlipEvents => Ok(precursors::one_by_one(run).into_iter().map(of_slip).collect()),
            Of::Ruptures if run.ruptures.is_none() => Err(no_ruptures(run)),
            Of::Ruptures => Ok(ruptures().into_iter().map(of_rupture).collect()),
        }
    }
}

/// A law from no length to that of the slider, in so many steps: the load at each.
pub(super) fn course(law: LengthLaw, parameters: &LengthLawParameters, steps: u32) -> Vec<Point> {
    let lengths = (0..=steps).map(|n| f64::from(n) / f64::from(steps));
    lengths.map(|length| (law.load_ratio(parameters, length), length)).collect()
}

impl Figure for Lengths {
    of_runs_in!(series, RequiredData::LOADS);

    fn measured(&self) -> Result<Option<Measured>, String> {
        let names = [["ft_fn_onset", "F_T/F_N"], ["length_ratio", "L_p/L"]];
        MeasuredFile::points(&self.measured, &self.measured_label, names.map(|names| (names, false)))
    }

    fn part(&self, run: &RunData, pen: Pen<'_>) -> Result<Sheet, String> {
        let parameters = LengthLawParameters::of(&run.scenario);
        let law = self.law.filter(|_| LengthLaw::are_known(&run.scenario) && !run.is_measured());
        let law = law.map_or_else(Vec::new, |law| course(law, &parameters, 400));
        let found = self.of.found(run)?;
        let share = |part: u32, all: u32| f64::from(part) / f64::from(all);
        let measured: Vec<_> = found.iter().map(|of| [of.1, run.header.length_ratio(of.2)]).collect();
        let points: Vec<Point> = measured.iter().map(|[load, length]| (load[0], length[0])).collect();
        let from_steps = found.iter().map(|found| found.0).zip(points.iter().copied());
        let area =
            |(_, [load, _], _, count): &(_, [f64; 2], _, u32)| (*load, share(*count, run.header.blocks));
        let areas = found.iter().filter(|_| run.of_one_row().is_none()).map(area).collect();
        let (x, y) = (Scale::free(load_name(run)?), Scale::between("L_p/L", 0.0, 1.08));
        let mut layers = vec![pen.called("").discs(areas), Layer::bars(&measured, [&x, &y], pen.look.2)];
        let hold_step = run.plan.drive.hold_from_step;
        match hold_step {
            Some(hold_step) => layers.extend(beside_hold(run, hold_step, from_steps, &law)?),
            None => layers.push(pen.line(law)),
        }
        layers.retain(|layer| !layer.points().is_empty());
        layers.extend(hold_step.is_none().then(|| pen.marks(points)));
        Ok(Sheet::single(x, y, layers))
    }

    fn together(&self, parts: Vec<Sheet>) -> Result<Sheet, String> {
        let Panel { mut layers, x, .. } = overlaid(parts).panels.remove(0);
        let is_over_area = layers.iter().any(|layer| matches!(layer.shape, Shape::Discs(..)));
        // Bars of errors have no row in the legend.
        let (bars, lines): (Vec<&Layer>, Vec<&Layer>) = (layers.iter())
            .filter(|layer| matches!(layer.shape, Shape::Line(..)))
            .partition(|line| line.label.is_empty());
        if let (Some(law), true) = (self.law, lines.is_empty()) {
            return Err(format!(
                "law = {} has no line: {} is that of a chain, and no run is of one (accepted: no law, or a run of a \
                 chain)",
                law.word(),
                law.label()
            ));
        }
        let marks = if bars.is_empty() { "marks: simulated, " } else { "" };
        let of_law = self.law.map(|law| format!("{marks}lines: {}", law.label()));
        let of_areas = is_over_area.then(|| "discs: A_p/A".to_owned());
        let note: Vec<String> = of_law.into_iter().chain(of_areas).collect();
        // Curves first, so that marks lie on top of them.
        layers.sort_by_key(|layer| matches!(layer.shape, Shape::Marks(..)));
        let longest = layers.iter().flat_map(Layer::points).fold(0.0, |longest: f64, at| longest.max(at.0));
        let x = Scale::between(&x.label(), 0.0, longest * 1.06);
        let y = Scale::between(if is_over_area { "L_p/L, A_p/A" } else { "L_p/L" }, 0.0, 1.08);
        Ok(Sheet::single(x, y, layers).noted(&note.join(", ")))
    }
}

/// The precursors before the drive is held and after it, and the law up to the load reached
/// by then and beyond it.
fn beside_hold(
    run: &RunData,
    hold_step: u64,
    precursors: impl Iterator<Item = (u64, Point)>,
    law: &[Point],
) -> Result<[Layer; 4], NotKept> {
    let loads = run.loads()?;
    let (before, after): (Vec<_>, Vec<_>) = precursors.partition(|(onset_step, _)| *onset_step < hold_step);
    let marks = |found: Vec<(_, Point)>| found.into_iter().map(|(_, point)| point).collect();
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
    use super::{Figure, Lengths, Pen, Shape};
    use asperity_testkit::made_up::{self, EVENTS};

    /// The labels of the lines.
    fn lines(toml: &str) -> Result<Vec<String>, String> {
        let figure: Lengths = toml::from_str(toml).unwrap();
        let runs = [
            ("slab", made_up::slab(&EVENTS)),
            ("chain", made_up::run("", &EVENTS)),
            ("creeping", made_up::run("friction.law = 'rate-and-state'", &EVENTS)),
        ];
        let run = |name: &str| &runs.iter().find(|(of, _)| *of == name).unwrap().1;
        let parts = figure.runs().into_iter().map(|(name, pen)| figure.part(run(name), pen).unwrap());
        let panel = figure.sheet(parts.collect())?.panels.remove(0);
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
            toml::from_str("file = 'f.png'\nof = 'slip-events'\nseries = [{ run = 'a', label = 'A' }]")
                .unwrap();
        let part = figure.part(&run, Pen::nth(0, "A")).unwrap();
        let panel = figure.sheet(vec![part]).unwrap().panels.remove(0);
        let of = |is: fn(&Shape) -> bool| -> Vec<f64> {
            let series = panel.layers.iter().find(|series| is(&series.shape)).unwrap();
            series.points().iter().map(|(_, share)| *share).collect()
        };
        assert_eq!(of(|look| matches!(look, Shape::Marks(..))), [0.25, 0.5]);
        assert_eq!(of(|look| matches!(look, Shape::Discs(..))), [1.0 / 12.0, 4.0 / 12.0]);
        assert_eq!(panel.y.label(), "L_p/L, A_p/A");
        assert_eq!(panel.layers.last().unwrap().label, "discs: A_p/A");
    }

    /// One slip event of a creeping slider contains two ruptures, of which the first one stops half-way.
    #[test]
    fn ruptures_count_unless_slip_events_are_asked_for() {
        let mut run = made_up::run("", &[(100, 900, &[1, 2, 3])]);
        made_up::with_ruptures(&mut run, &[&[(1, 100, Some(400)), (2, 200, Some(900))]]);
        let lengths = |of: &str| -> Vec<f64> {
            let toml = format!("file = 'f.png'\n{of}\nseries = [{{ run = 'a', label = 'A' }}]");
            let figure: Lengths = toml::from_str(&toml).unwrap();
            let part = figure.part(&run, Pen::nth(0, "A")).unwrap();
            part.layers().flat_map(|layer| layer.points()).map(|(_, length)| length).collect()
        };
        assert_eq!(lengths("of = 'slip-events'"), [1.0]);
        assert_eq!(lengths(""), [2.0 / 3.0]);
    }

    /// The laws are those of chains by whose friction blocks stick.
    #[test]
    fn a_slab_has_marks_and_no_line() {
        let slab = "file = 'f.png'\nof = 'slip-events'\nseries = [{ run = 'slab', label = 'a slab' }";
        let both = format!("{slab}, {{ run = 'chain', label = 'a chain' }}]");
        assert_eq!(lines(&both).unwrap(), Vec::<String>::new());
        assert_eq!(lines(&format!("law = 'linear'\n{both}")).unwrap(), ["a chain"]);
        let creeping = both.replace("'slab'", "'creeping'");
        assert_eq!(lines(&format!("law = 'linear'\n{creeping}")).unwrap(), ["a chain"]);
        assert_eq!(lines(&format!("{slab}]")).unwrap(), Vec::<String>::new());
        let refused = lines(&format!("law = 'linear'\n{slab}]")).unwrap_err();
        assert!(refused.contains("law = linear") && refused.contains("(accepted: no law, or"), "{refused}");
    }
}
