//! Many numbers side by side: how the batches of [`crate::camera`], [`crate::frames`] and [`crate::track`] reach the
//! speed of the machine.
//!
//! A formula is written once for any `Number`. For `f64` it is the single-point function; for `Lanes` it works on a
//! whole vector register of points. A `Kernel` is such a formula from numbers of a point to numbers of a point, and
//! `run` drives it over slices: the widest instruction set is found out once while the program runs, points pass
//! memory once, nothing is allocated, and from a measured size on all threads share the work.
//!
//! Additions and products are never contracted, so that a point has the same bits in every instruction set, at every
//! place of a slice and with any number of threads.

mod atan;
mod drive;
mod element;
mod number;
mod tan;

pub(crate) use drive::{Kernel, Masked, run};
pub use element::Element;
pub(crate) use number::{Lanes, Number, Yes};

use std::sync::LazyLock;

use pulp::{Arch, Simd, WithSimd};

use crate::instructions::Instructions;

/// Found once: asking the processor for each batch would cost more than a small batch does.
pub(crate) static ARCH: LazyLock<Arch> = LazyLock::new(|| match Instructions::in_use() {
    Instructions::Scalar => Arch::Scalar,
    #[cfg(target_arch = "x86_64")]
    Instructions::V3 => pulp::x86::V3::try_new().map_or(Arch::Scalar, Arch::V3),
    _ => Arch::new(),
});

/// The instruction set that batches run with, and how many doubles it works on at a time, such as `V4, 8 doubles`.
///
/// It is told from within the dispatched code, not from what the processor claims. `V3` is AVX2 with FMA, `V4` AVX-512.
pub fn instruction_set() -> String {
    struct Tell;
    impl WithSimd for Tell {
        type Output = String;
        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> String {
            let name = std::any::type_name::<S>().rsplit("::").next().unwrap_or_default();
            format!("{name}, {} doubles", S::F64_LANES)
        }
    }
    ARCH.dispatch(Tell)
}

#[cfg(test)]
mod tests;
