//! The commands that read a run log: one list for the tests of what commands do with logs and with what is none, and for
//! the attack. A test fails if a command is missing.

/// A command on a run log.
pub(crate) struct OnLog {
    /// Its words: FILE is the log, FILES one or many, NEW a path that is free.
    pub(crate) words: &'static str,
    /// The exit codes of a sound log.
    pub(crate) codes: &'static [i32],
    /// What else it takes in place of the log, by the names of `given.rs`.
    pub(crate) takes: &'static [&'static str],
    /// Whether it reads the scenario of the log alone.
    pub(crate) scenario_alone: bool,
}

const fn on(words: &'static str) -> OnLog {
    OnLog { words, codes: &[0], takes: &[], scenario_alone: false }
}

const fn on_scenario(words: &'static str) -> OnLog {
    OnLog { takes: &["slider.toml", "other.toml"], scenario_alone: true, ..on(words) }
}

pub(crate) const ON_LOGS: [OnLog; 24] = [
    on("check FILES"),
    on("events FILE"),
    on("events FILE --format json"),
    on("summary FILES"),
    on("summary FILES --format json"),
    OnLog { takes: &["study"], ..on("catalogue FILES") },
    OnLog { takes: &["study"], ..on("catalogue FILES --format quakeml") },
    OnLog { takes: &["study"], ..on("catalogue FILES --format statistics") },
    on("draw FILE --out NEW"),
    OnLog { codes: &[0, 1], ..on("draw FILE --kind front-profile,stress --out NEW") },
    on("reduce FILE --out NEW"),
    on("replay FILES"),
    on("replay FILES --out NEW"),
    on("export FILES --to csv --out NEW"),
    on("export FILES --to ndjson --out NEW"),
    on("export FILES --to parquet --out NEW"),
    OnLog { takes: &["study", "made", "logs"], ..on("report FILES --out NEW.html") },
    OnLog { takes: &["study", "made", "logs"], ..on("diff FILE FILE --page NEW.html") },
    on("note FILE"),
    on("salvage FILE --out NEW.mcap"),
    on_scenario("scenario show FILE"),
    on_scenario("scenario validate FILE --quiet"),
    on_scenario("run FILE --quiet --out NEW.mcap"),
    on_scenario("run FILE --quiet --solver plain --out NEW.mcap"),
];

/// The words of a command for these files and a free path.
pub(crate) fn words(command: &str, files: &[&str], new: &str) -> Vec<String> {
    let of = |word: &str| match word {
        "FILES" => files.iter().map(|&file| file.to_owned()).collect(),
        word => vec![word.replace("FILE", files[0]).replace("NEW", new)],
    };
    command.split(' ').flat_map(of).collect()
}

/// The first form of a command that writes files; of one that writes none, the first.
pub(crate) fn form(name: &str) -> &'static str {
    let forms = ON_LOGS.iter().map(|command| command.words).filter(|words| words.starts_with(name));
    forms
        .clone()
        .find(|words| words.contains("NEW"))
        .or(forms.clone().next())
        .expect("a test names its commands")
}

/// The words as arguments.
pub(crate) fn arguments(words: &[String]) -> Vec<&str> {
    words.iter().map(String::as_str).collect()
}
