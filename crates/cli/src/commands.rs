//! Suggests a command for an unknown word: a command of another group (`validate` is `scenario validate`),
//! a word of other programs (`plot`), or a file alone.

use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Error};

/// Words for commands: of several, the first that this build has is meant.
const WORDS: &[(&[&str], &[&str])] = &[
    (&["plot", "figure", "picture", "graph"], &["draw", "reduce", "report"]),
    (&["catalog", "quakeml", "magnitudes"], &["catalogue"]),
    (&["ls", "scenarios", "builtins"], &["scenario list"]),
    (&["new", "init", "template"], &["scenario show"]),
    (&["simulate", "sim", "start", "solve"], &["run"]),
    (&["continue", "restart"], &["resume"]),
    (&["info", "stats", "inspect", "describe", "print"], &["summary"]),
    (&["compare"], &["diff"]),
    (&["convert", "csv", "parquet", "table", "tables"], &["export"]),
    (&["repair", "recover", "fix"], &["salvage"]),
    (&["page", "html"], &["report"]),
    (&["pipeline", "claims"], &["reproduce"]),
    (&["study", "scan", "batch", "slurm"], &["sweep"]),
];

/// Adds to an error about an unknown command which one is meant. Where none is known, near spellings stay.
pub(crate) fn advised(mut error: Error, all: &Command) -> Error {
    if error.kind() != ErrorKind::InvalidSubcommand {
        return error;
    }
    let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand) else { return error };
    let tips = meant(word, all);
    if !tips.is_empty() {
        error.remove(ContextKind::SuggestedSubcommand);
        let tips = tips.into_iter().map(StyledStr::from).collect();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(tips));
    }
    error
}

/// The probable meaning of a word, as advice.
fn meant(word: &str, all: &Command) -> Vec<String> {
    let advice =
        |path: &str| format!("the command is 'asperity {path}'; 'asperity {path} --help' explains it");
    let of_group: Vec<String> = all
        .get_subcommands()
        .flat_map(|group| {
            group.get_subcommands().map(|command| format!("{} {}", group.get_name(), command.get_name()))
        })
        .filter(|path| path.ends_with(&format!(" {word}")))
        .collect();
    if has(all, word) {
        return vec![advice(word)];
    }
    if !of_group.is_empty() {
        return of_group.iter().map(|path| advice(path)).collect();
    }
    if let Some((_, commands)) = WORDS.iter().find(|(words, _)| words.contains(&word)) {
        return commands.iter().find(|path| has(all, path)).map(|path| advice(path)).into_iter().collect();
    }
    match word.rsplit_once('.').map(|(_, ending)| ending) {
        Some("toml") => [
            format!("of a scenario, 'asperity run {word} -o RUN.mcap' makes a run"),
            format!("of a sweep, 'asperity sweep plan {word} -o FOLDER' begins a study"),
        ]
        .into(),
        Some("mcap") => {
            vec![format!("'asperity summary {word}' gives the numbers of a run, 'asperity report' a page")]
        }
        _ => Vec::new(),
    }
}

/// Whether there is a command of that path.
fn has(all: &Command, path: &str) -> bool {
    path.split(' ').try_fold(all, |command, name| command.find_subcommand(name)).is_some()
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory;

    use super::{WORDS, has, meant};
    use crate::args::Arguments;

    #[test]
    fn every_word_leads_to_a_command_and_none_is_one() {
        let all = Arguments::command();
        for (words, commands) in WORDS {
            assert!(commands.iter().any(|path| has(&all, path)), "{commands:?}");
            for word in *words {
                assert!(!has(&all, word), "{word} is a command");
                assert_eq!(meant(word, &all).len(), 1, "{word}");
            }
        }
        for (word, path) in [("validate", "scenario validate"), ("list", "scenario list"), ("run", "run")] {
            assert!(meant(word, &all)[0].contains(&format!("'asperity {path}'")), "{word}");
        }
        assert!(meant("jump", &all).is_empty());
    }
}
