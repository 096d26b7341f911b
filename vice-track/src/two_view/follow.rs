//! Points from one frame to the next, for those who need many for a moment only.

use vice_core::camera::{Camera, Pixel};

use super::{Pair, Sight};
use crate::corners::corners;
use crate::lucas_kanade::track_translation;
use crate::pyramid::Pyramid;

/// Cells across the image; in each the best corners are followed.
const CELLS: usize = 12;
const A_CELL: usize = 3;
/// Corners below this are noise, gray levels a pixel.
const MIN_SCORE: f64 = 2.0;
/// Least distance to the border, pixels.
const BORDER_PX: f64 = 12.0;
/// A point must come back to where it was, within this, pixels.
const BACK_PX: f64 = 0.5;

/// Points that both frames show, spread over the image: each is followed there and back again. Few or none where the image
/// is even, blurred, or shows another place.
pub fn followed(first: &Pyramid, second: &Pyramid, camera: &Camera) -> Vec<Pair> {
    between(first, second, camera, camera)
}

/// The same for frames of two cameras.
pub fn between(first: &Pyramid, second: &Pyramid, one: &Camera, other: &Camera) -> Vec<Pair> {
    let from = spread(first);
    let there = track_translation(first, second, &from);
    let (start, end): (Vec<Pixel>, Vec<Pixel>) =
        from.iter().zip(&there).filter_map(|(a, b)| Some((*a, (*b)?))).unzip();
    let back = track_translation(second, first, &end);
    let inside = |px: &Pixel| {
        let most = (second.width() as f64 - BORDER_PX, second.height() as f64 - BORDER_PX);
        (BORDER_PX..most.0).contains(&px.u) && (BORDER_PX..most.1).contains(&px.v)
    };
    let mut pairs = Vec::with_capacity(start.len());
    for ((a, b), home) in start.iter().zip(&end).zip(&back) {
        let returned = home.is_some_and(|home| home.distance_px(*a) <= BACK_PX);
        if !(returned && inside(b)) {
            continue;
        }
        if let (Some(from), Some(to)) = (Sight::new(one, *a), Sight::new(other, *b)) {
            pairs.push(Pair { from, to });
        }
    }
    pairs
}

/// The best corners of each cell.
fn spread(image: &Pyramid) -> Vec<Pixel> {
    let mut taken = vec![0; CELLS * CELLS];
    let cell = |at: f64, size: usize| ((at / size as f64 * CELLS as f64) as usize).min(CELLS - 1);
    corners(image, BORDER_PX)
        .iter()
        .take_while(|c| c.score >= MIN_SCORE)
        .filter(|c| {
            let cell = cell(c.px.v, image.height()) * CELLS + cell(c.px.u, image.width());
            taken[cell] += 1;
            taken[cell] <= A_CELL
        })
        .map(|c| c.px)
        .collect()
}
