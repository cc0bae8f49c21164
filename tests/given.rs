//! A command with a path of the wrong kind names the kind, and the command for it.

use std::fs;
use std::path::PathBuf;

use crate::support::binary::{asperity, succeed, text};
use crate::support::commands::{ON_LOGS, arguments, words};
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
    ("table.parquet", "this is a Parquet table, which is written for other programs: give the log "),
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

/// The commands on other things, and the kinds that each accepts.
const COMMANDS: [(&str, &[&str]); 11] = [
    ("diff SOUND FILE", &["a.mcap", "study", "made", "logs"]),
    ("reproduce FILE -o NEW", &["pipeline.toml", "sweep.toml", "other.toml"]),
    ("sweep plan FILE -o NEW", &["pipeline.toml", "sweep.toml", "other.toml"]),
    ("sweep go FILE -o NEW", &["pipeline.toml", "sweep.toml", "other.toml"]),
    ("sweep draw STUDY --from FILE", &["pipeline.toml", "sweep.toml", "other.toml"]),
    ("sweep run FILE", &["study"]),
    ("sweep status FILE", &["study"]),
    ("sweep collect FILE", &["study"]),
    ("sweep draw FILE", &["study"]),
    ("sweep log FILE 1 -o NEW.mcap", &["study"]),
    ("sweep emit list FILE", &["study"]),
];

#[test]
fn what_is_given_in_the_wrong_place_is_named() {
    let things = Things::make();
    let mut refused = 0;
    let [sound, study, new] = ["a.mcap", "study", "new"].map(|name| things.path(name));
    let on_logs = ON_LOGS.iter().map(|command| (command.words, [&["a.mcap"], command.takes].concat()));
    for (command, takes) in on_logs.chain(COMMANDS.map(|(command, takes)| (command, takes.to_vec()))) {
        let command = command.replace("SOUND", text(&sound)).replace("STUDY", text(&study));
        for (thing, says) in THINGS.into_iter().filter(|(thing, _)| !takes.contains(thing)) {
            let words = words(&command, &[text(&things.path(thing))], text(&new));
            let output = asperity(&arguments(&words));
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
