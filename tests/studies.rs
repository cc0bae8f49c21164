//! Damaged and malicious plans and segments: tables contain the results of the runs of the plan, or are not
//! made, within bounds of memory, and never with a panic.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use asperity_study::Plan;

use crate::hostile::bounded;
use crate::laws::frames::{Frame, Segment, body, sealed};
use crate::support::binary::{outcome, succeed, text};
use crate::sweep::{SHORT, Study, sweep, tables};

/// Segments by their names.
type Files<'a> = Vec<(&'a str, Vec<u8>)>;

/// A study whose runs are made, taken apart.
struct Made {
    study: Study,
    plan: String,
    /// The results of all runs, in their order.
    all: Segment,
    tables: std::collections::BTreeMap<String, Vec<u8>>,
}

impl Made {
    fn new() -> Made {
        let study = Study::of(SHORT);
        let out = study.plan("made");
        succeed(&["sweep", "run", text(&out)]);
        let plan = fs::read_to_string(out.join("plan.ndjson")).expect("there is a plan");
        let mut segments = segments(&out);
        let mut all = segments.pop().expect("there is a segment");
        all.frames.extend(segments.into_iter().flat_map(|segment| segment.frames));
        all.frames.sort_by_key(|frame| frame.run);
        assert_eq!(all.frames.len(), 6);
        let tables = tables(&out);
        Made { study, plan, all, tables }
    }

    /// A study of this plan and these segments.
    fn with(&self, plan: &str, segments: &[(&str, Vec<u8>)]) -> PathBuf {
        let folder = self.study.path("forged");
        fs::remove_dir_all(&folder).ok();
        fs::create_dir_all(folder.join("segments")).expect("the folder can be written");
        fs::write(folder.join("plan.ndjson"), plan).expect("the folder can be written");
        for (name, bytes) in segments {
            fs::write(folder.join("segments").join(name), bytes).expect("the folder can be written");
        }
        folder
    }

    /// The results, with one of them changed.
    fn changed(&self, change: impl FnOnce(&mut Vec<Frame>)) -> Segment {
        let mut all = self.all.clone();
        change(&mut all.frames);
        all
    }

    /// The results, with other text in that of run 4.
    fn retold(&self, change: impl FnOnce(String) -> String) -> Segment {
        self.changed(|frames| frames[3] = Frame::done(4, change(frames[3].text()).as_bytes()))
    }
}

fn segments(study: &Path) -> Vec<Segment> {
    let entries = fs::read_dir(study.join("segments")).expect("there are segments");
    let read = |path: PathBuf| Segment::read(&fs::read(path).expect("it can be read"));
    entries.map(|entry| read(entry.expect("the folder can be read").path())).collect()
}

/// The line of a text, from 0, with something else in it.
fn with_line(text: &str, line: usize, change: impl FnOnce(&str) -> String) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    lines[line] = change(&lines[line]);
    lines.join("\n") + "\n"
}

/// Formerly the first of two results of a run was used, and a result was identified by its number only:
/// tables of a faulty node were made with exit code 0.
#[test]
fn results_that_contradict_the_plan_or_each_other_make_no_tables() {
    let made = Made::new();
    let of_5 = &made.all.frames[4];
    let edited = |from: &str, to: &str| {
        let (from, to) = (from.to_owned(), to.to_owned());
        move |text: String| {
            assert!(text.contains(&from), "{from}");
            text.replacen(&from, &to, 1)
        }
    };
    let other = |segment: Segment| vec![("a.seg", made.all.bytes()), ("b.seg", segment.bytes())];
    let one = |segment: Segment| vec![("a.seg", segment.bytes())];
    // The contents of the segments, whether they are detected without unpacking, and the message.
    let cases: Vec<(Files<'_>, bool, &str)> = vec![
        (
            one(made.changed(|frames| frames[3].content.clone_from(&of_5.content))),
            false,
            "a.seg: byte |run 4: it is of run 5 of id |(accepted: run 4 of id ",
        ),
        (
            one(made.retold(edited("\"id\":\"", "\"id\":\"x"))),
            false,
            "a.seg: byte |run 4: it is of run 4 of id x",
        ),
        (
            other(made.retold(edited("\"friction_heat_j\":0.0001", "\"friction_heat_j\":0.0002"))),
            true,
            "run 4 has two results that differ: summary.friction_heat_j is 0.0001|and 0.0002|a.seg: byte |b.seg: byte ",
        ),
        (
            other(made.retold(edited("\"max_sliding\":1,", "\"max_sliding\":2,"))),
            true,
            "two results that differ: slips[0].max_sliding is 1 and 2",
        ),
        (
            other(made.changed(|frames| {
                let text = frames[3].text();
                let (before, _) = text.split_once("{\"Ok\"").expect("it is done");
                frames[3] = Frame::done(4, format!("{before}{{\"Err\":\"out of order\"}}}}").as_bytes());
                frames[3].kind = 0;
            })),
            true,
            "run 4 has two results that differ: it is done, and it failed",
        ),
        (one(made.changed(|frames| frames[3].kind = 0)), false, "run 4: its frame and its content disagree"),
        (one(made.retold(edited("\"onset_s\":", "\"outset_s\":"))), false, "run 4: missing field `onset_s`"),
        (
            one(made.retold(edited("\"event\":1,", "\"event\":2,"))),
            false,
            "run 4: its events are not those that its summary counts",
        ),
        (one(made.retold(|text| text + "{}")), false, "run 4: trailing characters"),
        (one(made.changed(|frames| frames[3].content = vec![0xff; 9])), false, "run 4: a result of "),
    ];
    for (segments, at_once, says) in cases {
        let study = made.with(&made.plan, &segments);
        let study = text(&study);
        let said_all = |said: &str| says.split('|').all(|part| said.contains(part));
        let (code, out, err) = sweep(&["collect", study, "--to", "csv"]);
        assert!(code == 1 && said_all(&err), "{says}: {code} {err}");
        assert!(err.contains("remove the file"), "{err}");
        assert!(out.is_empty() && !Path::new(study).join("tables/runs.csv").exists(), "{says}: {out}");
        let (code, out, _) = sweep(&["status", study]);
        assert_eq!(code == 1 && said_all(&out), at_once, "{says}: {code} {out}");
        let (code, _, err) = sweep(&["run", study]);
        assert_eq!(code == 1 && said_all(&err), at_once, "{says}: {code} {err}");
        let page = made.study.path("page.html");
        let (code, _, err) = outcome(&["report", study, "--out", text(&page)]);
        assert!(code == 1 && said_all(&err) && !page.exists(), "{says}: {err}");
        // The recommended remedy works.
        for (name, _) in &segments {
            fs::remove_file(Path::new(study).join("segments").join(name)).expect("it is there");
        }
    }
    // What stands for a run that the plan does not have, and all behind it, is left out like a cut frame.
    for run in [0, 7, u64::MAX] {
        let strange = made.changed(|frames| frames[3].run = run);
        let study = made.with(&made.plan, &one(strange));
        let (code, out, _) = sweep(&["status", text(&study)]);
        assert!(code == 3 && out.contains("missing: 4-6") && out.contains("incomplete"), "{code} {out}");
    }
    let study = made.with(&made.plan, &[]);
    succeed(&["sweep", "run", text(&study)]);
    assert!(tables(&study) == made.tables, "other tables");
}

/// Two equal results of a run count as one, in one segment or in two, and however they are packed.
#[test]
fn equal_results_of_a_run_are_one() {
    let made = Made::new();
    let twice = made.changed(|frames| frames.extend(frames.clone()));
    let packed = made.changed(|frames| {
        for frame in frames {
            frame.content = zstd::bulk::compress(frame.text().as_bytes(), 19).expect("it compresses");
        }
    });
    let study = made.with(&made.plan, &[("a.seg", twice.bytes()), ("b.seg", packed.bytes())]);
    assert_eq!(sweep(&["status", text(&study)]), (0, "6 of 6 runs done\n".to_owned(), String::new()));
    assert!(tables(&study) == made.tables, "other tables");
}

/// A run of number 0 or 2^64 - 1, a text for a number, and too few values made commands panic; the file
/// of a figure was written outside of the study.
#[test]
fn plans_of_what_no_plan_has_are_refused_by_line_and_key() {
    let made = Made::new();
    let lines = body(&made.plan);
    let figure = "\"figures\":[{\"kind\":{\"family\":{\"joined\":true,\"theory\":false}},\"file\":\"../a.png\",\
                  \"title\":\"\",\"x\":{\"column\":\"normal_load.tilt\",\"label\":\"x\",\"log\":false,\
                  \"is_word\":false},\"y\":{\"column\":\"precursor_count\",\"label\":\"y\",\"log\":false,\
                  \"is_word\":false},\"colour\":null,\"facet\":null,\"is_spread\":false,\"at\":[]}]";
    let third = |from: &str, to: &str| {
        let (from, to) = (from.to_owned(), to.to_owned());
        with_line(lines, 3, move |line| {
            assert!(line.contains(&from), "{from}: {line}");
            line.replacen(&from, &to, 1)
        })
    };
    let first = |from: &str, to: &str| {
        assert!(lines.contains(from), "{from}");
        lines.replacen(from, to, 1)
    };
    let named = |names: &[&str]| {
        let run =
            |name: &&str| format!("{{\"name\":\"{name}\",\"scenario\":\"default\",\"scenario_toml\":\"\"}}");
        format!("\"runs\":[{}],\"code_version\"", names.iter().map(run).collect::<Vec<_>>().join(","))
    };
    let values = "[0.0,0.5,0.3]";
    for (body, says) in [
        (third("\"run\":3", "\"run\":0"), "line 4: run = 0 (accepted: 3"),
        (
            third("\"run\":3", "\"run\":18446744073709551615"),
            "line 4: run = 18446744073709551615 (accepted: 3",
        ),
        (third("\"run\":3", "\"run\":2"), "line 4: run = 2 (accepted: 3"),
        (third("\"run\":3", "\"run\":-3"), "line 4: column "),
        (third(values, "[\"nan\",0.5,0.3]"), "line 4: normal_load.tilt: \"nan\" is not accepted (accepted: "),
        (
            third(values, "[2,0.5,0.3]"),
            "line 4: normal_load.tilt: 2 is not accepted (accepted: a number from -1 to 1)",
        ),
        (third(values, "[1e999,0.5,0.3]"), "line 4: column "),
        (third(values, "[null,0.5,0.3]"), "line 4: normal_load.tilt: null is not accepted (accepted: "),
        (third(values, "[0.5,0.3]"), "line 4: values: 2 of them (accepted: 3, of normal_load.tilt, "),
        (third(values, "[]"), "line 4: values: 0 of them (accepted: 3"),
        (third("\"id\"", "\"refused\":\"\",\"id\""), "line 4: it has both id and refused"),
        (first("normal_load.tilt", "normal_load.tolt"), "line 1: keys: normal_load.tolt: unknown key"),
        (
            first("\"code_version\"", &format!("{figure},\"code_version\"")),
            "line 1: figure.family \"../a.png\": file",
        ),
        (first("\"code_version\"", &named(&["../a"])), "line 1: run name \"../a\" is no file name"),
        (first("\"code_version\"", &named(&["a"])), "line 7: values: 3 of them (accepted: 0"),
        (first("\"code_version\"", &named(&["a"; 7])), "6 runs (accepted: 7 or more)"),
    ] {
        let plan = sealed(body.trim_end());
        let study = made.with(&plan, &[("a.seg", made.all.of_plan(&plan).bytes())]);
        let study = text(&study);
        for arguments in [
            &["status", study][..],
            &["collect", study, "--to", "csv"],
            &["run", study],
            &["emit", "list", study],
        ] {
            let (code, _, err) = sweep(arguments);
            assert!(
                code == 2 && err.contains("plan.ndjson: ") && err.contains(says),
                "{arguments:?}, {says}: {err}"
            );
            assert!(err.contains("(accepted: "), "{err}");
        }
        assert!(!Path::new(study).join("tables").exists());
    }
    // One more is counted at its end.
    let counted = made.plan.replace("{\"rows\":6,", "{\"rows\":7,");
    let study = made.with(&counted, &[]);
    let (code, _, err) = sweep(&["status", text(&study)]);
    assert!(code == 2 && err.contains("it was changed after it was written"), "{err}");
    // Put together again without a change it is the plan.
    assert_eq!(sealed(lines), made.plan);
}

#[test]
fn every_flipped_bit_and_every_cut_of_a_plan_is_seen() {
    let study = Study::of(SHORT);
    let plan = fs::read(study.plan("planned").join("plan.ndjson")).expect("there is a plan");
    Plan::parse(&plan[..]).expect("it is sound");
    for at in 0..plan.len() {
        assert!(Plan::parse(&plan[..at]).is_err(), "cut at {at}");
        for bit in 0..8 {
            let mut flipped = plan.clone();
            flipped[at] ^= 1 << bit;
            assert!(Plan::parse(&flipped[..]).is_err(), "bit {bit} of byte {at}");
        }
    }
}

/// Data of another version may mean anything, so it is refused by its version.
#[test]
fn plans_and_segments_of_another_version_are_refused_by_name() {
    let made = Made::new();
    let plan = sealed(&body(&made.plan).replacen("\"format\":2", "\"format\":3,\"new\":[]", 1));
    let mut segment = made.all.clone();
    segment.first_line[23] = b'2';
    for (plan, name, [found, reads]) in [(&plan, "plan.ndjson", [3, 2]), (&made.plan, "a.seg", [2, 3])] {
        let study = made.with(plan, &[("a.seg", segment.bytes())]);
        for command in ["status", "collect", "run"] {
            let (code, out, err) = sweep(&[command, text(&study)]);
            let said =
                format!("written with version {found} of the format; this program reads version {reads}");
            assert!(
                code != 0 && out.is_empty() && err.contains(name) && err.contains(&said),
                "{command}: {err}"
            );
        }
    }
}

/// 131 kB that unpack to four gigabytes took `collect` to 4.2 GB.
#[test]
fn studies_are_read_in_bounds_whatever_they_unpack_to() {
    let made = Made::new();
    let bomb = |filling: u8| {
        use std::io::Write;
        let mut encoder = zstd::stream::write::Encoder::new(Vec::new(), 1).expect("it can be made");
        let text = vec![filling; 1 << 22];
        (0..1024).for_each(|_| encoder.write_all(&text).expect("it is written to memory"));
        encoder.finish().expect("it is written to memory")
    };
    let zeros = bomb(0);
    assert!(zeros.len() < 1_000_000);
    let with = |content: &[u8]| made.changed(|frames| frames[3].content = content.to_vec()).bytes();
    let mut long_head = with(&zeros);
    // The length of the first frame is that of four gigabytes.
    let first = made.all.first_line.len();
    long_head[first + 13..first + 17].fill(0xff);
    let long = "x".repeat(60_000_000);
    let rows =
        format!("{}\n{}", body(&made.plan).lines().next().expect("it has lines"), "[".repeat(10_000_000));
    for (plan, segment, says) in [
        (made.plan.clone(), with(&zeros), "a result of "),
        (made.plan.clone(), with(&bomb(b'\n')), "a result of "),
        (made.plan.clone(), long_head, ""),
        (long, made.all.bytes(), "it was changed after it was written"),
        (sealed(&rows), made.all.bytes(), "line 2: column 1: invalid type"),
        (sealed(&"[".repeat(10_000_000)), made.all.bytes(), "line 1: "),
    ] {
        let study = made.with(&plan, &[("a.seg", segment)]);
        for arguments in [&["sweep", "status"][..], &["sweep", "collect", "--to", "csv"], &["sweep", "run"]] {
            if arguments[1] == "run" && says.is_empty() {
                continue;
            }
            let outcome = bounded(&made.study.path(""), &[arguments, &[text(&study)]].concat());
            assert!(matches!(outcome.code, Some(0..=3)), "{arguments:?}: {:?} {}", outcome.code, outcome.err);
            assert!(!outcome.err.contains("panicked"), "{arguments:?}: {}", outcome.err);
            if arguments[1] == "collect" {
                assert!(outcome.code != Some(0) && outcome.err.contains(says), "{says}: {}", outcome.err);
            }
        }
    }
    #[cfg(target_os = "linux")]
    for name in ["plan.ndjson", "segments/endless.seg"] {
        let study = made.with(&made.plan, &[("a.seg", made.all.bytes())]);
        fs::remove_file(study.join(name)).ok();
        std::os::unix::fs::symlink("/dev/zero", study.join(name)).expect("the folder can be written");
        let outcome = bounded(&made.study.path(""), &["sweep", "status", text(&study)]);
        let is_named = outcome.err.contains(name) && outcome.err.contains("it is a device");
        assert!(matches!(outcome.code, Some(1 | 2)) && is_named, "{:?} {}", outcome.code, outcome.err);
    }
}

/// A segment for each thread of a large cluster is more than a process may have open.
#[test]
fn there_may_be_more_segments_than_open_files() {
    let made = Made::new();
    let names: Vec<String> = (0..60).map(|number| format!("{number}.seg")).collect();
    let one = |number: usize| made.changed(|frames| *frames = vec![frames[number % 6].clone()]).bytes();
    let segments: Vec<(&str, Vec<u8>)> =
        names.iter().enumerate().map(|(number, name)| (name.as_str(), one(number))).collect();
    let study = made.with(&made.plan, &segments);
    let status = Command::new("sh")
        .args([
            "-c",
            "ulimit -n 40; exec \"$0\" sweep status \"$1\"",
            env!("CARGO_BIN_EXE_asperity"),
            text(&study),
        ])
        .output()
        .expect("sh starts");
    assert!(status.status.success(), "{}", String::from_utf8_lossy(&status.stderr));
}
