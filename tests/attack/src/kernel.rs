//! Asks the kernel to stop a process at each of its calls that may change files, until this process has
//! answered (`SECCOMP_RET_USER_NOTIF`). The filter is inherited by threads and children and cannot be taken
//! off, so that no operation is missed, whatever library makes it.
#![expect(unsafe_code, reason = "the standard library has none of these calls")]

use std::fs;
use std::io;
use std::mem::{size_of, zeroed};
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd, RawFd};
use std::os::unix::fs::FileExt;
use std::os::unix::net::UnixStream;
use std::os::unix::process::CommandExt;
use std::process::Command;

/// A call that waits for an answer.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stopped {
    id: u64,
    /// The thread.
    pub(crate) thread: u32,
    pub(crate) number: i64,
    pub(crate) arguments: [u64; 6],
}

/// How a call goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Answer {
    /// The kernel makes the call.
    Proceed,
    /// The call is not made and fails with this error.
    Error(i32),
    /// The call is not made and returns this value.
    Value(i64),
}

/// Makes the calls of a command stop; the returned socket receives the [`Listener`] once it has started.
pub(crate) fn stop_at(command: &mut Command, calls: &[i64]) -> io::Result<UnixStream> {
    let (ours, theirs) = UnixStream::pair()?;
    let program = filter(calls);
    let start = move || install(&program, theirs.as_raw_fd());
    // SAFETY: between fork and exec it makes system calls alone, and allocates nothing.
    unsafe { command.pre_exec(start) };
    Ok(ours)
}

/// Loads the number of the call, compares it with each of these, and reports those; all others proceed.
fn filter(calls: &[i64]) -> Vec<libc::sock_filter> {
    let statement = |code: u32, k: u32| libc::sock_filter { code: code as u16, jt: 0, jf: 0, k };
    let mut program = vec![statement(libc::BPF_LD | libc::BPF_W | libc::BPF_ABS, 0)];
    for call in calls {
        let mut equal = statement(libc::BPF_JMP | libc::BPF_JEQ | libc::BPF_K, *call as u32);
        equal.jf = 1;
        program.extend([equal, statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_USER_NOTIF)]);
    }
    program.push(statement(libc::BPF_RET | libc::BPF_K, libc::SECCOMP_RET_ALLOW));
    program
}

fn install(program: &[libc::sock_filter], socket: RawFd) -> io::Result<()> {
    let list = libc::sock_fprog { len: program.len() as u16, filter: program.as_ptr().cast_mut() };
    // SAFETY: `list` points to `program`, which outlives the calls.
    let listener = unsafe {
        checked(libc::prctl(libc::PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0).into())?;
        let flags = libc::SECCOMP_FILTER_FLAG_NEW_LISTENER;
        checked(libc::syscall(libc::SYS_seccomp, libc::SECCOMP_SET_MODE_FILTER, flags, &raw const list))?
    };
    let mut byte = [0u8];
    let mut control = Control { words: [0; 4] };
    let (mut part, mut message) = message(&mut byte, &mut control);
    message.msg_iov = &raw mut part;
    // SAFETY: the message points to buffers of this function; the header fits into `control`.
    unsafe {
        let header = libc::CMSG_FIRSTHDR(&raw const message);
        (*header).cmsg_level = libc::SOL_SOCKET;
        (*header).cmsg_type = libc::SCM_RIGHTS;
        (*header).cmsg_len = libc::CMSG_LEN(size_of::<RawFd>() as u32) as usize;
        libc::CMSG_DATA(header).cast::<RawFd>().write_unaligned(listener as RawFd);
        checked(libc::sendmsg(socket, &raw const message, 0) as i64)?;
    }
    Ok(())
}

/// Room for one passed descriptor, aligned as its header needs.
struct Control {
    words: [u64; 4],
}

fn message(byte: &mut [u8; 1], control: &mut Control) -> (libc::iovec, libc::msghdr) {
    let part = libc::iovec { iov_base: byte.as_mut_ptr().cast(), iov_len: 1 };
    // SAFETY: all zeros is a message without parts.
    let mut message: libc::msghdr = unsafe { zeroed() };
    message.msg_iovlen = 1;
    message.msg_control = control.words.as_mut_ptr().cast();
    // SAFETY: arithmetic alone.
    message.msg_controllen = unsafe { libc::CMSG_SPACE(size_of::<RawFd>() as u32) } as usize;
    (part, message)
}

fn checked(value: i64) -> io::Result<i64> {
    if value < 0 { Err(io::Error::last_os_error()) } else { Ok(value) }
}

/// Receives the stopped calls of a process and its children.
pub(crate) struct Listener(OwnedFd);

impl Listener {
    /// Waits for the process to start; None if it never did.
    pub(crate) fn receive(socket: &UnixStream) -> io::Result<Option<Listener>> {
        let mut byte = [0u8];
        let mut control = Control { words: [0; 4] };
        let (mut part, mut message) = message(&mut byte, &mut control);
        message.msg_iov = &raw mut part;
        // SAFETY: the message points to buffers of this function; a received descriptor is this process's.
        unsafe {
            let received =
                checked(libc::recvmsg(socket.as_raw_fd(), &raw mut message, libc::MSG_CMSG_CLOEXEC) as i64)?;
            let header = libc::CMSG_FIRSTHDR(&raw const message);
            if received == 0 || header.is_null() {
                return Ok(None);
            }
            let listener = libc::CMSG_DATA(header).cast::<RawFd>().read_unaligned();
            Ok(Some(Listener(OwnedFd::from_raw_fd(listener))))
        }
    }

    /// Waits for the next stopped call; None after the end of the process and its children.
    pub(crate) fn next(&self) -> io::Result<Option<Stopped>> {
        loop {
            let mut poll = libc::pollfd { fd: self.0.as_raw_fd(), events: libc::POLLIN, revents: 0 };
            // SAFETY: one entry, of this function.
            match checked(unsafe { libc::poll(&raw mut poll, 1, -1) }.into()) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                outcome => outcome?,
            };
            if poll.revents & libc::POLLIN == 0 {
                return Ok(None);
            }
            // SAFETY: the kernel demands zeros, and fills in the structure.
            let mut call: libc::seccomp_notif = unsafe { zeroed() };
            let got =
                unsafe { libc::ioctl(self.0.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_RECV, &raw mut call) };
            match checked(got.into()) {
                Ok(_) => {
                    let libc::seccomp_data { nr, args, .. } = call.data;
                    let number = i64::from(nr);
                    return Ok(Some(Stopped { id: call.id, thread: call.pid, number, arguments: args }));
                }
                // The thread has been killed meanwhile.
                Err(error) if matches!(error.raw_os_error(), Some(libc::ENOENT | libc::EINTR)) => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Answers a stopped call. That its thread has been killed is no error.
    pub(crate) fn answer(&self, call: Stopped, answer: Answer) -> io::Result<()> {
        let (val, error, flags) = match answer {
            Answer::Proceed => (0, 0, libc::SECCOMP_USER_NOTIF_FLAG_CONTINUE as u32),
            Answer::Error(error) => (0, -error, 0),
            Answer::Value(value) => (value, 0, 0),
        };
        let mut answer = libc::seccomp_notif_resp { id: call.id, val, error, flags };
        // SAFETY: the structure is of this function.
        let sent =
            unsafe { libc::ioctl(self.0.as_raw_fd(), libc::SECCOMP_IOCTL_NOTIF_SEND, &raw mut answer) };
        match checked(sent.into()) {
            Err(error) if error.raw_os_error() != Some(libc::ENOENT) => Err(error),
            _ => Ok(()),
        }
    }
}

impl Stopped {
    /// Reads the memory of the thread.
    pub(crate) fn memory(&self, at: u64, length: usize) -> io::Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        fs::File::open(self.of_system("mem"))?.read_exact_at(&mut bytes, at)?;
        Ok(bytes)
    }

    /// Reads a text that ends with a zero.
    pub(crate) fn text(&self, at: u64) -> io::Result<Vec<u8>> {
        let memory = fs::File::open(self.of_system("mem"))?;
        let mut bytes = vec![0; 4096];
        // What follows the text may not be readable.
        let mut length = memory.read_at(&mut bytes, at)?;
        if let Some(end) = bytes[..length].iter().position(|byte| *byte == 0) {
            length = end;
        }
        bytes.truncate(length);
        Ok(bytes)
    }

    /// A file of the system about the thread.
    pub(crate) fn of_system(&self, name: &str) -> String {
        format!("/proc/{}/{name}", self.thread)
    }

    /// Writes to an open file of the process as the process itself would, which moves its position.
    pub(crate) fn write(&self, descriptor: u64, bytes: &[u8]) -> io::Result<i64> {
        let status = fs::read_to_string(self.of_system("status"))?;
        let process = status.lines().find_map(|line| line.strip_prefix("Tgid:")?.trim().parse::<i64>().ok());
        let process = process.ok_or_else(|| io::Error::other("the thread has no process"))?;
        // SAFETY: numbers alone; both descriptors are then this process's.
        let file = unsafe {
            let process = checked(libc::syscall(libc::SYS_pidfd_open, process, 0))?;
            let process = OwnedFd::from_raw_fd(process as RawFd);
            let file = checked(libc::syscall(libc::SYS_pidfd_getfd, process.as_raw_fd(), descriptor, 0))?;
            OwnedFd::from_raw_fd(file as RawFd)
        };
        // SAFETY: the buffer has that length.
        checked(unsafe { libc::write(file.as_raw_fd(), bytes.as_ptr().cast(), bytes.len()) } as i64)
    }
}
