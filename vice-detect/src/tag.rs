//! AprilTags: a dark quadrangle, its cells read through a homography, and the family's code that they are.
//!
//! After Olson, "AprilTag: a robust and flexible visual fiducial system" (ICRA 2011) and Wang and Olson, "AprilTag 2"
//! (IROS 2016): brightness models for dark and white that vary over the tag, sharpening before cells are read.

use nalgebra::{Matrix2, Matrix3, SMatrix, SVector, Vector2, Vector3};
use vice_core::camera::{Camera, Pixel};

use crate::dark::dark;
use crate::edges;
use crate::family::TagFamily;
use crate::gray::Gray;
use crate::quads::{Quad, quads};

/// White and dark must differ by this much, gray levels.
const LEAST_CONTRAST: f64 = 12.0;
/// How much of a cell's difference from its neighbours is added: narrow cells fade into each other.
const SHARPENING: f64 = 0.25;

/// Seen more obliquely than this (the cosine of about 74 degrees), profiles across one side reach into the next: corners
/// are worse than 0.2 px then, and no labels.
const OBLIQUE: f64 = 0.28;

/// Which tags to look for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TagOptions {
    /// The family.
    pub family: TagFamily,
    /// Cells that the dark border is wide, 1 or 2 (Kalibr's AprilGrid); `None` takes both.
    pub border: Option<usize>,
}

/// A tag in one picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tag {
    /// Its number in the family.
    pub id: usize,
    /// Outer corners of the dark border: top left of the printed tag, then clockwise.
    pub corners: [Pixel; 4],
    /// Cells that were read wrongly.
    pub wrong_cells: u32,
    /// Cells of the border.
    pub border: usize,
    /// 0 to 1: how clearly the least clear cell was read, less for wrong ones.
    pub confidence: f32,
}

/// Tags of a picture, by id. The camera straightens what its lens bends; without it corners are some tenths of a pixel
/// off where distortion is strong. A tag that is there twice is there twice in the list.
pub(crate) fn find(gray: &Gray, options: TagOptions, camera: Option<&Camera>) -> Vec<Tag> {
    if gray.width < 16 || gray.height < 16 {
        return vec![];
    }
    let mut tags: Vec<Tag> =
        quads(&dark(gray), gray.width).iter().filter_map(|quad| read(gray, quad, options, camera)).collect();
    tags.sort_by(|a, b| {
        a.id.cmp(&b.id)
            .then(a.corners[0].u.total_cmp(&b.corners[0].u))
            .then(a.corners[0].v.total_cmp(&b.corners[0].v))
    });
    tags
}

fn read(gray: &Gray, quad: &Quad, options: TagOptions, camera: Option<&Camera>) -> Option<Tag> {
    let side = options.family.side();
    // Narrow cells for the first look, so that the inside of a one-cell border does not draw the edge to it.
    let sharp = edges::refine(gray, quad, side + 4, camera)?;
    let borders = options.border.map_or(vec![1, 2], |b| vec![b]);
    let readings = borders.into_iter().filter_map(|border| {
        let (id, wrong, turns, clear) = decode(gray, &sharp, options.family, border)?;
        let limit = f64::from(options.family.believable_errors() + 1);
        Some((border, id, wrong, turns, clear * (1.0 - 0.5 * f64::from(wrong) / limit)))
    });
    // The cells of a small family may read alike, if less clearly, where the border is taken for narrower than it is.
    let (border, id, wrong_cells, turns, confidence) = readings.max_by(|a, b| a.4.total_cmp(&b.4))?;
    let corners = edges::refine(gray, &sharp, side + 2 * border, camera).unwrap_or(sharp);
    let (narrow, wide) = widths(&corners);
    if narrow < OBLIQUE * wide {
        return None;
    }
    let corner = |i: usize| {
        let c = corners[(i + 4 - turns) % 4];
        Pixel::new(c.x, c.y)
    };
    let corners = [corner(0), corner(1), corner(2), corner(3)];
    Some(Tag { id, corners, wrong_cells, border, confidence: confidence as f32 })
}

/// How wide a tag is in the picture where it is narrowest and widest, pixels: the singular values of its mean sides.
fn widths(quad: &Quad) -> (f64, f64) {
    let [a, b, c, d] = *quad;
    let sides = Matrix2::from_columns(&[(b - a + c - d) / 2.0, (d - a + c - b) / 2.0]);
    let widths = sides.singular_values();
    (widths.min(), widths.max())
}

/// Id, wrong cells, turns, and how clear the least clear cell is.
fn decode(gray: &Gray, quad: &Quad, family: TagFamily, border: usize) -> Option<(usize, u32, usize, f64)> {
    let n = family.side() + 2 * border;
    let pixel_from_tag = homography(quad)?;
    let sample = |column: f64, row: f64| {
        let p = pixel_from_tag * Vector3::new(column / n as f64, row / n as f64, 1.0);
        gray.sample(p.x / p.z, p.y / p.z).map(f64::from)
    };
    let mut values = vec![0.0; n * n];
    for row in 0..n {
        for column in 0..n {
            let (c, r) = (column as f64 + 0.5, row as f64 + 0.5);
            let spots = [(0.0, 0.0), (0.2, 0.2), (-0.2, 0.2), (0.2, -0.2), (-0.2, -0.2)];
            let mut sum = 0.0;
            for (dc, dr) in spots {
                sum += sample(c + dc, r + dr)?;
            }
            values[row * n + column] = sum / spots.len() as f64;
        }
    }
    let in_border = |row: usize, column: usize| row.min(column) < border || row.max(column) >= n - border;
    let place = |row: usize, column: usize| (column as f64 + 0.5, row as f64 + 0.5);
    let dark: Vec<((f64, f64), f64)> =
        (0..n * n).filter(|i| in_border(i / n, i % n)).map(|i| (place(i / n, i % n), values[i])).collect();
    // Around the tag, but not beside its corners, where an AprilGrid has dark squares.
    let far = n as f64 + 0.6;
    let white: Vec<((f64, f64), f64)> = (1..n - 1)
        .flat_map(|i| {
            let along = i as f64 + 0.5;
            [(along, -0.6), (along, far), (-0.6, along), (far, along)]
        })
        .filter_map(|(c, r)| Some(((c, r), sample(c, r)?)))
        .collect();
    let (dark_model, white_model) = (plane(&dark)?, plane(&white)?);
    let levels = |row: usize, column: usize| {
        let (c, r) = place(row, column);
        let at = Vector3::new(c, r, 1.0);
        (dark_model.dot(&at), white_model.dot(&at))
    };
    let mut off_border = 0;
    let mut clear: f64 = 1.0;
    let mut cells = Vec::with_capacity(family.side() * family.side());
    for row in 0..n {
        for column in 0..n {
            let (low, high) = levels(row, column);
            if high - low < LEAST_CONTRAST {
                return None;
            }
            let v = values[row * n + column];
            // -1 where dark, 1 where white.
            let scaled = |v: f64| 2.0 * (v - low) / (high - low) - 1.0;
            if in_border(row, column) {
                off_border += usize::from(scaled(v) > -0.2);
                continue;
            }
            let beside = values[(row - 1) * n + column]
                + values[(row + 1) * n + column]
                + values[row * n + column - 1]
                + values[row * n + column + 1];
            let sharp = scaled(v + SHARPENING * (4.0 * v - beside));
            clear = clear.min(sharp.abs());
            cells.push(sharp > 0.0);
        }
    }
    if off_border * 20 > n * n - cells.len() {
        return None;
    }
    family.find(&cells).map(|(id, wrong, turns)| (id, wrong, turns, clear))
}

/// A plane through values, `v = model · (x, y, 1)`.
fn plane(values: &[((f64, f64), f64)]) -> Option<Vector3<f64>> {
    let mut normal = Matrix3::zeros();
    let mut right = Vector3::zeros();
    for ((x, y), v) in values {
        let row = Vector3::new(*x, *y, 1.0);
        normal += row * row.transpose();
        right += row * *v;
    }
    normal.cholesky().map(|c| c.solve(&right))
}

/// The homography that takes the unit square to a quadrangle, (0, 0) to its first corner and (1, 0) to its second.
pub(crate) fn homography(quad: &[Vector2<f64>; 4]) -> Option<Matrix3<f64>> {
    let mut a = SMatrix::<f64, 8, 8>::zeros();
    let mut b = SVector::<f64, 8>::zeros();
    for (i, ((x, y), p)) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].into_iter().zip(quad).enumerate()
    {
        let rows =
            [[x, y, 1.0, 0.0, 0.0, 0.0, -p.x * x, -p.x * y], [0.0, 0.0, 0.0, x, y, 1.0, -p.y * x, -p.y * y]];
        for (k, row) in rows.into_iter().enumerate() {
            a.set_row(2 * i + k, &SVector::<f64, 8>::from(row).transpose());
            b[2 * i + k] = if k == 0 { p.x } else { p.y };
        }
    }
    let h = a.lu().solve(&b)?;
    Some(Matrix3::new(h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0))
}
