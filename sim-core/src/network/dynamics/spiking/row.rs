//! Arithmetic on W vectors of lanes in step: while the processor waits for one vector, it computes
//! the others. Operators never fuse; only `mul_add` does.

use std::ops::{Add, Div, Mul, Neg, Sub};

use determinism::simd::Simd;

/// A number in each lane of W vectors.
#[derive(Clone, Copy)]
pub(super) struct Row<S: Simd, const W: usize> {
    /// The instructions.
    pub simd: S,
    /// The numbers.
    pub vectors: [S::f32s; W],
}

/// A truth value in each lane of W vectors.
#[derive(Clone, Copy)]
pub(super) struct Mask<S: Simd, const W: usize> {
    simd: S,
    vectors: [S::m32s; W],
}

// The loops are plain because closures would not be inlined into code for an instruction set.

/// A function of two numbers by one instruction.
macro_rules! binary {
    ($(#[$attribute:meta])* $visibility:vis $method:ident = $instruction:ident) => {
        $(#[$attribute])*
        #[inline(always)]
        $visibility fn $method(mut self, other: Self) -> Self {
            for (a, b) in self.vectors.iter_mut().zip(other.vectors) {
                *a = self.simd.$instruction(*a, b);
            }
            self
        }
    };
}

/// A comparison of two numbers by one instruction. NaN compares as false.
macro_rules! comparison {
    ($(#[$attribute:meta])* $method:ident = $instruction:ident) => {
        $(#[$attribute])*
        #[inline(always)]
        pub fn $method(self, other: Self) -> Mask<S, W> {
            let Self { simd, vectors } = self;
            // A mask has no default, so the first one fills the array.
            let mut masks = [simd.$instruction(vectors[0], other.vectors[0]); W];
            for ((mask, a), b) in masks.iter_mut().zip(vectors).zip(other.vectors) {
                *mask = simd.$instruction(a, b);
            }
            Mask { simd, vectors: masks }
        }
    };
}

/// An operator by one instruction.
macro_rules! operator {
    ($trait:ident, $method:ident = $instruction:ident) => {
        impl<S: Simd, const W: usize> $trait for Row<S, W> {
            type Output = Self;
            binary!($method = $instruction);
        }
    };
}

operator!(Add, add = add_f32s);
operator!(Sub, sub = sub_f32s);
operator!(Mul, mul = mul_f32s);
operator!(Div, div = div_f32s);

impl<S: Simd, const W: usize> Neg for Row<S, W> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        for a in &mut self.vectors {
            *a = self.simd.neg_f32s(*a);
        }
        self
    }
}

impl<S: Simd, const W: usize> Row<S, W> {
    /// A row of these vectors.
    #[inline(always)]
    pub fn new(simd: S, vectors: [S::f32s; W]) -> Self {
        Self { simd, vectors }
    }

    /// A number in each lane of W vectors.
    #[inline(always)]
    pub fn splat(simd: S, number: f32) -> Self {
        Self { simd, vectors: [simd.splat_f32s(number); W] }
    }

    /// Another number, in each lane of as many vectors as self has.
    #[inline(always)]
    pub fn constant(self, number: f32) -> Self {
        Self::splat(self.simd, number)
    }

    /// self * factor + term, rounded once.
    #[inline(always)]
    pub fn mul_add(mut self, factor: Self, term: Self) -> Self {
        for ((a, b), c) in self.vectors.iter_mut().zip(factor.vectors).zip(term.vectors) {
            *a = self.simd.mul_add_f32s(*a, b, c);
        }
        self
    }

    /// The greater of self and the bound; the bound where self is NaN.
    #[inline(always)]
    pub fn at_least(self, bound: f32) -> Self {
        self.max(self.constant(bound))
    }

    /// The smaller of self and the bound; the bound where self is NaN.
    #[inline(always)]
    pub fn at_most(self, bound: f32) -> Self {
        self.min(self.constant(bound))
    }

    binary!(
        /// The greater of both; `other` where self is NaN.
        pub max = max_f32s
    );
    binary!(
        /// The smaller of both; `other` where self is NaN.
        pub min = min_f32s
    );
    binary!(
        /// The bits that both have.
        pub common_bits = and_f32s
    );
    comparison!(
        /// self >= other
        reaches = greater_than_or_equal_f32s
    );
    comparison!(
        /// self > other
        exceeds = greater_than_f32s
    );
    comparison!(
        /// self = other
        equals = equal_f32s
    );
}

impl<S: Simd, const W: usize> Mask<S, W> {
    /// The first number where the mask is true, the second elsewhere.
    #[inline(always)]
    pub fn select(self, yes: Row<S, W>, mut no: Row<S, W>) -> Row<S, W> {
        for ((mask, a), b) in self.vectors.into_iter().zip(yes.vectors).zip(&mut no.vectors) {
            *b = self.simd.select_f32s(mask, a, *b);
        }
        no
    }

    /// True where both are.
    #[inline(always)]
    pub fn and(mut self, other: Self) -> Self {
        for (a, b) in self.vectors.iter_mut().zip(other.vectors) {
            *a = self.simd.and_m32s(*a, b);
        }
        self
    }

    /// Where both are true, or both are false.
    #[inline(always)]
    pub fn equals(self, other: Self) -> Self {
        self.as_numbers().equals(other.as_numbers())
    }

    /// 1 where the mask is true, 0 elsewhere.
    #[inline(always)]
    pub fn as_numbers(self) -> Row<S, W> {
        self.select(Row::splat(self.simd, 1.0), Row::splat(self.simd, 0.0))
    }

    /// Whether all lanes are true.
    #[inline(always)]
    pub fn is_all(self) -> bool {
        !self.as_numbers().equals(Row::splat(self.simd, 0.0)).is_any()
    }

    /// Whether any lane is true.
    #[inline(always)]
    pub fn is_any(self) -> bool {
        let mut is_any = false;
        for mask in self.vectors {
            is_any |= self.simd.first_true_m32s(mask) < S::F32_LANES;
        }
        is_any
    }
}

/// Values as rows of W vectors.
#[inline(always)]
pub(super) fn vectors<S: Simd, const W: usize>(values: &[f32]) -> &[[S::f32s; W]] {
    S::as_simd_f32s(values).0.as_chunks().0
}

/// Values as rows of W vectors.
#[inline(always)]
pub(super) fn vectors_mut<S: Simd, const W: usize>(values: &mut [f32]) -> &mut [[S::f32s; W]] {
    S::as_mut_simd_f32s(values).0.as_chunks_mut().0
}
