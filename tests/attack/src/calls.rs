//! Calls of the built command from outside: its output, its end, and its resources.

use std::fs::{self, File};
use std::io::{self, Read, Seek};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

/// A command that works for this long, or is idle for this long, is assumed to hang. Time taken by other
/// processes does not count.
const PATIENCE: Duration = Duration::from_secs(120);

/// Most address space of a command, so that a bomb does not exhaust the machine. The documented bound is
/// lower, and is measured.
const ADDRESS_SPACE_KB: u32 = 3_000_000;

/// How one call of the command ended.
#[derive(Debug, Clone)]
pub(crate) struct Outcome {
    /// The exit code or signal, as a shell would show it.
    pub(crate) call: String,
    pub(crate) code: Option<i32>,
    pub(crate) signal: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
    /// Whether it was still running when patience ended.
    pub(crate) hung: bool,
    /// Seconds of user and system time, to a hundredth.
    pub(crate) cpu_s: f64,
    /// The most that it had of memory at once, MB.
    pub(crate) peak_mb: f64,
}

impl Outcome {
    /// Whether it fell over in its own code.
    pub(crate) fn panicked(&self) -> bool {
        self.code == Some(101) || self.err.contains("panicked at")
    }

    /// How it ended, in words.
    pub(crate) fn ending(&self) -> String {
        match (self.hung, self.code, self.signal) {
            (true, _, _) => {
                format!("still running after {} s of work, or of doing nothing", PATIENCE.as_secs())
            }
            (_, Some(code), _) => format!("exit {code}"),
            (_, None, Some(signal)) => format!("signal {signal}"),
            (_, None, None) => "no exit code".to_owned(),
        }
    }

    /// Its whole output, shortened for readers.
    pub(crate) fn said(&self) -> String {
        shortened(&format!("{}{}", self.out, self.err), 600)
    }
}

/// The beginning of a text.
pub(crate) fn shortened(text: &str, most: usize) -> String {
    match text.char_indices().nth(most) {
        Some((end, _)) => format!("{} ...", &text[..end]),
        None => text.to_owned(),
    }
}

/// One call of the command, in a folder.
pub(crate) struct Call<'a> {
    pub(crate) command: Command,
    shown: String,
    outputs: [File; 2],
    started: Instant,
    folder: &'a Path,
}

/// A call under way.
pub(crate) struct Running {
    child: Child,
    shown: String,
    outputs: [File; 2],
    started: Instant,
    peak_mb: f64,
    cpu_s: f64,
}

impl<'a> Call<'a> {
    /// The command with these arguments, in that folder.
    pub(crate) fn new(program: &Path, folder: &'a Path, arguments: &[&str]) -> io::Result<Call<'a>> {
        let limit = format!("ulimit -v {ADDRESS_SPACE_KB}");
        Call::by_shell(program, folder, &limit, arguments, "")
    }

    /// Calls the command from a shell, after a line such as `ulimit`, and with redirections.
    pub(crate) fn by_shell(
        program: &Path,
        folder: &'a Path,
        before: &str,
        arguments: &[&str],
        redirections: &str,
    ) -> io::Result<Call<'a>> {
        let mut command = Command::new("sh");
        command.arg("-c").arg(format!("{before}; exec \"$0\" \"$@\" {redirections}"));
        command.arg(program).args(arguments).current_dir(folder).stdin(Stdio::null());
        let words: Vec<String> = arguments.iter().map(|word| quoted(word)).collect();
        let mut shown = format!("asperity {} {redirections}", words.join(" ")).trim_end().to_owned();
        if !before.is_empty() && before != format!("ulimit -v {ADDRESS_SPACE_KB}") {
            shown = format!("{before}; {shown}");
        }
        // Files and not pipes: a pipe that nobody empties would stop it.
        let outputs = [tempfile::tempfile()?, tempfile::tempfile()?];
        command.stdout(outputs[0].try_clone()?).stderr(outputs[1].try_clone()?);
        Ok(Call { command, shown, outputs, started: Instant::now(), folder })
    }

    /// Starts it.
    pub(crate) fn start(mut self) -> io::Result<Running> {
        debug_assert!(self.folder.is_dir());
        self.started = Instant::now();
        let child = self.command.spawn()?;
        let Call { shown, outputs, started, .. } = self;
        Ok(Running { child, shown, outputs, started, peak_mb: 0.0, cpu_s: 0.0 })
    }

    /// Runs it to its end.
    pub(crate) fn run(self) -> io::Result<Outcome> {
        self.start()?.wait()
    }
}

impl Running {
    /// Sends it a signal, by name as `kill` has it. That it has ended meanwhile is no error.
    pub(crate) fn signal(&mut self, name: &str) -> io::Result<()> {
        if self.child.try_wait()?.is_none() {
            let id = self.child.id().to_string();
            // It may end between the look and the signal.
            Command::new("kill").args(["-s", name, &id]).stderr(Stdio::null()).status()?;
        }
        Ok(())
    }

    /// Whether it has ended.
    pub(crate) fn has_ended(&mut self) -> io::Result<bool> {
        Ok(self.child.try_wait()?.is_some())
    }

    /// Waits for its end.
    pub(crate) fn wait(mut self) -> io::Result<Outcome> {
        let mut hung = false;
        let mut worked = (self.cpu_s, Instant::now());
        let status = loop {
            self.measure();
            if self.cpu_s > worked.0 {
                worked = (self.cpu_s, Instant::now());
            }
            if let Some(status) = self.child.try_wait()? {
                break status;
            }
            let elapsed = self.started.elapsed();
            if self.cpu_s > PATIENCE.as_secs_f64() || worked.1.elapsed() > PATIENCE {
                hung = true;
                self.child.kill()?;
                break self.child.wait()?;
            }
            // Short ones are looked at often, long ones rarely.
            thread::sleep((elapsed / 20).clamp(Duration::from_millis(1), Duration::from_millis(20)));
        };
        self.outcome(status, hung)
    }

    /// The counters of the system so far.
    fn measure(&mut self) {
        let id = self.child.id();
        let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap_or_default();
        // A child that is about to become its program still has the name and the memory of this thread.
        let own = fs::read_to_string("/proc/thread-self/status").unwrap_or_default();
        if status.lines().next() == own.lines().next() {
            return;
        }
        let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next());
        if let Some(kb) = peak.and_then(|kb| kb.parse::<f64>().ok()) {
            self.peak_mb = self.peak_mb.max(kb / 1024.0);
        }
        // The name of the program, in brackets, may contain spaces.
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        let behind_name: Vec<&str> =
            stat.rsplit(") ").next().unwrap_or_default().split_whitespace().collect();
        let ticks = |at: usize| behind_name.get(at).and_then(|ticks| ticks.parse::<f64>().ok());
        if let (Some(user), Some(system)) = (ticks(11), ticks(12)) {
            self.cpu_s = self.cpu_s.max((user + system) / 100.0);
        }
    }

    fn outcome(mut self, status: ExitStatus, hung: bool) -> io::Result<Outcome> {
        let mut said = [String::new(), String::new()];
        for (file, text) in self.outputs.iter_mut().zip(&mut said) {
            // Messages have a few lines; printed tables may be long.
            const MOST: u64 = 50_000_000;
            let mut bytes = Vec::new();
            file.rewind()?;
            file.take(MOST).read_to_end(&mut bytes)?;
            *text = String::from_utf8_lossy(&bytes).into_owned();
        }
        let [out, err] = said;
        Ok(Outcome {
            call: self.shown,
            code: status.code(),
            signal: status.signal(),
            out,
            err,
            hung,
            cpu_s: self.cpu_s,
            peak_mb: self.peak_mb,
        })
    }
}

/// A word as a shell needs it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}
