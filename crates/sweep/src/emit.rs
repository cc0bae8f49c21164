//! Scripts for the engines that clusters already run: they name runs, and `asperity` does the rest.

use std::fmt::Write;

/// How many parts a Slurm array is cut into at most: its own limit is 1001 unless somebody raised it.
pub const MOST_TASKS: u64 = 1000;

/// What scripts need to know.
#[derive(Debug, Clone)]
pub struct Job {
    /// The path of the program.
    pub program: String,
    /// The folder of the plan.
    pub folder: String,
    /// How many parts the runs are cut into.
    pub tasks: u64,
    /// Cores of a task.
    pub cores: u64,
    /// Time of a task, as Slurm writes it.
    pub time: String,
}

impl Job {
    /// A job array for Slurm, and a job behind it that makes the tables of what there is.
    pub fn slurm(&self) -> String {
        let Job { tasks, cores, time, .. } = self;
        let [program, folder] = [&self.program, &self.folder].map(|word| quoted(word));
        format!(
            "#!/bin/bash\n\
             # Runs a sweep as a job array, and makes its tables when the array is over:\n\
             #     bash sweep.slurm\n\
             # Done runs are not done again: called once more, it does what is missing. What a task killed\n\
             # half-way has done is kept.\n\
             set -euo pipefail\n\
             program={program}\n\
             folder={folder}\n\
             if [[ -z ${{SLURM_JOB_ID:-}} ]]; then\n    \
                 array=$(sbatch --parsable --array=1-{tasks} --cpus-per-task={cores} --time={time} \\\n        \
                     --signal=B:TERM@60 --job-name=asperity-sweep --output=/dev/null \"$0\")\n    \
                 sbatch --dependency=afterany:\"$array\" --cpus-per-task=1 --time={time} \\\n        \
                     --job-name=asperity-collect --output=\"$folder/collect.txt\" \\\n        \
                     --wrap \"exec $(printf %q \"$program\") sweep collect $(printf %q \"$folder\")\"\n    \
                 exit\n\
             fi\n\
             exec \"$program\" --quiet sweep run \"$folder\" --chunk \"$SLURM_ARRAY_TASK_ID/{tasks}\" --jobs {cores}\n"
        )
    }

    /// One command a line, for GNU parallel, HyperQueue and the like.
    pub fn list(&self) -> String {
        let [program, folder] = [&self.program, &self.folder].map(|word| quoted(word));
        let mut text = String::new();
        for task in 1..=self.tasks {
            let (tasks, cores) = (self.tasks, self.cores);
            writeln!(text, "{program} --quiet sweep run {folder} --chunk {task}/{tasks} --jobs {cores}")
                .expect("texts can be written to");
        }
        text
    }

    /// A workflow for `row`: a folder of its workspace for each part.
    pub fn row(&self) -> String {
        let Job { tasks, cores, .. } = self;
        let [program, folder] = [&self.program, &self.folder].map(|word| quoted(word));
        let command =
            format!("{program} --quiet sweep run {folder} --chunk {{directory}}/{tasks} --jobs {cores}");
        let command = toml::Value::String(command);
        format!(
            "# Put it into a folder of its own, with a folder in `workspace` for each part, called 1 to {tasks}:\n\
             #     mkdir -p workspace && (cd workspace && mkdir $(seq {tasks})) && row submit\n\
             [workspace]\n\
             path = \"workspace\"\n\n\
             [[action]]\n\
             name = \"run\"\n\
             command = {command}\n\
             products = []\n\
             [action.resources]\n\
             processes.per_submission = 1\n\
             threads_per_process = {cores}\n"
        )
    }
}

/// A word as a shell reads it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', "'\\''"))
}
