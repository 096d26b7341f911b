//! What formulas are written in: one number, or as many as a vector register holds.

use std::ops::{Add, Div, Mul, Sub};

use pulp::Simd;

/// A real number, or several side by side on which each operation works at once. Constants are plain `f64`.
pub(crate) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
{
    /// Yes or no for each number.
    type Mask: Copy;
    /// The constant, as many times as `self` has numbers.
    fn of(self, constant: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// The arc tangent of a number that is not negative.
    fn atan(self) -> Self;
    /// The tangent of an angle from 0 to below a right one, radians.
    fn tan(self) -> Self;
    /// `self <= other`; no where one is NaN.
    fn at_most(self, other: Self) -> Self::Mask;
    /// `self < other`; no where one is NaN.
    fn below(self, other: Self) -> Self::Mask;
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
    fn both(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
}

impl Number for f64 {
    type Mask = bool;
    #[inline(always)]
    fn of(self, constant: f64) -> Self {
        constant
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn atan(self) -> Self {
        // Not the standard library's: one point and many have the same bits.
        super::atan::atan(self)
    }
    #[inline(always)]
    fn tan(self) -> Self {
        super::tan::tan(self)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn below(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    #[inline(always)]
    fn both(self, a: bool, b: bool) -> bool {
        a & b
    }
}

/// A vector register of doubles of the instruction set `S`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<S: Simd> {
    pub(super) simd: S,
    pub(super) v: S::f64s,
}

impl<S: Simd> Number for Lanes<S> {
    type Mask = S::m64s;
    #[inline(always)]
    fn of(self, constant: f64) -> Self {
        Self { simd: self.simd, v: self.simd.splat_f64s(constant) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self { simd: self.simd, v: self.simd.sqrt_f64s(self.v) }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // `abs_f64s` is not always inlined, and would cost a call and a spill of all registers.
        let negative = self.simd.sub_f64s(self.simd.splat_f64s(0.0), self.v);
        Self { simd: self.simd, v: self.simd.max_f64s(self.v, negative) }
    }
    #[inline(always)]
    fn atan(self) -> Self {
        super::atan::atan(self)
    }
    #[inline(always)]
    fn tan(self) -> Self {
        super::tan::tan(self)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> S::m64s {
        self.simd.less_than_or_equal_f64s(self.v, other.v)
    }
    #[inline(always)]
    fn below(self, other: Self) -> S::m64s {
        self.simd.less_than_f64s(self.v, other.v)
    }
    #[inline(always)]
    fn select(mask: S::m64s, yes: Self, no: Self) -> Self {
        Self { simd: yes.simd, v: yes.simd.select_f64s(mask, yes.v, no.v) }
    }
    #[inline(always)]
    fn both(self, a: S::m64s, b: S::m64s) -> S::m64s {
        self.simd.and_m64s(a, b)
    }
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn negated(self, mask: S::m64s) -> S::m64s {
        self.simd.not_m64s(mask)
    }

    /// Whether any number has a yes.
    #[inline(always)]
    pub(crate) fn any(self, mask: S::m64s) -> bool {
        self.simd.first_true_m64s(mask) < S::F64_LANES
    }
}

macro_rules! operator {
    ($($operator:ident $name:ident $of_lanes:ident),*) => {$(
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                Self { simd: self.simd, v: self.simd.$of_lanes(self.v, other.v) }
            }
        }
        impl<S: Simd> $operator<f64> for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, constant: f64) -> Self {
                self.$name(self.of(constant))
            }
        }
    )*};
}

operator!(Add add add_f64s, Sub sub sub_f64s, Mul mul mul_f64s, Div div div_f64s);
