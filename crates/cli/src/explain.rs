//! `asperity keys`, `columns`, `numbers` and `figures`: what the code says of scenarios, of tables, of numbers of runs and
//! of figures.

use asperity_figures::keys::{self, Explained};
use asperity_figures::spelling::spelled;
use asperity_model::scenario::keys::{Key, sections};
use asperity_numbers::{Number, OfRecording, Summary, claim};
use asperity_record::{Column, Parts};
use asperity_run::detectors::event_kinds;
use asperity_study::pipeline::Pipeline;
use asperity_tables::{Table, layout, tables};
use clap::Args;

use crate::exit::Failure;
use crate::terminal;

#[derive(Debug, Args)]
pub(crate) struct ExplainArguments {
    /// Explain this in full, or all with the word in their names; without it, list everything.
    #[arg(value_name = "NAME")]
    name: Option<String>,
    /// Explain everything, as a page in Markdown.
    #[arg(long)]
    markdown: bool,
}

/// The keys of a scenario, by section.
pub(crate) fn keys(arguments: &ExplainArguments) -> Result<(), Failure> {
    let part = |key: &&Key| {
        let default = key.default_in(false).map_or(String::new(), |default| format!("default {default}"));
        let meaning = format!("{}: {}", key.symbol, key.doc);
        [key.path.to_owned(), key.kind.to_string(), default, meaning.trim_start_matches(": ").to_owned()]
    };
    let of = |(name, keys): (&str, Vec<&Key>)| {
        let parts = keys.iter().map(part).collect();
        Explained { name: name.to_owned(), parts, ..Explained::default() }
    };
    tell(sections().into_iter().map(of).collect(), arguments)
}

/// The columns of all tables: of logs by topic, and of reduced runs.
pub(crate) fn columns(arguments: &ExplainArguments) -> Result<(), Failure> {
    let claims = Table::of("claims", &[], &claim::columns(&[]));
    let all = layout::all(&event_kinds(Parts::ALL)).into_iter().chain(tables::all()).chain([claims]);
    let of = |table: Table| {
        let parts = table.columns.iter().map(|column| part(column, column.kind.words())).collect();
        Explained { name: table.name.into_owned(), parts, ..Explained::default() }
    };
    tell(all.map(of).collect(), arguments)
}

/// The numbers of a run, by their topics.
pub(crate) fn numbers(arguments: &ExplainArguments) -> Result<(), Failure> {
    let others = Number::all().filter(|number| !number.is_of_summary()).map(|number| number.key);
    let all: Vec<_> = Summary::KEYS.iter().chain(OfRecording::KEYS).chain(others).collect();
    let groups = all.chunk_by(|one, next| one.group == next.group).map(|keys| {
        let parts = keys.iter().map(|key| part(&key.column, key.convergence.word())).collect();
        Explained { name: keys[0].group.to_owned(), parts, ..Explained::default() }
    });
    tell(groups.collect(), arguments)
}

/// The kinds of figures and the tables of named runs, with their keys.
pub(crate) fn figures(arguments: &ExplainArguments) -> Result<(), Failure> {
    let mut all = keys::figures();
    all.extend(Pipeline::explained());
    tell(all, arguments)
}

/// A column as a part of a table. The unit stands beside its meaning, and what it means over an area behind.
fn part(column: &Column, second: &str) -> [String; 4] {
    let over_area =
        column.over_area.map(|about| format!(" Over an area: {}{}", about[..1].to_lowercase(), &about[1..]));
    let unit = column.unit.unwrap_or_default();
    let about = spelled(&format!("{}{}", column.about, over_area.unwrap_or_default()));
    let about = about.replace(&format!(", {unit};"), ";").replace(&format!(", {unit}."), ".");
    [column.name.to_string(), second.to_owned(), unit.to_owned(), about]
}

/// Prints what is asked for, in full; names alone where nothing is.
fn tell(mut all: Vec<Explained>, arguments: &ExplainArguments) -> Result<(), Failure> {
    let word = arguments.name.as_deref().unwrap_or_default();
    let plain = |name: &str| name.trim_start_matches("/events").trim_matches(['[', ']', '/']).to_owned();
    let is_it = |of: &Explained| plain(&of.name) == plain(word);
    if all.iter().any(is_it) {
        all.retain(is_it);
    } else {
        all.iter_mut().for_each(|of| of.parts.retain(|part| part[0].contains(word)));
    }
    all.retain(|of| !of.parts.is_empty());
    if all.is_empty() {
        return Err(Failure::BadInput(format!(
            "nothing is called {word:?} (accepted: a name, or part of one, that is listed when none is given)"
        )));
    }
    for Explained { name, about, parts, example } in all {
        let text = if arguments.markdown || !word.is_empty() {
            let row = |[name, of @ .., meaning]: &[String; 4]| {
                let of: Vec<_> = of.iter().map(String::as_str).filter(|of| !of.is_empty()).collect();
                format!("- `{name}` ({}): {meaning}\n", of.join(", "))
            };
            let rows: String = parts.iter().map(row).collect();
            let example = match example.trim_end() {
                "" => String::new(),
                example => format!("```toml\n{example}\n```"),
            };
            let all = [&format!("### {name}"), &about, rows.trim_end(), &example];
            let all: Vec<_> = all.into_iter().filter(|text| !text.is_empty()).collect();
            all.join("\n\n") + "\n\n"
        } else {
            let names: Vec<_> = parts.iter().map(|part| &*part[0]).collect();
            format!("{}\n  {}\n", format!("{name}: {about}").trim_end_matches([':', ' ']), names.join(", "))
        };
        terminal::print(text.as_bytes())?;
    }
    Ok(())
}
