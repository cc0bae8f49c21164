//! How far precursors reached over the area of contact: the outline of each, in the colour of its load.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Extent, counted};

use super::area::Area;
use super::colours::Colours;
use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Sort, sorted};
use super::sheet::{Layer, Sheet};

keys! {
    Outlines: run;

    /// Fewest contacts of a precursor that is shown.
    #[serde(default = "one")]
    from_contacts: u32,
}

/// The fewest there are.
pub(super) fn one() -> u32 {
    1
}

impl Figure for Outlines {
    of_one_run!();

    fn required_data(&self) -> RequiredData {
        RequiredData::arrivals()
    }

    fn part(&self, run: &RunData) -> Result<Sheet, String> {
        let area = Area::of(run)?;
        let arrivals = run.arrivals()?;
        let precursors = sorted(run)?
            .into_iter()
            .filter(|(rupture, sort)| *sort == Sort::Precursor && rupture.slipped() >= self.from_contacts);
        let extents: Vec<(f64, Extent)> = precursors
            .map(|(rupture, _)| {
                let of = arrivals.iter().filter(|arrival| arrival.rupture == rupture.rupture);
                (rupture.ft_fn_onset, Extent::with(area.contacts, of.map(|arrival| arrival.block)))
            })
            .filter(|(_, extent)| extent.count() > 0)
            .collect();
        if extents.is_empty() {
            return Err(format!(
                "run {} has no precursor of {} contacts or more with arrivals",
                run.name, self.from_contacts
            ));
        }
        let loads: Vec<f64> = extents.iter().map(|(load, _)| *load).collect();
        // A contact has the colour of the first precursor that it slid in.
        let first = |contact| extents.iter().find(|(_, extent)| extent.contains(contact));
        let values = area.all().map(|contact| first(contact).map_or(f64::NAN, |(load, _)| *load)).collect();
        let outlines =
            extents.iter().flat_map(|(_, extent)| area.outlines(&|contact| extent.contains(contact)));
        let label =
            format!("{}, outlined, by F_T/F_N at the onset", counted(extents.len() as u64, "precursor"));
        let outlines = Layer::contours(label, outlines.collect());
        Ok(area.sheet(vec![(String::new(), values, vec![outlines])], Colours::between("F_T/F_N", &loads)))
    }
}

#[cfg(test)]
mod tests {
    use super::{Figure, Outlines};
    use crate::draw::sheet::Shape;
    use asperity_testkit::made_up;

    #[test]
    fn each_precursor_has_an_outline_and_the_color_of_its_load() {
        let mut run = made_up::sheet(&[]);
        made_up::with_ruptures(
            &mut run,
            &[
                &[(1, 100, Some(200)), (5, 110, Some(200))],
                &[(12, 300, Some(400))],
                &[(1, 500, Some(600)), (2, 510, Some(600)), (6, 520, Some(600))],
            ],
        );
        let figure = |toml: &str| -> Outlines {
            toml::from_str(&format!("file = 'f.png'\nrun = 'test'\n{toml}")).unwrap()
        };
        let shown = |toml: &str| {
            let sheet = figure(toml).part(&run).unwrap();
            match &sheet.panels[0].layers[..] {
                [cells, lines, ..] => match (&cells.shape, &lines.shape) {
                    (Shape::Cells(cells), Shape::Contours(lines)) => {
                        (cells.iter().map(|(_, color)| *color).collect::<Vec<_>>(), lines.len())
                    }
                    other => panic!("{other:?}"),
                },
                other => panic!("{other:?}"),
            }
        };
        // Contacts 1 and 5 of the first, 2 and 6 of the other; that of contact 12 is none.
        let (colors, lines) = shown("");
        assert_eq!(lines, 2);
        assert!(
            colors.len() == 4 && colors[0] == colors[2] && colors[1] == colors[3] && colors[0] != colors[1]
        );
        assert_eq!(shown("from_contacts = 3").1, 1);
        let refused = figure("from_contacts = 4").part(&run).unwrap_err();
        assert_eq!(refused, "run test has no precursor of 4 contacts or more with arrivals");
    }
}
