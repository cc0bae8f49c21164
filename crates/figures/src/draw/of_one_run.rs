//! Figures of one run, or of two beside each other, without a pipeline: what a pipeline says of a kind, and what
//! `draw` fills in where nobody gives it.

use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use asperity_files::FileSet;
use asperity_model::Scenario;
use asperity_model::scenario::{text, typed};
use asperity_model::theory::analytic::LengthLaw;
use asperity_numbers::curve::NamedCurves;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use asperity_record::{Parts, RunHeader};
use serde_json::{Map, Value, json};

use super::print;
use super::print::about::About;
use super::print::page::Page;
use super::sheet::{Panel, Sheet};
use super::{Caption, FigureError, Figures, Origins, drawn};
use crate::keys::{self, Explained};

/// Kinds that compare runs, and show next to nothing of one.
const OF_SEVERAL: [&str; 4] = ["family", "front-speed", "stability-boundary", "study"];

/// The kind of figures of curves, which go by the names of the curves.
const CURVE: &str = "curve";

/// The kinds that are drawn where none is named: what is asked first of a run.
const USUAL: [&str; 5] = ["overview", "lengths", "space-time", "front-profile", "stress-sequence"];

/// Those that are drawn as well of runs over an area, and only of these.
const USUAL_OVER_AREA: [&str; 2] = ["arrival-map", "outlines"];

/// The usual ones of recordings, and others that are drawn of these: the rest shows what nobody has measured.
const USUAL_OF_RECORDINGS: [&str; 5] = ["load", "lengths", "space-time", "traces", "noise"];
const OF_RECORDINGS: [&str; 3] = ["load-ruptures", "moment-duration", "recurrence"];

/// Keys that follow from the run.
const FILLED_IN: [&str; 6] = ["file", "run", "series", "panel", "curve", "keys"];

/// All kinds, as their types describe them.
static EXPLAINED: LazyLock<Vec<Explained>> = LazyLock::new(keys::figures);

/// A kind of figure that one run allows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Kind {
    /// What it is called, here and in pipelines.
    pub name: &'static str,
}

impl Kind {
    /// All kinds, by name.
    pub fn all() -> impl Iterator<Item = Kind> {
        let names = EXPLAINED.iter().map(|kind| &*kind.name);
        names.filter(|name| !OF_SEVERAL.contains(name)).map(|name| Kind { name })
    }

    /// The kind of this name.
    pub fn find(name: &str) -> Option<Kind> {
        Kind::all().find(|kind| kind.name == name)
    }

    /// Those that are drawn of a run with these parts where none is named.
    pub fn usual(parts: Parts) -> impl Iterator<Item = Kind> {
        let usual = if parts.recording { USUAL_OF_RECORDINGS } else { USUAL };
        let over_area = USUAL_OVER_AREA.into_iter().filter(move |_| parts.area);
        usual.into_iter().chain(over_area).map(|name| Kind { name })
    }

    /// The curves that it shows, if nothing else.
    fn curves(self) -> Option<&'static NamedCurves> {
        NamedCurves::all().iter().find(|curves| curves.name == self.name)
    }

    /// Its name in a pipeline.
    fn in_pipelines(self) -> &'static str {
        self.curves().map_or(self.name, |_| CURVE)
    }

    fn explained(self) -> &'static Explained {
        EXPLAINED.iter().find(|kind| kind.name == self.name).expect("kinds are found among these")
    }

    fn all_keys(self) -> impl Iterator<Item = &'static str> {
        self.explained().parts.iter().map(|key| &*key[0])
    }

    /// What it shows: the first sentence of its description.
    pub fn shows(self) -> String {
        let about = &self.explained().about;
        about.split_once(". ").map_or(&**about, |(first, _)| first).trim_end_matches('.').to_owned()
    }

    /// The keys that may be given.
    pub fn keys(self) -> Vec<&'static str> {
        let own = self.all_keys().map(|key| key.trim_start_matches("keys."));
        own.filter(|key| !FILLED_IN.contains(&key.split('.').next().unwrap_or(key))).collect()
    }

    /// Checks keys, each given as `KEY=VALUE`, before any run is read.
    ///
    /// # Errors
    /// In words, with the key, the value and what is accepted.
    pub fn check(self, set: &[String]) -> Result<(), String> {
        let any = Extent { blocks: 100, columns: 100, duration_s: 1.0, law: None };
        self.figures(&[("run", "run")], &any, set).map(drop)
    }

    /// The figure of a run, with keys that are given as `KEY=VALUE`.
    ///
    /// # Errors
    /// As [`Kind::check`].
    pub fn of_run(
        self,
        run: &str,
        header: &RunHeader,
        scenario: &Scenario,
        set: &[String],
    ) -> Result<OneFigure, String> {
        let known = [&USUAL_OF_RECORDINGS[..], &OF_RECORDINGS].concat();
        if header.sensors.is_some() && !known.contains(&self.name) {
            let (name, known) = (self.name, known.join(", "));
            return Err(format!(
                "{run} is a recording, and {name} shows what only a simulation knows (accepted: {known})"
            ));
        }
        let about = Extent::of(header, scenario);
        let figures = self.figures(&[(run, run)], &about, set)?;
        Ok(OneFigure { kind: self, figures, may_be_empty: false })
    }

    /// The figure of two runs of a kind that shows several, each with its label, with keys that are given as
    /// `KEY=VALUE`.
    ///
    /// # Errors
    /// As [`Kind::check`].
    pub fn of_two(self, runs: [(&RunData, &str); 2], set: &[String]) -> Result<OneFigure, String> {
        let [old, new] = runs.map(|(run, _)| Extent::of(&run.header, &run.scenario));
        let about = Extent { law: old.law.or(new.law), ..old };
        let figures = self.figures(&runs.map(|(run, label)| (&*run.name, label)), &about, set)?;
        Ok(OneFigure { kind: self, figures, may_be_empty: false })
    }

    /// Of runs, each with its label.
    fn figures(self, runs: &[(&str, &str)], about: &Extent, set: &[String]) -> Result<Figures, String> {
        let mut keys = about.usual(self.name);
        // In labels an underscore sets a subscript.
        let entry = |(run, label): &(&str, &str)| {
            let label = label.replace('_', "\\_");
            match self.name {
                "front-speeds" => json!({ "runs": [run], "label": label }),
                _ => json!({ "run": run, "label": label }),
            }
        };
        let has_series = self.all_keys().any(|key| key == "series");
        for key in self.all_keys() {
            let value = match key {
                "file" => json!(format!("{}.png", self.name)),
                "run" if !has_series => json!(runs[0].0),
                "curve" => json!(self.name),
                "series" | "panel" => runs.iter().map(entry).collect(),
                _ => continue,
            };
            keys.insert(key.to_owned(), value);
        }
        let understood = |keys: &Map<String, Value>| {
            let figures: Figures = serde_json::from_value(json!({ self.in_pipelines(): [keys] }))?;
            Ok::<_, serde_json::Error>(figures)
        };
        let mut figures = understood(&keys).map_err(|error| error.to_string())?;
        for assignment in set {
            let (key, value) = assignment
                .split_once('=')
                .ok_or_else(|| format!("{assignment:?} (accepted: KEY=VALUE, as in title=Block)"))?;
            if !self.keys().contains(&key) {
                return Err(format!(
                    "{key}: figures of the kind {} have no such key (accepted: {})",
                    self.name,
                    self.keys().join(", ")
                ));
            }
            // A value that is nothing else is text.
            let value = serde_json::from_str(value).unwrap_or_else(|_| json!(value));
            if self.curves().is_some_and(|curves| curves.keys.contains(&key)) {
                keys.entry("keys").or_insert_with(|| json!({}))[key] = value;
            } else {
                keys.insert(key.to_owned(), value);
            }
            let in_words = |error: serde_json::Error| {
                typed::in_words(assignment, &error.to_string(), "`asperity figures`")
            };
            figures = understood(&keys).map_err(in_words)?;
        }
        let read = |path: &str| text::read(path.as_ref()).map_err(|error| error.to_string());
        figures.measured_mut().try_for_each(|file| file.read(read))?;
        figures.check().map(|()| figures)
    }
}

/// What keys follow from where nobody gives them.
struct Extent {
    /// Blocks; over an area contacts, and how many of them are in a row.
    blocks: u32,
    columns: u32,
    duration_s: f64,
    /// The law of precursors' lengths, if the scenario has one.
    law: Option<LengthLaw>,
}

impl Extent {
    fn of(header: &RunHeader, scenario: &Scenario) -> Extent {
        Extent {
            blocks: header.blocks,
            columns: header.contacts().columns(),
            duration_s: header.time_grid().time_s(header.steps),
            law: (header.sensors.is_none() && LengthLaw::is_for(scenario))
                .then(|| LengthLaw::natural(scenario)),
        }
    }

    /// Keys that pipelines must give, and `draw` need not.
    fn usual(&self, kind: &str) -> Map<String, Value> {
        let Extent { blocks, columns, duration_s, law } = self;
        let keys = match kind {
            "load" => json!({ "sliding": true }),
            "lengths" => law.map_or_else(|| json!({}), |law| json!({ "law": law })),
            // Enough for fronts that are faster than waves.
            "front-stress" => json!({ "to_speed": 2.0 }),
            "stress" => {
                json!({ "at_s": [0.0, duration_s / 3.0, 2.0 * duration_s / 3.0, duration_s] })
            }
            "junction-forces" => json!({ "keys": { "at_s": [0.0, duration_s], "after_slips": true } }),
            "displacement" => {
                let mut shown = vec![1, blocks.div_ceil(2), *blocks];
                shown.dedup();
                json!({ "keys": { "at_blocks": shown } })
            }
            "onset" => json!({ "blocks": columns, "logarithmic": false }),
            // At rest: later times are found by taking the steps up to them.
            "slab-field" => json!({ "at_s": [0.0], "shows": "shear-stress" }),
            "area-field" => {
                json!({ "at_s": [0.0, duration_s / 2.0], "shows": "stress", "arrows": true })
            }
            _ => json!({}),
        };
        keys.as_object().cloned().unwrap_or_default()
    }
}

/// Where a figure is written to.
#[derive(Debug, Clone)]
pub enum Target {
    /// A folder, as `KIND.png`, `KIND.svg` and `KIND.pdf`.
    Folder(PathBuf),
    /// One file, in the format that its ending names.
    File(PathBuf),
}

impl Target {
    /// What `-o PATH` means: a file, if it ends in `.png`, `.svg` or `.pdf`.
    pub fn of(path: &Path) -> Target {
        let ending = path.extension().and_then(|ending| ending.to_str());
        match ending {
            Some(ending) if print::ENDINGS.contains(&ending) => Target::File(path.to_owned()),
            _ => Target::Folder(path.to_owned()),
        }
    }

    /// The files of a kind.
    pub fn files(&self, kind: Kind) -> Vec<PathBuf> {
        match self {
            Target::Folder(folder) => {
                print::files_of(&folder.join(format!("{}.png", kind.name))).into_iter().collect()
            }
            Target::File(file) => vec![file.clone()],
        }
    }
}

/// A figure of one run, or of two.
pub struct OneFigure {
    /// Its kind.
    pub kind: Kind,
    figures: Figures,
    may_be_empty: bool,
}

impl OneFigure {
    /// It, drawn even of a run that has nothing that it shows.
    #[must_use]
    pub fn or_empty(self) -> OneFigure {
        OneFigure { may_be_empty: true, ..self }
    }

    /// What it reads of the run.
    pub fn required_data(&self) -> RequiredData {
        self.figures.all()[0].1.required_data()
    }

    /// Draws it, as files of a set. `provenance` is whether it names the code and bears a line at its foot.
    ///
    /// # Errors
    /// If the run has not what it shows, or a file cannot be written.
    pub fn draw(
        &self,
        run: &RunData,
        provenance: bool,
        files: &FileSet,
        target: &Target,
    ) -> Result<(), FigureError> {
        let (page, about) = self.drawn(&[run], provenance)?;
        print::write(&page, &about, files, &target.files(self.kind))
    }

    /// Draws it of the runs that it was asked for, in the format that an ending names, without a file; with what is
    /// said of it.
    ///
    /// # Errors
    /// If the runs have not what it shows.
    pub fn bytes(
        &self,
        runs: &[&RunData],
        provenance: bool,
        ending: &str,
    ) -> Result<(Vec<u8>, Caption), FigureError> {
        let (page, about) = self.drawn(runs, provenance)?;
        let bytes = print::bytes(&page, &about, ending).map_err(|problem| self.failed(problem))?;
        Ok((bytes, about.words))
    }

    fn drawn(&self, runs: &[&RunData], provenance: bool) -> Result<(Page, About), FigureError> {
        let mut origins = Origins::default();
        runs.iter().for_each(|run| origins.add(&Origins::of_run(&run.header)));
        let drawn = self.sheet(runs).and_then(|(what, sheet)| drawn(what, &sheet, origins, provenance));
        drawn.map_err(|problem| self.failed(problem))
    }

    fn failed(&self, problem: String) -> FigureError {
        FigureError::Figure { file: self.kind.name.to_owned(), problem }
    }

    /// What is on it, in words that need no thesis; and what figures of its kind show.
    fn sheet(&self, runs: &[&RunData]) -> Result<(&'static str, Sheet), String> {
        let (what, figure) = self.figures.all()[0];
        let parts = figure.runs().into_iter().zip(runs).map(|((_, pen), run)| figure.part(run, pen));
        let sheet = figure.sheet(parts.collect::<Result<_, _>>()?)?;
        if !self.may_be_empty && sheet.all_panels().all(Panel::is_empty) {
            return Err(format!("run {} has nothing that figures of this kind show", runs[0].name));
        }
        Ok((what, sheet))
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use asperity_record::Parts;

    use super::{EXPLAINED, Kind, OF_RECORDINGS, OF_SEVERAL, Target, USUAL_OF_RECORDINGS};
    use crate::draw::tests::first_day::runs;
    use crate::draw::{Caption, words};

    #[test]
    fn every_kind_has_keys_that_draw_it() {
        let usual =
            [Parts::default(), Parts { area: true, ..Parts::default() }].into_iter().flat_map(Kind::usual);
        let named = usual.map(|kind| kind.name).chain(USUAL_OF_RECORDINGS).chain(OF_RECORDINGS);
        assert!(named.map(Kind::find).all(|kind| kind.is_some()));
        assert!(OF_SEVERAL.iter().all(|name| EXPLAINED.iter().any(|kind| kind.name == *name)));
        assert!(Kind::all().count() > 20, "{:?}", Kind::all().collect::<Vec<_>>());
        for kind in Kind::all() {
            assert!(kind.shows().len() > 10, "{kind:?}");
            kind.check(&[]).unwrap_or_else(|problem| panic!("{kind:?}: {problem}"));
        }
    }

    #[test]
    fn keys_are_those_of_pipelines_and_checked() {
        let kind = |name: &str| Kind::find(name).unwrap();
        let check = |name: &str, set: &str| kind(name).check(&[set.to_owned()]);
        assert_eq!(
            kind("space-time").keys(),
            [
                "from_block",
                "from_s",
                "place",
                "recorded_only",
                "rupture",
                "title",
                "to_block",
                "to_s",
                "which",
                "width_mm"
            ]
        );
        check("space-time", "which=longest-precursor").unwrap();
        check("space-time", "from_s=1e-3").unwrap();
        check("stress", "at_s=[0.1, 2]").unwrap();
        check("lengths", "title=a = b").unwrap();
        let refused = [
            ("space-time", "from_s=soon", "from_s=soon is not accepted (accepted: a number)"),
            ("space-time", "which=widst", "which=widst is not accepted; did you mean widest? (accepted: "),
            ("space-time", "run=b", "have no such key (accepted: from_block, from_s, place"),
            (
                "lengths",
                "over=[]",
                "have no such key (accepted: law, measured, measured_label, of, title, width_mm)",
            ),
            ("load", "measured=none.csv", "measured = \"none.csv\" cannot be read: "),
            ("load", "width_mm=3", "figure load.png: width_mm = 3 is not accepted (accepted: 40 to 400)"),
            ("overview", "title", "\"title\" (accepted: KEY=VALUE"),
        ];
        for (name, set, says) in refused {
            let said = check(name, set).unwrap_err();
            assert!(said.contains(says), "{said}");
        }
    }

    /// Whoever draws a run of their own may not know the thesis.
    #[test]
    fn no_caption_needs_the_thesis() {
        let mut captions = BTreeSet::new();
        for run in runs().into_iter().step_by(7) {
            for kind in Kind::all() {
                let Ok(figure) = kind.of_run(&run.name, &run.header, &run.scenario, &[]) else {
                    panic!("{kind:?} of {}", run.name)
                };
                let run = asperity_numbers::run_data::RunData { kept: figure.required_data(), ..run.clone() };
                if let Ok((what, sheet)) = figure.sheet(&[&run]) {
                    let Caption { title, caption } = words(what, &sheet);
                    captions.insert((kind.name, format!("{title}: {caption}")));
                }
            }
        }
        let kinds: BTreeSet<&str> = captions.iter().map(|(kind, _)| *kind).collect();
        assert!(kinds.len() > 15, "{kinds:?}");
        for (kind, caption) in captions {
            for word in ["eq. (", "(5.", "(6.", "hapter", "thesis"] {
                assert!(!caption.contains(word), "{kind}: {caption}");
            }
        }
    }

    #[test]
    fn a_target_is_a_file_if_it_ends_as_one() {
        assert!(matches!(Target::of("out/a.svg".as_ref()), Target::File(_)));
        assert!(matches!(Target::of("out/mine.v2".as_ref()), Target::Folder(_)));
        let kind = Kind::find("load").unwrap();
        let files = Target::of("out".as_ref()).files(kind);
        assert_eq!(files, ["out/load.png", "out/load.svg", "out/load.pdf"].map(std::path::PathBuf::from));
    }
}
