//! Many points at once, in structure-of-arrays form.

use pulp::Simd;

use super::Rigid;
use crate::lanes::{Element, Kernel, Lanes, Masked, Number, run};

/// The numbers of a rigid transform.
#[derive(Clone, Copy)]
pub(crate) struct Motion {
    /// Of the unit quaternion.
    ijk: [f64; 3],
    w: f64,
    translation_m: [f64; 3],
}

impl Motion {
    pub(crate) fn new<D, S>(dst_from_src: &Rigid<D, S>) -> Self {
        let q = dst_from_src.rotation().into_inner();
        Self { ijk: [q.i, q.j, q.k], w: q.w, translation_m: dst_from_src.translation().into() }
    }

    /// `v + 2 w (q × v) + 2 q × (q × v) + t`, in the order of operations of [`Rigid::transform_point`].
    #[inline(always)]
    pub(crate) fn apply<N: Number>(&self, [x, y, z]: [N; 3]) -> [N; 3] {
        let ([i, j, k], w, [tx, ty, tz]) = (self.ijk, self.w, self.translation_m);
        let (a, b, c) = ((z * j - y * k) * 2.0, (x * k - z * i) * 2.0, (y * i - x * j) * 2.0);
        [a * w + (c * j - b * k) + x + tx, b * w + (a * k - c * i) + y + ty, c * w + (b * i - a * j) + z + tz]
    }
}

#[derive(Clone, Copy)]
struct Transform(Motion);

impl Kernel<0, 3> for Transform {
    #[inline(always)]
    fn lanes<S: Simd>(&self, xyz_m: [Lanes<S>; 3], _: [Lanes<S>; 0]) -> Masked<S, 3> {
        let [x, ..] = xyz_m;
        Masked { numbers: self.0.apply(xyz_m), valid: x.of(0.0).below(x.of(1.0)), unsure: None }
    }

    fn single(&self, xyz_m: [f64; 3], _: [f64; 0]) -> Option<[f64; 3]> {
        Some(self.0.apply(xyz_m))
    }
}

impl<Dst, Src> Rigid<Dst, Src> {
    /// [`Rigid::transform_point`] for the points `(x[i], y[i], z[i])`, metres, which are replaced.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn transform_batch<T: Element>(&self, xyz_m: [&mut [T]; 3]) {
        run("transform_batch", Transform(Motion::new(self)), [], xyz_m, None);
    }
}
