//! A command with a path of the wrong kind names the kind, and the command for it.

use std::fs;
use std::path::PathBuf;

use crate::support::binary::{asperity, succeed, text};
use crate::support::small;
use crate::sweep::SHORT;

/// One of each, in a folder.
struct Things {
    folder: tempfile::TempDir,
}

const THINGS: [(&str, &str); 9] = [
    ("a.mcap", "this is a run log: asperity summary "),
    ("slider.toml", "this is a scenario: asperity run "),
    ("sweep.toml", "this is a sweep: asperity sweep go "),
    ("pipeline.toml", "this is a pipeline: asperity reproduce "),
    ("other.toml", "this is a TOML file"),
    ("table.parquet", "this is a Parquet table: asperity events "),
    ("study", "this is the folder of a study: asperity sweep status "),
    ("made", "this is a folder of asperity reproduce: its logs are "),
    ("logs", "this is a folder of run logs: "),
];

impl Things {
    fn make() -> Things {
        let things = Things { folder: asperity_testkit::folder() };
        let write = |name: &str, text: &str| fs::write(things.path(name), text).expect("it can be written");
        small::run(&things.path("a.mcap"));
        write("slider.toml", "[slider]\nblocks = 7\n");
        write("sweep.toml", SHORT);
        write("pipeline.toml", "title = 'One'\n[[run]]\nname = 'a'\nscenario = 'ten-blocks'\n");
        write("other.toml", "[allow]\nshifted = true\n");
        write("table.parquet", "PAR1");
        succeed(&["sweep", "plan", text(&things.path("sweep.toml")), "-o", text(&things.path("study"))]);
        for folder in ["made", "logs"] {
            fs::create_dir(things.path(folder)).expect("it can be written");
            fs::copy(things.path("a.mcap"), things.path(folder).join("a.mcap")).expect("it can be written");
        }
        write("made/reproduce.json", "{}");
        things
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }
}

/// Commands, with GIVEN in place of a path, and the kinds that each accepts.
const COMMANDS: [(&[&str], &[&str]); 26] = [
    (&["run", "GIVEN", "-o", "NEW.mcap"], &["a.mcap", "slider.toml", "other.toml"]),
    (&["scenario", "show", "GIVEN"], &["a.mcap", "slider.toml", "other.toml"]),
    (&["scenario", "validate", "GIVEN", "-q"], &["a.mcap", "slider.toml", "other.toml"]),
    (&["check", "GIVEN"], &["a.mcap"]),
    (&["summary", "GIVEN"], &["a.mcap"]),
    (&["events", "GIVEN"], &["a.mcap", "table.parquet"]),
    (&["catalogue", "GIVEN"], &["a.mcap", "study"]),
    (&["replay", "GIVEN"], &["a.mcap"]),
    (&["export", "GIVEN", "--to", "csv", "-o", "NEW"], &["a.mcap"]),
    (&["salvage", "GIVEN", "-o", "NEW.mcap"], &["a.mcap"]),
    (&["report", "GIVEN", "-o", "NEW.html"], &["a.mcap", "study", "made", "logs"]),
    (&["diff", "GIVEN", "a.mcap"], &["a.mcap", "table.parquet", "study", "made", "logs"]),
    (&["diff", "a.mcap", "GIVEN"], &["a.mcap", "table.parquet", "study", "made", "logs"]),
    (&["reduce", "GIVEN", "-o", "NEW"], &["a.mcap"]),
    (&["draw", "GIVEN", "-o", "NEW"], &["a.mcap"]),
    (&["reproduce", "GIVEN", "-o", "NEW"], &["pipeline.toml", "sweep.toml", "other.toml"]),
    (&["verify-solver", "GIVEN", "--for-s", "1e-7"], &["pipeline.toml", "sweep.toml", "other.toml"]),
    (&["sweep", "plan", "GIVEN", "-o", "NEW"], &["pipeline.toml", "sweep.toml", "other.toml"]),
    (&["sweep", "go", "GIVEN", "-o", "NEW"], &["pipeline.toml", "sweep.toml", "other.toml"]),
    (&["sweep", "draw", "study", "--from", "GIVEN"], &["pipeline.toml", "sweep.toml", "other.toml"]),
    (&["sweep", "run", "GIVEN"], &["study"]),
    (&["sweep", "status", "GIVEN"], &["study"]),
    (&["sweep", "collect", "GIVEN"], &["study"]),
    (&["sweep", "draw", "GIVEN"], &["study"]),
    (&["sweep", "log", "GIVEN", "1", "-o", "NEW.mcap"], &["study"]),
    (&["sweep", "emit", "list", "GIVEN"], &["study"]),
];

#[test]
fn what_is_given_in_the_wrong_place_is_named() {
    let things = Things::make();
    let mut refused = 0;
    for (command, takes) in COMMANDS {
        for (thing, says) in THINGS.into_iter().filter(|(thing, _)| !takes.contains(thing)) {
            let word = |word: &&str| match *word {
                "GIVEN" => text(&things.path(thing)).to_owned(),
                "a.mcap" | "study" => text(&things.path(word)).to_owned(),
                word => word.replace("NEW", text(&things.path("new"))),
            };
            let words: Vec<String> = command.iter().map(word).collect();
            let output = asperity(&words.iter().map(String::as_str).collect::<Vec<&str>>());
            let said = [output.stdout, output.stderr].concat();
            let said = String::from_utf8_lossy(&said);
            assert!(
                output.status.code() == Some(2) && said.contains(says),
                "asperity {}: {}: {said}",
                words.join(" "),
                output.status
            );
            assert!(said.contains(thing), "{said}");
            refused += 1;
        }
    }
    assert!(refused > 150, "{refused}");
    let new = fs::read_dir(things.folder.path()).expect("it is there").flatten();
    let new: Vec<_> =
        new.map(|entry| entry.file_name()).filter(|name| name.to_string_lossy().starts_with("new")).collect();
    assert!(new.is_empty(), "{new:?}");
}
