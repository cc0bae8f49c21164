//! The instruction sets for which kernels are compiled, and the choice among them at run time.

use std::hint::select_unpredictable;

/// The version of the kernels that this machine runs fastest.
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

/// Defines a kernel, its compilation for each instruction set, and the method that chooses among them. Generic parameters
/// stand in brackets behind its name.
macro_rules! kernel {
    (
        $(#[$doc:meta])*
        fn $name:ident $([$($parameters:tt)*])? ($($argument:ident: $type:ty),* $(,)?) $(-> $result:ty)? $body:block
    ) => {
        #[inline(always)]
        fn $name$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? $body

        impl $crate::kernels::simd::Simd {
        $(#[$doc])*
        pub(crate) fn $name$(<$($parameters)*>)?(self, $($argument: $type),*) $(-> $result)? {
            // Not inlined, since it would increase the register pressure of callers that use several
            // kernels.
            #[inline(never)]
            fn baseline$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                $name($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn avx2$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                $name($($argument),*)
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx512f,avx512vl,avx512dq")]
            fn avx512$(<$($parameters)*>)?($($argument: $type),*) $(-> $result)? {
                $name($($argument),*)
            }
            #[cfg_attr(
                target_arch = "x86_64",
                expect(unsafe_code, reason = "only constructed by `available`, which asked the processor")
            )]
            match self {
                Simd::Baseline => baseline($($argument),*),
                #[cfg(target_arch = "x86_64")]
                Simd::Avx2 => unsafe { avx2($($argument),*) },
                #[cfg(target_arch = "x86_64")]
                Simd::Avx512 => unsafe { avx512($($argument),*) },
            }
        }
        }
    };
}

pub(super) use kernel;

impl Simd {
    /// All versions that this machine can run, the fastest last.
    pub(crate) fn available() -> Vec<Simd> {
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

    /// The fastest version that this machine can run.
    pub(crate) fn detect() -> Simd {
        *Simd::available().last().expect("every machine can run the baseline")
    }
}

/// The sign of a velocity; 0 for 0, where `v / |v|` would be NaN.
#[inline]
pub(super) fn sign(velocity: f64) -> f64 {
    select_unpredictable(velocity.abs() > 0.0, 1f64.copysign(velocity), 0.0)
}
