//! Scripts for the schedulers of clusters: they list runs, and `asperity` makes them.
//!
//! Paths are written as [`Word`]s, which every shell reads literally; paths without such a form are
//! refused.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fmt::{self, Write};

use crate::results::ranges;
use crate::verification::Sample;

/// A literal word for sh and bash: a single-line text in single quotes. Only the single quote
/// itself is special there, and is written outside of them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Word(String);

impl Word {
    /// Quotes a path or an argument; `what` names it in errors.
    ///
    /// # Errors
    /// A message, if it is not UTF-8 or contains control characters, such as line breaks, which
    /// would end a command in a list.
    pub fn of(what: &str, text: &OsStr) -> Result<Word, String> {
        let refused = |why: &str| {
            format!("{what} {text:?} {why} (accepted: UTF-8 on one line, without control characters)")
        };
        let ends_line = |c: char| c.is_control() || matches!(c, '\u{2028}' | '\u{2029}');
        match text.to_str() {
            None => Err(refused("is not UTF-8")),
            Some(text) if text.contains(ends_line) => Err(refused("has line breaks or control characters")),
            Some(text) => Ok(Word(text.to_owned())),
        }
    }

    /// Refuses characters that a scheduler replaces before a shell sees them.
    fn without(&self, what: &str, engine: &str, replaced: &[char]) -> Result<(), String> {
        match self.0.contains(replaced) {
            false => Ok(()),
            true => {
                let replaced: String = replaced.iter().collect();
                let text = &self.0;
                Err(format!(
                    "{what} {text}: {engine} replaces parts of it (accepted: paths without any of {replaced})"
                ))
            }
        }
    }
}

impl fmt::Display for Word {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        if !self.0.is_empty() && self.0.chars().all(plain) {
            return f.write_str(&self.0);
        }
        write!(f, "'{}'", self.0.replace('\'', "'\\''"))
    }
}

/// Default number of parts: the largest Slurm array under Slurm's default limit of 1001.
pub const USUAL_TASKS: u64 = 1000;

/// Most tasks of one array, independent of the limit of a cluster: their numbers form one argument of a
/// command, which may have at most 128 KiB.
const MOST_TASKS: usize = 10_000;

/// A job array for some of the parts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Array {
    /// Offset from an index to the number of its part.
    pub offset: u64,
    /// Its indices, as in `3,7-9`.
    pub tasks: String,
}

/// The arrays that make the missing runs, if all runs are divided into this many parts and every
/// index must be below `size`.
pub fn arrays(missing: impl Iterator<Item = u64>, parts: u64, size: u64) -> Vec<Array> {
    // Run number `parts` is in the last part, as in `Job`.
    let parts: BTreeSet<u64> = missing.map(|run| (run - 1) % parts + 1).collect();
    let mut arrays: Vec<(u64, Vec<u64>)> = Vec::new();
    for part in parts {
        let offset = (part - 1) / (size - 1) * (size - 1);
        match arrays.last_mut() {
            Some((last, tasks)) if *last == offset && tasks.len() < MOST_TASKS => tasks.push(part - offset),
            _ => arrays.push((offset, vec![part - offset])),
        }
    }
    arrays.into_iter().map(|(offset, tasks)| Array { offset, tasks: ranges(tasks) }).collect()
}

/// The parameters of scripts.
#[derive(Debug, Clone)]
pub struct Job {
    /// The path of the program.
    pub program: Word,
    /// The folder of the plan.
    pub folder: Word,
    /// Number of parts of the runs.
    pub tasks: u64,
    /// Cores of a task.
    pub cores: u64,
    /// Time limit of a task, in Slurm's format.
    pub time: Word,
    /// The runs that a Slurm script verifies before it makes the tables.
    pub verify: Option<Sample>,
}

impl Job {
    /// A Slurm script that submits job arrays for the missing runs, and a job after them that makes
    /// the tables.
    ///
    /// # Errors
    /// If Slurm would replace characters in the folder's name.
    pub fn slurm(&self) -> Result<String, String> {
        let Job { program, folder, tasks, cores, time, verify } = self;
        // In file names Slurm replaces what follows a percent sign, and two of them by one, except
        // in names with a backslash.
        folder.without("the folder", "Slurm", &['\\'])?;
        // Read by two shells: this one, and that of the script which `sbatch` generates.
        let collect = Word(format!("exec {program} sweep collect {folder}"));
        let verify = verify.map_or(String::new(), |sample| format!("submit --verify {sample}\n"));
        Ok(format!(
            "#!/bin/bash\n\
             # Runs a sweep in {tasks} parts as a job array, or several where MaxArraySize asks for it, and\n\
             # makes its tables when they are over:\n\
             #     bash sweep.slurm\n\
             # Called again, it submits the parts in which runs are missing. A minute before its time limit\n\
             # a task receives SIGTERM; finished work is kept, and a long run is resumed.\n\
             set -euo pipefail\n\
             program={program}\n\
             folder={folder}\n\
             time={time}\n\
             if [[ -n ${{SLURM_ARRAY_TASK_ID:-}} ]]; then\n    \
                 part=$((${{1:-0}} + SLURM_ARRAY_TASK_ID))\n    \
                 exec \"$program\" --quiet sweep run \"$folder\" --chunk \"$part/{tasks}\" --jobs {cores} \"${{@:2}}\"\n\
             fi\n\
             size=$(scontrol show config | awk '$1 == \"MaxArraySize\" {{ print $3 }}')\n\
             output=${{folder//%/%%}}\n\
             behind=\n\
             submit() {{\n    \
                 after=${{behind:+--dependency=afterany$behind}}\n    \
                 arrays=$(\"$program\" sweep status \"$folder\" --tasks {tasks} --array-size \"${{size:-1001}}\" \"$@\") ||\n        \
                     (($? == 1 || $? == 3)) || exit\n    \
                 while read -r offset tasks; do\n        \
                     if [[ -z $tasks ]]; then continue; fi\n        \
                     id=$(sbatch --parsable $after --array=\"$tasks\" --cpus-per-task={cores} --time=\"$time\" \\\n            \
                         --signal=B:TERM@60 --job-name=asperity-sweep \\\n            \
                         --output=\"$output/slurm.txt\" --open-mode=append \"$0\" \"$offset\" \"$@\")\n        \
                     echo \"${{id%%;*}}: parts $tasks\"\n        \
                     behind+=:${{id%%;*}}\n    \
                 done <<< \"$arrays\"\n\
             }}\n\
             submit\n\
             {verify}\
             sbatch ${{behind:+--dependency=afterany$behind}} --cpus-per-task=1 --time=\"$time\" \\\n    \
                 --job-name=asperity-collect --output=\"$output/collect.txt\" \\\n    \
                 --wrap {collect}\n"
        ))
    }

    /// One command per line, for GNU parallel, HyperQueue and similar tools.
    pub fn list(&self) -> String {
        let Job { program, folder, tasks, cores, .. } = self;
        let mut text = String::new();
        for task in 1..=*tasks {
            writeln!(text, "{program} --quiet sweep run {folder} --chunk {task}/{tasks} --jobs {cores}")
                .expect("texts can be written to");
        }
        text
    }

    /// A workflow for `row`: a folder of its workspace per part.
    ///
    /// # Errors
    /// If row would replace a part of a path.
    pub fn row(&self) -> Result<String, String> {
        let Job { program, folder, tasks, cores, .. } = self;
        program.without("the program", "row", &['{', '}'])?;
        folder.without("the folder", "row", &['{', '}'])?;
        let command = format!(
            "{program} --quiet sweep run {folder} --chunk {{directory}}/{tasks} --jobs {cores} && \
             touch workspace/{{directory}}/done"
        );
        let command = toml::Value::String(command);
        Ok(format!(
            "# Put it into a folder of its own, with a folder in `workspace` for each part, called 1 to {tasks}:\n\
             #     mkdir -p workspace && (cd workspace && mkdir $(seq {tasks})) && row submit\n\
             [workspace]\n\
             path = \"workspace\"\n\n\
             [[action]]\n\
             name = \"run\"\n\
             command = {command}\n\
             products = [\"done\"]\n\
             [action.group]\n\
             maximum_size = 1\n\
             [action.resources]\n\
             processes.per_submission = 1\n\
             threads_per_process = {cores}\n"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::{Array, arrays};

    fn of(missing: impl Iterator<Item = u64>, parts: u64, size: u64) -> Vec<(u64, String)> {
        let arrays = arrays(missing, parts, size).into_iter();
        arrays.map(|Array { offset, tasks }| (offset, tasks)).collect()
    }

    #[test]
    fn indices_stay_below_the_size_of_an_array() {
        let word = |offset, tasks: &str| (offset, tasks.to_owned());
        assert_eq!(of(1..=1000, 1000, 1001), [word(0, "1-1000")]);
        assert_eq!(of(1..=1001, 1001, 1001), [word(0, "1-1000"), word(1000, "1")]);
        assert_eq!(of([2, 9, 23, 24].into_iter(), 12, 6), [word(0, "2"), word(5, "4"), word(10, "1-2")]);
        assert_eq!(of(std::iter::empty(), 12, 6), []);
        // Every second run of many: no argument becomes too long.
        let many = of((1..=400_000).step_by(2), 400_000, 4_000_001);
        assert!(many.len() == 20 && many.iter().all(|(_, tasks)| tasks.len() < 100_000));
    }

    #[test]
    fn every_missing_run_is_of_one_task() {
        for (parts, size) in [(1, 2), (7, 4), (100, 31), (100, 1001)] {
            let missing = || (1..=100_u64).filter(|run| run % 3 == 0);
            let made: Vec<u64> = arrays(missing(), parts, size)
                .iter()
                .flat_map(|Array { offset, tasks }| {
                    let tasks = crate::results::parse_ranges(tasks, size - 1).unwrap();
                    tasks.into_iter().map(move |task| offset + task)
                })
                .collect();
            let expected: std::collections::BTreeSet<u64> =
                missing().map(|run| if run % parts == 0 { parts } else { run % parts }).collect();
            assert_eq!(made, expected.into_iter().collect::<Vec<_>>(), "{parts} parts, {size}");
        }
    }
}
