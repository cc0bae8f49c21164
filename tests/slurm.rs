//! Sweeps under a real Slurm, which is started on this machine: the output of `sweep emit slurm` is
//! submitted, tasks are killed and cancelled, it is submitted again, and the tables are those of
//! `sweep run`.
//!
//! It needs root and the Debian packages slurm-wlm and munge. Without them the tests skip with a message,
//! or fail with `ASPERITY_NO_SKIPS=1`.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::io::Write;
use std::net::TcpListener;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use asperity_study::results::parse_ranges;
use asperity_study::segment::this_node;

use crate::support::binary::{succeed, text};
use crate::sweep::{RUNS, files_below};
use crate::sweep::{SHORT, Study, kill, sweep, tables};

/// The programs of Slurm that are used here.
const PROGRAMS: [&str; 7] = ["munged", "slurmctld", "slurmd", "sbatch", "scancel", "scontrol", "squeue"];

/// Arrays have fewer tasks than this: less than the tests have parts.
const MAX_ARRAY_SIZE: u32 = 4;

/// Time limit for any operation, which only a hang exceeds.
const PATIENCE: Duration = Duration::from_secs(120);

/// A cluster of this machine alone, for as long as this lives.
struct Cluster {
    folder: tempfile::TempDir,
    daemons: Vec<Child>,
}

impl Cluster {
    /// Starts one, unless the test skips.
    fn start() -> Option<Cluster> {
        if let Some(reason) = missing() {
            let no_skips = env::var_os("ASPERITY_NO_SKIPS").is_some_and(|value| value == "1");
            assert!(!no_skips, "Slurm must not be skipped: {reason}");
            // Not eprintln, which the test harness captures: a skip must be seen.
            writeln!(std::io::stderr(), "SKIPPED Slurm: {reason}").expect("stderr can be written");
            return None;
        }
        let folder = asperity_testkit::folder();
        let path = |name: &str| folder.path().join(name);
        // The daemons check the permissions of all folders above their files.
        fs::set_permissions(folder.path(), fs::Permissions::from_mode(0o755)).expect("it is ours");
        let key: Vec<u8> = blake3::hash(text(folder.path()).as_bytes()).as_bytes().repeat(4);
        fs::write(path("key"), key).expect("the folder can be written");
        fs::set_permissions(path("key"), fs::Permissions::from_mode(0o600)).expect("it is ours");
        for folder in ["state", "spool"] {
            fs::create_dir(path(folder)).expect("the folder can be written");
        }
        fs::write(path("slurm.conf"), configuration(folder.path())).expect("the folder can be written");
        let root = text(folder.path()).to_owned();
        let at = |name: &str| format!("{root}/{name}");
        let mut cluster = Cluster { folder, daemons: Vec::new() };
        let munged = [
            "--foreground".to_owned(),
            "--force".to_owned(),
            format!("--key-file={}", at("key")),
            format!("--socket={}", at("munge.socket")),
            format!("--pid-file={}", at("munge.pid")),
            format!("--log-file={}", at("munge.log")),
            format!("--seed-file={}", at("munge.seed")),
        ];
        cluster.daemon("munged", &munged);
        cluster.wait_for("munged", |cluster| cluster.path("munge.socket").exists());
        let foreground = ["-D".to_owned(), "-f".to_owned(), at("slurm.conf")];
        cluster.daemon("slurmctld", &foreground);
        cluster.daemon("slurmd", &foreground);
        cluster.wait_for("a node", |cluster| cluster.said("sinfo", &["-h", "-o", "%t"]).trim() == "idle");
        Some(cluster)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.path("slurm.conf")).stdin(Stdio::null());
        command
    }

    fn daemon(&mut self, program: &str, arguments: &[String]) {
        let log = |kind: &str| {
            let file = fs::File::create(self.path(&format!("{program}.{kind}")));
            Stdio::from(file.expect("the folder can be written"))
        };
        let mut command = self.command(program);
        command.args(arguments).stdout(log("out")).stderr(log("err"));
        self.daemons.push(command.spawn().expect("it is installed"));
    }

    /// The output of a Slurm program.
    fn said(&self, program: &str, arguments: &[&str]) -> String {
        let output = self.command(program).args(arguments).output().expect("it is installed");
        String::from_utf8_lossy(&output.stdout).into_owned()
    }

    fn wait_for(&self, what: &str, has_come: impl Fn(&Cluster) -> bool) {
        let deadline = Instant::now() + PATIENCE;
        while !has_come(self) {
            let words = |name: &str| fs::read_to_string(self.path(name)).unwrap_or_default();
            assert!(
                Instant::now() < deadline,
                "no {what}\n{}\n{}\n{}",
                words("slurmctld.log"),
                words("slurmd.log"),
                self.said("squeue", &[])
            );
            thread::sleep(Duration::from_millis(50));
        }
    }

    /// Calls a script that submits a sweep; returns the parts that it reports.
    fn submit(&self, script: &Path) -> Vec<String> {
        let output = self.command("bash").arg(script).output().expect("there is bash");
        let words = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(output.status.success(), "{}{}", words(&output.stdout), words(&output.stderr));
        let parts = |line: &str| line.split_once(": parts ").map(|(_, parts)| parts.to_owned());
        words(&output.stdout).lines().filter_map(parts).collect()
    }

    fn wait_until_idle(&self) {
        self.wait_for("end of all jobs", |cluster| cluster.said("squeue", &["-h"]).is_empty());
    }

    /// The processes that have the configuration of this cluster in their environment and a variable
    /// with that name.
    fn processes(&self, variable: &str) -> BTreeSet<u32> {
        let configuration = format!("SLURM_CONF={}", self.path("slurm.conf").display());
        let entries = fs::read_dir("/proc").expect("this is Linux").flatten();
        entries
            .filter_map(|entry| entry.file_name().to_str()?.parse().ok())
            .filter(|process| {
                let environment = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
                let mut variables = environment.split(|byte| *byte == 0);
                let named = |named: &[u8]| named.starts_with(format!("{variable}=").as_bytes());
                environment.split(|byte| *byte == 0).any(|found| found == configuration.as_bytes())
                    && variables.any(named)
            })
            .collect()
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        for daemon in self.daemons.iter_mut().rev() {
            daemon.kill().ok();
            daemon.wait().ok();
        }
        // Their child processes continue without them.
        self.processes("SLURM_CONF").into_iter().for_each(kill);
    }
}

/// Missing requirements of these tests.
fn missing() -> Option<String> {
    let folders: Vec<PathBuf> = env::var_os("PATH").iter().flat_map(env::split_paths).collect();
    let is_there = |program: &&str| folders.iter().any(|folder| folder.join(program).is_file());
    if let Some(program) = PROGRAMS.iter().find(|program| !is_there(program)) {
        return Some(format!("there is no {program} (Debian packages slurm-wlm and munge)"));
    }
    let id = Command::new("id").arg("-u").output().expect("id is there").stdout;
    (id != b"0\n").then(|| "only root can start it".to_owned())
}

/// The configuration of a cluster whose files are in that folder.
fn configuration(folder: &Path) -> String {
    let folder = folder.display();
    // The machine's own description: a node of another description accepts no jobs.
    let machine = Command::new("slurmd").arg("-C").output().expect("it is installed").stdout;
    let machine = String::from_utf8(machine).expect("it is text");
    let machine = machine.lines().next().expect("it has a line");
    let (name, of_it) = machine.split_once(' ').expect("it has a name and more");
    let host = name.strip_prefix("NodeName=").expect("it has a name");
    let listeners = [0, 0].map(|port| TcpListener::bind(("127.0.0.1", port)).expect("there are ports"));
    let [control, node] = listeners.map(|port| port.local_addr().expect("it listens").port());
    format!(
        "ClusterName=local\n\
         SlurmctldHost={host}(127.0.0.1)\n\
         SlurmctldPort={control}\n\
         SlurmdPort={node}\n\
         SlurmUser=root\n\
         SlurmdUser=root\n\
         AuthType=auth/munge\n\
         AuthInfo=socket={folder}/munge.socket\n\
         CredType=cred/munge\n\
         MpiDefault=none\n\
         ProctrackType=proctrack/linuxproc\n\
         TaskPlugin=task/none\n\
         JobAcctGatherType=jobacct_gather/none\n\
         AccountingStorageType=accounting_storage/none\n\
         SelectType=select/cons_tres\n\
         SelectTypeParameters=CR_Core\n\
         SwitchType=switch/none\n\
         ReturnToService=2\n\
         KillWait=2\n\
         MaxArraySize={MAX_ARRAY_SIZE}\n\
         SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0\n\
         SlurmctldPidFile={folder}/slurmctld.pid\n\
         SlurmdPidFile={folder}/slurmd.pid\n\
         SlurmctldLogFile={folder}/slurmctld.log\n\
         SlurmdLogFile={folder}/slurmd.log\n\
         StateSaveLocation={folder}/state\n\
         SlurmdSpoolDir={folder}/spool\n\
         NodeName={host} NodeAddr=127.0.0.1 {of_it}\n\
         PartitionName=main Nodes=ALL Default=YES MaxTime=INFINITE\n"
    )
}

fn script(study: &Study, out: &Path, more: &[&str]) -> PathBuf {
    let script = study.path("sweep.slurm");
    let emitted = succeed(&[&["sweep", "emit", "slurm", text(out)], more].concat());
    fs::write(&script, emitted).expect("the folder can be written");
    script
}

/// The missing runs of a study, from its status.
fn lacks(out: &Path) -> String {
    let (_, status, _) = sweep(&["status", text(out)]);
    let line = status.lines().find_map(|line| line.strip_prefix("missing: "));
    line.unwrap_or_default().to_owned()
}

#[test]
fn tables_of_job_arrays_whose_tasks_were_killed_are_those_of_one_machine() {
    let Some(cluster) = Cluster::start() else { return };
    let study = Study::of(
        "
title = 'Runs for a cluster'
scenario = 'default'
set = ['slider.blocks=50']
[[axis]]
key = 'parameter_set'
values = ['as-coded', 'as-stated']
[[axis]]
key = 'time.duration_s'
values = [12, 10, 1, 1.1, 1.2, 1.3, 1.4]
",
    );
    let [whole, out] = ["whole", "a study of 100 %"].map(|name| study.plan(name));
    let script = script(&study, &out, &["--tasks", "7"]);
    // Nothing starts before one task is cancelled.
    cluster.said("scontrol", &["update", "PartitionName=main", "State=DOWN"]);
    assert_eq!(cluster.submit(&script), ["1-3", "4-6", "7"], "seven parts, three in an array");
    let queue = cluster.said("squeue", &["-h", "-r", "-n", "asperity-sweep", "-o", "%F_%K"]);
    let mut tasks: Vec<&str> = queue.lines().collect();
    tasks.sort_unstable();
    assert_eq!(tasks.len(), 7, "{queue}");
    cluster.said("scancel", &[tasks[6]]);
    cluster.said("scontrol", &["update", "PartitionName=main", "State=UP"]);
    // Kills the first two tasks that appear: the first two that start, whose runs are the longest.
    let mut killed = BTreeSet::new();
    let deadline = Instant::now() + PATIENCE;
    while killed.len() < 2 {
        assert!(Instant::now() < deadline, "no task begins: {}", cluster.said("squeue", &[]));
        for process in cluster.processes("SLURM_ARRAY_TASK_ID") {
            let id = |environment: &[u8]| {
                let mut variables = environment.split(|byte| *byte == 0);
                let task = variables.find(|variable| variable.starts_with(b"SLURM_JOB_ID="))?;
                Some(task.to_owned())
            };
            let environment = fs::read(format!("/proc/{process}/environ")).unwrap_or_default();
            let Some(task) = id(&environment) else { continue };
            let program = fs::read_link(format!("/proc/{process}/exe")).unwrap_or_default();
            if program.ends_with("asperity") && (killed.len() < 2 || killed.contains(&task)) {
                kill(process);
                killed.insert(task);
            }
        }
    }
    cluster.wait_until_idle();
    let left = parse_ranges(&lacks(&out), 14).expect("some are missing");
    assert!([7, 14].iter().all(|run| left.contains(run)), "the cancelled task: {left:?}");
    assert!(left.len() > 2, "nothing was killed half-way: {left:?}");
    let told = fs::read_to_string(out.join("collect.txt")).expect("the last job has run all the same");
    assert!(told.contains("runs.") && told.contains(" missing"), "{told}");
    // Only missing runs are submitted again, with the command from the status.
    let parts = succeed_or_incomplete(&["status", text(&out), "--tasks", "7", "--array-size", "4"]);
    let parts: Vec<&str> =
        parts.lines().filter_map(|line| line.rsplit_once(' ')).map(|part| part.1).collect();
    assert_eq!(cluster.submit(&script), parts);
    cluster.wait_until_idle();
    assert_eq!(sweep(&["status", text(&out)]), (0, "14 of 14 runs done\n".to_owned(), String::new()));
    succeed(&["sweep", "run", text(&whole)]);
    assert!(tables(&out) == tables(&whole), "other tables");
    // Once more: no runs are missing, and the tables are made.
    fs::remove_dir_all(out.join("tables")).expect("they are there");
    assert_eq!(cluster.submit(&script), [""; 0]);
    cluster.wait_until_idle();
    assert!(out.join("tables").exists(), "{}", cluster.said("squeue", &[]));
}

/// Verification follows the runs, and the tables follow both; called again, the script has nothing to submit.
#[test]
fn runs_of_job_arrays_are_verified_before_the_tables_are_made() {
    let Some(cluster) = Cluster::start() else { return };
    let study = Study::of(SHORT);
    let [whole, out] = ["whole", "study"].map(|name| study.plan(name));
    let script = script(&study, &out, &["--tasks", "3", "--verify", "50%"]);
    let parts = |more: &[&str]| -> Vec<String> {
        let arrays = [&["status", text(&out), "--tasks", "3", "--array-size", "4"], more].concat();
        let arrays = succeed_or_incomplete(&arrays);
        arrays.lines().filter_map(|line| line.rsplit_once(' ')).map(|array| array.1.to_owned()).collect()
    };
    let verified = parts(&["--verify", "50%"]);
    assert!(!verified.is_empty());
    assert_eq!(cluster.submit(&script), [parts(&[]), verified].concat());
    cluster.wait_until_idle();
    let expected = format!("6 of 6 runs done\n3 of 3 chosen runs verified: 3 on {} alone\n", this_node());
    let status = sweep(&["status", text(&out), "--verify", "50%"]);
    assert_eq!(status, (0, expected, String::new()));
    let told = fs::read_to_string(out.join("slurm.txt")).expect("tasks have printed");
    assert!(told.contains(" verified: "), "{told}");
    assert_eq!(cluster.submit(&script), [""; 0]);
    cluster.wait_until_idle();
    succeed(&["sweep", "run", text(&whole)]);
    assert!(out.join("report.html").exists() && tables(&out) == tables(&whole), "other tables");
}

/// A pipeline on Slurm ends in the files of `reproduce`.
#[test]
fn a_pipeline_is_made_by_job_arrays() {
    let Some(cluster) = Cluster::start() else { return };
    let study = Study::of(&format!("title = 'Runs'\n{RUNS}"));
    let (whole, out) = (study.path("whole"), study.plan("planned"));
    let script = script(&study, &out, &["--tasks", "3"]);
    assert_eq!(cluster.submit(&script), ["1-3"], "a run each");
    cluster.wait_until_idle();
    succeed(&["reproduce", text(&study.path("sweep.toml")), "--out", text(&whole)]);
    assert!(files_below(&out) == files_below(&whole), "other files");
}

fn succeed_or_incomplete(arguments: &[&str]) -> String {
    let (code, told, err) = sweep(arguments);
    assert!(code == 0 || code == 3, "{code} {err}");
    told
}

/// A minute before its time limit a task receives SIGTERM, and only the task; so it is here.
#[test]
fn a_task_that_is_told_to_end_keeps_what_it_has_done() {
    let Some(cluster) = Cluster::start() else { return };
    let study = Study::of(
        "
title = 'A short run and one that does not end'
scenario = 'default'
[[axis]]
keys = ['slider.blocks', 'time.duration_s']
rows = [[10, 0.1], [400, 500.0]]
",
    );
    let out = study.plan("study");
    let script = script(&study, &out, &["--tasks", "1"]);
    assert_eq!(cluster.submit(&script), ["1"]);
    cluster.wait_for("run that is done", |_| lacks(&out) == "2");
    let array = || {
        let running = ["-h", "-n", "asperity-sweep", "-t", "RUNNING", "-o", "%F"];
        cluster.said("squeue", &running).trim().to_owned()
    };
    let first = array();
    cluster.said("scancel", &["--signal=TERM", "--batch", &first]);
    cluster.wait_until_idle();
    let job = cluster.said("scontrol", &["show", "job", &first]);
    assert!(job.contains("ExitCode=143:0"), "{job}");
    let under_way = |cluster: &Cluster| cluster.processes("SLURM_ARRAY_TASK_ID");
    assert_eq!((lacks(&out).as_str(), under_way(&cluster)), ("2", BTreeSet::new()));
    // As above for a task that is cancelled while it makes a run.
    assert_eq!(cluster.submit(&script), ["1"]);
    let makes_runs = |process: &u32| {
        fs::read(format!("/proc/{process}/cmdline"))
            .is_ok_and(|words| words.split(|byte| *byte == 0).any(|word| word == b"--chunk"))
    };
    cluster.wait_for("run", |cluster| under_way(cluster).iter().any(makes_runs));
    cluster.said("scancel", &[&array()]);
    cluster.wait_until_idle();
    assert_eq!((lacks(&out).as_str(), under_way(&cluster)), ("2", BTreeSet::new()));
    let emitted = fs::read_to_string(&script).expect("it is there");
    for words in ["--signal=B:TERM@60", "\n    exec "] {
        assert!(emitted.contains(words), "{words}: {emitted}");
    }
}
