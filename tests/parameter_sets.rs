//! The slider of a run: the physical one unless something names the other; stored runs keep theirs.

use std::fs;
use std::path::Path;

use asperity_model::scenario::keys::{KEYS, Key};
use asperity_runlog::{RunReader, Topics, partial_path};
use asperity_testkit::folder;

use crate::support::binary::{AS_CODED, as_given, text};

/// Exit code, standard output and standard error of a command.
fn outcome(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = as_given(arguments);
    let text = |bytes| String::from_utf8(bytes).expect("the binary writes UTF-8");
    (output.status.code(), text(output.stdout), text(output.stderr))
}

fn parameter_set(log: &Path) -> String {
    let reader = RunReader::open(log, Topics::NONE).expect("it is a run log");
    reader.header().parameter_set.clone()
}

const SHORT: [&str; 2] = ["--set", "time.duration_s=0.01"];
const CODED: &str = "as coded: 12 kg, c = 46 m/s";

#[test]
fn a_file_that_names_no_set_is_as_stated_without_a_word() {
    let folder = folder();
    let (file, log) = (folder.path().join("mine.toml"), folder.path().join("mine.mcap"));
    fs::write(&file, "name = \"mine\"\ntime.duration_s = 0.01\n").expect("the folder can be written");
    let (code, _, said) = outcome(&["run", text(&file), "--out", text(&log)]);
    assert!(code == Some(0) && !said.contains("parameter_set") && !said.contains("as coded"), "{said}");
    assert_eq!(parameter_set(&log), "as-stated");
}

#[test]
fn a_run_as_coded_says_so_in_its_line_its_summary_and_its_page() {
    let folder = folder();
    let [coded, stated, page] =
        ["coded.mcap", "stated.mcap", "page.html"].map(|name| folder.path().join(name));
    let set = ["--set", AS_CODED];
    let (code, _, said) =
        outcome(&[&["run", "default"], &set[..], &SHORT, &["--out", text(&coded)]].concat());
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains(&format!("default: 0 precursors, no slip of the whole slider; {CODED}\n")),
        "{said}"
    );
    let (code, _, said) = outcome(&[&["run", "default"], &SHORT[..], &["--out", text(&stated)]].concat());
    assert!(code == Some(0) && !said.contains("as coded"), "{said}");

    let summary = outcome(&["summary", text(&coded)]).1;
    assert!(summary.lines().any(|line| line.contains("parameter set") && line.ends_with(CODED)), "{summary}");
    assert!(!outcome(&["summary", text(&stated)]).1.contains("as coded"));
    let (_, _, said) = outcome(&["summary", text(&stated), text(&coded)]);
    assert_eq!(said.lines().collect::<Vec<_>>(), [format!("{}: {CODED}", coded.display())]);

    {
        for (log, count) in [(&coded, 1), (&stated, 0)] {
            assert_eq!(outcome(&["report", text(log), "--out", text(&page), "--force"]).0, Some(0));
            let html = fs::read_to_string(&page).expect("the page is there");
            assert_eq!(html.matches(&format!("<b>{CODED}</b>")).count(), count);
        }
    }
}

/// The scenario of an unfinished log is the one from its start.
#[test]
fn a_run_that_the_former_default_left_is_refused_or_ends_as_coded() {
    let folder = folder();
    let [whole, log] = ["whole.mcap", "run.mcap"].map(|name| folder.path().join(name));
    let set = ["--set", AS_CODED];
    let begin = |set: &[&str], out: &Path| {
        let end = ["--resume", "--checkpoint-s", "0", "--out", text(out)];
        outcome(&[&["run", "default"], set, &SHORT, &end].concat())
    };
    assert_eq!(begin(&set, &whole).0, Some(0));
    let bytes = fs::read(&whole).expect("it was just written");
    fs::write(partial_path(&log), &bytes[..bytes.len() * 3 / 4]).expect("the folder can be written");
    let (code, _, said) = begin(&[], &log);
    assert!(code == Some(2) && said.contains("another scenario"), "{said}");
    let (code, _, said) = begin(&set, &log);
    assert!(code == Some(0) && said.contains(CODED), "{said}");
    assert_eq!(parameter_set(&log), "as-coded");

    // By another program.
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/logs/interrupted.mcap");
    let left = folder.path().join("left.mcap");
    fs::copy(&fixture, partial_path(&left)).expect("the folder can be written");
    assert_eq!(parameter_set(&partial_path(&left)), "as-coded");
    let resume = outcome(&["run", text(&fixture), "--resume", "--out", text(&left)]);
    assert!(resume.0 == Some(2) && !left.exists(), "{resume:?}");
    let shown = outcome(&["scenario", "show", text(&fixture)]).1;
    assert!(shown.contains("\nparameter_set = \"as-coded\"\n"), "{shown}");
}

#[test]
fn studies_say_which_sets_their_runs_have_and_what_chose_them() {
    let folder = folder();
    let (file, plan) = (folder.path().join("study.toml"), folder.path().join("plan"));
    let text_of = "title = 'Two'\nset = ['parameter_set=as-coded', 'time.duration_s=0.001']\nscenario = 'default'\n\
                   [[axis]]\nkey = 'normal_load.tilt'\nvalues = [0, 0.5]\n\
                   [[run]]\nname = 'physical'\nscenario = 'default'\nset = ['parameter_set=as-stated']\n";
    fs::write(&file, text_of).expect("the folder can be written");
    let (code, _, said) = outcome(&["sweep", "plan", text(&file), "--out", text(&plan)]);
    let expected = "study.toml: as-coded in 2 runs (set of the study), as-stated in 1 run (set of the run)\n";
    assert!(code == Some(0) && said.contains(expected), "{said}");
    assert_eq!(outcome(&["sweep", "run", text(&plan)]).0, Some(0));
    assert_eq!(parameter_set(&plan.join("runs/physical.mcap")), "as-stated");
}

/// Symbols and defaults change what stored scenarios mean: a change of them is a decision, written there by hand.
#[test]
fn keys_have_the_symbols_and_defaults_that_were_accepted() {
    let (code, shown, _) = outcome(&["scenario", "show", "default"]);
    assert_eq!(code, Some(0));
    let shown: toml::Value = shown.parse::<toml::Table>().expect("it is TOML").into();
    let row = |key: &Key| {
        let value = key.path.split('.').try_fold(&shown, |table, part| table.get(part));
        format!("{}\t{}\t{}\n", key.path, key.symbol, value.map(ToString::to_string).unwrap_or_default())
    };
    let accepted = include_str!("../fixtures/golden/keys.tsv");
    // Behind name and summary, which mean nothing.
    assert_eq!(
        KEYS[2..].iter().map(row).collect::<String>(),
        accepted,
        "not those of fixtures/golden/keys.tsv"
    );
}
