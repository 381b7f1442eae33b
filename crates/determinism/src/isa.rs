//! The vector instructions that the simulation uses. They change only its speed: every level
//! computes the same bits.

use std::fmt;
use std::str::FromStr;
#[cfg(target_arch = "x86_64")]
use std::sync::LazyLock;

#[cfg(target_arch = "aarch64")]
use pulp::aarch64::Neon;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
use crate::simd::ByPulp;
use crate::simd::{Portable, Simd, WithSimd};

/// A level of vector instructions that this processor has.
#[derive(Clone, Copy)]
pub struct Isa {
    level: Level,
    avoids_subnormals: bool,
}

#[derive(Clone, Copy)]
enum Level {
    /// Without a fused multiply-add; all others have one.
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2(V3),
    #[cfg(target_arch = "x86_64")]
    Avx512(V4),
    #[cfg(target_arch = "aarch64")]
    Neon(Neon),
}

impl Isa {
    /// The fastest level of this processor.
    pub fn best() -> Self {
        *Self::available().last().expect("every processor has the portable level")
    }

    /// All levels of this processor, the slowest first.
    pub fn available() -> Vec<Self> {
        let portable = [Level::Portable].into_iter();
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        let levels = portable;
        #[cfg(target_arch = "x86_64")]
        let levels =
            portable.chain(V3::try_new().map(Level::Avx2)).chain(V4::try_new().map(Level::Avx512));
        #[cfg(target_arch = "aarch64")]
        let levels = portable.chain(Neon::try_new().map(Level::Neon));
        levels.map(|level| Self { level, avoids_subnormals: is_slow_with(level) }).collect()
    }

    /// `portable`, `avx2` (with FMA), `avx512` or `neon`.
    pub fn name(self) -> &'static str {
        match self.level {
            Level::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(_) => "avx2",
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(_) => "avx512",
            #[cfg(target_arch = "aarch64")]
            Level::Neon(_) => "neon",
        }
    }

    /// Runs an operation, compiled for this level.
    pub fn run<Op: WithSimd>(self, operation: Op) -> Op::Output {
        // `pulp::Arch` would compile it for scalar numbers as well, which no level needs.
        match self.level {
            Level::Portable => operation.with_simd(Portable),
            #[cfg(target_arch = "x86_64")]
            Level::Avx2(simd) => pulp::Simd::vectorize(simd, ByPulp(operation)),
            #[cfg(target_arch = "x86_64")]
            Level::Avx512(simd) => pulp::Simd::vectorize(simd, ByPulp(operation)),
            #[cfg(target_arch = "aarch64")]
            Level::Neon(simd) => pulp::Simd::vectorize(simd, ByPulp(operation)),
        }
    }

    /// Whether one instruction multiplies and adds.
    pub fn is_fused(self) -> bool {
        !matches!(self.level, Level::Portable)
    }

    /// Whether products with subnormal numbers, those below 2^-126, are so slow on this processor
    /// that a detour around them is worth twice the instructions. True for Intel's.
    pub fn avoids_subnormals(self) -> bool {
        self.avoids_subnormals
    }

    /// This level, with detours around subnormal numbers or without them.
    pub fn avoiding_subnormals(self, avoids_subnormals: bool) -> Self {
        Self { avoids_subnormals, ..self }
    }

    /// Number of f32 lanes per vector.
    pub fn vector_len(self) -> usize {
        struct VectorLen;
        impl WithSimd for VectorLen {
            type Output = usize;
            fn with_simd<S: Simd>(self, _simd: S) -> usize {
                S::F32_LANES
            }
        }
        self.run(VectorLen)
    }
}

/// Whether this processor takes a hundred cycles and more for a product with a subnormal number.
/// Detours have fused multiply-adds, so that the portable level has none.
#[cfg(target_arch = "x86_64")]
fn is_slow_with(level: Level) -> bool {
    static IS_INTEL: LazyLock<bool> = LazyLock::new(|| {
        let vendor = raw_cpuid::CpuId::new().get_vendor_info();
        vendor.is_some_and(|vendor| vendor.as_str() == "GenuineIntel")
    });
    !matches!(level, Level::Portable) && *IS_INTEL
}

#[cfg(not(target_arch = "x86_64"))]
fn is_slow_with(_: Level) -> bool {
    false
}

impl fmt::Debug for Isa {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl fmt::Display for Isa {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The error of [`Isa::from_str`]: this processor lacks the level, or no level has this name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("this processor offers {available}, not {name:?}")]
pub struct UnknownIsa {
    name: String,
    available: String,
}

impl FromStr for Isa {
    type Err = UnknownIsa;

    fn from_str(name: &str) -> Result<Self, UnknownIsa> {
        let levels = Self::available();
        levels.iter().find(|level| level.name() == name).copied().ok_or_else(|| UnknownIsa {
            name: name.to_owned(),
            available: levels.iter().map(|level| level.name()).collect::<Vec<_>>().join(", "),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_found_by_their_names_and_the_best_is_the_last() {
        for isa in Isa::available() {
            assert_eq!(isa.name().parse::<Isa>().unwrap().name(), isa.name());
        }
        assert_eq!(Isa::available().last().unwrap().name(), Isa::best().name());
        let error = "abacus".parse::<Isa>().unwrap_err().to_string();
        assert!(error.contains("portable") && error.contains("abacus"), "{error}");
    }
}
