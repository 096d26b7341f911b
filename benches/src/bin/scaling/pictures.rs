//! Pictures of a chessboard.

use std::path::Path;

use image::{GrayImage, Luma};
use vice_benches::flight::{FRAME_NS, START_NS};

use crate::Result;

/// Columns and rows of a picture, as the flight's camera has them.
const SIZE: (u32, u32) = (752, 480);
/// Squares of the board, and the pixels that each is wide: 7 by 5 inner corners.
const SQUARES: (u32, u32) = (8, 6);
const SQUARE: u32 = 50;

/// Writes so many frames of the flight, in each of which a board lies a little further on its way round.
pub(crate) fn write_boards(folder: &Path, frames: usize) -> Result<()> {
    let images = folder.join("flight/mav0/cam0/data");
    for i in 0..frames {
        let angle = 0.2 * i as f64;
        let (left, top) = (150.0 + 60.0 * angle.cos(), 80.0 + 40.0 * angle.sin());
        let picture =
            GrayImage::from_fn(SIZE.0, SIZE.1, |u, v| Luma([gray(f64::from(u) - left, f64::from(v) - top)]));
        picture.save(images.join(format!("{}.png", START_NS + FRAME_NS * i as u64)))?;
    }
    Ok(())
}

/// Gray at a place on the board or on the paper around it; edges are as soft as a lens makes them.
fn gray(x: f64, y: f64) -> u8 {
    const SAMPLES: u32 = 4;
    let mut sum = 0;
    for (i, j) in (0..SAMPLES).flat_map(|i| (0..SAMPLES).map(move |j| (i, j))) {
        let at = |v: f64, k: u32| v + (f64::from(k) + 0.5) / f64::from(SAMPLES) - 0.5;
        let square = |v: f64, count: u32| {
            let square = (v / f64::from(SQUARE)).floor();
            (0.0..f64::from(count)).contains(&square).then_some(square as u32)
        };
        let on_board = square(at(x, i), SQUARES.0).zip(square(at(y, j), SQUARES.1));
        sum += if on_board.is_some_and(|(a, b)| (a + b).is_multiple_of(2)) { 30 } else { 220 };
    }
    (sum / (SAMPLES * SAMPLES)) as u8
}
