//! Vectors of f32, as the simulation computes with them: the operations that it needs of a level of
//! vector instructions. Processors with a fused multiply-add use the crate `pulp`; all others use
//! `Portable`.

mod fused;
mod portable;

pub use pulp::bytemuck;
use pulp::bytemuck::Pod;

pub use fused::mul_add;
pub(crate) use portable::Portable;

/// An operation that is compiled for each level; [`Isa::run`](crate::Isa::run) runs it.
pub trait WithSimd {
    /// Its result.
    type Output;

    /// Runs it. Mark the implementation and all that it calls as `#[inline(always)]`.
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output;
}

macro_rules! operations {
    ($(
        $(#[$attribute:meta])*
        fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty;
    )*) => {
        /// A level of vector instructions: vectors of f32, masks, and their operations, lane by
        /// lane. All levels compute the same bits, except the payloads of NaN.
        #[allow(non_camel_case_types, reason = "names of pulp")]
        pub trait Simd: Copy + Send + Sync + 'static {
            /// f32 in each lane.
            type f32s: Pod + std::fmt::Debug + Send + Sync;
            /// u32 in each lane.
            type u32s: Copy;
            /// A truth value in each lane.
            type m32s: Copy;
            /// Number of lanes.
            const F32_LANES: usize = size_of::<Self::f32s>() / size_of::<f32>();
            /// Whether one instruction multiplies and adds. Otherwise, twenty do, which take their
            /// share of a program and of the time to compile it wherever `mul_add_f32s` is called.
            const IS_FUSED: bool = true;

            /// Values as vectors, and the values that do not fill one.
            fn as_simd_f32s(values: &[f32]) -> (&[Self::f32s], &[f32]) {
                let (vectors, rest) = values.split_at(values.len() / Self::F32_LANES * Self::F32_LANES);
                (bytemuck::cast_slice(vectors), rest)
            }
            /// Values as vectors, and the values that do not fill one.
            fn as_mut_simd_f32s(values: &mut [f32]) -> (&mut [Self::f32s], &mut [f32]) {
                let n = values.len() / Self::F32_LANES * Self::F32_LANES;
                let (vectors, rest) = values.split_at_mut(n);
                (bytemuck::cast_slice_mut(vectors), rest)
            }
            $($(#[$attribute])* fn $name(self, $($argument: $type),*) -> $result;)*
        }

        impl<S: pulp::Simd> Simd for S {
            type f32s = S::f32s;
            type u32s = S::u32s;
            type m32s = S::m32s;

            #[inline(always)]
            fn as_simd_f32s(values: &[f32]) -> (&[Self::f32s], &[f32]) {
                <S as pulp::Simd>::as_simd_f32s(values)
            }
            #[inline(always)]
            fn as_mut_simd_f32s(values: &mut [f32]) -> (&mut [Self::f32s], &mut [f32]) {
                <S as pulp::Simd>::as_mut_simd_f32s(values)
            }
            $(
                #[inline(always)]
                fn $name(self, $($argument: $type),*) -> $result {
                    <S as pulp::Simd>::$name(self, $($argument),*)
                }
            )*
        }
    };
}

operations! {
    /// The same value in each lane.
    fn splat_f32s(value: f32) -> Self::f32s;
    /// The same value in each lane.
    fn splat_u32s(value: u32) -> Self::u32s;
    /// a + b
    fn add_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// a - b
    fn sub_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// a * b
    fn mul_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// a / b
    fn div_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// a * b + c, rounded once
    fn mul_add_f32s(a: Self::f32s, b: Self::f32s, c: Self::f32s) -> Self::f32s;
    /// The smaller one; `b` if `a` is NaN.
    fn min_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// The larger one; `b` if `a` is NaN.
    fn max_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// -a
    fn neg_f32s(a: Self::f32s) -> Self::f32s;
    /// The bits that both have.
    fn and_f32s(a: Self::f32s, b: Self::f32s) -> Self::f32s;
    /// The square root.
    fn sqrt_f32s(a: Self::f32s) -> Self::f32s;
    /// a = b
    fn equal_f32s(a: Self::f32s, b: Self::f32s) -> Self::m32s;
    /// a <= b
    fn less_than_or_equal_f32s(a: Self::f32s, b: Self::f32s) -> Self::m32s;
    /// a > b
    fn greater_than_f32s(a: Self::f32s, b: Self::f32s) -> Self::m32s;
    /// a >= b
    fn greater_than_or_equal_f32s(a: Self::f32s, b: Self::f32s) -> Self::m32s;
    /// Both.
    fn and_m32s(a: Self::m32s, b: Self::m32s) -> Self::m32s;
    /// The first lane with a true value; the number of lanes without any.
    fn first_true_m32s(mask: Self::m32s) -> usize;
    /// The first value where the mask is true, the second elsewhere.
    fn select_f32s(mask: Self::m32s, yes: Self::f32s, no: Self::f32s) -> Self::f32s;
    /// The bits of each lane.
    fn transmute_u32s_f32s(a: Self::f32s) -> Self::u32s;
    /// The f32 with these bits in each lane.
    fn transmute_f32s_u32s(a: Self::u32s) -> Self::f32s;
    /// a << n, with n below 32
    fn wrapping_dyn_shl_u32s(a: Self::u32s, n: Self::u32s) -> Self::u32s;
}

/// An operation as `pulp` runs it.
#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
pub(crate) struct ByPulp<Op>(pub Op);

#[cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]
impl<Op: WithSimd> pulp::WithSimd for ByPulp<Op> {
    type Output = Op::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, simd: S) -> Op::Output {
        self.0.with_simd(simd)
    }
}

#[cfg(test)]
mod tests;
