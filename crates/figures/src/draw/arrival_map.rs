//! Ruptures over the area of contact: when the front of one came to each contact, or how far each slid; and how far all
//! precursors reached, each by its outline in the colour of its load.

use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Arrival, Extent, Rupture, counted};
use schemars::JsonSchema;
use serde::Deserialize;

use super::area::{Area, sizes};
use super::colours::Colours;
use super::kind::{Figure, keys, of_one_run};
use super::rupture_selector::{Clock, RuptureSelector, Sort, film, sorted};
use super::scale::number;
use super::sheet::{INK, Layer, Marker, Pen, Point, Sheet};

keys! {
    ArrivalMap: run;

    /// The number of the rupture, as in its table.
    rupture: Option<u64>,
    /// The rupture, where `rupture` gives no number; if absent that of the most contacts.
    which: Option<RuptureSelector>,
    /// The quantity that colours show.
    #[serde(default)]
    shows: Shown,
    /// The end of the colour scale of arrivals, s after the onset; later arrivals have its colour. By default
    /// that of the last one.
    to_s: Option<f64>,
}

/// What can be shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Shown {
    /// The time from the onset to the arrival, with isochrones.
    #[default]
    Arrival,
    /// The size of the slip from the first detachment to the last re-attachment, with arrows of its direction.
    Slip,
}

impl Figure for ArrivalMap {
    of_one_run!(RequiredData::arrivals());

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let area = Area::of(run)?;
        let rupture = film(self.rupture, self.which, 0, self.to_s)?.rupture(run)?;
        let of_rupture = |arrival: &&Arrival| arrival.rupture == rupture.rupture;
        let arrivals: Vec<&Arrival> = run.arrivals()?.iter().filter(of_rupture).collect();
        if arrivals.is_empty() {
            let (run, rupture) = (&run.name, rupture.rupture);
            return Err(format!("the log of run {run} lacks the arrivals of rupture {rupture}"));
        }
        let (values, mut layers, colours) = match self.shows {
            Shown::Arrival => {
                let since_s = |arrival: &Arrival| arrival.arrival_s - rupture.onset_s;
                let last_s = arrivals.iter().map(|arrival| since_s(arrival)).fold(0.0, f64::max);
                let to_s = self.to_s.unwrap_or(last_s);
                let clock = Clock::of(0.0, to_s, 0.0);
                let colours = Colours::between(&clock.label("t − t_0"), &[0.0, clock.place(to_s)]);
                let came = of_contacts(&area, &arrivals, f64::NAN, |arrival| clock.place(since_s(arrival)));
                let levels = colours.scale.ticks_at_most(ISOCHRONES);
                // Half a step aside, so that no contact is on a line.
                let aside = clock.place(run.header.time_step_s / 2.0);
                let contours = levels.iter().flat_map(|tick| area.contours(&came, tick.at - aside));
                let contours: Vec<Vec<Point>> = contours.collect();
                let every = levels.get(1).filter(|_| !contours.is_empty());
                let every = every.map(|tick| number(tick.at - levels[0].at));
                let label = every.map(|every| format!("isochrones, every {every} {}", clock.unit));
                (came, vec![Layer::contours(label.unwrap_or_default(), contours)], colours)
            }
            Shown::Slip => {
                let vectors = of_contacts(&area, &arrivals, [f64::NAN; 2], |arrival| {
                    let slip_m = arrival.slip_m.zip(arrival.slip_across_m);
                    slip_m.map_or([f64::NAN; 2], |(along, across)| [along * 1e6, across * 1e6])
                });
                let sizes = sizes(&vectors);
                let longest = sizes.iter().copied().fold(0.0, f64::max);
                let colours = Colours::between("slip (µm)", &[0.0, longest]);
                (sizes, area.arrows(&vectors, longest, 1, " µm"), colours)
            }
        };
        let first = arrivals.iter().filter(|arrival| arrival.arrival_step == rupture.onset_step);
        let first: Vec<(f64, f64)> = first.map(|arrival| area.place(arrival.block)).collect();
        layers.push(Layer::discs("", first.clone(), DISC, plotters::prelude::WHITE));
        layers.push(Layer::marks("nucleation", first, Marker::Circle, INK));
        Ok(area.sheet(vec![(String::new(), values, layers)], colours).titled(title(run, rupture)?))
    }
}

/// Radius of the discs that mark the nucleation, in pixels.
const DISC: f64 = 10.0;

/// About how many isochrones there are.
const ISOCHRONES: f64 = 16.0;

/// A quantity of each contact: of those that the front did not come to, `none`.
fn of_contacts<Q: Clone>(area: &Area, arrivals: &[&Arrival], none: Q, of: impl Fn(&Arrival) -> Q) -> Vec<Q> {
    let mut all = vec![none; area.contacts.count() as usize];
    arrivals.iter().for_each(|arrival| all[arrival.block as usize - 1] = of(arrival));
    all
}

/// What a rupture was, and when.
pub(super) fn title(run: &RunData, rupture: &Rupture) -> Result<String, String> {
    let Rupture { rupture: number, onset_s, ft_fn_onset, .. } = rupture;
    let sorted = sorted(run)?;
    let sort = sorted.iter().find(|(other, _)| other.rupture == *number).map_or("", |(_, sort)| sort.label());
    let slipped = format!("{} of {} contacts", rupture.slipped(), run.header.blocks);
    Ok(format!("rupture {number}, {sort}: {slipped}, t_0 = {onset_s:.5} s, F_T/F_N = {ft_fn_onset:.4}"))
}

keys! {
    Outlines: run;

    /// Fewest contacts of a precursor that is shown.
    #[serde(default = "super::kind::number::<1>")]
    from_contacts: u32,
}

impl Figure for Outlines {
    of_one_run!(RequiredData::arrivals());

    fn part(&self, run: &RunData, _: Pen<'_>) -> Result<Sheet, String> {
        let area = Area::of(run)?;
        let arrivals = run.arrivals()?;
        let mut extents: Vec<(f64, Extent)> = Vec::new();
        for (rupture, sort) in sorted(run)? {
            if sort == Sort::Precursor && rupture.slipped() >= self.from_contacts {
                let of = arrivals.iter().filter(|arrival| arrival.rupture == rupture.rupture);
                let extent = Extent::with(area.contacts, of.map(|arrival| arrival.block));
                extents.extend((extent.count() > 0).then_some((rupture.ft_fn_onset, extent)));
            }
        }
        if extents.is_empty() {
            let (run, least) = (&run.name, self.from_contacts);
            return Err(format!("run {run} has no precursor of {least} contacts or more with arrivals"));
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
    use super::{ArrivalMap, Marker, Pen};
    use crate::draw::kind::Figure;
    use crate::draw::sheet::Shape;
    use asperity_numbers::run_data::RunData;
    use asperity_testkit::made_up;

    /// A precursor of four contacts, from both ends of the driven edge at once.
    fn run() -> RunData {
        let mut run = made_up::sheet(&[]);
        made_up::with_ruptures(
            &mut run,
            &[
                &[(1, 100, Some(900)), (9, 100, Some(900)), (5, 120, Some(900)), (6, 200, Some(900))],
                &[(4, 1000, None)],
            ],
        );
        run
    }

    fn figure(toml: &str) -> ArrivalMap {
        toml::from_str(&format!("file = 'f.png'\nrun = 'test'\n{toml}")).unwrap()
    }

    #[test]
    fn each_contact_has_the_colour_of_its_arrival() {
        let run = run();
        let sheet = figure("").part(&run, Pen::nth(0, "")).unwrap();
        let Shape::Cells(cells) = &sheet.panels[0].layers[0].shape else { panic!("{sheet:?}") };
        let bar = sheet.bar.as_ref().unwrap();
        assert_eq!(cells.len(), 4);
        // Steps of 0.1 µs: the last one after 10 µs has the end of the scale.
        assert!(bar.scale.label().contains("(µs)") && bar.scale.share(10.0).unwrap() > 1.0 - 1e-9);
        assert_eq!(cells[2].1, bar.at(1.0));
        let marks = sheet.layers().find_map(|layer| match &layer.shape {
            Shape::Marks(points, Marker::Circle) => Some(points.clone()),
            _ => None,
        });
        let marks = marks.unwrap();
        assert!(marks.len() == 2 && marks[0] == (0.0, 0.0) && (marks[1].1 - 200.0 / 3.0).abs() < 1e-9);
        assert!(
            sheet.title.starts_with("rupture 0, precursor: 4 of 12 contacts, t_0 = 0.00001 s"),
            "{}",
            sheet.title
        );
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_reason() {
        let mut run = run();
        let refused = |toml: &str, run: &RunData| figure(toml).part(run, Pen::nth(0, "")).unwrap_err();
        assert_eq!(refused("to_s = 0.0", &run), "to_s: 0 is not accepted (accepted: a number above 0)");
        assert_eq!(refused("rupture = 2", &run), "run test has no rupture 2 (accepted: 0 to 1)");
        assert_eq!(refused("which = 'first-global-slip'", &run), "run test has no global slip");
        run.arrivals.clear();
        assert_eq!(refused("", &run), "the log of run test lacks the arrivals of rupture 0");
        assert!(refused("", &made_up::run("", &[])).contains("lie in a single row"));
        let unknown = "file = 'f.png'\nrun = 'test'\nshows = 'speed'";
        let error = toml::from_str::<ArrivalMap>(unknown).unwrap_err().to_string();
        assert!(error.contains("`arrival` or `slip`"), "{error}");
    }
}

#[cfg(test)]
mod tests_of_outlines {
    use super::{Figure, Outlines, Pen};
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
            let sheet = figure(toml).part(&run, Pen::nth(0, "")).unwrap();
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
        let refused = figure("from_contacts = 4").part(&run, Pen::nth(0, "")).unwrap_err();
        assert_eq!(refused, "run test has no precursor of 4 contacts or more with arrivals");
    }
}
