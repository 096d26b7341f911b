//! Pictures of calibration targets of which the corners are known: tags and chessboards, tilted, blurred, noisy.
//!
//! Every pixel is the mean of rays spread over it and, for blur, around it; noise and rounding come last, as in a camera.

use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use vice_core::camera::{Camera, Pixel};
use vice_core::dataset::{Image, PixelFormat};
use vice_core::error::{DataError, DataResult};
use vice_core::random::SplitMix;

use crate::hash::{hash, unit};

/// Rays along each side of a pixel.
const RAYS: i32 = 4;

/// A flat target of square cells, dark or white, on white paper.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Cells along a row.
    pub columns: usize,
    /// White cells, row by row.
    pub white: Vec<bool>,
    /// Width of a cell, metres.
    pub cell_m: f64,
    /// Width of the paper around the cells, metres.
    pub margin_m: f64,
    /// Takes coordinates of the target (origin at its centre, x right and y down on the printed side, z away from the
    /// viewer) to the camera's frame, metres.
    pub camera_from_target: Isometry3<f64>,
}

/// How a picture is taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Standard deviation of the blur, pixels.
    pub blur_px: f64,
    /// Standard deviation of the noise, gray levels.
    pub noise: f64,
    /// Gray level of dark cells.
    pub dark: f64,
    /// Gray level of paper.
    pub bright: f64,
    /// Decides noise and background.
    pub seed: u64,
}

impl Default for Shot {
    fn default() -> Self {
        Self { blur_px: 0.7, noise: 2.0, dark: 40.0, bright: 200.0, seed: 1 }
    }
}

impl Target {
    /// A target from its cells, row by row, true where white.
    ///
    /// # Errors
    /// [`DataError`] if the cells are no full rows or a width is not positive.
    pub fn new(
        columns: usize,
        white: Vec<bool>,
        cell_m: f64,
        camera_from_target: Isometry3<f64>,
    ) -> DataResult<Self> {
        if columns == 0 || white.is_empty() || !white.len().is_multiple_of(columns) {
            return Err(DataError::new(format!("{} cells are no rows of {columns}", white.len())));
        }
        if !(cell_m > 0.0 && cell_m.is_finite()) {
            return Err(DataError::new("the width of a cell is not positive"));
        }
        Ok(Self { columns, white, cell_m, margin_m: 2.0 * cell_m, camera_from_target })
    }

    /// A chessboard of so many squares, dark at the top left.
    ///
    /// # Errors
    /// As [`Target::new`].
    pub fn chessboard(
        columns: usize,
        rows: usize,
        square_m: f64,
        camera_from_target: Isometry3<f64>,
    ) -> DataResult<Self> {
        let white = (0..rows).flat_map(|r| (0..columns).map(move |c| (r + c) % 2 == 1)).collect();
        Self::new(columns, white, square_m, camera_from_target)
    }

    /// Rows of cells.
    pub fn rows(&self) -> usize {
        self.white.len() / self.columns
    }

    /// The point between cells, so many columns and rows from the top left, in the camera's frame.
    pub fn point(&self, column: f64, row: f64) -> Point3<f64> {
        let x = (column - self.columns as f64 / 2.0) * self.cell_m;
        let y = (row - self.rows() as f64 / 2.0) * self.cell_m;
        self.camera_from_target * Point3::new(x, y, 0.0)
    }

    /// The pixel of that point; `None` where the camera does not see it.
    pub fn pixel(&self, camera: &Camera, column: f64, row: f64) -> Option<Pixel> {
        camera.project(&self.point(column, row)).ok().filter(|px| camera.contains(*px))
    }

    /// Distance along a ray and what is there: `None` beside the paper, else whether it is white.
    fn hit(&self, target_from_camera: &Isometry3<f64>, ray: &Vector3<f64>) -> Option<(f64, bool)> {
        let (eye, way) = (target_from_camera.translation.vector, target_from_camera.rotation * ray);
        // Only the printed side is seen: its viewer looks along z.
        if way.z <= 1e-9 || eye.z >= 0.0 {
            return None;
        }
        let distance = -eye.z / way.z;
        let at = eye + way * distance;
        let (w, h) = (self.columns as f64, self.rows() as f64);
        let (c, r) = (at.x / self.cell_m + w / 2.0, at.y / self.cell_m + h / 2.0);
        let margin = self.margin_m / self.cell_m;
        if c < -margin || r < -margin || c > w + margin || r > h + margin {
            return None;
        }
        let inside = c >= 0.0 && r >= 0.0 && c < w && r < h;
        Some((distance, !inside || self.white[r as usize * self.columns + c as usize]))
    }
}

/// A picture of targets before a background of gray patches; the nearest target hides those behind.
///
/// # Errors
/// [`DataError`] if the picture cannot be made (never for a camera that was built).
pub fn render_targets(camera: &Camera, targets: &[Target], shot: &Shot) -> DataResult<Image> {
    let (w, h) = (camera.width() as usize, camera.height() as usize);
    let placed: Vec<(&Target, Isometry3<f64>)> =
        targets.iter().map(|t| (t, t.camera_from_target.inverse())).collect();
    let brightness = |u: f64, v: f64| {
        let hit = camera.unproject(Pixel::new(u, v)).ok().and_then(|ray| {
            let hits = placed.iter().filter_map(|(target, from_camera)| target.hit(from_camera, &ray));
            hits.min_by(|a, b| a.0.total_cmp(&b.0))
        });
        match hit {
            Some((_, true)) => shot.bright,
            Some((_, false)) => shot.dark,
            None => {
                let (column, row) = ((u / 31.0).floor() as i32, (v / 23.0).floor() as i32);
                60.0 + 80.0 * unit(hash(column, row, shot.seed as u32), 0)
            }
        }
    };
    let sharp: Vec<f64> = (0..h)
        .into_par_iter()
        .flat_map_iter(|row| {
            (0..w).map(move |column| {
                let part = |i: i32| (f64::from(i) + 0.5) / f64::from(RAYS) - 0.5;
                let rays = (0..RAYS * RAYS)
                    .map(|i| brightness(column as f64 + part(i % RAYS), row as f64 + part(i / RAYS)));
                rays.sum::<f64>() / f64::from(RAYS * RAYS)
            })
        })
        .collect();
    let blurred = blur(&sharp, w, h, shot.blur_px);
    let mut rng = SplitMix::for_purpose(shot.seed, 0x7461_7267);
    let bytes = blurred.iter().map(|v| (v + shot.noise * rng.normal()).round().clamp(0.0, 255.0) as u8);
    Image::new(camera.width(), camera.height(), PixelFormat::Gray8, bytes.collect())
}

/// Smoothed with a Gaussian; the border is repeated outside.
fn blur(values: &[f64], w: usize, h: usize, sigma_px: f64) -> Vec<f64> {
    if sigma_px <= 0.0 {
        return values.to_vec();
    }
    let reach = (4.0 * sigma_px).ceil() as isize;
    let kernel: Vec<f64> = (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma_px).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let pass = |from: &[f64], at: &(dyn Fn(usize, isize) -> usize + Sync)| -> Vec<f64> {
        (0..w * h)
            .into_par_iter()
            .map(|i| (-reach..=reach).zip(&kernel).map(|(d, k)| k * from[at(i, d)]).sum::<f64>() / sum)
            .collect()
    };
    let across = pass(values, &|i, d| i / w * w + (i % w).saturating_add_signed(d).min(w - 1));
    pass(&across, &|i, d| (i / w).saturating_add_signed(d).min(h - 1) * w + i % w)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Translation3, UnitQuaternion};
    use vice_core::camera::Model;

    #[test]
    fn cells_are_where_their_corners_say() {
        let camera = Camera::new(160, 120, [150.0, 150.0, 80.0, 60.0], Model::Pinhole).unwrap();
        let pose = Isometry3::from_parts(
            Translation3::new(0.05, 0.0, 1.0),
            UnitQuaternion::from_euler_angles(0.4, 0.2, 0.1),
        );
        let board = Target::chessboard(4, 3, 0.1, pose).unwrap();
        let shot = Shot { blur_px: 0.3, noise: 0.0, ..Shot::default() };
        let image = render_targets(&camera, std::slice::from_ref(&board), &shot).unwrap();
        for row in 0..3 {
            for column in 0..4 {
                let px = board.pixel(&camera, column as f64 + 0.5, row as f64 + 0.5).unwrap();
                let value = image.data()[px.v.round() as usize * 160 + px.u.round() as usize];
                assert_eq!(value, if (row + column) % 2 == 1 { 200 } else { 40 }, "{column} {row}");
            }
        }
        let blurred = render_targets(&camera, &[board], &Shot { blur_px: 2.0, noise: 0.0, ..shot }).unwrap();
        assert_ne!(blurred, image);
        assert!(Target::new(3, vec![true; 4], 0.1, pose).is_err());
    }
}
