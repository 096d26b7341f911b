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

/// A rigid transform whose numbers are those of many at once, or of one.
#[derive(Clone, Copy)]
pub(crate) struct Varying<N> {
    ijk: [N; 3],
    w: N,
    translation_m: [N; 3],
}

impl<N: Number> Varying<N> {
    /// Of the numbers that [`numbers_of`] gives.
    #[inline(always)]
    pub(crate) fn of([i, j, k, w, x, y, z]: [N; 7]) -> Self {
        Self { ijk: [i, j, k], w, translation_m: [x, y, z] }
    }

    /// `self * motion`, in the order of operations of [`Rigid`]'s product.
    #[inline(always)]
    pub(crate) fn times(&self, motion: &Motion) -> Self {
        let ([i, j, k], w) = (self.ijk, self.w);
        let ([mi, mj, mk], mw) = (motion.ijk, motion.w);
        Self {
            ijk: [
                w * mi + i * mw + j * mk - k * mj,
                w * mj - i * mk + j * mw + k * mi,
                w * mk + i * mj - j * mi + k * mw,
            ],
            w: w * mw - i * mi - j * mj - k * mk,
            translation_m: self.apply(motion.translation_m),
        }
    }

    /// A rotation of many points, or of one, in the order of operations of a unit quaternion's product with a vector.
    #[inline(always)]
    pub(crate) fn turn([i, j, k, w]: [N; 4], [x, y, z]: [N; 3]) -> [N; 3] {
        let (a, b, c) = ((j * z - k * y) * 2.0, (k * x - i * z) * 2.0, (i * y - j * x) * 2.0);
        [a * w + (j * c - k * b) + x, b * w + (k * a - i * c) + y, c * w + (i * b - j * a) + z]
    }

    /// [`Motion::apply`] to one point.
    #[inline(always)]
    pub(crate) fn apply(&self, [x, y, z]: [f64; 3]) -> [N; 3] {
        let ([i, j, k], w, [tx, ty, tz]) = (self.ijk, self.w, self.translation_m);
        let (a, b, c) = ((j * z - k * y) * 2.0, (k * x - i * z) * 2.0, (i * y - j * x) * 2.0);
        [a * w + (j * c - k * b) + x + tx, b * w + (k * a - i * c) + y + ty, c * w + (i * b - j * a) + z + tz]
    }
}

/// The numbers of a rigid transform: i, j, k, w of the unit quaternion, then the translation.
pub(crate) fn numbers_of<D, S>(dst_from_src: &Rigid<D, S>) -> [f64; 7] {
    let Motion { ijk: [i, j, k], w, translation_m: [x, y, z] } = Motion::new(dst_from_src);
    [i, j, k, w, x, y, z]
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
