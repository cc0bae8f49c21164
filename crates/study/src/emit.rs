//! Scripts for the schedulers of clusters: they list runs, and `asperity` makes them.
//!
//! Paths are written as [`Word`]s, which every shell reads literally; paths without such a form are
//! refused.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsStr;
use std::fmt::{self, Write};

use crate::results::{parse_ranges, ranges};
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
    /// The numbers of its parts, likewise.
    pub parts: String,
}

/// The arrays that make the missing runs, if all runs are divided into this many parts and every
/// index must be below `size`.
pub fn arrays(missing: impl Iterator<Item = u64>, parts: u64, size: u64) -> Vec<Array> {
    let parts: BTreeSet<u64> = missing.map(|run| part(run, parts)).collect();
    let mut arrays: Vec<(u64, Vec<u64>)> = Vec::new();
    for part in parts {
        let offset = (part - 1) / (size - 1) * (size - 1);
        match arrays.last_mut() {
            Some((last, tasks)) if *last == offset && tasks.len() < MOST_TASKS => tasks.push(part - offset),
            _ => arrays.push((offset, vec![part - offset])),
        }
    }
    let array = |(offset, tasks): (u64, Vec<u64>)| {
        let parts = ranges(tasks.iter().map(|task| offset + task));
        Array { offset, tasks: ranges(tasks), parts }
    };
    arrays.into_iter().map(array).collect()
}

/// Parts that jobs of an earlier call of a script make, by the number of parts.
#[derive(Debug, Clone, Default)]
pub struct UnderWay(BTreeMap<u64, BTreeSet<u64>>);

impl UnderWay {
    /// Reads lines of parts of a number of parts, as in `3,7-9/12`, which is at most that of the runs.
    ///
    /// # Errors
    /// A message with the line.
    pub fn read(text: &str, runs: u64) -> Result<UnderWay, String> {
        let mut under_way = UnderWay::default();
        for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.is_empty()) {
            let number = index + 1;
            let (parts, of) = line.split_once('/').unwrap_or((line, ""));
            let accepted =
                || format!("line {number}: {line} (accepted: parts of 1 to {runs}, as in 3,7-9/12)");
            let of = of.parse().ok().filter(|of| (1..=runs).contains(of)).ok_or_else(accepted)?;
            let parts = parse_ranges(parts, of).map_err(|error| format!("line {number}: {error}"))?;
            under_way.0.entry(of).or_default().extend(parts);
        }
        Ok(under_way)
    }

    /// Whether a run is in one of them; `number` is what divides runs into a number of parts.
    pub fn has(&self, number: impl Fn(u64) -> u64) -> bool {
        self.0.iter().any(|(of, parts)| parts.contains(&part(number(*of), *of)))
    }
}

/// The part of a run: run number `parts` is in the last, as in [`Job`].
fn part(run: u64, parts: u64) -> u64 {
    (run - 1) % parts + 1
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
    /// Most tasks of a Slurm array that run at once, if there is a limit.
    pub at_once: Option<u64>,
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
        let Job { program, folder, tasks, cores, time, at_once, verify } = self;
        // In file names Slurm replaces what follows a percent sign, and two of them by one, except
        // in names with a backslash.
        folder.without("the folder", "Slurm", &['\\'])?;
        // Read by two shells: this one, and that of the script which `sbatch` generates.
        let collect = Word(format!("exec {program} sweep collect {folder}"));
        let verify = verify.map_or(String::new(), |sample| {
            format!("if [[ -z $left ]]; then submit --verify --verify {sample}; fi\n")
        });
        let at_once = at_once.map_or(String::new(), |most| format!("%{most}"));
        Ok(format!(
            r#"#!/bin/bash
# Runs a sweep in {tasks} parts as a job array, or several where MaxArraySize asks for it, and
# makes its tables when they are over:
#     bash sweep.slurm
# Called again, it submits the parts in which runs are missing, without those that wait or run. A
# minute before its time limit a task receives SIGTERM; finished work is kept, and a long run is resumed.
set -euo pipefail
program={program}
folder={folder}
time={time}
collect={collect}
if [[ -n ${{SLURM_ARRAY_TASK_ID:-}} ]]; then
    part=$((${{1:-0}} + SLURM_ARRAY_TASK_ID))
    exec "$program" --quiet sweep run "$folder" --chunk "$part/{tasks}" --jobs {cores} "${{@:2}}"
fi
size=$(scontrol show config | awk '$1 == "MaxArraySize" {{ print $3 }}') || size=
if [[ ! $size =~ ^[1-9][0-9]*$ ]]; then
    size=1001
    echo "scontrol does not tell MaxArraySize; it is taken as $size" >&2
fi
output=${{folder//%/%%}}
behind=
left=
# Job, and parts, of each accepted array or task that is not over; lines of $accepted are JOB OFFSET PARTS TASKS.
under_way() {{
    if [[ ! -s $accepted ]]; then return; fi
    if queue=$(squeue -h -r -u "$(id -un)" -n asperity-sweep -t PENDING,RUNNING,SUSPENDED -o '%F %K'); then
        awk 'NR == FNR {{ offset[$1] = $2; of[$1] = $4; next }}
            $1 in offset {{ print $1, offset[$1] + $2 "/" of[$1] }}' "$accepted" - <<< "$queue"
    else
        echo "squeue does not tell which jobs are over; as if none were, until $accepted is removed" >&2
        awk '{{ print $1, $3 "/" $4 }}' "$accepted"
    fi
}}
submit() {{
    accepted=$folder/slurm${{1#-}}.jobs
    after=$behind
    known=$(under_way)
    while read -r id _; do
        if [[ -n $id && $behind: != *":$id:"* ]]; then behind+=:$id; fi
    done <<< "$known"
    arrays=$("$program" sweep status "$folder" --tasks {tasks} --array-size "$size" \
        --under-way <(cut -d ' ' -f 2 <<< "$known") "${{@:2}}") || (($? == 1 || $? == 3)) || exit
    while read -r offset tasks parts; do
        if [[ -z $tasks ]]; then continue; fi
        if [[ -z $left ]] && id=$(sbatch --parsable ${{after:+"--dependency=afterany$after"}} \
            --array="$tasks{at_once}" --cpus-per-task={cores} --time="$time" --signal=B:TERM@60 \
            --job-name=asperity-sweep --output="$output/slurm.txt" --open-mode=append "$0" "$offset" "${{@:2}}"); then
            id=${{id%%;*}}
            echo "$id: parts $parts"
            echo "$id $offset $parts {tasks}" >> "$accepted"
            behind+=:$id
        else
            left+=,$parts
        fi
    done <<< "$arrays"
}}
submit -
{verify}if [[ -n $left ]]; then
    echo "parts ${{left:1}} of {tasks} are left, since sbatch refused them; call this script again when others are" \
        "over, or one of \`asperity sweep emit slurm\` with a smaller --tasks" >&2
    if [[ -z $behind ]]; then exit 1; fi
fi
if ! sbatch ${{behind:+"--dependency=afterany$behind"}} --cpus-per-task=1 --time="$time" \
    --job-name=asperity-collect --output="$output/collect.txt" --wrap "$collect"; then
    echo "the tables are left, since sbatch refused their job; call this script again when the parts are over" >&2
    exit 1
fi
if [[ -n $left ]]; then exit 1; fi
"#
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
    use super::{Array, UnderWay, arrays};
    use crate::results::parse_ranges;

    fn of(missing: impl Iterator<Item = u64>, parts: u64, size: u64) -> Vec<(u64, String)> {
        let arrays = arrays(missing, parts, size).into_iter();
        let parts = |offset, tasks: &str| {
            parse_ranges(tasks, size - 1).unwrap().into_iter().map(|task| task + offset).collect::<Vec<u64>>()
        };
        arrays
            .map(|Array { offset, tasks, parts: named }| {
                assert_eq!(parse_ranges(&named, u64::MAX).unwrap(), parts(offset, &tasks));
                (offset, tasks)
            })
            .collect()
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
    fn runs_of_parts_under_way_are_known_whatever_the_number_of_parts() {
        let under_way = UnderWay::read("1,3/4\n\n2-3/5\n", 12).unwrap();
        let runs: Vec<u64> = (1..=12).filter(|run| under_way.has(|_| *run)).collect();
        assert_eq!(runs, [1, 2, 3, 5, 7, 8, 9, 11, 12]);
        for text in ["1", "1/13", "1/0", "5/4", "x/4"] {
            assert!(UnderWay::read(text, 12).unwrap_err().contains("(accepted: "), "{text}");
        }
    }

    #[test]
    fn every_missing_run_is_of_one_task() {
        for (parts, size) in [(1, 2), (7, 4), (100, 31), (100, 1001)] {
            let missing = || (1..=100_u64).filter(|run| run % 3 == 0);
            let made: Vec<u64> = arrays(missing(), parts, size)
                .iter()
                .flat_map(|Array { offset, tasks, .. }| {
                    let tasks = parse_ranges(tasks, size - 1).unwrap();
                    tasks.into_iter().map(move |task| offset + task)
                })
                .collect();
            let expected: std::collections::BTreeSet<u64> =
                missing().map(|run| if run % parts == 0 { parts } else { run % parts }).collect();
            assert_eq!(made, expected.into_iter().collect::<Vec<_>>(), "{parts} parts, {size}");
        }
    }
}
