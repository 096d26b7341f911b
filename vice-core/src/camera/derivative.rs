//! How a pixel answers to its point.

use nalgebra::{Matrix2x3, Point3};

use super::{Camera, Distortion, Model, Pixel, ProjectError};

impl Camera {
    /// [`Camera::project`], with the derivative of the pixel by the point, pixels a metre.
    ///
    /// # Errors
    /// As [`Camera::project`].
    pub(crate) fn project_with_jacobian(
        &self,
        point: &Point3<f64>,
    ) -> Result<(Pixel, Matrix2x3<f64>), ProjectError> {
        let px = self.project(point)?;
        let (x, y) = (point.x / point.z, point.y / point.z);
        let [xx, xy, yx, yy] = match &self.model {
            Model::Pinhole => [1.0, 0.0, 0.0, 1.0],
            Model::Radtan(m) => m.distort_with_jacobian(x, y).1,
            Model::Rational(m) => m.distort_with_jacobian(x, y).1,
            Model::Equidistant(m) => m.distort_with_jacobian(x, y).1,
            Model::DoubleSphere(m) => m.distort_with_jacobian(x, y).1,
            Model::ExtendedUnified(m) => m.distort_with_jacobian(x, y).1,
            Model::Omnidirectional(m) => m.distort_with_jacobian(x, y).1,
            Model::FieldOfView(m) => m.distort_with_jacobian(x, y).1,
        };
        let (u, v) = (self.fx / point.z, self.fy / point.z);
        let jacobian =
            Matrix2x3::new(u * xx, u * xy, -u * (xx * x + xy * y), v * yx, v * yy, -v * (yx * x + yy * y));
        Ok((px, jacobian))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_difference_of_neighbours(x in -0.4..0.4_f64, y in -0.4..0.4_f64, z in 0.3..9.0_f64) {
            for (name, camera) in crate::camera::lenses() {
                let point = Point3::new(x * z, y * z, z);
                let Ok((_, jacobian)) = camera.project_with_jacobian(&point) else { continue };
                for axis in 0..3 {
                    let at = |step: f64| {
                        let mut moved = point;
                        moved[axis] += step * z;
                        camera.project(&moved)
                    };
                    let (Ok(low), Ok(high)) = (at(-1e-5), at(1e-5)) else { continue };
                    let by_difference = [(high.u - low.u) / (2e-5 * z), (high.v - low.v) / (2e-5 * z)];
                    for (row, expected) in by_difference.into_iter().enumerate() {
                        let off = (jacobian[(row, axis)] - expected).abs();
                        prop_assert!(off < 1e-5 * (1.0 + 500.0 / z), "{} {} {}", name, axis, off);
                    }
                }
            }
        }
    }
}
