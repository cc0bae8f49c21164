//! The README, ARCHITECTURE.md, SECURITY.md and the pages of `docs/` tell the truth: their links
//! lead somewhere, their commands run and print what the page says, and they use one notation.
//!
//! How a page of `docs/` and the README is run: its blocks in order, in one temporary folder that
//! looks like the repository, with `asperity` on the `PATH`.
//!
//! - A `sh` block must succeed. `<!-- run: fails -->` before it says that it must not;
//!   `<!-- run: skip, REASON -->` that it is not run, which is for `cargo`, `git` and the like only.
//! - A `text` block is what the block before it printed, standard error included. `…` stands for
//!   anything within a line, and alone on its line for any number of lines.
//! - A `toml` block begins with a comment that names the file it is, and is written there. A command after it must use it.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use asperity_model::scenario::builtin::{self, EXPERIMENTS, Experiment};

use crate::support::binary::succeed;
use crate::support::clients::{file, said};
use crate::support::markdown::{Block, anchors, blocks, code, links, paragraphs};
use crate::support::pipelines::written_out;

/// Most lines of the README: what a visitor reads before deciding to try it.
const README_LINES: usize = 130;

/// The one Rust program of the pages.
const OWN_PROGRAM: &str = "out/own/src/main.rs";

/// What a skipped block may begin its lines with.
const NOT_RUN: [&str; 4] = ["cargo", "git", "export", "#"];

fn read(name: &str) -> String {
    fs::read_to_string(file(name)).unwrap_or_else(|error| panic!("failed to read {name}: {error}"))
}

/// The pages of `docs/`, from the root folder.
fn docs() -> Vec<String> {
    let names = fs::read_dir(file("docs")).expect("the folder is there").map(|entry| {
        let name = entry.expect("the folder can be read").file_name();
        format!("docs/{}", name.to_str().expect("pages have plain names"))
    });
    let mut names: Vec<String> = names.collect();
    names.retain(|name| name.ends_with(".md"));
    names.sort();
    names
}

/// All pages that speak to users and developers.
fn pages() -> Vec<String> {
    let others = [
        "README.md",
        "ARCHITECTURE.md",
        "SECURITY.md",
        "fixtures/clients/README.md",
        "fixtures/golden/CHANGES.md",
    ];
    others.map(str::to_owned).into_iter().chain(docs()).collect()
}

#[test]
fn every_link_leads_somewhere() {
    for name in pages() {
        let page = read(&name);
        let folder = Path::new(&name).parent().expect("a page is in a folder");
        for (line, text) in paragraphs(&page) {
            for target in links(&text).filter(|target| !target.contains("://")) {
                let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
                let linked = if path.is_empty() { file(&name) } else { file("").join(folder).join(path) };
                assert!(linked.exists(), "{name}:{line}: {target} is not there");
                if !anchor.is_empty() {
                    let linked = fs::read_to_string(&linked).expect("a page with headings can be read");
                    let known = anchors(&linked);
                    assert!(
                        known.iter().any(|known| known == anchor),
                        "{name}:{line}: no heading {target} (there are {})",
                        known.join(", ")
                    );
                }
            }
        }
    }
}

/// Paths in backquotes, from the root folder: files move, and prose stays behind.
#[test]
fn every_path_that_a_page_names_is_there() {
    const FOLDERS: [&str; 6] = ["crates/", "docs/", "fixtures/", "pipelines/", "tests/", "xtask/"];
    let mut named = 0;
    for name in pages() {
        let page = read(&name);
        for (line, text) in paragraphs(&page) {
            let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
            let paths = code(&text)
                .filter(|code| FOLDERS.iter().any(|folder| code.starts_with(folder)))
                .filter(|code| code.chars().all(plain));
            for path in paths {
                named += 1;
                assert!(file(path).exists(), "{name}:{line}: {path} is not there");
            }
        }
    }
    assert!(named > 20, "{named} paths were found");
}

#[test]
fn the_readme_is_short() {
    let lines = read("README.md").lines().count();
    assert!(lines <= README_LINES, "{lines} lines (accepted: up to {README_LINES})");
}

/// The README has the models as `asperity scenario list --for` prints them.
#[test]
fn the_readme_names_the_model_for_every_experiment() {
    let page = read("README.md");
    for Experiment { what, model, scenarios, cannot } in EXPERIMENTS {
        let row = page.lines().find(|line| line.starts_with(&format!("| {what} | [{model}](docs/")));
        let row = row.unwrap_or_else(|| panic!("{what}: {model}"));
        assert!(row.ends_with(&format!(") | `{}` | {cannot} |", scenarios.join("`, `"))), "{row}");
        assert!(scenarios.iter().all(|name| builtin::find(name).is_some()), "{scenarios:?}");
    }
}

/// The thesis' own `F_X` and `mu_k` stand where they are explained, and nowhere else.
#[test]
fn one_notation_everywhere() {
    let mut said = BTreeSet::new();
    for name in pages() {
        let page = read(&name);
        let mut heading = String::new();
        for (line, text) in paragraphs(&page) {
            if text.starts_with("## ") {
                heading.clone_from(&text);
            }
            if ["F_X", "F_{X", "mu_k", "mu_{k", "μ_k"].iter().any(|other| text.contains(other)) {
                let explained = text.contains("F_X") && text.contains("μ_k");
                let quoted = heading == "## Errata of the thesis" || explained;
                assert!(quoted, "{name}:{line}: {text} (accepted: F_T, mu_d)");
                said.insert((name.clone(), heading.clone()));
            }
        }
    }
    assert_eq!(said.len(), 3, "explained in README.md and docs/model.md, and its errata: {said:?}");
}

/// The score counts every claim of every pipeline once.
#[test]
fn the_score_of_findings_counts_every_claim() {
    let pipelines: Vec<toml::Table> = fs::read_dir(file("pipelines"))
        .expect("the folder is there")
        .map(|entry| entry.expect("it can be read").path())
        .filter(|path| path.is_file())
        .map(|path| written_out(&fs::read_to_string(path).expect("it is text")))
        .collect();
    let all = || pipelines.iter().filter_map(|pipeline| pipeline.get("claim")?.as_array()).flatten();
    let of =
        |kind: &str| all().filter(|claim| claim.get("kind").and_then(|of| of.as_str()) == Some(kind)).count();
    let (claims, selected, checks) = (all().count(), of("selection"), of("construction"));
    let page = read("docs/findings.md");
    let (_, section) = page.split_once("## How the claims come out").expect("the section is there");
    let rows = section.lines().skip_while(|line| !line.starts_with("|---")).skip(1);
    let counted: usize = rows
        .take_while(|line| line.starts_with('|'))
        .flat_map(|row| row.split('|').skip(2))
        .flat_map(|cell| cell.split([' ', ',']))
        .filter_map(|word| word.parse::<usize>().ok())
        .sum();
    let section = section.split_whitespace().collect::<Vec<_>>().join(" ");
    let others = format!("{} more test no physics: {selected} search", selected + checks);
    assert!(section.contains(&others) && section.contains(&format!("{checks} check")), "{others}");
    assert_eq!(counted + selected + checks, claims, "claims on the page (left) and in the pipelines");
}

/// A folder that looks like the repository, and whose `out` is its own.
fn copy() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    for entry in fs::read_dir(file("")).expect("the repository can be read") {
        let entry = entry.expect("the repository can be read");
        let name = entry.file_name();
        if !["out", "target", ".git"].iter().any(|left_out| name.as_os_str() == *left_out) {
            let path = entry.path().canonicalize().expect("it is there");
            std::os::unix::fs::symlink(path, folder.path().join(name)).expect("links can be made");
        }
    }
    folder
}

/// Whether this was printed; the page may leave parts out with `…`.
fn fits(page: &[&str], printed: &[&str]) -> bool {
    match (page, printed) {
        ([], []) => true,
        (["…", rest @ ..], _) => {
            fits(rest, printed) || printed.split_first().is_some_and(|(_, later)| fits(page, later))
        }
        ([line, rest @ ..], [first, later @ ..]) => line_fits(line, first) && fits(rest, later),
        _ => false,
    }
}

fn line_fits(page: &str, printed: &str) -> bool {
    let mut parts = page.trim_end().split('…');
    let Some(mut rest) = parts.next().and_then(|first| printed.trim_end().strip_prefix(first)) else {
        return false;
    };
    let mut parts = parts.peekable();
    while let Some(part) = parts.next() {
        let found = if parts.peek().is_none() {
            rest.ends_with(part).then(|| rest.len() - part.len())
        } else {
            rest.find(part)
        };
        match found {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.is_empty()
}

#[test]
fn what_is_left_out_fits_anything() {
    let fits = |page: &str, printed: &str| {
        fits(&page.lines().collect::<Vec<_>>(), &printed.lines().collect::<Vec<_>>())
    };
    assert!(fits("a 1\nb", "a 1 \nb"));
    assert!(fits("a … s\n…\nz", "a 0.5 s\nb\nc\nz") && fits("…\nz", "z"));
    assert!(!fits("a … s", "a 0.5 ms and more") && !fits("a", "a\nb") && !fits("a\nb", "a"));
    assert!(!fits("a … a", "a"));
}

/// The commands that the program says it has.
fn commands() -> BTreeSet<String> {
    let help = succeed(&["--help"]);
    let below =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    below.filter_map(|line| line.strip_prefix("  ")?.split(' ').next()).map(str::to_owned).collect()
}

/// The blocks of all pages can be run as the comment above says, and call commands that there are.
#[test]
fn every_block_can_be_run() {
    let commands = commands();
    let mut called = 0;
    for name in pages_that_run() {
        for block in blocks_that_run(&name).iter().filter(|block| block.language == "sh") {
            for line in block.text.lines().filter_map(|line| line.strip_prefix("asperity ")) {
                let command = line.split_whitespace().find(|word| !word.starts_with('-')).unwrap_or_default();
                assert!(commands.contains(command), "{name}:{}: there is no asperity {line}", block.line);
                called += 1;
            }
        }
    }
    assert!(called > 100, "{called} calls");
}

/// The blocks of a page, which are as they must be.
fn blocks_that_run(name: &str) -> Vec<Block> {
    let blocks = blocks(&read(name));
    for (index, block) in blocks.iter().enumerate() {
        let place = format!("{name}:{}", block.line);
        let first_line = |mark: &str| block.text.lines().next().and_then(|line| line.strip_prefix(mark));
        match (block.language.as_str(), note(block)) {
            ("sh", Some(note)) if note.starts_with("skip, ") => skipped(&place, &block.text),
            ("sh", note) => {
                let is_known = note.is_none_or(|note| note == "fails");
                assert!(is_known, "{place}: <!-- run: {note:?} --> (accepted: fails, skip)");
            }
            ("toml", _) => {
                let path =
                    first_line("# ").filter(|path| path.starts_with("out/") && path.ends_with(".toml"));
                let path = path.unwrap_or_else(|| {
                    panic!("{place}: the first line names no file (accepted: # out/NAME.toml)")
                });
                let used =
                    blocks[index..].iter().any(|later| later.language == "sh" && later.text.contains(path));
                assert!(used, "{place}: no command reads {path}");
            }
            ("rust", _) => assert_eq!(first_line("// "), Some(OWN_PROGRAM), "{place}: the first line"),
            // `tests/python` runs those.
            ("text" | "math" | "python", _) => {}
            (other, _) => {
                panic!("{place}: a block of {other:?} (accepted: sh, text, toml, rust, python, math)")
            }
        }
    }
    blocks
}

/// What a page says of how to run a block.
fn note(block: &Block) -> Option<&str> {
    block.before.strip_prefix("<!-- run: ").and_then(|note| note.strip_suffix(" -->"))
}

/// Runs the blocks of a page.
fn run(name: &str) {
    let folder = copy();
    fs::create_dir(folder.path().join("out")).expect("folders can be made");
    let programs: PathBuf =
        Path::new(env!("CARGO_BIN_EXE_asperity")).parent().expect("the program is in a folder").to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(programs).chain(std::env::split_paths(&path)))
        .expect("folders have plain names");

    let mut printed: Option<String> = None;
    for block in blocks_that_run(name) {
        let place = format!("{name}:{}", block.line);
        let note = note(&block);
        if note.is_some_and(|note| note.starts_with("skip, ")) {
            continue;
        }
        match block.language.as_str() {
            "sh" => {
                let output = Command::new("sh")
                    .args(["-euc", &format!("exec 2>&1\n{}", block.text)])
                    .current_dir(folder.path())
                    .env("PATH", &path)
                    .env("COLUMNS", "100")
                    .output()
                    .expect("the shell starts");
                assert_eq!(output.status.success(), note != Some("fails"), "{place}: {}", said(&output));
                printed = Some(String::from_utf8(output.stdout).expect("it prints UTF-8"));
            }
            "text" => {
                let printed = printed.take().unwrap_or_else(|| panic!("{place}: nothing ran before this"));
                let (page, printed): (&str, &str) = (block.text.trim_end(), printed.trim_end());
                assert!(
                    fits(&page.lines().collect::<Vec<_>>(), &printed.lines().collect::<Vec<_>>()),
                    "{place}: the page says\n{page}\nbut what is printed is\n{printed}"
                );
            }
            "toml" => {
                let (first, _) = block.text.split_once('\n').expect("it has lines");
                write_if_other(&folder.path().join(first.trim_start_matches("# ")), &block.text);
            }
            _ => {}
        }
    }
}

/// What is not run may be of other programs only, and what it asks of `cargo xtask` must be there.
fn skipped(place: &str, commands: &str) {
    let xtask: Vec<String> = fs::read_dir(file("xtask/src"))
        .expect("the folder is there")
        .map(|entry| fs::read_to_string(entry.expect("it can be read").path()).expect("it is text"))
        .collect();
    let declared = |text: &str| xtask.iter().any(|source| source.contains(text));
    for line in commands.lines().filter(|line| !line.is_empty()) {
        let command = line.split(" #").next().unwrap_or(line);
        let mut words = command.split_whitespace();
        let program = words.next().expect("a command has words");
        assert!(NOT_RUN.contains(&program), "{place}: {line} is skipped (accepted: {})", NOT_RUN.join(", "));
        if (program, words.next()) != ("cargo", Some("xtask")) {
            continue;
        }
        let name = words.next().unwrap_or_else(|| panic!("{place}: {line} names no command"));
        let mut variant: String = name.split('-').map(capitalised).collect();
        variant.push('(');
        assert!(
            declared(&variant) || declared(&format!("name = {name:?}")),
            "{place}: cargo xtask has no {name}"
        );
        for option in words.filter_map(|word| word.strip_prefix("--")) {
            let field = format!("{}:", option.replace('-', "_"));
            assert!(declared(&field), "{place}: cargo xtask {name} has no --{option}");
        }
    }
}

fn capitalised(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase()).into_iter().chain(letters).collect()
}

/// Those that a visitor follows; the others take longer.
const FIRST_PAGES: [&str; 2] = ["README.md", "docs/tutorial.md"];

/// All pages with blocks.
fn pages_that_run() -> Vec<String> {
    docs().into_iter().chain(["README.md".to_owned()]).collect()
}

#[test]
fn the_readme_runs() {
    run(FIRST_PAGES[0]);
}

#[test]
fn the_tutorial_runs() {
    run(FIRST_PAGES[1]);
}

mod in_ci {
    use super::{FIRST_PAGES, pages_that_run, run};

    #[test]
    #[ignore = "half a minute of commands: cargo xtask ci"]
    fn all_other_pages_run() {
        let mut pages = pages_that_run();
        // The commands of the gallery are run where its pictures are compared.
        pages.retain(|page| !FIRST_PAGES.contains(&page.as_str()) && page != crate::gallery::PAGE);
        assert!(pages.len() > 12, "{pages:?}");
        crate::first_day::each(&pages, |page| run(page));
    }
}

/// The program of `docs/extending.md` builds outside the workspace and prints what the page says.
///
/// It stands where the page puts it, but in a folder that stays from one test run to the next, and
/// is built into the target folder of the workspace with the workspace's profile, so that
/// dependencies that are compiled already are used again.
#[test]
#[ignore = "a minute of compiling: cargo xtask nightly"]
fn own_program_builds() {
    let page = read("docs/extending.md");
    let blocks = blocks(&page);
    let text = |start: &str| {
        let block = blocks.iter().find(|block| block.text.starts_with(start));
        block.unwrap_or_else(|| panic!("no block begins with {start}")).text.clone()
    };
    let program = text("// out/own/src/main.rs");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own");
    let root = file("").canonicalize().expect("the repository is there");
    let crates = root.join("crates").to_str().expect("the repository has a plain path").to_owned();
    let workspace: toml::Table = read("Cargo.toml").parse().expect("a manifest is TOML");
    let profile =
        toml::to_string(&toml::Table::from_iter([("profile".to_owned(), workspace["profile"].clone())]));
    let manifest =
        text("# out/own/Cargo.toml").replace("../../crates", &crates) + &profile.expect("a table is TOML");
    write_if_other(&folder.join("Cargo.toml"), &manifest);
    write_if_other(&folder.join("src/main.rs"), &program);
    // The versions that the workspace has.
    write_if_other(&folder.join("Cargo.lock"), &read("Cargo.lock"));

    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("it is in the target folder");
    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--offline"])
        .current_dir(&folder)
        .env("CARGO_TARGET_DIR", target)
        .output()
        .expect("cargo starts");
    assert!(output.status.success(), "{}", said(&output));
    let printed = String::from_utf8(output.stdout).expect("it prints UTF-8");
    let expected =
        blocks.iter().skip_while(|block| block.language != "rust").find(|block| block.language == "text");
    let expected = expected.expect("the page says what the program prints");
    assert_eq!(printed, expected.text, "what the program prints (left)");
}

/// The tests compile that example.
#[test]
fn own_program_is_the_example() {
    let blocks = blocks(&read("docs/extending.md"));
    let program = blocks.iter().find(|block| block.text.starts_with("// out/own/src/main.rs"));
    let (_, body) = program.and_then(|block| block.text.split_once('\n')).expect("the page has it");
    assert!(
        read("crates/run/examples/first_global_slip.rs").ends_with(body),
        "crates/run/examples/first_global_slip.rs is another program than the page's"
    );
}

/// A file that is as it should be keeps its time, and what was made of it stays fresh.
fn write_if_other(path: &Path, text: &str) {
    if fs::read_to_string(path).is_ok_and(|there| there == text) {
        return;
    }
    fs::create_dir_all(path.parent().expect("a file is in a folder")).expect("folders can be made");
    fs::write(path, text).expect("files can be written");
}
