//! What slices hold: doubles, or floats that are widened on the way in and rounded once on the way out.

use pulp::{Simd, bytemuck};

use super::Lanes;

/// The most doubles that a vector register holds.
const MAX_LANES: usize = 8;

mod sealed {
    pub trait Sealed {}
    impl Sealed for f32 {}
    impl Sealed for f64 {}
}

/// A number in the slices of a batch: `f64` or `f32`.
///
/// Floats are computed with as doubles and rounded once at the end: they save memory, not digits, and have the masks
/// of the single-point functions.
pub trait Element: sealed::Sealed + Copy + Send + Sync + Default + 'static {
    /// As a double.
    fn to_f64(self) -> f64;
    /// From a double, rounded to the nearest.
    fn from_f64(value: f64) -> Self;
    /// As many numbers as a register holds; where there are fewer the rest is zero.
    #[doc(hidden)]
    fn load<S: Simd>(simd: S, from: &[Self]) -> S::f64s;
    /// The first numbers of a register, as many as there is room for.
    #[doc(hidden)]
    fn store<S: Simd>(simd: S, numbers: S::f64s, to: &mut [Self]);
}

impl Element for f64 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        self
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn load<S: Simd>(simd: S, from: &[Self]) -> S::f64s {
        match S::as_simd_f64s(from).0 {
            [whole, ..] => *whole,
            [] => simd.partial_load_f64s(from),
        }
    }
    #[inline(always)]
    fn store<S: Simd>(simd: S, numbers: S::f64s, to: &mut [Self]) {
        if to.len() >= S::F64_LANES {
            S::as_mut_simd_f64s(to).0[0] = numbers;
        } else {
            simd.partial_store_f64s(to, numbers);
        }
    }
}

impl Element for f32 {
    #[inline(always)]
    fn to_f64(self) -> f64 {
        f64::from(self)
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value as f32
    }
    #[inline(always)]
    fn load<S: Simd>(simd: S, from: &[Self]) -> S::f64s {
        const { assert!(S::F64_LANES <= MAX_LANES) };
        let mut wide = [0.0; MAX_LANES];
        // Loops count: the making of an iterator is not always inlined.
        let mut i = 0;
        while i < from.len() {
            wide[i] = f64::from(from[i]);
            i += 1;
        }
        f64::load(simd, &wide[..S::F64_LANES])
    }
    #[inline(always)]
    fn store<S: Simd>(_: S, numbers: S::f64s, to: &mut [Self]) {
        let wide: &[f64] = bytemuck::cast_slice(std::slice::from_ref(&numbers));
        let mut i = 0;
        while i < to.len() {
            to[i] = wide[i] as f32;
            i += 1;
        }
    }
}

impl<S: Simd> Lanes<S> {
    /// As many numbers as the lanes hold; where there are fewer the rest is zero.
    #[inline(always)]
    pub(super) fn load<T: Element>(simd: S, from: &[T]) -> Self {
        let (first, second) = from.split_at(from.len().min(S::F64_LANES));
        Self { simd, v: [T::load(simd, first), T::load(simd, second)] }
    }

    /// The first numbers, as many as there is room for.
    #[inline(always)]
    pub(super) fn store<T: Element>(self, to: &mut [T]) {
        let (first, second) = to.split_at_mut(to.len().min(S::F64_LANES));
        T::store(self.simd, self.v[0], first);
        if !second.is_empty() {
            T::store(self.simd, self.v[1], second);
        }
    }
}
