//! `L_p / L` against `F_T / F_N`: precursors as marks, the length law as a line
//! (Figures 5.9, 5.12, 5.21 to 5.24).

use std::collections::BTreeMap;

use asperity_model::analytic::{LengthLaw, LengthLawParameters};
use serde::Deserialize;

use super::plot::{Axis, Corner, Look, Panel, Series, Sheet, nth};
use super::{Figure, Labelled, run_names};
use crate::precursors::PrecursorRules;
use crate::run_data::RunData;
use crate::tables;

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Lengths {
    file: String,
    #[serde(default)]
    title: String,
    law: LengthLaw,
    series: Vec<Labelled>,
}

impl Lengths {
    pub(super) fn of_run(file: &str, run: &str, label: String, law: LengthLaw) -> Lengths {
        let series = vec![Labelled { run: run.to_owned(), label }];
        Lengths { file: file.to_owned(), title: String::new(), law, series }
    }
}

impl Figure for Lengths {
    fn file(&self) -> &str {
        &self.file
    }

    fn runs(&self) -> Vec<&str> {
        run_names(&self.series)
    }

    fn sheet(&self, runs: &BTreeMap<String, RunData>) -> Result<Sheet, String> {
        let mut series = Vec::new();
        let mut longest: f64 = 0.0;
        for (index, labelled) in self.series.iter().enumerate() {
            let run = labelled.find(runs)?;
            let (marker, dash, color) = nth(index);
            let parameters = LengthLawParameters::of(&run.scenario);
            let law: Vec<(f64, f64)> = (0..=400)
                .map(|i| f64::from(i) / 400.0)
                .map(|x| (self.law.load_ratio(&parameters, x), x))
                .collect();
            let points: Vec<(f64, f64)> = tables::precursor_points(run, self.law, &PrecursorRules::default())
                .into_iter()
                .map(|point| (point.ft_fn, point.lp_l))
                .collect();
            longest = law.iter().chain(&points).fold(longest, |longest, (load, _)| longest.max(*load));
            series.push(Series { label: labelled.label.clone(), points, look: Look::Marks(marker, color) });
            series.push(Series { label: labelled.label.clone(), points: law, look: Look::Line(dash, color) });
        }
        // Curves first, so that marks lie on top of them.
        let mut drawn = series.clone();
        drawn.sort_by_key(|series| matches!(series.look, Look::Marks(..)));
        Ok(Sheet::Single(Box::new(Panel {
            title: self.title.clone(),
            x: Axis::new("F_T/F_N", 0.0, longest * 1.06),
            y: Axis::new("L_p/L", 0.0, 1.08),
            series: drawn,
            legend: Corner::BottomRight,
            note: format!("marks: simulated, lines: {}", self.law.label()),
        })))
    }
}
