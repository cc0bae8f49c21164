//! From figures as written to figures as understood: every name in them is a key that varies or a
//! number of the summary, and every axis of the sweep has its part.

use std::collections::BTreeSet;

use asperity_model::scenario::keys::{self, Kind as KeyKind};
use asperity_model::{among, suggestion};
use asperity_numbers::Number;
use asperity_record::{Cell, greek, unit_of};

use super::axes::{Axis, Key, read_place};
use super::figure::{Figure, Kind, OF_THEORY, Quantity};
use super::measured::MeasuredFile;
use super::written::{Family, OF_PRECURSORS, Scale};

/// Most panels of a figure.
const MOST_PANELS: usize = 12;

/// Most words that colours stand for; numbers are on a scale.
const MOST_WORDS: usize = 8;

impl Family {
    /// The figures of the tables of runs over these axes.
    ///
    /// # Errors
    /// In words, with the file of the figure, key, value and what is accepted.
    pub fn understand(
        all: &[Family],
        axes: &[Axis<'_>],
        keeps_ruptures: bool,
    ) -> Result<Vec<Figure>, String> {
        let known = |of: &Family| {
            let figure = Known { axes, used: Vec::new() }.figure(of, keeps_ruptures);
            figure.map_err(|problem| format!("figure.family {:?}: {problem}", of.file))
        };
        let all = all.iter().map(known).collect::<Result<Vec<Figure>, _>>()?;
        Figure::check_files(&all)?;
        Ok(all)
    }
}

impl Figure {
    /// Makes sure that figures have plain names of files, and different ones: what is drawn stands in
    /// the folder of figures, and nowhere else.
    ///
    /// # Errors
    /// In words, with the file of the figure, and what is accepted.
    pub fn check_files(figures: &[Figure]) -> Result<(), String> {
        let mut seen = BTreeSet::new();
        for figure in figures {
            let file = &figure.file;
            let refused = |problem: String| format!("figure.family {file:?}: {problem}");
            plain_file(file).map_err(refused)?;
            if !seen.insert(file) {
                return Err(refused(format!("file = {file:?} appears twice (accepted: different names)")));
            }
        }
        Ok(())
    }
}

fn plain_file(file: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
    let stem = file.strip_suffix(".png").unwrap_or_default();
    if stem.is_empty() || stem.starts_with('.') || !stem.chars().all(plain) {
        return Err(format!(
            "file = {file:?} is no name of a figure (accepted: letters, digits, -, _ and dots inside, ending in .png)"
        ));
    }
    Ok(())
}

/// What a figure may speak of, and the keys that it does, each with the key of the figure that names it.
struct Known<'a> {
    axes: &'a [Axis<'a>],
    used: Vec<(&'static str, &'a str)>,
}

impl<'a> Known<'a> {
    /// The key of that name, which the figure then uses, and its axis.
    fn key(&mut self, what: &'static str, name: &str) -> Result<(usize, &'a Key<'a>), String> {
        let keys =
            self.axes.iter().enumerate().flat_map(|(n, axis)| axis.keys.iter().map(move |key| (n, key)));
        let Some((axis, key)) = keys.clone().find(|(_, key)| key.path == name) else {
            let may_be_number = matches!(what, "x" | "y");
            let names: Vec<&str> = keys.map(|(_, key)| key.path).collect();
            let numbers: Vec<&str> =
                numbers_of_summary().filter(|_| may_be_number).map(Number::name).collect();
            let meant = suggestion(name, [&names[..], &numbers].concat());
            let more = if may_be_number { ", or a number of `asperity summary --schema`" } else { "" };
            let names = names.join(", ");
            return Err(format!("{what} = {name:?} does not vary{meant} (accepted: {names}{more})"));
        };
        if let Some((other, _)) = self.used.iter().find(|(_, other)| *other == name) {
            return Err(format!("{name} is both {other} and {what} (accepted: one of them)"));
        }
        self.used.push((what, key.path));
        Ok((axis, key))
    }

    /// A key that varies, with the number of its axis, or a number of the summary.
    fn key_or_number(
        &mut self,
        what: &'static str,
        name: &str,
        label: &Option<String>,
        scale: Option<Scale>,
    ) -> Result<(Option<usize>, Quantity), String> {
        match self.key(what, name) {
            Ok((axis, key)) => Ok((Some(axis), of_key(what, key, label, scale)?)),
            Err(no_key) if Number::find(name).is_err() => Err(no_key),
            Err(_) => Ok((None, number(what, name, label, scale)?)),
        }
    }

    /// What a figure shows over which axes, before it is known what else it uses.
    fn kind(&mut self, of: &Family, keeps_ruptures: bool) -> Result<(Kind, [Quantity; 2]), String> {
        let Family { x: across, y: upwards, x_label, y_label, .. } = of;
        if [across, upwards] == OF_PRECURSORS {
            if !keeps_ruptures {
                return Err("its study keeps no ruptures (accepted: \"ruptures\" in keep)".to_owned());
            }
            let x = quantity(across, x_label, || "F_T/F_N".to_owned(), false);
            let y = quantity(upwards, y_label, || "L_p/L".to_owned(), false);
            return Ok((Kind::Lengths { law: of.law }, [x, y]));
        }
        let (of_x, x) = self.key_or_number("x", across, x_label, of.x_scale)?;
        let (of_y, y) = self.key_or_number("y", upwards, y_label, of.y_scale)?;
        if of.theory && !OF_THEORY.contains(&upwards.as_str()) {
            let names = OF_THEORY.join(", ");
            return Err(format!("theory = true with y = {upwards:?} (accepted: with y one of {names})"));
        }
        let kind = match (of_x, of_y) {
            _ if across == upwards => {
                return Err(format!("x and y are both {across} (accepted: two quantities)"));
            }
            (Some(of_x), Some(of_y)) => {
                Kind::PhaseMap { statistic: of.statistic.unwrap_or_default(), scattered: of_x == of_y }
            }
            (None, _) if of_y.is_some() || of.theory => {
                let with = if of.theory { "theory = true" } else { "a key as y" };
                return Err(format!("{with} with x = {across:?} (accepted: with a key that varies across)"));
            }
            _ if x.is_word => {
                return Err(format!(
                    "x = {across:?} holds words (accepted: a key or a number of the summary; a key of words as colour or facet)"
                ));
            }
            _ => Kind::Family { joined: of_x.is_some_and(|axis| self.axes[axis].joined), theory: of.theory },
        };
        Ok((kind, [x, y]))
    }

    /// What the colours of a figure say.
    fn colour(&mut self, of: &Family, is_map: bool) -> Result<Option<Quantity>, String> {
        let Family { colour_label: label, colour_scale: scale, .. } = of;
        let Some(name) = &of.colour else {
            let refused = "a phase map without colour (accepted: a number of the summary)";
            return if is_map { Err(refused.to_owned()) } else { Ok(None) };
        };
        if is_map {
            return number("colour", name, label, *scale).map(Some);
        }
        let (_, key) = self.key("colour", name)?;
        let words = key.values.len();
        if !key.is_number && words > MOST_WORDS {
            return Err(format!("colour = {name:?} has {words} values (accepted: up to {MOST_WORDS} words)"));
        }
        of_key("colour", key, label, *scale).map(Some)
    }

    /// A figure with its facet and its slice; and that every axis has a part in it, since runs that differ in
    /// something else would stand in one place as if they were the same.
    fn figure(mut self, of: &Family, keeps_ruptures: bool) -> Result<Figure, String> {
        let (kind, [x, y]) = self.kind(of, keeps_ruptures)?;
        let is_map = matches!(kind, Kind::PhaseMap { .. });
        let is_of_lengths = matches!(kind, Kind::Lengths { .. });
        let unused = [
            ("statistic", of.statistic.is_some() && !is_map, "a key as y"),
            ("law", of.law.is_some() && !is_of_lengths, "y = \"length_ratio\""),
        ];
        if let Some((key, _, accepted)) = unused.iter().find(|(_, is_unused, _)| *is_unused) {
            return Err(format!("{key} with y = {:?} (accepted: with {accepted})", of.y));
        }
        let colour = self.colour(of, is_map)?;
        let axes = [&x, &y].map(|of| ([of.column.as_str(), &of.label], of.log));
        let measured = MeasuredFile::points(&of.measured, &of.measured_label, axes)?;
        let mut facet = None;
        if let Some(name) = &of.facet {
            let (_, key) = self.key("facet", name)?;
            let panels = key.values.len();
            if panels > MOST_PANELS {
                return Err(format!("facet = {name:?} has {panels} values (accepted: up to {MOST_PANELS})"));
            }
            facet = Some(of_key("facet", key, &None, None)?);
        }
        for name in &of.over {
            self.key("over", name)?;
        }
        let mut at = Vec::new();
        for text in &of.at {
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| format!("at: {text:?} is not accepted (accepted: key=value)"))?;
            let (_, key) = self.key("at", name.trim())?;
            let value = read_place(value);
            if !key.values.contains(&value) {
                let values: Vec<String> = key.values.iter().take(20).map(Cell::to_string).collect();
                let more = if key.values.len() > 20 { " and more" } else { "" };
                return Err(format!(
                    "at: {value} is not among the values of {} (accepted: {}{more})",
                    key.path,
                    values.join(", ")
                ));
            }
            at.push((key.path.to_owned(), value));
        }
        for Axis { keys, .. } in self.axes {
            let is_used = keys.iter().any(|key| self.used.iter().any(|(_, name)| *name == key.path));
            if !is_used && keys.iter().any(|key| key.values.len() > 1) {
                let names: Vec<&str> = keys.iter().map(|key| key.path).collect();
                return Err(format!(
                    "{} varies, and the figure does not use it (accepted: as x, y, colour or facet where \
                     the kind has it, in over, or one value in at)",
                    names.join(", ")
                ));
            }
        }
        let Family { file, title, width_mm, .. } = of.clone();
        let is_spread = !of.over.is_empty();
        Ok(Figure { kind, file, title, width_mm, x, y, colour, facet, is_spread, at, measured })
    }
}

/// Numbers in a column.
fn quantity(column: &str, label: &Option<String>, own: impl FnOnce() -> String, log: bool) -> Quantity {
    Quantity { column: column.to_owned(), label: label.clone().unwrap_or_else(own), log, is_word: false }
}

/// A key on an axis of the figure.
fn of_key(
    what: &str,
    key: &Key<'_>,
    label: &Option<String>,
    scale: Option<Scale>,
) -> Result<Quantity, String> {
    let log = scale.map_or(key.log, |scale| scale == Scale::Log) && key.is_number;
    let is_low = |value: &Cell| matches!(value, Cell::Number(number) if *number <= 0.0);
    if let Some(low) = key.values.iter().find(|value| log && is_low(value)) {
        return Err(format!(
            "{what}_scale = \"log\" with {} = {low} (accepted: with values above 0, or \"linear\")",
            key.path
        ));
    }
    let quantity = quantity(key.path, label, || key_label(key.path), log);
    Ok(Quantity { is_word: !key.is_number, ..quantity })
}

/// The numbers that every run over axes has.
fn numbers_of_summary() -> impl Iterator<Item = Number> {
    Number::all().filter(|number| number.is_of_summary())
}

/// A number of the summary on an axis of the figure.
fn number(what: &str, name: &str, label: &Option<String>, scale: Option<Scale>) -> Result<Quantity, String> {
    let Some(Number { key, .. }) = numbers_of_summary().find(|number| number.name() == name) else {
        if Number::find(name).is_ok_and(|number| !number.is_of_summary()) {
            return Err(format!(
                "{what} = {name:?} needs all events of a run, of which a sweep stores the summary (accepted: a number of \
                 the summary, see `asperity summary --schema`)"
            ));
        }
        let names: Vec<&str> = numbers_of_summary().map(Number::name).collect();
        let among = among(name, &names, "`asperity summary --schema`");
        return Err(format!("{what} = {name:?} is no number of the summary{among}"));
    };
    let own = || with_unit(&key.label(), key.column.unit);
    Ok(quantity(name, label, own, scale == Some(Scale::Log)))
}

fn with_unit(label: &str, unit: Option<&str>) -> String {
    match unit {
        None | Some("1") => label.to_owned(),
        Some(unit) => {
            format!("{label} ({})", unit.replace("m2", "m^2").replace("s2", "s^2").replace("m3", "m^3"))
        }
    }
}

/// Symbol and unit of a key, or its name in words.
fn key_label(path: &str) -> String {
    let key = keys::named(path);
    let is_number = key.is_some_and(|key| matches!(key.kind, KeyKind::Number(..)));
    let unit = unit_of(path).filter(|_| is_number);
    let symbol = key.map_or("", |key| key.symbol);
    if symbol.is_empty() {
        let end = unit
            .filter(|unit| *unit != "1")
            .map(|unit| format!("_{}", unit.to_lowercase().replace('/', "_per_")));
        let bare = end.as_deref().and_then(|end| path.strip_suffix(end)).unwrap_or(path);
        return with_unit(&bare.replace(['_', '.'], " "), unit);
    }
    with_unit(&typeset(symbol), unit)
}

/// A symbol of the keys with Greek letters, and without spaces about its strokes.
fn typeset(symbol: &str) -> String {
    let word = |word: &str| {
        let (stem, rest) =
            word.split_once('_').map_or((word, String::new()), |(stem, rest)| (stem, format!("_{{{rest}}}")));
        let letter = greek(stem).unwrap_or(stem);
        format!("{letter}{rest}")
    };
    let words: Vec<String> = symbol.split(' ').map(word).collect();
    words.join(" ").replace(" / ", "/").replace("sqrt(", "√(")
}

#[cfg(test)]
mod tests {
    use asperity_record::Cell;

    use crate::draw::Figures;
    use crate::{Axis, Family, Key, Kind};

    /// Axes of a sweep: tilts and stiffnesses by factors, drives by name, and seeds.
    fn axes() -> Vec<Axis<'static>> {
        let numbers = |values: &[f64]| values.iter().map(|value| Cell::Number(*value)).collect::<Vec<_>>();
        let key = |path, values, log| Key { path, is_number: true, log, values };
        let words = ["side", "top"].map(|word| Cell::Word(word.into())).to_vec();
        let one = |key| Axis { keys: vec![key], joined: true };
        vec![
            one(key("normal_load.tilt", numbers(&[-0.5, 0.0, 0.5]), false)),
            one(key("friction.interfacial_stiffness_ratio", numbers(&[0.01, 0.1]), true)),
            one(Key { path: "drive.kind", is_number: false, log: false, values: words }),
            one(key("friction.seed", numbers(&[1.0, 2.0]), false)),
        ]
    }

    fn understand(text: &str, keeps_ruptures: bool) -> Result<Vec<crate::Figure>, String> {
        let figures: Figures = toml::from_str(text).map_err(|error| error.to_string())?;
        Family::understand(&figures.family, &axes(), keeps_ruptures)
    }

    const MAP: &str = "[[family]]\nfile = 'map.png'\nx = 'normal_load.tilt'\n\
        y = 'friction.interfacial_stiffness_ratio'\ncolour = 'precursor_count'\nfacet = 'drive.kind'\n\
        over = ['friction.seed']\n";
    const FAMILY: &str = "[[family]]\nfile = 'load.png'\nx = 'friction.interfacial_stiffness_ratio'\n\
        y = 'first_global_rupture_ft_fn'\ncolour = 'normal_load.tilt'\nat = ['drive.kind=side']\n\
        over = ['friction.seed']\ntheory = true\n";
    const LENGTHS: &str = "[[family]]\nfile = 'lengths.png'\nx = 'ft_fn_onset'\n\
        y = 'length_ratio'\nlaw = 'tilted'\ncolour = 'normal_load.tilt'\n\
        facet = 'friction.interfacial_stiffness_ratio'\nat = ['drive.kind=top', 'friction.seed=2']\n";

    #[test]
    fn axes_have_symbol_unit_and_the_spacing_of_the_sweep() {
        let all = understand(&format!("{MAP}{FAMILY}{LENGTHS}"), true).unwrap();
        let [map, family, lengths] = &all[..] else { panic!("{all:?}") };
        assert_eq!((map.x.label.as_str(), map.x.log), ("θ", false));
        assert_eq!((map.y.label.as_str(), map.y.log), ("k_{t}/k", true));
        assert_eq!(map.colour.as_ref().unwrap().label, "precursor count");
        assert!(map.is_spread && map.facet.as_ref().unwrap().is_word);
        assert_eq!(family.kind, Kind::Family { joined: true, theory: true });
        assert_eq!(family.y.label, "first global rupture F_T/F_N");
        assert_eq!(family.at, [("drive.kind".to_owned(), Cell::Word("side".into()))]);
        assert_eq!((lengths.at.len(), lengths.is_spread), (2, false));
        // What a plan holds is what was understood.
        let text = serde_json::to_string(&all).unwrap();
        assert_eq!(serde_json::from_str::<Vec<crate::Figure>>(&text).unwrap(), all);
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_with_what_can() {
        for (text, problem) in [
            (MAP.replace("map.png", "../map.png"), "file = \"../map.png\" is no name of a figure"),
            (MAP.replace("map.png", "map.svg"), "ending in .png"),
            (format!("{MAP}{MAP}"), "appears twice"),
            (
                MAP.replace("normal_load.tilt", "normal_load.tlit"),
                "x = \"normal_load.tlit\" does not vary; did you mean normal_load.tilt? (accepted: normal_load.tilt, fric",
            ),
            (
                MAP.replace("precursor_count", "precursor_cuont"),
                "colour = \"precursor_cuont\" is no number of the summary; did you mean precursor_count? (accepted: \
                 precursor_count,",
            ),
            (
                MAP.replace("precursor_count", "precursor_event_count"),
                "colour = \"precursor_event_count\" needs all events of a run, of which a sweep stores the summary",
            ),
            (
                MAP.replace("over = ['friction.seed']", ""),
                "friction.seed varies, and the figure does not use it (accepted: ",
            ),
            (
                MAP.replace("facet = 'drive.kind'", "facet = 'drive.kind'\nat = ['drive.kind=top']"),
                "drive.kind is both facet and at",
            ),
            (
                MAP.replace("over =", "x_scale = 'log'\nover ="),
                "x_scale = \"log\" with normal_load.tilt = -0.5 (accepted: ",
            ),
            (MAP.replace("over =", "colour_map = 'red'\nover ="), "unknown field `colour_map`"),
            (MAP.replace("over =", "statistic = 'mode'\nover ="), "unknown variant `mode`"),
            (
                FAMILY.replace("drive.kind=side", "drive.kind=bottom"),
                "bottom is not among the values of drive.kind (accepted: side, top)",
            ),
            (FAMILY.replace("drive.kind=side", "drive.kind"), "(accepted: key=value)"),
            (
                FAMILY.replace("first_global_rupture_ft_fn", "event_count"),
                "theory = true with y = \"event_count\" (accepted: with y one of first_",
            ),
            (
                FAMILY.replace("'friction.interfacial_stiffness_ratio'", "'drive.kind'"),
                "x = \"drive.kind\" holds words",
            ),
            (
                FAMILY.replace("'friction.interfacial_stiffness_ratio'", "'nothing'"),
                "x = \"nothing\" does not vary (accepted: ",
            ),
        ] {
            let error = understand(&text, true).unwrap_err();
            assert!(error.contains(problem), "{text}: {error}");
        }
        let error = understand(LENGTHS, false).unwrap_err();
        assert_eq!(
            error,
            "figure.family \"lengths.png\": its study keeps no ruptures (accepted: \"ruptures\" in keep)"
        );
    }
}
