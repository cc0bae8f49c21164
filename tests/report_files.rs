//! Files of `asperity report`: it overwrites no file that it reads or links to, and shows only files of the
//! given folder, whatever its source.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::binary::{ends, run, succeed, text};

/// A pipeline with a figure and a claim, and a sweep with a figure, each in a folder with its page.
fn studies(folder: &Path) -> [PathBuf; 2] {
    let path = |name: &str| folder.join(name);
    let set = "scenario = \"ten-blocks\"\nset = [\"parameter_set=as-coded\", \"time.step_s=1e-6\", \"time.duration_s=0.5\"]\n";
    let pipeline = format!(
        "title = \"One\"\n[[run]]\nname = \"a\"\n{set}\
         [[figure.load]]\nfile = \"load.png\"\nrun = \"a\"\nsliding = true\n\
         [[claim]]\nabout = \"section 1\"\nof = \"this project\"\nquote = \"it slips\"\nrun = \"a\"\n\
         measure = \"largest_ft_fn\"\nat_most = 10\n"
    );
    fs::write(path("one.toml"), pipeline).expect("the folder can be written");
    let sweep = format!(
        "title = \"Tilts\"\n{set}[[axis]]\nkey = \"normal_load.tilt\"\nvalues = [0, 0.5]\n\
         [[figure.family]]\nfile = \"counts.png\"\nx = \"normal_load.tilt\"\ny = \"precursor_count\"\n"
    );
    fs::write(path("tilts.toml"), sweep).expect("the folder can be written");
    let (one, tilts) = (path("one"), path("tilts"));
    succeed(&["reproduce", text(&path("one.toml")), "--out", text(&one), "--quiet"]);
    succeed(&["sweep", "plan", text(&path("tilts.toml")), "-o", text(&tilts)]);
    succeed(&["sweep", "run", text(&tilts), "--quiet"]);
    succeed(&["sweep", "collect", text(&tilts), "--quiet"]);
    [one, tilts]
}

/// The files of a folder and of those in it, by path.
fn files_in(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the folder is there") {
        let path = entry.expect("it can be read").path();
        if path.is_dir() {
            files.extend(files_in(&path));
        } else {
            files.insert(path.clone(), fs::read(path).expect("the file can be read"));
        }
    }
    files
}

#[test]
fn nothing_is_written_over_what_a_page_is_made_of() {
    let folder = asperity_testkit::folder();
    let studies = studies(folder.path());
    let [one, tilts] = studies.each_ref().map(|study| text(study));
    let mut tried = 0;
    for study in &studies {
        for (path, before) in files_in(study) {
            // The page itself is replaced, PDF is no part of it, and a worker's lock has no owner.
            let end = path.extension().unwrap_or_default().to_string_lossy().into_owned();
            if path.ends_with("report.html")
                || !["svg", "png", "csv", "json", "ndjson", "seg", "mcap"].contains(&end.as_str())
            {
                continue;
            }
            // An index leads to the reports and not to logs.
            let own: &[&str] = &[text(study)];
            let all: &[&str] = if end == "mcap" { own } else { &[one, tilts] };
            for of in [own, all] {
                let report = [&["report"], of, &["--out", text(&path), "--force"]].concat();
                ends(2, &report, &["(accepted: another file)"]);
                assert!(fs::read(&path).expect("it is there") == before, "{} has changed", path.display());
                tried += 1;
            }
        }
    }
    assert!(tried > 20, "{tried} files");
    for study in [one, tilts] {
        let page = Path::new(study).join("report.html");
        succeed(&["report", study, "--out", text(&page), "--force"]);
    }
}

#[test]
fn a_folder_of_somebody_else_shows_its_own_files_alone() {
    let folder = asperity_testkit::folder();
    let [one, _] = studies(folder.path());
    let (record, page) = (one.join("reproduce.json"), folder.path().join("page.html"));
    let sound = fs::read_to_string(&record).expect("the record is there");
    let secret = folder.path().join("secret.txt");
    fs::write(&secret, "nobody's business").expect("the folder can be written");
    let refused = |what: &str, from: &str, to: &str| {
        let forged = sound.replace(from, to);
        assert_ne!(forged, sound, "{from} is in the record");
        fs::write(&record, forged).expect("the folder can be written");
        for of in [&[text(&one)][..], &[text(&one), text(&one)]] {
            ends(2, &[&["report"], of, &["--out", text(&page)]].concat(), &["reproduce.json: ", what]);
            assert!(!page.exists());
        }
    };
    let accepted = "(accepted: figures/NAME.png";
    let figure = "\"file\": \"figures/load.png\"";
    refused(accepted, figure, &format!("\"file\": \"{}\"", text(&secret)));
    refused(accepted, figure, "\"file\": \"../secret.png\"");
    refused(accepted, figure, "\"file\": \"javascript:document.title=1//x.png\"");
    refused("(accepted: letters, digits", "\"name\": \"a\"", "\"name\": \"../../a\"");
    refused("(accepted: a path from the folder on", "\"tables/claims.csv\"", "\"tables/../../claims.csv\"");
    fs::write(&record, &sound).expect("the folder can be written");

    // Nor does it through a link that has the name of a picture.
    #[cfg(unix)]
    for name in ["figures/load.svg", "figures/load.png"] {
        fs::remove_file(one.join(name)).expect("the picture is there");
        std::os::unix::fs::symlink(&secret, one.join(name)).expect("the folder can be written");
    }
    succeed(&["report", text(&one), "--out", text(&page)]);
    let html = fs::read_to_string(&page).expect("the page is there");
    assert!(html.contains("This figure is not there.") && !html.contains("data:image/"), "{html}");
}

#[test]
fn what_is_not_there_is_said_of_the_path_that_is_not() {
    let folder = asperity_testkit::folder();
    let path = |name: &str| folder.path().join(name);
    let log = path("one.mcap");
    run(&["ten-blocks", "--set", "time.step_s=1e-6", "--set", "time.duration_s=0.1"], &log);
    let said = |of: &[&Path]| {
        let of: Vec<&str> = of.iter().map(|path| text(path)).collect();
        ends(2, &[&["report"], &of[..], &["--out", text(&path("page.html"))]].concat(), &[])
    };
    let (gone, there) = (path("gone"), path("there"));
    fs::create_dir(&there).expect("the folder can be written");
    fs::write(there.join("reproduce.json"), "{}").expect("the folder can be written");
    let words = said(&[&gone, &there]);
    assert!(words.contains("gone: ") && words.contains("(accepted: run logs; or folders of"), "{words}");
    assert!(!words.contains("others are not"), "{words}");
    let words = said(&[&log, &log]);
    assert!(words.contains("one.mcap is given twice (accepted: each run log once)"), "{words}");
}
