//! Many points at once, in structure-of-arrays form.
//!
//! The single-point functions are the definition; these give the same numbers for slices, without allocating.

use nalgebra::Point3;

use super::{Camera, Pixel};

impl Camera {
    /// Projects the points `(x[i], y[i], z[i])` of the camera frame (metres) to the pixels `(u[i], v[i])`.
    ///
    /// Where a point does not project, `valid[i]` is false and the pixel NaN. Returns how many are valid.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn project_batch(
        &self,
        [x, y, z]: [&[f64]; 3],
        [u, v]: [&mut [f64]; 2],
        valid: &mut [bool],
    ) -> usize {
        let n = x.len();
        assert!(
            [y.len(), z.len(), u.len(), v.len(), valid.len()].iter().all(|len| *len == n),
            "project_batch: slices differ in length"
        );
        let mut count = 0;
        for i in 0..n {
            let pixel = self.project(&Point3::new(x[i], y[i], z[i]));
            valid[i] = pixel.is_ok();
            count += usize::from(valid[i]);
            let pixel = pixel.unwrap_or(Pixel::new(f64::NAN, f64::NAN));
            (u[i], v[i]) = (pixel.u, pixel.v);
        }
        count
    }

    /// The rays `(x[i], y[i], 1)` of the pixels `(u[i], v[i])`.
    ///
    /// Where a pixel has no ray, `valid[i]` is false and the ray NaN. Returns how many are valid.
    ///
    /// # Panics
    /// If the slices differ in length.
    pub fn unproject_batch(&self, [u, v]: [&[f64]; 2], [x, y]: [&mut [f64]; 2], valid: &mut [bool]) -> usize {
        let n = u.len();
        assert!(
            [v.len(), x.len(), y.len(), valid.len()].iter().all(|len| *len == n),
            "unproject_batch: slices differ in length"
        );
        let mut count = 0;
        for i in 0..n {
            let ray = self.unproject(Pixel::new(u[i], v[i]));
            valid[i] = ray.is_ok();
            count += usize::from(valid[i]);
            (x[i], y[i]) = ray.map_or((f64::NAN, f64::NAN), |r| (r.x, r.y));
        }
        count
    }
}
