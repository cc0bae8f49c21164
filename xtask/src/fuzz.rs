//! `cargo xtask fuzz`: checks properties of everything that reads a file with hundreds of thousands of
//! generated inputs.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

use crate::say::say;
use crate::workspace::{Failure, cargo, io, output, root, run, target_folder};

/// The fuzzers, in `tests/fuzz/targets`, and how long an input each is given at most.
const TARGETS: [(&str, u32); 10] = [
    ("log_bytes", 60_000),
    ("log_edits", 600),
    ("metadata", 1000),
    ("scenario", 3000),
    ("profile", 2000),
    ("plan", 4000),
    ("recording", 6000),
    ("results", 4000),
    ("pipeline", 4000),
    ("tables", 600),
];

/// Limits of an input: MB in total and at once, and seconds.
const LIMITS: [&str; 3] = ["-rss_limit_mb=1500", "-malloc_limit_mb=300", "-timeout=20"];

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  cargo xtask fuzz
  cargo xtask fuzz --for-s 3600 log_edits

Needs cargo-fuzz (`cargo install cargo-fuzz --locked`) and a C++ compiler, but
no Rust toolchain other than that of the workspace. Inputs that fail are left in
target/fuzz/found/TARGET, and those that reach most of the code in
target/fuzz/corpus/TARGET. Copy those worth keeping to fixtures/hostile, where
every test run reads them.")]
pub(crate) struct FuzzArguments {
    /// Which fuzzer [default: all, one after the other].
    #[arg(value_name = "TARGET", value_parser = TARGETS.map(|(name, _)| name))]
    target: Option<String>,
    /// How long each of them runs.
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    for_s: u32,
    /// Do not fuzz, but drop kept inputs that reach no code beyond that of the others.
    #[arg(long)]
    minimise: bool,
}

pub(crate) fn command(arguments: &FuzzArguments) -> Result<(), Failure> {
    let found = output(&mut cargo(&["fuzz", "--version"])).map_err(|_| {
        Failure::Check("cargo-fuzz is missing (accepted: `cargo install cargo-fuzz --locked`)".to_owned())
    })?;
    say!("==> {}", found.trim());
    for (target, longest) in TARGETS {
        if arguments.target.as_ref().is_none_or(|wanted| wanted == target) {
            fuzz(target, longest, arguments)?;
        }
    }
    Ok(())
}

fn fuzz(target: &str, longest: u32, arguments: &FuzzArguments) -> Result<(), Failure> {
    let work = target_folder().join("fuzz");
    let (corpus, found) = (work.join("corpus").join(target), work.join("found").join(target));
    for folder in [&corpus, &found] {
        fs::create_dir_all(folder).map_err(io("create", folder))?;
    }
    let kept: Vec<PathBuf> = ["corpus", "found"]
        .map(|folder| root().join("fixtures/hostile").join(folder).join(target))
        .into_iter()
        .filter(|folder| folder.is_dir())
        .collect();
    let mut command = cargo(&["fuzz", if arguments.minimise { "cmin" } else { "run" }]);
    command
        // Its sanitizers ask for a nightly compiler; this has the stable one do.
        .env("RUSTC_BOOTSTRAP", "1")
        .args(["--fuzz-dir", "tests/fuzz", "--target-dir"])
        .arg(work.as_path());
    command.arg(target).arg(&corpus);
    if arguments.minimise {
        return run(command.arg("--").args(LIMITS));
    }
    command.args(&kept).arg("--").args(LIMITS).arg("-len_control=0");
    command.arg(format!("-artifact_prefix={}/", found.display()));
    command.arg(format!("-max_total_time={}", arguments.for_s)).arg(format!("-max_len={longest}"));
    let dictionary = Path::new("tests/fuzz/dictionaries").join(format!("{target}.dict"));
    if root().join(&dictionary).is_file() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    say!("==> {target}, for {} s", arguments.for_s);
    run(&mut command)
}

#[cfg(test)]
mod tests {
    /// Two of them were built and never ran.
    #[test]
    fn every_target_runs() {
        let files = std::fs::read_dir(super::root().join("tests/fuzz/targets")).expect("the folder is there");
        let stem = |path: std::path::PathBuf| path.file_stem().expect("it has a name").to_owned();
        let mut found: Vec<_> = files.map(|entry| stem(entry.expect("it can be read").path())).collect();
        let mut known = super::TARGETS.map(|(name, _)| name);
        found.sort();
        known.sort_unstable();
        assert_eq!(found, known);
    }
}
