//! Whether what surrounds a place is seen again beside it, as in bricks and grids: a tracker may slip from one to the
//! next, and nothing in the image tells.

use vice_core::camera::Pixel;

use crate::pyramid::Pyramid;

/// Half a side of the window that is compared, pixels.
const REACH: isize = 10;
/// How far off lookalikes are looked for: as far as windows slip.
const SEARCH: isize = 14;
/// Nearer than this is the place itself.
const NEAR: isize = 3;

/// Correlation of the window around a place with its best lookalike within 14 pixels: 1 for a perfect grid, 0 where
/// there is none or the windows are not all in the image.
pub fn lookalike(image: &Pyramid, px: Pixel) -> f64 {
    let level = image.base();
    let (x, y) = (px.u.round() as isize, px.v.round() as isize);
    let margin = REACH + SEARCH;
    let inside =
        x >= margin && y >= margin && x + margin < level.width as isize && y + margin < level.height as isize;
    if !inside {
        return 0.0;
    }
    let window = |dx: isize, dy: isize| {
        let rows = (y + dy - REACH) as usize..=(y + dy + REACH) as usize;
        let left = (x + dx - REACH) as usize;
        rows.flat_map(move |row| &level.pixels[row * level.width + left..][..2 * REACH as usize + 1])
    };
    let count = ((2 * REACH + 1) * (2 * REACH + 1)) as f64;
    let here: Vec<f64> = window(0, 0).map(|p| f64::from(*p)).collect();
    let mean = here.iter().sum::<f64>() / count;
    let centred: Vec<f64> = here.iter().map(|v| v - mean).collect();
    let length = centred.iter().map(|v| v * v).sum::<f64>().sqrt();
    let side = 2 * SEARCH + 1;
    let correlations: Vec<f64> = (-SEARCH..=SEARCH)
        .flat_map(|dy| (-SEARCH..=SEARCH).map(move |dx| (dx, dy)))
        .map(|(dx, dy)| {
            let (mut product, mut sum, mut squares) = (0.0, 0.0, 0.0);
            for (a, b) in centred.iter().zip(window(dx, dy)) {
                let b = f64::from(*b);
                product += a * b;
                sum += b;
                squares += b * b;
            }
            let other = (squares - sum * sum / count).max(0.0).sqrt();
            if length * other > 0.0 { product / (length * other) } else { 0.0 }
        })
        .collect();
    let at = |dx: isize, dy: isize| correlations[((dy + SEARCH) * side + dx + SEARCH) as usize];
    let mut best = 0.0_f64;
    for (dx, dy) in (1 - SEARCH..SEARCH).flat_map(|dy| (1 - SEARCH..SEARCH).map(move |dx| (dx, dy))) {
        let neighbours = (-1..=1).flat_map(|j| (-1..=1).map(move |i| (i, j)));
        let is_peak = neighbours.into_iter().all(|(i, j)| at(dx + i, dy + j) <= at(dx, dy));
        if is_peak && dx.abs().max(dy.abs()) > NEAR {
            best = best.max(at(dx, dy));
        }
    }
    best
}
