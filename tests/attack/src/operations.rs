//! What a command does to files, operation by operation, as the kernel sees it; each can be made to fail.

use std::fmt;
use std::fs;
use std::io;
use std::os::unix::ffi::OsStringExt;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;
use std::thread;

use crate::calls::{Call, Outcome};
use crate::ground::{Error, Ground};
use crate::kernel::{Answer, Listener, Stopped, stop_at};

/// The kinds of operations.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Opens a file for writing, which may create or empty it.
    Create,
    /// Opens a file or folder for reading.
    Open,
    Read,
    Write,
    /// Writes to standard output.
    Print,
    Sync,
    Rename,
    Link,
    /// Removes a file or a folder.
    Remove,
    /// Creates a folder.
    Folder,
    Lock,
    /// Changes the length.
    Length,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Kind::Create => "create",
            Kind::Open => "open",
            Kind::Read => "read",
            Kind::Write => "write",
            Kind::Print => "print",
            Kind::Sync => "sync",
            Kind::Rename => "rename",
            Kind::Link => "link",
            Kind::Remove => "unlink",
            Kind::Folder => "mkdir",
            Kind::Lock => "lock",
            Kind::Length => "truncate",
        })
    }
}

/// One operation on a file or folder in the folder of the case.
#[derive(Debug, Clone)]
pub(crate) struct Operation {
    pub(crate) kind: Kind,
    /// Relative to the folder of the case.
    pub(crate) path: PathBuf,
    /// The new name of a rename or link.
    pub(crate) to: Option<PathBuf>,
    /// The place in the file, of a write; the new length.
    pub(crate) at: u64,
    /// What is written, if a disk is recorded.
    pub(crate) bytes: Vec<u8>,
    /// Whether the file is emptied when it is opened.
    pub(crate) empties: bool,
}

impl fmt::Display for Operation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.kind, self.path.display())?;
        self.to.as_ref().map_or(Ok(()), |to| write!(f, " {}", to.display()))
    }
}

/// What becomes of an operation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Fate {
    Proceeds,
    /// It is not made, and fails with this error of the system.
    Fails(i32),
    /// Half of the bytes are written.
    Halves,
}

/// The calls that are operations.
const COUNTED: &[i64] = &[
    #[cfg(target_arch = "x86_64")]
    libc::SYS_open,
    libc::SYS_openat,
    libc::SYS_read,
    libc::SYS_pread64,
    libc::SYS_readv,
    libc::SYS_write,
    libc::SYS_pwrite64,
    libc::SYS_writev,
    libc::SYS_fsync,
    libc::SYS_fdatasync,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_rename,
    libc::SYS_renameat,
    libc::SYS_renameat2,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_link,
    libc::SYS_linkat,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_unlink,
    libc::SYS_unlinkat,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_rmdir,
    #[cfg(target_arch = "x86_64")]
    libc::SYS_mkdir,
    libc::SYS_mkdirat,
    libc::SYS_flock,
    libc::SYS_ftruncate,
];

/// Calls that would change files past the counter. The command makes none of them.
const PAST: &[(i64, &str)] = &[
    #[cfg(target_arch = "x86_64")]
    (libc::SYS_creat, "creat"),
    (libc::SYS_openat2, "openat2"),
    (libc::SYS_open_by_handle_at, "open_by_handle_at"),
    (libc::SYS_pwritev, "pwritev"),
    (libc::SYS_pwritev2, "pwritev2"),
    (libc::SYS_preadv, "preadv"),
    (libc::SYS_preadv2, "preadv2"),
    (libc::SYS_sync, "sync"),
    (libc::SYS_syncfs, "syncfs"),
    (libc::SYS_sync_file_range, "sync_file_range"),
    (libc::SYS_truncate, "truncate"),
    (libc::SYS_fallocate, "fallocate"),
    (libc::SYS_copy_file_range, "copy_file_range"),
    (libc::SYS_sendfile, "sendfile"),
    (libc::SYS_splice, "splice"),
    (libc::SYS_io_uring_setup, "io_uring_setup"),
    (libc::SYS_io_setup, "io_setup"),
    #[cfg(target_arch = "x86_64")]
    (libc::SYS_symlink, "symlink"),
    (libc::SYS_symlinkat, "symlinkat"),
    #[cfg(target_arch = "x86_64")]
    (libc::SYS_mknod, "mknod"),
    (libc::SYS_mknodat, "mknodat"),
    #[cfg(target_arch = "x86_64")]
    (libc::SYS_chmod, "chmod"),
    (libc::SYS_fchmod, "fchmod"),
    (libc::SYS_fchmodat, "fchmodat"),
    #[cfg(target_arch = "x86_64")]
    (libc::SYS_chown, "chown"),
    (libc::SYS_fchown, "fchown"),
    (libc::SYS_fchownat, "fchownat"),
    (libc::SYS_utimensat, "utimensat"),
    (libc::SYS_setxattr, "setxattr"),
    (libc::SYS_fsetxattr, "fsetxattr"),
];

/// How a supervised command ended.
pub(crate) struct Supervised {
    pub(crate) outcome: Outcome,
    /// Calls that changed files past the counter.
    pub(crate) past: Vec<String>,
}

/// Whether the kernel stops calls for us; otherwise the attack is listed as not tried.
pub(crate) fn is_possible(ground: &Ground, module: &'static str) -> bool {
    let is_possible = fs::read_to_string("/proc/sys/kernel/seccomp/actions_avail")
        .is_ok_and(|actions| actions.split_whitespace().any(|action| action == "user_notif"));
    if !is_possible {
        let reason = "the kernel does not stop calls for other processes".to_owned();
        ground.tally.lock().expect("no case panics with it").skip(module, reason);
    }
    is_possible
}

/// Runs a command to its end; `decide` has the number of each operation, from 0. With `with_bytes`, it has what
/// is written, too.
pub(crate) fn supervise(
    mut call: Call<'_>,
    folder: &Path,
    with_bytes: bool,
    decide: impl FnMut(usize, &Operation) -> Fate + Send,
) -> Result<Supervised, Error> {
    let past = PAST.iter().map(|(number, _)| *number);
    let stopped: Vec<i64> = COUNTED.iter().copied().chain(past).chain([libc::SYS_mmap]).collect();
    let socket = stop_at(&mut call.command, &stopped)?;
    let state = Mutex::new(State { folder, with_bytes, operations: 0, past: Vec::new(), decide });
    let outcome = thread::scope(|scope| {
        let supervisor = scope.spawn(|| -> io::Result<()> {
            let Some(listener) = Listener::receive(&socket)? else { return Ok(()) };
            let mut state = state.lock().expect("no one else has it");
            while let Some(stopped) = listener.next()? {
                let answer = state.answer(&stopped);
                listener.answer(stopped, answer)?;
            }
            Ok(())
        });
        let outcome = call.run();
        // The command is dropped with its end of the socket.
        supervisor.join().expect("the supervisor does not panic").and(outcome)
    })?;
    let State { past, .. } = state.into_inner().expect("the supervisor does not panic");
    Ok(Supervised { outcome, past })
}

struct State<'a, Decide> {
    folder: &'a Path,
    with_bytes: bool,
    operations: usize,
    past: Vec<String>,
    decide: Decide,
}

impl<Decide: FnMut(usize, &Operation) -> Fate> State<'_, Decide> {
    fn answer(&mut self, call: &Stopped) -> Answer {
        if let Some((_, name)) = PAST.iter().find(|(number, _)| *number == call.number) {
            self.past.push((*name).to_owned());
            return Answer::Proceed;
        }
        // A thread that was killed has no files.
        let Ok(Some(operation)) = self.operation(call) else { return Answer::Proceed };
        let number = self.operations;
        self.operations += 1;
        match (self.decide)(number, &operation) {
            Fate::Proceeds => Answer::Proceed,
            Fate::Fails(error) => Answer::Error(error),
            Fate::Halves => half_written(call).map_or(Answer::Proceed, Answer::Value),
        }
    }

    /// The operation of a call; None if it is of no file in the folder.
    fn operation(&mut self, call: &Stopped) -> io::Result<Option<Operation>> {
        let [first, second, third, fourth, ..] = call.arguments;
        const HERE: u64 = libc::AT_FDCWD as u64;
        let (kind, path, to) = match call.number {
            #[cfg(target_arch = "x86_64")]
            libc::SYS_open => (of_flags(second), named(call, HERE, first)?, None),
            libc::SYS_openat => (of_flags(third), named(call, first, second)?, None),
            #[cfg(target_arch = "x86_64")]
            libc::SYS_rename => (Kind::Rename, named(call, HERE, first)?, Some(named(call, HERE, second)?)),
            libc::SYS_renameat | libc::SYS_renameat2 => {
                (Kind::Rename, named(call, first, second)?, Some(named(call, third, fourth)?))
            }
            #[cfg(target_arch = "x86_64")]
            libc::SYS_link => (Kind::Link, named(call, HERE, first)?, Some(named(call, HERE, second)?)),
            libc::SYS_linkat => (Kind::Link, named(call, first, second)?, Some(named(call, third, fourth)?)),
            #[cfg(target_arch = "x86_64")]
            libc::SYS_unlink | libc::SYS_rmdir => (Kind::Remove, named(call, HERE, first)?, None),
            libc::SYS_unlinkat => (Kind::Remove, named(call, first, second)?, None),
            #[cfg(target_arch = "x86_64")]
            libc::SYS_mkdir => (Kind::Folder, named(call, HERE, first)?, None),
            libc::SYS_mkdirat => (Kind::Folder, named(call, first, second)?, None),
            libc::SYS_write | libc::SYS_writev if first == 1 => {
                (Kind::Print, self.folder.join("stdout"), None)
            }
            libc::SYS_write | libc::SYS_writev if first == 2 => return Ok(None),
            libc::SYS_mmap => {
                // Memory that is a file can be written without any call.
                const SHARED: [u64; 2] = [libc::MAP_SHARED as u64, libc::PROT_WRITE as u64];
                let is_file = call.arguments[4] as i32 >= 0 && fourth & libc::MAP_ANONYMOUS as u64 == 0;
                if is_file && fourth & SHARED[0] != 0 && third & SHARED[1] != 0 {
                    self.past.push("mmap".to_owned());
                }
                return Ok(None);
            }
            number => (of_file(number), opened(call, first)?, None),
        };
        let is_device = ["/dev", "/proc"].iter().any(|of_system| path.starts_with(of_system));
        let Ok(inside) = path.strip_prefix(self.folder) else {
            let changes = !matches!(kind, Kind::Open | Kind::Read | Kind::Lock);
            if changes && path.is_absolute() && !is_device {
                self.past.push(format!("{kind} {} outside of the folder", path.display()));
            }
            return Ok(None);
        };
        let path = inside.to_owned();
        let to = to.map(|to| to.strip_prefix(self.folder).map_or(to.clone(), Path::to_owned));
        let mut operation = Operation { kind, path, to, at: 0, bytes: Vec::new(), empties: false };
        match kind {
            Kind::Create => {
                let flags = if call.number == libc::SYS_openat { third } else { second };
                operation.empties = flags & libc::O_TRUNC as u64 != 0;
            }
            Kind::Length => operation.at = second,
            Kind::Write if self.with_bytes => (operation.at, operation.bytes) = written(call)?,
            _ => {}
        }
        Ok(Some(operation))
    }
}

fn of_flags(flags: u64) -> Kind {
    let writes = (libc::O_WRONLY | libc::O_RDWR | libc::O_CREAT | libc::O_TRUNC) as u64;
    if flags & writes == 0 { Kind::Open } else { Kind::Create }
}

fn of_file(number: i64) -> Kind {
    match number {
        libc::SYS_read | libc::SYS_pread64 | libc::SYS_readv => Kind::Read,
        libc::SYS_fsync | libc::SYS_fdatasync => Kind::Sync,
        libc::SYS_flock => Kind::Lock,
        libc::SYS_ftruncate => Kind::Length,
        _ => Kind::Write,
    }
}

/// The path of an open file, under its present name.
fn opened(call: &Stopped, descriptor: u64) -> io::Result<PathBuf> {
    fs::read_link(call.of_system(&format!("fd/{}", descriptor as i32)))
}

/// The path that a call names.
fn named(call: &Stopped, folder: u64, text: u64) -> io::Result<PathBuf> {
    let name = PathBuf::from(std::ffi::OsString::from_vec(call.text(text)?));
    let path = if name.is_absolute() {
        name
    } else if folder as i32 == libc::AT_FDCWD {
        fs::read_link(call.of_system("cwd"))?.join(name)
    } else {
        opened(call, folder)?.join(name)
    };
    let mut plain = PathBuf::new();
    for component in path.components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => drop(plain.pop()),
            other => plain.push(other),
        }
    }
    Ok(plain)
}

/// The place and the bytes of a write.
fn written(call: &Stopped) -> io::Result<(u64, Vec<u8>)> {
    let [descriptor, buffer, length, at, ..] = call.arguments;
    if call.number == libc::SYS_pwrite64 {
        return Ok((at, call.memory(buffer, length as usize)?));
    }
    let about = fs::read_to_string(call.of_system(&format!("fdinfo/{descriptor}")))?;
    let position = about.lines().find_map(|line| line.strip_prefix("pos:")?.trim().parse().ok());
    let position = position.ok_or_else(|| io::Error::other("an open file has a position"))?;
    if call.number == libc::SYS_write {
        return Ok((position, call.memory(buffer, length as usize)?));
    }
    let mut bytes = Vec::new();
    for part in call.memory(buffer, 16 * length as usize)?.chunks_exact(16) {
        let [start, length] = [0, 8].map(|from| u64::from_le_bytes(std::array::from_fn(|n| part[from + n])));
        bytes.extend(call.memory(start, length as usize)?);
    }
    Ok((position, bytes))
}

/// Writes half of the bytes of a call, and returns how many these are.
fn half_written(call: &Stopped) -> io::Result<i64> {
    let (_, bytes) = written(call)?;
    call.write(call.arguments[0], &bytes[..bytes.len().div_ceil(2)])
}
