//! The instruction sets for which kernels are compiled, and the choice among them at run time.

use std::hint::select_unpredictable;
use std::sync::OnceLock;

/// A version of the kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Simd {
    /// Supported by every machine.
    Baseline,
    /// 256-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// 512-bit vectors.
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

/// Defines a kernel, its compilation for each instruction set, and the choice among them. Generic parameters stand in
/// brackets behind its name.
macro_rules! kernel {
    (
        $(#[$doc:meta])*
        fn $name:ident $([$($parameters:tt)*])? ($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block
    ) => {
        $(#[$doc])*
        pub(crate) fn $name$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
            #[inline(always)]
            fn body$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? $body
            // Not inlined, since it would increase the register pressure of callers that use several
            // kernels.
            #[inline(never)]
            fn baseline$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                body($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                body($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
            fn avx512$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                body($($argument),*)
            }
            #[cfg_attr(
                target_arch = "x86_64",
                expect(unsafe_code, reason = "only constructed by `available`, which asked the processor")
            )]
            match $crate::kernels::simd::Simd::of_this_machine() {
                $crate::kernels::simd::Simd::Baseline => baseline($($argument),*),
                #[cfg(target_arch = "x86_64")]
                $crate::kernels::simd::Simd::Avx2 => unsafe { avx2($($argument),*) },
                #[cfg(target_arch = "x86_64")]
                $crate::kernels::simd::Simd::Avx512 => unsafe { avx512($($argument),*) },
            }
        }
    };
}

pub(super) use kernel;

impl Simd {
    /// All versions that this machine can run, the fastest last.
    fn available() -> Vec<Simd> {
        let mut versions = vec![Simd::Baseline];
        #[cfg(target_arch = "x86_64")]
        {
            if std::arch::is_x86_feature_detected!("avx2") {
                versions.push(Simd::Avx2);
            }
            if std::arch::is_x86_feature_detected!("avx512f")
                && std::arch::is_x86_feature_detected!("avx512vl")
                && std::arch::is_x86_feature_detected!("avx512dq")
            {
                versions.push(Simd::Avx512);
            }
        }
        versions
    }

    /// The fastest version that this machine can run; in a test, the one that is tried.
    #[inline]
    pub(super) fn of_this_machine() -> Simd {
        #[cfg(test)]
        if let Some(tried) = tests::TRIED.get() {
            return tried;
        }
        static FASTEST: OnceLock<Simd> = OnceLock::new();
        *FASTEST.get_or_init(|| *Simd::available().last().expect("every machine can run the baseline"))
    }
}

/// The sign of a velocity; 0 for 0, where `v / |v|` would be NaN.
#[inline]
pub(super) fn sign(velocity: f64) -> f64 {
    select_unpredictable(velocity.abs() > 0.0, 1f64.copysign(velocity), 0.0)
}

#[cfg(test)]
pub(crate) mod tests {
    use std::cell::Cell;
    use std::fmt::Debug;

    use super::Simd;

    thread_local! {
        /// The version that this thread uses.
        pub(super) static TRIED: Cell<Option<Simd>> = const { Cell::new(None) };
    }

    /// What a test computes with every instruction set that this machine has, which must be the same.
    pub(crate) fn by_all<T: PartialEq + Debug>(compute: impl Fn() -> T) -> T {
        let mut by_baseline = None;
        for simd in Simd::available() {
            TRIED.set(Some(simd));
            let found = compute();
            TRIED.set(None);
            if let Some(by_baseline) = &by_baseline {
                assert!(found == *by_baseline, "{simd:?}: {found:?} {by_baseline:?}");
            }
            by_baseline.get_or_insert(found);
        }
        by_baseline.expect("every machine can run the baseline")
    }
}
