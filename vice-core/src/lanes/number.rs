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

/// Registers that are worked on in turn: a formula waits for each of its steps, and two of them fill the waits of each
/// other.
pub(super) const REGISTERS: usize = 2;

/// Two vector registers of doubles of the instruction set `S`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<S: Simd> {
    pub(super) simd: S,
    pub(super) v: [S::f64s; REGISTERS],
}

/// Yes or no for each number of [`Lanes`].
pub(crate) type Yes<S> = [<S as Simd>::m64s; REGISTERS];

impl<S: Simd> Number for Lanes<S> {
    type Mask = Yes<S>;
    #[inline(always)]
    fn of(self, constant: f64) -> Self {
        Self::splat(self.simd, constant)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let Self { simd, v: [a, b] } = self;
        Self { simd, v: [simd.sqrt_f64s(a), simd.sqrt_f64s(b)] }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // `abs_f64s` is not always inlined, and would cost a call and a spill of all registers.
        let Self { simd, v: [a, b] } = self;
        let zero = simd.splat_f64s(0.0);
        let (minus_a, minus_b) = (simd.sub_f64s(zero, a), simd.sub_f64s(zero, b));
        Self { simd, v: [simd.max_f64s(a, minus_a), simd.max_f64s(b, minus_b)] }
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
    fn at_most(self, other: Self) -> Yes<S> {
        let (simd, [a, b], [c, d]) = (self.simd, self.v, other.v);
        [simd.less_than_or_equal_f64s(a, c), simd.less_than_or_equal_f64s(b, d)]
    }
    #[inline(always)]
    fn below(self, other: Self) -> Yes<S> {
        let (simd, [a, b], [c, d]) = (self.simd, self.v, other.v);
        [simd.less_than_f64s(a, c), simd.less_than_f64s(b, d)]
    }
    #[inline(always)]
    fn select(mask: Yes<S>, yes: Self, no: Self) -> Self {
        let (simd, [a, b], [c, d]) = (yes.simd, yes.v, no.v);
        Self { simd, v: [simd.select_f64s(mask[0], a, c), simd.select_f64s(mask[1], b, d)] }
    }
    #[inline(always)]
    fn both(self, a: Yes<S>, b: Yes<S>) -> Yes<S> {
        [self.simd.and_m64s(a[0], b[0]), self.simd.and_m64s(a[1], b[1])]
    }
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(super) fn splat(simd: S, constant: f64) -> Self {
        Self { simd, v: [simd.splat_f64s(constant); REGISTERS] }
    }

    #[inline(always)]
    pub(crate) fn negated(self, mask: Yes<S>) -> Yes<S> {
        [self.simd.not_m64s(mask[0]), self.simd.not_m64s(mask[1])]
    }

    /// Whether any number has a yes.
    #[inline(always)]
    pub(crate) fn any(self, mask: Yes<S>) -> bool {
        self.simd.first_true_m64s(self.simd.or_m64s(mask[0], mask[1])) < S::F64_LANES
    }
}

macro_rules! operator {
    ($($operator:ident $name:ident $of_lanes:ident),*) => {$(
        impl<S: Simd> $operator for Lanes<S> {
            type Output = Self;
            #[inline(always)]
            fn $name(self, other: Self) -> Self {
                let (simd, [a, b], [c, d]) = (self.simd, self.v, other.v);
                Self { simd, v: [simd.$of_lanes(a, c), simd.$of_lanes(b, d)] }
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
