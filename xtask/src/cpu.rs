//! Seconds of the processor, by the account of the system. The benchmark contains this file as well.

use std::io;

/// User and system time of this process so far, and of those that it has waited for.
#[cfg(unix)]
pub(crate) fn used_s() -> io::Result<f64> {
    let of = |whose| {
        let mut usage = std::mem::MaybeUninit::<libc::rusage>::zeroed();
        #[expect(unsafe_code, reason = "the standard library does not have this call")]
        // SAFETY: the call writes one `rusage` to the given place, which is large enough; all of its
        // fields are integers, for which zeros are valid.
        let (code, usage) = unsafe {
            let code = libc::getrusage(whose, usage.as_mut_ptr());
            (code, usage.assume_init())
        };
        let seconds = |time: libc::timeval| time.tv_sec as f64 + time.tv_usec as f64 * 1e-6;
        if code == 0 {
            Ok(seconds(usage.ru_utime) + seconds(usage.ru_stime))
        } else {
            Err(io::Error::last_os_error())
        }
    };
    Ok(of(libc::RUSAGE_SELF)? + of(libc::RUSAGE_CHILDREN)?)
}

#[cfg(not(unix))]
pub(crate) fn used_s() -> io::Result<f64> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "only Unix reports it"))
}
