//! A library to be loaded before a program (`LD_PRELOAD`), which refuses it memory: allocation number
//! `REFUSE_AT` after the program first opened one of its inputs, counted from 1, and with `REFUSE_ON` all that
//! follow. At the end the number of allocations is written to the file `REFUSE_COUNT`.
#![expect(unsafe_code, reason = "these functions replace those of the C library")]

use std::ffi::{CStr, c_char, c_int, c_void};
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

static COUNTS: AtomicBool = AtomicBool::new(false);
static COUNT: AtomicU64 = AtomicU64::new(0);
static AT: AtomicU64 = AtomicU64::new(u64::MAX);
static LASTS: AtomicBool = AtomicBool::new(false);

unsafe extern "C" {
    fn __libc_malloc(size: usize) -> *mut c_void;
    fn __libc_calloc(count: usize, size: usize) -> *mut c_void;
    fn __libc_realloc(old: *mut c_void, size: usize) -> *mut c_void;
    fn __libc_memalign(align: usize, size: usize) -> *mut c_void;
}

/// Counts an allocation; whether it is refused. Allocates nothing itself.
fn is_refused() -> bool {
    if !COUNTS.load(Ordering::Relaxed) {
        return false;
    }
    let number = COUNT.fetch_add(1, Ordering::Relaxed) + 1;
    let at = AT.load(Ordering::Relaxed);
    let is_refused = number == at || (number > at && LASTS.load(Ordering::Relaxed));
    if is_refused {
        // SAFETY: the address of this thread's variable.
        unsafe { *libc::__errno_location() = libc::ENOMEM };
    }
    is_refused
}

#[unsafe(no_mangle)]
unsafe extern "C" fn malloc(size: usize) -> *mut c_void {
    // SAFETY: as the C library has it.
    if is_refused() { null_mut() } else { unsafe { __libc_malloc(size) } }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn calloc(count: usize, size: usize) -> *mut c_void {
    // SAFETY: as the C library has it.
    if is_refused() { null_mut() } else { unsafe { __libc_calloc(count, size) } }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn realloc(old: *mut c_void, size: usize) -> *mut c_void {
    // SAFETY: as the C library has it.
    if is_refused() { null_mut() } else { unsafe { __libc_realloc(old, size) } }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn posix_memalign(out: *mut *mut c_void, align: usize, size: usize) -> c_int {
    if is_refused() {
        return libc::ENOMEM;
    }
    // SAFETY: as the C library has it.
    unsafe { *out = __libc_memalign(align, size) };
    // SAFETY: the caller's, which was just written.
    if unsafe { *out }.is_null() { libc::ENOMEM } else { 0 }
}

#[unsafe(no_mangle)]
unsafe extern "C" fn aligned_alloc(align: usize, size: usize) -> *mut c_void {
    // SAFETY: as the C library has it.
    if is_refused() { null_mut() } else { unsafe { __libc_memalign(align, size) } }
}

/// The inputs have relative paths; the libraries and the system's files have not.
#[unsafe(no_mangle)]
unsafe extern "C" fn open64(path: *const c_char, flags: c_int, mode: libc::mode_t) -> c_int {
    // SAFETY: a text of the caller's, which ends with a zero; it has one character at least.
    if unsafe { *path } != b'/' as c_char && !COUNTS.load(Ordering::Relaxed) {
        AT.store(variable(c"REFUSE_AT").unwrap_or(u64::MAX), Ordering::Relaxed);
        LASTS.store(variable(c"REFUSE_ON").is_some(), Ordering::Relaxed);
        COUNTS.store(true, Ordering::Relaxed);
    }
    // SAFETY: the caller's arguments.
    unsafe { libc::syscall(libc::SYS_openat, libc::AT_FDCWD, path, flags, mode) as c_int }
}

/// A number of the environment.
fn variable(name: &CStr) -> Option<u64> {
    // SAFETY: the environment is not changed by the program.
    let text = unsafe { libc::getenv(name.as_ptr()) };
    if text.is_null() {
        return None;
    }
    // SAFETY: a text of the environment.
    unsafe { CStr::from_ptr(text) }.to_str().ok()?.parse().ok()
}

extern "C" fn report() {
    COUNTS.store(false, Ordering::Relaxed);
    // SAFETY: the file is named by a text of the environment; the digits have the length given.
    unsafe {
        let path = libc::getenv(c"REFUSE_COUNT".as_ptr());
        if !path.is_null() {
            let count = COUNT.load(Ordering::Relaxed).to_string();
            let flags = libc::O_WRONLY | libc::O_CREAT | libc::O_TRUNC;
            let file = libc::syscall(libc::SYS_openat, libc::AT_FDCWD, path, flags, 0o600) as c_int;
            libc::write(file, count.as_ptr().cast(), count.len());
        }
    }
}

#[used]
#[unsafe(link_section = ".fini_array")]
static AT_THE_END: extern "C" fn() = report;
