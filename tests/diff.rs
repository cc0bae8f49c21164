//! `asperity diff` from files to exit code: real runs, tables as other programs write them, folders,
//! policies, and files that are no tables.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{outcome, run, succeed, text};
use crate::support::small;
use asperity_testkit::folder;
use serde_json::Value;

/// Diffs with these arguments; gives exit code, standard output and standard error.
fn diff(arguments: &[&str]) -> (i32, String, String) {
    outcome(&[&["diff"], arguments].concat())
}

fn json(arguments: &[&str]) -> (i32, Value) {
    let (code, out, err) = diff(&[arguments, &["--format", "json"]].concat());
    assert!(err.is_empty(), "{err}");
    (code, serde_json::from_str(&out).expect("the report is JSON"))
}

fn write(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, content).expect("the folder can be written");
    path
}

#[test]
fn runs_logs_and_tables_of_one_run_are_the_same() {
    let folder = folder();
    let [log, other] = ["run.mcap", "other.mcap"].map(|name| folder.path().join(name));
    small::run(&log);
    run(&[&small::SCENARIO[..], &["--set", "time.duration_s=0.9"]].concat(), &other);
    let reduced = folder.path().join("reduced");
    succeed(&["reduce", text(&log), "--out", text(&reduced)]);

    for side in [reduced.join("events.csv"), log.clone(), reduced.clone()] {
        let (code, out, _) = diff(&[text(&log), text(&side)]);
        if side == reduced {
            // A folder is no file: its table has another name than the run.
            assert_eq!(code, 1, "{out}");
            assert!(out.contains("only old: run:"), "{out}");
            continue;
        }
        assert_eq!(code, 0, "{out}");
        assert!(out.contains("28 identical") && out.ends_with("nothing differs\n"), "{out}");
    }

    // Parquet is written for other programs.
    let parquet = reduced.join("events.parquet");
    let (code, _, said) = diff(&[text(&log), text(&parquet)]);
    assert!(code == 2 && said.contains("written for other programs") && said.contains("as CSV"), "{said}");
    let only_parquet = folder.path().join("only");
    fs::create_dir(&only_parquet).expect("the folder can be written");
    fs::copy(parquet, only_parquet.join("events.parquet")).expect("the folder can be written");
    let (code, _, said) = diff(&[text(&log), text(&only_parquet)]);
    assert!(code == 2 && said.contains("no tables that are read"), "{said}");

    // A truncated copy of the run: events that start after its end are open, not missing.
    let (code, report) = json(&[text(&log), text(&other)]);
    assert_eq!(code, 1);
    assert_eq!((&report["format"], &report["version"]), (&"asperity-diff".into(), &1.into()));
    let run = &report["runs"][0];
    assert_eq!(run["counts"]["missing"], 0);
    let open = run["counts"]["open"].as_u64().expect("a count");
    assert!(open > 0, "{run}");
    assert_eq!(run["counts"]["identical"].as_u64(), Some(28 - open));
    assert_eq!(run["provenance"][0]["key"], "scenario: time.duration_s");
    assert_eq!(run["precursors"]["old_rows"], run["precursors"]["same_rows"]);
}

#[test]
fn another_time_step_shifts_events_and_a_drafted_policy_lets_them_pass() {
    let folder = folder();
    let [fine, coarse] = ["fine.mcap", "coarse.mcap"].map(|name| folder.path().join(name));
    small::run(&fine);
    run(&["ten-blocks", "--set", "time.step_s=2e-7", "--set", "time.duration_s=1.2"], &coarse);
    let (policy, matches) = (folder.path().join("policy.toml"), folder.path().join("matches.parquet"));
    let given = [text(&fine), text(&coarse), "--draft-policy", text(&policy), "--matches", text(&matches)];
    let (code, out, err) = diff(&given);
    assert_eq!(code, 1, "{out}{err}");
    assert!(out.contains("\nset differently ") && out.contains("\n  time.step_s (s) "), "{out}");
    assert!(out.lines().count() <= 40, "{out}");
    assert!(fs::read(&matches).is_ok_and(|bytes| bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1")));
    let (code, out, _) = diff(&[text(&fine), text(&coarse), "--policy", text(&policy)]);
    assert_eq!(code, 0, "{out}\n{}", fs::read_to_string(&policy).expect("the draft is there"));
    // Not twice over the same file, which may have been edited.
    let (code, _, err) = diff(&given);
    assert_eq!(code, 2);
    assert!(err.contains("exists already (accepted: another file, or --force)"), "{err}");
    assert_eq!(diff(&[&given[..], &["--force"]].concat()).0, 1);
}

const TABLE: &str = "onset_s,end_s,first_block,last_block,max_sliding,ft_fn_onset,ft_fn_end\n\
    0.1,0.11,1,3,3,0.02,0.021\n0.2,0.22,1,5,4,0.04,0.041\n0.3,,1,6,4,0.06,\n";

#[test]
fn folders_of_tables_are_paired_by_name() {
    let folder = folder();
    let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
    for side in [&old, &new] {
        fs::create_dir(side).expect("a folder can be made");
        write(side, "same.events.csv", TABLE);
        write(side, "moved.csv.txt", "not a table");
    }
    write(&old, "changed.events.csv", TABLE);
    write(&new, "changed.events.csv", &TABLE.replace("0.2,0.22,1,5", "0.2,0.22,1,4"));
    let (code, out, _) = diff(&[text(&old), text(&new)]);
    assert_eq!(code, 1);
    assert!(out.contains("changed: 2 identical, 1 changed"), "{out}");
    assert!(out.contains("changed: old 1, new 1, blocks 1-5 at 0.2 s: last_block 5 -> 4"), "{out}");
    let policy = write(folder.path(), "policy.toml", "[allow]\nchanged = 1\n");
    assert_eq!(diff(&[text(&old), text(&new), "--policy", text(&policy)]).0, 0);
    let policy =
        write(folder.path(), "tight.toml", "[allow]\nchanged = true\n[columns.last_block]\nabsolute = 0\n");
    assert_eq!(diff(&[text(&old), text(&new), "--policy", text(&policy)]).0, 0);
    // A run that one side lacks is reported, and no policy allows it.
    write(&new, "added.events.csv", TABLE);
    let (code, out, _) = diff(&[text(&old), text(&new), "--policy", text(&policy)]);
    assert_eq!(code, 1);
    assert!(out.contains("only new: added: the other side has no run of this scenario or name"), "{out}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_its_place() {
    let folder = folder();
    let good = write(folder.path(), "good.csv", TABLE);
    let refused = |content: &str| {
        let bad = write(folder.path(), "bad.csv", content);
        let (code, out, err) = diff(&[text(&good), text(&bad)]);
        assert_eq!((code, out.as_str()), (2, ""), "{err}");
        err.replace(text(&bad), "bad.csv")
    };
    assert_eq!(
        refused(&TABLE.replace("0.2,0.22,1,5", "0.2,0.22,0,5")),
        "error: bad.csv:3: first_block: \"0\" is not accepted (accepted: a whole number from 1 to 100000)\n"
    );
    assert_eq!(
        refused(&TABLE.replace("0.2,0.22", "0.2,soon")),
        "error: bad.csv:3: end_s: \"soon\" is not accepted (accepted: a number, or nothing where the run ended before)\n"
    );
    assert!(
        refused(&TABLE.replace("0.2,0.22", "0.2,0.19"))
            .contains("end_s: \"0.19\" is not accepted (accepted: a number from onset_s")
    );
    assert!(refused(&TABLE.replace("0.2,0.22", "nan,0.22")).contains("bad.csv:3: onset_s: "));
    assert!(
        refused(&TABLE.replace("last_block", "last"))
            .contains("bad.csv:1: there is no column last_block (accepted: a table with at least onset_s")
    );
    assert!(refused(&TABLE.replace("0.2,0.22", "0.05,0.22")).contains(
        "event 1 starts at 0.05 s, the one before it at 0.1 s (accepted: events in order of their onsets)"
    ));
    let (code, _, err) = diff(&[text(&good), "/nowhere/run.txt"]);
    assert_eq!(code, 2);
    assert!(err.contains("(accepted: .mcap, .csv, or a folder of them; Parquet"), "{err}");
    let policy = write(folder.path(), "policy.toml", "[columns.onset]\nabsolute = 1\n");
    let (code, _, err) = diff(&[text(&good), text(&good), "--policy", text(&policy)]);
    assert_eq!(code, 2);
    assert!(
        err.contains(
            "policy.toml:1:10: columns.onset: no column of the event table that is compared (accepted: onset_s"
        ),
        "{err}"
    );
    assert_eq!(diff(&[text(folder.path().join("none").as_path()), text(&good)]).0, 2);
}

/// One screen, whatever the tables: a thousand events that all differ, in every class and column.
#[test]
fn the_summary_fits_a_screen() {
    let folder = folder();
    let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
    for (side, by) in [(&old, 0.0), (&new, 1e-5)] {
        fs::create_dir(side).expect("a folder can be made");
        for run in 0..20 {
            let mut table = TABLE.lines().next().expect("a heading").to_owned();
            for event in 0..300 {
                let onset_s = 0.01 * f64::from(event) + by * f64::from(event % 7);
                let last = 1 + (event + i32::from(by > 0.0 && event % 3 == 0)) % 50;
                if !(by > 0.0 && event % 11 == 0) {
                    table += &format!("\n{onset_s},{},1,{last},{last},{},0.1", onset_s + 1e-3, 0.1 + onset_s);
                }
            }
            // Each side has runs of its own as well.
            let of_side = if run % 3 == 0 && by > 0.0 { "new" } else { "run" };
            write(side, &format!("{of_side}-{run}.events.csv"), &table);
        }
    }
    let (code, out, _) = diff(&[text(&old), text(&new)]);
    assert_eq!(code, 1);
    assert!(out.lines().count() <= 40, "{} lines:\n{out}", out.lines().count());
    assert!(out.contains("what became of which events, 8 of 3562 (see --format json):"), "{out}");
    let (_, report) = json(&[text(&old), text(&new)]);
    assert_eq!(report["unpaired"].as_array().map(Vec::len), Some(14));
    let first = &report["runs"][0];
    assert_eq!(first["findings_left_out"], 0);
    let differing: u64 = ["shifted", "changed", "split", "merged", "missing", "extra", "open"]
        .iter()
        .map(|class| first["counts"][class].as_u64().expect("a count"))
        .sum();
    assert_eq!(first["findings"].as_array().map(|findings| findings.len() as u64), Some(differing));
}

/// Two outputs of a pipeline: runs paired by scenario, claims compared.
#[test]
fn outputs_of_a_pipeline_are_compared_with_their_claims() {
    let folder = folder();
    let pipeline = |stated: &str| {
        format!(
            "title = \"One run\"\n[[run]]\nname = \"small\"\nscenario = \"ten-blocks\"\n\
             set = [\"parameter_set=as-coded\", \"time.step_s=1e-7\", \"time.duration_s=0.9\"]\n[[claim]]\nabout = \"a\"\nquote = \"q\"\n\
             run = \"small\"\nmeasure = \"first_slip_ft_fn\"\nstated = \"{stated}\"\n"
        )
    };
    for (name, stated) in [("old", "0.113"), ("new", "0.2")] {
        let file = write(folder.path(), &format!("{name}.toml"), &pipeline(stated));
        succeed(&["reproduce", text(&file), "--out", text(&folder.path().join(name))]);
    }
    let [old, new] = ["old", "new"].map(|name| folder.path().join(name));
    let (code, report) = json(&[text(&old), text(&new)]);
    assert_eq!(code, 0, "claims follow from events and from what is claimed; the events are the same");
    assert_eq!(report["runs"][0]["old"]["name"], "small");
    let claims = report["claims"].as_array().expect("claims are listed");
    assert_eq!(claims.len(), 1);
    assert_eq!((&claims[0]["old_verdict"], &claims[0]["new_verdict"]), (&"agrees".into(), &"differs".into()));
}

/// The numbers of a run, by the command that is there for them.
fn summary(log: &Path) -> Value {
    serde_json::from_str(&succeed(&["summary", text(log), "--format", "json"])).expect("it is JSON")
}

#[test]
fn of_runs_of_two_time_steps_the_physics_is_told_first() {
    let folder = folder();
    let [fine, coarse] = ["fine.mcap", "coarse.mcap"].map(|name| folder.path().join(name));
    for (log, step) in [(&fine, "time.step_s=1e-7"), (&coarse, "time.step_s=2e-7")] {
        run(&["default", "--set", step, "--set", "time.duration_s=3"], log);
    }
    let (code, out, _) = diff(&[text(&fine), text(&coarse)]);
    assert_eq!(code, 1);
    let place = |words: &str| out.find(words).unwrap_or_else(|| panic!("no {words:?} in\n{out}"));
    let first = [
        "set differently ",
        "  time.step_s (s) ",
        "  precursor_count ",
        "  first_global_rupture_onset_s ",
        "  first_global_rupture_ft_fn ",
        "  first_global_rupture_front_speed_m_per_s ",
        "  largest_ft_fn ",
        "  recurrence_transient_s ",
        "  recurrence_steady_s ",
        " more numbers of the summary differ, see --format json",
        " two-sample Kolmogorov-Smirnov test ",
        "  sizes below the whole slider, blocks: ",
        "  onset to onset, s: ",
        " new ruptures: ",
        "; all of them: --page FILE.html or --format json\ndiffers\n",
    ];
    assert!(first.map(place).is_sorted(), "{out}");
    assert!(!out.contains(" new events: ") && out.lines().count() <= 40, "{out}");
    // As `summary` marks them.
    let row = |key: &str| out.lines().find(|line| line.contains(key)).expect("a row");
    assert!(row("recurrence_steady_s").ends_with("  ~ one draw"), "{out}");
    assert!(row("first_global_rupture_ft_fn").ends_with(" %"), "{out}");

    let (_, report) = json(&[text(&fine), text(&coarse)]);
    let pair = &report["runs"][0];
    let (old, new) = (summary(&fine), summary(&coarse));
    let numbers = pair["summary"].as_array().expect("a list");
    // All but the name of its file, `run`, and what they are worth.
    assert_eq!(numbers.len(), old.as_object().expect("an object").len() - 2);
    for number in numbers {
        let key = number["key"].as_str().expect("a key");
        assert_eq!((&number["old"], &number["new"]), (&old[key], &new[key]), "{key}");
        if let (Some(old), Some(new)) = (old[key].as_f64(), new[key].as_f64()) {
            let relative = number["relative_change"].as_f64();
            assert_eq!(relative, (old != 0.0).then(|| (new - old) / old.abs()), "{key}");
        }
    }

    // With the window of that pair, the ruptures of the whole slider find their counterparts.
    let ruptures = &pair["ruptures"];
    assert!(ruptures["window_s"].as_f64() > Some(0.01), "{}", ruptures["window_s"]);
    let count = |class: &str| ruptures["counts"][class].as_u64().expect("a count");
    let alone = count("missing") + count("extra");
    let all = ruptures["old"].as_u64().expect("a count") + ruptures["new"].as_u64().expect("a count");
    assert!(5 * alone < all, "{alone} of {all} are alone");
    let whole = |side: &Value| side[0]["first_block"] == 1 && side[0]["last_block"] == 100;
    let of_whole: Vec<&Value> = ruptures["matches"]
        .as_array()
        .expect("a list")
        .iter()
        .filter(|found| whole(&found["old"]) || whole(&found["new"]))
        .collect();
    let paired = of_whole.iter().filter(|found| whole(&found["old"]) && whole(&found["new"])).count();
    assert!(paired >= 5 && of_whole.len() - paired <= 1, "{of_whole:?}");
    assert_eq!(old["global_rupture_count"], 6);

    // The page lists the largest of those that differ.
    let page = folder.path().join("page.html");
    diff(&[text(&fine), text(&coarse), "--page", text(&page)]);
    let html = fs::read_to_string(page).expect("it was written");
    let (_, rows) = html.split_once("Those that differ, the largest first: ").expect("some do");
    let rows =
        rows.split("</table>").next().expect("it ends").lines().filter(|line| line.starts_with("<tr><td>"));
    let span = |words: &str| {
        let words = words.split('<').next().expect("there is a first");
        let (first, last) = words.split_once(" to ").unwrap_or((words, words));
        1 + last.parse::<u32>().expect("a block") - first.parse::<u32>().expect("a block")
    };
    let largest: Vec<u32> = rows
        .map(|row| {
            row.split(", block")
                .skip(1)
                .map(|end| span(end.trim_start_matches(['s', ' '])))
                .max()
                .expect("a rupture")
        })
        .collect();
    assert!(largest.len() > 10 && largest.is_sorted_by(|a, b| a >= b) && largest[0] > 50, "{largest:?}");

    // For several pairs, the number of pairs in which a number differs, and the pair with the largest
    // difference.
    let [before, after] = ["before", "after"].map(|name| folder.path().join(name));
    for (side, first) in [(&before, &fine), (&after, &coarse)] {
        fs::create_dir(side).expect("a folder can be made");
        for (name, log) in [("first.mcap", first), ("second.mcap", &fine)] {
            fs::copy(log, side.join(name)).expect("it can be copied");
        }
    }
    let (_, out, _) = diff(&[text(&before), text(&after), "--pair", "name"]);
    let row = out.lines().find(|line| line.contains("first_global_rupture_onset_s")).expect("a row");
    assert!(row.contains(" differs in 1 of 2 ") && row.contains(" in first: 2.63470 -> "), "{row}");
    let (code, out, _) = diff(&[text(&before), text(&before)]);
    assert!(code == 0 && out.contains("recurrence are the same in all 2 pairs\n"), "{out}");
}

/// In time, nine ruptures in ten of such runs have no counterpart.
#[test]
fn two_parameter_sets_are_paired_by_cycles_after_what_was_set_differently() {
    let folder = folder();
    let [low, high] = ["low.mcap", "high.mcap"].map(|name| folder.path().join(name));
    for (log, coefficient) in [(&low, "0.70"), (&high, "0.72")] {
        let set = format!("friction.static_coefficient={coefficient}");
        run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=3", "--set", &set], log);
    }
    let (code, out, _) = diff(&[text(&low), text(&high)]);
    assert_eq!(code, 1);
    let place = |words: &str| out.find(words).unwrap_or_else(|| panic!("no {words:?} in\n{out}"));
    let first = [
        "set differently ",
        "  friction.static_coefficient ",
        "  first_global_rupture_onset_s ",
        "  ft_fn when L_p/L >= 0.5 ",
        " two-sample Kolmogorov-Smirnov test ",
        " new ruptures: ",
    ];
    assert!(first.map(place).is_sorted(), "{out}");
    assert!(out.contains("  0.7  0.72       +0.02   +2.86 %\n"), "{out}");
    assert!(out.lines().count() <= 40, "{out}");

    let (_, report) = json(&[text(&low), text(&high)]);
    let pair = &report["runs"][0];
    let set = &pair["set_differently"];
    assert_eq!(
        (set.as_array().map(Vec::len), &set[0]["old"], &set[0]["new"]),
        (Some(1), &0.7.into(), &0.72.into())
    );
    let ruptures = &pair["ruptures"];
    assert_eq!((&ruptures["paired_by"], &pair["paired_by"]), (&"cycles".into(), &"cycles".into()));
    let count = |report: &Value, class: &str| report["counts"][class].as_u64().expect("a count");
    let [alone, all, pairs] = [
        count(ruptures, "missing") + count(ruptures, "extra"),
        ruptures["old"].as_u64().expect("a count") + ruptures["new"].as_u64().expect("a count"),
        ruptures["pairs"]["pairs"].as_u64().expect("a count"),
    ];
    assert!(3 * alone < all, "{alone} of {all} are alone");
    assert!(ruptures["matches_in_time"].as_u64() < Some(pairs / 2), "{}", ruptures["matches_in_time"]);
    assert_eq!((count(ruptures, "split"), count(ruptures, "merged")), (0, 0));
    // Global slips pair by rank.
    let is_whole = |side: &Value| side[0]["first_block"] == 1 && side[0]["last_block"] == 100;
    let matches = ruptures["matches"].as_array().expect("a list");
    let first_whole = matches.iter().find(|found| is_whole(&found["old"]) || is_whole(&found["new"]));
    let first_whole = first_whole.expect("the slider slips");
    assert!(is_whole(&first_whole["old"]) && is_whole(&first_whole["new"]), "{first_whole}");

    // With a window in time, it pairs in time; a drafted policy allows the differences that it was drafted
    // from.
    let in_time = write(folder.path(), "in-time.toml", "window_s = 1e-3\n");
    let (_, report) = json(&[text(&low), text(&high), "--policy", text(&in_time)]);
    assert_eq!(report["runs"][0]["ruptures"]["paired_by"], "time");
    let drafted = folder.path().join("drafted.toml");
    assert_eq!(diff(&[text(&low), text(&high), "--draft-policy", text(&drafted)]).0, 1);
    assert_eq!(diff(&[text(&low), text(&high), "--policy", text(&drafted)]).0, 0);
}

/// Both runs are seen before single events, which are folded where the series are chaotic.
#[test]
fn a_page_shows_both_parameter_sets_before_their_single_events() {
    let folder = folder();
    let [low, high, fine, coarse, page] = ["low.mcap", "high.mcap", "fine.mcap", "coarse.mcap", "page.html"]
        .map(|name| folder.path().join(name));
    for (log, coefficient) in [(&low, "0.70"), (&high, "0.72")] {
        let set = format!("friction.static_coefficient={coefficient}");
        run(&["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=3", "--set", &set], log);
    }
    let told = diff(&[text(&low), text(&high), "--page", text(&page)]).1;
    let html = fs::read_to_string(&page).expect("it was written");
    let both = "old: static_coefficient = 0.7, new: static_coefficient = 0.72\" src=\"data:image/";
    let shown = |title: &str| format!("<img alt=\"{title}: {both}");
    let mut rest = html.as_str();
    for words in [
        "<h2>Set differently</h2>",
        "<h2>Load and lengths of ruptures</h2>",
        &shown("Load against time"),
        &shown("Lengths of precursors"),
        "<h2>The runs in numbers</h2>",
        "<h2>Distributions</h2>",
        &shown("Distribution of ruptures by size, global slips counted separately"),
        &shown("Distribution of the times between ruptures"),
        " two-sample Kolmogorov-Smirnov test ",
        "<h2>Matched events</h2>\n<details><summary>",
        "<h2>Ruptures</h2>",
        "<p>paired by cycle between global slips",
        "<h2>Timelines</h2>",
        "<h2>Classes</h2>",
    ] {
        (_, rest) = rest.split_once(words).unwrap_or_else(|| panic!("no {words:?} in its place"));
    }

    // As many values are tested as the figure of each run has.
    let values = |kind: &[&str], log: &Path| -> String {
        let svg = folder.path().join("figure.svg");
        succeed(
            &[&["draw", text(log), "--force", "--set", "fit=none", "-o", text(&svg), "--kind"], kind]
                .concat(),
        );
        let svg = fs::read_to_string(svg).expect("it was drawn");
        let label = format!("{}: ", log.file_stem().and_then(|name| name.to_str()).expect("a name"));
        let (_, values) = svg.split_once(&label).expect("its words have the legend");
        values.chars().take_while(char::is_ascii_digit).collect()
    };
    for (quantity, kind) in [
        ("  sizes below the whole slider, blocks: ", &["sizes"][..]),
        ("  onset to onset, s: ", &["recurrence", "--set", "from_blocks=1"]),
    ] {
        let line = told.lines().find(|line| line.starts_with(quantity)).expect("it is tested");
        let tested = format!(", n = {} and {}, medians ", values(kind, &low), values(kind, &high));
        assert!(line.contains(&tested), "{line} has no {tested}");
    }

    // Not chaotic: the same few ruptures.
    for (log, step) in [(&fine, "time.step_s=1e-7"), (&coarse, "time.step_s=2e-7")] {
        run(&["ten-blocks", "--set", "time.duration_s=1.2", "--set", step], log);
    }
    diff(&[text(&fine), text(&coarse), "--page", text(&page), "--force"]);
    let html = fs::read_to_string(&page).expect("it was written");
    assert!(html.contains("<h2>Matched events</h2>\n<details open><summary>"));
    // Where no key differs that shapes the motion, single events are all that differs.
    let short = folder.path().join("short.mcap");
    run(&["ten-blocks", "--set", "time.duration_s=1.1", "--set", "time.step_s=1e-7"], &short);
    diff(&[text(&fine), text(&short), "--page", text(&page), "--force"]);
    let html = fs::read_to_string(&page).expect("it was written");
    assert!(!html.contains("<h2>Matched events</h2>") && !html.contains("<img"));
    let first = ["<h2>The runs in numbers</h2>", "<h2>Ruptures</h2>", "<h2>Timelines</h2>"];
    let places = first.map(|words| html.find(words).expect("it is there"));
    assert!(places.is_sorted());
}

#[test]
fn ruptures_that_differ_where_no_slip_event_does_are_a_difference_unless_it_is_allowed() {
    let folder = folder();
    let [usual, fast] = ["usual.mcap", "fast.mcap"].map(|name| folder.path().join(name));
    let set = ["default", "--set", "time.step_s=1e-7", "--set", "time.duration_s=1"];
    run(&set, &usual);
    run(&[&set[..], &["--set", "detection.link_time_ratio=1"]].concat(), &fast);
    let policy = folder.path().join("policy.toml");
    let (code, out, _) = diff(&[text(&usual), text(&fast), "--draft-policy", text(&policy)]);
    assert_eq!(code, 1, "{out}");
    assert!(out.contains("\n  detection.link_time_ratio "), "{out}");
    assert!(out.ends_with("\ndiffers: the ruptures do, and no slip event\n"), "{out}");
    let drafted = fs::read_to_string(&policy).expect("it was drafted");
    assert!(drafted.contains("[allow]\nruptures = true\n"), "{drafted}");
    let (code, out, _) = diff(&[text(&usual), text(&fast), "--policy", text(&policy)]);
    assert_eq!(code, 0, "{out}");
    assert!(out.ends_with("\ndiffers, as the policy allows\n"), "{out}");
    let (code, out, _) = diff(&[text(&usual), text(&usual)]);
    assert!(code == 0 && out.ends_with("\nnothing differs\n"), "{out}");
}

#[test]
fn ruptures_of_tables_are_not_compared() {
    let folder = folder();
    let table = write(folder.path(), "table.csv", TABLE);
    let (code, report) = json(&[text(&table), text(&table)]);
    let pair = &report["runs"][0];
    assert_eq!((code, &pair["summary"]), (0, &Value::Array(Vec::new())));
    assert!(pair["ruptures"].is_null() && pair["no_ruptures"].is_null(), "{pair}");
}
