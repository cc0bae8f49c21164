//! The figures, drawn at print quality.
//!
//! Each kind of figure is a module with a specification, as the pipeline writes
//! it, the part that it takes of a run, and a way to draw it from its parts. To add one: a module,
//! and a line in `kinds!`.

mod area;
mod arrival_map;
mod axis;
mod chart;
mod colours;
mod curve;
mod dispersion;
mod error;
mod fields;
mod front_profile;
mod front_speed;
mod front_speeds;
mod front_stress;
mod ink;
mod kind;
mod legend;
mod lengths;
mod lines;
mod load;
mod load_ruptures;
mod magnitudes;
mod measured;
mod moment_duration;
mod moment_rates;
mod moments;
mod noise;
pub mod of_one_run;
pub mod of_study;
mod overview;
mod print;
mod recurrence;
mod rupture_selector;
mod scale;
mod sheet;
mod sizes;
mod space_time;
mod stability_boundary;
mod stress;
mod study;
mod text;
mod traces;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Mutex;

use asperity_files::FileSet;
use asperity_numbers::required_data::RequiredData;
use asperity_numbers::run_data::RunData;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::spec::{Family, MeasuredFile};
use crate::spelling::spelled;
pub use error::FigureError;
use kind::Figure;
use print::about::{About, Origins};
pub use print::files_of;
use print::page::Page;
use sheet::{Sheet, each_once};
use text::plain;

macro_rules! kinds {
    ($($(#[doc = $doc:literal])* $name:literal $field:ident: $kind:ty),* $(,)?) => {
        /// The figures of a study, by kind: those of single runs, and those of the tables of runs over
        /// axes.
        #[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Figures {
            /// Numbers of the runs over axes: curves of `y` against `x`, a curve for every value of `colour`; where `y`
            /// is a key that varies, a phase map, with `colour` over two keys; or, for `y = "length_ratio"` over
            /// `x = "ft_fn_onset"`, lengths of precursors against the load at which each begins, by the ruptures that
            /// the study keeps, with the length law. A run without the number leaves a gap in a curve. A place of a map
            /// without it is empty, and one whose runs all failed, or are not made, is crossed out; its axes are
            /// labelled at values that were run.
            #[serde(default)]
            pub family: Vec<Family>,
            /// Curves of runs.
            #[serde(default)]
            curve: Vec<curve::CurveFigure>,
            $($(#[doc = $doc])* #[serde(default, rename = $name)] $field: Vec<$kind>),*
        }

        impl Figures {
            /// Each with what its kind shows, in short.
            fn all(&self) -> Vec<(&'static str, &dyn Figure)> {
                let of_curves = self.curve.iter();
                let mut all: Vec<(&'static str, &dyn Figure)> =
                    of_curves.map(|figure| (first_clause(figure.curve.about.trim_ascii()), figure as _)).collect();
                $({
                    let what = first_clause(concat!($($doc),*).trim_ascii());
                    all.extend(self.$field.iter().map(|figure| (what, figure as &dyn Figure)));
                })*
                all
            }
        }
    };
}

kinds! {
    /// Lengths of precursors, and the load at which each begins.
    "lengths" lengths: lengths::Lengths,
    /// Load against time.
    "load" load: load::Load,
    /// `tau` along the slider when the first precursor starts.
    "onset" onset: stress::Onset,
    /// `tau_n`, `mu_s p_n` and `mu_d p_n` along the slider at chosen instants; of rate-and-state friction
    /// `f_0 p_n`.
    "stress" stress: stress::Stress,
    /// The critical stiffness of rate-and-state friction against the velocity: where measured growth of
    /// oscillations changes its sign from one stiffness to the next, and in theory.
    "stability-boundary" stability_boundary: stability_boundary::StabilityBoundary,
    /// One number per run against a parameter.
    "study" study: study::StudyFigure,
    /// Speed of fronts against prestress, beside the theory.
    "front-speed" front_speed: front_speed::FrontSpeed,
    /// Distribution of the local speeds of fronts in all ruptures, on a logarithmic axis, for runs and
    /// groups of runs. Each share is that of the speeds of all runs of a group; whiskers reach from the
    /// smallest to the largest share in one of them.
    "front-speeds" front_speeds: front_speeds::FrontSpeeds,
    /// Where and when blocks slid: block against time, with the arrivals of fronts and how far slip had spread;
    /// for a whole run, a part of it, or one rupture. Where the log has dense windows or states of ruptures,
    /// colours show the velocity.
    "space-time" space_time: space_time::SpaceTime,
    /// Speed of the front of a rupture from block to block, with the wave speed and the theory of steady
    /// fronts under the force that each block bore before. Triangles at the upper edge mark fronts faster
    /// than the axis reaches. Where a block bore no more than sliding friction, the theory gives no front:
    /// its line is in pieces, short ones where few neighbouring blocks bore more.
    "front-profile" front_profile: front_profile::FrontProfile,
    /// Speed of the fronts of precursors and of the first global slip over `tau_n / p_n` that the same
    /// blocks bore when the rupture began.
    "front-stress" front_stress: front_stress::FrontStress,
    /// Frequency against wave number of plane waves in the lattice of a slab, from the pull of its bonds
    /// and in theory, with the straight lines of long waves.
    "dispersion" dispersion: dispersion::Dispersion,
    /// Stress or displacement all over a slab, or over a slice of a body, at chosen times; its nodes are computed
    /// by repeating the run's steps.
    "slab-field" slab_field: fields::SlabField,
    /// `tau_n / p_n` along the slider before and after each precursor.
    "stress-sequence" stress_sequence: stress::StressSequence,
    /// One rupture over the area of contact, of a sheet or a body: when its front came to each contact, with
    /// isochrones, or how far each slid.
    "arrival-map" arrival_map: arrival_map::ArrivalMap,
    /// Stress, slip, velocity or normal load over the area of contact at chosen times, with the vector as
    /// arrows and outlines of the contacts that slide; states between records are computed by repeating the
    /// run's steps.
    "area-field" area_field: fields::AreaField,
    /// One rupture over the area of contact in panels at even times, with outlines of the contacts that slide;
    /// its states are computed by repeating the run's steps.
    "film-strip" film_strip: fields::FilmStrip,
    /// Extents of the precursors over the area of contact, outlined; each contact has the colour of the load
    /// at which the first precursor that reached it began.
    "outlines" outlines: arrival_map::Outlines,
    /// The load curve with its ruptures: precursors and global slips are numbered as in the table of
    /// ruptures.
    "load-ruptures" load_ruptures: load_ruptures::LoadRuptures,
    /// Distribution of ruptures by size, global slips counted separately, with a fitted law.
    "sizes" sizes: sizes::Sizes,
    /// Distribution of the times between ruptures, with a fitted law.
    "recurrence" recurrence: recurrence::Recurrence,
    /// How many ruptures have at least a magnitude, with the law of Gutenberg and Richter unless its test rejects it.
    "magnitudes" magnitudes: magnitudes::Magnitudes,
    /// How many ruptures there are of each moment, in intervals of its logarithm.
    "moments" moments: moments::Moments,
    /// Moment of ruptures against their duration, with lines of the slopes 1, 2 and 3 through the medians.
    "moment-duration" moment_duration: moment_duration::MomentDuration,
    /// Moment rates of the largest ruptures whose states are recorded, from the onset of each.
    "moment-rates" moment_rates: moment_rates::MomentRates,
    /// What all sensors of a recording read about a rupture, each at its place along the slider, with arrivals, bars of
    /// their errors, and the front of the speed that is fitted to them.
    "traces" traces: traces::Traces,
    /// Noise of the sensors of a recording, with the least steps that count and the steps that were seen: medians over
    /// the parts of its stream, with bars over the middle half of them. In parts full of events it is larger.
    "noise" noise: noise::Noise,
    /// A run on one page: its load curve with numbered ruptures, its space-time map, the sizes and
    /// recurrence times of its ruptures, and its first numbers.
    "overview" overview: overview::Overview,
}

impl Figures {
    /// Checks widths, and that those of named runs have some.
    ///
    /// # Errors
    /// In words, with kind and file of the figure, and what is accepted.
    pub fn check(&self) -> Result<(), String> {
        let of_runs =
            self.all().into_iter().map(|(_, figure)| (figure.frame().file, figure.frame().width_mm));
        let of_tables = self.family.iter().map(|family| (family.file.as_str(), family.width_mm));
        for (file, width_mm) in of_runs.chain(of_tables) {
            if let Some(width_mm) = width_mm.filter(|width_mm| !(40.0..=400.0).contains(width_mm)) {
                return Err(format!(
                    "figure {file}: width_mm = {width_mm} is not accepted (accepted: 40 to 400)"
                ));
            }
        }
        for (_, figure) in self.all() {
            let named = if figure.runs().is_empty() { Err("no run is named".to_owned()) } else { Ok(()) };
            let checked = named.and_then(|()| figure.check()).and_then(|()| figure.measured());
            checked.map_err(|problem| format!("figure {}: {problem}", figure.frame().file))?;
        }
        Ok(())
    }

    /// The files of measured points that figures name, to be read before [`Figures::check`].
    pub fn measured_mut(&mut self) -> impl Iterator<Item = &mut MeasuredFile> {
        let of_load = self.load.iter_mut().filter_map(|load| load.measured.as_mut());
        let of_lengths = self.lengths.iter_mut().filter_map(|lengths| lengths.measured.as_mut());
        let of_curves = self.curve.iter_mut().filter_map(|curve| curve.measured.as_mut());
        of_load
            .chain(of_lengths)
            .chain(of_curves)
            .chain(self.family.iter_mut().filter_map(|family| family.measured.as_mut()))
    }

    /// The runs that the figures are made of.
    pub fn runs(&self) -> impl Iterator<Item = &str> {
        self.all().into_iter().flat_map(|(_, figure)| figure.runs()).map(|(run, _)| run)
    }

    /// The lists of runs of figures that show groups of them, in which patterns may stand for many.
    pub fn lists_mut(&mut self) -> impl Iterator<Item = &mut Vec<String>> {
        let groups = (self.study.iter_mut().flat_map(study::StudyFigure::groups_mut))
            .chain(self.front_speed.iter_mut().flat_map(|figure| &mut figure.series))
            .chain(self.front_speeds.iter_mut().flat_map(|figure| &mut figure.series))
            .chain(self.stability_boundary.iter_mut().flat_map(|figure| &mut figure.series));
        groups.map(|group| &mut group.runs)
    }

    /// Each by its file, with the runs that it is made of, in the order of the files.
    pub fn by_file(&self) -> BTreeMap<&str, Vec<&str>> {
        let all = self.all().into_iter().map(|(_, figure)| (figure.frame().file, figure.runs()));
        all.map(|(file, runs)| (file, runs.into_iter().map(|(run, _)| run).collect())).collect()
    }

    /// The files that the figures are written to.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.all().into_iter().map(|(_, figure)| figure.frame().file)
    }

    /// What they read of a run.
    pub fn required_data(&self, run: &str) -> RequiredData {
        let of_run =
            self.all().into_iter().filter(|(_, figure)| figure.runs().iter().any(|(of, _)| *of == run));
        of_run.fold(RequiredData::NOTHING, |required, (_, figure)| required | figure.required_data())
    }
}

/// Figures that are drawn one by one, each as soon as it has its part of all its runs.
pub struct Gathering<'a> {
    figures: Vec<Begun<'a>>,
    folder: PathBuf,
    provenance: bool,
    captions: Mutex<BTreeMap<String, Caption>>,
}

/// What pages and its own files say of a figure.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Caption {
    /// A short name: what figures of its kind show, and what it is titled.
    pub title: String,
    /// What it shows.
    pub caption: String,
}

/// A figure, and its parts of the runs that have gone by.
struct Begun<'a> {
    what: &'static str,
    figure: &'a dyn Figure,
    parts: Mutex<(Vec<Option<Sheet>>, Origins)>,
}

impl<'a> Gathering<'a> {
    /// For the figures of a pipeline, to be drawn into a folder. `provenance` is whether they name the
    /// code and bear a line at their foot.
    pub fn begin(figures: &'a Figures, folder: PathBuf, provenance: bool) -> Gathering<'a> {
        let begun = |(what, figure): (&'static str, &'a dyn Figure)| Begun {
            what,
            figure,
            parts: Mutex::new((vec![None; figure.runs().len()], Origins::default())),
        };
        let figures = figures.all().into_iter().map(begun).collect();
        Gathering { figures, folder, provenance, captions: Mutex::default() }
    }

    /// Takes the parts of all figures of a run, and draws those that it was the last one for, as files
    /// of a set. Says how many that were.
    pub fn run(&self, run: &RunData, files: &FileSet) -> Result<usize, FigureError> {
        let mut count = 0;
        let origins = Origins::of_run(&run.header);
        for Begun { what, figure, parts } in &self.figures {
            let failed =
                |problem: String| FigureError::Figure { file: figure.frame().file.to_owned(), problem };
            let all = figure.runs().into_iter().enumerate();
            let of_run = all.filter(|(_, (name, _))| *name == run.name);
            let of_run = of_run.map(|(n, (_, pen))| Ok((n, figure.part(run, pen)?)));
            let of_run = of_run.collect::<Result<Vec<_>, String>>().map_err(failed)?;
            if of_run.is_empty() {
                continue;
            }
            let whole = {
                let mut parts = parts.lock().expect("whoever adds a part does not panic");
                of_run.into_iter().for_each(|(n, part)| parts.0[n] = Some(part));
                parts.1.add(&origins);
                let is_whole = parts.0.iter().all(Option::is_some);
                is_whole.then(|| std::mem::take(&mut *parts))
            };
            if let Some((parts, origins)) = whole {
                let sheet = figure.sheet(parts.into_iter().flatten().collect()).map_err(failed)?;
                let (page, about) = drawn(what, &sheet, origins, self.provenance).map_err(failed)?;
                let file = figure.frame().file.to_owned();
                self.captions.lock().expect("none panics here").insert(file, about.words.clone());
                print::write(&page, &about, files, &files_of(&self.folder.join(figure.frame().file)))?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// The captions of what was drawn, by file.
    pub fn captions(self) -> BTreeMap<String, Caption> {
        self.captions.into_inner().expect("whoever adds a caption does not panic")
    }
}

/// A sheet as a page, and what its files say of it.
fn drawn(what: &str, sheet: &Sheet, origins: Origins, provenance: bool) -> Result<(Page, About), String> {
    let about = About { words: words(what, sheet), origins, provenance };
    let page = sheet.page(about.foot().as_deref())?;
    Ok((page, about))
}

/// What is said of a sheet, given what it shows.
fn words(what: &str, sheet: &Sheet) -> Caption {
    let what = spelled(what).trim_end_matches('.').to_owned();
    let of_panels = || sheet.all_panels().map(|panel| panel.title.clone());
    let titles = each_once(sheet.all().iter().map(|sheet| sheet.title.clone()).chain(of_panels()));
    let axes = each_once(sheet.all_panels().map(|panel| panel.y.label())).join("; ");
    let across = each_once(sheet.all_panels().map(|panel| panel.x.label())).join("; ");
    let bars = sheet.all().into_iter().filter_map(|sheet| Some(plain(&sheet.bar.as_ref()?.scale.label())));
    let labels: Vec<String> = sheet.labels().into_iter().chain(bars).collect();
    let one_title = if let [title] = &titles[..] { format!(": {title}") } else { String::new() };
    let mut caption = vec![format!("{what}{one_title}"), format!("{axes} against {across}")];
    caption.extend((titles.len() > 1).then(|| titles.join("; ")));
    caption.extend((!labels.is_empty()).then(|| format!("Shown: {}", labels.join(", "))));
    let caption: Vec<String> = caption.iter().map(|text| sentence(text)).collect();
    let title = format!("{}{one_title}", first_clause(&what));
    Caption { title, caption: caption.join(". ") + "." }
}

/// What words say before they go into detail.
fn first_clause(words: &str) -> &str {
    let cuts = [": ", "; ", ". ", ", and ", ", with ", ", where"];
    let end = cuts.iter().filter_map(|cut| words.find(cut)).min().unwrap_or(words.len());
    &words[..end]
}

/// Text as it begins a sentence: a word with a capital, a symbol as it is.
fn sentence(text: &str) -> String {
    let word = text.split(|c: char| !c.is_ascii_alphabetic()).next().unwrap_or_default();
    let behind = &text[word.len()..];
    let is_symbol = word.len() < 2 || behind.starts_with(['_', '/']) || behind.trim_start().starts_with('=');
    if is_symbol { text.to_owned() } else { text[..1].to_uppercase() + &text[1..] }
}

#[cfg(test)]
mod tests {
    pub(super) mod first_day;

    use std::collections::BTreeMap;

    use asperity_record::{FieldRecord, WindowRecord};

    use super::kind::Figure;
    use super::sheet::{Panel, Shape, Sheet};
    use super::{Figures, sentence};
    use asperity_numbers::required_data::RequiredData;
    use asperity_numbers::run_data::RunData;
    use asperity_testkit::made_up;
    use asperity_testkit::made_up::EVENTS;

    #[test]
    fn sentences_begin_with_capitals_unless_with_symbols() {
        assert_eq!(sentence("marks: simulated"), "Marks: simulated");
        assert_eq!(sentence("rupture 12"), "Rupture 12");
        assert_eq!(sentence("precursors"), "Precursors");
        for symbol in [
            "v/c",
            "L_p/L against F_T/F_N",
            "t = 0.5 s",
            "μ_s p",
            "θ",
            "Δt",
            "5 blocks",
            "vmax/c",
            "beta = 0.2",
            "",
        ] {
            assert_eq!(sentence(symbol), symbol);
        }
    }

    /// A run with a state whose load has fallen to a quarter.
    fn runs(required: RequiredData) -> BTreeMap<String, RunData> {
        runs_of("", required, &[450])
    }

    /// Such a run of a scenario, with states at these steps.
    fn runs_of(scenario_toml: &str, required: RequiredData, steps: &[u64]) -> BTreeMap<String, RunData> {
        let mut run = made_up::run(scenario_toml, &EVENTS);
        for record in &mut run.loads[3..] {
            record.normal_load_n = 100.0;
        }
        let state = |step: &u64| FieldRecord {
            step: *step,
            time_s: run.plan.grid.time_s(*step),
            displacement_m: vec![0.0; 3],
            velocity_m_per_s: vec![0.0; 3],
            tangential_force_n: vec![1.0, 2.0, 3.0],
            normal_load_n: Vec::new(),
            stick_position_m: vec![0.0; 3],
            detached: vec![0; 3],
            ..FieldRecord::default()
        };
        let states: Vec<FieldRecord> = steps.iter().map(state).collect();
        run.kept |= required;
        made_up::with_states(&mut run, &states);
        BTreeMap::from([("a".to_owned(), run)])
    }

    /// A figure of runs that have kept what it wants.
    fn drawn(figure: &dyn Figure, runs: BTreeMap<String, RunData>) -> Result<Sheet, String> {
        let part = |(name, pen)| {
            let kept = RunData { kept: figure.required_data(), ..runs[name].clone() };
            figure.part(&kept, pen)
        };
        figure.sheet(figure.runs().into_iter().map(part).collect::<Result<_, String>>()?)
    }

    fn sheet(text: &str) -> Result<Sheet, String> {
        let figures: Figures = toml::from_str(text).unwrap();
        let all: Vec<&dyn Figure> = figures.all().into_iter().map(|(_, figure)| figure).collect();
        assert_eq!((all.len(), all[0].frame().file, all[0].runs()[0].0), (1, "f.png", "a"));
        drawn(all[0], runs(all[0].required_data()))
    }

    fn single(text: &str) -> Panel {
        sheet(text).unwrap().panels.remove(0)
    }

    #[test]
    fn stress_and_forces_take_the_load_of_the_instant() {
        let panel = single("[[stress]]\nfile = \"f.png\"\nrun = \"a\"\nat_s = [4e-5]");
        // mu_s p_n with 100 N on three blocks.
        assert!((panel.layers[0].points()[0].1 - 0.7 * 100.0 / 3.0).abs() < 1e-12);
        assert_eq!(panel.layers[2].points(), [(0.0, 1.0), (50.0, 2.0), (100.0, 3.0)]);
        assert!(panel.title.contains("F_N = 100.0 N"), "{}", panel.title);

        let panel = single("[[curve]]\ncurve = \"forces\"\nfile = \"f.png\"\nrun = \"a\"");
        let loads: Vec<f64> = panel.layers[0].points().iter().map(|(_, load)| *load).collect();
        assert_eq!(loads, [400.0, 400.0, 400.0, 100.0, 100.0, 100.0, 100.0]);
        assert!((panel.layers[1].points()[6].1 - 70.0).abs() < 1e-12);
    }

    /// It has neither coefficient: figures once showed `f_0` twice, as `mu_s` and as `mu_d`.
    #[test]
    fn the_level_of_rate_and_state_friction_is_f_0() {
        let law = "friction.law = \"rate-and-state\"\nfriction.reference_coefficient = 0.5";
        for text in [
            "[[curve]]\ncurve = \"forces\"\nfile = \"f.png\"\nrun = \"a\"",
            "[[stress]]\nfile = \"f.png\"\nrun = \"a\"\nat_s = [4e-5]",
            "[[load]]\nfile = \"f.png\"\nrun = \"a\"\nsliding = false",
            "[[stress-sequence]]\nfile = \"f.png\"\nrun = \"a\"\nfrom_blocks = 1",
            "[[curve]]\ncurve = \"slipped\"\nfile = \"f.png\"\nseries = [{ label = \"a\", run = \"a\" }]",
        ] {
            let figures: Figures = toml::from_str(text).unwrap();
            let figure = figures.all()[0].1;
            let drawn_of = |law: &str| {
                let runs = runs_of(law, figure.required_data(), &[100, 101, 450]);
                format!("{:?}", drawn(figure, runs).unwrap_or_else(|problem| panic!("{text}: {problem}")))
            };
            let (sticking, sliding) = (drawn_of(""), drawn_of(law));
            assert!(sticking.contains("μ_d") && !sticking.contains("f_0"), "{text}: {sticking}");
            assert!(!sliding.contains("μ_"), "{text}: {sliding}");
            assert!(sliding.contains("f_0") != text.contains("slipped"), "{text}: {sliding}");
        }
    }

    #[test]
    fn the_load_is_drawn_with_its_theory_where_there_is_one() {
        let text = "[[load]]\nfile = \"f.png\"\nrun = \"a\"\nsliding = false";
        let panel = single(text);
        let labels: Vec<&str> = panel.layers.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["μ_s", "μ_d", "F_T/F_N", "theory"]);
        let end = panel.layers[3].points().pop().unwrap();
        assert!((end.0 - 2.61).abs() < 1e-9 && (end.1 - 0.45).abs() < 1e-12, "{end:?}");
        // Initial shear is not in that theory.
        let figures: Figures = toml::from_str(text).unwrap();
        let sheared = made_up::run("initial_shear.beta = 0.2", &EVENTS);
        let panel =
            drawn(figures.all()[0].1, BTreeMap::from([("a".to_owned(), sheared)])).unwrap().panels.remove(0);
        assert_eq!(panel.layers.len(), 3);
    }

    #[test]
    fn slipped_and_study_show_one_mark_per_event_and_run() {
        let panel = single(
            "[[curve]]\ncurve = \"slipped\"\nfile = \"f.png\"\nseries = [{ run = \"a\", label = \"A\" }]",
        );
        assert_eq!(panel.layers[1].points().len(), 3);
        let study = "[[study]]\nfile = \"f.png\"\nparameter = \"slider.blocks\"\nparameter_label = \"N\"\n\
                     measure = \"precursor_event_count\"\nmeasure_label = \"count\"\nlogarithmic = true\n\
                     series = [{ label = \"A\", runs = [\"a\"] }]";
        // Counts are marks alone; of other numbers the marks are joined.
        let counts = single(study);
        assert_eq!((counts.layers.len(), &counts.layers[0].points()[..]), (1, &[(3.0, 3.0)][..]));
        let joined_text = study.replace("precursor_event_count", "longest_precursor_event_ratio");
        let joined = single(&joined_text);
        assert!(matches!(joined.layers[0].shape, Shape::Line(..)) && joined.layers.len() == 2);
        // Theory is the line, under its own name once, and the measured number has marks alone.
        let beside = joined_text.replace("file", "measure_factor = 10\ntheory = \"coefficient_ratio\"\nfile");
        let by_theory = single(&beside);
        let [line, marks] = &by_theory.layers[..] else { panic!("{by_theory:?}") };
        assert!(
            matches!((&line.shape, &marks.shape), (Shape::Line(..), Shape::Marks(..))) && line.label == "A"
        );
        assert!(marks.points()[0].1 == 10.0 && (line.points()[0].1 - 7.0 / 0.45).abs() < 1e-12);
        let named = beside.replace("file", "theory_label = \"theory\"\nfile");
        let both = "runs = [\"a\"] }, { label = \"B\", runs = [\"a\"] }";
        let named = single(&named.replace("runs = [\"a\"] }", both));
        let labels: Vec<&str> = named.layers.iter().map(|series| series.label.as_str()).collect();
        assert_eq!(labels, ["theory", "A", "", "B"]);
        let refused = sheet(&study.replace("slider.blocks", "normal_load.tilt")).unwrap_err();
        assert_eq!(refused, "normal_load.tilt of run test is 0: no place on a logarithmic axis");
    }

    /// The panels of a figure of one run, which is called `a`.
    fn stacked(text: &str, run: RunData) -> Result<Vec<Panel>, String> {
        let figures: Figures = toml::from_str(text).unwrap();
        Ok(drawn(figures.all()[0].1, BTreeMap::from([("a".to_owned(), run)]))?.panels)
    }

    #[test]
    fn fronts_are_drawn_beside_their_theory() {
        let text = "[[front-speed]]\nfile = \"f.png\"\nfrom_speed = 0.5\nto_speed = 3\n\
                    series = [{ label = \"A\", runs = [\"a\"] }]";
        let speed =
            asperity_numbers::fronts::speed_over_c(&made_up::pulse(12, "prestress.ratio = 0.6")).unwrap();
        let panels = stacked(text, made_up::pulse(12, "prestress.ratio = 0.6")).unwrap();
        let [line, marks] = &panels[0].layers[..] else { panic!("{panels:?}") };
        assert!(line.points().len() > 40 && line.points().last().unwrap().1 == 3.0, "{:?}", line.points());
        assert!((marks.points()[0].0 - 0.6).abs() < 1e-12 && marks.points()[0].1 == speed);
        assert_eq!(panels[1].y.label(), "1000 |Δv|/v");
        // Without a theory, beside that of rigid contacts.
        let mut driven = made_up::pulse(12, "prestress.ratio = 0.6");
        driven.plan.drive.velocity_m_per_s = 1.0;
        let panels = stacked(text, driven).unwrap();
        assert_eq!(panels[0].layers.len(), 1, "marks alone");
        assert!((panels[1].layers[1].points()[0].1 - 0.8 * speed).abs() < 1e-9);

        let transient = "[[curve]]\ncurve = \"front-transient\"\nfile = \"f.png\"\n\
                         series = [{ label = \"A\", run = \"a\" }]";
        let figures: Figures = toml::from_str(transient).unwrap();
        let run = made_up::pulse(12, "prestress.ratio = 0.6");
        let panel =
            drawn(figures.all()[0].1, BTreeMap::from([("a".to_owned(), run)])).unwrap().panels.remove(0);
        assert_eq!(panel.layers[0].points().len(), 11);
    }

    #[test]
    fn pulses_are_drawn_as_they_pass_and_where_they_end() {
        let arrest = "[[curve]]\ncurve = \"arrest\"\nfile = \"f.png\"\nrun = \"a\"";
        let falling = "prestress.ratio = 0.6\nprestress.rise_ratio = -0.11";
        let panels = stacked(arrest, made_up::pulse(7, falling)).unwrap();
        // Block 7 bears 0.54 of its load; the line at the end goes up to gamma / (2 + gamma).
        let end = panels[0].layers.last().unwrap();
        assert!(end.points()[0].0 == 7.0 && (end.points()[1].1 - 0.2).abs() < 1e-9, "{:?}", end.points());
        let mut free = made_up::pulse(7, falling);
        free.plan.drive.springs.clear();
        assert_eq!(
            stacked(arrest, free).unwrap_err(),
            "run test has no rigid contacts under a held top drive"
        );

        let pulse = "[[curve]]\ncurve = \"pulse\"\nfile = \"f.png\"\nkeys = { before = 1, after = 9 }\n\
                     series = [{ run = \"a\", label = \"A\" }]";
        let mut run = made_up::pulse(12, "prestress.ratio = 0.6");
        assert_eq!(
            stacked(pulse, made_up::pulse(12, "")).unwrap_err(),
            "run test has no dense window of blocks that a pulse passes"
        );
        // Block 5 begins to slide in step 291.
        run.windows = (0..3)
            .map(|n| WindowRecord {
                window: 0,
                step: 291 + n,
                time_s: run.plan.grid.time_s(291 + n),
                sliding: 1,
                first_block: 5,
                displacement_m: vec![1e-6 * n as f64],
                velocity_m_per_s: vec![0.5],
                tangential_force_n: vec![0.0],
                ..WindowRecord::default()
            })
            .collect();
        let panels = stacked(pulse, run).unwrap();
        assert_eq!(panels[0].layers[0].points().len(), 3);
        assert!(panels[0].layers[0].points()[0].0.abs() < 1e-9, "{:?}", panels[0].layers[0].points());
        // 2 tau / gamma.
        assert!((panels[1].layers[1].points()[0].1 - 2.4).abs() < 1e-9);
    }

    #[test]
    fn an_interval_without_records_is_refused() {
        let refused = sheet(
            "[[curve]]\ncurve = \"forces\"\nfile = \"f.png\"\nrun = \"a\"\nkeys = { from_s = 7, to_s = 8 }",
        )
        .unwrap_err();
        assert_eq!(refused, "run test has no records from 7 s to 8 s");
    }
}
