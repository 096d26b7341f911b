//! Saddles of the brightness: where two dark and two bright squares meet.
//!
//! Found as maxima of `Lxy² - Lxx Lyy` of the smoothed picture, and placed between pixels as the saddle of a quadratic
//! fitted to the surroundings (Lucchese and Mitra 2002; Placht et al. 2014). Unlike a fit of edge normals, this keeps to
//! its place when bright squares bleed into dark ones, since both dark squares shrink alike.

use nalgebra::{Matrix2, Matrix6, Vector2, Vector6};

use crate::gray::Gray;

/// Width of the smoothing before derivatives are taken, pixels.
pub(crate) const SMOOTHING_PX: f32 = 1.5;
/// Weaker responses are noise: that of squares that differ by about 15 gray levels.
const WEAKEST: f32 = 2.0;
/// More candidates than these are texture; the strongest are kept.
const MOST: usize = 3000;

/// A place where the picture is a saddle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Saddle {
    pub(crate) x: f64,
    pub(crate) y: f64,
    /// Strength of the response.
    pub(crate) response: f32,
    /// Unit vector along which the brightness curves upwards: through the bright squares.
    pub(crate) bright: Vector2<f64>,
    /// Unit vectors along the two edges that cross.
    pub(crate) edges: [Vector2<f64>; 2],
}

/// All saddles of a smoothed picture, the strongest first.
pub(crate) fn find(smooth: &Gray) -> Vec<Saddle> {
    let (w, h) = (smooth.width, smooth.height);
    if w < 8 || h < 8 {
        return vec![];
    }
    let mut response = vec![0.0_f32; w * h];
    for y in 1..h - 1 {
        let above = &smooth.data[(y - 1) * w..y * w];
        let here = &smooth.data[y * w..(y + 1) * w];
        let below = &smooth.data[(y + 1) * w..(y + 2) * w];
        let out = &mut response[y * w + 1..(y + 1) * w - 1];
        let windows = above.windows(3).zip(here.windows(3)).zip(below.windows(3));
        for (o, ((a, c), b)) in out.iter_mut().zip(windows) {
            let (xx, yy) = (c[0] - 2.0 * c[1] + c[2], a[1] - 2.0 * c[1] + b[1]);
            let xy = 0.25 * (a[0] - a[2] - b[0] + b[2]);
            *o = xy * xy - xx * yy;
        }
    }
    let mut peaks: Vec<(f32, usize, usize)> = Vec::new();
    for y in 3..h - 3 {
        for x in 3..w - 3 {
            let at = y * w + x;
            let r = response[at];
            if r <= WEAKEST {
                continue;
            }
            let beats = |other: usize| r > response[other] || (r == response[other] && at < other);
            let rows = [at - 2 * w, at - w, at, at + w, at + 2 * w];
            if rows.iter().all(|row| (row - 2..=row + 2).all(|other| other == at || beats(other))) {
                peaks.push((r, x, y));
            }
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.2, a.1).cmp(&(b.2, b.1))));
    peaks.truncate(MOST);
    peaks.into_iter().filter_map(|(r, x, y)| describe(smooth, r, x, y)).collect()
}

fn describe(smooth: &Gray, response: f32, x: usize, y: usize) -> Option<Saddle> {
    let (px, py) = refine(smooth, x as f64, y as f64, 2)?;
    // Derivatives over two pixels: the direction of an edge is steadier there than its place.
    let v = |dx: f64, dy: f64| smooth.sample(px + dx, py + dy).map(f64::from);
    let c = v(0.0, 0.0)?;
    let (xx, yy) = (v(-2.0, 0.0)? - 2.0 * c + v(2.0, 0.0)?, v(0.0, -2.0)? - 2.0 * c + v(0.0, 2.0)?);
    let xy = 0.25 * (v(-2.0, -2.0)? - v(2.0, -2.0)? - v(-2.0, 2.0)? + v(2.0, 2.0)?);
    let middle = 0.5 * (xx + yy);
    let swing = (0.25 * (xx - yy).powi(2) + xy * xy).sqrt();
    // Curvatures along the two main directions; a saddle has one of each sign.
    let (up, down) = (middle + swing, middle - swing);
    if up <= 0.0 || down >= 0.0 || middle.abs() > 0.6 * swing {
        return None;
    }
    let phi = 0.5 * (2.0 * xy).atan2(xx - yy);
    let edge = (up / -down).sqrt().atan();
    let unit = |angle: f64| Vector2::new(angle.cos(), angle.sin());
    Some(Saddle { x: px, y: py, response, bright: unit(phi), edges: [unit(phi - edge), unit(phi + edge)] })
}

/// The saddle of a quadratic fitted to the `(2 reach + 1)²` pixels around a place, moved there until it stays.
/// `None` if there is none within `reach` pixels of where it began.
pub(crate) fn refine(smooth: &Gray, x: f64, y: f64, reach: usize) -> Option<(f64, f64)> {
    let (start_x, start_y) = (x, y);
    let (mut x, mut y) = (x, y);
    let normal = normal_inverse(reach)?;
    let r = reach as i32;
    for _ in 0..12 {
        let mut sums = Vector6::zeros();
        for j in -r..=r {
            for i in -r..=r {
                let (dx, dy) = (f64::from(i), f64::from(j));
                let v = f64::from(smooth.sample(x + dx, y + dy)?);
                sums += Vector6::new(dx * dx, dx * dy, dy * dy, dx, dy, 1.0) * v;
            }
        }
        let c = normal * sums;
        let hessian = Matrix2::new(2.0 * c[0], c[1], c[1], 2.0 * c[2]);
        if hessian.determinant() >= 0.0 {
            return None;
        }
        let step = -(hessian.try_inverse()? * Vector2::new(c[3], c[4]));
        let limited = step * (1.0 / step.norm().max(1.0));
        x += limited.x;
        y += limited.y;
        if (x - start_x).hypot(y - start_y) > reach as f64 {
            return None;
        }
        if step.norm() < 1e-3 {
            return Some((x, y));
        }
    }
    None
}

/// The inverse of the normal equations of the quadratic's fit, which depend on the window only.
fn normal_inverse(reach: usize) -> Option<Matrix6<f64>> {
    let r = reach as i32;
    let mut normal = Matrix6::zeros();
    for j in -r..=r {
        for i in -r..=r {
            let (dx, dy) = (f64::from(i), f64::from(j));
            let row = Vector6::new(dx * dx, dx * dy, dy * dy, dx, dy, 1.0);
            normal += row * row.transpose();
        }
    }
    normal.try_inverse()
}

#[cfg(test)]
mod tests {
    use super::*;
    use vice_core::dataset::{Image, PixelFormat};

    #[test]
    fn a_crossing_is_found_between_pixels() {
        // Mean brightness of each pixel over 8x8 parts: four squares that meet at (20.3, 15.6), turned by 20 degrees.
        let (cx, cy, turn) = (20.3_f64, 15.6_f64, 20.0_f64.to_radians());
        let data = (0..32 * 40).map(|i| {
            let (px, py) = (f64::from(i % 40), f64::from(i / 40));
            let bright = (0..64).filter(|s| {
                let (dx, dy) = (
                    px + (f64::from(s % 8) + 0.5) / 8.0 - 0.5 - cx,
                    py + (f64::from(s / 8) + 0.5) / 8.0 - 0.5 - cy,
                );
                let (a, b) = (dx * turn.cos() + dy * turn.sin(), -dx * turn.sin() + dy * turn.cos());
                a * b > 0.0
            });
            (40 + 2 * bright.count()) as u8
        });
        let image = Image::new(40, 32, PixelFormat::Gray8, data.collect()).unwrap();
        let smooth = Gray::of(&image).blurred(SMOOTHING_PX);
        let found = find(&smooth);
        assert_eq!(found.len(), 1, "{found:?}");
        let s = &found[0];
        assert!((s.x - cx).hypot(s.y - cy) < 0.03, "{s:?}");
        let along = |angle: f64, v: Vector2<f64>| (angle.cos() * v.x + angle.sin() * v.y).abs();
        assert!(along(turn + std::f64::consts::FRAC_PI_4, s.bright) > 0.99, "{s:?}");
        let quarter = std::f64::consts::FRAC_PI_2;
        assert!(s.edges.iter().all(|e| along(turn, *e).max(along(turn + quarter, *e)) > 0.99), "{s:?}");
    }
}
